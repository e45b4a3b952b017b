"""Tables of safe walls, as a haptic loop reads them: the numbers that are exported, and how they are looked up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.arrays import Floats, Ints
from zwidth.device.device import Device
from zwidth.measures.definition import NO_VALUE, OK, STATUS
from zwidth.result import Documented, Result, entry
from zwidth.study.jobs.job import Cells
from zwidth.study.wall_tables.cell_walls import NONE, CellQuestion
from zwidth.study.wall_tables.grid import CellGrid, Sectors

if TYPE_CHECKING:
    import xarray as xr


INSIDE: Final = 0  # answers of the exported program
OUTSIDE: Final = 1
NO_RANGE: Final = 2
BYTES: Final = 4  # of a number in the exported program
EVERYWHERE: Final = 0  # the table of all directions among those of a cell


@dataclass(frozen=True)
class Rectangle(Documented):
    """Walls with a stiffness from 0 to `stiffness` [N/m] and a damping [N s/m] from `low` to `high`."""

    stiffness: float = field(metadata=entry("N/m", name="stiffness_max"))
    low: float = field(metadata=entry("N s/m", name="damping_min"))
    high: float = field(metadata=entry("N s/m", name="damping_max"))


@dataclass(frozen=True, repr=False)
class SafeWalls(Result):
    """Walls that are stable in every posture of a cell, every direction, with every hand, cell by cell.

    device    whose walls they are, and as whom its hands are named
    hands     who may hold it
    question  what was asked of every cell
    span      damping that the rectangles have at least [N s/m]; None: rectangles of the largest area
    status    (cells,)  OK, or why nothing is safe there
    reasons   why cells have no walls, with their number
    top       (cells, slots)  largest stiffness of each table, slot 0 of all directions and one of each sector
    ranges    (cells, slots, levels, 2)  range of damping in each band of stiffnesses; lowest above highest: none
    level     (cells,)  how many bands the rectangle has, 0 where there is none
    outside   what is safe in all cells that have walls

    Numbers are those of the exported program: of 32 bits, rounded to the safe side.
    """

    device: Device
    hands: tuple[str, ...]
    question: CellQuestion
    span: float | None
    status: NDArray[np.uint8]
    reasons: tuple[str, ...]
    top: Floats
    ranges: Floats
    level: Ints
    outside: Rectangle

    @property
    def grid(self) -> CellGrid:
        """The cells of the workspace."""
        return self.question.grid

    @property
    def sectors(self) -> Sectors:
        """The sectors of directions."""
        return self.question.sectors

    @property
    def levels(self) -> int:
        """Number of bands of stiffness."""
        return self.question.levels

    @property
    def size(self) -> int:
        """Bytes that the numbers of the exported program take."""
        return table_size(self.question)

    # --- as the exported program answers ----------------------------------------------------------------

    def at(self, position: ArrayLike = ()) -> tuple[int, Rectangle]:
        """The rectangle of safe walls at a handle position: 0 (INSIDE) and the rectangle of its cell; 1 (OUTSIDE)
        and `outside` where no cell with walls holds the position.

        position  (d,) coordinates along the grid's axes [m]; of no account for a device without a mechanism
        """
        cell = self._cell_with_walls(position)
        return (OUTSIDE, self.outside) if cell is None else (INSIDE, self.rectangle(cell))

    def damping_at(
        self, position: ArrayLike, stiffness: float, direction: ArrayLike | None = None
    ) -> tuple[int, float, float]:
        """The range of damping that is safe with a stiffness along a direction, and along its opposite.

        position   as for `at`;   stiffness  [N/m]
        direction  (d,) of any length; None, zero or not finite: every direction
        Returns    0, lowest and highest [N s/m]; 1 outside the table, with the range of `outside` where the
                   stiffness is no larger than its; 2 where no damping is safe. Lowest above highest: no range
        """
        cell, K = self._cell_with_walls(position), float(stiffness)
        if cell is None:
            inside = 0.0 <= K <= self.outside.stiffness
            return OUTSIDE, *((self.outside.low, self.outside.high) if inside else NONE)
        slot = EVERYWHERE
        if direction is not None and self.question.slots > 1:
            sector = self.sectors.sector_of(np.asarray(direction, dtype=np.float64).tolist())
            slot = EVERYWHERE if sector is None else 1 + sector
        if K >= 0.0:
            for j in range(self.levels):
                if self.stiffness_of_level(cell, slot, j + 1) >= K:
                    low, high = self.ranges[cell, slot, j].tolist()
                    return INSIDE if low <= high else NO_RANGE, low, high
        return NO_RANGE, *NONE

    def stiffness_of_level(self, cell: int, slot: int, level: int) -> float:
        """Highest stiffness [N/m] of band number `level`, from 1 to `levels`, of a table of a cell (slot as in
        `top`)."""
        return float(self.top[cell, slot]) * float(level) / float(self.levels)

    def rectangle(self, cell: int) -> Rectangle:
        """The rectangle of all directions of a cell that has one: the `level` lowest bands, with the damping that
        is safe in all of them."""
        level = int(self.level[cell])
        part = self.ranges[cell, EVERYWHERE, :level]
        stiffness = self.stiffness_of_level(cell, EVERYWHERE, level)
        return Rectangle(stiffness, float(part[:, 0].max()), float(part[:, 1].min()))

    def _cell_with_walls(self, position: ArrayLike) -> int | None:
        """Number of the cell that holds a position (d,) [m]; None outside the grid, and where it has no
        rectangle."""
        cell = 0 if not self.grid.dimensions else self.grid.cell_at(np.asarray(position, dtype=float).tolist())
        return None if cell is None or self.level[cell] == 0 else cell

    # --- as data -----------------------------------------------------------------------------------------

    @cached_property
    def rectangles(self) -> Floats:
        """Stiffness, lowest and highest damping of each cell's rectangle (cells, 3); nan where there is none."""
        out = np.full((self.grid.count, 3), np.nan)
        for cell in np.flatnonzero(self.level):
            one = self.rectangle(int(cell))
            out[cell] = one.stiffness, one.low, one.high
        return out

    def document(self) -> dict[str, Any]:
        """The table by key and unit; cells along the last axis of the grid first, as the arrays are nested."""
        grid = self.grid
        shape = grid.counts[::-1]
        axes = [
            {"name": name, "low_m": float(low), "high_m": float(high), "cells": count}
            for name, low, high, count in zip(grid.names, grid.low, grid.high, grid.counts, strict=True)
        ]
        names = np.array([STATUS[int(one)] for one in self.status], dtype=object)
        K, low, high = self.rectangles.T
        return {
            "axes": axes,
            "axis_vectors": grid.axes,
            "hands": list(self.hands),
            "margin": self.question.margin,
            "damping_span_Ns_per_m": self.span,
            "levels": self.levels,
            "direction_parts": self.sectors.parts,
            "table_bytes": self.size,
            "status": names.reshape(shape),
            "stiffness_max_N_per_m": K.reshape(shape),
            "damping_min_Ns_per_m": low.reshape(shape),
            "damping_max_Ns_per_m": high.reshape(shape),
            "outside": self.outside.document(),
            "notes": list(self.reasons),
        }

    def table(self) -> dict[str, Any]:
        """The bands of all cells as columns, a row for each cell, sector and band; a cell without walls has one.

        `sector` counts from 1, 0 is every direction; coordinates are those of the cell's middle.
        """
        counts = np.where(self.level > 0, self.question.slots * self.levels, 1)  # rows of each cell
        cell = np.repeat(np.arange(self.grid.count), counts)
        # of each row its number within the cell
        within = np.arange(len(cell)) - np.repeat(np.cumsum(counts) - counts, counts)
        slot, band = np.divmod(within, self.levels)
        columns: dict[str, Any] = {}
        # (cells, d) numbers along the axes; d may be 0
        places = np.array([self.grid.index(int(one)) for one in range(self.grid.count)]).reshape(
            self.grid.count, -1
        )
        for k, name in enumerate(self.grid.names):
            lines = self.grid.lines(k)
            columns[f"{name}_m"] = (0.5 * (lines[:-1] + lines[1:]))[places[cell, k]]
        step = np.where(self.level > 0, 1.0, np.nan)[cell] * self.top[cell, slot] / self.levels
        ranges = np.where((self.level > 0)[cell, None], self.ranges[cell, slot, band], np.nan)
        ranges[ranges[:, 0] > ranges[:, 1]] = np.nan
        columns |= {
            "sector": slot,
            "stiffness_from_N_per_m": step * band,
            "stiffness_to_N_per_m": step * (band + 1),
            "damping_min_Ns_per_m": ranges[:, 0],
            "damping_max_Ns_per_m": ranges[:, 1],
            "status": [STATUS[int(one)] for one in self.status[cell]],
        }
        return columns

    def dataset(self) -> xr.Dataset:
        """The rectangles, and the bands of all tables, over the cells' middles; `status` as numbers, not names."""
        import xarray as xr

        grid, shape = self.grid, self.grid.counts[::-1]
        axes = tuple(f"{name}_m" for name in grid.names[::-1])
        middles = {
            f"{name}_m": (f"{name}_m", 0.5 * (grid.lines(k)[:-1] + grid.lines(k)[1:]), {"units": "m"})
            for k, name in enumerate(grid.names)
        }
        tables = (*axes, "sector")
        of_tables = (*shape, self.question.slots)
        low, high = (
            np.where(self.ranges[..., 0] <= self.ranges[..., 1], self.ranges[..., k], np.nan) for k in (0, 1)
        )
        units = {"stiffness": {"units": "N m-1"}, "damping": {"units": "N s m-1"}}
        K, least, most = self.rectangles.T
        data: dict[str, Any] = {
            "stiffness_max": (axes, K.reshape(shape), units["stiffness"]),
            "damping_min": (axes, least.reshape(shape), units["damping"]),
            "damping_max": (axes, most.reshape(shape), units["damping"]),
            "status": (axes, self.status.reshape(shape)),
            "stiffness_top": (tables, self.top.reshape(of_tables), units["stiffness"]),
            "band_damping_min": ((*tables, "band"), low.reshape(*of_tables, self.levels), units["damping"]),
            "band_damping_max": ((*tables, "band"), high.reshape(*of_tables, self.levels), units["damping"]),
        }
        about = {
            "name": self.device.name,
            "hands": ", ".join(self.hands),
            "margin": self.question.margin,
            "direction_parts": self.sectors.parts,
            "outside_stiffness_max_N_per_m": self.outside.stiffness,
            "outside_damping_min_Ns_per_m": self.outside.low,
            "outside_damping_max_Ns_per_m": self.outside.high,
        }
        return xr.Dataset(data, middles, about)

    def __repr__(self) -> str:
        cells, safe = self.grid.count, int((self.level > 0).sum())
        where = "everywhere" if not self.grid.dimensions else f"in {safe} of {cells} cells"
        lines = [f"{where}, held by {', '.join(self.hands)}"]
        if safe:
            K = self.rectangles[self.level > 0, 0]
            lines.append(f"stiffness up to {K.min():.6g} to {K.max():.6g} N/m")
        one = self.outside
        lines.append(f"outside: up to {one.stiffness:.6g} N/m with {one.low:.6g} to {one.high:.6g} N s/m")
        return "SafeWalls: " + "\n  ".join(lines)


