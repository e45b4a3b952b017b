"""Many cells to compute: what a map's or a sweep's cells are, whoever computes and keeps them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from zwidth.measures.definition import Note


@dataclass(frozen=True)
class CellValues:
    """Measures of consecutive cells.

    values  (k, m)  of k cells and m measures; nan where the status is not OK
    status  (k, m)  as in `measures.definition`
    notes   (m,)    per measure: why cells have no value; `first` counts from the first cell of the job
    """

    values: NDArray[np.float64]
    status: NDArray[np.uint8]
    notes: tuple[tuple[Note, ...], ...]


class Job(Protocol):
    """A question with many cells; it is sent to other processes, so that it must pickle."""

    @property
    def count(self) -> int:
        """Number of cells."""
        ...

    @property
    def measures(self) -> Sequence[str]:
        """Their names, in the order of the columns."""
        ...

    @property
    def question(self) -> str:
        """What its results on disk are known by (`journal.fingerprint`): equal for equal questions."""
        ...

    def compute(self, first: int, last: int) -> CellValues:
        """Cells first to last - 1. Failures within a cell are data; only what spoils all cells is raised."""
        ...
