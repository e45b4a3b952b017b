"""Refusing what the machine's memory cannot hold, before it is asked for."""

from __future__ import annotations

import os
from typing import Final

SHARE: Final = 0.5  # of the memory there is
UNKNOWN: Final = 4e9  # bytes taken to be there where the system does not say


class TooLarge(ValueError):
    """A result that would not fit into memory."""


def check_memory(numbers: float, what: str, advice: str) -> None:
    """Raises TooLarge where so many floating-point numbers would take more than half of the memory.

    what    what they are, for the sentence;   advice  what to do instead
    """
    try:
        memory = float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        memory = UNKNOWN
    wanted = 8.0 * numbers
    if not wanted <= SHARE * memory:
        raise TooLarge(f"{what} would take {wanted / 1e9:.3g} GB, of {memory / 1e9:.3g} GB there are; {advice}")
