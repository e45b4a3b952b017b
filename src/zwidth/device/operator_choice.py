"""Who holds the device: the [operator] of its file, one of the bundled operators, one from a file, or nobody.

Under what load a device is: the [load] of its file, or another.
"""

from __future__ import annotations

import os
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError

from zwidth.device.faults import Fault, dotted, fail
from zwidth.device.read import OPERATORS, read
from zwidth.device.rules.plant import operator_faults
from zwidth.device.schema.device_file import DEVICE_KEYS
from zwidth.device.schema.operator import OperatorSection
from zwidth.device.schema.value_types import VERSION, Section, WholeNumber
from zwidth.device.text_file import KEY, without_version
from zwidth.device.validation_messages import validation_messages
from zwidth.errors import DeviceError, LoadError
from zwidth.model.load import Load
from zwidth.model.operator import Operator

NOBODY: Final = "none"


class OperatorFile(Section):
    """A file with nothing but an operator."""

    file_version: WholeNumber = VERSION
    operator: OperatorSection


def document_held_by(
    document: dict[str, Any], operator: Operator | str | os.PathLike[str] | None
) -> dict[str, Any]:
    """The device's document with another operator.

    operator  an Operator; a bundled operator's name, a file with an [operator], "none" for nobody; None: as the
              document says
    Raises DeviceError  with all faults of the operator's file
    """
    if operator is None:
        return document
    if isinstance(operator, Operator):
        return with_operator(document, table_of_operator(operator))
    if operator == NOBODY:
        return with_operator(document, None)
    arm = _arm_of(operator)
    return (
        with_operator(document, operator_table(operator)) if arm is None else with_operator(document, None) | arm
    )


def _arm_of(name_or_path: str | os.PathLike[str]) -> dict[str, Any] | None:
    """The [arm] of a file that has one, to be checked with the device; None of any other."""
    whole, label = read(name_or_path, OPERATORS)
    if not isinstance(whole.get("arm"), dict):
        return None
    return {"arm": {"name": label, **whole["arm"]}}


def with_operator(document: dict[str, Any], table: dict[str, Any] | None) -> dict[str, Any]:
    """A device's document with this [operator]; None: with nobody."""
    without = {key: value for key, value in document.items() if key not in ("operator", "arm")}
    return without if table is None else without | {"operator": table}


def table_of_operator(operator: Operator) -> dict[str, Any]:
    """An operator as the [operator] of a device file."""
    table: dict[str, Any] = {
        "arm_mass_kg": operator.arm_mass,
        "arm_stiffness_N_per_m": operator.arm_stiffness,
        "arm_damping_Ns_per_m": operator.arm_damping,
    } | ({} if operator.directions == "rendered" else {"directions": operator.directions})
    if operator.grasp_stiffness is None:
        return table | {"grasp": "rigid"}
    return table | {
        "grasp_stiffness_N_per_m": operator.grasp_stiffness,
        "grasp_damping_Ns_per_m": operator.grasp_damping or 0.0,
    }


def operator_table(name_or_path: str | os.PathLike[str]) -> dict[str, Any]:
    """The [operator] table of a bundled operator or a file, checked; its keys may also stand bare in the file.

    A device file with an [operator] serves, too. An operator without a name is called as his file is.
    Raises DeviceError  with all faults
    """
    whole, label = read(name_or_path, OPERATORS)
    version, document = {KEY: whole[KEY]} if KEY in whole else {}, without_version(whole)
    others = sorted(document.keys() - {"operator"})
    if "operator" not in document:
        if DEVICE_KEYS & document.keys():
            raise fail(label, "operator", "is missing; this device file has no operator; add an [operator] table")
        document = {"operator": document}
    elif others and "loop" not in document:
        raise DeviceError(
            Fault(label, key, "is no part of an operator; put it into [operator] or remove it") for key in others
        )
    table = document["operator"]
    document = {"operator": table} | version
    faults = list(operator_faults(document))
    try:
        OperatorFile.model_validate(document)
    except ValidationError as error:
        faults += validation_messages(error, document)
    if faults:
        raise DeviceError(Fault(label, dotted(path), message) for path, message in faults)
    return {"name": label, **table}


Tables = dict[str, Any]


def document_under(
    document: Tables, load: Load | ArrayLike | None, gravity: ArrayLike | None, moment: bool, label: str
) -> Tables:
    """The device's document with another [load].

    load     a `Load`; the hand's force (2,) or (3,), or about an axis its moment, in place of that of the
             document; None: as the document says
    gravity  (2,) or (3,) in place of the document's; None: as the document says
    Raises   DeviceError  for what is no load
    """
    if isinstance(load, Load):
        try:
            whole = load if gravity is None else load.with_gravity(gravity)
        except LoadError as error:
            raise fail(label, "load", str(error)) from None
        return {**document, "load": table_of_load(whole)}
    changes: Tables = {}
    try:
        if load is not None:
            own = Load(moment=cast(Any, load)) if moment else Load(force=cast(Any, load))
            changes |= table_of_load(own)
        if gravity is not None:
            changes |= table_of_load(Load(gravity=cast(Any, gravity)))
    except LoadError as error:
        raise fail(label, "load", str(error)) from None
    if not changes:
        return document
    kept = dict(document.get("load", {}))
    if load is not None:
        for key in ("force_N", "push_N", "moment_Nm"):
            kept.pop(key, None)
    return {**document, "load": kept | changes}


NAMES: Final = {
    "force_N": "force",
    "moment_Nm": "moment",
    "push_N": "push",
    "gravity_m_per_s2": "gravity",
    "hand": "hand",
    "posture_of": "posture_of",
    "settle": "settle",
    "surface_radius_m": "surface_radius",
    "count_sideways": "count_sideways",
    "spring_branch": "branch",
}
"""Keys of [load], and the fields of `Load` that they fill."""


def load_of_table(table: Tables) -> Load:
    """A [load] as `Load`. Raises LoadError."""
    return Load(**{NAMES[key]: value for key, value in table.items()})


def table_of_load(load: Load) -> Tables:
    """A load as the [load] of a device file, without what is as by default."""
    plain, table = Load(), Tables()
    for key, name in NAMES.items():
        value = getattr(load, name)
        if isinstance(value, np.ndarray):
            table[key] = value.tolist()
        elif value != getattr(plain, name):
            table[key] = value
    return table
