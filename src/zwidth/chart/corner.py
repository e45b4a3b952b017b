"""Corners of the stable set to rounding: where the curve stops, or begins, to be its edge.

A corner is a wall with more than one pair of roots, or a pair and a real root, on the circle. The flag changes
there from one sample to the next. The curve then crosses another piece of itself, or a straight line of walls with
a real root at z = rho or z = -rho.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.curve import OF_LINE, zero_between
from zwidth.chart.edge_memory import NONE, OPEN, SAMPLES, SETTLED, EdgeMemory
from zwidth.chart.edge_samples import edge_flag
from zwidth.chart.loop_polynomials import QUOTIENT, combine, deflate
from zwidth.chart.real_root_lines import line_of, wall_on_line
from zwidth.chart.roots import divide, find_roots, spread_roots
from zwidth.chart.wall_samples import EDGE
from zwidth.compiled import compiled_apart, compiled_lean
from zwidth.loop.loop_table import DEGREE, CircleFactors, wall_on_circle, wall_with_slopes

NEAR: Final = 0.1  # longest step of Newton's method, as a share of t
# Where the flags on both sides of a corner are looked at, as a share of t.
BESIDE_CORNER: Final = 1e-7
# How far a corner may be from where halving on the flag has it, as a share of t.
SAME_PLACE: Final = 1e-5
# How far apart the walls of two branches may be where they cross, in shares of their K or B, and as an angle along
# one of them: more, and Newton's method has stopped at a pole; less, and a branch that passes all its walls within
# a sliver of angle has no corner, nor have branches that cross at K = B = 0.
APART, LAST_DIGITS = 1e-3, 1e-9
HALVINGS: Final = 36  # leave a step of rounding size


@compiled_lean
def fill_corners(memory: EdgeMemory) -> int:
    """Fill in all corners between samples that are edges and samples that are none. Returns how many are left
    OPEN."""
    samples, left_open = memory.samples, 0
    for i in range(memory.counts[SAMPLES] - 1):
        if (samples.flag[i] == EDGE) != (samples.flag[i + 1] == EDGE):
            left_open += fill_corner(memory, i) == OPEN
    if left_open > 0:
        for i in range(memory.counts[SAMPLES] - 1):
            left_open -= samples.corner[i] == OPEN and _fill_from_partner(memory, i)
    return left_open


@compiled_lean
def _fill_from_partner(memory: EdgeMemory, i: int) -> bool:
    """Settle an open corner between samples i and i + 1 from that of the branch that crosses there: whether that
    is known."""
    samples = memory.samples
    for k in range(memory.counts[SAMPLES] - 1):
        if samples.corner[k] == SETTLED and samples.t[i] < samples.corner_partner[k] < samples.t[i + 1]:
            _copy_corner(memory, k, i)
            return True
    return False


@compiled_lean
def _copy_corner(memory: EdgeMemory, k: int, i: int) -> None:
    """Let the corner after sample i be that after sample k, on its other branch."""
    samples = memory.samples
    samples.corner[i] = SETTLED
    samples.corner_t[i], samples.corner_partner[i] = samples.corner_partner[k], samples.corner_t[k]
    samples.corner_K[i], samples.corner_B[i] = samples.corner_K[k], samples.corner_B[k]


@compiled_apart
def fill_corner(memory: EdgeMemory, i: int) -> int:
    """Fill in the corner between samples i and i + 1, of which one is an edge, unless it is known. Returns its
    state, SETTLED or OPEN."""
    samples, circle = memory.samples, memory.circle
    if samples.corner[i] != NONE:
        return int(samples.corner[i])
    on, off = (i, i + 1) if samples.flag[i] == EDGE else (i + 1, i)
    t, partner, state = _corner_between(memory, on, off)
    samples.corner[i], samples.corner_t[i], samples.corner_partner[i] = state, t, partner
    known = _same_corner(memory, i) if state == SETTLED else -1
    if known >= 0:
        _copy_corner(memory, known, i)
    elif state == SETTLED:
        # a crossing of the curve with itself, whose wall one of both angles gives with more digits, or with a line
        if 0.0 < partner < np.inf:
            K, B = wall_on_circle(circle, better_conditioned(circle, t, partner))
        else:
            K, B = wall_on_line(circle, line_of(memory, partner), t)
        samples.corner_K[i], samples.corner_B[i] = K, B
    return state


@compiled_lean
def _same_corner(memory: EdgeMemory, i: int) -> int:
    """A settled corner, on the other of its two branches, that is the corner after sample i; -1 for none.

    On a branch that passes all its walls within a sliver of angle, the last digit of the angle moves the wall: the
    corner is then solved for once, so that both arcs end in one wall.
    """
    samples = memory.samples
    t, partner = samples.corner_t[i], samples.corner_partner[i]
    for k in range(i):
        if (
            samples.corner[k] == SETTLED
            and abs(samples.corner_t[k] - partner) <= SAME_PLACE * partner
            and abs(samples.corner_partner[k] - t) <= SAME_PLACE * t
        ):
            return k
    return -1


@compiled_lean
def _corner_between(memory: EdgeMemory, i: int, j: int) -> tuple[float, float, int]:
    """The t of the corner between an edge sample i and its neighbour j that is none, that of its partner (0 or inf
    for a real root), and SETTLED or OPEN.

    Several branches may cross there, next to each other: the edge ends at the first one that it meets.
    """
    circle, samples = memory.circle, memory.samples
    t, K, B = samples.t, samples.K, samples.B
    low, high = min(t[i], t[j]), max(t[i], t[j])
    corner, partner, found = t[j], 0.0, False  # the nearest to sample i so far
    for root in (0.0, np.inf):
        line = line_of(memory, root)
        at_i, at_j = line[0] + line[1] * K[i] + line[2] * B[i], line[0] + line[1] * K[j] + line[2] * B[j]
        if at_i * at_j < 0.0:
            crossing = zero_between(circle, OF_LINE, line, low, high)
            nearer = abs(crossing - t[i]) < abs(corner - t[i])
            if nearer and _flag_changes(memory, crossing, t[i], t[j]):
                corner, partner, found = crossing, root, True
    # pieces k, k + 1 of the curve whose chord dK_other, dB_other crosses the chord dK, dB from i to j
    dK, dB = K[j] - K[i], B[j] - B[i]
    for k in range(memory.counts[SAMPLES] - 1):
        if k in (i - 1, i, j - 1, j):
            continue
        off = (K[k] - K[i]) * dB - (B[k] - B[i]) * dK
        next_off = (K[k + 1] - K[i]) * dB - (B[k + 1] - B[i]) * dK
        if not off * next_off < 0.0:
            continue
        # chords k, k + 1 and i, j cross, or nearly
        dK_other, dB_other = K[k + 1] - K[k], B[k + 1] - B[k]
        share = ((K[k] - K[i]) * dB_other - (B[k] - B[i]) * dK_other) / (dK * dB_other - dB * dK_other)
        if not -0.2 <= share <= 1.2:
            continue
        other_share = off / (off - next_off)
        guess = t[i] + share * (t[j] - t[i]), t[k] + other_share * (t[k + 1] - t[k])
        one, other, met = solve_crossing(circle, guess[0], guess[1])
        nearer = met and low < one < high and abs(one - t[i]) < abs(corner - t[i])
        if nearer and _flag_changes(memory, one, t[i], t[j]):
            corner, partner, found = one, other, True
    if found:
        return corner, partner, SETTLED
    return _corner_by_halving(memory, t[i], t[j])


@compiled_lean
def _flag_changes(memory: EdgeMemory, at: float, on: float, off: float) -> bool:
    """Whether the edge ends at a corner: the wall just before it, on the side of `on`, is an edge, that just
    behind it is none."""
    beside = BESIDE_CORNER if off > on else -BESIDE_CORNER
    return bool(edge_flag(memory, at * (1.0 - beside)) > 0 and edge_flag(memory, at * (1.0 + beside)) <= 0)


@compiled_lean
def _corner_by_halving(memory: EdgeMemory, on: float, off: float) -> tuple[float, float, int]:
    """`_corner_between` by halving on the flag, where no sampled piece of the curve crosses there.

    on, off  t of the edge sample, and of the one that is none
    """
    circle, room = memory.circle, memory.room
    N, edge, beyond = circle.sizes[DEGREE], on, off
    for _ in range(HALVINGS):
        middle = 0.5 * (edge + beyond)
        if edge_flag(memory, middle) == EDGE:
            edge = middle
        else:
            beyond = middle
    K, B = wall_on_circle(circle, edge)
    if N < 4:  # too few roots for a second pair
        return edge, 0.0, OPEN
    # a second pair of roots is on the circle: it is what remains nearest to it without the first pair
    combine(memory.polynomials.coefficients, N, K, B, room)
    deflate(room, N, edge * edge)
    roots = memory.features.roots[: N - 2]
    spread_roots(roots)
    find_roots(room[QUOTIENT, : N - 1], roots, 1e-9)
    nearest, partner = np.inf, 0.0
    for root in roots:
        z = divide(1.0 + root, 1.0 - root)
        if abs(abs(z) - 1.0) < nearest:
            nearest, partner = abs(abs(z) - 1.0), abs(root.imag)  # on the circle s = i t
    one, other, met = solve_crossing(circle, edge, partner)
    if met and abs(one - edge) <= SAME_PLACE * edge:
        return one, other, SETTLED
    return edge, partner, OPEN


@compiled_apart
def solve_crossing(circle: CircleFactors, one: float, other: float) -> tuple[float, float, bool]:
    """The two t = tan(theta/2) at which the curve has the same wall, by Newton's method from t = one and t = other
    close by; and whether it settled: False if it wanders off, which leaves `one` and `other` as they were, if the
    walls stay apart, or if both t are one."""
    a, b = one, other
    settled = False
    for _ in range(30):
        Ka, Ba, dKa, dBa = wall_with_slopes(circle, a)
        Kb, Bb, dKb, dBb = wall_with_slopes(circle, b)
        det = dKb * dBa - dKa * dBb
        # steps of theta; t moves by half of (1 + t^2) times as much
        step_a = ((Ka - Kb) * dBb - (Ba - Bb) * dKb) / det * 0.5 * (1.0 + a * a)
        step_b = ((Ka - Kb) * dBa - (Ba - Bb) * dKa) / det * 0.5 * (1.0 + b * b)
        if not (abs(step_a) < NEAR * a and abs(step_b) < NEAR * b):
            return one, other, False
        a, b = a + step_a, b + step_b
        settled = abs(step_a) <= 4e-15 * a and abs(step_b) <= 4e-15 * b
        if settled:
            break
    if settled:
        # near a pole of the curve steps are small, and the walls far apart
        Ka, Ba, dKa, dBa = wall_with_slopes(circle, a)
        Kb, Bb, _, _ = wall_with_slopes(circle, b)
        off_K = abs(Ka - Kb) > APART * (abs(Ka) + abs(Kb)) + LAST_DIGITS * abs(dKa)
        off_B = abs(Ba - Bb) > APART * (abs(Ba) + abs(Bb)) + LAST_DIGITS * abs(dBa)
        settled = not (off_K and off_B)
    return a, b, settled and abs(a - b) > 1e-6 * a


@compiled_lean
def better_conditioned(circle: CircleFactors, one: float, other: float) -> float:
    """Of the two t of a corner the one on whose branch the wall moves less with the angle's last digits, whose
    size is a share of the angle."""
    _, _, dK, dB = wall_with_slopes(circle, one)
    _, _, dK2, dB2 = wall_with_slopes(circle, other)
    # each in shares of the corner's slopes together, so that K and B count alike
    first = (abs(dK) / (abs(dK) + abs(dK2)) + abs(dB) / (abs(dB) + abs(dB2))) * np.arctan(one)
    second = (abs(dK2) / (abs(dK) + abs(dK2)) + abs(dB2) / (abs(dB) + abs(dB2))) * np.arctan(other)
    return one if not first > second else other
