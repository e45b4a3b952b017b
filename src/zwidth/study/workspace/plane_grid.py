"""A grid of positions on a plane of the workspace, at which maps and studies compute measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.errors import Advice, WorkspaceError
from zwidth.model.argument_checks import check_kind
from zwidth.model.mechanism import ORIENTATION, Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.posture import reachable_positions
from zwidth.model.posture_batch import Shell, shells

AXES: Final = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
LONG_SIDE: Final = 81  # points along the longer side, by default
MOST: Final = 10**8  # points
FLAT: Final = 1e-9  # of the spread of reached positions: a thickness below this share counts as flat
PARALLEL: Final = 1e-6  # sine of an angle; two axes with a smaller one count as parallel
BETWEEN: Final = 0.08  # share of the extent by which the reachable set may go beyond the known positions
ROUND: Final = 20  # ranges are rounded outwards to a power of ten over this
DIGITS: Final = 14  # significant digits of coordinates, counted from the largest


@dataclass(frozen=True)
class PlaneGrid:
    """A grid of positions on a plane.

    A position's coordinates are its components along the axes: on xy they are the base frame's own x and y.

    first, second  (3,)   orthonormal axes
    through        (3,)   the plane's point with coordinates (0, 0) [m]
    x, y           (nx,), (ny,)  coordinates of the grid's lines, ascending [m]
    names          names of the axes: such as "x" and "z"; "u" and "v" where they are not along the base frame
    """

    first: Floats
    second: Floats
    through: Floats
    x: Floats
    y: Floats
    names: tuple[str, str]

    @property
    def shape(self) -> tuple[int, int]:
        """(ny, nx): rows are lines of equal y."""
        return len(self.y), len(self.x)

    @property
    def normal(self) -> Floats:
        """Unit vector (3,) out of the plane."""
        return np.cross(self.first, self.second)

    @property
    def positions(self) -> Floats:
        """Positions (ny, nx, 3) of the grid's points [m]."""
        return np.asarray(self.through + self.x[None, :, None] * self.first + self.y[:, None, None] * self.second)

    def coordinates(self, positions: Floats) -> Floats:
        """Coordinates (..., 2) of positions (..., 3), seen along the normal [m]."""
        return np.stack([positions @ self.first, positions @ self.second], axis=-1)


def plane_of(
    device: Device,
    axes: str | Sequence[float] | None = None,
    through: Sequence[float] | None = None,
    x: Sequence[float] | None = None,
    y: Sequence[float] | None = None,
    cells: Sequence[int] | None = None,
    assembly: str | None = None,
) -> PlaneGrid:
    """A plane of a device's workspace, with a grid.

    axes      "xy", "xz", "yz", or six numbers: two vectors in it, of which the second is made orthogonal to the
              first; left out: the plane that the handle cannot leave, or xy
    through   a point of it, x, y or x, y, z [m]; left out: the device's reference position
    x, y      lowest and highest coordinate along both axes [m]; left out: the file's workspace, or a box around
              what is reached, its ends rounded outwards
    cells     points along both; left out: 81 along the longer side, as many to the metre along the other
    Raises    WorkspaceError  for drives that control the orientation, one drive, parallel axes, an empty range,
                              fewer than two points, a plane that the reachable set meets in a line or not at all
              DeviceError     for a device without a mechanism, or a point that is not a position
              PostureError    where the assembly is singular throughout, or does not close
    """
    check_kind("device", device, Device)
    point = device.position(through)
    mechanism = device.mechanism
    assert mechanism is not None
    if mechanism.controls == ORIENTATION:
        raise WorkspaceError(
            "the drives control the orientation of the handle, and a map needs a handle that they move; ask for "
            "single orientations, or sweep a study"
        )
    reach = reachable_set(mechanism, assembly or device.reference_assembly)
    if len(mechanism.drives.names) < 2:
        raise WorkspaceError(
            "the handle has one drive and moves along a curve; a map needs a device with two drives"
        )
    reach_normal = _reach_normal(reach.positions)
    first, second, names = _plane_axes(axes, reach_normal)
    _check_intersection(np.cross(first, second), point, reach_normal, reach)
    sides = (("x", x, first), ("y", y, second))
    ranges = [_range_along(name, given, axis, mechanism.workspace, reach) for name, given, axis in sides]
    nx, ny = _point_counts(cells, ranges)
    normal = np.cross(first, second)
    return PlaneGrid(
        first,
        second,
        (point @ normal) * normal,  # of the plane the point nearest to the base frame's origin
        _line_coordinates(*ranges[0], nx),
        _line_coordinates(*ranges[1], ny),
        names,
    )


