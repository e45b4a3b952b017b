"""Surfaces in the workspace: how deep a point is behind them, and which way out is.

A depth is positive inside the wall and negative in free space; the normal points out of the wall, so that the
wall pushes along it. Every depth here changes by at most what the point moves by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean

NONE: Final = 0
PLANE: Final = 1
BALL: Final = 2
BALL_HOLLOW: Final = 3
BOX: Final = 4
BOX_HOLLOW: Final = 5
ORTHONORMAL: Final = 1e-9
# Places in a packed surface: its kind, whether a plane acts on both sides, and a point of it or its center (3).
# Behind these (from SIZES on): a plane's normal (3); a ball's radius; half sizes of a box (3), from AXES on its
# axes, one after the other (9).
KIND, TWO_SIDED, POINT, SIZES, AXES, NUMBERS = 0, 1, 2, 5, 8, 17


@dataclass(frozen=True)
class Plane:
    """A wall behind a plane.

    point      (2,) or (3,)  any point of the plane [m]
    normal     (2,) or (3,)  out of the wall, towards free space; any length
    two_sided  True: the wall holds the handle on the plane from both sides
    """

    point: Sequence[float]
    normal: Sequence[float]
    two_sided: bool = False


@dataclass(frozen=True)
class Sphere:
    """A ball that keeps the handle out, or a hollow one that keeps it in.

    center   (2,) or (3,) [m];   radius [m];   hollow: the wall is outside, free space inside
    """

    center: Sequence[float]
    radius: float
    hollow: bool = False


@dataclass(frozen=True)
class Box:
    """A box that keeps the handle out, or a hollow one that keeps it in.

    center      (2,) or (3,) [m]
    half_sizes  (2,) or (3,) [m], inf allowed; with two the box has no end along z
    axes        (3, 3)  the box's axes as columns; None: those of the base frame
    hollow      the wall is outside, free space inside
    """

    center: Sequence[float]
    half_sizes: Sequence[float]
    axes: Floats | None = None
    hollow: bool = False


Surface = Plane | Sphere | Box


def surface_document(surface: Surface, two_sided: bool) -> dict[str, Any]:
    """A surface by keys and units; two_sided: whether what is rendered at a plane acts on both sides."""
    match surface:
        case Plane():
            return {"kind": "plane", "point_m": surface.point, "normal": surface.normal, "two_sided": two_sided}
        case Sphere():
            kind: dict[str, Any] = {"kind": "sphere", "center_m": surface.center, "radius_m": surface.radius}
        case Box():
            kind = {"kind": "box", "center_m": surface.center, "half_sizes_m": surface.half_sizes}
            kind |= {} if surface.axes is None else {"axes": surface.axes}
    return kind | {"hollow": surface.hollow}


def packed(surface: Surface | None) -> Floats:
    """The surface as numbers for the kernels, (17,), see KIND to AXES.

    Raises  ValueError  for numbers that describe no surface
    """
    numbers = np.zeros(NUMBERS)
    match surface:
        case None:
            numbers[KIND] = NONE
        case Plane():
            normal = _vector("the plane's normal", surface.normal)
            length = float(np.linalg.norm(normal))
            if not length > 0.0:
                raise ValueError("the plane's normal has no length; give the direction out of the wall")
            numbers[KIND], numbers[TWO_SIDED] = PLANE, float(surface.two_sided)
            numbers[POINT:SIZES] = _vector("the plane's point", surface.point)
            numbers[SIZES:AXES] = normal / length
        case Sphere():
            if not (np.isfinite(surface.radius) and surface.radius > 0.0):
                raise ValueError(f"the sphere's radius must be positive [m], got {surface.radius}")
            numbers[KIND] = BALL_HOLLOW if surface.hollow else BALL
            numbers[POINT:SIZES], numbers[SIZES] = _vector("the sphere's center", surface.center), surface.radius
        case Box():
            numbers[KIND] = BOX_HOLLOW if surface.hollow else BOX
            numbers[POINT:SIZES] = _vector("the box's center", surface.center)
            # of two sizes the third is inf
            half = np.array([*surface.half_sizes, np.inf][:3], dtype=np.float64)
            if half.shape != (3,) or not np.all(half > 0.0):
                raise ValueError(f"the box's half_sizes must be two or three positive lengths [m], got {half}")
            axes = np.eye(3) if surface.axes is None else np.asarray(surface.axes, dtype=np.float64)
            if axes.shape != (3, 3) or not np.allclose(axes.T @ axes, np.eye(3), rtol=0.0, atol=ORTHONORMAL):
                raise ValueError("the box's axes must be a (3, 3) rotation matrix, its axes as columns")
            numbers[SIZES:AXES], numbers[AXES:] = half, axes.T.ravel()
    return numbers


def depth_and_normal(surface: Surface, position: Sequence[float] | Floats) -> tuple[Floats, Floats]:
    """Depths (...) [m] and normals (..., 3) out of the wall at positions (..., 2) or (..., 3).

        plane   (point - x) . normal
        ball    radius - |x - center|, along x - center; hollow: the negative of both
        box     outside it minus the distance to it, inside it the way to the nearest face; hollow: the negative

    At a ball's very center no way out is nearest: the normal is zero there.

    >>> depth, normal = depth_and_normal(Sphere((0.0, 0.2), 0.05), (0.0, 0.24))
    >>> print(round(float(depth), 12), normal)
    0.01 [0. 1. 0.]
    """
    x = np.asarray(position, dtype=np.float64)
    if x.ndim == 0 or x.shape[-1] not in (2, 3):
        raise ValueError(f"a position has two or three coordinates [m], got an array of shape {x.shape}")
    flat = np.zeros((int(np.prod(x.shape[:-1])), 3))
    flat[:, : x.shape[-1]] = x.reshape(len(flat), x.shape[-1])
    depth, normal = np.empty(len(flat)), np.empty((len(flat), 3))
    _depths(packed(surface), flat, depth, normal)
    return depth.reshape(x.shape[:-1]), normal.reshape((*x.shape[:-1], 3))


# fills in depths (k,) [m] and normals (k, 3) at positions (k, 3) [m]
@compiled
def _depths(surface: Floats, position: Floats, depth: Floats, normal: Floats) -> None:
    for i in range(depth.size):
        found = penetration(surface, position[i, 0], position[i, 1], position[i, 2])
        depth[i], normal[i, 0], normal[i, 1], normal[i, 2] = found


@compiled_lean
def penetration(surface: Floats, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Depth [m] of one point, and the normal's x, y and z there, for a surface as `packed` gives it.

    Depth -inf for no surface, the normal then and at a ball's center 0.
    """
    kind = surface[KIND]
    dx, dy, dz = x - surface[POINT], y - surface[POINT + 1], z - surface[POINT + 2]
    if kind == PLANE:
        nx, ny, nz = surface[SIZES], surface[SIZES + 1], surface[SIZES + 2]
        return -(dx * nx + dy * ny + dz * nz), nx, ny, nz
    if kind in (BALL, BALL_HOLLOW):
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        sign = 1.0 if kind == BALL else -1.0
        scale = sign / length if length > 0.0 else 0.0
        return sign * (surface[SIZES] - length), scale * dx, scale * dy, scale * dz
    if kind in (BOX, BOX_HOLLOW):
        depth, nx, ny, nz = _depth_in_box(surface, dx, dy, dz)
        return (depth, nx, ny, nz) if kind == BOX else (-depth, -nx, -ny, -nz)
    return -np.inf, 0.0, 0.0, 0.0


