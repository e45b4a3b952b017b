"""Several rendered directions: (2.6)-(2.17) for any m, and the 2m masses of (2.28), (2.34), (2.35).

With A q' = u_r rendered and B q' = u_a admissible, A M^-1 B^T = 0, the mass matrix in u = [A; B] q' = R q' falls
into W_rr = (A M^-1 A^T)^-1 and W_aa = (B M^-1 B^T)^-1, and a wall's force f_v = A^T lambda becomes [lambda; 0].
Shown on random mass matrices whose motions differ by powers of ten.

The five-bar rendering both directions of its plane, m = n = 2: link-side and motor-side mass matrices joined by
K_e. Nothing is lost there, because as many directions are rendered as there are drives, and the 2m masses vibrate
at the full model's two frequencies. Seen along one direction, 1/(u W^-1 u), they are the masses of Table 3.4.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag, eigh

from zwidth.device.load import load
from zwidth.model import decompose, reduce_directions

SIZES = ((1, 3), (1, 5), (2, 3), (2, 5), (3, 4), (3, 6))  # m of n


def _blocks(m: int, n: int) -> tuple[float, float, float]:
    """Relative size of A M^-1 B^T and of what R^-T M R^-1 has outside its blocks; size of R^-T A^T - [1; 0]."""
    rng = np.random.default_rng([m, n])
    root = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-2, 1, n)
    M, A = root @ root.T, rng.normal(size=(m, n))
    found = decompose(M, A)
    B, inverse = found.complement, np.linalg.inv(M)
    sizes = np.sqrt(np.outer(np.diag(A @ inverse @ A.T), np.diag(B @ inverse @ B.T)))
    R = np.linalg.inv(np.vstack([A, B]))
    whole = R.T @ M @ R
    apart = whole - block_diag(np.linalg.inv(A @ inverse @ A.T), np.linalg.inv(B @ inverse @ B.T))
    scale = np.sqrt(np.outer(np.diag(whole), np.diag(whole)))
    forces = np.abs(R.T @ A.T - np.eye(n)[:, :m]).max()
    return float(np.max(np.abs(A @ inverse @ B.T) / sizes)), float(np.max(np.abs(apart) / scale)), float(forces)


coupling, outside, elsewhere = (max(values) for values in zip(*(_blocks(m, n) for m, n in SIZES), strict=True))

device = load("five-bar")
posture = device.at().posture
masses = reduce_directions(device.mechanism, posture, np.eye(3)[:2], "two-mass", device.damping)
full = reduce_directions(device.mechanism, posture, np.eye(3)[:2], "full", device.damping)

J, drives = posture.jacobian[:2], device.mechanism.drives
_squared = drives.transmission**2


def _effective_matrix(matrix: np.ndarray, through: np.ndarray) -> np.ndarray:
    return np.linalg.inv(through @ np.linalg.inv(matrix) @ through.T)


A_1, A_2 = np.hstack([J, 0.0 * J]), np.hstack([0.0 * J, J])  # (2.25), (2.27)
M = block_diag(posture.mass_matrix, np.diag(_squared * drives.motor_inertia))
W1, W2 = _effective_matrix(M, A_1), _effective_matrix(M, A_2)  # (2.28)
K_phi = np.diag(_squared * drives.stiffness)
K = _effective_matrix(K_phi, J)  # (2.34)
# (2.29)-(2.33): motors locked, a unit force at the handle along each direction moves it by K^-1
deflection = J @ np.linalg.solve(K_phi, J.T)


def _relative_difference(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


error_of_2_28 = _relative_difference(masses.mass, block_diag(W1, W2))
error_of_2_34 = _relative_difference(masses.stiffness, np.block([[K, -K], [-K, K]]))


def frequencies(plant) -> np.ndarray:
    """Natural frequencies of the flexible modes, ascending [Hz]."""
    squares = eigh(plant.stiffness, plant.mass, eigvals_only=True)
    return np.sqrt(squares[squares > 1.0]) / (2.0 * np.pi)


frequencies_of_masses, frequencies_of_full = frequencies(masses), frequencies(full)
# one direction out of the plane's matrices: y
link_side_mass = float(1.0 / np.linalg.inv(W1)[1, 1])
motor_side_mass = float(1.0 / np.linalg.inv(W2)[1, 1])
