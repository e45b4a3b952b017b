"""How figures look and how they are saved: the same bytes from the same numbers, and no global state.

Colours are those of Okabe and Ito (2008), distinguishable with any colour vision; lines that share a figure also
differ in their dashes and in lightness, so that a grey print can be read.

Values as bands of colour: round levels, a colour between each two, and the bar that says which is which.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from contextlib import AbstractContextManager
from functools import lru_cache
from html import escape
from io import StringIO
from itertools import pairwise
from math import ceil, floor, log10
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedLocator, Formatter, FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from zwidth.arrays import Floats
from zwidth.show.output import replacing
from zwidth.show.units import MINUS, as_written, exponent_of, scaled

BLACK: Final = "#000000"
BLUE: Final = "#0072B2"
VERMILION: Final = "#D55E00"
GREEN: Final = "#009E73"
PURPLE: Final = "#CC79A7"
ORANGE: Final = "#E69F00"
GREY: Final = "#767676"
STABLE: Final = "#C9E3F3"  # light enough that every line stands out on it

# Colour and dashes of the n-th line of a figure.
LINES: Final[tuple[tuple[str, Any], ...]] = (
    (BLACK, "-"),
    (BLUE, (0, (5, 1.5))),
    (VERMILION, (0, (1.2, 1.2))),
    (GREEN, (0, (6, 1.5, 1.2, 1.5))),
    (PURPLE, (0, (6, 1.2, 1.2, 1.2, 1.2, 1.2))),
    (ORANGE, (0, (10, 3))),
)

FAMILY: Final = "DejaVu Sans"  # comes with matplotlib: the same glyphs on every machine
TICK_SIZE: Final = 8.0  # points, of letters, as the next two
AXIS_SIZE: Final = 9.0
LEGEND_SIZE: Final = 8.0
HANDLE: Final = 3.4  # widths of a letter that a legend's line takes before its text
BESIDE_AXES: Final = 0.7  # inches beside axes that a legend above them cannot use: the labels of the upright axis
MOST_DECADES: Final = 8  # of a logarithmic axis that are all numbered
# Decades from which on a logarithmic axis has ticks at these multiples of each power of ten.
DECADE_STEPS: Final = (
    (2.5, (1.0,)),
    (1.2, (1.0, 2.0, 5.0)),
    (0.3, (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)),
)
FORMATS: Final = (".png", ".svg", ".pdf")
_STYLE: Final[dict[str, Any]] = {
    "font.family": FAMILY,
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": AXIS_SIZE,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.4,
    "xtick.labelsize": TICK_SIZE,
    "ytick.labelsize": TICK_SIZE,
    "figure.dpi": 100.0,
    "savefig.dpi": 200.0,
    "svg.fonttype": "path",
    "svg.hashsalt": "zwidth",
    "pdf.fonttype": 42,
}


def context() -> AbstractContextManager[None]:
    """Context in which figures are made with settings of this file alone; `figure` and `save` use it already."""
    settings: Any = {**mpl.rcParamsDefault, **_STYLE}
    return mpl.rc_context(settings)


def figure(width: float = 5.6, height: float = 3.9) -> tuple[Figure, Axes]:
    """A figure of this size [inches] with one pair of axes, apart from pyplot."""
    with context():
        drawing = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(drawing)
        return drawing, drawing.add_subplot()


def draw_empty(ax: Axes, text: str = "no wall is stable") -> None:
    """Say in the middle of axes why there is nothing to be drawn; numbers along them would mean nothing."""
    ax.set_xticks([])
    ax.set_yticks([])
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=GREY)


def save(drawing: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure as .png, .svg or .pdf, whole or not at all, without dates.

    Raises  ValueError   for another extension
            OutputError  (show.output) where the file cannot be written; what stood there before still stands
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind not in FORMATS:
        raise ValueError(f"a figure is written as {', '.join(FORMATS)}, got '{target.name}'; change the extension")
    undated: dict[str, dict[str, Any]] = {
        ".png": {"Software": "zwidth"},
        ".svg": {"Date": None, "Creator": "zwidth"},
        ".pdf": {"CreationDate": None, "ModDate": None, "Creator": "zwidth", "Producer": None},
    }
    with replacing(target) as draft, context():
        _draw_into_file(drawing, draft, kind, undated[kind])
    return target


def _draw_into_file(drawing: Figure, target: Path | StringIO, kind: str, metadata: dict[str, Any]) -> None:
    """Draw a figure into a file of this kind, in one pass.

    `Figure.savefig` draws twice, once for the layout. Drawing lays out first, for the very canvas that it draws
    on, so that once gives the same file.
    """
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    canvas: Any = {".png": FigureCanvasAgg, ".svg": FigureCanvasSVG, ".pdf": FigureCanvasPdf}[kind]
    before, dots = drawing.canvas, drawing.get_dpi()
    drawing.set_dpi(mpl.rcParams["savefig.dpi"])
    try:
        getattr(canvas(drawing), f"print_{kind[1:]}")(target, metadata=metadata)
    finally:
        drawing.set_canvas(before)
        drawing.set_dpi(dots)


def inline_svg(drawing: Figure, name: str, description: str) -> str:
    """A figure as an <svg> element to stand in a page beside others.

    name         prefix of all its ids, unlike that of any other figure in the page
    description  read out to those who cannot see it
    """
    text = StringIO()
    with context():
        _draw_into_file(drawing, text, ".svg", {"Date": None, "Creator": "zwidth"})
    body = text.getvalue()
    body = body[body.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'(href="|url\()#', rf"\g<1>#{name}-", body)
    opening, content = body.split(">", 1)
    opening = re.sub(r'\s(width|height|version|xmlns:xlink|xmlns)="[^"]*"', "", opening)
    # an HTML page knows the namespaces; plain href needs none
    content = content.replace("xlink:href=", "href=")
    return f'{opening} role="img"><title>{escape(description)}</title>{content.rstrip()}'


class Prefixed(Formatter):
    """Tick labels under an SI prefix, or a power of ten, common to the axis, which the axis's label names.

        Virtual stiffness [kN/m]   0  2  4  6  8

    The prefix follows the view: it is chosen anew whenever the figure is drawn.

    plain  without any prefix
    """

    def __init__(self, axis: Axis, name: str, unit: str, *, plain: bool = False) -> None:
        self.labelled, self.name, self.unit, self.plain = axis, name, unit, plain
        self.exponent, self.decimals = 0, 0

    def set_locs(self, locs: Sequence[float]) -> None:
        """Choose prefix and decimals for the ticks in view, and name the axis; called when the figure is drawn."""
        low, high = sorted(self.labelled.get_view_interval())
        largest = max(abs(low), abs(high))
        self.exponent = 0 if self.plain else exponent_of(largest)
        if scaled(self.exponent, self.unit).startswith("10") and 0.01 <= largest < 1e4:
            self.exponent = 0  # short enough without a power of ten
        inside = sorted({round(x / 10.0**self.exponent, 9) for x in locs if low <= x <= high})
        self.decimals = next((d for d in range(7) if all(abs(x - round(x, d)) < 1e-7 for x in inside)), 6)
        self.labelled.set_label_text(f"{self.name} [{scaled(self.exponent, self.unit)}]")

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of the tick at x, which matplotlib asks for; `pos`, the tick's number, makes no difference."""
        return f"{x / 10.0**self.exponent + 0.0:.{self.decimals}f}".replace("-", MINUS)


