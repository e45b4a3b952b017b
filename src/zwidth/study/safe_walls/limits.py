"""Limits of damping of a cell's bands of stiffnesses, and the samples at which they are tightest."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.study.safe_walls.samples import Sampler, Samples
from zwidth.study.safe_walls.stable_intervals import common_interval

LEAST: Final = 0.002  # share of the widest range of a cell's bands by which each limit is narrowed at least
HALF: Final = 0.5  # share of a narrowing that a sample may use up
REACH: Final = 2.0  # how much steeper than on average a limit may be, for a place to be searched from
NONE: Final = (0.0, -1.0)  # an empty range of damping


class Tightest:
    """The tightest sample of each limit so far, in each group of samples.

    A limit may be tight at several places of a cell, in several directions, and the tightest of its samples need
    not lie beside the tightest of all places.

    samples  (groups * 2 bands) of each group: of the lowest dampings of all bands, then of the highest
    damping  (groups, 2 bands)  lowest damping there, and the highest times -1; -inf where there is none
    """

    def __init__(self, sampler: Sampler, samples: Samples, intervals: Floats, centre: Floats) -> None:
        self.sampler = sampler
        self.damping = np.full((sampler.groups, 2 * intervals.shape[1]), -np.inf)
        self.samples = samples[np.zeros(self.damping.size, dtype=np.int64)]
        self.spread = np.zeros(self.damping.shape[1])
        self.take(samples, intervals, centre)

    def take(self, samples: Samples, intervals: Floats, centre: Floats) -> None:
        """Keep those of n further samples that are tighter.

        intervals  (h n, bands, GAPS, 2)  of the samples with each of h hands
        centre     (bands,)  damping that the intervals hold; nan for a band that has none
        """
        bands, count = len(centre), len(samples)
        group = self.sampler.group(samples)
        groups = [(g, np.flatnonzero(group == g)) for g in np.unique(group).tolist()]
        for j in np.flatnonzero(~np.isnan(centre)):
            own = around(intervals[:, j], centre[j])
            for side, of_all in enumerate((own[:, 0], -own[:, 1])):
                tightness = np.nan_to_num(of_all, nan=-np.inf).reshape(-1, count).max(axis=0)
                k = side * bands + int(j)
                known = tightness[np.isfinite(tightness)]
                self.spread[k] = max(self.spread[k], np.ptp(known) if len(known) else 0.0)
                for g, rows in groups:
                    worst = int(rows[np.argmax(tightness[rows])])
                    if tightness[worst] > self.damping[g, k]:
                        self.damping[g, k] = tightness[worst]
                        self.samples.put(g * len(self.spread) + k, samples, worst)

    def near(self, step: float) -> Samples:
        """The samples from which a step, a share of the cell, may lead to the tightest of all: those that are less
        apart from it than REACH times that share of what the limit differs by within the cell."""
        known = np.isfinite(self.damping)
        close = known & (self.damping >= self.damping.max(axis=0) - REACH * step * self.spread)
        rows = np.flatnonzero(close.ravel())
        places = np.column_stack([self.samples.posture, self.samples.sector, self.samples.direction])[rows]
        return self.samples[rows[np.sort(np.unique(places, axis=0, return_index=True)[1])]]

    def of_limit(self, side: int, band: int) -> Samples:
        """The samples of a limit, of each group that has one; side 0: its lowest damping, 1: its highest."""
        bands = self.damping.shape[1] // 2
        k = side * bands + band
        groups = np.flatnonzero(np.isfinite(self.damping[:, k]))
        return self.samples[groups * 2 * bands + k]


class Limits:
    """Limits of damping of each band, with what they are narrowed by.

    intervals  (N, bands, GAPS, 2)  stable ones at the lattice's samples
    coarse     (N,)  which samples belong to the lattice of every second point
    """

    def __init__(self, intervals: Floats, coarse: Flags, narrowing: bool) -> None:
        count = intervals.shape[1]
        self.centre, self.extreme, self.narrowing = (
            np.full(count, np.nan),
            np.zeros((count, 2)),
            np.zeros((count, 2)),
        )
        for j in range(count):
            low, high = common_interval(intervals[:, j])
            if not low < high:
                continue
            self.centre[j] = 0.5 * (low + high)
            own = around(intervals[:, j], self.centre[j])
            self.extreme[j] = own[:, 0].max(), own[:, 1].min()
            lost = self.extreme[j] - (own[coarse, 0].max(), own[coarse, 1].min())
            self.narrowing[j] = np.abs(lost)
        width = self.extreme[:, 1] - self.extreme[:, 0]
        self.narrowing = (
            np.maximum(self.narrowing, LEAST * width.max(initial=0.0)) if narrowing else self.narrowing * 0.0
        )

    @property
    def narrowed_share(self) -> float:
        """The most that limits are narrowed by in a band, as a share of the widest range: bands near the largest
        stiffness are thin, and more samples make them little wider."""
        known = ~np.isnan(self.centre)
        width = (self.extreme[known, 1] - self.extreme[known, 0]).max(initial=0.0)
        return float(self.narrowing.sum(axis=1)[known].max(initial=0.0)) / width if width > 0.0 else 0.0

    @property
    def ranges(self) -> Floats:
        """(bands, 2) damping [N s/m]; NONE where nothing is left."""
        low, high = (self.extreme + self.narrowing * (1.0, -1.0)).T
        left = ~np.isnan(self.centre) & (low < high)
        return np.where(left[:, None], np.column_stack([low, high]), NONE)

    def tighten(self, intervals: Floats) -> None:
        """Take the limits of further samples where they are tighter, what they are narrowed by as before."""
        for j in np.flatnonzero(~np.isnan(self.centre)):
            own = around(intervals[:, j], self.centre[j])
            if np.isnan(own).any():  # no stable interval holds the middle: nothing is left of this band
                self.centre[j] = np.nan
                continue
            self.extreme[j] = max(self.extreme[j, 0], own[:, 0].max()), min(self.extreme[j, 1], own[:, 1].min())

    def meet(self, intervals: Floats) -> bool:
        """Move the limits that further samples have used up, and double what they are narrowed by; returns whether
        there are any."""
        centre, before = self.centre.copy(), self.extreme.copy()
        self.tighten(intervals)
        moved = np.abs(self.extreme - before) > HALF * self.narrowing
        self.extreme = np.where(moved, self.extreme, before)
        self.narrowing = np.where(moved, 2.0 * self.narrowing, self.narrowing)
        return bool(moved[~np.isnan(self.centre)].any() or (np.isnan(self.centre) != np.isnan(centre)).any())


def around(intervals: Floats, damping: float) -> Floats:
    """Of each sample's intervals (N, GAPS, 2) the one (N, 2) that holds this damping; nan where none does."""
    inside = (intervals[..., 0] < damping) & (damping < intervals[..., 1])
    out = np.full((len(intervals), 2), np.nan)
    rows, gap = np.nonzero(inside)
    out[rows] = intervals[rows, gap]
    return out
