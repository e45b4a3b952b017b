"""How many roots of the loop lie outside the unit circle, counted by crossings of the boundary curve.

As a wall (K, B) moves through the plane, a root passes the circle only where the wall crosses the boundary. There

    1 + P(z)(K + B w(z)) = 0   and   d|z|/|z| = -Im w (K' dB - B' dK) / |K' + B' w|^2

(primes are derivatives with respect to theta): left of the curve in the sense of rising theta a pair has gone
inside where Im w > 0, and outside where Im w < 0 (Neimark's rule). On the lines of real roots one root passes.
So the number of roots outside is that of one reference wall and the jumps met on the straight way from it.
No polynomial and no eigenvalue is needed: only the curve, measured or computed, however long the delay.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled


def curve_segments(K: Floats, B: Floats, orientation: Floats) -> tuple[Floats, Ints]:
    """A sampled boundary curve as directed segments (k, 4) of K, B, K, B and their jumps (k,).

    K, B         (n,) walls at ascending angles
    orientation  (n,) sign of Im w there; the curve is cut between samples where it differs, or where a wall is not
                 finite: there the curve passes through infinity
    Returns      a jump is the number of roots outside left of a segment less that on its right

    >>> K, B = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.5])
    >>> segments, jumps = curve_segments(K, B, np.array([1, 1, -1]))
    >>> segments.tolist(), jumps.tolist()
    ([[0.0, 0.0, 1.0, 1.0]], [-2])
    """
    whole = np.isfinite(K) & np.isfinite(B)
    joined = whole[:-1] & whole[1:] & (orientation[:-1] == orientation[1:])
    segments = np.column_stack([K[:-1], B[:-1], K[1:], B[1:]])[joined]
    return segments, np.where(orientation[:-1][joined] > 0, -2, 2).astype(np.int64)


@compiled
def roots_outside(segments: Floats, jumps: Ints, reference: Floats, count: int, walls: Floats) -> Ints:
    """Numbers (n,) of roots outside the circle of walls (n, 2).

    segments   (k, 4) the boundary as directed segments: the curve (`curve_segments`) and the lines of real roots
    jumps      (k,) roots outside on the left of each segment less those on its right
    reference  (2,) a wall off the boundary with `count` roots outside

    >>> square = np.array([[0.0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 0, 1], [0, 1, 0, 0]])
    >>> jumps = np.full(4, -2)
    >>> roots_outside(square, jumps, np.array([2.0, 2.0]), 2, np.array([[0.5, 0.4], [0.5, -1.0]])).tolist()
    [0, 2]
    """
    out = np.empty(len(walls), dtype=np.int64)
    x0, y0 = reference[0], reference[1]
    for n in range(len(walls)):
        dx, dy = walls[n, 0] - x0, walls[n, 1] - y0
        total = count
        for k in range(len(segments)):
            ax, ay = segments[k, 0] - x0, segments[k, 1] - y0
            bx, by = segments[k, 2] - x0, segments[k, 3] - y0
            first, last = dx * ay - dy * ax, dx * by - dy * bx
            if (first > 0.0) == (last > 0.0):
                continue
            sx, sy = bx - ax, by - ay
            along, whole = ax * sy - ay * sx, dx * sy - dy * sx
            if whole < 0.0:
                along, whole = -along, -whole
            if 0.0 <= along < whole:
                # a segment that runs from right to left of the way is crossed from its left to its right
                total += -jumps[k] if last > 0.0 else jumps[k]
        out[n] = total
    return out
