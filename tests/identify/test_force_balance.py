"""No mass from a force that does not change: by joints whose motion is known in closed form."""

from __future__ import annotations

import json

import numpy as np
import pytest

import zwidth
from tests.study_sizes import EVERYDAY_SEEDS, outside_case, study_size
from zwidth.identify import (
    Estimate,
    Identification,
    check_sampling,
    identify_friction,
    identify_mass,
    read_record,
    record_of,
)
from zwidth.identify.joint.fit import MASS, ONE
from zwidth.identify.joint.force_balance import NOTHING, force_balance
from zwidth.identify.joint.friction import COLUMNS
from zwidth.identify.joint.joint import joint_of
from zwidth.identify.joint.record import read_motion, windows_of


@pytest.fixture(scope="module")
def device():
    return zwidth.load("hapkit-course")


def span(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def speeds_under_levels(levels, changes, mass, damping, coulomb, time):
    """Position and speed of a mass that slides forward under a force that steps: exponentials, piece by piece."""
    constant = mass / damping
    position, x, v = np.empty(len(time)), 0.0, 0.0
    ends = [*changes, len(time)]
    first = 0
    for level, end in zip(levels, ends, strict=True):
        t = time[first : end + 1] - time[first]
        final = (level - coulomb) / damping
        q = x + final * t + (v - final) * constant * (1.0 - np.exp(-t / constant))
        position[first:end] = q[: end - first]
        x, v = float(q[-1]), float(final + (v - final) * np.exp(-t[-1] / constant))
        first = end
    return position


def pushed(seed, step=0.0):
    """A joint of any size that runs up under a constant force [N] and, with `step`, steps of that share of it; and
    its mass. Its force is read with noise, white or slow, and its position in counts."""
    rng = np.random.default_rng(seed)
    mass, constant, count = span(rng, 1e-3, 1.0), span(rng, 0.1, 3.0), int(span(rng, 600, 3000))
    time = constant * span(rng, 1e-3, 5e-3) * np.arange(count)
    damping, push = mass / constant, mass / constant * span(rng, 0.03, 0.3)
    levels = push * np.array([1.0, 1.0 + step, 1.0, 1.0 - step])
    changes = [count // 4, count // 2, 3 * count // 4]
    coulomb = push * rng.uniform(0.0, 0.4)
    q = speeds_under_levels(levels, changes, mass, damping, coulomb, time)
    counts = np.ptp(q) / span(rng, 1e3, 1e5)
    q = counts * np.rint(q / counts + span(rng, 0.01, 1.0) * rng.normal(size=count))
    noise = (span(rng, 1e-3, 0.3) if not step else 0.1 * step) * push * rng.normal(size=count)
    if rng.random() < 0.3 and not step:  # slow noise, as behind a filter
        share = rng.uniform(0.5, 0.95)
        for i in range(1, count):
            noise[i] = share * noise[i - 1] + (1.0 - share) * noise[i]
    force = np.repeat(levels, np.diff([0, *changes, count])) + noise
    return {"time_s": time, "position_m": q, "force_N": force}, mass


def balance_of_columns(device, columns):
    record = record_of(columns, COLUMNS)
    motion = read_motion([record], [check_sampling(record)[0]], joint_of(device, None))
    return force_balance(windows_of(motion), motion.resolution, spring=False)


def judged(device, seed):
    """Whether nothing is told of a joint under a constant force, and the mass of one whose force steps."""
    assert not balance_of_columns(device, pushed(seed)[0]).tells_mass, seed
    columns, mass = pushed(seed, step=0.3)
    balance = balance_of_columns(device, columns)
    low, high = balance.interval(ONE[MASS])
    return balance.tells_mass and low <= mass <= high


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_the_noise_of_a_constant_force_tells_no_mass_and_steps_of_it_do(device, seed):
    assert judged(device, seed)


@pytest.mark.slow
def test_random_joints_under_a_constant_force_have_no_mass(device):
    held = [judged(device, seed) for seed in range(study_size(continuous=100, full=1000))]
    assert (
        np.mean(held) > 0.85
    )  # counts draw some masses towards 0: the interval of the balance is not the answer's


@pytest.mark.parametrize("identify", [identify_friction, identify_mass])
def test_a_record_under_a_constant_force_that_is_read_with_noise_is_refused(device, identify):
    result = identify(device, [record_of(pushed(1)[0], COLUMNS)])
    assert result.estimates == ()
    assert [check.what for check in result.checks if not (check.passed or check.warning)] == ["force"]


def test_too_little_motion_tells_nothing(device):
    columns, _ = pushed(1)
    record = record_of({name: values[:120] for name, values in columns.items()}, COLUMNS)
    motion = read_motion([record], [check_sampling(record)[0]], joint_of(device, None))
    windows = windows_of(motion)
    for count in (0, 1):
        assert force_balance(windows.chosen(np.arange(len(windows.first)) < count), motion.resolution) is NOTHING


def test_a_number_that_is_not_told_has_no_value_and_is_in_no_file():
    mass = Estimate("mass", np.nan, -np.inf, np.inf, "kg", "plant.mass_kg", told="no", reason="no force")
    result = Identification("friction", "bench", (), (mass, Estimate("bias", 1.0, 0.5, 2.0, "N", "a.b")), 0.9)
    told, other = result.document()["parameters"]
    assert (told["value"], told["low"], told["high"], told["told"]) == (None, None, None, "no")
    assert told["reason"]
    assert (other["told"], other["reason"]) == ("yes", None)
    assert result.settings == {"a.b": 1.0}
    json.dumps(result.document()["parameters"], allow_nan=False)
    assert "nan" not in repr(result)


@pytest.mark.outside_cases
@pytest.mark.parametrize("name", ["01_runup_constant_torque.csv", "01b_runup_1kHz.csv"])
def test_a_run_up_of_a_motor_tells_no_inertia(name):
    device = zwidth.load(outside_case("identify/motor.toml"))
    result = identify_friction(device, [read_record(outside_case(f"identify/{name}"), COLUMNS)])
    assert result.estimates == ()
