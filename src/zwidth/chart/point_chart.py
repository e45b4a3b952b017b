"""The chart of an operating point, by the method that its device needs, and verdicts on single walls there.

At many operating points the numbers of the charts are computed together, from one table of loops by way of their
modes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.chart.chart_batch import ChartNumbers, chart_numbers
from zwidth.loop.controller import Controller
from zwidth.loop.loop_table import LoopTable, loop_table
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.sections import section_rows
from zwidth.model.argument_checks import check_kind
from zwidth.model.coupled_pairs import coupled_pairs
from zwidth.model.effective_mass import is_plain
from zwidth.model.mechanism import Mechanism
from zwidth.model.plant_modes import has_general_modes, modes_in_general, plant_modes
from zwidth.model.reduction import Model
from zwidth.model.rendered_modes import PolePairs, RenderedModes, rendered_modes
from zwidth.resources import processor_in_use

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.chart.verdict import WallVerdicts
    from zwidth.progress import Progress


AT_ONCE: Final = 32768  # loops that are in memory at once


def pieces_of_points(point: OperatingPoint) -> Iterator[tuple[slice, OperatingPoint]]:
    """Pieces of all points, flat, each as large as memory holds, with the slice of the points that it is."""
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

    coupled  True: with the loops whose dampers couple their modes, which are known to some ten digits here; False:
             these have no sections either, so that all loops that have some are known to rounding
    Returns  None where that holds of every point: a measured response, a given plant of a single design or one
             that is reduced, encoders on the links in a reduced model, a computer with fixed feedback, a load,
             flexible links, a mechanism that is not plain (`effective_mass.is_plain`) in a reduced model, an arm
             or an operator who holds more than the rendered direction; for coupled False any operator who moves
    """
    found = tables_of_points(point, [point.controller], coupled)
    return None if found is None else found[0]


def tables_of_points(
    point: OperatingPoint, controllers: Sequence[Controller], coupled: bool = True
) -> list[LoopTable] | None:
    """`table_of_points` with each of several computers of one sampling period in place of the points' own."""
    point.require("dynamics", "sampling")
    model = point.model or "full"
    if (
        point.response is not None
        or point.controller.fixed_feedback
        or point.load is not None
        or _is_held_across(point)
    ):
        return None
    if point.mechanism is None and (model != "full" or not point.shape):
        return None
    if point.mechanism is not None and point.encoders != "motor" and model != "full":
        return None
    if point.mechanism is not None and point.mechanism.flexible:
        return None
    if point.mechanism is not None and not _has_modes_in_batch(point.mechanism, model):
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
        or not _has_modes_in_batch(point.mechanism, model)
    ):
        return None
    return _modes_without_operator(point.flat if point.shape else point, model)


def pole_pairs_of_points(point: OperatingPoint, model: Model, coupled: bool = True) -> PolePairs:
    """The plants of all points along one axis, held by their operator, as pairs of poles.

    coupled  as for `table_of_points`; False: plants whose dampers couple their modes have nan as `reach`. For
             points without an operator only
    """
    modes, period = _modes_without_operator(point, model), np.ravel(point.controller.sampling_period)
    if _is_held(point, model):
        return coupled_pairs(modes, point.operator, period)
    if modes.coupled is None or not modes.coupled.any():
        return modes.pairs
    if not coupled:
        return replace(modes.pairs, reach=np.where(modes.coupled, np.nan, modes.pairs.reach))
    # a period for each of these points, or one for all
    rows = np.flatnonzero(modes.coupled)
    periods = period[rows] if len(period) > 1 else period
    return modes.pairs.with_rows(rows, coupled_pairs(modes.rows(rows), None, periods))


def _is_held_across(point: OperatingPoint) -> bool:
    """Whether the operator holds more than the rendered direction, or is an arm: the loop of each point is then
    built by itself."""
    across = point.operator is not None and point.operator.directions == "all" and point.mechanism is not None
    return point.arm is not None or (across and (point.model or "full") == "full")


def _has_modes_in_batch(mechanism: Mechanism, model: Model) -> bool:
    """Whether the modes of a mechanism's many postures can be computed together."""
    return is_plain(mechanism) or (model == "full" and has_general_modes(mechanism))


def _is_held(point: OperatingPoint, model: Model) -> bool:
    """Whether the plants have an operator who moves with them: not in the model of the motor's mass, where the
    handle does not move."""
    return point.operator is not None and model != "motor-mass"


