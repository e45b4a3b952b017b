"""Spectral radii in 40 digits of transition matrices built apart."""

from __future__ import annotations

import mpmath
import numpy as np
import scipy.linalg
from mpmath import mp

from tests.systems import velocity_filter
from zwidth.loop import WallMatrices

DIGITS = 40
STEPS = 8  # of inverse iteration with one decomposition
DECOMPOSITIONS = 4
SETTLED = 1e-30  # change of a root in a step
# Roots closer than this are judged by their mean, which a wall's last digits do not move; them they part by 1e-6.
TOGETHER = 1e-5
NOTHING = 1e-12  # share of a chart's size below which a stiffness or damping is 0 but for rounding


def joined_excess(z):
    """Largest |z| - 1 (k,) of roots (k, N), where the largest and a neighbour within TOGETHER are their mean."""
    rows = np.arange(len(z))
    top = np.argmax(np.abs(z), axis=-1)
    apart = np.abs(z - z[rows, top][:, None])
    apart[rows, top] = np.inf
    other = np.argmin(apart, axis=-1)
    near = apart[rows, other] <= TOGETHER
    mean = (z[rows, top] + z[rows, other]) / 2.0
    joined = z.astype(complex)
    joined[rows[near], top[near]] = joined[rows[near], other[near]] = mean[near]
    return np.abs(joined).max(axis=-1) - 1.0


def exact_joined_excess(L):
    """`joined_excess` of an mpmath matrix, its roots in 40 digits."""
    with mp.workdps(DIGITS):
        roots = mpmath.eig(L, left=False, right=False)
    return float(joined_excess(np.array([[complex(root) for root in roots]]))[0])


def walls_beside_origin(walls):
    """Whether walls (k, 2) are K = B = 0 but for a chart's last digits; free motions have a double root there."""
    return np.all(np.abs(walls) <= NOTHING * np.abs(walls).max(axis=0), axis=1)


def is_off(excess, wall, size, band):
    """Whether the largest root of a wall is off the circle, and on the same side for those beside it that a chart
    of its size in double precision does not tell from it.

    excess  |z| - 1 of the largest root, by K and B
    wall, size  (2,)  [K, B], and the largest of a chart
    band    how far off counts
    """
    here = excess(*wall)
    if abs(here) <= band:
        return False
    steps = NOTHING * np.diag(size)
    beside = [excess(*(wall + sign * step)) for step in steps for sign in (1.0, -1.0)]
    return all(np.sign(one) == np.sign(here) for one in beside)


def exact_matrix(loop, k, b):
    """`multi_loops.reference_matrix` with 40 digits in sampling and in all sums."""
    plant, controller, m = loop.plant, loop.controller, loop.plant.count
    law = WallMatrices(np.eye(m), np.eye(m)) if loop.matrices is None else loop.matrices
    n = plant.size
    T, delay = mp.mpf(controller.sampling_period), mp.mpf(controller.delay)
    whole = int(np.floor(controller.delay + 1e-12))
    rest = max(delay - whole, mp.mpf(0))
    inverse = mpmath.inverse(mp.matrix(plant.mass.tolist()))
    A = mp.zeros(2 * n + m)
    A[:n, n : 2 * n] = mp.eye(n)
    A[n : 2 * n, :n] = -inverse * mp.matrix(plant.stiffness.tolist())
    A[n : 2 * n, n : 2 * n] = -inverse * mp.matrix(plant.damping.tolist())
    A[n : 2 * n, 2 * n :] = inverse * mp.matrix(plant.actuators.T.tolist())

    def held(time):
        E = mpmath.expm(A * time)
        return E[: 2 * n, : 2 * n], E[: 2 * n, 2 * n :]

    (F, _), (Fr, new), (_, early) = held(T), held((1 - rest) * T), held(rest * T)
    filters = [[mp.mpf(float(c)) for c in section] for section in velocity_filter(controller)]
    queue = whole + 1
    N = 2 * n + m * (queue + 1 + 2 * len(filters))
    one = mp.eye(N)

    def states(first, count):
        return one[first : first + count, :]

    x = states(0, 2 * n)
    forces = [states(2 * n + m * i, m) for i in range(queue)]
    others = [states(2 * n + m * (queue + i), m) for i in range(1 + 2 * len(filters))]
    y = mp.matrix(plant.sensors.tolist()) * x[:n, :]
    v, updates = (y - others[0]) / T, [y]
    for i, (b0, b1, b2, _, a1, a2) in enumerate(filters):
        s1, s2 = others[1 + 2 * i], others[2 + 2 * i]
        out = b0 * v + s1
        updates += [b1 * v - a1 * out + s2, b2 * v - a2 * out]
        v = out
    stiffness, damping = (mp.matrix(X.tolist()) for X in (law.stiffness, law.damping))
    u = [-(mp.mpf(float(k)) * stiffness * y + mp.mpf(float(b)) * damping * v), *forces]
    rows = [F * x + new * u[whole] + Fr * (early * u[whole + 1]), *u[:-1], *updates]
    return mp.matrix([row for part in rows for row in part.tolist()])


def exact_radius(matrix_of, near=1e-4):
    """Largest |z| of roots within `near` of the largest, in 40 digits, of the matrix that `matrix_of()` builds."""
    with mp.workdps(DIGITS):
        L = matrix_of()
        N = L.rows
        plain = np.array(L.tolist(), dtype=float)
        z, right = scipy.linalg.eig(plain)
        largest = mp.mpf(0)
        for k in np.flatnonzero((np.abs(z) > np.abs(z).max() - near) & (z.imag >= 0.0)):
            root, x = mp.mpc(complex(z[k])), mp.matrix(right[:, k].tolist())
            # decomposing takes nearly all the time: steps share it, and it is done anew for roots that coalesce
            for _ in range(DECOMPOSITIONS):
                try:
                    parts, order = mp.LU_decomp(L - root * mp.eye(N))
                except ZeroDivisionError:  # it is a root
                    break
                shift, change = root, mp.inf
                for _ in range(STEPS):
                    step = mp.U_solve(parts, mp.L_solve(parts, x, order))
                    gain = sum(mp.conj(a) * c for a, c in zip(x, step, strict=True))
                    moved = shift + sum(mp.conj(a) * a for a in x) / gain
                    change, root, x = abs(moved - root), moved, step / mpmath.norm(step)
                    if change < SETTLED:
                        break
                if change < SETTLED:
                    break
            largest = max(largest, abs(root))
        return float(largest - 1)
