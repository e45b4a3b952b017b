"""All curves that cut the plane of walls of several directions: their samples, and how they run in a box.

Of the equation of each set of coupled directions all walls are known at the sampled angles (`wall_equation`); they
are joined to branches (`branches`), and points are added between them until chords follow.

Branches with so many points that chords follow them.

Halfway along each chord a point of the curve is found by correction across it. It shows how far the curve is from
the chord, whether it turns so much that it may cross itself in a small loop, and whether it is that curve at all:
another one may run close by in walls, at another angle. Where the point does not fit, more angles are sampled.

Where a curve of pairs of roots ends: at theta = 0 or pi, in a wall with a double root at z = 1 or -1.

Walls are even functions of the angle from there, so that the limit follows from a few angles close by. Nearer ones
are all rounding, and further ones see the curve turn: those are taken of which four tell the same as three.

Directions along which a law has stiffness only, or damping only: one number moves their roots, k or b.

Their walls with a pair of roots on the circle are lines of one number x at a few angles: those at which an
eigenvalue x of F + x D Y, or of F + x w E Y, is real.

Directions that a plant does not couple: each set of them has an equation of its own.

Under one law for several directions these can be turned into each other. Of a plant that has the same response
along two of them, all walls would be there twice, which no curve can be followed through; turned so that they are
not coupled, they are told apart, and equal ones are left out.

Walls with a real root, at z = 1 or z = -1.

There everything is real: with the forces F and readings Y = P F that the plant allows, and the velocity estimate
w,

    det(F + k D Y + b w E Y) = 0.

Where w = 0, as at z = 1 and behind most low passes at z = -1, these are lines of one k; under one law for all
directions they are lines of one k + b w. Else, with k = t + s and b w = t - s, there are up to r solutions t for
every s, and all r for a symmetric plant: as many curves, along which k rises and b w falls.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg
from scipy.optimize import brentq, linear_sum_assignment

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.chart.several_directions.branches import BranchSamples, trace_branches
from zwidth.chart.several_directions.traced_curve import CurvePoints, RootEquation, TracedCurve, correct_point
from zwidth.chart.several_directions.wall_curves import StraightLine, WallBox, WallCurve
from zwidth.chart.several_directions.wall_equation import (
    WallEquation,
    adjugate,
    determinant,
    first_angles,
    on_circle,
)
from zwidth.loop.multi_loop import MultiLoop

# A velocity estimate below this share of 1/T, an imaginary part below this share of its number, and an asymmetry
# below this share of a matrix's largest entry are rounding.
ROUNDING: Final = 1e-9
# A motion at rest is held by no spring where its stiffness is below this share of the largest.
UNSPRUNG: Final = 1e-10
# A number below this share of the plant's stiffness at other frequencies is 0 but for rounding: a free motion's.
ZERO: Final = 1e-13
# Steps of Newton's method after an eigenvalue solver.
POLISH: Final = 3


@dataclass(frozen=True)
class RealRootEquation:
    """Walls [k T, b] with a real root, by s = (k - b w)/2 [N/m]: det W = 0 with W = F + k D Y + b w E Y.

    forces, readings   F, Y (r, r)
    stiffness, damping diagonals of D and E (r,): the law's along each direction, not both 0 along one
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
        """All walls (N, r, 2) of [k T, b] for s (N,) [N/m]; nan for solutions that are not real."""
        s, T, w = parameters[:, None], self.period, self.estimate
        t = self._eigenvalues(parameters)
        for _ in range(POLISH):
            k, b = t + s, (t - s) / w
            points = np.stack([np.broadcast_to(s, t.shape), k * T, b], axis=-1).reshape(-1, 3)
            value, slopes = (x.reshape(*t.shape, -1) for x in self._determinant(points))
            # by t at this s, k T grows by T and b by 1 / w
            t = t - value[..., 0] / (slopes[..., 0] * T + slopes[..., 1] / w)
        return np.stack([(t + s) * T, (t - s) / w], axis=-1)

    def linear(self, points: Floats) -> tuple[Floats, Floats]:
        """det W (as of `_determinant`) and (k - b w)/2 - s, (n, 2), and their slopes (n, 2, 3) at points (n, 3) of
        [s, k T, b]."""
        s, x, b = points.T
        value, slopes = self._determinant(points)
        off = 0.5 * (x / self.period - b * self.estimate) - s
        first = np.concatenate([np.zeros((len(s), 1)), slopes], axis=1)
        second = np.array([-1.0, 0.5 / self.period, -0.5 * self.estimate])
        return np.column_stack([value, off]), np.stack([first, np.broadcast_to(second, first.shape)], axis=1)

    def angles(self, parameters: Floats) -> Floats:
        """Angle (N,) of the root at each parameter: 0 or pi throughout."""
        return np.full(len(parameters), self.real_angle)

    def _determinant(self, points: Floats) -> tuple[Floats, Floats]:
        """det W (n, 1) and its slopes (n, 2) by k T and b at points (n, 3) of [s, k T, b], all divided by the
        largest cofactor of W there, so that they neither overflow nor vanish; its zeros stay."""
        _, x, b = points.T
        by_x = self.stiffness[:, None] * self.readings / self.period  # slopes of W by x = k T, D Y / T, and by b
        by_b = self.estimate * self.damping[:, None] * self.readings
        W = self.forces + x[:, None, None] * by_x + b[:, None, None] * by_b
        cofactors = adjugate(W)
        size = np.abs(cofactors).max(axis=(1, 2))[:, None]
        slopes = np.stack([np.einsum("nij,ji->n", cofactors, X) for X in (by_x, by_b)], axis=-1)
        return determinant(W)[:, None] / size, slopes / size

    def _eigenvalues(self, parameters: Floats) -> Floats:
        """t = (k + b w)/2 (N, r) for s (N,), ascending, to the digits of an eigenvalue solver; nan, last, for
        those that are not real."""
        # W Y^-1 = F Y^-1 + s (D - E) + t (D + E), divided by the root of D + E on both sides: -t are eigenvalues
        root = np.sqrt(self.stiffness + self.damping)
        H = self.forces @ np.linalg.inv(self.readings) / np.outer(root, root)
        whole = H + parameters[:, None, None] * np.diag((self.stiffness - self.damping) / root**2)
        # of a symmetric matrix all are real, equal ones too
        t = -np.linalg.eigvalsh(whole) if _is_symmetric(H) else -np.linalg.eigvals(whole)
        return np.sort(_real_or_nan(t), axis=1)


