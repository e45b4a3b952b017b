"""Produced devices against closed forms: probability, quantiles, bands, indices, narrower tolerances."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest

import zwidth
from tests.study.tolerance_cases import MASS, PERIOD, STIFFEST, free_mass, least_mass, radius, uniform
from tests.study_sizes import EVERYDAY_SEEDS, study_size
from zwidth.show import band_path
from zwidth.study import EdgeJob, JobSeries, count_bounds, run_job, run_tolerances, shares_of, tolerance
from zwidth.study.tolerances.result import tightened
from zwidth.study.tolerances.tolerance_study import UNSEEN, answer

MASSES = {"plant.mass_kg": uniform(20.0)}
BOTH = {"plant.mass_kg": uniform(20.0), "loop.sampling_period_s": uniform(5.0)}
WALL = {"stiffness": 62_000.0, "damping": 90.0}
DELAYED_WALL = 55_000.0, 80.0


def drawn_masses(count, seed=1):
    return MASS * (0.8 + 0.4 * shares_of("plant.mass_kg", seed, count))


@pytest.fixture(scope="module")
def found():
    return tolerance(free_mass(), MASSES, **WALL, samples=400, index_samples=0)


@cache
def few_masses():
    return tolerance(free_mass(), MASSES, samples=72, index_samples=0)


def test_the_probability_of_a_wall_is_that_of_a_mass_large_enough(found):
    needed = least_mass(*WALL.values())
    truth = (1.2 * MASS - needed) / (0.4 * MASS)
    assert 0.3 < truth < 0.9
    assert found.probability.low < truth < found.probability.high
    # and of the drawn devices, exactly those that are heavy enough
    heavy = int((drawn_masses(400) > needed).sum())
    assert found.outcomes == {"stable": heavy, "unstable": 400 - heavy}


def test_quantiles_are_those_of_the_masses(found):
    stiffest = STIFFEST * np.sort(drawn_masses(400)) / PERIOD**2
    (measured,) = found.quantiles
    assert (measured.name, measured.devices) == ("stiffness_max", 400)
    for one, rank in zip(measured.quantiles, (20, 200, 380), strict=True):
        assert one.interval.value == pytest.approx(stiffest[rank - 1], rel=1e-9)
        assert one.interval.low < one.interval.value < one.interval.high
        truth = STIFFEST * MASS * (0.8 + 0.4 * one.share) / PERIOD**2
        assert one.interval.low < truth < one.interval.high


def test_a_band_is_the_chart_of_the_mass_that_so_many_devices_exceed(found):
    masses = np.sort(drawn_masses(400))[::-1]
    for band in found.bands:
        assert band.members == count_bounds(band.probability, 400)[1]
        mass = masses[band.members - 1]  # so many are as heavy or heavier, and a heavier one renders more
        limit = STIFFEST * mass / PERIOD**2
        assert limit * (1.0 - 1e-3) < band.stiffest.stiffness <= limit * (1.0 + 1e-6)
        inside = 0
        for B, pieces in zip(band.dampings.tolist()[1::7], band.pieces[1::7], strict=True):
            for low, high in pieces:
                size = 1e-5 * limit
                assert radius(mass, PERIOD, high - size, B) < 1.0 < radius(mass, PERIOD, high + size, B)
                assert low < size or radius(mass, PERIOD, low + size, B) < 1.0
                inside += 1
        assert inside > 10


def test_bands_of_a_free_mass_are_drawn_down_to_where_they_begin(found):
    masses = np.sort(drawn_masses(400))[::-1]
    for band in found.bands:
        path, mass = band_path(band), masses[band.members - 1]
        for B in np.array([5e-4, 1e-3, 1e-2, 1e-1]) * band.dampings[-1]:
            low, high = 0.0, STIFFEST * mass / PERIOD**2
            for _ in range(60):
                K = 0.5 * (low + high)
                low, high = (K, high) if radius(mass, PERIOD, K, B) < 1.0 else (low, K)
            assert path.contains_point((0.97 * low, B)), (band.probability, B)
            assert not path.contains_point((1.03 * low, B)), (band.probability, B)


def test_a_band_counts_devices_by_eigenvalues_where_regions_are_not_nested():
    device = zwidth.load("published-two-mass")
    numbers = {
        "plant.mass_kg.0.0": uniform(30.0),
        "plant.mass_kg.1.1": uniform(30.0),
        "loop.delay_samples": {"distribution": "uniform", "low": 0.1, "high": 0.9},
    }
    found = tolerance(device, numbers, samples=80, index_samples=0)
    loops = [found.job.design(n).point().loop for n in range(80)]
    for band in found.bands:
        walls = [
            (low + share * (high - low), B)
            for B, pieces in zip(band.dampings[3::25].tolist(), band.pieces[3::25], strict=True)
            for low, high in pieces
            for share in (1e-5, 0.5, 1.0 - 1e-5, 1.0 + 1e-5)
        ]
        K, B = np.array(walls).T
        counts = sum((loop.check(K, B).spectral_radius < 1.0).astype(int) for loop in loops).reshape(-1, 4)
        assert len(counts) > 3
        assert (counts[:, :3] >= band.members).all()
        assert (counts[:, 3] < band.members).mean() > 0.9  # just beyond an end, unless another piece touches there


def test_the_unseen_devices_are_others_and_as_likely(found):
    band = found.bands[0]
    for wall in (band.stiffest, band.certain):
        truth = (1.2 * MASS - least_mass(wall.stiffness, wall.damping)) / (0.4 * MASS)
        assert wall.share.low < truth < wall.share.high
        assert wall.unseen == 400
    needed = least_mass(band.certain.stiffness, band.certain.damping)
    assert (drawn_masses(400) > needed).sum() == pytest.approx(count_bounds(0.95, 400)[0], abs=1)
    unseen = MASS * (0.8 + 0.4 * shares_of("plant.mass_kg", 1, 400, UNSEEN))
    assert band.certain.share.value == np.mean(unseen > needed)
    assert band.certain.stiffness < band.stiffest.stiffness < band.high


def closed_form_indices():
    """Sobol's indices of K_max = c m / T^2: a product, so Var = E[f^2] E[g^2] - E[f]^2 E[g]^2."""
    m = np.linspace(0.8, 1.2, 200_001)
    T = np.linspace(0.95, 1.05, 200_001)
    f, g = [m.mean(), (m**2).mean()], [(T**-2.0).mean(), (T**-4.0).mean()]
    whole = f[1] * g[1] - (f[0] * g[0]) ** 2
    first = (f[1] - f[0] ** 2) * g[0] ** 2 / whole, (g[1] - g[0] ** 2) * f[0] ** 2 / whole
    return first, (1.0 - first[1], 1.0 - first[0])


