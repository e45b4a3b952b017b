"""Which limit cycles a device has: those that harmonic balance predicts, held against simulations of the same
wall.

Harmonic balance has no bound for its error. What it predicts stands where a simulation ends in the same vibration;
where the two part, the simulation is the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, log, nan
from typing import Final, Literal

import numpy as np

from zwidth.contact.harmonic_balance import LimitCycle
from zwidth.contact.limit_cycle_prediction import CycleSource, LimitCycleAnswer, SimulatedVibration

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
