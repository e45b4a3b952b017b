"""Wall laws that differ from direction to direction: constant matrices K0 and B0, each scaled by one number.

    f = -(k K0 y + b B0 v)

y and v are the readings along m rendered directions and their estimated velocities. K0 and B0 have 1 as their
largest entry, so that k is the stiffness along the stiffest direction, and b the damping along the most damped
one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

# Entries are symmetric, and eigenvalues not negative, to this share of the largest entry.
ROUNDING: Final = 1e-12


@dataclass(frozen=True)
class PrincipalDirections:
    """Combinations of the rendered directions in which both matrices of a law are diagonal.

        K0 = S^T diag(stiffness) S,     B0 = S^T diag(damping) S

    combinations  (r, m)  S, r of them: those in which the law pushes at all
    stiffness     (r,)    from 0 to 1; in each direction the larger of the two is 1
    damping       (r,)
    """

    combinations: Floats
    stiffness: Floats
    damping: Floats


@dataclass(frozen=True)
class WallMatrices:
    """The matrices K0 and B0 of a wall law over m directions; `wall_matrices` checks and scales them.

    stiffness  K0 (m, m) symmetric, positive semidefinite, its largest entry 1
    damping    B0 (m, m) the same
    """

    stiffness: Floats
    damping: Floats

    @property
    def count(self) -> int:
        """Number of directions m."""
        return len(self.stiffness)

    @cached_property
    def principal(self) -> PrincipalDirections:
        """The law in directions in which both matrices are diagonal.

        Two positive semidefinite matrices always have such: with K0 + B0 = R^T R of rank r and the eigenvectors Q
        of R^-T K0 R^-1, S = Q^T R. Diagonal matrices keep their own directions, to the last digit.
        """
        total = self.stiffness + self.damping
        if _is_diagonal(self.stiffness) and _is_diagonal(self.damping):
            moved = np.diag(total) > 0.0
            S, s, v = np.eye(self.count)[moved], np.diag(self.stiffness)[moved], np.diag(self.damping)[moved]
        else:
            size, axes = np.linalg.eigh(total)
            kept = size > ROUNDING * size[-1]
            root = np.sqrt(size[kept])
            inverse = axes[:, kept] / root
            s, Q = np.linalg.eigh(inverse.T @ self.stiffness @ inverse)
            for exact in (0.0, 0.5, 1.0):
                s[np.abs(s - exact) <= ROUNDING] = exact
            S, v = Q.T @ (axes[:, kept] * root).T, 1.0 - s
        larger = np.maximum(s, v)
        return PrincipalDirections(np.sqrt(larger)[:, None] * S, s / larger, v / larger)


def wall_matrices(relative_stiffness: ArrayLike, relative_damping: ArrayLike | None, count: int) -> WallMatrices:
    """The matrices of a law from what was given for each; only their entries' ratios count.

    relative_stiffness  (m,) along each direction, or a matrix (m, m); symmetric, positive semidefinite, not all 0
    relative_damping    the same; None: as relative_stiffness
    count               number of directions m
    Raises  ValueError  for what is no such matrix

    >>> law = wall_matrices([5.0, 1.0], None, 2)
    >>> law.stiffness.tolist(), law.damping.tolist()
    ([[1.0, 0.0], [0.0, 0.2]], [[1.0, 0.0], [0.0, 0.2]])
    """
    stiffness = _scaled_matrix("relative_stiffness", relative_stiffness, count)
    if relative_damping is None:
        return WallMatrices(stiffness, stiffness.copy())
    return WallMatrices(stiffness, _scaled_matrix("relative_damping", relative_damping, count))


def _scaled_matrix(name: str, given: ArrayLike, count: int) -> Floats:
    """One matrix, its largest entry 1. Raises ValueError for what is no matrix of a law."""
    try:
        entries = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be {_shapes(count)}, got {given!r}") from None
    if entries.shape not in ((count,), (count, count)):
        raise ValueError(f"{name} must be {_shapes(count)}, got {_shape_text(entries)}")
    if not np.isfinite(entries).all():
        raise ValueError(f"{name} must be finite numbers, got {entries[~np.isfinite(entries)][0]:g}")
    matrix = np.diag(entries) if entries.ndim == 1 else entries
    largest = float(np.max(np.abs(matrix)))
    if largest == 0.0:
        raise ValueError(f"{name} must not be 0 along all directions")
    off = np.abs(matrix - matrix.T)
    if not np.max(off) <= ROUNDING * largest:
        i, j = (int(k) for k in np.unravel_index(np.argmax(off), off.shape))
        raise ValueError(
            f"{name} must be symmetric, got {matrix[i, j]:g} in row {i + 1}, column {j + 1} and {matrix[j, i]:g} "
            f"in row {j + 1}, column {i + 1}"
        )
    matrix = (matrix + matrix.T) / 2.0
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < -ROUNDING * largest:
        raise ValueError(
            f"{name} must have no negative eigenvalue, got one of {least:g}: a wall must not push the hand along"
        )
    return np.asarray(matrix / float(np.max(matrix)))


def _is_diagonal(matrix: Floats) -> bool:
    return bool(np.count_nonzero(matrix) == np.count_nonzero(np.diag(matrix)))


def _shapes(count: int) -> str:
    return f"{count} numbers, one for each direction, or a matrix of {count} rows and columns"


def _shape_text(entries: Floats) -> str:
    if entries.ndim == 1:
        return f"{len(entries)} numbers" if len(entries) != 1 else "1 number"
    return "1 number" if entries.ndim == 0 else f"an array of shape {entries.shape}"
