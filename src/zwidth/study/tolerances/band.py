"""Bands of the chart: the walls that at least so many of the drawn devices render stably.

At one damping each device has intervals of stable stiffness. Sorted together, their ends say at which stiffness
how many devices are stable, and so where at least k of them are: exact over the drawn devices, at each damping.
Between two dampings the band is drawn straight.

`EdgeJob`: where the stable walls of each drawn device begin and end, on lines of equal damping.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.chart.loop_edge import trace_edge
from zwidth.chart.point_chart import chart_at
from zwidth.chart.tracer import Tracer
from zwidth.errors import ChartError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import FAILED, OK, UNDECIDED, Note
from zwidth.result import Documented, entry
from zwidth.study.designs.sweep_job import SweepJob
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.tolerances.intervals import Interval, under

Pieces = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class BandWall(Documented):
    """A wall of a band, tried on devices that had no part in finding it.

    stiffness, damping  [N/m], [N s/m]
    share               of the unseen devices that render it stably
    unseen              number of these devices
    """

    stiffness: float = field(metadata=entry("N/m"))
    damping: float = field(metadata=entry("N s/m"))
    share: Interval | None = field(default=None, metadata=entry(value=under("unseen_stable_share"), spread=True))
    unseen: int = field(default=0, metadata=entry(before="share"))


@dataclass(frozen=True)
class Band(Documented):
    """The walls K >= 0, B >= 0 that at least `members` of the drawn devices render stably.

    probability  least share of the devices, 0..1
    members      this share as a number of devices
    dampings     (d,) ascending [N s/m]
    pieces       at each damping the intervals of stiffness [N/m]
    stiffest     the wall of the largest stiffness; None where no wall with K > 0 belongs to the band
    certain      the wall of the largest stiffness of those rendered by so many devices that the probability of a
                 wall chosen beforehand is at least `probability` with 97.5 %; None: so many devices render none
    high         largest stiffness of the walls whose probability may be `probability`: it is not less with 97.5 %
                 [N/m]; 0: none
    """

    probability: float = field(metadata=entry())
    members: int = field(metadata=entry())
    dampings: Floats = field(metadata=entry("N s/m", name="damping", lists=True))
    pieces: tuple[Pieces, ...] = field(metadata=entry("N/m", name="stiffness"))
    stiffest: BandWall | None = field(metadata=entry(before="dampings"))
    certain: BandWall | None = field(metadata=entry(before="dampings"))
    high: float = field(metadata=entry("N/m", name="stiffness_max_high", before="dampings"))


class Coverage:
    """How many devices are stable along lines of equal damping.

    dampings   (d,) ascending [N s/m]
    intervals  (members, d, n, 2) of stable stiffness [N/m]; 0, 0 or nan where there are none

    Of each damping `_ends` are the sorted ends of all intervals [N/m], `_depths` the devices stable above each.
    """

    def __init__(self, dampings: Floats, intervals: Floats) -> None:
        self.dampings, self._ends, self._depths = dampings, list[Floats](), list[Ints]()
        for d in range(len(dampings)):
            low, high = intervals[:, d, :, 0].ravel(), intervals[:, d, :, 1].ravel()
            there = high > low
            ends = np.concatenate([low[there], high[there]])
            steps = np.repeat([1, -1], there.sum())
            order = np.lexsort((-steps, ends))  # where one ends as another begins, both count
            self._ends.append(ends[order])
            self._depths.append(np.cumsum(steps[order]))

    def pieces(self, d: int, members: int) -> Pieces:
        """Intervals of stiffness that at least so many devices have in common at one of the dampings [N/m]."""
        inside = self._depths[d] >= members
        change = np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8))
        begin, end = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
        ends = self._ends[d]
        return tuple(
            (float(ends[i]), float(ends[j])) for i, j in zip(begin, end, strict=True) if ends[j] > ends[i]
        )

    def largest(self, members: int) -> tuple[float, int]:
        """Largest stiffness that so many devices have in common, and which damping has it; 0.0, -1 for none."""
        best, at = 0.0, -1
        for d in range(len(self.dampings)):
            inside = np.flatnonzero(self._depths[d] >= members)
            # the depth above the last of these ends falls below `members` at the next
            if len(inside) and (stiffness := float(self._ends[d][inside[-1] + 1])) > best:
                best, at = stiffness, d
        return best, at

    def stiffest(self, members: int) -> BandWall | None:
        """The wall of `largest`; None where so many devices have none in common."""
        stiffness, at = self.largest(members)
        return BandWall(stiffness, float(self.dampings[at])) if at >= 0 else None

    def lowest(self, members: int) -> int:
        """The first of the dampings at which so many devices have a wall in common; -1 for none."""
        return min(self._reached(members), default=-1)

    def topmost(self, members: int) -> int:
        """The last of the dampings at which so many devices have a wall in common; -1 for none."""
        return max(self._reached(members), default=-1)

    def _reached(self, members: int) -> list[int]:
        """Indices of the dampings at which so many devices have a wall in common."""
        return [d for d in range(len(self.dampings)) if (self._depths[d] >= members).any()]


def refined_dampings(coverage: Coverage, counts: Sequence[int], pieces: int) -> Floats:
    """Dampings (k,) [N s/m] between those of the lines: more about the largest stiffness of each count, and at
    both ends of its band, which would begin and end flat otherwise. Bands of a free mass begin in a point, with no
    damping.

    counts  numbers of devices whose bands are wanted
    pieces  into which each step is divided
    """
    B, steps = coverage.dampings, set[int]()  # step n lies between lines n and n + 1
    for count in counts:
        _, at = coverage.largest(count)  # `at`, `bottom`, `top`: indices of lines; -1: none
        bottom, top = coverage.lowest(count), coverage.topmost(count)
        steps |= {at - 1, at} if at >= 0 else set()
        steps |= {bottom - 1, top} if top >= 0 else set()
    inside = [step for step in sorted(steps) if 0 <= step < len(B) - 1]
    shares = np.arange(1, pieces) / pieces
    return np.concatenate([B[step] + shares * (B[step + 1] - B[step]) for step in inside] or [np.empty(0)])


MOST_KNOWN: Final = 4096  # devices whose outlines are kept in memory; each takes some 20 kB
MOST_INTERVALS: Final = 4  # of stable stiffness on one line of one device; of more, the longest are kept


def stable_intervals(outlines: Sequence[Floats], dampings: Floats) -> Floats:
    """Intervals of stable stiffness K >= 0 on lines of equal damping, from the outline of a stable set.

    A line crosses the outline an even number of times; between the first and second crossing, the third and
    fourth, ... its walls are stable. Chords of an outline lie within 1e-6 of its extent (`arc_kernels.CHORD`).

    outlines  closed walks (k, 2) of walls [K, B]
    dampings  (d,) ascending [N s/m]
    Returns   (d, MOST_INTERVALS, 2) ends of each interval [N/m], nan where there are fewer; of more than
              MOST_INTERVALS the longest, which leaves out walls that are stable and adds none

    >>> square = np.array([[0.0, -1.0], [2.0, -1.0], [2.0, 1.0], [0.0, 1.0], [0.0, -1.0]])
    >>> stable_intervals([square], np.array([0.0, 3.0]))[:, 0].tolist()
    [[0.0, 2.0], [nan, nan]]
    """
    out = np.full((len(dampings), MOST_INTERVALS, 2), np.nan)
    if not outlines:
        return out
    first = np.concatenate([walk[:-1] for walk in outlines])
    last = np.concatenate([walk[1:] for walk in outlines])
    low, high = np.minimum(first[:, 1], last[:, 1]), np.maximum(first[:, 1], last[:, 1])
    # a chord crosses the lines low <= B < high: a corner on a line counts once
    begin, end = np.searchsorted(dampings, low, "left"), np.searchsorted(dampings, high, "left")
    counts = end - begin
    chord = np.repeat(np.arange(len(counts)), counts)
    line = np.repeat(begin - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts) + np.arange(len(chord))
    along = (dampings[line] - first[chord, 1]) / (last[chord, 1] - first[chord, 1])
    K = first[chord, 0] + along * (last[chord, 0] - first[chord, 0])
    order = np.lexsort((K, line))
    K, line = K[order], line[order]
    ends, line = K.reshape(-1, 2), line[::2]  # of each interval; each line has an even number of crossings
    positive = ends[:, 1] > 0.0
    ends, line = np.maximum(ends[positive], 0.0), line[positive]
    starts = np.searchsorted(line, np.arange(len(dampings) + 1))
    for d in np.flatnonzero(np.diff(starts) > MOST_INTERVALS):
        on_line = np.arange(starts[d], starts[d + 1])
        shorter = np.argsort(ends[on_line, 0] - ends[on_line, 1], kind="stable")[MOST_INTERVALS:]
        line[on_line[shorter]] = -1  # left out
    ends, line = ends[line >= 0], line[line >= 0]
    out[line, np.arange(len(line)) - np.searchsorted(line, line)] = ends
    return out


class Outlines(NamedTuple):
    """The outlines of a device's stable set.

    walks   closed walks (k, 2) of walls [K, B]; None where it has no chart
    status  OK, or why it has none
    reason  in words
    """

    walks: Sequence[Floats] | None
    status: int = OK
    reason: str = ""


@dataclass(frozen=True)
class EdgeJob:
    """The devices of a sweep as cells, each with its intervals of stable stiffness on lines of equal damping.

    sweep     the devices; its measures are not computed
    dampings  (d,) ascending [N s/m]
    known     device's number -> its outlines, of the first MOST_KNOWN devices that this process has charted; jobs
              of other dampings may share it
    """

    sweep: SweepJob
    dampings: Floats
    known: dict[int, Outlines] = field(default_factory=dict, compare=False, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "known": {}}

    @property
    def count(self) -> int:
        """Number of devices."""
        return self.sweep.count

    @cached_property
    def measures(self) -> tuple[str, ...]:
        """Names of the ends of the intervals, line after line."""
        return tuple(
            f"{end}_{n}_at_{d}"
            for d in range(len(self.dampings))
            for n in range(MOST_INTERVALS)
            for end in ("low", "high")
        )

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by."""
        return fingerprint("edges", self.sweep.question, self.dampings)

    def compute(self, first: int, last: int) -> CellValues:
        """Compute devices first to last - 1: the ends of the intervals [N/m] of each line, 0, 0 where there are
        fewer. Without a chart all are nan, with its status; notes are listed once, with the first column."""
        values = np.zeros((last - first, len(self.measures)))
        status = np.full(values.shape, OK, dtype=np.uint8)
        notes: list[Note] = []
        for number, (found, kind, reason) in self.outlines(first, last):
            row = number - first
            if found is None:
                values[row], status[row] = np.nan, kind
                notes.append(Note(kind, reason, 1, (number,)))
            else:
                values[row] = np.nan_to_num(stable_intervals(found, self.dampings), nan=0.0).ravel()
        return CellValues(values, status, (tuple(notes), *[()] * (len(self.measures) - 1)))

    def outlines(self, first: int, last: int) -> Iterator[tuple[int, Outlines]]:
        """Yield number and outlines of each of the devices first to last - 1: those built together before the
        others; where all are known already, in their order."""
        numbers = range(first, last)
        if all(number in self.known for number in numbers):
            yield from ((number, self.known[number]) for number in numbers)
            return
        built = np.zeros(last - first, dtype=bool)  # together with others
        for rows, points in self.sweep.points_together(first, last):
            built[rows] = True
            for place, row in enumerate(rows.tolist()):
                yield first + row, self._remembered(first + row, _outlines_at_point(points[place]))
        for row in np.flatnonzero(~built).tolist():
            point = self.sweep.point_alone(first + row)
            # else `point` is status and reason
            found = _outlines_at_point(point) if isinstance(point, OperatingPoint) else Outlines(None, *point)
            yield first + row, self._remembered(first + row, found)

    def _remembered(self, number: int, found: Outlines) -> Outlines:
        """Keep the outlines of a device, of the first MOST_KNOWN ones; return them."""
        if len(self.known) < MOST_KNOWN:
            self.known[number] = found
        return found


def _outlines_at_point(point: OperatingPoint) -> Outlines:
    """The outlines of the stable set of a device at its operating point, or why it has none."""
    try:
        if point.charted_by_response:
            return Outlines(chart_at(point, decay=False).regions)
        return Outlines(trace_edge(Tracer(point.loop)).outlines)
    except ChartError as error:
        return Outlines(None, UNDECIDED, str(error))
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Outlines(None, FAILED, str(error))


def highest_damping(job: EdgeJob, count: int) -> float:
    """Largest damping of a stable wall with K >= 0 of the first `count` devices [N s/m]; 0 if there is none."""
    largest = 0.0
    for _, found in job.outlines(0, min(count, job.count)):
        for walk in found.walks or ():
            largest = max(largest, float(walk[walk[:, 0] >= 0.0, 1].max(initial=0.0)))
    return largest
