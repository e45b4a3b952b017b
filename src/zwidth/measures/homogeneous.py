"""Homogeneous Jacobians: matrices whose rows or columns have different units, made dimensionless.

A handle that is turned as well as moved has rows in m/rad and in 1; prismatic drives beside revolute ones have
columns in 1 and 1/m beside m/rad and 1. Singular values of such a matrix add metres to radians, and its
condition number changes with the unit of length. Two ways out: a characteristic length that the translations are
divided by (`characteristic_length`), or the largest values wanted of each coordinate (`scaled_jacobian`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats

HALVINGS: Final = 60  # number of halvings of the bracket, which shrinks to 1e-18 of itself
FLAT: Final = 1e-10  # a smaller slope of log kappa against log L counts as 0; well above its rounding
WIDEST: Final = 64.0  # largest half width of the bracket, in natural logarithms of a length


def homogeneous_jacobian(
    jacobian: ArrayLike, length: ArrayLike, rotations: Sequence[int] = (), prismatic: Sequence[int] = ()
) -> Floats:
    """The dimensionless Jacobian: translations, and strokes of prismatic drives, divided by a length.

        H = D J E,   D_i = 1/L for translations, 1 for rotations;  E_j = L for prismatic drives, 1 for others

    (Tandirci, Angeles and Ranjbaran 1992 and Ma and Angeles 1991, as told by Stocco, Salcudean and Sassani 1998.)
    Invariant to the unit of length, if L is given in the same one.

    jacobian   (..., m, n)  J: (velocities, angular velocities) = J (rates of the drives)
    length     (...)        L, greater than 0 [m]
    rotations  rows of angular velocities, [1] or [1/m] under a prismatic drive; the others are [m/rad] or [1]
    prismatic  columns of drives that slide; the others turn
    Returns    (..., m, n)  [1]
    Raises     ValueError   for a length that is not greater than 0, and for rows or columns there are not

    >>> homogeneous_jacobian([[0.2, 0.1], [1.0, 1.0]], 0.1, rotations=[1])
    array([[2., 1.],
           [1., 1.]])
    """
    J, L = np.asarray(jacobian, dtype=np.float64), np.asarray(length, dtype=np.float64)
    if np.any(L <= 0.0):
        raise ValueError(f"the length must be greater than 0 m, got {float(np.min(L)):.6g}")
    return np.asarray(J * L[..., None, None] ** _powers(J, rotations, prismatic))


def characteristic_length(
    jacobian: ArrayLike,
    rotations: Sequence[int] = (),
    prismatic: Sequence[int] = (),
    norm: Literal["two", "frobenius"] = "two",
) -> Floats:
    """The length for which the homogeneous Jacobian has the least condition number (its natural length).

        L = argmin kappa(D(L) J E(L))      (Ma and Angeles 1991, Angeles and Lopez-Cajun 1992; second-hand)

    There is one least value: with L = e^x and imaginary parts of x that only turn the matrix by unitary ones,
    Hadamard's three lines theorem makes the logarithm of |D J E| convex in x, and that of its inverse alike. So
    log kappa is convex, its slope never falls, and bisection on the sign of the slope is global. The slope follows
    from those of the singular values, d s_k/dx = u_k^T (dH/dx) v_k. In the Frobenius norm, without prismatic
    drives, the length can be written down: with J = [T; R], T the translations, and J^-1 = [T', R'],

        L = sqrt(|T| |R'| / (|R| |T'|))

    jacobian   (..., m, n)  J as in `homogeneous_jacobian`, square; or with only rows mixed and no more rows than
                            columns, or only columns mixed and no more columns than rows
    rotations, prismatic    as in `homogeneous_jacobian`
    norm       of the condition number; "frobenius" is smooth and has a single least point
    Returns    (...)        L [m], good to about 1e-9 of itself and the condition number to rounding; nan where J
                            is singular or nan. In the 2-norm a range of lengths may be equally good: its middle,
                            in the logarithm
    Raises     ValueError   where all units are alike, or for a matrix of another shape

    >>> round(float(characteristic_length([[0.2, 0.0], [0.0, 1.0]], rotations=[1])), 6)
    0.2
    """
    J = np.asarray(jacobian, dtype=np.float64)
    power = _powers(J, rotations, prismatic)
    _check_single_minimum(power)
    unknown: Flags = np.asarray(np.isnan(J).any(axis=(-2, -1)))
    J = np.where(unknown[..., None, None], np.eye(*J.shape[-2:]), J)
    values = np.linalg.svd(J, compute_uv=False)
    start = _first_log_length(J, power)
    kappa = _condition(J, power, start)
    singular = ~(kappa < 1.0 / (np.finfo(float).eps * max(J.shape[-2:]))) | (values[..., -1] == 0.0)
    J = np.where(singular[..., None, None], np.eye(*J.shape[-2:]), J)
    x = _minimise_convex(lambda x: _slope(J, power, x, norm), np.where(singular, 0.0, start))
    return np.asarray(np.where(unknown | singular, np.nan, np.exp(x)))


def scaled_jacobian(jacobian: ArrayLike, largest_velocities: ArrayLike, largest_rates: ArrayLike) -> Floats:
    """The Jacobian scaled by the largest velocity of each handle coordinate and the largest rate of each drive.

        S_T^-1 J S_J,   S_T = diag(largest velocities), S_J = diag(largest rates)

    Stocco, Salcudean and Sassani 1998 scale design matrices in this way on both sides, by the ranges of the
    coordinates; of their text only the beginning could be read.

    Singular values above 1 mean that the drives together reach more than the wanted velocity. Invariant to every
    unit, and to the coordinates of the drives as far as each is scaled by itself (a ratio). Forces, mass
    matrices and other design matrices are scaled in the same way, each side by its coordinates' largest values.

    jacobian            (..., m, n)  in any units
    largest_velocities  (..., m)     wanted of each coordinate of the handle, in the units of J's rows times rates
    largest_rates       (..., n)     of each drive
    Returns             (..., m, n)  [1]
    Raises              ValueError   if one of them is not greater than 0

    >>> scaled_jacobian([[0.2, 0.1]], [0.5], [10.0, 5.0])
    array([[4., 1.]])
    """
    J = np.asarray(jacobian, dtype=np.float64)
    task, joint = (np.asarray(v, dtype=np.float64) for v in (largest_velocities, largest_rates))
    for name, values in (("largest_velocities", task), ("largest_rates", joint)):
        if np.any(values <= 0.0):
            raise ValueError(f"{name} must be greater than 0, got {float(np.min(values)):.6g}")
    return np.asarray(J * joint[..., None, :] / task[..., :, None])


def _powers(J: Floats, rotations: Sequence[int], prismatic: Sequence[int]) -> Floats:
    """Exponent of the length in the factor of each entry (m, n): -1, 0 or 1. Raises ValueError for an array that
    is no matrix, and for rows or columns there are not."""
    if J.ndim < 2:
        raise ValueError(f"a Jacobian is a matrix, got an array of shape {J.shape}")
    for name, indices, count in (("rotations", rotations, J.shape[-2]), ("prismatic", prismatic, J.shape[-1])):
        wrong = [index for index in indices if not 0 <= index < count]
        if wrong:
            raise ValueError(f"{name} must be from 0 to {count - 1}, got {wrong[0]}")
    power = np.zeros(J.shape[-2:])
    power -= 1.0
    power[list(rotations)] += 1.0
    power[:, list(prismatic)] += 1.0
    return power


def _check_single_minimum(power: Floats) -> None:
    """Raise ValueError where the length has no effect, or where the least condition number may not be the only
    one, by the powers (m, n) of the length in the entries."""
    m, n = power.shape
    rows, columns = bool(np.ptp(power[:, 0])), bool(np.ptp(power[0]))
    if not rows and not columns:
        raise ValueError(
            "all entries have the same unit, and no length makes a difference; nothing needs to be done"
        )
    if m != n and ((rows and m > n) or (columns and n > m)):
        raise ValueError(
            f"of a Jacobian of {m} x {n} the {'rows' if rows else 'columns'} have different units, and the least "
            "condition number may not be the only one; give a square one, or choose a length yourself"
        )


def _first_log_length(J: Floats, power: Floats) -> Floats:
    """Logarithm of a first length: the one at which two kinds of entries have equal norms; 0 where there are no
    two."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = [
            np.log(np.sqrt(np.sum(np.where(power == k, J, 0.0) ** 2, axis=(-2, -1)))) for k in (-1.0, 0.0, 1.0)
        ]
        # `size`: logarithms of the norms of the entries with powers -1, 0 and 1
        candidates = np.stack([size[0] - size[1], size[1] - size[2], 0.5 * (size[0] - size[2])])
    known = np.isfinite(candidates)
    first = np.take_along_axis(candidates, known.argmax(axis=0)[None], axis=0)[0]
    return np.asarray(np.where(known.any(axis=0), first, 0.0))


