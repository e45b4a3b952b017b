"""When the samples of a record were taken: their period, jitter and gaps.

`check_periods` and `check_mass_in_file`: whether a record's period, and the mass that it tells, are of the size
that the device file gives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.device.faults import plural
from zwidth.identify.identification import Check
from zwidth.identify.records.record import Piece, Record
from zwidth.unit_text import unit_text

UNEVEN: Final = 0.2  # share of the period by which a step may be longer or shorter
MOST_UNEVEN: Final = 0.01  # share of the steps that may be so
FIRST: Final = 20_000  # rows from which the period is read at first
FEWEST: Final = 100  # rows of a record
ROUNDING: Final = 1e-8  # share of the period by which steps differ as numbers are rounded
SAME_PERIOD: Final = 1e-3  # relative, by which the record's period may differ from the computer's
MORE_DIGITS: Final = "write it with more digits, as seconds from the beginning of the record"


@dataclass(frozen=True)
class SampleTimes:
    """A record's time stamps, column time_s.

    period   mean step where no sample is missing [s]
    jitter   standard deviation of such a step [s]
    rows     number of rows
    missing  samples that are not there, and rows with a cell without a number
    runs     (r, 2) first row, and the one behind the last, of each stretch without a gap
    """

    period: float
    jitter: float
    rows: int
    missing: int
    runs: Ints

    @property
    def longest(self) -> int:
        """Samples in the longest stretch without a gap."""
        return int(np.max(np.diff(self.runs, axis=1), initial=0))

    def stretches(self, record: Record) -> Iterator[Piece]:
        """The record's pieces, cut at the gaps, with two further columns.

        row     of each sample in the record
        sample  its number, which leaves out one at each gap: a piece goes on where the one before has ended only
                if its numbers do, also where rows are not there
        """
        start = 0
        for piece in record.pieces():
            rows = len(piece["time_s"])
            first = int(np.searchsorted(self.runs[:, 1], start, side="right"))
            for run, (low, high) in enumerate(self.runs[first:], first):
                if low >= start + rows:
                    break
                inside = slice(max(low - start, 0), min(high - start, rows))
                cut = {name: values[inside] for name, values in piece.items()}
                row = np.arange(start + inside.start, start + inside.stop)
                yield cut | {"row": row, "sample": row + run}
            start += rows


def joined(stretches: Iterable[Piece]) -> Iterator[tuple[Piece, bool]]:
    """Pieces with a column "sample", and whether each goes on where the one before has ended.

    Those without rows are left out.
    """
    after = -1
    for piece in stretches:
        numbers = piece["sample"]
        if len(numbers):
            yield piece, int(numbers[0]) == after
            after = int(numbers[-1]) + 1


def check_sampling(record: Record, period: float | None = None) -> tuple[SampleTimes | None, Check]:
    """The sampling of a record with a column time_s, and the check that it is regular.

    period   of the computer that is to have written the record [s]; None: any
    Returns  None for the sampling where there is none: fewer than 100 rows, a time that falls or stands still,
             steps of which more than 1 % are off by a fifth, or another period than the one given
    Raises   DeviceError  for cells that are no numbers
    """
    pieces = record.pieces()
    first = next(pieces, None)
    if first is None or len(first["time_s"]) < FEWEST:
        rows = 0 if first is None else len(first["time_s"])
        return _failed(f"{plural(rows, 'row')} in {record.label}, at least {FEWEST} are needed; record longer")
    usual = _usual_step(first["time_s"][:FIRST])
    if not usual > 0.0:
        what = "falls; sort the rows by rising time" if usual < 0.0 else f"stands still; {MORE_DIGITS}"
        return _failed(f"time_s of {record.label} {what}")
    # runs: rows at which stretches begin and end; sums as `_sample_times` takes them
    row, missing, uneven, sums, runs = 0, 0, 0, np.zeros(3), list[Ints]()
    last, last_whole, first_uneven = np.nan, False, -1
    for piece in chain([first], pieces):
        time = np.append(last, piece["time_s"])
        whole = np.all([np.isfinite(v) for name, v in piece.items() if name not in record.text], axis=0)
        steps = np.diff(time) / usual
        falling = np.flatnonzero(steps <= 0.0)
        if len(falling):
            return _failed(_fault_of_order(record, time, row, int(falling[0])))
        # multiples of the usual step: one where no sample is missing
        many = np.rint(np.where(np.isfinite(steps), steps, 1.0))
        off_rows = np.flatnonzero(np.isfinite(steps) & (np.abs(steps - many) > UNEVEN) | (many < 1.0))
        uneven += len(off_rows)
        first_uneven = row + int(off_rows[0]) if len(off_rows) and first_uneven < 0 else first_uneven
        missing += int(np.sum(many - 1.0) + np.sum(~whole))
        even = steps[np.isfinite(steps) & (many == 1.0)]
        sums += len(even), np.sum(even - 1.0), np.sum((even - 1.0) ** 2)
        before = np.append(last_whole, whole[:-1])
        # a stretch begins with a whole row behind a gap or a broken one, and ends before such a one
        runs.append(row + np.flatnonzero(whole & ~(before & (many == 1.0))))
        runs.append(row + np.flatnonzero(before & ~(whole & (many == 1.0))))
        last, last_whole, row = float(piece["time_s"][-1]), bool(whole[-1]), row + len(whole)
    edges = np.sort(np.concatenate([*runs, [row] if last_whole else []]).astype(np.int64))
    if uneven > MOST_UNEVEN * row:
        return _failed(_fault_of_steps(record, uneven, row, usual, first_uneven))
    sampling = _sample_times(usual, sums, row, missing, edges)
    if period is not None and abs(sampling.period / period - 1.0) > SAME_PERIOD:
        return _failed(_fault_of_period(record, sampling.period, period))
    return sampling, Check("sampling", True, _sampling_sentence(sampling))


def _failed(reason: str) -> tuple[None, Check]:
    """Return no sampling, None, and the check that failed for this reason."""
    return None, Check("sampling", False, reason)


def _fault_of_order(record: Record, time: Floats, row: int, i: int) -> str:
    """Say where the time stamps [s] do not rise: from `time[i]` to the next one.

    row  of the record at which a piece begins, `time[1]`
    """
    if time[i + 1] == time[i]:
        again = f"is {time[i]:.9g} s once more at {record.place(row + i)}"
        return f"time_s of {record.label} {again}; {MORE_DIGITS}, or leave out the row that is twice"
    return (
        f"time_s of {record.label} goes from {time[i]:.9g} to {time[i + 1]:.9g} s at "
        f"{record.place(row + i)}; sort the rows by rising time"
    )


def _fault_of_steps(record: Record, uneven: int, rows: int, usual: float, first: int) -> str:
    """Say how many rows, the first of them at row `first`, do not come a multiple of the usual step [s] after the
    one before."""
    return (
        f"{uneven} of {rows} rows of {record.label} do not follow the one before by {usual:.6g} s or a "
        f"multiple of it, first at {record.place(first)}; record every sample of the loop, with "
        "its own time"
    )


def _sample_times(usual: float, sums: Floats, rows: int, missing: int, edges: Ints) -> SampleTimes:
    """Compute period and jitter of the samples [s].

    usual  step of the time stamps at the beginning [s]
    sums   number of the steps where no sample is missing, and sums of their deviations from the usual one, over
           it, and of the squares of these
    edges  (2 r,) first row, and the one behind the last, of each stretch without a gap
    """
    count, mean = max(sums[0], 1.0), sums[1] / max(sums[0], 1.0)
    jitter = usual * float(np.sqrt(max(sums[2] / count - mean**2, 0.0)))
    return SampleTimes(usual * float(1.0 + mean), jitter, rows, missing, edges.reshape(-1, 2))


def _fault_of_period(record: Record, own: float, period: float) -> str:
    """Say that a record's own period is not that of the computer, `period` [s], and what may be the cause."""
    return (
        f"the rows of {record.label} come every {own:.6g} s, the device's computer samples every "
        f"{period:.6g} s; "
        + (unit_of_time(own / period) or "record every sample of the loop, or correct loop.sampling_period_s")
    )


