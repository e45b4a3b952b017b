"""The report's sentences, each computed from the results: another device makes them say another thing.

Two of them answer different questions. `limit` asks for the cause: what is lost to one property of the device,
whether or not a device without it can be built. `first_change` asks for the change: which number of the device
file gains most. `compare_answers` says where the two differ, and why.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isclose, isfinite, isnan
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.decay import FastestDecay
from zwidth.loop.controller import Butterworth, Controller, FirstOrder
from zwidth.loop.estimators import METHODS, BackwardDifference
from zwidth.loop.motion_names import listed_names
from zwidth.show.circumstances import load_text
from zwidth.show.figures.stability import tenfold_time
from zwidth.show.report.facts import Facts
from zwidth.show.units import MINUS, SPACE, as_written, number, percent, point, quantity, speaks_of_moments, way
from zwidth.study.model_validity import Interval, ModelFit, Validity
from zwidth.study.sensitivity.what_if import LEAST_GAIN, REMEDIES, Variant, find_variant, limiting_change

# Gains of the actuator and the sensor are scales of the description, not parts to be changed.
SCALES: Final = ("plant.actuator", "plant.sensor", "plant.handle")
MOST_FREQUENCIES: Final = 6  # natural frequencies that are listed one by one
SECOND_PEAK_SHARE: Final = 0.9  # of the largest stiffness, from which another peak is mentioned
ONE_PERCENT: Final = f"1{SPACE}%"
LEAST_SLOPE: Final = 1e-6  # per cent for one per cent, below which a number has no influence
NO_WALL: Final = "no wall with positive stiffness and without negative damping is stable"
IDEAL: Final = ("rigid-drives", "no-delay")  # single changes that can be approached, but not built
# Numbers of the device file that belong to a single change, by path, and the sign of a change towards it.
NUMBERS_OF_CHANGE: Final = {
    "rigid-drives": ((r"plant\.stiffness_|mechanism\.drives\..*stiffness_", 1.0),),
    "half-period": ((r"loop\.sampling_period_s", -1.0),),
    "no-delay": ((r"loop\.delay_", -1.0),),
    "no-filter": (
        (r"loop\.velocity\.filter\.time_constant_s", -1.0),
        (r"loop\.velocity\.filter\.cutoff_Hz", 1.0),
    ),
    "twice-damping": ((r"plant\.damping_|mechanism\.damping\.|mechanism\.drives\..*\.damping_", 1.0),),
}


def summary(facts: Facts) -> list[str]:
    """The most important results, one sentence each."""
    lines = [
        warning(facts),
        largest_stiffness(facts),
        limit(facts),
        oscillation(facts),
        next_best(facts),
        regions(facts),
    ]
    lines += [unobserved(facts), left_out(facts)]
    return [sentence for sentence in lines if sentence]


def warning(facts: Facts) -> str:
    """Which motion is unstable with any wall; "" where none is."""
    if not facts.runs_away:
        return ""
    names = join_words(listed_names(facts.chart.unobserved_modes))
    return (
        f"Warning: this device is unstable with any wall, by a motion that no wall affects: {names}; "
        "the numbers below leave that motion out."
    )


def where(facts: Facts) -> str:
    """Direction and position: "Along y at (0, 0.25) m "; "" for a plant."""
    if facts.posture is None or facts.direction is None:
        return ""
    if facts.direction.shape[-1] == 6:
        return f"{way(facts.direction).capitalize()} at {point(facts.posture.position)} "
    return f"Along {direction_name(facts.direction)} at {point(facts.posture.position)} "


def direction_name(direction: Floats) -> str:
    """A direction as "y" or "−x", as a vector where it is no axis."""
    for axis, unit in zip("xyz", np.eye(3), strict=True):
        for sign, mark in ((1.0, ""), (-1.0, MINUS)):
            if np.allclose(direction, sign * unit, rtol=0.0, atol=1e-9):
                return mark + axis
    return point(direction, "")


def largest_stiffness(facts: Facts) -> str:
    """The largest stiffness and its damping."""
    start = f"{where(facts)}this device"
    if facts.model != "full":
        start = f"{where(facts)}the {facts.model} model of this device"
    start = start[0].upper() + start[1:]
    if not facts.renders:
        return f"{start} renders no wall: {NO_WALL}."
    stiffness = quantity(facts.base.stiffness_max, "N/m")
    # no damping, to rounding
    if facts.base.damping <= 1e-9 * facts.chart.box[3]:
        return (
            f"{start} renders walls of up to {stiffness}, at no virtual damping; "
            "any damping lowers the largest stiffness."
        )
    return (
        f"{start} renders walls of up to {stiffness}, "
        f"at {quantity(facts.base.damping, 'N s/m')} of virtual damping."
    )


def oscillation(facts: Facts) -> str:
    """How the loop becomes unstable at the stiffest wall; "" where no wall is stable."""
    frequencies = facts.base.frequencies
    if not frequencies:
        return ""
    if len(frequencies) > 1:
        return f"At the limit two oscillations begin at once, at {join_words([hertz(f) for f in frequencies])}."
    nyquist = 0.5 / facts.loop.period
    if frequencies[0] <= 1e-9 * nyquist:
        return "Beyond the limit the handle drifts away without oscillating."
    if frequencies[0] >= nyquist * (1.0 - 1e-9):
        return f"At the limit the force alternates from sample to sample, at {hertz(nyquist)}."
    return f"At the limit it oscillates at {hertz(frequencies[0])}."


def limit(facts: Facts) -> str:
    """The cause: the single change that gains most, built or not; and the effect of one sample of delay."""
    best = limiting_change(facts.variants)
    if best is None:
        text = "None of the single changes tried lets it render a stiffer wall"
    else:
        verb = "limits" if facts.renders else "prevents"
        text = (
            f"What {verb} it is {_cause(facts, best)}: {_change_text(facts, best)} it would reach {_reached(best)}"
        )
    return f"{text}; {late}." if (late := _one_sample_delay(facts)) else f"{text}."


def _cause(facts: Facts, best: Variant) -> str:
    """What the best single change takes away, in words: the cause that limits the device."""
    controller = facts.loop.controller
    flexible = frequency_list(facts)
    if best.key == "rigid-drives":
        what = (
            f"the flexibility of {_flexible_parts(facts)}"
            if facts.device.mechanism is not None
            else "its flexibility"
        )
        return f"{what}, at {join_words(flexible)}" if flexible else what
    if best.key == "no-delay":
        return f"the delay of {delay_name(controller)}"
    if best.key == "no-filter":
        return "the filter of the velocity"
    if best.key == "collocated":
        return "that the sensor is not where the wall acts"
    if best.key == "half-period":
        mass = float(facts.effective.rigid_mass)
        mass_text = "its mass" if isnan(mass) else f"its mass of {quantity(mass, 'kg')}"
        return f"the sampling of {mass_text} at {as_written(1.0 / controller.sampling_period, 'Hz')}"
    # twice the damping
    return "its low structural damping" if flexible else "its low friction"


def _flexible_parts(facts: Facts) -> str:
    """What of a mechanism is not rigid: "the drives", or "drives and links"."""
    mechanism = facts.device.mechanism
    return "drives and links" if mechanism is not None and mechanism.flexible else "the drives"


def frequency_list(facts: Facts) -> list[str]:
    """The natural frequencies of the ungripped device, rigid motions left out; of many, as links that bend have,
    the lowest, and the highest of the rest."""
    flexible = [f for f in facts.natural_frequencies.tolist() if f > 0.0]
    shown = flexible if len(flexible) <= MOST_FREQUENCIES + 2 else flexible[:MOST_FREQUENCIES]
    unshown = len(flexible) - len(shown)
    return [*map(hertz, shown), *([f"{unshown} more up to {hertz(flexible[-1])}"] if unshown else [])]


def _change_text(facts: Facts, best: Variant) -> str:
    """A single change in words, as a condition: "with ...", "without ..."."""
    rigid = (
        f"rigid {_flexible_parts(facts)}".replace("the ", "")
        if facts.device.mechanism is not None
        else "a rigid structure"
    )
    return {
        "rigid-drives": f"with {rigid}, which cannot be built,",
        "half-period": "sampled twice as fast",
        "no-delay": "without any delay, which can only be approached,",
        "no-filter": "without this filter",
        "collocated": "with the sensor at the actuator",
    }.get(best.key, f"with {best.label}")


def _reached(variant: Variant) -> str:
    """The largest stiffness that a variant reaches."""
    return quantity(variant.stiffness_max, "N/m")


def _one_sample_delay(facts: Facts) -> str:
    """The effect of one sample of delay as a part of a sentence, for a device that has less; "" for another."""
    late = find_variant(facts.variants, "one-sample")
    if late.chart is None or facts.loop.controller.delay >= 1.0 or not facts.renders:
        return ""
    if not late.stiffness_max > 0.0:
        return "with one sample of delay it would render no wall at all"
    verb = "fall to" if late.stiffness_max < facts.base.stiffness_max else "reach"
    return f"with one sample of delay it would {verb} {_reached(late)}"


def next_best(facts: Facts) -> str:
    """The best of the single changes that can be made, or the second best of all where the best is one of them.

    "" where no change gains, and where the best can be made and no other gains.
    """
    best = limiting_change(facts.variants)
    if best is None:
        return ""
    ideal = best.key in IDEAL
    candidates = [
        variant
        for variant in facts.variants
        if variant.key in REMEDIES and variant.chart is not None and variant is not best
    ]
    candidates = sorted(
        (variant for variant in candidates if not (ideal and variant.key in IDEAL)),
        key=lambda variant: -variant.stiffness_max,
    )
    if not candidates or not candidates[0].stiffness_max > LEAST_GAIN * facts.base.stiffness_max:
        return f"None of the changes tried that can be made gains {ONE_PERCENT}." if ideal else ""
    second = candidates[0]
    if ideal:
        return f"The best of the changes tried that can be made, {second.label}, would reach {_reached(second)}."
    note = " (which can only be approached)" if second.key in IDEAL else ""
    return f"The next best single change, {second.label}{note}, would reach {_reached(second)}."


def regions(facts: Facts) -> str:
    """How many regions the stable set has; "" for one."""
    count = len(facts.chart.regions)
    return f"The stable walls lie in {count} separate regions." if count > 1 else ""


def unobserved(facts: Facts) -> str:
    """Which motions the stability test leaves out; "" where it leaves out none."""
    names = listed_names(facts.chart.unobserved_modes)
    if not names or facts.runs_away:  # the warning has named them
        return ""
    the = "" if names[0][0].isdigit() else "the "  # a name such as "2 rigid motions" takes no article
    many = len(names) > 1 or not the
    direction = " in this direction" if facts.posture is not None else ""
    text = f"{the}{join_words(names)} {'are' if many else 'is'} not affected by a wall{direction}"
    return f"{text[0].upper()}{text[1:]} and left out of the stability test."


def left_out(facts: Facts) -> str:
    """Which nonlinear parts of the device the report leaves out, and what of a load; "" for nothing."""
    words, of_load = facts.point.linear_omissions, facts.point.load_omissions
    linear = f"All of this is linear and leaves out {join_words(words)}, which zwidth simulate includes."
    return " ".join([*([linear] if words else []), *(f"All of this is {text}." for text in of_load)])


def outside(facts: Facts) -> str:
    """Sentence on vibrations inside and outside the edge of the stable set."""
    nyquist = 0.5 / facts.loop.period
    # a straight part of the edge, at frequency 0: a real eigenvalue passes through 1
    straight = [arc for arc in facts.chart.boundary if np.all(arc.frequency <= 1e-9 * nyquist)]
    text = "Inside the edge the motion comes to rest; outside, an oscillation builds up"
    if not straight:
        return f"{text}."
    K = float(np.mean(straight[0].stiffness))
    where_straight = "0" if abs(K) <= 1e-9 * (facts.chart.box[1] - facts.chart.box[0]) else quantity(K, "N/m")
    return (
        f"{text} or, across the straight edge at K{SPACE}={SPACE}{where_straight} (0{SPACE}Hz), "
        "the handle drifts away without oscillating."
    )


def models(facts: Facts) -> str:
    """Which simpler model's largest stiffness is nearest to the device's; "" where there is none."""
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
    """A ratio in words before "the device": "2.000 % above", "16.00 times that of"; "just as" where four digits do
    not differ."""
    if ratio >= 3.0:
        return f"{number(ratio)} times that of"
    if abs(ratio - 1.0) < 5e-4:
        return "just as"
    return f"{percent(abs(ratio - 1.0))} {'above' if ratio > 1.0 else 'below'}"


def decay(facts: Facts) -> str:
    """The wall on which the motion decays fastest, of those with K, B >= 0 first; "" where none is stable."""
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
    """The wall and how long its slowest motion takes to shrink to a tenth, as a part of a sentence."""
    time = quantity(tenfold_time(wall.spectral_radius, facts.loop.period), "s")
    numbers = f"{quantity(wall.stiffness, 'N/m')} and {quantity(wall.damping, 'N s/m')}"
    return f"a wall of {numbers} comes to rest fastest: a tenth is left after {time}"


def conditions(facts: Facts) -> str:
    """Which published conditions apply: this device meets their assumptions and has the numbers they take."""
    applying = [bound for bound in facts.bounds if bound.holds]
    count = len(facts.bounds)
    if not applying:
        return f"None of these {count} published conditions applies to this device."
    names = join_words([f"“{bound.name}”" for bound in applying])
    verb = "applies" if len(applying) == 1 else "apply"
    return f"{len(applying)} of these {count} published conditions {verb} to this device: {names}."


def conditions_not_met(facts: Facts) -> str:
    """The line under which the conditions that do not apply are folded; "" where all apply."""
    count = sum(not bound.holds for bound in facts.bounds)
    if count == 0:
        return ""
    verb, they = ("does", "it") if count == 1 else ("do", "they")
    return f"{count} of {len(facts.bounds)} {verb} not apply: what {they} would promise, and what is not met"


def first_change(facts: Facts) -> str:
    """Which number of the device file gains most, and the next two; "" where none is known."""
    candidates = _changeable_numbers(facts)
    if not candidates:
        return ""
    (path, first_slope), *rest = candidates[:3]
    gain = quantity(0.01 * abs(first_slope) * facts.base.stiffness_max, "N/m")
    share = f"{percent(0.01 * abs(first_slope))} more stiffness"
    text = f"What to change first is {path}: {ONE_PERCENT} {_more_less(first_slope)} of it gives {share}, {gain}"
    if not rest:
        return f"{text}."
    others = [
        f"{other} ({ONE_PERCENT} {_more_less(slope)} gives {percent(0.01 * abs(slope))})" for other, slope in rest
    ]
    return f"{text}; then {join_words(others)}."


def _changeable_numbers(facts: Facts) -> list[tuple[str, float]]:
    """Path and logarithmic sensitivity of the numbers that are parts of the device, largest first."""
    return [(path, value) for path, value in facts.sensitivities.ranking if not path.startswith(SCALES)]


def _more_less(value: float) -> str:
    """Which way a number is to be changed for more stiffness, by its sensitivity."""
    return "more" if value > 0.0 else "less"


def compare_answers(facts: Facts) -> str:
    """Sentence on whether the number to change first belongs to the cause that `limit` names; "" if unknown."""
    best, candidates = limiting_change(facts.variants), _changeable_numbers(facts)
    if best is None or not candidates:
        return ""
    if _sign_towards(best.key, candidates[0][0]) * candidates[0][1] > 0.0:
        return "“What limits it” names the same cause."
    reasons = [_obstacle(facts, best), _small_step(facts, best)]
    why = ", and ".join(reason for reason in reasons if reason)
    text = f"“What limits it” asks for the cause and names another: {_cause(facts, best)}"
    return f"{text}. {why[0].upper()}{why[1:]}." if why else f"{text}."


def _sign_towards(change: str, path: str) -> float:
    """1 if more of the number leads towards a single change, -1 if less does, 0 if it does not belong to it."""
    for pattern, sign in NUMBERS_OF_CHANGE.get(change, ()):
        if re.match(pattern, path):
            return sign
    return 0.0


def _obstacle(facts: Facts, best: Variant) -> str:
    """Why the change cannot be made, as a part of a sentence; "" where it can."""
    if best.key == "no-delay":
        return "a delay can be shortened but not removed"
    if best.key == "rigid-drives":
        rigid = _flexible_parts(facts).removeprefix("the ") if facts.device.mechanism is not None else "structure"
        return f"no {rigid} {'is' if rigid == 'structure' else 'are'} rigid"
    return ""


def _small_step(facts: Facts, best: Variant) -> str:
    """What 1 % towards the change gains or loses, as a part of a sentence; "" where it is not known."""
    drives = facts.device.mechanism is not None
    stiffer = f"{ONE_PERCENT} stiffer drives" if drives else f"a {ONE_PERCENT} stiffer structure"
    step = {
        "rigid-drives": stiffer,
        "half-period": f"a {ONE_PERCENT} shorter sampling period",
        "no-delay": f"{ONE_PERCENT} less delay",
        "no-filter": f"a {ONE_PERCENT} faster filter",
        "twice-damping": f"{ONE_PERCENT} more {best.label.removeprefix('twice the ')}",
    }.get(best.key)
    # all numbers that belong to the change move by 1 % at once, so their sensitivities add
    numbers = [(_sign_towards(best.key, n.path), n) for n in facts.sensitivities.numbers if n.value != 0.0]
    gains = [sign * n.logarithmic for sign, n in numbers if sign]
    if step is None or not gains or not isfinite(gain := sum(gains)):
        return ""
    if abs(gain) < LEAST_SLOPE:
        return f"with {step} the largest stiffness stays the same"
    verb = "rises" if gain > 0.0 else "falls"
    return f"with {step} the largest stiffness {verb} by {percent(0.01 * abs(gain))}"


def second_peak(facts: Facts) -> str:
    """Which other peak of the edge becomes the limit when this one is lowered; "" where none is nearly as high."""
    sensitivities = facts.sensitivities
    if sensitivities.tie:
        return (
            "The edge has two equal peaks: the sensitivities are those of one, and a change may lower the other."
        )
    if not sensitivities.second_peak > SECOND_PEAK_SHARE * facts.base.stiffness_max:
        return ""
    return (
        f"Another peak of the edge is at {quantity(sensitivities.second_peak, 'N/m')}: it becomes the limit where "
        "a change lowers the highest peak below it."
    )


def felt(facts: Facts) -> str:
    """The stiffest wall's static stiffness at the handle; "" where no wall is rendered or there is no handle."""
    if facts.felt is None or not facts.renders:
        return ""
    stiffest, limit = facts.felt.stiffness_max, facts.felt.limit
    if not isfinite(limit) and isclose(stiffest, facts.base.stiffness_max, rel_tol=1e-6):
        return "Nothing between wall and handle is flexible: at rest a wall is felt as stiff as it is commanded."
    share = percent(stiffest / facts.base.stiffness_max)
    ends = {
        "bound": f"whatever is commanded, nothing stiffer than {quantity(limit, 'N/m')} can be felt",
        "infinite": "nothing between wall and handle bounds what can be felt",
    }
    end = ends.get(facts.felt.limit_kind, f"an infinitely stiff wall would be felt as {quantity(limit, 'N/m')}")
    return f"At rest the stiffest wall is felt as {quantity(stiffest, 'N/m')}, {share} of its stiffness; {end}."


