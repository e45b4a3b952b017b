"""From the [[axis]] tables of a study file to axes, or to what is wrong with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import ceil, floor, isfinite, isnan
from pathlib import Path
from typing import Any, Final

from zwidth.device import address
from zwidth.device.address import is_number, tables
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted, fail, nearest, plural, quote, suggestion
from zwidth.device.schema import device_file as schema
from zwidth.errors import DeviceError, FileError
from zwidth.model.reduction import MODELS
from zwidth.questions import WANTED_BY_KEY
from zwidth.study.designs.sampling import CIRCUMSTANCES, WANTED, Axis, Tie, read_catalogue, spread

UNITS: Final = {key: one.unit for key, one in WANTED_BY_KEY.items()}
NUMBER: Final = ("number", "integer")
SEARCH: Final = "search"  # how designs are spread over bounds

TableFault = tuple[KeyPath, str]
TableFaults = list[TableFault]
SetNumbers = dict[KeyPath, tuple[str, str]]  # what is set: as it is written, and the axis that sets it


def axes_of(
    document: dict[str, Any],
    device: Device | None,
    faults_of_axes: TableFaults,
    folder: Path = Path(),
    *,
    bounds: bool = False,
) -> tuple[Axis, ...]:
    """The axes of a study that have no fault; the faults of the others are added to `faults_of_axes`.

    document  the study as read. Values of the wrong type are left out here: `study_schema` reports them
    device    None if it could not be loaded; paths are then not looked up
    folder    that catalogues are looked for in
    bounds    whether ranges are the bounds of an optimiser's variables: they need no count, and may be of numbers
              that are whole
    """
    sampling = SEARCH if bounds else document.get("sampling", "grid")
    axes, taken = [], SetNumbers()
    if sampling == "paired":
        faults_of_axes += _pairing_faults(document)
    for n, table in tables(document, "axis"):
        here = ("axis", n)
        faults_of_axes += [((*here, *path), message) for path, message in _values_faults(table, sampling)]
        key = table.get("key")
        if not isinstance(key, str) or not key:
            continue
        # the key of a catalogue is a name of its own, no number of the file: `_catalogue_axis` checks its numbers
        number_or_circumstance = [] if "catalogue" in table else [key]
        faults = [
            fault
            for path in number_or_circumstance
            for fault in overlap_faults(path, ("key",), key, device, taken)
        ]
        axis: Axis | None = None
        if "catalogue" in table:
            axis = _catalogue_axis(table, key, device, folder, taken, faults)
        elif key in CIRCUMSTANCES:
            faults += _circumstance_faults(key, table, device)
            axis = _axis_of_table(table, key, UNITS.get(key, "m" if key == "at" else ""), ())
            if table.get("tie"):
                faults.append((("tie",), f"goes with a number of the device file, not with {key}; remove it"))
        elif device is not None:
            axis = _number_axis(table, key, device, taken, faults, bounds=bounds)
        faults_of_axes += [((*here, *path), message) for path, message in faults]
        if axis is not None and not faults:
            axes.append(axis)
    return tuple(axes)


def _number_axis(
    table: dict[str, Any],
    key: str,
    device: Device,
    taken: SetNumbers,
    faults: TableFaults,
    *,
    bounds: bool,
) -> Axis | None:
    """Return the axis over a number of the device file; None where `key_faults` finds any in its key or values, or
    it has no values. With other faults, such as those of a tie, it is returned; `axes_of` leaves it out.

    taken   the numbers that other axes set; those of this axis' ties are added
    faults  of this axis; those found here are added
    bounds  as for `axes_of`
    """
    wrong = list(key_faults(device.document, key, _values_with_paths(table), whole_ranges=bounds))
    faults += wrong
    if wrong:
        return None
    ties = list(ties_of(table, key, device, taken, faults))
    axis = _axis_of_table(table, key, unit_of(device.document, key), tuple(ties))
    whole = table.get("integer") is True or _takes_whole_numbers(device.document, key)
    if axis is not None and bounds and whole and axis.span is not None:
        if floor(axis.span[1]) - ceil(axis.span[0]) < 1:
            faults.append((("range",), "holds fewer than two whole numbers; widen it"))
        axis = replace(axis, whole=True)
    return axis


def unit_of(document: dict[str, Any], key: str) -> str:
    """The unit that the device file's schema states for a number, or for the list that it stands in."""
    return schema.key_unit(address.resolve(document, key))


