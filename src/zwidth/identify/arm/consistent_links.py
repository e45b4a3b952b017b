"""Masses, centres of mass and inertias that bodies can have, nearest to the file's, for given base parameters.

Ten numbers are those of a body of positive density if and only if its pseudo-inertia is positive definite
(Wensing, Kim and Slotine 2018, known at second hand):

    P = [[S, h], [h^T, m]],   S = tr(I)/2 1 - I,   h = m c,   I about the frame's origin

It is P = L V V^T L^T with L L^T the file's and V an upper triangle with positive diagonal exp(x), whose other
entries are coordinates, too: every vector x of ten numbers is a body, and x = 0 the file's (log-Cholesky
coordinates; Rucker and Wensing 2022, known at second hand). The numbers are those that minimise

    (G Phi(x) - beta)^T H (G Phi(x) - beta) + |x|^2 / s^2

with H the information of the base parameters beta: where the data say much, they decide, and where they say
nothing the file does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.arm.parameters import BaseParameters
from zwidth.model.inertia_regressor import PARAMETERS
from zwidth.model.mechanism import Mechanism

WIDE: Final = 1.0  # s: the file's numbers may be wrong by a factor of e, or more
THIN: Final = 1e-3  # least share of the pseudo-inertia's mean width, of a body that is flat or a rod in the file
UPPER: Final = np.triu_indices(4, 1)


@dataclass(frozen=True)
class ConsistentLinks:
    """Numbers that bodies can have.

    values     (P,) of all parameters
    deviation  root mean square of the base parameters' change, in their standard deviations
    """

    values: Floats
    deviation: float


def consistent_links(
    base: BaseParameters, mechanism: Mechanism, beta: Floats, information: Floats
) -> ConsistentLinks:
    """All parameters, of links that can exist, for base parameters (b,) of this information (b, b).

    Links whose mass the file leaves out begin as rods of one mass per length, and that of the base parameters.
    """
    from scipy.optimize import least_squares

    parameters = base.parameters
    file = pseudo_inertias(mechanism, parameters.bodies)
    roots = np.asarray(np.linalg.cholesky(file), dtype=np.float64)
    rotor = np.array([_or(mechanism.drives.motor_inertia[i], 1e-6) for i in parameters.rotors])
    size = np.sqrt(np.diag(information))
    size = 1.0 / np.where(size > 0.0, size, 1.0)
    eigenvalues, vectors = np.linalg.eigh(information * size[:, None] * size)
    whiten = (np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T) / size
    free = np.arange(*parameters.friction.indices(len(parameters.names)))
    own = [base.kept.index(j) if j in base.kept else -1 for j in free]

    count = parameters.inertial + len(rotor)

    def all_parameters(x: Floats) -> tuple[Floats, Floats]:
        """The parameters (P,), and their derivatives (P, count) by x."""
        values, slopes = np.zeros(len(parameters.names)), np.zeros((len(parameters.names), count))
        bodies, by_own = _numbers(roots, x[: parameters.inertial].reshape(-1, PARAMETERS))
        values[: parameters.inertial] = bodies.ravel()
        for k in range(len(file)):
            own = slice(PARAMETERS * k, PARAMETERS * (k + 1))
            slopes[own, own] = by_own[k]
        turning = np.arange(parameters.inertial, count)
        values[turning] = slopes[turning, turning] = rotor * np.exp(x[turning])
        return values, slopes

    dynamic = np.array([k for k in range(len(base.kept)) if k not in own], dtype=int)
    kept_friction = np.array([k for k in own if k >= 0], dtype=int)
    # friction is free, so that what is left of the information is that of the rest alone
    rest = whiten[:, dynamic]
    if len(kept_friction):
        Q = np.linalg.qr(whiten[:, kept_friction])[0]
        rest = rest - Q @ (Q.T @ rest)
    G = base.matrix[dynamic]

    def residuals(x: Floats) -> Floats:
        return np.concatenate([rest @ (G @ all_parameters(x)[0] - beta[dynamic]), x / WIDE])

    def slopes(x: Floats) -> Floats:
        return np.concatenate([rest @ (G @ all_parameters(x)[1]), np.eye(count) / WIDE])

    solved = least_squares(
        residuals, np.zeros(count), jac=slopes, xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=200
    )
    values = all_parameters(np.asarray(solved.x))[0]
    moved = rest @ (G @ values - beta[dynamic])
    deviation = float(np.sqrt(np.sum(moved**2) / max(len(dynamic), 1)))
    # friction at its best beside these links; a negative level is none
    shift = np.zeros(len(base.kept))
    shift[dynamic] = G @ values - beta[dynamic]
    if len(kept_friction):
        shift[kept_friction] = -np.linalg.lstsq(
            whiten[:, kept_friction], whiten[:, dynamic] @ shift[dynamic], rcond=None
        )[0]
    for j, k in zip(free, own, strict=True):
        values[j] = beta[k] + shift[k] if k >= 0 else 0.0
    return ConsistentLinks(values, deviation)


def pseudo_inertias(mechanism: Mechanism, bodies: tuple[int, ...]) -> Floats:
    """P (w, 4, 4) of the file's links, made positive definite where they are flat, rods, or left out."""
    links, out = mechanism.links, np.empty((len(bodies), 4, 4))
    lengths = np.linalg.norm(links.tip, axis=-1)
    usual = max(float(np.max(lengths, initial=0.0)), 1e-3)
    for k, i in enumerate(bodies):
        length = float(lengths[i]) or usual
        mass, center, inertia = float(links.mass[i]), links.center_of_mass[i], links.inertia[i]
        if not mass > 0.0:
            mass = length  # 1 kg per metre
            center = 0.5 * links.tip[i] if np.isnan(links.mass[i]) else center
        if not np.isfinite(inertia).all():
            inertia = mass * length**2 / 12.0 * np.eye(3)
        moments = np.linalg.eigvalsh(inertia)
        if moments[1] <= 1e-9 * moments[2]:  # one number, about the joint's axis: the others are not known
            inertia = moments[2] * np.eye(3)
        spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia
        widths, axes = np.linalg.eigh(0.5 * (spread + spread.T))
        least = THIN * max(float(widths[-1]), mass * (1e-2 * length) ** 2)
        spread = axes @ np.diag(np.maximum(widths, least)) @ axes.T
        out[k, :3, :3] = spread + mass * np.outer(center, center)
        out[k, :3, 3] = out[k, 3, :3] = mass * center
        out[k, 3, 3] = mass
    return out


