"""A device's sampled response as a function of those of its numbers that are to be identified."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import dotted, fail, quote
from zwidth.loop.controller import Controller
from zwidth.loop.factor_response import factor_response
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import force_filter
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.operator import attach
from zwidth.model.plant import Plant

MATRICES: Final = {
    "mass_kg": ("mass", "kg"),
    "damping_Ns_per_m": ("damping", "N s/m"),
    "stiffness_N_per_m": ("stiffness", "N/m"),
}
HAND: Final = {
    "arm_mass_kg": ("mass of the arm", "kg"),
    "arm_stiffness_N_per_m": ("stiffness of the arm", "N/m"),
    "arm_damping_Ns_per_m": ("damping of the arm", "N s/m"),
    "grasp_stiffness_N_per_m": ("stiffness of the grasp", "N/m"),
    "grasp_damping_Ns_per_m": ("damping of the grasp", "N s/m"),
}
DELAYS: Final = ("loop.delay_samples", "loop.delay_s")
LAG: Final = "loop.actuator.time_constant_s"
NOTHING: Final = 1e-9  # share of a matrix's largest entry that is none
FIRST_RATIO: Final = 0.02  # damping ratio from which an unknown damper is looked for
SMALL: Final = 1e-6  # angle by which the lag of a filter is read [rad]


@dataclass(frozen=True)
class Quantity:
    """A number to be identified.

    name, unit  for people
    given       its value in the file
    start       from where it is looked for: the same, or some damping where the file has none
    positive    it varies by its logarithm, so that it stays above 0; others are 0 at least
    entries     (path, factor, offset) of each number in the file that it makes: factor * value + offset; a
                matrix's diagonal sums what several quantities add
    """

    name: str
    unit: str
    given: float
    start: float
    positive: bool
    entries: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True)
class SampledModel:
    """The response of a device's own loop, with hold, delay, lag and sampling, for values of some of its numbers.

    quantities  the numbers (p,)
    loop_of     values (p,) -> the loop
    hand        whether the numbers are those of the operator's hand
    """

    quantities: tuple[Quantity, ...]
    loop_of: Callable[[Floats], Loop]
    hand: bool = False

    @property
    def start(self) -> Floats:
        """Values (p,) from which the numbers are looked for, `Quantity.start`."""
        return np.array([one.start for one in self.quantities])

    def vector(self, values: Floats) -> Floats:
        """What an optimiser varies (p,): logarithms of what stays positive."""
        return np.array([np.log(v) if one.positive else v for one, v in zip(self.quantities, values, strict=True)])

    def values(self, vector: Floats) -> Floats:
        """Values (p,) of what an optimiser varies; infinite ends of intervals become 0 and infinity."""
        with np.errstate(over="ignore"):
            numbers = [np.exp(x) if one.positive else x for one, x in zip(self.quantities, vector, strict=True)]
        return np.asarray(np.maximum(np.array(numbers), 0.0))

    def response(self, vector: Floats, theta: Floats) -> Complexes:
        """P(exp(i theta)) (n,) [m/N] for what an optimiser varies; nan where there is no such device."""
        try:
            return sampled_response(self.loop_of(self.values(vector)), theta)
        except (ValueError, np.linalg.LinAlgError):
            return np.full(theta.shape, np.nan + 0j)


def sampled_response(loop: Loop, theta: Floats) -> Complexes:
    """P(exp(i theta)) (n,) of a loop at angles (n,) in (0, pi], with a loss factor too [m/N]."""
    if loop.plant.hysteresis is not None:
        from zwidth.chart.hysteretic_response import SampledResponse

        return SampledResponse.of(loop)(theta)
    half = np.sin(0.5 * theta)
    difference = 2j * half * np.exp(0.5j * theta)
    return loop.plant_response(1.0 + difference, difference)


def model_of(device: Device, point: OperatingPoint, paths: Sequence[str]) -> SampledModel:
    """The device's response as a function of the numbers at some paths, or of those that a measurement usually is
    made for: masses, springs, dampers and delay of a [plant]; stiffness of the drives, damping ratio and delay of
    a mechanism; the hand's five numbers where an operator holds the device, whose own numbers stay as they are.

    Raises DeviceError  for paths that lead nowhere, or to what is no number
    """
    if point.response is not None:
        raise fail(device.label, "", "is given by its [response], which has no masses or springs; give a [plant]")
    full = [dotted(address.resolve(device.document, path), device.document) for path in paths]
    if len(set(full)) < len(full):
        raise fail(device.label, next(p for p in full if full.count(p) > 1), "is named twice; name it once")
    if point.operator is not None and (not full or any(path.startswith("operator.") for path in full)):
        return _hand_model(device, point, full)
    if point.given_plant is not None and all(path.startswith(("plant.", "loop.")) for path in full):
        return _plant_model(device, point, full)
    return _file_model(device, point, full)


# --- delay, and what looks like it ------------------------------------------------------------------------------


def filter_lag(controller: Controller) -> float:
    """Delay of the force filter at low frequencies [s]."""
    low_pass = force_filter(controller)
    passed = factor_response(low_pass.numerator, low_pass.denominator, np.array([np.expm1(1j * SMALL)]))
    return float(-np.angle(passed[0])) / SMALL * controller.sampling_period


def _delay_quantities(device: Device, controller: Controller, full: Sequence[str]) -> list[Quantity]:
    """The delays to identify: the sum of delay, actuator's and filter's lag, and the actuator's lag by itself.

    full  paths that are named: the sum with a path of the delay or with (), the lag with its own path only
    """
    T, lag, lag_of_filter = controller.sampling_period, controller.actuator_time_constant, filter_lag(controller)
    path = DELAYS[1] if device.document.get("loop", {}).get("delay_s") is not None else DELAYS[0]
    unit = T if path == DELAYS[0] else 1.0
    found = list[Quantity]()
    if not full or any(one in DELAYS for one in full):
        total = controller.delay * T + lag + lag_of_filter
        entry = (path, 1.0 / unit, -(lag + lag_of_filter) / unit)  # the file's delay is the sum less both lags
        found.append(
            Quantity("sum of delay, current loop and filter", "s", float(total), float(total), False, (entry,))
        )
    if LAG in full:
        # above 0, as it varies by its logarithm
        first = max(float(lag), 0.05 * T)
        found.append(Quantity("time constant of the actuator", "s", float(lag), first, True, ((LAG, 1.0, 0.0),)))
    return found


def _with_delays(controller: Controller, quantities: Sequence[Quantity], values: Floats) -> Controller:
    """The controller with other delays, quantities of `_delay_quantities` and their values (d,) [s]: from the sum
    the actuator's and the filter's lag are taken off."""
    given = {one.entries[0][0]: float(v) for one, v in zip(quantities, values, strict=True)}
    lag = given.get(LAG, controller.actuator_time_constant)
    total = next((given[path] for path in DELAYS if path in given), None)
    if total is None:
        return replace(controller, actuator_time_constant=lag)
    delay = max(total - lag - filter_lag(controller), 0.0)
    return replace(controller, actuator_time_constant=lag, delay=delay / controller.sampling_period)


# --- plants given by matrices -----------------------------------------------------------------------------------


def _plant_model(device: Device, point: OperatingPoint, full: Sequence[str]) -> SampledModel:
    """The model of a plant given by matrices, in those of its masses, springs, dampers, loss factor and delays
    that the paths `full` name; (): in all of them. Raises DeviceError for another path."""
    plant, controller = point.ungripped_plant, point.loop.controller
    timing = _delay_quantities(device, controller, full)
    shapes = list[tuple[str, Any]]()  # what each quantity does to the plant
    quantities = list[Quantity]()
    for key, (name, unit) in MATRICES.items():
        for element, shape, entries, value in _elements(device, plant, key, full):
            start = value if value > 0.0 else _first_damping(plant, shape)
            quantities.append(Quantity(f"{name} {element}".strip(), unit, value, start, True, entries))
            shapes.append((name, shape))
    eta = device.document.get("plant", {}).get("loss_factor")
    if eta and (not full or "plant.loss_factor" in full):
        quantities.append(Quantity("loss factor", "", eta, eta, True, (("plant.loss_factor", 1.0, 0.0),)))
        shapes.append(("loss factor", None))
    unknown = [p for p in full if p not in _covered_paths([*quantities, *timing])]
    if unknown:
        raise fail(device.label, unknown[0], "is not a mass, spring, damper, loss factor or delay of the device")
    fixed = _fixed_matrices(plant, quantities, shapes)
    count = len(quantities)

    def loop_of(values: Floats) -> Loop:
        """The loop with values (p,) of the plant's numbers, then of its delays."""
        matrices = {name: matrix.copy() for name, matrix in fixed.items()}
        loss = eta or 0.0
        for (name, shape), value in zip(shapes, values[:count], strict=True):
            if shape is None:
                loss = float(value)
            else:
                matrices[name] += value * shape
        hysteresis = loss * matrices["stiffness"] if eta else None
        changed = replace(plant, **matrices, hysteresis=hysteresis)
        held = point.attach_operator(changed) if point.operator is not None else changed
        return Loop(held, _with_delays(controller, timing, values[count:]))

    return SampledModel((*quantities, *timing), loop_of)


