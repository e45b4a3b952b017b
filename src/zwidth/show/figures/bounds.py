"""Published conditions over the exact chart."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.chart.chart import StabilityChart
from zwidth.conditions import Bound
from zwidth.show.figures.stability import frame
from zwidth.show.figures.style import BLACK, LINES, STABLE, legend_above


def draw_bounds(ax: Axes, bounds: Iterable[Bound], chart: StabilityChart | None) -> None:
    """The stable walls with K, B >= 0, and the line of each condition that has one.

    The legend says which of them assume what is not so. Conditions that say nearly the same (2 % of the view) are
    drawn once, under the name of the first. The view is that of the exact chart.

    chart  None: only the conditions, over the dampings at which they admit stiffness
    """
    lines = [bound for bound in bounds if not bound.lacking]
    top = _highest(lines, chart)
    dampings = np.linspace(0.0, top[1], 1001)
    if chart is not None:
        for n, ring in enumerate(chart.regions):
            ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label="" if n else "stable, exact"))
        for arc in chart.boundary:
            ax.plot(arc.stiffness, arc.damping, color=BLACK, linewidth=0.8)
    drawn: list[np.ndarray] = []
    for bound in lines:
        stiffness = bound.stiffness_max_at(dampings)
        # what is out of view is drawn at its border, and told apart from nothing else there
        stiffness = np.where(stiffness > 0.0, np.minimum(stiffness, 1.01 * top[0]), np.nan)
        if not np.any(np.isfinite(stiffness)) or any(_same(stiffness, other, top[0]) for other in drawn):
            continue
        colour, dashes = LINES[1:][len(drawn) % (len(LINES) - 1)]
        wide = 2.2 if len(drawn) >= len(LINES) - 1 else 1.4
        text = bound.name if bound.holds else f"{bound.name} (assumptions broken)"
        ax.plot(stiffness, dampings, color=colour, linestyle=dashes, linewidth=wide, label=text)
        drawn.append(stiffness)
    frame(ax, (0.0, top[0], 0.0, top[1]), empty=chart is not None and not chart.regions)
    legend_above(ax)


def _highest(bounds: list[Bound], chart: StabilityChart | None) -> tuple[float, float]:
    """Stiffness and damping up to which is drawn: 20 % beyond the exact chart, else beyond the conditions."""
    if chart is not None and chart.stiffness_max > 0.0:
        return 1.2 * chart.stiffness_max, 1.2 * max(chart.damping_max, chart.damping_at_stiffness_max)
    largest = [bound.stiffness_max for bound in bounds if bound.stiffness_max > 0.0]
    damping = [bound.damping_at_stiffness_max for bound in bounds if bound.damping_at_stiffness_max > 0.0]
    return 1.2 * max(largest, default=1.0), 3.0 * max(damping, default=1.0)


def _same(one: np.ndarray, other: np.ndarray, scale: float) -> bool:
    """Would the two lines all but lie over each other?"""
    apart = np.abs(one - other)
    alike = np.isfinite(one) == np.isfinite(other)
    return bool(np.all(alike) and np.nanmax(apart, initial=0.0) < 0.02 * scale)