def _pairing_faults(document: dict[str, Any]) -> Iterator[TableFault]:
    """Faults of paired axes that have unlike numbers of values; those without `values` or `count`, as of a
    catalogue, are passed over."""
    counts: list[tuple[int, str, int]] = []  # number of the axis, the key that says how many, and how many
    for n, table in tables(document, "axis"):
        values, count = table.get("values"), table.get("count")
        many = len(values) if isinstance(values, list) else count if isinstance(count, int) else None
        if many is not None:
            counts.append((n, "values" if isinstance(values, list) else "count", many))
    for n, key, many in counts[1:]:
        if many != counts[0][2]:
            message = (
                f"gives {plural(many, 'value')}, the first axis {counts[0][2]}; paired axes have equally many"
            )
            yield (("axis", n, key), message)


def _values_faults(table: dict[str, Any], sampling: str) -> Iterator[TableFault]:
    """Faults of an axis that has no values, gives them twice (range and values, or a value again), or has a key
    too many, or one too few; and of a logarithmic range that does not begin above 0.

    sampling  as the study file names it, or SEARCH
    """
    span, values = table.get("range"), table.get("values")
    if "catalogue" in table:
        for key in ("range", "values", "count", "scale", "tie", "integer"):
            if key in table:
                yield ((key,), "does not go with a catalogue; remove one of the two")
        if not table.get("set"):
            example = 'set = { "drives.motor.motor_inertia_kg_m2" = "inertia_kg_m2" }'
            yield ((), f"has a catalogue and no set; say which column is which number, such as {example}")
        return
    if "set" in table:
        yield (("set",), "is read with a catalogue only; remove it, or give catalogue = FILE.csv")
    if span is None and values is None:
        yield ((), "has no values; give range = [low, high] and count, or values = [...]")
    if span is not None and values is not None:
        yield (("values",), "and range exclude each other; remove one of them")
    elif values is not None:
        seen = set[str]()
        for n, value in enumerate(values if isinstance(values, list) and sampling != "paired" else []):
            if repr(value) in seen:
                yield (("values", n), f"{quote(value)} is listed already; remove it")
            seen.add(repr(value))
        for key in ("count", "scale"):
            if key in table:
                yield ((key,), "is read with a range only; remove it")
    elif span is not None and sampling == "latin-hypercube" and "count" in table:
        yield (
            ("count",),
            "is for a grid; a Latin hypercube has one count for all axes: move it to the top",
        )
    elif span is not None and sampling not in ("latin-hypercube", SEARCH) and "count" not in table:
        yield ((), "has a range and no count; add the number of its values, such as count = 11")
    if table.get("scale") == "log" and isinstance(span, list) and span and is_number(span[0]) and span[0] <= 0:
        yield (("range",), f'must begin above 0 where scale = "log", got {quote(span)}')


def _catalogue_axis(
    table: dict[str, Any], key: str, device: Device | None, folder: Path, taken: SetNumbers, faults: TableFaults
) -> Axis | None:
    """The axis of a catalogue; None where it has a fault, which is added to `faults`, unless `study_schema` or
    `_values_faults` reports it.

    folder  that the catalogue's file lies in
    taken   the numbers that other axes set; those of the catalogue are added
    """
    given, file = table.get("set"), table["catalogue"]
    columns = {path: heading for path, heading in given.items() if isinstance(heading, str)} if given else {}
    if key in CIRCUMSTANCES:
        faults.append((("key",), f"'{key}' is a circumstance; call what the catalogue holds otherwise"))
    for path in columns if device is not None else ():
        assert device is not None
        wrong = [(("set", path), message) for _, message in key_faults(device.document, path, _SOME_NUMBER)]
        faults += wrong or overlap_faults(path, ("set", path), key, device, taken)
    if not isinstance(file, str) or not file or not columns:
        return None
    try:
        parts = read_catalogue(folder / file, columns)
    except FileError as error:
        faults += [(("catalogue",), f"{file}: {line}") for line in str(error).splitlines()]
        return None
    return None if faults else Axis(key, tuple(parts), parts=tuple(parts.values()))


_SOME_NUMBER: Final[list[tuple[KeyPath, Any]]] = [(("set",), 1)]  # stands for those of a catalogue


def _takes_whole_numbers(document: dict[str, Any], key: str) -> bool:
    """Whether the device file allows no other numbers at a path."""
    kinds = {kind.get("type") for kind in schema.subschemas(address.resolve(document, key))}
    return "integer" in kinds and "number" not in kinds


