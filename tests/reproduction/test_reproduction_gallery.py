"""The gallery's results against the numbers that an independent calculation gave for the thesis's plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gallery.brute_force import BruteForceLoop, butterworth
from tests.lazy_module import LazyModule

algebra = LazyModule("gallery.chapter_4_algebra")
completed = LazyModule("gallery.chapter_4_extended_forms")
wall = LazyModule("gallery.fig_3_7_bilateral_wall")
vibration = LazyModule("gallery.fig_3_8_frequencies")
undamped = LazyModule("gallery.fig_3_9_no_damping")
low_pass = LazyModule("gallery.fig_3_11_filter")
hand = LazyModule("gallery.fig_3_12_operator")
rigid = LazyModule("gallery.fig_4_1_rigid")
delay = LazyModule("gallery.fig_4_2_delay")
spring = LazyModule("gallery.fig_4_3_mass_spring")
models = LazyModule("gallery.fig_4_4_models")
base = LazyModule("gallery.fig_5_5_base_distance")
optimal_mass = LazyModule("gallery.optimal_mass")
table_3_4 = LazyModule("gallery.table_3_4")
plane = LazyModule("gallery.rendered_directions")
worst = LazyModule("gallery.spring_stability")
where = LazyModule("gallery.which_model_where")
matrices = LazyModule("gallery.transition_matrices")
damped = LazyModule("gallery.damped_mass_algebra")
sprung = LazyModule("gallery.mass_spring_algebra")
appendix_b = LazyModule("gallery.appendix_b")
drawn = LazyModule("gallery.appendix_b_random")

# Transition matrix by matrix exponential, eigenvalues: largest stiffness, its damping and frequency, largest
# damping for K -> 0. All digits given are right.
BRUTE_FORCE = {
    "undamped": (undamped, "flexible", 4033.83825717, 10.7414444, 169.834082, 23.9047385),
    "damped": (wall, "chart", 7133.86929380, 9.97478812, 174.547436, 28.4474336),
    "delayed": (vibration, "delayed", 1101.30206608, 2.07670521, 9.62832, 4.17250259),
    "rigid": (undamped, "rigid", 126058.022906, 190.206868, 145.622666, 459.2),
    "filtered": (low_pass, "rigid", 2167.38666443, 8.14533155, 15.813584, 42.1176801),
    "prewarped": (low_pass, "rigid_prewarped", 2174.58486623, 8.16440765, 15.841482, 42.1900705),
}
# The same sources, and for the filter an adaptive quadrature of the edge in 30 digits.
AREAS = {
    "undamped": (undamped, "flexible", 64089.3003),
    "damped": (wall, "chart", 138570.0695),
    "delayed": (vibration, "delayed", 2346.02122),
    "rigid": (undamped, "rigid", 38362397.77),
    "filtered": (low_pass, "rigid", 56700.891515661),
    "prewarped": (low_pass, "rigid_prewarped", 56990.791151366),
}


@pytest.mark.parametrize("case", BRUTE_FORCE)
def test_a_chart_has_the_numbers_of_brute_force(case):
    script, name, K, B, frequency, largest_damping = BRUTE_FORCE[case]
    chart = getattr(script, name)
    assert chart.stiffness_max == pytest.approx(K, rel=1e-11)
    assert chart.damping_at_stiffness_max == pytest.approx(B, rel=1e-8)
    assert chart.frequencies_at_stiffness_max[0] == pytest.approx(frequency, rel=1e-6)
    assert chart.damping_max == pytest.approx(largest_damping, rel=3e-9)


@pytest.mark.parametrize("case", AREAS)
def test_a_chart_has_the_area(case):
    script, name, area = AREAS[case]
    assert getattr(script, name).stable_area == pytest.approx(area, rel=2e-9)


def test_without_damping_one_sample_of_delay_leaves_nothing():
    assert undamped.flexible_delayed.regions == ()
    assert np.isnan(undamped.flexible_delayed.stiffness_max)
    assert undamped.flexible_delayed.stable_area == 0.0


def test_table_3_4():
    assert table_3_4.link_side_mass == pytest.approx(0.261599, abs=5e-7)
    assert table_3_4.motor_side_mass == pytest.approx(0.025367, abs=5e-7)
    assert table_3_4.rigid_mass == pytest.approx(0.286967, abs=5e-7)
    assert table_3_4.stiffness == pytest.approx(11793, abs=0.5)
    assert table_3_4.frequencies == pytest.approx([101.31, 130.80], abs=0.005)
    assert table_3_4.frequencies_at_average_stiffness == pytest.approx([95.51, 121.77], abs=0.005)
    assert table_3_4.motor_inertia_at_the_joint == pytest.approx(4.186e-4, abs=5e-8)
    assert table_3_4.ratio_of_the_pulleys == pytest.approx(18.39, abs=0.005)
    assert table_3_4.link_side_mass_without_offsets == pytest.approx(0.2656, abs=5e-5)


def test_the_bilateral_wall():
    assert wall.damping_ratio == pytest.approx(0.049, abs=5e-4)
    assert wall.chart_as_printed.stiffness_max == pytest.approx(42e3, rel=0.01)
    # the reading off the chart and the bisection of eigenvalues
    assert wall.crossings_at_4000 == pytest.approx(wall.edges_at_4000, rel=1e-5)
    # given as 2.42 and 21.66, rounded into the stable side
    assert wall.edges_at_4000 == pytest.approx((2.415, 21.666), abs=1e-3)


def test_the_fastest_decay():
    best = wall.chart.fastest_decay
    assert best.stiffness == pytest.approx(467.90, abs=0.05)
    assert best.damping == pytest.approx(21.9465, abs=5e-4)
    assert best.spectral_radius == pytest.approx(0.9454836, abs=1e-6)


def test_frequencies_along_the_edge():
    assert (vibration.corner_low_Hz, vibration.corner_high_Hz) == pytest.approx((19.8231, 154.4454), abs=1e-4)
    assert vibration.highest_Hz == pytest.approx(212.15, abs=0.005)
    assert vibration.delayed_corner_Hz == pytest.approx((9.628, 135.28), abs=5e-3)
    # both roots are on the circle at the corner
    corner = vibration.corner_stiffness, vibration.corner_damping
    circle = np.abs(BruteForceLoop(*plant_of(wall.chart)).roots(*corner))
    assert (np.abs(circle - 1.0) < 1e-9).sum() == 4


def plant_of(chart):
    plant = chart.loop.plant
    return plant.mass, plant.damping, plant.stiffness, plant.actuator, chart.loop.period


def test_two_masses_with_a_filter():
    judge = BruteForceLoop(*plant_of(low_pass.two_mass), low_pass=butterworth(20.0, low_pass.two_mass.loop.period))
    K, *_ = judge.largest_stiffness(4000.0, 60.0)
    assert low_pass.two_mass.stiffness_max == pytest.approx(K, rel=1e-9)
    assert low_pass.two_mass.stiffness_max == pytest.approx(2598.0368, abs=1e-4)
    assert low_pass.two_mass_undamped.regions == ()


def test_the_operators_hand():
    judge = hand.judge_of(hand.ASSUMED)
    K, B, frequency = judge.largest_stiffness(20000.0, 60.0)
    assert hand.chart.stiffness_max == pytest.approx(K, rel=1e-11)
    assert hand.chart.stiffness_max == pytest.approx(8849.455764, abs=1e-6)
    assert hand.chart.damping_at_stiffness_max == pytest.approx(B, rel=1e-6)
    assert hand.chart.frequencies_at_stiffness_max[0] == pytest.approx(frequency, rel=1e-7)
    assert judge.radius(*hand.edge(hand.chart)) == pytest.approx(1.0, abs=2e-7)
    assert (hand.gain_by_operator, hand.gain_by_damping) == pytest.approx((0.0036, 0.228), abs=5e-4)
    assert (hand.area_by_operator, hand.area_by_damping) == pytest.approx((0.0853, 0.3241), abs=5e-5)
    assert abs(hand.area_by_arm_stiffness) < 1e-7
    assert hand.lowest_damping == pytest.approx(-6.0213, abs=5e-5)
    assert hand.stiffest_undamped == pytest.approx(6025, abs=15)
    assert hand.static_edge == pytest.approx(hand.static_edge_by_hand, rel=1e-9)
    # 4.2's models on the arm's spring, by the closed form and by brute force
    for (mass, spring_rate), stiffness in {
        ("rigid", 0.0): 126058.0,
        ("rigid", 580.0): 125751.6,
        ("motor", 0.0): 11156.4,
        ("motor", 580.0): 10851.7,
    }.items():
        assert hand.tips_on_operator_spring[mass, spring_rate] == pytest.approx((stiffness, stiffness), abs=0.05)
    assert (hand.frequency_alone, hand.frequency_held) == pytest.approx((130.727, 131.079), abs=5e-4)
    assert hand.chart_without_operator.regions
    assert np.all(hand.edge(hand.chart_without_operator)[1] >= -1e-9)


def test_the_rigid_wall():
    assert rigid.free.stiffness_max == pytest.approx(0.686292, abs=5e-7)
    assert rigid.free.stable_area == pytest.approx(12 - 16 * np.log(2), rel=1e-9)
    assert rigid.beta_where_incomplete == pytest.approx(2.311, abs=5e-4)
    assert rigid.beta_where_tip_unstable == pytest.approx(3.659, abs=5e-4)
    assert rigid.tip_of_4_10[0] == pytest.approx(rigid.damped.stiffness_max, rel=1e-12)
    assert rigid.radius_inside_the_tip_below < 1.0 < rigid.radius_inside_the_tip_above
    assert rigid.radius_of_optimistic_wall > 1.0
    assert rigid.conservative_up_to == pytest.approx(0.475, abs=5e-4)


@pytest.mark.parametrize(
    ("samples", "p", "d"),
    [
        (0, 0.686292, 0.828427),
        (1, 0.144469, 0.424694),
        (2, 0.062430, 0.29139),
        (3, 0.034782, 0.22238),
        (5, 0.01535, 0.15116),
    ],
)
def test_delays(samples, p, d):
    assert delay.largest_p[samples] == pytest.approx(p, abs=5e-6)
    assert delay.d_at_largest_p[samples] == pytest.approx(d, abs=1e-5)


def test_the_mass_on_its_spring():
    assert max(spring.error_of_4_44, spring.error_of_4_45, spring.error_of_5_7, spring.error_of_area) < 1e-10
    assert spring.stable_beyond == (True, False, False, False, True, True)
    assert spring.area_with_a_plus == pytest.approx(spring.area, rel=1e-10)


def test_the_models_of_figure_4_4():
    assert models.motor_mass_undamped.stiffness_max == pytest.approx(models.closed_form, rel=1e-11)
    assert models.low_edge_rigid == pytest.approx(models.low_edge, rel=0.05)
    assert models.high_edge_motor_mass == pytest.approx(models.high_edge, rel=0.01)


def test_the_damped_rigid_wall_completed():
    assert completed.error_of_completed < 1e-12
    assert completed.beta_on_the_axis == pytest.approx(3.7208, abs=5e-5)
    for beta in completed.FRICTIONS:
        p, d = completed.tips_by_brute_force[beta]
        assert completed.completed[beta][0] == pytest.approx(p, rel=1e-10)
        assert completed.completed[beta][1] == pytest.approx(d, abs=1e-6)
        assert (completed.printed[beta][0] > 1.0001 * p) == (beta > 3.659)


def test_delays_in_closed_form():
    assert completed.error_of_delayed < 1e-12
    assert completed.delayed[4] == pytest.approx((0.022162, 0.179944), abs=5e-7)
    assert completed.delayed[5] == pytest.approx((0.015354, 0.151154), abs=5e-7)


def test_chapter_4_by_algebra():
    assert (str(algebra.limit_of_eps), str(algebra.limit_of_rest), str(algebra.limit_of_slope)) == (
        "1",
        "1/2",
        "1/2",
    )
    assert all((algebra.as_4_22, algebra.as_4_29, algebra.as_4_32))
    assert all((algebra.as_4_26, algebra.as_4_27, algebra.as_4_28, algebra.as_4_30, algebra.as_4_31))
    assert algebra.as_A_2
    assert algebra.as_A_3
    assert algebra.by_roots == {"stable": 994, "unstable": 2006, "wrong": 0}
    assert not algebra.same(algebra.no_delay[1], algebra.one_sample[1])


def test_the_thesis_transition_matrices():
    assert matrices.error_of_modes < 1e-14
    assert matrices.error_of_modal < 1e-9
    assert matrices.zero < 1e-12 < 0.01 < matrices.non_zero
    assert max(matrices.error_of_damped, matrices.error_of_filtered) < 1e-12
    assert matrices.error_of_filter < 1e-15
    assert max(matrices.error_of_steps, matrices.random_error_of_steps) < 1e-9
    assert max(matrices.error_of_zwidth, matrices.random_error_of_zwidth, matrices.random_error_of_modal) < 1e-9
    assert matrices.random_error_of_modes < 1e-14
    # another wall is another polynomial, and so is another damping
    pair = matrices.thesis
    one = matrices.modal_matrix(pair, 4000.0, 10.0)
    for other in ((pair, 4000.0, 10.01), (pair._replace(r_m=0.51), 4000.0, 10.0)):
        assert matrices.coefficient_distance(one, matrices.modal_matrix(*other)) > 1e-5


def test_a_mass_with_friction_and_one_on_a_spring_by_algebra():
    assert all((damped.as_4_5, damped.as_4_7, damped.as_4_9, damped.as_4_14))
    assert not damped.as_4_9_in_the_scan
    assert damped.error_of_4_10 < 1e-11
    names = ("37", "39", "40", "41", "42", "46")
    assert all(getattr(sprung, f"as_4_{name}") for name in names)
    assert all((sprung.as_5_12, sprung.as_5_13))
    assert sprung.error_of_5_14 < 1e-7


def test_appendix_b():
    for name in ("position", "jacobian", "B_6", "B_7", "B_8", "inverse", "mass", "terms"):
        assert getattr(appendix_b, f"error_of_{name}") < 1e-13
    assert appendix_b.error_of_B_17 > 1.0


def test_appendix_b_on_random_five_bars():
    assert set(drawn.errors) == {"position", "jacobian", "B_6", "B_7", "B_8", "inverse", "mass", "terms"} | {
        "B_17",
        "slope_alone",
        "B_13",
    }
    assert all(drawn.errors[name] < 1e-12 for name in set(drawn.errors) - {"B_17", "slope_alone"})
    assert drawn.error_of_B_13 < 1e-14
    assert min(drawn.least_error_of_B_17, drawn.errors["slope_alone"]) > 0.5
    assert drawn.least_error_of_B_8_with_unequal_arms > 1e-3


def test_a_changed_energy_is_another_lagrange_function():
    """A rod's inertia of one part in a million more, in (B.15) alone, is seen."""
    device, *case = next(drawn.random_cases())
    assert drawn.error_of_lagrange(device, *case) < 1e-12
    at = device.at(case[0]).posture
    links = device.mechanism.links
    mass = links.mass * [1.0, 1.000001, 1.0, 1.0]
    heavier = replace(device, mechanism=replace(device.mechanism, links=replace(links, mass=mass)))
    p = at.angles[[0, 2]]
    torques = [
        drawn.lagrange_function(one.mechanism.links, at.angles).torques(p, *case[1:]) for one in (device, heavier)
    ]
    assert drawn.relative_difference(*torques) > 1e-8


