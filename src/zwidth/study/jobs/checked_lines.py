"""Lines of JSON that carry a checksum, so that one which a crash or a disk has damaged is not read."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Mapping
from typing import Any, Final

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
