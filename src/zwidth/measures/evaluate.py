"""Measures at operating points: values where there are any, and what became of the rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arc_joining import ChartError
from zwidth.loop.estimator import NonlinearError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_errors import NoMechanismError
from zwidth.loop.sections import HysteresisError, UnmovedError
from zwidth.measures.catalogue import find_measure
from zwidth.measures.measure import (
    FAILED,
    NO_VALUE,
    OK,
    UNDECIDED,
    Measure,
    Measured,
    MeasureError,
    Note,
    NoValueError,
    WantedWall,
)
from zwidth.model.arguments import require
from zwidth.model.reduction import ModelError

NUMBERS = "biuf"  # kinds of arrays that are numbers: bool, signed, unsigned, floating
FAILURES = (Exception, SystemExit)  # a user's own measure that ends the program has failed, and nothing else has
NO_MECHANISM = "speaks of a mechanism, and the device is given by its plant"
NONE = (NoValueError, ModelError, UnmovedError, HysteresisError, NonlinearError)


def evaluate(measure: Measure, point: OperatingPoint) -> Measured:
    """A measure's values at all points, nan with a status where it has none.

    What a measure raises, or returns in another shape, at one point is that point's status FAILED with a note: the
    others keep their values.
    Raises  MeasureError  where it cannot be asked of this device at all
    """
    require("measure", measure, Measure)
    require("point", point, OperatingPoint)
    if measure.each:
        return one_by_one(measure.compute, point)
    try:
        found = measure.compute(point)
    except MeasureError:
        raise
    except NoMechanismError:
        raise MeasureError(NO_MECHANISM) from None
    except FAILURES as error:
        return _everywhere(point, FAILED, _said(error))
    if isinstance(found, Measured):
        return found
    values = np.asarray(found)
    if values.shape != point.shape:
        return _everywhere(point, FAILED, f"returned an array of shape {values.shape} for points of {point.shape}")
    if values.dtype.kind not in NUMBERS:
        return _everywhere(point, FAILED, f"returned {values.dtype} instead of numbers")
    return measured(point, values.astype(np.float64))


def measure_at(
    point: OperatingPoint,
    measure: str | Measure,
    stiffness: float | None = None,
    damping: float | None = None,
    frequency: float | None = None,
) -> Measured:
    """A measure of the catalogue by its name, or one of a user's own, at operating points.

    stiffness, damping, frequency  of the wanted wall [N/m], [N s/m], and of the hand [Hz], for measures about it
    Raises  ValueError    for a name that is no measure's
            MeasureError  where it cannot be asked of this device, or needs what is not given; text begins with its
                          name
    """
    asked = find_measure(measure) if isinstance(measure, str) else measure
    require("measure", asked, Measure)
    try:
        return evaluate(asked.at_wall(WantedWall(stiffness, damping, frequency)), point)
    except MeasureError as error:
        raise error.of(asked.name) from None


def measured(point: OperatingPoint, values: NDArray[np.float64], reason: str = "has no value here") -> Measured:
    """Values with the points' status; NO_VALUE with a reason where they are nan though the point is OK."""
    none: NDArray[np.bool_] = np.asarray((point.status == OK) & np.isnan(values))
    status = np.where(none, NO_VALUE, point.status).astype(np.uint8)
    notes = (_note(none, NO_VALUE, reason),) if none.any() else ()
    return Measured(np.where(status == OK, values, np.nan), status, notes)


def _everywhere(point: OperatingPoint, status: int, reason: str) -> Measured:
    failed = point.status == OK
    told = (_note(failed, status, reason),) if failed.any() else ()
    return Measured(np.full(point.shape, np.nan), np.where(failed, status, point.status).astype(np.uint8), told)


def _note(points: NDArray[np.bool_], status: int, reason: str) -> Note:
    return Note(status, reason, int(points.sum()), tuple(int(i) for i in np.argwhere(points)[0]))


def one_by_one(ask: Callable[[OperatingPoint], Any], point: OperatingPoint) -> Measured:
    """What is asked of one point at a time, at all points."""
    values, status = np.full(point.shape, np.nan), point.status.copy()
    why: dict[tuple[int, ...], tuple[int, str]] = {}
    for index in np.ndindex(point.shape):
        if status[index] == OK:
            values[index], status[index], reason = answered(lambda: ask(point[index]))  # noqa: B023
            if reason:
                why[index] = (int(status[index]), reason)
    return Measured(values, status, reasons(why))


def reasons(why: dict[tuple[int, ...], tuple[int, str]]) -> tuple[Note, ...]:
    """Notes from the status and reason of each point without value, in the order of the points."""
    seen: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}
    for index, key in why.items():
        count, first = seen.get(key, (0, index))
        seen[key] = (count + 1, first)
    return tuple(Note(*key, *rest) for key, rest in seen.items())


def answered(ask: Callable[[], Any]) -> tuple[float, int, str]:
    """Value, status and reason of one question; only a MeasureError is raised."""
    try:
        found = ask()
        value = np.asarray(found)
    except MeasureError:
        raise
    except NoMechanismError:
        raise MeasureError(NO_MECHANISM) from None
    except NONE as error:
        return float("nan"), NO_VALUE, str(error)
    except ChartError as error:
        return float("nan"), UNDECIDED, str(error)
    except FAILURES as error:
        return float("nan"), FAILED, _said(error)
    if value.shape != ():
        return float("nan"), FAILED, f"returned an array of shape {value.shape} instead of one number"
    if value.dtype.kind not in NUMBERS:
        return float("nan"), FAILED, f"returned {repr(found)[:60]} instead of a number"
    if np.isnan(value):
        return float("nan"), NO_VALUE, "has no value here"
    return float(value), OK, ""


def _said(error: BaseException) -> str:
    return f"raised {type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'without a word'}"
