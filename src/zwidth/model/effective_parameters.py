"""Effective masses and stiffness of a mechanism along one direction at the handle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from zwidth.compiled import compiled
from zwidth.model.mechanism import Floats, Ints, Mechanism
from zwidth.model.mechanism_arrays import design_of_each, per_design
from zwidth.model.posture import Posture


@dataclass(frozen=True)
class EffectiveParameters:
    """Along one direction u, with h = J^T u; all with the leading axes of posture and direction, nan where not OK.

    link_side_mass   (...)  1 / (h^T M_phi^-1 h): links with the drives cut          (thesis eq. 2.28) [kg]
    motor_side_mass  (...)  1 / (h^T M_theta^-1 h): rotors with the drives cut       (thesis eq. 2.28) [kg]
    rigid_mass       (...)  1 / (h^T (M_phi + M_theta)^-1 h): links and rotors, drives rigid [kg]
    stiffness        (...)  1 / (h^T K^-1 h), inf with rigid drives                  (thesis eq. 2.34) [N/m]

    A direction in which the handle cannot move has h = 0: all four are inf.
    """

    link_side_mass: Floats
    motor_side_mass: Floats
    rigid_mass: Floats
    stiffness: Floats


def effective_parameters(mechanism: Mechanism, posture: Posture, direction: ArrayLike) -> EffectiveParameters:
    """Effective masses and stiffness of a mechanism along a direction.

    direction  (..., 3)  unit vectors in the base frame, broadcasting with the posture
    Raises     ValueError  if a direction is not of unit length
    """
    u = unit_directions(direction)
    drives = mechanism.drives
    ratio = per_design(mechanism, drives.transmission, 1)
    rotor = ratio**2 * per_design(mechanism, drives.motor_inertia, 1)
    spring = ratio**2 * per_design(mechanism, drives.stiffness, 1)
    shape = np.broadcast_shapes(posture.status.shape, u.shape[:-1])
    design = design_of_each(mechanism, shape)
    d = rotor.shape[1]
    M = np.array(np.broadcast_to(posture.mass_matrix, (*shape, d, d)).reshape(-1, d, d), order="C")
    J = np.array(np.broadcast_to(posture.jacobian, (*shape, 3, d)).reshape(-1, 3, d), order="C")
    along = np.array(np.broadcast_to(u, (*shape, 3)).reshape(-1, 3), order="C")
    out = np.empty((4, len(M)))
    _effective_batch(design, M, J, along, np.ascontiguousarray(rotor), np.ascontiguousarray(spring), out)
    return EffectiveParameters(*(row.reshape(shape) for row in out))


def unit_direction(direction: ArrayLike) -> Floats:
    """The direction as an array (3,), checked to be of unit length."""
    u = unit_directions(direction)
    if u.shape != (3,):
        raise ValueError(f"a rendered direction has three components, got an array of shape {u.shape}")
    return u


def unit_directions(directions: ArrayLike) -> Floats:
    """Directions as an array (..., 3), each checked to be of unit length."""
    u = np.asarray(directions, dtype=np.float64)
    if u.ndim == 0 or u.shape[-1] != 3:
        raise ValueError(f"a rendered direction has three components, got an array of shape {u.shape}")
    length = np.linalg.norm(u, axis=-1)
    wrong = np.argwhere(~(np.abs(length - 1.0) <= 1e-9))
    if len(wrong):
        first, size = u[tuple(wrong[0])].tolist(), float(length[tuple(wrong[0])])
        if not size > 0.0:
            raise ValueError(f"the rendered direction {first} has no length; give it at least one component")
        raise ValueError(f"the rendered direction {first} has length {size:.6g}; divide it by its length")
    return u


@compiled
def inverse_form(A: Floats, h: Floats, d: int) -> float:
    """h^T A^-1 h of a symmetric positive definite A (d, d), by Cholesky; both are overwritten."""
    total = 0.0
    for j in range(d):
        pivot = A[j, j]
        total += h[j] * h[j] / pivot
        for i in range(j + 1, d):
            factor = A[i, j] / pivot
            h[i] -= factor * h[j]
            for c in range(j + 1, i + 1):
                A[i, c] -= factor * A[c, j]
    return total


@compiled
def _effective_batch(
    design: Ints, M: Floats, J: Floats, u: Floats, rotor: Floats, spring: Floats, out: Floats
) -> None:
    """The four numbers of `EffectiveParameters` for each posture, out (4, N)."""
    d = rotor.shape[1]
    h, left, A = np.zeros(d), np.zeros(d), np.zeros((d, d))
    for i in range(design.size):
        p = design[i]
        motor, compliance = 0.0, 0.0
        for s in range(d):
            h[s] = u[i, 0] * J[i, 0, s] + u[i, 1] * J[i, 1, s] + u[i, 2] * J[i, 2, s]
            motor += h[s] * h[s] / rotor[p, s]
            compliance += h[s] * h[s] / spring[p, s]
        for both in range(2):
            for s in range(d):
                left[s] = h[s]
                for t in range(d):
                    A[s, t] = M[i, s, t]
                if both == 1:
                    A[s, s] += rotor[p, s]
            out[2 * both, i] = 1.0 / inverse_form(A, left, d)
        out[1, i] = 1.0 / motor
        out[3, i] = 1.0 / compliance
