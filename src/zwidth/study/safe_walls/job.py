"""The cells of a table of safe walls as a job, so that a long one is stored and continued."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numba
import numpy as np

from zwidth.measures.definition import OK, STATUS, Note
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.safe_walls.cell_walls import CellQuestion, cell_walls

METHOD: Final = 3  # changes with the way in which cells are searched, so that no table is made of two


@dataclass(frozen=True, repr=False)
class SafeWallsJob:
    """The cells of a table of safe walls; columns are the numbers of its tables.

    cell_question  what is asked of every cell
    """

    cell_question: CellQuestion

    def __repr__(self) -> str:
        return f"SafeWallsJob: {self.count} cells, {len(self.cell_question.devices)} hands"

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.cell_question.grid.count

    @property
    def measures(self) -> Sequence[str]:
        """Columns: for each table its largest stiffness, then lowest and then highest damping of its bands."""
        bands = range(1, self.cell_question.levels + 1)
        return tuple(
            f"{name}_{slot}"
            for slot in range(self.cell_question.slots)
            for name in ("stiffness", *(f"damping_{end}_{j}" for end in ("min", "max") for j in bands))
        )

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by."""
        asked = self.cell_question
        hands = [[device.document, device.operator] for device in asked.devices]
        grid = asked.grid
        return fingerprint(
            "safe walls",
            METHOD,
            hands,
            [grid.axes, grid.through, grid.low, grid.high, list(grid.counts)],
            [asked.sectors.dimensions, asked.sectors.parts, asked.levels, asked.margin],
            [asked.assembly, asked.model, asked.seed, asked.narrowing],
        )

    def compute(self, first: int, last: int) -> CellValues:
        """Cells first to last - 1, each by itself. Raises what `OperatingPoint.loop` raises."""
        columns = len(self.measures)
        threads = numba.get_num_threads()
        numba.set_num_threads(1)  # kernels take a millisecond here, and handing out their chunks would take longer
        try:
            cells = [cell_walls(self.cell_question, cell) for cell in range(first, last)]
        finally:
            numba.set_num_threads(threads)
        values = np.full((last - first, columns), np.nan)
        status = np.zeros((last - first, columns), dtype=np.uint8)
        notes: dict[tuple[int, str], tuple[int, int]] = {}
        for n, cell in enumerate(cells):
            status[n] = cell.status
            if cell.status == OK:
                assert cell.top is not None
                assert cell.ranges is not None
                rows = [cell.top[:, None], cell.ranges[:, :, 0], cell.ranges[:, :, 1]]
                values[n] = np.concatenate(rows, axis=1).ravel()
            else:
                key = cell.status, cell.reason or f"a posture in the cell is {STATUS[cell.status]}"
                count, where = notes.get(key, (0, first + n))
                notes[key] = count + 1, where
        own = tuple(Note(*key, count, (where,)) for key, (count, where) in notes.items())
        return CellValues(values, status, (own, *((),) * (columns - 1)))
