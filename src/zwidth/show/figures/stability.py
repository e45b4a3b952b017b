"""The stability chart: which walls are stable, and the same for several models laid over each other.

How fast the vibrations of stable walls decay: contours of equal spectral radius (thesis Fig. 5.10).

The frequency of the vibration along the edge of the stable set (thesis Fig. 3.8).

A robust chart: the walls stable for every member, and which member sets each part of the limit.

The chart of a measured device: measured points on the edge, the band in doubt, what cannot be relied on.

Paths of eigenvalues in the z-plane, with the unit circle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isnan, log
from textwrap import wrap
from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Polygon

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.chart.chart_base import BoundaryArc
from zwidth.chart.decay import FastestDecay
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.chart.measured.stable_regions import DoubtBand
from zwidth.chart.robust.common_chart import CommonChart
from zwidth.errors import ChartError
from zwidth.loop.loop import Loop
from zwidth.measures.root_paths import EigenvaluePaths
from zwidth.model.modes import natural_frequencies
from zwidth.show.circumstances import value_text
from zwidth.show.figures import style
from zwidth.show.units import quantity

# KMIN, KMAX [N/m], BMIN, BMAX [N s/m]
Window = tuple[float, float, float, float]


def draw_chart(ax: Axes, chart: StabilityChart, window: Window | None = None) -> None:
    """The stable walls filled, their edge, and the stiffest wall marked with its numbers.

    window  what to show; left out: the regions' box and 5 %
    """
    in_doubt = bool(getattr(chart, "doubt", ""))
    for n, ring in enumerate(chart.regions):
        text = "stable walls found; there may be others" if in_doubt else "stable walls"
        ax.add_patch(Polygon(ring, facecolor=style.STABLE, edgecolor="none", label="" if n else text))
    for arc in chart.boundary:
        ax.plot(arc.stiffness, arc.damping, color=style.BLACK, solid_capstyle="round")
    if not isnan(chart.stiffness_max):
        mark_stiffest(ax, chart, _stiffest_text(chart))
    frame(ax, window or chart.box, empty=not chart.regions)
    style.legend_above(ax)


def draw_models(ax: Axes, charts: Mapping[str, StabilityChart], window: Window | None = None) -> None:
    """The edges of several models' charts over each other (thesis Fig. 4.4).

    charts  label -> chart; the first is the one that the others approximate, and its region is filled
    window  what to show; left out: the box of the first that has stable walls, and 5 %
    """
    first = next(iter(charts.values()))
    shown = next((chart for chart in charts.values() if chart.regions), first)
    for ring in first.regions:
        ax.add_patch(Polygon(ring, facecolor=style.STABLE, edgecolor="none"))
    # the first on top: where models agree it is the one to be seen
    for n, (name, chart) in enumerate(charts.items()):
        colour, dashes = style.LINES[n % len(style.LINES)]
        text = name if chart.regions else f"{name}: nothing stable"
        for k, ring in enumerate(edges_of(chart.regions) or (np.full((1, 2), np.nan),)):
            ax.plot(*ring.T, color=colour, linestyle=dashes, label="" if k else text, zorder=4.0 - 0.1 * n)
    frame(ax, window or shown.box, empty=not shown.regions)
    style.legend_above(ax, columns=2)


def edges_of(rings: Sequence[Floats]) -> list[Floats]:
    """The edges of what several rings cover, (k, 2) with nan between pieces of an edge.

    A cell with a hole is cut into rings: what two of them share is a cut, and no edge.
    """
    if not len(rings):
        return []
    pieces = [np.hstack([ring[:-1], ring[1:]]) for ring in rings]  # rows (K, B) of one end, (K, B) of the other
    ends = np.vstack(pieces)
    # a piece that two rings share may run either way: its ends are put in the order of K, then of B
    backwards = (ends[:, 0] > ends[:, 2]) | ((ends[:, 0] == ends[:, 2]) & (ends[:, 1] > ends[:, 3]))
    ordered = np.where(backwards[:, None], ends[:, [2, 3, 0, 1]], ends)
    _, inverse, count = np.unique(ordered, axis=0, return_inverse=True, return_counts=True)
    shared = np.split(count[inverse.ravel()] > 1, np.cumsum([len(piece) for piece in pieces])[:-1])
    outlines = []
    for ring, cut in zip(rings, shared, strict=True):
        # a point in the middle of each cut, without coordinates, ends the line there
        breaks = np.flatnonzero(cut) + 1
        outlines.append(np.insert(np.asarray(ring, dtype=float), breaks, np.nan, axis=0))
    return outlines


def _stiffest_text(chart: StabilityChart) -> str:
    """The stiffest wall in words: stiffness, damping, and the frequencies at which it oscillates."""
    numbers = f"{quantity(chart.stiffness_max, 'N/m')} at {quantity(chart.damping_at_stiffness_max, 'N s/m')}"
    vibration = " and ".join(quantity(f, "Hz") for f in chart.frequencies_at_stiffness_max)
    return f"stiffest{' found' if getattr(chart, 'doubt', '') else ''}: {numbers}; oscillates at {vibration}"


def mark_stiffest(ax: Axes, chart: StabilityChart | MeasuredChart, text: str) -> None:
    """A ring at the stiffest wall, with this text in the legend."""
    ax.plot(
        [chart.stiffness_max],
        [chart.damping_at_stiffness_max],
        marker="o",
        markersize=6.0,
        markerfacecolor="white",
        markeredgecolor=style.VERMILION,
        markeredgewidth=1.6,
        linestyle="none",
        zorder=5.0,
        label=text,
    )


def frame(ax: Axes, window: Window, *, empty: bool) -> None:
    """Set the limits and labels of a chart, and draw the axes K = 0 and B = 0 where they are in view.

    empty  whether no wall is stable, which the middle then says
    """
    K0, K1, B0, B1 = window
    ax.set_xlim(K0, K1)
    ax.set_ylim(B0, B1)
    for draw, low, high in ((ax.axvline, K0, K1), (ax.axhline, B0, B1)):
        if low < 0.0 < high:
            draw(0.0, color=style.GREY, linewidth=0.6, zorder=1.5)
    style.label(ax.xaxis, "Virtual stiffness K", "N/m")
    style.label(ax.yaxis, "Virtual damping B", "N s/m")
    if empty:
        style.draw_empty(ax)


def draw_decay_contours(
    ax: Axes,
    loop: Loop,
    radii: Sequence[float] | None = None,
    window: Window | None = None,
    chart: StabilityChart | None = None,
) -> None:
    """Walls whose slowest motion shrinks by the same factor per sample, and the fastest-decaying wall.

    radii  factors per sample, each below 1; left out: some round ones between 1 and the smallest there is
    chart  the loop's stability chart, where it is at hand
    """
    chart = chart or stability_chart(loop)
    best = chart.fastest_decay
    levels = round_radii(best.spectral_radius) if radii is None and best else list(radii or ())
    draw_level(ax, chart, "1 (edge of stability)", 0, 1)
    for n, radius in enumerate(levels):
        try:
            level = stability_chart(loop, radius, decay=False).drawn()
        except ChartError:  # a sliver too fine to close: this level is left out of the drawing, and its legend
            continue
        draw_level(ax, level, _radius_text(radius, loop.period), n + 1, len(levels) + 1)
    buildable = chart.fastest_decay_in_first_quadrant
    _draw_star(ax, buildable, f"fastest{' with K, B ≥ 0' * (best != buildable)}", loop.period, style.VERMILION)
    if best != buildable:
        _draw_star(ax, best, "fastest of all", loop.period, "white")
    frame(ax, window or chart.box, empty=not chart.regions)
    style.legend_above(ax, columns=2, title="Slowest motion: factor per sample (time until a tenth is left)")


def _draw_star(ax: Axes, wall: FastestDecay | None, name: str, period: float, colour: str) -> None:
    """Draw a star of this colour at the wall, if there is one; its name and its radius stand in the legend.

    period  T [s]
    """
    if wall:
        title = f"{name}: {_radius_text(wall.spectral_radius, period)}"
        (star,) = ax.plot(
            [wall.stiffness], [wall.damping], "*", color=style.VERMILION, markersize=11.0, label=title
        )
        star.set(markerfacecolor=colour, zorder=5.0)


def draw_level(ax: Axes, chart: StabilityChart, text: str, rank: int, count: int) -> None:
    """Draw one contour of decay; black for rank 0, lighter with the rank of `count` contours."""
    colour = colormaps["viridis"](0.75 * rank / max(count - 1, 1)) if rank else style.BLACK
    for k, ring in enumerate(edges_of(chart.regions)):
        dashes = style.LINES[rank % len(style.LINES)][1]
        ax.plot(*ring.T, color=colour, linestyle=dashes, label="" if k else text, linewidth=1.2)


def round_radii(smallest: float, most: int = 5) -> list[float]:
    """At most `most` round numbers strictly between the smallest radius and 1, descending, by the coarsest step
    that gives three."""
    for step in (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001, 1e-5, 1e-6):
        # multiples of the step between 1 and the smallest radius; one within a thousandth of a step of it is not
        count = int(np.ceil((1.0 - smallest) / step - 1e-3)) - 1
        if count >= min(3, most):
            stride = -(-count // most)
            return [round(1.0 - step * k, 9) for k in range(stride, count + 1, stride)]
    return []


def tenfold_time(radius: float, period: float) -> float:
    """Time after which a motion that shrinks by this factor per sample has shrunk to a tenth [s]."""
    if radius <= 0.0:
        return 0.0
    return inf if radius >= 1.0 else period * log(10.0) / -log(radius)


def _radius_text(radius: float, period: float) -> str:
    """A spectral radius, with the time in which its motion shrinks to a tenth, in words.

    period  T [s]
    """
    return f"{radius:.4g} ({quantity(tenfold_time(radius, period), 's')})"


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
        ax.plot(K, f, color=style.BLUE, label="" if n else "along the edge of stability")
    for n, (K_corner, _, low, high) in enumerate(corners(chart)):
        text = f"corner: {quantity(low, 'Hz')} and {quantity(high, 'Hz')}"
        ax.plot([K_corner, K_corner], [low, high], color=style.VERMILION, linewidth=0.8, linestyle=":")
        ax.plot(
            [K_corner, K_corner],
            [low, high],
            marker="o",
            markersize=6.0,
            markerfacecolor="white",
            markeredgecolor=style.VERMILION,
            markeredgewidth=1.4,
            linestyle="none",
            zorder=4.0,
            label=text if n < 3 else "",
        )
    _draw_natural_frequencies(ax, chart)
    ax.set_xlim(left=0.0)
    ax.set_ylim(bottom=0.0)
    style.label(ax.xaxis, "Virtual stiffness K", "N/m")
    style.label(ax.yaxis, "Frequency of the vibration", "Hz")
    style.legend_above(ax)


def corners(chart: StabilityChart) -> list[tuple[float, float, float, float]]:
    """Walls with K > 0, B >= 0 at which two arcs meet, with both frequencies: (K, B, lower, higher)."""
    ends = [end for arc in chart.boundary for end in _ends(arc)]
    if not ends:
        return []
    K, B, f = np.array(ends).T
    # least distance in K and in B of two walls that are not one
    near = SAME_WALL * np.max(
        [np.ptp(np.vstack([arc.stiffness, arc.damping]), axis=1) for arc in chart.boundary], 0
    )
    nyquist = 0.5 / chart.loop.period
    pairs = []
    for i in range(len(ends)):
        for j in range(i + 1, len(ends)):
            # 1e3: K above 0 by a thousandth of the edge's extent
            together = abs(K[i] - K[j]) <= near[0] and abs(B[i] - B[j]) <= near[1]
            if together and abs(f[i] - f[j]) > 1e-6 * nyquist and K[i] > 1e3 * near[0] and B[i] >= 0.0:
                low, high = sorted((float(f[i]), float(f[j])))
                pairs.append((float(K[i]), float(B[i]), low, high))
    return sorted(pairs, reverse=True)


def _ends(arc: BoundaryArc) -> list[tuple[float, float, float]]:
    """Both ends of an arc, (K [N/m], B [N s/m], f [Hz])."""
    return [(float(arc.stiffness[k]), float(arc.damping[k]), float(arc.frequency[k])) for k in (0, -1)]


def _draw_natural_frequencies(ax: Axes, chart: StabilityChart) -> None:
    """The first eight flexible modes below half the sampling frequency, as lines across."""
    natural = natural_frequencies(chart.loop.plant)
    shown = [f for f in natural if 0.0 < f < 0.5 / chart.loop.period][:8]
    for n, f in enumerate(shown):
        numbers = ", ".join(quantity(x, "Hz") for x in shown)
        text = f"natural frequenc{'ies' if len(shown) > 1 else 'y'}: {numbers}"
        ax.axhline(f, color=style.GREY, linestyle=(0, (6, 3)), linewidth=0.8, label="" if n else text)


NAMED: Final = len(style.LINES) - 1  # binding members with a line of their own; the last line is for the rest
DRAWN_MEMBERS: Final = 200  # whose sets are shaded at most
DRAWN_EDGES: Final = 9  # of members, at most: more lie too close to be told apart
SHADE: Final = "#EFEFEF"  # of walls that some members allow
LIGHT: Final = "#9A9A9A"
MOST_REACH: Final = 10.0  # times the robust set's extent that is shown
LONGEST: Final = 60  # signs in a line of the legend
SHORTEST: Final = 0.02  # share of the edge in view that a named member binds at least
NO_BREAK: Final = "\u00a0"


def draw_robust(
    ax: Axes, chart: CommonChart, members: Sequence[Mapping[str, Any]] = (), window: Window | None = None
) -> None:
    """The robust set filled, its edge by binding member; behind it what single members allow, the best one dashed.

    members  path -> value of each, for the legend
    window   what to show; left out: the box of all outlines' part with K >= 0 and B >= 0, and 5 %
    """
    view = window or _default_window(chart)
    for n, ring in enumerate(chart.regions):
        text = "" if n else _filled_set_text(chart)
        ax.add_patch(Polygon(ring, facecolor=style.STABLE, edgecolor="none", label=text, zorder=1.1))
    _draw_members(ax, chart)
    for n, outline in enumerate(chart.outlines[chart.best_by_area]):
        text = "" if n else f"best member by area: {_member_words(members, chart.best_by_area)}"
        ax.plot(*outline.T, color=style.GREY, linewidth=1.1, linestyle=(0, (3, 2)), label=text, zorder=1.4)
    _draw_edge(ax, chart, members, view)
    frame(ax, view, empty=not chart.regions)
    style.legend_above(ax, columns=2)


def _draw_members(ax: Axes, chart: CommonChart) -> None:
    """Shade what any member allows, and draw the edges of some, spread evenly over the members by area."""
    outlines = chart.outlines
    by_area = sorted(outlines, key=lambda index: sum(map(_ring_area, outlines[index])))
    shaded, lined = (_evenly_chosen(by_area, most) for most in (DRAWN_MEMBERS, DRAWN_EDGES))
    rings = [ring for index in shaded for ring in outlines[index]]
    ax.add_collection(PolyCollection(rings, facecolors=SHADE, zorder=1.0, label="stable for some member"))
    edges = [ring for index in lined for ring in outlines[index]]
    text = "a member's edge" if len(lined) == len(by_area) else f"edges of {len(lined)} of {len(by_area)} members"
    ax.add_collection(LineCollection(edges, colors=LIGHT, linewidths=0.5, zorder=1.2, label=text))


def _ring_area(ring: Floats) -> float:
    """Area within a closed ring (k, 2)."""
    x, y = ring.T
    return 0.5 * abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))


def _evenly_chosen(items: Sequence[int], most: int) -> list[int]:
    """At most `most` of the items, evenly spread, the first and the last among them."""
    return [items[k] for k in np.unique(np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int))]


def _filled_set_text(chart: CommonChart) -> str:
    """What the filled set is, for the legend."""
    if chart.failed:
        known = len(chart.charted)
        return f"stable for {known} of {known + chart.unknown_members} members; of the others nothing is known"
    return "stable for every member" + (" (in doubt)" if chart.doubt else "")


def _draw_edge(ax: Axes, chart: CommonChart, members: Sequence[Mapping[str, Any]], view: Window) -> None:
    """Draw the edge's arcs; the members who bind most of what is seen have a line and a name of their own."""
    K0, K1, B0, B1 = view
    lengths: dict[int, float] = {}  # member -> length of the edge that it binds in view, whose sides are 1
    for arc in chart.boundary:
        x, y = (arc.stiffness - K0) / (K1 - K0), (arc.damping - B0) / (B1 - B0)
        inside = (x > 0.0) & (x < 1.0) & (y > 0.0) & (y < 1.0)
        length = float(np.sum(np.hypot(np.diff(x), np.diff(y))[inside[1:] & inside[:-1]]))
        lengths[arc.member] = lengths.get(arc.member, 0.0) + length
    least_length = SHORTEST * sum(lengths.values())
    ranked = sorted(lengths, key=lambda member: -lengths[member])
    named = [member for member in ranked if lengths[member] > least_length][:NAMED]
    others = sum(length for member, length in lengths.items() if member not in named)
    # texts that the legend has; others that bind next to nothing have none
    drawn = {"limited by others"} if others <= least_length else set[str]()
    for arc in chart.boundary:
        place = named.index(arc.member) if arc.member in named else NAMED
        colour, dashes = style.LINES[place]
        text = f"limited by {_member_words(members, arc.member)}" if place < NAMED else "limited by others"
        ax.plot(
            arc.stiffness,
            arc.damping,
            color=colour,
            linestyle=dashes,
            linewidth=2.0,
            label="" if text in drawn else text,
            zorder=3.0,
        )
        drawn.add(text)


