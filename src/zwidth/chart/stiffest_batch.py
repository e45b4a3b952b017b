"""The largest stiffness of many loops at once, compiled, for maps and studies.

The same curve, the same flags and the same corners as in the chart, but nothing is joined or drawn: the curve
is sampled, the samples on the edge of the stable set are selected, and each candidate for the largest
stiffness is refined: a smooth maximum of K, a corner at the end of a run of edge samples, a crossing of B = 0.
The checks of a chart (closed outlines, eigenvalues where rounding hides a root) are not made here.
Instead the answer is tested, and a doubtful loop is marked, to be computed alone by `chart.largest_stiffness`:

- a sample whose flag is lost in rounding, or a corner that does not settle;
- a straight edge (a real root at z = 1 or -1) whose end may lie beyond the stiffest wall found;
- a stable wall among trial walls stiffer than the stiffest found.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.angle_sampling import MOST_ANGLES, angles_around_crossings, computer_points, fill_sample_angles
from zwidth.chart.corner import better_conditioned, solve_crossing
from zwidth.chart.curve import OF_B, OF_SLOPE, wall_alone, wall_at, zero_between
from zwidth.chart.hurwitz import combine, deflate, edges_on_line, edges_stable_set, is_stable, work_array
from zwidth.chart.peak import is_stiffer
from zwidth.chart.roots import find_roots, spread_roots
from zwidth.chart.tracer import HIGH_DEGREE
from zwidth.compiled import compiled
from zwidth.loop.factor_kernels import Factors, characteristic, degree_of_loop, divide, plant_numerator
from zwidth.threads import in_chunks

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

FOUND: Final = 0
NO_WALL: Final = 1
DOUBTFUL: Final = 2

# Steps along the curve, in shares of the distance to its nearest feature (`angle_sampling.sample_angles`).
SHARE: Final = 0.3
LONGEST: Final = 0.1
# Where the curve begins and ends, in shares of the nearest feature's angle: what is softer is never the stiffest.
NEAR_END: Final = 0.02
# Trial walls: stiffer than the stiffest by these factors, with so many dampings each.
BEYOND: Final = (1.0001, 1.02, 1.3)
TRIALS: Final = 6
# A stiffness below this share of the plant's own, some m/T^2, may be rounding of 0.
NOTHING: Final = 1e-10
# What could be the stiffest wall is refined unless it misses the stiffest found by more than this.
SLACK: Final = 1.01


@dataclass(frozen=True)
class StiffestWalls:
    """The stiffest stable wall with K > 0, B >= 0 of each of N loops.

    stiffness, damping  (N,)    nan unless the status is FOUND
    angles              (N, 2)  of the roots on the circle there, ascending; equal except at a corner
    status              (N,)    FOUND, NO_WALL, or DOUBTFUL: to be computed alone
    """

    stiffness: Floats
    damping: Floats
    angles: Floats
    status: NDArray[np.uint8]


class Samples(NamedTuple):
    """Working memory for the samples of one curve."""

    thetas: Floats
    K: Floats
    B: Floats
    flags: NDArray[np.int8]


def stiffest_walls(factors: Factors, rows: Floats, section_count: NDArray[np.int64]) -> StiffestWalls:
    """The stiffest walls of loops that have one computer and different plants.

    factors        of any one of the loops: its rows are not looked at
    rows           (N, m, 9)  the plants' sections, see `loop.sections`
    section_count  (N,)       how many of them each plant has; 0: no wall moves it, which is DOUBTFUL
    """
    N = len(rows)
    late = factors.whole_delay + len(factors.window)
    blind = len(factors.window) > 1 or len(factors.velocity_denominator) > 1 or len(factors.force_denominator) > 0
    stiffest = StiffestWalls(
        np.full(N, np.nan), np.full(N, np.nan), np.full((N, 2), np.nan), np.empty(N, np.uint8)
    )
    loops = (np.ascontiguousarray(rows), section_count, factors, computer_points(factors, 1.0))
    in_chunks(partial(_several, *loops, min(LONGEST, 0.5 / late), blind, *vars(stiffest).values()), N)
    return stiffest


@compiled
def _several(
    rows: Floats,
    used: NDArray[np.int64],
    factors: Factors,
    points: Complexes,
    longest: float,
    blind: bool,
    stiffness: Floats,
    damping: Floats,
    angles: Floats,
    status: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Loops first to last - 1, one after the other in one working memory."""
    samples = Samples(
        np.empty(MOST_ANGLES), np.empty(MOST_ANGLES), np.empty(MOST_ANGLES), np.empty(MOST_ANGLES, np.int8)
    )  # fmt: skip
    for i in range(first, last):
        status[i] = DOUBTFUL
        if used[i] == 0:
            continue
        one = Factors(
            rows[i, : used[i]], factors.whole_delay, factors.split,
            factors.force_numerator, factors.force_denominator,
            factors.velocity_numerator, factors.velocity_denominator, factors.window,
        )  # fmt: skip
        if degree_of_loop(one) > HIGH_DEGREE:
            continue
        status[i], K, B, theta, partner = stiffest_wall(one, points, longest, blind, samples)
        if status[i] == FOUND:
            stiffness[i], damping[i] = K, B
            angles[i, 0], angles[i, 1] = min(theta, partner), max(theta, partner)


