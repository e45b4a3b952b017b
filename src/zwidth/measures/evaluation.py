"""Evaluate measures at operating points: values, and a status and a reason where there is none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zwidth import errors
from zwidth.arrays import Flags, Floats
from zwidth.chart.edge_memory import DOUBTFUL, NO_WALL
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.catalogue import find_measure
from zwidth.measures.definition import (
    FAILED,
    NO_EQUILIBRIUM,
    NO_VALUE,
    OK,
    UNDECIDED,
    Measure,
    MeasureValues,
    Note,
    WantedWall,
)
from zwidth.model.argument_checks import check_kind

NUMBERS = "biuf"  # kinds of arrays that are numbers: bool, signed, unsigned, floating
FAILURES = (
    Exception,
    SystemExit,
)  # a user's measure that calls exit() counts as failed, like any other error in it
NO_MECHANISM = "needs a [mechanism]; this device gives its [plant] only"
NO_VALUE_ERRORS = (
    errors.NoValueError,
    errors.ModelError,
    errors.UnmovedError,
    errors.HysteresisError,
    errors.NonlinearError,
)


def evaluate(measure: Measure, point: OperatingPoint) -> MeasureValues:
    """A measure's values at all points, nan with a status where it has none.

    Where the measure's function raises an error at a point, or returns something else than a number, that point
    has the status FAILED and a note; the others keep their values. Of a function of all points at once all fail.

    Raises  MeasureError  where this device does not have the measure at any point
    """
    check_kind("measure", measure, Measure)
    check_kind("point", point, OperatingPoint)
    if not measured_together(measure, point):
        return evaluate_pointwise(measure.compute, point)
    try:
        result = measure.compute(point)
    except errors.MeasureError:
        raise
    except errors.NoMechanismError:
        raise errors.MeasureError(NO_MECHANISM) from None
    except errors.MissingNumbersError as error:
        raise errors.MeasureError(str(error)) from None
    except FAILURES as error:
        return _same_status(point, FAILED, _error_text(error))
    if isinstance(result, MeasureValues):
        return result
    values = np.asarray(result)
    if values.shape != point.shape:
        return _same_status(
            point, FAILED, f"returned an array of shape {values.shape} for points of {point.shape}"
        )
    if values.dtype.kind not in NUMBERS:
        return _same_status(point, FAILED, f"returned {values.dtype} instead of numbers")
    return with_status(point, values.astype(np.float64))


def measured_together(measure: Measure, point: OperatingPoint) -> bool:
    """Whether a measure is computed for all points at once, and not for one after the other."""
    if measure.each or not point.differing:
        return not measure.each
    return measure.of_designs and (measure.linear or point.mechanism is not None)


def measure_at(
    point: OperatingPoint,
    measure: str | Measure,
    stiffness: float | None = None,
    damping: float | None = None,
    frequency: float | None = None,
    *,
    spectral_radius: float | None = None,
    stiffness_margin: float | None = None,
    damping_margin: float | None = None,
    delay_margin: float | None = None,
    lowest_frequency: float | None = None,
    highest_frequency: float | None = None,
    force: float | None = None,
    link_radius: float | None = None,
    colliding_links: Sequence[str] | None = None,
) -> MeasureValues:
    """Evaluate a measure, of the catalogue by its name or a user's own, at operating points.

    stiffness, damping, frequency  of the wanted wall [N/m], [N s/m], and of the hand [Hz], for measures about it
    spectral_radius ... colliding_links  what else some measures need, as in `measures.definition.WantedWall`
    Raises  ValueError    for an unknown name
            MeasureError  where this device does not have the measure, or an argument that it needs is missing; the
                          text begins with its name
    """
    resolved = find_measure(measure) if isinstance(measure, str) else measure
    check_kind("measure", resolved, Measure)
    try:
        wanted = WantedWall(
            stiffness,
            damping,
            frequency,
            spectral_radius,
            stiffness_margin,
            damping_margin,
            delay_margin,
            lowest_frequency,
            highest_frequency,
            force,
            link_radius,
            None if colliding_links is None else tuple(colliding_links),
        )
        return evaluate(resolved.at_wall(wanted), point)
    except errors.MeasureError as error:
        raise error.with_name(resolved.name) from None


def with_status(point: OperatingPoint, values: Floats, reason: str = "has no value here") -> MeasureValues:
    """Values with the points' status; NO_VALUE with a reason where they are nan though the point is OK."""
    none: Flags = np.asarray((point.status == OK) & np.isnan(values))
    status = np.where(none, NO_VALUE, point.status).astype(np.uint8)
    notes = (_note(none, NO_VALUE, reason),) if none.any() else ()
    return MeasureValues(np.where(status == OK, values, np.nan), status, notes)


