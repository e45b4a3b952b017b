"""`zwidth chart`: which walls are stable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf
from typing import TYPE_CHECKING, Any, Final

from zwidth.loop.motion_names import listed_names
from zwidth.questions import CHART
from zwidth.show.cli import wall_law
from zwidth.show.cli.answer import two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.options import Ranges, options_of
from zwidth.show.units import amount, percent, radius, typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.chart.chart_base import Chart
    from zwidth.chart.decay import FastestDecay
    from zwidth.chart.measured.chart import MeasuredChart
    from zwidth.chart.measured.loop import UnusableRange

NO_WALL: Final = "no stable wall has K > 0 and B >= 0"
SHOWN_STRETCHES: Final = 6  # stretches named on a terminal
MOST_UNMEASURED: Final = 0.1  # of the frequencies up to half the sampling rate, before the heading says so
OPEN_EDGE: Final = (
    "the measured edge does not close round the stable walls: frequencies are missing; measure up to half the "
    "sampling rate"
)

OPEN_WHOLE_EDGE: Final = (
    "the measured edge does not close round the stable walls, although frequencies reach half the sampling rate: "
    "the phase must fall with frequency; turn the sign of the imaginary part if it rises, and see that each row "
    "has the reading and the force sent after it"
)
NO_CERTAIN_WALL: Final = (
    "the data leave no wall certain: within their error, none with K > 0 and B >= 0 is stable for every device "
    "that they may be of; record longer, with more force, or repeat the sweep"
)


class ChartCommand(Command):
    """Find the walls that DEVICE renders stably: the exact chart of stiffness and damping."""

    name = "chart"
    summary = "Find the walls that DEVICE renders stably."
    examples = (
        "zwidth chart my-device.toml --at 0.1,0.2 --direction 0,1",
        "zwidth chart my-device.toml --set loop.delay_samples=1 --output chart.svg",
        "zwidth chart my-device.toml --direction 0,1 --with-direction 1,0 --relative-stiffness 1,0.2",
    )
    options = options_of(CHART, window=Ranges(CHART["window"]), **wall_law.KINDS)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: the boundary, .json)."
    keys = (
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
    may_be_undecided = True
    takes_responses = True

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        return wall_law.circumstances(case)

    def compute(self, case: CommandLine) -> Chart:
        return wall_law.operating_point(case).chart().drawn()  # its outlines too, while errors are translated

    def document(self, case: CommandLine, result: Chart) -> dict[str, Any]:
        """The chart's own document; of a measured response with the warning that it was cut short."""
        from zwidth.chart.measured.chart import MeasuredChart

        warning: dict[str, Any] = (
            {"warning": unmeasured_warning(result)} if isinstance(result, MeasuredChart) else {}
        )
        return result.document() | warning

    def reason(self, case: CommandLine, result: Chart) -> str | None:
        """Why there is no largest stiffness (nan); None where there is one."""
        if result.stiffness_max == result.stiffness_max:
            return None
        if doubt := getattr(result, "doubt", ""):
            return f"no stable wall with K > 0 and B >= 0 was found; this is undecided: {doubt}"
        from zwidth.chart.measured.chart import MeasuredChart

        return no_measured_wall(result) if isinstance(result, MeasuredChart) else NO_WALL

    def pages(self, case: CommandLine, result: Chart, document: Mapping[str, Any]) -> Iterator[Any]:
        """Warnings, then rows on the directions, on the chart, and on a measured response."""
        if document.get("warning"):
            yield f"warning: {document['warning']}"
        if document.get("decided") is False and result.regions:
            yield f"warning: {document['reason']}"
        from zwidth.chart.measured.chart import MeasuredChart

        last = measured_rows(result) if isinstance(result, MeasuredChart) else ()
        yield two_columns([*wall_law.rows(wall_law.circumstances(case)), *_rows(result), *last])

    def draw(self, case: CommandLine, result: Chart) -> Figure:
        from zwidth.show.figures.plots import draw_any_chart
        from zwidth.show.figures.style import figure

        drawing, ax = figure()
        draw_any_chart(ax, result, case["window"])
        return drawing


def _rows(chart: Chart) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on a chart of any kind: stiffness, damping, area, decay, what no wall affects."""
    found = " found" if getattr(chart, "doubt", "") else ""
    yield f"largest stiffness{found}", _stiffest_text(chart)
    yield f"largest damping{found}", _largest_damping_text(chart)
    yield f"stable area{found}", amount(chart.stable_area, "N^2 s/m^2")
    yield from _decay_rows(chart.fastest_decay_in_first_quadrant, chart.fastest_decay)
    if len(chart.regions) != 1:
        yield "stable regions", f"{len(chart.regions)}"
    if chart.unobserved_modes:
        from zwidth.chart.chart import StabilityChart
        from zwidth.loop.loop import unobserved_instability

        names = ", ".join(listed_names(chart.unobserved_modes))
        warned = "; WARNING: this motion is unstable, whatever the wall"
        # several directions are those of a mechanism, whose springs and dampers feed no motion
        runs_away = isinstance(chart, StabilityChart) and unobserved_instability(chart.loop)
        yield "not affected by a wall", names + (warned if runs_away else "")
    yield from _load_rows(chart)


def _load_rows(chart: Chart) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on the equilibrium of a device under load; none without load, or of other charts."""
    from zwidth.chart.chart import StabilityChart
    from zwidth.show.load_text import balance_rows

    point = chart.operating_point
    if point is None or point.load is None or not isinstance(chart, StabilityChart):
        return
    yield from balance_rows(point, chart.stiffness_max)
    if (other := chart.other_branch) is not None:
        names = ", ".join(point.drives.names[i] for i in point.equilibrium.kinked)
        yield (
            "on the other branch",
            f"largest stiffness {_stiffest_text(other)} (of {names}, without torque, whose stiffness "
            "changes there; a wall stable on both branches is not proven stable for the device that switches "
            "between them)",
        )


