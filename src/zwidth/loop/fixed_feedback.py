"""What a computer adds to the wall's force: force feedback, feedforward of inertia and friction, a local loop.

All of it is fixed: it does not depend on the wall. `docs/control.md` has the equations, `loop.closed_plant` closes
the loop with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np

from zwidth.loop.estimators import BackwardDifference, LinearMethod
from zwidth.loop.low_pass import Butterworth, FirstOrder, LowPass
from zwidth.model.argument_checks import NumberRange, check_choice, check_fields, describe_value, wrong_type
from zwidth.model.design_axes import Number

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
    """Whether a feedback changes the linear loop at all; for designs, whether that of any of them does."""
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
    """A feedback in words, without numbers whose units hang on what is rendered."""
    match feedback:
        case ForceSensor():
            return describe_feedback(feedback)
        case Feedforward():
            return "feedforward"
        case LocalLoop():
            return f"a local loop at {feedback.rate_multiple} times the rate"


def describe_feedback(feedback: FixedFeedback, moments: bool = False) -> str:
    """A feedback in words, with the numbers that are not 0; several designs' numbers as "several".

    moments  whether moments about an axis are rendered, so that its numbers are in N m/rad, N m s/rad and kg m²
    """
    stiffness, damping, mass, force = UNITS_ABOUT_AN_AXIS if moments else UNITS_ALONG_A_DIRECTION
    match feedback:
        case ForceSensor():
            law = " on the force error" if feedback.law == "force-error" else ""
            return f"force feedback{law} (gain {_text(feedback.gain)})"
        case Feedforward():
            parts = [
                (feedback.inertia, f"{{}} {mass}"),
                (feedback.inertia_share, "{} of the rigid mass"),
                (feedback.damping, f"{{}} {damping}"),
                (feedback.coulomb, f"{{}} {force} of dry friction"),
            ]
            given = [text.format(_text(number)) for number, text in parts if np.any(number)]
            return f"feedforward of {', '.join(given) or 'nothing'}"
        case LocalLoop():
            parts = [(feedback.stiffness, f"{{}} {stiffness}"), (feedback.damping, f"{{}} {damping}")]
            given = [text.format(_text(number)) for number, text in parts if np.any(number)]
            return (
                f"a local loop at {feedback.rate_multiple} times the rate ({', '.join(given) or 'without gains'})"
            )


def _text(number: Number) -> str:
    return "several" if np.ndim(number) else f"{number:.6g}"


def low_passes(feedback: FixedFeedback | None) -> Iterator[tuple[str, LowPass | None]]:
    """Its low passes, each with the name of its argument."""
    names = ("filter", "velocity_filter", "acceleration_filter")
    yield from ((name, getattr(feedback, name)) for name in names if hasattr(feedback, name))


def _check_count(name: str, value: object, least: int, most: int = 100) -> None:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or not least <= value <= most:
        raise ValueError(f"{name} must be a whole number from {least} to {most}, got {describe_value(value)}")


def _check_estimate(method: object) -> None:
    if not isinstance(method, LinearMethod):
        raise wrong_type("velocity", "a linear estimate such as WindowedDifference(4)", method)


def _check_filter(name: str, low_pass: object) -> None:
    if not isinstance(low_pass, FirstOrder | Butterworth | None):
        raise wrong_type(name, "a FirstOrder, a Butterworth or None", low_pass)
