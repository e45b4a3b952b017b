"""[loop]: what the computer does between reading the encoder and setting the force.

[loop.force_sensor], [loop.feedforward], [loop.local]: what the computer commands beside the wall's force.

[loop.velocity]: how the velocity is estimated, one table per method, and the low passes there are.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    Strict,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)

from zwidth.device.faults import quote
from zwidth.device.schema import value_types
from zwidth.device.schema.value_types import Section, documented_key
from zwidth.loop.controller import MOST_FAST_SAMPLES
from zwidth.loop.estimators import METHODS
from zwidth.loop.estimators.foaw import LONGEST_WINDOW

HIGHEST_DEGREE: Final = 10  # of a Savitzky-Golay polynomial
HIGHEST_ORDER: Final = 20  # of a Butterworth filter; each adds a state to the loop
DEFAULT_METHOD: Final = "backward-difference"


class FirstOrderFilter(Section):
    """First-order low pass by backward Euler, a = tau / (tau + T)."""

    type: Literal["first-order"] = documented_key('kind of filter: "first-order" or "butterworth"')
    time_constant_s: value_types.Number = documented_key("time constant tau; 0: no filter", "s", ge=0)


class ButterworthFilter(Section):
    """Butterworth low pass by the bilinear (Tustin) rule."""

    type: Literal["butterworth"] = documented_key('kind of filter: "first-order" or "butterworth"')
    order: value_types.WholeNumber = documented_key(
        "order, a whole number from 1 to 20", usual=2, ge=1, le=HIGHEST_ORDER
    )
    cutoff_Hz: value_types.Number = documented_key(
        "cutoff frequency, below half the sampling frequency", "Hz", gt=0
    )
    discretisation: Literal["tustin", "tustin-prewarped"] = documented_key(
        "bilinear rule, plain or prewarped at the cutoff", default="tustin"
    )


LowPass = Annotated[FirstOrderFilter | ButterworthFilter, Field(discriminator="type")]

_METHOD: Final = "estimator of the velocity: " + ", ".join(f'"{name}"' for name in METHODS)
_SAMPLES: Final = (
    'n: of "windowed-difference" the periods between its two positions, of "least-squares-slope" and '
    '"savitzky-golay" the positions used, of "foaw" the most periods in its window; a whole number up to 100'
)
_NOISE: Final = (
    'of the encoder\'s error, "kalman" the standard deviation, "foaw" the largest, half a step; '
    "or loop.encoder.resolution_m"
)


class _Method(Section):
    """Base of all methods; the estimator itself checks that its parameters fit each other."""

    method: str
    filter: LowPass | None = documented_key("low pass on the velocity; omitted: none", default=None)

    @model_validator(mode="after")
    def _check_parameters(self) -> Self:
        """The section itself. Raises ValueError where its parameters make no estimator; with one left out, as a
        noise in whose place the encoder's step stands, nothing is checked."""
        given = self.parameters()
        if None not in given.values():
            METHODS[self.method](**given)
        return self

    def parameters(self) -> dict[str, Any]:
        """The estimator's parameters under their names in Python, without the unit; None where not given."""
        units = ("_m_per_s2", "_m")
        given = {key: value for key, value in self if key not in ("method", "filter")}
        return {
            next((key.removesuffix(unit) for unit in units if key.endswith(unit)), key): given[key]
            for key in given
        }


class BackwardDifferenceSection(_Method):
    """(x_j - x_{j-1}) / T"""

    method: Literal["backward-difference"] = documented_key(_METHOD, default=DEFAULT_METHOD)


class WindowedDifferenceSection(_Method):
    """(x_j - x_{j-n}) / (n T)"""

    method: Literal["windowed-difference"] = documented_key(_METHOD)
    samples: value_types.WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=1, le=LONGEST_WINDOW)


class LeastSquaresSlopeSection(_Method):
    """Slope of the line through the newest n positions."""

    method: Literal["least-squares-slope"] = documented_key(_METHOD)
    samples: value_types.WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=2, le=LONGEST_WINDOW)


class CentralDifferenceSection(_Method):
    """(x_j - x_{j-2}) / (2 T)"""

    method: Literal["central-difference"] = documented_key(_METHOD)


class SavitzkyGolaySection(_Method):
    """Slope of the polynomial through the newest n positions."""

    method: Literal["savitzky-golay"] = documented_key(_METHOD)
    samples: value_types.WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=2, le=LONGEST_WINDOW)
    order: value_types.WholeNumber = documented_key(
        '"savitzky-golay": degree of the polynomial, a whole number from 1 to 10',
        "1",
        usual=2,
        ge=1,
        le=HIGHEST_DEGREE,
    )
    centred: Annotated[bool, Strict()] = documented_key(
        '"savitzky-golay": true for the slope in the middle of the window instead of at its newest position',
        default=False,
    )

    @field_validator("order")
    @classmethod
    def _below_samples(cls, order: int, info: ValidationInfo) -> int:
        """The order of the polynomial itself. Raises ValueError where it is not below the number of samples."""
        samples = info.data.get("samples")
        if samples is not None and order >= samples:
            raise ValueError(
                f"must be below samples = {samples}, got {order}; a polynomial of order p takes p + 1 positions"
            )
        return order


