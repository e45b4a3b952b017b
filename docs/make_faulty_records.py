"""Write docs/faulty-records.md: records with something wrong, and what `zwidth identify` says to each.

`make docs` runs this. No answer is typed in here: each is that of a run on a record of a virtual bench
(`tests/identify/faulty_records.py`).
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.identify.faulty_records import RECORDS, FaultyRecord
from tests.identify.record_answers import answer

PAGE = Path(__file__).parent / "faulty-records.md"

INTRODUCTION = """# Records that are not like simulations

Each row is a record of a virtual bench with something wrong, and the sentence about it that
[`zwidth identify`](identify.md) says. Numbers that are given all the same are not free of what is said.
`make docs` writes this page from runs; a test compares it with them.

| What is wrong | Kind | Numbers | What is said |
|---|---|---|---|
"""

GIVEN = {0: "given", 1: "none", 2: "none, bad input"}


def row(record: FaultyRecord, said: str) -> str:
    """The line of a record."""
    section = SECTIONS.get(record.kind, record.kind)
    answered = f"[`{record.kind}`](identify.md#{section}) | {GIVEN[record.code]}"
    return f"| {record.wrong} | {answered} | {_cell(said)} |"


SECTIONS = {"friction": "friction-and-mass", "mass": "friction-and-mass"}


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def main() -> None:
    rows = []
    for one in RECORDS:
        with TemporaryDirectory() as folder:
            rows.append(row(one, answer(one, Path(folder)).said))
    PAGE.write_text(INTRODUCTION + "\n".join(rows) + "\n", encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
