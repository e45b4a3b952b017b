"""A measure: one number for a device at an operating point, its unit, its source, and whether more is better.

What some measures must be told besides the device: the wall to be rendered, its margins, a force, a band.

Each number is an argument in Python, a key of a study file, an option of `zwidth map` and an axis of a study.

Why operating points have no value: `Note`, and notes of many batches joined into few.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Literal

from zwidth.result import Result
from zwidth.unit_text import unit_of_moments

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zwidth.arrays import Floats
    from zwidth.loop.operating_point import OperatingPoint


@dataclass(frozen=True)
class WantedWall:
    """The wall to be rendered and what is asked of it, which some measures need; None where a number is not given.

    stiffness, damping  of the wanted wall [N/m], [N s/m]
    frequency           at which the hand moves on it [Hz]
    spectral_radius     that the wall must not exceed
    stiffness_margin    share by which the wall's stiffness may be off
    damping_margin      share by which the wall's damping may be off
    delay_margin        how much longer the delay may be [samples]
    lowest_frequency    lower end of the band of motion [Hz]
    highest_frequency   upper end of the band of motion [Hz]
    force               to be held along the rendered direction [N]
    link_radius         of the links, taken for rods with round ends [m]
    colliding_links     pairs of links that can collide, each "A:B"; None: all that are no neighbours
    """

    stiffness: float | None = None
    damping: float | None = None
    frequency: float | None = None
    spectral_radius: float | None = None
    stiffness_margin: float | None = None
    damping_margin: float | None = None
    delay_margin: float | None = None
    lowest_frequency: float | None = None
    highest_frequency: float | None = None
    force: float | None = None
    link_radius: float | None = None
    colliding_links: tuple[str, ...] | None = None


@dataclass(frozen=True)
class WantedWalls:
    """The wall to be rendered by each of many designs, for measures that take designs all at once.

    Each number as in `WantedWall`, of shape (...), which broadcasts with the points; None where it is not given.
    """

    stiffness: Floats | None = None
    damping: Floats | None = None
    frequency: Floats | None = None
    spectral_radius: Floats | None = None
    stiffness_margin: Floats | None = None
    damping_margin: Floats | None = None
    delay_margin: Floats | None = None
    lowest_frequency: Floats | None = None
    highest_frequency: Floats | None = None
    force: Floats | None = None
    link_radius: Floats | None = None
    colliding_links: tuple[str, ...] | None = None


__all__ = [
    "BEYOND_LIMIT",
    "FAILED",
    "MISSING",
    "NO_EQUILIBRIUM",
    "NO_POSTURE",
    "NO_VALUE",
    "OK",
    "OUT_OF_REACH",
    "SINGULAR",
    "STATUS",
    "UNDECIDED",
    "UNREACHED",
    "Better",
    "Measure",
    "MeasureValues",
    "Note",
    "WantedWall",
    "WantedWalls",
]

Better = Literal["higher", "lower"]

# Status of an operating point. OK, OUT_OF_REACH, SINGULAR, BEYOND_LIMIT and NO_EQUILIBRIUM are those of a
# posture.
OK: Final = 0
OUT_OF_REACH: Final = 1
SINGULAR: Final = 2
NO_VALUE: Final = 3
UNDECIDED: Final = 4
FAILED: Final = 5
BEYOND_LIMIT: Final = 6
NO_EQUILIBRIUM: Final = 7
OUT_OF_TIME: Final = 8  # of a design or cell that a run with a time limit gave up
MISSING: Final = 255
NO_POSTURE: Final = (OUT_OF_REACH, SINGULAR, BEYOND_LIMIT)
UNREACHED: Final = (*NO_POSTURE, NO_EQUILIBRIUM)
STATUS: Final = {
    OK: "ok",
    OUT_OF_REACH: "out of reach",
    SINGULAR: "singular",
    NO_VALUE: "no value",
    UNDECIDED: "undecided",
    FAILED: "failed",
    BEYOND_LIMIT: "beyond a joint limit",
    NO_EQUILIBRIUM: "no equilibrium",
    OUT_OF_TIME: "out of time",
    MISSING: "not computed",
}


@dataclass(frozen=True)
class Note:
    """Reason why some operating points have no value.

    status  status of these points
    reason  one sentence
    count   number of these points
    first   index of the first, one number per leading axis
    """

    status: int
    reason: str
    count: int
    first: tuple[int, ...]


MOST_NOTES: Final = 100  # notes per measure; a reason that contains a number may differ in each cell
MORE: Final = "further reasons, each in few cells"


class NoteSummary:
    """Notes of one measure, added in the order of their cells; its size does not grow with the cells.

    most  largest number of reasons that are kept apart; further ones are counted together, for each status

    >>> summary = NoteSummary(1)
    >>> summary.add([Note(5, "no", 2, (3,)), Note(5, "never", 1, (7,)), Note(5, "no", 1, (9,))])
    >>> [(note.reason, note.count, note.first) for note in summary.notes()]
    [('no', 3, (3,)), ('further reasons, each in few cells', 1, (7,))]
    """

    def __init__(self, most: int = MOST_NOTES) -> None:
        self.most = most
        self._kept: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}
        self._more: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}

    def add(self, notes: Iterable[Note]) -> None:
        """Add notes of later cells, the first of their cells in ascending order."""
        for note in notes:
            key, counts = (note.status, note.reason), self._kept
            if key not in counts and len(counts) >= self.most:
                key, counts = (note.status, MORE), self._more
            count, first = counts.get(key, (0, note.first))
            counts[key] = count + note.count, min(first, note.first)

    def notes(self) -> tuple[Note, ...]:
        """The joined notes in the order of their first cells, those that count further reasons last."""
        # status and reason, then count and first index
        return tuple(Note(*key, *cells) for counts in (self._kept, self._more) for key, cells in counts.items())


def merge_notes(notes: Iterable[Note], most: int = MOST_NOTES) -> tuple[Note, ...]:
    """Join notes of the same reason into one, in the order of their first cells.

    most  largest number of notes; further ones are counted in one more note for each status

    >>> merge_notes([Note(5, "no", 2, (7,)), Note(5, "no", 1, (3,))])
    (Note(status=5, reason='no', count=3, first=(3,)),)
    """
    summary = NoteSummary(most)
    summary.add(sorted(notes, key=lambda note: (note.first, note.status, note.reason)))
    return summary.notes()


@dataclass(frozen=True, repr=False)
class MeasureValues(Result):
    """A measure's values at operating points of shape (...).

    values  (...)  nan where the status is not OK
    status  (...)  OK, OUT_OF_REACH, SINGULAR, BEYOND_LIMIT, NO_EQUILIBRIUM, NO_VALUE, UNDECIDED or FAILED
    notes   reasons of NO_VALUE, UNDECIDED and FAILED, and of NO_EQUILIBRIUM where it shows with the measure alone
    """

    values: Floats
    status: NDArray[np.uint8]
    notes: tuple[Note, ...] = ()

    def __float__(self) -> float:
        """The value of a single point. Raises TypeError for several."""
        return float(self.values)

    def document(self) -> dict[str, Any]:
        """Values (nan where there is none), the status of each point in words, and the notes, by key."""
        words = [STATUS[int(one)] for one in self.status.ravel()]
        notes = [
            {"status": STATUS[note.status], "reason": note.reason, "count": note.count, "first": list(note.first)}
            for note in self.notes
        ]
        return {"values": self.values.tolist(), "status": words, "shape": list(self.values.shape), "notes": notes}

    def table(self) -> dict[str, list[Any]]:
        """The values as columns, one point a row, the last axis fastest."""
        return {"value": self.values.ravel().tolist(), "status": [STATUS[int(one)] for one in self.status.ravel()]}

    def __repr__(self) -> str:
        """One line: a single point's value, or why it has none; of several the statuses' counts and the span."""
        words = [STATUS[int(one)] for one in self.status.ravel()]
        if len(words) == 1:
            reason = f": {self.notes[0].reason}" if self.notes else ""
            value = f"{float(self.values.ravel()[0]):.6g}" if words[0] == STATUS[OK] else words[0] + reason
            return f"Measured: {value}"
        counted = ", ".join(f"{words.count(word)} {word}" for word in STATUS.values() if word in words)
        finite = self.values.ravel()[self.status.ravel() == OK]
        span = f", {finite.min():.6g} to {finite.max():.6g}" if len(finite) else ""
        return f"Measured: {len(words)} points, {counted}{span}"


@dataclass(frozen=True)
class Measure:
    """One number for a device at an operating point.

    name      as in commands and study files
    title     label in a figure
    unit      "" for none
    better    "higher" or "lower"; None where that depends on the purpose
    source    publication or section of the formula
    function  of an `OperatingPoint`; or a text "module:name", imported at first use
    each      True: called with one point at a time; False: with all at once, returning an array or `MeasureValues`
    along     whether it depends on the rendered direction
    linear    whether it is computed from the linear loop, without friction, encoder steps and limits
    of_wall   whether it is about a wanted wall, which its function takes as a second argument
    wall      the wanted wall; of many designs with walls of their own, these walls
    of_designs  whether it also takes points whose mechanism, plant or computer differ, all at once
    """

    name: str
    title: str
    unit: str
    better: Better | None
    source: str
    function: Callable[..., Any] | str
    each: bool = False
    along: bool = True
    linear: bool = True
    of_wall: bool = False
    wall: WantedWall | WantedWalls = WantedWall()
    of_designs: bool = False

    @property
    def key(self) -> str:
        """The name with its unit, as the columns of a table carry it; units with a variable power are left out.

        >>> Measure("stable_area", "", "N^2 s/m^2", None, "", "").key
        'stable_area_N2s_per_m2'
        """
        numerator, _, denominator = (
            self.unit.replace("kg m", "kg_m").replace(" ", "").replace("^", "").partition("/")
        )
        written = numerator + (f"_per_{denominator}" if denominator else "")
        plain = re.fullmatch(r"[A-Za-z0-9_]+", written) and "^r" not in self.unit
        return f"{self.name}_{written}" if plain else self.name

    def about_moments(self) -> Measure:
        """The same measure of moments about an axis; itself if it does not depend on what is rendered."""
        return replace(self, unit=unit_of_moments(self.unit)) if self.along else self

    def at_wall(self, wall: WantedWall | WantedWalls) -> Measure:
        """The same measure for a wanted wall; itself if it needs none."""
        return replace(self, wall=wall) if self.of_wall else self

    def compute(self, point: OperatingPoint) -> Any:
        """Result of the measure's function at a point; see `evaluate` for values with status."""
        function = self.function
        if isinstance(function, str):
            module, _, name = function.partition(":")
            function = getattr(import_module(module), name)
        return function(point, self.wall) if self.of_wall else function(point)
