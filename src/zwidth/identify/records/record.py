"""Records of measurements: columns of numbers from a file or from arrays, read in pieces where they are long.

`Columns` are those that a kind of measurement has. A long table is read as text once and kept as numbers in a
temporary file, so that memory stays flat; records of slow motion are shortened by averaging rows.
"""

from __future__ import annotations

import csv
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import SpooledTemporaryFile
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.arrays import Ints
from zwidth.device.faults import Fault, comma_list, fail, plural
from zwidth.device.read import decode, header_fault, read_head
from zwidth.errors import DeviceError, FileError

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
        """All rows at once, by column."""
        pieces = list(self.pieces())
        return {name: np.concatenate([piece[name] for piece in pieces]) for name in self.names} if pieces else {}

    def fault(self, message: str, row: int | None = None, column: str = "") -> DeviceError:
        """An error about the record, or about a cell of it, to be raised by the caller."""
        where = "" if row is None else self.place(row)
        return fail(self.label, ": ".join(filter(None, (where, column))), message)


class ArrayRecord(Record):
    """A record of arrays (n,) by column; those of the columns `text` hold words."""

    def __init__(self, columns: Mapping[str, ArrayLike], label: str, text: Sequence[str] = ()) -> None:
        self.label, self.names, self.text = label, tuple(columns), tuple(text)
        self._columns = {
            name: np.asarray(values, dtype=str if name in text else np.float64) for name, values in columns.items()
        }

    def pieces(self, rows: int = ROWS) -> Iterator[Piece]:
        """The columns in pieces of so many rows, views of the arrays."""
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

    header  all columns of the file;   names  those that are read;   text  columns that hold words where they are
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
        """Pieces of so many rows as pandas reads them from the text. Raises DeviceError for what is no table."""
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
        """An error that names the first lines without numbers, else pandas' own; to be raised by the caller."""
        faults = list[Fault]()
        rows = self._rows()
        _, header = next(rows)
        for line, cells in rows:
            for name in self.names:
                place = header.index(name)
                cell = cells[place] if place < len(cells) else ""
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
            return _matlab_record(file, head, wanted)
        text = decode(head[: head.rfind(b"\n") + 1] or head)
    except FileError as error:
        raise fail(str(file), "", f"{error}; give a CSV or .mat file with columns {wanted.listed}") from None
    lines = csv.reader(text.splitlines())
    for header in lines:
        if not any(cell.strip() for cell in header):
            continue
        names, wrong = wanted.choose([name.strip() for name in header])
        if wrong:
            raise fail(str(file), f"line {lines.line_num}", wrong)
        _check_row_lengths(str(file), len(header), lines)
        return CsvRecord(file, [name.strip() for name in header], names, wanted.text)
    raise fail(str(file), "", f"is empty; its first line must name columns: {wanted.listed}")


def _check_row_lengths(label: str, width: int, lines: Any) -> None:
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


def _matlab_record(path: Path, head: bytes, wanted: Columns) -> Record:
    """The record in a .mat file, `head` its first bytes. Raises DeviceError for a format or a size not read."""
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
    """Whether a variable of a .mat file is a column of numbers or of words."""
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "fiuU"


def _all_digits(release: str) -> dict[str, Any]:
    """Options for a release of pandas to read every digit: before 3.1 half of all numbers are off in the last."""
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
    """The columns of a record in at most so many rows; a record with columns of words is not averaged.
    Rows without a number in some column are left out.

    Each time that the rows are halved an odd last one is left out, and in the end what fills no average.
    Memory stays below that of 2 * `most` rows and one piece.
    """
    kept, rows, together, left_out = list[Piece](), 0, 1, 0
    remainder: Piece = {name: np.zeros(0) for name in record.names}
    for piece in record.pieces():
        whole = np.all([np.isfinite(v) for name, v in piece.items() if name not in record.text], axis=0)
        left_out += int(np.count_nonzero(~whole))
        piece = {
            name: np.concatenate([remainder[name], values[whole]]) if len(remainder[name]) else values[whole]
            for name, values in piece.items()
        }
        count = len(piece[record.names[0]]) // together * together
        remainder = {name: values[count:] for name, values in piece.items()}
        kept.append(_averaged(piece, count, together))
        rows += count // together
        while rows > most and not record.text:  # pairs are averaged once more
            even = rows // 2 * 2
            kept = [_averaged(_joined(kept, record.names), even, 2)]
            rows, together = even // 2, 2 * together
    return AveragedRows(_joined(kept, record.names), together, left_out)