@compiled_lean
def _depth_in_box(surface: Floats, dx: float, dy: float, dz: float) -> tuple[float, float, float, float]:
    """Depth in a solid box [m] and x, y, z of the unit vector out, of a point (dx, dy, dz) [m] from its center."""
    nearest, face, side, squared = -np.inf, 0, 1.0, 0.0
    nx, ny, nz = 0.0, 0.0, 0.0
    for i in range(3):
        ax, ay, az = surface[AXES + 3 * i], surface[AXES + 1 + 3 * i], surface[AXES + 2 + 3 * i]
        along = dx * ax + dy * ay + dz * az
        over = abs(along) - surface[SIZES + i]  # beyond the face, negative inside
        sign = 1.0 if along >= 0.0 else -1.0
        if over > nearest:
            nearest, face, side = over, i, sign
        # outside, every axis along which the point is beyond adds to the way to the box's nearest point
        if over > 0.0:
            squared += over * over
            nx, ny, nz = nx + sign * over * ax, ny + sign * over * ay, nz + sign * over * az
    if squared > 0.0:
        distance = np.sqrt(squared)
        return -distance, nx / distance, ny / distance, nz / distance
    i = AXES + 3 * face
    return -nearest, side * surface[i], side * surface[i + 1], side * surface[i + 2]


def _vector(what: str, value: Sequence[float] | Floats) -> Floats:
    """Vector (3,) from two or three coordinates, the third then 0. Raises ValueError about `what` for others."""
    given = np.asarray(value, dtype=np.float64)
    if given.shape not in ((2,), (3,)) or not np.all(np.isfinite(given)):
        raise ValueError(f"{what} must be two or three finite numbers, got {np.asarray(value).tolist()}")
    return np.append(given, np.zeros(3 - given.size))
