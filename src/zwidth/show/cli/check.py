"""`zwidth check`: is each of these walls stable?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.questions import CHECK
from zwidth.show.cli import wall_law
from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.options import options_of
from zwidth.show.output import DATA
from zwidth.show.units import NONE, amount, radius
from zwidth.study.boundary.points_file import Walls, read_walls

if TYPE_CHECKING:
    from zwidth.chart.verdict import WallVerdicts

SHOWN: Final = 200  # rows printed for people; --json and --output hold all


class CheckCommand(Command):
    """Judge single walls of DEVICE, stable or not, by the eigenvalues of the loop."""

    name = "check"
    summary = "Judge single walls: stable or not."
    examples = (
        "zwidth check my-device.toml --stiffness 4000 --damping 10",
        "zwidth check my-device.toml --points walls.csv --json",
    )
    options = options_of(CHECK, **wall_law.KINDS)
    outputs = DATA
    output_help = "Write the verdicts (.csv .json)."
    keys = ("points",)
    takes_responses = True

    def parse(self, case: CommandLine) -> dict[str, Any]:
        return {"walls": _walls_to_judge(case["points"], case["stiffness"], case["damping"])}

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        return wall_law.circumstances(case)

    def compute(self, case: CommandLine) -> WallVerdicts:
        stiffness, damping = zip(*case["walls"], strict=True)
        return wall_law.operating_point(case).check(stiffness, damping, progress=case.progress)

    def pages(self, case: CommandLine, result: WallVerdicts, document: Mapping[str, Any]) -> Iterator[Any]:
        """A row for each wall, up to SHOWN of them, and what the table does not say."""
        points = document["points"]
        rows = [
            (
                amount(point["stiffness_N_per_m"], "N/m"),
                amount(point["damping_Ns_per_m"], "N s/m"),
                point["verdict"],
                NONE if point["spectral_radius"] is None else radius(point["spectral_radius"]),
                amount(point["frequency_Hz"], "Hz"),
            )
            for point in points[:SHOWN]
        ]
        if law := list(wall_law.rows(wall_law.circumstances(case))):
            yield two_columns(law)
        frequency = "nearest edge at" if case.point.charted_by_response else "its frequency"
        yield answer_table(["stiffness", "damping", "verdict", "spectral radius", frequency], rows)
        if any(point.get("unheld_positions") for point in points[:SHOWN]):
            yield "with K = 0 the device stays wherever it is left: the root z = 1 of that position is set aside"
        if len(points) > SHOWN:
            yield f"and {len(points) - SHOWN} more; --json or --output holds them all"


def _walls_to_judge(points: str | None, stiffness: float | None, damping: float | None) -> Walls:
    """The walls (K [N/m], B [N s/m]) to judge: those of the file `points`, else the one of both numbers.

    Raises  click.UsageError  where the options give neither, or both
    """
    context = click.get_current_context()
    if points is not None:
        if stiffness is not None or damping is not None:
            raise click.UsageError("--points replaces --stiffness and --damping; leave them out", context)
        return read_walls(points)
    if stiffness is None or damping is None:
        raise click.UsageError("needs --points FILE.csv, or both --stiffness and --damping", context)
    return [(stiffness, damping)]
