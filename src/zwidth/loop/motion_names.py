"""Names, in results and messages, of motions that no wall moves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import pi, sqrt


def motion_name(squared: float, decay: float) -> str:
    """Name of a motion by its natural frequency and damping.

    squared  natural frequency squared [1/s^2]; negative for a negative stiffness
    decay    rate at which it decays [1/s], the damping ratio times the natural frequency
    """
    if squared <= 0.0:
        return "rigid motion (0 Hz)" if squared == 0.0 else "unstable motion (negative stiffness)"
    rate = sqrt(squared)
    return f"mode at {rate / (2.0 * pi):.4g} Hz (damping ratio {decay / rate:.4g})"


def pole_name(pole: complex) -> str:
    """Name of a motion by its pole [1/s]; a free motion with damping stays where it is left: its pole is 0."""
    if pole == 0.0:
        return motion_name(0.0, 0.0)
    if pole.imag != 0.0:
        return f"mode at {abs(pole) / (2.0 * pi):.4g} Hz (coupled damping)"
    return "overdamped motion"


def group_names(names: Sequence[str]) -> list[str]:
    """Names of motions, equal ones as one name with their number.

    >>> group_names(["rigid motion (0 Hz)", "mode at 101 Hz", "rigid motion (0 Hz)"])
    ['2 rigid motions (0 Hz)', 'mode at 101 Hz']
    """
    return [_plural(name, count) if count > 1 else name for name, count in Counter(names).items()]


def _plural(name: str, count: int) -> str:
    """A name for several equal motions."""
    for noun in ("motion", "mode"):
        name = name.replace(noun, f"{noun}s", 1)
    return f"{count} {name}"
