"""Published conditions over the exact chart, each line with the number under which the legend names it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import count
from textwrap import wrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart
from zwidth.conditions import Bound
from zwidth.show.figures.stability import frame
from zwidth.show.figures.style import BLACK, LINES, STABLE, fitted_columns
from zwidth.show.units import quantity

DAMPINGS: Final = 1001  # at which each line is computed
ALIKE: Final = 0.02  # share of the view by which two lines differ that are drawn as one
FAR: Final = 0.12  # share of the view from which on a number is clear of other lines and numbers
EDGE: Final = 0.03  # share of the view along its border that is kept free of numbers
STEPS: Final = 60  # places along a line that are tried for its number
BESIDE: Final = (0.22, 0.06)  # where the numbers of small lines stand, as shares of the view
SMALL: Final = 0.1  # share of the view below which a line's number stands beside it
TEXT_SIZE: Final = 7.0  # points
OUTSIDE: Final = 9.0  # view widths away: a place that keeps no number from anywhere
LETTERS: Final = 44  # of a line of the legend
# Authors and year, or an equation of the thesis; what a source tells beyond stands in the table.
SHORT_SOURCE: Final = re.compile(r".*?(\b\d{4}\b|eq\. [\d.]+(-[\d.]+)?( and [\d.]+)?)")
NOT_MET: Final = "assumptions not met:"


@dataclass(frozen=True, eq=False)
class BoundLine:
    """The line of one condition, or of several that nearly coincide.

    stiffness  (DAMPINGS,) [N/m]; nan where the condition admits no wall
    bounds     number in the legend -> condition
    """

    stiffness: Floats
    bounds: dict[int, Bound]

    @property
    def text(self) -> str:
        """The numbers, as they stand on the line."""
        return ", ".join(map(str, self.bounds))


def draw_bounds(ax: Axes, bounds: Iterable[Bound], chart: StabilityChart | None) -> None:
    """The stable walls with K, B >= 0, and the line of each condition that has one, numbered.

    Each line has its colour and dashes, and the legend the authors of each condition. Conditions whose assumptions
    are met are thick, that with the smallest limit named as the one that binds; the others are thin, and listed
    apart. Conditions that nearly coincide share a line, which has all their numbers. What has no line in view is
    listed without a number. The view is that of the exact chart.

    chart  None: only the conditions, over the dampings at which they admit stiffness
    """
    known = [bound for bound in bounds if not bound.lacking]
    top = _largest_in_view(known, chart)
    dampings = np.linspace(0.0, top[1], DAMPINGS)
    numbers = count(1)
    met = _lines_in_view([bound for bound in known if bound.holds], dampings, top[0], numbers)
    not_met = _lines_in_view([bound for bound in known if not bound.holds], dampings, top[0], numbers)
    stable: list[Any] = []
    if chart is not None:
        text = "stable, exact" if chart.regions else "stable, exact: no wall"
        stable += [Patch(facecolor=STABLE, edgecolor=BLACK, linewidth=0.8, label=text)]
        for ring in chart.regions:
            ax.add_patch(Polygon(ring, facecolor=STABLE, edgecolor="none"))
        for arc in chart.boundary:
            ax.plot(arc.stiffness, arc.damping, color=BLACK, linewidth=0.8)
    looks = [_line_look(n, met=n < len(met)) for n in range(len(met) + len(not_met))]
    for line, look in zip((*met, *not_met), looks, strict=True):
        ax.plot(line.stiffness, dampings, zorder=2.5 if line in met else 1.5, **look)
    _number_lines(ax, [*met, *not_met], looks, dampings, top)
    entries_met = stable + _legend_entries(known, met, looks[: len(met)], met=True)
    entries_not_met = _legend_entries(known, not_met, looks[len(met) :], met=False)
    if len(entries_met) > len(stable):  # a column each
        rows = max(len(entries_met), len(entries_not_met))
        entries = [*_padded(entries_met, rows), *_padded(entries_not_met, rows)]
    else:
        entries = [*entries_met, *entries_not_met]
    frame(ax, (0.0, top[0], 0.0, top[1]), empty=False)
    legend = ax.legend(
        handles=entries,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.01),
        ncols=fitted_columns(ax, [str(one.get_label()) for one in entries], 2, TEXT_SIZE),
        borderaxespad=0.0,
        handlelength=2.2,
        columnspacing=1.0,
        labelspacing=0.35,
        fontsize=TEXT_SIZE,
        frameon=False,
        alignment="left",
    )
    legend.set_zorder(6.0)


def _line_look(n: int, *, met: bool) -> dict[str, Any]:
    """Colour, dashes and width of the n-th line; beyond the number of colours each has the next one's dashes."""
    coloured = LINES[1:]
    turns, place = divmod(n, len(coloured))
    dashes = coloured[(place + turns) % len(coloured)][1]
    return {"color": coloured[place][0], "linestyle": dashes, "linewidth": 1.8 if met else 1.0}


