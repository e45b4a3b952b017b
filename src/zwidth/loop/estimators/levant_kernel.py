"""The step of Levant's differentiator to the next reading, compiled apart: device files are read without numba."""

from __future__ import annotations

from math import copysign, sqrt

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.loop.estimators.levant import READINGS, FIRST_READING, POSITION, VELOCITY


@compiled
def levant_estimate(memory: Floats, parameters: Floats, reading: float, period: float) -> float:
    """The velocity at a new reading; `Levant` has the formulas.

    memory      (memory_size,)  zeros at first, changed in place; positions are counted from the first reading
    parameters  (2,)            `Levant.parameters`
    reading     position [m]
    period      T [s]
    Returns     z1 [m/s], 0 at the first reading
    """
    if memory[READINGS] == 0.0:
        memory[FIRST_READING] = reading
    memory[READINGS] += 1.0
    position = reading - memory[FIRST_READING]
    brake, turn = period * parameters[0], period * parameters[1]
    ahead = memory[POSITION] + period * memory[VELOCITY] - position
    excess = abs(ahead) - period * turn
    if excess <= 0.0:
        memory[VELOCITY] = (position - memory[POSITION]) / period
        memory[POSITION] = position
    else:
        root = 2.0 * excess / (brake + sqrt(brake * brake + 4.0 * excess))
        memory[VELOCITY] -= copysign(turn, ahead)
        memory[POSITION] = position + copysign(root * root, ahead)
    velocity: float = memory[VELOCITY]
    return velocity
