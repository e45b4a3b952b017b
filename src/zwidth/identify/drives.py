"""The drive of a mechanism that a measurement is of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from zwidth.device.device import Device
from zwidth.device.faults import comma_list, dotted, fail, quote, suggestion
from zwidth.device.legs import members, written


@dataclass(frozen=True)
class Drive:
    """One drive as the device file has it.

    name   of the drive
    joint  link whose joint it drives
    path   of its table in the file
    table  its keys and values
    """

    name: str
    joint: str
    path: str
    table: Mapping[str, Any]


def drives_of(device: Device) -> list[Drive]:
    """The drives of a device in the order of the file, those of legs once each. Raises DeviceError for a device
    without a mechanism."""
    if device.mechanism is None:
        raise fail(device.label, "mechanism", "is missing: this is identified of a mechanism's drives")
    return [
        Drive(entry["name"], entry["joint"], dotted(("mechanism", *path), device.document), entry)
        for path, entry in written(device.document["mechanism"], "drives")
    ]


def drive_named(device: Device, name: str | None) -> Drive:
    """The drive of this name, or on the joint of this link; of a leg also as one of its copies (arm-1); or counted
    from 1 in the order of the file.

    name    None: the only one
    Raises  DeviceError  where there is none such, or several and none is named
    """
    drives = drives_of(device)
    listed = comma_list([drive.name for drive in drives])
    if not drives:
        raise fail(device.label, "mechanism.drives", "holds no drive")
    if name is None:
        if len(drives) > 1:
            raise fail(device.label, "joint", f"is not named, and the device has several drives: {listed}")
        return drives[0]
    for drive in drives:
        if name in (drive.name, drive.joint):
            return drive
    for copy in members(device.document["mechanism"], "drives"):
        if name in (copy.entry["name"], copy.entry["joint"]):
            path = dotted(("mechanism", *copy.path), device.document)
            return next(drive for drive in drives if drive.path == path)
    if name.isdigit() and 1 <= int(name) <= len(drives):
        return drives[int(name) - 1]
    known = {word for drive in drives for word in (drive.name, drive.joint)}
    raise fail(device.label, "joint", f"{quote(name)} is no drive or joint; {suggestion(name, known, 'drives')}")
