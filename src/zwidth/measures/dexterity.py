"""How freely a mechanism moves and accelerates its handle in one posture (thesis section 5.1).

All take the translational Jacobian of the handle in the driven coordinates. Only the rows in which the handle
can move count: a planar mechanism is judged within its plane.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

MOVES: Final = 1e-12  # share of the largest entry below which a row of the Jacobian is rounding


def manipulability(jacobian: ArrayLike) -> Floats:
    """Volume of the ellipsoid of handle velocities for joint rates of unit length.

        w = sqrt(det(J J^T))                        (Yoshikawa 1985; thesis eq. 5.1)

    with J^T J where there are fewer drives than directions to move in: the product of the singular values.

    jacobian  (..., 3, d)  J: handle velocity = J p' [m/rad]
    Returns   (...)        [m^r/rad^r], r = min(d, rows that move); 0 where singular, nan where J is nan

    >>> float(manipulability([[0.0, -0.2], [0.3, 0.0], [0.0, 0.0]]))
    0.06
    """
    values, used = _singular_values(jacobian)
    return np.asarray(np.where(used, values, 1.0).prod(axis=-1) * used.any(axis=-1))


def dynamic_manipulability(jacobian: ArrayLike, mass_matrix: ArrayLike) -> Floats:
    """Volume of the ellipsoid of handle accelerations for drive torques of unit length.

        w_d = sqrt(det(J (M^T M)^-1 J^T))           (Yoshikawa 1985; thesis eq. 5.3)

    jacobian     (..., 3, d)  J [m/rad]
    mass_matrix  (..., d, d)  M in the same coordinates, links and rotors [kg m^2]
    Returns      (...)        [1/(kg m)^r], r as for `manipulability`
    """
    J, M = np.asarray(jacobian, dtype=np.float64), np.asarray(mass_matrix, dtype=np.float64)
    return manipulability(np.swapaxes(np.linalg.solve(np.swapaxes(M, -1, -2), np.swapaxes(J, -1, -2)), -1, -2))


def isotropy(jacobian: ArrayLike) -> Floats:
    """Condition number of the Jacobian: largest over smallest singular value.

        kappa = |J| |J^-1|, 2-norm                  (Salisbury and Craig 1982; thesis eq. 5.2)

    jacobian  (..., 3, d)  J [m/rad]
    Returns   (...)        1: isotropic; inf where singular or where nothing moves; nan where J is nan
    """
    values, used = _singular_values(jacobian)
    largest = values.max(axis=-1, initial=0.0)
    smallest = np.where(used, values, np.inf).min(axis=-1, initial=np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = largest / np.where(np.isinf(smallest), 0.0, smallest)
    return np.asarray(np.where((largest == 0.0) & ~np.isnan(values).any(axis=-1), np.inf, ratio))


def _singular_values(jacobian: ArrayLike) -> tuple[Floats, NDArray[np.bool_]]:
    """Singular values (..., min(3, d)), descending, and which of them belong to rows that move."""
    J = np.asarray(jacobian, dtype=np.float64)
    unknown: NDArray[np.bool_] = np.asarray(np.isnan(J).any(axis=(-2, -1)))
    J = np.where(unknown[..., None, None], 0.0, J)
    values: Floats = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    size = np.abs(J).max(axis=-1)
    rows = (size > MOVES * size.max(axis=-1, keepdims=True)).sum(axis=-1)
    used = np.arange(values.shape[-1]) < rows[..., None]
    values = np.where(unknown[..., None], np.nan, values)
    return values, used | unknown[..., None]
