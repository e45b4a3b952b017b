"""Limit cycles over amplitude, and the friction-quantisation plane with a device on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from zwidth.arrays import Floats
from zwidth.contact.friction_quantisation_plane import DevicePlane
from zwidth.contact.harmonic_balance import HarmonicBalance, LimitCycle
from zwidth.contact.wall_limit_cycles import LimitCycleAnswer, LimitCyclePrediction
from zwidth.show.figures.style import BLACK, BLUE, GREY, STABLE, VERMILION, legend_above, number_logarithmic
from zwidth.show.units import as_written, quantity

AROUND = 10.0  # times, below the smallest limit cycle and above the largest, that is drawn
BEYOND = 2.0  # times the range of the device that is drawn
RESOLVED = 1e-3  # of the largest growth, below which the axis is linear
LINEAR = 0.03  # of the largest growth: where half of the others are smaller, the axis is logarithmic


def draw_limit_cycles(ax: Axes, prediction: LimitCyclePrediction) -> None:
    """The growth of vibrations, with the limit cycles that are the answer: a square where it is a simulated
    one."""
    draw_balance(ax, prediction.balance, prediction.answers, prediction.contradicted)


def draw_balance(
    ax: Axes,
    balance: HarmonicBalance,
    answers: Sequence[LimitCycleAnswer] | None = None,
    contradicted: Sequence[LimitCycleAnswer] = (),
) -> None:
    """How fast vibrations grow or die over their amplitude; limit cycles where the line crosses zero.

    A full dot is a stable limit cycle, a hollow one an unstable one, a square a simulated one, and a cross what is
    predicted and simulated otherwise; grey is what lies beyond the range of the device, and is drawn as far as
    twice that. Growth rates that differ much have an axis that is logarithmic on both sides of zero.

    answers       the limit cycles that are drawn; None: those of the balance
    contradicted  predicted ones that no simulation has
    """
    if answers is None:
        answers = [LimitCycleAnswer(cycle, "describing function", None, None, cycle) for cycle in balance.cycles]
    cycles = [answer.cycle for answer in answers]
    growth = np.where(np.isfinite(balance.growth), balance.growth, np.nan)
    ax.semilogx(balance.amplitude, growth, color=BLACK, label="growth of a vibration, predicted")
    ax.axhline(0.0, color=GREY, linewidth=0.6)
    for answer in answers:
        cycle, simulated = answer.cycle, answer.source == "simulation"
        kind = f"{'stable' if cycle.stable else 'unstable'} limit cycle{', simulated' if simulated else ''}"
        kind, color = (kind, VERMILION) if cycle.within_range else ("predicted beyond the range", GREY)
        _mark_cycle(ax, cycle, kind, "s" if simulated else "o", color)
    replaced = [one.predicted for one in answers if one.source == "simulation" and one.predicted is not None]
    for cycle in (*replaced, *(one.cycle for one in contradicted)):
        _mark_cycle(ax, cycle, "predicted, but simulated otherwise", "x", BLACK)
    ax.set_ylabel("Growth rate [1/s]")
    low, high = _amplitude_range(balance, cycles)
    ax.set_xlim(low, high)
    number_logarithmic(ax.xaxis, low, high, "m")
    ax.set_xlabel("Amplitude")
    if balance.largest_motion < high:
        text = f"farther than the device moves, {quantity(balance.largest_motion, 'm')}"
        ax.axvspan(max(low, balance.largest_motion), high, color=GREY, alpha=0.2, linewidth=0.0, label=text)
    visible = growth[(balance.amplitude >= low) & (balance.amplitude <= high) & np.isfinite(growth)]
    _scale_growth(ax, visible, crossings=bool(cycles))
    if not cycles:
        ax.plot([], [], linestyle="none", label="no limit cycle")
    legend_above(ax)


def _mark_cycle(ax: Axes, cycle: LimitCycle, kind: str, marker: str, color: str) -> None:
    """Draw a mark at the amplitude of a limit cycle on the line of no growth, full where it is stable.

    kind  of limit cycle, in words of the legend, where its amplitude and frequency follow
    """
    ax.plot(
        cycle.amplitude,
        0.0,
        marker,
        markerfacecolor=color if cycle.stable else "white",
        markeredgecolor=color,
        linestyle="none",
        label=f"{kind}: {quantity(cycle.amplitude, 'm')}, {quantity(cycle.frequency_Hz, 'Hz')}",
        zorder=3.0,
    )


def _scale_growth(ax: Axes, visible: Floats, *, crossings: bool) -> None:
    """Scale the axis of growth: linear where the rates in view differ little, else symmetrically logarithmic.

    visible    (k,) growth rates in view [1/s]
    crossings  whether the line crosses zero, near which the rates are small
    """
    sizes = np.abs(visible)
    largest = float(np.max(sizes, initial=0.0)) or 1.0
    grows, dies = float(np.max(visible, initial=0.0)), float(np.min(visible, initial=0.0))
    if crossings or (len(sizes) and float(np.median(sizes)) < LINEAR * largest):
        linear = 10.0 ** np.ceil(np.log10(RESOLVED * largest))
        ax.set_yscale("symlog", linthresh=linear)
        ax.set_ylim(1.6 * dies or -linear, 1.6 * grows or linear)
    else:
        ax.set_ylim(min(1.1 * dies, -0.1 * largest), max(1.1 * grows, 0.1 * largest))
    ax.yaxis.set_major_formatter(lambda value, _: as_written(float(f"{value:.6g}")))


def _amplitude_range(balance: HarmonicBalance, cycles: Sequence[LimitCycle]) -> tuple[float, float]:
    """Smallest and largest amplitude that are drawn [m].

    Those with a growth rate, as far as AROUND times from the limit cycles within range, and up to BEYOND times the
    range, unless little would be left.
    """
    amplitude, farthest = balance.amplitude, BEYOND * balance.largest_motion
    amplitudes = [cycle.amplitude for cycle in cycles if cycle.within_range]
    swings = amplitude[np.isfinite(balance.growth)]
    low, high = (
        (float(swings[0]), float(swings[-1])) if len(swings) > 1 else (float(amplitude[0]), float(amplitude[-1]))
    )
    if amplitudes:
        low, high = max(low, min(amplitudes) / AROUND), min(high, AROUND * max(amplitudes))
    return (low, min(high, farthest)) if farthest > 2.0 * low else (low, high)


def draw_plane(ax: Axes, device: DevicePlane) -> None:
    """The device's ray over wall stiffness, in the regions of viscous and dry friction, both axes logarithmic."""
    # passive above and to the right of the corner: beta >= delay + 1/2 and sigma >= 1/2
    corner = device.delay + 0.5
    x, y = device.beta, device.sigma
    points = np.concatenate([x[x > 0.0], [corner]]), np.concatenate([y[y > 0.0], [0.5]])
    (left, right), (low, high) = (
        (float(coordinates.min()) / 3.0, float(coordinates.max()) * 3.0) for coordinates in points
    )
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.fill_between([corner, right], 0.5, high, color=STABLE, linewidth=0.0)
    ax.axvline(corner, color=BLACK, linewidth=0.8)
    ax.axhline(0.5, color=BLACK, linewidth=0.8)
    _name_regions(ax)
    # a device without one of the frictions lies at the border of the figure
    places_in_view = np.maximum(x, left), np.maximum(y, low)
    lacking = " and ".join(word for word, part in (("viscous", x), ("dry", y)) if not np.all(part > 0.0))
    text = f"the device has no {lacking} friction: at the border" if lacking else "the device, by wall stiffness"
    ax.plot(*places_in_view, color=BLUE, marker="o", markersize=4.0, label=text, clip_on=False)
    _label_walls(ax, device.wall_stiffness, places_in_view, left, corner)
    ax.set_xlim(left, right)
    ax.set_ylim(low, high)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, position: f"{value:g}")
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("Viscous friction b/(K T)")
    ax.set_ylabel("Dry friction $f_c$/(K Δ)")
    legend_above(ax)


