"""What a robot file leaves open: which joints are driven and free, how joints are written, where the handle is.

What can move in a mechanism: which joints are driven, which are free, and what of the handle the drives
control.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from zwidth.arrays import Floats
from zwidth.device.build_mechanism import mechanism as build_mechanism
from zwidth.device.faults import Fault, comma_list, dotted, fail, suggestion
from zwidth.device.mechanism_check import CLOSED, INDEPENDENT, close_loops, closed_nearby, null_space
from zwidth.device.robot_files.followers import settle_followers, write_linkages
from zwidth.device.robot_files.links import (
    LinkTree,
    Shape,
    closure_tables,
    link_tree,
    merge_universal,
    moving_bodies,
    section_of,
)
from zwidth.device.robot_files.robot import BASE, UNMOVED, Motor, Place, Robot
from zwidth.device.schema.mechanism import MechanismSection
from zwidth.device.validation_messages import validation_messages
from zwidth.errors import DeviceError
from zwidth.model.handle_position import constraints, handle_goal
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, pack

HANDLE_WORDS: Final = re.compile(
    r"handle|grip|tool|tcp|eef|end.?effector|attachment|stylus|pen|tip", re.IGNORECASE
)
MOST_COORDINATES: Final = 200
MOVES: Final = 1e-6  # part of a motion from which a joint takes part in it


@dataclass(frozen=True)
class Choices:
    """What the user says of a file.

    handle    name of the site or body that is the handle; None: to be found
    controls  "position", "orientation" or "pose"; None: the least that determines the drives
    fixed     names of joints, or of bodies with their joints, that are held where they stand
    """

    handle: str | None = None
    controls: str | None = None
    fixed: tuple[str, ...] = ()


@dataclass
class Decided:
    """A robot with all decisions made.

    tree, motions  of the final links;   motors  of the joints that are driven;   shape  what was decided of bodies
    handle         body and place;   controls  of it;   assumed  whether the driven joints are not of the file
    columns        (6, d) motions of the handle by the drives at the reference posture
    """

    tree: LinkTree
    motions: FreeMotions
    motors: list[Motor]
    shape: Shape
    handle: tuple[int, Place]
    controls: str
    columns: Floats
    assumed: bool = False
    closures: list[dict[str, Any]] = field(default_factory=list)


def decide(robot: Robot, choices: Choices) -> Decided:
    """Make all decisions that a device file needs.

    Joints of several coordinates that are free in part are split, after which all is asked anew.
    Raises DeviceError  with what cannot be decided, or cannot be written
    """
    settle_followers(robot)
    fixed = _held_joints(robot, choices.fixed)
    handle = find_handle(robot, choices.handle)
    if handle[0] not in moving_bodies(robot, fixed):
        raise fail(robot.label, f"'{choices.handle or 'handle'}'", f"does not move; {_handle_hint(robot)}")
    if sum(len(body.joints) for body in robot.bodies) > MOST_COORDINATES:
        raise fail(robot.label, "", f"has more than {MOST_COORDINATES} joints, more than a device file is for")
    write_linkages(robot)
    motors = _moving_motors(robot, fixed)
    shape = Shape(fixed=fixed)
    _leave_out_fixed_loops(robot, shape)
    merge_universal(robot, {joint for motor in motors or () for joint in motor.turns} | fixed)
    for _ in range(len(robot.bodies) + 2):
        tree, motions = _draft(robot, shape, handle)
        _refuse_open_loops(robot, motions)
        driven = motors if motors is not None else _assumed_motors(robot, tree, motions)
        # of each drive's joint its coordinate, and of these the ones that the loops leave independent
        rows = [motions.rows(tree.link_of[motor.joint])[0] for motor in driven]
        kept = [rows[k] for k in independent(motions.basis, [[row] for row in rows])]
        changed = _with_free_joints(robot, tree, motions, shape, kept, {motor.joint for motor in driven})
        if changed == shape:
            break
        shape = changed
    controls, columns = _controls(robot, tree, motions, driven, kept, shape, choices.controls)
    return Decided(
        tree, motions, driven, shape, handle, controls, columns, motors is None, closure_tables(robot, tree)
    )


def _held_joints(robot: Robot, names: Sequence[str]) -> frozenset[str]:
    """Names of the joints that are held: those named, those of bodies named, and those that follow a held joint or
    that a held follower determines. Followers that are held are removed from the robot. Raises DeviceError for
    other names."""
    joints, bodies = robot.joints, {body.name: body for body in robot.bodies if body.joints}
    faults, held = [], set()
    for name in names:
        if name in joints:
            held.add(name)
        elif name in bodies:
            held |= {joint.name for joint in bodies[name].joints}
        else:
            known = {*joints, *bodies}
            faults.append(Fault(robot.label, "fix", f"'{name}' is no joint; {suggestion(name, known, 'joints')}"))
    if faults:
        raise DeviceError(faults)
    followers = list(robot.followers)
    for _ in range(len(followers) + 1):  # one that becomes held may hold others
        for follower in followers:
            if not follower.leader or follower.leader in held or (follower.ratio and follower.joint in held):
                held |= {follower.joint, follower.leader} - {""}
    for follower in followers:
        if not follower.leader:
            robot.note(follower.where, f"holds '{follower.joint}' where it stands; it is written as fixed")
    robot.followers = [follower for follower in followers if follower.joint not in held]
    return frozenset(held)


def find_handle(robot: Robot, name: str | None) -> tuple[int, Place]:
    """Body index and place in that body of the handle. Raises DeviceError where it cannot be told.

    name  of a site or body; None: the only one called so (`HANDLE_WORDS`), or the only body that carries none
    """
    sites = {site.name: (site.body, site.place) for site in robot.sites}
    bodies = {body.name: (i, UNMOVED) for i, body in enumerate(robot.bodies) if i != BASE}
    if name is not None:
        if name in sites or name in bodies:
            return sites[name] if name in sites else bodies[name]
        near = suggestion(name, {*sites, *bodies}, "sites and bodies")
        raise fail(robot.label, "handle", f"'{name}' is neither a site nor a body of the file; {near}")
    named = [one for one in sites if HANDLE_WORDS.search(one)]
    named = named if len(named) == 1 else [one for one in (*sites, *bodies) if HANDLE_WORDS.search(one)]
    leaves = [
        body.name for i, body in enumerate(robot.bodies) if i and all(one.parent != i for one in robot.bodies)
    ]
    found = named if len(named) == 1 else leaves if len(leaves) == 1 else []
    if not found:
        raise fail(robot.label, "", f"does not say which site or body is the handle; {_handle_hint(robot)}")
    robot.note("mechanism.handle", f"is taken to be '{found[0]}'; name another with handle=NAME")
    return sites.get(found[0]) or bodies[found[0]]


def _handle_hint(robot: Robot) -> str:
    """A hint of how to name the handle: the sites and bodies that it may be."""
    sites = [site.name for site in robot.sites]
    bodies = [body.name for body in robot.bodies[1:]][::-1]
    listed_sites = f"sites: {comma_list(sites, 8)}; " if sites else ""
    return f"name it with handle=NAME; {listed_sites}bodies: {comma_list(bodies, 8)}"


def _moving_motors(robot: Robot, fixed: frozenset[str]) -> list[Motor] | None:
    """The motors of a robot without joints that are held; None where the file names no motors. A motor whose own
    joint is held drives, of the others that turn it, the one with the largest ratio."""
    if robot.motors is None:
        return None
    kept = []
    for motor in robot.motors:
        turns = {joint: turn for joint, turn in motor.turns.items() if joint not in fixed}
        if motor.joint in fixed and not turns:
            robot.note(f"actuator '{motor.name}'", "drives a joint that is held; it is left out")
            continue
        joint = motor.joint if motor.joint not in fixed else max(turns, key=lambda name: abs(turns[name]))
        kept.append(replace(motor, joint=joint, turns=turns))
    return kept


def _draft(robot: Robot, shape: Shape, handle: tuple[int, Place]) -> tuple[LinkTree, FreeMotions]:
    """The tree of links with a shape (which joints are held or split), and the motions that the mechanism has if
    nothing is driven. One drive is put in, without which the table [mechanism] would not be valid."""
    tree = link_tree(robot, shape)
    any_joint = next((link["name"] for link in tree.links if link["joint"] in ("revolute", "prismatic")), None)
    if any_joint is None:
        raise fail(robot.label, "", "has no joint that turns about one axis or slides, which a drive needs")
    links = [{key: value for key, value in link.items() if key != "free"} for link in tree.links]
    section = section_of(robot, tree, handle, "pose", [{"name": "drive", "joint": any_joint}]) | {"links": links}
    return tree, mechanism_motions(section, robot.label)


def _leave_out_fixed_loops(robot: Robot, shape: Shape) -> None:
    """Remove from the robot the loop closures that join two bodies of one link."""
    frames = link_tree(robot, shape).frames
    for closure in list(robot.closures):
        a, b = closure.bodies
        if frames[a][0] == frames[b][0]:
            robot.note(f"loop '{closure.name}'", "joins two bodies that are fixed to each other; it is left out")
            robot.closures.remove(closure)


def _refuse_open_loops(robot: Robot, motions: FreeMotions) -> None:
    """Raise DeviceError for the loops that do not close at the reference posture, with the gap of each [m]."""
    if not motions.open_loops:
        return
    faults = []
    for k in motions.open_loops:
        closure = robot.closures[k]
        a, b = (robot.bodies[i].name for i in closure.bodies)
        faults.append(
            Fault(
                robot.label,
                f"loop '{closure.name}'",
                f"closes nowhere: its two {closure.closes}s, on '{a}' and '{b}', stay at least "
                f"{motions.gaps[k]:.3g} m apart; check anchors, lengths and axes",
            )
        )
    raise DeviceError(faults)


def _assumed_motors(robot: Robot, tree: LinkTree, motions: FreeMotions) -> list[Motor]:
    """Motors of joints taken to be driven where the file names none: base first, as many as there are independent
    motions. Joints that follow others are left out."""
    followers = {follower.joint for follower in robot.followers}
    singles = [
        name
        for name, (_, joint) in robot.joints.items()
        if joint.single and name in tree.link_of and name not in followers
    ]
    groups = [motions.rows(tree.link_of[name]) for name in singles]
    return [Motor(singles[k], singles[k]) for k in independent(motions.basis, groups)]


def _with_free_joints(
    robot: Robot, tree: LinkTree, motions: FreeMotions, shape: Shape, driven: list[int], drives: set[str]
) -> Shape:
    """The shape with every motion that drives and loops leave given to a free joint.

    Where a joint of several coordinates is neither free nor determined as a whole, it is split, and all is asked
    anew.
    driven  coordinates of the drives, rows of the free motions;   drives  names of the joints that these are
    """
    # (m, f) motions in which the drives rest; each round gives some of them to one joint, until none is left
    left = left_over(motions.basis, driven)
    free: set[str] = set()
    turned = dict(shape.turned)
    looped = _bodies_in_loops(robot)
    joints = {
        name: (body, joint)
        for name, (body, joint) in robot.joints.items()
        if name in tree.link_of and name not in drives
    }
    # joints, and parts of split ones, in order and each once
    names = {**{name: name for name in joints}, **{name: name for name in tree.link_of if name not in drives}}
    while left.shape[1]:
        largest = {
            name: _largest_motion(left, motions.rows(tree.link_of[name])) for name in names if name not in free
        }
        free_as_a_whole = [
            name
            for name, (body, joint) in joints.items()
            if name not in free
            and not joint.single
            and body not in looped
            and independent(left, [motions.rows(tree.link_of[name])])
        ]
        spinning = next(
            (name for name in joints if name not in free and _spins(motions, tree, joints, name, left)), None
        )
        singles = [
            name for name in largest if len(motions.rows(tree.link_of[name])) == 1 and largest[name] > MOVES
        ]
        if free_as_a_whole:
            free.add(free_as_a_whole[0])
            left = left_over(left, motions.rows(tree.link_of[free_as_a_whole[0]]))
        elif spinning:
            body, rows = joints[spinning][0], motions.rows(tree.link_of[spinning])
            axis = _only_direction(left[rows])
            if body not in turned:  # the free coordinate of a ball joint is the turn about the link's x axis
                turned[body] = tuple(map(tuple, _axes_along(axis).tolist()))
            free.add(spinning)
            left = _motions_without(left, np.asarray(axis @ left[rows]))
        elif singles:
            # rather one with a spring, which needs no drive to rest, than one without
            sprung = [name for name in singles if name in joints and joints[name][1].stiffness > 0.0]
            chosen = max(sprung or singles, key=lambda name: largest[name])
            free.add(chosen)
            left = left_over(left, motions.rows(tree.link_of[chosen]))
        else:
            name = max(largest, key=lambda name: largest[name])
            return replace(shape, split=shape.split | {name})
    return replace(shape, free=frozenset(free), turned=turned)


def _largest_motion(left: Floats, rows: Sequence[int]) -> float:
    """Largest part that coordinates of these rows have in motions `left` (m, f)."""
    return float(np.abs(left[list(rows)]).max(initial=0.0))


def _bodies_in_loops(robot: Robot) -> set[int]:
    """Indices of the bodies in loops: those on one only of the ways from a closure's two bodies to the base."""
    found: set[int] = set()
    for closure in robot.closures:
        first_way, second_way = (robot.way_to_base(body) for body in closure.bodies)
        found |= set(first_way) ^ set(second_way)
    return found


