"""What the computer does at a sample, and what must not change a run: threads, neighbours in a batch, padding."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.contact.engine_cases import friction_of, one_mass, run, two_mass_loop
from tests.contact.test_ledger import with_all_nonlinearities
from tests.systems import FEATURES, random_loop
from zwidth.contact import Hand, Reflex, Run, one_sided_wall, simulate, simulate_batch, wall
from zwidth.loop import BackwardDifference, Foaw, LeastSquaresSlope, Levant, Loop, SavitzkyGolay, velocity_of
from zwidth.model import Counter, LaggedDamper, Nonlinear, Operator

MOTOR = np.array([0.0, 1.0])
WALL = wall.values(stiffness=3000.0, damping=5.0)
METHODS = [
    BackwardDifference(),
    SavitzkyGolay(6, 2),
    LeastSquaresSlope(4),
    Foaw(8, 5e-6),
    Foaw(12, 1e-5, "best-fit"),
    Levant(30.0),
]


def encoder_loop(step=1e-5, noise=0.0, **controller):
    """The two masses with an encoder on the motor."""
    return two_mass_loop(Nonlinear(counters=(Counter(MOTOR, step, 1.0, noise),)), **controller)


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_velocities_are_those_of_the_recorded_readings(method):
    response = run(encoder_loop(velocity=method, delay=0.3), 300.0, 1.0, 0.5, start_position=1e-3)
    expected = velocity_of(method, response.reading, response.period)
    assert response.velocity == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert np.abs(response.velocity).max() > 0.01


def test_forces_are_the_laws_limited_and_delayed():
    loop = encoder_loop(force_limit=1.5)
    response = run(loop, 3000.0, 5.0, 0.3, start_position=1e-3)
    asked = -(3000.0 * response.reading + 5.0 * response.velocity)
    assert response.force == pytest.approx(np.clip(asked, -1.5, 1.5), abs=1e-12)
    assert np.sum(np.abs(response.force) == 1.5) > 10
    late = one_mass(0.3, delay=3.0)
    response = run(late, 100.0, 0.0, 0.02, start_position=1e-3)
    assert response.truth[:4] == pytest.approx(np.full(4, 1e-3), abs=1e-18)
    assert response.truth[4] == pytest.approx(1e-3 - 0.5 * 0.1 / 0.3 * 1e-6, rel=1e-9)


def test_an_encoder_counts_to_the_nearest_step():
    response = run(encoder_loop(1e-4), 1000.0, 2.0, 0.5, start_position=1.23e-3)
    assert response.reading == pytest.approx(1e-4 * np.floor(response.truth / 1e-4 + 0.5), abs=1e-18)
    assert np.abs(response.reading - response.truth).max() <= 0.5e-4 * (1.0 + 1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4.0, 1.2])
def test_the_quantum_of_two_motors_counters_turns_with_the_direction(angle):
    # the reading along u moves by |u_1| step_1 where the first counter counts on, by |u_2| step_2 for the second
    u, steps = np.array([np.cos(angle), np.sin(angle)]), (1e-4, 3e-4)
    base = two_mass_loop()
    plant = replace(
        base.plant,
        stiffness=np.zeros((2, 2)),
        damping=np.zeros((2, 2)),
        actuator=u,
        sensor=u,
        nonlinear=Nonlinear(counters=tuple(Counter(np.eye(2)[i], steps[i], u[i]) for i in range(2))),
    )
    loop = Loop(plant, base.controller)
    start = np.array([0.2e-4, 0.2e-4]), 0.05 * u
    response = simulate(loop, wall, wall.values(stiffness=0.0), duration=2.0, start=start)
    jumps = np.abs(np.diff(response.reading))
    allowed = [abs(u[i]) * steps[i] for i in range(2)]
    place = np.outer(response.time, 0.05 * u) + start[0]
    expected = sum(u[i] * steps[i] * np.floor(place[:, i] / steps[i] + 0.5) for i in range(2))
    assert np.mean(np.abs(response.reading - expected) < 1e-12) > 0.98  # the rest lies on the edge of a count
    counts = [np.round(np.diff(place[:, i] / steps[i] + 0.5)) for i in range(2)]
    assert jumps.max() <= sum(a * (np.abs(c).max() + 1) for a, c in zip(allowed, counts, strict=True)) + 1e-12
    assert response.quantum == pytest.approx(sum(allowed))
    assert np.abs(response.reading - response.truth).max() <= 0.5 * sum(allowed) * (1.0 + 1e-9)


def resting_readings(seed, noise=2e-6, duration=25.0, step=0.0):
    """Readings of a device at rest that nothing moves."""
    values = wall.values(stiffness=0.0)
    return simulate(
        encoder_loop(step, noise), wall, values, duration=duration, seed=seed, trail=False, ledger=False
    ).reading


def test_noise_has_the_standard_deviation_that_was_asked_for_and_no_memory():
    found = resting_readings(3)
    n = len(found)
    assert found.std() == pytest.approx(2e-6, rel=4.0 / np.sqrt(2.0 * n))
    assert abs(found.mean()) < 4.0 * 2e-6 / np.sqrt(n)
    normal = found / 2e-6
    assert np.mean(normal**4) == pytest.approx(3.0, abs=4.0 * np.sqrt(96.0 / n))
    assert abs(np.mean(np.abs(normal) < 1.0) - 0.6827) < 4.0 * np.sqrt(0.22 / n)
    for lag in (1, 2, 7):
        assert abs(np.mean(normal[lag:] * normal[:-lag])) < 4.0 / np.sqrt(n)


def test_seeds_and_channels_differ_and_the_same_seed_repeats():
    assert np.array_equal(resting_readings(3, duration=1.0), resting_readings(3, duration=1.0))
    readings = [resting_readings(seed, duration=10.0) for seed in (0, 1, 2, 2**40)]
    for i, one in enumerate(readings):
        for other in readings[:i]:
            assert abs(np.corrcoef(one, other)[0, 1]) < 4.0 / np.sqrt(len(one))
    halves = tuple(Counter(MOTOR, 0.0, 0.5, 2e-6) for _ in range(2))
    two = simulate(
        two_mass_loop(Nonlinear(counters=halves)),
        wall,
        wall.values(stiffness=0.0),
        duration=25.0,
        trail=False,
        ledger=False,
    ).reading
    # two independent halves: 2e-6/sqrt 2
    assert two.std() == pytest.approx(2e-6 / np.sqrt(2.0), rel=0.03)


def mixed_runs(count=12):
    """Runs on devices of different sizes, elements, delays and estimators."""
    rng, runs = np.random.default_rng(23), []
    for k in range(count):
        features = [feature for feature in FEATURES if rng.random() < 0.5]
        loop = random_loop(rng, kind=str(rng.choice(["chain", "dense", "apart"])), features=features)
        loop = replace(loop, controller=replace(loop.controller, delay=float(rng.choice([0.0, 0.4, 5.0]))))
        loop = with_all_nonlinearities(rng, loop) if k % 3 else loop
        K = 0.01 / loop.period**2 * 10 ** rng.uniform(-3, -1)
        runs.append(Run(loop, one_sided_wall.values(stiffness=K), Hand(push=1.0), -1e-4, seed=k, bound=1.0))
    own = two_mass_loop(Nonlinear(friction=(friction_of(0.1),)))
    own = Loop(replace(own.plant, handle=np.array([1.0, 0.0])), own.controller)
    hand = Hand(Operator(0.8, 580.0, 5.5, 1e4, 5.0), push=4.0, reflex=Reflex(1.0, 0.02, 0.03, 600.0, 20.0))
    runs.append(Run(own, one_sided_wall.values(stiffness=3000.0, damping=2.0), hand, -1e-3))
    return runs, [300 * own.loop.period for own in runs]


def test_a_batch_equals_its_runs_one_by_one_bit_for_bit():
    runs, durations = mixed_runs()
    together = simulate_batch(runs, one_sided_wall, duration=durations, substeps=8, ledger=True, trail=True)
    for own, duration, found in zip(runs, durations, together, strict=True):
        (alone,) = simulate_batch([own], one_sided_wall, duration=duration, substeps=8, ledger=True, trail=True)
        for name in ("time", "reading", "truth", "velocity", "force", "handle", "trail"):
            assert np.array_equal(getattr(found, name), getattr(alone, name)), name
        assert found.energies == pytest.approx(alone.energies, rel=1e-9, abs=1e-15)
        assert found.given_up == alone.given_up


THREADS = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from tests.contact.test_engine_computer import mixed_runs
from zwidth.contact.environments import one_sided_wall
from zwidth.contact.loop_simulation import simulate_batch
runs, durations = mixed_runs()
found = simulate_batch(runs, one_sided_wall, duration=durations, substeps=8)
np.save(sys.argv[2], np.concatenate([one.reading for one in found]))
"""


