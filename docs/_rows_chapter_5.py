"""Chapter 5, as far as it is covered."""

from __future__ import annotations

from docs._row import Claim, Misprint, Row
from docs._rows_chapter_4 import optimal_spectral_radius
from gallery import fig_5_5_base_distance as base


def base_distance() -> list[Row]:
    """5.3.1."""
    return [
        Claim(
            "5.3.1",
            "base distances at the reference position",
            "−2 m to 2 m",
            f"the handle gets there for d from {base.farthest_crossed:.3f} to {base.farthest_apart:.3f} m",
            base.reaches(1.0) and base.reaches(-1.0),
            Misprint(
                f"2 √(0.346² − 0.25²) m = {base.farthest_by_geometry:.4f} m is the farthest the arms allow",
                abs(base.farthest_apart - base.farthest_by_geometry) < 1e-3
                and abs(base.farthest_crossed + base.farthest_by_geometry) < 1e-3,
            ),
        ),
        Claim(
            "Fig. 5.5",
            "rigid: largest over least stiffness along x, d = −0.2 m",
            "three times",
            f"{base.ratio_of_stiffness:.2f} over |x| ≤ 0.13 m",
            round(base.ratio_of_stiffness) == 3,
        ),
    ]


def rows() -> list[Row]:
    """What is covered of the chapter."""
    return [*base_distance(), *optimal_spectral_radius()]
