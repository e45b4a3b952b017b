"""A table of safe walls as a C99 header without dependencies, which is C++ as well, and an Arduino sketch.

The program looks up a cell and reads numbers of 32 bits that are rounded to the safe side; it allocates nothing
and calls no library. What it computes is what `SafeWalls.at` and `SafeWalls.damping_at` compute, bit for bit
where a double has 64 bits. Where it has 32, as on 8-bit boards, a position beside a border may fall into the
neighbouring cell, and a stiffness beside a level into the neighbouring band: cells and bands overlap by more than
that.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from zwidth._version import __version__
from zwidth.device.faults import comma_list
from zwidth.errors import OutputError
from zwidth.loop.controller import Controller
from zwidth.show.circumstances import wall_law_parts
from zwidth.show.output import printable, write_text
from zwidth.study.wall_tables.table import EVERYWHERE, SafeWalls

WIDTH: Final = 110  # letters of a line of numbers
AVR_REACH: Final = 32767  # bytes of one array that compilers of 8-bit boards allow
# Bytes that 16-bit addresses of program memory reach. Beyond them a board reads other cells than it is asked for,
# and says nothing.
ADDRESSES: Final = 65536
# Of these, what else lies before the tables: vectors, jumps, and tables of the board's own library (Mega: 1 kB).
BESIDE: Final = 2048
HEADER_NAME: Final = "safe_walls.h"


def header_text(table: SafeWalls) -> str:
    """The text of the header that holds this table."""
    template = _TEMPLATES / "safe_walls.h.txt"
    text = template.read_text(encoding="utf-8")
    for key, value in _fields(table).items():
        text = text.replace(f"@{key}@", value)
    return text


def sketch_text(table: SafeWalls) -> str:
    """An Arduino sketch that includes the header and clamps the gains of a wall by it.

    Raises  OutputError  where it would compute another loop than the table is about, see `sketch_obstacle`
    """
    if obstacle := sketch_obstacle(table.device.controller):
        raise OutputError(obstacle)
    text = (_TEMPLATES / "sketch.ino.txt").read_text(encoding="utf-8")
    coordinates = max(table.grid.dimensions, 1)
    fields = {
        "NAME": _comment(table.device.name),
        "TIMING": _timing(table.device.controller),
        "COORDINATES": str(coordinates),
        "PERIOD_US": f"{round(1e6 * float(table.device.controller.sampling_period))}UL",
        "STIFFNESS": _c_double(_starting_stiffness(table)),
        "HEADER": HEADER_NAME,
    }
    for key, value in fields.items():
        text = text.replace(f"@{key}@", value)
    return text


def sketch_obstacle(controller: Controller) -> str:
    """Why no sketch can be written for a computer: a sketch has the backward difference, and nothing else.

    Returns  a sentence; "" where the sketch computes the loop of the file. A lag of the actuator does not count,
             since it lies behind the computer.
    """
    of_sketch = Controller(controller.sampling_period, controller.delay, force_limit=controller.force_limit)
    of_file = replace(controller, actuator_time_constant=0.0)
    if of_file == of_sketch:
        return ""
    parts = wall_law_parts(of_file, spell_out=True)
    return (
        "the sketch computes a wall by the backward difference, not filtered, and the file has "
        f"{comma_list(parts)}: its walls are those of another loop; export the header alone and compute that loop "
        "yourself, or take the parts out of the file with --set"
    )


def write_sketch(folder: Path, table: SafeWalls) -> None:
    """Write the sketch, named as its folder as Arduino wants it, and the header beside it.

    Raises  OutputError  where the folder cannot be made or written to, and what `sketch_text` raises
    """
    sketch = sketch_text(table)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"{printable(str(folder))}: cannot be made: {reason[:1].lower() + reason[1:]}; name another folder"
        ) from None
    write_text(folder / f"{folder.name}.ino", sketch)
    write_text(folder / HEADER_NAME, header_text(table))


_TEMPLATES: Final = Path(__file__).parent / "safe_walls"


def _fields(table: SafeWalls) -> dict[str, str]:
    """Text for each @KEY@ of the header's template."""
    grid, question = table.grid, table.question
    dimensions = grid.dimensions
    loop = table.device.controller
    low, high = table.ranges[..., 0].ravel(), table.ranges[..., 1].ravel()  # damping in each band [N s/m]
    return {
        "VERSION": __version__,
        "NAME": _comment(table.device.name),
        "HANDS": _comment(", ".join(table.hands)),
        "TIMING": _timing(loop),
        "MARGIN": f"{question.margin:g}",
        "BYTES": str(table.size),
        "WHERE": _position_comment(table),
        "DIRECTION": _direction_comment(table),
        "DIMENSIONS": str(dimensions),
        "CELLS": f"{grid.count}UL",
        "TABLES": f"{question.slots}UL",
        "LEVELS": f"{table.levels}UL",
        "PARTS": f"{table.sectors.parts}UL",
        "OUTSIDE": ", ".join(map(_c_double, (table.outside.stiffness, table.outside.low, table.outside.high))),
        "TOO_LARGE": _size_check(max(table.top.size, low.size) * 4),
        "MOST_BYTES": f"{ADDRESSES - BESIDE}UL",
        "GRID": "" if dimensions == 0 else _grid_arrays(table),
        "CELL": _ONE_CELL if dimensions == 0 else _CELL,
        "SECTOR": _SECTOR if question.slots > 1 else _NO_SECTOR,
        "LEVEL": _array("unsigned char", "zwidth_level", [f"{int(one)}U" for one in table.level]),
        "TOP": _array("float", "zwidth_top", map(_c_float, table.top.ravel())),
        "LOW": _array("float", "zwidth_low", map(_c_float, low)),
        "HIGH": _array("float", "zwidth_high", map(_c_float, high)),
    }