def real_root_walls(equation: WallEquation) -> tuple[list[StraightLine], list[RealRootEquation]]:
    """Lines and curves of walls with a real root, of directions that the plant couples.

    Symbols are those of the file's head, with s and v of the law along each direction.
    """
    lines: list[StraightLine] = []
    curves: list[RealRootEquation] = []
    s, v, T = equation.stiffness, equation.damping, equation.loop.period
    # size of the plant's stiffness at a quarter of the sampling rate, which tells rounding from 0
    scale = float(np.abs(equation.terms(np.array([np.pi / 2.0]))[0]).max())
    for z, angle in ((1.0, 0.0), (-1.0, np.pi)):
        F, Y = equation.real_columns(z)
        w = float(equation.loop.estimator.response(z)[0].real)
        if not np.isfinite(F).all():  # some force moves nothing that is read
            continue
        if abs(w) * T <= ROUNDING:
            lines += _lines_of_stiffness(equation, F, Y, z, scale)
        elif np.ptp(s) == 0.0 and np.ptp(v) == 0.0:  # one number in all directions
            across = np.array([s[0] / T, v[0] * w])
            length = float(np.hypot(*across))
            numbers = _singular_numbers(F, Y, scale)
            lines += [StraightLine(across / length, number / length, angle, T) for number in numbers]
        else:
            curves.append(RealRootEquation(F, Y, s, v, w, angle, T))
    return lines, curves


