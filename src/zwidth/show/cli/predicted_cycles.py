"""Limit cycles of one wall: what harmonic balance predicts, and what a simulation finds there."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.progress import Progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zwidth.contact.limit_cycles import HarmonicBalance, LimitCycle
    from zwidth.loop.loop import Loop

    Floats = NDArray[np.float64]

NOT_PREDICTED: Final = ("noise", "programmable brakes")
STARTS: Final = (0.7, 1.4)  # of the predicted amplitude; the run that ends nearer to it is told
CYCLES: Final = 500  # that a run has, within these numbers of samples
FEWEST, MOST = 4_000, 60_000
COUNTS: Final = 5.0  # from which a device starts where no stable cycle is predicted
BY_FIRST: Final = (
    "harmonic balance: each nonlinear part as it acts on a sinus. Good to some per cent for vibrations of ten "
    "samples and more in a cycle; an estimate for what an encoder holds, or locks to the samples"
)
BY_HARMONICS: Final = (
    "harmonic balance with up to 16 odd harmonics of the limited force: a few per cent, and less good where a "
    "cycle has few samples and the force is far beyond its limit"
)


@dataclass(frozen=True)
class Met:
    """What a simulation finds.

    start, duration  [m] from the middle, [s]
    amplitude        of the sensor's motion in the last quarter [m];   frequency  [Hz]
    """

    start: float
    duration: float
    behaviour: str
    amplitude: float
    frequency: float


@dataclass(frozen=True)
class Predicted:
    """Limit cycles of one wall.

    verdict    of the linear loop
    cycles     by amplitude;   met  for each, None where it was not simulated
    otherwise  from some counts off, where no stable cycle is predicted within the range; None: not simulated
    rest       stiffest wall with a place to rest under every push;   quiet  without any vibration; None: unknown
    """

    stiffness: float
    damping: float
    offset: float
    verdict: str
    parts: tuple[str, ...]
    by: str
    balance: HarmonicBalance
    cycles: tuple[LimitCycle, ...]
    met: tuple[Met | None, ...]
    otherwise: Met | None
    rest: float | None
    quiet: float | None


def acting(loop: Loop) -> tuple[str, ...]:
    """What of a loop depends on the amplitude, in words; brakes and noise do not count."""
    return tuple(name for name in loop.nonlinear.left_out if name not in NOT_PREDICTED)


def predicted(
    loop: Loop, K: float, B: float, offset: float, largest: float, progress: Progress, *, simulate: bool
) -> Predicted:
    """Limit cycles on a two-sided wall, held against the simulation if asked for.

    largest  as far as the device can move to either side [m]
    """
    from zwidth.chart.verdict import judge
    from zwidth.contact.harmonics import with_harmonics
    from zwidth.contact.limit_cycles import harmonic_balance

    parts = acting(loop)
    balance = harmonic_balance(loop, K, B, offset=offset, largest_motion=largest, progress=progress)
    cycles, by = balance.cycles, BY_FIRST
    if parts == ("the force limit",):
        cycles, by = tuple(with_harmonics(loop, K, B, cycle) for cycle in cycles), BY_HARMONICS
    met: tuple[Met | None, ...] = (None,) * len(cycles)
    otherwise = None
    if simulate:
        progress("simulating", 0, 1)
        met = tuple(_met(loop, K, B, offset, cycle) if is_seen(cycle) else None for cycle in cycles)
        if not any(map(is_seen, cycles)):
            otherwise = _otherwise(loop, K, B, offset, cycles)
        progress("simulating", 1, 1)
    rest, quiet = _limits(loop, K, B)
    verdict = judge(loop, [K], [B]).names[0]
    return Predicted(K, B, offset, verdict, parts, by, balance, cycles, met, otherwise, rest, quiet)


def is_seen(cycle: LimitCycle) -> bool:
    """Does a vibration settle there, and can the device move so far?"""
    return cycle.stable and cycle.within_range


def _limits(loop: Loop, K: float, B: float) -> tuple[float | None, float | None]:
    from zwidth.contact.plane import device_plane

    if not K > 0.0:
        return None, None
    try:
        rest = float(2.0 * device_plane(loop, [K]).sigma[0] * K)
    except ValueError:  # no steps, or tied to the ground
        return None, None
    return rest, max(rest - 2.0 * abs(B) / loop.period, 0.0)


def _met(loop: Loop, K: float, B: float, offset: float, cycle: LimitCycle) -> Met:
    starts = [share * cycle.amplitude for share in STARTS]
    found = _run(loop, K, B, offset, starts, cycle.frequency_Hz)
    alive = [run for run in found if run.amplitude > 0.0 and run.behaviour != "converged"]
    return min(alive or found, key=lambda run: abs(log(max(run.amplitude, 1e-300) / cycle.amplitude)))


def _otherwise(loop: Loop, K: float, B: float, offset: float, cycles: tuple[LimitCycle, ...]) -> Met:
    """From some counts off, but within what is recovered from."""
    from zwidth.conditions.dry import reading_step

    quantum = reading_step(loop.plant)
    starts = [COUNTS * quantum] if quantum else [1e-3]
    starts += [0.5 * cycle.amplitude for cycle in cycles]
    frequency = cycles[0].frequency_Hz if cycles else 0.01 / loop.period
    return _run(loop, K, B, offset, [min(starts)], frequency)[0]


def _run(loop: Loop, K: float, B: float, offset: float, starts: list[float], frequency: float) -> list[Met]:
    import numpy as np

    from zwidth.contact.environments.wall import wall
    from zwidth.contact.simulate import Run, simulate_batch
    from zwidth.contact.verdict import judge_response
    from zwidth.model.modes import undeformed

    T = loop.period
    seconds = float(np.clip(CYCLES / frequency, FEWEST * T, MOST * T))
    middle, place = _middle(loop, offset)
    shape = undeformed(loop.plant)
    own = wall.values(stiffness=K, damping=B)
    runs = [
        Run(
            loop,
            own,
            start=(middle + start * shape, np.zeros(loop.plant.size)),
            wall_position=place,
            bound=max(1.0, 1e3 * start),
        )
        for start in starts
    ]
    found = []
    for start, response in zip(starts, simulate_batch(runs, wall, duration=seconds), strict=True):
        judged = judge_response(response)
        last = slice(-(len(response.truth) // 4), None)
        # between two counts a relay keeps up motions far below a step
        hunts = judged.behaviour == "converged" and np.ptp(response.reading[last]) > 0.0
        behaviour = "limit cycle" if hunts else judged.behaviour
        found.append(Met(start, seconds, behaviour, float(np.ptp(response.truth[last]) / 2.0), judged.frequency))
    return found


def _middle(loop: Loop, offset: float) -> tuple[Floats, float]:
    """Coordinates at which every encoder is that share of its step beyond a count, and what is read there without
    steps [m]."""
    import numpy as np

    counters = [part for part in loop.plant.nonlinear.counters if part.step > 0.0]
    if offset == 0.0 or not counters:
        return np.zeros(loop.plant.size), 0.0
    along = np.array([part.along for part in counters])
    middle = np.linalg.lstsq(along, offset * np.array([part.step for part in counters]), rcond=None)[0]
    return middle, float(loop.plant.sensor @ middle)


def cycle_speed(cycle: LimitCycle) -> float:
    """Velocity amplitude at the sensor, of the sinus [m/s]."""
    return 2.0 * pi * cycle.frequency_Hz * cycle.amplitude


def numbers(found: Predicted) -> dict[str, Any]:
    """What was predicted under the keys of --json."""
    balance = found.balance
    return {
        "verdict": found.verdict,
        "nonlinear": list(found.parts),
        "predicted_by": found.by,
        "limit_cycles": [
            {
                "amplitude_m": cycle.amplitude,
                "frequency_Hz": cycle.frequency_Hz,
                "stable": cycle.stable,
                "within_range": cycle.within_range,
                "force_N": cycle.force_amplitude,
                "velocity_m_per_s": cycle_speed(cycle),
                "simulated": told(met),
            }
            for cycle, met in zip(found.cycles, found.met, strict=True)
        ],
        "otherwise": told(found.otherwise),
        "largest_motion_m": balance.largest_motion,
        "leaves_range": balance.leaves_range,
        "resting_limit_N_per_m": found.rest,
        "quiet_limit_N_per_m": found.quiet,
        "growth": {
            "amplitude_m": balance.amplitude,
            "growth_per_s": balance.growth,
            "frequency_Hz": balance.frequency_Hz,
        },
    }


def told(met: Met | None) -> dict[str, Any] | None:
    """What a simulation finds, under the keys of --json."""
    if met is None:
        return None
    return {
        "behaviour": met.behaviour,
        "amplitude_m": met.amplitude,
        "frequency_Hz": met.frequency,
        "start_m": met.start,
        "duration_s": met.duration,
    }


def columns(document: dict[str, Any]) -> dict[str, list[Any]]:
    """The limit cycles as columns, one a line."""
    cycles = document["limit_cycles"]
    own = ("amplitude_m", "frequency_Hz", "stable", "within_range", "force_N", "velocity_m_per_s")
    made = {key: [cycle[key] for cycle in cycles] for key in own}
    for key in ("behaviour", "amplitude_m", "frequency_Hz"):
        made[f"simulated_{key}"] = [cycle["simulated"] and cycle["simulated"][key] for cycle in cycles]
    for key in ("stable", "within_range"):
        made[key] = ["true" if value else "false" for value in made[key]]
    return made