def _member_words(members: Sequence[Mapping[str, Any]], index: int) -> str:
    """A member's values in words, on two lines at most: the last step of each path, where that is clear."""
    if index >= len(members) or not members[index]:
        return f"member {index}"
    values = members[index]
    last = [path.rsplit(".", 1)[-1] for path in values]
    names = [name if last.count(name) == 1 else path for name, path in zip(last, values, strict=True)]
    pairs = zip(names, values.values(), strict=True)
    lines = wrap(
        ", ".join(f"{name} = {value_text(value)}".replace(" ", NO_BREAK) for name, value in pairs), LONGEST
    )
    if len(lines) > 2:
        lines = [lines[0], f"{lines[1]} … (member {index})"]
    return "\n".join(lines)


def _default_window(chart: CommonChart) -> Window:
    """KMIN, KMAX, BMIN, BMAX of what single members allow with K, B >= 0, at most MOST_REACH times the robust set.

    0 to 1 where nothing is stable for every member
    """
    walls = [outline for outlines in chart.outlines.values() for outline in outlines]
    if isnan(chart.stiffness_max) or not walls:
        return (0.0, 1.0, 0.0, 1.0)
    K, B = np.maximum(np.vstack(walls).max(axis=0), 0.0)
    reach = np.vstack(chart.regions).max(axis=0)
    # a member that allows many times more would press the robust set into a corner
    K1, B1 = np.minimum((K, B), MOST_REACH * reach)
    return -0.04 * float(K1), 1.05 * float(K1), -0.05 * float(B1), 1.05 * float(B1)


