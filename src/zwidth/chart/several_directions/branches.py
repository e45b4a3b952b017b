"""Branches of walls from all walls at many parameters: which continues in which, and where two of them turn back.

At each parameter every solution is known, with its slope. From one parameter to the next a wall continues in the
one to which both slopes lead, if they do so clearly; else the step is halved. Two that come to meet (a fold:
beyond it there is neither) are joined where a point between them is found on the curve, by correction across their
chord.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.several_directions.traced_curve import CurvePoints, RootEquation, correct_point
from zwidth.chart.several_directions.wall_curves import WallBox

# A wall continues in another one if it misses it by less than these shares of their distance, and of what it
# misses the next best by; and if both slopes run along their chord, with at least the first as cosine.
CLEAR, UNRIVALLED = 0.3, 0.25
# Walls closer than this share of the box are joined whatever their slopes, which rounding turns beside z = 1 and
# -1.
SAME: Final = 1e-6
# A point between two walls that meet is no further from their chord's middle than this share of it, and the curve
# runs along the chord at all three: the least cosine.
NEAR_CHORD, ALONG = 0.25, 0.8
# Steps are halved down to this share of the parameter, or of 1e-3 where it is smaller.
NARROWEST: Final = 1e-14
ROUNDS: Final = 50
# Walls this far around the box, in shares of it, are followed, too.
AROUND: Final = 1.0
# Number of parameters beyond which no more are added.
MOST: Final = 20000


@dataclass(frozen=True)
class BranchSamples:
    """All walls at ascending parameters.

    parameters  (N,)
    walls       (N, q, 2)  [k T, b]; nan where there are fewer
    slopes      (N, q, 2)  by the parameter
    """

    parameters: Floats
    walls: Floats
    slopes: Floats

    @classmethod
    def of(cls, equation: RootEquation, parameters: Floats) -> BranchSamples:
        """An equation's walls and their slopes at ascending parameters (N,)."""
        with np.errstate(all="ignore"):
            walls = equation.solutions(parameters)
            slopes = np.full_like(walls, np.nan)
            n, q = np.nonzero(np.isfinite(walls[..., 0]))
            _, J = equation.linear(np.column_stack([parameters[n], walls[n, q]]))
            # how both walls must move for what vanishes to stay 0 while the parameter goes on, by Cramer's rule
            volume = J[:, 0, 1] * J[:, 1, 2] - J[:, 0, 2] * J[:, 1, 1]
            slopes[n, q, 0] = (J[:, 0, 2] * J[:, 1, 0] - J[:, 1, 2] * J[:, 0, 0]) / volume
            slopes[n, q, 1] = (J[:, 1, 1] * J[:, 0, 0] - J[:, 0, 1] * J[:, 1, 0]) / volume
        return cls(parameters, walls, slopes)

    def with_more(self, equation: RootEquation, parameters: Floats) -> BranchSamples:
        """These samples and those at more parameters."""
        more = BranchSamples.of(equation, np.setdiff1d(parameters, self.parameters))
        together = np.concatenate([self.parameters, more.parameters])
        order = np.argsort(together)
        return BranchSamples(
            together[order],
            np.concatenate([self.walls, more.walls])[order],
            np.concatenate([self.slopes, more.slopes])[order],
        )

    def point(self, n: int, k: int) -> tuple[Floats, Floats]:
        """Parameter, k T and b (3,) of wall k at parameter n, and the direction (3,) of the curve there."""
        return np.array([self.parameters[n], *self.walls[n, k]]), np.array([1.0, *self.slopes[n, k]])


class _Fold(NamedTuple):
    """Walls `one` and `other` at parameter n that turn back into each other, ahead (1) or behind (-1) of it.

    between, direction  (3,)  a point between them, and the direction in which the curve runs there
    """

    n: int
    one: int
    other: int
    way: int
    between: Floats
    direction: Floats


