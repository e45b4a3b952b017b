"""The stability chart: which walls are stable, and the same for several models laid over each other."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.chart.chart import StabilityChart
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.show.figures.style import BLACK, GREY, LINES, STABLE, VERMILION, label, legend_above, tell_empty
from zwidth.show.units import quantity

# KMIN, KMAX [N/m], BMIN, BMAX [N s/m]
Window = tuple[float, float, float, float]


def draw_chart(ax: Axes, chart: StabilityChart, window: Window | None = None) -> None:
    """The stable walls filled, their edge, and the stiffest wall marked with its numbers.

    window  what to show; left out: the regions' box and 5 %
    """
    for n, ring in enumerate(chart.regions):
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label="" if n else "stable walls"))
    for arc in chart.boundary:
        ax.plot(arc.stiffness, arc.damping, color=BLACK, solid_capstyle="round")
    if not isnan(chart.stiffness_max):
        mark_stiffest(ax, chart)
    frame(ax, window or chart.box, empty=not chart.regions)
    legend_above(ax)


def draw_models(ax: Axes, charts: Mapping[str, StabilityChart], window: Window | None = None) -> None:
    """The edges of several models' charts over each other (thesis Fig. 4.4).

    charts  label -> chart; the first is the one that the others approximate, and its region is filled
    window  what to show; left out: the box of the first that has stable walls, and 5 %
    """
    first = next(iter(charts.values()))
    seen = next((chart for chart in charts.values() if chart.regions), first)
    for ring in first.regions:
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none"))
    # the first on top: where models agree it is the one to be seen
    for n, (name, chart) in enumerate(charts.items()):
        colour, dashes = LINES[n % len(LINES)]
        text = name if chart.regions else f"{name}: nothing stable"
        for k, ring in enumerate(chart.regions or (np.full((1, 2), np.nan),)):
            ax.plot(*ring.T, color=colour, linestyle=dashes, label="" if k else text, zorder=4.0 - 0.1 * n)
    frame(ax, window or seen.box, empty=not seen.regions)
    legend_above(ax, columns=2)


def mark_stiffest(ax: Axes, chart: StabilityChart | MeasuredChart) -> None:
    """The stiffest wall, with its numbers in the legend."""
    numbers = f"{quantity(chart.stiffness_max, 'N/m')} at {quantity(chart.damping_at_stiffness_max, 'Ns/m')}"
    vibration = " and ".join(quantity(f, "Hz") for f in chart.frequencies_at_stiffness_max)
    ax.plot(
        [chart.stiffness_max],
        [chart.damping_at_stiffness_max],
        marker="o",
        markersize=6.0,
        markerfacecolor="white",
        markeredgecolor=VERMILION,
        markeredgewidth=1.6,
        linestyle="none",
        zorder=5.0,
        label=f"stiffest: {numbers}; vibrates at {vibration}",
    )


def frame(ax: Axes, window: Window, *, empty: bool) -> None:
    """Limits, labels, and the axes K = 0, B = 0 where they are in view."""
    K0, K1, B0, B1 = window
    ax.set_xlim(K0, K1)
    ax.set_ylim(B0, B1)
    for draw, low, high in ((ax.axvline, K0, K1), (ax.axhline, B0, B1)):
        if low < 0.0 < high:
            draw(0.0, color=GREY, linewidth=0.6, zorder=1.5)
    label(ax.xaxis, "Virtual stiffness K", "N/m")
    label(ax.yaxis, "Virtual damping B", "Ns/m")
    if empty:
        tell_empty(ax)
