"""Is the wanted wall stable? As a measure of many devices at once: 1 where it is, 0 where it is not."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.chart.point_chart import check_at
from zwidth.chart.point_radii import radii_at_points
from zwidth.chart.verdict import NEAR, STABLE, UNDECIDED
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import Measure, MeasureValues, WantedWall, WantedWalls
from zwidth.measures.evaluate import complete_pointwise
from zwidth.measures.preconditions import walls_of
from zwidth.study.designs.column import Column


def wall_is_stable(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """1 where the wanted wall is stable, 0 where it is unstable; undecided within rounding, as `zwidth check`.

    Far from the unit circle the spectral radius decides, of all points together; near it each point is judged
    alone, with the rounding error of its own eigenvalue.
    """
    K, B = walls_of(wanted, point.shape)
    # a single point has the digits that `Loop.check` has
    radii = radii_at_points(point, K, B) if point.shape else np.full((), np.nan)
    known = np.where(radii < 1.0 - NEAR, 1.0, np.where(radii > 1.0 + NEAR, 0.0, np.nan))

    def alone(at: tuple[int, ...]) -> float:
        verdict = int(check_at(point[at], [K[at]], [B[at]]).verdict[0])
        if verdict == UNDECIDED:
            raise ChartError("the wall lies on the stability limit, as far as rounding tells")
        return float(verdict == STABLE)

    return complete_pointwise(known, alone, point)


WALL_IS_STABLE: Final = Column(
    "wall_is_stable",
    Measure(
        name="wall_is_stable",
        title="Whether the wanted wall is stable",
        unit="",
        better="higher",
        source="eigenvalues",
        function=f"{__name__}:wall_is_stable",
        of_wall=True,
        of_designs=True,
    ),
)
