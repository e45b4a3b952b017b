"""The largest stiffness against direction: many rendered directions of one posture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.chart.arc_joining import ChartError
from zwidth.chart.chart import largest_stiffness
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_errors import check_several_directions
from zwidth.loop.sections import UnmovedError
from zwidth.model.arguments import require
from zwidth.model.directions import DEPENDENT
from zwidth.model.plant import Plant
from zwidth.model.reduction import DirectionError, ModelError

Floats = NDArray[np.float64]

OK, NO_WALL = "ok", "no stable wall"
OUT_OF_MOTION = "out of motion: the handle cannot move along the direction"
OFF = 1e-6  # of a direction, outside what the handle can do


@dataclass(frozen=True)
class ByDirection:
    """The stiffest wall along each of k directions.

    directions  (k, 3)  unit vectors
    stiffness   (k,)    largest K with K > 0, B >= 0 [N/m]; nan where there is none
    damping     (k,)    B there [N s/m]
    frequency   (k,)    of the vibration there, the lower one at a corner [Hz]
    status      (k,)    "ok", "no stable wall", "out of motion: ...", or why the direction has no answer
    """

    directions: Floats
    stiffness: Floats
    damping: Floats
    frequency: Floats
    status: tuple[str, ...]


def circle(count: int, first: ArrayLike = (1.0, 0.0, 0.0), second: ArrayLike = (0.0, 1.0, 0.0)) -> Floats:
    """Unit vectors (count, 3) all round the plane of two orthonormal axes, counter-clockwise from the first.

    >>> circle(4)[1]
    array([0., 1., 0.])
    """
    angles = 2.0 * np.pi * np.arange(count)[:, None] / count
    turned = np.cos(angles) * np.asarray(first, float) + np.sin(angles) * np.asarray(second, float)
    return np.asarray(np.round(turned, 15) + 0.0)  # what rounding leaves of a zero is none


def largest_stiffness_by_direction(point: OperatingPoint, directions: ArrayLike) -> ByDirection:
    """The largest stiffness along each direction, each traced exactly as `largest_stiffness` does.

    A direction and its opposite render the same walls: actuator and sensor both change sign, the loop does not.
    Each such pair is computed once. A direction that has no answer is data: nan, and a status that says why. One
    that leaves the motions of the handle, the range of its Jacobian, has none: only its shadow within them could
    be rendered, whose stiffness 1/cos^2 would let appear as large as one likes.

    point       a single posture of a mechanism, whatever its own direction
    directions  (k, 3)  of any length but zero
    Raises      ValueError  for a direction without length, and what `OperatingPoint.plant_of_directions` raises
    """
    require("point", point, OperatingPoint)
    given = np.atleast_2d(np.asarray(directions, dtype=float))
    length = np.linalg.norm(given, axis=1, keepdims=True)
    if given.shape[1] != 3 or not (length > 0.0).all():
        raise ValueError("directions must be an array (k, 3) of vectors that have a length")
    units = given / length
    plant = _plants(point)
    moving = _motions(point.jacobian)
    results: dict[tuple[float, ...], tuple[float, float, float, str]] = {}
    rows = []
    for unit in units:
        key = _either_way(unit)
        if key not in results:
            off = np.linalg.norm(unit - moving.T @ (moving @ unit)) > OFF
            none = float("nan")
            results[key] = (none, none, none, OUT_OF_MOTION) if off else _stiffest(plant, unit, point.controller)
        rows.append(results[key])
    stiffness, damper, frequency, status = zip(*rows, strict=True)
    return ByDirection(units, np.array(stiffness), np.array(damper), np.array(frequency), status)


def _either_way(unit: Floats) -> tuple[float, ...]:
    """One name for a direction and its opposite."""
    rounded = np.round(unit, 13) + 0.0
    lead = next(x for x in rounded if x != 0.0)
    return tuple((rounded * np.sign(lead) + 0.0).tolist())


def _motions(jacobian: Floats) -> Floats:
    """Orthonormal directions (m, 3) that span all along which the handle can move."""
    basis, size, _ = np.linalg.svd(jacobian)
    return np.asarray(basis.T[: len(size)][size > DEPENDENT * size[0]])


def _plants(point: OperatingPoint) -> Callable[[Floats], Plant]:
    """The plant along a unit vector. Directions share the full model's matrices and differ in their actuator."""
    check_several_directions(point.mechanism, point.operator, point.encoders)
    if point.model != "full":
        return lambda unit: point.towards(unit).plant
    axes = _motions(point.jacobian)
    everywhere = replace(point, directions=axes).plant_of_directions
    return lambda unit: everywhere.along(axes @ unit)


def _stiffest(
    plant: Callable[[Floats], Plant], unit: Floats, controller: Controller
) -> tuple[float, float, float, str]:
    """Stiffness, damping, frequency and status along one direction."""
    none = float("nan")
    try:
        loop = Loop(plant(unit), controller)
        peak = largest_stiffness(loop)
    except (DirectionError, UnmovedError):
        return none, none, none, OUT_OF_MOTION
    except ModelError as error:
        return none, none, none, str(error)
    except ChartError as error:
        return none, none, none, f"undecided: {error}"
    if peak is None:
        return none, none, none, NO_WALL
    return peak.stiffness, peak.damping, min(peak.angles) / (2.0 * np.pi * loop.period), OK
