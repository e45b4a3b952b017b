"""`zwidth chart`: which walls are stable."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import click

from zwidth.show.cli import measured
from zwidth.show.cli.answer import Answer, deliver, sheet
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.options import Numbers, Question, about_a_device, as_json, example, output_option
from zwidth.show.motions import counted
from zwidth.show.output import DATA, FIGURES, destination, replacing, write_data
from zwidth.show.units import amount, radius, vector

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart
    from zwidth.chart.decay import FastestDecay
    from zwidth.chart.several_directions.chart import MultiChart
    from zwidth.device.device import Device

KEYS: Final = (
    "regions",
    "boundary",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "frequency_at_stiffness_max_Hz",
    "frequencies_at_stiffness_max_Hz",
    "damping_max_Ns_per_m",
    "stable_area_N2s_per_m2",
    "fastest_decay",
    "fastest_decay_in_first_quadrant",
    "unobserved_modes",
)
NO_WALL: Final = "no stable wall has K > 0 and B >= 0"

Window = tuple[float, float, float, float]


def _ordered(ctx: click.Context, param: click.Parameter, window: Window | None) -> Window | None:
    if window and not (window[0] < window[1] and window[2] < window[3]):
        raise click.BadParameter("needs KMIN < KMAX and BMIN < BMAX, such as 0,8000,0,30")
    return window


@click.command(
    short_help="Find the walls that DEVICE renders stably.",
    epilog=example(
        "zwidth chart my-device.toml --at 0.1,0.2 --direction 0,1",
        "zwidth chart my-device.toml --set loop.delay_samples=1 --output chart.svg",
    ),
)
@about_a_device
@click.option(
    "--window",
    type=Numbers("KMIN,KMAX,BMIN,BMAX", (4,), "0,8000,0,30"),
    callback=_ordered,
    help="Part of the chart that a figure shows; results are never clipped.",
)
@click.option(
    "--with-direction",
    "others",
    type=Numbers("DX,DY[,DZ]", (2, 3), "1,0"),
    multiple=True,
    help="Another direction under the same wall law, as in a corner; repeatable.",
)
@output_option("Write a figure (.png .svg .pdf) or the data (.csv: the boundary, .json).")
@as_json
def chart(
    question: Question,
    window: Window | None,
    others: tuple[tuple[float, ...], ...],
    output: str | None,
    as_json: bool,
) -> int:
    """Find the walls that DEVICE renders stably: the exact chart of stiffness and damping."""
    path = None if output is None else destination(output, FIGURES + DATA)
    device = question.device()
    if others and device.mechanism is None:
        raise BadInput(
            f"{question.name}: has no [mechanism], and so one direction only; leave out --with-direction"
        )
    if question.charted_by_response(device):
        return measured.answer_chart(question, device, path, window, as_json)
    if others:
        question.of_several_directions(device)
    along = [device.direction(direction) for direction in (question.direction, *others)] if others else []
    facts = question.facts(device) | ({"directions": along} if along else {})
    try:
        with computing(question):
            found = _charted_together(question, device, along) if along else _charted(question, device)
    except NoAnswer as none:
        unanswered = facts | dict.fromkeys(KEYS) | {"decided": none.decided}
        return deliver(Answer(unanswered, reason=str(none)), as_json)
    answer = _answer(question, device, found, path, facts)
    if path is not None:
        _write(path, found, answer, window)
    return deliver(answer, as_json)


def _charted(question: Question, device: Device) -> StabilityChart:
    from zwidth.chart.chart import stability_chart

    return stability_chart(question.point(device).loop)


def _charted_together(question: Question, device: Device, along: list[Any]) -> MultiChart:
    """One wall law over several directions."""
    from zwidth.chart.several_directions.chart import multi_chart

    point = device.at(question.at, directions=along, assembly=question.assembly, model=question.model)
    return multi_chart(point.loop_of_directions)


def _answer(
    question: Question,
    device: Device,
    chart: StabilityChart | MultiChart,
    path: Path | None,
    facts: dict[str, Any],
) -> Answer:
    document = facts | chart.document() | {"decided": True}
    if path is not None:
        document["file"] = str(path)

    def pages() -> Iterator[Any]:
        yield heading(question, device)
        together = (
            [("under one law", " and ".join(map(vector, facts["directions"])))] if "directions" in facts else []
        )
        yield sheet([*together, *rows(chart)])
        if path is not None:
            yield f"written: {path}"

    reason = None if chart.stiffness_max == chart.stiffness_max else NO_WALL
    return Answer(document, lambda: list(pages()), reason)


def rows(chart: StabilityChart | MultiChart) -> Iterator[tuple[str, str]]:
    yield "largest stiffness", _stiffest(chart)
    yield "largest damping", _most_damped(chart)
    yield "stable area", amount(chart.stable_area, "N²s/m²")
    yield from _decays(chart.fastest_decay_in_first_quadrant, chart.fastest_decay)
    if len(chart.regions) != 1:
        yield "stable regions", f"{len(chart.regions)}"
    if chart.unobserved_modes:
        from zwidth.loop.loop import Loop
        from zwidth.loop.unobserved_instability import hidden_instability

        names = ", ".join(counted(chart.unobserved_modes))
        warned = "; WARNING: so that the device runs away, whatever the wall"
        # several directions are those of a mechanism, whose springs and dampers feed no motion
        runs_away = isinstance(chart.loop, Loop) and hidden_instability(chart.loop)
        yield "moved by no wall", names + (warned if runs_away else "")


def _decays(buildable: FastestDecay | None, of_all: FastestDecay | None) -> Iterator[tuple[str, str]]:
    """The fastest decay with K, B >= 0 first, and that of all walls where it is another."""
    label = "fastest decay"
    for fastest in (buildable, None if of_all == buildable else of_all):
        if fastest:
            wall = f"{amount(fastest.stiffness, 'N/m')} and {amount(fastest.damping, 'Ns/m')}"
            yield label, f"at {wall}: spectral radius {radius(fastest.spectral_radius)}"
        label = "with K or B < 0"


def _most_damped(chart: StabilityChart | MultiChart) -> str:
    damping = amount(chart.damping_max, "Ns/m")
    if chart.damping_max > 0.0 or not chart.regions:
        return damping
    return f"{damping}, because walls of small stiffness are unstable at any damping"


def _stiffest(chart: StabilityChart | MultiChart) -> str:
    if chart.stiffness_max != chart.stiffness_max:
        return "none"
    frequencies = " and ".join(amount(frequency, "Hz") for frequency in chart.frequencies_at_stiffness_max)
    return (
        f"{amount(chart.stiffness_max, 'N/m')} at {amount(chart.damping_at_stiffness_max, 'Ns/m')} of damping; "
        f"there it vibrates at {frequencies}"
    )


def _write(path: Path, chart: StabilityChart | MultiChart, answer: Answer, window: Window | None) -> None:
    if path.suffix.lower() in DATA:
        reason = {} if answer.reason is None else {"reason": answer.reason}
        write_data(path, answer.document | reason, chart.table())
        return
    from zwidth.show.figures.stability import draw_chart
    from zwidth.show.figures.style import figure, save

    drawing, ax = figure()
    draw_chart(ax, cast("StabilityChart", chart), window=window)  # of which it draws what both have
    with replacing(path) as draft:
        save(drawing, draft)
