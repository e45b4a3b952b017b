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
from docs import _rows_contact as contact
from docs._row import Row

Sections = list[tuple[str, list[Row]]]

HERE = Path(__file__).parent
PAGE = HERE / "reproducing-the-thesis.md"
HEADER = ("Where", "What", "Printed", "Ours", "Difference", "Verdict")

INTRODUCTION = """# Reproducing the thesis

One row for each table, figure and numbered result that this release covers. Every number under *Ours* was computed
by a script of the [gallery](../gallery) when this page was written, and so was every verdict:

- **agrees to the digits printed**: within half a unit of the last digit printed;
- **not printed; agrees with brute force**: the thesis only draws it, in a figure that the scan does not hold. The
  number is compared with [a judge](../gallery/brute_force.py) that shares no code with zwidth (matrix exponential,
  eigenvalues, bisection), what is felt of the five-bar with
  [its two arms written out by hand](../gallery/five_bar.py);
- **differs**: with the reason, whose numbers are computed too and must bear it out, or else the row would say
  *differs, not explained*.

`make docs` writes the page again, and a test holds it to what the code gives.
"""

CHAPTER_5 = "Chapter 5: measures and design"
SECTIONS = (
    ("Chapters 1 and 2: what is compared with, several directions", chapters_1_2.rows),
    ("Chapter 3: the device and its walls", chapter_3.rows),
    ("Chapter 4: closed forms", chapter_4.rows),
    ("Chapter 4 and Appendix A: by computer algebra", algebra.rows),
    (CHAPTER_5, chapter_5.rows),
    ("Chapters 3 and 5: by simulation", contact.rows),
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

NOT_COVERED = """## Not covered yet

- 3.2.2, 3.3: the measured points of Figs. 3.7, 3.11 and 3.12 are not in the scan, nor are the coordinates of
  points A to D of Fig. 3.10, the Coulomb friction and the encoder's step of 3.2.5. None is invented: where a
  simulation needs them, it says that they are ours, or what does not depend on them.
- Fig. 3.6: measured frequency responses.
- Fig. 3.12: the measured points; the model's curve and a virtual experiment are here.
- Figs. 5.5-5.8: the drawings of the assemblies are not in the scan. Which two are "elbow up" and "elbow down" is
  not known; where it matters all four are here.
- 1.1: two-port networks and virtual couplings are computed ([Guarantees](guarantees.md)), but the thesis gives no
  number to compare with; time-domain passivity control is there ([Virtual environments](environments.md)), without
  a number of the thesis either.
"""


def sections() -> Sections:
    """Headings and their rows."""
    return [(title, rows()) for title, rows in SECTIONS]


def table(rows: list[Row]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row.cells()) + " |" for row in rows]
    return "\n".join(lines)


def page(content: Sections) -> str:
    """The whole page."""
    parts = [
        INTRODUCTION,
        *(f"## {title}\n\n{PICTURES.get(title, '')}{table(rows)}\n" for title, rows in content),
        NOT_COVERED,
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(sections()), encoding="utf-8")
    print(PAGE.relative_to(HERE.parent))
