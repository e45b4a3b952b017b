"""The posture of a mechanism from the position of its handle.

Why a mechanism has none, in words. Shapes have the letters of `MechanismArrays`; goals have g numbers (`_goals`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import degrees
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled
from zwidth.errors import BeyondLimit, LoopOpen, OutOfReach, PostureError, Singular
from zwidth.model.argument_checks import check_kind
from zwidth.model.bias import bias_batch
from zwidth.model.continuation import (
    ASSEMBLY_TOLERANCE,
    BEYOND_LIMIT,
    NO_EQUILIBRIUM,
    OK,
    OUT_OF_REACH,
    SINGULAR,
    follow,
    joint_beyond_limit,
    reference_batch,
)
from zwidth.model.design_axes import Change
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.handle_position import (
    answered_goal,
    check_mobility,
    drives_fit,
    goal_difference,
    goal_distance,
    goal_of_angles,
    positions_about_reference,
)
from zwidth.model.mechanism import ORIENTATION, POSE, POSITION, PRISMATIC, Mechanism, RatioTable
from zwidth.model.mechanism_arrays import MechanismArrays, design_of_each, pack, per_design
from zwidth.model.posture_batch import (
    PostureBatch,
    arm_length,
    failed_batch,
    far_outside_shells,
    shells,
    solve_batch,
    solve_from_starts,
)
from zwidth.model.roadmap import roadmap
from zwidth.model.rotations import roll_pitch_yaw_of, rotation_matrix, rotation_vector

__all__ = [
    "BEYOND_LIMIT",
    "NO_EQUILIBRIUM",
    "OK",
    "OUT_OF_REACH",
    "SINGULAR",
    "UNSOLVED",
    "LinkPoints",
    "Posture",
    "handle_motions",
    "handle_range",
    "inertia_terms",
    "join_postures",
    "joint_position",
    "link_points",
    "place_of_joints",
    "reachable_positions",
    "solve_posture",
]

UNSOLVED: Final = 255  # status where no straight way leads: the design is to be asked for alone


@dataclass(frozen=True)
class Posture:
    """A mechanism at rest with its handle somewhere; all arrays carry the batch's leading axes.

    assembly          name of the assembly
    position          (..., 3)     handle [m]; where not OK the requested one
    projected         (...)        distance from the requested position [m]; 0 unless it was projected
    status            (...)        OK, OUT_OF_REACH, SINGULAR, BEYOND_LIMIT or NO_EQUILIBRIUM; where not OK the
                      numbers below are nan
    angles            (..., n)     joint coordinates, 0 for fixed joints [rad], of prismatic joints [m]
    mass_matrix       (..., c, c)  M of the links in the independent coordinates [kg m²]: the driven joints, then
                                   the free ones
    jacobian          (..., 3, c)  J: handle velocity = J p' with the rates p' of these coordinates [m/rad]
    angular_jacobian  (..., 3, c)  the same of the handle's angular velocity [1]
    closure_residual  (...)        largest gap left in any loop [m]; of angles, times the mechanism's size
    rotation          (..., 3, 3)  axes of the handle in the base frame, as `position`; None: not controlled
    asked             the postures that were asked for, of which these are those under load; None: the same
    """

    assembly: str
    position: Floats
    status: NDArray[np.uint8]
    angles: Floats
    mass_matrix: Floats
    jacobian: Floats
    angular_jacobian: Floats
    closure_residual: Floats
    projected: Floats
    rotation: Floats | None = None
    asked: Posture | None = None

    def with_axes(self, change: Change) -> Posture:
        """The postures with a change of the leading axes made to each of their arrays, such as an index."""
        arrays: dict[str, Any] = {name: np.asarray(change(array)) for name, array in _arrays(self).items()}
        asked = None if self.asked is None else self.asked.with_axes(change)
        return Posture(self.assembly, **arrays, asked=asked)

    def broadcast_to(self, shape: tuple[int, ...]) -> Posture:
        """The same postures with these leading axes; itself where it has them. Raises ValueError as numpy does."""
        count = self.status.ndim
        if shape == self.status.shape:
            return self
        # copies: what cannot be written to is another type for the kernels, compiled anew
        return self.with_axes(lambda array: np.array(np.broadcast_to(array, shape + array.shape[count:])))


def _arrays(posture: Posture) -> dict[str, NDArray[Any]]:
    """The arrays of a posture by their names."""
    names = [one.name for one in fields(posture) if one.name not in ("assembly", "asked")]
    values = {name: getattr(posture, name) for name in names}
    return {name: np.asarray(value) for name, value in values.items() if value is not None}


@dataclass(frozen=True)
class LinkPoints:
    """Where the links are in the base frame, for drawing.

    origin    (..., n, 3)     joint origins [m]
    tip       (..., n, 3)     tips [m]
    rotation  (..., n, 3, 3)  link axes, as columns
    """

    origin: Floats
    tip: Floats
    rotation: Floats

    def of(self, link: int, local: ArrayLike) -> Floats:
        """A point (..., 3) of a link's frame, in the base frame [m]."""
        point = np.asarray(local, dtype=np.float64)
        R = self.rotation[..., link, :, :]
        return np.asarray(self.origin[..., link, :] + (R @ point[..., None])[..., 0])


