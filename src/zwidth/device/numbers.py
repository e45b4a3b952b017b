"""The numbers of a device as a list for people: what each is called, its unit and source, and how far to move it.

Everything comes from the schema and the file: names from keys, units and hard limits from the schema, sources from
the file's own [sources]. Ranges are for a slider and promise nothing; the file's checks have the last word.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from math import isfinite
from typing import Any, Final, Literal

from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, KeyPath, dotted
from zwidth.device.schema import device_file as schema

Scale = Literal["linear", "logarithmic"]

# Tables and keys whose numbers choose a posture, or say something of the file itself.
NO_NUMBERS: Final = frozenset({"sources", "file_version", "assemblies", "reference", "workspace"})
FACTOR: Final = 4.0  # by which a slider goes up and down from a positive number
COORDINATES: Final = "xyz"
# A slider's end for a number that is 0, by unit; times the sampling period where a unit is s.
USUAL: Final = {"": 1.0, "s": 5.0, "m": 0.1, "rad": 1.0, "kg": 0.1}
# Numbers that are 0 where a file leaves them out, and that designers ask for first.
LEFT_OUT: Final = (
    "loop.delay_samples",
    "loop.actuator.time_constant_s",
    "loop.encoder.resolution_m",
    "friction.coulomb_N",
)
# Units of what has a size and no sign, also where a matrix stands for it.
SIZES: Final = frozenset({"kg", "kg m^2", "N/m", "N m/rad", "N s/m", "N m s/rad"})


@dataclass(frozen=True)
class DeviceNumber:
    """One number of a device, or one word of a list, as people change it.

    path         dotted, as in --set;   group  tables that it stands in;   name  key in words, without its unit
    value        as the file has it, or what leaving it out means;   unit  SI; "" for none
    description  the schema's;   source  where it comes from; "" where the file does not say
    low, high    ends of a slider, None for a word;   scale  how a slider goes from one to the other
    whole        only whole numbers are allowed
    lowest, highest  hard limits; None: none
    choices      words that are allowed; None for a number
    also         paths that move with it: the mirror image in a symmetric matrix
    given        whether the file gives it
    """

    path: str
    group: tuple[str, ...]
    name: str
    value: Any
    unit: str
    description: str
    source: str
    low: float | None
    high: float | None
    scale: Scale
    whole: bool
    lowest: float | None
    highest: float | None
    choices: tuple[str, ...] | None
    also: tuple[str, ...]
    given: bool

    def document(self) -> dict[str, Any]:
        """Everything by key."""
        return asdict(self)


def device_numbers(device: Device) -> list[DeviceNumber]:
    """Every number and every word of a list that can be changed, in the file's order; then those of the computer
    that the file leaves out.

    Numbers that choose a posture are left out: positions, directions, start angles, the box of the workspace.
    """
    found = [_entry(device, steps, value) for steps, value in _values(device.document)]
    period = device.controller.sampling_period
    made = [_with_range(one, period) for one in found if one is not None]
    known = {one.path for one in made}
    for path in LEFT_OUT:
        if path not in known and _can_be(device, path, 0.0):
            entry = _entry(device, address.resolve(device.document, path), 0.0, given=False)
            if entry is not None:
                made.append(_with_range(entry, period))
    return made


def _values(value: Any, steps: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Path and value of every number and every chosen word, in the document's order."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in NO_NUMBERS:
                yield from _values(inner, (*steps, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _values(inner, (*steps, index))
    elif isinstance(value, str | int | float) and not isinstance(value, bool):
        yield steps, value


def _entry(device: Device, steps: KeyPath, value: Any, *, given: bool = True) -> DeviceNumber | None:
    """The record of one value, without its range; None for a word that is not one of a list, and for an element
    whose mirror image stands before it."""
    document = device.document
    choices = _choices(steps)
    if isinstance(value, str) and len(choices) < 2:
        return None
    mirror = schema.mirror_image(steps)
    if mirror is not None and _is_below(steps):
        return None
    path = dotted(steps, document)
    kinds = schema.subschemas(steps)
    unit = schema.key_unit(steps)
    lowest, highest = _limits(kinds)
    *tables, name = path.split(".")
    while (
        tables and isinstance(steps[len(tables)], int) and not isinstance(_at(document, steps, len(tables)), dict)
    ):
        name = f"{tables.pop()}.{name}"
    return DeviceNumber(
        path=path,
        group=tuple(tables) or ("device",),
        name=_words(name, unit),
        value=value,
        unit=unit,
        description=_description(steps),
        source=_source(device, path) if given else "",
        low=None,
        high=None,
        scale="linear",
        whole=bool(kinds) and all(kind.get("type") in ("integer", "null") for kind in kinds),
        lowest=lowest,
        highest=highest,
        choices=choices if isinstance(value, str) else None,
        also=() if mirror is None else (dotted(mirror, document),),
        given=given,
    )


def _at(document: Any, steps: KeyPath, depth: int) -> Any:
    """The value at the first `depth` + 1 steps of a path; None where the document has none."""
    for step in steps[: depth + 1]:
        try:
            document = document[step]
        except (KeyError, IndexError, TypeError):
            return None
    return document


def _is_below(steps: KeyPath) -> bool:
    row, column = steps[-2:]
    return isinstance(row, int) and isinstance(column, int) and row > column


def _choices(steps: KeyPath) -> tuple[str, ...]:
    """The words that the schema allows at a path; () where any word may stand."""
    words: list[str] = []
    for kind in schema.subschemas(steps):
        words += [kind["const"]] if isinstance(kind.get("const"), str) else []
        words += [word for word in kind.get("enum", ()) if isinstance(word, str)]
    return tuple(dict.fromkeys(words))


def _limits(kinds: list[dict[str, Any]]) -> tuple[float | None, float | None]:
    """Hard limits that every kind of number allowed there has; None where one has none."""
    numbers = [kind for kind in kinds if kind.get("type") in ("number", "integer")]
    lows = [_first(kind, "ge", "minimum", "gt", "exclusiveMinimum") for kind in numbers]
    highs = [_first(kind, "le", "maximum", "lt", "exclusiveMaximum") for kind in numbers]
    lowest = None if not lows or None in lows else min(low for low in lows if low is not None)
    highest = None if not highs or None in highs else max(high for high in highs if high is not None)
    return lowest, highest


def _first(kind: dict[str, Any], *keys: str) -> float | None:
    return next((float(kind[key]) for key in keys if key in kind), None)


def _words(name: str, unit: str) -> str:
    """A key in words, without the unit that it ends in; elements of a vector by their coordinate.

    >>> _words("sampling_period_s", "s"), _words("center_of_mass_m.1", "m"), _words("mass_kg.0.1", "kg")
    ('sampling period', 'center of mass y', 'mass [0, 1]')
    """
    key, *elements = name.split(".")
    ending = "_" + unit.replace("/", "_per_").replace("^", "").replace("kg m2", "kg_m2").replace(" ", "")
    words = key.removesuffix(ending).replace("_", " ")
    if not elements:
        return words
    if len(elements) == 1 and unit == "m" and elements[0] in ("0", "1", "2"):
        return f"{words} {COORDINATES[int(elements[0])]}"
    return f"{words} [{', '.join(elements)}]"


def _description(steps: KeyPath) -> str:
    """The schema's sentence on the key, or on the list that the number stands in."""
    while steps:
        if text := schema.key_description(steps):
            return re.sub(r" \[[^\]]*\]$", "", text)
        steps = steps[:-1]
    return ""


