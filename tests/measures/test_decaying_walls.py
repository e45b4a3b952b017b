"""The stiffest wall whose vibration decays as fast as wanted: against eigenvalues, over random loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import FEATURES, mass, random_loop, reference_transition_matrix
from zwidth.chart import largest_stiffness, stability_chart
from zwidth.chart.chart_batch import DECAY, STIFFEST, chart_numbers
from zwidth.chart.edge_memory import FOUND, NO_WALL
from zwidth.device.load import load
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop import Controller, Loop, table_of_loops
from zwidth.measures import NO_VALUE, OK

KINDS = ("chain", "dense", "coupled", "apart")


def radius_of(loop, stiffness, damping):
    """Spectral radius of a wall, by a transition matrix that shares nothing with the package."""
    return float(np.abs(np.linalg.eigvals(reference_transition_matrix(loop, stiffness, damping))).max())


def stiffer_walls(loop, peak, damping, largest):
    """Walls that are stiffer than a peak: beside it, far off, and all over the chart's range of damping."""
    shares = 1.0 + np.geomspace(1e-4, 3.0, 12)
    across = np.concatenate([damping * np.linspace(0.9, 1.1, 9), largest * np.linspace(0.0, 1.2, 25)])
    K, B = np.meshgrid(peak * shares, across)
    z = np.linalg.eigvals(loop.transition_matrix(K.ravel(), B.ravel()))
    return np.abs(z).max(axis=-1)


def compare_with_eigenvalues(seed, count):
    """Statuses, and the worst distance of the peak's radius from that of the circle."""
    rng = np.random.default_rng(seed)
    counts, worst = np.zeros(3, dtype=int), 0.0
    for _ in range(count):
        features = [name for name in FEATURES if rng.random() < 0.3]
        loop = random_loop(rng, kind=str(rng.choice(KINDS)), features=features)
        try:
            fastest = chart_numbers(table_of_loops(loop), DECAY)
        except UnmovedError:
            continue
        least = float(fastest.spectral_radius[0])
        if not least < 1.0 - 1e-6:
            continue
        # between the fastest decay of all walls and that of the slowest
        radius = 1.0 - (1.0 - least) * rng.uniform(0.02, 1.1)
        if not 0.0 < radius < 1.0:
            continue
        found = chart_numbers(table_of_loops(loop), STIFFEST, np.array([radius]))
        status = int(found.status[0])
        counts[status] += 1
        if status == NO_WALL and radius < least:
            continue
        try:
            whole = stability_chart(loop, decay=False)
            peak = largest_stiffness(loop, radius)
        except ChartError:
            continue
        if peak is None:
            assert status != FOUND
            continue
        assert peak.stiffness <= whole.stiffness_max * (1.0 + 1e-9)
        if status == FOUND:
            assert found.stiffness[0] == pytest.approx(peak.stiffness, rel=1e-7)
        if not loop.unobserved_modes:
            worst = max(worst, abs(radius_of(loop, peak.stiffness, peak.damping) - radius))
        largest = max(float(ring[:, 1].max()) for ring in whole.regions)
        assert stiffer_walls(loop, peak.stiffness, peak.damping, largest).min() > radius - 1e-7
    return counts, worst


def test_the_stiffest_wall_has_the_wanted_radius_and_no_stiffer_one_a_smaller():
    counts, worst = compare_with_eigenvalues(11, 40)
    assert worst < 1e-5  # a double root moves by the root of the rounding
    assert counts[FOUND] > 15


@pytest.mark.slow
def test_the_same_of_many_loops():
    counts, worst = compare_with_eigenvalues(12, 600)
    assert worst < 1e-4
    assert counts[FOUND] > 200


def test_a_radius_of_one_is_stability_and_a_smaller_one_a_softer_wall():
    point = load("five-bar").at([[0.0, 0.25], [0.05, 0.2], [0.9, 0.9]])
    stable, all_stable = (
        point.measure("stiffness_max_decaying", spectral_radius=1.0),
        point.measure("stiffness_max"),
    )
    np.testing.assert_allclose(stable.values[:2], all_stable.values[:2], rtol=1e-12)
    softer = point.measure("stiffness_max_decaying", spectral_radius=0.99)
    assert np.all(softer.values[:2] < all_stable.values[:2])
    assert softer.values[0] == pytest.approx(point[0].chart(0.99).stiffness_max, rel=1e-9)
    assert softer.status.tolist() == [OK, OK, 1]


def test_a_decay_that_no_wall_has_is_no_value_with_its_reason():
    found = load("five-bar").at([[0.0, 0.25], [0.05, 0.2]]).measure("stiffness_max_decaying", spectral_radius=0.5)
    assert found.status.tolist() == [NO_VALUE, NO_VALUE]
    assert "spectral radius" in found.notes[0].reason
    assert found.notes[0].count == 2


def test_a_free_mass_has_the_radius_of_its_closed_form():
    # backward difference, no delay: the circle rho scales (4.14); checked by the roots of the cubic itself
    one = Loop(mass(0.3), Controller(0.001))
    for radius in (0.99, 0.9, 0.8):
        peak = largest_stiffness(one, radius)
        cubic = np.roots(free_mass_polynomial(0.3, 0.001, peak.stiffness, peak.damping))
        assert np.abs(cubic).max() == pytest.approx(radius, abs=1e-7)


def free_mass_polynomial(m, T, K, B):
    """(z - 1)^2 z + T^2/(2m) (z + 1) (K z + B/T (z - 1)): a mass, a backward difference, a zero-order hold."""
    free = np.polymul([1.0, -2.0, 1.0], [1.0, 0.0])
    wall = T * T / (2.0 * m) * np.polymul([1.0, 1.0], [K + B / T, -B / T])
    return np.polyadd(free, wall)


def test_a_design_with_a_radius_of_its_own_is_the_design_alone():
    loops = [Loop(replace(mass(m)), Controller(0.001)) for m in (0.1, 0.2, 0.4)]
    radii = np.array([0.999, 0.9, 0.8])
    together = chart_numbers(table_of_loops(*loops), STIFFEST, radii)
    alone = [largest_stiffness(loop, radius).stiffness for loop, radius in zip(loops, radii, strict=True)]
    np.testing.assert_allclose(together.stiffness, alone, rtol=1e-12)