def which_model(facts: Facts) -> str:
    """At which frequencies of the edge each simpler model agrees; "" where there is none or no edge."""
    validity = facts.validity
    fits = [fit for fit in validity.fits if len(fit.error)] if validity is not None else []
    if validity is None or not fits:
        return ""
    highest = float(validity.frequency[-1])
    text = f"Along its edge the full model oscillates at up to {hertz(highest)}"
    if isfinite(validity.first_natural):
        times = number(highest / validity.first_natural)
        text += f", {times} times its first natural frequency of {hertz(validity.first_natural)}"
    good = [f"{fit.label} {_where_valid(fit, validity)}" for fit in fits if fit.valid_ranges]
    bad = [fit.label for fit in fits if not fit.valid_ranges]
    within = f"within {100.0 * validity.tolerance:g}{SPACE}% in stiffness, damping and frequency"
    if not good:
        return f"{text}. None of the simpler models agrees with it {within}, at any frequency."
    nowhere = [f"{join_words(bad)} nowhere"] if bad else []
    return f"{text}. Simpler models that agree with it {within}: {'; '.join([*good, *nowhere])}."


def _where_valid(fit: ModelFit, validity: Validity) -> str:
    """The ranges in which a model agrees: "everywhere", "below 17.60 Hz (17.37 % of that)", ..."""
    if fit.everywhere:
        return "everywhere"
    return join_words([_range_text(interval, validity) for interval in fit.valid_ranges])


