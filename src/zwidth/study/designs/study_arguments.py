"""From the arguments of a function to a `Study`: the same checks as of a study file, in the words of Python."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Final

from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, Fault, KeyPath
from zwidth.device.toml_access import is_number
from zwidth.measures.definition import Measure, as_argument
from zwidth.measures.wanted import WANTED_NUMBERS
from zwidth.model.argument_checks import require, wrong_type
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.designs.column import measure_list
from zwidth.study.designs.study import KEYS, Study, check_study
from zwidth.study.designs.study_file import axis_operators
from zwidth.study.workspace.plane_grid import PlaneGrid

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from zwidth.loop.posed_device import Position

LABEL: Final = "sweep"
VECTORS: Final = ("at", "direction")  # of which each value is a list
# Arguments that a study file calls otherwise.
RENAMED_ARGUMENTS: Final = ("position", *(one.name for one in WANTED_NUMBERS if one.name != one.key))
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
    """The study of a grid over axes of a device, or of paired axes; see `sweep` for the arguments.

    Raises  DeviceError  with all faults found
            TooLarge     where the designs would not fit into memory
            TypeError    for arguments of another kind
    """
    require("device", device, Device)
    if plane is not None:
        require("plane", plane, PlaneGrid, f"write plane_of(device, {plane!r})" if isinstance(plane, str) else "")
    names, measures_by_name = measures_of(measures, user_measures)
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
        "axis": [{"key": key, "values": values} for key, values in _axes(axes)],
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
        raise DeviceError([*(_fault(path, message, list(axes)) for path, message in faults), *operator_faults])
    return replace(study, at=position) if isinstance(position, Mapping) else study


def measures_of(
    measures: str | Measure | Sequence[str | Measure], user_measures: Mapping[str, Measure] | None
) -> tuple[list[str], dict[str, Measure]]:
    """The names of the measures, and the user's own `Measure`s by name, from both arguments."""
    listed = measure_list(measures)
    given = {one.name: one for one in listed if isinstance(one, Measure)}
    return [one.name if isinstance(one, Measure) else one for one in listed], {**(user_measures or {}), **given}


def _axes(axes: Any) -> Iterator[tuple[str, list[Any]]]:
    """Path and values of each axis, as Python numbers. Raises TypeError, ValueError."""
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


def _fault(path: KeyPath, message: str, keys: list[str]) -> Fault:
    """A fault of the document, under the name of the argument that it came from."""
    argument = ARGUMENTS.get(str(path[0]), str(path[0]))
    if path[0] != "axis" or len(path) < 3:
        return Fault(argument, "", message)
    key = keys[int(path[1])]
    if path[2] != "key":
        return Fault(argument, key, message)
    return Fault(
        argument, "", f"'{key}' as an axis is called '{KEYS[key]}'" if key in RENAMED_ARGUMENTS else message
    )
