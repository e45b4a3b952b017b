"""From a name or a path to the document: the plain tables and lists that the file holds.

Faults of TOML text as sentences: what the parser reports, and what was probably meant.

Device files to start from: one for each kind of device, complete, with a comment on every number.

Plain files with text: read whole, up to a size. What is none is refused before it is opened.

Versions of what zwidth reads and keeps: device files, study files, stores of long runs.
"""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from zwidth._version import __version__
from zwidth.device.faults import comma_list, fail, nearest
from zwidth.errors import FileError
from zwidth.model.argument_checks import check_choice

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
    """The first bytes of a plain file, at most so many; as `read_plain`, but for its size. Raises FileError."""
    try:
        if wrong := _not_plain_message(os.stat(path).st_mode, pipes):
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


def _not_plain_message(mode: int, pipes: bool) -> str:
    """What is wrong with a path that leads to no plain file, by its mode (`os.stat`); "" for a plain file, or a
    pipe where those are taken."""
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
        faults.append(f"{_columns_and_verb(missing)} missing")
    if twice:
        faults.append(f"{_columns_and_verb(twice)} there more than once")
    if not faults:
        return ""
    other = next((name for mark, name in SEPARATORS.items() if len(header) == 1 and mark in header[0]), None)
    if missing and other:
        return f"{' and '.join(faults)}: the cells are separated by {other}; use commas"
    return f"{' and '.join(faults)}; needed are {', '.join(needed)}"


def _columns_and_verb(names: Sequence[str]) -> str:
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


@dataclass(frozen=True)
class BundledFiles:
    """Files that come with the package.

    folder     in this package
    noun       what each describes
    file_noun  the same with "file" and its article
    needs      what a file of this kind must hold, as a sentence
    else_name  another name that is allowed, with its meaning; "" for none
    """

    folder: str
    noun: str
    file_noun: str
    needs: str
    else_name: str = ""


DEVICES: Final[BundledFiles] = BundledFiles(
    "zoo", "device", "a device file", "a device needs a name, [loop], and [mechanism], [plant] or [response]"
)
OPERATORS: Final[BundledFiles] = BundledFiles(
    "operators",
    "operator",
    "an operator file",
    "an operator needs an [operator] table",
    "none (for an ungripped device)",
)
LARGEST_FILE: Final = 10_000_000  # bytes; the bundled ones have a few thousand
DEEPEST: Final = 20  # tables and lists within each other; a mechanism needs 5


def bundled_names(shelf: BundledFiles = DEVICES) -> list[str]:
    """Names of the bundled devices, sorted."""
    entries = (entry.name for entry in _folder_of(shelf).iterdir())
    return sorted(name.removesuffix(".toml") for name in entries if name.endswith(".toml"))


def first_bundled() -> str:
    """The bundled device that is shown where none is named: the file `first` of their folder names it."""
    return str((_folder_of(DEVICES) / "first").read_text(encoding="utf-8")).strip()


def bundled(shelf: BundledFiles = DEVICES) -> list[tuple[str, str, str]]:
    """(name, description, source) of every bundled device; their numbers are not checked here."""
    listing = []
    for name in bundled_names(shelf):
        document = parse_document(_bundled_text(name, shelf), name, shelf)
        table = document.get("operator", document)
        listing.append((name, str(table.get("description", "")), str(table.get("source", ""))))
    return listing


def read(
    name_or_path: str | os.PathLike[str], shelf: BundledFiles = DEVICES, *, pipes: bool = False
) -> tuple[dict[str, Any], str]:
    """The document of a bundled device (or operator) or of a file, and what to call it in messages.

    A bundled name wins over a file of the same name; write ./name for the file.
    pipes  are read, too: where the user names the file on the command line
    Raises DeviceError  if there is no such file, it cannot be read, or it is not TOML
    """
    label = os.fspath(name_or_path)
    names = bundled_names(shelf)
    if not label:
        message = f"the name is empty; give {shelf.file_noun}, or a bundled name: {comma_list(names)}"
        raise fail(shelf.noun, "", message)
    if label in names:
        return parse_document(_bundled_text(label, shelf), label, shelf), label
    return parse_document(_text_of_file(label, shelf, pipes), label, shelf), label


def device_text(label: str) -> str:
    """The text of a bundled device or of a file, as it is written. Raises DeviceError where there is none."""
    return _bundled_text(label, DEVICES) if label in bundled_names() else _text_of_file(label, DEVICES, False)