def _condition(J: Floats, power: Floats, x: Floats) -> Floats:
    """Condition number (2-norm) of the homogeneous Jacobian for the length e^x."""
    s = np.linalg.svd(J * np.exp(x[..., None, None] * power), compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(s[..., 0] / s[..., -1])


def _slope(J: Floats, power: Floats, x: Floats, norm: str) -> Floats:
    """Slope of log kappa of the homogeneous Jacobian at the length e^x, against x (...).

    power, norm  as of `_powers`, and of `characteristic_length`
    """
    H = J * np.exp(x[..., None, None] * power)
    # dH/dx = power * H, entry by entry
    U, s, V = np.linalg.svd(H, full_matrices=False)
    growth = np.einsum("...ik,...ij,...kj->...k", U, power * H, V) / s  # of each singular value, relative
    if norm == "two":
        return np.asarray(growth[..., 0] - growth[..., -1])
    # shares of each singular value in the squared norms of H and of its inverse, by ratios that cannot overflow
    of_matrix, of_inverse = (s / s[..., :1]) ** 2, (s[..., -1:] / s) ** 2
    return np.asarray(
        (of_matrix * growth).sum(axis=-1) / of_matrix.sum(axis=-1)
        - (of_inverse * growth).sum(axis=-1) / of_inverse.sum(axis=-1)
    )


def _minimise_convex(slope: Callable[[Floats], Floats], start: Floats) -> Floats:
    """Minima (...) of convex functions, found by their slopes; nan where a function does not rise in the bracket.

    slope  slopes (...) at places (...);   start  (...)  places about which brackets are widened

    Kinks and level stretches are treated alike: the place up to which the slope is below -FLAT and the one from
    which it exceeds FLAT are bisected for, and the answer lies in their middle. So rounding of a slope that is all
    but zero does not choose the place.
    """
    ends = []
    for side in (-1.0, 1.0):
        reach = np.ones_like(start)
        while np.any(level := ~(side * slope(start + side * reach) > FLAT) & (reach < WIDEST)):
            reach = np.where(level, 2.0 * reach, reach)
        ends.append(reach)
    below, above = start - ends[0], start + ends[1]
    edges = []
    for limit in (-FLAT, FLAT):
        a, b = below, above
        for _ in range(HALVINGS):
            middle = 0.5 * (a + b)
            falls = slope(middle) < limit
            a, b = np.where(falls, middle, a), np.where(falls, b, middle)
        edges.append(0.5 * (a + b))
    bracketed = np.maximum(*ends) < WIDEST
    return np.asarray(np.where(bracketed, 0.5 * (edges[0] + edges[1]), np.nan))
