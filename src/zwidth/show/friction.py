"""The dry friction and the encoder's step that published conditions are told of a device."""

from __future__ import annotations

from math import nan
from typing import TypedDict

from zwidth.conditions.dry import ground_friction, reading_step
from zwidth.loop.operating_point import OperatingPoint


class Dry(TypedDict):
    """Arguments of `conditions.compare`."""

    coulomb_friction: float
    resolution: float


def told_of(point: OperatingPoint) -> Dry:
    """Both numbers of a device's plant; nan where its file does not tell."""
    plant = point.plant
    return {
        "coulomb_friction": ground_friction(plant) if point.friction_known else nan,
        "resolution": reading_step(plant) if point.resolution_known else nan,
    }
