"""Records of measurements: columns of numbers from a file or from arrays, read in pieces where they are long."""

from __future__ import annotations

import csv
import os
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.device.faults import DeviceError, Fault, comma_list, fail, plural
from zwidth.device.text_file import UnreadableFileError, decode, read_head
from zwidth.identify.records.columns import Columns
from zwidth.identify.records.table_copy import TableCopy, TableWriter

Piece = dict[str, NDArray[Any]]  # columns of numbers, and those of words

ROWS: Final = 500_000  # in a piece: 40 MB of a table of ten columns
MOST_FAULTS: Final = 3  # lines that are named of one column
LARGEST_MATLAB: Final = 1_000_000_000  # bytes, read whole
HEADER: Final = 65_536  # bytes in which a header line ends
HDF5: Final = b"\x89HDF\r\n\x1a\n"
MISSING: Final = ("", "nan", "na", "n/a", "null", "none", "#n/a", "<na>")


class Record(ABC):
    """A table with one row for each sample, or for each measured point.

    label    of the file, or of what was handed over, for messages
    names    of the columns
    text     those of them that hold words
    """

    label: str
    names: tuple[str, ...]
    text: tuple[str, ...]

    @abstractmethod
    def pieces(self, rows: int = ROWS) -> Iterator[Piece]:
        """The columns in pieces of so many rows, in their order; cells without a number are nan."""

    @abstractmethod
    def place(self, row: int) -> str:
        """Where a row stands, for messages: "line 7" of a file, "row 5" of arrays."""

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def columns(self) -> Piece:
        """All of it at once."""
        pieces = list(self.pieces())
        return {name: np.concatenate([piece[name] for piece in pieces]) for name in self.names} if pieces else {}

    def fault(self, message: str, row: int | None = None, column: str = "") -> DeviceError:
        """An error about the record, or about a cell of it, to be raised by the caller."""
        where = "" if row is None else self.place(row)
        return fail(self.label, ": ".join(filter(None, (where, column))), message)


class ArrayRecord(Record):
    """A record of arrays."""

    def __init__(self, columns: Mapping[str, ArrayLike], label: str, text: Sequence[str] = ()) -> None:
        self.label, self.names, self.text = label, tuple(columns), tuple(text)
        self._columns = {
            name: np.asarray(values, dtype=str if name in text else np.float64) for name, values in columns.items()
        }

    def pieces(self, rows: int = ROWS) -> Iterator[Piece]:
        """Views of the arrays."""
        count = len(next(iter(self._columns.values()), ()))
        for start in range(0, count, rows):
            yield {name: values[start : start + rows] for name, values in self._columns.items()}

    def place(self, row: int) -> str:
        """Rows count from 0, as Python's indices do."""
        return f"row {row}"


class CsvRecord(Record):
    """A record in a CSV file.

    Text takes long to read as numbers: what the first pass over the whole file reads is kept as numbers in a
    temporary file, from which all later passes read. A file that changes in between is not read again.
    """

    def __init__(self, path: Path, header: Sequence[str], names: Sequence[str], text: Sequence[str]) -> None:
        self.label, self.names, self._path = str(path), tuple(names), path
        # columns that are not read may have no name, or one that is there twice
        self._header = [name if name in names else f"column {number}" for number, name in enumerate(header)]
        self.text = tuple(name for name in names if name in text)
        self._copy: TableCopy | None = None

    def pieces(self, rows: int = ROWS) -> Iterator[Piece]:
        """Pieces of the file. Raises DeviceError for cells that are no numbers, with their lines."""
        if self._copy is not None:
            yield from self._copy.pieces(rows)
            return
        with TableWriter(self.names, self.text) as writer:
            for piece in self._parsed(rows):
                writer.add(piece)
                yield piece
            self._copy = writer.copy()

    def _parsed(self, rows: int) -> Iterator[Piece]:
        """Pieces as pandas reads them from the text."""
        import pandas

        kinds = {name: str if name in self.text else np.float64 for name in self.names}
        try:
            with pandas.read_csv(
                self._path,
                names=self._header,
                header=0,
                usecols=list(self.names),
                dtype=kinds,
                chunksize=rows,
                skipinitialspace=True,
                encoding="utf-8-sig",
                index_col=False,
                **_all_digits(pandas.__version__),
            ) as reader:
                for piece in reader:
                    yield {
                        name: _words(piece[name]) if name in self.text else piece[name].to_numpy()
                        for name in self.names
                    }
        except (ValueError, OSError) as error:
            raise self._fault_of_lines(error) from None

    def place(self, row: int) -> str:
        """The line of a row, blank lines counted as an editor counts them."""
        for number, (line, _) in enumerate(self._rows()):
            if number == row + 1:
                return f"line {line}"
        return f"row {row}"

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        """Line number and cells of every line that is not blank, header first."""
        with open(self._path, encoding="utf-8-sig", errors="replace", newline="") as stream:
            rows = csv.reader(stream)
            try:
                for cells in rows:
                    if any(cell.strip() for cell in cells):
                        yield rows.line_num, [cell.strip() for cell in cells]
            except csv.Error:
                return

    def _fault_of_lines(self, error: Exception) -> DeviceError:
        """The first lines that hold no numbers, looked for one by one."""
        faults = list[Fault]()
        rows = self._rows()
        _, header = next(rows)
        for line, cells in rows:
            for name in self.names:
                at = header.index(name)
                cell = cells[at] if at < len(cells) else ""
                if name not in self.text and not _is_number(cell):
                    text = f"must be a number, got {cell[:60]!r}"
                    faults.append(Fault(self.label, f"line {line}: {name}", text))
            if len(faults) >= MOST_FAULTS:
                break
        reason = " ".join(str(error).split())
        return DeviceError(faults or [Fault(self.label, "", f"cannot be read as a table: {reason[:200]}")])


