"""`zwidth check`: is each of these walls stable?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli import measured
from zwidth.show.cli.answer import Answer, deliver, table
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.options import Finite, Question, about_a_device, as_json, example, named, output_option
from zwidth.show.cli.points import Walls, read_walls
from zwidth.show.output import DATA, destination, write_data
from zwidth.show.units import NONE, amount, radius

if TYPE_CHECKING:
    from zwidth.device.device import Device

AT_ONCE: Final = 20_000  # walls judged in one batch of transition matrices
SHOWN: Final = 200  # rows printed for people; --json and --output hold all


@click.command(
    short_help="Say of single walls whether DEVICE renders them stably.",
    epilog=example(
        "zwidth check my-device.toml --stiffness 4000 --damping 10",
        "zwidth check my-device.toml --points walls.csv --json",
    ),
)
@about_a_device
@click.option(
    "--points", metavar="FILE.csv", callback=named, help="Walls: columns stiffness_N_per_m, damping_Ns_per_m."
)
@click.option("--stiffness", metavar="K", type=Finite(), help="Stiffness of one wall [N/m].")
@click.option("--damping", metavar="B", type=Finite(), help="Damping of one wall [Ns/m].")
@output_option("Write the verdicts (.csv .json).")
@as_json
def check(
    question: Question,
    points: str | None,
    stiffness: float | None,
    damping: float | None,
    output: str | None,
    as_json: bool,
) -> int:
    """Say of each wall whether DEVICE renders it stably, by the eigenvalues of the loop."""
    path = None if output is None else destination(output, DATA)
    walls = _walls(points, stiffness, damping)
    device = question.device()
    try:
        with computing(question):
            verdicts = _judged(question, device, walls)
    except NoAnswer as none:
        return deliver(Answer(question.facts(device) | {"points": None}, reason=str(none)), as_json)
    document = question.facts(device) | {"points": verdicts}
    if path is not None:
        document["file"] = str(path)
        write_data(path, document, {key: [point[key] for point in verdicts] for key in verdicts[0]})
    return deliver(Answer(document, lambda: _pages(question, device, document)), as_json)


def _judged(question: Question, device: Device, walls: Walls) -> list[dict[str, Any]]:
    """One entry per wall: the wall, its verdict, spectral radius and frequency."""
    if question.charted_by_response(device):
        return measured.judged(question, device, walls)
    from zwidth.chart.verdict import judge

    loop = question.point(device).loop
    entries = []
    for start in range(0, len(walls), AT_ONCE):
        batch = walls[start : start + AT_ONCE]
        found = judge(loop, [K for K, _ in batch], [B for _, B in batch])
        for (K, B), verdict, size, frequency in zip(
            batch, found.names, found.spectral_radius.tolist(), found.frequency.tolist(), strict=True
        ):
            entries.append(
                {
                    "stiffness_N_per_m": K,
                    "damping_Ns_per_m": B,
                    "verdict": verdict,
                    "spectral_radius": size,
                    "frequency_Hz": frequency,
                }
            )
    return entries


def _walls(points: str | None, stiffness: float | None, damping: float | None) -> Walls:
    if points is not None:
        if stiffness is not None or damping is not None:
            raise click.UsageError("--points stands for itself; leave --stiffness and --damping out", _context())
        return read_walls(points)
    if stiffness is None or damping is None:
        raise click.UsageError("needs --points FILE.csv, or both --stiffness and --damping", _context())
    return [(stiffness, damping)]


def _context() -> click.Context:
    return click.get_current_context()


def _pages(question: Question, device: Device, document: dict[str, Any]) -> Sequence[Any]:
    points = document["points"]
    rows = [
        (
            amount(point["stiffness_N_per_m"], "N/m"),
            amount(point["damping_Ns_per_m"], "Ns/m"),
            point["verdict"],
            NONE if point["spectral_radius"] is None else radius(point["spectral_radius"]),
            amount(point["frequency_Hz"], "Hz"),
        )
        for point in points[:SHOWN]
    ]
    pages: list[Any] = [heading(question, device)]
    frequency = "nearest edge at" if question.charted_by_response(device) else "its frequency"
    pages.append(table(["stiffness", "damping", "verdict", "spectral radius", frequency], rows))
    if len(points) > SHOWN:
        pages.append(f"and {len(points) - SHOWN} more; --json or --output holds them all")
    if "file" in document:
        pages.append(f"written: {document['file']}")
    return pages
