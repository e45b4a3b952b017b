"""[loop.velocity]: how the velocity is estimated, one table per method, and the low passes there are."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

from pydantic import Discriminator, Field, Strict, Tag, ValidationInfo, field_validator, model_validator

from zwidth.device.schema.value_types import Number, Section, WholeNumber, documented_key
from zwidth.loop.estimators import METHODS
from zwidth.loop.estimators.foaw import LONGEST_WINDOW

HIGHEST_DEGREE: Final = 10  # of a Savitzky-Golay polynomial
HIGHEST_ORDER: Final = 20  # of a Butterworth filter; each adds a state to the loop
DEFAULT_METHOD: Final = "backward-difference"


class FirstOrderFilter(Section):
    """First-order low pass by backward Euler, a = tau / (tau + T)."""

    type: Literal["first-order"] = documented_key('kind of filter: "first-order" or "butterworth"')
    time_constant_s: Number = documented_key("time constant tau; 0: no filter", "s", ge=0)


class ButterworthFilter(Section):
    """Butterworth low pass by the bilinear (Tustin) rule."""

    type: Literal["butterworth"] = documented_key('kind of filter: "first-order" or "butterworth"')
    order: WholeNumber = documented_key("order, a whole number from 1 to 20", usual=2, ge=1, le=HIGHEST_ORDER)
    cutoff_Hz: Number = documented_key("cutoff frequency, below half the sampling frequency", "Hz", gt=0)
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
    def _can_be_built(self) -> Self:
        """Build the estimator, which raises ValueError where parameters do not fit each other."""
        own = self.parameters()
        if None not in own.values():
            METHODS[self.method](**own)
        return self

    def parameters(self) -> dict[str, Any]:
        """The estimator's parameters under their names in Python; None where not given."""
        units = ("_m_per_s2", "_m")
        own = {key: value for key, value in self if key not in ("method", "filter")}
        return {next((key.removesuffix(u) for u in units if key.endswith(u)), key): own[key] for key in own}


class BackwardDifferenceSection(_Method):
    """(x_j - x_{j-1}) / T"""

    method: Literal["backward-difference"] = documented_key(_METHOD, default=DEFAULT_METHOD)


class WindowedDifferenceSection(_Method):
    """(x_j - x_{j-n}) / (n T)"""

    method: Literal["windowed-difference"] = documented_key(_METHOD)
    samples: WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=1, le=LONGEST_WINDOW)


class LeastSquaresSlopeSection(_Method):
    """Slope of the line through the newest n positions."""

    method: Literal["least-squares-slope"] = documented_key(_METHOD)
    samples: WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=2, le=LONGEST_WINDOW)


class CentralDifferenceSection(_Method):
    """(x_j - x_{j-2}) / (2 T)"""

    method: Literal["central-difference"] = documented_key(_METHOD)


class SavitzkyGolaySection(_Method):
    """Slope of the polynomial through the newest n positions."""

    method: Literal["savitzky-golay"] = documented_key(_METHOD)
    samples: WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=2, le=LONGEST_WINDOW)
    order: WholeNumber = documented_key(
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
        """Refuse an order that so many samples cannot determine."""
        samples = info.data.get("samples")
        if samples is not None and order >= samples:
            raise ValueError(
                f"must be below samples = {samples}, got {order}; a polynomial of order p takes p + 1 positions"
            )
        return order


class AlphaBetaSection(_Method):
    """A tracker that corrects its position and velocity by shares of its error."""

    method: Literal["alpha-beta"] = documented_key(_METHOD)
    alpha: Number = documented_key(
        '"alpha-beta": share of the error given to the position, below 2', "1", usual=0.6, gt=0, lt=2
    )
    beta: Number = documented_key(
        '"alpha-beta": share of the error given, over T, to the velocity, below 4 - 2 alpha',
        "1",
        usual=0.2,
        gt=0,
        lt=4,
    )


class KalmanSection(_Method):
    """The alpha-beta filter with the gains that two noise figures call for."""

    method: Literal["kalman"] = documented_key(_METHOD)
    acceleration_noise_m_per_s2: Number = documented_key(
        '"kalman": standard deviation of the accelerations to expect', "m/s^2", usual=10.0, gt=0
    )
    position_noise_m: Number | None = documented_key(_NOISE, "m", usual=1e-5, gt=0, default=None)


class FoawSection(_Method):
    """Slope of the longest window that a line fits within the noise; it has no chart."""

    method: Literal["foaw"] = documented_key(_METHOD)
    samples: WholeNumber = documented_key(_SAMPLES, "1", usual=8, ge=1, le=LONGEST_WINDOW)
    position_noise_m: Number | None = documented_key(_NOISE, "m", usual=1e-5, gt=0, default=None)
    fit: Literal["end-fit", "best-fit"] = documented_key(
        '"foaw": "end-fit", the line through the ends of the window, or "best-fit", the least-squares line',
        default="end-fit",
    )


class LevantSection(_Method):
    """The tracker that is exact for accelerations up to a bound; it has no chart."""

    method: Literal["levant"] = documented_key(_METHOD)
    acceleration_max_m_per_s2: Number = documented_key(
        '"levant": largest acceleration to expect', "m/s^2", usual=20.0, gt=0
    )


def _method(table: Any) -> Any:
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
    Discriminator(_method),
]
