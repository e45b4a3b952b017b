"""Measured points of a stability boundary over the exact chart (thesis Figs. 3.7, 3.12)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.chart.chart import StabilityChart
from zwidth.show.figures.stability import Window, frame
from zwidth.show.figures.style import BLACK, BLUE, GREEN, STABLE, VERMILION, legend_above
from zwidth.study.boundary.measured_boundary import MeasuredPoint
from zwidth.study.boundary.points_file import UserPoint

EDGE_STYLES = {"lower": (VERMILION, "o"), "upper": (BLUE, "s"), "tip": (GREEN, "^")}
TITLES = {
    "lower": "lower edge, damping bisected",
    "upper": "upper edge, damping bisected",
    "tip": "tip, stiffness bisected",
}

# of a user's own points: marker and title, of which edges or verdicts, and whether the marker is filled
OWN_POINT_STYLES = (
    (("D", "your points"), ("lower", "upper", "tip"), True),
    (("P", "your walls, stable"), ("stable",), True),
    (("X", "your walls, unstable"), ("unstable",), False),
)


class ErrorBarPoint(NamedTuple):
    """A point to draw: its wall, and lowest and highest along what was bisected; nan: no bar.

    edge     lower, upper or tip; of a wall that was tried the verdict, stable or unstable
    unsure   the verdict changes more than once along the line
    """

    stiffness: float
    damping: float
    edge: str
    low: float
    high: float
    unsure: bool = False


def measured_bars(points: Iterable[MeasuredPoint]) -> list[ErrorBarPoint]:
    """Points of a virtual experiment, with the lowest and highest of their trials."""
    return [
        ErrorBarPoint(point.stiffness, point.damping, point.edge, point.low, point.high, point.unsure)
        for point in points
    ]


def own_bars(points: Iterable[UserPoint]) -> list[ErrorBarPoint]:
    """Points of somebody's own; one that names neither edge nor verdict is drawn as a lower edge."""
    return [
        ErrorBarPoint(point.stiffness, point.damping, point.edge, point.stiffness_low, point.stiffness_high)
        if point.edge == "tip"
        else ErrorBarPoint(
            point.stiffness,
            point.damping,
            point.edge or point.verdict or "lower",
            point.damping_low,
            point.damping_high,
        )
        for point in points
    ]


def draw_experiment(
    ax: Axes,
    points: Sequence[ErrorBarPoint],
    chart: StabilityChart | None,
    own_points: Sequence[ErrorBarPoint] = (),
    window: Window | None = None,
) -> None:
    """The exact chart filled, with the measured points and their bars over it.

    points      those that are unsure are crossed
    own_points  points of somebody's own, drawn in black
    window      what to show; None: chart and points for K > 0, and 5 %
    """
    for n, ring in enumerate(() if chart is None else chart.regions):
        title = "" if n else "stable, exact and linear"
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label=title))
    for arc in () if chart is None else chart.boundary:
        ax.plot(arc.stiffness, arc.damping, color=BLACK, linewidth=1.0, solid_capstyle="round")
    for edge, (colour, marker) in EDGE_STYLES.items():
        _draw_points(
            ax, [point for point in points if point.edge == edge], colour, marker, TITLES[edge], filled=False
        )
    _draw_crosses(ax, [point for point in points if point.unsure])
    for looks, kinds, filled in OWN_POINT_STYLES:
        _draw_points(ax, [point for point in own_points if point.edge in kinds], BLACK, *looks, filled=filled)
    frame(ax, window or _default_window(points, own_points, chart), empty=False)
    legend_above(ax, columns=2)


def _draw_points(
    ax: Axes, points: Sequence[ErrorBarPoint], colour: str, marker: str, title: str, *, filled: bool
) -> None:
    """Draw points as marks of one kind, with bars along what was bisected: of tips the stiffness."""
    if not points:
        return
    for upright in (True, False):  # bars of points on an edge, along damping; then of tips, along stiffness
        with_bars = [point for point in points if (point.edge != "tip") == upright and point.high > point.low]
        if with_bars:
            places = np.array([(point.stiffness, point.damping) for point in with_bars])
            bisected = places[:, 1 if upright else 0]
            ends = np.abs(np.array([(point.low, point.high) for point in with_bars]).T - bisected)
            x, y = places.T
            up, across = (ends, None) if upright else (None, ends)
            ax.errorbar(x, y, up, across, fmt="none", ecolor=colour, elinewidth=1.0, capsize=2.2, zorder=4.0)
    ax.plot(
        [point.stiffness for point in points],
        [point.damping for point in points],
        marker=marker,
        markersize=4.5,
        markerfacecolor=colour if filled else "white",
        markeredgecolor=colour,
        markeredgewidth=1.2,
        linestyle="none",
        zorder=5.0,
        label=title,
    )


def _draw_crosses(ax: Axes, unsure: Sequence[ErrorBarPoint]) -> None:
    """Crosses over the points whose verdict changes more than once."""
    if unsure:
        K, B = [point.stiffness for point in unsure], [point.damping for point in unsure]
        title = "unsure: verdict changes more than once"
        ax.plot(K, B, "x", color=BLACK, markersize=7.0, markeredgewidth=0.9, zorder=6.0, label=title)


def _default_window(
    points: Sequence[ErrorBarPoint], own_points: Sequence[ErrorBarPoint], chart: StabilityChart | None
) -> Window:
    """KMIN, KMAX, BMIN, BMAX of what is shown: the points with their bars, and the chart about them."""
    K, B = [0.0], [0.0]
    for point in (*points, *own_points):
        ends = [end for end in (point.low, point.high) if np.isfinite(end)]
        K += [point.stiffness, *(ends if point.edge == "tip" else [])]
        B += [point.damping, *([] if point.edge == "tip" else ends)]
    if chart is not None and chart.regions:
        # a chart that reaches many times farther would press the points into a corner
        # hence up to 2.5 times the points, downwards by as much more as they go up
        _, K1, B0, B1 = chart.box
        K.append(min(K1, 2.5 * max(K)) if max(K) > 0.0 else K1)
        B += [max(B0, 2.5 * min(B) - max(B)), min(B1, 2.5 * max(B)) if max(B) > 0.0 else B1]
    spread = max(K) or 1.0, (max(B) - min(B)) or 1.0
    return -0.04 * spread[0], max(K) + 0.05 * spread[0], min(B) - 0.05 * spread[1], max(B) + 0.05 * spread[1]
