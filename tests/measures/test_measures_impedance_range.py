"""Closed forms of the impedance range against the exact chart over random systems, and where they do not hold."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from tests.systems import mass, two_mass
from zwidth.chart import stability_chart
from zwidth.conditions import thesis_rigid, thesis_unit_delay, thesis_whole_delay
from zwidth.loop import Controller, FirstOrder, Loop, WindowedDifference
from zwidth.measures import rigid_range, sprung_range

EXACT = 1e-9
# A smooth maximum holds its place only to the root of the rounding; the chart's area lies between corners that are
# known to 1e-7.
DAMPING_TOLERANCE, AREA = 1e-7, 1e-7


def devices(seed, count):
    """Masses [kg] and sampling periods [s]."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield 10.0 ** rng.uniform(-2.5, 1.0), 10.0 ** -rng.uniform(np.log10(200.0), np.log10(20000.0)), rng


def assert_the_chart_says_so(found, loop):
    chart = stability_chart(loop, decay=False)
    assert_allclose(found.stiffness_max, chart.stiffness_max, rtol=EXACT)
    assert_allclose(found.damping_at_stiffness_max, chart.damping_at_stiffness_max, rtol=DAMPING_TOLERANCE)
    assert_allclose(found.damping_max, chart.damping_max, rtol=EXACT)
    assert_allclose(found.stable_area, chart.stable_area, rtol=AREA)


@pytest.mark.parametrize("late", [0, 1, 2, 3, 5, 9])
def test_the_rigid_mass_is_exact(late):
    for m, T, _ in devices(50 + late, 8):
        assert_the_chart_says_so(rigid_range(m, T, late), Loop(mass(m), Controller(T, float(late))))


@pytest.mark.parametrize(
    "span", [(0.003, 0.499), (1.501, 1.97), (2.03, 2.49)], ids=["low", "folded", "twice folded"]
)
def test_the_mass_on_a_spring_is_exact(span):
    """W as a share of pi: below pi/2, and again beyond 3 pi/2, where the sampling folds the vibration down."""
    for m, T, rng in devices(57, 15):
        k = m * (np.pi * rng.uniform(*span) / T) ** 2
        assert_the_chart_says_so(sprung_range(m, k, T), Loop(mass(m, stiffness=k), Controller(T)))


def test_between_half_pi_and_three_halves_there_is_no_wall():
    for m, T, rng in devices(58, 10):
        k = m * (np.pi * rng.uniform(0.501, 1.499) / T) ** 2
        found = sprung_range(m, k, T)
        chart = stability_chart(Loop(mass(m, stiffness=k), Controller(T)), decay=False)
        assert np.isnan([chart.stiffness_max, found.stiffness_max, found.damping_at_stiffness_max]).all()
        assert found.damping_max == chart.damping_max == found.stable_area == chart.stable_area == 0.0


def test_what_the_closed_forms_leave_out_changes_the_numbers():
    """Damping, a second mass, a filter, another estimator, part of a sample: none of them is in the formulas."""
    m, k, T = 0.05, 15620.0, 0.00125
    rigid, sprung = rigid_range(m, T).stiffness_max, sprung_range(m, k, T).stiffness_max
    for found, loop in (
        (rigid, Loop(mass(m, damping=2.0), Controller(T))),
        (rigid, Loop(mass(m), Controller(T, 0.5))),
        (rigid, Loop(mass(m), Controller(T, velocity_filter=FirstOrder(T)))),
        (rigid, Loop(mass(m), Controller(T, velocity=WindowedDifference(2)))),
        (sprung, Loop(mass(m, damping=2.0, stiffness=k), Controller(T))),
        (sprung, Loop(two_mass(0.26, m, k), Controller(T))),
    ):
        chart = stability_chart(loop, decay=False)
        assert abs(chart.stiffness_max / found - 1.0) > 0.01