def _spins(motions: FreeMotions, tree: LinkTree, joints: dict[str, Any], name: str, left: Floats) -> bool:
    """Whether a ball joint in a loop turns about one axis of its body while all joints of one coordinate rest.

    joints  name -> body index and joint;   left  (m, f) motions in which the drives rest
    """
    if joints[name][1].kind != "spherical" or name not in tree.link_of:
        return False
    # rows of all joints of one coordinate; entries of others are link/1, link/2, ..., link
    resting = [row for row, entry in enumerate(motions.entries) if len(motions.rows(entry.partition("/")[0])) == 1]
    turning = left_over(left, resting)
    if not turning.shape[1]:
        return False
    values = np.linalg.svd(turning[motions.rows(tree.link_of[name])], compute_uv=False)
    # the second is 0: all turns that remain are about one axis
    return bool(values[0] > MOVES and (len(values) == 1 or values[1] <= MOVES * values[0]))


def _only_direction(rows: Floats) -> Floats:
    """Unit axis (3,) about which a ball joint turns most, from its rows (3, f) of the free motions."""
    return np.asarray(np.linalg.svd(rows)[0][:, 0])


def _motions_without(left: Floats, row: Floats) -> Floats:
    """The motions (m, f - 1), of `left` (m, f), in which their combination `row` (f,) is 0."""
    _, _, right_vectors = np.linalg.svd(row[None])
    return np.asarray(left @ right_vectors[1:].T)