def _range_text(interval: Interval, validity: Validity) -> str:
    """A range of frequencies in words, as `_where_valid`: ends of the edge are not named."""
    low, high = interval
    if low <= float(validity.frequency[0]):
        return f"below {hertz(high)}{_share_text(high, validity)}"
    if high >= float(validity.frequency[-1]):
        return f"above {hertz(low)}{_share_text(low, validity)}"
    return f"between {hertz(low)} and {hertz(high)}"


def _share_text(frequency: float, validity: Validity) -> str:
    """A frequency as a share of the first natural one, in brackets; "" where there is none."""
    if not isfinite(validity.first_natural):
        return ""
    return f" ({percent(frequency / validity.first_natural)} of that)"


def setting(facts: Facts) -> str:
    """Assembly, model, operator, load, and how the loop is sampled, delayed and filtered."""
    model = f"{facts.model.capitalize()} model" if facts.model != "full" else "Plant as given"
    if facts.posture is not None:
        model = f"Assembly {facts.posture.assembly}, {facts.model} model"
    controller = facts.loop.controller
    late = f"a delay of {delay_name(controller)}" if controller.delay else "no delay"
    period = as_written(controller.sampling_period, "s")
    held = "" if facts.operator is None else f", held by {facts.operator}"
    held += "" if facts.point.load is None else f", under {load_text(facts.point.load).replace('-', MINUS)}"
    return f"{model}{held}; sampled every {period}, {late}, {velocity_and_force_text(controller)}."


