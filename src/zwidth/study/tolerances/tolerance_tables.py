"""From the [[tolerance]] tables of a study file to tolerances, or to what is wrong with them.

The device format says of some numbers alone how large they may be; others must agree with what stands beside
them: a mass matrix is positive definite, a filter cuts off below half the sampling frequency. So devices are built
with the least and the largest value that is drawn, before any is computed, and messages say what to write instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, floor, inf, isfinite, log, log10
from typing import Any, Final

from zwidth.device import address
from zwidth.device.address import is_number, tables
from zwidth.device.device import Device
from zwidth.device.faults import Fault, KeyPath, dotted, nearest, quote
from zwidth.device.load import from_document
from zwidth.device.schema import device_file as schema
from zwidth.errors import DeviceError
from zwidth.study.designs.axis_tables import (
    SetNumbers,
    TableFault,
    TableFaults,
    key_faults,
    mirrored,
    overlap_faults,
    ties_of,
    unit_of,
)
from zwidth.study.designs.sampling import CIRCUMSTANCES, Axis, Tie
from zwidth.study.tolerances.distribution import (
    CUT,
    SPAN_OF_95,
    Distribution,
    NumberLimits,
    Tolerance,
    lognormal,
    normal,
    spread_of_variation,
)

# Ways of giving the width, by the kind of distribution.
WIDTHS: Final[dict[str, tuple[tuple[str, ...], ...]]] = {
    "normal": (("standard_deviation",), ("standard_deviation_percent",), ("low", "high")),
    "lognormal": (("standard_deviation_percent",), ("low", "high")),
    "uniform": (("plus_minus",), ("plus_minus_percent",), ("low", "high")),
    "triangular": (("plus_minus",), ("plus_minus_percent",), ("low", "high")),
}
WITH_TAILS: Final = ("normal", "lognormal")
WIDTH_KEYS: Final = tuple(dict.fromkeys(key for ways in WIDTHS.values() for way in ways for key in way))
PERCENT: Final = ("standard_deviation_percent", "plus_minus_percent")
KIND: Final = "tolerance"


def tolerances_of(document: dict[str, Any], device: Device | None, faults: TableFaults) -> tuple[Tolerance, ...]:
    """The tolerances of a study that have no fault; the faults of the others are added to `faults`.

    document  the study as read. Values of the wrong type are left out here: `study_schema` reports them
    device    None if it could not be loaded; paths are then not looked up
    """
    found, taken = [], SetNumbers()
    for n, table in tables(document, KIND):
        table_faults: TableFaults = list(_width_faults(table))
        tolerance = _tolerance(table, device, taken, table_faults)
        faults += [((KIND, n, *path), message) for path, message in table_faults]
        if tolerance is not None and not table_faults:
            found.append(tolerance)
    return tuple(found)


def _width_faults(table: dict[str, Any]) -> Iterator[TableFault]:
    """Faults of a table whose width is missing, given twice, upside down, or of another kind of distribution."""
    kind = table.get("distribution")
    if kind not in WIDTHS:
        return  # `study_schema` reports it
    ways = WIDTHS[kind]
    allowed = {key for way in ways for key in way}
    for key in WIDTH_KEYS:
        if key in table and key not in allowed:
            yield (key,), f"is not the width of a {kind} distribution; give {_ways_in_words(ways)}"
    used = [way for way in ways if any(key in table for key in way)]
    if not used and not any(key in table for key in WIDTH_KEYS):
        yield (), f"has no width; give {_ways_in_words(ways)}"
    if len(used) > 1:
        yield (used[1][0],), f"and {used[0][0]} exclude each other; remove one of them"
    if ("low" in table) != ("high" in table):
        there, missing = ("low", "high") if "low" in table else ("high", "low")
        yield (there,), f"needs {missing} beside it"
    low, high = table.get("low"), table.get("high")
    if is_number(low) and is_number(high) and not low < high:
        yield ("low",), f"must be below high, got {quote(low)} and {quote(high)}; exchange them"
    if "cut_at_deviations" in table and kind not in WITH_TAILS:
        yield (
            ("cut_at_deviations",),
            f"goes with a normal or lognormal distribution; a {kind} one has ends: remove it",
        )


def _ways_in_words(ways: Sequence[Sequence[str]]) -> str:
    """Ways of giving a width, in words."""
    *first, last = [" and ".join(way) for way in ways]
    return f"{', '.join(first)} or {last}"


def _tolerance(
    table: dict[str, Any], device: Device | None, taken: SetNumbers, faults: TableFaults
) -> Tolerance | None:
    """The tolerance of a table; None where its key or its distribution has faults, which are added, or some that
    the schema reports. Faults of its ties are added, too, but the tolerance is returned.

    taken   the numbers that tolerances before this one set; those of this one are added
    faults  those of its width already; the others are added
    """
    key = table.get("key")
    if not isinstance(key, str) or not key or device is None:
        return None
    if message := _key_fault(device.document, key):
        faults.append((("key",), message))
        return None
    faults += overlap_faults(key, ("key",), key, device, taken, KIND)
    if faults:
        return None
    value = address.get(device.document, key) if address.exists(device.document, key) else None
    now = float(value) if is_number(value) else None
    made = _distribution(table, key, now, device.document, faults)
    if made is None or faults:
        return None
    distribution, relative = made
    path = dotted(address.resolve(device.document, key), device.document)
    mirror = mirrored(device.document, key)  # an element of a symmetric matrix has no value of its own
    without_ties = faults_with(device.document, key, () if mirror is None else (Tie(mirror),))
    distribution = _cut_at_obstacles(distribution, path, without_ties)
    faults += beyond_faults(key, path, now, _width_key(table), distribution, without_ties)
    if faults:
        return None
    drawn = {"key": key, "values": [distribution.low, distribution.high], "tie": table.get("tie")}
    ties = tuple(ties_of(drawn, key, device, taken, faults, KIND))
    if ties and not faults:
        with_ties = faults_with(device.document, key, ties)
        faults += beyond_faults(key, path, now, _width_key(table), distribution, with_ties)
    return Tolerance(key, path, distribution, relative, unit_of(device.document, key), ties)


def _cut_at_obstacles(law: Distribution, path: str, faults_at: FaultsOf) -> Distribution:
    """The distribution, cut off besides where the number alone is too small or too large for any device.

    path       of the number in full
    faults_at  value of the number -> faults of the device with it
    """
    # with a middle that no device can have there is no way to the ends: `beyond_faults` reports it
    if law.kind not in WITH_TAILS or faults_at(law.middle):
        return law
    ends = [law.low, law.high]
    for n, end in enumerate(ends):
        found = obstacle(faults_at, law.middle, end)
        if found is not None and found.is_of(path):
            ends[n] = found.last
    low, high = ends
    return replace(law, low=low, high=high) if low < high else law


def _key_fault(document: dict[str, Any], key: str) -> str:
    """Message: why the key of a tolerance leads to no real number of the device file; "" where it leads to one."""
    if key in CIRCUMSTANCES:
        return f"'{key}' is a circumstance of the study; a tolerance is of a number of the device file"
    for _, message in key_faults(document, key, []):
        near = nearest(key, address.numeric_addresses(document))
        return f"{message}; did you mean '{near}'?" if near and "did you mean" not in message else message
    kinds = {str(kind.get("type")) for kind in schema.subschemas(address.resolve(document, key))}
    if "number" in kinds:
        return ""
    if "integer" in kinds:
        return f"'{key}' takes whole numbers, of which there is no tolerance; compare them with zwidth sweep"
    return f"'{key}' takes no number"


def _distribution(
    table: dict[str, Any], key: str, value: float | None, document: dict[str, Any], faults: TableFaults
) -> tuple[Distribution, bool] | None:
    """The distribution of a table without faults of its width, and whether it is relative; None with a fault,
    which is added, or which the schema reports.

    value  the number in the device file; None: it has none
    """
    kind = table.get("distribution")
    width_key = _width_key(table)
    numbers = [table[one] for one in (*WIDTH_KEYS, "cut_at_deviations") if one in table]
    if kind not in WIDTHS or not width_key or not all(is_number(one) and isfinite(one) for one in numbers):
        return None
    if any(
        table[one] <= 0
        for one in (*WIDTH_KEYS, "cut_at_deviations")
        if one in table and one not in ("low", "high")
    ):
        return None  # the schema reports both
    by_ends = width_key == "low"
    if value is None and (not by_ends or kind == "triangular"):
        faults.append((("key",), f"'{key}' has no value in the device file; set it first, or give low and high"))
        return None
    if width_key in PERCENT and value == 0.0:
        absolute = width_key.removesuffix("_percent")
        instead = absolute if (absolute,) in WIDTHS[kind] else "another distribution"
        faults.append(((width_key,), f"needs a value of '{key}' other than 0 in the device file; give {instead}"))
        return None
    limits = _limits(address.resolve(document, key))
    middle = value if value is not None else 0.0  # 0: not looked at, as low and high give the middle
    if kind in WITH_TAILS:
        made = _with_tails(table, kind, key, middle, limits, faults)
    else:
        made = _bounded(table, kind, key, middle, faults)
    return None if made is None else (made, width_key in PERCENT or kind == "lognormal")


def _width_key(table: dict[str, Any]) -> str:
    """The first of the keys that give the width; "" for none."""
    return next((one for one in WIDTH_KEYS if one in table), "")


def _with_tails(
    table: dict[str, Any], kind: str, key: str, value: float, limits: NumberLimits, faults: TableFaults
) -> Distribution | None:
    """A normal or lognormal distribution by the width in its table, cut off at `limits`; None with a fault, which
    is added.

    key    of the number, for messages
    value  middle of the distribution where its table has no low and high
    """
    cut = float(table.get("cut_at_deviations", CUT))
    low, high = table.get("low"), table.get("high")
    if kind == "lognormal":
        least = low if low is not None else value
        if not least > 0.0:
            faults.append((("distribution",), f"lognormal needs numbers above 0, got {quote(least)} for '{key}'"))
            return None
    if low is not None and high is not None:
        if kind == "lognormal":
            middle, deviation = (low * high) ** 0.5, 0.5 * log(high / low) / SPAN_OF_95
        else:
            middle, deviation = 0.5 * (low + high), 0.5 * (high - low) / SPAN_OF_95
    elif kind == "lognormal":
        middle, deviation = value, spread_of_variation(table["standard_deviation_percent"] / 100.0)
    else:
        percent = table.get("standard_deviation_percent")
        middle = value
        deviation = table["standard_deviation"] if percent is None else abs(value) * percent / 100.0
    made = (lognormal if kind == "lognormal" else normal)(middle, deviation, limits, cut)
    if not made.low <= middle <= made.high or not made.low < made.high:
        message = (
            f"and high have their middle at {middle:.6g}, which '{key}' may not be; {_limits_in_words(limits)}"
        )
        faults.append((("low",), message))
        return None
    return made


def _bounded(table: dict[str, Any], kind: str, key: str, value: float, faults: TableFaults) -> Distribution | None:
    """A uniform or triangular distribution by the width in its table; None with a fault, which is added.

    key    of the number, for messages
    value  middle of the distribution; of a uniform one with low and high it is not looked at
    """
    low, high = table.get("low"), table.get("high")
    percent = table.get("plus_minus_percent")
    middle = value
    if low is None or high is None:
        width = table["plus_minus"] if percent is None else abs(value) * percent / 100.0
        low, high = value - width, value + width
    else:
        middle = value if kind == "triangular" else 0.5 * (low + high)
        if not low <= middle <= high:
            message = (
                f"and high must enclose the value of '{key}' in the device file, {quote(value)}, the likeliest"
            )
            faults.append((("low",), message))
            return None
    low, high = float(low), float(high)
    return Distribution("triangular" if kind == "triangular" else "uniform", middle, low, high)


def _limits_in_words(limits: NumberLimits) -> str:
    """The values that a number of the device file may have, in words."""
    words = []
    if limits.least > -inf:
        words.append(f"{'above' if limits.without_least else 'at least'} {limits.least:.6g}")
    if limits.most < inf:
        words.append(f"{'below' if limits.without_most else 'at most'} {limits.most:.6g}")
    return f"it must be {' and '.join(words)}"


def _limits(steps: KeyPath) -> NumberLimits:
    """The widest limits that the schema sets for the number at a path, by any of its forms."""
    numbers = [kind for kind in schema.subschemas(steps) if kind.get("type") == "number"]
    if not numbers:
        return NumberLimits()
    # of two equal limits the one that is allowed itself is wider: its second entry, 0, compares so
    least = min(_limit(kind, -inf, ("gt", "exclusiveMinimum"), ("ge", "minimum")) for kind in numbers)
    most = max(_limit(kind, inf, ("lt", "exclusiveMaximum"), ("le", "maximum"), -1) for kind in numbers)
    return NumberLimits(least[0], most[0], least[1] > 0, most[1] < 0)


def _limit(
    subschema: dict[str, Any], unlimited: float, without: Sequence[str], within: Sequence[str], sign: int = 1
) -> tuple[float, int]:
    """A limit that a subschema sets, or `unlimited`; and `sign` where the limit itself is not allowed, else 0.

    without, within  keys of a limit that is not allowed itself, and of one that is
    """
    for key in without:
        if key in subschema:
            return float(subschema[key]), sign
    for key in within:
        if key in subschema:
            return float(subschema[key]), 0
    return unlimited, 0


DIGITS: Final = 4  # of a number that a message advises
OTHERWISE: Final = "give low and high that it may have"


def beyond_faults(
    key: str, path: str, value: float | None, width_key: str, law: Distribution, faults_at: FaultsOf
) -> TableFaults:
    """Faults of a distribution at whose ends, or at one of them, no device can be built.

    path       of its number in full
    value      of the number in the device file; None: it has none
    width_key  the first of the keys of its table that give the width
    faults_at  value of the number -> faults of the device with it
    """
    by_ends = width_key == "low" and not law.spread  # low and high are all that is drawn
    # what is advised about low has nothing to do with high, nor with the middle between them
    inside = [value] if value is not None and law.low <= value <= law.high else []
    starts = [law.middle, *inside, law.low, law.high] if by_ends else [law.middle]
    start = next((one for one in starts if not faults_at(one)), None)
    leads = f"leads to values of '{key}' from {law.low:.6g} to {law.high:.6g}"
    if start is None:
        fault = faults_at(law.middle)[0]
        by_low = "move low and high to values that it may have"
        advice = by_low if width_key == "low" else "correct what is tied to it"
        return [((width_key,), f"{leads}; with {law.middle:.6g}, {_fault_in_words(fault, path)}; {advice}")]
    found = [one for end in (law.low, law.high) if (one := obstacle(faults_at, start, end)) is not None]
    if not by_ends:
        advice = _narrower_advice(law, width_key, [one.last for one in found], faults_at) if found else ""
        return [((width_key,), f"{leads}; {_obstacle_in_words(one, path)}; {advice}") for one in found[:1]]
    faults: TableFaults = []
    for one in found:
        rising = one.end == law.low
        limit = _rounded(one.last, lambda end: not faults_at(end), up=rising)
        advice = f"give {'low' if rising else 'high'} = {limit} or {'more' if rising else 'less'}"
        faults.append((("low" if rising else "high",), f"{leads}; {_obstacle_in_words(one, path)}; {advice}"))
    return faults


def _obstacle_in_words(one: Obstacle, path: str) -> str:
    """What is wrong at the end of a distribution, in words; with the value there where other numbers matter."""
    words = _fault_in_words(one.faults[0], path)
    return words if one.is_of(path) else f"with {one.end:.6g}, {words}"


def _fault_in_words(fault: Fault, path: str) -> str:
    """A fault's key and message, without the advice that it gives about a single device; "it" in place of the key
    where that is `path`, a dotted path in full."""
    first = fault.message.split("; ")[0]  # behind which stands the advice
    # cut within a bracket, which goes, too
    if first.count("(") > first.count(")"):
        first = first[: first.rindex(" (")]
    return f"{'it' if fault.key == path else fault.key} {first}"


def _narrower_advice(law: Distribution, width_key: str, ends: Sequence[float], faults_at: FaultsOf) -> str:
    """Advice: the width of a distribution that stays between `ends`, the farthest values that a device can have.

    width_key  the first of the keys of its table that give the width
    faults_at  value of the number -> faults of the device with it
    """
    middle = law.middle
    if law.kind == "lognormal":
        shown, reach = "cut_at_deviations", min(abs(log(end / middle)) for end in ends) / law.spread
    elif law.spread:
        shown, reach = "cut_at_deviations", min(abs(end - middle) for end in ends) / law.spread
    else:
        shown, reach = width_key, min(abs(end - middle) for end in ends)
        reach *= 100.0 / abs(middle) if shown.endswith("_percent") else 1.0

    def ends_at(width: float) -> tuple[float, float]:
        """Ends of the distribution with a width, in the unit of `shown`."""
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
    """A number with few digits next to a value that fits, as text: the nearest one if it fits, else one that lies
    below it, or above it where `up`.

    >>> _rounded(0.0123456, lambda x: x <= 0.0123456), _rounded(25.0, lambda x: x < 25.0)
    ('0.01234', '24.99')
    """
    if value == 0.0:
        return "0"
    step = 10.0 ** (floor(log10(abs(value))) + 1 - DIGITS)
    nearest = round(value / step)
    texts = [f"{(nearest + (n if up else -n)) * step:.{DIGITS}g}" for n in range(3)]
    return next((text for text in texts if fits(float(text))), texts[-1])


HALVINGS: Final = 64  # of the way from a value that a device can have to one that it cannot

FaultsOf = Callable[[float], Sequence[Fault]]  # of the device with a value of the number


@dataclass(frozen=True)
class Obstacle:
    """Why no device can be built with an end of a distribution.

    end     the value that no device can have
    last    the value farthest towards it that one can have
    faults  of the device with the end
    """

    end: float
    last: float
    faults: tuple[Fault, ...]

    def is_of(self, path: str) -> bool:
        """Whether it is the number at this path alone that may not have the value, whatever the others are."""
        return all(fault.key == path for fault in self.faults)


def faults_with(document: Mapping[str, Any], key: str, ties: tuple[Tie, ...]) -> FaultsOf:
    """Function: value of one number -> the faults that a device has with it, and with what is tied to it, all
    other numbers as they are."""
    axis = Axis(key, (), ties=ties)

    def faults(value: float) -> Sequence[Fault]:
        changes = [(path, values[0]) for path, values in axis.columns([value])]
        try:
            # whether the mechanism reaches the handle's position is an outcome of each device
            from_document(address.assign_all(dict(document), changes), skip_assembly_check=True)
        except DeviceError as error:
            return error.faults
        return ()

    return faults


def obstacle(faults: FaultsOf, start: float, end: float) -> Obstacle | None:
    """What is in the way from a value that a device can have to an end of a distribution; None where a device can
    have the end.

    faults  value -> faults of the device with it

    Halves the way between a value that a device can have and one that it cannot. Where 0 lies between the two it
    is tried first: halving comes near to 0 without end.
    """
    at_end = tuple(faults(end))
    if not at_end:
        return None
    good, bad = start, end
    wanted = 0.0 if min(start, end) < 0.0 < max(start, end) else 0.5 * (good + bad)
    for _ in range(HALVINGS):
        if wanted in (good, bad):  # neighbouring numbers
            break
        good, bad = (good, wanted) if faults(wanted) else (wanted, bad)
        wanted = 0.5 * (good + bad)
    return Obstacle(end, good, at_end)
