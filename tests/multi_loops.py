"""Random loops of several directions, and their transition matrices built a second way."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from tests.systems import random_controller, random_plant, velocity_filter
from zwidth.loop import MultiLoop, WallMatrices
from zwidth.model import MultiPlant, Plant


def as_multi(plant: Plant) -> MultiPlant:
    return MultiPlant(plant.mass, plant.damping, plant.stiffness, plant.actuator[None], plant.sensor[None])


def side_by_side(*plants: Plant, turn=None) -> MultiPlant:
    """Plants that know nothing of each other, one direction each; turned, each direction is a mixture."""
    blocks = [scipy.linalg.block_diag(*(getattr(p, n) for p in plants)) for n in ("mass", "damping", "stiffness")]
    actuators = scipy.linalg.block_diag(*(p.actuator[None] for p in plants))
    turn = np.eye(len(plants)) if turn is None else turn
    return MultiPlant(*blocks, turn @ actuators, turn @ actuators)


def random_multi(seed):
    rng = np.random.default_rng(seed)
    m, kind = 2 + seed % 2, ("chain", "dense", "coupled")[seed % 3]
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    plant = random_plant(rng, rate, kind=kind)
    while plant.size < m:
        plant = random_plant(rng, rate, kind=kind)
    if rng.random() < 0.5:
        A = np.linalg.qr(rng.normal(size=(plant.size, plant.size)))[0][:m]
    else:
        A = rng.normal(size=(m, plant.size))
    return MultiLoop(
        MultiPlant(plant.mass, plant.damping, plant.stiffness, A, A.copy()), random_controller(rng, rate)
    )


def reference_matrix(loop, k, b):
    """The transition matrix of one wall, from physical states, queued forces and direct-form filters."""
    plant, controller, m = loop.plant, loop.controller, loop.plant.count
    law = WallMatrices(np.eye(m), np.eye(m)) if loop.matrices is None else loop.matrices
    T, n = controller.sampling_period, plant.size
    whole = int(np.floor(controller.delay + 1e-12))
    rest = controller.delay - whole
    A = np.zeros((2 * n + m, 2 * n + m))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n] = np.linalg.solve(plant.mass, np.hstack([-plant.stiffness, -plant.damping, plant.actuators.T]))

    def held(time):
        E = scipy.linalg.expm(A * time)
        return E[: 2 * n, : 2 * n], E[: 2 * n, 2 * n :]

    (F, _), (Fr, new), (_, early) = held(T), held((1.0 - rest) * T), held(rest * T)
    filters = velocity_filter(controller)
    queue = whole + 1
    N = 2 * n + m * (queue + 1 + 2 * len(filters))
    states = np.split(np.eye(N), np.arange(2 * n, N, m))
    x, forces, others = states[0], states[1 : 1 + queue], states[1 + queue :]
    y = plant.sensors @ x[:n]
    rows = [F @ x]
    v = (y - others[0]) / T
    updates = [y]
    for i, (b0, b1, b2, _, a1, a2) in enumerate(filters):
        s1, s2 = others[1 + 2 * i], others[2 + 2 * i]
        out = b0 * v + s1
        updates += [b1 * v - a1 * out + s2, b2 * v - a2 * out]
        v = out
    u = [-(k * law.stiffness @ y + b * law.damping @ v), *forces]
    rows[0] = rows[0] + new @ u[whole] + Fr @ early @ u[whole + 1]
    return np.vstack([*rows, *u[:-1], *updates])


def reference_radius(loop, walls):
    """Largest |z| of walls (k, 2); the matrix is affine in K and B."""
    at_rest = reference_matrix(loop, 0.0, 0.0)
    by_K, by_B = reference_matrix(loop, 1.0, 0.0) - at_rest, reference_matrix(loop, 0.0, 1.0) - at_rest
    K, B = walls.T[..., None, None]
    return np.abs(np.linalg.eigvals(at_rest + K * by_K + B * by_B)).max(axis=-1)


def random_law(rng, m):
    """Matrices K0 and B0 of every kind: alike and unlike along the directions, with zeros, of low rank, dense."""

    def one():
        X = rng.normal(size=(m, m))
        return (
            rng.uniform(0.0, 1.0, m),
            10.0 ** rng.uniform(-3.0, 0.0, m),
            np.ones(m),
            X @ X.T,
            X[:, :1] @ X[:, :1].T,
            np.eye(m)[rng.integers(m)],
            np.where(np.arange(m) == rng.integers(m), 0.0, rng.uniform(0.1, 1.0, m)),
        )[rng.integers(7)]

    return WallMatrices.of(one(), None if rng.random() < 0.15 else one(), m)


def random_unlike(seed):
    """A random loop under a random law."""
    loop = random_multi(seed)
    return MultiLoop(loop.plant, loop.controller, random_law(np.random.default_rng(7000 + seed), loop.plant.count))
