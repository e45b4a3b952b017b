"""Numbers of a device file as what a sensitivity is by: which have a derivative."""

from __future__ import annotations

from math import isfinite

from zwidth.device.faults import KeyPath
from zwidth.device.schema import device_file as schema


def number_obstacle(steps: KeyPath, value: float) -> str:
    """Why a number has no derivative whatever the device; "" if it may have one."""
    if not isfinite(value):
        return "it is infinite, and one per cent of it is no change"
    whole = any(subschema.get("type") == "integer" for subschema in schema.subschemas(steps))
    return "it is a whole number, which has no derivative" if whole else ""
