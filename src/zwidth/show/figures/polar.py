"""The largest stiffness against direction, in the plane of the directions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zwidth.chart.polar import OK, ByDirection
from zwidth.show.figures.style import BLACK, GREY, STABLE, VERMILION, label, legend_above
from zwidth.show.units import as_written, quantity


def draw_polar(
    ax: Axes, by_direction: ByDirection, angles_deg: np.ndarray, axes: tuple[str, str] = ("x", "y")
) -> None:
    """A closed outline whose distance from the middle is the largest stiffness along each direction.

    ax          equal axes of a plane, both in N/m
    angles_deg  (k,) ascending, of each direction in that plane
    axes        names of the plane's axes
    """
    along = np.deg2rad(np.append(angles_deg, angles_deg[:1]))
    stiffness = np.append(by_direction.stiffness, by_direction.stiffness[:1])
    x, y = stiffness * np.cos(along), stiffness * np.sin(along)
    have = np.isfinite(by_direction.stiffness)
    if have.all():
        ax.fill(x, y, facecolor=STABLE, edgecolor="none", zorder=1.0)
    ax.plot(x, y, color=BLACK, solid_joinstyle="round", label="largest stiffness along each direction")
    reach = 1.1 * float(np.max(by_direction.stiffness[have])) if have.any() else 1.0
    for name, k, marker in _extremes(by_direction):
        angle = np.deg2rad(angles_deg[k])
        text = f"{name}: {quantity(by_direction.stiffness[k], 'N/m')} along {as_written(float(angles_deg[k]))}°"
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
    missing = np.array([status != OK for status in by_direction.status])
    if missing.any():
        angle = np.deg2rad(angles_deg[missing])
        edge = reach * np.array([np.cos(angle), np.sin(angle)])
        ax.plot(*edge, marker="x", markersize=4.0, color=GREY, linestyle="none", label="no answer")
    _frame(ax, reach, axes)
    legend_above(ax)


def _extremes(by_direction: ByDirection) -> list[tuple[str, int, str]]:
    """The stiffest and the least stiff direction, with a marker each."""
    have = np.isfinite(by_direction.stiffness)
    if not have.any():
        return []
    values = np.where(have, by_direction.stiffness, np.nan)
    return [("stiffest", int(np.nanargmax(values)), "o"), ("least stiff", int(np.nanargmin(values)), "s")]


def _frame(ax: Axes, reach: float, axes: tuple[str, str]) -> None:
    """Equal axes with circles of equal stiffness."""
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
