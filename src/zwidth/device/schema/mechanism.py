"""[mechanism]: links, loops, legs, drives, handle, and the posture everything is referred to.

[friction] of a plant, [mechanism.friction] of drives: dry friction, and how it grips.
"""

from __future__ import annotations

from typing import Final, Literal

from zwidth.device.schema import value_types
from zwidth.device.schema.beam import BeamSection
from zwidth.device.schema.value_types import Section, documented_key
from zwidth.model.plant import FrictionModel

_MODEL: Final = (
    'how it grips: "coulomb" (one level, and at rest what keeps it there), "dahl" (by bristles that give way) or '
    '"lugre" (by bristles, with a higher level at rest)'
)
_BRISTLES: Final = 'stiffness of the bristles, sigma_0; of "dahl" and "lugre"'
_SLIDING: Final = 'damping of the bristles, sigma_1; of "lugre"'
_STRIBECK: Final = "velocity v_s at which the static level gives way; with a breakaway above it"


class FrictionSection(Section):
    """Dry friction of a [plant], along each of its coordinates."""

    coulomb_N: value_types.Frictions = documented_key(
        "level of the friction along each coordinate, n numbers; one for n = 1", "N"
    )
    model: FrictionModel = documented_key(_MODEL, default="coulomb")
    bristle_stiffness_N_per_m: value_types.Bristle | None = documented_key(_BRISTLES, "N/m", default=None)
    bristle_damping_Ns_per_m: value_types.BristleDamper | None = documented_key(
        _SLIDING + "; omitted: 0", "N s/m", default=None
    )
    breakaway_N: value_types.Frictions | None = documented_key(
        'static level along each coordinate, at least coulomb_N; of "lugre"; omitted: coulomb_N', "N", default=None
    )
    stribeck_velocity_m_per_s: value_types.StribeckVelocity | None = documented_key(_STRIBECK, "m/s", default=None)


class DriveFrictionSection(Section):
    """How the dry friction of the drives grips, all of them alike, at the motor."""

    model: FrictionModel = documented_key(_MODEL, default="coulomb")
    bristle_stiffness_Nm_per_rad: value_types.Bristle | None = documented_key(_BRISTLES, "N m/rad", default=None)
    bristle_damping_Nms_per_rad: value_types.BristleDamper | None = documented_key(
        _SLIDING + "; omitted: 0", "N m s/rad", default=None
    )
    stribeck_velocity_rad_per_s: value_types.StribeckVelocity | None = documented_key(
        _STRIBECK, "rad/s", default=None
    )


