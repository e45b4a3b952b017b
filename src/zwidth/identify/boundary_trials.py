"""A measured boundary beside trials on the simulated device, where its linear chart does not tell the edge.

With dry friction a wall may be stable for a small disturbance and not for a large one, so that the edge hangs on
how the device was disturbed, pushed, and watched. The same is simulated at the measured stiffnesses: the damping
at which the verdict changes, for the numbers v_k and for each of them moved either way. The simulated edge is then
taken to be linear in the numbers, S + D (v - v_k), a fit gives v_{k+1}, and so on until the numbers stay.
Intervals follow the curvature there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import isnan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.contact.boundary_experiment import StableExtent, measure_edges, measure_tips
from zwidth.contact.hand import Hand
from zwidth.contact.stability_trial import StabilityTrial, TrialError
from zwidth.device.faults import comma_list, fail
from zwidth.identify.boundary_fit import fit_boundary
from zwidth.identify.boundary_model import BoundaryModel, Deviations, Scatter
from zwidth.identify.boundary_parameters import BoundaryParameters
from zwidth.identify.boundary_points import EDGE, LOWER, TIP, UPPER, BoundaryPoints
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.estimators.levant import Levant
from zwidth.loop.operating_point import OperatingPoint
from zwidth.progress import Progress

Floats = NDArray[np.float64]

DISTURBANCE: Final = 1e-3  # m
TOUCH_SPEED: Final = 0.02  # m/s
VISIBLE_STEPS: Final = 3.0  # encoder steps
MOVED: Final = 0.15  # by which a number's logarithm is moved to see how the simulated edge moves
ROUNDS: Final = 4
SAME_SLOPES: Final = 0.3  # change of the numbers' logarithms up to which the slopes are kept
STAYS: Final = 0.02  # change of the numbers' logarithms at which the rounds end


@dataclass(frozen=True)
class TrialPlan:
    """How the trials disturb the device.

    one_sided    a one-sided wall is touched under a push; else a two-sided one from a displacement
    push         [N];  disturbance [m];  visible [m]: amplitude up to which a vibration counts as none
    reason       why trials are simulated
    """

    one_sided: bool
    push: float
    disturbance: float
    visible: float
    reason: str

    @classmethod
    def of(
        cls, points: BoundaryPoints, point: OperatingPoint, disturbance: float | None, visible: float | None
    ) -> TrialPlan:
        """The plan that the circumstances of the points call for: a bias force pushes on a one-sided wall, a
        perturbation displaces the device by what it bends the wall."""
        around = points.circumstances
        push = _typical(around.get("bias_force_N"))
        if disturbance is None:
            force = _typical(around.get("perturbation_N"))
            disturbance = force / float(np.median(np.abs(points.stiffness))) if force > 0.0 else DISTURBANCE
        loop = point.contact_loop
        if visible is None:
            steps = [counter.step for counter in loop.plant.nonlinear.counters]
            visible = min(VISIBLE_STEPS * max(steps, default=0.0), 0.5 * disturbance)
        smooth = not isinstance(loop.controller.velocity, Foaw | Levant)
        reason = (
            f"the device has {comma_list(loop.nonlinear.kinds)}"
            if smooth
            else "the velocity estimate is not linear"
        )
        return cls(push > 0.0, push, disturbance, visible, reason)

    @property
    def sentence(self) -> str:
        """What the points are compared with, and why."""
        how = (
            f"a one-sided wall touched with {self.push:g} N at {TOUCH_SPEED:g} m/s"
            if self.one_sided
            else f"a two-sided wall, displaced by {self.disturbance:.3g} m"
        )
        return (
            f"trials on the simulated device, because {self.reason}, and the boundary hangs on the amplitude: "
            f"{how}; vibrations up to {self.visible:.3g} m count as none"
        )

    def trial(self, parameters: BoundaryParameters, vector: Floats) -> StabilityTrial:
        """The trial on the device with these numbers. Raises TrialError, and ValueError for no such device."""
        hand = Hand(operator=parameters.operator(vector), push=self.push)
        return StabilityTrial(
            parameters.contact_loop(vector),
            hand,
            one_sided=self.one_sided,
            disturbance=self.disturbance,
            speed=TOUCH_SPEED if self.one_sided else 0.0,
            visible=self.visible,
        )


def needs_trials(point: OperatingPoint, through: str | None) -> bool:
    """Whether the points are to be compared with trials: by the user's word, or as friction wants it."""
    if through:
        return through == "experiment"
    if point.response is not None or point.charted_by_response:
        return False
    loop = point.contact_loop
    return "dry friction" in loop.nonlinear.kinds or isinstance(loop.controller.velocity, Foaw | Levant)


@dataclass(frozen=True)
class SimulatedEdges:
    """Edges (n,) at the points on the boundary, as trials find them, linear in the numbers.

    centre     (p,) v_k
    value      (n,) what was bisected;  slopes (n, p)
    frequency  (n,) of the vibration beyond the edge [Hz]
    """

    centre: Floats
    value: Floats
    slopes: Floats
    frequency: Floats


