"""The operator in time: how he pushes, trembles and reaches, and the reflex that stiffens his arm."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, inf, isfinite, pi, sin
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled_lean
from zwidth.contact.computer import PlantArrays
from zwidth.contact.plant_step import (
    BRAKE_AFTER,
    BRAKE_COMMANDED,
    BRAKE_DAMPING,
    BRAKE_LAG,
    MEAN_DAMPING,
    MEAN_STIFFNESS,
    ONSET,
    REST,
    ROLE,
    VARYING,
)
from zwidth.model.operator import Operator
from zwidth.result import Documented, entry

# What stands in the first number of an element that varies.
BRAKE: Final = 0.0
ARM: Final = 1.0
GRASP: Final = 2.0

PUSH_NUMBERS: Final = 9
REFLEX_NUMBERS: Final = 7
# Entries of `Hand.push_numbers`; the two of a reach are its distance times the arm's stiffness and damping.
(
    PUSH,
    RAMP,
    REACH_SPRING,
    REACH_DAMPER,
    REACH_START,
    REACH_DURATION,
    TREMOR_AMPLITUDE,
    TREMOR_PULSATION,
    TREMOR_PHASE,
) = range(PUSH_NUMBERS)
# Entries of `Hand.reflex_numbers`: then stiffness and damping of the arm, and the same of the grasp.
THRESHOLD, LATENCY, RISE, ARM_AMOUNTS, GRASP_AMOUNTS = 0, 1, 2, 3, 5


@dataclass(frozen=True)
class Reach(Documented):
    """A reaching movement: the arm's rest position moves by minimum jerk (Flash and Hogan 1985).

        x_0(t) = distance (10 s^3 - 15 s^4 + 6 s^5),   s = (t - start)/duration

    distance [m], start [s], duration [s]
    Raises    ValueError  for a distance that is not finite, a negative start, a duration that is not positive
    """

    distance: float = field(metadata=entry("m"))
    start: float = field(default=0.0, metadata=entry("s"))
    duration: float = field(default=0.5, metadata=entry("s"))

    def __post_init__(self) -> None:
        """Raise ValueError for a distance, start or duration that is not allowed."""
        _check("distance", self.distance, "m", -inf)
        _check("start", self.start, "s", 0.0)
        _check("duration", self.duration, "s", 0.0, open_end=True)


@dataclass(frozen=True)
class Tremor(Documented):
    """A force amplitude sin(2 pi f t + phase); physiological tremor has 8 to 12 Hz.

    amplitude [N], frequency [Hz], phase [rad]
    Raises    ValueError  for a negative amplitude or frequency, or one that is not finite
    """

    amplitude: float = field(metadata=entry("N"))
    frequency: float = field(default=10.0, metadata=entry("Hz"))
    phase: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for an amplitude, frequency or phase that is not allowed."""
        _check("amplitude", self.amplitude, "N", 0.0)
        _check("frequency", self.frequency, "Hz", 0.0)
        _check("phase", self.phase, "rad", -inf)


