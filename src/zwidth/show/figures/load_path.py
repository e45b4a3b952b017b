"""How the chart moves with the hand's load: outlines by push, largest stiffness and sideways growth over push."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import pi
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap
from matplotlib.figure import Figure

from zwidth.arrays import Floats
from zwidth.chart.arcs import window_of
from zwidth.chart.chart import StabilityChart
from zwidth.chart.tracer import tracer_of
from zwidth.show.figures.stability import Window, edges_of, frame
from zwidth.show.figures.style import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    context,
    draw_empty,
    figure,
    label,
    legend_above,
)
from zwidth.show.load_text import ROUNDING
from zwidth.show.units import as_written, percent, quantity, spoken_unit
from zwidth.study.loaded_charts import LoadPath, PushedChart

# From blue over black to vermilion: the farther from no push the lighter, either side in its own colour.
COLOURS: Final = LinearSegmentedColormap.from_list(
    "push", ["#9CCBE8", BLUE, "#00304D", BLACK, "#5C2800", VERMILION, "#F5B68C"]
)
MOST_TICKS: Final = 9
NARROW: Final = 5.0  # inches of a figure below which panels stand under each other
LOW: Final = 0.7  # of the height of two rows, for one
VISIBLE: Final = 0.01  # share by which the stiffest walls differ at least where they are drawn in a close-up
LEAST_CHANGE: Final = 1.0  # per cent, to which an axis of changes reaches at least
LEAST_GROWTH: Final = 1.0  # 1/s, to which an axis of growth reaches at least: slower than any hand
FOOT: Final = 0.06  # of the height of a panel, for marks of pushes without an answer
LEAST: Final = 1e-6  # share of the largest stiffness that a close-up shows, where all are alike
BELOW: Final = 1.5  # how far a close-up goes below the largest stiffnesses, in shares of their range
ABOVE: Final = 0.4  # and above
POINTS: Final = 300  # of a curve in a close-up


def load_path_figure(path: LoadPath, width: float = 7.6, height: float = 5.4) -> Figure:
    """The outlines, and a close-up at the stiffest walls; beside them, or below, what changes over the push.

    There is no close-up of stiffest walls that are all but the same, and no growth where no motion is free along
    the surface.

    height  of a figure of two rows; in a single column a row is nearly as high [inches]
    """
    close = [draw_close_up] if _relative_spread(path) > VISIBLE else []
    growth = [draw_growth] if np.isfinite(path.growth_rates).any() else []
    columns = [[_draw_edges, *close], [draw_stiffness, *growth]]
    if width < NARROW:
        count = 2 + len(close) + len(growth)
        columns, height = [[*columns[0], *columns[1]]], 0.45 * count * height
    rows = max(map(len, columns))
    drawing, first = figure(width, height if rows > 1 else LOW * height)
    with context():
        grid = drawing.add_gridspec(rows, len(columns))
        panels: list[Axes] = []
        for n, column in enumerate(columns):
            for k, draw in enumerate(column):
                place = grid[:, n] if len(column) == 1 else grid[k, n]
                ax = drawing.add_subplot(place) if panels else first
                ax.set_subplotspec(place)
                draw(ax, path)
                panels.append(ax)
        _add_colour_bar(drawing, panels, path)
    return drawing


def _relative_spread(path: LoadPath) -> float:
    """By what share of the largest the stiffest walls under the pushes differ; 0 without any."""
    stiffest = path.stiffness_max[np.isfinite(path.stiffness_max)]
    return float(np.ptp(stiffest) / stiffest.max()) if len(stiffest) else 0.0


def draw_outlines(ax: Axes, path: LoadPath) -> None:
    """The edges of the stable sets by the colour of the push, with the colours above."""
    _draw_edges(ax, path)
    assert ax.figure is not None
    _add_colour_bar(ax.figure, [ax], path)


def _draw_edges(ax: Axes, path: LoadPath) -> None:
    """The edges of the stable sets: that without a push on top, and pushes against the direction dashed."""
    drawn = [(step, step.chart) for step in path.steps if step.chart is not None and step.chart.regions]
    for step, chart in drawn:
        for ring in edges_of(chart.regions):
            ax.plot(*ring.T, **_line_style(step, path))
    frame(ax, _default_window([chart for _, chart in drawn]), empty=not drawn)


def draw_close_up(ax: Axes, path: LoadPath) -> None:
    """The same edges about the stiffest walls, which often differ too little to be seen in the whole chart."""
    stiffest = path.stiffness_max[np.isfinite(path.stiffness_max)]
    if not len(stiffest):
        draw_empty(ax)
        return
    low, high = float(stiffest.min()), float(stiffest.max())
    span = max(high - low, LEAST * high)
    window = low - BELOW * span, high + ABOVE * span
    dampings = []
    for step in path.steps:
        if step.chart is None:
            continue
        for K, B in _edge_pieces(step.chart, window[0]):
            ax.plot(K, B, **_line_style(step, path))
            dampings.append(B[(window[0] <= K) & (B >= 0.0)])
        if step.stiffness_max == step.stiffness_max:  # not nan
            wall = step.chart.stiffness_max, step.chart.damping_at_stiffness_max
            ax.plot(*wall, marker="o", markersize=3.6, color=_colour(step, path), zorder=5.0)
    seen = np.concatenate([np.zeros(0), *dampings])
    ax.set_xlim(*window)
    if len(seen):
        margin = 0.05 * float(np.ptp(seen)) or 1.0
        ax.set_ylim(float(seen.min()) - margin, float(seen.max()) + margin)
    ax.xaxis.set_major_locator(_few_ticks())
    label(ax.xaxis, "K about the stiffest walls", "N/m")
    label(ax.yaxis, "Virtual damping B", "N s/m")


def _few_ticks() -> Any:
    """A locator of a few round ticks, for numbers with many digits."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=4, steps=[1, 2, 5, 10])


