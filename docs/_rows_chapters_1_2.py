"""Chapters 1 and 2: spring stability, several rendered directions."""

from __future__ import annotations

import numpy as np

from docs._comparison_row import Claim, Number, Row
from gallery import rendered_directions as plane
from gallery import spring_stability as spring


def spring_stability() -> list[Row]:
    """1.1.3, and what 4.2 says of it."""
    beta, passive, stable = spring.BETA, spring.passive_p, spring.stable_p
    return [
        Claim(
            "1.1.3",
            "the spring of spring stability",
            "undamped natural frequency matched the Nyquist frequency, the worst case contact",
            f"k = m (π/T)² vibrates at {spring.frequency_on_the_spring:.3f} of the sampling frequency; just "
            f"inside the walls stable free and on it, the worst of {len(spring.SPRINGS)} springs has spectral "
            f"radius {spring.worst_radius_inside:.4f}, β = {beta}",
            abs(spring.frequency_on_the_spring - 0.5) < 1e-12 and spring.worst_radius_inside < 1.0,
        ),
        Number(
            "1.1.3",
            f"Nyquist spring, β = {beta}: largest p at d = 0",
            spring.largest_p_on_the_spring,
            second_value=spring.judged_on_the_spring,
        ),
        Number(
            "1.1.3",
            f"spring-stable, β = {beta}: largest p, at d = {spring.its_d:.6f}",
            spring.largest_p,
            second_value=spring.judged_at_its_d,
        ),
        Claim(
            "4.2",
            "spring stability in use",
            "very conservative and far from practical applications",
            f"β = {beta}: p up to {spring.largest_p:.4f}, of {stable:.4f} without a spring; passive {passive:.4f}",
            passive < spring.largest_p < 0.5 * stable,
        ),
    ]


def rendered_directions() -> list[Row]:
    """(2.6)-(2.17), (2.24)-(2.35)."""
    sizes = ", ".join(f"{m} of {n}" for m, n in plane.SIZES)
    masses, full = plane.frequencies_of_masses, plane.frequencies_of_full
    return [
        Claim(
            "(2.6)–(2.17)",
            "rendered and admissible motion, any m",
            "with A M⁻¹ Bᵀ = 0 the mass matrix is block-diagonal, and the wall's force acts on the rendered "
            "part alone",
            f"random mass matrices, m of n = {sizes}: A M⁻¹ Bᵀ, what lies outside the blocks and the force on the "
            "admissible part are rounding",
            plane.coupling < 1e-8 and plane.outside < 1e-6 and plane.elsewhere < 1e-6,
        ),
        Claim(
            "(2.24)–(2.28), (2.35)",
            "m = 2: two mass matrices of the five-bar",
            "W_r1, W_r2 of the links and of the motors",
            f"along y they are {plane.link_side_mass:.6f} kg and {plane.motor_side_mass:.6f} kg, as in Table 3.4",
            plane.error_of_2_28 < 1e-12
            and abs(plane.link_side_mass - 0.2616) < 5e-5
            and abs(plane.motor_side_mass - 0.0254) < 5e-5,
        ),
        Claim(
            "(2.29)–(2.35)",
            "m = 2: stiffness matrix between them",
            "K_e = (J K_φ⁻¹ Jᵀ)⁻¹, the handle's deflection under a force with the motors locked",
            f"so it is, to rounding; the 2m masses vibrate at {masses[0]:.2f} and {masses[1]:.2f} Hz, the full "
            f"model at {full[0]:.2f} and {full[1]:.2f} Hz",
            plane.error_of_2_34 < 1e-12
            and np.allclose(plane.deflection @ plane.K, np.eye(2), atol=1e-12)
            and np.allclose(masses, full, rtol=1e-9),
        ),
    ]


def rows() -> list[Row]:
    """Both chapters."""
    return [*spring_stability(), *rendered_directions()]
