"""Which model where: how far each simpler model is off, along the edge by frequency."""

from __future__ import annotations

from math import isfinite

import numpy as np
from matplotlib.axes import Axes

from zwidth.show.figures.style import GREY, LINES, legend_above
from zwidth.show.units import MINUS, quantity
from zwidth.study.validity import Validity


def draw_validity(ax: Axes, found: Validity) -> None:
    """Error of each model against the frequency at which the walls fail, both axes logarithmic.

    The shaded band is the tolerance. Lines stop where the edge has no wall that fails at this frequency.
    """
    # the first colour is the device as described, elsewhere in a report
    for fit, (colour, dashes) in zip(
        (fit for fit in found.fits if len(fit.error)), LINES[1:] + LINES[:1], strict=False
    ):
        frequency, error = _broken(fit.frequency, 100.0 * np.clip(fit.error, 1e-4, 10.0), found.arc)
        ax.plot(frequency, error, color=colour, linestyle=dashes, label=fit.label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    percent = 100.0 * found.tolerance
    ax.axhspan(0.01, percent, color="#EFEFEF", zorder=0.5, label=f"within {percent:g} %")
    if isfinite(found.first_natural):
        text = f"first natural frequency: {quantity(found.first_natural, 'Hz')}"
        ax.axvline(found.first_natural, color=GREY, linestyle=(0, (6, 3)), linewidth=0.8, label=text)
    if len(found.frequency):
        ax.set_xlim(found.frequency[0], max(found.frequency[-1], 1.05 * np.nan_to_num(found.first_natural)))
    ax.set_ylim(0.01, 1000.0)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(lambda x, _: f"{x:g}".replace("-", MINUS))
        axis.set_minor_formatter(lambda *_: "")
    ax.set_xlabel("Frequency at which the wall fails [Hz]")
    ax.set_ylabel("Error of the model [%]")
    legend_above(ax, columns=2)


def _broken(x: np.ndarray, y: np.ndarray, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both with a gap wherever the piece of edge changes."""
    at = np.flatnonzero(np.diff(arc)) + 1
    return np.insert(x, at, np.nan), np.insert(y, at, np.nan)
