"""Forces, accelerations, position steps and friction along a direction, from the motors and encoders.

In the driven coordinates p with the handle's velocity v = J p', a force f at the handle is the torques J^T f of
the drives, in whatever posture, at rest, without gravity. Numbers of the drives are taken at the joint: a torque
limit is n tau, an encoder's step 2 pi/(N n), dry friction n C, with n motor turns per joint turn. A moment about
an axis takes the place of the force where a screw (..., 6) is given as direction, and a Jacobian of six rows.

All are invariant to the base frame (with the direction turned alike), the order of the drives and the ratio by
which a coordinate turns faster than another; lengths in other units give the same force, acceleration and step
in these.

Functions `..._at` are the catalogue's measures of an operating point. A number of a drive that the device file
leaves out is not guessed: a MeasureError names it.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.conditions.traits import ground_friction, reading_step
from zwidth.errors import MeasureError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import WantedWall, WantedWalls
from zwidth.measures.preconditions import numbers_of
from zwidth.model.effective_mass import screw, unit_directions

OFF: Final = (
    1e-6  # largest part of a unit direction outside the handle's motions; above it the handle cannot move along it
)


def force_along(jacobian: ArrayLike, direction: ArrayLike, torques: ArrayLike) -> Floats:
    """Largest force that the drives exert exactly along a direction, none across it.

        f = max { f : |J^T u f|_i <= t_i }  =  min_i t_i/|h_i|,    h = J^T u

    This is what a wall asks for: it pushes along its normal, and a force across it would be felt as friction. The
    largest component along u of any force is more (`force_component`).

    jacobian   (..., 3, d)  J [m/rad]
    direction  (..., 3)     u, unit vectors
    torques    (..., d)     t, each drive's limit at the joint [N m]; inf: none
    Returns    (...)        [N]; inf where no drive feels the direction: bearings, not drives, hold a force across
                            a mechanism's plane. nan where J is nan
    Raises     ValueError   if a direction is not of unit length

    >>> round(float(force_along([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [0.6, 0.8, 0.0], [1.0, 1.0])), 9)
    3.125
    """
    h, t = _torques_per_force(jacobian, direction), np.asarray(torques, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(h == 0.0, np.inf, t / np.abs(h))
    return np.asarray(each.min(axis=-1))


def force_component(jacobian: ArrayLike, direction: ArrayLike, torques: ArrayLike) -> Floats:
    """Largest component along a direction of all forces that the drives can exert, whatever they do across it.

        max { u^T f : |J^T f|_i <= t_i }  =  sum_i t_i |q_i|,    q = J^+ u

    q are the drives' rates when the handle moves along u with unit speed: every drive pushes at its limit. It
    is the support function of the polygon (zonotope) of forces, of which `force_along` is the radius: never less
    than that, and equal where the corner that lies farthest along u lies on u itself.

    jacobian   (..., 3, d)  J [m/rad], of rank d: no more drives than directions to move in
    direction  (..., 3)     u, unit vectors
    torques    (..., d)     t, each drive's limit at the joint [N m]
    Returns    (...)        [N]; inf where the handle cannot move along u, since bearings then bear any force; nan
                            where J is nan
    Raises     ValueError   if a direction is not of unit length

    >>> round(float(force_component([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [0.6, 0.8, 0.0], [1.0, 1.0])), 9)
    5.0
    """
    q, moves = joint_rates(jacobian, direction)
    t = np.asarray(torques, dtype=np.float64)
    return np.asarray(np.where(moves | np.isnan(q[..., 0]), _sum_by_rates(t, q), np.inf))


def acceleration_along(
    jacobian: ArrayLike, mass_matrix: ArrayLike, direction: ArrayLike, torques: ArrayLike
) -> Floats:
    """Largest acceleration of the handle exactly along a direction, from rest, without gravity or friction.

        a = min_i t_i/|M q|_i,    q = J^+ u:   p'' = q a takes the torques M q a

    The drives are taken as rigid: behind a flexible one the rotor starts first, and the handle later. Large
    accelerations make collisions sharp (Lawrence and Chapel 1994; second-hand).

    jacobian     (..., 3, d)  J [m/rad], of rank d
    mass_matrix  (..., d, d)  M in the same coordinates, links and rotors [kg m²]
    direction    (..., 3)     u, unit vectors
    torques      (..., d)     t, each drive's limit at the joint [N m]; inf: none
    Returns      (...)        [m/s²]; 0 where the handle cannot move along u, nan where J or M is nan
    Raises       ValueError   if a direction is not of unit length

    >>> J, M = [[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [[0.04, 0.0], [0.0, 0.02]]
    >>> round(float(acceleration_along(J, M, [0.0, 1.0, 0.0], [1.0, 1.0])), 9)
    10.0
    """
    q, moves = joint_rates(jacobian, direction)
    torques_needed = (np.asarray(mass_matrix, dtype=np.float64) @ q[..., None])[..., 0]
    t = np.asarray(torques, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(torques_needed == 0.0, np.inf, t / np.abs(torques_needed))
    return np.asarray(np.where(moves | np.isnan(q[..., 0]), each.min(axis=-1), 0.0))


def resolution_along(jacobian: ArrayLike, direction: ArrayLike, steps: ArrayLike) -> Floats:
    """Step of the handle's reading along a direction when all encoders step at once.

        sum_i |u^T J_i| dp_i

    which is the most that they can do together; a single encoder steps by its own summand.

    jacobian   (..., 3, d)  J [m/rad]
    direction  (..., 3)     u, unit vectors
    steps      (..., d)     dp, each encoder's step in the driven coordinates [rad]
    Returns    (...)        [m]; 0 across a mechanism's plane, nan where J is nan
    Raises     ValueError   if a direction is not of unit length

    >>> round(float(resolution_along([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [0.6, 0.8, 0.0], [1e-3, 1e-3])), 9)
    0.00044
    """
    return _sum_by_rates(np.asarray(steps, dtype=np.float64), _torques_per_force(jacobian, direction))


def friction_along(jacobian: ArrayLike, direction: ArrayLike, frictions: ArrayLike) -> Floats:
    """Dry friction felt along a direction by a hand that moves the handle slowly exactly along it.

        sum_i C_i |q_i|,    q = J^+ u

    the work per metre: every drive turns by q_i and takes C_i |q_i|. The force across the direction that keeps the
    hand on it does no work. The conditions of `zwidth.conditions` ask for the work along the motion
    that a force makes by itself, M^-1 J^T u, which goes astray and may take less
    (`friction_and_resolution.ground_friction`).

    jacobian   (..., 3, d)  J [m/rad], of rank d
    direction  (..., 3)     u, unit vectors
    frictions  (..., d)     C, each drive's at the joint [N m]
    Returns    (...)        [N]; nan where the handle cannot move along u, or J is nan
    Raises     ValueError   if a direction is not of unit length

    >>> round(float(friction_along([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [0.6, 0.8, 0.0], [0.1, 0.1])), 9)
    0.5
    """
    q, moves = joint_rates(jacobian, direction)
    return np.asarray(np.where(moves, _sum_by_rates(np.asarray(frictions, dtype=np.float64), q), np.nan))


def heat_along(jacobian: ArrayLike, direction: ArrayLike, force: ArrayLike, motor_constants: ArrayLike) -> Floats:
    """Heat in the windings while the drives hold a force exactly along a direction, at rest.

        P = sum_i (F h_i / c_i)^2,    h = J^T u,   c_i = n_i k_i / sqrt(R_i)

    With c the motor constant at the joint: a torque t takes the current t/(n k), which heats by R times its
    square. R is that of the winding as warm as it then is.

    jacobian   (..., 3, d)  J [m/rad]
    direction  (..., 3)     u, unit vectors
    force      (...)        F [N]
    motor_constants  (..., d)  c [N m/sqrt(W)], of each drive at its joint
    Returns    (...)        [W]; 0 across a mechanism's plane, where bearings hold the force; nan where J is nan
    Raises     ValueError   if a direction is not of unit length

    >>> J, c = [[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [0.1, 0.2]
    >>> round(float(heat_along(J, [0.0, 1.0, 0.0], 2.0, c)), 9)
    64.0
    """
    h = _torques_per_force(jacobian, direction)
    torques = np.asarray(force, dtype=np.float64)[..., None] * h
    return np.asarray(np.sum((torques / np.asarray(motor_constants, dtype=np.float64)) ** 2, axis=-1))


def joint_rates(jacobian: ArrayLike, direction: ArrayLike) -> tuple[Floats, Flags]:
    """Rates q = J^+ u of the drives when the handle moves along u with unit speed, and whether it can.

    jacobian   (..., 3, d)  J [m/rad], of rank d
    direction  (..., 3)     u, unit vectors
    Returns    (..., d)     [rad/m], nan where J is nan
               (...)        False where more than a millionth of u is left over, |u - J q| > 1e-6, or J is nan
    Raises     ValueError   if a direction is not of unit length

    >>> joint_rates([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [0.0, 1.0, 0.0])[0].round(9) + 0.0
    array([2.5, 0. ])
    """
    J, u = np.asarray(jacobian, dtype=np.float64), _directions(direction)
    unknown: Flags = np.asarray(np.isnan(J).any(axis=(-2, -1)))
    known = np.where(unknown[..., None, None], 0.0, J)
    q = (np.linalg.pinv(known) @ u[..., None])[..., 0]
    residual = np.linalg.norm(u - (known @ q[..., None])[..., 0], axis=-1)
    return np.where(unknown[..., None], np.nan, q), np.asarray((residual <= OFF) & ~unknown)


def _torques_per_force(jacobian: ArrayLike, direction: ArrayLike) -> Floats:
    """Drive torques per force along a direction, h = J^T u (..., d) [N m/N]."""
    J, u = np.asarray(jacobian, dtype=np.float64), _directions(direction)
    return np.asarray(np.einsum("...i,...id->...d", u, J))


def _directions(direction: ArrayLike) -> Floats:
    """Unit vectors (..., 3), checked; or screws (..., 6), with a Jacobian of six rows."""
    return screw(direction) if np.shape(direction)[-1:] == (6,) else unit_directions(direction)


def _sum_by_rates(each: Floats, rates: Floats) -> Floats:
    """Sum (...) of each drive's number (..., d) times |rate| (..., d); inf times 0 is 0: no motion, no work."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(rates == 0.0, 0.0, each * np.abs(rates)).sum(axis=-1))


def peak_force_at(point: OperatingPoint) -> Floats:
    """Largest force exactly along the rendered direction within the torque limits [N]."""
    return force_along(_jacobian(point), point.direction, _joint_torques(point, "torque_limit_Nm"))


def continuous_force_at(point: OperatingPoint) -> Floats:
    """Largest force exactly along the rendered direction within the continuous torques [N]."""
    return force_along(_jacobian(point), point.direction, _joint_torques(point, "continuous_torque_Nm"))


def acceleration_max_at(point: OperatingPoint) -> Floats:
    """Largest acceleration exactly along the rendered direction, from rest, within the torque limits [m/s²].

    Drives count as rigid.
    """
    torques = _joint_torques(point, "torque_limit_Nm")
    return acceleration_along(_jacobian(point), point.whole_mass_matrix, point.direction, torques)


def position_resolution_at(point: OperatingPoint) -> Floats:
    """Step of the reading along the rendered direction when all encoders step; for a [plant] its sensor's [m]."""
    if point.given_plant is not None:
        return _check_nonzero(
            reading_step(point.given_plant), "needs the step of the encoder; give loop.encoder.resolution_m"
        )
    counts = _check_finite(point, "encoder_counts_per_rev", point.drives.encoder_counts)
    return resolution_along(_jacobian(point), point.direction, 2.0 * np.pi / (counts * point.drives.transmission))


def friction_force_at(point: OperatingPoint) -> Floats:
    """Dry friction of all drives felt along the rendered direction; for a [plant] where the wall acts [N]."""
    if point.given_plant is not None:
        return _check_nonzero(ground_friction(point.given_plant), "needs dry friction; give friction.coulomb_N")
    dry = point.drives.nonlinearity
    if dry is None or not np.any(dry.coulomb > 0.0):
        raise MeasureError(
            f"needs dry friction; give {_drive_key(point, 0, 'coulomb_Nm')}, or that of another drive"
        )
    return friction_along(_jacobian(point), point.direction, point.drives.transmission * dry.coulomb)


def motor_heat_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> Floats:
    """Heat in all windings while the drives hold the wanted force along the rendered direction [W]."""
    jacobian, drives = _jacobian(point), point.drives
    (force,) = numbers_of(wanted, point.shape, "a force to be held", "force")
    constant = _check_finite(point, "torque_constant_Nm_per_A", drives.torque_constant)
    known = drives.winding_resistance
    missing = np.full(len(drives.names), np.nan)
    resistance = _check_finite(point, "winding_resistance_ohm", missing if known is None else known)
    return heat_along(jacobian, point.direction, force, drives.transmission * constant / np.sqrt(resistance))


def _jacobian(point: OperatingPoint) -> Floats:
    """J (..., 3, d) of the drives, or with the angular one (..., 6, d) where a screw is rendered.

    Raises  MeasureError  where drives are not coordinates of their own
    """
    coordinates = point.jacobian.shape[-1]
    if point.drive_side.motion.shape[-2:] != (coordinates, coordinates):
        raise MeasureError("needs as many drives as degrees of freedom, and no free joints")
    if point.direction.shape[-1] == 3 or point.posture is None:
        return point.jacobian
    return np.concatenate([point.jacobian, point.posture.angular_jacobian], axis=-2)


def _joint_torques(point: OperatingPoint, key: str) -> Floats:
    """The drives' torques of this key, at the joints (..., d) [N m]. Raises MeasureError where one is left out."""
    drives = point.drives
    limits = drives.torque_limit if key == "torque_limit_Nm" else drives.continuous_torque
    known = np.full(len(drives.names), np.nan) if limits is None else limits
    return np.asarray(drives.transmission * _check_finite(point, key, known))


def _check_finite(point: OperatingPoint, key: str, values: Floats) -> Floats:
    """The drives' values (..., d) of this key. Raises MeasureError where one is not finite, as if left out."""
    missing = ~np.isfinite(values)
    if missing.any():
        first = int(np.argwhere(missing)[0][-1])
        raise MeasureError(f"needs a finite {key} of every drive; give {_drive_key(point, first, key)}")
    return values


def _check_nonzero(value: float, otherwise: str) -> Floats:
    """A number of a [plant], as an array. Raises MeasureError saying `otherwise` where it is 0, left out."""
    if value == 0.0:
        raise MeasureError(otherwise)
    return np.asarray(value)


def _drive_key(point: OperatingPoint, drive: int, key: str) -> str:
    """Key in the device file of a number of a drive, given by its index."""
    return f"mechanism.drives.{point.drives.names[drive]}.{key}"
