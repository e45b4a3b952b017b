"""Limit cycles of a device on one wall, by harmonic balance, and each held against a simulation."""

from __future__ import annotations

from math import inf
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.verdict import judge
from zwidth.conditions.traits import reading_step
from zwidth.contact.environments.walls import wall
from zwidth.contact.friction_quantisation_plane import device_plane
from zwidth.contact.harmonic_balance import LimitCycle, harmonic_balance, with_harmonics
from zwidth.contact.limit_cycle_prediction import LimitCyclePrediction, SimulatedVibration, answered_cycles
from zwidth.contact.loop_simulation import LARGEST_MOTION, Run, simulate_batch
from zwidth.contact.time_response import Behaviour, Judgement, TimeResponse, judge_response
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.unsupported_feedback import refuse_feedback, refuse_load
from zwidth.model.argument_checks import check_number, require
from zwidth.model.modes import least_deforming_motion
from zwidth.progress import Progress

NOT_PREDICTED: Final = ("noise", "programmable brakes")
STARTS: Final = (0.7, 1.4)  # of the predicted amplitude; the run that ends nearer to it is reported
CYCLES: Final = 500  # that a run has, within these numbers of samples
FEWEST, MOST = 4_000, 60_000
COUNTS: Final = 5.0  # from which a device starts where no stable cycle is predicted
# Depths, times the one at which the spring alone takes all of the force limit, from which a device is let go
# besides: with fewer, a vibration that only large motions fall into is missed.
DEEP: Final = (2.0, 10.0)
SMALL: Final = 1e-3  # m, from which one without encoder steps does
# Change of a vibration's logarithm between the last quarters of a run, below which it has settled: with more, one
# that still nears another, slowly, would count as a limit cycle of its own.
SETTLED: Final = 0.01
BY_FIRST: Final = (
    "harmonic balance: each nonlinear part as it acts on a sine; its error is not known where no simulation "
    "confirms it"
)
BY_HARMONICS: Final = (
    "harmonic balance with up to 16 odd harmonics of the limited force; its error is not known where no "
    "simulation confirms it"
)


class NothingNonlinearError(ValueError):
    """Nothing in a device depends on the amplitude, so that no vibration keeps its size."""

    def __init__(self) -> None:
        super().__init__(
            "nothing in this device depends on the amplitude, so it has no limit cycle; give it dry "
            "friction, encoder steps or a largest force"
        )


class NoEncoderStepsError(ValueError):
    """A device without encoder steps, for which a place between two steps was given."""

    def __init__(self) -> None:
        super().__init__("offset lies between two encoder steps, and the device has none; leave it at 0")