def _lines_of_stiffness(
    equation: WallEquation, F: Floats, Y: Floats, z: float, scale: float
) -> list[StraightLine]:
    """Lines of walls with a root at z = 1 or -1, where the velocity estimate is 0.

    F, Y   (r, r) forces and readings there
    scale  of the plant's stiffness at other frequencies, which tells rounding from 0

    Free motions that the law only damps have a root at z = 1 for every wall (`MultiLoop.affine`): it is left out,
    and there are lines of those b that bring another one there. Along these motions P^-1 + b w E is (z - 1) times
    dH + b dw E, with slopes by z, to first order: that is what must be singular.
    """
    s, v, T = equation.stiffness, equation.damping, equation.loop.period
    angle = 0.0 if z > 0.0 else np.pi
    inverse = equation.inverse(z)
    if z > 0.0 and inverse is not None and (s == 0.0).any():
        H, dH = inverse
        # motions that the law can only damp, and the others
        free, rest = _free_at_rest(H, s == 0.0, UNSPRUNG * scale)
        dw = float(equation.loop.estimator.response(z)[1].real)
        damped = _singular_numbers(free.T @ dH @ free, dw * (free.T * v) @ free, scale / dw)
        sprung = _singular_numbers(rest.T @ H @ rest, (rest.T * s) @ rest, scale)
        lines = [StraightLine(np.array([0.0, 1.0]), b, angle, T) for b in damped]
    else:
        sprung, lines = _singular_numbers(F, s[:, None] * Y, scale), []
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


def _singular_numbers(A: Floats, B: Floats, scale: float) -> list[float]:
    """All real x with det(A + x B) = 0, A, B (r, r); 0 for those below ZERO of `scale`, the size of a large x."""
    if not len(A):
        return []
    alpha, beta = scipy.linalg.eig(A, -B, right=False, homogeneous_eigvals=True)
    # beta = 0: x at infinity
    finite = np.abs(beta) > 1e-12 * np.abs(beta).max(initial=0.0)
    x = _real_or_nan(alpha[finite] / beta[finite], ZERO * scale)
    x = x[np.isfinite(x)]
    for _ in range(POLISH):
        W = A + x[:, None, None] * B
        step = determinant(W) / np.einsum("nij,ji->n", adjugate(W), B)  # a long one leads away
        x = np.where(np.abs(step) < 0.1 * np.abs(x), x - step, x)
    return [float(value) if abs(value) > ZERO * scale else 0.0 for value in x]


def _real_or_nan(x: Complexes | Floats, least: float = 0.0) -> Floats:
    """Real parts of those x that are real but for rounding, nan for others; least: rounding of small ones."""
    return np.where(np.abs(x.imag) <= ROUNDING * np.abs(x) + least, x.real, np.nan)


def _is_symmetric(H: Floats) -> bool:
    """Whether a matrix (r, r) is symmetric but for rounding."""
    return bool(np.abs(H - H.T).max() <= ROUNDING * np.abs(H).max())


# Steps of a curve of real roots across a box, before its chords are looked at.
STEPS: Final = 48


@dataclass(frozen=True)
class CurveSet:
    """What cuts the plane of walls: equations with the samples at which all their walls are known, and lines.

    equations  of all sets of coupled directions; those whose roots both k and b move are the ones of `pairs`
    pairs      each of these with all its walls at the angles sampled so far
    real       equations of curves of walls with a real root
    lines      of walls with a real root, and with a pair where the law has one number only
    """

    loop: MultiLoop
    equations: tuple[WallEquation, ...]
    pairs: tuple[tuple[WallEquation, BranchSamples], ...]
    real: tuple[RealRootEquation, ...]
    lines: tuple[StraightLine, ...]

    @property
    def angles(self) -> Floats:
        """All angles (n,) at which walls are known, ascending."""
        return np.unique(np.concatenate([np.empty(0), *(samples.parameters for _, samples in self.pairs)]))

    @property
    def samples(self) -> Floats:
        """Walls (k, 2) of [k T, b] on the curves of pairs of roots."""
        every = np.vstack([np.empty((0, 2)), *(samples.walls.reshape(-1, 2) for _, samples in self.pairs)])
        return every[np.isfinite(every).all(axis=1)]

    def with_angles(self, thetas: Floats) -> CurveSet:
        """These curves with more samples, at those of the angles thetas (n,) that lie between their outermost."""
        pairs = []
        for equation, samples in self.pairs:
            known = samples.parameters
            pairs.append(
                (equation, samples.with_more(equation, thetas[(thetas > known[0]) & (thetas < known[-1])]))
            )
        return replace(self, pairs=tuple(pairs))

    def within(self, box: WallBox, tolerance: float) -> tuple[CurveSet, list[WallCurve]]:
        """These curves with all samples of pairs that this took, and all curves and lines as they run in a box.

        tolerance  largest distance of a chord from its curve, in shares of the box
        """
        curves: list[WallCurve] = []
        pairs = []
        for equation, samples in self.pairs:
            scale = np.array([1.0, *box.size])
            samples, branches = followed_branches(equation, samples, box, scale, tolerance)
            pairs.append((equation, samples))
            for traced in branches:
                curves.append(with_limits(TracedCurve(equation, traced, scale, self.loop.period), samples))
        for real in self.real:
            scale = np.array([box.size[0] / real.period, *box.size])
            first = BranchSamples.of(real, _steps_across(real, box))
            _, branches = followed_branches(real, first, box, scale, tolerance)
            curves += [TracedCurve(real, traced, scale, real.period) for traced in branches]
        # from the foot of a line that meets the box past all of the box
        reach = float(np.hypot(*box.size) + 2.0 * np.hypot(*np.abs([box.low, box.high]).max(axis=0)))
        lines = [replace(line, size=reach) for line in self.lines]
        return replace(self, pairs=tuple(pairs)), [*curves, *lines]


