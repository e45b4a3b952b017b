"""The controller: what the computer does between reading the encoder and setting the force.

It filters by low passes, given here by their parameters; `loop.loop_table` has their factors. What it adds to the
wall's force is fixed, and does not depend on the wall: force feedback, feedforward of inertia and friction, a
local loop. `docs/control.md` has the equations, `loop.closed_plant` closes the loop with it. Answers that are not
known with such feedback are refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import floor, inf, nan
from typing import Final, Literal, get_args

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.errors import FeedbackError
from zwidth.loop.estimators import BackwardDifference, LinearMethod, VelocityMethod
from zwidth.model.argument_checks import (
    NumberRange,
    check_choice,
    check_fields,
    check_number,
    describe_value,
    wrong_type,
)
from zwidth.model.design_axes import Number
from zwidth.model.plant import Plant

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
        """Raise ValueError for an order, a cutoff or a discretisation that is out of range."""
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


ForceLaw = Literal["force-feedforward", "force-error"]
UNITS_ALONG_A_DIRECTION: Final = ("N/m", "N s/m", "kg", "N")  # of stiffness, damping, mass and force
UNITS_ABOUT_AN_AXIS: Final = ("N m/rad", "N m s/rad", "kg m²", "N m")
MOST_FAST_SAMPLES: Final = 200  # of a local loop in a period of the wall's
SENSOR_RANGES: Final = {"gain": NumberRange("N/N", above=-1.0), "mass_beyond": NumberRange("kg", least=0.0)}
FEEDFORWARD_RANGES: Final = {
    "inertia": NumberRange("kg", least=0.0),
    "damping": NumberRange("N s/m", least=0.0),
    "coulomb": NumberRange("N", least=0.0),
    "dead_band": NumberRange("m/s", least=0.0),
    "inertia_share": NumberRange("1", least=0.0),
}
LOCAL_RANGES: Final = {
    "stiffness": NumberRange("N/m"),
    "damping": NumberRange("N s/m"),
    "delay": NumberRange("samples of the local loop", least=0.0),
}


@dataclass(frozen=True)
class ForceSensor:
    """Force feedback from a sensor between hand and device, which measures f, the force of the hand on the device:

        command = wall + G(z) f               law "force-feedforward": the hand pushes with 1 + gain
        command = wall + G(z) (f + wall)      law "force-error": f is controlled to what the wall asks for

    with G(z) = gain * filter * z^-delay. The reading is that of the instant before the new command acts.

    gain         force commanded per force measured, above -1
    filter       low pass on the measured force, and on the wall's in the error; None: none
    delay        whole samples that the measured force is late
    mass_beyond  part of the device's mass between sensor and hand, which the sensor carries [kg]
    """

    gain: Number
    filter: LowPass | None = None
    delay: int = 0
    mass_beyond: Number = 0.0
    law: ForceLaw = "force-feedforward"

    def __post_init__(self) -> None:
        """Raise ValueError for a number out of range or an unknown law, TypeError for a filter of another type."""
        check_fields(self, SENSOR_RANGES)
        _check_count("delay", self.delay, 0)
        check_choice("law", self.law, get_args(ForceLaw))
        _check_filter("filter", self.filter)


@dataclass(frozen=True)
class Feedforward:
    """Feedforward of the device's own inertia and friction, from the encoder's reading y:

        command = wall + inertia a + damping v + coulomb sign(v)

        v = velocity method and filter of y,       a = acceleration filter of (v_j - v_{j-1})/T

    Its estimates are its own, beside that of the wall law. The friction's sign is 0 up to |v| = dead_band; it is
    not linear, and only simulations have it.

    inertia             mass that is cancelled along the rendered direction [kg]
    inertia_share       the same as a share of the device's rigid mass at its posture; 0 beside inertia
    damping, coulomb    friction that is cancelled [N s/m], [N]
    dead_band           [m/s]
    """

    inertia: Number = 0.0
    damping: Number = 0.0
    coulomb: Number = 0.0
    dead_band: Number = 0.0
    velocity: LinearMethod = field(default_factory=BackwardDifference)
    velocity_filter: LowPass | None = None
    acceleration_filter: LowPass | None = None
    inertia_share: Number = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for a number out of range, TypeError for an estimate or a filter of another type."""
        check_fields(self, FEEDFORWARD_RANGES)
        if np.any(self.inertia) and np.any(self.inertia_share):
            raise ValueError(
                f"inertia and inertia_share exclude each other, got {describe_value(self.inertia)} kg and "
                f"{describe_value(self.inertia_share)}; leave one of them out"
            )
        _check_estimate(self.velocity)
        _check_filter("velocity_filter", self.velocity_filter)
        _check_filter("acceleration_filter", self.acceleration_filter)


