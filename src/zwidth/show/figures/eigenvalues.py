"""Paths of eigenvalues in the z-plane, with the unit circle."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes

from zwidth.measures.eigenvalue_paths import EigenvaluePaths
from zwidth.show.figures.style import BLACK, GREY, LINES, VERMILION, legend_above

ROOM: Final = 1.08  # radius shown, over that of what is drawn
CIRCLE: Final = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 361))


def draw_eigenvalue_paths(ax: Axes, paths: EigenvaluePaths) -> None:
    """Each path in its own colour from a circle to a square; crosses where it passes through the unit circle."""
    ax.plot(CIRCLE.real, CIRCLE.imag, color=GREY, linewidth=0.8, label="unit circle", zorder=1.0)
    for n, z in enumerate(paths.eigenvalues.T):
        colour, dashes = LINES[n % len(LINES)]
        ax.plot(z.real, z.imag, color=colour, linestyle=dashes, zorder=2.0)
    for row, marker, value in ((0, "o", paths.values[0]), (-1, "s", paths.values[-1])):
        z = paths.eigenvalues[row]
        ax.plot(
            z.real, z.imag, marker, color=BLACK, markerfacecolor="white", markersize=4.5, label=f"at {value:g}"
        )
    if paths.crossings:
        z = np.array([crossing.eigenvalue for crossing in paths.crossings])
        ax.plot(z.real, z.imag, "x", color=VERMILION, markersize=7.0, zorder=3.0, label="crosses the unit circle")
    radius = ROOM * max(1.0, float(np.abs(paths.eigenvalues).max()))
    ax.set_xlim(-radius, radius)
    ax.set_ylim(-radius, radius)
    ax.set_aspect("equal")
    ax.set_xlabel("Real part of z")
    ax.set_ylabel("Imaginary part of z")
    legend_above(ax, columns=4)
