"""Safe walls of one cell: of all postures in it, all directions of a sector, and all hands.

The walls of a cell are a function of its postures and directions, known at samples. So a cell's limit of damping
is

1. the tightest over a lattice of postures and directions that holds the cell's corners;
2. narrowed by what the lattice takes away from one with every second point only. A smooth limit has an error that
   falls with the square of the spacing, so that a third of this is still to come; all of it is taken;
3. searched from the tightest samples beside each corner of the cell, in ever smaller steps: limits have kinks over
   the direction, which no lattice hits;
4. attacked by further samples, half of them random and half beside those that were tightest. One that uses up more
   than half of what a limit was narrowed by moves it, and doubles that. This ends after QUIET rounds without one;
5. tried by eigenvalues, which take a thirtieth of the time of an edge: a search for the posture and direction with
   the largest root of each corner of a band. An unstable one moves the limit as in 4, until none is found.

At each sample nothing is left to chance: all walls of the rectangle are stable there, by the exact edge.

`Limits` are those of a cell's bands of stiffness, `Tightest` the samples at which they are tightest. A sample is a
posture in the cell with a direction of some sectors (`Sampler`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.table_radii import radii_at_points
from zwidth.device.device import Device
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import NO_VALUE, OK, UNDECIDED
from zwidth.model.posture import Posture
from zwidth.study.wall_tables.edge_chords import (
    LoopEdgeChords,
    common_interval,
    edges_of_points,
    stable_damping_intervals,
)
from zwidth.study.wall_tables.grid import CellGrid, Sectors, lattice

POSTURES: Final = 3  # of the lattice, along each axis of a cell
# Of the lattice, along each component of a direction: by dimensions, for one sector a face and for smaller ones
DIRECTIONS: Final = {2: (17, 9), 3: (7, 5)}
# A lattice is halved until no limits are narrowed by more than this share of the widest range, or so often
FINE: Final = 0.05  # share of the range lost to narrowing, up to which a lattice is fine enough
HALVINGS: Final = 2  # of the lattice's spacing, at most
SEARCHED: Final = 32  # bands in which the largest stiffness of a cell is looked for
ROUND: Final = 64  # samples in a round of the attack, for each hand
QUIET: Final = 4  # rounds without a finding that end the attack
ROUNDS: Final = 40  # most rounds of it
TURNS: Final = 9  # of the search
EACH: Final = 4  # samples of each limit in a turn
STEP: Final = 0.3  # share of a cell, and of a sector, by which they differ in the first turn
SHRINK: Final = 0.55  # from turn to turn
WALKERS: Final = 20  # places from which the largest root of a wall is searched
STRANGERS: Final = 30  # random samples that they are chosen from, beside the tightest
STRIDES: Final = 4  # samples of each walker in a turn
PACES: Final = 8  # turns of the walkers
TRIALS: Final = 12  # most searches by eigenvalues
ROUNDING: Final = 1e-9  # of a root: at next to no stiffness one lies at 1
NEARBY: Final = 0.15  # share of a cell, or a sector, by which samples beside the tightest differ from it
# A band begins at this share of the largest stiffness instead of 0: a device that stands nowhere has a root at
# z = 1 without a wall, which is no edge of its walls
NOTHING: Final = 1e-9  # share of the largest stiffness that stands for K = 0
BAND_OVERLAP: Final = 1e-6  # share by which a band of stiffnesses reaches into its neighbours
DIFFERENT: Final = "the walls differ too much within the cell; use smaller cells"
NOTHING_COMMON: Final = "no range of damping is stable in all of the cell's postures and directions"
UNTOLD: Final = (
    "rounding hides a part of the edge of the stable walls (undamped modes, or one that the wall hardly moves); "
    "give these modes some damping, or leave them out"
)


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
        pairs = [_TableSearch(question, cell, sectors).walls() for sectors in slots]
    except _Failed as failure:
        return CellWalls(failure.status, failure.reason)
    return CellWalls(OK, "", np.array([top for top, _ in pairs]), np.stack([ranges for _, ranges in pairs]))


class _TableSearch:
    """The search for the safe walls of one cell over some sectors of directions: the numbers of one of its tables.

    In its methods `bands` (levels, 2) are the lowest and the highest stiffness of each band [N/m].

    cell     number of the cell in the grid
    sectors  numbers of the sectors: one, or all
    """

    def __init__(self, question: CellQuestion, cell: int, sectors: Sequence[int]) -> None:
        self.question, self.cell, self.sectors = question, cell, sectors
        random = np.random.default_rng([question.seed, cell, sectors[0], len(sectors)])
        self.sampler = Sampler(question.sectors, tuple(sectors), random)

    def walls(self) -> tuple[float, Floats]:
        """Largest stiffness [N/m], ranges (levels, 2) of damping [N s/m]. Raises _Failed where nothing is safe."""
        question = self.question
        # steps 1 and 2 of the file, on ever finer lattices
        for halvings in range(HALVINGS + 1):
            samples, coarse = self._lattice(halvings)
            edges = self._edges(samples)
            top = self._top(edges)
            bands = self._bands(top)
            intervals = stable_damping_intervals(edges, bands)
            limits = Limits(intervals, np.tile(coarse, len(question.devices)), question.narrowing)
            if limits.narrowed_share <= FINE or not question.grid.dimensions:
                break
        if np.isnan(limits.centre).all():
            raise _Failed(NO_VALUE, NOTHING_COMMON)
        if question.narrowing and question.grid.dimensions:
            tightest = Tightest(self.sampler, samples, intervals, limits.centre)  # steps 3, 4 and 5
            self._search(tightest, limits, bands)
            self._attack(tightest, limits, bands)
            self._try_eigenvalues(tightest, limits, bands)
        ranges = np.array([_with_margin(low, high, question.margin) for low, high in limits.ranges.tolist()])
        if not (ranges[0, 0] < ranges[0, 1]):  # the lowest band has none, and so no rectangle begins at 0
            raise _Failed(NO_VALUE, NOTHING_COMMON)
        return top / (1.0 + question.margin), ranges

    def _lattice(self, halvings: int) -> tuple[CellSamples, Flags]:
        """Samples (n,) of the lattice, its spacing halved so often, and which of them (n,) belong to the lattice
        of every second point."""
        d = self.question.grid.dimensions
        if d == 0:  # no workspace: one sample without coordinates
            return CellSamples(np.empty((1, 0)), np.zeros(1, dtype=np.int64), np.empty((1, 0))), np.ones(
                1, dtype=np.bool_
            )
        postures_per_axis = ((POSTURES - 1) << halvings) + 1
        directions_per_axis = ((DIRECTIONS[d][0 if self.question.sectors.parts == 1 else 1] - 1) << halvings) + 1
        return self.sampler.lattice(postures_per_axis, directions_per_axis)

    def _edges(self, samples: CellSamples) -> LoopEdgeChords:
        """The edges at n samples with each hand, hand after hand; of a cell that is everywhere one edge with each.
        Raises _Failed where a posture cannot be had, or an edge is undecided."""
        question, grid = self.question, self.question.grid
        if grid.dimensions == 0:
            edges = LoopEdgeChords.joined(
                [edges_of_points(one.at(model=question.model)) for one in question.devices]
            )
        else:
            parts = [edges_of_points(point) for point in self._points(samples)]
            edges = LoopEdgeChords.joined(parts)
        if not edges.known.all():
            raise _Failed(UNDECIDED, UNTOLD)
        return edges

    def _points(self, samples: CellSamples) -> list[OperatingPoint]:
        """The operating points (n,) at n samples, one for each hand. Raises _Failed where a posture is missing."""
        question, grid = self.question, self.question.grid
        directions = self.sampler.along(samples) @ grid.axes
        where: Floats | Posture | None = grid.positions(self.cell, samples.posture)
        assembly, points = question.assembly, []
        for device in question.devices:
            point = device.at(where, directions, assembly=assembly, model=question.model)
            where, assembly = point.posture, None  # which is the same in all hands
            if (point.status != OK).any():
                raise _Failed(int(point.status[np.argmax(point.status != OK)]))
            points.append(point)
        return points

    def _top(self, edges: LoopEdgeChords) -> float:
        """Largest stiffness [N/m] up to which every band has a range of damping that is stable in all samples."""
        largest = edges.largest_stiffness
        levels = largest * np.arange(SEARCHED + 1) / SEARCHED
        if largest > 0.0:
            bands = np.column_stack([np.maximum(levels[:-1], NOTHING * largest), levels[1:]])
            found = stable_damping_intervals(edges, bands)
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

    def _search(self, tightest: Tightest, limits: Limits, bands: Floats) -> None:
        """Tighten the limits by samples ever closer to the tightest (step 3). Raises _Failed as `_edges` does."""
        step = STEP
        for _ in range(TURNS):
            tried = self.sampler.around_each(tightest.near(step), step, EACH)
            intervals = stable_damping_intervals(self._edges(tried), bands)
            limits.tighten(intervals)
            tightest.take(tried, intervals, limits.centre)
            step *= SHRINK

    def _attack(self, tightest: Tightest, limits: Limits, bands: Floats) -> None:
        """Move the limits by random samples and some beside the tightest (step 4), until they hold at all of QUIET
        rounds. Raises _Failed where there is no end of it."""
        quiet, half, random = 0, ROUND // 2, self.sampler.random
        for _ in range(ROUNDS):
            near = tightest.near(NEARBY)
            chosen = near[random.integers(len(near), size=half)]
            beside = self.sampler.beside(chosen, NEARBY * random.random((half, 1)))
            tried = CellSamples.joined([self.sampler.anywhere(half), beside])
            intervals = stable_damping_intervals(self._edges(tried), bands)
            quiet = 0 if limits.meet(intervals) else quiet + 1
            tightest.take(tried, intervals, limits.centre)
            if quiet >= QUIET:
                return
        raise _Failed(UNDECIDED, DIFFERENT)

    def _try_eigenvalues(self, tightest: Tightest, limits: Limits, bands: Floats) -> None:
        """Move the limits by unstable walls, searched by eigenvalues (step 5), until none is found. Raises _Failed
        where there is no end of it."""
        for _ in range(TRIALS):
            unstable = self._unstable(tightest, limits, bands)
            if not len(unstable):
                return
            intervals = stable_damping_intervals(self._edges(unstable), bands)
            limits.meet(intervals)
            tightest.take(unstable, intervals, limits.centre)
        raise _Failed(UNDECIDED, DIFFERENT)

    def _unstable(self, tightest: Tightest, limits: Limits, bands: Floats) -> CellSamples:
        """Samples at which a corner of a band is unstable: of each corner the one with the largest root that
        WALKERS walk to, from the tightest samples of its limit and from random ones."""
        ranges = limits.ranges
        starts, K, B = [], [], []
        for j in np.flatnonzero(ranges[:, 0] < ranges[:, 1]).tolist():
            for side in (0, 1):
                for stiffness in bands[j].tolist():
                    starts.append(
                        CellSamples.joined([tightest.of_limit(side, j), self.sampler.anywhere(STRANGERS)])
                    )
                    K.append(stiffness)
                    B.append(float(ranges[j, side]))
        if not starts:
            return tightest.samples[np.empty(0, dtype=np.int64)]
        counts = np.array([len(one) for one in starts])
        corner = np.repeat(np.arange(len(starts)), counts)
        samples, stiffness, damping = CellSamples.joined(starts), np.array(K), np.array(B)  # K, B of each corner
        radius = self._radii(samples, stiffness[corner], damping[corner])
        order = np.lexsort((-radius, corner))  # of each corner the largest first
        first_of_corner = np.cumsum(counts) - counts
        kept = order[(first_of_corner[:, None] + np.arange(WALKERS)).ravel()]
        samples, corner, radius = samples[kept], corner[kept], radius[kept]
        step = STEP
        for _ in range(PACES):
            for _ in range(STRIDES):
                other = self.sampler.beside(samples, step)
                found = self._radii(other, stiffness[corner], damping[corner])
                samples, radius = other.where(found > radius, samples), np.maximum(found, radius)
            step *= SHRINK
        best = np.arange(len(starts)) * WALKERS + radius.reshape(-1, WALKERS).argmax(axis=1)
        return samples[best[radius[best] > 1.0 + ROUNDING]]

    def _radii(self, samples: CellSamples, K: Floats, B: Floats) -> Floats:
        """Largest root (n,) of the wall K, B (n,) at each sample, over all hands; 0 where kernels do not know it:
        there the limits are those of the edges."""
        radii = [np.nan_to_num(radii_at_points(point, K, B), nan=0.0) for point in self._points(samples)]
        return np.asarray(np.max(radii, axis=0))


def _with_margin(low: float, high: float, margin: float) -> tuple[float, float]:
    """The range of damping whose numbers, times any factor from 1 - margin to 1 + margin, lie from low to high;
    NONE where there is none."""
    if not low < high:
        return NONE
    low = low / (1.0 - margin) if low >= 0.0 else low / (1.0 + margin)
    high = high / (1.0 + margin) if high >= 0.0 else high / (1.0 - margin)
    return (low, high) if low < high else NONE


LEAST: Final = 0.002  # share of the widest range of a cell's bands by which each limit is narrowed at least
HALF: Final = 0.5  # share of a narrowing that a sample may use up
REACH: Final = 2.0  # how much steeper than on average a limit may be, for a place to be searched from
NONE: Final = (0.0, -1.0)  # an empty range of damping


class Tightest:
    """The tightest sample of each limit so far, in each group of samples.

    A limit may be tight at several places of a cell, in several directions, and the tightest of its samples need
    not lie beside the tightest of all places.

    samples  (groups * 2 bands) of each group: of the lowest dampings of all bands, then of the highest
    damping  (groups, 2 bands)  lowest damping there, and the highest times -1; -inf where there is none
    """

    def __init__(self, sampler: Sampler, samples: CellSamples, intervals: Floats, centre: Floats) -> None:
        self.sampler = sampler
        self.damping = np.full((sampler.groups, 2 * intervals.shape[1]), -np.inf)
        self.samples = samples[np.zeros(self.damping.size, dtype=np.int64)]
        self.spread = np.zeros(self.damping.shape[1])  # by how much each limit differs within the cell
        self.take(samples, intervals, centre)

    def take(self, samples: CellSamples, intervals: Floats, centre: Floats) -> None:
        """Keep those of n further samples that are tighter.

        intervals  (h n, bands, GAPS, 2)  of the samples with each of h hands
        centre     (bands,)  damping that the intervals hold; nan for a band that has none
        """
        bands, count = len(centre), len(samples)
        group = self.sampler.group(samples)
        groups = [(g, np.flatnonzero(group == g)) for g in np.unique(group).tolist()]  # number, rows of `samples`
        for j in np.flatnonzero(~np.isnan(centre)):
            ends = around(intervals[:, j], centre[j])
            for side, rising in enumerate((ends[:, 0], -ends[:, 1])):  # the larger, the tighter
                tightness = np.nan_to_num(rising, nan=-np.inf).reshape(-1, count).max(axis=0)  # over the hands
                k = side * bands + int(j)  # column of this limit in `damping`
                known = tightness[np.isfinite(tightness)]
                self.spread[k] = max(self.spread[k], np.ptp(known) if len(known) else 0.0)
                for g, rows in groups:
                    worst = int(rows[np.argmax(tightness[rows])])
                    if tightness[worst] > self.damping[g, k]:
                        self.damping[g, k] = tightness[worst]
                        self.samples.put(g * len(self.spread) + k, samples, worst)

    def near(self, step: float) -> CellSamples:
        """The samples from which a step, a share of the cell, may lead to the tightest of all: those that are less
        apart from it in damping than REACH times that share of what the limit differs by within the cell."""
        known = np.isfinite(self.damping)
        close = known & (self.damping >= self.damping.max(axis=0) - REACH * step * self.spread)
        rows = np.flatnonzero(close.ravel())
        places = np.column_stack([self.samples.posture, self.samples.sector, self.samples.direction])[rows]
        # one that is the tightest of several limits once, in the order of the groups and limits
        return self.samples[rows[np.sort(np.unique(places, axis=0, return_index=True)[1])]]

    def of_limit(self, side: int, band: int) -> CellSamples:
        """The samples of a limit, of each group that has one; side 0: its lowest damping, 1: its highest."""
        bands = self.damping.shape[1] // 2
        k = side * bands + band
        groups = np.flatnonzero(np.isfinite(self.damping[:, k]))
        return self.samples[groups * 2 * bands + k]


class Limits:
    """Limits of damping of each band, with what they are narrowed by.

    centre     (bands,)    damping in the middle of the range [N s/m]; nan where nothing is left
    extreme    (bands, 2)  tightest lowest and highest damping of the samples
    narrowing  (bands, 2)  by how much each of both is moved inwards [N s/m]; as an argument False: by nothing
    intervals  (N, bands, GAPS, 2)  stable ones at the lattice's samples
    coarse     (N,)  which samples belong to the lattice of every second point
    """

    def __init__(self, intervals: Floats, coarse: Flags, narrowing: bool) -> None:
        count = intervals.shape[1]
        self.centre = np.full(count, np.nan)
        self.extreme, self.narrowing = np.zeros((count, 2)), np.zeros((count, 2))
        for j in range(count):
            low, high = common_interval(intervals[:, j])
            if not low < high:
                continue
            self.centre[j] = 0.5 * (low + high)
            ends = around(intervals[:, j], self.centre[j])
            self.extreme[j] = ends[:, 0].max(), ends[:, 1].min()
            # what the lattice takes away from that of every second point (step 2)
            lost = self.extreme[j] - (ends[coarse, 0].max(), ends[coarse, 1].min())
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
        """Ranges of damping (bands, 2), narrowed [N s/m]; NONE where nothing is left."""
        low, high = (self.extreme + self.narrowing * (1.0, -1.0)).T
        left = ~np.isnan(self.centre) & (low < high)
        return np.where(left[:, None], np.column_stack([low, high]), NONE)

    def tighten(self, intervals: Floats) -> None:
        """Take the limits of further samples where they are tighter; what they are narrowed by stays.

        intervals  (N, bands, GAPS, 2)  stable ones at the samples
        """
        for j in np.flatnonzero(~np.isnan(self.centre)):
            ends = around(intervals[:, j], self.centre[j])
            if np.isnan(
                ends
            ).any():  # at a sample no stable interval holds the middle: nothing is left of this band
                self.centre[j] = np.nan
                continue
            self.extreme[j] = max(self.extreme[j, 0], ends[:, 0].max()), min(self.extreme[j, 1], ends[:, 1].min())

    def meet(self, intervals: Floats) -> bool:
        """Move the limits of which further samples, `intervals` as for `tighten`, use up more than HALF of the
        narrowing, and double that. Returns whether a limit moved, or a band lost its range."""
        centre, before = self.centre.copy(), self.extreme.copy()
        self.tighten(intervals)
        moved = np.abs(self.extreme - before) > HALF * self.narrowing
        self.extreme = np.where(moved, self.extreme, before)
        self.narrowing = np.where(moved, 2.0 * self.narrowing, self.narrowing)
        return bool(moved[~np.isnan(self.centre)].any() or (np.isnan(self.centre) != np.isnan(centre)).any())


def around(intervals: Floats, damping: float) -> Floats:
    """Of each sample's intervals (N, GAPS, 2) the one (N, 2) that holds a damping [N s/m]; nan where none does."""
    inside = (intervals[..., 0] < damping) & (damping < intervals[..., 1])
    out = np.full((len(intervals), 2), np.nan)
    rows, gap = np.nonzero(inside)
    out[rows] = intervals[rows, gap]
    return out


