"""The interface of a job, a list of cells to compute: the cells of a map, or the designs of a sweep."""

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
    """Many cells to compute. A job is sent to other processes, so that it must be possible to pickle it."""

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
        """Compute cells first to last - 1. A cell that fails has a status; only a failure of all is raised."""
        ...
