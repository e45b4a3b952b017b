"""Kernels along a piece of the curve: angles so dense that chords lie on it, and sign changes."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.arcs import END_MARGIN
from zwidth.chart.area import end_value
from zwidth.chart.curve import NO_LINE, OF_SLOPE, wall_at, walls, zero_between
from zwidth.compiled import compiled
from zwidth.loop.circle_factors import CircleFactors, wall_with_slopes

# Largest distance of a chord from its arc, in shares of the arc's own extent in K and in B.
CHORD = 1e-6
MOST_POINTS = 4000
# How close to an axis the points beside it are, as a share of the angle.
BESIDE_AXIS = 1e-9


@compiled
def dense_points(circle: CircleFactors, t: Floats, ends: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles strictly between an arc's ends, ascending, with K and B: chords between them stay within CHORD of the
    arc, and where it crosses K = 0 or B = 0 there is one on either side, close by.

    t     (n,)    ascending tan(theta/2) from end to end
    ends  (2, 2)  the walls at both ends
    """
    n, K_zeros, B_zeros = len(t), sign_changes(circle, t, ends, 0), sign_changes(circle, t, ends, 1)
    nodes = np.empty(n + 2 * (len(K_zeros) + len(B_zeros)))
    for i in range(n):
        nodes[i] = 2.0 * np.arctan(t[i])
    low, high, count = nodes[0], nodes[n - 1], n
    for zeros in (K_zeros, B_zeros):
        for zero in zeros:
            for share in (1.0 - BESIDE_AXIS, 1.0 + BESIDE_AXIS):
                theta = share * 2.0 * np.arctan(zero)
                if low < theta < high:
                    i = count
                    while nodes[i - 1] > theta:
                        nodes[i] = nodes[i - 1]
                        i -= 1
                    nodes[i] = theta
                    count += 1
    thetas = _refined_angles(circle, nodes[:count], CHORD, MOST_POINTS)
    K, B = walls(circle, thetas)
    return thetas, K, B


@compiled
def _refined_angles(circle: CircleFactors, nodes: Floats, tolerance: float, most: int) -> Floats:
    """Angles strictly between the first and last node, each interval cut so that chords stay within tolerance.

    The sag of a chord over a step h is h^2/8 times the second derivative; the middle of each interval measures it,
    and n equal pieces divide it by n^2.
    """
    n = len(nodes)
    K, B = np.empty(2 * n - 1), np.empty(2 * n - 1)
    for i in range(2 * n - 1):
        theta = nodes[i // 2] if i % 2 == 0 else 0.5 * (nodes[i // 2] + nodes[i // 2 + 1])
        # the ends may be 0 or pi, where the curve is even: just inside is as good
        inside = min(max(theta, 1e-7 * nodes[1]), np.pi - 1e-7 * (np.pi - nodes[n - 2]))
        K[i], B[i], _, _ = wall_at(circle, inside)
    width, height = K.max() - K.min(), B.max() - B.min()
    out, count = np.empty(most + 2 * n), 0
    for i in range(n - 1):
        j = 2 * i
        sag = max(
            abs(K[j + 1] - 0.5 * (K[j] + K[j + 2])) / max(width, 1e-300),
            abs(B[j + 1] - 0.5 * (B[j] + B[j + 2])) / max(height, 1e-300),
        )
        pieces = max(1, min(int(np.ceil(np.sqrt(sag / tolerance))), 200))
        for k in range(pieces):
            theta = nodes[i] + (nodes[i + 1] - nodes[i]) * k / pieces
            if (i > 0 or k > 0) and count < len(out):
                out[count] = theta
                count += 1
    return out[:count].copy()


@compiled
def sign_changes(circle: CircleFactors, t: Floats, ends: Floats, component: int) -> Floats:
    """The t on an arc at which K (0), B (1) or dK/dtheta (2) changes sign.

    t     (n,)    tan(theta/2) from end to end
    ends  (2, 2)  the walls at both ends
    """
    n, m = len(t), 0
    out, values = np.empty(n), np.empty(n)
    for i in range(1, n - 1):
        values[i] = wall_with_slopes(circle, t[i])[component]
    if component == OF_SLOPE:
        low, high = t[0] + END_MARGIN * (t[1] - t[0]), t[n - 1] - END_MARGIN * (t[n - 1] - t[n - 2])
        low, high = max(low, END_MARGIN * t[1]), min(high, t[n - 2] / END_MARGIN)
        before, after = wall_with_slopes(circle, low)[2], wall_with_slopes(circle, high)[2]
    else:
        values[0], values[n - 1] = ends[0, component], ends[1, component]
        low, before = end_value(circle, component, values, t, n, False)
        high, after = end_value(circle, component, values, t, n, True)
    for i in range(1, n):
        at, value = (t[i], values[i]) if i < n - 1 else (high, after)
        if before * value < 0.0:
            out[m] = zero_between(circle, component, NO_LINE, low, at)
            m += 1
        low, before = at, value
    return out[:m].copy()
