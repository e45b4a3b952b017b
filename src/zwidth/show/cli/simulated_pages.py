"""What people read of a simulated contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.answer import Row, sheet, table
from zwidth.show.cli.energies import HEADINGS, energy_rows
from zwidth.show.cli.heading import ROUNDING, heading
from zwidth.show.units import amount, given, percent, signed, typed, uncertain

if TYPE_CHECKING:
    from zwidth.contact.environments import Environment
    from zwidth.device.device import Device
    from zwidth.show.cli.options import Question
    from zwidth.show.cli.simulated import Simulated

SAYS: Final = {
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


def pages(question: Question, device: Device, found: Simulated, document: dict[str, Any]) -> Iterator[Any]:
    """The verdict, the circumstances, the numbers, the energies, and what is worth a remark."""
    yield heading(question, device, linear=False)
    yield _verdict(found)
    yield sheet([*_circumstances(found, document), *_results(found, document)])
    yield table(HEADINGS, list(_energies(found, document)))
    yield from _remarks(found, document)
    if "sound" in document:
        yield _sound(document["sound"])
    if "file" in document:
        yield f"written: {document['file']}"


def _verdict(found: Simulated) -> str:
    if found.behaviour == "undecided" and found.range_exit is not None:
        return "undecided: the motion leaves the range of the handle before the run tells"
    return SAYS[found.behaviour]


def _circumstances(found: Simulated, document: dict[str, Any]) -> Iterator[Row]:
    place = f", at {amount(document['wall_position_m'], 'm')}" if document["wall_position_m"] else ""
    yield "touched", f"{environment_words(found.environment, document['parameters'])}{place}"
    yield "start", _start(document)
    yield "hand", _hand(document["hand"])
    why = f" ({found.length.why})"
    yield "simulated", f"{amount(document['duration_s'], 's')}, {len(found.response.time)} samples{why}"


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


def _start(document: dict[str, Any]) -> str:
    start = document["start"]
    depth = start["position_m"] - document["wall_position_m"]
    where = f"{amount(abs(depth), 'm')} {'inside' if depth > 0.0 else 'outside'}" if depth else "at its position"
    speed = start["velocity_m_per_s"]
    beside = start["off_the_path_m"] or 0.0
    path = f", {amount(beside, 'm')} beside the handle's path" if beside > ROUNDING else ""
    moving = f"at {typed(given(speed, 'm/s'))}" if speed else "at rest"
    return f"{where}, {moving}{path}"


def _hand(hand: dict[str, Any]) -> str:
    told = []
    if hand["push_N"]:
        ramp = f", growing over {amount(hand['ramp_s'], 's')}" if hand["ramp_s"] else ""
        told.append(f"pushes with {amount(hand['push_N'], 'N')}{ramp}")
    if own := hand["reach"]:
        told.append(f"reaches by {amount(own['distance_m'], 'm')} in {amount(own['duration_s'], 's')}")
    if own := hand["tremor"]:
        told.append(f"trembles with {amount(own['amplitude_N'], 'N')} at {amount(own['frequency_Hz'], 'Hz')}")
    if own := hand["reflex"]:
        stiffer = amount(own["stiffness_N_per_m"], "N/m")
        told.append(f"stiffens by {stiffer} above {amount(own['threshold_N'], 'N')}")
    return ", ".join(told) or "does not push"


def _results(found: Simulated, document: dict[str, Any]) -> Iterator[Row]:
    judged = found.judgement
    yield "amplitude at the end", amount(judged.amplitude, "m")
    if isfinite(judged.frequency):
        yield "dominant frequency", amount(judged.frequency, "Hz")
    none = "too fast to tell" if found.response.given_up else "no motion is left"
    growth = f"{typed(signed(judged.growth))} per sample" if isfinite(judged.growth) else none
    if found.predicted is not None:
        left = found.loop.plant.nonlinear.left_out
        linear = " of the linear loop" if left or isfinite(found.limit) else ""
        growth += f"; by the eigenvalues{linear} {typed(signed(found.predicted))}"
    yield "growth", growth
    if found.environment.surface:
        yield "in contact", f"{typed(percent(judged.contact))} of the second half"
    if document["limited_share"] > 0.0:
        share = f"{typed(percent(document['limited_share']))} of the samples"
        yield "at the force limit", f"{share}, {amount(found.limit, 'N')}"
    if document["passivity"] is not None:
        own = document["passivity"]
        yield "rendered stiffness", amount(own["rendered_stiffness_N_per_m"], "N/m")
        other = own["without"]
        yield (
            "without controller",
            f"{amount(other['rendered_stiffness_N_per_m'], 'N/m')}; {SAYS[other['behaviour']]}",
        )


def _energies(found: Simulated, document: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    entries = {name.replace("_", " "): energy for name, energy in document["ledger_J"].items()}
    return energy_rows(entries, float(found.response.stored[-1]))


def _remarks(found: Simulated, document: dict[str, Any]) -> Iterator[str]:
    import numpy as np

    response, judged = found.response, found.judgement
    if found.environment.surface and document["start"]["inside"]:
        yield "starts inside the wall"
    if not np.ptp(response.handle) > 0.0 and _rubs(found):
        largest = amount(float(np.max(np.abs(response.force))), "N")
        yield f"dry friction holds it: the wall's force, {largest}, and the hand's do not overcome it"
    elif not np.ptp(response.handle) > 0.0:
        yield "nothing moves it: give --push, --start-velocity or --start-position"
    if response.given_up:
        yield "given up: the device is farther from the wall than any device goes"
    if (beyond := found.range_exit) is not None:
        back, forth = amount(beyond.backward, "m"), amount(beyond.forward, "m")
        yield (
            f"from {amount(beyond.time, 's')} on the run says nothing of this device: along this direction "
            f"its handle gets from {back} to {forth}, and the model knows no end of the way; `zwidth move` does"
        )
    if response.quantum > 2.0 * judged.amplitude > 0.0:
        yield f"the motion is smaller than the encoder's step of {amount(response.quantum, 'm')}"
    if judged.frequency > NEAR_NYQUIST * 0.5 / found.loop.period:
        yield "the vibration is as fast as sampling lets it be: it alternates from sample to sample"
    if found.environment.surface and abs(found.hand.push) > found.limit:
        yield "the hand pushes harder than the largest force there is"
    if found.loop.plant.handle is None:
        yield "no handle is known: it is taken to be where the sensor is"
    if response.imbalance > 1e-6:
        yield f"the energies miss adding up by {typed(uncertain(100.0 * response.imbalance))} % of the largest"


def _rubs(found: Simulated) -> bool:
    """Does dry friction stand against a force?"""
    import numpy as np

    pushed = bool(np.any(found.response.force != 0.0)) or found.hand.push != 0.0
    return pushed and "dry friction" in found.loop.plant.nonlinear.left_out


def _sound(sound: dict[str, Any]) -> str:
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
