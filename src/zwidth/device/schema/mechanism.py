"""[mechanism]: links, loops, drives, handle, and the posture everything is referred to."""

from __future__ import annotations

from typing import Literal

from zwidth.device.schema.friction import DriveFrictionSection
from zwidth.device.schema.numbers import (
    Axis,
    Bounds,
    Counts,
    Damper,
    Direction,
    DryFriction,
    Hardening,
    Inductance,
    Inertia,
    Mass,
    Name,
    Number,
    NumberOrInfinity,
    Offset,
    Position,
    Ratio,
    Resistance,
    RotorInertia,
    Section,
    Spring,
    Step,
    Stiffness,
    Torque,
    Triple,
    quantity,
)


class LinkSection(Section):
    """A rigid link and the joint that carries it."""

    name: Name = quantity("the link's name: letters, digits, - and _")
    parent: Name = quantity('the link that carries it, or "base"', default="base")
    joint: Literal["revolute", "fixed"] = quantity('how it moves against its parent: "revolute" or "fixed"')
    axis: Axis = quantity("joint axis in the link's own frame, any length", "1", default=(0.0, 0.0, 1.0))
    origin_m: Triple | None = quantity(
        "joint origin in the parent's frame; omitted: the parent's tip (of the base: its origin)",
        "m",
        default=None,
    )
    orientation_rad: Triple = quantity(
        "roll, pitch, yaw of the link's axes in the parent's frame at joint angle 0: turned about the "
        "parent's x, then y, then z axis",
        "rad",
        default=(0.0, 0.0, 0.0),
    )
    length_m: Number = quantity(
        "length along the link's x axis; its tip is at (length, 0, 0)", "m", ge=0, default=0.0
    )
    mass_kg: Mass = quantity("mass; 0 for a massless link", "kg", ge=0)
    center_of_mass_m: Offset = quantity(
        "centre of mass in the link's frame, x or x, y or x, y, z", "m", default=(0.0, 0.0, 0.0)
    )
    inertia_kg_m2: Inertia = quantity(
        "moments of inertia about the centre of mass, link axes: one number (about the joint axis; enough "
        "for planar motion), three moments [Ixx, Iyy, Izz], or a 3 x 3 matrix",
        "kg m^2",
    )


class LoopClosure(Section):
    """A closed loop: a point of one link stays on a point of another."""

    name: Name = quantity("the loop's name: letters, digits, - and _")
    links: tuple[Name, ...] = quantity('the two links that meet, or a link and "base"', min_length=2, max_length=2)
    points_m: tuple[Triple, ...] | None = quantity(
        "the meeting point in the frame of each of the two; omitted: their tips (of the base: its origin)",
        "m",
        min_length=2,
        max_length=2,
        default=None,
    )


class HandleSection(Section):
    """Where the operator holds the device."""

    link: Name = quantity("the link that carries the handle")
    point_m: Triple | None = quantity("the handle in that link's frame; omitted: its tip", "m", default=None)


class AssemblySection(Section):
    """One way of assembling the mechanism at the reference posture."""

    joints_rad: dict[str, Number] = quantity(
        "approximate angle of every revolute joint, by link name, at the reference position", "rad"
    )


class ReferenceSection(Section):
    """The posture and the direction that are meant where none is given."""

    position_m: Position = quantity("position of the handle, x, y or x, y, z", "m")
    direction: Direction = quantity("rendered direction, any length", "1")
    assembly: Name | None = quantity("the assembly that is meant; omitted only where one is named", default=None)


class WorkspaceSection(Section):
    """Bounds of the handle's position, for maps."""

    x_m: Bounds | None = quantity("lower and upper bound of x", "m", default=None)
    y_m: Bounds | None = quantity("lower and upper bound of y", "m", default=None)
    z_m: Bounds | None = quantity("lower and upper bound of z", "m", default=None)


