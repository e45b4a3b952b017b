"""Produced devices with answers in closed form: a free mass, sampled, with no delay."""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.device import Device, from_document
from zwidth.errors import DeviceError
from zwidth.study import question_of

PERIOD, MASS = 0.001, 0.1
STIFFEST = 4.0 * (3.0 - 2.0 * np.sqrt(2.0))  # K_max T^2 / m of a free mass, in closed form
FIVE_BAR = "five-bar"


def free_mass(**more: Any) -> Device:
    document = {"name": "free mass", "plant": {"mass_kg": MASS}, "loop": {"sampling_period_s": PERIOD}, **more}
    return from_document(document)


def uniform(plus_minus_percent: float) -> dict[str, Any]:
    return {"distribution": "uniform", "plus_minus_percent": plus_minus_percent}


def radius(mass: float, period: float, K: float, B: float) -> float:
    """Spectral radius of a free mass at a wall: 2 m z (z - 1)^2 + T^2 (z + 1) (K z + B (z - 1) / T) = 0."""
    T = period
    inertia = 2.0 * mass * np.polymul([1.0, 0.0], np.polymul([1.0, -1.0], [1.0, -1.0]))
    wall = T**2 * np.polymul([1.0, 1.0], [K + B / T, -B / T])
    return float(np.abs(np.roots(np.polyadd(inertia, wall))).max())


def least_mass(K: float, B: float, period: float = PERIOD) -> float:
    """The mass above which a wall is stable, by bisection on the roots."""
    low, high = 1e-4, 10.0
    for _ in range(80):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if radius(middle, period, K, B) < 1.0 else (middle, high)
    return float(high)


def tolerance_document(*tolerances: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"device": FIVE_BAR, "tolerance": list(tolerances), **more}


def tolerance_faults(document: dict[str, Any], **options: Any) -> list[str]:
    """All that is wrong, one line each, without the file's name."""
    try:
        question_of(document, "my.toml", **options)
    except DeviceError as error:
        return [str(fault).removeprefix("my.toml: ") for fault in error.faults]
    return []
