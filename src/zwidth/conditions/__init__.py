"""Published conditions on virtual walls, one file per source, and their comparison on one loop."""

from zwidth.conditions.bound import Bound
from zwidth.conditions.registry import compare

__all__ = ["Bound", "compare"]
