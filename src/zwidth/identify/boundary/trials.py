"""A measured boundary beside trials on the simulated device, where its linear chart does not tell the edge.

With dry friction a wall may be stable for a small disturbance and not for a large one, so that the edge hangs on
how the device was disturbed, pushed, and watched. The same is simulated at the measured stiffnesses: the damping
at which the verdict changes, for the numbers v_k and for each of them moved either way. The simulated edge is then
taken to be linear in the numbers, S + D (v - v_k), a fit gives v_{k+1}, and so on until the numbers stay.
Intervals follow the curvature there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import isnan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.contact.boundary_experiment import StableExtent, measure_edges, measure_tips
from zwidth.contact.hand import Hand
from zwidth.contact.stability_trial import StabilityTrial
from zwidth.device.faults import comma_list, fail
from zwidth.errors import ArgumentError
from zwidth.identify.boundary.fit import fit_boundary
from zwidth.identify.boundary.model import BoundaryModel, Deviations, Scatter
from zwidth.identify.boundary.parameters import BoundaryParameters
from zwidth.identify.boundary.points import EDGE, LOWER, STABLE, TIP, UNSTABLE, UPPER, BoundaryPoints
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.estimators.levant import Levant
from zwidth.loop.operating_point import OperatingPoint
from zwidth.progress import Progress

DISTURBANCE: Final = 1e-3  # m
TOUCH_SPEED: Final = 0.02  # m/s
VISIBLE_STEPS: Final = 3.0  # encoder steps
MOVED: Final = 0.15  # by which a number's logarithm is moved to see how the simulated edge moves
ROUNDS: Final = 4
SAME_SLOPES: Final = 0.3  # change of the numbers' logarithms up to which the slopes are kept
STAYS: Final = 0.02  # change of the numbers' logarithms at which the rounds end


class Disturbing(NamedTuple):
    """How a trial disturbs the device.

    push         [N]; above 0 a one-sided wall is touched under it, else a two-sided one from a displacement
    disturbance  [m];  visible [m]: amplitude up to which a vibration counts as none
    watch_time   [s]; None: as long as it takes
    """

    push: float
    disturbance: float
    visible: float
    watch_time: float | None


@dataclass(frozen=True)
class TrialPlan:
    """How the trials of each point disturb the device.

    disturbing   of the points (n,), in their order
    reason       why trials are simulated
    """

    disturbing: tuple[Disturbing, ...]
    reason: str

    @classmethod
    def of(
        cls, points: BoundaryPoints, point: OperatingPoint, disturbance: float | None, visible: float | None
    ) -> TrialPlan:
        """The plan that the circumstances of the points call for: a bias force pushes on a one-sided wall, a
        perturbation displaces the device by what it bends the wall. What a point does not say is the median of
        those that do.

        disturbance, visible  of all trials [m]; None: as each point says it
        """
        loop = point.contact_loop
        step = max((counter.step for counter in loop.plant.nonlinear.counters), default=0.0)
        pushes, forces, times = (
            _filled(points.circumstances.get(name), len(points))
            for name in ("bias_force_N", "perturbation_N", "watch_time_s")
        )
        seen = _filled(points.visible, len(points))
        disturbing = []
        for i, stiffness in enumerate(points.stiffness.tolist()):
            by_force = forces[i] > 0.0 and stiffness != 0.0
            moved = (
                (float(forces[i] / abs(stiffness)) if by_force else DISTURBANCE)
                if disturbance is None
                else disturbance
            )
            least = float(seen[i]) if seen[i] > 0.0 else VISIBLE_STEPS * step
            # half the displacement at most: the displacement itself must count as seen
            limit = min(least, 0.5 * moved) if visible is None else visible
            time = float(times[i]) if times[i] > 0.0 else None
            disturbing.append(Disturbing(max(float(pushes[i]), 0.0), moved, limit, time))
        smooth = not isinstance(loop.controller.velocity, Foaw | Levant)
        reason = (
            f"the device has {comma_list(loop.nonlinear.kinds)}"
            if smooth
            else "the velocity estimate is not linear"
        )
        return cls(tuple(disturbing), reason)

    @property
    def sentence(self) -> str:
        """What the points are compared with, and why, in words."""
        pushes = [one.push for one in self.disturbing if one.push > 0.0]
        moves = [one.disturbance for one in self.disturbing if not one.push > 0.0]
        hows = list[str]()
        if pushes:
            hows.append(f"a one-sided wall touched with {_span(pushes)} N at {TOUCH_SPEED:g} m/s")
        if moves:
            hows.append(f"a two-sided wall, displaced by {_span(moves)} m")
        if times := [one.watch_time for one in self.disturbing if one.watch_time is not None]:
            hows.append(f"watched for {_span(times)} s")
        return (
            f"trials on the simulated device, because {self.reason}, and the boundary hangs on the amplitude: "
            f"{comma_list(hows)}; vibrations up to {_span([one.visible for one in self.disturbing])} m count as "
            "none"
        )

    def groups(self) -> dict[Disturbing, NDArray[np.intp]]:
        """Way of disturbing -> indices of the points that are disturbed so."""
        return {
            how: np.array([i for i, own in enumerate(self.disturbing) if own == how])
            for how in dict.fromkeys(self.disturbing)
        }


def _span(values: Sequence[float]) -> str:
    """The least and the largest of some values, in words."""
    low, high = min(values), max(values)
    return f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g}"


def _filled(values: Floats | None, count: int) -> Floats:
    """Values (n,), nan replaced by the median of the others; 0 where none is known."""
    known = np.empty(0) if values is None else values[np.isfinite(values)]
    if values is None or not len(known):
        return np.zeros(count)
    return np.where(np.isfinite(values), values, float(np.median(known)))


def trial_of(how: Disturbing, parameters: BoundaryParameters, vector: Floats) -> StabilityTrial:
    """The trial on the device with these numbers. Raises ArgumentError, and ValueError for no such device."""
    return StabilityTrial(
        parameters.contact_loop(vector),
        Hand(operator=parameters.operator(vector), push=how.push),
        one_sided=how.push > 0.0,
        disturbance=how.disturbance,
        speed=TOUCH_SPEED if how.push > 0.0 else 0.0,
        visible=how.visible,
        watch_time=how.watch_time,
    )


def needs_trials(point: OperatingPoint, through: str | None) -> bool:
    """Whether the points are to be compared with trials: by the user's word, or as friction wants it.

    through  "chart" or "experiment", as the user says; None: left to the device
    """
    if through:
        return through == "experiment"
    if point.response is not None or point.charted_by_response:
        return False
    loop = point.contact_loop
    return "dry friction" in loop.nonlinear.kinds or isinstance(loop.controller.velocity, Foaw | Levant)


class EdgeCrossing(NamedTuple):
    """Where trials find the edges (n,) of points.

    value      damping of the edge [N s/m]; its stiffness [N/m] where `tip`; nan where there is none
    tip        whether the edge was met along stiffness
    inward     1 where larger values are stable, -1 where smaller ones are
    frequency  of the vibration beyond the edge [Hz]
    """

    value: Floats
    tip: Flags
    inward: Floats
    frequency: Floats

    def only(self, some: Flags) -> EdgeCrossing:
        """The edges for which `some` (n,) is true."""
        return EdgeCrossing(self.value[some], self.tip[some], self.inward[some], self.frequency[some])


@dataclass(frozen=True)
class SimulatedEdges:
    """Edges (n,) of the points and of the walls that were tried, as trials find them, linear in the numbers.

    centre  (p,) v_k
    at      there;  slopes (n, p) of what was bisected
    """

    centre: Floats
    at: EdgeCrossing
    slopes: Floats

    def values(self, vector: Floats) -> Floats:
        """Damping, or stiffness of a tip, at the edge (n,), of the device with numbers (p,) of a vector."""
        return np.asarray(self.at.value + self.slopes @ (vector - self.centre))

    def only(self, some: Flags) -> SimulatedEdges:
        """The edges for which `some` (n,) is true."""
        return SimulatedEdges(self.centre, self.at.only(some), self.slopes[some])


@dataclass
class TrialModel(BoundaryModel):
    """Points of a boundary beside edges `simulated` by trials; `lost`: points at which the trials have none."""

    simulated: SimulatedEdges = field(kw_only=True)
    lost: BoundaryPoints = field(kw_only=True)

    def interpolated(self, vector: Floats) -> bool:
        """False: the simulated edge is exactly linear in the numbers."""
        return False

    def deviations(self, vector: Floats, scatter: Scatter) -> Deviations:
        """Deviations of the points on the boundary from the simulated edge, for numbers (p,)."""
        some = self.points.on_edge
        edges, own = self.points[some], self.simulated.only(some)
        at = own.values(vector)
        tip = edges.kind == TIP
        exact = np.column_stack([np.where(tip, at, edges.stiffness), np.where(tip, edges.damping, at)])
        unit = np.where(edges.kind == EDGE, scatter.damping, 1.0)
        missing = np.zeros(len(edges), dtype=bool)
        return Deviations((edges.bisected - at) / unit, missing, exact, edges.frequency - own.at.frequency)

    def depths(self, vector: Floats, scatter: Scatter) -> Floats:
        """How far (m,) walls that were tried lie on the right side of the simulated edge, along damping, and along
        stiffness where no damping is stable, in units of the scatter."""
        some = ~self.points.on_edge
        tried, own = self.points[some], self.simulated.only(some)
        value = np.where(own.at.tip, tried.stiffness, tried.damping)
        unit = np.where(own.at.tip, scatter.stiffness, scatter.damping)
        depth = own.at.inward * (value - own.values(vector)) / unit
        return np.where(tried.kind == STABLE, depth, -depth)

    def only(self, some: Flags) -> BoundaryModel:
        """The model with some of its points (n,)."""
        return replace(self, points=self.points[some], simulated=self.simulated.only(some), _edges={})


def model_by_trials(
    model: BoundaryModel, parameters: BoundaryParameters, plan: TrialPlan, report: Progress
) -> BoundaryModel:
    """The points beside simulated edges near the numbers that fit them best; points at which no trial has an edge
    are left out.

    Raises  DeviceError  where the trials cannot be made, or have too few edges
    """
    label = parameters.device.label
    x = fit_boundary(model, parameters, profiled=False).vector
    x = np.clip(x, parameters.start - 3.0, parameters.start + 3.0)  # by a factor of 20 at most
    slopes, sloped_at = np.empty((0, 0)), np.full(len(x), np.inf)
    by_trials: BoundaryModel = model
    for number in range(ROUNDS):
        report("simulating trials", number, ROUNDS)
        try:
            if not np.max(np.abs(x - sloped_at)) < SAME_SLOPES:
                slopes, sloped_at = _edge_slopes(model.points, parameters, plan, x), x
            by_trials = _model_at(model, parameters, plan, x, slopes)
        except (ArgumentError, ValueError) as error:
            raise fail(label, "", f"no trials can be simulated: {error}") from None
        if int(by_trials.points.on_edge.sum()) < len(x) + 1:
            edges = int(by_trials.points.on_edge.sum())
            raise fail(label, "", f"the simulated device has an edge at {edges} of the points only")
        new = fit_boundary(by_trials, parameters, start=x, profiled=False).vector
        new = np.clip(new, x - 1.0, x + 1.0)  # as far as the linear edges may hold
        moved, x = float(np.max(np.abs(new - x))), new
        if moved < STAYS:
            break
    report("simulating trials", ROUNDS, ROUNDS)
    return by_trials


def _model_at(
    model: BoundaryModel, parameters: BoundaryParameters, plan: TrialPlan, x: Floats, slopes: Floats
) -> TrialModel:
    """The model with edges simulated at numbers x (p,), which move with them by known slopes (n, p)."""
    at = _simulated_edges(model.points, parameters, plan, x)
    known = np.isfinite(at.value) & np.isfinite(slopes).all(axis=1)
    edges = SimulatedEdges(x, at, slopes).only(known)
    return TrialModel(model.points[known], model.edge_of, simulated=edges, lost=model.points[~known])


def _edge_slopes(points: BoundaryPoints, parameters: BoundaryParameters, plan: TrialPlan, x: Floats) -> Floats:
    """Derivatives (n, p) of the simulated edges by the numbers at x (p,), by central differences; nan where they
    are not the same edge on both sides."""
    slopes = []
    for i in range(len(x)):
        edges, values = list[EdgeCrossing](), []
        for side in (-1.0, 1.0):
            moved = x.copy()
            step = MOVED if parameters.positive[i] else MOVED * max(abs(float(x[i])), 0.1)
            moved[i] = np.clip(x[i] + side * step, parameters.lower[i], parameters.upper[i])
            edges.append(_simulated_edges(points, parameters, plan, moved))
            values.append(float(moved[i]))
        one, other = edges
        same = (one.tip == other.tip) & (one.inward == other.inward)
        slopes.append(np.where(same, (other.value - one.value) / (values[1] - values[0]), np.nan))
    return np.column_stack(slopes)


def _simulated_edges(
    points: BoundaryPoints, parameters: BoundaryParameters, plan: TrialPlan, x: Floats
) -> EdgeCrossing:
    """What trials with numbers x (p,) find at the points and at the walls that were tried, each disturbed in its
    own way."""
    edge = parameters.edge(x)
    _, K1, _, B1 = edge.box  # largest stiffness [N/m] and damping [N s/m] of the chart's edge
    stiffest = edge.first[int(np.argmax(edge.first[:, 0]))] if len(edge) else np.array([K1, B1])
    # edges are looked for from a damping above 0; True: the chart's edge ends at its tip
    extent = StableExtent(float(stiffest[0]), max(float(stiffest[1]), 0.05 * B1), B1, True)
    found = EdgeCrossing(
        np.full(len(points), np.nan), points.kind == TIP, np.ones(len(points)), np.full(len(points), np.nan)
    )
    for how, group in plan.groups().items():
        in_group = _crossings(points[group], trial_of(how, parameters, x), extent)
        for whole, part in zip(found, in_group, strict=True):  # value, tip, inward, frequency
            whole[group] = part
    return found


def _crossings(points: BoundaryPoints, trial: StabilityTrial, place: StableExtent) -> EdgeCrossing:
    """The edges that one trial finds at points: along damping, or along stiffness for a tip; walls that were
    tried, and points of an unknown edge, are taken to the nearest edge along damping; the walls along stiffness
    where none was found.

    place  where stable walls are looked for
    """
    # kind of edge and chosen number -> bisected number and frequency
    ends = dict[tuple[str, float], tuple[float, float]]()
    along = points.kind != TIP
    if along.any():
        for edge in measure_edges(trial, np.unique(points.stiffness[along]), place):
            ends[edge.edge, edge.stiffness] = edge.damping, edge.frequency
    no_edge = (float("nan"), float("nan"))
    count = len(points)
    value, frequency, inward = np.full(count, np.nan), np.full(count, np.nan), np.ones(count)
    for i in np.flatnonzero(along):
        kinds = (str(points.kind[i]),) if points.kind[i] in (LOWER, UPPER) else (LOWER, UPPER)
        found = [(kind, *ends.get((kind, float(points.stiffness[i])), no_edge)) for kind in kinds]
        if known := [one for one in found if not isnan(one[1])]:
            kind, value[i], frequency[i] = min(known, key=lambda one: abs(one[1] - points.damping[i]))
            inward[i] = 1.0 if kind == LOWER else -1.0
    tip = ~along | (points.of(STABLE, UNSTABLE) & np.isnan(value))
    if tip.any():
        inward[tip] = -1.0  # softer walls are stable
        tips = measure_tips(trial, np.unique(points.damping[tip]), place)
        ends = {(TIP, edge.damping): (edge.stiffness, edge.frequency) for edge in tips}
        for i in np.flatnonzero(tip):
            value[i], frequency[i] = ends.get((TIP, float(points.damping[i])), no_edge)
    return EdgeCrossing(value, tip, inward, frequency)
