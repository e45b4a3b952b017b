"""Notes of a store's batches: a file of lines, of which only their places are kept in memory."""

from __future__ import annotations

import json
import os
from pathlib import Path

from zwidth.measures.definition import Note
from zwidth.study.jobs.job import Notes


class NotesFile:
    """Why cells have no value, by batch, a line each; a first line holds the version and the fingerprint.

    A line cut short by a crash or a full disk is dropped, with what follows.

    header  first line
    Raises  OSError     where the file cannot be read or written
            ValueError  where it begins with another line
    """

    def __init__(self, path: Path, header: str) -> None:
        self.path = path
        self._places: dict[int, int] = {}  # first cell of a batch -> where its line begins
        first = header.encode() + b"\n"
        if not path.exists() or not path.stat().st_size:
            path.write_bytes(first)
        with open(path, "rb") as file:
            if file.readline() != first:
                raise ValueError(f"{path.name} begins with another line")
            self._end = file.tell()
            while (line := file.readline()).endswith(b"\n"):
                try:
                    self._places[int(json.loads(line)["name"])] = self._end
                except (ValueError, KeyError, TypeError):
                    break
                self._end = file.tell()

    def write(self, first: int, notes: Notes) -> None:
        """Write the notes of the batch that begins with a cell. Raises OSError."""
        value = [[[one.status, one.reason, one.count, list(one.first)] for one in notes_of] for notes_of in notes]
        line = json.dumps({"name": str(first), "value": value}).encode() + b"\n"
        with open(self.path, "r+b") as file:
            file.truncate(self._end)
            file.seek(self._end)
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        self._places[first] = self._end
        self._end += len(line)

    def read(self, first: int, measures: int) -> Notes:
        """The notes of the batch that begins with a cell; none where none are written."""
        place = self._places.get(first)
        if place is None:
            return ((),) * measures
        with open(self.path, "rb") as file:
            file.seek(place)
            value = json.loads(file.readline())["value"]
        return tuple(tuple(Note(s, reason, n, tuple(at)) for s, reason, n, at in notes) for notes in value)
