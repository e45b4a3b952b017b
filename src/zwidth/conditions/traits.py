"""Traits: the properties of a loop that the published conditions use, computed from its plant and controller.

Dry friction and encoder step along the wall's direction, one number each, for the published conditions.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite, isnan, nan

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.controller import FirstOrder
from zwidth.loop.loop import Loop
from zwidth.model.modes import clusters, repeat_tolerance, undamped_modes
from zwidth.model.plant import LaggedDamper, Plant
from zwidth.model.reduction import plant_effective_parameters

# Modes with a smaller share of the response to the wall's force count as modes that no wall moves.
UNSEEN = 1e-9
# Damping below this share of the largest in the plant is rounding of 0.
UNDAMPED = 1e-12


@dataclass(frozen=True)
class Traits:
    """Properties of a loop for the published conditions; nan for a number that the plant does not have.

    rigid_mass                1/(a^T Z (Z^T M Z)^-1 Z^T a), Z the free motions and a the actuator [kg]
    ground_damping            x^T B x of the free motion x that one metre at the actuator makes: friction against
                              the ground [N s/m]
    side_mass                 the mass that (4.43) means: of a plant that the wall moves as one mass on a grounded
                              spring that mass, else the motor side's, 1/(a^T M^-1 a) with two sides [kg]
    side_stiffness            the spring of that mass, else the effective stiffness between actuator and handle
                              [N/m]
    mode_mass                 of a plant that the wall moves as one mass, on at most one spring and one damper to
                              the ground,
    mode_damping              its mass, friction and spring [kg], [N s/m], [N/m]
    mode_stiffness
    electrical_damping        b_e of all lagged dampers b_e/(1 + s L/R) on the free motion, added [N s/m]
    corner_frequencies        the corner frequencies R/L of the lagged dampers that brake what the wall moves
                              [rad/s]
    free                      the wall moves only free motion: one rigid mass, tied to nothing
    sprung                    the wall moves only one motion, of one frequency, on springs to the ground
    undamped                  no viscous damping acts on what the wall moves
    collocated                the wall acts where the encoder reads
    uses_backward_difference  the velocity is estimated by the backward difference, whatever filter follows
    has_first_order_filter    a first-order filter follows
    force_filtered            the force is filtered in the computer
    actuator_lags             the actuator follows with a time constant
    """

    rigid_mass: float
    ground_damping: float
    side_mass: float
    side_stiffness: float
    mode_mass: float
    mode_damping: float
    mode_stiffness: float
    electrical_damping: float
    corner_frequencies: tuple[float, ...]
    free: bool
    sprung: bool
    undamped: bool
    collocated: bool
    uses_backward_difference: bool
    has_first_order_filter: bool
    force_filtered: bool
    actuator_lags: bool

    @property
    def has_one_mode(self) -> bool:
        """Whether the wall moves one mass only, on at most one spring and one damper to the ground."""
        return not isnan(self.mode_mass)


def traits(loop: Loop) -> Traits:
    """The properties of a loop that decide which conditions apply to it; under load those without it."""
    plant = loop.plant.without_load or loop.plant  # of a load no published condition knows
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    push, read = shapes.T @ plant.actuator, shapes.T @ plant.sensor
    moved_modes = _moved_modes(squared, push, read)
    moved_squared = [float(np.mean(squared[run])) for run in moved_modes]
    single = len(moved_squared) == 1 and _is_uncoupled(plant, shapes, moved_modes[0], push)
    sprung = single and moved_squared[0] > 0.0
    mass, drag, electrical = _numbers_of_free_motion(plant, squared, shapes)
    corners = tuple(1.0 / d.time_constant for d in plant.lagged_dampers if _damper_acts(d, shapes, moved_modes))
    mode_mass, mode_drag, mode_stiffness = (
        _numbers_of_mode(plant, shapes, moved_modes[0], push, moved_squared[0]) if single else 3 * (nan,)
    )
    if sprung:
        side_mass, side_stiffness = mode_mass, mode_stiffness
    else:
        numbers = plant_effective_parameters(plant)
        side_mass, side_stiffness = float(numbers.motor_side_mass), float(numbers.stiffness)
    return Traits(
        rigid_mass=mass,
        ground_damping=drag,
        side_mass=side_mass,
        side_stiffness=side_stiffness,
        mode_mass=mode_mass,
        mode_damping=mode_drag,
        mode_stiffness=mode_stiffness,
        electrical_damping=electrical,
        corner_frequencies=corners,
        free=single and moved_squared == [0.0],
        sprung=sprung,
        undamped=not _is_damped(plant, shapes, moved_modes),
        collocated=bool(
            np.allclose(plant.actuator, plant.sensor, rtol=0.0, atol=1e-9 * np.max(np.abs(plant.sensor)))
        ),
        uses_backward_difference=_uses_backward_difference(loop),
        has_first_order_filter=isinstance(loop.controller.velocity_filter, FirstOrder),
        force_filtered=loop.controller.force_filter is not None,
        actuator_lags=loop.controller.actuator_time_constant > 0.0,
    )


def _moved_modes(squared: Floats, push: Floats, read: Floats) -> list[slice]:
    """Groups of modes of equal frequency that the wall moves and the encoder reads, as slices of the modes.

    squared     (n,)  squared natural frequencies [rad²/s²]
    push, read  (n,)  modal parts of the actuator's force and of the reading
    """
    whole = float(np.linalg.norm(push) * np.linalg.norm(read))
    runs = clusters(squared, repeat_tolerance(squared))
    return [run for run in runs if abs(push[run] @ read[run]) > UNSEEN * whole]


def _is_uncoupled(plant: Plant, shapes: Floats, run: slice, push: Floats) -> bool:
    """Whether the motion that the wall makes in one group of modes stays in it, damping included.

    shapes, run  (n, n)  mode shapes, one a column, and the columns of the group
    push         (n,)    modal parts of the actuator's force
    """
    motion = np.zeros(len(push))
    motion[run] = push[run]
    modal = shapes.T @ plant.damping @ shapes
    force = modal @ motion  # of the damping: it must be along the motion itself
    along = motion * (force @ motion) / (motion @ motion)
    scale = np.abs(modal) @ np.abs(motion)
    return bool(np.all(np.abs(force - along) <= 1e-9 * np.max(scale, initial=0.0)))


def _numbers_of_mode(
    plant: Plant, shapes: Floats, run: slice, push: Floats, squared: float
) -> tuple[float, float, float]:
    """Mass [kg], friction [N s/m] and spring [N/m] of the one motion that the wall makes, 1 m at the actuator.

    shapes, run, push  as of `_is_uncoupled`
    squared            its squared natural frequency [rad²/s²]
    """
    mass = 1.0 / float(push[run] @ push[run])
    motion = mass * (shapes[:, run] @ push[run])
    inside = float(np.abs(motion) @ np.abs(plant.damping) @ np.abs(motion))
    drag = float(motion @ plant.damping @ motion)
    return mass, drag if drag > UNDAMPED * inside else 0.0, mass * squared


def _is_damped(plant: Plant, shapes: Floats, moved_modes: list[slice]) -> bool:
    """Whether damping acts on a motion that the wall makes, directly or through another motion."""
    modal = np.abs(shapes.T @ plant.damping @ shapes)  # of each pair of modes
    worst = max((float(np.max(modal[run])) for run in moved_modes), default=0.0)
    return worst > UNDAMPED * float(np.max(modal))


def _damper_acts(damper: LaggedDamper, shapes: Floats, moved_modes: list[slice]) -> bool:
    """Whether a lagged damper acts on a motion that the wall makes."""
    reach = np.abs(damper.along @ shapes)
    worst = max((float(np.max(reach[run])) for run in moved_modes), default=0.0)
    return damper.damping > 0.0 and worst > UNSEEN * float(np.max(reach))


def _uses_backward_difference(loop: Loop) -> bool:
    """Whether the velocity before its filter is the backward difference, under any name."""
    T = loop.period
    z = np.exp(1j * np.linspace(0.1, np.pi, 7))
    plain = Loop(loop.plant, replace(loop.controller, velocity_filter=None)).velocity_response(z)
    return bool(np.allclose(plain, (1.0 - 1.0 / z) / T, rtol=1e-9, atol=0.0))


def _numbers_of_free_motion(plant: Plant, squared: Floats, shapes: Floats) -> tuple[float, float, float]:
    """Mass [kg], friction against the ground and electrical damping [N s/m] of the free motion at the actuator.

    squared, shapes  (n,) squared natural frequencies, (n, n) mode shapes
    Returns          three nan where there is no free motion; the last nan without electrical damping
    """
    mass = nan
    with suppress(ValueError):
        mass = float(plant_effective_parameters(plant).rigid_mass)
    if not isfinite(mass):
        return nan, nan, nan
    Z = shapes[:, squared == 0.0]
    motion = mass * (Z @ (Z.T @ plant.actuator))
    inside = float(np.abs(motion) @ np.abs(plant.damping) @ np.abs(motion))
    drag = float(motion @ plant.damping @ motion)
    electrical = sum(d.damping * float(d.along @ motion) ** 2 for d in plant.lagged_dampers)
    return mass, drag if drag > UNDAMPED * inside else 0.0, electrical if plant.lagged_dampers else nan


def ground_friction(plant: Plant) -> float:
    """f_c: energy that dry friction takes per metre at the actuator, sum_i C_i |along_i . x| [N].

    x is the free motion that a force at the actuator makes, of one metre there; without a free motion, where a
    spring ties the plant to the ground, the motion that a force begins with, M^-1 a/(a^T M^-1 a). For one
    coordinate that is driven directly it is C.

    Returns  0 without dry friction

    >>> from zwidth.model.plant import Friction, Nonlinear
    >>> one = np.ones(1)
    >>> rubbing = Nonlinear(friction=(Friction(one, 0.2),))
    >>> ground_friction(Plant(np.array([[0.1]]), *np.zeros((2, 1, 1)), one, one, nonlinear=rubbing))
    0.2
    """
    frictions = plant.nonlinear.friction
    if not frictions:
        return 0.0
    motion = _motion_of_one_metre(plant)
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


def _motion_of_one_metre(plant: Plant) -> Floats:
    """x of `ground_friction`, one number for each coordinate, with a.x = 1 m at the actuator."""
    a = plant.actuator
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0]
    free_motion = free @ (free.T @ a)
    acceleration = np.linalg.solve(plant.mass, a)  # with which a force begins
    motion = free_motion if a @ free_motion > 1e-12 * (a @ acceleration) else acceleration
    return np.asarray(motion / (a @ motion))
