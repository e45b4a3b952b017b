"""Walls with a real root, at z = 1 or z = -1.

There everything is real: with the forces F and readings Y = P F that the plant allows, and the velocity estimate
w,

    det(F + k D Y + b w E Y) = 0.

Where w = 0, as at z = 1 and behind most low passes at z = -1, these are lines of one k; under one law for all
directions they are lines of one k + b w. Else, with k = t + s and b w = t - s, there are up to r solutions t for
every s, and all r for a symmetric plant: as many curves, along which k rises and b w falls.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.several_directions.wall_curves import StraightLine
from zwidth.chart.several_directions.wall_equation import WallEquation, adjugate, determinant

# A velocity estimate below this share of 1/T, or an imaginary part below this share of its number, is rounding.
ROUNDING: Final = 1e-9
# A motion at rest is held by no spring where its stiffness is below this share of the largest.
UNSPRUNG: Final = 1e-10
# A number below this share of the plant's stiffness at other frequencies is 0 but for rounding: a free motion's.
ZERO: Final = 1e-13
# Steps of Newton's method after an eigenvalue solver.
POLISH: Final = 3


@dataclass(frozen=True)
class RealRootEquation:
    """Walls [k T, b] with a real root, by s = (k - b w)/2 [N/m].

    forces, readings   F, Y (r, r)
    stiffness, damping s, v (r,) of the law, no two of them 0 in one direction
    estimate           w [1/s], not 0
    real_angle         0 or pi
    period             T [s]
    """

    forces: Floats
    readings: Floats
    stiffness: Floats
    damping: Floats
    estimate: float
    real_angle: float
    period: float

    def solutions(self, parameters: Floats) -> Floats:
        """All walls (N, r, 2) for s (N,) [N/m]."""
        s, T, w = parameters[:, None], self.period, self.estimate
        t = self._eigenvalues(parameters)
        for _ in range(POLISH):
            k, b = t + s, (t - s) / w
            points = np.stack([np.broadcast_to(s, t.shape), k * T, b], axis=-1).reshape(-1, 3)
            value, slopes = (x.reshape(*t.shape, -1) for x in self._determinant(points))
            t = t - value[..., 0] / (slopes[..., 0] * T + slopes[..., 1] / w)
        return np.stack([(t + s) * T, (t - s) / w], axis=-1)

    def linear(self, points: Floats) -> tuple[Floats, Floats]:
        """det W and (k - b w)/2 - s, (n, 2), and their slopes (n, 2, 3) at points (n, 3) of [s, k T, b]."""
        s, x, b = points.T
        value, slopes = self._determinant(points)
        off = 0.5 * (x / self.period - b * self.estimate) - s
        first = np.concatenate([np.zeros((len(s), 1)), slopes], axis=1)
        second = np.array([-1.0, 0.5 / self.period, -0.5 * self.estimate])
        return np.column_stack([value, off]), np.stack([first, np.broadcast_to(second, first.shape)], axis=1)

    def angles(self, parameters: Floats) -> Floats:
        """The same angle everywhere."""
        return np.full(len(parameters), self.real_angle)

    def _determinant(self, points: Floats) -> tuple[Floats, Floats]:
        """det W (n, 1) and its slopes (n, 2) by k T and b, in one unit."""
        _, x, b = points.T
        D = self.stiffness[:, None] * self.readings / self.period
        E = self.estimate * self.damping[:, None] * self.readings
        W = self.forces + x[:, None, None] * D + b[:, None, None] * E
        cofactors = adjugate(W)
        size = np.abs(cofactors).max(axis=(1, 2))[:, None]
        slopes = np.stack([np.einsum("nij,ji->n", cofactors, X) for X in (D, E)], axis=-1)
        return determinant(W)[:, None] / size, slopes / size

    def _eigenvalues(self, parameters: Floats) -> Floats:
        """t (N, r) for s (N,), to the digits of an eigenvalue solver; nan for those that are not real."""
        root = np.sqrt(self.stiffness + self.damping)
        H = self.forces @ np.linalg.inv(self.readings) / np.outer(root, root)
        whole = H + parameters[:, None, None] * np.diag((self.stiffness - self.damping) / root**2)
        # of a symmetric matrix all are real, equal ones too
        t = -np.linalg.eigvalsh(whole) if _is_symmetric(H) else -np.linalg.eigvals(whole)
        return np.sort(_real(t), axis=1)


def real_root_walls(equation: WallEquation) -> tuple[list[StraightLine], list[RealRootEquation]]:
    """Lines and curves of walls with a real root, of directions that the plant couples."""
    lines: list[StraightLine] = []
    curves: list[RealRootEquation] = []
    s, v, T = equation.stiffness, equation.damping, equation.loop.period
    scale = float(np.abs(equation.terms(np.array([np.pi / 2.0]))[0]).max())
    for z, angle in ((1.0, 0.0), (-1.0, np.pi)):
        F, Y = equation.real_columns(z)
        w = float(equation.loop.estimator.response(z)[0].real)
        if not np.isfinite(F).all():
            continue
        if abs(w) * T <= ROUNDING:
            lines += _lines_of_stiffness(equation, F, Y, z, scale)
        elif np.ptp(s) == 0.0 and np.ptp(v) == 0.0:  # one number in all directions
            across = np.array([s[0] / T, v[0] * w])
            length = float(np.hypot(*across))
            numbers = _pencil(F, Y, scale)
            lines += [StraightLine(across / length, number / length, angle, T) for number in numbers]
        else:
            curves.append(RealRootEquation(F, Y, s, v, w, angle, T))
    return lines, curves


def _lines_of_stiffness(
    equation: WallEquation, F: Floats, Y: Floats, z: float, scale: float
) -> list[StraightLine]:
    """Lines of walls with a root at z = 1 or -1, where the velocity estimate is 0.

    Free motions that the law only damps have a root at z = 1 for every wall (`MultiLoop.affine`): it is left out,
    and there are lines of those b that bring another one there.
    """
    s, v, T = equation.stiffness, equation.damping, equation.loop.period
    angle = 0.0 if z > 0.0 else np.pi
    inverse = equation.inverse(z)
    if z > 0.0 and inverse is not None and (s == 0.0).any():
        H, dH = inverse
        free, rest = _free_at_rest(H, s == 0.0, UNSPRUNG * scale)
        dw = float(equation.loop.estimator.response(z)[1].real)
        damped = _pencil(free.T @ dH @ free, dw * (free.T * v) @ free, scale / dw)
        sprung = _pencil(rest.T @ H @ rest, (rest.T * s) @ rest, scale)
        lines = [StraightLine(np.array([0.0, 1.0]), b, angle, T) for b in damped]
    else:
        sprung, lines = _pencil(F, s[:, None] * Y, scale), []
    return [*lines, *(StraightLine(np.array([1.0, 0.0]), k * T, angle, T) for k in sprung)]


def _free_at_rest(H: Floats, unsprung: Flags, least: float) -> tuple[Floats, Floats]:
    """Orthonormal bases (r, n), (r, r - n) of motions that neither plant nor law hold at rest, and of the others.

    unsprung  (r,) directions in which the law has no stiffness;  least  stiffness that is more than rounding
    """
    r, own = len(H), np.flatnonzero(unsprung)
    _, size, V = np.linalg.svd(H[:, own])
    free = np.zeros((r, int(np.sum(size <= least))))
    free[own] = V[size <= least].T
    return free, scipy.linalg.null_space(free.T) if free.size else np.eye(r)


def _pencil(A: Floats, B: Floats, scale: float) -> list[float]:
    """Real x with det(A + x B) = 0, of a size up to `scale`."""
    if not len(A):
        return []
    alpha, beta = scipy.linalg.eig(A, -B, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-12 * np.abs(beta).max(initial=0.0)
    x = _real(alpha[finite] / beta[finite], ZERO * scale)
    x = x[np.isfinite(x)]
    for _ in range(POLISH):
        W = A + x[:, None, None] * B
        step = determinant(W) / np.einsum("nij,ji->n", adjugate(W), B)
        x = np.where(np.abs(step) < 0.1 * np.abs(x), x - step, x)
    return [float(value) if abs(value) > ZERO * scale else 0.0 for value in x]


def _real(x: Complexes | Floats, least: float = 0.0) -> Floats:
    """Real parts of what is real but for rounding; nan for what is not."""
    return np.where(np.abs(x.imag) <= ROUNDING * np.abs(x) + least, x.real, np.nan)


def _is_symmetric(H: Floats) -> bool:
    return bool(np.abs(H - H.T).max() <= ROUNDING * np.abs(H).max())
