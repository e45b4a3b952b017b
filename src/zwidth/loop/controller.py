"""The controller: what the computer does between reading the encoder and setting the force.

The refusal of answers that are not known with feedback beside the wall law.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import floor, inf, nan
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.errors import FeedbackError
from zwidth.loop.estimators import BackwardDifference, VelocityMethod
from zwidth.loop.fixed_feedback import (
    Feedforward,
    FixedFeedback,
    ForceSensor,
    LocalLoop,
    acts,
    describe_feedback,
    feedback_name,
    low_passes,
)
from zwidth.loop.low_pass import Butterworth as Butterworth
from zwidth.loop.low_pass import FirstOrder as FirstOrder
from zwidth.loop.low_pass import LowPass, check_cutoff
from zwidth.model.argument_checks import NumberRange, check_fields, wrong_type
from zwidth.model.design_axes import Number
from zwidth.model.plant import Plant

ROUNDING: Final = 1e-12  # samples by which a delay may fall short of a whole number by rounding


def whole_samples(delay: Floats) -> Ints:
    """Whole samples of delays (...), as `Controller.whole_delay` of one."""
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
    force_sensor, feedforward, local_loop   fixed feedback beside the wall law (`fixed_feedback`); None: none

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
        """The same with all numbers and their units: "a local loop at 10 times the rate (0.5 N s/m)".

        moments  whether moments about an axis are rendered
        """
        every = (self.force_sensor, self.feedforward, self.local_loop)
        return tuple(describe_feedback(feedback, moments) for feedback in every if feedback is not None)

    @property
    def wall_alone(self) -> Controller:
        """The computer with nothing beside the wall law."""
        if self.force_sensor is None and self.feedforward is None and self.local_loop is None:
            return self
        return replace(self, force_sensor=None, feedforward=None, local_loop=None)


def check_no_feedback(controller: Controller, what: str, instead: str) -> None:
    """Raise FeedbackError for a computer with feedback beside the wall law, Coulomb feedforward included.

    what     the answer, such as "limit cycles are not predicted"
    instead  what to do, such as "simulate"
    """
    names = controller.feedback_names if controller.fixed_feedback or controller.feeds_friction else ()
    if names:
        raise FeedbackError(f"{what} with {' and '.join(names)}; {instead}")


def check_no_load(plant: Plant, what: str, instead: str) -> None:
    """Raise FeedbackError for a plant under load, whose computer adds forces to the wall's; arguments as
    before."""
    if plant.is_loaded:
        raise FeedbackError(f"{what} under load; {instead}")