def trace_branches(
    equation: RootEquation, samples: BranchSamples, box: WallBox
) -> tuple[BranchSamples, list[CurvePoints]]:
    """The samples that this took, and the branches in and around a box. A closed branch ends where it begins.

    Steps in which a wall near the box lacks a continuation are halved; where none is found a branch ends.
    """
    for _ in range(ROUNDS):
        forward, folds, unclear = _link(equation, samples, box)
        u = samples.parameters
        middles = 0.5 * (u[1:] + u[:-1])
        middles = middles[unclear & (np.diff(u) > NARROWEST * np.maximum(np.abs(middles), 1e-3))]
        if not len(middles) or len(u) > MOST:
            break
        samples = samples.with_more(equation, middles)
    return samples, _joined_branches(samples, forward, folds)


@np.errstate(all="ignore")
def _link(equation: RootEquation, samples: BranchSamples, box: WallBox) -> tuple[Ints, list[_Fold], Flags]:
    """Number (N - 1, q) of the wall at the next parameter in which each continues, -1 for none; folds; and
    in which intervals (N - 1,) a wall near the box has neither a continuation nor a fold."""
    forward = _continuations(samples, box)
    # ahead, behind: walls near the box that lack a continuation there
    near = box.with_margin(AROUND).holds(samples.walls)
    ahead, behind = near.copy(), near.copy()
    ahead[-1], behind[0] = False, False
    ahead[:-1] &= forward < 0
    # a wall is continued from behind where one before leads to it
    n, k = np.nonzero(forward >= 0)
    behind[n + 1, forward[n, k]] = False
    folds = [*_folds(equation, samples, box, ahead, 1), *_folds(equation, samples, box, behind, -1)]
    for fold in folds:
        (ahead if fold.way > 0 else behind)[fold.n, [fold.one, fold.other]] = False
    return forward, folds, np.asarray(ahead[:-1].any(axis=1) | behind[1:].any(axis=1))


def _continuations(samples: BranchSamples, box: WallBox) -> Ints:
    """Number (N - 1, q) of the wall at the next parameter in which each clearly continues, -1 for none."""
    x, slopes = samples.walls / box.size, samples.slopes / box.size
    step = np.diff(samples.parameters)[:, None, None, None]
    chord = x[1:, None, :] - x[:-1, :, None]
    # (N - 1, q, q) how far each next wall is from where the mean of its slope and this wall's leads to
    miss = np.abs(chord - 0.5 * step * (slopes[1:, None, :] + slopes[:-1, :, None])).max(axis=-1)
    miss = np.where(np.isfinite(miss), miss, np.inf)
    # the next wall that is missed least, by how much, and the length of the chord to it
    best = miss.argmin(axis=2)[..., None]
    own = np.take_along_axis(miss, best, axis=2)
    length = np.take_along_axis(np.abs(chord).max(axis=-1), best, axis=2)
    # the next best for this wall, and the best of others for the wall that it leads to
    rivals = miss.copy()
    np.put_along_axis(rivals, best, np.inf, axis=2)
    q = x.shape[1]
    others = np.where(np.eye(q, dtype=bool)[None, :, :, None], np.inf, miss[:, None, :, :]).min(axis=2)
    rival = np.minimum(rivals.min(axis=2, keepdims=True), np.take_along_axis(others, best, axis=2))
    mutual = np.take_along_axis(miss.argmin(axis=1), best[..., 0], axis=1) == np.arange(q)
    best, own, rival, length = (array[..., 0] for array in (best, own, rival, length))
    # each is the other's best, far ahead of its rivals
    unrivalled = np.isfinite(own) & mutual & (own <= UNRIVALLED * rival)
    n, k = np.nonzero(unrivalled & (own <= CLEAR * length))
    forwards = np.zeros_like(unrivalled)
    # both slopes lead there: those of two walls that turn back miss nothing in their mean
    step = chord[n, k, best[n, k]]
    forwards[n, k] = (_cosine(slopes[n, k], step) > CLEAR) & (_cosine(slopes[n + 1, best[n, k]], step) > CLEAR)
    # of walls all but in one place neither slopes nor chord tell more
    return np.where(forwards | (unrivalled & (length <= SAME)), best, -1)


