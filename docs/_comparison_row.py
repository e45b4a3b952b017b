"""One line of the page *Reproducing the thesis*: what is printed, what comes out here, the verdict computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_DOWN, Decimal
from math import isfinite

AGREES = "agrees"
ROUNDED = "rounded"
SCAN_DAMAGED = "scan damaged"
MISPRINT = "misprint"
ANOTHER_QUESTION = "another question"
UNEXPLAINED = "unexplained"
OURS_ONLY = "ours only"

# Every verdict of the page, with what it says of a row.
MEANING = {
    AGREES: "A printed number: ours is within half a unit of its last digit. A printed formula or statement: a "
    "computation confirms it, with the numbers in the row.",
    ROUNDED: "Ours rounds to what is printed at a coarser step than its digits show, or the text says "
    "“approximately” or “about”, of the result or of what it is computed from.",
    SCAN_DAMAGED: "Symbols are lost or changed here, as far as can be told by the scan. The row says how we read "
    "them; read so, the formula agrees with a computation.",
    MISPRINT: "What is printed contradicts other numbers that the thesis prints. The row lists them: ours gives "
    "them.",
    ANOTHER_QUESTION: "What is printed is right of another set, model, range or case than the one computed. The "
    "row says which, with the numbers for both.",
    UNEXPLAINED: "Ours differs from what is printed, or our two routes from each other, and we know no reason "
    "that numbers bear out. The row says what was tried.",
    OURS_ONLY: "Not printed, or only drawn in a figure that the scan does not hold. Two routes that share no code "
    "give the same.",
}


@dataclass(frozen=True)
class Evidence:
    """A number that the thesis prints elsewhere, and what the value that we hold for right gives for it.

    where    "m_e2 in Table 3.4"
    printed  digit by digit
    ours     computed with the right value
    """

    where: str
    printed: str
    ours: float
    unit: str = ""

    @property
    def fits(self) -> bool:
        """Whether the printed digits are ours, rounded or, where there are three or more, cut off."""
        several = len(Decimal(self.printed).as_tuple().digits) >= 3
        return fits_digits(self.ours, self.printed) or (several and is_cut_off(self.ours, self.printed))

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"ours gives the {self.printed}{unit} of {self.where} ({significant(self.ours)})"


@dataclass(frozen=True)
class Reason:
    """Why something printed is not what comes out here.

    verdict   ROUNDED, SCAN_DAMAGED, MISPRINT, ANOTHER_QUESTION, or UNEXPLAINED with what was tried
    because   the reason, with the numbers that show it
    shown     whether those numbers do show it; computed
    evidence  other printed numbers; a misprint is not claimed without
    """

    verdict: str
    because: str
    shown: bool
    evidence: tuple[Evidence, ...] = ()

    def __post_init__(self) -> None:
        if self.verdict not in MEANING or self.verdict in (AGREES, OURS_ONLY):
            raise ValueError(f"{self.verdict!r} is no reason for a difference")
        if self.verdict == MISPRINT and not self.evidence:
            raise ValueError(f"a misprint wants evidence from other printed numbers: {self.because}")

    @property
    def holds(self) -> bool:
        """Whether the reason's numbers and all of its evidence bear it out."""
        return bool(self.shown) and all(each.fits for each in self.evidence)

    def __str__(self) -> str:
        return "; ".join([self.because, *map(str, self.evidence)])


