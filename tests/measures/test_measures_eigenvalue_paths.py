"""Paths against eigenvalues at every value, against the edges of the chart, and where eigenvalues meet."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.systems import mass, published, random_loop, reference_transition_matrix, two_mass
from zwidth.chart import stability_chart
from zwidth.errors import NoAnswerError
from zwidth.loop import Controller, Loop
from zwidth.measures import eigenvalue_paths, loop_paths, wall_paths
from zwidth.measures.root_paths import LONG, SHORT

FEATURES = ("lag", "electrical", "estimator")


def random_walls(seed, count):
    """Random loops with a row of dampings and a stiffness that cross many edges."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        kind = ("chain", "dense", "coupled")[i % 3]
        loop = random_loop(rng, kind=kind, features=[name for name in FEATURES if rng.random() < 0.3])
        a, t = loop.plant.actuator, loop.period
        m = 1.0 / float(a @ np.linalg.solve(loop.plant.mass, a))
        yield loop, 10.0 ** rng.uniform(-3.0, 0.3) * m / t**2, np.linspace(-0.2, 1.0, 40) * m / t


def test_every_step_has_the_eigenvalues_and_moves_little():
    for loop, K, B in random_walls(1, 30):
        found = wall_paths(loop, K, B)
        assert_allclose(found.values[found.requested], B)
        assert np.all(np.diff(found.values) > 0.0)
        L = loop.transition_matrix(K, found.values)
        for z, expected in zip(found.eigenvalues, np.linalg.eigvals(L), strict=True):
            # as sets: each has its own
            assert_allclose(np.sort_complex(z.round(9)), np.sort_complex(expected.round(9)), atol=1e-8)
        assert_allclose(found.spectral_radius, np.abs(np.linalg.eigvals(L)).max(axis=-1), rtol=1e-12)
        step = np.abs(np.diff(found.eigenvalues, axis=0))
        assert np.all(step <= np.maximum(SHORT, LONG * np.maximum(np.abs(found.eigenvalues[:-1]), 1.0)))


def test_crossings_are_on_the_circle_and_count_the_roots_outside():
    crossed = 0
    for loop, K, B in random_walls(2, 30):
        found = wall_paths(loop, K, B)
        outside = (np.abs(found.eigenvalues) > 1.0 + 1e-9).sum(axis=1)
        net = sum(1 if one.outwards else -1 for one in found.crossings)
        assert outside[-1] - outside[0] == net
        for one in found.crossings:
            assert abs(abs(one.eigenvalue) - 1.0) < 1e-12
            # by a transition matrix that shares nothing with the package
            other = np.linalg.eigvals(reference_transition_matrix(loop, K, one.value))
            assert np.min(np.abs(other - one.eigenvalue)) < 1e-6
        crossed += len(found.crossings)
    assert crossed > 50


def test_the_edges_of_the_published_chart():
    """Thesis Fig. 5.10: at 4000 N/m damping is stable between 2.42 and 21.66 N s/m."""
    loop = published()
    found = wall_paths(loop, 4000.0, np.linspace(-2.0, 35.0, 30))
    inside = [one for one in found.crossings if one.value > 1.0]
    assert [round(one.value, 2) for one in inside] == [2.41, 2.41, 21.67, 21.67]
    assert [one.outwards for one in inside] == [False, False, True, True]
    # "the eigenvalues leave the unit circle crossing the imaginary axis"
    assert abs(inside[-1].eigenvalue.real) < 0.01
    arcs = stability_chart(loop, decay=False).boundary
    for one in inside:
        where = min(
            np.hypot((arc.stiffness - 4000.0) / 4000.0, (arc.damping - one.value) / one.value).min()
            for arc in arcs
        )
        assert where < 5e-3


