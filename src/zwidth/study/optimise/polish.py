"""Polish of designs that a search has found: steps of sequential linear programming.

A worst value over many points is the least of many smooth functions, and has a kink wherever another of them
becomes the least; the best design mostly lies in such a kink. So no single derivative is followed. The values at
all points, with their derivatives, are taken to first order, and

    the largest s,  such that every objective j becomes better by s w_j at each of its points,
                    every demand is kept at each of its points, and no variable moves by more than D

is a linear program. Its step is tried at several lengths; D grows where the step keeps what it promised, and
shrinks where it does not. Fletcher and Sainz de la Maza 1989 (known at second hand) have the method for smooth
problems.

Values are exact, and so are their differences: over 1e-4 of the bounds, of the second order inside and at the
bounds (`gradients`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from zwidth.study.optimise.evaluation import Judgement
from zwidth.study.optimise.problem import Problem
from zwidth.study.optimise.variables import continuous

Floats = NDArray[np.float64]
Judges: TypeAlias = Callable[[Floats], Judgement]

STEP: Final = 1e-4  # of the bounds, by which designs are changed for derivatives
REACH: Final = 0.1  # of the bounds: largest first step
SMALLEST: Final = 1e-9  # steps and gains below are none
LENGTHS: Final = (1.0, 0.5, 0.1)  # at which a step is tried


@dataclass
class _Design:
    """A design that is polished.

    shares      (v,)   its variables
    judgement   of it
    reach       D, of the bounds
    inset       (d,)  by how much more than needed the next step keeps the demands, after one that did not
    done        whether no step makes it better
    """

    shares: Floats
    judgement: Judgement
    reach: float
    inset: float = 0.0
    done: bool = False


def polish(
    problem: Problem, shares: Floats, judgements: Judgement, weights: Floats, judge: Judges, budget: int
) -> int:
    """Improve designs in all objectives together; what is tried is judged by `judge`, which keeps it.

    shares      (k, v)  of designs that keep all demands
    judgements  of them
    weights     (m,)  how much better in each objective counts as much as in another: ranges of the front
    budget      designs that may be judged
    Returns     number of designs judged
    """
    free = np.flatnonzero(continuous(problem.variables))
    designs = [_Design(row, judgements[n : n + 1], REACH) for n, row in enumerate(shares)]
    spent = 0
    if not len(free):
        return spent
    while pending := [one for one in designs if not one.done]:
        each = 2 * len(free) + len(LENGTHS)
        pending = pending[: (budget - spent) // each]
        if not pending:
            break
        around = np.concatenate([neighbours(one.shares, free) for one in pending])
        judged = judge(around)
        spent += len(around)
        steps = []
        for n, one in enumerate(pending):
            piece = slice(n * 2 * len(free), (n + 1) * 2 * len(free))
            steps.append(_step(problem, one, free, judged[piece], weights))
        moving = [(one, step) for one, step in zip(pending, steps, strict=True) if step is not None]
        for one, step in zip(pending, steps, strict=True):
            one.done = step is None
        if not moving:
            continue
        tried = np.concatenate([_trials(one.shares, free, step) for one, step in moving])
        judged = judge(tried)
        spent += len(tried)
        for n, (one, step) in enumerate(moving):
            piece = slice(n * len(LENGTHS), (n + 1) * len(LENGTHS))
            _move(problem, one, tried[piece], judged[piece], weights, float(np.abs(step).max()))
    return spent


def neighbours(shares: Floats, free: NDArray[np.int64]) -> Floats:
    """Designs (2 f, v) from which the derivatives by f variables are taken: a step down and one up of each, or two
    steps to the inside at a bound."""
    rows = np.repeat(shares[None], 2 * len(free), axis=0)
    for n, v in enumerate(free.tolist()):
        rows[2 * n : 2 * n + 2, v] += _offsets(shares[v])
    return rows


def _offsets(share: float) -> Floats:
    if share < STEP:
        return np.array([STEP, 2.0 * STEP])
    if share > 1.0 - STEP:
        return np.array([-STEP, -2.0 * STEP])
    return np.array([-STEP, STEP])


def gradients(shares: Floats, free: NDArray[np.int64], here: Floats, around: Floats) -> Floats:
    """Derivatives (..., f) of values by the shares of f variables.

    here    (...)       values of the design
    around  (2 f, ...)  values of its `neighbours`

    >>> x, free = np.array([0.0, 0.5]), np.array([0, 1])
    >>> f = lambda rows: rows[:, 0] ** 2 + 3.0 * rows[:, 0] + rows[:, 1] ** 2
    >>> gradients(x, free, f(x[None])[0], f(neighbours(x, free))).round(9).tolist()
    [3.0, 1.0]
    """
    slopes = []
    for n, v in enumerate(free.tolist()):
        (a, b), fa, fb = _offsets(shares[v]), around[2 * n] - here, around[2 * n + 1] - here
        slopes.append((fa * b / a - fb * a / b) / (b - a))
    return np.stack(slopes, axis=-1)


def _step(
    problem: Problem, one: _Design, free: NDArray[np.int64], around: Judgement, weights: Floats
) -> Floats | None:
    """The step (f,) that the linear program takes; None where none makes the design better."""
    from scipy.optimize import linprog

    x, count = one.shares[free], len(free)
    rows, limits = [], []
    for objective, weight in zip(problem.objectives, weights, strict=True):
        here, slope = _pieces(problem, objective.column, one, free, around, objective.sign)
        own = one.judgement.values[0, objective.column] * objective.sign
        rows.append(np.column_stack([slope / weight, np.ones(len(here))]))
        limits.append((own - here) / weight)
    for demand in problem.demands:
        sign = -1.0 if demand.at_least else 1.0
        size = abs(demand.bound) or 1.0
        here, slope = _pieces(problem, demand.column, one, free, around, sign)
        rows.append(np.column_stack([slope / size, np.zeros(len(here))]))
        limits.append((sign * demand.bound - here) / size - one.inset)
    A, b = np.concatenate(rows), np.concatenate(limits)
    known = np.isfinite(A).all(axis=1) & np.isfinite(b)
    reach = [(max(-one.reach, -share), min(one.reach, 1.0 - share)) for share in x]
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=A[known],
        b_ub=b[known],
        bounds=[*reach, (0.0, None)],
        method="highs",
    )
    if found.status != 0 or found.x[-1] < SMALLEST:
        return None
    return np.asarray(found.x[:count], dtype=np.float64)


def _pieces(
    problem: Problem, column: int, one: _Design, free: NDArray[np.int64], around: Judgement, sign: float
) -> tuple[Floats, Floats]:
    """Values (p,) of a column with their derivatives (p, f), less being better: at every point where the column is
    the worst of them, else of itself."""
    statistic = problem.columns[column].statistic
    worst = problem.columns[column].measure.better == ("higher" if sign < 0.0 else "lower")
    if statistic == "worst" and worst:
        here, there = one.judgement.cells[0, column], around.cells[:, column]
    else:
        here, there = one.judgement.values[0, column, None], around.values[:, column, None]
    with np.errstate(invalid="ignore"):
        return sign * here, sign * gradients(one.shares, free, here, there)


def _trials(shares: Floats, free: NDArray[np.int64], step: Floats) -> Floats:
    rows = np.repeat(shares[None], len(LENGTHS), axis=0)
    rows[:, free] = np.clip(rows[:, free] + np.outer(LENGTHS, step), 0.0, 1.0)
    return rows


def _move(
    problem: Problem, one: _Design, tried: Floats, judged: Judgement, weights: Floats, length: float
) -> None:
    """Go to the best of the designs tried, if it is better; and choose how far the next step may go."""
    own = one.judgement.costs(problem)
    gains = ((own - judged.costs(problem)) / weights).min(axis=1)
    violated = judged.violations(problem).sum(axis=1)
    gains = np.where((violated == 0.0) & np.isfinite(gains), gains, -np.inf)
    best = int(np.argmax(gains))
    if not gains[best] > 0.0:
        one.reach = length * LENGTHS[-1] / 2.0
        small = violated[-1] < 1.0
        one.inset = 2.0 * float(violated[-1]) if small else one.inset
        one.done = one.reach < SMALLEST
        return
    one.shares, one.judgement = tried[best], judged[best : best + 1]
    one.reach = min(2.0 * length, REACH) if best == 0 else length * LENGTHS[best]
    one.inset = float(violated[0]) if best else 0.0
    one.done = gains[best] < SMALLEST
