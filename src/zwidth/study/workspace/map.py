"""Maps: measures all over a plane of the workspace.

`reach_outline`: the exact edge of the reachable set on a map's plane, where the links' lengths alone decide it.
Every chain of links from the base to the handle allows a shell about its base (`model.posture_batch`). For many
mechanisms whose joints all turn freely, the handle reaches every point that lies in all shells. That is checked
against every cell of the map; where it holds, the edge consists of exact arcs of circles.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.device.device import Device
from zwidth.errors import MeasureError, WorkspaceError
from zwidth.loop.linear_omissions import load_omissions
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.catalogue import find_measure
from zwidth.measures.definition import (
    BEYOND_LIMIT,
    NO_EQUILIBRIUM,
    NO_POSTURE,
    OK,
    OUT_OF_REACH,
    SINGULAR,
    STATUS,
    UNREACHED,
    Measure,
    Note,
    WantedWall,
)
from zwidth.measures.evaluation import evaluate
from zwidth.model.argument_checks import check_kind
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.posture_batch import shells
from zwidth.progress import Progress
from zwidth.questions import WANTED
from zwidth.resources import Processor
from zwidth.study.designs.column import measure_list, over_the_workspace, plane_positions, unit_attributes
from zwidth.study.jobs.executor import Executor, run_job
from zwidth.study.jobs.job import Cells, CellValues
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.jobs.store import Store
from zwidth.study.workspace.extreme_direction import EXTREMES, extreme_over_directions, extreme_sign
from zwidth.study.workspace.plane_grid import PlaneGrid, plane_of, reachable_set

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.study.workspace.common_area import CommonArea


Direction = Sequence[float] | str | None
COMPONENTS: Final = ("x", "y", "z")
# A measure evaluated for many cells at once costs about the same for one cell as for hundreds.
FEWEST: Final = 512  # cells in a batch of such measures
BATCHES: Final = 16  # number of batches of a large map


@dataclass(frozen=True, repr=False)
class MapJob:
    """The cells of a map: rows of the plane's grid one after the other; columns are measures.

    requested_measures  the measures; those that are about a wanted wall hold `wall`
    direction           a vector of any length but zero; one of EXTREMES; None: the file's
    wall                the wanted wall
    """

    device: Device
    requested_measures: tuple[Measure, ...]
    plane: PlaneGrid
    direction: Direction = None
    assembly: str | None = None
    model: str | None = None
    wall: WantedWall = WantedWall()  # noqa: RUF009  frozen

    def __repr__(self) -> str:
        ny, nx = self.plane.shape
        return f"MapJob: {', '.join(self.measures)} of {self.device.label!r} in {nx} x {ny} cells"

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.plane.x) * len(self.plane.y)

    @property
    def measures(self) -> tuple[str, ...]:
        """Columns: each measure, followed by the components of its extreme direction where it has one."""
        return tuple(column for measure in self.requested_measures for column in self._columns(measure))

    @property
    def question(self) -> str:
        """Fingerprint that stored results are recognised by.

        Raises  TypeError  for a measure whose function was not read from a file or a module
        """
        direction = self.direction
        return fingerprint(
            "map",
            self.device.document,
            self.device.operator,
            self.requested_measures,
            self.plane,
            direction if isinstance(direction, str) or direction is None else tuple(map(float, direction)),
            self.assembly,
            self.model,
            self.wall,
        )

    @property
    def batch(self) -> int | None:
        """Cells per batch; None: `executor.run_job` chooses, where a measure is evaluated cell by cell."""
        if any(measure.each for measure in self.requested_measures):
            return None
        return max(FEWEST, -(-self.count // BATCHES))

    @cached_property
    def _positions(self) -> Floats:
        """Handle positions (cells, 3) [m]."""
        return self.plane.positions.reshape(-1, 3)

    def compute(self, first: int, last: int) -> CellValues:
        """Cells first to last - 1, their postures solved together.

        Raises  MeasureError  where a measure does not exist for this device, with its name
        """
        vector = None if isinstance(self.direction, str) else self.direction
        positions = self._positions[first:last]
        points = self.device.at(positions, vector, assembly=self.assembly, model=self.model)
        values, status, notes = [], [], []
        for measure in self.requested_measures:
            try:
                measured, its_status, its_notes = self._column_values(measure, points)
            except MeasureError as error:
                raise error.with_name(measure.name) from None
            width = measured.shape[1]
            values.append(measured)
            status += [its_status] * width
            # with the number of the cell in the map; once, with the first of the measure's columns
            listed = tuple(Note(a.status, a.reason, a.count, (a.first[0] + first,)) for a in its_notes)
            notes += [listed, *[()] * (width - 1)]
        return CellValues(np.concatenate(values, axis=1), np.stack(status, axis=1), tuple(notes))

    def _columns(self, measure: Measure) -> tuple[str, ...]:
        """Columns of one measure: its name, and the components of its extreme direction where it has one."""
        has_directions = isinstance(self.direction, str) and measure.along
        return (measure.name, *(f"{measure.name}_direction_{c}" for c in COMPONENTS if has_directions))

    def _column_values(
        self, measure: Measure, points: OperatingPoint
    ) -> tuple[Floats, NDArray[np.uint8], tuple[Note, ...]]:
        """Values (n, columns) of one measure at n points, see `_columns`; status (n,) and notes."""
        if not isinstance(self.direction, str) or not measure.along:
            result = evaluate(measure, points)
            return result.values[:, None], result.status, result.notes
        extreme: Any = self.direction
        directed = extreme_over_directions(measure, points, extreme)
        result = directed.extreme
        return np.column_stack([result.values, directed.direction]), result.status, result.notes


def workspace_map(
    device: Device,
    measures: str | Measure | Sequence[str | Measure],
    plane: PlaneGrid | None = None,
    direction: Direction = None,
    assembly: str | None = None,
    model: str | None = None,
    wall: WantedWall | None = None,
    *,
    user_measures: Mapping[str, Measure] | None = None,
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    processor: Processor = "cpu",
    time_limit: float | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Measures over a plane of a device's workspace.

    measures       one or several: names, or measures themselves
    plane          left out: `plane_of(device)`
    direction      rendered in every cell: a vector, or "worst", "best", "lowest" or "highest": the direction in
                   which the measure is so in that cell; left out: the file's
    wall           the wanted wall, for measures that are about one
    user_measures  measures of a user's own, by name (`measures.user_measures.load_measures`)
    store          a folder that keeps what is done, so that the same call goes on from there after it was stopped
    progress       is called with "mapping", cells done, and cells of all
    workers        largest number of processes; left out: one for each core
    time_limit     time after which a design or cell is given up [s]: it is `out of time`, the others keep their
                   values
    cluster        address of a scheduler of dask.distributed, or "local"; left out: processes of this computer
    executor       what computes, opened before for many calls (`study.open_executor`), in place of workers,
                   time_limit and cluster
    processor      where charts are computed; "cuda": on an NVIDIA GPU, by one process (`resources`); else "cpu"
    Returns        a dataset over (y_m, x_m): for each measure NAME its values, nan where there is none,
                   NAME_status, and with an extreme direction NAME_direction (y_m, x_m, component). Why cells have
                   no value stands in the attribute `notes`, a line for each reason
    Raises         WorkspaceError    where the handle reaches no cell, and as `plane_of` does
                   ValueError    for an unknown measure, or two of one name
                   MeasureError  for a measure that does not exist for this device
                   DeviceError   as `Device.at` does
                   what `executor.run_job` and `Store` raise
    """
    job = map_job(device, measures, plane, direction, assembly, model, wall, user_measures=user_measures)
    cells = run_job(
        job,
        store,
        progress,
        workers,
        processor=processor,
        batch=job.batch,
        stage="mapping",
        time_limit=time_limit,
        cluster=cluster,
        executor=executor,
    )
    return map_dataset(job, cells)


