"""The posture of a mechanism from the position of its handle."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.compiled import compiled
from zwidth.model.argument_checks import require
from zwidth.model.bias import bias_batch
from zwidth.model.continuation import ASSEMBLY_TOLERANCE, OK, OUT_OF_REACH, SINGULAR, reference_batch
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.handle_position import nearest_position, position_of_angles
from zwidth.model.mechanism import Floats, Ints, Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, design_of_each, pack, per_design
from zwidth.model.mobility import check_mobility, drives_fit
from zwidth.model.posture_batch import PostureBatch, failed_batch, solve_batch, solve_from_starts
from zwidth.model.reach_shells import arm_length, far_outside_shells, shells
from zwidth.model.roadmap import roadmap

__all__ = [
    "OK",
    "OUT_OF_REACH",
    "SINGULAR",
    "UNSOLVED",
    "LinkPoints",
    "LoopOpen",
    "OutOfReach",
    "Posture",
    "PostureError",
    "Singular",
    "handle_motions",
    "handle_range",
    "inertia_terms",
    "join_postures",
    "joint_position",
    "link_points",
    "reachable_positions",
    "solve_posture",
]

UNSOLVED: Final = 255  # status where no straight way leads: the design is to be asked for alone


class PostureError(ValueError):
    """The mechanism has no posture that answers the question."""


class OutOfReach(PostureError):
    """The handle cannot get there in this assembly without passing a singularity."""


class Singular(PostureError):
    """At this position the drives lose, or do not have, control of the handle."""


class LoopOpen(PostureError):
    """A loop of the mechanism cannot be closed near the assembly's joint angles."""


@dataclass(frozen=True)
class Posture:
    """A mechanism at rest with its handle somewhere; all arrays carry the batch's leading axes.

    assembly          name of the assembly
    position          (..., 3)     handle [m]; where not OK the requested one
    projected         (...)        distance from the requested position [m]; 0 unless it was projected
    status            (...)        OK, OUT_OF_REACH or SINGULAR; where not OK the numbers below are nan
    angles            (..., n)     joint angles, 0 for fixed joints [rad]
    mass_matrix       (..., d, d)  M of the links in the driven coordinates [kg m^2]
    jacobian          (..., 3, d)  J: handle velocity = J p' with the driven joints' rates p' [m/rad]
    closure_residual  (...)        largest gap left in any loop [m]
    """

    assembly: str
    position: Floats
    status: NDArray[np.uint8]
    angles: Floats
    mass_matrix: Floats
    jacobian: Floats
    closure_residual: Floats
    projected: Floats

    def with_axes(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Posture:
        """The postures with a change of the leading axes made to each of their arrays, such as an index."""
        arrays = {one.name: np.asarray(getattr(self, one.name)) for one in fields(self) if one.name != "assembly"}
        return Posture(self.assembly, **{name: np.asarray(change(array)) for name, array in arrays.items()})

    def broadcast_to(self, shape: tuple[int, ...]) -> Posture:
        """The same postures with these leading axes; itself where it has them. Raises ValueError as numpy does."""
        own = self.status.ndim
        if shape == self.status.shape:
            return self
        # copies: what cannot be written to is another type for the kernels, compiled anew
        return self.with_axes(lambda array: np.array(np.broadcast_to(array, shape + array.shape[own:])))


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
    position: ArrayLike,
    assembly: str | None = None,
    *,
    tolerance: float = 0.0,
    straight: bool = False,
) -> Posture:
    """The posture with the handle at a position, in a named assembly (None: the first).

    The assembly's approximate joint angles are closed onto the reference position; from there Newton is
    continued to the position without passing a singularity (`continuation`), along the straight line or by
    the roadmap of all postures of the assembly (`roadmap`). A position that the handle cannot have is projected
    onto the nearest that it has (`handle_position`).

    position  (..., 3), or (..., 2) in the plane of the reference position [m]; it broadcasts with the leading
              axes of the mechanism's numbers
    tolerance how far a position may be projected, as a share of the arm's length from base to handle
    straight  True, for one position of each of several designs: take only the straight way from the reference,
              which makes each posture hang on its own design alone, and takes a microsecond. Where there is none,
              the status is OUT_OF_REACH if the handle cannot be there nor where the position would be projected
              to, and UNSOLVED otherwise
    Returns   Posture; in a batch a position that cannot be had is marked by its status
    Raises    OutOfReach, Singular  where a single posture is requested and does not exist; an assembly may be
                          singular throughout
              LoopOpen    if the loops of a single mechanism do not close near the assembly's angles
              ValueError  for an unknown assembly, or drives that do not fit the mechanism's freedom
    """
    require("mechanism", mechanism, Mechanism)
    name = _assembly_name(mechanism, assembly)
    mech, designs = pack(mechanism), mechanism.design_shape
    target = _in_space(mechanism, position)
    shape = np.broadcast_shapes(designs, target.shape[:-1])
    # a copy that can be written to, as all that is solved for: one that cannot is another type, compiled anew
    goals = np.array(np.broadcast_to(target, (*shape, 3)).reshape(-1, 3), dtype=np.float64, order="C")
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
        own, place = np.unique(design[far], return_inverse=True)
        solved.status[far[drives_fit(mechanism, mech, own, reference[own])[place]]] = OUT_OF_REACH
        return _posture(name, mech, goals, solved, np.where(solved.status == OK, 0.0, np.nan), shape)
    first = int(np.argmax(closed))
    uncontrolled = check_mobility(mechanism, mech, first, reference[first]) if closed.any() else None
    if uncontrolled and not shape:
        raise _throughout(name, uncontrolled)
    singular = uncontrolled and not designs  # of several designs another may be in control
    solved = failed_batch(mech, len(goals)) if singular else solve_batch(mech, design, reference, goals)
    near, projected = None, np.where(solved.status == OK, 0.0, np.nan)
    wanted = np.flatnonzero(solved.status == OUT_OF_REACH) if tolerance > 0.0 or not shape else ()
    for i in wanted:
        near = nearest_position(mech, int(design[i]), reference, goals[i])
        if near is None or np.linalg.norm(near - goals[i]) > tolerance * arm_length(shells(mech, int(design[i]))):
            continue
        solved.overwrite(np.array([i]), solve_batch(mech, design[i : i + 1], reference, near[None]))
        goals[i], projected[i] = near, np.linalg.norm(near - goals[i])
    posture = _posture(name, mech, goals, solved, projected, shape)
    if not shape:
        _check_single(posture, mechanism.reference_position, near)
    return posture


