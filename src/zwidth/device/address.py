"""Dotted paths to the values of a device file: `mechanism.links.upper.length_m`, `plant.mass_kg.0.1`.

A step is a key of a table, the name of a list's element, or else its index (from 0). A path whose first step
is no key of the file is looked up inside [mechanism]: `links.upper.length_m`. Keys that the file leaves out
can be set where the schema has them.

Numbers written into a device file, its comments and the order of its lines kept.

Looking into a plain document, whatever stands in it.

Legs written once, spread into the copies that a mechanism has of them. The same rules serve the plain tables of a
file, whose names are checked against each other, and its checked sections, of which the mechanism is built: names
that the leg gives itself end in the copy's number, other names stay.
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeGuard

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import SETTINGS, Fault, KeyPath, comma_list, dotted, fail, nearest, quote
from zwidth.device.read import device_text, within_depth
from zwidth.device.schema import device_file as schema
from zwidth.device.schema.value_types import Section
from zwidth.errors import DeviceError

UNSET: Final = object()

FILTERS: Final = (frozenset({"time_constant_s"}), frozenset({"order", "cutoff_Hz", "discretisation"}))
RATIO: Final = (frozenset({"transmission_ratio"}), frozenset({"ratio_table"}))
EXCLUSIVE: Final[dict[tuple[str, ...], tuple[frozenset[str], ...]]] = {
    ("loop",): (frozenset({"delay_s"}), frozenset({"delay_samples"})),
    ("loop", "velocity", "filter"): FILTERS,
    ("loop", "force", "filter"): FILTERS,
    ("loop", "force_sensor", "filter"): FILTERS,
    ("loop", "feedforward"): (frozenset({"inertia_kg"}), frozenset({"inertia_share"})),
    ("loop", "feedforward", "acceleration_filter"): FILTERS,
    ("loop", "feedforward", "velocity", "filter"): FILTERS,
    ("loop", "local", "velocity", "filter"): FILTERS,
    ("operator",): (frozenset({"grasp"}), frozenset({"grasp_stiffness_N_per_m", "grasp_damping_Ns_per_m"})),
    ("load",): (frozenset({"force_N"}), frozenset({"push_N"}), frozenset({"moment_Nm"})),
    ("mechanism", "damping"): (
        frozenset({"mode_ratio"}),
        frozenset({"mass_coefficient_1_per_s", "stiffness_coefficient_s"}),
        frozenset({"given"}),
    ),
    ("mechanism", "drives", "*"): RATIO,
    ("mechanism", "legs", "*", "drives", "*"): RATIO,
}
"""Table, with * for list elements -> groups of keys of which one may be used: setting a key drops those of the
other groups."""


def get(document: dict[str, Any], path: str) -> Any:
    """The value at a path. Raises DeviceError, naming the nearest right path, if there is none."""
    steps = resolve(document, path)
    value = _value(document, steps)
    if value is UNSET:
        raise fail(SETTINGS, path, "is not given in this file, although it may be; give it a value first")
    return value


def exists(document: dict[str, Any], path: str) -> bool:
    """Whether a path, with * for any step, leads to something in the document."""
    places = [document]
    for part in _split(document, path):
        places = [inner for outer in places for inner in _children(outer, part)]
    return bool(places)


def in_schema(path: str) -> bool:
    """Whether a path of keys, with * for list elements, leads to a key the schema has, given or not."""
    steps: KeyPath = ()
    for part in path.split("."):
        # what is no key of a table must be * for the elements of a list, of which the first stands for all
        steps = (*steps, part) if schema.subschemas((*steps, part)) else (*steps, 0)
        if not schema.subschemas(steps) or (steps[-1] == 0 and part != "*"):
            return False
    return True


def assign(document: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    """A copy of the document with one value set (`UNSET`: removed), and without the keys that exclude it.

    Where a table may be of several kinds, as a filter, its `type` becomes the kind that has this key, if keys of
    another kind went or it had no type; a velocity that gets another `method` keeps the keys that this reads.

    Raises DeviceError  if the schema has no such path, or a list no such element
    """
    return assign_all(document, [(path, value)])


def assign_all(document: dict[str, Any], settings: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """A copy of the document with several values set in turn, each as by `assign`.

    >>> assign_all({"loop": {"delay_s": 0.1}}, [("loop.sampling_period_s", 0.01), ("loop.delay_samples", 2.0)])
    {'loop': {'sampling_period_s': 0.01, 'delay_samples': 2.0}}
    """
    document = deep_copy(document)
    for path, value in settings:
        _set_in_place(document, path, value)
    return document


def _set_in_place(document: dict[str, Any], path: str, value: Any) -> None:
    """Set the value at a path of the document, in place; `UNSET` removes it. Missing outer tables are made; keys
    that exclude the new one, or that a new method does not read, are removed; a type that the key tells is set."""
    *outer, last = resolve(document, path)
    table: Any = document
    for step in outer:
        if isinstance(table, dict) and step not in table:
            if value is UNSET:
                return
            table[step] = {}
        table = table[step]
    if value is UNSET:
        if isinstance(table, list):
            table.pop(int(last))
        else:
            table.pop(last, None)
        return
    table[last] = value
    tag, kinds = schema.kinds(tuple(outer))
    if tag == last == "method" and value in kinds:
        for key in schema.keys(tuple(outer)) - kinds[value]:
            table.pop(key, None)
    dropped = [key for key in rivals((*outer, last)) if table.pop(key, UNSET) is not UNSET]
    holders = [kind for kind, keys in kinds.items() if last in keys]
    # the table may now be of another kind, as a filter is that gets the other filter's key, or a new one
    if dropped or (tag == "type" and tag not in table and len(holders) == 1):
        table.update((tag, kind) for kind in holders)


def unset(document: dict[str, Any], path: str) -> dict[str, Any]:
    """A copy of the document without the value at a path; removing what is not there changes nothing."""
    return assign(document, path, UNSET)


def apply(document: dict[str, Any], settings: Sequence[str | tuple[str, Any]]) -> dict[str, Any]:
    """The document with all settings applied in turn; what they amount to is checked afterwards.

    settings  "PATH=VALUE" texts or (path, value) pairs; a text value is read as TOML or else taken as it is,
              and the bare word unset removes the key
    Raises DeviceError  with a fault for every setting that leads nowhere
    """
    faults: list[Fault] = []
    for setting in settings:
        try:
            path, value = parse(setting)
            document = assign(document, path, value)
        except DeviceError as error:
            faults += error.faults
    if faults:
        raise DeviceError(faults)
    return document


def parse(setting: str | tuple[str, Any]) -> tuple[str, Any]:
    """Path and value of one setting; `UNSET` for the bare word unset."""
    if isinstance(setting, str):
        path, equals, text = setting.partition("=")
        if not equals or not path.strip():
            raise fail(SETTINGS, "", f"must be PATH=VALUE, got {quote(setting)}; such as loop.delay_samples=1")
        return path.strip(), _toml_value(text.strip(), path.strip())
    path, value = setting
    return path, _toml_value(value, path) if isinstance(value, str) else value


def rivals(steps: KeyPath) -> list[str]:
    """The keys of the same table that setting a key drops.

    >>> rivals(("loop", "delay_s"))
    ['delay_samples']
    """
    groups = EXCLUSIVE.get(tuple("*" if isinstance(step, int) else step for step in steps[:-1]), ())
    if not any(steps[-1] in group for group in groups):
        return []
    return [rival for group in groups if steps[-1] not in group for rival in sorted(group)]


def number_paths(document: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, float]]:
    """Path and value of every number in the document, in its order; `dotted` writes a path as users do."""
    if isinstance(document, dict):
        for key, inner in document.items():
            yield from number_paths(inner, (*path, key))
    elif isinstance(document, list):
        for index, inner in enumerate(document):
            yield from number_paths(inner, (*path, index))
    elif isinstance(document, int | float) and not isinstance(document, bool):
        yield path, document


def numeric_addresses(document: dict[str, Any]) -> dict[str, float]:
    """Dotted path -> value of every number in the document: what sweeps and sensitivities can vary."""
    return {dotted(path, document): value for path, value in number_paths(document)}


def resolve(document: dict[str, Any], path: str) -> KeyPath:
    """The steps of a dotted path as keys and indices, whether or not the last ones are given in the file.

    Raises DeviceError  if neither the document nor the schema knows the path
    """
    parts = _split(document, path)
    steps: list[str | int] = []
    value: Any = document
    for depth, part in enumerate(parts):
        index = _element_index(value, part) if isinstance(value, list) else None
        if isinstance(value, dict) and (
            part in value or part in schema.keys(tuple(steps)) or _takes_any_key(steps)
        ):
            step: str | int = part
        elif index is not None:
            step = index
        else:
            raise _unknown_path_error(document, path, steps, parts, depth, value)
        steps.append(step)
        value = _value(value, (step,))
        if value is UNSET:
            value = {}
        elif depth + 1 < len(parts) and not isinstance(value, dict | list):
            raise fail(
                SETTINGS, path, f"{dotted(tuple(steps), document)} holds {quote(value)}, nothing is inside it"
            )
    return tuple(steps)


def _split(document: dict[str, Any], path: str) -> list[str]:
    """The path's steps, with `mechanism` before them where the first is no key of the file."""
    parts = path.split(".")
    if parts[0] not in schema.keys(()) and "mechanism" in document:
        return ["mechanism", *parts]
    return parts