def _timing(controller: Controller) -> str:
    """Sampling, delay, estimator, filters and further feedback, for a comment."""
    return _comment(", ".join([controller.timing_text, *wall_law_parts(controller, spell_out=True)]))


def _position_comment(table: SafeWalls) -> str:
    """Sentences on the position that the program reads: coordinates, their cells, and where they lie."""
    grid = table.grid
    if not grid.dimensions:
        return "They hold everywhere: the position is not read and may be a null pointer."
    parts = [
        f"{_comment(name)} from {low:.9g} to {high:.9g} in {count}"
        for name, low, high, count in zip(grid.names, grid.low, grid.high, grid.counts, strict=True)
    ]
    base = np.eye(3)[: grid.dimensions]
    along = ""
    if not np.array_equal(grid.axes, base) or grid.through.any():
        vectors = "; ".join(
            f"{name} along " + ", ".join(f"{c:.9g}" for c in axis) for name, axis in _named_axes(table)
        )
        point = ", ".join(f"{c:.9g}" for c in grid.through)
        along = f"\n   In the device's base frame they are {vectors}; their origin is at {point} [m]."
    return f"The position has {grid.dimensions} coordinates [m], and cells: {', '.join(parts)}.{along}"


def _named_axes(table: SafeWalls) -> Iterable[tuple[str, Any]]:
    """Name and unit vector (3,) of each axis of the table."""
    return zip(table.grid.names, table.grid.axes, strict=True)


def _direction_comment(table: SafeWalls) -> str:
    """Sentence on the direction that the program reads."""
    if table.question.slots == 1:
        return "The direction is not read and may be a null pointer: the range holds along every direction."
    return (
        f"The direction has {table.grid.dimensions} components along the axes of the position, "
        f"any length but zero and no component beyond 1e30;\n   a null pointer: every direction. There are "
        f"{table.sectors.count} sectors of directions, each with its opposite."
    )


def _size_check(size: int) -> str:
    """An #error for 8-bit boards where an array of `size` bytes is more than their compilers allow; else ""."""
    if size <= AVR_REACH:
        return ""
    return '#error "a table of more than 32767 bytes is beyond what 8-bit boards read; export fewer cells"\n'