def _source(device: Device, path: str) -> str:
    """The source of the first entry of [sources] that names the path or what it stands in."""
    for pattern, text in device.sources.items():
        if fnmatchcase(path, pattern) or fnmatchcase(path, f"{pattern}.*"):
            return text
    return device.source


def _with_range(one: DeviceNumber, period: float) -> DeviceNumber:
    """The record with a slider's ends, within the hard limits."""
    if one.choices is not None or not isfinite(one.value):
        return one
    value, positive = float(one.value), one.lowest is not None and one.lowest >= 0.0
    usual = USUAL.get(one.unit, 1.0) * (period if one.unit == "s" and isfinite(period) else 1.0)
    if not one.given or (value > 0.0 and one.unit in SIZES and not one.also):
        positive = True
        usual *= 0.01 if one.unit == "m" else 1.0  # the step of an encoder
    scale: Scale = "linear"
    if value > 0.0 and positive and not _may_be_zero(one):
        low, high, scale = value / FACTOR, value * FACTOR, "logarithmic"
    elif positive:
        low, high = 0.0, FACTOR * value if value > 0.0 else usual
        high = max(high, 3.0) if one.path.endswith("delay_samples") else high
    else:
        reach = 2.0 * abs(value) if value else usual
        low, high = value - reach, value + reach
    low = low if one.lowest is None else max(low, one.lowest)
    high = high if one.highest is None else min(high, one.highest)
    if one.whole:
        low, high, scale = float(round(low)), float(max(round(high), round(low) + 1)), "linear"
    return DeviceNumber(**{**asdict(one), "low": low, "high": high, "scale": scale})


def _may_be_zero(one: DeviceNumber) -> bool:
    """Whether the number may be 0, as delays, friction and damping may."""
    return schema.may_be_zero(tuple(int(part) if part.isdigit() else part for part in one.path.split(".")))


def _can_be(device: Device, path: str, value: float) -> bool:
    """Whether the device may have this number, which its file leaves out."""
    try:
        device.with_({path: value})
    except (DeviceError, ValueError, TypeError):
        return False
    return True
