"""Linear loops in time are powers of their transition matrix, whatever the loop has in it."""

import numpy as np
import pytest

from tests.contact.engine_cases import random_stable_wall, run, spectral_radius, two_mass_loop
from tests.contact.matrix_power_reference import fine_readings
from tests.systems import FEATURES, random_loop
from zwidth.contact import Hand, Reach, Run, Tremor, judge_response, simulate, simulate_batch, wall
from zwidth.loop import (
    AlphaBeta,
    Butterworth,
    CentralDifference,
    FirstOrder,
    Kalman,
    LeastSquaresSlope,
    SavitzkyGolay,
    WindowedDifference,
)
from zwidth.model import Operator
from zwidth.model.modes import least_deforming_motion

HAS_LONG_DOUBLE = np.finfo(np.longdouble).eps < 1e-18
needs_long_double = pytest.mark.skipif(
    not HAS_LONG_DOUBLE, reason="long double has no more digits than double here"
)
SAMPLES = 10_001
METHODS = [
    *(SavitzkyGolay(n, 2) for n in range(3, 13)),
    SavitzkyGolay(60, 1),
    SavitzkyGolay(9, 2, True),
    *(WindowedDifference(n) for n in (1, 2, 3, 50)),
    LeastSquaresSlope(2),
    LeastSquaresSlope(7),
    CentralDifference(),
    AlphaBeta(0.5, 0.1),
    Kalman(20.0, 1e-5),
]


def relative_error(loop, K, B, samples=SAMPLES, substeps=20):
    """Largest difference to the powers, in the largest coordinate on the way."""
    shape = least_deforming_motion(loop.plant)
    readings, largest = fine_readings(loop, K, B, 1e-3 * shape, 0.01 * shape, samples)
    response = run(
        loop,
        K,
        B,
        (samples - 1) * loop.period,
        start_position=1e-3,
        start_velocity=0.01,
        substeps=substeps,
        trail=False,
        ledger=substeps > 1,
    )
    assert len(response.truth) == samples
    return float(np.abs(readings - response.truth).max() / largest)


def random_gap(seed):
    """That of a random loop with every kind of feature."""
    rng = np.random.default_rng(1000 + seed)
    features = [feature for feature in FEATURES if rng.random() < 0.5]
    loop = random_loop(rng, kind=str(rng.choice(["chain", "dense", "coupled", "apart"])), features=features)
    found = random_stable_wall(rng, loop)
    if found is None:
        found, samples = (1e-6, 1e-6), 300
    else:
        samples = SAMPLES
    return relative_error(loop, *found, samples, int(rng.choice([1, 2, 7, 20])))


@needs_long_double
@pytest.mark.parametrize("seed", range(16))
def test_random_loops_of_every_feature_are_powers_of_their_matrix(seed):
    assert random_gap(seed) < 1e-10


@needs_long_double
@pytest.mark.slow
def test_the_worst_of_many_random_loops_is_as_the_page_says():
    gaps = np.sort([random_gap(seed) for seed in range(120)])
    assert gaps[-1] < 3e-10
    assert gaps[-2] < 2e-10


@needs_long_double
@pytest.mark.parametrize("delay", [0.3, 1.0, 2.999, 17.0, 40.5, 100.0])
def test_delays_from_a_part_of_a_sample_to_a_hundred(delay):
    loop = two_mass_loop(delay=delay)
    K, B = 300.0 / (1.0 + delay), 0.6
    assert spectral_radius(loop, K, B) < 1.0
    assert relative_error(loop, K, B) < 1e-10


@needs_long_double
@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_every_estimator_and_windows_of_every_length(method):
    assert relative_error(two_mass_loop(velocity=method, delay=0.4), 500.0, 3.0, 3000) < 1e-11


@needs_long_double
@pytest.mark.parametrize("low_pass", [FirstOrder(0.004), *(Butterworth(order, 60.0) for order in (1, 2, 3, 5))])
@pytest.mark.parametrize("where", ["velocity_filter", "force_filter"])
def test_filters_on_velocity_and_force(low_pass, where):
    loop = two_mass_loop(**{where: low_pass}, actuator_time_constant=4e-4)
    assert relative_error(loop, 300.0, 1.0, 3000) < 1e-11


def test_substeps_ledger_and_trail_change_nothing_of_a_linear_loop():
    loop = two_mass_loop(delay=1.3, actuator_time_constant=3e-4)
    plain = run(loop, 200.0, 2.0, 1.0, start_position=1e-3, trail=False, ledger=False)
    for substeps in (1, 3, 20, 200):
        other = run(loop, 200.0, 2.0, 1.0, start_position=1e-3, substeps=substeps)
        assert np.abs(other.truth - plain.truth).max() < 1e-14


