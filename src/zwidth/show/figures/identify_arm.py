"""Measured torques of a mechanism's joints beside those that its motion and the identified numbers predict."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.identification import Identification
from zwidth.show.figures.style import BLACK, LINES, draw_empty, label, legend_above

MEASURED: Final = "measured_"
PREDICTED: Final = "predicted_"
APART: Final = 1.15  # of the largest torque, between two joints' zero lines
SHOWN: Final = 1500  # samples: more would be a black band


def draw_arm(ax: Axes, identification: Identification) -> None:
    """The unseen part's torques, each joint above the one before, measured in black and predicted in colour.

    Each joint is drawn over its own largest torque; its scale is in the legend.
    """
    curves = identification.curves
    measured = [name for name in curves if name.startswith(MEASURED)]
    if not measured:
        draw_empty(ax, identification.reason or "nothing was fitted")
        return
    some = slice(0, SHOWN)
    time = np.asarray(curves["time_s"])[some]
    for k, name in enumerate(measured):
        quantity, _, drive = name.removeprefix(MEASURED).partition(".")
        unit = "N" if quantity == "force_N" else "Nm"
        torque = np.asarray(curves[name])[some]
        predicted = np.asarray(curves[name.replace(MEASURED, PREDICTED, 1)])[some]
        scale = float(np.max(np.abs(torque), initial=0.0)) or 1.0
        zero = -2.0 * APART * k
        colour, dashes = LINES[1 + k % (len(LINES) - 1)]
        ax.axhline(zero, color=BLACK, linewidth=0.4)
        ax.plot(time, zero + torque / scale, color=BLACK, linewidth=0.9, label="measured" if k == 0 else "")
        ax.plot(
            time,
            zero + predicted / scale,
            color=colour,
            linestyle=dashes,
            label=f"predicted, {drive} (to {scale:.3g} {unit})",
        )
    ax.set_yticks([-2.0 * APART * k for k in range(len(measured))])
    ax.set_yticklabels(["0"] * len(measured))
    label(ax.xaxis, "Time", "s")
    ax.set_ylabel("Torque over its largest")
    for text in identification.left_out[:1]:
        ax.text(0.01, 0.01, text.partition(":")[0], transform=ax.transAxes, fontsize=6.5)
    legend_above(ax, columns=2)
