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
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.errors import ArgumentError
from zwidth.model.argument_checks import describe_value

# Entries are symmetric, and eigenvalues not negative, to this share of the largest entry.
ROUNDING: Final = 1e-12
# Along a direction that has the one, stiffness or damping, of the other is at least this much of its largest, or
# none.
LEAST: Final = 1e-9


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
    """The matrices K0 and B0 of a wall law over m directions.

    stiffness  K0 (m, m) symmetric, positive semidefinite, its largest entry 1
    damping    B0 (m, m) the same

    >>> WallMatrices.of([5.0, 1.0], [1.0, 1.0]).stiffness
    array([[1. , 0. ],
           [0. , 0.2]])
    """

    stiffness: Floats
    damping: Floats

    @classmethod
    def of(
        cls,
        relative_stiffness: ArrayLike | None,
        relative_damping: ArrayLike | None = None,
        count: int | None = None,
    ) -> WallMatrices:
        """The matrices of a law from what is given for each; only the ratios of their entries count.

        relative_stiffness  (m,) along each direction, or a matrix (m, m), symmetric, positive semidefinite and not
                            all 0; None: the same along each direction
        relative_damping    the same; None: as relative_stiffness
        count               number of directions m; None: as many as are given
        Raises  ArgumentError  for what is no such matrix

        >>> print(WallMatrices.of([5.0, 1.0]))
        stiffness and damping 1 : 0.2
        """
        given = relative_damping if relative_stiffness is None else relative_stiffness
        m = max(1, len(np.atleast_1d(np.asarray(given, dtype=object)))) if count is None else count
        alike = np.ones(m) if relative_stiffness is None else relative_stiffness
        stiffness = _scaled_matrix("relative_stiffness", alike, m)
        if relative_damping is None:
            return cls(stiffness, stiffness.copy())
        law = cls(stiffness, _scaled_matrix("relative_damping", relative_damping, m))
        for name, along in (("stiffness", law.principal.stiffness), ("damping", law.principal.damping)):
            faint = along[(along > 0.0) & (along < LEAST)]
            if len(faint):
                problem = (
                    f"must be 0 or at least {LEAST:g} times the other along each direction, got {faint[0]:.3g}"
                )
                raise ArgumentError(f"relative_{name}", f"{problem} times; give 0")
        return law

    def __str__(self) -> str:
        """The ratios within both matrices in words."""
        stiffness, damping = ratios_text(self.stiffness), ratios_text(self.damping)
        if stiffness == damping:
            return f"stiffness and damping {stiffness}"
        return f"stiffness {stiffness}, damping {damping}"

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
            # s, v: stiffness and damping of each combination; in the other branch s + v = 1
            S, s, v = np.eye(self.count)[moved], np.diag(self.stiffness)[moved], np.diag(self.damping)[moved]
        else:
            size, axes = np.linalg.eigh(total)
            kept = size > ROUNDING * size[-1]
            root = np.sqrt(size[kept])
            inverse = axes[:, kept] / root
            s, Q = np.linalg.eigh(inverse.T @ self.stiffness @ inverse)
            for exact in (0.0, 0.5, 1.0):  # damping alone, both alike, stiffness alone: without their rounding
                s[np.abs(s - exact) <= ROUNDING] = exact
            S, v = Q.T @ (axes[:, kept] * root).T, 1.0 - s
        larger = np.maximum(s, v)  # goes into the combinations, so that the larger of the two is 1
        return PrincipalDirections(np.sqrt(larger)[:, None] * S, s / larger, v / larger)


def _scaled_matrix(name: str, given: ArrayLike, count: int) -> Floats:
    """A matrix (count, count), its largest entry 1, from one number per direction or a matrix. Raises
    ArgumentError, which `name` begins, for what is no matrix of a law."""
    wanted = (
        f"must be {count} numbers, one for each direction, or a matrix of {count} rows and columns"
        if count != 1
        else "must be 1 number, or a matrix of 1 row and column"
    )
    if isinstance(given, np.ndarray) and np.iscomplexobj(given):  # NumPy would drop the imaginary parts
        raise ArgumentError(name, f"{wanted}, got complex numbers")
    try:
        entries = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError(name, f"{wanted}, got {describe_value(given)}") from None
    if entries.shape not in ((count,), (count, count)):
        raise ArgumentError(name, f"{wanted}, got {_shape_text(entries.shape)}")
    if not np.isfinite(entries).all():
        raise ArgumentError(name, f"must be finite numbers, got {entries[~np.isfinite(entries)][0]:g}")
    if entries.ndim == 1 and (entries < 0.0).any():
        raise ArgumentError(name, f"must not be negative, got {entries[entries < 0.0][0]:g}")
    largest = float(np.max(np.abs(entries)))
    if largest == 0.0:
        raise ArgumentError(name, "must not be 0 along all directions")
    # scaled before anything is added, so that no sum is infinite
    matrix = (np.diag(entries) if entries.ndim == 1 else entries) / largest
    off = np.abs(matrix - matrix.T)
    if not np.max(off) <= ROUNDING:
        i, j = (int(k) for k in np.unravel_index(np.argmax(off), off.shape))
        pair = (
            f"{entries[i, j]:g} in row {i + 1}, column {j + 1} and "
            f"{entries[j, i]:g} in row {j + 1}, column {i + 1}"
        )
        raise ArgumentError(name, f"must be symmetric, got {pair}")
    matrix = (matrix + matrix.T) / 2.0
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < -ROUNDING:
        raise ArgumentError(name, f"must have no negative eigenvalue, got one of {least * largest:g}")
    return np.asarray(matrix / float(np.max(matrix)))


def _is_diagonal(matrix: Floats) -> bool:
    """Whether all entries off the diagonal are exactly 0."""
    return bool(np.count_nonzero(matrix) == np.count_nonzero(np.diag(matrix)))


def _shape_text(shape: tuple[int, ...]) -> str:
    """A shape in words: 3 numbers, 2 rows of 3 numbers."""
    if len(shape) < 2:
        return f"{shape[0]} numbers" if shape and shape[0] != 1 else "1 number"
    rows = "1 row" if shape[0] == 1 else f"{shape[0]} rows"
    return f"{rows} of {shape[1]} numbers" if len(shape) == 2 else f"an array of shape {shape}"


def ratios_text(matrix: Floats) -> str:
    """A matrix in words: the ratios along the directions, 1 : 0.2, or all of it, (1, 0.1; 0.1, 0.5).

    >>> ratios_text(np.diag([1.0, 0.2])), ratios_text(np.array([[1.0, 0.1], [0.1, 0.5]]))
    ('1 : 0.2', '(1, 0.1; 0.1, 0.5)')
    """
    if _is_diagonal(matrix):
        return " : ".join(f"{entry:.4g}" for entry in np.diag(matrix))
    return "(" + "; ".join(", ".join(f"{entry:.4g}" for entry in row) for row in matrix) + ")"
