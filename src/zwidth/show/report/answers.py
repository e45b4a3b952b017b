"""The report's sentences on what to change first, what the hand feels, and which model may be trusted where."""

from __future__ import annotations

from math import isfinite
from typing import Final

from zwidth.show.report.facts import Facts
from zwidth.show.report.sentences import hertz, listed
from zwidth.show.units import SPACE, number, percent, quantity
from zwidth.study.validity import Fit, Interval, Validity

# How the actuator pulls and what the sensor reads are scales of the description, not parts to be changed.
SCALES: Final = ("plant.actuator", "plant.sensor", "plant.handle")
NEAR: Final = 0.9  # a second summit this high deserves a word


def first_change(facts: Facts) -> str:
    """Which number the largest stiffness answers to most, and the next two; "" where none is known."""
    told = [(path, value) for path, value in facts.answers.wholes if not path.startswith(SCALES)]
    if not told:
        return ""
    (path, value), *rest = told[:3]
    gain = quantity(0.01 * abs(value) * facts.base.stiffness_max, "N/m")
    share = f"{percent(0.01 * abs(value))} more stiffness"
    text = f"What to change first is {path}: 1{SPACE}% {_way(value)} of it gives {share}, {gain}"
    if not rest:
        return f"{text}."
    others = [f"{other} (1{SPACE}% {_way(slope)} gives {percent(0.01 * abs(slope))})" for other, slope in rest]
    return f"{text}; then {listed(others)}."


def _way(value: float) -> str:
    return "more" if value > 0.0 else "less"


def summit(facts: Facts) -> str:
    """Which other wall takes over when the stiffest gives way; "" where there is none nearby."""
    found = facts.answers
    if found.tie:
        return "Two walls are stiffest at once; this is said of one of them, and a change may lower the other."
    if not found.rival > NEAR * facts.base.stiffness_max:
        return ""
    return (
        f"Another summit of the edge stands at {quantity(found.rival, 'N/m')}: it takes over where a change "
        "lowers the stiffest wall below it."
    )


def felt(facts: Facts) -> str:
    """What the hand feels of the stiffest wall; "" where nothing is rendered or held."""
    if facts.felt is None or not facts.renders:
        return ""
    stiffest, limit = facts.felt.stiffest, facts.felt.limit
    if not isfinite(limit):
        return (
            "Nothing gives way between the wall and the hand: at rest a wall is felt as stiff as it is commanded."
        )
    share = percent(stiffest / facts.base.stiffness_max)
    return (
        f"At rest the hand feels the stiffest wall with {quantity(stiffest, 'N/m')}, {share} of its "
        f"stiffness; whatever is commanded, nothing stiffer than {quantity(limit, 'N/m')} can be felt."
    )


def which_model(facts: Facts) -> str:
    """Where along the edge each simpler model may be trusted; "" where there is none or no edge."""
    found = facts.fits
    fits = [fit for fit in found.fits if len(fit.error)] if found is not None else []
    if found is None or not fits:
        return ""
    highest = float(found.frequency[-1])
    text = f"The walls of the full model fail at up to {hertz(highest)}"
    if isfinite(found.first_natural):
        times = number(highest / found.first_natural)
        text += f", {times} times its first natural frequency of {hertz(found.first_natural)}"
    good = [f"{fit.label} {_where(fit, found)}" for fit in fits if fit.within]
    bad = [fit.label for fit in fits if not fit.within]
    within = f"within {100.0 * found.tolerance:g} % of it in stiffness, damping and frequency"
    if not good:
        return f"{text}. None of the simpler models is {within}, at any frequency."
    text += f". There {'are' if len(good) > 1 else 'is'} {within}: {'; '.join(good)}"
    return f"{text}; and nowhere {listed(bad)}." if bad else f"{text}."


def _where(fit: Fit, found: Validity) -> str:
    """everywhere, below 17.60 Hz (17.37 % of the first natural frequency), between 3 Hz and 9 Hz, ..."""
    if fit.everywhere:
        return "everywhere"
    return listed([_range(interval, found) for interval in fit.within])


def _range(interval: Interval, found: Validity) -> str:
    low, high = interval
    if low <= float(found.frequency[0]):
        return f"below {hertz(high)}{_share(high, found)}"
    if high >= float(found.frequency[-1]):
        return f"above {hertz(low)}{_share(low, found)}"
    return f"between {hertz(low)} and {hertz(high)}"


def _share(frequency: float, found: Validity) -> str:
    if not isfinite(found.first_natural):
        return ""
    return f" ({percent(frequency / found.first_natural)} of that)"
