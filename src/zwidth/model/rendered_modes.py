"""The modes that a rendered direction meets, for many postures of a mechanism at once.

Of the full model [phi; theta] with flexible drives F, relative to the joints n^2 k and n^2 I, let M be the links'
mass matrix with the rotors of rigid drives. The deflections d = phi_F - theta obey d'' = -(E^T M^-1 E + I^-1) k d,
a symmetric eigenproblem of the size of F alone:

    S = k^1/2 (E^T M^-1 E + I^-1) k^1/2,      S e = w^2 e

with the mass-normalised shapes v_phi = -M^-1 E k^1/2 e / w and v_theta = I^-1 k^1/2 e / w. All motions in which no
drive deflects are free and act as one, of the mass 1/(h^T (M_phi + M_theta)^-1 h). So nothing of the size of the
whole plant is ever decomposed; `reduction` and `modes` say the same of one posture, for any damping.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled, compiled_lean
from zwidth.model.damping import Damping, ModalDamping, ProportionalDamping
from zwidth.model.effective_parameters import EffectiveParameters, effective_parameters, inverse_form
from zwidth.model.mechanism import Drives, Mechanism
from zwidth.model.posture import Posture
from zwidth.model.reduction import Encoders, Model

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RenderedModes:
    """Modes xi'' + 2 a xi' + w^2 xi = input f,  y = sum output xi, as in `modes.RealModes`; N postures, m modes.

    decay              (N, m)  a [1/s]
    frequency_squared  (N, m)  w^2 [1/s^2]; 0 for the free motion
    input, output  (N, m)  [kg^-1/2]; nan where a posture is not OK or the handle cannot move along the direction
    """

    decay: Floats
    frequency_squared: Floats
    input: Floats
    output: Floats


def rendered_modes(
    mechanism: Mechanism,
    posture: Posture,
    direction: Floats,
    model: Model,
    damping: Damping,
    encoders: Encoders = "motor",
) -> RenderedModes | None:
    """The modes of each posture's model along its direction; None where they are not such modes.

    posture    (...), flattened to N
    direction  (..., 3)  unit vectors
    Returns    None for a batch of designs, windings closed through resistors, given dampers that couple the modes,
               and readings behind the drives in a reduced model
    """
    drives = mechanism.drives
    if drives.transmission.ndim > 1 or (drives.winding_damping is not None and drives.winding_damping.any()):
        return None
    # B = r_m M + r_k K and a ratio on every flexible mode: a = (r_m + r_k w^2)/2 + ratio w
    coefficients = _coefficients(drives, damping)
    if coefficients is None:
        return None
    if model == "full":
        return _of_full(drives, posture, direction, coefficients, encoders)
    numbers = effective_parameters(mechanism, posture, direction)
    if encoders != "motor" or (model != "rigid" and not np.isfinite(drives.stiffness).any()):
        return None
    return _of_reduced(numbers, model, coefficients)


def _coefficients(drives: Drives, damping: Damping) -> tuple[float, float, float] | None:
    if isinstance(damping, ModalDamping):
        return 0.0, 0.0, damping.ratio
    if isinstance(damping, ProportionalDamping):
        return damping.mass_coefficient_1_per_s, damping.stiffness_coefficient_s, 0.0
    flexible = np.isfinite(drives.stiffness)
    share = drives.damping[flexible] / drives.stiffness[flexible]
    if len(share) == 0 or np.all(share == share[0]):
        return 0.0, float(share[0]) if len(share) else 0.0, 0.0
    return None


def _of_reduced(
    numbers: EffectiveParameters, model: Model, coefficients: tuple[float, float, float]
) -> RenderedModes:
    """Of masses and a spring: with the pair's reduced mass mu, w^2 = k/mu.

    The two masses' own ratio is that of their mode; the motor mass keeps the damper of the pair (`reduction`)."""
    r_m, r_k, ratio = coefficients
    m1, m2 = numbers.link_side_mass.ravel(), numbers.motor_side_mass.ravel()
    k, mass = numbers.stiffness.ravel(), numbers.rigid_mass.ravel()
    if model == "rigid":
        modes = [(0.5 * r_m + 0.0 * mass, 0.0 * mass, 1.0 / np.sqrt(mass))]
    else:
        mu = 1.0 / (1.0 / m1 + 1.0 / m2)
        own = 2.0 * ratio * np.sqrt(k * mu) + r_k * k  # the damper between them
        if model == "motor-mass":
            modes = [(0.5 * (r_m + own / m2), k / m2, 1.0 / np.sqrt(m2))]
        else:
            free = 1.0 / np.sqrt(m1 + m2)
            modes = [
                (0.5 * r_m + 0.0 * m1, 0.0 * m1, free),
                (0.5 * (r_m + own / mu), k / mu, np.sqrt(mu) / m2),
            ]
    decay, squared, participation = (np.stack(part, axis=-1) for part in zip(*modes, strict=True))
    participation = np.where(np.isfinite(participation) & np.isfinite(squared), participation, np.nan)
    return RenderedModes(decay, squared, participation, participation)