def _edge_pieces(chart: StabilityChart, low: float) -> Iterator[tuple[Floats, Floats]]:
    """Pieces of a chart's edge from its exact curve, (K [N/m], B [N s/m]), nan in K far below `low`.

    Straight pieces, of real roots, are those of the chart, without nan; pieces wholly below `low` are left out.
    """
    tracer, hertz = tracer_of(chart.loop), 1.0 / (2.0 * pi * chart.loop.period)
    for arc in chart.boundary:
        near = np.flatnonzero(arc.stiffness >= low)
        if not len(near):
            near = np.array([int(np.argmax(arc.stiffness))])  # the exact curve may reach higher than its points
        first, last = max(int(near[0]) - 1, 0), min(int(near[-1]) + 1, len(arc.frequency) - 1)
        ends = arc.frequency[first], arc.frequency[last]
        if ends[0] == ends[1]:  # a straight line of real roots
            yield arc.stiffness[first : last + 1], arc.damping[first : last + 1]
            continue
        K, B = tracer.walls(np.linspace(*ends, POINTS) / hertz)
        if np.max(K) < low:
            continue
        kept = low - (np.max(K) - low) <= K  # a little beyond what is seen
        yield np.where(kept, K, np.nan), B


def draw_stiffness(ax: Axes, path: LoadPath) -> None:
    """The largest stiffness over the push, as a change from that without one where there is one: with the posture
    kept, without the change of the hand's force, and on a fixed surface."""
    free = path.unpushed.stiffness_max
    relative = free == free  # not nan
    if not np.isfinite(path.stiffness_max).any():
        draw_empty(ax)
        return

    def shown(values: Floats) -> Floats:
        """Stiffness [N/m] as a change [%] from that without a push; as it is where there is none."""
        return 100.0 * (values - free) / free if relative else values

    lines: tuple[tuple[str, Floats, dict[str, Any]], ...] = (
        ("posture kept", path.stiffness_max, {"color": BLACK, "linewidth": 2.0}),
        ("change of the hand's force neglected", path.hand_neglected, {"color": BLUE, "linestyle": (0, (4, 4))}),
        ("fixed surface", path.fixed_surface, {"color": VERMILION, "linestyle": (0, (1.2, 1.2))}),
    )
    for n, (name, values, style) in enumerate(lines):
        if np.isfinite(values).any():
            ax.plot(path.pushes, shown(values), label=name, zorder=2.5 + 0.1 * n, **style)
    _draw_dots(ax, path, shown(path.stiffness_max))
    title = "Largest stiffness"
    if relative:
        ax.set_ylabel("Change of stiffness [%]")
        largest_change = float(np.nanmax(np.abs(shown(path.stiffness_max))))
        changes = (
            f"changes by {percent(largest_change / 100.0)} at most"
            if largest_change > 100.0 * ROUNDING
            else "does not change"
        )
        title += f", from {quantity(free, 'N/m')}\nwithout a push: {changes}"
        _widen_to(ax, LEAST_CHANGE)
    else:
        label(ax.yaxis, title, "N/m")
    _finish_over_push(ax, path, path.stiffness_max)
    legend_above(ax, title=title)


