"""Stability by determinants: the Moebius map of the unit disk and the Routh-Hurwitz criterion (Appendix A).

The thesis's way to its closed forms. For numbers rather than formulas `chart` and `verdict` keep more digits.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats


def bilinear_coefficients(characteristic: ArrayLike) -> Floats:
    """Coefficients in sigma of (sigma - 1)^n p(z) with z = (sigma + 1)/(sigma - 1).

    The map takes the unit disk onto the left half plane (thesis, above eq. 4.4 and 4.38; there the polynomial of
    the transition matrix). A root z = 1 goes to infinity: the first coefficient, p(1), vanishes.

    characteristic  (..., n + 1)  coefficients of p, highest power first
    Returns         (..., n + 1)  highest power first

    >>> bilinear_coefficients([1.0, 0.0, 0.0])                  # both roots z = 0: (sigma + 1)^2
    array([1., 2., 1.])
    """
    p = np.asarray(characteristic, dtype=float)
    n = p.shape[-1] - 1
    rows = np.array([_product(n - k, k) for k in range(n + 1)])
    return np.asarray(p @ rows)


def _product(plus: int, minus: int) -> Floats:
    """(sigma + 1)^plus (sigma - 1)^minus, highest power first."""
    up = np.array([comb(plus, i) for i in range(plus + 1)], dtype=float)
    down = np.array([comb(minus, i) * (-1.0) ** i for i in range(minus + 1)])
    return np.convolve(up, down)


def hurwitz_matrix(coefficients: ArrayLike) -> Floats:
    """Hurwitz's matrix of a0 s^n + a1 s^(n-1) + ... + an (thesis eq. A.2).

        | a1  a0  0   0  ... |
        | a3  a2  a1  a0 ... |
        | ...            an  |        coefficients beyond 0 and n are zero

    coefficients  (..., n + 1)  highest power first
    Returns       (..., n, n)
    """
    a = np.asarray(coefficients, dtype=float)
    n = a.shape[-1] - 1
    matrix = np.zeros((*a.shape[:-1], n, n))
    for row in range(n):
        for column in range(n):
            index = 2 * row - column + 1
            if 0 <= index <= n:
                matrix[..., row, column] = a[..., index]
    return matrix


def principal_minors(coefficients: ArrayLike) -> Floats:
    """The determinants Delta_1 ... Delta_n of Hurwitz's matrix (thesis eq. A.3), (..., n).

    >>> principal_minors([1.0, 3.0, 2.0])        # s^2 + 3 s + 2
    array([3., 6.])
    """
    matrix = hurwitz_matrix(coefficients)
    n = matrix.shape[-1]
    return np.stack([np.linalg.det(matrix[..., :k, :k]) for k in range(1, n + 1)], axis=-1)


def is_stable(coefficients: ArrayLike) -> Flags:
    """Whether all roots of a0 s^n + ... + an lie in the open left half plane (...).

    Where a0 > 0 and all minors are positive (thesis eq. A.3). A polynomial with a0 < 0 is multiplied
    by -1 first; with a0 = 0 a root is at infinity, and it is not stable.

    >>> bool(is_stable([1.0, 3.0, 2.0])), bool(is_stable(bilinear_coefficients([1.0, 0.0, -1.1])))
    (True, False)
    """
    a = np.asarray(coefficients, dtype=float)
    normalised = a * np.where(a[..., :1] < 0.0, -1.0, 1.0)
    return np.asarray((normalised[..., 0] > 0.0) & np.all(principal_minors(normalised) > 0.0, axis=-1))
