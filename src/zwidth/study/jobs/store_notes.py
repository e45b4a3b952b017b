"""Notes of a store's batches: a file of lines, of which only their places are kept in memory."""

from __future__ import annotations

from pathlib import Path

from zwidth.measures.definition import Note
from zwidth.study.jobs.checked_lines import checked_line, read_checked_line
from zwidth.study.jobs.job import Notes


class NotesFile:
    """Why cells have no value, and the digest of the batch's numbers: a line for each batch, with a checksum. The
    first line holds the version and the fingerprint.

    A damaged line is passed over, and one cut short by a crash or a full disk written over: their batches have no
    notes, and are computed again. So no line need be forced to the disk before the next.

    header  first line
    Raises  OSError     where the file cannot be read or written
            ValueError  where it begins with another line
    """

    def __init__(self, path: Path, header: str) -> None:
        self.path = path
        self._places: dict[int, int] = {}  # first cell of a batch -> where its last line begins
        first = header.encode() + b"\n"
        if not path.exists() or not path.stat().st_size:
            path.write_bytes(first)
        with open(path, "rb") as file:
            if file.readline() != first:
                raise ValueError(f"{path.name} begins with another line")
            self._end = file.tell()
            while (line := file.readline()).endswith(b"\n"):
                if (entry := read_checked_line(line)).get("name") is not None:
                    self._places[int(entry["name"])] = self._end
                self._end = file.tell()

    def write(self, first: int, notes: Notes, digest: int) -> None:
        """Write the notes of the batch that begins with a cell, and the digest of its numbers. Raises OSError."""
        value = [[[one.status, one.reason, one.count, list(one.first)] for one in notes_of] for notes_of in notes]
        line = checked_line({"name": str(first), "digest": digest, "value": value})
        with open(self.path, "r+b") as file:
            file.truncate(self._end)
            file.seek(self._end)
            file.write(line)
        self._places[first] = self._end
        self._end += len(line)

    def read(self, first: int, digest: int) -> Notes:
        """The notes of the batch that begins with a cell. Raises ValueError where none are written, and where they
        are those of other numbers."""
        place = self._places.get(first)
        if place is None:
            raise ValueError(f"{self.path.name} has no line of the batch at {first}")
        with open(self.path, "rb") as file:
            file.seek(place)
            entry = read_checked_line(file.readline())
        if entry.get("digest") != digest:
            raise ValueError(f"{self.path.name} tells of other numbers in the batch at {first}")
        return tuple(
            tuple(Note(s, reason, n, tuple(at)) for s, reason, n, at in notes) for notes in entry["value"]
        )
