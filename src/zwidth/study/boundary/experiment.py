"""A virtual experiment: measure a stability boundary with several subjects and trials, and find its causes.

Subjects are operators: the five numbers of the preset, each times exp(spread n), n normal. Trials of one subject
differ in the noise and, by such a factor each, in the disturbance, the speed and the push. A single subject is the
preset operator, and a single trial has the disturbance, speed and push of the plan. All random numbers follow from
the seed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial
from math import inf, nan
from pathlib import Path
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.chart.edge_crossings import EdgeKind, exact_edge
from zwidth.conditions.traits import reading_noise, reading_step
from zwidth.contact.boundary_experiment import (
    TIP_SHARE,
    EdgePoint,
    StableExtent,
    find_stable_walls,
    measure_edges,
    measure_tips,
    tip_dampings,
)
from zwidth.contact.hand import Hand, Reflex
from zwidth.contact.stability_trial import StabilityTrial
from zwidth.errors import ArgumentError, ChartError, NonlinearError
from zwidth.loop.controller import check_no_load
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.operator import Operator, attach
from zwidth.progress import Progress
from zwidth.study.boundary.measured_boundary import Cause, Experiment, MeasuredPoint, Plan
from zwidth.study.boundary.points_file import UserPoint, compare_points
from zwidth.study.jobs.journal import Journal, fingerprint

EXPLAINED: Final = 3  # number of stiffnesses at which the edges are measured again to find causes
STEPS: Final = 3.0  # encoder steps: a vibration of this amplitude is just visible
NOISES: Final = 10.0  # standard deviations of the encoder's noise, likewise
STIFFENED: Final = 2.0  # a reflex adds this multiple of the stiffness and damping of arm and grasp


def question(loop: Loop, operator: Operator | None, plan: Plan) -> str:
    """Fingerprint by which a journal recognises the experiment."""
    return fingerprint("experiment 3", loop, operator, plan)


def measure_boundary(
    point: OperatingPoint,
    plan: Plan | None = None,
    user_points: Sequence[UserPoint] = (),
    *,
    file: str | Path | None = None,
    progress: Progress | None = None,
    causes: bool = True,
) -> Experiment:
    """Measure a stability boundary on the simulated device at one operating point, held by its operator.

    user_points  points measured on a real device, to be compared with the same exact chart
    file         journal that keeps the trials done, from which an interrupted run continues; None: no journal
    causes       measure again without each nonlinear part (friction, encoder steps, force limit) in turn
    Raises       StoreError  for a file that is not a journal, or of a newer version
                 OSError       where it cannot be read or written
                 what `run_experiment` and `OperatingPoint.plant` raise
    """
    check_kind("point", point, OperatingPoint)
    plan = plan or Plan()
    loop = point.contact_loop
    if plan.one_sided:
        check_no_load(loop.plant, "a boundary of one-sided walls is not measured", "measure two-sided ones")
    operator = None if loop.plant.handle is None else point.operator
    journal = Journal(None if file is None else Path(file), question(loop, operator, plan))
    result = run_experiment(loop, operator, plan, journal, progress, causes and bool(loop.nonlinear))
    return replace(result, user_points=compare_points(result.chart, user_points)) if user_points else result


def run_experiment(
    loop: Loop,
    operator: Operator | None = None,
    plan: Plan | None = None,
    journal: Journal | None = None,
    progress: Progress | None = None,
    causes: bool = False,
) -> Experiment:
    """Measure a stability boundary by simulated trials (`contact.boundary_experiment` says how).

    loop      the device without its operator, and its computer
    operator  the operator who holds it; None: no operator
    journal   keeps the trials done (see `question`); None: no journal
    causes    measure again without each nonlinear part in turn
    Raises    ArgumentError         for numbers of the plan that cannot be used
              NoAnswerError  where no stable wall was found
              HysteresisError, UnmovedError  as `simulate_batch`

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> mass = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> loop = Loop(mass, Controller(0.001))
    >>> experiment = run_experiment(loop, plan=Plan(stiffnesses=2, tips=1))
    >>> [point.edge for point in experiment.points]
    ['lower', 'lower', 'upper', 'upper', 'tip']
    >>> bool(abs(experiment.points[-1].stiffness / 68629.15 - 1) < 1e-4)    # (12 - 8 sqrt 2) m/T^2 (thesis 4.14)
    True
    """
    plan = _with_visible(loop, plan or Plan())
    journal = journal or Journal(None, "")
    report = progress or (lambda stage, done, of: None)
    subjects = _subjects(operator, plan)
    first = _stability_trial(loop, operator, plan)  # as planned, nothing varied
    report_search = partial(report, "looking for stable walls")
    place = StableExtent(
        *journal.get_or_compute("place", lambda: _field_values(find_stable_walls(first, plan.box, report_search)))
    )
    report_search(1, 1)
    low = 0.0 if plan.box is None else max(plan.box.stiffness[0], 0.0)
    top = TIP_SHARE * place.stiffness
    grid = low + (top - low) * np.arange(1, plan.stiffnesses + 1) / plan.stiffnesses
    total_trials, done, runs = plan.subjects * plan.trials, 0, []
    dampings: Floats | None = None  # at which tips are measured: found in the first trial, the same in all
    for subject_number, subject in enumerate(subjects):
        for trial_number in range(plan.trials):
            report("measuring the boundary", done, total_trials)
            trial = _trial(loop, subject, plan, subject_number, trial_number)
            name = f"subject {subject_number} trial {trial_number}"
            edges = _edge_points(journal, f"{name} edges", partial(measure_edges, trial, grid, place, plan.box))
            if dampings is None:
                dampings = tip_dampings(edges, place, plan.tips) if plan.tips else np.empty(0)
            tips = _edge_points(journal, f"{name} tips", partial(measure_tips, trial, dampings, place, plan.box))
            runs.append([*edges, *tips])
            done += 1
            report("measuring the boundary", done, total_trials)
    chart = _exact_chart(loop, operator)
    points, lost = _combine_trials(runs, chart, 2 * len(grid) + len(dampings if dampings is not None else ()))
    cause_list = _causes(loop, operator, plan, place, runs[0], journal, report) if causes else ()
    return Experiment(plan, place, points, lost, subjects, chart, cause_list, journal.entries_read)


def _with_visible(loop: Loop, plan: Plan) -> Plan:
    """The plan; where it has no visible amplitude [m], with STEPS steps and NOISES standard deviations of the
    noise of this loop's encoder."""
    if plan.visible is not None:
        return plan
    method = loop.controller.velocity
    # an adaptive window does not resolve motions within its noise band
    noise_band = 2.0 * method.position_noise if isinstance(method, Foaw) else 0.0
    steps, noise = reading_step(loop.plant), reading_noise(loop.plant)
    return replace(plan, visible=STEPS * max(steps, noise_band) + NOISES * noise)


