"""From the checked [mechanism] to its arrays: legs spread, joints taken apart into single coordinates.

From the checked [beam] of links to the links that bend.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.device.build import drive_nonlinearity, in_space, per_drive, roll_pitch_yaw, value_or
from zwidth.device.consistency import HELD
from zwidth.device.legs import LegMember, members, of_copies
from zwidth.device.schema.beam import BeamSection, MaterialSection, RectangleShape, RodShape, TubeShape
from zwidth.device.schema.mechanism import (
    AssemblySection,
    DriveSection,
    HandleSection,
    LinkSection,
    LoopClosure,
    MechanismSection,
    ReferenceSection,
)
from zwidth.device.schema.operator import ArmSection
from zwidth.model.arm import Arm
from zwidth.model.beam_bodies import flexible_link
from zwidth.model.beam_section import (
    BeamProperties,
    CrossSection,
    Material,
    beam_properties,
    rectangle,
    rectangular_tube,
    round_rod,
    tube,
    typical_material,
)
from zwidth.model.design_axes import join_designs, stack_numbers
from zwidth.model.flexible_body import FlexibleLink
from zwidth.model.mechanism import (
    AXIS,
    BALL_X,
    BALL_Y,
    BALL_Z,
    FIXED,
    FRAME,
    ORIENTATION,
    POINT,
    POSE,
    POSITION,
    PRISMATIC,
    REVOLUTE,
    Closures,
    Drives,
    Links,
    Mechanism,
)
from zwidth.model.ratio_table import RatioTable

SINGLE: Final = {
    "revolute": (REVOLUTE,),
    "prismatic": (PRISMATIC,),
    "universal": (REVOLUTE, REVOLUTE),
    "spherical": (BALL_X, BALL_Y, BALL_Z),
    "free": (PRISMATIC, PRISMATIC, PRISMATIC, BALL_X, BALL_Y, BALL_Z),
    "fixed": (FIXED,),
}
"""Joint of a file -> the joints of one coordinate that make it, the body behind the last of them."""
CONTROLS: Final = {"position": POSITION, "pose": POSE, "orientation": ORIENTATION}
CLOSES: Final = {"point": POINT, "axis": AXIS, "frame": FRAME}
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Tree:
    """Links of a file in the order of their arrays.

    members  parents before children
    first, last  entry of each link's first joint coordinate and of its body, by name; -1 of the base
    """

    members: list[LegMember]
    first: dict[str, int]
    last: dict[str, int]
    tips: dict[str, list[Any]]


def mechanism(section: MechanismSection) -> Mechanism:
    """The mechanism; its numbers may be arrays over designs (`design_batch`)."""
    tree = _tree(members(section, "links"))
    loops, drives = members(section, "loops"), [member.entry for member in members(section, "drives")]
    tables = {drive.joint: _ratio_table(drive) for drive in drives if drive.ratio_table is not None}
    handle, workspace, reference = section.handle, section.workspace, section.reference
    bounds = [(workspace and getattr(workspace, f"{axis}_m")) or (math.nan, math.nan) for axis in "xyz"]
    made = Mechanism(
        links=_links(tree, tables),
        closures=_closures(loops, tree),
        drives=_drives(drives, section, tree, tables),
        handle_link=tree.last[handle.link],
        handle_point=stack_numbers(tree.tips[handle.link] if handle.point_m is None else handle.point_m),
        assemblies={name: _coordinates(section, assembly, tree) for name, assembly in section.assemblies.items()},
        reference_position=in_space(reference.position_m or (0.0, 0.0, 0.0)),
        workspace=np.array(bounds),
        handle_rotation=roll_pitch_yaw(handle.orientation_rad),
        controls=CONTROLS[handle.controls],
        reference_rotation=roll_pitch_yaw(reference.orientation_rad or (0.0, 0.0, 0.0)),
        free=_free(tree, loops),
        gravity_compensation=section.gravity_compensation,
    )
    beams = {tree.last[member.entry.name]: member.entry for member in tree.members if member.entry.beam}
    return with_beams(made, beams, _known_axes(beams)) if beams else made


def _known_axes(links: Mapping[int, LinkSection]) -> dict[int, Floats]:
    """Of each link whose inertia is one number, its joint's axis, about which alone it is known."""
    single = {index: link for index, link in links.items() if isinstance(link.inertia_kg_m2, tuple)}
    return {
        index: _unit(link.axis)
        for index, link in single.items()
        if np.shape(stack_numbers(link.inertia_kg_m2))[-1] == 1
    }


