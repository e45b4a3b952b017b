"""Read walls, or measured points of a stability boundary, from a CSV file; every fault is named with its line.

A user's measured points compared with the exact chart: distances from its edge, and verdicts.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from math import isfinite, isnan, nan
from typing import TYPE_CHECKING, Any, Final

from zwidth.device.read import LARGEST_TABLE, SEPARATORS, header_fault, non_blank_rows, read_text
from zwidth.errors import FileError
from zwidth.model.argument_checks import check_choice
from zwidth.result import Documented, documented, entry

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart


COLUMNS: Final = ("stiffness_N_per_m", "damping_Ns_per_m")
SPREADS: Final = (
    "damping_low_Ns_per_m",
    "damping_high_Ns_per_m",
    "stiffness_low_N_per_m",
    "stiffness_high_N_per_m",
)
MOST_FAULTS: Final = 20
MOST_DIGITS: Final = 12  # largest number of digits of a number of trials
LARGEST_WALL: Final = 1e15  # N/m, N s/m; beyond, verdicts would be rounding

File = str | os.PathLike[str]
Walls = list[tuple[float, float]]
# from a cell to its value, and what is wrong with it ("" if nothing)
Reader = Callable[[str], tuple[Any, str]]


def wall_number(text: str) -> tuple[float, str]:
    """Read a wall's stiffness or damping from the text of a cell; returns the number, and what is wrong with it
    ("" if nothing)."""
    try:
        number = float(text)
    except ValueError:
        number = nan
    if not isfinite(number):
        return number, "must be a finite number, " + (f"got {text[:60]!r}" if text else "but it is missing")
    if abs(number) > LARGEST_WALL:
        return number, f"must be from {-LARGEST_WALL:g} to {LARGEST_WALL:g}, got {text[:60]!r}; is the unit right?"
    return number, ""


def read_walls(file: File) -> Walls:
    """The walls (stiffness [N/m], damping [N s/m]) of a CSV file with these two columns; others are ignored.

    Raises FileError  if it cannot be read, lacks a column or holds no wall, or with every line that is wrong
    """
    return [(row[COLUMNS[0]], row[COLUMNS[1]]) for row in _rows(file, {})]


def read_points(file: File) -> list[UserPoint]:
    """Measured points: a CSV file as for `read_walls`, with columns that may be left out, and cells left empty.

    Raises FileError  as `read_walls`
    """
    optional: dict[str, Reader] = {
        "edge": partial(_read_word, EDGES),
        "verdict": partial(_read_word, VERDICTS),
        **dict.fromkeys(SPREADS, _read_spread_end),
        "trials": _read_trials,
    }
    return [
        UserPoint(
            stiffness=row["stiffness_N_per_m"],
            damping=row["damping_Ns_per_m"],
            edge=row.get("edge", ""),
            damping_low=row.get("damping_low_Ns_per_m", nan),
            damping_high=row.get("damping_high_Ns_per_m", nan),
            stiffness_low=row.get("stiffness_low_N_per_m", nan),
            stiffness_high=row.get("stiffness_high_N_per_m", nan),
            trials=row.get("trials", 1),
            verdict=row.get("verdict", ""),
        )
        for row in _rows(file, optional)
    ]


def _read_word(allowed: tuple[str, ...], text: str) -> tuple[str, str]:
    """A cell that holds one of the allowed texts, and what is wrong with it ("" if nothing)."""
    return text, "" if text in allowed else f"must be {', '.join(allowed[:-1])} or nothing, got {text[:60]!r}"


def _read_spread_end(text: str) -> tuple[float, str]:
    """Read an end of a spread, nan where the cell is empty; returns it and what is wrong, as `wall_number`."""
    return wall_number(text) if text else (nan, "")


def _read_trials(text: str) -> tuple[int, str]:
    """Read a number of trials, 1 where the cell is empty; returns it and what is wrong ("" if nothing)."""
    if not text or (text.isdecimal() and len(text) < MOST_DIGITS and int(text) > 0):
        return int(text or 1), ""
    return 1, f"must be a whole number from 1 on, got {text[:60]!r}"


def _rows(file: File, optional: Mapping[str, Reader]) -> list[dict[str, Any]]:
    """The rows of a file, each as column -> value; of the optional columns those that it has. Raises FileError."""
    rows = csv.reader(_text(file).splitlines(), strict=True)
    faults: list[str] = []
    cells_of_rows: list[dict[str, Any]] = []
    try:
        header = [name.strip() for name in next(non_blank_rows(rows), [])]
        places = _column_indices(file, header, optional)
        readers: dict[str, Reader] = {**dict.fromkeys(COLUMNS, wall_number), **optional}
        for row in non_blank_rows(rows):
            if len(row) > len(header):
                faults.append(
                    f"{file}: line {rows.line_num}: has {len(row)} cells, but the header names {len(header)} "
                    "columns; write a decimal point, not a comma, or name every column"
                )
                continue
            if other := _row_separator(row):
                faults.append(f"{file}: line {rows.line_num}: the cells are separated by {other}; use commas")
                continue
            cells = {}
            for name, place in places.items():
                cells[name], fault = readers[name](row[place].strip() if place < len(row) else "")
                if fault:
                    faults.append(f"{file}: line {rows.line_num}: {name}: {fault}")
            faults += [f"{file}: line {rows.line_num}: {fault}" for fault in _contradictions(cells)]
            cells_of_rows.append(cells)
    except csv.Error as error:
        raise FileError(f"{file}: line {rows.line_num}: is not CSV: {error}") from None
    if faults:
        more = [f"{file}: and {len(faults) - MOST_FAULTS} more faults"] if len(faults) > MOST_FAULTS else []
        raise FileError(*islice(faults, MOST_FAULTS), *more)
    if not cells_of_rows:
        raise FileError(f"{file}: holds no walls; give a line with {' and '.join(COLUMNS)} for each")
    return cells_of_rows


def _row_separator(row: list[str]) -> str:
    """The character that separates the cells of a row in place of commas; "" if it is a comma."""
    if len(row) != 1:
        return ""
    return next((name for mark, name in SEPARATORS.items() if mark in row[0].strip()), "")


def _contradictions(cells: dict[str, Any]) -> Iterator[str]:
    """Faults of a row: a spread whose low end is above its high end, a point that is both edge and tried wall."""
    if cells.get("edge") and cells.get("verdict"):
        yield (
            f"verdict: must be left empty where edge is {cells['edge']!r}, got {cells['verdict']!r}; a point lies "
            "on an edge, or is a wall that was tried"
        )
    for low, high in (SPREADS[:2], SPREADS[2:]):
        if cells.get(low, nan) > cells.get(high, nan):  # nan: left out
            yield f"{low}: must be at most {high} = {cells[high]:g}, got {cells[low]:g}"


def _column_indices(file: File, header: list[str], optional: Collection[str]) -> dict[str, int]:
    """Index of each required column, and of the optional ones that the file has."""
    if not header:
        raise FileError(f"{file}: is empty; its first line must name the columns {', '.join(COLUMNS)}")
    if fault := header_fault(header, COLUMNS, optional):
        raise FileError(f"{file}: line 1: {fault}")
    return {name: header.index(name) for name in (*COLUMNS, *optional) if name in header}


def _text(file: File) -> str:
    """The text of a file. Raises FileError with its name."""
    try:
        return read_text(file, LARGEST_TABLE, pipes=True)
    except FileError as error:
        raise FileError(f"{file}: {error}; give a CSV file") from None


EDGES: Final = ("lower", "upper", "tip", "")
VERDICTS: Final = ("stable", "unstable", "")


@dataclass(frozen=True)
class UserPoint:
    """A point that a user measured, on the stability boundary or a wall tried; nan, "" and 1 where not given.

    stiffness, damping          [N/m], [N s/m]
    edge     lower, upper, tip or "": the boundary was found here
    damping_low, damping_high   [N s/m];   stiffness_low, stiffness_high  [N/m]
    trials   number of trials of which it is the mean
    verdict  stable or unstable: result of a trial of this wall; "" for an edge
    Raises   ValueError  for another edge or verdict, or both
    """

    stiffness: float
    damping: float
    edge: str = ""
    damping_low: float = nan
    damping_high: float = nan
    stiffness_low: float = nan
    stiffness_high: float = nan
    trials: int = 1
    verdict: str = ""

    def __post_init__(self) -> None:
        check_choice("edge", self.edge, EDGES)
        check_choice("verdict", self.verdict, VERDICTS)
        if self.edge and self.verdict:
            raise ValueError(
                "a point lies on an edge, or is a wall that was tried: give edge or verdict, not both"
            )


@dataclass(frozen=True)
class ComparedPoint(Documented):
    """A measured point with the exact values that belong to it.

    exact          the damping of the nearest exact edge at its stiffness, of a tip the stiffness at its damping;
                   nan where the chart has no such edge
    exact_verdict  stable, unstable or undecided; None without a chart
    """

    point: UserPoint
    exact: float
    exact_verdict: str | None

    @property
    def deviation(self) -> float:
        """Distance from the exact edge: in stiffness for a tip [N/m], else in damping [N s/m]; nan if unknown."""
        return (self.point.stiffness if self.point.edge == "tip" else self.point.damping) - self.exact

    @property
    def agrees(self) -> bool | None:
        """Whether the measured verdict is the exact one; None where either is not known."""
        if not self.point.verdict or self.exact_verdict not in ("stable", "unstable"):
            return None
        return self.point.verdict == self.exact_verdict

    def document(self) -> dict[str, Any]:
        """The point by key and unit; None where it names no edge, or no verdict."""
        point, tip = self.point, self.point.edge == "tip"
        return {
            "stiffness_N_per_m": point.stiffness,
            "damping_Ns_per_m": point.damping,
            "edge": point.edge or None,
            "verdict": point.verdict or None,
            "trials": point.trials,
            "exact_stiffness_N_per_m": self.exact if tip else point.stiffness,
            "exact_damping_Ns_per_m": point.damping if tip else self.exact,
            "deviation_N_per_m": self.deviation if tip else 0.0,
            "deviation_Ns_per_m": 0.0 if tip else self.deviation,
            "exact_verdict": self.exact_verdict,
            "agrees": self.agrees,
        }


@dataclass(frozen=True)
class PointsComparison(Documented):
    """All points with their exact values, in the order in which they were given."""

    points: tuple[ComparedPoint, ...] = field(metadata=entry(name="measured"))

    @property
    def edges(self) -> list[ComparedPoint]:
        """Points of the boundary: those that name their edge."""
        return [one for one in self.points if one.point.edge]

    def walls(self, verdict: str) -> list[ComparedPoint]:
        """Walls that were tried and found stable, or unstable."""
        return [one for one in self.points if one.point.verdict == verdict]

    @property
    def unnamed(self) -> list[ComparedPoint]:
        """Points that name neither an edge nor a verdict."""
        return [one for one in self.points if not one.point.edge and not one.point.verdict]

    @property
    @documented(name="measured_counts")
    def counts(self) -> dict[str, int]:
        """How many points there are of each kind, and how many of them could be compared."""
        counts_by_key = {
            "edge_points": len(self.edges),
            "edge_points_compared": sum(not isnan(one.deviation) for one in self.edges),
        }
        for verdict in ("stable", "unstable"):
            walls = self.walls(verdict)
            counts_by_key[f"{verdict}_walls"] = len(walls)
            counts_by_key[f"{verdict}_walls_agreeing"] = sum(one.agrees is True for one in walls)
            counts_by_key[f"{verdict}_walls_disagreeing"] = sum(one.agrees is False for one in walls)
        counts_by_key["unnamed_points"] = len(self.unnamed)
        counts_by_key["unnamed_points_inside"] = sum(one.exact_verdict == "stable" for one in self.unnamed)
        return counts_by_key

    def table(self) -> dict[str, list[Any]]:
        """The points as columns, one point a row."""
        rows = [one.document() for one in self.points]
        return {key: [row[key] for row in rows] for key in (rows[0] if rows else ())}

    def __repr__(self) -> str:
        counts = self.counts
        walls = counts["stable_walls"] + counts["unstable_walls"]
        agreeing = counts["stable_walls_agreeing"] + counts["unstable_walls_agreeing"]
        return (
            f"PointsComparison: {counts['edge_points']} edge points, {counts['edge_points_compared']} compared; "
            f"{walls} walls, {agreeing} with their exact verdict; {counts['unnamed_points']} unnamed"
        )


def compare_points(chart: StabilityChart | None, points: Sequence[UserPoint]) -> PointsComparison:
    """Compare measured points with an exact chart; None: no point has an exact value."""
    if chart is None:
        return PointsComparison(tuple(ComparedPoint(point, nan, None) for point in points))
    from zwidth.chart.edge_crossings import exact_edge

    verdicts = chart.check([point.stiffness for point in points], [point.damping for point in points]).names
    compared = []
    for point, verdict in zip(points, verdicts, strict=True):
        edge: Any = point.edge or None
        exact = exact_edge(chart, point.stiffness, point.damping, edge)
        compared.append(ComparedPoint(point, exact, str(verdict)))
    return PointsComparison(tuple(compared))
