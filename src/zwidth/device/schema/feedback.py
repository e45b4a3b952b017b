"""[loop.force_sensor], [loop.feedforward], [loop.local]: what the computer commands beside the wall's force."""

from __future__ import annotations

from typing import Final, Literal

from zwidth.device.schema import magnitudes
from zwidth.device.schema.value_types import DryFriction, Mass, Number, Section, WholeNumber, documented_key
from zwidth.device.schema.velocity import LowPass, VelocitySection
from zwidth.loop.fixed_feedback import MOST_FAST_SAMPLES

MOST_SAMPLES: Final = 100  # of delay; each adds a state to the loop
_VELOCITY: Final = "how it estimates the velocity, with the keys of [loop.velocity]; omitted: backward difference"


class ForceSensorSection(Section):
    """A force sensor between hand and device, whose reading f is fed back."""

    gain: Number = documented_key("G: force commanded per force measured, above -1", "1", gt=-1)
    law: Literal["force-feedforward", "force-error"] = documented_key(
        '"force-feedforward": wall + G f, the motors help the hand; "force-error": wall + G (f + wall), f is '
        "controlled to what the wall asks for",
        default="force-feedforward",
    )
    filter: LowPass | None = documented_key("low pass on what G is applied to; omitted: none", default=None)
    delay_samples: WholeNumber = documented_key(
        "whole samples that the measured force is late", "1", ge=0, le=MOST_SAMPLES, default=0
    )
    mass_beyond_kg: Mass = documented_key(
        "part of the device's mass at the handle that lies between sensor and hand", "kg", ge=0, default=0.0
    )


class FeedforwardSection(Section):
    """Feedforward of the device's own inertia and friction along the rendered direction."""

    inertia_kg: Mass | None = documented_key(
        "mass that is cancelled, through the estimated acceleration; or inertia_share", "kg", ge=0, default=None
    )
    inertia_share: Number | None = documented_key(
        "the same as a share of the device's rigid mass at its posture, up to 2; or inertia_kg",
        "1",
        ge=0,
        le=2,
        default=None,
    )
    acceleration_filter: LowPass | None = documented_key(
        "low pass on the difference of two estimated velocities over T; required with an inertia", default=None
    )
    damping_Ns_per_m: Number = documented_key(
        "viscous friction that is cancelled, through the estimated velocity",
        "N s/m",
        ge=0,
        le=magnitudes.STRONGEST_DAMPING,
        default=0.0,
    )
    coulomb_N: DryFriction = documented_key(
        "dry friction that is cancelled, by the sign of the estimated velocity; not linear: in simulations only",
        "N",
        default=0.0,
    )
    deadband_m_per_s: Number | None = documented_key(
        "estimated speed up to which that sign is 0; omitted: 0", "m/s", ge=0, default=None
    )
    velocity: VelocitySection | None = documented_key(_VELOCITY, default=None)


class LocalSection(Section):
    """A fast loop on the same encoder, round which the wall's loop is the slow one."""

    rate_multiple: WholeNumber = documented_key(
        f"N: its rate over the wall's, a whole number from 1 to {MOST_FAST_SAMPLES}",
        "1",
        ge=1,
        le=MOST_FAST_SAMPLES,
    )
    stiffness_N_per_m: Number = documented_key(
        "its spring to the reading 0", "N/m", ge=-magnitudes.STIFFEST, le=magnitudes.STIFFEST, default=0.0
    )
    damping_Ns_per_m: Number = documented_key(
        "its damper", "N s/m", ge=-magnitudes.STRONGEST_DAMPING, le=magnitudes.STRONGEST_DAMPING, default=0.0
    )
    velocity: VelocitySection | None = documented_key(f"{_VELOCITY}; at its own rate", default=None)
    delay_samples: Number = documented_key(
        "time from its reading to its force, in its own samples, whole or not",
        "1",
        usual=1.0,
        ge=0,
        le=MOST_SAMPLES,
        default=0.0,
    )