def arm(section: ArmSection) -> Arm:
    """The operator's arm: links and joints as of a mechanism that nobody drives."""
    hand, place = section.hand, ReferenceSection.model_construct(position_m=(0.0, 0.0, 0.0), orientation_rad=None)
    chain = MechanismSection.model_construct(
        links=section.links,
        handle=HandleSection.model_construct(
            link=hand.link, point_m=hand.point_m, orientation_rad=(0.0, 0.0, 0.0)
        ),
        assemblies={HELD: section.posture},
        reference=place,
    )
    made = mechanism(chain)
    joints = tuple(int(i) for i in np.flatnonzero(np.asarray(made.links.joint) != FIXED))
    return Arm(
        mechanism=replace(made, free=joints),
        shoulder=None if section.shoulder_m is None else np.array(section.shoulder_m),
        grasp_stiffness=None if section.grasp == "rigid" else section.grasp_stiffness_N_per_m,
        grasp_damping=section.grasp_damping_Ns_per_m or 0.0,
    )


def joint_entries(joint: str) -> int:
    """How many joint coordinates a joint of a file has; a fixed one counts as one that does not move."""
    return len(SINGLE[joint])


def _tree(links: Sequence[LegMember]) -> Tree:
    """Links sorted so that every parent stands before its children; otherwise in the file's order."""
    ordered: list[LegMember] = []
    placed, waiting = {"base"}, list(links)
    while waiting:
        for member in waiting:
            if member.entry.parent in placed:
                ordered.append(member)
                placed.add(member.entry.name)
        waiting = [member for member in waiting if member.entry.name not in placed]
    first, last, count = {"base": -1}, {"base": -1}, 0
    for member in ordered:
        first[member.entry.name] = count
        count += joint_entries(member.entry.joint)
        last[member.entry.name] = count - 1
    tips = {member.entry.name: [member.entry.length_m, 0.0, 0.0] for member in ordered}
    return Tree(ordered, first, last, {"base": [0.0, 0.0, 0.0], **tips})


def _links(tree: Tree, tables: Mapping[str, RatioTable]) -> Links:
    rows = [row for member in tree.members for row in _entries(member, tree, tables.get(member.entry.name))]
    names, parent, joint, origin, rotation, axis, mass, center, inertia, tip, limits = zip(*rows, strict=True)
    lower, upper = zip(*limits, strict=True)
    limited = np.isfinite([*lower, *upper]).any()
    return Links(
        names=names,
        parent=np.array(parent, dtype=np.int64),
        joint=np.array(joint, dtype=np.int64),
        origin=join_designs(origin, 1),
        rotation=join_designs(rotation, 2),
        axis=join_designs(axis, 1),
        mass=stack_numbers(list(mass)),
        center_of_mass=join_designs(center, 1),
        inertia=join_designs(inertia, 2),
        tip=join_designs(tip, 1),
        lower=np.array(lower) if limited else None,
        upper=np.array(upper) if limited else None,
        joint_stiffness=_of_joints(tree, "stiffness", "Nm_per_rad", "N_per_m"),
        joint_damping=_of_joints(tree, "damping", "Nms_per_rad", "Ns_per_m"),
        joint_coulomb=_of_joints(tree, "coulomb", "Nm", "N"),
    )


def _of_joints(tree: Tree, what: str, turning: str, sliding: str) -> Floats | None:
    """One number of each joint coordinate (..., n), of those that turn and those that slide; None if none has
    it."""
    rows: list[Any] = []
    for member in tree.members:
        keys = {PRISMATIC: f"joint_{what}_{sliding}"}
        for kind in SINGLE[member.entry.joint]:
            value = getattr(member.entry, keys.get(kind, f"joint_{what}_{turning}"))
            rows.append(0.0 if value is None or kind == FIXED else value)
    return stack_numbers(rows) if any(np.any(row) for row in rows) else None