def trace_curves(loop: MultiLoop) -> CurveSet:
    """The curves of a loop, those of pairs sampled where its poles and zeros say that they turn."""
    thetas = first_angles(loop)
    pairs: list[tuple[WallEquation, BranchSamples]] = []
    real: list[RealRootEquation] = []
    lines: list[StraightLine] = []
    equations = wall_equations(loop)
    for equation in equations:
        if (equation.stiffness > 0.0).any() and (equation.damping > 0.0).any():
            pairs.append((equation, BranchSamples.of(equation, thetas)))
        else:  # one number alone moves the roots
            lines += pair_lines(equation, thetas)
        own_lines, own_real = real_root_walls(equation)
        lines += own_lines
        real += own_real
    return CurveSet(loop, tuple(equations), tuple(pairs), tuple(real), tuple(lines))


def _steps_across(real: RealRootEquation, box: WallBox) -> Floats:
    """Parameters (n,) of a curve of real roots from one side of a box to the other, and beyond."""
    corners = np.array([(x, b) for x in (box.low[0], box.high[0]) for b in (box.low[1], box.high[1])])
    s = 0.5 * (corners[:, 0] / real.period - corners[:, 1] * real.estimate)
    margin = 0.5 * (s.max() - s.min())
    return np.linspace(s.min() - margin, s.max() + margin, STEPS)


# Rounds in which chords are halved; those are looked at that come as close to the box as this share of its size.
HALVINGS, BESIDE = 24, 0.1
# Chords are halved where the parameter, halfway, is this share of its step away from the middle, and more than
# rounding.
BENT, POINT_ROUNDING = 0.5, 1e-8
# Where a curve turns so much from point to point (the cosine of the angle), chords are halved, all down to this
# share of the box: it may cross itself in a small loop.
STRAIGHT, SMALLEST = 0.95, 1e-9
# A point halfway is no further from its chord than this share of the chord, and its parameter no further outside
# of the chord's than the chord's is long.
NEAR_CHORD: Final = 0.5
# Rounds in which angles are sampled where points did not fit, and at which shares of the steps there.
ROUNDS, SHARES = 4, (0.25, 0.5, 0.75)


def followed_branches(
    equation: RootEquation, samples: BranchSamples, box: WallBox, scale: Floats, tolerance: float
) -> tuple[BranchSamples, list[CurvePoints]]:
    """The samples that this took, and all branches that run through a box, followed by chords there.

    scale      (3,) size of u, k T and b
    tolerance  largest distance of a chord from its branch, in shares of the box
    """
    for attempt in range(ROUNDS):
        samples, branches = trace_branches(equation, samples, box)
        inside = [branch for branch in branches if box.meets(branch.points[:, 1:]).any()]
        followed, unfit = [], [np.empty(0)]
        for branch in inside:
            traced, parameters = _branch_with_chords(equation, branch, box, scale, tolerance)
            followed.append(traced)
            unfit.append(parameters)
        more = np.setdiff1d(np.concatenate(unfit), samples.parameters)
        if not len(more) or attempt + 1 == ROUNDS:
            break
        samples = samples.with_more(equation, more)
    return samples, followed