def predict_limit_cycles(
    point: OperatingPoint,
    stiffness: float,
    damping: float,
    *,
    offset: float = 0.0,
    simulate: bool = True,
    progress: Progress | None = None,
) -> LimitCyclePrediction:
    """Limit cycles of a device on a two-sided wall, held against simulations.

    point               the device, and the operator who holds it
    stiffness, damping  of the wall [N/m], [N s/m]
    offset    middle of the vibrations as a share of each encoder's step: 0 on a count, 0.5 between two, the worst
              that a constant push can do
    simulate  simulate from near each stable cycle within the range, or from close by where there is none
    progress  called with a stage's name, steps done, steps of all
    Raises    NothingNonlinearError   where nothing depends on the amplitude
              NoEncoderStepsError     for an offset where no encoder has steps
              ValueError              for a wall that is not finite, an offset beyond half a step
              HysteresisError, UnmovedError  (loop.sections) for plants that no wall moves, or not in time
              what `OperatingPoint.plant` raises

    >>> from dataclasses import replace
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.nonlinear import Friction, Nonlinear
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> mass = Plant(0.1 * one[:, None], 0.1 * one[:, None], np.zeros((1, 1)), one, one)
    >>> rubbing = replace(mass, nonlinear=Nonlinear(friction=(Friction(one, 0.01),)))
    >>> predict_limit_cycles(OperatingPoint(Controller(0.001), given_plant=rubbing), 400.0, 0.0)
    LimitCyclePrediction: wall of 400 N/m, 0 N s/m, unstable if linear; dry friction
      0.002015 m at 10.06 Hz, unstable
    """
    parts = amplitude_dependent(point, offset)
    check_number("stiffness", stiffness, "N/m")
    check_number("damping", damping, "N s/m")
    loop, K, B = point.loop, stiffness, damping
    balance = harmonic_balance(loop, K, B, offset=offset, largest_motion=largest_motion(point), progress=progress)
    cycles, by = balance.cycles, BY_FIRST
    if parts == ("the force limit",):
        cycles, by = tuple(with_harmonics(loop, K, B, cycle) for cycle in cycles), BY_HARMONICS
    runs: list[list[SimulatedVibration]] = [[] for _ in cycles]
    otherwise: SimulatedVibration | None = None
    others: list[SimulatedVibration] = []
    if simulate:
        tell = progress or (lambda stage, done, of: None)
        tell("simulating", 0, 1)
        runs = [_simulated(loop, K, B, offset, cycle) if settles(cycle) else [] for cycle in cycles]
        if not any(map(settles, cycles)):
            otherwise = _simulate_small_start(loop, K, B, offset, cycles)
            others.append(otherwise)
        others += _simulate_large_starts(loop, K, B, offset, cycles, balance.largest_motion)
        tell("simulating", 1, 1)
    found = answered_cycles(cycles, runs, others, balance.largest_motion)
    resting, quiet = _limits(loop, K, B)
    return LimitCyclePrediction(
        wall_stiffness=K,
        wall_damping=B,
        offset=offset,
        verdict=judge(loop, [K], [B]).names[0],
        nonlinear=parts,
        left_out=tuple(name for name in point.linear_omissions if name in NOT_PREDICTED),
        predicted_by=by,
        balance=balance,
        answers=found.cycles,
        contradicted=found.contradicted,
        small_start_vibration=otherwise,
        resting_limit=resting,
        quiet_limit=quiet,
        was_simulated=simulate,
    )


def amplitude_dependent(point: OperatingPoint, offset: float = 0.0) -> tuple[str, ...]:
    """Name the parts of a device that depend on the amplitude of a vibration; brakes and noise do not count.

    Raises  what `predict_limit_cycles` raises before it computes
    """
    require("point", point, OperatingPoint)
    check_number("offset", offset, "steps")
    if abs(offset) > 0.5:
        raise ValueError(f"offset must be from -0.5 to 0.5 of an encoder's step, got {offset:g}")
    loop = point.loop
    refuse_feedback(loop.controller, "limit cycles are not predicted", "simulate, or leave it out")
    refuse_load(loop.plant, "limit cycles are not predicted", "simulate, or leave the load out")
    _ = loop.sections  # refuses plants that no wall moves, or not in time
    parts = tuple(name for name in loop.nonlinear.kinds if name not in NOT_PREDICTED)
    if not parts:
        raise NothingNonlinearError
    if offset and "encoder steps" not in parts:
        raise NoEncoderStepsError
    return parts


def largest_motion(point: OperatingPoint) -> float:
    """Largest motion of a device to either side of its posture [m].

    Returns  for a mechanism how far its handle gets along the direction, in its assembly; for a given plant as far
             as any device does
    """
    if point.handle_range is None:
        return LARGEST_MOTION
    back, forth = point.handle_range
    # at the edge of the workspace it moves to one side only, and about a middle within that
    return min(-back, forth) or max(-back, forth) / 2.0


def settles(cycle: LimitCycle) -> bool:
    """Whether the cycle is stable and within the range of the device."""
    return cycle.stable and cycle.within_range


