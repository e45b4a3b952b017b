"""Which walls a device can render, exactly, as measures of a place."""

from __future__ import annotations

import numpy as np

from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.stiffest import FOUND, Stiffest, stiffest_walls
from zwidth.loop.evaluate import computer_factors
from zwidth.loop.modal_rows import modal_rows
from zwidth.measures.evaluate import answered, one_by_one, reasons
from zwidth.measures.measure import OK, Measured, NoValueError
from zwidth.measures.place import Place
from zwidth.model.rendered_modes import rendered_modes

NO_WALL = "no wall with K > 0 and B >= 0 is stable"


def stiffness_max(place: Place) -> Measured:
    """Supremum of K over the stable walls with K > 0, B >= 0, of the place's model and loop [N/m].

    Postures of classically damped mechanisms go through compiled code together (`chart.stiffest`); what is in
    doubt there, and what has no wall there, is asked by itself, as every other device is.
    """
    fast = _together(place)
    if fast is None:
        return one_by_one(_largest, place)
    values, status = fast.stiffness.reshape(place.shape), place.status.copy()
    why = {}
    for index in np.argwhere((status == OK) & (fast.status.reshape(place.shape) != FOUND)):
        at = tuple(int(i) for i in index)
        values[at], status[at], reason = answered(lambda: _largest(place.at(*at)))  # noqa: B023
        if reason:
            why[at] = (int(status[at]), reason)
    return Measured(np.where(status == OK, values, np.nan), status, reasons(why))


def _together(place: Place) -> Stiffest | None:
    """The stiffest walls of all places, flat; None for what has no modes that compiled code knows."""
    controller = place.controller
    if place.mechanism is None or place.direction is None or controller.actuator_time_constant > 0.0:
        return None
    model = place.model or "full"
    if place.operator is not None and model != "motor-mass":  # which holds him fixed
        return None
    modes = rendered_modes(place.mechanism, place.placed, place.direction, model, place.damping, place.encoders)
    if modes is None:
        return None
    return stiffest_walls(computer_factors(controller), *modal_rows(modes, controller))


def _largest(place: Place) -> float:
    peak = largest_stiffness(place.loop)
    if peak is None:
        raise NoValueError(NO_WALL)
    return peak.stiffness


def damping_max(place: Place) -> float:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0, of one place [N s/m]; 0 if none is."""
    return stability_chart(place.loop, decay=False).damping_max


def stable_area(place: Place) -> float:
    """Area of the stable walls with K >= 0, B >= 0 of one place [N^2 s/m^2]."""
    return stability_chart(place.loop, decay=False).stable_area


def fastest_decay(place: Place) -> float:
    """Spectral radius of the wall whose slowest motion decays fastest, of one place."""
    found = stability_chart(place.loop).fastest_decay
    if found is None:
        raise NoValueError("no wall is stable")
    return found.spectral_radius
