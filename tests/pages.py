"""The pages of the documentation as links see them: headings with their anchors, sections, links."""

from __future__ import annotations

import re
from pathlib import Path


def sections(page: Path) -> dict[str, str]:
    """Each heading's anchor, as code hosts spell it, and the text from there to the next heading."""
    found: dict[str, str] = {}
    anchor, in_code = "", False
    for line in page.read_text(encoding="utf-8").splitlines():
        in_code ^= line.startswith("```")
        heading = None if in_code else re.match(r"#+ +(.+?) *$", line)
        if heading:
            anchor = _new_anchor(heading[1], found)
            found[anchor] = ""
        elif anchor:
            found[anchor] += line + "\n"
    return found


def _new_anchor(heading: str, taken: dict[str, str]) -> str:
    """The heading in lower case with hyphens for spaces; a number after it where a heading above has the same."""
    plain = re.sub(r"\]\([^)]*\)|[^\w\- ]", "", heading.lower()).replace(" ", "-")
    count = 0
    while (name := f"{plain}-{count}" if count else plain) in taken:
        count += 1
    return name


def links(page: Path) -> list[str]:
    """Targets of a page's links and pictures, those of other sites left out."""
    prose = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\(([^)\s]+)[^)]*\)", prose) + re.findall(r"^\[[^\]]+\]: *(\S+)", prose, re.MULTILINE)
    return [target for target in targets if "://" not in target]
