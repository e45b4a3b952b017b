"""Rows of `loop.sections` for many classically damped plants at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled
from zwidth.loop.controller import Controller, whole_samples
from zwidth.loop.hold import held_row
from zwidth.model.modes import REPEATED, UNOBSERVED, UNOBSERVED_UNDAMPED
from zwidth.model.rendered_modes import RenderedModes
from zwidth.threads import in_chunks

Floats = NDArray[np.float64]


def modal_rows_batch(modes: RenderedModes, controller: Controller) -> tuple[Floats, NDArray[np.int64]]:
    """The rows (N, m, 9) of each plant, and how many of them are used (N,): 0 where the modes are nan.

    controller  the same for all plants, or one of N designs for each

    The same as `sections.sampled_sections` makes of one plant, but without an actuator lag.
    """
    rows = np.zeros((*modes.frequency_squared.shape, 9))
    used = np.empty(len(rows), dtype=np.int64)
    delay = np.ravel(np.asarray(controller.delay, dtype=np.float64))
    fraction = np.maximum(delay - whole_samples(delay), 0.0)
    period = np.array(np.ravel(controller.sampling_period), dtype=np.float64)

    def several(first: int, last: int) -> None:
        _rows(
            modes.decay, modes.frequency_squared, modes.input, modes.output, period, fraction, rows, used,
            first, last,
        )  # fmt: skip

    in_chunks(several, len(rows))
    return rows, used


@compiled
def _rows(
    decay: Floats,
    squared: Floats,
    enter: Floats,
    leave: Floats,
    periods: Floats,
    fractions: Floats,
    rows: Floats,
    used: NDArray[np.int64],
    first: int,
    last: int,
) -> None:
    """Fill in `rows` and `used` from the modes (N, m) of plants first to last - 1; one period is that of all."""
    m = squared.shape[1]
    residue, taken = np.empty(m), np.empty(m, dtype=np.bool_)
    for i in range(first, last):
        period = periods[i if len(periods) > 1 else 0]
        fraction = fractions[i if len(fractions) > 1 else 0]
        used[i] = 0
        entering, leaving, stiffest, fastest = 0.0, 0.0, 0.0, 0.0
        for k in range(m):
            residue[k], taken[k] = enter[i, k] * leave[i, k], False
            entering, leaving = entering + abs(enter[i, k]), leaving + abs(leave[i, k])
            stiffest, fastest = max(stiffest, abs(squared[i, k])), max(fastest, abs(decay[i, k]))
        total = entering * leaving
        # a posture without numbers has no sections: `used` stays 0
        if not np.isfinite(total):
            continue
        for k in range(m):
            if taken[k]:
                continue
            weight = residue[k]
            for j in range(k + 1, m):
                # modes of one frequency and damping are one section with the sum of their residues: apart,
                # rounding would leave a pole and a zero that nearly cancel
                apart = abs(squared[i, j] - squared[i, k])
                if apart <= REPEATED * stiffest and abs(decay[i, j] - decay[i, k]) <= REPEATED * fastest:
                    taken[j] = True
                    weight += residue[j]
            row = held_row(decay[i, k], squared[i, k], period, fraction)
            still = abs(decay[i, k]) * period < 1e-9
            # a mode that the wall does not move, or the sensor does not read, is only rounding: it is left out
            level = total * period**2 * (UNOBSERVED_UNDAMPED if still else UNOBSERVED)
            size = 0.0
            for c in range(2, 8):
                size = max(size, abs(weight * row[c]))
            if not size > level:
                continue
            out = rows[i, used[i]]
            out[0], out[1], out[8] = row[0], row[1], 0.0
            for c in range(2, 8):
                out[c] = weight * row[c]
            used[i] += 1