def map_job(
    device: Device,
    measures: str | Measure | Sequence[str | Measure],
    plane: PlaneGrid | None = None,
    direction: Direction = None,
    assembly: str | None = None,
    model: str | None = None,
    wall: WantedWall | None = None,
    *,
    user_measures: Mapping[str, Measure] | None = None,
) -> MapJob:
    """Check the arguments of `workspace_map` and return the job, for which a `Store` can be made."""
    check_kind("device", device, Device)
    requested_measures = tuple(
        one if isinstance(one, Measure) else find_measure(one, user_measures) for one in measure_list(measures)
    )
    names = [one.name for one in requested_measures]
    if not names:
        raise ValueError("measures must name at least one measure, got none")
    if len(set(names)) < len(names):
        raise ValueError(f"a map's measures must have different names, got {', '.join(names)}; list each once")
    if isinstance(direction, str):
        if direction not in EXTREMES:
            raise ValueError(f"the direction must be a vector or one of {', '.join(EXTREMES)}, got {direction!r}")
        extreme: Any = direction
        for one in requested_measures:
            if one.along:
                try:
                    extreme_sign(one, extreme)
                except MeasureError as error:
                    raise error.with_name(one.name) from None
    else:
        device.direction(direction)  # raises what is wrong with it
    if isinstance(direction, str):  # every direction that is compared has the same push
        device = device.pushed_along_every_direction
    if not isinstance(direction, str) and device.renders_moments(direction):
        requested_measures = tuple(one.about_moments() for one in requested_measures)
    plane = plane or plane_of(device, assembly=assembly)
    wanted = wall or WantedWall()
    requested_measures = tuple(one.at_wall(wanted) for one in requested_measures)
    return MapJob(device, requested_measures, plane, direction, assembly, model, wanted)


