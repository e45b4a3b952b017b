"""From a study file to a `Study`, or to the list of everything that is wrong with it.

`study_over`: a study from the arguments of a function, by the same checks, its faults in the words of Python.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Final

from zwidth.device import address
from zwidth.device.address import is_number, table, tables
from zwidth.device.device import Device
from zwidth.device.faults import Fault, KeyPath, fail
from zwidth.device.load import NOBODY, from_document, in_order, operator_table, with_operator
from zwidth.device.plausibility import warn_of_implausible
from zwidth.device.read import (
    DEVICES,
    LARGEST_FILE,
    OPERATORS,
    BundledFiles,
    bundled_names,
    check_not_newer,
    parse_document,
    read,
    read_text,
)
from zwidth.device.schema.device_file import DEVICE_KEYS, STUDY_KEYS
from zwidth.errors import DeviceError, FileError, as_argument
from zwidth.measures.definition import Measure
from zwidth.measures.user_measures import load_measures
from zwidth.model.argument_checks import check_kind, wrong_type
from zwidth.questions import WANTED
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.designs.column import measure_list
from zwidth.study.designs.study import KEYS, Study, check_study
from zwidth.study.workspace.plane_grid import PlaneGrid

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from zwidth.loop.posed_device import Position


STUDIES: Final = BundledFiles("zoo", "study", "a study file", "a study needs a device, measures and an [[axis]]")


def read_study(path: str | os.PathLike[str], *, bounds: bool = False) -> Study:
    """The study that a file describes.

    bounds  whether it is read for an optimiser, see `study_of`
    Raises DeviceError  with all faults of the file, those of the device file it names among them
           TooLarge     where its designs would not fit into memory
    """
    label = os.fspath(path)
    return study_of(read_document(label), label, bounds=bounds)


def read_document(label: str) -> dict[str, Any]:
    """The tables of a study file. Raises DeviceError."""
    try:
        text = read_text(label, LARGEST_FILE)
    except FileError as error:
        if error.missing and label in bundled_names():
            raise _device_error(label, "a bundled device") from None
        raise fail(label, "", f"{error}; give a study file") from None
    return parse_document(text, label, STUDIES)


def study_of(
    document: dict[str, Any],
    label: str = "study",
    *,
    bounds: bool = False,
    needs: Sequence[str] | None = None,
    further: Callable[[Device | None, TableFaults], None] | None = None,
    further_of_measures: Callable[[Device | None, Mapping[str, Measure], TableFaults], None] | None = None,
) -> Study:
    """The study that a document describes.

    label    what messages call it; files that it names lie beside it
    bounds   whether it is read for an optimiser: ranges of axes are bounds, and measures those of [optimise]
    needs    keys that it must have, see `check_study`
    further  adds the faults of tables that a sweep leaves aside, such as [[tolerance]]
    further_of_measures  the same of tables that name measures, given the user's own; not called where those could
             not be loaded
    Raises  DeviceError  with all faults found
            TooLarge     where its designs would not fit into memory
    """
    check_not_newer(document, label)
    if DEVICE_KEYS & document.keys() and not STUDY_KEYS & document.keys():
        raise _device_error(label, "a device")
    faults: TableFaults = []
    absent: TableFaults = []  # files that the study names and that are not there
    file_faults: list[Fault] = []  # of those that are
    folder = File(label).parent
    device = _device_of_study(document, folder, faults, absent, file_faults)
    operators = axis_operators(document, folder, absent, file_faults)
    own_measures = _user_measures(document, folder, faults)
    study = check_study(document, label, device, operators, own_measures, faults, bounds=bounds, needs=needs)
    if further is not None:
        further(device, faults)
    if further_of_measures is not None and own_measures is not None:
        further_of_measures(device, own_measures, faults)
    faults += absent
    if study is None or faults or file_faults:
        raise DeviceError([*in_order(faults, document, label), *file_faults])
    return study


def _device_error(label: str, what: str) -> DeviceError:
    """The error about a device that was given in place of a study; `what` it is: "a device" or "a bundled
    device"."""
    name = json.dumps(File(label).name)
    return fail(
        label, "", f"is {what}, not a study; write a study file with device = {name}, measures and an [[axis]]"
    )


def axis_operators(
    document: dict[str, Any], folder: File, absent: TableFaults, file_faults: list[Fault]
) -> dict[str, Any]:
    """The operators that an axis or the task names, by name: their tables, None for nobody.

    folder       that files are looked for in
    absent       gets the faults of names that are neither bundled nor files
    file_faults  gets the faults of the files
    """
    operators: dict[str, Any] = {}
    lists: list[tuple[KeyPath, Any]] = [
        (("axis", n, "values"), axis.get("values"))
        for n, axis in tables(document, "axis")
        if axis.get("key") == "operator"
    ]
    for key, names in (*lists, (("task", "operators"), table(document, "task").get("operators"))):
        for n, name in enumerate(names if isinstance(names, list) else []):
            if isinstance(name, str) and name:
                with _faults_kept((*key, n), name, folder, absent, file_faults):
                    operators[name] = _operator_table(name, folder)
    return operators


