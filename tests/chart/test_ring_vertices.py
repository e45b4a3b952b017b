"""Every vertex and corner of the rings of random loops has its largest root on the unit circle.

Judged by eigenvalues of matrices built apart; those off by more than 1e-9 again with 40 digits. Plain loops have
delays to 60 samples and all estimators; those with fixed feedback force sensor, feedforward, local loop or all
three, on plants of one to five masses with encoder and motor anywhere.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from tests.apart import ApartLoop
from tests.chart.exact_control import exact_matrices
from tests.chart.exact_radii import exact_joined_excess, exact_radius, joined_excess
from tests.chart.test_fixed_feedback_charts import KINDS
from tests.control_apart import ControlledLoop, random_controlled_loop
from tests.loop.estimators_cases import random_method
from tests.study_sizes import EVERYDAY_SEEDS, outside_case, study_size
from tests.systems import FEATURES, random_loop
from zwidth import load
from zwidth.chart import TracedEdge, stability_chart
from zwidth.chart.arcs import PAIR
from zwidth.chart.loop_edge import walls_off_circle
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop import Controller, Loop
from zwidth.model import Plant

BAND = 1e-9
# Relative: where two roots nearly coalesce, a corner in double precision has no more digits than this.
WALL_DIGITS = 1e-12
LONGEST_DELAY = 60.0
# Walls of an arc that an everyday test judges, both corners among them: of a delay of 60 samples each takes
# milliseconds.
EVERYDAY_WALLS = 20


def long_loop(seed):
    """A loop of any features, with a delay to 60 samples and any estimator."""
    rng = np.random.default_rng([39, seed])
    features = [name for name in FEATURES if rng.random() < 0.3]
    loop = random_loop(rng, kind=str(rng.choice(["chain", "dense", "coupled", "apart"])), features=features)
    T = loop.period
    delay = float(rng.choice([loop.controller.delay, rng.uniform(0.0, LONGEST_DELAY)]))
    return Loop(loop.plant, replace(loop.controller, delay=delay, velocity=random_method(rng, T)))


def controlled_case(kind, seed):
    """A loop with fixed feedback; every other one on a row of up to five masses, encoder and motor anywhere."""
    rng = np.random.default_rng([3939, seed])
    case = random_controlled_loop(rng, *KINDS[kind])
    if seed % 2:
        return case
    n, T = int(rng.integers(1, 6)), case.controller.sampling_period
    masses = 10.0 ** rng.uniform(-2.5, 0.0, n)
    K, B = np.zeros((n, n)), np.diag(masses * 10.0 ** rng.uniform(-3.0, 0.0, n) / T)
    for i in range(n - 1):
        pair = masses[i] * masses[i + 1] / (masses[i] + masses[i + 1])
        rate = 10.0 ** rng.uniform(-2.0, 0.3) / T
        coupling = np.array([[1.0, -1.0], [-1.0, 1.0]])
        K[i : i + 2, i : i + 2] += pair * rate**2 * coupling
        B[i : i + 2, i : i + 2] += pair * rate * rng.choice([0.0, 0.02, 0.5]) * coupling
    motor, encoder, handle = np.eye(n)[rng.integers(n, size=3)]
    plant = Plant(np.diag(masses), B, K, motor, encoder, handle)
    sensor = case.controller.force_sensor
    controller = case.controller
    if sensor is not None:
        controller = replace(controller, force_sensor=replace(sensor, mass_beyond=0.0))
    return ControlledLoop(plant, None, controller)


def is_off(matrix, K, B, band):
    """Whether the largest root of a wall is farther off the circle than a band, in 40 digits, and so is its mean
    with one that it meets; and on the same side those of all walls that differ from it in the last digits that a
    computed wall has.

    matrix  the transition matrix by K and B, as of `exact_matrices`
    """

    def excess(K, B):
        return exact_radius(lambda: matrix(K, B))

    here = excess(K, B)
    if abs(here) <= band or abs(exact_joined_excess(matrix(K, B))) <= band:
        return False
    less, more = 1.0 - WALL_DIGITS, 1.0 + WALL_DIGITS
    beside = [excess(K * k, B * b) for k, b in ((less, 1.0), (more, 1.0), (1.0, less), (1.0, more))]
    return all(np.sign(one) == np.sign(here) and abs(one) > band for one in beside)


def vertices_off(chart, case, matrices, seen, most):
    """Vertices and corners of a chart's rings whose largest root is off the unit circle; what is judged is
    counted.

    case      the loop, as `exact_matrices` takes it
    matrices  L0, LK, LB of its transition matrix in double precision
    most      so many of each arc at most

    K = B = 0 is left out: a free device alone has a double root z = 1, which rounding of its matrix sets apart.
    Roots that meet elsewhere are judged by their mean.
    """
    L0, LK, LB = matrices
    off, exact = [], None
    for arc in chart.boundary:
        count = len(arc.stiffness)
        chosen = np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))
        K, B = arc.stiffness[chosen], arc.damping[chosen]
        K, B = K[(K != 0.0) | (B != 0.0)], B[(K != 0.0) | (B != 0.0)]
        L = L0 + np.multiply.outer(K, LK) + np.multiply.outer(B, LB)
        excess = joined_excess(np.linalg.eigvals(L))
        seen["walls"] += len(K)
        for k in np.flatnonzero(np.abs(excess) > BAND).tolist():
            seen["in 40 digits"] += 1
            band = max(BAND, 10.0 * chart.corner_blur if chart.corner_blur > 1e-7 else 0.0)
            exact = exact or exact_matrices(case)
            if is_off(exact, float(K[k]), float(B[k]), band):
                off.append((float(K[k]), float(B[k]), float(excess[k])))
    return off


def judge(loop, case, matrices, seen, most):
    """The walls that are off on the edge of one loop; a chart that is refused has none."""
    seen["loops"] += 1
    try:
        chart = stability_chart(loop, decay=False)
        off = vertices_off(chart, case, matrices(), seen, most)
    except ChartError:
        seen["refused"] += 1
        return []
    except UnmovedError:
        seen["unmoved"] += 1
        return []
    if chart.unobserved_modes:
        seen["unobserved"] += 1  # what the chart leaves out, the matrix built apart has
        return []
    return off


def judge_long(seed, seen, most=10_000):
    loop = long_loop(seed)
    return judge(loop, loop, lambda: ApartLoop(loop).matrices, seen, most)


def judge_controlled(kind, seed, seen, most=10_000):
    case = controlled_case(kind, seed)
    return judge(case.loop, case, case.matrices, seen, most)


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_no_vertex_of_a_loop_with_a_long_delay_is_off(seed):
    assert judge_long(seed, Counter(), EVERYDAY_WALLS) == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_no_vertex_of_a_loop_with_fixed_feedback_is_off(kind, seed):
    assert judge_controlled(kind, seed, Counter(), EVERYDAY_WALLS) == []


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(study_size(continuous=1, full=20)))
def test_no_vertex_of_thousands_of_loops_with_long_delays_is_off(batch):
    seen, count = Counter(), study_size(continuous=60, full=1_000)
    seeds = range(100 + batch * count, 100 + (batch + 1) * count)
    off = {seed: found for seed in seeds if (found := judge_long(seed, seen))}
    print(dict(seen))
    assert off == {}, seen
    assert seen["refused"] <= max(2, 0.01 * count), seen


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(study_size(continuous=1, full=5)))
@pytest.mark.parametrize("kind", KINDS)
def test_no_vertex_of_thousands_of_loops_with_fixed_feedback_is_off(kind, batch):
    seen, count = Counter(), study_size(continuous=60, full=500)
    seeds = range(100 + batch * count, 100 + (batch + 1) * count)
    off = {seed: found for seed in seeds if (found := judge_controlled(kind, seed, seen))}
    print(dict(seen))
    assert off == {}, seen
    assert seen["refused"] <= max(2, 0.02 * count), seen


CASES = [
    *(pytest.param(lambda seed, kind=kind: controlled_case(kind, seed), id=kind) for kind in KINDS),
    pytest.param(
        lambda seed: (loop := long_loop(seed)) and ControlledLoop(loop.plant, None, loop.controller), id="long"
    ),
]


@pytest.mark.parametrize("case_of", CASES)
@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_a_matrix_in_40_digits_has_the_roots_of_that_in_double_precision(case_of, seed):
    case = case_of(seed)
    L0, LK, LB = case.matrices()
    K, B = 1.0 / np.abs(LK).max(), 1.0 / np.abs(LB).max()
    exact = np.array(exact_matrices(case)(K, B).tolist(), dtype=float)
    outside = 1.5 * np.exp(1j * np.array([0.0, 0.4, 1.9]))[:, None, None] * np.eye(len(L0))  # no root is near
    signs, sizes = np.linalg.slogdet(outside - exact)
    expected_signs, expected_sizes = np.linalg.slogdet(outside - (L0 + K * LK + B * LB))
    np.testing.assert_allclose(sizes, expected_sizes, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(signs, expected_signs, atol=1e-9)


def test_an_arc_that_runs_beyond_its_corner_is_found_off_the_circle():
    """Unstable walls on an edge, as where a branch cuts it between two samples."""
    link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    motor = np.array([0.0, 1.0])
    plant = Plant(np.diag([0.26, 0.025]), 1.9 * link, 15620.0 * link, motor, motor)
    chart = stability_chart(Loop(plant, Controller(0.00125)), decay=False)
    tracer, arcs = chart.edge.tracer, chart.edge.arcs
    assert not len(walls_off_circle(tracer, TracedEdge(arcs, {0: tracer}), True).walls)
    k = int(np.flatnonzero(arcs.kind == PAIR)[0])
    inner = slice(*arcs.offsets[k : k + 2])
    end, beyond = arcs.end.copy(), arcs.last.copy()
    end[k] = arcs.end[k] + 0.2 * (arcs.end[k] - arcs.thetas[inner][0])
    if not 0.0 < end[k] < np.pi:
        end[k] = 0.5 * arcs.end[k]
    beyond[k] = np.array(tracer.walls(end[k : k + 1])).ravel()
    found = walls_off_circle(tracer, TracedEdge(replace(arcs, end=end, last=beyond), {0: tracer}), True)
    assert len(found.walls)
    assert found.distance > BAND


@pytest.mark.outside_cases
@pytest.mark.parametrize("name", ["charts/lens.toml", "charts/far_encoder_local_loop.toml", "stiff/graded.toml"])
def test_no_vertex_of_a_case_is_off_by_the_loops_own_eigenvalues(name):
    chart = stability_chart(load(outside_case(name)).at().loop, decay=False)
    verdicts = chart.check(*np.vstack(chart.regions).T)
    off = np.abs(verdicts.spectral_radius - 1.0) > np.maximum(verdicts.uncertainty, BAND)
    assert not np.any(off)


@pytest.mark.outside_cases
def test_the_wall_of_the_lens_is_not_inside():
    import shapely

    chart = stability_chart(load(outside_case("charts/lens.toml")).at().loop, decay=False)
    assert not any(shapely.Polygon(ring).contains(shapely.Point(0.365152, 0.0231808)) for ring in chart.regions)
