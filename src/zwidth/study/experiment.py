"""A virtual experiment with its subjects and trials, and what of the device explains the result.

Subjects are operators: the five numbers of the preset, each times exp(spread n), n normal. Trials of one subject
differ in the noise and, by such a factor each, in the disturbance, the speed and the push. A single subject is the
preset himself, and a single trial as it was asked for. The seed decides everything that is random.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial
from math import inf, isfinite, nan
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arc_joining import ChartError
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.conditions.dry import reading_noise, reading_step
from zwidth.contact.bench import Bench, BenchError
from zwidth.contact.experiment import (
    BESIDE,
    Box,
    Edge,
    EdgePoint,
    Place,
    find_place,
    measure_edges,
    measure_tips,
    tip_dampings,
)
from zwidth.contact.hand import Hand, Reflex
from zwidth.loop.estimator import NonlinearError
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.loop import Loop
from zwidth.model.operator import Operator, attach
from zwidth.study.exact_edge import exact_edge
from zwidth.study.journal import Journal, fingerprint

Floats = NDArray[np.float64]
# stage, done, of how many
Progress = Callable[[str, int, int], None]

FARTHEST, FASTEST = 1.0, 100.0  # m, m/s; no device moves by more, or faster
EXPLAINED: Final = 3  # stiffnesses at which causes are looked for
STEPS: Final = 3.0  # encoder steps that are just visible
NOISES: Final = 10.0  # standard deviations of the noise that are
STIFFENED: Final = 2.0  # a reflex adds so many times what arm and grasp have


@dataclass(frozen=True)
class Plan:
    """What is to be measured.

    one_sided    touch a one-sided wall with `push` [N] and `speed` [m/s]; else displace by `disturbance` [m]
    stiffnesses  at which the damping is bisected, twice;   tips  dampings at which the stiffness is
    visible      see `Bench` [m]; None: three encoder steps and ten standard deviations of the noise
    reflex       the hand stiffens threefold, 50 ms after half of the push is felt
    subjects, trials, spread, seed   see above
    box          where to look; None: everywhere
    Raises       BenchError  for numbers that cannot be meant
    """

    one_sided: bool = False
    stiffnesses: int = 16
    tips: int = 8
    disturbance: float = 1e-3
    visible: float | None = None
    push: float = 0.0
    speed: float = 0.0
    reflex: bool = False
    subjects: int = 1
    trials: int = 1
    spread: float = 0.2
    seed: int = 1
    box: Box | None = None

    def __post_init__(self) -> None:
        for name, least in (("stiffnesses", 1), ("tips", 0), ("subjects", 1), ("trials", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise BenchError(f"{name} must be {least} or more, got {getattr(self, name)}")
        for name, most, unit in (("disturbance", FARTHEST, "m"), ("speed", FASTEST, "m/s")):
            if isfinite(getattr(self, name)) and abs(getattr(self, name)) > most:
                raise BenchError(f"{name} must be {most:g} {unit} or less, got {getattr(self, name):g}")
        if not (isfinite(self.spread) and 0.0 <= self.spread <= 2.0):
            raise BenchError(f"spread must be from 0 to 2, got {self.spread!r}; 0.2 is 20 %")


@dataclass(frozen=True)
class MeasuredPoint:
    """One point of the boundary over all subjects and trials.

    stiffness, damping   the mean of what was bisected, and what was chosen
    edge                 which of the two was bisected: see `EdgePoint`
    low, high            of what was bisected, over the trials that found an edge
    trials               how many did;   runs (trials,)  what they found
    exact                the same number on the exact linear edge; nan where it has none
    beyond, amplitude, frequency   of the first trial: see `EdgePoint`
    unsure               of any trial: see `EdgePoint`
    """

    stiffness: float
    damping: float
    edge: Edge
    low: float
    high: float
    trials: int
    runs: tuple[float, ...]
    exact: float
    beyond: str | None
    amplitude: float
    frequency: float
    unsure: bool = False

    @property
    def bisected(self) -> float:
        """What was bisected: a stiffness at the tip, else a damping."""
        return self.stiffness if self.edge == "tip" else self.damping


@dataclass(frozen=True)
class Cause:
    """What one part of the device does to the edges: they are measured again without it.

    name       of the part, as `Nonlinear.left_out` has it
    points     with it;   without  the same points without it [N s/m]; nan: no edge was found
    """

    name: str
    points: tuple[EdgePoint, ...]
    without: tuple[float, ...]


@dataclass(frozen=True)
class Experiment:
    """What was measured.

    plan      with the visible amplitude that was used
    place     where the stable walls are
    points    lower edges, upper edges, tips; those found by no trial are left out
    lost      how many were sought and found by no trial
    subjects  who pushed; (None,) for nobody
    chart     the exact linear chart, held by the preset; None where the velocity estimate has none
    causes    of the difference; () for a linear device, and where they were not asked for
    kept      how many parts of the run were found in the journal
    """

    plan: Plan
    place: Place
    points: tuple[MeasuredPoint, ...]
    lost: int
    subjects: tuple[Operator | None, ...]
    chart: StabilityChart | None
    causes: tuple[Cause, ...]
    kept: int


def question(loop: Loop, operator: Operator | None, plan: Plan) -> str:
    """By which a journal knows the experiment."""
    return fingerprint("experiment 3", loop, operator, plan)


def measure(
    loop: Loop,
    operator: Operator | None = None,
    plan: Plan | None = None,
    journal: Journal | None = None,
    progress: Progress | None = None,
    causes: bool = False,
) -> Experiment:
    """A stability boundary as it is measured: see `contact.experiment` for how.

    loop      the device by itself, and its computer;   operator  the preset who holds it; None: nobody
    journal   keeps what is done (see `question`); None: nothing is kept
    causes    measure again without each part that is not linear
    Raises    BenchError      for numbers that cannot be meant
              NothingStable   where no stable wall was found
              HysteresisError, UnmovedError  as `simulate_batch`

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> mass = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> found = measure(Loop(mass, Controller(0.001)), plan=Plan(stiffnesses=2, tips=1))
    >>> [point.edge for point in found.points]
    ['lower', 'lower', 'upper', 'upper', 'tip']
    >>> bool(abs(found.points[-1].stiffness / 68629.15 - 1) < 1e-4)         # (12 - 8 sqrt 2) m/T^2 (thesis 4.14)
    True
    """
    plan = _with_visible(loop, plan or Plan())
    journal = journal or Journal(None, "")
    tell = progress or (lambda stage, done, of: None)
    subjects = _subjects(operator, plan)
    first = _bench(loop, operator, plan)
    look = partial(tell, "looking for stable walls")
    place = Place(*journal.ask("place", lambda: _numbers(find_place(first, plan.box, look))))
    look(1, 1)
    low = 0.0 if plan.box is None else max(plan.box.stiffness[0], 0.0)
    top = BESIDE * place.stiffness
    grid = low + (top - low) * np.arange(1, plan.stiffnesses + 1) / plan.stiffnesses
    of, done, runs = plan.subjects * plan.trials, 0, []
    dampings: Floats | None = None
    for s, subject in enumerate(subjects):
        for t in range(plan.trials):
            tell("measuring the boundary", done, of)
            bench, name = _trial(loop, subject, plan, s, t), f"subject {s} trial {t}"
            edges = _asked(journal, f"{name} edges", partial(measure_edges, bench, grid, place, plan.box))
            if dampings is None:
                dampings = tip_dampings(edges, place, plan.tips) if plan.tips else np.empty(0)
            tips = _asked(journal, f"{name} tips", partial(measure_tips, bench, dampings, place, plan.box))
            runs.append([*edges, *tips])
            done += 1
            tell("measuring the boundary", done, of)
    chart = _chart(loop, operator)
    points, lost = _together(runs, chart, 2 * len(grid) + len(dampings if dampings is not None else ()))
    why = _causes(loop, operator, plan, place, runs[0], journal, tell) if causes else ()
    return Experiment(plan, place, points, lost, subjects, chart, why, journal.kept)


def _with_visible(loop: Loop, plan: Plan) -> Plan:
    if plan.visible is not None:
        return plan
    method = loop.controller.velocity
    # within it adaptive windows tell nothing apart
    doubt = 2.0 * method.position_noise if isinstance(method, Foaw) else 0.0
    steps, noise = reading_step(loop.plant), reading_noise(loop.plant)
    return replace(plan, visible=STEPS * max(steps, doubt) + NOISES * noise)


def _subjects(operator: Operator | None, plan: Plan) -> tuple[Operator | None, ...]:
    if operator is None:
        if plan.subjects > 1 or plan.reflex:
            what = "subjects differ" if plan.subjects > 1 else "a reflex is"
            raise BenchError(f"{what} in the arm that holds the device, and nobody does; give an operator")
        return (None,)
    if plan.subjects == 1:
        return (operator,)
    return tuple(
        _varied(operator, np.random.default_rng([plan.seed, s]), plan.spread) for s in range(plan.subjects)
    )


def _varied(operator: Operator, random: np.random.Generator, spread: float) -> Operator:
    """Each number times a factor of its own, whose logarithm is normal."""
    factors = np.exp(spread * random.standard_normal(len(fields(operator)))).tolist()
    own = {field.name: getattr(operator, field.name) for field in fields(operator)}
    changed = {
        name: value * factor
        for (name, value), factor in zip(own.items(), factors, strict=True)
        if value is not None
    }
    return replace(operator, **changed)


def _bench(loop: Loop, operator: Operator | None, plan: Plan, seed: int = 0) -> Bench:
    reflex = None
    if plan.reflex and operator is not None:
        reflex = Reflex(
            threshold=0.5 * abs(plan.push),
            arm_stiffness=STIFFENED * operator.arm_stiffness,
            arm_damping=STIFFENED * operator.arm_damping,
            grasp_stiffness=STIFFENED * (operator.grasp_stiffness or 0.0),
            grasp_damping=STIFFENED * (operator.grasp_damping or 0.0),
        )
    try:
        hand = Hand(operator, push=plan.push, reflex=reflex)
    except ValueError as error:
        raise BenchError(str(error)) from None
    return Bench(loop, hand, plan.one_sided, plan.disturbance, plan.speed, plan.visible or 0.0, seed)


def _trial(loop: Loop, operator: Operator | None, plan: Plan, subject: int, trial: int) -> Bench:
    if plan.trials > 1:
        random = np.random.default_rng([plan.seed, subject, trial])
        disturbance, speed, push = np.exp(plan.spread * random.standard_normal(3)).tolist()
        plan = replace(
            plan, disturbance=plan.disturbance * disturbance, speed=plan.speed * speed, push=plan.push * push
        )
    return _bench(loop, operator, plan, seed=(plan.seed * 1000 + subject) * 1000 + trial)


def _numbers(found: Any) -> list[Any]:
    return [getattr(found, field.name) for field in fields(found)]


def _asked(journal: Journal, name: str, compute: Callable[[], list[EdgePoint]]) -> list[EdgePoint]:
    return [EdgePoint(*numbers) for numbers in journal.ask(name, lambda: [_numbers(p) for p in compute()])]


def _chart(loop: Loop, operator: Operator | None) -> StabilityChart | None:
    held = loop if operator is None else Loop(attach(loop.plant, operator), loop.controller)
    try:
        return stability_chart(held, decay=False)
    except (NonlinearError, ChartError):
        return None


def _together(
    runs: list[list[EdgePoint]], chart: StabilityChart | None, sought: int
) -> tuple[tuple[MeasuredPoint, ...], int]:
    """Points of all trials by what was chosen, and how many nobody found."""
    found: dict[tuple[Edge, float], list[EdgePoint]] = {}
    for points in runs:
        for point in points:
            chosen = point.damping if point.edge == "tip" else point.stiffness
            own = found.setdefault((point.edge, chosen), [])
            if point.beyond is not None:
                own.append(point)
    order = {"lower": 0, "upper": 1, "tip": 2}
    made = []
    for (edge, chosen), points in sorted(found.items(), key=lambda item: (order[item[0][0]], item[0][1])):
        if not points:
            continue
        values = tuple(p.stiffness if edge == "tip" else p.damping for p in points)
        mean = sum(values) / len(values)
        K, B = (mean, chosen) if edge == "tip" else (chosen, mean)
        exact = nan if chart is None else exact_edge(chart, K, B, edge)
        first = points[0]
        seen = (first.beyond, first.amplitude, first.frequency)
        made.append(
            MeasuredPoint(
                K,
                B,
                edge,
                min(values),
                max(values),
                len(values),
                values,
                exact,
                *seen,
                any(p.unsure for p in points),
            )
        )
    return tuple(made), sought - len(made)


def _causes(
    loop: Loop,
    operator: Operator | None,
    plan: Plan,
    place: Place,
    points: list[EdgePoint],
    journal: Journal,
    tell: Progress,
) -> tuple[Cause, ...]:
    names = loop.nonlinear.left_out
    grid = sorted({p.stiffness for p in points if p.edge == "lower"})
    picked = [grid[i] for i in np.unique(np.linspace(0, len(grid) - 1, min(EXPLAINED + 2, len(grid))).astype(int))]
    picked = picked[1:-1] or picked
    some = [p for p in points if p.edge != "tip" and p.stiffness in picked]
    made = []
    for done, name in enumerate(names):
        tell("measuring without each part", done, len(names))
        bench = _bench(without(loop, name), operator, plan)
        again = partial(measure_edges, bench, np.array(picked), place, plan.box)
        found = _asked(journal, f"without {name}", again)
        value = {(p.edge, p.stiffness): p.damping for p in found}
        made.append(Cause(name, tuple(some), tuple(value.get((p.edge, p.stiffness), nan) for p in some)))
    tell("measuring without each part", len(names), len(names))
    return tuple(made)


def without(loop: Loop, name: str) -> Loop:
    """The loop without one part that is not linear, by its name in `Nonlinear.left_out`."""
    computer, own = loop.controller, loop.plant.nonlinear
    match name:
        case "dry friction":
            own = replace(own, friction=())
        case "encoder steps":
            own = replace(own, counters=tuple(replace(c, step=0.0) for c in own.counters))
        case "noise":
            own = replace(own, counters=tuple(replace(c, noise=0.0) for c in own.counters))
        case "nonlinear springs":
            own = replace(own, springs=())
        case "programmable brakes":
            own = replace(own, brakes=())
        case "the force limit":
            own, computer = replace(own, force_limit=inf), replace(computer, saturation=inf)
        case _:
            raise ValueError(f"{name!r} is no part that is not linear")
    if all(c.step == 0.0 and c.noise == 0.0 for c in own.counters):
        own = replace(own, counters=())
    return Loop(replace(loop.plant, nonlinear=own), computer)
