"""Along lines through the plane of walls: outwards until the verdict changes, and to where it does.

One verdict beyond a nonlinear device's edge may be stable by chance, so a march from it ends anywhere. The way to
what was found is therefore looked at again, and the change nearest to the line's start counts.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.contact.stability_trial import Observation, StabilityTrial, observe

MARCHES: Final = 12  # steps outwards, each twice as long as the one before
# of the way to what was found: where it is looked at again
SHARES: Final = np.array([1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 0.94, 0.98, 1.0])
LOWERED: Final = 4  # times a way without a stable wall is looked at again, further down
AFTER: Final = np.array([1.05, 1.2, 1.5])  # times the way to the first unstable wall: looked at beyond it


class Lines(NamedTuple):
    """Lines through the plane of walls: a start (m, 2), and the direction outwards (m, 2)."""

    start: Floats
    outwards: Floats

    def at(self, t: Floats) -> Floats:
        return np.asarray(self.start + t[:, None] * self.outwards)

    def only(self, lanes: Flags | NDArray[np.intp]) -> Lines:
        return Lines(self.start[lanes], self.outwards[lanes])


class Brackets(NamedTuple):
    """Along each line: the outermost stable place, the first unstable one (nan: none), and what was seen there."""

    stable: Floats
    unstable: Floats
    observations: list[Observation | None]


def march(
    trial: StabilityTrial, lines: Lines, step: Floats, farthest: Floats, levels: int | None = None
) -> Brackets:
    """Step outwards, twice as far each time, until a wall is unstable.

    step      (m,)  the first;   farthest (m,)  no farther than this;   levels  see `observe`
    """
    m = len(step)
    stable, unstable = np.zeros(m), np.full(m, np.nan)
    beyond: list[Observation | None] = [None] * m
    at = np.minimum(step, farthest)
    for _ in range(MARCHES):
        lanes = np.isnan(unstable) & (stable < farthest)
        if not lanes.any():
            break
        looks = observe(trial, lines.only(lanes).at(at[lanes]), levels)
        for i, observation in zip(np.flatnonzero(lanes), looks, strict=True):
            if observation.stable:
                stable[i] = at[i]
            else:
                unstable[i], beyond[i] = at[i], observation
        step = 2.0 * step
        at = np.minimum(stable + step, farthest)
    return Brackets(stable, unstable, beyond)


def bisect(
    trial: StabilityTrial, lines: Lines, brackets: Brackets, tolerance: Floats, levels: int | None = None
) -> Brackets:
    """Halve the gap between stable and unstable until it is below the tolerance (m,)."""
    stable, unstable, beyond = brackets.stable.copy(), brackets.unstable.copy(), list(brackets.observations)
    while True:
        lanes = unstable - stable > np.maximum(tolerance, 1e-12 * np.abs(unstable))
        if not lanes.any():
            return Brackets(stable, unstable, beyond)
        middle = 0.5 * (stable + unstable)
        looks = observe(trial, lines.only(lanes).at(middle[lanes]), levels)
        for i, observation in zip(np.flatnonzero(lanes), looks, strict=True):
            if observation.stable:
                stable[i] = middle[i]
            else:
                unstable[i], beyond[i] = middle[i], observation


def stiffness_lines(damping: Floats, least: float) -> Lines:
    """The lines of growing stiffness, from the softest wall that is looked at [N/m], at dampings (m,)."""
    m = len(damping)
    return Lines(np.column_stack([np.full(m, least), damping]), np.tile([1.0, 0.0], (m, 1)))


def nearest_change(
    trial: StabilityTrial, lines: Lines, brackets: Brackets, tolerance: Floats, *, start_stable: bool
) -> Brackets:
    """Move the end of each line back to the first change of the verdict; ends with a stable way to them stay.

    brackets      along the lines, as `march` and `bisect` leave it;   tolerance  (m,)  of a change
    start_stable  is the start of each line known to be stable? If not, the way begins at the first stable wall
    Returns       as `brackets`; stable 0 where no stable wall was met
    """
    stable, unstable, beyond = brackets.stable.copy(), brackets.unstable.copy(), list(brackets.observations)
    top, changed = brackets.stable.copy(), np.zeros(len(stable), dtype=bool)
    lanes = np.flatnonzero(stable > 0.0)
    for _ in range(LOWERED):
        if not len(lanes):
            break
        t = SHARES * top[lanes, None]
        again = lanes.repeat(len(SHARES))
        looks = observe(trial, lines.only(again).at(t.ravel()))
        open_ones = []
        for n, i in enumerate(lanes):
            own = looks[n * len(SHARES) : (n + 1) * len(SHARES)]
            stable_flags = [start_stable, *(observation.stable for observation in own)]
            places = [0.0, *t[n]]
            if not any(stable_flags):
                open_ones.append(i)
                top[i], stable[i] = t[n, 0], 0.0
                continue
            first = stable_flags.index(True)
            rest = stable_flags[first:]
            last = first + (rest.index(False) if False in rest else len(rest)) - 1
            stable[i] = places[last]
            if last < len(own):
                unstable[i], beyond[i], changed[i] = places[last + 1], own[last], True
        lanes = np.array(open_ones, dtype=int)
    halved = bisect(trial, lines, Brackets(stable, np.where(changed, unstable, np.nan), beyond), tolerance)
    return Brackets(halved.stable, np.where(changed, halved.unstable, unstable), halved.observations)


def stable_beyond(trial: StabilityTrial, lines: Lines, unstable: Floats) -> Flags:
    """Whether a wall beyond the first unstable one (m,) is stable again; False where none is unstable."""
    known = np.flatnonzero(np.isfinite(unstable))
    again = np.zeros(len(unstable), dtype=bool)
    t = np.outer(unstable[known], AFTER)
    looks = observe(trial, lines.only(known.repeat(len(AFTER))).at(t.ravel()))
    again[known] = np.array([observation.stable for observation in looks], dtype=bool).reshape(t.shape).any(axis=1)
    return again