def _entries(member: LegMember, tree: Tree, table: RatioTable | None) -> list[tuple[Any, ...]]:
    """One row of `Links` for each joint coordinate of a link. Only the last is a body, and only the first is apart
    from the parent. A joint without limits has those of the ratio table of its drive."""
    link: LinkSection = member.entry
    origin = stack_numbers(tree.tips[link.parent] if link.origin_m is None else link.origin_m)
    rotation = roll_pitch_yaw(link.orientation_rad)
    turn = member.turn_of(link.parent)
    origin, rotation = (turn @ origin[..., None])[..., 0], turn @ rotation
    kinds, axes = SINGLE[link.joint], _axes(link)
    none, tip = np.zeros(3), stack_numbers(tree.tips[link.name])
    ends = (-math.inf, math.inf) if table is None else (table.coordinate[0], table.coordinate[-1])
    rows = []
    for k, (kind, axis) in enumerate(zip(kinds, axes, strict=True)):
        body = k == len(kinds) - 1
        name = link.name if body else f"{link.name}/{k + 1}"
        parent = tree.last[link.parent] if k == 0 else tree.first[link.name] + k - 1
        place = (origin, rotation) if k == 0 else (none, np.eye(3))
        mass = math.nan if link.mass_kg is None else link.mass_kg
        own = mass, in_space(link.center_of_mass_m), _inertia(link, axis), tip
        if link.beam is not None and link.mass_kg is None:
            own = (*own_body(link.beam, link.length_m), tip)
        limits = link.limits_rad or link.limits_m or ends
        rows.append(
            (name, parent, kind, *place, axis, *(own if body else (0.0, none, np.zeros((3, 3)), none)), limits)
        )
    return rows


def _axes(link: LinkSection) -> list[Floats]:
    """Unit axis of each joint coordinate, in the link's frame."""
    if link.joint == "universal":
        return [_unit(link.axis), _unit(Y if link.second_axis is None else link.second_axis)]
    return {"spherical": [X, Y, Z], "free": [X, Y, Z, X, Y, Z]}.get(link.joint, [_unit(link.axis)])


def _unit(vector: Any) -> Floats:
    axis = stack_numbers(vector)
    axis = axis / np.abs(axis).max(axis=-1, keepdims=True)  # lengths of 1e-300 have a direction, too
    return np.asarray(axis / np.linalg.norm(axis, axis=-1, keepdims=True))


def _inertia(link: LinkSection, axis: Floats) -> Floats:
    """(..., 3, 3); one number is the moment about the joint axis and leaves the others open: I a a^T."""
    if link.inertia_kg_m2 is None:
        return np.full((3, 3), math.nan)
    rows = stack_numbers(link.inertia_kg_m2)
    if rows.shape[-1] == 1:
        return rows * axis[..., :, None] * axis[..., None, :]
    return 0.5 * rows + 0.5 * np.swapaxes(rows, -1, -2)


def _closures(loops: Sequence[LegMember], tree: Tree) -> Closures:
    ends = [_points(member, tree) for member in loops]
    points = join_designs(ends, 2) if ends else np.zeros((0, 2, 3))
    kind = np.array([CLOSES[member.entry.closes] for member in loops], dtype=np.int64)
    axes = join_designs([_closing_axes(member) for member in loops], 2) if ends else points
    closures = Closures(
        names=tuple(member.entry.name for member in loops),
        a=np.array([tree.last[member.entry.links[0]] for member in loops], dtype=np.int64),
        b=np.array([tree.last[member.entry.links[1]] for member in loops], dtype=np.int64),
        point_a=points[..., 0, :],
        point_b=points[..., 1, :],
    )
    if not kind.any():
        return closures
    rotation = join_designs([_closing_rotation(member) for member in loops], 2)
    return Closures(
        **{
            **vars(closures),
            "kind": kind,
            "axis_a": axes[..., 0, :],
            "axis_b": axes[..., 1, :],
            "rotation": rotation,
        }
    )


def _points(member: LegMember, tree: Tree) -> Floats:
    """The meeting points (..., 2, 3) of a loop, each in the frame of its link."""
    loop: LoopClosure = member.entry
    points = stack_numbers(list(loop.points_m or [tree.tips[name] for name in loop.links]))
    return _turned_ends(member, points)


def _closing_axes(member: LegMember) -> Floats:
    loop: LoopClosure = member.entry
    return _turned_ends(member, join_designs([_unit(axis) for axis in loop.axes or (Z, Z)], 1))


def _turned_ends(member: LegMember, vectors: Floats) -> Floats:
    """Vectors (..., 2, 3), one in the frame of each of a loop's links; those in shared frames turn with the
    copy."""
    turns = np.stack([member.turn_of(name) for name in member.entry.links])
    return np.asarray((turns @ vectors[..., None])[..., 0])


