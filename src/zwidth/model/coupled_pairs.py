"""The poles of many plants whose dampers couple their modes: held by an operator, or by themselves.

In modal coordinates q, with the arm x_a as one more where the grasp is elastic, a plant is

    Q(s) x = (M s^2 + B s + K) x = input f,     y = output x

with symmetric M, B and K: unit masses, the modal dampers and w^2, and the operator's mass, damper and spring along
the handle's motion. A right vector is a left one, too, so that an eigenvalue p with its vector x gives

    p:  x^T Q(p) x = 0,          P(s) = sum over p of  (output x)(input x) / [ x^T (2 p M + B) x ] / (s - p)

(Lancaster 1966; Tisseur and Meerbergen 2001, section 3). Poles come from the companion matrix to some ten digits;
inverse iteration with the quadratic above then gives pole and vector to rounding. Conjugate poles make one part of
second order, real ones two by two.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.modes import UNOBSERVED_UNDAMPED
from zwidth.model.operator import Operator
from zwidth.model.rendered_modes import PolePairs, RenderedModes
from zwidth.resources import in_chunks

ITERATIONS: Final = 3
# Two poles nearer than this share of their size, or a pole whose left and right vectors are this near to
# orthogonal, may be one double pole: such a plant is looked at alone. A pole below a share of the largest is 0.
SAME_POLE, SHARED, ZERO = 1e-6, 1e-3, 1e-13
# A residue below this share of the reach is rounding; between it and UNOBSERVED_UNDAMPED it may be.
HIDDEN: Final = 1e-14
# How well the parts must add up to the plant's response, in shares of it, at these shares of half the sampling
# rate.
AGREEMENT: Final = 1e-10
PROBES: Final = (1e-3, 0.03, 0.3, 1.0)


def coupled_pairs(modes: RenderedModes, operator: Operator | None, period: ArrayLike) -> PolePairs:
    """The pole pairs of N plants with coupled modes.

    operator  at the handle: one for all, or with numbers of N designs; None: nobody
    period    () or (N,)  at which they are sampled [s]: up to half that rate the pairs are held against the plants
    Returns   the pairs, one more of each plant where some have free motions. Reach is nan for a plant that has to
              be computed by itself, in another way: whose matrices are not known (see `_plant_matrices`); with a
              motion that nothing holds or brakes though others move it; with poles that are nearly double; with
              parts that cannot be told from rounding
    """
    M, B, K, ends, known = _plant_matrices(modes, operator)
    # sum of |input| times sum of |output|, see `PolePairs`: shares of parts are told against it
    reach = np.where(known, np.abs(ends).sum(axis=2).prod(axis=0), np.nan)
    free = _set_aside_free_motions(M, B, K, ends, reach)
    N, n = ends.shape[1:]
    companion = np.zeros((N, 2 * n, 2 * n))  # A of (x, x')' = A (x, x')
    companion[:, :n, n:] = np.eye(n)
    companion[:, n:, :n], companion[:, n:, n:] = -np.linalg.solve(M, K), -np.linalg.solve(M, B)
    poles = np.linalg.eigvals(companion).astype(np.complex128)
    decay, squared, position, velocity = (np.zeros((N, n)) for _ in range(4))
    periods = np.array(np.ravel(period), dtype=np.float64)
    pairs = PolePairs(decay, squared, position, velocity, reach)

    def several(first: int, last: int) -> None:
        _fill_pairs(M, B, K, ends, poles, decay, squared, position, velocity, reach, periods, first, last)

    in_chunks(several, N)
    return pairs.with_free_motion(free) if free.any() else pairs


def _plant_matrices(
    modes: RenderedModes, operator: Operator | None
) -> tuple[Floats, Floats, Floats, Floats, Flags]:
    """M, B, K (N, n, n) of each plant; ends (2, N, n), its input and its output; and (N,) whether these are known.

    Known where the plant has modes, with an operator also their motions at the handle, and with an elastic grasp
    an arm with mass. Elsewhere `ends` are 0, and the matrices only such that M can be inverted. The arm of an
    elastic grasp is the last coordinate.
    """
    N, m = modes.decay.shape
    elastic = operator is not None and not operator.rigid_grasp
    n = m + elastic
    M, B, K = (np.zeros((N, n, n)) for _ in range(3))
    ends = np.zeros((2, N, n))
    known: Flags = np.all(np.isfinite(modes.input + modes.output + modes.decay), axis=1)
    diagonal, known_column = np.arange(m), known[:, None]
    M[:, diagonal, diagonal] = 1.0
    K[:, diagonal, diagonal] = np.where(known_column, modes.frequency_squared, 1.0)
    if modes.drag is None:
        B[:, diagonal, diagonal] = np.where(known_column, 2.0 * modes.decay, 0.0)
    else:
        B[:, :m, :m] = np.where(known_column[..., None], modes.drag, 0.0)
    if operator is not None:
        known &= np.all(np.isfinite(modes.handle), axis=1)
        handle = np.where(known[:, None], modes.handle, 0.0)
        mass, spring, damper = (
            np.broadcast_to(getattr(operator, f"arm_{part}"), (N,)) for part in ("mass", "stiffness", "damping")
        )
        if elastic:
            known &= mass > 0.0
            for matrix, number in zip((M, B, K), (mass, damper, spring), strict=True):
                matrix[:, m, m] = np.where(known, number, 1.0)
            handle = np.concatenate([handle, np.full((N, 1), -1.0)], axis=1)  # how far the hand slips
            mass, spring, damper = (
                np.broadcast_to(0.0 if number is None else number, (N,))
                for number in (None, operator.grasp_stiffness, operator.grasp_damping)
            )
        for matrix, number in zip((M, B, K), (mass, damper, spring), strict=True):
            matrix += np.asarray(number)[:, None, None] * handle[:, :, None] * handle[:, None, :]
    ends[0, known, :m], ends[1, known, :m] = modes.input[known], modes.output[known]
    return M, B, K, ends, known


def _set_aside_free_motions(M: Floats, B: Floats, K: Floats, ends: Floats, reach: Floats) -> Floats:
    """Take the motions without stiffness and damping, whose double pole at 0 is known, out of the matrices (in
    place).

    Each gets a spring of its own instead, and neither input nor output, so that it has no part in the response.
    Where M couples one with other motions, as the mass of an arm that is held by nothing does, it is no motion of
    the plant by itself: reach becomes nan.
    M, B, K, ends as of `_plant_matrices`, reach (N,) as of `PolePairs`.
    Returns (N,) [1/kg] the sum over these motions of input times output: their response is this over s^2.
    """
    diagonal = np.arange(K.shape[1])
    free = ~(np.abs(K).max(axis=2) > 0.0) & ~(np.abs(B).max(axis=2) > 0.0)
    coupled = free & (np.count_nonzero(M, axis=2) > 1)
    reach[coupled.any(axis=1)] = np.nan
    shares = np.where(free, ends[0] * ends[1], 0.0).sum(axis=1)
    stiffest = np.abs(K).max(axis=(1, 2), initial=0.0)
    # stiffer than all others and each other, so that their poles meet none
    apart = 2.0 + 0.37 * np.cumsum(free, axis=1)
    # 1.0: where nothing else has a stiffness
    K[:, diagonal, diagonal] = np.where(free, apart * np.maximum(stiffest, 1.0)[:, None], K[:, diagonal, diagonal])
    ends[:, free] = 0.0
    return np.asarray(shares)


@compiled
def _fill_pairs(
    M: Floats,
    B: Floats,
    K: Floats,
    ends: Floats,
    poles: Complexes,
    decay: Floats,
    squared: Floats,
    position: Floats,
    velocity: Floats,
    reach: Floats,
    periods: Floats,
    first: int,
    last: int,
) -> None:
    """Fill decay, squared, position and velocity (N, n), as of `PolePairs`, of plants first to last - 1.

    Those whose reach (N,) is not finite are passed over. Where a plant's poles are nearly double or cannot be
    joined (see `_join_poles`), or its parts do not add up to its response, its reach is made nan.

    M, B, K  (N, n, n)  of each plant, ends (2, N, n)  its input and output;   poles (N, 2 n)  its rough poles
    periods  (1,) or (N,)  sampling periods [s]
    """
    n = M.shape[1]
    A, x, refined, residues = (
        np.empty((n, n), np.complex128),
        np.empty(n, np.complex128),
        np.empty(2 * n, np.complex128),
        np.empty(2 * n, np.complex128),
    )
    for i in range(first, last):
        if not np.isfinite(reach[i]):
            continue
        known, count, largest = True, 0, 0.0
        for k in range(2 * n):
            largest = max(largest, abs(poles[i, k]))
        for k in range(2 * n):
            # one of each conjugate pair tells of both
            if poles[i, k].imag >= 0.0:
                refined[count], residues[count], sure = _pole_and_residue(
                    M[i], B[i], K[i], ends[:, i], poles[i, k], largest, A, x
                )
                known = known and sure
                count += 1
        parts = decay[i], squared[i], position[i], velocity[i]
        known = known and _are_apart(refined, count) and _join_poles(refined, residues, count, reach[i], *parts)
        if known:
            _correct_sums(M[i], ends[:, i], decay[i], position[i], velocity[i], A, x)
            highest = np.pi / periods[i if len(periods) > 1 else 0]
            known = _agree_with_plant(M[i], B[i], K[i], ends[:, i], *parts, highest, A, x)
        if not known:
            reach[i] = np.nan


@compiled_lean
def _pole_and_residue(
    M: Floats, B: Floats, K: Floats, ends: Floats, start: complex, largest: float, A: Complexes, x: Complexes
) -> tuple[complex, complex, bool]:
    """The pole that is nearest to `start`, its residue, and whether it is surely a single pole; by inverse
    iteration.

    M, B, K  (n, n)  of Q(p) = M p^2 + B p + K
    ends     (2, n)  input and output;   largest  size of the largest pole
    A, x     (n, n), (n,)  working memory: Q(p) and its eigenvector
    """
    n, p = len(x), complex(start)
    for k in range(n):
        x[k] = complex(1.0 + 0.37 * k, 0.0)  # across no eigenvector but by chance
    for _ in range(ITERATIONS):
        for a in range(n):
            for b in range(n):
                A[a, b] = (M[a, b] * p + B[a, b]) * p + K[a, b]
        solve(A, x)
        length = 0.0
        for k in range(n):
            length = max(length, abs(x[k].real) + abs(x[k].imag))
        for k in range(n):
            x[k] = complex(x[k].real / length, x[k].imag / length)
        inertia, drag, spring = _quadratic_form(M, x), _quadratic_form(B, x), _quadratic_form(K, x)
        # the root of  inertia p^2 + drag p + spring  that is nearer to p; a real pole stays real
        half = -0.5 * drag / inertia
        root = np.sqrt(half * half - spring / inertia)
        nearer = half + root if abs(half + root - p) < abs(half - root - p) else half - root
        far = half - root if nearer == half + root else half + root
        if abs(nearer) < abs(far):  # the smaller root from the product, which keeps its digits
            nearer = spring / (inertia * far)
        p = complex(nearer.real, nearer.imag if start.imag != 0.0 else 0.0)
        if abs(p) <= ZERO * largest:
            p = complex(0.0, 0.0)
    # x^T Q'(p) x, and the sum of its terms' sizes: nearly 0 against that only at a double pole
    slope, size = 2.0 * p * inertia + drag, 0.0
    enter, leave = complex(0.0, 0.0), complex(0.0, 0.0)
    for a in range(n):
        enter, leave = enter + ends[0, a] * x[a], leave + ends[1, a] * x[a]
        for k in range(n):
            size += (2.0 * abs(p) * abs(M[a, k]) + abs(B[a, k])) * abs(x[a]) * abs(x[k])
    # the start is good to SAME_POLE of itself, or to the companion matrix's 1e-9 of the largest pole
    sure = abs(slope) > SHARED * size and abs(p - start) <= SAME_POLE * abs(start) + 1e-9 * largest
    return p, enter * leave / slope, sure


@compiled_lean
def _quadratic_form(matrix: Floats, x: Complexes) -> complex:
    """x^T A x, of a real matrix A (n, n) and a complex x (n,), which is not conjugated."""
    total = complex(0.0, 0.0)
    for a in range(len(x)):
        row = complex(0.0, 0.0)
        for b in range(len(x)):
            row += matrix[a, b] * x[b]
        total += x[a] * row
    return total


@compiled_lean
def solve(A: Complexes, x: Complexes) -> None:
    """x = A^-1 x by Gauss with the largest pivot of each column; A is overwritten. A pivot of zero, as at an exact
    eigenvalue, is taken for a tiny one: the solution then points along the eigenvector."""
    n = len(x)
    whole = 0.0
    for a in range(n):
        for b in range(n):
            whole = max(whole, abs(A[a, b]))
    for c in range(n):
        best, at = -1.0, c
        for a in range(c, n):
            size = abs(A[a, c])
            if size > best:
                best, at = size, a
        if at != c:
            for b in range(c, n):
                A[c, b], A[at, b] = A[at, b], A[c, b]
            x[c], x[at] = x[at], x[c]
        if best <= 1e-16 * whole:
            A[c, c] = complex(1e-16 * whole + 1e-300, 0.0)
        for a in range(c + 1, n):
            factor = A[a, c] / A[c, c]
            for b in range(c + 1, n):
                A[a, b] -= factor * A[c, b]
            x[a] -= factor * x[c]
    for c in range(n - 1, -1, -1):
        for b in range(c + 1, n):
            x[c] -= A[c, b] * x[b]
        x[c] = x[c] / A[c, c]


@compiled_lean
def _are_apart(p: Complexes, count: int) -> bool:
    """Whether no two of the first `count` poles p are nearly one."""
    for a in range(count):
        for b in range(a):
            if abs(p[a] - p[b]) <= SAME_POLE * max(abs(p[a]), abs(p[b])):
                return False
    return True


@compiled_lean
def _join_poles(
    p: Complexes,
    r: Complexes,
    count: int,
    reach: float,
    decay: Floats,
    squared: Floats,
    position: Floats,
    velocity: Floats,
) -> bool:
    """Fill one plant's parts of second order (n,) from `count` poles p with Im >= 0 and their residues r.

    False where that cannot be: one part may be rounding or not, or real poles do not come in pairs. Position and
    velocity are 0 of parts of complex poles that the force does not move or the sensor does not read. Residues of
    real poles are overwritten. decay, squared, position, velocity, reach: of this plant in `PolePairs`.
    """
    parts = 0
    for k in range(count):
        if p[k].imag > 0.0:
            a, w2 = -p[k].real, p[k].real * p[k].real + p[k].imag * p[k].imag
            decay[parts], squared[parts] = a, w2
            # r/(s - p) + conj: [ 2 Re r s - 2 Re(r conj p) ] / (s^2 + 2 a s + w^2)
            velocity[parts] = 2.0 * r[k].real
            position[parts] = -2.0 * (r[k].real * p[k].real + r[k].imag * p[k].imag)
            # the largest that `position` can be, as `reach` is in units of position: input times output
            share = 2.0 * abs(r[k]) * abs(p[k]) / reach
            if share <= HIDDEN:
                velocity[parts], position[parts] = 0.0, 0.0
            elif share <= UNOBSERVED_UNDAMPED:
                return False
            parts += 1
    # real poles, the fastest first, two by two
    waiting, waiting_residue, waits = 0.0, 0.0, False
    for _ in range(count):
        best, at = -1.0, -1
        for k in range(count):
            # a residue that is nan has been taken
            if p[k].imag == 0.0 and abs(p[k]) > best and r[k] == r[k]:
                best, at = abs(p[k]), k
        if at < 0:
            break
        # as of a pair, |r| |p|; a pole near 0 counts as one of 1 rad/s, since its slow part may still be large
        share = abs(r[at]) * max(abs(p[at]), 1.0) / reach
        if share <= UNOBSERVED_UNDAMPED:  # half a part cannot be left out
            return False
        pole, residue = p[at].real, r[at].real
        r[at] = complex(np.nan, 0.0)
        if not waits:
            waiting, waiting_residue, waits = pole, residue, True
            continue
        decay[parts], squared[parts] = -0.5 * (waiting + pole), waiting * pole
        velocity[parts] = waiting_residue + residue
        position[parts] = -(waiting_residue * pole + residue * waiting)
        parts, waits = parts + 1, False
    return not waits


@compiled_lean
def _correct_sums(
    M: Floats, ends: Floats, decay: Floats, position: Floats, velocity: Floats, A: Complexes, x: Complexes
) -> None:
    """Take what rounding has left of two sums that are known, which high frequencies hang on, off the parts (n,):

        P(s) -> output M^-1 input / s^2  as s grows

        sum velocity = 0,       sum (position - 2 a velocity) = output M^-1 input

    ends  (2, n)  input and output;   A (n, n), x (n,)  working memory
    """
    n, velocity_excess, position_excess, largest_velocity, largest_position = len(x), 0.0, 0.0, 0, 0
    for a in range(n):
        x[a] = complex(ends[0, a], 0.0)
        for b in range(n):
            A[a, b] = complex(M[a, b], 0.0)
    solve(A, x)
    for k in range(n):
        velocity_excess += velocity[k]
        largest_velocity = k if abs(velocity[k]) > abs(velocity[largest_velocity]) else largest_velocity
    # taken off the largest, of which it is the smallest share
    velocity[largest_velocity] -= velocity_excess
    for k in range(n):
        position_excess += position[k] - 2.0 * decay[k] * velocity[k] - ends[1, k] * x[k].real
        largest_position = k if abs(position[k]) > abs(position[largest_position]) else largest_position
    position[largest_position] -= position_excess


@compiled_lean
def _agree_with_plant(
    M: Floats,
    B: Floats,
    K: Floats,
    ends: Floats,
    decay: Floats,
    squared: Floats,
    position: Floats,
    velocity: Floats,
    highest: float,
    A: Complexes,
    x: Complexes,
) -> bool:
    """Whether the parts' responses add up to the plant's at PROBES of the highest frequency [rad/s].

    M, B, K, ends                       (n, n), (2, n)  of one plant; input and output
    decay, squared, position, velocity  (n,)  its parts, as of `PolePairs`
    A, x                                (n, n), (n,)  working memory
    """
    n = len(x)
    for share in PROBES:
        s = complex(0.0, share * highest)
        for a in range(n):
            x[a] = complex(ends[0, a], 0.0)
            for b in range(n):
                A[a, b] = (M[a, b] * s + B[a, b]) * s + K[a, b]
        solve(A, x)
        whole, total = complex(0.0, 0.0), complex(0.0, 0.0)
        for k in range(n):
            whole += ends[1, k] * x[k]
            total += (position[k] + velocity[k] * s) / ((s + 2.0 * decay[k]) * s + squared[k])
        # so put that nan is no agreement
        if not abs(total - whole) <= AGREEMENT * abs(whole):
            return False
    return True
