"""A simulated contact in time: position, force and energy under each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from zwidth.arrays import Floats
from zwidth.contact.time_response import SOURCES, TimeResponse
from zwidth.show.figures.style import BLACK, BLUE, GREY, LINES, VERMILION, context, figure, label, legend_above
from zwidth.show.units import energy_label, quantity

LONGEST_LINE: Final = 6000  # samples drawn as lines; above, what they sweep over is drawn instead
BETWEEN: Final = 4  # points of the handle's line for each of these
DASHED: Final = (0, (3, 1.5))
BINS: Final = 600  # across a panel
LEDGER: Final = 3  # entries drawn, the largest
SETTLED: Final = 0.02  # share of what a reading spans, within which it is at rest
PART: Final = 0.6  # share of a run: where less of it matters, the rest is not drawn
LEAD: Final = 0.15  # share of what matters, drawn after it; twice as much before
WALL: Final = "#E8E8E8"
WORTH: Final = 1e-3  # share of the largest energy below which an entry is no line


def contact_figure() -> tuple[Figure, list[Axes]]:
    """A figure with the three panels that `draw_contact` takes, their times aligned."""
    drawing, first = figure(6.2, 6.6)
    with context():
        grid = drawing.add_gridspec(3, 1, height_ratios=(1.4, 1.0, 1.0))
        first.set_subplotspec(grid[0])
        axes = [first, *(drawing.add_subplot(grid[row], sharex=first) for row in (1, 2))]
    return drawing, axes


def draw_contact(axes: Sequence[Axes], response: TimeResponse) -> None:
    """Three panels: handle and what the encoders count, with the wall; force; energy stored and put in.

    Of a run that soon comes to rest, or soon leaves the wall, the part with the contact is drawn, and the axis of
    time says how long the run was. A long run is drawn as what it sweeps over between each two of 600 times, so
    that no vibration is left out.
    """
    position, force, energy = axes
    window = time_window(response)
    run = _SamplesWithin(response.time, window)
    draw = draw_envelope if len(run.time) > LONGEST_LINE else draw_line
    draw_position(position, response, window)
    draw(force, run.time, run(response.force), BLUE, "force on the device", held=True)
    _across(force, 0.0, "")
    _draw_energies(energy, response, run, draw)
    for ax, name, unit in ((force, "Force", "N"), (energy, "Energy since start", "J")):
        label(ax.yaxis, name, unit)
        legend_above(ax, columns=4)
        ax.margins(x=0.0, y=0.08)
    for ax in axes:
        ax.tick_params(labelbottom=ax is energy)
        if len(run.time) > 1:  # the trail of the last sample goes beyond it
            ax.set_xlim(window)
    name_time(energy, response, window)
    position.set_xlabel("")
    position.figure.align_ylabels(list(axes))


def draw_position(ax: Axes, response: TimeResponse, window: tuple[float, float] | None = None) -> None:
    """Where the handle is and what the encoders count, over time, and where the wall begins.

    window  seconds from and to; left out: `time_window`
    """
    window = time_window(response) if window is None else window
    run = _SamplesWithin(response.time, window)
    draw = draw_envelope if len(run.time) > LONGEST_LINE else draw_line
    time, handle = _handle_signal(response)
    # the handle's trail goes on after the last sample, and is drawn to its end where that sample is drawn
    part = _SamplesWithin(time, window if window[1] < response.time[-1] else (window[0], np.inf))
    draw(ax, part.time, part(handle), BLACK, "handle")
    draw(ax, run.time, run(response.reading), VERMILION, "counted by the encoders", held=True, dashes=DASHED)
    ax.margins(x=0.0, y=0.08)
    wall = response.wall_position
    low, high = ax.get_ylim()
    room = 0.06 * (max(high, wall) - min(low, wall))
    low, high = min(low, wall - room), max(high, wall + room)
    if response.surface:
        ax.axhspan(wall, high, color=WALL, linewidth=0.0, zorder=0.5, label="in the wall")
        ax.set_ylim(low, high)
        ax.axhline(wall, color=GREY, linewidth=0.9, zorder=1.5)
    else:
        ax.set_ylim(low, high)
        _across(ax, wall, "wall, on both sides")
    label(ax.yaxis, "Position", "m")
    legend_above(ax, columns=3)
    if len(run.time) > 1:
        ax.set_xlim(window)
    name_time(ax, response, window)


def name_time(ax: Axes, response: TimeResponse, window: tuple[float, float]) -> None:
    """Name the axis of time; where only a part of a run is drawn, with how long the run was."""
    length = float(response.time[-1]) if len(response.time) else 0.0
    part = window[1] - window[0] < (1.0 - 1e-9) * length
    label(ax.xaxis, f"Time, of a run of {quantity(length, 's')}" if part else "Time", "s")


def time_window(response: TimeResponse) -> tuple[float, float]:
    """From when to when something happens at the wall [s]; the whole run if that is most of it, or nothing."""
    time, reading = response.time, response.reading
    if len(time) < 2:
        return 0.0, float(time[-1]) if len(time) else 0.0
    whole = float(time[0]), float(time[-1])
    happens = np.abs(reading - reading[-1]) > SETTLED * np.ptp(reading)
    if response.surface:
        # free motion to the wall and from it is of no interest beyond its beginning
        touching = response.force != 0.0
        happens = happens & touching if (happens & touching).any() else happens
    busy_samples = np.flatnonzero(happens)
    if not len(busy_samples):
        return whole
    first, last = float(time[busy_samples[0]]), float(time[busy_samples[-1]])
    lead = LEAD * max(last - first, float(time[1] - time[0]))
    window = max(whole[0], first - 2.0 * lead), min(whole[1], last + lead)
    return window if window[1] - window[0] < PART * (whole[1] - whole[0]) else whole


class _SamplesWithin:
    """The samples of signals within a window of time, and one beside it at either end.

    time  those of these samples [s]
    """

    def __init__(self, time: Floats, window: tuple[float, float]) -> None:
        inside = np.flatnonzero((time >= window[0]) & (time <= window[1]))
        # a sample more on both sides, so that lines reach the border
        self.kept = slice(max(int(inside[0]) - 1, 0), int(inside[-1]) + 2) if len(inside) else slice(0, None)
        self.time = time[self.kept]

    def __call__(self, values: Floats) -> Floats:
        """The part of a signal, one value for each time, within the window."""
        return values[self.kept]


def _handle_signal(response: TimeResponse) -> tuple[Floats, Floats]:
    """Return times (k,) [s] and positions of the handle (k,) [m], between samples where these were kept.

    Of many points so few that they still make the same line.
    """
    if not response.trail.size:
        return response.time, response.handle
    skip = 1 if len(response.time) > LONGEST_LINE else -(-len(response.trail) // (BETWEEN * LONGEST_LINE))
    time = np.append(0.0, response.trail_time)[::skip]
    return time, np.append(response.handle[:1], response.trail)[::skip]


def draw_line(
    ax: Axes, time: Floats, values: Floats, colour: str, text: str, *, held: bool = False, dashes: Any = "-"
) -> None:
    """One signal over time [s].

    held  whether a value stays until the next one, as of a zero-order hold
    """
    how = "steps-post" if held else "default"
    ax.plot(time, values, color=colour, linestyle=dashes, label=text, drawstyle=how, linewidth=1.1)


def draw_envelope(
    ax: Axes, time: Floats, values: Floats, colour: str, text: str, *, held: bool = False, dashes: Any = "-"
) -> None:
    """The band that a signal with too many points for a line sweeps over; with dashes its two edges only.

    time, values  (k,);   held  makes no difference to a band: it is taken so that `draw_line` can be replaced
    """
    edges, low, high = binned_extremes(time, values)
    if dashes == "-":
        style: dict[str, Any] = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.6, "alpha": 0.55}
        ax.fill_between(edges, low, high, step="post", label=text, **style)
        return
    for edge, name in ((low, text), (high, "")):
        ax.plot(edges, edge, color=colour, linestyle=dashes, label=name, drawstyle="steps-post", linewidth=1.1)


def binned_extremes(time: Floats, values: Floats, bins: int = BINS) -> tuple[Floats, Floats, Floats]:
    """Cut a signal into bins of equal time; no value of it is lost.

    Returns  beginning of each bin [s], smallest and largest value in it, each (bins + 1,): the last entry is the
             end of the signal, with the extremes of the last bin

    Each bin has the last value of the one before, too, so that neighbours touch.
    """
    cut = np.linspace(0, len(values), bins + 1).astype(int)
    parts = [values[max(start - 1, 0) : stop] for start, stop in pairwise(cut)]
    low, high = np.array([part.min() for part in parts]), np.array([part.max() for part in parts])
    return np.append(time[cut[:-1]], time[-1]), np.append(low, low[-1]), np.append(high, high[-1])


def _draw_energies(ax: Axes, response: TimeResponse, run: _SamplesWithin, draw: Callable[..., None]) -> None:
    """Draw the stored energy and the largest entries of the energy ledger [J] over time.

    run   takes the part of a signal that is shown
    draw  `draw_line` or `draw_envelope`
    """
    draw(ax, run.time, run(response.stored), BLACK, "stored")
    size = np.abs(response.energies).max(axis=0)
    worth = [i for i in np.argsort(-size)[:LEDGER] if size[i] > WORTH * size.max()]
    for i, (colour, dashes) in zip(worth, LINES[1:], strict=False):
        draw(ax, run.time, run(response.energies[:, i]), colour, energy_label(SOURCES[i]), dashes=dashes)
    _across(ax, 0.0, "")


def _across(ax: Axes, height: float, text: str) -> None:
    """Draw a dotted line across the axes at a height, which the legend names by `text`."""
    ax.axhline(height, color=GREY, linewidth=0.7, linestyle=":", zorder=1.5, label=text)
