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
bounds (`gradients`). Where two roots of the loop meet, as at the fastest-decaying wall, a value has an upright
tangent and no first order: there single variables are changed by ever smaller amounts (`_probes`).
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
ROUNDING: Final = 1e-13  # gains below are chance
LENGTHS: Final = (1.0, 0.5, 0.1)  # at which a step is tried
PROBED: Final = 1e-3  # of the bounds, by which single variables are changed at first where no step is left
PROBES: Final = (1.0, 0.25, 0.0625)  # of that, tried at once; then the last of them, and so on


@dataclass
class _Design:
    """A design that is polished.

    shares      (v,)   its variables
    judgement   of it
    reach       D, of the bounds
    inset       by how much more than needed the next step keeps the demands, after one that did not
    probing     by how much single variables are changed next, of the bounds; 0: by steps of the program
    done        whether nothing makes it better
    """

    shares: Floats
    judgement: Judgement
    reach: float
    inset: float = 0.0
    probing: float = 0.0
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
    around = 2 * len(free)
    while pending := [one for one in designs if not one.done]:
        probing = bool(pending[0].probing)
        each = around * len(PROBES) if probing else around + len(LENGTHS)
        pending = [one for one in pending if bool(one.probing) == probing][: (budget - spent) // each]
        if not pending:
            break
        if probing:
            spent += _try_all(problem, [(one, _probes(one, free)) for one in pending], weights, judge)
            continue
        judged = judge(np.concatenate([neighbours(one.shares, free) for one in pending]))
        spent += around * len(pending)
        moving = []
        for n, one in enumerate(pending):
            step = _step(problem, one, free, judged[n * around : (n + 1) * around], weights)
            if step is None:
                one.probing = PROBED
            else:
                moving.append((one, _trials(one.shares, free, step)))
        spent += _try_all(problem, moving, weights, judge) if moving else 0
    return spent


def _try_all(problem: Problem, tried: list[tuple[_Design, Floats]], weights: Floats, judge: Judges) -> int:
    """Judge what is tried for each design, and let each go to the best of it. Returns the number judged."""
    judged, first = judge(np.concatenate([rows for _, rows in tried])), 0
    for one, rows in tried:
        _move(problem, one, rows, judged[first : first + len(rows)], weights)
        first += len(rows)
    return first


def _probes(one: _Design, free: NDArray[np.int64]) -> Floats:
    """Designs in which each of the free variables is changed by itself, up and down, by some amounts."""
    rows = []
    for amount in PROBES:
        for v in free.tolist():
            for sign in (-1.0, 1.0):
                row = one.shares.copy()
                row[v] = min(max(row[v] + sign * amount * one.probing, 0.0), 1.0)
                rows.append(row)
    return np.array(rows)


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


def _move(problem: Problem, one: _Design, tried: Floats, judged: Judgement, weights: Floats) -> None:
    """Go to the best of the designs tried, if it is better; and choose how far the next step may go."""
    own = one.judgement.costs(problem)
    gains = ((own - judged.costs(problem)) / weights).min(axis=1)
    violated = judged.violations(problem).sum(axis=1)
    gains = np.where((violated == 0.0) & np.isfinite(gains), gains, -np.inf)
    best = int(np.argmax(gains))
    lengths = np.abs(tried - one.shares).max(axis=1)
    better = bool(gains[best] > 0.0)
    if one.probing:
        one.probing = 2.0 * float(lengths[best]) if better else one.probing * PROBES[-1] / 2.0
        one.done = one.probing < SMALLEST or (better and gains[best] < ROUNDING)
    elif not better:
        one.reach = float(lengths[-1]) / 2.0
        one.inset = 2.0 * float(violated[-1]) if violated[-1] < 1.0 else one.inset
        one.probing = PROBED if one.reach < SMALLEST else 0.0
    else:
        one.reach = min(2.0 * float(lengths[0]), REACH) if best == 0 else float(lengths[best])
        one.inset = float(violated[0]) if best else 0.0
        one.probing = PROBED if gains[best] < SMALLEST else 0.0
    if better:
        one.shares, one.judgement = tried[best], judged[best : best + 1]
