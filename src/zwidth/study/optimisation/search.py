"""The search for the best designs: NSGA-II by pymoo, asked for a generation at a time.

Deb, Pratap, Agarwal and Meyarivan 2002 (known by its implementation, pymoo's): designs that keep all demands
come before others, and those before each other by the sum of what they violate; then by fronts, and within a
front by how much room is round them.

Variables of an optimisation are the axes of its study, each on the unit interval.

A share of 0 is a variable's lower bound and 1 its upper one. What takes whole numbers, listed values or parts of a
catalogue divides the interval into equal pieces, one each, and a share is moved to the middle of its piece.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import ceil, exp, floor, log
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.study.designs.sampling import Axis, Sampling
from zwidth.study.optimisation.problem import Problem

# Designs of a generation: enough of them to spread over a front, few enough for some tens of generations.
FEWEST, MOST, GENERATIONS = 12, 100, 40
CHOSEN_ANEW: Final = 0.5  # of the variables in pieces that change, how many jump anywhere and not to a neighbour


def generations(
    problem: Problem, budget: int, first: Floats
) -> Iterator[tuple[Floats, Callable[[Floats, Floats], None]]]:
    """Generations of designs to judge, until the problem's budget has been asked for. They end before where every
    combination of pieces has been tried, or the function yielded was not called.

    budget  designs within which the search should be done: sizes the generations, and cuts the one that reaches it
    first   (k, v)  shares of designs that the first generation holds
    Yields  shares (n, v), and a function to be called with their costs (n, m) and their violations (n,),
            before the next generation is asked for
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.evaluator import Evaluator
    from pymoo.core.problem import Problem as Bounds
    from pymoo.core.termination import NoTermination
    from pymoo.problems.static import StaticProblem

    axes = problem.variables
    size = min(max(budget // GENERATIONS, FEWEST), MOST, budget)
    bounds = Bounds(n_var=len(axes), n_obj=len(problem.objectives), n_ieq_constr=1, xl=0.0, xu=1.0)
    algorithm = NSGA2(
        pop_size=size,
        sampling=_first_generation(problem, size, first),
        mutation=_mutation(problem),
        repair=_repair(problem),
        eliminate_duplicates=True,
    )
    algorithm.setup(bounds, seed=problem.seed, termination=NoTermination(), verbose=False)
    left, within = problem.budget, budget  # designs still to ask for: in all, and within the search's own budget
    while left > 0:
        asked = algorithm.ask()
        if asked is None or len(asked) == 0:
            return  # every combination of pieces has been tried
        asked = asked[: within if within > 0 else left]
        left, within = left - len(asked), within - len(asked)
        told = []  # whether `tell` was called; else the algorithm has no next generation

        def tell(costs: Floats, violations: Floats) -> None:
            """Hand the costs (n, m) and violations (n,) of the designs asked for to the algorithm."""
            # F, G: pymoo's names; where a demand is violated costs are not compared, but may not be nan
            F, G = np.where(np.isfinite(costs), costs, 0.0), violations[:, None]
            Evaluator().eval(StaticProblem(bounds, F=F, G=G), asked)  # noqa: B023
            algorithm.tell(infills=asked)  # noqa: B023
            told.append(True)  # noqa: B023

        yield asked.get("X").astype(np.float64), tell
        if not told:
            return


def _first_generation(problem: Problem, size: int, first: Floats) -> Floats:
    """Shares (size, v) of a Latin hypercube, in which the designs `first` (k, v) replace the first ones."""
    axes = problem.variables
    unit = tuple(Axis(axis.key, (), (0.0, 1.0)) for axis in axes)
    hypercube = Sampling(unit, size, problem.seed)
    shares = np.array([hypercube.values(n) for n in range(size)])
    shares[: len(first)] = first[:size]
    return settle(axes, shares)


def _repair(problem: Problem) -> Any:
    """pymoo's operator that keeps designs within what the variables may have."""
    from pymoo.core.repair import Repair

    class Settled(Repair):  # type: ignore[misc]
        """Moves shares into 0 to 1, and those of variables in pieces to the middle of their piece."""

        def _do(self, _: Any, X: Floats, **__: Any) -> Floats:
            """The designs X (n, v), by shares, as they may be."""
            return settle(problem.variables, X)

    return Settled()


def _mutation(problem: Problem) -> Any:
    """pymoo's operator that changes designs at random."""
    from pymoo.core.mutation import Mutation
    from pymoo.operators.mutation.pm import PM

    axes = problem.variables
    many = np.array([pieces(axis) for axis in axes])

    class Mutated(Mutation):  # type: ignore[misc]
        """Small changes by polynomial mutation; of variables in pieces also to another piece, near or anywhere."""

        def __init__(self) -> None:
            super().__init__()
            self.polynomial = PM(eta=20)  # the larger, the nearer to the parent

        def _do(self, bounds: Any, X: Floats, *, random_state: np.random.Generator, **more: Any) -> Floats:
            """The designs X (n, v), by shares, changed at random."""
            X = self.polynomial._do(bounds, X, random_state=random_state, **more)
            whether, how, where = random_state.random((3, *X.shape))  # a variable changes, and to which piece
            changes = (many > 1) & (whether < 1.0 / len(axes))
            step = np.where(where < 0.5, -1.0, 1.0) / np.maximum(many, 1)
            near = np.clip(X + step, 0.0, 1.0)
            return np.where(changes, np.where(how < CHOSEN_ANEW, where, near), X)

    return Mutated()


def pieces(axis: Axis) -> int:
    """Number of values that a variable takes; 0 for any number within its bounds.

    >>> pieces(Axis("a", (), (0.5, 4.5), whole=True)), pieces(Axis("b", (), (0.5, 4.5)))
    (4, 0)
    """
    if axis.span is None:
        return len(axis.values)
    return floor(axis.span[1]) - ceil(axis.span[0]) + 1 if axis.whole else 0


def continuous(axes: Sequence[Axis]) -> Flags:
    """Which variables (v,) take any number within their bounds."""
    return np.array([pieces(axis) == 0 for axis in axes], dtype=bool)


def settle(axes: Sequence[Axis], shares: Floats) -> Floats:
    """The shares (k, v) moved into 0 to 1, those of a variable in pieces at the middle of its piece."""
    settled = np.clip(shares, 0.0, 1.0)
    for n, axis in enumerate(axes):
        if many := pieces(axis):
            settled[:, n] = (np.minimum(np.floor(settled[:, n] * many), many - 1) + 0.5) / many
    return settled


def value_at(axis: Axis, share: float) -> Any:
    """The variable's value at a share.

    >>> value_at(Axis("a", (), (1.0, 3.0)), 0.5), value_at(Axis("b", ("x", "y")), 0.7)
    (2.0, 'y')
    """
    if many := pieces(axis):
        place = min(int(share * many), many - 1)
        return axis.values[place] if axis.span is None else ceil(axis.span[0]) + place
    assert axis.span is not None
    low, high = axis.span
    if share in (0.0, 1.0):  # the bounds without rounding
        return high if share else low
    value = exp(log(low) + share * (log(high) - log(low))) if axis.log else low + share * (high - low)
    return float(min(max(value, low), high))


def values_at(axes: Sequence[Axis], shares: Floats) -> list[tuple[Any, ...]]:
    """The values of the variables of designs at shares (k, v), one tuple for each design."""
    return [tuple(map(value_at, axes, row)) for row in shares.tolist()]


def share_of(axis: Axis, value: Any) -> float | None:
    """The share at which a variable has a value; None where it is outside the bounds, or not among the values."""
    if many := pieces(axis):
        if axis.span is None:
            place = axis.values.index(value) if value in axis.values else -1
        else:
            place = int(value) - ceil(axis.span[0]) if float(value).is_integer() else -1
        return (place + 0.5) / many if 0 <= place < many else None
    assert axis.span is not None
    low, high = axis.span
    if not low <= value <= high:
        return None
    if axis.log:
        return (log(value) - log(low)) / (log(high) - log(low))
    return float((value - low) / (high - low))
