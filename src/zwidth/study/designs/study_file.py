"""From a study file to a `Study`, or to the list of everything that is wrong with it."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path as File
from typing import Any, Final

from zwidth.device import address
from zwidth.device.consistency import DEVICE_KEYS, STUDY_KEYS
from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, Fault, KeyPath, fail
from zwidth.device.format_version import refuse_newer
from zwidth.device.load import from_document, in_order
from zwidth.device.operator_choice import NOBODY, operator_table, with_operator
from zwidth.device.plausibility import warn_of_implausible
from zwidth.device.read import DEVICES, LARGEST_FILE, OPERATORS, BundledFiles, bundled_names, parse_document, read
from zwidth.device.text_file import UnreadableFileError, read_text
from zwidth.device.toml_access import table, tables
from zwidth.measures.definition import Measure
from zwidth.measures.user_measures import load_measures
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.designs.study import Study, check_study

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
    except UnreadableFileError as error:
        if error.missing and label in bundled_names():
            raise _device_instead(label, "a bundled device") from None
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
    refuse_newer(document, label)
    if DEVICE_KEYS & document.keys() and not STUDY_KEYS & document.keys():
        raise _device_instead(label, "a device")
    faults: TableFaults = []
    absent: TableFaults = []  # files that the study names and that are not there
    file_faults: list[Fault] = []  # of those that are
    folder = File(label).parent
    device = _device(document, folder, faults, absent, file_faults)
    operators = axis_operators(document, folder, absent, file_faults)
    own_measures = _own_measures(document, folder, faults)
    study = check_study(document, label, device, operators, own_measures, faults, bounds=bounds, needs=needs)
    if further is not None:
        further(device, faults)
    if further_of_measures is not None and own_measures is not None:
        further_of_measures(device, own_measures, faults)
    faults += absent
    if study is None or faults or file_faults:
        raise DeviceError([*in_order(faults, document, label), *file_faults])
    return study


def _device_instead(label: str, what: str) -> DeviceError:
    """The fault of a device that was given as a study."""
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
                    operators[name] = _operator(name, folder)
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


def _device(
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
            inner = with_operator(inner, _operator(operator, folder))
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


def _own_measures(document: dict[str, Any], folder: File, faults: TableFaults) -> dict[str, Measure] | None:
    """The measures of the file that the study names, by name; None where it has faults."""
    file = document.get("measures_file")
    if not isinstance(file, str) or not file:
        return {}
    try:
        return load_measures(str(folder / file))
    except ValueError as error:
        faults.append((("measures_file",), str(error)))
        return None  # a measure that is not known may be one of those


def _operator(name: str, folder: File) -> dict[str, Any] | None:
    """The [operator] table of a name or a file beside the study; None for nobody."""
    return None if name == NOBODY else operator_table(_resolve_name(name, folder, OPERATORS))


def _resolve_name(name: str, folder: File, shelf: BundledFiles = DEVICES) -> str:
    """A bundled name as it is, any other as a file beside the study."""
    return name if name in bundled_names(shelf) else str(folder / name)