def _folds(equation: RootEquation, samples: BranchSamples, box: WallBox, open_: Flags, way: int) -> list[_Fold]:
    """Pairs of walls at one parameter, without continuation one way, that turn back into each other.

    open_  (N, q)  which walls lack a continuation
    way    1 ahead, -1 behind
    """
    u, x = samples.parameters, samples.walls
    # walls a and b at parameter n, whose slopes point towards each other that way
    both = np.triu(open_[:, :, None] & open_[:, None, :], 1)
    n, a, b = np.nonzero(both)
    chord = (x[n, b] - x[n, a]) / box.size
    towards = _cosine(way * samples.slopes[n, a] / box.size, chord) > ALONG
    towards &= _cosine(way * samples.slopes[n, b] / box.size, chord) < -ALONG
    n, a, b, chord = n[towards], a[towards], b[towards], chord[towards]
    if not len(n):
        return []
    # points halfway along the chords are corrected across these, at whatever parameter
    scale = np.array([1.0, *box.size])
    middles = np.column_stack([u[n], 0.5 * (x[n, a] + x[n, b])])
    normals = np.column_stack([np.zeros(len(n)), chord / box.size])
    points, tangents, settled = correct_point(equation, middles, normals, scale)
    length = np.linalg.norm(chord, axis=1)
    off = np.linalg.norm((points - middles)[:, 1:] / box.size, axis=1)
    straight = np.abs(_cosine(tangents[:, 1:], chord)) > ALONG
    beyond = way * (points[:, 0] - u[n])
    within = (beyond > 0.0) & (beyond < way * (u[np.clip(n + way, 0, len(u) - 1)] - u[n]))
    good = np.flatnonzero(settled & straight & within & (off < NEAR_CHORD * length))
    folds: list[_Fold] = []
    taken: set[tuple[int, int]] = set()
    for k in good[np.argsort(length[good])]:  # the closest walls first, each wall once
        ends = {(int(n[k]), int(a[k])), (int(n[k]), int(b[k]))}
        if not ends & taken:
            taken |= ends
            folds.append(_Fold(int(n[k]), int(a[k]), int(b[k]), way, points[k], tangents[k] * scale))
    return folds


def _cosine(one: Floats, other: Floats) -> Floats:
    """Cosine (n,) of the angle between vectors (n, 2), `one` and `other`."""
    length = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    return np.asarray(np.einsum("ni,ni->n", one, other) / length)


def _joined_branches(samples: BranchSamples, forward: Ints, folds: list[_Fold]) -> list[CurvePoints]:
    """Walls linked by `forward` (as of `_link`) and folds, joined to branches; one branch after the other."""
    q = samples.walls.shape[1]
    joints: list[_Fold | None] = []
    ways: dict[int, list[tuple[int, int]]] = {}  # of each wall: the walls beside it, and the number of the joint

    def join(one: int, other: int, fold: _Fold | None = None) -> None:
        """Make two walls, numbered n q + k, neighbours on a branch: linked, or by the fold between them."""
        ways.setdefault(one, []).append((other, len(joints)))
        ways.setdefault(other, []).append((one, len(joints)))
        joints.append(fold)

    for n, a in zip(*np.nonzero(forward >= 0), strict=True):
        join(int(n) * q + int(a), (int(n) + 1) * q + int(forward[n, a]))
    for fold in folds:
        join(fold.n * q + fold.one, fold.n * q + fold.other, fold)
    # walks from ends first; what is left then are closed branches
    left, branches = set(ways), []
    for start in [*(wall for wall, beside in ways.items() if len(beside) == 1), *ways]:
        if start not in left:
            continue
        # came: number of the joint by which the walk has come to the wall `at`; -1 at its start
        at, came, walk = start, -1, [samples.point(start // q, start % q)]
        while True:
            left.discard(at)
            onwards = [(other, joint) for other, joint in ways[at] if joint != came]
            if not onwards:
                break
            at, came = onwards[0]
            turn = joints[came]
            walk += [] if turn is None else [(turn.between, turn.direction)]
            walk.append(samples.point(at // q, at % q))
            if at == start:
                break
        branches.append(CurvePoints.of(walk))
    return branches
