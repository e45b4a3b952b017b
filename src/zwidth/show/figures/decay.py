"""How fast the vibrations of stable walls decay: contours of equal spectral radius (thesis Fig. 5.10)."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, log

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.chart.decay import FastestDecay
from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.loop.loop import Loop
from zwidth.show.figures.stability import Window, edges_of, frame
from zwidth.show.figures.style import BLACK, LINES, VERMILION, legend_above
from zwidth.show.units import quantity


def draw_decay_contours(
    ax: Axes,
    loop: Loop,
    radii: Sequence[float] | None = None,
    window: Window | None = None,
    chart: StabilityChart | None = None,
) -> None:
    """Walls whose slowest motion shrinks by the same factor per sample, and the fastest-decaying wall.

    radii  factors per sample, each below 1; left out: some round ones between 1 and the smallest there is
    chart  the loop's stability chart, where it is at hand
    """
    chart = chart or stability_chart(loop)
    best = chart.fastest_decay
    levels = round_radii(best.spectral_radius) if radii is None and best else list(radii or ())
    draw_level(ax, chart, "1 (edge of stability)", 0, 1)
    for n, radius in enumerate(levels):
        try:
            level = stability_chart(loop, radius, decay=False).drawn()
        except ChartError:  # a sliver too fine to close: this level is left out of the drawing, and its legend
            continue
        draw_level(ax, level, _meaning(radius, loop.period), n + 1, len(levels) + 1)
    buildable = chart.fastest_decay_in_first_quadrant
    _star(ax, buildable, f"fastest{' with K, B ≥ 0' * (best != buildable)}", loop.period, VERMILION)
    if best != buildable:
        _star(ax, best, "fastest of all", loop.period, "white")
    frame(ax, window or chart.box, empty=not chart.regions)
    legend_above(ax, columns=2, title="Slowest motion: factor per sample (time until a tenth is left)")


def _star(ax: Axes, wall: FastestDecay | None, name: str, period: float, colour: str) -> None:
    """A star at the wall, if there is one; its name and what its radius means stand in the legend."""
    if wall:
        title = f"{name}: {_meaning(wall.spectral_radius, period)}"
        (star,) = ax.plot([wall.stiffness], [wall.damping], "*", color=VERMILION, markersize=11.0, label=title)
        star.set(markerfacecolor=colour, zorder=5.0)


def draw_level(ax: Axes, chart: StabilityChart, text: str, rank: int, count: int) -> None:
    """One contour; the smaller the radius the lighter."""
    colour = colormaps["viridis"](0.75 * rank / max(count - 1, 1)) if rank else BLACK
    for k, ring in enumerate(edges_of(chart.regions)):
        dashes = LINES[rank % len(LINES)][1]
        ax.plot(*ring.T, color=colour, linestyle=dashes, label="" if k else text, linewidth=1.2)


def round_radii(smallest: float, most: int = 5) -> list[float]:
    """At most `most` round numbers strictly between the smallest radius and 1, descending."""
    for step in (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001, 1e-5, 1e-6):
        count = int(np.ceil((1.0 - smallest) / step - 1e-3)) - 1
        if count >= min(3, most):
            every = -(-count // most)
            return [round(1.0 - step * k, 9) for k in range(every, count + 1, every)]
    return []


def tenfold_time(radius: float, period: float) -> float:
    """Time after which a motion that shrinks by this factor per sample has shrunk to a tenth [s]."""
    if radius <= 0.0:
        return 0.0
    return inf if radius >= 1.0 else period * log(10.0) / -log(radius)


def _meaning(radius: float, period: float) -> str:
    return f"{radius:.4g} ({quantity(tenfold_time(radius, period), 's')})"
