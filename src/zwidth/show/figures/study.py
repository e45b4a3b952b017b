"""Many designs of one device: curves, heat maps, parallel coordinates (Inselberg 1985, read second-hand)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import AutoLocator, LogLocator, MaxNLocator
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.measures.definition import (
    BEYOND_LIMIT,
    FAILED,
    NO_EQUILIBRIUM,
    NO_VALUE,
    OK,
    OUT_OF_REACH,
    OUT_OF_TIME,
    SINGULAR,
    STATUS,
    UNDECIDED,
)
from zwidth.show.figures import style
from zwidth.show.figures.map import hatch_cells, status_patch
from zwidth.show.units import MINUS, exponent_of, quantity, scaled, spoken_unit

if TYPE_CHECKING:
    import xarray as xr


SYMBOLS: Final = {
    OUT_OF_REACH: "x",
    SINGULAR: "+",
    BEYOND_LIMIT: "_",
    NO_EQUILIBRIUM: "s",
    NO_VALUE: "o",
    UNDECIDED: "d",
    FAILED: "v",
    OUT_OF_TIME: "^",
}
SAME: Final = 1e-9  # share by which the values of a constant column differ
MOST_PANELS: Final = 12
POINTS: Final = ("o", "s", "^", "D", "v", "P")
BESIDE: Final = 0.02  # share of an axis beside its first and last value
MARKED: Final = 40  # points up to which each is marked
MARK_HEIGHT: Final = 0.045  # of the height of a panel, for each line that has gaps
MOST_TICKS: Final = 6  # of an axis: numbers such as 0.0005 are long
LETTERS: Final = 34  # of a label along the height of a panel


def study_figure(dataset: xr.Dataset) -> Figure:
    """A study's figure, chosen by the axes it has.

    One axis, or one and a few texts such as assemblies: curves over it, a panel for each column. Two axes of
    numbers: heat maps. All else, and what a Latin hypercube has found: parallel coordinates.

    dataset  as `study.designs.sweep.sweep_dataset` makes it
    """
    names = [str(name) for name in dataset.data_vars if f"{name}_status" in dataset]
    numeric, texts = _split_axes(dataset, names)
    for key in numeric:  # values may be listed in any order
        dataset = dataset.sortby(key)
    lines = int(np.prod([dataset.sizes[key] for key in texts]))
    if _few_lines(dataset, names[0], numeric, texts):
        return _curves_figure(dataset, names, numeric[0] if numeric else texts[0])
    if dataset[names[0]].dims == ("design",):
        return _parallel_figure(dataset, names)
    if len(numeric) == 2 and lines * len(names) <= MOST_PANELS and min(dataset.sizes[k] for k in numeric) > 1:
        return _heat_figure(dataset, names, numeric, texts)
    return _parallel_figure(dataset, names)


def draw_first_column(ax: Axes, dataset: xr.Dataset) -> None:
    """The first column of a study in one panel: curves, a heat map or parallel coordinates, as `study_figure`."""
    name = next(str(name) for name in dataset.data_vars if f"{name}_status" in dataset)
    numeric, texts = _split_axes(dataset, [name])
    for key in numeric:
        dataset = dataset.sortby(key)
    if _few_lines(dataset, name, numeric, texts):
        along = (numeric or texts)[0]
        others = [key for key in (*numeric, *texts) if key != along]
        lost = draw_curves(ax, dataset, name, along)
        handles = list(_line_handles(dataset, others, lines=bool(numeric)))
        _legend_above(ax, handles, [_symbol_handle(status) for status in lost])
    elif len(numeric) == 2 and not texts and min(dataset.sizes[key] for key in numeric) > 1:
        hatched = draw_heat_map(ax, dataset, name, numeric[0], numeric[1])
        _legend_above(ax, [], [status_patch(status) for status in hatched])
    else:
        dims = [str(dim) for dim in dataset[name].dims]
        draw_parallel(ax, dataset, dims if dims != ["design"] else _listed_axes(dataset), [name])


def _few_lines(dataset: xr.Dataset, name: str, numeric: Sequence[str], texts: Sequence[str]) -> bool:
    """Whether a study has one axis to draw along, and few enough values of the others for a line each."""
    if dataset[name].dims == ("design",) or len(numeric) > 1:
        return False
    lines = int(np.prod([dataset.sizes[key] for key in texts]))
    return (lines if numeric else lines / dataset.sizes[texts[0]]) <= len(style.LINES)


def _split_axes(dataset: xr.Dataset, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the keys of the axes of numbers, and of those of texts or of a single value, of columns `names`."""
    axes = [str(dim) for dim in dataset[names[0]].dims]
    numeric = [key for key in axes if dataset[key].dtype.kind in "if"] if axes != ["design"] else []
    # one of a single value cannot be drawn as an axis; it is stated beside the texts
    numeric = [key for key in numeric if dataset.sizes[key] > 1] or numeric[:1]
    return numeric, [key for key in axes if key not in numeric]


