"""One argument of a question: name, unit, range, default, and the sentence that says what it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from typing import Any, Final, Literal, TypeAlias

from zwidth.errors import ArgumentError

LARGEST: Final = 1e15  # of any number: beyond, answers would be rounding
LONGEST_QUOTE: Final = 60  # characters of a value that a message repeats
Kind = Literal["number", "whole", "choice", "flag", "vector", "counts", "text"]


@dataclass(frozen=True)
class Argument:
    """One argument of a question.

    name      in Python
    sentence  what it is, beginning with a capital and without a full stop; its unit stands at the end, unless the
              sentence has it
    unit      "" for none
    kind      a number, a whole one, one of `choices`, yes or no (flag), several numbers (vector), several whole
              ones (counts), or a text
    default   what is taken where it is left out; None: nothing, or what `left_out` says in words
    least, above, most, below  limits of a number: at least, more than, at most, less than
    choices   the texts that are allowed
    lengths, example  how many numbers a vector may have, and one that is allowed
    value     what stands for its value in a command line
    option    what the command line calls it, where that is not the name; with a slash what says yes and no
    repeated  whether the command line may give it several times
    required  whether the command line must give it
    key       its name in a study file; "" where none has it
    hint      what a message adds where the value is not allowed
    """

    name: str
    sentence: str
    unit: str = ""
    kind: Kind = "number"
    default: Any = None
    left_out: str = ""
    least: float = -LARGEST
    above: float = -inf
    most: float = LARGEST
    below: float = inf
    choices: tuple[str, ...] = ()
    lengths: tuple[int, ...] = ()
    example: str = ""
    value: str | None = None
    option: str = ""
    repeated: bool = False
    required: bool = False
    key: str = ""
    hint: str = ""

    @property
    def help(self) -> str:
        """What it is, its unit and its default, in sentences.

        >>> Argument("start_velocity", "Velocity at the start", "m/s", default=0.0).help
        'Velocity at the start [m/s]. Default: 0.'
        """
        unit = f" [{self.unit}]" if self.unit and f"[{self.unit}]" not in self.sentence else ""
        repeatable = "; repeatable" if self.repeated else ""
        default = self.default if isinstance(self.default, str) else f"{self.default:g}" if self.default else "0"
        taken = self.left_out or ("" if self.default is None or self.kind == "flag" else default)
        return f"{self.sentence}{unit}{repeatable}." + (f" Default: {taken}." if taken else "")

    @property
    def allowed(self) -> str:
        """The limits of a number in words; "" for none.

        >>> Argument("spectral_radius", "", above=0.0, most=1.0).allowed
        'above 0 and at most 1'
        """
        low = f"above {self.above:g}" if self.above > -inf else f"at least {self.least:g}"
        high = f"below {self.below:g}" if self.below < inf else f"at most {self.most:g}"
        bounded = self.above > -inf or self.least > -LARGEST, self.below < inf or self.most < LARGEST
        return " and ".join(text for text, there in zip((low, high), bounded, strict=True) if there)

    def allows(self, value: Any) -> bool:
        """Whether a number is of the kind and within the limits, a word among the choices."""
        if self.kind not in ("number", "whole"):
            return self.kind != "choice" or value in self.choices
        if not isinstance(value, Integral if self.kind == "whole" else Real) or isinstance(value, bool):
            return False
        x: Any = value
        return bool(self.least <= x <= self.most and self.above < x < self.below and abs(x) < inf)

    def check(self, value: Any) -> None:
        """Raise ArgumentError for a number or a word that is not allowed.

        >>> Argument("levels", "", kind="whole", least=1, most=255).check(0)
        Traceback (most recent call last):
        zwidth.errors.ArgumentError: levels must be a whole number from 1 to 255, got 0
        """
        if self.allows(value):
            return
        unit, hint = f" [{self.unit}]" if self.unit else "", self.hint
        if self.kind == "choice":
            wanted = " or ".join(map(repr, self.choices))
        elif self.kind == "whole":
            wanted = f"a whole number from {self.least:g} {f'to {int(self.most)}' if self.most < inf else 'on'}"
        elif isinstance(value, int | float) and LARGEST < abs(value) < inf:
            wanted, hint = f"from {-LARGEST:g} to {LARGEST:g}{unit}", "is the unit right?"
        else:
            wanted = f"a finite number{', ' if self.allowed else ''}{self.allowed}{unit}"
        got = "but it is missing" if value == "" else f"got {_quoted(value)}"
        raise ArgumentError(self.name, f"must be {wanted}, {got}{hint and '; '}{hint}")


def _quoted(value: Any) -> str:
    """The value as a message repeats it: a float with ten digits, anything else cut short."""
    return f"{value:.10g}" if isinstance(value, float) else repr(value)[:LONGEST_QUOTE]


Arguments: TypeAlias = Mapping[str, Argument]


def by_name(*arguments: Argument) -> Arguments:
    """The arguments of a question, by their names."""
    return {one.name: one for one in arguments}


def check_arguments(arguments: Arguments, **values: Any) -> None:
    """Raise ArgumentError for the first value that is not allowed; None stands for one that is left out."""
    for name, value in values.items():
        if value is not None:
            arguments[name].check(value)
