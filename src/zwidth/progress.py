"""The function by which a long computation reports its progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

# Called with the stage, how much of it is done, and of how much.
Progress: TypeAlias = Callable[[str, int, int], None]
