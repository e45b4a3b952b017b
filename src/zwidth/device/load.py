"""From a device file to a `Device`, or to the list of everything that is wrong with it.

Who holds the device: the [operator] of its file, one of the bundled operators, one from a file, or nobody.

Under what load a device is: the [load] of its file, or another.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError

from zwidth.arrays import Floats
from zwidth.device import address, build
from zwidth.device.address import members
from zwidth.device.build import screws
from zwidth.device.device import Device
from zwidth.device.faults import Fault, KeyPath, dotted, fail
from zwidth.device.plausibility import warn_of_implausible
from zwidth.device.read import KEY, OPERATORS, bundled, check_not_newer, read, without_version
from zwidth.device.rules.plant import operator_faults
from zwidth.device.rules.table import device_faults, without_unsupported
from zwidth.device.schema.device_file import DEVICE_KEYS, STUDY_KEYS, DeviceFile, schema
from zwidth.device.schema.mechanism import MechanismSection, ReferenceSection
from zwidth.device.schema.operator import ArmSection, OperatorSection
from zwidth.device.schema.value_types import VERSION, Section, WholeNumber
from zwidth.device.validation_messages import validation_messages
from zwidth.errors import BeamError, DeviceError, LoadError
from zwidth.model.argument_checks import wrong_type
from zwidth.model.load import Load
from zwidth.model.mechanism import Mechanism
from zwidth.model.operator import Operator
from zwidth.model.response import handle_obstacle

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.model.arm import Arm

NOBODY: Final = "none"


class OperatorFile(Section):
    """A file with nothing but an operator."""

    file_version: WholeNumber = VERSION
    operator: OperatorSection


def document_held_by(
    document: dict[str, Any], operator: Operator | str | os.PathLike[str] | None
) -> dict[str, Any]:
    """The device's document with another operator.

    operator  an Operator; a bundled operator's name, a file with an [operator] or [arm], "none" for nobody; None:
              as the document says
    Raises DeviceError  with all faults of the operator's file
    """
    if operator is None:
        return document
    if isinstance(operator, Operator):
        return with_operator(document, table_of_operator(operator))
    if operator == NOBODY:
        return with_operator(document, None)
    arm = _arm_table_of(operator)
    return (
        with_operator(document, operator_table(operator)) if arm is None else with_operator(document, None) | arm
    )


def _arm_table_of(name_or_path: str | os.PathLike[str]) -> dict[str, Any] | None:
    """What a file with an [arm] adds to a device's document, {"arm": table}, to be checked with the device; None
    of any other file."""
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
    moment   whether numbers are a moment [N m]; else they are a force [N]
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


UNNAMED_OPERATOR: Final = "as given"  # an operator without a name

Settings: TypeAlias = Mapping[str, Any] | Sequence[str | tuple[str, Any]]

__all__ = ["bundled", "from_document", "load", "schema"]


def load(
    name_or_path: str | os.PathLike[str],
    settings: Settings = (),
    operator: str | os.PathLike[str] | None = None,
) -> Device:
    """The device of a bundled name or a file, with settings applied before it is checked.

        load("my-device.toml", {"loop.delay_samples": 1, "links.upper.length_m": 0.15}, operator="firm-grasp")

    settings  path -> value; or "PATH=VALUE" texts and (path, value) pairs, see `address.apply`
    operator  who holds the handle: a bundled operator's name, a file with an [operator], or "none"; left out: as
              the device file says
    Warns  ImplausibleNumber  of each number that is allowed and looks wrong
    Raises DeviceError  with all the faults of the file, or else of the settings
           TypeError    for a name or settings of another kind
    """
    if not isinstance(name_or_path, str | os.PathLike):
        raise wrong_type("name_or_path", "a bundled name or a path", name_or_path)
    changes = _settings_list(settings)
    document, label = read(name_or_path, pipes=True)
    device = from_document(address.apply(document_held_by(document, operator), changes), label)
    warn_of_implausible(device)
    return device


def device_with_settings(device: Device, settings: Settings) -> Device:
    """The device with settings applied, checked again; see `Device.with_`.

    Whether the mechanism can be assembled is checked again only where one of its numbers has changed; compiled
    code is asked first.
    """
    document = address.apply(device.document, _settings_list(settings))
    same = document.get("mechanism") == device.document.get("mechanism")
    made = from_document(document, device.label, skip_assembly_check=same, compiled=True)
    warn_of_implausible(made)
    return made


def device_held_by(device: Device, operator: Operator | str | os.PathLike[str]) -> Device:
    """The device with another operator at its handle; see `Device.held_by`."""
    return from_document(document_held_by(device.document, operator), device.label, skip_assembly_check=True)


def device_under(device: Device, load: Load | ArrayLike | None, gravity: ArrayLike | None, moment: bool) -> Device:
    """The device under another load; see `Device.under`. moment: whether numbers are a moment [N m]; else a force
    [N]."""
    document = document_under(device.document, load, gravity, moment, device.label)
    return (
        device if document is device.document else from_document(document, device.label, skip_assembly_check=True)
    )


def device_without_load(device: Device) -> Device:
    """The device with nothing that pushes."""
    if device.load is None:
        return device
    document = {key: value for key, value in device.document.items() if key != "load"}
    return from_document(document, device.label, skip_assembly_check=True)


def device_of_point(device: Device, point: OperatingPoint) -> Device:
    """The device in the hands and under the load of one of its operating points, which may be others than its
    file's. Raises what `Device.held_by` and `Device.under` raise."""
    if point.operator is not device.operator and point.arm is device.arm:
        device = device_held_by(device, point.operator or NOBODY)
    if point.load == device.load:
        return device
    return device_without_load(device) if point.load is None else device_under(device, point.load, None, False)


