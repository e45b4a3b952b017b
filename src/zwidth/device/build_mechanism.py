"""From the checked [mechanism] to its arrays: legs spread, joints taken apart into single coordinates.

From the checked [beam] of links to the links that bend.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.device.address import LegMember, members, of_copies
from zwidth.device.build import drive_columns, drive_nonlinearity, in_space, roll_pitch_yaw, value_or
from zwidth.device.rules.mechanism import HELD
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
from zwidth.model.design_axes import stack_columns, stack_numbers
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
    RatioTable,
)

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
X, Y, Z = np.eye(3).tolist()
UNKNOWN_INERTIA: Final = np.full((3, 3), math.nan).tolist()


@dataclass(frozen=True)
class Tree:
    """Links of a file in the order of their arrays.

    members      parents before children
    first, last  entry of each link's first joint coordinate and of its body, by name; -1 of the base
    tips         (3,) each link's tip in its own frame [m], by name; of the base its origin
    """

    members: list[LegMember]
    first: dict[str, int]
    last: dict[str, int]
    tips: dict[str, list[Any]]


def mechanism(section: MechanismSection) -> Mechanism:
    """The mechanism of [mechanism], whose numbers may be arrays over designs (`design_batch`)."""
    tree = _tree(members(section, "links"))
    loops, drives = members(section, "loops"), [member.entry for member in members(section, "drives")]
    tables = {drive.joint: _ratio_table(drive) for drive in drives if drive.ratio_table is not None}
    handle, workspace, reference = section.handle, section.workspace, section.reference
    # (3, 2) lower and upper bound of x, y and z [m], nan where the file gives none
    bounds = [(workspace and getattr(workspace, f"{axis}_m")) or (math.nan, math.nan) for axis in "xyz"]
    places = stack_columns(
        {
            "handle": tree.tips[handle.link] if handle.point_m is None else handle.point_m,
            "handle angles": handle.orientation_rad,
            "reference": in_space(reference.position_m or ()),
            "reference angles": reference.orientation_rad or in_space(()),
        }
    )
    made = Mechanism(
        links=_links(tree, tables),
        closures=_closures(loops, tree),
        drives=_drives(drives, section, tree, tables),
        handle_link=tree.last[handle.link],
        handle_point=places["handle"],
        assemblies=stack_columns(
            {name: _assembly_coordinates(section, assembly, tree) for name, assembly in section.assemblies.items()}
        ),
        reference_position=places["reference"],
        workspace=np.array(bounds),
        handle_rotation=roll_pitch_yaw(places["handle angles"]),
        controls=CONTROLS[handle.controls],
        reference_rotation=roll_pitch_yaw(places["reference angles"]),
        free=_free_coordinates(tree, loops),
        gravity_compensation=section.gravity_compensation,
    )
    beams = {tree.last[member.entry.name]: member.entry for member in tree.members if member.entry.beam}
    return with_beams(made, beams, _known_axes(beams)) if beams else made


def _known_axes(links: Mapping[int, LinkSection]) -> dict[int, Floats]:
    """Unit axis (3,) by link index, of links whose inertia is known about their joint's axis alone."""
    return {index: _unit_vectors(np.array(link.axis)) for index, link in links.items() if _has_one_moment(link)}


def arm(section: ArmSection) -> Arm:
    """The operator's arm: links and joints as of a mechanism that nobody drives."""
    hand, place = section.hand, ReferenceSection.model_construct(position_m=(0.0, 0.0, 0.0), orientation_rad=None)
    # sections without the keys that only mechanisms have
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
    """Number of joint coordinates of a joint of this kind: 1 for a fixed one, too, which does not move."""
    return len(SINGLE[joint])