LONGEST_LIST = 3  # stretches named in the legend


def draw_measured_chart(ax: Axes, chart: MeasuredChart, window: Window | None = None) -> None:
    """The stable walls filled, the interpolated edge, the measured points on it, and the band of the error.

    Walls, edge and points are nominal. Marked are the stiffest wall that is certain, and the nominal one. Of the
    stretches that cannot be relied on those are named through which the edge runs.

    window  what to show; left out: the regions' box and 5 %
    """
    for n, ring in enumerate(chart.regions):
        ax.add_patch(
            Polygon(ring, facecolor=style.STABLE, edgecolor="none", label="" if n else "stable as measured")
        )
    if chart.band is not None:
        _fill_band(ax, chart.band)
    for ring in edges_of(chart.regions):
        ax.plot(*ring.T, color=style.BLACK, linewidth=0.9)
    _draw_measured_points(ax, chart)
    _draw_unusable(ax, chart)
    if chart.stiffness_max == chart.stiffness_max:  # not nan
        mark_stiffest(ax, chart, f"stiffest, certain: {quantity(chart.stiffness_max, 'N/m')}")
    if chart.band is not None and chart.stiffness_max_nominal == chart.stiffness_max_nominal:
        ax.plot(
            [chart.stiffness_max_nominal],
            [chart.damping_at_stiffness_max_nominal],
            color=style.BLACK,
            marker="x",
            linestyle="none",
            zorder=4.9,
            label=f"as measured: {quantity(chart.stiffness_max_nominal, 'N/m')}",
        )
    frame(ax, window or chart.box, empty=not chart.regions)
    style.legend_above(ax, columns=2)


