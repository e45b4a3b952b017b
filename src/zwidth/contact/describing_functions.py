"""Describing functions: complex gain of one nonlinearity each for a sine, at the sine's frequency.

For an input c + A sin(theta) and a nonlinearity f that gives no other output for rising than for falling input

    N(A, c) = 1/(pi A) Integral_0^2pi f(c + A sin theta) sin theta d theta,     real: it shifts no phase

(Gelb and Vander Velde 1968, ch. 2, whose table of it was seen; each function here is integrated from this
definition). A loop that passes little of the harmonics vibrates about as if f were a gain of N.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.compiled import compiled_lean


def _check_positive(**values: ArrayLike) -> None:
    """Raise ValueError, with its name, for the first value (...) that is not positive throughout; inf passes."""
    for name, value in values.items():
        if not np.all(np.asarray(value, dtype=float) > 0.0):
            raise ValueError(f"{name.replace('_', ' ')} must be positive, got {value!r}")


def _elementwise(gain: Callable[..., float], *values: ArrayLike) -> Floats:
    """Gains (...) of values (...), which are broadcast, by a compiled function of single numbers."""
    return np.asarray(np.vectorize(gain, otypes=[float])(*(np.asarray(value, dtype=float) for value in values)))


def quantiser(amplitude: ArrayLike, step: ArrayLike, offset: ArrayLike = 0.0) -> Floats:
    """Gain of an encoder that rounds to the nearest step:  step * round(x / step).

    The staircase rises by Delta at each threshold t = (k + 1/2) Delta. A sine crosses t upwards and downwards at
    sin theta = (t - c)/A, and such a step alone gives 2 Delta cos(theta)/(pi A), so that

        N(A, c) = 2 Delta/(pi A) sum over |t - c| < A of sqrt(1 - ((t - c)/A)^2)

    On a count, c = 0, it is 0 up to A = Delta/2 and nowhere above 4/pi, at A = Delta/sqrt 2. Centred between
    two counts, c = Delta/2, the encoder is a relay to small motions, 2 Delta/(pi A) without bound. It tends to 1.

    amplitude  (...)  A [m], positive
    step       (...)  Delta [m], not negative; 0: no steps, 1
    offset     (...)  c, the middle of the motion [m], a constant push's doing; only c modulo Delta matters
    Returns    (...)  N, all broadcast
    Raises     ValueError   for an amplitude that is not positive, a negative step

    >>> quantiser([0.4, 0.5**0.5, 100.0], 1.0).round(4).tolist(), float(quantiser(0.1, 1.0, 0.5).round(4))
    ([0.0, 1.2732, 1.0001], 6.3662)
    """
    A, step, c = np.broadcast_arrays(*(np.asarray(value, dtype=float) for value in (amplitude, step, offset)))
    _check_positive(amplitude=A)
    if not np.all(step >= 0.0):
        raise ValueError(f"step must not be negative, got {np.min(step)!r}")
    unit = np.where(step > 0.0, step, 1.0)
    return np.where(step > 0.0, _elementwise(quantiser_gain, A / unit, c / unit), 1.0)


# From here on the gain is 1 to 1e-6 (it swings about 1 like a^-3/2), and its sum longer than it is worth.
MANY_STEPS: Final = 1e4


@compiled_lean
def quantiser_gain(a: float, c: float) -> float:
    """N of `quantiser` for one amplitude `a` about the middle `c`, both in steps."""
    if a > MANY_STEPS:
        return 1.0
    c -= np.floor(c + 0.5)  # whole steps do not matter
    total = 0.0
    for k in range(int(np.floor(c - a)), int(np.ceil(c + a)) + 1):
        share = (k + 0.5 - c) / a  # sin theta at threshold k; beyond 1 the sine does not reach it
        total += np.sqrt(max(1.0 - share * share, 0.0))
    return float(2.0 / (np.pi * a) * total)


@compiled_lean
def damper_gain(coulomb: float, velocity_amplitude: float) -> float:
    """Viscous damping that takes as much of a vibration as dry friction does [N s/m].

        b = 4 C/(pi V)                 C sign v for v = V sin theta: 4 C/pi at the vibration's own frequency

    The energy of a cycle is the same: 4 C X of friction, pi b omega X^2 of the damper, X = V/omega. Motion without
    rests is assumed; a stuck phase in each cycle needs another function.

    coulomb  C [N];   velocity_amplitude  V [m/s], positive
    """
    return 4.0 * coulomb / (np.pi * velocity_amplitude)


def saturation(amplitude: ArrayLike, limit: ArrayLike) -> Floats:
    """Gain of a force that is cut off at +-limit, without a mean.

        N = (2/pi) (asin s + s sqrt(1 - s^2)),     s = limit/A;        1 for A <= limit

    amplitude  (...)  A of the commanded force [N], positive
    limit      (...)  [N], positive; inf: 1

    >>> saturation([1.0, 2.0, 100.0], 1.0).round(4).tolist()
    [1.0, 0.609, 0.0127]
    """
    _check_positive(amplitude=amplitude, limit=limit)
    return _elementwise(saturation_gain, amplitude, limit)


@compiled_lean
def saturation_gain(amplitude: float, limit: float) -> float:
    """Gain of one force of this amplitude [N] that is cut off at a limit [N], as `saturation`."""
    s = min(limit / amplitude, 1.0)
    return float(2.0 / np.pi * (np.arcsin(s) + s * np.sqrt(1.0 - s * s)))


@compiled_lean
def bent_spring_gain(amplitude: float, cubic: float, backward_excess: float, kink: float) -> float:
    """Stiffness that a bent spring has beyond its linear one, for a vibration about 0 [N/m].

        N = (3/4) cubic A^2 + backward_excess/pi (arccos c - c sqrt(1 - c^2)),    c = min(-kink/A, 1)

    amplitude        A of its deflection [m]
    cubic            [N/m³]
    backward_excess  what it is stiffer by for deflections below the kink [N/m]; they also push the mean, which is
                     left out
    kink             not positive [m]
    """
    share = 0.5  # of the excess: a kink at 0 stiffens half of the sine
    if kink < 0.0:
        c = min(-kink / amplitude, 1.0)
        share = (np.arccos(c) - c * np.sqrt(1.0 - c * c)) / np.pi
    return float(0.75 * cubic * amplitude * amplitude + share * backward_excess)
