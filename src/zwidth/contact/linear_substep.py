"""The linear plant over one substep, exactly: what its states become, and what a held force adds.

States s = [x, x', forces of lagged dampers, actuator force if it lags]. Every force is held over a substep:

    s(t + h) = Phi(h) s(t) + sum_i Gamma_i(h) f_i,     Phi = exp(A h),  Gamma_i = integral of exp(A s) b_i

both by one exponential of the augmented matrix. The work of structural damping is a quadratic form of the states
and forces at the start of the substep (Van Loan 1978), so that the energy ledger is exact, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.plant import Plant


@dataclass(frozen=True)
class LinearDynamics:
    """s' = A s + sum_i b_i f_i, and how energy is kept and lost in it.

    generator  (N, N)  A
    inputs     (N, F)  b: the command first, then forces along the given motions
    size       n, coordinates, then n velocities
    energy     (N, N)  kinetic and elastic energy is s . energy s / 2
    loss       (N, N)  what dampers, and circulatory forces, take out per second is s . loss s
    drive      (N,)    the velocity at the actuator
    force      (N,)    the actuator's force from the states; zeros without lag, where it is the command itself
    """

    generator: Floats
    inputs: Floats
    size: int
    energy: Floats
    loss: Floats
    drive: Floats
    force: Floats


def dynamics(plant: Plant, lag: float, motions: Floats) -> LinearDynamics:
    """The plant's first-order form in its own coordinates.

    lag      time constant of the actuator [s]; 0: none
    motions  (k, n)  forces may act along each of them
    """
    n, dampers = plant.size, plant.lagged_dampers
    N = 2 * n + len(dampers) + (lag > 0.0)
    x, v = slice(0, n), slice(n, 2 * n)
    solved = np.linalg.solve(plant.mass, np.column_stack([plant.stiffness, plant.damping, plant.actuator]))
    A, inputs = np.zeros((N, N)), np.zeros((N, 1 + len(motions)))
    energy, loss = np.zeros((N, N)), np.zeros((N, N))
    drive, force = np.zeros(N), np.zeros(N)
    A[x, v] = np.eye(n)
    A[v, x], A[v, v] = -solved[:, :n], -solved[:, n : 2 * n]
    energy[x, x], energy[v, v], loss[v, v] = plant.stiffness, plant.mass, plant.damping
    if plant.circulatory is not None:
        A[v, x] -= np.linalg.solve(plant.mass, plant.circulatory)
        loss[v, x], loss[x, v] = 0.5 * plant.circulatory, 0.5 * plant.circulatory.T
    for i, damper in enumerate(dampers):
        at = 2 * n + i
        A[v, at] = -np.linalg.solve(plant.mass, damper.along)
        A[at, v] = damper.damping / damper.time_constant * damper.along
        A[at, at] = -1.0 / damper.time_constant
        energy[at, at] = damper.time_constant / damper.damping
        loss[at, at] = 1.0 / damper.damping
    drive[v] = plant.actuator
    if lag > 0.0:
        A[v, -1], A[-1, -1], inputs[-1, 0] = solved[:, -1], -1.0 / lag, 1.0 / lag
        force[-1] = 1.0
    else:
        inputs[v, 0] = solved[:, -1]
    if len(motions):
        inputs[v, 1:] = np.linalg.solve(plant.mass, motions.T)
    return LinearDynamics(A, inputs, n, energy, loss, drive, force)


@dataclass(frozen=True)
class Substep:
    """One substep.

    transition  (N, N)  Phi
    inputs      (N, F)  Gamma
    loss        (N + F, N + F)  what dampers take out over the substep is X . loss X, X = [s, f] at its start
    work        (N + F, N + F)  the same for what the actuator gives
    """

    transition: Floats
    inputs: Floats
    loss: Floats
    work: Floats


def substep(dynamics: LinearDynamics, h: float) -> Substep:
    """The substep of length h [s]; zero length gives the identity."""
    from scipy.linalg import expm

    N, F = dynamics.inputs.shape
    M = N + F
    # velocities in metres per substep, lagged dampers' forces by the energy they hold: couplings of one size both
    # ways, so that the exponential keeps its digits
    scale, held = np.ones(M), np.diag(dynamics.energy)[dynamics.size :]
    scale[dynamics.size : N] = np.where(held > 0.0, (h if h > 0.0 else 1.0) * np.sqrt(held), 1.0)
    augmented = np.zeros((M, M))
    augmented[:N, :N], augmented[:N, N:] = dynamics.generator * h, dynamics.inputs * h
    E = expm(augmented * scale[:, None] / scale) / scale[:, None] * scale
    loss, work = np.zeros((M, M)), np.zeros((M, M))
    loss[:N, :N] = dynamics.loss
    force = np.concatenate([dynamics.force, np.eye(1, F)[0] * (not dynamics.force.any())])
    drive = np.concatenate([dynamics.drive, np.zeros(F)])
    work[:] = 0.5 * (np.outer(force, drive) + np.outer(drive, force))
    forms = [
        _gathered(augmented * scale[:, None] / scale, form * h / scale[:, None] / scale) for form in (loss, work)
    ]
    loss, work = (form * scale[:, None] * scale for form in forms)
    return Substep(E[:N, :N], E[:N, N:], loss, work)


def _gathered(A: Floats, Q: Floats) -> Floats:
    """integral from 0 to 1 of exp(A^T s) Q exp(A s).

    Over a short stretch by the exponential of [[-A^T, Q], [0, A]], then doubled,
    G(2 t) = G(t) + exp(A^T t) G(t) exp(A t); at once, fast decays would overflow.
    """
    from scipy.linalg import expm

    M = len(A)
    doublings = max(0, int(np.ceil(np.log2(max(float(np.linalg.norm(A, 1)), 1e-300)))))
    block = np.zeros((2 * M, 2 * M))
    block[:M, :M], block[:M, M:], block[M:, M:] = -A.T, Q, A
    E = expm(block / 2.0**doublings)
    step = E[M:, M:]
    gathered = step.T @ E[:M, M:]
    for _ in range(doublings):
        gathered, step = gathered + step.T @ gathered @ step, step @ step
    return np.asarray((gathered + gathered.T) / 2.0)
