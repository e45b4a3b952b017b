"""The report's sentences, each computed from what was found: another device makes them say another thing."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import Final

import numpy as np

from zwidth.chart.decay import FastestDecay
from zwidth.loop.controller import Butterworth, Controller, FirstOrder
from zwidth.loop.estimators import METHODS, BackwardDifference
from zwidth.model.mechanism import Floats
from zwidth.show.figures.decay import tenfold_time
from zwidth.show.motions import counted
from zwidth.show.report.facts import Facts
from zwidth.show.units import MINUS, given, number, percent, point, quantity
from zwidth.study.what_if import REMEDIES, WORTH, Variant, find, limiting_change

NO_WALL: Final = "no wall with positive stiffness and without negative damping is stable"


def summary(facts: Facts) -> list[str]:
    """What a reader in a hurry wants to know, in at most a handful of sentences."""
    found = [warning(facts), renders(facts), limit(facts), vibration(facts), next_best(facts), regions(facts)]
    found += [unobserved(facts), left_out(facts)]
    return [sentence for sentence in found if sentence]


def warning(facts: Facts) -> str:
    """Said before all else where the device runs away by itself; "" where it does not."""
    if not facts.runs_away:
        return ""
    names = listed(counted(facts.chart.unobserved_modes))
    return (
        f"Warning: this device runs away whatever the wall, by a motion that no wall moves: {names}; "
        "what is said below leaves that motion out."
    )


def where(facts: Facts) -> str:
    """Along which direction, at which position: "Along y at (0, 0.25) m "; "" for a plant."""
    if facts.posture is None or facts.direction is None:
        return ""
    return f"Along {direction_name(facts.direction)} at {point(facts.posture.position)} "


def direction_name(direction: Floats) -> str:
    """y, −x, or the vector where it is not an axis."""
    for axis, unit in zip("xyz", np.eye(3), strict=True):
        for sign, mark in ((1.0, ""), (-1.0, MINUS)):
            if np.allclose(direction, sign * unit, rtol=0.0, atol=1e-9):
                return mark + axis
    return point(direction, "")


def renders(facts: Facts) -> str:
    """The largest stiffness, and at which damping."""
    start = f"{where(facts)}this device"
    if facts.model != "full":
        start = f"{where(facts)}the {facts.model} model of this device"
    start = start[0].upper() + start[1:]
    if not facts.renders:
        return f"{start} renders no wall: {NO_WALL}."
    stiffness = quantity(facts.base.stiffness_max, "N/m")
    if facts.base.damping <= 1e-9 * facts.chart.box[3]:
        return (
            f"{start} renders walls of up to {stiffness}, those without any virtual damping; "
            "every bit of damping lowers the largest stiffness."
        )
    return (
        f"{start} renders walls of up to {stiffness}, "
        f"at {quantity(facts.base.damping, 'Ns/m')} of virtual damping."
    )


def vibration(facts: Facts) -> str:
    """What happens at a wall that is too stiff; "" where none is stable."""
    frequencies = facts.base.frequencies
    if not frequencies:
        return ""
    if len(frequencies) > 1:
        return f"There two vibrations set in at once, at {listed([hertz(f) for f in frequencies])}."
    nyquist = 0.5 / facts.loop.period
    if frequencies[0] <= 1e-9 * nyquist:
        return "A stiffer wall drifts away without vibrating."
    if frequencies[0] >= nyquist * (1.0 - 1e-9):
        return f"A stiffer wall makes the force alternate from sample to sample, at {hertz(nyquist)}."
    return f"A stiffer wall vibrates at {hertz(frequencies[0])}."


def limit(facts: Facts) -> str:
    """Which single change gains most, hence what limits the device; and what one sample of delay would leave."""
    best = limiting_change(facts.variants)
    if best is None:
        text = "None of the single changes tried lets it render a stiffer wall"
    else:
        verb = "limits" if facts.renders else "prevents"
        text = f"What {verb} it is {_cause(facts, best)}: {_with(facts, best)} it would reach {_reached(best)}"
    return f"{text}; {late}." if (late := _late(facts)) else f"{text}."


def _cause(facts: Facts, best: Variant) -> str:
    controller = facts.loop.controller
    flexible = [hertz(f) for f in facts.natural if f > 0.0]
    if best.key == "rigid-drives":
        what = "the flexibility of the drives" if facts.device.mechanism is not None else "its flexibility"
        return f"{what}, at {listed(flexible)}" if flexible else what
    if best.key == "no-delay":
        return f"the delay of {delay_name(controller)}"
    if best.key == "no-filter":
        return "the filter of the velocity"
    if best.key == "collocated":
        return "that the sensor does not sit where the wall acts"
    if best.key == "half-period":
        mass = float(facts.effective.rigid_mass)
        moved = "its mass" if isnan(mass) else f"its mass of {quantity(mass, 'kg')}"
        return f"{moved}, sampled at {given(1.0 / controller.sampling_period, 'Hz')}"
    return "how little it damps its own vibrations" if flexible else "how little friction it has"


def _with(facts: Facts, best: Variant) -> str:
    rigid = "with rigid drives" if facts.device.mechanism is not None else "if it were rigid"
    return {
        "rigid-drives": rigid,
        "half-period": "sampled twice as fast",
        "no-delay": "without this delay",
        "no-filter": "without this filter",
        "collocated": "with the sensor at the actuator",
    }.get(best.key, f"with {best.label}")


def _reached(variant: Variant) -> str:
    return quantity(variant.stiffness_max, "N/m")


def _late(facts: Facts) -> str:
    """The effect of one sample of delay, for a device that has less."""
    late = find(facts.variants, "one-sample")
    if late.chart is None or facts.loop.controller.delay >= 1.0 or not facts.renders:
        return ""
    if not late.stiffness_max > 0.0:
        return "with one sample of delay it would render no wall at all"
    verb = "fall to" if late.stiffness_max < facts.base.stiffness_max else "reach"
    return f"with one sample of delay it would {verb} {_reached(late)}"


def next_best(facts: Facts) -> str:
    """The runner-up among the single changes; "" where it gains nothing."""
    best = limiting_change(facts.variants)
    rest = [v for v in facts.variants if v.key in REMEDIES and v.chart is not None and v is not best]
    rest.sort(key=lambda variant: -variant.stiffness_max)
    if best is None or not rest or not rest[0].stiffness_max > WORTH * facts.base.stiffness_max:
        return ""
    return f"The next best single change, {rest[0].label}, would reach {_reached(rest[0])}."


def regions(facts: Facts) -> str:
    """Said only where the stable walls fall apart."""
    count = len(facts.chart.regions)
    return f"The stable walls lie in {count} separate regions." if count > 1 else ""


def unobserved(facts: Facts) -> str:
    """Which motions were left out of the stability test; "" where none was."""
    names = counted(facts.chart.unobserved_modes)
    if not names or facts.runs_away:  # the warning has named them
        return ""
    the = "" if names[0][0].isdigit() else "the "
    return f"No wall moves {the}{listed(names)}: left out of what is called stable here."


def left_out(facts: Facts) -> str:
    """What of the device all of this leaves out; "" where it leaves out nothing."""
    words = facts.point.left_out
    if not words:
        return ""
    return f"All of this is linear and leaves out {listed(words)}; zwidth simulate has them."


def outside(facts: Facts) -> str:
    """What happens on either side of the edge, as far as it has such sides."""
    nyquist = 0.5 / facts.loop.period
    straight = [arc for arc in facts.chart.boundary if np.all(arc.frequency <= 1e-9 * nyquist)]
    text = "Walls inside the edge come to rest; outside, a vibration builds up"
    if not straight:
        return f"{text}."
    K = float(np.mean(straight[0].stiffness))
    place = "0" if abs(K) <= 1e-9 * (facts.chart.box[1] - facts.chart.box[0]) else quantity(K, "N/m")
    return f"{text} or, across the straight edge at K = {place} (0 Hz), the handle drifts away without vibrating."


def models(facts: Facts) -> str:
    """Which of the simpler models comes nearest to the device as described; "" where there is none."""
    simpler = [
        v for v in facts.variants if v.key.startswith("model-") and v.key != "model-full" and v.chart is not None
    ]
    if not simpler or not facts.renders:
        return ""
    base = facts.base.stiffness_max
    best = min(simpler, key=lambda variant: abs(variant.stiffness_max - base))
    return (
        f"Of the simpler models, {best.label} comes nearest: {_reached(best)}, "
        f"{difference(best.stiffness_max / base)} the device as described."
    )


def difference(ratio: float) -> str:
    """A ratio in words: "2.000 % above", "as", "16.00 times"."""
    if ratio >= 3.0:
        return f"{number(ratio)} times that of"
    if abs(ratio - 1.0) < 5e-4:
        return "just as"
    return f"{percent(abs(ratio - 1.0))} {'above' if ratio > 1.0 else 'below'}"


def decay(facts: Facts) -> str:
    """The wall that comes to rest fastest, of those with K, B >= 0 first; "" where none is stable."""
    best, of_all = facts.chart.fastest_decay_in_first_quadrant, facts.chart.fastest_decay
    if of_all is None:
        return ""
    if best is None:
        return f"Only walls of negative stiffness or damping are stable; {_comes_to_rest(of_all, facts)}."
    text = _comes_to_rest(best, facts)
    if of_all != best:
        text += f"; with negative stiffness or damping allowed, {_comes_to_rest(of_all, facts)}"
    return f"{text[0].upper()}{text[1:]}."


def _comes_to_rest(wall: FastestDecay, facts: Facts) -> str:
    """The wall and how long its slowest motion takes."""
    time = quantity(tenfold_time(wall.spectral_radius, facts.loop.period), "s")
    numbers = f"{quantity(wall.stiffness, 'N/m')} and {quantity(wall.damping, 'Ns/m')}"
    return f"a wall of {numbers} comes to rest fastest: a tenth is left after {time}"


def conditions(facts: Facts) -> str:
    """How many of the published conditions may be trusted here."""
    holding = [bound for bound in facts.bounds if bound.holds]
    if not holding:
        return (
            f"This device meets the assumptions of none of these {len(facts.bounds)} conditions: "
            "what they say is what somebody who applied them all the same would be told."
        )
    names = listed([f"“{bound.name}”" for bound in holding])
    return f"This device meets the assumptions of {len(holding)} of these {len(facts.bounds)} conditions: {names}."


def setting(facts: Facts) -> str:
    """Assembly and model, who holds it, and how the loop is sampled, delayed and filtered."""
    model = f"{facts.model.capitalize()} model" if facts.model != "full" else "Plant as given"
    if facts.posture is not None:
        model = f"Assembly {facts.posture.assembly}, {facts.model} model"
    controller = facts.loop.controller
    late = f"a delay of {delay_name(controller)}" if controller.delay else "no delay"
    period = given(controller.sampling_period, "s")
    held = "" if facts.operator is None else f", held by {facts.operator}"
    return f"{model}{held}; sampled every {period}, {late}, {computing_name(controller)}."


def delay_name(controller: Controller) -> str:
    """1 sample (1.25 ms)"""
    count = f"{given(controller.delay)} sample{'' if controller.delay == 1.0 else 's'}"
    return f"{count} ({given(controller.delay * controller.sampling_period, 's')})"


def computing_name(controller: Controller) -> str:
    """How the velocity is estimated, and what velocity and force pass through."""
    plain = isinstance(controller.velocity, BackwardDifference)
    method = next(name for name, kind in METHODS.items() if isinstance(controller.velocity, kind))
    estimate = "velocity" if plain else f"velocity by {method}"
    if controller.velocity_filter is not None:
        estimate += f" through {filter_name(controller.velocity_filter)}"
    parts = [f"{estimate} not filtered" if estimate == "velocity" else estimate]
    if controller.force_filter is not None:
        parts.append(f"force through {filter_name(controller.force_filter)}")
    if controller.actuator_time_constant:
        parts.append(f"force lagging by {given(controller.actuator_time_constant, 's')}")
    return ", ".join(parts)


def filter_name(low_pass: FirstOrder | Butterworth) -> str:
    """a first-order filter of 2 ms"""
    if isinstance(low_pass, FirstOrder):
        return f"a first-order filter of {given(low_pass.time_constant, 's')}"
    return (
        f"a Butterworth filter of order {low_pass.order} at "
        f"{given(low_pass.cutoff_Hz, 'Hz')} ({low_pass.discretisation})"
    )


def hertz(frequency: float) -> str:
    """170.5 Hz"""
    return quantity(frequency, "Hz")


def listed(words: Sequence[str]) -> str:
    """a, b and c"""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else list(words))
