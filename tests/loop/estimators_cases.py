"""Velocity estimators of every kind, and their factors multiplied out."""

import numpy as np

from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    CentralDifference,
    Kalman,
    LeastSquaresSlope,
    SavitzkyGolay,
    WindowedDifference,
)

METHODS = (
    BackwardDifference(),
    WindowedDifference(1),
    WindowedDifference(7),
    LeastSquaresSlope(2),
    LeastSquaresSlope(9),
    CentralDifference(),
    SavitzkyGolay(3, 1),
    SavitzkyGolay(4, 3),
    SavitzkyGolay(12, 2),
    SavitzkyGolay(25, 4),
    SavitzkyGolay(9, 4, centred=True),
    SavitzkyGolay(8, 2, centred=True),
    AlphaBeta(0.36, 0.08),
    AlphaBeta(1.3, 1.2),
    AlphaBeta(0.02, 0.5),
    Kalman(10.0, 1e-6),
    Kalman(300.0, 3e-6),
    Kalman(0.5, 1e-4),
)
PERIODS = (0.005, 0.001, 0.00005)


def random_method(rng, period, longest=30):
    """A method with random parameters, for this sampling period."""
    pick = int(rng.integers(7))
    n = int(rng.integers(2, longest + 1))
    if pick == 0:
        return BackwardDifference()
    if pick == 1:
        return WindowedDifference(n - 1)
    if pick == 2:
        return LeastSquaresSlope(n)
    if pick == 3:
        return CentralDifference()
    if pick == 4:
        return SavitzkyGolay(n, int(rng.integers(1, min(n, 5))), bool(rng.integers(2)))
    if pick == 5:
        alpha = rng.uniform(0.05, 1.9)
        return AlphaBeta(alpha, rng.uniform(0.02, 0.95) * (4.0 - 2.0 * alpha))
    noise = 10.0 ** rng.uniform(-7.0, -4.0)
    return Kalman(10.0 ** rng.uniform(-3.0, 2.5) * noise / period**2, noise)


def polynomials(estimator):
    """Numerator and denominator of w(z) in falling powers of z, of one length."""
    shift = np.poly1d([1.0, -1.0])
    top, bottom = np.poly1d(estimator.window), np.poly1d([1.0])
    for row in estimator.numerator:
        top = top * np.poly1d(row)(shift)
    for row in estimator.denominator:
        bottom = bottom * np.poly1d(row)(shift)
    bottom = bottom * np.poly1d([1.0] + [0.0] * (estimator.window.size - 1))
    length = max(top.coeffs.size, bottom.coeffs.size)
    return tuple(np.pad(p.coeffs, (length - p.coeffs.size, 0)) for p in (top, bottom))
