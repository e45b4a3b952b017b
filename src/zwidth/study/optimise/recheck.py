"""The front's designs looked at again: on a finer grid of the task, and in nonlinear simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import largest_stiffness
from zwidth.device.faults import DeviceError
from zwidth.device.load import from_document
from zwidth.device.operator_choice import with_operator
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import WantedWall
from zwidth.study.designs.sampling import CIRCUMSTANCES
from zwidth.study.designs.task import Task, task_of
from zwidth.study.optimise.evaluation import margins
from zwidth.study.optimise.problem import Problem

FINER: Final = 2  # times as many steps between points, and directions
PRODUCED: Final = 64  # devices within the tolerances for the bars of each design
QUANTILES: Final = (0.05, 0.95)
SHARE: Final = 0.9  # of the largest stiffness: of the wall that is simulated


@dataclass(frozen=True)
class Contact:
    """A wall of a design, simulated with all its nonlinear parts where the design is worst.

    stiffness, damping  of the wall [N/m], [N s/m]
    stable     True, False, or None where the motion does not tell
    amplitude  of the vibration at the end [m]
    reason     why nothing was simulated; "" where it was
    """

    stiffness: float = float("nan")
    damping: float = float("nan")
    stable: bool | None = None
    amplitude: float = float("nan")
    reason: str = ""


@dataclass(frozen=True)
class Bars:
    """What tolerances make of k designs.

    low, high  (k, c)  of each column: 5 and 95 % of the produced devices that have a value lie below
    kept       (k,)    share of the produced devices that keep all demands, and have a value in every column
    devices    number of produced devices of each design
    """

    low: Floats
    high: Floats
    kept: Floats
    devices: int


def bars_of(problem: Problem, produced: Floats) -> Bars:
    """Bars from the columns (devices, k, c) of designs: as they are, which is left out, and as produced."""
    drawn = produced[1:]
    kept = ~np.isnan(drawn).any(axis=-1)
    for demand in problem.demands:
        with np.errstate(invalid="ignore"):
            kept &= margins(drawn[..., demand.column], demand.bound, demand.at_least) >= 0.0
    low, high = np.full(drawn.shape[1:], np.nan), np.full(drawn.shape[1:], np.nan)
    known = ~np.isnan(drawn).all(axis=0)
    if known.any():
        low[known], high[known] = np.nanquantile(drawn[:, known], QUANTILES, axis=0)
    return Bars(low, high, kept.mean(axis=0), len(drawn))


def finer_problem(problem: Problem) -> Problem | None:
    """The problem on a finer grid of the task, which holds the points of the coarser; None without a task, or
    where its points and directions are all listed."""
    task = problem.study.task
    if task is None:
        return None
    finer = task_of(problem.study.document, problem.study.device, [], finer=FINER)
    if finer is None or _points(finer) == _points(task):
        return None
    return replace(problem, study=replace(problem.study, task=finer))


def _points(task: Task) -> int:
    """Number of points times directions."""
    return (0 if task.positions is None else len(task.positions)) * (
        1 if task.directions is None else len(task.directions)
    )


def simulate_contact(problem: Problem, design: dict[str, Any], cells: Sequence[Any]) -> Contact:
    """Simulate a wall of a design where the first objective is worst.

    The wall is the study's wanted one, or, where it names none, one of 90 % of the largest stiffness there, at
    that wall's damping.

    design  path -> value of each number and circumstance
    cells   (columns, w)  values at all points, member by member
    """
    try:
        point = worst_point(problem, design, cells)
        wall = _wall(problem.study.wall, point)
        if wall is None:
            return Contact(reason="no wall with K > 0 and B >= 0 is stable where it is worst")
        motion = point.simulate(stiffness=wall[0], damping=wall[1])
    except (DeviceError, ValueError) as error:
        return Contact(reason=str(error))
    return Contact(*wall, motion.stable, float(motion.amplitude))


def _wall(wanted: WantedWall, point: OperatingPoint) -> tuple[float, float] | None:
    if wanted.stiffness is not None and wanted.damping is not None:
        return wanted.stiffness, wanted.damping
    peak = largest_stiffness(point.loop)
    return None if peak is None else (SHARE * peak.stiffness, peak.damping)


def worst_point(problem: Problem, design: dict[str, Any], cells: Sequence[Any]) -> OperatingPoint:
    """The operating point at which the first objective is worst, held by whom it is worst with."""
    study, task, column = problem.study, problem.study.task, problem.objectives[0].column
    # of the devices as they are, not as they are produced
    values = np.asarray(cells[column]).reshape(len(problem.members), 1 + problem.drawn, -1)[:, 0]
    worst = np.nanargmin if problem.columns[column].measure.better == "higher" else np.nanargmax
    member, place = (int(n) for n in np.unravel_index(int(worst(values)), values.shape))
    chosen: dict[str, Any] = {key: getattr(study, key) for key in ("at", "direction", "assembly", "model")}
    chosen |= {key: value for key, value in (problem.members[member] | design).items() if key in CIRCUMSTANCES}
    if task is not None and task.positions is not None:
        directions = task.directions
        many = 1 if directions is None else len(directions)
        chosen["at"] = task.positions[place // many]
        if directions is not None:
            chosen["direction"] = directions[place % many]
    device = study.device.with_({key: value for key, value in design.items() if key not in CIRCUMSTANCES})
    if "operator" in chosen:
        held = with_operator(device.document, study.operators[chosen["operator"]])
        device = from_document(held, device.label)
    return device.at(chosen["at"], chosen["direction"], assembly=chosen["assembly"], model=chosen["model"])