class LinkSection(Section):
    """A rigid link and the joint that carries it."""

    name: value_types.Name = documented_key("the link's name: letters, digits, - and _")
    parent: value_types.Name = documented_key('the link that carries it, or "base"', default="base")
    joint: Literal["revolute", "prismatic", "universal", "spherical", "free", "fixed"] = documented_key(
        'how it moves against its parent: "revolute" about axis; "prismatic" along axis; "universal" about axis, '
        'then about second_axis, which turns with it; "spherical"; "free" in all six ways, as a platform that '
        'only its legs hold; or "fixed"'
    )
    axis: value_types.Axis = documented_key(
        "joint axis in the link's own frame, any length", "1", default=(0.0, 0.0, 1.0)
    )
    second_axis: value_types.Axis | None = documented_key(
        "second axis of a universal joint in the link's own frame, any length; omitted: y", "1", default=None
    )
    limits_rad: value_types.Bounds | None = documented_key(
        "least and largest angle of a revolute joint; omitted: none", "rad", default=None
    )
    limits_m: value_types.Bounds | None = documented_key(
        "least and largest way of a prismatic joint; omitted: none", "m", default=None
    )
    free: bool = documented_key(
        "true: nobody drives this joint and no loop determines it, as of a gimbal that nobody holds; of a "
        "spherical joint in a loop the turn about the link's own x axis, as a rod with a ball at either end may "
        "do",
        default=False,
    )
    origin_m: value_types.Triple | None = documented_key(
        "joint origin in the parent's frame, of a prismatic joint at way 0; omitted: the parent's tip (of the "
        "base: its origin)",
        "m",
        default=None,
    )
    orientation_rad: value_types.Triple = documented_key(
        "roll, pitch, yaw of the link's axes in the parent's frame at joint angle 0: turned about the "
        "parent's x, then y, then z axis",
        "rad",
        default=(0.0, 0.0, 0.0),
    )
    joint_stiffness_Nm_per_rad: value_types.Stiffness | None = documented_key(
        "spring of the joint itself, about each of its axes, at rest in the posture asked about; omitted: none",
        "N m/rad",
        gt=0,
        default=None,
    )
    joint_damping_Nms_per_rad: value_types.Damper | None = documented_key(
        "viscous friction of the joint itself, about each of its axes; omitted: none",
        "N m s/rad",
        ge=0,
        default=None,
    )
    joint_coulomb_Nm: value_types.DryFriction | None = documented_key(
        "dry friction of the joint itself, about each of its axes; omitted: none", "N m", default=None
    )
    joint_stiffness_N_per_m: value_types.Stiffness | None = documented_key(
        "spring along a prismatic joint; omitted: none", "N/m", gt=0, default=None
    )
    joint_damping_Ns_per_m: value_types.Damper | None = documented_key(
        "viscous friction along a prismatic joint; omitted: none", "N s/m", ge=0, default=None
    )
    joint_coulomb_N: value_types.DryFriction | None = documented_key(
        "dry friction along a prismatic joint; omitted: none", "N", default=None
    )
    length_m: value_types.Number = documented_key(
        "length along the link's x axis; its tip is at (length, 0, 0)", "m", ge=0, default=0.0
    )
    mass_kg: value_types.Mass | None = documented_key(
        "mass; 0 for a massless link; omitted, of all links: not known",
        "kg",
        ge=0,
        default=None,
    )
    center_of_mass_m: value_types.Offset = documented_key(
        "centre of mass in the link's frame, x or x, y or x, y, z", "m", default=(0.0, 0.0, 0.0)
    )
    beam: BeamSection | None = documented_key(
        "the link bends: a beam from its joint to its tip; mass, centre of mass and inertia then are those of the "
        "whole link, or omitted for the beam's own; omitted: the link is rigid",
        default=None,
    )
    inertia_kg_m2: value_types.Inertia | None = documented_key(
        "moments of inertia about the centre of mass, link axes: one number (about the joint axis; enough "
        "for planar motion), three moments [Ixx, Iyy, Izz], or a 3 x 3 matrix; omitted, of all links: not known",
        "kg m^2",
        default=None,
    )


class LoopClosure(Section):
    """A closed loop: a point of one link stays on a point of another; or an axis, or the whole link, too."""

    name: value_types.Name = documented_key("the loop's name: letters, digits, - and _")
    links: tuple[value_types.Name, ...] = documented_key(
        'the two links that meet, or a link and "base"', min_length=2, max_length=2
    )
    points_m: tuple[value_types.Triple, ...] | None = documented_key(
        "the meeting point in the frame of each of the two; omitted: their tips (of the base: its origin)",
        "m",
        min_length=2,
        max_length=2,
        default=None,
    )
    closes: Literal["point", "axis", "frame"] = documented_key(
        'what meets: "point", as in a ball joint; "axis", as in a hinge: the points meet and the axes are '
        'parallel; "frame": the links are welded to each other',
        default="point",
    )
    axes: tuple[value_types.Axis, ...] | None = documented_key(
        'the hinge\'s axis in the frame of each of the two, any length; with closes = "axis"; omitted: z of each',
        "1",
        min_length=2,
        max_length=2,
        default=None,
    )
    orientation_rad: value_types.Triple | None = documented_key(
        'roll, pitch, yaw of the second link\'s axes in the frame of the first; with closes = "frame"; omitted: 0',
        "rad",
        default=None,
    )


