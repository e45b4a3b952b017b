"""The thesis's closed forms against the exact chart and eigenvalues, over random devices."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conditions.conditions_cases import devices, one_mass
from zwidth.chart import judge, spectral_radius, stability_chart
from zwidth.chart.verdict import STABLE, UNSTABLE
from zwidth.conditions import (
    gil,
    hulin,
    one_mode,
    thesis_damped,
    thesis_flexible,
    thesis_flexible_series,
    thesis_rigid,
    thesis_unit_delay,
    thesis_whole_delay,
)

EXACT = 1e-9


def assert_the_edge_is_exact(loop, K, B):
    """Walls on the edge are on the unit circle; a little less stiff is stable, a little stiffer is not."""
    assert np.max(np.abs(spectral_radius(loop, K, B) - 1.0)) < EXACT
    step = 1e-4 * np.max(np.abs(K))
    assert np.all(judge(loop, K - step, B).verdict == STABLE)
    assert np.all(judge(loop, K + step, B).verdict == UNSTABLE)


def assert_the_numbers_are_exact(chart, source, *numbers):
    assert float(source.largest_stiffness(*numbers)) == pytest.approx(chart.stiffness_max, rel=EXACT)
    # a smooth maximum of K holds its place only to the root of the rounding
    assert float(source.damping_at_largest_stiffness(*numbers)) == pytest.approx(
        chart.damping_at_stiffness_max, rel=1e-7
    )
    assert float(source.largest_damping(*numbers)) == pytest.approx(chart.damping_max, rel=EXACT)


@pytest.mark.parametrize(
    ("source", "delay"), [(thesis_rigid, 0.0), (thesis_unit_delay, 1.0)], ids=["4.14", "4.32"]
)
def test_the_rigid_mass_is_exact(source, delay):
    for m, T, rng in devices(414, 12):
        loop = one_mass(m, T, delay=delay)
        B = rng.uniform(0.02, 0.98, 50) * source.largest_damping(m, T)
        assert_the_edge_is_exact(loop, source.stiffness_limit(B, m, T), B)
        assert_the_numbers_are_exact(stability_chart(loop, decay=False), source, m, T)


@pytest.mark.parametrize("source", [thesis_rigid, thesis_unit_delay])
def test_outside_its_dampings_no_stiffness_is_stable(source):
    for m, T, _ in devices(7, 10):
        top = float(source.largest_damping(m, T))
        B = np.array([-0.1 * top, 0.0, top, 1.1 * top])
        assert np.all(source.stiffness_limit(B, m, T) == 0.0)
        loop = one_mass(m, T, delay=float(source is thesis_unit_delay))
        assert np.all(judge(loop, 1e-3 * m / T**2, B[[0, 3]]).verdict == UNSTABLE)


@pytest.mark.parametrize(
    "span", [(0.01, 0.499), (1.501, 1.97), (2.03, 2.49)], ids=["low", "folded", "twice folded"]
)
def test_the_mass_on_a_spring_is_exact(span):
    """W as a share of pi; beyond 3 pi/2 the same formula brings the stable walls back."""
    for m, T, rng in devices(443, 8):
        k = m * (np.pi * rng.uniform(*span) / T) ** 2
        loop = one_mass(m, T, k=k)
        lowest, highest = -k * T / 2.0, float(thesis_flexible.largest_damping_of_all(m, k, T))
        B = lowest + rng.uniform(0.02, 0.98, 50) * (highest - lowest)
        K = thesis_flexible.stiffness_edge(B, m, k, T)
        assert_the_edge_is_exact(loop, K, B)
        chart = stability_chart(loop, decay=False)
        assert_the_numbers_are_exact(chart, thesis_flexible, m, k, T)
        walls = np.vstack(chart.regions)
        assert np.min(walls[:, 0]) == pytest.approx(-k, rel=1e-8)
        assert np.max(walls[:, 1]) == pytest.approx(highest, rel=1e-8)
        assert np.min(walls[:, 1]) == pytest.approx(lowest, rel=1e-8)


def test_no_wall_between_half_pi_and_three_halves():
    for m, T, rng in devices(444, 25):
        k = m * (np.pi * rng.uniform(0.501, 1.499) / T) ** 2
        chart = stability_chart(one_mass(m, T, k=k), decay=False)
        assert np.isnan(chart.stiffness_max)
        assert thesis_flexible.largest_stiffness(m, k, T) == 0.0
        assert thesis_flexible.largest_damping(m, k, T) == 0.0 == chart.damping_max
        assert thesis_flexible.stable_area(m, k, T) == 0.0
        B = np.linspace(0.0, float(thesis_flexible.largest_damping_of_all(m, k, T)), 20)
        assert np.all(thesis_flexible.stiffness_limit(B, m, k, T) == 0.0)


def test_the_printed_form_of_the_largest_stiffness():
    """(4.44), (5.7) with cos(W/2) as printed: right up to pi/2, wrong where the walls come back."""
    W = np.array([0.1, 0.7, 1.5, 5.0, 6.0])
    printed = (4.0 * (1.0 - np.sqrt(2.0) * np.cos(W / 2.0)) + 2.0 * np.cos(W)) / (1.0 - np.cos(W))
    ours = thesis_flexible.largest_stiffness(1.0, W**2, 1.0) / W**2
    np.testing.assert_allclose(ours[:3], printed[:3], rtol=1e-9)
    assert np.all(printed[3:] > 2.0 * ours[3:])


def test_stable_areas():
    for m, T, rng in devices(55, 8):
        chart = stability_chart(one_mass(m, T), decay=False)
        assert float(thesis_rigid.stable_area(m, T)) == pytest.approx(chart.stable_area, rel=1e-6)
        k = m * (rng.uniform(0.1, 1.4) / T) ** 2
        chart = stability_chart(one_mass(m, T, k=k), decay=False)
        assert float(thesis_flexible.stable_area(m, k, T)) == pytest.approx(chart.stable_area, rel=1e-6)


def test_a_spring_of_no_stiffness_is_the_rigid_mass():
    for m, T, rng in devices(0, 10):
        B = rng.uniform(-0.5, 2.5, 20) * m / T
        rigid = thesis_rigid.stiffness_limit(B, m, T)
        np.testing.assert_allclose(thesis_flexible.stiffness_limit(B, m, 0.0, T), rigid, rtol=1e-12)
        for name in ("largest_stiffness", "damping_at_largest_stiffness", "largest_damping", "stable_area"):
            flexible = getattr(thesis_flexible, name)(m, 0.0, T)
            assert float(flexible) == pytest.approx(float(getattr(thesis_rigid, name)(m, T)), rel=1e-12)


def test_where_every_sample_falls_on_the_same_phase_nothing_is_said():
    k = (2.0 * np.pi) ** 2
    assert np.isnan(thesis_flexible.largest_stiffness(1.0, k, 1.0))
    assert np.isnan(thesis_flexible.stiffness_limit(1.0, 1.0, k, 1.0))


def test_the_rigid_mass_with_friction_is_exact():
    """The whole edge, tip and end, whether the pair or z = -1 binds."""
    for m, T, rng in devices(49, 12):
        b = 10.0 ** rng.uniform(-3, 1.5) * m / T
        loop = one_mass(m, T, b=b)
        chart = stability_chart(loop, decay=False)
        K, B = thesis_damped.largest(b, m, T)
        top = float(thesis_damped.largest_damping(b, m, T))
        assert float(K) == pytest.approx(chart.stiffness_max, rel=EXACT)
        assert float(B) == pytest.approx(chart.damping_at_stiffness_max, rel=1e-7, abs=1e-7 * m / T)
        assert top == pytest.approx(chart.damping_max, rel=EXACT)
        dampings = -b + rng.uniform(0.02, 0.98, 50) * (top + b)
        assert_the_edge_is_exact(loop, thesis_damped.stiffness_limit(dampings, b, m, T), dampings)
        assert np.all(thesis_damped.stiffness_limit([-1.001 * b, 1.001 * top], b, m, T) == 0.0)
        assert np.min(np.vstack(chart.regions)[:, 0]) > -1e-9 * chart.stiffness_max  # no K < 0 is stable


def test_without_friction_4_9_is_4_14():
    for m, T, rng in devices(9, 10):
        B = rng.uniform(-0.5, 2.5, 50) * m / T
        for b in (0.0, 1e-12 * m / T):
            ours = thesis_damped.stiffness_limit(B, b, m, T)
            np.testing.assert_allclose(
                ours, thesis_rigid.stiffness_limit(B, m, T), rtol=1e-10, atol=1e-10 * m / T**2
            )
        assert float(thesis_damped.largest(0.0, m, T)[0]) == pytest.approx(
            float(thesis_rigid.largest_stiffness(m, T)), rel=1e-14
        )


def test_where_4_9_is_incomplete_and_where_its_tip_is_unstable():
    """The root z = -1 cuts into the hyperbola above x = 2.311, off its tip above 3.659, at B = 0 from 3.7208."""

    def cut(x):
        return (
            2.0 * float(thesis_damped.largest_damping(x, 1.0, 1.0))
            < 2.0 / thesis_damped.held_force_response(x).old
        )

    def tip_stands(x):
        p, d = thesis_damped.printed_tip(x, 1.0, 1.0)
        return bool(judge(one_mass(1.0, 1.0, b=x), 0.999 * p, d).verdict == STABLE)

    assert (cut(2.3105), cut(2.3115)) == (False, True)
    assert (tip_stands(3.64), tip_stands(3.68)) == (True, False)
    below, above = (float(thesis_damped.largest(x, 1.0, 1.0)[0]) for x in (3.64, 3.68))
    assert below == pytest.approx(float(thesis_damped.printed_tip(3.64, 1.0, 1.0)[0]))
    assert above < (1.0 - 1e-5) * float(thesis_damped.printed_tip(3.68, 1.0, 1.0)[0])
    # on the axis B = 0 both edges meet at x = 3.7208
    for x, pair_binds in ((3.7207, True), (3.7209, False)):
        n1, n0, _, flip = thesis_damped.held_force_response(x)
        assert ((n1 + n0) * x / n0 < flip) == pair_binds


def test_a_spring_wall_on_friction_is_exact():
    for m, T, rng in devices(49, 60):
        x = 10.0 ** rng.uniform(-3, 2)
        loop = one_mass(m, T, b=x * m / T)
        K = float(thesis_damped.stiffness_limit(0.0, x * m / T, m, T))
        assert abs(spectral_radius(loop, K, 0.0) - 1.0) < EXACT
        assert judge(loop, [0.5 * K, 0.999 * K, 1.001 * K], 0.0).names == ["stable", "stable", "unstable"]


@pytest.mark.parametrize("late", range(7))
def test_the_rigid_mass_is_exact_for_any_whole_delay(late):
    for m, T, rng in devices(426, 4):
        loop = one_mass(m, T, delay=float(late))
        chart = stability_chart(loop, decay=False)
        K, B = thesis_whole_delay.largest(m, T, late)
        top = float(thesis_whole_delay.largest_damping(m, T, late))
        assert float(K) == pytest.approx(chart.stiffness_max, rel=EXACT)
        assert float(B) == pytest.approx(chart.damping_at_stiffness_max, rel=1e-7)
        assert top == pytest.approx(chart.damping_max, rel=EXACT)
        dampings = rng.uniform(0.02, 0.98, 40) * top
        assert_the_edge_is_exact(loop, thesis_whole_delay.stiffness_limit(dampings, m, T, late), dampings)
        outside = thesis_whole_delay.stiffness_limit([-0.1 * top, 0.0, 1.0001 * top, 1.1 * top], m, T, late)
        assert np.all(outside == 0.0)


@pytest.mark.parametrize(
    ("late", "p", "d"),
    [
        (0, 0.68629, 0.82843),
        (1, 0.14447, 0.42469),
        (2, 0.06243, 0.29139),
        (3, 0.03478, 0.22238),
        (4, 0.02216, 0.17994),
        (5, 0.01535, 0.15115),
    ],
)
def test_the_largest_stiffness_by_delay(late, p, d):
    found = [float(v) for v in thesis_whole_delay.largest(1.0, 1.0, late)]
    assert found == [pytest.approx(p, abs=6e-6), pytest.approx(d, abs=6e-6)]


def test_the_frequency_along_the_delayed_edge():
    for late in (0, 1, 3):
        angle = np.linspace(0.05, 0.95, 9) * np.pi / (2 * late + 2)
        p, d = thesis_whole_delay.edge(angle, late)
        found = judge(one_mass(1.0, 1.0, delay=float(late)), p, d).frequency
        np.testing.assert_allclose(found, angle / (2.0 * np.pi), rtol=1e-9)


def convergence_order(error, small):
    """Order of an error in its argument, from halving it."""
    return float(np.log2(error(small) / error(small / 2.0)))


def test_4_12_errs_by_second_order_in_p():
    for x in (0.05, 0.2, 1.0, 3.0):

        def error(p, x=x):
            """Exact less tangent damping at a small p, the exact by one step of interpolation along the edge."""
            low = -x + np.geomspace(1e-9, 1.0, 40001)
            edge = thesis_damped.stiffness_limit(low, x, 1.0, 1.0)
            exact = np.interp(p, edge[: np.argmax(edge)], low[: np.argmax(edge)])
            slope = 1.0 / (thesis_damped.tangent_stiffness_limit(1.0 - x, x, 1.0, 1.0))
            return abs(exact - (slope * p - x))

        assert convergence_order(error, 0.02) == pytest.approx(2.0, abs=0.08)


def test_4_47_errs_by_second_order_and_4_48_by_fourth_in_W():
    def tip(W):
        series = thesis_flexible_series.largest(1.0, W**2, 1.0)[0]
        return abs(float(series / thesis_flexible.largest_stiffness(1.0, W**2, 1.0)) - 1.0)

    def edge(W):
        series = thesis_flexible_series.stiffness_limit(0.5, 1.0, W**2, 1.0)
        return abs(float(series / thesis_flexible.stiffness_limit(0.5, 1.0, W**2, 1.0)) - 1.0)

    def slope(W):
        d = 1e-9
        line = thesis_flexible_series.linear_stiffness_limit(d, 1.0, W**2, 1.0)
        return abs(float(line / thesis_flexible.stiffness_limit(d, 1.0, W**2, 1.0)) - 1.0)

    assert convergence_order(tip, 0.1) == pytest.approx(2.0, abs=0.02)
    assert convergence_order(edge, 0.1) == pytest.approx(2.0, abs=0.02)
    assert convergence_order(slope, 0.4) == pytest.approx(4.0, abs=0.1)


def test_4_48_errs_by_first_order_in_d():
    def error(d):
        line = thesis_flexible_series.linear_stiffness_limit(d, 1.0, 1e-8, 1.0)
        return abs(float(line / thesis_flexible.stiffness_limit(d, 1.0, 1e-8, 1.0)) - 1.0)

    assert convergence_order(error, 0.01) == pytest.approx(1.0, abs=0.01)


def test_the_series_admits_nothing_where_the_spring_is_too_stiff():
    assert float(thesis_flexible_series.largest(1.0, 2.5, 1.0)[0]) == 0.0
    assert np.all(thesis_flexible_series.stiffness_limit([0.1, 0.5], 1.0, 2.5, 1.0) == 0.0)
    assert np.all(thesis_flexible_series.linear_stiffness_limit([0.1, 0.5], 1.0, 2.5, 1.0) == 0.0)
    assert np.isnan(thesis_flexible_series.stiffness_limit(0.1, 1.0, np.nan, 1.0))


def test_the_linear_condition_with_a_hand_errs_by_first_order_in_dampings_and_second_in_W():
    def by_damping(small):
        exact = one_mode.one_mode(1.0, 2.0 * small, 1e-8, 1.0).stiffness_limit(small)
        return abs(float(hulin.stiffness_limit(small, 0.5 * small, 1.5 * small, 1.0) / exact) - 1.0)

    def by_spring(W):
        exact = one_mode.one_mode(1.0, 2e-8, W**2, 1.0).stiffness_limit(1e-8)
        return abs(float(hulin.stiffness_limit(1e-8, 0.0, 2e-8, 1.0) / exact) - 1.0)

    assert convergence_order(by_damping, 0.02) == pytest.approx(1.0, abs=0.05)
    assert convergence_order(by_spring, 0.1) == pytest.approx(2.0, abs=0.02)
    assert by_damping(0.02) < 0.02
    assert by_spring(0.3) < 0.05


@pytest.mark.parametrize(
    ("m", "b", "T", "B", "late", "exact", "linear"),
    [
        (0.1, 0.1, 0.001, 0.0, 0, 200.033, 200.0),
        (0.1, 5.0, 0.01, 0.0, 0, 1090.498, 1000.0),
        (0.1, 0.1, 0.001, 1.0, 0, 2178.48, 2200.0),
        (0.1, 0.1, 0.001, 1.0, 1, 725.387, 733.33),
        (0.03, 1.0, 0.001, 0.0, 0, 2011.17, 2000.0),
    ],
)
def test_literature(m, b, T, B, late, exact, linear):
    assert float(gil.stiffness_limit(B, b, T, late * T)) == pytest.approx(linear, rel=1e-5)
    if late == 0:
        assert float(thesis_damped.stiffness_limit(B, b, m, T)) == pytest.approx(exact, rel=3e-6)
    radius = spectral_radius(one_mass(m, T, b=b, delay=late), np.array([1.0, 1.00002]) * exact * (1 - 1e-5), B)
    assert radius[0] < 1.0 < radius[1]


def test_printed_numbers():
    assert float(thesis_rigid.largest_stiffness(1.0, 1.0)) == pytest.approx(0.686292, abs=5e-7)
    assert float(thesis_rigid.damping_at_largest_stiffness(1.0, 1.0)) == pytest.approx(0.828427, abs=5e-7)
    assert float(thesis_unit_delay.largest_stiffness(1.0, 1.0)) == pytest.approx(0.144469, abs=5e-7)
    assert float(thesis_unit_delay.damping_at_largest_stiffness(1.0, 1.0)) == pytest.approx(0.424694, abs=5e-7)
    assert float(thesis_unit_delay.largest_damping(1.0, 1.0)) == pytest.approx(0.828427, abs=5e-7)
    assert float(thesis_rigid.largest_stiffness(0.287, 0.00125)) == pytest.approx(126058.022906, rel=1e-11)


def stiffness_by_bisection(loop, B, high):
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spectral_radius(loop, middle, B) < 1.0 else (low, middle)
    return low


@pytest.mark.parametrize("late", [0.0, 0.5, 1.0])
def test_the_linear_condition_errs_by_first_order(late):
    """Ten times the sampling rate, a tenth of the relative error."""
    for m, _, rng in devices(417, 4):
        b, B = rng.uniform(0.1, 1.0, 2)
        errors = []
        for d in (0.01, 0.001):
            T = d * m / (b + B)
            linear = float(gil.stiffness_limit(B, b, T, late * T))
            exact = stiffness_by_bisection(one_mass(m, T, b=b, delay=late), B, 2.0 * linear)
            errors.append(abs(exact / linear - 1.0))
        assert errors[0] < 0.01 * (1.0 + late) ** 2
        assert errors[1] < errors[0] / 8.0


def test_the_linear_condition_promises_too_much_without_friction_and_too_little_with_it_alone():
    for m, T, rng in devices(14, 20):
        d = rng.uniform(0.05, 1.5)
        assert gil.stiffness_limit(d * m / T, 0.0, T) > thesis_rigid.stiffness_limit(d * m / T, m, T)
        assert gil.stiffness_limit(0.0, d * m / T, T) < thesis_damped.stiffness_limit(0.0, d * m / T, m, T)


def test_batches_broadcast():
    B, m = np.linspace(-1.0, 3.0, 5), np.array([[0.5], [1.0], [2.0]])
    for limit in (thesis_rigid.stiffness_limit, thesis_unit_delay.stiffness_limit):
        whole = limit(B, m, 1.0)
        assert whole.shape == (3, 5)
        assert whole[2, 3] == limit(B[3], 2.0, 1.0)
    assert thesis_flexible.stiffness_limit(B, m, 0.1, 1.0).shape == (3, 5)
    assert np.isnan(thesis_rigid.stiffness_limit(1.0, np.nan, 1.0))
    assert np.isnan(thesis_unit_delay.stiffness_limit(1.0, np.nan, 1.0))
    assert thesis_damped.stiffness_limit(B, 0.3, m, 1.0).shape == (3, 5)
    assert thesis_whole_delay.stiffness_limit(B, m, 1.0, np.array([0, 3]).reshape(2, 1, 1)).shape == (2, 3, 5)
    for missing in ((np.nan, 0.1, 1.0), (0.1, np.nan, 1.0), (0.1, 0.1, np.nan)):
        assert np.isnan(thesis_damped.stiffness_limit(*missing, 1.0))
    assert np.isnan(thesis_damped.largest(np.nan, 1.0, 1.0)[0])
    assert np.isnan(thesis_whole_delay.stiffness_limit(1.0, np.nan, 1.0, 1))