def delay_name(controller: Controller) -> str:
    """A delay in samples and seconds: "1 sample (1.25 ms)"."""
    count = f"{as_written(controller.delay)} sample{'' if controller.delay == 1.0 else 's'}"
    return f"{count} ({as_written(controller.delay * controller.sampling_period, 's')})"


def velocity_and_force_text(controller: Controller) -> str:
    """Velocity estimator, filters and other feedback: "velocity by kalman, force lagging by 2 ms"."""
    plain = isinstance(controller.velocity, BackwardDifference)
    method = next(name for name, kind in METHODS.items() if isinstance(controller.velocity, kind))
    estimate = "velocity" if plain else f"velocity by {method}"
    if controller.velocity_filter is not None:
        estimate += f" through {filter_name(controller.velocity_filter)}"
    parts = [f"{estimate} not filtered" if estimate == "velocity" else estimate]
    if controller.force_filter is not None:
        parts.append(f"force through {filter_name(controller.force_filter)}")
    if controller.actuator_time_constant:
        parts.append(f"force lagging by {as_written(controller.actuator_time_constant, 's')}")
    parts += [f"with {name}" for name in controller.feedback_texts(speaks_of_moments())]
    return ", ".join(parts)


def filter_name(low_pass: FirstOrder | Butterworth) -> str:
    """A filter in words: "a first-order filter of 2 ms"."""
    if isinstance(low_pass, FirstOrder):
        return f"a first-order filter of {as_written(low_pass.time_constant, 's')}"
    return (
        f"a Butterworth filter of order {low_pass.order} at "
        f"{as_written(low_pass.cutoff_Hz, 'Hz')} ({low_pass.discretisation})"
    )


def hertz(frequency: float) -> str:
    """A frequency in four digits: "170.5 Hz"."""
    return quantity(frequency, "Hz")


def join_words(words: Sequence[str]) -> str:
    """Words as a list: "a, b and c"."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else list(words))
