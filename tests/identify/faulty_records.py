"""Records that are not like simulations: what goes wrong on real benches.

The page docs/faulty-records.md shows what `zwidth identify` says to each, and a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tests.identify.changed_columns import Columns, changed, renamed, without
from tests.identify.record_benches import (
    DELAY,
    PERIOD,
    arm,
    driven,
    edge,
    felt,
    shaken,
    strokes,
    swept,
    three_masses,
)
from zwidth.show import csv_text


@dataclass(frozen=True)
class FaultyRecord:
    """A record with something wrong, and where `zwidth identify` speaks of it.

    wrong    with the record, in words
    kind     of measurement
    runs     columns of each file, or its text
    where    "fault" on standard error; "remark"; name of a check that did not pass; or of a number
    words    that are said there
    code     exit code: 0 a number is given all the same, 1 refused, 2 bad input
    options  of the command
    truth    name of a number -> true value, which its interval holds
    """

    wrong: str
    kind: str
    runs: Callable[[], tuple[Columns | str, ...]]
    where: str
    words: str
    code: int = 1
    options: tuple[str, ...] = ()
    truth: Mapping[str, float] | None = None


def _times(factor):
    return lambda values: factor * np.asarray(values)


def _clipped(limit):
    return lambda values: np.clip(values, -limit, limit)


def _turned_half_way(values):
    return np.where(np.arange(len(values)) > len(values) // 2, -values, values)


def _drifting(columns, name, rate):
    return columns | {name: columns[name] + rate * columns["time_s"]}


def _still_for_a_while(values):
    return np.where((np.arange(len(values)) > 2000) & (np.arange(len(values)) < 2200), values[2000], values)


def _uneven(time):
    return time + 0.4e-3 * np.sin(np.arange(len(time)) ** 2)


def _rows(columns, count):
    return {name: values[:count] for name, values in columns.items()}


def _measured_beside_commanded():
    """The amplifier gives four fifths of the command, two samples late; both are recorded."""
    force = driven()["force_N"]
    return driven() | {"force_command_N": np.append(force[2:], [0.0, 0.0]) / 0.8}


def _million():
    """A million lines: strokes so slow that each reading is there 250 times."""
    header, *lines = csv_text(strokes(count=4000)).splitlines(keepends=True)
    return header + "".join(line * 250 for line in lines)


def _offset_drifting():
    """The amplifier's offset grows by half of the dry friction while it warms up; the command lacks it."""
    warm = driven()["time_s"] / driven()["time_s"][-1]
    return driven() | {"force_N": driven()["force_N"] - 0.3 * (1.0 - np.exp(-2.0 * warm))}


def _friction_by_load():
    """A tenth of the first joint's torque is lost in its bearings, whichever way it turns."""
    columns = arm()[1]
    torque, rate = columns["torque_Nm.link-1"], np.gradient(columns["angle_rad.link-1"], columns["time_s"])
    lost = np.sign(np.convolve(rate, np.full(25, 0.04), mode="same")) * np.abs(torque)
    return columns | {"torque_Nm.link-1": torque + 0.1 * lost}


UNIT_MASS = ("--set", "plant.mass_kg=0.1")  # the file's mass; that of the bench is 0.12
GAPS = "a gap of missing samples"
DRIFT = "the readings drift"
FLIP = "a sign flips between runs"
FADED = "coherence collapses above the resonance"
SATURATED = "a saturated stretch"

