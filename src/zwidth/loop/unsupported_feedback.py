"""The refusal of answers that are not known with feedback beside the wall law."""

from __future__ import annotations

from zwidth.loop.controller import Controller
from zwidth.model.plant import Plant
from zwidth.model.reduction import ModelError


class FeedbackError(ModelError):
    """An answer is not known with the feedback that a computer adds to the wall law."""


def refuse_feedback(controller: Controller, what: str, instead: str) -> None:
    """Raise FeedbackError for a computer with feedback beside the wall law, Coulomb feedforward included.

    what     the answer, such as "limit cycles are not predicted"
    instead  what to do, such as "simulate"
    """
    names = controller.feedback_names if controller.fixed_feedback or controller.feeds_friction else ()
    if names:
        raise FeedbackError(f"{what} with {' and '.join(names)}; {instead}")


def refuse_load(plant: Plant, what: str, instead: str) -> None:
    """Raise FeedbackError for a plant under load, whose computer adds forces to the wall's; arguments as
    before."""
    if plant.is_loaded:
        raise FeedbackError(f"{what} under load; {instead}")