def _subjects(operator: Operator | None, plan: Plan) -> tuple[Operator | None, ...]:
    """One operator for each subject of the plan: of one subject `operator` himself, of several varied ones;
    (None,) without an operator. Raises ArgumentError where a plan needs one: for several subjects, or a reflex."""
    if operator is None:
        if plan.subjects > 1 or plan.reflex:
            argument, verb = ("subjects", "differ") if plan.subjects > 1 else ("reflex", "is")
            reason = f"{verb} in the arm that holds the device; give an operator"
            raise ArgumentError(argument, reason)
        return (None,)
    if plan.subjects == 1:
        return (operator,)
    return tuple(
        _varied(operator, np.random.default_rng([plan.seed, s]), plan.spread) for s in range(plan.subjects)
    )


def _varied(operator: Operator, random: np.random.Generator, spread: float) -> Operator:
    """The operator with each number times its own log-normal factor exp(spread n)."""
    names = [field.name for field in fields(operator) if field.name != "directions"]
    numbers = {name: getattr(operator, name) for name in names}
    factors = np.exp(spread * random.standard_normal(len(numbers))).tolist()
    return replace(
        operator,
        **{
            name: value * factor
            for (name, value), factor in zip(numbers.items(), factors, strict=True)
            if value is not None
        },
    )


def _stability_trial(
    loop: Loop,
    operator: Operator | None,
    plan: Plan,
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0),
    seed: int = 0,
) -> StabilityTrial:
    """The trial of a plan, with its disturbance, speed and push times `factors`, in this order; a reflex acts from
    half the push on.

    seed  of the encoders' noise
    """
    disturbance, speed, push = factors[0] * plan.disturbance, factors[1] * plan.speed, factors[2] * plan.push
    reflex = None
    if plan.reflex and operator is not None:
        reflex = Reflex(
            threshold=0.5 * abs(push),
            arm_stiffness=STIFFENED * operator.arm_stiffness,
            arm_damping=STIFFENED * operator.arm_damping,
            grasp_stiffness=STIFFENED * (operator.grasp_stiffness or 0.0),
            grasp_damping=STIFFENED * (operator.grasp_damping or 0.0),
        )
    hand = Hand(operator, push=push, reflex=reflex)
    return StabilityTrial(loop, hand, plan.one_sided, disturbance, speed, plan.visible or 0.0, seed)


def _trial(loop: Loop, operator: Operator | None, plan: Plan, subject: int, trial: int) -> StabilityTrial:
    """One trial of one subject, both by their numbers from 0, from which its random numbers follow.

    operator  the subject
    """
    factors = (1.0, 1.0, 1.0)
    if plan.trials > 1:
        random = np.random.default_rng([plan.seed, subject, trial])
        factors = tuple(np.exp(plan.spread * random.standard_normal(3)).tolist())
    seed = (plan.seed * 1000 + subject) * 1000 + trial  # another one for each of 1000 subjects and trials
    return _stability_trial(loop, operator, plan, factors, seed)


def _field_values(record: Any) -> list[Any]:
    """The fields of a dataclass in their order, as a journal keeps them."""
    return [getattr(record, field.name) for field in fields(record)]


