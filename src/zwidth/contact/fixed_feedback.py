"""The computer's fixed feedback in a simulation: force sensor, feedforward and local loop, sample by sample.

`docs/control.md` has the equations; `loop.closed_plant` has the same in linear algebra. Dry friction is fed
forward here only. In all kernels d is the index of a computer, and of its device.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_inline
from zwidth.contact.computer import cascade, weigh_readings
from zwidth.loop.controller import Controller, LowPass, split_delay
from zwidth.loop.estimators import LinearMethod
from zwidth.loop.loop_table import low_pass_factors

# Columns of `FeedbackArrays.gains`.
GAIN, OF_ERROR, INERTIA, DAMPING, COULOMB, DEAD_BAND, LOCAL_STIFFNESS, LOCAL_DAMPING = range(8)
# Columns of `FeedbackArrays.acts`, of `.delays`, and entries of `FeedbackMemory.first`.
FORCE_SENSOR, FEEDFORWARD, LOCAL_LOOP = range(3)
SENSOR_DELAY, LOCAL_DELAY = range(2)
FIRST_READING, LAST_SPEED, ACTING_COMMAND = range(3)
PASSES: Final = ((0.0, 1.0, 0.0), (0.0, 1.0, 0.0))  # a factor that changes nothing, and whose state stays 0


class FeedbackArrays(NamedTuple):
    """The fixed feedback of D computers, padded to one size by what changes nothing.

    acts          (D, 3)        1 where there is a force sensor, a feedforward, a local loop
    gains         (D, 8)        columns GAIN to LOCAL_DAMPING
    delays        (D, 2)        whole samples that the measured force, and the local loop's command, wait
    splits        (D,)          1 where the local loop's command waits for a part of its sample, too
    on_sensor     (D, f, 2, 3)  factors as of `Computer.filter`
    window, velocity, acceleration    (D, w), (D, k, 2, 3), (D, a, 2, 3)  of the feedforward's estimates
    fast_window, fast_velocity        the same of the local loop's
    measured      (D, N + 2 + E)      measured force per state, command, push of the hand, force of an element
    """

    acts: Ints
    gains: Floats
    delays: Ints
    splits: Ints
    on_sensor: Floats
    window: Floats
    velocity: Floats
    acceleration: Floats
    fast_window: Floats
    fast_velocity: Floats
    measured: Floats


class FeedbackMemory(NamedTuple):
    """What one run remembers: readings and commands on their way, and the states of the factors (k, 2).

    first        (3,)   first reading [m], last velocity of the feedforward [m/s], and command that acts [N]
    late         (q,)   measured forces on their way, the newest first
    sensed       (f, 2) states of the force sensor's factors, as the others are of the fields they are named after
    past, fast_past  (w,)  readings that the windows of feedforward and local loop look back on
    queue        (p,)   the local loop's commands, the newest first
    """

    first: Floats
    late: Floats
    sensed: Floats
    past: Floats
    velocity: Floats
    acceleration: Floats
    fast_past: Floats
    fast_velocity: Floats
    queue: Floats


def feedback_arrays(controllers: Sequence[Controller], measured: Floats) -> FeedbackArrays:
    """The feedback of these computers; `measured` as in `FeedbackArrays`."""
    feedbacks = [_feedback(controller) for controller in controllers]
    return FeedbackArrays(
        acts=np.array([each.acts for each in feedbacks], dtype=np.int64),
        gains=np.array([each.gains for each in feedbacks], dtype=np.float64),
        delays=np.array([each.delays for each in feedbacks], dtype=np.int64),
        splits=np.array([each.splits for each in feedbacks], dtype=np.int64),
        on_sensor=_padded_factors([each.on_sensor for each in feedbacks]),
        window=_padded([each.estimate[0] for each in feedbacks]),
        velocity=_padded_factors([each.estimate[1] for each in feedbacks]),
        acceleration=_padded_factors([each.acceleration for each in feedbacks]),
        fast_window=_padded([each.fast_estimate[0] for each in feedbacks]),
        fast_velocity=_padded_factors([each.fast_estimate[1] for each in feedbacks]),
        measured=measured,
    )


class _Feedback(NamedTuple):
    """The feedback of one computer, as in `FeedbackArrays`; estimates as window and factors."""

    acts: tuple[bool, bool, bool]
    gains: list[float]
    delays: tuple[int, int]
    splits: bool
    on_sensor: Floats
    estimate: tuple[Floats, Floats]
    acceleration: Floats
    fast_estimate: tuple[Floats, Floats]


def _feedback(controller: Controller) -> _Feedback:
    """Feedback of one computer in numbers; zeros, and no factors, for a part that it does not have."""
    T, sensor, feedforward, local = (
        float(controller.sampling_period),
        controller.force_sensor,
        controller.feedforward,
        controller.local_loop,
    )
    gains = [0.0] * 8
    if sensor is not None:
        gains[GAIN], gains[OF_ERROR] = sensor.gain, float(sensor.law == "force-error")
    if feedforward is not None:
        gains[INERTIA : DEAD_BAND + 1] = [
            feedforward.inertia,
            feedforward.damping,
            feedforward.coulomb,
            feedforward.dead_band,
        ]
    if local is not None:
        gains[LOCAL_STIFFNESS], gains[LOCAL_DAMPING] = local.stiffness, local.damping
    whole_samples, part = (0, 0.0) if local is None else split_delay(local.delay)
    no_estimate = np.zeros(1), np.zeros((0, 2, 3))
    return _Feedback(
        acts=(sensor is not None, feedforward is not None, local is not None),
        gains=gains,
        delays=(0 if sensor is None else sensor.delay, whole_samples),
        splits=part > 0.0,
        on_sensor=_factors(None if sensor is None else sensor.filter, T),
        estimate=no_estimate
        if feedforward is None
        else _estimate(feedforward.velocity, feedforward.velocity_filter, T),
        acceleration=_factors(None if feedforward is None else feedforward.acceleration_filter, T),
        fast_estimate=no_estimate
        if local is None
        else _estimate(local.velocity, local.velocity_filter, T / local.rate_multiple),
    )


def _factors(low_pass: LowPass | None, period: float) -> Floats:
    """Factors (k, 2, 3) of a low pass sampled with a period [s]; none for None."""
    top, bottom = (np.array(rows, dtype=float).reshape(-1, 3) for rows in low_pass_factors(low_pass, period))
    return np.stack([top, bottom], axis=1)


def _estimate(method: LinearMethod, low_pass: LowPass | None, period: float) -> tuple[Floats, Floats]:
    """Window (w,) and factors (k, 2, 3) of a velocity estimate and the low pass behind it; period in s."""
    estimator = method.estimator(period)
    factors = np.stack([estimator.numerator, estimator.denominator], axis=1)
    return estimator.window, np.concatenate([factors, _factors(low_pass, period)])


def _padded(windows: Sequence[Floats]) -> Floats:
    """Windows of any lengths as rows (D, w), padded with zeros."""
    padded = np.zeros((len(windows), max(map(len, windows))))
    for row, window in zip(padded, windows, strict=True):
        row[: len(window)] = window
    return padded


def _padded_factors(factors: Sequence[Floats]) -> Floats:
    """Factors (k, 2, 3) of D computers, any k, as (D, k, 2, 3), padded by factors that change no signal."""
    padded = np.empty((len(factors), max(map(len, factors)), 2, 3))
    padded[:] = PASSES
    for room, rows in zip(padded, factors, strict=True):
        room[: len(rows)] = rows
    return padded


@compiled
def feedback_memory(arrays: FeedbackArrays, d: int) -> FeedbackMemory:
    """The memory of a computer that has just been switched on."""
    return FeedbackMemory(
        first=np.zeros(3),
        late=np.zeros(arrays.delays[d, SENSOR_DELAY] + 1),
        sensed=np.zeros((arrays.on_sensor.shape[1], 2)),
        past=np.zeros(arrays.window.shape[1]),
        velocity=np.zeros((arrays.velocity.shape[1], 2)),
        acceleration=np.zeros((arrays.acceleration.shape[1], 2)),
        fast_past=np.zeros(arrays.fast_window.shape[1]),
        fast_velocity=np.zeros((arrays.fast_velocity.shape[1], 2)),
        queue=np.zeros(arrays.delays[d, LOCAL_DELAY] + 2),
    )


@compiled_inline
def read_force(
    arrays: FeedbackArrays, d: int, states: Floats, command: float, push: float, forces: Floats
) -> float:
    """The force between sensor and hand just before a sample [N].

    command, push, forces (E,)  actuator's, hand's and elements' forces that have acted until then [N]
    """
    # columns of `measured`: N states, command, push, E elements
    N = arrays.measured.shape[1] - 2 - forces.size
    total = float(arrays.measured[d, N] * command + arrays.measured[d, N + 1] * push)
    for i in range(N):
        total += arrays.measured[d, i] * states[i]
    for e in range(forces.size):
        total += arrays.measured[d, N + 2 + e] * forces[e]
    return total


@compiled_inline
def with_feedback(
    arrays: FeedbackArrays,
    d: int,
    memory: FeedbackMemory,
    wall: float,
    reading: float,
    measured: float,
    sample: int,
    period: float,
) -> float:
    """The command of a sample [N], before the force filter: the wall's force, force feedback and feedforward.

    d  index of the computer;   wall, measured  forces of the wall and of the force sensor [N];   reading  [m]
    sample  its number;   period  T [s]
    """
    command = wall
    if sample == 0:
        memory.first[FIRST_READING] = reading
    if arrays.acts[d, FORCE_SENSOR]:
        late = memory.late
        for k in range(late.size - 1, 0, -1):
            late[k] = late[k - 1]
        late[0] = measured
        # the oldest measured force, that of the hand; a force error is 0 where it balances the wall's
        fed_back = late[late.size - 1] + arrays.gains[d, OF_ERROR] * wall
        command += arrays.gains[d, GAIN] * cascade(arrays.on_sensor[d], memory.sensed, fed_back)
    if arrays.acts[d, FEEDFORWARD]:
        moved = weigh_readings(arrays.window[d], memory.past, reading - memory.first[FIRST_READING])
        speed = cascade(arrays.velocity[d], memory.velocity, moved)
        change = (speed - memory.first[LAST_SPEED]) / period
        memory.first[LAST_SPEED] = speed
        acceleration = cascade(arrays.acceleration[d], memory.acceleration, change)
        command += arrays.gains[d, INERTIA] * acceleration + arrays.gains[d, DAMPING] * speed
        if abs(speed) > arrays.gains[d, DEAD_BAND]:
            command += np.copysign(arrays.gains[d, COULOMB], speed)
    return command


@compiled_inline
def sample_local_loop(arrays: FeedbackArrays, d: int, memory: FeedbackMemory, reading: float) -> None:
    """One sample of the local loop: the force of its spring and damper [N] goes to the head of its queue."""
    moved = weigh_readings(arrays.fast_window[d], memory.fast_past, reading - memory.first[FIRST_READING])
    speed = cascade(arrays.fast_velocity[d], memory.fast_velocity, moved)
    queue = memory.queue
    for k in range(queue.size - 1, 0, -1):
        queue[k] = queue[k - 1]
    queue[0] = -(arrays.gains[d, LOCAL_STIFFNESS] * reading + arrays.gains[d, LOCAL_DAMPING] * speed)
