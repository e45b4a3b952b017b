"""Limit cycles of a device on one wall, by harmonic balance, and each held against a simulation.

Limit cycles of a device on one wall: what is predicted, and what a simulation finds there.

Which limit cycles a device has: those that harmonic balance predicts, held against simulations of the same
wall.

Harmonic balance has no bound for its error. What it predicts stands where a simulation ends in the same vibration;
where the two part, the simulation is the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf, log, nan
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from zwidth.argument import check_arguments
from zwidth.arrays import Floats
from zwidth.chart.verdict import judge
from zwidth.conditions.traits import reading_step
from zwidth.contact.environments.walls import wall
from zwidth.contact.friction_quantisation_plane import device_plane
from zwidth.contact.harmonic_balance import HarmonicBalance, LimitCycle, harmonic_balance, with_harmonics
from zwidth.contact.loop_simulation import LARGEST_MOTION, Run, simulate_batch
from zwidth.contact.time_response import Behaviour, Judgement, TimeResponse, judge_response
from zwidth.errors import ArgumentError, NoAnswerError
from zwidth.loop.controller import check_no_feedback, check_no_load
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind, check_number
from zwidth.model.modes import least_deforming_motion
from zwidth.progress import Progress
from zwidth.questions import LIMIT_CYCLES
from zwidth.result import Documented, Result, documented, entry, keys_of

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
    offset    middle of the vibration, as a share of an encoder step: 0 on a count, 0.5 halfway between two, the
              most that a constant push can do
    simulate  simulate from near each stable cycle within the range, or from close by where there is none, and from
              large starts where the force is limited
    progress  called with a stage's name, steps done, steps of all
    Raises    NoAnswerError   where nothing depends on the amplitude
              ArgumentError     for an offset where no encoder has steps
              ValueError              for a wall that is not finite, an offset beyond half a step
              FeedbackError     for a computer with feedback beside the wall law, and for a load
              HysteresisError, UnmovedError  (loop.sections) for plants that no wall moves, or not in time
              what `OperatingPoint.plant` raises

    >>> from dataclasses import replace
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Friction, Nonlinear
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
    cycles, method = _balanced_cycles(loop, K, B, balance, parts)
    runs = _Simulations([[] for _ in cycles], None, [])
    if simulate:
        tell = progress or (lambda stage, done, of: None)
        tell("simulating", 0, 1)
        runs = _simulate_all(loop, K, B, offset, cycles, balance.largest_motion)
        tell("simulating", 1, 1)
    found = answered_cycles(cycles, runs.near_cycles, runs.others, balance.largest_motion)
    resting, quiet = _stiffest_without_hunting(loop, K, B)
    return LimitCyclePrediction(
        wall_stiffness=K,
        wall_damping=B,
        offset=offset,
        verdict=judge(loop, [K], [B]).names[0],
        nonlinear=parts,
        left_out=tuple(name for name in point.linear_omissions if name in NOT_PREDICTED),
        predicted_by=method,
        balance=balance,
        answers=found.cycles,
        contradicted=found.contradicted,
        small_start_vibration=runs.small_start,
        resting_limit=resting,
        quiet_limit=quiet,
        was_simulated=simulate,
    )


def amplitude_dependent(point: OperatingPoint, offset: float = 0.0) -> tuple[str, ...]:
    """Name the parts of a device that depend on the amplitude of a vibration; brakes and noise do not count.

    offset  as in `predict_limit_cycles`
    Raises  what that raises before it computes
    """
    check_kind("point", point, OperatingPoint)
    check_arguments(LIMIT_CYCLES, offset=offset)
    loop = point.loop
    check_no_feedback(loop.controller, "limit cycles are not predicted", "simulate, or leave it out")
    check_no_load(loop.plant, "limit cycles are not predicted", "simulate, or leave the load out")
    _ = loop.sections  # refuses plants that no wall moves, or not in time
    parts = tuple(name for name in loop.nonlinear.kinds if name not in NOT_PREDICTED)
    if not parts:
        raise NoAnswerError(
            "nothing in this device depends on the amplitude, so it has no limit cycle; give it dry friction, "
            "encoder steps or a largest force"
        )
    if offset and "encoder steps" not in parts:
        raise ArgumentError("offset", "lies between two encoder steps, and the device has none; leave it at 0")
    return parts


def largest_motion(point: OperatingPoint) -> float:
    """Largest motion of a device to either side of its posture [m].

    Returns  for a mechanism how far its handle gets along the direction, in its assembly; for a given plant as far
             as any device does
    """
    if point.handle_range is None:
        return LARGEST_MOTION
    back, forth = point.handle_range
    # at the edge of the workspace it moves to one side only, and then about a middle within that
    return min(-back, forth) or max(-back, forth) / 2.0


def settles(cycle: LimitCycle) -> bool:
    """Whether the cycle is stable and within the range of the device."""
    return cycle.stable and cycle.within_range


def _balanced_cycles(
    loop: Loop, K: float, B: float, balance: HarmonicBalance, parts: tuple[str, ...]
) -> tuple[tuple[LimitCycle, ...], str]:
    """Return the cycles of a balance on a wall (K [N/m], B [N s/m]), with harmonics where only the force is
    limited, and the method in words."""
    cycles, method = balance.cycles, BY_FIRST
    if parts == ("the force limit",):
        cycles, method = tuple(with_harmonics(loop, K, B, cycle) for cycle in cycles), BY_HARMONICS
    return cycles, method


class _Simulations(NamedTuple):
    """Where simulations of one wall end: from both sides of each cycle, from a small start, from all other starts.

    near_cycles  one list for each cycle, empty where it was not simulated;   small_start  None: not simulated
    """

    near_cycles: list[list[SimulatedVibration]]
    small_start: SimulatedVibration | None
    others: list[SimulatedVibration]


def _simulate_all(
    loop: Loop, K: float, B: float, offset: float, cycles: tuple[LimitCycle, ...], largest: float
) -> _Simulations:
    """Simulate a wall (K [N/m], B [N s/m]) from near each cycle that settles, from a small start where none does,
    and from large starts below the largest motion [m]."""
    runs = [_simulate_near_cycle(loop, K, B, offset, cycle) if settles(cycle) else [] for cycle in cycles]
    small_start, others = None, list[SimulatedVibration]()
    if not any(map(settles, cycles)):
        small_start = _simulate_small_start(loop, K, B, offset, cycles)
        others.append(small_start)
    others += _simulate_large_starts(loop, K, B, offset, cycles, largest)
    return _Simulations(runs, small_start, others)


def _stiffest_without_hunting(loop: Loop, K: float, B: float) -> tuple[float | None, float | None]:
    """Stiffest walls by `resting_limit` and `quiet_limit` [N/m]; None where they are not known."""
    if not K > 0.0:
        return None, None
    try:
        resting = float(2.0 * device_plane(loop, [K]).sigma[0] * K)  # 2 f_c/Delta
    except ValueError:  # no steps, or tied to the ground
        return None, None
    return resting, max(resting - 2.0 * abs(B) / loop.period, 0.0)


def _simulate_near_cycle(
    loop: Loop, K: float, B: float, offset: float, cycle: LimitCycle
) -> list[SimulatedVibration]:
    """Simulate the wall K [N/m], B [N s/m] from both sides of a cycle; where each run ends.

    offset  middle of the vibration, as a share of an encoder step
    """
    return _simulate_starts(loop, K, B, offset, [share * cycle.amplitude for share in STARTS], cycle.frequency_Hz)


def _simulate_small_start(
    loop: Loop, K: float, B: float, offset: float, cycles: tuple[LimitCycle, ...]
) -> SimulatedVibration:
    """Simulate from a start of a few counts, or SMALL without encoder steps, but well within the smallest cycle.

    K, B  of the wall [N/m], [N s/m];   offset  middle of the vibration, as a share of an encoder step
    """
    quantum = reading_step(loop.plant)  # encoder step of the reading [m], 0 without
    starts = [COUNTS * quantum] if quantum else [SMALL]
    starts += [0.5 * cycle.amplitude for cycle in cycles]
    frequency = cycles[0].frequency_Hz if cycles else 0.01 / loop.period  # unknown: a hundred samples a period
    return _simulate_starts(loop, K, B, offset, [min(starts)], frequency)[0]


def _simulate_large_starts(
    loop: Loop, K: float, B: float, offset: float, cycles: tuple[LimitCycle, ...], largest: float
) -> list[SimulatedVibration]:
    """Simulate from where a force at its limit may keep up a vibration that small ones do not grow into.

    cycles        predicted ones, of which the unstable give starts, too
    largest       motion of the device, beyond which no run starts [m]
    K, B, offset  as in `_simulate_small_start`
    Returns       where each run ends; none where the force has no limit, the wall no spring, or all starts are
                  beyond the largest motion
    """
    limit = loop.nonlinear.force_limit
    if not (limit < inf and K > 0.0):
        return []
    starts = [deep * limit / K for deep in DEEP] + [
        STARTS[-1] * cycle.amplitude for cycle in cycles if cycle.within_range and not cycle.stable
    ]
    frequency = cycles[0].frequency_Hz if cycles else 0.01 / loop.period  # unknown: a hundred samples a period
    within = sorted({start for start in starts if start < largest})
    return _simulate_starts(loop, K, B, offset, within, frequency) if within else []


def _simulate_starts(
    loop: Loop, K: float, B: float, offset: float, starts: list[float], frequency: float
) -> list[SimulatedVibration]:
    """Simulate a wall from starts [m] off the middle, for CYCLES periods of a frequency [Hz] but FEWEST to MOST
    samples; where each ends.

    K, B, offset  as in `_simulate_small_start`
    """
    T = loop.period
    seconds = float(np.clip(CYCLES / frequency, FEWEST * T, MOST * T))
    middle, wall_position = _middle(loop, offset)
    shape = least_deforming_motion(loop.plant)
    values = wall.values(stiffness=K, damping=B)
    runs = [
        Run(
            loop,
            values,
            start=(middle + start * shape, np.zeros(loop.plant.size)),
            wall_position=wall_position,
            bound=max(1.0, 1e3 * start),  # m, where it has grown beyond all that a device does
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
    """How a run ends, as `judge_response` says, but for what would mislead beside a predicted limit cycle.

    quarter  samples in a quarter of the run
    """
    if judged.behaviour == "converged" and np.ptp(response.reading[-quarter:]) > 0.0:
        # between two counts a relay keeps up motions far below a step; noise alone does, too
        return "undecided" if response.noise > 0.0 else "limit cycle"
    if judged.behaviour == "limit cycle" and abs(judged.growth) * quarter > SETTLED:
        return "undecided"
    return judged.behaviour


def _middle(loop: Loop, offset: float) -> tuple[Floats, float]:
    """Coordinates (n,) at which every encoder is the share `offset` of its step beyond a count, and what is read
    there without steps [m]."""
    counters = [part for part in loop.plant.nonlinear.counters if part.step > 0.0]
    if offset == 0.0 or not counters:
        return np.zeros(loop.plant.size), 0.0
    along = np.array([part.along for part in counters])
    middle = np.linalg.lstsq(along, offset * np.array([part.step for part in counters]), rcond=None)[0]
    return middle, float(loop.plant.sensor @ middle)


CycleSource = Literal["describing function", "simulation"]
MOST_TOLD: Final = 4  # cycles that a prediction shows of itself


@dataclass(frozen=True)
class SimulatedVibration(Documented):
    """Vibration that a simulation ends in.

    start, duration  [m] from the middle of the vibration, [s]
    behaviour        as in `time_response.Judgement`
    amplitude        of the sensor's motion in the last quarter [m];   frequency  [Hz]
    """

    start: float = field(metadata=entry("m"))
    duration: float = field(metadata=entry("s"))
    behaviour: str = field(metadata=entry(before="start"))
    amplitude: float = field(metadata=entry("m", before="start"))
    frequency: float = field(metadata=entry("Hz", before="start"))


def _predicted_tone(cycle: LimitCycle | None) -> dict[str, float] | None:
    """Amplitude [m] and frequency [Hz] of a predicted cycle by key; None for None."""
    return None if cycle is None else {"amplitude_m": cycle.amplitude, "frequency_Hz": cycle.frequency_Hz}


@dataclass(frozen=True)
class LimitCycleAnswer(Documented):
    """One limit cycle, and what it rests on.

    cycle      the answer
    source     "describing function": as harmonic balance predicts it; "simulation": as a simulation ends
    confirmed  True: a simulation ends in it; False: simulations from both sides of it end elsewhere; None: not
               simulated, or no run has settled
    simulated  where a simulation from near it ends; None: not simulated
    predicted  what harmonic balance predicts in its place; None: nothing
    """

    cycle: LimitCycle = field(metadata=entry(spread=True))
    source: CycleSource = field(metadata=entry(name="from"))
    confirmed: bool | None = field(metadata=entry())
    simulated: SimulatedVibration | None = field(metadata=entry())
    predicted: LimitCycle | None = field(metadata=entry(value=_predicted_tone, before="simulated"))

    @property
    @documented("m", before="source")
    def sensor_amplitude(self) -> float:
        """Amplitude of the sensor's motion [m], as in the cycle, under a key that says whose it is."""
        return self.cycle.amplitude


