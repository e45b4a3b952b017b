"""Plain files with text: read whole, up to a size. What is none is refused before it is opened.

Versions of what zwidth reads and keeps: device files, study files, stores of long runs.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

from zwidth._version import __version__
from zwidth.device.faults import fail
from zwidth.errors import FileError

LARGEST_TABLE: Final = 200_000_000  # bytes of CSV: some millions of lines, an hour of samples at 1 kHz
SEPARATORS: Final = {";": "';'", "\t": "tabs", "|": "'|'"}  # that tables are written with instead of commas
_KINDS: Final = ((stat.S_ISFIFO, "pipe"), (stat.S_ISSOCK, "socket"))


def read_plain(path: str | os.PathLike[str], largest: int, *, pipes: bool = False) -> bytes:
    """Bytes of a plain file, found by its path, of at most `largest` bytes; links are followed.

    pipes   are waited for, too: only where the user names the file, as in `--points <(program)`
    Raises  FileError  where there is none, for anything else than a plain file, for one that is larger,
                                 and where the system refuses to read it
    """
    data = read_head(path, largest + 1, pipes=pipes)
    if len(data) > largest:
        raise FileError(f"is larger than {largest // 1_000_000} MB")
    return data


def read_head(path: str | os.PathLike[str], most: int, *, pipes: bool = False) -> bytes:
    """The first bytes of a plain file, at most so many; as `read_plain`, but for its size."""
    try:
        if wrong := _no_plain_file(os.stat(path).st_mode, pipes):
            raise FileError(wrong)
        with open(path, "rb") as stream:
            return stream.read(most)
    except FileNotFoundError:
        raise FileError("no such file", missing=True) from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise FileError(f"cannot be read: {reason[:1].lower() + reason[1:]}") from None
    except ValueError as error:
        if isinstance(error, FileError):
            raise
        raise FileError("cannot be read: its name holds a zero byte") from None


def _no_plain_file(mode: int, pipes: bool) -> str:
    """What something other than a plain file is; "" for a plain file, or a pipe where those are taken."""
    if stat.S_ISREG(mode) or (pipes and stat.S_ISFIFO(mode)):
        return ""
    if stat.S_ISDIR(mode):
        return "is a directory"
    kind = next((kind for test, kind in _KINDS if test(mode)), "device")
    return f"is a {kind}, not an ordinary file"


def read_text(path: str | os.PathLike[str], largest: int, *, pipes: bool = False) -> str:
    """Text of a plain file in UTF-8, with or without a byte order mark.

    pipes   as in `read_plain`
    Raises  FileError  as `read_plain`, and for what is not such text
    """
    return decode(read_plain(path, largest, pipes=pipes))


def decode(data: bytes) -> str:
    """Text of bytes in UTF-8, with or without a byte order mark. Raises FileError for anything else."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FileError("is UTF-16 text, not UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(f"is not UTF-8 text (byte {error.start} is 0x{data[error.start]:02x})") from None
    if "\x00" in text:
        raise FileError(f"is a binary file (byte {data.index(0)} is zero)")
    return text


def non_blank_rows(rows: Iterator[list[str]]) -> Iterator[list[str]]:
    """The rows of a table that are not blank."""
    return (row for row in rows if any(cell.strip() for cell in row))


def header_fault(header: Sequence[str], needed: Sequence[str], optional: Collection[str] = ()) -> str:
    """What is wrong with the names of a table's columns, one sentence; "" if nothing.

    It says what is needed and nothing of what is there: the file may be another than was meant.

    >>> header_fault(["frequency_Hz"], ["frequency_Hz", "coherence"])
    'column coherence is missing; needed are frequency_Hz, coherence'
    >>> header_fault(["K;B"], ["K", "B"])
    "columns K, B are missing: the cells are separated by ';'; use commas"
    """
    missing = [name for name in needed if name not in header]
    twice = [name for name in (*needed, *optional) if header.count(name) > 1]
    faults = []
    if missing:
        faults.append(f"{_columns(missing)} missing")
    if twice:
        faults.append(f"{_columns(twice)} there more than once")
    if not faults:
        return ""
    other = next((name for mark, name in SEPARATORS.items() if len(header) == 1 and mark in header[0]), None)
    if missing and other:
        return f"{' and '.join(faults)}: the cells are separated by {other}; use commas"
    return f"{' and '.join(faults)}; needed are {', '.join(needed)}"


def _columns(names: Sequence[str]) -> str:
    """Subject and verb of a sentence: "column a is", "columns a, b are"."""
    return f"column {names[0]} is" if len(names) == 1 else f"columns {', '.join(names)} are"


KEY: Final = "file_version"
FILE_VERSION: Final = 1  # of device, operator and study files
STORE_VERSION: Final = 2  # of stores and journals
CHECKED: Final = 2  # the first version of stores and journals in which what they hold has checksums


def newer_version_message(version: object, known: int) -> str:
    """What to say of something of a newer version than is known; "" for any other.

    >>> newer_version_message(1, 1), newer_version_message("two", 1), newer_version_message(True, 1)
    ('', '', '')
    """
    if isinstance(version, bool) or not isinstance(version, int | float) or not version > known:
        return ""
    return f"is {version:g}, and zwidth {__version__} reads up to version {known}; upgrade zwidth"


def without_checksums(version: object) -> bool:
    """Whether a store or journal of a version has no checksums; one that names no version is of the first.

    >>> [without_checksums(one) for one in (None, 1, 2, True, "two")]
    [True, True, False, False, False]
    """
    if version is None:
        return True
    return not isinstance(version, bool) and isinstance(version, int | float) and version < CHECKED


def unchecked_version_message(version: object) -> str:
    """What to say of a store of a version whose cells have no checksums; "" for any other.

    >>> unchecked_version_message(2)
    ''
    """
    if not without_checksums(version):
        return ""
    number = 1 if version is None else version
    return f"is {number:g}, whose cells have no checksums, and zwidth {__version__} reads version {STORE_VERSION}"


def check_not_newer(document: Mapping[str, Any], label: str) -> None:
    """Raise DeviceError for a file of a newer version, whose other keys nobody can judge."""
    if message := newer_version_message(document.get(KEY), FILE_VERSION):
        raise fail(label, KEY, message)


def without_version(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document but for its version, which is no number of what it describes."""
    return {key: value for key, value in document.items() if key != KEY}
