"""Which model where: how far each simpler model is off, along the edge by frequency."""

from __future__ import annotations

from math import isfinite

import numpy as np
from matplotlib.axes import Axes

from zwidth.show.figures.style import GREY, LINES, legend_above, number_logarithmic
from zwidth.show.units import quantity
from zwidth.study.validity import Validity


def draw_validity(ax: Axes, validity: Validity) -> None:
    """Error of each model against the frequency at which the walls fail, both axes logarithmic.

    The shaded band is the tolerance. Lines stop where the edge has no wall that fails at this frequency.
    """
    # the first colour is the device as described, elsewhere in a report
    for fit, (colour, dashes) in zip(
        (fit for fit in validity.fits if len(fit.error)), LINES[1:] + LINES[:1], strict=False
    ):
        frequency, error = _with_gaps(fit.frequency, 100.0 * np.clip(fit.error, 1e-4, 10.0), validity.arc)
        ax.plot(frequency, error, color=colour, linestyle=dashes, label=fit.label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    percent = 100.0 * validity.tolerance
    ax.axhspan(0.01, percent, color="#EFEFEF", zorder=0.5, label=f"within {percent:g} %")
    if isfinite(validity.first_natural):
        text = f"first natural frequency: {quantity(validity.first_natural, 'Hz')}"
        ax.axvline(validity.first_natural, color=GREY, linestyle=(0, (6, 3)), linewidth=0.8, label=text)
    if len(validity.frequency):
        ax.set_xlim(
            validity.frequency[0], max(validity.frequency[-1], 1.05 * np.nan_to_num(validity.first_natural))
        )
    ax.set_ylim(0.01, 1000.0)
    number_logarithmic(ax.xaxis, *ax.get_xlim())
    number_logarithmic(ax.yaxis, *ax.get_ylim())
    ax.set_xlabel("Frequency at which the wall fails [Hz]")
    ax.set_ylabel("Error of the model [%]")
    legend_above(ax, columns=2)


def _with_gaps(x: np.ndarray, y: np.ndarray, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both with a gap wherever the piece of edge changes."""
    at = np.flatnonzero(np.diff(arc)) + 1
    return np.insert(x, at, np.nan), np.insert(y, at, np.nan)
