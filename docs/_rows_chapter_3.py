"""Chapter 3: the bilateral wall, the filter, the operator; the device is in `docs._rows_device`."""

from __future__ import annotations

import numpy as np

from docs import _rows_device as device
from docs._comparison_row import MISPRINT, ROUNDED, SCAN_DAMAGED, Claim, Evidence, Number, Reason, Row
from gallery import fig_3_7_bilateral_wall as wall
from gallery import fig_3_8_frequencies as vibration
from gallery import fig_3_9_no_damping as undamped
from gallery import fig_3_11_filter as low_pass
from gallery import fig_3_12_operator as hand
from gallery import transition_matrices as matrices
from gallery.brute_force import BruteForceLoop, butterworth
from zwidth.chart import StabilityChart

T = wall.loop.period


def judge_of(chart: StabilityChart, delay: int = 0, filter_of=None) -> BruteForceLoop:
    """The brute-force judge of a chart's plant."""
    plant = chart.loop.plant
    low = {} if filter_of is None else {"low_pass": filter_of}
    return BruteForceLoop(
        plant.mass, plant.damping, plant.stiffness, plant.actuator, chart.loop.period, delay, **low
    )


def chart_rows(
    place: str, case: str, chart: StabilityChart, judge: BruteForceLoop, corners=(), within_area=1e-8
) -> list[Row]:
    """Largest stiffness, its damping and frequency, largest damping and area, each beside the brute force's.

    A corner has two frequencies, and rounding decides which of them the judge calls dominant: those have rows of
    their own.
    """
    K, B, f = judge.largest_stiffness(1.3 * chart.stiffness_max, 1.2 * chart.damping_max)
    area = judge.area(K, 1.05 * chart.damping_max, corners)
    d_max = judge.largest_damping(1.2 * chart.damping_max)
    smooth = len(chart.frequencies_at_stiffness_max) == 1
    hertz = chart.frequencies_at_stiffness_max[0]
    frequency = (
        [Number(place, f"{case}: frequency there", hertz, "Hz", second_value=f, tolerance=1e-5)] if smooth else []
    )
    return [
        Number(place, f"{case}: largest stiffness", chart.stiffness_max, "N/m", second_value=K, digits=9),
        # damping and frequency at a maximum are known to the root of the rounding only
        Number(
            place,
            f"{case}: damping there",
            chart.damping_at_stiffness_max,
            "N s/m",
            second_value=B,
            tolerance=1e-5,
        ),
        *frequency,
        Number(place, f"{case}: largest damping, K → 0", chart.damping_max, "N s/m", second_value=d_max, digits=8),
        Number(
            place,
            f"{case}: stable area",
            chart.stable_area,
            "N² s/m²",
            second_value=area,
            tolerance=within_area,
            digits=9,
        ),
    ]


def figure_3_7() -> list[Row]:
    """The chart."""
    judge = judge_of(wall.chart)
    low, high = (float(edge) for edge in judge.edges(np.array(4000.0), 40.0))
    best = wall.chart.fastest_decay
    assert best is not None
    K, B, rho = judge.triple_point(best.stiffness, best.damping)
    printed = wall.chart_as_printed.stiffness_max
    return [
        Claim(
            "3.2.1",
            "structural damping",
            "r_k = 0.0012 s, damping ratio 0.5",
            f"r_k = 0.00012 s, damping ratio {wall.damping_ratio:.3f}, with the tip at "
            f"{wall.chart.stiffness_max:.0f} N/m",
            7000.0 < printed < 8000.0,
            Reason(
                MISPRINT,
                f"with 0.0012 s the tip would be at {printed:.0f} N/m. The measured one is above 7000 N/m "
                "(3.2.2), and by 3.2.5 the two masses lose stability well before the 26 700 N/m of quantisation",
                printed > wall.QUANTISATION_LIMIT and 7000.0 < wall.chart.stiffness_max < 8000.0,
                (Evidence("modal damping in 5.3.2", "5", 100.0 * wall.damping_ratio, "%"),),
            ),
        ),
        *chart_rows("Fig. 3.7, (2.36)", "r_k = 0.00012 s", wall.chart, judge, (vibration.corner_stiffness,)),
        Number(
            "Fig. 3.7",
            "lower edge at 4000 N/m",
            wall.crossings_at_4000[0],
            "N s/m",
            second_value=low,
            tolerance=1e-5,
        ),
        Number(
            "Fig. 3.7",
            "upper edge at 4000 N/m",
            wall.crossings_at_4000[1],
            "N s/m",
            second_value=high,
            tolerance=1e-5,
        ),
        Number(
            "Fig. 3.10",
            "point E: smallest spectral radius",
            best.spectral_radius,
            second_value=rho,
            tolerance=1e-6,
        ),
        # the radius is flat there: the wall is known less well than the radius
        Number("Fig. 3.10", "point E: stiffness", best.stiffness, "N/m", second_value=K, tolerance=1e-4, digits=4),
        Number("Fig. 3.10", "point E: damping", best.damping, "N s/m", second_value=B, tolerance=1e-4, digits=4),
    ]