@dataclass(frozen=True)
class ReachableSet:
    """The set of positions that a handle reaches, known by samples and by bounds from the links' lengths.

    positions  (K, 3)  reachable positions spread over the set, some way inside its edge [m]
    shells     spherical shells, one for each chain of links, that contain the set
    """

    positions: Floats
    shells: tuple[Shell, ...]

    def extent(self, axis: Floats) -> tuple[float, float]:
        """Lowest and highest coordinate [m] along a unit vector (3,) of a slightly larger set than is reached."""
        along = self.positions @ axis
        low, high = float(along.min()), float(along.max())
        margin = BETWEEN * (high - low)
        # no farther than every shell allows, but for what is known to be reached
        allowed = [(float(shell.centre @ axis), float(shell.most)) for shell in self.shells]
        return (
            max([low - margin, *(min(low, centre - most) for centre, most in allowed)]),
            min([high + margin, *(max(high, centre + most) for centre, most in allowed)]),
        )

    def __str__(self) -> str:
        boxed = zip("xyz", (self.extent(axis) for axis in np.eye(3)), strict=True)
        return ", ".join(
            f"{axis} from {a:.4g} to {b:.4g} m" if b - a > FLAT else f"{axis} = {_coordinate_text(a)} m"
            for axis, (a, b) in boxed
        )


def reachable_set(mechanism: Mechanism, assembly: str | None) -> ReachableSet:
    """Positions that an assembly reaches. Raises PostureError if it is singular everywhere, or does not close."""
    return ReachableSet(reachable_positions(mechanism, assembly), tuple(shells(pack(mechanism), 0)))


def _coordinate_text(value: float) -> str:
    """A coordinate as text, of 4 digits, without a rounding error beside 0."""
    return f"{round(value, 9) + 0.0:.4g}"


def _reach_normal(reach: Floats) -> Floats | None:
    """Normal (3,) of the plane that all positions `reach` (K, 3) lie in; None if they lie in none."""
    _, spread, axes = np.linalg.svd(reach - reach.mean(axis=0), full_matrices=False)
    if len(spread) < 3 or spread[2] > FLAT * spread[0]:
        return None
    return np.asarray(axes[2])


def _plane_axes(
    requested_axes: str | Sequence[float] | None, reach_normal: Floats | None
) -> tuple[Floats, Floats, tuple[str, str]]:
    """Unit vectors (3,) of the plane's axes, and their names. Raises WorkspaceError for requested axes that are
    neither a plane's name nor six finite numbers, or that are parallel or of length 0.

    requested_axes  as for `plane_of`; None: axes of the base frame in the plane that the handle keeps, or others
    reach_normal    (3,)  of that plane; None where the handle keeps none
    """
    unit = np.eye(3)
    if requested_axes is None:
        for name, (a, b) in AXES.items():
            if (
                reach_normal is None
                or np.linalg.norm(np.cross(np.cross(unit[a], unit[b]), reach_normal)) < PARALLEL
            ):
                return unit[a], unit[b], (name[0], name[1])
        assert reach_normal is not None
        # the first axis: the base axis at the smallest angle to the plane, projected into it
        along = unit[int(np.argmin(np.abs(reach_normal)))]
        first = along - (along @ reach_normal) * reach_normal
        first /= np.linalg.norm(first)
        return first, np.cross(reach_normal, first), ("u", "v")
    if isinstance(requested_axes, str):
        if requested_axes not in AXES:
            raise WorkspaceError(f"the plane must be xy, xz, yz or six numbers, got '{requested_axes}'")
        a, b = AXES[requested_axes]
        return unit[a], unit[b], (requested_axes[0], requested_axes[1])
    vectors = np.asarray(requested_axes, dtype=np.float64)
    if vectors.shape != (6,) or not np.isfinite(vectors).all():
        raise WorkspaceError(
            f"the plane's axes must be six finite numbers, two vectors, got {list(requested_axes)}"
        )
    return *_orthonormal(vectors[:3], vectors[3:]), ("u", "v")


