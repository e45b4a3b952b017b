"""Published conditions over the exact chart."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.chart.chart import StabilityChart
from zwidth.conditions import Bound
from zwidth.show.figures.stability import frame
from zwidth.show.figures.style import BLACK, GREY, LINES, STABLE, legend_above

WIDEST_TEXT: Final = 72  # letters


def draw_bounds(ax: Axes, bounds: Iterable[Bound], chart: StabilityChart | None) -> None:
    """The stable walls with K, B >= 0, and the line of each condition that has one.

    Conditions whose assumptions hold are drawn in colours. Those that assume what is not so are thin and grey, and
    one entry of the legend names them all. Conditions that say nearly the same (2 % of the view) are drawn once,
    under all their names. What has no line in view is named in the legend's last entry. The view is that of the
    exact chart.

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
    broken = [bound for bound in lines if not bound.holds]
    grey, unseen = _drawable(broken, dampings, top[0])
    text = _listed([name for names, _ in grey for name in names], "assumptions broken: ")
    for n, (_, stiffness) in enumerate(grey):
        ax.plot(stiffness, dampings, color=GREY, linewidth=0.6, zorder=1.5, label="" if n else text)
    held, silent = _drawable([bound for bound in lines if bound.holds], dampings, top[0])
    for n, (names, stiffness) in enumerate(held):
        colour, dashes = LINES[1:][n % (len(LINES) - 1)]
        wide = 2.2 if n >= len(LINES) - 1 else 1.4
        ax.plot(stiffness, dampings, color=colour, linestyle=dashes, linewidth=wide, label=_listed(names))
    if unseen or silent:
        ax.plot([], [], color="none", label=_listed([*silent, *unseen], "no line in view: "))
    frame(ax, (0.0, top[0], 0.0, top[1]), empty=chart is not None and not chart.regions)
    legend_above(ax)


def _drawable(
    bounds: list[Bound], dampings: np.ndarray, widest: float
) -> tuple[list[tuple[list[str], np.ndarray]], list[str]]:
    """Lines with the names of the conditions that share each, and the names of those without a line in view."""
    drawn: list[tuple[list[str], np.ndarray]] = []
    silent = []
    for bound in bounds:
        stiffness = bound.stiffness_max_at(dampings)
        # what is out of view leaves it at its border
        stiffness = np.where(stiffness > 0.0, np.minimum(stiffness, 1.01 * widest), np.nan)
        if not np.any(stiffness < 1.005 * widest):
            silent.append(bound.name)
            continue
        alike = next((names for names, other in drawn if _same(stiffness, other, widest)), None)
        if alike is None:
            drawn.append(([bound.name], stiffness))
        else:
            alike.append(bound.name)
    return drawn, silent


def _listed(names: list[str], before: str = "") -> str:
    """Names with semicolons between them, for they hold commas, in lines that fit over the axes."""
    return "\n".join(wrap(before + "; ".join(names), WIDEST_TEXT))


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