# Share of random coordinates that lie on the border of the cell: limits are tightest there more often than not
BORDER: Final = 0.3


@dataclass(frozen=True)
class CellSamples:
    """Places of n samples.

    posture    (n, d)      shares of the cell from 0 to 1
    sector     (n,)        of directions
    direction  (n, d - 1)  shares of the sector from 0 to 1
    """

    posture: Floats
    sector: Ints
    direction: Floats

    def __getitem__(self, rows: Ints) -> CellSamples:
        return CellSamples(self.posture[rows], self.sector[rows], self.direction[rows])

    def __len__(self) -> int:
        return len(self.sector)

    def put(self, row: int, other: CellSamples, its: int) -> None:
        """Replace one of these samples by one of others."""
        self.posture[row], self.sector[row] = other.posture[its], other.sector[its]
        self.direction[row] = other.direction[its]

    def where(self, chosen: Flags, other: CellSamples) -> CellSamples:
        """These samples where `chosen` (n,), and others elsewhere."""
        return CellSamples(
            np.where(chosen[:, None], self.posture, other.posture),
            np.where(chosen, self.sector, other.sector),
            np.where(chosen[:, None], self.direction, other.direction),
        )

    @classmethod
    def joined(cls, parts: Sequence[CellSamples]) -> CellSamples:
        """The samples of several, one after the other."""
        return cls(
            np.concatenate([part.posture for part in parts]),
            np.concatenate([part.sector for part in parts]),
            np.concatenate([part.direction for part in parts]),
        )


