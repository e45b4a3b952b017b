"""Intervals of damping in which all walls of a band of stiffnesses are stable.

A rectangle of walls [K_low, K_high] x (B_low, B_high) that no edge of the stable set enters is stable as a whole
or not at all: the number of roots outside the circle changes at an edge only. So the edges that lie in the band,
seen along B, leave gaps, and one wall in each gap tells whether the gap is stable. A wall lies in the set if a
ray from it crosses the edge an odd number of times.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_lean
from zwidth.study.safe_walls.edge_chords import B0, B1, K0, K1, MOST_CHORDS, SAG_B, SAG_K, EdgeChords

GAPS: Final = 4  # stable intervals kept of a band, the longest
# Where in the band the ray runs: at no special place, so that it passes no corner; both have to agree.
PROBES: Final = (0.4871, 0.3413)


def stable_intervals(edges: EdgeChords, bands: Floats) -> Floats:
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
    for i in range(len(offsets) - 1):
        first, last = offsets[i], offsets[i + 1]
        for j in range(len(bands)):
            low, high = bands[j, 0], bands[j, 1]
            n = _obstacles(chords, first, last, low, high, room)
            top, count = -np.inf, 0
            for k in range(n):
                if (
                    room[k, 0] > top
                    and k > 0
                    and _is_inside(chords, first, last, low, high, 0.5 * (top + room[k, 0]))
                ):
                    count = _keep_longest(out[i, j], count, top, room[k, 0])
                top = max(top, room[k, 1])


@compiled_lean
def _obstacles(chords: Floats, first: int, last: int, low: float, high: float, room: Floats) -> int:
    """The intervals of damping that chords in the band occupy, ascending by their lower ends; their number."""
    n = 0
    for c in range(first, last):
        x, y, u, v = chords[c, K0], chords[c, B0], chords[c, K1], chords[c, B1]
        below, above = low - chords[c, SAG_K], high + chords[c, SAG_K]
        if max(x, u) < below or min(x, u) > above:
            continue
        if x > u:
            x, y, u, v = u, v, x, y
        if x < below:
            y += (below - x) / (u - x) * (v - y)
            x = below
        if u > above:
            v = y + (above - x) / (u - x) * (v - y)
        a, b = min(y, v) - chords[c, SAG_B], max(y, v) + chords[c, SAG_B]
        i = n
        while i > 0 and room[i - 1, 0] > a:
            room[i, 0], room[i, 1] = room[i - 1, 0], room[i - 1, 1]
            i -= 1
        room[i, 0], room[i, 1] = a, b
        n += 1
    return n


@compiled_lean
def _is_inside(chords: Floats, first: int, last: int, low: float, high: float, B: float) -> bool:
    """Whether walls of this damping in the band are stable: two rays towards larger B, which must agree."""
    for share in PROBES:
        K, odd = low + share * (high - low), False
        for c in range(first, last):
            x, u = chords[c, K0], chords[c, K1]
            if (x > K) != (u > K) and chords[c, B0] + (K - x) / (u - x) * (chords[c, B1] - chords[c, B0]) > B:
                odd = not odd
        if not odd:
            return False
    return True


@compiled_lean
def _keep_longest(out: Floats, count: int, low: float, high: float) -> int:
    """Add an interval behind the others, without the shortest where they are too many; their number."""
    if count < GAPS:
        out[count, 0], out[count, 1] = low, high
        return count + 1
    shortest = 0
    for k in range(1, GAPS):
        if out[k, 1] - out[k, 0] < out[shortest, 1] - out[shortest, 0]:
            shortest = k
    if high - low > out[shortest, 1] - out[shortest, 0]:
        for k in range(shortest, GAPS - 1):
            out[k, 0], out[k, 1] = out[k + 1, 0], out[k + 1, 1]
        out[GAPS - 1, 0], out[GAPS - 1, 1] = low, high
    return count


def common_interval(intervals: Floats) -> tuple[float, float]:
    """The longest interval (low, high) that lies in one of each loop's, (nan, nan) where there is none.

    intervals  (N, GAPS, 2) of each loop, nan behind the last
    """
    room = np.empty((2, GAPS * max(len(intervals), 1) + 1, 2))
    low, high = _common(np.ascontiguousarray(intervals), room)
    return float(low), float(high)


@compiled
def _common(intervals: Floats, room: Floats) -> tuple[float, float]:
    """Cut the intervals that are left by those of one loop after the other."""
    count, now = 1, 0
    room[0, 0, 0], room[0, 0, 1] = -np.inf, np.inf
    for i in range(len(intervals)):
        left = 0
        for k in range(count):
            for g in range(GAPS):
                if not intervals[i, g, 0] < intervals[i, g, 1]:  # nan, of which max and min say nothing
                    break
                low, high = max(room[now, k, 0], intervals[i, g, 0]), min(room[now, k, 1], intervals[i, g, 1])
                if low < high and left < room.shape[1]:
                    room[1 - now, left, 0], room[1 - now, left, 1] = low, high
                    left += 1
        now, count = 1 - now, left
    best, low, high = 0.0, np.nan, np.nan
    for k in range(count):
        if room[now, k, 1] - room[now, k, 0] > best:
            low, high = room[now, k, 0], room[now, k, 1]
            best = high - low
    return low, high
