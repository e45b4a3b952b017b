"""The undamped modes of a plant, with a damping each where the damping does not couple them.

Dampers that work on one velocity each: of motors whose windings are closed, with a lag or without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.argument_checks import check_kind
from zwidth.model.mechanism import Drives
from zwidth.model.plant import LaggedDamper, Plant, project_onto_motions

# Squared frequencies below this share of the largest are rounding of a rigid mode's exact zero.
RIGID = 1e-13
# Relative distance under which two frequencies or damping rates are one: above the rounding of the
# eigenvalue problem, below anything a mechanism is built to. Of slow modes beside fast ones it is the distance in
# shares of the larger of their own squared frequency and SLOW_SHARE of the largest; the latter counts as no more
# than AMONG_SLOW times the slowest.
REPEATED = 1e-10
SLOW_SHARE = 1e-4
AMONG_SLOW = 1e3
# Squared frequencies as far apart as this are computed in two parts: the slow ones would be lost in the rounding
# of the fast ones.
WIDE = 1e-8
SMALLEST = 1e-26  # of the largest squared frequency: what the rounding of a motion leaves of the fastest mode
# A motion whose residue is below this share of all residues is rounding: no wall moves it.
UNOBSERVED = 1e-11
# The same for a motion without damping: the wall would move its poles by less than the band in which stability is
# left undecided, so that it could only hide the stability of the rest.
UNOBSERVED_UNDAMPED = 1e-9


@dataclass(frozen=True)
class RealModes:
    """Second-order modes  xi'' + 2 a xi' + w^2 xi = input * f,  y = sum output * xi.

    decay            (n,)    a [1/s]
    frequency_squared (n,)   w^2 [1/s²]; exactly 0 for a rigid mode; negative for a negative stiffness
    input, output    (n,)    participation of the wall force and of the reading [kg^-1/2]
    shapes           (n, n)  mass-normalised columns
    """

    decay: Floats
    frequency_squared: Floats
    input: Floats
    output: Floats
    shapes: Floats


def undamped_modes(mass: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """Squared frequencies (n,), ascending, and mass-normalised shapes (n, n): V^T M V = I, V^T K V = diag.

    Rigid modes come out as exactly zero. Modes much slower than the fastest are lost in their rounding: among the
    motions that they make they are found again, by the stiffness of these alone. Raises LinAlgError where M is not
    positive definite.
    """
    root = np.linalg.cholesky(mass)
    half = np.linalg.solve(root, stiffness)
    reduced = np.linalg.solve(root, half.T)
    squared, vectors = np.linalg.eigh((reduced + reduced.T) / 2.0)
    shapes = np.linalg.solve(root.T, vectors)
    fastest = float(np.max(np.abs(squared), initial=0.0))
    among, scale = np.arange(len(squared)), max(fastest, np.finfo(float).tiny)
    squared = np.where(np.abs(squared) <= RIGID * scale, 0.0, squared)
    while True:
        slow = among[np.abs(squared[among]) <= WIDE * scale]
        stiffness_of_slow, rounding = _stiffness_and_rounding(stiffness, shapes[:, slow], fastest)
        # tenfold: well above what may be rounding, lest the search go on in it
        if len(slow) == len(among) or not np.any(np.abs(stiffness_of_slow) > 10.0 * rounding):
            return squared, shapes
        fast = np.setdiff1d(among, slow)
        # what rounding has left of the fast modes in the slow ones, K-orthogonal to which they should be
        remnant = (shapes[:, fast].T @ stiffness @ shapes[:, slow]) / squared[fast, None]
        motions = shapes[:, slow] - shapes[:, fast] @ remnant
        shapes[:, fast] += motions @ remnant.T  # so that both stay M-orthogonal
        relative = motions.T @ stiffness @ motions
        found, turned = np.linalg.eigh((relative + relative.T) / 2.0)
        shapes[:, slow] = motions @ turned
        among, scale = slow, max(float(np.max(np.abs(found))), np.finfo(float).tiny)
        _, rounding = _stiffness_and_rounding(stiffness, shapes[:, slow], fastest)
        squared[slow] = np.where(np.abs(found) <= np.maximum(RIGID * scale, rounding), 0.0, found)


def _stiffness_and_rounding(stiffness: Floats, motions: Floats, fastest: float) -> tuple[Floats, Floats]:
    """v^T K v (k,) of mass-normalised motions (n, k), and what of it may be rounding: of the terms that it is a
    sum of, and of what is left in it of the fastest mode."""
    energy = np.einsum("ik,ik->k", motions, stiffness @ motions)
    terms = np.einsum("ik,ik->k", np.abs(motions), np.abs(stiffness) @ np.abs(motions))
    return energy, np.maximum(RIGID * terms, SMALLEST * fastest)


def repeat_tolerance(squared: Floats) -> Floats:
    """Differences (n,) by which others may be off these squared frequencies (n,) and still count as the same."""
    size = np.abs(squared)
    least = SLOW_SHARE * max(float(np.max(size, initial=0.0)), np.finfo(float).tiny)
    slowest = float(np.min(size, where=size > 0.0, initial=np.inf))
    least = min(least, AMONG_SLOW * slowest)  # as near as the slow modes of a wide spread are known
    return np.asarray(REPEATED * np.maximum(size, least))


def natural_frequencies(plant: Plant) -> Floats:
    """Undamped natural frequencies [Hz], ascending; rigid modes exactly 0, unstable ones (w^2 < 0) nan."""
    check_kind("plant", plant, Plant)
    squared, _ = undamped_modes(plant.mass, plant.stiffness)
    return np.sqrt(np.where(squared < 0.0, np.nan, squared)) / (2.0 * np.pi)


def least_deforming_motion(plant: Plant) -> Floats:
    """The motion (n,) of one metre at the sensor that deforms the plant least: the rigid one where the sensor
    reads it, else the static deflection under a force at the sensor."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    rigid = shapes[:, squared == 0.0]
    readings = rigid.T @ plant.sensor
    if np.linalg.norm(readings) > 1e-9 * np.linalg.norm(shapes.T @ plant.sensor):
        motion = rigid @ readings
    else:
        elastic = squared != 0.0
        motion = shapes[:, elastic] @ ((shapes[:, elastic].T @ plant.sensor) / squared[elastic])
    return np.asarray(motion / (plant.sensor @ motion))


