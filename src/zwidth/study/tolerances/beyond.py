"""Messages about distributions that reach beyond what a device can have, with what to write instead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import exp, floor, log, log10
from typing import Final

from zwidth.device.faults import Fault
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.tolerances.buildable import FaultsOf, Obstacle, obstacle
from zwidth.study.tolerances.distribution import Distribution

DIGITS: Final = 4  # of a number that a message advises
OTHERWISE: Final = "give low and high that it may have"


def beyond_faults(
    key: str, path: str, value: float | None, width_key: str, law: Distribution, faults_at: FaultsOf
) -> TableFaults:
    """Faults of a distribution at whose ends, or at one of them, no device can be built.

    path       of its number in full
    value      of the number in the device file; None: it has none
    width_key  the first of the keys of its table that give the width
    """
    by_ends = width_key == "low" and not law.spread
    # what is advised about low has nothing to do with high, nor with the middle between them
    inside = [value] if value is not None and law.low <= value <= law.high else []
    starts = [law.middle, *inside, law.low, law.high] if by_ends else [law.middle]
    start = next((one for one in starts if not faults_at(one)), None)
    leads = f"leads to values of '{key}' from {law.low:.6g} to {law.high:.6g}"
    if start is None:
        fault = faults_at(law.middle)[0]
        by_low = "move low and high to values that it may have"
        advice = by_low if width_key == "low" else "correct what is tied to it"
        return [((width_key,), f"{leads}; with {law.middle:.6g}, {_in_words(fault, path)}; {advice}")]
    found = [one for end in (law.low, law.high) if (one := obstacle(faults_at, start, end)) is not None]
    if not by_ends:
        advice = _narrower(law, width_key, [one.last for one in found], faults_at) if found else ""
        return [((width_key,), f"{leads}; {_at_end(one, path)}; {advice}") for one in found[:1]]
    faults: TableFaults = []
    for one in found:
        rising = one.end == law.low
        limit = _rounded(one.last, lambda end: not faults_at(end), up=rising)
        advice = f"give {'low' if rising else 'high'} = {limit} or {'more' if rising else 'less'}"
        faults.append((("low" if rising else "high",), f"{leads}; {_at_end(one, path)}; {advice}"))
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


def _narrower(law: Distribution, width_key: str, ends: Sequence[float], faults_at: FaultsOf) -> str:
    """What to write for a distribution that stays between `ends`, the farthest values that a device can have."""
    middle = law.middle
    if law.kind == "lognormal":
        shown, reach = "cut_at_deviations", min(abs(log(end / middle)) for end in ends) / law.spread
    elif law.spread:
        shown, reach = "cut_at_deviations", min(abs(end - middle) for end in ends) / law.spread
    else:
        shown, reach = width_key, min(abs(end - middle) for end in ends)
        reach *= 100.0 / abs(middle) if shown.endswith("_percent") else 1.0

    def ends_at(width: float) -> tuple[float, float]:
        if law.kind == "lognormal":
            return middle * exp(-width * law.spread), middle * exp(width * law.spread)
        way = abs(middle) * width / 100.0 if shown.endswith("_percent") else width * (law.spread or 1.0)
        return middle - way, middle + way

    if not reach > 0.0:
        return OTHERWISE
    fitting = _rounded(
        reach, lambda width: not any(faults_at(min(max(end, law.low), law.high)) for end in ends_at(width))
    )
    return f"give {shown} = {fitting} or less"


def _rounded(value: float, fits: Callable[[float], bool], *, up: bool = False) -> str:
    """A number with few digits next to a value that fits: the nearest one if it fits, else one that lies below, or
    above it.

    >>> _rounded(0.0123456, lambda x: x <= 0.0123456), _rounded(25.0, lambda x: x < 25.0)
    ('0.01234', '24.99')
    """
    if value == 0.0:
        return "0"
    step = 10.0 ** (floor(log10(abs(value))) + 1 - DIGITS)
    nearest = round(value / step)
    texts = [f"{(nearest + (n if up else -n)) * step:.{DIGITS}g}" for n in range(3)]
    return next((text for text in texts if fits(float(text))), texts[-1])