def _branch_with_chords(
    equation: RootEquation, branch: CurvePoints, box: WallBox, scale: Floats, tolerance: float
) -> tuple[CurvePoints, Floats]:
    """A branch with points added halfway along chords, and parameters (n,) at which to sample where none fit.

    scale, tolerance  as for `followed_branches`
    """
    traced, unfit = branch.forwards(scale), [np.empty(0)]
    # chords that are still to be looked at
    loose = np.ones(len(traced.points) - 1, dtype=bool)
    around = box.with_margin(BESIDE)
    for _ in range(HALVINGS):
        points, directions = traced
        k = np.flatnonzero(loose & around.meets(points[:, 1:]))
        if not len(k):
            break
        chord = points[k + 1] - points[k]
        guess = traced.guess(k, np.full(len(k), 0.5), scale)
        middles, along, settled = correct_point(equation, guess, chord / scale**2, scale)
        # turned forwards along the chord
        along *= np.where(np.einsum("ni,ni->n", along, chord / scale) < 0.0, -1.0, 1.0)[:, None] * scale
        fits = settled & _can_lie_halfway(points[k], chord, middles, scale)
        unfit.append(_steps_between(points[k[~fits]], points[k[~fits] + 1]))
        off = np.abs(middles - points[k] - 0.5 * chord)
        bent = off[:, 0] > BENT * np.abs(chord[:, 0]) + POINT_ROUNDING * np.abs(middles[:, 0])
        finer = (bent | _turn_much(traced, k, box)) & (np.abs(chord[:, 1:] / box.size) > SMALLEST).any(axis=1)
        more = fits & ((off[:, 1:] / box.size > tolerance).any(axis=1) | finer)
        # places along the branch, by which old and new points are put in order
        at = np.concatenate([np.arange(len(points)), k[more] + 0.5])
        order = np.argsort(at)
        traced = CurvePoints(
            np.vstack([points, middles[more]])[order], np.vstack([directions, along[more]])[order]
        )
        new = np.flatnonzero(order >= len(points))
        # next time only the two halves of each chord that was halved
        loose = np.zeros(len(at) - 1, dtype=bool)
        loose[new], loose[new - 1] = True, True
    return traced, np.concatenate(unfit)


def _can_lie_halfway(first: Floats, chord: Floats, middles: Floats, scale: Floats) -> Flags:
    """Which middles can lie halfway on a curve along chords from points first, each (n, 3); scale: (3,)."""
    off = np.linalg.norm((middles - first - 0.5 * chord)[:, 1:] / scale[1:], axis=1)
    ahead = (middles - first)[:, 0] / np.where(chord[:, 0] == 0.0, np.inf, chord[:, 0])
    return np.asarray((off <= NEAR_CHORD * np.linalg.norm(chord / scale, axis=1)) & (np.abs(ahead - 0.5) <= 1.5))


def _steps_between(first: Floats, last: Floats) -> Floats:
    """Parameters between those of points (n, 3), where they are more than rounding apart."""
    u, step = first[:, 0], last[:, 0] - first[:, 0]
    apart = np.abs(step) > POINT_ROUNDING * np.abs(u)
    return np.asarray((u[apart, None] + step[apart, None] * np.array(SHARES)).ravel())


def _turn_much(traced: CurvePoints, k: Ints, box: WallBox) -> Flags:
    """Which steps, from points k of a branch to the next, turn so much that a loop may hide there."""
    ahead = traced.directions[:, 1:] / box.size
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    return np.asarray(np.einsum("ni,ni->n", ahead[k], ahead[k + 1]) < STRAIGHT)


# Angles from which a limit is extrapolated, in units of the first sample's: each twice the one before.
ANGLES: Final = 2.0 ** np.arange(-2, 6)


def _extrapolation_weights(count: int) -> Floats:
    """Weights of a polynomial's values in the squares of so many of these angles for its value at 0."""
    x = ANGLES[:count]
    return np.array([np.prod([o**2 / (o**2 - y**2) for o in x if o != y]) for y in x])


THREE, FOUR = _extrapolation_weights(3), _extrapolation_weights(4)
# What is extrapolated from these angles lies this close, in units of the curve's scale, to what the slope says.
NEAR_PARABOLA: Final = 1e-3
# A limit further away from the first sample than this, in units of the curve's scale, is none.
FAR: Final = 1.0