def _unknown_path_error(
    document: dict[str, Any], path: str, steps: list[str | int], parts: list[str], depth: int, place: Any
) -> DeviceError:
    """The error for a path that leads nowhere, with a hint of the nearest key.

    steps   keys and indices that the first steps of the path stand for;   place  what they lead to
    parts   the steps of the path, of which number `depth` is no key of `place`
    """
    first, *rest = path.split(".")
    if steps in ([], ["mechanism"]) and parts[depth:] == [first, *rest]:
        return fail(SETTINGS, path, f"is not a key of a device file; {_hint_from_the_top(document, first, rest)}")
    here, choices = dotted(tuple(steps), document), _keys_or_elements(place, tuple(steps))
    near = nearest(parts[depth], choices)
    if near:
        right = ".".join([here, near, *parts[depth + 1 :]])
        return fail(SETTINGS, path, f"is not a key of a device file; did you mean '{right}'?")
    return fail(
        SETTINGS, path, f"is not a key of a device file; {here} has: {comma_list(choices) or 'nothing inside'}"
    )


def _hint_from_the_top(document: dict[str, Any], first: str, rest: list[str]) -> str:
    """A hint for a path whose first step is nowhere, with those behind it, `rest`: the nearest key of the file, of
    [mechanism], or of another section."""
    inside = schema.keys(("mechanism",)) if "mechanism" in document else set()
    near = nearest(first, schema.keys(()) | inside)
    if near:
        right = [near] if near in schema.keys(()) else ["mechanism", near]
        return f"did you mean '{'.'.join([*right, *rest])}'?"
    for section in ("loop", "plant", "mechanism", "operator", "load", "friction"):
        near = nearest(first, schema.keys((section,))) if section in document else None
        if near:
            return f"did you mean '{'.'.join([section, near, *rest])}'?"
    return f"a device file has: {comma_list(sorted(schema.keys(())))}"


