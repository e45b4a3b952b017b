"""A measured stability boundary with what was fitted to it: the chart before and after, points, what remains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.identification import Identification
from zwidth.show.figures.stability import frame
from zwidth.show.figures.style import BLACK, BLUE, GREEN, GREY, VERMILION, draw_empty, legend_above

# kinds of points: marker, colour, whether it is filled, and title
POINT_STYLES = (
    (("lower", "upper", "edge"), "o", VERMILION, False, "measured edge, damping bisected"),
    (("tip",), "^", GREEN, False, "measured tip, stiffness bisected"),
    (("stable",), "P", BLUE, True, "tried, stable"),
    (("unstable",), "X", BLACK, False, "tried, unstable"),
)
MARGIN = 0.12  # of the points' extent that is shown beyond them


def draw_boundary(ax: Axes, identification: Identification) -> None:
    """The boundary as fitted, and as the file had it, with the measured points and bars to the fitted edge."""
    if not identification.curves:
        draw_empty(ax, identification.reason or "nothing was fitted")
        return
    _outline(ax, identification.details["boundary_before"], GREY, (0, (4, 2)), "chart before")
    _outline(ax, identification.details["boundary"], BLACK, "-", "chart fitted")
    columns = {name: np.array(values) for name, values in identification.curves.items()}
    K, B, kind = columns["stiffness_N_per_m"], columns["damping_Ns_per_m"], columns["kind"]
    fitted = columns["fitted_stiffness_N_per_m"], columns["fitted_damping_Ns_per_m"]
    on_edge = np.isfinite(fitted[0])
    for k in np.flatnonzero(on_edge):
        ax.plot([K[k], fitted[0][k]], [B[k], fitted[1][k]], color=VERMILION, linewidth=1.0, zorder=3.0)
    for kinds, marker, colour, filled, title in POINT_STYLES:
        some = np.isin(kind, kinds)
        if some.any():
            ax.plot(
                K[some],
                B[some],
                marker=marker,
                markersize=4.5,
                markerfacecolor=colour if filled else "white",
                markeredgecolor=colour,
                linestyle="none",
                zorder=4.0,
                label=title,
            )
    frame(ax, _window(K, B), empty=False)
    legend_above(ax, columns=2)


def _outline(ax: Axes, arcs: Sequence[dict[str, Any]], colour: str, dashes: Any, title: str) -> None:
    for n, arc in enumerate(arcs):
        walls = arc["stiffness_N_per_m"], arc["damping_Ns_per_m"]
        ax.plot(*walls, color=colour, linestyle=dashes, linewidth=1.0, label="" if n else title)


def _window(K: np.ndarray, B: np.ndarray) -> tuple[float, float, float, float]:
    """What is shown: the points, K = 0 and B = 0, and a margin."""
    ends = []
    for values in (K, B):
        low, high = min(float(np.min(values)), 0.0), max(float(np.max(values)), 0.0)
        ends += [low - MARGIN * (high - low) * (low < 0.0), high + MARGIN * (high - low)]
    return ends[0], ends[1], ends[2], ends[3]
