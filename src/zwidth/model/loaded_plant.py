"""A device linearised about its haptic equilibrium (thesis eq. 2.5): what a load changes of its plant.

Two halves, since one acts at every instant and the other at samples:

- the links feel the hand's force F, gravity and the torques s of their drives all the time. With second
  derivatives as in `motions`,

      K += -(F . d2x/dp2 + dw/dp + sum_i s_i d2z_i/dp2)

- the computer turns its force with the motors that it counts: torques change by S dz, S of `command_change`, at
  samples, held and late as everything that it commands. So does the surface's normal, by 1/R per way along it.

Rigid drives without delay let the halves cancel but for what sampling leaves. Either alone is another device.

Springs keep the tangent k + 3 k_3 d^2 that they have at their deflection, on the branch on which they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.equilibrium import Equilibrium, command_change
from zwidth.model.mechanism import Mechanism, nonlinear_of_drives
from zwidth.model.modes import Damping, clusters, repeat_tolerance, undamped_modes
from zwidth.model.plant import Plant, SampledForce
from zwidth.model.posture import Posture
from zwidth.model.reduction import Encoders, reduce_mechanism

MOVED: Final = 1e-9  # share of all motions below which the wall's force moves one by rounding
ROUNDING: Final = 1e-14  # share of the largest part of a sampled feedback that is none


@dataclass(frozen=True)
class LoadedPlants:
    """A device's plant with and without what the load changes, on the same coordinates."""

    loaded: Plant
    unloaded: Plant


def linearise(
    mechanism: Mechanism,
    posture: Posture,
    equilibrium: Equilibrium,
    damping: Damping,
    encoders: Encoders,
) -> LoadedPlants:
    """The full model of one design in one posture at its equilibrium.

    mechanism  that of the equilibrium
    """
    axis = equilibrium.screw
    drives = mechanism.drives
    tangent = equilibrium.springs.tangent(equilibrium.deflections, equilibrium.load.branch == "backward")
    bent = replace(
        mechanism, drives=replace(drives, stiffness=tangent / drives.transmission**2, ratio_tables=None)
    )
    unloaded = reduce_mechanism(bent, posture, axis, "full", damping, encoders)
    c, n = equilibrium.motions.count, unloaded.size
    flexible = equilibrium.springs.flexible
    links = np.concatenate([equilibrium.drives.T, np.zeros((len(tangent), n - c))], axis=1)
    motors = links.copy()
    motors[flexible] = np.eye(n)[c:]
    counted = motors if encoders == "motor" else links
    K = np.zeros((n, n))
    K[:c, :c] = _links_stiffness(equilibrium)
    seen, k = equilibrium.counted, len(mechanism.driven)
    share = np.asarray(np.linalg.pinv(seen.drives.T[:, :k].T), dtype=np.float64)
    h = seen.motions.handle_along(axis)[:k]
    symmetric, turning = _parts(K)
    backward = equilibrium.load.branch == "backward"
    parts = nonlinear_of_drives(drives, h @ seen.seen, links, motors, counted, equilibrium.deflections, backward)
    loaded = replace(
        unloaded,
        stiffness=unloaded.stiffness + symmetric,
        circulatory=turning,
        actuator=(share @ h) @ motors,
        sensor=(h @ seen.seen) @ counted,
        sampled_forces=_sampled_forces(equilibrium, share, motors, counted),
        nonlinear=replace(
            parts, friction=unloaded.nonlinear.friction, force_limit=_force_left(mechanism, equilibrium, share @ h)
        ),
    )
    return LoadedPlants(loaded, unloaded)


def _parts(K: Floats) -> tuple[Floats, Floats | None]:
    """The symmetric and the antisymmetric part of a stiffness (n, n); None where the second is rounding."""
    symmetric, turning = 0.5 * (K + K.T), 0.5 * (K - K.T)
    return symmetric, turning if np.any(np.abs(turning) > ROUNDING * np.max(np.abs(K), initial=0.0)) else None


