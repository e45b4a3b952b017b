"""The frequency of the vibration along the edge of the stable set (thesis Fig. 3.8)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from zwidth.chart.chart import StabilityChart
from zwidth.chart.chart_base import BoundaryArc
from zwidth.model.modes import natural_frequencies
from zwidth.show.figures.style import BLUE, GREY, VERMILION, label, legend_above
from zwidth.show.units import quantity

# Ends of arcs closer than this share of the edge's extent are one corner; it is far coarser than their rounding.
SAME_WALL = 1e-6


def draw_frequency(ax: Axes, chart: StabilityChart) -> None:
    """Frequency against stiffness along the edge, for walls with K >= 0 and B >= 0.

    Where two arcs meet in a corner the wall vibrates at two frequencies; both are ringed. The device's natural
    frequencies are drawn across.
    """
    width = max((float(np.max(np.abs(arc.stiffness))) for arc in chart.boundary), default=1.0)
    for n, arc in enumerate(chart.boundary):
        inside = (arc.stiffness >= -SAME_WALL * width) & (arc.damping >= 0.0)
        K, f = np.where(inside, arc.stiffness, np.nan), np.where(inside, arc.frequency, np.nan)
        ax.plot(K, f, color=BLUE, label="" if n else "along the edge of stability")
    for n, (at, _, low, high) in enumerate(corners(chart)):
        text = f"corner: {quantity(low, 'Hz')} and {quantity(high, 'Hz')}"
        ax.plot([at, at], [low, high], color=VERMILION, linewidth=0.8, linestyle=":")
        ax.plot(
            [at, at],
            [low, high],
            marker="o",
            markersize=6.0,
            markerfacecolor="white",
            markeredgecolor=VERMILION,
            markeredgewidth=1.4,
            linestyle="none",
            zorder=4.0,
            label=text if n < 3 else "",
        )
    _natural_frequencies(ax, chart)
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    label(ax.xaxis, "Virtual stiffness K", "N/m")
    label(ax.yaxis, "Frequency of the vibration", "Hz")
    legend_above(ax)


def corners(chart: StabilityChart) -> list[tuple[float, float, float, float]]:
    """Walls with K > 0, B >= 0 at which two arcs meet, with both frequencies: (K, B, lower, higher)."""
    ends = [end for arc in chart.boundary for end in _ends(arc)]
    if not ends:
        return []
    K, B, f = np.array(ends).T
    near = SAME_WALL * np.max(
        [np.ptp(np.vstack([arc.stiffness, arc.damping]), axis=1) for arc in chart.boundary], 0
    )
    nyquist = 0.5 / chart.loop.period
    pairs = []
    for i in range(len(ends)):
        for j in range(i + 1, len(ends)):
            together = abs(K[i] - K[j]) <= near[0] and abs(B[i] - B[j]) <= near[1]
            if together and abs(f[i] - f[j]) > 1e-6 * nyquist and K[i] > 1e3 * near[0] and B[i] >= 0.0:
                low, high = sorted((float(f[i]), float(f[j])))
                pairs.append((float(K[i]), float(B[i]), low, high))
    return sorted(pairs, reverse=True)


def _ends(arc: BoundaryArc) -> list[tuple[float, float, float]]:
    return [(float(arc.stiffness[k]), float(arc.damping[k]), float(arc.frequency[k])) for k in (0, -1)]


def _natural_frequencies(ax: Axes, chart: StabilityChart) -> None:
    """The flexible modes below half the sampling frequency, as lines across."""
    natural = natural_frequencies(chart.loop.plant)
    shown = [f for f in natural if 0.0 < f < 0.5 / chart.loop.period][:8]
    for n, f in enumerate(shown):
        numbers = ", ".join(quantity(x, "Hz") for x in shown)
        text = f"natural frequenc{'ies' if len(shown) > 1 else 'y'}: {numbers}"
        ax.axhline(f, color=GREY, linestyle=(0, (6, 3)), linewidth=0.8, label="" if n else text)