@dataclass(frozen=True, repr=False)
class LimitCyclePrediction(Result):
    """Limit cycles of a device on one two-sided wall.

    wall_stiffness, wall_damping   [N/m], [N s/m]
    offset                 middle of the vibrations, as a share of an encoder's step beyond a count
    verdict                of the linear loop: "stable", "unstable" or "undecided"
    nonlinear              what of the device depends on the amplitude, in words
    left_out               what of the device the prediction leaves out, in words
    predicted_by           the method, and what it is worth
    answers                the limit cycles by amplitude: predicted, or simulated where the two part
    contradicted           predicted cycles that no simulation has
    small_start_vibration  what it finds where no stable cycle is predicted within the range; None: not simulated
    resting_limit          stiffest wall on which there is a place to rest under every push [N/m]; None: not known
    quiet_limit            stiffest wall, of this damping, without any hunting [N/m]; None: not known
    balance                growth of vibrations over their amplitude, and as far as the device can move
    was_simulated          whether predictions were held against simulations
    """

    wall_stiffness: float = field(metadata=entry("N/m"))
    wall_damping: float = field(metadata=entry("N s/m"))
    offset: float = field(metadata=entry(name="offset_steps"))
    verdict: str = field(metadata=entry())
    nonlinear: tuple[str, ...] = field(metadata=entry())
    left_out: tuple[str, ...]
    predicted_by: str = field(metadata=entry())
    answers: tuple[LimitCycleAnswer, ...] = field(metadata=entry(name="limit_cycles"))
    contradicted: tuple[LimitCycleAnswer, ...] = field(metadata=entry())
    small_start_vibration: SimulatedVibration | None = field(metadata=entry(name="otherwise"))
    resting_limit: float | None = field(metadata=entry("N/m"))
    quiet_limit: float | None = field(metadata=entry("N/m"))
    balance: HarmonicBalance = field(metadata=entry(name="growth"))
    was_simulated: bool = True

    @property
    def none_found(self) -> str:
        """What is said where there is no limit cycle."""
        if self.contradicted:
            return "no limit cycle: what is predicted, the simulation does not have"
        return "no limit cycle is predicted" + (", and none was met by simulation" if self.was_simulated else "")

    @property
    @documented("m", before="resting_limit")
    def largest_motion(self) -> float:
        """How far the device can move to either side [m]."""
        return self.balance.largest_motion

    @property
    @documented(before="resting_limit")
    def leaves_range(self) -> bool:
        """Whether the largest vibrations within the range grow, so that nothing in the model limits them."""
        return self.balance.leaves_range

    @property
    def cycles(self) -> tuple[LimitCycle, ...]:
        """The limit cycles by amplitude."""
        return tuple(answer.cycle for answer in self.answers)

    @property
    def simulated(self) -> tuple[SimulatedVibration | None, ...]:
        """What a simulation finds for each; None: not simulated, as is none that is unstable or beyond the
        range."""
        return tuple(answer.simulated for answer in self.answers)

    @property
    def simulation_disagrees(self) -> bool:
        """Whether a simulation has another vibration than predicted, or none; it is the answer then."""
        return bool(self.contradicted) or any(answer.source == "simulation" for answer in self.answers)

    def table(self) -> dict[str, list[Any]]:
        """The limit cycles as columns, one a row."""
        rows = [cycle.document() for cycle in self.cycles]
        columns: dict[str, list[Any]] = {key: [_as_cell(row[key]) for row in rows] for key in keys_of(LimitCycle)}
        columns["from"] = [answer.source for answer in self.answers]
        columns["confirmed"] = [
            None if answer.confirmed is None else _as_cell(answer.confirmed) for answer in self.answers
        ]
        documents = [simulated.document() if simulated else {} for simulated in self.simulated]
        for name in ("behaviour", "amplitude_m", "frequency_Hz"):
            columns[f"simulated_{name}"] = [vibration.get(name) for vibration in documents]
        return columns

    def __repr__(self) -> str:
        """Lines with the wall, the linear verdict, and each limit cycle up to MOST_TOLD lines."""
        lines = [
            f"  {cycle.amplitude:.4g} m at {cycle.frequency_Hz:.4g} Hz, "
            + ("stable" if cycle.stable else "unstable")
            + ("" if cycle.within_range else ", beyond the range")
            + (", simulated" if answer.source == "simulation" else "")
            for answer in self.answers
            for cycle in [answer.cycle]
        ]
        if len(lines) > MOST_TOLD:
            lines = [*lines[: MOST_TOLD - 1], f"  and {len(lines) - MOST_TOLD + 1} more limit cycles"]
        return "\n".join(
            [
                f"LimitCyclePrediction: wall of {self.wall_stiffness:.6g} N/m, {self.wall_damping:.6g} N s/m, "
                f"{self.verdict} if linear; {', '.join(self.nonlinear)}",
                *(lines or [f"  {self.none_found}"]),
            ]
        )