@contextmanager
def _faults_kept(
    key: KeyPath, name: str, folder: File, absent: TableFaults, file_faults: list[Fault]
) -> Iterator[None]:
    """Keep the faults of a file that is read inside this block: as the study's where it names none that is there,
    else as the file's own."""
    try:
        yield
    except DeviceError as error:
        if (folder / name).exists():
            file_faults += error.faults
        else:
            absent += [(key, f"'{name}' {fault.message}") for fault in error.faults]


def _device_of_study(
    document: dict[str, Any], folder: File, faults: TableFaults, absent: TableFaults, file_faults: list[Fault]
) -> Device | None:
    """The device with the study's operator and changes; None where it cannot be loaded.

    faults                gets the faults of the changes
    absent, file_faults   as for `axis_operators`
    """
    name, operator, changes = (document.get(key) for key in ("device", "operator", "set"))
    if not isinstance(name, str) or not name:
        return None
    found: tuple[dict[str, Any], str] | None = None
    with _faults_kept(("device",), name, folder, absent, file_faults):
        found = read(_resolve_name(name, folder))
    if found is None:
        return None
    inner, label = found
    if isinstance(operator, str) and operator:
        with _faults_kept(("operator",), operator, folder, absent, file_faults):
            inner = with_operator(inner, _operator_table(operator, folder))
    for n, change in enumerate(changes if isinstance(changes, list) else []):
        if not isinstance(change, str):
            continue
        try:
            inner = address.apply(inner, [change])
        except DeviceError as error:
            faults += [(("set", n), ": ".join(filter(None, (f.key, f.message)))) for f in error.faults]
    try:
        device = from_document(inner, label)
    except DeviceError as error:
        file_faults += error.faults
        return None
    if device.response is None:
        warn_of_implausible(device)
    return device


def _user_measures(document: dict[str, Any], folder: File, faults: TableFaults) -> dict[str, Measure] | None:
    """The user's measures of the file that the study names, by name; {} where it names none, None where the file
    has faults."""
    file = document.get("measures_file")
    if not isinstance(file, str) or not file:
        return {}
    try:
        return load_measures(str(folder / file))
    except ValueError as error:
        faults.append((("measures_file",), str(error)))
        return None  # a measure that is not known may be one of those


def _operator_table(name: str, folder: File) -> dict[str, Any] | None:
    """The [operator] table of a name or a file beside the study; None for nobody."""
    return None if name == NOBODY else operator_table(_resolve_name(name, folder, OPERATORS))


def _resolve_name(name: str, folder: File, shelf: BundledFiles = DEVICES) -> str:
    """A bundled name as it is, any other as the path of a file beside the study.

    shelf  which bundled files are looked at: devices or operators
    """
    return name if name in bundled_names(shelf) else str(folder / name)


LABEL: Final = "sweep"
VECTORS: Final = ("at", "direction")  # of which each value is a list
# Arguments that a study file calls otherwise.
RENAMED_ARGUMENTS: Final = ("position", *(one.name for one in WANTED.values() if one.name != one.key))
ARGUMENTS: Final = {KEYS[name]: name for name in RENAMED_ARGUMENTS} | {"axis": "axes", "workspace": "plane"}


