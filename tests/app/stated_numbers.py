"""Numbers with their units as the texts for students state them, in SI."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import NamedTuple

SI = {"kN/m": 1e3, "N/m": 1.0, "N s/m": 1.0, "N": 1.0, "kg": 1.0, "g": 1e-3, "ms": 1e-3, "µm": 1e-6, "Hz": 1.0}
WORDS = {"one sample": 1.0, "half a sample": 0.5}
ONE = r"(?<![\w.\[])(\d+(?:\.\d+)?)"
STATED = re.compile(rf"{ONE} ({'|'.join(SI)})(?![\w/])|(?i:({'|'.join(WORDS)}))|(?<=type ){ONE}")


class Stated(NamedTuple):
    """A number that a text states: in SI, with half a unit of the last digit that it is written with."""

    value: float
    half_digit: float
    words: str


def stated_numbers(text: str) -> list[Stated]:
    """The numbers of a text in its order: those with a unit, samples in words, and what is to be typed."""
    found = []
    for match in STATED.finditer(text):
        digits, unit, words, typed = match.groups()
        written = Decimal(digits or typed or "0")
        scale = SI[unit] if unit else 1.0
        half = 0.5 * 10.0 ** int(written.as_tuple().exponent) * scale
        found.append(
            Stated(WORDS[words.lower()], 0.0, words) if words else Stated(float(written) * scale, half, match[0])
        )
    return found


def left_over(text: str) -> str:
    """A text without its stated numbers: digits in it are numbers that no test reads."""
    return STATED.sub("", text)
