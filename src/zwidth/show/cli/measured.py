"""What `zwidth chart` says of a chart by a frequency response, beside what it says of every chart."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from zwidth.show.units import amount, percent, typed

if TYPE_CHECKING:
    from zwidth.chart.measured.chart import MeasuredChart
    from zwidth.chart.measured.usable_frequencies import Stretch

SHOWN: Final = 6  # stretches named on a terminal
MOST_UNMEASURED: Final = 0.1  # of the frequencies up to half the sampling rate, before the heading says so
OPEN: Final = (
    "the measured edge does not close round the stable walls: frequencies are missing; measure up to half the "
    "sampling rate"
)


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


def measured_rows(chart: MeasuredChart) -> Iterator[tuple[str, str]]:
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
