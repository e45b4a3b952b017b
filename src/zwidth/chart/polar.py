"""The largest stiffness against direction: many rendered directions of one posture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.argument import check_arguments
from zwidth.arrays import Floats
from zwidth.chart.chart import largest_stiffness
from zwidth.chart.chart_batch import STIFFEST
from zwidth.chart.edge_memory import FOUND
from zwidth.chart.edge_memory import NO_WALL as NONE_FOUND
from zwidth.chart.point_chart import numbers_of_points
from zwidth.errors import ChartError, DirectionError, LoadError, ModelError, UnmovedError
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.posed_device import check_several_directions
from zwidth.model.argument_checks import check_kind
from zwidth.model.multi_plant import DEPENDENT
from zwidth.model.plant import Plant
from zwidth.progress import Progress
from zwidth.questions import POLAR
from zwidth.result import Result, documented, entry

OK, NO_WALL = "ok", "no stable wall"
OUT_OF_MOTION = "out of motion: the handle cannot move along the direction"
NONE_STABLE = "no direction has a stable wall with K > 0 and B >= 0"
OUT_OF_MOTION_TOLERANCE = 1e-6  # of a direction, outside what the handle can do


PLANES: Final = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


@dataclass(frozen=True, repr=False)
class ByDirection(Result):
    """The stiffest wall along each of k directions.

    directions  (k, 3)  unit vectors
    stiffness   (k,)    largest K with K > 0, B >= 0 [N/m]; nan where there is none
    damping     (k,)    B there [N s/m]
    frequency   (k,)    of the vibration there, the lower one at a corner [Hz]
    status      (k,)    "ok", "no stable wall", "out of motion: ...", or why the direction has no answer
    plane       "xy", "xz" or "yz" where the directions go evenly round that plane; "" for other directions
    """

    directions: Floats = field(metadata=entry())
    stiffness: Floats = field(metadata=entry("N/m", name="stiffness_max"))
    damping: Floats = field(metadata=entry("N s/m", name="damping_at_stiffness_max"))
    frequency: Floats = field(metadata=entry("Hz", name="frequency_at_stiffness_max"))
    status: tuple[str, ...] = field(metadata=entry())
    plane: str = field(default="", metadata=entry(empty="null", before="directions"))

    @property
    @documented("deg", name="angle", before="stiffness")
    def angles(self) -> Floats:
        """Angles (k,) from the plane's first axis to its second [deg]; nan for directions round no plane."""
        count = len(self.stiffness)
        return 360.0 * np.arange(count) / count if self.plane else np.full(count, np.nan)

    @property
    def reason(self) -> str | None:
        """Why no direction has a stable wall: every reason once; None where a direction has one."""
        if np.isfinite(self.stiffness).any():
            return None
        reasons = sorted(set(self.status))
        return NONE_STABLE if reasons == [NO_WALL] else "; ".join(reasons)

    def table(self) -> dict[str, Any]:
        """The walls as columns, one direction a row."""
        columns = self.document()
        del columns["plane"], columns["directions"]
        return {f"direction_{axis}": self.directions[:, k] for k, axis in enumerate("xyz")} | columns

    def __repr__(self) -> str:
        """Number of directions and range of their largest stiffness, or why none has any."""
        count, around = len(self.stiffness), f" round the {self.plane} plane" if self.plane else ""
        if self.reason is not None:
            return f"ByDirection: {count} directions{around}: {self.reason}"
        low, high = float(np.nanmin(self.stiffness)), float(np.nanmax(self.stiffness))
        return f"ByDirection: {count} directions{around}, largest stiffness {low:.4g} to {high:.4g} N/m"


def circle(count: int, first: ArrayLike = (1.0, 0.0, 0.0), second: ArrayLike = (0.0, 1.0, 0.0)) -> Floats:
    """Unit vectors (count, 3) all round the plane of two orthonormal axes, counter-clockwise from the first.

    >>> circle(4)[1]
    array([0., 1., 0.])
    """
    angles = 2.0 * np.pi * np.arange(count)[:, None] / count
    turned = np.cos(angles) * np.asarray(first, float) + np.sin(angles) * np.asarray(second, float)
    return np.asarray(np.round(turned, 15) + 0.0)  # so that zeros are exact, and none is -0.0


