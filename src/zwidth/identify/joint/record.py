"""The motion of a joint out of its records: sections of long ones, cut into windows to fit and to validate on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.identify.joint.fit import Windows
from zwidth.identify.joint.joint import Joint
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SampleTimes
from zwidth.model.raw_sweep import encoder_step

MOST: Final = 300_000  # samples that are fitted or validated on; of a longer record sections all over it
SECTIONS: Final = 48  # of a longer record
BEFORE: Final = 8  # samples before a window, from which a delayed force comes
FEWEST: Final = 40  # samples in a window
MANY: Final = (36, 27, 18, 12, 6)  # windows of all records, as many as bend enough
BEND: Final = 40.0  # steps of the encoder by which the motion in a window leaves a straight line
STANDING: Final = 3.0  # steps within which a window that stands moves


@dataclass(frozen=True)
class RecordSection:
    """Consecutive samples without a gap.

    time, period  of the first sample [s]; sampling period [s]
    record, run   numbers of the record, and of the stretch over all records
    position, force, command  (n,); force of zeros where nothing drives, command empty where there is none
    """

    time: float
    period: float
    record: int
    run: int
    position: Floats
    force: Floats
    command: Floats


@dataclass(frozen=True)
class JointMotion:
    """What is fitted, from all records.

    sections    samples
    driven      whether a force or torque is known
    force_name  the column that drives, which may be 0 throughout; "" where there is none
    reference   reading that counts as position 0 of the fit [m or rad]
    step        of the encoder as seen in the readings [m or rad]; 0 where no step is seen
    noise       standard deviation of the readings' noise, steps included [m or rad]
    """

    sections: tuple[RecordSection, ...]
    driven: bool
    force_name: str
    reference: float
    step: float
    noise: float

    @property
    def resolution(self) -> float:
        """Step of the encoder, or one whose even error is as large as the noise: sqrt(12) of it [m or rad]."""
        return max(self.step, self.noise * float(np.sqrt(12.0)))

    @property
    def deviation(self) -> float:
        """Standard deviation of a reading, an even error within the encoder's steps included [m or rad]."""
        return max(self.step / float(np.sqrt(12.0)), self.noise)

    @property
    def time(self) -> Floats:
        """Time of each reading (n,), all sections one behind the other [s]."""
        return np.concatenate([one.time + one.period * np.arange(len(one.position)) for one in self.sections])

    @property
    def duration(self) -> float:
        """From the first reading of all records to the last [s]."""
        return float(np.ptp(self.time))

    @property
    def positions(self) -> Floats:
        """All readings (n,) that are kept [m or rad]."""
        return np.concatenate([one.position for one in self.sections])

    @property
    def forces(self) -> Floats:
        """All forces (n,) that are kept [N or N m]."""
        return np.concatenate([one.force for one in self.sections])


def read_motion(records: Sequence[Record], samplings: Sequence[SampleTimes], joint: Joint) -> JointMotion:
    """The motion in all records, each read once more; of more than 300 000 samples sections all over them.

    Raises DeviceError  for columns that are not the joint's, and records that differ in what drives it
    """
    total = sum(int(np.sum(np.diff(sampling.runs, axis=1))) for sampling in samplings)
    columns = [joint.force_column(record) for record in records]
    names = sorted({name for name, _ in columns})
    if len(names) > 1:
        listed = " and ".join(name or "no force" for name in names)
        raise records[0].fault(
            f"and the other records differ in what drives the joint, {listed}; give records alike"
        )
    sections, run = list[RecordSection](), 0
    for number, (record, sampling) in enumerate(zip(records, samplings, strict=True)):
        name, factor = columns[number]
        # the command is kept beside a force that was measured, to be compared with it
        beside = joint.command if name not in ("", joint.command) and joint.command in record else ""
        planned = planned_sections(sampling.runs, total)
        parts: list[list[tuple[Floats, ...]]] = [[] for _ in planned]
        for piece in sampling.stretches(record):
            row = piece["row"]
            for k, (low, high, _) in enumerate(planned):
                inside = slice(*np.searchsorted(row, [low, high]))
                if inside.stop > inside.start:
                    zero = np.zeros(inside.stop - inside.start)
                    force = factor * piece[name][inside] if name else zero
                    command = piece[beside][inside] if beside else zero
                    parts[k].append((piece["time_s"][inside], piece[joint.position][inside], force, command))
        for (_, _, stretch), pieces in zip(planned, parts, strict=True):
            time, position, force, command = (np.concatenate(one) for one in zip(*pieces, strict=True))
            kept = command if beside else np.zeros(0)
            sections.append(
                RecordSection(float(time[0]), sampling.period, number, run + stretch, position, force, kept)
            )
        run += len(sampling.runs)
    name = columns[0][0]
    driven = bool(name) and any(np.any(one.force != 0.0) for one in sections)
    y = np.concatenate([one.position for one in sections])
    step = encoder_step([one.position for one in sections])
    reference = 0.5 * float(np.min(y) + np.max(y))
    return JointMotion(tuple(sections), driven, name, reference, step, noise_of(sections))


