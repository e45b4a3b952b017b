"""A velocity estimator run over recorded positions, linear or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.loop.estimator import Estimator, check_period
from zwidth.loop.estimators import Foaw, Levant, VelocityMethod
from zwidth.loop.estimators.kernels import foaw_estimate, levant_estimate
from zwidth.model.argument_checks import wrong_type


def velocity_of(method: VelocityMethod | Estimator, positions: ArrayLike, period: float) -> Floats:
    """The velocities that a method estimates, sample by sample, from positions.

    A linear one starts at rest at the first position, as if it had always been there.

    method     a velocity estimator; or the factors of a linear one at this period
    positions  (..., N)  one after the other, T apart [m]
    period     T [s]
    Returns    (..., N)  [m/s]; the first is 0
    Raises     ValueError  for positions that are no series or not finite, for a period that is not positive

    >>> from zwidth.loop.estimators import BackwardDifference
    >>> velocity_of(BackwardDifference(), [0.0, 1e-3, 3e-3], 0.001)
    array([0., 1., 2.])
    """
    if not isinstance(method, VelocityMethod | Estimator):
        raise wrong_type("method", "a velocity estimate such as WindowedDifference(4)", method)
    check_period(period)
    x = np.array(positions, dtype=np.float64, order="C")
    if x.ndim == 0:
        raise ValueError("positions must be a series, (..., N), got one number")
    if not np.all(np.isfinite(x)):
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(x))[0])
        raise ValueError(f"positions must be finite, got {float(x[at])!r} at {list(at)}; leave such samples out")
    velocities = np.empty_like(x)
    for index in np.ndindex(x.shape[:-1]):
        row, out = x[index], velocities[index]
        if isinstance(method, Foaw):
            _run_foaw(np.zeros(method.memory_size), method.parameters, period, row, out)
        elif isinstance(method, Levant):
            _run_levant(np.zeros(method.memory_size), method.parameters, period, row, out)
        else:
            factors = method if isinstance(method, Estimator) else method.estimator(period)
            _run_linear(factors.numerator, factors.denominator, factors.window, row, out)
    return velocities


@compiled
def _run_foaw(memory: Floats, parameters: Floats, period: float, positions: Floats, velocities: Floats) -> None:
    for j in range(positions.size):
        velocities[j] = foaw_estimate(memory, parameters, positions[j], period)


@compiled
def _run_levant(memory: Floats, parameters: Floats, period: float, positions: Floats, velocities: Floats) -> None:
    for j in range(positions.size):
        velocities[j] = levant_estimate(memory, parameters, positions[j], period)


@compiled
def _run_linear(
    numerator: Floats, denominator: Floats, window: Floats, positions: Floats, velocities: Floats
) -> None:
    """The factors one behind the other, each in powers of d = z - 1, then the window.

    (c2 d^2 + c1 d + c0)/(d^2 + d1 d + d0), from u to y, has the states w1 and w2:
    y = c2 u + w1,  d w1 = w2 + c1 u - d1 y,  d w2 = c0 u - d0 y; a factor of lower degree has fewer of them.
    """
    state, latest = np.zeros((numerator.shape[0], 2)), np.zeros(window.size)
    for j in range(positions.size):
        u = positions[j] - positions[0]
        for k in range(numerator.shape[0]):
            top, bottom, w = numerator[k], denominator[k], state[k]
            if bottom[0] != 0.0:
                y = top[0] * u + w[0]
                w[0] += w[1] + top[1] * u - bottom[1] * y
                w[1] += top[2] * u - bottom[2] * y
            elif bottom[1] != 0.0:
                y = top[1] * u + w[0]
                w[0] += top[2] * u - bottom[2] * y
            else:
                y = top[2] * u
            u = y
        latest[j % window.size] = u
        mean = 0.0
        for k in range(window.size):
            mean += window[k] * latest[(j - k) % window.size]
        velocities[j] = mean
