"""Dry friction and encoder step along the wall's direction, one number each, for the published conditions."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant


def ground_friction(plant: Plant) -> float:
    """f_c: energy that dry friction takes per metre at the actuator, sum_i C_i |along_i . x| [N].

    x is the free motion that a force at the actuator makes, of one metre there; without a free motion, where a
    spring ties the plant to the ground, the motion that a force begins with, M^-1 a/(a^T M^-1 a). For one
    coordinate that is driven directly it is C.

    Returns  0 without dry friction

    >>> from zwidth.model.nonlinear import Friction, Nonlinear
    >>> one = np.ones(1)
    >>> rubbing = Nonlinear(friction=(Friction(one, 0.2),))
    >>> ground_friction(Plant(np.array([[0.1]]), *np.zeros((2, 1, 1)), one, one, nonlinear=rubbing))
    0.2
    """
    frictions = plant.nonlinear.friction
    if not frictions:
        return 0.0
    motion = _motion(plant)
    return float(sum(part.coulomb * abs(part.along @ motion) for part in frictions))


def reading_step(plant: Plant) -> float:
    """Delta: step of the reading when all encoders step at once, sum_i |weight_i| step_i [m].

    Of a mechanism's motors that is sum_i |u^T J_i| dtheta_i, which varies with direction and posture.

    Returns  0 for encoders without quantisation
    """
    return float(sum(abs(part.weight) * part.step for part in plant.nonlinear.counters))


def reading_noise(plant: Plant) -> float:
    """Standard deviation of the reading's noise from all encoders, sqrt(sum_i (weight_i noise_i)^2) [m]."""
    return float(np.sqrt(sum((part.weight * part.noise) ** 2 for part in plant.nonlinear.counters)))


def _motion(plant: Plant) -> Floats:
    """x of `ground_friction`, one number for each coordinate, with a.x = 1 m at the actuator."""
    a = plant.actuator
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0]
    free_motion = free @ (free.T @ a)
    acceleration = np.linalg.solve(plant.mass, a)
    motion = free_motion if a @ free_motion > 1e-12 * (a @ acceleration) else acceleration
    return np.asarray(motion / (a @ motion))
