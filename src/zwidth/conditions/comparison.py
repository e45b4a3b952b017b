"""Published conditions compared with the exact stability limit of a device at one operating point.

All published conditions on one loop, side by side.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isinf, nan
from typing import Any

import numpy as np
from scipy.optimize import brentq

from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.chart.verdict import spectral_radius
from zwidth.conditions import (
    abbott_okamura,
    colgate_schenkel,
    diolaiti,
    gil,
    hulin,
    mehling,
    one_mode,
    passivity,
    spring_stability,
    thesis_damped,
    thesis_flexible,
    thesis_flexible_series,
    thesis_rigid,
    thesis_unit_delay,
    thesis_whole_delay,
)
from zwidth.conditions.assumptions import Bound, case_of
from zwidth.conditions.traits import ground_friction, reading_step
from zwidth.errors import ChartError
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind, check_number
from zwidth.result import Result, documented, entry

# Keys of a bound that are left out of tables: one is the same for every device, the other is itself a table.
NO_COLUMNS = ("assumptions", "taken")


@dataclass(frozen=True)
class BoundsComparison(Result):
    """Largest stiffness at one damping by every published condition, and the exact one.

    bounds     all conditions, always in the same order
    damping    B of the walls compared [N s/m]
    exact      largest stable stiffness at that damping [N/m]: 0 where no wall is stable, nan without a chart
    chart      the exact chart; None where rounding leaves it undecided
    undecided  why there is no chart; "" where there is one
    """

    bounds: tuple[Bound, ...]
    damping: float = field(metadata=entry("N s/m"))
    exact: float = field(metadata=entry("N/m"))
    chart: StabilityChart | None = field(metadata=entry(name="decided", value=lambda chart: chart is not None))
    undecided: str = field(default="", metadata=entry(empty="left out"))

    @property
    @documented("N/m", name="exact_largest", before="chart")
    def largest(self) -> float:
        """Largest stable stiffness over all B >= 0 [N/m]: 0 if no wall is stable, nan without a chart."""
        if self.chart is None:
            return nan
        return self.chart.stiffness_max if self.chart.stiffness_max > 0.0 else 0.0

    @property
    @documented("N s/m", name="exact_damping_at_largest", before="chart")
    def damping_at_largest(self) -> float:
        """Damping of the stiffest stable wall [N s/m]; nan if no wall is stable, or without a chart."""
        return nan if self.chart is None else self.chart.damping_at_stiffness_max

    def stiffness_max(self, bound: Bound) -> float:
        """Largest stiffness that a condition admits at `damping` [N/m], as `Bound.stiffness_max_at`."""
        return float(bound.stiffness_max_at(self.damping))

    def ratio(self, bound: Bound) -> float:
        """Largest stiffness by a condition at `damping` over the exact one; nan where that is 0."""
        return _ratio(self.stiffness_max(bound), self.exact)

    def document(self) -> dict[str, Any]:
        """The conditions and the exact limit by key and unit."""
        return {"bounds": [self._entry(bound) for bound in self.bounds]} | super().document()

    def table(self) -> dict[str, list[Any]]:
        """The conditions as columns, one condition a row; several sentences are joined in one cell."""
        rows = [self._entry(bound) for bound in self.bounds]
        columns = [key for key in (rows[0] if rows else ()) if key not in NO_COLUMNS]
        return {
            key: [" ".join(row[key]) if isinstance(row[key], list) else row[key] for row in rows]
            for key in columns
        }

    def _entry(self, bound: Bound) -> dict[str, Any]:
        """The entry of one condition in the document, by key and unit."""
        return {
            "name": bound.name,
            "source": bound.source,
            "kind": bound.kind,
            "claim": bound.claim,
            "statement": bound.statement,
            "stiffness_max_N_per_m": self.stiffness_max(bound),
            "ratio_to_exact": self.ratio(bound),
            "largest_N_per_m": bound.stiffness_max,
            "damping_at_largest_Ns_per_m": bound.damping_at_stiffness_max,
            "largest_ratio_to_exact": _ratio(bound.stiffness_max, self.largest),
            "assumptions": list(bound.assumptions),
            "violated": list(bound.violated),
            "taken": dict(bound.taken),
            "lacking": list(bound.lacking),
        }

    def __repr__(self) -> str:
        """The exact limit at `damping`, and how many conditions have all assumptions met."""
        met = sum(bound.holds for bound in self.bounds)
        exact = (
            f"exact {self.exact:.6g} N/m there, {self.largest:.6g} N/m at most"
            if self.chart is not None
            else "exact limit undecided"
        )
        return (
            f"BoundsComparison: at {self.damping:.6g} N s/m {exact}\n"
            f"  {len(self.bounds)} conditions, {met} with all assumptions met"
        )


def compare_bounds(point: OperatingPoint, damping: float | None = None) -> BoundsComparison:
    """Compare every published condition with the exact stability limit at one operating point; a measured device
    by the plant that is fitted to it.

    damping  at which the conditions are compared [N s/m]; left out: that of the stiffest stable wall, 0 if there
             is none
    Raises   ValueError  for a damping that is not finite
             what `OperatingPoint.loop` and `stability_chart` raise, except ChartError: its text is in `undecided`

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> import numpy as np
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> comparison = compare_bounds(OperatingPoint(Controller(1.0), given_plant=free_mass), damping=1.0)
    >>> round(comparison.exact, 9), round(comparison.stiffness_max(comparison.bounds[0]), 9)
    (0.666666667, 0.666666667)
    """
    check_kind("point", point, OperatingPoint)
    if point.response is not None:
        from zwidth.chart.measured.chart import modelled_point

        point = modelled_point(point)
    if damping is not None:
        check_number("damping", damping, "N s/m")
    loop = point.loop
    chart, undecided = None, ""
    try:
        chart = stability_chart(loop, decay=False).drawn()
    except ChartError as error:
        undecided = str(error)
    if damping is None:
        damping = chart.damping_at_stiffness_max if chart is not None and chart.stiffness_max > 0.0 else 0.0
    exact = nan if chart is None else exact_stiffness_limit(chart, damping)
    return BoundsComparison(tuple(bounds_of(point, damping)), damping, exact, chart, undecided)


def bounds_of(point: OperatingPoint, wall_damping: float = nan) -> list[Bound]:
    """Every condition on a device at one operating point, with its dry friction and its encoder's step.

    wall_damping  B of the walls, for the assumptions on it [N s/m]; nan: these count as met
    Raises        what `OperatingPoint.loop` raises
    """
    plant = point.plant
    return compare(
        point.loop,
        wall_damping=wall_damping,
        coulomb_friction=ground_friction(plant) if point.friction_known else nan,
        resolution=reading_step(plant) if point.resolution_known else nan,
    )


def exact_stiffness_limit(chart: StabilityChart, wall_damping: float) -> float:
    """Supremum of the stable stiffnesses K > 0 at a damping B [N s/m], over all regions of the chart [N/m].

    0 where no wall with K > 0 is stable. The samples of the chart's edge give a first value, and eigenvalues of
    walls near it give the result.

    >>> import numpy as np
    >>> from zwidth.chart.chart import stability_chart
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.loop.loop import Loop
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> chart = stability_chart(Loop(free_mass, Controller(sampling_period=1.0)))
    >>> round(exact_stiffness_limit(chart, 1.0), 9)             # 2 d (2 - d)/(2 + d), thesis eq. 4.14
    0.666666667
    """
    if wall_damping == chart.damping_at_stiffness_max:
        return chart.stiffness_max
    crossings = _crossings(chart, wall_damping)
    width = max((float(np.max(np.abs(ring[:, 0]))) for ring in chart.regions), default=0.0)
    # the stiffest first; a K that is 0 but for the rounding of the chart is no stiffness
    for stiffness in sorted((K for K in crossings if 1e-9 * width < K), reverse=True):
        refined = _refined_edge(chart, stiffness, wall_damping, width)
        if refined is not None:
            return refined
    return 0.0


def _crossings(chart: StabilityChart, wall_damping: float) -> list[float]:
    """Approximate stiffnesses [N/m] at which the chart's edge crosses one damping [N s/m], between its samples."""
    stiffnesses: list[float] = []
    for arc in chart.boundary:
        off = arc.damping - wall_damping
        n = np.flatnonzero((off[:-1] * off[1:] <= 0.0) & (off[:-1] != off[1:]))
        share = off[n] / (off[n] - off[n + 1])
        stiffnesses += (arc.stiffness[n] + share * (arc.stiffness[n + 1] - arc.stiffness[n])).tolist()
    return stiffnesses


