"""The chart of a measured device: measured points on the edge, the band in doubt, what cannot be relied on."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.chart.measured.chart import MeasuredChart
from zwidth.chart.measured.usable_frequencies import UnusableRange
from zwidth.show.figures.stability import Window, edges_of, frame, mark_stiffest
from zwidth.show.figures.style import BLACK, BLUE, GREY, ORANGE, STABLE, VERMILION, legend_above
from zwidth.show.units import quantity

LONGEST_LIST = 3  # stretches named in the legend


def draw_measured_chart(ax: Axes, chart: MeasuredChart, window: Window | None = None) -> None:
    """The stable walls filled, the interpolated edge, the measured points on it, and the band of the error.

    Walls, edge and points are nominal. Marked are the stiffest wall that is certain, and the nominal one.

    window  what to show; left out: the regions' box and 5 %
    """
    for n, ring in enumerate(chart.regions):
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label="" if n else "stable walls"))
    if chart.band is not None:
        for n, ring in enumerate(chart.band.regions):
            ax.add_patch(
                Polygon(
                    ring,
                    facecolor=ORANGE,
                    edgecolor="none",
                    alpha=0.45,
                    zorder=1.8,
                    label="" if n else f"in doubt: {chart.band.meaning}",
                )
            )
    for ring in edges_of(chart.regions):
        ax.plot(*ring.T, color=BLACK, linewidth=0.9)
    for n, arc in enumerate(chart.boundary):
        if 0.0 < arc.frequency[0] < 0.5 / chart.loop.period * (1.0 - 1e-9):
            ax.plot(
                arc.stiffness,
                arc.damping,
                color=BLUE,
                marker=".",
                markersize=3.0,
                linestyle="none",
                label="" if n else "measured",
            )
    _unusable(ax, chart)
    if chart.stiffness_max == chart.stiffness_max:
        mark_stiffest(ax, chart)
    if chart.band is not None and chart.stiffness_max_nominal == chart.stiffness_max_nominal:
        ax.plot(
            [chart.stiffness_max_nominal],
            [chart.damping_at_stiffness_max_nominal],
            color=BLACK,
            marker="x",
            linestyle="none",
            zorder=4.9,
            label=f"stiffest as measured: {quantity(chart.stiffness_max_nominal, 'N/m')}",
        )
    frame(ax, window or chart.box, empty=not chart.regions)
    legend_above(ax)


def _unusable(ax: Axes, chart: MeasuredChart) -> None:
    """The edge within unusable stretches, dashed; each stretch a line of the legend."""
    edge = chart.edge
    f = edge.angles / (2.0 * np.pi * chart.loop.period)
    for n, stretch in enumerate(chart.unusable[:LONGEST_LIST]):
        inside = (f >= stretch.low) & (f <= stretch.high)
        K, B = np.where(inside, edge.walls[:, 0], np.nan), np.where(inside, edge.walls[:, 1], np.nan)
        shown = stretch.on_edge and np.any(inside)
        ax.plot(
            K if shown else [],
            B if shown else [],
            color=VERMILION if shown else GREY,
            linestyle=((0, (1.2, 1.2)), (0, (4, 1.5)), (0, (6, 1.5, 1.2, 1.5)))[n],
            linewidth=2.2,
            label=_stretch_text(stretch),
        )
    if len(chart.unusable) > LONGEST_LIST:
        ax.plot([], [], linestyle="none", label=f"and {len(chart.unusable) - LONGEST_LIST} more stretches")


def _stretch_text(stretch: UnusableRange) -> str:
    why = stretch.reason.partition(",")[0].partition(";")[0]
    why = why if len(why) <= 44 else "uncertain between frequencies"
    return f"unusable: {quantity(stretch.low, 'Hz')} to {quantity(stretch.high, 'Hz')}, {why}"
