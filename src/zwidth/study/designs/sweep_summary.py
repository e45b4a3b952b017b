"""What a study's designs come to, found in one pass over them: extremes, and how many there are of each status."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.measures.definition import OK
from zwidth.study.jobs.job import Cells


@dataclass
class ColumnSummary:
    """One column of a study.

    lowest, highest  value and number of the first design that has it; None where no design has a value
    counts           (256,)  number of designs by status
    """

    lowest: tuple[float, int] | None = None
    highest: tuple[float, int] | None = None
    counts: Ints = field(default_factory=lambda: np.zeros(256, dtype=np.int64))

    def add(self, first: int, values: Floats, status: NDArray[np.uint8]) -> None:
        """Add consecutive designs, the first of them by its number, in ascending order."""
        self.counts += np.bincount(status, minlength=256)
        there = np.flatnonzero(status == OK)
        if not len(there):
            return
        low, high = int(there[np.argmin(values[there])]), int(there[np.argmax(values[there])])
        if self.lowest is None or values[low] < self.lowest[0]:
            self.lowest = float(values[low]), first + low
        if self.highest is None or values[high] > self.highest[0]:
            self.highest = float(values[high]), first + high

    @property
    def by_status(self) -> Iterator[tuple[int, int]]:
        """Each status that there is, and the number of its designs."""
        return ((int(status), int(self.counts[status])) for status in np.flatnonzero(self.counts))


def summaries(cells: Cells, columns: int) -> tuple[ColumnSummary, ...]:
    """The summary of each column; of stored cells one piece after the other is in memory.

    >>> from zwidth.study.jobs.job import CellValues
    >>> cells = CellValues(np.array([[3.0], [1.0]]), np.zeros((2, 1), np.uint8), ((),))
    >>> summaries(cells, 1)[0].lowest
    (1.0, 1)
    """
    found = tuple(ColumnSummary() for _ in range(columns))
    for first, piece in cells.pieces():
        for n, one in enumerate(found):
            one.add(first, piece.values[:, n], piece.status[:, n])
    return found