# --- curves -----------------------------------------------------------------------------------------


def _curves_figure(dataset: xr.Dataset, names: Sequence[str], along: str) -> Figure:
    """A panel for each column over the axis `along`, one legend of lines and missing values above all."""
    others = [str(dim) for dim in dataset[names[0]].dims if dim != along]
    lines = 1 if not others else int(np.prod([dataset.sizes[key] for key in others]))
    drawing, panels = _panels(5.8, 0.9 + 0.17 * lines + 2.1 * len(names), len(names), 1, len(names))
    statuses: dict[int, None] = {}
    for panel in panels[:-1]:  # before anything is drawn: what is logarithmic is so for all of them
        panel.sharex(panels[-1])
    for panel, name in zip(panels, names, strict=True):
        statuses |= dict.fromkeys(draw_curves(panel, dataset, name, along))
    for panel in panels[:-1]:
        panel.tick_params(which="both", labelbottom=False)
        panel.set_xlabel("")
    numeric = dataset[along].dtype.kind in "if"
    handles = list(_line_handles(dataset, others, lines=numeric))
    _legend_above(panels[0], handles, [_symbol_handle(status) for status in sorted(statuses)])
    return drawing


def _panels(width: float, height: float, rows: int, columns: int, count: int) -> tuple[Figure, list[Axes]]:
    """A figure of this size [inches], and `count` axes in its grid of rows and columns, row after row."""
    drawing, ax = style.figure(width, height)
    grid = drawing.add_gridspec(rows, columns)
    ax.set_subplotspec(grid[0])
    with style.context():
        return drawing, [ax, *(drawing.add_subplot(grid[n]) for n in range(1, count))]


def draw_curves(ax: Axes, dataset: xr.Dataset, name: str, along: str) -> list[int]:
    """One column over one axis, a line for each combination of the others; gaps where there is no value.

    Returns  the statuses that are marked at the foot of the axes, where designs have no value
    """
    column, status = dataset[name], dataset[f"{name}_status"]
    others = [str(dim) for dim in column.dims if dim != along]
    numeric = dataset[along].dtype.kind in "if"
    x = dataset[along].values if numeric else np.arange(dataset.sizes[along])
    missing: list[tuple[str, NDArray[np.uint8]]] = []
    for n, chosen in enumerate(_combinations(dataset, others)):
        y = np.asarray(column.sel(chosen).transpose(along).values, dtype=float)
        line_style = _line_style(n) if numeric else _marker_style(n)
        if numeric and len(x) <= MARKED:
            line_style |= {"marker": "o", "markersize": 3.2}
        ax.plot(x, np.where(np.isfinite(y), y, np.nan), zorder=2.0 + 0.01 * n, **line_style)
        statuses = status.sel(chosen).transpose(along).values
        if np.isin(statuses, list(SYMBOLS)).any():
            missing.append((line_style["color"], statuses))
    _draw_missing(ax, x, missing)
    if not np.isfinite(column.values).any():
        ax.set_yticks([])
    elif constant := constant_text(column, np.asarray(column.values, dtype=float)):
        ax.set_yticks([])
        text = constant.splitlines()[-1]
        ax.annotate(
            text,
            (0.5, 0.5),
            (0, 5),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="center",
            va="bottom",
        )
    _name_column(ax, column)
    _name_axis(ax, "x", dataset[along])
    ax.margins(x=BESIDE)
    return [kind for kind in SYMBOLS if any((statuses == kind).any() for _, statuses in missing)]


class TicksAbove(AutoLocator):
    """Ticks from a value upwards: what stands below it is no number."""

    def __init__(self, low: float) -> None:
        super().__init__()
        self.low = low

    def tick_values(self, vmin: float, vmax: float) -> Any:
        return [value for value in super().tick_values(vmin, vmax) if value >= self.low]