def _values_with_paths(table: dict[str, Any]) -> list[tuple[KeyPath, Any]]:
    """The entries of the axis's range and values, each with its key path in the table, such as ("values", 2)."""
    return [
        ((key, n), value)
        for key in ("range", "values")
        for n, value in enumerate(table[key] if isinstance(table.get(key), list) else [])
    ]


def _without_wrong_range_ends(values: list[tuple[KeyPath, Any]]) -> Iterator[tuple[KeyPath, Any]]:
    """The entries of `_values_with_paths` but for ends of a range that are no finite numbers, which `study_schema`
    reports."""
    for where, value in values:
        if where[0] != "range" or (is_number(value) and isfinite(value)):
            yield where, value


def _axis_of_table(table: dict[str, Any], key: str, unit: str, ties: tuple[Tie, ...]) -> Axis | None:
    """The axis of a table; None where its values have a fault: `study_schema` or `_values_faults` reports it."""
    span, values, count = table.get("range"), table.get("values"), table.get("count")
    logarithmic = table.get("scale") == "log"
    if isinstance(values, list) and values and span is None:
        return Axis(key, tuple(tuple(v) if isinstance(v, list) else v for v in values), None, False, ties, unit)
    if not isinstance(span, list) or len(span) != 2 or not all(map(is_number, span)) or not span[0] < span[1]:
        return None
    low, high = float(span[0]), float(span[1])
    if not (isfinite(low) and isfinite(high)) or (logarithmic and low <= 0.0):
        return None
    # a count too large for memory is refused by `study.check_study`; its values are not made here
    listed = (
        spread((low, high), count, logarithmic=logarithmic) if type(count) is int and 0 < count <= 10**6 else ()
    )
    return Axis(key, listed, (low, high), logarithmic, ties, unit)


def overlap_faults(
    key: str, where: KeyPath, axis: str, device: Device | None, taken: SetNumbers, kind: str = "axis"
) -> Iterator[TableFault]:
    """Faults of a key that another axis or tie sets too, as a whole or in part, or that excludes such a key. A
    path without a device, and one that the device has not, is passed over.

    key    of the axis itself, or of a number tied to it
    axis   key of the axis that sets it
    where  key path of the key, for messages
    taken  what axes before this one set; the key is added
    kind   what messages call an axis
    """
    # of a circumstance no path of the file: an axis `operator` chooses an operator, and others may change its
    # numbers
    steps: KeyPath = ("", key)
    if key not in CIRCUMSTANCES:
        if device is None:
            return
        try:
            steps = address.resolve(device.document, key)
        except DeviceError:
            return  # `key_faults` and `_tie_faults` report it
    for other, (shown, setter) in taken.items():
        by = f"is set by the {kind} '{setter}'" if shown == setter else f"goes with the {kind} '{setter}'"
        if other == steps:
            yield (where, f"'{key}' {by} already; remove one of the two")
        elif steps[: len(other)] == other or other[: len(steps)] == steps:
            yield (where, f"'{key}' overlaps '{shown}', which {by} already; remove one of the two")
        elif _exclude_each_other(steps, other):
            yield (where, f"'{key}' excludes '{shown}', which {by} already; remove one of them")
    taken.setdefault(steps, (key, axis))


def _exclude_each_other(one: KeyPath, other: KeyPath) -> bool:
    """Whether two key paths belong to one table and exclude each other, being of different groups of
    `address.EXCLUSIVE`."""
    if one[:-1] != other[:-1]:
        return False
    groups = address.EXCLUSIVE.get(tuple(map(str, one[:-1])), ())
    groups_of_one, groups_of_other = ([group for group in groups if key in group] for key in (one[-1], other[-1]))
    return bool(groups_of_one and groups_of_other) and groups_of_one != groups_of_other


