"""The joint whose friction is identified: where it is read, what drives it, and its numbers in the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, nan, pi
from typing import Any, Final

import numpy as np

from zwidth.device.address import LegMember, members, table
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, dotted, fail, suggestion
from zwidth.errors import DeviceError
from zwidth.identify.records.record import Columns, Record
from zwidth.model.plant import Plant

COLUMNS: Final = Columns(
    ("time_s", ("position_m", "angle_rad")),
    optional=("force_N", "torque_Nm", "current_A", "force_command_N", "torque_command_Nm"),
)
LINEAR: Final = {"mass": "kg", "damping": "N s/m", "force": "N", "stiffness": "N/m", "position": "m"}
ANGULAR: Final = {
    "mass": "kg m^2",
    "damping": "N m s/rad",
    "force": "N m",
    "stiffness": "N m/rad",
    "position": "rad",
}


@dataclass(frozen=True)
class Joint:
    """A coordinate that is read and driven by itself.

    place       in words, for remarks: "at the shaft of motor 'capstan'"
    angular     whether it is an angle [rad] under a torque [N m], or a way [m] under a force [N]
    per_ampere  force or torque at the joint per current [N/A or N m/A]; nan where not known
    step        of its encoder [m or rad]; nan where not known
    limit       largest force or torque that its drive gives; inf where there is none
    lower, upper  ends of its travel; infinite where there are none
    mass        or inertia that the file says is moved [kg or kg m²]; nan where it says none
    paths       quantity -> path in the device file, and factor from the number at the joint to the one there
    remarks     sentences about what the numbers mean
    """

    place: str
    angular: bool
    per_ampere: float = nan
    step: float = nan
    limit: float = inf
    lower: float = -inf
    upper: float = inf
    mass: float = nan
    paths: dict[str, tuple[str, float]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    @property
    def position(self) -> str:
        """Column of the position."""
        return "angle_rad" if self.angular else "position_m"

    @property
    def measured(self) -> str:
        """Column of a measured force or torque."""
        return "torque_Nm" if self.angular else "force_N"

    @property
    def command(self) -> str:
        """Column of a commanded force or torque."""
        return "torque_command_Nm" if self.angular else "force_command_N"

    @property
    def mass_name(self) -> str:
        """Name, for people, of what resists acceleration."""
        return "effective inertia" if self.angular else "effective mass"

    def unit(self, quantity: str) -> str:
        """Unit in words of "mass", "damping", "force", "stiffness" or "position"."""
        return (ANGULAR if self.angular else LINEAR)[quantity]

    def force_column(self, record: Record) -> tuple[str, float]:
        """The column of a record that says what drives the joint, and its factor; "" where nothing does.

        Raises DeviceError  for columns that are not this joint's, and a current whose torque is not known
        """
        other = "position_m" if self.angular else "angle_rad"
        if self.position not in record:
            wanted = "turns: name its column angle_rad" if self.angular else "moves along a line: use position_m"
            raise record.fault(f"is not read {self.place}, which {wanted}", column=other)
        foreign = ("force_N", "force_command_N") if self.angular else ("torque_Nm", "torque_command_Nm")
        for name in foreign:
            if name in record:
                raise record.fault(
                    f"cannot drive what is read {self.place}; give {self.measured} there", column=name
                )
        if self.measured in record:
            return self.measured, 1.0
        if "current_A" in record:
            if not np.isfinite(self.per_ampere):
                raise record.fault(
                    f"says no torque: torque_constant_Nm_per_A {self.place} is not in the device file; set it, or "
                    f"give {self.measured}",
                    column="current_A",
                )
            return "current_A", self.per_ampere
        return (self.command, 1.0) if self.command in record else ("", 1.0)


def joint_of(device: Device, name: str | int | None = None) -> Joint:
    """The joint of a device by the name of its drive (read at the motor) or of its link (read at the joint).

    name     of a drive or a link; the number of a plant's coordinate; None for a device of one drive or coordinate
    Raises   DeviceError  where there is no such joint, or several and no name
    """
    given = None if name is None else str(name)
    if device.mechanism is None:
        return _joint_of_plant(device, given)
    tables = table(device.document, "mechanism")
    drives = {one.entry["name"]: (i, one) for i, one in enumerate(members(tables, "drives"))}
    links = {one.entry["name"]: one for one in members(tables, "links")}
    if given is None:
        if len(drives) != 1:
            raise fail(device.label, "joint", f"must be named: one of {comma_list([*drives, *links])}")
        given = next(iter(drives))
    if given in drives:
        return _joint_at_motor(device, *drives[given], links)
    if given in links:
        return _joint_at_link(device, links[given], drives)
    raise fail(device.label, "joint", f"'{given}' is no drive or link; {suggestion(given, [*drives, *links])}")


def _joint_of_plant(device: Device, name: str | None) -> Joint:
    """The joint that is a coordinate of a plant given by its matrices, `name` its number; of a measured response
    one without keys.

    Raises  DeviceError  where the number is missing or no coordinate's
    """
    plant = device.given_plant
    if plant is None:
        remark = "the device is a measured response, whose file has no key for friction or mass"
        return Joint("at the device's encoder", False, remarks=(remark,))
    n = len(plant.sensor)
    if name is None and n > 1:
        raise fail(
            device.label, "joint", f"must be the number of the coordinate that was moved, from 0 to {n - 1}"
        )
    if name is not None and not (name.isdigit() and int(name) < n):
        raise fail(device.label, "joint", f"must be a coordinate from 0 to {n - 1}, got '{name}'")
    i = int(name or 0)
    document, label = device.document, f"along coordinate {i}"
    encoder = table(table(document, "loop"), "encoder").get("resolution_m")
    limit = table(table(document, "loop"), "saturation").get("force_N", inf)
    step = float(encoder) if encoder else nan
    if n == 1:
        return _joint_of_single_coordinate(plant, document, step, float(limit))
    levels = table(document, "friction").get("coulomb_N")
    path = {"coulomb": (f"friction.coulomb_N.{i}", 1.0)} if isinstance(levels, list) else {}
    remark = (
        f"the mass is that of everything that moves with coordinate {i}, and the friction all that resists there: "
        "the file has no key for the former, and has the latter by coordinate"
    )
    return Joint(f"{label} of the plant", False, step=step, limit=float(limit), paths=path, remarks=(remark,))


def _joint_of_single_coordinate(plant: Plant, document: dict[str, Any], step: float, limit: float) -> Joint:
    """Give the joint of a plant of one coordinate: its mass at the encoder [kg], and the paths of its numbers.

    document     of the device file;   step, limit  of the encoder [m]; largest force [N]
    """
    # the file's numbers are those of the coordinate q: position s q at the encoder, force a f on the coordinate;
    # those at the encoder are these over s a
    s, a = float(plant.sensor[0]), float(plant.actuator[0])
    numbers = table(document, "plant")
    ends = {  # of the path, where the file has a matrix
        key: ".0.0" * isinstance(numbers.get(key), list)
        for key in ("mass_kg", "damping_Ns_per_m", "stiffness_N_per_m")
    }
    friction = ".0" * isinstance(table(document, "friction").get("coulomb_N"), list)
    paths = {
        "mass": (f"plant.mass_kg{ends['mass_kg']}", s * a),
        "damping": (f"plant.damping_Ns_per_m{ends['damping_Ns_per_m']}", s * a),
        "stiffness": (f"plant.stiffness_N_per_m{ends['stiffness_N_per_m']}", s * a),
        "coulomb": (f"friction.coulomb_N{friction}", abs(a)),
    }
    return Joint(
        "at the device's encoder",
        False,
        step=step,
        limit=limit,
        mass=float(plant.mass[0, 0]) / (s * a),
        paths=paths,
    )


def _path_in_file(member: LegMember, key: str, document: dict[str, Any]) -> str:
    """Path of a key of a link or drive in the device file: "mechanism.drives.shoulder.coulomb_Nm"."""
    return dotted(("mechanism", *member.path, key), document)


def _link_paths(link: LegMember, document: dict[str, Any], ratio: float) -> dict[str, tuple[str, float]]:
    """`Joint.paths` of a joint's own damper and spring.

    ratio  of the transmission where the numbers are at the motor: those at the joint are its square times as
           large; 1 where they are at the joint
    """
    along = link.entry.get("joint") == "prismatic"
    damping, stiffness = ("Ns_per_m", "N_per_m") if along else ("Nms_per_rad", "Nm_per_rad")
    return {
        "damping": (_path_in_file(link, f"joint_damping_{damping}", document), ratio**2),
        "stiffness": (_path_in_file(link, f"joint_stiffness_{stiffness}", document), ratio**2),
    }


def _joint_at_motor(device: Device, index: int, drive: LegMember, links: dict[str, LegMember]) -> Joint:
    """The joint read at the shaft of a drive's motor, with its numbers there; the drive's index, links by name."""
    assert device.mechanism is not None
    drives, entry = device.mechanism.drives, drive.entry
    name, link = entry["name"], links[entry["joint"]]
    ratio = float(np.asarray(drives.transmission)[..., index])
    counts = float(np.asarray(drives.encoder_counts)[..., index])
    paths = {"coulomb": (_path_in_file(drive, "coulomb_Nm", device.document), 1.0)}
    remarks = [
        f"all numbers are those at the shaft of motor '{name}': angle and torque of the motor, not of the joint"
    ]
    if np.isfinite(ratio):
        paths |= _link_paths(link, device.document, ratio)
        remarks.append(
            f"viscous friction is written to joint '{link.entry['name']}', {ratio:.6g}^2 times that at the motor, "
            "for the file has no key for it at the motor"
        )
    if any(key in link.entry for key in ("joint_coulomb_Nm", "joint_coulomb_N")):
        remarks.append(
            f"what was identified includes the dry friction of joint '{link.entry['name']}'; remove it there"
        )
    return Joint(
        f"at the shaft of motor '{name}'",
        True,
        per_ampere=float(np.asarray(drives.torque_constant)[..., index]),
        step=2.0 * pi / counts if counts > 0.0 else nan,
        limit=float(np.asarray(drives.torque_limit)[..., index]),
        mass=_inertia_at_motor(device, index),
        paths=paths,
        remarks=tuple(remarks),
    )


def _joint_at_link(device: Device, link: LegMember, drives: dict[str, tuple[int, LegMember]]) -> Joint:
    """The joint read at a link itself, with the numbers of the motor that turns it (`drives` by name, with
    their index) reflected there. Raises DeviceError for a joint that neither turns nor slides."""
    entry, document = link.entry, device.document
    name, kind = entry["name"], entry.get("joint")
    if kind not in ("revolute", "prismatic"):
        raise fail(
            device.label, "joint", f"'{name}' is {kind}; friction is identified of a revolute or prismatic one"
        )
    angular = kind == "revolute"
    lower, upper = entry.get("limits_rad" if angular else "limits_m", (-inf, inf))
    coulomb = "joint_coulomb_Nm" if angular else "joint_coulomb_N"
    paths = {"coulomb": (_path_in_file(link, coulomb, document), 1.0)}
    paths |= _link_paths(link, document, 1.0)
    numbers: dict[str, float] = {}
    remarks = [f"all numbers are those of joint '{name}' itself, rotor and links reflected there"]
    for index, drive in drives.values():
        if drive.entry["joint"] != name:
            continue
        assert device.mechanism is not None
        of = device.mechanism.drives
        ratio = float(np.asarray(of.transmission)[..., index])
        counts = float(np.asarray(of.encoder_counts)[..., index])
        numbers = {
            "per_ampere": ratio * float(np.asarray(of.torque_constant)[..., index]),
            "step": 2.0 * pi / counts / ratio if counts > 0.0 else nan,
            "limit": ratio * float(np.asarray(of.torque_limit)[..., index]),
            "mass": ratio**2 * _inertia_at_motor(device, index),
        }
        numbers = {key: value for key, value in numbers.items() if value == value}  # without nan
        if drive.entry.get("coulomb_Nm"):
            remarks.append(
                f"what was identified includes coulomb_Nm of motor '{drive.entry['name']}'; remove it there"
            )
    return Joint(
        f"at joint '{name}'",
        angular,
        lower=float(lower),
        upper=float(upper),
        paths=paths,
        remarks=tuple(remarks),
        **numbers,
    )


def _inertia_at_motor(device: Device, index: int) -> float:
    """Inertia at the shaft of a motor by the file, all other drives standing [kg m²]; nan where it gives none,
    where the reference is no posture, and of a surplus drive."""
    from zwidth.errors import PostureError

    assert device.mechanism is not None
    if "dynamics" in device.missing:
        return nan
    try:
        posture = device.at().posture
    except (DeviceError, PostureError):
        return nan
    drives = device.mechanism.drives
    kept = [i for i in range(len(drives.names)) if i not in drives.surplus]
    ratio = float(np.asarray(drives.transmission)[..., index])
    if posture is None or index not in kept:
        return nan
    place = kept.index(index)  # row of the drive in the mass matrix, which has no surplus drives
    rotor = float(np.asarray(drives.motor_inertia)[..., index])
    return rotor + float(posture.mass_matrix[place, place]) / ratio**2