def label(axis: Axis, name: str, unit: str, *, plain: bool = False) -> None:
    """Name an axis in SI units; its ticks get the prefix that suits the view, or none at all (plain)."""
    formatter = Prefixed(axis, name, unit, plain=plain)
    axis.set_major_formatter(formatter)
    formatter.set_locs([])


def legend_above(ax: Axes, columns: int = 1, title: str | None = None) -> None:
    """The legend over the axes, where it hides nothing, in so many columns, or as many as the figure holds."""
    _draw_legend(ax, loc="lower left", bbox_to_anchor=(0.0, 1.01), ncols=columns, title=title)


def legend_beside(ax: Axes) -> None:
    """The legend to the right of the axes, for drawings that are higher than wide."""
    _draw_legend(ax, loc="center left", bbox_to_anchor=(1.02, 0.5))


def number_logarithmic(axis: Axis, low: float, high: float, unit: str = "") -> None:
    """Number a logarithmic axis from low to high: each decade, 1, 2 and 5 of few, more of less than one.

    unit  written with every number, under the prefix that suits it: 1 mm after 100 µm; "": numbers alone
    """
    decades = log10(high / low) if high > low > 0.0 else 1.0
    steps = next((steps for least, steps in DECADE_STEPS if decades > least), (1.0,))
    if decades > DECADE_STEPS[-1][0]:
        decades_apart = max(1, ceil(decades / MOST_DECADES))
        axis.set_major_locator(LogLocator(base=10.0**decades_apart, subs=steps, numticks=99))
    else:  # less than a third of a decade has room for round numbers only
        axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: as_written(float(f"{value:.4g}"), unit)))
    axis.set_minor_formatter(NullFormatter())


