"""Which columns of a record belong to which drive, and what makes of them the coordinates that the model has."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, fail
from zwidth.identify.records.columns import Columns
from zwidth.identify.records.record import Piece, Record
from zwidth.model.mechanism import PRISMATIC, Mechanism
from zwidth.model.mechanism_arrays import pack

Side = Literal["joint", "motor"]

COLUMNS: Final = Columns(
    needed=("time_s", ("angle_rad.*", "position_m.*"), ("torque_Nm.*", "force_N.*")),
    optional=("velocity_rad_per_s.*", "velocity_m_per_s.*"),
)
TURNING: Final = ("angle_rad", "torque_Nm", "velocity_rad_per_s")
SLIDING: Final = ("position_m", "force_N", "velocity_m_per_s")


@dataclass(frozen=True)
class Channels:
    """The columns of one record, drive by drive, d drives.

    coordinate, force  (d,) names of columns;   velocity  (d,) names, "" where there is none
    to_drive    (d, d)  the drives' coordinates per column of coordinates: 1, or 1 over the ratio of motors, or the
                        coupling of drives that turn with several joints
    to_force    (d, d)  generalised forces of the drives' coordinates per column of forces
    """

    coordinate: tuple[str, ...]
    force: tuple[str, ...]
    velocity: tuple[str, ...]
    to_drive: Floats
    to_force: Floats

    def coordinates(self, piece: Piece) -> Floats:
        """The drives' coordinates (n, d) of a piece of the record [rad], [m]."""
        return np.stack([piece[name] for name in self.coordinate], axis=1) @ self.to_drive.T

    def forces(self, piece: Piece) -> Floats:
        """Generalised forces (n, d) [N m], [N]."""
        return np.stack([piece[name] for name in self.force], axis=1) @ self.to_force.T


def channels_of(device: Device, record: Record, side: Side) -> Channels:
    """The columns of a record of this device, each named by the link of its joint, or by its drive.

    side   "joint": coordinates of the links' joints, torques at the joints; "motor": the motors' angles and
           torques
    Raises DeviceError  for columns that are missing or given twice
    """
    mechanism = device.mechanism
    assert mechanism is not None
    drives, links, rows = mechanism.drives, mechanism.links, list[list[str]]()
    for name, joint in zip(drives.names, drives.joint, strict=True):
        slides = side == "joint" and links.joint[joint] == PRISMATIC
        words = (name, links.names[joint])
        rows.append(
            [
                _column(record, quantity, words, alone=len(drives.names) == 1, needed=k < 2)
                for k, quantity in enumerate(SLIDING if slides else TURNING)
            ]
        )
    coordinate, force, velocity = zip(*rows, strict=True)
    n = np.asarray(drives.transmission, dtype=np.float64)
    to_drive, to_force = np.diag(1.0 / n), np.diag(n)
    if side == "joint":
        to_drive = pack(mechanism).to_drive[0]
        to_force = np.linalg.inv(to_drive).T
    return Channels(coordinate, force, velocity, to_drive, to_force)


def _column(record: Record, quantity: str, words: Sequence[str], *, alone: bool, needed: bool) -> str:
    """The column of a quantity of the drive that goes by these words; "" where there is none, and none is needed.

    Only letters and figures count, since MATLAB's names have no others.
    """
    wanted = {_plain(f"{quantity}.{word}") for word in words} | ({quantity} if alone else set())
    present = [name for name in record.names if _plain(name) in wanted]
    if len(present) > 1:
        raise record.fault(f"columns {' and '.join(present)} are of the same drive; keep one of them")
    if present or not needed:
        return present[0] if present else ""
    there = [name for name in record.names if name.startswith(quantity)]
    raise record.fault(
        f"column {quantity}.{words[1]} (or {quantity}.{words[0]}, by the drive's name) is missing"
        f"{f'; of this quantity there are {comma_list(there)}' if there else ''}"
    )


def _plain(name: str) -> str:
    return re.sub(r"[^0-9a-zA-Z]", "_", name)


def check_mechanism(device: Device) -> Mechanism:
    """The mechanism of a device whose arm can be identified, its links rigid. Raises DeviceError for what the
    inverse dynamics leave out."""
    from dataclasses import replace

    mechanism = device.mechanism
    if mechanism is None:
        text = "needs a [mechanism]: joint torques say nothing of a plant's matrices; use 'identify mass'"
        raise fail(device.label, "identify arm", text)
    present = {
        "more drives than degrees of freedom": bool(mechanism.drives.surplus),
        "joints that nobody drives or measures (free)": bool(mechanism.free),
        "rotors that turn with their links (motor_link)": mechanism.drives.motor_link is not None,
        "a transmission whose ratio changes (ratio_table)": mechanism.drives.ratio_tables is not None,
    }
    if named := [name for name, there in present.items() if there]:
        text = f"is not made for a mechanism with {' and '.join(named)}"
        raise fail(device.label, "identify arm", text)
    if mechanism.gravity_compensation == "counterweight":
        text = 'is not made for gravity_compensation = "counterweight": what balances the links moves with them'
        raise fail(device.label, "identify arm", text)
    return replace(mechanism, flexible=())


def left_out(device: Device) -> list[str]:
    """Parts of the device's file that the inverse dynamics leave out, in words."""
    mechanism = device.mechanism
    assert mechanism is not None
    links, driven = mechanism.links, set(mechanism.drives.joint.tolist())
    undriven = [i for i in range(len(links.names)) if i not in driven]

    def any_of(numbers: Floats | None, some: Sequence[int]) -> bool:
        return numbers is not None and bool(np.any(np.asarray(numbers)[..., some]))

    parts: Mapping[str, Any] = {
        "springs of the joints": any_of(links.joint_stiffness, range(len(links.names))),
        "dampers of joints without a drive": any_of(links.joint_damping, undriven),
        "dry friction of joints without a drive": any_of(links.joint_coulomb, undriven),
        "the bending of links": bool(mechanism.flexible),
    }
    return [name for name, there in parts.items() if there]
