"""A measure: one number for a device in a place, with its unit, its source, and what a larger number means."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Literal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zwidth.measures.place import Place

Better = Literal["higher", "lower"]

# What became of a place. The first three are those of a posture.
OK: Final = 0
OUT_OF_REACH: Final = 1
SINGULAR: Final = 2
NO_VALUE: Final = 3
UNDECIDED: Final = 4
FAILED: Final = 5
MISSING: Final = 255
STATUS: Final = {
    OK: "ok",
    OUT_OF_REACH: "out of reach",
    SINGULAR: "singular",
    NO_VALUE: "no value",
    UNDECIDED: "undecided",
    FAILED: "failed",
    MISSING: "not computed",
}


class MeasureError(ValueError):
    """A measure that cannot be asked of this device, wherever it is; the text follows the measure's name."""


class NoValueError(ValueError):
    """A place in which a measure has no value; the text says why."""


@dataclass(frozen=True)
class Note:
    """Why some places have no value.

    status  theirs
    reason  one sentence
    count   how many there are
    first   index of the first, one number per leading axis
    """

    status: int
    reason: str
    count: int
    first: tuple[int, ...]


@dataclass(frozen=True)
class Measured:
    """A measure's values over places, all with the places' leading axes.

    values  (...)  nan where the status is not OK
    status  (...)  OK, OUT_OF_REACH, SINGULAR, NO_VALUE, UNDECIDED or FAILED
    notes   reasons of NO_VALUE, UNDECIDED and FAILED
    """

    values: NDArray[np.float64]
    status: NDArray[np.uint8]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Measure:
    """One number for a device in a place.

    name      as in commands and study files
    title     what it is called in a figure
    unit      "" for none
    better    what a designer wants; None where it depends
    source    where its formula stands
    function  of a `Place`; as text, "module:name", imported when it is first asked
    each      True: asked of one place at a time; False: of all at once, returning an array or a `Measured`
    along     whether it depends on the rendered direction
    linear    whether it is read off the linear loop, which leaves out friction, encoder steps and limits
    """

    name: str
    title: str
    unit: str
    better: Better | None
    source: str
    function: Callable[[Place], Any] | str
    each: bool = False
    along: bool = True
    linear: bool = True

    @property
    def key(self) -> str:
        """The name with its unit, as the columns of a table carry it; units with a variable power are left out.

        >>> Measure("stable_area", "", "N^2 s/m^2", None, "", "").key
        'stable_area_N2s_per_m2'
        """
        over, _, under = self.unit.replace(" ", "").replace("^", "").partition("/")
        written = over + (f"_per_{under}" if under else "")
        plain = re.fullmatch(r"[A-Za-z0-9_]+", written) and "^r" not in self.unit
        return f"{self.name}_{written}" if plain else self.name

    def compute(self, place: Place) -> Any:
        """What the function says; see `evaluate` for values with status."""
        if isinstance(self.function, str):
            module, _, name = self.function.partition(":")
            return getattr(import_module(module), name)(place)
        return self.function(place)
