"""Write docs/reproducing-the-thesis.md: run the gallery, compare, and let the numbers give the verdicts.

`make docs` runs this. Nothing of ours is typed in: a row's number is a variable of a script of the gallery or
comes from its brute-force judge, and what explains a misprint is computed. Rounded so that machines agree.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from docs import _rows_algebra as algebra
from docs import _rows_chapter_3 as chapter_3
from docs import _rows_chapter_4 as chapter_4
from docs import _rows_chapter_5 as chapter_5
from docs import _rows_chapters_1_2 as chapters_1_2
from docs import _rows_device as device
from docs import _rows_simulations as contact
from docs._comparison_row import MEANING, OURS_ONLY, Row, count_verdicts
from docs._markdown import table
from docs._thesis_items import ITEMS, KINDS, NOT_COVERED, NOT_COVERED_ELSEWHERE, items_covered

Sections = list[tuple[str, list[Row]]]

HERE = Path(__file__).parent
PAGE = HERE / "reproducing-the-thesis.md"

INTRODUCTION = """# Reproducing the thesis

What the thesis prints, beside what zwidth computes. Every number of ours was computed by a script of the
[gallery](../gallery) when this page was written, and so was every verdict: a row whose number changes changes its
verdict. `make docs` writes the page again, and a test holds it to what the code gives.

[Printed, and checked](#printed-and-checked) holds what the thesis says, number, formula or statement.
[Ours only](#ours-only) holds values that it does not print, most of them drawn in figures that the scan does not
hold; they are known by two routes that share no code, as a rule zwidth and [a judge](../gallery/brute_force.py) by
matrix exponential, eigenvalues and bisection. [Not covered](#not-covered) is the rest.

## The thesis

*The thesis*, wherever these pages and the device files say so, is a doctoral thesis on how the mechanics of a
haptic device decide which virtual walls it can render: a framework of mechanical models, closed-form stability
conditions, experiments with a five-bar device, and measures of performance. It was read in a scan without its
title page, so that author, title, year and school are not known here, and left out rather than guessed. The
newest work that it cites is of 2013. Whoever has the original finds these parts in it, by which it is cited:

- an abstract in English and in French;
- 1, Introduction: literature, motivations, objectives;
- 2, Dynamics Formulation and Modelling: the haptic equilibrium, rendered directions, effective masses, the
  sampled loop;
- 3, Experimental Evaluation: a five-bar device (Tables 3.1 to 3.4), a two-sided wall, a one-sided wall with an
  operator;
- 4, Haptic System Analysis: stability conditions of the rigid model, without and with delay, and with
  flexibility;
- 5, Performance Measures in Haptics and Effects of Design Parameters: measures, and their maps over the
  workspace;
- 6, Conclusions and Recommendations for Future Research;
- appendices A and B: the Routh-Hurwitz criterion, and kinematic and dynamic modelling of the five-bar.

## Verdicts
"""

PRINTED = """## Printed, and checked
"""

OURS = """## Ours only

Not printed. The last column has the second route, and how close it comes (relative, where no unit stands).
"""

NOT_COVERED_TEXT = """## Not covered

No row is about these numbered equations, figures and tables:
"""

CHAPTER_5 = "Chapter 5: measures and design"
SECTIONS = (
    ("Chapters 1 and 2: what is compared with, several directions", chapters_1_2.rows),
    ("Chapter 3: the device and its walls", chapter_3.rows),
    ("Chapter 4: closed forms", chapter_4.rows),
    ("Chapters 4 and 5, Appendix A: by computer algebra", algebra.rows),
    (CHAPTER_5, chapter_5.rows),
    ("Chapters 3 and 5: by simulation", contact.rows),
    ("Appendix B: the five-bar", device.appendix),
)

# `docs/make_images.py` draws them.
PICTURES = {
    CHAPTER_5: """![Manipulability, condition number and link-side mass required at once over the workspace, and \
their common area](images/fig-5-4-common-area.svg)

*Fig. 5.4: three requirements and their common area, over the largest stiffness of the rigid body.*

![Chart with contours of equal spectral radius, and the eigenvalues in the complex plane along a line of walls\
](images/fig-5-10-eigenvalues.svg)

*Fig. 5.10: how fast vibration decays, and the eigenvalues along the dotted line; circles are their starts.*

"""
}


def sections() -> Sections:
    """Headings and their rows."""
    return [(title, rows()) for title, rows in SECTIONS]


def verdicts(rows: list[Row]) -> str:
    """The words, what they mean and how many rows have each."""
    counts = count_verdicts(rows)
    return table(
        ("Verdict", "Rows", "Meaning"),
        [[f"**{word}**", str(counts[word]), text] for word, text in MEANING.items()],
    )


def coverage(rows: list[Row]) -> str:
    """One sentence: how many of the thesis's numbered items are in rows."""
    found = items_covered(row.place for row in rows)
    parts = [
        f"{sum(item[0] == kind for item in found)} of {sum(item[0] == kind for item in ITEMS)} numbered {kind}s"
        for kind in KINDS
    ]
    printed = sum(row.printed is not None for row in rows)
    return (
        f"{printed} rows are about something printed, {len(rows) - printed} are *{OURS_ONLY}*. Together they "
        f"cover {', '.join(parts[:-1])} and {parts[-1]}.\n"
    )


def section_tables(content: Sections, printed: bool) -> list[str]:
    """The tables of what is printed, or of what is ours only, by chapter; with pictures among the printed."""
    header = ("Where", "What", "Verdict", *(("Printed", "Ours, and why") if printed else ("Ours", "Second route")))
    found = []
    for title, rows in content:
        cells = [row.cells() for row in rows if (row.printed is not None) == printed]
        picture = PICTURES.get(title, "") if printed else ""
        if cells:
            found.append(f"### {title}\n\n{picture}{table(header, cells)}")
    return found


def page(content: Sections) -> str:
    """The whole page."""
    rows = [row for _, rows in content for row in rows]
    missing, elsewhere = (
        table(("What", "Why"), [list(row) for row in rows]) for rows in (NOT_COVERED, NOT_COVERED_ELSEWHERE)
    )
    parts = [
        INTRODUCTION,
        verdicts(rows),
        coverage(rows),
        PRINTED,
        *section_tables(content, printed=True),
        OURS,
        *section_tables(content, printed=False),
        NOT_COVERED_TEXT,
        missing,
        "Nor about these parts of the rest:\n",
        elsewhere,
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(sections()), encoding="utf-8")
    print(PAGE.relative_to(HERE.parent))
