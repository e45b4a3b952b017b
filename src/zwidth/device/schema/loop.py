"""[loop]: what the computer does between reading the encoder and setting the force."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator

from zwidth.device.faults import quote
from zwidth.device.schema.feedback import FeedforwardSection, ForceSensorSection, LocalSection
from zwidth.device.schema.value_types import Number, NumberOrInfinity, Section, Step, documented_key
from zwidth.device.schema.velocity import BackwardDifferenceSection, LowPass, VelocitySection

SHORTEST_PERIOD: Final = 1e-7  # s; 10 MHz, far beyond any loop round a motor
LONGEST_PERIOD: Final = 1.0  # s
LONGEST_DELAY: Final = 100  # samples; each adds a state to the loop


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


class ForceSection(Section):
    """What the computed force passes before it is set."""

    filter: LowPass | None = documented_key("low pass on the whole force; omitted: none", default=None)


class ActuatorSection(Section):
    """How the force follows its command."""

    time_constant_s: Number = documented_key(
        "time constant tau of the force's first-order lag, tau f' + f = held command; 0: none", "s", ge=0
    )


class EncoderSection(Section):
    """Where the encoder sits, and its step."""

    at: Literal["motor", "link", "handle"] | None = documented_key(
        'what the encoders of a mechanism read: "motor" (omitted), or behind the drives the "link" or "handle", '
        "which are the same with rigid links; a [plant] says it by `sensor`",
        default=None,
    )
    resolution_m: Step | None = documented_key(
        "step of the reading, for a [plant]; 0: as fine as you like; a mechanism gives encoder_counts_per_rev",
        "m",
        usual=1e-4,
        default=None,
    )
    noise_m: Step | None = documented_key(
        "standard deviation of the reading before it is rounded, for a [plant]; omitted: 0",
        "m",
        usual=1e-4,
        default=None,
    )


class SaturationSection(Section):
    """The largest force that the computer commands."""

    force_N: NumberOrInfinity = documented_key("largest force that is commanded; inf: no limit", "N", gt=0)


class LoopSection(Section):
    """The sampled wall law, f = -F (K y + B v)."""

    sampling_period_s: Annotated[Number, BeforeValidator(_a_period)] | None = documented_key(
        "sampling period T, 1e-7 <= T <= 1; omitted, of a [mechanism]: not known, which leaves answers without a "
        "computer",
        "s",
        ge=SHORTEST_PERIOD,
        le=LONGEST_PERIOD,
        default=None,
    )
    delay_samples: Number | None = documented_key(
        "time from reading the encoder to setting the force, in samples, whole or not; or delay_s",
        "1",
        usual=1.0,
        ge=0,
        default=None,
    )
    delay_s: Number | None = documented_key(
        "time from reading the encoder to setting the force; or delay_samples", "s", ge=0, default=None
    )
    velocity: VelocitySection = documented_key(
        "how the velocity is estimated",
        default=BackwardDifferenceSection(method="backward-difference", filter=None),
    )
    force: ForceSection = documented_key("what the force passes", default=ForceSection(filter=None))
    actuator: ActuatorSection = documented_key(
        "how the force follows", default=ActuatorSection(time_constant_s=0.0)
    )
    encoder: EncoderSection = documented_key(
        "where the encoder sits, and its step", default=EncoderSection(at=None, resolution_m=None, noise_m=None)
    )
    saturation: SaturationSection | None = documented_key("the largest force; omitted: no limit", default=None)
    force_sensor: ForceSensorSection | None = documented_key(
        "a force sensor at the handle, fed back; omitted: none", default=None
    )
    feedforward: FeedforwardSection | None = documented_key(
        "feedforward of the device's own inertia and friction; omitted: none", default=None
    )
    local: LocalSection | None = documented_key("a fast loop under the wall's; omitted: none", default=None)
