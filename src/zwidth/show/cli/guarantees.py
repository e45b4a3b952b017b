"""`zwidth guarantees`: what each wall is guaranteed against."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.questions import GUARANTEES
from zwidth.show.cli.answer import answer_table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.options import options_of
from zwidth.show.units import amount

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.guarantees.coupling import Coupling
    from zwidth.guarantees.guarantees import Guarantees
    from zwidth.guarantees.region import Region

NOTHING: Final = "no wall has K > 0 and B >= 0 and any of the guarantees"


class GuaranteesCommand(Command):
    """Find the walls of DEVICE that are stable with every passive operator, and with every spring at the handle.

    The operator of the device file is left out: the guarantees hold with every passive one.
    """

    name = "guarantees"
    takes_responses = True
    summary = "Find the walls that are stable with every passive operator."
    examples = (
        "zwidth guarantees my-device.toml --output guarantees.svg",
        "zwidth guarantees my-device.toml --coupling --stiffness 5000 --json",
    )
    options = options_of(GUARANTEES)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: the outlines, .json)."
    keys = ("guarantees",)

    def check(self, case: CommandLine) -> None:
        """Raise click.UsageError for a wall without --coupling, or one without stiffness."""
        stiffness = case["stiffness"]
        if stiffness is None and case["damping"] is None:
            return
        context = click.get_current_context()
        if not case["coupling"]:
            raise click.UsageError("--stiffness and --damping name the wall of --coupling; give it too", context)
        if stiffness is None or stiffness <= 0.0:
            raise click.UsageError("the wall of --coupling needs --stiffness above 0", context)

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        return super().circumstances(case) | {"operator": None}

    def compute(self, case: CommandLine) -> Guarantees:
        wall = None if case["stiffness"] is None else (case["stiffness"], case["damping"] or 0.0)
        return case.point.guarantees(coupling=case["coupling"], wall=wall, progress=case.progress)

    def reason(self, case: CommandLine, result: Guarantees) -> str | None:
        return result.refusal or (NOTHING if result.is_empty else None)

    def pages(self, case: CommandLine, result: Guarantees, document: Mapping[str, Any]) -> Iterator[Any]:
        """A row for each guarantee, the premises that are not known, and the couplings where they are wanted."""
        withheld = result.refusal  # said of all guarantees at once, below the rows
        rows = [
            (
                one.name,
                "none" if one.region.reason == withheld is not None else _stiffest_text(one.region),
                one.meaning,
            )
            for one in result.guarantees
        ]
        yield answer_table(["guarantee", "largest stiffness", "what it means"], rows)
        yield from (premise.reason for premise in result.premises if premise.holds is None)
        coupled = result.couplings
        if coupled is None:
            return
        if coupled.reason is not None:
            yield f"couplings: {coupled.reason}"
            return
        yield answer_table(
            ["coupling", "stiffest"], [(name, _stiffest_text(one)) for name, one in coupled.regions.items()]
        )
        if coupled.limit is not None:
            yield _limit_sentence(coupled.limit)

    def draw(self, case: CommandLine, result: Guarantees) -> Figure:
        """The guarantees; below them the couplings where there are any."""
        from zwidth.show.figures.guarantees import draw_couplings, draw_guarantees
        from zwidth.show.figures.plots import size_of
        from zwidth.show.figures.style import figure

        drawing, ax = figure(*size_of(result))
        if result.couplings is not None and result.couplings.reason is None:
            drawing.set_size_inches(6.2, 8.0)
            ax.set_subplotspec(drawing.add_gridspec(2, 1)[0])
            draw_couplings(drawing.add_subplot(2, 1, 2), result.couplings)
        draw_guarantees(ax, result)
        return drawing


def _stiffest_text(region: Region) -> str:
    """The stiffest wall of a region with its damping, and the warning on it; or why there is none."""
    if region.reason is not None:
        return f"none: {region.reason}"
    lacking = "" if region.warning is None else f"; {region.warning}"
    stiffest = f"{amount(region.stiffness_max, 'N/m')} at {amount(region.damping_at_stiffness_max, 'N s/m')}"
    return stiffest + lacking


def _limit_sentence(limit: Coupling) -> str:
    """Sentence on the stiffest coupling with which the wall is stable with every passive operator."""
    if not limit.needed:
        return "the wall needs no coupling: it is stable with every passive operator"
    return (
        f"the wall needs a coupling no stiffer than {amount(limit.stiffness, 'N/m')}, damped by "
        f"{amount(limit.damping, 'N s/m')}; the hand then feels {amount(limit.felt_stiffness, 'N/m')}"
    )
