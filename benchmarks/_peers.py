"""The chart as a competent user would make it without zwidth: by eigenvalues, by python-control, by Jury's test.

The first three rasterise walls; each says of every wall whether it is stable. The last looks for the stiffest wall
of many plants, by eigenvalues.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from zwidth.model import Plant


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


# The raster of walls from which the stiffest is climbed to: stiffnesses [N/m] and dampings [N s/m].
STIFFNESSES = np.geomspace(1e-3, 1e10, 53)
DAMPINGS = np.concatenate([[0.0], np.geomspace(1e-4, 1e6, 81)])
ROW = 49  # dampings at each stiffness on the way up
LAST_STEP = 1e-9  # of K
LARGEST_STACK = 200_000  # matrices in one call of NumPy


class SampledPlants(NamedTuple):
    """D plants of n coordinates under a held force, over one period of each.

    free    (D, 2n, 2n)  transition matrix of [x, v]
    push    (D, 2n)      what a force of 1 N adds
    sensor  (D, n)       displacement of the handle by the coordinates
    period  (D,)         [s]
    """

    free: np.ndarray
    push: np.ndarray
    sensor: np.ndarray
    period: np.ndarray


def observed_part(plant: Plant) -> Plant:
    """The plant without rigid motions that the sensor does not see and the force does not move.

    Each of these, motions along the wall, is a double root z = 1 whatever the wall, which rounding splits by 1e-8.
    """
    from scipy.linalg import null_space

    rigid = null_space(plant.stiffness, rcond=1e-10)
    unseen = rigid @ null_space((plant.sensor @ rigid)[None, :], rcond=1e-9)
    if not unseen.size:
        return plant
    small = 1e-9 * np.linalg.norm(unseen)
    assert np.linalg.norm(plant.damping @ unseen) <= small * max(1.0, np.linalg.norm(plant.damping))
    assert np.linalg.norm(plant.actuator @ unseen) <= small * np.linalg.norm(plant.actuator)
    others = null_space((plant.mass @ unseen).T)
    forms = (others.T @ form @ others for form in (plant.mass, plant.damping, plant.stiffness))
    return Plant(*forms, others.T @ plant.actuator, others.T @ plant.sensor)


def sampled_plants(plants: Sequence[tuple[Plant, float]]) -> SampledPlants:
    """Plants of as many coordinates each, with their sampling periods [s], discretised in one call of SciPy."""
    from scipy.linalg import expm

    mass, damping, stiffness, actuator, sensor = (
        np.array([getattr(plant, name) for plant, _ in plants])
        for name in ("mass", "damping", "stiffness", "actuator", "sensor")
    )
    period = np.array([T for _, T in plants])
    n = mass.shape[-1]
    A = np.zeros((len(plants), 2 * n + 1, 2 * n + 1))
    A[:, :n, n : 2 * n] = np.eye(n)
    A[:, n : 2 * n, :n] = -np.linalg.solve(mass, stiffness)
    A[:, n : 2 * n, n : 2 * n] = -np.linalg.solve(mass, damping)
    A[:, n : 2 * n, -1] = np.linalg.solve(mass, actuator[..., None])[..., 0]
    step = expm(A * period[:, None, None])
    return SampledPlants(step[:, :-1, :-1], step[:, :-1, -1], sensor, period)


def stable_walls(plants: SampledPlants, K: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Stable or not (D, ...) by eigenvalues of stacked transition matrices, for walls (D, ...) of each plant."""
    D, n = plants.sensor.shape
    K, B, _ = np.broadcast_arrays(K, B, plants.period.reshape(D, *(1,) * (np.ndim(K) - 1)))
    walls = (K.reshape(D, -1), B.reshape(D, -1))
    stable = np.empty(walls[0].shape, dtype=bool)
    several = max(1, LARGEST_STACK // walls[0].shape[1])
    for first in range(0, D, several):
        part = slice(first, first + several)
        free, push, sensor, period = (array[part] for array in plants)
        rate = walls[1][part] / period[:, None]
        L = np.zeros((*rate.shape, 2 * n + 1, 2 * n + 1))
        L[..., :-1, :-1] = free[:, None]
        L[..., :-1, :n] -= (walls[0][part] + rate)[..., None, None] * (push[:, :, None] * sensor[:, None, :])[
            :, None
        ]
        L[..., :-1, -1] = rate[..., None] * push[:, None]
        L[..., -1, :n] = sensor[:, None]
        stable[part] = np.abs(np.linalg.eigvals(L)).max(axis=-1) < 1.0
    return stable.reshape(K.shape)


def stiffest_by_eigenvalues(plants: SampledPlants) -> np.ndarray:
    """The largest stable K (D,) with a damping B >= 0; 0 where no wall of the raster is stable.

    From the stiffest stable wall of a raster `climb` goes on.
    """
    inside = stable_walls(plants, STIFFNESSES[None, :, None], DAMPINGS[None, None, :])
    top = len(STIFFNESSES) - 1 - np.argmax(inside[:, ::-1].any(axis=2), axis=1)
    row = inside[np.arange(len(top)), top]
    first, last = np.argmax(row, axis=1), len(DAMPINGS) - 1 - np.argmax(row[:, ::-1], axis=1)
    low, high = DAMPINGS[np.maximum(first - 1, 0)], DAMPINGS[np.minimum(last + 1, len(DAMPINGS) - 1)]
    K = climb(plants, STIFFNESSES[top], low, high)
    return np.where(inside.any(axis=(1, 2)), K, 0.0)


def stiffest_near(plants: SampledPlants, K: np.ndarray, B: np.ndarray, below: float = 1e-3) -> np.ndarray:
    """The largest stable stiffness (D,) that `climb` reaches from the stable walls at (1 - below) K about B.

    They may be few, where a region ends in a thin tip; nan where none is found.
    """
    away = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 600)])
    shares = np.unique(np.concatenate([1.0 - away, 1.0 + away]))
    start = (1.0 - below) * K
    row = B[:, None] * shares
    inside = stable_walls(plants, start[:, None], row)
    first, last = np.argmax(inside, axis=1), len(shares) - 1 - np.argmax(inside[:, ::-1], axis=1)
    one = np.arange(len(K))
    low, high = row[one, np.maximum(first - 1, 0)], row[one, np.minimum(last + 1, len(shares) - 1)]
    return np.where(inside.any(axis=1), climb(plants, start, low, high), np.nan)


def climb(plants: SampledPlants, K: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The stiffest wall (D,) reached from stable ones with stiffness K and dampings between low and high.

    K is raised while a row of dampings about those of the last stable walls has a stable one. Bisection of K at
    one damping would not do: a region may end in a thin tip that leans, so that walls just below it are unstable.
    """
    K, low, high = K.copy(), low.copy(), high.copy()
    step = np.full(len(K), 0.25)
    one = np.arange(len(K))
    while step.max() > LAST_STEP:
        width = high - low
        start = np.maximum(low - 3.0 * width, 0.0)
        row = start[:, None] + (high + 3.0 * width - start)[:, None] * np.linspace(0.0, 1.0, ROW)
        inside = stable_walls(plants, ((1.0 + step) * K)[:, None], row)
        rises = inside.any(axis=1)
        first, last = np.argmax(inside, axis=1), ROW - 1 - np.argmax(inside[:, ::-1], axis=1)
        K = np.where(rises, (1.0 + step) * K, K)
        low = np.where(rises, row[one, np.maximum(first - 1, 0)], low)
        high = np.where(rises, row[one, np.minimum(last + 1, ROW - 1)], high)
        step *= np.where(rises, 1.5, 0.5)
    return K