def _limits(loop: Loop, K: float, B: float) -> tuple[float | None, float | None]:
    if not K > 0.0:
        return None, None
    try:
        resting = float(2.0 * device_plane(loop, [K]).sigma[0] * K)
    except ValueError:  # no steps, or tied to the ground
        return None, None
    return resting, max(resting - 2.0 * abs(B) / loop.period, 0.0)


def _simulated(loop: Loop, K: float, B: float, offset: float, cycle: LimitCycle) -> list[SimulatedVibration]:
    """Simulate from both sides of a cycle."""
    return _runs(loop, K, B, offset, [share * cycle.amplitude for share in STARTS], cycle.frequency_Hz)


def _simulate_small_start(
    loop: Loop, K: float, B: float, offset: float, cycles: tuple[LimitCycle, ...]
) -> SimulatedVibration:
    """Simulate from a start of a few counts, well within the smallest cycle, which should decay."""
    quantum = reading_step(loop.plant)
    starts = [COUNTS * quantum] if quantum else [SMALL]
    starts += [0.5 * cycle.amplitude for cycle in cycles]
    frequency = cycles[0].frequency_Hz if cycles else 0.01 / loop.period
    return _runs(loop, K, B, offset, [min(starts)], frequency)[0]


def _simulate_large_starts(
    loop: Loop, K: float, B: float, offset: float, cycles: tuple[LimitCycle, ...], largest: float
) -> list[SimulatedVibration]:
    """Simulate from where a force at its limit may keep up a vibration that small ones do not grow into."""
    limit = loop.nonlinear.force_limit
    if not (limit < inf and K > 0.0):
        return []
    starts = [deep * limit / K for deep in DEEP] + [
        STARTS[-1] * cycle.amplitude for cycle in cycles if cycle.within_range and not cycle.stable
    ]
    frequency = cycles[0].frequency_Hz if cycles else 0.01 / loop.period
    within = sorted({start for start in starts if start < largest})
    return _runs(loop, K, B, offset, within, frequency) if within else []


def _runs(
    loop: Loop, K: float, B: float, offset: float, starts: list[float], frequency: float
) -> list[SimulatedVibration]:
    T = loop.period
    seconds = float(np.clip(CYCLES / frequency, FEWEST * T, MOST * T))
    middle, place = _middle(loop, offset)
    shape = least_deforming_motion(loop.plant)
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
    simulations = []
    for start, response in zip(starts, simulate_batch(runs, wall, duration=seconds), strict=True):
        judged = judge_response(response)
        quarter = len(response.truth) // 4
        amplitude = float(np.ptp(response.truth[-quarter:]) / 2.0)
        behaviour = behaviour_at_the_end(response, judged, quarter)
        simulations.append(SimulatedVibration(start, seconds, behaviour, amplitude, judged.frequency))
    return simulations


def behaviour_at_the_end(response: TimeResponse, judged: Judgement, quarter: int) -> Behaviour:
    """How a run ends, where that is to be held against a prediction; quarter is in samples."""
    if judged.behaviour == "converged" and np.ptp(response.reading[-quarter:]) > 0.0:
        # between two counts a relay keeps up motions far below a step; noise alone does, too
        return "undecided" if response.noise > 0.0 else "limit cycle"
    if judged.behaviour == "limit cycle" and abs(judged.growth) * quarter > SETTLED:
        return "undecided"
    return judged.behaviour


def _middle(loop: Loop, offset: float) -> tuple[Floats, float]:
    """Coordinates at which every encoder is that share of its step beyond a count, and what is read there without
    steps [m]."""
    counters = [part for part in loop.plant.nonlinear.counters if part.step > 0.0]
    if offset == 0.0 or not counters:
        return np.zeros(loop.plant.size), 0.0
    along = np.array([part.along for part in counters])
    middle = np.linalg.lstsq(along, offset * np.array([part.step for part in counters]), rcond=None)[0]
    return middle, float(loop.plant.sensor @ middle)