@compiled
def features(factors: Factors, points: Complexes) -> Complexes:
    """What `angle_sampling.singular_points` lists, for the unit circle; the computer's own points are given."""
    rows, numerator = factors.rows, plant_numerator(factors, 1.0)
    top = len(numerator) - 1
    while top > 0 and abs(numerator[top]) <= 1e-300:
        top -= 1
    roots = np.empty(top, dtype=np.complex128)
    # from the neighbour's zeros it would be quicker, but answers must not depend on neighbours
    spread_roots(roots)
    find_roots(numerator[: top + 1], roots, 1e-3)
    out = np.empty(2 * rows.shape[0] + top + len(points), dtype=np.complex128)
    n = 0
    for k in range(rows.shape[0]):
        mean = -rows[k, 0] / 2.0
        gap = mean * mean - rows[k, 1]
        if gap < 0.0:
            out[n] = complex(1.0 + mean, np.sqrt(-gap))
            n += 1
        else:
            out[n], out[n + 1] = complex(1.0 + mean + np.sqrt(gap), 0.0), complex(1.0 + mean - np.sqrt(gap), 0.0)
            n += 2
    for root in roots:
        z = divide(1.0 + root, 1.0 - root)
        if abs(z) < 1e6 and z.imag >= -1e-12:
            out[n] = z
            n += 1
    for point in points:
        out[n] = point
        n += 1
    return out[:n]


