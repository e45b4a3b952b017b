"""Levant's robust exact differentiator of first order, in backward Euler steps."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from zwidth.arrays import Floats
from zwidth.errors import NonlinearError
from zwidth.loop.estimator import Estimator, check_period, check_positive

# What the memory holds: the number of readings, the first of them, and the two states.
READINGS, FIRST_READING, POSITION, VELOCITY = 0, 1, 2, 3
MEMORY = 4


@dataclass(frozen=True)
class Levant:
    """Velocity of a tracker that follows exactly, after a finite time, any motion within an acceleration L.

        z0' = z1 - lambda0 sqrt|e| sgn e,      z1' = -lambda1 sgn e,      e = z0 - x
        lambda0 = 1.5 sqrt(L),      lambda1 = 1.1 L

    (Levant 1998, "Robust exact differentiation via sliding mode technique", with his gains; at second hand.) With
    errors up to d in the position the estimate errs by a multiple of sqrt(L d); in the worst case none does better
    than 2 sqrt(L d), by Landau's inequality for two motions that the errors make look the same.

    In steps of backward Euler, as for other implicit differentiators (Mojallizadeh, Brogliato and Acary 2021, at
    second hand; the steps are derived anew):

        c = z0 + T z1 - x_j                                   how far the last state has run ahead
        |c| <= lambda1 T^2:  z1 = (x_j - z0)/T,               z0 = x_j
        else:                z1 = z1 - lambda1 T sgn c,       z0 = x_j + s^2 sgn c,
                             s^2 + lambda0 T s = |c| - lambda1 T^2

    Where it makes e vanish the sign is any number from -1 to 1. With explicit steps sgn e never vanishes, and the
    estimate of a steady velocity goes on jumping by lambda1 T for ever. (The homogeneous discretisation adds
    Taylor terms from second order on; at first order it is the explicit one.)

    Once e is 0, an acceleration within 1.1 L keeps it 0 and the estimate is the backward difference: exact on
    ramps, late by T/2. In any period it changes by lambda1 T at most. An encoder's step above lambda1 T^2 is
    therefore smoothed; with L beyond step/(1.1 T^2) the steps of a steady motion pass whole.

    acceleration_max  L, largest acceleration to expect [m/s²]
    Raises            ValueError      unless it is positive and finite
                      NonlinearError  from `estimator`: it has no w(z)

    >>> from zwidth.loop.estimators.kernels import velocity_of
    >>> velocity_of(Levant(50.0), [0.0, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4], 0.001).round(4)
    array([0.   , 0.055, 0.11 , 0.1  , 0.1  , 0.1  ])
    """

    acceleration_max: float

    def __post_init__(self) -> None:
        check_positive("acceleration_max", self.acceleration_max, "m/s²")

    def estimator(self, period: float) -> Estimator:
        """Nothing: a sliding mode has no w(z).

        Raises  NonlinearError  always
        """
        check_period(period)
        raise NonlinearError("Levant's differentiator")

    @property
    def parameters(self) -> Floats:
        """Numbers for `levant_estimate`, (2,): lambda0 and lambda1."""
        return np.array([1.5 * sqrt(self.acceleration_max), 1.1 * self.acceleration_max])

    @property
    def memory_size(self) -> int:
        """Numbers that `levant_estimate` remembers."""
        return MEMORY