def _axes_along(axis: Floats) -> Floats:
    """Rotation (3, 3) whose first column is along an axis, in the sense that makes its largest component
    positive."""
    x = axis if axis[np.argmax(np.abs(axis))] > 0.0 else -axis
    x = np.where(np.abs(x) < 1e-12, 0.0, x)
    x = x / np.linalg.norm(x)
    y = np.eye(3)[int(np.argmin(np.abs(x)))]
    y = y - x * (x @ y)
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _controls(
    robot: Robot,
    tree: LinkTree,
    motions: FreeMotions,
    driven: list[Motor],
    kept: list[int],
    shape: Shape,
    wanted: str | None,
) -> tuple[str, Floats]:
    """What the drives control of the handle, "position", "orientation" or "pose", and the handle's motions (6, d)
    by them at the reference posture. Raises DeviceError where the handle does not tell the motions of all drives.

    driven  motors;   kept  their coordinates, as far as these are independent
    wanted  what the user says they control; None: the least that tells them
    """
    if not kept:
        raise fail(robot.label, "", _nothing_moves_message(robot, motions))
    free = [row for name in sorted(shape.free) for row in _free_rows(robot, tree, motions, name)]
    # (6, d) at each of several postures: that of the file may be singular
    handle_motions = [free_handle_motions(place, kept, free) for place in motions.places]
    found = [controls for H in handle_motions if (controls := controls_of(H))]
    if not found:
        raise fail(robot.label, "", _not_controlled_message(motions, tree, driven, kept, handle_motions))
    controls = min(found, key=("position", "orientation", "pose").index)
    parts = {"position": slice(0, 3), "orientation": slice(3, 6), "pose": slice(0, 6)}
    if wanted is not None:
        if not any(controlled(H[parts[wanted]]) for H in handle_motions):
            raise fail(
                robot.label, "controls", f"cannot be {wanted}: it leaves drives open; it can be {controls} or pose"
            )
        controls = wanted
    if not controlled(handle_motions[0][parts[controls]]):
        robot.warn(
            "mechanism.reference",
            "the posture of the file is singular: its drives cannot move the handle every way. Give another with "
            "posture=JOINT=VALUE or keyframe=NAME",
        )
    return controls, handle_motions[0]


