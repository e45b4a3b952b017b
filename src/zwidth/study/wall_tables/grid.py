"""Cells of the workspace, and sectors of directions, that a table of safe walls is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.device.device import Device
from zwidth.errors import Advice, WorkspaceError
from zwidth.model.mechanism import ORIENTATION, Mechanism
from zwidth.study.workspace.plane_grid import FLAT, ReachableSet, plane_of, reachable_set, rounded_outwards

LONG_SIDE: Final = {2: 20, 3: 6}  # cells along the longest side, by default, of a plane and of a space
MOST: Final = 10**6  # cells
LONGEST: Final = 1e30  # component of a direction, which fits into 32 bits
OVERLAP: Final = 1e-4  # share of a cell's size, and of a sector's, by which it reaches into its neighbours


@dataclass(frozen=True)
class CellGrid:
    """Boxes side by side in a plane or in space, or one cell that is everywhere (`axes` has no rows).

    axes     (d, 3)  orthonormal axes, d = 0, 2 or 3
    through  (3,)    the position with coordinates 0 [m]
    low      (d,)    lowest coordinates [m]
    high     (d,)    highest coordinates [m]
    counts   (d,)    cells along each axis
    names    of the axes
    """

    axes: Floats
    through: Floats
    low: Floats
    high: Floats
    counts: tuple[int, ...]
    names: tuple[str, ...]

    @property
    def dimensions(self) -> int:
        """Number of axes, 0 for a device without a mechanism."""
        return len(self.axes)

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(np.prod(self.counts, dtype=np.int64))

    @property
    def step(self) -> Floats:
        """Size (d,) of a cell [m]."""
        return np.asarray((self.high - self.low) / np.array(self.counts, dtype=np.float64))

    def lines(self, axis: int) -> Floats:
        """Coordinates (count + 1,) [m] of the borders of the cells along an axis, given by its index."""
        return np.asarray(self.low[axis] + self.step[axis] * np.arange(self.counts[axis] + 1))

    def index(self, cell: int) -> tuple[int, ...]:
        """Place of a cell along each axis; the first axis goes round fastest."""
        places = []
        for count in self.counts:
            cell, place = divmod(cell, count)
            places.append(place)
        return tuple(places)

    def positions(self, cell: int, shares: Floats) -> Floats:
        """Positions (n, 3) [m] in a cell, a little larger than it is, at shares (n, d) of its size from 0 to 1."""
        wide = (1.0 + 2.0 * OVERLAP) * shares - OVERLAP
        coordinates = self.low + self.step * (np.array(self.index(cell), dtype=np.float64) + wide)
        return np.asarray(self.through + coordinates @ self.axes)

    def cell_at(self, position: Sequence[float]) -> int | None:
        """Number of the cell that holds a position (d,) [m] along the axes, computed as the exported program does;
        None outside the grid. A position on the highest border belongs to the last cell."""
        cell, stride = 0, 1  # the first axis goes round fastest
        for axis, count in enumerate(self.counts):
            place = (float(position[axis]) - float(self.low[axis])) * (1.0 / float(self.step[axis]))
            if not 0.0 <= place <= count:
                return None
            cell += stride * min(int(place), count - 1)
            stride *= count
        return cell


def cells_of(
    device: Device,
    ranges: Sequence[Sequence[float] | None] = (None, None, None),
    cells: Sequence[int] | None = None,
    assembly: str | None = None,
) -> CellGrid:
    """The cells of a device's workspace: of a plane where its handle cannot leave one, else of space.

    ranges   lowest and highest coordinate along each axis [m]; None: the file's workspace, or what is reached
    cells    number along each axis; left out: 20 along the longer side of a plane, 6 along the longest in space
    assembly  as for `Device.at`; None: the device's reference
    Raises   WorkspaceError  for a device whose handle moves on a curve, on a curved surface or about axes, for
                             ranges and numbers of cells that are none; and what `plane_of` raises
    """
    mechanism = device.mechanism
    if mechanism is None:
        return _cell_everywhere(ranges, cells)
    drives = _count_of_drives(mechanism)
    reach = reachable_set(mechanism, assembly or device.reference_assembly)
    spread = np.linalg.svd(reach.positions - reach.positions.mean(axis=0), compute_uv=False)
    flat = not spread[2] > FLAT * spread[0]
    if not flat and drives < 3:
        raise WorkspaceError(
            "the handle has two drives and moves on a curved surface, and a table needs a plane or space"
        )
    _check_counts(cells, 2 if flat else 3)
    if flat:
        _check_no_range_of_z(ranges)
        # only the first and the last line are read, the ends of the grid
        lines = None if cells is None else (cells[0] + 1, cells[1] + 1)
        plane = plane_of(device, None, None, ranges[0], ranges[1], lines or (2, 2), assembly)
        low, high = np.array([plane.x[0], plane.y[0]]), np.array([plane.x[-1], plane.y[-1]])
        axes, through = np.stack([plane.first, plane.second]), plane.through
        names: tuple[str, ...] = plane.names
    else:
        low, high = _lowest_and_highest_in_space(mechanism, reach, ranges)
        axes, through, names = np.eye(3), np.zeros(3), ("x", "y", "z")
    counts = tuple(cells) if cells is not None else _default_counts(high - low)
    if np.prod(counts, dtype=float) > MOST:
        raise WorkspaceError(f"a table has at most {MOST:.0e} cells, got {' x '.join(map(str, counts))}")
    return CellGrid(axes, through, low, high, counts, tuple(names))


def _cell_everywhere(ranges: Sequence[Sequence[float] | None], cells: Sequence[int] | None) -> CellGrid:
    """Return the grid of one cell that a device without a mechanism has. Raises WorkspaceError for ranges or
    numbers of cells, which such a device has not."""
    if cells is not None or any(one is not None for one in ranges):
        raise WorkspaceError(
            "the device has no [mechanism], and so no workspace; its walls are the same everywhere"
        )
    no_numbers = np.empty(0)
    return CellGrid(np.empty((0, 3)), np.zeros(3), no_numbers, no_numbers, (), ())


def _count_of_drives(mechanism: Mechanism) -> int:
    """Return the number of drives, two or more. Raises WorkspaceError for a mechanism that turns its handle, or
    moves it along a curve."""
    if mechanism.controls == ORIENTATION:
        raise WorkspaceError(
            "the drives control the orientation of the handle, and a table needs a handle that they move"
        )
    drives = len(mechanism.drives.names)
    if drives < 2:
        raise WorkspaceError(
            "the handle has one drive and moves along a curve, and a table needs two drives or three; describe "
            "what is felt along the curve as a [plant]"
        )
    return drives


def _lowest_and_highest_in_space(
    mechanism: Mechanism, reach: ReachableSet, ranges: Sequence[Sequence[float] | None]
) -> tuple[Floats, Floats]:
    """Return the lowest and the highest coordinates (3,) [m] of the ranges; of one that is None those of the
    file's workspace, or of what is reached. Raises WorkspaceError for a range that is none."""
    ends = []
    for axis, given in enumerate(ranges):
        bounds = mechanism.workspace[axis]
        if given is None:
            given = rounded_outwards(*reach.extent(np.eye(3)[axis])) if np.isnan(bounds).any() else bounds
        ends.append((float(given[0]), float(given[1])))
        if not (np.isfinite(ends[-1]).all() and ends[-1][0] < ends[-1][1]):
            raise WorkspaceError(f"the range along {'xyz'[axis]} must be LOW,HIGH with LOW < HIGH, got {given}")
    low, high = np.array(ends).T.copy()
    return low, high