def body_numbers(values: Floats) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass (3,) and inertia (3, 3) about it, of a body's ten parameters."""
    m, h = float(values[0]), values[1:4]
    xx, yy, zz, xy, xz, yz = values[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    center = h / m
    return m, center, inertia - m * (center @ center * np.eye(3) - np.outer(center, center))


def _numbers(roots: Floats, x: Floats) -> tuple[Floats, Floats]:
    """The ten parameters (w, 10) of bodies by their coordinates x (w, 10), and their derivatives (w, 10, 10).

    dP = L (dV V^T + V dV^T) L^T,   dV = exp(x_k) e_k e_k^T of a diagonal entry, e_i e_j^T of another
    """
    w = len(x)
    V = np.zeros((w, 4, 4))
    V[:, range(4), range(4)] = np.exp(x[:, :4])
    V[:, UPPER[0], UPPER[1]] = x[:, 4:]
    steps = np.zeros((w, PARAMETERS, 4, 4))
    steps[:, range(4), range(4), range(4)] = np.exp(x[:, :4])
    steps[:, range(4, PARAMETERS), UPPER[0], UPPER[1]] = 1.0
    factor = roots @ V
    half = (roots[:, None] @ steps) @ np.swapaxes(factor, 1, 2)[:, None]
    slopes = _ten(half + np.swapaxes(half, 2, 3))
    return _ten(factor @ np.swapaxes(factor, 1, 2)), np.swapaxes(slopes, 1, 2)


def _ten(P: Floats) -> Floats:
    """The ten parameters (..., 10) of pseudo-inertias (..., 4, 4)."""
    S, xx, yy, zz = P[..., :3, :3], P[..., 0, 0], P[..., 1, 1], P[..., 2, 2]
    moments = P[..., 3, 3], P[..., 0, 3], P[..., 1, 3], P[..., 2, 3], yy + zz, xx + zz, xx + yy
    return np.stack([*moments, -S[..., 0, 1], -S[..., 0, 2], -S[..., 1, 2]], axis=-1)


def _or(value: float, otherwise: float) -> float:
    return float(value) if np.isfinite(value) and value > 0.0 else otherwise