def _force_left(mechanism: Mechanism, equilibrium: Equilibrium, share: Floats) -> float:
    """By how much the wall's force may change before a motor is at its limit [N]."""
    drives, used = mechanism.drives, share != 0.0
    left = drives.transmission * drives.torque_limit - np.abs(equilibrium.torques)
    return float(np.min(left[used] / np.abs(share[used]), initial=np.inf))


def _links_stiffness(equilibrium: Equilibrium) -> Floats:
    """-dQ/dp (c, c) of hand, gravity and drives' torques on the links."""
    handle, drives, load = equilibrium.motions.handle, equilibrium.drives, equilibrium.load
    felt = 0.0 if load.hand == "neglected" else 1.0
    force, moment = felt * equilibrium.hand_force, felt * equilibrium.hand_moment
    K = np.tensordot(force, handle.speed_2, 1) + np.tensordot(moment, handle.turning, 1)
    if load.hand == "follower":  # the force turns by W dp with the handle's link
        K = (
            K
            + handle.speed.T @ np.cross(handle.spin.T, force).T
            + handle.spin.T @ np.cross(handle.spin.T, moment).T
        )
    if equilibrium.compensation != "counterweight":
        K = K + equilibrium.motions.weight(load.weight)[1]
    s = np.where(
        np.isfinite(equilibrium.springs.forward),
        equilibrium.springs.torque(equilibrium.deflections),
        equilibrium.torques,
    )
    return -np.asarray(K + np.tensordot(s, drives.Z, 1))


def _sampled_forces(
    equilibrium: Equilibrium, share: Floats, motors: Floats, counted: Floats
) -> tuple[SampledForce, ...]:
    """What the computer adds: the turning torques, and those of the surface's curvature."""
    load, seen, u = equilibrium.load, equilibrium.counted, equilibrium.screw
    gravity = np.zeros(3) if equilibrium.compensation == "counterweight" else load.weight
    turning = command_change(seen, u, gravity, equilibrium.compensation, equilibrium.wall_force)
    forces = _rank_one(turning, motors, counted, False)
    if isfinite(load.surface_radius):
        k = seen.seen.shape[0]
        across = seen.motions.handle.speed[:, :k]
        across = across - np.outer(u[:3], u[:3] @ across)
        curved = abs(equilibrium.wall_force) / load.surface_radius * (share @ (across.T @ across) @ seen.seen)
        forces += _rank_one(curved, motors, counted, True)
    return forces


def _rank_one(change: Floats, motors: Floats, counted: Floats, filtered: bool) -> tuple[SampledForce, ...]:
    """A feedback (d, d) from counted coordinates to motors, as products of one column and one row each."""
    left, size, right = np.linalg.svd(change)
    kept = np.flatnonzero(size > ROUNDING * np.max(size, initial=0.0))
    return tuple(SampledForce(left[:, i] @ motors, size[i] * (right[i] @ counted), filtered) for i in kept)


def set_apart(plants: LoadedPlants) -> Plant:
    """The loaded plant on the motions that the wall's force moves without load; the others stand apart.

    Without load the two do not know of each other. What couples them is of the order of the load, and moves poles
    by its square; `Load.count_sideways` keeps it. Motions that are free without load may be held by no more than
    that themselves, so that those apart have it (`_giving_way`).
    """
    moved, still = moved_motions(plants.unloaded)
    if not len(still.squared):
        return _on(plants, moved)
    return replace(_on(plants, moved), apart=_giving_way(_on(plants, still), plants, moved, still.shapes))