def unit_of_time(ratio: float) -> str:
    """The question whether time_s is in another unit, by the ratio of its period to the computer's; "" where none.

    >>> unit_of_time(900.0)
    'is time_s in milliseconds? multiply by 0.001'
    """
    for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6)):
        if 0.5 < ratio / factor < 2.0:
            return f"is time_s in {unit}? multiply by {1.0 / factor:g}"
    return ""


def _usual_step(time: Floats) -> float:
    """The mean of the steps that are like the median one [s]: the period to the stamps' last digit."""
    steps = np.diff(time[np.isfinite(time)])
    middle = float(np.median(steps)) if len(steps) else 0.0
    alike = steps[np.abs(steps - middle) <= 0.5 * abs(middle)]
    return float(np.mean(alike)) if middle > 0.0 else middle


def _sampling_sentence(sampling: SampleTimes) -> str:
    """Rows, period, jitter and missing samples of a record in words."""
    gaps = len(sampling.runs) - 1
    lost = f", {plural(sampling.missing, 'sample')} missing in {plural(gaps, 'gap')}" if sampling.missing else ""
    jitter = (
        f", steps even to {100 * sampling.jitter / sampling.period:.2g} %"
        if sampling.jitter > ROUNDING * sampling.period
        else ""
    )
    return f"{sampling.rows} rows every {sampling.period:.6g} s{jitter}{lost}"


