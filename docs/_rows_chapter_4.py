"""Chapter 4 and the closed forms of 5.2: rigid, delayed and mass-spring models in p and d."""

from __future__ import annotations

import numpy as np

from docs._row import Claim, Misprint, Number, Row
from gallery import fig_4_1_rigid as rigid
from gallery import fig_4_2_delay as delay
from gallery import fig_4_3_mass_spring as spring
from gallery import fig_4_4_models as models
from gallery import optimal_mass as optimum
from gallery.brute_force import Judge


def figure_4_1() -> list[Row]:
    """One mass, with and without friction; (4.7)-(4.17), (5.4), (5.5)."""
    judge = Judge(1.0, rigid.BETA, 0.0, 1.0, 1.0)
    p, d, _ = judge.largest_stiffness(2.0, 3.0)
    stable_tip = rigid.radius_inside_the_tip_below < 1.0 < rigid.radius_inside_the_tip_above
    p_wall, d_wall = rigid.OPTIMISTIC
    return [
        Number("(4.14), (5.4)", "largest p without damping", rigid.free.stiffness_max, printed="0.686"),
        Claim(
            "below (4.14)",
            "its closed form",
            "p_max = 12 − 8√2",
            f"4 (3 − 2√2) = 12 − 8√2 = {rigid.largest_p:.6f}; chart {rigid.free.stiffness_max:.6f}",
            abs(12.0 - 8.0 * np.sqrt(2.0) - rigid.free.stiffness_max) < 1e-9,
        ),
        Number("below (4.32)", "its d", rigid.free.damping_at_stiffness_max, printed="0.828"),
        Number("(4.14), (5.4)", "largest d", rigid.free.damping_max, printed="2"),
        Claim(
            "(5.5)",
            "area, in m²/T³",
            "(not readable in the scan)",
            f"12 − 16 ln 2 = {rigid.area_of_5_5:.6f}, the integral of (4.14); chart {rigid.free.stable_area:.6f}",
            abs(rigid.area_of_5_5 - rigid.free.stable_area) < 1e-9,
        ),
        Number("Fig. 4.1", "β = 0.2: largest p, point B", rigid.damped.stiffness_max, judge=p, digits=8),
        Number("Fig. 4.1", "β = 0.2: its d", rigid.damped.damping_at_stiffness_max, judge=d, within=1e-6),
        Claim(
            "(4.10), (4.11)",
            "the tip in closed form, β = 0.2",
            "largest p and its d",
            f"p = {rigid.tip_of_4_10[0]:.6f}, d = {rigid.tip_of_4_10[1]:.6f}; chart "
            f"{rigid.damped.stiffness_max:.6f}, {rigid.damped.damping_at_stiffness_max:.6f}",
            np.allclose(
                rigid.tip_of_4_10, (rigid.damped.stiffness_max, rigid.damped.damping_at_stiffness_max), rtol=1e-9
            ),
        ),
        Claim(
            "(4.9)",
            "completeness",
            "the region of the damped rigid wall, for any β",
            f"incomplete for β > {rigid.beta_where_incomplete:.3f}",
            False,
            Misprint(
                f"it leaves out the real root z = −1, which cuts into it for "
                f"β > {rigid.beta_where_incomplete:.3f} and cuts off the tip (4.10) for "
                f"β > {rigid.beta_where_tip_unstable:.3f}: at β = {rigid.above:.2f} just inside the tip "
                f"the spectral radius is {rigid.radius_inside_the_tip_above:.3f}",
                stable_tip and 1.0 < rigid.beta_where_incomplete < rigid.beta_where_tip_unstable,
                kind="incomplete",
            ),
        ),
        Claim(
            "(4.12)",
            "line for small p",
            "“approximately bounded from below by a tangent line”",
            f"a tangent: its error is of order {rigid.order_of_4_12:.2f} in p",
            abs(rigid.order_of_4_12 - 2.0) < 0.01,
        ),
        Claim(
            "(4.15)",
            "stiffest passive wall, β = 0.2",
            "p = 2 β at d = 0, inside the stable region",
            f"p = {rigid.passive_p:.3f}; stable up to p = {rigid.stable_p_without_damping:.4f} at d = 0",
            rigid.passive_p < rigid.stable_p_without_damping,
        ),
        Claim(
            "(4.17)",
            "the linear condition",
            "d + β > p/2, “a conservative stability condition”",
            f"error of order {rigid.order_of_4_17:.2f} in p; without damping the wall p = {p_wall}, d = {d_wall} "
            f"meets it with spectral radius {rigid.radius_of_optimistic_wall:.4f}",
            rigid.radius_of_optimistic_wall <= 1.0,
            Misprint(
                "without damping it is optimistic: that wall meets it and is unstable",
                d_wall > p_wall / 2.0 and rigid.radius_of_optimistic_wall > 1.0,
            ),
        ),
    ]


