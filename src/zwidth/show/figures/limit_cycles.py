"""Limit cycles over amplitude, and the friction-quantisation plane with a device on it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from zwidth.contact.limit_cycles import HarmonicBalance
from zwidth.contact.plane import DevicePlane
from zwidth.show.figures.style import BLACK, BLUE, GREY, STABLE, VERMILION, legend_above
from zwidth.show.units import quantity

AROUND = 100.0  # times, below the smallest limit cycle and above the largest, that is drawn
BEYOND = 3.0  # times, above the range and above a limit cycle beyond it
RESOLVED = 1e-3  # of the largest growth, below which the axis is linear


def draw_balance(ax: Axes, balance: HarmonicBalance) -> None:
    """How fast vibrations grow or die over their amplitude; limit cycles where the line crosses zero.

    A full dot is a stable limit cycle, a hollow one the edge of what is recovered from; grey is what lies beyond
    the range of the device. The growth has a logarithmic axis on both sides of zero.
    """
    growth = np.where(np.isfinite(balance.growth), balance.growth, np.nan)
    ax.semilogx(balance.amplitude, growth, color=BLACK, label="growth of a vibration")
    ax.axhline(0.0, color=GREY, linewidth=0.6)
    for cycle in balance.cycles:
        kind = "stable limit cycle" if cycle.stable else "larger ones grow, smaller ones die"
        kind, color = (kind, VERMILION) if cycle.within_range else ("beyond the range", GREY)
        ax.plot(
            cycle.amplitude,
            0.0,
            "o",
            markerfacecolor=color if cycle.stable else "white",
            markeredgecolor=color,
            linestyle="none",
            label=f"{kind}: {quantity(cycle.amplitude, 'm')}, {quantity(cycle.frequency_Hz, 'Hz')}",
        )
    ax.set_xlabel("Amplitude [m]")
    ax.set_ylabel("Growth rate [1/s]")
    low, high = _around(balance)
    ax.set_xlim(low, high)
    if balance.largest_motion < high:
        text = f"farther than the device moves, {quantity(balance.largest_motion, 'm')}"
        ax.axvspan(max(low, balance.largest_motion), high, color=GREY, alpha=0.2, linewidth=0.0, label=text)
    seen = growth[(balance.amplitude >= low) & (balance.amplitude <= high) & np.isfinite(growth)]
    largest = float(np.max(np.abs(seen), initial=0.0)) or 1.0
    linear = 10.0 ** np.ceil(np.log10(RESOLVED * largest))
    ax.set_yscale("symlog", linthresh=linear)
    grows, dies = np.max(seen, initial=0.0), np.min(seen, initial=0.0)
    ax.set_ylim(1.5 * dies or -linear, 1.5 * grows or linear)
    if not balance.cycles:
        ax.plot([], [], linestyle="none", label="no limit cycle")
    legend_above(ax)


def _around(balance: HarmonicBalance) -> tuple[float, float]:
    """Amplitudes that are drawn."""
    at = balance.amplitude
    if not balance.cycles:
        swings = at[np.isfinite(balance.growth)]
        return (float(swings[0]), float(swings[-1])) if len(swings) > 1 else (float(at[0]), float(at[-1]))
    found = [cycle.amplitude for cycle in balance.cycles]
    most = max(BEYOND * max(found), min(AROUND * max(found), BEYOND * balance.largest_motion))
    return max(float(at[0]), min(found) / AROUND), min(float(at[-1]), most)


def draw_plane(ax: Axes, device: DevicePlane) -> None:
    """The device's ray over wall stiffness, in the regions of viscous and dry friction, both axes logarithmic."""
    corner = device.delay + 0.5
    x, y = device.beta, device.sigma
    points = np.concatenate([x[x > 0.0], [corner]]), np.concatenate([y[y > 0.0], [0.5]])
    (left, right), (low, high) = ((float(p.min()) / 3.0, float(p.max()) * 3.0) for p in points)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.fill_between([corner, right], 0.5, high, color=STABLE, linewidth=0.0)
    ax.axvline(corner, color=BLACK, linewidth=0.8)
    ax.axhline(0.5, color=BLACK, linewidth=0.8)
    places = {
        "passive": (0.97, 0.96, "right", "top"),
        "large vibrations": (0.03, 0.96, "left", "top"),
        "small vibrations": (0.97, 0.04, "right", "bottom"),
        "small and\nlarge vibrations": (0.03, 0.04, "left", "bottom"),
    }
    for text, (across, up, side, height) in places.items():
        ax.text(across, up, text, transform=ax.transAxes, ha=side, va=height, fontsize=8.0, color=GREY)
    # a device without one of the frictions lies at the border of the figure
    seen = np.maximum(x, left), np.maximum(y, low)
    lacking = " and ".join(word for word, part in (("viscous", x), ("dry", y)) if not np.all(part > 0.0))
    text = f"the device has no {lacking} friction: at the border" if lacking else "the device, by wall stiffness"
    ax.plot(*seen, color=BLUE, marker="o", markersize=4.0, label=text, clip_on=False)
    for K, across, up in zip(device.wall_stiffness, *seen, strict=True):
        before = left < across < corner  # its label keeps off the corner's line
        ax.annotate(
            quantity(float(K), "N/m"),
            (across, up),
            xytext=(-5, 3) if before else (5, -3),
            ha="right" if before else "left",
            textcoords="offset points",
            fontsize=7.0,
        )
    ax.set_xlim(left, right)
    ax.set_ylim(low, high)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, position: f"{value:g}")
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("Viscous friction b/(K T)")
    ax.set_ylabel("Dry friction $f_c$/(K Δ)")
    legend_above(ax)
