"""The undamped modes of a plant, with a damping each where the damping does not couple them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from zwidth.model.argument_checks import require
from zwidth.model.plant import Plant

Floats = NDArray[np.float64]

# Squared frequencies below this share of the largest are rounding of a rigid mode's exact zero.
RIGID = 1e-13
# Relative distance under which two frequencies or damping rates are one: above the rounding of the
# eigenvalue problem, below anything a mechanism is built to.
REPEATED = 1e-10
# A motion whose residue is below this share of all residues is rounding: no wall moves it.
UNOBSERVED = 1e-11
# The same for a motion without damping: the wall would move its poles by less than the band in which stability is
# left undecided, so that it could only hide the stability of the rest.
UNOBSERVED_UNDAMPED = 1e-9


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
    require("plant", plant, Plant)
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


def clusters(values: Floats, tolerance: float) -> list[slice]:
    """Runs of ascending values that lie within the tolerance of their neighbour."""
    starts = [0, *(int(i) + 1 for i in np.flatnonzero(np.diff(values) > tolerance)), len(values)]
    return [slice(a, b) for a, b in pairwise(starts)]


def real_modes(plant: Plant) -> RealModes | None:
    """The undamped modes with their own damping each, or None where the damping couples them or lags.

    Damping is classical if V^T B V is diagonal once each group of equal frequencies has been turned onto the
    axes of its own damping (Caughey's condition B M^-1 K = K M^-1 B, in modal coordinates).
    """
    if plant.lagged_dampers:
        return None
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
