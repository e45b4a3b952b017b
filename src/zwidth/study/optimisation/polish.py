"""Polish of designs that a search has found: steps of linear programs over what is known to first order.

A worst value over many points is the least of many smooth functions, and a largest stiffness is itself the
lesser of two where arcs of the edge meet. The best design mostly lies where such functions change places: on a
ridge, where no single derivative is of use. So a bundle of them is kept: values at all points of the task, with
their derivatives, at the design and at designs near by that were tried and found worse. The step is the solution
of a linear program,

    the largest s,  such that every objective j becomes better by s w_j, to first order at each point, seen from
                    each design of the bundle; every demand is kept, seen so, and no variable moves by more than D

It is tried at several lengths. Where it does not keep what it promised, the nearest of the designs tried joins
the bundle, and D shrinks. Bundles for one objective: Lemarechal 1975, Schramm and Zowe 1992 (both known at second
hand).

Values are exact, and so are their differences: over 1e-5 of the bounds, of the second order inside and at the
bounds (`gradients`). Where two roots of the loop meet, as at the fastest-decaying wall, a value has an upright
tangent and no first order: there single variables are changed by ever smaller amounts (`_probes`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.study.optimisation.evaluation import DesignJudgement
from zwidth.study.optimisation.problem import Problem
from zwidth.study.optimisation.search import continuous

Judges: TypeAlias = Callable[[Floats], DesignJudgement]

STEP: Final = 1e-5  # of the bounds, by which designs are changed for derivatives
REACH: Final = 0.1  # of the bounds: largest first step
SMALLEST: Final = 1e-9  # steps and gains below are none
ROUNDING: Final = 1e-13  # gains below are chance
KEPT: Final = 12  # designs in a bundle
TRIED: Final = 0.3  # share of the budget after which, with one objective, only the best design is polished
NEAR: Final = 4.0  # times D: farther designs say nothing of the next step
LENGTHS: Final = (1.0, 0.5, 0.1)  # at which a step is tried
PROBED: Final = 1e-3  # of the bounds, by which single variables are changed at first where no step is left
PROBES: Final = (1.0, 0.25, 0.0625)  # of that, tried at once; then the last of them, and so on


@dataclass(frozen=True)
class _Linear:
    """Values and derivatives of objectives and demands at one design, from which others are estimated.

    shares      (f,)  its free variables
    objectives  of each, less being better: values (p,) at p points, and their derivatives (p, f)
    demands     of each, likewise
    """

    shares: Floats
    objectives: list[tuple[Floats, Floats]]
    demands: list[tuple[Floats, Floats]]


@dataclass
class _Design:
    """A design that is polished.

    shares      (v,)   its variables
    judgement   of it
    joining     shares and judgement of each design that joins the bundle next
    bundle      the newest last
    reach       D, of the bounds
    bend        violation of demands per square of a step's length: by so much D^2 more than needed the next step
                keeps them
    probing     by how much single variables are changed next, of the bounds; 0: by steps of the program
    done        whether nothing makes it better
    """

    shares: Floats
    judgement: DesignJudgement
    joining: list[tuple[Floats, DesignJudgement]]
    bundle: list[_Linear] = field(default_factory=list)
    reach: float = REACH
    bend: float = 0.0
    probing: float = 0.0
    done: bool = False


def polish(
    problem: Problem, shares: Floats, judgements: DesignJudgement, weights: Floats, judge: Judges, budget: int
) -> int:
    """Improve designs in all objectives together; what is tried is judged by `judge`, which keeps it.

    shares      (k, v)  of designs that keep all demands
    judgements  of them
    weights     (m,)  how much better in each objective counts as much as in another: ranges of the front
    budget      designs that may be judged
    Returns     number of designs judged
    """
    free = np.flatnonzero(continuous(problem.variables))
    each = [(row, judgements[n : n + 1]) for n, row in enumerate(shares)] if len(free) else []
    designs = [_Design(row, judged, [(row, judged)]) for row, judged in each]
    spent, around = 0, 2 * len(free)
    while pending := [one for one in designs if not one.done]:
        if len(weights) == 1 and spent > TRIED * budget:
            pending = [min(pending, key=lambda one: one.judgement.costs(problem)[0, 0])]
        probing = bool(pending[0].probing)
        # designs judged for each: probes; else the neighbours of at most two that join its bundle, and its trials
        needed = around * len(PROBES) if probing else 2 * around + len(LENGTHS)
        # those that go on as the first does, by probes or by steps; the others wait
        pending = [one for one in pending if bool(one.probing) == probing][: (budget - spent) // needed]
        if not pending:
            break
        if probing:
            spent += _try_all(problem, [(one, _probes(one, free)) for one in pending], weights, judge)
            continue
        spent += _extend_bundles(problem, pending, free, judge)
        moving = []
        for one in pending:
            step = _step(problem, one, free, weights)
            if step is None:
                one.probing = PROBED
            else:
                moving.append((one, _trials(one.shares, free, step)))
        spent += _try_all(problem, moving, weights, judge) if moving else 0
    return spent


def _extend_bundles(problem: Problem, designs: list[_Design], free: Ints, judge: Judges) -> int:
    """Add to each bundle the designs that are to join it (`joining`), with their derivatives by the `free`
    variables; the oldest beyond KEPT leave it. Returns the number of designs judged, neighbours of these."""
    joining = [(one, *new) for one in designs for new in one.joining]
    if not joining:
        return 0
    judged = judge(np.concatenate([neighbouring_designs(shares, free) for _, shares, _ in joining]))
    around = 2 * len(free)
    for n, (one, shares, judgement) in enumerate(joining):
        beside = judged[n * around : (n + 1) * around]
        objectives = [
            _values_and_derivatives(problem, goal.column, shares, judgement, free, beside, goal.sign)
            for goal in problem.objectives
        ]
        demands = [
            _values_and_derivatives(problem, demand.column, shares, judgement, free, beside, demand.sign)
            for demand in problem.demands
        ]
        one.bundle = [*one.bundle, _Linear(shares[free], objectives, demands)][-KEPT:]
        one.joining = []
    return len(joining) * around


def _try_all(problem: Problem, tried: list[tuple[_Design, Floats]], weights: Floats, judge: Judges) -> int:
    """Judge the designs (n, v) that are tried for each design, and move it to the best of them. Returns the number
    of designs judged."""
    judged, first = judge(np.concatenate([rows for _, rows in tried])), 0
    for one, rows in tried:
        _move(problem, one, rows, judged[first : first + len(rows)], weights)
        first += len(rows)
    return first


def _probes(one: _Design, free: Ints) -> Floats:
    """Designs (n, v) in which one of the free variables is changed, up or down, by PROBES of `one.probing`."""
    rows = []
    for amount in PROBES:
        for v in free.tolist():
            for sign in (-1.0, 1.0):
                row = one.shares.copy()
                row[v] = min(max(row[v] + sign * amount * one.probing, 0.0), 1.0)
                rows.append(row)
    return np.array(rows)


def neighbouring_designs(shares: Floats, free: Ints) -> Floats:
    """Designs (2 f, v) from which the derivatives of a design with shares (v,) by its f free variables are taken:
    a step down and one up of each, or two steps to the inside at a bound.

    free  (f,)  indices of the free variables
    """
    rows = np.repeat(shares[None], 2 * len(free), axis=0)
    for n, v in enumerate(free.tolist()):
        rows[2 * n : 2 * n + 2, v] += _offsets(shares[v])
    return rows


def _offsets(share: float) -> Floats:
    """The two steps (2,) of a share from which a derivative is taken: down and up, both inward at a bound."""
    if share < STEP:
        return np.array([STEP, 2.0 * STEP])
    if share > 1.0 - STEP:
        return np.array([-STEP, -2.0 * STEP])
    return np.array([-STEP, STEP])


def gradients(shares: Floats, free: Ints, here: Floats, around: Floats) -> Floats:
    """Derivatives (..., f) of values by the shares of f variables, `free` (f,) their indices.

    here    (...)       values of the design
    around  (2 f, ...)  values of its `neighbouring_designs`

    >>> x, free = np.array([0.0, 0.5]), np.array([0, 1])
    >>> f = lambda rows: rows[:, 0] ** 2 + 3.0 * rows[:, 0] + rows[:, 1] ** 2
    >>> gradients(x, free, f(x[None])[0], f(neighbouring_designs(x, free))).round(9).tolist()
    [3.0, 1.0]
    """
    slopes = []
    for n, v in enumerate(free.tolist()):
        (a, b), fa, fb = _offsets(shares[v]), around[2 * n] - here, around[2 * n + 1] - here
        # the slope at 0 of the parabola through 0, and fa and fb at a and b
        slopes.append((fa * b / a - fb * a / b) / (b - a))
    return np.stack(slopes, axis=-1)


def _step(problem: Problem, one: _Design, free: Ints, weights: Floats) -> Floats | None:
    """The step (f,) that the linear program of this file takes; None where none makes the design better.

    Where the bundle allows none, D (`one.reach`) shrinks, and designs farther away than NEAR D do not count,
    until one is found or D is below SMALLEST.

    free     (f,)  indices of the free variables
    weights  (m,)  as for `polish`
    """
    from scipy.optimize import linprog

    x, count = one.shares[free], len(free)
    costs = one.judgement.costs(problem)[0]
    objective = np.append(np.zeros(count), -1.0)  # of the unknowns (step, s): the largest s
    while one.reach >= SMALLEST:
        rows, limits = [], []  # rows @ (step, s) <= limits
        for linear in one.bundle:
            away = x - linear.shares
            if np.abs(away).max() > NEAR * one.reach:
                continue
            # wanted:  here + slope (away + step) <= cost - s weight,  and of a demand <= its bound
            for cost, weight, (here, slope) in zip(costs, weights, linear.objectives, strict=True):
                rows.append(np.column_stack([slope / weight, np.ones(len(here))]))
                limits.append((cost - here - slope @ away) / weight)
            for demand, (here, slope) in zip(problem.demands, linear.demands, strict=True):
                size = abs(demand.bound) or 1.0
                rows.append(np.column_stack([slope / size, np.zeros(len(here))]))
                limits.append((demand.sign * demand.bound - here - slope @ away) / size - one.bend * one.reach**2)
        A, b = np.concatenate(rows), np.concatenate(limits)
        # what has no value or derivative demands nothing
        known = np.isfinite(A).all(axis=1) & np.isfinite(b)
        box = [(max(-one.reach, -share), min(one.reach, 1.0 - share)) for share in x]
        found = linprog(objective, A_ub=A[known], b_ub=b[known], bounds=[*box, (0.0, None)], method="highs")
        if found.status == 0 and found.x[-1] >= SMALLEST:
            return np.asarray(found.x[:count], dtype=np.float64)
        one.reach /= 4.0
    return None


def _values_and_derivatives(
    problem: Problem,
    column: int,
    shares: Floats,
    judgement: DesignJudgement,
    free: Ints,
    around: DesignJudgement,
    sign: float,
) -> tuple[Floats, Floats]:
    """Values (p,) of a column with their derivatives (p, f), less being better: at every point where the column
    is the worst of them, else of itself.

    shares, judgement  of the design;   around  judgement of its `neighbouring_designs`
    sign               factor that makes less better
    """
    statistic = problem.columns[column].statistic
    worst = problem.columns[column].measure.better == ("higher" if sign < 0.0 else "lower")
    if statistic == "worst" and worst:
        here, there = judgement.cells[0, column], around.cells[:, column]
    else:
        here, there = judgement.values[0, column, None], around.values[:, column, None]
    with np.errstate(invalid="ignore"):
        return sign * here, sign * gradients(shares, free, here, there)


def _trials(shares: Floats, free: Ints, step: Floats) -> Floats:
    """Designs (l, v) to which a step (f,) of the free variables leads from shares (v,) at each of l LENGTHS,
    within the bounds."""
    rows = np.repeat(shares[None], len(LENGTHS), axis=0)
    rows[:, free] = np.clip(rows[:, free] + np.outer(LENGTHS, step), 0.0, 1.0)
    return rows


def _move(problem: Problem, one: _Design, tried: Floats, judged: DesignJudgement, weights: Floats) -> None:
    """Move a design to the best of those tried, if it is better; choose its next step, or its next probes and
    whether it is done, and what joins its bundle.

    tried, judged  (n, v) shares, from the longest step to the shortest, and their judgement
    weights        (m,) as for `polish`
    """
    costs = one.judgement.costs(problem)
    # of each one tried the gain in the objective that gains least
    gains = ((costs - judged.costs(problem)) / weights).min(axis=1)
    violated = judged.violations(problem).sum(axis=1)
    gains = np.where((violated == 0.0) & np.isfinite(gains), gains, -np.inf)
    best = int(np.argmax(gains))
    lengths = np.abs(tried - one.shares).max(axis=1)
    better = bool(gains[best] > 0.0)
    if one.probing:
        # twice the way that helped; else half of the smallest probe
        one.probing = 2.0 * float(lengths[best]) if better else one.probing * PROBES[-1] / 2.0
        one.done = one.probing < SMALLEST or (better and gains[best] < ROUNDING)
    else:
        # the nearest of the designs tried in vain lies across what keeps the step from its whole length
        beyond = best - 1 if better else len(tried) - 1
        # the best joins the bundle if it is better, and so does that nearest one, if there is one
        each = [best] * better + [beyond] * (beyond >= 0)
        one.joining = [(tried[n], judged[n : n + 1]) for n in each if np.isfinite(judged.costs(problem)[n]).all()]
        # `bend` becomes twice what the nearest vain trial violates, and never less than a quarter of itself
        bends = np.minimum(violated, 1.0) / lengths**2
        one.bend = max(0.25 * one.bend, 2.0 * float(bends[beyond])) if beyond >= 0 else 0.25 * one.bend
        one.reach = float(lengths[beyond]) if beyond >= 0 else min(2.0 * float(lengths[0]), REACH)
    if better:
        one.shares, one.judgement = tried[best], judged[best : best + 1]