def map_dataset(job: MapJob, cells: Cells) -> xr.Dataset:
    """A map's cells with axes, units and circumstances. Raises WorkspaceError where the handle reaches none."""
    import xarray as xr

    plane, mechanism = job.plane, job.device.mechanism
    assert mechanism is not None
    _check_reached(job, cells)
    data: dict[str, Any] = {}
    axes = ("y_m", "x_m")
    column = 0
    for measure in job.requested_measures:
        width = len(job._columns(measure))  # 1, or 4 with the components of an extreme direction
        unit = measure.unit.replace("^r", f"^{len(mechanism.drives.names)}")  # r: number of drives
        attributes = {
            **unit_attributes(unit),
            "title": measure.title,
            "long_name": measure.title,
            "source": measure.source,
            "better": measure.better or "",
            "along": int(measure.along),
            "linear": int(measure.linear),
            "key": measure.key,
            "notes": "\n".join(_note_sentence(note, plane) for note in cells.notes[column]),
        }
        data[measure.name] = (axes, cells.values[:, column].reshape(plane.shape), attributes)
        status = cells.status[:, column].reshape(plane.shape)
        data[f"{measure.name}_status"] = (axes, status, _status_attributes())
        if width > 1:
            directions = cells.values[:, column + 1 : column + width].reshape(*plane.shape, 3)
            title = {"title": f"{str(job.direction).capitalize()} direction of {measure.title.lower()}"}
            data[f"{measure.name}_direction"] = ((*axes, "component"), directions, title)
        column += width
    x, y = (
        (axis, values, {"units": "m", "long_name": name})
        for axis, values, name in zip(("x_m", "y_m"), (plane.x, plane.y), plane.names, strict=True)
    )
    coordinates: dict[str, Any] = {"x_m": x, "y_m": y}
    if any("component" in variable[0] for variable in data.values()):
        coordinates["component"] = list(COMPONENTS)
    return xr.Dataset(data, coordinates, _map_attributes(job))


def measures_of(dataset: xr.Dataset) -> list[str]:
    """Names of the measures that a map holds, in its order."""
    return [str(name) for name in dataset.data_vars if f"{name}_status" in dataset]


