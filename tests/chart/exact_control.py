"""Transition matrices of loops in 40 digits: `tests/control_apart.py` played in decimal arithmetic.

In double precision the entries of a transition matrix are rounded, which parts two roots that meet at z = 1, as
those of a free motion do, by 1e-8 and more. Here sampling, filters and windows keep the sums that make a root
exactly 1: weights of a velocity estimate add up to nothing, filters pass a constant as it is.
"""

from __future__ import annotations

import mpmath
import numpy as np
from mpmath import mp

from tests.chart.exact_radii import DIGITS
from tests.control_apart import ControlledLoop
from zwidth.loop import (
    BackwardDifference,
    Butterworth,
    CentralDifference,
    FirstOrder,
    LeastSquaresSlope,
    SavitzkyGolay,
    WindowedDifference,
)


class DecimalArithmetic:
    """What a period is computed with, in the working precision of mpmath; arrays hold its numbers as objects."""

    def number(self, x):
        return mp.mpf(x)

    def array(self, x):
        x = np.asarray(x, dtype=float)
        return np.array([mp.mpf(one) for one in x.ravel().tolist()], dtype=object).reshape(x.shape)

    def sections(self, low_pass, T):
        """(b0, b1, b2, 1, a1, a2) of each section; a Butterworth filter by s = c (z - 1)/(z + 1) in its factors
        s^2 + 2 sin(pi (2 k + 1)/(2 n)) s + 1, and s + 1 where the order n is odd."""
        if low_pass is None:
            return []
        if isinstance(low_pass, FirstOrder):
            tau = mp.mpf(low_pass.time_constant)
            return [(T / (tau + T), 0, 0, 1, -tau / (tau + T), 0)]
        assert isinstance(low_pass, Butterworth)
        corner = 2 * mp.pi * mp.mpf(low_pass.cutoff_Hz)
        if low_pass.discretisation == "tustin-prewarped":
            corner = 2 / T * mp.tan(corner * T / 2)
        c, n = 2 / (T * corner), low_pass.order
        found = []
        for k in range(n // 2):
            damping = 2 * mp.sin(mp.pi * (2 * k + 1) / (2 * n)) * c
            a0 = c * c + damping + 1
            found.append((1 / a0, 2 / a0, 1 / a0, 1, (2 - 2 * c * c) / a0, (c * c - damping + 1) / a0))
        if n % 2:
            found.append((1 / (c + 1), 1 / (c + 1), 0, 1, (1 - c) / (c + 1), 0))
        return found

    def weights(self, method, T):
        """Weights of the readings, newest first, of the estimators that are a window; None for the others."""
        match method:
            case BackwardDifference():
                return [1 / T, -1 / T]
            case CentralDifference():
                return [1 / (2 * T), mp.mpf(0), -1 / (2 * T)]
            case WindowedDifference(n):
                return [1 / (n * T), *[mp.mpf(0)] * (n - 1), -1 / (n * T)]
            case LeastSquaresSlope(n):
                return fitted_slope(n, 1, mp.mpf(0), T)
            case SavitzkyGolay(n, order, centred):
                return fitted_slope(n, order, -mp.mpf(n - 1) / 2 * T if centred else mp.mpf(0), T)
        return None

    def held_step(self, plant, time, lag):
        """State transition and force response of the plant over `time`, with states as in `systems.generator`."""
        n, dampers = plant.size, plant.lagged_dampers
        m = 2 * n + len(dampers) + (lag > 0.0)
        inverse = np.array(mpmath.inverse(mp.matrix(plant.mass.tolist())).tolist(), dtype=object)
        A = np.array(mp.zeros(m + 1).tolist(), dtype=object)
        speeds = slice(n, 2 * n)
        for i in range(n):
            A[i, n + i] = mp.mpf(1)
        A[speeds, :n] = -inverse @ self.array(plant.stiffness)
        A[speeds, speeds] = -inverse @ self.array(plant.damping)
        for i, damper in enumerate(dampers):
            along, tau = self.array(damper.along), mp.mpf(damper.time_constant)
            A[speeds, 2 * n + i] = -inverse @ along
            A[2 * n + i, speeds] = mp.mpf(damper.damping) / tau * along
            A[2 * n + i, 2 * n + i] = -1 / tau
        force = inverse @ self.array(plant.actuator)
        if lag > 0.0:
            A[speeds, m - 1] = force
            A[m - 1, m - 1], A[m - 1, m] = -1 / mp.mpf(lag), 1 / mp.mpf(lag)
        else:
            A[speeds, m] = force
        E = np.array(mpmath.expm(mp.matrix((A * time).tolist())).tolist(), dtype=object)
        return E[:m, :m], E[:m, m]

    def solve(self, matrix, right):
        return np.array(mpmath.inverse(mp.matrix(matrix.tolist())).tolist(), dtype=object) @ right


def fitted_slope(n, order, at, T):
    """Weights, newest first, of the slope at the time `at` of the polynomial fitted to n readings at 0, -T, ..."""
    V = mp.matrix([[(-i * T - at) ** j for j in range(order + 1)] for i in range(n)])
    return list((mpmath.inverse(V.T * V) * V.T)[1, :])


def exact_matrices(loop):
    """A function of K and B that returns the transition matrix of a loop in 40 digits, an mpmath matrix.

    loop  a `ControlledLoop`, or a plain `Loop`
    """
    case = loop if isinstance(loop, ControlledLoop) else ControlledLoop(loop.plant, None, loop.controller)
    arithmetic = DecimalArithmetic()
    with mp.workdps(DIGITS):
        L0 = case.transition_matrix(mp.mpf(0), mp.mpf(0), arithmetic)
        LK = case.transition_matrix(mp.mpf(1), mp.mpf(0), arithmetic) - L0
        LB = case.transition_matrix(mp.mpf(0), mp.mpf(1), arithmetic) - L0

    def matrix(K, B):
        with mp.workdps(DIGITS):
            return mp.matrix((L0 + mp.mpf(K) * LK + mp.mpf(B) * LB).tolist())

    return matrix
