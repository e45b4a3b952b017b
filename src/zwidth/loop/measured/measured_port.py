"""A measured device as a port: from the command and the hand's force to the encoder and the handle.

Commands are held between samples, so that the sampled response to them adds up all frequencies that look alike,

    P(e^(i theta)) = sum_k W_k G(j w_k),      w_k = (theta + 2 pi k)/T,    W = (1 - e^-jwT)/(jwT) e^(-jw delay)

while the hand's force is continuous. What a hand changes, it changes before sampling: W_0 G at the frequency
itself is needed, and what the others add. Both need the device beyond half the sampling rate, where nothing is
measured: there it is continued by its fitted modes (`pole_fit`). At the frequency itself the data stand,

    W_0 G = P - (P_fit - W_0 G_fit)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.errors import ResponseError
from zwidth.loop.measured.pole_fit import PathData, PoleModel, fit_poles, hold_response
from zwidth.model.response import (
    LEAST_COHERENCE,
    MeasuredHandle,
    MeasuredPath,
    Response,
    handle_obstacle,
    integrators_of,
    relative_error,
)

SMALL: Final = 0.02  # a value below this share of its neighbours' counts as if it had that size
SUREST: Final = 1e-6  # relative deviation below which no value is believed
LATEST: Final = 0.1  # radians at half the sampling rate, by which the fitted delay may be wrong


@dataclass(frozen=True)
class MeasuredPort:
    """Responses at the angles theta = w T of all measured frequencies (n,), by path: first letter the output, s
    the sensor or h the handle; second the input, a the command or h the hand's force.

    sampled     "sa", "ha": of commands, as sampled
    baseband    "sa", "ha": W_0 G; "sh", "hh": G
    deviations  standard deviation [m/N] of what was measured, by measured path; inf where it says nothing, 0 where
                no error is known
    origin      which measured path each of the four stems from
    sweeps      baseband of every repeated sweep, with its sampled "sa"; () for one measurement
    model       the fitted modes
    """

    theta: Floats
    period: float
    sampled: Mapping[str, Complexes]
    baseband: Mapping[str, Complexes]
    deviations: Mapping[str, Floats]
    origin: Mapping[str, str]
    sweeps: tuple[tuple[Mapping[str, Complexes], Complexes], ...]
    model: PoleModel

    @property
    def errors_known(self) -> bool:
        """Whether repeated sweeps or coherence tell an error."""
        return any(bool(np.any(deviation > 0.0)) for deviation in self.deviations.values())

    def continued(self, name: str, theta: Floats) -> Complexes:
        """The fitted response (k,) [m/N] of a path at angles (k,) of any size, of commands before hold and
        delay."""
        return self.model.continuous(self.origin[name], theta)

    @cached_property
    def misfit(self) -> float:
        """Root mean square deviation of measured from fitted responses, in shares of the fitted, at angles above
        pi/2 whose error is finite; inf where there are none."""
        upper = self.theta > 0.5 * np.pi
        squares = []
        for name in self.baseband:
            fit = self.continued(name, self.theta[upper])
            if name[1] == "a":
                fit = fit * self.model.hold(self.theta[upper])
            known = np.isfinite(self.deviations[self.origin[name]][upper])
            squares.append(np.abs(self.baseband[name][upper] / fit - 1.0)[known] ** 2)
        every = np.concatenate(squares)
        return float(np.sqrt(np.mean(every))) if len(every) else np.inf


def path_data(response: Response, period: float) -> PathData:
    """The measured paths for `fit_poles`, at the frequencies at which all of them are known."""
    paths = _paths(response)
    deviations = {name: relative_deviation(path, response.averages) for name, path in paths.items()}
    usable = [np.isfinite(deviations[n]) & np.isfinite(p.value) & (p.value != 0.0) for n, p in paths.items()]
    good = np.all(usable, axis=0)
    values = {name: path.value[good] for name, path in paths.items()}
    return PathData(
        np.minimum(2.0 * np.pi * response.frequency * period, np.pi)[good],
        values,
        {name: np.maximum(deviations[name][good], SUREST) * _sizes(value) for name, value in values.items()},
        integrators_of(response, period),
        response.delay,
    )


def relative_deviation(path: MeasuredPath, averages: float) -> Floats:
    """Relative standard deviation (n,) of the real and of the imaginary part of a path: from repeated sweeps that
    of their mean, from coherence as `relative_error`; 0 where neither is known, inf where coherence is lost."""
    if path.sweeps is not None:
        k = len(path.sweeps)  # variance over k - 1, half of it in each part, and a k-th of that in the mean
        spread = np.sum(np.abs(path.sweeps - path.value) ** 2, axis=0) / (2.0 * max(k - 1, 1) * k)
        return np.asarray(np.sqrt(spread) / np.maximum(np.abs(path.value), 1e-300))
    if path.coherence is None:
        return np.zeros(len(path.value))
    lost = path.coherence < LEAST_COHERENCE
    return np.where(lost, np.inf, relative_error(np.where(lost, 1.0, path.coherence), averages))


def _sizes(value: Complexes) -> Floats:
    """Magnitudes (n,), none below SMALL times its larger neighbour's: they divide errors, also beside a zero."""
    size = np.abs(value)
    around = np.maximum(np.append(size[1:], 0.0), np.append(0.0, size[:-1]))
    return np.asarray(np.maximum(size, SMALL * around))


