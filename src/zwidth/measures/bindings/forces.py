"""The catalogue's measures of motors and encoders at operating points: formulas are in `measures.forces`.

A number of a drive that the device file leaves out is not guessed: a MeasureError names it.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.conditions.friction_and_resolution import ground_friction, reading_step
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures import forces
from zwidth.measures.bindings.preconditions import numbers_of
from zwidth.measures.definition import MeasureError, WantedWall, WantedWalls


def peak_force(point: OperatingPoint) -> Floats:
    """Largest force exactly along the rendered direction within the torque limits [N]."""
    return forces.force_along(_jacobian(point), point.direction, _torques(point, "torque_limit_Nm"))


def continuous_force(point: OperatingPoint) -> Floats:
    """Largest force exactly along the rendered direction within the continuous torques [N]."""
    return forces.force_along(_jacobian(point), point.direction, _torques(point, "continuous_torque_Nm"))


def acceleration_max(point: OperatingPoint) -> Floats:
    """Largest acceleration exactly along the rendered direction, from rest, within the torque limits [m/s^2].

    Drives count as rigid.
    """
    torques = _torques(point, "torque_limit_Nm")
    return forces.acceleration_along(_jacobian(point), point.whole_mass_matrix, point.direction, torques)


def position_resolution(point: OperatingPoint) -> Floats:
    """Step of the reading along the rendered direction when all encoders step; for a [plant] its sensor's [m]."""
    if point.given_plant is not None:
        return _require_nonzero(
            reading_step(point.given_plant), "needs the step of the encoder; give loop.encoder.resolution_m"
        )
    counts = _require_finite(point, "encoder_counts_per_rev", point.drives.encoder_counts)
    return forces.resolution_along(
        _jacobian(point), point.direction, 2.0 * np.pi / (counts * point.drives.transmission)
    )


def friction_force(point: OperatingPoint) -> Floats:
    """Dry friction of all drives felt along the rendered direction; for a [plant] where the wall acts [N]."""
    if point.given_plant is not None:
        return _require_nonzero(ground_friction(point.given_plant), "needs dry friction; give friction.coulomb_N")
    dry = point.drives.nonlinearity
    if dry is None or not np.any(dry.coulomb > 0.0):
        raise MeasureError(f"needs dry friction; give {_key(point, 0, 'coulomb_Nm')}, or that of another drive")
    return forces.friction_along(_jacobian(point), point.direction, point.drives.transmission * dry.coulomb)


def motor_heat(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> Floats:
    """Heat in all windings while the drives hold the wanted force along the rendered direction [W]."""
    jacobian, drives = _jacobian(point), point.drives
    (force,) = numbers_of(wanted, point.shape, "a force to be held", "force")
    constant = _require_finite(point, "torque_constant_Nm_per_A", drives.torque_constant)
    known = drives.winding_resistance
    missing = np.full(len(drives.names), np.nan)
    resistance = _require_finite(point, "winding_resistance_ohm", missing if known is None else known)
    return forces.heat_along(
        jacobian, point.direction, force, drives.transmission * constant / np.sqrt(resistance)
    )


def _jacobian(point: OperatingPoint) -> Floats:
    """J (..., 3, d) of the drives, or with the angular one (..., 6, d) where a screw is rendered.

    Raises  MeasureError  where drives are not coordinates of their own
    """
    side = point.drive_side
    if side.motion.shape[-2:] != (side.driven, point.jacobian.shape[-1]):
        raise MeasureError("needs as many drives as degrees of freedom, and no free joints")
    if point.direction.shape[-1] == 3 or point.posture is None:
        return point.jacobian
    return np.concatenate([point.jacobian, point.posture.angular_jacobian], axis=-2)


def _torques(point: OperatingPoint, key: str) -> Floats:
    """Torques at the joints (..., d) [N m]. Raises MeasureError where the file leaves one out."""
    drives = point.drives
    limits = drives.torque_limit if key == "torque_limit_Nm" else drives.continuous_torque
    known = np.full(len(drives.names), np.nan) if limits is None else limits
    return np.asarray(drives.transmission * _require_finite(point, key, known))


def _require_finite(point: OperatingPoint, key: str, values: Floats) -> Floats:
    missing = ~np.isfinite(values)
    if missing.any():
        first = int(np.argwhere(missing)[0][-1])
        raise MeasureError(f"needs a finite {key} of every drive; give {_key(point, first, key)}")
    return values


def _require_nonzero(value: float, otherwise: str) -> Floats:
    """A number of a [plant]. Raises MeasureError where it is 0, as it is if the file leaves it out."""
    if value == 0.0:
        raise MeasureError(otherwise)
    return np.asarray(value)


def _key(point: OperatingPoint, drive: int, key: str) -> str:
    return f"mechanism.drives.{point.drives.names[drive]}.{key}"