@compiled
def stiffest_wall(
    factors: Factors, points: Complexes, longest: float, blind: bool, samples: Samples
) -> tuple[int, float, float, float, float]:
    """Status, stiffness, damping and the angles of the two roots on the circle there."""
    polynomials = characteristic(factors, 1.0)
    room = work_array(polynomials.shape[1] - 1)
    n = _fill_samples(factors, polynomials, points, longest, blind, samples, room)
    thetas, K, B, flags = samples
    best, at, partner, unsure, widest = 0.0, 0.0, 0.0, 0.0, 0.0
    damping = 0.0
    # the stiffest sample on the edge, and the stiffest whose flag rounding hides
    for i in range(n):
        if flags[i] == 0 and B[i] >= 0.0:
            unsure = max(unsure, K[i])
        if flags[i] > 0 and B[i] >= 0.0:
            widest = max(widest, B[i])
            if is_stiffer(K[i], B[i], best, damping):
                best, damping, at, partner = K[i], B[i], thetas[i], thetas[i]
    # between each edge sample and its neighbours: a crossing of B = 0, a smooth maximum of K, or a corner
    for i in range(n):
        if flags[i] <= 0:
            continue
        for step in (-1, 1):
            j = i + step
            if not 0 <= j < n:
                continue
            # steps are short against the distance to the next feature: K does not double within one
            if 2.0 * max(K[i], K[j]) < best:
                continue
            h = abs(thetas[j] - thetas[i])
            rise = step * wall_at(factors, 1.0, thetas[i])[2] * h
            if flags[j] > 0:
                if step < 0:
                    continue  # each pair of neighbours once
                if B[i] * B[j] < 0.0 and max(K[i], K[j]) * SLACK > best:
                    theta = zero_between(factors, 1.0, OF_B, thetas[i], thetas[j])
                    wall = wall_at(factors, 1.0, theta)
                    if is_stiffer(wall[0], 0.0, best, damping):
                        best, damping, at, partner = wall[0], 0.0, theta, theta
                back = -step * wall_at(factors, 1.0, thetas[j])[2] * h
                if rise > 0.0 and back > 0.0 and min(K[i] + rise, K[j] + back) * SLACK > best:
                    theta = zero_between(factors, 1.0, OF_SLOPE, thetas[i], thetas[j])
                    wall = wall_at(factors, 1.0, theta)
                    if wall[1] >= 0.0 and is_stiffer(wall[0], wall[1], best, damping):
                        best, damping, at, partner = wall[0], wall[1], theta, theta
                continue
            if max(K[i], K[i] + rise, K[j]) * SLACK < best:
                continue
            theta, other, settled = corner_between(factors, polynomials, thetas[i], thetas[j], room)
            if not settled:
                return DOUBTFUL, np.nan, np.nan, np.nan, np.nan
            wall = wall_at(
                factors, 1.0, better_conditioned(factors, 1.0, theta, other) if 0.0 < other < np.pi else theta
            )
            if wall[1] * B[i] < 0.0:
                crossing = zero_between(factors, 1.0, OF_B, min(thetas[i], theta), max(thetas[i], theta))
                stiff = wall_at(factors, 1.0, crossing)[0]
                if is_stiffer(stiff, 0.0, best, damping):
                    best, damping, at, partner = stiff, 0.0, crossing, crossing
            if wall[1] >= 0.0 and is_stiffer(wall[0], wall[1], best, damping):
                best, damping, at, partner = wall[0], wall[1], theta, other
            if rise > 0.0 and step * wall_at(factors, 1.0, theta)[2] < 0.0:
                top = zero_between(factors, 1.0, OF_SLOPE, min(thetas[i], theta), max(thetas[i], theta))
                wall = wall_at(factors, 1.0, top)
                if wall[1] >= 0.0 and is_stiffer(wall[0], wall[1], best, damping):
                    best, damping, at, partner = wall[0], wall[1], top, top
    if n > 0 and flags[n - 1] > 0 and _end_beyond(polynomials, best):
        return DOUBTFUL, np.nan, np.nan, np.nan, np.nan
    if (unsure > 0.0 and unsure * SLACK > best) or _may_be_stiffer(polynomials, best, damping, widest, room):
        return DOUBTFUL, np.nan, np.nan, np.nan, np.nan
    if best == 0.0:
        return NO_WALL, np.nan, np.nan, np.nan, np.nan
    if best < NOTHING * np.abs(polynomials[0]).sum() / np.abs(polynomials[1]).sum():
        return DOUBTFUL, np.nan, np.nan, np.nan, np.nan
    return FOUND, best, damping, at, partner


@compiled
def _fill_samples(
    factors: Factors,
    polynomials: Floats,
    points: Complexes,
    longest: float,
    blind: bool,
    samples: Samples,
    room: Floats,
) -> int:
    """Fill in the samples; flags are 1, 0 (lost in rounding) or -1 where K > 0 and B >= 0 at the sample or at a
    neighbour, and -1 elsewhere. Returns their number."""
    thetas, K, B, flags = samples
    places = features(factors, points)
    n = fill_sample_angles(places, 1.0, SHARE, longest, NEAR_END, np.empty(len(places)), thetas)
    if blind:
        more = angles_around_crossings(factors, 1.0, thetas[:n])
        every = np.sort(np.concatenate((thetas[:n], more)))
        n = min(len(every), MOST_ANGLES)
        thetas[:n] = every[:n]
    for i in range(n):
        K[i], B[i] = wall_alone(factors, 1.0, thetas[i])
    for i in range(n):
        wanted = K[i] > 0.0 and B[i] >= 0.0
        if not wanted and i > 0:
            wanted = K[i - 1] > 0.0 and B[i - 1] >= 0.0
        if not wanted and i < n - 1:
            wanted = K[i + 1] > 0.0 and B[i + 1] >= 0.0
        flags[i] = edges_stable_set(polynomials, thetas[i], K[i], B[i], room) if wanted else -1
    return n


