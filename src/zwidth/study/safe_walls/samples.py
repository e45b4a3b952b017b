"""Samples of a cell: postures in it and directions of some sectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.study.safe_walls.grid import Sectors, lattice

# Share of random coordinates that lie on the border of the cell: limits are tightest there more often than not
BORDER: Final = 0.3


@dataclass(frozen=True)
class Samples:
    """Places of n samples.

    posture    (n, d)      shares of the cell from 0 to 1
    sector     (n,)        of directions
    direction  (n, d - 1)  shares of the sector from 0 to 1
    """

    posture: Floats
    sector: Ints
    direction: Floats

    def __getitem__(self, rows: Ints) -> Samples:
        return Samples(self.posture[rows], self.sector[rows], self.direction[rows])

    def __len__(self) -> int:
        return len(self.sector)

    def put(self, row: int, other: Samples, its: int) -> None:
        """Replace one of these samples by one of others."""
        self.posture[row], self.sector[row] = other.posture[its], other.sector[its]
        self.direction[row] = other.direction[its]

    def where(self, chosen: Flags, other: Samples) -> Samples:
        """These samples where `chosen` (n,), and others elsewhere."""
        return Samples(
            np.where(chosen[:, None], self.posture, other.posture),
            np.where(chosen, self.sector, other.sector),
            np.where(chosen[:, None], self.direction, other.direction),
        )

    @classmethod
    def joined(cls, parts: Sequence[Samples]) -> Samples:
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
    own      numbers of those that samples may have
    random   generator
    """

    sectors: Sectors
    own: tuple[int, ...]
    random: np.random.Generator

    @property
    def groups(self) -> int:
        """Number of groups: for each corner of the cell, and each face of the square or cube of directions."""
        d = self.sectors.dimensions
        return d << d

    def group(self, samples: Samples) -> Ints:
        """Group (n,) of each sample: the corner of the cell that is nearest, and the face of its direction."""
        d = self.sectors.dimensions
        corner = (samples.posture > 0.5) @ (2 ** np.arange(d))
        return np.asarray(corner * d + samples.sector // self.sectors.parts ** (d - 1), dtype=np.int64)

    def lattice(self, of_postures: int, of_directions: int) -> tuple[Samples, Flags]:
        """Samples of a lattice of so many points along each axis of the cell, and of each sector; and which of
        them belong to that of every second point."""
        d = self.sectors.dimensions
        postures, directions = lattice(of_postures, d), lattice(of_directions, d - 1)
        p, s, u = (
            index.ravel()
            for index in np.meshgrid(
                np.arange(len(postures)), np.array(self.own), np.arange(len(directions)), indexing="ij"
            )
        )
        even = [
            (np.round(points * (side - 1)).astype(int) % 2 == 0).all(axis=1)
            for points, side in ((postures, of_postures), (directions, of_directions))
        ]
        return Samples(postures[p], s, directions[u]), even[0][p] & even[1][u]

    def anywhere(self, count: int) -> Samples:
        """Random samples; a BORDER of their coordinates lies on the border of the cell."""
        d = self.sectors.dimensions
        sectors = np.array(self.own)[self.random.integers(len(self.own), size=count)]
        posture = self.random.random((count, d))
        posture = np.where(self.random.random((count, d)) < BORDER, np.round(posture), posture)
        return Samples(posture, sectors, self.random.random((count, d - 1)))

    def beside(self, samples: Samples, size: float | Floats) -> Samples:
        """Random samples about so far (n, 1) from these: as a share of the cell, and of a face of directions.

        Where all directions are asked for, a sample goes on from one sector to the next. A single sector ends at
        its border.
        """
        posture = samples.posture + size * self.random.standard_normal(samples.posture.shape)
        posture = np.clip(posture, 0.0, 1.0)
        if len(self.own) < self.sectors.count or self.sectors.count == 1:
            direction = samples.direction + size * self.random.standard_normal(samples.direction.shape)
            return Samples(posture, samples.sector, np.clip(direction, 0.0, 1.0))
        along = self.along(samples)
        # a face is 2 wide
        along = along + 2.0 * size * self.random.standard_normal(along.shape)
        return Samples(posture, *self.sectors.places(along))

    def around_each(self, samples: Samples, size: float, each: int) -> Samples:
        """Samples beside each of these, `each` >= 2 times n: another posture; another direction; then both. Tight
        ones often lie in a corner of their cell, which few steps in both keep."""
        beside = [self.beside(samples, size) for _ in range(each)]
        beside[0] = Samples(beside[0].posture, samples.sector, samples.direction)
        beside[1] = Samples(samples.posture, beside[1].sector, beside[1].direction)
        return Samples.joined(beside)

    def along(self, samples: Samples) -> Floats:
        """Vectors (n, d) along the directions of samples, not of unit length."""
        out = np.empty((len(samples), self.sectors.dimensions))
        for sector in np.unique(samples.sector):
            rows = samples.sector == sector
            out[rows] = self.sectors.directions(int(sector), samples.direction[rows])
        return out
