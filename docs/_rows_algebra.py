"""Chapters 4 and 5 by computer algebra, and Appendix A."""

from __future__ import annotations

from docs._comparison_row import SCAN_DAMAGED, Claim, Reason, Row
from gallery import chapter_4_algebra as algebra
from gallery import damped_mass_algebra as damped
from gallery import mass_spring_algebra as spring

SAME = "the same, from the transition matrix by computer algebra"


def derived_claim(place: str, quantity: str, printed: str, same: bool) -> Claim:
    """A formula that computer algebra derives from the transition matrix."""
    return Claim(place, quantity, printed, SAME if same else "another one", same)


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
    longest = max(algebra.DELAYS)
    found = (
        ("(4.18)–(4.25)", "blocks of the delayed matrix, l = 1 to 4", "(−λ)^(l+1), …", algebra.as_4_22),
        ("(4.26)", f"characteristic polynomial, l = 0 to {longest}", "for any delay", algebra.as_4_26),
        ("(4.27)", "l = 0: transformed polynomial", "p σ³ + 2 d σ² + (4 − p − 2 d) σ + 4", algebra.as_4_27),
        ("(4.28)", "l = 0: Hurwitz determinant", "−2 (d + 2) p + 4 d (2 − d)", algebra.as_4_28),
        ("(4.29)", "l = 0: edge", "p < 2 d (2 − d)/(d + 2)", algebra.as_4_29),
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
        ("(4.32)", "l = 1: edge", "4 p < −12 − d² + (2 + d) √(36 − 20 d + d²)", algebra.as_4_32),
    )
    return [derived_claim(*row) for row in found]


def with_friction() -> list[Row]:
    """(4.1)-(4.14)."""
    return [
        derived_claim(
            "(4.1)–(4.5)", "transformed polynomial", "four coefficients μ_i in ε, β, p and d", damped.as_4_5
        ),
        Claim(
            "(4.6)–(4.8)",
            "the edge as a hyperbola",
            "(1 − ε) p d + ε β d² + β p + … = 0",
            "Δ₂ is it, but for a factor, by computer algebra",
            damped.as_4_7,
        ),
        Claim(
            "(4.9)",
            "solved for p",
            "a fraction with 1 − ε + ε β twice",
            "with 1 − ε − ε β it solves (4.7), by computer algebra",
            damped.as_4_9_in_the_scan,
            Reason(SCAN_DAMAGED, "two signs; (4.7), from which it follows, has them", damped.as_4_9),
        ),
        Claim(
            "(4.10)",
            "largest p",
            "(1 + β)² β² ε²/(ε + ε β − 1) over ε + ε β − 1 + 2 √…",
            "with β + ε + ε β − 1 + 2 √(β (ε + ε β − 1)) below the largest p of (4.9), to 1e-9, β = 0.02 to 2",
            False,
            Reason(SCAN_DAMAGED, "the scan has lost what is under the root, and a β", damped.error_of_4_10 < 1e-9),
        ),
        Claim(
            "(4.14)",
            "without friction",
            "p < 2 d (2 − d)/(2 + d)",
            "the limit of (4.9), by computer algebra",
            damped.as_4_14,
        ),
    ]


def on_a_spring() -> list[Row]:
    """(4.33)-(4.46)."""
    found = (
        ("(4.33)–(4.37)", "characteristic polynomial", "in p, d, Ω_n and cos Ω_n", spring.as_4_37),
        ("(4.38), (4.39)", "transformed polynomial", "four coefficients μ_i", spring.as_4_39),
        ("(4.40)", "where μ₁ vanishes", "d < −(p − Ω_n²/tan²(Ω_n/2))/2", spring.as_4_40),
        ("(4.41)", "Δ₂", "−2 d² − d p − Ω_n² p + d (2 d + p + 2 Ω_n²) cos Ω_n, but for a factor", spring.as_4_41),
        (
            "(4.42), (4.43)",
            "edge",
            "p < (−2 d² (1 − cos Ω_n) + 2 d Ω_n² cos Ω_n)/(d (1 − cos Ω_n) + Ω_n²)",
            spring.as_4_42,
        ),
        ("(4.46)", "where the boundaries meet", "p = −Ω_n², d = Ω_n²/(1 − cos Ω_n)", spring.as_4_46),
    )
    return [derived_claim(*row) for row in found]


def on_a_smaller_circle() -> list[Row]:
    """(5.9)-(5.14)."""
    return [
        Claim(
            "(5.9)–(5.12)",
            "transformed polynomial on a circle of radius ρ",
            "four coefficients, in p, d, Ω_n and ρ",
            SAME,
            False,
            Reason(
                SCAN_DAMAGED,
                "the scan writes p for ρ as well, and loses signs; one reading of it is right",
                spring.as_5_12,
            ),
        ),
        Claim(
            "(5.13)",
            "the parabola c₂ x² + c₁ x + c₀ = 0 in x = cos Ω_n",
            "c₂, c₁ and c₀ in k_e, k_p, k_d, Δt and ρ",
            "the Hurwitz determinant of (5.12) but for a factor, by computer algebra",
            False,
            Reason(
                SCAN_DAMAGED,
                "c₀ and c₂ are both “co”, and ρ⁴ is ρ²; read by their place, first c₀ and last c₂, they are right",
                spring.as_5_13,
            ),
        ),
        Claim(
            "(5.14)",
            "effective mass of a spectral radius",
            "m_e2 = k_e Δt²/arccos²((−c₁ + √(c₁² − 4 c₀ c₂))/(2 c₂))",
            "at the radius of (5.15) the mass of least spectral radius by eigenvalues, to 1e-6, at four walls",
            spring.error_of_5_14 < 1e-6,
        ),
    ]


def appendix_a() -> list[Row]:
    """(A.2), (A.3)."""
    counts = algebra.by_roots
    return [
        Claim(
            "(A.2), (A.3)",
            "Hurwitz's determinant and its minors",
            "row i, column j: a_(2i − j); Δ₁ = a₁, Δ₂ = a₁ a₂ − a₀ a₃ …",
            "the same, by computer algebra",
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
    return [
        *limits(),
        *with_friction(),
        *polynomials(),
        *on_a_spring(),
        *on_a_smaller_circle(),
        *appendix_a(),
    ]
