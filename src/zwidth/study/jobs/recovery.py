"""Compute a range of cells although some of them raise, end their process or never end.

A range that fails is cut into pieces, and these again, down to the cells that cannot be computed. These become
data: a status and a reason. All others get their values, the same as in any other division of the job.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from zwidth.device.faults import DeviceError
from zwidth.measures.definition import FAILED, OUT_OF_TIME, MeasureError, Note
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.notes import merge_notes

PIECES: Final = 8  # into which a range that failed is cut
TRIES: Final = 2  # of a range that ended its process: another program may have ended it, or a lack of memory
TRIES_ALONE: Final = 3  # of a single cell
UNLIMITED: Final = 10**12

Attempt = Callable[[int, int], CellValues]


class WorkerLost(RuntimeError):
    """A worker process ended before its task was done: killed, or out of memory."""


class OutOfTime(RuntimeError):
    """Cells took longer than their time limit; the process that computed them was ended."""


class CannotStart(RuntimeError):
    """A worker process does not get as far as computing its first task."""


ENDING: Final = (MeasureError, DeviceError, CannotStart)  # say that no cell can be computed


@dataclass(frozen=True)
class Batch:
    """Computed cells, and what happened on the way.

    events  a sentence for each process that ended and had to be replaced
    error   what every cell raised when computed alone, with the same text; None where cells differ in that
    """

    cells: CellValues
    events: tuple[str, ...] = ()
    error: Exception | None = None


def compute_range(attempt: Attempt, measures: int, first: int, last: int) -> Batch:
    """Compute cells first to last - 1, those that fail apart from the others.

    attempt   computes some cells; after a WorkerLost or OutOfTime it can be called again
    measures  number of columns of a cell
    Raises    MeasureError, DeviceError, CannotStart as the attempt does; they are about all cells

    >>> def attempt(first, last):
    ...     if first <= 2 < last:
    ...         raise ZeroDivisionError("no reciprocal")
    ...     return CellValues(np.ones((last - first, 1)), np.zeros((last - first, 1), np.uint8), ((),))
    >>> compute_range(attempt, 1, 0, 4).cells.notes
    ((Note(status=5, reason='raised ZeroDivisionError: no reciprocal', count=1, first=(2,)),),)
    """
    events: list[str] = []
    parts: list[CellValues] = []
    errors: list[Exception | None] = []
    ranges = [(first, last)]
    while ranges:
        begin, end = ranges.pop()
        found = _attempt(attempt, begin, end, events)
        if isinstance(found, CellValues):
            parts.append(found)
            errors.append(None)
        elif end - begin > 1:
            ranges += reversed(_cut(begin, end))
        else:
            status, reason, error = found
            none = np.full((1, measures), np.nan), np.full((1, measures), status, dtype=np.uint8)
            parts.append(CellValues(*none, ((Note(status, reason, 1, (begin,)),),) * measures))
            errors.append(error)
    same = len({str(error) for error in errors}) == 1
    return Batch(_join(parts, measures), tuple(events), errors[0] if same else None)


def _attempt(
    attempt: Attempt, first: int, last: int, events: list[str]
) -> CellValues | tuple[int, str, Exception | None]:
    """The cells, or the status and the reason why there are none, and the error that says so."""
    tries = TRIES if last - first > 1 else TRIES_ALONE
    for left in reversed(range(tries)):
        try:
            return attempt(first, last)
        except ENDING:
            raise
        except WorkerLost as error:
            again = "computed again" if left or last - first > 1 else "left out"
            events.append(f"{error}; {_cells(first, last)} {again}")
            lost = error
        except OutOfTime as error:
            return OUT_OF_TIME, str(error), None
        except Exception as error:
            if isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt):
                raise  # ctrl-C during a call of compiled code
            return FAILED, f"raised {type(error).__name__}: {_first_line(error)}", error
    return FAILED, f"{lost}, {TRIES_ALONE} times", lost


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else "without a message"


def _cells(first: int, last: int) -> str:
    return f"number {first} is" if last - first == 1 else f"numbers {first} to {last - 1} are"


def _cut(first: int, last: int) -> list[tuple[int, int]]:
    """Pieces of about equal size, none empty.

    >>> _cut(0, 3)
    [(0, 1), (1, 2), (2, 3)]
    """
    pieces = min(PIECES, last - first)
    ends = [first + (last - first) * n // pieces for n in range(pieces + 1)]
    return list(pairwise(ends))


def _join(parts: list[CellValues], measures: int) -> CellValues:
    if len(parts) == 1:
        return parts[0]
    notes = (merge_notes([note for part in parts for note in part.notes[m]], UNLIMITED) for m in range(measures))
    values, status = (np.concatenate([getattr(part, name) for part in parts]) for name in ("values", "status"))
    return CellValues(values, status, tuple(notes))
