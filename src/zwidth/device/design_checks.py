"""Which of many designs are certain to be valid: what the checks of one file say, for arrays of numbers.

Only the numbers that differ are looked at, of a device that is valid with the numbers of one of its designs. A
design that is not certain to be valid is checked alone, which says what is wrong with it, if anything is; so these
rules may be stricter than those of a file, never more lenient. Each looks at a design's own numbers alone.

Check in compiled code whether a checked device can still be assembled with other numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from zwidth.arrays import Flags, Floats
from zwidth.device.address import deep_copy, table, tables
from zwidth.device.faults import KeyPath
from zwidth.device.legs import written
from zwidth.device.loop_consistency import lags_wrongly, reaches_nyquist
from zwidth.device.schema import magnitudes
from zwidth.device.schema.device_file import DeviceFile
from zwidth.device.schema.loop import LONGEST_DELAY
from zwidth.device.schema.value_types import LARGEST, SYMMETRY_TOLERANCE
from zwidth.device.validation_messages import without_unsupported
from zwidth.loop.estimator import quantisation_noise
from zwidth.loop.estimators.kalman import INDEX
from zwidth.model.design_axes import join_designs
from zwidth.model.mechanism import Mechanism
from zwidth.model.posture import OK, Posture, solve_posture

Values = dict[KeyPath, Floats]

_LOW_PASSES: Final = (
    *((path, "filter") for path in ("velocity", "force", "force_sensor")),
    ("feedforward", "acceleration_filter"),
    *((path, "velocity", "filter") for path in ("feedforward", "local")),
)
PLANT_MATRICES: Final = ("mass_kg", "damping_Ns_per_m", "stiffness_N_per_m")
PLANT_VECTORS: Final = ("actuator", "sensor", "handle")


def certainly_valid(document: dict[str, Any], values: Values, count: int) -> Flags:
    """Marks (count,) of the designs that are certain to be valid.

    document  of one of the designs, a valid one
    values    resolved path -> numbers (count,) of all designs, one path for each element of a list
    """
    valid = np.ones(count, dtype=bool)
    for steps, numbers in values.items():
        valid &= np.isfinite(numbers) | np.isposinf(numbers)
        if not _together(steps):
            valid &= _allowed_alone(document, steps, numbers)
    read = _reader(document, values)
    for rule in (_loop, _kalman, _drives, _windings, _brakes, _workspace, _axes, _inertias, _plant):
        for broken in rule(document, read):
            valid &= ~np.broadcast_to(np.asarray(broken, dtype=bool), valid.shape)
    return valid


def _together(steps: KeyPath) -> bool:
    """Whether a list's numbers are checked together: matrices and the vectors of a plant."""
    if steps[0] == "plant":
        return True
    return len(steps) > 4 and steps[3] in ("inertia_kg_m2", "axis")


def _allowed_alone(document: dict[str, Any], steps: KeyPath, numbers: Floats) -> Flags:
    """Which numbers the file may have at a path. Those between two that it may have are allowed, too, if they are
    of one sign and not infinite."""
    inside = np.zeros(len(numbers), dtype=bool)
    for part in (numbers < 0.0, numbers == 0.0, (numbers > 0.0) & np.isfinite(numbers), np.isposinf(numbers)):
        ordered = np.unique(numbers[part])
        if not len(ordered):
            continue
        known = dict[int, bool]()

        def allowed(place: int, ordered: Floats = ordered, known: dict[int, bool] = known) -> bool:
            if place not in known:
                known[place] = _may_be(document, steps, float(ordered[place]))
            return known[place]

        low, high = _allowed_range(allowed, len(ordered))
        if low <= high:
            inside |= part & (numbers >= ordered[low]) & (numbers <= ordered[high])
    return inside


