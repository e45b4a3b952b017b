"""Parallel coordinates: each design a line through its numbers (Inselberg 1985, read second-hand)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.ticker import LogLocator, MaxNLocator
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.measures.definition import OK
from zwidth.show.figures.colour_bands import COLOURS, WIDE
from zwidth.show.figures.style import BLACK, VERMILION
from zwidth.show.units import MINUS, exponent_of, printed, scaled

if TYPE_CHECKING:
    import xarray as xr


DARKEST: Final = 0.9  # of the colours' scale: its light end looks like paper
AXIS_LETTERS: Final = 17
INCOMPLETE_COLOUR: Final = "#A8A8A8"
THIN_LINES_FROM: Final = 150  # designs from which on lines are drawn thinner


@dataclass(frozen=True)
class ParallelAxis:
    """One upright of the figure.

    name     its label, in lines
    heights  (designs,) where each crosses it, 0 to 1; nan where it has no value
    ticks    height -> text
    """

    name: str
    heights: Floats
    ticks: dict[float, str]


def draw_parallel(ax: Axes, dataset: xr.Dataset, keys: Sequence[str], names: Sequence[str]) -> None:
    """All designs of a study, coloured by its first column; those without a value end where it is missing.

    keys   its axes, drawn first
    names  its columns
    """
    dims = dataset[names[0]].dims
    each = [
        np.asarray(dataset[key].broadcast_like(dataset[names[0]]).transpose(*dims).values).ravel() for key in keys
    ]
    uprights = [_parallel_axis(dataset[key], values) for key, values in zip(keys, each, strict=True)]
    for name in names:
        values = np.asarray(dataset[name].values, dtype=float).ravel()
        status = dataset[f"{name}_status"].values.ravel()
        uprights.append(_parallel_axis(dataset[name], np.where(status == OK, values, np.nan)))
    heights = np.stack([one.heights for one in uprights], axis=1)
    _draw_lines(ax, heights, heights[:, len(keys)])
    _draw_uprights(ax, uprights, len(keys))
    text = (
        f"colour: {str(dataset[names[0]].attrs['title'])[:1].lower()}{str(dataset[names[0]].attrs['title'])[1:]}"
    )
    ax.text(len(uprights) - 1, -0.035, text, ha="right", va="center", fontsize=7.0)
    ax.set_xlim(-0.25, len(uprights) - 0.55)
    ax.set_ylim(-0.06, 1.03)
    ax.axis("off")


def _draw_lines(ax: Axes, heights: Floats, shade: Floats) -> None:
    thin = 0.5 if len(heights) > THIN_LINES_FROM else 0.9
    complete = np.array([bool(np.isfinite(line).all()) for line in heights])
    order = np.argsort(np.where(np.isfinite(shade), shade, -1.0))
    across = np.arange(heights.shape[1])
    lines = [np.column_stack([across, heights[n]]) for n in order if complete[n]]
    colours = mpl.colormaps[COLOURS](DARKEST * shade[[n for n in order if complete[n]]])
    ax.add_collection(
        LineCollection(lines, colors=list(map(tuple, colours)), linewidths=thin, alpha=0.75, zorder=2.0)
    )
    incomplete = np.flatnonzero(~complete)
    parts = [part for n in incomplete for part in _pieces(across, heights[n])]
    if len(incomplete):
        # they end in a cross where the first number is missing
        drawn = LineCollection(
            parts, colors=INCOMPLETE_COLOUR, linewidths=0.4, linestyles=[(0, (4, 2))], zorder=1.5
        )
        ax.add_collection(drawn)
        ends = [int(np.flatnonzero(~np.isfinite(heights[n]))[0]) for n in incomplete]
        for place in sorted(set(ends)):
            ax.plot(place, -0.035, "x", color=VERMILION, markersize=5.0, clip_on=False, zorder=4.0)
            ax.annotate(
                f"{ends.count(place)} without",
                (place, -0.035),
                xytext=(5, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.0,
                color=VERMILION,
            )
        stubs = [
            np.array([[end - 1, heights[n, end - 1]], [end, -0.035]])
            for n, end in zip(incomplete, ends, strict=True)
            if end
        ]
        ax.add_collection(
            LineCollection(stubs, colors=INCOMPLETE_COLOUR, linewidths=0.4, linestyles=[(0, (4, 2))])
        )


def _pieces(across: Any, heights: Floats) -> list[Floats]:
    """The parts of a line between missing numbers."""
    there = np.isfinite(heights)
    cuts = np.flatnonzero(np.diff(there.astype(int))) + 1
    pieces = np.split(np.column_stack([across, heights]), cuts)
    return [part for part in pieces if len(part) > 1 and np.isfinite(part).all()]


def _draw_uprights(ax: Axes, uprights: Sequence[ParallelAxis], keys: int) -> None:
    for n, one in enumerate(uprights):
        measured = n >= keys
        ax.plot([n, n], [0.0, 1.0], color=BLACK, linewidth=1.4 if measured else 0.8, zorder=3.0)
        for height, text in one.ticks.items():
            ax.plot([n - 0.025, n], [height, height], color=BLACK, linewidth=0.8, zorder=3.0)
            ax.annotate(
                text,
                (n, height),
                xytext=(-5, 0),
                textcoords="offset points",
                ha="right",
                va="center",
                fontsize=7.0,
                zorder=3.5,
                bbox={"boxstyle": "square,pad=0.08", "facecolor": "white", "edgecolor": "none", "alpha": 0.75},
            )
        weight = "bold" if measured else "normal"
        ax.text(n, 1.045, one.name, ha="center", va="bottom", fontsize=7.5, fontweight=weight)


def _parallel_axis(column: Any, values: NDArray[Any]) -> ParallelAxis:
    name = str(column.attrs.get("title") or column.attrs.get("long_name") or column.name)
    unit = printed(str(column.attrs.get("unit", column.attrs.get("units", ""))))
    if values.dtype.kind not in "ifu":
        kinds = list(dict.fromkeys(map(str, values)))
        at = {kind: (n + 0.5) / len(kinds) for n, kind in enumerate(kinds)}
        return ParallelAxis(
            _lines(name), np.array([at[str(value)] for value in values]), {at[kind]: kind for kind in kinds}
        )
    x = np.where(np.isfinite(values), values, np.nan).astype(float)
    finite = x[np.isfinite(x)]
    if not len(finite):
        return ParallelAxis(_lines(_with_unit(name, unit)), x, {})
    low, high = float(finite.min()), float(finite.max())
    if low == high:
        return ParallelAxis(
            _lines(_with_unit(name, unit)), np.where(np.isfinite(x), 0.5, np.nan), {0.5: f"{low:.4g}"}
        )
    measured = "title" in column.attrs
    logarithmic = low > 0.0 and (high / low > WIDE**2 if measured else column.attrs.get("scale") == "log")
    exponent = exponent_of(max(abs(low), abs(high))) if measured and unit else 0
    if scaled(exponent, unit).startswith("10") and 0.01 <= max(abs(low), abs(high)) < 1e4:
        exponent = 0
    locator: Any = LogLocator(subs=(1.0, 2.0, 5.0)) if logarithmic else MaxNLocator(8, steps=[1, 2, 5, 10])
    levels = [v for v in locator.tick_values(low, high) if low <= v <= high]
    scale = np.log if logarithmic else np.asarray
    ends = scale(low), scale(high)
    places = (scale(x) - ends[0]) / (ends[1] - ends[0])
    ticks = {
        float((scale(v) - ends[0]) / (ends[1] - ends[0])): f"{v / 10.0**exponent:.4g}".replace("-", MINUS)
        for v in levels
    }
    return ParallelAxis(_lines(_with_unit(name, scaled(exponent, unit) if unit else "")), places, ticks)


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _lines(name: str) -> str:
    """A label in lines that fit between uprights; a path breaks at its dots."""
    words = (
        name.replace(".", ".\u200b").replace(" [", "\u200b [").split("\u200b") if "." in name else name.split(" ")
    )
    blank = "" if "." in name else " "
    lines = [""]
    for word in words:
        joined = lines[-1] + blank + word if lines[-1] else word
        if len(joined) <= AXIS_LETTERS or not lines[-1]:
            lines[-1] = joined
        else:
            lines.append(word.strip())
    return "\n".join(lines)
