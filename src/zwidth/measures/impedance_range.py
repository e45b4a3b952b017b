"""Largest stiffness, largest damping and stable area of the stable walls: exact, with margins, and in closed form.

Functions `..._at` are the catalogue's measures of an operating point, from the exact chart (with margins: see
`chart.wall_margins`). Closed forms (thesis 5.2.1):

Two models have closed forms, both without physical damping, the velocity being the backward difference of two
readings, unfiltered:

    rigid mass m, force l whole samples late       (4.14), (4.26), (4.32), (5.4)-(5.6)     `rigid_range`
    motor side m on the structure's spring k       (4.43), (5.7), (5.8), no delay          `sprung_range`

Everything else (damping, several masses, filters, other estimators, part of a sample of delay) has its exact chart
only. Both are exact where their assumptions hold: no W = sqrt(k/m) T is too large, aliasing included. (5.5), whose
coefficient the scan has lost, is (12 - 16 ln 2) m^2/T^3; (5.7) is extended beyond W = pi; (5.8), damaged in the
scan, is read with ln(1 + c). (4.46), the largest damping of all stable K, at K = -k, is not used: here it is that
of K -> 0. The numbers below (4.32) in the thesis are a misprint: they are those without delay.

As in the thesis's maps (Figs. 5.2, 5.3), damping is left out although the device is damped; the titles say so. A
MeasureError is raised unless all other assumptions hold: the model is `rigid` or `motor-mass`, there is no
operator, the delay is whole (none for `motor-mass`), the velocity is the plain backward difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.arrays import Flags, Floats
from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.chart_batch import ALL_NUMBERS, DECAY, STIFFEST
from zwidth.chart.edge_memory import DOUBTFUL
from zwidth.chart.point_chart import numbers_of_points, pieces_of_points, tables_of_points
from zwidth.chart.wall_margins import delays_within, stiffness_with_margins, stiffness_with_margins_alone
from zwidth.conditions import thesis_flexible, thesis_whole_delay
from zwidth.conditions.assumptions import RIGID, SPRUNG, UNDELAYED, WHOLE_DELAY
from zwidth.errors import MeasureError, NoValueError
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import joined_tables
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import MeasureValues, WantedWall, WantedWalls
from zwidth.measures.evaluation import complete_charts, complete_pointwise, evaluate_pointwise, with_status
from zwidth.measures.preconditions import check_assumptions, check_motor_encoders, loop_case, numbers_of

NONE_STABLE_WITH_MARGINS: Final = "no wall with K > 0 and B >= 0 is stable with these margins"


def stiffness_max_with_margins_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Supremum of K over the walls that are stable with stiffness, damping and delay off by margins [N/m]."""
    names = "stiffness_margin", "damping_margin", "delay_margin"
    margins = numbers_of(wanted, point.shape, "margins in stiffness, damping and delay", *names)

    def alone(at: Index) -> float:
        """Largest stiffness at the point of an index [N/m], by loops with delays spread over the margin."""
        stiffness, damping, delay = (float(margin[at]) for margin in margins)
        loop, count = point[at].loop, delays_within(delay)
        computer = loop.controller
        present = float(computer.delay)
        loops = [
            Loop(loop.plant, replace(computer, delay=present + share * delay))
            for share in np.linspace(0.0, 1.0, count)
        ]
        wall = stiffness_with_margins_alone(loops, stiffness, damping)
        if wall is None:
            raise NoValueError(NONE_STABLE_WITH_MARGINS)
        return wall[0]

    together = _stiffness_with_margins(point, *(margin.ravel() for margin in margins))
    if together is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    return complete_charts(point, *together, alone, NONE_STABLE_WITH_MARGINS)