def measured_port(response: Response, period: float) -> MeasuredPort:
    """The port of a response with a handle.

    period  sampling period T [s]
    Raises  ResponseError  where paths are missing, or the delay that is to be taken out cannot be told
    """
    handle = response.handle
    if obstacle := handle_obstacle(response):
        raise ResponseError(obstacle)
    assert handle is not None
    data = path_data(response, period)
    model = fit_poles(data)
    # with the actuator at the sensor, paths that were not measured are made of others by hold and delay
    takes_hold_out = handle.actuator_at_sensor and handle.command_to_handle is None
    if takes_hold_out and model.delay_deviation * np.pi > LATEST:
        raise ResponseError(
            f"does not tell the hardware's delay, {model.delay:.3g} +- {2.0 * model.delay_deviation:.2g} samples, "
            "without which the hold cannot be taken out; give hardware_delay_samples, or measure the paths of the "
            "handle"
        )
    theta = np.minimum(2.0 * np.pi * response.frequency * period, np.pi)
    paths = _paths(response)
    deviations = {
        name: relative_deviation(path, response.averages) * np.abs(path.value) for name, path in paths.items()
    }
    sampled, baseband, origin = _four_paths({n: p.value for n, p in paths.items()}, handle, model, theta)
    sweeps = []
    for k in range(0 if response.sweeps is None else len(response.sweeps)):
        commanded, base, _ = _four_paths({n: _sweep(p, k) for n, p in paths.items()}, handle, model, theta)
        sweeps.append((base, commanded["sa"]))
    return MeasuredPort(theta, period, sampled, baseband, deviations, origin, tuple(sweeps), model)


def command_port(response: Response, period: float) -> MeasuredPort:
    """The path from command to encoder alone, of a response with a handle or without."""
    bare = replace(response, handle=None)
    model = fit_poles(path_data(bare, period))
    theta = np.minimum(2.0 * np.pi * response.frequency * period, np.pi)
    base = {"sa": response.value - _aliases(model, "sa", theta)}
    deviation = relative_deviation(_paths(bare)["sa"], response.averages) * np.abs(response.value)
    beyond = response.value - base["sa"]
    repeated = () if response.sweeps is None else tuple(response.sweeps)
    sweeps = tuple(({"sa": sweep - beyond}, sweep) for sweep in repeated)
    return MeasuredPort(
        theta, period, {"sa": response.value}, base, {"sa": deviation}, {"sa": "sa"}, sweeps, model
    )