def _draw_missing(ax: Axes, x: NDArray[Any], missing: Sequence[tuple[str, NDArray[np.uint8]]]) -> None:
    """Draw a row of symbols below all lines for each line that has gaps, at the x (k,) of its gaps.

    missing  colour of each such line, and its status (k,)
    """
    if not missing:
        return
    low, high = ax.get_ylim()
    foot = MARK_HEIGHT * (len(missing) + 0.5)  # share of the panel's new height that the rows take
    ax.set_ylim(low - (high - low) * foot / (1.0 - foot), high)
    ax.yaxis.set_major_locator(TicksAbove(low))
    ax.axhline(low, color=style.GREY, linewidth=0.5)
    for row, (colour, status) in enumerate(missing):
        for kind, symbol in SYMBOLS.items():
            ax.plot(
                x[status == kind],
                np.full(int((status == kind).sum()), MARK_HEIGHT * (row + 0.75)),
                symbol,
                color=colour,
                markersize=4.0,
                markerfacecolor="none",
                markeredgewidth=0.9,
                transform=ax.get_xaxis_transform(),
                zorder=3.0,
            )


def _name_column(ax: Axes, column: Any) -> None:
    """Name the upright axis by a column, in its unit if it has one."""
    title = "\n".join(wrap(str(column.attrs["title"]), LETTERS - 6, break_long_words=False))
    unit = spoken_unit(str(column.attrs.get("unit", "")))
    if unit:
        style.label(ax.yaxis, title, unit)
    else:
        ax.set_ylabel(title)


def _name_axis(ax: Axes, which: str, coordinate: Any) -> None:
    """Label the axis `which`, "x" or "y", with key and unit of a coordinate (a DataArray), and set its ticks and
    its scale: logarithmic where the coordinate is said to be; of texts, a tick for each."""
    axis = ax.xaxis if which == "x" else ax.yaxis
    key = str(coordinate.attrs.get("long_name", coordinate.name))
    if coordinate.dtype.kind not in "if":
        places = list(range(len(coordinate)))
        axis.set_ticks(places, [str(value) for value in coordinate.values])
        axis.set_label_text(key)
        return
    if coordinate.attrs.get("scale") == "log":
        (ax.set_xscale if which == "x" else ax.set_yscale)("log")
        unit = str(coordinate.attrs.get("units", ""))
        axis.set_label_text(f"{key} [{spoken_unit(unit)}]" if unit else key)
        values = np.asarray(coordinate.values, dtype=float)
        style.number_logarithmic(axis, float(values.min()), float(values.max()))
    elif unit := spoken_unit(str(coordinate.attrs.get("units", ""))):
        style.label(axis, key, unit, plain=True)
        axis.set_major_locator(MaxNLocator(nbins=MOST_TICKS, steps=[1, 2, 2.5, 5, 10]))
    else:
        axis.set_label_text(key)


def _combinations(dataset: xr.Dataset, keys: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Every combination of the values of these axes, key -> value."""
    for values in product(*(dataset[key].values for key in keys)):
        yield dict(zip(keys, values, strict=True))


def _line_handles(dataset: xr.Dataset, keys: Sequence[str], *, lines: bool) -> Iterator[Line2D]:
    """The legend's entries of combinations of these axes, which are drawn as lines, or else as points."""
    for n, chosen in enumerate(_combinations(dataset, keys) if keys else ()):
        yield Line2D([], [], label=_combination_text(chosen), **(_line_style(n) if lines else _marker_style(n)))


def _line_style(n: int) -> dict[str, Any]:
    """Colour and dashes of the n-th line."""
    colour, dashes = style.LINES[n % len(style.LINES)]
    return {"color": colour, "linestyle": dashes}


def _marker_style(n: int) -> dict[str, Any]:
    """Marks of the n-th combination over an axis of texts: open ones, ever larger, so that none hides another."""
    colour, _ = style.LINES[n % len(style.LINES)]
    filled = {} if n == 0 else {"markerfacecolor": "none"}
    return {"color": colour, "linestyle": "none", "marker": POINTS[n], "markersize": 4.0 + 2.0 * n, **filled}


def _combination_text(chosen: dict[str, Any]) -> str:
    """A combination of values in words, for a legend or a title."""
    return ", ".join(
        f"{key} {value}" if isinstance(value, str) else f"{key} {value:.4g}" for key, value in chosen.items()
    )


def _symbol_handle(status: int) -> Line2D:
    """The legend's entry of the symbol of designs with this status."""
    line_style: dict[str, Any] = {
        "linestyle": "none",
        "markerfacecolor": "none",
        "markersize": 4.5,
        "color": style.BLACK,
    }
    return Line2D([], [], marker=SYMBOLS[status], label=STATUS[status], **line_style)


def _legend_above(ax: Axes, lines: list[Any], marks: list[Any]) -> None:
    """The legend of these entries above the axes, in three columns where their texts are short."""
    handles = [*lines, *marks]
    if not handles:
        return
    legend = ax.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.02),
        ncols=3 if max(len(str(handle.get_label())) for handle in handles) < 24 else 1,
        borderaxespad=0.0,
        handlelength=2.6,
        columnspacing=1.6,
        fontsize=8.0,
        frameon=False,
        alignment="left",
    )
    legend.set_zorder(6.0)


