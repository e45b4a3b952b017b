"""A robust chart: the walls stable for every member, and which member sets each part of the limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Polygon

from zwidth.chart.robust import RobustChart
from zwidth.show.figures.stability import Window, frame
from zwidth.show.figures.style import GREY, LINES, STABLE, legend_above

NAMED: Final = len(LINES) - 1  # binding members with a line of their own; the last line is for the rest
DRAWN: Final = 200  # members' outlines at most
LIGHT: Final = "#B8B8B8"
LONGEST: Final = 62  # signs in a line of the legend


def draw_robust(
    ax: Axes, chart: RobustChart, members: Sequence[Mapping[str, Any]] = (), window: Window | None = None
) -> None:
    """The robust set filled, its edge by binding member, and all members' outlines behind it, the best one's dashed.

    members  path -> value of each, for the legend
    window   what to show; left out: the box of all outlines' part with K >= 0 and B >= 0, and 5 %
    """
    outlines = [outline for index in list(chart.outlines)[:DRAWN] for outline in chart.outlines[index]]
    ax.add_collection(LineCollection(outlines, colors=LIGHT, linewidths=0.4, zorder=1.2, label="a member's edge"))
    for n, ring in enumerate(chart.regions):
        text = "" if n else "stable for every member"
        ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none", label=text, zorder=1.1))
    for n, outline in enumerate(chart.outlines[chart.best_by_area]):
        text = "" if n else f"best member by area: {_words(members, chart.best_by_area)}"
        ax.plot(*outline.T, color=GREY, linewidth=1.1, linestyle=(0, (3, 2)), label=text, zorder=1.4)
    _draw_edge(ax, chart, members)
    frame(ax, window or _box(chart), empty=not chart.regions)
    legend_above(ax)


def _draw_edge(ax: Axes, chart: RobustChart, members: Sequence[Mapping[str, Any]]) -> None:
    lengths: dict[int, int] = {}
    for arc in chart.boundary:
        lengths[arc.member] = lengths.get(arc.member, 0) + len(arc.stiffness)
    ranked = sorted(lengths, key=lambda member: -lengths[member])
    own = ranked[: NAMED + (len(ranked) == NAMED + 1)]
    for n, member in enumerate(ranked):
        named = member in own
        colour, dashes = LINES[min(n, NAMED)]
        text = f"bind elsewhere: {len(ranked) - NAMED} more members"
        text = f"binds: {_words(members, member)}" if named else text
        if not named and n > NAMED:
            text = ""
        for k, arc in enumerate(arc for arc in chart.boundary if arc.member == member):
            ax.plot(
                arc.stiffness,
                arc.damping,
                color=colour,
                linestyle=dashes,
                linewidth=2.0,
                label="" if k else text,
                zorder=3.0,
            )


def _words(members: Sequence[Mapping[str, Any]], index: int) -> str:
    """A member's values in words: the last step of each path is enough where it is clear."""
    if index >= len(members) or not members[index]:
        return f"member {index}"
    values = members[index]
    last = [path.rsplit(".", 1)[-1] for path in values]
    names = [name if last.count(name) == 1 else path for name, path in zip(last, values, strict=True)]
    pairs = zip(names, values.values(), strict=True)
    text = ", ".join(f"{name} = {v}" if isinstance(v, str) else f"{name} = {v:.4g}" for name, v in pairs)
    return text if len(text) <= LONGEST else f"member {index}: {text[: LONGEST - 15]}…"


def _box(chart: RobustChart) -> Window:
    walls = [outline for outlines in chart.outlines.values() for outline in outlines]
    if isnan(chart.stiffness_max) or not walls:
        return (0.0, 1.0, 0.0, 1.0)
    K, B = np.maximum(np.vstack(walls).max(axis=0), 0.0)
    reach = np.vstack(chart.regions).max(axis=0)
    # a member that allows many times more would press the robust set into a corner
    K1, B1 = min(K, 2.5 * reach[0]), min(B, 2.5 * reach[1])
    return -0.05 * float(K1), 1.05 * float(K1), -0.05 * float(B1), 1.05 * float(B1)
