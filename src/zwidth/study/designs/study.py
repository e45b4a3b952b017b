"""`Study`: many designs of one device and the measures of each; `check_study` makes it from a study document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import prod
from pathlib import Path as File
from typing import Any, Final

from pydantic import ValidationError

from zwidth.device.address import is_number, table, tables
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, nearest, plural
from zwidth.device.validation_messages import validation_messages
from zwidth.errors import DeviceError, Spelling, TooLarge, WorkspaceError
from zwidth.measures.definition import Measure, WantedWall
from zwidth.questions import WANTED
from zwidth.study.designs.axis_tables import TableFaults, axes_of, circumstance_fault
from zwidth.study.designs.column import Column, column_named
from zwidth.study.designs.sampling import CIRCUMSTANCES, Axis, Sampling
from zwidth.study.designs.study_schema import MOST, StudyFile, description, unknown_key_sentence
from zwidth.study.designs.task import Task, task_of
from zwidth.study.workspace.plane_grid import PlaneGrid, plane_of

MOST_ALONG: Final = 10**6  # values of one axis that has a range and a count
# Argument in Python -> what it is called as a key of a study file, or of its [workspace].
KEYS: Final[dict[str, str]] = {
    "position": "at",
    **{one.name: one.key for one in WANTED.values()},
    "axes": "plane",
    "cells": "count",
}


def as_key(name: str, value: str | None) -> str:
    """An argument of `sweep` as a key of a study file, with its value.

    >>> as_key("stiffness", None), as_key("model", "rigid")
    ('stiffness_N_per_m', 'model = "rigid"')
    """
    key = KEYS.get(name, name)
    return key if value is None else f'{key} = "{value}"'


@dataclass(frozen=True, repr=False)
class Study:
    """Many designs of one device, and the measures to compute for each.

    label      name of the study file, for messages
    document   the study file as read
    device     the device that designs are made from, with the changes of `set`
    operators  name -> [operator] table of the operators that an axis names; None: no operator
    sampling   the designs
    columns    the measures, one column of the result each
    at, direction, assembly, model   circumstances that no axis sets; None: those of the device file
    wall       the wanted wall and what else some measures need, as far as no axis sets it
    plane      grid over the workspace; None where no measure is over it
    task       where measures are taken instead; None without a [task]
    user_measures  measures of the user's own, by name
    spelling   how messages spell arguments: as keys of a file or as arguments in Python
    """

    label: str
    document: dict[str, Any]
    device: Device
    operators: dict[str, Any]
    sampling: Sampling
    columns: tuple[Column, ...]
    at: Sequence[float] | Mapping[str, float] | None = None
    direction: Sequence[float] | None = None
    assembly: str | None = None
    model: str | None = None
    wall: WantedWall = field(default_factory=WantedWall)
    plane: PlaneGrid | None = None
    task: Task | None = None
    user_measures: Mapping[str, Measure] = field(default_factory=dict)
    spelling: Spelling = as_key

    def __repr__(self) -> str:
        axes = ", ".join(axis.key for axis in self.sampling.axes)
        names = ", ".join(column.name for column in self.columns)
        designs = plural(self.sampling.count, "design")
        return f"Study: {designs} of {self.device.label!r} over {axes}\n  of each {names}"

    @property
    def turns(self) -> bool:
        """Whether every design renders moments about an axis, so that stiffness is in N m/rad; False where an axis
        varies the direction."""
        varied = "direction" in [axis.key for axis in self.sampling.axes]
        return not varied and self.device.renders_moments(self.direction)


def check_study(
    document: dict[str, Any],
    label: str,
    device: Device | None,
    operators: dict[str, Any],
    user_measures: Mapping[str, Measure] | None,
    faults: TableFaults,
    *,
    plane: PlaneGrid | None = None,
    spelling: Spelling = as_key,
    bounds: bool = False,
    needs: Sequence[str] | None = None,
) -> Study | None:
    """The study that a document describes; None where anything is wrong with it, which is added to `faults`.

    label          the study's file, for messages; catalogues lie beside it
    device         with the changes of `set`; None: it could not be loaded, which the caller reports
    operators      as in `Study`
    user_measures  a user's measures by name; None: they could not be loaded, and no measure is looked up
    plane          grid over the workspace; None: as the document's [workspace] says
    bounds         whether the axes are the variables of an optimiser, and the measures those of [optimise]
    needs          keys that the document must have; None: axis, and without bounds measures
    Raises         TooLarge  where the designs would not fit into memory
    """
    checked = _checked_file(document, faults)
    faults += _missing_key_faults(document, needs or (("axis",) if bounds else ("measures", "axis")))
    device = _device_with_numbers(device, faults)
    columns = () if user_measures is None else _measure_columns(document, user_measures, faults)
    axes = axes_of(document, device, faults, File(label).parent, bounds=bounds)
    _check_sampling(document, faults)
    _check_circumstances(document, device, faults)
    task = _task(document, device, columns, faults, bounds)
    # an optimiser's columns are those of [optimise]
    plane = None if task or bounds else plane_of_study(document, device, columns, plane, faults, spelling)
    if faults or checked is None or device is None:
        return None
    study = Study(
        label=label,
        document=document,
        device=device,
        operators=operators,
        sampling=_sampling_of(checked, axes),
        columns=columns,
        plane=plane,
        task=task,
        user_measures=user_measures or {},
        spelling=spelling,
    )
    return _in_rendered_units(_with_circumstances(study, checked))


def _checked_file(document: dict[str, Any], faults: TableFaults) -> StudyFile | None:
    """Check a document against the schema of study files and return it; None where it does not fit, the reasons
    of which are added to `faults`."""
    try:
        return StudyFile.model_validate(document)
    except ValidationError as error:
        faults += validation_messages(error, document, description, unknown_key_sentence)
    return None


def _device_with_numbers(device: Device | None, faults: TableFaults) -> Device | None:
    """Return the device where it has numbers to vary; None for a measured one, which is added to `faults`, and
    where there is none."""
    if device is not None and device.response is not None:
        faults.append(
            (
                ("device",),
                "is a measured [response], which has no numbers to vary; name another device",
            )
        )
        return None
    return device


def _sampling_of(checked: StudyFile, axes: tuple[Axis, ...]) -> Sampling:
    """Return the designs of a checked study over its axes. Raises TooLarge where these are too many."""
    hypercube = checked.sampling == "latin-hypercube"
    _check_design_count(checked, hypercube)
    return Sampling(
        axes,
        checked.count if hypercube else None,
        1 if checked.seed is None else checked.seed,
        checked.sampling == "paired",
    )


def _with_circumstances(study: Study, checked: StudyFile) -> Study:
    """Return the study with the circumstances and the wanted wall of its checked file."""
    return replace(
        study,
        at=checked.at,
        direction=checked.direction,
        assembly=checked.assembly,
        model=checked.model,
        wall=WantedWall(
            **{one.name: getattr(checked, one.key) for one in WANTED.values()},
            colliding_links=checked.colliding_links,
        ),
    )


def _in_rendered_units(study: Study) -> Study:
    """Return the study, its measures with stiffness in N m/rad where all its designs render moments."""
    if not study.turns:
        return study
    return replace(
        study, columns=tuple(replace(one, measure=one.measure.about_moments()) for one in study.columns)
    )


def _missing_key_faults(document: dict[str, Any], needs: Sequence[str]) -> Iterator[tuple[KeyPath, str]]:
    """Faults of keys that a document needs and lacks; the schema reports one that is only misspelt, as unknown."""
    for key in needs:
        others = [other for other in document if other not in StudyFile.model_fields]
        if key not in document and all(nearest(other, list(StudyFile.model_fields)) != key for other in others):
            yield (key,), f"is missing; add it ({description((key,))})"


def _measure_columns(
    document: dict[str, Any], user_measures: Mapping[str, Measure], faults: TableFaults
) -> tuple[Column, ...]:
    """The columns whose measures exist, repeated ones too; unknown and repeated ones are added to `faults`."""
    names = document.get("measures")
    columns: list[Column] = []
    for n, name in enumerate(names if isinstance(names, list) else []):
        if not isinstance(name, str) or not name:
            continue
        try:
            column = column_named(name, user_measures)
        except ValueError as error:
            faults.append((("measures", n), str(error)))
            continue
        if column.name in [other.name for other in columns]:
            faults.append((("measures", n), f"{column.name} is listed twice; remove one"))
        columns.append(column)
    return tuple(columns)


def _check_sampling(document: dict[str, Any], faults: TableFaults) -> None:
    """Add the faults of `count` and `seed`, which belong to a Latin hypercube."""
    if document.get("sampling", "grid") == "latin-hypercube":
        if "count" not in document:
            faults.append((("sampling",), "'latin-hypercube' needs count, how many designs"))
        return
    for key in ("count", "seed"):
        if key in document:
            faults.append(((key,), "is read with sampling = 'latin-hypercube' only; remove it, or set that"))


def _check_circumstances(document: dict[str, Any], device: Device | None, faults: TableFaults) -> None:
    """Add the faults of circumstances that do not fit the device, or that an axis sets too."""
    varied = {axis.get("key") for _, axis in tables(document, "axis")}
    for key in CIRCUMSTANCES:
        if key not in document:
            continue
        if key in varied:
            faults.append(((key,), "is an axis as well; remove one of the two"))
        right_type = isinstance(document[key], list if key in ("at", "direction") else str)
        if key in ("at", "direction", "assembly") and right_type and document[key]:
            # texts among the components are for the schema to report; an assembly has none
            components = document[key] if key != "assembly" else [0.0]
            if all(map(is_number, components)) and (message := circumstance_fault(key, document[key], device)):
                fault = ((key,), message)
                # the schema may have reported this key already
                faults += [fault] if all(path != (key,) for path, _ in faults) else []


def plane_of_study(
    document: dict[str, Any],
    device: Device | None,
    columns: Sequence[Column],
    plane: PlaneGrid | None,
    faults: TableFaults,
    spelling: Spelling,
) -> PlaneGrid | None:
    """The grid over the workspace, the same for all designs; None where no measure is over it, or anything is
    wrong, which is added to `faults` unless it is there already.

    plane     a grid that was given; None: as the document's [workspace] says
    spelling  as in `Study`
    """
    names = [column.name for column in columns if column.statistic]
    if not names:
        if (plane is not None or "workspace" in document) and columns:
            message = f"is used only by measures over the workspace, such as average({columns[0].measure.name}); "
            faults.append((("workspace",), message + "remove it"))
        return None
    if device is None or any(path[0] in ("workspace", "at", "assembly") for path, _ in faults):
        return None
    if device.mechanism is None:
        faults.append(
            (
                ("measures",),
                f"{names[0]} needs the workspace of a [mechanism]; this device gives its [plant] only",
            )
        )
        return None
    if plane is not None:
        return plane
    return _plane_of_document(document, device, faults, spelling)


def _plane_of_document(
    document: dict[str, Any], device: Device, faults: TableFaults, spelling: Spelling
) -> PlaneGrid | None:
    """Make the grid that the document's [workspace] describes and return it; None where there is no such grid, the
    reason of which is added to `faults`."""
    given = table(document, "workspace")
    count: Any = given.get("count", 15)
    try:
        return plane_of(
            device,
            given.get("plane"),
            given.get("through_m", document.get("at")),
            given.get("x_m"),
            given.get("y_m"),
            (count, count) if isinstance(count, int) else count,
            document.get("assembly"),
        )
    except WorkspaceError as error:
        faults.append((("workspace",), error.spelled(spelling)))
    except DeviceError as error:
        faults.append((("workspace",), error.faults[0].message))
    except ValueError as error:  # an assembly that is singular throughout, or does not close
        faults.append((("workspace",), f"no plane can be laid through it: {error}"))
    return None


def _task(
    document: dict[str, Any], device: Device | None, columns: Sequence[Column], faults: TableFaults, bounds: bool
) -> Task | None:
    """The task of the study; None without one, and where it or the circumstances of its reference have faults. Its
    own faults are added to `faults`, and those of keys that do not go with it, with which it is returned.

    bounds  whether the study is read for an optimiser, which has several operators
    """
    if "task" not in document:
        return None
    if "workspace" in document:
        faults.append((("workspace",), "and [task] exclude each other; remove one of them"))
    if not bounds:
        given = table(document, "task")
        if "operators" in given:
            faults.append((("task", "operators"), "is for an optimiser; remove it, or vary operator by an axis"))
        if columns and not any(column.statistic for column in columns):
            message = f"is used only by measures over it, such as worst({columns[0].measure.name}); remove it"
            faults.append((("task",), message))
    if device is None or any(path[0] in ("task", "at", "assembly", "direction") for path, _ in faults):
        return None
    return task_of(document, device, faults)


def _check_design_count(checked: StudyFile, hypercube: bool) -> None:
    """Raise TooLarge for more designs, or more listed values of one axis, than any computer takes, before any is
    made.

    hypercube  whether they are a Latin hypercube; else they are all combinations, or those of paired axes

    Whether fewer fit into memory, or on the disk, depends on where they are kept: `executor.run` and `Store` see.
    """
    each = [len(axis.values) if axis.values is not None else axis.count or 1 for axis in checked.axis]
    designs = (checked.count or 0) if hypercube else each[0] if checked.sampling == "paired" else prod(each)
    many = f"{plural(designs, 'design')} of {plural(len(checked.measures), 'measure')}"
    if designs > MOST:
        raise TooLarge(f"{many} are more than zwidth computes, {MOST} at most; lower a count")
    for axis in checked.axis:
        if axis.values is None and (axis.count or 1) > MOST_ALONG:
            raise TooLarge(
                f"{many}: the axis {axis.key} has {axis.count} values, and {MOST_ALONG} at most are listed; lower "
                "its count, or use a Latin hypercube"
            )