def study_over(
    device: Device,
    axes: Mapping[str, Sequence[Any] | ArrayLike],
    measures: str | Measure | Sequence[str | Measure],
    *,
    position: Position | None = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
    stiffness: float | None = None,
    damping: float | None = None,
    frequency: float | None = None,
    spectral_radius: float | None = None,
    stiffness_margin: float | None = None,
    damping_margin: float | None = None,
    delay_margin: float | None = None,
    lowest_frequency: float | None = None,
    highest_frequency: float | None = None,
    force: float | None = None,
    link_radius: float | None = None,
    colliding_links: Sequence[str] | None = None,
    paired: bool = False,
    plane: PlaneGrid | None = None,
    user_measures: Mapping[str, Measure] | None = None,
) -> Study:
    """The study of a grid over axes of a device, or of paired axes; see `sweep` for the arguments. A position
    given by joint angles, which no study file can hold, is set behind the check of the rest.

    Raises  DeviceError  with all faults found
            TooLarge     where the designs would not fit into memory
            TypeError    for arguments of another kind
    """
    check_kind("device", device, Device)
    if plane is not None:
        check_kind(
            "plane", plane, PlaneGrid, f"write plane_of(device, {plane!r})" if isinstance(plane, str) else ""
        )
    names, measures_by_name = measures_in_file(measures, user_measures)
    given = {
        "position": None if isinstance(position, Mapping) else position,
        "direction": direction,
        "assembly": assembly,
        "model": model,
        "stiffness": stiffness,
        "damping": damping,
        "frequency": frequency,
        "spectral_radius": spectral_radius,
        "stiffness_margin": stiffness_margin,
        "damping_margin": damping_margin,
        "delay_margin": delay_margin,
        "lowest_frequency": lowest_frequency,
        "highest_frequency": highest_frequency,
        "force": force,
        "link_radius": link_radius,
        "colliding_links": colliding_links,
    }
    document: dict[str, Any] = {
        "device": device.label,
        "measures": names,
        "axis": [{"key": key, "values": values} for key, values in _axis_values(axes)],
        **({"sampling": "paired"} if paired else {}),
        **{KEYS.get(name, name): plain_value(value) for name, value in given.items() if value is not None},
    }
    faults: TableFaults = []
    operator_faults: list[Fault] = []
    absent: TableFaults = []
    operators = axis_operators(document, File(), absent, operator_faults)
    study = check_study(
        document, LABEL, device, operators, measures_by_name, faults, plane=plane, spelling=as_argument
    )
    if isinstance(position, Mapping):
        faults += _angle_faults(device, position, axes)
    faults += absent
    if faults or operator_faults or study is None:
        raise DeviceError(
            [*(_fault_of_argument(path, message, list(axes)) for path, message in faults), *operator_faults]
        )
    return replace(study, at=position) if isinstance(position, Mapping) else study


def measures_in_file(
    measures: str | Measure | Sequence[str | Measure], user_measures: Mapping[str, Measure] | None
) -> tuple[list[str], dict[str, Measure]]:
    """The names of the measures, and the user's own `Measure`s by name, from both arguments."""
    listed = measure_list(measures)
    given = {one.name: one for one in listed if isinstance(one, Measure)}
    return [one.name if isinstance(one, Measure) else one for one in listed], {**(user_measures or {}), **given}


def _axis_values(axes: Any) -> Iterator[tuple[str, list[Any]]]:
    """Yield path and values of each axis, the values as a list of Python numbers. Raises TypeError for another
    kind of argument, and ValueError for no axis or no value."""
    if not isinstance(axes, Mapping):
        raise wrong_type("axes", "a dictionary of paths and values", axes)
    if not axes:
        raise ValueError("axes has no path to vary; write such as {'loop.sampling_period_s': [0.0005, 0.001]}")
    for key, values in axes.items():
        if not isinstance(key, str):
            raise wrong_type("axes", "a dictionary whose keys are paths", key)
        plain = plain_value(values)
        if isinstance(plain, list) and not plain:
            raise ValueError(f"axes[{key!r}] has no values; give at least one")
        # a plain list of numbers for `at` is one position, not a list of positions
        if not isinstance(plain, list) or (key in VECTORS and all(map(is_number, plain))):
            raise wrong_type(f"axes[{key!r}]", "a list of values", values, f"write [{plain!r}]")
        yield key, plain


def plain_value(value: Any) -> Any:
    """Arrays, NumPy numbers, tuples and ranges as Python numbers and lists."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return [plain_value(inner) for inner in value] if isinstance(value, list | tuple | range) else value


def _angle_faults(device: Device, angles: Mapping[str, float], axes: Mapping[str, Any]) -> TableFaults:
    """What is wrong with a position given by the angles of the driven joints."""
    faults: TableFaults = [(("at",), "is an axis as well; remove one of the two")] if "at" in axes else []
    try:
        device.position(angles)
    except DeviceError as error:
        faults.append((("at",), error.faults[0].message))
    return faults


def _fault_of_argument(path: KeyPath, message: str, keys: list[str]) -> Fault:
    """The fault at a path of the document that `study_over` makes, under the argument that it came from; `keys`
    are those of the axes, in order."""
    argument = ARGUMENTS.get(str(path[0]), str(path[0]))
    if path[0] != "axis" or len(path) < 3:
        return Fault(argument, "", message)
    _, number, entry, *_ = path  # ("axis", number of the axis, key of its table)
    key = keys[int(number)]
    if entry != "key":
        return Fault(argument, key, message)
    # an argument's name, such as `stiffness`, in place of the key of a study file
    return Fault(
        argument, "", f"'{key}' as an axis is called '{KEYS[key]}'" if key in RENAMED_ARGUMENTS else message
    )