def largest_stiffness_around(
    point: OperatingPoint, plane: str | None = None, count: int = 72, progress: Progress | None = None
) -> ByDirection:
    """The largest stiffness along directions spread evenly round a plane; see `largest_stiffness_by_direction`.

    plane     of the directions, "xy", "xz" or "yz"; left out: xy, or, where the handle cannot move in all of it, a
              plane in which it can
    count     number of directions, spread evenly over the full turn; from 3 to 3600
    progress  as for `largest_stiffness_by_direction`
    Raises    ArgumentError  for another plane or count, and what `largest_stiffness_by_direction` raises
    """
    check_kind("point", point, OperatingPoint)
    check_arguments(POLAR, plane=plane, count=count)
    chosen = plane or _movable_plane(point.jacobian)
    first, second = np.eye(3)[list(PLANES[chosen])]
    directions = circle(count, first, second)
    return replace(largest_stiffness_by_direction(point, directions, progress), plane=chosen)


def _movable_plane(jacobian: Floats) -> str:
    """The first plane in all of whose directions the handle can move; xy where there is none."""
    whole = np.linalg.norm(jacobian, 2)
    for plane, axes in PLANES.items():
        rows = jacobian[list(axes)]
        # two joints at least, and no direction of the plane out of reach but for rounding
        if min(rows.shape) == 2 and np.linalg.svd(rows, compute_uv=False)[-1] > 1e-9 * whole:
            return plane
    return "xy"


def largest_stiffness_by_direction(
    point: OperatingPoint, directions: ArrayLike, progress: Progress | None = None
) -> ByDirection:
    """The largest stiffness along each direction, each traced exactly as `largest_stiffness` does.

    A direction and its opposite render the same walls: actuator and sensor both change sign, the loop does not.
    Each such pair is computed once. A direction that has no answer is data: nan, and a status that says why. One
    that leaves the motions of the handle, the range of its Jacobian, has none: only its projection onto them could
    be rendered, and the factor 1/cos^2 would make its stiffness arbitrarily large.

    point       a single posture of a mechanism, whatever its own direction. Under load the hand pushes as hard
                along each direction, and a direction and its opposite differ
    directions  (k, 3)  of any length but zero
    progress    called with "directions", those that are done, and all of them
    Raises      ValueError  for directions that are not (k, 3) or have no length, and what
                            `OperatingPoint.plant_of_directions` raises
    """
    check_kind("point", point, OperatingPoint)
    given = np.atleast_2d(np.asarray(directions, dtype=float))
    length = np.linalg.norm(given, axis=1, keepdims=True)
    if given.shape[1] != 3:
        raise ValueError(
            f"directions must be vectors (k, 3), got shape {given.shape}; write [[1, 0, 0], [0, 1, 0]]"
        )
    if not (length > 0.0).all():
        wrong = given[np.flatnonzero(~(length > 0.0))[0]].tolist()
        raise ValueError(f"directions must have a length above 0, got {wrong}; leave this one out")
    units = given / length
    if point.load is not None:
        point = replace(point, load=point.load.along_every_direction)
    plant = _plant_by_direction(point)
    motions = _basis_of_motions(point.jacobian)
    keys = [_direction_key(unit, point.load is not None) for unit in units]
    first = {key: n for n, key in reversed(list(enumerate(keys)))}  # number of the first with each key
    # which directions lie outside of the handle's motions
    off = np.linalg.norm(units - units @ motions.T @ motions, axis=1) > OUT_OF_MOTION_TOLERANCE
    wanted = [n for n in first.values() if not off[n]]
    in_batch = _stiffest_in_batch(point, units[wanted])
    rows: dict[tuple[float, ...], tuple[float, float, float, str]] = {}
    done = 0
    for key, n in first.items():
        none = float("nan")
        rows[key] = none, none, none, OUT_OF_MOTION
        if not off[n]:
            known = in_batch[wanted.index(n)]
            rows[key] = known if known is not None else _stiffest(plant, point.towards(units[n]))
        if progress is not None:
            done += keys.count(key)
            progress("directions", done, len(units))
    stiffness, damper, frequency, status = zip(*(rows[key] for key in keys), strict=True)
    return ByDirection(units, np.array(stiffness), np.array(damper), np.array(frequency), status)


