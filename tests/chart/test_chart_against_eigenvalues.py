"""One truth, two routes: the traced chart and eigenvalues of independently built transition matrices."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from tests.systems import mass, random_loop, reference_transition_matrix, two_mass
from zwidth.chart import boundary_points, stability_chart, work_array
from zwidth.chart.loop_polynomials import QUOTIENT, hurwitz
from zwidth.errors import ChartError
from zwidth.loop import Butterworth, CentralDifference, Controller, FirstOrder, Loop

# Damping of real structures; loops with undamped modes have a set of their own, since an undamped mode that the
# wall hardly moves stays within rounding of the circle whatever the wall does.
DAMPED = (0.01, 0.02, 0.05, 0.1, 0.3, 1.0, 1.5)


def spectral_radii(loop, K, B):
    return np.array(
        [
            np.max(np.abs(np.linalg.eigvals(reference_transition_matrix(loop, k, b))))
            for k, b in zip(K, B, strict=True)
        ]
    )


def sample_walls(rng, chart, loop, count):
    """Walls in and about every cell, and walls scattered over the scales of the plant."""
    inertia = 1.0 / (loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))
    size = 10.0 ** rng.uniform(-4.0, 0.3, count)
    K = [inertia / loop.period**2 * size * rng.choice([-0.2, 1.0], count)]
    B = [inertia / loop.period * size * rng.uniform(-1.0, 3.0, count)]
    for ring in chart.regions:
        low, high = ring.min(axis=0), ring.max(axis=0)
        k, b = (low - 0.2 * (high - low) + 1.4 * (high - low) * rng.random((count, 2))).T
        K.append(k)
        B.append(b)
    return np.concatenate(K), np.concatenate(B)


def disagreements(rng, loop, count=30):
    """Walls on which the regions and eigenvalues differ outside the chords' tolerance."""
    chart = stability_chart(loop, decay=False)
    K, B = sample_walls(rng, chart, loop, count)
    inside = np.zeros(len(K), dtype=bool)
    for ring in chart.regions:
        cell = shapely.Polygon(ring)
        assert cell.is_valid
        assert cell.exterior.is_ccw
        inside |= shapely.contains_xy(cell, K, B)
    radius = np.max(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))), axis=-1)
    suspect = ((radius < 1.0) != inside) | (rng.random(len(K)) < 0.02)
    if not suspect.any():
        return 0
    second = spectral_radii(loop, K[suspect], B[suspect])
    clear = np.abs(second - 1.0) > 3e-6
    return int(np.sum(((second < 1.0) != inside[suspect]) & clear))


