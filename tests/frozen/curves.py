"""Are two sampled curves the same curve?"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

POINTS_PER_STEP = 16  # points of the interpolation for each step of the line
COINCIDENT = 1e-10  # points nearer than this are one: cubics through both would divide by next to nothing


def distance(first: np.ndarray, second: np.ndarray) -> float:
    """Largest distance of a point of one curve from the other (Hausdorff), each continued between its points.

    first, second  (n, d), (m, d) points in order, in coordinates scaled to the curve's extent
    Straight lines between the points of one smooth curve that is sampled twice would lie apart by the sag,
    h^2 kappa / 8 at a spacing h. Between its points the curve is therefore taken as the nearest of the chord and
    three cubics through four neighbours each, of which one at least does not reach across a corner.
    """
    return max(_one_sided_distance(first, second), _one_sided_distance(second, first))


def _one_sided_distance(points: np.ndarray, line: np.ndarray) -> float:
    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line = line[np.concatenate([[True], step > COINCIDENT])]
    nearest = _distances_to_chords(points, line)
    if len(line) >= 4:
        for shift in (-2, -1, 0):
            nearest = np.minimum(nearest, _distances_to_chords(points, _cubic_interpolation(line, shift)))
    return float(np.max(nearest))


def _distances_to_chords(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distance of each point from the two chords at the nearest vertex of a line."""
    distances, at = cKDTree(line).query(points)
    for first in (at - 1, at):
        start = line[np.clip(first, 0, len(line) - 1)]
        along = line[np.clip(first + 1, 0, len(line) - 1)] - start
        length = np.sum(along**2, axis=1)
        share = np.sum((points - start) * along, axis=1) / np.where(length > 0.0, length, 1.0)
        foot = start + np.clip(share, 0.0, 1.0)[:, None] * along
        distances = np.minimum(distances, np.linalg.norm(points - foot, axis=1))
    return distances


def _cubic_interpolation(line: np.ndarray, shift: int) -> np.ndarray:
    """The line with points between, each step's on the cubic through the four points that begin `shift` before it.

    Lagrange's formula in the length along the chords; at the ends the last four points serve.
    """
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    steps = np.arange(len(line) - 1)
    four = np.clip(steps + shift, 0, len(line) - 4)[:, None] + np.arange(4)
    share = np.arange(POINTS_PER_STEP) / POINTS_PER_STEP
    where = at[:-1, None] + share * np.diff(at)[:, None]
    made = np.zeros((len(steps), POINTS_PER_STEP, line.shape[1]))
    for j in range(4):
        others = [k for k in range(4) if k != j]
        weight = np.prod([(where - at[four[:, k], None]) for k in others], axis=0)
        weight /= np.prod([at[four[:, j]] - at[four[:, k]] for k in others], axis=0)[:, None]
        made += weight[:, :, None] * line[four[:, j], None, :]
    return np.concatenate([made.reshape(-1, line.shape[1]), line[-1:]])