def _joined(pieces: list[Piece], names: Sequence[str]) -> Piece:
    """The columns of several pieces, one behind the other; empty ones of no pieces."""
    return {name: np.concatenate([one[name] for one in pieces] or [np.zeros(0)]) for name in names}


def _averaged(piece: Piece, count: int, together: int) -> Piece:
    """The first `count` rows of a piece, each `together` of them replaced by their mean."""
    if together == 1:
        return {name: values[:count] for name, values in piece.items()}
    return {name: values[:count].reshape(-1, together).mean(axis=1) for name, values in piece.items()}


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
        """Close the temporary file, unless it was handed over."""
        self._close()

    def add(self, piece: Mapping[str, NDArray[Any]]) -> None:
        """Write the next rows; give the copy up where words are too many or the disk is full."""
        if self._stream is None:
            return
        block = np.empty((len(piece[self._names[0]]), len(self._names)))
        for number, name in enumerate(self._names):
            block[:, number] = self._places_of_words(name, piece[name]) if name in self._places else piece[name]
        self._rows += len(block)
        if any(len(known) > MOST_WORDS for known in self._places.values()):
            self._close()
            return
        try:
            self._stream.write(block.data)
        except OSError:
            self._close()

    def copy(self) -> TableCopy | None:
        """Hand over what was written; None where it could not be."""
        stream, self._stream = self._stream, None
        words = {name: list(known) for name, known in self._places.items()}
        return None if stream is None else TableCopy(stream, self._names, words, self._rows)

    def _places_of_words(self, name: str, values: NDArray[Any]) -> Ints:
        """Places (n,) of words in the column's list, new ones put at its end, as long as they are few."""
        known = self._places[name]
        places = np.full(len(values), -1)
        for word, place in known.items():
            places[values == word] = place
        while len(known) <= MOST_WORDS and len(left := np.flatnonzero(places < 0)):
            word = str(values[left[0]])
            known[word] = len(known)
            places[left[values[left] == word]] = known[word]
        return places

    def _close(self) -> None:
        """Close the temporary file and write no more."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None


BRACKETS: Final = re.compile(r"(?P<quantity>[^\[\](){}]+)[\[({](?P<unit>[^\[\](){}]+)[\])}]")
EACH: Final = ".*"  # behind a name: of each part of the device that it is followed by

# Unit that a column is named by -> units that people record it in, and by what they are multiplied.
OTHER_UNITS: Final = {
    "rad": {
        "deg": "pi/180",
        "degree": "pi/180",
        "degrees": "pi/180",
        "mrad": "0.001",
        "rev": "2 pi",
        "counts": "",
    },
    "m": {"mm": "0.001", "um": "1e-6", "cm": "0.01", "counts": ""},
    "N": {"mN": "0.001", "kN": "1000", "V": ""},
    "Nm": {"mNm": "0.001", "Nmm": "0.001", "mN_m": "0.001", "V": ""},
    "s": {"ms": "0.001", "us": "1e-6", "min": "60"},
    "A": {"mA": "0.001"},
    "Hz": {"kHz": "1000", "rad_per_s": "1/(2 pi)"},
    "N_per_m": {"N_per_mm": "1000"},
    "Ns_per_m": {"Ns_per_mm": "1000"},
}


@dataclass(frozen=True)
class Columns:
    """Columns that a kind of measurement has.

    needed    each of them, or one of several where they are alternatives: ("time_s", ("force_N", "torque_Nm")).
              A name that ends in ".*" stands for all columns that begin so, one or more, each of another part of
              the device: "angle_rad.*" for angle_rad.upper and angle_rad.lower; or for angle_rad alone, of a
              device with one such part. Alternatives with ".*" may stand beside each other. MATLAB's names have no
              dot: angle_rad_upper is read, too
    optional  numbers that are read where they are there
    text      the same, words or numbers: names of joints, of those who held the device
    """

    needed: tuple[str | tuple[str, ...], ...]
    optional: tuple[str, ...] = ()
    text: tuple[str, ...] = ()

    @property
    def listed(self) -> str:
        """The needed columns as messages name them."""
        return ", ".join(one if isinstance(one, str) else " or ".join(one) for one in self.needed)

    def choose(self, names: Sequence[str]) -> tuple[list[str], str]:
        """The columns to read of those that a table has, and what is wrong with them; "" if nothing."""
        chosen, faults = list[str](), list[str]()
        for one in self.needed:
            choices = (one,) if isinstance(one, str) else one
            several = any(choice.endswith(EACH) for choice in choices)
            present = [name for choice in choices for name in _matching(choice, names)]
            if len(present) > 1 and not several:
                faults.append(f"columns {' and '.join(present)} are alternatives; keep one of them")
            elif not present:
                faults.append(f"column {' or '.join(choices)} is missing{self._other_unit(choices, names)}")
            chosen += present if several else present[:1]
        optional = [name for one in (*self.optional, *self.text) for name in _matching(one, names)]
        if not optional:  # a force in another unit must not be taken for none
            hints = {one: self._other_unit((one,), names) for one in self.optional}
            faults += [f"column {one} is missing{hint}" for one, hint in hints.items() if hint]
        chosen += optional
        # without "; needed are ...": nothing is needed here
        if twice := header_fault(names, [], chosen).partition(";")[0]:
            faults.append(twice)
        if faults and not any(" is there: " in fault for fault in faults):
            # of a single name: the part of the sentence that says what separates the cells
            separated = header_fault(names, chosen or ["?"]).partition(": ")[2] if len(names) == 1 else ""
            faults.append(separated or _header_fault(names) or f"needed are {self.listed}")
        return chosen, "; ".join(faults)

    @staticmethod
    def _other_unit(choices: Sequence[str], names: Sequence[str]) -> str:
        """A hint where a column of the same quantity is there, written otherwise or in another unit."""
        written = {plain_name(name).lower(): name for name in reversed(names)}
        plain = [plain_name(name) for name in names]
        for choice in choices:
            if not choice.endswith(EACH) and choice.lower() in written:
                return f"; '{written[choice.lower()]}' is there: name it {choice}"
            quantity, _, unit = choice.removesuffix(EACH).partition("_")
            each = EACH if choice.endswith(EACH) else ""
            for other, factor in OTHER_UNITS.get(unit, {}).items():
                for there in _matching(f"{quantity}_{other}{each}", plain):
                    by = f"multiply by {factor}" if factor else "multiply by the value of one"
                    named = there.replace(f"{quantity}_{other}", f"{quantity}_{unit}", 1)
                    return f"; {names[plain.index(there)]} is there: {by} and name it {named}"
        return ""


def plain_name(name: str) -> str:
    """A column's name as this project writes it, of one with its unit in brackets; others stay as they are.

    >>> [plain_name(name) for name in ("Time [s]", "torque (mN m)", "motor angle_rad")]
    ['time_s', 'torque_mNm', 'motor angle_rad']
    """
    found = BRACKETS.fullmatch(name.strip())
    if found is None:
        return name
    quantity, unit = found["quantity"].strip().lower(), re.sub(r"[\s*·.]", "", found["unit"])
    return f"{quantity.replace(' ', '_')}_{unit.replace('/', '_per_')}"


def _header_fault(names: Sequence[str]) -> str:
    """Message: what stands where the names of columns should; "" where names do."""
    if names and names[0].startswith(("#", "%", "//")):
        return "the line is a comment; begin with the line that names the columns"
    try:
        [float(name) for name in names]
    except ValueError:
        return ""
    return "the line holds numbers; write the names of the columns above them" if names else ""


def _matching(wanted: str, names: Sequence[str]) -> list[str]:
    """The columns that a wanted name stands for, in their order.

    >>> _matching("angle_rad.*", ["time_s", "angle_rad.upper", "angle_rad_lower"])
    ['angle_rad.upper', 'angle_rad_lower']
    """
    if not wanted.endswith(EACH):
        return [wanted] if wanted in names else []
    stem = wanted.removesuffix(EACH)
    return [name for name in dict.fromkeys(names) if name == stem or name.startswith((f"{stem}.", f"{stem}_"))]
