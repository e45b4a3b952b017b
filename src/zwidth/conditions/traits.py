"""What the published conditions ask of a device, measured on its plant."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from zwidth.loop.loop import Loop
from zwidth.model.modes import REPEATED, clusters, undamped_modes
from zwidth.model.plant import Floats, Plant
from zwidth.model.reduction import plant_effective_parameters

# A motion whose share in the wall's compliance is less is one that no wall moves.
UNSEEN = 1e-9
# Damping below this share of the largest in the plant is rounding.
UNDAMPED = 1e-12


@dataclass(frozen=True)
class Traits:
    """A loop in the words of the published conditions; a number that the plant does not have is nan.

    rigid_mass     1/(a^T Z (Z^T M Z)^-1 Z^T a), Z the free motions and a the actuator [kg]
    drag           x^T B x of the free motion x that one metre at the actuator makes: friction against the
                   ground [N s/m]
    side_mass      the mass that (4.43) means: of a plant that the wall moves as one mass on a grounded spring
                   that mass, else the motor side's, 1/(a^T M^-1 a) with two sides [kg]
    side_stiffness the spring of that mass, else the effective stiffness between actuator and handle [N/m]
    free           the wall moves only free motion: one rigid mass, tied to nothing
    sprung         the wall moves only one motion, of one frequency, on springs to the ground
    undamped       no damping acts on what the wall moves
    collocated     the wall acts where the encoder reads
    """

    rigid_mass: float
    drag: float
    side_mass: float
    side_stiffness: float
    free: bool
    sprung: bool
    undamped: bool
    collocated: bool


def traits(loop: Loop) -> Traits:
    """Measure a loop's plant; see `Traits`."""
    plant = loop.plant
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    push, read = shapes.T @ plant.actuator, shapes.T @ plant.sensor
    moved = _moved(squared, push, read)
    rates = [float(np.mean(squared[run])) for run in moved]
    sprung = len(rates) == 1 and rates[0] > 0.0
    mass, drag = _free_motion(plant, squared, shapes)
    if sprung:
        side_mass = 1.0 / float(push[moved[0]] @ push[moved[0]])
        side_stiffness = side_mass * rates[0]
    else:
        numbers = plant_effective_parameters(plant)
        side_mass, side_stiffness = float(numbers.motor_side_mass), float(numbers.stiffness)
    return Traits(
        rigid_mass=mass,
        drag=drag,
        side_mass=side_mass,
        side_stiffness=side_stiffness,
        free=rates == [0.0],
        sprung=sprung,
        undamped=not _is_damped(plant, shapes, moved),
        collocated=bool(
            np.allclose(plant.actuator, plant.sensor, rtol=0.0, atol=1e-9 * np.max(np.abs(plant.sensor)))
        ),
    )


def _moved(squared: Floats, push: Floats, read: Floats) -> list[slice]:
    """Groups of equal frequency that the wall moves and the encoder sees."""
    scale = max(float(np.max(np.abs(squared))), np.finfo(float).tiny)
    whole = float(np.linalg.norm(push) * np.linalg.norm(read))
    return [run for run in clusters(squared, REPEATED * scale) if abs(push[run] @ read[run]) > UNSEEN * whole]


def _is_damped(plant: Plant, shapes: Floats, moved: list[slice]) -> bool:
    """Does damping act on a motion that the wall moves, by itself or through another?"""
    modal = np.abs(shapes.T @ plant.damping @ shapes)
    worst = max((float(np.max(modal[run])) for run in moved), default=0.0)
    return worst > UNDAMPED * float(np.max(modal))


def _free_motion(plant: Plant, squared: Floats, shapes: Floats) -> tuple[float, float]:
    """Mass and friction against the ground of the free motion at the actuator; nan where there is none."""
    mass = float("nan")
    with suppress(ValueError):
        mass = float(plant_effective_parameters(plant).rigid_mass)
    if not np.isfinite(mass):
        return mass, float("nan")
    Z = shapes[:, squared == 0.0]
    motion = mass * (Z @ (Z.T @ plant.actuator))
    inside = float(np.abs(motion) @ np.abs(plant.damping) @ np.abs(motion))
    drag = float(motion @ plant.damping @ motion)
    return mass, drag if drag > UNDAMPED * inside else 0.0
