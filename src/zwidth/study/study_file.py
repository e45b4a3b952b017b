"""From a study file to a `Study`, or to the list of everything that is wrong with it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path as File
from typing import Any, Final

from pydantic import ValidationError

from zwidth.contact.room import check_room
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, Fault, fail, quote
from zwidth.device.load import from_document, in_order
from zwidth.device.operator_choice import NOBODY, operator_table
from zwidth.device.plausible import warn_of_implausible
from zwidth.device.read import DEVICES, LARGEST_FILE, OPERATORS, Shelf, bundled_names, parse, read
from zwidth.device.text_file import Unreadable, read_text
from zwidth.device.toml_access import number, table, tables
from zwidth.device.translate import sentences
from zwidth.device.version import refuse_newer
from zwidth.measures.measure import Measure, WantedWall
from zwidth.measures.user_measures import load_measures
from zwidth.study.axes import CIRCUMSTANCES, Axis, Sampling
from zwidth.study.column import Asked, asked
from zwidth.study.plane import Plane, PlaneError, plane_of
from zwidth.study.study_axes import Found, axes_of, circumstance_fault
from zwidth.study.study_schema import StudyFile, description, unknown

PER_VALUE: Final = 3  # numbers that a value takes: itself, its status, and once more while they are put together
PER_AXIS: Final = 12  # those that a design's own take, as they are written
STUDIES: Final = Shelf("zoo", "study", "a study file", "a study needs a device, measures and an [[axis]]")


@dataclass(frozen=True)
class Study:
    """Many designs of one device, and what is asked of each; read and checked.

    label      the file, as messages call it
    document   what it says
    device     the device without any axis, its own document holding the changes of `set`
    operators  name -> [operator] table of those that an axis names; None: nobody
    sampling   the designs
    asked      the columns
    at, direction, assembly, model   circumstances that no axis sets; None: the file's
    wall       the wanted one, which some measures are asked about, as far as no axis sets it
    plane      the workspace; None where nothing is asked over it
    """

    label: str
    document: dict[str, Any]
    device: Device
    operators: dict[str, Any]
    sampling: Sampling
    asked: tuple[Asked, ...]
    at: tuple[float, ...] | None = None
    direction: tuple[float, ...] | None = None
    assembly: str | None = None
    model: str | None = None
    wall: WantedWall = WantedWall()  # noqa: RUF009  frozen
    plane: Plane | None = None


def read_study(path: str | os.PathLike[str]) -> Study:
    """The study that a file describes.

    Raises DeviceError  with all faults of the file, those of the device file it names among them
           TooLarge     where its designs would not fit into memory
    """
    label = os.fspath(path)
    try:
        text = read_text(label, LARGEST_FILE)
    except Unreadable as error:
        raise fail(label, "", f"{error}; give a study file") from None
    return study_of(parse(text, label, STUDIES), label)


def study_of(document: dict[str, Any], label: str = "study") -> Study:
    """The study that a document describes.

    label   what messages call it; files that it names lie beside it
    Raises  DeviceError  with all faults found
            TooLarge     where its designs would not fit into memory
    """
    refuse_newer(document, label)
    found: Found = []
    checked: StudyFile | None = None
    try:
        checked = StudyFile.model_validate(document)
    except ValidationError as error:
        found += sentences(error, document, description, unknown)
    elsewhere: list[Fault] = []
    folder = File(label).parent
    device = _device(document, folder, found, elsewhere)
    columns = _asked(document, folder, found)
    axes = axes_of(document, device, found)
    operators = _operators(document, folder, found, elsewhere)
    _sampling(document, found)
    _circumstances(document, device, found)
    plane = _plane(document, device, columns, found)
    if found or elsewhere or checked is None or device is None:
        raise DeviceError([*in_order(found, document, label), *elsewhere])
    hypercube = checked.sampling == "latin-hypercube"
    _check_size(checked, hypercube)
    return Study(
        label=label,
        document=document,
        device=device,
        operators=operators,
        sampling=Sampling(axes, checked.count if hypercube else None, 1 if checked.seed is None else checked.seed),
        asked=columns,
        at=checked.at,
        direction=checked.direction,
        assembly=checked.assembly,
        model=checked.model,
        wall=WantedWall(checked.stiffness_N_per_m, checked.damping_Ns_per_m, checked.frequency_Hz),
        plane=plane,
    )


def _check_size(checked: StudyFile, hypercube: bool) -> None:
    """Raises TooLarge where the designs would not fit into memory, before they are spread out."""
    each = [len(axis.values) if axis.values is not None else axis.count or 1 for axis in checked.axis]
    designs = (checked.count or 0) if hypercube else prod(each)
    ties = sum(len(axis.tie) for axis in checked.axis)
    numbers = designs * (PER_VALUE * len(checked.measures) + PER_AXIS * (len(checked.axis) + ties))
    check_room(float(numbers), f"{designs} designs of {len(checked.measures)} measures", "lower a count")


def beside(name: str, folder: File, shelf: Shelf = DEVICES) -> str:
    """A bundled name as it is, any other as a file beside the study."""
    return name if name in bundled_names(shelf) else str(folder / name)


def _device(document: dict[str, Any], folder: File, found: Found, elsewhere: list[Fault]) -> Device | None:
    """The device with those of the study's changes that can be meant; None where there is none, which is told."""
    name, operator, changes = (document.get(key) for key in ("device", "operator", "set"))
    if not isinstance(name, str) or not name:
        return None
    try:
        inner, label = read(beside(name, folder))
    except DeviceError as error:
        elsewhere += error.faults
        return None
    if isinstance(operator, str) and operator:
        try:
            inner = _held(inner, _operator(operator, folder))
        except DeviceError as error:
            elsewhere += error.faults
    for n, change in enumerate(changes if isinstance(changes, list) else []):
        if not isinstance(change, str):
            continue
        try:
            inner = address.apply(inner, [change])
        except DeviceError as error:
            found += [(("set", n), ": ".join(filter(None, (f.key, f.message)))) for f in error.faults]
    try:
        device = from_document(inner, label)
    except DeviceError as error:
        elsewhere += error.faults
        return None
    if device.response is not None:
        found.append((("device",), "has a measured [response] and no model, whose numbers a study could vary"))
        return None
    warn_of_implausible(device)
    return device