@lru_cache(maxsize=4096)
def text_width(text: str, size: float) -> float:
    """Width of a line in letters of this size [points], the same on every machine."""
    font = FontProperties(family=FAMILY, size=size)
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def wrapped(text: str, room: float, size: float) -> list[str]:
    """The text in lines no wider than room [points], broken at blanks, and within a word that is wider itself."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if text_width(longer, size) <= room:
            lines[-1] = longer
            continue
        lines += [word] if lines[-1] else []
        lines[-1] = lines[-1] or word
        while text_width(lines[-1], size) > room:
            last = lines[-1]
            fits = next((n for n in range(len(last) - 1, 1, -1) if text_width(last[:n], size) <= room), 1)
            lines[-1:] = [last[:fits], last[fits:]]
    return [line for line in lines if line]


def figure_width(ax: Axes) -> float:
    """Width of the figure that holds the axes [points]."""
    assert ax.figure is not None
    return 72.0 * float(ax.figure.get_figwidth())  # type: ignore[union-attr]


def room_above(ax: Axes) -> float:
    """Width that there is for a text above axes, from their left side to the figure's right [points]."""
    return figure_width(ax) - 72.0 * BESIDE_AXES


def fitted_columns(ax: Axes, labels: Sequence[str], columns: int, size: float = LEGEND_SIZE) -> int:
    """Columns of a legend above axes, at most so many, in which the labels do not leave the figure."""
    room = room_above(ax)
    widths = [max(text_width(line, size) for line in text.split("\n")) + HANDLE * size for text in labels]
    for count in range(min(columns, len(labels)), 1, -1):
        rows, longer = divmod(len(labels), count)  # matplotlib makes the first columns longer
        ends = [n * rows + min(n, longer) for n in range(count + 1)]
        needed = sum(max(widths[start:stop]) for start, stop in pairwise(ends)) + 1.6 * size * (count - 1)
        if needed <= room:
            return count
    return 1


def _in_lines(text: str, room: float) -> str:
    """A legend's text with its own lines broken where they are wider than room [points]."""
    return "\n".join(line for part in text.split("\n") for line in wrapped(part, room, LEGEND_SIZE))


def _draw_legend(ax: Axes, **place: Any) -> None:
    """Draw the legend of all that has a label, at this place; its texts are broken into lines that fit.

    place  arguments of `Axes.legend`
    """
    handles, labels = ax.get_legend_handles_labels()
    if not handles:
        return
    if "ncols" in place:
        place["ncols"] = fitted_columns(ax, labels, place["ncols"])
        room = room_above(ax)
        labels = [_in_lines(text, room - HANDLE * LEGEND_SIZE) for text in labels]
        place["title"] = place["title"] and _in_lines(place["title"], room)
    legend = ax.legend(
        handles,
        labels,
        borderaxespad=0.0,
        handlelength=2.6,
        columnspacing=1.6,
        fontsize=LEGEND_SIZE,
        title_fontsize=LEGEND_SIZE,
        frameon=False,
        alignment="left",
        **place,
    )
    legend.set_zorder(6.0)


COLOURS: Final = "cividis"  # even steps of lightness, the same to every eye
LEVELS: Final = 10
WIDE: Final = 6.0  # ratio of the usual values from which on levels are spaced by ratios
USUAL: Final = (2.0, 98.0)  # per cent of the values that the levels span
LETTERS: Final = 45  # of a line beside the bar
BAR: Final = (1.03, 0.0, 0.04, 1.0)  # left, bottom, width, height of the bar of colours, as shares of the axes
LARGEST: Final = 1e200  # what is larger is drawn as infinite; matplotlib counts to 1e250