def _of_full(
    drives: Drives,
    posture: Posture,
    direction: Floats,
    coefficients: tuple[float, float, float],
    encoders: Encoders,
) -> RenderedModes:
    n2 = drives.transmission**2
    rotor, spring = n2 * drives.motor_inertia, n2 * drives.stiffness
    shape, d = posture.status.shape, len(rotor)
    h = np.einsum("...i,...id->...d", direction, posture.jacobian)
    N, m = int(np.prod(shape)), int(np.isfinite(spring).sum()) + 1
    squared, enter, leave = np.empty((N, m)), np.empty((N, m)), np.empty((N, m))
    mass = np.ascontiguousarray(posture.mass_matrix).reshape(N, d, d)
    _full_modes(mass, h.reshape(N, d), rotor, spring, encoders == "motor", squared, enter, leave)
    r_m, r_k, ratio = coefficients
    decay = 0.5 * (r_m + r_k * squared) + ratio * np.sqrt(squared)
    return RenderedModes(decay, squared, enter, leave)


@compiled
def _full_modes(
    mass: Floats,
    along: Floats,
    rotor: Floats,
    spring: Floats,
    at_motor: bool,
    squared: Floats,
    enter: Floats,
    leave: Floats,
) -> None:
    """The flexible modes of each posture and, last, the free motion; nan where no number comes out."""
    N, d = along.shape
    flexible = np.flatnonzero(np.isfinite(spring))
    f = len(flexible)
    M, inverse, S, V = np.empty((d, d)), np.empty((d, d)), np.empty((f, f)), np.empty((f, f))
    h, shape = np.empty(d), np.empty(d)
    for i in range(N):
        for s in range(d):
            h[s] = along[i, s]
            for t in range(d):
                M[s, t] = mass[i, s, t]
            M[s, s] += rotor[s]
        # all drives rigid: links and rotors together move as one free mass
        free = inverse_form(M, h, d)
        for s in range(d):
            for t in range(d):
                M[s, t] = mass[i, s, t]
            # rotors behind rigid drives move with the links; the others are coordinates of their own
            M[s, s] += 0.0 if np.isfinite(spring[s]) else rotor[s]
        invert(M, inverse)
        for a in range(f):
            p = flexible[a]
            for b in range(f):
                q = flexible[b]
                # the deflections' equation in units that make it symmetric: S = sqrt(K) (M^-1 + rotors^-1) sqrt(K)
                S[a, b] = np.sqrt(spring[p] * spring[q]) * inverse[p, q]
            S[a, a] += spring[p] / rotor[p]
        jacobi(S, V)
        for k in range(f):
            w = np.sqrt(S[k, k])
            moved, read = 0.0, 0.0
            for s in range(d):
                shape[s] = 0.0
                for a in range(f):
                    shape[s] -= inverse[s, flexible[a]] * np.sqrt(spring[flexible[a]]) * V[a, k] / w
            for s in range(d):
                read += along[i, s] * shape[s]
                if not np.isfinite(spring[s]):
                    moved += along[i, s] * shape[s]
            for a in range(f):
                p = flexible[a]
                moved += along[i, p] * np.sqrt(spring[p]) * V[a, k] / (w * rotor[p])
            squared[i, k], enter[i, k], leave[i, k] = S[k, k], moved, moved if at_motor else read
        squared[i, f], enter[i, f], leave[i, f] = 0.0, np.sqrt(free), np.sqrt(free)
        # a posture with one nan has no modes at all
        known = free > 0.0
        for k in range(f + 1):
            known = known and np.isfinite(squared[i, k] + enter[i, k] + leave[i, k])
        if not known:
            for k in range(f + 1):
                enter[i, k] = np.nan


@compiled_lean
def invert(A: Floats, out: Floats) -> None:
    """The inverse of a symmetric positive definite A (d, d), by Gauss and Jordan; A is overwritten."""
    d = A.shape[0]
    for i in range(d):
        for j in range(d):
            out[i, j] = 1.0 if i == j else 0.0
    for p in range(d):
        over = 1.0 / A[p, p]
        for j in range(d):
            A[p, j] *= over
            out[p, j] *= over
        for i in range(d):
            if i != p:
                factor = A[i, p]
                for j in range(d):
                    A[i, j] -= factor * A[p, j]
                    out[i, j] -= factor * out[p, j]


@compiled_lean
def jacobi(A: Floats, V: Floats) -> None:
    """Eigenvalues of a symmetric A (n, n), onto its diagonal, and eigenvectors into the columns of V.

    By Jacobi's rotations, which know small eigenvalues of a positive definite matrix to their own digits
    (Demmel and Veselic 1992).
    """
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        turned = False
        for p in range(n - 1):
            for q in range(p + 1, n):
                if not abs(A[p, q]) > 1e-17 * np.sqrt(abs(A[p, p] * A[q, q])):
                    continue
                turned = True
                slope = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                t = np.copysign(1.0, slope) / (abs(slope) + np.sqrt(1.0 + slope * slope))
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = t * c
                for k in range(n):
                    A[k, p], A[k, q] = c * A[k, p] - s * A[k, q], s * A[k, p] + c * A[k, q]
                for k in range(n):
                    A[p, k], A[q, k] = c * A[p, k] - s * A[q, k], s * A[p, k] + c * A[q, k]
                for k in range(n):
                    V[k, p], V[k, q] = c * V[k, p] - s * V[k, q], s * V[k, p] + c * V[k, q]
        if not turned:
            break
