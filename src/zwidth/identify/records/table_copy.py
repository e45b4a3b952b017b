"""A table's columns as numbers in a temporary file: written once, read often, in a memory that stays flat."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from tempfile import SpooledTemporaryFile
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Ints

IN_MEMORY: Final = 4_000_000  # bytes up to which there is no file
CELL: Final = 8  # bytes
MOST_WORDS: Final = 100  # distinct ones in a column; states and joints are fewer


class TableCopy:
    """Rows of numbers one behind the other; a word is the number of its place in a list.

    The file has no name, and is gone with this object or with the process.
    """

    def __init__(self, stream: Any, names: Sequence[str], words: Mapping[str, list[str]], rows: int) -> None:
        self._stream, self._names, self._words, self._rows = stream, tuple(names), dict(words), rows

    def pieces(self, rows: int) -> Iterator[dict[str, NDArray[Any]]]:
        """The columns in pieces of so many rows, in their order."""
        words = {name: np.array(listed, dtype=str) for name, listed in self._words.items()}
        width = len(self._names)
        for start in range(0, self._rows, rows):
            count = min(rows, self._rows - start)
            self._stream.seek(start * width * CELL)  # another pass may have read in between
            block = np.frombuffer(self._stream.read(count * width * CELL)).reshape(count, width)
            columns = dict(zip(self._names, np.ascontiguousarray(block.T), strict=True))
            yield {
                name: words[name][values.astype(np.int64)] if name in words else values
                for name, values in columns.items()
            }

    def __del__(self) -> None:
        self._stream.close()


class TableWriter:
    """Writes a `TableCopy` piece by piece. Where the disk is full there is none, which is no fault."""

    def __init__(self, names: Sequence[str], text: Sequence[str]) -> None:
        self._names, self._rows = tuple(names), 0
        self._places: dict[str, dict[str, int]] = {name: {} for name in text}
        self._stream: Any = SpooledTemporaryFile(max_size=IN_MEMORY)  # noqa: SIM115 - lives as long as the copy

    def __enter__(self) -> TableWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Drop what was written, unless it was handed over."""
        self._drop()

    def add(self, piece: Mapping[str, NDArray[Any]]) -> None:
        """Write the next rows."""
        if self._stream is None:
            return
        block = np.empty((len(piece[self._names[0]]), len(self._names)))
        for number, name in enumerate(self._names):
            block[:, number] = self._numbers(name, piece[name]) if name in self._places else piece[name]
        self._rows += len(block)
        if any(len(known) > MOST_WORDS for known in self._places.values()):
            self._drop()
            return
        try:
            self._stream.write(block.data)
        except OSError:
            self._drop()

    def copy(self) -> TableCopy | None:
        """Hand over what was written; None where it could not be."""
        stream, self._stream = self._stream, None
        words = {name: list(known) for name, known in self._places.items()}
        return None if stream is None else TableCopy(stream, self._names, words, self._rows)

    def _numbers(self, name: str, values: NDArray[Any]) -> Ints:
        """Places of words in the list, new ones put at its end, as long as they are few."""
        known = self._places[name]
        places = np.full(len(values), -1)
        for word, place in known.items():
            places[values == word] = place
        while len(known) <= MOST_WORDS and len(left := np.flatnonzero(places < 0)):
            word = str(values[left[0]])
            known[word] = len(known)
            places[left[values[left] == word]] = known[word]
        return places

    def _drop(self) -> None:
        if self._stream is not None:
            self._stream.close()
            self._stream = None