def _as_cell(value: float | bool) -> float | str:
    """A value for a table's cell: true or false in words, a number as it is."""
    return str(value).lower() if isinstance(value, bool) else value


# Share by which a simulated amplitude or frequency may differ from the predicted one and confirm it: with more, a
# prediction would stand beside a simulation that contradicts it; with less, none would be confirmed of a few
# samples in a cycle.
AGREEMENT: Final = 0.1
STILL: Final = ("converged", "decaying")  # behaviour of a run that keeps up no vibration
Outcome = Literal["same", "other", "none", "open"]


@dataclass(frozen=True)
class Answers:
    """Limit cycles by amplitude, and those that are contradicted: predicted, but no simulation has them."""

    cycles: tuple[LimitCycleAnswer, ...]
    contradicted: tuple[LimitCycleAnswer, ...]


def agrees(cycle: LimitCycle, vibration: SimulatedVibration) -> bool:
    """Whether a simulation ends in the predicted vibration, amplitude and frequency to AGREEMENT."""
    if vibration.behaviour != "limit cycle" or not vibration.amplitude > 0.0 or not cycle.amplitude > 0.0:
        return False
    widest = log(1.0 + AGREEMENT)
    ratios = vibration.amplitude / cycle.amplitude, vibration.frequency / cycle.frequency_Hz
    return all(ratio > 0.0 and abs(log(ratio)) <= widest for ratio in ratios)


