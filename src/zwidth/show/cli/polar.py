"""`zwidth polar`: how stiff a wall can be along each direction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from zwidth.questions import POLAR
from zwidth.show.circumstances import load_text
from zwidth.show.cli.answer import two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import options_of
from zwidth.show.output import printable
from zwidth.show.units import amount, as_written, typed, vector

if TYPE_CHECKING:
    from zwidth.chart.polar import ByDirection


class PolarCommand(Command):
    """Find the largest stiffness that DEVICE renders stably along every direction of a plane."""

    name = "polar"
    summary = "Find the largest stiffness along every direction."
    examples = (
        "zwidth polar my-device.toml --at 0.1,0.2 --output polar.svg",
        "zwidth polar my-device.toml --plane xz --count 36 --json",
    )
    options = options_of(POLAR)
    keys = (
        "directions",
        "angle_deg",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "frequency_at_stiffness_max_Hz",
        "status",
    )
    takes_responses = True  # which it refuses like every device without a mechanism

    def check(self, case: CommandLine) -> None:
        """Raise BadInput for --direction: all directions of a plane are computed."""
        if case.question.direction is not None:
            raise BadInput(
                "--direction: does not apply to all directions of a plane; leave it out, or use --plane"
            )

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        return {"plane": case["plane"]}

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        # the answer has no single direction
        return {key: value for key, value in super().circumstances(case).items() if key != "direction"}

    def compute(self, case: CommandLine) -> ByDirection:
        """The largest stiffness by direction; without a mechanism, or with unsupported parts: BadInput."""
        question = case.question
        if case.device.mechanism is None:
            raise BadInput(f"{question.name}: has no [mechanism], and so one direction only; use zwidth chart")
        if case.device.load is None:  # under load each direction is computed by itself
            question.refuse_unsupported(case.device)
        point = question.point(case.device.pushed_along_every_direction)
        return point.by_direction(case["plane"], case["count"], progress=case.progress)

    def reason(self, case: CommandLine, result: ByDirection) -> str | None:
        return result.reason

    def heading(self, case: CommandLine) -> str:
        """The first lines, without a direction: device and posture; computer; what is left out."""
        facts = self.circumstances(case)
        _, further_lines = super().heading(case).split("\n", 1)
        where = f"at {vector(facts['position_m'], 'm')}, assembly {facts['assembly']}, model {facts['model']}"
        if (load := case.device.load) is not None:
            where += f", under {load_text(load.along_every_direction)}"
        return f"{printable(case.device.name)}: {where}\n{further_lines}"

    def pages(self, case: CommandLine, result: ByDirection, document: Mapping[str, Any]) -> Iterator[Any]:
        yield two_columns(list(_rows(result)))


def _rows(by_direction: ByDirection) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on all directions: how many, the stiffest, the least stiff, and those without answer."""
    import numpy as np

    plane, count = by_direction.plane, len(by_direction.stiffness)
    have = np.isfinite(by_direction.stiffness)
    yield "directions", f"{count} in the {plane} plane"
    if have.any():
        angles = by_direction.angles
        for name, k in (
            ("stiffest", int(np.nanargmax(by_direction.stiffness))),
            ("least stiff", int(np.nanargmin(by_direction.stiffness))),
        ):
            yield (
                name,
                f"{amount(by_direction.stiffness[k], 'N/m')} "
                f"at {amount(by_direction.damping[k], 'N s/m')} of damping, "
                f"along {typed(as_written(float(angles[k])))}° from {plane[0]} towards {plane[1]}",
            )
    for status in sorted(
        {status for status, answered in zip(by_direction.status, have, strict=True) if not answered}
    ):
        yield "without answer", f"{by_direction.status.count(status)}: {status}"
