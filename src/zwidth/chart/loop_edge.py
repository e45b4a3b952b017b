"""The edge of one loop's stable set: by compiled stages, and where these are in doubt by eigenvalues.

Walls on it are judged as it is made (see below): some between its samples before its numbers are read, and
all its points where they are drawn. Where one is none of the edge the curve is traced again, through that place.

Whether each wall of an edge has its largest root on the circle: the edge is judged as it is made.

Two things can make a wall on a piece of the curve none of the edge, although both samples beside it are:

    another root is outside   a branch crosses the edge twice between two samples, round a lens of unstable walls
    its own root is off       the factors of which the curve is made have lost digits that the states still have

The first shows in the flag of the wall itself, which is that of a sample there. The second shows in the states,
where these are computed another way than the factors: to first order the root nearest to z is r/r' away, with

    r(z) = 1 + f (z - L0)^-1 g,      f = K position + B velocity

What either leaves open, and all corners, where two roots are on the circle at once, eigenvalues decide.

What charts of every kind read off an edge of known curves stands in `TracedEdge`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan
from typing import Final, NamedTuple, TypedDict

import numpy as np
import shapely

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.arcs import PAIR, ArcPoints, Arcs, Curves, outline, sample_arcs, simple_rings
from zwidth.chart.area import Peak, find_peak, largest_damping, quadrant_area
from zwidth.chart.chart_base import BoundaryArc
from zwidth.chart.chart_batch import ALL_NUMBERS, memory_of, read_first
from zwidth.chart.curve import trace
from zwidth.chart.edge_arcs import SAME_CORNER
from zwidth.chart.edge_by_eigenvalues import EdgeRings, arcs_of_rings, closed_rings, rings_of
from zwidth.chart.edge_memory import AREA, DOUBTFUL, FOUND, LARGEST_DAMPING, SAMPLES, EdgeMemory
from zwidth.chart.tracer import CIRCLE_TOLERANCE, Tracer
from zwidth.chart.verdict import distances_from_circle
from zwidth.chart.wall_samples import EDGE, HIDDEN, NO_EDGE
from zwidth.errors import ChartError
from zwidth.loop.loop_table import DEGREE
from zwidth.loop.realisation import StateSpace


class PeakFields(TypedDict):
    """Fields of a `Chart` about its stiffest wall."""

    stiffness_max: float
    damping_at_stiffness_max: float
    frequencies_at_stiffness_max: tuple[float, ...]


class ChartFields(PeakFields):
    """Fields of a `DrawnChart`."""

    drawn_regions: tuple[Floats, ...]
    drawn_boundary: tuple[BoundaryArc, ...]
    damping_max: float
    stable_area: float


@dataclass(frozen=True)
class TracedEdge:
    """Arcs with the curves that they are pieces of, and points along each so dense that chords lie on them."""

    arcs: Arcs
    curves: Curves

    @cached_property
    def arc_points(self) -> list[ArcPoints]:
        """Points along each arc so dense that chords lie on it."""
        return sample_arcs(self.arcs, self.curves)

    @cached_property
    def outlines(self) -> list[Floats]:
        """Each ring as a closed walk of walls (k, 2)."""
        return [outline([self.arc_points[k] for k in ring]) for ring in self.arcs.rings]

    @cached_property
    def simple(self) -> list[bool]:
        """For each of `outlines`, whether it does not cross itself."""
        return [len(outline) > 3 and bool(shapely.Polygon(outline).is_valid) for outline in self.outlines]

    @cached_property
    def stiffness_scale(self) -> float:
        """Largest |K| on the edge [N/m]; 0 if there is none."""
        return max((float(np.max(np.abs(outline[:, 0]))) for outline in self.outlines), default=0.0)

    @cached_property
    def peak(self) -> Peak | None:
        """The stiffest wall with K > 0, B >= 0; None if there is none."""
        return find_peak(self.arcs, self.curves, self.stiffness_scale)

    @cached_property
    def area(self) -> float:
        """Area within K >= 0, B >= 0 [N² s/m²]."""
        return quadrant_area(self.arcs, self.curves) if self.peak else 0.0

    def largest_damping(self, stable: Callable[[float, float], bool]) -> float:
        """Supremum of B >= 0 stable for all sufficiently small K > 0 [N s/m].

        stable  function that tells whether a wall (K, B) is stable
        """
        return largest_damping(self.arcs, self.curves, self.stiffness_scale, stable)

    @cached_property
    def regions(self) -> tuple[Floats, ...]:
        """The stable cells as closed rings (k, 2) of [K, B] that do not cross themselves."""
        return simple_rings(self.outlines, self.simple)

    def boundary(self, period: float | Mapping[int, float]) -> tuple[BoundaryArc, ...]:
        """The arcs with their walls and frequencies [Hz]; period as for `chart_fields`."""
        members = self.arcs.member.tolist()
        several = isinstance(period, Mapping)
        periods = period if isinstance(period, Mapping) else dict.fromkeys(members, period)
        return tuple(
            BoundaryArc(K, B, thetas / (2.0 * np.pi * periods[member]), member if several else 0)
            for member, (thetas, K, B) in zip(members, self.arc_points, strict=True)
        )

    def chart_fields(
        self, period: float | Mapping[int, float], stable: Callable[[float, float], bool]
    ) -> ChartFields:
        """The fields that all charts drawn at once share.

        period  sampling period [s]; of each member, where the arcs are those of several loops
        stable  function that tells whether a wall (K, B) is stable
        """
        return ChartFields(
            drawn_regions=self.regions,
            drawn_boundary=self.boundary(period),
            **peak_fields(self.peak, period),
            damping_max=self.largest_damping(stable),
            stable_area=self.area,
        )


def peak_fields(peak: Peak | None, period: float | Mapping[int, float]) -> PeakFields:
    """The fields of a chart about its stiffest wall; period as for `TracedEdge.chart_fields`."""
    if peak is None:
        return PeakFields(stiffness_max=nan, damping_at_stiffness_max=nan, frequencies_at_stiffness_max=())
    roots = zip(peak.angles, peak.members, strict=True)
    periods = (period[member] if isinstance(period, Mapping) else period for member in peak.members)
    frequencies = {angle / (2.0 * np.pi * T) for (angle, _), T in zip(roots, periods, strict=True)}
    return PeakFields(
        stiffness_max=peak.stiffness,
        damping_at_stiffness_max=peak.damping,
        frequencies_at_stiffness_max=tuple(sorted(frequencies)),
    )


# How often a curve is traced again through walls that are none of its edge: each time finds a lens within one that
# the last has found.
ROUNDS = 3
# Share by which two numbers of one edge differ by the ways in which they are computed.
SAME_NUMBER = 1e-9


@dataclass(frozen=True)
class LoopEdge:
    """The edge of one loop's stable set, and what is read off it.

    tracer          the loop on the circle
    rings           its arcs, as the compiled stages left them or as eigenvalues found them
    blur            share of the set's size to which corners are known
    peak            the stiffest wall with K > 0, B >= 0; None if there is none
    largest_damping [N s/m]
    area            within K >= 0, B >= 0 [N² s/m²]
    judged          the edge with its points, all of which have been judged; None: not yet
    """

    tracer: Tracer
    rings: EdgeRings | Arcs
    blur: float
    peak: Peak | None
    largest_damping: float
    area: float
    judged: TracedEdge | None = None

    @classmethod
    def of(cls, tracer: Tracer) -> LoopEdge:
        """The edge of a loop on a circle.

        Raises  ChartError  if it cannot be closed, or if walls on it are not at the limit of stability
        """
        memory = memory_of(tracer.table)
        status, _ = read_first(tracer.table, memory, ALL_NUMBERS, tracer.radius)
        if status == DOUBTFUL:
            return cls._by_eigenvalues(tracer, None)
        crossed = crossed_between_samples(tracer, memory)
        if len(crossed):
            return cls._by_eigenvalues(tracer, crossed)
        peak = None
        if status == FOUND:
            stiffness, damping, *t = memory.peak.tolist()
            angles = tuple(sorted({float(2.0 * np.arctan(one)) for one in t}))
            peak = Peak(stiffness, damping, angles, (0,) * len(angles))
        numbers = memory.numbers
        edge = cls(
            tracer, rings_of(memory), SAME_CORNER, peak, float(numbers[LARGEST_DAMPING]), float(numbers[AREA])
        )
        if tracer.loop.has_states_apart:
            edge.traced  # noqa: B018  # judged at once: no number of factors that have lost digits is given
        return edge

    @classmethod
    def _by_eigenvalues(cls, tracer: Tracer, angles: Floats | None) -> LoopEdge:
        """The edge where rounding leaves a stage open: what is open is decided by eigenvalues.

        angles  at which the curve is sampled besides its grid; None: at none
        """
        arcs, blur = closed_rings(tracer, angles)
        edge, blur = _judged_or_retraced(tracer, TracedEdge(arcs, {0: tracer}), blur, angles)
        numbers = edge.peak, edge.largest_damping(tracer.stable), edge.area
        return cls(tracer, edge.arcs, blur, *numbers, judged=edge)

    @cached_property
    def arcs(self) -> Arcs:
        """The edge's rings of arcs, in the form of all charts."""
        return self.rings if isinstance(self.rings, Arcs) else arcs_of_rings(self.rings)

    @cached_property
    def traced(self) -> TracedEdge:
        """The edge with points so dense that chords lie on it.

        An outline crosses itself where a small loop of the curve lies between two samples: then the curve is
        traced again, also at the angles of the outline's points; where that cannot be closed it stays as it is.

        Raises  ChartError  if walls on it are not at the limit of stability, and tracing it again does not help or
                            changes its numbers
        """
        edge = TracedEdge(self.arcs, {0: self.tracer}) if self.judged is None else self.judged
        again, blur = edge, self.blur
        angles: Floats | None = None
        if not all(edge.simple):
            with suppress(ChartError):
                angles = _angles_of(edge)
                arcs, blur = closed_rings(self.tracer, angles)
                again = TracedEdge(arcs, {0: self.tracer})
        if again is self.judged:
            return again
        drawn, _ = _judged_or_retraced(self.tracer, again, blur, angles)
        if drawn is not again and not self._has_numbers_of(drawn):
            raise ChartError(
                "walls that eigenvalues find unstable lie within the edge of the stable set as it was read first, "
                "and its numbers change where these are cut out; check walls one by one"
            )
        return drawn

    def _has_numbers_of(self, edge: TracedEdge) -> bool:
        """Whether another edge has the same largest stiffness, damping and area, to a share SAME_NUMBER."""
        stiffness, other = (0.0 if peak is None else peak.stiffness for peak in (self.peak, edge.peak))
        pairs = (
            (stiffness, other),
            (self.area, edge.area),
            (self.largest_damping, edge.largest_damping(self.tracer.stable)),
        )
        return all(abs(a - b) <= SAME_NUMBER * abs(a) for a, b in pairs)


