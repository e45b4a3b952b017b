"""A study's results as labelled arrays, as a document, and as a table."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.device.faults import plural
from zwidth.measures.definition import STATUS, Note
from zwidth.study.designs.axis_tables import unit_of
from zwidth.study.designs.column import unit_attributes
from zwidth.study.designs.sampling import Axis

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.study.designs.sweep import Sweep

DESIGN: Final = "design"
COMPONENTS: Final = "xyz"


def as_dataset(sweep: Sweep) -> xr.Dataset:
    """A study's values over its axes.

    A grid has a dimension for each axis, called by its key; other samplings have one, `design`. For each column
    NAME there are its values, nan where there is none, and NAME_status. Tied numbers, and the components of
    positions and directions, are further coordinates. Attributes of a column: unit, title, source, what is better,
    and `notes`, a line for each reason why designs have no value.
    """
    import xarray as xr

    sampling = sweep.job.sampling
    grid = sampling.kind == "grid"
    dims = tuple(axis.key for axis in sampling.axes) if grid else (DESIGN,)
    data: dict[str, Any] = {}
    for n, one in enumerate(sweep.job.columns):
        attributes = {
            **unit_attributes(one.unit),
            "title": one.title,
            "long_name": one.title,
            "source": one.measure.source,
            "better": one.better or "",
            "key": one.key,
            "notes": "\n".join(_sentence(sweep, note) for note in sweep.cells.notes[n]),
        }
        data[one.name] = (dims, sweep.cells.values[:, n].reshape(sampling.shape), attributes)
        data[f"{one.name}_status"] = (dims, sweep.cells.status[:, n].reshape(sampling.shape), _flags())
    coordinates: dict[str, Any] = {} if grid else {DESIGN: np.arange(sampling.count)}
    rows = None if grid else [sampling.values(n) for n in range(sampling.count)]
    for n, axis in enumerate(sampling.axes):
        values = list(axis.values) if rows is None else [row[n] for row in rows]
        dim = axis.key if grid else DESIGN
        coordinates |= {name: (dim, *column) for name, column in _columns(sweep, axis, values)}
    return xr.Dataset(data, coordinates, _attributes(sweep))


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
    """The designs, with values, status and notes of each measure, by key and unit; see `Sweep.document`."""
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
    """Column -> one entry for each design: its numbers, the values under names with units, the status."""
    designs = [sweep.design(n) for n in range(sweep.job.count)]
    settings = {path: [_cell(design[path]) for design in designs] for path in (designs[0] if designs else {})}
    columns = {one.key: list(sweep.cells.values[:, n]) for n, one in enumerate(sweep.job.columns)}
    status = {
        f"{one.name}_status": [STATUS[int(s)] for s in sweep.cells.status[:, n]]
        for n, one in enumerate(sweep.job.columns)
    }
    return settings | columns | status


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


def _flags() -> dict[str, Any]:
    meanings = " ".join(text.replace(" ", "_") for text in STATUS.values())
    return {"flag_values": np.array(list(STATUS), dtype=np.uint8), "flag_meanings": meanings}


def _attributes(sweep: Sweep) -> dict[str, Any]:
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
