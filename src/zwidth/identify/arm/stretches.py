"""The parts of a record without gaps, smoothed and thinned piece by piece, so that memory stays flat."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.arm.checks import DriveChannels
from zwidth.identify.arm.smoothing import TorqueBand, convolved
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SampleTimes
from zwidth.resources import check_memory

Table = tuple[bool, Floats]  # whether a stretch begins with it; time, coordinates and forces (n, 1 + 2 d)


@dataclass(frozen=True)
class TorqueStretch:
    """A part of a record without gaps, smoothed, n samples.

    record   number of the record
    time     (n,) [s]
    coordinates, rates, accelerations  (n, d)  of the drives
    signs    (n, d)  the sign of the rates, smoothed as the torques are
    forces   (n, d)
    """

    record: int
    time: Floats
    coordinates: Floats
    rates: Floats
    accelerations: Floats
    signs: Floats
    forces: Floats

    def part(self, rows: slice) -> TorqueStretch:
        """The stretch with these of its samples only."""
        return TorqueStretch(self.record, *(getattr(self, name)[rows] for name in STRETCH))


STRETCH: Final = ("time", "coordinates", "rates", "accelerations", "signs", "forces")


@dataclass(frozen=True)
class TorqueTiming:
    """When a recorded torque acts: `shift` later [s], with `spread` [s²], half its second moment about then.

    hold and delay of a command: shift = delay + T/2 + lag, spread = T^2/24 + lag^2/2
    """

    shift: float = 0.0
    spread: float = 0.0


def smoothed(
    record: Record,
    number: int,
    sampling: SampleTimes,
    channels: DriveChannels,
    band: TorqueBand,
    timing: TorqueTiming,
) -> Iterator[TorqueStretch]:
    """The stretches of a record, smoothed and thinned; those too short for the kernel are left out.

    number  of the record among all;   channels  its columns;   timing  when its torques act
    """
    check_memory(  # of each drive five signals, and their time
        6.0 * len(channels.force) * sampling.rows / band.stride,
        f"the smoothed samples of {record.label}",
        "give a shorter record",
    )
    tables, period = _tables(record, sampling, channels), band.period
    if band.coarse > 1:
        tables, period = _guarded(tables, band), band.coarse * period
    half = band.wide.half(period)
    parts = list[TorqueStretch]()
    for begins, table in _windows(tables, 2 * half, band.stride // band.coarse):
        if begins and parts:
            yield _joined(parts)
            parts = []
        parts.append(_smooth(table, number, band, period, timing))
    if parts:
        yield _joined(parts)


def _tables(record: Record, sampling: SampleTimes, channels: DriveChannels) -> Iterator[Table]:
    """Time, coordinates and forces of the record's stretches, piece by piece."""
    starts = set(sampling.runs[:, 0].tolist())
    for piece in sampling.stretches(record):
        if len(piece["row"]):
            parts = piece["time_s"][:, None], channels.coordinates(piece), channels.forces(piece)
            yield int(piece["row"][0]) in starts, np.concatenate(parts, axis=1)


def _windows(tables: Iterator[Table], reach: int, stride: int) -> Iterator[Table]:
    """Cut stretches into windows, so that a kernel applied to each gives every row of the stretch once.

    Kept are every `stride`th row from row `reach` on that has `reach` rows before and behind it: a window holds
    its kept rows with `reach` rows on either side, and the next window's first kept row is one stride behind its
    last.
    Yields  whether a window is the first of its stretch, and its rows
    """
    remainder, begins = np.zeros((0, 0)), True
    for starts, table in tables:
        rows = table if starts else np.concatenate([remainder, table])
        begins = begins or starts
        count = (len(rows) - 2 * reach - 1) // stride + 1
        if count > 0:
            yield begins, rows[: 2 * reach + (count - 1) * stride + 1]
            begins = False
        remainder = rows[max(count, 0) * stride :].copy()


def _guarded(tables: Iterator[Table], band: TorqueBand) -> Iterator[Table]:
    """Tables thinned to one row of `band.coarse`, by the low pass `band.guard`, which takes nothing from the
    positions' band."""
    from scipy.signal import upfirdn

    half, down = band.guard.half(band.period), band.coarse
    taps = band.guard.taps(band.period)
    before = -2 * half % down  # rows of zeros, so that the first full sum is one of those that are kept
    for begins, table in _windows(tables, half, down):
        rows = np.ascontiguousarray(table.T[1:])
        rows = np.concatenate([np.zeros((len(rows), before)), rows], axis=1)
        kept = (2 * half + before) // down
        time = table[half : len(table) - half : down, 0]
        yield begins, np.column_stack([time, upfirdn(taps, rows, 1, down)[:, kept : kept + len(time)].T])


def _joined(parts: Sequence[TorqueStretch]) -> TorqueStretch:
    """One stretch of parts that follow each other."""
    return TorqueStretch(
        parts[0].record, *(np.concatenate([getattr(one, name) for one in parts]) for name in STRETCH)
    )


def _smooth(table: Floats, number: int, band: TorqueBand, period: float, timing: TorqueTiming) -> TorqueStretch:
    """The smoothed samples of a table, `Table` without its flag, that reaches twice half a kernel beyond them:
    rates are smoothed once as derivatives, and once more as signs.

    number  of the record;   period  of the table [s]
    """
    kernel, down, d = band.wide, band.stride // band.coarse, table.shape[1] // 2
    half = kernel.half(period)
    within_half, within_both = slice(half, len(table) - half), slice(2 * half, len(table) - 2 * half, down)
    q, force = table[:, 1 : 1 + d], table[within_half, 1 + d :]
    taps = [kernel.taps(period, k) for k in range(3)]
    # delayed by the shift, and spread in time by a second derivative
    force_taps = kernel.taps(period, 0, timing.shift) + timing.spread * kernel.taps(period, 2, timing.shift)
    rates = convolved(q, taps[1])
    return TorqueStretch(
        number,
        table[within_both, 0],
        convolved(q[within_half], taps[0], down),
        rates[half : len(rates) - half : down],
        convolved(q[within_half], taps[2], down),
        convolved(_signs(rates, band, period), taps[0], down),
        convolved(force, force_taps, down),
    )


def _signs(rates: Floats, band: TorqueBand, period: float) -> Floats:
    """Signs (n, d) of rates, going through 0 in a straight line within two deviations of their noise.

    period  of the rates [s]
    """
    taps = band.wide.taps(period, 1)
    size = np.sqrt(band.noise / (2.0 * period) * float(taps @ taps))
    return np.clip(rates / np.maximum(2.0 * size, 1e-300), -1.0, 1.0)