def _name_regions(ax: Axes) -> None:
    """Write into each region of the plane which vibrations it has."""
    places = {
        "passive": (0.97, 0.96, "right", "top"),
        "large vibrations": (0.03, 0.96, "left", "top"),
        "small vibrations": (0.97, 0.04, "right", "bottom"),
        "small and\nlarge vibrations": (0.03, 0.04, "left", "bottom"),
    }
    for text, (across, up, side, height) in places.items():
        ax.text(across, up, text, transform=ax.transAxes, ha=side, va=height, fontsize=8.0, color=GREY)


def _label_walls(
    ax: Axes, wall_stiffness: Floats, places_in_view: tuple[Floats, Floats], left: float, corner: float
) -> None:
    """Write the stiffness [N/m] beside each place of the ray; of a place with several walls the range.

    wall_stiffness  (n,) of the walls [N/m]
    places_in_view  viscous and dry friction (n,) of the walls, as drawn
    left, corner    viscous friction between which a label stands to the left of its place
    """
    places_of_walls: dict[tuple[float, float], list[float]] = {}
    for K, across, up in zip(wall_stiffness, *map(np.ndarray.tolist, places_in_view), strict=True):
        places_of_walls.setdefault((across, up), []).append(float(K))
    for (across, up), walls in places_of_walls.items():
        before = left < across < corner  # its label keeps off the corner's line
        several = f"{quantity(min(walls), 'N/m')} to {quantity(max(walls), 'N/m')}"  # without either friction
        ax.annotate(
            quantity(walls[0], "N/m") if len(walls) == 1 else several,
            (across, up),
            xytext=(-5, 3) if before else (5, -3),
            ha="right" if before else "left",
            textcoords="offset points",
            fontsize=7.0,
        )