def parse_document(text: str, label: str, shelf: BundledFiles = DEVICES) -> dict[str, Any]:
    """The document a TOML text holds; never empty, never nested beyond reason, never of a newer version.
    Raises DeviceError for any other text."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise fail(label, "", toml_fault(text, error)) from None
    except RecursionError:
        raise fail(label, "", f"is nested too deeply; at most {DEEPEST} levels are allowed") from None
    except ValueError as error:  # a whole number of thousands of digits
        raise fail(label, "", f"holds a number that cannot be read: {_lower_first(str(error))}") from None
    check_not_newer(document, label)
    if not document:
        raise fail(label, "", f"is empty; {shelf.needs}")
    if not within_depth(document):
        raise fail(label, "", f"is nested too deeply; at most {DEEPEST} levels are allowed")
    return document


def within_depth(value: Any, deepest: int = DEEPEST) -> bool:
    """Whether tables and lists are nested no deeper than this; level by level, where recursion might fail."""
    level = [value]
    for _ in range(deepest + 1):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return True
    return False


def _text_of_file(label: str, shelf: BundledFiles, pipes: bool) -> str:
    """The text of a file. Raises DeviceError where it is missing or no text, with the nearest bundled name."""
    try:
        return read_text(label, LARGEST_FILE, pipes=pipes)
    except FileError as error:
        wrong = (
            _not_found_message(label, shelf)
            if error.missing
            else f"{error}; give {shelf.file_noun} or a bundled name"
        )
        raise fail(label, "", wrong) from None


def _not_found_message(label: str, shelf: BundledFiles) -> str:
    """The sentence for a name that is neither a file nor a bundled one, with the nearest bundled name."""
    names = bundled_names(shelf)
    near = nearest(Path(label).name.removesuffix(".toml"), names)
    hint = f"did you mean '{near}'? " if near else ""
    other = f"; or {shelf.else_name}" if shelf.else_name else ""
    return f"is neither a file nor a bundled {shelf.noun}; {hint}bundled: {comma_list(names)}{other}"


def _bundled_text(name: str, shelf: BundledFiles) -> str:
    return str((_folder_of(shelf) / f"{name}.toml").read_text(encoding="utf-8"))


def _folder_of(shelf: BundledFiles) -> Any:
    """The folder of bundled files in the installed package."""
    return files("zwidth.device") / shelf.folder


def _lower_first(text: str) -> str:
    return text[:1].lower() + text[1:]


PLACE: Final = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
DECIMAL_COMMA: Final = re.compile(r"[=\[,]\s*([-+]?\d+),(\d+(?:[eE][-+]?\d+)?)\s*(?:#.*)?$")
TABLE_TWICE: Final = re.compile(r"Cannot declare \((.+?),?\) twice")


def toml_fault(text: str, error: tomllib.TOMLDecodeError) -> str:
    """A sentence on the error of a text: the line, and what to write instead where that can be seen.

    >>> text = "mass_kg = 0,045"
    >>> try:
    ...     tomllib.loads(text)
    ... except tomllib.TOMLDecodeError as error:
    ...     toml_fault(text, error)
    'line 1: 0,045 has a decimal comma; write 0.045'
    """
    message, lines = str(error), text.splitlines()
    where = PLACE.search(message)
    # an error "at end of document" is one of the last line that holds anything
    filled = [n for n, line in enumerate(lines, 1) if line.strip()]
    number = int(where[1]) if where and where[1] else (filled[-1] if filled else 1)
    line = lines[number - 1] if number <= len(lines) else ""
    comma = DECIMAL_COMMA.search(line)
    if comma and "Expected newline" in message:
        return f"line {number}: {comma[1]},{comma[2]} has a decimal comma; write {comma[1]}.{comma[2]}"
    if "Cannot overwrite a value" in message:
        key = line.partition("=")[0].strip()
        return f"line {number}: {key} is there twice; keep one of them"
    if twice := TABLE_TWICE.match(message):
        name = ".".join(part.strip(" '\"") for part in twice[1].split(","))
        return f"line {number}: [{name}] is there twice; put its keys under one heading"
    return f"is not TOML: {message[:1].lower()}{message[1:]}"


# Kind of device, in the field's words -> its file in `templates`.
KINDS: Final = {
    "paddle": "one-link.toml",
    "serial-2r": "two-links.toml",
    "five-bar": "two-arms.toml",
    "delta": "three-legs.toml",
    "stewart": "six-legs.toml",
    "wrist": "three-axes.toml",
    "plant": "masses.toml",
}
PLACEHOLDER: Final = '"NAME"'


def new_device(name: str, kind: str) -> str:
    """A device file of plausible numbers to start from, as text: each number has a comment that says what it is,
    its unit and where one gets it; what may be left out is there as a comment.

    name    the device's name
    kind    "paddle", one link on a drive; "serial-2r", a planar arm of two links; "five-bar", a planar linkage of
            two arms; "delta", a platform on three legs; "stewart", a platform on six sliding legs; "wrist", three
            axes that meet; "plant", masses along the rendered direction
    Raises  ValueError  for another kind, and for a name that is not one line of text

    >>> new_device("My paddle", "paddle").splitlines()[2].split("#")[0].strip()
    'name = "My paddle"'
    """
    check_choice("kind", kind, KINDS)
    if not name.strip() or not name.isprintable():
        raise ValueError(f"name must be a line of text, got {name!r}")
    text = (files("zwidth.device") / "templates" / KINDS[kind]).read_text(encoding="utf-8")
    return text.replace(PLACEHOLDER, json.dumps(name, ensure_ascii=False), 1)
