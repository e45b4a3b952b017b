"""Random devices, predicted and simulated by the engine: what docs/limit-cycles.md says of how far to trust it.

The wall is two-sided and unstable or stable by some margin; a wall that begins between two counts leaves no place
to rest on one, as a push of K Delta/2 does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tests.contact.limit_cycles_cases import random_wall, vibration
from zwidth.contact import Run, TimeResponse, limit_cycles, simulate_batch, wall
from zwidth.contact.harmonic_balance import LimitCycle
from zwidth.loop import Loop
from zwidth.model import Counter, Friction, Nonlinear


def with_nonlinearities(loop: Loop, *, coulomb: float = 0.0, step: float = 0.0, limit: float = np.inf) -> Loop:
    """The loop with friction and encoder at the sensor, and a limit on the force."""
    sensor = loop.plant.sensor
    friction = (Friction(sensor, coulomb),) if coulomb else ()
    counters = (Counter(sensor, step),) if step else ()
    return Loop(replace(loop.plant, nonlinear=Nonlinear(friction, counters, (), (), limit)), loop.controller)


def run(loop: Loop, K: float, B: float, starts, *, seconds: float, between: bool = False) -> list[TimeResponse]:
    """From each of some starts [m] of the undeformed device."""
    step = loop.plant.nonlinear.counters[0].step if loop.plant.nonlinear.counters else 0.0
    own = wall.values(stiffness=K, damping=B)
    middle = 0.5 * step if between else 0.0
    runs = [Run(loop, own, start_position=middle + float(x), wall_position=middle) for x in starts]
    return simulate_batch(runs, wall, duration=seconds)


def is_moving(response: TimeResponse) -> bool:
    """Does the reading still change in the last quarter?"""
    last = response.reading[-len(response.reading) // 4 :]
    return bool(np.ptp(last) > 0.5 * response.quantum)


def long_enough(loop: Loop, frequency: float, cycles: float) -> float:
    """So many cycles, of at least 4000 samples and at most 60 000 [s]."""
    T = loop.period
    return float(np.clip(cycles / frequency, 4000.0 * T, 60_000.0 * T))


@dataclass(frozen=True)
class PredictedAndSimulated:
    """A predicted stable cycle and what the simulation has there; nan where it came to rest."""

    loop: Loop
    cycle: LimitCycle
    amplitude: float
    frequency: float

    @property
    def amplitude_ratio(self) -> float:
        return self.amplitude / self.cycle.amplitude

    @property
    def frequency_ratio(self) -> float:
        return self.frequency / self.cycle.frequency_Hz

    @property
    def samples(self) -> float:
        """In a predicted cycle."""
        return 1.0 / (self.cycle.frequency_Hz * self.loop.period)


def simulate_cycle(
    loop: Loop, K: float, B: float, cycle: LimitCycle, *, between: bool = False
) -> PredictedAndSimulated:
    """What is found from a little below and a little above a predicted cycle; the nearer one."""
    seconds = long_enough(loop, cycle.frequency_Hz, 1000.0)
    found = []
    for response in run(loop, K, B, cycle.amplitude * np.array([0.7, 1.4]), seconds=seconds, between=between):
        if response.quantum and not is_moving(response):
            continue
        found.append(vibration(response.truth, loop.period))
    amplitude, frequency = min(
        found, key=lambda pair: abs(np.log(pair[0] / cycle.amplitude)), default=(np.nan, np.nan)
    )
    return PredictedAndSimulated(loop, cycle, amplitude, frequency)


def saturated_cycles(
    devices: int, excess: tuple[float, float], seed: int = 11
) -> Iterator[tuple[float, float, PredictedAndSimulated]]:
    """Walls beyond the edge by some factor whose force is limited, K and B, and their stable cycles."""
    rng = np.random.default_rng(seed)
    for i in range(devices):
        loop, K, B = random_wall(rng, ("mass", "two-mass")[i % 2], excess)
        own = with_nonlinearities(loop, limit=1.0)
        for cycle in limit_cycles(own, K, B):
            if cycle.stable:
                yield K, B, simulate_cycle(own, K, B, cycle)


STARTS = np.array([0.3, 0.55, 1.3, 3.0, 7.0])  # counts


def quantised_cycles(
    devices: int, friction: float = 0.0, seed: int = 12
) -> Iterator[tuple[list[PredictedAndSimulated], bool]]:
    """On a count: stable cycles of stable walls, and does anything move from any of the starts?

    friction  C/(K Delta)
    """
    rng = np.random.default_rng(seed)
    for i in range(devices):
        loop, K, B = random_wall(rng, ("mass", "two-mass")[i % 2], (0.2, 0.95))
        own = with_nonlinearities(loop, coulomb=friction * K, step=1.0)
        pairs = [simulate_cycle(own, K, B, cycle) for cycle in limit_cycles(own, K, B) if cycle.stable]
        responses = run(own, K, B, STARTS, seconds=30_000.0 * loop.period)
        yield pairs, any(is_moving(response) for response in responses)


def cycles_between_counts(
    devices: int, friction: float, seed: int = 13
) -> Iterator[tuple[list[PredictedAndSimulated], bool]]:
    """The same between two counts."""
    rng = np.random.default_rng(seed)
    for i in range(devices):
        loop, K, B = random_wall(rng, ("mass", "two-mass")[i % 2], (0.2, 0.95))
        own = with_nonlinearities(loop, coulomb=friction * K, step=1.0)
        pairs = [
            simulate_cycle(own, K, B, cycle, between=True)
            for cycle in limit_cycles(own, K, B, offset=0.5)
            if cycle.stable
        ]
        responses = run(own, K, B, STARTS, seconds=30_000.0 * loop.period, between=True)
        yield pairs, any(is_moving(response) for response in responses)


def beyond_the_quiet_limit(devices: int, ratio: float, seed: int = 14) -> int:
    """How many devices vibrate, with so many times the stiffness that the quiet limit has."""
    rng, count = np.random.default_rng(seed), 0
    for i in range(devices):
        loop, K, B = random_wall(rng, ("mass", "two-mass")[i % 2], (0.2, 0.95))
        own = with_nonlinearities(loop, coulomb=0.5 * (K + 2.0 * B / loop.period) / ratio, step=1.0)
        seconds = 15_000.0 * loop.period
        found = [run(own, K, B, STARTS, seconds=seconds, between=between) for between in (False, True)]
        count += any(is_moving(response) for part in found for response in part)
    return count