def changed_port(port: MeasuredPort, added_delay: float = 0.0, period: float | None = None) -> MeasuredPort:
    """The same device commanded later, or by a computer of another rate; its own delay stays the same in seconds.

    At the frequency itself commands are held and delayed anew, W' / W of what was measured; what the frequencies
    that look alike add is of the fitted modes. Angles above pi are left to the caller.

    added_delay  [samples of the new period]
    period       new sampling period [s]; None: the same
    """
    ratio = 1.0 if period is None else period / port.period
    model = port.model.scaled(ratio, added_delay)
    theta = port.theta * ratio
    change = model.hold(theta) / port.model.hold(port.theta)

    def held_anew(base: Mapping[str, Complexes]) -> dict[str, Complexes]:
        return {name: value * change if name[1] == "a" else value for name, value in base.items()}

    base = held_anew(port.baseband)
    beyond = {name: _aliases(model, port.origin[name], theta) for name in port.sampled}
    sweeps = [held_anew(one) for one, _ in port.sweeps]
    return replace(
        port,
        theta=theta,
        period=port.period * ratio,
        sampled={name: base[name] + beyond[name] for name in beyond},
        baseband=base,
        sweeps=tuple((one, one["sa"] + beyond["sa"]) for one in sweeps),
        model=model,
    )


def sweep_port(port: MeasuredPort, number: int) -> MeasuredPort:
    """The device as it was in one of its repeated sweeps, number from 0, the error of which is not known: 0."""
    base, value = port.sweeps[number]  # its paths before sampling, and the sampled "sa"
    beyond = {name: port.sampled[name] - port.baseband[name] for name in port.sampled}
    return replace(
        port,
        sampled={name: base[name] + beyond[name] for name in beyond} | {"sa": value},
        baseband=base,
        deviations={name: np.zeros(len(port.theta)) for name in port.deviations},
        sweeps=(),
    )


def _paths(response: Response) -> dict[str, MeasuredPath]:
    """The measured paths by their names in `MeasuredPort`."""
    handle = response.handle
    paths = {"sa": MeasuredPath(response.value, response.coherence, response.sweeps)}
    if handle is None:
        return paths
    more = {"sh": handle.force_to_encoder, "ha": handle.command_to_handle, "hh": handle.force_to_handle}
    return paths | {name: path for name, path in more.items() if path is not None}


def _sweep(path: MeasuredPath, k: int) -> Complexes:
    """A path's repetition k; its mean where there are no such."""
    return path.value if path.sweeps is None or k >= len(path.sweeps) else path.sweeps[k]


def _four_paths(
    measured: Mapping[str, Complexes], handle: MeasuredHandle, model: PoleModel, theta: Floats
) -> tuple[dict[str, Complexes], dict[str, Complexes], dict[str, str]]:
    """`sampled`, `baseband` and `origin` of a `MeasuredPort`: a path that was not measured is that of another one,
    where handle, sensor and actuator are in one place, or by reciprocity."""
    hold = hold_response(theta, model.delay)
    origin = {name: name for name in measured}
    sampled = {name: measured[name] for name in ("sa", "ha") if name in measured}
    base = {name: value - _aliases(model, name, theta) for name, value in sampled.items()}
    base |= {name: measured[name] for name in ("sh", "hh") if name in measured}
    if "sh" not in base:
        base["sh"], origin["sh"] = base["sa"] / hold, "sa"
    if "hh" not in base:
        base["hh"], origin["hh"] = base["sh"], origin["sh"]
    if "ha" not in base and handle.at_sensor:
        sampled["ha"], base["ha"], origin["ha"] = sampled["sa"], base["sa"], "sa"
    elif "ha" not in base:
        # reciprocal: the handle answers the actuator as the sensor, in the actuator's place, answers the handle
        base["ha"], origin["ha"] = base["sh"] * hold, origin["sh"]
        sampled["ha"] = base["ha"] + _aliases(model, origin["sh"], theta)
    return sampled, base, origin


def _aliases(model: PoleModel, name: str, theta: Floats) -> Complexes:
    """What the frequencies that look alike add to a path (k,) from commands, by its fitted modes."""
    return model.sampled(name, theta) - model.continuous(name, theta) * model.hold(theta)
