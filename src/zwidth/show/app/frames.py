"""An answer as one binary message: a head of JSON, then its arrays, each at a multiple of eight bytes.

    uint32 length of the head | the head as UTF-8, blanks up to a multiple of 8 | array | array | ...

The head's `arrays` names them: name -> [type, shape, first byte, counted from the end of the head]. A page makes
typed arrays on the message's own memory, so that nothing is parsed number by number.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.show.output import json_value

ALIGNED: Final = 8  # bytes; what typed arrays of doubles ask for
LENGTH: Final = 4  # bytes of the number that the head's length is
# Types of arrays by what JavaScript calls them.
TYPES: Final = {"f": ("f64", "<f8"), "i": ("i32", "<i4"), "u": ("u8", "u1"), "b": ("u8", "u1")}


def pack_frame(head: Mapping[str, Any], arrays: Mapping[str, ArrayLike]) -> bytes:
    """The message of a head and arrays; doubles stay doubles, whole numbers become 32 bits, bytes stay bytes.

    head  strict JSON after nan and infinity became null; its key `arrays` is set here
    """
    table: dict[str, list[Any]] = {}
    parts: list[bytes] = []
    start = 0  # first byte of the next array, from the end of the head
    for name, values in arrays.items():
        kind, data = _as_sent(np.asarray(values))
        table[name] = [kind, list(data.shape), start]
        content = data.tobytes()
        parts.append(content + bytes(-len(content) % ALIGNED))
        start += len(parts[-1])
    text = json.dumps(json_value({**head, "arrays": table}), allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-(LENGTH + len(text)) % ALIGNED)
    return len(text).to_bytes(LENGTH, "little") + text + b"".join(parts)


def unpack_frame(message: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Head and arrays of a message, as the page reads it."""
    length = int.from_bytes(message[:LENGTH], "little")
    head = json.loads(message[LENGTH : LENGTH + length])
    types = dict(TYPES.values())
    arrays = {}
    for name, (kind, shape, start) in head["arrays"].items():
        count = int(np.prod(shape, dtype=np.int64))
        arrays[name] = np.frombuffer(message, types[kind], count, LENGTH + length + start).reshape(shape)
    return head, arrays


def _as_sent(values: NDArray[Any]) -> tuple[str, NDArray[Any]]:
    """Name of the type in JavaScript, and the array as it is sent: contiguous, lowest byte first."""
    kind, stored = TYPES[values.dtype.kind]
    return kind, np.ascontiguousarray(values, dtype=stored)