class AlphaBetaSection(_Method):
    """A tracker that corrects its position and velocity by shares of its error."""

    method: Literal["alpha-beta"] = documented_key(_METHOD)
    alpha: value_types.Number = documented_key(
        '"alpha-beta": share of the error given to the position, below 2', "1", usual=0.6, gt=0, lt=2
    )
    beta: value_types.Number = documented_key(
        '"alpha-beta": share of the error given, over T, to the velocity, below 4 - 2 alpha',
        "1",
        usual=0.2,
        gt=0,
        lt=4,
    )


class KalmanSection(_Method):
    """The alpha-beta filter with the gains that two noise figures call for."""

    method: Literal["kalman"] = documented_key(_METHOD)
    acceleration_noise_m_per_s2: value_types.Number = documented_key(
        '"kalman": standard deviation of the accelerations to expect', "m/s^2", usual=10.0, gt=0
    )
    position_noise_m: value_types.Number | None = documented_key(_NOISE, "m", usual=1e-5, gt=0, default=None)


class FoawSection(_Method):
    """Slope of the longest window that a line fits within the noise; it has no chart."""

    method: Literal["foaw"] = documented_key(_METHOD)
    samples: value_types.WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=1, le=LONGEST_WINDOW)
    position_noise_m: value_types.Number | None = documented_key(_NOISE, "m", usual=1e-5, gt=0, default=None)
    fit: Literal["end-fit", "best-fit"] = documented_key(
        '"foaw": "end-fit", the line through the ends of the window, or "best-fit", the least-squares line',
        default="end-fit",
    )


class LevantSection(_Method):
    """The tracker that is exact for accelerations up to a bound; it has no chart."""

    method: Literal["levant"] = documented_key(_METHOD)
    acceleration_max_m_per_s2: value_types.Number = documented_key(
        '"levant": largest acceleration to expect', "m/s^2", usual=20.0, gt=0
    )


def _method_name(table: Any) -> Any:
    """Name of the velocity method of a table or section, the default where it has none; None where it is no
    text."""
    method = (
        table.get("method", DEFAULT_METHOD)
        if isinstance(table, dict)
        else getattr(table, "method", DEFAULT_METHOD)
    )
    return method if isinstance(method, str) else None


VelocitySection = Annotated[
    Annotated[BackwardDifferenceSection, Tag("backward-difference")]
    | Annotated[WindowedDifferenceSection, Tag("windowed-difference")]
    | Annotated[LeastSquaresSlopeSection, Tag("least-squares-slope")]
    | Annotated[CentralDifferenceSection, Tag("central-difference")]
    | Annotated[SavitzkyGolaySection, Tag("savitzky-golay")]
    | Annotated[AlphaBetaSection, Tag("alpha-beta")]
    | Annotated[KalmanSection, Tag("kalman")]
    | Annotated[FoawSection, Tag("foaw")]
    | Annotated[LevantSection, Tag("levant")],
    Discriminator(_method_name),
]


SHORTEST_PERIOD: Final = 1e-7  # s; 10 MHz, far beyond any loop round a motor
LONGEST_PERIOD: Final = 1.0  # s
LONGEST_DELAY: Final = 100  # samples; each adds a state to the loop


