"""Names for people of motions that no wall moves."""

from __future__ import annotations

from math import pi, sqrt


def motion_name(squared: float, decay: float) -> str:
    """A motion's name for people."""
    if squared <= 0.0:
        return "rigid motion (0 Hz)" if squared == 0.0 else "unstable motion (negative stiffness)"
    rate = sqrt(squared)
    return f"mode at {rate / (2.0 * pi):.4g} Hz (damping ratio {decay / rate:.4g})"


def pole_name(pole: complex) -> str:
    """The same for a motion with a pole of its own; a braked free motion stays where it is left, at 0 Hz."""
    if pole == 0.0:
        return motion_name(0.0, 0.0)
    if pole.imag != 0.0:
        return f"mode at {abs(pole) / (2.0 * pi):.4g} Hz (coupled damping)"
    return "overdamped motion"
