"""Which modes of a plant are moved by given forces or show in given readings, and which are idle.

Idle are vibrations out of a device's plane, or those of a symmetric device across the rendered direction. Rounding
leaves a little of the others in them.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.model.modes import clusters, repeat_tolerance
from zwidth.model.plant import Plant

# Modal damping below this share of the largest is rounding of 0.
UNDAMPED = 1e-13
# A motion with less than this share in a force, a reading or the damping counts as uncoupled.
IDLE = 1e-11
# The same of a damped vibration, for the rounding of its shape beside fast ones: its share in a response is 1e-14.
IDLE_DAMPED = 1e-7
# Dampers that couple two modes by this share of what they do to either: what comes back is the square of it.
COUPLED = 1e-7


def modal_damping(plant: Plant, shapes: Floats) -> Floats:
    """The damping (n, n) [1/s] in coordinates of modes, symmetric and without rounding of 0."""
    damping = shapes.T @ plant.damping @ shapes
    damping = (damping + damping.T) / 2.0
    own = np.abs(np.diag(damping))
    # B is positive semidefinite: a mode that dissipates nothing by itself is not damped through others either
    still = own <= UNDAMPED * np.max(np.abs(damping), initial=0.0)
    damping[still, :] = damping[:, still] = 0.0
    return np.where(_coupling(damping), damping, np.diag(np.diag(damping)))


def separated_modes(plant: Plant, squared: Floats, shapes: Floats, ends: Floats) -> tuple[Floats, Flags]:
    """Modes of which as few as can be are moved by forces along some ends, or show in a reading there, and which.

    Rounding chooses the shapes of equal modes. What is moved of them, by an end or by dampers of what is moved, is
    a subspace, and the shapes are turned into it and across it; those across are idle.

    squared  (n,)    squared frequencies, ascending, of free motions exactly 0
    shapes   (n, n)  mass-normalised modes, columns
    ends     (k, n)  along which forces act, and which are read; a row of zeros stands for nothing
    Returns  (n, n) the shapes, unchanged among equal modes of which all are moved; (n,) which are moved
    """
    runs = clusters(squared, repeat_tolerance(squared))
    damping = modal_damping(plant, shapes)
    others = [shapes.T @ M @ shapes for M in (plant.hysteresis, plant.circulatory) if M is not None]
    couplings = [_scaled(matrix, runs) for matrix in (damping, *others)]
    parts = ends @ shapes
    parts /= np.maximum(np.linalg.norm(parts, axis=1, keepdims=True), 1e-300)
    moved = []
    for run in runs:
        damped = float(np.max(np.diag(damping)[run])) > 0.0
        empty = np.zeros((run.stop - run.start, 0))
        moved.append(_widened(empty, parts[:, run].T, IDLE_DAMPED if damped else IDLE))
    waiting = list(range(len(runs)))
    while waiting:
        source = waiting.pop(0)
        pushed = np.hstack([M[:, runs[source]] @ moved[source] for M in couplings])
        for target, run in enumerate(runs):
            wider = _widened(moved[target], pushed[run], COUPLED)
            if wider.shape[1] > moved[target].shape[1]:
                moved[target] = wider
                waiting.append(target)
    flags, turned = np.ones(len(squared), dtype=np.bool_), shapes
    for run, basis in zip(runs, moved, strict=True):
        if basis.shape[1] < run.stop - run.start:
            turned = turned.copy() if turned is shapes else turned
            across = np.linalg.svd(basis, full_matrices=True)[0][:, basis.shape[1] :]
            turned[:, run] = shapes[:, run] @ np.hstack([basis, across])
            flags[run.start + basis.shape[1] : run.stop] = False
    return turned, flags


def _scaled(matrix: Floats, runs: list[slice]) -> Floats:
    """A matrix (n, n) on modes by what it does to the modes of each frequency themselves: 1 or less of dampers.

    What does nothing to any by itself is scaled as a whole, so that all of it but its rounding couples.
    """
    own = np.ones(len(matrix))
    for run in runs:
        own[run] = np.sqrt(np.max(np.abs(np.diag(matrix)[run])))
    if not np.any(own):
        return np.asarray(matrix / (UNDAMPED / COUPLED * np.max(np.abs(matrix)) or 1.0))
    own[own == 0.0] = 1.0
    return np.asarray(matrix / np.outer(own, own))


def _widened(basis: Floats, columns: Floats, level: float) -> Floats:
    """An orthonormal basis (k, b), widened by what of columns (k, c) lies outside it, by more than a level."""
    if basis.shape[0] == basis.shape[1] or np.linalg.norm(columns) <= level:
        return basis
    outside = columns - basis @ (basis.T @ columns)
    outside -= basis @ (
        basis.T @ outside
    )  # what rounding has left, which would grow as a small rest gets length 1
    ways, sizes, _ = np.linalg.svd(outside, full_matrices=False)
    return np.hstack([basis, ways[:, sizes > level]])


def _coupling(matrix: Floats) -> Flags:
    """Which two modes a symmetric matrix (n, n) in modal coordinates couples by more than a share of what it does
    to both of them."""
    own = np.sqrt(np.abs(np.diag(matrix)))
    return np.asarray((np.abs(matrix) > IDLE * np.outer(own, own)) & ~np.eye(len(own), dtype=bool))
