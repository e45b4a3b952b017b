"""A response from raw sweeps: magnitude over frequency, with the 95 % error by its coherence."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.identification import Identification
from zwidth.model.response import relative_error
from zwidth.show.figures.style import BLUE, GREY, LINES, VERMILION, legend_above, number_logarithmic

DISK = float(np.sqrt(-2.0 * np.log(0.05)))  # deviations that hold 95 % of a circular error


def draw_response(ax: Axes, identification: Identification) -> None:
    """|P| of each sweep with its error at each frequency, and where it cannot be relied on."""
    curves = {name: np.asarray(values) for name, values in identification.curves.items()}
    sweep = curves.get("sweep", np.ones(len(curves["frequency_Hz"])))
    averages = float(identification.details["averages"])
    marked = False
    for number, one in enumerate(np.unique(sweep)):
        mine = sweep == one
        f = curves["frequency_Hz"][mine]
        P = np.hypot(curves["real_m_per_N"][mine], curves["imag_m_per_N"][mine])
        coherence = curves["coherence"][mine]
        error = np.minimum(DISK * relative_error(np.maximum(coherence, 1e-6), averages), 0.9)
        colour, dashes = LINES[number % len(LINES)]
        name = f"sweep {one:g}" if len(np.unique(sweep)) > 1 else "|P|"
        if number == 0:
            ax.fill_between(
                f,
                P * (1 - error),
                P * (1 + error),
                color=BLUE,
                alpha=0.25,
                linewidth=0,
                label="95 % at each frequency",
            )
        ax.plot(f, P, color=colour, linestyle=dashes, linewidth=1.1, label=name)
        poor = coherence < 0.5
        if poor.any():
            text = "" if marked else "not coherent"
            marked = True
            ax.plot(f[poor], P[poor], color=VERMILION, marker="x", markersize=3.0, linestyle="none", label=text)
    ax.set_xscale("log")
    ax.set_yscale("log")
    number_logarithmic(ax.xaxis, float(np.min(curves["frequency_Hz"])), float(np.max(curves["frequency_Hz"])))
    ax.set_xlabel("Frequency [Hz]")
    ax.set_ylabel("Position over force [m/N]")
    ax.grid(color=GREY, alpha=0.2, linewidth=0.5)
    legend_above(ax, columns=3)
