"""The sampled computer of both simulators: encoders, velocity estimate, force filter, force limit, delay.

Each kernel works on one signal. The simulation of one rendered direction reads one coordinate and sends one
command; that of a whole mechanism reads the three coordinates of the handle, in which it filters the force, too,
and sends one command to each motor.

Random numbers that depend on nothing but where they are used: a batch comes out the same on any cores.

The arrays that the engine works on: devices, and the members of a batch; `computer` has those of the computers.

Leading axis D: devices of the batch, padded to one size with zeros; a member names its device by index.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_inline
from zwidth.loop.controller import Controller
from zwidth.loop.estimator import Estimator
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.estimators.kernels import foaw_estimate, levant_estimate
from zwidth.loop.estimators.levant import Levant
from zwidth.loop.loop_table import force_filter, low_pass_factors, velocity_estimator

LINEAR: Final = 0
FOAW: Final = 1
LEVANT: Final = 2


class Computer(NamedTuple):
    """One computer. Factors are rows (c2, c1, c0) of c2 d^2 + c1 d + c0 with d = z - 1, denominators monic.

    period     T [s]
    delay      whole samples that a command waits; the rest of the delay is the simulator's
    method     of the velocity estimate: LINEAR, FOAW or LEVANT;   tuning  parameters of the latter two
    memory     numbers that the estimate remembers of a coordinate
    window     (w,)       weights of the newest w readings, in a linear estimate
    estimator  (k, 2, 3)  numerator and denominator of each factor behind the estimate
    filter     (f, 2, 3)  of the force
    limit      largest force [N]
    """

    period: float
    delay: int
    method: int
    tuning: Floats
    memory: int
    window: Floats
    estimator: Floats
    filter: Floats
    limit: float


class Computers(NamedTuple):
    """D computers, each number of `Computer` with a leading axis (D, ...), padded to one size with zeros.

    window_size, estimator_size, filter_size  (D,)  how many weights and factors each has
    """

    period: Floats
    delay: Ints
    method: Ints
    tuning: Floats
    memory: Ints
    window: Floats
    window_size: Ints
    estimator: Floats
    estimator_size: Ints
    filter: Floats
    filter_size: Ints
    limit: Floats


class Signals(NamedTuple):
    """Memory of a computer with s coordinates and c commands.

    first     (s,)         the first reading
    past      (s, memory)  what the estimate looks back on
    stages    (s, k, 2)    states of the factors behind it
    filtered  (s, f, 2)    states of the force's filter
    queue     (c, delay + 2)  commands on their way, the newest first
    """

    first: Floats
    past: Floats
    stages: Floats
    filtered: Floats
    queue: Floats


class EstimateParameters(NamedTuple):
    """A velocity estimate in numbers, as in `Computer`; for FOAW and LEVANT `linear` is the filter behind it."""

    method: int
    tuning: Floats
    memory: int
    linear: Estimator


def estimate_parameters(controller: Controller) -> EstimateParameters:
    """Velocity estimate of the computer, as numbers for the kernels."""
    method = controller.velocity
    if not isinstance(method, Foaw | Levant):
        estimator = velocity_estimator(controller)
        return EstimateParameters(LINEAR, np.zeros(1), len(estimator.window), estimator)
    factors = low_pass_factors(controller.velocity_filter, controller.sampling_period)
    # numerators and denominators; no window
    rows = (np.array(part, dtype=np.float64).reshape(-1, 3) for part in factors)
    return EstimateParameters(
        FOAW if isinstance(method, Foaw) else LEVANT, method.parameters, method.memory_size, Estimator(*rows)
    )


def computers(controllers: Sequence[Controller], limits: Sequence[float]) -> Computers:
    """The computers of these controllers, whose largest forces are `limits` [N]."""
    estimates = [estimate_parameters(controller) for controller in controllers]
    windows = [estimate.linear.window for estimate in estimates]
    factors = [
        np.stack([estimate.linear.numerator, estimate.linear.denominator], axis=1) for estimate in estimates
    ]
    low_passes = [force_filter(controller) for controller in controllers]
    filters = [np.stack([low_pass.numerator, low_pass.denominator], axis=1) for low_pass in low_passes]
    return Computers(
        period=np.array([float(controller.sampling_period) for controller in controllers]),
        delay=np.array([controller.whole_delay for controller in controllers], dtype=np.int64),
        method=np.array([estimate.method for estimate in estimates], dtype=np.int64),
        tuning=_stacked([estimate.tuning for estimate in estimates]),
        memory=np.array([max(estimate.memory, 1) for estimate in estimates], dtype=np.int64),
        window=_stacked(windows),
        window_size=np.array([len(window) for window in windows], dtype=np.int64),
        estimator=_stacked(factors),
        estimator_size=np.array([len(rows) for rows in factors], dtype=np.int64),
        filter=_stacked(filters),
        filter_size=np.array([len(rows) for rows in filters], dtype=np.int64),
        limit=np.array(limits, dtype=np.float64),
    )


def _stacked(arrays: Sequence[Floats]) -> Floats:
    """Arrays of one rank along a new first axis, each padded with zeros to the largest size along every axis."""
    largest = np.max([array.shape for array in arrays], axis=0)
    stacked = np.zeros((len(arrays), *largest))
    for padded, array in zip(stacked, arrays, strict=True):
        padded[tuple(slice(size) for size in array.shape)] = array
    return stacked


@compiled
def computer_at(batch: Computers, d: int) -> Computer:
    """Computer d of a batch, without padding."""
    return Computer(
        batch.period[d],
        batch.delay[d],
        batch.method[d],
        batch.tuning[d],
        batch.memory[d],
        batch.window[d, : batch.window_size[d]],
        batch.estimator[d, : batch.estimator_size[d]],
        batch.filter[d, : batch.filter_size[d]],
        batch.limit[d],
    )


@compiled
def signals_of(computer: Computer, coordinates: int, commands: int) -> Signals:
    """The memory of a computer that has just been switched on, for so many coordinates and commands."""
    return Signals(
        first=np.zeros(coordinates),
        past=np.zeros((coordinates, computer.memory)),
        stages=np.zeros((coordinates, computer.estimator.shape[0], 2)),
        filtered=np.zeros((coordinates, computer.filter.shape[0], 2)),
        queue=np.zeros((commands, computer.delay + 2)),
    )


@compiled_inline
def read_encoder(place: float, step: float, noise: float, seed: np.uint64, sample: int, channel: int) -> float:
    """Reading of an encoder at a position: with its noise, rounded to the nearest step, half a step upwards.

    place, step  position and encoder step, in the encoder's unit; step 0: no rounding
    noise        standard deviation of what is added before rounding, in the same unit
    seed, sample  of the run's random numbers
    channel      number of the encoder: each draws noise of its own
    """
    if noise > 0.0:
        place += noise * normal_number(seed, sample, channel)
    return round_to_step(place, step)


@compiled_inline
def round_to_step(place: float, step: float) -> float:
    """The nearest multiple of an encoder's step, half a step upwards; the position itself for a step of 0."""
    if step > 0.0:
        return float(step * np.floor(place / step + 0.5))
    return place


