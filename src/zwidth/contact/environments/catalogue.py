"""The environments of this package by name."""

from __future__ import annotations

from typing import Final

from zwidth.contact.environments.coupled_wall import coupled_wall
from zwidth.contact.environments.environment import Environment
from zwidth.contact.environments.friction_patch import friction_patch
from zwidth.contact.environments.grating import grating
from zwidth.contact.environments.hunt_crossley import hunt_crossley
from zwidth.contact.environments.nonlinear_wall import nonlinear_wall
from zwidth.contact.environments.one_sided_wall import one_sided_wall
from zwidth.contact.environments.pressed_wall import pressed_wall
from zwidth.contact.environments.slot import slot
from zwidth.contact.environments.texture import texture
from zwidth.contact.environments.virtual_mass import virtual_mass
from zwidth.contact.environments.wall import wall

ENVIRONMENTS: Final[dict[str, Environment]] = {
    each.function.__name__: each
    for each in (
        wall,
        one_sided_wall,
        pressed_wall,
        slot,
        nonlinear_wall,
        hunt_crossley,
        coupled_wall,
        friction_patch,
        texture,
        grating,
        virtual_mass,
    )
}

__all__ = [
    "ENVIRONMENTS",
    "coupled_wall",
    "friction_patch",
    "grating",
    "hunt_crossley",
    "nonlinear_wall",
    "one_sided_wall",
    "pressed_wall",
    "slot",
    "texture",
    "virtual_mass",
    "wall",
]