# --- heat maps --------------------------------------------------------------------------------------


def _heat_figure(dataset: xr.Dataset, names: Sequence[str], axes: Sequence[str], texts: Sequence[str]) -> Figure:
    """A heat map over both `axes` for each column and combination of `texts`; those of a column share colours."""
    choices = list(_combinations(dataset, texts))
    # a row for each column, or of maps without texts two in a row
    wide = len(choices) if len(choices) > 1 else min(2, len(names))
    high = len(names) if len(choices) > 1 else -(-len(names) // wide)
    maps = [(name, chosen) for name in names for chosen in choices]
    drawing, panels = _panels(4.3 * wide + (0.9 if wide == 1 else 0.0), 3.1 * high + 0.5, high, wide, len(maps))
    statuses: dict[int, None] = {}
    for panel, (name, chosen) in zip(panels, maps, strict=True):
        values = np.asarray(dataset[name].values, dtype=float)
        statuses |= dict.fromkeys(draw_heat_map(panel, dataset.sel(chosen), name, axes[0], axes[1], values))
        if chosen:
            panel.set_title(_combination_text(chosen), loc="left")
    handles = [status_patch(status) for status in sorted(statuses)]
    if handles:
        drawing.legend(
            handles=handles, loc="outside upper left", ncols=4, fontsize=8.0, frameon=False, borderaxespad=0.4
        )
    return drawing


def draw_heat_map(
    ax: Axes, dataset: xr.Dataset, name: str, first: str, second: str, scale: Floats | None = None
) -> list[int]:
    """One column over two axes of numbers, a cell for each design; hatched where there is no value.

    first, second  keys of the axes across and up
    scale          values that the colours span; left out: those shown
    Returns        the statuses that are hatched
    """
    x, y = (_cell_edges(dataset[key]) for key in (first, second))
    column = dataset[name].transpose(second, first)
    values = np.asarray(column.values, dtype=float)
    status = dataset[f"{name}_status"].transpose(second, first).values
    scale = values if scale is None else scale
    if (constant := constant_text(column, scale)) and not np.isnan(values).all():
        ax.pcolormesh(x, y, np.ma.masked_where(np.isnan(values), 0.0 * values), cmap=PAPER, linewidth=0.0)
        ax.text(0.5, 0.5, constant, transform=ax.transAxes, ha="center", va="center", zorder=4.0)
    elif np.isfinite(scale).any():
        levels, norm, colours = style.bands_of(scale)
        cells = np.ma.masked_where(np.isnan(values), values)
        ax.pcolormesh(x, y, cells, norm=norm, cmap=colours, linewidth=0.0, rasterized=True)
        title, unit = str(column.attrs["title"]), spoken_unit(str(column.attrs.get("unit", "")))
        style.colour_bar(ax, levels, norm, colours, title, unit)
    marked = hatch_cells(ax, x, y, status)
    _name_axis(ax, "x", dataset[first])
    _name_axis(ax, "y", dataset[second])
    # the outer cells are halves: the axes say what was computed, and nothing beyond
    ax.set_xlim(float(dataset[first].min()), float(dataset[first].max()))
    ax.set_ylim(float(dataset[second].min()), float(dataset[second].max()))
    return marked


def constant_text(column: Any, values: Floats) -> str:
    """Title and value of a column whose `values` are the same in all designs, in words; "" where they are not."""
    finite = values[np.isfinite(values)]
    if not len(finite) or np.isinf(values).any() or np.ptp(finite) > SAME * float(np.abs(finite).max()):
        return ""
    title = "\n".join(wrap(str(column.attrs["title"]), LETTERS, break_long_words=False))
    return f"{title}\nconstant: {quantity(float(finite[0]), str(column.attrs.get('unit', '')))}"


PAPER: Final = ListedColormap(["#F2F2F2"])


def _cell_edges(coordinate: Any) -> Floats:
    """Ends (k + 1,) of cells, halfway between an axis's values (k,) and as far outside; by ratio on a log axis."""
    values = np.asarray(coordinate.values, dtype=float)
    logarithmic = coordinate.attrs.get("scale") == "log" and bool((values > 0.0).all())
    mid = np.log(values) if logarithmic else values
    inner = 0.5 * (mid[1:] + mid[:-1])
    edges = np.concatenate([[mid[0] - (inner[0] - mid[0])], inner, [mid[-1] + (mid[-1] - inner[-1])]])
    return np.asarray(np.exp(edges) if logarithmic else edges)


# --- parallel coordinates ---------------------------------------------------------------------------


def _parallel_figure(dataset: xr.Dataset, names: Sequence[str]) -> Figure:
    """A figure of parallel coordinates: an upright for each axis of the study, and for each column."""
    dims = [str(dim) for dim in dataset[names[0]].dims]
    keys = dims if dims != ["design"] else _listed_axes(dataset)
    drawing, ax = style.figure(max(5.6, 1.25 * (len(keys) + len(names)) + 0.8), 4.3)
    draw_parallel(ax, dataset, keys, names)
    return drawing


def _listed_axes(dataset: xr.Dataset) -> list[str]:
    """The axes of a study whose designs are listed, as of a Latin hypercube: coordinates with the role of one."""
    return [str(key) for key in dataset.coords if key != "design" and dataset[key].attrs.get("role") == "axis"]


DARKEST: Final = 0.9  # of the colours' scale: its light end looks like paper
AXIS_LETTERS: Final = 17
INCOMPLETE_COLOUR: Final = "#A8A8A8"
BELOW: Final = -0.035  # height of crosses and texts below the uprights, which go from 0 to 1
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
    ax.text(len(uprights) - 1, BELOW, text, ha="right", va="center", fontsize=7.0)
    ax.set_xlim(-0.25, len(uprights) - 0.55)
    ax.set_ylim(-0.06, 1.03)
    ax.axis("off")


def _draw_lines(ax: Axes, heights: Floats, shade: Floats) -> None:
    """Draw a line for each design; one without all numbers is grey, with a cross below the first missing one.

    heights  (designs, uprights) 0 to 1, nan where there is none;   shade  (designs,) the colour, 0 to 1
    """
    thin = 0.5 if len(heights) > THIN_LINES_FROM else 0.9
    complete = np.array([bool(np.isfinite(line).all()) for line in heights])
    order = np.argsort(np.where(np.isfinite(shade), shade, -1.0))
    across = np.arange(heights.shape[1])
    lines = [np.column_stack([across, heights[n]]) for n in order if complete[n]]
    colours = mpl.colormaps[style.COLOURS](DARKEST * shade[[n for n in order if complete[n]]])
    ax.add_collection(
        LineCollection(lines, colors=list(map(tuple, colours)), linewidths=thin, alpha=0.75, zorder=2.0)
    )
    incomplete = np.flatnonzero(~complete)
    parts = [part for n in incomplete for part in _complete_parts(across, heights[n])]
    if len(incomplete):
        # they end in a cross where the first number is missing
        drawn = LineCollection(
            parts, colors=INCOMPLETE_COLOUR, linewidths=0.4, linestyles=[(0, (4, 2))], zorder=1.5
        )
        ax.add_collection(drawn)
        ends = [int(np.flatnonzero(~np.isfinite(heights[n]))[0]) for n in incomplete]
        for place in sorted(set(ends)):
            ax.plot(place, BELOW, "x", color=style.VERMILION, markersize=5.0, clip_on=False, zorder=4.0)
            ax.annotate(
                f"{ends.count(place)} without",
                (place, BELOW),
                xytext=(5, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.0,
                color=style.VERMILION,
            )
        stubs = [
            np.array([[end - 1, heights[n, end - 1]], [end, BELOW]])
            for n, end in zip(incomplete, ends, strict=True)
            if end
        ]
        ax.add_collection(
            LineCollection(stubs, colors=INCOMPLETE_COLOUR, linewidths=0.4, linestyles=[(0, (4, 2))])
        )


def _complete_parts(across: Any, heights: Floats) -> list[Floats]:
    """The parts (k, 2) of a line between missing numbers, those of one point left out."""
    there = np.isfinite(heights)
    cuts = np.flatnonzero(np.diff(there.astype(int))) + 1
    pieces = np.split(np.column_stack([across, heights]), cuts)
    return [part for part in pieces if len(part) > 1 and np.isfinite(part).all()]


def _draw_uprights(ax: Axes, uprights: Sequence[ParallelAxis], keys: int) -> None:
    """Draw the uprights with ticks and names: of the axes, the first `keys` of them, thin; of columns bold."""
    for n, one in enumerate(uprights):
        measured = n >= keys
        ax.plot([n, n], [0.0, 1.0], color=style.BLACK, linewidth=1.4 if measured else 0.8, zorder=3.0)
        for height, text in one.ticks.items():
            ax.plot([n - 0.025, n], [height, height], color=style.BLACK, linewidth=0.8, zorder=3.0)
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
    """The upright of an axis or a column of values (designs,): texts evenly spread, numbers in proportion."""
    name = str(column.attrs.get("title") or column.attrs.get("long_name") or column.name)
    unit = spoken_unit(str(column.attrs.get("unit", column.attrs.get("units", ""))))
    if values.dtype.kind not in "ifu":
        kinds = list(dict.fromkeys(map(str, values)))
        at = {kind: (n + 0.5) / len(kinds) for n, kind in enumerate(kinds)}
        return ParallelAxis(
            _in_lines(name), np.array([at[str(value)] for value in values]), {at[kind]: kind for kind in kinds}
        )
    numbers = np.where(np.isfinite(values), values, np.nan).astype(float)
    finite = numbers[np.isfinite(numbers)]
    if not len(finite):
        return ParallelAxis(_in_lines(_with_unit(name, unit)), numbers, {})
    low, high = float(finite.min()), float(finite.max())
    if low == high:  # drawn in the middle
        return ParallelAxis(
            _in_lines(_with_unit(name, unit)), np.where(np.isfinite(numbers), 0.5, np.nan), {0.5: f"{low:.4g}"}
        )
    measured = "title" in column.attrs  # a column, and no axis of the study
    logarithmic = low > 0.0 and (high / low > style.WIDE**2 if measured else column.attrs.get("scale") == "log")
    exponent = exponent_of(max(abs(low), abs(high))) if measured and unit else 0
    if scaled(exponent, unit).startswith("10") and 0.01 <= max(abs(low), abs(high)) < 1e4:
        exponent = 0  # short enough without a power of ten
    locator: Any = LogLocator(subs=(1.0, 2.0, 5.0)) if logarithmic else MaxNLocator(8, steps=[1, 2, 5, 10])
    levels = [v for v in locator.tick_values(low, high) if low <= v <= high]
    scale = np.log if logarithmic else np.asarray
    ends = scale(low), scale(high)
    places = (scale(numbers) - ends[0]) / (ends[1] - ends[0])
    ticks = {
        float((scale(v) - ends[0]) / (ends[1] - ends[0])): f"{v / 10.0**exponent:.4g}".replace("-", MINUS)
        for v in levels
    }
    return ParallelAxis(_in_lines(_with_unit(name, scaled(exponent, unit) if unit else "")), places, ticks)


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _in_lines(name: str) -> str:
    """A label in lines that fit between uprights; a path breaks at its dots."""
    words = (
        name.replace(".", ".\u200b").replace(" [", "\u200b [").split("\u200b") if "." in name else name.split(" ")
    )
    blank = "" if "." in name else " "  # a path breaks at zero-width spaces
    lines = [""]
    for word in words:
        joined = lines[-1] + blank + word if lines[-1] else word
        if len(joined) <= AXIS_LETTERS or not lines[-1]:
            lines[-1] = joined
        else:
            lines.append(word.strip())
    return "\n".join(lines)