def test_indices_of_a_product_are_those_in_closed_form():
    found = tolerance(free_mass(), BOTH, samples=72, index_samples=1024)
    outcome = next(one for one in found.indices if one.name == "stiffness_max")
    first, total = closed_form_indices()
    for one, own, whole in zip(outcome.indices, first, total, strict=True):
        assert one.first.low < own < one.first.high
        assert one.total.low < whole < one.total.high
        assert one.first.value == pytest.approx(own, abs=0.02)
        assert one.total.value == pytest.approx(whole, abs=0.02)
        assert one.first_is_certain
        assert one.total_is_certain


def test_an_outcome_that_never_changes_has_no_index_and_a_number_without_effect_none_for_certain():
    numbers = {**MASSES, "loop.saturation.force_N": {"distribution": "uniform", "low": 1.0, "high": 2.0}}
    found = tolerance(free_mass(), numbers, samples=72, index_samples=64)
    by_name = {one.name: one for one in found.indices}
    assert by_name["has_stable_wall"].indices == ()
    assert by_name["has_stable_wall"].reason.endswith(" all 256 devices")
    mass, force = by_name["stiffness_max"].indices
    assert mass.total_is_certain
    assert not force.total_is_certain
    assert abs(force.first.value) < 1e-9
    assert found.probability is None
    assert found.tightened == ()


def test_half_a_tolerance_moves_the_yield_as_far_as_the_mass_says():
    found = tolerance(free_mass(), BOTH, **WALL, samples=300, index_samples=0)
    by_key = {one.key: one for one in found.tightened}
    masses = drawn_masses(300)
    periods = PERIOD * (0.95 + 0.1 * shares_of("loop.sampling_period_s", 1, 300))
    # the wall's least mass at each period, by interpolation between exact ones
    T = np.linspace(0.95, 1.05, 21) * PERIOD
    exact = [least_mass(*WALL.values(), period) for period in T]
    least = np.interp(periods, T, exact)
    assert by_key["plant.mass_kg"].share.value == pytest.approx(np.mean(0.5 * (masses + MASS) > least), abs=0.004)
    least_narrow = np.interp(0.5 * (periods + PERIOD), T, exact)
    narrow = by_key["loop.sampling_period_s"]
    assert narrow.share.value == pytest.approx(np.mean(masses > least_narrow), abs=0.004)
    assert narrow.gain.value == pytest.approx(narrow.share.value - found.probability.value, abs=1e-12)


