"""A simulated contact in time: position, penetration, force and energy under each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from zwidth.contact.response import SOURCES, TimeResponse
from zwidth.show.figures.style import BLACK, BLUE, GREY, LINES, VERMILION, context, figure, label, legend_above

Floats = NDArray[np.float64]

DRAWN: Final = 6000  # samples drawn as lines; above, what they sweep over is drawn instead
BETWEEN: Final = 4  # points of the handle's line for each of these
DASHED: Final = (0, (3, 1.5))
BINS: Final = 600  # across a panel
LEDGER: Final = 3  # entries drawn, the largest
WORTH: Final = 1e-3  # share of the largest energy below which an entry is no line


def motion_figure() -> tuple[Figure, list[Axes]]:
    """A figure with the four panels that `draw_motion` takes, their times aligned."""
    made, first = figure(6.2, 8.2)
    with context():
        grid = made.add_gridspec(4, 1)
        first.set_subplotspec(grid[0])
        axes = [first, *(made.add_subplot(grid[row], sharex=first) for row in (1, 2, 3))]
    return made, axes


def draw_motion(axes: Sequence[Axes], response: TimeResponse) -> None:
    """Four panels: handle and what the encoders count; how deep that is; force; energy stored and put in.

    A long run is drawn as what it sweeps over between each two of 600 times, so that no vibration is left out.
    """
    position, depth, force, energy = axes
    draw = sweep if len(response.time) > DRAWN else line
    draw(position, *_handle(response), BLACK, "handle")
    draw(position, response.time, response.reading, VERMILION, "counted by the encoders", held=True, dashes=DASHED)
    _across(position, response.wall_position, "wall")
    draw(depth, response.time, response.penetration, BLUE, "penetration as counted", held=True)
    _across(depth, 0.0, "surface")
    draw(force, response.time, response.force, BLUE, "force on the device", held=True)
    _across(force, 0.0, "")
    _draw_energies(energy, response, draw)
    for ax, name, unit in (
        (position, "Position", "m"),
        (depth, "Penetration", "m"),
        (force, "Force", "N"),
        (energy, "Energy since start", "J"),
    ):
        label(ax.yaxis, name, unit)
        legend_above(ax, columns=3 if ax is not energy else 4)
        ax.margins(x=0.0, y=0.08)
        ax.tick_params(labelbottom=ax is energy)
        if len(response.time) > 1:  # the trail of the last sample goes beyond it
            ax.set_xlim(0.0, response.time[-1])
    label(energy.xaxis, "Time", "s")
    position.figure.align_ylabels(list(axes))


def _handle(response: TimeResponse) -> tuple[Floats, Floats]:
    """Time and place of the handle, between samples where that was kept; not more of it than can be seen."""
    if not response.trail.size:
        return response.time, response.handle
    skip = 1 if len(response.time) > DRAWN else -(-len(response.trail) // (BETWEEN * DRAWN))
    time = np.append(0.0, response.trail_time)[::skip]
    return time, np.append(response.handle[:1], response.trail)[::skip]


def line(
    ax: Axes, time: Floats, values: Floats, colour: str, text: str, *, held: bool = False, dashes: Any = "-"
) -> None:
    """One signal; held: a value stays until the next one."""
    how = "steps-post" if held else "default"
    ax.plot(time, values, color=colour, linestyle=dashes, label=text, drawstyle=how, linewidth=1.1)


def sweep(
    ax: Axes, time: Floats, values: Floats, colour: str, text: str, *, held: bool = False, dashes: Any = "-"
) -> None:
    """The band that a signal with too many points for a line sweeps over; with dashes its two edges only."""
    edges, low, high = swept(time, values)
    if dashes == "-":
        style: dict[str, Any] = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.6, "alpha": 0.55}
        ax.fill_between(edges, low, high, step="post", label=text, **style)
        return
    for edge, name in ((low, text), (high, "")):
        ax.plot(edges, edge, color=colour, linestyle=dashes, label=name, drawstyle="steps-post", linewidth=1.1)


def swept(time: Floats, values: Floats, bins: int = BINS) -> tuple[Floats, Floats, Floats]:
    """Begin (bins + 1,) of each of so many equal times, smallest and largest value in it; nothing between is lost.

    Each bin has the last value of the one before, too, so that neighbours touch.
    """
    cut = np.linspace(0, len(values), bins + 1).astype(int)
    parts = [values[max(start - 1, 0) : stop] for start, stop in pairwise(cut)]
    low, high = np.array([part.min() for part in parts]), np.array([part.max() for part in parts])
    return np.append(time[cut[:-1]], time[-1]), np.append(low, low[-1]), np.append(high, high[-1])


def _draw_energies(ax: Axes, response: TimeResponse, draw: Callable[..., None]) -> None:
    """What is stored, and the entries of the ledger that move most of it."""
    draw(ax, response.time, response.stored, BLACK, "stored")
    size = np.abs(response.energies).max(axis=0)
    worth = [i for i in np.argsort(-size)[:LEDGER] if size[i] > WORTH * size.max()]
    for i, (colour, dashes) in zip(worth, LINES[1:], strict=False):
        draw(ax, response.time, response.energies[:, i], colour, SOURCES[i], dashes=dashes)
    _across(ax, 0.0, "")


def _across(ax: Axes, height: float, text: str) -> None:
    ax.axhline(height, color=GREY, linewidth=0.7, linestyle=":", zorder=1.5, label=text)
