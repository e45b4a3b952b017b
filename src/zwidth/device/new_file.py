"""Device files to start from: one for each kind of device, complete, with a comment on every number."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Final

from zwidth.model.argument_checks import check_choice

# Kind of device, in the field's words -> its file in `templates`.
KINDS: Final = {
    "paddle": "one-link.toml",
    "serial-2r": "two-links.toml",
    "five-bar": "two-arms.toml",
    "delta": "three-legs.toml",
    "stewart": "six-legs.toml",
    "wrist": "three-axes.toml",
    "plant": "masses.toml",
}
PLACEHOLDER: Final = '"NAME"'


def new_device(name: str, kind: str) -> str:
    """A device file of plausible numbers to start from, as text: each number has a comment that says what it is,
    its unit and where one gets it; what may be left out is there as a comment.

    name    the device's name
    kind    "paddle", one link on a drive; "serial-2r", a planar arm of two links; "five-bar", a planar linkage of
            two arms; "delta", a platform on three legs; "stewart", a platform on six sliding legs; "wrist", three
            axes that meet; "plant", masses along the rendered direction
    Raises  ValueError  for another kind, and for a name that is not one line of text

    >>> new_device("My paddle", "paddle").splitlines()[2].split("#")[0].strip()
    'name = "My paddle"'
    """
    check_choice("kind", kind, KINDS)
    if not name.strip() or not name.isprintable():
        raise ValueError(f"name must be a line of text, got {name!r}")
    text = (files("zwidth.device") / "templates" / KINDS[kind]).read_text(encoding="utf-8")
    return text.replace(PLACEHOLDER, json.dumps(name, ensure_ascii=False), 1)