def _posture(
    name: str,
    mech: MechanismArrays,
    goals: Floats,
    solved: PostureBatch,
    projected: Floats,
    shape: tuple[int, ...],
) -> Posture:
    n, d = mech.parent.size, mech.driven
    return Posture(
        assembly=name,
        position=goals.reshape(*shape, 3),
        status=solved.status.reshape(shape),
        angles=solved.angles.reshape(*shape, n),
        mass_matrix=solved.mass.reshape(*shape, d, d),
        jacobian=solved.jacobian.reshape(*shape, 3, d),
        closure_residual=solved.residual.reshape(shape),
        projected=projected.reshape(shape),
    )


def join_postures(postures: Sequence[Posture]) -> Posture:
    """Postures of several designs, all of one shape (...), as one of shape (P, ...)."""
    arrays = {
        one.name: np.stack([getattr(posture, one.name) for posture in postures])
        for one in fields(Posture)
        if one.name != "assembly"
    }
    return Posture(postures[0].assembly, **arrays)


def reachable_positions(mechanism: Mechanism, assembly: str | None = None) -> Floats:
    """Handle positions all over what an assembly reaches without passing a singularity, (K, 3) [m].

    The nodes of its roadmap: a few degrees of a drive from one to the next, and as much away from the edge.
    Raises    LoopOpen    if the loops do not close near the assembly's angles
              Singular    where the assembly is singular throughout
              ValueError  for an unknown assembly, or a batch of designs
    """
    name = _assembly_name(mechanism, assembly)
    mech, reference = _single(mechanism, name, "reachable positions are computed for one design at a time")
    return roadmap(mech, 0, reference).position


def _single(mechanism: Mechanism, name: str, otherwise: str) -> tuple[MechanismArrays, Floats]:
    """One design packed, and its reference posture (n,) in an assembly; `otherwise` is said of several designs."""
    if mechanism.design_shape:
        raise ValueError(otherwise)
    mech = pack(mechanism)
    reference, gaps = _references(mechanism, mech, name)
    _check_loops(mechanism, mech, name, gaps[0])
    uncontrolled = check_mobility(mechanism, mech, 0, reference[0])
    if uncontrolled:
        raise _throughout(name, uncontrolled)
    return mech, reference[0]


def joint_position(mechanism: Mechanism, angles: Mapping[str, float], assembly: str | None = None) -> Floats:
    """The handle's position with the driven joints at given angles, (3,) [m].

    angles    of every driven joint, by the name of its link [rad]; turns of 2 pi do not count
    Raises    OutOfReach  where the joints cannot be turned there from the reference without passing a singularity
              LoopOpen, Singular  as `reachable_positions`
              ValueError  for other joints than the driven ones, an unknown assembly, or a batch of designs
    """
    name = _assembly_name(mechanism, assembly)
    driven = [mechanism.links.names[joint] for joint in mechanism.drives.joint]
    if set(angles) != set(driven):
        raise ValueError(f"give the angle of every driven joint, {', '.join(driven)}; got {', '.join(angles)}")
    mech, reference = _single(mechanism, name, "postures are given by their joints for one design at a time")
    position = position_of_angles(mech, reference, np.array([angles[joint] for joint in driven]))
    if position is None:
        requested = ", ".join(f"{joint} = {angles[joint]:.6g} rad" for joint in driven)
        raise OutOfReach(
            f"the joints cannot be turned to {requested} in assembly {name!r} without passing a singularity; "
            "ask for angles nearer to those of the reference"
        )
    return position