def _stiffest_in_batch(point: OperatingPoint, units: Floats) -> list[tuple[float, float, float, str] | None]:
    """K [N/m], B [N s/m], frequency [Hz] and status of the stiffest wall along each unit vector (k, 3), all charts
    at once; None for a direction whose answer is in doubt."""
    assert point.posture is not None
    posture = point.posture.broadcast_to((len(units),))
    along = replace(point, posture=posture, directions=units[:, None, :], wall_matrices=None)
    numbers = numbers_of_points(along, STIFFEST) if len(units) else None
    if numbers is None:
        return [None] * len(units)
    hertz, none = 1.0 / (2.0 * np.pi * point.controller.sampling_period), float("nan")
    found: list[tuple[float, float, float, str] | None] = []
    for n, status in enumerate(numbers.status):
        if status == FOUND:
            K, B, angle = (float(x) for x in (numbers.stiffness[n], numbers.damping[n], numbers.angles[n, 0]))
            found.append((K, B, angle * hertz, OK))
        else:
            found.append((none, none, none, NO_WALL) if status == NONE_FOUND else None)
    return found


def _direction_key(unit: Floats, one_way: bool) -> tuple[float, ...]:
    """A key of a unit vector (3,), the same for a direction and its opposite.

    one_way  True: the two render different walls, as under load, and have keys of their own
    """
    rounded = np.round(unit, 13) + 0.0
    if one_way:
        return tuple(rounded.tolist())
    lead = next(x for x in rounded if x != 0.0)
    return tuple((rounded * np.sign(lead) + 0.0).tolist())


def _basis_of_motions(jacobian: Floats) -> Floats:
    """Orthonormal directions (m, 3) that span all along which the handle can move."""
    basis, size, _ = np.linalg.svd(jacobian)
    return np.asarray(basis.T[: len(size)][size > DEPENDENT * size[0]])


def _plant_by_direction(point: OperatingPoint) -> Callable[[Floats], Plant]:
    """A function that gives the plant along a unit vector (3,).

    Directions share the full model's matrices and differ in their actuator.
    """
    if point.load is not None:
        return lambda unit: point.towards(unit).plant
    check_several_directions(point.mechanism, point.operator, point.encoders, None)
    axes = _basis_of_motions(point.jacobian)
    if point.model != "full" or not len(axes):
        return lambda unit: point.towards(unit).plant
    everywhere = replace(point, directions=axes, wall_matrices=None).plant_of_directions
    return lambda unit: everywhere.along(axes @ unit)


def _stiffest(plant: Callable[[Floats], Plant], along: OperatingPoint) -> tuple[float, float, float, str]:
    """K [N/m], B [N s/m], frequency [Hz] and status of the stiffest wall along a point's direction, traced by
    itself.

    plant  gives the plant along a unit vector (3,)
    """
    none = float("nan")
    try:
        loop = Loop(plant(along.direction), along.computer)
        peak = largest_stiffness(loop)
    except (DirectionError, UnmovedError):
        return none, none, none, OUT_OF_MOTION
    except (ModelError, LoadError) as error:
        return none, none, none, str(error)
    except ChartError as error:
        return none, none, none, f"undecided: {error}"
    if peak is None:
        return none, none, none, NO_WALL
    return peak.stiffness, peak.damping, min(peak.angles) / (2.0 * np.pi * loop.period), OK
