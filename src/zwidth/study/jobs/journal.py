"""Journal of a long run: its results on disk, one a line, from which an interrupted run continues.

The first line holds the fingerprint of the question and the version of the format. A journal of another question
is emptied and begun again; one of a newer version is refused. Numbers are read back exactly. Each line has a
checksum: one that a crash or a disk has damaged is dropped with those behind it, and computed again. A journal of
version 1 has none; its lines are taken as they are, and get theirs.

Lines of JSON that carry a checksum, so that one which a crash or a disk has damaged is not read.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import zlib
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from zwidth.device.read import STORE_VERSION, newer_version_message, without_checksums
from zwidth.errors import StoreError


def fingerprint(*parts: object) -> str:
    """Fingerprint of a question: equal for equal numbers, dataclasses, arrays and containers of them.

    Raises  TypeError  for an object whose value cannot be read

    >>> fingerprint(1.0, np.arange(3)) == fingerprint(1.0, np.arange(3)) != fingerprint(1.0, np.arange(4))
    True
    """
    return hashlib.sha256(json.dumps([_plain(part) for part in parts]).encode()).hexdigest()


def _plain(part: object) -> Any:
    """The value as nested lists of its type and its text, no two alike for different values. Raises TypeError as
    `fingerprint`."""
    if isinstance(part, float | np.floating):
        return ["float", float(part).hex()]
    if part is None or isinstance(part, bool | int | str):
        return [type(part).__name__, repr(part)]
    if isinstance(part, np.ndarray):
        return ["array", str(part.dtype), list(part.shape), part.tobytes().hex()]
    if isinstance(part, dict):
        return ["dict", sorted([[str(key), _plain(value)] for key, value in part.items()])]
    if isinstance(part, list | tuple):
        return ["list", [_plain(value) for value in part]]
    if is_dataclass(part) and not isinstance(part, type):
        # a field that is neither given nor compared holds what has been computed so far
        names = [field.name for field in fields(part) if field.init or field.compare]
        return [type(part).__name__, [[name, _plain(getattr(part, name))] for name in names]]
    hint = "; load measures with zwidth.measures.load_measures, or leave out the store" if callable(part) else ""
    raise TypeError(f"a fingerprint cannot hold {part!r}: its value cannot be read{hint}")


class Journal:
    """Results computed so far, each under a name.

    path      file of the journal; None: in memory only
    question  see `fingerprint`
    Raises    StoreError  for a file that is no journal, or of a newer version
              OSError       where it cannot be read or written

    >>> journal = Journal(None, fingerprint("how much?"))
    >>> journal.get_or_compute("first", lambda: [1.5]), journal.get_or_compute("first", lambda: [2.5])
    ([1.5], [1.5])
    >>> journal.entries_read
    0
    """

    def __init__(self, path: Path | None, question: str) -> None:
        self.path = path
        self.known: dict[str, Any] = {}
        if path is None:
            self.entries_read = 0
            return
        if path.exists() and not path.is_file():
            raise StoreError(f"{path.name or path}: is not an ordinary file; name another")
        data = path.read_bytes() if path.exists() else b""
        # what follows the last line end was cut short
        lines = _lines_to_keep(path, data.split(b"\n")[:-1], data != b"", question)
        self.known = {entry["name"]: entry["value"] for entry in map(read_checked_line, lines[1:])}
        if (text := b"".join(line + b"\n" for line in lines)) != data:
            path.write_bytes(text)
        self.entries_read = len(self.known)  # number of results that the file held

    def get_or_compute(self, name: str, compute: Callable[[], Any]) -> Any:
        """The value under this name; if there is none yet, it is computed and written to the journal's file, if
        any.

        compute  returns what JSON holds: numbers (inf and nan, too), text, lists, dictionaries with text as keys
        """
        if name not in self.known:
            value = compute()
            if self.path is not None:
                with open(self.path, "ab") as stream:
                    stream.write(checked_line({"name": name, "value": value}))
                    stream.flush()
                    os.fsync(stream.fileno())
            self.known[name] = value
        return self.known[name]


def _lines_to_keep(path: Path, lines: list[bytes], not_empty: bool, question: str) -> list[bytes]:
    """The lines of a journal to keep: a new first line, and the others up to the first damaged one; of another
    question none of these. Lines of an older version, which have no checksums, get them.

    lines      of the file, without a last one that was cut short
    not_empty  whether the file holds anything, be it a part of a line
    Raises     StoreError  as `Journal`
    """
    first = json.dumps({"version": STORE_VERSION, "question": question}).encode()
    header = _json_object(lines[0]) if lines else {}
    if message := newer_version_message(header.get("version"), STORE_VERSION):
        raise StoreError(f"{path.name}: its version {message}, or name another file")
    if not_empty and not isinstance(header.get("question"), str):
        raise StoreError(f"{path.name}: is not the journal of a run; name another file, or remove it")
    if header.get("question") != question:
        return [first]
    unchecked = without_checksums(header.get("version"))
    kept = [first]
    for line in lines[1:]:
        entry = _json_object(line) if unchecked else read_checked_line(line)
        if not entry.keys() >= {"name", "value"}:
            break
        kept.append(checked_line(entry).removesuffix(b"\n") if unchecked else line)
    return kept


def _json_object(line: bytes) -> dict[str, Any]:
    """The JSON object of a line; {} where it holds none."""
    try:
        entry = json.loads(line)
    except ValueError:
        return {}
    return entry if isinstance(entry, dict) else {}


CHECKED: Final = re.compile(rb'(.*), "crc32": (\d+)\}\n?', re.DOTALL)


def checked_line(entry: Mapping[str, Any]) -> bytes:
    r"""A line that holds an entry and the CRC-32 of its text.

    >>> checked_line({"name": "one"})
    b'{"name": "one", "crc32": 4065295285}\n'
    """
    text = json.dumps(entry)
    return f'{text[:-1]}, "crc32": {zlib.crc32(text.encode())}}}\n'.encode()


def read_checked_line(line: bytes) -> dict[str, Any]:
    r"""The entry of a line, without its checksum; {} where the line is not what was written.

    >>> read_checked_line(checked_line({"name": "one"})), read_checked_line(b'{"name": "one"}\n')
    ({'name': 'one'}, {})
    """
    found = CHECKED.fullmatch(line)
    if found is None:
        return {}
    text = found[1] + b"}"
    if zlib.crc32(text) != int(found[2]):
        return {}
    entry = json.loads(text)
    return entry if isinstance(entry, dict) else {}