def table_size(question: CellQuestion) -> int:
    """Bytes that the numbers of the exported program take: per cell one, and per table of it its largest stiffness
    and two limits of damping per band."""
    return question.grid.count * (1 + question.slots * BYTES * (1 + 2 * question.levels))


def table_of_cells(
    device: Device, hands: Sequence[str], question: CellQuestion, cells: Cells, span: float | None
) -> SafeWalls:
    """The table from the values of its cells, rounded to 32 bits; a cell without a rectangle becomes NO_VALUE.

    cells  as `safe_walls.SafeWallsJob` computes them
    span   as in `SafeWalls`
    """
    slots, levels, count = question.slots, question.levels, question.grid.count
    status = cells.status[:, 0].copy()
    values = np.where((status == OK)[:, None], cells.values, 0.0).reshape(count, slots, 1 + 2 * levels)
    top = rounded(values[:, :, 0], -np.inf)
    ranges = np.stack(
        [rounded(values[:, :, 1 : 1 + levels], np.inf), rounded(values[:, :, 1 + levels :], -np.inf)], axis=-1
    )
    ranges[ranges[..., 0] > ranges[..., 1]] = NONE
    level = np.array([_levels_of_rectangle(ranges[c, 0], span) if status[c] == OK else 0 for c in range(count)])
    without_rectangle = (status == OK) & (level == 0)
    status[without_rectangle] = NO_VALUE
    reasons = [f"{_cells_in_words(note.count)} {STATUS[note.status]}: {note.reason}" for note in cells.notes[0]]
    if without_rectangle.any():
        wide = "" if span is None else f" of {span:g} N s/m or more"
        cells_without = _cells_in_words(int(without_rectangle.sum()))
        reasons.append(f"{cells_without} {STATUS[NO_VALUE]}: no range of damping{wide} is safe")
    good = level > 0
    outside = _common_rectangle(top[good, 0], ranges[good, 0], level[good], span)
    return SafeWalls(
        device=device,
        hands=tuple(hands),
        question=question,
        span=span,
        status=status,
        reasons=tuple(reasons),
        top=top,
        ranges=ranges,
        level=level.astype(np.int64),
        outside=outside,
    )


