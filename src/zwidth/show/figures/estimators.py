"""Velocity estimators over frequency: what they make of a true velocity, and how late."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.axes import Axes

from zwidth.arrays import Floats
from zwidth.loop.estimators import VelocityMethod
from zwidth.loop.estimators.frequency_response import phase_delay, relative_response
from zwidth.show.figures.style import GREY, LINES, label, legend_above

# One line more than other figures have: so many methods are compared at once.
STYLES = (*LINES, (GREY, "-"))
LOWEST = 2e-3  # of the frequencies drawn, as a share of half the sampling rate


def draw_gain(ax: Axes, methods: Mapping[str, VelocityMethod], period: float) -> None:
    """Gain of each estimate against the true velocity, over frequency up to half the sampling rate.

    methods  label -> method
    period   T [s]
    """

    def gain(method: VelocityMethod, frequency: Floats) -> Floats:
        return np.asarray(np.abs(relative_response(method, period, frequency)))

    _draw_methods(ax, methods, period, gain)
    ax.set_ylabel("Estimated per true velocity")


def draw_phase_delay(ax: Axes, methods: Mapping[str, VelocityMethod], period: float) -> None:
    """Phase delay of each estimate, over frequency up to half the sampling rate.

    methods  label -> method
    period   T [s]
    """
    _draw_methods(ax, methods, period, lambda method, frequency: phase_delay(method, period, frequency))
    label(ax.yaxis, "Phase delay", "s")


def _draw_methods(
    ax: Axes,
    methods: Mapping[str, VelocityMethod],
    period: float,
    value: Callable[[VelocityMethod, Floats], Floats],
) -> None:
    """Draw a line for each method over frequency [Hz]; those named first lie on top.

    value  of a method at frequencies (k,): what is drawn (k,)
    """
    nyquist = 0.5 / period
    # even steps along the logarithmic axis, and a linear share for the lobes of long windows
    frequency = np.union1d(nyquist * np.geomspace(LOWEST, 1.0, 400), nyquist * np.linspace(LOWEST, 1.0, 800))
    for n, (name, method) in enumerate(methods.items()):
        colour, dashes = STYLES[n % len(STYLES)]
        drawn = value(method, frequency)
        ax.plot(frequency, drawn, color=colour, linestyle=dashes, label=name, zorder=4.0 - 0.1 * n)
    ax.set_xscale("log")
    ax.set_xlim(frequency[0], nyquist)
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    label(ax.xaxis, "Frequency", "Hz", plain=True)
    legend_above(ax, columns=2)
