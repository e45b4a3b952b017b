"""The numbers of the charts at many operating points together, from their modes to a table of loops."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Final

import numpy as np

from zwidth.chart.chart_batch import ChartNumbers, chart_numbers
from zwidth.loop.loop_table import LoopTable, loop_table
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.sections_batch import section_rows
from zwidth.model.coupled_pairs import coupled_pairs
from zwidth.model.plant_modes import plant_modes
from zwidth.model.pole_pairs import PolePairs
from zwidth.model.reduction import Model
from zwidth.model.rendered_modes import RenderedModes, rendered_modes

AT_ONCE: Final = 32768  # loops that are in memory at once


def numbers_of_points(point: OperatingPoint, what: int) -> ChartNumbers | None:
    """Numbers of all points' charts, flat; None for a device whose modes compiled code cannot treat. They are kept
    with the points, for all that is asked of them.

    what  STIFFEST or ALL_NUMBERS, as for `chart_numbers`
    """
    key = __name__, what
    if key not in point.results:
        tables = _tables(point)
        parts = None if tables is None else [chart_numbers(table, what) for table in tables]
        point.results[key] = parts and ChartNumbers(
            *(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(ChartNumbers))
        )
    found: ChartNumbers | None = point.results[key]
    return found


def _tables(point: OperatingPoint) -> Iterator[LoopTable] | None:
    """The loops of all points, flat, some at a time; None as in `numbers_of_points`."""
    model = point.model or "full"
    if point.response is not None:
        return None
    if point.mechanism is None and (model != "full" or not point.shape):
        return None
    if point.mechanism is not None and point.encoders != "motor" and model != "full":
        return None
    flat = point.flat if point.shape else point

    def tables() -> Iterator[LoopTable]:
        count = int(np.prod(point.shape))
        for first in range(0, count, AT_ONCE):
            piece = flat[first : first + AT_ONCE] if count > AT_ONCE else flat
            rows, section_count = section_rows(_pairs(piece, model), piece.controller)
            yield loop_table(rows, section_count, piece.controller)

    return tables()


def _pairs(point: OperatingPoint, model: Model) -> PolePairs:
    modes, period = _modes(point, model), np.ravel(point.controller.sampling_period)
    if point.operator is not None and model != "motor-mass":  # this model holds the operator fixed
        return coupled_pairs(modes, point.operator, period)
    if modes.coupled is None or not modes.coupled.any():
        return modes.pairs
    rows = np.flatnonzero(modes.coupled)
    own = period[rows] if len(period) > 1 else period
    return modes.pairs.with_rows(rows, coupled_pairs(modes.rows(rows), None, own))


def _modes(point: OperatingPoint, model: Model) -> RenderedModes:
    if point.given_plant is not None:
        return plant_modes(point.given_plant)
    assert point.mechanism is not None
    assert point.posture is not None
    modes = rendered_modes(point.mechanism, point.posture, point.direction, model, point.damping, point.encoders)
    assert modes is not None  # `_tables` has looked at the encoders
    return modes
