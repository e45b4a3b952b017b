"""Nested guarantees on one chart: shades that survive a grey print, and edges that show where they coincide."""

from __future__ import annotations

from textwrap import wrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path

from zwidth.arrays import Floats
from zwidth.guarantees.coupling import Couplings
from zwidth.guarantees.guarantees import Guarantee, Guarantees
from zwidth.guarantees.region import Region
from zwidth.show.figures.stability import Window, frame
from zwidth.show.figures.style import BLACK, BLUE, GREEN, GREY, PURPLE, VERMILION, draw_empty, label, legend_above
from zwidth.show.units import quantity

# Fill, colour and dashes of the edge, and its place above the fills; the sets get darker inwards. The upper edges
# have gaps, through which those below are seen where sets share an edge.
FILLS: Final = {
    "stable": ("#EEF3F7", BLACK, "-", 2.0),
    "robust": ("#D8E3EC", GREEN, (0, (7, 3)), 2.1),
    "spring-stable": ("#BFD1E0", BLUE, (0, (4, 4)), 2.2),
    "passive": ("#A0BAD0", VERMILION, (0, (1.2, 3)), 2.3),
}
EDGE: Final = 1.3  # points, width of an edge
SMALL: Final = 0.1  # share of the view below which a set is drawn enlarged, too
# Left, bottom, width and height of the enlarged part, as shares of the axes: beside them, it hides nothing.
INSET: Final = (1.18, 0.0, 0.62, 1.0)
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
    view = window or _default_window(guarantees)
    small = [ring for one in guarantees.guarantees for ring in one.region.rings if _is_small(ring, view)]
    frame(ax, view, empty=not guarantees.chart.regions)
    if small and window is None:
        _enlarge(ax, guarantees, np.vstack(small))
    legend_above(ax, columns=2)


def _enlarge(ax: Axes, guarantees: Guarantees, walls: Floats) -> None:
    """The part about some walls (k, 2) [K, B] once more, enlarged beside the axes."""
    inset = ax.inset_axes(INSET, zorder=5.0)
    _draw_sets(inset, guarantees)
    low, high = walls.min(axis=0), walls.max(axis=0)
    room = INSET_ROOM * (high - low)
    (K0, B0), (K1, B1) = (low - room).tolist(), (high + room).tolist()
    frame(inset, (K0, K1, B0, B1), empty=False)
    inset.locator_params(nbins=4)
    inset.set_ylabel("")
    for spine in inset.spines.values():
        spine.set(visible=True, color=GREY, linewidth=0.8)
    ax.indicate_inset((K0, B0, K1 - K0, B1 - B0), edgecolor=GREY, alpha=1.0)
    inset.set_title("enlarged", pad=2.0, loc="right")


def _is_small(ring: np.ndarray, view: Window) -> bool:
    """Whether a ring (k, 2) of walls [K, B] is too small to be seen in a view of KMIN, KMAX, BMIN, BMAX."""
    across, up = np.ptp(ring, axis=0) / (view[1] - view[0], view[3] - view[2])
    return bool(min(across, up) < SMALL)


def _draw_sets(ax: Axes, guarantees: Guarantees) -> None:
    """The sets, the widest below, without a view or a legend."""
    by_name = {guarantee.name: guarantee for guarantee in guarantees.guarantees}
    for depth, (name, look) in enumerate(FILLS.items()):
        if name in by_name:
            _draw_set(ax, by_name[name], look, 1.0 + 0.1 * depth)
    for name, (colour, dashes) in OUTLINES.items():
        if name in by_name:
            guarantee = by_name[name]
            # without walls the legend names it all the same
            for n, ring in enumerate(guarantee.region.rings or (np.full((1, 2), np.nan),)):
                text = "" if n else _legend_text(guarantee)
                ax.plot(*ring.T, color=colour, linestyle=dashes, zorder=3.0, label=text)


