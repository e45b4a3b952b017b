"""A study's results as labelled arrays, as a document, and as a table.

These list every design, and so must fit into memory. `table_pieces` gives one piece after the other.

What a study's designs come to, found in one pass over them: extremes, and how many there are of each status.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.device.faults import plural
from zwidth.measures.definition import OK, STATUS, Note
from zwidth.memory_limit import check_memory
from zwidth.study.designs.axis_tables import unit_of
from zwidth.study.designs.column import unit_attributes
from zwidth.study.designs.sampling import Axis
from zwidth.study.jobs.job import Cells

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.study.designs.sweep import Sweep
    from zwidth.study.designs.sweep_job import SweepJob
    from zwidth.study.jobs.job import CellValues


PER_VALUE: Final = 3  # numbers of memory for each value: the value, its status, and a copy while the table is made
PER_AXIS: Final = 12  # numbers of memory for each axis of a design, whose values are kept as they are written
PER_DESIGN: Final = 120  # numbers of memory for the dictionaries of a design in a document
DESIGN: Final = "design"
COMPONENTS: Final = "xyz"


def check_listing(job: SweepJob, documents: bool = False) -> None:
    """Raise TooLarge where the designs would not fit into memory, all listed at once.

    documents  whether each is a dictionary
    """
    axes = job.sampling.axes
    each = PER_VALUE * len(job.columns) + PER_AXIS * (len(axes) + sum(len(axis.ties) for axis in axes))
    check_memory(
        float(job.count) * (each + PER_DESIGN * documents),
        f"{plural(job.count, 'design')} of {plural(len(job.columns), 'measure')}, listed all at once,",
        "ask for fewer, or keep them on the disk (.zarr, .csv), which is written piece by piece",
    )


def sweep_dataset(sweep: Sweep) -> xr.Dataset:
    """A study's values over its axes.

    A grid has a dimension for each axis, called by its key; other samplings have one, `design`. For each column
    NAME there are its values, nan where there is none, and NAME_status. Tied numbers, and the components of
    positions and directions, are further coordinates. Attributes of a column: unit, title, source, what is better,
    and `notes`, a line for each reason why designs have no value.
    Raises  TooLarge  where they would not fit into memory
    """
    import xarray as xr

    check_listing(sweep.job)
    sampling = sweep.job.sampling
    grid = sampling.kind == "grid"
    dims = tuple(axis.key for axis in sampling.axes) if grid else (DESIGN,)
    data: dict[str, Any] = {}
    for n, one in enumerate(sweep.job.columns):
        data[one.name] = (dims, sweep.cells.values[:, n].reshape(sampling.shape), column_attributes(sweep, n))
        data[f"{one.name}_status"] = (dims, sweep.cells.status[:, n].reshape(sampling.shape), status_flags())
    return xr.Dataset(data, coordinates(sweep, 0, sampling.count), dataset_attributes(sweep))


def column_attributes(sweep: Sweep, column: int) -> dict[str, str]:
    """What a dataset says of a column."""
    one = sweep.job.columns[column]
    return {
        **unit_attributes(one.unit),
        "title": one.title,
        "long_name": one.title,
        "source": one.measure.source,
        "better": one.better or "",
        "key": one.key,
        "notes": "\n".join(_sentence(sweep, note) for note in sweep.cells.notes[column]),
    }


def coordinates(sweep: Sweep, first: int, last: int) -> dict[str, Any]:
    """The coordinates of a dataset: of a grid all along its axes, else those of designs first to last - 1."""
    sampling = sweep.job.sampling
    if sampling.kind == "grid":
        along = [(axis.key, axis, list(axis.values)) for axis in sampling.axes]
        found: dict[str, Any] = {}
    else:
        along = [
            (DESIGN, axis, [values[place] for place in places.tolist()])
            for axis, values, places in sampling.columns(first, last)
        ]
        found = {DESIGN: np.arange(first, last)}
    for dim, axis, values in along:
        found |= {name: (dim, *column) for name, column in _columns(sweep, axis, values)}
    return found


def _columns(sweep: Sweep, axis: Axis, values: list[Any]) -> Iterator[tuple[str, tuple[Any, dict[str, str]]]]:
    """The coordinates of an axis: its values, their components, and the numbers tied to it."""
    attributes = {**unit_attributes(axis.unit), "long_name": axis.key, "scale": "log" if axis.log else "linear"}
    if values and isinstance(values[0], tuple):
        texts = {"long_name": axis.key, "role": "axis"}
        yield axis.key, (np.array([axis_value_text(value) for value in values]), texts)
        length = max(len(value) for value in values)
        padded = np.array([[*value, *[0.0] * (length - len(value))] for value in values])
        for n in range(length):
            yield f"{axis.key}_{COMPONENTS[n]}", (padded[:, n], attributes)
    else:
        yield axis.key, (np.array(values), attributes | {"role": "axis"})
    for key, each in axis.columns(values):
        if key == axis.key:
            continue
        tied = np.array(each)
        unit = unit_of(sweep.study.device.document, key)
        for place in np.ndindex(tied.shape[1:]):
            path = ".".join([key, *map(str, place)])
            yield path, (tied[(slice(None), *place)], {**unit_attributes(unit), "long_name": path})


def axis_value_text(value: Any) -> str:
    """An axis's value as a text.

    >>> axis_value_text((0.0, 0.25)), axis_value_text("rigid"), axis_value_text(0.1 + 0.2)
    ('0, 0.25', 'rigid', '0.3')
    """
    if isinstance(value, tuple):
        return ", ".join(axis_value_text(part) for part in value)
    return value if isinstance(value, str) else f"{value:.6g}"


def sweep_document(sweep: Sweep) -> dict[str, Any]:
    """The designs, with values, status and notes of each measure, by key and unit; see `Sweep.document`.

    Raises  TooLarge  where they would not fit into memory
    """
    check_listing(sweep.job, documents=True)
    sampling, names = sweep.job.sampling, sweep.job.measures
    status = ([STATUS[int(s)] for s in row] for row in sweep.cells.status)
    return {
        "sampling": sampling.kind,
        "seed": sampling.seed if sampling.kind == "latin-hypercube" else None,
        "axes": [
            {"key": axis.key, "unit": axis.unit or None}
            | ({"values": axis.values} if sampling.size is None or axis.span is None else {"range": axis.span})
            | {"tied": [key for key in axis.keys if key != axis.key]}
            for axis in sampling.axes
        ],
        "units": {column.name: column.unit or None for column in sweep.job.columns},
        "designs": [sweep.design(n) for n in range(sweep.job.count)],
        "values": [dict(zip(names, map(float, row), strict=True)) for row in sweep.cells.values],
        "status": [dict(zip(names, row, strict=True)) for row in status],
        "notes": [f"{name}: {sentence}" for name, sentence in note_sentences(sweep)],
    }


def sweep_table(sweep: Sweep) -> dict[str, list[Any]]:
    """Column -> one entry for each design: its numbers, the values under names with units, the status.

    Raises  TooLarge  where they would not fit into memory
    """
    check_listing(sweep.job)
    whole: dict[str, list[Any]] = {}
    for piece in table_pieces(sweep):
        for name, values in piece.items():
            whole.setdefault(name, []).extend(values)
    return whole


def table_pieces(sweep: Sweep) -> Iterator[dict[str, Sequence[Any]]]:
    """The rows of the table in pieces, one after the other, each as columns."""
    return (_table_piece(sweep, first, cells) for first, cells in sweep.cells.pieces())


def _table_piece(sweep: Sweep, first: int, cells: CellValues) -> dict[str, Sequence[Any]]:
    piece: dict[str, Sequence[Any]] = {}
    for axis, values, places in sweep.job.sampling.columns(first, first + len(cells.values)):
        for key, along in ((axis.key, values), *((tie.key, map(tie.value, values)) for tie in axis.ties)):
            texts = [_cell(value) for value in along]
            piece[key] = [texts[place] for place in places.tolist()]
    for n, one in enumerate(sweep.job.columns):
        piece[one.key] = cells.values[:, n].tolist()
    for n, one in enumerate(sweep.job.columns):
        piece[f"{one.name}_status"] = [STATUS[status] for status in cells.status[:, n].tolist()]
    return piece


def note_sentences(sweep: Sweep) -> Iterator[tuple[str, str]]:
    """Name of a column, and why designs have no value in it: a sentence for each reason."""
    for name, notes in zip(sweep.job.measures, sweep.cells.notes, strict=True):
        yield from ((name, _sentence(sweep, note)) for note in notes)


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, list | tuple) else value


def _sentence(sweep: Sweep, note: Note) -> str:
    """A reason, how many designs it is of, and the first of them."""
    sampling = sweep.job.sampling
    values = sampling.values(note.first[0])
    where = ", ".join(
        f"{axis.key} = {axis_value_text(value)}" for axis, value in zip(sampling.axes, values, strict=True)
    )
    many = plural(note.count, "design")
    return f"{many} {STATUS.get(note.status, 'ok')}: {note.reason}; first at {where}"


def status_flags() -> dict[str, Any]:
    """What a dataset says of a column of status."""
    meanings = " ".join(text.replace(" ", "_") for text in STATUS.values())
    return {"flag_values": np.array(list(STATUS), dtype=np.uint8), "flag_meanings": meanings}


def dataset_attributes(sweep: Sweep) -> dict[str, Any]:
    """The study and its device, as attributes that any file can hold."""
    from zwidth._version import __version__

    device = sweep.study.device
    return {
        "name": device.name,
        "device": device.label,
        "study": json.dumps(sweep.study.document),
        "device_file": json.dumps(device.document),
        "operator": device.operator_name or "none",
        **({} if device.load is None else {"load": device.load.text("N m" if sweep.study.turns else "N")}),
        "zwidth": __version__,
    }


@dataclass
class ColumnSummary:
    """One column of a study.

    lowest, highest  value and number of the first design that has it; None where no design has a value
    counts           (256,)  number of designs by status
    """

    lowest: tuple[float, int] | None = None
    highest: tuple[float, int] | None = None
    counts: Ints = field(default_factory=lambda: np.zeros(256, dtype=np.int64))

    def add(self, first: int, values: Floats, status: NDArray[np.uint8]) -> None:
        """Add consecutive designs, the first of them by its number, in ascending order."""
        self.counts += np.bincount(status, minlength=256)
        there = np.flatnonzero(status == OK)
        if not len(there):
            return
        low, high = int(there[np.argmin(values[there])]), int(there[np.argmax(values[there])])
        if self.lowest is None or values[low] < self.lowest[0]:
            self.lowest = float(values[low]), first + low
        if self.highest is None or values[high] > self.highest[0]:
            self.highest = float(values[high]), first + high

    @property
    def by_status(self) -> Iterator[tuple[int, int]]:
        """Each status that there is, and the number of its designs."""
        return ((int(status), int(self.counts[status])) for status in np.flatnonzero(self.counts))


def summaries(cells: Cells, columns: int) -> tuple[ColumnSummary, ...]:
    """The summary of each column; of stored cells one piece after the other is in memory.

    >>> from zwidth.study.jobs.job import CellValues
    >>> cells = CellValues(np.array([[3.0], [1.0]]), np.zeros((2, 1), np.uint8), ((),))
    >>> summaries(cells, 1)[0].lowest
    (1.0, 1)
    """
    found = tuple(ColumnSummary() for _ in range(columns))
    for first, piece in cells.pieces():
        for n, one in enumerate(found):
            one.add(first, piece.values[:, n], piece.status[:, n])
    return found