def _check_counts(cells: Sequence[int] | None, dimensions: int) -> None:
    """Raise WorkspaceError for numbers of cells that are not one, at least 1, for each dimension."""
    if cells is None:
        return
    if len(cells) != dimensions:
        text = ",".join(map(str, cells))
        advice = Advice("give {} as " + ("NX,NY" if dimensions == 2 else "NX,NY,NZ"), "cells")
        raise WorkspaceError(
            f"the handle moves in {dimensions} dimensions, and {text} are {len(cells)} counts", advice
        )
    if min(cells) < 1:
        raise WorkspaceError(f"a table needs at least 1 cell along each axis, got {','.join(map(str, cells))}")


def _check_no_range_of_z(ranges: Sequence[Sequence[float] | None]) -> None:
    """Raise WorkspaceError for a range along z, which a plane has not."""
    if len(ranges) > 2 and ranges[2] is not None:
        raise WorkspaceError(
            "the handle moves in a plane, whose two axes have the ranges x and y", Advice("leave out {}", "z")
        )


def _default_counts(lengths: Floats) -> tuple[int, ...]:
    """Numbers of cells along axes of these lengths (d,) [m]: LONG_SIDE along the longest, and along the others so
    many that cells are about as long as wide."""
    long = LONG_SIDE[len(lengths)]
    return tuple(max(1, round(long * float(length / lengths.max()))) for length in lengths)


