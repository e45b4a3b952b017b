"""A boundary measured on the virtual device falls on the exact one where the device is linear, and leaves it for
reasons that can be named where it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.systems import FEATURES, mass, published, random_loop
from zwidth.chart import spectral_radius
from zwidth.contact import Hand, StabilityTrial, StableExtent, measure_edges, measure_tips, observe
from zwidth.contact.boundary_experiment import SearchWindow, find_stable_walls, tip_dampings
from zwidth.errors import ArgumentError, NoAnswerError
from zwidth.loop import Controller, Foaw, Loop
from zwidth.model import Counter, Friction, Nonlinear, Operator, Plant, attach

ARM = Operator(0.8, 580.0, 5.5, 10000.0, 5.0)
PUBLISHED = StableExtent(7133.87, 9.97, 25.0, True)
RATIOS = (0.01, 0.05, 0.3, 1.0, 1.5)
KINDS = ("chain", "dense", "coupled", "apart")


@pytest.fixture
def rough_search(monkeypatch):
    """The tip is closed in on in one round of four, for tests of edges far below it."""
    monkeypatch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 1)


def edges(trial, stiffness, place=PUBLISHED):
    found = measure_edges(trial, np.array([float(stiffness)]), place)
    return [point.damping for point in found]


def nonlinear(loop, **parts):
    return Loop(replace(loop.plant, nonlinear=Nonlinear(**parts)), loop.controller)


def test_the_published_plant_has_its_published_edges():
    trial = StabilityTrial(published())
    place = find_stable_walls(trial)
    lower, upper = edges(trial, 4000, place)
    assert lower == pytest.approx(2.42, abs=0.01)
    assert upper == pytest.approx(21.66, abs=0.01)
    assert place.stiffness == pytest.approx(7133.869, rel=1e-5)
    assert place.damping == pytest.approx(9.9748, rel=0.01)
    tip = measure_tips(trial, np.array([9.97478812]), place)
    assert tip[0].stiffness == pytest.approx(7133.8692938, rel=2e-5)


SEEDS = [14, 29, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3, 5, 6, 12, 20, 25, 33))]


@pytest.mark.parametrize("seed", SEEDS)
def test_edges_of_random_loops_lie_on_the_unit_circle(rough_search, seed):
    """Just inside each point the roots are inside the unit circle, just outside they are not."""
    rng = np.random.default_rng(seed)
    features = tuple(feature for feature in FEATURES if rng.random() < 0.25)
    loop = random_loop(rng, RATIOS, KINDS[seed % 4], features)
    trial = StabilityTrial(loop)
    place = find_stable_walls(trial)
    points = measure_edges(trial, place.stiffness * np.array([0.3, 0.6, 0.9]), place)
    assert len(points) == 6
    width = max(points[k + 3].damping - points[k].damping for k in range(3))
    for point in points:
        inwards = width * (1.0 if point.edge == "lower" else -1.0)
        radius = spectral_radius(loop, point.stiffness, point.damping + inwards * np.array([1e-3, -1e-3]))
        assert radius[0] < 1.0 < radius[1], point


def test_a_boundary_is_found_whatever_the_units_of_the_device_come_to(monkeypatch):
    monkeypatch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 2)
    for scale, period in ((1e-4, 1e-2), (1e3, 1e-5)):
        place = find_stable_walls(StabilityTrial(Loop(mass(scale), Controller(period)), disturbance=1e-6))
        assert place.stiffness == pytest.approx((12.0 - 8.0 * np.sqrt(2.0)) * scale / period**2, rel=3e-4)


def test_an_estimate_without_a_chart_has_a_boundary_all_the_same(rough_search):
    loop = Loop(published().plant, Controller(0.00125, velocity=Foaw(8, 1e-9)))
    trial = StabilityTrial(loop, visible=1e-5)
    place = find_stable_walls(trial)
    lower, upper = edges(trial, 0.5 * place.stiffness, place)
    assert 0.0 < lower < place.damping < upper


def test_a_one_sided_wall_under_a_push_has_the_edges_of_the_held_loop():
    held = Loop(attach(published().plant, ARM), published().controller)
    trial = StabilityTrial(published(), Hand(ARM, push=2.0), one_sided=True, speed=0.02)
    for damping, outwards in zip(edges(trial, 4000), (-0.05, 0.05), strict=True):
        radius = spectral_radius(held, 4000.0, damping + np.array([-outwards, outwards]))
        assert radius[0] < 1.0 < radius[1]


def test_friction_holds_walls_that_are_linearly_unstable_and_a_larger_disturbance_frees_them():
    rough = nonlinear(published(), friction=(Friction(np.array([0.0, 1.0]), 0.3),))
    wall = [[4000.0, 2.0]]  # below the lower edge, 2.42
    assert not observe(StabilityTrial(published()), wall)[0].stable
    assert observe(StabilityTrial(rough, disturbance=1e-4), wall)[0].stable
    assert not observe(StabilityTrial(rough, disturbance=1e-1), wall)[0].stable
    assert edges(StabilityTrial(rough), 4000)[0] < 2.2


def light():
    """1 g at 20 kHz, dry, counted in micrometres, under half a newton: beyond the edge verdicts come by chance."""
    one = np.ones(1)
    parts = Nonlinear(friction=(Friction(one, 0.002),), counters=(Counter(one, 1e-6),), force_limit=0.5)
    plant = Plant(np.array([[1e-3]]), np.array([[0.01]]), np.zeros((1, 1)), one, one, nonlinear=parts)
    return StabilityTrial(Loop(plant, Controller(5e-5, delay=1.3)), visible=3e-6)


def test_a_wall_stable_by_chance_is_no_tip():
    trial = light()
    place = find_stable_walls(trial)
    assert (
        spectral_radius(trial.linearised().loop, 0.9 * place.stiffness, place.damping) < 1.0
    )  # 94 kN/m was found once, 40 is exact
    walls = np.column_stack([place.stiffness * np.linspace(0.2, 1.0, 9), np.full(9, place.damping)])
    assert all(seen.stable for seen in observe(trial, walls))


def test_a_tip_begun_too_high_is_lowered_and_its_doubts_are_told():
    trial = light()
    B = 5.416666666666666
    lucky = StableExtent(94086.63857236458, B, 10.4, True)
    (tip,) = measure_tips(trial, np.array([B]), lucky)
    exact = brentq(lambda K: spectral_radius(trial.linearised().loop, K, B) - 1.0, 30e3, 50e3)
    assert tip.stiffness == pytest.approx(exact, rel=0.03)
    assert tip.unsure
    assert observe(trial, [[0.999 * tip.stiffness, B]])[0].stable
    assert not any(
        point.unsure for point in measure_tips(StabilityTrial(published()), np.array([9.97]), PUBLISHED)
    )


def test_what_is_too_small_to_be_seen_counts_as_stable():
    stepped = nonlinear(published(), counters=(Counter(np.array([0.0, 1.0]), 1e-4),))
    wall = [[4000.0, 20.5]]
    seen = observe(StabilityTrial(stepped, visible=0.0), wall)[0]
    assert not seen.stable
    assert seen.amplitude < 1e-2
    assert observe(StabilityTrial(stepped, visible=1.1 * seen.amplitude), wall)[0].stable


def test_a_force_limit_takes_walls_away_from_large_motions():
    loop = published(delay=1.0)
    limited = Loop(loop.plant, replace(loop.controller, force_limit=0.1))
    wall = [[600.0, 1.5]]
    print(observe(StabilityTrial(limited, disturbance=0.3), wall))
    assert observe(StabilityTrial(loop, disturbance=0.3), wall)[0].stable
    assert observe(StabilityTrial(limited, disturbance=1e-5), wall)[0].stable
    assert not observe(StabilityTrial(limited, disturbance=0.3), wall)[0].stable


def test_tip_dampings_lie_between_the_edges():
    trial = StabilityTrial(published())
    found = measure_edges(trial, np.array([6000.0, 6600.0]), PUBLISHED)
    chosen = tip_dampings(found, PUBLISHED, 5)
    assert len(chosen) == 5
    assert PUBLISHED.damping in chosen
    assert found[1].damping - 0.5 < chosen.min() < chosen.max() < found[3].damping + 0.5
    assert tip_dampings(found, PUBLISHED, 1).tolist() == [PUBLISHED.damping]


def test_a_box_limits_where_is_looked():
    trial = StabilityTrial(published())
    place = find_stable_walls(trial, SearchWindow((1000.0, 5000.0), (5.0, 15.0)))
    assert 1000.0 < place.stiffness <= 5000.0
    assert 5.0 <= place.damping <= 15.0
    assert not place.bounded
    with pytest.raises(NoAnswerError, match="from 8000 to 9000 N/m"):
        find_stable_walls(trial, SearchWindow((8000.0, 9000.0), (0.0, 30.0)))
    with pytest.raises(ArgumentError, match=r"^stiffness must"):
        find_stable_walls(trial, SearchWindow((9000.0, 8000.0), (0.0, 30.0)))


def test_nothing_stable_is_said():
    undamped = published(structural=0.0, delay=1.0)
    with pytest.raises(NoAnswerError, match="stable wall"):
        find_stable_walls(StabilityTrial(undamped))
