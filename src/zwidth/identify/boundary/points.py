"""Points of a measured stability boundary: walls on it, and walls that were tried on either side of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats, Ints
from zwidth.device.faults import comma_list
from zwidth.identify.records.record import Columns, Record

STIFFNESS: Final = ("stiffness_N_per_m", "stiffness_Nm_per_rad")
DAMPING: Final = ("damping_Ns_per_m", "damping_Nms_per_rad")
NUMBERS: Final = ("frequency_Hz", "perturbation_N", "bias_force_N", "watch_time_s", "amplitude_m", "trials")
SPREADS: Final = (
    "damping_low_Ns_per_m",
    "damping_high_Ns_per_m",
    "stiffness_low_N_per_m",
    "stiffness_high_N_per_m",
)
CIRCUMSTANCES: Final = (
    "approach",
    "held_by",
    "criterion",
    "beyond",
    "bias_force_N",
    "perturbation_N",
    "watch_time_s",
    "amplitude_m",
)
COLUMNS: Final = Columns(
    needed=(STIFFNESS, DAMPING),
    optional=(*NUMBERS, *SPREADS),
    text=("edge", "kind", "verdict", "approach", "held_by", "criterion", "beyond"),
)

LOWER, UPPER, TIP, EDGE, STABLE, UNSTABLE = "lower", "upper", "tip", "edge", "stable", "unstable"
ON_EDGE: Final = (LOWER, UPPER, TIP, EDGE)
# words of the columns edge, kind and verdict, and what they mean
WORDS: Final = {
    "lower": LOWER,
    "upper": UPPER,
    "tip": TIP,
    "edge": EDGE,
    "boundary": EDGE,
    "on": EDGE,
    "limit": EDGE,
    "stable": STABLE,
    "interior": STABLE,
    "inside": STABLE,
    "unstable": UNSTABLE,
    "exterior": UNSTABLE,
    "outside": UNSTABLE,
}
EMPTY: Final = ("", "nan", "none", "null", "-")
LARGEST: Final = 1e15  # N/m, N s/m


@dataclass(frozen=True)
class BoundaryPoints:
    """Measured points (n,), of all records one after the other.

    stiffness, damping  of the wall [N/m], [N s/m]
    kind        lower, upper: the damping was bisected at this stiffness;  tip: the stiffness at this damping;
                edge: on the boundary, it is not known where;  stable, unstable: a wall that was tried
    frequency   of the vibration at the edge [Hz]; nan where it was not measured
    low, high   of several trials, of what was bisected; nan where not known
    trials      number of trials of which a point is the mean
    circumstances  column -> numbers or words (n,), of those columns that the records have
    record, row    index of the record, and the row there
    """

    stiffness: Floats
    damping: Floats
    kind: NDArray[np.str_]
    frequency: Floats
    low: Floats
    high: Floats
    trials: Floats
    circumstances: dict[str, NDArray[Any]]
    record: Ints
    row: Ints

    def __len__(self) -> int:
        return len(self.stiffness)

    def __getitem__(self, some: Flags | Ints) -> BoundaryPoints:
        """The points of a mask (n,), or of indices."""
        own = {name: value[some] for name, value in vars(self).items() if name != "circumstances"}
        around = {name: values[some] for name, values in self.circumstances.items()}
        return replace(self, **own, circumstances=around)

    def of(self, *kinds: str) -> Flags:
        """Which points (n,) are of these kinds."""
        return np.isin(self.kind, kinds)

    @property
    def on_edge(self) -> Flags:
        """Which points (n,) lie on the boundary."""
        return self.of(*ON_EDGE)

    @property
    def bisected(self) -> Floats:
        """What was bisected (n,): the stiffness of a tip [N/m], else the damping [N s/m]."""
        return np.where(self.kind == TIP, self.stiffness, self.damping)

    @property
    def visible(self) -> Floats:
        """Amplitude (n,) up to which a vibration was not seen [m]; nan where not known. In a row that says what
        happened beyond the edge the column amplitude_m is of that vibration, and not a limit."""
        amplitude = self.circumstances.get("amplitude_m", np.full(len(self), np.nan))
        beyond = self.circumstances.get("beyond", np.full(len(self), ""))
        return np.where(beyond == "", amplitude, np.nan)

    @property
    def chosen(self) -> Floats:
        """What was chosen (n,): the damping of a tip [N s/m], else the stiffness [N/m]."""
        return np.where(self.kind == TIP, self.damping, self.stiffness)


def read_boundary_points(records: Sequence[Record]) -> BoundaryPoints:
    """The points of all records.

    Raises  DeviceError  for words that are not known, for a point that is on the edge and a tried wall, for walls
            that are infinite, and for a low end above its high end
    """
    parts = [_points_of(record, index) for index, record in enumerate(records)]
    names = {name for part in parts for name in part.circumstances}
    whole = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in vars(parts[0])
        if name != "circumstances"
    }
    around = dict[str, NDArray[Any]]()
    for name in CIRCUMSTANCES:
        if name in names:
            missing: Any = "" if name in COLUMNS.text else np.nan
            around[name] = np.concatenate(
                [part.circumstances.get(name, np.full(len(part), missing)) for part in parts]
            )
    return BoundaryPoints(**whole, circumstances=around)


def _points_of(record: Record, index: int) -> BoundaryPoints:
    """The points of a record, the `index`-th of all. Raises DeviceError as `read_boundary_points` does."""
    columns = record.columns()
    count = len(next(iter(columns.values()), ()))
    nothing = np.full(count, np.nan)
    K, B = (_wall_numbers(record, columns, names) for names in (STIFFNESS, DAMPING))
    kind = _kinds(record, columns, count)
    damping_low, damping_high, stiffness_low, stiffness_high = (columns.get(name, nothing) for name in SPREADS)
    tip = kind == TIP
    low, high = np.where(tip, stiffness_low, damping_low), np.where(tip, stiffness_high, damping_high)
    if len(crossed := np.flatnonzero(low > high)):
        row = int(crossed[0])
        # `SPREADS` has the low and the high end of damping, then those of a tip's stiffness
        raise record.fault(
            f"the low end {low[row]:g} is above the high end {high[row]:g}", row, SPREADS[2 * tip[row]]
        )
    around: dict[str, NDArray[Any]] = {
        name: _plain_words(columns[name]) if name in record.text else columns[name]
        for name in CIRCUMSTANCES
        if name in columns
    }
    return BoundaryPoints(
        stiffness=K,
        damping=B,
        kind=kind,
        frequency=columns.get("frequency_Hz", nothing),
        low=low,
        high=high,
        trials=np.nan_to_num(columns.get("trials", nothing), nan=1.0),
        circumstances=around,
        record=np.full(count, index),
        row=np.arange(count),
    )


def _wall_numbers(record: Record, columns: dict[str, NDArray[Any]], names: tuple[str, ...]) -> Floats:
    """Stiffness or damping of the rows, in the column that is there of these names; an empty cell stays nan.
    Raises DeviceError for an infinite or far too large number."""
    name = next(name for name in names if name in columns)
    values = columns[name]
    # an empty cell, nan, counts as 0 here
    beyond = np.flatnonzero(~(np.abs(np.nan_to_num(values)) <= LARGEST) | np.isinf(values))
    if len(beyond):
        row = int(beyond[0])
        raise record.fault(
            f"must be a number from {-LARGEST:g} to {LARGEST:g}, got {values[row]:g}; is the unit right?",
            row,
            name,
        )
    return np.asarray(values, dtype=float)


def _kinds(record: Record, columns: dict[str, NDArray[Any]], count: int) -> NDArray[np.str_]:
    """`BoundaryPoints.kind` of each row (n,); a row of which no column says anything lies on the boundary.

    columns  of the record by name, each of `count` rows
    Raises   DeviceError  for a word that is not known, and words of a row that contradict each other
    """
    kind = np.full(count, EDGE, dtype="U8")
    for name in ("kind", "verdict", "edge"):  # lower, upper and tip say more than boundary
        for row, word in enumerate(_plain_words(columns[name]) if name in columns else ()):
            if word in EMPTY:
                continue
            if word not in WORDS:
                raise record.fault(f"must be one of {comma_list(sorted(WORDS))}, got {word[:60]!r}", row, name)
            meaning, before = WORDS[word], str(kind[row])
            if before != EDGE and meaning not in (before, EDGE):
                text = (
                    f"{word!r} contradicts {before!r} of the same row; a point is on the boundary, or it was tried"
                )
                raise record.fault(text, row, name)
            kind[row] = before if meaning == EDGE else meaning
    return kind


def _plain_words(words: NDArray[Any]) -> NDArray[np.str_]:
    """Words in small letters without blanks round them; "" where a cell is empty."""
    plain = [str(word).strip().lower() for word in words]
    return np.array(["" if word in EMPTY else word for word in plain], dtype=str)