def _angles_of(edge: TracedEdge) -> Floats:
    """Angles theta (k,) of all points along an edge's arcs but their ends."""
    return np.concatenate([thetas[1:-1] for thetas, _, _ in edge.arc_points])


def _judged_or_retraced(
    tracer: Tracer, edge: TracedEdge, blur: float, angles: Floats | None
) -> tuple[TracedEdge, float]:
    """An edge all of whose walls are at the limit of stability, and its corners' blur: the one given, or where
    walls on it are not, the curve traced again through these.

    angles  at which the given one was traced besides its grid; None: at none
    Raises  ChartError  where that does not help
    """
    for tried in range(ROUNDS + 1):
        off = walls_off_circle(tracer, edge, blur <= SAME_CORNER)
        if not len(off.walls):
            return edge, blur
        if tried == ROUNDS or not len(off.angles):
            break
        angles = off.angles if angles is None else np.union1d(angles, off.angles)
        arcs, blur = closed_rings(tracer, angles)
        edge = TracedEdge(arcs, {0: tracer})
    K, B = off.walls[0]
    raise ChartError(
        f"{len(off.walls)} of {off.judged} walls on the edge of the stable set, such as {K:.6g} N/m and {B:.6g} "
        f"N s/m, have their largest root up to {off.distance:.2g} off the circle on which it should be: rounding "
        "hides the edge, or another vibration cuts it; check walls one by one"
    )