def _giving_way(apart: Plant, plants: LoadedPlants, moved: ModalMotions, still: Floats) -> Plant:
    """The motions apart with the stiffness that they have where springs give way to them and a stiff wall holds
    the reading:

        K_ss - [K_sm 0] [K_mm a_m; c_m^T 0]^-1 [K_ms; 0]      K with what the computer adds, actuator a, sensor c

    The second part is of the order of the load's square over the drives' stiffness. So is all that is left of the
    first where the links' half and the computer's cancel.
    """
    loaded, held = plants.loaded, moved.squared != 0.0
    if not held.any():
        return apart
    free = moved.shapes[:, ~held]
    along = free @ (free.T @ loaded.actuator)  # of free motions the one that the wall's force starts
    ways = np.column_stack([moved.shapes[:, held], along])
    added = loaded.stiffness - plants.unloaded.stiffness
    added = added - sum(np.outer(force.along, force.reading) for force in loaded.sampled_forces)
    if loaded.circulatory is not None:
        added = added + loaded.circulatory
    K = np.diag(np.append(moved.squared[held], 0.0)) + ways.T @ added @ ways
    bordered = np.block([[K, (loaded.actuator @ ways)[:, None]], [loaded.sensor @ ways, 0.0]])
    pushed = np.vstack([ways.T @ added @ still, np.zeros((1, still.shape[1]))])
    change = -(still.T @ added @ ways @ np.linalg.lstsq(bordered, pushed, rcond=None)[0][:-1])
    if apart.circulatory is not None:
        change = change + apart.circulatory
    symmetric, turning = _parts(change)
    return replace(apart, stiffness=apart.stiffness + symmetric, circulatory=turning)


def counting_all(plants: LoadedPlants) -> Plant:
    """The loaded plant on all its modes without load, those that no wall moves among them."""
    squared, V = undamped_modes(plants.unloaded.mass, plants.unloaded.stiffness)
    return _on(plants, ModalMotions(V, squared))


def _on(plants: LoadedPlants, motions: ModalMotions) -> Plant:
    """The loaded plant on some modes of the unloaded one. Their own mass and stiffness are exact: of a free motion
    the stiffness is 0, so that what the load adds keeps its digits."""
    Z = motions.shapes
    added = Z.T @ (plants.loaded.stiffness - plants.unloaded.stiffness) @ Z
    own, mass = np.diag(motions.squared), np.eye(len(motions.squared))
    bare = replace(plants.unloaded.on_motions(Z), mass=mass, stiffness=own)
    return replace(plants.loaded.on_motions(Z), mass=mass, stiffness=own + added, without_load=bare)


class ModalMotions(NamedTuple):
    """Mass-normalised motions: shapes (n, m), each within one natural frequency, and its square (m,) [1/s²]."""

    shapes: Floats
    squared: Floats


def moved_motions(plant: Plant) -> tuple[ModalMotions, ModalMotions]:
    """The motions that a force at the actuator moves, and the others: the least subspaces that mass, stiffness and
    damping keep apart. Both are sums of what they have at each natural frequency."""
    squared, V = undamped_modes(plant.mass, plant.stiffness)
    drag = V.T @ plant.damping @ V
    for damper in plant.lagged_dampers:
        drag = drag + damper.damping * np.outer(V.T @ damper.along, V.T @ damper.along)
    groups = [np.arange(len(squared))[run] for run in clusters(squared, repeat_tolerance(squared))]
    drag = drag / max(float(np.max(np.abs(drag))), np.finfo(float).tiny)
    pushed = (V.T @ plant.actuator)[:, None]
    pushed = pushed / np.linalg.norm(pushed)
    moved = np.zeros((plant.size, 0))
    while True:
        reached = np.hstack([pushed, drag @ moved])
        turned, moves = np.zeros_like(V), np.zeros(plant.size, dtype=bool)
        for group in groups:
            left, size, _ = np.linalg.svd(reached[group])
            turned[np.ix_(group, group)] = left
            moves[group] = np.arange(len(group)) < np.count_nonzero(size > MOVED)
        if np.count_nonzero(moves) == moved.shape[1]:
            break
        moved = turned[:, moves]
    shapes = V @ turned
    return ModalMotions(shapes[:, moves], squared[moves]), ModalMotions(shapes[:, ~moves], squared[~moves])