@dataclass(frozen=True)
class LocalLoop:
    """A fast loop on the same encoder, at N times the wall's rate:  command = held command - (K y + B v).

    The wall's command is held for N of its samples.

    rate_multiple       N, whole
    stiffness, damping  K [N/m], B [N s/m]
    velocity            how it estimates v at its own rate;   velocity_filter  on that
    delay               from its reading to its force, in its own samples, any real >= 0
    """

    rate_multiple: int
    stiffness: Number = 0.0
    damping: Number = 0.0
    velocity: LinearMethod = field(default_factory=BackwardDifference)
    velocity_filter: LowPass | None = None
    delay: Number = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for a number out of range, TypeError for an estimate or a filter of another type."""
        _check_count("rate_multiple", self.rate_multiple, 1, MOST_FAST_SAMPLES)
        check_fields(self, LOCAL_RANGES)
        _check_estimate(self.velocity)
        _check_filter("velocity_filter", self.velocity_filter)


FixedFeedback = ForceSensor | Feedforward | LocalLoop


def acts(feedback: FixedFeedback | None) -> bool:
    """Whether a feedback changes the linear loop, one of its gains not 0; of designs, whether that of any does."""
    match feedback:
        case ForceSensor():
            return bool(np.any(feedback.gain))
        case Feedforward():
            return bool(np.any(feedback.inertia) or np.any(feedback.inertia_share) or np.any(feedback.damping))
        case LocalLoop():
            return bool(np.any(feedback.stiffness) or np.any(feedback.damping))
        case None:
            return False


def feedback_name(feedback: FixedFeedback) -> str:
    """A feedback in words, without numbers whose units depend on whether forces or moments are rendered."""
    match feedback:
        case ForceSensor():
            return describe_feedback(feedback)
        case Feedforward():
            return "feedforward"
        case LocalLoop():
            return f"a local loop at {feedback.rate_multiple} times the rate"


def describe_feedback(feedback: FixedFeedback, moments: bool = False) -> str:
    """A feedback in words: a force sensor with its gain, another one with its gains that are not 0; those of
    several designs as "several". Filters and delays are left out.

    moments  whether moments about an axis are rendered, so that numbers are in N m/rad, N m s/rad, kg m² and N m
    """
    stiffness, damping, mass, force = UNITS_ABOUT_AN_AXIS if moments else UNITS_ALONG_A_DIRECTION
    match feedback:
        case ForceSensor():
            law = " on the force error" if feedback.law == "force-error" else ""
            return f"force feedback{law} (gain {_number_text(feedback.gain)})"
        case Feedforward():
            parts = [
                (feedback.inertia, f"{{}} {mass}"),
                (feedback.inertia_share, "{} of the rigid mass"),
                (feedback.damping, f"{{}} {damping}"),
                (feedback.coulomb, f"{{}} {force} of dry friction"),
            ]
            given = [text.format(_number_text(number)) for number, text in parts if np.any(number)]
            return f"feedforward of {', '.join(given) or 'nothing'}"
        case LocalLoop():
            parts = [(feedback.stiffness, f"{{}} {stiffness}"), (feedback.damping, f"{{}} {damping}")]
            given = [text.format(_number_text(number)) for number, text in parts if np.any(number)]
            return (
                f"a local loop at {feedback.rate_multiple} times the rate ({', '.join(given) or 'without gains'})"
            )


def _number_text(number: Number) -> str:
    """A number to six digits; "several" for those of designs."""
    return "several" if np.ndim(number) else f"{number:.6g}"


def low_passes(feedback: FixedFeedback | None) -> Iterator[tuple[str, LowPass | None]]:
    """The arguments of a feedback that take a low pass: name, and the low pass or None for none; nothing of
    None."""
    names = ("filter", "velocity_filter", "acceleration_filter")
    yield from ((name, getattr(feedback, name)) for name in names if hasattr(feedback, name))


def _check_count(name: str, value: object, least: int, most: int = 100) -> None:
    """Raise ValueError for anything but a whole number from `least` to `most`; True and False are none."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or not least <= value <= most:
        raise ValueError(f"{name} must be a whole number from {least} to {most}, got {describe_value(value)}")


