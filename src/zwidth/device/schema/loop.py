"""[loop]: what the computer does between reading the encoder and setting the force."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field

from zwidth.device.faults import quote
from zwidth.device.schema.numbers import Number, Section, WholeNumber, quantity

SHORTEST_PERIOD: Final = 1e-7  # s; 10 MHz, far beyond any loop round a motor
LONGEST_PERIOD: Final = 1.0  # s
LONGEST_DELAY: Final = 100  # samples; each adds a state to the loop
HIGHEST_ORDER: Final = 20  # of a Butterworth filter; each adds a state to the loop


def _a_period(value: Any) -> Any:
    """Refuse a frequency, and a period so short that a sample changes the plant by less than rounding does."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return value
    allowed = f"must be {SHORTEST_PERIOD:g} <= T <= {LONGEST_PERIOD:g} s, got {quote(value)}"
    if LONGEST_PERIOD < value < 1e9:
        raise ValueError(f"{allowed}; is {value:.10g} a frequency in Hz? then T = {1 / value:.6g}")
    if 0 < value < SHORTEST_PERIOD:
        raise ValueError(
            f"{allowed}; no device is sampled faster than 10 MHz, and rounding would drown what happens in one "
            "sample: is the unit right?"
        )
    return value


class FirstOrderFilter(Section):
    """First-order low pass by backward Euler, a = tau / (tau + T)."""

    type: Literal["first-order"] = quantity('kind of filter: "first-order" or "butterworth"')
    time_constant_s: Number = quantity("time constant tau; 0: no filter", "s", ge=0)


class ButterworthFilter(Section):
    """Butterworth low pass by the bilinear (Tustin) rule."""

    type: Literal["butterworth"] = quantity('kind of filter: "first-order" or "butterworth"')
    order: WholeNumber = quantity("order, a whole number from 1 to 20", ge=1, le=HIGHEST_ORDER)
    cutoff_Hz: Number = quantity("cutoff frequency, below half the sampling frequency", "Hz", gt=0)
    discretisation: Literal["tustin", "tustin-prewarped"] = quantity(
        "bilinear rule, plain or prewarped at the cutoff", default="tustin"
    )


class VelocitySection(Section):
    """How the velocity is estimated from the encoder."""

    method: Literal["backward-difference"] = quantity(
        "estimator of the velocity; (x_j - x_{j-1}) / T", default="backward-difference"
    )
    filter: Annotated[FirstOrderFilter | ButterworthFilter, Field(discriminator="type")] | None = quantity(
        "low pass on the velocity; omitted: none", default=None
    )


class LoopSection(Section):
    """The sampled wall law, f = -(K y + B v)."""

    sampling_period_s: Annotated[Number, BeforeValidator(_a_period)] = quantity(
        "sampling period T, 1e-7 <= T <= 1", "s", ge=SHORTEST_PERIOD, le=LONGEST_PERIOD
    )
    delay_samples: Number | None = quantity(
        "time from reading the encoder to setting the force, in samples, whole or not; or delay_s",
        "1",
        ge=0,
        default=None,
    )
    delay_s: Number | None = quantity(
        "time from reading the encoder to setting the force; or delay_samples", "s", ge=0, default=None
    )
    velocity: VelocitySection = quantity(
        "how the velocity is estimated", default=VelocitySection(method="backward-difference", filter=None)
    )