def _decay_rows(buildable: FastestDecay | None, of_all: FastestDecay | None) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on the fastest decay: of walls with K, B >= 0, and of all if that is another wall."""
    label = "fastest decay"
    for fastest in (buildable, None if of_all == buildable else of_all):
        if fastest:
            wall = f"{amount(fastest.stiffness, 'N/m')} and {amount(fastest.damping, 'N s/m')}"
            yield label, f"at {wall}: spectral radius {radius(fastest.spectral_radius)}"
        label = "with K or B < 0"


def _largest_damping_text(chart: Chart) -> str:
    """The largest damping [N s/m]; why, where it is 0 although walls are stable."""
    damping = amount(chart.damping_max, "N s/m")
    if chart.damping_max > 0.0 or not chart.regions:
        return damping
    return f"{damping}, because walls of small stiffness are unstable at any damping"


def _stiffest_text(chart: Chart) -> str:
    """The largest stiffness [N/m], its damping and the frequencies of its limit; "none" without a stable wall."""
    if chart.stiffness_max != chart.stiffness_max:  # nan
        return "none"
    frequencies = " and ".join(amount(frequency, "Hz") for frequency in chart.frequencies_at_stiffness_max)
    return (
        f"{amount(chart.stiffness_max, 'N/m')} at {amount(chart.damping_at_stiffness_max, 'N s/m')} of damping; "
        f"at this limit it oscillates at {frequencies}"
    )


def no_measured_wall(chart: MeasuredChart) -> str:
    """Why a chart by a frequency response has no largest stiffness."""
    from zwidth.chart.measured.chart import hidden_walls

    if chart.open:
        return OPEN_EDGE if chart.measured_up_to_share < 1.0 else OPEN_WHOLE_EDGE
    if chart.band is None:
        return NO_WALL
    return "; ".join(filter(None, (NO_CERTAIN_WALL, hidden_walls(chart))))


def unmeasured_warning(chart: MeasuredChart) -> str | None:
    """What a response cut short leaves unseen; None where it reaches nearly up to half the sampling rate."""
    share, half = chart.measured_up_to_share, 0.5 / chart.loop.period
    if share >= 1.0 - MOST_UNMEASURED:
        return None
    return (
        f"measured up to {amount(share * half, 'Hz')}, {typed(percent(share))} of half the sampling rate "
        f"({amount(half, 'Hz')}); "
        "walls that are unstable only above it are not found"
    )


def measured_rows(chart: MeasuredChart) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on a chart by a frequency response, below those of every chart."""
    if chart.band is None:
        if not chart.open:  # an open edge has no numbers
            yield "error", "not known: neither coherence nor repeated sweeps are given; these are nominal numbers"
    else:
        yield "of the mean response", _nominal_text(chart)
        high = chart.band.stiffness_high
        limit = "not limited by the data" if high == inf else f"at most {amount(high, 'N/m')}"
        yield "error", f"{chart.band.meaning}; the largest stiffness is {limit}; area and regions are nominal"
    if chart.stiffness_max_of_sweeps:
        yield "in the single sweeps", ", ".join(amount(K, "N/m") for K in chart.stiffness_max_of_sweeps)
    response = chart.loop.response
    used, given = len(chart.loop.angles), len(response.frequency)
    measured = f"{used} of {given} frequencies used, {chart.integrators} integrators"
    yield "response", f"{measured}; {response.note}" if response.note else measured
    for stretch in chart.unusable[:SHOWN_STRETCHES]:
        yield "unreliable", stretch_text(stretch)
    if len(chart.unusable) > SHOWN_STRETCHES:
        yield "", f"and {len(chart.unusable) - SHOWN_STRETCHES} more ranges; --json lists all"


def _nominal_text(chart: MeasuredChart) -> str:
    """The largest stiffness [N/m] of the response as it was measured, its damping and the frequencies at it."""
    if chart.stiffness_max_nominal != chart.stiffness_max_nominal:  # nan
        return "none"
    frequencies = " and ".join(amount(f, "Hz") for f in chart.frequencies_at_stiffness_max_nominal)
    stiffness, damping = chart.stiffness_max_nominal, chart.damping_at_stiffness_max_nominal
    return f"{amount(stiffness, 'N/m')} at {amount(damping, 'N s/m')} of damping, limited at {frequencies}"


def stretch_text(stretch: UnusableRange) -> str:
    """A range of frequencies that cannot be used, in words: from where to where, and why."""
    where = "; the edge of the stable walls runs through it" if stretch.on_edge else ""
    return f"{amount(stretch.low, 'Hz')} to {amount(stretch.high, 'Hz')}: {stretch.reason}{where}"