def _closing_rotation(member: LegMember) -> Floats:
    """Axes of the second link in the frame of the first."""
    loop: LoopClosure = member.entry
    rotation = roll_pitch_yaw(loop.orientation_rad or (0.0, 0.0, 0.0))
    before, behind = (member.turn_of(name) for name in loop.links)
    return np.asarray(before @ rotation @ behind.T)


def _coordinates(section: MechanismSection, assembly: AssemblySection, tree: Tree) -> Floats:
    """Approximate joint coordinates (..., n) of an assembly."""
    angles, ways = of_copies(section, assembly.joints_rad), of_copies(section, assembly.joints_m)
    rows: list[Any] = []
    for member in tree.members:
        link, way = member.entry, ways.get(member.entry.name, 0.0)
        given = way if link.joint == "prismatic" else angles.get(link.name, 0.0)
        if link.joint == "free":
            rows += _listed(way, 3) + _listed(given, 3)
        else:
            rows += _listed(given, joint_entries(link.joint))
    return stack_numbers(rows)


def _listed(value: Any, count: int) -> list[Any]:
    """One number for each of so many coordinates."""
    return list(value) if isinstance(value, tuple) else [value] * count


def _free(tree: Tree, loops: Sequence[LegMember]) -> tuple[int, ...]:
    """The joint coordinates that are free: all of a free joint, of a spherical one in a loop the turn about x."""
    looped = _links_in_loops(tree, loops)
    free: list[int] = []
    for member in tree.members:
        link = member.entry
        if link.free:
            spins = link.joint == "spherical" and link.name in looped
            free += range(tree.first[link.name], tree.first[link.name] + 1 if spins else tree.last[link.name] + 1)
    return tuple(free)


def _links_in_loops(tree: Tree, loops: Sequence[LegMember]) -> set[str]:
    """Names of the links whose joint is part of a closed chain: those between the ends of a loop and their
    fork."""
    parent = {member.entry.name: member.entry.parent for member in tree.members}
    found: set[str] = set()
    for member in loops:
        one, two = (_way_to_base(name, parent) for name in member.entry.links)
        found |= set(one) ^ set(two)
    return found


def _way_to_base(name: str, parent: dict[str, str]) -> list[str]:
    way = []
    while name != "base":
        way.append(name)
        name = parent[name]
    return way


def _drives(
    drives: Sequence[DriveSection], section: MechanismSection, tree: Tree, tables: Mapping[str, RatioTable]
) -> Drives:
    index = tree.last

    def column(key: str, omitted: float) -> Floats:
        return per_drive(drives, key, omitted)

    windings = [_winding(drive) for drive in drives]
    return Drives(
        names=tuple(drive.name for drive in drives),
        joint=np.array([index[drive.joint] for drive in drives], dtype=np.int64),
        motor_inertia=column("motor_inertia_kg_m2", math.nan),
        transmission=column("transmission_ratio", math.nan),
        stiffness=column("stiffness_Nm_per_rad", math.inf),
        damping=column("damping_Nms_per_rad", 0.0),
        torque_constant=column("torque_constant_Nm_per_A", math.nan),
        torque_limit=column("torque_limit_Nm", math.inf),
        encoder_counts=column("encoder_counts_per_rev", math.nan),
        continuous_torque=column("continuous_torque_Nm", math.nan),
        winding_resistance=column("winding_resistance_ohm", math.nan),
        winding_damping=stack_numbers([damping for damping, _ in windings]),
        winding_time_constant=stack_numbers([lag for _, lag in windings]),
        nonlinearity=drive_nonlinearity(drives, section.friction),
        coupling=_coupling(drives, index),
        motor_link=_motor_links(drives, index),
        motor_axis=_motor_axes(drives),
        ratio_tables=tuple(tables.get(drive.joint) for drive in drives) if tables else None,
    )


def _ratio_table(drive: DriveSection) -> RatioTable:
    given = drive.ratio_table
    assert given is not None
    coordinate = given.joint_m if given.joint_rad is None else given.joint_rad
    return RatioTable(np.array(coordinate), stack_numbers(given.ratio), turns=given.joint_rad is not None)


