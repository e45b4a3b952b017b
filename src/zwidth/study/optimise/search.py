"""The search for the best designs: NSGA-II by pymoo, asked for a generation at a time.

Deb, Pratap, Agarwal and Meyarivan 2002 (known by its implementation, pymoo's): designs that keep all demands
come before others, and those before each other by the sum of what they violate; then by fronts, and within a
front by how much room is round them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.study.designs.sampling import Axis, Sampling
from zwidth.study.optimise.problem import Problem
from zwidth.study.optimise.variables import pieces, settle

# Designs of a generation: enough of them to spread over a front, few enough for some tens of generations.
FEWEST, MOST, GENERATIONS = 12, 100, 40
CHOSEN_ANEW: Final = 0.5  # of the variables in pieces that change, how many jump anywhere and not to a neighbour


def generations(
    problem: Problem, budget: int, first: Floats
) -> Iterator[tuple[Floats, Callable[[Floats, Floats], None]]]:
    """Generations of designs to judge, until the problem's budget has been asked for.

    budget  designs within which the search should be done, for the size of the generations
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
    left, within = problem.budget, budget
    while left > 0:
        asked = algorithm.ask()
        if asked is None or len(asked) == 0:
            return  # every combination of pieces has been tried
        asked = asked[: within if within > 0 else left]
        left, within = left - len(asked), within - len(asked)
        told = []

        def tell(costs: Floats, violations: Floats) -> None:
            # where a demand is violated costs are not compared, but may not be nan
            F, G = np.where(np.isfinite(costs), costs, 0.0), violations[:, None]
            Evaluator().eval(StaticProblem(bounds, F=F, G=G), asked)  # noqa: B023
            algorithm.tell(infills=asked)  # noqa: B023
            told.append(True)  # noqa: B023

        yield asked.get("X").astype(np.float64), tell
        if not told:
            return


def _first_generation(problem: Problem, size: int, first: Floats) -> Floats:
    """Shares of a Latin hypercube, in which the given designs stand in place of the first ones."""
    axes = problem.variables
    unit = tuple(Axis(axis.key, (), (0.0, 1.0)) for axis in axes)
    hypercube = Sampling(unit, size, problem.seed)
    shares = np.array([hypercube.values(n) for n in range(size)])
    shares[: len(first)] = first[:size]
    return settle(axes, shares)


def _repair(problem: Problem) -> Any:
    from pymoo.core.repair import Repair

    class Settled(Repair):  # type: ignore[misc]
        """Moves shares of variables in pieces to the middle of their piece."""

        def _do(self, _: Any, X: Floats, **__: Any) -> Floats:
            return settle(problem.variables, X)

    return Settled()


def _mutation(problem: Problem) -> Any:
    from pymoo.core.mutation import Mutation
    from pymoo.operators.mutation.pm import PM

    axes = problem.variables
    many = np.array([pieces(axis) for axis in axes])

    class Mutated(Mutation):  # type: ignore[misc]
        """Small changes by polynomial mutation; of variables in pieces also to another piece, near or anywhere."""

        def __init__(self) -> None:
            super().__init__()
            self.polynomial = PM(eta=20)

        def _do(self, bounds: Any, X: Floats, *, random_state: np.random.Generator, **more: Any) -> Floats:
            X = self.polynomial._do(bounds, X, random_state=random_state, **more)
            chance = random_state.random((3, *X.shape))
            changes = (many > 1) & (chance[0] < 1.0 / len(axes))
            step = np.where(chance[2] < 0.5, -1.0, 1.0) / np.maximum(many, 1)
            near = np.clip(X + step, 0.0, 1.0)
            return np.where(changes, np.where(chance[1] < CHOSEN_ANEW, chance[2], near), X)

    return Mutated()
