"""What people read of a simulated contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.answer import Row, sheet, table
from zwidth.show.cli.energies import HEADINGS, energy_rows
from zwidth.show.cli.heading import ROUNDING
from zwidth.show.units import amount, given, percent, signed, typed, uncertain

if TYPE_CHECKING:
    from zwidth.contact.contact_simulation import ContactSimulation
    from zwidth.contact.environments import Environment
    from zwidth.contact.hand import Hand

VERDICTS: Final = {
    "converged": "stable: it comes to rest",
    "decaying": "stable: the vibration dies away",
    "growing": "not stable: the vibration grows",
    "limit cycle": "not stable: a limit cycle, which neither grows nor dies away",
    "bouncing": "not stable: it bounces in and out without an end",
    "lost contact": "not stable: contact is lost, and does not come back",
    "forced": "undecided: it goes with the hand's tremor; leave --tremor out to see what the wall does by itself",
    "undecided": "undecided: this run does not tell; try a longer --duration",
}
NEAR_NYQUIST: Final = 0.9


def page(found: ContactSimulation, sound: Mapping[str, Any] | None) -> Iterator[Any]:
    """The verdict, the circumstances, the numbers, the energies, what is worth a remark, and a sound if one was
    written."""
    yield _verdict(found)
    yield sheet([*_circumstances(found), *_results(found)])
    yield table(HEADINGS, list(energy_rows(found.ledger, float(found.energy[-1]))))
    yield from _remarks(found)
    if sound is not None:
        yield _sound(sound)


def _verdict(found: ContactSimulation) -> str:
    if found.behaviour == "undecided" and found.range_exit is not None:
        return "undecided: the motion leaves the range of the handle before the run tells"
    return VERDICTS[found.behaviour]


def _circumstances(found: ContactSimulation) -> Iterator[Row]:
    place = f", at {amount(found.wall_position, 'm')}" if found.wall_position else ""
    yield "touched", f"{environment_words(found.environment, found.parameters)}{place}"
    yield "start", _start(found)
    yield "hand", _hand(found.hand)
    why = f" ({found.length.reason})"
    yield "simulated", f"{amount(float(found.time[-1]), 's')}, {len(found.time)} samples{why}"


def environment_words(environment: Environment, values: Mapping[str, float]) -> str:
    """An environment and its parameters: "slot: width 5 mm, stiffness 1 kN/m, damping 0 Ns/m"."""
    units = {p.name: p.unit for p in environment.parameters if not p.switch}
    told = [f"{name.replace('_', ' ')} {_number(values[name], unit)}" for name, unit in units.items()]
    told += [name.replace("_", " ") for name, on in values.items() if name not in units and on]
    name = "two-sided wall" if environment.name == "wall" else environment.name
    return f"{name}: {', '.join(told)}" if told else name


def _number(value: float, unit: str) -> str:
    """A parameter with its unit; inf is one, too."""
    return amount(value, unit.replace("N s", "Ns")) if isfinite(value) else "inf"


def _start(found: ContactSimulation) -> str:
    depth = found.start_position - found.wall_position
    where = f"{amount(abs(depth), 'm')} {'inside' if depth > 0.0 else 'outside'}" if depth else "at its position"
    beside = found.distance_from_path or 0.0
    path = f", {amount(beside, 'm')} beside the handle's path" if beside > ROUNDING else ""
    moving = f"at {typed(given(found.start_velocity, 'm/s'))}" if found.start_velocity else "at rest"
    return f"{where}, {moving}{path}"


def _hand(hand: Hand) -> str:
    told = []
    if hand.push:
        ramp = f", growing over {amount(hand.ramp, 's')}" if hand.ramp else ""
        told.append(f"pushes with {amount(hand.push, 'N')}{ramp}")
    if hand.reach:
        told.append(f"reaches by {amount(hand.reach.distance, 'm')} in {amount(hand.reach.duration, 's')}")
    if hand.tremor:
        trembling = f"{amount(hand.tremor.amplitude, 'N')} at {amount(hand.tremor.frequency, 'Hz')}"
        told.append(f"trembles with {trembling}")
    if hand.reflex:
        stiffer = amount(hand.reflex.arm_stiffness, "N/m")
        told.append(f"stiffens by {stiffer} above {amount(hand.reflex.threshold, 'N')}")
    return ", ".join(told) or "does not push"


def _results(found: ContactSimulation) -> Iterator[Row]:
    yield "amplitude at the end", amount(found.amplitude, "m")
    if isfinite(found.dominant_frequency):
        yield "dominant frequency", amount(found.dominant_frequency, "Hz")
    none = "too fast to tell" if found.given_up else "no motion is left"
    growth = f"{typed(signed(found.growth))} per sample" if isfinite(found.growth) else none
    if found.predicted_growth is not None:
        left = found.loop.plant.nonlinear.left_out
        linear = " of the linear loop" if left or isfinite(found.force_limit) else ""
        growth += f"; by the eigenvalues{linear} {typed(signed(found.predicted_growth))}"
    yield "growth", growth
    if found.environment.surface:
        yield "in contact", f"{typed(percent(found.contact_share))} of the second half"
    if found.limited_share > 0.0:
        share = f"{typed(percent(found.limited_share))} of the samples"
        yield "at the force limit", f"{share}, {amount(found.force_limit, 'N')}"
    if found.passivity is not None:
        yield "rendered stiffness", amount(found.passivity.rendered_stiffness, "N/m")
        other = amount(found.passivity.uncontrolled_stiffness, "N/m")
        yield "without controller", f"{other}; {VERDICTS[found.passivity.uncontrolled.behaviour]}"


def _remarks(found: ContactSimulation) -> Iterator[str]:
    import numpy as np

    if found.environment.surface and found.starts_inside:
        yield "starts inside the wall"
    if not np.ptp(found.handle) > 0.0 and _rubs(found):
        largest = amount(float(np.max(np.abs(found.force))), "N")
        yield f"dry friction holds it: the wall's force, {largest}, and the hand's do not overcome it"
    elif not np.ptp(found.handle) > 0.0:
        yield "nothing moves it: give --push, --start-velocity or --start-position"
    if found.given_up:
        yield "given up: the device is farther from the wall than any device goes"
    if (beyond := found.range_exit) is not None:
        back, forth = amount(beyond.backward, "m"), amount(beyond.forward, "m")
        yield (
            f"from {amount(beyond.time, 's')} on the run says nothing of this device: along this direction "
            f"its handle gets from {back} to {forth}, and the model knows no end of the way; `zwidth move` does"
        )
    if found.response.quantum > 2.0 * found.amplitude > 0.0:
        yield f"the motion is smaller than the encoder's step of {amount(found.response.quantum, 'm')}"
    if found.dominant_frequency > NEAR_NYQUIST * 0.5 / found.loop.period:
        yield "the vibration is as fast as sampling lets it be: it alternates from sample to sample"
    if found.environment.surface and abs(found.hand.push) > found.force_limit:
        yield "the hand pushes harder than the largest force there is"
    if found.loop.plant.handle is None:
        yield "no handle is known: it is taken to be where the sensor is"
    if found.response.imbalance > 1e-6:
        missing = typed(uncertain(100.0 * found.response.imbalance))
        yield f"the energies miss adding up by {missing} % of the largest"


def _rubs(found: ContactSimulation) -> bool:
    """Does dry friction stand against a force?"""
    import numpy as np

    pushed = bool(np.any(found.force != 0.0)) or found.hand.push != 0.0
    return pushed and "dry friction" in found.loop.plant.nonlinear.left_out


def _sound(sound: Mapping[str, Any]) -> str:
    speed, frequency = sound["speed"], sound["frequency_Hz"]
    text = f"sound: {amount(sound['seconds'], 's')}"
    if speed != 1.0:
        how = f"{speed:g} times faster" if speed > 1.0 else f"{1.0 / speed:g} times slower"
        text += f", {how}: {amount(frequency / speed, 'Hz')} sounds as {amount(frequency, 'Hz')}"
    else:
        text += f", {amount(frequency, 'Hz')}"
    if sound["repeats"] > 1:
        text += f"; the run {sound['repeats']} times over"
    return text
