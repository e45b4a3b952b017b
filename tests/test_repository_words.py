"""Units and words for people: each is written one way in texts, docstrings and pages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.command_runner import run_command
from zwidth.show import zwidth as group

ROOT = Path(__file__).parent.parent
GLOSSARY = ROOT / "docs" / "glossary.md"
# Where other spellings are named, quoted from the thesis, or looked for in files of users.
UNITS_NAMED = {"src/zwidth/unit_text.py"}
WORDS_NAMED = {"docs/glossary.md", "docs/index.md", "docs/reproducing-the-thesis.md", "docs/_rows_quantisation.py"}
FILES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in sorted(
        path
        for pattern in ("*.md", "docs/*.md", "docs/*.py", "src/**/*.*")
        for path in ROOT.glob(pattern)
        if path.suffix in {".md", ".py", ".pyi", ".js", ".html", ".toml", ".j2"} and path.name != "CHANGELOG.md"
    )
}
DATA = re.compile(r"([\"'`])(?:[A-Za-z1]{1,3}(?:\^\w)?[ /()]{0,2}){1,6}\1")  # one unit alone, as data has it
SPELLINGS = (
    re.compile(r"(?<![\w.])[kMmµ]?N(?:ms?|s)(?![\w-])"),  # N m, N m s, N s
    re.compile(r"(?<![\w^])(?:kg [cm]?m|g [cm]m|(?:kg|g|N)/[cm]?m|(?:m|rad)/s|N|cm|mm)\^[234](?![\w^])"),  # kg m²
    re.compile(r"\bkg m2\b|\b(?:m|rad)/s2\b|\b(?:N|kg)[·⋅*]m\b|\bN[·⋅*]s\b|N²s|N²m"),
)


def other_spellings(text: str) -> list[str]:
    """Units that are not spelled as texts spell them."""
    lines = [line for line in text.splitlines() if any(spelling.search(line) for spelling in SPELLINGS)]
    text = DATA.sub("", "\n".join(lines))
    return [match[0] for spelling in SPELLINGS for match in spelling.finditer(text)]


def struck_words() -> dict[str, str]:
    """The words that the glossary does not use -> what it says in their place."""
    table = GLOSSARY.read_text(encoding="utf-8").partition("## Words that are not used")[2]
    return {
        word.strip().lower(): said
        for words, said in re.findall(r"^\| ([^|`-][^|]*) \| ([^|]+) \|", table, re.MULTILINE)
        for word in words.split(",")
        if words != "Not"
    }


def other_words(text: str, struck: dict[str, str]) -> list[str]:
    """Words of a text that the glossary does not use; a plural is found, too."""
    pattern = "|".join(re.escape(word) for word in struck)
    return [match[0] for match in re.finditer(rf"(?<![\w-])(?:{pattern})s?(?![\w-])", text.lower())]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("7 Nm/rad and 2 mNm", ["Nm", "mNm"]),
        ("10 Ns/m, Nms/rad", ["Ns", "Nms"]),
        ("[kg m^2], m/s^2, N^2 s/m^2", ["kg m^2", "m/s^2", "N^2"]),
        ("3 kg m2, 4 N·m, N²s/m²", ["kg m2", "N·m", "N²s"]),
        ('unit="kg m^2" of `stiffness_Nm_per_rad`: 7 N m/rad, 10 N s/m, 3 kg m², m^2/T^3', []),
    ],
)
def test_another_spelling_is_found(text, found):
    assert other_spellings(text) == found


def test_units_are_spelled_one_way():
    found = {name: other_spellings(text) for name, text in FILES.items() if name not in UNITS_NAMED}
    assert {name: units for name, units in found.items() if units} == {}


def test_words_that_the_glossary_strikes_are_not_used():
    struck = struck_words()
    assert {"end effector", "gear ratio", "stiction"} <= struck.keys()
    assert other_words("Gear ratios of an End effector", struck) == ["gear ratios", "end effector"]
    found = {name: other_words(text, struck) for name, text in FILES.items() if name not in WORDS_NAMED}
    assert {name: words for name, words in found.items() if words} == {}


@pytest.mark.parametrize("name", sorted(group.commands))
def test_units_of_the_help_are_spelled_one_way(name):
    ran = run_command(name, "--help")
    assert ran.code == 0
    assert other_spellings(ran.out) == []