def test_trail_is_the_exact_motion_between_samples():
    # each substep of the trail is a sample of the same device under the same held forces
    loop = two_mass_loop(delay=0.3)
    response = run(loop, 200.0, 2.0, 0.05, start_position=1e-3, substeps=10)
    fine = run(loop, 200.0, 2.0, 0.05, start_position=1e-3, substeps=40)
    assert np.interp(fine.trail_time[39::40], response.trail_time, response.trail) == pytest.approx(
        fine.trail[39::40], abs=1e-15
    )
    at_samples = response.trail[9::10]
    assert at_samples[:-1] == pytest.approx(response.handle[1:], abs=1e-15)


def unstable(seed, count):
    """Random loops with a wall from where they grow."""
    rng = np.random.default_rng(seed)
    while count:
        features = [feature for feature in FEATURES if rng.random() < 0.3]
        loop = random_loop(rng, kind=str(rng.choice(["chain", "dense", "coupled", "apart"])), features=features)
        m = 1.0 / (loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))
        K, B = m / loop.period**2 * 10 ** rng.uniform(-3, 1), m / loop.period * 10 ** rng.uniform(-3, 0.5)
        z = np.sort(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))))[::-1]
        fastest = z[z < z[0] * (1.0 - 1e-9)]
        rho, second = float(z[0]), float(fastest[0]) if fastest.size else 0.0
        if rho > 1.0005:
            count -= 1
            yield loop, K, B, rho, second


def test_growth_of_unstable_loops_is_the_logarithm_of_the_spectral_radius():
    errors = []
    for loop, K, B, rho, second in unstable(3, 60):
        lead = np.log(rho / second)
        samples = int(min(max(200.0 / lead, 300.0 / np.log(rho), 64.0), 600.0 / np.log(rho)))
        if samples * lead < 80.0 or samples > 200_000:
            continue  # two motions grow almost alike: no run that fits into numbers tells them apart
        response = run(loop, K, B, samples * loop.period, start_position=1e-3, ledger=False, trail=False)
        errors.append(abs(judge_response(response).growth - np.log(rho)) / np.log(rho))
    assert len(errors) > 40
    assert np.max(errors) < 0.03  # of few periods in a quarter of the run
    assert np.median(errors) < 0.002


def test_verdicts_agree_with_eigenvalues_away_from_the_boundary():
    rng = np.random.default_rng(11)
    runs, wanted, durations = [], [], []
    while len(runs) < 300:
        features = [feature for feature in FEATURES if rng.random() < 0.3]
        loop = random_loop(rng, kind=str(rng.choice(["chain", "dense", "coupled", "apart"])), features=features)
        m = 1.0 / (loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))
        for _ in range(2):
            K, B = m / loop.period**2 * 10 ** rng.uniform(-4, 1), m / loop.period * 10 ** rng.uniform(-4, 0.5)
            rate = np.log(spectral_radius(loop, K, B))
            if abs(rate) < 2e-4:
                continue
            runs.append(Run(loop, np.array([K, B]), start_position=1e-3, start_velocity=0.01, bound=1e6))
            wanted.append(rate < 0.0)
            durations.append(min(max(8.0 / abs(rate), 2000.0), 40_000.0) * loop.period)
    wrong, undecided = [], 0
    for own, stable, duration in zip(runs, wanted, durations, strict=True):
        (response,) = simulate_batch([own], wall, duration=duration)
        judged = judge_response(response).stable
        undecided += judged is None
        if judged is not None and judged != stable:
            wrong.append(own)
    assert not wrong
    assert undecided <= 3
    assert 60 < sum(wanted) < 240


def test_a_start_inside_the_wall_moves_on_from_there():
    response = simulate(
        two_mass_loop(), wall, wall.values(stiffness=300, damping=3), duration=1.0, start_position=5e-3
    )
    assert response.penetration[0] == pytest.approx(5e-3, rel=1e-14)
    assert abs(response.truth[-1]) < 5e-4


@pytest.mark.parametrize(
    "hand",
    [
        Hand(push=2.0),
        Hand(push=2.0, ramp=0.03),
        Hand(push=2.0, tremor=Tremor(1.0, 30.0)),
        Hand(Operator(0.5, 300.0, 8.0, 3000.0, 5.0), reach=Reach(0.02, duration=0.1)),
    ],
    ids=["steady", "ramp", "tremor", "reach"],
)
def test_a_motion_is_the_same_whether_the_way_between_samples_is_kept_or_not(hand):
    runs = [
        Run(two_mass_loop(period=0.005), wall.values(stiffness=500.0, damping=2.0), hand=hand, start_position=1e-3)
    ]
    (kept,) = simulate_batch(runs, wall, duration=0.2, trail=True)
    (not_kept,) = simulate_batch(runs, wall, duration=0.2)
    assert np.abs(kept.truth - not_kept.truth).max() < 1e-9 * np.abs(kept.truth).max()
