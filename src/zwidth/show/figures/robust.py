"""A robust chart: the walls stable for every member, and which member sets each part of the limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan
from textwrap import wrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Polygon

from zwidth.chart.robust.common_chart import CommonChart
from zwidth.show.figures.stability import Window, frame
from zwidth.show.figures.style import GREY, LINES, STABLE, legend_above
from zwidth.show.member_text import value_text

NAMED: Final = len(LINES) - 1  # binding members with a line of their own; the last line is for the rest
DRAWN_MEMBERS: Final = 200  # members' outlines at most
LIGHT: Final = "#B8B8B8"
LONGEST: Final = 60  # signs in a line of the legend
SHORTEST: Final = 0.02  # share of the window that a named member binds
NO_BREAK: Final = "\u00a0"


def draw_robust(
    ax: Axes, chart: CommonChart, members: Sequence[Mapping[str, Any]] = (), window: Window | None = None
) -> None:
    """The robust set filled, its edge by binding member; behind it all members' outlines, the best one's dashed.

    members  path -> value of each, for the legend
    window   what to show; left out: the box of all outlines' part with K >= 0 and B >= 0, and 5 %
    """
    view = window or _box(chart)
    outlines = [outline for index in list(chart.outlines)[:DRAWN_MEMBERS] for outline in chart.outlines[index]]
    ax.add_collection(LineCollection(outlines, colors=LIGHT, linewidths=0.4, zorder=1.2, label="a member's edge"))
    for n, ring in enumerate(chart.regions):
        text = "" if n else _claim(chart)
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label=text, zorder=1.1))
    for n, outline in enumerate(chart.outlines[chart.best_by_area]):
        text = "" if n else f"best member by area: {_words(members, chart.best_by_area)}"
        ax.plot(*outline.T, color=GREY, linewidth=1.1, linestyle=(0, (3, 2)), label=text, zorder=1.4)
    _draw_edge(ax, chart, members, view)
    frame(ax, view, empty=not chart.regions)
    legend_above(ax)


def _claim(chart: CommonChart) -> str:
    """What the filled set is, for the legend."""
    if chart.failed:
        known = len(chart.charted)
        return f"stable for {known} of {known + chart.unknown_members} members; of the others nothing is known"
    return "stable for every member" + (" (in doubt)" if chart.doubt else "")


def _draw_edge(ax: Axes, chart: CommonChart, members: Sequence[Mapping[str, Any]], view: Window) -> None:
    """The edge's arcs; those who bind most of what is seen are named."""
    K0, K1, B0, B1 = view
    lengths: dict[int, float] = {}
    for arc in chart.boundary:
        x, y = (arc.stiffness - K0) / (K1 - K0), (arc.damping - B0) / (B1 - B0)
        inside = (x > 0.0) & (x < 1.0) & (y > 0.0) & (y < 1.0)
        length = float(np.sum(np.hypot(np.diff(x), np.diff(y))[inside[1:] & inside[:-1]]))
        lengths[arc.member] = lengths.get(arc.member, 0.0) + length
    ranked = sorted(lengths, key=lambda member: -lengths[member])
    named = [member for member in ranked if lengths[member] > SHORTEST][:NAMED]
    drawn: set[str] = set()
    for arc in chart.boundary:
        place = named.index(arc.member) if arc.member in named else NAMED
        colour, dashes = LINES[place]
        text = f"limited by {_words(members, arc.member)}" if place < NAMED else "limited by others"
        ax.plot(
            arc.stiffness,
            arc.damping,
            color=colour,
            linestyle=dashes,
            linewidth=2.0,
            label="" if text in drawn or lengths[arc.member] == 0.0 else text,
            zorder=3.0,
        )
        drawn |= {text} if lengths[arc.member] > 0.0 else set()


def _words(members: Sequence[Mapping[str, Any]], index: int) -> str:
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


def _box(chart: CommonChart) -> Window:
    walls = [outline for outlines in chart.outlines.values() for outline in outlines]
    if isnan(chart.stiffness_max) or not walls:
        return (0.0, 1.0, 0.0, 1.0)
    K, B = np.maximum(np.vstack(walls).max(axis=0), 0.0)
    reach = np.vstack(chart.regions).max(axis=0)
    # a member that allows many times more would press the robust set into a corner
    K1, B1 = min(K, 2.5 * reach[0]), min(B, 2.5 * reach[1])
    return -0.04 * float(K1), 1.05 * float(K1), -0.05 * float(B1), 1.05 * float(B1)