@pytest.mark.parametrize("late", [0.5, -1.0, np.nan, np.inf])
def test_only_whole_delays(late):
    found = rigid_range(1.0, 1.0, late)
    assert np.isnan([found.stiffness_max, found.damping_max, found.stable_area]).all()


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf])
def test_only_numbers_that_can_be(wrong):
    for found in (
        rigid_range(wrong, 1.0),
        rigid_range(1.0, wrong),
        sprung_range(wrong, 1.0, 1.0),
        sprung_range(1.0, 1.0, wrong),
    ):
        assert np.isnan([found.stiffness_max, found.damping_max, found.stable_area]).all()
    assert np.isnan(sprung_range(1.0, wrong, 1.0).stiffness_max) == (wrong != 0.0)
    assert np.isnan(sprung_range(1.0, (2.0 * np.pi) ** 2, 1.0).damping_max)  # every sample at the same phase


def test_arrays_of_any_shape():
    rng = np.random.default_rng(5)
    m, k, T, late = rng.uniform(0.01, 1.0, (3, 1)), rng.uniform(1e3, 1e5, (2, 1, 4)), 0.001, [0, 1, 2, 0.5]
    for batch, one in (
        (rigid_range(m, T, late), lambda i: rigid_range(m[i[0], 0], T, late[i[1]])),
        (sprung_range(m, k, T), lambda i: sprung_range(m[i[1], 0], k[i[0], 0, i[2]], T)),
    ):
        for name in ("stiffness_max", "damping_at_stiffness_max", "damping_max", "stable_area"):
            values = getattr(batch, name)
            assert values.shape in ((3, 4), (2, 3, 4))
            for index in np.ndindex(values.shape):
                assert_allclose(values[index], getattr(one(index), name), rtol=1e-14)


def test_without_a_spring_it_is_the_rigid_mass():
    m = np.array([0.01, 0.3, 4.0])
    for name in ("stiffness_max", "damping_at_stiffness_max", "damping_max", "stable_area"):
        ours = getattr(sprung_range(m, 0.0, 0.001), name)
        assert_allclose(ours, getattr(rigid_range(m, 0.001), name), rtol=1e-12)


@pytest.mark.parametrize("late", [0, 1, 2])
def test_the_area_by_computer_algebra(late):
    """p and d of (4.26) are rational in cos t: sin(l t) = sin t U_{l-1}(cos t), tan^2(t/2) = (1 - c)/(1 + c)."""
    c = sp.symbols("c", positive=True)
    p = 4 * (1 - c) / (1 + c) * sp.chebyshevt(late + 1, c)
    d = 2 * ((1 - c) / (1 + c) * sp.chebyshevt(late, c) + (1 - c) * (sp.chebyshevu(late - 1, c) if late else 0))
    whole = sp.integrate(sp.apart(sp.together(p * sp.diff(d, c)), c), c)
    area = whole.subs(c, sp.cos(sp.pi / (2 * late + 2))) - whole.subs(c, 1)
    assert_allclose(thesis_whole_delay.stable_area(1.0, 1.0, late), float(sp.N(area, 30)), rtol=1e-14)
    by_hand = {0: thesis_rigid.stable_area, 1: thesis_unit_delay.stable_area}
    if late in by_hand:
        assert_allclose(by_hand[late](0.3, 0.002), float(sp.N(area, 30)) * 0.3**2 / 0.002**3, rtol=1e-11)


def test_the_area_where_hardly_a_wall_is_left():
    """c^2/2 + c - (1 + c) ln(1 + c) is c^3/6 there, which the three terms would lose."""
    for c in (1e-7, 1e-3, 0.0999, 0.1001, 0.9):
        exact = float(
            sp.N(sp.Rational(c) ** 2 / 2 + sp.Rational(c) - (1 + sp.Rational(c)) * sp.log(1 + sp.Rational(c)), 40)
        )
        W = float(np.arccos(c))
        # the cosine of a rounded W is c to 1e-16 only
        assert_allclose(
            sprung_range(1.0, W**2, 1.0).stable_area, 2.0 * W**4 / (1.0 - c) ** 2 * exact, rtol=1e-11 + 1e-15 / c
        )


def test_the_thesis_in_figures():
    """(5.4) and (5.6) print 0.686, 2, 0.144 and 0.828; (5.5) is misprinted."""
    found = rigid_range(1.0, 1.0, [0, 1])
    assert found.stiffness_max.round(3).tolist() == [0.686, 0.144]
    assert found.damping_max.round(3).tolist() == [2.0, 0.828]
    assert found.stable_area[0] == pytest.approx(12.0 - 16.0 * np.log(2.0), rel=1e-14)
