"""Values that device files may hold one day, refused until then: never ignored."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath
from zwidth.device.toml_access import deep_copy

COMPOSED: Final = frozenset({"cylindrical", "planar", "screw", "helical"})
VALUES: Final[dict[tuple[str, ...], tuple[frozenset[str], str, frozenset[str] | None]]] = {
    ("loop", "velocity", "method"): (
        frozenset({"measured"}),
        "backward-difference",
        frozenset({"filter"}),
    ),
    ("mechanism", "links", "*", "joint"): (COMPOSED, "revolute", None),
    ("mechanism", "legs", "*", "links", "*", "joint"): (COMPOSED, "revolute", None),
}
"""Key -> the values to refuse so, the supported one that stands for them while the rest is checked, and the keys
beside it that are checked with it (None: all); what is left out are parameters of the refused value."""


def refuse(document: dict[str, Any]) -> tuple[dict[str, Any], list[tuple[KeyPath, str]]]:
    """The document without what is not supported yet, and a sentence for each thing taken out."""
    document = deep_copy(document)
    refused: list[tuple[KeyPath, str]] = []
    for pattern, (names, stand_in, beside) in VALUES.items():
        for path, table in _places(document, pattern):
            value = table[pattern[-1]]
            if isinstance(value, str) and value.lower() in names:
                for key in [] if beside is None else table.keys() - beside:
                    del table[key]
                table[pattern[-1]] = stand_in
                refused.append((path, f"{pattern[-1]} '{value}' is not supported yet; use '{stand_in}'"))
    return document, refused


def _places(
    document: Any, pattern: tuple[str, ...], path: KeyPath = ()
) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Where the last key of the pattern stands: its path and the table that holds it."""
    first, rest = pattern[0], pattern[1:]
    if first == "*":
        for index, inner in enumerate(document if isinstance(document, list) else []):
            yield from _places(inner, rest, (*path, index))
    elif isinstance(document, dict) and first in document:
        if not rest:
            yield (*path, first), document
        else:
            yield from _places(document[first], rest, (*path, first))
