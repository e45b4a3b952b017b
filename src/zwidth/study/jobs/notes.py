"""Why cells have no value: notes of many batches joined into few."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from zwidth.measures.definition import Note

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
