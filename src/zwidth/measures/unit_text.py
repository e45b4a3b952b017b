"""Units as texts and figures write them; about an axis newtons become newton metres and metres radians."""

from __future__ import annotations

from typing import Final

_WRITTEN: Final = (
    ("^1", ""),
    ("^2", "²"),
    ("^3", "³"),
    (" s", "s"),
    ("N ms", "Nms"),  # or it reads as a newton millisecond
    ("N² m²s", "N²m²s"),
)


def unit_text(unit: str) -> str:
    """A measure's unit with powers raised, and products without a blank before s.

    >>> unit_text("N^2 s/m^2"), unit_text("N m s/rad"), unit_text("kg m^2")
    ('N²s/m²', 'Nms/rad', 'kg m²')
    """
    for old, new in _WRITTEN:
        unit = unit.replace(old, new)
    return unit


UNITS: Final = {
    "N/m": "Nm/rad",
    "Ns/m": "Nms/rad",
    "N s/m": "N m s/rad",
    "kg": "kg m^2",
    "m": "rad",
    "N": "Nm",
    "m/s": "rad/s",
    "m/s^2": "rad/s^2",
    "m/s²": "rad/s²",
    "N²s/m²": "N²m²s/rad²",
    "N^2 s/m^2": "N^2 m^2 s/rad^2",
    "m/N": "rad/Nm",
}
"""Unit of a force along a direction -> that of a moment about an axis."""


def unit_of_moments(unit: str) -> str:
    """The unit of a moment, an angle or an inertia where that of a force, a way or a mass is given; others stay.

    >>> unit_of_moments("N/m"), unit_of_moments("Hz")
    ('Nm/rad', 'Hz')
    """
    return UNITS.get(unit, unit)
