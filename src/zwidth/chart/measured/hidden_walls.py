"""Walls that a device renders by its response as measured, where the error of the measurement hides them."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.errors import ResponseError

TRIED: Final = 0.5  # share of the largest stiffness at which the error is looked at: well within the stable walls


def hidden_walls(chart: MeasuredChart) -> str:
    """What a chart without any certain wall would have without errors, and where these are too large; "" where no
    wall is stable by the response as it was measured either, or no error is known.

    Where: the frequency that leaves the wall of half the largest stiffness most in doubt.
    """
    doubt = chart.in_doubt
    if doubt is None:
        return ""
    response, controller = chart.loop.response, chart.loop.controller
    try:
        measured = measured_chart(replace(response, coherence=None, sweeps=None), controller)
    except ResponseError:
        return ""
    if not np.isfinite(measured.stiffness_max):
        return ""
    near, theta = doubt.clearance(TRIED * measured.stiffness_max, measured.damping_at_stiffness_max)
    frequency = theta[int(np.argmin(near))] / (2.0 * np.pi * chart.loop.period)
    return (
        f"as measured, walls up to {measured.stiffness_max:.4g} N/m would be stable, but the error is too large, "
        f"most of all at {frequency:.4g} Hz"
    )
