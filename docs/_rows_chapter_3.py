"""Chapter 3: the device, the bilateral wall, the filter, the operator."""

from __future__ import annotations

import numpy as np

from docs._row import Claim, Misprint, Number, Row, significant
from gallery import fig_3_7_bilateral_wall as wall
from gallery import fig_3_8_frequencies as vibration
from gallery import fig_3_9_no_damping as undamped
from gallery import fig_3_11_filter as low_pass
from gallery import fig_3_12_operator as hand
from gallery import table_3_4 as device
from gallery.brute_force import Judge, butterworth
from zwidth.chart.chart import StabilityChart

T = wall.loop.period


def judge_of(chart: StabilityChart, delay: int = 0, filter_of=None) -> Judge:
    """The brute-force judge of a chart's plant."""
    plant = chart.loop.plant
    low = {} if filter_of is None else {"low_pass": filter_of}
    return Judge(plant.mass, plant.damping, plant.stiffness, plant.actuator, chart.loop.period, delay, **low)


def chart_rows(
    place: str, case: str, chart: StabilityChart, judge: Judge, corners=(), within_area=1e-8
) -> list[Row]:
    """Largest stiffness, its damping and frequency, largest damping and area, each beside the brute force's."""
    K, B, f = judge.largest_stiffness(1.3 * chart.stiffness_max, 1.2 * chart.damping_max)
    area = judge.area(K, 1.05 * chart.damping_max, corners)
    d_max = judge.largest_damping(1.2 * chart.damping_max)
    nearest = min(chart.frequencies_at_stiffness_max, key=lambda hertz: abs(hertz - f))
    return [
        Number(place, f"{case}: largest stiffness", chart.stiffness_max, "N/m", judge=K, digits=9),
        # damping and frequency at a maximum are known to the root of the rounding only
        Number(place, f"{case}: damping there", chart.damping_at_stiffness_max, "N s/m", judge=B, within=1e-5),
        Number(place, f"{case}: frequency there", nearest, "Hz", judge=f, within=1e-5),
        Number(place, f"{case}: largest damping, K → 0", chart.damping_max, "N s/m", judge=d_max, digits=8),
        Number(
            place, f"{case}: stable area", chart.stable_area, "N² s/m²", judge=area, within=within_area, digits=9
        ),
    ]


