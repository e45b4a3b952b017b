"""Walls from a CSV file, every fault with its line."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import islice
from typing import Final

from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import wall_number

COLUMNS: Final = ("stiffness_N_per_m", "damping_Ns_per_m")
MOST_FAULTS: Final = 20
LARGEST_FILE: Final = 200_000_000  # bytes; some millions of walls

Walls = list[tuple[float, float]]


def read_walls(file: str) -> Walls:
    """The walls (stiffness [N/m], damping [N s/m]) of a CSV file with these two columns; others are left alone.

    Raises BadInput  if it cannot be read, lacks a column or holds no wall, or with every line that is wrong
    """
    rows = csv.reader(_text(file).splitlines(), strict=True)
    faults: list[str] = []
    walls: Walls = []
    try:
        header = [name.strip() for name in next(_filled(rows), [])]
        places = _places(file, header)
        for row in _filled(rows):
            if len(row) > len(header):
                faults.append(
                    f"{file}: line {rows.line_num}: has {len(row)} cells, but the header names {len(header)} "
                    "columns; write a decimal point, not a comma, or name every column"
                )
                continue
            wall = []
            for name, place in zip(COLUMNS, places, strict=True):
                value, fault = wall_number(row[place].strip() if place < len(row) else "")
                wall.append(value)
                if fault:
                    faults.append(f"{file}: line {rows.line_num}: {name}: {fault}")
            walls.append((wall[0], wall[1]))
    except csv.Error as error:
        raise BadInput(f"{file}: line {rows.line_num}: is not CSV: {error}") from None
    if faults:
        more = [f"{file}: and {len(faults) - MOST_FAULTS} more faults"] if len(faults) > MOST_FAULTS else []
        raise BadInput(*islice(faults, MOST_FAULTS), *more)
    if not walls:
        raise BadInput(f"{file}: holds no walls; give a line with {' and '.join(COLUMNS)} for each")
    return walls


def _filled(rows: Iterator[list[str]]) -> Iterator[list[str]]:
    return (row for row in rows if any(cell.strip() for cell in row))


def _places(file: str, header: list[str]) -> list[int]:
    """Index of each column wanted."""
    if not header:
        raise BadInput(f"{file}: is empty; its first line must name the columns {', '.join(COLUMNS)}")
    faults = []
    for name in COLUMNS:
        if header.count(name) != 1:
            trouble = "is missing" if name not in header else "is there more than once"
            faults.append(f"{file}: line 1: column {name} {trouble}; the columns are {', '.join(header)[:200]}")
    if faults:
        raise BadInput(*faults)
    return [header.index(name) for name in COLUMNS]


def _text(file: str) -> str:
    try:
        with open(file, "rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise BadInput(f"{file}: cannot be read: {reason[:1].lower() + reason[1:]}; give a CSV file") from None
    if len(data) > LARGEST_FILE:
        raise BadInput(f"{file}: is larger than {LARGEST_FILE // 1_000_000} MB; split it")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(f"{file}: is not UTF-8 text (byte {error.start}); save it as CSV in UTF-8") from None
    if "\x00" in text:
        raise BadInput(f"{file}: is a binary file; give a CSV text file")
    return text