def with_limits(curve: TracedCurve, samples: BranchSamples) -> TracedCurve:
    """A curve of pairs of roots with its limits, where it begins or ends in the first or the last sample."""
    lowest, highest = samples.parameters[[0, -1]]
    traced, limits = curve.traced, []
    for k in (0, -1):
        theta = traced.points[k, 0]
        end = 0.0 if theta == lowest else np.pi if theta == highest else None
        limit = None if end is None else _point_of_limit(curve, k, end)
        if limit is not None:
            points, directions = [limit, traced.points], [np.zeros((1, 3)), traced.directions]
            # the limit goes before the first point, or after the last; its direction is not known, 0
            order = slice(None, None, 1 if k == 0 else -1)
            traced = CurvePoints(np.vstack(points[order]), np.vstack(directions[order]))
        limits.append(limit is not None)
    return replace(curve, traced=traced, limits=(limits[0], limits[1]))


def _point_of_limit(curve: TracedCurve, k: int, end: float) -> Floats | None:
    """The point (1, 3) at the angle `end`, 0 or pi, in which a curve ends beside its point k, 0 or -1; None where
    it goes to infinity."""
    point, direction = curve.traced.points[k], curve.traced.directions[k]
    with np.errstate(all="ignore"):
        # walls are even in the angle from the end: half the slope times that angle leads from the end to the point
        slope = direction[1:] / direction[0]
        away = point[0] - end
        parabola = 0.5 * away * slope
        if not np.all(np.abs(parabola) <= FAR * curve.scale[1:]):
            return None
        guess = np.empty((len(ANGLES), 3))
        guess[:, 0] = end + away * ANGLES
        guess[:, 1:] = point[1:] + parabola * (ANGLES[:, None] ** 2 - 1.0)
        # normals of planes of one angle each
        upright = np.tile([1.0, 0.0, 0.0], (len(ANGLES), 1))
        near, _, settled = correct_point(curve.equation, guess, upright, curve.scale)
    near[~settled] = np.nan
    windows = np.lib.stride_tricks.sliding_window_view(near[:, 1:], 4, axis=0)
    by_four = windows @ FOUR
    apart = np.abs((by_four - windows[..., :3] @ THREE) / curve.scale[1:]).max(axis=1)
    # the window where three and four angles agree best, if that is not far from the parabola
    walls = by_four[np.nanargmin(apart)] if np.isfinite(apart).any() else point[1:] - parabola
    if np.abs((walls - point[1:] + parabola) / curve.scale[1:]).max() > NEAR_PARABOLA:
        walls = point[1:] - parabola
    return np.array([[end, *walls]])


# Imaginary part of a real number that was solved for, in shares of it; where it passes a pole that is not small.
REAL: Final = 1e-6


def pair_lines(equation: WallEquation, thetas: Floats) -> list[StraightLine]:
    """Lines of walls with a pair of roots, found between ascending angles (N,), of an equation whose law has
    stiffness only, or damping only."""
    # one number moves the roots: b if the law damps, else k
    damped, T = bool((equation.damping > 0.0).any()), equation.loop.period
    across, unit = (np.array([0.0, 1.0]), 1.0) if damped else (np.array([1.0, 0.0]), T)
    numbers = _numbers_with_root(equation, thetas)
    lines = []
    for n in range(len(thetas) - 1):
        apart = np.abs(numbers[n][:, None] - numbers[n + 1]) / (
            np.abs(numbers[n][:, None]) + np.abs(numbers[n + 1])
        )
        # each number goes on in one at the next angle, so that all together move least
        for i, j in zip(*linear_sum_assignment(apart), strict=True):
            ends = numbers[n, i], numbers[n + 1, j]
            if ends[0].imag * ends[1].imag < 0.0:
                theta, x = _real_number(equation, thetas[n : n + 2], ends)
                if abs(x.imag) <= REAL * abs(x):
                    lines.append(StraightLine(across, x.real * unit, theta, T))
    return lines


def _numbers_with_root(equation: WallEquation, thetas: Floats) -> Complexes:
    """Values (N, r) of b if the law damps, else of k, with a root at each angle (N,): real ones are walls."""
    A, B, C = equation.terms(thetas)
    moving = C if (equation.damping > 0.0).any() else B
    return np.asarray(-np.linalg.eigvals(np.linalg.solve(moving, A)), dtype=complex)


