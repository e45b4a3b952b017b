"""States of many loops of a table: those of one structure are realised together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zwidth.arrays import Ints
from zwidth.loop.estimator import Estimator
from zwidth.loop.filters import Filter
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.realisation import StateSpace, realise
from zwidth.loop.sections import Sections

CHAINED = 8  # column of a row that is 1 where it is chained


def state_spaces(loops: LoopTable, which: Ints) -> Iterator[tuple[Ints, StateSpace]]:
    """Some of the loops, by structure: their places in `which`, and their states (p, ...).

    which   (n,)  numbers of loops; those that have no sections are left out
    Raises  ValueError  for chained sections: `Loop.state_space` has better states than their rows
    """
    if np.any(loops.rows[which, :, CHAINED]):
        raise ValueError("chained sections are realised one loop at a time, by Loop.state_space")
    kinds, kind_of = np.unique(_structure(loops, which), axis=0, return_inverse=True)
    for kind, structure in enumerate(kinds):
        places = np.flatnonzero(kind_of.ravel() == kind)
        if structure[0]:
            yield places, _states(loops, which[places])


def _structure(loops: LoopTable, which: Ints) -> Ints:
    """What loops have in common that are realised together, (n, s); the number of sections first."""
    c = loops.computer[which]
    counts = (loops.whole_delay, loops.split, loops.force_count, loops.velocity_count, loops.window_count)
    orders = [factors[c, :, 3] != 0.0 for factors in (loops.force, loops.velocity)]
    return np.column_stack([loops.section_count[which], *(count[c] for count in counts), *orders]).astype(np.int64)


def _states(loops: LoopTable, which: Ints) -> StateSpace:
    """States of loops of one structure."""
    c, one = loops.computer[which], loops.computer[which[0]]
    force = loops.force[c, : loops.force_count[one]]
    velocity = loops.velocity[c, : loops.velocity_count[one]]
    return realise(
        Sections(loops.rows[which, : loops.section_count[which[0]]], ()),
        int(loops.whole_delay[one]),
        bool(loops.split[one]),
        Filter(force[..., :3], force[..., 3:]),
        Estimator(velocity[..., :3], velocity[..., 3:], loops.window[c, : loops.window_count[one]]),
    )
