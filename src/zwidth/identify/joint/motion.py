"""Motion of one joint with dry and viscous friction under a held force, exact between its reversals."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_lean

TERMS: Final = 14  # of the exponential's series, enough for a norm of one half
MOST_HALVINGS: Final = 60
CLOSE: Final = 1e-14  # share of the first velocity at which a reversal counts as met
MOST_TURNS: Final = 8  # reversals within one part of an interval; more are those of a motion that stands
# indices among the six numbers of a motion
MASS: Final = 0
VISCOUS_FORWARD, VISCOUS_BACKWARD, DRY_FORWARD, DRY_BACKWARD = 1, 2, 3, 4
STIFFNESS: Final = 5


@compiled_lean
def flow(
    mass: float, damping: float, stiffness: float, h: float
) -> tuple[float, float, float, float, float, float]:
    """Transition of position and velocity over a time h [s], and what a unit force held meanwhile adds to them.

    m x'' + b x' + k x = f, of mass, damping and stiffness;  exp(A h) by its series after halving h, which is exact
    for any sign and size of b and k, joined again by squaring.
    Returns  the four entries of exp(A h) by rows, and the two of its integral times (0, 1/m)
    """
    rate, square = damping / mass, stiffness / mass
    size = h * (abs(rate) + np.sqrt(abs(square)))
    halvings = 0
    while size > 0.5 and halvings < MOST_HALVINGS:
        size *= 0.5
        halvings += 1
    d = h * 0.5**halvings
    # of exp(A d): the n-th term of its series, the sum so far, and that of its integral over d, second column
    t11, t12, t21, t22 = 1.0, 0.0, 0.0, 1.0
    p11, p12, p21, p22 = 1.0, 0.0, 0.0, 1.0
    s12, s22 = 0.0, 1.0
    for n in range(1, TERMS):
        by = d / n
        t11, t12, t21, t22 = (
            -by * square * t12,
            by * (t11 - rate * t12),
            -by * square * t22,
            by * (t21 - rate * t22),
        )
        p11, p12, p21, p22 = p11 + t11, p12 + t12, p21 + t21, p22 + t22
        s12, s22 = s12 + t12 / (n + 1), s22 + t22 / (n + 1)
    # then doubled: exp(2 A d) is the square, and its integral exp(A d) g + g
    g1, g2 = s12 * d / mass, s22 * d / mass
    for _ in range(halvings):
        g1, g2 = p11 * g1 + p12 * g2 + g1, p21 * g1 + p22 * g2 + g2
        p11, p12, p21, p22 = (
            p11 * p11 + p12 * p21,
            p11 * p12 + p12 * p22,
            p21 * p11 + p22 * p21,
            p21 * p12 + p22 * p22,
        )
    return p11, p12, p21, p22, g1, g2


@compiled_lean
def turning_time(
    mass: float, damping: float, stiffness: float, push: float, x: float, v: float, h: float, guess: float
) -> float:
    """Time from 0 to h [s] at which the velocity becomes 0, from position x and velocity v at 0, under a constant
    push (the force less dry friction): Newton's method from a guess, kept within a bracket.

    guess  of that time [s]
    """
    low, high, t = 0.0, h, guess
    for _ in range(60):
        p11, p12, p21, p22, g1, g2 = flow(mass, damping, stiffness, t)
        xt, vt = p11 * x + p12 * v + g1 * push, p21 * x + p22 * v + g2 * push
        if abs(vt) <= CLOSE * abs(v):
            break
        if vt * v > 0.0:  # not turned yet
            low = t
        else:
            high = t
        acceleration = (push - stiffness * xt - damping * vt) / mass
        after = t - vt / acceleration if acceleration != 0.0 else low
        if not low < after < high:
            after = 0.5 * (low + high)
        if after == t:
            break
        t = after
    return t


@compiled_lean
def direction_of(x: float, v: float, force: float, numbers: Floats) -> int:
    """Direction in which the joint slides at position x and velocity v: 1 forward, -1 backward, 0 where dry
    friction holds it against the force.

    numbers  (6,) as in `follow_windows`
    """
    if v > 0.0:
        return 1
    if v < 0.0:
        return -1
    push = force - numbers[STIFFNESS] * x
    if push > numbers[DRY_FORWARD]:
        return 1
    return -1 if push < -numbers[DRY_BACKWARD] else 0


@compiled_lean
def after_part(x: float, v: float, force: float, h: float, numbers: Floats, steps: Floats) -> tuple[float, float]:
    """Position and velocity, from x and v, after a part of an interval, h long [s], under a constant force.

    A joint that turns round `MOST_TURNS` times in the part is taken to stand.

    numbers  (6,)    m, b forward and backward, F forward and backward, k, as in `follow_windows`
    steps    (2, 6)  `flow` over h, forward and backward
    """
    left = h  # time that is still to go
    for _ in range(MOST_TURNS):
        side = direction_of(x, v, force, numbers)
        if side == 0:
            return x, 0.0
        way = 0 if side > 0 else 1
        push = force - numbers[DRY_FORWARD] if side > 0 else force + numbers[DRY_BACKWARD]
        if left == h:  # then `steps` has what `flow` would return
            p11, p12, p21, p22, g1, g2 = (
                steps[way, 0],
                steps[way, 1],
                steps[way, 2],
                steps[way, 3],
                steps[way, 4],
                steps[way, 5],
            )
        else:
            p11, p12, p21, p22, g1, g2 = flow(
                numbers[MASS], numbers[VISCOUS_FORWARD + way], numbers[STIFFNESS], left
            )
        # at the end, if the joint does not turn round; else it stands at the time t, and goes on from there
        xn, vn = p11 * x + p12 * v + g1 * push, p21 * x + p22 * v + g2 * push
        # from rest the joint cannot turn round: a velocity against its side is rounding
        if vn * side >= 0.0 or v == 0.0:
            return xn, vn
        t = turning_time(
            numbers[MASS],
            numbers[VISCOUS_FORWARD + way],
            numbers[STIFFNESS],
            push,
            x,
            v,
            left,
            left * v / (v - vn),
        )
        p11, p12, _, _, g1, _ = flow(numbers[MASS], numbers[VISCOUS_FORWARD + way], numbers[STIFFNESS], t)
        x, v = p11 * x + p12 * v + g1 * push, 0.0
        left -= t
        if left <= 0.0:
            break
    return x, 0.0


@compiled
def follow_windows(
    force: Floats,
    first: Ints,
    length: Ints,
    period: Floats,
    numbers: Floats,
    delay: float,
    starts: Floats,
    out: Floats,
) -> None:
    """Positions in windows of a record, each from its own start.

    The force sample i is held from i T + delay until the next one acts.
    force    (n,)    samples, with some before and after each window
    first, length, period  (W,)  row of each window's first sample, their number, and T [s]
    numbers  (6,)    m, b forward and backward, F forward and backward, k: the joint slides forward under
                     m x'' = f - F_f - b_f x' - k x, backward under m x'' = f + F_b - b_b x' - k x, and stands
                     where -F_b <= f - k x <= F_f
    delay    of the force [s]
    starts   (W, 2)  position and velocity at each window's first sample
    out      (n,)    positions, written in the windows only
    """
    steps = np.zeros((2, 2, 6))  # `flow` over the early and the late part, forward and backward
    for w in range(first.size):
        T = period[w]
        # an interval between samples sees two forces: an early part of it the one before, a late part the next
        shift = delay / T
        whole = int(np.floor(shift))
        early = (shift - whole) * T
        late = T - early
        for way in range(2):
            steps[0, way] = flow(numbers[MASS], numbers[VISCOUS_FORWARD + way], numbers[STIFFNESS], early)
            steps[1, way] = flow(numbers[MASS], numbers[VISCOUS_FORWARD + way], numbers[STIFFNESS], late)
        x, v = starts[w, 0], starts[w, 1]
        out[first[w]] = x
        for i in range(first[w], first[w] + length[w] - 1):
            at = min(max(i - whole, 0), force.size - 1)
            before = min(max(i - whole - 1, 0), force.size - 1)
            if early > 0.0:
                x, v = after_part(x, v, force[before], early, numbers, steps[0])
            x, v = after_part(x, v, force[at], late, numbers, steps[1])
            out[i + 1] = x
