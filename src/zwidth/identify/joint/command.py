"""A measured force beside the commanded one: how much of it acts, and how late."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.identify.joint.record import Motion

LATEST: Final = 50  # samples by which a measured force may lag
ALIKE: Final = 0.5  # correlation below which the two are not the same force


@dataclass(frozen=True)
class Comparison:
    """measured(t) = gain command(t - lag), about their means.

    gain;  lag [s];  correlation at that lag
    """

    gain: float
    lag: float
    correlation: float


def compare_with_command(motion: Motion) -> Comparison | None:
    """The comparison over all sections; None where only one of the two was recorded, or one does not change.

    The lag is where the correlation of the two is largest, between samples by a parabola through three of them.
    """
    pairs = [(one.force, one.command) for one in motion.sections if len(one.command)]
    if not motion.driven or not pairs:
        return None
    shifts = np.arange(-2, LATEST + 1)
    measured = np.concatenate([force[LATEST:-2] for force, _ in pairs])
    sums = np.zeros((len(shifts), 2))
    for n, k in enumerate(shifts):
        moved = np.concatenate([command[LATEST - k : len(command) - 2 - k] for _, command in pairs])
        if len(moved) < 10 or np.std(moved) == 0.0 or np.std(measured) == 0.0:
            return None
        slope = float(np.cov(moved, measured)[0, 1])
        sums[n] = slope / (np.std(moved) * np.std(measured)), slope / np.var(moved)
    best = int(np.argmax(sums[:, 0]))
    inner = min(max(best, 1), len(shifts) - 2)
    before, here, after = sums[inner - 1 : inner + 2, 0]
    bend = before - 2.0 * here + after
    part = 0.5 * (before - after) / bend if bend < 0.0 and best == inner else 0.0
    return Comparison(
        float(sums[best, 1]), float((shifts[best] + part) * motion.sections[0].period), float(sums[best, 0])
    )
