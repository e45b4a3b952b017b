"""Every numbered equation, table and figure of the thesis, and those that no row of the page covers.

The thesis's appendices count as chapters A and B. A row covers what its place names; `named` reads that.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

# Last number of each chapter, as the scan has them.
EQUATIONS = {"2": 44, "3": 24, "4": 48, "5": 15, "A": 3, "B": 19}
FIGURES = {"1": 2, "2": 3, "3": 13, "4": 4, "5": 14, "B": 1}
TABLES = {"3": 4}

KINDS = {"equation": EQUATIONS, "figure": FIGURES, "table": TABLES}
ITEMS = frozenset(
    (kind, chapter, number)
    for kind, last in KINDS.items()
    for chapter, count in last.items()
    for number in range(1, count + 1)
)
Item = tuple[str, str, int]

# What no row covers, and why.
NOT_COVERED = (
    (
        "(2.1)–(2.3)",
        "The equations of motion in general form, the kinds of forces in them, and rendered directions: they "
        "define terms.",
    ),
    ("(2.19), (2.20)", "How the generalised forces are split, and the rigid-body model with them: definitions."),
    (
        "Fig. 3.5",
        "Torque over deflection of both drives: the measured points are not in the scan. The rows on Table 3.3 "
        "identify the stiffnesses from deflections that are made up; those of Table 3.4 and 3.1.3 take them as "
        "printed.",
    ),
    ("Fig. 3.6", "Measured frequency responses, not in the scan."),
    (
        "Fig. 1.1, Fig. 1.2, Fig. 2.1, Fig. 2.2, Fig. 2.3, Fig. 3.1, Fig. 3.2, Fig. 3.3, Fig. 3.4, Fig. 3.13, "
        "Fig. B.1",
        "Photographs and sketches of devices and models, not in the scan.",
    ),
    ("(A.1)", "The characteristic equation: a definition."),
)

# The same for what has no number of its own.
NOT_COVERED_ELSEWHERE = (
    (
        "Figs. 3.7, 3.11, 3.12, 5.10",
        "Their measured points are not in the scan, nor are the places of points A to D of Fig. 3.10. None is "
        "invented. The computed curves are in rows, and where a simulation needs a place, its row says that it is "
        "ours.",
    ),
    (
        "3.2.5",
        "50 kN/m, the stiffest wall at 10 kHz before limit cycles, is a measurement: Coulomb friction, encoder "
        "step and wall damping are not printed. The rows on 2 C/Δ do not depend on them, or say what was chosen.",
    ),
    (
        "3.3.1",
        "Where the operator's numbers come from (grip stiffness, reflexes) is literature; the rows on Fig. 3.12 "
        "take them as printed.",
    ),
    (
        "Figs. 5.5–5.8",
        "The drawings of the assemblies are not in the scan. Which two are “elbow up” and “elbow down” is not "
        "known; where it matters all four are in rows.",
    ),
    (
        "1.1",
        "Two-port networks and virtual couplings ([Guarantees](guarantees.md)) and time-domain passivity control "
        "([Virtual environments](environments.md)) are computed elsewhere; the thesis gives no number for them.",
    ),
    (
        "2.1.2",
        "Finite elements and assumed modes for flexible links are named as methods and not used.",
    ),
    ("5.1", "Global measures over the workspace and dynamic isotropy are defined in words, without a number."),
    (
        "6.1",
        "Future work, without numbers: [virtual environments](environments.md), delays that are not whole samples "
        "([the chart](chart.md)), [operators](operators.md), [measures](measures.md), [studies](studies.md) and "
        "[a design algorithm](optimise.md) have what zwidth does about it. There is no other model of dissipation "
        "than viscous and Coulomb friction.",
    ),
)

_ITEM = r"[0-9AB]\.\d+"
_EQUATIONS = re.compile(rf"\(({_ITEM})\)(?:[–-]\(({_ITEM})\))?")
_FIGURES = re.compile(rf"Figs?\. ({_ITEM}[ab]?(?:(?:[–-]|, ){_ITEM}[ab]?)*)")
_TABLES = re.compile(rf"Tables? ({_ITEM}(?:(?:[–-]|, ){_ITEM})*)")


def items_in(place: str) -> set[Item]:
    """What a place names, "(2.14)–(2.17), Figs. 5.1-5.3, Table 3.4"; sections are left out.

    >>> sorted(named("Figs. 5.2, 5.3, (5.4)"))
    [('equation', '5', 4), ('figure', '5', 2), ('figure', '5', 3)]
    """
    found = set()
    for first, last in _EQUATIONS.findall(place):
        found |= _range("equation", first, last or first)
    for kind, pattern in (("figure", _FIGURES), ("table", _TABLES)):
        for several in pattern.findall(place):
            for part in several.split(", "):
                first, *last = re.split("[–-]", part)
                found |= _range(kind, first, last[0] if last else first)
    return found


def _range(kind: str, first: str, last: str) -> set[Item]:
    chapter, low = first.rstrip("ab").split(".")
    of, high = last.rstrip("ab").split(".")
    if chapter != of:
        raise ValueError(f"a range within one chapter, got {first} to {last}")
    return {(kind, chapter, number) for number in range(int(low), int(high) + 1)}


def items_covered(places: Iterable[str]) -> set[Item]:
    """What these places name together."""
    return set().union(*map(items_in, places))


def item_text(item: Item) -> str:
    """An item as the thesis writes it: (2.14), Fig. 5.1, Table 3.4."""
    kind, chapter, number = item
    text = f"{chapter}.{number}"
    return {"equation": f"({text})", "figure": f"Fig. {text}", "table": f"Table {text}"}[kind]