def _stiffness_with_margins(
    point: OperatingPoint, stiffness: Floats, damping: Floats, delay: Floats
) -> tuple[Floats, NDArray[np.uint8]] | None:
    """Stiffnesses [N/m] and statuses of all N points; None where compiled code does not treat such points.

    stiffness, damping, delay  (N,)  margins: two shares, and samples
    """
    values, status = np.full(delay.size, np.nan), np.full(delay.size, DOUBTFUL, dtype=np.uint8)
    # number of delays tried within each margin, and so at each point
    each = np.array([delays_within(one) for one in np.unique(delay)])
    counts = each[np.unique(delay, return_inverse=True)[1].ravel()]
    for at, piece in pieces_of_points(point):
        rows = np.arange(delay.size)[at]
        for count in np.unique(counts[rows]):
            some = np.flatnonzero(counts[rows] == count)
            points = piece if len(some) == len(rows) else piece.flat[some]
            margin = delay[rows[some]]
            # margins that differ make a computer for each point, in one row
            alike = bool((margin == margin[0]).all())
            points, longer = (points, margin[0]) if alike else (points.flat, margin)
            controller = points.controller
            first = np.asarray(controller.delay)
            delays = [first + share * longer for share in np.linspace(0.0, 1.0, int(count))]
            computers = [replace(controller, delay=d if d.ndim else float(d)) for d in delays]
            tables = tables_of_points(points, computers)
            if tables is None:
                return None
            at_rows = rows[some]
            walls, status[at_rows] = stiffness_with_margins(
                joined_tables(tables), int(count), stiffness[at_rows], damping[at_rows]
            )
            values[at_rows] = walls[:, 0]
    return values, status


@dataclass(frozen=True)
class ImpedanceRange:
    """The extent of the stable walls, as in `StabilityChart`; nan where the closed form does not apply.

    stiffness_max             (...)  supremum of K over stable walls with K > 0, B >= 0 [N/m]; nan if there is none
    damping_at_stiffness_max  (...)  its damping [N s/m]; nan if there is none
    damping_max               (...)  supremum of B >= 0 stable for K -> 0 [N s/m]; 0 if there is none
    stable_area               (...)  of the stable set in K >= 0, B >= 0 [N² s/m²]; 0 if there is none
    """

    stiffness_max: Floats
    damping_at_stiffness_max: Floats
    damping_max: Floats
    stable_area: Floats


def rigid_range(mass: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike = 0.0) -> ImpedanceRange:
    """A free mass without friction, the force l samples late (thesis eq. 5.4, 5.5 and 5.6).

                K_max            B_max            area
        l = 0   0.686292 m/T^2   2 m/T            (12 - 16 ln 2) m^2/T^3
        l = 1   0.144469 m/T^2   0.828427 m/T     0.0798634 m^2/T^3
        any l   where (l + 1) sin t tan((l + 1) t) = 2; 2 tan(pi/(4 l + 4)) m/T; an integral of smooth terms

    mass             (...)  m [kg]
    sampling_period  (...)  T [s]
    delay_samples    (...)  l
    Returns          (...)  all broadcast; nan where m or T is not positive and finite, or l not whole and >= 0

    >>> free = rigid_range([0.2616, 0.287], 0.00125)
    >>> free.stiffness_max.round(1).tolist(), free.damping_max.round(2).tolist()
    ([114901.7, 126058.0], [418.56, 459.2])
    >>> rigid_range(0.287, 0.00125, [1.0, 0.5]).stiffness_max.round(1).tolist()
    [26536.1, nan]
    """
    m, T, l = _broadcast(mass, sampling_period, delay_samples)
    applies = _positive(m) & _positive(T) & np.isfinite(l) & (l >= 0.0) & (l == np.round(l))
    m, T, l = np.where(applies, m, 1.0), np.where(applies, T, 1.0), np.where(applies, l, 0.0)
    stiffness, damping = thesis_whole_delay.largest(m, T, l)
    highest, area = thesis_whole_delay.largest_damping(m, T, l), thesis_whole_delay.stable_area(m, T, l)
    return _masked_range(applies, stiffness, damping, highest, area)