def figure_3_8() -> list[Row]:
    """Frequencies along the edge."""
    judge = judge_of(wall.chart)
    roots = judge.roots(vibration.corner_stiffness, vibration.corner_damping)
    hertz = np.abs(np.angle(roots[np.abs(np.abs(roots) - 1.0) < 1e-6])) / (2.0 * np.pi * T)
    late = judge_of(vibration.delayed, 1)
    K, B = vibration.delayed.stiffness_max, vibration.delayed.damping_at_stiffness_max
    roots = late.roots(K, B)
    late_hertz = np.abs(np.angle(roots[np.abs(np.abs(roots) - 1.0) < 1e-6])) / (2.0 * np.pi * T)
    low, high = vibration.delayed_corner_Hz
    highest = vibration.highest_Hz
    corner = f"corner at {vibration.corner_stiffness:.1f} N/m, {vibration.corner_damping:.4f} N s/m"
    return [
        Number("Fig. 3.8", f"{corner}: lower frequency", vibration.corner_low_Hz, "Hz", second_value=hertz.min()),
        Number(
            "Fig. 3.8", f"{corner}: higher frequency", vibration.corner_high_Hz, "Hz", second_value=hertz.max()
        ),
        Number(
            "3.1.3, Fig. 3.8",
            "highest vibration frequency",
            highest,
            "Hz",
            printed="200",
            reason=Reason(
                ROUNDED,
                f"“about 200 Hz”, half of the Nyquist frequency ({vibration.NYQUIST / 2:.0f} Hz); ours, for K → "
                "0, is that to the nearest hundred",
                round(highest, -2) == 200.0 == vibration.NYQUIST / 2,
            ),
        ),
        *chart_rows("Fig. 3.7", "one sample of delay", vibration.delayed, late),
        Number(
            "Fig. 3.8",
            "one sample of delay, at the tip: lower frequency",
            low,
            "Hz",
            second_value=late_hertz.min(),
        ),
        Number(
            "Fig. 3.8",
            "one sample of delay, at the tip: higher frequency",
            high,
            "Hz",
            second_value=late_hertz.max(),
        ),
    ]


def figure_3_9() -> list[Row]:
    """No damping."""
    late = judge_of(undamped.flexible_delayed, 1)
    K, B = np.meshgrid(np.geomspace(0.1, 4000.0, 40), np.linspace(0.0, 24.0, 60))
    least = float(late.radius(K, B).min())
    return [
        *chart_rows("Fig. 3.9", "flexible, undamped", undamped.flexible, judge_of(undamped.flexible)),
        *chart_rows("Fig. 3.9", "rigid, undamped", undamped.rigid, judge_of(undamped.rigid)),
        Claim(
            "Fig. 3.9",
            "flexible device inside the rigid one",
            "loses stability well inside the rigid model's stable domain",
            f"{undamped.flexible.stiffness_max:.0f} N/m against {undamped.rigid.stiffness_max:.0f} N/m",
            undamped.flexible.stiffness_max < 0.1 * undamped.rigid.stiffness_max,
        ),
        Claim(
            "Fig. 3.9",
            "flexible, undamped, one sample of delay",
            None,
            "no stable wall",
            not undamped.flexible_delayed.regions and least > 1.0,
            route=f"brute force on {K.size} walls, none stable",
        ),
    ]


