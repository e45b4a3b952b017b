"""The catalogue's measure of the vibration that friction, encoder steps or limits keep up at a wanted wall."""

from __future__ import annotations

import numpy as np

from zwidth.contact.predict_limit_cycles import (
    NothingNonlinearError,
    amplitude_dependent,
    predict_limit_cycles,
    settles,
)
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.unsupported_feedback import FeedbackError
from zwidth.measures.bindings.preconditions import wall_of
from zwidth.measures.definition import MeasureError, NoValueError, WantedWall
from zwidth.measures.deformation import deformation_ratio
from zwidth.measures.vibration_threshold import detection_threshold

BETWEEN_COUNTS = 0.5  # of an encoder's step: the worst place that a constant push can choose


def buzz(point: OperatingPoint, wanted: WantedWall) -> float:
    """Amplitude of the largest vibration that remains at the wanted wall, over the least one that the hand feels.

    0 where none remains; inf where the device goes on growing to the end of its range.
    """
    wall = wall_of(wanted)
    try:
        parts = amplitude_dependent(point)
    except NothingNonlinearError as error:
        raise MeasureError(f"has nothing to measure: {error}") from None
    except FeedbackError as error:
        raise NoValueError(str(error)) from None
    offsets = (0.0, BETWEEN_COUNTS) if "encoder steps" in parts else (0.0,)
    return max(_loudest(point, *wall, offset) for offset in offsets)


def _loudest(point: OperatingPoint, K: float, B: float, offset: float) -> float:
    """Largest ratio of amplitude and threshold over the stable limit cycles."""
    found = predict_limit_cycles(point, K, B, offset=offset, simulate=False)
    kept_up = [cycle for cycle in found.cycles if settles(cycle)]
    if found.leaves_range or (found.verdict == "unstable" and not kept_up):
        return float("inf")
    ratios = [0.0]
    for cycle in kept_up:
        moved = cycle.amplitude
        if point.plant.handle is not None:
            moved *= float(np.abs(deformation_ratio(point.plant, cycle.frequency_Hz)))
        ratios.append(moved / float(detection_threshold(cycle.frequency_Hz)))
    return max(ratios)
