"""Limit cycles of a device on one wall: what is predicted, and what a simulation finds there.

Which limit cycles a device has: those that harmonic balance predicts, held against simulations of the same
wall.

Harmonic balance has no bound for its error. What it predicts stands where a simulation ends in the same vibration;
where the two part, the simulation is the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, log, nan, pi
from typing import Any, Final, Literal

import numpy as np

from zwidth.contact.harmonic_balance import HarmonicBalance, LimitCycle
from zwidth.result import Result

CYCLE_KEYS: Final = ("amplitude_m", "frequency_Hz", "stable", "within_range", "force_N", "velocity_m_per_s")
CycleSource = Literal["describing function", "simulation"]
MOST_TOLD: Final = 4  # cycles that a prediction shows of itself


@dataclass(frozen=True)
class SimulatedVibration:
    """Vibration that a simulation ends in.

    start, duration  [m] from the middle of the vibration, [s]
    behaviour        as in `time_response.Judgement`
    amplitude        of the sensor's motion in the last quarter [m];   frequency  [Hz]
    """

    start: float
    duration: float
    behaviour: str
    amplitude: float
    frequency: float

    def document(self) -> dict[str, Any]:
        """The numbers by key and unit."""
        return {
            "behaviour": self.behaviour,
            "amplitude_m": self.amplitude,
            "frequency_Hz": self.frequency,
            "start_m": self.start,
            "duration_s": self.duration,
        }


@dataclass(frozen=True)
class LimitCycleAnswer:
    """One limit cycle, and what it rests on.

    cycle      the answer
    source     "describing function": as harmonic balance predicts it; "simulation": as a simulation ends
    confirmed  True: a simulation ends in it; False: simulations from both sides of it end elsewhere; None: not
               simulated, or no run has settled
    simulated  where a simulation from near it ends; None: not simulated
    predicted  what harmonic balance predicts in its place; None: nothing
    """

    cycle: LimitCycle
    source: CycleSource
    confirmed: bool | None
    simulated: SimulatedVibration | None
    predicted: LimitCycle | None

    def document(self) -> dict[str, Any]:
        """The numbers by key and unit."""
        predicted = self.predicted
        return _cycle_document(self.cycle) | {
            "from": self.source,
            "confirmed": self.confirmed,
            "predicted": predicted
            and {"amplitude_m": predicted.amplitude, "frequency_Hz": predicted.frequency_Hz},
            "simulated": self.simulated and self.simulated.document(),
        }


@dataclass(frozen=True, repr=False)
class LimitCyclePrediction(Result):
    """Limit cycles of a device on one two-sided wall.

    wall_stiffness, wall_damping   [N/m], [N s/m]
    offset                 middle of the vibrations, as a share of an encoder's step beyond a count
    verdict                of the linear loop: "stable", "unstable" or "undecided"
    nonlinear              what of the device depends on the amplitude, in words
    left_out               what of the device the prediction leaves out, in words
    predicted_by           the method, and what it is worth
    balance                growth of vibrations over their amplitude, and as far as the device can move
    answers                the limit cycles by amplitude: predicted, or simulated where the two part
    contradicted           predicted cycles that no simulation has
    small_start_vibration  what it finds where no stable cycle is predicted within the range; None: not simulated
    resting_limit          stiffest wall on which there is a place to rest under every push [N/m]; None: not known
    quiet_limit            stiffest wall, of this damping, without any hunting [N/m]; None: not known
    was_simulated          whether predictions were held against simulations
    """

    wall_stiffness: float
    wall_damping: float
    offset: float
    verdict: str
    nonlinear: tuple[str, ...]
    left_out: tuple[str, ...]
    predicted_by: str
    balance: HarmonicBalance
    answers: tuple[LimitCycleAnswer, ...]
    contradicted: tuple[LimitCycleAnswer, ...]
    small_start_vibration: SimulatedVibration | None
    resting_limit: float | None
    quiet_limit: float | None
    was_simulated: bool = True

    @property
    def none_found(self) -> str:
        """What is said where there is no limit cycle."""
        if self.contradicted:
            return "no limit cycle: what is predicted, the simulation does not have"
        return "no limit cycle is predicted" + (", and none was met by simulation" if self.was_simulated else "")

    @property
    def largest_motion(self) -> float:
        """How far the device can move to either side [m]."""
        return self.balance.largest_motion

    @property
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

    def document(self) -> dict[str, Any]:
        """Everything by key and unit; None where it is not known, or was not simulated."""
        balance = self.balance
        return {
            "wall_stiffness_N_per_m": self.wall_stiffness,
            "wall_damping_Ns_per_m": self.wall_damping,
            "offset_steps": self.offset,
            "verdict": self.verdict,
            "nonlinear": list(self.nonlinear),
            "predicted_by": self.predicted_by,
            "limit_cycles": [answer.document() for answer in self.answers],
            "contradicted": [answer.document() for answer in self.contradicted],
            "otherwise": self.small_start_vibration and self.small_start_vibration.document(),
            "largest_motion_m": self.largest_motion,
            "leaves_range": self.leaves_range,
            "resting_limit_N_per_m": self.resting_limit,
            "quiet_limit_N_per_m": self.quiet_limit,
            "growth": {
                "amplitude_m": balance.amplitude,
                "growth_per_s": balance.growth,
                "frequency_Hz": balance.frequency_Hz,
            },
        }

    def table(self) -> dict[str, list[Any]]:
        """The limit cycles as columns, one a row."""
        rows = [_cycle_document(cycle) for cycle in self.cycles]
        columns: dict[str, list[Any]] = {key: [_as_cell(row[key]) for row in rows] for key in CYCLE_KEYS}
        columns["from"] = [answer.source for answer in self.answers]
        columns["confirmed"] = [
            None if answer.confirmed is None else _as_cell(answer.confirmed) for answer in self.answers
        ]
        documents = [simulated.document() if simulated else {} for simulated in self.simulated]
        for key in ("behaviour", "amplitude_m", "frequency_Hz"):
            columns[f"simulated_{key}"] = [own.get(key) for own in documents]
        return columns

    def __repr__(self) -> str:
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


def _cycle_document(cycle: LimitCycle) -> dict[str, Any]:
    values = (
        cycle.amplitude,
        cycle.frequency_Hz,
        cycle.stable,
        cycle.within_range,
        cycle.force_amplitude,
        cycle_speed(cycle),
    )
    return dict(zip(CYCLE_KEYS, values, strict=True))


def _as_cell(value: float | bool) -> float | str:
    return str(value).lower() if isinstance(value, bool) else value


def cycle_speed(cycle: LimitCycle) -> float:
    """Velocity amplitude at the sensor, of the sine [m/s]."""
    return 2.0 * pi * cycle.frequency_Hz * cycle.amplitude


# Share by which a simulated amplitude or frequency may differ from the predicted one and confirm it: with more, a
# prediction would stand beside a simulation that contradicts it; with less, none would be confirmed of a few
# samples in a cycle.
AGREEMENT: Final = 0.1
STILL: Final = ("converged", "decaying")  # behaviour of a run that keeps up no vibration
Outcome = Literal["same", "other", "none", "open"]


@dataclass(frozen=True)
class Answers:
    """Limit cycles by amplitude, and the predicted ones that no simulation has."""

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
    """Compare predicted cycles with simulations.

    runs    of each predicted cycle, from both sides of it; () for one that was not simulated
    others  from other starts
    """
    cycles: list[LimitCycleAnswer] = []
    contradicted: list[LimitCycleAnswer] = []
    everything = [*(run for own in runs for run in own), *others]
    for cycle, own in zip(predicted, runs, strict=True):
        if not own:
            cycles.append(LimitCycleAnswer(cycle, "describing function", None, None, cycle))
            continue
        # one that only another start leads to is there, too
        nearest = _nearest(cycle, [run for run in everything if agrees(cycle, run)] or own)
        outcome = _outcome(cycle, own, nearest)
        if outcome == "none":
            contradicted.append(LimitCycleAnswer(cycle, "describing function", False, nearest, cycle))
        elif outcome == "other":
            _add(cycles, _as_cycle(nearest, largest_motion), nearest, cycle)
        else:
            cycles.append(
                LimitCycleAnswer(cycle, "describing function", outcome == "same" or None, nearest, cycle)
            )
    for vibration in everything:
        if vibration.behaviour == "limit cycle" and 0.0 < vibration.amplitude <= largest_motion:
            _add(cycles, _as_cycle(vibration, largest_motion), vibration, None)
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
    """What runs from both sides say of a cycle; "open" where none has settled."""
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


def _add(
    cycles: list[LimitCycleAnswer], cycle: LimitCycle, vibration: SimulatedVibration, predicted: LimitCycle | None
) -> None:
    """Add a simulated cycle, unless it is one of those already known."""
    source: CycleSource = "simulation"
    for n, known in enumerate(cycles):
        if known.cycle.stable and agrees(known.cycle, vibration):
            if predicted is not None and known.predicted is None:
                cycles[n] = replace(known, predicted=predicted)
            return
    cycles.append(LimitCycleAnswer(cycle, source, True, vibration, predicted))