def _covered_paths(quantities: Sequence[Quantity]) -> set[str]:
    """Paths of the numbers that the quantities make, `DELAYS` always among them."""
    return {path for one in quantities for path, _, _ in one.entries} | set(DELAYS)


def _fixed_matrices(
    plant: Plant, quantities: Sequence[Quantity], shapes: Sequence[tuple[str, Any]]
) -> dict[str, Any]:
    """The plant's matrices less what the quantities add to them at their values in the file; rounding set to 0.

    shapes  of each quantity: name of the matrix, and what one unit of it is there (n, n), None for a loss factor
    """
    fixed = {name: getattr(plant, name).copy() for name, _ in MATRICES.values()}
    for one, (name, shape) in zip(quantities, shapes, strict=True):
        if shape is not None:
            fixed[name] -= one.given * shape
    for name, matrix in fixed.items():
        matrix[np.abs(matrix) <= NOTHING * max(float(np.abs(getattr(plant, name)).max()), 1e-300)] = 0.0
    return fixed


def _elements(
    device: Device, plant: Plant, key: str, full: Sequence[str]
) -> list[tuple[str, Floats, tuple[tuple[str, float, float], ...], float]]:
    """The masses, springs or dampers of which a matrix consists: name, what one unit of it is in the matrix
    (n, n), the numbers of the file that it makes (`Quantity.entries`), and its value.

    key   of the matrix in the file;   full  paths that are named, of which others are left out; (): none is

    A spring or damper between two coordinates is four entries of the matrix, which go together, a coupled mass two
    of one sign. What is 0 in the file is not there, but for a damper beside each spring between
    coordinates, and that of a single coordinate, both without a loss factor: to say that there is none is a
    measurement, too. Raises DeviceError where a spring or damper is negative.
    """
    name, _ = MATRICES[key]
    matrix, n = getattr(plant, name), plant.size
    path = f"plant.{key}"
    wanted = [one for one in full if one == path or one.startswith(path + ".")]
    if full and not wanted:
        return []
    given = device.document.get("plant", {}).get(key)
    lossy = plant.hysteresis is not None
    # entries that there may be: of a damper beside each spring
    pattern = np.abs(plant.stiffness) if name == "damping" and not lossy else np.abs(matrix)
    least = NOTHING * max(float(np.abs(matrix).max()), 1e-300)

    def entry(i: int, j: int, factor: float) -> tuple[tuple[str, float, float], ...]:
        """`Quantity.entries` of the matrix's entry i, j; () where the file does not write the matrix."""
        if given is None:
            return ()
        return ((path if not isinstance(given, list) else f"{path}.{i}.{j}", factor, 0.0),)

    found = list[tuple[str, Floats, tuple[tuple[str, float, float], ...], float]]()
    for i in range(n):
        for j in range(i + 1, n):
            coupled = abs(matrix[i, j]) > least or (
                pattern[i, j] > NOTHING * max(pattern.max(), 1e-300) and name == "damping"
            )
            if not coupled:
                continue
            shape = np.zeros((n, n))
            if name == "mass":
                shape[i, j] = shape[j, i] = np.sign(matrix[i, j])
                entries = entry(i, j, shape[i, j]) + entry(j, i, shape[i, j])
                value = abs(float(matrix[i, j]))
            else:
                shape[[i, j], [i, j]], shape[i, j], shape[j, i] = 1.0, -1.0, -1.0
                entries = entry(i, j, -1.0) + entry(j, i, -1.0) + entry(i, i, 1.0) + entry(j, j, 1.0)
                value = -float(matrix[i, j])
            found.append((f"between coordinates {i} and {j}", shape, entries, value))
        ground = float(matrix[i, i]) if name == "mass" else float(matrix[i].sum())
        alone = name == "damping" and n == 1 and not lossy
        # ten times: a sum over a row of the matrix is rounded more
        if abs(ground) > least * 10.0 or alone:
            shape = np.zeros((n, n))
            shape[i, i] = 1.0
            what = f"of coordinate {i}" if name == "mass" else f"of coordinate {i} to the ground"
            found.append((what if n > 1 else "", shape, entry(i, i, 1.0), ground))
    if full and path not in wanted:
        found = [one for one in found if any(own in wanted for own, _, _ in one[2])]
    if any(value < 0.0 for *_, value in found):
        raise fail(device.label, path, "holds a negative spring or damper, which cannot be identified here")
    return found