def _fill_band(ax: Axes, band: DoubtBand) -> None:
    """Fill the walls whose verdict the error of the measurement leaves open."""
    for n, ring in enumerate(band.regions):
        ax.add_patch(
            Polygon(
                ring,
                facecolor=style.ORANGE,
                edgecolor="none",
                alpha=0.45,
                zorder=1.8,
                label="" if n else f"in doubt, {band.meaning.partition(' confidence')[0]}",
            )
        )


def _draw_measured_points(ax: Axes, chart: MeasuredChart) -> None:
    """Draw the measured points on the edge, but for those of frequency 0 and of half the sampling rate."""
    for n, arc in enumerate(chart.boundary):
        if 0.0 < arc.frequency[0] < 0.5 / chart.loop.period * (1.0 - 1e-9):
            ax.plot(
                arc.stiffness,
                arc.damping,
                color=style.BLUE,
                marker=".",
                markersize=3.0,
                linestyle="none",
                label="" if n else "measured",
            )


def _draw_unusable(ax: Axes, chart: MeasuredChart) -> None:
    """Draw the edge dashed within the unusable stretches that it runs through, each a line of the legend."""
    edge = chart.edge
    f = edge.angles / (2.0 * np.pi * chart.loop.period)
    spans = sorted({(stretch.low, stretch.high) for stretch in chart.unusable if stretch.on_edge})
    for n, (low, high) in enumerate(spans):
        inside = (f >= low) & (f <= high)
        K, B = np.where(inside, edge.walls[:, 0], np.nan), np.where(inside, edge.walls[:, 1], np.nan)
        text = f"unusable, {quantity(low, 'Hz')} to {quantity(high, 'Hz')}"
        if n == LONGEST_LIST:
            text = f"unusable, {len(spans) - LONGEST_LIST} more stretches"
        ax.plot(
            K,
            B,
            color=style.VERMILION,
            linestyle=((0, (1.2, 1.2)), (0, (4, 1.5)), (0, (6, 1.5, 1.2, 1.5)))[n % LONGEST_LIST],
            linewidth=2.2,
            label=text if n <= LONGEST_LIST else "",
        )


