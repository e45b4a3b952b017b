"""Torque over angle of a drive's transmission, measured and fitted."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.identification import Identification
from zwidth.show.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION, label, legend_above

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE)


def draw_stiffness(ax: Axes, result: Identification) -> None:
    """Averages of the strokes as marks, hollow where they were not fitted, and the fitted spring as a line."""
    curves = {name: np.asarray(values) for name, values in result.curves.items()}
    drives = list(dict.fromkeys(curves["drive"].tolist()))
    for number, drive in enumerate(drives):
        mine = curves["drive"] == drive
        name = f"{drive}, " if len(drives) > 1 else ""
        colour = COLOURS[number % len(COLOURS)] if len(drives) > 1 else BLUE
        for fitted, word in ((1.0, "fitted"), (0.0, "predicted")):
            here = mine & (curves["fitted"] == fitted)
            ax.scatter(
                curves["angle_rad"][here],
                curves["torque_Nm"][here],
                s=9.0,
                facecolors=colour if fitted else "none",
                edgecolors=colour,
                linewidths=0.6,
                label=f"{name}measured, {word}",
            )
        _draw_spring(ax, curves, mine, "fitted spring and friction" if number == 0 else "")
    ax.axhline(0.0, color=GREY, linewidth=0.6)
    ax.axvline(0.0, color=GREY, linewidth=0.6)
    label(ax.xaxis, "Angle at the motor's shaft", "rad")
    label(ax.yaxis, "Torque", "Nm")
    legend_above(ax, columns=3)


def _draw_spring(ax: Axes, curves: dict[str, np.ndarray], mine: np.ndarray, text: str) -> None:
    """The fitted torque along each stroke."""
    turns = np.flatnonzero(np.diff(curves["motion"][mine])) + 1
    angle, torque = curves["angle_rad"][mine], curves["fitted_torque_Nm"][mine]
    for number, (first, behind) in enumerate(pairwise([0, *turns.tolist(), len(angle)])):
        ax.plot(
            angle[first:behind], torque[first:behind], color=BLACK, linewidth=0.9, label="" if number else text
        )
