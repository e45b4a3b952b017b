"""Sensitivities as bars, the largest first.

Which model where: how far each simpler model is off, along the edge by frequency.
"""

from __future__ import annotations

from math import isfinite, isnan
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from zwidth.show.figures import style
from zwidth.show.units import MINUS, NONE, quantity, signed
from zwidth.study.model_validity import Validity
from zwidth.study.sensitivity.goal import Goal
from zwidth.study.sensitivity.result import Sensitivities

NUMBER_ROOM: Final = 0.24  # of what the bars span, for the numbers beside them
NUMBER_WIDTH: Final = 40.0  # points that such a number takes at least
MARGINS: Final = 20.0  # points beside axes and labels


def draw_sensitivities(ax: Axes, sensitivities: Sensitivities, top: int = 12, *, grouped: bool = False) -> None:
    """Per cent of largest stiffness that one per cent more of each number gives, the most telling on top.

    top      how many numbers at most; those without influence are left out
    grouped  lists and matrices as wholes, not their elements
    """
    single = [
        (n.path, n.logarithmic) for n in sensitivities.numbers if not isnan(n.logarithmic) and n.logarithmic != 0.0
    ]
    shown = list(sensitivities.ranking if grouped else single)[:top]
    _draw_bars(ax, shown, "Change of the largest stiffness for 1 % more [%]")


def draw_goal(ax: Axes, goal: Goal, top: int = 12) -> None:
    """How far each number has to be changed for a wanted largest stiffness, the smallest change on top.

    top  how many numbers at most; those that do not reach it, and those that are 0 now, are left out
    """
    shown = [(one.path, 100.0 * (one.factor - 1.0)) for one in goal.reached if one.factor == one.factor][:top]
    wanted = quantity(goal.goal, "N/m")
    _draw_bars(ax, shown, f"Change of one number for a largest stiffness of {wanted} [%]")


def _draw_bars(ax: Axes, shown: list[tuple[str, float]], axis_name: str) -> None:
    """Draw a bar for each number, from the top, with its value beside it.

    shown  path and value [%] of each
    """
    rows = list(range(len(shown), 0, -1))
    values = [value for _, value in shown]
    widest = max((abs(value) for value in values), default=1.0)
    for row, value in zip(rows, values, strict=True):
        _draw_bar(ax, row, value)
    ax.axvline(0.0, color=style.BLACK, linewidth=0.8)
    low, high = min([0.0, *values]), max([0.0, *values])
    labels = [_on_two_lines_if_wide(_short_path(path), 0.45 * style.figure_width(ax)) for path, _ in shown]
    beside = style.figure_width(ax) - _widest_line(labels) - MARGINS
    # numbers stand outside of the bars: both sides have room for the longest, whatever the bars span
    sides = (low < 0.0) + (high > 0.0)
    share = max(NUMBER_ROOM, NUMBER_WIDTH / max(beside - sides * NUMBER_WIDTH, NUMBER_WIDTH))
    room = share * (high - low or 1.0)
    ax.set_xlim(low - (room if low < 0.0 else 0.02 * widest), high + (room if high > 0.0 else 0.02 * widest))
    ax.set_ylim(0.4, len(shown) + 0.6)
    ax.set_yticks(rows, labels)
    ax.tick_params(axis="y", length=0.0)
    ax.spines["left"].set_visible(False)
    ax.xaxis.set_major_formatter(lambda x, _: f"{x:g}".replace("-", MINUS))
    ax.xaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
    ax.set_xlabel("\n".join(style.wrapped(axis_name, beside, style.AXIS_SIZE)))
    if not shown:
        ax.set_yticks([])
        ax.text(0.5, 0.5, NONE, transform=ax.transAxes, ha="center", va="center", color=style.GREY)


def _draw_bar(ax: Axes, row: int, value: float) -> None:
    """Draw the bar of one number in its row, with its value beside it."""
    # gains and losses differ in hatching too, for a grey print
    ax.barh(
        row,
        value,
        height=0.62,
        color=style.BLUE if value > 0.0 else "white",
        edgecolor=style.BLUE if value > 0.0 else style.VERMILION,
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
        zorder=3.0,
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )


def _widest_line(labels: list[str]) -> float:
    """Width of the widest line of labels, which may have several lines [points]."""
    return max(
        (style.text_width(line, style.TICK_SIZE) for label in labels for line in label.split("\n")), default=0.0
    )


def _on_two_lines_if_wide(path: str, width: float) -> str:
    """The path on one line, or with its last name on a second where it is wider than `width` [points]."""
    table, dot, name = path.rpartition(".")
    return path if style.text_width(path, style.TICK_SIZE) <= width or not dot else f"{table}.\n{name}"


def _short_path(path: str) -> str:
    """A path without "mechanism.", with which nearly all begin."""
    return path.removeprefix("mechanism.")


def draw_validity(ax: Axes, validity: Validity) -> None:
    """Error of each model against the frequency at which the walls fail, both axes logarithmic.

    The shaded band is the tolerance. Lines stop where the edge has no wall that fails at this frequency.
    """
    # the first colour is the device as described, elsewhere in a report
    for fit, (colour, dashes) in zip(
        (fit for fit in validity.fits if len(fit.error)), style.LINES[1:] + style.LINES[:1], strict=False
    ):
        # an error beyond the axis is drawn at its end
        frequency, error = _with_gaps(fit.frequency, 100.0 * np.clip(fit.error, 1e-4, 10.0), validity.arc)
        ax.plot(frequency, error, color=colour, linestyle=dashes, label=fit.label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    percent = 100.0 * validity.tolerance
    ax.axhspan(0.01, percent, color="#EFEFEF", zorder=0.5, label=f"within {percent:g} %")
    if isfinite(validity.first_natural):
        text = f"first natural frequency: {quantity(validity.first_natural, 'Hz')}"
        ax.axvline(validity.first_natural, color=style.GREY, linestyle=(0, (6, 3)), linewidth=0.8, label=text)
    if len(validity.frequency):
        ax.set_xlim(
            validity.frequency[0], max(validity.frequency[-1], 1.05 * np.nan_to_num(validity.first_natural))
        )
    ax.set_ylim(0.01, 1000.0)
    style.number_logarithmic(ax.xaxis, *ax.get_xlim())
    style.number_logarithmic(ax.yaxis, *ax.get_ylim())
    ax.set_xlabel("Frequency at which the wall fails [Hz]")
    ax.set_ylabel("Error of the model [%]")
    style.legend_above(ax, columns=2)


def _with_gaps(x: np.ndarray, y: np.ndarray, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both arrays (k,) with nan wherever the piece of edge changes.

    arc  (k,) number of the piece
    """
    at = np.flatnonzero(np.diff(arc)) + 1
    return np.insert(x, at, np.nan), np.insert(y, at, np.nan)