@dataclass(frozen=True)
class Reflex(Documented):
    """A hand that stiffens: once the device's force has exceeded a threshold, stiffness and damping of arm and
    grasp grow after the latency towards their extra amounts, 1 - exp(-t/rise), about where the hand then is.

    threshold        [N]
    latency, rise    [s]; spinal reflexes take 20 to 50 ms, voluntary ones more than 100
    arm_stiffness, arm_damping      more of it, in the end [N/m], [N s/m]
    grasp_stiffness, grasp_damping  the same for the grasp
    Raises           ValueError  for numbers that are negative or not finite
    """

    threshold: float = field(metadata=entry("N"))
    latency: float = field(default=0.05, metadata=entry("s"))
    rise: float = field(default=0.05, metadata=entry("s"))
    arm_stiffness: float = field(default=0.0, metadata=entry("N/m", name="stiffness", before="latency"))
    arm_damping: float = field(default=0.0, metadata=entry("N s/m", name="damping", before="latency"))
    grasp_stiffness: float = 0.0
    grasp_damping: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for a number that is negative or not finite."""
        _check("threshold", self.threshold, "N", 0.0)
        _check("latency", self.latency, "s", 0.0)
        _check("rise", self.rise, "s", 0.0)
        for name in ("arm_stiffness", "grasp_stiffness"):
            _check(name, getattr(self, name), "N/m", 0.0)
        for name in ("arm_damping", "grasp_damping"):
            _check(name, getattr(self, name), "N s/m", 0.0)


@dataclass(frozen=True)
class Hand(Documented):
    """The operator at the handle and his movements: push, tremor, reach, reflex.

    operator   his passive arm and grasp; None: nobody, or the loop's plant has him already
    push       a constant force towards the wall [N], on the arm behind an elastic grasp, else on the handle
    ramp       time in which the push grows to it [s]
    reach, tremor, reflex   None: none
    Raises     ValueError  for a reflex or a reach without an operator
    """

    operator: Operator | None = None
    push: float = field(default=0.0, metadata=entry("N"))
    ramp: float = field(default=0.0, metadata=entry("s"))
    reach: Reach | None = field(default=None, metadata=entry())
    tremor: Tremor | None = field(default=None, metadata=entry(before="reach"))
    reflex: Reflex | None = field(default=None, metadata=entry())

    def __post_init__(self) -> None:
        """Raise ValueError for a push or ramp that is not allowed, or a movement that needs an operator."""
        _check("push", self.push, "N", -inf)
        _check("ramp", self.ramp, "s", 0.0)
        if self.operator is None and (self.reach is not None or self.reflex is not None):
            what = "reach" if self.reach is not None else "reflex"
            raise ValueError(f"a {what} needs an arm; give the hand an operator")

    @property
    def is_steady(self) -> bool:
        """Whether its force does not change in time by itself, so that a linear motion is exact with any steps."""
        return self.reflex is None and self.tremor is None and self.reach is None and not self.ramp

    @property
    def push_numbers(self) -> Floats:
        """Numbers (9,) for `hand_force`, PUSH to TREMOR_PHASE: push [N], ramp [s]; distance of the reach times
        stiffness [N] and damping [N s] of the arm, its start and duration [s]; amplitude [N], angular frequency
        [rad/s] and phase of the tremor. Zeros for a movement that there is not."""
        numbers = np.zeros(PUSH_NUMBERS)
        numbers[PUSH], numbers[RAMP] = self.push, self.ramp
        if self.reach is not None and self.operator is not None:
            distance = self.reach.distance
            numbers[REACH_SPRING] = distance * self.operator.arm_stiffness
            numbers[REACH_DAMPER] = distance * self.operator.arm_damping
            numbers[REACH_START], numbers[REACH_DURATION] = self.reach.start, self.reach.duration
        if self.tremor is not None:
            numbers[TREMOR_AMPLITUDE:] = self.tremor.amplitude, 2.0 * pi * self.tremor.frequency, self.tremor.phase
        return numbers

    @property
    def reflex_numbers(self) -> Floats:
        """Fields of the reflex (7,) in order, for `sample_brakes_and_reflexes`; an infinite threshold for none."""
        reflex = self.reflex
        if reflex is None:
            return np.array([inf, *np.zeros(REFLEX_NUMBERS - 1)])
        amounts = (reflex.arm_stiffness, reflex.arm_damping, reflex.grasp_stiffness, reflex.grasp_damping)
        return np.array([reflex.threshold, reflex.latency, reflex.rise, *amounts])


def _check(name: str, value: float, unit: str, least: float, *, open_end: bool = False) -> None:
    """Raise ValueError, with name and unit, for a number that is not finite or below `least`.

    open_end  True: `least` itself is not allowed either
    """
    if not isfinite(value) or value < least or (open_end and value == least):
        allowed = "finite" if least == -inf else "positive" if open_end else "finite and not negative"
        raise ValueError(f"{name} must be {allowed} [{unit}], got {value!r}")


@compiled_lean
def hand_force(numbers: Floats, m: int, time: float) -> float:
    """Force by push, reach and tremor of run m at a time [N]; numbers (., 9) as of `Hand.push_numbers`."""
    push, ramp = numbers[m, PUSH], numbers[m, RAMP]
    force = float(push * min(time / ramp, 1.0) if ramp > 0.0 else push)
    start, duration = numbers[m, REACH_START], numbers[m, REACH_DURATION]
    if duration > 0.0 and time > start:
        # the arm's spring and damper pull towards its rest position x_0(t): see `Reach`, with its derivative
        s = min((time - start) / duration, 1.0)
        force += numbers[m, REACH_SPRING] * s * s * s * (10.0 + s * (6.0 * s - 15.0))
        force += numbers[m, REACH_DAMPER] * 30.0 * s * s * (1.0 - s) * (1.0 - s) / duration
    if numbers[m, TREMOR_AMPLITUDE] != 0.0:
        force += numbers[m, TREMOR_AMPLITUDE] * sin(numbers[m, TREMOR_PULSATION] * time + numbers[m, TREMOR_PHASE])
    return force


@compiled_lean
def sample_brakes_and_reflexes(
    devices: PlantArrays,
    d: int,
    reflex: Floats,
    time: float,
    period: float,
    force: float,
    states: Floats,
    memory: Floats,
) -> None:
    """At a sample: what brakes and reflexes are to become, into memory (E, 4).

    reflex  (7,)  `Hand.reflex_numbers`;   force  that the environment asks for [N];   states (R,)  of the plant
    memory  of a brake: BRAKE_COMMANDED, its damping while the environment asks for a force, else 0
            of a reflex: REST, where it begins, and ONSET, the time of its onset plus one period, so that 0 says
            not yet; negative once it acts, which begins at a sample
    """
    n = devices.size[d]
    for e in range(devices.kind.shape[1]):
        if devices.kind[d, e] != VARYING:
            continue
        if devices.numbers[d, e, ROLE] == BRAKE:
            memory[e, BRAKE_COMMANDED] = devices.numbers[d, e, BRAKE_DAMPING] if force != 0.0 else 0.0
            continue
        if memory[e, ONSET] == 0.0 and abs(force) > reflex[THRESHOLD]:
            memory[e, ONSET] = time + period + reflex[LATENCY]
        if memory[e, ONSET] > 0.0 and time + period >= memory[e, ONSET]:
            memory[e, ONSET] = -memory[e, ONSET]
            rest = 0.0
            for k in range(n):
                rest += devices.along[d, e, k] * states[k]
            memory[e, REST] = rest


@compiled_lean
def step_brakes_and_reflexes(
    devices: PlantArrays, d: int, reflex: Floats, m: int, time: float, h: float, period: float, memory: Floats
) -> None:
    """Mean stiffness and damping of the brakes and reflexes of run m over a substep, into memory (E, 4).

    reflex  (., 7)  `Hand.reflex_numbers`;   time, h  begin and length of the substep [s];   period  T [s]
    """
    for e in range(devices.kind.shape[1]):
        if devices.kind[d, e] != VARYING:
            continue
        role = devices.numbers[d, e, ROLE]
        if role == BRAKE:
            wanted, lag, now = memory[e, BRAKE_COMMANDED], devices.numbers[d, e, BRAKE_LAG], memory[e, BRAKE_AFTER]
            fade = exp(-h / lag) if lag > 0.0 else 0.0
            # the mean over the substep of the exponential approach to what is wanted
            memory[e, MEAN_DAMPING] = wanted + (now - wanted) * ((1.0 - fade) * lag / h)
            memory[e, BRAKE_AFTER] = wanted + (now - wanted) * fade
        elif memory[e, ONSET] < 0.0:
            # in the middle of the substep, since the onset
            since = time + 0.5 * h + memory[e, ONSET] + period
            amounts = GRASP_AMOUNTS if role == GRASP else ARM_AMOUNTS
            level = 1.0 - exp(-since / reflex[m, RISE]) if reflex[m, RISE] > 0.0 else 1.0
            memory[e, MEAN_STIFFNESS] = reflex[m, amounts] * level
            memory[e, MEAN_DAMPING] = reflex[m, amounts + 1] * level