def _grid_arrays(table: SafeWalls) -> str:
    """Arrays of the grid in C: lowest coordinates [m], cells per metre, and numbers of cells, along each axis."""
    grid = table.grid
    per_metre = ", ".join(_c_double(1.0 / float(step)) for step in grid.step)
    return (
        f"static const double zwidth_low_m[{grid.dimensions}] = {{{', '.join(map(_c_double, grid.low))}}};\n"
        f"static const double zwidth_cells_per_m[{grid.dimensions}] = {{{per_metre}}};\n"
        f"static const unsigned long zwidth_counts[{grid.dimensions}] = "
        f"{{{', '.join(f'{count}UL' for count in grid.counts)}}};\n"
    )


def _array(kind: str, name: str, values: Iterable[str]) -> str:
    """The C text of a constant array in the board's program memory.

    kind    C type of its elements;   values  each element as C text
    """
    listed = list(values)
    lines, line = [], ""
    for value in listed:
        if len(line) + len(value) > WIDTH:
            lines.append(line)
            line = ""
        line += f"{value}, "
    lines.append(line)
    body = "\n  ".join(row.rstrip() for row in lines)
    # without the last comma
    return f"static const {kind} {name}[{len(listed)}] ZWIDTH_TABLE = {{\n  {body[:-1]}\n}};\n"


def _c_float(value: float) -> str:
    """A number as a C constant of 32 bits; nine digits name it exactly."""
    return f"{_with_point(f'{float(value):.9g}')}f"


def _c_double(value: float) -> str:
    """A number as a C constant of 64 bits."""
    return _with_point(repr(float(value)))


def _with_point(text: str) -> str:
    """The text of a number, with ".0" where C would read it as a whole number."""
    return text if any(mark in text for mark in ".e") else f"{text}.0"


def _comment(text: str) -> str:
    """The text for a C comment: in ASCII, on one line, without what ends or begins a comment or a trigraph."""
    plain = printable(text).encode("ascii", "backslashreplace").decode()
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")


def _starting_stiffness(table: SafeWalls) -> float:
    """Stiffness that the sketch begins with [N/m]: in one digit, the median of the cells that have safe walls."""
    stiffness: Sequence[float] = table.rectangles[table.level > 0, EVERYWHERE].tolist() or [0.0]
    return float(f"{float(np.median(stiffness)):.0e}")


_CELL: Final = """\
  unsigned long cell = 0UL;
  unsigned long stride = 1UL;
  int axis;
  for (axis = 0; axis < ZWIDTH_DIMENSIONS; ++axis) {
    const double place = (position[axis] - zwidth_low_m[axis]) * zwidth_cells_per_m[axis];
    unsigned long along;
    if (!((place >= 0.0) && (place <= (double)zwidth_counts[axis]))) { /* not a number, too */
      return ZWIDTH_CELLS;
    }
    along = (unsigned long)place;
    if (along >= zwidth_counts[axis]) {
      along = zwidth_counts[axis] - 1UL;
    }
    cell += stride * along;
    stride *= zwidth_counts[axis];
  }
"""
_ONE_CELL: Final = """\
  const unsigned long cell = 0UL;
  (void)position;
"""
_SECTOR: Final = """\
  unsigned long sector = 0UL;
  unsigned long stride = 1UL;
  double longest = 0.0;
  int face = 0;
  int k;
  if (direction == (const double *)0) {
    return 0UL;
  }
  for (k = 0; k < ZWIDTH_DIMENSIONS; ++k) {
    const double size = (direction[k] < 0.0) ? -direction[k] : direction[k];
    if (!(size <= 1.0e30)) { /* not a number, too */
      return 0UL;
    }
    if (size > longest) {
      longest = size;
      face = k;
    }
  }
  if (!(longest > 0.0)) {
    return 0UL;
  }
  for (k = 1; k < ZWIDTH_DIMENSIONS; ++k) {
    const double share = direction[(face + k) % ZWIDTH_DIMENSIONS] / direction[face];
    unsigned long piece = (unsigned long)(0.5 * (share + 1.0) * (double)ZWIDTH_PARTS);
    if (piece >= ZWIDTH_PARTS) {
      piece = ZWIDTH_PARTS - 1UL;
    }
    sector += stride * piece;
    stride *= ZWIDTH_PARTS;
  }
  return 1UL + (unsigned long)face * stride + sector;
"""
_NO_SECTOR: Final = """\
  (void)direction;
  return 0UL;
"""