class Row:
    """What numbers and claims share: a verdict, and how it reads in the table.

    place     sections, equations, tables and figures, as "(2.14)–(2.17)" or "Table 3.4, 5.2"
    quantity  what of it
    printed   as in the thesis; None: not printed, or only drawn in a figure that the scan does not hold
    reason    why ours is not what is printed
    """

    place: str
    quantity: str
    printed: str | None
    reason: Reason | None

    @property
    def agreement(self) -> bool:
        """Whether ours is what is printed, or for a row of ours only what the second route gives."""
        raise NotImplementedError

    @property
    def verdict(self) -> str:
        """One of the words of `MEANING`."""
        if self.agreement:
            return OURS_ONLY if self.printed is None else AGREES
        return self.reason.verdict if self.reason is not None and self.reason.holds else UNEXPLAINED

    @property
    def why(self) -> str:
        """The reason that the verdict rests on; empty where nothing differs, or no reason holds."""
        return "" if self.agreement or self.reason is None or not self.reason.holds else str(self.reason)

    def in_columns(self, ours: str, route: str, unit: str = "") -> list[str]:
        """Place, quantity, verdict, then printed and ours with the reason, or ours and the second route."""
        told = [self.place, self.quantity, self.verdict if self.agreement else f"**{self.verdict}**"]
        if self.printed is None:
            return [*told, ours, route]
        return [*told, self.printed + unit, f"{ours}<br>{self.why}" if self.why else ours]


@dataclass(frozen=True)
class Number(Row):
    """A value.

    ours, unit
    printed       digit by digit
    second_value  the same by the second route, for a value that is not printed
    tolerance     relative distance from second_value that counts as agreement: what that route can tell
    digits        significant digits shown of ours
    route         what the second route is
    """

    place: str
    quantity: str
    ours: float
    unit: str = ""
    printed: str | None = None
    second_value: float | None = None
    tolerance: float = 1e-7
    reason: Reason | None = None
    digits: int = 6
    route: str = "brute force"

    @property
    def agreement(self) -> bool:
        """Within half a digit of the printed value, or `tolerance` of the second value."""
        if self.printed is not None:
            return fits_digits(self.ours, self.printed)
        return self.second_value is not None and abs(self.ours - self.second_value) <= self.tolerance * abs(
            self.second_value
        )

    def cells(self) -> list[str]:
        """What stands in the table's columns; see `in_columns`."""
        unit = f" {self.unit}" if self.unit else ""
        ours = significant(self.ours, self.digits) + unit
        return self.in_columns(ours, f"{self.route}, to {self.tolerance:.0e}", unit)


@dataclass(frozen=True)
class Claim(Row):
    """A statement or a formula.

    printed  what the thesis says; None: the statement is ours
    ours     what is found, with its numbers
    holds    whether the statement is right as printed, or whether the second route bears out one of ours; computed
    route    for a statement of ours, what the second route is
    """

    place: str
    quantity: str
    printed: str | None
    ours: str
    holds: bool
    reason: Reason | None = None
    route: str = ""

    def __post_init__(self) -> None:
        if (self.printed is None) != bool(self.route):
            raise ValueError(f"{self.place}, {self.quantity}: either printed, or with a second route")

    @property
    def agreement(self) -> bool:
        """Whether it holds."""
        return bool(self.holds)

    def cells(self) -> list[str]:
        """What stands in the table's columns; see `in_columns`."""
        return self.in_columns(self.ours, self.route)


def count_verdicts(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows have each verdict of `MEANING`."""
    found = [row.verdict for row in rows]
    return {verdict: found.count(verdict) for verdict in MEANING}


def fits_digits(ours: float, printed: str) -> bool:
    """Whether ours is within half a unit of the last digit printed."""
    return isfinite(ours) and abs(Decimal(float(ours)) - Decimal(printed)) <= last_digit(printed) / 2


def is_cut_off(ours: float, printed: str) -> bool:
    """Whether the digits printed are the first ones of ours, the rest dropped without rounding."""
    if not isfinite(ours):
        return False
    return Decimal(float(ours)).quantize(last_digit(printed), ROUND_DOWN) == Decimal(printed)


def last_digit(printed: str) -> Decimal:
    """One unit of the last digit printed, trailing zeros of whole numbers counted as digits."""
    exponent = Decimal(printed).as_tuple().exponent
    assert isinstance(exponent, int)
    return Decimal(1).scaleb(exponent)


def significant(value: float, digits: int = 6) -> str:
    """A number with so many significant digits, no exponent where it can be read without."""
    if value == 0.0:
        return "0"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-5 < abs(value) < 1e9:
        text = f"{float(text):f}".rstrip("0").rstrip(".") if abs(value) < 1 else f"{float(text):.0f}"
    return text
