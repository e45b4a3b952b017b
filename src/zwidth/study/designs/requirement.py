"""`Requirement`: a lower or an upper bound on a measure."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.measures.catalogue import find_measure
from zwidth.measures.definition import Measure

_FORM: Final = re.compile(r"\s*(?P<name>[^<>=\s]*)\s*(?P<sign>[<>=]*)\s*(?P<value>.*?)\s*")


@dataclass(frozen=True)
class Requirement:
    """A bound on a measure.

    at_least  True: the measure must be `value` or more; False: or less
    """

    measure: Measure
    at_least: bool
    value: float

    @property
    def text(self) -> str:
        """The requirement as a user types it: "stiffness_max>=5000"."""
        return f"{self.measure.name}{'>=' if self.at_least else '<='}{self.value:g}"

    def margin(self, values: ArrayLike) -> Floats:
        """Margin by which values meet the bound, in the measure's unit; negative where they do not.

        >>> from zwidth.measures.catalogue import MEASURES
        >>> Requirement(MEASURES["isotropy"], False, 1.5).margin([1.25, 2.0]).tolist()
        [0.25, -0.5]
        """
        beyond = np.asarray(values, dtype=np.float64) - self.value
        return beyond if self.at_least else -beyond

    def met(self, values: ArrayLike) -> Flags:
        """Which values meet the bound; nan does not."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.margin(values) >= 0.0)


def parse_requirement(text: str, user_measures: Mapping[str, Measure] | None = None) -> Requirement:
    """The requirement written as NAME>=VALUE or NAME<=VALUE, in the measure's unit.

    user_measures  measures of a user's own, by name; a name may carry its unit, stiffness_max_N_per_m
    Raises         ValueError  for another form, a measure that does not exist (the nearest is named), no finite
                   number

    >>> parse_requirement("isotropy <= 1.5").text
    'isotropy<=1.5'
    """
    form = _FORM.fullmatch(text)
    name, sign, number = form.groups() if form else ("", "", "")
    if sign not in ("<=", ">=") or not name:
        raise ValueError(f"{text!r} is not a requirement; write NAME>=VALUE or NAME<=VALUE, such as isotropy<=1.5")
    try:
        value = float(number)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{text!r}: the bound must be a finite number, got {number!r}")
    return Requirement(find_measure(name, user_measures), sign == ">=", value)