def _first_damping(plant: Plant, shape: Floats) -> float:
    """A damper to start from [N s/m]: 2 % of critical damping of the masses and springs at its coordinates, as
    if they vibrated at 1 rad/s at least.

    shape  (n, n) what one unit of it is in the damping matrix
    """
    at = np.diag(shape) > 0.0
    mass, stiffness = np.diag(plant.mass)[at].min(), np.abs(np.diag(plant.stiffness)[at]).max()
    return float(2.0 * FIRST_RATIO * np.sqrt(mass * max(stiffness, mass)))


# --- the hand ---------------------------------------------------------------------------------------------------


def _hand_model(device: Device, point: OperatingPoint, full: Sequence[str]) -> SampledModel:
    """The model of a held device, in those of the hand's five numbers that the paths `full` name; (): in all.
    Raises DeviceError for another path, and for a hand that is a chain of bodies."""
    operator = point.operator
    assert operator is not None
    if point.arm is not None:
        raise fail(device.label, "operator", "is a chain of bodies; give five numbers to have them identified")
    if other := [path for path in full if not path.startswith("operator.")]:
        raise fail(device.label, other[0], "is identified without a hand; measure the device by itself first")
    bare, controller = point.ungripped_plant, point.loop.controller
    keys = [key for key in HAND if not (operator.rigid_grasp and key.startswith("grasp_"))]
    if full:
        keys = [key for key in keys if f"operator.{key}" in full]
    quantities = []
    for key in keys:
        name, unit = HAND[key]
        value = float(getattr(operator, _attribute(key)) or 0.0)
        # 1 where the file has 0: it varies by its logarithm
        quantities.append(Quantity(name, unit, value, value or 1.0, True, ((f"operator.{key}", 1.0, 0.0),)))

    def loop_of(values: Floats) -> Loop:
        """The loop held by a hand with these values (p,)."""
        changed: dict[str, Any] = {_attribute(key): float(value) for key, value in zip(keys, values, strict=True)}
        return Loop(attach(bare, replace(operator, **changed)), controller)

    return SampledModel(tuple(quantities), loop_of, hand=True)