def _refined_edge(chart: StabilityChart, stiffness: float, wall_damping: float, width: float) -> float | None:
    """The edge near a stiffness by eigenvalues [N/m]; None where no edge is near, with stable walls below it.

    width  largest |K| of the chart's regions [N/m], of which the search takes shares
    """

    def excess(K: float) -> float:
        return float(spectral_radius(chart.loop, K, wall_damping)) - chart.radius

    # the chords of the drawn edge deviate from the curve by the chart's tolerance at most
    for reach in (1e-6, 1e-5, 1e-4, 1e-3):
        low, high = max(stiffness - reach * width, 0.0), stiffness + reach * width
        if excess(low) < 0.0 < excess(high):
            return float(brentq(excess, low, high, xtol=1e-13 * width, rtol=1e-13))
    return None


def _ratio(admitted: float, exact: float) -> float:
    """Stiffness that a condition admits over the exact one; nan unless that is above 0."""
    return admitted / exact if exact > 0.0 else nan


CONDITIONS = (
    thesis_rigid.condition,
    thesis_damped.condition,
    thesis_damped.tangent_condition,
    thesis_unit_delay.condition,
    thesis_whole_delay.condition,
    thesis_flexible.condition,
    thesis_flexible_series.condition,
    thesis_flexible_series.linear_condition,
    one_mode.condition,
    gil.condition,
    hulin.condition,
    spring_stability.condition,
    colgate_schenkel.condition,
    colgate_schenkel.filtered_condition,
    passivity.condition,
    mehling.condition,
    abbott_okamura.condition,
    diolaiti.condition,
)


def compare(
    loop: Loop, *, wall_damping: float = nan, coulomb_friction: float = nan, resolution: float = nan
) -> list[Bound]:
    """Every condition of this package on a loop, always in the same order.

    A condition is evaluated with the numbers of the plant listed in its `taken` even where the device does not
    meet its assumptions: `Bound.violated` lists these, and its limit is then not to be relied on.

    wall_damping      B of the walls, for assumptions on it [N s/m]; nan: these assumptions count as met
    coulomb_friction  f_c, dry friction against the ground where the wall acts [N]; nan: not known
    resolution        Delta, the encoder's step there [m]; nan: not known
    Raises            ValueError  for an infinite wall_damping;  TypeError  for a loop that is no `Loop`

    >>> import numpy as np
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> "rigid mass" in [bound.name for bound in compare(Loop(free_mass, Controller(1.0))) if bound.holds]
    True
    """
    check_kind("loop", loop, Loop)
    if isinf(wall_damping):
        raise ValueError(f"wall_damping must be finite, or nan for none, got {wall_damping:g}")
    case = case_of(loop, wall_damping, coulomb_friction, resolution)
    return [condition(case) for condition in CONDITIONS]
