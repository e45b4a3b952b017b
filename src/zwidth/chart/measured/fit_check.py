"""How far a fitted plant stands for a measured device: its misfit, and its largest stiffness beside the data's."""

from __future__ import annotations

from math import nan
from typing import Any

from zwidth.chart.chart import largest_stiffness
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.loop.operating_point import OperatingPoint


def fit_document(point: OperatingPoint) -> dict[str, Any]:
    """The fit of a measured device at an operating point, by key and unit; largest stiffness of both [N/m],
    of the response nominal.

    Raises  what `OperatingPoint.modelled` and `chart.point_chart.chart_at` raise
    """
    modelled, chart = point.modelled, point.chart(decay=False)
    assert modelled.fit is not None
    assert isinstance(chart, MeasuredChart)
    peak = largest_stiffness(modelled.loop)
    return modelled.fit.document() | {
        "stiffness_max_N_per_m": nan if peak is None else peak.stiffness,
        "stiffness_max_of_response_N_per_m": chart.stiffness_max_nominal,
    }
