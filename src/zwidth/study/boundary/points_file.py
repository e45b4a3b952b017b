"""Read walls, or measured points of a stability boundary, from a CSV file; every fault is named with its line."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from itertools import islice
from math import isfinite, nan
from typing import Any, Final

from zwidth.device.text_file import (
    LARGEST_TABLE,
    SEPARATORS,
    UnreadableFileError,
    header_fault,
    non_blank_rows,
    read_text,
)
from zwidth.study.boundary.user_points import EDGES, VERDICTS, UserPoint

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


class PointsError(ValueError):
    """A file of walls or points with faults; `lines` holds one message each, with the file and the line."""

    def __init__(self, *lines: str) -> None:
        self.lines = lines
        super().__init__("\n".join(lines))


def wall_number(text: str) -> tuple[float, str]:
    """Read a wall's stiffness or damping; returns the number, and what is wrong with it ("" if nothing)."""
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

    Raises PointsError  if it cannot be read, lacks a column or holds no wall, or with every line that is wrong
    """
    return [(row[COLUMNS[0]], row[COLUMNS[1]]) for row in _read(file, {})]


def read_points(file: File) -> list[UserPoint]:
    """Measured points: a CSV file as for `read_walls`, with columns that may be left out, and cells left empty.

    Raises PointsError  as `read_walls`
    """
    optional: dict[str, Reader] = {
        "edge": partial(_word, EDGES),
        "verdict": partial(_word, VERDICTS),
        **dict.fromkeys(SPREADS, _spread),
        "trials": _trials,
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
        for row in _read(file, optional)
    ]


def _word(allowed: tuple[str, ...], text: str) -> tuple[str, str]:
    return text, "" if text in allowed else f"must be {', '.join(allowed[:-1])} or nothing, got {text[:60]!r}"


def _spread(text: str) -> tuple[float, str]:
    return wall_number(text) if text else (nan, "")


def _trials(text: str) -> tuple[int, str]:
    if not text or (text.isdecimal() and len(text) < MOST_DIGITS and int(text) > 0):
        return int(text or 1), ""
    return 1, f"must be a whole number from 1 on, got {text[:60]!r}"


def _read(file: File, optional: Mapping[str, Reader]) -> list[dict[str, Any]]:
    """The rows, each as column -> value; of the optional columns those that the file has."""
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
        raise PointsError(f"{file}: line {rows.line_num}: is not CSV: {error}") from None
    if faults:
        more = [f"{file}: and {len(faults) - MOST_FAULTS} more faults"] if len(faults) > MOST_FAULTS else []
        raise PointsError(*islice(faults, MOST_FAULTS), *more)
    if not cells_of_rows:
        raise PointsError(f"{file}: holds no walls; give a line with {' and '.join(COLUMNS)} for each")
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
        raise PointsError(f"{file}: is empty; its first line must name the columns {', '.join(COLUMNS)}")
    if fault := header_fault(header, COLUMNS, optional):
        raise PointsError(f"{file}: line 1: {fault}")
    return {name: header.index(name) for name in (*COLUMNS, *optional) if name in header}


def _text(file: File) -> str:
    try:
        return read_text(file, LARGEST_TABLE, pipes=True)
    except UnreadableFileError as error:
        raise PointsError(f"{file}: {error}; give a CSV file") from None