def _tree(links: Sequence[LegMember]) -> Tree:
    """The `Tree` of links, in which every parent stands before its children; otherwise in the file's order."""
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
    """One row of `Links` for each joint coordinate of a link. Only the last is a body, and only the first is apart
    from the parent.

    tables  ratio tables of drives, by the link whose joint they drive
    """
    links: list[LinkSection] = [member.entry for member in tree.members]
    of_link = np.repeat(np.arange(len(links)), [joint_entries(link.joint) for link in links])
    # marks of each link's first and last joint coordinate
    is_first, is_body = (np.diff(of_link, prepend=-1) > 0), (np.diff(of_link, append=len(links)) > 0)
    given = stack_columns(_link_columns(links, tree))
    axis, angles = _unit_vectors(given["axis"]), given["angles"]
    # (links, 3, 3) by which what a leg's copy gives in its parent's frame is turned
    turns = np.stack([member.turn_of(member.entry.parent) for member in tree.members])
    limits = np.array([_joint_limits(link, tables.get(link.name)) for link in links])[of_link]
    lower, upper = limits.T.copy()
    limited = np.isfinite(limits).any()

    def spread(numbers: Floats, own: int, where: Flags, otherwise: float | Floats = 0.0) -> Floats:
        """Numbers of links (..., links) as one row for each joint coordinate: at those marked by `where` the
        link's, at others the value `otherwise`.

        own  how many axes each link's numbers have, behind the axis of the links: 1 of vectors, 2 of matrices
        """
        rows = np.take(numbers, of_link, axis=-1 - own)
        return np.ascontiguousarray(np.where(where.reshape(-1, *(1,) * own), rows, otherwise))

    return Links(
        names=tuple(name for link in links for name in _coordinate_names(link)),
        parent=np.array([parent for link in links for parent in _coordinate_parents(link, tree)], dtype=np.int64),
        joint=np.array([kind for link in links for kind in SINGLE[link.joint]], dtype=np.int64),
        origin=spread((turns @ given["origin"][..., None])[..., 0], 1, is_first),
        rotation=spread(turns @ roll_pitch_yaw(angles), 2, is_first, np.eye(3)),
        axis=axis,
        mass=spread(given["mass"], 0, is_body),
        center_of_mass=spread(given["center_of_mass"], 1, is_body),
        inertia=spread(_inertia(links, given, axis[..., is_body, :]), 2, is_body),
        tip=spread(given["tip"], 1, is_body),
        lower=lower if limited else None,
        upper=upper if limited else None,
        joint_stiffness=_joint_numbers(tree, "stiffness", "Nm_per_rad", "N_per_m"),
        joint_damping=_joint_numbers(tree, "damping", "Nms_per_rad", "Ns_per_m"),
        joint_coulomb=_joint_numbers(tree, "coulomb", "Nm", "N"),
    )


def _link_columns(links: Sequence[LinkSection], tree: Tree) -> dict[str, list[Any]]:
    """Field -> numbers of all links in their order, nan where a body's are not given; "axis" has one of each joint
    coordinate. Of a link of which one moment of inertia is known, "moment" has this, and "inertia" is nan."""
    bodies = [_body(link) for link in links]
    return {
        "origin": [tree.tips[link.parent] if link.origin_m is None else link.origin_m for link in links],
        "angles": [link.orientation_rad for link in links],
        "axis": [axis for link in links for axis in _axes(link)],
        "tip": [tree.tips[link.name] for link in links],
        "mass": [mass for mass, _, _ in bodies],
        "center_of_mass": [center for _, center, _ in bodies],
        "inertia": [UNKNOWN_INERTIA if _has_one_moment(link) else bodies[i][2] for i, link in enumerate(links)],
        "moment": [bodies[i][2][0][0] if _has_one_moment(link) else math.nan for i, link in enumerate(links)],
    }


def _body(link: LinkSection) -> tuple[Any, Any, Any]:
    """Mass [kg], centre of mass (3,) [m] and inertia [kg m²] of a link, (3, 3) or the one moment (1, 1) that is
    given of it; nan where not known."""
    if link.beam is not None and link.mass_kg is None:
        mass, center, moments = own_body(link.beam, link.length_m)
        return mass, center.tolist(), moments.tolist()
    inertia = UNKNOWN_INERTIA if link.inertia_kg_m2 is None else link.inertia_kg_m2
    return value_or(link.mass_kg, math.nan), in_space(link.center_of_mass_m), inertia


def _has_one_moment(link: LinkSection) -> bool:
    """Whether of a link's inertia only the moment about the joint's axis is given."""
    return link.inertia_kg_m2 is not None and len(link.inertia_kg_m2) == 1


def _inertia(links: Sequence[LinkSection], given: Mapping[str, Floats], axis: Floats) -> Floats:
    """Inertia (..., links, 3, 3) [kg m²]; a single moment I, about the joint's axis a, becomes I a a^T.

    given  columns of `_link_columns` as arrays
    axis   (..., links, 3) unit vector of each link's last joint coordinate
    """
    symmetric = 0.5 * given["inertia"] + 0.5 * np.swapaxes(given["inertia"], -1, -2)
    single = np.array([_has_one_moment(link) for link in links])
    if not single.any():
        return symmetric
    about_axis = given["moment"][..., None, None] * axis[..., :, None] * axis[..., None, :]
    return np.where(single[:, None, None], about_axis, symmetric)


