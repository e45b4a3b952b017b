"""The steps of nonlinear estimators to the next reading, compiled apart: device files are read without numba.

A velocity estimator run over recorded positions, linear or not.
"""

from __future__ import annotations

from math import copysign, inf, sqrt

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.loop.estimator import Estimator, check_period
from zwidth.loop.estimators import Foaw, Levant, VelocityMethod
from zwidth.loop.estimators.foaw import COUNT, ORIGIN, RING, ROUNDING_MARGIN
from zwidth.loop.estimators.levant import FIRST_READING, POSITION, READINGS, VELOCITY
from zwidth.model.argument_checks import wrong_type


@compiled
def foaw_estimate(memory: Floats, parameters: Floats, reading: float, period: float) -> float:
    """The velocity at a new reading; `Foaw` has the formulas.

    memory      (memory_size,)  zeros at first, changed in place; positions are counted from the first reading
    parameters  (3,)            `Foaw.parameters`: N, d, and 1 for the best fit, 0 for the end fit
    reading     position [m]
    period      T [s]
    Returns     [m/s]; 0 at the first reading, over the readings there are as long as they are fewer than N + 1
    """
    longest, band = int(parameters[0]), parameters[1] * (1.0 + ROUNDING_MARGIN)
    count = int(memory[COUNT])
    if count == 0:
        memory[ORIGIN] = reading
    size = longest + 1
    place = RING + count % size
    # each reading stands twice, a ring apart, so that the latest N + 1 are always one run
    memory[place] = memory[place + size] = reading - memory[ORIGIN]
    memory[COUNT] = count + 1.0
    if parameters[2] == 0.0:
        return _end_fit(memory, place + size, min(count, longest), band) / period
    return _best_fit(memory, place + size, min(count, longest), band) / period


@compiled
def _end_fit(memory: Floats, newest: int, periods: int, band: float) -> float:
    """Slope per period of the longest line from the newest reading to one before with all between within the band.

    newest, periods  place in the memory of the newest reading, and most periods to look back;   band  d [m]

    A reading i periods old with a change c_i since lies within it for slopes from (c_i - d)/i to (c_i + d)/i; the
    slopes allowed by all readings passed are one interval, so that each window costs one comparison.
    """
    slope, least, most = 0.0, -inf, inf
    for n in range(1, periods + 1):
        change = memory[newest] - memory[newest - n]
        candidate = change / n
        if candidate < least or candidate > most:
            break
        slope = candidate
        least = max(least, (change - band) / n)
        most = min(most, (change + band) / n)
    return slope


@compiled
def _best_fit(memory: Floats, newest: int, periods: int, band: float) -> float:
    """Slope per period of the least-squares line of the longest window that is within the band of it; arguments as
    of `_end_fit`."""
    slope, total, moment = 0.0, 0.0, 0.0  # sums of c_i and of i c_i, c_i the change since i periods ago, negated
    for n in range(1, periods + 1):
        change = memory[newest - n] - memory[newest]
        total += change
        moment += n * change
        candidate = 6.0 * (n * total - 2.0 * moment) / (n * (n + 1.0) * (n + 2.0))
        start = memory[newest] + total / (n + 1.0) + 0.5 * n * candidate  # of the line, at the newest reading
        for i in range(n + 1):
            # two readings lie on their line but for rounding: a window of one period never fails
            if n > 1 and abs(memory[newest - i] - start + candidate * i) > band:
                return slope
        slope = candidate
    return slope


@compiled
def levant_estimate(memory: Floats, parameters: Floats, reading: float, period: float) -> float:
    """The velocity at a new reading; `Levant` has the formulas.

    memory      (memory_size,)  zeros at first, changed in place; positions are counted from the first reading
    parameters  (2,)            `Levant.parameters`: lambda0, lambda1
    reading     position [m]
    period      T [s]
    Returns     z1 [m/s], 0 at the first reading
    """
    if memory[READINGS] == 0.0:
        memory[FIRST_READING] = reading
    memory[READINGS] += 1.0
    position = reading - memory[FIRST_READING]
    # lambda0 T, and lambda1 T, the most that the velocity changes in a sample
    brake, turn = period * parameters[0], period * parameters[1]
    ahead = memory[POSITION] + period * memory[VELOCITY] - position
    excess = abs(ahead) - period * turn
    if excess <= 0.0:
        memory[VELOCITY] = (position - memory[POSITION]) / period
        memory[POSITION] = position
    else:
        # the positive root of s^2 + brake s = excess, in the form without cancellation
        root = 2.0 * excess / (brake + sqrt(brake * brake + 4.0 * excess))
        memory[VELOCITY] -= copysign(turn, ahead)
        memory[POSITION] = position + copysign(root * root, ahead)
    velocity: float = memory[VELOCITY]
    return velocity


def velocity_of(method: VelocityMethod | Estimator, positions: ArrayLike, period: float) -> Floats:
    """The velocities that a method estimates, sample by sample, from positions.

    A linear one starts at rest at the first position, as if it had always been there.

    method     a velocity estimator; or the factors of a linear one at this period
    positions  (..., N)  one after the other, T apart [m]
    period     T [s]
    Returns    (..., N)  [m/s]; the first is 0
    Raises     ValueError  for positions that are no series or not finite, for a period that is not positive
               TypeError   for a method of another type

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
    """Fill in velocities (N,) [m/s] at positions (N,) [m], by `foaw_estimate`."""
    for j in range(positions.size):
        velocities[j] = foaw_estimate(memory, parameters, positions[j], period)


@compiled
def _run_levant(memory: Floats, parameters: Floats, period: float, positions: Floats, velocities: Floats) -> None:
    """Fill in velocities (N,) [m/s] at positions (N,) [m], by `levant_estimate`."""
    for j in range(positions.size):
        velocities[j] = levant_estimate(memory, parameters, positions[j], period)


@compiled
def _run_linear(
    numerator: Floats, denominator: Floats, window: Floats, positions: Floats, velocities: Floats
) -> None:
    """Fill in velocities (N,) [m/s] at positions (N,) [m]: the factors one behind the other, then the window.

    numerator, denominator, window  as of `Estimator`: rows of coefficients of d^2, d and 1, d = z - 1

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
