"""Messages about distributions that reach beyond what a device can have, with what to write instead."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, log, log10
from typing import Final

from zwidth.device.faults import Fault
from zwidth.study.designs.axis_tables import Faults
from zwidth.study.tolerances.buildable import FaultsOf, Obstacle, obstacle
from zwidth.study.tolerances.distribution import Distribution

DIGITS: Final = 4  # of a number that a message advises
ROUNDING: Final = 1e-6  # of the last of these digits


def leads_to(key: str, law: Distribution) -> str:
    """The values that are drawn, in words."""
    return f"leads to values of '{key}' from {law.low:.6g} to {law.high:.6g}"


def beyond_faults(key: str, path: str, width_key: str, law: Distribution, faults_at: FaultsOf) -> Faults:
    """Faults of a distribution at whose ends, or at one of them, no device can be built.

    path       of its number in full
    width_key  the first of its keys that give the width
    """
    by_ends = width_key == "low" and not law.spread
    # what is advised about low has nothing to do with high, nor with the middle between them
    starts = (law.middle, law.low, law.high) if by_ends else (law.middle,)
    start = next((value for value in starts if not faults_at(value)), None)
    if start is None:
        fault = faults_at(law.middle)[0]
        advice = (
            "move low and high to values that it may have" if width_key == "low" else "correct what is tied to it"
        )
        message = f"{leads_to(key, law)}; with {law.middle:.6g}, {_in_words(fault, path)}; {advice}"
        return [((width_key,), message)]
    found = [one for end in (law.low, law.high) if (one := obstacle(faults_at, start, end)) is not None]
    if not found:
        return []
    if not by_ends:
        advice = narrower_advice(law, width_key, [one.last for one in found])
        return [((width_key,), f"{leads_to(key, law)}; {_at_end(found[0], path)}; {advice}")]
    faults: Faults = []
    for one in found:
        shown = "low" if one.end == law.low else "high"
        advice = narrower_advice(law, shown, [one.last])
        faults.append(((shown,), f"{leads_to(key, law)}; {_at_end(one, path)}; {advice}"))
    return faults


def _at_end(one: Obstacle, path: str) -> str:
    words = _in_words(one.faults[0], path)
    return words if one.is_of(path) else f"with {one.end:.6g}, {words}"


def _in_words(fault: Fault, path: str) -> str:
    """A fault without the advice that it gives about a single device."""
    first = fault.message.split("; ")[0]
    if first.count("(") > first.count(")"):
        first = first[: first.rindex(" (")]
    return f"{'it' if fault.key == path else fault.key} {first}"


def narrower_advice(
    law: Distribution, shown: str, ends: Sequence[float], *, exact: bool = False, excluded: bool = False
) -> str:
    """What to write for a distribution that stays between `ends`, the farthest values that a device can have.

    shown     the key that gives the width
    exact     whether the ends are known, not found by halving
    excluded  whether the ends themselves are not allowed
    """
    if law.kind == "lognormal":
        reach = min(abs(log(end / law.middle)) for end in ends) / law.spread
        shown = "cut_at_deviations"
    elif law.spread:
        reach = min(abs(end - law.middle) for end in ends) / law.spread
        shown = "cut_at_deviations"
    elif shown in ("low", "high"):
        rising = shown == "low"
        if excluded:
            return f"give {shown} {'above' if rising else 'below'} {ends[0]:.6g}"
        return f"give {shown} = {_rounded(ends[0], up=rising, exact=exact)} or {'more' if rising else 'less'}"
    else:
        reach = min(abs(end - law.middle) for end in ends)
        if shown.endswith("_percent"):
            reach *= 100.0 / abs(law.middle)
    if not reach > 0.0:
        return "give low and high that it may have"
    return (
        f"give {shown} below {reach:.6g}" if excluded else f"give {shown} = {_rounded(reach, exact=exact)} or less"
    )


def _rounded(value: float, *, up: bool = False, exact: bool) -> str:
    """A number with few digits that lies below the value, or above it; one that has few digits already stays if
    it is exact.

    >>> _rounded(0.0123456, exact=True), _rounded(0.0123456, up=True, exact=True), _rounded(25.0, exact=False)
    ('0.01234', '0.01235', '24.99')
    """
    if value == 0.0:
        return "0"
    step = 10.0 ** (floor(log10(abs(value))) + 1 - DIGITS)
    slack = -ROUNDING if exact else ROUNDING
    steps = ceil(value / step + slack) if up else floor(value / step - slack)
    return f"{steps * step:.{DIGITS}g}"