def solve_posture(
    mechanism: Mechanism,
    position: ArrayLike | None = None,
    assembly: str | None = None,
    *,
    orientation: ArrayLike | None = None,
    tolerance: float = 0.0,
    straight: bool = False,
) -> Posture:
    """The posture with the handle at a position, in an orientation, or both, in an assembly (None: the first).

    The assembly's approximate joint coordinates are closed onto the reference; from there Newton is continued to
    the goal without passing a singularity (`continuation`), along the straight way or by the roadmap of all
    postures of the assembly (`roadmap`). A goal that the handle cannot have is projected onto one near it that it
    has (`handle_position`). Free coordinates stay where the assembly has them.

    position  (..., 3), or (..., 2) in the plane of the reference position [m]; it broadcasts with the leading
              axes of the mechanism's numbers. None: the reference's
    orientation  (..., 3, 3)  axes of the handle in the base frame, of a mechanism that controls them. None: the
              reference's
    tolerance how far a goal may be projected, as a share of the arm's length from base to handle
    straight  True, for one goal of each of several designs: take only the straight way from the reference,
              which makes each posture hang on its own design alone, and takes a microsecond. Where there is none,
              the status is OUT_OF_REACH if the handle cannot be there nor where the goal would be projected
              to, and UNSOLVED otherwise
    Returns   Posture; in a batch a goal that cannot be had is marked by its status
    Raises    OutOfReach, Singular, BeyondLimit  where a single posture is requested and does not exist; an
                          assembly may be singular throughout
              LoopOpen    if the loops of a single mechanism do not close near the assembly's angles
              ValueError  for an unknown assembly, an orientation that the mechanism does not control or that is no
                          rotation, or drives that do not fit the mechanism's freedom
    """
    check_kind("mechanism", mechanism, Mechanism)
    name = _assembly_name(mechanism, assembly)
    mech, designs = pack(mechanism), mechanism.design_shape
    goals, shape = _goals_of_designs(mechanism, position, orientation)
    design = design_of_each(mechanism, shape)
    reference, gaps = _references(mechanism, mech, name)
    if not designs:
        _check_loops(mechanism, mech, name, gaps[0])
    closed = gaps.max(axis=1, initial=0.0) <= ASSEMBLY_TOLERANCE * mech.size
    if straight:
        solved = solve_from_starts(mech, design, reference, design, goals)
        missed = np.flatnonzero(~closed[design] | (solved.status != OK))
        solved.overwrite(missed, failed_batch(mech, len(missed), UNSOLVED))
        far = missed[closed[design[missed]] & far_outside_shells(mech, design[missed], goals[missed], tolerance)]
        tried, of_tried = np.unique(design[far], return_inverse=True)
        solved.status[far[drives_fit(mechanism, mech, tried, reference[tried])[of_tried]]] = OUT_OF_REACH
        return _posture_of_batch(name, mech, goals, solved, np.where(solved.status == OK, 0.0, np.nan), shape)
    first = int(np.argmax(closed))
    uncontrolled = check_mobility(mechanism, mech, first, reference[first]) if closed.any() else None
    if uncontrolled and not shape:
        raise singular_throughout(name, uncontrolled)
    singular = uncontrolled and not designs  # of several designs another may be in control
    solved = failed_batch(mech, len(goals)) if singular else solve_batch(mech, design, reference, goals)
    widest = tolerance if tolerance > 0.0 or not shape else None  # of one goal the near one is for its message
    projected, near = _project_goals(mech, design, reference, goals, solved, widest)
    posture = _posture_of_batch(name, mech, goals, solved, projected, shape)
    if not shape and posture.status != OK:
        raise posture_failure(mechanism, mech, int(posture.status), name, reference[0], goals[0], near)
    return posture


