"""One line of the page *Reproducing the thesis*: what is printed, what comes out here, the verdict computed."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from math import isfinite

AGREES = "agrees to the digits printed"
CONFIRMED = "not printed; agrees with brute force"
UNEXPLAINED = "differs, not explained"


@dataclass(frozen=True)
class Misprint:
    """Why a printed value is wrong.

    because  the reason, with the numbers that show it
    shown    whether those numbers do show it; computed
    kind     what it is; a statement may be no slip of the pen and still not hold
    """

    because: str
    shown: bool
    kind: str = "misprint"


@dataclass(frozen=True)
class Number:
    """A value.

    place, quantity  "Table 3.4", "link side mass"
    ours, unit
    printed    as in the thesis, digit by digit; None: only drawn, in a figure that the scan does not hold
    judge      the same by brute force (`gallery.brute_force`), for a value that is not printed
    within     relative distance from the judge that counts as agreement: what bisection of eigenvalues can tell
    misprint   for a printed value that differs
    digits     significant digits shown of ours
    """

    place: str
    quantity: str
    ours: float
    unit: str = ""
    printed: str | None = None
    judge: float | None = None
    within: float = 1e-7
    misprint: Misprint | None = None
    digits: int = 6

    @property
    def verdict(self) -> str:
        """What the comparison says."""
        if self.printed is None:
            close = self.judge is not None and abs(self.ours - self.judge) <= self.within * abs(self.judge)
            return CONFIRMED if close else UNEXPLAINED
        apart = abs(Decimal(float(self.ours)) - Decimal(self.printed))
        if isfinite(self.ours) and apart <= half_a_digit(self.printed):
            return AGREES if self.misprint is None else "agrees after all: the misprint's row is wrong"
        return explained(self.misprint)

    def cells(self) -> list[str]:
        """Place, quantity, printed, ours, difference, verdict."""
        ours, unit = significant(self.ours, self.digits), f" {self.unit}" if self.unit else ""
        printed = "–" if self.printed is None else f"{self.printed}{unit}"
        difference = "–" if self.printed is None else in_short(self.ours, float(self.printed))
        return [self.place, self.quantity, printed, ours + unit, difference, self.verdict]


@dataclass(frozen=True)
class Claim:
    """A statement or a formula of the thesis, against what comes out here.

    printed   what it says
    ours      what is found, with its numbers
    holds     whether the statement is right; computed
    misprint  where it is not
    """

    place: str
    quantity: str
    printed: str
    ours: str
    holds: bool
    misprint: Misprint | None = None

    @property
    def verdict(self) -> str:
        """What the comparison says."""
        if self.holds:
            return "holds" if self.misprint is None else "holds after all: the misprint's row is wrong"
        return explained(self.misprint)

    def cells(self) -> list[str]:
        """Place, quantity, printed, ours, difference, verdict."""
        return [self.place, self.quantity, self.printed, self.ours, "–", self.verdict]


Row = Number | Claim


def explained(misprint: Misprint | None) -> str:
    """The verdict on something that differs."""
    if misprint is None or not misprint.shown:
        return UNEXPLAINED
    return f"differs: {misprint.kind}, because {misprint.because}"


def half_a_digit(printed: str) -> Decimal:
    """Half a unit of the last digit printed, trailing zeros of whole numbers counted as digits."""
    exponent = Decimal(printed).as_tuple().exponent
    assert isinstance(exponent, int)
    return Decimal(5).scaleb(exponent - 1)


def significant(value: float, digits: int = 6) -> str:
    """A number with so many significant digits, no exponent where it can be read without."""
    if value == 0.0:
        return "0"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-5 < abs(value) < 1e9:
        text = f"{float(text):f}".rstrip("0").rstrip(".") if abs(value) < 1 else f"{float(text):.0f}"
    return text


def in_short(ours: float, printed: float) -> str:
    """Their difference with two significant digits and its sign; 0 where only rounding is left."""
    difference = ours - printed
    return "0" if abs(difference) <= 1e-12 * abs(printed) else f"{difference:+.2g}"