def rounded(values: Floats, towards: float) -> Floats:
    """The values (...) as numbers of 32 bits, each rounded towards inf or -inf.

    >>> rounded(np.array([0.1]), np.inf) >= 0.1, rounded(np.array([0.1]), -np.inf) <= 0.1
    (array([ True]), array([ True]))
    """
    near = values.astype(np.float32)
    beyond = near.astype(np.float64) < values if towards > 0.0 else near.astype(np.float64) > values
    return np.where(beyond, np.nextafter(near, np.float32(towards)), near).astype(np.float64)


def _levels_of_rectangle(ranges: Floats, span: float | None) -> int:
    """How many bands, from the lowest, the rectangle takes: with a span the most whose common range of damping is
    as wide, else those whose rectangle has the largest area with B >= 0; 0 where there are none.

    ranges  (levels, 2)  of damping [N s/m] in each band
    """
    low, high = np.maximum.accumulate(ranges[:, 0]), np.minimum.accumulate(ranges[:, 1])
    with_range = np.cumprod(ranges[:, 0] <= ranges[:, 1]).astype(bool) & (low < high)
    if not with_range.any():
        return 0
    if span is not None:
        wide = np.flatnonzero(with_range & (high - low >= span))
        return int(wide[-1]) + 1 if len(wide) else 0
    # in bands times N s/m: all are equally high
    area = np.where(with_range, np.arange(1, len(ranges) + 1) * np.maximum(high - np.maximum(low, 0.0), 0.0), -1.0)
    return int(area.argmax()) + 1