def trace_edge(tracer: Tracer, member: int = 0) -> TracedEdge:
    """The edge of a loop's stable set with its points.

    member  index of the loop, given to its arcs
    """
    edge = LoopEdge.of(tracer).traced
    if member == 0:
        return edge
    return TracedEdge(replace(edge.arcs, member=np.full(len(edge.arcs), member)), {member: tracer})


# Where walls between two samples of the edge are tried before its numbers are read, in shares of the step. Fewer
# would leave wider lenses to be found when the edge is drawn, whose points are some ten times as dense.
BETWEEN: Final = np.array([0.25, 0.5, 0.75])


class OffCircle(NamedTuple):
    """Walls of an edge whose largest root is not on the circle.

    judged    how many walls were judged
    walls     (k, 2)  K, B of those that are off
    angles    (m,)    of those of them that lie on the curve, in (0, pi)
    distance  of the largest root from the circle, the farthest
    """

    judged: int
    walls: Floats
    angles: Floats
    distance: float


def crossed_between_samples(tracer: Tracer, memory: EdgeMemory) -> Floats:
    """Angles (k,) between neighbouring samples of the edge at which the wall is none of it, since a branch crosses
    the edge twice there."""
    n, N = int(memory.counts[SAMPLES]), int(memory.circle.sizes[DEGREE])
    t, edge = memory.samples.t[:n], memory.samples.flag[:n] == EDGE
    first = np.flatnonzero(edge[1:] & edge[:-1])
    if not len(first):
        return np.empty(0)
    between = (t[first, None] + BETWEEN * (t[first + 1] - t[first])[:, None]).ravel()
    polynomials = np.ascontiguousarray(memory.polynomials.coefficients[:, : N + 1])
    K, B, flags = trace(memory.circle, polynomials, between)
    angles = 2.0 * np.arctan(between)
    if (hidden := np.flatnonzero(flags == HIDDEN)).size:
        flags[hidden] = tracer.edge_by_eigenvalues(angles[hidden], K[hidden], B[hidden])
    return np.asarray(angles[flags == NO_EDGE])