def _real_number(equation: WallEquation, thetas: Floats, ends: tuple[complex, complex]) -> tuple[float, complex]:
    """Angle between `thetas` (2,) where the imaginary part of one of `_numbers_with_root` changes sign, and that
    number there: real but for rounding, or large at a pole. ends: the number at both angles.
    """
    low, high = (float(theta) for theta in thetas)

    def number(theta: float) -> complex:
        """The number x at an angle that is nearest to the straight line between those at both ends."""
        expected = ends[0] + (theta - low) / (high - low) * (ends[1] - ends[0])
        every = _numbers_with_root(equation, np.array([theta]))[0]
        return complex(every[np.argmin(np.abs(every - expected))])

    theta = float(brentq(lambda theta: number(theta).imag, low, high, xtol=1e-300, rtol=1e-14))
    return theta, number(theta)


# Directions whose coupling is a smaller share of their own responses are not coupled, and sets of directions whose
# responses differ by a smaller share of the largest have the same.
UNCOUPLED: Final = 1e-11
# Angles at which responses are compared.
PROBES: Final = (0.03, 0.4, 1.1, 1.9, 2.7)


def wall_equations(loop: MultiLoop) -> list[WallEquation]:
    """The equations of the sets of directions that a plant couples, each different one once."""
    z, d = on_circle(np.array(PROBES))
    P = loop.plant_slope(z, d)[0]
    law = loop.principal
    S = _least_coupled_directions(P, law.stiffness, law.damping)
    P = S @ P @ S.T
    equations: list[WallEquation] = []
    known: list[Complexes] = []
    for part in _coupled_sets(P):
        stiffness, damping, own = law.stiffness[part], law.damping[part], P[:, part][:, :, part]
        if not any(
            np.array_equal(stiffness, other.stiffness)
            and np.array_equal(damping, other.damping)
            and np.abs(own - response).max() <= UNCOUPLED * np.abs(P).max()
            for other, response in zip(equations, known, strict=True)
        ):
            equations.append(WallEquation(loop, S[part], stiffness, damping))
            known.append(own)
    return equations


def _least_coupled_directions(P: Complexes, stiffness: Floats, damping: Floats) -> Floats:
    """Directions (r, r), orthonormal, each in the place of one under the same law, that are coupled least.

    Where turning a set of directions of one law uncouples them at all angles, their axes are the eigenvectors of
    any mean of the responses there. A set that is no less coupled when it is turned stays as it is.

    P                   (n, r, r)  responses at n angles
    stiffness, damping  (r,)       of the law along each direction
    """
    r = len(stiffness)
    S = np.eye(r)
    for k in range(r):
        same = np.flatnonzero((stiffness == stiffness[k]) & (damping == damping[k]))
        if same[0] != k or len(same) == 1:
            continue
        own = P[:, same][:, :, same]
        share = own / np.abs(own).max(axis=(1, 2))[:, None, None]
        # weights that do not let what differs cancel
        mean = np.einsum("n,nij->ij", np.arange(1.0, len(P) + 1.0), share.real + 0.7 * share.imag)
        turn = np.linalg.eigh(mean + mean.T)[1].T
        if len(_coupled_sets(turn @ own @ turn.T)) > len(_coupled_sets(own)):
            S[np.ix_(same, same)] = turn
    return S


def _coupled_sets(P: Complexes) -> list[Ints]:
    """Sets of directions, by index, that responses (n, r, r) couple: within a set each moves each, be it by way of
    others."""
    r = P.shape[-1]
    own = np.sqrt(np.abs(np.diagonal(P, axis1=1, axis2=2)))
    # a direction leads to another over at most r others: powers of the matrix of couplings
    coupled = (np.abs(P) > UNCOUPLED * own[:, :, None] * own[:, None, :]).any(axis=0)
    reached = np.linalg.matrix_power(coupled.astype(float) + np.eye(r), r) > 0.0
    # of each direction the set that it is in; each set is returned once, for its first direction
    sets = [np.flatnonzero(reached[k] & reached[:, k]) for k in range(r)]
    return [part for k, part in enumerate(sets) if part[0] == k]
