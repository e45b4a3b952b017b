"""Numbers that a device file leaves out because nobody knows them, and which answers need them.

A file may describe a mechanism's geometry alone, as a paper or a driver's source code does: then kinematic
questions have answers, and the others name what they need. What is known of some links only is not a device but a
mistake.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from zwidth.device.address import table
from zwidth.device.faults import KeyPath, comma_list, dotted
from zwidth.device.legs import members, written

LINKS: Final = ("mass_kg", "inertia_kg_m2")
DRIVES: Final = ("motor_inertia_kg_m2", "transmission_ratio")
PERIOD: Final[KeyPath] = ("loop", "sampling_period_s")


def missing_numbers(document: dict[str, Any]) -> dict[str, tuple[str, ...]]:
    """Dotted keys that a valid document leaves out, by what cannot be computed without them: "dynamics",
    "sampling".

    >>> missing_numbers({"mechanism": {"links": [{"name": "arm", "inertia_kg_m2": 1e-3}]}, "loop": {}})
    {'dynamics': ('mechanism.links.arm.mass_kg',), 'sampling': ('loop.sampling_period_s',)}
    """
    if "mechanism" not in document:
        return {}
    dynamics = [dotted(path, document) for path in _left_out(document["mechanism"])]
    sampling = [] if "sampling_period_s" in table(document, "loop") else [dotted(PERIOD)]
    found = {"dynamics": tuple(dict.fromkeys(dynamics)), "sampling": tuple(sampling)}
    return {kind: keys for kind, keys in found.items() if keys}


def partly_missing(mechanism: dict[str, Any]) -> Iterator[KeyPath]:
    """Keys that some links or drives of a file have and others lack: those that lack them."""
    for group, keys in (("links", LINKS), ("drives", DRIVES)):
        entries = members(mechanism, group)
        for key in keys:
            # a beam's mass without its inertia is a fault of its own
            without = [
                member.path for member in entries if not _gives(member.entry, key) and "beam" not in member.entry
            ]
            if 0 < len(without) < len(entries):
                yield from (("mechanism", *path, key) for path in dict.fromkeys(without))


def _left_out(mechanism: dict[str, Any]) -> Iterator[KeyPath]:
    for group, keys in (("links", LINKS), ("drives", DRIVES)):
        for member in members(mechanism, group):
            yield from (("mechanism", *member.path, key) for key in keys if not _gives(member.entry, key))


def _gives(entry: dict[str, Any], key: str) -> bool:
    """Whether a link or drive has the number of a key; a ratio also as a table, a mass also as that of a beam."""
    if key in LINKS and "beam" in entry and not any(own in entry for own in LINKS):
        return True
    return key in entry or (key == "transmission_ratio" and "ratio_table" in entry)


@dataclass(frozen=True)
class Unknown:
    """A number that some drives or links of a device lack, or the computer.

    group       dotted path, with * for all of them;   paths  of each that lacks it
    needed_for  what cannot be answered, or how it is answered without, as a clause
    count       how many of the group there are
    """

    group: str
    paths: tuple[str, ...]
    needed_for: str
    count: int = 1

    @property
    def names(self) -> str:
        """Which of several lack it: "all", or their names."""
        names = [path.split(".")[-2] for path in self.paths]
        return "all" if len(names) == self.count else comma_list(names, 6)


# Key of the links, drives or computer -> what it is needed for, or what is taken instead.
NEEDED_FOR: Final = {
    "mass_kg": "needed for masses felt, frequencies, charts and simulations",
    "inertia_kg_m2": "needed for masses felt, frequencies, charts and simulations",
    "motor_inertia_kg_m2": "needed for masses felt, frequencies, charts and simulations",
    "transmission_ratio": "needed for masses felt, frequencies, charts and simulations",
    "sampling_period_s": "needed for charts, checks of walls and simulations",
    "stiffness_Nm_per_rad": "taken as rigid: flexible modes and the walls that they limit need it",
    "encoder_counts_per_rev": "needed for encoder steps: limit cycles, noise and their simulation",
    "torque_limit_Nm": "taken as unlimited: the largest force needs it",
}
USEFUL: Final = ("stiffness_Nm_per_rad", "encoder_counts_per_rev", "torque_limit_Nm")


def unknown_numbers(document: dict[str, Any]) -> list[Unknown]:
    """What a valid document leaves out as not known, and what for it is needed; [] for a device without
    [mechanism]."""
    mechanism = table(document, "mechanism")
    if not mechanism:
        return []
    found = []
    for group, keys in (("links", LINKS), ("drives", (*DRIVES, *USEFUL))):
        entries = [*written(mechanism, group)]
        for key in keys:
            paths = [("mechanism", *path, key) for path, entry in entries if not _gives(entry, key)]
            if paths:
                named = tuple(dotted(path, document) for path in paths)
                found.append(Unknown(f"mechanism.{group}.*.{key}", named, NEEDED_FOR[key], len(entries)))
    if "sampling_period_s" not in table(document, "loop"):
        found.append(Unknown(dotted(PERIOD), (dotted(PERIOD),), NEEDED_FOR["sampling_period_s"]))
    return found
