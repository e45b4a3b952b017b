"""Units as texts and figures write them."""

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