def _common_rectangle(top: Floats, ranges: Floats, level: Ints, span: float | None) -> Rectangle:
    """The rectangle that is safe in all cells, chosen as in a cell but no stiffer than the rectangle of any; of
    zeros where there is none.

    top     (cells,)  largest stiffness of each [N/m]
    ranges  (cells, levels, 2)  of damping in each band [N s/m]
    level   (cells,)  how many bands each cell's rectangle has
    span    as in `SafeWalls`
    """
    if not len(top):
        return Rectangle(0.0, 0.0, 0.0)
    levels = ranges.shape[1]
    least = float((top * level).min()) / levels  # stiffness of the softest rectangle [N/m]
    common = np.empty((levels, 2))
    for j in range(levels):
        # how many bands of each cell hold the stiffnesses up to the end of band j
        needed = np.clip(np.ceil(least * (j + 1) / top), 1, levels).astype(int)
        parts = [ranges[c, : needed[c]] for c in range(len(top))]
        empty = any((part[:, 0] > part[:, 1]).any() for part in parts)
        limits = max(part[:, 0].max() for part in parts), min(part[:, 1].min() for part in parts)
        common[j] = NONE if empty or limits[0] > limits[1] else limits
    taken = _levels_of_rectangle(common, span)
    if taken == 0:
        return Rectangle(0.0, 0.0, 0.0)
    stiffness = float(rounded(np.array(least * taken / levels), -np.inf))
    return Rectangle(stiffness, float(common[:taken, 0].max()), float(common[:taken, 1].min()))


def _cells_in_words(count: int) -> str:
    """A number of cells in words: "1 cell", "2 cells"."""
    return "1 cell" if count == 1 else f"{count} cells"
