"""The public names of a package: those of its face above the mark of the inner ones."""

from __future__ import annotations

import re
from pathlib import Path

import zwidth

INNER = "# Inner names, for tests and neighbouring packages"


def public_names(package: str) -> list[str]:
    """Names that a package promises, in the order of its face; all of the top for ""."""
    face = Path(zwidth.__file__).parent / package / "__init__.pyi"
    promised, _, _ = face.read_text(encoding="utf-8").partition(INNER)
    return re.findall(r"^from .* as (\w+)$", promised, re.MULTILINE)