@compiled_inline
def cascade(factors: Floats, states: Floats, signal: float) -> float:
    """A filter's next output for its next input: k factors in series, d = z - 1.

        (c2 d^2 + c1 d + c0)/(d^2 + d1 d + d0)     or, where the denominator's lead is 0,     (c1 d + c0)/(d + d0)

    In observer form, whose states (k, 2) s1, s2 are zero at rest at zero, of input x and output y:

        y = c2 x + s1,     d s1 = s2 + c1 x - d1 y,     d s2 = c0 x - d0 y

    factors  (k, 2, 3)  rows numerator and denominator, falling powers of d;   states  are moved on by one sample
    """
    for k in range(factors.shape[0]):
        c2, c1, c0 = factors[k, 0, 0], factors[k, 0, 1], factors[k, 0, 2]
        lead, d1, d0 = factors[k, 1, 0], factors[k, 1, 1], factors[k, 1, 2]
        first, second = states[k, 0], states[k, 1]
        if lead == 0.0:
            out = c1 * signal + first
            states[k, 0] = first + c0 * signal - d0 * out
        else:
            out = c2 * signal + first
            states[k, 0] = first + second + c1 * signal - d1 * out
            states[k, 1] = second + c0 * signal - d0 * out
        signal = out
    return signal


@compiled_inline
def weigh_readings(window: Floats, past: Floats, reading: float) -> float:
    """Weighted sum of the newest readings, this one first.

    window  (w,)  weights;   past  the readings before, the newest first; is moved on to include this one
    """
    total = float(window[0] * reading)
    for k in range(window.size - 1, 0, -1):
        total += window[k] * past[k - 1]
        past[k - 1] = past[k - 2] if k > 1 else reading
    return total