def _settings_list(settings: Settings) -> Sequence[str | tuple[str, Any]]:
    """Settings as a sequence. Raises TypeError for a single text."""
    if isinstance(settings, str):
        raise wrong_type("settings", "a list or a dictionary", settings, f"write [{settings!r}]")
    return list(settings.items()) if isinstance(settings, Mapping) else settings


def from_document(
    document: dict[str, Any], label: str = "device", *, skip_assembly_check: bool = False, compiled: bool = False
) -> Device:
    """The device that a document describes; `label` is what messages call it.

    Single keys and what they say about each other are checked together; whether the mechanism can be put
    together is checked once all of that is right, which takes most of the time.

    skip_assembly_check  True: it is known that it can, since it is a device already checked with numbers little
                         changed
    compiled             True: ask compiled code first, which takes a tenth of the time and half a second to load
    Raises DeviceError  with all faults found
    """
    checked, document = check(document, label)
    device = build_device(checked, document, label)
    if device.mechanism is not None and checked.mechanism is not None and not skip_assembly_check:
        assembled = compiled and _assembled(device)
        from zwidth.device.mechanism_check import mechanism_faults

        faults = list(mechanism_faults(device.mechanism, checked.mechanism, assembled=assembled))
        if faults:
            raise DeviceError(in_order(faults, document, label))
    return device


def check(document: dict[str, Any], label: str) -> tuple[DeviceFile, dict[str, Any]]:
    """The checked sections of a document, and the document without its format's version; whether its mechanism can
    be put together is not looked at. Raises DeviceError with all faults found.
    """
    if not isinstance(document, dict):
        hint = f"write load({document!r})" if isinstance(document, str) else ""
        raise wrong_type("document", "a dictionary", document, hint)
    check_not_newer(document, label)
    if STUDY_KEYS & document.keys() and not DEVICE_KEYS & document.keys():
        named = f", {document['device']}" if isinstance(document.get("device"), str) else ""
        command = "tolerance" if "tolerance" in document and "axis" not in document else "sweep"
        raise fail(
            label, "", f"is a study file; use zwidth {command} {label}, or give the device that it names{named}"
        )
    cleaned, faults = without_unsupported(document)
    checked: DeviceFile | None = None
    try:
        checked = DeviceFile.model_validate(cleaned)
    except ValidationError as error:
        faults += validation_messages(error, cleaned)
    faults += device_faults(cleaned)
    if faults or checked is None:
        raise DeviceError(in_order(faults, document, label))
    return checked, without_version(document)


def _assembled(device: Device) -> bool:
    """Whether a device's mechanism is known to close at its reference, with a mass for every motion; False may
    also mean that it closes elsewhere."""
    from zwidth.device.mechanism_check import assembles

    assert device.mechanism is not None
    return assembles(device.mechanism, device.reference_assembly)