@dataclass
class TrialModel(BoundaryModel):
    """Points beside simulated edges."""

    simulated: SimulatedEdges = field(kw_only=True)

    def interpolated(self, vector: Floats) -> bool:
        """The edge is linear in the numbers, exactly."""
        return False

    def deviations(self, vector: Floats, scatter: Scatter) -> Deviations:
        """The points on the boundary beside the simulated edge."""
        edges, own = self.points[self.points.on_edge], self.simulated
        at = own.value + own.slopes @ (vector - own.centre)
        tip = edges.kind == TIP
        exact = np.column_stack([np.where(tip, at, edges.stiffness), np.where(tip, edges.damping, at)])
        unit = np.where(edges.kind == EDGE, scatter.damping, 1.0)
        missing = np.zeros(len(edges), dtype=bool)
        return Deviations((edges.bisected - at) / unit, missing, exact, edges.frequency - own.frequency)

    def only(self, some: NDArray[np.bool_]) -> BoundaryModel:
        """The model with some of its points (n,)."""
        kept, own = some[self.points.on_edge], self.simulated
        edges = SimulatedEdges(own.centre, own.value[kept], own.slopes[kept], own.frequency[kept])
        return replace(self, points=self.points[some], simulated=edges, _edges={})


def model_by_trials(
    model: BoundaryModel, parameters: BoundaryParameters, plan: TrialPlan, report: Progress
) -> BoundaryModel:
    """The points beside simulated edges near the numbers that fit them best; points at which no trial has an edge
    are left out.

    Raises  DeviceError  where the trials cannot be made, or have too few edges
    """
    label = parameters.device.label
    x = fit_boundary(model, parameters, profiled=False).vector
    x = np.clip(x, parameters.start - 3.0, parameters.start + 3.0)
    slopes, sloped_at = np.empty((0, 0)), np.full(len(x), np.inf)
    by_trials: BoundaryModel = model
    for number in range(ROUNDS):
        report("simulating trials", number, ROUNDS)
        try:
            if not np.max(np.abs(x - sloped_at)) < SAME_SLOPES:
                slopes, sloped_at = _slopes(model.points, parameters, plan, x), x
            by_trials = _around(model, parameters, plan, x, slopes)
        except (TrialError, ValueError) as error:
            raise fail(label, "", f"no trials can be simulated: {error}") from None
        if int(by_trials.points.on_edge.sum()) < len(x) + 1:
            edges = int(by_trials.points.on_edge.sum())
            raise fail(label, "", f"the simulated device has an edge at {edges} of the points only")
        new = fit_boundary(by_trials, parameters, start=x, profiled=False).vector
        new = np.clip(new, x - 1.0, x + 1.0)
        moved, x = float(np.max(np.abs(new - x))), new
        if moved < STAYS:
            break
    report("simulating trials", ROUNDS, ROUNDS)
    return by_trials


def _around(
    model: BoundaryModel, parameters: BoundaryParameters, plan: TrialPlan, x: Floats, slopes: Floats
) -> TrialModel:
    """Simulated edges at numbers x, that move with them by known slopes (n, p)."""
    points = model.points
    at, frequency = _simulated(points, parameters, plan, x)
    known = np.isfinite(at) & np.isfinite(slopes).all(axis=1)
    kept = np.ones(len(points), dtype=bool)
    kept[points.on_edge] = known
    edges = SimulatedEdges(x, at[known], slopes[known], frequency[known])
    return TrialModel(points[kept], model.edge_of, simulated=edges)


def _slopes(points: BoundaryPoints, parameters: BoundaryParameters, plan: TrialPlan, x: Floats) -> Floats:
    """How the simulated edges (n, p) move with each number, by central differences."""
    slopes = []
    for i in range(len(x)):
        ends, places = [], []
        for side in (-1.0, 1.0):
            moved = x.copy()
            step = MOVED if parameters.positive[i] else MOVED * max(abs(float(x[i])), 0.1)
            moved[i] = np.clip(x[i] + side * step, parameters.lower[i], parameters.upper[i])
            ends.append(_simulated(points, parameters, plan, moved)[0])
            places.append(float(moved[i]))
        slopes.append((ends[1] - ends[0]) / (places[1] - places[0]))
    return np.column_stack(slopes)


def _simulated(
    points: BoundaryPoints, parameters: BoundaryParameters, plan: TrialPlan, x: Floats
) -> tuple[Floats, Floats]:
    """What the trials find (n,) at the points on the boundary, nan where they have no edge there, and the
    frequency beyond."""
    trial = plan.trial(parameters, x)
    chart = parameters.edge(x)
    _, K1, _, B1 = chart.box
    tip = chart.first[int(np.argmax(chart.first[:, 0]))] if len(chart) else np.array([K1, B1])
    inside = max(float(tip[1]), 0.05 * B1)
    place = StableExtent(float(tip[0]), inside, B1, True)
    edges = points[points.on_edge]
    at, frequency = np.full(len(edges), np.nan), np.full(len(edges), np.nan)
    along = edges.kind != TIP
    measured = dict[tuple[str, float], tuple[float, float]]()
    if along.any():
        for one in measure_edges(trial, np.unique(edges.stiffness[along]), place):
            measured[one.edge, one.stiffness] = one.damping, one.frequency
    if (~along).any():
        for one in measure_tips(trial, np.unique(edges.damping[~along]), place):
            measured[one.edge, one.damping] = one.stiffness, one.frequency
    nothing = (float("nan"), float("nan"))
    for i in range(len(edges)):
        kinds = (LOWER, UPPER) if edges.kind[i] == EDGE else (str(edges.kind[i]),)
        ends = [measured.get((kind, float(edges.chosen[i])), nothing) for kind in kinds]
        known = [end for end in ends if not isnan(end[0])]
        if known:
            at[i], frequency[i] = min(known, key=lambda end: abs(end[0] - edges.bisected[i]))
    return at, frequency


def _typical(values: NDArray[np.float64] | None) -> float:
    """Median of what is known; 0 where nothing is."""
    known = np.empty(0) if values is None else values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0
