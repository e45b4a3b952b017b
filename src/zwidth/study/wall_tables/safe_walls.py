"""Safe walls over a device's workspace, for a haptic loop to clamp its gains by.

The cells of a table are a job (`SafeWallsJob`), so that a long one is stored and continued.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, Final

import numba
import numpy as np

from zwidth.argument import check_arguments
from zwidth.device.device import Device
from zwidth.device.load import NOBODY
from zwidth.errors import Advice, WorkspaceError
from zwidth.measures.definition import OK, STATUS, Note
from zwidth.model.argument_checks import check_kind, wrong_type
from zwidth.progress import Progress
from zwidth.questions import EXPORT
from zwidth.study.jobs.executor import run_job
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.jobs.store import Store
from zwidth.study.wall_tables.cell_walls import CellQuestion, cell_walls
from zwidth.study.wall_tables.grid import Sectors, cells_of
from zwidth.study.wall_tables.table import SafeWalls, table_of_cells, table_size

BATCH: Final = 4  # cells


def safe_walls(
    device: Device,
    hands: Sequence[str] | None = None,
    *,
    x: Sequence[float] | None = None,
    y: Sequence[float] | None = None,
    z: Sequence[float] | None = None,
    cells: Sequence[int] | None = None,
    levels: int = 12,
    directions: int = 1,
    margin: float = 0.0,
    span: float | None = None,
    size_limit: int | None = None,
    assembly: str | None = None,
    model: str | None = None,
    seed: int = 1,
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
) -> SafeWalls:
    """A table of the walls that are stable in every posture of each cell of the workspace, in every direction and
    with every hand; see `docs/export.md` for what is proven of it and what is tried.

    hands       who may hold it: bundled operators, files, "none" for nobody; left out: as the device file says
    x, y, z     lowest and highest coordinate of the handle [m]; left out: the file's workspace, or what is reached
    cells       number of cells along each axis; left out: 20 along the longer side of a plane, 6 in space
    levels      bands of stiffness in each cell, at most 255
    directions  further tables for sectors of directions: into how many pieces, at most 16, each face of a square
                (a cube) of directions is cut; 1: none, n: 2 n (3 n^2) sectors
    margin      share by which stiffness and damping may both be off, at least 0 and below 1: the walls of the
                table are stable with both times any factors from 1 - margin to 1 + margin
    span        damping range that every cell offers at least [N s/m]; left out: the rectangles of the largest area
    size_limit  refuse a table that takes more bytes in the exported program
    assembly, model   as for `Device.at`
    seed        of the random postures that cells are tried by
    store       a folder that keeps the cells that are done
    progress    is called with "cells", cells done, and cells of all
    workers     largest number of processes; left out: one for each core
    Raises      ArgumentError   for numbers that are not allowed
                WorkspaceError  for a table beyond the limit, a device under load, one that renders moments, a
                                measured response
                WorkspaceError      as `grid.cells_of` does
                DeviceError     for hands that cannot be read, and as `Device.at` does
                what `OperatingPoint.loop`, `executor.run_job` and `Store` raise
    """
    job = safe_walls_job(
        device,
        hands,
        ranges=(x, y, z),
        cells=cells,
        levels=levels,
        directions=directions,
        margin=margin,
        size_limit=size_limit,
        assembly=assembly,
        model=model,
        seed=seed,
    )
    return compute_table(device, job, span, store, progress, workers)


def safe_walls_job(
    device: Device,
    hands: Sequence[str] | None,
    *,
    ranges: Sequence[Sequence[float] | None],
    cells: Sequence[int] | None,
    levels: int,
    directions: int,
    margin: float,
    size_limit: int | None,
    assembly: str | None,
    model: str | None,
    seed: int,
) -> SafeWallsJob:
    """Check the arguments of `safe_walls` and return its job, for which a `Store` can be made.

    ranges  x, y and z of `safe_walls`
    """
    check_kind("device", device, Device)
    _check_kinds(hands, cells, ranges)
    check_arguments(EXPORT, levels=levels, directions=directions, margin=margin, size_limit=size_limit, seed=seed)
    _check_device(device)
    grid = cells_of(device, ranges, cells, assembly)
    if directions > 1 and not grid.dimensions:
        raise WorkspaceError(
            f"the device has no [mechanism] and one direction, got {directions} parts of directions",
            Advice("leave out {}", "directions"),
        )
    held = tuple(device.held_by(hand) for hand in hands) if hands else (device,)
    sectors = Sectors(grid.dimensions, directions)
    question = CellQuestion(held, grid, sectors, levels, float(margin), assembly, model, seed)
    if size_limit is not None and (size := table_size(question)) > size_limit:
        raise WorkspaceError(
            f"the table takes {size} bytes, more than the {size_limit} of its limit",
            Advice("take fewer with {}, or fewer levels", "cells"),
        )
    _check_reference_points(question)
    return SafeWallsJob(question)


def _check_device(device: Device) -> None:
    """Raise WorkspaceError for a measured response, a device under load, and one that renders moments."""
    if device.response is not None:
        raise WorkspaceError(
            "a measured response has a chart of its own uncertainty and no table; fit a [plant] with zwidth "
            "identify"
        )
    if device.load is not None:
        raise WorkspaceError(
            "a table holds for a device without load: its walls would hang on how hard the hand pushes",
            Advice("leave the load out, with {}", "set", "load=unset"),
        )
    if device.mechanism is not None and device.renders_moments(None):
        raise WorkspaceError(
            "the device renders moments about an axis, and a table is about forces; render a force"
        )


def compute_table(
    device: Device,
    job: SafeWallsJob,
    span: float | None,
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    *,
    cluster: str | None = None,
    time_limit: float | None = None,
) -> SafeWalls:
    """Compute the cells of a job and make their table. Raises what `safe_walls` does.

    span, store, progress, workers  as for `safe_walls`;   cluster, time_limit  as for `executor.run_job`
    """
    check_arguments(EXPORT, span=span)
    cells = run_job(
        job, store, progress, workers, batch=BATCH, stage="cells", cluster=cluster, time_limit=time_limit
    )
    asked = job.cell_question
    return table_of_cells(device, hand_names(asked), asked, cells, span)


def hand_names(question: CellQuestion) -> tuple[str, ...]:
    """Names of the hands, in their order; "none" for nobody."""
    return tuple(device.operator_name or NOBODY for device in question.devices)


def _check_kinds(hands: object, cells: object, ranges: Sequence[object]) -> None:
    """Raise TypeError for arguments that are no sequences of what they should be."""
    if isinstance(hands, str):
        raise wrong_type("hands", "a list of operators", hands, f"write [{hands!r}]")
    if hands is not None and not isinstance(hands, Sequence):
        raise wrong_type("hands", "a list of operators", hands)
    if cells is not None and not _are_numbers(cells, Integral):
        raise wrong_type("cells", "whole numbers such as (20, 10)", cells)
    for name, given in zip("xyz", ranges, strict=True):
        if given is not None and not (_are_numbers(given, Real) and len(given) == 2):  # type: ignore[arg-type]
            raise wrong_type(name, "two numbers such as (-0.1, 0.1)", given)


def _are_numbers(values: Any, kind: type[Any]) -> bool:
    """Whether `values` is a sequence, or an array, of numbers of a kind: Integral or Real, but not bool."""
    is_sequence = isinstance(values, Sequence | np.ndarray) and not isinstance(values, str)
    return is_sequence and all(isinstance(one, kind) and not isinstance(one, bool) for one in values)


def _check_reference_points(question: CellQuestion) -> None:
    """Raise what `Device.at` and `OperatingPoint.loop` raise at the reference posture, with each of the hands: an
    error about the device, its assembly or its model would else become the status of all cells."""
    from zwidth.errors import PostureError

    for device in question.devices:
        try:
            point = device.at(assembly=question.assembly, model=question.model)
        except PostureError:  # an assembly that does not reach the reference may reach others
            continue
        _ = point.loop


METHOD: Final = 3  # a number for the way in which cells are searched, so that no table is made in two ways


@dataclass(frozen=True, repr=False)
class SafeWallsJob:
    """The cells of a table of safe walls; columns are the numbers of its tables.

    cell_question  what is asked of every cell
    """

    cell_question: CellQuestion

    def __repr__(self) -> str:
        return f"SafeWallsJob: {self.count} cells, {len(self.cell_question.devices)} hands"

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.cell_question.grid.count

    @property
    def measures(self) -> Sequence[str]:
        """Columns: for each table its largest stiffness, then lowest and then highest damping of its bands."""
        bands = range(1, self.cell_question.levels + 1)
        return tuple(
            f"{name}_{slot}"
            for slot in range(self.cell_question.slots)
            for name in ("stiffness", *(f"damping_{end}_{j}" for end in ("min", "max") for j in bands))
        )

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by."""
        asked = self.cell_question
        hands = [[device.document, device.operator] for device in asked.devices]
        grid = asked.grid
        return fingerprint(
            "safe walls",
            METHOD,
            hands,
            [grid.axes, grid.through, grid.low, grid.high, list(grid.counts)],
            [asked.sectors.dimensions, asked.sectors.parts, asked.levels, asked.margin],
            [asked.assembly, asked.model, asked.seed, asked.narrowing],
        )

    def compute(self, first: int, last: int) -> CellValues:
        """Compute cells first to last - 1, each by itself; of one without safe walls all columns are nan, and have
        its status. Raises what `OperatingPoint.loop` raises."""
        columns = len(self.measures)
        threads = numba.get_num_threads()
        numba.set_num_threads(1)  # kernels take a millisecond here, and handing out their chunks would take longer
        try:
            cells = [cell_walls(self.cell_question, cell) for cell in range(first, last)]
        finally:
            numba.set_num_threads(threads)
        values = np.full((last - first, columns), np.nan)
        status = np.zeros((last - first, columns), dtype=np.uint8)
        notes: dict[tuple[int, str], tuple[int, int]] = {}  # status and reason -> number of cells, first of them
        for n, cell in enumerate(cells):
            status[n] = cell.status
            if cell.status == OK:
                assert cell.top is not None
                assert cell.ranges is not None
                rows = [cell.top[:, None], cell.ranges[:, :, 0], cell.ranges[:, :, 1]]
                values[n] = np.concatenate(rows, axis=1).ravel()
            else:
                key = cell.status, cell.reason or f"a posture in the cell is {STATUS[cell.status]}"
                count, where = notes.get(key, (0, first + n))
                notes[key] = count + 1, where
        listed = tuple(Note(*key, count, (where,)) for key, (count, where) in notes.items())
        return CellValues(values, status, (listed, *((),) * (columns - 1)))  # once, with the first column
