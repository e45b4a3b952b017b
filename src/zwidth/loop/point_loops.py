"""The loops of many operating points as a table, by way of their modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.loop.controller import Controller
from zwidth.loop.loop_table import LoopTable, loop_table
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.sections import section_rows
from zwidth.model.coupled_pairs import coupled_pairs
from zwidth.model.drive_side import is_plain
from zwidth.model.mechanism import Mechanism
from zwidth.model.plant_modes import has_general_modes, modes_in_general, plant_modes
from zwidth.model.reduction import Model
from zwidth.model.rendered_modes import PolePairs, RenderedModes, rendered_modes

AT_ONCE: Final = 32768  # loops that are in memory at once


def pieces_of_points(point: OperatingPoint) -> Iterator[tuple[slice, OperatingPoint]]:
    """All points, flat, as many at a time as are in memory at once; and which they are."""
    count = int(np.prod(point.shape))
    if count <= AT_ONCE:
        yield slice(None), point
        return
    flat = point.flat
    for first in range(0, count, AT_ONCE):
        piece = slice(first, first + AT_ONCE)
        yield piece, flat[piece]


def table_of_points(point: OperatingPoint, coupled: bool = True) -> LoopTable | None:
    """The loops of all points, flat.

    A loop without sections is to be built alone, as `point[i].loop`: its posture is not OK, or its poles are such
    as compiled code does not treat.

    coupled  False: to rounding. Loops whose dampers couple their modes, which are known to some ten digits here,
             have no sections then either
    Returns  None where that holds of every point: a measured response, a given plant of a single design or one
             that is reduced, encoders on the links in a reduced model, a computer with fixed feedback, a load,
             flexible links, a mechanism that is not plain (`drive_side.is_plain`) in a reduced model
    """
    found = tables_of_points(point, [point.controller], coupled)
    return None if found is None else found[0]


def tables_of_points(
    point: OperatingPoint, controllers: Sequence[Controller], coupled: bool = True
) -> list[LoopTable] | None:
    """`table_of_points` with each of several computers of one sampling period in place of the points' own."""
    point.require("dynamics", "sampling")
    model = point.model or "full"
    if point.response is not None or point.controller.fixed_feedback or point.load is not None or _alone(point):
        return None
    if point.mechanism is None and (model != "full" or not point.shape):
        return None
    if point.mechanism is not None and point.encoders != "motor" and model != "full":
        return None
    if point.mechanism is not None and point.mechanism.flexible:
        return None
    if point.mechanism is not None and not _known_together(point.mechanism, model):
        return None
    if _is_held(point, model) and not coupled:
        return None
    pairs = pole_pairs_of_points(point.flat if point.shape else point, model, coupled)
    return [loop_table(*section_rows(pairs, controller), controller) for controller in controllers]


def modes_of_points(point: OperatingPoint) -> RenderedModes | None:
    """Modes of all points' plants, flat, without operator; None where each point is to be asked alone: a measured
    response, a reduced given plant or one of a single design, encoders on the links in a reduced model, a load,
    flexible links, a mechanism that is not plain in a reduced model.

    Their `input` is nan where dampers couple the modes; frequencies and shapes are those without damping.
    """
    point.require("dynamics")
    model = point.model or "full"
    if point.response is not None or point.load is not None:
        return None
    if point.mechanism is None and (model != "full" or not point.shape):
        return None
    if point.mechanism is not None and (
        point.mechanism.flexible
        or (point.encoders != "motor" and model != "full")
        or not _known_together(point.mechanism, model)
    ):
        return None
    return _modes(point.flat if point.shape else point, model)


def pole_pairs_of_points(point: OperatingPoint, model: Model, coupled: bool = True) -> PolePairs:
    """The plants of all points along one axis, held by their operator, as pairs of poles.

    coupled  False: nan as reach for plants whose dampers couple their modes; nobody holds them
    """
    modes, period = _modes(point, model), np.ravel(point.controller.sampling_period)
    if _is_held(point, model):
        return coupled_pairs(modes, point.operator, period)
    if modes.coupled is None or not modes.coupled.any():
        return modes.pairs
    if not coupled:
        return replace(modes.pairs, reach=np.where(modes.coupled, np.nan, modes.pairs.reach))
    rows = np.flatnonzero(modes.coupled)
    own = period[rows] if len(period) > 1 else period
    return modes.pairs.with_rows(rows, coupled_pairs(modes.rows(rows), None, own))


def _alone(point: OperatingPoint) -> bool:
    """Whether who holds the device holds it in more than the rendered direction."""
    across = point.operator is not None and point.operator.directions == "all" and point.mechanism is not None
    return point.arm is not None or (across and (point.model or "full") == "full")


def _known_together(mechanism: Mechanism, model: Model) -> bool:
    """Whether the modes of many postures are computed together."""
    return is_plain(mechanism) or (model == "full" and has_general_modes(mechanism))


def _is_held(point: OperatingPoint, model: Model) -> bool:
    """Whether an operator moves with the plants; the motor's mass alone has him fixed."""
    return point.operator is not None and model != "motor-mass"


def _modes(point: OperatingPoint, model: Model) -> RenderedModes:
    if point.given_plant is not None:
        return plant_modes(point.given_plant, point.shape)
    assert point.mechanism is not None
    assert point.posture is not None
    if not is_plain(point.mechanism):
        return modes_in_general(point.mechanism, point.posture, point.direction, point.damping, point.encoders)
    modes = rendered_modes(point.mechanism, point.posture, point.direction, model, point.damping, point.encoders)
    assert modes is not None  # `table_of_points` has looked at the encoders
    return modes
