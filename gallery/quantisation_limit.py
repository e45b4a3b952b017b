"""Section 3.2.5: the limit that the encoder sets, K = 2 C/Delta, is sufficient for rest and no onset of vibration.

The thesis prints 26 700 N/m for 2 C/Delta and neither C nor Delta. Here Delta is a PLACEHOLDER of 20 micrometres
at the motor side, and C follows from the printed limit, C = 26 700 Delta/2 = 0.267 N. At its 1.25 ms the two
masses lose stability at 7.1 kN/m, long before; its further experiment at 0.1 ms met limit cycles at 50 kN/m.

The same plant is simulated here at 0.05 to 0.2 ms, on walls from half the limit to 38 times it: is it still moving
after 2 s? What disturbs it is where it starts, how fast it hits a one-sided wall, and how a hand pushes.

A constant push f > C leaves it without a place to rest where no whole number of counts n has |f - K n Delta| <= C.
The first such wall beyond the limit is

    K = (f + C)/(n Delta),    n = ceil((f - C)/(2 C)),        between 2 C/Delta and twice that, by the push alone

and K Delta/(2 C) depends on f/C only, so that the placeholders do not matter to it.

onsets  stiffest wall on which it came to rest, all softer ones included, and the next one, by case
around  does it move 5 % below and 5 % above the wall that has the formula, by push f/C

Run `python -m gallery.quantisation_limit` to draw it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, inf

import numpy as np

from gallery.shared_loops import published, write_figure
from zwidth.chart import judge
from zwidth.chart.verdict import STABLE
from zwidth.contact import Hand, Run, limit_cycles, one_sided_wall, resting_limit, simulate_batch, wall
from zwidth.loop import Controller, Loop
from zwidth.model import Counter, Friction, Nonlinear

PRINTED = 26_700.0  # N/m
PRINTED_ONSET = 50_000.0  # N/m, at 0.1 ms
STEP = 20e-6  # m, a placeholder
COULOMB = PRINTED * STEP / 2.0  # N
BETWEEN = 0.5  # of a step: where a push of K Delta/2 leaves the device
DURATION, RAMP = 2.0, 0.4  # s
SUBSTEPS = 8  # as many as 20 give the same
AS_PRINTED = 2.0 * PRINTED_ONSET / PRINTED - 1.0  # C, the push whose onset is the printed one, with n = 1

limit = float(resting_limit(COULOMB, STEP))
stiffness = PRINTED * 2.0 ** (0.5 * np.arange(-2, 11) + 0.25)  # the limit lies between two of them


@dataclass(frozen=True)
class Disturbance:
    """What disturbs the device, and what stops it.

    period   [s];   damping  of the wall [N s/m]
    counts   of push, in K Delta: the same place between counts on every wall
    push     constant, in C
    start    in counts into a two-sided wall
    speed    at which it hits a one-sided wall [m/s]; None: a two-sided wall
    """

    period: float = 1e-4
    damping: float = 10.0
    counts: float = 0.0
    push: float = 0.0
    start: float = 5.0
    speed: float | None = None


def device(period: float) -> Loop:
    """Table 3.4 with dry friction and an encoder at the motor side."""
    plant = published().plant
    parts = Nonlinear((Friction(plant.sensor, COULOMB),), (Counter(plant.sensor, STEP),))
    return Loop(replace(plant, nonlinear=parts), Controller(period))


def is_moving(case: Disturbance, walls: Sequence[float] | np.ndarray = stiffness) -> np.ndarray:
    """Does the reading still change at the end, on each wall? Without end counts as moving."""
    loop, sides = device(case.period), wall if case.speed is None else one_sided_wall
    start = case.start * STEP if case.speed is None else 0.0
    runs = [
        Run(
            loop,
            sides.values(stiffness=K, damping=case.damping),
            Hand(
                push=case.counts * K * STEP + case.push * COULOMB, ramp=RAMP if case.counts or case.push else 0.0
            ),
            start_position=start,
            start_velocity=case.speed or 0.0,
        )
        for K in walls
    ]
    found = simulate_batch(runs, sides, duration=DURATION, substeps=SUBSTEPS)
    return np.array([not np.ptp(run.reading[-int(0.1 / case.period) :]) <= 0.5 * STEP for run in found])


def onset(moves: np.ndarray) -> tuple[float, float]:
    """The last wall below all that move, and the first that moves; inf where none does."""
    if not np.any(moves):
        return float(stiffness[-1]), inf
    first = int(np.argmax(moves))
    return float(stiffness[first - 1]) if first else 0.0, float(stiffness[first])


def linear_edge(case: Disturbance) -> tuple[float, float]:
    """The same of the linear loop, which has neither friction nor counts."""
    return onset(judge(device(case.period), stiffness, np.full_like(stiffness, case.damping)).verdict != STABLE)


def first_without_rest(push: float) -> float:
    """The first wall beyond the limit on which a constant push, in C, leaves no place to rest [N/m]."""
    return inf if push <= 1.0 else limit * (push + 1.0) / (2.0 * ceil((push - 1.0) / 2.0))


CASES = {
    "0.1 ms, 3 N s/m": Disturbance(damping=3.0),
    "0.1 ms, 10 N s/m": Disturbance(),
    "0.1 ms, 30 N s/m": Disturbance(damping=30.0),
    "0.05 ms, 10 N s/m": Disturbance(period=5e-5),
    "0.2 ms, 10 N s/m": Disturbance(period=2e-4),
    "from 0.3 counts": Disturbance(start=0.3),
    "from 1 count": Disturbance(start=1.0),
    "from 50 counts, 1 mm": Disturbance(start=50.0),
    "pushed between counts, 3 N s/m": Disturbance(damping=3.0, counts=BETWEEN, start=0.0),
    "pushed between counts": Disturbance(counts=BETWEEN, start=0.0),
    "pushed between counts, 30 N s/m": Disturbance(damping=30.0, counts=BETWEEN, start=0.0),
    "pushed by 0.9 C": Disturbance(push=0.9, start=0.0),
    "pushed by 2.75 C": Disturbance(push=AS_PRINTED, start=0.0),
    "pushed by 2.75 C, from 1 mm": Disturbance(push=AS_PRINTED, start=50.0),
    "hit at 0.05 m/s, 2.75 C": Disturbance(push=AS_PRINTED, speed=0.05),
    "hit at 0.2 m/s, 2.75 C": Disturbance(push=AS_PRINTED, speed=0.2),
}
moves = {name: is_moving(case) for name, case in CASES.items()}
onsets = {name: onset(found) for name, found in moves.items()}
around = {
    push: is_moving(Disturbance(push=push, start=0.0), first_without_rest(push) * np.array([0.95, 1.05])).tolist()
    for push in (1.5, AS_PRINTED, 4.0, 6.0)
}


def predicted(name: str, wall_stiffness: float) -> bool:
    """Has harmonic balance a stable limit cycle?"""
    case = CASES[name]
    found = limit_cycles(device(case.period), wall_stiffness, case.damping, offset=case.counts)
    return any(cycle.stable for cycle in found)


def draw(ax) -> None:
    """One line for each case: hollow where it came to rest, full where it kept moving."""
    from zwidth.show import BLACK, VERMILION

    for row, found in enumerate(moves.values()):
        for K, alive in zip(stiffness, found, strict=True):
            face = VERMILION if alive else "none"
            ax.plot(K / 1e3, -row, "o", markersize=4.0, markeredgecolor=VERMILION, markerfacecolor=face)
    ax.axvline(limit / 1e3, color=BLACK, linewidth=0.8)
    ax.axvline(PRINTED_ONSET / 1e3, color=BLACK, linewidth=0.8, linestyle=":")
    ax.set_xscale("log")
    ax.set_xticks([20, 50, 100, 200, 500, 1000], ["20", "50", "100", "200", "500", "1000"])
    ax.set_yticks(-np.arange(len(moves)), list(moves), fontsize=7.0)
    ax.set_xlabel("Virtual stiffness [kN/m]\nline: 2 C/Δ; dotted: where the thesis met limit cycles")


if __name__ == "__main__":
    write_figure(draw, "quantisation-limit")
