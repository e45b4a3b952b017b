"""Long delays and long windows: loops of high degree, judged by eigenvalues."""

import numpy as np
import pytest

from tests.chart.test_chart_against_eigenvalues import DAMPED, disagreements
from tests.study_sizes import study_size
from tests.systems import published, random_plant
from zwidth.chart import MOST_DEGREE, Tracer, stability_chart, terms_along
from zwidth.chart.edge_by_eigenvalues import decided_trace
from zwidth.chart.nyquist import phase_flags
from zwidth.errors import ChartError
from zwidth.loop import Controller, LeastSquaresSlope, Loop, SavitzkyGolay, WindowedDifference


def long_loop(rng, longest):
    """A delay or a window of 15 samples and more."""
    rate = 10.0 ** rng.uniform(2.3, 4.3)
    n = int(rng.integers(15, longest))
    methods = (WindowedDifference(n), LeastSquaresSlope(n), SavitzkyGolay(n, 2))
    controller = Controller(1.0 / rate, n + float(rng.choice([0.0, 0.3])))
    if rng.random() < 0.6:
        controller = Controller(1.0 / rate, 0.0, velocity=methods[int(rng.integers(3))])
    return Loop(random_plant(rng, rate, DAMPED), controller)


def test_charts_of_long_loops_agree_with_eigenvalues():
    rng = np.random.default_rng(30)
    for _ in range(4):
        assert disagreements(rng, long_loop(rng, 40), count=15) == 0


@pytest.mark.slow
def test_charts_of_hundreds_of_long_loops_agree_with_eigenvalues():
    rng = np.random.default_rng(31)
    given_up = 0
    for _ in range(study_size(continuous=40, full=200)):
        loop = long_loop(rng, 60)
        try:
            assert disagreements(rng, loop, count=15) == 0
        except ChartError:
            given_up += 1
    assert given_up <= 4


def test_the_phase_along_the_circle_counts_what_polynomials_count():
    rng = np.random.default_rng(32)
    for _ in range(20):
        rate = 10.0 ** rng.uniform(2.3, 4.3)
        tracer = Tracer(Loop(random_plant(rng, rate, DAMPED), Controller(1.0 / rate, float(rng.integers(0, 4)))))
        assert not tracer.is_high_degree
        thetas, terms = tracer._circle_samples
        K, B, edge = decided_trace(tracer, thetas)
        walls = np.column_stack([K, B])
        flags = phase_flags(tracer.circle, thetas, terms, tracer.degree, walls, thetas, 0)
        sure = flags != 0
        assert np.mean(sure) > 0.9
        assert np.array_equal(flags[sure] > 0, edge[sure])


def test_terms_along_the_circle_are_those_of_the_loop():
    loop = published(delay=2.3)
    tracer = Tracer(loop)
    thetas = np.linspace(0.1, 3.0, 7)
    A, S, V = terms_along(tracer.circle, thetas).T
    z = np.exp(1j * thetas)
    assert pytest.approx(loop.plant_response(z), rel=1e-12) == S / A
    assert pytest.approx(loop.velocity_response(z), rel=1e-12) == V / S


def test_a_chart_of_a_hundred_samples_of_delay_is_that_of_its_roots():
    loop = published(delay=100.0)
    assert Tracer(loop).degree > MOST_DEGREE
    chart = stability_chart(loop, decay=False)
    K, B = chart.stiffness_max, chart.damping_at_stiffness_max
    inside, outside = (np.abs(np.linalg.eigvals(loop.transition_matrix(s * K, B))).max() for s in (0.9999, 1.0001))
    assert inside < 1.0 < outside