def _coupling(drives: Sequence[DriveSection], index: dict[str, int]) -> Floats | None:
    """Turns of each motor per turn of other joints over its own ratio, (..., d, n); None without any."""
    if not any(drive.coupling for drive in drives):
        return None
    rows = []
    for drive in drives:
        row: list[Any] = [0.0] * max(index.values()) + [0.0]
        for name, ratio in drive.coupling.items():
            row[index[name]] = ratio / value_or(drive.transmission_ratio, math.nan)
        rows.append(stack_numbers(row))
    return join_designs(rows, 1)


def _motor_links(drives: Sequence[DriveSection], index: dict[str, int]) -> Ints | None:
    if all(drive.motor_link is None for drive in drives):
        return None
    return np.array([index[drive.motor_link or "base"] for drive in drives], dtype=np.int64)


def _motor_axes(drives: Sequence[DriveSection]) -> Floats | None:
    """Unit axes of the rotors, (..., d, 3); 0 of one that is neglected."""
    if all(drive.motor_axis is None for drive in drives):
        return None
    return join_designs(
        [np.zeros(3) if drive.motor_axis is None else _unit(drive.motor_axis) for drive in drives], 1
    )


def _winding(drive: DriveSection) -> tuple[float, float]:
    """Damping k^2/R [N m s/rad] and lag L/R [s] at the motor of a winding closed through a resistor; else 0."""
    if drive.damping_resistance_ohm is None:
        return 0.0, 0.0
    keys = drive.winding_resistance_ohm, drive.torque_constant_Nm_per_A, drive.winding_inductance_H
    inside, constant, inductance = (value_or(one, 0.0) for one in keys)
    R = inside + drive.damping_resistance_ohm
    return constant**2 / R, inductance / R


MODES, ELEMENTS = 2, 8  # where none are given


def with_beams(mechanism: Mechanism, links: dict[int, LinkSection], axes: dict[int, Floats]) -> Mechanism:
    """A mechanism with the links that bend.

    links  by the index of their body, those with a [beam];   axes  about which alone the inertia of some is known
    Raises BeamError  for a beam that its link cannot be
    """
    flexible = [_flexible(mechanism, index, link, axes.get(index)) for index, link in links.items()]
    return replace(mechanism, flexible=tuple(flexible))


def _flexible(mechanism: Mechanism, index: int, link: LinkSection, axis: Floats | None) -> FlexibleLink:
    section = link.beam
    assert section is not None
    return flexible_link(
        mechanism,
        index,
        properties_of(section, link.length_m),
        section.method,
        MODES if section.modes is None else section.modes,
        ELEMENTS if section.elements is None else section.elements,
        section.damping_time_s,
        axis,
    )


def own_body(section: BeamSection, length: float) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass (3,) and inertia (3, 3) of a link that is its beam alone."""
    beam = properties_of(section, length)
    m = beam.mass_per_length * length
    inertia = np.diag([beam.torsional_inertia_per_length * length, m * length**2 / 12.0, m * length**2 / 12.0])
    return m, np.array([length / 2.0, 0.0, 0.0]), inertia


def properties_of(section: BeamSection, length: float) -> BeamProperties:
    """The beam of a [beam], `length` long [m]."""
    if section.section is not None:
        return beam_properties(length, _section(section), _material(section))
    bending = np.broadcast_to(np.asarray(section.bending_stiffness_Nm2, dtype=np.float64), (2,))
    rest = (
        section.torsion_stiffness_Nm2,
        section.axial_stiffness_N,
        section.mass_per_length_kg_per_m,
        section.torsional_inertia_per_length_kg_m,
    )
    return BeamProperties(length, *(float(number) for number in (*bending, *rest) if number is not None))


def _section(beam: BeamSection) -> CrossSection:
    match beam.section:
        case RodShape() as rod:
            return round_rod(rod.diameter_m)
        case TubeShape() as round_tube:
            return tube(round_tube.outer_diameter_m, round_tube.wall_m)
        case RectangleShape() as solid:
            return rectangle(solid.width_m, solid.height_m)
        case box:
            assert box is not None
            return rectangular_tube(box.width_m, box.height_m, box.wall_m)


def _material(beam: BeamSection) -> Material:
    if isinstance(beam.material, MaterialSection):
        own = beam.material
        return Material(own.youngs_modulus_Pa, own.shear_modulus_Pa, own.density_kg_per_m3)
    assert beam.material is not None
    return typical_material(beam.material)
