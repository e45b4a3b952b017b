"""Rows of `loop.sections` for many plants at once, from their pairs of poles."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled
from zwidth.loop.controller import Controller, whole_samples
from zwidth.loop.hold import held_row, lagged_row
from zwidth.model.modes import REPEATED, UNOBSERVED, UNOBSERVED_UNDAMPED
from zwidth.model.pole_pairs import PolePairs
from zwidth.threads import in_chunks


def section_rows(pairs: PolePairs, controller: Controller) -> tuple[Floats, Ints]:
    """The rows (N, m, 9) of each plant, and how many of them are used (N,): 0 where its reach is nan.

    controller  the same for all plants, or one of N designs for each
    """
    rows = np.zeros((*pairs.decay.shape, 9))
    used = np.empty(len(rows), dtype=np.int64)
    delay = np.ravel(np.asarray(controller.delay, dtype=np.float64))
    fraction = np.maximum(delay - whole_samples(delay), 0.0)
    period = np.array(np.ravel(controller.sampling_period), dtype=np.float64)
    lag = np.array(np.ravel(controller.actuator_time_constant), dtype=np.float64)

    def several(first: int, last: int) -> None:
        fill_rows(
            pairs.decay, pairs.frequency_squared, pairs.position, pairs.velocity, pairs.reach, period, fraction,
            lag, bool(lag.any()), rows, used, first, last,
        )  # fmt: skip

    in_chunks(several, len(rows))
    return rows, used


@compiled
def fill_rows(
    decay: Floats,
    squared: Floats,
    position: Floats,
    velocity: Floats,
    reach: Floats,
    periods: Floats,
    fractions: Floats,
    lags: Floats,
    lagging: bool,
    rows: Floats,
    used: Ints,
    first: int,
    last: int,
) -> None:
    """Fill in `rows` and `used` from the pole pairs (N, m) of plants first to last - 1; one period serves all."""
    m = squared.shape[1]
    taken = np.empty(m, dtype=np.bool_)
    for i in range(first, last):
        period = periods[i if len(periods) > 1 else 0]
        fraction = fractions[i if len(fractions) > 1 else 0]
        lag = lags[i if len(lags) > 1 else 0]
        used[i] = 0
        # a plant without numbers has no sections: `used` stays 0
        if not np.isfinite(reach[i]):
            continue
        stiffest, fastest = 0.0, 0.0
        for k in range(m):
            taken[k] = False
            stiffest, fastest = max(stiffest, abs(squared[i, k])), max(fastest, abs(decay[i, k]))
        for k in range(m):
            if taken[k]:
                continue
            x, v = position[i, k], velocity[i, k]
            for j in range(k + 1, m):
                # pairs of one frequency and damping are one section with the sum of their shares: apart, rounding
                # would leave a pole and a zero that nearly cancel
                apart = abs(squared[i, j] - squared[i, k])
                if apart <= REPEATED * stiffest and abs(decay[i, j] - decay[i, k]) <= REPEATED * fastest:
                    taken[j] = True
                    x, v = x + position[i, j], v + velocity[i, j]
            if lagging:
                row = lagged_row(decay[i, k], squared[i, k], x, v, period, fraction, lag)
            else:
                row = held_row(decay[i, k], squared[i, k], x, v, period, fraction)
            still = abs(decay[i, k]) * period < 1e-9
            # a mode that the wall does not move, or the sensor does not read, is only rounding: it is left out
            level = reach[i] * period**2 * (UNOBSERVED_UNDAMPED if still else UNOBSERVED)
            size = 0.0
            for c in range(2, 8):
                size = max(size, abs(row[c]))
            if not size > level:
                continue
            for c in range(8):
                rows[i, used[i], c] = row[c]
            rows[i, used[i], 8] = 0.0
            used[i] += 1
