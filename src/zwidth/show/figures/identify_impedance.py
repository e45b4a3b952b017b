"""The measured impedance at the handle with its band, beside the predicted one."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.identification import Identification
from zwidth.show.figures.style import BLACK, BLUE, VERMILION, draw_empty, legend_above, number_logarithmic

STATE_STYLES = (("on", BLUE, "wall on"), ("off", VERMILION, "wall off"))
FLOOR = 1e-3  # share of the magnitude below which the band's lower end is not drawn


def draw_impedance(ax: Axes, identification: Identification) -> None:
    """Magnitudes over frequency, both axes logarithmic: measured with bands, predicted in black."""
    if not identification.curves:
        draw_empty(ax, identification.reason or "nothing was measured")
        return
    columns = {name: np.array(values) for name, values in identification.curves.items()}
    for state, colour, title in STATE_STYLES:
        some = columns["wall"] == state
        if not some.any():
            continue
        f = columns["frequency_Hz"][some]
        size = np.hypot(columns["impedance_real_Ns_per_m"][some], columns["impedance_imag_Ns_per_m"][some])
        low = np.maximum(columns["impedance_low_Ns_per_m"][some], FLOOR * size)
        ax.fill_between(f, low, columns["impedance_high_Ns_per_m"][some], color=colour, alpha=0.25, linewidth=0.0)
        ax.loglog(f, size, color=colour, label=f"measured, {title}, with its band (95 % each)")
        predicted = np.hypot(columns["predicted_real_Ns_per_m"][some], columns["predicted_imag_Ns_per_m"][some])
        if np.isfinite(predicted).any():
            dashes = "-" if state == "off" else (0, (5, 1.5))
            ax.loglog(f, predicted, color=BLACK, linestyle=dashes, linewidth=0.9, label=f"predicted, {title}")
    f = columns["frequency_Hz"]
    ax.set_xlim(float(np.min(f)), float(np.max(f)))
    number_logarithmic(ax.xaxis, *ax.get_xlim())
    number_logarithmic(ax.yaxis, *ax.get_ylim())
    ax.set_xlabel("Frequency [Hz]")
    ax.set_ylabel("Impedance, magnitude [Ns/m]")
    legend_above(ax, columns=2)
