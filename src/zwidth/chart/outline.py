"""Arcs as points: dense enough that chords lie on the edge, and exact integrals along them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import Arc, Rings
from zwidth.chart.curve import wall_at, walls
from zwidth.chart.tracer import Tracer
from zwidth.compiled import compiled
from zwidth.loop.evaluate import Factors

Floats = NDArray[np.float64]

# Largest distance of a chord from its arc, in shares of the arc's own extent in K and in B.
CHORD = 1e-6
MOST_POINTS = 4000
HALVINGS = 60


def arc_angles(arc: Arc) -> Floats:
    """The angles that found an arc with its ends, from first to last (two for a line)."""
    return np.concatenate([[arc.start], arc.thetas, [arc.end]])


def sample_arc(tracer: Tracer, arc: Arc) -> tuple[Floats, Floats, Floats]:
    """Angles, K and B (k,) from first to last corner, with chords within CHORD of the arc."""
    if arc.kind != "pair":
        K, B = np.array([arc.first, arc.last]).T
        return np.array([arc.start, arc.end]), K, B
    nodes = np.sort(arc_angles(arc))
    inner = refined_angles(tracer.factors, tracer.radius, nodes, CHORD, MOST_POINTS)
    K, B = walls(tracer.factors, tracer.radius, inner)
    thetas = np.concatenate([nodes[:1], inner, nodes[-1:]])
    if arc.start > arc.end:
        thetas, K, B = thetas[::-1], K[::-1], B[::-1]
    return (
        thetas,
        np.concatenate([[arc.first[0]], K, [arc.last[0]]]),
        np.concatenate([[arc.first[1]], B, [arc.last[1]]]),
    )


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
    B changes sign asks for rounding, and rounding itself asks for ever.
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


def segment_integral(first: tuple[float, float], last: tuple[float, float]) -> float:
    """The same integral along a straight edge."""
    (K0, B0), (K1, B1) = first, last
    stops = [0.0, 1.0]
    for a, b in ((K0, K1), (B0, B1)):
        if a * b < 0.0:
            stops.append(a / (a - b))
    stops.sort()
    total = 0.0
    for s, t in pairwise(stops):
        middle = 0.5 * (s + t)
        K, B = K0 + middle * (K1 - K0), B0 + middle * (B1 - B0)
        if K > 0.0 and B > 0.0:
            total += K * (B1 - B0) * (t - s)
    return total


def quadrant_area(tracer: Tracer, rings: Rings) -> float:
    """Area of the stable set within K >= 0, B >= 0 [N^2 s/m^2]."""
    return sum(walk_area([(tracer, arc) for arc in ring]) for ring in rings)


def walk_area(walk: Sequence[tuple[Tracer, Arc]]) -> float:
    """Green's integral along a closed walk of arcs, each with its own tracer, within K >= 0, B >= 0 [N^2 s/m^2].

    A blurred corner has two walls, the end of one arc and the beginning of the next: their chord counts.
    """
    total = 0.0
    for n, (tracer, arc) in enumerate(walk):
        if arc.kind == "pair":
            total += quadrant_integral(tracer.factors, tracer.radius, arc_angles(arc))
        else:
            total += segment_integral(arc.first, arc.last)
        total += segment_integral(arc.last, walk[(n + 1) % len(walk)][1].first)
    return total
