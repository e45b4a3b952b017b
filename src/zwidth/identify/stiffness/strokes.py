"""Strokes of a slow back-and-forth motion: between turning points, without the stretch that stands still.

After a turn dry friction holds the shaft until the torque has changed by twice its size; what is read there says
nothing of the spring. What is left of each stroke is averaged in a few bins, which takes most of the noise out of
the angle: a noisy angle would make the fitted spring too soft.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.model.encoder_step import encoder_step

BINS: Final = 24  # of a stroke
FEWEST_BINS: Final = 6  # of a stroke: bins across the kink at 0 are left out, and others must remain
MOST_BINS: Final = 6000  # of a record
LEAST_TURN: Final = 0.05  # share of the range by which the angle comes back where it turns
TURN_COUNTS, TURN_NOISE = 3.0, 8.0  # or so many counts, or standard deviations of the noise
SMOOTHED: Final = 40  # of a stroke, over which the torque is smoothed to find its largest value
STUCK_COUNTS, STUCK_NOISE = 2.5, 6.0  # within which of its turning point the shaft has not moved
SPIKE_NOISE, SPIKE_COUNTS = 12.0, 3.0  # beyond both of the middle of five neighbours a reading is a spike


@dataclass(frozen=True)
class Resolution:
    """Steps and noise of readings.

    step   of which all differences between readings are multiples; 0 where they show none
    noise  standard deviation of single readings about their smooth course
    """

    step: float
    noise: float


@dataclass(frozen=True)
class Strokes:
    """Averages over bins of strokes.

    torque, angle  (n,) means of each bin
    reach          (n,) half of the angle that a bin covers
    samples        (n,) readings in the bin
    sign           (n,) 1 where the angle grows, -1 where it falls
    stroke         (n,) number of the stroke, ascending over all runs
    time           (n,) middle of the bin as a share of its record, 0 to 1
    run            (n,) number of the record
    since          (n,) way from the turn before [rad]; infinite in a record's first stroke, which begins anywhere
    """

    torque: Floats
    angle: Floats
    reach: Floats
    samples: Floats
    sign: Floats
    stroke: Ints
    time: Floats
    run: Ints
    since: Floats

    @property
    def count(self) -> int:
        """Number of strokes."""
        return len(np.unique(self.stroke))

    def select(self, which: Flags) -> Strokes:
        """Some of the bins."""
        return Strokes(**{field.name: getattr(self, field.name)[which] for field in fields(self)})


def resolution_of(values: Floats, known_step: float = 0.0) -> Resolution:
    """Step and noise of readings (n,).

    known_step  the sensor's, from the device's file; 0: read off the values
    """
    step = known_step or encoder_step([values])
    second = np.diff(values, n=2)
    # of white noise the second difference has 6 times the variance; the median does not see turns and spikes
    noise = float(np.median(np.abs(second))) / 0.6745 / np.sqrt(6.0) if len(second) else 0.0
    return Resolution(step, noise)


def without_spikes(values: Floats, resolution: Resolution) -> Flags:
    """Which readings (n,) are no spikes: single ones far from the middle of five neighbours."""
    if len(values) < 5:
        return np.ones(len(values), dtype=bool)
    padded = np.pad(values, 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    usual = float(np.median(np.abs(np.diff(values))))  # a turn of the motion is off by two steps
    limit = max(SPIKE_NOISE * resolution.noise, SPIKE_COUNTS * resolution.step, 1e-9 * float(np.ptp(values)))
    return np.abs(values - middle) <= limit + 4.0 * usual


def turning_points(angle: Floats, threshold: float) -> list[int]:
    """Rows at which the angle turns, both ends included: extremes from which it comes back by a threshold.

    >>> turning_points(np.array([0.0, 1.0, 2.0, 1.0, 0.0, -1.0, 0.0]), 0.5)
    [0, 2, 5, 6]
    """
    turns, extreme, rising = [0], 0, 0
    readings = angle.tolist()  # Python's own numbers are compared faster, one by one
    first = readings[0]
    for row, reading in enumerate(readings):
        if rising == 0:
            if abs(reading - first) > threshold:
                rising = 1 if reading > first else -1
                extreme = row
        elif rising * (reading - readings[extreme]) >= 0.0:
            extreme = row
        elif rising * (readings[extreme] - reading) > threshold:
            turns.append(extreme)
            extreme, rising = row, -rising
    if rising and extreme > turns[-1]:
        turns.append(extreme)
    return turns


def strokes_of(torque: Floats, angle: Floats, resolution: Resolution, run: int = 0, first: int = 0) -> Strokes:
    """The strokes of one record, in bins.

    torque, angle  (n,) in the order of time
    run            number of the record
    first          number of its first stroke
    """
    span = float(np.ptp(angle))
    threshold = max(LEAST_TURN * span, TURN_COUNTS * resolution.step, TURN_NOISE * resolution.noise)
    stuck = max(STUCK_COUNTS * resolution.step, STUCK_NOISE * resolution.noise)
    turns = turning_points(angle, threshold)
    columns = list[tuple[float, ...]]()
    number = first
    for start, end in pairwise(turns):
        sign = 1.0 if angle[end] > angle[start] else -1.0
        rows = start + _moving(sign * torque[start : end + 1], sign * angle[start : end + 1], stuck)
        if len(rows) < 2:
            continue
        for part in np.array_split(rows, min(max(MOST_BINS // (len(turns) - 1), FEWEST_BINS), BINS, len(rows))):
            place = float(np.mean(part)) / max(len(angle) - 1, 1)
            reach = 0.5 * abs(float(angle[part[-1]] - angle[part[0]])) if len(part) > 1 else 0.0
            mean = float(np.mean(torque[part])), float(np.mean(angle[part]))
            way = abs(mean[1] - float(angle[start])) if start else np.inf
            columns.append((*mean, reach, len(part), sign, number, place, run, way))
        number += 1
    torques, angles, reaches, samples, signs, numbers, places, runs, since = np.array(columns).reshape(-1, 9).T
    whole = numbers.astype(np.int64), runs.astype(np.int64)
    return Strokes(torques, angles, reaches, samples, signs, whole[0], places, whole[1], since)


def _moving(torque: Floats, angle: Floats, stuck: float) -> Ints:
    """Rows of a rising stroke (n,) in which the shaft moves: from where it has left its turning point by more than
    `stuck` up to the largest torque, behind which friction holds it again.

    The largest of a smoothed torque may be late by half of what is smoothed over.
    """
    width = max(len(torque) // SMOOTHED, 1) | 1
    free = angle - angle[0] > stuck
    first = int(np.argmax(free)) if free.any() else len(angle)
    return np.arange(first, int(np.argmax(smoothed(torque, width))) + 1 - width // 2)


def smoothed(values: Floats, width: int) -> Floats:
    """Moving average of values (n,) over so many, an odd number, those at the ends repeated."""
    width = max(width, 1) | 1
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def joined(strokes: list[Strokes]) -> Strokes:
    """Strokes of several records as one."""
    names = [field.name for field in fields(Strokes)]
    return Strokes(*(np.concatenate([getattr(one, name) for one in strokes]) for name in names))
