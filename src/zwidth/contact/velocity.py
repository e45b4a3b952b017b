"""How a computer estimates velocities, as numbers for the kernels."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.loop.controller import Controller
from zwidth.loop.estimator import Estimator
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.estimators.levant import Levant
from zwidth.loop.filters import low_pass_factors, velocity_estimator
from zwidth.model.mechanism import Floats

LINEAR: Final = 0
FOAW: Final = 1
LEVANT: Final = 2


class Velocity(NamedTuple):
    """The estimate of one computer.

    method   LINEAR, FOAW or LEVANT;   tuning  parameters of the latter two
    memory   numbers that these remember
    linear   window and factors of a linear one; factors of the filter behind the others
    """

    method: int
    tuning: Floats
    memory: int
    linear: Estimator


def velocity_estimate(controller: Controller) -> Velocity:
    """How the computer estimates velocities."""
    own = controller.velocity
    if not isinstance(own, Foaw | Levant):
        return Velocity(LINEAR, np.zeros(1), 1, velocity_estimator(controller))
    factors = low_pass_factors(controller.velocity_filter, controller.sampling_period)
    rows = (np.array(part, dtype=np.float64).reshape(-1, 3) for part in factors)
    return Velocity(FOAW if isinstance(own, Foaw) else LEVANT, own.parameters, own.memory_size, Estimator(*rows))