def build_device(
    checked: DeviceFile, document: dict[str, Any], label: str, surplus: tuple[int, ...] | None = None
) -> Device:
    """The device of checked sections; their numbers may be arrays over designs (`design_batch`).

    checked, document  as `check` returns them;   label  what messages call the device
    surplus  its drives beyond the mechanism's freedom; None: to be found, of one design
    Raises   DeviceError  for a response that cannot be read or that no operator can hold, and a faulty beam
    """
    section, controller = checked.mechanism, build.controller(checked.loop)
    mechanism = _mechanism(section, document, label, surplus) if section else None
    reference, held = section.reference if section else None, checked.operator or checked.arm
    response = build.response(checked.response, label, controller.sampling_period) if checked.response else None
    if response is not None and checked.operator and (obstacle := handle_obstacle(response)):
        raise fail(label, "operator", f"cannot be attached to this [response]: it {obstacle}, or leave him out")
    return Device(
        name=checked.name,
        description=checked.description,
        source=checked.source,
        sources=dict(checked.sources),
        label=label,
        mechanism=mechanism,
        given_plant=build.plant(checked.plant, checked.friction, checked.loop.encoder) if checked.plant else None,
        response=response,
        controller=controller,
        damping=build.damping(section.damping if section else None),
        reference_position=None if mechanism is None else mechanism.reference_position,
        reference_direction=_reference_direction(reference) if reference else None,
        reference_assembly=(reference.assembly or next(iter(section.assemblies)))
        if reference and section
        else None,
        operator=build.operator(checked.operator) if checked.operator else None,
        operator_name=(held.name or UNNAMED_OPERATOR) if held else None,
        arm=_arm(checked.arm) if checked.arm else None,
        load=load_of_table(checked.load.model_dump(exclude_none=True)) if checked.load else None,
        encoders="motor" if checked.loop.encoder.at in (None, "motor") else "link",
        document=document,
    )


def _reference_direction(reference: ReferenceSection) -> Floats:
    """The rendered direction of a reference: a vector (3,) of any length, or a screw (6,)."""
    if reference.axis is None:
        return np.array(build.in_space(reference.direction or ()), dtype=np.float64)
    direction = None if reference.direction is None else np.array(build.in_space(reference.direction))
    return screws("", direction, reference.axis, reference.characteristic_length_m)


def _arm(section: ArmSection) -> Arm:
    """The operator's arm of an [arm]."""
    from zwidth.device.build_mechanism import arm  # compiled code, as of a mechanism

    return arm(section)


def _mechanism(
    section: MechanismSection, document: dict[str, Any], label: str, surplus: tuple[int, ...] | None
) -> Mechanism:
    """The mechanism of a checked section. Raises DeviceError for a beam that cannot be built.

    surplus  its drives beyond the mechanism's freedom; None: to be found
    """
    from zwidth.device.build_mechanism import mechanism  # compiled code, which a plant does without
    from zwidth.device.mechanism_check import surplus_drives

    try:
        made = mechanism(section)
    except BeamError as error:
        place = next(each.path for each in members(section, "links") if each.entry.name == error.link)
        path = dotted(("mechanism", *place, *error.key.split(".")), document)
        raise fail(label, path, str(error)) from None
    beyond = surplus_drives(made) if surplus is None else surplus
    return replace(made, drives=replace(made.drives, surplus=beyond)) if beyond else made


def in_order(faults: Iterable[tuple[KeyPath, str]], document: dict[str, Any], label: str) -> list[Fault]:
    """The faults in the order of the file's keys; of several about one key, each is kept."""
    order = {path: place for place, path in enumerate(_paths(document))}
    ranked = sorted(faults, key=lambda item: _place_in_file(item[0], order))
    return [Fault(label, dotted(path, document), message) for path, message in ranked]


def _place_in_file(path: KeyPath, order: dict[KeyPath, int]) -> int:
    """Place of a path in the file, or of the table that it is missing from; -1 for the whole file.

    order  path -> place, of every key of the file
    """
    while path and path not in order:
        path = path[:-1]
    return order.get(path, -1)


def _paths(value: Any, path: KeyPath = ()) -> Iterable[KeyPath]:
    """Path of every key and list element of a document, in its order, outer ones first."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield (*path, key)
        yield from _paths(inner, (*path, key))
