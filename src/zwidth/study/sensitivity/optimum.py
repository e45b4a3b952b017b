"""Change of the largest stiffness with any change of the loop, to first order.

The stiffest wall is an extreme point of the stable set's edge. To first order it moves with the pieces of edge
that meet in it, and each piece gives one equation for its motion dwall = (dK, dB),  n . dwall = dr:

    curve at a fixed angle       n = (B', -K'),  r = n . (K, B) at that angle
    line of a real root          n = (s, v),     r = -(a + s K + v B) at the wall held fixed
    the axis B = 0               n = (0, 1),     r = 0

with K', B' the curve's derivatives by the angle. Where K' = 0, a smooth maximum, the first equation alone gives
dK = dr/B', which is the change of K at a fixed angle (envelope theorem). At a corner two pieces give two
equations: implicit differentiation of K1(angle 1) = K2(angle 2), B1 = B2 with both angles free.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi
from typing import Final, Literal, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.chart.area import Peak
from zwidth.chart.chart import StabilityChart
from zwidth.chart.curve import wall_at
from zwidth.chart.loop_polynomials import LoopPolynomials, fill_loop_polynomials, most_degree, polynomial_memory
from zwidth.chart.real_root_lines import end_of_curve
from zwidth.chart.tracer import Tracer, tracer_of
from zwidth.compiled import compiled, compiled_lean
from zwidth.errors import NoAnswerError
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import DEGREE, CircleFactors, LoopTable, factor_memory
from zwidth.resources import in_chunks

Kind = Literal["smooth maximum", "corner", "edge at B = 0", "end of the curve"]

# If a Newton step of K'(angle) is longer than this share of the angle, the wall is not a smooth maximum.
AT_MAXIMUM: Final = 1e-5  # share of the angle within which a Newton step finds the maximum

# Extreme points closer than this share of the stable set's size are one.
APART: Final = 1e-3  # shares of the set's size between two different peaks

# Kinds of pieces of the edge.
CURVE, LINE, AXIS, END = range(4)


class EdgePieces(NamedTuple):
    """Pieces of a loop's edge that meet in a wall, as equations for the motion of that wall with the loop.

    kind    (n,)    CURVE at a fixed angle, LINE of a real root, AXIS B = 0, or END of the curve
    angle   (n,)    of the roots on the circle; 0 for z = 1, pi for z = -1
    normal  (n, 2)  n = (n_K, n_B) of n . dwall = dr
    start   (n,)    r for the loop itself, of a LINE; else 0
    weight  (n,)    dK of the wall per dr of each piece
    wall    (2,)    K [N/m], B [N s/m] of the wall
    """

    kind: Ints
    angle: Floats
    normal: Floats
    start: Floats
    weight: Floats
    wall: Floats


@dataclass(frozen=True)
class Optimum:
    """The stiffest wall and the part of the edge on which it lies.

    peak    the wall, and the angles of its roots
    kind    a smooth maximum of the edge; a corner of two pieces of edge; an edge that crosses B = 0; or a double
            real root at an end of the curve
    pieces  of the edge
    """

    peak: Peak
    kind: Kind
    pieces: EdgePieces

    def stiffness_to_first_order(self, loop: Loop) -> float:
        """A number whose derivative by anything in the loop is that of the largest stiffness [N/m]; for the loop
        itself it is the largest stiffness. Raises NoAnswerError where the curve's end goes to infinity."""
        (stiffness,) = self.stiffnesses_to_first_order(loop.table).tolist()
        if self.kind == "end of the curve" and not np.isfinite(stiffness):
            raise NoAnswerError("the curve's end goes to infinity")
        return float(stiffness)

    def stiffnesses_to_first_order(self, loops: LoopTable) -> Floats:
        """`stiffness_to_first_order` of each loop of a table, (N,); nan for one without sections, and where the
        curve's end goes to infinity."""
        out = np.full(len(loops.rows), nan)
        most = most_degree(loops)

        def fill_chunk(first: int, last: int) -> None:
            _stiffnesses(loops, factor_memory(loops), polynomial_memory(most), self.pieces, out, first, last)

        in_chunks(fill_chunk, len(out))
        return out