@compiled
def corner_between(
    factors: Factors, polynomials: Floats, on: float, off: float, room: Floats
) -> tuple[float, float, bool]:
    """Angle of the corner between an edge sample and one that is none, its partner's angle, and whether it
    settled; as `corner.refine_corner` without eigenvalues."""
    low, high = min(on, off), max(on, off)
    degree = polynomials.shape[1] - 1
    edge, none = on, off
    for _ in range(36):
        # bisection for where the flag changes; 36 halvings leave a step of rounding size
        middle = 0.5 * (edge + none)
        K, B = wall_alone(factors, 1.0, middle)
        if edges_stable_set(polynomials, middle, K, B, room) > 0:
            edge = middle
        else:
            none = middle
    K0, B0 = wall_alone(factors, 1.0, low)
    K1, B1 = wall_alone(factors, 1.0, high)
    for end in (0, 1):
        column = 0 if end == 0 else degree
        # a real root at z = 1 or -1 (the lines of the chart) takes part where the end coefficient changes its sign
        a, s, v = polynomials[0, column], polynomials[1, column], polynomials[2, column]
        if (a + s * K0 + v * B0) * (a + s * K1 + v * B1) < 0.0:
            crossing = zero_between(factors, 1.0, (a, s, v, 0.0, 0.0), low, high)
            if abs(crossing - edge) <= 1e-6 * edge:
                return crossing, 0.0 if end == 0 else np.pi, True
    K, B = wall_alone(factors, 1.0, edge)
    # else a second pair of roots is on the circle: it is what remains nearest to it without the first pair
    combine(polynomials, K, B, room)
    deflate(room, degree, np.tan(0.5 * edge) ** 2)
    roots = np.empty(degree - 2, dtype=np.complex128)
    spread_roots(roots)
    find_roots(room[2, : degree - 1].copy(), roots, 1e-9)
    nearest, partner = np.inf, 0.0
    for root in roots:
        z = divide(1.0 + root, 1.0 - root)
        if abs(abs(z) - 1.0) < nearest:
            nearest, partner = abs(abs(z) - 1.0), abs(np.arctan2(z.imag, z.real))
    one, other, met = solve_crossing(factors, 1.0, edge, partner)
    return one, other, met and abs(one - edge) <= 1e-5 * edge


@compiled
def _end_beyond(polynomials: Floats, stiffness: float) -> bool:
    """Whether the curve's end at theta = pi, a double root at z = -1, is a stiffer wall."""
    i = polynomials.shape[1] - 1
    A, S, V = polynomials[0], polynomials[1], polynomials[2]
    det = S[i] * V[i - 1] - S[i - 1] * V[i]
    return bool((A[i - 1] * V[i] - A[i] * V[i - 1]) / det > stiffness)


@compiled
def _may_be_stiffer(polynomials: Floats, stiffness: float, damping: float, widest: float, room: Floats) -> bool:
    """Whether anything speaks for a stable wall stiffer than the stiffest found."""
    degree = polynomials.shape[1] - 1
    scale = max(widest, damping)
    for factor in BEYOND:
        for k in range(TRIALS):
            if is_stable(polynomials, factor * stiffness, 1.2 * scale * (k + 0.5) / TRIALS, room) > 0:
                return True
    for low_end in (0, 1):
        a, s, v = polynomials[0, degree * (1 - low_end)], polynomials[1, degree * (1 - low_end)], 0.0
        v = polynomials[2, degree * (1 - low_end)]
        # where the line of real roots crosses B = 0 beyond
        if s != 0.0 and -a / s > stiffness and edges_on_line(polynomials, low_end, -a / s, 0.0, room) >= 0:
            return True
        # and just beyond the stiffest wall, where it is one of its corners
        if v != 0.0:
            B = -(a + s * 1.001 * stiffness) / v
            if B >= 0.0 and edges_on_line(polynomials, low_end, 1.001 * stiffness, B, room) >= 0:
                return True
    return False
