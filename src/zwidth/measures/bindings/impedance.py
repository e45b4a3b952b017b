"""The catalogue's measures of the stable walls, from the exact chart at operating points."""

from __future__ import annotations

import numpy as np

from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.stiffest_batch import FOUND, StiffestWalls, stiffest_walls
from zwidth.loop.factor_kernels import computer_factors
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.sections_batch import modal_rows_batch
from zwidth.measures.definition import OK, MeasureValues, NoValueError
from zwidth.measures.evaluate import evaluate_pointwise, evaluate_safely, notes_of_points
from zwidth.model.rendered_modes import rendered_modes

NO_WALL = "no wall with K > 0 and B >= 0 is stable"


def stiffness_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of K over the stable walls with K > 0, B >= 0, of the point's model and loop [N/m].

    Postures of classically damped mechanisms are computed together in compiled code (`chart.stiffest_batch`);
    those of them without a certain result, and all other devices, are computed one posture at a time.
    """
    fast = _stiffest_walls_of(point)
    if fast is None:
        return evaluate_pointwise(_stiffness_max_at, point)
    values, status = fast.stiffness.reshape(point.shape), point.status.copy()
    why = {}
    for index in np.argwhere((status == OK) & (fast.status.reshape(point.shape) != FOUND)):
        at = tuple(int(i) for i in index)
        values[at], status[at], reason = evaluate_safely(lambda: _stiffness_max_at(point[at]))  # noqa: B023
        if reason:
            why[at] = (int(status[at]), reason)
    return MeasureValues(np.where(status == OK, values, np.nan), status, notes_of_points(why))


def _stiffest_walls_of(point: OperatingPoint) -> StiffestWalls | None:
    """The stiffest walls of all points, flat; None for a device whose modes the compiled code cannot treat."""
    controller = point.controller
    if point.mechanism is None or point.posture is None or controller.actuator_time_constant > 0.0:
        return None
    model = point.model or "full"
    if point.operator is not None and model != "motor-mass":  # this model holds the operator fixed
        return None
    modes = rendered_modes(point.mechanism, point.posture, point.direction, model, point.damping, point.encoders)
    if modes is None:
        return None
    return stiffest_walls(computer_factors(controller), *modal_rows_batch(modes, controller))


def _stiffness_max_at(point: OperatingPoint) -> float:
    peak = largest_stiffness(point.loop)
    if peak is None:
        raise NoValueError(NO_WALL)
    return peak.stiffness


def damping_max(point: OperatingPoint) -> float:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0, of one point [N s/m]; 0 if none is."""
    return stability_chart(point.loop, decay=False).damping_max


def stable_area(point: OperatingPoint) -> float:
    """Area of the stable walls with K >= 0, B >= 0 of one point [N^2 s/m^2]."""
    return stability_chart(point.loop, decay=False).stable_area


def fastest_decay(point: OperatingPoint) -> float:
    """Spectral radius of the wall whose slowest motion decays fastest, of one point."""
    wall = stability_chart(point.loop).fastest_decay
    if wall is None:
        raise NoValueError("no wall is stable")
    return wall.spectral_radius