# --- directions -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sectors:
    """Directions, without their sign, cut into sectors by the faces of a square or a cube around the handle.

    A direction belongs to the face of the axis along which it is longest, d of them. On that face its other
    components, divided by the longest, lie between -1 and 1; each is cut into `parts` equal pieces.

    dimensions  d: 0 or 1 for a single direction, 2 in a plane, 3 in space
    parts       pieces of each component; 1: a sector for each face
    """

    dimensions: int
    parts: int

    @property
    def count(self) -> int:
        """Number of sectors: 2 parts in a plane, 3 parts^2 in space, 1 for a single direction."""
        return self.dimensions * self.parts ** (self.dimensions - 1) if self.dimensions > 1 else 1

    def directions(self, sector: int, shares: Floats) -> Floats:
        """Vectors (n, d), not of unit length, in a sector a little larger than it is, at shares (n, d - 1) of its
        size from 0 to 1."""
        d = self.dimensions
        face, place = divmod(sector, self.parts ** (d - 1))  # place: of the sector on its face
        out = np.ones((len(shares), d))
        for k in range(1, d):  # the components that follow that of the face, cyclically
            place, piece = divmod(place, self.parts)
            wide = (1.0 + 2.0 * OVERLAP) * shares[:, k - 1] - OVERLAP
            out[:, (face + k) % d] = 2.0 * (piece + wide) / self.parts - 1.0
        return out

    def places(self, directions: Floats) -> tuple[Ints, Floats]:
        """Sectors (n,) of vectors (n, d), none of them zero, and their shares (n, d - 1) of the sectors' size with
        its overlap: the inverse of `directions`, within the sectors themselves.

        >>> sectors = Sectors(2, 1)
        >>> sectors.places(sectors.directions(1, np.array([[0.25]])))
        (array([1]), array([[0.25]]))
        """
        d, rows = self.dimensions, np.arange(len(directions))
        face = np.abs(directions).argmax(axis=1)
        place, stride = np.zeros(len(directions), dtype=np.int64), 1
        shares = np.empty((len(directions), d - 1))
        for k in range(1, d):
            across = directions[rows, (face + k) % d] / directions[rows, face]
            scaled = 0.5 * (across + 1.0) * self.parts
            piece = np.minimum(scaled.astype(np.int64), self.parts - 1)
            shares[:, k - 1] = np.clip((scaled - piece + OVERLAP) / (1.0 + 2.0 * OVERLAP), 0.0, 1.0)
            place, stride = place + stride * piece, stride * self.parts
        return face * stride + place, shares

    def sector_of(self, direction: Sequence[float]) -> int | None:
        """The sector of a direction (d,), computed as the exported program does; None for one that is zero, or has
        a component that is no number or beyond LONGEST."""
        d = self.dimensions
        face, longest = 0, 0.0
        for k in range(d):
            size = abs(float(direction[k]))
            if not size <= LONGEST:
                return None
            if size > longest:
                face, longest = k, size
        if not longest > 0.0:
            return None
        sector, stride = 0, 1
        for k in range(1, d):
            share = float(direction[(face + k) % d]) / float(direction[face])
            piece = int(0.5 * (share + 1.0) * self.parts)
            sector += stride * min(piece, self.parts - 1)
            stride *= self.parts
        return face * stride + sector


def lattice(per_side: int, dimensions: int) -> Floats:
    """Points (per_side ** dimensions, dimensions) of a cube from 0 to 1, both ends included.

    >>> lattice(2, 1).ravel().tolist()
    [0.0, 1.0]
    """
    line = np.linspace(0.0, 1.0, per_side)
    return np.stack(np.meshgrid(*[line] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)
