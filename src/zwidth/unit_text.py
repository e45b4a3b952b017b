"""Units as texts, figures and pages write them; about an axis newtons become newton metres and metres radians.

In data (`unit` of JSON, schema and measures) powers are typed, kg m^2; texts raise them, kg m². A product has a
blank, N m and N s.
"""

from __future__ import annotations

from typing import Final

_WRITTEN: Final = (
    ("^1", ""),
    ("^2", "²"),
    ("^3", "³"),
    ("/Nm", "/(N m)"),
    ("Nms", "N m s"),
    ("Nm", "N m"),
    ("Ns", "N s"),
)


def unit_text(unit: str) -> str:
    """A unit of data as people read it: powers raised, products with a blank.

    >>> unit_text("N^2 s/m^2"), unit_text("Nm/rad"), unit_text("kg m^2"), unit_text("rad/Nm")
    ('N² s/m²', 'N m/rad', 'kg m²', 'rad/(N m)')
    """
    for old, new in _WRITTEN:
        unit = unit.replace(old, new)
    return unit


UNITS: Final = {
    "N/m": "Nm/rad",
    "N s/m": "N m s/rad",
    "kg": "kg m^2",
    "m": "rad",
    "N": "Nm",
    "m/s": "rad/s",
    "m/s^2": "rad/s^2",
    "N^2 s/m^2": "N^2 m^2 s/rad^2",
    "m/N": "rad/Nm",
}
"""Unit of a force along a direction -> that of a moment about an axis; scripts read "Nm" in studies about one."""


def unit_of_moments(unit: str) -> str:
    """The unit of a moment, an angle or an inertia where that of a force, a way or a mass is given; others stay.

    >>> unit_of_moments("N s/m"), unit_of_moments("Hz")
    ('N m s/rad', 'Hz')
    """
    return UNITS.get(unit, unit)
