"""What several measures ask of a place: the wanted wall and frequency, and what its loop is like."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.conditions.assumptions import COLLOCATED, PLAIN, Case, case_of
from zwidth.loop.estimator import NonlinearError
from zwidth.loop.loop import Loop
from zwidth.measures.felt import HandleError, handle_of
from zwidth.measures.measure import MeasureError
from zwidth.measures.place import Place
from zwidth.model.plant import Plant
from zwidth.model.reduction import ModelError

# One mass that stands for a mechanism where only its computer is in question.
UNIT: Final = Plant(np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)), np.ones(1), np.ones(1))


def wanted_wall(place: Place) -> tuple[float, float]:
    """Stiffness and damping of the wanted wall. Raises MeasureError where they were not told."""
    K, B = place.wanted.stiffness, place.wanted.damping
    if K is None or B is None:
        raise MeasureError("needs a wanted wall; give --stiffness and --damping")
    return K, B


def wanted_frequency(place: Place) -> float:
    """At which the hand moves [Hz]. Raises MeasureError where it was not told."""
    if place.wanted.frequency is None:
        raise MeasureError("needs a frequency at which the hand moves; give --frequency")
    if not 0.0 < place.wanted.frequency < np.inf:
        raise MeasureError(f"needs a frequency above 0 Hz, got {place.wanted.frequency:g} Hz")
    return place.wanted.frequency


def alone(place: Place) -> Place:
    """The place with nobody at its handle."""
    return replace(place, operator=None)


def held_plant(place: Place) -> Plant:
    """The device alone at one place, whose handle is known. Raises MeasureError where there is no handle."""
    plant = alone(place).plant
    try:
        handle_of(plant)
    except HandleError:
        where = f"the model {place.model} has" if place.model else "the device has"
        raise MeasureError(f"needs a handle, and {where} none; give `handle`, or use another model") from None
    return plant


def computer(place: Place) -> Case:
    """The place's loop in the words of the published conditions; of a mechanism the computer's part only.

    Raises  MeasureError  where the loop is not linear, or the model does not apply to a given plant
    """
    try:
        plant = UNIT if place.mechanism is not None else alone(place).plant
        return case_of(Loop(plant, place.controller))
    except (ModelError, NonlinearError) as error:
        raise MeasureError(f"has no closed form here: {error}") from None


def meets(case: Case, *more: str) -> None:
    """Raises MeasureError, with the assumptions in words, where a loop does not meet those of the closed forms.

    They take the velocity as the backward difference and apply the force as computed; that of damping is left out.
    """
    broken = [sentence for sentence in (COLLOCATED, *more, *PLAIN) if sentence in case.unmet]
    if broken:
        raise MeasureError(f"has no closed form for this loop, which breaks what it assumes: {' '.join(broken)}")


def reads_motors(place: Place) -> None:
    """Raises MeasureError for encoders behind the drives, which a model with its link side held cannot read."""
    if place.mechanism is not None and place.encoders == "link":
        raise MeasureError("speaks of motors that are read at the motors, and these encoders read the links")
