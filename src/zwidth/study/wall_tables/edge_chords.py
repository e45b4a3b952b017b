"""Edges of many loops' stable sets as chords, from the compiled stages of a chart.

They give the intervals of damping in which all walls of a band of stiffnesses are stable. A rectangle of walls
[K_low, K_high] x (B_low, B_high) that no edge of the stable set enters is stable as a whole or not at all: the
number of roots outside the circle changes at an edge only. So the edges that lie in the band, seen along B, leave
gaps, and one wall in each gap tells whether the gap is stable. A wall lies in the set if a ray from it crosses the
edge an odd number of times.
"""

from __future__ import annotations

from dataclasses import dataclass
from threading import local
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.arcs import PAIR
from zwidth.chart.chart import stability_chart
from zwidth.chart.chart_numbers import fill_nodes, read_edge
from zwidth.chart.edge_memory import ARCS, DOUBTFUL, MOST_SAMPLES, EdgeMemory, edge_memory
from zwidth.chart.edge_samples import degree_of, fill_loop
from zwidth.chart.point_chart import chart_at, table_of_points
from zwidth.chart.wall_samples import MOST_DEGREE
from zwidth.compiled import compiled, compiled_lean
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop.loop_table import COMPUTER, LoopTable, wall_on_circle
from zwidth.loop.operating_point import OperatingPoint
from zwidth.resources import in_chunks

PIECES: Final = 8  # chords between two neighbouring samples of a curve
MOST_CHORDS: Final = 3072  # of one loop; one with more is charted alone
AT_ONCE: Final = 256  # loops whose chords are in memory at full length
# Places in a chord: K and B of its first and its last wall, and how far the edge may lie beside it in K and in B.
K0, B0, K1, B1, SAG_K, SAG_B = range(6)
# A chord between two samples lies an eighth of a second difference beside its curve; twice that is allowed.
SAG: Final = 0.25  # of the largest second difference: twice that of a parabola, 1/8
RING_SAG: Final = 1e-6  # of a ring's extent: its chords stay this close to the edge (`chart.tracer.CHORD`)
STRAIGHT: Final = 1e-12  # of a ring's extent: along chords that change less the edge does not


@dataclass(frozen=True)
class LoopEdgeChords:
    """The edges of N stable sets, each as closed rings of chords; the order of the chords does not matter.

    chords   (m, 6)    K [N/m] and B [N s/m] of both ends, and how far the edge may lie beside the chord in K and B
    offsets  (N + 1,)  index of each loop's first chord; one without chords has no stable wall
    known    (N,)      False where the edge could not be closed: nothing is known of that loop
    """

    chords: Floats
    offsets: Ints
    known: Flags

    def __len__(self) -> int:
        return len(self.known)

    @classmethod
    def joined(cls, parts: list[LoopEdgeChords]) -> LoopEdgeChords:
        """The loops of several, one after the other."""
        if len(parts) == 1:
            return parts[0]
        counts = np.concatenate([np.diff(part.offsets) for part in parts])
        return cls(
            np.concatenate([part.chords for part in parts]),
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            np.concatenate([part.known for part in parts]),
        )

    @property
    def largest_stiffness(self) -> float:
        """Smallest over the loops of the largest K of an edge [N/m]; 0 where a loop has no stable wall."""
        counts = np.diff(self.offsets)
        if not len(counts) or (counts == 0).any():
            return 0.0
        return float(np.maximum.reduceat(self.chords[:, [K0, K1]].max(axis=1), self.offsets[:-1]).min())


def edges_of_points(point: OperatingPoint) -> LoopEdgeChords:
    """The edges of the stable sets at all N points of `point`, in C order whatever its shape.

    A point whose modes compiled code cannot treat, whose chart is in doubt there, or of a measured response, is
    charted by itself in Python; it is not `known` where that fails, too.

    Raises  what `OperatingPoint.loop` and `chart_at` raise
    """
    flat = point.flat if point.shape else point
    count = int(np.prod(point.shape))
    parts = []
    for first in range(0, count, AT_ONCE):
        piece = flat[first : first + AT_ONCE] if point.shape else flat
        table = None if point.response is not None else table_of_points(piece)
        number = min(AT_ONCE, count - first)
        doubtful = np.ones(number, dtype=np.bool_)
        chords, counts = np.empty((number, MOST_CHORDS, 6)), np.zeros(number, dtype=np.int64)
        if table is not None:
            _fill_all(table, chords, counts, doubtful)
        each = [chords[n, : counts[n]] for n in range(number)]
        known = np.ones(number, dtype=np.bool_)
        for n in np.flatnonzero(doubtful):
            try:
                each[n] = _chords_from_chart(piece[n] if point.shape else piece)
            except (ChartError, UnmovedError, np.linalg.LinAlgError):
                known[n], each[n] = False, np.empty((0, 6))
        offsets = np.concatenate([[0], np.cumsum([len(one) for one in each])]).astype(np.int64)
        parts.append(LoopEdgeChords(np.concatenate(each), offsets, known))
    return LoopEdgeChords.joined(parts)