def reachable(dataset: xr.Dataset, name: str) -> Flags:
    """Whether each cell (ny, nx) has a posture; the measure `name` may still have no value in it."""
    status = dataset[f"{name}_status"].values
    return np.asarray(~np.isin(status, UNREACHED))


def _status_attributes() -> dict[str, Any]:
    """Attributes of a variable of status: its values and their meanings."""
    meanings = " ".join(text.replace(" ", "_") for text in STATUS.values())
    return {"flag_values": np.array(list(STATUS), dtype=np.uint8), "flag_meanings": meanings}


def _note_sentence(note: Note, plane: PlaneGrid) -> str:
    """A note in words: how many cells, why they have no value, and where the first of them lies."""
    row, column = divmod(note.first[0], len(plane.x))
    x, y = (round(float(value), 12) + 0.0 for value in (plane.x[column], plane.y[row]))
    where = f"{plane.names[0]} = {x:.6g} m, {plane.names[1]} = {y:.6g} m"
    cells = "1 cell" if note.count == 1 else f"{note.count} cells"
    return f"{cells} {STATUS.get(note.status, 'ok')}: {note.reason}; first at {where}"


def _check_reached(job: MapJob, cells: Cells) -> None:
    """Raise WorkspaceError where the handle reaches no cell."""
    if not np.isin(cells.status, NO_POSTURE).all():
        return
    mechanism = job.device.mechanism
    assert mechanism is not None
    assembly = job.assembly or job.device.reference_assembly
    reach = reachable_set(mechanism, assembly)
    raise WorkspaceError(f"the handle reaches no point of this plane in assembly {assembly!r}; it reaches {reach}")


def _map_attributes(job: MapJob) -> dict[str, Any]:
    """The map's device, plane, direction and wanted wall, as attributes that any file can hold."""
    from zwidth._version import __version__

    device, plane, direction = job.device, job.plane, job.direction
    assert device.mechanism is not None
    rendered = direction if isinstance(direction, str) else device.direction(direction).tolist()
    wanted = {f"wanted_{one.key}": getattr(job.wall, one.name) for one in WANTED.values()}
    if job.wall.colliding_links is not None:
        wanted["wanted_colliding_links"] = ", ".join(job.wall.colliding_links)
    return {
        "name": device.name,
        "device": device.label,
        "assembly": job.assembly or device.reference_assembly or "",
        "model": job.model or "full",
        "operator": device.operator_name or "none",
        **({} if device.load is None else {"load": device.load.text()}),
        "direction": rendered,
        "plane": "".join(plane.names),
        "plane_axes": [*plane.first.tolist(), *plane.second.tolist()],
        "plane_through_m": plane.through.tolist(),
        KEY: shells_attribute(device.mechanism),
        "sampling_period_s": device.controller.sampling_period,
        "delay_samples": float(device.controller.delay),
        "left_out": ", ".join(
            (device.linear_omissions if any(one.linear for one in job.requested_measures) else ())
            + load_omissions(device.mechanism, device.load, job.model)
        ),
        **{key: value for key, value in wanted.items() if value is not None},
        "zwidth": __version__,
    }


KEY: Final = "reach_shells_m"  # attribute of a map: centre x, y, z, least and most distance of each shell
QUARTER: Final = 256  # chords of a quarter of a circle; its area is too small by a share of 6e-6
NEAR: Final = 1e-6  # share of a shell's size within which a cell may be judged either way
LAYERS: Final = 2  # cells beyond the last with a value to which values are continued


def shells_attribute(mechanism: Mechanism) -> list[float]:
    """The shells of a mechanism's chains as a list of numbers, five for each shell."""
    return [
        float(value) for shell in shells(pack(mechanism), 0) for value in (*shell.centre, shell.least, shell.most)
    ]


