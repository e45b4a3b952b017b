"""Verdicts on single walls of a measured device: by the count of their roots, undecided within the error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats, Ints
from zwidth.chart.measured.boundary import Boundary
from zwidth.chart.measured.doubt import Doubt
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.verdict import STABLE, UNDECIDED, UNSTABLE, WallVerdicts
from zwidth.model.argument_checks import broadcast_walls as broadcast_walls


@dataclass(frozen=True, repr=False)
class MeasuredVerdicts(WallVerdicts):
    """Verdicts on walls (...) by the count of their roots outside the unit circle.

    The frequency is that of the nearest point of the stable set's edge; of the least |1 + L| where nothing is
    stable.

    outside  roots outside the unit circle
    """

    outside: Ints

    def table(self) -> dict[str, list[Any]]:
        return super().table() | {"roots_outside": self.outside.ravel().tolist()}


@dataclass(frozen=True)
class EdgeFrequencies:
    """The stable set's edge: segments (k, 4) of K, B, K, B, their frequencies (k,) [Hz], and its size (2,)."""

    segments: Floats
    frequencies: Floats
    size: Floats

    def frequency(self, walls: Floats) -> Floats:
        """Frequency (n,) of the piece nearest to each wall (n, 2), K and B in units of the set's size."""
        a = self.segments[:, :2] / self.size
        along = self.segments[:, 2:] / self.size - a
        length = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
        to = walls[:, None, :] / self.size - a
        share = np.clip(np.einsum("nij,ij->ni", to, along) / length, 0.0, 1.0)
        away = np.sum((to - share[..., None] * along) ** 2, axis=2)
        return np.asarray(self.frequencies[np.argmin(away, axis=1)])


def judge_measured(
    loop: MeasuredLoop,
    edge: Boundary,
    doubt: Doubt | None,
    wall_stiffness: ArrayLike,
    wall_damping: ArrayLike,
    nearest: EdgeFrequencies | None = None,
) -> MeasuredVerdicts:
    """Verdicts on walls K [N/m], B [N s/m] (...) that broadcast.

    A wall that the measurement's error leaves in doubt at some frequency is not called stable. It is called
    unstable if it has more roots outside than the two that each stretch of such frequencies can add; else it is
    undecided. So is one of many walls that is not finite; a single one raises ValueError.

    doubt  None where no error is known
    """
    K, B = broadcast_walls(wall_stiffness, wall_damping)
    walls = np.column_stack([K.ravel(), B.ravel()])
    finite = np.all(np.isfinite(walls), axis=1)
    safe = np.where(finite[:, None], walls, 0.0)
    outside = edge.outside(safe)
    none = np.zeros(len(safe), dtype=np.int64)
    stretches, hiding = doubt.stretches(safe) if doubt else (none, none)
    stable, unstable = (outside == 0) & (stretches == 0), outside > 2 * hiding
    frequency = nearest.frequency(safe) if nearest else _nearest_frequency(loop, safe)
    frequency[~finite] = np.nan
    verdict = np.where(finite & stable, STABLE, np.where(finite & unstable, UNSTABLE, UNDECIDED)).astype(np.int8)
    return MeasuredVerdicts(K, B, verdict.reshape(K.shape), frequency.reshape(K.shape), outside.reshape(K.shape))


def _nearest_frequency(loop: MeasuredLoop, walls: Floats) -> Floats:
    """The measured frequency (n,) of the least |1 + L| at each wall (n, 2)."""
    theta = loop.angles_below_pi
    h, w = loop.h(theta), loop.w(theta)
    parts = [walls[i : i + 500] for i in range(0, len(walls), 500)]
    nearest = [np.argmin(np.abs(part[:, :1] + part[:, 1:] * w - h) / np.abs(h), axis=1) for part in parts]
    return np.asarray(theta[np.concatenate([*nearest, np.empty(0, dtype=int)])] / (2.0 * np.pi * loop.period))