def _attribute(key: str) -> str:
    """The field of `Operator` that a key of the file sets: arm_mass of arm_mass_kg."""
    return "_".join(key.split("_")[:2])


def without_hand(point: OperatingPoint) -> Loop:
    """The loop of the device by itself."""
    return Loop(point.ungripped_plant, point.loop.controller)


# --- everything else, through the file --------------------------------------------------------------------------


def _file_model(device: Device, point: OperatingPoint, full: Sequence[str]) -> SampledModel:
    """The model of any device, in the numbers of its file at the paths `full`, or in `_usual_paths` ones where
    none is named; the file is read anew for each choice of values. Raises DeviceError for what is no number."""
    controller = point.loop.controller
    timing = _delay_quantities(device, controller, full)
    chosen = [path for path in full if path not in DELAYS and path != LAG] or _usual_paths(device) * (not full)
    quantities = list[Quantity]()
    for path in chosen:
        value = address.get(device.document, path)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise fail(device.label, path, f"must be a number to be identified, got {quote(value)}")
        name, unit = path.rpartition(".")[2], _unit_of(path)
        positive = value > 0.0
        quantities.append(Quantity(name, unit, float(value), float(value), positive, ((path, 1.0, 0.0),)))
    if not quantities and not timing:
        raise fail(device.label, "", "has no springs or dampers in its drives to identify; name numbers by paths")
    count = len(quantities)

    def loop_of(values: Floats) -> Loop:
        """The loop of the device with values (p,) of the file's numbers, then of the delays."""
        settings = {one.entries[0][0]: float(v) for one, v in zip(quantities, values[:count], strict=False)}
        changed = device.with_(settings) if settings else device
        loop = changed.at_point(point).loop
        return Loop(loop.plant, _with_delays(loop.controller, timing, values[count:]))

    return SampledModel((*quantities, *timing), loop_of)


def _usual_paths(device: Device) -> list[str]:
    """Paths of what is identified of a mechanism where none is named: stiffness of the drives, damping ratio."""
    mechanism = device.document.get("mechanism", {})
    found = list[str]()
    for index, drive in enumerate(mechanism.get("drives", [])):
        for key in ("stiffness_Nm_per_rad", "stiffness_N_per_m"):
            if isinstance(drive.get(key), int | float):
                found.append(dotted(("mechanism", "drives", index, key), device.document))
    if isinstance(mechanism.get("damping", {}).get("mode_ratio"), int | float):
        found.append("mechanism.damping.mode_ratio")
    return found


def _unit_of(path: str) -> str:
    """The unit of a number in words, from its key: N m/rad of stiffness_Nm_per_rad."""
    units = {"Nms_per_rad": "N m s/rad", "Nm_per_rad": "N m/rad", "N_per_m": "N/m", "Ns_per_m": "N s/m"}
    units |= {"kg_m2": "kg m^2", "kg": "kg", "Nm": "N m", "m": "m", "s": "s", "rad": "rad", "N": "N"}
    key = next((part for part in reversed(path.split(".")) if not part.isdigit()), path)
    for ending, unit in units.items():
        if key.endswith("_" + ending):
            return unit
    return ""
