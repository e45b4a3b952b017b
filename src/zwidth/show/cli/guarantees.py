"""`zwidth guarantees`: what each wall is guaranteed against."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, table
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Finite, Question, about_a_device, as_json, example, output_option
from zwidth.show.output import DATA, FIGURES, destination, replacing, write_data
from zwidth.show.units import amount

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.guarantees.coupling import Couplings
    from zwidth.guarantees.nested import Guarantees
    from zwidth.guarantees.region import Region

NOTHING: Final = "no wall has K > 0 and B >= 0 and any of the guarantees"
NO_HANDLE: Final = "a coupling is judged at the handle, and the plant has none; give plant.handle"


@click.command(
    short_help="Find what the walls of DEVICE are guaranteed against.",
    epilog=example(
        "zwidth guarantees my-device.toml --output guarantees.svg",
        "zwidth guarantees my-device.toml --coupling --stiffness 5000 --json",
    ),
)
@about_a_device
@click.option("--coupling", is_flag=True, help="Also the virtual couplings after Llewellyn and Raisbeck.")
@click.option("--stiffness", metavar="K", type=Finite(), help="With --coupling: a wall's stiffness [N/m].")
@click.option("--damping", metavar="B", type=Finite(), help="With --coupling: its damping [Ns/m]; 0 if left out.")
@output_option("Write a figure (.png .svg .pdf) or the data (.csv: the outlines, .json).")
@as_json
def guarantees(
    question: Question,
    coupling: bool,
    stiffness: float | None,
    damping: float | None,
    output: str | None,
    as_json: bool,
) -> int:
    """Find which walls of DEVICE are stable with every passive operator, with every spring, and at all.

    The bare device is asked about, whatever operator its file names: he is one of those allowed.
    """
    path = None if output is None else destination(output, FIGURES + DATA)
    wall = _wall(coupling, stiffness, damping)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, {"operator": None, "guarantees": None}, as_json)
    facts = question.facts(device) | {"operator": None}
    try:
        with computing(question):
            found, coupled = _computed(question, device, coupling, wall)
    except NoAnswer as none:
        return deliver(Answer(facts | {"guarantees": None}, reason=str(none)), as_json)
    document = facts | {"guarantees": numbers(found)}
    if coupling:
        document["coupling"] = coupling_numbers(coupled)
    if path is not None:
        document["file"] = str(path)
        _write(path, found, coupled, document)
    lost = all(guarantee.region.reason is not None for guarantee in found.guarantees)
    pages = list(_pages(question, device, document))
    return deliver(Answer(document, lambda: pages, NOTHING if lost else None), as_json)


def _wall(coupling: bool, stiffness: float | None, damping: float | None) -> tuple[float, float] | None:
    if stiffness is None and damping is None:
        return None
    context = click.get_current_context()
    if not coupling:
        raise click.UsageError("--stiffness and --damping name the wall of --coupling; give it too", context)
    if stiffness is None or stiffness <= 0.0:
        raise click.UsageError("the wall of --coupling needs --stiffness above 0", context)
    return stiffness, damping or 0.0


def _computed(
    question: Question, device: Device, coupling: bool, wall: tuple[float, float] | None
) -> tuple[Guarantees, Couplings | None]:
    from zwidth.guarantees.coupling import couplings
    from zwidth.guarantees.nested import nested

    loop = question.point(device).without_operator.loop
    handle = loop.plant.handle
    coupled = None if not coupling or handle is None else couplings(loop, handle, wall)
    return nested(loop), coupled


def numbers(found: Guarantees) -> list[dict[str, Any]]:
    """The guarantees under the keys of --json."""
    entries = []
    for guarantee in found.guarantees:
        region = guarantee.region
        entry: dict[str, Any] = {
            "name": guarantee.name,
            "meaning": guarantee.meaning,
            "regions": list(region.rings),
            "stiffness_max_N_per_m": region.stiffness_max,
            "damping_at_stiffness_max_Ns_per_m": region.damping_at_stiffness_max,
            "source": guarantee.source,
        }
        notes = {"reason": region.reason, "warning": region.warning}
        entries.append(entry | {key: note for key, note in notes.items() if note is not None})
    return entries


def coupling_numbers(found: Couplings | None) -> dict[str, Any]:
    """The couplings under the keys of --json."""
    if found is None:
        return {"reason": NO_HANDLE}
    limit = found.limit
    return {
        "llewellyn": _coupling(found.llewellyn),
        "raisbeck": _coupling(found.raisbeck),
        "sampled": _coupling(found.sampled),
        "limit": limit
        and {
            "stiffness_N_per_m": limit.stiffness,
            "damping_Ns_per_m": limit.damping,
            "felt_stiffness_N_per_m": limit.felt,
            "needed": limit.stiffness != float("inf"),
        },
    }


def _coupling(region: Region) -> dict[str, Any]:
    entry = {
        "regions": list(region.rings),
        "stiffness_max_N_per_m": region.stiffness_max,
        "damping_at_stiffness_max_Ns_per_m": region.damping_at_stiffness_max,
    }
    return entry | ({} if region.reason is None else {"reason": region.reason})


def _pages(question: Question, device: Device, document: dict[str, Any]) -> Iterator[Any]:
    yield heading(question, device)
    rows = [(entry["name"], _largest(entry), entry["meaning"]) for entry in document["guarantees"]]
    yield table(["guarantee", "largest stiffness", "what it means"], rows)
    coupled = document.get("coupling")
    if coupled and "reason" in coupled:
        yield f"couplings: {coupled['reason']}"
    elif coupled:
        kinds = ("llewellyn", "raisbeck", "sampled")
        yield table(["coupling", "stiffest"], [(kind, _largest(coupled[kind])) for kind in kinds])
        if coupled["limit"]:
            yield _limit(coupled["limit"])
    if "file" in document:
        yield f"written: {document['file']}"


def _largest(entry: dict[str, Any]) -> str:
    if "reason" in entry:
        return f"none: {entry['reason']}"
    K, B = entry["stiffness_max_N_per_m"], entry["damping_at_stiffness_max_Ns_per_m"]
    lacking = f"; {entry['warning']}" if "warning" in entry else ""
    return f"{amount(K, 'N/m')} at {amount(B, 'Ns/m')}{lacking}"


def _limit(limit: dict[str, Any]) -> str:
    if not limit["needed"]:
        return "the wall needs no coupling: it is stable with every passive operator"
    return (
        f"the wall needs a coupling no stiffer than {amount(limit['stiffness_N_per_m'], 'N/m')}, damped by "
        f"{amount(limit['damping_Ns_per_m'], 'Ns/m')}; "
        f"then one feels {amount(limit['felt_stiffness_N_per_m'], 'N/m')}"
    )


def _write(path: Path, found: Guarantees, coupled: Couplings | None, document: dict[str, Any]) -> None:
    if path.suffix.lower() in DATA:
        write_data(path, document, outlines(found))
        return
    from zwidth.show.figures.guarantees import draw_couplings, draw_guarantees
    from zwidth.show.figures.style import context, figure, save

    drawing, ax = figure()
    if coupled is not None:
        drawing.set_size_inches(5.6, 8.0)
        ax.set_subplotspec(drawing.add_gridspec(2, 1)[0])
        with context():
            draw_couplings(drawing.add_subplot(2, 1, 2), coupled)
    draw_guarantees(ax, found)
    with replacing(path) as draft:
        save(drawing, draft)


def outlines(found: Guarantees) -> dict[str, list[Any]]:
    """The outlines as columns, region after region."""
    rows = [
        (guarantee.name, n, float(K), float(B))
        for guarantee in found.guarantees
        for n, ring in enumerate(guarantee.region.rings)
        for K, B in ring
    ]
    columns = ("guarantee", "region", "stiffness_N_per_m", "damping_Ns_per_m")
    return {name: [row[i] for row in rows] for i, name in enumerate(columns)}
