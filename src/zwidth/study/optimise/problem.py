"""The problem of an optimisation: objectives and demands on the columns that each design is judged by."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from zwidth.device.faults import DeviceError, KeyPath
from zwidth.device.load import in_order
from zwidth.device.toml_access import table
from zwidth.measures.definition import Better
from zwidth.study.designs.axis_tables import Faults
from zwidth.study.designs.column import Column, column_named
from zwidth.study.designs.sampling import Axis
from zwidth.study.designs.study import Study
from zwidth.study.designs.task import DEMANDS
from zwidth.study.tolerances.tolerance import Tolerance
from zwidth.study.tolerances.tolerance_tables import tolerances_of

BUDGET: Final = 2000  # designs tried, where the study does not say
FRONT: Final = 16  # designs of the front, where the study does not say
LEAST_BUDGET: Final = 20
WITHOUT_VALUES: Final = ("isotropy_index",)  # statistics that need more than the values of a measure
_BOUND: Final = re.compile(r"\s*(?P<sign><=|>=)\s*(?P<value>\S+)\s*")


@dataclass(frozen=True)
class Objective:
    """A column that is to become large or small.

    column  its place among the problem's columns
    """

    column: int
    goal: Literal["max", "min"]

    @property
    def sign(self) -> float:
        """Factor that makes less better."""
        return -1.0 if self.goal == "max" else 1.0


@dataclass(frozen=True)
class Demand:
    """A bound that a column has to keep.

    key       as it stands in the study: a key of [task], or a measure of [optimise.constraints]
    of_task   whether it is the former
    column    its place among the problem's columns
    at_least  whether it is a lower bound
    """

    key: str
    column: int
    at_least: bool
    bound: float
    of_task: bool = False

    @property
    def sign(self) -> float:
        """Factor that makes less better."""
        return -1.0 if self.at_least else 1.0

    @property
    def text(self) -> str:
        """The demand as a reader writes it: "rigid_mass <= 0.3"."""
        return f"{self.key} {'>=' if self.at_least else '<='} {self.bound:g}"

    @property
    def full_text(self) -> str:
        """The same with the table that the key stands in: "task.apparent_mass_kg <= 0.3"."""
        return f"task.{self.text}" if self.of_task else self.text


@dataclass(frozen=True)
class Problem:
    """What is optimised.

    study       device, variables, task and circumstances
    columns     what each design is judged by
    paths       key of the study that asks for each of them, the first that does
    budget      designs to try
    front       designs of the front to keep, at most
    members     the circumstances in which each design is judged, such as who holds it: path -> value of each
    tolerances  how numbers differ from one produced device to the next
    drawn       produced devices by which each design is judged besides as it is
    """

    study: Study
    columns: tuple[Column, ...]
    paths: tuple[KeyPath, ...]
    objectives: tuple[Objective, ...]
    demands: tuple[Demand, ...]
    budget: int
    seed: int
    front: int
    members: tuple[dict[str, Any], ...] = ({},)
    tolerances: tuple[Tolerance, ...] = ()
    drawn: int = 0

    @property
    def variables(self) -> tuple[Axis, ...]:
        """The axes of the study."""
        return self.study.sampling.axes

    @property
    def signs(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Factor of each objective that makes less better (m,)."""
        return np.array([objective.sign for objective in self.objectives])


def problem_of(study: Study) -> Problem:
    """The problem that a study's [optimise] and [task] describe.

    Raises  DeviceError  with all faults
    """
    given = table(study.document, "optimise")
    faults: Faults = []
    if (
        study.task is not None
        and study.wall.force is None
        and (held := study.task.demands.get("continuous_force_N"))
    ):
        study = replace(study, wall=replace(study.wall, force=held))
    columns: list[Column] = []
    paths: list[KeyPath] = []
    overall = study.task is not None

    def place(name: str, better: Better, path: KeyPath) -> int | None:
        try:
            column = column_named(name, study.user_measures, better)
        except ValueError as error:
            faults.append((path, str(error)))
            return None
        if column.statistic is None and overall:
            judged = replace(column.measure, better=better)
            column = Column(f"worst({column.measure.name})", judged, "worst")
        if column.statistic in WITHOUT_VALUES:
            faults.append((path, f"{name} cannot be optimised; write worst({column.measure.name})"))
            return None
        if column.statistic is not None and not overall and study.plane is None:
            faults.append(
                (path, f"{name} needs a [task] or a [workspace]; add one, or write {column.measure.name}")
            )
            return None
        if study.turns:
            column = replace(column, measure=column.measure.about_moments())
        if column not in columns:
            columns.append(column)
            paths.append(path)
        return columns.index(column)

    objectives = []
    for name, goal in table(given, "objectives").items():
        if goal in ("max", "min"):
            at = place(name, "higher" if goal == "max" else "lower", ("optimise", "objectives", name))
            objectives += [] if at is None else [Objective(at, goal)]
    demands = []
    for key, bound in (study.task.demands if study.task is not None else {}).items():
        measure, at_least = DEMANDS[key]
        at = place(measure, "higher" if at_least else "lower", ("task", key))
        demands += [] if at is None else [Demand(key, at, at_least, bound, True)]
    for name, text in table(given, "constraints").items():
        path = ("optimise", "constraints", name)
        parts = _BOUND.fullmatch(text) if isinstance(text, str) else None
        value = _finite(parts["value"]) if parts else None
        if parts is None or value is None:
            faults.append((path, f'must be such as "<= 0.3" or ">= 5", with a finite number, got {text!r}'))
            continue
        at_least = parts["sign"] == ">="
        at = place(name, "higher" if at_least else "lower", path)
        demands += [] if at is None else [Demand(name, at, at_least, value)]
    if not given.get("objectives"):
        faults.append((("optimise",), 'has no objectives; add such as objectives = { stiffness_max = "max" }'))
    budget = given.get("budget", BUDGET)
    if budget < LEAST_BUDGET:
        faults.append((("optimise", "budget"), f"must be at least {LEAST_BUDGET} designs, got {budget}"))
    tolerances = tolerances_of(study.document, study.device, faults)
    drawn = given.get("tolerance_members", 0)
    if drawn and "tolerance" not in study.document:
        faults.append((("optimise", "tolerance_members"), "needs a [[tolerance]]; add one, or remove this"))
    if faults:
        raise DeviceError(in_order(faults, study.document, study.label))
    operators = study.task.operators if study.task is not None else ()
    return Problem(
        study,
        tuple(columns),
        tuple(paths),
        tuple(objectives),
        tuple(demands),
        int(budget),
        int(given.get("seed", 1)),
        int(given.get("front", FRONT)),
        tuple({"operator": name} for name in operators) or ({},),
        tolerances,
        int(drawn),
    )


def _finite(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