def _possible_period(value: Any) -> Any:
    """The value itself. Raises ValueError for a sampling period above 1 s, which may be a frequency in Hz, or
    below 1e-7 s, in which rounding hides the plant's motion; what is no number is left to other checks."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return value
    allowed = f"must be {SHORTEST_PERIOD:g} <= T <= {LONGEST_PERIOD:g} s, got {quote(value)}"
    if LONGEST_PERIOD < value < 1e9:  # above, no frequency either: the key's own limit refuses it
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

    time_constant_s: value_types.Number = documented_key(
        "time constant tau of the force's first-order lag, tau f' + f = held command; 0: none", "s", ge=0
    )


class EncoderSection(Section):
    """Where the encoder sits, and its step."""

    at: Literal["motor", "link", "handle"] | None = documented_key(
        'what the encoders of a mechanism read: "motor" (omitted), or behind the drives the "link" or "handle", '
        "which are the same with rigid links; a [plant] says it by `sensor`",
        default=None,
    )
    resolution_m: value_types.Step | None = documented_key(
        "step of the reading, for a [plant]; 0: as fine as you like; a mechanism gives encoder_counts_per_rev",
        "m",
        usual=1e-4,
        default=None,
    )
    noise_m: value_types.Step | None = documented_key(
        "standard deviation of the reading before it is rounded, for a [plant]; omitted: 0",
        "m",
        usual=1e-4,
        default=None,
    )


class SaturationSection(Section):
    """The largest force that the computer commands."""

    force_N: value_types.NumberOrInfinity = documented_key(
        "largest force that is commanded; inf: no limit", "N", gt=0
    )


class LoopSection(Section):
    """The sampled wall law, f = -F (K y + B v)."""

    sampling_period_s: Annotated[value_types.Number, BeforeValidator(_possible_period)] | None = documented_key(
        "sampling period T, 1e-7 <= T <= 1; omitted, of a [mechanism]: not known, which leaves answers without a "
        "computer",
        "s",
        ge=SHORTEST_PERIOD,
        le=LONGEST_PERIOD,
        default=None,
    )
    delay_samples: value_types.Number | None = documented_key(
        "time from reading the encoder to setting the force, in samples, whole or not; or delay_s",
        "1",
        usual=1.0,
        ge=0,
        default=None,
    )
    delay_s: value_types.Number | None = documented_key(
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


MOST_SAMPLES: Final = 100  # of delay; each adds a state to the loop
_VELOCITY: Final = "how it estimates the velocity, with the keys of [loop.velocity]; omitted: backward difference"


class ForceSensorSection(Section):
    """A force sensor between hand and device, whose reading f is fed back."""

    gain: value_types.Number = documented_key("G: force commanded per force measured, above -1", "1", gt=-1)
    law: Literal["force-feedforward", "force-error"] = documented_key(
        '"force-feedforward": wall + G f, the motors help the hand; "force-error": wall + G (f + wall), f is '
        "controlled to what the wall asks for",
        default="force-feedforward",
    )
    filter: LowPass | None = documented_key("low pass on what G is applied to; omitted: none", default=None)
    delay_samples: value_types.WholeNumber = documented_key(
        "whole samples that the measured force is late", "1", ge=0, le=MOST_SAMPLES, default=0
    )
    mass_beyond_kg: value_types.Mass = documented_key(
        "part of the device's mass at the handle that lies between sensor and hand", "kg", ge=0, default=0.0
    )


class FeedforwardSection(Section):
    """Feedforward of the device's own inertia and friction along the rendered direction."""

    inertia_kg: value_types.Mass | None = documented_key(
        "mass that is cancelled, through the estimated acceleration; or inertia_share", "kg", ge=0, default=None
    )
    inertia_share: value_types.Number | None = documented_key(
        "the same as a share of the device's rigid mass at its posture, up to 2; or inertia_kg",
        "1",
        ge=0,
        le=2,
        default=None,
    )
    acceleration_filter: LowPass | None = documented_key(
        "low pass on the difference of two estimated velocities over T; required with an inertia", default=None
    )
    damping_Ns_per_m: value_types.Number = documented_key(
        "viscous friction that is cancelled, through the estimated velocity",
        "N s/m",
        ge=0,
        le=value_types.STRONGEST_DAMPING,
        default=0.0,
    )
    coulomb_N: value_types.DryFriction = documented_key(
        "dry friction that is cancelled, by the sign of the estimated velocity; not linear: in simulations only",
        "N",
        default=0.0,
    )
    deadband_m_per_s: value_types.Number | None = documented_key(
        "estimated speed up to which that sign is 0; omitted: 0", "m/s", ge=0, default=None
    )
    velocity: VelocitySection | None = documented_key(_VELOCITY, default=None)


class LocalSection(Section):
    """A fast loop on the same encoder, round which the wall's loop is the slow one."""

    rate_multiple: value_types.WholeNumber = documented_key(
        f"N: its rate over the wall's, a whole number from 1 to {MOST_FAST_SAMPLES}",
        "1",
        ge=1,
        le=MOST_FAST_SAMPLES,
    )
    stiffness_N_per_m: value_types.Number = documented_key(
        "its spring to the reading 0", "N/m", ge=-value_types.STIFFEST, le=value_types.STIFFEST, default=0.0
    )
    damping_Ns_per_m: value_types.Number = documented_key(
        "its damper", "N s/m", ge=-value_types.STRONGEST_DAMPING, le=value_types.STRONGEST_DAMPING, default=0.0
    )
    velocity: VelocitySection | None = documented_key(f"{_VELOCITY}; at its own rate", default=None)
    delay_samples: value_types.Number = documented_key(
        "time from its reading to its force, in its own samples, whole or not",
        "1",
        usual=1.0,
        ge=0,
        le=MOST_SAMPLES,
        default=0.0,
    )