def _coordinate_names(link: LinkSection) -> list[str]:
    """Names of a link's joint coordinates: name/1, name/2, ..., and of the last, its body, the link's own."""
    return [*(f"{link.name}/{k}" for k in range(1, joint_entries(link.joint))), link.name]


def _coordinate_parents(link: LinkSection, tree: Tree) -> list[int]:
    """Parent of each joint coordinate of a link, as its index: of the first the body of the parent link, -1 for
    the base; of others the coordinate before."""
    return [tree.last[link.parent], *range(tree.first[link.name], tree.last[link.name])]


def _joint_limits(link: LinkSection, table: RatioTable | None) -> tuple[float, ...]:
    """Lower and upper limit of a link's joint [rad] or [m]; where it has none, the ends of the ratio table of its
    drive, or else infinite ones."""
    ends = (-math.inf, math.inf) if table is None else (table.coordinate[0], table.coordinate[-1])
    return link.limits_rad or link.limits_m or ends


def _joint_numbers(tree: Tree, what: str, turning: str, sliding: str) -> Floats | None:
    """One number of each joint coordinate, (..., n); 0 where a joint does not have it, None if none has it.

    what              "stiffness", "damping" or "coulomb", in the keys joint_WHAT_UNIT
    turning, sliding  the unit in the keys of joints that turn, and of those that slide
    """
    rows: list[Any] = []
    for member in tree.members:
        keys = {PRISMATIC: f"joint_{what}_{sliding}"}
        for kind in SINGLE[member.entry.joint]:
            value = getattr(member.entry, keys.get(kind, f"joint_{what}_{turning}"))
            rows.append(0.0 if value is None or kind == FIXED else value)
    return stack_numbers(rows) if any(np.any(row) for row in rows) else None


def _axes(link: LinkSection) -> list[Any]:
    """Axis (3,) of each joint coordinate of a link, of any length, in the link's frame."""
    if link.joint == "universal":
        return [link.axis, Y if link.second_axis is None else link.second_axis]
    return {"spherical": [X, Y, Z], "free": [X, Y, Z, X, Y, Z]}.get(link.joint, [link.axis])


def _unit_vectors(vectors: Floats) -> Floats:
    """Vectors (..., 3) at unit length."""
    scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)  # lengths of 1e-300 have a direction, too
    return np.asarray(scaled / np.linalg.norm(scaled, axis=-1, keepdims=True))


def _closures(loops: Sequence[LegMember], tree: Tree) -> Closures:
    """The k loop closures of a mechanism: the links that meet and the points in their frames; where some closures
    hold axes or a frame also the kind of each, unit axes and relative rotations."""
    entries: list[LoopClosure] = [member.entry for member in loops]
    kind = np.array([CLOSES[loop.closes] for loop in entries], dtype=np.int64)
    columns: dict[str, list[Any]] = {
        "points": [list(loop.points_m or [tree.tips[name] for name in loop.links]) for loop in entries]
    }
    if kind.any():
        columns["axes"] = [list(loop.axes or (Z, Z)) for loop in entries]
        columns["angles"] = [loop.orientation_rad or in_space(()) for loop in entries]
    given = stack_columns(columns)
    # (k, 2, 3, 3): vectors in frames that are shared turn with the copy of a leg
    turns = np.array([[member.turn_of(name) for name in member.entry.links] for member in loops])
    points = (turns @ given["points"][..., None])[..., 0] if loops else np.zeros((0, 2, 3))
    closures = Closures(
        names=tuple(loop.name for loop in entries),
        a=np.array([tree.last[loop.links[0]] for loop in entries], dtype=np.int64),
        b=np.array([tree.last[loop.links[1]] for loop in entries], dtype=np.int64),
        point_a=points[..., 0, :],
        point_b=points[..., 1, :],
    )
    if not kind.any():
        return closures
    axes = (turns @ _unit_vectors(given["axes"])[..., None])[..., 0]
    # the second link's axes in the frame of the first, in each of which the copy of a leg is turned
    rotation = turns[:, 0] @ roll_pitch_yaw(given["angles"]) @ np.swapaxes(turns[:, 1], -1, -2)
    return replace(closures, kind=kind, axis_a=axes[..., 0, :], axis_b=axes[..., 1, :], rotation=rotation)