def test_appendix_b_with_other_readings_of_the_masses():
    assert table_3_4.link_side_mass_of_appendix_b == pytest.approx(0.2626, abs=5e-5)
    assert table_3_4.link_side_mass_of_rods_with_offsets == pytest.approx(0.2586, abs=5e-5)


def test_several_directions():
    assert plane.coupling < 1e-10
    assert plane.outside < 1e-7
    assert max(plane.error_of_2_28, plane.error_of_2_34) < 1e-13
    assert plane.frequencies_of_masses == pytest.approx(plane.frequencies_of_full, rel=1e-10)
    assert plane.frequencies_of_masses == pytest.approx(table_3_4.frequencies, rel=1e-8)


def test_spring_stability():
    assert worst.largest_p_on_the_spring == pytest.approx(worst.judged_on_the_spring, rel=1e-10)
    assert worst.largest_p == pytest.approx(worst.judged_at_its_d, rel=1e-10)
    assert worst.passive_p < worst.largest_p < worst.largest_p_on_the_spring < worst.stable_p
    assert 0.99 < worst.worst_radius_inside < 1.0


def test_which_model_where():
    assert where.natural == pytest.approx(130.7272, abs=5e-5)
    assert (where.rigid_below, where.motor_above) == pytest.approx((20.29, 144.9), abs=0.05)
    assert len(where.rigid) == len(where.motor) == 1
    assert where.motor_undamped == ()


def test_chapter_5():
    assert base.ratio_of_stiffness == pytest.approx(3.10, abs=0.005)
    assert base.farthest_apart == pytest.approx(0.4784, abs=2e-4)
    given = {"B": (0.0510576, 0.895606), "C": (0.0602998, 0.872978), "D": (0.0698500, 0.853952)}
    for name, (mass, rho) in given.items():
        assert optimal_mass.optimum[name] == pytest.approx((mass, rho), abs=6e-7)
        assert optimal_mass.by_5_15[name] == pytest.approx(rho, abs=6e-7)
    assert optimal_mass.by_5_15 == pytest.approx(optimal_mass.by_zwidth, rel=1e-14)
