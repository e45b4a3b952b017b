"""Transmissions whose ratio changes with the joint: what their table, their joint and other keys must agree on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath, plural
from zwidth.device.toml_access import is_number, table, tables

# Joint of a drive -> the key of the table's coordinates, the key of the link's limits, the unit.
OF_JOINT: Final = {"revolute": ("joint_rad", "limits_rad", "rad"), "prismatic": ("joint_m", "limits_m", "m")}
KEYS: Final = {"joint_rad", "joint_m", "ratio"}
FULL_TURN: Final = 2.0 * math.pi * (1.0 + 1e-9)

KeyMessages = Iterator[tuple[KeyPath, str]]


def ratio_inconsistencies(mechanism: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement about a ratio table, in a mechanism with its legs spread."""
    links = {link["name"]: link for _, link in tables(mechanism, "links") if isinstance(link.get("name"), str)}
    for index, drive in tables(mechanism, "drives"):
        if "ratio_table" not in drive:
            continue
        place: KeyPath = ("mechanism", "drives", index, "ratio_table")
        if "transmission_ratio" in drive:
            yield place, "stands beside transmission_ratio; only one of the two is allowed: remove the other"
        if table(drive, "coupling"):
            yield (
                place,
                "cannot be had together with coupling: a motor that turns with several joints needs a constant "
                "ratio; give transmission_ratio, or remove coupling",
            )
        joint = drive.get("joint")
        link = links.get(joint) if isinstance(joint, str) else None
        if isinstance(drive["ratio_table"], dict) and link is not None and link.get("joint") in OF_JOINT:
            yield from _table(place, drive["ratio_table"], link)


def _table(place: KeyPath, given: dict[str, Any], link: dict[str, Any]) -> KeyMessages:
    """Coordinates of the joint's kind, a ratio at each of them, no limits of the joint beyond them."""
    joint = link["joint"]
    key, limits_key, unit = OF_JOINT[joint]  # no names in the sentences: the copies of a leg have the same fault
    for other, *_ in OF_JOINT.values():
        if other != key and other in given:
            yield (*place, other), f"is not for the joint of this drive, which is {joint}; give {key}"
            return
    if key not in given:
        if given.keys() <= KEYS:  # or else one of them is misspelt
            yield (*place, key), "is missing; give the coordinates of the drive's joint at which the ratios are"
        return
    coordinates, ratios = given[key], given.get("ratio")
    if not isinstance(coordinates, list) or not isinstance(ratios, list):
        return
    if len(coordinates) != len(ratios):
        yield (
            (*place, "ratio"),
            f"has {plural(len(ratios), 'number')}, but {key} has {len(coordinates)}; give a ratio at each of them",
        )
    if len(coordinates) < 2 or not all(map(is_number, coordinates)):
        return
    low, high = coordinates[0], coordinates[-1]
    if unit == "rad" and high - low > FULL_TURN:
        yield (
            (*place, key),
            f"goes from {low:.10g} to {high:.10g} rad, more than a full turn; a turn more or less is the same "
            "posture: give one turn, 6.2831853 rad, or less",
        )
    limits = link.get(limits_key)
    if not (isinstance(limits, list) and len(limits) == 2 and all(map(is_number, limits)) and low < high):
        return
    if limits[0] < low or limits[1] > high:
        yield (
            (*place, key),
            f"goes from {low:.10g} to {high:.10g} {unit}, but {limits_key} of the joint are [{limits[0]:.10g}, "
            f"{limits[1]:.10g}]; extend the table over them, or narrow the limits",
        )


def largest_ratio(drive: dict[str, Any]) -> Any:
    """The ratio of a drive in a file, of a table its largest; None where it gives none, or what is no number."""
    ratios = table(drive, "ratio_table").get("ratio")
    if isinstance(ratios, list):
        return max(filter(is_number, ratios), default=None)
    return drive.get("transmission_ratio")
