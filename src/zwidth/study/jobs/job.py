"""The interface of a job, a list of cells to compute: the cells of a map, or the designs of a sweep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.measures.definition import Note

Notes = tuple[tuple[Note, ...], ...]


class Cells(Protocol):
    """Measures of consecutive cells, in memory or in a store.

    values  (k, m)  of k cells and m measures; nan where the status is not OK
    status  (k, m)  as in `measures.definition`
    notes   (m,)    per measure: why cells have no value; `first` counts from the first cell of the job
    """

    @property
    def values(self) -> Floats: ...
    @property
    def status(self) -> NDArray[np.uint8]: ...
    @property
    def notes(self) -> Notes: ...

    def pieces(self) -> Iterator[tuple[int, CellValues]]:
        """First cell and values of consecutive pieces that fit into memory, in the order of the cells."""
        ...

    def in_memory(self) -> CellValues:
        """All cells in memory. Raises TooLarge."""
        ...


@dataclass(frozen=True)
class CellValues:
    """Measures of consecutive cells in memory; see `Cells`."""

    values: Floats
    status: NDArray[np.uint8]
    notes: Notes

    def pieces(self) -> Iterator[tuple[int, CellValues]]:
        """All cells, as one piece."""
        yield 0, self

    def in_memory(self) -> CellValues:
        """These cells."""
        return self


class Job(Protocol):
    """Many cells to compute. A job is sent to other processes, so that it must be possible to pickle it.

    Jobs that follow one another and run the same code may say so by a text `code` that is the same in all of them:
    under a time limit only the first is given time to load it.
    """

    @property
    def count(self) -> int:
        """Number of cells."""
        ...

    @property
    def measures(self) -> Sequence[str]:
        """Names of the measures, in the order of the columns."""
        ...

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by (`journal.fingerprint`)."""
        ...

    def compute(self, first: int, last: int) -> CellValues:
        """Compute cells first to last - 1. A cell that fails has a status.

        A MeasureError or DeviceError says that the question has no answer for any cell, and ends the run. After
        any other exception the cells are computed in smaller pieces: one that raises alone is FAILED.
        """
        ...
