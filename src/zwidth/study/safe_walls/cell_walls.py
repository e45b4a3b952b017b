"""Safe walls of one cell: of all postures in it, all directions of a sector, and all hands.

The walls of a cell are a function of its postures and directions, known at samples. So a cell's limit of damping
is

1. the tightest over a lattice of postures and directions that holds the cell's corners;
2. narrowed by what the lattice takes away from one with every second point only. A smooth limit has an error that
   falls with the square of the spacing, so that a third of this is still to come; all of it is taken;
3. searched from its tightest sample, in ever smaller steps: limits have kinks over the direction, which no lattice
   hits;
4. attacked by further samples, half of them random and half beside those that were tightest. One that uses up more
   than half of what a limit was narrowed by moves it, and doubles that. This ends after QUIET rounds without one.

At each sample nothing is left to chance: all walls of the rectangle are stable there, by the exact edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.device.device import Device
from zwidth.measures.definition import NO_VALUE, OK, UNDECIDED
from zwidth.study.safe_walls.edge_chords import EdgeChords, edges_of_points
from zwidth.study.safe_walls.grid import CellGrid, Sectors, lattice
from zwidth.study.safe_walls.stable_intervals import common_interval, stable_intervals

Floats = NDArray[np.float64]

POSTURES: Final = 3  # of the lattice, along each axis of a cell
# Of the lattice, along each component of a direction: by dimensions, for one sector a face and for smaller ones
DIRECTIONS: Final = {2: (17, 9), 3: (7, 5)}
# A lattice is halved until no limits are narrowed by more than this share of the widest range, or so often
FINE: Final = 0.05
HALVINGS: Final = 2
SEARCHED: Final = 32  # bands in which the largest stiffness of a cell is looked for
LEAST: Final = 0.002  # share of the widest range of a cell's bands by which each limit is narrowed at least
ROUND: Final = 64  # samples in a round of the attack, for each hand
QUIET: Final = 4  # rounds without a finding that end the attack
ROUNDS: Final = 40  # most rounds of it
TURNS: Final = 9  # of the search
EACH: Final = 4  # samples of each limit in a turn
STEP: Final = 0.3  # share of a cell, and of a sector, by which they differ in the first turn
SHRINK: Final = 0.55  # from turn to turn
NEARBY: Final = 0.15  # share of a cell, or a sector, by which samples beside the tightest differ from it
HALF: Final = 0.5  # share of a narrowing that a sample may use up
# A band begins at this share of the largest stiffness instead of 0: a device that stands nowhere has a root at
# z = 1 without a wall, which is no edge of its walls
NOTHING: Final = 1e-9
BAND_OVERLAP: Final = 1e-6  # share by which a band of stiffnesses reaches into its neighbours
NONE: Final = (0.0, -1.0)  # an empty range of damping


@dataclass(frozen=True)
class CellQuestion:
    """What is asked of every cell.

    devices    the device with each of the hands that may hold it
    grid       cells of its workspace
    sectors    of directions
    levels     number of bands of stiffness
    margin     share by which stiffness and damping may both be off
    assembly, model   as for `Device.at`
    seed       of the random samples
    narrowing  False: limits are those of the lattice, neither narrowed nor attacked; for tests
    """

    devices: tuple[Device, ...]
    grid: CellGrid
    sectors: Sectors
    levels: int
    margin: float
    assembly: str | None
    model: str | None
    seed: int
    narrowing: bool = True

    @property
    def slots(self) -> int:
        """Number of tables of each cell: one of all directions, and one of each sector where there are several."""
        return 1 if self.sectors.parts == 1 else 1 + self.sectors.count


@dataclass(frozen=True)
class CellWalls:
    """Safe walls of one cell.

    status  OK; NO_VALUE, UNDECIDED, or that of a posture that cannot be had: then nothing is safe
    reason  why; "" where it is OK, or a posture says it
    top     (slots,)  largest stiffness of each table [N/m]
    ranges  (slots, levels, 2)  damping [N s/m] with every stiffness of a band; NONE where there is none
    """

    status: int
    reason: str = ""
    top: Floats | None = None
    ranges: Floats | None = None


class _Failed(Exception):
    """A cell of which nothing is safe: status and reason."""

    def __init__(self, status: int, reason: str = "") -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


def cell_walls(question: CellQuestion, cell: int) -> CellWalls:
    """The safe walls of one cell. Raises what `OperatingPoint.loop` raises."""
    try:
        every = range(question.sectors.count)
        slots = [list(every)] if question.slots == 1 else [list(every), *([one] for one in every)]
        pairs = [_Slot(question, cell, sectors).walls() for sectors in slots]
    except _Failed as none:
        return CellWalls(none.status, none.reason)
    return CellWalls(OK, "", np.array([top for top, _ in pairs]), np.stack([ranges for _, ranges in pairs]))


@dataclass(frozen=True)
class _Samples:
    """Places of n samples: shares (n, d) of the cell, sector (n,), shares (n, d - 1) of the sector."""

    posture: Floats
    sector: NDArray[np.int64]
    direction: Floats

    def __getitem__(self, rows: NDArray[np.int64]) -> _Samples:
        return _Samples(self.posture[rows], self.sector[rows], self.direction[rows])

    def __len__(self) -> int:
        return len(self.sector)

    def with_row(self, row: int, other: _Samples, its: int) -> _Samples:
        """These samples with one of others in place of one."""
        posture, sector, direction = self.posture.copy(), self.sector.copy(), self.direction.copy()
        posture[row], sector[row], direction[row] = other.posture[its], other.sector[its], other.direction[its]
        return _Samples(posture, sector, direction)

    def __add__(self, other: _Samples) -> _Samples:
        return _Samples(
            np.concatenate([self.posture, other.posture]),
            np.concatenate([self.sector, other.sector]),
            np.concatenate([self.direction, other.direction]),
        )


class _Slot:
    """The search for the safe walls of one cell over some sectors of directions."""

    def __init__(self, question: CellQuestion, cell: int, sectors: Sequence[int]) -> None:
        self.question, self.cell, self.sectors = question, cell, sectors
        self.random = np.random.default_rng([question.seed, cell, sectors[0], len(sectors)])

    def walls(self) -> tuple[float, Floats]:
        """Largest stiffness, and ranges (levels, 2) of damping. Raises _Failed."""
        question = self.question
        for halvings in range(HALVINGS + 1):
            samples, coarse = self._lattice(halvings)
            edges = self._edges(samples)
            top = self._top(edges)
            bands = self._bands(top)
            intervals = stable_intervals(edges, bands)
            limits = _Limits(intervals, np.tile(coarse, len(question.devices)), question.narrowing)
            if limits.narrowed_share <= FINE or not question.grid.dimensions:
                break
        if question.narrowing and question.grid.dimensions:
            tightest = _Tightest(samples, intervals, limits.centre)
            self._search(tightest, limits, bands)
            self._attack(tightest, limits, bands)
        ranges = np.array([_with_margin(low, high, question.margin) for low, high in limits.ranges.tolist()])
        if not (ranges[0, 0] < ranges[0, 1]):
            raise _Failed(NO_VALUE, "no range of damping is stable in all of the cell's postures and directions")
        return top / (1.0 + question.margin), ranges

    def _lattice(self, halvings: int) -> tuple[_Samples, NDArray[np.bool_]]:
        """Samples of the lattice, its spacing halved so often, and which of them belong to that of every second
        point."""
        d = self.question.grid.dimensions
        if d == 0:
            return _Samples(np.empty((1, 0)), np.zeros(1, dtype=np.int64), np.empty((1, 0))), np.ones(
                1, dtype=np.bool_
            )
        of_postures = ((POSTURES - 1) << halvings) + 1
        of_directions = ((DIRECTIONS[d][0 if self.question.sectors.parts == 1 else 1] - 1) << halvings) + 1
        postures, directions = lattice(of_postures, d), lattice(of_directions, d - 1)
        p, s, u = (
            index.ravel()
            for index in np.meshgrid(
                np.arange(len(postures)), np.array(self.sectors), np.arange(len(directions)), indexing="ij"
            )
        )
        even = [
            (np.round(points * (side - 1)).astype(int) % 2 == 0).all(axis=1)
            for points, side in ((postures, of_postures), (directions, of_directions))
        ]
        return _Samples(postures[p], s, directions[u]), even[0][p] & even[1][u]

    def _edges(self, samples: _Samples) -> EdgeChords:
        """The edges at n samples with each hand, hand after hand. Raises _Failed where a posture cannot be had, or
        an edge is undecided."""
        question, grid = self.question, self.question.grid
        if grid.dimensions == 0:
            edges = EdgeChords.joined([edges_of_points(one.at(model=question.model)) for one in question.devices])
        else:
            positions = grid.positions(self.cell, samples.posture)
            along = np.empty((len(positions), grid.dimensions))
            for sector in np.unique(samples.sector):
                rows = samples.sector == sector
                along[rows] = question.sectors.directions(int(sector), samples.direction[rows])
            directions = along @ grid.axes
            parts = []
            for device in question.devices:
                point = device.at(positions, directions, assembly=question.assembly, model=question.model)
                if (point.status != OK).any():
                    raise _Failed(int(point.status[np.argmax(point.status != OK)]))
                parts.append(edges_of_points(point))
            edges = EdgeChords.joined(parts)
        if not edges.known.all():
            raise _Failed(UNDECIDED, "double precision does not tell the edge of the stable walls")
        return edges

    def _top(self, edges: EdgeChords) -> float:
        """Largest stiffness up to which every band has a range of damping that is stable in all samples."""
        largest = edges.largest_stiffness
        levels = largest * np.arange(SEARCHED + 1) / SEARCHED
        if largest > 0.0:
            bands = np.column_stack([np.maximum(levels[:-1], NOTHING * largest), levels[1:]])
            found = stable_intervals(edges, bands)
            empty = [np.isnan(common_interval(found[:, j])[0]) for j in range(SEARCHED)]
            count = empty.index(True) if True in empty else SEARCHED
            if count:
                return float(levels[count])
        raise _Failed(NO_VALUE, "no wall is stable in all of the cell's postures and directions")

    def _bands(self, top: float) -> Floats:
        """Bands of stiffness (levels, 2), with the margin, of which the highest ends at `top` [N/m]."""
        question = self.question
        edge = top / (1.0 + question.margin) * np.arange(question.levels + 1) / question.levels
        low = edge[:-1] * (1.0 - question.margin) * (1.0 - BAND_OVERLAP)
        high = edge[1:] * (1.0 + question.margin) * (1.0 + BAND_OVERLAP)
        return np.column_stack([np.maximum(low, NOTHING * top), high])

    def _search(self, tightest: _Tightest, limits: _Limits, bands: Floats) -> None:
        """Go on from the tightest sample of each limit to tighter ones. Raises _Failed as `_edges` does."""
        step = STEP
        for _ in range(TURNS):
            tried = self._around_each(tightest.samples, step)
            intervals = stable_intervals(self._edges(tried), bands)
            limits.tighten(intervals)
            tightest.take(tried, intervals, limits.centre)
            step *= SHRINK

    def _attack(self, tightest: _Tightest, limits: _Limits, bands: Floats) -> None:
        """Look for samples that the limits do not hold at. Raises _Failed where they are found without end."""
        quiet = 0
        for _ in range(ROUNDS):
            chosen = tightest.samples[self.random.integers(len(tightest.samples), size=ROUND // 2)]
            tried = self._random(ROUND // 2) + self._beside(chosen, NEARBY * self.random.random((ROUND // 2, 1)))
            intervals = stable_intervals(self._edges(tried), bands)
            quiet = 0 if limits.meet(intervals) else quiet + 1
            tightest.take(tried, intervals, limits.centre)
            if quiet >= QUIET:
                return
        raise _Failed(UNDECIDED, "the walls differ too much within the cell; use smaller cells")

    def _random(self, count: int) -> _Samples:
        d = self.question.grid.dimensions
        sectors = np.array(self.sectors)[self.random.integers(len(self.sectors), size=count)]
        return _Samples(self.random.random((count, d)), sectors, self.random.random((count, d - 1)))

    def _around_each(self, samples: _Samples, size: float) -> _Samples:
        """EACH samples beside each of these: another posture, another direction, and twice both. Tight ones often
        lie in a corner of their cell, which few steps in both keep."""
        beside = [self._beside(samples, size) for _ in range(EACH)]
        beside[0] = _Samples(beside[0].posture, samples.sector, samples.direction)
        beside[1] = _Samples(samples.posture, samples.sector, beside[1].direction)
        joined = beside[0]
        for more in beside[1:]:
            joined = joined + more
        return joined

    def _beside(self, samples: _Samples, size: float | Floats) -> _Samples:
        """Random samples beside these, about so far away (n, 1)."""
        posture = samples.posture + size * self.random.standard_normal(samples.posture.shape)
        direction = samples.direction + size * self.random.standard_normal(samples.direction.shape)
        return _Samples(np.clip(posture, 0.0, 1.0), samples.sector, np.clip(direction, 0.0, 1.0))


class _Tightest:
    """The tightest sample of each limit so far: of the lowest dampings of all bands, then of the highest."""

    def __init__(self, samples: _Samples, intervals: Floats, centre: Floats) -> None:
        first = np.zeros(2 * intervals.shape[1], dtype=np.int64)
        self.samples, self.damping = samples[first], np.full(len(first), -np.inf)
        self.take(samples, intervals, centre)

    def take(self, samples: _Samples, intervals: Floats, centre: Floats) -> None:
        """Keep those of n further samples that are tighter.

        intervals  (h n, bands, GAPS, 2)  of the samples with each of h hands
        centre     (bands,)  damping that the intervals hold; nan for a band that has none
        """
        bands = len(centre)
        for j in np.flatnonzero(~np.isnan(centre)):
            own = _around(intervals[:, j], centre[j])
            for side, tightness in enumerate((own[:, 0], -own[:, 1])):
                worst, k = int(np.argmax(np.nan_to_num(tightness, nan=-np.inf))), side * bands + j
                if tightness[worst] > self.damping[k]:
                    self.damping[k] = tightness[worst]
                    self.samples = self.samples.with_row(int(k), samples, worst % len(samples))


class _Limits:
    """Limits of damping of each band, with what they are narrowed by.

    intervals  (N, bands, GAPS, 2)  stable ones at the lattice's samples
    coarse     (N,)  which samples belong to the lattice of every second point
    """

    def __init__(self, intervals: Floats, coarse: NDArray[np.bool_], narrowing: bool) -> None:
        count = intervals.shape[1]
        self.centre, self.extreme, self.narrowing = (
            np.full(count, np.nan),
            np.zeros((count, 2)),
            np.zeros((count, 2)),
        )
        for j in range(count):
            low, high = common_interval(intervals[:, j])
            if not low < high:
                continue
            self.centre[j] = 0.5 * (low + high)
            own = _around(intervals[:, j], self.centre[j])
            self.extreme[j] = own[:, 0].max(), own[:, 1].min()
            lost = self.extreme[j] - (own[coarse, 0].max(), own[coarse, 1].min())
            self.narrowing[j] = np.abs(lost)
        width = self.extreme[:, 1] - self.extreme[:, 0]
        self.narrowing = (
            np.maximum(self.narrowing, LEAST * width.max(initial=0.0)) if narrowing else self.narrowing * 0.0
        )

    @property
    def narrowed_share(self) -> float:
        """The most that limits are narrowed by in a band, as a share of the widest range: bands near the largest
        stiffness are thin, and more samples make them little wider."""
        known = ~np.isnan(self.centre)
        width = (self.extreme[known, 1] - self.extreme[known, 0]).max(initial=0.0)
        return float(self.narrowing.sum(axis=1)[known].max(initial=0.0)) / width if width > 0.0 else 0.0

    @property
    def ranges(self) -> Floats:
        """(bands, 2) damping [N s/m]; NONE where nothing is left."""
        low, high = (self.extreme + self.narrowing * (1.0, -1.0)).T
        left = ~np.isnan(self.centre) & (low < high)
        return np.where(left[:, None], np.column_stack([low, high]), NONE)

    def tighten(self, intervals: Floats) -> None:
        """Take the limits of further samples where they are tighter, what they are narrowed by as before."""
        for j in np.flatnonzero(~np.isnan(self.centre)):
            own = _around(intervals[:, j], self.centre[j])
            if np.isnan(own).any():  # no stable interval holds the middle: nothing is left of this band
                self.centre[j] = np.nan
                continue
            self.extreme[j] = max(self.extreme[j, 0], own[:, 0].max()), min(self.extreme[j, 1], own[:, 1].min())

    def meet(self, intervals: Floats) -> bool:
        """Move the limits that further samples have used up, and double what they are narrowed by; returns whether
        there are any."""
        centre, before = self.centre.copy(), self.extreme.copy()
        self.tighten(intervals)
        moved = np.abs(self.extreme - before) > HALF * self.narrowing
        self.extreme = np.where(moved, self.extreme, before)
        self.narrowing = np.where(moved, 2.0 * self.narrowing, self.narrowing)
        return bool(moved[~np.isnan(self.centre)].any() or (np.isnan(self.centre) != np.isnan(centre)).any())


def _around(intervals: Floats, damping: float) -> Floats:
    """Of each sample's intervals (N, GAPS, 2) the one (N, 2) that holds this damping; nan where none does."""
    inside = (intervals[..., 0] < damping) & (damping < intervals[..., 1])
    out = np.full((len(intervals), 2), np.nan)
    rows, gap = np.nonzero(inside)
    out[rows] = intervals[rows, gap]
    return out


def _with_margin(low: float, high: float, margin: float) -> tuple[float, float]:
    """The range of damping whose numbers, times any factor from 1 - margin to 1 + margin, lie from low to high."""
    if not low < high:
        return NONE
    low = low / (1.0 - margin) if low >= 0.0 else low / (1.0 + margin)
    high = high / (1.0 + margin) if high >= 0.0 else high / (1.0 - margin)
    return (low, high) if low < high else NONE