def _goals_of_designs(
    mechanism: Mechanism, position: ArrayLike | None, orientation: ArrayLike | None
) -> tuple[Floats, tuple[int, ...]]:
    """Goals (N, g) [m], [rad] of N postures, and the shape of their batch; raises as `_goals`."""
    target = _goals(mechanism, position, orientation)
    shape = np.broadcast_shapes(mechanism.design_shape, target.shape[:-1])
    # a copy that can be written to, as all that is solved for: one that cannot is another type, compiled anew
    goals = np.array(np.broadcast_to(target, (*shape, target.shape[-1])), dtype=np.float64, order="C")
    return goals.reshape(-1, target.shape[-1]), shape


def _project_goals(
    mech: MechanismArrays,
    design: Ints,
    reference: Floats,
    goals: Floats,
    solved: PostureBatch,
    tolerance: float | None,
) -> tuple[Floats, Floats | None]:
    """Replace goals (N, g) out of reach, and their postures `solved`, in place by near ones that can be had.

    design     (N,)  of each goal;   reference  (P, n)  joint coordinates of each design [rad], [m]
    tolerance  how far a goal may be projected, as a share of the arm's length; None: no goal is projected
    Returns    how far each was projected (N,) [m], nan without a posture; the goal (g,) near the last, or None
    """
    near, projected = None, np.where(solved.status == OK, 0.0, np.nan)
    if tolerance is None:
        return projected, near
    for i in np.flatnonzero(solved.status == OUT_OF_REACH):
        near, own_design = answered_goal(mech, int(design[i]), reference, goals[i]), int(design[i])
        if near is None:
            continue
        away = goal_distance(mech, own_design, near, goals[i])
        if away > tolerance * float(arm_length(mech, shells(mech, own_design), own_design)):
            continue
        solved.overwrite(np.array([i]), solve_batch(mech, design[i : i + 1], reference, near[None]))
        goals[i], projected[i] = near, away
    return projected, near


def _posture_of_batch(
    name: str,
    mech: MechanismArrays,
    goals: Floats,
    solved: PostureBatch,
    projected: Floats,
    shape: tuple[int, ...],
) -> Posture:
    """The postures as a `Posture` of a shape (...), from N solved ones, goals (N, g) and projected (N,) [m]."""
    n, c = mech.parent.size, mech.driven + mech.free
    # the position that was requested, to the last digit; of an orientation, where the handle happens to be
    position, rotation = solved.position if mech.controls == ORIENTATION else goals[:, :3], None
    if mech.controls != POSITION:
        rotation = rotation_matrix(goals[:, -3:]).reshape(*shape, 3, 3)
    return Posture(
        assembly=name,
        position=position.reshape(*shape, 3),
        status=solved.status.reshape(shape),
        angles=solved.angles.reshape(*shape, n),
        mass_matrix=solved.mass.reshape(*shape, c, c),
        jacobian=solved.jacobian.reshape(*shape, 3, c),
        angular_jacobian=solved.angular_jacobian.reshape(*shape, 3, c),
        closure_residual=solved.residual.reshape(shape),
        projected=projected.reshape(shape),
        rotation=rotation,
    )


def join_postures(postures: Sequence[Posture]) -> Posture:
    """Postures of several designs, all of one shape (...), as one of shape (P, ...)."""
    each = [_arrays(posture) for posture in postures]
    arrays: dict[str, Any] = {name: np.stack([one[name] for one in each]) for name in each[0]}
    return Posture(postures[0].assembly, **arrays)


