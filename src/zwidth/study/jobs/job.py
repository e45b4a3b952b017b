"""The interface of a job, a list of cells to compute: the cells of a map, or the designs of a sweep.

Why cells have no value: notes of many batches joined into few.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

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


MOST_NOTES: Final = 100  # notes per measure; a reason that contains a number may differ in each cell
MORE: Final = "further reasons, each in few cells"


class NoteSummary:
    """Notes of one measure, added in the order of their cells; its size does not grow with the cells.

    most  largest number of reasons that are kept apart; further ones are counted together, for each status

    >>> summary = NoteSummary(1)
    >>> summary.add([Note(5, "no", 2, (3,)), Note(5, "never", 1, (7,)), Note(5, "no", 1, (9,))])
    >>> [(note.reason, note.count, note.first) for note in summary.notes()]
    [('no', 3, (3,)), ('further reasons, each in few cells', 1, (7,))]
    """

    def __init__(self, most: int = MOST_NOTES) -> None:
        self.most = most
        self._kept: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}
        self._more: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}

    def add(self, notes: Iterable[Note]) -> None:
        """Add notes of later cells, the first of their cells in ascending order."""
        for note in notes:
            key, counts = (note.status, note.reason), self._kept
            if key not in counts and len(counts) >= self.most:
                key, counts = (note.status, MORE), self._more
            count, first = counts.get(key, (0, note.first))
            counts[key] = count + note.count, min(first, note.first)

    def notes(self) -> tuple[Note, ...]:
        """The joined notes in the order of their first cells, those that count further reasons last."""
        return tuple(Note(*key, *rest) for counts in (self._kept, self._more) for key, rest in counts.items())


def merge_notes(notes: Iterable[Note], most: int = MOST_NOTES) -> tuple[Note, ...]:
    """Join notes of the same reason into one, in the order of their first cells.

    most  largest number of notes; further ones are counted in one more note for each status

    >>> merge_notes([Note(5, "no", 2, (7,)), Note(5, "no", 1, (3,))])
    (Note(status=5, reason='no', count=3, first=(3,)),)
    """
    summary = NoteSummary(most)
    summary.add(sorted(notes, key=lambda note: (note.first, note.status, note.reason)))
    return summary.notes()
