"""What the computer does between reading the encoder and setting the force."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor, inf
from typing import Literal

from zwidth.loop.estimators import BackwardDifference, VelocityMethod

Discretisation = Literal["tustin", "tustin-prewarped"]


@dataclass(frozen=True)
class FirstOrder:
    """First-order low pass by backward Euler: y_j = a y_{j-1} + (1 - a) x_j, a = tau / (tau + T)."""

    time_constant: float  # tau [s]


@dataclass(frozen=True)
class Butterworth:
    """Butterworth low pass of any order by the bilinear (Tustin) rule, plain or prewarped at the cutoff."""

    order: int
    cutoff_Hz: float
    discretisation: Discretisation = "tustin"


@dataclass(frozen=True)
class Controller:
    """The sampled wall law: f = -F (K y + B v), v estimated from samples of y.

    sampling_period         T [s]
    delay                   from reading to force, in samples, any real >= 0
    velocity_filter         acts on the velocity only; None: none
    velocity                how the velocity is estimated
    force_filter            F, acts on the whole force; None: none
    actuator_time_constant  tau of the actuator, tau a' + a = held force [s]; 0: none
    saturation              largest force that is commanded [N]; charts know nothing of it
    """

    sampling_period: float
    delay: float = 0.0
    velocity_filter: FirstOrder | Butterworth | None = None
    velocity: VelocityMethod = field(default_factory=BackwardDifference)
    force_filter: FirstOrder | Butterworth | None = None
    actuator_time_constant: float = 0.0
    saturation: float = inf

    @property
    def whole_delay(self) -> int:
        """Whole samples l of the delay."""
        return floor(self.delay + 1e-12)

    @property
    def fractional_delay(self) -> float:
        """Remaining part f of the delay, 0 <= f < 1 [samples]."""
        return max(self.delay - self.whole_delay, 0.0)
