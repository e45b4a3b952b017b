"""Numbers that a device file leaves out because nobody knows them, and which answers need them.

A file may describe a mechanism's geometry alone, as a paper or a driver's source code does: then kinematic
questions have answers, and the others name what they need. What is known of some links only is not a device but a
mistake.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath, dotted
from zwidth.device.legs import members
from zwidth.device.toml_access import table

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
            without = [member.path for member in entries if key not in member.entry]
            if 0 < len(without) < len(entries):
                yield from (("mechanism", *path, key) for path in dict.fromkeys(without))


def _left_out(mechanism: dict[str, Any]) -> Iterator[KeyPath]:
    for group, keys in (("links", LINKS), ("drives", DRIVES)):
        for member in members(mechanism, group):
            yield from (("mechanism", *member.path, key) for key in keys if key not in member.entry)
