"""Chapter 4 by computer algebra, and Appendix A."""

from __future__ import annotations

from docs._row import Claim, Row
from gallery import chapter_4_algebra as algebra


def limits() -> list[Row]:
    """(4.13), (4.16)."""
    return [
        Claim(
            "(4.13)",
            "limits without friction",
            "ε → 1, (1 − ε)/β → 1/2",
            f"{algebra.limit_of_eps} and {algebra.limit_of_rest}, by computer algebra",
            (str(algebra.limit_of_eps), str(algebra.limit_of_rest)) == ("1", "1/2"),
        ),
        Claim(
            "(4.16)",
            "slope of the tangent (4.12) without friction",
            "1/2",
            f"{algebra.limit_of_slope}, by computer algebra",
            str(algebra.limit_of_slope) == "1/2",
        ),
    ]


def polynomials() -> list[Row]:
    """(4.26)-(4.28), (4.30), (4.31)."""
    again = "the same, from the transition matrix by computer algebra"
    longest = max(algebra.DELAYS)
    found = (
        ("(4.26)", f"characteristic polynomial, l = 0 to {longest}", "for any delay", algebra.as_4_26),
        ("(4.27)", "l = 0: transformed polynomial", "p σ³ + 2 d σ² + (4 − p − 2 d) σ + 4", algebra.as_4_27),
        ("(4.28)", "l = 0: Hurwitz determinant", "−2 (d + 2) p + 4 d (2 − d)", algebra.as_4_28),
        (
            "(4.30)",
            "l = 1: transformed polynomial",
            "p σ⁴ + (2 d − p) σ³ − (4 d + p − 4) σ² + (2 d + p + 8) σ + 4",
            algebra.as_4_30,
        ),
        (
            "(4.31)",
            "l = 1: third Hurwitz determinant",
            "−16 p² − 8 (d² + 12) p − 16 (d³ + 4 d² − 4 d)",
            algebra.as_4_31,
        ),
    )
    return [Claim(*row[:3], again if row[3] else "another one", row[3]) for row in found]


def appendix_a() -> list[Row]:
    """(A.2), (A.3)."""
    counts = algebra.by_roots
    return [
        Claim(
            "(A.2), (A.3)",
            "Hurwitz's determinant and its minors",
            "row i, column j: a_(2i − j); Δ₁ = a₁, Δ₂ = a₁ a₂ − a₀ a₃ …",
            "the same, by computer algebra" if algebra.as_A_2 and algebra.as_A_3 else "others",
            algebra.as_A_2 and algebra.as_A_3,
        ),
        Claim(
            "(A.3)",
            "the criterion",
            "stable where all minors are positive",
            f"of {algebra.TRIED} random polynomials of degree 2 to 6, {counts['stable']} stable by their roots, "
            f"{counts['wrong']} are judged otherwise",
            counts["wrong"] == 0 and min(counts["stable"], counts["unstable"]) > 100,
        ),
    ]


def rows() -> list[Row]:
    """All of it."""
    return [*limits(), *polynomials(), *appendix_a()]