def _operator(name: str, folder: File) -> Any:
    """The [operator] table of a name or a file beside the study; None for nobody."""
    return None if name == NOBODY else operator_table(beside(name, folder, OPERATORS))


def _held(document: dict[str, Any], operator: Any) -> dict[str, Any]:
    """A device's document with this [operator], or with nobody."""
    without = {key: value for key, value in document.items() if key != "operator"}
    return without if operator is None else without | {"operator": operator}


def _operators(document: dict[str, Any], folder: File, found: Found, elsewhere: list[Fault]) -> dict[str, Any]:
    """The operators that an axis names."""
    tables_: dict[str, Any] = {}
    for _, axis in tables(document, "axis"):
        values = axis.get("values")
        for name in values if axis.get("key") == "operator" and isinstance(values, list) else []:
            if isinstance(name, str) and name:
                try:
                    tables_[name] = _operator(name, folder)
                except DeviceError as error:
                    elsewhere += error.faults
    return tables_


def _asked(document: dict[str, Any], folder: File, found: Found) -> tuple[Asked, ...]:
    """The columns as far as their measures are known."""
    own: dict[str, Measure] = {}
    file, names = document.get("measures_file"), document.get("measures")
    if isinstance(file, str) and file:
        try:
            own = load_measures(str(folder / file))
        except ValueError as error:
            found.append((("measures_file",), str(error)))
            return ()  # a measure that is not known may be one of those
    columns: list[Asked] = []
    for n, name in enumerate(names if isinstance(names, list) else []):
        if not isinstance(name, str) or not name:
            continue
        try:
            column = asked(name, own)
        except ValueError as error:
            found.append((("measures", n), str(error)))
            continue
        if column.name in [other.name for other in columns]:
            found.append((("measures", n), f"{column.name} is asked for twice; remove one"))
        columns.append(column)
    return tuple(columns)


def _sampling(document: dict[str, Any], found: Found) -> None:
    if document.get("sampling", "grid") == "latin-hypercube":
        if "count" not in document:
            found.append((("sampling",), "'latin-hypercube' needs count, how many designs"))
        return
    for key in ("count", "seed"):
        if key in document:
            found.append(((key,), "is read with sampling = 'latin-hypercube' only; remove it, or set that"))


def _circumstances(document: dict[str, Any], device: Device | None, found: Found) -> None:
    """Whether circumstances fit the device, and are set once."""
    varied = {axis.get("key") for _, axis in tables(document, "axis")}
    for key in CIRCUMSTANCES:
        if key not in document:
            continue
        if key in varied:
            found.append(((key,), "is an axis, too; remove one of them"))
        right = isinstance(document[key], list if key in ("at", "direction") else str)
        if key in ("at", "direction", "assembly") and right and document[key]:
            components = document[key] if key != "assembly" else [0.0]
            if all(map(number, components)) and (said := circumstance_fault(key, document[key], device)):
                fault = ((key,), said)
                # the schema may have said so in its own words
                found += [fault] if all(path != (key,) for path, _ in found) else []


def _plane(
    document: dict[str, Any], device: Device | None, columns: Sequence[Asked], found: Found
) -> Plane | None:
    """The grid over the workspace, the same for all designs; None where nothing is asked over it."""
    wanted = [column.name for column in columns if column.over]
    if not wanted:
        if "workspace" in document and columns:
            said = f"is read by measures over it only, such as average({columns[0].measure.name}); remove it"
            found.append((("workspace",), said))
        return None
    if device is None or any(path[0] in ("workspace", "at", "assembly") for path, _ in found):
        return None
    if device.mechanism is None:
        found.append((("measures",), f"{wanted[0]} is over a workspace, and the device is given by its [plant]"))
        return None
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
    except PlaneError as error:
        found.append((("workspace",), error.spelled(_workspace_key)))
    except DeviceError as error:
        found.append((("workspace",), error.faults[0].message))
    except ValueError as error:  # an assembly that is singular throughout, or does not close
        found.append((("workspace",), f"cannot be laid out: {error}"))
    return None


def _workspace_key(name: str, value: str | None) -> str:
    """An argument of `plane_of` as [workspace] spells it."""
    key = {"axes": "plane", "cells": "count"}.get(name, name)
    return key if value is None else f'{key} = "{value}"'


def held(study: Study, name: str, document: dict[str, Any]) -> dict[str, Any]:
    """The device's document with one of the operators that an axis names."""
    return _held(document, study.operators[name])


def where(axis: Axis, value: Any) -> str:
    """An axis's value for people."""
    return f"{axis.key} = {quote(list(value)) if isinstance(value, tuple) else quote(value)}"