def handle_motions(posture: Posture) -> Floats:
    """Orthonormal directions (3, r) in which the handle can move, at a single posture."""
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


def inertia_terms(mechanism: Mechanism, posture: Posture, driven_rates: ArrayLike) -> Floats:
    """Velocity-dependent generalised forces of the links, in the driven coordinates [N m].

        M p'' + c(p, p') = Q,    c = B^T (c_q + M_q B' p')             (thesis eq. B.19)

    driven_rates  (..., d)  p' [rad/s], broadcasting with the posture
    Returns       (..., d); nan where the posture is not OK
    """
    mech, designs = pack(mechanism), mechanism.design_shape
    rates = np.asarray(driven_rates, dtype=np.float64)
    shape = np.broadcast_shapes(designs, posture.status.shape, rates.shape[:-1])
    angles = np.broadcast_to(posture.angles, (*shape, mech.parent.size)).reshape(-1, mech.parent.size)
    flat = np.broadcast_to(rates, (*shape, mech.driven)).reshape(-1, mech.driven)
    design = design_of_each(mechanism, shape)
    out = np.empty(flat.shape)
    still = np.zeros(3)
    bias_batch(mech, design, np.array(angles, order="C"), np.array(flat, order="C"), still, out)
    return out.reshape(*shape, mech.driven)


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
    work = working_memory(mech)
    for i in range(design.size):
        place_links(mech, design[i], angles[i], work)
        rotation[i] = work.rotation
        origin[i] = work.origin


def _references(mechanism: Mechanism, mech: MechanismArrays, name: str) -> tuple[Floats, Floats]:
    """Reference posture (P, n) of each design, and the gaps (P, k) left in its loops [m]."""
    angles = per_design(mechanism, np.asarray(mechanism.assemblies[name], dtype=np.float64), 1)
    goals = per_design(mechanism, mechanism.reference_position, 1)
    gaps = np.zeros((len(angles), mech.a.size))
    reference_batch(mech, goals, angles, gaps)
    return angles, gaps


def _throughout(name: str, uncontrolled: str) -> Singular:
    return Singular(
        f"assembly {name!r} of the mechanism is singular wherever its handle is: {uncontrolled}; choose "
        "another assembly, or change the places of joints that make it so"
    )


def _vector(position: Floats) -> str:
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in np.round(position, 12)) + ") m"


def _assembly_name(mechanism: Mechanism, assembly: str | None) -> str:
    names = list(mechanism.assemblies)
    name = names[0] if assembly is None else assembly
    if name not in mechanism.assemblies:
        raise ValueError(f"the mechanism has no assembly {name!r}; it has {', '.join(map(repr, names))}")
    return name


def _in_space(mechanism: Mechanism, position: ArrayLike) -> Floats:
    """Positions (..., 3); two coordinates are completed with the reference position's third."""
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
    if gaps.size and gaps.max() > ASSEMBLY_TOLERANCE * mech.size[0]:
        worst = int(gaps.argmax())
        raise LoopOpen(
            f"loop {mechanism.closures.names[worst]!r} does not close near the joint angles of assembly "
            f"{name!r}: a gap of {gaps[worst]:.3g} m remains; check the lengths of its links and these angles"
        )


def _check_single(posture: Posture, reference: Floats, near: Floats | None) -> None:
    where, instead = _vector(posture.position), "ask for a position nearer to the reference"
    if near is not None:
        away = float(np.linalg.norm(near - posture.position))
        distance = f"{away:.4g} m" if away >= 1.0 else f"{1e3 * away:.4g} mm"
        instead = f"the nearest position it reaches is {_vector(near)}, {distance} away"
    if posture.status == OUT_OF_REACH and np.array_equal(posture.position, reference):
        raise OutOfReach(
            f"the handle cannot reach its own reference position {where} in assembly {posture.assembly!r}; "
            f"check the lengths of the links, or ask for another position; {instead}"
        )
    if posture.status == OUT_OF_REACH:
        raise OutOfReach(
            f"the handle cannot reach {where} in assembly {posture.assembly!r} without passing a "
            f"singularity; {instead}"
        )
    if posture.status == SINGULAR:
        raise Singular(
            f"the mechanism is singular with its handle at {where} in assembly {posture.assembly!r}: "
            "the drives do not control it there; move the position off the edge of the workspace"
        )
