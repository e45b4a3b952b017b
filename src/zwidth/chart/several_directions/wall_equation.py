"""The walls with a root at a given angle on the unit circle: all of them, and where they move to.

Along r principal directions of the law the loop is det(1 + P(z) (k D + b w(z) E)) = 0, D = diag(s), E = diag(v).
At z = exp(i theta) that is one complex equation of degree r in two real unknowns, with up to r^2 solutions. The
forces and readings that the plant allows, y = P f, are the columns of F and Y, and a wall f = -(k D + b w E) y has
a root there where

    W(k, b) = F + k D Y + b w E Y

is singular. Together with its complex conjugate that is a two-parameter eigenvalue problem (Atkinson 1972, known
at second hand): with A = F, B = D Y, C = w E Y, Kronecker's product x and the bar of complex conjugates

    Delta_0 = B x C' - C x B',     Delta_1 = C x A' - A x C',     Delta_2 = A x B' - B x A'

all its solutions are the common eigenvalues Delta_1 u = k Delta_0 u, Delta_2 u = b Delta_0 u, and Newton's method
on det W and its conjugate takes them to rounding.

Where on the unit circle curves of walls of several directions turn: near poles and zeros.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple, TypeVar

import numpy as np
import scipy.linalg

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.circle_sampling import sample_angles
from zwidth.loop.multi_loop import MultiLoop

Matrices = TypeVar("Matrices", Floats, Complexes)

# Imaginary part of a real solution after Newton's method, in shares of the wall's size; how far that may move a
# solution; and how far apart two are at least.
REAL, STAYS, TWICE = 1e-7, 0.1, 1e-10
POLISH: Final = 5
# Combinations of the three Delta, none of whose zeros a structured loop prefers.
LEFT: Final = (1.0, 0.31 + 0.42j, -0.53 + 0.27j)
RIGHT: Final = (0.61 - 0.3j, 0.2 + 0.7j, 0.45 + 0.1j)


class _Frame(NamedTuple):
    """Forces and readings that the plant allows at N angles, and their slopes by the angle.

    F, Y, dF, dY  (N, r, r);  w, dw  (N,) the velocity estimate
    """

    F: Complexes
    Y: Complexes
    dF: Complexes
    dY: Complexes
    w: Complexes
    dw: Complexes


@dataclass(frozen=True)
class WallEquation:
    """Walls [k T, b] with a pair of roots at exp(+-i theta), of directions that the plant couples.

    loop               the loop
    directions         (r', r)  combinations of the law's principal directions, orthonormal
    stiffness, damping (r',)    s and v of the law along each
    """

    loop: MultiLoop
    directions: Floats
    stiffness: Floats
    damping: Floats

    @property
    def real_angle(self) -> None:
        """None: the roots are a pair."""

    def solutions(self, thetas: Floats) -> Floats:
        """All real walls (N, r^2, 2) of [k T, b] with a root at each angle (N,); nan for the others."""
        terms = self.terms(thetas)
        first = k, b = _common_eigenvalues(*terms)
        for _ in range(POLISH):
            k, b = _newton_step(terms, k, b)
        # b in units of k: as much of C weighs as one of B
        unit = (np.linalg.norm(terms[2], axis=(1, 2)) / np.linalg.norm(terms[1], axis=(1, 2)))[:, None]
        size = np.abs(k) + unit * np.abs(b)
        # what was at infinity but for rounding does not stay near where it was
        found = np.abs(k - first[0]) + unit * np.abs(b - first[1]) <= STAYS * size
        found &= np.abs(k.imag) + unit * np.abs(b.imag) <= REAL * size
        # of solutions that are one, which Newton's method has led together, the first stays
        apart = np.abs(k[:, :, None] - k[:, None]) + unit[..., None] * np.abs(b[:, :, None] - b[:, None])
        found &= ~(np.tril(apart <= TWICE * size[..., None], -1) & found[:, None]).any(axis=2)
        walls = np.stack([k.real * self.loop.period, b.real], axis=-1)
        return np.where((found & np.isfinite(walls).all(axis=-1))[..., None], walls, np.nan)

    def linear(self, points: Floats) -> tuple[Floats, Floats]:
        """det W (n, 2), real and imaginary part, and its slopes (n, 2, 3) at points (n, 3) of [theta, k T, b],
        divided by the largest cofactor of W: its zeros stay."""
        theta, x, b = points.T
        f = self._frame(theta)
        A, B, C = self._terms(f)
        s, v = self.stiffness[:, None], self.damping[:, None]
        k, b = (x / self.loop.period)[:, None, None], b[:, None, None]
        W = A + k * B + b * C
        dW = f.dF + k * (s * f.dY) + b * (v * (f.dw[:, None, None] * f.Y + f.w[:, None, None] * f.dY))
        cofactors = adjugate(W)
        size = np.abs(cofactors).max(axis=(1, 2))[:, None]
        slopes = np.stack([_trace(cofactors, X) for X in (dW, B / self.loop.period, C)], axis=-1) / size
        value = determinant(W)[:, None] / size
        return np.concatenate([value.real, value.imag], axis=1), np.stack([slopes.real, slopes.imag], axis=1)

    def angles(self, thetas: Floats) -> Floats:
        """The angles of the roots: the parameters themselves."""
        return thetas

    def terms(self, thetas: Floats) -> tuple[Complexes, Complexes, Complexes]:
        """A, B, C (N, r, r) of W = A + k B + b C at angles (N,)."""
        return self._terms(self._frame(thetas))

    def real_columns(self, z: float) -> tuple[Floats, Floats]:
        """F and Y (r, r) at z = 1 or -1, where both are real; F nan where P has no inverse there."""
        inverse, one = self.inverse(z), np.eye(len(self.directions))
        if inverse is None:
            return np.full_like(one, np.nan), one
        if z > 0.0:  # P has its poles of free motions there
            return inverse[0], one
        at = np.array([z], dtype=complex)
        P = (self.directions @ self.loop.plant_slope(at, at - 1.0)[0] @ self.directions.T).real
        F, Y, _ = _forces_and_readings(P, inverse[0][None])
        return F[0], Y[0]

    def inverse(self, z: float) -> tuple[Floats, Floats] | None:
        """H = P^-1 and its slope by z (r, r) at z = 1 or -1; None where there is none."""
        at, S = np.array([z], dtype=np.complex128), self.directions
        try:
            H, dH = (S @ X[0].real @ S.T for X in self.loop.inverse_slope(at, at - 1.0))
        except np.linalg.LinAlgError:
            return None
        return (H, dH) if np.isfinite(H).all() else None

    def _frame(self, thetas: Floats) -> _Frame:
        """Forces and readings that the plant allows at angles (N,), and their slopes by the angle."""
        z, d = on_circle(thetas)  # d = z - 1;  turn = dz/dtheta
        S, turn = self.directions, 1j * z[:, None, None]
        P, dP = (S @ X @ S.T for X in self.loop.plant_slope(z, d))
        w, dw = self.loop.estimator.response(z, d)
        H = dH = None
        if len(S) > 1:  # of one direction P alone is enough
            try:
                H, dH = (S @ X @ S.T for X in self.loop.inverse_slope(z, d))
            except np.linalg.LinAlgError:  # readings that depend on each other
                H = dH = None
        F, Y, small = _forces_and_readings(P, H)
        # columns with Y = P F keep F along the angle, those with F = H Y keep Y
        dF, dY = np.zeros_like(F), turn * dP @ F
        if dH is not None:
            dF, dY = np.where(small, turn * dH @ Y, 0.0), np.where(small, 0.0, dY)
        return _Frame(F, Y, dF, dY, w, 1j * z * dw)

    def _terms(self, f: _Frame) -> tuple[Complexes, Complexes, Complexes]:
        """`terms` from forces and readings that are known already."""
        s, v = self.stiffness[:, None], self.damping[:, None]
        return f.F, s * f.Y, f.w[:, None, None] * (v * f.Y)


def _forces_and_readings(P: Matrices, H: Matrices | None) -> tuple[Matrices, Matrices, Flags]:
    """Forces F and readings Y (N, r, r) with Y = P F, and which columns (N, 1, r) are small singular values' of P:
    none (N, r, r) where H is None.

    Large singular values are taken from P, small ones from its inverse H, which was computed without forming P:
    near z = 1 a free motion would hide the others in rounding.
    """
    Y, size, V = np.linalg.svd(P)
    F = _adjoint(V) / size[:, None, :]
    if H is None:
        return F, Y, np.zeros(F.shape, dtype=np.bool_)
    # singular values of H descend, those of P that they belong to ascend
    forces, inverse, V = np.linalg.svd(H)
    readings = _adjoint(V) / inverse[:, None, :]
    # below the geometric mean of the largest and the smallest; the smallest is that of the inverse
    small = (size**2 * inverse[:, :1] < size[:, :1])[:, None, :] & (inverse[:, None, ::-1] > 0.0)
    return np.where(small, forces[..., ::-1], F), np.where(small, readings[..., ::-1], Y), small


def determinant(W: Matrices) -> Matrices:
    """det W (...) of small matrices (..., r, r), by expansion: as exact as that of matrices a rounding away."""
    if W.shape[-1] == 1:
        return W[..., 0, 0]
    if W.shape[-1] == 2:
        return W[..., 0, 0] * W[..., 1, 1] - W[..., 0, 1] * W[..., 1, 0]
    total = np.zeros(W.shape[:-2], dtype=W.dtype)
    for j in range(W.shape[-1]):
        total += (-1) ** j * W[..., 0, j] * determinant(np.delete(W[..., 1:, :], j, axis=-1))
    return total


def adjugate(W: Matrices) -> Matrices:
    """adj W (..., r, r), with W adj W = det W: finite, and the slope of det W, where W is singular."""
    r = W.shape[-1]
    if r == 1:
        return np.ones_like(W)
    out = np.empty_like(W)
    if r == 2:
        out[..., 0, 0], out[..., 1, 1] = W[..., 1, 1], W[..., 0, 0]
        out[..., 0, 1], out[..., 1, 0] = -W[..., 0, 1], -W[..., 1, 0]
        return out
    for i in range(r):
        rows = np.delete(W, i, axis=-2)
        for j in range(r):
            out[..., j, i] = (-1) ** (i + j) * determinant(np.delete(rows, j, axis=-1))
    return out


def _common_eigenvalues(A: Complexes, B: Complexes, C: Complexes) -> tuple[Complexes, Complexes]:
    """k and b (N, r^2) at which A + k B + b C and its conjugate are singular, as exact as eigenvalues are.

    Solutions at infinity are eigenvalues as well if combinations of all three Delta are taken: their k and b are
    quotients by Delta_0 u, which is 0 there but for rounding, and so are huge and mean nothing, inf or nan.
    Where A, B or C is 0, k and b are nan: without B or C there are lines of walls; C is 0 beside z = -1 behind a
    low pass, once w is in rounding.
    """
    sized = np.all([np.linalg.norm(X, axis=(1, 2)) > 0.0 for X in (A, B, C)], axis=0)
    if not sized.all():
        k, b = np.full((2, len(A), A.shape[-1] ** 2), np.nan, dtype=np.complex128)
        k[sized], b[sized] = _common_eigenvalues(A[sized], B[sized], C[sized])
        return k, b
    # A, B and C are brought to one size, and their columns too
    size = np.linalg.norm(A, axis=(1, 2))
    unit_k, unit_b = size / np.linalg.norm(B, axis=(1, 2)), size / np.linalg.norm(C, axis=(1, 2))
    B, C = B * unit_k[:, None, None], C * unit_b[:, None, None]
    columns = np.linalg.norm(np.concatenate([A, B, C], axis=1), axis=1, keepdims=True)
    A, B, C = A / columns, B / columns, C / columns  # errors of eigenvectors are those of their largest entries
    deltas = [_kron(X, Y) - _kron(Y, X) for X, Y in ((B, C), (C, A), (A, B))]
    # two combinations of the Delta, of which neither is singular
    left, right = (sum(c * D for c, D in zip(cs, deltas, strict=True)) for cs in (LEFT, RIGHT))
    _, u = np.linalg.eig(np.linalg.solve(left, right))
    # Rayleigh's quotients of the Delta at the common eigenvectors u, each over that of Delta_0
    row = np.conj(left @ u)
    own, k, b = (np.sum(row * (D @ u), axis=1) for D in deltas)
    return unit_k[:, None] * k / own, unit_b[:, None] * b / own


def _kron(X: Complexes, Y: Complexes) -> Complexes:
    """Kronecker's product (N, r^2, r^2) of X and the conjugate of Y."""
    n = X.shape[-1] ** 2
    return np.asarray(np.einsum("nij,nkl->nikjl", X, np.conj(Y)).reshape(-1, n, n))


def _newton_step(
    terms: tuple[Complexes, Complexes, Complexes], k: Complexes, b: Complexes
) -> tuple[Complexes, Complexes]:
    """k and b (N, q) after a step of Newton's method from them towards det W = 0 and its conjugate.

    terms  A, B and C (N, r, r)
    """
    rows = []
    for A, B, C in (terms, tuple(np.conj(X) for X in terms)):
        W = A[:, None] + k[..., None, None] * B[:, None] + b[..., None, None] * C[:, None]
        cofactors = adjugate(W)
        rows.append([_trace(cofactors, B[:, None]), _trace(cofactors, C[:, None]), determinant(W)])
    (k1, b1, value1), (k2, b2, value2) = rows
    slope = k1 * b2 - b1 * k2
    return k - (b2 * value1 - b1 * value2) / slope, b - (k1 * value2 - k2 * value1) / slope


def _trace(X: Complexes, Y: Complexes) -> Complexes:
    """tr(X Y) (...) of matrices (..., r, r)."""
    return np.asarray(np.sum(X * np.swapaxes(Y, -1, -2), axis=(-1, -2)))


def _adjoint(X: Matrices) -> Matrices:
    """Conjugate transposes of matrices (N, r, r)."""
    return np.conj(np.swapaxes(X, -1, -2))


# Steps between angles, in shares of the distance to the nearest pole or zero; and the longest.
SHARE, LONGEST = 0.1, 0.05
# How far rounding moves the poles of free motions away from z = 1, and their mean.
SPLIT, TOGETHER = 1e-6, 1e-12
# Angles at which a velocity estimate is searched for places where it is in phase with the position.
PHASES: Final = 200


def first_angles(loop: MultiLoop) -> Floats:
    """Angles in (0, pi), ascending, at which curves are sampled first."""
    # what is late by n samples turns n times as fast as z
    late = 1 + loop.whole_delay + len(loop.estimator.A)
    return sample_angles(features(loop), SHARE, min(LONGEST, 0.5 / late))


def on_circle(thetas: Floats) -> tuple[Complexes, Complexes]:
    """z = exp(i theta) and d = z - 1, the latter without cancellation near theta = 0."""
    s, c = np.sin(0.5 * thetas), np.cos(0.5 * thetas)
    d = -2.0 * s * s + 2j * s * c
    return 1.0 + d, d


def features(loop: MultiLoop) -> Complexes:
    """Points z (k,), Im z >= 0, where curves turn: poles and zeros of P, poles of w and of the force filter, and
    where on the circle w is real."""
    held, estimator, force = loop.sampled_plant, loop.estimator, loop.force_filter
    m = loop.count
    split = loop.fractional_delay > 0.0
    A = held.step  # the transition matrix less 1, whose eigenvalues are z - 1
    B, C = held.new, held.reading
    if split:  # the older force as states
        A = np.block([[held.step, held.old], [np.zeros((m, len(held.step))), -np.eye(m)]])
        B, C = np.vstack([B, np.eye(m)]), np.hstack([C, np.zeros((m, m))])
    B, C = B / np.max(np.abs(B)), C / np.max(np.abs(C))
    # zeros of the plant's response: of the pencil of step, input and reading
    whole = np.block([[A, B], [C, np.zeros((m, m))]])
    mass = scipy.linalg.block_diag(np.eye(len(A)), np.zeros((m, m)))
    with np.errstate(divide="ignore", invalid="ignore"):
        zeros = scipy.linalg.eigvals(whole, mass)
    thetas = np.linspace(0.0, np.pi, PHASES)[1:-1]
    w = estimator.response(*on_circle(thetas))[0].imag
    turns = np.flatnonzero(w[1:] * w[:-1] < 0.0)
    # on the straight line between both angles
    share = w[turns] / (w[turns] - w[turns + 1])
    in_phase = np.exp(1j * (thetas[turns] + share * (thetas[1] - thetas[0])))
    poles = [1.0 + np.linalg.eigvals(matrix) for matrix in (held.step, estimator.A, force.A)]
    points: Complexes = np.concatenate([*poles, 1.0 + zeros[np.isfinite(zeros)], in_phase]).astype(complex)
    # a free motion's poles lie at z = 1 together, and rounding moves them apart, evenly about it
    beside = np.abs(points - 1.0) < SPLIT
    if abs(np.sum(points[beside] - 1.0)) < TOGETHER:
        points = points[~beside]
    return points[(points.imag >= -1e-12) & (np.abs(points) < 1e6)]