def reach_outline(dataset: xr.Dataset, name: str) -> Any:
    """The reachable set within a map's grid, as a shapely geometry in the plane's coordinates.

    dataset  a map (`study.workspace.map`);   name  one of its measures
    Returns  None where the shells do not decide reach, or the map does not hold them; an empty polygon where the
             plane passes a shell by
    """
    import shapely

    table = np.reshape(np.asarray(dataset.attrs.get(KEY, ()), dtype=np.float64), (-1, 5))
    if not len(table) or not _reach_decided_by(table, dataset, name):
        return None
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=np.float64).reshape(2, 3)
    through = np.asarray(dataset.attrs["plane_through_m"], dtype=np.float64)
    x, y = dataset["x_m"].values, dataset["y_m"].values
    outline: Any = shapely.box(x[0], y[0], x[-1], y[-1])
    for *centre, least, most in table:
        offset = np.array(centre) - through
        middle, height = shapely.Point(axes @ offset), abs(float(np.cross(*axes) @ offset))
        # the plane cuts a sphere of radius r, whose centre lies `height` beside it, in a circle of radius
        # sqrt(r^2 - height^2)
        if height >= most:
            return shapely.Polygon()
        outline &= middle.buffer(np.sqrt(most**2 - height**2), quad_segs=QUARTER)
        if least > height:
            outline -= middle.buffer(np.sqrt(least**2 - height**2), quad_segs=QUARTER)
    return outline


def _reach_decided_by(table: Floats, dataset: xr.Dataset, name: str) -> bool:
    """Whether the reached cells of a map are exactly those that lie in all shells.

    table  (shells, 5)  of `shells_attribute`
    """
    at, status = plane_positions(dataset), dataset[f"{name}_status"].values
    inside = np.ones(status.shape, dtype=np.bool_)
    unsure = status == SINGULAR
    for *centre, least, most in table:
        distance = np.linalg.norm(at - np.array(centre), axis=-1)
        inside &= (distance >= least) & (distance <= most)
        unsure |= np.minimum(np.abs(distance - least), np.abs(distance - most)) < NEAR * most
    return bool(np.all(unsure | (inside == ~np.isin(status, (OUT_OF_REACH, BEYOND_LIMIT)))))


def continued(values: Floats, status: NDArray[np.uint8]) -> Floats:
    """The values (ny, nx) of a map with this status (ny, nx), continued by up to LAYERS cells beyond the edge of
    reach, within the range of the others; as they are where none is finite.

    The value of such a cell is extrapolated linearly from the next two cells along each row, column and diagonal
    that has them, and averaged; without two such cells it is the mean of its neighbours. A figure can then be cut
    at the true edge, not at the last cell.
    """
    known = np.array(values, dtype=np.float64)
    beyond = np.isin(status, NO_POSTURE)
    finite = known[np.isfinite(known)]
    if not len(finite):
        return known
    low, high = float(finite.min()), float(finite.max())
    for _ in range(LAYERS):
        next_to, behind = _values_away(known, 1), _values_away(known, 2)
        with np.errstate(invalid="ignore"):
            straight = _mean_of_finite(2.0 * next_to - behind)
        estimate = np.where(np.isnan(straight), _mean_of_finite(next_to), straight)
        known = np.where(beyond & np.isnan(known), np.clip(estimate, low, high), known)
    return known


def _values_away(values: Floats, steps: int) -> Floats:
    """For each cell the values (8, ny, nx) so many steps away along rows, columns and diagonals; nan outside."""
    padded = np.pad(values, steps, constant_values=np.nan)
    rows, columns = values.shape
    ways = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    starts = [(steps * (1 + i), steps * (1 + j)) for i, j in ways]
    return np.stack([padded[i : i + rows, j : j + columns] for i, j in starts])


def _mean_of_finite(values: Floats) -> Floats:
    """Mean (...) of the finite values over the first axis of values (k, ...); nan where there is none."""
    there = np.isfinite(values)
    total = np.where(there, values, 0.0).sum(axis=0)
    return np.where(there.any(axis=0), total / np.maximum(there.sum(axis=0), 1), np.nan)