def _nothing_moves_message(robot: Robot, motions: FreeMotions) -> str:
    """The message for drives that move no joint, or for loops that leave no freedom."""
    if motions.basis.shape[1]:
        return "drives no joint that moves; name a motor for each degree of freedom"
    names = comma_list([f"'{closure.name}'" for closure in robot.closures], 6)
    return (
        f"has loops that hold everything: {len(motions.entries)} joint coordinates, all of them held by {names}; "
        "leave one out, or let one hold less (a point by connect, not a whole body by weld)"
    )


def _free_rows(robot: Robot, tree: LinkTree, motions: FreeMotions, name: str) -> list[int]:
    """Coordinates of a free joint, as rows of the motions; of a ball joint in a loop only the first, the turn
    about x."""
    rows = motions.rows(tree.link_of[name])
    found = robot.joints.get(name)
    spins = found is not None and found[1].kind == "spherical" and found[0] in _bodies_in_loops(robot)
    return rows[:1] if spins else rows


def _not_controlled_message(
    motions: FreeMotions, tree: LinkTree, driven: list[Motor], kept: list[int], handle_motions: list[Floats]
) -> str:
    """The message for drives whose motions the handle does not tell: which of them do not move it, or how many are
    too many.

    kept            coordinates of the drives that are independent, rows of the motions
    handle_motions  (6, d) motions of the handle by these, at several postures
    """
    motors = {motions.rows(tree.link_of[motor.joint])[0]: motor for motor in driven}
    resting = set.intersection(*(set(idle_drives(H)) for H in handle_motions))
    idle = [motors[kept[drive]].joint for drive in sorted(resting)]
    if idle:
        return (
            f"drives {comma_list(idle, 12)}, which do not move the handle; hold them still with "
            f"fix={','.join(idle[:12])}, or name another handle with handle=NAME"
        )
    rank = max(int(np.linalg.matrix_rank(H, tol=1e-6 * max(np.abs(H).max(), 1e-300))) for H in handle_motions)
    joints = [motors[row].joint for row in kept]
    return (
        f"has {len(kept)} drives, {comma_list(joints, 12)}, that move the handle in {rank} ways: a posture is "
        f"asked by the handle, which must tell all of them. Hold {len(kept) - rank} of them still with "
        f"fix={joints[-1]} or another"
    )


