"""`zwidth sweep`: many designs of one device."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet, table
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import as_json, example, named, output_option
from zwidth.show.cli.process import INTERNAL, say
from zwidth.show.cli.progress import progress_told
from zwidth.show.cli.resumable import Stopped, keeping, kept_options, opened
from zwidth.show.output import ARRAYS, DATA, FIGURES, OutputError, destination, replacing, shown, write_data
from zwidth.show.units import number, typed

if TYPE_CHECKING:
    from zwidth.study.store import Store
    from zwidth.study.study_file import Study
    from zwidth.study.sweep import Sweep

KEYS: Final = ("designs", "values", "status", "notes")
ZARR: Final = ".zarr"
LISTED: Final = 12  # designs up to which all are listed
REASONS: Final = 6  # told to people
NONE: Final = "no design has a value"


@click.command(
    short_help="Compare many designs, as STUDY says.",
    epilog=example(
        "zwidth sweep my-study.toml",
        "zwidth sweep my-study.toml --output designs.svg",
        "zwidth sweep my-study.toml --resume my-study.cells --workers 4 --output designs.nc",
    ),
)
@click.argument("study", metavar="STUDY.toml", callback=named)
@kept_options
@output_option("Write a figure (.png .svg .pdf) or the data (.csv .json .nc .mat .zarr).")
@as_json
def sweep(study: str, resume: str | None, workers: int | None, output: str | None, as_json: bool) -> int:
    """Compare many designs of a device: measures over any numbers of its file, as STUDY.toml says.

    Designs that are no device, or out of reach, are told by their status. What takes long is spread over
    processes; with --resume or --output it can be stopped, and the same command goes on.
    """
    path = None if output is None else _destination(output)
    try:
        found, store = _swept(study, path, resume, workers)
    except Stopped as stopped:
        say(f"zwidth: {stopped}")
        return INTERNAL
    document = facts(found.study) | numbers(found)
    reason = None if _any_value(found) else _why_none(found, document["notes"])
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document | ({} if reason is None else {"reason": reason}))
    if store is not None and resume is None:
        store.remove()  # now that what it kept is written
    return deliver(Answer(document, lambda: list(_pages(found, document)), reason), as_json)


def _destination(output: str) -> Path:
    if Path(output).suffix.lower() == ZARR and Path(output).exists():
        raise OutputError(f"{shown(output)}: is there already; remove it, or name another")
    return destination(output, (*FIGURES, *DATA, *ARRAYS, ZARR))


def _swept(file: str, path: Path | None, resume: str | None, workers: int | None) -> tuple[Sweep, Store | None]:
    from zwidth.contact.room import TooLarge
    from zwidth.measures.measure import MeasureError
    from zwidth.study.executor import run
    from zwidth.study.study_file import read_study
    from zwidth.study.sweep import Sweep, sweep_job

    try:
        study = read_study(file)
        job = sweep_job(study)
        store = opened(job, path, resume)
        with keeping(store), progress_told() as progress:
            cells = run(job, store, progress, workers, stage="computing designs")
    except TooLarge as error:
        raise BadInput(f"{file}: {error}") from None
    except MeasureError as error:
        raise BadInput(*(f"{file}: measures: {line}" for line in str(error).splitlines())) from None
    return Sweep(study, job, cells), store


def _why_none(found: Sweep, notes: list[str]) -> str:
    """The first reason; what became of the designs, where that says it all."""
    import numpy as np

    from zwidth.measures.measure import STATUS

    kinds = ", ".join(STATUS[int(kind)] for kind in np.unique(found.cells.status))
    return f"{NONE}: {notes[0] if notes else kinds}"


def _any_value(found: Sweep) -> bool:
    from zwidth.measures.measure import OK

    return bool((found.cells.status == OK).any())


def facts(study: Study) -> dict[str, Any]:
    """What was asked."""
    device, sampling = study.device, study.sampling
    return {
        "name": device.name,
        "device": device.label,
        "study": study.label,
        "operator": device.operator_name,
        "sampling_period_s": device.controller.sampling_period,
        "left_out": list(device.left_out),
        "sampling": "grid" if sampling.size is None else "latin-hypercube",
        "seed": None if sampling.size is None else sampling.seed,
        "axes": [
            {"key": axis.key, "unit": axis.unit or None}
            | ({"values": axis.values} if sampling.size is None or axis.span is None else {"range": axis.span})
            | {"tied": [tie.key for tie in axis.ties]}
            for axis in sampling.axes
        ],
        "units": {one.name: one.unit or None for one in study.asked},
    }


def numbers(found: Sweep) -> dict[str, Any]:
    """The designs and what came of them, under the keys of --json."""
    from zwidth.study.sweep_data import sentence, status_texts

    names = found.job.measures
    notes = [
        f"{name}: {sentence(found, note)}"
        for name, notes in zip(names, found.cells.notes, strict=True)
        for note in notes
    ]
    return {
        "designs": [found.design(n) for n in range(found.job.count)],
        "values": [dict(zip(names, map(float, row), strict=True)) for row in found.cells.values],
        "status": status_texts(found),
        "notes": notes,
    }


def _pages(found: Sweep, document: dict[str, Any]) -> Iterator[Any]:
    from zwidth.study.sweep_data import label

    count, sampling = found.job.count, found.job.sampling
    over = " x ".join(map(str, sampling.shape)) + " designs" if sampling.size is None else f"{count} designs"
    axes = ", ".join(axis.key for axis in sampling.axes)
    yield f"{shown(document['name'])}: {over} over {axes}"
    if document["left_out"]:
        yield f"linear: leaves out {', '.join(document['left_out'])}"
    if found.study.document.get("optimise"):
        yield "[optimise] is left aside: a sweep computes the designs that the axes name"
    if count <= LISTED:
        headings = [*(axis.key for axis in sampling.axes), *(_column(one) for one in found.job.asked)]
        yield table(
            headings,
            [[label(v) for v in sampling.values(n)] + _cells(found, n) for n in range(count)],
        )
    else:
        for number, one in enumerate(found.job.asked):
            yield f"\n{one.title} ({one.name})"
            yield sheet(list(_rows(found, number)))
    yield from _reasons(found)
    if "file" in document:
        yield f"written: {document['file']}"


def _reasons(found: Sweep) -> Iterator[str]:
    """Why designs have no value, once for all columns that say the same."""
    from zwidth.study.sweep_data import sentence

    told: dict[str, list[str]] = {}
    for name, notes in zip(found.job.measures, found.cells.notes, strict=True):
        for note in notes:
            told.setdefault(sentence(found, note), []).append(name)
    for reason, names in list(told.items())[:REASONS]:
        every = len(names) == len(found.job.measures)
        yield shown(reason if every else f"{', '.join(names)}: {reason}")
    if len(told) > REASONS:
        yield f"and {len(told) - REASONS} more reasons; --json or --output holds them"


def _column(one: Any) -> str:
    return f"{one.name} [{one.unit}]" if one.unit else str(one.name)


def _cells(found: Sweep, design: int) -> list[str]:
    """A design's values, or what became of them."""
    from zwidth.measures.measure import OK, STATUS

    values, status = found.cells.values[design], found.cells.status[design]
    return [typed(number(float(v))) if s == OK else STATUS[int(s)] for v, s in zip(values, status, strict=True)]