@compiled
def _stiffnesses(
    loops: LoopTable,
    circle: CircleFactors,
    polynomials: LoopPolynomials,
    pieces: EdgePieces,
    out: Floats,
    first: int,
    last: int,
) -> None:
    """Fill in `out` (N,) with `stiffness_to_first_order` of loops first to last - 1 [N/m]; one without sections is
    left as it is.

    circle, polynomials  memory for one loop
    """
    for i in range(first, last):
        if loops.section_count[i] == 0:
            continue
        # 1.0: radius of the circle
        fill_loop_polynomials(loops, i, 1.0, circle, polynomials)
        stiffness = 0.0
        for k in range(len(pieces.kind)):
            stiffness += pieces.weight[k] * _read_piece(circle, polynomials.coefficients, pieces, k)
        out[i] = stiffness


@compiled_lean
def _read_piece(circle: CircleFactors, polynomials: Floats, pieces: EdgePieces, k: int) -> float:
    """r of piece k of the edge, see `EdgePieces`, for the loop whose factors stand in `circle`; of an END of the
    curve its K [N/m].

    polynomials  (3, N + 1 or more)  coefficients of the polynomials of 1, K and B in the line of a real root
    """
    kind, angle, N = pieces.kind[k], pieces.angle[k], circle.sizes[DEGREE]
    if kind == CURVE:
        K, B, _, _ = wall_at(circle, angle)
        return float(pieces.normal[k, 0] * K + pieces.normal[k, 1] * B)
    if kind == AXIS:
        return 0.0
    if kind == LINE:
        outer = 0 if angle == 0.0 else N  # lowest coefficient for z = 1, highest for z = -1
        a, s, v = polynomials[0, outer], polynomials[1, outer], polynomials[2, outer]
        sK, vB = s * pieces.wall[0], v * pieces.wall[1]
        # scaled by itself: a line is the same line at any multiple, and its scale jumps with the number of roots
        return float(pieces.start[k] - (a + sK + vB) / (abs(a) + abs(sK) + abs(vB)))
    # the ends of the curve by t = tan(angle / 2): 0 for z = 1, infinite for z = -1
    return float(end_of_curve(polynomials, N, 0.0 if angle == 0.0 else np.inf)[0])


def optimum(loop: Loop, peak: Peak) -> Optimum:
    """Find the part of the edge on which the stiffest wall of a loop lies.

    peak    `largest_stiffness(loop)`
    Raises  NoAnswerError  where the wall is of no kind, for instance where rounding hides a piece of the edge

    >>> from zwidth.chart.chart import largest_stiffness
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> def wall_of(mass):
    ...     one, none = np.ones(1), np.zeros((1, 1))
    ...     return Loop(Plant(np.array([[mass]]), none, none, one, one), Controller(0.001))
    >>> stiffest = optimum(wall_of(0.1), largest_stiffness(wall_of(0.1)))
    >>> heavier, lighter = (stiffest.stiffness_to_first_order(wall_of(mass)) for mass in (0.1001, 0.0999))
    >>> stiffest.kind, round((heavier - lighter) / (0.002 * 68629.15), 6)
    ('smooth maximum', 1.0)
    """
    tracer = tracer_of(loop)
    inside = [angle for angle in peak.angles if 0.0 < angle < pi]
    real = [angle for angle in peak.angles if angle not in inside]
    pieces = [_curve_piece(tracer, angle) for angle in inside] + [
        _line_piece(tracer, angle, peak) for angle in real
    ]
    if len(pieces) == 1 and peak.damping == 0.0:
        return _crossing(peak, "edge at B = 0", [*pieces, _Piece(AXIS, 0.0, np.array([0.0, 1.0]))], loop.period)
    if len(pieces) == 2:
        return _crossing(peak, "corner", pieces, loop.period)
    if inside and not _is_maximum(tracer, inside[0]):
        raise NoAnswerError(
            "rounding hides the edge where the largest stiffness lies, so that it has no derivative"
        )
    # n = (1, 0): r is K itself, at the angle held fixed or at the end of the curve
    single = _Piece(CURVE if inside else END, (inside or real)[0], np.array([1.0, 0.0]))
    return Optimum(
        peak, "smooth maximum" if inside else "end of the curve", _edge_pieces(peak, [single], np.ones(1))
    )


class _Piece(NamedTuple):
    """One piece of edge, see `EdgePieces`."""

    kind: int
    angle: float
    normal: Floats
    start: float = 0.0


def _edge_pieces(peak: Peak, pieces: list[_Piece], weights: Floats) -> EdgePieces:
    """The pieces of edge that meet at the peak, with their weights: dK of the wall per dr of each."""
    return EdgePieces(
        kind=np.array([one.kind for one in pieces]),
        angle=np.array([one.angle for one in pieces]),
        normal=np.array([one.normal for one in pieces]),
        start=np.array([one.start for one in pieces]),
        weight=weights,
        wall=np.array([peak.stiffness, peak.damping]),
    )