class HandleSection(Section):
    """Where the operator holds the device."""

    link: value_types.Name = documented_key("the link that carries the handle")
    point_m: value_types.Triple | None = documented_key(
        "the handle in that link's frame; omitted: its tip", "m", default=None
    )
    orientation_rad: value_types.Triple = documented_key(
        "roll, pitch, yaw of the handle's axes in that link's frame", "rad", default=(0.0, 0.0, 0.0)
    )
    controls: Literal["position", "orientation", "pose"] = documented_key(
        'what of the handle the drives control: its "position"; its "orientation", as a wrist does; or its '
        '"pose", both',
        default="position",
    )


class AssemblySection(Section):
    """One way of assembling the mechanism at the reference posture."""

    joints_rad: dict[str, value_types.Number | value_types.Several] = documented_key(
        "approximate angle of every revolute joint, by link name, at the reference position; two angles of a "
        "universal joint; of a spherical or free one its rotation vector, axis times angle, three numbers; "
        "omitted: 0, of all but revolute and universal joints; of a leg's joint the name without number stands "
        "for that of every copy",
        "rad",
        default={},
    )
    joints_m: dict[str, value_types.Number | value_types.Several] = documented_key(
        "approximate way of every prismatic joint, by link name, at the reference position; of a free joint x, "
        "y, z",
        "m",
        default={},
    )


class ReferenceSection(Section):
    """The posture and the direction that are used where none is given."""

    position_m: value_types.Position | None = documented_key(
        "position of the handle, x, y or x, y, z; omitted only where the drives control its orientation alone",
        "m",
        default=None,
    )
    orientation_rad: value_types.Triple | None = documented_key(
        "roll, pitch, yaw of the handle's axes in the base's frame, where the drives control its orientation; "
        "omitted: 0",
        "rad",
        default=None,
    )
    direction: value_types.Direction | None = documented_key(
        "rendered direction, any length; or axis, or both", "1", default=None
    )
    axis: value_types.Axis | None = documented_key(
        "axis about which moments are rendered, any length; with direction: a screw, as much of either as the "
        "vectors are long",
        "1",
        default=None,
    )
    characteristic_length_m: value_types.Number | None = documented_key(
        "length by which angles count as ways on a screw, of direction and axis together", "m", gt=0, default=None
    )
    assembly: value_types.Name | None = documented_key(
        "the assembly used by default; omitted only where one is named", default=None
    )


class WorkspaceSection(Section):
    """Bounds of the handle's position, for maps."""

    x_m: value_types.Bounds | None = documented_key("lower and upper bound of x", "m", default=None)
    y_m: value_types.Bounds | None = documented_key("lower and upper bound of y", "m", default=None)
    z_m: value_types.Bounds | None = documented_key("lower and upper bound of z", "m", default=None)


class RatioTableSection(Section):
    """The ratio of a transmission over the coordinate of its joint, between its entries a cubic that keeps their
    shape."""

    joint_rad: value_types.Increasing | None = documented_key(
        "angles of the drive's revolute joint, each above the one before, over a full turn at most",
        "rad",
        default=None,
    )
    joint_m: value_types.Increasing | None = documented_key(
        "ways of the drive's prismatic joint instead, each above the one before", "m", default=None
    )
    ratio: value_types.Ratios = documented_key(
        "the ratio at each of them, at least two: change of the motor's angle over that of the joint there; on a "
        "prismatic joint radians of the motor per metre",
        "1",
    )


