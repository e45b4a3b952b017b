"""The response that modes were identified from, and the fitted one."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from zwidth.show.figures.style import BLUE, GREY, VERMILION, draw_empty, legend_above, number_logarithmic

GOOD = 0.6  # coherence above which a point is drawn full


def draw_modes(ax: Axes, identification: Any) -> None:
    """Magnitude of the measured response over frequency, paler where the coherence is low or the response is not
    used, the fitted one, and the natural frequencies; both axes logarithmic."""
    curves = identification.curves
    if not curves:
        draw_empty(ax, "nothing was fitted")
        return
    f, coherence = np.array(curves["frequency_Hz"]), np.array(curves["coherence"])
    measured = np.hypot(curves["measured_real"], curves["measured_imag"])
    fitted = np.hypot(curves["fitted_real"], curves["fitted_imag"])
    good = (coherence > GOOD) & np.array(curves["used"])
    for chosen, colour, text in (
        (good, BLUE, "measured"),
        (~good, GREY, f"measured, coherence below {GOOD:g} or not used"),
    ):
        if np.any(chosen & (measured > 0.0)):
            ax.loglog(f[chosen], measured[chosen], ".", markersize=2.5, color=colour, label=text)
    ax.loglog(f, fitted, color=VERMILION, label="fitted")
    for number, one in enumerate(e for e in identification.estimates if e.name.startswith("natural frequency")):
        if f[0] <= one.value <= f[-1]:
            name = "" if number else "natural frequencies"
            ax.axvline(one.value, color=GREY, linewidth=0.6, linestyle=(0, (4, 2)), zorder=1.5, label=name)
    ax.set_xlim(f[0], f[-1])
    number_logarithmic(ax.xaxis, *ax.get_xlim())
    ax.set_xlabel("Frequency [Hz]")
    unit = "rad/(N m)" if identification.details.get("turns") else "m/N"
    ax.set_ylabel(f"Response from command to reading [{unit}]")
    legend_above(ax, columns=2)