RECORDS: tuple[FaultyRecord, ...] = (
    # not like simulations
    FaultyRecord(
        DRIFT,
        "stiffness",
        lambda: (strokes() | {"angle_rad": strokes()["angle_rad"] + np.linspace(0.0, 0.02, 6000)},),
        "remark",
        "drifts by",
        0,
        truth={"mechanism.drives.motor-right.stiffness_Nm_per_rad": 0.45},
    ),
    FaultyRecord(
        DRIFT,
        "friction",
        lambda: (_drifting(driven(), "position_m", 0.05),),
        "model",
        "do not follow the rest",
        0,
        UNIT_MASS,
        {"plant.mass_kg": 0.12},
    ),
    FaultyRecord(
        "the amplifier's offset drifts",
        "friction",
        lambda: (_offset_drifting(),),
        "drift",
        "the bias drifts by about",
        0,
        UNIT_MASS,
        {"plant.mass_kg": 0.12, "friction.coulomb_N": 0.5},
    ),
    FaultyRecord(
        "the torque sensor's zero is off by 4 mN m",
        "stiffness",
        lambda: (strokes() | {"torque_Nm": strokes()["torque_Nm"] + 0.004},),
        "remark",
        "the sensor's zero is off",
        0,
    ),
    FaultyRecord(
        "friction that grows with the torque",
        "arm",
        lambda: (_friction_by_load(),),
        "remainder",
        "friction that grows with the torque",
        0,
    ),
    FaultyRecord(
        FLIP,
        "stiffness",
        lambda: (strokes(), changed(strokes(2), torque_Nm=_times(-1.0))),
        "sign",
        "and grows in the other records",
    ),
    FaultyRecord(
        FLIP,
        "response",
        lambda: (shaken(), changed(shaken(1), force_N=_times(-1.0))),
        "runs agree",
        "turned between",
    ),
    FaultyRecord(
        FLIP, "modes", lambda: (shaken(), changed(shaken(1), force_N=_times(-1.0))), "runs agree", "turned between"
    ),
    FaultyRecord(
        FLIP,
        "arm",
        lambda: (arm()[1], changed(arm()[1], **{"torque_Nm.link-1": _times(-1.0)})),
        "signs",
        "runs against what the other records predict",
    ),
    FaultyRecord(
        "a sign flips in the middle of a run",
        "response",
        lambda: (changed(shaken(), force_N=_turned_half_way),),
        "validation",
        "has a sign flipped",
    ),
    FaultyRecord(
        "a sign flips in the middle of a run",
        "impedance",
        lambda: (changed(felt(), handle_force_N=_turned_half_way),),
        "coherence",
        "has a sign flipped",
    ),
    FaultyRecord(
        "a sign flips in the middle of a run",
        "arm",
        lambda: (changed(arm()[1], **{"torque_Nm.link-1": _turned_half_way}),),
        "validation",
        "of the unseen torque are explained only",
    ),
    FaultyRecord(
        FADED,
        "modes",
        lambda: (shaken(noise=2e-5, count=2048),),
        "coherence",
        "it has collapsed",
        0,
        ("--fit", "modes"),
        {"natural frequency of mode 1": 80.4},
    ),
    FaultyRecord(
        FADED,
        "response",
        lambda: (shaken(noise=2e-5),),
        "validation",
        "of the unseen acceleration is predicted",
        0,
        (),
        {"largest stiffness": 14724.0},
    ),
    FaultyRecord(
        "several resonances",
        "modes",
        lambda: (three_masses(),),
        "natural frequency of mode 2",
        "Hz",
        0,
        ("--fit", "modes"),
    ),
    FaultyRecord(
        "the force is a command, and less comes",
        "friction",
        lambda: (renamed(changed(driven(), force_N=_times(1.25)), force_N="force_command_N"),),
        "remark",
        "gain and offset are in all numbers",
        0,
        UNIT_MASS,
        {"plant.mass_kg": 0.15},
    ),
    FaultyRecord(
        "commanded and measured force, gain 0.8, 2 samples late",
        "friction",
        lambda: (_measured_beside_commanded(),),
        "remark",
        "0.8006 times force_command_N, 2 ms later",
        0,
        UNIT_MASS,
        {"plant.mass_kg": 0.12},
    ),
    FaultyRecord(
        "the measured force in place of the commanded one",
        "response",
        lambda: (changed(shaken(), force_N=lambda f: 0.8 * np.append([0.0, 0.0], f[:-2])),),
        "chart",
        "come too late",
    ),
    FaultyRecord(
        "torques recorded 3 samples before they act",
        "arm",
        lambda: (_early_torques(),),
        "timing",
        "after their time stamps",
        0,
    ),
    FaultyRecord(
        GAPS, "impedance", lambda: (without(felt(), 1000, 1100),), "sampling", "100 samples missing in 1 gap", 0
    ),
    FaultyRecord(
        GAPS,
        "response",
        lambda: (without(shaken(), 700, 760),),
        "gaps",
        "longest stretch without a gap",
        0,
        (),
        {"largest stiffness": 14724.0},
    ),
    FaultyRecord(
        SATURATED,
        "stiffness",
        lambda: (changed(strokes(), torque_Nm=_clipped(0.03)),),
        "saturation",
        "stands still",
    ),
    FaultyRecord(
        SATURATED, "response", lambda: (changed(shaken(), force_N=_clipped(0.7)),), "saturation", "clipped?"
    ),
    FaultyRecord(
        SATURATED,
        "modes",
        lambda: (changed(shaken(count=1024), force_N=_clipped(0.7)),),
        "validation",
        "another force acted",
        1,
        ("--fit", "modes"),
    ),
    FaultyRecord(
        SATURATED,
        "impedance",
        lambda: (changed(felt(), handle_force_N=_clipped(2.0)),),
        "force",
        "as if it were limited",
    ),
    FaultyRecord(
        SATURATED,
        "arm",
        lambda: (changed(arm()[1], **{"torque_Nm.link-1": _clipped(0.02)}),),
        "torque",
        "stands at the largest torque",
        0,
    ),
    FaultyRecord(
        "a reading stands still for a while",
        "modes",
        lambda: (changed(shaken(), position_m=_still_for_a_while),),
        "coherence",
        "stood still",
    ),
    # bad input
    FaultyRecord("too short", "modes", lambda: (_rows(shaken(), 150),), "duration", "record longer"),
    FaultyRecord("too short", "arm", lambda: (_rows(arm()[1], 150),), "length", "record longer"),
    FaultyRecord("two lines", "friction", lambda: (_rows(driven(), 1),), "sampling", "at least 100 are needed"),
    FaultyRecord(
        "a header alone", "stiffness", lambda: ("torque_Nm,angle_rad\n",), "length", "at least 8 are needed"
    ),
    FaultyRecord(
        "a million lines",
        "stiffness",
        lambda: (_million(),),
        "length",
        "1000000 readings",
        0,
        truth={"mechanism.drives.motor-right.stiffness_Nm_per_rad": 0.45},
    ),
    FaultyRecord(
        "no excitation",
        "modes",
        lambda: (changed(shaken(), force_N=_times(0.0)),),
        "excitation",
        "excite the device",
    ),
    FaultyRecord(
        "a constant column", "mass", lambda: (changed(driven(), position_m=_times(0.0)),), "motion", "is constant"
    ),
    FaultyRecord(
        "swapped columns",
        "stiffness",
        lambda: (renamed(strokes(), torque_Nm="angle_rad", angle_rad="torque_Nm"),),
        "hysteresis",
        "swapped",
    ),
    FaultyRecord(
        "swapped columns",
        "response",
        lambda: (renamed(shaken(), force_N="position_m", position_m="force_N"),),
        "causality",
        "swapped?",
    ),
    FaultyRecord(
        "swapped columns",
        "impedance",
        lambda: (renamed(felt(), handle_force_N="handle_position_m", handle_position_m="handle_force_N"),),
        "columns",
        "swapped",
    ),
    FaultyRecord(
        "swapped columns",
        "boundary",
        lambda: (renamed(edge(), stiffness_N_per_m="damping_Ns_per_m", damping_Ns_per_m="stiffness_N_per_m"),),
        "columns",
        "swapped",
    ),
    FaultyRecord(
        "units in brackets behind the names",
        "friction",
        lambda: (renamed(driven(), time_s="Time [s]", position_m="Position [mm]"),),
        "fault",
        "name it time_s",
        2,
    ),
    FaultyRecord(
        "a column named in degrees",
        "stiffness",
        lambda: (renamed(strokes(), angle_rad="angle_deg"),),
        "fault",
        "multiply by pi/180",
        2,
    ),
    FaultyRecord(
        "degrees in angle_rad",
        "stiffness",
        lambda: (changed(strokes(amplitude=0.009), angle_rad=np.degrees),),
        "stiffness in the file",
        "is it degrees",
    ),
    FaultyRecord(
        "degrees in angle_rad",
        "arm",
        lambda: (changed(arm()[1], **{"angle_rad.link-1": np.degrees}),),
        "motion",
        "in degrees",
    ),
    FaultyRecord(
        "millimetres in position_m",
        "mass",
        lambda: (changed(driven(), position_m=_times(10.0), force_N=_times(0.01)),),
        "mass in the file",
        "in millimetres",
        1,
        UNIT_MASS,
    ),
    FaultyRecord(
        "millimetres in position_m",
        "response",
        lambda: (changed(shaken(), position_m=_times(1e3)),),
        "units",
        "in millimetres",
    ),
    FaultyRecord(
        "mN m in torque_Nm",
        "arm",
        lambda: (changed(arm()[1], **dict.fromkeys(("torque_Nm.link-1", "torque_Nm.link-2"), _times(1e3))),),
        "mass in the file",
        "in millinewton metres",
    ),
    FaultyRecord(
        "milliseconds in time_s",
        "friction",
        lambda: (changed(driven(), time_s=_times(1e3)),),
        "sampling period",
        "in milliseconds",
    ),
    FaultyRecord(
        "milliseconds in time_s",
        "modes",
        lambda: (changed(shaken(), time_s=_times(1e3)),),
        "sampling",
        "in milliseconds",
    ),
    FaultyRecord(
        "N/mm in stiffness_N_per_m",
        "boundary",
        lambda: (changed(edge(), stiffness_N_per_m=_times(1e-3)),),
        "units",
        "N/mm",
    ),
    FaultyRecord(
        "unsorted time",
        "modes",
        lambda: (changed(shaken(), time_s=lambda t: np.roll(t, 100)),),
        "sampling",
        "sort the rows",
    ),
    FaultyRecord(
        "irregular time", "impedance", lambda: (changed(felt(), time_s=_uneven),), "sampling", "do not follow"
    ),
    FaultyRecord(
        "missing values",
        "boundary",
        lambda: (changed(edge(), stiffness_N_per_m=lambda k: [np.nan, *k[1:]]),),
        "rows",
        "left out: line 2",
        0,
        (),
        {DELAY: 0.4},
    ),
    FaultyRecord(
        "another sampling rate than the file's",
        "response",
        lambda: (changed(shaken(), time_s=_times(0.8)),),
        "sampling",
        "correct loop.sampling_period_s",
    ),
    FaultyRecord(
        "another sampling rate than the file's",
        "mass",
        lambda: (changed(driven(), time_s=_times(1.25)),),
        "sampling period",
        "if another recorder wrote it",
        0,
        UNIT_MASS,
    ),
    FaultyRecord(
        "another sampling rate than the file's",
        "boundary",
        lambda: (edge(0.8 * PERIOD),),
        "sampling period",
        "correct loop.sampling_period_s",
    ),
    FaultyRecord(
        "one sweep, in which each frequency is at one time only",
        "response",
        lambda: (swept(),),
        "validation",
        "record the sweep twice",
        0,
    ),
    FaultyRecord(
        "a boundary that no parameter explains",
        "boundary",
        lambda: (changed(edge(), damping_Ns_per_m=lambda b: np.array(b) + 20.0 * np.sin(np.arange(len(b)))),),
        "explained",
        "no value of the numbers that were named explains",
    ),
)


def _early_torques():
    """Torques that act 3 samples after they were written."""
    return {name: v[3:] if name.startswith("torque") else v[:-3] for name, v in arm()[1].items()}