def reachable_positions(mechanism: Mechanism, assembly: str | None = None) -> Floats:
    """Handle positions all over what an assembly reaches without passing a singularity, (K, 3) [m].

    The nodes of its roadmap: a few degrees of a drive from one to the next, and as much away from the edge. Where
    the drives control the handle's orientation, too: those reached without turning, and no farther from the
    reference than the mechanism is large.
    Raises    LoopOpen    if the loops do not close near the assembly's angles
              Singular    where the assembly is singular throughout
              ValueError  for an unknown assembly, or a batch of designs
    """
    name = _assembly_name(mechanism, assembly)
    mech, reference = _one_design(mechanism, name, "reachable positions are computed for one design at a time")
    if mech.controls == POSE:
        return positions_about_reference(mech, reference)
    return roadmap(mech, 0, reference).position


def _one_design(mechanism: Mechanism, name: str, otherwise: str) -> tuple[MechanismArrays, Floats]:
    """One design packed, and its reference (n,). Raises as `place_of_joints`, for several designs `otherwise`."""
    if mechanism.design_shape:
        raise ValueError(otherwise)
    mech = pack(mechanism)
    reference, gaps = _references(mechanism, mech, name)
    _check_loops(mechanism, mech, name, gaps[0])
    uncontrolled = check_mobility(mechanism, mech, 0, reference[0])
    if uncontrolled:
        raise singular_throughout(name, uncontrolled)
    return mech, reference[0]


def _has_joint_limits(mech: MechanismArrays) -> bool:
    return bool(np.isfinite(mech.lower).any() or np.isfinite(mech.upper).any())


def place_of_joints(
    mechanism: Mechanism, coordinates: Mapping[str, float], assembly: str | None = None
) -> tuple[Floats, Floats | None]:
    """What `solve_posture` takes for driven joints at given coordinates: the handle's position (3,) [m], zeros
    where drives control its orientation alone, and its axes (3, 3), None where they do not control these.

    coordinates  of every driven joint, by the name of its link [rad], of a prismatic one [m]; turns of 2 pi do not
                 count
    Raises    OutOfReach  where the joints cannot be moved there from the reference without passing a singularity
                          or a limit
              LoopOpen, Singular  as `reachable_positions`
              ValueError  for other joints than the driven ones, an unknown assembly, or a batch of designs
    """
    name = _assembly_name(mechanism, assembly)
    driven = [mechanism.links.names[joint] for joint in mechanism.drives.joint]
    if set(coordinates) != set(driven):
        raise ValueError(
            f"give the angle of every driven joint, {', '.join(driven)}; got {', '.join(coordinates)}"
        )
    mech, reference = _one_design(mechanism, name, "postures are given by their joints for one design at a time")
    goal = goal_of_angles(mech, reference, np.array([coordinates[joint] for joint in driven]))
    if goal is None:
        units = ["m" if mech.kind[joint] == PRISMATIC else "rad" for joint in mechanism.drives.joint]
        requested = ", ".join(
            f"{joint} = {coordinates[joint]:.6g} {unit}" for joint, unit in zip(driven, units, strict=True)
        )
        raise OutOfReach(
            f"the joints cannot be turned to {requested} in assembly {name!r} without passing a singularity"
            f"{' or a limit' if _has_joint_limits(mech) else ''}; ask for angles nearer to those of the reference"
        )
    if mechanism.controls == POSITION:
        return goal, None
    return (np.zeros(3) if mechanism.controls == ORIENTATION else goal[:3]), rotation_matrix(goal[-3:])


def joint_position(mechanism: Mechanism, coordinates: Mapping[str, float], assembly: str | None = None) -> Floats:
    """Position (3,) [m] that `place_of_joints` returns for coordinates of the driven joints, with its errors."""
    return place_of_joints(mechanism, coordinates, assembly)[0]