def answered_cycles(
    predicted: Sequence[LimitCycle],
    runs: Sequence[Sequence[SimulatedVibration]],
    others: Sequence[SimulatedVibration],
    largest_motion: float,
) -> Answers:
    """Compare predicted cycles with simulations, and add those that only simulations have.

    runs    of each predicted cycle, from both sides of it; () for one that was not simulated
    others  from other starts
    largest_motion  of the device to either side [m]: a simulated vibration beyond it is no answer
    """
    cycles: list[LimitCycleAnswer] = []
    contradicted: list[LimitCycleAnswer] = []
    everything = [*(run for cycle_runs in runs for run in cycle_runs), *others]
    for cycle, cycle_runs in zip(predicted, runs, strict=True):
        if not cycle_runs:
            cycles.append(LimitCycleAnswer(cycle, "describing function", None, None, cycle))
            continue
        # one that only another start leads to is there, too
        nearest = _nearest(cycle, [run for run in everything if agrees(cycle, run)] or cycle_runs)
        outcome = _outcome(cycle, cycle_runs, nearest)
        if outcome == "none":
            contradicted.append(LimitCycleAnswer(cycle, "describing function", False, nearest, cycle))
        elif outcome == "other":
            _add_if_new(cycles, _as_cycle(nearest, largest_motion), nearest, cycle)
        else:  # the same, confirmed, or open: None
            cycles.append(
                LimitCycleAnswer(cycle, "describing function", outcome == "same" or None, nearest, cycle)
            )
    for vibration in everything:
        if vibration.behaviour == "limit cycle" and 0.0 < vibration.amplitude <= largest_motion:
            _add_if_new(cycles, _as_cycle(vibration, largest_motion), vibration, None)
    return Answers(tuple(sorted(cycles, key=lambda answer: answer.cycle.amplitude)), tuple(contradicted))


