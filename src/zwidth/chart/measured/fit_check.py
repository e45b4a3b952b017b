"""How far a fitted plant stands for a measured device: its misfit, and its largest stiffness beside the data's."""

from __future__ import annotations

from math import isnan, nan
from typing import Any, Final

from zwidth.chart.chart import largest_stiffness
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.response import ResponseError

FURTHEST: Final = 2.0  # ratio of both largest stiffnesses, beyond which the plant does not stand for the device


def modelled_point(point: OperatingPoint) -> OperatingPoint:
    """The operating point with a plant fitted to its measured response in its place; any other point itself.

    A plant may come close to the response at every frequency that was measured, and have other stable walls all
    the same: where the response is none of a sampled device, or ends too soon.

    Raises  what `OperatingPoint.modelled` and `chart.point_chart.chart_at` raise
            ResponseError  where the plant's largest stiffness is beyond half to twice that of the response
    """
    if point.response is None:
        return point
    document = fit_document(point)
    both = [document[key] for key in ("stiffness_max_N_per_m", "stiffness_max_of_response_N_per_m")]
    by_fit, by_data = both
    if not (by_data / FURTHEST <= by_fit <= by_data * FURTHEST or all(map(isnan, both))):
        fitted, measured = ("none" if isnan(K) else f"{K:.4g} N/m" for K in both)
        raise ResponseError(
            f"is not explained by masses, springs, dampers and a delay: the best plant misses it by "
            f"{100.0 * document['misfit']:.3g} %, but its largest stiffness is {fitted}, by the response itself "
            f"{measured}; sweep from the force command to the encoder at the loop's own samples, up to half the "
            "sampling rate, or describe the device as a [plant]"
        )
    return point.modelled


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