def _chords_from_chart(point: OperatingPoint) -> Floats:
    """The chords (m, 6) of one point's edge, taken from the rings of its stability chart. Raises ChartError."""
    chart = chart_at(point) if point.charted_by_response else stability_chart(point.loop, decay=False)
    each = []
    for ring in chart.regions:  # (w, 2) walls K, B
        size = np.ptp(ring, axis=0)
        # a chord along an axis is straight, above all the line of real roots at K = 0
        sag = np.where(np.abs(np.diff(ring, axis=0)) > STRAIGHT * size, RING_SAG * size, 0.0)
        each.append(np.column_stack([ring[:-1], ring[1:], sag]))
    return np.concatenate([np.empty((0, 6)), *each])


def _fill_all(loops: LoopTable, chords: Floats, counts: Ints, doubtful: Flags) -> None:
    """Fill in `chords`, `counts` and `doubtful` of all loops, see `_fill_several`, on several threads."""
    thread = local()  # each thread works in a memory of its own

    def fill_chunk(first: int, last: int) -> None:
        if not hasattr(thread, "memory"):
            thread.memory = edge_memory(loops, MOST_DEGREE, MOST_SAMPLES)
        _fill_several(loops, thread.memory, chords, counts, doubtful, first, last)

    in_chunks(fill_chunk, len(counts))


@compiled
def _fill_several(
    loops: LoopTable,
    memory: EdgeMemory,
    chords: Floats,
    counts: Ints,
    doubtful: Flags,
    first: int,
    last: int,
) -> None:
    """Trace the edges of loops first to last - 1 of N and write their chords.

    chords    (N, MOST_CHORDS, 6)  out: of each loop the first counts[i] rows, see `LoopEdgeChords`
    counts    (N,)  out: number of chords of each loop
    doubtful  (N,)  out: whether a loop has to be charted in Python, and has no chords here
    """
    memory.circle.sizes[COMPUTER] = -1  # what `memory` holds of a loop before is not used
    for i in range(first, last):
        doubtful[i], counts[i] = True, 0
        if loops.section_count[i] == 0 or degree_of(loops, i) > MOST_DEGREE:
            continue
        fill_loop(loops, i, 1.0, memory)  # on the unit circle |z| = 1
        if read_edge(memory) == DOUBTFUL:
            continue
        count = _fill_chords(memory, chords[i])
        if count >= 0:
            doubtful[i], counts[i] = False, count


@compiled_lean
def _fill_chords(memory: EdgeMemory, out: Floats) -> int:
    """Write the chords of the edge whose arcs stand in `memory` to `out` (m, 6).

    Returns their number; -1 where they are more than m, or one is not finite.
    """
    arcs, n = memory.arcs, 0
    for k in range(memory.counts[ARCS]):
        following = arcs.next_arc[k]
        if following < 0:  # no more than a corner
            continue
        if arcs.kind[k] == PAIR:
            n = _add_curve(memory, k, out, n)
        else:
            # lines of real roots and the axis are straight: no sag
            n = _add_chord(out, n, arcs.first[k, 0], arcs.first[k, 1], arcs.last[k, 0], arcs.last[k, 1], 0.0, 0.0)
        if n < 0:
            return -1
        # where rounding blurs a corner it is two walls, joined by a chord
        K_end, B_end = arcs.last[k, 0], arcs.last[k, 1]
        K_next, B_next = arcs.first[following, 0], arcs.first[following, 1]
        if K_end != K_next or B_end != B_next:
            n = _add_chord(out, n, K_end, B_end, K_next, B_next, 0.0, 0.0)
            if n < 0:
                return -1
    return n


