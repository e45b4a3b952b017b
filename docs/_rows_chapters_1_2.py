"""Chapters 1 and 2: spring stability, the haptic equilibrium, several rendered directions."""

from __future__ import annotations

import numpy as np

from docs._comparison_row import ANOTHER_QUESTION, Claim, Number, Reason, Row
from gallery import flexible_link as bent
from gallery import haptic_equilibrium as equilibrium
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


def haptic_equilibrium() -> list[Row]:
    """(2.4), (2.5)."""
    e = equilibrium
    across, wall = float(e.found.sideways_force[0]), e.found.wall_force
    by_gravity, by_push, neglected = (
        100.0 * share for share in (e.change_by_gravity, e.change, e.change_neglected)
    )
    both = np.isclose([across, wall], [e.across, e.wall_force], rtol=1e-8)
    return [
        Claim(
            "(2.4)",
            "haptic equilibrium of the five-bar at (0.05, 0.2) m under 5 N",
            "0 = Q_h + Q_k + Q_v + Q_o: the interaction forces and those of the operator balance via the device",
            f"so they do, behind flexible drives with {wall:.5f} N of the wall and {1e3 * across:.4f} mN of the "
            "hand across the direction; by circles and a solver the same",
            bool(both.all()),
        ),
        Claim(
            "(2.5)",
            "external forces and small motions along the wall's direction",
            "external forces contribute to the equilibrium, and have negligible effect on the perturbed dynamics",
            f"gravity along its plane changes the five-bar's largest stiffness by {by_gravity:.1e} %; a hand's "
            f"push of 5 N by {by_push:.4f} %, with the change of its lever arms neglected by {neglected:.4f} %",
            abs(e.change_by_gravity) < 1e-5 and abs(e.change) < 1e-3,
        ),
        Claim(
            "(2.5)",
            "the same along the surface, where no wall acts",
            "external forces contribute to the equilibrium, and have negligible effect on the perturbed dynamics",
            f"under gravity the five-bar slides away at {e.growth_by_gravity:.3f} 1/s, and pulled with 5 N at "
            f"{e.growth:.4f} 1/s, which would be {e.growth_neglected:.2f} 1/s with the change of the hand's lever "
            "arms neglected",
            False,
            Reason(
                ANOTHER_QUESTION,
                "the sentence is about the rendered direction, on which the row above agrees; nothing else holds "
                "a motion that is free without load",
                e.growth_by_gravity > 1.0 and e.growth_neglected > 10.0 * e.growth > 0.0,
            ),
        ),
        Number(
            "(2.5)",
            f"spectral radius at {e.STIFFNESS / 1e3:g} kN/m and {e.DAMPING:g} N s/m under 5 N, motion along the "
            "surface among the roots",
            e.spectral_radius,
            second_value=e.radius_by_hand,
            tolerance=1e-9,
            digits=9,
            route="circles, complex steps, matrix exponential",
        ),
    ]


def flexible_link() -> list[Row]:
    """(2.22), (2.23)."""
    size = f"aluminium tube of {1e3 * bent.OUTER:g} by {1e3 * bent.WALL:g} mm, {bent.LENGTH:g} m long, on a motor"
    lumped, modes, elements = (bent.largest[method] for method in bent.METHODS)
    return [
        Claim(
            "(2.22)",
            "a flexible link by a lump at its tip on a massless bending spring",
            "the lumped parameters model considers the static deflection of the flexible link",
            f"with 3 E I/L³ and 33/140 of the mass the first vibration of a clamped link is "
            f"{100 * bent.too_high:.2f} % too high, on the motor's inertia "
            f"{100 * (1 - bent.first_by_hand / bent.first_exact):.2f} % too low",
            0.0 < bent.too_high < 0.02 and abs(bent.first_by_hand / bent.first_exact - 1.0) < 0.02,
        ),
        Number(
            "(2.22)",
            f"k_e of an {size}: what an infinitely stiff wall is felt as at rest",
            bent.felt,
            "N/m",
            second_value=bent.k_e,
            route="3 E I/L³",
        ),
        Number(
            "(2.23)",
            "natural frequency of the same, lumped",
            bent.first["lumped"],
            "Hz",
            second_value=float(bent.first_by_hand),
            route="two inertias on a spring",
        ),
        Number(
            "(2.23)",
            f"largest stiffness of the same, lumped, with {100 * bent.DAMPING_RATIO:g} % of damping at "
            f"{1e3 * bent.PERIOD:g} ms",
            lumped,
            "N/m",
            second_value=bent.largest_by_hand,
        ),
        Claim(
            "(2.23)",
            "the form of a flexible-jointed system, in which the spring stands for the link, too",
            "the localized structural stiffness representation also embeds effects of link flexibility",
            f"of the first mode, {bent.first['lumped']:.1f} Hz where the beam has {bent.first_exact:.1f} Hz; its "
            f"largest stiffness is {lumped:.0f} N/m where more modes give {modes:.0f} N/m and elements "
            f"{elements:.0f} N/m",
            abs(bent.first["lumped"] / bent.first_exact - 1.0) < 0.02 and abs(modes / elements - 1.0) < 1e-4,
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
    return [*spring_stability(), *haptic_equilibrium(), *flexible_link(), *rendered_directions()]