def _check_estimate(method: object) -> None:
    """Raise TypeError for anything but a linear velocity estimate."""
    if not isinstance(method, LinearMethod):
        raise wrong_type("velocity", "a linear estimate such as WindowedDifference(4)", method)


def _check_filter(name: str, low_pass: object) -> None:
    """Raise TypeError, which `name` begins, for anything but a low pass or None."""
    if not isinstance(low_pass, FirstOrder | Butterworth | None):
        raise wrong_type(name, "a FirstOrder, a Butterworth or None", low_pass)


ROUNDING: Final = 1e-12  # samples by which a delay may fall short of a whole number by rounding


def whole_samples(delay: Floats) -> Ints:
    """Whole samples (...) of delays (...) [samples], each as `Controller.whole_delay`."""
    return np.floor(delay + ROUNDING).astype(np.int64)


def split_delay(delay: float) -> tuple[int, float]:
    """Whole samples of a delay, and the part that remains, 0 <= f < 1 [samples]."""
    whole = floor(delay + ROUNDING)
    return whole, max(delay - whole, 0.0)


class NotKnown(float):
    """nan for a sampling period that nobody has given; a plain nan is a mistake, and refused."""


NOT_KNOWN: Final = NotKnown(nan)

PERIOD: Final = {"sampling_period": NumberRange("s", above=0.0, hint="is it a frequency?")}
RANGES: Final = {
    "delay": NumberRange("samples", least=0.0),
    "actuator_time_constant": NumberRange("s", least=0.0),
    "force_limit": NumberRange("N", above=0.0, infinite=True),
}


