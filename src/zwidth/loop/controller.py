"""The controller: what the computer does between reading the encoder and setting the force."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor, inf, isnan
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from zwidth.loop.estimators import BackwardDifference, VelocityMethod
from zwidth.model.argument_checks import check_choice, check_number, describe_value, wrong_type
from zwidth.model.design_axes import Number

Discretisation = Literal["tustin", "tustin-prewarped"]


ROUNDING: Final = 1e-12  # samples by which a delay may fall short of a whole number by rounding


def whole_samples(delay: NDArray[np.float64]) -> NDArray[np.int64]:
    """Whole samples of delays (...), as `Controller.whole_delay` of one."""
    return np.floor(delay + ROUNDING).astype(np.int64)


@dataclass(frozen=True)
class FirstOrder:
    """First-order low pass by backward Euler: y_j = a y_{j-1} + (1 - a) x_j, a = tau / (tau + T)."""

    time_constant: Number  # tau [s]

    def __post_init__(self) -> None:
        check_number("time_constant", self.time_constant, "s", least=0.0)


@dataclass(frozen=True)
class Butterworth:
    """Butterworth low pass of any order by the bilinear (Tustin) rule, plain or prewarped at the cutoff."""

    order: int
    cutoff_Hz: Number
    discretisation: Discretisation = "tustin"

    def __post_init__(self) -> None:
        if not isinstance(self.order, int | np.integer) or self.order < 1:
            raise ValueError(f"order must be a whole number from 1 on, got {describe_value(self.order)}")
        check_number("cutoff_Hz", self.cutoff_Hz, "Hz", above=0.0)
        check_choice("discretisation", self.discretisation, get_args(Discretisation))


@dataclass(frozen=True)
class Controller:
    """The sampled wall law: f = -F (K y + B v), v estimated from samples of y.

    sampling_period         T [s]; nan: not known, of which no loop is made
    delay                   from reading to force, in samples, any real >= 0
    velocity_filter         acts on the velocity only; None: none
    velocity                how the velocity is estimated
    force_filter            F, acts on the whole force; None: none
    actuator_time_constant  tau of the actuator, tau a' + a = held force [s]; 0: none
    force_limit             largest force that is commanded [N]; charts leave it out

    Numbers may be arrays over designs: such controllers have no delays of their own, and are sampled together
    (`loop_table`).
    Raises  TypeError   for a velocity estimate or a filter of another type
            ValueError  for a number out of range, or a prewarped cutoff at or above half the sampling frequency
    """

    sampling_period: Number
    delay: Number = 0.0
    velocity_filter: FirstOrder | Butterworth | None = None
    velocity: VelocityMethod = field(default_factory=BackwardDifference)
    force_filter: FirstOrder | Butterworth | None = None
    actuator_time_constant: Number = 0.0
    force_limit: Number = inf

    def __post_init__(self) -> None:
        T = self.sampling_period
        if not (isinstance(T, float) and isnan(T)):
            check_number("sampling_period", T, "s", above=0.0, hint="is it a frequency?")
        check_number("delay", self.delay, "samples", least=0.0)
        check_number("actuator_time_constant", self.actuator_time_constant, "s", least=0.0)
        check_number("force_limit", self.force_limit, "N", above=0.0, infinite=True)
        if not isinstance(self.velocity, VelocityMethod):
            raise wrong_type("velocity", "an estimate such as WindowedDifference(4)", self.velocity)
        for name in ("velocity_filter", "force_filter"):
            low_pass = getattr(self, name)
            if not isinstance(low_pass, FirstOrder | Butterworth | None):
                raise wrong_type(name, "a FirstOrder, a Butterworth or None", low_pass)
            if not isinstance(low_pass, Butterworth) or low_pass.discretisation == "tustin":
                continue
            if np.any(low_pass.cutoff_Hz >= 0.5 / T):  # tan(pi cutoff T) is infinite or negative there
                raise ValueError(
                    f"{name}: cutoff_Hz must be below half the sampling frequency, {0.5 / np.max(T):.10g} Hz, got "
                    f"{np.max(low_pass.cutoff_Hz):.10g}"
                )

    @property
    def whole_delay(self) -> int:
        """Whole samples l of the delay."""
        return floor(self.delay + ROUNDING)

    @property
    def fractional_delay(self) -> float:
        """Remaining part f of the delay, 0 <= f < 1 [samples]."""
        return max(self.delay - self.whole_delay, 0.0)
