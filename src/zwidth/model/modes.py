"""The modes of a plant: undamped where the damping is classical, damped (complex) where it is not."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from zwidth.model.plant import Plant

Floats = NDArray[np.float64]

# Squared frequencies below this share of the largest are rounding of a rigid mode's exact zero.
RIGID = 1e-13
# Relative distance under which two frequencies or damping rates are one: above the rounding of the
# eigenvalue problem, below anything a mechanism is built to.
REPEATED = 1e-10


class ModesError(ValueError):
    """A plant whose modes cannot be told apart in double precision."""


@dataclass(frozen=True)
class RealModes:
    """Second-order modes  xi'' + 2 a xi' + w^2 xi = input * f,  y = sum output * xi.

    decay            (n,)    a [1/s]
    frequency_squared (n,)   w^2 [1/s^2]; exactly 0 for a rigid mode; negative for a negative stiffness
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

    Rigid modes come out as exactly zero. Raises LinAlgError where M is not positive definite.
    """
    root = np.linalg.cholesky(mass)
    half = np.linalg.solve(root, stiffness)
    reduced = np.linalg.solve(root, half.T)
    squared, vectors = np.linalg.eigh((reduced + reduced.T) / 2.0)
    scale = max(float(np.max(np.abs(squared))), np.finfo(float).tiny)
    squared = np.where(np.abs(squared) <= RIGID * scale, 0.0, squared)
    return squared, np.linalg.solve(root.T, vectors)


def natural_frequencies(plant: Plant) -> Floats:
    """Undamped natural frequencies [Hz], ascending; rigid modes exactly 0, unstable ones (w^2 < 0) nan."""
    squared, _ = undamped_modes(plant.mass, plant.stiffness)
    return np.sqrt(np.where(squared < 0.0, np.nan, squared)) / (2.0 * np.pi)


def clusters(values: Floats, tolerance: float) -> list[slice]:
    """Runs of ascending values that lie within the tolerance of their neighbour."""
    starts = [0, *(int(i) + 1 for i in np.flatnonzero(np.diff(values) > tolerance)), len(values)]
    return [slice(a, b) for a, b in pairwise(starts)]


def real_modes(plant: Plant) -> RealModes | None:
    """The undamped modes with their own damping each, or None where the damping couples them.

    Damping is classical if V^T B V is diagonal once each group of equal frequencies has been turned onto the
    axes of its own damping (Caughey's condition B M^-1 K = K M^-1 B, in modal coordinates).
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    scale = max(float(np.max(np.abs(squared))), np.finfo(float).tiny)
    for run in clusters(squared, REPEATED * scale):
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


@dataclass(frozen=True)
class DampedModes:
    """First-order modes of a plant whose damping couples its undamped modes:  y/f = sum residue / (s - pole).

    poles, residues  (k,)  complex, [1/s] and [m/(N s)]; conjugates both present
    free             residue of the rigid, undamped motion, y/f = free / s^2 [1/kg]
    free_count       how many such motions there are
    """

    poles: NDArray[np.complex128]
    residues: NDArray[np.complex128]
    free: float
    free_count: int


def damped_modes(plant: Plant) -> DampedModes:
    """Poles and residues of the first-order form of M x'' + B x' + K x = actuator f.

    Motions with neither stiffness nor damping are split off first: they are M-orthogonal to the rest and
    their double pole at 0 has no first-order modes. Raises ModesError where other poles nearly coincide in a
    defective way (a coupled pair at critical damping), so that residues lose more than half of the digits.
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    rigid, elastic = shapes[:, squared == 0.0], shapes[:, squared != 0.0]
    drag, axes = np.linalg.eigh(rigid.T @ plant.damping @ rigid)
    level = 1e-13 * max(float(np.max(np.abs(shapes.T @ plant.damping @ shapes))), np.finfo(float).tiny)
    free = rigid @ axes[:, np.abs(drag) <= level]
    kept = np.hstack([rigid @ axes[:, np.abs(drag) > level], elastic])
    k = kept.shape[1]
    K, B = kept.T @ plant.stiffness @ kept, kept.T @ plant.damping @ kept
    # Each velocity in units of its own mode's rate: a slow mode's conjugate pair stays well apart
    rate = np.maximum(np.sqrt(np.abs(np.diag(K))), np.abs(np.diag(B)))
    A = np.block([[np.zeros((k, k)), np.diag(rate)], [-K / rate[:, None], -B * (rate / rate[:, None])]])
    poles, right = np.linalg.eig(A)
    if np.linalg.cond(right) > 1e7:
        raise ModesError(
            "two damped modes nearly coincide (coupled critical damping) and cannot be told apart in double "
            "precision; change damping_Ns_per_m by a relative 1e-5"
        )
    source = np.concatenate([np.zeros(k), kept.T @ plant.actuator / rate])
    reading = np.concatenate([kept.T @ plant.sensor, np.zeros(k)])
    residues = (reading @ right) * np.linalg.solve(right, source.astype(complex))
    poles[np.abs(poles) <= 1e-13 * np.max(np.abs(poles))] = 0.0
    inertia = float((free.T @ plant.sensor) @ (free.T @ plant.actuator))
    return DampedModes(poles, residues, inertia, int(free.shape[1]))