def figure_4_2() -> list[Row]:
    """Delays."""
    rows: list[Row] = []
    repeated = Misprint(
        "the text repeats the numbers without delay; (5.6) has 0.144 and 0.828, as the chart",
        abs(delay.largest_p[1] - 0.144) < 5e-4 and abs(delay.largest_d[1] - 0.828) < 5e-4,
    )
    rows += [
        Number("below (4.32)", "l = 1: largest p", delay.largest_p[1], printed="0.686", misprint=repeated),
        Number("below (4.32)", "l = 1: its d", delay.d_at_largest_p[1], printed="0.828", misprint=repeated),
        Number("below (4.32)", "l = 1: largest d", delay.largest_d[1], printed="2", misprint=repeated),
        Number("(5.6)", "l = 1: largest p", delay.largest_p[1], printed="0.144"),
        Number("(5.6)", "l = 1: largest d", delay.largest_d[1], printed="0.828"),
        Claim(
            "(4.32)",
            "l = 1: edge in closed form",
            "p < (−12 − d² + (2 + d) √(36 − 20 d + d²))/4",
            f"largest p = {delay.closed_largest_p:.6f} at d = {delay.closed_d_at_largest_p:.6f}, largest "
            f"d = 2 (√2 − 1) = {delay.closed_largest_d:.6f}; chart {delay.largest_p[1]:.6f}, "
            f"{delay.d_at_largest_p[1]:.6f}, {delay.largest_d[1]:.6f}",
            np.allclose(
                (delay.closed_largest_p, delay.closed_d_at_largest_p, delay.closed_largest_d),
                (delay.largest_p[1], delay.d_at_largest_p[1], delay.largest_d[1]),
                rtol=1e-8,
            ),
        ),
    ]
    for l in delay.DELAYS:
        p, d, _ = Judge(1.0, 0.0, 0.0, 1.0, 1.0, delay=l).largest_stiffness(1.0, 2.0)
        rows.append(Number("(4.26)", f"l = {l}: largest p", delay.largest_p[l], judge=p))
        rows.append(Number("(4.26)", f"l = {l}: its d", delay.d_at_largest_p[l], judge=d, within=1e-6))
    return rows


def figure_4_3() -> list[Row]:
    """Mass and spring; (4.43)-(4.48), (5.7), (5.8)."""
    W, stable = spring.W, spring.stable_beyond
    seen = ", ".join(f"{'yes' if s else 'no'} at {w:.2f}" for w, s in zip(spring.BEYOND, stable, strict=True))
    closed = (
        ("(4.44), (5.7)", "largest p", spring.error_of_4_44),
        ("(4.45)", "its d", spring.error_of_4_45),
        ("(5.7)", "largest d with p > 0, W² c/(1 − c)", spring.error_of_5_7),
    )
    rates = f"W = {spring.RATES[0]} to {spring.RATES[-1]:.2f}"
    rows: list[Row] = [
        Claim(place, what, "closed form", f"charts agree to 1e-9, {rates}", error < 1e-9)
        for place, what, error in closed
    ]
    rows += [
        Claim(
            "(4.46)",
            f"largest d, W = {W}",
            f"W²/(1 − cos W) = {spring.d_of_4_46:.4f}",
            f"{spring.largest_d:.4f} for p → 0",
            abs(spring.d_of_4_46 - spring.largest_d) < 1e-6,
            Misprint(
                f"it is the value at p = −W² ({spring.highest_d_of_region:.4f} at "
                f"p = {spring.p_at_highest_d:.2f}); on the axis p = 0 it is "
                f"W² c/(1 − c) = {spring.d_of_5_7:.4f}, as (5.7) has it",
                abs(spring.highest_d_of_region - spring.d_of_4_46) < 1e-6
                and abs(spring.p_at_highest_d + W**2) < 1e-6
                and abs(spring.d_of_5_7 - spring.largest_d) < 1e-9,
            ),
        ),
        Claim(
            "4.2",
            "stable walls with p > 0 beyond W = π/2",
            "none at frequencies higher than half of the Nyquist frequency",
            f"stable walls: {seen}",
            not any(stable[1:]),
            Misprint(
                "that holds up to W = 3π/2; beyond it aliasing brings stable walls back",
                stable == (True, False, False, False, True, True),
                kind="incomplete",
            ),
        ),
        Claim(
            "(5.8)",
            f"area, in m²/T³, W = {W}",
            f"with ln(1 − cos 2W): {spring.area_as_printed:.4f}",
            f"{spring.area:.6f}",
            abs(spring.area_as_printed - spring.area) < 1e-4,
            Misprint(
                f"integrating (4.43) gives ln(1 + cos W) there: {spring.area_with_the_right_logarithm:.6f}, which "
                "is 2 W⁴/(1 − c)² (c²/2 + c − (1 + c) ln(1 + c))",
                abs(spring.area_with_the_right_logarithm - spring.area) < 1e-9
                and abs(spring.area_right - spring.area) < 1e-9,
            ),
        ),
        Claim(
            "(4.47)",
            "edge by the cosine's series",
            "(4.43) with the second-order series",
            f"an approximation: its error is of order {spring.order_of_4_47:.1f} in W",
            abs(spring.order_of_4_47 - 2.0) < 0.1,
        ),
        Claim(
            "(4.48)",
            "linear condition with flexibility",
            "d > p/(2 − W²)",
            f"an approximation: the slope at d → 0 errs to order {spring.order_of_4_48:.1f} in W",
            abs(spring.order_of_4_48 - 4.0) < 0.1,
        ),
    ]
    return rows