class DriveSection(Section):
    """A motor and its transmission, on one revolute joint."""

    name: Name = quantity("the drive's name: letters, digits, - and _")
    joint: Name = quantity("the link whose joint it drives")
    motor_inertia_kg_m2: RotorInertia = quantity("inertia of the rotor, at the motor", "kg m^2", ge=0)
    transmission_ratio: Ratio = quantity("motor turns per joint turn", "1", gt=0)
    stiffness_Nm_per_rad: Spring | None = quantity(
        "stiffness of the transmission at the motor shaft; omitted or inf: rigid",
        "N m/rad",
        gt=0,
        default=None,
    )
    damping_Nms_per_rad: Damper | None = quantity(
        "damping parallel to that stiffness, at the motor shaft; with mechanism.damping.given = true",
        "N m s/rad",
        ge=0,
        default=None,
    )
    torque_constant_Nm_per_A: Number | None = quantity(
        "torque constant of the motor; omitted: not known", "N m/A", gt=0, default=None
    )
    winding_resistance_ohm: Resistance | None = quantity(
        "resistance of the motor's winding; with damping_resistance_ohm", "ohm", gt=0, default=None
    )
    winding_inductance_H: Inductance | None = quantity(
        "inductance of the motor's winding; with damping_resistance_ohm; omitted: none", "H", ge=0, default=None
    )
    damping_resistance_ohm: Resistance | None = quantity(
        "resistor through which the winding is closed, so that the motor brakes by its own induction; 0: shorted; "
        "omitted: the winding is open or on a current amplifier, and there is no electrical damping",
        "ohm",
        ge=0,
        default=None,
    )
    torque_limit_Nm: NumberOrInfinity | None = quantity(
        "largest torque at the motor; omitted or inf: no limit", "N m", gt=0, default=None
    )
    continuous_torque_Nm: Torque | None = quantity(
        "torque at the motor that it bears without end, its winding no hotter than allowed; omitted: not known",
        "N m",
        gt=0,
        default=None,
    )
    encoder_counts_per_rev: Counts | None = quantity(
        "encoder counts per motor revolution, after quadrature; omitted: not known", "1", default=None
    )
    encoder_noise_rad: Step | None = quantity(
        "standard deviation of the motor's angle before it is counted; omitted: 0", "rad", default=None
    )
    coulomb_Nm: DryFriction | None = quantity("dry friction at the motor; omitted: none", "N m", default=None)
    breakaway_Nm: DryFriction | None = quantity(
        'its static level, at least coulomb_Nm; with mechanism.friction.model = "lugre"; omitted: coulomb_Nm',
        "N m",
        default=None,
    )
    hardening_Nm_per_rad3: Hardening | None = quantity(
        "k_3 of the transmission's torque k d + k_3 d^3 at the motor shaft; negative: it softens; omitted: 0",
        "N m/rad^3",
        default=None,
    )
    backward_stiffness_Nm_per_rad: Stiffness | None = quantity(
        "stiffness of the transmission where the motor lags behind the joint and pulls it back; "
        "stiffness_Nm_per_rad then is that of the other direction; omitted: the same",
        "N m/rad",
        gt=0,
        default=None,
    )
    brake_damping_max_Nms_per_rad: Damper | None = quantity(
        "largest damping of a programmable brake on the rotor; omitted: no brake", "N m s/rad", ge=0, default=None
    )
    brake_time_constant_s: Number | None = quantity(
        "lag of the brake's damping; omitted: none", "s", ge=0, default=None
    )


class DampingSection(Section):
    """Structural damping: by mode, proportional, or given at the drives; exactly one."""

    mode_ratio: Number | None = quantity(
        "damping ratio of every flexible mode, 0.05 for 5 %; rigid modes have none",
        "1",
        ge=0,
        le=2,
        default=None,
    )
    mass_coefficient_1_per_s: Number | None = quantity(
        "r_m of the proportional damping r_m M + r_k K", "1/s", ge=0, default=None
    )
    stiffness_coefficient_s: Number | None = quantity(
        "r_k of the proportional damping r_m M + r_k K", "s", ge=0, default=None
    )
    given: Literal[True] | None = quantity("true: the drives' own damping_Nms_per_rad", default=None)


class MechanismSection(Section):
    """A mechanism of rigid links, drives and loop closures."""

    links: tuple[LinkSection, ...] = quantity("the moving links", min_length=1)
    loops: tuple[LoopClosure, ...] = quantity("the loop closures", default=())
    handle: HandleSection = quantity("where the operator holds the device")
    assemblies: dict[Name, AssemblySection] = quantity("named ways of assembling it", min_length=1)
    reference: ReferenceSection = quantity("the posture and direction meant where none is given")
    workspace: WorkspaceSection | None = quantity("bounds of the handle's position; omitted: none", default=None)
    drives: tuple[DriveSection, ...] = quantity("the drives, in the order of the driven coordinates", min_length=1)
    damping: DampingSection = quantity("structural damping, one of the three ways")
    friction: DriveFrictionSection = quantity(
        "how the dry friction of the drives, coulomb_Nm, grips",
        default=DriveFrictionSection(
            model="coulomb",
            bristle_stiffness_Nm_per_rad=None,
            bristle_damping_Nms_per_rad=None,
            stribeck_velocity_rad_per_s=None,
        ),
    )