@compiled_lean
def _add_curve(memory: EdgeMemory, k: int, out: Floats, n: int) -> int:
    """Write PIECES chords behind the first n of `out` for each interval between neighbouring nodes of arc k.

    The interval is cut at equal steps of the angle theta of the root, with t = tan(theta/2); the largest second
    difference of the walls at the cuts tells how far the curve lies beside the chords.

    Returns the number of chords so far; -1 as `_add_chord`.
    """
    circle, nodes = memory.circle, memory.picked  # rows of nodes: t, K and B
    count = fill_nodes(memory, k)
    for i in range(1, count):
        start, end = 2.0 * np.arctan(nodes[0, i - 1]), 2.0 * np.arctan(nodes[0, i])
        K, B = nodes[1, i - 1], nodes[2, i - 1]
        step_K = step_B = 0.0  # of the chord before
        sag_K = sag_B = 0.0
        begin = n
        for j in range(1, PIECES + 1):
            if j < PIECES:
                K_next, B_next = wall_on_circle(circle, np.tan(0.5 * (start + (end - start) * j / PIECES)))
            else:
                K_next, B_next = nodes[1, i], nodes[2, i]
            if j > 1:
                sag_K = max(sag_K, abs(K_next - K - step_K))
                sag_B = max(sag_B, abs(B_next - B - step_B))
            step_K, step_B = K_next - K, B_next - B
            n = _add_chord(out, n, K, B, K_next, B_next, 0.0, 0.0)
            if n < 0:
                return -1
            K, B = K_next, B_next
        for j in range(begin, n):
            out[j, SAG_K], out[j, SAG_B] = SAG * sag_K, SAG * sag_B
    return n


@compiled_lean
def _add_chord(
    out: Floats, n: int, K: float, B: float, K_next: float, B_next: float, sag_K: float, sag_B: float
) -> int:
    """Write the chord from wall K, B to the next to row n of `out`.

    Returns n + 1, the number of chords now; -1 where `out` is full or an end is not finite.
    """
    if n >= len(out) or not np.isfinite(K + B + K_next + B_next):
        return -1
    out[n, K0], out[n, B0], out[n, K1], out[n, B1] = K, B, K_next, B_next
    out[n, SAG_K], out[n, SAG_B] = sag_K, sag_B
    return n + 1


GAPS: Final = 4  # stable intervals of damping kept of a band: the longest
# Where in the band the ray runs: at no special place, so that it passes no corner; both have to agree.
PROBES: Final = (0.4871, 0.3413)  # shares of a band at which walls are tried, no special ones


def stable_damping_intervals(edges: LoopEdgeChords, bands: Floats) -> Floats:
    """The longest intervals of damping, stable with every stiffness of a band, for each loop and band.

    bands    (b, 2)  lowest and highest stiffness of each [N/m]
    Returns  (N, b, GAPS, 2)  lowest and highest damping [N s/m], ascending; nan behind the last, and for loops of
             which nothing is known
    """
    out = np.full((len(edges), len(bands), GAPS, 2), np.nan)
    most = max(int(np.diff(edges.offsets).max(initial=0)), MOST_CHORDS)
    _fill_intervals(edges.chords, edges.offsets, np.ascontiguousarray(bands), np.empty((most, 2)), out)
    return out


@compiled
def _fill_intervals(chords: Floats, offsets: Ints, bands: Floats, room: Floats, out: Floats) -> None:
    """Fill in `out` (N, b, GAPS, 2), nan before, what `stable_damping_intervals` returns, from `chords` and
    `offsets` of N edges.

    bands  (b, 2)  lowest and highest stiffness of each [N/m]
    room   (k, 2)  memory for the intervals of damping that the chords of one loop occupy
    """
    for i in range(len(offsets) - 1):
        first, last = offsets[i], offsets[i + 1]
        for j in range(len(bands)):
            low, high = bands[j, 0], bands[j, 1]
            n = _occupied_intervals(chords, first, last, low, high, room)
            # no edge lies between the highest end so far and the next lower end: one wall there tells of that gap
            top, count = -np.inf, 0
            for k in range(n):  # below the first and above the last lies no gap: no such wall is stable
                if (
                    room[k, 0] > top
                    and k > 0
                    and _is_inside(chords, first, last, low, high, 0.5 * (top + room[k, 0]))
                ):
                    count = _keep_longest(out[i, j], count, top, room[k, 0])
                top = max(top, room[k, 1])


