"""Numbers of many charts at once: those of each chart alone, however the work is split."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import FEATURES, mass, published, random_controller, random_loop, random_plant
from zwidth.chart import ALL_NUMBERS, MOST_DEGREE, TracedEdge, Tracer, closed_rings, stability_chart, work_array
from zwidth.chart.chart_batch import STIFFEST, chart_numbers
from zwidth.chart.curve import trace, walls
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, NO_WALL
from zwidth.chart.loop_polynomials import edges_stable_set
from zwidth.chart.wall_samples import HIDDEN
from zwidth.errors import UnmovedError
from zwidth.loop import Loop, table_of_loops

KINDS = ("chain", "dense", "coupled", "apart")


def some_loops(seed, count):
    """Random loops of all kinds that can be charted."""
    rng = np.random.default_rng(seed)
    while count:
        chosen = [name for name in FEATURES if rng.random() < 0.3]
        loop = random_loop(rng, kind=str(rng.choice(KINDS)), features=chosen)
        try:
            degree = Tracer(loop).degree
        except UnmovedError:
            continue
        if degree <= MOST_DEGREE:
            count -= 1
            yield loop


def many_loops(seed, count):
    """A table of plants with several computers, in no order."""
    rng = np.random.default_rng(seed)
    controllers = [random_controller(rng, rate) for rate in 10.0 ** rng.uniform(2.5, 4.0, 3)]
    chosen = [controllers[int(rng.integers(3))] for _ in range(count)]
    return table_of_loops(*(Loop(random_plant(rng, 1.0 / one.sampling_period), one) for one in chosen))


@pytest.mark.parametrize("what", [STIFFEST, ALL_NUMBERS])
def test_numbers_do_not_hang_on_how_the_loops_are_split(what):
    loops, rng = many_loops(40, 60), np.random.default_rng(41)
    whole = chart_numbers(loops, what)
    order = rng.permutation(60)
    for part in np.array_split(order, 7):
        some = loops._replace(
            rows=loops.rows[part].copy(), section_count=loops.section_count[part], computer=loops.computer[part]
        )
        alone = chart_numbers(some, what)
        for together, apart in zip(whole, alone, strict=True):
            assert np.array_equal(together[part], apart, equal_nan=True)


def test_numbers_are_those_of_edges_that_eigenvalues_were_asked_about():
    """The other way to an edge: each open question decided in Python, numbers read off its curves one by one."""
    certain = 0
    for loop in some_loops(42, 30):
        numbers = chart_numbers(table_of_loops(loop))
        if numbers.status[0] == DOUBTFUL:
            continue
        certain += 1
        tracer = Tracer(loop)
        edge = TracedEdge(closed_rings(tracer)[0], {0: tracer})
        assert numbers.area[0] == pytest.approx(edge.area, rel=1e-8, abs=1e-300)
        assert numbers.largest_damping[0] == pytest.approx(
            edge.largest_damping(tracer.stable), rel=1e-9, abs=1e-9 * edge.stiffness_scale * loop.period
        )
        assert (edge.peak is not None) == (numbers.status[0] == FOUND)
        if edge.peak is not None:
            assert numbers.stiffness[0] == pytest.approx(edge.peak.stiffness, rel=1e-10)
            angles = sorted({edge.peak.angles[0], edge.peak.angles[-1]})
            assert sorted({numbers.angles[0, 0], numbers.angles[0, 1]}) == pytest.approx(angles, rel=1e-6)
    assert certain > 20


def test_a_chart_alone_is_a_table_of_one():
    for loop in some_loops(43, 10):
        numbers = chart_numbers(table_of_loops(loop))
        if numbers.status[0] != DOUBTFUL:
            chart = stability_chart(loop, decay=False)
            assert (chart.damping_max, chart.stable_area) == (numbers.largest_damping[0], numbers.area[0])
            if numbers.status[0] == FOUND:
                assert (chart.stiffness_max, chart.damping_at_stiffness_max) == (
                    numbers.stiffness[0],
                    numbers.damping[0],
                )


@pytest.mark.slow
def test_an_excursion_between_two_samples_counts():
    """A least-squares slope over eleven samples: B comes back above 0 between two samples of the curve."""
    rng = np.random.default_rng(11)
    for n in range(2808):
        kind = str(rng.choice(KINDS))
        loop = random_loop(rng, kind=kind, features=[x for x in FEATURES if rng.random() < 0.3 * (n % 2)])
    chart = stability_chart(loop, decay=False)
    assert chart.stable_area == pytest.approx(14445867.2, rel=1e-7)


def test_a_loop_without_stable_wall_has_an_area_of_nothing():
    loop = published(structural=0.0, delay=1.0)
    numbers = chart_numbers(table_of_loops(loop))
    assert numbers.status[0] in (NO_WALL, DOUBTFUL)
    assert stability_chart(loop, decay=False).stable_area == 0.0


def test_a_chart_on_a_smaller_circle_is_no_larger():
    loop = Loop(mass(0.3, 0.5), published().controller)
    areas = [stability_chart(loop, radius, decay=False).stable_area for radius in (1.0, 0.98, 0.9)]
    assert areas[0] > areas[1] > areas[2] > 0.0


def test_lanes_of_samples_are_the_samples_alone():
    for loop in some_loops(44, 6):
        tracer = Tracer(loop)
        thetas = np.sort(np.pi * np.random.default_rng(45).random(300))
        t = np.tan(0.5 * thetas)
        K, B, flags = trace(tracer.circle, tracer.polynomials, t)
        for k in range(0, 300, 29):
            one = walls(tracer.circle, thetas[k : k + 1])
            assert (K[k], B[k]) == (one[0][0], one[1][0])
            assert (K[k], B[k]) == pytest.approx(tracer.wall(float(thetas[k]))[:2], rel=1e-9)
            alone = edges_stable_set(
                tracer.polynomials, tracer.degree, t[k], K[k], B[k], work_array(tracer.degree)
            )
            assert flags[k] in (alone, HIDDEN) or alone == HIDDEN


def test_walls_on_the_curve_have_a_root_there():
    for loop in some_loops(46, 8):
        thetas = np.linspace(0.05, 3.1, 9)
        K, B = walls(Tracer(loop).circle, thetas)
        z = np.exp(1j * thetas)
        P, w = loop.plant_response(z), loop.velocity_response(z)
        sizes = 1.0 + np.abs(P) * (np.abs(K) + np.abs(B * w))
        assert np.all(np.abs(1.0 + P * (K + B * w)) <= 1e-9 * sizes)


def test_memory_that_is_too_small_is_an_answer(monkeypatch):
    monkeypatch.setattr("zwidth.chart.chart_batch.MOST_SAMPLES", 40)
    numbers = chart_numbers(table_of_loops(published()))
    assert numbers.status[0] == DOUBTFUL
    assert np.isnan(numbers.area[0])


def test_a_plant_heavier_a_thousand_times_bears_walls_as_much_stiffer():
    loop = Loop(mass(0.3, 0.02, 50.0), published().controller)
    scaled = {name: 1000.0 * getattr(loop.plant, name) for name in ("mass", "damping", "stiffness")}
    heavy = Loop(replace(loop.plant, **scaled), loop.controller)
    light, more = (chart_numbers(table_of_loops(each)) for each in (loop, heavy))
    assert more.stiffness[0] == pytest.approx(1e3 * light.stiffness[0], rel=1e-12)
    assert more.area[0] == pytest.approx(1e6 * light.area[0], rel=1e-11)