def _same_status(point: OperatingPoint, status: int, reason: str) -> MeasureValues:
    """Values for a measure that has none at any point: those that are OK get this status and reason."""
    failed = point.status == OK
    notes = (_note(failed, status, reason),) if failed.any() else ()
    return MeasureValues(
        np.full(point.shape, np.nan), np.where(failed, status, point.status).astype(np.uint8), notes
    )


def _note(points: Flags, status: int, reason: str) -> Note:
    """Note with this status and reason about the points whose flag (...) is True."""
    return Note(status, reason, int(points.sum()), tuple(int(i) for i in np.argwhere(points)[0]))


def evaluate_pointwise(compute: Callable[[OperatingPoint], Any], point: OperatingPoint) -> MeasureValues:
    """Values at all points by a function that is called with one point at a time."""
    return complete_pointwise(np.full(point.shape, np.nan), lambda index: compute(point[index]), point)


def complete_pointwise(
    known: Floats, compute: Callable[[tuple[int, ...]], Any], point: OperatingPoint
) -> MeasureValues:
    """Values at all points: those known (...), and where these are nan those that `compute` gives for an index."""
    status = point.status.copy()
    values = np.where(status == OK, known, np.nan)
    why: dict[tuple[int, ...], tuple[int, str]] = {}
    for index in map(tuple, np.argwhere((status == OK) & np.isnan(values)).tolist()):
        values[index], status[index], reason = evaluate_safely(lambda: compute(index))  # noqa: B023
        if reason:
            why[index] = (int(status[index]), reason)
    return MeasureValues(values, status, notes_of_points(why))


def complete_charts(
    point: OperatingPoint,
    flat: Floats,
    states: NDArray[np.uint8],
    alone: Callable[[tuple[int, ...]], float],
    none_stable: str = "",
) -> MeasureValues:
    """Values at all N points from those of their charts, those in doubt computed one by one.

    flat         (N,)   values by the charts;   states  (N,)  FOUND, NO_WALL or DOUBTFUL
    alone        computes the value at the point of an index
    none_stable  the reason where no wall is stable and there is no number therefore; "": there is one
    """
    values, found = flat.reshape(point.shape), states.reshape(point.shape)
    status, why = point.status.copy(), dict[tuple[int, ...], tuple[int, str]]()
    without = (status == OK) & (found == NO_WALL) & bool(none_stable)
    status[without] = NO_VALUE
    why |= {tuple(int(i) for i in at): (NO_VALUE, none_stable) for at in np.argwhere(without)}
    for index in np.argwhere((status == OK) & (found == DOUBTFUL)):
        at = tuple(int(i) for i in index)
        values[at], status[at], reason = evaluate_safely(lambda: alone(at))  # noqa: B023
        if reason:
            why[at] = (int(status[at]), reason)
    return MeasureValues(
        np.where(status == OK, values, np.nan), status, notes_of_points(dict(sorted(why.items())))
    )


def notes_of_points(why: dict[tuple[int, ...], tuple[int, str]]) -> tuple[Note, ...]:
    """Notes from the status and reason of each point without value, by its index, in the order of the points."""
    by_reason: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}
    for index, key in why.items():
        count, first = by_reason.get(key, (0, index))
        by_reason[key] = (count + 1, first)
    # status and reason, then count and first index
    return tuple(Note(*key, *cells) for key, cells in by_reason.items())


def evaluate_safely(compute: Callable[[], Any]) -> tuple[float, int, str]:
    """Value, status and reason of one call; only a MeasureError is raised, also for numbers or a mechanism that
    the device has not.

    Value nan unless the status is OK; reason "" where there is a value, or the result gives none.
    """
    try:
        result = compute()
        if isinstance(result, MeasureValues):
            reason = result.notes[0].reason if result.notes else ""
            return float(result.values), int(result.status), reason
        value = np.asarray(result)
    except errors.MeasureError:
        raise
    except errors.NoMechanismError:
        raise errors.MeasureError(NO_MECHANISM) from None
    except errors.MissingNumbersError as error:
        raise errors.MeasureError(str(error)) from None
    except NO_VALUE_ERRORS as error:
        return float("nan"), NO_VALUE, str(error)
    except errors.EquilibriumError as error:
        return float("nan"), NO_EQUILIBRIUM, str(error)
    except errors.ChartError as error:
        return float("nan"), UNDECIDED, str(error)
    except FAILURES as error:
        return float("nan"), FAILED, _error_text(error)
    if value.shape != ():
        return float("nan"), FAILED, f"returned an array of shape {value.shape} instead of one number"
    if value.dtype.kind not in NUMBERS:
        return float("nan"), FAILED, f"returned {repr(result)[:60]} instead of a number"
    if np.isnan(value):
        return float("nan"), NO_VALUE, "has no value here"
    return float(value), OK, ""


def _error_text(error: BaseException) -> str:
    """Reason for a point without value: the type of the error and its first line."""
    return f"raised {type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'without a message'}"
