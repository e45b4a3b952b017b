"""Along lines through the plane of walls: outwards until the verdict changes, and to where it does.

One verdict beyond a nonlinear device's edge may be stable by chance, so a march from it ends anywhere. The way up
to what was found is therefore looked at again, and the lowest change counts.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.contact.bench import Bench, Observation, observe

Floats = NDArray[np.float64]

MARCHES: Final = 12  # steps outwards, each twice as long as the one before
# of a stiffness found: where the way to it is looked at again
SHARES: Final = np.array([1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 0.94, 0.98, 1.0])
LOWERED: Final = 4  # times a way without a stable wall is looked at again, further down
AFTER: Final = np.array([1.05, 1.2, 1.5])  # times the first unstable stiffness: looked at beyond it


class Lines(NamedTuple):
    """Lines through the plane of walls: a start (m, 2), and the direction outwards (m, 2)."""

    start: Floats
    outwards: Floats

    def at(self, t: Floats) -> Floats:
        return np.asarray(self.start + t[:, None] * self.outwards)

    def only(self, lanes: NDArray[np.bool_]) -> Lines:
        return Lines(self.start[lanes], self.outwards[lanes])


class Found(NamedTuple):
    """Along each line: the outermost stable place, the first unstable one (nan: none), and what was seen there."""

    stable: Floats
    unstable: Floats
    beyond: list[Observation | None]


def march(bench: Bench, lines: Lines, step: Floats, farthest: Floats, levels: int | None = None) -> Found:
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
        looks = observe(bench, lines.only(lanes).at(at[lanes]), levels)
        for i, seen in zip(np.flatnonzero(lanes), looks, strict=True):
            if seen.stable:
                stable[i] = at[i]
            else:
                unstable[i], beyond[i] = at[i], seen
        step = 2.0 * step
        at = np.minimum(stable + step, farthest)
    return Found(stable, unstable, beyond)


def bisect(bench: Bench, lines: Lines, found: Found, tolerance: Floats, levels: int | None = None) -> Found:
    """Halve the gap between stable and unstable until it is below the tolerance (m,)."""
    stable, unstable, beyond = found.stable.copy(), found.unstable.copy(), list(found.beyond)
    while True:
        lanes = unstable - stable > np.maximum(tolerance, 1e-12 * np.abs(unstable))
        if not lanes.any():
            return Found(stable, unstable, beyond)
        middle = 0.5 * (stable + unstable)
        looks = observe(bench, lines.only(lanes).at(middle[lanes]), levels)
        for i, seen in zip(np.flatnonzero(lanes), looks, strict=True):
            if seen.stable:
                stable[i] = middle[i]
            else:
                unstable[i], beyond[i] = middle[i], seen


def stiffenings(damping: Floats) -> Lines:
    """The lines of growing stiffness, from none, at dampings (m,)."""
    m = len(damping)
    return Lines(np.column_stack([np.zeros(m), damping]), np.tile([1.0, 0.0], (m, 1)))


def lowest_change(bench: Bench, damping: Floats, found: Found, least: float, tolerance: Floats) -> Found:
    """The same stiffnesses where all on the way to them is stable; else the lowest at which the verdict changes.

    damping   (m,);   found  along `stiffenings` of them [N/m]
    least     no softer wall is looked at [N/m];   tolerance  (m,)  of a change [N/m]
    Returns   as `found`; stable 0 where no stable wall was met
    """
    stable, unstable, beyond = found.stable.copy(), found.unstable.copy(), list(found.beyond)
    top, changed = found.stable.copy(), np.zeros(len(damping), dtype=bool)
    lanes = np.flatnonzero(stable > 0.0)
    for _ in range(LOWERED):
        if not len(lanes):
            break
        K = least + SHARES * (top[lanes, None] - least)
        walls = np.column_stack([K.ravel(), np.repeat(damping[lanes], len(SHARES))])
        looks = observe(bench, walls)
        open_ones = []
        for n, i in enumerate(lanes):
            own = looks[n * len(SHARES) : (n + 1) * len(SHARES)]
            holds = [seen.stable for seen in own]
            if not any(holds):
                open_ones.append(i)
                top[i], stable[i] = K[n, 0], 0.0
                continue
            first = holds.index(True)
            rest = holds[first:]
            last = first + (rest.index(False) if False in rest else len(rest)) - 1
            if last + 1 < len(own):
                stable[i], unstable[i], beyond[i], changed[i] = K[n, last], K[n, last + 1], own[last + 1], True
            else:
                stable[i] = K[n, last]
        lanes = np.array(open_ones, dtype=int)
    halved = bisect(
        bench, stiffenings(damping), Found(stable, np.where(changed, unstable, np.nan), beyond), tolerance
    )
    return Found(halved.stable, np.where(changed, halved.unstable, unstable), halved.beyond)


def holds_beyond(bench: Bench, damping: Floats, unstable: Floats) -> NDArray[np.bool_]:
    """Is some stiffer wall than the first unstable one (m,) stable again? False where none was unstable."""
    known = np.flatnonzero(np.isfinite(unstable))
    again = np.zeros(len(damping), dtype=bool)
    walls = np.column_stack([np.outer(unstable[known], AFTER).ravel(), np.repeat(damping[known], len(AFTER))])
    looks = np.array([seen.stable for seen in observe(bench, walls)], dtype=bool)
    again[known] = looks.reshape(len(known), len(AFTER)).any(axis=1)
    return again
