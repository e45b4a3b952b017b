"""Chapter 4 and the closed forms of 5.2: rigid, delayed and mass-spring models in p and d."""

from __future__ import annotations

import numpy as np

from docs._comparison_row import ANOTHER_QUESTION, MISPRINT, SCAN_DAMAGED, Claim, Evidence, Number, Reason, Row
from gallery import chapter_4_extended_forms as completed
from gallery import fig_4_1_rigid as rigid
from gallery import fig_4_2_delay as delay
from gallery import fig_4_3_mass_spring as spring
from gallery import fig_4_4_models as models
from gallery import which_model_where as where
from gallery.brute_force import BruteForceLoop


def figure_4_1() -> list[Row]:
    """One mass, with and without friction; (4.7)-(4.17), (5.4), (5.5)."""
    judge = BruteForceLoop(1.0, rigid.BETA, 0.0, 1.0, 1.0)
    p, d, _ = judge.largest_stiffness(2.0, 3.0)
    stable_tip = rigid.radius_inside_the_tip_below < 1.0 < rigid.radius_inside_the_tip_above
    p_wall, d_wall = rigid.OPTIMISTIC
    return [
        Number("(4.14), (5.4)", "largest p without damping", rigid.free.stiffness_max, printed="0.686"),
        Claim(
            "below (4.14), Fig. 4.2",
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
            "a coefficient of m_e1²/Δt³",
            f"12 − 16 ln 2 = {rigid.area_of_5_5:.6f}",
            False,
            Reason(
                SCAN_DAMAGED,
                "of the coefficient the scan keeps a first digit 0 alone. Ours is the integral of (4.14) from d "
                f"= 0 to 2, as the text has it, and the chart's area {rigid.free.stable_area:.6f}",
                abs(rigid.area_of_5_5 - rigid.free.stable_area) < 1e-9,
            ),
        ),
        Number("Fig. 4.1", "β = 0.2: largest p, point B", rigid.damped.stiffness_max, second_value=p, digits=8),
        Number(
            "Fig. 4.1",
            "β = 0.2: its d",
            rigid.damped.damping_at_stiffness_max,
            second_value=d,
            tolerance=1e-6,
        ),
        Claim(
            "(4.11)",
            "d of the tip in closed form, β = 0.2",
            "β (1 − ε β)/(ε + ε β − 1 + ε √(β (ε + ε β − 1)))",
            f"d = {rigid.tip_of_4_10[1]:.6f}; chart {rigid.damped.damping_at_stiffness_max:.6f}",
            np.allclose(
                rigid.tip_of_4_10, (rigid.damped.stiffness_max, rigid.damped.damping_at_stiffness_max), rtol=1e-9
            ),
        ),
        Claim(
            "(4.9)",
            "the stable region for any β",
            "the edge where a pair of roots leaves the unit circle; of (4.6) it leaves out μ₀ > 0",
            f"the root z = −1 cuts into it for β > {rigid.beta_where_incomplete:.3f}",
            False,
            Reason(
                ANOTHER_QUESTION,
                f"right up to that β; the thesis draws β = 0.2. The root cuts off the tip (4.10) for "
                f"β > {rigid.beta_where_tip_unstable:.3f}: at β = {rigid.above:.2f} just inside the tip "
                f"the spectral radius is {rigid.radius_inside_the_tip_above:.3f}",
                stable_tip and rigid.BETA < rigid.beta_where_incomplete < rigid.beta_where_tip_unstable,
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
            f"a tangent without friction, its error of order {rigid.order_of_4_17:.2f} in p; there the wall "
            f"p = {p_wall}, d = {d_wall} meets it with spectral radius {rigid.radius_of_optimistic_wall:.4f}",
            rigid.radius_of_optimistic_wall <= 1.0,
            Reason(
                ANOTHER_QUESTION,
                f"conservative with friction and soft walls: with β = {rigid.BETA} its line stays within (4.9) "
                f"up to p = {rigid.conservative_up_to:.3f}. Doubtful as a general statement: without friction "
                "it is optimistic",
                d_wall > p_wall / 2.0
                and rigid.radius_of_optimistic_wall > 1.0
                and rigid.conservative_up_to > rigid.passive_p / 2.0,
            ),
        ),
    ]


def figure_4_2() -> list[Row]:
    """Delays."""
    rows: list[Row] = []
    repeated = Reason(
        MISPRINT,
        "the text repeats the numbers without delay, and adds that the stiffness is considerably smaller than "
        "those",
        abs(delay.largest_p[0] - 0.686) < 5e-4 and delay.largest_p[1] < 0.5 * delay.largest_p[0],
        (
            Evidence("(5.6), largest p", "0.144", delay.largest_p[1]),
            Evidence("(5.6), largest d", "0.828", delay.largest_d[1]),
        ),
    )
    rows += [
        Number("below (4.32)", "l = 1: largest p", delay.largest_p[1], printed="0.686", reason=repeated),
        Number("below (4.32)", "l = 1: its d", delay.d_at_largest_p[1], printed="0.828", reason=repeated),
        Number("below (4.32)", "l = 1: largest d", delay.largest_d[1], printed="2", reason=repeated),
        Number("(5.6)", "l = 1: largest p", delay.largest_p[1], printed="0.144"),
        Number("(5.6)", "l = 1: largest d", delay.largest_d[1], printed="0.828"),
        Claim(
            "(4.32), Fig. 4.2",
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
    for l, (largest_p, its_d) in completed.delayed.items():
        p, d = completed.delayed_tip_by_brute_force(l)
        rows.append(Number("(4.26)", f"l = {l}: largest p", largest_p, second_value=p))
        rows.append(Number("(4.26)", f"l = {l}: its d", its_d, second_value=d, tolerance=1e-6))
    rows.append(
        Claim(
            "(4.26)",
            "any whole delay in closed form",
            None,
            f"(l + 1) sin t tan((l + 1) t) = 2 at the tip, on the unit circle, l = 0 to {max(completed.DELAYS)}",
            completed.error_of_delayed < 1e-9,
            route="exact charts, to 1e-09",
        )
    )
    return rows


def completed_4_9() -> list[Row]:
    """The damped rigid wall with the root that (4.9) leaves out."""
    tried = ", ".join(f"{beta:g}" for beta in completed.FRICTIONS)
    beside = completed.judged_beside_the_axis
    rows: list[Row] = [
        Claim(
            "(4.9)",
            "completed by the root z = −1",
            None,
            f"with p + 2 d < 2 β/(1 − tanh(β/2)/(β/2)) as well: largest p and its d, at β = {tried}",
            completed.error_of_completed < 1e-9,
            route="exact charts, to 1e-09",
        ),
        Claim(
            "(4.9)",
            "completed: where no wall damping is best",
            None,
            f"from β = {completed.beta_on_the_axis:.4f} on the stiffest wall has d = 0",
            completed.on_the_axis[0] > 0.0 == completed.on_the_axis[1] and beside[0] > 1e-3 > 1e-6 > beside[1],
            route=f"brute force at {completed.BESIDE} and {2 - completed.BESIDE:.2f} times that β",
        ),
    ]
    for beta in completed.FRICTIONS[-2:]:
        p, d = completed.tips_by_brute_force[beta]
        largest = completed.completed[beta][0]
        rows.append(Number("(4.9)", f"completed, β = {beta:g}: largest p", largest, second_value=p))
        (its_p, its_d), tip = completed.completed[beta], completed.printed[beta]
        rows.append(
            Claim(
                "(4.10)",
                f"largest p at β = {beta:g}",
                f"the formula gives {tip[0]:.4f}",
                f"{its_p:.4f} at d = {its_d:.4f}",
                abs(tip[0] / p - 1.0) < 1e-5,
                Reason(
                    ANOTHER_QUESTION,
                    "it is the tip of (4.9) and lies beyond the root z = −1; brute force has "
                    f"{p:.4f} at d = {d:.4f}, as the completed form",
                    abs(p / its_p - 1.0) < 1e-7 and abs(d - its_d) < 1e-6 and tip[0] > p,
                ),
            )
        )
    return rows


def figure_4_3() -> list[Row]:
    """Mass and spring; (4.43)-(4.48), (5.7), (5.8)."""
    W, stable = spring.W, spring.stable_beyond
    seen = ", ".join(f"{'yes' if s else 'no'} at {w:.2f}" for w, s in zip(spring.BEYOND, stable, strict=True))
    closed = (
        ("(4.43), (4.44), (5.7), Fig. 4.3", "largest p", spring.error_of_4_44),
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
            Reason(
                ANOTHER_QUESTION,
                f"it is the largest of the whole stable set, at p = −W² ({spring.highest_d_of_region:.4f} at "
                f"p = {spring.p_at_highest_d:.2f}), which the text names. At p = 0 it is "
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
            Reason(
                ANOTHER_QUESTION,
                "right up to W = 3π/2, so for every frequency below Nyquist's (W = π); beyond 3π/2 the samples "
                "see a slower vibration, and stable walls come back",
                stable == (True, False, False, False, True, True) and spring.BEYOND[2] < np.pi < spring.BEYOND[3],
            ),
        ),
        Claim(
            "(5.8)",
            f"area, in m²/T³, W = {W}",
            "a factor with W⁴ and sin(W/2), times 1 + 4 cos W + cos 2W − 4 (1 + cos W) ln(1 − cos “2,”)",
            f"{spring.area:.6f}",
            False,
            Reason(
                SCAN_DAMAGED,
                "“2,” is Ω_n elsewhere in this scan, the factor is damaged and one sign in doubt. With W⁴/(8 "
                f"sin⁴(W/2)) and ln(1 + cos W) the printed structure gives {spring.area_with_a_plus:.6f}, the "
                f"integral of (4.43); with ln(1 − cos W) {spring.area_with_a_minus:.1f}",
                abs(spring.area_with_a_plus - spring.area) < 1e-9
                and abs(spring.area_right - spring.area) < 1e-9
                and abs(spring.area_with_a_minus - spring.area) > 1.0,
            ),
        ),
        Claim(
            "(4.47)",
            "edge by the cosine's series",
            "(4.43) with cos W = 1 − W²/2",
            f"an approximation: its error is of order {spring.order_of_4_47:.1f} in W",
            abs(spring.order_of_4_47 - 2.0) < 0.1,
        ),
        Claim(
            "(4.48)",
            "linear condition with flexibility",
            "fragments of a fraction in p and Ω_n",
            f"d > p/(2 − W²); the slope at d → 0 errs to order {spring.order_of_4_48:.1f} in W",
            False,
            Reason(
                SCAN_DAMAGED,
                "read from (4.47) at small d, as the text derives it; an approximation of (4.43), whose slope is "
                "1/(2 cos W)",
                abs(spring.order_of_4_48 - 4.0) < 0.1,
            ),
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
    judge = BruteForceLoop(plant.mass, plant.damping, plant.stiffness, 1.0, models.motor_mass.loop.period)
    K, B, _ = judge.largest_stiffness(9000.0, 40.0)
    return [
        Number(
            "Fig. 4.4, (2.44)",
            "motor's mass, damped: largest stiffness",
            models.motor_mass.stiffness_max,
            "N/m",
            second_value=K,
        ),
        Number(
            "Fig. 4.4",
            "motor's mass, damped: damping there",
            models.motor_mass.damping_at_stiffness_max,
            "N s/m",
            second_value=B,
            tolerance=1e-5,
        ),
        Number(
            "Fig. 4.4",
            "motor's mass, undamped: largest stiffness, by (4.44)",
            bare.stiffness_max,
            "N/m",
            second_value=models.closed_form,
            route="exact chart",
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
        *which_model_where(),
    ]


def which_model_where() -> list[Row]:
    """4.3 by the frequency along the edge."""
    share = where.rigid_below / where.natural
    return [
        Claim(
            "4.3",
            "rigid model",
            "approximates well where the dominant frequency is far below the first natural frequency",
            f"within 10 % of two masses below {where.rigid_below:.2f} Hz, {share:.0%} of {where.natural:.1f} Hz",
            where.rigid == ((where.lowest, where.rigid_below),) and where.rigid_below < 0.5 * where.natural,
        ),
        Claim(
            "4.3",
            "motor's mass on its spring, damped",
            "gives good representation at high dominant frequencies",
            f"within 10 % above {where.motor_above:.1f} Hz, up to the edge's highest, {where.highest:.1f} Hz",
            where.motor == ((where.motor_above, where.highest),) and where.motor_above > where.rigid_below,
        ),
        Claim(
            "4.3",
            "between them",
            "structural flexibility has to be considered",
            f"from {where.rigid_below:.2f} to {where.motor_above:.1f} Hz neither is within 10 %; the motor's mass "
            "without damping nowhere is",
            where.rigid_below < where.motor_above and not where.motor_undamped,
        ),
    ]


def rows() -> list[Row]:
    """All of the chapter, and what chapter 5 has of it."""
    return [*figure_4_1(), *completed_4_9(), *figure_4_2(), *figure_4_3(), *figure_4_4()]
