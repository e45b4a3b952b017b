"""Verdicts on walls by eigenvalues of the transition matrix: stable, unstable, or undecided within rounding.

Whether walls are on the stability limit: their largest root lies on the unit circle, as far as rounding tells.

The rule is that of verdicts on single walls, with the digits that a computed wall has: a wall of an edge is off
where `check` would find walls stable, or unstable, all round it within `WALL_ROUNDING`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop, set_aside, unheld_positions
from zwidth.model.argument_checks import broadcast_walls, check_kind
from zwidth.progress import Progress
from zwidth.result import Result

# Half-width of the band round the unit circle in which stability is left undecided.
BAND = 1e-9
# Rounding of an eigenvalue in units of its own condition number.
ROUNDING = 1e-15
# What rounding moves an eigenvalue by at most that has a neighbour within COALESCING: a pair that coalesces moves
# with the square root of rounding, which bounds what 1/0 cannot. Of one that stands alone its condition tells.
MOST_ROUNDING, COALESCING = 1e-6, 1e-4
NEAR = 1e-4  # distance from the unit circle within which an eigenvalue's own error may decide
UNSTABLE, UNDECIDED, STABLE = -1, 0, 1
BATCH_SIZE = 20_000  # walls judged in one batch of transition matrices
NAMES = {STABLE: "stable", UNDECIDED: "undecided", UNSTABLE: "unstable"}


@dataclass(frozen=True, repr=False)
class WallVerdicts(Result):
    """Verdicts on walls (...).

    stiffness, damping  of the walls [N/m], [N s/m]
    verdict             STABLE, UNSTABLE or UNDECIDED
    frequency           of the vibration that each wall is nearest to, or grows in [Hz]
    """

    stiffness: Floats
    damping: Floats
    verdict: NDArray[np.int8]
    frequency: Floats

    @property
    def names(self) -> list[str]:
        """The verdicts in words, flattened."""
        return [NAMES[int(v)] for v in self.verdict.ravel()]

    def table(self) -> dict[str, list[Any]]:
        """The walls as columns, one a row; the spectral radius is not known without a model."""
        return {
            "stiffness_N_per_m": self.stiffness.ravel().tolist(),
            "damping_Ns_per_m": self.damping.ravel().tolist(),
            "verdict": self.names,
            "spectral_radius": [None] * self.verdict.size,
            "frequency_Hz": self.frequency.ravel().tolist(),
        }

    def document(self) -> dict[str, Any]:
        """The walls under the key `points`, each with its verdict."""
        columns = self.table()
        return {"points": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]}

    def __repr__(self) -> str:
        """The verdict on a single wall, or how many walls have each verdict."""
        names = self.names
        if len(names) == 1:
            wall = f"{float(self.stiffness.ravel()[0]):.6g} N/m, {float(self.damping.ravel()[0]):.6g} N s/m"
            return f"{type(self).__name__}: {wall} is {names[0]}"
        counted = ", ".join(f"{names.count(name)} {name}" for name in NAMES.values() if name in names)
        return f"{type(self).__name__}: {len(names)} walls, {counted}"


@dataclass(frozen=True, repr=False)
class Verdicts(WallVerdicts):
    """Verdicts on walls (...) by eigenvalues; the frequency is that of the largest root, |arg z| / (2 pi T).

    spectral_radius  largest |z|
    uncertainty      half-width of the undecided band: 1e-9, more where the root is ill-conditioned
    unheld           how many roots z = 1 were set aside, each the position that nobody holds on a wall without
                     stiffness (`loop.unheld_positions`)
    """

    spectral_radius: Floats
    uncertainty: Floats
    unheld: Ints

    def table(self) -> dict[str, list[Any]]:
        """The walls as columns, with spectral radius and number of unheld positions."""
        return super().table() | {
            "spectral_radius": self.spectral_radius.ravel().tolist(),
            "unheld_positions": self.unheld.ravel().tolist(),
        }


def eigenvalues(loop: Loop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Complexes:
    """All eigenvalues z (..., N) of the transition matrix (thesis eq. 2.41), unobserved motions left out."""
    check_kind("loop", loop, Loop)
    K, B = broadcast_walls(wall_stiffness, wall_damping, finite=True)
    return np.asarray(np.linalg.eigvals(loop.transition_matrix(K, B)), dtype=complex)


def spectral_radius(loop: Loop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
    """Largest |z| (...) of walls K, B (...) that broadcast; nan for one of many that is not finite."""
    return judge(loop, wall_stiffness, wall_damping).spectral_radius


def judge(loop: Loop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
    """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast.

    stable: |z| < 1 - u for all roots; unstable: |z| > 1 + u for one; undecided between, where u is 1e-9 or the
    rounding error of the dominant eigenvalue (from its condition number), whichever is larger. On a wall with
    K = 0 the root z = 1 of the position that nobody holds is set aside (`loop.unheld_positions`). One of many
    walls that is not finite is undecided, with nan, and so is one so large that its transition matrix is not
    finite.

    Raises  ValueError  for a single wall that is not finite
    """
    check_kind("loop", loop, Loop)
    return verdicts(loop, wall_stiffness, wall_damping)


def verdicts(
    loop: Loop | MultiLoop,
    wall_stiffness: ArrayLike,
    wall_damping: ArrayLike,
    progress: Progress | None = None,
) -> Verdicts:
    """`judge`, for loops of several directions, too.

    progress  called with "walls", the walls judged, and all walls
    """
    K, B = broadcast_walls(wall_stiffness, wall_damping)
    judged = []
    for first in range(0, max(K.size, 1), BATCH_SIZE):
        walls = slice(first, first + BATCH_SIZE)
        judged.append(_judge_batch(loop, K.ravel()[walls], B.ravel()[walls]))
        if progress is not None:
            progress("walls", min(first + BATCH_SIZE, K.size), K.size)
    verdict, frequency, radius, width = (
        np.concatenate(parts).reshape(K.shape) for parts in zip(*judged, strict=True)
    )
    return Verdicts(K, B, verdict, frequency, radius, width, _unheld(loop, K))


def _unheld(loop: Loop | MultiLoop, K: Floats) -> Ints:
    """Number (...) of positions that nobody holds on each wall K (...): 0 unless K is 0."""
    free = K == 0.0
    return np.where(free, unheld_positions(loop) if np.any(free) else 0, 0)


def _judge_batch(loop: Loop | MultiLoop, K: Floats, B: Floats) -> tuple[NDArray[np.int8], Floats, Floats, Floats]:
    """Verdict, frequency, spectral radius and half-width of the undecided band of walls (k,): undecided, nan, nan
    and BAND where a wall or its transition matrix is not finite."""
    finite = np.isfinite(K) & np.isfinite(B)
    with np.errstate(over="ignore", invalid="ignore"):
        L = loop.transition_matrix(np.where(finite, K, 0.0), np.where(finite, B, 0.0))
    # 0 stands for what is not finite, until nan does
    finite &= np.all(np.isfinite(L), axis=(-2, -1))
    L = np.where(finite[..., None, None], L, 0.0)
    z = np.linalg.eigvals(L).astype(complex)
    unheld = _unheld(loop, K)
    for count in np.unique(unheld[unheld > 0]):
        z[unheld == count] = set_aside(z[unheld == count], int(count))
    dominant = np.argmax(np.abs(z), axis=-1)
    top = np.take_along_axis(z, dominant[..., None], axis=-1)[..., 0]
    radius = np.where(finite, np.abs(top), np.nan)
    frequency = np.where(finite, np.abs(np.angle(top)) / (2.0 * np.pi * loop.period), np.nan)
    width = np.full(radius.shape, BAND)
    for index in np.argwhere(np.abs(radius - 1.0) < NEAR):
        at = tuple(index)
        width[at] = max(BAND, rounding_of_roots(L[at], float(radius[at])))
    verdict = np.where(radius < 1.0 - width, STABLE, np.where(radius > 1.0 + width, UNSTABLE, UNDECIDED))
    return verdict.astype(np.int8), frequency, radius, width


def rounding_of_roots(L: Floats, radius: float | None = None, rounding: float = ROUNDING) -> float:
    """Error of the eigenvalues of a radius, by default the largest, of a matrix known to a relative rounding:
    rounding times norm times condition (1 / |y^H x|).

    The matrix is balanced first as the eigenvalue solver does it, so that units do not enter. Left vectors are the
    solver's own: where two roots coalesce, as both of a free mass do, the right ones are parallel and have no
    inverse.
    """
    from scipy.linalg import eig

    balanced = _balance(L)
    z, left, right = eig(balanced, left=True, right=True)
    with np.errstate(divide="ignore"):
        condition = 1.0 / np.abs(np.sum(left.conj() * right, axis=0))
    error = rounding * float(np.linalg.norm(balanced)) * condition
    apart = np.abs(z[:, None] - z) + np.where(np.eye(len(z)), np.inf, 0.0)
    error = np.where(apart.min(axis=1, initial=np.inf) < COALESCING, np.minimum(error, MOST_ROUNDING), error)
    # of the roots within 1e-6 of the radius, or of the nearest ones, the largest error
    distance = np.abs(np.abs(z) - (np.max(np.abs(z)) if radius is None else radius))
    return float(np.max(error[distance <= max(1e-6, float(np.min(distance)))]))


def _balance(L: Floats) -> Floats:
    """Diagonal similarity by powers of two that evens out rows and columns (Parlett and Reinsch 1969)."""
    A = L.copy()
    for _ in range(30):
        settled = True
        for i in range(len(A)):
            # sizes of a column and of its row, without the diagonal, which a similarity does not change
            column = np.sum(np.abs(A[:, i])) - abs(A[i, i])
            row = np.sum(np.abs(A[i])) - abs(A[i, i])
            if column > 0.0 and row > 0.0:
                scale = 2.0 ** np.round(0.5 * np.log2(row / column))
                if scale != 1.0:
                    A[:, i] *= scale
                    A[i] /= scale
                    settled = False
        if settled:
            break
    return A


# How exactly a wall of an edge is known, relative. Less would call walls off whose root has a neighbour that moves
# it: where two nearly coalesce they part with the square root of it.
WALL_ROUNDING: Final = 1e-12
# Two roots closer than this are judged by their mean: where they meet, at a corner, the last digits of a wall set
# them apart by 1e-8 to 1e-6, and their mean not at all. Larger, and roots that differ pass as one.
TOGETHER: Final = 1e-5
AT_ONCE: Final = 4000  # walls judged in one batch of transition matrices


def sides_of_circle(loop: Loop | MultiLoop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
    """Where the largest |z| of walls K, B (k,) is: outside the circle 1, inside -1; 0 on it, but for rounding."""
    return np.sign(distances_from_circle(loop, wall_stiffness, wall_damping))


def distances_from_circle(
    loop: Loop | MultiLoop,
    wall_stiffness: ArrayLike,
    wall_damping: ArrayLike,
    radius: float = 1.0,
    band: float = BAND,
) -> Floats:
    """How far outside the circle |z| = radius the largest root of walls K, B (k,) is, negative inside; 0 for one
    that is there, but for rounding, or within a band of it, or whose mean with another one close by is."""
    K, B = np.asarray(wall_stiffness, dtype=np.float64), np.asarray(wall_damping, dtype=np.float64)
    away = np.zeros(len(K))
    for first in range(0, len(K), AT_ONCE):
        L = loop.transition_matrix(K[first : first + AT_ONCE], B[first : first + AT_ONCE])
        z = np.linalg.eigvals(L)
        some = np.abs(z).max(axis=-1) - radius
        for k in np.flatnonzero(np.abs(some) > band).tolist():
            # two roots that meet on the circle, set apart by the last digits of the wall
            if abs(_distance_of_mean(z[k], radius)) <= band:
                continue
            if abs(some[k]) > rounding_of_roots(L[k], rounding=WALL_ROUNDING):
                away[first + k] = some[k]
    return away


def _distance_of_mean(z: NDArray[Any], radius: float) -> float:
    """How far outside the circle |z| = radius the largest of roots z (n,) is, negative inside; it and a neighbour
    within TOGETHER taken as their mean."""
    top = int(np.argmax(np.abs(z)))
    beside = np.abs(z - z[top])
    beside[top] = np.inf
    other = int(np.argmin(beside))
    if not beside[other] <= TOGETHER:
        return float(np.abs(z[top]) - radius)
    rest = np.abs(np.delete(z, [top, other])).max(initial=0.0)
    return float(max(rest, np.abs(z[top] + z[other]) / 2.0) - radius)
