"""Write docs/faulty-records.md: records with something wrong, and what `zwidth identify` says to each.

`make docs` runs this. No answer is typed in here: each is that of a run on a record of a virtual bench
(`tests/identify/faulty_records.py`).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.identify.faulty_records import RECORDS, answer

PAGE = Path(__file__).parent / "faulty-records.md"

INTRODUCTION = """# Records that are not like simulations

Each row is a record of a virtual bench with something wrong, and the sentence about it that
[`zwidth identify`](identify.md) says. Numbers that are given all the same are not free of what is said.
`make docs` writes this page from runs; a test compares it with them.

| What is wrong | Kind | Numbers | What is said |
|---|---|---|---|
"""

GIVEN = {0: "given", 1: "none", 2: "none, bad input"}


def page(sentences: Sequence[str]) -> str:
    """The page, with what is said to each record."""
    rows = [
        f"| {one.wrong} | [`{one.kind}`](identify.md#{SECTIONS.get(one.kind, one.kind)}) | {GIVEN[one.code]} "
        f"| {_cell(said)} |"
        for one, said in zip(RECORDS, sentences, strict=True)
    ]
    return INTRODUCTION + "\n".join(rows) + "\n"


SECTIONS = {"friction": "friction-and-mass", "mass": "friction-and-mass"}


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def main() -> None:
    sentences = []
    for one in RECORDS:
        with TemporaryDirectory() as folder:
            sentences.append(answer(one, Path(folder)).said)
    PAGE.write_text(page(sentences), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