def _curve_piece(tracer: Tracer, angle: float) -> _Piece:
    """The curve of root pairs at an angle, by its normal: a unit vector across the tangent (dK, dB)."""
    _, _, dK, dB = tracer.wall(angle)
    return _Piece(CURVE, angle, np.array([dB, -dK]) / np.hypot(dB, dK))


def _line_piece(tracer: Tracer, angle: float, peak: Peak) -> _Piece:
    """The line of walls with a root z = 1 at angle 0, else z = -1; sizes of its terms at the peak add to 1."""
    wall = np.array([1.0, peak.stiffness, peak.damping])
    line = tracer.line("plus" if angle == 0.0 else "minus")
    normal = line[1:] / float(np.abs(line) @ np.abs(wall))
    return _Piece(LINE, angle, normal, float(normal @ wall[1:]))


def _crossing(peak: Peak, kind: Kind, pieces: list[_Piece], period: float) -> Optimum:
    """The wall where two pieces of edge meet. Raises NoAnswerError where they touch without crossing.

    period  sampling period [s]
    """
    normals = np.array([one.normal for one in pieces])
    scaled = normals * np.array([1.0 / period, 1.0])  # K T and B have one unit
    if (
        np.linalg.cond(scaled / np.linalg.norm(scaled, axis=1)[:, None]) > 1e9
    ):  # parallel, as far as rounding tells
        raise NoAnswerError("two pieces of the edge touch at the largest stiffness, which then has no derivative")
    # dK = weights . dr of the equations normals dwall = dr
    weights = np.linalg.solve(normals.T, np.array([1.0, 0.0]))
    return Optimum(peak, kind, _edge_pieces(peak, pieces, weights))


def _is_maximum(tracer: Tracer, angle: float) -> bool:
    """Whether dK/dangle vanishes at the angle, as nearly as bisection can place it: a Newton step to its zero is
    short."""
    step = 1e-6 * min(angle, pi - angle)
    low, here, high = (tracer.wall(angle + shift)[2] for shift in (-step, 0.0, step))
    curvature = (high - low) / (2.0 * step)
    return bool(abs(here) <= AT_MAXIMUM * angle * abs(curvature))


def second_peak_stiffness(chart: StabilityChart) -> float:
    """Largest stiffness of the walls with K > 0, B >= 0 that are stiffest among their neighbours on the edge,
    without the stiffest of all [N/m]; nan if there is none. Accurate to 1e-6 of the set's size, as the
    regions are.

    One of these walls takes over when the stiffest gives way.

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.loop.loop import Loop
    >>> from zwidth.model.plant import Plant
    >>> from zwidth.chart.chart import stability_chart
    >>> one, none = np.ones(1), np.zeros((1, 1))
    >>> second_peak_stiffness(stability_chart(Loop(Plant(np.eye(1), none, none, one, one), Controller(0.001))))
    nan
    """
    if not chart.stiffness_max > 0.0:
        return nan
    best = nan
    size = np.array([chart.box[1] - chart.box[0], chart.box[3] - chart.box[2]])
    top = np.array([chart.stiffness_max, chart.damping_at_stiffness_max])
    for ring in chart.regions:
        walls = _cut_at_axis(ring[:-1])
        # 1e-9: K > 0 beyond rounding
        height = np.where((walls[:, 1] >= 0.0) & (walls[:, 0] > 1e-9 * size[0]), walls[:, 0], -np.inf)
        peaks = np.isfinite(height) & (height > np.roll(height, 1)) & (height >= np.roll(height, -1))
        for wall in walls[peaks]:
            if np.max(np.abs(wall - top) / size) > APART and not best >= wall[0]:  # best is nan at first
                best = float(wall[0])
    return best


def _cut_at_axis(ring: Floats) -> Floats:
    """The points of a ring (k, 2), K and B, with those added where it crosses B = 0."""
    following = np.roll(ring, -1, axis=0)
    crosses = np.flatnonzero(ring[:, 1] * following[:, 1] < 0.0)
    share = ring[crosses, 1] / (ring[crosses, 1] - following[crosses, 1])
    K = ring[crosses, 0] + share * (following[crosses, 0] - ring[crosses, 0])
    return np.insert(ring, crosses + 1, np.column_stack([K, np.zeros(len(K))]), axis=0)
