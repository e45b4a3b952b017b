"""Designs judged: every column at every point of the task and in all circumstances, reduced to a number each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.device import address
from zwidth.device.load import in_order
from zwidth.errors import DeviceError, MissingMeasures
from zwidth.measures.definition import NO_VALUE, OK, MeasureValues, Note
from zwidth.measures.workspace_statistics import global_conditioning_index, overall
from zwidth.study.designs.column import Column
from zwidth.study.designs.sampling import CIRCUMSTANCES, Axis, Sampling
from zwidth.study.designs.study import Study
from zwidth.study.designs.sweep_job import SweepJob, sweep_job
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.optimisation.problem import Problem
from zwidth.study.tolerances.tolerance_study import MemberChanges, member_changes

LARGEST: Final = 1e150  # of a cost; its square is finite
MOST_VIOLATED: Final = 10.0  # a demand is violated by more only where there is no value


@dataclass(frozen=True)
class EvaluationJob:
    """Designs as cells: the values of all columns, at each point and in each circumstance.

    sweep    of all designs, each as often as there are members, one after another
    members  circumstances of each design, their number: each operator, with it as it is and each produced device
    """

    sweep: SweepJob
    members: int

    @property
    def count(self) -> int:
        """Number of designs."""
        return self.sweep.count // self.members

    @property
    def measures(self) -> tuple[str, ...]:
        """Columns at each member's points."""
        columns = self.sweep.measures
        return (
            columns
            if self.members == 1
            else tuple(f"{name}, member {n}" for n in range(self.members) for name in columns)
        )

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by."""
        return fingerprint("evaluation", self.sweep.question, self.members)

    @property
    def code(self) -> str:
        """The same for all designs of a study; see `Job`."""
        return f"evaluation of {self.sweep.label}: {', '.join(one.name for one in self.sweep.columns)}"

    def compute(self, first: int, last: int) -> CellValues:
        """Compute designs first to last - 1, the cells of a design's members side by side in its row."""
        found = self.sweep.compute(first * self.members, last * self.members)
        if self.members == 1:
            return found
        shape = last - first, -1
        notes = tuple(
            tuple(replace(note, first=(note.first[0] // self.members,)) for note in each) for each in found.notes
        )
        return CellValues(found.values.reshape(shape), found.status.reshape(shape), notes * self.members)


@dataclass(frozen=True)
class DesignJudgement:
    """What k designs are worth.

    values     (k, c)  of each of c columns; nan where there is none
    status     (k, c)  as in `measures.definition`
    absent     (k, c)  share of the points at which the column has no value
    cells      (k, c, w)  the column's values at all w points, member by member
    """

    values: Floats
    status: NDArray[np.uint8]
    absent: Floats
    cells: Floats

    def __getitem__(self, index: Any) -> DesignJudgement:
        """Some of the designs."""
        return DesignJudgement(self.values[index], self.status[index], self.absent[index], self.cells[index])

    def followed_by(self, other: DesignJudgement) -> DesignJudgement:
        """These designs and then others."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return DesignJudgement(*(np.concatenate(pair) for pair in pairs))

    def costs(self, problem: Problem) -> Floats:
        """Each objective (k, m) with the sign that makes less better; nan where it has no value. Infinite ones are
        large numbers, so that they can be compared and subtracted."""
        costs = np.stack([self.values[:, one.column] * one.sign for one in problem.objectives], axis=1)
        return np.clip(costs, -LARGEST, LARGEST)

    def violations(self, problem: Problem) -> Floats:
        """Violations (k, d + 1) of k designs: of each of d demands as a share of its bound, at most MOST_VIOLATED,
        and last of the objectives, which is above 0 only where one has no value. What is kept has 0.

        What has no value counts more than any violation, and the more points are without the more it counts."""
        violated = np.zeros((len(self.values), len(problem.demands) + 1))
        for n, demand in enumerate(problem.demands):
            margin = margins(self.values[:, demand.column], demand.bound, demand.at_least)
            short = np.clip(-margin, 0.0, MOST_VIOLATED)
            violated[:, n] = np.where(np.isnan(margin), self._violation_without_value(demand.column), short)
        for objective in problem.objectives:
            missing = np.isnan(self.values[:, objective.column])
            without = np.where(missing, self._violation_without_value(objective.column), 0.0)
            violated[:, -1] = np.maximum(violated[:, -1], without)
        return violated

    def _violation_without_value(self, column: int) -> Floats:
        """By how much each design (k,) would violate a bound if it had no value in a column, see `violations`."""
        return np.asarray(MOST_VIOLATED * (1.0 + self.absent[:, column]))


def margins(values: Floats, bound: float, at_least: bool) -> Floats:
    """Margin by which values keep a bound, as a share of its size (of 1 for a bound of 0); negative where not.

    >>> margins(np.array([0.25, 0.5]), 0.4, at_least=False).tolist()
    [0.37500000000000006, -0.24999999999999994]
    """
    beyond = (values - bound) / (abs(bound) or 1.0)
    return beyond if at_least else -beyond


class Judge:
    """Turns designs into jobs, and their cells into judgements.

    problem  what is optimised
    drawn    produced devices by which each design is judged besides as it is; left out: the problem's own
    Raises   DeviceError  for measures that do not exist for this device, by the keys that ask for them
    """

    def __init__(self, problem: Problem, drawn: int | None = None) -> None:
        self.problem = problem
        drawn = problem.drawn if drawn is None else drawn
        self._changes = member_changes(problem.tolerances, drawn, problem.seed) if drawn else None
        self._devices = 1 + drawn
        study = replace(problem.study, columns=problem.columns)
        try:
            self._sweep = replace(sweep_job(_three_designs(study)), cells=True)
        except MissingMeasures as error:
            names = [column.name for column in problem.columns]
            faults = [(problem.paths[names.index(name)], f"{name} {why}") for name, why in error.refused.items()]
            raise DeviceError(in_order(faults, study.document, study.label)) from None

    def job(self, designs: Sequence[tuple[Any, ...]]) -> EvaluationJob:
        """The job that computes designs, each by the values of its variables: held by each operator in turn, as it
        is and then as it is produced."""
        members, devices = self.problem.members, self._devices
        # path or circumstance -> its value in each design
        columns = {
            key: list(values)
            for n, variable in enumerate(self.problem.variables)
            for key, values in variable.columns([design[n] for design in designs])
        }
        # the same -> of each design the values in its devices: as it is, then as they are produced
        each = {key: [[value] * devices for value in values] for key, values in columns.items()}
        if self._changes is not None:
            each |= self._produced(self._changes, columns, len(designs))
        axes = [
            Axis(key, tuple(value for of_design in rows for _ in members for value in of_design))
            for key, rows in each.items()
        ]
        for key in members[0]:
            values = [member[key] for _ in designs for member in members for _ in range(devices)]
            axes.append(Axis(key, tuple(values)))
        sampling = Sampling(tuple(axes), paired=True)
        return EvaluationJob(replace(self._sweep, sampling=sampling), len(members) * devices)

    def _produced(
        self, changes: MemberChanges, columns: dict[str, list[Any]], count: int
    ) -> dict[str, list[list[Any]]]:
        """Path of each number that differs, with a tolerance or tied to one -> for each design the number as it
        is, then as it is produced.

        columns  path or circumstance -> its value in each of `count` designs, of all that designs set
        """
        document = self.problem.study.device.document
        # a number may be written differently by its tolerance and by the study: path in full -> path in `columns`
        variables = {address.resolve(document, key): key for key in columns if key not in CIRCUMSTANCES}
        produced: dict[str, list[list[Any]]] = {}
        for design in range(count):
            values = {}
            for key in changes.keys:
                variable = variables.get(address.resolve(document, key))
                values[key] = address.get(document, key) if variable is None else columns[variable][design]
            drawn = changes.of(values)
            for n, key in enumerate(changes.keys):
                name = variables.get(address.resolve(document, key), key)
                produced.setdefault(name, []).append([float(values[key]), *drawn[:, n].tolist()])
        return produced

    def judge(self, found: CellValues) -> DesignJudgement:
        """The columns of k designs from the cells of their job, over all operators and produced devices."""
        cells, status = self._cells_by_column(found)
        k, columns = cells.shape[:2]
        values, kinds = np.full((k, columns), np.nan), np.zeros((k, columns), dtype=np.uint8)
        for c, column in enumerate(self.problem.columns):
            for i in range(k):
                values[i, c], kinds[i, c] = self._reduce(column, cells[i, c], status[i, c])
        absent = (status != OK).mean(axis=(2, 3))
        return DesignJudgement(values, kinds, absent, cells.reshape(k, columns, -1))

    def judge_produced(self, found: CellValues) -> Floats:
        """The columns (devices, k, c) of k designs as they are, and then as each of them is produced."""
        cells, status = self._cells_by_column(found)
        k, columns = cells.shape[:2]
        values = np.full((self._devices, k, columns), np.nan)
        for device in range(self._devices):
            members = slice(device, None, self._devices)  # this device in the hands of each operator
            for c, column in enumerate(self.problem.columns):
                for i in range(k):
                    values[device, i, c], _ = self._reduce(column, cells[i, c, members], status[i, c, members])
        return values

    def _cells_by_column(self, found: CellValues) -> tuple[Floats, NDArray[np.uint8]]:
        """Values and status (k, c, members, w) of a job's cells; members: each operator, with each device."""
        k, columns = len(found.values), len(self.problem.columns)
        shape = (k, len(self.problem.members) * self._devices, columns, -1)
        return np.moveaxis(found.values.reshape(shape), 1, 2), np.moveaxis(found.status.reshape(shape), 1, 2)

    def reasons(self, found: CellValues) -> dict[str, tuple[Note, ...]]:
        """Column -> why designs have no value there, as the first member tells it."""
        members = len(self.problem.members) * self._devices
        width = found.values.shape[1] // (len(self.problem.columns) * members)
        return {one.name: found.notes[n * width] for n, one in enumerate(self.problem.columns)}

    @cached_property
    def _weights(self) -> Floats | None:
        """Area (w,) of each position of the workspace [m²]; None without a workspace."""
        return None if self._sweep.weights is None else self._sweep.weights.ravel()

    def _reduce(self, column: Column, cells: Floats, status: NDArray[np.uint8]) -> tuple[float, int]:
        """Value and status of a column from its `cells` (members, w) and their status, members as in
        `_cells_by_column`.

        Without a statistic a column has one value a member, its first entry, and the worst member counts; it has
        none where one member has none. With one, the statistic is over all members and points; of a sweep that
        must be complete, as of a task, it has none where one of these has none.
        """
        if column.statistic is None:
            cells, status = cells[:, :1], status[:, :1]
        if (status != OK).any() and (self._sweep.complete or column.statistic is None):
            return column.without_value(MeasureValues(cells, status))[:2]
        better = column.measure.better
        if column.statistic is None:
            return float(cells.max() if better == "lower" else cells.min()), OK
        weights = None if self._weights is None else np.broadcast_to(self._weights, cells.shape)
        if column.statistic == "conditioning_index":
            value = global_conditioning_index(cells, status, weights)
        else:
            value = float(getattr(overall(cells, status, weights, better), column.statistic))
        return value, NO_VALUE if np.isnan(value) else OK


def _three_designs(study: Study) -> Study:
    """The study with three designs, at the ends and in the middle of its bounds: checks need no more. Catalogues
    are left out, whose columns are checked as they are read; a study that varies nothing else is returned as it
    is.
    """
    from zwidth.study.optimisation.search import values_at

    axes = study.sampling.axes
    designs = values_at(axes, np.array([0.0, 0.5, 1.0])[:, None] * np.ones(len(axes)))
    listed = tuple(
        replace(axis, values=tuple(design[n] for design in designs), parts=())
        for n, axis in enumerate(axes)
        if not axis.parts
    )
    return replace(study, sampling=Sampling(listed, paired=True)) if listed else study
