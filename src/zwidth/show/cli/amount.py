"""Numbers with units on a terminal: the figures' notation with blanks and signs that can be typed and searched."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from typing import Final

from zwidth.show.figures import units

NONE: Final = "none"
TYPED: Final = {ord(units.SPACE): " ", ord(units.MINUS): "-", ord("\u2009"): " "}


def amount(value: float | None, unit: str, digits: int = 4) -> str:
    """A value with its unit and prefix; "none" where there is no finite one.

    >>> amount(7849.44, "N/m"), amount(0.2616, "kg"), amount(None, "N/m")
    ('7.849 kN/m', '0.2616 kg', 'none')
    """
    if value is None or not isfinite(value):
        return NONE
    return typed(units.quantity(value, unit, digits))


def number(value: float | None, digits: int = 4) -> str:
    """A number of so many significant digits; "none" where there is no finite one."""
    return amount(value, "", digits)


def vector(components: Iterable[float], unit: str = "") -> str:
    """(0, 0.25) m: without the third component where that is zero."""
    return typed(units.point(components, unit))


def typed(text: str) -> str:
    """The text with plain blanks and minus signs."""
    return text.translate(TYPED)
