"""The largest stiffness against direction, in the plane of the directions."""

from __future__ import annotations

from textwrap import wrap
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.ticker import MaxNLocator

from zwidth.arrays import Floats
from zwidth.chart.polar import OUT_OF_MOTION, ByDirection
from zwidth.show.figures.style import BLACK, GREY, STABLE, VERMILION, draw_empty, label, legend_above
from zwidth.show.units import as_written, quantity

ALIKE: Final = 1e-6  # share by which the largest stiffnesses of two directions differ that have the same
BAR: Final = 4.0  # points, width of a bar
LETTERS: Final = 40  # of a line that says why nothing is drawn


def draw_polar(
    ax: Axes, by_direction: ByDirection, angles_deg: np.ndarray, axes: tuple[str, str] = ("x", "y")
) -> None:
    """A closed outline whose distance from the middle is the largest stiffness along each direction.

    Bars where the handle does not move along all directions of the plane, as one of a single axis.

    ax          equal axes of a plane, both in N/m
    angles_deg  (k,) ascending, of each direction in that plane
    axes        names of the plane's axes
    """
    have = np.isfinite(by_direction.stiffness)
    if not have.any():
        draw_empty(ax, "\n".join(wrap(by_direction.reason or "", LETTERS)))
        return
    moves = np.array([status != OUT_OF_MOTION for status in by_direction.status])
    if moves.all():
        _draw_outline(ax, by_direction.stiffness, np.deg2rad(angles_deg))
    else:
        _draw_bars(ax, by_direction.stiffness[have], np.deg2rad(angles_deg[have]))
    reach = 1.1 * float(np.max(by_direction.stiffness[have]))
    for text, k, marker in _extremes(by_direction.stiffness, angles_deg):
        angle = np.deg2rad(angles_deg[k])
        ax.plot(
            *(by_direction.stiffness[k] * np.array([[np.cos(angle)], [np.sin(angle)]])),
            marker=marker,
            markersize=6.0,
            markerfacecolor="white",
            markeredgecolor=VERMILION,
            markeredgewidth=1.6,
            linestyle="none",
            zorder=5.0,
            label=text,
        )
    missing = moves & ~have
    if missing.any():
        angle = np.deg2rad(angles_deg[missing])
        edge = reach * np.array([np.cos(angle), np.sin(angle)])
        ax.plot(*edge, marker="x", markersize=4.0, color=GREY, linestyle="none", label="no answer")
    _frame(ax, reach, axes)
    legend_above(ax)


def _draw_outline(ax: Axes, stiffness: Floats, angle: Floats) -> None:
    """Draw a closed outline of stiffness (k,) [N/m] over angle (k,) [rad]; filled if every direction has an
    answer."""
    K, along = np.append(stiffness, stiffness[:1]), np.append(angle, angle[:1])
    x, y = K * np.cos(along), K * np.sin(along)
    if np.isfinite(stiffness).all():
        ax.fill(x, y, facecolor=STABLE, edgecolor="none", zorder=1.0)
    ax.plot(x, y, color=BLACK, solid_joinstyle="round", label="largest stiffness along each direction")


def _draw_bars(ax: Axes, stiffness: Floats, angle: Floats) -> None:
    """Draw a bar from the middle along each direction in which the handle moves.

    stiffness, angle  (k,)  [N/m], [rad]
    """
    ends = stiffness[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    bars = LineCollection(
        [np.vstack([np.zeros(2), end]) for end in ends],
        colors=BLACK,
        linewidths=BAR,
        label="largest stiffness, only where the handle moves",
    )
    ax.add_collection(bars)


def _extremes(stiffness: Floats, angles_deg: Floats) -> list[tuple[str, int, str]]:
    """Legend text, index and marker of the stiffest and the least stiff direction; of one where both are alike."""
    most, least = int(np.nanargmax(stiffness)), int(np.nanargmin(stiffness))
    if stiffness[most] - stiffness[least] > ALIKE * stiffness[most]:
        found = [("stiffest", most, "o"), ("least stiff", least, "s")]
    elif np.isfinite(stiffness).all():
        return [(f"{quantity(stiffness[most], 'N/m')} along every direction", most, "o")]
    else:
        found = [("largest", most, "o")]
    return [
        (f"{name}: {quantity(stiffness[k], 'N/m')} along {as_written(float(angles_deg[k]))}°", k, marker)
        for name, k, marker in found
    ]


def _frame(ax: Axes, reach: float, axes: tuple[str, str]) -> None:
    """Frame equal axes up to `reach` [N/m], with circles of equal stiffness."""
    ax.set_aspect("equal")
    ax.set_xlim(-1.05 * reach, 1.05 * reach)
    ax.set_ylim(-1.05 * reach, 1.05 * reach)
    for draw in (ax.axvline, ax.axhline):
        draw(0.0, color=GREY, linewidth=0.5, zorder=0.5)
    for axis, name in ((ax.xaxis, axes[0]), (ax.yaxis, axes[1])):
        axis.set_major_locator(MaxNLocator(nbins=8, steps=[1, 2, 2.5, 5, 10]))
        label(axis, f"Largest stiffness, {name} part", "N/m")
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for radius in ax.xaxis.get_majorticklocs():
        if 0.0 < radius <= reach:
            ax.plot(radius * np.cos(turn), radius * np.sin(turn), color=GREY, linewidth=0.5, zorder=0.5)