def figure_3_11() -> list[Row]:
    """The filter."""
    plain, warped = butterworth(20.0, T), butterworth(20.0, T, prewarped=True)
    flexible, rigid = low_pass.two_mass.stiffness_max, low_pass.rigid.stiffness_max
    slow = [chart.frequencies_at_stiffness_max[0] for chart in (low_pass.rigid, low_pass.two_mass)]
    return [
        *chart_rows("Fig. 3.11", "rigid, 20 Hz filter", low_pass.rigid, judge_of(low_pass.rigid, 0, plain)),
        *chart_rows(
            "Fig. 3.11",
            "rigid, prewarped filter",
            low_pass.rigid_prewarped,
            judge_of(low_pass.rigid_prewarped, 0, warped),
        ),
        *chart_rows(
            "Fig. 3.11", "two masses, 20 Hz filter", low_pass.two_mass, judge_of(low_pass.two_mass, 0, plain)
        ),
        *chart_rows(
            "Fig. 3.11",
            "two masses, prewarped filter",
            low_pass.two_mass_prewarped,
            judge_of(low_pass.two_mass_prewarped, 0, warped),
        )[:3],
        Claim(
            "3.2.4",
            "with the filter the rigid model stands for the device",
            "representative; as physical damping is not considered, its stable domain is smaller than the "
            "measured one",
            f"largest stiffness {rigid:.0f} N/m rigid, {flexible:.0f} N/m with two masses and their damping, "
            f"{flexible / rigid:.1f} times as much, at {slow[0]:.1f} and {slow[1]:.1f} Hz; without the filter "
            f"the rigid one has {undamped.rigid.stiffness_max / wall.chart.stiffness_max:.0f} times the other's",
            1.0 < flexible / rigid < 1.25 and abs(slow[1] / slow[0] - 1.0) < 0.05,
        ),
        Claim(
            "3.2.4",
            "what the filter changes",
            "higher virtual damping at low stiffness, smaller largest stiffness",
            f"largest damping {low_pass.two_mass.damping_max:.1f} instead of "
            f"{low_pass.two_mass_unfiltered.damping_max:.1f} N s/m, largest stiffness {flexible:.0f} instead of "
            f"{low_pass.two_mass_unfiltered.stiffness_max:.0f} N/m",
            low_pass.two_mass.damping_max > low_pass.two_mass_unfiltered.damping_max
            and flexible < low_pass.two_mass_unfiltered.stiffness_max,
        ),
    ]


def figure_3_12() -> list[Row]:
    """The operator."""
    judge = hand.judge_of(hand.ASSUMED)
    K, B, f = judge.largest_stiffness(20000.0, 60.0)
    held, alone = hand.chart, hand.chart_without_operator
    free, on_spring = (
        {name: hand.tips_on_operator_spring[name, k][0] for name in hand.MASSES} for k in (0.0, hand.ARM[1])
    )
    return [
        Number(
            "Fig. 3.12, (3.23), (3.24)",
            "in the operator's hand: largest stiffness",
            held.stiffness_max,
            "N/m",
            second_value=K,
            digits=9,
        ),
        Number(
            "Fig. 3.12", "damping there", held.damping_at_stiffness_max, "N s/m", second_value=B, tolerance=1e-5
        ),
        Number(
            "Fig. 3.12",
            "frequency there",
            held.frequencies_at_stiffness_max[0],
            "Hz",
            second_value=f,
            tolerance=1e-5,
        ),
        Claim(
            "3.1.3",
            "natural frequencies with a firm grasp",
            "a slight increase",
            f"the highest rises from {hand.frequency_alone:.2f} to {hand.frequency_held:.2f} Hz in the hand of "
            "(3.24)",
            1.0 < hand.frequency_held / hand.frequency_alone < 1.05,
        ),
        Claim(
            "3.3",
            "what the passive operator (3.23)–(3.24) does",
            "a relatively small effect",
            f"{hand.gain_by_operator:.1%} more stiffness, {hand.area_by_operator:.1%} more area",
            0.0 < hand.gain_by_operator < 0.05 and 0.0 < hand.area_by_operator < 0.5 * hand.area_by_damping,
        ),
        Claim(
            "3.3",
            "what the larger stable domain comes from",
            "mainly the consequence of the assumed increased structural dissipation",
            f"7.5 % in place of 5 % adds {hand.gain_by_damping:.0%} of stiffness and "
            f"{hand.area_by_damping:.0%} of area",
            hand.gain_by_damping > 10.0 * hand.gain_by_operator and hand.area_by_damping > hand.area_by_operator,
        ),
        Claim(
            "3.3",
            "low virtual damping",
            "for low virtual damping values the difference is significant",
            f"walls down to {hand.lowest_damping:.2f} N s/m, undamped ones up to "
            f"{hand.stiffest_undamped / 1000.0:.2f} kN/m; alone none with B ≤ 0",
            hand.lowest_damping < -1.0 and bool(np.all(hand.edge(alone)[1] >= -1e-9)),
        ),
        Claim(
            "3.3",
            "the operator's stiffness",
            "“as it will be shown later, … slightly reduces the physically meaningful (positive) domain”",
            f"so it does in 4.2's models: k_h = 580 N/m lowers the largest stiffness from {free['rigid']:.1f} to "
            f"{on_spring['rigid']:.1f} N/m (rigid) and from {free['motor']:.1f} to {on_spring['motor']:.1f} N/m "
            "(motor's mass), by (4.44) and by brute force. In the three masses of (3.24) the positive area stays, "
            f"to 1e-7; the static edge moves to K = {hand.static_edge:.1f} N/m",
            all(0.95 * free[name] < on_spring[name] < free[name] for name in hand.MASSES)
            and all(abs(closed / judged - 1.0) < 1e-9 for closed, judged in hand.tips_on_operator_spring.values())
            and abs(hand.area_by_arm_stiffness) < 1e-7
            and abs(hand.static_edge / hand.static_edge_by_hand - 1.0) < 1e-9,
        ),
    ]


