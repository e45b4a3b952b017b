"""What the keys of [load] must agree on, with each other and with the device."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import Any, Final

from zwidth.device.faults import KeyPath
from zwidth.device.toml_access import is_number, table

KeyMessages = Iterator[tuple[KeyPath, str]]

FORCES: Final = ("force_N", "push_N", "moment_Nm")


def load_inconsistencies(document: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement."""
    if "load" not in document:
        return
    load = table(document, "load")
    if "mechanism" not in document:
        yield ("load",), "needs a [mechanism], whose forces turn as it moves; leave it out"
    given = [key for key in FORCES if load.get(key) is not None]
    if len(given) > 1:
        yield ("load", given[1]), f"stands beside {given[0]}; only one of them is allowed: remove one"
    for key in given:
        if not _is_zero(load[key]):
            continue
        yield (
            ("load", key),
            "is 0, which leaves a one-sided wall at the edge of contact, where nothing is linear; remove it for "
            "the chart of the two-sided wall, or give the force with which the hand leans on the wall",
        )
    if load.get("settle") is True and "force_N" not in load:
        yield ("load", "settle"), "needs force_N, under which the device slides to where it is in balance"
    radius = load.get("surface_radius_m")
    if is_number(radius) and radius in (0, -inf):
        yield ("load", "surface_radius_m"), f"must not be {radius:g}; remove it for a plane"
    elif load.get("settle") is True and is_number(radius) and radius != inf:
        yield (
            ("load", "surface_radius_m"),
            "stands beside settle, which slides the handle along a plane; remove one of the two",
        )


def _is_zero(force: Any) -> bool:
    """Whether a number is 0, or all of a list are."""
    numbers = force if isinstance(force, list) and force else [force]
    return all(is_number(number) and number == 0 for number in numbers)
