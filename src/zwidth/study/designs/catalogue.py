"""Catalogues: tables of parts, such as motors or tubes, from which an axis of a study chooses one a design.

A CSV file with a line of headings. One column holds the names of the parts, the others their numbers.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from math import isnan
from pathlib import Path
from typing import Final, TypeAlias

from zwidth.device.faults import comma_list
from zwidth.device.text_file import LARGEST_TABLE, UnreadableFileError, read_text

NAMES: Final = "name"  # heading of the column of names
Part: TypeAlias = tuple[tuple[str, float], ...]  # path of the device file -> number


class CatalogueError(ValueError):
    """A catalogue that cannot be used; the text says why, and what to do."""


def read_catalogue(path: Path, columns: Mapping[str, str]) -> dict[str, Part]:
    """The parts of a catalogue by name, each with the numbers that it sets.

    columns  path of the device file -> heading of the column that holds its number
    Raises   CatalogueError  with all that is wrong, a line for each
    """
    try:
        text = read_text(path, LARGEST_TABLE)
    except UnreadableFileError as error:
        raise CatalogueError(str(error)) from None
    rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    if not rows:
        raise CatalogueError("is empty; write a line of headings, one of them 'name', and a line for each part")
    headings = [heading.strip() for heading in rows[0]]
    if len(headings) == 1 and ";" in headings[0]:
        raise CatalogueError("separates its columns by ';'; save it with commas, and numbers with decimal points")
    absent = [heading for heading in dict.fromkeys([NAMES, *columns.values()]) if heading not in headings]
    if absent:
        has = comma_list([repr(heading) for heading in headings])
        raise CatalogueError("\n".join(f"has no column {heading!r}; it has {has}" for heading in absent))
    twice = [heading for heading in dict.fromkeys(headings) if headings.count(heading) > 1]
    if twice:
        raise CatalogueError(f"has several columns {twice[0]!r}; give each a name of its own")
    return _parts(headings, rows[1:], columns)


def _parts(headings: list[str], rows: list[list[str]], columns: Mapping[str, str]) -> dict[str, Part]:
    parts: dict[str, Part] = {}
    wrong: list[str] = []
    for number, row in enumerate(rows, 1):
        if len(row) != len(headings):
            wrong.append(f"part {number} has {len(row)} cells, the line of headings {len(headings)}")
            continue
        cells = {heading: cell.strip() for heading, cell in zip(headings, row, strict=True)}
        name = cells[NAMES]
        if not name or name in parts:
            what = f"is called {name!r}, as one before it" if name else "has no name"
            wrong.append(f"part {number} {what}; give it a name of its own")
            continue
        numbers: list[tuple[str, float]] = []
        for path, heading in columns.items():
            value = _number(cells[heading])
            if value is None:
                wrong.append(f"part {name!r}: {heading} must be a number, got {cells[heading]!r}")
            else:
                numbers.append((path, value))
        parts[name] = tuple(numbers)
    if wrong:
        raise CatalogueError("\n".join(wrong))
    if not parts:
        raise CatalogueError("holds no part; write a line for each below the headings")
    return parts


def _number(text: str) -> float | None:
    """A cell's number; None where it holds none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return None if isnan(value) else value