def _orthonormal(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Unit vectors (3,) along a (3,), and across it towards b (3,). Raises WorkspaceError for a zero or parallel
    vector."""
    # over the largest component, as squares of very large or small ones leave the range of floating-point numbers
    lengths = [float(np.linalg.norm(v / (np.abs(v).max() or 1.0))) for v in (a, b)]
    if not all(lengths):
        raise WorkspaceError(
            f"an axis of the plane has length 0: {_vector_text(a)} and {_vector_text(b)}; give two vectors that "
            "are not zero"
        )
    first, other = (v / np.abs(v).max() / length for v, length in zip((a, b), lengths, strict=True))
    second = other - (first @ other) * first
    across = float(np.linalg.norm(second))
    if across < PARALLEL:
        raise WorkspaceError(
            f"the plane's axes {_vector_text(a)} and {_vector_text(b)} are parallel; give two that are not"
        )
    return first, second / across


def _vector_text(v: Floats) -> str:
    """A vector as text with its components in brackets, of 6 digits each."""
    return "(" + ", ".join(f"{c:.6g}" for c in v) + ")"


def _check_intersection(normal: Floats, point: Floats, reach_normal: Floats | None, reach: ReachableSet) -> None:
    """Raise WorkspaceError where a handle that cannot leave its own plane meets the requested one in a line or
    nowhere.

    normal, point  (3,)  of the requested plane; the point [m]
    reach_normal   (3,)  normal of the handle's own plane; None where it can leave every plane
    reach          what the handle reaches
    """
    if reach_normal is None:
        return
    known, k = reach.positions, int(np.argmax(np.abs(reach_normal)))
    # a cosine, to the square of the sine PARALLEL
    aligned = bool(abs(reach_normal[k]) > 1.0 - PARALLEL**2)  # whether the handle's plane lies across base axis k
    plane = next((n for n, axes in AXES.items() if aligned and k not in axes), "")
    where = (
        f"the plane {'xyz'[k]} = {_coordinate_text(known[0, k])} m"
        if aligned
        else f"the plane across {_vector_text(reach_normal)}"
    )
    if np.linalg.norm(np.cross(normal, reach_normal)) > PARALLEL:
        advice = Advice("ask for {}", "axes", plane) if plane else Advice("leave {} out", "axes")
        raise WorkspaceError(f"the handle cannot leave {where}, and meets the requested plane in a line", advice)
    off = float(abs((point - known[0]) @ reach_normal))
    if off > FLAT * float(np.ptp(known, axis=0).max()):
        raise WorkspaceError(
            f"the handle cannot leave {where}, and the requested plane lies {off:.4g} m beside it; it reaches "
            f"{reach}"
        )


def _range_along(
    name: str, given: Sequence[float] | None, axis: Floats, bounds: Floats, reach: ReachableSet
) -> tuple[float, float]:
    """Lowest and highest coordinate along a plane's axis (3,) [m]: as given, of the file, or of what is reached.
    Raises WorkspaceError for a given range that is empty or not finite.

    name    of the axis, for messages
    given   the range that was asked for; None: none
    bounds  (3, 2)  of the file's workspace along the base frame's axes [m]; nan where it gives none
    """
    if given is not None:
        low, high = (float(value) for value in given)
        if not (np.isfinite([low, high]).all() and low < high):
            raise WorkspaceError(
                f"the range along {name} must be LOW,HIGH with LOW < HIGH, got {low:.6g},{high:.6g}"
            )
        return low, high
    if np.isnan(bounds[axis != 0.0]).any():
        return rounded_outwards(*reach.extent(axis))
    # lowest and highest coordinate of a box: of each side of it the end that lies farther that way
    ends = np.where(axis[:, None] != 0.0, axis[:, None] * bounds, 0.0)
    return float(ends.min(axis=1).sum()), float(ends.max(axis=1).sum())


def rounded_outwards(low: float, high: float) -> tuple[float, float]:
    """Widen a range to multiples of a twentieth of the power of ten below its length, such as -0.35 to 0.35.

    >>> rounded_outwards(-0.3459, 0.35)
    (-0.35, 0.35)
    """
    if not high > low:
        return low, high
    power = floor(log10(high - low))
    per_metre = ROUND * 10.0**-power  # we divide by it: multiplying by its inverse would round the decimals
    # within 1e-6 of a multiple an end stays there
    return floor(low * per_metre + 1e-6) / per_metre, ceil(high * per_metre - 1e-6) / per_metre


def _point_counts(cells: Sequence[int] | None, ranges: Sequence[tuple[float, float]]) -> tuple[int, int]:
    """Numbers of points along both axes, from `cells` of `plane_of` and the ranges [m]. Raises WorkspaceError for
    too few or too many."""
    if cells is None:
        lengths = [high - low for low, high in ranges]
        if not min(lengths) > 0.0:
            flat = "the reachable positions have no extent along an axis"
            raise WorkspaceError(flat, Advice("give its range and {}", "cells"))
        nx, ny = (max(2, round((LONG_SIDE - 1) * length / max(lengths)) + 1) for length in lengths)
        return nx, ny
    nx, ny = (int(count) for count in cells)
    if min(nx, ny) < 2:
        raise WorkspaceError(f"a map needs at least 2 points along each axis, got {nx},{ny}")
    if nx * ny > MOST:
        raise WorkspaceError(f"a map has at most {MOST:.0e} points, got {nx} x {ny}")
    return nx, ny


def _line_coordinates(low: float, high: float, count: int) -> Floats:
    """`count` equidistant coordinates [m], symmetric about 0 if the ends are, rounded to short decimals.

    >>> _line_coordinates(-0.3, 0.3, 9).tolist()
    [-0.3, -0.225, -0.15, -0.075, 0.0, 0.075, 0.15, 0.225, 0.3]
    """
    k = np.arange(count)
    x = (low * k[::-1] + high * k) / (count - 1)
    size = max(abs(low), abs(high))
    # the short decimal, where it is the coordinate to rounding
    decimal = np.round(x, DIGITS - 1 - floor(log10(size)))
    return np.asarray(np.where(np.abs(decimal - x) <= 2.0 * np.spacing(size), decimal, x))
