"""The edge of one loop where rounding leaves a stage of `edge_memory` open, answered by eigenvalues.

The stages are those of every chart. Between them, what is open is decided: a flag by the roots without the pair on
the circle, a corner by halving on such flags, a piece of a line by the roots without the real one. In a loop of
high degree, whose coefficients have lost their digits, the phase along the circle decides instead (`nyquist`).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.chart.arcs import CHORD, PAIR, PLUS, Arc, Arcs, Wall
from zwidth.chart.circle_sampling import MOST_SAMPLES, NEAR_END
from zwidth.chart.corner import better_conditioned, fill_corners, solve_crossing
from zwidth.chart.curve import OF_LINE, zero_between
from zwidth.chart.edge_arcs import SAME_CORNER, add_line_arcs, fill_line_pieces, fill_pair_arcs, join_arcs
from zwidth.chart.edge_memory import (
    ARCS,
    CROSSINGS,
    EDGE_SIZE,
    MOST_ARCS,
    NONE,
    PIECES,
    SAMPLES,
    SETTLED,
    EdgeArcs,
    EdgeMemory,
    edge_memory,
)
from zwidth.chart.edge_samples import LONGEST, fill_curve, fill_loop, flag_all, walls_again
from zwidth.chart.real_root_lines import wall_on_line
from zwidth.chart.tracer import CIRCLE_TOLERANCE, ROOTS, Tracer
from zwidth.chart.wall_samples import EDGE, HIDDEN, NO_EDGE
from zwidth.compiled import compiled
from zwidth.errors import ChartError
from zwidth.loop.loop_table import COMPUTER, CircleFactors, LoopTable, wall_with_slopes

# Steps along the curve, in shares of the distance to its nearest singularity, tried one after the other.
SHARES: Final = (0.2, 0.1, 0.05, 0.02)
# How far a corner may be blurred where a mode so weakly coupled that rounding hides it touches the edge.
BLURS: Final = (1e-6, 1e-5, 1e-4, 1e-3)
# Share of an arc over which its direction is taken.
DIRECTION_SHARE: Final = 1e-3
# A chord of which the roots stay this near the circle lies on the edge.
ON_CIRCLE: Final = 1e-6
# How far a corner may be from where halving on the flag has it, as a share of t: on a line, and of two branches.
SAME_CROSSING, SAME_PLACE = 1e-6, 1e-5
HALVINGS: Final = 50
# Stages that `_stage` runs.
SAMPLE, WALLS, FLAGS, CORNERS, PAIR_ARCS, LINE_PIECES, LINE_ARCS, JOIN = range(8)


def closed_rings(tracer: Tracer, extra_angles: Floats | None = None) -> tuple[Arcs, float]:
    """The arcs of all closed walks round the stable set, and the share of its size (`join`) to which corners are
    known.

    extra_angles  angles to sample besides the grid

    A sliver between two branches can fall between samples and leaves a walk open. Then the grid is made finer and
    samples are added round every branch that takes part in a corner. What stays open then are corners where a
    branch moves by less than rounding can tell (an undamped mode that the wall hardly moves): their arcs are
    joined with as much blur as it takes and as eigenvalues confirm, or bridged (`bridge_gaps`).
    Raises ChartError if neither will do.
    """
    memory = edge_memory(tracer.table, tracer.degree, MOST_SAMPLES)
    added = np.empty(0) if extra_angles is None else np.tan(0.5 * extra_angles)
    for share in SHARES:
        find_arcs(tracer, memory, share, added)
        if join(tracer, memory, SAME_CORNER):
            return arcs_of(memory), SAME_CORNER
        added = np.union1d(added, _samples_around_corners(memory))
    for blur in BLURS:
        if join(tracer, memory, blur) and _is_stable_inside(tracer, arcs_of(memory)):
            return arcs_of(memory), blur
    join(tracer, memory, SAME_CORNER)
    longest = bridge_gaps(tracer, memory)
    if longest is not None and join(tracer, memory, SAME_CORNER):
        arcs = arcs_of(memory)
        if _is_stable_inside(tracer, arcs):
            return arcs, longest
    raise ChartError(
        "the edge of the stable set could not be closed: rounding hides a part of it (undamped modes, or one that "
        "the wall hardly moves); give these modes some damping, or leave them out"
    )


def arcs_of(memory: EdgeMemory) -> Arcs:
    """The rings of joined arcs in memory as `Arcs`, ring after ring."""
    return arcs_of_rings(rings_of(memory))


class EdgeRings(NamedTuple):
    """A copy of what an `EdgeMemory` holds of the arcs that join to rings.

    arcs  those in use
    t     of the samples
    """

    arcs: EdgeArcs
    t: Floats


def rings_of(memory: EdgeMemory) -> EdgeRings:
    """A copy of the arcs in memory, with the t of their samples."""
    arcs, samples = memory.counts[ARCS], memory.counts[SAMPLES]
    kept = EdgeArcs._make(field[:arcs].copy() for field in memory.arcs)
    return EdgeRings(kept, memory.samples.t[:samples].copy())


def arcs_of_rings(rings: EdgeRings) -> Arcs:
    """The arcs of rings as `Arcs`, ring after ring, their t = tan(theta/2) turned into angles."""
    arcs, t = rings
    order = arcs.order[: int(np.count_nonzero(arcs.next_arc >= 0))]
    # number of each arc of a ring in the order of the walks
    place = np.empty(MOST_ARCS, dtype=np.int64)
    place[order] = np.arange(len(order))
    start, end = 2.0 * np.arctan(arcs.start[order]), 2.0 * np.arctan(arcs.end[order])
    # samples of each arc in the order of its walk
    inner = [
        t[low:high] if forwards else t[low:high][::-1]
        for (low, high), forwards in zip(arcs.samples[order].tolist(), (start < end).tolist(), strict=True)
    ]
    return Arcs(
        kind=arcs.kind[order].astype(np.int64),
        member=np.zeros(len(order), dtype=np.int64),
        first=arcs.first[order],
        last=arcs.last[order],
        start=start,
        end=end,
        next_arc=place[arcs.next_arc[order]],
        thetas=2.0 * np.arctan(np.concatenate([np.empty(0), *inner])),
        offsets=np.cumsum([0, *(len(part) for part in inner)]),
    )


@compiled
def _stage(
    loops: LoopTable, memory: EdgeMemory, stage: int, value: float, longest: float, near_end: float
) -> float:
    """Run one stage for the first loop of a table.

    value              radius for SAMPLE, with the share of `fill_curve` in `size[EDGE_SIZE]`; blur for JOIN
    longest, near_end  as for `fill_curve`
    Returns            1, or 0 where memory does not hold what is found; for JOIN 0 where a ring does not close;
                       for LINE_PIECES what `fill_line_pieces` returns
    """
    if stage == SAMPLE:
        memory.circle.sizes[COMPUTER] = -1
        share = memory.size[EDGE_SIZE]
        fill_loop(loops, 0, value, memory)
        return 1.0 if fill_curve(memory, share, longest, near_end) else 0.0
    if stage == WALLS:
        walls_again(memory)
    elif stage == FLAGS:
        flag_all(memory)
    elif stage == CORNERS:
        fill_corners(memory)
    elif stage == PAIR_ARCS:
        return 1.0 if fill_pair_arcs(memory) else 0.0
    elif stage == LINE_PIECES:
        return float(fill_line_pieces(memory))
    elif stage == LINE_ARCS:
        return 1.0 if add_line_arcs(memory) else 0.0
    elif stage == JOIN:
        return 1.0 if join_arcs(memory, value) else 0.0
    return 1.0


def _run(tracer: Tracer, memory: EdgeMemory, stage: int, value: float = 0.0) -> float:
    """What `_stage` returns for a tracer's loop. Raises ChartError where memory does not hold what the stage
    finds."""
    result = _stage(tracer.table, memory, stage, value, LONGEST, NEAR_END)
    if stage != JOIN and (result == 0.0 if stage != LINE_PIECES else result < 0.0):
        raise ChartError(
            "the edge of the stable set has too many pieces to be charted, as of a long delay or of many undamped "
            "modes; check the delay, or give the modes some damping"
        )
    return result


def join(tracer: Tracer, memory: EdgeMemory, blur: float) -> bool:
    """Join the arcs in memory to rings; False if one of them does not close.

    blur  ends of arcs this near to each other are one corner: a share of the set's size, the largest |K T| or |B|
          on its edge
    """
    return _run(tracer, memory, JOIN, blur) > 0.0


def find_arcs(tracer: Tracer, memory: EdgeMemory, share: float, added: Floats) -> None:
    """Fill in every arc of the stable set's edge that samples in steps of `share`, and those at t in `added`,
    reveal."""
    samples, counts = memory.samples, memory.counts
    memory.size[EDGE_SIZE] = share  # read there by the first stage; the edge's size is not known yet
    _run(tracer, memory, SAMPLE, tracer.radius)
    if len(added):
        # as many as there is room for
        t = np.union1d(samples.t[: counts[SAMPLES]], added)[: len(samples.t) - 1]
        samples.t[: len(t)] = t
        counts[SAMPLES] = len(t)
        _run(tracer, memory, WALLS)
    n = int(counts[SAMPLES])
    thetas, K, B, flags = 2.0 * np.arctan(samples.t[:n]), samples.K[:n], samples.B[:n], samples.flag[:n]
    if tracer.is_high_degree:
        flags[:] = tracer.flags_by_phase(np.column_stack([K, B]), thetas, 0)
    else:
        _run(tracer, memory, FLAGS)
    decide_flags(tracer, thetas, K, B, flags)
    if not tracer.is_high_degree:
        _run(tracer, memory, CORNERS)
    for i in np.flatnonzero((flags[1:] == EDGE) != (flags[:-1] == EDGE)).tolist():
        if samples.corner[i] != SETTLED:
            on, off = (i, i + 1) if flags[i] == EDGE else (i + 1, i)  # the edge sample, and the other
            corner_t, partner, (wall_K, wall_B) = refine_corner(tracer, samples.t[on], samples.t[off])
            samples.corner[i], samples.corner_t[i], samples.corner_partner[i] = SETTLED, corner_t, partner
            samples.corner_K[i], samples.corner_B[i] = wall_K, wall_B
    _run(tracer, memory, PAIR_ARCS)
    _run(tracer, memory, LINE_PIECES)
    pieces = memory.pieces
    for p in range(int(counts[PIECES])):
        if pieces.flag[p] == HIDDEN or tracer.is_high_degree:
            K0, B0, K1, B1 = pieces.ends[p].tolist()
            root = ROOTS[0] if pieces.root[p] == PLUS else ROOTS[1]
            edge = tracer.edge_on_line(root, 0.5 * (K0 + K1), 0.5 * (B0 + B1))
            pieces.flag[p] = EDGE if edge else NO_EDGE
    _run(tracer, memory, LINE_ARCS)


def decide_flags(tracer: Tracer, thetas: Floats, K: Floats, B: Floats, flags: NDArray[np.int8]) -> None:
    """Decide flags that are HIDDEN, by eigenvalues. Where they, or in a long loop the phase along the circle,
    leave one open, too (several roots on the circle within rounding), it is that of the nearest decided sample
    before, or after if there is none; all stay HIDDEN where none is decided."""
    unsure = np.flatnonzero(flags == HIDDEN)
    if not len(unsure):
        return
    if not tracer.is_high_degree:
        flags[unsure] = tracer.edge_by_eigenvalues(thetas[unsure], K[unsure], B[unsure])
    sure = np.flatnonzero(flags)  # not HIDDEN, which is 0
    if len(sure):
        flags[:] = flags[sure[np.maximum(np.searchsorted(sure, np.arange(len(flags)), "right") - 1, 0)]]


def decided_trace(tracer: Tracer, thetas: Floats, t: Floats | None = None) -> tuple[Floats, Floats, Flags]:
    """K, B and stable-edge flag at ascending angles in (0, pi), decided by eigenvalues where it must be.

    t  tan(theta/2) of each, where that is known
    """
    K, B, flags = tracer.trace(thetas, t)
    decide_flags(tracer, thetas, K, B, flags)
    return K, B, flags == EDGE


def refine_corner(tracer: Tracer, on: float, off: float) -> tuple[float, float, Wall]:
    """The t of the corner between an edge sample (t = on) and one that is none (t = off), that of its partner, the
    other root on the circle, and its wall.

    The partner is 0 or inf where a real root reaches the circle. Where two branches touch without crossing the
    place found by halving stands.
    """
    edge, beyond = on, off
    for _ in range(HALVINGS):
        middle = 0.5 * (edge + beyond)
        if tracer.edge_flag(2.0 * np.arctan(middle)) > 0:
            edge = middle
        else:
            beyond = middle
    for root, partner in zip(ROOTS, (0.0, np.inf), strict=True):
        line = tuple(tracer.line(root).tolist())
        crossing, wall = _line_crossing(tracer.circle, line, min(on, off), max(on, off))
        if abs(crossing - edge) <= SAME_CROSSING * edge:
            return crossing, partner, wall
    theta = 2.0 * np.arctan(edge)
    wall = tracer.wall(theta)[:2]
    z = tracer.roots_without_pair(np.array(theta), np.array(wall[0]), np.array(wall[1]))
    if not len(z):
        return edge, 0.0, wall
    partner = float(np.tan(0.5 * abs(np.angle(z[np.argmin(np.abs(np.abs(z) - tracer.radius))]))))
    if 0.0 < partner < 1e15:  # a pair: a real root has tan(0) = 0, or tan(pi/2), in double precision 1.6e16
        one, other, better, settled = _self_crossing(tracer.circle, edge, partner)
        if settled and abs(one - edge) <= SAME_PLACE * edge:
            return one, other, tracer.wall(2.0 * np.arctan(better))[:2]
    return edge, partner, wall


@compiled
def _line_crossing(
    circle: CircleFactors, line: tuple[float, float, float], low: float, high: float
) -> tuple[float, tuple[float, float]]:
    """The t in (low, high) where the curve crosses a line of real roots, and the wall; nan if it does not."""
    sides = np.empty(2)
    for k in range(2):
        K, B, _, _ = wall_with_slopes(circle, low if k == 0 else high)
        sides[k] = line[0] + line[1] * K + line[2] * B
    if not sides[0] * sides[1] < 0.0:
        return np.nan, (np.nan, np.nan)
    t = zero_between(circle, OF_LINE, line, low, high)
    return t, wall_on_line(circle, line, t)


@compiled
def _self_crossing(circle: CircleFactors, one: float, other: float) -> tuple[float, float, float, bool]:
    """The two t, near one and other, at which the curve crosses itself; the better conditioned of them; and
    whether they settled (`solve_crossing`)."""
    a, b, settled = solve_crossing(circle, one, other)
    return a, b, better_conditioned(circle, a, b), settled


def _is_stable_inside(tracer: Tracer, arcs: Arcs) -> bool:
    """Whether walls just inside the middle of each arc are stable, by eigenvalues.

    An arc's direction there is that between samples farther apart than DIRECTION_SHARE: where the estimate is all
    but blind, neighbouring samples can stand in the wrong order. A wall is taken at a depth of a thousandth of its
    ring's lesser extent, in K T or B, but no deeper than a tenth of its arc: beside a bridge in a sharp corner it
    would be on the other side of the cell.
    """
    inside = []
    for ring in arcs.rings:
        walks = [_walls_along_arc(tracer, arcs[k]) * (tracer.period, 1.0) for k in ring]
        deepest = 1e-3 * float(np.min(np.ptp(np.vstack(walks), axis=0)))
        for points in walks:
            middle, length = len(points) // 2, float(np.max(np.ptp(points, axis=0)))
            before = np.max(np.abs(points[:middle] - points[middle]), axis=1) > DIRECTION_SHARE * length
            first = int(np.flatnonzero(before)[-1]) if before.any() else 0
            along = points[middle] - points[first]
            left = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-300)
            inside.append((points[middle] + points[first]) / 2.0 + min(deepest, 0.1 * length) * left)
    K, B = (np.array(inside).reshape(-1, 2) / (tracer.period, 1.0)).T
    z = np.linalg.eigvals(tracer.loop.transition_matrix(K, B))
    return bool(np.all(np.abs(z) < tracer.radius + CIRCLE_TOLERANCE))


def _walls_along_arc(tracer: Tracer, arc: Arc) -> Floats:
    """Walls (k, 2) [K, B] along an arc: its first, those of the samples that found it, its last."""
    K, B = tracer.walls(arc.thetas)
    return np.vstack([arc.first, np.column_stack([K, B]), arc.last])


def _samples_around_corners(memory: EdgeMemory) -> Floats:
    """Places t (k,) close to each corner, on both of its branches, and to each crossing of a line, on both sides,
    and halfway from one of these to the next."""
    samples, arcs, n = memory.samples, memory.arcs, int(memory.counts[SAMPLES])
    curved = np.flatnonzero(arcs.kind[: memory.counts[ARCS]] == PAIR)
    settled = np.flatnonzero(samples.corner[: n - 1] != NONE)
    centres = [arcs.start[curved], arcs.end[curved], samples.corner_partner[settled]]
    centres.append(memory.pieces.crossing_t[: memory.counts[CROSSINGS]])
    thetas = np.unique(2.0 * np.arctan(np.concatenate(centres)))
    steps = np.logspace(-13, -2, 23)
    near = (thetas[:, None] * (1.0 + np.concatenate([-steps, steps]))).ravel()
    # a branch on which the estimate is all but blind passes both its corners within rounding of one angle
    near = np.concatenate([near, 0.5 * (thetas[1:] + thetas[:-1])])
    return np.asarray(np.tan(0.5 * near[(near > 1e-9) & (near < np.pi - 1e-9)]))


def bridge_gaps(tracer: Tracer, memory: EdgeMemory) -> float | None:
    """Add a chord from each open end to the nearest open beginning, and return the longest chord's share of the
    size; None if no end is open, if one finds no partner, if memory is full or if a chord leaves the circle.

    Where the velocity estimate is all but blind, or a mode all but unmoved, a whole piece of edge passes within
    rounding of a single angle: its samples stop short of its corners. What is missing is a chord between two open
    ends, along which a root stays on the circle as far as double precision can tell.
    """
    arcs, counts, size = memory.arcs, memory.counts, float(memory.size[EDGE_SIZE])
    # corner, wall and t of each arc's end, and of each arc's beginning; those that meet are taken out. Arcs no
    # longer than a corner are none
    alive = np.flatnonzero(arcs.extent[: counts[ARCS]] > SAME_CORNER * size)
    ends = [(int(arcs.node[k, 1]), arcs.last[k].copy(), arcs.end[k]) for k in alive]
    starts = [(int(arcs.node[k, 0]), arcs.first[k].copy(), arcs.start[k]) for k in alive]
    for node in {node for node, _, _ in ends} & {node for node, _, _ in starts}:
        here, there = [e for e in ends if e[0] == node], [s for s in starts if s[0] == node]
        for end, start in zip(here, there, strict=False):
            ends = [one for one in ends if one is not end]
            starts = [one for one in starts if one is not start]
    if not ends or len(ends) != len(starts) or counts[ARCS] + len(ends) > MOST_ARCS:
        return None
    longest, units = 0.0, np.array([tracer.period, 1.0])
    for _, wall, t in ends:
        distances = [float(np.max(np.abs((wall - other) * units))) for _, other, _ in starts]
        nearest = int(np.argmin(distances))
        _, other, other_t = starts.pop(nearest)
        if not _on_circle(tracer, wall, other):
            return None
        k = int(counts[ARCS])
        arcs.kind[k], arcs.first[k], arcs.last[k] = CHORD, wall, other
        arcs.start[k], arcs.end[k], arcs.samples[k] = t, other_t, 0
        counts[ARCS] = k + 1
        longest = max(longest, distances[nearest])
    return longest / size


def _on_circle(tracer: Tracer, first: Floats, last: Floats) -> bool:
    """Whether the largest root stays on the circle along a chord, by eigenvalues at five places."""
    share = np.linspace(0.1, 0.9, 5)[:, None]
    K, B = (first * (1.0 - share) + last * share).T
    z = np.abs(np.linalg.eigvals(tracer.loop.transition_matrix(K, B))).max(axis=-1)
    return bool(np.all(np.abs(z - tracer.radius) < ON_CIRCLE))
