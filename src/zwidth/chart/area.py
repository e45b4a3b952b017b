"""Area, largest stiffness and largest damping of a stable set within K >= 0, B >= 0, read off its edge's arcs.

The area is Green's integral of K dB along the edge.

Over a panel of a curve the integral of K dB is that of the polynomials through its walls at ten Gauss-Lobatto
points. What they miss of B oscillates, and cancels: the error falls as that of Gauss's rule with as many points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from zwidth.arrays import Floats
from zwidth.chart.arcs import DAMPING, END_MARGIN, SLOPE, STIFFNESS, Arc, Arcs, Curves
from zwidth.chart.curve import NO_LINE, OF_B, OF_K, zero_between
from zwidth.chart.wall_samples import LANES_SIZE, walls_of_samples
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop_table import CircleFactors, wall_on_circle

POINTS: Final = 10  # of a panel's rule
PANEL: Final = 3  # intervals between samples that are one panel at first
ACCURACY: Final = 1e-10  # difference, as a share of the whole, between a panel's integral and that of its halves
HALVINGS, DEEPEST = 60, 24  # of one panel: all together, and one within the other
ON_AXIS: Final = 1e-10  # a wall that is this small a share of the largest is on an axis


class AreaMemory(NamedTuple):
    """Working memory of the integral of K dB along a curve.

    rule    (POINTS + 1, POINTS)  see `lobatto_rule`
    panels  (DEEPEST, 6)          t, K and B at both ends of panels that wait
    walls   (3, POINTS)           t, K and B within one
    """

    rule: Floats
    panels: Floats
    walls: Floats


def area_memory() -> AreaMemory:
    """Working memory for `curve_integral`, with the rule in it."""
    return AreaMemory(lobatto_rule(), np.empty((DEEPEST, 6)), np.empty((3, POINTS)))


@cache
def lobatto_rule(points: int = POINTS) -> Floats:
    """Gauss-Lobatto points in row 0, and weights w_i d l_j/dx(x_i) in the rows i + 1, with the Lagrange
    polynomials l_j of the points: the integral of K dB is the sum of K_i rule[i + 1, j] B_j."""
    basis = legendre.Legendre.basis(points - 1)
    x = np.concatenate([[-1.0], np.sort(basis.deriv().roots().real), [1.0]])
    weights = 2.0 / (points * (points - 1) * basis(x) ** 2)
    values, slopes = np.empty((points, points)), np.empty((points, points))
    for n in range(points):
        one = legendre.Legendre.basis(n)
        values[:, n], slopes[:, n] = one(x), one.deriv()(x)
    return np.vstack([x, weights[:, None] * (slopes @ np.linalg.inv(values))])


def quadrant_area(arcs: Arcs, curves: Curves) -> float:
    """Area within K >= 0, B >= 0 of what rings of arcs enclose [N² s/m²].

    A blurred corner has two walls, the end of one arc and the beginning of the next: their chord counts.
    """
    along = straight_integrals(arcs.first, arcs.last).tolist()
    for k in arcs.curved:
        arc = arcs[k]
        along[k] = curves[arc.member].integral(arc)
    corners = straight_integrals(arcs.last, arcs.first[arcs.next_arc]).tolist()
    return max(sum(sum(step for k in ring for step in (along[k], corners[k])) for ring in arcs.rings), 0.0)


@compiled
def straight_integrals(first: Floats, last: Floats) -> Floats:
    """Integral of K dB over the part with K > 0 and B > 0 of straight edges between walls (n, 2): (n,)."""
    out = np.empty(len(first))
    for i in range(len(first)):
        out[i] = straight_integral(first[i, 0], first[i, 1], last[i, 0], last[i, 1])
    return out


@compiled
def arc_integral(circle: CircleFactors, area: AreaMemory, t: Floats, first: Floats, last: Floats) -> float:
    """Integral of K dB over the part with K > 0 and B > 0 of an arc of the curve.

    t            (n,)  ascending or falling tan(theta/2) from end to end, so dense that a few are one panel
    first, last  (2,)  the walls at its ends
    """
    n = len(t)
    K, B, lanes = np.empty(n), np.empty(n), np.empty(LANES_SIZE)
    walls_of_samples(circle, t[1:], n - 2, K[1:], B[1:], lanes)
    K[0], B[0], K[n - 1], B[n - 1] = first[0], first[1], last[0], last[1]
    return curve_integral(circle, area, lanes, t, K, B, n)


@compiled_lean
def straight_integral(K0: float, B0: float, K1: float, B1: float) -> float:
    """Integral of K dB over the part with K > 0 and B > 0 of a straight edge."""
    low, high = 0.0, 1.0  # the part, in shares of the way
    for a, b in ((K0, K1), (B0, B1)):
        if a * b < 0.0:
            share = a / (a - b)
            low, high = (max(low, share), high) if a < 0.0 else (low, min(high, share))
    middle = 0.5 * (low + high)
    K, B = K0 + middle * (K1 - K0), B0 + middle * (B1 - B0)
    # K is linear along it: its mean is that at the middle
    return K * (B1 - B0) * (high - low) if low < high and K > 0.0 and B > 0.0 else 0.0


@compiled_lean
def end_value(
    circle: CircleFactors, of: int, values: Floats, t: Floats, n: int, last: bool
) -> tuple[float, float]:
    """The t at which the first or last of n walls of a curve counts for changes of sign, and K or B there: its own
    t; but if it lies on an axis, or at t = 0 or inf, drawn in towards its neighbour by END_MARGIN of the step.

    of      OF_K or OF_B
    values  K or B of the walls
    last    True: of the last wall; False: of the first
    """
    end, neighbour = (n - 1, n - 2) if last else (0, 1)
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(values[i]))
    at, beside = t[end], t[neighbour]
    if 0.0 < at < np.inf and abs(values[end]) > ON_AXIS * largest:
        return at, values[end]
    if at == 0.0:
        drawn = END_MARGIN * beside
    elif at == np.inf:
        drawn = beside / END_MARGIN
    else:
        # towards a neighbour at t = 0 or inf the step counts as t itself
        step = (1.0 if beside == np.inf else -1.0) * at if beside in (0.0, np.inf) else beside - at
        drawn = at + END_MARGIN * step
    if not 0.0 < drawn < np.inf:  # from one end of the circle to the other without a sample
        return at, values[end]
    K, B = wall_on_circle(circle, drawn)
    return drawn, K if of == OF_K else B


@compiled_lean
def curve_integral(
    circle: CircleFactors, area: AreaMemory, lanes: Floats, t: Floats, K: Floats, B: Floats, n: int
) -> float:
    """Integral of K dB over the part with K > 0 and B > 0 of a curve given by n walls.

    t, K, B  of the walls, in the order of the walk, at least n;   lanes  working memory of `wall_samples`

    It is split where the curve crosses an axis, so that each panel lies within the quadrant or outside.
    """
    total = 0.0
    # where the panel begins; and where the interval does for changes of the sign of K, and of that of B
    from_t, from_K, from_B, intervals = t[0], K[0], B[0], 0
    K_t, K_value = end_value(circle, OF_K, K, t, n, False)
    B_t, B_value = end_value(circle, OF_B, B, t, n, False)
    for i in range(1, n):
        at = t[i - 1]
        next_K_t, next_K, next_B_t, next_B = t[i], K[i], t[i], B[i]
        if i == n - 1:
            next_K_t, next_K = end_value(circle, OF_K, K, t, n, True)
            next_B_t, next_B = end_value(circle, OF_B, B, t, n, True)
        of_K = zero_between(circle, OF_K, NO_LINE, K_t, next_K_t) if K_value * next_K < 0.0 else np.nan
        of_B = zero_between(circle, OF_B, NO_LINE, B_t, next_B_t) if B_value * next_B < 0.0 else np.nan
        K_t, K_value, B_t, B_value = next_K_t, next_K, next_B_t, next_B
        for nearer in (True, False):
            # of two crossings first the one nearer to where the interval begins
            first_is_K = not abs(of_B - at) < abs(of_K - at)
            zero = of_K if first_is_K == nearer else of_B
            if zero == zero:  # not nan: there is such a crossing
                x, y = wall_on_circle(circle, zero)
                x, y = (0.0, y) if zero == of_K else (x, 0.0)
                total += _panel(circle, area, lanes, total, from_t, from_K, from_B, zero, x, y)
                from_t, from_K, from_B, intervals = zero, x, y, 0
        intervals += 1
        if intervals >= PANEL or i == n - 1:
            total += _panel(circle, area, lanes, total, from_t, from_K, from_B, t[i], K[i], B[i])
            from_t, from_K, from_B, intervals = t[i], K[i], B[i], 0
    return total


@compiled_apart
def _panel(
    circle: CircleFactors,
    area: AreaMemory,
    lanes: Floats,
    so_far: float,
    a: float,
    Ka: float,
    Ba: float,
    b: float,
    Kb: float,
    Bb: float,
) -> float:
    """Integral of K dB over the curve from the wall Ka, Ba at t = a to Kb, Bb at b, within which neither changes
    its sign; 0 outside of K > 0, B > 0.

    so_far  the integral up to there, by whose size ACCURACY counts
    """
    if a == b:
        return 0.0
    stack, total = area.panels, 0.0  # t, K and B at both ends of panels that wait, the next one last
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3], stack[0, 4], stack[0, 5] = a, Ka, Ba, b, Kb, Bb
    depth, halvings = 0, 0
    while depth >= 0:
        row = stack[depth]
        a, Ka, Ba, b, Kb, Bb = row[0], row[1], row[2], row[3], row[4], row[5]
        far = a + b > 2.0  # the middle of the panel is beyond t = 1
        middle = _between(a, b, 0.0, far)
        Km, Bm = wall_on_circle(circle, middle)
        if halvings == 0 and not (Km > 0.0 and Bm > 0.0):  # the ends may lie on an axis
            return 0.0
        whole = _rule(circle, area, lanes, a, Ka, Ba, b, Kb, Bb, far)
        left = _rule(circle, area, lanes, a, Ka, Ba, middle, Km, Bm, far)
        right = _rule(circle, area, lanes, middle, Km, Bm, b, Kb, Bb, far)
        size = max(abs(so_far + total), abs(left + right))
        halvings += 1
        # rounding, and what is no number, never agree
        if abs(left + right - whole) <= ACCURACY * size or halvings > HALVINGS or depth + 1 == DEEPEST:
            total += left + right
            depth -= 1
        else:
            row[0], row[1], row[2] = middle, Km, Bm
            depth += 1
            row = stack[depth]
            row[0], row[1], row[2], row[3], row[4], row[5] = a, Ka, Ba, middle, Km, Bm
    return total


@compiled_lean
def _between(a: float, b: float, x: float, far: bool) -> float:
    """The t at x in [-1, 1] of a panel from a to b: linear in t, or far from 0 in 1/t."""
    if far:
        return 2.0 / ((1.0 - x) / a + (1.0 + x) / b)
    return 0.5 * ((1.0 - x) * a + (1.0 + x) * b)


@compiled_apart
def _rule(
    circle: CircleFactors,
    area: AreaMemory,
    lanes: Floats,
    a: float,
    Ka: float,
    Ba: float,
    b: float,
    Kb: float,
    Bb: float,
    far: bool,
) -> float:
    """Integral of K dB over one panel from the wall Ka, Ba at t = a to Kb, Bb at b by the rule.

    far  True: the rule's points are taken in 1/t; False: in t
    """
    rule, t, K, B = area.rule, area.walls[0], area.walls[1], area.walls[2]
    n, total = rule.shape[1], 0.0
    for i in range(1, n - 1):
        t[i - 1] = _between(a, b, rule[0, i], far)
    walls_of_samples(circle, t, n - 2, K[1:], B[1:], lanes)
    # walls at the panel's ends are given; only those at the nodes between are solved for
    K[0], B[0], K[n - 1], B[n - 1] = Ka, Ba, Kb, Bb
    for i in range(n):
        # dB by differentiating the polynomial through all nodes, so that the curve's slope is not needed
        slope = 0.0
        for j in range(n):
            slope += rule[i + 1, j] * B[j]
        total += K[i] * slope
    return total


# Walls whose stiffnesses differ by a smaller share are as stiff as each other.
AS_STIFF: Final = 1e-13


@dataclass(frozen=True)
class Peak:
    """The stiffest wall of the closure of the stable set with K > 0, B >= 0.

    stiffness, damping  K [N/m], B [N s/m]
    angles              of the roots on the circle there: one, or two at a corner, ascending
    members             index of the loop that has each of these roots (`Arcs.member`)
    """

    stiffness: float
    damping: float
    angles: tuple[float, ...]
    members: tuple[int, ...] = (0,)


@compiled
def is_stiffer(K: float, B: float, stiffness: float, damping: float) -> bool:
    """Whether a wall is stiffer than another one, or as stiff and more damped.

    Where the edge stands upright at its largest stiffness, rounding would choose among its ends otherwise.
    """
    return bool(stiffness * (1.0 + AS_STIFF) < K or (stiffness * (1.0 - AS_STIFF) <= K and damping < B))


@compiled
def stiffest_index(K: Floats, B: Floats, least: float) -> int:
    """Number of the stiffest of several walls with K > least and B >= 0, by `is_stiffer`; -1 if there is none."""
    best = -1
    for k in range(len(K)):
        if K[k] > least and B[k] >= 0.0 and (best < 0 or is_stiffer(K[k], B[k], K[best], B[best])):
            best = k
    return best


def find_peak(arcs: Arcs, curves: Curves, stiffness_scale: float) -> Peak | None:
    """The largest stiffness over the whole stable set within K > 0, B >= 0; None if there is no such wall.

    It is attained on the edge: at a smooth maximum of K (dK/dtheta = 0), at a corner, or where the edge crosses
    B = 0.

    stiffness_scale  largest |K| on the edge [N/m]; below 1e-10 of it K is taken as rounding of 0
    """
    crossed, crossings = arcs.crossings(DAMPING)
    crossings[:, DAMPING] = 0.0
    walls = [arcs.last, arcs.first[arcs.next_arc], crossings]
    # number of the arc, and the place on it, of each wall that is no corner; a straight arc has one place for all
    along = list(zip(crossed.tolist(), arcs.start[crossed].tolist(), strict=True))
    for k in arcs.curved:
        arc = arcs[k]
        curve = curves[arc.member]
        for component in (DAMPING, SLOPE):
            thetas = curve.zeros(arc, component)
            if len(thetas):
                K, B = curve.walls(thetas)
                walls.append(np.column_stack([K, np.zeros_like(K) if component == DAMPING else B]))
                along += [(k, theta) for theta in thetas.tolist()]
    K, B = np.vstack(walls).T
    best, corners = stiffest_index(K, B, 1e-10 * stiffness_scale), 2 * len(arcs)
    if best < 0:
        return None
    # of walls the first n are the arcs' last ones, the next n those with which the arcs after them begin
    if best < corners:
        last = best % len(arcs)
        after = int(arcs.next_arc[last])
        places = [(last, float(arcs.end[last])), (after, float(arcs.start[after]))]
    else:
        places = [along[best - corners]]
    roots = {(_angle(arcs[k], curves, place), int(arcs.member[k])) for k, place in places}
    angles, members = zip(*sorted(roots), strict=True)
    return Peak(float(K[best]), float(B[best]), angles, members)


def _angle(arc: Arc, curves: Curves, place: float) -> float:
    """Angle theta of the root at a place on an arc: at its start, its end, or a parameter of its curve."""
    return float(curves[arc.member].angles(np.array([place]))[0]) if arc.curved else place


def largest_damping(
    arcs: Arcs, curves: Curves, stiffness_scale: float, stable: Callable[[float, float], bool]
) -> float:
    """Supremum of B >= 0 [N s/m] that is stable for all sufficiently small K > 0; 0 if there is none.

    The stable intervals of the line K = 0+ end where the edge crosses or touches K = 0; each interval is tested at
    its middle.

    stiffness_scale  largest |K| on the edge [N/m]
    stable           function that tells whether a wall (K, B) is stable
    """
    corners: list[list[float]] = [*arcs.first.tolist(), *arcs.last.tolist()]
    # corners on K = 0 but for rounding; below, K = 0+ is tested at 1e-7 of the scale, and intervals of damping
    # shorter than 1e-9 of the largest are rounding
    stops = {0.0, *(B for K, B in corners if abs(K) <= 1e-8 * stiffness_scale)}
    stops.update(arcs.crossings(STIFFNESS)[1][:, 1].tolist())
    for k in arcs.curved:
        arc = arcs[k]
        curve = curves[arc.member]
        stops.update(curve.walls(curve.zeros(arc, STIFFNESS))[1].tolist())
    ordered = sorted(stop for stop in stops if stop >= 0.0)
    spacing = 1e-9 * (ordered[-1] or 1.0)
    for low, high in zip(ordered[-2::-1], ordered[:0:-1], strict=True):
        if high - low > spacing and stable(1e-7 * stiffness_scale, 0.5 * (low + high)):
            return high
    return 0.0
