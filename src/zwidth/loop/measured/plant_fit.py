"""A plant fitted to a measured device: masses, springs and dampers in modal coordinates, and a delay.

It starts from the poles of `pole_fit`, and all its numbers are fitted together, so that one actuator, one sensor
and one handle explain all paths, with damping that takes in power only. What needs motion in time needs such a
plant, and its answers hold as far as the plant does: the fit says how far that is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.errors import ResponseError
from zwidth.loop.measured.measured_port import path_data
from zwidth.loop.measured.pole_fit import (
    PATHS,
    PathData,
    PoleModel,
    continuous_terms,
    fit_poles,
    mode_atoms,
    sampled_free_mass,
    sampled_terms,
    stacked,
)
from zwidth.model.plant import Plant
from zwidth.model.response import Response
from zwidth.result import Documented, entry

POINTS: Final = 250  # frequencies to which a plant is fitted
STEPS: Final = 300  # of the search
CHANGE: Final = 1.5e-8  # relative, of unknowns for derivatives
WORST: Final = 0.1  # relative misfit, beyond that of noise, from which no plant is given


@dataclass(frozen=True)
class ModalModel:
    """squared (n,) and damping (n, n) of the modes, per sample; actuator, sensor and handle (n,); delay [samples].

    free  whether the first mode is 1/s², which no damper couples to others
    """

    squared: Floats
    damping: Floats
    actuator: Floats
    sensor: Floats
    handle: Floats
    delay: float
    free: bool

    def paths(self, names: Iterable[str], theta: Floats) -> dict[str, Complexes]:
        """Responses (k,) of some of PATHS at angles theta = w T: of commands as sampled, of the hand as it is."""
        terms: dict[str, Complexes] = {}
        values = {}
        for name in names:
            sampled = name[1] == "a"  # the second letter is the path's input
            if name[1] not in terms:
                poles = self._eigen[0]
                of_input = sampled_terms(poles, theta, self.delay) if sampled else continuous_terms(poles, theta)
                if self.free:
                    mass = sampled_free_mass(theta, self.delay) if sampled else -1.0 / theta**2 + 0j
                    of_input = np.concatenate([mass[:, None], of_input], axis=1)
                terms[name[1]] = of_input
            values[name] = np.asarray(terms[name[1]] @ self._residues(name))
        return values

    @cached_property
    def _eigen(self) -> tuple[Complexes, Complexes, Complexes]:
        """Poles (2n,) of the modes that do not stand apart, their shapes (n, 2n) and what moves them (2n, n)."""
        first = int(self.free)
        n = len(self.squared) - first
        A = np.zeros((2 * n, 2 * n))
        A[:n, n:] = np.eye(n)
        A[n:, :n], A[n:, n:] = -np.diag(self.squared[first:]), -self.damping[first:, first:]
        poles, shapes = np.linalg.eig(A)
        into = np.linalg.inv(shapes)[:, n:]
        return poles.astype(complex), shapes[:n].astype(complex), into.astype(complex)

    def _residues(self, name: str) -> Complexes:
        """Residues (2n,) of a path by its name, one of PATHS; that of 1/s² in front of them where it stands
        apart."""
        read = self.sensor if name[0] == "s" else self.handle
        push = self.actuator if name[1] == "a" else self.handle
        first = int(self.free)
        _, shapes, into = self._eigen
        residues = (read[first:] @ shapes) * (into @ push[first:])
        return np.append(read[0] * push[0], residues) if self.free else residues


@dataclass(frozen=True)
class PlantFit(Documented):
    """A plant that stands for a measured device.

    plant      in modal coordinates, its handle where the paths of the handle are known
    delay      of the hardware [s]
    misfit     root mean square of the relative deviation of the fitted from the measured response
    largest    the largest such deviation;   largest_at  its frequency [Hz]
    noise      root mean square of the measurement's own relative error; 0 where it is not known
    """

    plant: Plant = field(metadata=entry(name="modes", value=lambda plant: plant.size))
    delay: float = field(metadata=entry("s", name="hardware_delay"))
    misfit: float = field(metadata=entry())
    largest: float = field(metadata=entry(name="largest_misfit"))
    largest_at: float = field(metadata=entry("Hz", name="largest_misfit_at"))
    noise: float = field(metadata=entry(name="measurement_error"))


def fit_plant(response: Response, period: float) -> PlantFit:
    """The plant of a measured device; its misfits are those below 0.95 of half the sampling rate. A handle whose
    paths are not known is left out.

    period  sampling period T [s]
    Raises  ResponseError  where no plant explains the response
    """
    handle = response.handle
    known = handle is not None and not handle.missing
    used = response if known else replace(response, handle=None)
    data = path_data(used, period)
    poles = fit_poles(data)
    at_sensor = known and handle is not None and handle.at_sensor
    tied = known and handle is not None and handle.actuator_at_sensor
    model = _fitted(data.thinned(POINTS), _first_model(data, poles, at_sensor, tied), at_sensor, tied)
    value = model.paths(["sa"], data.theta)["sa"]
    deviation = np.abs(value / data.values["sa"] - 1.0)
    below = data.theta < 0.95 * np.pi  # at half the rate a free mass answers with next to nothing
    # deviations are those of the real and of the imaginary part: their squares add up to twice the one
    noise = float(np.sqrt(np.mean(2.0 * (data.deviations["sa"] / np.abs(data.values["sa"]))[below] ** 2)))
    noise = noise if response.coherence is not None or response.sweeps is not None else 0.0
    misfit, worst = float(np.sqrt(np.mean(deviation[below] ** 2))), int(np.argmax(np.where(below, deviation, 0.0)))
    frequency = data.theta[worst] / (2.0 * np.pi * period)
    if not misfit**2 - noise**2 < WORST**2:
        raise ResponseError(
            f"is not explained by masses, springs, dampers and a delay: the best plant misses it by "
            f"{100.0 * misfit:.3g} %, most at {frequency:.4g} Hz; measure more closely there, or describe the "
            "device as a [plant]"
        )
    n = len(model.squared)
    plant = Plant(
        mass=np.eye(n),
        damping=model.damping / period,
        stiffness=np.diag(model.squared) / period**2,
        actuator=model.actuator / period,
        sensor=model.sensor / period,
        handle=model.handle / period if known else None,
        names=tuple(f"mode {i}" for i in range(n)),
    )
    return PlantFit(plant, model.delay * period, misfit, float(deviation[worst]), float(frequency), noise)


def _first_model(data: PathData, found: PoleModel, at_sensor: bool, tied: bool) -> ModalModel:
    """The model of these poles, with residues of the paths by least squares and dampers that couple no modes.

    data, found      the measured paths, and the poles that `fit_poles` finds in them
    at_sensor, tied  whether the handle, and the actuator, is where the sensor is
    """
    poles, delay, residues = found.modes, found.delay, {}
    for name, value in data.values.items():
        own_atoms = mode_atoms(poles, found.free, data.theta, delay if name[1] == "a" else None)
        # without those times s: a modal model has none
        atoms = stacked(own_atoms[:, : len(poles) + found.free], data.deviations[name])
        scale = np.maximum(np.linalg.norm(atoms, axis=0), 1e-300)
        target = stacked(value, data.deviations[name])
        residues[name] = np.linalg.lstsq(atoms / scale, target, rcond=1e-11)[0] / scale
    free = data.integrators == 2
    n = len(poles) + free
    squared, damping = np.zeros(n), np.zeros((n, n))
    for i, (w, ratio) in enumerate(poles, start=int(free)):
        squared[i] = w**2
        damping[i, i] = 2.0 * w * ratio if w > 0.0 else ratio
    return ModalModel(squared, damping, *_ends_of_modes(residues, at_sensor, tied), delay, free)


def _ends_of_modes(residues: Mapping[str, Floats], at_sensor: bool, tied: bool) -> tuple[Floats, Floats, Floats]:
    """Actuator, sensor and handle (n,) of n modes whose products explain the residues (n,) of all paths about as
    well; where no path tells the handle it is the sensor if tied, else 0. at_sensor, tied: `_first_model`."""
    sa, sh, ha, hh = (residues.get(name) for name in PATHS)
    assert sa is not None

    def root(own: Floats) -> Floats:
        """Square root (n,) of the sizes of residues: the end of a path that begins and ends there, or its even
        share of both ends. Never 0, since residues are divided by it."""
        size = np.abs(own)
        return np.asarray(np.sqrt(np.maximum(size, 1e-12 * np.max(size) + 1e-300)))

    if tied:
        s = a = root(sa)
        h = s if at_sensor or sh is None else sh / s
    elif at_sensor and sh is not None:
        s = h = root(sh)
        a = sa / s
    elif hh is not None and sh is not None:
        h = root(hh)
        s = sh / h
        a = (sa if ha is None else ha) / h
    else:
        a = root(sa)
        s, h = sa / a, np.zeros(len(sa))
    return a, s, h


def _fitted(data: PathData, start: ModalModel, at_sensor: bool, tied_ends: bool) -> ModalModel:
    """The model whose numbers `_numbers_of_model` fit the data by least squares, begun from `start`: `start`
    itself where the numbers are more than the data. at_sensor, tied_ends: as `_first_model`'s at_sensor and
    tied."""
    from scipy.optimize import approx_fprime, least_squares

    unpack = partial(_model_of_numbers, data, start, at_sensor, tied_ends)

    def residual(x: Floats) -> Floats:  # finite, large where the model's response is not: the search turns back
        return np.nan_to_num(_model_residual(data, unpack(x)), nan=1e6, posinf=1e6, neginf=-1e6)

    x = _numbers_of_model(data, start, at_sensor, tied_ends)
    scale = np.maximum(np.abs(x), 1e-3 * np.max(np.abs(x)))  # of numbers next to 0, too
    if len(x) > 2 * len(data.theta) * len(data.values):
        return start

    def slopes(x: Floats) -> Floats:  # by this function, since SciPy's versions count those of its own unlike
        return np.asarray(approx_fprime(x, residual, CHANGE * scale))

    found = least_squares(
        residual, x, slopes, x_scale=scale, method="lm", max_nfev=STEPS, ftol=1e-8, xtol=1e-10, gtol=1e-15
    )
    return unpack(found.x)


def _model_of_numbers(
    data: PathData, start: ModalModel, at_sensor: bool, tied_ends: bool, x: Floats
) -> ModalModel:
    """Return the model of the numbers x (q,) that are fitted, laid out as by `_numbers_of_model`, which has the
    same arguments; the rest is that of the start, and an end that is where the sensor is has its numbers."""
    n, first = len(start.squared), int(start.free)
    m = n - first
    rows, columns = np.tril_indices(m)
    springless = start.squared[first:] == 0.0
    squared = np.zeros(n)
    # clipped, so that no frequency on the way of the search overflows
    squared[first:] = np.where(springless, 0.0, np.exp(np.clip(2.0 * x[:m], -200.0, 20.0)))
    factor = np.zeros((m, m))  # of the damping, which so never gives power
    factor[rows, columns] = x[m : m + len(rows)]
    damping = np.zeros((n, n))
    damping[first:, first:] = factor @ factor.T
    at = m + len(rows)
    s = x[at : at + n]
    at += n
    a = s
    if not tied_ends:
        a, at = x[at : at + n], at + n
    h = s
    if not at_sensor:
        h = start.handle
        if "sh" in data.values:
            h, at = x[at : at + n], at + n
    delay = start.delay if data.delay is not None else max(float(x[at]), 0.0)
    return ModalModel(squared, damping, a, s, h, delay, start.free)


def _numbers_of_model(data: PathData, start: ModalModel, at_sensor: bool, tied_ends: bool) -> Floats:
    """Return the numbers (q,) of the start that are fitted, per sample: logarithms of the modes' frequencies (0 of
    one without spring), the lower triangle of the damping's factor, the sensor, and as far as they are free
    actuator, handle and delay. Arguments as of `_fitted`."""
    first = int(start.free)
    rows, columns = np.tril_indices(len(start.squared) - first)
    springless = start.squared[first:] == 0.0
    diagonal = np.diag(np.sqrt(np.maximum(np.diag(start.damping)[first:], 1e-12)))
    x0 = [0.5 * np.log(np.where(springless, 1.0, start.squared[first:])), diagonal[rows, columns], start.sensor]
    if not tied_ends:
        x0.append(start.actuator)
    if "sh" in data.values and not at_sensor:
        x0.append(start.handle)
    if data.delay is None:
        x0.append(np.array([start.delay]))
    return np.concatenate(x0)


def _model_residual(data: PathData, model: ModalModel) -> Floats:
    """Deviations of the model from all paths' data, each over its standard deviation, in one row."""
    responses = model.paths(data.values, data.theta)
    return np.concatenate(
        [stacked(responses[name] - value, data.deviations[name]) for name, value in data.values.items()]
    )