def test_a_mass_as_the_number():
    """Thesis Figs. 5.12 to 5.14: the way of the eigenvalues while the motor-side mass grows."""
    at = lambda m: Loop(two_mass(0.2616, m, 15620.0, 0.00012 * 15620.0), Controller(0.00125))  # noqa: E731
    found = loop_paths(at, np.linspace(0.0254, 0.2, 30), 5000.0, 25.0)
    assert found.eigenvalues.shape[1] == 5
    assert found.spectral_radius[0] > 1.0 > found.spectral_radius[-1]
    assert {one.outwards for one in found.crossings} == {False}
    for one in found.crossings:
        z = np.linalg.eigvals(reference_transition_matrix(at(one.value), 5000.0, 25.0))
        assert np.min(np.abs(z - one.eigenvalue)) < 1e-9


def test_pairs_that_meet_are_followed_through():
    """z^2 - z + a: both real up to a = 1/4, conjugate beyond; in between nothing jumps."""
    found = eigenvalue_paths(lambda a: [[0.0, 1.0], [-a, 1.0]], [0.0, 0.9])
    early, late = found.values <= 0.25, found.values > 0.25
    assert np.all(found.eigenvalues[early].imag == 0.0)
    assert np.all(found.eigenvalues[late].imag != 0.0)
    first, second = found.eigenvalues.T
    assert_allclose(first * second, found.values, atol=1e-12)
    assert_allclose(first + second, 1.0, atol=1e-12)
    # each keeps to its side of the real axis once it has chosen
    assert len(set(np.sign(first[late].imag))) == 1
    assert np.abs(np.diff(found.eigenvalues, axis=0)).max() <= LONG


def test_steps_are_halved_where_neighbours_could_be_mistaken():
    """Two pairs that turn by 2.5 rad between the only two values asked for, one forth and one back."""

    def turning(t):
        L = np.zeros((4, 4))
        for at, size, angle in ((0, 0.9, 0.3 + 2.5 * t), (2, 0.5, 2.8 - 2.5 * t)):
            L[at : at + 2, at : at + 2] = size * np.array(
                [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            )
        return L

    found = eigenvalue_paths(turning, [0.0, 1.0])
    assert found.requested.sum() == 2 < len(found.values)
    for z in found.eigenvalues.T:
        assert np.ptp(np.abs(z)) < 1e-12
        assert abs(abs(np.angle(z[-1]) - np.angle(z[0])) - 2.5) < 1e-12


def test_values_may_fall():
    rising = wall_paths(published(), 4000.0, np.linspace(-2.0, 35.0, 30))
    falling = wall_paths(published(), 4000.0, np.linspace(35.0, -2.0, 30))
    ours = [(one.value, one.outwards) for one in rising.crossings]
    theirs = [(one.value, not one.outwards) for one in falling.crossings[::-1]]
    assert_allclose(np.array(ours), np.array(theirs), rtol=1e-9)


def test_what_stays_on_the_circle_crosses_nothing():
    """K = B = 0: the free mass's double root at 1 and a root at 0, along a mass."""
    found = loop_paths(lambda m: Loop(mass(m), Controller(0.001)), [0.1, 0.2, 0.3], 0.0, 0.0)
    assert found.crossings == ()
    assert_allclose(found.spectral_radius, 1.0, atol=1e-7)


def test_what_cannot_be_followed():
    loop = published()
    with pytest.raises(NoAnswerError, match="5 eigenvalues at 0 "):
        loop_paths(lambda late: published(delay=late), [0.0, 1.0], 100.0, 1.0)
    with pytest.raises(NoAnswerError, match="not finite"):
        eigenvalue_paths(lambda a: [[1.0 / a]] if a else [[np.inf]], [-1.0, 0.0])
    with pytest.raises(ValueError, match="finite"):
        wall_paths(loop, 100.0, [0.0, np.inf])
    for values in ([1.0], [0.0, 1.0, 1.0], [[0.0, 1.0]]):
        with pytest.raises(ValueError, match="rising or"):
            eigenvalue_paths(lambda a: [[a]], values)
    with pytest.raises(ValueError, match="one of "):
        wall_paths(loop, [1.0, 2.0], [1.0, 2.0])
