"""The problem of an optimisation: objectives and demands on the columns that each design is judged by."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from zwidth.device.address import is_number, table
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, nearest
from zwidth.device.load import in_order
from zwidth.device.schema.value_types import Section
from zwidth.errors import DeviceError
from zwidth.measures.definition import Better, Measure
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.designs.column import Column, column_named
from zwidth.study.designs.sampling import Axis
from zwidth.study.designs.study import Study, as_key, plane_of_study
from zwidth.study.designs.study_file import read_document, study_of
from zwidth.study.designs.study_schema import OptimiseSection, StudyFile
from zwidth.study.designs.task import DEMANDS, demands_of
from zwidth.study.tolerances.distribution import Tolerance
from zwidth.study.tolerances.tolerance_tables import tolerances_of
from zwidth.study.workspace.plane_grid import PlaneGrid

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


def read_study_to_optimise(path: str | os.PathLike[str]) -> Study:
    """The study that a file describes, for an optimiser.

    Raises DeviceError  with all faults of the file, those of [optimise] and of the device file among them
    """
    label = os.fspath(path)
    return study_to_optimise(read_document(label), label)


def study_to_optimise(document: dict[str, Any], label: str = "study") -> Study:
    """The study that a document describes, for an optimiser; see `read_study_to_optimise`."""

    def tolerance_faults(device: Device | None, faults: TableFaults) -> None:
        tolerances_of(document, device, faults)

    def optimise_faults(device: Device | None, user_measures: Mapping[str, Measure], faults: TableFaults) -> None:
        found = _Requests(document, user_measures, faults)
        _workspace_plane(document, device, found.columns, faults)

    return study_of(document, label, bounds=True, further=tolerance_faults, further_of_measures=optimise_faults)


def problem_of(study: Study) -> Problem:
    """The problem that a study's [optimise] and [task] describe.

    Raises  DeviceError  with all faults
    """
    given = table(study.document, "optimise")
    faults: TableFaults = []
    task = study.task
    # the force that the task demands is that of the wall, where the study gives it none
    if task is not None and study.wall.force is None and (held := task.demands.get("continuous_force_N")):
        study = replace(study, wall=replace(study.wall, force=held))
    found = _Requests(study.document, study.user_measures, faults)
    study = replace(study, plane=_workspace_plane(study.document, study.device, found.columns, faults))
    tolerances = tolerances_of(study.document, study.device, faults)
    if faults:
        raise DeviceError(in_order(faults, study.document, study.label))
    columns = found.columns
    if study.turns:
        columns = [replace(column, measure=column.measure.about_moments()) for column in columns]
    return Problem(
        study,
        tuple(columns),
        tuple(found.paths),
        tuple(found.objectives),
        tuple(found.demands),
        int(given.get("budget", BUDGET)),
        int(given.get("seed", 1)),
        int(given.get("front", FRONT)),
        tuple({"operator": name} for name in (task.operators if task is not None else ())) or ({},),
        tolerances,
        int(given.get("tolerance_members", 0)),
    )


def _workspace_plane(
    document: dict[str, Any], device: Device | None, columns: Sequence[Column], faults: TableFaults
) -> PlaneGrid | None:
    """The grid over the workspace for columns that are statistics; None with a task, or without such columns."""
    if "task" in document:
        return None
    return plane_of_study(document, device, columns, None, faults, as_key)


class _Requests:
    """What a study's [optimise] and the demands of its [task] ask for.

    Values of the wrong type are left out here: `study_schema` reports them.

    document       of the study
    user_measures  a user's measures by name
    faults         gets what is wrong

    columns, paths       as in `Problem`, but measures of a device that turns are not yet about moments
    objectives, demands  those without a fault
    """

    def __init__(
        self, document: Mapping[str, Any], user_measures: Mapping[str, Measure], faults: TableFaults
    ) -> None:
        self.document, self.user_measures, self.faults = document, user_measures, faults
        self.columns: list[Column] = []
        self.paths: list[KeyPath] = []
        self.objectives: list[Objective] = []
        self.demands: list[Demand] = []
        given = table(dict(document), "optimise")
        self._read_objectives(given)
        self._read_demands(given)
        self._check_numbers(given)

    def _column_index(self, name: str, better: Better, path: KeyPath) -> int | None:
        """Index in `columns`, to which it is added, of the column that a key names; None where it has a fault.

        better  which values are to count as better
        path    of the key in the study, for messages
        """
        has_task = "task" in self.document  # then a column without a statistic is the worst over the task's points
        try:
            column = column_named(name, self.user_measures, better)
        except ValueError as error:
            self.faults.append((path, str(error)))
            return None
        if column.statistic is None and has_task:
            judged = replace(column.measure, better=better)
            column = Column(f"worst({column.measure.name})", judged, "worst")
        if column.statistic in WITHOUT_VALUES:
            self.faults.append((path, f"{name} cannot be optimised; write worst({column.measure.name})"))
            return None
        if column.statistic is not None and not has_task and "workspace" not in self.document:
            message = f"{name} needs a [task] or a [workspace]; add one, or write {column.measure.name}"
            self.faults.append((path, message))
            return None
        if column not in self.columns:
            self.columns.append(column)
            self.paths.append(path)
        return self.columns.index(column)

    def _read_objectives(self, given: dict[str, Any]) -> None:
        """Take the objectives from the table [optimise]; a fault where it has none, unless a misspelt key, or a
        table that is none, hides them: the schema reports those."""
        for name, goal in table(given, "objectives").items():
            if goal in ("max", "min") and name:
                better: Better = "higher" if goal == "max" else "lower"
                at = self._column_index(name, better, ("optimise", "objectives", name))
                self.objectives += [] if at is None else [Objective(at, goal)]
        if "objectives" not in given and not _misspelt("objectives", given, OptimiseSection):
            readable = isinstance(self.document.get("optimise", {}), dict)
            if readable and ("optimise" in self.document or not _misspelt("optimise", self.document, StudyFile)):
                message = 'has no objectives; add such as objectives = { stiffness_max = "max" }'
                self.faults.append((("optimise",), message))

    def _read_demands(self, given: dict[str, Any]) -> None:
        """Take the demands from [task], and from the constraints in the table [optimise]."""
        for key, bound in demands_of(table(dict(self.document), "task")).items():
            measure, at_least = DEMANDS[key]
            at = self._column_index(measure, "higher" if at_least else "lower", ("task", key))
            self.demands += [] if at is None else [Demand(key, at, at_least, bound, True)]
        for name, text in table(given, "constraints").items():
            if not isinstance(text, str) or not text or not name:
                continue
            path = ("optimise", "constraints", name)
            parts = _BOUND.fullmatch(text)
            value = _finite_number(parts["value"]) if parts else None
            if parts is None or value is None:
                message = f'must be such as "<= 0.3" or ">= 5", with a finite number, got {text!r}'
                self.faults.append((path, message))
                continue
            at_least = parts["sign"] == ">="
            at = self._column_index(name, "higher" if at_least else "lower", path)
            self.demands += [] if at is None else [Demand(name, at, at_least, value)]

    def _check_numbers(self, given: dict[str, Any]) -> None:
        """Note a budget that is too small, and devices within tolerances where there are none."""
        budget = given.get("budget", BUDGET)
        if is_number(budget) and 1 <= budget < LEAST_BUDGET:
            message = f"must be at least {LEAST_BUDGET} designs, got {budget}"
            self.faults.append((("optimise", "budget"), message))
        if "tolerance_members" in given and "tolerance" not in self.document:
            message = "needs a [[tolerance]]; add one, or remove this"
            self.faults.append((("optimise", "tolerance_members"), message))


def _misspelt(key: str, given: Mapping[str, Any], section: type[Section]) -> bool:
    """Whether a table has this key, but under a name that is none of its section's."""
    fields = list(section.model_fields)
    return any(nearest(other, fields) == key for other in given if other not in fields)


def _finite_number(text: str) -> float | None:
    """The finite number that a text holds; None where it holds none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if np.isfinite(value) else None
