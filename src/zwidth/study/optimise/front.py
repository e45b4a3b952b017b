"""Fronts: designs of which none is better in every objective, what they dominate, and their knee."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats, Ints


def undominated(costs: Floats) -> Ints:
    """Designs of which no other is as good in every objective and better in one, in their order; of equal ones the
    first.

    costs  (k, m)  less is better; a row with nan is left out

    >>> undominated(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [1.0, 3.0], [3.0, 1.0]])).tolist()
    [0, 1, 4]
    """
    known = np.flatnonzero(~np.isnan(costs).any(axis=1))
    if not len(known):
        return known
    _, first = np.unique(costs[known], axis=0, return_index=True)
    rows = known[np.sort(first)]
    # by falling sum nothing later can dominate what is kept
    order = rows[np.argsort(costs[rows].sum(axis=1), kind="stable")]
    kept: list[int] = []
    for row in order.tolist():
        best = costs[kept]
        if not (best <= costs[row]).all(axis=1).any():
            kept.append(row)
    return np.array(sorted(kept), dtype=np.int64)


def ranges(costs: Floats) -> tuple[Floats, Floats]:
    """Best cost (m,) of each objective in a front, and its range over it; 1 where that is 0."""
    best, worst = costs.min(axis=0), costs.max(axis=0)
    return best, np.where(worst > best, worst - best, 1.0)


def knee(costs: Floats) -> int:
    """The design of a front that lies farthest below the plane through the front's ends.

    With each objective scaled from 0, its best in the front, to 1, its worst, the ends lie on the plane on which
    the scaled costs add up to 1, and the knee has the least sum (Das 1999, known at second hand).

    costs  (k, m)  of a front

    >>> knee(np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.0]]))
    1
    """
    best, size = ranges(costs)
    return int(np.argmin(((costs - best) / size).sum(axis=1)))


def spread_out(costs: Floats, most: int) -> Ints:
    """At most so many designs of a front, spread over it: the ends of each objective, the knee, then always the
    one farthest from those taken, in the order of the first objective.

    costs  (k, m)  of a front
    """
    best, size = ranges(costs)
    scaled = (costs - best) / size
    taken = list(dict.fromkeys([*np.argmin(costs, axis=0).tolist(), knee(costs)]))[:most]
    distance = np.full(len(costs), np.inf)
    for row in taken:
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[row], axis=1))
    while len(taken) < min(most, len(costs)):
        row = int(np.argmax(distance))
        if not distance[row] > 0.0:
            break
        taken.append(row)
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[row], axis=1))
    rows = np.array(taken, dtype=np.int64)
    return rows[np.argsort(costs[rows, 0], kind="stable")]


def hypervolume(costs: Floats, reference: Floats) -> float:
    """Volume of what a front dominates, up to a reference point (m,) [product of the objectives' units].

    costs  (k, m)  less is better; designs beyond the reference add nothing

    >>> hypervolume(np.array([[1.0, 3.0], [2.0, 2.0]]), np.array([4.0, 4.0]))
    5.0
    """
    from pymoo.indicators.hv import HV

    inside = costs[(costs < reference).all(axis=1)]
    return float(HV(ref_point=reference)(inside)) if len(inside) else 0.0