NAMES: Final = np.array([STATUS.get(k, "") for k in range(256)], dtype=object)


def map_document(
    dataset: xr.Dataset, device: Device | None = None, area: CommonArea | None = None
) -> dict[str, Any]:
    """A map by key and unit: its grid, its first measure, and with several all of them under `measures`.

    dataset  as `study.workspace.map.workspace_map` returns it
    device   None: numbers for which postures must be solved again are left out, as in `over_the_workspace`
    area     common area of requirements; None: no requirements
    """
    names = measures_of(dataset)
    axes = dataset.attrs["plane_axes"]
    each = {name: _measure_document(dataset, name, device) for name in names}
    document = {
        "measure": names[0],
        "plane": dataset.attrs["plane"],
        "plane_axes": [axes[:3], axes[3:]],
        "plane_through_m": dataset.attrs["plane_through_m"],
        "x_m": dataset["x_m"].values,
        "y_m": dataset["y_m"].values,
        **each[names[0]],
        "notes": [f"{name}: {note}" for name in names for note in _reason_sentences(dataset, name)],
    }
    document |= {"measures": each} if len(names) > 1 else {}
    return document | ({} if area is None else area.document())


def map_table(dataset: xr.Dataset) -> dict[str, Any]:
    """A map as columns, a row for each cell, x fastest: position in the plane and, unless that is xy, in the base
    frame; values and their status, and directions."""
    x, y = np.meshgrid(dataset["x_m"].values, dataset["y_m"].values)
    table: dict[str, Any] = {"x_m": x.ravel(), "y_m": y.ravel()}
    if dataset.attrs["plane"] != "xy":
        table |= _component_columns("position", plane_positions(dataset), "_m")
    for name in measures_of(dataset):
        table[str(dataset[name].attrs["key"])] = dataset[name].values.ravel()
        table[f"{name}_status"] = NAMES[dataset[f"{name}_status"].values.ravel()]
        if f"{name}_direction" in dataset:
            table |= _component_columns(f"{name}_direction", dataset[f"{name}_direction"].values)
    return table


def why_no_cell(dataset: xr.Dataset) -> str | None:
    """Why no cell has a value of any measure; None where one has."""
    names = measures_of(dataset)
    if any((dataset[f"{name}_status"].values == OK).any() for name in names):
        return None
    notes = [note for name in names for note in _reason_sentences(dataset, name)]
    if not notes and any((dataset[f"{name}_status"].values == NO_EQUILIBRIUM).any() for name in names):
        return (
            f"no cell has a value: in none that is reached is there an equilibrium under {dataset.attrs['load']}"
        )
    return "no cell has a value" + (f": {notes[0]}" if notes else "")


def _measure_document(dataset: xr.Dataset, name: str, device: Device | None) -> dict[str, Any]:
    """One measure of a map by key and unit; `device` as for `map_document`."""
    attributes = dataset[name].attrs
    document = {
        "title": attributes["title"],
        "unit": attributes.get("unit", ""),
        "better": attributes["better"] or None,
        "source": attributes["source"],
        "values": dataset[name].values,
        "status": NAMES[dataset[f"{name}_status"].values],
        "overall": over_the_workspace(dataset, name, device),
        "notes": _reason_sentences(dataset, name),
    }
    directed = f"{name}_direction"
    return document | ({"directions": dataset[directed].values} if directed in dataset else {})


def _reason_sentences(dataset: xr.Dataset, name: str) -> list[str]:
    """Why cells have no value of a measure, a sentence for each reason."""
    return str(dataset[name].attrs["notes"]).splitlines()


def _component_columns(name: str, vectors: Sequence[Any] | np.ndarray, unit: str = "") -> dict[str, Any]:
    """Columns name_x, name_y, name_z of vectors (..., 3), with the unit's ending."""
    rows = np.reshape(vectors, (-1, 3))
    return {f"{name}_{axis}{unit}": rows[:, k] for k, axis in enumerate("xyz")}
