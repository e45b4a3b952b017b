"""Refuse a computation whose result would not fit into the machine's memory, before it begins."""

from __future__ import annotations

import os
from typing import Final

from zwidth.errors import TooLarge

SHARE: Final = 0.5  # of the machine's memory
UNKNOWN: Final = 4e9  # bytes of memory assumed where the system does not state them


def check_memory(numbers: float, what: str, advice: str) -> None:
    """Raise TooLarge if floating-point numbers of 8 bytes would take more than half of the machine's memory.

    numbers  how many numbers the result would have
    what     name of the result, with which the message begins
    advice   what to do instead, with which the message ends
    """
    try:
        memory = float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        memory = UNKNOWN
    wanted = 8.0 * numbers
    if not wanted <= SHARE * memory:
        raise TooLarge(
            f"{what} would take {wanted / 1e9:.3g} GB of memory, "
            f"and this machine has {memory / 1e9:.3g} GB; {advice}"
        )