class DriveSection(Section):
    """A motor and its transmission, on one revolute or prismatic joint."""

    name: value_types.Name = documented_key("the drive's name: letters, digits, - and _")
    joint: value_types.Name = documented_key("the link whose joint it drives")
    motor_inertia_kg_m2: value_types.RotorInertia | None = documented_key(
        "inertia of the rotor, at the motor; omitted, of all drives: not known", "kg m^2", ge=0, default=None
    )
    transmission_ratio: value_types.Ratio | None = documented_key(
        "motor turns per joint turn; on a prismatic joint radians of the motor per metre; omitted, of all "
        "drives: not known",
        "1",
        gt=0,
        default=None,
    )
    ratio_table: RatioTableSection | None = documented_key(
        "instead of transmission_ratio: a ratio that changes with the joint; its ends limit the joint where the "
        "link has no limits",
        default=None,
    )
    coupling: dict[value_types.Name, value_types.Number] = documented_key(
        "motor turns per turn of other driven or free joints, by link name, that turn this motor too: of a drive "
        "that holds the forearm's angle against the base, as a parallelogram does, the upper arm's joint with "
        "the same ratio",
        "1",
        default={},
    )
    motor_link: value_types.Name | None = documented_key(
        'the link that carries the motor, or "base", with motor_axis: the whole kinetic energy of a rotor that '
        "turns "
        "with it; that link's inertia holds the rotor as if it were locked. Omitted: the turning of rotors with "
        "their links is neglected",
        default=None,
    )
    motor_axis: value_types.Axis | None = documented_key(
        "the rotor's axis in the frame of motor_link, any length, in the sense in which its angle grows with the "
        "joint's",
        "1",
        default=None,
    )
    stiffness_Nm_per_rad: value_types.Spring | None = documented_key(
        "stiffness of the transmission at the motor shaft; omitted or inf: rigid",
        "N m/rad",
        gt=0,
        default=None,
    )
    damping_Nms_per_rad: value_types.Damper | None = documented_key(
        "damping parallel to that stiffness, at the motor shaft; with mechanism.damping.given = true",
        "N m s/rad",
        ge=0,
        default=None,
    )
    torque_constant_Nm_per_A: value_types.Number | None = documented_key(
        "torque constant of the motor; omitted: not known", "N m/A", gt=0, default=None
    )
    winding_resistance_ohm: value_types.Resistance | None = documented_key(
        "resistance of the motor's winding, for its heat and for damping_resistance_ohm; omitted: not known",
        "ohm",
        gt=0,
        default=None,
    )
    winding_inductance_H: value_types.Inductance | None = documented_key(
        "inductance of the motor's winding; with damping_resistance_ohm; omitted: none", "H", ge=0, default=None
    )
    damping_resistance_ohm: value_types.Resistance | None = documented_key(
        "resistor through which the winding is closed, so that the motor brakes by its own induction; 0: shorted; "
        "omitted: the winding is open or on a current amplifier, and there is no electrical damping",
        "ohm",
        ge=0,
        default=None,
    )
    torque_limit_Nm: value_types.NumberOrInfinity | None = documented_key(
        "largest torque at the motor; omitted or inf: no limit", "N m", gt=0, default=None
    )
    continuous_torque_Nm: value_types.Torque | None = documented_key(
        "torque at the motor that it bears without end, its winding no hotter than allowed; omitted: not known",
        "N m",
        gt=0,
        default=None,
    )
    encoder_counts_per_rev: value_types.Counts | None = documented_key(
        "encoder counts per motor revolution, after quadrature; omitted: not known", "1", default=None
    )
    encoder_noise_rad: value_types.Step | None = documented_key(
        "standard deviation of the motor's angle before it is counted; omitted: 0", "rad", usual=1e-3, default=None
    )
    coulomb_Nm: value_types.DryFriction | None = documented_key(
        "dry friction at the motor; omitted: none", "N m", default=None
    )
    breakaway_Nm: value_types.DryFriction | None = documented_key(
        'its static level, at least coulomb_Nm; with mechanism.friction.model = "lugre"; omitted: coulomb_Nm',
        "N m",
        default=None,
    )
    hardening_Nm_per_rad3: value_types.Hardening | None = documented_key(
        "k_3 of the transmission's torque k d + k_3 d^3 at the motor shaft; negative: it softens; omitted: 0",
        "N m/rad^3",
        default=None,
    )
    backward_stiffness_Nm_per_rad: value_types.Stiffness | None = documented_key(
        "stiffness of the transmission where the motor lags behind the joint and pulls it back; "
        "stiffness_Nm_per_rad then is that of the other direction; omitted: the same",
        "N m/rad",
        gt=0,
        default=None,
    )
    preload_Nm: value_types.Torque | None = documented_key(
        "torque at the motor by which a cable is preloaded: only where the motor pulls the joint back by more "
        "does the stiffness become backward_stiffness_Nm_per_rad; omitted: it changes at no torque",
        "N m",
        gt=0,
        default=None,
    )
    brake_damping_max_Nms_per_rad: value_types.Damper | None = documented_key(
        "largest damping of a programmable brake on the rotor; omitted: no brake", "N m s/rad", ge=0, default=None
    )
    brake_time_constant_s: value_types.Number | None = documented_key(
        "lag of the brake's damping; omitted: none", "s", ge=0, default=None
    )