def _assembly_coordinates(section: MechanismSection, assembly: AssemblySection, tree: Tree) -> list[Any]:
    """Approximate joint coordinates (n,) of an assembly [rad], [m]; 0 where it gives none."""
    angles, ways = of_copies(section, assembly.joints_rad), of_copies(section, assembly.joints_m)
    rows: list[Any] = []
    for member in tree.members:
        link, way = member.entry, ways.get(member.entry.name, 0.0)
        given = way if link.joint == "prismatic" else angles.get(link.name, 0.0)
        if link.joint == "free":
            rows += _as_list(way, 3) + _as_list(given, 3)
        else:
            rows += _as_list(given, joint_entries(link.joint))
    return rows


def _as_list(value: Any, count: int) -> list[Any]:
    """A value as a list of `count` numbers: a single number is repeated."""
    return list(value) if isinstance(value, tuple) else [value] * count


def _free_coordinates(tree: Tree, loops: Sequence[LegMember]) -> tuple[int, ...]:
    """Indices of the joint coordinates that are free: all of a free joint, but of a spherical one in a loop the
    turn about x alone."""
    in_loops = _links_in_loops(tree, loops)
    free: list[int] = []
    for member in tree.members:
        link = member.entry
        if link.free:
            first_alone = link.joint == "spherical" and link.name in in_loops
            free += range(
                tree.first[link.name], tree.first[link.name] + 1 if first_alone else tree.last[link.name] + 1
            )
    return tuple(free)


def _links_in_loops(tree: Tree, loops: Sequence[LegMember]) -> set[str]:
    """Names of the links whose joint is part of a closed chain: those on one only of the ways from a loop's two
    links to the base."""
    parent = {member.entry.name: member.entry.parent for member in tree.members}
    found: set[str] = set()
    for member in loops:
        first_way, second_way = (_way_to_base(name, parent) for name in member.entry.links)
        found |= set(first_way) ^ set(second_way)
    return found


def _way_to_base(name: str, parent: dict[str, str]) -> list[str]:
    """Names of a link and of those that carry it, down to the base, which is left out."""
    way = []
    while name != "base":
        way.append(name)
        name = parent[name]
    return way


DRIVE_NUMBERS: Final = {
    "motor_inertia": ("motor_inertia_kg_m2", math.nan),
    "transmission": ("transmission_ratio", math.nan),
    "stiffness": ("stiffness_Nm_per_rad", math.inf),
    "damping": ("damping_Nms_per_rad", 0.0),
    "torque_constant": ("torque_constant_Nm_per_A", math.nan),
    "torque_limit": ("torque_limit_Nm", math.inf),
    "encoder_counts": ("encoder_counts_per_rev", math.nan),
    "continuous_torque": ("continuous_torque_Nm", math.nan),
    "winding_resistance": ("winding_resistance_ohm", math.nan),
}
"""Field of `Drives` -> key of a drive, and the number of one that leaves it out."""


def _drives(
    drives: Sequence[DriveSection], section: MechanismSection, tree: Tree, tables: Mapping[str, RatioTable]
) -> Drives:
    """The drives of a mechanism, with friction, windings, couplings to other joints and the given ratio tables."""
    index = tree.last
    windings = [_winding(drive) for drive in drives]
    columns = {
        **drive_columns(drives, DRIVE_NUMBERS),
        "winding_damping": [damping for damping, _ in windings],
        "winding_time_constant": [lag for _, lag in windings],
    }
    numbers: dict[str, Any] = stack_columns(columns)
    return Drives(
        names=tuple(drive.name for drive in drives),
        joint=np.array([index[drive.joint] for drive in drives], dtype=np.int64),
        nonlinearity=drive_nonlinearity(drives, section.friction),
        coupling=_coupling(drives, index),
        motor_link=_motor_links(drives, index),
        motor_axis=_motor_axes(drives),
        ratio_tables=tuple(tables.get(drive.joint) for drive in drives) if tables else None,
        **numbers,
    )


def _ratio_table(drive: DriveSection) -> RatioTable:
    """The ratio table of a drive that has one: its ratio over the joint's coordinate [rad] or [m]."""
    given = drive.ratio_table
    assert given is not None
    coordinate = given.joint_m if given.joint_rad is None else given.joint_rad
    return RatioTable(np.array(coordinate), stack_numbers(given.ratio), turns=given.joint_rad is not None)


