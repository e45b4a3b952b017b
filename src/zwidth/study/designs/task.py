"""The task that a device is designed for: where it must reach, along which directions it renders, who holds it,
and what is demanded of it everywhere there.

Without a task the best device is a vanishing one: short, light, stiff, and of no use.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.address import is_number, table
from zwidth.device.device import Device
from zwidth.errors import DeviceError, MeasureError, PostureError
from zwidth.model.posture import handle_motions
from zwidth.study.workspace.extreme_direction import sphere

Fault = tuple[tuple[str | int, ...], str]

# Key of [task] -> the measure that it bounds, and whether it is a lower bound.
DEMANDS: Final[dict[str, tuple[str, bool]]] = {
    "peak_force_N": ("peak_force", True),
    "continuous_force_N": ("continuous_force", True),
    "motor_heat_W": ("motor_heat", False),
    "friction_N": ("friction_force", False),
    "apparent_mass_kg": ("rigid_mass", False),
    "resolution_m": ("position_resolution", False),
    "first_mode_Hz": ("first_mode", True),
    "distance_to_singularity": ("distance_to_singularity", True),
    "joint_margin": ("joint_margin", True),
    "clearance_m": ("link_clearance", True),
    "footprint_radius_m": ("reach", False),
}
SHAPES: Final = ("box_m", "radius_m", "points_m")
PER_AXIS: Final = 5  # points of a box along each axis
RINGS: Final = 3  # of a disk, or shells of a ball
DIRECTIONS: Final = 4
MOST: Final = 100_000  # points of a shape times directions


@dataclass(frozen=True)
class Task:
    """Where, along which directions and with whom a device is used.

    positions   (n, 3)  of the handle [m]; None: the device's reference, or a plant
    directions  (d, 3)  unit vectors along which walls are rendered; None: the device's own
    operators   names of who holds it; (): as the device file says
    demands     key of [task] -> bound, for each demand
    """

    positions: Floats | None
    directions: Floats | None
    operators: tuple[str, ...]
    demands: Mapping[str, float]

    @property
    def grid(self) -> Floats | None:
        """Positions (n, 1, 3), the second axis for directions; None where there are none."""
        return None if self.positions is None else self.positions[:, None, :]


def task_of(document: Mapping[str, Any], device: Device, faults: list[Fault], *, finer: int = 1) -> Task | None:
    """The task that a study's [task] describes; None where anything is wrong with it, which is added to `faults`.

    document  of the study; values of the wrong type are left to its schema
    finer     factor on the number of steps between the points of a box, on the rings or shells, and on the
              directions that are spread. Those of finer = 1 are among them, but for points of a ball, and
              directions in space
    """
    given = table(dict(document), "task")
    found: list[Fault] = list(_shape_faults(given, device))
    positions = None if found else _positions(given, document, device, found, finer)
    directions = None if found else _directions(given, document, device, found, finer)
    many = (1 if positions is None else len(positions)) * (1 if directions is None else len(directions))
    if many > MOST:
        found.append((("count",), f"makes {many} points and directions, {MOST} are allowed; lower it"))
    faults += [(("task", *path), message) for path, message in found]
    if found:
        return None
    operators = given.get("operators", ())
    return Task(positions, directions, tuple(operators), demands_of(given))


def demands_of(given: Mapping[str, Any]) -> dict[str, float]:
    """Key -> bound of each demand in a [task]."""
    return {key: float(given[key]) for key in DEMANDS if is_number(given.get(key))}


def _shape_faults(given: Mapping[str, Any], device: Device) -> Iterator[Fault]:
    """Faults of the keys of [task] that describe the shape and its points."""
    shapes = [key for key in SHAPES if key in given]
    if len(shapes) > 1:
        yield ((shapes[1],), f"and {shapes[0]} exclude each other; remove one of them")
    if shapes and device.mechanism is None:
        yield ((shapes[0],), "needs the workspace of a [mechanism]; this device gives its [plant] only; remove it")
    if ("radius_m" in given) != ("center_m" in given):
        key, other = ("radius_m", "center_m") if "radius_m" in given else ("center_m", "radius_m")
        yield ((key,), f"goes with {other}; give both")
    if "count" in given and not {"box_m", "radius_m"} & given.keys():
        yield (("count",), "is read with box_m or radius_m only; remove it")
    if isinstance(given.get("count"), list) and "radius_m" in given:
        yield (("count",), "must be one number with radius_m: rings round the centre, or shells")
    if "directions" in given and device.mechanism is None:
        yield (("directions",), "needs a [mechanism]; this device's [plant] renders one direction; remove it")
    box = given.get("box_m")
    for n, span in enumerate(box if isinstance(box, list) else []):
        if isinstance(span, list) and len(span) == 2 and all(map(is_number, span)) and not span[0] <= span[1]:
            yield (("box_m", n), f"must be [lower, upper] with lower <= upper, got {span}")


def _positions(
    given: Mapping[str, Any], document: Mapping[str, Any], device: Device, faults: list[Fault], finer: int
) -> Floats | None:
    """Positions (n, 3) of the shape's points, without a shape the study's `at`, or else the reference [m]; None
    without a mechanism, and with faults.

    given     the table [task], whose keys fit together (`_shape_faults`)
    document  of the study
    faults    gets what is wrong with the positions, by its key path in [task]
    finer     as for `task_of`
    """
    if device.mechanism is None:
        return None
    count = given.get("count")  # of points or rings; for a box also a list, one of each axis; None: left out
    try:
        if "points_m" in given:
            return np.array([device.position(point) for point in given["points_m"]])
        if "box_m" in given:
            box = given["box_m"]
            each = [count] * len(box) if not isinstance(count, list) else count  # points along each axis
            if len(each) != len(box):
                faults.append((("count",), f"must be one number, or {len(box)} for the axes of box_m"))
                return None
            lines = [
                _coordinates_along(span, PER_AXIS if n is None else n, finer)
                for span, n in zip(box, each, strict=True)
            ]
            grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(box))
            return np.array([device.position(point) for point in grid.tolist()])
        if "radius_m" in given:
            rings = (RINGS if count is None else count) * finer
            center, radius = device.position(given["center_m"]), float(given["radius_m"])
            return center + radius * _round_points(rings, len(given["center_m"]) == 3)
        point = device.at(document.get("at"), assembly=document.get("assembly"))
    except DeviceError as error:
        key = next((key for key in SHAPES if key in given), "")
        faults.append(((key,) if key else (), error.faults[0].message))
        return None
    except (PostureError, MeasureError, ValueError) as error:
        faults.append(((), f"the reference cannot be had: {error}; give the shape, such as box_m"))
        return None
    return np.asarray(point.posture.position, dtype=np.float64)[None] if point.posture is not None else None


def _coordinates_along(span: Sequence[float], count: int, finer: int) -> Floats:
    """Coordinates (k,) along one axis of a box [m]; the middle alone where it has no extent, or for one point.

    finer  as for `task_of`
    """
    low, high = map(float, span)
    if low == high or count == 1:
        return np.array([0.5 * (low + high)])
    return np.linspace(low, high, (count - 1) * finer + 1)


def _round_points(rings: int, solid: bool) -> Floats:
    """Points (n, 3) of the unit disk, on rings round its centre with 6 points more on each, or of the unit ball,
    on shells; the outermost lie on its rim. Twice as many rings hold the points of the fewer; of shells only the
    centre and the points on the axes are held.

    rings  number of rings or shells
    solid  True: of the ball; False: of the disk, in the plane of the first two coordinates
    """
    points = [np.zeros((1, 3))]
    for k in range(1, rings + 1):
        if solid:
            # as the area of the shell grows; the ends of the axes belong to every shell
            points.append(k / rings * np.vstack([sphere(12 * k * k), np.eye(3), -np.eye(3)]))
            continue
        angle = 2.0 * np.pi * np.arange(6 * k) / (6 * k)
        points.append(k / rings * np.stack([np.cos(angle), np.sin(angle), np.zeros(6 * k)], axis=-1))
    return np.vstack(points)


def _directions(
    given: Mapping[str, Any], document: Mapping[str, Any], device: Device, faults: list[Fault], finer: int
) -> Floats | None:
    """Unit vectors (d, 3) along which walls are rendered; None: the device's own, or there are faults.

    given     the table [task]
    document  of the study
    faults    gets what is wrong with the directions, by its key path in [task]
    finer     so many times as many, where they are spread
    """
    wanted = given.get("directions")
    if device.mechanism is None or wanted is None:
        return None
    if isinstance(wanted, list):
        try:
            return np.array([device.direction(one) for one in wanted])
        except DeviceError as error:
            faults.append((("directions",), error.faults[0].message))
            return None
    if device.renders_moments(document.get("direction")):
        faults.append((("directions",), "are spread over ways, and this device renders moments; list them"))
        return None
    if "direction" in document:
        faults.append((("directions",), "and the study's direction exclude each other; remove one of them"))
        return None
    try:
        posture = device.at(document.get("at"), assembly=document.get("assembly")).posture
    except (PostureError, DeviceError, ValueError) as error:
        faults.append((("directions",), f"cannot be spread: {error}; list them"))
        return None
    assert posture is not None
    motions = handle_motions(posture)
    return _spread_directions(motions, device.direction(None), int(wanted) * finer)


def _spread_directions(motions: Floats, first: Floats, count: int) -> Floats:
    """Unit vectors (count, 3) spread over half a circle, or half a sphere: opposite directions have equal walls.
    Of a handle that moves along a line the one vector (1, 3), whatever the count.

    motions  (3, r)  orthonormal, the directions in which the handle can move
    first    (3,)    from whose part in the plane of motion they begin; in space they do not depend on it
    """
    along = motions @ (motions.T @ first)
    if not np.linalg.norm(along) > 0.0:
        along = motions[:, 0]
    along = along / np.linalg.norm(along)
    if motions.shape[1] == 1:
        return along[None]
    if motions.shape[1] == 2:
        across = np.cross(np.cross(motions[:, 0], motions[:, 1]), along)
        # the plane's two sides are alike: one of them, whatever the signs of its basis
        across = across * np.sign(across[np.argmax(np.abs(across))])
        angle = np.pi * np.arange(count) / count
        return np.asarray(np.cos(angle)[:, None] * along + np.sin(angle)[:, None] * across)
    return sphere(2 * count)[:count]  # the points of its upper half come first
