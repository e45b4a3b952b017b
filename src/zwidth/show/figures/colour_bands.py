"""Values as bands of colour: round levels, a colour between each two, and the bar that says which is which."""

from __future__ import annotations

from math import ceil, floor, log10
from textwrap import wrap
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.ticker import FixedLocator, MaxNLocator

from zwidth.arrays import Floats
from zwidth.show.units import MINUS, as_written, exponent_of, scaled

COLOURS: Final = "cividis"  # even steps of lightness, the same to every eye
LEVELS: Final = 10
WIDE: Final = 6.0  # ratio of the usual values from which on levels are spaced by ratios
USUAL: Final = (2.0, 98.0)  # per cent of the values that the levels span
LETTERS: Final = 45  # of a line beside the bar
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
    if most - high < 0.5 * (high - low) and low - least < 0.5 * (high - low):
        low, high = least, most  # no tail to cut
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        middle = 0.5 * (low + high)
        reach = 0.05 * abs(middle) or 1.0
        return np.array([middle - reach, middle + reach])
    if low > 0.0 and high / low > WIDE:
        return _ratios(low, high)
    levels = MaxNLocator(nbins=LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return np.asarray(levels, dtype=np.float64)


def _ratios(low: float, high: float) -> Floats:
    """1, 2, 5 or finer per decade, or a power of ten every few decades, just as many as are wanted."""
    first, last = floor(log10(low) + 1e-12), ceil(log10(high) - 1e-12)
    every = max(1, ceil((last - first) / LEVELS))
    best = 10.0 ** np.arange(first, last + every, every, dtype=np.float64)
    if every > 1:
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
    """Round levels over the values, and the colours of the bands between them and beyond."""
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
    """The bands' colours beside the axes."""
    assert ax.figure is not None
    bar = ax.figure.colorbar(
        ScalarMappable(norm, colours),
        ax=ax,
        ticks=FixedLocator(levels.tolist()),
        spacing="uniform",
        fraction=0.05,
        pad=0.02,
    )
    bar.minorticks_off()
    bar.outline.set_linewidth(0.6)
    # one band: all values are alike, and stand in its middle
    _bar_label(bar, title, unit, levels if len(levels) > 2 else np.array([levels.mean()]))


def _bar_label(bar: Any, title: str, unit: str, levels: Floats) -> None:
    """Ticks at the levels, under a prefix or a power of ten that they have in common."""
    exponent = _common_exponent(levels, unit)
    texts = _texts(levels, exponent)
    if any("e" in text for text in texts):
        texts = [as_written(v / 10.0**exponent) for v in levels.tolist()]
    bar.ax.set_yticks(levels, labels=[text.replace("-", MINUS) for text in texts])
    bar.ax.tick_params(labelsize=8.0)
    name = scaled(exponent, unit).strip("\u00a0")
    measure = f"{title} [{name}]" if name else title
    bar.set_label("\n".join(wrap(measure, LETTERS, break_long_words=False)), fontsize=9.0)


def _common_exponent(levels: Floats, unit: str) -> int:
    """The power of ten under which all levels are short; that of the largest where there is no such."""
    sizes = np.abs(levels[levels != 0.0])
    largest, least = (float(sizes.max()), float(sizes.min())) if len(sizes) else (0.0, 0.0)
    first = exponent_of(largest)
    if scaled(first, unit).startswith("10") and 0.01 <= largest < 1e4:
        first = 0  # short enough without a power of ten
    tried = (first, exponent_of(largest), exponent_of(float(np.sqrt(largest) * np.sqrt(least))))
    return next((one for one in tried if not any("e" in text for text in _texts(levels, one))), 0)


def _texts(levels: Floats, exponent: int) -> list[str]:
    return [f"{v / 10.0**exponent:.4g}" for v in levels.tolist()]
