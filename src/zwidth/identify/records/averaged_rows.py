"""Long records of slow motion, shortened by averaging rows that follow each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.identify.records.record import Piece, Record

MOST_ROWS: Final = 1_000_000


@dataclass(frozen=True)
class AveragedRows:
    """A record's columns, each value a mean over rows that follow each other.

    columns   by name
    together  how many rows each value is the mean of
    left_out  rows with a cell without a number
    """

    columns: Piece
    together: int
    left_out: int


def averaged_rows(record: Record, most: int = MOST_ROWS) -> AveragedRows:
    """The columns of a record in at most so many rows; a record with columns of words keeps all of its rows.

    Memory stays below that of 2 * `most` rows and one piece.
    """
    kept, rows, together, left_out = list[Piece](), 0, 1, 0
    rest: Piece = {name: np.zeros(0) for name in record.names}
    for piece in record.pieces():
        whole = np.all([np.isfinite(v) for name, v in piece.items() if name not in record.text], axis=0)
        left_out += int(np.count_nonzero(~whole))
        piece = {
            name: np.concatenate([rest[name], values[whole]]) if len(rest[name]) else values[whole]
            for name, values in piece.items()
        }
        count = len(piece[record.names[0]]) // together * together
        rest = {name: values[count:] for name, values in piece.items()}
        kept.append(_averaged(piece, count, together))
        rows += count // together
        while rows > most and not record.text:
            even = rows // 2 * 2
            kept = [_averaged(_joined(kept, record.names), even, 2)]
            rows, together = even // 2, 2 * together
    return AveragedRows(_joined(kept, record.names), together, left_out)


def _joined(pieces: list[Piece], names: Sequence[str]) -> Piece:
    return {name: np.concatenate([one[name] for one in pieces] or [np.zeros(0)]) for name in names}


def _averaged(piece: Piece, count: int, together: int) -> Piece:
    """The first `count` rows in means of so many."""
    if together == 1:
        return {name: values[:count] for name, values in piece.items()}
    return {name: values[:count].reshape(-1, together).mean(axis=1) for name, values in piece.items()}
