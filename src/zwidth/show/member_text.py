"""The members of a family of devices in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from zwidth.show.output import printable


def value_text(value: Any) -> str:
    """A member's value, in four digits where it is a number.

    >>> value_text(30004.0), value_text(0.74483), value_text("thesis-arm")
    ('30000', '0.7448', 'thesis-arm')
    """
    if isinstance(value, str):
        return value
    return f"{float(f'{value:.3e}'):.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"


def member_text(index: int, values: Mapping[str, Any]) -> str:
    """A member by its number and its values.

    >>> member_text(3, {"plant.mass_kg": 0.1})
    '3 (plant.mass_kg = 0.1)'
    """
    pairs = ", ".join(f"{path} = {printable(value_text(value))}" for path, value in values.items())
    return f"{index} ({pairs})"
