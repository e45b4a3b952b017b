"""Names, in results and messages, of motions that no wall moves."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from math import log, pi, sqrt
from typing import Final

SINGLY: Final = 6  # motions of a kind that are named one by one
# a mode, unless it grows by itself
MODE: Final = re.compile(r"mode at ([\d.e+-]+) Hz(?! \(damping ratio -)")
SIDEWAYS: Final = re.compile(
    r"sideways (motion|vibration)(?: at [\d.e+-]+ Hz)? that (grow|decay)s by ([\d.e+-]+) 1/s"
)


def motion_name(squared: float, decay: float) -> str:
    """Name of a motion by its natural frequency and damping.

    squared  natural frequency squared [1/s²]; negative for a negative stiffness
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
    """Names of motions for a line of text: equal ones together, and many of a kind by their number and range, as
    the modes of links that bend, or the motions along a surface under many pushes.

    >>> listed_names(["rigid motion (0 Hz)", *(f"mode at {100 * k} Hz" for k in range(1, 200))])
    ['rigid motion (0 Hz)', '199 modes from 100 Hz to 19.9 kHz']
    >>> listed_names([f"sideways motion that grows by {k} 1/s" for k in range(1, 9)])
    ['8 sideways motions that grow by 1 to 8 1/s (the fastest doubles in 0.08664 s)']
    """
    kinds: dict[tuple[str, str] | None, list[str]] = {}
    for name in names:
        kinds.setdefault(_noun_and_verb(name), []).append(name)
    many = {kind: each for kind, each in kinds.items() if kind is not None and len(each) > SINGLY}
    others = group_names([name for name in names if _noun_and_verb(name) not in many])
    return [*others, *(_range_text(kind, each) for kind, each in many.items())]


def _noun_and_verb(name: str) -> tuple[str, str] | None:
    """Noun and verb of a motion's name, the verb "" of a mode, where many of the kind can be told by number and
    range; None where they cannot."""
    if MODE.match(name):
        return "mode", ""
    match = SIDEWAYS.match(name)
    return None if match is None else (match[1], match[2])


def _range_text(kind: tuple[str, str], names: Sequence[str]) -> str:
    """Name of several motions of a kind, noun and verb as of `_noun_and_verb`: their number and range."""
    noun, verb = kind
    pattern, group = (SIDEWAYS, 3) if verb else (MODE, 1)
    numbers = [float(match[group]) for name in names if (match := pattern.match(name))]
    low, high = min(numbers), max(numbers)
    if not verb:
        return f"{len(numbers)} modes from {_rounded_frequency(low)} to {_rounded_frequency(high)}"
    doubles = f" (the fastest doubles in {log(2.0) / high:.4g} s)" if verb == "grow" else ""
    return f"{len(numbers)} sideways {noun}s that {verb} by {low:.4g} to {high:.4g} 1/s{doubles}"


def _rounded_frequency(frequency: float) -> str:
    return f"{frequency / 1e3:.3g} kHz" if frequency >= 999.5 else f"{frequency:.3g} Hz"


def _plural(name: str, count: int) -> str:
    """A name for several equal motions."""
    for noun in ("motion", "mode"):
        name = name.replace(noun, f"{noun}s", 1)
    return f"{count} {name}"