def _coupling(drives: Sequence[DriveSection], index: dict[str, int]) -> Floats | None:
    """Turns of each motor per turn of other joints over its own ratio, (..., d, n); None where no drive has any.

    index  of each link's body by name
    """
    if not any(drive.coupling for drive in drives):
        return None
    rows = []
    for drive in drives:
        row: list[Any] = [0.0] * max(index.values()) + [0.0]  # n = largest index + 1
        for name, ratio in drive.coupling.items():
            row[index[name]] = ratio / value_or(drive.transmission_ratio, math.nan)
        rows.append(row)
    return stack_numbers(rows)


def _motor_links(drives: Sequence[DriveSection], index: dict[str, int]) -> Ints | None:
    """Index of the link that carries each motor (d,), -1 for the base; None where no drive names one."""
    if all(drive.motor_link is None for drive in drives):
        return None
    return np.array([index[drive.motor_link or "base"] for drive in drives], dtype=np.int64)


def _motor_axes(drives: Sequence[DriveSection]) -> Floats | None:
    """Unit axes of the rotors in the frames of the links that carry them, (..., d, 3), zeros for a drive that
    gives none; None where no drive gives one."""
    if all(drive.motor_axis is None for drive in drives):
        return None
    known = np.array([drive.motor_axis is not None for drive in drives])
    axes = np.array([drive.motor_axis or X for drive in drives], dtype=np.float64)
    return np.where(known[:, None], _unit_vectors(axes), 0.0)


def _winding(drive: DriveSection) -> tuple[float, float]:
    """Damping k^2/R [N m s/rad] and lag L/R [s] at the motor of a winding closed through a resistor; 0 and 0 of
    one that is not closed."""
    if drive.damping_resistance_ohm is None:
        return 0.0, 0.0
    keys = drive.winding_resistance_ohm, drive.torque_constant_Nm_per_A, drive.winding_inductance_H
    inside, constant, inductance = (value_or(one, 0.0) for one in keys)
    R = inside + drive.damping_resistance_ohm
    return constant**2 / R, inductance / R


MODES, ELEMENTS = 2, 8  # where none are given


def with_beams(mechanism: Mechanism, links: dict[int, LinkSection], axes: dict[int, Floats]) -> Mechanism:
    """A mechanism with the links that bend.

    links  index of a body -> its link, of those with a [beam]
    axes   index of a body -> unit axis (3,), of those whose inertia is known about this axis alone
    Raises BeamError  for a beam that its link cannot be
    """
    flexible = [_flexible_link(mechanism, index, link, axes.get(index)) for index, link in links.items()]
    return replace(mechanism, flexible=tuple(flexible))


def _flexible_link(mechanism: Mechanism, index: int, link: LinkSection, axis: Floats | None) -> FlexibleLink:
    """The flexible link of a [beam]: the link of that `index` bends as finite elements or modes say.

    axis  (3,) about which alone the link's inertia is known; None: it is known whole
    """
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
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m²] of a link, `length` long [m], that is
    its beam alone."""
    beam = properties_of(section, length)
    mass = beam.mass_per_length * length
    inertia = np.diag(
        [beam.torsional_inertia_per_length * length, mass * length**2 / 12.0, mass * length**2 / 12.0]
    )
    return mass, np.array([length / 2.0, 0.0, 0.0]), inertia


def properties_of(section: BeamSection, length: float) -> BeamProperties:
    """The beam of a [beam], `length` long [m]."""
    if section.section is not None:
        return beam_properties(length, _cross_section(section), _material(section))
    bending = np.broadcast_to(np.asarray(section.bending_stiffness_Nm2, dtype=np.float64), (2,))
    # all are there: the rules refuse a beam without a section that lacks one
    other_numbers = (
        section.torsion_stiffness_Nm2,
        section.axial_stiffness_N,
        section.mass_per_length_kg_per_m,
        section.torsional_inertia_per_length_kg_m,
    )
    return BeamProperties(length, *(float(number) for number in (*bending, *other_numbers) if number is not None))


def _cross_section(beam: BeamSection) -> CrossSection:
    """The cross section of a beam, by the one shape that its table gives."""
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
    """The material of a beam: by its own numbers, or the typical one of that name."""
    if isinstance(beam.material, MaterialSection):
        own = beam.material
        return Material(own.youngs_modulus_Pa, own.shear_modulus_Pa, own.density_kg_per_m3)
    assert beam.material is not None
    return typical_material(beam.material)