def _modes_without_operator(point: OperatingPoint, model: Model) -> RenderedModes:
    """Modes of all points' plants, without operator, by the given plant or by the mechanism in its postures.

    model  of the mechanism; the callers have found that it can be computed for all postures at once
    """
    if point.given_plant is not None:
        return plant_modes(point.given_plant, point.shape)
    assert point.mechanism is not None
    assert point.posture is not None
    if not is_plain(point.mechanism):
        return modes_in_general(point.mechanism, point.posture, point.direction, point.damping, point.encoders)
    modes = rendered_modes(point.mechanism, point.posture, point.direction, model, point.damping, point.encoders)
    assert modes is not None  # the callers have looked at the encoders
    return modes


def chart_at(point: OperatingPoint, radius: float = 1.0, *, decay: bool = True) -> Chart:
    """The stable walls at a single operating point.

    A measured response, and a loss factor, are charted by their frequency response; several directions rendered
    together under one wall law; all else by D-decomposition of the loop.

    radius  less than 1 for the walls whose slowest motion shrinks at least by that factor per sample
    decay   False skips the search for the fastest-decaying walls, which takes most of the time
    Returns StabilityChart, MultiChart or MeasuredChart
    Raises  what `OperatingPoint.loop` raises; ChartError if the edge cannot be closed, ResponseError for what
            cannot be a device's response, ValueError for another radius than 1 where only 1 is charted
    """
    check_kind("point", point, OperatingPoint)
    plain = radius == 1.0
    if not plain and (point.charted_by_response or point.direction_count > 1):
        raise ValueError(f"radius must be 1 for a frequency response and for several directions, got {radius:g}")
    if point.response is not None:
        from zwidth.chart.measured.chart import measured_chart

        return measured_chart(point.held_response, point.controller)
    if point.charted_by_response:
        from zwidth.chart.hysteretic_response import hysteretic_chart

        return hysteretic_chart(point.loop)
    if point.direction_count > 1:
        from zwidth.chart.several_directions.chart import multi_chart

        return multi_chart(point.loop_of_directions)
    from zwidth.chart.chart import stability_chart

    return stability_chart(point.loop, radius, decay)


def check_at(
    point: OperatingPoint, wall_stiffness: ArrayLike, wall_damping: ArrayLike, progress: Progress | None = None
) -> WallVerdicts:
    """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast, at a single operating point.

    progress  called with "walls", the walls judged, and all walls
    Returns Verdicts by eigenvalues; MeasuredVerdicts by the count of roots for what has a frequency response only
    Raises  what `chart_at` raises
    """
    check_kind("point", point, OperatingPoint)
    if point.charted_by_response:
        return chart_at(point).check(wall_stiffness, wall_damping)
    from zwidth.chart.verdict import verdicts

    loop = point.loop if point.direction_count == 1 else point.loop_of_directions
    return verdicts(loop, wall_stiffness, wall_damping, progress)


def numbers_of_points(point: OperatingPoint, what: int, radius: Floats | None = None) -> ChartNumbers | None:
    """Numbers of all points' charts, flat; None for a device whose modes compiled code cannot treat. They are kept
    with the points, for all that is asked of them.

    what    mask, as for `chart_numbers`
    radius  (...) of the circle of each point's chart; None: 1, that of stability
    """
    key = __name__, what, None if radius is None else radius.tobytes()
    if key not in point.results:
        point.results[key] = _numbers_piece_by_piece(point, what, None if radius is None else radius.ravel())
    found: ChartNumbers | None = point.results[key]
    return found


def _numbers_piece_by_piece(point: OperatingPoint, what: int, radius: Floats | None) -> ChartNumbers | None:
    """`numbers_of_points`, computed anew for flat radii (N,): piece by piece, as many points as memory holds."""
    parts = []
    for at, piece in pieces_of_points(point):
        table = table_of_points(piece)
        if table is None:
            return None
        parts.append(_numbers_on_processor_in_use(table, what, None if radius is None else radius[at]))
    return ChartNumbers(*map(np.concatenate, zip(*parts, strict=True)))


def _numbers_on_processor_in_use(loops: LoopTable, what: int, radius: Floats | None) -> ChartNumbers:
    """The numbers of each loop's chart, on the GPU if that is in use and all circles are the unit circle."""
    if processor_in_use() == "cpu" or radius is not None:
        return chart_numbers(loops, what, radius)
    from zwidth.chart.chart_cuda import numbers_on_gpu

    return numbers_on_gpu(loops, what)
