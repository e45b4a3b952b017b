"""What the hand feels: impedances over frequency, and the chart at felt stiffness."""

from __future__ import annotations

from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from zwidth.arrays import Complexes, Floats
from zwidth.measures.felt import LIMIT_HEADINGS, FeltChart
from zwidth.show.figures.style import (
    BLACK,
    GREY,
    LINES,
    STABLE,
    VERMILION,
    draw_empty,
    label,
    legend_above,
    number_logarithmic,
)
from zwidth.show.units import quantity, spoken_unit


def draw_impedance(
    ax: Axes,
    frequency: Floats,
    felt: Complexes,
    commanded: Complexes,
    free_motion: Complexes,
) -> None:
    """Magnitudes of the felt, the commanded and the free-motion impedance over frequency, both axes logarithmic.

    frequency                      (k,)  [Hz]
    felt, commanded, free_motion   (k,)  [N s/m]
    """
    curves = (
        ("felt at the handle", felt),
        ("commanded, K/jω + B", commanded),
        ("free motion, no wall", free_motion),
    )
    for (name, values), (colour, dashes) in zip(curves, LINES, strict=False):
        ax.loglog(frequency, np.abs(values), color=colour, linestyle=dashes, label=name)
    ax.set_xlim(frequency[0], frequency[-1])
    number_logarithmic(ax.xaxis, *ax.get_xlim())
    number_logarithmic(ax.yaxis, *ax.get_ylim())
    ax.set_xlabel("Frequency [Hz]")
    ax.set_ylabel(f"Impedance, magnitude [{spoken_unit('N s/m')}]")
    legend_above(ax, columns=2)


def draw_felt_chart(ax: Axes, chart: FeltChart) -> None:
    """The stable walls with K >= 0 at the static stiffness that the hand feels; the limit drawn across."""
    for n, ring in enumerate(chart.regions):
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label="" if n else "stable walls"))
    for arc in chart.boundary:
        ax.plot(arc.stiffness, arc.damping, color=BLACK, solid_capstyle="round")
    widest = max((float(ring[:, 0].max()) for ring in chart.regions), default=1.0)
    if isfinite(chart.stiffness_max):
        text = f"hardest felt contact: {quantity(chart.stiffness_max, 'N/m')}"
        ax.axvline(chart.stiffness_max, color=VERMILION, linewidth=0.9, linestyle=":", label=text)
    if 0.0 < chart.limit < 4.0 * widest:  # one farther away would press the walls into a corner
        text = f"{LIMIT_HEADINGS[chart.limit_kind]} {quantity(chart.limit, 'N/m')}"
        ax.axvline(chart.limit, color=GREY, linestyle=(0, (6, 3)), linewidth=0.9, label=text)
        widest = max(widest, chart.limit)
    walls = np.vstack(chart.regions) if chart.regions else np.array([[0.0, 0.0], [1.0, 1.0]])
    low, high = float(walls[:, 1].min()), float(walls[:, 1].max())
    ax.set_xlim(0.0, 1.05 * widest)
    # room below only where damping may be negative
    ax.set_ylim(low - 0.05 * (high - low) * (low < 0.0), high + 0.05 * (high - low))
    if low < 0.0:
        ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=1.5)
    label(ax.xaxis, "Stiffness felt at rest", "N/m")
    label(ax.yaxis, "Virtual damping B", "N s/m")
    if not chart.regions:
        draw_empty(ax)
    legend_above(ax)