def handle_motions(posture: Posture) -> Floats:
    """Orthonormal directions (3, r) in which drives and free joints can move the handle at a single posture."""
    left, singular, _ = np.linalg.svd(posture.jacobian, full_matrices=False)
    return np.asarray(left[:, singular > 1e-9 * singular[0]])


def handle_range(mechanism: Mechanism, posture: Posture, direction: ArrayLike) -> tuple[float, float]:
    """How far the handle can be from a posture along a direction, backwards (not positive) and forwards [m].

    Positions between are not checked: the handle need not get there on a straight line. It is right to the spacing
    of the postures of `reachable_positions`.
    posture    a single one, OK
    direction  (3,)  unit vector in the base frame
    Raises     as `reachable_positions`
    """
    offsets = (reachable_positions(mechanism, posture.assembly) - posture.position) @ np.asarray(direction)
    return min(float(offsets.min()), 0.0), max(float(offsets.max()), 0.0)


def inertia_terms(mechanism: Mechanism, posture: Posture, rates: ArrayLike) -> Floats:
    """Velocity-dependent generalised forces of the links, in the independent coordinates [N m].

        M p'' + c(p, p') = Q,    c = B^T (c_q + M_q B' p')             (thesis eq. B.19)

    rates     (..., c)  p' [rad/s] of the driven joints, then of the free ones, broadcasting with the posture
    Returns   (..., c); nan where the posture is not OK
    """
    mech, designs = pack(mechanism), mechanism.design_shape
    given, independent = np.asarray(rates, dtype=np.float64), mech.driven + mech.free
    shape = np.broadcast_shapes(designs, posture.status.shape, given.shape[:-1])
    angles = np.broadcast_to(posture.angles, (*shape, mech.parent.size)).reshape(-1, mech.parent.size)
    flat = np.broadcast_to(given, (*shape, independent)).reshape(-1, independent)
    design = design_of_each(mechanism, shape)
    out = np.empty(flat.shape)
    no_gravity = np.zeros(3)
    bias_batch(mech, design, np.array(angles, order="C"), np.array(flat, order="C"), no_gravity, out)
    return out.reshape(*shape, independent)


def link_points(mechanism: Mechanism, posture: Posture) -> LinkPoints:
    """Origin, tip and axes of every link in the base frame; nan where the posture is not OK."""
    mech, designs = pack(mechanism), mechanism.design_shape
    shape = np.broadcast_shapes(designs, posture.status.shape)
    n = mech.parent.size
    angles = np.array(np.broadcast_to(posture.angles, (*shape, n)).reshape(-1, n), order="C")
    design = design_of_each(mechanism, shape)
    rotation, origin = np.empty((len(design), n, 3, 3)), np.empty((len(design), n, 3))
    _place_batch(mech, design, angles, rotation, origin)
    tip = origin + np.einsum("knij,knj->kni", rotation, per_design(mechanism, mechanism.links.tip, 2)[design])
    return LinkPoints(origin.reshape(*shape, n, 3), tip.reshape(*shape, n, 3), rotation.reshape(*shape, n, 3, 3))


@compiled
def _place_batch(mech: MechanismArrays, design: Ints, angles: Floats, rotation: Floats, origin: Floats) -> None:
    """Fill axes (N, n, 3, 3) and origins (N, n, 3) [m] of the links at joint coordinates (N, n)."""
    work = working_memory(mech)
    for i in range(design.size):
        place_links(mech, design[i], angles[i], work)
        rotation[i] = work.rotation
        origin[i] = work.origin


def _references(mechanism: Mechanism, mech: MechanismArrays, name: str) -> tuple[Floats, Floats]:
    """Reference posture (P, n) of each design, and the gaps (P, k) left in its loops [m]."""
    angles = per_design(mechanism, np.asarray(mechanism.assemblies[name], dtype=np.float64), 1)
    goals = per_design(mechanism, _goals(mechanism, None, None), 1)
    gaps = np.zeros((len(angles), mech.a.size))
    reference_batch(mech, goals, angles, gaps)
    return angles, gaps