def _nearest(cycle: LimitCycle, runs: Sequence[SimulatedVibration]) -> SimulatedVibration:
    """Of the runs that end in a vibration, else of all, the one that ends nearest to the cycle."""
    alive = [run for run in runs if run.amplitude > 0.0 and run.behaviour not in STILL]
    sustained = [run for run in alive if run.behaviour == "limit cycle"]
    return min(
        sustained or alive or runs,
        key=lambda run: abs(log(max(run.amplitude, 1e-300) / cycle.amplitude)) if run.amplitude < inf else inf,
    )


def _outcome(cycle: LimitCycle, runs: Sequence[SimulatedVibration], nearest: SimulatedVibration) -> Outcome:
    """What runs from both sides say of a predicted cycle: "same", they end in it; "other", in another one; "none",
    in none, all being still or growing beyond the range; "open", none has settled.

    nearest  run that ends nearest to the cycle
    """
    if nearest.behaviour == "limit cycle":
        return "same" if agrees(cycle, nearest) else "other"
    if all(run.behaviour in STILL for run in runs):
        return "none"
    if all(run.behaviour == "growing" and not run.amplitude < cycle.largest_motion for run in runs):
        return "none"
    return "open"


def _as_cycle(vibration: SimulatedVibration, largest_motion: float) -> LimitCycle:
    """A simulated vibration as a limit cycle; the force before its limit is not recorded."""
    return LimitCycle(vibration.amplitude, vibration.frequency, True, nan, np.zeros(0), largest_motion)


def _add_if_new(
    cycles: list[LimitCycleAnswer], cycle: LimitCycle, vibration: SimulatedVibration, predicted: LimitCycle | None
) -> None:
    """Add a simulated cycle to the answers, unless a stable one of them agrees with it.

    predicted  what was predicted in its place, which a known one gets if it has none; None: nothing
    """
    source: CycleSource = "simulation"
    for n, known in enumerate(cycles):
        if known.cycle.stable and agrees(known.cycle, vibration):
            if predicted is not None and known.predicted is None:
                cycles[n] = replace(known, predicted=predicted)
            return
    cycles.append(LimitCycleAnswer(cycle, source, True, vibration, predicted))
