"""The function by which a long computation reports its progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

# Called with the name of the stage, the number of its steps done, and the number of its steps.
Progress: TypeAlias = Callable[[str, int, int], None]