def sprung_range(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> ImpedanceRange:
    """A mass on a spring to the ground, without friction and delay (thesis eq. 5.7 and 5.8).

        K_max = 2 k (sqrt(1 + c) - 1)^2/(1 - c),   B_max = k T c/(1 - c),   c = cos W,   W = sqrt(k/m) T
        area  = (m^2/T^3) 2 W^4/(1 - c)^2 (c^2/2 + c - (1 + c) ln(1 + c))

    There are stable walls up to W = pi/2, none to 3 pi/2, and again where aliasing makes c positive.

    mass             (...)  m [kg], the motor side's
    stiffness        (...)  k [N/m], that between motors and links; 0: `rigid_range` without delay
    sampling_period  (...)  T [s]
    Returns          (...)  all broadcast; nan where m or T is not positive and finite, or k is negative or not
                            finite, and where W is 2 pi, 4 pi ...: then no wall moves what is read

    >>> sprung = sprung_range(0.0254, 15620.0, 0.00125)
    >>> [round(float(v), 4) for v in (sprung.stiffness_max, sprung.damping_at_stiffness_max, sprung.damping_max)]
    [4325.8941, 10.914, 24.5317]
    """
    m, k, T = _broadcast(mass, stiffness, sampling_period)
    applies = _positive(m) & _positive(T) & np.isfinite(k) & (k >= 0.0)
    m, k, T = (np.where(applies, value, 1.0) for value in (m, k, T))
    largest = thesis_flexible.largest_stiffness(m, k, T)
    damping = thesis_flexible.damping_at_largest_stiffness(m, k, T)
    none = largest == 0.0
    return _masked_range(
        applies,
        np.where(none, np.nan, largest),
        np.where(none, np.nan, damping),
        thesis_flexible.largest_damping(m, k, T),
        thesis_flexible.stable_area(m, k, T),
    )


def _broadcast(*values: ArrayLike) -> tuple[Floats, ...]:
    """The values as arrays of floats, all of one shape."""
    return tuple(np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in values)))


def _positive(values: Floats) -> Flags:
    """Which values (...) are positive and finite."""
    return (values > 0.0) & np.isfinite(values)


def _masked_range(applies: Flags, *numbers: Floats) -> ImpedanceRange:
    """Range of these numbers (...), in the order of its fields; nan where the closed form does not apply."""
    return ImpedanceRange(*(np.where(applies, number, np.nan) for number in numbers))


Index = tuple[int, ...]

NONE_STABLE: Final = "no wall with K > 0 and B >= 0 is stable"
NONE_DECAYS: Final = "no wall with K > 0 and B >= 0 has a spectral radius below the wanted one"


def stiffness_max_at(point: OperatingPoint) -> MeasureValues:
    """Supremum of K over the stable walls with K > 0, B >= 0, of the points' models and loops [N/m]."""
    return _chart_number(point, STIFFEST, "stiffness", _stiffness_max_at, NONE_STABLE)


def stiffness_max_decaying_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Supremum of K over the walls with K > 0, B >= 0 whose spectral radius is below the wanted one [N/m]."""
    what = "the spectral radius that the wall must not exceed"
    (radius,) = numbers_of(wanted, point.shape, what, "spectral_radius")

    def alone(at: Index) -> float:
        """Largest stiffness of decaying walls at the point of an index [N/m]. Raises NoValueError for none."""
        peak = largest_stiffness(point[at].loop, float(radius[at]))
        if peak is None:
            raise NoValueError(NONE_DECAYS)
        return peak.stiffness

    numbers = numbers_of_points(point, STIFFEST, radius)
    if numbers is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    return complete_charts(point, numbers.stiffness, numbers.status, alone, NONE_DECAYS)


def damping_max_at(point: OperatingPoint) -> MeasureValues:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0, of the points [N s/m]; 0 if none is."""
    return _chart_number(point, ALL_NUMBERS, "largest_damping", _damping_max_at)


def stable_area_at(point: OperatingPoint) -> MeasureValues:
    """Area of the stable walls with K >= 0, B >= 0 of the points [N² s/m²]."""
    return _chart_number(point, ALL_NUMBERS, "area", _stable_area_at)


def fastest_decay_at(point: OperatingPoint) -> MeasureValues:
    """Spectral radius of the wall whose slowest motion decays fastest, of the points."""
    return _chart_number(point, DECAY, "spectral_radius", _fastest_decay_at, "no wall is stable")


