"""Several rendered directions: (2.14)-(2.17) for any m, and the 2m masses of (2.28), (2.34), (2.35).

With A q' = u_r rendered and B q' = u_a admissible, A M^-1 B^T = 0, the mass matrix in u = [A; B] q' falls into
W_rr = (A M^-1 A^T)^-1 and W_aa = (B M^-1 B^T)^-1. Shown on random mass matrices whose motions differ by powers of
ten.

The five-bar rendering both directions of its plane, m = n = 2: link-side and motor-side mass matrices joined by
K_e. Nothing is lost there, because as many directions are rendered as there are drives, and the 2m masses vibrate
at the full model's two frequencies. Seen along one direction, 1/(u W^-1 u), they are the masses of Table 3.4.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag, eigh

from zwidth.device.load import load
from zwidth.model.directions import decompose, reduce_directions

SIZES = ((1, 3), (1, 5), (2, 3), (2, 5), (3, 4), (3, 6))  # m of n


def _blocks(m: int, n: int) -> tuple[float, float]:
    """Relative size of A M^-1 B^T, and of what lies outside the two blocks of R^-T M R^-1."""
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
    return float(np.max(np.abs(A @ inverse @ B.T) / sizes)), float(np.max(np.abs(apart) / scale))


coupling, outside = (max(values) for values in zip(*(_blocks(m, n) for m, n in SIZES), strict=True))

device = load("five-bar")
posture = device.posture()
masses = reduce_directions(device.mechanism, posture, np.eye(3)[:2], "two-mass", device.damping)
full = reduce_directions(device.mechanism, posture, np.eye(3)[:2], "full", device.damping)

J, drives = posture.jacobian[:2], device.mechanism.drives
_squared = drives.transmission**2


def _seen(matrix: np.ndarray) -> np.ndarray:
    return np.linalg.inv(J @ np.linalg.inv(matrix) @ J.T)


W1, W2 = _seen(posture.mass_matrix), _seen(np.diag(_squared * drives.motor_inertia))  # (2.28)
K = _seen(np.diag(_squared * drives.stiffness))  # (2.34)


def _off(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


error_of_2_28 = _off(masses.mass, block_diag(W1, W2))
error_of_2_34 = _off(masses.stiffness, np.block([[K, -K], [-K, K]]))


def frequencies(plant) -> np.ndarray:
    """Natural frequencies of the flexible modes, ascending [Hz]."""
    squares = eigh(plant.stiffness, plant.mass, eigvals_only=True)
    return np.sqrt(squares[squares > 1.0]) / (2.0 * np.pi)


frequencies_of_masses, frequencies_of_full = frequencies(masses), frequencies(full)
# one direction out of the plane's matrices: y
link_side_mass = float(1.0 / np.linalg.inv(W1)[1, 1])
motor_side_mass = float(1.0 / np.linalg.inv(W2)[1, 1])