def walls_off_circle(tracer: Tracer, edge: TracedEdge, corners: bool) -> OffCircle:
    """Those of an edge's points whose largest root is not on the circle; of straight arcs their ends alone tell.

    corners  whether corners are known well enough to be judged, too: False where rounding blurs them
    """
    suspects, judged = [np.empty((0, 3))], 0  # rows: angle (nan at a corner), K, B
    for kind, (thetas, K, B) in zip(edge.arcs.kind.tolist(), edge.arc_points, strict=True):
        judged += len(K)
        points = np.column_stack([thetas, K, B])
        if corners:
            ends = points[[0, -1]]
            ends[:, 0] = np.nan
            suspects.append(ends)
        if kind == PAIR and len(K) > 2:
            inner = points[1:-1] if thetas[0] < thetas[-1] else points[-2:0:-1]
            suspects.append(inner[_is_suspect(tracer, inner)])
    some = np.vstack(suspects)
    distance = np.abs(distances_from_circle(tracer.loop, some[:, 1], some[:, 2], tracer.radius))
    off = distance > 0.0
    angles = some[off, 0]
    return OffCircle(
        judged, some[off, 1:], np.unique(angles[np.isfinite(angles)]), float(np.max(distance, initial=0.0))
    )


def _is_suspect(tracer: Tracer, points: Floats) -> Flags:
    """Which walls (k, 3) of angle, K and B, in ascending order, are to be judged by eigenvalues."""
    thetas, K, B = np.ascontiguousarray(points.T)
    suspect: Flags = tracer.trace(thetas)[2] != EDGE
    if tracer.loop.has_states_apart:
        z = tracer.radius * np.exp(1j * thetas)
        suspect |= ~(_distance_by_states(tracer.loop.state_space, z, K, B) <= CIRCLE_TOLERANCE)
    return suspect


def _distance_by_states(space: StateSpace, z: Complexes, K: Floats, B: Floats) -> Floats:
    """Distance |r/r'| from places z (k,) to the nearest roots of walls K, B (k,), one each, to first order (see
    the file's head); not finite where z is a pole."""
    from scipy.linalg import matrix_balance, schur

    balanced, (scale, _) = matrix_balance(space.open, permute=False, separate=True)
    T, Q = schur(balanced, output="complex")
    force = Q.conj().T @ (space.input / scale)
    position, velocity = (each * scale @ Q for each in (space.position, space.velocity))
    f, n = np.multiply.outer(K, position) + np.multiply.outer(B, velocity), len(T)
    right, left = np.zeros((len(z), n), dtype=complex), np.zeros((len(z), n), dtype=complex)
    # in the coordinates of T: right = (z - T)^-1 g, left = f (z - T)^-1, r = 1 + f right and r' = -left right
    with np.errstate(all="ignore"):
        for i in reversed(range(n)):
            right[:, i] = (force[i] + right[:, i + 1 :] @ T[i, i + 1 :]) / (z - T[i, i])
        for j in range(n):
            left[:, j] = (f[:, j] + left[:, :j] @ T[:j, j]) / (z - T[j, j])
        return np.asarray(np.abs((1.0 + np.sum(f * right, axis=1)) / np.sum(left * right, axis=1)))
