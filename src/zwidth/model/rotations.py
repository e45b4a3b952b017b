"""Rotations as vectors v = angle * unit axis and as matrices Exp(v), compiled and as arrays.

    Exp(v) = 1 + A [v]x + B [v]x^2,   A = sin t / t,  B = (1 - cos t) / t^2,  t = |v|            (Rodrigues 1840)

The vector of a matrix is read off its unit quaternion, which is exact to rounding at every angle, half a turn
included; Exp's derivative there does not matter to Newton's method, whose step it is only at convergence.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled_lean

ROUNDING: Final = 1e-15  # of angles that a conversion leaves


def rotation_vector(rotation: Floats) -> Floats:
    """The vector v of rotation matrices (..., 3, 3), at most half a turn long, (..., 3) [rad].

    >>> rotation_vector(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])).round(6).tolist()
    [0.0, 0.0, 1.570796]
    """
    from scipy.spatial.transform import Rotation

    flat = np.asarray(rotation, dtype=np.float64).reshape(-1, 3, 3)
    return np.asarray(Rotation.from_matrix(flat).as_rotvec().reshape(rotation.shape[:-1]))


def rotation_matrix(vector: Floats) -> Floats:
    """Exp(v) of vectors (..., 3) [rad], (..., 3, 3)."""
    v = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    cross = np.zeros((*v.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    cross = cross - np.swapaxes(cross, -1, -2)
    # sinc(x) is sin(pi x)/(pi x), 1 at 0
    A, B = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + A * cross + B * (cross @ cross))


def roll_pitch_yaw_of(turn: Floats) -> Floats:
    """Roll, pitch, yaw [rad] with Rz(yaw) Ry(pitch) Rx(roll) = turn.

    Each angle is read off what the ones before it leave, so that nothing is lost where the pitch is a quarter turn
    and the other two are about one axis.
    """
    across = float(np.hypot(turn[0, 0], turn[1, 0]))
    yaw = float(np.arctan2(turn[1, 0], turn[0, 0])) if across > ROUNDING else 0.0
    pitch = float(np.arctan2(-turn[2, 0], across))
    c, s = np.cos(yaw), np.sin(yaw)
    # second row of Rz(-yaw) turn = Ry(pitch) Rx(roll): (0, cos roll, -sin roll)
    rolled = c * turn[1] - s * turn[0]
    roll = float(np.arctan2(-rolled[2], rolled[1]))
    angles = np.array([roll, pitch, yaw])
    angles[np.abs(angles) < ROUNDING] = 0.0
    return angles


@compiled_lean
def fill_rotation(x: float, y: float, z: float, out: Floats) -> None:
    """Exp(v) of the vector x, y, z [rad] into out (3, 3)."""
    square = x * x + y * y + z * z
    if square < 1e-8:  # the next terms of both series are beyond the last digit
        A, B = 1.0 - square / 6.0 * (1.0 - square / 20.0), 0.5 - square / 24.0
    else:
        angle = sqrt(square)
        half = sin(0.5 * angle)
        A, B = sin(angle) / angle, 2.0 * half * half / square
    out[0, 0], out[1, 1], out[2, 2] = (
        1.0 - B * (y * y + z * z),
        1.0 - B * (x * x + z * z),
        1.0 - B * (x * x + y * y),
    )
    out[0, 1], out[1, 0] = B * x * y - A * z, B * x * y + A * z
    out[0, 2], out[2, 0] = B * x * z + A * y, B * x * z - A * y
    out[1, 2], out[2, 1] = B * y * z - A * x, B * y * z + A * x


@compiled_lean
def turned_further(v: tuple[float, float, float], turn: tuple[float, float, float]) -> tuple[float, float, float]:
    """The vector of Exp(v) Exp(turn): a link at v, turned about its own axes."""
    a, ax, ay, az = _quaternion(v)
    b, bx, by, bz = _quaternion(turn)
    return _vector_of_quaternion(
        a * b - ax * bx - ay * by - az * bz,
        a * bx + b * ax + ay * bz - az * by,
        a * by + b * ay + az * bx - ax * bz,
        a * bz + b * az + ax * by - ay * bx,
    )


@compiled_lean
def _quaternion(v: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """Unit quaternion w, x, y, z of a rotation vector [rad]."""
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    angle = sqrt(square)
    # sin(angle / 2) / angle, by its series where the angle is small
    share = 0.5 - square / 48.0 if angle < 1e-4 else sin(0.5 * angle) / angle
    return cos(0.5 * angle), share * v[0], share * v[1], share * v[2]


@compiled_lean
def _vector_of_quaternion(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Rotation vector [rad] of a unit quaternion w, x, y, z; of its two signs the one with the smaller turn."""
    length = sqrt(x * x + y * y + z * z)
    share = 2.0 / w if length == 0.0 else 2.0 * atan2(length, abs(w)) / length * (1.0 if w >= 0.0 else -1.0)
    return share * x, share * y, share * z


