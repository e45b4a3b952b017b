"""Motions in words: which of them no wall moves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence


def counted(names: Sequence[str]) -> list[str]:
    """Names of motions, equal ones together under their number.

    >>> counted(["rigid motion (0 Hz)", "mode at 101 Hz", "rigid motion (0 Hz)"])
    ['2 rigid motions (0 Hz)', 'mode at 101 Hz']
    """
    return [_many(name, count) if count > 1 else name for name, count in Counter(names).items()]


def _many(name: str, count: int) -> str:
    for noun in ("motion", "mode"):
        name = name.replace(noun, f"{noun}s", 1)
    return f"{count} {name}"
