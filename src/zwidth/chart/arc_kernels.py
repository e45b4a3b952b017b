"""Kernels along a piece of the curve: angles so dense that chords lie on it, sign changes, integral of K dB."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import END_MARGIN
from zwidth.chart.curve import OF_B, OF_K, OF_SLOPE, wall_at, zero_between
from zwidth.compiled import compiled
from zwidth.loop.factor_kernels import Factors

Floats = NDArray[np.float64]

# Largest distance of a chord from its arc, in shares of the arc's own extent in K and in B.
CHORD = 1e-6
MOST_POINTS = 4000
HALVINGS = 60


@compiled
def refined_angles(factors: Factors, radius: float, nodes: Floats, tolerance: float, most: int) -> Floats:
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
        K[i], B[i], _, _ = wall_at(factors, radius, inside)
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
def sign_changes(factors: Factors, radius: float, nodes: Floats, component: int) -> Floats:
    """Angles between ascending nodes, the outermost drawn in, where K (0), B (1) or dK/dtheta (2) changes sign."""
    out, n = np.empty(len(nodes)), 0
    low = nodes[0] + END_MARGIN * (nodes[1] - nodes[0])
    before = wall_at(factors, radius, low)[component]
    for i in range(1, len(nodes)):
        last = i == len(nodes) - 1
        high = nodes[i] - (END_MARGIN * (nodes[i] - nodes[i - 1]) if last else 0.0)
        after = wall_at(factors, radius, high)[component]
        if before * after < 0.0:
            weights = OF_K if component == 0 else (OF_B if component == 1 else OF_SLOPE)
            out[n] = zero_between(factors, radius, weights, low, high)
            n += 1
        low, before = high, after
    return out[:n].copy()


@compiled
def _gauss(factors: Factors, radius: float, low: float, high: float) -> float:
    """Six-point Gauss rule for the integral of K dB over angles from low to high."""
    x = (0.2386191860831969, 0.6612093864662645, 0.932469514203152)
    weight = (0.467913934572691, 0.3607615730481386, 0.1713244923791704)
    centre, half, total = 0.5 * (low + high), 0.5 * (high - low), 0.0
    for g in range(3):
        for side in (-1.0, 1.0):
            theta = centre + side * x[g] * half
            K, B, _, dB = wall_at(factors, radius, theta)
            if K > 0.0 and B > 0.0:
                total += weight[g] * half * K * dB
    return total


@compiled
def quadrant_integral(factors: Factors, radius: float, nodes: Floats) -> float:
    """Integral of max(K, 0) dB over the part with B > 0 of an arc of the curve, in the order of its angles.

    Round a region with the region on the left this sums to its area within K > 0, B > 0 (Green). Intervals are
    halved until the rule and its two halves agree to 1e-12 of the whole, or for HALVINGS times: one in which K or
    B changes sign would be halved down to rounding, and rounding never agrees.
    """
    total, size = 0.0, 0.0
    low, high, value = np.empty(64), np.empty(64), np.empty(64)
    for i in range(len(nodes) - 1):
        low[0], high[0] = nodes[i], nodes[i + 1]
        value[0] = _gauss(factors, radius, low[0], high[0])
        depth, halvings = 0, 0
        while depth >= 0:
            halvings += 1
            middle = 0.5 * (low[depth] + high[depth])
            left = _gauss(factors, radius, low[depth], middle)
            right = _gauss(factors, radius, middle, high[depth])
            size = max(size, abs(total) + abs(left) + abs(right))
            if abs(left + right - value[depth]) <= 1e-12 * size or halvings > HALVINGS:
                total += left + right
                depth -= 1
            else:
                low[depth + 1], high[depth + 1], value[depth + 1] = (low[depth], middle, left)
                low[depth], value[depth] = middle, right
                depth += 1
    return total
