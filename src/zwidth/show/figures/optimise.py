"""The front of an optimisation: what cannot be had together; or how the best value found was approached."""

from __future__ import annotations

from itertools import combinations
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from zwidth.arrays import Floats
from zwidth.show.figures.style import (
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    context,
    draw_empty,
    figure,
    label,
    legend_above,
)
from zwidth.study.designs.column import Column
from zwidth.study.optimisation.optimisation import Optimisation, undominated

MOST_PANELS: Final = 3  # pairs of objectives that are drawn
MOST_POINTS: Final = 4000  # designs that are drawn of those tried; a vector file holds each of them
BEYOND: Final = 0.6  # of the front's size: how far designs that it dominates are drawn


def front_figure(found: Optimisation, width: float = 5.6, height: float = 3.9) -> Figure:
    """A figure of the front, with a panel for each pair of the first objectives."""
    pairs = list(combinations(range(len(found.problem.objectives)), 2))[:MOST_PANELS]
    if len(pairs) < 2:
        drawing, ax = figure(width, height)
        with context():
            draw_optimisation(ax, found)
        return drawing
    drawing, first = figure(width, 0.9 * height * len(pairs))
    with context():
        first.remove()
        panels = drawing.subplots(len(pairs), 1)
        for n, (ax, (i, j)) in enumerate(zip(panels, pairs, strict=True)):
            _draw_pair(ax, found, i, j, legend=n == 0)
    return drawing


def draw_optimisation(ax: Axes, found: Optimisation) -> None:
    """The front of the first two objectives; of a single one, the best value found by designs tried."""
    if not len(found.front):
        draw_empty(ax, "no design tried keeps the demands")
    elif len(found.problem.objectives) == 1:
        _draw_approach(ax, found)
    else:
        _draw_pair(ax, found, 0, 1, legend=True)


def _draw_pair(ax: Axes, found: Optimisation, i: int, j: int, *, legend: bool) -> None:
    """Draw the front over the i-th and j-th objective: designs tried, edge of what is reached, knee, baseline.

    legend  whether it has one
    """
    problem = found.problem
    columns = [problem.objectives[n].column for n in (i, j)]
    front, knee = found.values[:, columns], found.knee
    tried = found.judgement.values[~found.judgement.violations(problem).any(axis=1)][:, columns]
    low, high = front.min(axis=0), front.max(axis=0)
    room = BEYOND * np.where(high > low, high - low, np.abs(high) + 1e-300)
    inside = ((tried >= low - room) & (tried <= high + room)).all(axis=1)
    shown = tried[inside][:MOST_POINTS]
    ax.plot(*shown.T, ".", color=GREY, markersize=2.0, alpha=0.6, label="tried, keeps the demands", zorder=1)
    _draw_reach(ax, tried[inside], problem.signs[[i, j]])
    ax.plot(*front.T, "o", color=BLUE, markersize=4.0, label="front", zorder=3)
    if found.bars is not None:
        _draw_bars(ax, front, found.bars.low[:, columns], found.bars.high[:, columns])
    if knee is not None:
        ax.plot(*front[knee], "D", color=VERMILION, markersize=7.0, label="knee", zorder=4)
    if found.baseline is not None and not np.isnan(baseline := found.baseline.values[0, columns]).any():
        near = ((baseline >= low - 4.0 * room) & (baseline <= high + 4.0 * room)).all()
        if near:
            ax.plot(*baseline, "s", color=GREEN, markersize=6.0, label="the device as it is", zorder=4)
    for axis, column in zip((ax.xaxis, ax.yaxis), columns, strict=True):
        _name_axis(axis, problem.columns[column])
    if legend:
        legend_above(ax, 4)


def _draw_reach(ax: Axes, tried: Floats, signs: Floats) -> None:
    """The edge of what some design reaches or surpasses, in steps: between two of them there is none, and a corner
    has the worse value of either objective.

    tried  (k, 2)  those that keep the demands;  signs  factor of each objective that makes less better
    """
    best = tried[undominated(tried * signs)]
    line = best[np.argsort(best[:, 0])]
    ax.step(*line.T, where="post" if signs[0] > 0.0 else "pre", color=BLUE, linewidth=0.9, alpha=0.7, zorder=2)


def _draw_bars(ax: Axes, front: Floats, low: Floats, high: Floats) -> None:
    """Draw what tolerances make of each design of the front (k, 2): 5 to 95 % of the produced devices."""
    style: dict[str, Any] = {"color": GREY, "linewidth": 0.9, "zorder": 2.5}
    ax.hlines(front[:, 1], low[:, 0], high[:, 0], label="5 to 95 % as produced", **style)
    ax.vlines(front[:, 0], low[:, 1], high[:, 1], **style)


def _draw_approach(ax: Axes, found: Optimisation) -> None:
    """Draw the best value found of the one objective over the number of designs tried."""
    problem = found.problem
    (objective,) = problem.objectives
    costs = found.judgement.costs(problem)[:, 0]
    kept = ~found.judgement.violations(problem).any(axis=1)
    best = np.minimum.accumulate(np.where(kept, costs, np.inf)) * objective.sign
    known = np.isfinite(best)
    tried = np.arange(1, len(best) + 1)
    ax.step(tried[known], best[known], where="post", color=BLUE, label="best found so far")
    if found.polished:
        ax.axvline(found.searched, color=GREY, linestyle=":", linewidth=1.0, label="polish begins")
    if found.baseline is not None and np.isfinite(baseline := found.baseline.values[0, objective.column]):
        ax.axhline(baseline, color=GREEN, linestyle=(0, (5, 1.5)), label="the device as it is")
    ax.set_xlabel("Designs tried")
    _name_axis(ax.yaxis, problem.columns[objective.column])
    legend_above(ax, 3)


def _name_axis(axis: Axis, column: Column) -> None:
    """Name an axis by a column, in its unit if it has one."""
    if column.unit:
        label(axis, column.title, column.unit)
    else:
        axis.set_label_text(column.title)