@dataclass(frozen=True)
class Sampler:
    """Draws samples of a cell over some sectors: one, or all.

    sectors  of all directions
    allowed  numbers of those that samples may lie in
    random   generator
    """

    sectors: Sectors
    allowed: tuple[int, ...]
    random: np.random.Generator

    @property
    def groups(self) -> int:
        """Number of groups: for each corner of the cell, and each face of the square or cube of directions."""
        d = self.sectors.dimensions
        return d << d  # d faces, 2^d corners

    def group(self, samples: CellSamples) -> Ints:
        """Group (n,) of each sample: the corner of the cell that is nearest, and the face of its direction."""
        d = self.sectors.dimensions
        corner = (samples.posture > 0.5) @ (2 ** np.arange(d))
        return np.asarray(corner * d + samples.sector // self.sectors.parts ** (d - 1), dtype=np.int64)

    def lattice(self, postures_per_axis: int, directions_per_axis: int) -> tuple[CellSamples, Flags]:
        """Samples (n,) of a lattice of so many points along each axis of the cell, and of each sector; and which
        of them (n,) belong to the lattice of every second point."""
        d = self.sectors.dimensions
        postures, directions = lattice(postures_per_axis, d), lattice(directions_per_axis, d - 1)
        posture, sector, direction = (  # of each sample: rows of `postures` and `directions`, and its sector
            index.ravel()
            for index in np.meshgrid(
                np.arange(len(postures)), np.array(self.allowed), np.arange(len(directions)), indexing="ij"
            )
        )
        even = [  # of postures, of directions: whether all their places along the lines are even
            (np.round(points * (side - 1)).astype(int) % 2 == 0).all(axis=1)
            for points, side in ((postures, postures_per_axis), (directions, directions_per_axis))
        ]
        coarse = even[0][posture] & even[1][direction]
        return CellSamples(postures[posture], sector, directions[direction]), coarse

    def anywhere(self, count: int) -> CellSamples:
        """`count` random samples; the share BORDER of their coordinates lies on the border of the cell."""
        d = self.sectors.dimensions
        sectors = np.array(self.allowed)[self.random.integers(len(self.allowed), size=count)]
        posture = self.random.random((count, d))
        posture = np.where(self.random.random((count, d)) < BORDER, np.round(posture), posture)
        return CellSamples(posture, sectors, self.random.random((count, d - 1)))

    def beside(self, samples: CellSamples, size: float | Floats) -> CellSamples:
        """Random samples beside these, about `size` (n, 1) away, a share of the cell and of a face of directions.

        Where samples may lie in all sectors, one goes on from a sector to the next. A single sector ends at its
        border.
        """
        posture = samples.posture + size * self.random.standard_normal(samples.posture.shape)
        posture = np.clip(posture, 0.0, 1.0)
        if len(self.allowed) < self.sectors.count or self.sectors.count == 1:
            direction = samples.direction + size * self.random.standard_normal(samples.direction.shape)
            return CellSamples(posture, samples.sector, np.clip(direction, 0.0, 1.0))
        along = self.along(samples)
        # a face is 2 wide
        along = along + 2.0 * size * self.random.standard_normal(along.shape)
        return CellSamples(posture, *self.sectors.places(along))

    def around_each(self, samples: CellSamples, size: float, each: int) -> CellSamples:
        """Samples beside each of these n, as in `beside`: n that differ in posture only, n in direction only, and
        n times the rest of `each` >= 2 in both. Tight ones often lie in a corner of their cell, which few steps in
        both keep."""
        beside = [self.beside(samples, size) for _ in range(each)]
        beside[0] = CellSamples(beside[0].posture, samples.sector, samples.direction)
        beside[1] = CellSamples(samples.posture, beside[1].sector, beside[1].direction)
        return CellSamples.joined(beside)

    def along(self, samples: CellSamples) -> Floats:
        """Vectors (n, d) along the directions of samples, not of unit length."""
        out = np.empty((len(samples), self.sectors.dimensions))
        for sector in np.unique(samples.sector):
            rows = samples.sector == sector
            out[rows] = self.sectors.directions(int(sector), samples.direction[rows])
        return out
