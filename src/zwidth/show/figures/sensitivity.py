"""What to change first, as bars."""

from __future__ import annotations

from math import isnan

from matplotlib.axes import Axes

from zwidth.show.figures.style import BLACK, BLUE, GREY, VERMILION
from zwidth.show.units import MINUS, NONE, signed
from zwidth.study.sensitivity_result import Sensitivities


def draw_sensitivities(ax: Axes, found: Sensitivities, top: int = 12, *, wholes: bool = False) -> None:
    """Per cent of largest stiffness that one per cent more of each number gives, the most telling on top.

    top     how many numbers at most; those without influence are left out
    wholes  lists and matrices as wholes, not their elements
    """
    single = [(n.path, n.logarithmic) for n in found.numbers if not isnan(n.logarithmic) and n.logarithmic != 0.0]
    shown = list(found.wholes if wholes else single)[:top]
    rows = list(range(len(shown), 0, -1))
    values = [value for _, value in shown]
    widest = max((abs(value) for value in values), default=1.0)
    for row, value in zip(rows, values, strict=True):
        # gains and losses differ in hatching too, for a grey print
        ax.barh(
            row,
            value,
            height=0.62,
            color=BLUE if value > 0.0 else "white",
            edgecolor=BLUE if value > 0.0 else VERMILION,
            hatch=None if value > 0.0 else "//////",
            linewidth=0.8,
        )
        ax.annotate(
            signed(value),
            (value, row),
            xytext=(4 if value > 0.0 else -4, 0),
            textcoords="offset points",
            ha="left" if value > 0.0 else "right",
            va="center",
            fontsize=7.5,
        )
    ax.axvline(0.0, color=BLACK, linewidth=0.8)
    low, high = min([0.0, *values]), max([0.0, *values])
    ax.set_xlim(
        low - 0.2 * widest * (low < 0.0) - 0.02 * widest, high + 0.2 * widest * (high > 0.0) + 0.02 * widest
    )
    ax.set_ylim(0.4, len(shown) + 0.6)
    ax.set_yticks(rows, [_short(path) for path, _ in shown])
    ax.tick_params(axis="y", length=0.0)
    ax.spines["left"].set_visible(False)
    ax.xaxis.set_major_formatter(lambda x, _: f"{x:g}".replace("-", MINUS))
    ax.set_xlabel("change of the largest stiffness by 1 % more [%]")
    if not shown:
        ax.set_yticks([])
        ax.text(0.5, 0.5, NONE, transform=ax.transAxes, ha="center", va="center", color=GREY)


def _short(path: str) -> str:
    """A path without the table that all its neighbours share."""
    return path.removeprefix("mechanism.")