def _assembly_name(mechanism: Mechanism, assembly: str | None) -> str:
    """The name of an assembly; None stands for the first one. Raises ValueError for an unknown name."""
    names = list(mechanism.assemblies)
    name = names[0] if assembly is None else assembly
    if name not in mechanism.assemblies:
        raise ValueError(f"the mechanism has no assembly {name!r}; it has {', '.join(map(repr, names))}")
    return name


def _goals(mechanism: Mechanism, position: ArrayLike | None, orientation: ArrayLike | None) -> Floats:
    """Goals (..., g): position [m], vector of the orientation [rad], or both in this order. Raises ValueError."""
    if mechanism.controls == POSITION:
        if orientation is not None:
            raise ValueError("the drives do not control the orientation of the handle; leave orientation out")
        return _in_space(mechanism, position)
    axes = mechanism.reference_rotation if orientation is None else np.asarray(orientation, dtype=np.float64)
    if axes is None:
        raise ValueError("reference_rotation is missing; a mechanism that controls an orientation needs it")
    if axes.shape[-2:] != (3, 3) or not np.allclose(axes @ np.swapaxes(axes, -1, -2), np.eye(3), atol=1e-9):
        raise ValueError(f"orientation must be rotation matrices (..., 3, 3), got an array of shape {axes.shape}")
    turned = rotation_vector(axes)
    if mechanism.controls == ORIENTATION:
        return turned
    place = _in_space(mechanism, position)
    shape = np.broadcast_shapes(place.shape[:-1], turned.shape[:-1])
    return np.concatenate([np.broadcast_to(part, (*shape, 3)) for part in (place, turned)], axis=-1)


def _in_space(mechanism: Mechanism, position: ArrayLike | None) -> Floats:
    """Positions (..., 3) [m], None: the reference's; two coordinates get the third of that. Raises ValueError."""
    if position is None:
        return np.asarray(mechanism.reference_position)
    given = np.asarray(position, dtype=np.float64)
    if given.ndim == 0 or given.shape[-1] not in (2, 3):
        raise ValueError(
            f"a handle position has two or three coordinates in metres, got an array of {given.shape}"
        )
    if given.shape[-1] == 3:
        return given
    height = mechanism.reference_position[..., 2]
    shape = np.broadcast_shapes(given.shape[:-1], height.shape)
    return np.concatenate(
        [np.broadcast_to(given, (*shape, 2)), np.broadcast_to(height, shape)[..., None]], axis=-1
    )


def _check_loops(mechanism: Mechanism, mech: MechanismArrays, name: str, gaps: Floats) -> None:
    """Raise LoopOpen where the largest of the gaps (k,) [m] left in an assembly's loops is more than rounding."""
    if gaps.size and gaps.max() > ASSEMBLY_TOLERANCE * mech.size[0]:
        worst = int(gaps.argmax())
        raise LoopOpen(
            f"loop {mechanism.closures.names[worst]!r} does not close near the joint angles of assembly "
            f"{name!r}: a gap of {gaps[worst]:.3g} m remains; check the lengths of its links and these angles"
        )


ALIKE: Final = 1e-9  # m and degrees that are not worth saying


def singular_throughout(assembly: str, uncontrolled: str) -> Singular:
    """Error for an assembly in which the drives control the handle nowhere, for the reason given."""
    return Singular(
        f"assembly {assembly!r} of the mechanism is singular wherever its handle is: {uncontrolled}; choose "
        "another assembly, or change the places of joints that make it so"
    )


