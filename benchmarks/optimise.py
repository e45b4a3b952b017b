"""How long an optimisation of the bundled five-bar takes, and what it finds beside random search.

One study: two lengths, the transmission ratio and the drives' stiffness, over 25 postures and 4 directions, the
stiffest wall against dexterity and against the mass felt. Ours has a budget of designs, and the peers judge as
many:

- random designs, all of them computed as one batch by the same code, so that only the choice of designs differs;
- a Latin hypercube, likewise.

Hypervolumes are of what designs that keep the demands dominate, up to a point that is worse than all fronts; the
share is of the largest that any run has found. Several seeds say how much of it is chance.

Run `python benchmarks/optimise.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table, seconds, verdict
from zwidth.study import (
    Axis,
    Judge,
    Sampling,
    Study,
    hypervolume,
    optimise,
    problem_of,
    settle,
    study_of,
    values_at,
)
from zwidth.study import run_job as run_job
from zwidth.study.optimisation.evaluation import DesignJudgement
from zwidth.study.optimisation.problem import Problem

BUDGET, SEEDS, WORKERS = 4000, 3, 2
WANTED = 60.0  # s for 4000 designs


def scaled(link: str) -> list[object]:
    """A link's mass and inertia, and those of the link opposite, with its length."""
    other = link.replace("right", "left")
    return [
        f"links.{other}.length_m",
        *({"key": f"links.{one}.mass_kg", "power": 1} for one in (link, other)),
        *({"key": f"links.{one}.inertia_kg_m2", "power": 3} for one in (link, other)),
    ]


def study(budget: int, seed: int) -> Study:
    """The study, both sides of the device alike."""
    axes = [
        {"key": "links.upper-right.length_m", "range": [0.10, 0.20], "tie": scaled("upper-right")},
        {"key": "links.distal-right.length_m", "range": [0.15, 0.25], "tie": scaled("distal-right")},
        {
            "key": "drives.motor-right.transmission_ratio",
            "range": [8.0, 30.0],
            "tie": ["drives.motor-left.transmission_ratio"],
        },
        {
            "key": "drives.motor-right.stiffness_Nm_per_rad",
            "range": [0.2, 2.0],
            "scale": "log",
            "tie": ["drives.motor-left.stiffness_Nm_per_rad"],
        },
    ]
    document = {
        "device": "five-bar",
        "axis": axes,
        "task": {"box_m": [[-0.04, 0.04], [0.20, 0.28]], "directions": 4},
        "optimise": {
            "objectives": {"stiffness_max": "max", "isotropy": "min", "rigid_mass": "min"},
            "constraints": {"stiffness": ">= 5000"},
            "budget": budget,
            "seed": seed,
        },
    }
    return study_of(document, bounds=True)


def judged(problem: Problem, shares: np.ndarray) -> DesignJudgement:
    """Designs judged as one batch."""
    judge = Judge(problem)
    return judge.judge(run_job(judge.job(values_at(problem.variables, shares)), workers=WORKERS))


def kept_costs(problem: Problem, judgement: DesignJudgement) -> np.ndarray:
    """Costs of the designs that keep the demands."""
    return judgement.costs(problem)[~judgement.violations(problem).any(axis=1)]


def cases() -> Cases:
    """A short search; its best stiffness."""

    def stiffest() -> float:
        return float(optimise(study(120, 1), workers=1).values[0, 0])

    return {"120 designs of a front of the five-bar": TimedCase(stiffest)}


def main() -> None:
    """Time ours, and print hypervolumes beside those of designs chosen at random."""
    print(machine("numpy", "numba", "pymoo"))
    optimise(study(40, 1), workers=WORKERS)  # compiles
    found: dict[str, list[np.ndarray]] = {"zwidth optimise": [], "random designs": [], "Latin hypercube": []}
    times = []
    for seed in range(1, SEEDS + 1):
        wanted = study(BUDGET, seed)
        problem = problem_of(wanted)
        start = perf_counter()
        ours = optimise(wanted, workers=WORKERS)
        times.append(perf_counter() - start)
        found["zwidth optimise"].append(kept_costs(problem, ours.judgement))
        axes, count = problem.variables, len(ours.shares)
        random = settle(axes, np.random.default_rng(seed).random((count, len(axes))))
        unit = tuple(Axis(axis.key, (), (0.0, 1.0)) for axis in axes)
        hypercube = Sampling(unit, count, seed)
        spread = settle(axes, np.array([hypercube.values(n) for n in range(count)]))
        found["random designs"].append(kept_costs(problem, judged(problem, random)))
        found["Latin hypercube"].append(kept_costs(problem, judged(problem, spread)))
    every = np.concatenate([costs for runs in found.values() for costs in runs])
    reference = np.percentile(every, 95.0, axis=0)
    volumes = {name: [hypervolume(costs, reference) for costs in runs] for name, runs in found.items()}
    best = max(max(each) for each in volumes.values())
    cells = 25 * 4
    print(
        f"{BUDGET} designs over {cells} points each, {WORKERS} processes at most: "
        f"{', '.join(map(seconds, times))}; {verdict(max(times), WANTED)}"
    )
    rows = [
        (
            name,
            *(f"{volume / best:.4f}" for volume in each),
            f"{np.mean(each) / np.mean(volumes['random designs']):.3f}",
        )
        for name, each in volumes.items()
    ]
    print_table(("hypervolume, share of best", *(f"seed {n + 1}" for n in range(SEEDS)), "ratio"), rows)


if __name__ == "__main__":
    sys.exit(run(main, cases))
