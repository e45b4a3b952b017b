"""Legs written once, spread into the copies that a mechanism has of them.

The same rules serve the plain tables of a file, whose names are checked against each other, and its checked
sections, of which the mechanism is built: names that the leg gives itself end in the copy's number, other names
stay.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.address import is_number, table, tables
from zwidth.device.faults import KeyPath
from zwidth.device.schema.value_types import Section

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
        """Rotation (3, 3) of what the copy gives in a link's frame; none for a link of the copy itself."""
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
    found = [LegMember(entry, (group, i)) for i, entry in _entries(mechanism, group)]
    for n, leg in _entries(mechanism, "legs"):
        given = (_get(link, "name") for _, link in _entries(leg, "links"))
        names = frozenset(name for name in given if isinstance(name, str))
        for copy, angle in enumerate(_angles(leg), start=1):
            own = frozenset(copied(name, copy) for name in names)
            for i, entry in _entries(leg, group):
                renamed = _renamed(entry, group, names, copy)
                axis = _get(leg, "axis") or (0.0, 0.0, 1.0)
                found.append(LegMember(renamed, ("legs", n, group, i), angle, axis, own))
    return found


def written(mechanism: dict[str, Any], group: str) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Path under [mechanism] and table of each link, loop or drive of a file, those of a leg once."""
    for i, entry in tables(mechanism, group):
        yield (group, i), entry
    for n, leg in tables(mechanism, "legs"):
        for i, entry in tables(leg, group):
            yield ("legs", n, group, i), entry


def copied(name: str, copy: int) -> str:
    """The name of a leg's link, loop or drive in one of its copies, counted from 1."""
    return f"{name}-{copy}"


def of_copies(mechanism: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by link name, with those given for a leg's link under the names of all its copies too; what is given
    for one copy comes before what is given for all."""
    spread = dict(values)
    for _, leg in _entries(mechanism, "legs"):
        for _, link in _entries(leg, "links"):
            name = _get(link, "name")
            if not isinstance(name, str) or name not in values:
                continue
            spread.pop(name, None)
            for copy in range(1, len(_angles(leg)) + 1):
                spread.setdefault(copied(name, copy), values[name])
    return spread


def spread_tables(mechanism: dict[str, Any]) -> tuple[dict[str, Any], dict[str, list[KeyPath]]]:
    """A file's [mechanism] without legs: all copies written out; and where each link, loop and drive is
    written."""
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
    """Path in the file of what is at a path of the mechanism whose legs are written out as copies."""
    if len(path) > 2 and path[0] == "mechanism" and path[1] in GROUPS and isinstance(path[2], int):
        return ("mechanism", *paths[str(path[1])][path[2]], *path[3:])
    return path


def _angles(leg: Any) -> list[float]:
    """Angle by which each copy of a leg is turned [rad]; a faulty leg counts as one copy."""
    angles, count = _get(leg, "angles_rad"), _get(leg, "count")
    if isinstance(angles, list | tuple) and all(map(is_number, angles)):
        return list(angles)
    if isinstance(count, int) and 0 < count < 100:
        return [2.0 * math.pi * k / count for k in range(count)]
    return [0.0]


def _renamed(entry: Any, group: str, names: frozenset[str], copy: int) -> Any:
    """A link, loop or drive of a leg as one of its copies has it."""

    def own(name: Any) -> Any:
        return copied(name, copy) if isinstance(name, str) and name in names else name

    changes: dict[str, Any] = {}
    if isinstance(_get(entry, "name"), str):
        changes["name"] = copied(_get(entry, "name"), copy)
    if group == "links" and _get(entry, "parent") is not None:
        changes["parent"] = own(_get(entry, "parent"))
    elif group == "loops" and isinstance(_get(entry, "links"), list | tuple):
        changes["links"] = type(_get(entry, "links"))(own(name) for name in _get(entry, "links"))
    elif group == "drives" and _get(entry, "joint") is not None:
        changes["joint"] = own(_get(entry, "joint"))
        if _get(entry, "motor_link") is not None:
            changes["motor_link"] = own(_get(entry, "motor_link"))
        if isinstance(_get(entry, "coupling"), dict):
            changes["coupling"] = {own(name): ratio for name, ratio in _get(entry, "coupling").items()}
    if isinstance(entry, Section):
        return entry.model_copy(update=changes)
    return {**entry, **changes}


def _entries(owner: Any, group: str) -> Iterator[tuple[int, Any]]:
    """Index and entry of each link, loop or drive of a mechanism or leg, as checked or as a table of a file."""
    if isinstance(owner, Section):
        return enumerate(getattr(owner, group))
    return iter(tables(owner, group))


def _get(entry: Any, key: str) -> Any:
    return getattr(entry, key) if isinstance(entry, Section) else entry.get(key)
