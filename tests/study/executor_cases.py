"""Jobs with known cells, at a place from which other processes can import them."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, field

import numpy as np

from zwidth.errors import MeasureError
from zwidth.measures import FAILED, NO_VALUE, OK, Note
from zwidth.study import CellValues

LEFT_OUT = "is a multiple of seven"


@dataclass
class RootsJob:
    """Square root and reciprocal of the cell's number; every seventh has no root, and each of those its note.

    seconds  per cell
    """

    count: int
    seconds: float = 0.0
    measures: tuple[str, ...] = ("root", "reciprocal")
    question: str = "roots"
    computed_ranges: list[tuple[int, int]] = field(default_factory=list)

    def compute(self, first, last):
        self.computed_ranges.append((first, last))
        time.sleep(self.seconds * (last - first))
        n = np.arange(first, last)
        none = n % 7 == 0
        values = np.stack([np.where(none, np.nan, np.sqrt(n)), 1.0 / (n + 0.1)], axis=-1)
        status = np.stack([np.where(none, NO_VALUE, OK), np.full(n.shape, OK)], axis=-1).astype(np.uint8)
        told = (Note(NO_VALUE, LEFT_OUT, int(none.sum()), (int(n[none][0]),)),) if none.any() else ()
        return CellValues(values, status, (told, ()))


@dataclass
class ProcessNumbersJob(RootsJob):
    """The number of the process that computed each cell, and numbers of its threads."""

    def compute(self, first, last):
        import numba

        found = super().compute(first, last)
        values = np.tile([float(os.getpid()), float(numba.get_num_threads())], (last - first, 1))
        return CellValues(values, np.full(values.shape, OK, dtype=np.uint8), found.notes)


@dataclass
class PrintingJob(RootsJob):
    def compute(self, first, last):
        print("talkative", flush=True)
        return super().compute(first, last)


@dataclass
class FailingJob(PrintingJob):
    def compute(self, first, last):
        if first <= 12 < last:
            raise MeasureError("cannot be asked")
        return super().compute(first, last)


@dataclass
class NotedJob(RootsJob):
    """Each cell fails for a reason of its own."""

    def compute(self, first, last):
        found = super().compute(first, last)
        notes = tuple(Note(FAILED, f"cell {n}", 1, (n,)) for n in range(first, last))
        return CellValues(found.values, found.status, ((), notes))


def same_cells(one: CellValues, other: CellValues) -> bool:
    """The same bits, and the same notes."""
    return (
        one.values.tobytes() == other.values.tobytes()
        and one.status.tobytes() == other.status.tobytes()
        and one.notes == other.notes
    )


@dataclass
class FaultyJob(RootsJob):
    """Cells of which some cannot be computed.

    raising   cells that raise an error of their own
    killing   cells that kill the process that computes them, if it is not `starter`
    endless   cells that never end, nor let go of the interpreter
    once      a file; what kills, kills only while it is not there
    """

    raising: tuple[int, ...] = ()
    killing: tuple[int, ...] = ()
    endless: tuple[int, ...] = ()
    starter: int = 0
    once: str = ""

    def compute(self, first, last):
        for n in range(first, last):
            if n in self.raising:
                raise ZeroDivisionError(f"number {n}\nin two lines")
            if n in self.killing and os.getpid() != self.starter and not (self.once and os.path.exists(self.once)):
                if self.once:
                    open(self.once, "w").close()
                os.kill(os.getpid(), signal.SIGKILL)
            if n in self.endless:
                assert os.getpid() != self.starter
                sum(iter(int, 1))  # in C: no signal handler and no other thread of Python gets a turn
        return super().compute(first, last)


def same_but_for(one: CellValues, other: CellValues, cells: list[int]) -> bool:
    """The same bits of all cells but these."""
    kept = np.setdiff1d(np.arange(len(one.values)), cells)
    return (
        one.values[kept].tobytes() == other.values[kept].tobytes()
        and one.status[kept].tobytes() == other.status[kept].tobytes()
    )
