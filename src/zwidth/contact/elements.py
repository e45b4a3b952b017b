"""Nonlinear elements on one motion of the plant: the mean force of each over a substep.

Over a substep the motion q = along . x goes from q0 at velocity v0 to q1 at v1, if nothing of it acts. A unit of
force held over the substep adds `shift` to q1 and `mobility` to v1. A force f held over the substep does the work
f (q1 - q0), exactly.
"""

from __future__ import annotations

from typing import Final

from zwidth.arrays import Floats
from zwidth.compiled import compiled_inline, compiled_lean
from zwidth.contact.friction import bristle_force, coulomb_force

NOTHING: Final = -1
COULOMB: Final = 0
BRISTLES: Final = 1
SPRING: Final = 2
VARYING: Final = 3
SAMPLED: Final = 4  # a force of the computer beside the wall's, which stands in the memory


@compiled_inline
def element_force(
    kind: int,
    numbers: Floats,
    memory: Floats,
    d: int,
    e: int,
    q0: float,
    v0: float,
    q1: float,
    v1: float,
    shift: float,
    mobility: float,
    h: float,
) -> float:
    """Mean force of element e over a substep of length h [s], with its numbers (D, E, 6) and memory (E, 4)."""
    if kind == COULOMB:
        return coulomb_force(numbers[d, e, 0], v0, v1, mobility)
    if kind == BRISTLES:
        law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
        return bristle_force(memory[e, 0], law, v0, v1, mobility, h)[0]
    if kind == SPRING:
        law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
        return bent_spring_force(law, numbers[d, e, 5], q0, q1, shift)
    if kind == SAMPLED:
        return float(memory[e, 0])
    if kind == VARYING:
        return varying_force(memory[e, 0], memory[e, 1], memory[e, 2], q0, q1, shift, h)
    return 0.0


@compiled_lean
def bristles_bend(
    numbers: Floats, memory: Floats, d: int, e: int, v0: float, v1: float, mobility: float, h: float
) -> None:
    """Let the bristles of element e bend as the substep ends; its force itself remembers nothing."""
    law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
    memory[e, 0] = bristle_force(memory[e, 0], law, v0, v1, mobility, h)[1]


@compiled_lean
def bent_spring_force(
    law: tuple[float, float, float, float, float], kink: float, q0: float, q1: float, shift: float
) -> float:
    """-(V(q1) - V(q0))/(q1 - q0) with q1 moved by the force itself: the spring gives back what it took.

        V(q) = U(a + q) - F q - k q^2/2,    U(d) = cubic d^4/4 + excess min(d - kink, 0)^2/2

    law  cubic, excess, the offset a at which it is bent already, and U's slope F and its tangent k there, which
         are in the equilibrium and in the linear plant

    By Newton's method on f = F(q1 + shift f), the difference quotient written out so that q1 = q0 is no case.
    """
    cubic, excess, offset, held, tangent = law
    f = 0.0
    for _ in range(25):
        end = q1 + shift * f
        mean, slope = _quotient(cubic, excess, kink, offset + q0, offset + end)
        mean, slope = mean - held - 0.5 * tangent * (q0 + end), slope - 0.5 * tangent
        step = (f + mean) / (1.0 + shift * slope)
        f -= step
        if abs(step) <= 1e-15 * (abs(f) + abs(mean)):
            break
    return f


@compiled_lean
def _quotient(cubic: float, excess: float, kink: float, q0: float, q1: float) -> tuple[float, float]:
    """(V(q1) - V(q0))/(q1 - q0), and about its slope in q1."""
    mean = 0.25 * cubic * (q1 * q1 + q0 * q0) * (q1 + q0)
    slope = 0.25 * cubic * (3.0 * q1 * q1 + 2.0 * q1 * q0 + q0 * q0)
    q0, q1 = q0 - kink, q1 - kink
    if q0 <= 0.0 and q1 <= 0.0:
        return mean + 0.5 * excess * (q0 + q1), slope + 0.5 * excess
    if q0 < 0.0 or q1 < 0.0:
        back = min(q0, q1)
        share = back / abs(q1 - q0)
        mean += 0.5 * excess * back * abs(share)
        slope += 0.5 * excess * share * share if q1 < 0.0 else 0.0
    return mean, slope


@compiled_lean
def varying_force(
    stiffness: float, damping: float, rest: float, q0: float, q1: float, shift: float, h: float
) -> float:
    """A spring and a damper whose numbers change from sample to sample:  -(k (q_mean - rest) + b (q1 - q0)/h).

    Implicit, so that no number is too large for the substep; the damper never gives energy.
    """
    pull = stiffness * (0.5 * (q0 + q1) - rest) + damping * (q1 - q0) / h
    return -pull / (1.0 + shift * (0.5 * stiffness + damping / h))