REGULAR: Final = 1e-6  # least singular value over the largest, of a handle that its drives control
NEGLIGIBLE: Final = 1e-9  # share of a handle's largest motion, below which a joint does not move it


@dataclass(frozen=True)
class Configuration:
    """The motions of a mechanism where it stands with its loops closed, m coordinates in the order of
    `MechanismArrays.joint`.

    basis    (m, f) what the loops leave, scaled to [rad] and sizes of the mechanism
    handle   (6, m) motions of the handle by each coordinate: its position, then its turning, scaled alike
    """

    basis: Floats
    handle: Floats


@dataclass(frozen=True)
class FreeMotions:
    """What a mechanism can do.

    entries  name of what each of the m joint coordinates moves: its link's, of a joint of several coordinates with
             a number behind it for all but the last
    places   the reference posture, then postures nearby: the reference may be special
    angles   (n,) joint coordinates with closed loops;   gaps  (k,) that remain [m];   size  of the mechanism [m]
    goal     (6,) position of the handle [m], rotation vector of its axes [rad]
    """

    mechanism: Mechanism
    entries: list[str]
    places: list[Configuration]
    angles: Floats
    gaps: Floats
    size: float
    goal: Floats

    @property
    def basis(self) -> Floats:
        """The motions (m, f) where the loops leave the fewest."""
        return min((place.basis for place in self.places), key=lambda basis: basis.shape[1])

    def rows(self, link: str) -> list[int]:
        """Indices of the joint coordinates of a link's joint, in their order within the joint."""
        # at most six coordinates, of which the last is named as the link
        own = {link, *(f"{link}/{k}" for k in range(1, 6))}
        return sorted(
            (row for row, name in enumerate(self.entries) if name in own), key=lambda row: self.order[row]
        )

    @property
    def order(self) -> list[int]:
        """Of each coordinate its number within its joint, from 1; the last, named as the link, counts as 6."""
        numbers = (name.partition("/")[2] for name in self.entries)
        return [int(number) if number else 6 for number in numbers]

    @property
    def open_loops(self) -> list[int]:
        """Indices of the loops that do not close at the reference posture."""
        return [k for k, gap in enumerate(self.gaps) if gap > CLOSED * self.size]