def key_faults(
    document: dict[str, Any], key: str, values: list[tuple[KeyPath, Any]], *, whole_ranges: bool = False
) -> Iterator[TableFault]:
    """Faults of a key that no device file has or that is not a single number or text, or of values of a kind that
    the schema does not allow there.

    document      of the device
    values        each with its key path in the axis's table
    whole_ranges  whether a number that is whole may have a range
    """
    try:
        steps = address.resolve(document, key)
        now = address.get(document, key) if address.exists(document, key) else None
    except DeviceError as error:
        near = nearest(key, CIRCUMSTANCES)
        hint = f" (or is it '{near}', a circumstance?)" if near else ""
        yield (("key",), f"'{key}' {error.faults[0].message}{hint}")
        return
    kinds = {kind.get("type") for kind in schema.subschemas(steps)} - {"null", "array", "object"}
    if isinstance(now, dict | list) or not kinds:
        inside = [path for path in address.numeric_addresses(document) if path.startswith(dotted(steps, document))]
        hint = (
            f"; the numbers in it are {', '.join(inside[:6])}{', ...' if len(inside) > 6 else ''}"
            if inside
            else ""
        )
        yield (("key",), f"'{key}' is not a single number{hint}")
        return
    if isinstance(now, int | float) and not isinstance(now, bool):
        kinds &= {*NUMBER}  # a text does not take the place of a number
    spanned = any(where[0] == "range" for where, _ in values)
    if spanned and not kinds & {*NUMBER}:
        yield (("range",), f"cannot be used: '{key}' takes text; write values = [...] with the texts")
    elif spanned and "number" not in kinds and not whole_ranges:
        yield (("range",), f"cannot be used: '{key}' takes whole numbers; write values = [1, 2, 3]")
    else:
        texts = _allowed_texts(steps)
        yield from (
            ((*where,), message)
            for where, value in _without_wrong_range_ends(values)
            if (message := _value_fault(value, kinds, key, texts))
        )


def _allowed_texts(steps: KeyPath) -> list[str]:
    """The texts that the schema allows at a path; [] where any text is allowed."""
    kinds = [kind for kind in schema.subschemas(steps) if kind.get("type") == "string"]
    return (
        list(dict.fromkeys(str(kind.get("const")) for kind in kinds)) if all("const" in k for k in kinds) else []
    )


def _value_fault(value: Any, kinds: set[Any], key: str, texts: list[str]) -> str:
    """Message: what is wrong with a value of an axis; "" for nothing.

    kinds  JSON types that the schema allows at the key;   texts  texts that it allows, [] for any
    """
    if isinstance(value, bool):
        fits, wanted = "boolean" in kinds, "no true or false"
    elif isinstance(value, str):
        fits, wanted = "string" in kinds, "a number"
        if fits and texts and value not in texts:
            return f"must be one of {', '.join(texts)} for '{key}', got {quote(value)}"
    elif isinstance(value, int):
        fits, wanted = bool(kinds & {*NUMBER}), "text"
    elif isinstance(value, float):
        fits, wanted = "number" in kinds, "a whole number" if "integer" in kinds else "text"
        if fits and isnan(value):
            fits, wanted = False, "a number"
    else:
        fits, wanted = False, "a number"
    return "" if fits else f"must be {wanted} for '{key}', got {quote(value)}"


def ties_of(
    table: dict[str, Any],
    key: str,
    device: Device,
    taken: SetNumbers,
    faults_of_axes: TableFaults,
    kind: str = "axis",
) -> Iterator[Tie]:
    """The ties without a fault, and a matrix element's tie to its mirror image; faults go to `faults_of_axes`.

    table  of the axis
    key    the number that the axis varies
    taken  what axes so far set; what the ties set is added
    kind   what messages call an axis
    """
    document, given = device.document, table.get("tie")
    for n, tied in enumerate(given if isinstance(given, list) else []):
        tie: dict[str, Any] = {"key": tied} if isinstance(tied, str) else tied if isinstance(tied, dict) else {}
        to, factor, power = tie.get("key"), tie.get("factor"), tie.get("power")
        if not isinstance(to, str) or not to:
            continue  # `study_schema` reports it
        faults = list(_tie_faults(document, key, to, factor, power, table))
        faults += [] if faults else list(overlap_faults(to, (), key, device, taken, kind))
        faults_of_axes += [(("tie", n, *path), message) for path, message in faults]
        if faults:
            continue
        if power is None:
            yield Tie(to, 1.0 if factor is None else float(factor))
        else:
            yield Tie(to, 1.0, float(power), address.get(document, to), float(address.get(document, key)))
    # an element of a symmetric matrix has no value of its own
    mirror = mirrored(document, key)
    if mirror is not None and address.resolve(document, mirror) not in taken:
        taken[address.resolve(document, mirror)] = mirror, key
        yield Tie(mirror)


def mirrored(document: dict[str, Any], key: str) -> str | None:
    """Path of an element's mirror image in a symmetric matrix; None for the diagonal, and for what stands in none.

    >>> mirrored({"plant": {"mass_kg": [[1.0, 0.0], [0.0, 1.0]]}}, "plant.mass_kg.0.1")
    'plant.mass_kg.1.0'
    """
    image = schema.mirror_image(address.resolve(document, key))
    return None if image is None else dotted(image, document)


