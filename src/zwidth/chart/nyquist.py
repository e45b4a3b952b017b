"""Roots counted by the phase of the characteristic function along the circle.

    p(z) = A (1 + P (K + B w)),      A = the product of all denominators

is a real polynomial of degree N. From theta = 0 to pi on |z| = rho its phase turns by pi for each root inside and
by nothing for each outside. Evaluated from factors it keeps its digits where its coefficients have lost theirs:
long delays and windows give it a degree of a hundred. The phase is followed from sample to sample; where it turns
too far for the step to be sure, the step is halved.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.roots import divide
from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.loop_table import (
    DEGREE,
    FORCE,
    SECTIONS,
    SPLIT,
    VELOCITY,
    WHOLE_DELAY,
    WINDOW,
    CircleFactors,
    half_angle,
    minus_inverse_plant,
    quadratic,
    scaled_factors,
    velocity_on_circle,
)

FAR = 2.0  # twice the turn of phase [rad] beyond which a step is halved
HALVINGS = 60  # a step is cut into 64 times as many pieces at most
BESIDE = 1e-7  # samples this near to a root on the circle tell nothing of the others
CLEAR = 0.2  # how far from a whole number of half turns the phase may end


@compiled_lean
def terms_at(circle: CircleFactors, theta: float) -> tuple[complex, complex, complex]:
    """A, A P and A P w at one angle in (0, pi), scaled alike so that the largest is of size 1.

    Each factor of A is known times exp(-i theta/2) once for each of its roots: A is turned back by all N of them.
    """
    cc, ss, sc = half_angle(np.tan(0.5 * theta))
    X, _, top, _ = minus_inverse_plant(circle, cc, ss, sc)  # -1/P = X / top
    Y, _, size, _ = velocity_on_circle(circle, cc, ss, sc)  # w = Y / size
    P, w = divide(-top, X), scaled_factors(Y, 1.0 / size)
    # A is scaled away, only its phase is kept: half of theta for each root, and that of each denominator
    turns = 0.5 * circle.sizes[DEGREE] * theta
    A = complex(np.cos(turns), np.sin(turns))
    for k in range(circle.sizes[SECTIONS]):
        den, _ = quadratic(circle.plant[k, 0], circle.plant[k, 1], circle.plant[k, 2], cc, ss, sc)
        A *= scaled_factors(den, 1.0 / abs(den))
    A = _times_denominators(A, circle.force, circle.sizes[FORCE], cc, ss, sc)
    A = _times_denominators(A, circle.velocity, circle.sizes[VELOCITY], cc, ss, sc)
    # roots z = 0 turn by theta: by the half that is in `turns`, and as much again
    late = circle.sizes[WHOLE_DELAY] + circle.sizes[SPLIT] + circle.sizes[WINDOW] - 1
    A *= complex(np.cos(0.5 * late * theta), np.sin(0.5 * late * theta))
    scale = 1.0 / max(1.0, abs(P), abs(P * w))
    return A * scale, A * P * scale, A * P * w * scale


@compiled_lean
def _times_denominators(A: complex, rows: Floats, count: int, cc: float, ss: float, sc: float) -> complex:
    """A turned by the phase of the denominators of a computer's factors, whose sizes are left out.

    rows, count   the factors as in `CircleFactors.force`, and how many
    cc, ss, sc    cos^2, sin^2 and sin cos of theta/2
    """
    for k in range(count):
        # order, numerator (3), denominator (3)
        if rows[k, 0] == 1.0:
            den = complex(rows[k, 4] * np.sqrt(cc), rows[k, 5] * np.sqrt(ss))
        else:
            den, _ = quadratic(rows[k, 4], rows[k, 5], rows[k, 6], cc, ss, sc)
        A *= scaled_factors(den, 1.0 / abs(den))
    return A


@compiled
def terms_along(circle: CircleFactors, thetas: Floats) -> Complexes:
    """`terms_at` each of n angles in (0, pi): (n, 3) of A, A P, A P w."""
    out = np.empty((len(thetas), 3), dtype=np.complex128)
    for i in range(len(thetas)):
        out[i, 0], out[i, 1], out[i, 2] = terms_at(circle, thetas[i])
    return out


@compiled_lean
def _phase_change(before: complex, after: complex) -> float:
    """Change of phase from one value to the next, within half a turn."""
    ratio = after * before.conjugate()
    turn: float = np.arctan2(ratio.imag, ratio.real)
    return turn


@compiled_lean
def _sign_of_pair(theta: float, pair: float) -> float:
    """Sign of cos theta - cos pair at theta, the factor of a pair of roots at angle `pair`; 1 if pair is 0:
    none."""
    return -1.0 if 0.0 < pair < theta else 1.0


@compiled_lean
def _phase_change_in_pieces(
    circle: CircleFactors,
    wall: tuple[float, float, float],
    low: float,
    high: float,
    start: complex,
    end: complex,
) -> float:
    """Change of the phase of p over a step of theta from low to high, in as many pieces as it takes; nan where
    rounding is all that is left.

    wall        K, B and the angle of a pair that is divided out, as for `roots_inside`
    start, end  p, without the pair, at low and at high
    """
    K, B, pair = wall
    total, position, value, length, pieces = 0.0, low, start, 0.5 * (high - low), 0
    while position < high:
        pieces += 1
        step = min(length, high - position)
        # the value is near 0, where its phase is rounding
        if pieces > 64 * HALVINGS or length < 1e-15:
            return np.nan
        after = end
        if position + step < high:
            a, s, v = terms_at(circle, position + step)
            after = (a + K * s + B * v) * _sign_of_pair(position + step, pair)
        turn = _phase_change(value, after)
        # too large a turn to be sure of its sheet: the same step again, half as long
        if abs(turn) > FAR / 2.0:
            length = 0.5 * step
            continue
        total += turn
        position += step
        value = after
        length = 2.0 * step
    return total


@compiled_lean
def roots_inside(
    circle: CircleFactors, thetas: Floats, terms: Complexes, wall: tuple[float, float, float], real: int
) -> int:
    """Roots of a wall inside the circle, by the phase along samples; -1 where rounding hides the number.

    wall  K, B, and the angle of a pair of roots that it has on the circle, which is divided out; 0: none
    real  number of real roots that it has on the circle, divided out too
    """
    K, B, pair = wall
    total, first, at = 0.0, -1, -1
    before = 0.0 + 0.0j
    for i in range(len(thetas)):
        if abs(thetas[i] - pair) <= BESIDE * pair:
            continue
        # the pair (z - z0)(z - conj z0) = 2 z (cos theta - cos theta0) changes sign at theta0 and turns as z does
        after = (terms[i, 0] + K * terms[i, 1] + B * terms[i, 2]) * _sign_of_pair(thetas[i], pair)
        if first < 0:
            first = i
        else:
            turn = _phase_change(before, after)
            if abs(turn) > FAR / 2.0:
                turn = _phase_change_in_pieces(circle, wall, thetas[at], thetas[i], before, after)
            total += turn
        before, at = after, i
    # the pair turns as z does, z - rho and z + rho half as fast
    total -= ((1.0 if pair > 0.0 else 0.0) + 0.5 * real) * (thetas[at] - thetas[first])
    half_turns = total / np.pi
    whole = np.rint(half_turns)
    if not abs(half_turns - whole) < CLEAR:
        return -1
    return int(whole)


@compiled
def phase_flags(
    circle: CircleFactors,
    thetas: Floats,
    terms: Complexes,
    degree: int,
    walls: Floats,
    pairs: Floats,
    real: int,
) -> Ints:
    """Whether walls (n, 2) have all roots inside but those divided out: 1, -1, or 0 where rounding hides it;
    -1 for walls at infinity.

    thetas, terms  samples of the circle, and `terms_along` them
    degree         N
    pairs          (n,) angle of the pair that each wall has on the circle; 0: none
    real           number of real roots that each has there
    """
    out = np.full(len(walls), -1, dtype=np.int64)
    for k in range(len(walls)):
        K, B = walls[k]
        if np.isfinite(K) and np.isfinite(B):
            inside = roots_inside(circle, thetas, terms, (K, B, pairs[k]), real)
            left = degree - real - (2 if pairs[k] > 0.0 else 0)
            if inside < 0 or inside > left:
                out[k] = 0
            elif inside == left:
                out[k] = 1
    return out
