"""Positions and directions as users give them, checked: arrays in metres, joint angles, vectors of any length."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan, pi
from numbers import Real
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.build import roll_pitch_yaw
from zwidth.device.faults import fail, quote
from zwidth.model.mechanism import Mechanism

UNIT: Final = 4.0 * np.finfo(float).eps  # from 1, that the length of a unit vector may be by rounding


def vectors(label: str, name: str, value: Any) -> Floats:
    """Vectors (..., 2) or (..., 3) of finite numbers.

    label, name  of the device and the argument, for messages
    Raises  DeviceError  for anything else
    """
    try:
        given = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise fail(label, name, f"must be 2 or 3 numbers, got {quote(value)}") from None
    if given.ndim == 0:
        raise fail(label, name, f"must be 2 or 3 numbers, got {quote(value)}")
    if given.shape[-1] not in (2, 3):
        raise fail(label, name, f"must be 2 or 3 numbers x, y or x, y, z, got {given.shape[-1]}")
    if not np.isfinite(given).all():
        raise fail(label, name, f"must be finite, got {quote(given.tolist())}")
    return given


def positions(label: str, value: Any, height: float) -> Floats:
    """Positions (..., 3) [m]; those of two numbers lie at a height. Raises DeviceError as `vectors`."""
    given = vectors(label, "at", value)
    return given if given.shape[-1] == 3 else _completed(given, height)


def unit_vectors(label: str, name: str, value: Any) -> Floats:
    """Unit vectors (..., 3) along vectors of any length; those of two numbers lie in the x-y plane.

    Raises  DeviceError  as `vectors`, and for a vector of no length
    """
    given = vectors(label, name, value)
    given = given if given.shape[-1] == 3 else _completed(given, 0.0)
    largest = np.abs(given).max(axis=-1, keepdims=True, initial=0.0)
    if not largest.all():
        raise fail(label, name, "has zero length; give any vector along it, such as 0,1")
    scaled = given / largest  # so that the squares neither overflow nor vanish
    length = largest * np.linalg.norm(scaled, axis=-1, keepdims=True)
    # what is a unit vector already stays as it is, to the last digit
    units = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    return np.where(np.abs(length - 1.0) <= UNIT, given, units)


def screws(label: str, direction: Any, axis: Any, length: Any) -> Floats:
    """Screws (..., 6) of a motion about an axis, and along a direction at once: [u, L w]/sqrt(|u|^2 + |w|^2).

    direction  (..., 2) or (..., 3) u; None: a turn alone, [0, w/|w|]
    axis       (..., 3) w;   length  L by which angles count as ways [m]; None without a direction
    Raises     DeviceError  for vectors without length, and a length that is missing, beside nothing or not
               positive
    """
    w = vectors(label, "axis", axis)
    w = w if w.shape[-1] == 3 else _completed(w, 0.0)
    if direction is None:
        if length is not None:
            raise fail(label, "characteristic_length", "is of a direction and an axis together; leave it out")
        return np.concatenate([np.zeros_like(w), unit_vectors(label, "axis", w)], axis=-1)
    u = vectors(label, "direction", direction)
    u = u if u.shape[-1] == 3 else _completed(u, 0.0)
    unit_vectors(label, "axis", w), unit_vectors(label, "direction", u)  # which refuse vectors without length
    L = float(length) if isinstance(length, Real) else nan
    if not 0.0 < L < inf:
        raise fail(label, "characteristic_length", f"must be a positive length in metres, got {quote(length)}")
    both = np.concatenate(np.broadcast_arrays(u, w), axis=-1)
    return np.asarray(both / np.linalg.norm(both, axis=-1, keepdims=True) * np.repeat([1.0, L], 3))


def rotations(label: str, orientation: Any) -> Floats:
    """Rotation matrices (..., 3, 3) of roll, pitch, yaw (..., 3) [rad], or such matrices themselves.

    Raises  DeviceError  for anything else
    """
    try:
        given = np.asarray(orientation, dtype=np.float64)
    except (TypeError, ValueError):
        raise fail(label, "orientation", f"must be roll, pitch, yaw in rad, got {quote(orientation)}") from None
    if given.shape[-2:] == (3, 3):
        if np.allclose(given @ np.swapaxes(given, -1, -2), np.eye(3), atol=1e-9):
            return given
        raise fail(label, "orientation", "must be rotation matrices, and some rows are not at right angles")
    if given.ndim == 0 or given.shape[-1] != 3 or not np.isfinite(given).all():
        raise fail(label, "orientation", f"must be roll, pitch, yaw in rad, got {quote(orientation)}")
    if np.abs(given).max() > 2.0 * pi:
        message = f"must be angles from -2 pi to 2 pi rad, got {quote(given.tolist())}; are they in degrees?"
        raise fail(label, "orientation", message)
    return roll_pitch_yaw(given)


def joint_angles(label: str, mechanism: Mechanism, at: Mapping[str, float]) -> dict[str, float]:
    """Angles of all driven joints by the names of their links [rad].

    Raises  DeviceError  for other joints than the driven ones, and for a value that is not an angle
    """
    driven = [mechanism.links.names[joint] for joint in mechanism.drives.joint]
    if set(at) != set(driven):
        message = f"must be the angle of every driven joint, {', '.join(driven)}, got {', '.join(map(str, at))}"
        raise fail(label, "at", message)
    angles = {}
    for joint, value in at.items():
        angle = float(value) if isinstance(value, Real) else nan
        if not abs(angle) <= 2.0 * pi:
            message = f"{joint}: must be an angle from -2 pi to 2 pi rad, got {quote(value)}; is it in degrees?"
            raise fail(label, "at", message)
        angles[joint] = angle
    return angles


def _completed(given: Floats, third: float) -> Floats:
    return np.concatenate([given, np.full((*given.shape[:-1], 1), third)], axis=-1)