@dataclass(frozen=True)
class Controller:
    """The sampled wall law: f = -F (K y + B v), v estimated from samples of y.

    sampling_period         T [s]; NOT_KNOWN where nobody has given it: no loop is made then
    delay                   from reading to force, in samples, any real >= 0
    velocity_filter         acts on the velocity only; None: none
    velocity                how the velocity is estimated
    force_filter            F, acts on the whole force, that of force sensor and feedforward included; None: none
    actuator_time_constant  tau of the actuator, tau a' + a = held force [s]; 0: none
    force_limit             largest force that is commanded [N]; charts leave it out
    force_sensor, feedforward, local_loop   fixed feedback beside the wall law (`docs/control.md`); None: none

    Numbers may be arrays over designs: such controllers have no delays of their own, and are sampled together
    (`loop_table`).
    Raises  TypeError   for a velocity estimate, a filter or a feedback of another type
            ValueError  for a number out of range, or a prewarped cutoff at or above half the sampling frequency
    """

    sampling_period: Number
    delay: Number = 0.0
    velocity_filter: LowPass | None = None
    velocity: VelocityMethod = field(default_factory=BackwardDifference)
    force_filter: LowPass | None = None
    actuator_time_constant: Number = 0.0
    force_limit: Number = inf
    force_sensor: ForceSensor | None = None
    feedforward: Feedforward | None = None
    local_loop: LocalLoop | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for a number out of range or a cutoff that is too high, TypeError for an estimate or
        part of another type."""
        T = self.sampling_period
        check_fields(self, RANGES if isinstance(T, NotKnown) else PERIOD | RANGES)
        if not isinstance(self.velocity, VelocityMethod):
            raise wrong_type("velocity", "an estimate such as WindowedDifference(4)", self.velocity)
        for name in ("velocity_filter", "force_filter"):
            low_pass = getattr(self, name)
            if not isinstance(low_pass, LowPass | None):
                raise wrong_type(name, "a FirstOrder, a Butterworth or None", low_pass)
            check_cutoff(name, low_pass, T)
        self._check_feedback()

    def _check_feedback(self) -> None:
        """Raise TypeError for a feedback of another type, ValueError for a filter's cutoff that is too high."""
        parts: dict[str, tuple[FixedFeedback | None, type[FixedFeedback]]] = {
            "force_sensor": (self.force_sensor, ForceSensor),
            "feedforward": (self.feedforward, Feedforward),
            "local_loop": (self.local_loop, LocalLoop),
        }
        for part, (feedback, kind) in parts.items():
            if not isinstance(feedback, kind | None):
                raise wrong_type(part, f"a {kind.__name__} or None", feedback)
            times = feedback.rate_multiple if isinstance(feedback, LocalLoop) else 1
            for name, low_pass in low_passes(feedback):
                check_cutoff(f"{part}.{name}", low_pass, self.sampling_period / times)

    @property
    def whole_delay(self) -> int:
        """Whole samples l of the delay."""
        return split_delay(self.delay)[0]

    @property
    def fractional_delay(self) -> float:
        """Remaining part f of the delay, 0 <= f < 1 [samples]."""
        return split_delay(self.delay)[1]

    @property
    def fixed_feedback(self) -> tuple[FixedFeedback, ...]:
        """The feedback beside the wall law that changes the linear loop; () for none."""
        every = (self.force_sensor, self.feedforward, self.local_loop)
        return tuple(feedback for feedback in every if feedback is not None and acts(feedback))

    @property
    def feeds_friction(self) -> bool:
        """Whether dry friction is fed forward, which is not linear."""
        return self.feedforward is not None and bool(np.any(self.feedforward.coulomb))

    @property
    def timing_text(self) -> str:
        """Sampling and delay in words: "sampled every 0.001 s, 0.5 samples of delay"."""
        T = self.sampling_period
        sampling = "sampling period not known" if isinstance(T, NotKnown) else f"sampled every {T:g} s"
        return f"{sampling}, {self.delay:g} samples of delay"

    @property
    def feedback_names(self) -> tuple[str, ...]:
        """What is added to the wall law, in words: "force feedback (gain 0.5)"; () for nothing."""
        every = (self.force_sensor, self.feedforward, self.local_loop)
        return tuple(feedback_name(feedback) for feedback in every if feedback is not None)

    def feedback_texts(self, moments: bool = False) -> tuple[str, ...]:
        """What is added to the wall law, in words with numbers: "a local loop at 10 times the rate (0.5 N s/m)".

        moments  whether moments about an axis are rendered
        """
        every = (self.force_sensor, self.feedforward, self.local_loop)
        return tuple(describe_feedback(feedback, moments) for feedback in every if feedback is not None)

    @property
    def wall_alone(self) -> Controller:
        """The computer without force sensor, feedforward and local loop: itself where it has none of them."""
        if self.force_sensor is None and self.feedforward is None and self.local_loop is None:
            return self
        return replace(self, force_sensor=None, feedforward=None, local_loop=None)


def check_no_feedback(controller: Controller, what: str, instead: str) -> None:
    """Raise FeedbackError for a computer with feedback beside the wall law, Coulomb feedforward included.

    what     the answer, such as "limit cycles are not predicted"
    instead  what the user can do, such as "simulate"
    """
    names = controller.feedback_names if controller.fixed_feedback or controller.feeds_friction else ()
    if names:
        raise FeedbackError(f"{what} with {' and '.join(names)}; {instead}")


def check_no_load(plant: Plant, what: str, instead: str) -> None:
    """Raise FeedbackError for a plant under load, whose computer adds forces to the wall's; arguments as of
    `check_no_feedback`."""
    if plant.is_loaded:
        raise FeedbackError(f"{what} under load; {instead}")
