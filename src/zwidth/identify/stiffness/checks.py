"""Checks of torque over angle before a spring is fitted to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.device.faults import plural
from zwidth.identify.identification import Check
from zwidth.identify.stiffness.spring_fit import (
    Resolution,
    Strokes,
    joined_strokes,
    resolution_of,
    smoothed_torque,
    strokes_of,
    without_spikes,
)

FEWEST_ROWS: Final = 8
FEWEST_COUNTS: Final = 10.0  # of the angle's range
NOISE_SHARE: Final = 0.05  # of the angle's range, that its noise may have
MOST_SPIKES: Final = 0.02  # share of the readings
HELD: Final = 0.15  # share of one range, over which the other may stand still at its end
NOISY: Final = 0.02  # share of the range that the noise of the column that goes on has, where it is averaged
SHORTEST_HOLD: Final = 400  # share of a record, 1 in so many, over which
ONE_SIDED: Final = 0.1  # share of the torque's range to the lesser side, below which it was bent one way only
WIDEST: Final = pi  # rad by which a blocked drive bends at most
UNLIKELY: Final = 20.0  # times the stiffness in the device file
UNITS: Final = {
    180.0 / pi: "a torque per degree",
    pi / 180.0: "degrees in place of radians",
    1000.0: "mN m in place of N m",
    0.001: "mrad in place of rad",
}


@dataclass(frozen=True)
class StrokeRun:
    """One record of one drive, at the motor's shaft.

    label          for messages
    torque, angle  (n,) in the order of time
    together       rows of the record that each value is the mean of
    left_out       rows without a number
    kept           (n,) readings that are no spikes
    """

    label: str
    torque: Floats
    angle: Floats
    together: int = 1
    left_out: int = 0
    kept: Flags = field(init=False)

    def __post_init__(self) -> None:
        """Find the spikes of both columns; none in a run of too few rows."""
        good = np.ones(len(self.angle), dtype=bool)
        if len(self.angle) >= FEWEST_ROWS:
            for values in (self.angle, self.torque):
                good &= without_spikes(values, resolution_of(values))
        object.__setattr__(self, "kept", good)


def check_runs(
    runs: Sequence[StrokeRun], known_step: float, known_stiffness: float | None
) -> tuple[list[Check], Resolution, bool]:
    """The checks, the resolution of the angle, and whether the spring was bent both ways, False where that was not
    looked at.

    known_step       of the encoder, from the device file [rad]; 0: read off the angles
    known_stiffness  of the drive in the device file [N m/rad]; None: none

    Later checks are left out where an earlier one fails without which they mean nothing.
    """
    checks = [_check_rows(runs)]
    if not checks[0].passed:
        return checks, Resolution(known_step, 0.0), False
    constant = _check_constant(runs)
    if constant is not None:
        checks.append(constant)
    nothing = Resolution(known_step, 0.0)
    if not all(check.passed for check in checks):
        return checks, nothing, False
    resolution = _coarsest_resolution([resolution_of(run.angle[run.kept], known_step) for run in runs])
    checks += [_check_spikes(runs), _check_units(runs), _check_motion(runs, resolution)]
    if not all(check.passed or check.warning for check in checks):
        return checks, resolution, False
    checks.append(_check_signs(runs))
    if not checks[-1].passed:
        return checks, resolution, False
    strokes = joined_strokes(
        [strokes_of(run.torque[run.kept], run.angle[run.kept], resolution, i) for i, run in enumerate(runs)]
    )
    checks.append(_check_strokes(strokes))
    if not all(check.passed or check.warning for check in checks):
        return checks, resolution, False
    checks += [_check_hysteresis(strokes), _check_ends(runs, resolution)]
    if known_stiffness is not None:
        checks.append(_check_against_file(strokes, known_stiffness))
    sides, both_sides = _check_sides(strokes)
    return [*checks, sides], resolution, both_sides


def _coarsest_resolution(found: Sequence[Resolution]) -> Resolution:
    """The largest step and the largest noise of several runs."""
    return Resolution(max(one.step for one in found), max(one.noise for one in found))


def _check_rows(runs: Sequence[StrokeRun]) -> Check:
    """Check that every run has enough readings."""
    short = [run for run in runs if len(run.angle) < FEWEST_ROWS]
    total = sum(len(run.angle) * run.together for run in runs)
    if short:
        return Check(
            "length",
            False,
            f"{plural(len(short[0].angle), 'reading')} in {short[0].label}, at least {FEWEST_ROWS} are needed; "
            "load and "
            "unload in many steps",
        )
    means = f", averaged {runs[0].together} at a time" if runs[0].together > 1 else ""
    return Check("length", True, f"{total} readings in {plural(len(runs), 'record')}{means}")


def _check_constant(runs: Sequence[StrokeRun]) -> Check | None:
    """The failed check of a column that is constant; None where none is."""
    for run in runs:
        for name, values in (("torque_Nm", run.torque), ("angle_rad", run.angle)):
            if np.ptp(values) == 0.0:
                return Check(
                    "motion",
                    False,
                    f"{name} of {run.label} is {values[0]:.6g} throughout; record while the torque changes",
                )
    return None


def _check_spikes(runs: Sequence[StrokeRun]) -> Check:
    """Check that few readings are spikes, and say what is left out."""
    left_out = sum(run.left_out for run in runs)
    spikes = sum(int(np.count_nonzero(~run.kept)) for run in runs)
    total = sum(len(run.angle) for run in runs)
    parts = []
    if left_out:
        parts.append(f"{plural(left_out, 'row')} without a number left out")
    if spikes:
        parts.append(f"{plural(spikes, 'spike')} left out: single readings far from their neighbours")
    if spikes > MOST_SPIKES * total:
        return Check(
            "readings", False, f"{spikes} of {total} readings are spikes; look at the sensor and its wiring"
        )
    return Check("readings", True, "; ".join(parts) or "all rows are numbers, without spikes")


def _check_units(runs: Sequence[StrokeRun]) -> Check:
    """Check that the angle of a blocked drive, in radians, runs over less than half a turn."""
    span = max(float(np.ptp(run.angle[run.kept])) for run in runs)
    if span > WIDEST:
        return Check(
            "units",
            False,
            f"the angle runs over {span:.4g} rad, more than half a turn of a blocked drive; are these degrees? "
            "multiply by pi/180",
        )
    return Check("units", True, f"the angle runs over {span:.4g} rad")


def _check_motion(runs: Sequence[StrokeRun], resolution: Resolution) -> Check:
    """Check that the angle runs over many counts and beyond its noise, in every run."""
    span = min(float(np.ptp(run.angle[run.kept])) for run in runs)
    if resolution.step and span < FEWEST_COUNTS * resolution.step:
        return Check(
            "motion",
            False,
            f"the angle runs over {span / resolution.step:.2g} counts of {resolution.step:.4g} rad, at least "
            f"{FEWEST_COUNTS:g} are needed; use more torque, or a finer sensor",
        )
    if resolution.noise > NOISE_SHARE * span:
        return Check(
            "motion",
            False,
            f"the angle's noise is {resolution.noise:.3g} rad and its range {span:.3g} rad; use more torque, or "
            "average; are the rows in the order of time?",
        )
    counts = (
        f"{span / resolution.step:.4g} counts of {resolution.step:.4g} rad"
        if resolution.step
        else f"{span:.4g} rad"
    )
    return Check("motion", True, f"{counts}, with noise of {resolution.noise:.3g} rad")


def _check_signs(runs: Sequence[StrokeRun]) -> Check:
    """Check that the torque grows with the angle in every run."""
    slopes = [float(np.polyfit(run.angle[run.kept], run.torque[run.kept], 1)[0]) for run in runs]
    falling = [run.label for run, slope in zip(runs, slopes, strict=True) if slope <= 0.0]
    if not falling:
        return Check("sign", True, "the torque grows with the angle")
    if len(falling) == len(runs):
        return Check("sign", False, "the torque falls as the angle grows; reverse the sign of one of the two")
    return Check(
        "sign",
        False,
        f"the torque falls as the angle grows in {', '.join(falling)} and grows in the other records; reverse the "
        "sign "
        "of one column there",
    )


def _check_strokes(strokes: Strokes) -> Check:
    """Check that the spring was both loaded and unloaded."""
    ways = set(strokes.sign.tolist())
    if strokes.count < 2 or len(ways) < 2:
        return Check(
            "loading and unloading",
            False,
            f"{plural(strokes.count, 'stroke')} in one direction of motion, so that friction cannot be told from "
            "the "
            "spring; load and unload, at least once",
        )
    return Check("loading and unloading", True, f"{plural(strokes.count, 'stroke')} between turning points")


def _check_hysteresis(strokes: Strokes) -> Check:
    """Check that the torque is larger on the way up: the loop takes energy."""
    columns = np.stack([strokes.angle, strokes.sign, np.ones_like(strokes.sign)], axis=1)
    (_, friction, _), squares, *_ = np.linalg.lstsq(columns, strokes.torque, rcond=None)
    spread = float(np.sqrt(squares[0] / len(strokes.sign))) if len(squares) else 0.0
    span = float(np.ptp(strokes.torque))
    # beyond four of its standard errors, and a thousandth of the range
    if friction < -max(4.0 * spread / np.sqrt(len(strokes.sign)), 1e-3 * span):
        return Check(
            "hysteresis",
            False,
            f"the torque is smaller by {-2.0 * friction:.3g} N m while the angle grows: the loop gives energy; "
            "are torque "
            "and angle swapped, is the order of the rows reversed, or does the torque's reading lag behind?",
        )
    return Check("hysteresis", True, f"the loop is {max(2.0 * friction, 0.0):.3g} N m wide")


def _check_ends(runs: Sequence[StrokeRun], resolution: Resolution) -> Check:
    """Check that neither column stands still at its end while the other one goes on."""
    # both columns at both ends, seen from above: with a sign of -1 the least value is the largest
    for run in runs:
        pairs = (("angle_rad", run.angle, run.torque), ("torque_Nm", run.torque, run.angle))
        for name, values, others in pairs:
            margin = 1.5 * resolution.step + 3.0 * resolution.noise if name == "angle_rad" else 0.0
            values, others = values[run.kept], others[run.kept]
            for end, word in ((np.max(values), "largest"), (np.min(values), "smallest")):
                sign = 1.0 if word == "largest" else -1.0
                if held := _held_share(sign * values, sign * others, sign * float(end), margin):
                    what = "a stop, or the end of the sensor" if name == "angle_rad" else "the end of the sensor"
                    return Check(
                        "saturation",
                        False,
                        f"{name} of {run.label} stands still at its {word} value, {end:.4g}, while the other "
                        "column goes on "
                        f"over {100 * held:.0f} % of its range: {what}? leave out what is beyond",
                    )
    return Check("saturation", True, "neither column stands still while the other goes on")


def _held_share(values: Floats, others: Floats, end: float, margin: float) -> float:
    """Share of its range over which the other column (n,) rises while this one is at its upper end, within a
    margin; 0 where it is little. Only before the other column's own turning point, since behind it friction holds
    the shaft."""
    at_end = values >= end - margin
    if resolution_of(others).noise > NOISY * float(np.ptp(others)):
        others = smoothed_torque(
            others, len(others) // SHORTEST_HOLD
        )  # the largest of many noisy readings is no rise
    largest_rise, span = 0.0, float(np.ptp(others))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], at_end.astype(np.int8), [0]])))
    for first, behind in edges.reshape(-1, 2):
        held = others[first:behind]
        largest_rise = max(largest_rise, float(np.max(held) - held[0]) / span)
    # within its last counts a spring bends on: that much of the other column's range belongs to it
    expected = margin / max(float(np.ptp(values)), 1e-300)
    return largest_rise if largest_rise > HELD + 2.0 * expected else 0.0


def _check_against_file(strokes: Strokes, known: float) -> Check:
    """Check that the stiffness is within a factor of 20 of the file's [N m/rad]."""
    slope = float(np.polyfit(strokes.angle, strokes.torque, 1)[0])
    times = slope / known
    if 1.0 / UNLIKELY < times < UNLIKELY:
        return Check(
            "stiffness in the file", True, f"measured is about {times:.3g} times the file's {known:.4g} N m/rad"
        )
    unit = next((text for factor, text in UNITS.items() if 0.6 < times / factor < 1.7), "")
    hint = f"; is it {unit}?" if unit else "."
    return Check(
        "stiffness in the file",
        False,
        f"measured is about {slope:.3g} N m/rad, {times:.3g} times the file's {known:.4g}{hint} If the record is "
        "right, "
        "remove stiffness_Nm_per_rad from the file first",
    )


def _check_sides(strokes: Strokes) -> tuple[Check, bool]:
    """Check whether the spring was bent both ways, a warning where not; and whether it was."""
    high, low = float(np.max(strokes.torque)), float(np.min(strokes.torque))
    lesser = min(max(high, 0.0), max(-low, 0.0)) / (high - low)
    if lesser < ONE_SIDED:
        return Check(
            "directions",
            False,
            f"the torque runs from {low:.3g} to {high:.3g} N m, one way only; the other way is not identified",
            warning=True,
        ), False
    return Check("directions", True, f"the torque runs from {low:.3g} to {high:.3g} N m"), True
