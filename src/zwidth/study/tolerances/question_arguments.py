"""From the arguments of `tolerance` to a `ToleranceQuestion`: the same checks as of a study file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, Fault, KeyPath
from zwidth.measures.definition import Measure, as_argument
from zwidth.model.argument_checks import require, wrong_type
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.designs.study import check_study
from zwidth.study.designs.study_arguments import measures_of, plain_value
from zwidth.study.tolerances.question import ToleranceQuestion, draw_faults, question_with, wall_faults
from zwidth.study.tolerances.tolerance_tables import tolerances_of

LABEL: Final = "tolerance"
ARGUMENTS: Final = {
    "at": "position",
    "stiffness_N_per_m": "stiffness",
    "damping_Ns_per_m": "damping",
    "frequency_Hz": "frequency",
    "tolerance": "tolerances",
}


def question_over(
    device: Device,
    tolerances: Mapping[str, Mapping[str, Any]],
    measures: str | Measure | Sequence[str | Measure],
    user_measures: Mapping[str, Measure] | None,
    circumstances: Mapping[str, Any],
    draw: Mapping[str, Any],
) -> ToleranceQuestion:
    """The question of the arguments of `tolerance`.

    circumstances, draw  values by key of a study file and of its [draw]; None where they are not given
    Raises  DeviceError  with all faults found
            TooLarge     where the devices would not fit into memory
            TypeError    for arguments of another kind
    """
    require("device", device, Device)
    names, by_name = measures_of(measures, user_measures)
    angles = circumstances.get("at") if isinstance(circumstances.get("at"), Mapping) else None
    given = {
        key: plain_value(value)
        for key, value in circumstances.items()
        if value is not None and value is not angles
    }
    drawn = {key: plain_value(value) for key, value in draw.items() if value is not None}
    document: dict[str, Any] = {
        "device": device.label,
        **({"measures": names} if names else {}),
        "tolerance": _tables(tolerances),
        **given,
        **({"draw": drawn} if drawn else {}),
    }
    faults: TableFaults = []
    study = check_study(document, LABEL, device, {}, by_name, faults, spelling=as_argument, needs=("tolerance",))
    found = tolerances_of(document, device, faults)
    faults += wall_faults(document, ARGUMENTS) + draw_faults(drawn)
    if angles is not None:
        try:
            device.position(angles)
        except DeviceError as error:
            faults.append((("at",), error.faults[0].message))
    if faults or study is None:
        raise DeviceError([_fault(path, message, list(tolerances)) for path, message in faults])
    return question_with(study if angles is None else replace(study, at=angles), found, drawn)


def _tables(tolerances: Any) -> list[dict[str, Any]]:
    """The [[tolerance]] tables of the argument. Raises TypeError, ValueError."""
    if not isinstance(tolerances, Mapping):
        raise wrong_type("tolerances", "a dictionary of paths and distributions", tolerances)
    if not tolerances:
        raise ValueError(
            "tolerances has no path; write such as {'loop.delay_samples': {'distribution': 'uniform', 'low': 0.3, "
            "'high': 0.6}}"
        )
    for key, table in tolerances.items():
        if not isinstance(key, str):
            raise wrong_type("tolerances", "a dictionary whose keys are paths", key)
        if not isinstance(table, Mapping):
            raise wrong_type(f"tolerances[{key!r}]", "a dictionary such as {'distribution': 'normal', ...}", table)
    return [
        {"key": key, **{name: plain_value(value) for name, value in table.items()}}
        for key, table in tolerances.items()
    ]


def _fault(path: KeyPath, message: str, keys: list[str]) -> Fault:
    """A fault of the document, under the name of the argument that it came from."""
    first, *rest = path
    if first == "draw" and rest:
        first, *rest = rest
    if first == "tolerance" and rest and isinstance(rest[0], int):
        rest = [keys[rest[0]], *rest[1:]] if rest[1:] != ["key"] else []  # the message names the key
    argument = ARGUMENTS.get(str(first), str(first))
    return Fault(argument, ".".join(map(str, rest)), message)