def _keys_or_elements(place: Any, steps: KeyPath) -> list[str]:
    """The keys that a table, `place`, has or may have, sorted; of a list the names or numbers of its elements."""
    if isinstance(place, list):
        names = [element.get("name") if isinstance(element, dict) else None for element in place]
        return [name if isinstance(name, str) else str(index) for index, name in enumerate(names)]
    return sorted({*schema.keys(steps), *(place if isinstance(place, dict) else ())})


def _takes_any_key(steps: list[str | int]) -> bool:
    """Whether the table at a path takes keys of any name, as [mechanism.assemblies] does."""
    return any(
        isinstance(subschema.get("additionalProperties"), dict) for subschema in schema.subschemas(tuple(steps))
    )


def _element_index(elements: list[Any], part: str) -> int | None:
    """Index of the list's element of that name or else of that number, None if there is none."""
    for index, element in enumerate(elements):
        if isinstance(element, dict) and element.get("name") == part:
            return index
    if part.isascii() and part.isdigit() and len(part) < 10 and int(part) < len(elements):
        return int(part)
    return None


def _value(place: Any, steps: KeyPath) -> Any:
    """The value that keys and indices lead to from `place`; `UNSET` where a key is missing."""
    for step in steps:
        if isinstance(place, dict) and step not in place:
            return UNSET
        place = place[step]
    return place


