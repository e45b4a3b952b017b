"""The chart as a competent user would make it without zwidth: by eigenvalues, by python-control, by Jury's test.

All three rasterise walls; each says of every wall whether it is stable.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from zwidth.model.plant import Plant


def held_force_step(plant: Plant, period: float):
    """Transition matrix (2n, 2n) and input (2n,) of [x, v] over one period of a held force."""
    from scipy.linalg import expm

    n = plant.size
    A = np.zeros((2 * n + 1, 2 * n + 1))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -np.linalg.solve(plant.mass, plant.stiffness)
    A[n : 2 * n, n : 2 * n] = -np.linalg.solve(plant.mass, plant.damping)
    A[n : 2 * n, -1] = np.linalg.solve(plant.mass, plant.actuator)
    step = expm(A * period)
    return step[:-1, :-1], step[:-1, -1]


def by_eigenvalues(plant: Plant, period: float, K, B, chunk: int = 50_000):
    """Stable or not (...) by the eigenvalues of stacked transition matrices.

    Z = [x, v, y_{j-1}]; the plant is discretised once, the walls enter the matrices by broadcasting.
    """
    n = plant.size
    free, push = held_force_step(plant, period)
    L0 = np.zeros((2 * n + 1, 2 * n + 1))
    L0[:-1, :-1] = free
    L0[-1, :n] = plant.sensor
    by_now, by_old = np.zeros_like(L0), np.zeros_like(L0)
    by_now[:-1, :n] = -np.outer(push, plant.sensor)
    by_old[:-1, -1] = push
    K, B = np.broadcast_arrays(K, B)
    stable = np.empty(K.size, dtype=bool)
    flat_K, rate = K.ravel(), B.ravel() / period
    for start in range(0, K.size, chunk):
        part = slice(start, start + chunk)
        now, old = (flat_K[part] + rate[part])[:, None, None], rate[part][:, None, None]
        stable[part] = np.abs(np.linalg.eigvals(L0 + now * by_now + old * by_old)).max(axis=1) < 1.0
    return stable.reshape(K.shape)


def by_python_control(plant: Plant, period: float, K, B, tuned: bool = False):
    """Stable or not (...), wall by wall: the sampled plant once, then a feedback and its poles per wall.

    tuned  False: the wall as its transfer function, K + B (z - 1)/(T z), as one writes it down
           True:  the wall in state space, worked out by hand, which spares python-control a conversion
    """
    import control

    n = plant.size
    Minv = np.linalg.inv(plant.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-Minv @ plant.stiffness, -Minv @ plant.damping]])
    b = np.concatenate([np.zeros(n), Minv @ plant.actuator])[:, None]
    c = np.concatenate([plant.sensor, np.zeros(n)])[None, :]
    sampled = control.ss(A, b, c, 0.0).sample(period, method="zoh")
    K, B = np.broadcast_arrays(K, B)
    stable = np.empty(K.size, dtype=bool)
    for i, (k, d) in enumerate(zip(K.ravel(), B.ravel(), strict=True)):
        if tuned:
            # the state is the reading before: y = (K + B/T) u - (B/T) u_old
            wall = control.ss(0.0, 1.0, -d / period, k + d / period, period)
        else:
            wall = control.tf([k * period + d, -d], [period, 0.0], period)
        stable[i] = np.abs(control.feedback(sampled, wall).poles()).max() < 1.0
    return stable.reshape(K.shape)


def characteristic_polynomials(plant: Plant, period: float):
    """A, S, V of  p(z) = A(z) + K S(z) + B V(z), in falling powers of z, by three determinants' coefficients."""
    from scipy.signal import cont2discrete

    n = plant.size
    Minv = np.linalg.inv(plant.mass)
    F = np.block([[np.zeros((n, n)), np.eye(n)], [-Minv @ plant.stiffness, -Minv @ plant.damping]])
    g = np.concatenate([np.zeros(n), Minv @ plant.actuator])[:, None]
    c = np.concatenate([plant.sensor, np.zeros(n)])[None, :]
    Fd, gd, cd, *_ = cont2discrete((F, g, c, np.zeros((1, 1))), period)
    D = np.poly(Fd)
    N = np.poly(Fd - gd @ cd) - D
    A, S = np.append(D, 0.0), np.append(N, 0.0)
    V = np.convolve(N, [1.0, -1.0]) / period
    return A, S, V


@njit(parallel=True, error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def _raster(A, S, V, K, B):
    """A row per thread; within it the reduction runs over all walls at once, in place, so that it vectorises."""
    n, count = len(A), len(K)
    stable = np.empty((len(B), count), dtype=np.bool_)
    for i in prange(len(B)):
        p, good = np.empty((n, count)), stable[i]
        for k in range(n):
            base = A[k] + B[i] * V[k]
            for j in range(count):
                p[k, j] = base + K[j] * S[k]
        good[:] = True
        for m in range(n - 1, 0, -1):
            first, last = p[0], p[m]
            for j in range(count):
                good[j] &= abs(last[j]) < abs(first[j])
                last[j] /= first[j]
            # both ends of the polynomial at once; the last coefficient itself becomes zero and is not needed
            for j in range(count):
                first[j] *= 1.0 - last[j] * last[j]
            for k in range(1, m // 2 + 1):
                low, high = p[k], p[m - k]
                for j in range(count):
                    a, b = low[j], high[j]
                    low[j] = a - last[j] * b
                    high[j] = b - last[j] * a
    return stable


def by_jury(plant: Plant, period: float, K, B):
    """Stable or not (len B, len K) on a grid, by Jury's test compiled with numba, a row per thread."""
    return _raster(*characteristic_polynomials(plant, period), np.asarray(K, float), np.asarray(B, float))