@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_regions_agree_with_eigenvalues(kind):
    rng = np.random.default_rng(10)
    for _ in range(60):
        assert disagreements(rng, random_loop(rng, DAMPED, kind)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_regions_agree_with_eigenvalues_over_thousands_of_loops(kind):
    rng = np.random.default_rng(11)
    for _ in range(2000):
        assert disagreements(rng, random_loop(rng, DAMPED, kind)) == 0


def test_a_cell_with_an_edge_of_one_angle_is_closed():
    """Where the estimate is all but blind, a whole edge passes within 7e-11 of one angle, to sharp corners."""
    free = two_mass(1.123138284296466, 2.4704904047083764, 48841649.79394397)
    damping = np.array([[146.35935099396968, -48.93965110809506], [-48.93965110809506, 262.86672177309123]])
    stiffness = np.array([[49012013.55136604, -48841649.79394397], [-48841649.79394397, 48841649.79394397]])
    plant = replace(free, damping=damping, stiffness=stiffness)
    low_pass = Butterworth(4, 397.83867578933115, "tustin-prewarped")
    loop = Loop(plant, Controller(0.00040261150977465916, 0.06287673312834141, low_pass))
    assert len(stability_chart(loop).regions) == 2
    assert disagreements(np.random.default_rng(0), loop, 300) == 0


def test_undamped_loops_agree_or_say_that_rounding_hides_the_edge():
    rng = np.random.default_rng(12)
    given_up = 0
    for _ in range(150):
        loop = random_loop(rng)
        try:
            wrong = disagreements(rng, loop)
        except ChartError:
            given_up += 1
        else:
            assert wrong == 0
    assert given_up <= 1


def edge_distances(loop):
    """Distances of boundary points to the nearest eigenvalue, for simple and for nearly double roots."""
    K, B, frequency, edge = boundary_points(loop, 40)
    z = np.exp(2j * np.pi * frequency * loop.period)
    simple, double = [], []
    for k, b, point in zip(K[edge], B[edge], z[edge], strict=True):
        roots = np.linalg.eigvals(loop.transition_matrix(k, b))
        distance = np.abs(roots - point)
        nearest = np.argmin(distance)
        gap = np.min(np.delete(np.abs(roots - roots[nearest]), nearest))
        (simple if gap > 1e-3 else double).append(distance[nearest])
    return simple, double


@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_boundary_points_lie_on_the_unit_circle(kind):
    rng = np.random.default_rng(13)
    simple, double = [], []
    for _ in range(60):
        some, others = edge_distances(random_loop(rng, kind=kind))
        simple += some
        double += others
    assert len(simple) > 200
    assert max(simple) <= 1e-9
    assert max(double, default=0.0) <= 1e-7


def test_every_point_of_the_boundary_edges_the_stable_set():
    # one root on the circle, the rest inside; the reported frequency is that root's
    rng = np.random.default_rng(14)
    for _ in range(40):
        loop = random_loop(rng, DAMPED)
        for arc in stability_chart(loop, decay=False).boundary:
            pick = np.linspace(0, len(arc.stiffness) - 1, 7).astype(int)[1:-1]
            for k, b, f in zip(arc.stiffness[pick], arc.damping[pick], arc.frequency[pick], strict=True):
                roots = np.linalg.eigvals(loop.transition_matrix(k, b))
                assert np.max(np.abs(roots)) <= 1.0 + 1e-6
                assert np.min(np.abs(roots - np.exp(2j * np.pi * f * loop.period))) <= 1e-6


def test_single_modes_up_to_several_times_the_sampling_rate():
    # aliased modes near z = 1 and z = -1 leave slivers between branches
    rng = np.random.default_rng(15)
    for _ in range(150):
        m, T, swing = 10.0 ** rng.uniform(-2.0, 0.0), 10.0 ** rng.uniform(-4.0, -2.3), rng.uniform(0.05, 25.0)
        zeta, delay = rng.choice([0.005, 0.02, 0.05]), float(rng.choice([0.0, 1.0, 2.0, 3.0]))
        k = m * (swing / T) ** 2
        loop = Loop(mass(m, 2.0 * zeta * np.sqrt(k * m), k), Controller(T, delay))
        assert disagreements(rng, loop) == 0


def test_an_outline_that_crosses_itself_within_rounding_is_still_a_cell():
    loop = random_loop(np.random.default_rng(250))
    chart = stability_chart(loop, decay=False)
    assert shapely.unary_union([shapely.Polygon(ring) for ring in chart.regions]).area == pytest.approx(
        252.55, abs=0.01
    )


@pytest.mark.parametrize("friction", [0.0, 1e-12, 1e-9])
@pytest.mark.parametrize("time_constant", [3e-4, 2e-3, 1e-2])
def test_walls_at_infinity_edge_nothing(friction, time_constant):
    """Plant and estimate both vanish at half the sampling rate, and the estimate is in phase somewhere: there the
    curve passes through infinity, where nothing is stable."""
    low_pass = FirstOrder(time_constant)
    loop = Loop(mass(0.03, friction), Controller(0.001, 0.0, low_pass, CentralDifference()))
    chart = stability_chart(loop, decay=False)
    K, B = chart.stiffness_max, chart.damping_at_stiffness_max
    inside, outside = (
        np.abs(np.linalg.eigvals(reference_transition_matrix(loop, s * K, B))).max() for s in (0.999, 1.001)
    )
    assert inside < 1.0 < outside


def test_a_polynomial_with_a_negative_coefficient_is_not_hurwitz_whatever_rounding_hides_of_another():
    room = work_array(3)
    room[QUOTIENT, :4] = [3.4e13, 6.7, -3.4e13, 6.7]
    room[QUOTIENT + 1, :4] = [3.4e13, 8.1e13, 3.4e13, 6.7]
    assert hurwitz(room, QUOTIENT, 3) == -1
