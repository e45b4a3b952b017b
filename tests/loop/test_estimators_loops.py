"""Charts of loops with every velocity estimator against eigenvalues of independently built transition matrices."""

from dataclasses import replace

import numpy as np
import pytest

from tests.chart.test_chart_against_eigenvalues import DAMPED, disagreements, spectral_radii
from tests.loop.estimators_cases import random_method
from tests.systems import mass, random_loop
from zwidth.chart import judge, largest_stiffness, stability_chart
from zwidth.chart.verdict import STABLE, UNSTABLE
from zwidth.loop import (
    LINEAR_METHODS,
    Controller,
    LeastSquaresSlope,
    Loop,
    SavitzkyGolay,
    WindowedDifference,
    relative_response,
)


def loops_of(name, rng, count, longest=16):
    """Random loops whose velocity is estimated by one method of random parameters; some filter it besides."""
    while count:
        loop = random_loop(rng, DAMPED, str(rng.choice(["chain", "dense", "coupled", "apart"])))
        method = random_method(rng, loop.period, longest)
        if isinstance(method, LINEAR_METHODS[name]):
            count -= 1
            yield Loop(loop.plant, replace(loop.controller, velocity=method))


@pytest.mark.parametrize("name", LINEAR_METHODS)
def test_the_regions_agree_with_eigenvalues(name):
    rng = np.random.default_rng(20)
    for loop in loops_of(name, rng, 12):
        assert disagreements(rng, loop, 20) == 0, loop.controller


@pytest.mark.slow
@pytest.mark.parametrize("name", LINEAR_METHODS)
def test_the_regions_agree_with_eigenvalues_over_many_loops(name):
    rng = np.random.default_rng(21)
    for loop in loops_of(name, rng, 300, longest=40):
        assert disagreements(rng, loop, 20) == 0, loop.controller


@pytest.mark.parametrize("name", LINEAR_METHODS)
def test_verdicts_agree_with_eigenvalues(name):
    rng = np.random.default_rng(22)
    for loop in loops_of(name, rng, 12):
        inertia = 1.0 / (loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))
        size = 10.0 ** rng.uniform(-4.0, 0.3, 12)
        K = inertia / loop.period**2 * size * rng.choice([-0.2, 1.0], 12)
        B = inertia / loop.period * size * rng.uniform(-1.0, 3.0, 12)
        said, radius = judge(loop, K, B).verdict, spectral_radii(loop, K, B)
        clear = np.abs(radius - 1.0) > 1e-6
        np.testing.assert_array_equal(said[clear], np.where(radius < 1.0, STABLE, UNSTABLE)[clear])


@pytest.mark.parametrize("name", LINEAR_METHODS)
def test_the_loops_velocity_is_the_methods(name):
    rng = np.random.default_rng(23)
    for loop in loops_of(name, rng, 5):
        loop = Loop(loop.plant, replace(loop.controller, velocity_filter=None))
        f = rng.uniform(0.0, 0.5, 9) / loop.period
        s = 2j * np.pi * f
        want = relative_response(loop.controller.velocity, loop.period, f) * s
        np.testing.assert_allclose(loop.velocity_response(np.exp(s * loop.period)), want, rtol=1e-9)


def test_a_long_window_is_charted():
    rng = np.random.default_rng(24)
    loop = Loop(mass(0.3, 2.0), Controller(0.0002, velocity=WindowedDifference(40)))
    chart = stability_chart(loop, decay=False)
    assert chart.stiffness_max == pytest.approx(largest_stiffness(loop).stiffness, rel=1e-8)
    assert disagreements(rng, loop) == 0


def test_estimates_of_one_phase_reach_one_stiffness():
    # K = Re(-1/P) - Im(-1/P) Re w/Im w on the edge: the gain of w scales B and leaves K alone
    same = (WindowedDifference(8), LeastSquaresSlope(9), SavitzkyGolay(9, 4, centred=True))
    peaks = [largest_stiffness(Loop(mass(0.3, 0.5), Controller(0.001, velocity=method))) for method in same]
    assert [peak.stiffness for peak in peaks] == pytest.approx([peaks[0].stiffness] * 3, rel=1e-11)
    f = peaks[0].angles[0] / (2.0 * np.pi * 0.001)
    shown = np.array(
        [peak.damping * abs(relative_response(m, 0.001, f)) for peak, m in zip(peaks, same, strict=True)]
    )
    np.testing.assert_allclose(shown, shown[0], rtol=1e-6)