@compiled_lean
def _occupied_intervals(chords: Floats, first: int, last: int, low: float, high: float, room: Floats) -> int:
    """Write to `room` (k, 2) the lowest and highest damping of chords first to last - 1 within a band of
    stiffnesses from low to high, widened by their sags, by ascending lower end. Returns how many there are."""
    n = 0
    for c in range(first, last):
        K, B, K_end, B_end = chords[c, K0], chords[c, B0], chords[c, K1], chords[c, B1]
        below, above = low - chords[c, SAG_K], high + chords[c, SAG_K]
        if max(K, K_end) < below or min(K, K_end) > above:
            continue
        # cut to the band, from the softer end to the stiffer
        if K_end < K:
            K, B, K_end, B_end = K_end, B_end, K, B
        if below > K:
            B += (below - K) / (K_end - K) * (B_end - B)
            K = below
        if above < K_end:
            B_end = B + (above - K) / (K_end - K) * (B_end - B)
        lower, upper = min(B, B_end) - chords[c, SAG_B], max(B, B_end) + chords[c, SAG_B]
        i = n  # sorted in
        while i > 0 and room[i - 1, 0] > lower:
            room[i, 0], room[i, 1] = room[i - 1, 0], room[i - 1, 1]
            i -= 1
        room[i, 0], room[i, 1] = lower, upper
        n += 1
    return n


@compiled_lean
def _is_inside(chords: Floats, first: int, last: int, low: float, high: float, B: float) -> bool:
    """Whether walls of damping B in the band from low to high are stable, where no edge lies at B.

    From two walls of the band a ray goes towards larger B: both must cross chords first to last - 1, the edge of
    one loop, an odd number of times.
    """
    for share in PROBES:
        K, odd = low + share * (high - low), False
        for c in range(first, last):
            K_start, K_end, B_start, B_end = chords[c, K0], chords[c, K1], chords[c, B0], chords[c, B1]
            crosses = (K_start > K) != (K_end > K)
            if crosses and B_start + (K - K_start) / (K_end - K_start) * (B_end - B_start) > B:
                odd = not odd
        if not odd:
            return False
    return True


@compiled_lean
def _keep_longest(out: Floats, count: int, low: float, high: float) -> int:
    """Add the interval from low to high behind the first `count` of `out` (GAPS, 2); where `out` is full, the
    shortest of all is left out. Returns the number of intervals now."""
    if count < GAPS:
        out[count, 0], out[count, 1] = low, high
        return count + 1
    shortest = 0
    for k in range(1, GAPS):
        if out[k, 1] - out[k, 0] < out[shortest, 1] - out[shortest, 0]:
            shortest = k
    if high - low > out[shortest, 1] - out[shortest, 0]:
        for k in range(shortest, GAPS - 1):  # those behind it move up, and stay in order
            out[k, 0], out[k, 1] = out[k + 1, 0], out[k + 1, 1]
        out[GAPS - 1, 0], out[GAPS - 1, 1] = low, high
    return count


def common_interval(intervals: Floats) -> tuple[float, float]:
    """The longest interval, lowest and highest damping [N s/m], that lies within an interval of every loop; (nan,
    nan) where there is none.

    intervals  (N, GAPS, 2) of each loop, nan behind the last
    """
    # no more common intervals than the loops have together
    room = np.empty((2, GAPS * max(len(intervals), 1) + 1, 2))
    low, high = _common(np.ascontiguousarray(intervals), room)
    return float(low), float(high)


@compiled
def _common(intervals: Floats, room: Floats) -> tuple[float, float]:
    """Lowest and highest damping of the longest common interval, see `common_interval`; nan where there is none.

    Intervals common to the loops so far, at first all dampings, are cut by those of one loop after the other. The
    room must hold all of them, as that of `common_interval` does: others are left out.

    room  (2, k, 2)  memory: the common intervals before and after a loop, which change places from loop to loop
    """
    count, now = 1, 0
    room[0, 0, 0], room[0, 0, 1] = -np.inf, np.inf
    for i in range(len(intervals)):
        kept = 0
        for k in range(count):
            for gap in range(GAPS):
                if not intervals[i, gap, 0] < intervals[i, gap, 1]:  # nan, of which max and min say nothing
                    break
                low, high = max(room[now, k, 0], intervals[i, gap, 0]), min(room[now, k, 1], intervals[i, gap, 1])
                if low < high and kept < room.shape[1]:
                    room[1 - now, kept, 0], room[1 - now, kept, 1] = low, high
                    kept += 1
        now, count = 1 - now, kept
    best, low, high = 0.0, np.nan, np.nan
    for k in range(count):
        if room[now, k, 1] - room[now, k, 0] > best:
            low, high = room[now, k, 0], room[now, k, 1]
            best = high - low
    return low, high
