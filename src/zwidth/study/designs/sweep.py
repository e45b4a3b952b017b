"""Measures of many designs of one device: from Python, or as a study file says.

sweep(device, {"loop.sampling_period_s": [0.0005, 0.001]}, ["stiffness_max", "isotropy"])["stiffness_max"]
run_study("study.toml").dataset()["stiffness_max"]
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from zwidth.device.device import Device
from zwidth.device.faults import plural
from zwidth.measures.definition import OK, STATUS, Measure
from zwidth.model.argument_checks import wrong_type
from zwidth.processors import Processor
from zwidth.progress import Progress
from zwidth.result import Result
from zwidth.study.designs.sampling import settings
from zwidth.study.designs.study import Study
from zwidth.study.designs.study_file import read_study, study_over
from zwidth.study.designs.sweep_data import (
    ColumnSummary,
    check_listing,
    note_sentences,
    summaries,
    sweep_dataset,
    sweep_document,
    sweep_table,
)
from zwidth.study.designs.sweep_job import SweepJob, sweep_job
from zwidth.study.jobs.executor import Executor, run_job
from zwidth.study.jobs.job import Cells
from zwidth.study.jobs.store import Store, store_for
from zwidth.study.workspace.plane_grid import PlaneGrid
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from zwidth.loop.posed_device import Position

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
        lines += [self._extremes(n) for n in range(len(self.job.columns))][:SHOWN]
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
        """The values over the axes, with units and the study; see `sweep_data.sweep_dataset`."""
        return sweep_dataset(self)

    def document(self) -> dict[str, Any]:
        """The designs with their values and status by key, lists of one entry for each design."""
        return sweep_document(self)

    def table(self) -> dict[str, list[Any]]:
        """The designs as columns, one design a row."""
        return sweep_table(self)

    def _extremes(self, column: int) -> str:
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
    processor      where charts are computed; "cuda": on an NVIDIA GPU, by one process (`processors`); else "cpu"
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
        store_for(job, store),
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
        store_for(job, store),
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
    store: Store | None = None,
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