def posture_failure(
    mechanism: Mechanism,
    mech: MechanismArrays,
    status: int,
    assembly: str,
    reference: Floats,
    goal: Floats,
    near: Floats | None,
) -> PostureError:
    """The error that says, by its status, why there is no posture of one design at a goal (g,).

    reference  (n,) joint coordinates;   near  (g,) a goal near it that the handle can have, None where unknown
    """
    what = {POSITION: "position", POSE: "pose", ORIENTATION: "orientation"}[mech.controls]
    where, instead = describe_goal(mech, goal), f"ask for a{'n' * (what[0] == 'o')} {what} nearer to the reference"
    if near is not None:
        instead = f"an answered {what} is {describe_goal(mech, near)}, {_distance(mech, near, goal)} away"
    if status == BEYOND_LIMIT:
        return BeyondLimit(
            f"with its handle at {where} in assembly {assembly!r} {_limit_text(mechanism, mech, reference, goal)}"
        )
    nearest = near if mech.controls == POSITION else None
    if status == OUT_OF_REACH and mech.controls == POSITION and np.array_equal(goal, mechanism.reference_position):
        return OutOfReach(
            f"the handle cannot reach its own reference position {where} in assembly {assembly!r}; "
            f"check the lengths of the links, or ask for another position; {instead}",
            nearest,
        )
    if status == OUT_OF_REACH:
        return OutOfReach(
            f"the handle cannot reach {where} in assembly {assembly!r} without passing a singularity; {instead}",
            nearest,
        )
    return Singular(
        f"the mechanism is singular with its handle at {where} in assembly {assembly!r}: "
        f"the drives do not control it there; move the {what} off the edge of the workspace"
    )


def describe_goal(mech: MechanismArrays, goal: Floats) -> str:
    """A goal (g,) in words: the position in metres, the orientation as roll, pitch and yaw in radians."""
    position = _vector_text(goal[:3]) + " m"
    if mech.controls == POSITION:
        return position
    turned = f"roll, pitch, yaw {_vector_text(roll_pitch_yaw_of(rotation_matrix(goal[-3:])))} rad"
    return turned if mech.controls == ORIENTATION else f"{position} with {turned}"


def _vector_text(values: Floats) -> str:
    """A vector in words, "(0, -5, 0)"."""
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in np.round(values, 12)) + ")"  # + 0.0: no -0


def _distance(mech: MechanismArrays, near: Floats, goal: Floats) -> str:
    """Text: how far apart two goals (g,) are in place and in orientation, as far as the drives control them."""
    shift, turn = goal_difference(mech, near, goal)
    angle = degrees(turn)
    parts = [f"{shift:.4g} m" if shift >= 1.0 else f"{1e3 * shift:.4g} mm"] if shift > ALIKE else []
    parts += [f"{angle:.4g} degrees"] if angle > ALIKE else []
    return " and ".join(parts)


def _limit_text(mechanism: Mechanism, mech: MechanismArrays, reference: Floats, goal: Floats) -> str:
    """Message: which joint is beyond which limit at a goal (g,), straight from the reference (n,)."""
    angles = reference.copy()
    link = _joint_beyond(mech, angles, goal[None].copy())
    if link < 0:  # the straight way does not lead there
        return "a joint is beyond its limits; ask for a place nearer to the reference, or widen the limits"
    name = mechanism.links.names[link].partition("/")[0]  # links of one joint: "name/1", "name/2", "name"
    value, low, high = angles[link], float(mech.lower[0, link]), float(mech.upper[0, link])
    unit = "m" if mech.kind[link] == PRISMATIC else "rad"
    drive = _drive_with_table(mechanism, link)
    if drive and (low, high) == (drive[1].coordinate[0], drive[1].coordinate[-1]):
        return (
            f"joint {name!r} is at {value:.4g} {unit}, outside of the ratio table of drive {drive[0]!r}, "
            f"{low:.4g} to {high:.4g} {unit}; ask for a place nearer to the reference, or extend the table"
        )
    return (
        f"joint {name!r} is at {value:.4g} {unit}, beyond its limits, {low:.4g} to {high:.4g} {unit}; ask for a "
        "place nearer to the reference, or widen the limits"
    )


def _drive_with_table(mechanism: Mechanism, link: int) -> tuple[str, RatioTable] | None:
    """Name and ratio table of the drive of a link's joint; None where it has no table."""
    drives = mechanism.drives
    for name, joint, table in zip(drives.names, drives.joint, drives.ratio_tables or (), strict=False):
        if joint == link and table is not None:
            return name, table
    return None


@compiled
def _joint_beyond(mech: MechanismArrays, angles: Floats, goals: Floats) -> int:
    """Link whose joint is beyond its limit at goal (1, g), straight from `angles` (n,) (in place); -1: none."""
    work = working_memory(mech)
    follow(mech, 0, goals, 0, angles, work)
    return joint_beyond_limit(mech, 0, angles)