def read_record(path: str | os.PathLike[str], wanted: Columns) -> Record:
    """A record from a .csv or .mat file.

    Raises DeviceError  where there is no such file, where columns are missing, or cells are no numbers (of a CSV
                        file when its pieces are read)
    """
    file = Path(path)
    try:
        head = read_head(file, HEADER)
        if file.suffix.lower() == ".mat":
            return _matlab(file, head, wanted)
        text = decode(head[: head.rfind(b"\n") + 1] or head)
    except UnreadableFileError as error:
        raise fail(str(file), "", f"{error}; give a CSV or .mat file with columns {wanted.listed}") from None
    lines = csv.reader(text.splitlines())
    for header in lines:
        if not any(cell.strip() for cell in header):
            continue
        names, wrong = wanted.choose([name.strip() for name in header])
        if wrong:
            raise fail(str(file), f"line {lines.line_num}", wrong)
        _refuse_longer_rows(str(file), len(header), lines)
        return CsvRecord(file, [name.strip() for name in header], names, wanted.text)
    raise fail(str(file), "", f"is empty; its first line must name columns: {wanted.listed}")


def _refuse_longer_rows(label: str, width: int, lines: Any) -> None:
    """Raise DeviceError for the first row of a csv.reader with more cells than the header names, as decimal commas
    make them."""
    for row in lines:
        if any(cell.strip() for cell in row[width:]):
            wrong = f"has {len(row)} cells, but the header names {plural(width, 'column')}"
            raise fail(label, f"line {lines.line_num}", f"{wrong}; write decimal points, no commas")


def record_of(columns: Mapping[str, ArrayLike] | Any, wanted: Columns, label: str = "record") -> Record:
    """A record of arrays: a mapping of columns, a pandas table, or an xarray dataset along one dimension.

    Raises DeviceError  where columns are missing, hold no numbers, or are not of one length
    """
    varying = getattr(columns, "data_vars", None)  # of a dataset, what varies and along what
    available: Mapping[str, Any] = columns if varying is None else {**getattr(columns, "coords", {}), **varying}
    names, wrong = wanted.choose([str(name) for name in available])
    if wrong:
        raise fail(label, "", wrong)
    arrays = dict[str, NDArray[Any]]()
    for name in names:
        try:
            arrays[name] = np.asarray(available[name], dtype=str if name in wanted.text else np.float64)
        except (TypeError, ValueError):
            raise fail(label, name, "must hold numbers") from None
    shapes = {name: values.shape for name, values in arrays.items()}
    if any(len(shape) != 1 for shape in shapes.values()) or len(set(shapes.values())) > 1:
        listed = comma_list([f"{name} {shape}" for name, shape in shapes.items()])
        raise fail(label, "", f"columns must be of one dimension and of one length, got {listed}")
    return ArrayRecord(arrays, label, [name for name in names if name in wanted.text])


def _matlab(path: Path, head: bytes, wanted: Columns) -> Record:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    if HDF5 in head[:1024] or b"MATLAB 7.3" in head[:128]:
        raise fail(str(path), "", "is of MATLAB's format 7.3; save it with -v7")
    if path.stat().st_size > LARGEST_MATLAB:
        raise fail(str(path), "", f"is larger than {LARGEST_MATLAB // 1_000_000} MB; save it as CSV")
    try:
        content = loadmat(path, squeeze_me=True)
    except (MatReadError, ValueError, NotImplementedError, TypeError, OSError) as error:
        raise fail(str(path), "", f"is no .mat file: {error}") from None
    columns = {name: value for name, value in content.items() if _is_column(value)}
    return record_of(columns, wanted, str(path))


def _is_column(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiuU"


def _all_digits(release: str) -> dict[str, Any]:
    """What makes a release of pandas read every digit: before 3.1 half of all numbers are off in the last one."""
    major, minor = (int(part) for part in release.split(".")[:2])
    return {} if (major, minor) >= (3, 1) else {"float_precision": "round_trip"}


def _words(column: Any) -> NDArray[Any]:
    """The words of a column of a pandas table without blanks around them; each distinct one is looked at once."""
    import pandas

    codes, distinct = pandas.factorize(column, use_na_sentinel=False)
    words: NDArray[Any] = np.array([str(value).strip() for value in distinct], dtype=str)[codes]
    return words


def _is_number(cell: str) -> bool:
    """Whether pandas takes a cell for a number; an empty one is a missing one."""
    try:
        float(cell)
    except ValueError:
        return cell.lower() in MISSING
    return "_" not in cell
