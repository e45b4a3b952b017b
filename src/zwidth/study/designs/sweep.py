"""Measures of many designs of one device: from Python, or as a study file says.

sweep(device, {"loop.sampling_period_s": [0.0005, 0.001]}, ["stiffness_max", "isotropy"])["stiffness_max"]
run_study("study.toml").dataset()["stiffness_max"]

The results are labelled arrays, a document, and a table. These list every design, and so must fit into memory.
`table_pieces` gives one piece after the other.

Extremes, and how many designs there are of each status, are found in one pass over them (`ColumnSummary`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.device.device import Device
from zwidth.device.faults import plural
from zwidth.measures.definition import OK, STATUS, Measure, Note
from zwidth.model.argument_checks import wrong_type
from zwidth.progress import Progress
from zwidth.resources import Processor, check_memory
from zwidth.result import Result
from zwidth.study.designs.axis_tables import unit_of
from zwidth.study.designs.column import unit_attributes
from zwidth.study.designs.sampling import Axis, settings
from zwidth.study.designs.study import Study
from zwidth.study.designs.study_file import read_study, study_over
from zwidth.study.designs.sweep_job import SweepJob, sweep_job
from zwidth.study.jobs.executor import Executor, run_job
from zwidth.study.jobs.job import Cells
from zwidth.study.jobs.store import Store
from zwidth.study.workspace.plane_grid import PlaneGrid
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from zwidth.loop.posed_device import Position
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
    """Attributes of the variable of a column, given by its number, in a dataset."""
    one = sweep.job.columns[column]
    return {
        **unit_attributes(one.unit),
        "title": one.title,
        "long_name": one.title,
        "source": one.measure.source,
        "better": one.better or "",
        "key": one.key,
        "notes": "\n".join(_note_sentence(sweep, note) for note in sweep.cells.notes[column]),
    }


def coordinates(sweep: Sweep, first: int, last: int) -> dict[str, Any]:
    """The coordinates of a dataset by name, as (dimension, values, attributes): of a grid all along its axes, else
    those of designs first to last - 1."""
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
        found |= {name: (dim, *column) for name, column in _axis_coordinates(sweep, axis, values)}
    return found


def _axis_coordinates(
    sweep: Sweep, axis: Axis, values: list[Any]
) -> Iterator[tuple[str, tuple[Any, dict[str, str]]]]:
    """Yield name, values and attributes of each coordinate of an axis: its values, their components, and the
    numbers tied to it.

    values  along the axis; one that is a position or direction is a tuple
    """
    attributes = {**unit_attributes(axis.unit), "long_name": axis.key, "scale": "log" if axis.log else "linear"}
    if values and isinstance(values[0], tuple):
        texts = {"long_name": axis.key, "role": "axis"}
        yield axis.key, (np.array([axis_value_text(value) for value in values]), texts)
        length = max(len(value) for value in values)
        # z of a vector in the plane is 0
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
        # a tied list has a coordinate for each of its numbers
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
    """Rows of the table as columns: designs from number `first` on, whose measures are `cells`."""
    piece: dict[str, Sequence[Any]] = {}
    for axis, values, places in sweep.job.sampling.columns(first, first + len(cells.values)):
        for key, along in ((axis.key, values), *((tie.key, map(tie.value, values)) for tie in axis.ties)):
            texts = [_table_cell(value) for value in along]
            piece[key] = [texts[place] for place in places.tolist()]
    for n, one in enumerate(sweep.job.columns):
        piece[one.key] = cells.values[:, n].tolist()
    for n, one in enumerate(sweep.job.columns):
        piece[f"{one.name}_status"] = [STATUS[status] for status in cells.status[:, n].tolist()]
    return piece


def note_sentences(sweep: Sweep) -> Iterator[tuple[str, str]]:
    """Name of a column, and why designs have no value in it: a sentence for each reason."""
    for name, notes in zip(sweep.job.measures, sweep.cells.notes, strict=True):
        yield from ((name, _note_sentence(sweep, note)) for note in notes)


def _table_cell(value: Any) -> Any:
    """A value as a cell of the table: lists as JSON."""
    return json.dumps(value) if isinstance(value, list | tuple) else value


def _note_sentence(sweep: Sweep, note: Note) -> str:
    """A note in words: number of designs, status, reason, and the values of the first of them along the axes."""
    sampling = sweep.job.sampling
    values = sampling.values(note.first[0])
    where = ", ".join(
        f"{axis.key} = {axis_value_text(value)}" for axis, value in zip(sampling.axes, values, strict=True)
    )
    many = plural(note.count, "design")
    return f"{many} {STATUS.get(note.status, 'ok')}: {note.reason}; first at {where}"


def status_flags() -> dict[str, Any]:
    """Attributes of a variable of status in a dataset."""
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
    """Extremes of one column of a study, and its designs by status.

    lowest, highest  value and number of the first design that has it; None where no design has a value
    counts           (256,)  number of designs by status
    """

    lowest: tuple[float, int] | None = None
    highest: tuple[float, int] | None = None
    counts: Ints = field(default_factory=lambda: np.zeros(256, dtype=np.int64))

    def add(self, first: int, values: Floats, status: NDArray[np.uint8]) -> None:
        """Add consecutive designs behind those added before: the number of the first, and values and status (k,)
        of the column."""
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


NO_DESIGN: Final = "no design has a value"
SHOWN: Final = 3  # columns of a repr


@dataclass(frozen=True, repr=False)
class Sweep(Result):
    """A study and its results.

    cells  values and status (designs, columns), in the designs' order; of a large study in its store
    """

    study: Study
    job: SweepJob
    cells: Cells

    def __repr__(self) -> str:
        axes = ", ".join(axis.key for axis in self.job.sampling.axes)
        lines = [f"Sweep: {plural(self.job.count, 'design')} of {self.study.device.label!r} over {axes}"]
        lines += [self._extremes_in_words(n) for n in range(len(self.job.columns))][:SHOWN]
        more = len(self.job.columns) - SHOWN
        return "\n  ".join([*lines, f"and {more} more"] if more > 0 else lines)

    @property
    def reason(self) -> str | None:
        """Why no design has a value: the first reason, or else their status; None where a design has one."""
        if any(one.counts[OK] for one in self.summaries):
            return None
        kinds = sorted({kind for one in self.summaries for kind, _ in one.by_status})
        status = ", ".join(STATUS[kind] for kind in kinds)
        return f"{NO_DESIGN}: {next((sentence for _, sentence in note_sentences(self)), status)}"

    @cached_property
    def summaries(self) -> tuple[ColumnSummary, ...]:
        """The extremes of each column, and how many designs there are of each status."""
        return summaries(self.cells, len(self.job.columns))

    def design(self, number: int) -> dict[str, Any]:
        """Path -> value of each number and circumstance that a design sets, by its number from 0; and the
        part of each catalogue."""
        sampling = self.job.sampling
        values = sampling.values(number)
        parts = {axis.key: value for axis, value in zip(sampling.axes, values, strict=True) if axis.parts}
        return parts | dict(settings(sampling.axes, values))

    def dataset(self) -> xr.Dataset:
        """The values over the axes, with units and the study; see `sweep_dataset`."""
        return sweep_dataset(self)

    def document(self) -> dict[str, Any]:
        """The designs with their values and status by key, lists of one entry for each design."""
        return sweep_document(self)

    def table(self) -> dict[str, list[Any]]:
        """The designs as columns, one design a row."""
        return sweep_table(self)

    def _extremes_in_words(self, column: int) -> str:
        """A column in words: its least and largest value, and how many designs have one."""
        one, summary = self.job.columns[column], self.summaries[column]
        span = ""
        if summary.lowest is not None and summary.highest is not None:
            span = f"{summary.lowest[0]:.4g} to {summary.highest[0]:.4g} {unit_text(one.unit)}".rstrip() + ", "
        return f"{one.name}: {span}{summary.counts[OK]} of {self.job.count} have a value"


def sweep(
    device: Device,
    axes: Mapping[str, Sequence[Any] | ArrayLike],
    measures: str | Measure | Sequence[str | Measure],
    *,
    position: Position | None = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
    stiffness: float | None = None,
    damping: float | None = None,
    frequency: float | None = None,
    spectral_radius: float | None = None,
    stiffness_margin: float | None = None,
    damping_margin: float | None = None,
    delay_margin: float | None = None,
    lowest_frequency: float | None = None,
    highest_frequency: float | None = None,
    force: float | None = None,
    link_radius: float | None = None,
    colliding_links: Sequence[str] | None = None,
    paired: bool = False,
    plane: PlaneGrid | None = None,
    user_measures: Mapping[str, Measure] | None = None,
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    processor: Processor = "cpu",
    time_limit: float | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Measures of a device with every combination of other numbers, or with those of paired axes.

        sweep(device, {"loop.sampling_period_s": [0.0005, 0.001]}, ["stiffness_max", "isotropy"])

    axes           path -> values, as in `Device.with_`; or a circumstance -> values: at, direction, assembly,
                   model, operator (names, files, "none"), and of the wanted wall stiffness_N_per_m,
                   damping_Ns_per_m, frequency_Hz and the other numbers of `questions.WANTED`
    measures       one or several: names such as "isotropy" or, over the workspace, "average(isotropy)"; or
                   measures
    position, direction, assembly, model    of all designs, as for `Device.at`
    stiffness, damping, frequency           of the wanted wall [N/m], [N s/m], and of the hand [Hz], for measures
                                                about them
    spectral_radius ... colliding_links     what else some measures need, as in `measures.definition.WantedWall`
    paired         True: not every combination, but as many designs as each axis has values: the n-th design has
                   the n-th value of every axis, such as numbers drawn at random
    plane          the workspace, for measures over it (`study.workspace.plane_grid`); left out: 15 by 15 points of
                   the device's own
    user_measures  measures of a user's own, by name (`measures.user_measures.load_measures`)
    store          a folder that keeps what is done, so that the same call goes on from there after it was stopped
    progress       is called with the stage, the number of designs done, and of all designs
    workers        largest number of processes; left out: one for each core
    time_limit     time after which a design or cell is given up [s]: it is `out of time`, the others keep their
                   values
    cluster        address of a scheduler of dask.distributed, or "local"; left out: processes of this computer
    executor       what computes, opened before for many calls (`study.open_executor`), in place of workers,
                   time_limit and cluster
    processor      where charts are computed; "cuda": on an NVIDIA GPU, by one process (`resources`); else "cpu"
    Returns        a dataset with a dimension for each axis, named by its path, or with the one dimension `design`
                   of paired axes: for each measure its values, nan where a design has none, and NAME_status. Why
                   they have none stands in the attribute `notes`
    Raises         DeviceError   with all faults of the arguments and the device
                   MeasureError  for measures that do not exist for this device
                   TooLarge      where the designs would not fit into memory
                   TypeError     for arguments of another kind
                   what `executor.run_job` and `Store` raise
    """
    study = study_over(
        device,
        axes,
        measures,
        position=position,
        direction=direction,
        assembly=assembly,
        model=model,
        stiffness=stiffness,
        damping=damping,
        frequency=frequency,
        spectral_radius=spectral_radius,
        stiffness_margin=stiffness_margin,
        damping_margin=damping_margin,
        delay_margin=delay_margin,
        lowest_frequency=lowest_frequency,
        highest_frequency=highest_frequency,
        force=force,
        link_radius=link_radius,
        colliding_links=colliding_links,
        paired=paired,
        plane=plane,
        user_measures=user_measures,
    )
    job = sweep_job(study)
    check_listing(job)
    return compute_designs(
        study,
        job,
        store,
        progress,
        workers,
        processor,
        time_limit=time_limit,
        cluster=cluster,
        executor=executor,
    ).dataset()


