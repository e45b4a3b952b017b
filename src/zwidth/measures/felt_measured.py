"""What the hand feels of a wall on a measured device: frequency by frequency from its measured paths.

A hand force f e^{jwt} moves the encoder's samples by Y = G_eh f + P U, and the loop answers with U = -C Y, where
C = K + B w(z), the force's filter and software's delay included. At the frequency itself the handle moves by

    x_h = [G_hh - W G_ha C G_eh/(1 + P C)] f,        Z = f/(jw x_h)

with all that was measured, and W G_ha as `loop.measured.measured_port` gives it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.chart.chart_base import Chart
from zwidth.loop.controller import Controller
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.filters import force_filter, velocity_estimator
from zwidth.loop.measured.measured_port import MeasuredPort
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.felt import FeltWall
from zwidth.measures.handle_impedance import commanded_impedance

AT_REST: Final = 0.3  # of the lowest mode's frequency, up to which stiffness and mass at rest are read off
LOWEST_MODE: Final = 0.3  # of half the sampling rate, where no mode is lower
FEWEST: Final = 8  # frequencies from which they are
CLEAR: Final = 0.1  # relative deviation of a motion, beyond which its inverse is biased
UNCERTAIN: Final = 0.25  # relative standard deviation of a number at rest that is not given any more
UNYIELDING: Final = 1e6  # times the device's largest dynamic stiffness: a wall of that many N/m holds the encoder


def felt_wall_of_response(point: OperatingPoint, stiffness: float, damping: float) -> FeltWall:
    """What the hand feels of a wall on a measured device, at the measured frequencies; see `felt_wall`.

    Felt stiffness and mass at rest are those that the frequencies well below the lowest mode show; nan where their
    errors hide them.

    Raises  ResponseError  where the paths of the handle were not measured
    """
    port, controller = point.measured_port, point.controller
    chart: Chart = point.chart()
    verdict = str(np.ravel(chart.check(stiffness, damping).names)[0])
    stable, peak = verdict == "stable", chart.stiffness_max
    inner = port.theta < np.pi * (1.0 - 1e-9)
    for source in set(port.origin.values()):
        inner &= np.isfinite(port.deviations[source])
    theta = port.theta[inner]
    frequency = theta / (2.0 * np.pi * port.period)
    jw = 2j * np.pi * frequency
    force, speed = _law(controller, theta)
    paths = {name: value[inner] for name, value in port.baseband.items()} | {"P": port.sampled["sa"][inner]}
    deviations = {source: deviation[inner] for source, deviation in port.deviations.items()}
    own = port.model.modes[:, 0]
    lowest = min([*own[own > 0.0], LOWEST_MODE * np.pi])
    low = slice(0, max(FEWEST, int(np.searchsorted(theta, AT_REST * lowest))))

    def at_rest(law: Complexes) -> tuple[float, float]:
        spread = _motion_deviation(port, paths, deviations, law)
        return _stiffness_and_mass(theta[low] / port.period, _handle_motion(paths, law)[low], spread[low])

    def felt_at_rest(wall: float) -> float:
        return at_rest(wall * force)[0]

    rigid = port.origin["hh"] == port.origin["sh"]
    spring = not (port.model.free or np.any(own == 0.0))
    unyielding = UNYIELDING * float(np.max(np.abs(1.0 / paths["P"])))
    limit = np.inf if rigid else felt_at_rest(unyielding)
    free = 1.0 / (jw * paths["hh"])
    return FeltWall(
        wall_stiffness=stiffness,
        wall_damping=damping,
        verdict=verdict,
        static_stiffness=felt_at_rest(stiffness) if stable else None,
        free_motion_mass=np.nan if spring else at_rest(0.0 * force)[1],
        stiffness_max=peak if np.isfinite(peak) else None,
        static_stiffness_at_stiffness_max=felt_at_rest(peak) if np.isfinite(peak) else None,
        static_stiffness_limit=limit,
        static_stiffness_limit_kind="infinite" if rigid else "unknown" if np.isnan(limit) else "limit",
        frequency=frequency,
        felt_impedance=1.0 / (jw * _handle_motion(paths, force * (stiffness + damping * speed)))
        if stable
        else None,
        commanded_impedance=commanded_impedance(stiffness, damping, frequency),
        free_motion_impedance=free,
    )


def _law(controller: Controller, theta: Floats) -> tuple[Complexes, Complexes]:
    """Force filter with software's delay, and velocity estimate, at angles (k,)."""
    z, d = np.exp(1j * theta), np.expm1(1j * theta)
    force, speed = force_filter(controller), velocity_estimator(controller)
    passed = factor_response(force.numerator, force.denominator, d) * z ** -round(controller.delay)
    estimate = factor_response(speed.numerator, speed.denominator, d) * window_response(speed.window, z)
    return np.asarray(passed), np.asarray(estimate)


def _handle_motion(paths: dict[str, Complexes], law: Complexes) -> Complexes:
    """x_h/f (k,) [m/N] with a wall of this response."""
    return np.asarray(paths["hh"] - paths["ha"] * law * paths["sh"] / (1.0 + paths["P"] * law))


def _motion_deviation(
    port: MeasuredPort, paths: dict[str, Complexes], deviations: dict[str, Floats], law: Complexes
) -> Floats:
    """Standard deviation (k,) of `_handle_motion`, the errors of different measurements independent."""
    answer = law / (1.0 + paths["P"] * law)
    slopes = {"hh": 1.0 + 0.0 * law, "sh": -paths["ha"] * answer, "ha": -answer * paths["sh"]}
    slopes["sa"] = paths["ha"] * paths["sh"] * answer**2
    by_source: dict[str, Complexes] = {}
    for name, slope in slopes.items():
        source = port.origin[name]
        scale = np.abs(paths[name]) / np.maximum(np.abs(paths[source]), 1e-300) if name != source else 1.0
        by_source[source] = by_source.get(source, 0.0 * law) + slope * scale
    return np.asarray(np.sqrt(sum((np.abs(s) * deviations[name]) ** 2 for name, s in by_source.items())))


def _stiffness_and_mass(omega: Floats, motion: Complexes, deviation: Floats) -> tuple[float, float]:
    """k and m of  Re S = k - m w^2 + c w^4  of the dynamic stiffness S = 1/motion at low frequencies; nan for what
    is uncertain by more than UNCERTAIN of it."""
    clear = deviation < CLEAR * np.abs(motion)
    if np.count_nonzero(clear) < FEWEST:
        return np.nan, np.nan
    omega, motion, deviation = omega[clear], motion[clear], deviation[clear]
    square = (omega / omega[-1]) ** 2
    columns = np.vander(square, 3, increasing=True)
    known = bool(np.all(deviation > 0.0))
    weight = np.abs(motion) ** 2 / deviation if known else np.ones(len(square))
    solution = np.linalg.lstsq(columns * weight[:, None], np.real(1.0 / motion) * weight, rcond=None)[0]
    spread = np.zeros(3)
    if known:
        spread = np.sqrt(np.diag(np.linalg.pinv((columns * weight[:, None]).T @ (columns * weight[:, None]))))
    values = np.where(spread < UNCERTAIN * np.abs(solution), solution, np.nan)
    return float(values[0]), float(-values[1] / omega[-1] ** 2)
