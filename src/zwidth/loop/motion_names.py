"""Names, in results and messages, of motions that no wall moves."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from math import pi, sqrt
from typing import Final

SINGLY: Final = 6  # modes that are named one by one
# a mode, unless it grows by itself
MODE: Final = re.compile(r"mode at ([\d.e+-]+) Hz(?! \(damping ratio -)")


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


def listed_names(names: Sequence[str]) -> list[str]:
    """Names of motions for a line of text: equal ones together, and many modes, as links that bend have, by their
    number and range.

    >>> listed_names(["rigid motion (0 Hz)", *(f"mode at {100 * k} Hz" for k in range(1, 200))])
    ['rigid motion (0 Hz)', '199 modes from 100 Hz to 19.9 kHz']
    """
    frequencies = [float(match[1]) for name in names if (match := MODE.match(name))]
    if len(frequencies) <= SINGLY:
        return group_names(names)
    low, high = (_rounded_frequency(frequency) for frequency in (min(frequencies), max(frequencies)))
    others = group_names([name for name in names if not MODE.match(name)])
    return [*others, f"{len(frequencies)} modes from {low} to {high}"]


def _rounded_frequency(frequency: float) -> str:
    return f"{frequency / 1e3:.3g} kHz" if frequency >= 999.5 else f"{frequency:.3g} Hz"


def _plural(name: str, count: int) -> str:
    """A name for several equal motions."""
    for noun in ("motion", "mode"):
        name = name.replace(noun, f"{noun}s", 1)
    return f"{count} {name}"
