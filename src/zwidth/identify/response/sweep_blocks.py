"""The longest stretch of a record of a sweep without a gap, block by block, and what its checks want to know.

Two parts of a record must excite the same frequencies for one to be predicted from the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SampleTimes
from zwidth.model.raw_sweep import encoder_step

FIRST: Final = 2**20  # samples from which the encoder's step is read


@dataclass(frozen=True)
class SweepBlocks:
    """Force and position of a record, from one row to the one before another.

    force, position  names of the columns
    """

    record: Record
    force: str
    position: str
    first: int
    behind: int

    @classmethod
    def longest(cls, record: Record, sampling: SampleTimes, force: str, position: str) -> SweepBlocks:
        """The longest stretch of a record."""
        runs = sampling.runs.tolist()
        first, behind = max(runs, key=lambda run: run[1] - run[0], default=(0, 0))
        return cls(record, force, position, first, behind)

    def __len__(self) -> int:
        return self.behind - self.first

    def part(self, first: int, behind: int) -> SweepBlocks:
        """The samples from number `first` to the one before `behind`."""
        return SweepBlocks(self.record, self.force, self.position, self.first + first, self.first + behind)

    def pieces(self) -> Iterator[Floats]:
        """Force and position (2, n), as the record is cut into pieces."""
        row = 0
        for piece in self.record.pieces():
            inside = slice(max(self.first - row, 0), max(self.behind - row, 0))
            row += len(piece[self.force])
            values = np.array([piece[self.force][inside], piece[self.position][inside]])
            if values.shape[1]:
                yield values
            if row >= self.behind:
                return

    def blocks(self, length: int) -> Iterator[tuple[Floats, Floats]]:
        """Force and position in blocks of one length, however the record is cut into pieces; what is left over at
        the end is left out."""
        both, filled = np.empty((2, length)), 0
        for values in self.pieces():
            used = 0
            while used < values.shape[1]:
                some = values[:, used : used + length - filled]
                both[:, filled : filled + some.shape[1]] = some
                used, filled = used + some.shape[1], filled + some.shape[1]
                if filled == length:
                    yield both[0], both[1]
                    both, filled = np.empty((2, length)), 0


@dataclass(frozen=True)
class SweepRange:
    """What the samples of a sweep take for values.

    force, position    smallest and largest
    at_largest, at_smallest  samples at the largest and at the smallest force
    levels             different forces among the first samples
    step               of the encoder, read off the first samples; 0 where none shows
    """

    force: tuple[float, float]
    position: tuple[float, float]
    at_largest: int
    at_smallest: int
    levels: int
    step: float

    @classmethod
    def of(cls, sweep: SweepBlocks, first_levels: int) -> SweepRange:
        """Read a sweep once.

        first_levels  samples among which levels are counted
        """
        force, position = next(sweep.blocks(min(len(sweep), FIRST)))
        step = encoder_step([position])
        levels = len(np.unique(force[:first_levels]))
        low, high, at_low, at_high = np.full(2, np.inf), np.full(2, -np.inf), 0, 0
        for values in sweep.pieces():
            least, most = np.minimum(low, np.min(values, axis=1)), np.maximum(high, np.max(values, axis=1))
            at_low = (at_low if low[0] == least[0] else 0) + int(np.sum(values[0] == least[0]))
            at_high = (at_high if high[0] == most[0] else 0) + int(np.sum(values[0] == most[0]))
            low, high = least, most
        ends = list(zip(low.tolist(), high.tolist(), strict=True))
        return cls(ends[0], ends[1], at_high, at_low, levels, step)


SEGMENTS: Final = 8  # in the shorter part, whose spectra are averaged


def shared_excitation(sweep: SweepBlocks, cut: int) -> float:
    """`shared_power` of the force in both parts of a sweep, by averaged Hann-windowed segments.

    Of noise about 0.8; of one chirp that goes up, nearly 0.

    cut  first sample of the second part
    """
    length = max(min(cut, len(sweep) - cut) // SEGMENTS, 1)
    parts = [_spectrum(part, length) for part in (sweep.part(0, cut), sweep.part(cut, len(sweep)))]
    return shared_power(*parts)


def _spectrum(sweep: SweepBlocks, length: int) -> Floats:
    """Summed spectra (k,) of the force without its mean."""
    window, total = np.hanning(length + 2)[1:-1], np.zeros(length // 2 + 1)
    for force, _ in sweep.blocks(length):
        total += np.abs(np.fft.rfft(window * (force - np.mean(force)))) ** 2
    return total


LEAST_SHARED: Final = 0.2  # of the power, from which on one part tells of the other


def shared_power(first: Floats, second: Floats) -> float:
    """Share of two spectra (k,) of power that both have: the sum of the smaller one, each of sum 1; 0 if one is 0.

    >>> shared_power(np.array([1.0, 1.0, 0.0]), np.array([0.0, 4.0, 4.0]))
    0.5
    """
    sums = float(np.sum(first)), float(np.sum(second))
    return float(np.sum(np.minimum(first / sums[0], second / sums[1]))) if min(sums) > 0.0 else 0.0