def mechanism_motions(section: dict[str, Any], label: str) -> FreeMotions:
    """The motions of a draft of [mechanism] whose handle is given by its pose, whichever joints the draft says are
    driven or free.

    section  the table [mechanism];   label  the robot's file, for messages
    Raises DeviceError  for numbers that a device file does not allow
    """
    try:
        checked = MechanismSection.model_validate(section)
    except ValidationError as error:
        document = {"mechanism": section}
        faults = [
            Fault(label, dotted(("mechanism", *path), document), message)
            for path, message in validation_messages(error, section)
        ]
        raise DeviceError(faults) from None
    mechanism = build_mechanism(checked)
    mech = pack(mechanism)
    angles, gaps = close_loops(mechanism, mech)
    names = [mechanism.links.names[i] for i in mech.joint]
    places = [_configuration(mech, place) for place in closed_nearby(mech, angles)]
    size = float(mech.size[0])
    return FreeMotions(mechanism, names, places, angles, gaps, size, handle_goal(mech, 0, angles))


def _configuration(mech: MechanismArrays, angles: Floats) -> Configuration:
    """The `Configuration` at joint coordinates (n,) that close all loops."""
    loops = int(mech.first_row[-1])
    # derivative by each coordinate (m, r): of the loops' equations, `loops` in all, then of the handle's six
    rows = constraints(mech, 0, angles, np.zeros(6))[0] * mech.unit[0][:, None]
    return Configuration(null_space(rows[:, :loops].T), np.asarray(rows[:, loops : loops + 6].T))


def independent(basis: Floats, groups: Iterable[Sequence[int]], kept: Sequence[int] = ()) -> list[int]:
    """Indices of the groups of coordinates, rows of the free motions `basis` (m, f), that can move independently
    of the coordinates `kept` and of all groups chosen before."""
    chosen, rows = [], list(kept)
    for index, group in enumerate(groups):
        if _rank(basis[[*rows, *group]]) == len(rows) + len(group):
            chosen.append(index)
            rows += group
    return chosen


def left_over(basis: Floats, rows: Sequence[int]) -> Floats:
    """Combinations (m, f') of the free motions `basis` (m, f) in which the coordinates of these rows rest."""
    if not rows or not basis.size:
        return basis
    _, values, right = np.linalg.svd(basis[list(rows)])
    rank = int(np.sum(values > INDEPENDENT * values[0])) if values.size and values[0] > 0.0 else 0
    return np.asarray(basis @ right[rank:].T)


def _rank(rows: Floats) -> int:
    """Number of independent rows of free motions (k, f), by their singular values."""
    values = np.linalg.svd(rows, compute_uv=False)
    return int(np.sum(values > INDEPENDENT * max(values[0], np.finfo(float).tiny))) if values.size else 0


def free_handle_motions(place: Configuration, driven: Sequence[int], free: Sequence[int]) -> Floats:
    """Motions of the handle by each driven coordinate while the other driven and the free ones rest, (6, d);
    driven and free coordinates as rows of `place.basis`."""
    rows = [*driven, *free]
    # (f, d + free) combinations of the free motions in which one of these coordinates moves and the others rest
    rates = np.linalg.lstsq(place.basis[rows], np.eye(len(rows)), rcond=None)[0]
    return np.asarray(place.handle @ place.basis @ rates)[:, : len(driven)]


def controls_of(H: Floats) -> str | None:
    """The least of the handle whose motions tell those of all drives: "position", "orientation" or "pose"; None:
    some drive moves while the handle rests. H (6, d): motions by each drive, of the position, then the turning."""
    for controls, part in (("position", H[:3]), ("orientation", H[3:]), ("pose", H)):
        if controlled(part):
            return controls
    return None


def controlled(part: Floats) -> bool:
    """Whether motions of the handle by d drives, (r, d), tell how each of the drives moves: whether they are
    independent."""
    values = np.linalg.svd(part, compute_uv=False)
    return len(values) == part.shape[1] and bool(values[-1] > REGULAR * max(values[0], np.finfo(float).tiny))


def idle_drives(H: Floats) -> list[int]:
    """Indices of the drives that do not move the handle, columns of its motions H (6, d)."""
    sizes = np.abs(H).max(axis=0)
    return [
        int(k) for k in np.flatnonzero(sizes <= NEGLIGIBLE * max(sizes.max(initial=0.0), np.finfo(float).tiny))
    ]