def run_study(
    study: Study | str | os.PathLike[str],
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    processor: Processor = "cpu",
    *,
    time_limit: float | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
) -> Sweep:
    """Compute a study, read by `read_study` or named by its file.

    store, progress, workers, processor, time_limit, cluster, executor  as for `sweep`
    Returns the study with its results. Of a large study with a store they stay there: `reason`, `summaries` and
            `cells.pieces()` read one piece after the other; `dataset`, `document` and `table` list all designs
    Raises  DeviceError   with all faults of the study's file and the device's
            MeasureError  for measures that do not exist for this device
            TooLarge      where the designs would not fit into memory, and there is no store
            what `executor.run_job` and `Store` raise
    """
    if not isinstance(study, Study | str | os.PathLike):
        hint = "write sweep(device, {path: values}, measures)" if isinstance(study, Device) else ""
        raise wrong_type("study", "a Study or the path of a study file", study, hint)
    study = study if isinstance(study, Study) else read_study(study)
    job = sweep_job(study)
    return compute_designs(
        study,
        job,
        store,
        progress,
        workers,
        processor,
        time_limit=time_limit,
        cluster=cluster,
        executor=executor,
    )


def compute_designs(
    study: Study,
    job: SweepJob,
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    processor: Processor = "cpu",
    *,
    time_limit: float | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
) -> Sweep:
    """Compute the designs of a study as its job; see `executor.run_job` for the rest."""
    cells = run_job(
        job,
        store,
        progress,
        workers,
        processor=processor,
        stage="computing designs",
        time_limit=time_limit,
        cluster=cluster,
        executor=executor,
    )
    return Sweep(study, job, cells)