NEAR: Final = 2.0  # by which a ratio may differ from that of two units
UNLIKELY: Final = 20.0  # times the file's mass, either way, that is remarked

# Mass found, over that of the file -> what such a record holds: a mass is force over acceleration.
LINEAR_SLIPS: Final = {
    1e3: "the force in millinewtons",
    1e-3: "the position in millimetres, or the force in kilonewtons",
    1e-6: "the position in micrometres",
}
TURNING_SLIPS: Final = {
    1e3: "the torque in millinewton metres",
    1e-3: "the angle in milliradians",
    0.0174533: "the angle in degrees",
}


def check_periods(records: Sequence[Record], samplings: Sequence[SampleTimes], period: float) -> list[Check]:
    """Faults of records that another computer than the device's may have written; [] where all have its period.

    period  of the device's computer [s]
    """
    checks = list[Check]()
    for record, sampling in zip(records, samplings, strict=True):
        ratio = sampling.period / period
        if abs(ratio - 1.0) <= SAME_PERIOD:
            continue
        text = (
            f"the rows of {record.label} come every {sampling.period:.6g} s, the device's computer samples every "
            f"{period:.6g} s"
        )
        if unit := unit_of_time(ratio):
            checks.append(Check("sampling period", False, f"{text}: {unit}"))
            continue
        text += (
            "; right if another recorder wrote it. If not, all speeds and accelerations are wrong: correct "
            "time_s, or loop.sampling_period_s"
        )
        checks.append(Check("sampling period", False, text, warning=True))
    return checks


def check_mass_in_file(name: str, value: float, known: float, unit: str, *, turns: bool) -> list[Check]:
    """Whether the mass found is of the size that the file gives; [] where the file gives none, or
    none above 0 was found.

    name, unit    of the mass, for messages
    value, known  found, and in the file [kg] or [kg m²]
    turns         whether the motion is a turn, in radians
    """
    if not (isfinite(known) and known > 0.0 and value > 0.0):
        return []
    times, unit = value / known, unit_text(unit)
    text = f"{name} is about {value:.3g} {unit}, {times:.3g} times the {known:.4g} {unit} of the device file"
    for factor, slip in (TURNING_SLIPS if turns else LINEAR_SLIPS).items():
        if 1.0 / NEAR < times / factor < NEAR:
            text += f": is {slip}? Columns are in N, m, N m, rad. If the record is right, correct the file first"
            return [Check("mass in the file", False, text)]
    likely = 1.0 / UNLIKELY < times < UNLIKELY
    hint = "" if likely else ": check the units of the columns, and the mass in the file"
    return [Check("mass in the file", likely, text + hint, warning=not likely)]