def draw_growth(ax: Axes, path: LoadPath) -> None:
    """Growth of the fastest sideways motion over the push; above 0 it grows."""
    rates = path.growth_rates
    ax.set_ylabel("Growth sideways [1/s]")
    if not np.isfinite(rates).any():
        draw_empty(ax, "no motion is free along the surface")
        return
    ax.plot(path.pushes, rates, color=BLACK, zorder=2.9)
    _draw_dots(ax, path, rates)
    _widen_to(ax, LEAST_GROWTH)
    _finish_over_push(ax, path, rates)


def _widen_to(ax: Axes, least: float) -> None:
    """Widen the upright axis to `least` on both sides of zero: what is less is next to nothing, and looks so."""
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -least), max(high, least))


def _draw_dots(ax: Axes, path: LoadPath, values: Floats) -> None:
    """A dot for each push in its colour."""
    for step, value in zip(path.steps, values, strict=True):
        if np.isfinite(value):
            ax.plot(step.push, value, marker="o", markersize=4.4, color=_colour(step, path), zorder=4.0)


def _finish_over_push(ax: Axes, path: LoadPath, values: Floats) -> None:
    """Set limits and name of the axis of the push, and mark pushes without an answer by crosses at its foot.

    values  (pushes,) nan: no answer
    """
    reach = 1.06 * float(path.pushes[-1])
    ax.set_xlim(-reach, reach)
    for draw in (ax.axvline, ax.axhline):
        draw(0.0, color=GREY, linewidth=0.6, zorder=1.0)
    label(ax.xaxis, "Push of the hand", "N")
    missing = path.pushes[~np.isfinite(values)]
    if len(missing):
        low, high = ax.get_ylim()
        ax.set_ylim(low - (high - low) * 2.0 * FOOT, high)
        style: dict[str, Any] = {"linestyle": "none", "color": GREY, "markersize": 4.0}
        at = ax.get_xaxis_transform()
        ax.plot(missing, np.full(len(missing), FOOT), marker="x", transform=at, label="no answer", **style)


def _norm(path: LoadPath) -> BoundaryNorm:
    """Norm that gives each push [N] a band of COLOURS; the pushes are evenly spaced."""
    pushes = path.pushes
    half = 0.5 * (pushes[1] - pushes[0])
    return BoundaryNorm(np.append(pushes - half, pushes[-1] + half), COLOURS.N)


def _colour(step: PushedChart, path: LoadPath) -> Any:
    """The colour of one push."""
    return COLOURS(_norm(path)(step.push))


def _line_style(step: PushedChart, path: LoadPath) -> dict[str, Any]:
    """The line style of one push: the weaker it is the farther in front; dashed against the direction."""
    style: dict[str, Any] = {"color": _colour(step, path), "linewidth": 1.1}
    style["zorder"] = 3.0 - abs(step.push) / (1.0 + 2.0 * float(path.pushes[-1]))
    if step.push == 0.0:
        return style | {"linewidth": 1.6}
    return style | {"linestyle": (0, (4, 2))} if step.push < 0.0 else style


def _add_colour_bar(drawing: Any, axes: Sequence[Axes], path: LoadPath) -> None:
    """Add the colours of the pushes above the axes, with a few of the pushes named."""
    middle = len(path.steps) // 2
    stride = -(-middle // (MOST_TICKS // 2))  # rounded up: at most MOST_TICKS, counted from the middle
    ticks = [push for k, push in enumerate(path.pushes.tolist()) if (k - middle) % stride == 0]
    bar = drawing.colorbar(
        ScalarMappable(_norm(path), COLOURS),
        ax=axes,
        location="top",
        ticks=ticks,
        fraction=0.03 if len(axes) > 2 else 0.05,
        pad=0.03,
        aspect=40,
    )
    bar.minorticks_off()
    bar.outline.set_linewidth(0.6)
    bar.ax.set_xticks(ticks, labels=[as_written(push) for push in ticks])
    bar.ax.tick_params(labelsize=8.0)
    bar.set_label(f"Push of the hand [{spoken_unit('N')}], lines of negative ones dashed", fontsize=8.0)


def _default_window(charts: Sequence[StabilityChart]) -> Window:
    """KMIN, KMAX, BMIN, BMAX of all outlines' part with K, B >= 0, and 5 %; of all of it where none lies there."""
    rings = [ring for chart in charts for ring in chart.regions]
    if all(np.isnan(chart.stiffness_max) for chart in charts):
        return window_of(rings)
    points = np.vstack(rings)
    K1, B1 = np.maximum(points.max(axis=0), 0.0).tolist()
    low = np.minimum(points.min(axis=0), 0.0)
    K0, B0 = max(float(low[0]), -0.04 * K1), max(float(low[1]), -0.1 * B1)
    return K0 - 0.01 * K1, 1.05 * K1, B0 - 0.01 * B1, 1.05 * B1