def planned_sections(runs: Ints, total: int) -> list[tuple[int, int, int]]:
    """First row, the one behind the last, and the number of the stretch, of each section that is kept of a record.

    runs   (s, 2) first row, and the one behind the last, of its stretches;   total  samples of all records
    """
    long_enough = [(int(a), int(b), stretch) for stretch, (a, b) in enumerate(runs) if b - a >= FEWEST + BEFORE]
    if total <= MOST:
        return long_enough
    length = MOST // SECTIONS
    planned = []
    for a, b, stretch in long_enough:
        many = max(1, round((b - a) * SECTIONS / total))
        # of short stretches every so many is taken
        if (b - a) * SECTIONS < 0.5 * total and stretch % max(1, round(len(long_enough) / SECTIONS)):
            continue
        for start in np.linspace(a, max(b - length, a), many).astype(int):
            planned.append((int(start), int(min(start + length, b)), stretch))
    return planned


def noise_of(sections: Sequence[RecordSection]) -> float:
    """Standard deviation of what the readings have beside smooth motion [m or rad], by their sixth differences.

    Those of motion at a fortieth of the sampling frequency are a millionth of it; the median passes over the
    instants at which the force jumps.
    """
    sixths = np.concatenate([np.diff(one.position, 6) for one in sections])
    # 0.6745: median of |x| of normal numbers of variance 1; 924: variance of their sixth differences
    return float(np.median(np.abs(sixths)) / (0.6745 * np.sqrt(924.0))) if len(sixths) else 0.0


def windows_of(motion: JointMotion) -> Windows:
    """The motion cut into windows: as many as still bend by `BEND` steps, those without motion left out."""
    lengths = [len(one.position) - (BEFORE if motion.driven else 0) for one in motion.sections]
    total = sum(lengths)
    windows = None
    for many in MANY:
        windows = _cut_sections(motion, max(total // many, FEWEST))
        bends = [
            _largest_bend(windows.position[a : a + n]) for a, n in zip(windows.first, windows.length, strict=True)
        ]
        moves = np.array(
            [np.ptp(windows.position[a : a + n]) for a, n in zip(windows.first, windows.length, strict=True)]
        )
        moving = moves > STANDING * motion.resolution
        if moving.any() and np.median(np.array(bends)[moving]) >= BEND * motion.resolution:
            break
    assert windows is not None
    return windows.chosen(moving)


def _largest_bend(y: Floats) -> float:
    """By how much a motion leaves the straight line between its ends, at most [m or rad]."""
    return float(np.max(np.abs(y - np.linspace(y[0], y[-1], len(y)))))


def _cut_sections(motion: JointMotion, length: int) -> Windows:
    """All sections cut into windows of about `length` samples; first samples are left for a force that is late."""
    first, lengths, period, time, run = list[int](), list[int](), list[float](), list[float](), list[int]()
    row, before = 0, BEFORE if motion.driven else 0
    for section in motion.sections:
        samples = len(section.position) - before
        many = max(1, round(samples / length))
        edges = np.linspace(before, before + samples, many + 1).astype(int)
        for a, b in pairwise(edges):
            first.append(row + a)
            lengths.append(b - a)
            period.append(section.period)
            time.append(section.time + a * section.period)
            run.append(section.run)
        row += len(section.position)
    return Windows(
        motion.positions - motion.reference,
        motion.forces,
        np.array(first, dtype=np.int64),
        np.array(lengths, dtype=np.int64),
        np.array(period),
        np.array(time),
        np.array(run, dtype=np.int64),
        motion.driven,
        _clock(motion),
    )


def _clock(motion: JointMotion) -> Floats:
    """Time of each sample (n,) as a share of that of all records, from -1/2 to 1/2."""
    return np.asarray((motion.time - np.min(motion.time)) / motion.duration - 0.5)
