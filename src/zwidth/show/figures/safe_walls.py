"""Safe walls: the largest stiffness of each cell, or the bands of a device that is the same everywhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from zwidth.show.figures.style import BLACK, GREY, draw_empty, label

if TYPE_CHECKING:
    from zwidth.study.safe_walls.table import SafeWalls


def draw_safe_walls(ax: Axes, table: SafeWalls) -> None:
    """The largest stiffness of each cell's rectangle, white where there is none; of cells in space those of the
    middle layer. Without a workspace: the bands of stiffness with their ranges of damping, and the rectangle."""
    if not (table.level > 0).any():
        draw_empty(ax, "no cell has safe walls")
    elif table.grid.dimensions == 0:
        _bands(ax, table)
    else:
        _cells(ax, table)


def _cells(ax: Axes, table: SafeWalls) -> None:
    grid = table.grid
    K = table.rectangles[:, 0].reshape(grid.counts[::-1])
    name = ""
    if grid.dimensions == 3:
        layer = grid.counts[2] // 2
        middle = 0.5 * float(grid.lines(2)[layer] + grid.lines(2)[layer + 1])
        K, name = K[layer], f", {grid.names[2]} = {middle:.4g} m"
    if np.isnan(K).all():
        draw_empty(ax, f"no cell has safe walls{name}")
        return
    image: Any = ax.pcolormesh(grid.lines(0), grid.lines(1), K, cmap=colormaps["viridis"], edgecolors="none")
    assert ax.figure is not None
    bar = ax.figure.colorbar(image, ax=ax)
    label(bar.ax.yaxis, f"Safe stiffness, every direction{name}", "N/m")
    ax.set_aspect("equal")
    label(ax.xaxis, grid.names[0], "m", plain=True)
    label(ax.yaxis, grid.names[1], "m", plain=True)


def _bands(ax: Axes, table: SafeWalls) -> None:
    for j in range(table.levels):
        low, high = table.ranges[0, 0, j]
        start, end = (table.stiffness_of_level(0, 0, level) for level in (j, j + 1))
        if low <= high:
            ax.add_patch(
                Rectangle((start, low), end - start, high - low, facecolor=GREY, alpha=0.35, linewidth=0.0)
            )
    one = table.rectangle(0)
    ax.add_patch(
        Rectangle((0.0, one.low), one.stiffness, one.high - one.low, fill=False, edgecolor=BLACK, linewidth=1.2)
    )
    ax.autoscale_view()
    label(ax.xaxis, "Virtual stiffness", "N/m")
    label(ax.yaxis, "Virtual damping", "Ns/m")
