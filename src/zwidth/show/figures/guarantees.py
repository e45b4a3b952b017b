"""Nested guarantees on one chart: shades that survive a grey print, and edges that show where they coincide."""

from __future__ import annotations

from textwrap import wrap
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path

from zwidth.guarantees.coupling import Couplings
from zwidth.guarantees.guarantees import Guarantee, Guarantees
from zwidth.guarantees.region import Region
from zwidth.show.figures.stability import Window, frame
from zwidth.show.figures.style import BLACK, BLUE, GREEN, GREY, PURPLE, VERMILION, draw_empty, label, legend_above
from zwidth.show.units import quantity

# Fill, edge, and the edge's width and place above the fills; the sets get darker inwards. The narrower edge lies
# on the wider, so that both are seen where two sets share it.
FILLS: Final = {
    "stable": ("#EEF3F7", BLACK, 0.8, 2.3),
    "robust": ("#D8E3EC", GREEN, 4.8, 2.0),
    "spring-stable": ("#BFD1E0", BLUE, 3.4, 2.1),
    "passive": ("#A0BAD0", VERMILION, 1.5, 2.2),
}
SMALL: Final = 0.1  # share of the view below which a set is drawn enlarged, too
# Left, bottom, width and height of the enlarged part, as shares of the axes; how many widths of the view are
# shown then, so that it hides nothing.
INSET: Final = (0.74, 0.55, 0.25, 0.38)
BESIDE: Final = 1.5
INSET_ROOM: Final = 0.15  # of the small sets' size, about them
REASON: Final = 40  # letters of a line
ROOM: Final = 0.05  # of the box of what is shown, beside it
# Sets that lie across the others are outlines only.
OUTLINES: Final = {"nyquist-spring": (PURPLE, (0, (5, 1.5))), "passive-at-actuator": (BLACK, (0, (1.2, 1.2)))}
WORDS: Final = {
    "stable": "stable",
    "robust": "a range of operators",
    "spring-stable": "every spring",
    "passive": "every passive operator",
    "nyquist-spring": "Nyquist spring",
    "passive-at-actuator": "passive, at the actuator",
}


def draw_guarantees(ax: Axes, guarantees: Guarantees, window: Window | None = None) -> None:
    """The sets of walls with each guarantee, the widest below; those too small to be seen once more, enlarged.

    window  what to show; left out: the box of the part of the chart with K and B above 0, and 5 %
    """
    _draw_sets(ax, guarantees)
    view = window or _box(guarantees)
    small = [ring for one in guarantees.guarantees for ring in one.region.rings if _is_small(ring, view)]
    if not small or window is not None:
        frame(ax, view, empty=not guarantees.chart.regions)
    else:
        frame(ax, (view[0], view[0] + BESIDE * (view[1] - view[0]), *view[2:]), empty=False)
        inset = ax.inset_axes(INSET, zorder=5.0)
        _draw_sets(inset, guarantees)
        corners = np.vstack(small)
        low, high = corners.min(axis=0), corners.max(axis=0)
        room = INSET_ROOM * (high - low)
        limits = [float(x) for pair in zip(low - room, high + room, strict=True) for x in pair]
        frame(inset, (limits[0], limits[1], limits[2], limits[3]), empty=False)
        inset.tick_params(labelsize=6.5, length=2.0, pad=1.5)
        inset.locator_params(nbins=4)
        for axis in (inset.xaxis, inset.yaxis):
            axis.label.set_fontsize(6.5)
            axis.labelpad = 1.0
        for spine in inset.spines.values():
            spine.set(visible=True, color=GREY, linewidth=0.8)
        ax.indicate_inset(
            (limits[0], limits[2], limits[1] - limits[0], limits[3] - limits[2]), edgecolor=GREY, alpha=1.0
        )
        inset.set_title("enlarged", fontsize=6.5, pad=2.0)
    legend_above(ax, columns=2)


def _is_small(ring: np.ndarray, view: Window) -> bool:
    """Whether a ring is too small to be seen in the figure."""
    across, up = np.ptp(ring, axis=0) / (view[1] - view[0], view[3] - view[2])
    return bool(min(across, up) < SMALL)