def _children(place: Any, part: str) -> list[Any]:
    """The values at one step of a path below `place`, all of them for `*`; [] where there is none."""
    if part == "*":
        return list(place.values()) if isinstance(place, dict) else list(place) if isinstance(place, list) else []
    if isinstance(place, dict):
        return [place[part]] if part in place else []
    index = _element_index(place, part) if isinstance(place, list) else None
    return [] if index is None else [place[index]]


def _toml_value(text: str, path: str) -> Any:
    """The text as a TOML value, `UNSET` for the bare word unset, else the text itself. Raises DeviceError."""
    if text == "unset":
        return UNSET
    try:
        document = tomllib.loads(f"value = {text}")
    except RecursionError:
        raise fail(SETTINGS, path, "is nested too deeply") from None
    except ValueError:
        return text
    value = document["value"]
    if len(document) > 1:
        return text  # of several lines that read as keys
    if not within_depth([value]):
        raise fail(SETTINGS, path, "is nested too deeply")
    return value


def edited_text(
    path: str | os.PathLike[str],
    settings: Mapping[str, Any] | Sequence[str | tuple[str, Any]],
    sources: Mapping[str, str] | None = None,
) -> str:
    """The text of a device file with numbers set as `Device.with_` sets them; what it does not change stands as it
    is written.

    path      of the file, or a bundled name
    settings  path -> value, or pairs of them and texts "PATH=VALUE" as typed; `address.UNSET` removes a key
    sources   path -> where its number comes from, which is noted under [sources]
    Raises    DeviceError  for a file that cannot be read, or paths that lead nowhere
    """
    import tomlkit

    label = os.fspath(path)
    text = device_text(label)
    try:
        document = tomlkit.parse(text)
    except ValueError as error:
        raise fail(label, "", f"is no TOML: {error}") from None
    before = document.unwrap()
    after = apply(before, list(settings.items() if isinstance(settings, Mapping) else settings))
    _carry_over(document, before, after)
    if sources:
        noted = document.setdefault("sources", tomlkit.table())
        for path_of_number, source in sources.items():
            noted[dotted(resolve(after, path_of_number), after)] = source
    return tomlkit.dumps(document)


def _carry_over(place: Any, before: Any, after: Any) -> None:
    """Change in a parsed TOML file, or a table or list of it, what differs between plain copies of it before and
    after a change; what does not keeps its comments.

    place  the parsed one, changed in place;   before, after  the copies: tables both, or lists of one length
    """
    if isinstance(after, dict):
        for key in [key for key in before if key not in after]:
            del place[key]
        for key, value in after.items():
            if key not in before:
                place[key] = value
            elif value != before[key]:
                if isinstance(value, dict | list) and _same_shape(value, before[key]):
                    _carry_over(place[key], before[key], value)
                else:
                    place[key] = value
        return
    for index, value in enumerate(after):
        if value != before[index]:
            if isinstance(value, dict | list) and _same_shape(value, before[index]):
                _carry_over(place[index], before[index], value)
            else:
                place[index] = value


def _same_shape(value: Any, other: Any) -> bool:
    """Whether two values are tables both, or lists of one length, so that their inner values can be compared one
    by one."""
    if isinstance(value, dict):
        return isinstance(other, dict)
    return isinstance(other, list) and len(value) == len(other)