def _lines_in_view(bounds: Sequence[Bound], dampings: Floats, widest: float, numbers: Any) -> list[BoundLine]:
    """The lines in view, each with the conditions that it is of; a condition without a line in view is left out.

    widest   largest stiffness of the view [N/m];   numbers  iterator of the legend's numbers, one a condition
    """
    lines: list[BoundLine] = []
    for bound in bounds:
        stiffness = bound.stiffness_max_at(dampings)
        # cut just beyond the view's border; a line that stays within 0.5 % of that border or beyond has no place
        stiffness = np.where(stiffness > 0.0, np.minimum(stiffness, 1.01 * widest), np.nan)
        if not np.any(stiffness < 1.005 * widest):
            continue
        line = next((one for one in lines if _alike(stiffness, one.stiffness, widest)), None)
        if line is None:
            lines.append(line := BoundLine(stiffness, {}))
        line.bounds[next(numbers)] = bound
    return lines


def _alike(one: Floats, other: Floats, scale: float) -> bool:
    """Whether two lines of stiffness [N/m] all but lie over each other in a view as wide as `scale` [N/m]."""
    both = np.isfinite(one) == np.isfinite(other)
    return bool(np.all(both) and np.nanmax(np.abs(one - other), initial=0.0) < ALIKE * scale)


def _legend_entries(
    known: Sequence[Bound], lines: Sequence[BoundLine], looks: Sequence[dict[str, Any]], *, met: bool
) -> list[Any]:
    """The legend's entries for conditions whose assumptions are met, or are not; those without a line last.

    known  all conditions, met and not met;   lines, looks  those of the conditions that are wanted
    """
    drawn = [(n, bound, look) for line, look in zip(lines, looks, strict=True) for n, bound in line.bounds.items()]
    limits = [bound.stiffness_max for _, bound, _ in drawn if met and bound.stiffness_max > 0.0]
    lowest = min(limits, default=0.0) * (1.0 + 1e-6)  # several conditions may be the strictest
    entries: list[Any] = []
    if not met and any(not bound.holds for bound in known):
        entries.append(_text_entry(NOT_MET))
    for n, bound, look in sorted(drawn, key=lambda one: one[0]):
        strictest = met and 0.0 < bound.stiffness_max <= lowest
        limit = f", at most {quantity(bound.stiffness_max, 'N/m')}: strictest" if strictest else ""
        text = "\n".join(wrap(f"{n}\u00a0 {_condition_text(bound)}{limit}", LETTERS, break_long_words=False))
        entries.append(Line2D([], [], label=text, **look))
    drawn_bounds = [bound for _, bound, _ in drawn]
    unseen = (bound for bound in known if bound.holds == met and bound not in drawn_bounds)
    texts = (f"{_condition_text(bound)}: no line in view" for bound in unseen)
    return entries + [_text_entry("\n".join(wrap(text, LETTERS))) for text in texts]


def _condition_text(bound: Bound) -> str:
    """A condition with its authors and year, or the equation that it has in the thesis."""
    short = SHORT_SOURCE.match(bound.source)
    return f"{bound.name}, {short[0] if short else bound.source}"


def _padded(entries: list[Any], rows: int) -> list[Any]:
    """The entries, with empty ones after them up to so many rows."""
    return entries + [_text_entry("") for _ in range(rows - len(entries))]