def _rows(found: Sweep, column: int) -> Iterator[tuple[str, str]]:
    """The extremes of one column, with their designs; and how many there are of each status."""
    import numpy as np

    from zwidth.measures.measure import OK, STATUS
    from zwidth.show.units import quantity
    from zwidth.study.sweep_data import label

    one, sampling = found.job.asked[column], found.job.sampling
    values, status = found.cells.values[:, column], found.cells.status[:, column]
    there = np.flatnonzero(status == OK)
    for name, pick in (("lowest", np.argmin), ("highest", np.argmax)):
        if len(there):
            n = int(there[int(pick(values[there]))])
            where = ", ".join(
                f"{axis.key} = {label(v)}" for axis, v in zip(sampling.axes, sampling.values(n), strict=True)
            )
            yield name, f"{typed(quantity(float(values[n]), one.unit))} at {where}"
    kinds, counts = np.unique(status, return_counts=True)
    yield "designs", ", ".join(f"{n} {STATUS[int(kind)]}" for kind, n in zip(kinds, counts, strict=True))


def _write(path: Path, found: Sweep, document: dict[str, Any]) -> None:
    kind = path.suffix.lower()
    if kind in DATA:
        from zwidth.study.sweep_data import rows

        write_data(path, document, rows(found) if kind == ".csv" else {})
        return
    dataset = found.dataset()
    if kind in (*ARRAYS, ZARR):
        from zwidth.show.dataset import write_dataset, write_zarr

        (write_zarr if kind == ZARR else write_dataset)(path, dataset)
        return
    from zwidth.show.figures.study import study_figure
    from zwidth.show.figures.style import save

    with replacing(path) as draft:
        save(study_figure(dataset), draft)