def _edge_points(journal: Journal, name: str, compute: Callable[[], list[EdgePoint]]) -> list[EdgePoint]:
    """The points that the journal keeps under this name; `compute` measures them where it has none."""
    return [
        EdgePoint(*numbers)
        for numbers in journal.get_or_compute(name, lambda: [_field_values(p) for p in compute()])
    ]


def _exact_chart(loop: Loop, operator: Operator | None) -> StabilityChart | None:
    """The exact chart of the loop held by the operator; None where it has none."""
    held = loop if operator is None else Loop(attach(loop.plant, operator), loop.controller)
    try:
        return stability_chart(held, decay=False).drawn()
    except (NonlinearError, ChartError):
        return None


def _combine_trials(
    runs: list[list[EdgePoint]], chart: StabilityChart | None, requested_points: int
) -> tuple[tuple[MeasuredPoint, ...], int]:
    """Join the points of all trials by edge and chosen stiffness or damping, and average what was bisected.

    runs              points of each trial
    chart             exact one, for the number that was bisected; None: nan
    requested_points  number of points that were looked for

    Returns  the points, lower edges first, then upper ones and tips; and how many no trial found
    """
    by_edge: dict[tuple[EdgeKind, float], list[EdgePoint]] = {}
    for points in runs:
        for point in points:
            chosen = point.damping if point.edge == "tip" else point.stiffness
            edge_points = by_edge.setdefault((point.edge, chosen), [])
            if point.unstable_behaviour is not None:  # else this trial found no edge here
                edge_points.append(point)
    order = {"lower": 0, "upper": 1, "tip": 2}
    combined = []
    for (edge, chosen), points in sorted(by_edge.items(), key=lambda item: (order[item[0][0]], item[0][1])):
        if not points:
            continue
        values = tuple(p.stiffness if edge == "tip" else p.damping for p in points)
        mean = sum(values) / len(values)
        K, B = (mean, chosen) if edge == "tip" else (chosen, mean)
        exact = nan if chart is None else exact_edge(chart, K, B, edge)
        first = points[0]
        observation = (first.unstable_behaviour, first.amplitude, first.frequency)
        combined.append(
            MeasuredPoint(
                K,
                B,
                edge,
                min(values),
                max(values),
                len(values),
                values,
                exact,
                *observation,
                any(p.unsure for p in points),
            )
        )
    return tuple(combined), requested_points - len(combined)


def _causes(
    loop: Loop,
    operator: Operator | None,
    plan: Plan,
    place: StableExtent,
    points: list[EdgePoint],
    journal: Journal,
    report: Progress,
) -> tuple[Cause, ...]:
    """The edges measured again without each nonlinear part, at EXPLAINED of the stiffnesses of `points`, those of
    the first trial with all parts."""
    names = loop.nonlinear.kinds
    grid = sorted({p.stiffness for p in points if p.edge == "lower"})
    picked = [grid[i] for i in np.unique(np.linspace(0, len(grid) - 1, min(EXPLAINED + 2, len(grid))).astype(int))]
    picked = picked[1:-1] or picked  # without the lowest and the highest stiffness
    compared = [p for p in points if p.edge != "tip" and p.stiffness in picked]
    causes = []
    for done, name in enumerate(names):
        report("measuring without each part", done, len(names))
        trial = _stability_trial(without(loop, name), operator, plan)
        again = partial(measure_edges, trial, np.array(picked), place, plan.box)
        remeasured = _edge_points(journal, f"without {name}", again)
        damping = {(p.edge, p.stiffness): p.damping for p in remeasured}
        causes.append(
            Cause(name, tuple(compared), tuple(damping.get((p.edge, p.stiffness), nan) for p in compared))
        )
    report("measuring without each part", len(names), len(names))
    return tuple(causes)


def without(loop: Loop, name: str) -> Loop:
    """The loop without one nonlinear part, named as in `Nonlinear.kinds`. Raises ValueError for another name."""
    computer, nonlinear = loop.controller, loop.plant.nonlinear
    match name:
        case "dry friction":
            nonlinear = replace(nonlinear, friction=())
        case "encoder steps":
            nonlinear = replace(nonlinear, counters=tuple(replace(c, step=0.0) for c in nonlinear.counters))
        case "noise":
            nonlinear = replace(nonlinear, counters=tuple(replace(c, noise=0.0) for c in nonlinear.counters))
        case "nonlinear springs":
            nonlinear = replace(nonlinear, springs=())
        case "programmable brakes":
            nonlinear = replace(nonlinear, brakes=())
        case "the force limit":
            nonlinear, computer = replace(nonlinear, force_limit=inf), replace(computer, force_limit=inf)
        case _:
            raise ValueError(f"name must be one of the nonlinear parts in Nonlinear.kinds, got {name!r}")
    if all(c.step == 0.0 and c.noise == 0.0 for c in nonlinear.counters):  # encoders that read exactly
        nonlinear = replace(nonlinear, counters=())
    return Loop(replace(loop.plant, nonlinear=nonlinear), computer)
