"""The sampled computer that both simulators share: counts, noise, estimates, filters, limit and delay."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.contact.engine_cases import two_mass_loop
from tests.contact.mechanism_cases import (
    motion_of,
    paddle,
    planar_chain,
    sampled_controller,
    with_drives,
    with_friction,
)
from zwidth.contact import normal_number, simulate, wall
from zwidth.contact.computer import (
    arrived_command,
    clip,
    computer_at,
    computers,
    estimate_velocity,
    filter_force,
    read_encoder,
    send,
    signals_of,
)
from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    Butterworth,
    CentralDifference,
    FirstOrder,
    Foaw,
    Kalman,
    LeastSquaresSlope,
    Levant,
    Loop,
    SavitzkyGolay,
    WindowedDifference,
    velocity_of,
)
from zwidth.model import Counter, GivenDamping, Nonlinear, reduce_mechanism, solve_posture
from zwidth.model.mechanism import nonlinear_of_drives

PERIOD = 1e-3
FREE = wall.values(stiffness=0.0)
METHODS = [
    BackwardDifference(),
    WindowedDifference(5),
    CentralDifference(),
    LeastSquaresSlope(6),
    SavitzkyGolay(7, 2),
    AlphaBeta(0.6, 0.2),
    Kalman(1e4, 1e-6),
    Foaw(8, 2e-5),
    Foaw(12, 1e-5, "best-fit"),
    Levant(30.0),
]
LOW_PASSES = [FirstOrder(4e-3), *(Butterworth(order, 60.0) for order in (1, 2, 3, 4))]


def computer(*controllers, limit=np.inf):
    """The last of a batch of computers."""
    return computer_at(computers(controllers, [limit] * len(controllers)), len(controllers) - 1)


def low_passed(low_pass, signal):
    """The signal behind a low pass, by coefficients in 1/z instead of factors in z - 1."""
    if isinstance(low_pass, FirstOrder):
        share = low_pass.time_constant / (low_pass.time_constant + PERIOD)
        return lfilter([1.0 - share], [1.0, -share], signal)
    u = np.pi * low_pass.cutoff_Hz * PERIOD
    poles = np.exp(1j * np.pi * (2.0 * np.arange(low_pass.order) + low_pass.order + 1.0) / (2.0 * low_pass.order))
    poles = (1.0 + u * poles) / (1.0 - u * poles)
    bottom, top = np.poly(poles).real, np.poly(np.full(low_pass.order, -1.0))
    return lfilter(top * bottom.sum() / top.sum(), bottom, signal)


def walk(rng, samples=200):
    """Readings of 10 um steps that start away from zero."""
    return 0.3 + 1e-5 * np.round(np.cumsum(rng.normal(0.0, 5.0, samples)))


# --- one signal -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_estimates_of_several_coordinates_are_those_of_each_alone(method):
    readings = np.array([walk(np.random.default_rng(seed)) for seed in (1, 2, 3)])
    # beside one that remembers more, and has factors: a batch is padded
    other = sampled_controller(
        PERIOD, velocity=SavitzkyGolay(15, 2), velocity_filter=Butterworth(4, 50.0), delay=3.0
    )
    own = computer(other, sampled_controller(PERIOD, velocity=method))
    signals, found = signals_of(own, 3, 1), np.empty_like(readings)
    for j in range(readings.shape[1]):
        for s in range(3):
            found[s, j] = estimate_velocity(own, signals, s, readings[s, j], j)
    expected = velocity_of(method, readings, PERIOD)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-11)
    assert np.min(np.ptp(found, axis=1)) > 0.01


@pytest.mark.parametrize("low_pass", LOW_PASSES, ids=repr)
def test_low_passes_of_velocity_and_force_are_those_of_a_second_filter(low_pass):
    readings, forces = walk(np.random.default_rng(4)), np.random.default_rng(5).normal(size=(200, 2))
    for method in (BackwardDifference(), Levant(30.0), Foaw(8, 2e-5)):
        own = computer(
            sampled_controller(PERIOD, velocity=method, velocity_filter=low_pass, force_filter=low_pass)
        )
        signals = signals_of(own, 2, 1)
        speeds = [estimate_velocity(own, signals, 0, reading, j) for j, reading in enumerate(readings)]
        passed = np.array([[filter_force(own, signals, s, force[s]) for s in range(2)] for force in forces]).T
        expected = low_passed(low_pass, velocity_of(method, readings, PERIOD))
        assert speeds == pytest.approx(expected, abs=1e-9 * np.max(np.abs(expected)))
        expected = np.array([low_passed(low_pass, force) for force in forces.T])
        assert passed == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.4, 1.0, 2.7])
def test_a_command_arrives_when_its_delay_is_over(delay):
    own = computer(sampled_controller(PERIOD, delay=delay))
    signals, whole = signals_of(own, 1, 2), int(delay)
    forces = np.random.default_rng(6).normal(size=(20, 2))
    waited = np.concatenate([np.zeros((4, 2)), forces])
    for j, sent in enumerate(forces):
        for c in range(2):
            send(signals, c, sent[c])
        for part in (0, 1):  # before the rest of the delay is over, the command of one sample more
            arrived = [arrived_command(own, signals, c, part) for c in range(2)]
            assert arrived == waited[4 + j - whole - (1 - part)].tolist()


def test_a_limit_cuts_both_signs_off():
    assert [clip(force, 2.0) for force in (-3.0, -2.0, 0.5, 2.0, 9.0)] == [-2.0, -2.0, 0.5, 2.0, 2.0]
    assert clip(-1e300, np.inf) == -1e300


def test_half_a_step_counts_upwards_on_both_sides_of_zero():
    counts = [read_encoder(place, 0.25, 0.0, np.uint64(0), 0, 0) / 0.25 for place in np.arange(-20, 21) * 0.125]
    assert counts == [np.floor(half / 2 + 0.5) for half in range(-20, 21)]
    assert read_encoder(0.3, 0.0, 0.0, np.uint64(0), 0, 0) == 0.3


# --- the same in both simulators ------------------------------------------------------------------------


def test_noise_of_one_seed_is_the_same_in_both():
    """Two arms at rest: what each encoder is off by is its own draw, and the reading has the weighted sum."""
    arms = with_friction(with_drives(planar_chain(2), encoder_counts=np.nan), encoder_noise=1e-6)
    seed, sigma, u = 2**40 + 7, 1e-6 / 18.6, np.array([0.6, 0.8, 0.0])
    motion = motion_of(arms, GivenDamping(), sampled_controller(PERIOD), duration=0.05, seed=seed)
    draws = np.array([[normal_number(np.uint64(seed), j, i) for i in range(2)] for j in range(51)])
    posture = solve_posture(arms, arms.reference_position)
    off = motion.counted_position - motion.position
    assert off == pytest.approx(sigma * draws @ posture.jacobian.T, rel=1e-5, abs=1e-12)
    loop = Loop(reduce_mechanism(arms, posture, u, "full", GivenDamping()), sampled_controller(PERIOD))
    response = simulate(loop, wall, FREE, duration=0.05, seed=seed)
    assert response.reading == pytest.approx(off @ u, abs=1e-12)
    assert np.std(response.reading) > 1e-9
    others = motion_of(arms, GivenDamping(), sampled_controller(PERIOD), duration=0.05, seed=seed + 1)
    assert not np.any(others.counted_position[:, :2] == motion.counted_position[:, :2])


def test_a_drive_that_a_direction_leaves_alone_takes_no_noise_from_the_others():
    drives = with_friction(planar_chain(2), encoder_noise=1e-4).drives
    (counter,) = nonlinear_of_drives(drives, np.array([0.0, 0.3]), *[np.eye(2)] * 3).counters
    assert counter.channel == 1
    own = Counter(np.array([0.0, 1.0]), 0.0, 1.0, 2e-6, channel=1)
    two = replace(own, channel=None)  # the second of two, by its place
    silent = replace(own, noise=0.0, weight=0.0, channel=None)
    readings = [
        simulate(two_mass_loop(Nonlinear(counters=counters)), wall, FREE, duration=0.05, seed=5).reading
        for counters in ((own,), (silent, two), (two,))
    ]
    assert np.array_equal(readings[0], readings[1])
    assert not np.any(readings[0] == readings[2])


def test_a_tie_of_the_encoder_rounds_alike_in_both():
    """An arm at rest exactly between two counts, of either sign."""
    arm = paddle(length=0.5)
    inertia = 1.0 - 10.0**2 * 1e-6 - arm.links.inertia[0, 2, 2]
    links = replace(arm.links, inertia=arm.links.inertia + np.diag([0.0, 0.0, inertia])[None])
    arm = replace(arm, links=links)  # 1 kg m^2 in all: no coordinate of the plant is scaled
    for angle, count in ((0.625, 3.0), (-0.625, -2.0), (0.375, 2.0), (-0.375, -1.0)):
        counted = with_drives(arm, encoder_counts=2.0 * np.pi / (10.0 * 0.25))
        step = 2.0 * np.pi / (counted.drives.encoder_counts[0] * 10.0)
        assert step == 0.25
        at = 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0])
        motion = motion_of(counted, GivenDamping(), sampled_controller(PERIOD), at=at, duration=0.01)
        assert set(motion.motors[:, 0]) == {angle}
        seen = 0.5 * np.array([np.cos(count * step), np.sin(count * step), 0.0])
        assert motion.counted_position == pytest.approx(np.tile(seen, (11, 1)), abs=1e-15)
        plant = reduce_mechanism(counted, solve_posture(counted, at), [-at[1] / 0.5, at[0] / 0.5, 0.0], "full",
                                 GivenDamping())  # fmt: skip
        response = simulate(
            Loop(plant, sampled_controller(PERIOD)), wall, FREE, duration=0.01, start=([angle], [0.0])
        )
        assert response.reading == pytest.approx(np.full(11, 0.5 * count * step), abs=1e-15)