def _chart_number(
    point: OperatingPoint,
    what: int,
    number: str,
    alone: Callable[[OperatingPoint], float],
    none_stable: str = "",
) -> MeasureValues:
    """A number of the chart of each point, computed together (`chart.point_chart`); for a point in doubt, and for
    all points where `numbers_of_points` gives None, by a chart of its own.

    what         STIFFEST, DECAY or ALL_NUMBERS: what of the charts is computed
    number       attribute of `ChartNumbers` that is returned;   alone  computes it at a single point
    none_stable  the reason where no wall is stable and there is no number therefore; "": there is one
    """
    numbers = numbers_of_points(point, what)
    if numbers is None:
        return evaluate_pointwise(alone, point)
    states = numbers.decay_status if what == DECAY else numbers.status
    return complete_charts(point, getattr(numbers, number), states, lambda at: alone(point[at]), none_stable)


def _stiffness_max_at(point: OperatingPoint) -> float:
    """Largest stiffness at a single point [N/m]. Raises NoValueError where no wall is stable."""
    peak = largest_stiffness(point.loop)
    if peak is None:
        raise NoValueError(NONE_STABLE)
    return peak.stiffness


def _damping_max_at(point: OperatingPoint) -> float:
    """Largest damping at a single point [N s/m]."""
    return stability_chart(point.loop, decay=False).damping_max


def _stable_area_at(point: OperatingPoint) -> float:
    """Stable area at a single point [N² s/m²]."""
    return stability_chart(point.loop, decay=False).stable_area


def _fastest_decay_at(point: OperatingPoint) -> float:
    """Least spectral radius at a single point. Raises NoValueError where no wall is stable."""
    wall = stability_chart(point.loop).fastest_decay
    if wall is None:
        raise NoValueError("no wall is stable")
    return wall.spectral_radius


_NO_CLOSED_FORM = "no wall of positive stiffness is stable, or the mass or the spring of the model is not there"


def stiffness_max_closed_form_at(point: OperatingPoint) -> MeasureValues:
    """Largest stiffness in closed form [N/m] (thesis eq. 5.4, 5.6 and 5.7)."""
    return with_status(point, _closed_form_range(point).stiffness_max, _NO_CLOSED_FORM)


def damping_max_closed_form_at(point: OperatingPoint) -> MeasureValues:
    """Largest damping for stiffnesses near 0 in closed form [N s/m] (thesis eq. 5.4, 5.6 and 5.7)."""
    return with_status(point, _closed_form_range(point).damping_max, _NO_CLOSED_FORM)


def stable_area_closed_form_at(point: OperatingPoint) -> MeasureValues:
    """Stable area in closed form [N² s/m²] (thesis eq. 5.5 and 5.8)."""
    return with_status(point, _closed_form_range(point).stable_area, _NO_CLOSED_FORM)


def _closed_form_range(point: OperatingPoint) -> ImpedanceRange:
    """Range in closed form at all points: of a rigid mass, or of the motor side on the structure's spring.

    Raises  MeasureError  for another model, one that breaks what the closed form assumes, or an operator who moves
                          with it
    """
    if point.operator is not None and point.model != "motor-mass":
        raise MeasureError("has a closed form for the device alone", [("operator", "none")])
    case = loop_case(point)
    T, delay_samples = point.controller.sampling_period, point.controller.whole_delay
    mass: ArrayLike
    motor: ArrayLike
    stiffness: ArrayLike
    if point.mechanism is None:
        traits, rigid, sprung = case.traits, RIGID not in case.unmet, SPRUNG not in case.unmet
        mass, motor, stiffness = traits.rigid_mass, traits.side_mass, traits.side_stiffness
    else:
        numbers, rigid, sprung = point.effective, point.model == "rigid", point.model == "motor-mass"
        mass, motor, stiffness = numbers.rigid_mass, numbers.motor_side_mass, numbers.stiffness
    if rigid:
        check_assumptions(case, WHOLE_DELAY)
        return rigid_range(mass, T, delay_samples)
    if sprung:
        check_motor_encoders(point)
        check_assumptions(case, UNDELAYED)
        return sprung_range(motor, stiffness, T)
    models = [("model", "rigid"), ("model", "motor-mass")]
    raise MeasureError("has a closed form for two models only", models, True)