def _draw_sets(ax: Axes, guarantees: Guarantees) -> None:
    """The sets, the widest below, without a view or a legend."""
    by_name = {guarantee.name: guarantee for guarantee in guarantees.guarantees}
    for depth, (name, look) in enumerate(FILLS.items()):
        if name in by_name:
            _area(ax, by_name[name], look, 1.0 + 0.1 * depth)
    for name, (colour, dashes) in OUTLINES.items():
        if name in by_name:
            guarantee = by_name[name]
            for n, ring in enumerate(guarantee.region.rings or (np.full((1, 2), np.nan),)):
                text = "" if n else _words(guarantee)
                ax.plot(*ring.T, color=colour, linestyle=dashes, zorder=3.0, label=text)


def draw_region(ax: Axes, region: Region) -> None:
    """The walls of one guarantee; why there are none, where there are none."""
    fill, edge, width, _ = FILLS["passive"]
    for ring in region.rings:
        ax.add_patch(Polygon(ring, facecolor=fill, edgecolor=edge, linewidth=width))
    corners = np.vstack(region.rings) if region.rings else np.array([[0.0, 0.0], [1.0, 1.0]])
    (K0, B0), (K1, B1) = corners.min(axis=0), corners.max(axis=0)
    K, B = ROOM * (K1 - K0), ROOM * (B1 - B0)
    frame(ax, (float(K0 - K), float(K1 + K), float(B0 - B), float(B1 + B)), empty=False)
    if not region.rings:
        draw_empty(ax, "\n".join(wrap(region.reason or "no wall has this guarantee", REASON)))


def draw_couplings(ax: Axes, couplings: Couplings) -> None:
    """Couplings k_c, b_c that keep a device stable between any operator and any environment."""
    sets = (
        ("Llewellyn, discrete", couplings.llewellyn, "#E8EFF5", "", BLACK),
        ("Raisbeck, discrete", couplings.raisbeck, "#AFC6DA", "////", BLUE),
        ("the sampled device itself", couplings.sampled, "#6F93B3", "\\\\\\\\", VERMILION),
    )
    rings = [ring for _, region, *_ in sets for ring in region.rings]
    for depth, (name, region, fill, hatch, edge) in enumerate(sets):
        _patch(ax, region, _with_peak(name, region), (fill, hatch, edge), 1.0 + 0.1 * depth)
    walls = np.vstack([*rings, [[0.0, 0.0]]])
    k1 = float(walls[:, 0].max())
    b0, b1 = float(walls[:, 1].min()), float(walls[:, 1].max())
    frame(ax, (0.0, 1.05 * (k1 or 1.0), b0 - 0.05 * (b1 - b0), b1 + 0.05 * (b1 - b0) or 1.0), empty=False)
    label(ax.xaxis, "Coupling stiffness k", "N/m")
    label(ax.yaxis, "Coupling damping b", "N s/m")
    legend_above(ax, columns=1)


def _area(ax: Axes, guarantee: Guarantee, look: tuple[str, str, float, float], zorder: float) -> None:
    fill, edge, width, above = look
    rings, text = guarantee.region.rings, _words(guarantee)
    if not rings:
        ax.plot([], [], color="none", label=text)
        return
    outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
    ax.add_patch(PathPatch(outline, facecolor=fill, edgecolor="none", zorder=zorder))
    ax.add_patch(PathPatch(outline, fill=False, edgecolor=edge, linewidth=width, zorder=above))
    ax.add_patch(
        Polygon([[np.nan, np.nan]], facecolor=fill, edgecolor=edge, linewidth=min(width, 2.5), label=text)
    )


def _patch(ax: Axes, region: Region, text: str, look: tuple[str, str, str], zorder: float) -> None:
    fill, hatch, edge = look
    if not region.rings:
        ax.plot([], [], color="none", label=text)
        return
    outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in region.rings))
    patch = PathPatch(outline, facecolor=fill, edgecolor=edge, hatch=hatch, linewidth=1.2, zorder=zorder)
    ax.add_patch(patch)
    key = Polygon([[np.nan, np.nan]], facecolor=fill, edgecolor=edge, hatch=hatch, label=text)
    ax.add_patch(key)


def _words(guarantee: Guarantee) -> str:
    return _with_peak(WORDS.get(guarantee.name, guarantee.name), guarantee.region)


def _with_peak(words: str, region: Region) -> str:
    if region.reason is not None:
        return f"{words}: none"
    return f"{words}: {quantity(region.stiffness_max, 'N/m')}"


def _box(guarantees: Guarantees) -> Window:
    K0, K1, B0, B1 = guarantees.chart.box
    return max(K0, -0.05 * K1), K1, max(B0, -0.1 * B1), B1
