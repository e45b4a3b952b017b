"""Low passes of a computer, by their parameters; `loop.filters` has their factors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from zwidth.model.argument_checks import check_choice, check_number, describe_value
from zwidth.model.design_axes import Number

Discretisation = Literal["tustin", "tustin-prewarped"]


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


LowPass = FirstOrder | Butterworth


def check_cutoff(name: str, low_pass: LowPass | None, sampling_period: Number) -> None:
    """Raise ValueError for a prewarped cutoff at or above half the sampling frequency, where tan(pi cutoff T) is
    infinite or negative."""
    if not isinstance(low_pass, Butterworth) or low_pass.discretisation == "tustin":
        return
    if np.any(low_pass.cutoff_Hz >= 0.5 / np.asarray(sampling_period)):
        raise ValueError(
            f"{name}: cutoff_Hz must be below half the sampling frequency, {0.5 / np.max(sampling_period):.10g} "
            f"Hz, got {np.max(low_pass.cutoff_Hz):.10g}"
        )
