"""The designs of a study as a job.

Each design is the device file with a few numbers changed, checked and built like any other: together with others
where that gives its values (`design_groups`), else alone. One that has faults, or does not reach the handle
position, has a status instead of values; the other designs are not affected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from typing import Any, Final, TypeAlias

import numpy as np

from zwidth import errors
from zwidth.arrays import Floats, Ints
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import plural
from zwidth.device.load import from_document
from zwidth.device.mechanism_check import masses_moved
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import (
    BEYOND_LIMIT,
    FAILED,
    MISSING,
    NO_EQUILIBRIUM,
    NO_VALUE,
    OK,
    OUT_OF_REACH,
    SINGULAR,
    Measure,
    MeasureValues,
    Note,
    WantedWall,
    WantedWalls,
)
from zwidth.measures.evaluation import evaluate, evaluate_safely, measured_together
from zwidth.questions import WANTED
from zwidth.study.designs.column import Column, areas
from zwidth.study.designs.design_groups import DesignColumn, DesignGroup, DesignGrouping
from zwidth.study.designs.sampling import CIRCUMSTANCES, Sampling, settings
from zwidth.study.designs.study import KEYS, Study, as_key
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.journal import fingerprint

MOST_CELLS: Final = 65536  # designs, or positions of their workspaces, that are in memory at once
# Value, status and reason ("" for none); the first two of one cell, or arrays of all
Found: TypeAlias = tuple[Any, Any, str]
WALL: Final = tuple(WANTED)  # numbers of the wanted wall, as arguments


class _NoPoint(Exception):
    """A design without an operating point: its status, and why."""

    def __init__(self, status: int, reason: str = "") -> None:
        self.status, self.reason = status, reason


@dataclass(frozen=True, repr=False)
class SweepJob:
    """The designs of a study as cells.

    document             of the device, the study's changes made
    label                of the device, for messages
    operators            as in `Study`
    columns              the measures to compute
    positions            (..., 3) of the workspace or (n, 1, 3) of the task [m]; None where no column is over any
    weights              (...) area that belongs to each position [m²]
    fixed_circumstances  circumstances that no axis sets
    directions           (d, 3) of the task; None: the one that is a circumstance
    complete             whether a column over all positions needs a value at each of them, as a task does
    cells                whether columns are not reduced: a number for each position, the columns one after another
    """

    document: dict[str, Any]
    label: str
    operators: dict[str, Any]
    sampling: Sampling
    columns: tuple[Column, ...]
    positions: Floats | None
    weights: Floats | None
    fixed_circumstances: dict[str, Any]
    directions: Floats | None = None
    complete: bool = False
    cells: bool = False
    _cache: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)

    def __repr__(self) -> str:
        return f"SweepJob({plural(self.count, 'design')} of {self.label!r}: {', '.join(self.measures)})"

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_cache": {}}

    @property
    def count(self) -> int:
        """Number of designs."""
        return self.sampling.count

    @property
    def measures(self) -> tuple[str, ...]:
        """Columns, as they are written in the study; of unreduced ones each cell."""
        names = tuple(one.name for one in self.columns)
        return (
            tuple(f"{name}, cell {n}" for name in names for n in range(self._numbers_per_column))
            if self.cells
            else names
        )

    @property
    def _numbers_per_column(self) -> int:
        """How many numbers each column has: 1, or of unreduced ones a number for each position and direction."""
        if not self.cells or self.positions is None:
            return 1
        return int(self.positions[..., 0].size) * (1 if self.directions is None else len(self.directions))

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by.

        Raises  TypeError  for a measure whose function was not read from a file or a module
        """
        return fingerprint(
            "sweep",
            self.document,
            self.operators,
            self.sampling,
            self.columns,
            self.positions,
            self.fixed_circumstances,
            self.directions,
            self.complete,
            self.cells,
        )

    def compute(self, first: int, last: int) -> CellValues:
        """Designs first to last - 1: together; alone where a design has no value together, or has to say why. Of
        each reason the notes count the designs, and name the first."""
        shape = last - first, len(self.columns), self._numbers_per_column
        values, status = np.full(shape, np.nan), np.full(shape, MISSING, dtype=np.uint8)
        reasons: list[dict[tuple[int, str], list[int]]] = [{} for _ in self.columns]  # (status, reason) -> designs

        def fill(row: int, column: int, found: Found) -> None:
            """Put down what was found of a design in a column, and the reason with the design's number."""
            values[row, column], status[row, column], reason = found
            if reason:  # of unreduced numbers it belongs to the highest status, as `max` finds it
                reasons[column].setdefault((int(np.max(found[1])), reason), []).append(first + row)

        for group in self._grouping.groups(list(self._design_columns(first, last))):
            for row, column, found in self._found_in_group(group, first):
                fill(row, column, found)
        for row, column in np.argwhere((status == MISSING).all(axis=-1)).tolist():
            fill(row, column, self._found_alone(first + row, self.columns[column]))
        notes = [
            tuple(
                Note(*key, len(at), (min(at),)) for key, at in sorted(kinds.items(), key=lambda item: min(item[1]))
            )
            for kinds in reasons
        ]
        flat = last - first, len(self.columns) * self._numbers_per_column
        each = tuple(note for note in notes for _ in range(self._numbers_per_column))
        return CellValues(values.reshape(flat), status.reshape(flat), each)

    @cached_property
    def _grouping(self) -> DesignGrouping:
        """How the designs fall into groups that are built together."""
        return DesignGrouping(self.document, self.label, self.operators)

    def _design_columns(self, first: int, last: int) -> Iterator[DesignColumn]:
        """Each key that an axis, or a number tied to it, sets in designs first to last - 1."""
        for axis, values, places in self.sampling.columns(first, last):
            for key, each in axis.columns(values):
                yield DesignColumn(key, each, places)

    def _found_in_group(self, group: DesignGroup, first: int) -> Iterator[tuple[int, int, Found]]:
        """Yield row, column and what was found, of the designs of a group that need not be computed alone.

        first  number of the design of row 0
        """
        chosen = {**self.fixed_circumstances, **group.chosen}
        circumstances = [chosen.get(key) for key in ("direction", "assembly", "model")]
        if isinstance(chosen.get("at"), Mapping):  # joint angles are solved for one design at a time
            return
        for over_workspace in (False, True):  # columns at the handle's position, then those over all positions
            columns = [n for n, one in enumerate(self.columns) if self._over_positions(one) == over_workspace]
            cells = self.positions[..., 0].size if over_workspace and self.positions is not None else 1
            size = max(1, MOST_CELLS // cells)  # designs at once
            for start in range(0, len(group.rows) if columns else 0, size):
                piece = slice(start, start + size)
                at = chosen.get("at") if group.positions is None else group.positions[piece]
                try:
                    point, to_build_alone = group.batch[piece].at(
                        self.positions if over_workspace else at, *circumstances
                    )
                except (
                    errors.OutOfReach,
                    errors.Singular,
                    errors.BeyondLimit,
                ) as error:  # of the one mechanism that all of them have: all valid ones are without a value
                    status = _status_of(error)
                    missed = group.rows[piece][group.valid[piece]]
                    yield from ((int(row), column, (np.nan, status, "")) for row in missed for column in columns)
                    continue
                except (errors.PostureError, errors.LoadError, errors.DeviceError):
                    continue  # each design alone says why
                if over_workspace and self.directions is not None:
                    point = point.along_each(self.directions)
                # whether one point is that of all designs, as their device and positions do not differ
                same = not group.batch.differs and (over_workspace or group.positions is None)
                decided = group.valid[piece] & ~to_build_alone
                if not (over_workspace or same):
                    missed = decided & (point.status != OK)
                    for row, status in zip(group.rows[piece][missed], point.status[missed], strict=True):
                        yield from ((int(row), column, (np.nan, int(status), "")) for column in columns)
                    decided &= ~missed
                kept = np.flatnonzero(decided)
                if not len(kept):
                    continue
                rows = group.rows[piece][kept]
                point = point if same else point[kept]
                for column in columns:
                    found = self._found_at_points(self.columns[column], point, first + rows, same)
                    for row, one in zip(rows, found, strict=True):
                        if one is not None:
                            yield int(row), column, one

    def points_together(self, first: int, last: int) -> Iterator[tuple[Ints, OperatingPoint]]:
        """Designs first to last - 1 that are built together at the handle's position: their numbers from `first`
        (P,), and their points (P,). The others are to be built alone (`point_alone`)."""
        for group in self._grouping.groups(list(self._design_columns(first, last))):
            chosen = {**self.fixed_circumstances, **group.chosen}
            # joint angles are solved for one design at a time; designs that do not differ have one point alone
            if isinstance(chosen.get("at"), Mapping) or not group.batch.differs:
                continue
            at = chosen.get("at") if group.positions is None else group.positions
            try:
                point, to_build_alone = group.batch.at(
                    at, *(chosen.get(key) for key in ("direction", "assembly", "model"))
                )
            except (errors.PostureError, errors.LoadError, errors.DeviceError):
                continue  # each design alone says why
            kept = np.flatnonzero(group.valid & ~to_build_alone & (point.status == OK))
            if len(kept):
                yield group.rows[kept], point[kept]

    def point_alone(self, number: int) -> OperatingPoint | tuple[int, str]:
        """The operating point of a design, built by itself, at its handle's position; or status and reason, where
        it has none."""
        try:
            return self.design(number).point()
        except _NoPoint as failure:
            return failure.status, failure.reason

    def _found_at_points(
        self, one: Column, point: OperatingPoint, designs: Ints, same: bool
    ) -> Iterator[Found | None]:
        """Yield value, status and reason of a column for each of several designs; None for one to be computed
        alone, as several reasons are possible.

        point    of all designs along its first axis, or one for all
        designs  (P,) their numbers in the study
        same     whether `point` is one for all
        """
        measure = one.measure
        if same and not measure.of_wall:
            yield from [self._column_value(one, measure, point)] * len(designs)
            return
        together = not same and measured_together(measure, point) and (measure.of_designs or not measure.of_wall)
        if not together:
            for place, number in enumerate(designs):
                wanted = measure.at_wall(self.design(int(number)).wall)
                yield self._column_value(one, wanted, point if same else point[place])
            return
        try:
            result = evaluate(
                measure.at_wall(self._wanted_walls(designs, point)) if measure.of_wall else measure, point
            )
        except errors.MeasureError as error:
            yield from [(np.nan, NO_VALUE, error.spelled(as_key))] * len(designs)
            return
        reasons: dict[int, list[str]] = {}
        for note in result.notes:
            reasons.setdefault(note.status, []).append(note.reason)
        if one.statistic is None and not self.cells:
            # numbers of Python at once, a hundred times faster than singly
            for value, status in zip(result.values.tolist(), result.status.tolist(), strict=True):
                known = reasons.get(status, [])
                yield None if len(known) > 1 else (value, status, "".join(known))
            return
        for place in range(len(designs)):
            of_design = MeasureValues(result.values[place], result.status[place])
            found = self._reduced(one, of_design, partial(point.__getitem__, place))
            known = reasons.get(int(np.max(found[1])), [])
            yield None if len(known) > 1 else (*found[:2], found[2] or "".join(known))

    def _over_positions(self, one: Column) -> bool:
        """Whether a column is a statistic over all positions."""
        return one.statistic is not None and self.positions is not None

    def _reduced(self, one: Column, found: MeasureValues, point: Callable[[], OperatingPoint]) -> Found:
        """Value, status and reason of a column from the measure's values at one point, or at all positions.

        point  gives that point, or that of all positions
        """
        if self.cells:
            reason = found.notes[0].reason if found.notes else ""
            return found.values.ravel(), found.status.ravel(), reason
        if one.statistic is None:
            return float(found.values), int(found.status), found.notes[0].reason if found.notes else ""
        if self.complete and (found.status != OK).any():
            return one.without_value(found)
        return one.reduce(found, point, self.weights)

    def _column_value(self, one: Column, measure: Measure, point: OperatingPoint) -> Found:
        """Value, status and reason of a column at a point; `measure` is the column's own, told the wanted wall of
        the design."""
        try:
            if not self._over_positions(one) and measure.each:
                status = int(point.status)
                return (np.nan, status, "") if status != OK else evaluate_safely(lambda: measure.compute(point))
            return self._reduced(one, evaluate(measure, point), lambda: point)
        except errors.MeasureError as error:
            return np.nan, NO_VALUE, error.spelled(as_key)

    def _wanted_walls(self, designs: Ints, point: OperatingPoint) -> WantedWall | WantedWalls:
        """The wanted walls of designs, by their numbers (P,), each number an array (P, 1, ...) along the first of
        the point's axes."""
        each = [self.design(int(number)).wall for number in designs]
        given = [name for name in WALL if getattr(each[0], name) is not None]  # and so of all of them
        ones = [1] * (len(point.shape) - 1)
        numbers = {name: np.array([getattr(one, name) for one in each]).reshape(-1, *ones) for name in given}
        return WantedWalls(**numbers, colliding_links=each[0].colliding_links)

    def design(self, number: int) -> Design:
        """One of the designs, by its number from 0."""
        return Design(self, number)

    def _found_alone(self, number: int, one: Column) -> Found:
        """Value, status and reason of a column for a single design, by its number; the last design is kept."""
        if self._cache.get("design", (None, None))[0] != number:
            self._cache["design"] = number, self.design(number)
        design = self._cache["design"][1]
        try:
            point = design.workspace() if self._over_positions(one) else design.point()
        except _NoPoint as failure:
            return np.nan, failure.status, failure.reason
        return self._column_value(one, one.measure.at_wall(design.wall), point)

    @cached_property
    def _keys_in_mechanism(self) -> frozenset[str]:
        """The axes and tied numbers that stand in [mechanism]."""
        keys = {key for axis in self.sampling.axes for key in axis.keys}
        numbers = keys - {*CIRCUMSTANCES}
        return frozenset(key for key in numbers if address.resolve(self.document, key)[0] == "mechanism")

    def settings_of_mechanism(self, chosen: dict[str, Any]) -> list[tuple[str, Any]]:
        """Path and value of each number of a design that stands in [mechanism]."""
        return [(key, value) for key, value in chosen.items() if key in self._keys_in_mechanism]

    def device(self, chosen: dict[str, Any]) -> Device:
        """The device of a design, by key and value of what its axes set; the last one is cached. Raises
        DeviceError."""
        numbers = [(key, value) for key, value in chosen.items() if key not in CIRCUMSTANCES]
        key = (chosen.get("operator"), numbers)
        if self._cache.get("key") != key:
            document = self._grouping.design_document(chosen)
            # whether it can be put together shows where its posture is solved, which takes a tenth of the time
            self._cache.update(key=key, device=from_document(document, self.label, skip_assembly_check=True))
        return self._cache["device"]  # type: ignore[no-any-return]


class Design:
    """One design; its operating points are solved once, when they are first needed."""

    def __init__(self, job: SweepJob, number: int) -> None:
        self.job = job
        self.settings = dict(settings(job.sampling.axes, job.sampling.values(number)))
        self.points: dict[str, OperatingPoint | _NoPoint] = {}

    @property
    def wall(self) -> WantedWall:
        """The wanted wall."""
        numbers = {name: self._circumstance(KEYS[name]) for name in WALL}
        return WantedWall(**numbers, colliding_links=self._circumstance("colliding_links"))

    def point(self) -> OperatingPoint:
        """The operating point at the design's handle position. Raises _NoPoint."""
        return self._solve_once("point", self._circumstance("at"))

    def workspace(self) -> OperatingPoint:
        """The operating points of all positions of the workspace or the task. Raises _NoPoint."""
        point = self._solve_once("workspace", self.job.positions)
        return point if self.job.directions is None else point.along_each(self.job.directions)

    def _solve_once(self, name: str, positions: Any) -> OperatingPoint:
        """The operating point of a name, "point" or "workspace", solved when it is first asked for. Raises
        _NoPoint, and the same again each time."""
        if name not in self.points:
            try:
                self.points[name] = self._solve(name, positions)
            except _NoPoint as failure:
                self.points[name] = failure
        point = self.points[name]
        if isinstance(point, _NoPoint):
            raise point
        return point

    def _solve(self, name: str, positions: Any) -> OperatingPoint:
        """The operating point at some positions. The job keeps the last posture of a name, or why there is none,
        for the next design with the same mechanism."""
        try:
            device = self.job.device(self.settings)
            assembly = self._circumstance("assembly")
            # all that the posture depends on, but for a load: neither the computer nor the operator
            same = name, self._circumstance("at"), assembly, self.job.settings_of_mechanism(self.settings)
            kept, solved = self.job._cache.get(name, (None, None)) if device.load is None else (None, None)
            if kept == same and isinstance(solved, _NoPoint):
                raise solved
            point = device.at(
                solved if kept == same else positions,
                self._circumstance("direction"),
                assembly=assembly,
                model=self._circumstance("model"),
            )
            if kept != same:
                if point.posture is not None and not masses_moved(point.posture).all():
                    from_document(device.document, device.label)  # says what is wrong
                self.job._cache[name] = same, point.posture
        except errors.EquilibriumError as error:
            raise _NoPoint(NO_EQUILIBRIUM, str(error)) from error
        except (errors.OutOfReach, errors.Singular, errors.BeyondLimit) as error:
            failure = _NoPoint(_status_of(error))
            self.job._cache[name] = same, failure
            raise failure from error
        except (errors.PostureError, errors.DeviceError) as error:
            raise _NoPoint(FAILED, _error_text(error)) from error
        except ValueError as error:
            raise _NoPoint(FAILED, str(error)) from error
        return point

    def _circumstance(self, key: str) -> Any:
        """The value of a circumstance: the design's own, else that of all designs; None for neither."""
        return self.settings.get(key, self.job.fixed_circumstances.get(key))


def _status_of(error: errors.OutOfReach | errors.Singular | errors.BeyondLimit) -> int:
    """The status of a design whose handle position this error refuses."""
    if isinstance(error, errors.BeyondLimit):
        return BEYOND_LIMIT
    return OUT_OF_REACH if isinstance(error, errors.OutOfReach) else SINGULAR


def _error_text(error: Exception) -> str:
    """An error on one line, with all faults of a device."""
    if not isinstance(error, errors.DeviceError):
        return str(error)
    return "; ".join(": ".join(filter(None, (fault.key, fault.message))) for fault in error.faults)


def sweep_job(study: Study) -> SweepJob:
    """The job of a study, for which a `Store` can be made.

    Raises  MeasureError  for measures that do not exist for this device, with all their names
    """
    wanted = {KEYS.get(one.name, one.name): getattr(study.wall, one.name) for one in fields(study.wall)}
    circumstances = {key: getattr(study, key) for key in ("at", "direction", "assembly", "model")} | wanted
    fixed = {key: value for key, value in circumstances.items() if value is not None}
    plane, task = study.plane, study.task
    positions, weights = (None, None) if plane is None else (plane.positions, areas(plane.x, plane.y))
    if task is not None:
        positions = task.grid
    # the sources of a device's numbers change no result; they need not be read again for each design
    document = {key: value for key, value in study.device.document.items() if key != "sources"}
    columns, designs = study.columns, study.sampling
    job = SweepJob(
        document,
        study.device.label,
        study.operators,
        designs,
        columns,
        positions,
        weights,
        fixed,
        directions=None if task is None else task.directions,
        complete=task is not None,
    )
    _check_measures(job, study.spelling)
    return job


def _check_measures(job: SweepJob, spelling: errors.Spelling) -> None:
    """Raises MeasureError where a measure exists for none of three designs, the first, the middle and the last, as
    far as they have an operating point; where none has, nothing is raised.

    spelling  as in `Study`
    """
    pending, refused = job.columns, dict[str, str]()
    for number in sorted({0, job.count // 2, job.count - 1}):
        design = job.design(number)
        try:
            point = design.point()
        except _NoPoint:
            continue
        refused = {}
        for one in pending:
            try:
                evaluate(one.measure.at_wall(design.wall), point)
            except errors.MeasureError as error:
                refused[one.name] = error.spelled(spelling)
        pending = tuple(one for one in pending if one.name in refused)
    if refused:
        raise errors.MissingMeasures(refused)