def table(document: dict[str, Any], key: str) -> dict[str, Any]:
    """The table under a key; empty where there is none."""
    value = document.get(key)
    return value if isinstance(value, dict) else {}


def tables(document: dict[str, Any], key: str) -> list[tuple[int, dict[str, Any]]]:
    """The tables in the list under a key, each with its index."""
    value = document.get(key)
    return [
        (i, entry) for i, entry in enumerate(value if isinstance(value, list) else []) if isinstance(entry, dict)
    ]


def is_number(value: Any) -> TypeGuard[float]:
    """Whether the value is a number that a float can hold (TOML's whole numbers have no end)."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return isinstance(value, float) or abs(value) < 10**300


def row_count(value: Any) -> int | None:
    """How many rows a matrix has, 1 for a single number; None for anything else."""
    if is_number(value):
        return 1
    return len(value) if isinstance(value, list) and value else None


def deep_copy(value: Any) -> Any:
    """A copy of tables and lists to any depth, in a fifth of the time that `copy.deepcopy` takes; what else stands
    in them cannot be changed in place."""
    if isinstance(value, dict):
        return {key: deep_copy(inner) for key, inner in value.items()}
    return [deep_copy(inner) for inner in value] if isinstance(value, list) else value


GROUPS: Final = ("links", "loops", "drives")


@dataclass(frozen=True)
class LegMember:
    """A link, loop or drive of a mechanism, of a leg's copy or not.

    entry     its table or section, with the names of the copy
    path      where it is written, under [mechanism]
    angle     by which shared frames are turned for the copy [rad]; axis  about what; 0 outside of legs
    own       the names that the leg gives its links; empty outside of legs
    """

    entry: Any
    path: KeyPath
    angle: float = 0.0
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    own: frozenset[str] = frozenset()

    def turn_of(self, name: str) -> Floats:
        """Rotation (3, 3) of what the copy gives in the frame of a link of this name; the unit matrix for its own
        links."""
        if not self.angle or name in self.own:
            return np.eye(3)
        from zwidth.model.rotations import rotation_matrix  # names are compared without it, in no time

        axis = np.array(self.axis, dtype=np.float64)
        return rotation_matrix(self.angle * axis / np.linalg.norm(axis))


def members(mechanism: Any, group: str) -> list[LegMember]:
    """All links, loops or drives of a mechanism in the order of its coordinates: first those written by
    themselves, then leg by leg and copy by copy.

    mechanism  a file's table (what is faulty is left out), or its checked section
    group      "links", "loops" or "drives"
    """
    found = [LegMember(entry, (group, i)) for i, entry in _members_written(mechanism, group)]
    for number, leg in _members_written(mechanism, "legs"):
        given = (_field(link, "name") for _, link in _members_written(leg, "links"))
        names = frozenset(name for name in given if isinstance(name, str))
        for copy, angle in enumerate(_copy_angles(leg), start=1):
            own_names = frozenset(copied(name, copy) for name in names)
            for i, entry in _members_written(leg, group):
                renamed = _as_copy(entry, group, names, copy)
                axis = _field(leg, "axis") or (0.0, 0.0, 1.0)
                found.append(LegMember(renamed, ("legs", number, group, i), angle, axis, own_names))
    return found


def written(mechanism: dict[str, Any], group: str) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Path under [mechanism] and table of each link, loop or drive of a file, those of a leg once."""
    for i, entry in tables(mechanism, group):
        yield (group, i), entry
    for number, leg in tables(mechanism, "legs"):
        for i, entry in tables(leg, group):
            yield ("legs", number, group, i), entry


def copied(name: str, copy: int) -> str:
    """The name of a leg's link, loop or drive in one of its copies, counted from 1."""
    return f"{name}-{copy}"


