"""Corners of the stable set to rounding, from a sample on either side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import Wall
from zwidth.chart.curve import wall_alone, wall_at, zero_between
from zwidth.chart.hurwitz import edges_stable_set, work_array
from zwidth.chart.tracer import ROOTS, RealRoot, Tracer
from zwidth.compiled import compiled
from zwidth.loop.factor_kernels import Factors

Floats = NDArray[np.float64]
LAST_DIGITS = 1e-14  # of an angle


@compiled
def _bisect_flag(factors: Factors, polynomials: Floats, radius: float, on: float, off: float) -> float:
    """The last angle from `on` towards `off` that is an edge."""
    room = work_array(polynomials.shape[1] - 1)
    for _ in range(60):
        middle = 0.5 * (on + off)
        if middle in (on, off):
            break
        K, B = wall_alone(factors, radius, middle)
        if edges_stable_set(polynomials, middle, K, B, room) > 0:
            on = middle
        else:
            off = middle
    return on


@compiled
def solve_crossing(factors: Factors, radius: float, one: float, other: float) -> tuple[float, float, bool]:
    """Newton for wall(one) = wall(other), from close by; False if it wanders off or does not settle."""
    a, b = one, other
    settled = False
    for _ in range(30):
        Ka, Ba, dKa, dBa = wall_at(factors, radius, a)
        Kb, Bb, dKb, dBb = wall_at(factors, radius, b)
        det = dKb * dBa - dKa * dBb
        step_a = ((Ka - Kb) * dBb - (Ba - Bb) * dKb) / det
        step_b = ((Ka - Kb) * dBa - (Ba - Bb) * dKa) / det
        if not (abs(step_a) < 0.01 * a and abs(step_b) < 0.01 * b):
            return one, other, False
        a, b = a + step_a, b + step_b
        settled = abs(step_a) <= 4e-15 * a and abs(step_b) <= 4e-15 * b
        if settled:
            break
    return a, b, settled and a < np.pi and b < np.pi and abs(a - b) > 1e-6 * a


@compiled
def better_conditioned(factors: Factors, radius: float, one: float, other: float) -> float:
    """Of the two angles of a corner the one on whose branch the wall moves less with the angle's last digits."""
    _, _, dK, dB = wall_at(factors, radius, one)
    _, _, eK, eB = wall_at(factors, radius, other)
    # each in shares of the corner's slopes together, so that K and B count alike
    first = one * (abs(dK) / (abs(dK) + abs(eK)) + abs(dB) / (abs(dB) + abs(eB)))
    second = other * (abs(eK) / (abs(dK) + abs(eK)) + abs(eB) / (abs(dB) + abs(eB)))
    return one if not first > second else other


def cross_line(tracer: Tracer, root: RealRoot, low: float, high: float) -> float:
    """The angle in (low, high) where the curve crosses a line of real roots."""
    a, s, v = tracer.line(root).tolist()
    return zero_between(tracer.factors, tracer.radius, (a, s, v, 0.0, 0.0), low, high)


def wall_on_line(tracer: Tracer, root: RealRoot, theta: float) -> Wall:
    """The wall where the curve crosses a line of real roots, at the angle that `cross_line` gives.

    On the branch of a mode that the wall hardly moves, walls at two neighbouring double-precision angles are far
    apart. The rest of the way to the line is taken along the curve's tangent, by less than the angle's last
    digits. Where the curve changes sides through infinity there is no such wall, and the curve's own is returned.
    """
    a, s, v = tracer.line(root).tolist()
    K, B, dK, dB = tracer.wall(theta)
    off, slope = a + s * K + v * B, s * dK + v * dB
    for beside in (theta * (1.0 - LAST_DIGITS), theta * (1.0 + LAST_DIGITS)):
        k, b, _, _ = tracer.wall(beside)
        if not abs(a + s * k + v * b) > abs(off):
            return K, B
    step = -off / slope if slope else 0.0
    return (K + step * dK, B + step * dB) if abs(step) <= LAST_DIGITS * theta else (K, B)


def _last_edge(tracer: Tracer, on: float, off: float) -> float:
    """The last angle from `on` towards `off` that is an edge."""
    if tracer.polynomials_decide(on) and tracer.polynomials_decide(off):
        return _bisect_flag(tracer.factors, tracer.polynomials, tracer.radius, on, off)
    for _ in range(50):  # polynomials cannot tell: a long delay, or roots that stay close to the circle
        middle = 0.5 * (on + off)
        if tracer.edge_flag(middle) > 0:
            on = middle
        else:
            off = middle
    return on


def _partner(tracer: Tracer, theta: float, wall: Wall) -> float:
    """Angle of the root nearest the circle apart from the pair at theta, for a wall on the curve."""
    z = tracer.roots_without_pair(np.array(theta), np.array(wall[0]), np.array(wall[1]))
    return float(abs(np.angle(z[np.argmin(np.abs(np.abs(z) - tracer.radius))]))) if len(z) else 0.0


def refine_corner(tracer: Tracer, on: float, off: float) -> tuple[float, Wall, float]:
    """Angle and wall of the corner between a sample on the edge and one that is not, and the partner's angle.

    The partner is 0 or pi where a real root reaches the circle. Where two branches touch without crossing the
    bisection's angle stands.
    """
    theta = _last_edge(tracer, on, off)
    low, high = min(on, off), max(on, off)
    for root, partner in zip(ROOTS, (0.0, np.pi), strict=True):
        a, s, v = tracer.line(root)
        ends = [a + s * K + v * B for K, B, *_ in (tracer.wall(low), tracer.wall(high))]
        if ends[0] * ends[1] < 0.0:
            crossing = cross_line(tracer, root, low, high)
            if abs(crossing - theta) <= 1e-6 * theta:
                return crossing, wall_on_line(tracer, root, crossing), partner
    wall = tracer.wall(theta)[:2]
    partner = _partner(tracer, theta, wall)
    if 0.0 < partner < np.pi:
        one, other, settled = solve_crossing(tracer.factors, tracer.radius, theta, partner)
        if settled and abs(one - theta) <= 1e-5 * theta:
            return one, tracer.wall(better_conditioned(tracer.factors, tracer.radius, one, other))[:2], other
    return theta, wall, partner