@compiled_lean
def vector_between(A: Floats, B: Floats) -> tuple[float, float, float]:
    """The vector, in the base frame, of the rotation B A^T that takes axes A (3, 3) to axes B."""
    r00 = B[0, 0] * A[0, 0] + B[0, 1] * A[0, 1] + B[0, 2] * A[0, 2]
    r11 = B[1, 0] * A[1, 0] + B[1, 1] * A[1, 1] + B[1, 2] * A[1, 2]
    r22 = B[2, 0] * A[2, 0] + B[2, 1] * A[2, 1] + B[2, 2] * A[2, 2]
    r01 = B[0, 0] * A[1, 0] + B[0, 1] * A[1, 1] + B[0, 2] * A[1, 2]
    r10 = B[1, 0] * A[0, 0] + B[1, 1] * A[0, 1] + B[1, 2] * A[0, 2]
    r02 = B[0, 0] * A[2, 0] + B[0, 1] * A[2, 1] + B[0, 2] * A[2, 2]
    r20 = B[2, 0] * A[0, 0] + B[2, 1] * A[0, 1] + B[2, 2] * A[0, 2]
    r12 = B[1, 0] * A[2, 0] + B[1, 1] * A[2, 1] + B[1, 2] * A[2, 2]
    r21 = B[2, 0] * A[1, 0] + B[2, 1] * A[1, 1] + B[2, 2] * A[1, 2]
    # the largest of the four squares 4 q^2 is taken, so that nothing is divided by what is nearly 0 (Shepperd
    # 1978)
    w, x, y, z = 1.0 + r00 + r11 + r22, 1.0 + r00 - r11 - r22, 1.0 - r00 + r11 - r22, 1.0 - r00 - r11 + r22
    if w >= x and w >= y and w >= z:
        x, y, z = r21 - r12, r02 - r20, r10 - r01
    elif x >= y and x >= z:
        w, y, z = r21 - r12, r01 + r10, r02 + r20
    elif y >= z:
        w, x, z = r02 - r20, r01 + r10, r12 + r21
    else:
        w, x, y = r10 - r01, r02 + r20, r12 + r21
    over = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return _vector_of_quaternion(over * w, over * x, over * y, over * z)


@compiled_lean
def vector_between_axes(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> tuple[float, float, float]:
    """The vector of the smallest rotation that takes the unit vector a to b; of opposite ones, about any axis
    across."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    sine, cosine = sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if sine > 0.0:
        share = atan2(sine, cosine) / sine
        return share * x, share * y, share * z
    if cosine > 0.0:
        return 0.0, 0.0, 0.0
    # opposite axes: any vector across a, made of its larger components
    if abs(a[0]) < 0.6:
        y, z = a[2], -a[1]
    else:
        x, y = -a[1], a[0]
    share = np.pi / sqrt(x * x + y * y + z * z)
    return share * x, share * y, share * z