def draw_region(ax: Axes, region: Region) -> None:
    """The walls of one guarantee; why there are none, where there are none."""
    fill, edge, *_ = FILLS["passive"]
    for ring in region.rings:
        ax.add_patch(Polygon(ring, facecolor=fill, edgecolor=edge, linewidth=EDGE))
    corners = np.vstack(region.rings) if region.rings else np.array([[0.0, 0.0], [1.0, 1.0]])
    (K0, B0), (K1, B1) = corners.min(axis=0), corners.max(axis=0)
    room_K, room_B = ROOM * (K1 - K0), ROOM * (B1 - B0)
    frame(ax, (float(K0 - room_K), float(K1 + room_K), float(B0 - room_B), float(B1 + room_B)), empty=False)
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
        _draw_coupling_set(ax, region, _with_peak(name, region), (fill, hatch, edge), 1.0 + 0.1 * depth)
    walls = np.vstack([*rings, [[0.0, 0.0]]])
    k_high = float(walls[:, 0].max())
    b_low, b_high = float(walls[:, 1].min()), float(walls[:, 1].max())
    frame(
        ax,
        (0.0, 1.05 * (k_high or 1.0), b_low - 0.05 * (b_high - b_low), b_high + 0.05 * (b_high - b_low) or 1.0),
        empty=False,
    )
    label(ax.xaxis, "Coupling stiffness k", "N/m")
    label(ax.yaxis, "Coupling damping b", "N s/m")
    legend_above(ax, columns=1)


def _draw_set(ax: Axes, guarantee: Guarantee, look: tuple[str, str, Any, float], zorder: float) -> None:
    """Draw the walls of one guarantee: filled at the height `zorder`, and their edge above all fills.

    look  fill, colour and dashes of the edge, and height of the edge, as in FILLS
    """
    fill, edge, dashes, above = look
    rings, text = guarantee.region.rings, _legend_text(guarantee)
    if not rings:  # for the legend alone
        ax.plot([], [], color="none", label=text)
        return
    outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
    ax.add_patch(PathPatch(outline, facecolor=fill, edgecolor="none", zorder=zorder))
    line: dict[str, Any] = {"edgecolor": edge, "linestyle": dashes, "linewidth": EDGE}
    ax.add_patch(PathPatch(outline, fill=False, zorder=above, **line))
    ax.add_patch(Polygon([[np.nan, np.nan]], facecolor=fill, label=text, **line))


def _draw_coupling_set(ax: Axes, region: Region, text: str, look: tuple[str, str, str], zorder: float) -> None:
    """Draw the couplings of one set, named `text`.

    look  fill, hatch and colour of the edge
    """
    fill, hatch, edge = look
    if not region.rings:  # for the legend alone
        ax.plot([], [], color="none", label=text)
        return
    outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in region.rings))
    patch = PathPatch(outline, facecolor=fill, edgecolor=edge, hatch=hatch, linewidth=1.2, zorder=zorder)
    ax.add_patch(patch)
    key = Polygon([[np.nan, np.nan]], facecolor=fill, edgecolor=edge, hatch=hatch, label=text)
    ax.add_patch(key)


def _legend_text(guarantee: Guarantee) -> str:
    """What a guarantee is called in the legend, with its largest stiffness."""
    return _with_peak(WORDS.get(guarantee.name, guarantee.name), guarantee.region)


def _with_peak(words: str, region: Region) -> str:
    """The words, with the largest stiffness of the region."""
    if region.reason is not None:
        return f"{words}: none"
    return f"{words}: {quantity(region.stiffness_max, 'N/m')}"


def _default_window(guarantees: Guarantees) -> Window:
    """The window KMIN, KMAX, BMIN, BMAX of the chart with a little of what lies below K = 0 and B = 0."""
    K0, K1, B0, B1 = guarantees.chart.box
    return max(K0, -0.05 * K1), K1, max(B0, -0.2 * B1), B1
