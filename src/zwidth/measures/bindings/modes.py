"""The catalogue's measure of the structure's vibration: the first flexible mode at operating points."""

from __future__ import annotations

import numpy as np

from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import modes_of_points
from zwidth.measures.definition import OK, MeasureValues
from zwidth.measures.evaluate import evaluate_pointwise, with_status
from zwidth.model.modes import natural_frequencies


def first_mode(point: OperatingPoint) -> MeasureValues:
    """Least natural frequency above 0 of the plant without wall and hand [Hz]; inf where nothing bends."""
    modes = modes_of_points(point)
    if modes is None:
        return evaluate_pointwise(_first_mode_at, point)
    squared = modes.frequency_squared
    with np.errstate(invalid="ignore"):
        least = np.where(squared > 0.0, squared, np.inf).min(axis=1, initial=np.inf)
    values = np.sqrt(least).reshape(point.shape) / (2.0 * np.pi)
    known = np.isfinite(squared).all(axis=1).reshape(point.shape) & (point.status == OK)
    return with_status(point, np.where(known, values, np.nan))


def _first_mode_at(point: OperatingPoint) -> float:
    frequencies = natural_frequencies(point.ungripped_plant)
    flexible = frequencies[frequencies > 0.0]
    return float(flexible.min()) if len(flexible) else float("inf")