def levels_of(values: Floats) -> Floats:
    """Round levels (k,) over the usual values, ascending; spaced by ratios where those differ much.

    Of values that are all the same, that value in the middle of two.
    """
    finite = values[np.abs(values) <= LARGEST]
    if not len(finite):
        return np.array([0.0, 1.0])
    low, high = (float(v) for v in np.percentile(finite, USUAL))
    least, most = float(finite.min()), float(finite.max())
    # `least` and `most` are those of all values, `low` and `high` those of the usual ones
    if most - high < 0.5 * (high - low) and low - least < 0.5 * (high - low):
        low, high = least, most  # no tail to cut
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        middle = 0.5 * (low + high)
        reach = 0.05 * abs(middle) or 1.0
        return np.array([middle - reach, middle + reach])
    if low > 0.0 and high / low > WIDE:
        return _levels_by_ratio(low, high)
    levels = MaxNLocator(nbins=LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return np.asarray(levels, dtype=np.float64)


def _levels_by_ratio(low: float, high: float) -> Floats:
    """Round levels from low to high: 1, 2, 5 or finer per decade, or a power of ten every few decades.

    Of the grids within a decade the finest that makes few levels is taken.
    """
    first, last = floor(log10(low) + 1e-12), ceil(log10(high) - 1e-12)
    decades_apart = max(1, ceil((last - first) / LEVELS))
    best = 10.0 ** np.arange(first, last + decades_apart, decades_apart, dtype=np.float64)
    if decades_apart > 1:
        return np.asarray(best)
    decades = 10.0 ** np.arange(first - 1, last + 1, dtype=np.float64)
    for grid in ([1.0, 3.0], [1.0, 2.0, 5.0], [1.0, 1.5, 2.0, 3.0, 5.0, 7.0]):
        all_levels = np.append(np.outer(decades, grid).ravel(), 10.0 * decades[-1])
        begin = max(int(np.searchsorted(all_levels, low, side="right")) - 1, 0)
        end = int(np.searchsorted(all_levels, high, side="left"))
        if end - begin < LEVELS + 3:
            best = all_levels[begin : end + 1]
    return np.asarray(best)


def bands_of(values: Floats, *, faint: bool = False) -> tuple[Floats, BoundaryNorm, ListedColormap]:
    """Round levels over the values, and the colours of the bands between them and beyond.

    Returns  levels (k,), ascending; the norm that gives each value the number of its band; a colour for each band,
             one more where values lie below the lowest level, or above the highest
    """
    levels = levels_of(values)
    under, over = bool((values < levels[0]).any()), bool((values > levels[-1]).any())
    extend: Any = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[
        under, over
    ]
    bands = len(levels) - 1 + under + over
    shades = mpl.colormaps[COLOURS](np.linspace(0.0, 1.0, bands))
    if faint:  # lines and hatches stand out on it
        shades[:, :3] = 1.0 - 0.45 * (1.0 - shades[:, :3])
    return levels, BoundaryNorm(levels, bands, extend=extend), ListedColormap(shades)


def colour_bar(
    ax: Axes, levels: Floats, norm: BoundaryNorm, colours: ListedColormap, title: str, unit: str
) -> None:
    """The bands' colours beside the axes, as high as these are; levels, norm and colours as of `bands_of`."""
    assert ax.figure is not None
    bar = ax.figure.colorbar(
        ScalarMappable(norm, colours),
        cax=ax.inset_axes(BAR),
        ticks=FixedLocator(levels.tolist()),
        spacing="uniform",
    )
    bar.minorticks_off()
    bar.outline.set_linewidth(0.6)
    # one band: all values are alike, and stand in its middle
    _bar_label(bar, title, unit, levels if len(levels) > 2 else np.array([levels.mean()]))


def _bar_label(bar: Any, title: str, unit: str, levels: Floats) -> None:
    """Number the levels on a bar of colours, under a prefix or power of ten that they share, and name it."""
    exponent = _common_exponent(levels, unit)
    texts = _level_texts(levels, exponent)
    if any("e" in text for text in texts):
        texts = [as_written(v / 10.0**exponent) for v in levels.tolist()]
    bar.ax.set_yticks(levels, labels=[text.replace("-", MINUS) for text in texts])
    bar.ax.tick_params(labelsize=8.0)
    name = scaled(exponent, unit).strip("\u00a0")
    measure = f"{title} [{name}]" if name else title
    bar.set_label("\n".join(wrap(measure, LETTERS, break_long_words=False)), fontsize=9.0)


def _common_exponent(levels: Floats, unit: str) -> int:
    """The exponent of ten, one of a prefix, under which all levels read without "e"; 0 where there is none."""
    sizes = np.abs(levels[levels != 0.0])
    largest, least = (float(sizes.max()), float(sizes.min())) if len(sizes) else (0.0, 0.0)
    first = exponent_of(largest)
    if scaled(first, unit).startswith("10") and 0.01 <= largest < 1e4:
        first = 0  # short enough without a power of ten
    tried = (first, exponent_of(largest), exponent_of(float(np.sqrt(largest) * np.sqrt(least))))
    return next(
        (exponent for exponent in tried if not any("e" in text for text in _level_texts(levels, exponent))), 0
    )


def _level_texts(levels: Floats, exponent: int) -> list[str]:
    """The levels in four digits, each divided by ten to this exponent."""
    return [f"{v / 10.0**exponent:.4g}" for v in levels.tolist()]
