"""`zwidth polar`: how stiff a wall can be along each direction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import sheet
from zwidth.show.cli.command import Case, Command
from zwidth.show.cli.errors import BadInput
from zwidth.show.output import shown
from zwidth.show.units import amount, given, typed, vector

if TYPE_CHECKING:
    from zwidth.chart.polar import ByDirection

PLANES: Final = ("xy", "xz", "yz")  # as in chart.polar


class Polar(Command):
    """Find the largest stiffness that DEVICE renders stably along every direction of a plane."""

    name = "polar"
    summary = "Find the largest stiffness along every direction."
    examples = (
        "zwidth polar my-device.toml --at 0.1,0.2 --output polar.svg",
        "zwidth polar my-device.toml --plane xz --count 36 --json",
    )
    options = (
        click.option(
            "--plane",
            type=click.Choice(PLANES),
            help="Plane of the directions. Default: xy, or where the handle cannot move all over it, one where it "
            "can.",
        ),
        click.option(
            "--count",
            metavar="N",
            type=click.IntRange(3, 3600),
            default=72,
            show_default=True,
            help="Number of directions, spread evenly over the full turn.",
        ),
    )
    keys = (
        "directions",
        "angle_deg",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "frequency_at_stiffness_max_Hz",
        "status",
    )
    size = (4.6, 5.2)
    of_responses = True  # which it refuses like every device without a mechanism

    def check(self, case: Case) -> None:
        if case.question.direction is not None:
            raise BadInput(
                "--direction: does not apply to all directions of a plane; leave it out, or use --plane"
            )

    def asked(self, case: Case) -> dict[str, Any]:
        return {"plane": case["plane"]}

    def circumstances(self, case: Case) -> dict[str, Any]:
        # no direction is meant more than another
        return {key: value for key, value in super().circumstances(case).items() if key != "direction"}

    def compute(self, case: Case) -> ByDirection:
        question = case.question
        if case.device.mechanism is None:
            raise BadInput(f"{question.name}: has no [mechanism], and so one direction only; ask for its chart")
        question.of_several_directions(case.device)
        return case.point.by_direction(case["plane"], case["count"])

    def reason(self, case: Case, result: ByDirection) -> str | None:
        return result.reason

    def heading(self, case: Case) -> str:
        facts = self.circumstances(case)
        _, rest = super().heading(case).split("\n", 1)
        where = f"at {vector(facts['position_m'], 'm')}, assembly {facts['assembly']}, model {facts['model']}"
        return f"{shown(case.device.name)}: {where}\n{rest}"

    def pages(self, case: Case, result: ByDirection, document: Mapping[str, Any]) -> Iterator[Any]:
        yield sheet(list(_rows(result)))


def _rows(found: ByDirection) -> Iterator[tuple[str, str]]:
    import numpy as np

    plane, count = found.plane, len(found.stiffness)
    have = np.isfinite(found.stiffness)
    yield "directions", f"{count} of the {plane} plane"
    if have.any():
        angles = found.angles
        for name, k in (
            ("stiffest", int(np.nanargmax(found.stiffness))),
            ("least stiff", int(np.nanargmin(found.stiffness))),
        ):
            yield (
                name,
                f"{amount(found.stiffness[k], 'N/m')} at {amount(found.damping[k], 'Ns/m')} of damping, "
                f"along {typed(given(float(angles[k])))}° from {plane[0]} towards {plane[1]}",
            )
    for status in sorted({status for status, answered in zip(found.status, have, strict=True) if not answered}):
        yield "without answer", f"{found.status.count(status)}: {status}"