def table_3_4() -> list[Row]:
    """Tables 3.1-3.4, natural frequencies."""
    pulleys, ratio = device.ratio_of_the_pulleys, device.ratio
    wrong_mass = device.motor_side_mass_with_the_pulleys_ratio
    inertia = device.motor_inertia_at_the_joint
    high = device.frequency_of_the_published_plant
    return [
        Number(
            "3.1.1",
            "transmission ratio (96 − 4.95)/4.95",
            pulleys,
            printed="18.6",
            misprint=Misprint(
                f"its own dimensions give {pulleys:.2f}; the printed motor-side mass of 0.0254 kg needs 18.6 "
                f"({device.motor_side_mass:.5f} kg, against {wrong_mass:.5f} kg)",
                abs(device.motor_side_mass - 0.0254) < 5e-5 < abs(wrong_mass - 0.0254),
            ),
        ),
        Number(
            "3.1.1",
            "motor inertia at the joint",
            inertia,
            "kg m²",
            printed="1.186e-4",
            misprint=Misprint(
                f"18.6² · 12.1e-7 kg m² = {inertia:.4g} kg m²: the first digit is wrong",
                abs(inertia - 4.186e-4) < 5e-8 and abs(inertia - ratio**2 * 12.1e-7) < 1e-12,
            ),
            digits=4,
        ),
        Number(
            "Table 3.4", "m_e1, link side (from Tables 3.1–3.2)", device.link_side_mass, "kg", printed="0.2616"
        ),
        Claim(
            "App. B",
            "link inertias",
            "adds m L²/12 to the inertias of Table 3.2",
            f"m_e1 = {device.link_side_mass_of_appendix_b:.4f} kg with it, {device.link_side_mass:.4f} kg "
            f"without; {device.link_side_mass_without_offsets:.4f} kg without the lateral offsets",
            abs(device.link_side_mass_of_appendix_b - 0.2616) < 5e-5,
            Misprint(
                "the printed 0.2616 kg needs the inertias of Table 3.2 as measured, and the offsets of 7.5 mm",
                abs(device.link_side_mass - 0.2616) < 5e-5 < abs(device.link_side_mass_without_offsets - 0.2616),
            ),
        ),
        Number("Table 3.4", "m_e2, motor side", device.motor_side_mass, "kg", printed="0.0254"),
        Number("Table 3.4", "both together, rigid", device.rigid_mass, "kg", printed="0.287"),
        Number(
            "Table 3.4",
            "k_e by (2.34), largest stiffnesses",
            device.stiffness,
            "N/m",
            printed="15620",
            misprint=Misprint(
                f"15 620 N/m is what puts the two-mass model at the second frequency ({high:.1f} Hz); "
                f"{device.stiffness:.0f} N/m puts it at {device.frequency_with_the_computed_stiffness:.1f} Hz",
                abs(high - device.frequencies[1]) < 0.1,
            ),
        ),
        Claim(
            "Table 3.4",
            "sampling period",
            "0.0025 s",
            f"{T} s",
            T == 0.0025,
            Misprint("3.1.3 says 800 Hz, and 1/800 Hz = 0.00125 s", T == 1.0 / 800.0),
        ),
        Number(
            "3.1.3", "first natural frequency, largest stiffnesses", device.frequencies[0], "Hz", printed="101"
        ),
        Number("3.1.3", "second natural frequency", device.frequencies[1], "Hz", printed="131"),
        Number(
            "3.1.3",
            "first natural frequency, average stiffnesses",
            device.frequencies_at_average_stiffness[0],
            "Hz",
            printed="95",
            misprint=Misprint(
                f"Table 3.3's averages give {device.frequencies_at_average_stiffness[0]:.2f} Hz by the model that "
                "gives 101 and 131 Hz: cut off, not rounded",
                abs(device.frequencies[0] - 101) < 0.5 and int(device.frequencies_at_average_stiffness[0]) == 95,
            ),
        ),
        Number(
            "3.1.3",
            "second natural frequency, average stiffnesses",
            device.frequencies_at_average_stiffness[1],
            "Hz",
            printed="120",
            misprint=Misprint(
                "the same average stiffnesses that give the first frequency give "
                f"{device.frequencies_at_average_stiffness[1]:.2f} Hz",
                abs(device.frequencies[1] - 131) < 0.5,
            ),
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
            "r_k = 0.0012 s, damping ratio 0.5; chart's tip a little above 7000 N/m",
            f"r_k = 0.0012 s: tip at {printed:.0f} N/m; r_k = 0.00012 s, ratio {wall.damping_ratio:.3f}: "
            f"{wall.chart.stiffness_max:.0f} N/m",
            7000.0 < printed < 8000.0,
            Misprint(
                f"{printed:.0f} N/m lies beyond the measured chart and beyond the quantisation limit of "
                "26 700 N/m; chapter 5 says 5 %",
                printed > wall.QUANTISATION_LIMIT and 7000.0 < wall.chart.stiffness_max < 8000.0,
            ),
        ),
        *chart_rows("Fig. 3.7", "r_k = 0.00012 s", wall.chart, judge, (vibration.corner_stiffness,)),
        Number("Fig. 3.7", "lower edge at 4000 N/m", wall.crossings_at_4000[0], "N s/m", judge=low, within=1e-5),
        Number("Fig. 3.7", "upper edge at 4000 N/m", wall.crossings_at_4000[1], "N s/m", judge=high, within=1e-5),
        Number(
            "Fig. 3.10",
            "point E: smallest spectral radius",
            best.spectral_radius,
            judge=rho,
            within=1e-6,
        ),
        # the radius is flat there: the wall is known less well than the radius
        Number("Fig. 3.10", "point E: stiffness", best.stiffness, "N/m", judge=K, within=1e-4, digits=4),
        Number("Fig. 3.10", "point E: damping", best.damping, "N s/m", judge=B, within=1e-4, digits=4),
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
        Number("Fig. 3.8", f"{corner}: lower frequency", vibration.corner_low_Hz, "Hz", judge=hertz.min()),
        Number("Fig. 3.8", f"{corner}: higher frequency", vibration.corner_high_Hz, "Hz", judge=hertz.max()),
        Claim(
            "3.1.3",
            "highest vibration frequency",
            "about 200 Hz, half of the Nyquist frequency",
            f"{highest:.1f} Hz for K → 0; half of the Nyquist frequency is {vibration.NYQUIST / 2:.0f} Hz",
            round(highest, -2) == 200.0,
        ),
        *chart_rows("Fig. 3.7", "one sample of delay", vibration.delayed, late),
        Number("Fig. 3.8", "one sample of delay, at the tip: lower frequency", low, "Hz", judge=late_hertz.min()),
        Number(
            "Fig. 3.8", "one sample of delay, at the tip: higher frequency", high, "Hz", judge=late_hertz.max()
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
            "–",
            f"no stable wall; of {K.size} walls by brute force {(late.radius(K, B) < 1.0).sum()} are stable",
            not undamped.flexible_delayed.regions and least > 1.0,
        ),
    ]


def figure_3_11() -> list[Row]:
    """The filter."""
    plain, warped = butterworth(20.0, T), butterworth(20.0, T, prewarped=True)
    flexible, rigid = low_pass.two_mass.stiffness_max, low_pass.rigid.stiffness_max
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
            "the rigid-body model is representative in this case",
            f"largest stiffness {flexible:.0f} N/m with two masses, {rigid:.0f} N/m rigid: "
            f"{flexible / rigid - 1.0:.0%} apart",
            abs(flexible / rigid - 1.0) < 0.05,
            Misprint(
                "the drives' flexibility, with their damping, still counts: brute force finds the same two "
                f"numbers, and they differ by {significant(flexible - rigid, 3)} N/m",
                flexible > 1.05 * rigid,
                kind="overstated",
            ),
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
    held, alone = hand.chart, hand.alone
    return [
        Number(
            "Fig. 3.12", "in the operator's hand: largest stiffness", held.stiffness_max, "N/m", judge=K, digits=9
        ),
        Number("Fig. 3.12", "damping there", held.damping_at_stiffness_max, "N s/m", judge=B, within=1e-5),
        Number("Fig. 3.12", "frequency there", held.frequencies_at_stiffness_max[0], "Hz", judge=f, within=1e-5),
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
            "slightly reduces the physically meaningful (positive) domain",
            f"with k_h = 580 N/m the positive area is that with k_h = 0, to 1e-7; the static edge is at "
            f"K = {hand.static_edge:.1f} N/m",
            hand.area_by_arm_stiffness < -1e-7,
            Misprint(
                "the spring moves the static edge to K = −1/(1/k_e + 1/k_c + 1/k_h) = "
                f"{hand.static_edge_by_hand:.1f} N/m, which takes nothing from K > 0",
                abs(hand.area_by_arm_stiffness) < 1e-7
                and abs(hand.static_edge / hand.static_edge_by_hand - 1.0) < 1e-9,
                kind="not found",
            ),
        ),
    ]


def rows() -> list[Row]:
    """All of the chapter."""
    return [*table_3_4(), *figure_3_7(), *figure_3_8(), *figure_3_9(), *figure_3_11(), *figure_3_12()]