def _text_entry(text: str) -> Line2D:
    """A legend's entry of text alone."""
    return Line2D([], [], linestyle="none", label=text)


def _number_lines(
    ax: Axes,
    lines: Sequence[BoundLine],
    looks: Sequence[dict[str, Any]],
    dampings: Floats,
    top: tuple[float, float],
) -> None:
    """Write each line's numbers on it, where it is farthest from the other lines and their numbers.

    Lines that are too small for that have one text at BESIDE, with a stroke to the largest stiffness of them.

    dampings  (DAMPINGS,) of every line [N s/m];   top  largest stiffness and damping of the view [N/m], [N s/m]
    """
    across = [np.column_stack([line.stiffness / top[0], dampings / top[1]]) for line in lines]
    small = [k for k, xy in enumerate(across) if np.nanmax(xy[np.isfinite(xy).all(axis=1)]) < SMALL]
    placed: list[Floats] = []
    if small:
        text = ", ".join(lines[k].text for k in small)
        tip = np.nanmax(np.vstack([across[k] for k in small])[:, 0]), 0.0
        placed.append(np.array([[BESIDE[0], BESIDE[1]]]))
        _write_number(ax, text, BESIDE, top, BLACK, tip)
    for k, line in enumerate(lines):
        if k in small:
            continue
        inside = across[k][np.all((across[k] > EDGE) & (across[k] < 1.0 - EDGE), axis=1)]
        places = (inside if len(inside) else across[k][np.isfinite(across[k]).all(axis=1)])[::-1]
        places = places[np.linspace(0, len(places) - 1, min(STEPS, len(places))).astype(int)]
        others = [other[np.isfinite(other).all(axis=1)] for n, other in enumerate(across) if n != k]
        # of the places tried, the distance from other lines; OUTSIDE: there may be none
        clear = np.minimum(_nearest_distances(places, np.vstack([*others, np.full((1, 2), OUTSIDE)])), FAR)
        # numbers, which are wider than lines, count twice
        clear += 2.0 * np.minimum(_nearest_distances(places, np.vstack([*placed, np.full((1, 2), OUTSIDE)])), FAR)
        x, y = places[int(np.argmax(clear))]
        placed.append(np.array([[x, y]]))
        _write_number(ax, line.text, (x, y), top, looks[k]["color"])


def _write_number(
    ax: Axes,
    text: str,
    place: tuple[float, float],
    top: tuple[float, float],
    colour: str,
    tip: tuple[float, float] | None = None,
) -> None:
    """Write a number at a place; with a tip, a stroke leads from there to what it names.

    place, tip  (K, B) as shares of the view;   top  largest stiffness and damping of the view [N/m], [N s/m]
    """
    end = place if tip is None else tip
    ax.annotate(
        text,
        xy=(end[0] * top[0], end[1] * top[1]),
        xytext=(place[0] * top[0], place[1] * top[1]),
        color=colour,
        fontsize=TEXT_SIZE,
        fontweight="bold",
        ha="center",
        va="center",
        zorder=4.0,
        bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        arrowprops=None if tip is None else {"arrowstyle": "-", "color": colour, "linewidth": 0.6},
    )


def _nearest_distances(points: Floats, others: Floats) -> Floats:
    """Distance (n,) of each point (n, 2) from the nearest of others (k, 2)."""
    return np.asarray(np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1))


def _largest_in_view(bounds: Sequence[Bound], chart: StabilityChart | None) -> tuple[float, float]:
    """Return the largest stiffness [N/m] and damping [N s/m] of the view.

    They are 20 % beyond the exact chart; without one, beyond the largest stiffness that the conditions admit, and
    three times the damping at which one admits its largest.
    """
    if chart is not None and chart.stiffness_max > 0.0:
        return 1.2 * chart.stiffness_max, 1.2 * max(chart.damping_max, chart.damping_at_stiffness_max)
    largest = [bound.stiffness_max for bound in bounds if bound.stiffness_max > 0.0]
    damping = [bound.damping_at_stiffness_max for bound in bounds if bound.damping_at_stiffness_max > 0.0]
    return 1.2 * max(largest, default=1.0), 3.0 * max(damping, default=1.0)