@compiled_inline
def estimate_velocity(computer: Computer, signals: Signals, s: int, reading: float, sample: int) -> float:
    """The estimated velocity of coordinate s [m/s] at a sample; before sample 0 it stood at its first reading.

    reading  of the coordinate [m];   signals  the computer's memory, which is moved on
    """
    if sample == 0:
        signals.first[s] = reading
    # counted from the first reading: a memory of zeros is then a device that has stood still before
    past, moved = signals.past[s], reading - signals.first[s]
    if computer.method == FOAW:
        speed = foaw_estimate(past, computer.tuning, moved, computer.period)
    elif computer.method == LEVANT:
        speed = levant_estimate(past, computer.tuning, moved, computer.period)
    else:
        speed = weigh_readings(computer.window, past, moved)
    return cascade(computer.estimator, signals.stages[s], speed)


@compiled_inline
def filter_force(computer: Computer, signals: Signals, s: int, force: float) -> float:
    """The force along coordinate s behind the force's filter."""
    return cascade(computer.filter, signals.filtered[s], force)


@compiled_inline
def clip(signal: float, limit: float) -> float:
    """The signal, cut off at +-limit."""
    return min(max(signal, -limit), limit)


@compiled_inline
def send(signals: Signals, c: int, command: float) -> None:
    """Put a command at the head of queue c."""
    queue = signals.queue
    for k in range(queue.shape[1] - 1, 0, -1):
        queue[c, k] = queue[c, k - 1]
    queue[c, 0] = command


@compiled_inline
def send_force(computer: Computer, signals: Signals, c: int, force: float) -> float:
    """Filter a force, cut it off at the limit and put it at the head of queue c. Returns the command [N]."""
    command = clip(filter_force(computer, signals, c, force), computer.limit)
    send(signals, c, command)
    return command


@compiled_inline
def arrived_command(computer: Computer, signals: Signals, c: int, part: int) -> float:
    """The command that acts on motor c before (part 0) or after (part 1) the newer one takes over."""
    return float(signals.queue[c, computer.delay + 1 - part])