def figure_4_4() -> list[Row]:
    """Which model where."""
    full = models.two_mass
    low, low_rigid = models.low_edge, models.low_edge_rigid
    high, high_motor = models.high_edge, models.high_edge_motor_mass
    bare = models.motor_mass_undamped
    plant = models.motor_mass.loop.plant
    judge = Judge(plant.mass, plant.damping, plant.stiffness, 1.0, models.motor_mass.loop.period)
    K, B, _ = judge.largest_stiffness(9000.0, 40.0)
    return [
        Number(
            "Fig. 4.4", "motor's mass, damped: largest stiffness", models.motor_mass.stiffness_max, "N/m", judge=K
        ),
        Number(
            "Fig. 4.4",
            "motor's mass, damped: damping there",
            models.motor_mass.damping_at_stiffness_max,
            "N s/m",
            judge=B,
            within=1e-5,
        ),
        Number(
            "Fig. 4.4",
            "motor's mass, undamped: largest stiffness, by (4.44)",
            bare.stiffness_max,
            "N/m",
            judge=models.closed_form,
        ),
        Claim(
            "Fig. 4.4",
            f"low edge at {models.HALFWAY:.0f} N/m",
            "represented by the rigid model",
            f"{low:.3f} N s/m, rigid {low_rigid:.3f}: {abs(low_rigid / low - 1.0):.1%} apart",
            abs(low_rigid / low - 1.0) < 0.05,
        ),
        Claim(
            "Fig. 4.4",
            f"high edge at {models.HALFWAY:.0f} N/m",
            "represented by the motor's mass on its spring, damped",
            f"{high:.3f} N s/m, motor's mass {high_motor:.3f}: {abs(high_motor / high - 1.0):.1%} apart",
            abs(high_motor / high - 1.0) < 0.05,
        ),
        Claim(
            "4.3",
            "motor's mass without damping",
            "more conservative results for the stable area",
            f"area {bare.stable_area:.0f} against {full.stable_area:.0f} N² s/m²",
            bare.stable_area < full.stable_area,
        ),
    ]


def optimal_spectral_radius() -> list[Row]:
    """(5.15), and its numbers of 5.3.2."""
    mass = {name: found[0] for name, found in optimum.optimum.items()}
    rho = {name: found[1] for name, found in optimum.optimum.items()}
    swapped = Misprint(
        f"B and C are each other's: (3000, 15) gives {rho['B']:.6f} at {mass['B']:.7f} kg, (4000, 20) "
        f"{rho['C']:.6f} at {mass['C']:.7f} kg",
        abs(rho["B"] - 0.8956) < 5e-5 < abs(rho["C"] - 0.8956) and abs(rho["C"] - 0.8729) < 1e-4,
    )
    other = Misprint(
        f"the numbers belong to (5000, 55): {rho['printed for D']:.6f} at {mass['printed for D']:.7f} kg",
        abs(rho["printed for D"] - 0.71627) < 1e-5 and abs(mass["printed for D"] - 0.1315) < 5e-5,
    )
    scan = optimum.printed_5_15(optimum.WALLS["B"])
    return [
        Claim(
            "(5.15)",
            "optimal spectral radius at (3000, 15)",
            f"{scan:.4f} by the formula as the scan reads",
            f"{rho['B']:.6f}, by eigenvalues",
            abs(scan - rho["B"]) < 1e-4,
            Misprint(
                "its terms have unlike units; ρ² = 8 D (1 + P)/(4 D² + 4 D P + 8 D + P²) gives "
                f"{optimum.by_5_15['B']:.6f}, and agrees at all four walls",
                all(abs(optimum.by_5_15[name] - rho[name]) < 1e-6 for name in rho),
            ),
        ),
        Number("5.3.2", "point B (3000, 15): radius", rho["B"], printed="0.8729", misprint=swapped),
        Number("5.3.2", "point B: mass", mass["B"], "kg", printed="0.0603", misprint=swapped),
        Number("5.3.2", "point C (4000, 20): radius", rho["C"], printed="0.8956", misprint=swapped),
        Number("5.3.2", "point C: mass", mass["C"], "kg", printed="0.0510", misprint=swapped),
        Number("5.3.2", "point D (5000, 25): radius", rho["D"], printed="0.71627", misprint=other),
        Number("5.3.2", "point D: mass", mass["D"], "kg", printed="0.1315", misprint=other),
    ]


def rows() -> list[Row]:
    """All of the chapter, and what chapter 5 has of it."""
    return [*figure_4_1(), *figure_4_2(), *figure_4_3(), *figure_4_4()]
