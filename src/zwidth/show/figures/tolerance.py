"""Devices as they are produced: bands of the chart, and which tolerance to tighten first."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from zwidth.show.figures.stability import edges_of, frame
from zwidth.show.figures.style import BLACK, BLUE, TICK_SIZE, VERMILION, context, draw_empty, label, legend_above
from zwidth.show.units import as_written, quantity

if TYPE_CHECKING:
    from zwidth.study.tolerances.band import Band
    from zwidth.study.tolerances.intervals import Interval
    from zwidth.study.tolerances.result import ToleranceStudy


# From the rarest walls to the likeliest: light to dark, which a grey print and any colour vision tell apart.
LIGHTEST: Final = np.array([0.86, 0.92, 0.96])
DARKEST: Final = np.array([0.33, 0.58, 0.77])
MARGIN: Final = 1.05  # of the view beyond the widest band
SIZE: Final = (5.6, 4.2)  # inches, of the bands alone
PER_BAR: Final = 0.42  # inches of height for each tolerance and its path


def tolerance_figure(result: ToleranceStudy) -> Figure:
    """The bands of the chart, and below them what each tolerance is worth."""
    bars = _bars(result)
    with context():
        below = PER_BAR * len(bars) + 0.75 if bars else 0.0
        drawing = Figure(figsize=(SIZE[0], SIZE[1] + below), layout="constrained")
        FigureCanvasAgg(drawing)
        if not bars:
            draw_bands(drawing.add_subplot(), result)
            return drawing
        above, under = drawing.subplots(2, 1, height_ratios=[SIZE[1], below])
        draw_bands(above, result)
        draw_worth(under, result)
        return drawing


def draw_bands(ax: Axes, result: ToleranceStudy) -> None:
    """The walls that at least these shares of the drawn devices render, the likeliest darkest; over them the edge
    of the device in the middle of its tolerances, and the wanted wall."""
    bands = result.bands[::-1]
    for n, band in enumerate(bands):
        share = n / max(len(bands) - 1, 1)
        colour = tuple((LIGHTEST + share * (DARKEST - LIGHTEST)).tolist())
        text = f"stable in at least {_percent_text(band.probability)} of the devices"
        ax.add_patch(
            PathPatch(band_path(band), facecolor=colour, edgecolor="none", zorder=1.1 + 0.1 * n, label=text)
        )
    if result.nominal is not None:
        for n, edge in enumerate(edges_of(result.nominal.regions)):
            text = "" if n else "edge in the middle of the tolerances"
            ax.plot(*edge.T, color=BLACK, linewidth=1.1, zorder=3.0, label=text)
    for band in result.bands[:1]:
        if band.stiffest is not None:
            _mark_wall(ax, band.stiffest.stiffness, band.stiffest.damping, "o", "white", _stiffest_text(band))
    wall = result.question.study.wall
    if wall.stiffness is not None and wall.damping is not None and result.probability is not None:
        text = f"wanted wall: stable in {_share_text(result.probability)}"
        if result.undecided:
            text += f", undecided in {result.undecided} of {result.question.samples} devices"
        _mark_wall(ax, wall.stiffness, wall.damping, "D", VERMILION, text)
    frame(ax, _default_window(result), empty=not any(any(band.pieces) for band in bands))
    legend_above(ax)


def band_path(band: Band) -> Path:
    """A band as a path of walls [K, B]: between two dampings a trapezium for each two pieces that meet."""
    parts = []
    for (B0, pieces0), (B1, pieces1) in pairwise(zip(band.dampings.tolist(), band.pieces, strict=True)):
        for low0, high0 in pieces0:  # stiffness from and to, at the lower damping
            for low1, high1 in pieces1:
                if max(low0, low1) < min(high0, high1):
                    parts.append(shapely.Polygon([(low0, B0), (high0, B0), (high1, B1), (low1, B1)]))
    whole = shapely.union_all([part for part in parts if part.is_valid])
    rings = [
        Path(shapely.get_coordinates(ring), closed=True)
        for cell in shapely.get_parts(shapely.orient_polygons(whole))
        if isinstance(cell, shapely.Polygon)
        for ring in (cell.exterior, *cell.interiors)
    ]
    return Path.make_compound_path(*rings) if rings else Path(np.empty((0, 2)))


def draw_worth(ax: Axes, result: ToleranceStudy) -> None:
    """A bar for each tolerance: by how much half of it raises the share, or its part in the spread of the
    stiffness, with the interval that holds the truth with 95 %; hollow where it cannot be told from 0."""
    bars = _bars(result)
    if not bars:
        draw_empty(ax, "no tolerance to be tightened")
        return
    if result.question.has_wall and not result.middle_is_stable:
        draw_empty(ax, "no tolerance to be tightened: the wall is\nnot stable in the middle of them")
        return
    for n, (key, interval, certain) in enumerate(reversed(bars)):
        value, low, high = (100.0 * one for one in (interval.value, interval.low, interval.high))
        face = BLUE if certain else "white"
        ax.barh(n, value, height=0.34, color=face, edgecolor=BLUE, linewidth=1.0, zorder=2.0)
        ax.plot([low, high], [n, n], color=BLACK, linewidth=1.1, zorder=3.0, marker="|", markersize=6.0)
        place = ax.get_yaxis_transform()
        ax.plot([0.0, 0.0], [n - 0.24, n + 0.24], color=BLACK, linewidth=0.8, zorder=2.5)
        ax.text(0.0, n + 0.26, key, transform=place, ha="left", va="bottom", fontsize=TICK_SIZE, zorder=4.0)
    ax.set_yticks([])
    ax.set_ylim(-0.5, len(bars) - 0.1)
    ax.spines["left"].set_visible(False)
    if result.tightened:
        label(ax.xaxis, "More devices with the wall, by half this tolerance", "%", plain=True)
    else:
        label(ax.xaxis, "Part in the spread of the largest stiffness", "%", plain=True)


def _bars(result: ToleranceStudy) -> list[tuple[str, Interval, bool]]:
    """Key, interval, and whether that differs from 0, of each tolerance, the largest first.

    The interval is of the gain in the share of devices; without a wanted wall, of the part in the spread.
    """
    if result.tightened:
        return [(one.key, one.gain, one.is_certain) for one in result.tightened]
    outcome = next((one for one in result.indices if one.name == "stiffness_max"), None)
    each = [] if outcome is None else [(one.key, one.total, one.total_is_certain) for one in outcome.indices]
    return sorted(each, key=lambda one: -one[1].value)


def _mark_wall(ax: Axes, stiffness: float, damping: float, marker: str, face: str, text: str) -> None:
    """Draw a mark at a wall, filled with the colour `face`."""
    style: dict[str, Any] = {"markerfacecolor": face, "markeredgecolor": VERMILION, "markeredgewidth": 1.6}
    ax.plot(
        [stiffness], [damping], marker=marker, markersize=6.0, linestyle="none", zorder=5.0, label=text, **style
    )


def _stiffest_text(band: Band) -> str:
    """The stiffest wall of a band in words."""
    assert band.stiffest is not None
    place = f"{quantity(band.stiffest.stiffness, 'N/m')} at {quantity(band.stiffest.damping, 'N s/m')}"
    return f"stiffest wall of {_percent_text(band.probability)}: {place}"


def _percent_text(share: float) -> str:
    """A share that somebody chose, as it was written."""
    return f"{as_written(100.0 * share)}\u00a0%"


def _share_text(share: Interval) -> str:
    """A share in per cent, with its interval."""
    return f"{100.0 * share.value:.3g} % ({100.0 * share.low:.3g} to {100.0 * share.high:.3g} %)"


def _default_window(result: ToleranceStudy) -> tuple[float, float, float, float]:
    """KMIN, KMAX, BMIN, BMAX of what is shown: the part of bands, edge and wanted wall with K, B >= 0."""
    reach = [walls for band in result.bands if len(walls := np.asarray(band_path(band).vertices))]
    if result.nominal is not None and result.nominal.regions:
        reach.append(np.vstack(result.nominal.regions))
    wall = result.question.study.wall
    if wall.stiffness is not None and wall.damping is not None:
        reach.append(np.array([[wall.stiffness, wall.damping]]))
    if not reach:
        return (0.0, 1.0, 0.0, 1.0)
    K, B = np.maximum(np.concatenate(reach).max(axis=0), 0.0)
    return -0.03 * float(K), MARGIN * float(K), -0.04 * float(B), MARGIN * float(B)