def _tie_faults(
    document: dict[str, Any], key: str, to: str, factor: Any, power: Any, table: dict[str, Any]
) -> Iterator[TableFault]:
    """Faults of a tie of the number at `to` to the axis at `key`.

    document       of the device
    factor, power  of the tie; None: not given;   table  of the axis
    """
    try:
        address.resolve(document, to)
        value_in_file = address.get(document, to) if address.exists(document, to) else None
    except DeviceError as error:
        yield ((), f"'{to}' {error.faults[0].message}")
        return
    if factor is not None and power is not None:
        yield (("factor",), "and power exclude each other; remove one of them")
    elif power is None:
        # one value of the axis shows whether their kind is allowed at `to`; "key": no range, and only the message
        # is used, with the tie's number in it
        values: list[tuple[KeyPath, Any]] = [(("key",), value) for _, value in _values_with_paths(table)[:1]]
        yield from (
            ((), message.replace(f"'{key}'", f"'{to}'")) for _, message in key_faults(document, to, values)
        )
        if factor is not None and any(isinstance(value, str) for _, value in _values_with_paths(table)):
            yield (("factor",), "cannot multiply texts, and the values of this axis are texts; remove it")
    else:
        base = address.get(document, key) if address.exists(document, key) else None
        if not _all_numbers(value_in_file):
            yield (
                (),
                f"'{to}' has no value in the device file, which power needs; use factor, or set it first",
            )
        if not is_number(base) or base == 0:
            given = f"got {quote(base)}" if base is not None else "and it has none; set it first"
            yield (("power",), f"needs a value of '{key}' other than 0 in the device file, {given}")
        elif not all(
            is_number(value) and value / base > 0
            for _, value in _without_wrong_range_ends(_values_with_paths(table))
        ):
            yield (("power",), f"needs values of the sign that '{key}' has in the device file, {quote(base)}")


def _all_numbers(value: Any) -> bool:
    """Whether a value is a number, or nested lists of numbers, none empty."""
    return bool(value) and all(map(_all_numbers, value)) if isinstance(value, list) else is_number(value)


def _circumstance_faults(key: str, table: dict[str, Any], device: Device | None) -> Iterator[TableFault]:
    """Faults of the values of a circumstance, such as a position or an assembly, for this device."""
    if key in WANTED:
        number = WANTED_BY_KEY[key]
        for where, value in _without_wrong_range_ends(_values_with_paths(table)):
            if not is_number(value) or not number.allows(value):
                yield (where, f"must be a finite number, {number.allowed}, got {quote(value)}")
        return
    if "range" in table:
        yield (("range",), f"cannot be used: {key} is not a number; write values = [...]")
    for where, value in _values_with_paths(table):
        if where[0] == "values" and (message := circumstance_fault(key, value, device)):
            yield (where, message)


def circumstance_fault(key: str, value: Any, device: Device | None) -> str:
    """Message: what is wrong with a value of at, direction, assembly, model or operator for a device; "" for
    nothing. An operator's name is not looked up here.

    device  None: only what holds for all devices is checked
    """
    if key in ("at", "direction"):
        if not isinstance(value, list | tuple) or not all(map(is_number, value)):
            return f"must be 2 or 3 numbers, got {quote(value)}"
    elif not isinstance(value, str) or not value:
        return f"must be text, got {quote(value)}"
    checks: dict[str, Callable[[Device], Any]] = {
        "at": lambda known: known.position(value),
        "direction": lambda known: known.direction(value),
        "assembly": lambda known: _check_assembly(known, value),
    }
    if key == "model" and value not in MODELS:
        return f"must be one of {', '.join(MODELS)}, got {quote(value)}"
    if device is None or key not in checks:
        return ""
    try:
        checks[key](device)
    except DeviceError as error:
        return error.faults[0].message
    return ""


def _check_assembly(device: Device, name: str) -> None:
    """Raise DeviceError where a device has no assembly of this name."""
    if device.mechanism is None:
        device.at(assembly=name)  # raises the fault that a [plant] has no assemblies
    elif name not in device.mechanism.assemblies:
        near = suggestion(name, set(device.mechanism.assemblies), "there are")
        raise fail(device.label, "assembly", f"'{name}' is not an assembly of this device; {near}")