def transition_matrices() -> list[Row]:
    """(3.2)-(3.22)."""
    same = "characteristic polynomials are brute force's"
    pairs = f"{len(matrices.RANDOM)} random pairs of masses"
    return [
        Claim(
            "(3.2), (3.5), (3.6)",
            "modes of the two masses",
            "λ₂ = k_e (m_e1 + m_e2)/(m_e1 m_e2), α₁ = 1/√(m_e1 + m_e2), α₂ = √(m_e1/m_e2)",
            f"mass-normalised, and K's eigenvectors, to rounding: with Table 3.4 and {pairs}",
            max(matrices.error_of_modes, matrices.random_error_of_modes) < 1e-12,
        ),
        Claim(
            "(3.7), (3.8)",
            "a mode over one period under a held force",
            "ξ1 … with 1 − e^{−r_m Δt} and e^{r_m Δt} − 1, ξ2 … with Ω_n and Ω_d",
            "with ξ1 + (1 − e^{−r_m Δt})/r_m ξ̇1 + ((e^{−r_m Δt} − 1)/r_m² + Δt/r_m) F and ξ2 as printed, "
            f"these and their rates are the matrix exponential of (3.7), to 1e-9, with Table 3.4 and {pairs}",
            False,
            Reason(
                SCAN_DAMAGED,
                "in the first line the scan has lost r_m under the fraction, a sign, the minus of an exponent and "
                "Δt/r_m",
                max(matrices.error_of_steps, matrices.random_error_of_steps) < 1e-9,
            ),
        ),
        Claim(
            "(3.3), (3.4), (3.7)–(3.9)",
            "transition matrix in modal coordinates",
            "five non-zero and one zero eigenvalues",
            f"{same} and those of zwidth's loop, to 1e-9, on {len(matrices.WALLS)} walls with Table 3.4, r_m = "
            f"{matrices.R_M} 1/s and r_k = {matrices.R_K} s, and on one wall each of {pairs}, whichever sign v "
            "has (the scan's minus signs in (3.9) are of one, which changes no eigenvalue). The sixth is "
            f"zero to rounding, the others are at least {matrices.non_zero:.3f}",
            max(
                matrices.error_of_modal,
                matrices.error_of_zwidth,
                matrices.random_error_of_modal,
                matrices.random_error_of_zwidth,
            )
            < 1e-9
            and matrices.zero < 1e-9 < matrices.non_zero,
        ),
        Claim(
            "(3.10)–(3.16)",
            "transition matrix of one mass with friction",
            "a 3 × 3 matrix with ε = (1 − e^−β)/β",
            f"{same}, to rounding, for β = 0.01 to 3",
            matrices.error_of_damped < 1e-11,
        ),
        Claim(
            "(3.17)–(3.19)",
            "Butterworth filter by Tustin's rule",
            "n₀ … d₂ with Ω_c = ω_c Δt and ζ = 1/√2",
            "the coefficients of SciPy's bilinear transformation, to rounding",
            matrices.error_of_filter < 1e-12,
        ),
        Claim(
            "(3.20)–(3.22)",
            "transition matrix with the filtered position",
            "a 5 × 5 matrix",
            f"{same} with the filter on the velocity instead, to rounding",
            matrices.error_of_filtered < 1e-11,
        ),
    ]


def rows() -> list[Row]:
    """All of the chapter."""
    return [
        *device.rows(),
        *figure_3_7(),
        *figure_3_8(),
        *transition_matrices(),
        *figure_3_9(),
        *figure_3_11(),
        *figure_3_12(),
    ]