def clusters(values: Floats, tolerance: float | Floats) -> list[slice]:
    """Runs of ascending values (n,), each within the tolerance of its neighbour; tolerance is one, or one each
    (n,)."""
    apart = np.diff(values) > np.broadcast_to(tolerance, values.shape)[1:]
    starts = [0, *(int(i) + 1 for i in np.flatnonzero(apart)), len(values)]
    return [slice(a, b) for a, b in pairwise(starts)]


def real_modes(plant: Plant) -> RealModes | None:
    """The undamped modes with their own damping each, or None where the damping couples them or lags.

    Damping is classical if V^T B V is diagonal once each group of equal frequencies has been turned onto the
    axes of its own damping (Caughey's condition B M^-1 K = K M^-1 B, in modal coordinates).
    """
    if plant.lagged_dampers:
        return None
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    for run in clusters(squared, repeat_tolerance(squared)):
        if run.stop - run.start > 1:
            local = shapes[:, run].T @ plant.damping @ shapes[:, run]
            shapes[:, run] = shapes[:, run] @ np.linalg.eigh((local + local.T) / 2.0)[1]
    modal = shapes.T @ plant.damping @ shapes
    coupling = modal - np.diag(np.diag(modal))
    if np.max(np.abs(coupling)) > REPEATED * max(float(np.max(np.abs(modal))), np.finfo(float).tiny):
        return None
    damping = np.diag(modal).copy()
    # A free rigid mode's own damping is exactly zero, not what rounding leaves of it.
    damping[np.abs(damping) <= 1e-14 * max(float(np.max(np.abs(damping))), 0.0)] = 0.0
    return RealModes(damping / 2.0, squared, shapes.T @ plant.actuator, shapes.T @ plant.sensor, shapes)


def modal_matrix(mass: Floats, stiffness: Floats, ratio: float) -> Floats:
    """B = M V diag(2 zeta w) V^T M: damping ratio zeta on every flexible mode, none on rigid ones; (n, n)."""
    squared, shapes = undamped_modes(mass, stiffness)
    MV = mass @ shapes
    B: Floats = (MV * (2.0 * ratio * np.sqrt(np.maximum(squared, 0.0)))) @ MV.T
    return 0.5 * (B + B.T)


def add_dampers(plant: Plant, dampers: Sequence[LaggedDamper]) -> Plant:
    """The plant with more dampers; those without lag, time_constant 0, go into its damping matrix.

    >>> one = np.ones(1)
    >>> plain = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> add_dampers(plain, [LaggedDamper(one, 2.0, 0.0)]).damping
    array([[2.]])
    """
    working = [d for d in dampers if d.damping > 0.0 and np.any(d.along)]
    drag = [d.damping * np.outer(d.along, d.along) for d in working if d.time_constant == 0.0]
    return replace(
        plant,
        damping=sum(drag, plant.damping),
        lagged_dampers=plant.lagged_dampers + tuple(d for d in working if d.time_constant > 0.0),
    )


def winding_dampers(drives: Drives, motors: Floats) -> list[LaggedDamper]:
    """The electrical dampers of drives whose windings are closed, n^2 k_t^2/R at the joint, lagging by L/R.

    motors  (d, n)  row i: the coordinate, among a plant's n, that turns with the motor of drive i
    """
    if drives.winding_damping is None or drives.winding_time_constant is None:
        return []
    damping = drives.transmission**2 * drives.winding_damping
    return [
        LaggedDamper(along, float(c), float(tau))
        for along, c, tau in zip(motors, damping, drives.winding_time_constant, strict=True)
        if c > 0.0
    ]


def project_dampers(dampers: Sequence[LaggedDamper], motions: Floats) -> list[LaggedDamper]:
    """Dampers as they work on motions: along is what one metre of each motion moves them by.

    motions  (n, m)  a motion in each column; a reduced plant's coordinates say how much of each there is
    """
    return [replace(d, along=project_onto_motions(d.along, motions)) for d in dampers]
