"""Numbers of a device file as what a sensitivity is by: their units, and which have a derivative."""

from __future__ import annotations

import re
from functools import cache
from math import isfinite

from zwidth.device.faults import KeyPath
from zwidth.device.schema import device_file as schema


def number_obstacle(steps: KeyPath, value: float) -> str:
    """Why a number has no derivative whatever the device; "" if it may have one."""
    if not isfinite(value):
        return "it is infinite, and one per cent of it is no change"
    whole = any(subschema.get("type") == "integer" for subschema in schema.subschemas(steps))
    return "it is a whole number, which has no derivative" if whole else ""


@cache
def number_unit(steps: KeyPath) -> str:
    """The unit that the schema states for the number, or for the list that it stands in."""
    while steps:
        if match := re.search(r" \[([^\]]*)\]$", schema.key_description(steps)):
            return match[1]
        if isinstance(steps[-1], str):
            return ""
        steps = steps[:-1]
    return ""
