"""Dry friction over one substep: the mean force that a motion's velocities ask for.

Without this friction the motion would go from velocity v0 to w over the substep; a unit of force held over the
substep adds `mobility` to the velocity at its end. What is returned acts on the motion, so it opposes it.
"""

from __future__ import annotations

from math import exp

from zwidth.compiled import compiled_inline, compiled_lean


@compiled_inline
def coulomb_force(level: float, v0: float, w: float, mobility: float) -> float:
    """Coulomb friction with sticking, as the impulse that the substep's velocities ask for.

    As long as the motion slides, the force is -C sign(v). Where that would turn it round, it stops within the
    substep; what pushes it then either cannot overcome C, and it ends the substep at rest, or drags it on the
    other way for the rest of the substep. The velocity at the end is then right to second order in the substep.
    """
    brake = level * mobility
    side = 1.0
    if v0 < 0.0 or (v0 == 0.0 and w < 0.0):
        side, v0, w = -1.0, -v0, -w
    if w - brake >= 0.0:
        return -side * level
    push = w - v0  # what it gains over a whole substep, nearly evenly
    if push >= -brake:
        return -side * w / mobility
    slid = v0 / (v0 - w + brake)
    return side * ((push + brake) * (1.0 - slid) - w) / mobility


@compiled_lean
def stribeck(coulomb: float, breakaway: float, stribeck_velocity: float, v: float) -> float:
    """g(v) = C + (F_s - C) exp(-(v/v_s)^2), the level towards which the bristles bend at a steady velocity."""
    if breakaway <= coulomb:
        return coulomb
    ratio = v / stribeck_velocity
    return coulomb + (breakaway - coulomb) * exp(-ratio * ratio)


@compiled_lean
def bristles_after(z: float, level: float, stiffness: float, v: float, h: float) -> tuple[float, float]:
    """Deflection after h at constant velocity, and its mean:  z' = v - sigma_0 |v| z / g  in closed form."""
    rate = stiffness * abs(v) / level * h
    if rate < 1e-8:
        return z + v * h, z + 0.5 * v * h
    full = level / stiffness if v > 0.0 else -level / stiffness
    fade = exp(-rate)
    return full + (z - full) * fade, full + (z - full) * (1.0 - fade) / rate


@compiled_lean
def bristle_force(
    z: float,
    numbers: tuple[float, float, float, float, float],
    v0: float,
    w: float,
    mobility: float,
    h: float,
) -> tuple[float, float]:
    """Force of the Dahl and LuGre models over the substep, and the bristles' deflection after it.

    numbers  C, F_s, v_s, sigma_0, sigma_1; Dahl's model is the one with F_s = C and sigma_1 = 0

    The force f and the mean velocity u = (v0 + w + mobility f)/2 follow from each other. Solved for u by false
    position (Illinois), between velocities at which the friction would be none and twice its most.
    """
    coulomb, breakaway, slow, stiffness, damping = numbers
    most = max(coulomb, breakaway)
    if most <= 0.0:
        return 0.0, 0.0
    free = 0.5 * (v0 + w)

    low, high = free, free
    low_gap = high_gap = _gap(z, numbers, free, free, mobility, h)
    # the friction changes the velocity by no more than mobility times its largest force: the root is bracketed by
    # steps of that size
    reach = mobility * most
    for _ in range(60):
        if low_gap <= 0.0 <= high_gap:
            break
        if high_gap < 0.0:
            high = high + reach
            high_gap = _gap(z, numbers, free, high, mobility, h)
        else:
            low = low - reach
            low_gap = _gap(z, numbers, free, low, mobility, h)
        reach *= 2.0
    u, last = free, 0
    for _ in range(100):
        if high_gap == low_gap or high - low <= 1e-15 * (abs(high) + abs(low)):
            break
        u = high - high_gap * (high - low) / (high_gap - low_gap)
        gap = _gap(z, numbers, free, u, mobility, h)
        if abs(gap) <= 1e-14 * (abs(free) + mobility * most):
            break
        # Illinois: the value at an end that stays twice is halved, else false position creeps from one side
        if gap > 0.0:
            high, high_gap = u, gap
            low_gap *= 0.5 if last == 1 else 1.0
            last = 1
        else:
            low, low_gap = u, gap
            high_gap *= 0.5 if last == -1 else 1.0
            last = -1
    after, mean = bristles_after(z, stribeck(coulomb, breakaway, slow, u), stiffness, u, h)
    return -(stiffness * mean + damping * (after - z) / h), after


@compiled_lean
def _gap(
    z: float,
    numbers: tuple[float, float, float, float, float],
    free: float,
    u: float,
    mobility: float,
    h: float,
) -> float:
    """By how much the mean velocity u differs from what the friction at u leaves of the free one."""
    coulomb, breakaway, slow, stiffness, damping = numbers
    after, mean = bristles_after(z, stribeck(coulomb, breakaway, slow, u), stiffness, u, h)
    return u - free + 0.5 * mobility * (stiffness * mean + damping * (after - z) / h)