def _allowed_range(allowed: Callable[[int], bool], count: int) -> tuple[int, int]:
    """First and last place that is allowed, of places that are so from one to another; (0, -1) where none is."""
    tried = [0, count - 1, *(count * share // 16 for share in range(1, 16)), *range(count)]
    good = next((place for place in tried if allowed(place)), None)
    if good is None:
        return 0, -1
    ends = []
    for end in (0, count - 1):
        inside, outside = good, end
        if allowed(end):
            inside = outside
        while abs(outside - inside) > 1:
            middle = (inside + outside) // 2
            inside, outside = (middle, outside) if allowed(middle) else (inside, middle)
        ends.append(inside)
    return ends[0], ends[1]


def _may_be(document: dict[str, Any], steps: KeyPath, number: float) -> bool:
    changed = deep_copy(document)
    place: Any = changed
    for step in steps[:-1]:
        place = place[step]
    place[steps[-1]] = number
    try:
        DeviceFile.model_validate(without_unsupported(changed)[0])
    except ValidationError:
        return False
    return True


Read = Callable[..., Any]


def _reader(document: dict[str, Any], values: Values) -> Read:
    """A function of a path's steps: the designs' numbers there, or those of the document; None where there are
    none. A list of numbers comes as an array, with the designs' axis, if it has one, first."""

    def read(*steps: str | int) -> Any:
        if steps in values:
            return values[steps]
        place: Any = document
        for step in steps:
            known = (
                step in place if isinstance(place, dict) else isinstance(place, list) and int(step) < len(place)
            )
            if not known:
                return None
            place = place[step]
        if not isinstance(place, list):
            return place
        depth = 1 if not place or not isinstance(place[0], list) else 2
        return join_designs([np.asarray(read(*steps, i), dtype=float) for i in range(len(place))], depth - 1)

    return read


Broken = Iterator[Any]


def _loop(document: dict[str, Any], read: Read) -> Broken:
    """Delays, lags and cutoffs against the sampling period."""
    T = read("loop", "sampling_period_s")
    for path in _LOW_PASSES:
        cutoff = read("loop", *path, "cutoff_Hz")
        if cutoff is not None:
            times = read("loop", "local", "rate_multiple") if path[0] == "local" else 1
            yield reaches_nyquist(cutoff, T / times)
    lag, delay, late = (
        read("loop", *steps) for steps in (("actuator", "time_constant_s"), ("delay_samples",), ("delay_s",))
    )
    if lag is not None:
        yield lags_wrongly(lag, T)
    if delay is not None:
        yield delay > LONGEST_DELAY
    if late is not None:
        yield late / T > LONGEST_DELAY


def _kalman(document: dict[str, Any], read: Read) -> Broken:
    """The tracking index of a Kalman filter, at its own rate."""
    T, step = read("loop", "sampling_period_s"), read("loop", "encoder", "resolution_m")
    for path in (("loop",), ("loop", "feedforward"), ("loop", "local")):
        if read(*path, "velocity", "method") != "kalman":
            continue
        noise = read(*path, "velocity", "position_noise_m")
        if noise is None:
            noise = quantisation_noise(step)
        own = T / read(*path, "rate_multiple") if path[-1] == "local" else T
        index = read(*path, "velocity", "acceleration_noise_m_per_s2") * own**2 / noise
        yield (index < INDEX[0]) | (index > INDEX[1])


def _drives(document: dict[str, Any], read: Read) -> Broken:
    """Torques of a motor."""
    for path, _ in written(table(document, "mechanism"), "drives"):
        continuous, limit = (read("mechanism", *path, key) for key in ("continuous_torque_Nm", "torque_limit_Nm"))
        if continuous is not None and limit is not None:
            yield continuous > limit


def _windings(document: dict[str, Any], read: Read) -> Broken:
    """Electrical damping and its lag."""
    T = read("loop", "sampling_period_s")
    windings = []
    for path, drive in written(table(document, "mechanism"), "drives"):
        if "damping_resistance_ohm" in drive:
            n, table_of = (
                read("mechanism", *path, *keys) for keys in (("transmission_ratio",), ("ratio_table", "ratio"))
            )
            k, inside, outside, L = (
                read("mechanism", *path, key)
                for key in (
                    "torque_constant_Nm_per_A",
                    "winding_resistance_ohm",
                    "damping_resistance_ohm",
                    "winding_inductance_H",
                )
            )
            windings.append(((n if table_of is None else table_of.max(axis=-1)) * k, inside + outside, L))
    for i, _ in tables(table(document, "plant"), "electrical_damping"):
        keys = ("force_constant_N_per_A", "resistance_ohm", "inductance_H")
        windings.append(tuple(read("plant", "electrical_damping", i, key) for key in keys))
    for constant, R, L in windings:
        yield np.asarray(constant) ** 2 / R > magnitudes.STRONGEST_DAMPING
        if L is not None:
            yield lags_wrongly(L / R, T)


def _brakes(document: dict[str, Any], read: Read) -> Broken:
    """Lags of programmable brakes against the sampling period."""
    T = read("loop", "sampling_period_s")
    places: list[KeyPath] = [("plant", "brake", i) for i, _ in tables(table(document, "plant"), "brake")]
    places += [("mechanism", *path) for path, _ in written(table(document, "mechanism"), "drives")]
    for place in places:
        lag = read(*place, "time_constant_s" if place[0] == "plant" else "brake_time_constant_s")
        if lag is not None:
            yield lags_wrongly(lag, T)


def _workspace(document: dict[str, Any], read: Read) -> Broken:
    """The reference position within the workspace."""
    position = read("mechanism", "reference", "position_m")
    for i, axis in enumerate("xyz"):
        bounds = read("mechanism", "workspace", f"{axis}_m")
        if bounds is not None and i < position.shape[-1]:
            yield (position[..., i] < bounds[..., 0]) | (position[..., i] > bounds[..., 1])


def _axes(document: dict[str, Any], read: Read) -> Broken:
    """Joint axes with a length."""
    for path, link in written(table(document, "mechanism"), "links"):
        if "axis" in link:
            axis = read("mechanism", *path, "axis")
            yield (np.abs(axis).max(axis=-1) == 0.0) | (np.abs(axis).max(axis=-1) > LARGEST)


def _inertias(document: dict[str, Any], read: Read) -> Broken:
    """Moments of inertia that a body can have: by the file's rules, the eigenvalues well inside them."""
    for path, link in written(table(document, "mechanism"), "links"):
        if not isinstance(link.get("inertia_kg_m2"), list) or len(link["inertia_kg_m2"]) != 3:
            continue
        inertia = read("mechanism", *path, "inertia_kg_m2")
        nested = isinstance(link["inertia_kg_m2"][0], list)
        if nested:
            yield _asymmetric(inertia)
        moments = np.linalg.eigvalsh(inertia) if nested else np.sort(inertia, axis=-1)
        largest = moments[..., 2]
        yield moments[..., 0] < 0.0
        yield largest > moments[..., 0] + moments[..., 1]
        yield (largest > 0.0) & ((largest < magnitudes.LEAST_INERTIA) | (largest > magnitudes.LARGEST_INERTIA))


def _plant(document: dict[str, Any], read: Read) -> Broken:
    """Matrices and vectors of a given plant."""
    limits = dict(
        zip(PLANT_MATRICES, (magnitudes.HEAVIEST, magnitudes.STRONGEST_DAMPING, magnitudes.STIFFEST), strict=True)
    )
    for key in PLANT_MATRICES if "plant" in document else ():
        matrix = read("plant", key)
        if matrix is None:
            continue
        if not isinstance(document["plant"][key], list):
            matrix = np.asarray(matrix)[..., None, None]
        yield _asymmetric(matrix)
        yield np.abs(matrix).max(axis=(-2, -1)) > limits[key]
        if key == "mass_kg":
            masses = np.linalg.eigvalsh(matrix)
            least = masses.shape[-1] * np.finfo(float).eps * np.abs(masses[..., -1])
            yield (masses[..., 0] <= 2.0 * least) | (masses[..., 0] < magnitudes.LIGHTEST)
            yield masses[..., -1] > magnitudes.HEAVIEST
    for key in PLANT_VECTORS if "plant" in document else ():
        vector = read("plant", key)
        if vector is not None:
            largest = np.abs(vector).max(axis=-1) if isinstance(document["plant"][key], list) else np.abs(vector)
            yield (largest < magnitudes.LEAST_SHARE) | (largest > magnitudes.LARGEST_SHARE)


def _asymmetric(matrix: Floats) -> Any:
    gap = np.abs(matrix - np.swapaxes(matrix, -1, -2)).max(axis=(-2, -1))
    return gap > 0.5 * SYMMETRY_TOLERANCE * np.abs(matrix).max(axis=(-2, -1))


def assembles(mechanism: Mechanism, assembly: str | None) -> bool:
    """Whether there is a posture at the reference, with a mass for every motion.

    What holds is what `mechanism_check.mechanism_faults` checks of any mechanism, in a tenth of its time. Where it
    does not hold nothing is said: the mechanism may still be put together with its handle elsewhere.
    """
    try:
        posture = solve_posture(mechanism, mechanism.reference_position, assembly)
    except ValueError:
        return False
    return bool(masses_moved(posture).all())


def masses_moved(posture: Posture) -> Flags:
    """Marks (...) of the postures in which every motion has a mass, and of those that are not OK."""
    known = (posture.status == OK) & ~np.isnan(posture.mass_matrix).any(axis=(-2, -1))
    M = np.where(known[..., None, None], posture.mass_matrix, np.eye(posture.mass_matrix.shape[-1]))
    eigenvalues = np.linalg.eigvalsh(M)
    least = M.shape[-1] * np.finfo(float).eps * eigenvalues[..., -1]
    return np.asarray(eigenvalues[..., 0] > least)