def test_a_certain_gain_is_named_and_two_alike_are_not_told_apart():
    before = np.arange(400) < 300
    better, alike, useless = np.arange(400) < 380, np.arange(400) < 368, np.roll(before, 2)
    found = tightened(["b", "a", "u"], before, np.array([better, alike, useless]))
    assert [one.key for one in found] == ["b", "a", "u"]
    assert [one.is_certain for one in found] == [True, True, False]
    assert [one.may_be_best for one in found] == [True, False, False]  # none is stable by the second only
    swapped = np.concatenate([np.arange(376) < 376, [False] * 20, [True] * 4]).astype(bool)
    found = tightened(["b", "s"], before, np.array([better, swapped]))
    assert [one.may_be_best for one in found] == [True, True]


def judge_middle(seed: int) -> str:
    """A random mass and a random wall, sampling period and mass with tolerances: the device in the middle is
    judged by roots, and no tolerance is named where it is not stable. Returns its outcome."""
    rng = np.random.default_rng(seed)
    spread = {"distribution": "uniform", "plus_minus_percent": float(rng.uniform(5.0, 40.0))}
    low = MASS * float(rng.uniform(0.3, 1.0))
    masses = {"distribution": "uniform", "low": low, "high": low + MASS * float(rng.uniform(0.1, 1.5))}
    K = STIFFEST * MASS / PERIOD**2 * float(rng.uniform(0.2, 1.5))
    B = float(rng.uniform(30.0, 120.0))
    found = tolerance(
        free_mass(),
        {"plant.mass_kg": masses, "loop.sampling_period_s": spread},
        stiffness=K,
        damping=B,
        samples=72,
        index_samples=0,
    )
    middle = 0.5 * (masses["low"] + masses["high"])
    stable = radius(middle, PERIOD, K, B) < 1.0
    assert found.middle == ("stable" if stable else "unstable")
    document = found.document()
    assert document["middle"] == found.middle
    assert (document["tighten_first_reason"] is None) == bool(document["tighten_first"])
    if not stable:
        assert document["tighten_first"] == []
    return found.middle


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_where_the_middle_is_unstable_no_tolerance_is_to_be_tightened(seed):
    judge_middle(seed)


@pytest.mark.slow
def test_where_the_middle_is_unstable_no_tolerance_is_to_be_tightened_of_many():
    outcomes = [judge_middle(seed) for seed in range(study_size(continuous=30, full=100))]
    assert set(outcomes) == {"stable", "unstable"}


def delayed_radius(mass: float, delay: float, K: float, B: float) -> float:
    """Spectral radius of a free mass at a wall whose force comes a part 0 <= delay < 1 of a sample late: the state
    is position, velocity, last force and last position; the old force acts for the first part of the period."""
    T, late, rest = PERIOD, delay * PERIOD, (1.0 - delay) * PERIOD
    force = np.array([-K - B / T, 0.0, 0.0, B / T])
    old, place = np.array([0.0, 0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])
    position = place + [0.0, T, 0.0, 0.0] + (0.5 * (T**2 - rest**2) * old + 0.5 * rest**2 * force) / mass
    velocity = [0.0, 1.0, 0.0, 0.0] + (late * old + rest * force) / mass
    return float(np.abs(np.linalg.eigvals(np.array([position, velocity, force, place]))).max())


def test_no_tolerance_is_named_where_a_delay_makes_the_wall_unstable_in_the_middle():
    """The file has no delay, and its wall is stable: the middle of the tolerances is elsewhere."""
    K, B = DELAYED_WALL
    assert delayed_radius(MASS, 0.0, K, B) < 1.0 < delayed_radius(MASS, 0.15, K, B)
    delay = {"distribution": "uniform", "low": 0.0, "high": 0.3}
    numbers = {"loop.delay_samples": delay, "plant.mass_kg": uniform(10.0)}
    found = tolerance(free_mass(), numbers, stiffness=K, damping=B, samples=100, index_samples=0)
    assert 0.0 < found.probability.value < 1.0
    assert found.middle == "unstable"
    assert found.best_to_tighten == ()
    assert found.document()["tighten_first"] == []
    assert found.no_advice is not None


