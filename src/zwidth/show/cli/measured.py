"""What `zwidth chart` and `zwidth check` say of a device that is known by its measured response."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from zwidth.show.cli.answer import Answer, deliver, sheet
from zwidth.show.cli.command import NO_MODEL
from zwidth.show.cli.failures import computing
from zwidth.show.cli.heading import heading
from zwidth.show.output import DATA, replacing, write_data
from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart
    from zwidth.chart.measured.chart import MeasuredChart
    from zwidth.chart.measured.usable_frequencies import Stretch
    from zwidth.device.device import Device
    from zwidth.show.cli.chart import Window
    from zwidth.show.cli.options import Question
    from zwidth.show.cli.points import Walls

SHOWN: Final = 6  # stretches named on a terminal
MOST_UNMEASURED: Final = 0.1  # of the frequencies up to half the sampling rate, before the heading says so
OPEN: Final = (
    "the measured edge does not close round the stable walls: frequencies are missing; measure up to half the "
    "sampling rate"
)


def answer_chart(
    question: Question, device: Device, path: Path | None, window: Window | None, as_json: bool
) -> int:
    """`zwidth chart` for a device with a [response]."""
    from zwidth.show.cli.chart import NO_WALL, rows

    found = _charted(question, device)
    common = cast("StabilityChart", found)  # the fields asked for are the same in both
    document = question.facts(device) | found.document() | {"decided": True, "warning": warning(found)}
    if path is not None:
        document["file"] = str(path)
    written = [] if path is None else [f"written: {path}"]
    reason = None if found.stiffness_max == found.stiffness_max else OPEN if found.open else NO_WALL
    if path is not None:
        _write(path, found, document | ({} if reason is None else {"reason": reason}), window)

    def pages() -> list[Any]:
        warnings = [f"warning: {text}" for text in [warning(found)] if text]
        return [heading(question, device), *warnings, sheet([*rows(common), *more_rows(found)]), *written]

    return deliver(Answer(document, pages, reason), as_json)


def without_model(question: Question, device: Device, unanswered: Mapping[str, Any], as_json: bool) -> int:
    """The answer of a command that needs a model, for a device with a [response]: none, and why.

    unanswered  what the command's document holds besides the facts where it has no answer
    Raises      DeviceError  for a posture, direction, assembly or model, which such a device does not have
    """
    question.as_measured(device)
    return deliver(Answer(question.facts(device) | dict(unanswered), reason=NO_MODEL), as_json)


def _charted(question: Question, device: Device) -> MeasuredChart:
    if device.response is None:
        from zwidth.chart.hysteretic import hysteretic_chart

        with computing(question):
            return hysteretic_chart(question.point(device).loop)
    from zwidth.chart.measured.chart import measured_chart

    question.as_measured(device)
    with computing(question):
        return measured_chart(device.response, device.controller)


def _write(path: Path, chart: MeasuredChart, document: dict[str, Any], window: Window | None) -> None:
    if path.suffix.lower() in DATA:
        write_data(path, document, chart.table())
        return
    from zwidth.show.figures.measured import draw_measured_chart
    from zwidth.show.figures.style import figure, save

    drawing, ax = figure()
    draw_measured_chart(ax, chart, window=window)
    with replacing(path) as draft:
        save(drawing, draft)


def warning(chart: MeasuredChart) -> str | None:
    """What a response cut short leaves unseen; None where it reaches nearly up to half the sampling rate."""
    share, half = chart.measured_up_to_share, 0.5 / chart.loop.period
    if share >= 1.0 - MOST_UNMEASURED:
        return None
    return (
        f"measured up to {amount(share * half, 'Hz')}, {typed(percent(share))} of half the sampling rate "
        f"({amount(half, 'Hz')}); "
        "walls that fail above are not seen"
    )


def more_rows(chart: MeasuredChart) -> Iterator[tuple[str, str]]:
    """Rows for people, below those of every chart."""
    if chart.band is not None:
        low, high = amount(chart.band.stiffness_low, "N/m"), amount(chart.band.stiffness_high, "N/m")
        yield "largest stiffness from", f"{low} to {high} within {chart.band.meaning}"
    if chart.stiffness_max_of_sweeps:
        yield "in the single sweeps", ", ".join(amount(K, "N/m") for K in chart.stiffness_max_of_sweeps)
    response = chart.loop.response
    kept, given = len(chart.loop.angles), len(response.frequency)
    measured = f"{kept} of {given} frequencies used, {chart.integrators} integrators"
    yield "response", f"{measured}; {response.note}" if response.note else measured
    for stretch in chart.unusable[:SHOWN]:
        yield "not to be relied on", told(stretch)
    if len(chart.unusable) > SHOWN:
        yield "", f"and {len(chart.unusable) - SHOWN} more stretches; --json holds them all"


def told(stretch: Stretch) -> str:
    """A stretch in words."""
    where = "; the edge of the stable walls runs through it" if stretch.on_edge else ""
    return f"{amount(stretch.low, 'Hz')} to {amount(stretch.high, 'Hz')}: {stretch.reason}{where}"


def judged(question: Question, device: Device, walls: Walls) -> list[dict[str, Any]]:
    """One entry per wall, as `zwidth check` gives it; the spectral radius is not known without a model."""
    found = _charted(question, device).check([K for K, _ in walls], [B for _, B in walls])
    return [
        {
            "stiffness_N_per_m": K,
            "damping_Ns_per_m": B,
            "verdict": verdict,
            "spectral_radius": None,
            "frequency_Hz": frequency,
            "roots_outside": outside,
        }
        for (K, B), verdict, frequency, outside in zip(
            walls, found.names, found.frequency.tolist(), found.outside.tolist(), strict=True
        )
    ]
