"""The stability chart: which walls are stable, and the same for several models laid over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.show.figures.style import BLACK, GREY, LINES, STABLE, VERMILION, draw_empty, label, legend_above
from zwidth.show.units import quantity

# KMIN, KMAX [N/m], BMIN, BMAX [N s/m]
Window = tuple[float, float, float, float]


def draw_chart(ax: Axes, chart: StabilityChart, window: Window | None = None) -> None:
    """The stable walls filled, their edge, and the stiffest wall marked with its numbers.

    window  what to show; left out: the regions' box and 5 %
    """
    in_doubt = bool(getattr(chart, "doubt", ""))
    for n, ring in enumerate(chart.regions):
        text = "stable walls found; there may be others" if in_doubt else "stable walls"
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label="" if n else text))
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
    shown = next((chart for chart in charts.values() if chart.regions), first)
    for ring in first.regions:
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none"))
    # the first on top: where models agree it is the one to be seen
    for n, (name, chart) in enumerate(charts.items()):
        colour, dashes = LINES[n % len(LINES)]
        text = name if chart.regions else f"{name}: nothing stable"
        for k, ring in enumerate(edges_of(chart.regions) or (np.full((1, 2), np.nan),)):
            ax.plot(*ring.T, color=colour, linestyle=dashes, label="" if k else text, zorder=4.0 - 0.1 * n)
    frame(ax, window or shown.box, empty=not shown.regions)
    legend_above(ax, columns=2)


def edges_of(rings: Sequence[Floats]) -> list[Floats]:
    """The edges of what several rings cover, (k, 2) with nan between pieces of an edge.

    A cell with a hole is cut into rings: what two of them share is a cut, and no edge.
    """
    if not len(rings):
        return []
    pieces = [np.hstack([ring[:-1], ring[1:]]) for ring in rings]
    ends = np.vstack(pieces)
    backwards = (ends[:, 0] > ends[:, 2]) | ((ends[:, 0] == ends[:, 2]) & (ends[:, 1] > ends[:, 3]))
    ordered = np.where(backwards[:, None], ends[:, [2, 3, 0, 1]], ends)
    _, inverse, count = np.unique(ordered, axis=0, return_inverse=True, return_counts=True)
    shared = np.split(count[inverse.ravel()] > 1, np.cumsum([len(piece) for piece in pieces])[:-1])
    outlines = []
    for ring, cut in zip(rings, shared, strict=True):
        # a point in the middle of each cut, without coordinates, ends the line there
        at = np.flatnonzero(cut) + 1
        outlines.append(np.insert(np.asarray(ring, dtype=float), at, np.nan, axis=0))
    return outlines


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
        label=f"stiffest{' found' if getattr(chart, 'doubt', '') else ''}: {numbers}; oscillates at {vibration}",
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
        draw_empty(ax)