def test_the_number_of_threads_changes_nothing(tmp_path):
    root, found = Path(__file__).parents[2], []
    for threads in ("1", "2"):
        file = tmp_path / f"{threads}.npy"
        known = {**os.environ, "NUMBA_NUM_THREADS": threads}
        subprocess.run([sys.executable, "-c", THREADS, str(root), str(file)], check=True, env=known)
        found.append(np.load(file))
    assert np.array_equal(*found)


def test_a_run_is_given_up_where_the_reading_leaves_its_bound():
    values = wall.values(stiffness=9000.0, damping=0.0)
    response = simulate(two_mass_loop(), wall, values, duration=5.0, start_position=1e-3, bound=0.01)
    assert response.given_up
    assert len(response.time) < 4001
    assert abs(response.truth[-1]) > 0.01 >= np.abs(response.truth[:-1]).max()
    assert np.all(np.isfinite(response.truth))
    calm = simulate(two_mass_loop(), wall, WALL, duration=0.1, start_position=1e-3, bound=0.01)
    assert not calm.given_up
    assert len(calm.time) == 81


def test_a_lagged_damper_of_no_damping_is_none():
    loop = two_mass_loop()
    plant = replace(loop.plant, lagged_dampers=(LaggedDamper(MOTOR, 0.0, 1e-3),))
    responses = [run(own, 1000.0, 3.0, 0.1, start_position=1e-3) for own in (loop, Loop(plant, loop.controller))]
    assert np.array_equal(responses[0].truth, responses[1].truth)


def test_the_last_sample_is_at_the_duration_or_just_after():
    for duration, samples in ((0.1, 81), (0.1001, 82), (1e-9, 2)):
        assert len(run(two_mass_loop(), 100.0, 1.0, duration, start_position=1e-3).time) == samples
