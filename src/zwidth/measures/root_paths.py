"""Paths of a loop's eigenvalues as one number changes: a wall's damping, a mass (thesis Figs. 5.10 to 5.14).

Eigenvalue solvers return them in any order. Neighbouring steps are matched so that the sum of all motions is least
(an assignment problem), and a step is halved until the match is certain: each eigenvalue moves little, and is
nearer to its match than to any other by a factor of two.

Two real eigenvalues that meet and go on as a conjugate pair move with the square root of the number, and they
can be matched either way afterwards. There halving ends once the difference is too small to see. Two that pass
through each other, as only those of uncoupled motions do, may be exchanged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.verdict import BAND
from zwidth.errors import NoAnswerError
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind
from zwidth.result import Documented, Result, documented, entry

# A step along a path longer than this share of its |z|, or of 1, is halved; one shorter than the second length is
# not, whatever its neighbours do: it is too small to see.
LONG: Final = 0.1
SHORT: Final = 1e-3
# Halvings of one step at most, where eigenvalues jump.
HALVINGS: Final = 40
SHOWN: Final = 4  # crossings that a repr names


def _parts(z: Any) -> dict[str, Any]:
    """Real and imaginary part by key."""
    return {"real": z.real, "imag": z.imag}


@dataclass(frozen=True)
class Crossing(Documented):
    """A path that crosses the unit circle.

    value       of the number
    eigenvalue  z there, |z| = 1 to rounding
    path        index of the path
    outwards    whether z leaves the circle's inside as the number grows along the path
    """

    value: float = field(metadata=entry())
    eigenvalue: complex = field(metadata=entry(value=_parts, spread=True))
    path: int = field(metadata=entry())
    outwards: bool = field(metadata=entry())


@dataclass(frozen=True, repr=False)
class EigenvaluePaths(Result):
    """Eigenvalues along a path of one number.

    values       (k,)    the values given, in their order, and those added between them
    requested    (k,)    whether the value was given
    eigenvalues  (k, N)  each column one path
    crossings    of the unit circle, in the order of the values
    """

    values: Floats = field(metadata=entry())
    requested: Flags = field(metadata=entry(name="asked"))
    eigenvalues: Complexes = field(metadata=entry(value=_parts, spread=True))
    crossings: tuple[Crossing, ...] = field(metadata=entry())

    @property
    @documented(before="crossings")
    def spectral_radius(self) -> Floats:
        """Largest |z| (k,)."""
        return np.asarray(np.abs(self.eigenvalues).max(axis=1))

    def table(self) -> dict[str, Any]:
        """A row for each value; the real and imaginary part of each path, counted from 0."""
        parts = [(f"real_{i}", z.real) for i, z in enumerate(self.eigenvalues.T)]
        parts += [(f"imag_{i}", z.imag) for i, z in enumerate(self.eigenvalues.T)]
        return {
            "value": self.values,
            "asked": self.requested,
            "spectral_radius": self.spectral_radius,
            **dict(parts),
        }

    def __repr__(self) -> str:
        """Lines with the number of paths, the range of the values, and where paths cross the unit circle."""
        paths = self.eigenvalues.shape[1]
        lines = [f"EigenvaluePaths: {paths} paths over values from {self.values[0]:g} to {self.values[-1]:g}"]
        ways = {True: "out of", False: "into"}
        crossed = ", ".join(f"{ways[c.outwards]} it at {c.value:.6g}" for c in self.crossings[:SHOWN])
        more = f" and {len(self.crossings) - SHOWN} more" if len(self.crossings) > SHOWN else ""
        lines.append(f"unit circle: {crossed}{more}" if crossed else "no path crosses the unit circle")
        return "\n  ".join(lines)


def eigenvalue_paths(matrix_at: Callable[[float], ArrayLike], values: ArrayLike) -> EigenvaluePaths:
    """Eigenvalues of matrices (N, N) that depend on a number, followed from value to value.

    matrix_at  value -> matrix, of one size and continuous along the way
    values     (k,)  at least two, rising or falling
    Raises     NoAnswerError   where the number of eigenvalues changes, or a matrix is not finite
               ValueError  for values that neither rise nor fall

    >>> paths = eigenvalue_paths(lambda a: [[0.0, 1.0], [-a, 1.0]], [0.0, 1.2])    # z^2 - z + a
    >>> paths.spectral_radius[paths.requested].round(6).tolist()
    [1.0, 1.095445]
    >>> [(round(c.value, 9), c.outwards) for c in paths.crossings]                 # both of the pair, at a = 1
    [(1.0, True), (1.0, True)]
    """
    requested = np.asarray(values, dtype=np.float64)
    steps = np.diff(requested)
    if requested.ndim != 1 or len(requested) < 2 or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError("values must be at least two numbers in rising or falling order")
    walk = _PathTracer(matrix_at, requested)
    crossings = [crossing for path in range(walk.z.shape[1]) for crossing in walk.crossings(path)]
    crossings.sort(key=lambda crossing: (crossing.value, crossing.path), reverse=bool(steps[0] < 0.0))
    return EigenvaluePaths(walk.values, np.isin(walk.values, requested), walk.z, tuple(crossings))


def loop_paths(
    loop_at: Callable[[float], Loop], values: ArrayLike, wall_stiffness: float, wall_damping: float
) -> EigenvaluePaths:
    """Eigenvalues of one wall's transition matrix while the loop changes: a mass, a delay, any number of the file.

    loop_at  value -> loop
    wall_stiffness, wall_damping  K [N/m] and B [N s/m] of the wall
    values, and what is raised    as for `eigenvalue_paths`
    """
    return eigenvalue_paths(lambda value: loop_at(value).transition_matrix(wall_stiffness, wall_damping), values)


def wall_paths(loop: Loop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> EigenvaluePaths:
    """Eigenvalues of one loop along a straight line of walls, from the first to the last (thesis Fig. 5.10).

    wall_stiffness  K [N/m]
    wall_damping    B [N s/m]; one of the two is a list (k,), rising or falling, the other one number
    Returns         paths over the values of the list
    Raises          ValueError  unless exactly one of them is a list, and all are finite

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one, none = np.ones(1), np.zeros((1, 1))
    >>> free = Loop(Plant(np.array([[1.0]]), none, none, one, one), Controller(1.0))
    >>> [round(c.value, 6) for c in wall_paths(free, 0.5, np.linspace(0.0, 2.0, 9)).crossings]    # thesis eq. 4.14
    [0.359612, 0.359612, 1.390388, 1.390388]
    """
    check_kind("loop", loop, Loop)
    K, B = np.asarray(wall_stiffness, dtype=np.float64), np.asarray(wall_damping, dtype=np.float64)
    if K.ndim + B.ndim != 1:
        raise ValueError("one of stiffness and damping must be a list of values and the other a single number")
    if not (np.all(np.isfinite(K)) and np.all(np.isfinite(B))):
        raise ValueError("walls must be finite")
    if B.ndim:
        return eigenvalue_paths(lambda value: loop.transition_matrix(K, value), B)
    return eigenvalue_paths(lambda value: loop.transition_matrix(value, B), K)


class _PathTracer:
    """Eigenvalues followed along values: `values` (k,), and `z` (k, N), each column one path.

    steps  value and eigenvalues (N,) of each step so far
    """

    def __init__(self, matrix_at: Callable[[float], ArrayLike], requested: Floats) -> None:
        """Trace the eigenvalues of `matrix_at` over the requested values (k,)."""
        self.matrix_at = matrix_at
        first = float(requested[0])
        self.steps = [(first, self.eigenvalues_at(first))]
        for end in requested[1:].tolist():
            self.trace_to(end, self.eigenvalues_at(end), HALVINGS)
        self.values = np.array([value for value, _ in self.steps])
        self.z: Complexes = np.array([z for _, z in self.steps])

    def eigenvalues_at(self, value: float) -> Complexes:
        """Eigenvalues (N,) of the matrix at a value, in any order."""
        matrix = np.asarray(self.matrix_at(value), dtype=np.float64)
        if not np.all(np.isfinite(matrix)):
            raise NoAnswerError(f"the transition matrix at {value:g} is not finite")
        return np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)

    def trace_to(self, end: float, unordered: Complexes, halvings: int) -> None:
        """Add the eigenvalues (N,) at `end`, given unordered, and steps between while the match is uncertain.

        halvings  how often the way to `end` may still be halved
        Raises    NoAnswerError  where the number of eigenvalues changes
        """
        start, z = self.steps[-1]
        if len(z) != len(unordered):
            raise NoAnswerError(
                f"there are {len(z)} eigenvalues at {start:g} and {len(unordered)} at {end:g}: a motion or a "
                "delayed sample comes or goes between, and paths would begin or end; choose values on one side"
            )
        matched, certain = _match(z, unordered)
        middle = 0.5 * (start + end)
        if certain or halvings == 0 or middle in (start, end):
            self.steps.append((end, matched))
            return
        self.trace_to(middle, self.eigenvalues_at(middle), halvings - 1)
        self.trace_to(end, unordered, halvings - 1)

    def crossings(self, path: int) -> list[Crossing]:
        """Crossings of the unit circle by one path; a path that only comes near the circle has none."""
        height = np.abs(self.z[:, path]) - 1.0
        off = np.flatnonzero(np.abs(height) > BAND)
        crossings = []
        for i, j in pairwise(off.tolist()):
            if height[i] * height[j] < 0.0:
                # of the steps between, all but one end in the band
                at = i + int(np.argmax(height[i + 1 : j + 1] * height[j] > 0.0))
                crossings.append(self.crossing(path, at, bool(height[j] > 0.0)))
        return crossings

    def crossing(self, path: int, at: int, outwards: bool) -> Crossing:
        """The crossing of path number `path` between step `at` and the next, by Brent's method (1973).

        outwards  whether the path leaves the circle there
        """
        from scipy.optimize import brentq

        (low, high), (z_low, z_high) = self.values[at : at + 2].tolist(), self.z[at : at + 2, path].tolist()

        def here(value: float) -> complex:
            """Eigenvalue of the path at a value between the two steps."""
            # the match is certain: between its ends nothing else is as near to the straight line
            z = self.eigenvalues_at(value)
            line = z_low + (z_high - z_low) * (value - low) / (high - low)
            return complex(z[np.argmin(np.abs(z - line))])

        finest = 4.0 * float(np.finfo(float).eps)
        size = max(abs(low), abs(high))
        value = brentq(lambda v: abs(here(v)) - 1.0, low, high, xtol=finest * size, rtol=finest)
        return Crossing(float(value), here(value), path, outwards)


def _match(z: Complexes, others: Complexes) -> tuple[Complexes, bool]:
    """`others` (N,) in the order of z (N,), so that all together move least, and whether the match is certain."""
    from scipy.optimize import linear_sum_assignment

    distance = np.abs(z[:, None] - others)
    assignment = linear_sum_assignment(distance)
    distance_moved, other_distances = distance[assignment], distance.copy()
    other_distances[assignment] = np.inf
    distinct = distance_moved <= 0.5 * other_distances.min(axis=1, initial=np.inf)
    certain = (distance_moved <= SHORT) | (distinct & (distance_moved <= LONG * np.maximum(np.abs(z), 1.0)))
    return others[assignment[1]], bool(np.all(certain))