ROOM: Final = 1.08  # radius shown, over that of what is drawn
CIRCLE: Final = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 361))


def draw_eigenvalue_paths(ax: Axes, paths: EigenvaluePaths) -> None:
    """Each path of eigenvalues z in its own colour; crosses where it passes through the unit circle.

    It begins at a circle, at the first value of what is varied, and ends at a square, at the last.
    """
    ax.plot(CIRCLE.real, CIRCLE.imag, color=style.GREY, linewidth=0.8, label="unit circle", zorder=1.0)
    for n, z in enumerate(paths.eigenvalues.T):
        colour, dashes = style.LINES[n % len(style.LINES)]
        ax.plot(z.real, z.imag, color=colour, linestyle=dashes, zorder=2.0)
    for row, marker, value in ((0, "o", paths.values[0]), (-1, "s", paths.values[-1])):
        z = paths.eigenvalues[row]
        ax.plot(
            z.real,
            z.imag,
            marker,
            color=style.BLACK,
            markerfacecolor="white",
            markersize=4.5,
            label=f"at {value:g}",
        )
    if paths.crossings:
        z = np.array([crossing.eigenvalue for crossing in paths.crossings])
        ax.plot(
            z.real, z.imag, "x", color=style.VERMILION, markersize=7.0, zorder=3.0, label="crosses the unit circle"
        )
    radius = ROOM * max(1.0, float(np.abs(paths.eigenvalues).max()))
    ax.set_xlim(-radius, radius)
    ax.set_ylim(-radius, radius)
    ax.set_aspect("equal")
    ax.set_xlabel("Real part of z")
    ax.set_ylabel("Imaginary part of z")
    style.legend_above(ax, columns=4)