class DampingSection(Section):
    """Structural damping: by mode, proportional, or given at the drives; exactly one."""

    mode_ratio: value_types.Number | None = documented_key(
        "damping ratio of every flexible mode, 0.05 for 5 %; rigid modes have none",
        "1",
        ge=0,
        le=2,
        default=None,
    )
    mass_coefficient_1_per_s: value_types.Number | None = documented_key(
        "r_m of the proportional damping r_m M + r_k K", "1/s", ge=0, default=None
    )
    stiffness_coefficient_s: value_types.Number | None = documented_key(
        "r_k of the proportional damping r_m M + r_k K", "s", ge=0, default=None
    )
    given: Literal[True] | None = documented_key("true: the drives' own damping_Nms_per_rad", default=None)


class LegSection(Section):
    """Links, loops and drives that a mechanism has several times, turned about an axis; each is written once.

    A copy's names end in its number, arm-1, arm-2 and so on. Names within the leg mean its own copy; others mean
    the links that all legs share, whose frames are turned with the copy where a leg's link or loop is fixed to
    them.
    """

    name: value_types.Name = documented_key("the leg's name: letters, digits, - and _")
    angles_rad: tuple[value_types.Number, ...] | None = documented_key(
        "by what each copy is turned; or count", "rad", min_length=1, max_length=24, default=None
    )
    count: value_types.WholeNumber | None = documented_key(
        "how many copies, evenly round the axis, the first as written; or angles_rad", ge=2, le=24, default=None
    )
    axis: value_types.Axis = documented_key(
        "axis through the origin, of the base and of each shared link, about which the copies are turned",
        "1",
        default=(0.0, 0.0, 1.0),
    )
    links: tuple[LinkSection, ...] = documented_key("its links", min_length=1)
    loops: tuple[LoopClosure, ...] = documented_key("its loop closures", default=())
    drives: tuple[DriveSection, ...] = documented_key("its drives", default=())


class MechanismSection(Section):
    """A mechanism of rigid links, drives and loop closures."""

    links: tuple[LinkSection, ...] = documented_key("the moving links", min_length=1)
    loops: tuple[LoopClosure, ...] = documented_key("the loop closures", default=())
    legs: tuple[LegSection, ...] = documented_key("legs that are alike", default=())
    handle: HandleSection = documented_key("where the operator holds the device")
    assemblies: dict[value_types.Name, AssemblySection] = documented_key(
        "named ways of assembling it", min_length=1
    )
    reference: ReferenceSection = documented_key("the posture and direction meant where none is given")
    workspace: WorkspaceSection | None = documented_key(
        "bounds of the handle's position; omitted: none", default=None
    )
    drives: tuple[DriveSection, ...] = documented_key(
        "the drives, in the order of the driven coordinates; those of legs follow", default=()
    )
    damping: DampingSection | None = documented_key(
        "structural damping, one of the three ways; omitted only where no drive is flexible", default=None
    )
    gravity_compensation: Literal["none", "computed", "counterweight"] = documented_key(
        'how gravity is compensated under a load with gravity: "none"; "computed", by torques that the computer '
        'works out from the posture that it counts; "counterweight", by masses or springs that balance the links '
        "in every posture",
        default="none",
    )
    friction: DriveFrictionSection = documented_key(
        "how the dry friction of the drives, coulomb_Nm, grips",
        default=DriveFrictionSection(
            model="coulomb",
            bristle_stiffness_Nm_per_rad=None,
            bristle_damping_Nms_per_rad=None,
            stribeck_velocity_rad_per_s=None,
        ),
    )