@compiled
def scrambled(number: np.uint64) -> np.uint64:
    """SplitMix64's finaliser: neighbouring numbers go far apart (Steele, Lea and Flood 2014)."""
    number = (number ^ (number >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    number = (number ^ (number >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return number ^ (number >> np.uint64(31))


@compiled
def uniform(seed: np.uint64, sample: int, channel: int, draw: int) -> float:
    """Random number, uniform in (0, 1); the same for the same seed, sample, channel and draw."""
    # odd constants spread seed, sample and channel over 64 bits; of the result 53 fill a float's digits
    key = scrambled(seed + np.uint64(0x9E3779B97F4A7C15))
    key = scrambled(key ^ (np.uint64(sample) * np.uint64(0x9E3779B97F4A7C15)))
    key = scrambled(key + np.uint64(2 * channel + draw + 1) * np.uint64(0xD1B54A32D192ED03))
    # + 0.5: never 0, whose logarithm is taken
    return (float(key >> np.uint64(11)) + 0.5) * 2.0**-53


@compiled
def normal_number(seed: np.uint64, sample: int, channel: int) -> float:
    """Standard normal random number of a channel at a sample, by Box and Muller."""
    radius = np.sqrt(-2.0 * np.log(uniform(seed, sample, channel, 0)))
    return float(radius * np.cos(2.0 * np.pi * uniform(seed, sample, channel, 1)))


# Columns of a trace.
READING, TRUTH, VELOCITY, FORCE, HANDLE = range(5)
TRACES = 5
# Entries of the energy ledger, in this order: what each has put in since the start [J].
HAND, WALL, HOLD, ESTIMATE, QUANTISER, CONTROLLER, ACTUATOR, FRICTION, BRAKES, SPRINGS, STRUCTURE, STORED = range(
    12
)
ENTRIES = 12
# Entries of `PlantArrays.local`.
NOTHING_LOCAL, SAMPLE, LATER = range(3)


class PlantArrays(NamedTuple):
    """D plants between samples. An interval has P parts, at whose beginning a command may begin to act.

    transition  (D, P, R, N)    what N states become, and then, for each element, place and speed of its motion
    inputs      (D, P, F, R)    what a unit of a held force adds to all R: command, hand, elements
    substeps    (D, P)          how many in each part; 0 for a part that is none
    length      (D, P)          of a substep [s]
    new         (D, P)          1 once the new command acts, 0 as long as the one before it does
    local       (D, P)          what the local loop does at a part's beginning: NOTHING_LOCAL, take a SAMPLE, or,
                                as its delay ends between two of them, let the new command act (LATER)
    loss, work  (D, P, M, M)    quadratic forms of the ledger, M = N + F; size 0 without one
    energy      (D, N, N)
    size        (D,)            coordinates n: velocities stand n places after them
    kind        (D, E)          of each element;   numbers (D, E, 6)  its parameters, as `plant_step.element_force`
    along       (D, E, n)       motion each works on
    reading     (D, E, n)       what the computer reads for a sampled force
    sensor      (D, n)          what is read, as it is
    handle      (D, n)          where the hand is;   push (D, n)  where its push acts
    channel     (D, C, n)       motions that are counted;   step, weight, noise (D, C)
    encoder     (D, C)          numbers of the encoders, by which they draw their noise
    """

    transition: Floats
    inputs: Floats
    substeps: Ints
    length: Floats
    new: Ints
    local: Ints
    loss: Floats
    work: Floats
    energy: Floats
    size: Ints
    kind: Ints
    numbers: Floats
    along: Floats
    reading: Floats
    sensor: Floats
    handle: Floats
    push: Floats
    channel: Floats
    step: Floats
    weight: Floats
    noise: Floats
    encoder: Ints


class RunArrays(NamedTuple):
    """m runs of the engine, each with what differs from run to run.

    device      (m,)     index
    start       (m, R)   states at time 0, place and speed of each element's motion
    wall        (m,)     where the wall is [m]
    values      (m, P)   of the environment
    push        (m, 9)   the hand's (see `hand`);   reflex (m, 7)
    observer    (m, Q)   the passivity controller's; nan in the first: none
    seed        (m,)
    bound       (m,)     distance of the reading's motion from the wall at which a run stops [m]
    """

    device: Ints
    start: Floats
    wall: Floats
    values: Floats
    push: Floats
    reflex: Floats
    observer: Floats
    seed: NDArray[np.uint64]
    bound: Floats


class Records(NamedTuple):
    """Records of m runs of S samples; arrays of size 0 where they are not wanted.

    samples  (m,)           how many were run
    traces   (m, S, 5)      reading, truth, velocity, force, handle at each sample
    handle   (m, S p)       handle after each of the p substeps behind each sample
    ledger   (m, S, 12)     energies at each sample
    """

    samples: Ints
    traces: Floats
    handle: Floats
    ledger: Floats