def of_copies(mechanism: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by link name, with those given for a leg's link under the names of all its copies too; what is given
    for one copy comes before what is given for all."""
    spread = dict(values)
    for _, leg in _members_written(mechanism, "legs"):
        for _, link in _members_written(leg, "links"):
            name = _field(link, "name")
            if not isinstance(name, str) or name not in values:
                continue
            spread.pop(name, None)
            for copy in range(1, len(_copy_angles(leg)) + 1):
                spread.setdefault(copied(name, copy), values[name])
    return spread


def spread_tables(mechanism: dict[str, Any]) -> tuple[dict[str, Any], dict[str, list[KeyPath]]]:
    """A file's [mechanism] with all copies of its legs written out.

    Returns the table without legs; and "links", "loops", "drives" -> the path under [mechanism] where each entry
    of the list is written
    """
    flat, paths = {key: value for key, value in mechanism.items() if key != "legs"}, {}
    for group in GROUPS:
        all_members = members(mechanism, group)
        if group in mechanism or all_members:
            flat[group] = [member.entry for member in all_members]
        paths[group] = [member.path for member in all_members]
    for name, assembly in table(mechanism, "assemblies").items():
        if isinstance(assembly, dict):
            given = {
                key: of_copies(mechanism, value) if isinstance(value, dict) else value
                for key, value in assembly.items()
            }
            flat["assemblies"] = {**flat["assemblies"], name: given}
    return flat, paths


def written_path(path: KeyPath, paths: Mapping[str, Sequence[KeyPath]]) -> KeyPath:
    """Path in the file of what is at a path of the mechanism whose legs are written out as copies; `paths` as
    `spread_tables` returns them."""
    if len(path) > 2 and path[0] == "mechanism" and path[1] in GROUPS and isinstance(path[2], int):
        return ("mechanism", *paths[str(path[1])][path[2]], *path[3:])
    return path


def _copy_angles(leg: Any) -> list[float]:
    """Angle by which each copy of a leg is turned [rad]; a faulty leg counts as one copy."""
    angles, count = _field(leg, "angles_rad"), _field(leg, "count")
    if isinstance(angles, list | tuple) and all(map(is_number, angles)):
        return list(angles)
    # a count that is larger is a fault, which others report
    if isinstance(count, int) and 0 < count < 100:
        return [2.0 * math.pi * k / count for k in range(count)]
    return [0.0]


def _as_copy(entry: Any, group: str, names: frozenset[str], copy: int) -> Any:
    """A link, loop or drive of a leg as one of its copies has it, with the copy's names.

    names  that the leg gives its links;   copy  number of the copy, from 1
    """

    def name_in_copy(name: Any) -> Any:
        """A link's name as the copy has it; names that are not the leg's own stay."""
        return copied(name, copy) if isinstance(name, str) and name in names else name

    changes: dict[str, Any] = {}
    if isinstance(_field(entry, "name"), str):
        changes["name"] = copied(_field(entry, "name"), copy)
    if group == "links" and _field(entry, "parent") is not None:
        changes["parent"] = name_in_copy(_field(entry, "parent"))
    elif group == "loops" and isinstance(_field(entry, "links"), list | tuple):
        changes["links"] = type(_field(entry, "links"))(name_in_copy(name) for name in _field(entry, "links"))
    elif group == "drives" and _field(entry, "joint") is not None:
        changes["joint"] = name_in_copy(_field(entry, "joint"))
        if _field(entry, "motor_link") is not None:
            changes["motor_link"] = name_in_copy(_field(entry, "motor_link"))
        if isinstance(_field(entry, "coupling"), dict):
            changes["coupling"] = {name_in_copy(name): ratio for name, ratio in _field(entry, "coupling").items()}
    if isinstance(entry, Section):
        return entry.model_copy(update=changes)
    return {**entry, **changes}


def _members_written(owner: Any, group: str) -> Iterator[tuple[int, Any]]:
    """Index and entry of each link, loop, drive or leg of a mechanism or leg, as checked or as a table of a
    file."""
    if isinstance(owner, Section):
        return enumerate(getattr(owner, group))
    return iter(tables(owner, group))


def _field(entry: Any, key: str) -> Any:
    """The value of a checked section, or of a table of a file, None where this has none."""
    return getattr(entry, key) if isinstance(entry, Section) else entry.get(key)
