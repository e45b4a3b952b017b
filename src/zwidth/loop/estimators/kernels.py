"""The steps of nonlinear estimators to the next reading, compiled apart: device files are read without numba."""

from __future__ import annotations

from math import copysign, inf, sqrt

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.loop.estimators.foaw import COUNT, ORIGIN, RING, ROUNDING_MARGIN
from zwidth.loop.estimators.levant import FIRST_READING, POSITION, READINGS, VELOCITY


@compiled
def foaw_estimate(memory: Floats, parameters: Floats, reading: float, period: float) -> float:
    """The velocity at a new reading; `Foaw` has the formulas.

    memory      (memory_size,)  zeros at first, changed in place; positions are counted from the first reading
    parameters  (3,)            `Foaw.parameters`
    reading     position [m]
    period      T [s]
    Returns     [m/s]; 0 at the first reading, over the readings there are as long as they are fewer than N + 1
    """
    longest, band = int(parameters[0]), parameters[1] * (1.0 + ROUNDING_MARGIN)
    count = int(memory[COUNT])
    if count == 0:
        memory[ORIGIN] = reading
    size = longest + 1
    place = RING + count % size
    memory[place] = memory[place + size] = reading - memory[ORIGIN]
    memory[COUNT] = count + 1.0
    if parameters[2] == 0.0:
        return _end_fit(memory, place + size, min(count, longest), band) / period
    return _best_fit(memory, place + size, min(count, longest), band) / period


@compiled
def _end_fit(memory: Floats, newest: int, periods: int, band: float) -> float:
    """Slope per period of the longest line between two readings with all others within the band.

    A reading i periods old with a change c_i since lies within it for slopes from (c_i - d)/i to (c_i + d)/i; the
    slopes allowed by all readings passed are one interval, so that each window costs one comparison.
    """
    slope, least, most = 0.0, -inf, inf
    for n in range(1, periods + 1):
        change = memory[newest] - memory[newest - n]
        candidate = change / n
        if candidate < least or candidate > most:
            break
        slope = candidate
        least = max(least, (change - band) / n)
        most = min(most, (change + band) / n)
    return slope


@compiled
def _best_fit(memory: Floats, newest: int, periods: int, band: float) -> float:
    """Slope per period of the least-squares line of the longest window that is within the band of it."""
    slope, total, moment = 0.0, 0.0, 0.0  # sums of c_i and of i c_i, c_i the change since i periods ago, negated
    for n in range(1, periods + 1):
        change = memory[newest - n] - memory[newest]
        total += change
        moment += n * change
        candidate = 6.0 * (n * total - 2.0 * moment) / (n * (n + 1.0) * (n + 2.0))
        start = memory[newest] + total / (n + 1.0) + 0.5 * n * candidate  # of the line, at the newest reading
        for i in range(n + 1):
            if n > 1 and abs(memory[newest - i] - start + candidate * i) > band:
                return slope
        slope = candidate
    return slope


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