def test_devices_without_a_stable_wall_are_an_outcome_and_their_stiffness_is_zero():
    # a spring pushes the mass away: some devices fall over whatever the wall
    device = free_mass(plant={"mass_kg": MASS, "damping_Ns_per_m": -0.5})
    law = {"distribution": "uniform", "low": -200.0, "high": 60.0}
    found = tolerance(device, {"plant.damping_Ns_per_m": law}, samples=200, index_samples=128)
    none = found.without_stable_wall
    assert 0 < none < 200
    assert found.outcomes == {"with a stable wall": 200 - none, "without a stable wall": none}
    assert found.quantiles[0].quantiles[0].interval.value == 0.0
    assert found.quantiles[0].devices == 200
    by_name = {one.name: one for one in found.indices}
    for name in ("has_stable_wall", "stiffness_max"):
        (index,) = by_name[name].indices
        assert index.total.value == pytest.approx(1.0, abs=0.1)


def test_measures_without_a_value_have_no_index_but_one_of_having_it():
    found = tolerance(
        zwidth.load("five-bar"),
        {"links.distal-right.length_m": uniform(30.0)},
        "isotropy",
        position=(0.0, 0.3),
        samples=72,
        index_samples=32,
        stiffness=1000.0,
        damping=9.0,
    )
    assert found.outcomes["out of reach"] > 5
    assert found.probability.value == found.outcomes["stable"] / 72
    by_name = {one.name: one for one in found.indices}
    assert by_name["isotropy"].indices == ()
    assert "no value" in by_name["isotropy"].reason
    assert by_name["has_value(isotropy)"].indices[0].total_is_certain
    assert all(np.isfinite(one.first.value) for each in found.indices for one in each.indices)
    assert found.uncharted == found.outcomes["out of reach"]


def test_no_device_at_all_is_a_reason():
    lengths = {"links.distal-right.length_m": uniform(1.0)}
    found = tolerance(zwidth.load("five-bar"), lengths, position=(0.0, 0.9), samples=72, index_samples=0)
    assert found.reason.rpartition(": 72 ")[2] == "out of reach"
    assert found.bands == ()


def test_another_tolerance_changes_no_draw_and_more_devices_begin_with_the_same():
    device = free_mass()
    few = few_masses()
    more = tolerance(device, BOTH, samples=90, index_samples=0)
    masses = [more.job.design(n).settings["plant.mass_kg"] for n in range(72)]
    assert masses == [few.job.design(n).settings["plant.mass_kg"] for n in range(72)]
    other = tolerance(device, MASSES, samples=72, index_samples=0, seed=2)
    assert other.job.design(0).settings["plant.mass_kg"] != masses[0]


class Finished:
    """A job all of whose cells are in its store: computing one is a failure."""

    def __init__(self, job):
        self.job = job

    def __getattr__(self, name):
        return getattr(self.job, name)

    def compute(self, first, last):
        raise AssertionError(f"cells {first} to {last} were computed already")


def test_the_same_question_has_the_same_answer_bit_for_bit_whoever_computes_and_from_where(tmp_path):
    found = tolerance(free_mass(), BOTH, **WALL, samples=72, index_samples=32)
    question, whole = found.question, json.dumps(found.document())
    compute = JobSeries(tmp_path / "kept").compute

    def until_edges(name, job, stage):
        if name == "edges-1":
            raise KeyboardInterrupt
        return compute(name, job, stage)

    with pytest.raises(KeyboardInterrupt):
        answer(question, until_edges)
    kept = sorted(inside.name for inside in (tmp_path / "kept").iterdir() if inside.is_dir())
    assert kept == ["devices", "edges-0"]
    done = {"devices", "edges-0"}
    going_on = answer(
        question, lambda name, job, stage: compute(name, Finished(job) if name in done else job, stage)
    )
    assert json.dumps(going_on.document()) == whole
    assert json.dumps(run_tolerances(question).document()) == whole
    batches = answer(question, lambda name, job, stage: run_job(job, batch=7))
    assert json.dumps(batches.document()) == whole


def test_processes_compute_the_same_edges():
    job = EdgeJob(few_masses().job, np.linspace(0.0, 100.0, 5))
    alone, shared = run_job(job), run_job(job, batch=9, workers=2, patience=0.0)
    assert np.array_equal(alone.values, shared.values)
    assert alone.values.any()


def test_results_know_their_columns_and_their_dataset(found):
    table = found.table()
    assert list(table) == [
        "plant.mass_kg",
        "stiffness_max_N_per_m",
        "wall_is_stable",
        "stiffness_max_status",
        "wall_is_stable_status",
    ]
    assert len(table["plant.mass_kg"]) == 400
    assert found.dataset().sizes["design"] == 400
    assert "stable in" in repr(found)
    assert found.nominal.stiffness_max == pytest.approx(STIFFEST * MASS / PERIOD**2)
