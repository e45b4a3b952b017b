"""Every number of a device file that a designer may move, with what is known of it: unit, meaning, source, range.

All of it is read off the schema and the file. Keys that the file leaves out are among them where the schema has a
value that stands for "none", such as a delay of 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from math import ceil, floor, inf, isfinite, pi, sqrt
from typing import Any, Final, Literal, TypeAlias

from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted
from zwidth.device.load import check
from zwidth.device.schema import device_file as schema
from zwidth.device.schema.device_file import key_unit
from zwidth.errors import DeviceError

# Numbers of a device file that choose a posture, or help to find it, and are no property of the device.
CIRCUMSTANCES: Final = {
    ("mechanism", "assemblies"): "an approximate angle from which the posture is found",
    ("mechanism", "reference"): "the operating point, not a property of the device",
    ("mechanism", "workspace"): "the operating point, not a property of the device",
}
OTHERS: Final = {
    ("file_version",): "the format of the file, not a property of the device",
    ("response",): "part of the measurement, not a property of the device",
}


MOST_BROUGHT: Final = 4  # rounds in which keys that a kind of table needs are added


@dataclass(frozen=True)
class DeviceNumber:
    """A number of a device file, or a text that is one of a list.

    path         as --set takes it
    group        words of the tables it stands in, elements of lists by name
    name         its key in words, without the unit: "sampling period"; an element of a list with its index
    value        in `unit`; a text where it is one of a list, None where such a text is not given
    unit         SI, as the schema names it; "" if it has none
    description  the schema's sentence on the key
    source       where the file says that it comes from; "" if it does not
    lowest, highest  limits of the schema, -inf and inf where it has none
    excluded     which of the two limits are not allowed themselves: "lowest", "highest"
    low, high    ends of a slider, within these limits; None for texts and for what is infinite
    scale        of that slider
    whole        whether only whole numbers are allowed
    choices      the texts that are allowed; () for a number
    brings       of a text that says what kind of table it is in, what each of them sets beside itself: path ->
                 value; None: removed, if it is there
    also         paths that must be given the same value: the mirror image in a symmetric matrix
    given        whether the file has it; otherwise `value` is what leaving it out amounts to
    """

    path: str
    group: tuple[str, ...]
    name: str
    value: float | str | None
    unit: str
    description: str
    source: str
    lowest: float
    highest: float
    excluded: tuple[str, ...]
    low: float | None
    high: float | None
    scale: Scale
    whole: bool
    choices: tuple[str, ...]
    brings: dict[str, dict[str, float | str | None]]
    also: tuple[str, ...]
    given: bool

    def document(self) -> dict[str, Any]:
        """The record as JSON can hold it: None for a limit that there is none of, "inf" for an infinite value."""
        own = asdict(self)
        infinite = isinstance(self.value, float) and not isfinite(self.value)
        return own | {
            "group": list(self.group),
            "value": str(self.value) if infinite else self.value,
            "lowest": self.lowest if isfinite(self.lowest) else None,
            "highest": self.highest if isfinite(self.highest) else None,
            "excluded": list(self.excluded),
            "choices": list(self.choices) or None,
            "also": list(self.also),
        }


def device_numbers(device: Device) -> tuple[DeviceNumber, ...]:
    """The numbers of a device, and its texts that are one of a list, in the order of its file; of each table those
    that it leaves out come last.

    Not in the list: what `unchangeable` gives a reason for; a key left out, if no value says the same as
    leaving it out; parts of the device that take more than one number to be there.

    >>> from zwidth.device.load import from_document
    >>> plain = from_document({"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}})
    >>> [(one.path, one.low, one.high) for one in device_numbers(plain) if one.given]
    [('plant.mass_kg', 0.025, 0.4), ('loop.sampling_period_s', 0.00025, 0.004)]
    """
    document = device.document
    given = list(_given_values(document, document, ()))
    absent = list(_absent_values(document, {steps for steps, _ in given}))
    # path of a table or list -> place in the order of the last number inside it, behind which absent ones come
    last_inside = {steps[:end]: place for place, (steps, _) in enumerate(given) for end in range(len(steps))}
    placed = [(place, 0, _record(device, steps, value, True)) for place, (steps, value) in enumerate(given)]
    for steps, value in absent:
        owner = next(steps[:end] for end in reversed(range(len(steps))) if steps[:end] in last_inside)
        placed.append((last_inside[owner], 1, _record(device, steps, value, False)))
    return tuple(record for _, _, record in sorted(placed, key=lambda one: one[:2]))


def circumstance(steps: KeyPath) -> str:
    """Why a number of a file only chooses where the device is and is no property of it; empty if it is one."""
    return next((why for head, why in CIRCUMSTANCES.items() if steps[: len(head)] == head), "")


def unchangeable(steps: KeyPath) -> str:
    """Why `device_numbers` leaves a number of a device file out; "" if it does not."""
    if schema.below_diagonal(steps):
        return "it moves with its mirror image in a symmetric matrix"
    return circumstance(steps) or next((why for head, why in OTHERS.items() if steps[: len(head)] == head), "")


def _given_values(document: dict[str, Any], value: Any, path: KeyPath) -> Iterator[tuple[KeyPath, float | str]]:
    """Steps and value of each number, and of each text that is one of a list, that stand in a value of the
    document.

    value, path  the table, list, number or text, and where it stands
    """
    if isinstance(value, dict | list):
        for step, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _given_values(document, inner, (*path, step))
    elif unchangeable(path) or isinstance(value, bool):
        return
    elif isinstance(value, int | float) or (isinstance(value, str) and _choices(document, path)):
        yield path, value


def _absent_values(document: dict[str, Any], given: set[KeyPath]) -> Iterator[tuple[KeyPath, float | str | None]]:
    """Steps of each key that the file leaves out and that may be set alone, and what leaving it out amounts to.

    given  steps of the numbers and texts that it gives
    """
    found = set[KeyPath]()
    tables = ((), *_table_paths(document, ()))
    for steps in dict.fromkeys(key for table in tables for key in _absent_keys(document, table)):
        rivals = {(*steps[:-1], key) for key in address.rivals(steps)}
        if unchangeable(steps) or rivals & (given | found):
            continue
        for value in _value_of_nothing(document, steps):
            found.add(steps)
            yield steps, value


def _table_paths(place: Any, path: KeyPath) -> Iterator[KeyPath]:
    """Path of every table in a document, but not that of the whole."""
    if isinstance(place, dict | list):
        for step, inner in place.items() if isinstance(place, dict) else enumerate(place):
            if isinstance(inner, dict):
                yield (*path, step)
            yield from _table_paths(inner, (*path, step))


def _absent_keys(document: dict[str, Any], table: KeyPath) -> Iterator[KeyPath]:
    """Steps of every key of a table that it leaves out, and of those inside a table that it leaves out.

    table  steps of the table, which may itself be left out
    """
    value: Any = document
    for step in table:
        value = value.get(step) if isinstance(value, dict) else value[step]
        if value is None:
            break
    kinds = schema.subschemas(table, document)
    for key in dict.fromkeys(key for kind in kinds for key in kind.get("properties", {})):
        steps = (*table, key)
        if isinstance(value, dict) and key in value:
            continue
        if any("properties" in one for one in schema.subschemas(steps, document)):
            inside = _absent_keys(document, steps)
            # a text changes nothing of a part that is not there
            has_default = schema.default(steps, document) is not None
            yield from (
                inner_steps for inner_steps in inside if has_default or not _choices(document, inner_steps)
            )
        else:
            yield steps


def _value_of_nothing(document: dict[str, Any], steps: KeyPath) -> Iterator[float | str | None]:
    """Yield the value that says the same as leaving a key out; nothing where no value does, or where the file's
    checks refuse it if it is set alone."""
    choices, default = _choices(document, steps), schema.default(steps, document)
    tried = [default]
    if choices:
        tried = [default or choices[0]]
    elif default is None and schema.may_be_zero(steps) and schema.zero_is_none(steps):
        default = 0.0
        # with 0 it may go unseen that other keys are missing
        tried = [default, typical_size(document, steps)]
    if any(not isinstance(one, int | float | str) or isinstance(one, bool) for one in tried):
        return
    # a free text is no number
    if isinstance(default, str) and not choices:
        return
    try:
        for one in tried:
            check(address.assign(document, dotted(steps, document), one), "")
    except DeviceError:
        return
    yield default


def _choices(document: dict[str, Any], steps: KeyPath) -> tuple[str, ...]:
    """The texts that may stand at a path; () where any text may, or none.

    Those of all kinds where the text says which kind of table it is.
    """
    of_kinds = steps[-1] in schema.TAGS
    found: dict[str, None] = {}
    for kind in schema.subschemas(steps, None if of_kinds else document):
        found |= dict.fromkeys(map(str, kind.get("enum", [kind["const"]] if "const" in kind else [])))
    return tuple(found) if len(found) > 1 else ()


def _changes_by_kind(
    document: dict[str, Any], steps: KeyPath, choices: tuple[str, ...]
) -> dict[str, dict[str, float | str | None]]:
    """For each kind of table that a tag at `steps` may name, what changes with it: path -> value of a key that
    it reads and another kind does not, the file's or a usual one, or None for one that it does not read. {} where
    the key is no tag; a kind that is refused for other reasons is left out."""
    tag, keys = schema.kinds(steps[:-1])
    if steps[-1] != tag:
        return {}
    table = dotted(steps[:-1], document)
    not_shared = {
        key for kind in keys.values() for key in kind if any(key not in other for other in keys.values())
    }
    found: dict[str, dict[str, float | str | None]] = {}
    for choice in choices:
        changed = _changed_to_kind(document, steps, choice, keys[choice])
        if changed is not None:
            removed = {f"{table}.{key}": None for key in sorted(not_shared - keys[choice])}
            new_table = _table(changed, steps[:-1])
            found[choice] = removed | {f"{table}.{key}": new_table[key] for key in new_table if key in not_shared}
    return found


def _changed_to_kind(
    document: dict[str, Any], steps: KeyPath, choice: str, read: set[str]
) -> dict[str, Any] | None:
    """The document with the tag at `steps` set to `choice` and its table made complete: keys that this kind does
    not read are removed, those that it needs get usual values. None where it is refused for another reason.

    read  the keys of that kind
    """
    changed = address.assign(document, dotted(steps, document), choice)
    table = dotted(steps[:-1], changed)
    for key in _table(document, steps[:-1]):
        if key not in read:
            changed = address.assign(changed, f"{table}.{key}", address.UNSET)
    for _ in range(MOST_BROUGHT):
        try:
            check(changed, "")
        except DeviceError as error:
            there = _table(changed, steps[:-1])
            inside = [one.key.removeprefix(f"{table}.") for one in error.faults]
            missing = [key for key in inside if key in read and key not in there]
            if not missing:
                return None
            for key in missing:
                size = typical_size(changed, (*steps[:-1], key))
                _, whole = number_limits(changed, (*steps[:-1], key))
                changed = address.assign(changed, f"{table}.{key}", round(size) if whole else size)
        else:
            return changed
    return None


def _table(document: dict[str, Any], steps: KeyPath) -> dict[str, Any]:
    """The table at a path of keys and indices; an empty one where there is none."""
    place: Any = document
    for step in steps:
        place = place[step] if isinstance(step, int) else place.get(step, {})
    return place if isinstance(place, dict) else {}


def _record(device: Device, steps: KeyPath, value: float | str | None, given: bool) -> DeviceNumber:
    """The `DeviceNumber` at a path: value, unit, limits, slider and choices; `given`: whether the file has it."""
    document, path = device.document, dotted(steps, device.document)
    image = schema.mirror_image(steps)
    # place of the last key in the path: before it is the path of its table, behind it are indices of an element
    key_at = next(end for end in reversed(range(len(steps))) if isinstance(steps[end], str))
    limits, whole = number_limits(document, steps)
    number = value if isinstance(value, int | float) else None
    choices = _choices(document, steps) if number is None else ()
    low, high, scale = (None, None, "linear") if number is None else slider(document, steps, number)
    return DeviceNumber(
        path=path,
        group=tuple(dotted(steps[:key_at], document).split(".")) if key_at else ("device",),
        name=number_name(steps),
        value=value if number is None or whole else float(number),
        unit=schema.key_unit(steps),
        description=schema.key_sentence(steps),
        source=source_of(steps, document, device.sources),
        lowest=limits[0],
        highest=limits[1],
        excluded=limits[2],
        low=low,
        high=high,
        scale=scale,
        whole=whole,
        choices=choices,
        brings=_changes_by_kind(document, steps, choices),
        also=() if image is None else (dotted(image, document),),
        given=given,
    )


def number_name(steps: KeyPath) -> str:
    """A key in words without its unit, and the indices of an element of a list, from 0.

    >>> number_name(("loop", "sampling_period_s")), number_name(("plant", "mass_kg", 0, 1))
    ('sampling period', 'mass [0, 1]')
    >>> number_name(("mechanism", "links", 0, "inertia_kg_m2"))
    'inertia'
    """
    end = len(steps)
    while isinstance(steps[end - 1], int):
        end -= 1
    key, unit = str(steps[end - 1]), key_unit(steps).replace("^", "").replace("/", "_per_")
    for spelled in (unit.replace(" ", ""), unit.replace(" ", "_")):
        if unit:
            key = key.removesuffix(f"_{spelled}")
    indices = ", ".join(map(str, steps[end:]))
    return key.replace("_", " ") + (f" [{indices}]" if indices else "")


def source_of(steps: KeyPath, document: object, sources: Mapping[str, str]) -> str:
    """What [sources] says of a number: under the longest path that it lies at or below, of those the one with the
    fewest *; "" if there is none.

    >>> source_of(("plant", "mass_kg"), {}, {"plant": "drawings", "plant.mass_kg": "scales", "loop": "code"})
    'scales'
    """
    names = dotted(steps, document).split(".")
    best, found = (0, 0), ""
    for path, text in sources.items():
        parts = path.split(".")
        if parts[0] != names[0] and names[0] == "mechanism":  # as --set takes it, without its first step
            parts = ["mechanism", *parts]
        if len(parts) > len(names) or any(
            part not in ("*", step_name, str(step))
            for part, step_name, step in zip(parts, names, steps, strict=False)
        ):
            continue
        rank = (len(parts), -parts.count("*"))
        if rank > best:
            best, found = rank, text
    return found


SPAN: Final = 4.0  # a slider goes from a quarter of its number to four times that
NEAR: Final = 0.01  # distance of a slider's end from a limit that is excluded, in shares of the number's own

Scale: TypeAlias = Literal["linear", "logarithmic"]

# Usual sizes on a device that a hand holds, by unit.
USUAL: Final = {
    "": 0.25, "m": 0.1, "rad": 0.5, "s": 1e-3, "1/s": 10.0, "m/s": 0.01, "rad/s": 0.1, "m/s^2": 10.0,
    "kg": 0.1, "N": 0.5, "N/m": 1e3, "N s/m": 1.0, "N/m^3": 1e8,
    "kg m^2": 1e-4, "N m": 0.05, "N m/rad": 1.0, "N m s/rad": 5e-3, "N m/rad^3": 1.0,
}  # fmt: skip


def number_limits(document: dict[str, Any], steps: KeyPath) -> tuple[tuple[float, float, tuple[str, ...]], bool]:
    """Lowest and highest value that the schema allows, which of the two ("lowest", "highest") are not allowed
    themselves; and whether the number must be whole. -inf and inf for a key that is no number."""
    kinds = [one for one in schema.subschemas(steps, document) if one.get("type") in ("number", "integer")]
    for kind in kinds:
        at_least, at_most = (_limit(kind, "ge", "minimum"), _limit(kind, "le", "maximum"))
        greater_than, less_than = (_limit(kind, "gt", "exclusiveMinimum"), _limit(kind, "lt", "exclusiveMaximum"))
        excluded = [
            *(["lowest"] if greater_than is not None else []),
            *(["highest"] if less_than is not None else []),
        ]
        lowest = next((x for x in (greater_than, at_least) if x is not None), -inf)
        highest = next((x for x in (less_than, at_most) if x is not None), inf)
        return (lowest, highest, tuple(excluded)), kind["type"] == "integer"
    return (-inf, inf, ()), False


def _limit(kind: dict[str, Any], ours: str, standard: str) -> float | None:
    """A limit in a number's schema, by its name in JSON Schema, `standard`, or in pydantic's, `ours`."""
    value = kind.get(standard, kind.get(ours))
    return None if value is None else float(value)


def typical_size(document: dict[str, Any], steps: KeyPath) -> float:
    """Size that a number which is 0 may have: the largest number under its key in the same part of the file, else
    what the schema calls usual for it, else the sampling period for a time and a tenth of the sampling rate for a
    frequency, else the largest number of its unit in the file, else what is usual for its unit, else 1. Numbers
    without a unit have nothing in common."""
    return (
        _size_of_key(document, steps) or _size_of_unit(document, steps) or USUAL.get(schema.key_unit(steps), 1.0)
    )


def _size_of_key(document: dict[str, Any], steps: KeyPath) -> float:
    """Size of numbers like that at a path: the largest of the same key in the same part of the file, else the
    usual one, else the sampling period for a time, a tenth of the sampling rate for a frequency; 0 where
    unknown."""
    key, period = _last_key(steps), document.get("loop", {}).get("sampling_period_s", 0.0)
    beside = [
        abs(value) for path, value in _finite_numbers(document) if _last_key(path) == key and path[0] == steps[0]
    ]
    by_period = {"s": float(period), "Hz": 0.1 / float(period) if period else 0.0}
    return max(beside, default=0.0) or schema.usual_size(steps) or by_period.get(schema.key_unit(steps), 0.0)


def _size_of_unit(document: dict[str, Any], steps: KeyPath) -> float:
    """The largest number of the same unit, which may mean another thing; 0 where there are none."""
    unit = schema.key_unit(steps)
    alike = [abs(value) for path, value in _finite_numbers(document) if unit and schema.key_unit(path) == unit]
    return max(alike, default=0.0)


def _finite_numbers(document: dict[str, Any]) -> Iterator[tuple[KeyPath, float]]:
    """Path and value of each number of the document that is not infinite."""
    return ((path, value) for path, value in address.number_paths(document) if isfinite(value))


def _slider_end_from_zero(document: dict[str, Any], steps: KeyPath) -> float:
    """Upper end of a slider from 0: SPAN times the usual size of such numbers, or else what others of its unit
    need."""
    if size := _size_of_key(document, steps):
        return SPAN * size
    return max(SPAN * USUAL.get(schema.key_unit(steps), 0.0), _size_of_unit(document, steps)) or SPAN


def _last_key(steps: KeyPath) -> str:
    """The last step of a path that is a key and no index."""
    return next(str(step) for step in reversed(steps) if isinstance(step, str))


def slider(document: dict[str, Any], steps: KeyPath, value: float) -> tuple[float | None, float | None, Scale]:
    """Ends of the slider of a number and its scale; None for a number that is infinite.

    A magnitude goes from a quarter of itself to four times that, by its logarithm; from 0 on where it is 0, or
    where the schema calls a size usual. Of numbers of either sign angles go half a turn or a whole one to both
    sides, shares of 1 from -1 to 1, elements beside the diagonal of a symmetric matrix as far as it stays positive
    definite, others twice as far to both sides as they are large.
    """
    if not isfinite(value):
        return None, None, "logarithmic"
    (lowest, highest, excluded), whole = number_limits(document, steps)
    scale: Scale = "linear"
    if value < 0.0 or (lowest < 0.0 and not _on_diagonal(steps)):
        low, high = _ends_of_either_sign(document, steps, value)
    elif value == 0.0:
        low, high = 0.0, SPAN if whole else _slider_end_from_zero(document, steps)
    elif usual := schema.usual_size(steps):
        low, high = 0.0, SPAN * max(usual, value)
    else:
        low, high = value / SPAN, value * SPAN
        scale = "linear" if whole else "logarithmic"
    # a limit that is not allowed itself is kept away from
    low = max(low, lowest + NEAR * (value - lowest) if "lowest" in excluded else lowest)
    high = min(high, highest - NEAR * (highest - value) if "highest" in excluded else highest)
    return (ceil(low), floor(high), scale) if whole else (low, high, scale)


def _ends_of_either_sign(document: dict[str, Any], steps: KeyPath, value: float) -> tuple[float, float]:
    """Lower and upper end of a slider of a number that may be negative; see `slider`."""
    size, unit = abs(value), schema.key_unit(steps)
    if schema.mirror_image(steps) is not None:
        *path, i, j = steps
        rows: Any = document
        for step in path:
            rows = rows[step]
        # positive definite needs M_ij^2 < M_ii M_jj
        bound = max(size, (1.0 - NEAR) * sqrt(max(rows[i][i] * rows[j][j], 0.0)))
        if bound > 0.0:
            return -bound, bound
    if unit == "rad" and size <= 2.0 * pi:
        turn = pi if size <= pi else 2.0 * pi
        return -turn, turn
    if not unit and size <= 1.0:
        return -1.0, 1.0
    away = 2.0 * size or typical_size(document, steps)  # twice: once ends at 0, which no vector may be
    return value - away, value + away


def _on_diagonal(steps: KeyPath) -> bool:
    """Whether a number stands on the diagonal of a symmetric matrix, which may be written as its diagonal or, of
    one row, as a number."""
    for depth in range(3):  # the matrix is at the path itself, or one or two indices above
        whole, indices = steps[: len(steps) - depth], steps[len(steps) - depth :]
        kinds = schema.subschemas(whole)
        rows = any(one.get("items", {}).get("type") == "array" for one in kinds)
        if rows and any(one.get("type") == "number" for one in kinds):
            return len(set(indices)) <= 1  # no index, one of a diagonal, or two that are equal
        if not isinstance(whole[-1], int):
            break
    return False
