"""Friction of a joint over its velocity, as measured and as fitted, and how the unseen motion was predicted."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.joint.friction import JointIdentification
from zwidth.show.figures.style import BLACK, BLUE, GREY, VERMILION, label, legend_above
from zwidth.show.units import quantity

INSET: Final = (0.6, 0.1, 0.38, 0.3)  # of the predicted motion, where friction has no points: backward is below
MOST_POINTS: Final = 1500  # drawn of the measured friction
WIDEST: Final = 1.08  # times the largest velocity, to which the fitted lines run
SHOWN_SAMPLES: Final = 600  # samples of the unseen motion


def draw_friction(ax: Axes, identification: JointIdentification) -> None:
    """Measured friction in segments of the motion, the fitted levels and slopes, and in an inset unseen motion."""
    angular = identification.angular
    velocity, friction = identification.velocity, identification.friction
    every = max(len(velocity) // MOST_POINTS, 1)
    ax.plot(
        velocity[::every],
        friction[::every],
        ".",
        color=GREY,
        markersize=2.5,
        alpha=0.5,
        label="measured: force less inertia",
        zorder=1.5,
    )
    free = identification.details.get("force") is None
    reach = WIDEST * float(np.max(np.abs(velocity), initial=0.0)) or 1.0
    for (level, slope), side, colour, name in (
        (identification.lines[0], 1.0, VERMILION, "forward"),
        (identification.lines[1], -1.0, BLUE, "backward"),
    ):
        if np.isfinite(level):
            ends = np.array([0.0, side * reach])
            ax.plot(ends, side * level + slope * ends, color=colour, linewidth=1.6, label=f"fitted {name}")
    ax.axhline(0.0, color=BLACK, linewidth=0.6, zorder=1.0)
    ax.axvline(0.0, color=BLACK, linewidth=0.6, zorder=1.0)
    label(ax.xaxis, "Velocity", "rad/s" if angular else "m/s")
    if free:
        label(ax.yaxis, "Friction over mass", "rad/s^2" if angular else "m/s^2", plain=True)
    else:
        label(ax.yaxis, "Friction", "N m" if angular else "N")
    _draw_motion(ax, identification)
    legend_above(ax, columns=3)


def _draw_motion(ax: Axes, identification: JointIdentification) -> None:
    """The first window that was not fitted, measured and predicted, in an inset."""
    names = (
        ("angle_rad", "angle_predicted_rad") if identification.angular else ("position_m", "position_predicted_m")
    )
    time, measured, predicted = (np.asarray(identification.curves[name]) for name in ("time_s", *names))
    steps = np.diff(time)
    breaks = np.flatnonzero((steps > 1.5 * np.median(steps)) | (steps <= 0.0))
    end = min(int(breaks[0]) + 1 if len(breaks) else len(time), SHOWN_SAMPLES)
    inset = ax.inset_axes(INSET, zorder=5.0)
    inset.plot(time[:end], measured[:end], color=GREY, linewidth=2.2, label="measured")
    inset.plot(time[:end], predicted[:end], color=BLACK, linewidth=0.8, label="predicted")
    inset.tick_params(labelsize=6.5, length=2.0, pad=1.5)
    inset.locator_params(nbins=3)
    label(inset.xaxis, "Time", "s")
    label(inset.yaxis, "Angle" if identification.angular else "Position", "rad" if identification.angular else "m")
    for axis in (inset.xaxis, inset.yaxis):
        axis.label.set_fontsize(6.5)
        axis.labelpad = 1.0
    share = f"{100.0 * identification.validation:.4g}"
    inset.set_title(
        f"unseen {quantity(float(time[end - 1] - time[0]), 's')}: {share} % predicted", fontsize=6.5, pad=2.0
    )
