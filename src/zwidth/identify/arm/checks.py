"""Checks of a record of a mechanism's joints before its torques are fitted.

Which columns of a record belong to which drive, and the matrices from them to the coordinates of the model.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Final, Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, fail
from zwidth.identify.arm.smoothing import convolved
from zwidth.identify.identification import Check
from zwidth.identify.records.record import Columns, Piece, Record
from zwidth.model.mechanism import PRISMATIC, Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.raw_sweep import encoder_step

COUNTS: Final = 10.0  # encoder counts that every joint must move, at least
SLOPE: Final = 0.1  # by which a recorded velocity may differ from the derivative of the position
ALIKE: Final = 0.9  # correlation between them, at least
CLIPPED: Final = 0.04  # share of the samples at one extreme torque: a sine that is counted finely has less
OVER_LIMIT: Final = 0.01  # share of the samples beyond the drive's limit
RATIOS: Final = {  # recorded velocity over the derivative of the position -> what the velocity may be recorded in
    180.0 / np.pi: "in degrees",
    np.pi / 180.0: "in radians where degrees are meant",
    1000.0: "in thousandths",
    0.001: "in thousands",
    1.0 / (2.0 * np.pi): "in revolutions",
    30.0 / np.pi: "in revolutions per minute",
    -1.0: "with the other sign",
}
BETTER: Final = 0.3  # share of the unexplained torque, below which another reading of the columns explains it


@dataclass(frozen=True)
class MotionSurvey:
    """The longest stretch without a gap among the first rows of a record, which the checks look at.

    rows          the columns of the stretch, n samples
    coordinates, forces  (n, d)  of the drives, as `DriveChannels` makes them of the columns
    """

    rows: Piece
    coordinates: Floats
    forces: Floats


def motion_check(
    drives: Sequence[str], surveys: Sequence[MotionSurvey], encoder_steps: Floats, turning: Floats
) -> Check:
    """Check that every joint moves by more than ten counts, and by no more than four turns.

    encoder_steps  (d,) of one count, at the joint [rad], [m]; nan where not known: the step that the readings show
    turning        (d,) 1 where a coordinate is an angle, 0 where it is a way
    Returns        a warning where some joints move too little; refused where all do, or angles seem no radians
    """
    spans = np.max([np.ptp(survey.coordinates, axis=0) for survey in surveys], axis=0)
    steps = np.max([_encoder_steps(survey.coordinates) for survey in surveys], axis=0)
    steps = np.where(np.isfinite(encoder_steps), encoder_steps, steps)
    still = [k for k in range(len(drives)) if not spans[k] > COUNTS * steps[k] or spans[k] == 0.0]
    far = [k for k in range(len(drives)) if turning[k] and spans[k] > 8.0 * np.pi]
    if far:
        named = comma_list([f"{drives[k]} by {spans[k]:.3g} rad" for k in far])
        return Check("motion", False, f"{named}, which is several turns: are these angles in degrees or counts?")
    if still:
        counted = [f" ({spans[k] / steps[k]:.3g} counts)" if steps[k] else "" for k in range(len(drives))]
        named = comma_list([f"{drives[k]} by {spans[k]:.3g}{counted[k]}" for k in still])
        reason = f"too little motion: {named}; move every joint by more than {COUNTS:g} counts"
        return Check("motion", False, reason, warning=len(still) < len(drives))
    least = comma_list([f"{name} by {span:.3g}" for name, span in zip(drives, spans, strict=True)])
    shown = steps > 0.0
    worst = f", {np.min(spans[shown] / steps[shown]):.3g} counts at least" if shown.any() else ""
    return Check("motion", True, f"{least} (rad or m){worst}")


def _encoder_steps(values: Floats) -> list[float]:
    """The steps (d,) of the encoders, as the readings (n, d) show them; 0 where they show none."""
    return [encoder_step([column]) for column in values.T]


def torque_check(drives: Sequence[str], surveys: Sequence[MotionSurvey], limits: Floats) -> Check:
    """Check that torques vary, stay within the drives' limits (d,) at the joint but for 1 % of samples, and are
    not cut: refused for the first two, a warning for the last.
    """
    constant, cut, beyond = list[str](), list[str](), list[str]()
    for k, name in enumerate(drives):
        forces = np.concatenate([one.forces[:, k] for one in surveys])
        most = float(np.max(np.abs(forces)))
        if np.ptp(forces) == 0.0:
            constant.append(name)
            continue
        clipped = _clipped_share(forces)
        # 1.001, and 0.9999 below: a record and the limit are rounded
        if np.mean(np.abs(forces) > 1.001 * limits[k]) > OVER_LIMIT:
            beyond.append(f"{name} (to {most:.3g} of {limits[k]:.3g})")
        elif clipped > CLIPPED or np.mean(np.abs(forces) > 0.9999 * limits[k]) > OVER_LIMIT:
            cut.append(
                f"{name} ({100.0 * max(clipped, float(np.mean(np.abs(forces) > 0.9999 * limits[k]))):.2g} %)"
            )
    if constant:
        return Check("torque", False, f"the torque of {comma_list(constant)} is constant; record what acts")
    if beyond:
        reason = f"torques beyond the drives' limits in the device file: {comma_list(beyond)}"
        return Check(
            "torque", False, f"{reason}; record what acts, not what is commanded, or correct torque_limit_Nm"
        )
    if cut:
        reason = f"a part of the samples stands at the largest torque: {comma_list(cut)}"
        return Check("torque", False, f"{reason}; where a sensor is saturated, move less violently", warning=True)
    return Check("torque", True, "varies, and is not cut")


def _clipped_share(forces: Floats) -> float:
    """Share of the samples (n,) that stand, five and more in a row, at the largest or the least value."""
    shares = list[float]()
    for extreme in (np.max(forces), np.min(forces)):
        at = np.concatenate([[0], (forces == extreme).astype(int), [0]])
        edges = np.flatnonzero(np.diff(at))  # where a row at the extreme begins, and ends, by turns
        lengths = edges[1::2] - edges[::2]
        shares.append(float(np.sum(lengths[lengths >= 5]) / len(forces)))
    return sum(shares)


def velocity_check(
    drives: Sequence[str], channels: DriveChannels, survey: MotionSurvey, rate_taps: Floats, taps: Floats
) -> Check | None:
    """Check that recorded velocities are the derivatives of the positions; None where no velocity is recorded,
    or where the stretch is no longer than the kernels.

    rate_taps, taps  (t,) kernels, `Kernel.taps`: one that smooths and differentiates, one that only smooths
    """
    recorded = [k for k, name in enumerate(channels.velocity) if name]
    if not recorded:
        return None
    positions = np.stack([survey.rows[name] for name in channels.coordinate], axis=1)
    if len(positions) <= len(taps):
        return None
    rates = convolved(positions, rate_taps)
    faults = list[str]()
    for k in recorded:
        velocity = convolved(survey.rows[channels.velocity[k]], taps)
        alike = [_correlation(velocity, rates[:, j]) for j in range(len(drives))]  # with each drive's rate
        best = int(np.argmax(np.abs(alike)))
        power = max(float(rates[:, k] @ rates[:, k]), 1e-300)
        slope = float(velocity @ rates[:, k]) / power
        # noise of the derivative draws this slope towards 0, of the velocity slope_by_velocity from it:
        # the true one lies between, so that both must be off
        slope_by_velocity = float(velocity @ velocity) / power / slope if slope else 0.0
        column = channels.velocity[k]
        if best != k and abs(alike[best]) > ALIKE and abs(alike[k]) < ALIKE:
            faults.append(
                f"{column} goes with the derivative of {channels.coordinate[best]} (correlation "
                f"{alike[best]:.2f}), and less with that of {channels.coordinate[k]} ({alike[k]:.2f}): are "
                "columns swapped?"
            )
        elif not abs(alike[k]) > ALIKE:
            faults.append(
                f"{column} does not follow the derivative of {channels.coordinate[k]} (correlation {alike[k]:.2f})"
            )
        elif min(slope, slope_by_velocity) > 1.0 + SLOPE or max(slope, slope_by_velocity) < 1.0 - SLOPE:
            both = np.array([slope, slope_by_velocity])
            known = [text for ratio, text in RATIOS.items() if np.all(np.abs(both / ratio - 1.0) < SLOPE)]
            cause = f"is it {known[0]}?" if known else "is it in another unit, or do rows repeat?"
            faults.append(f"{column} is {slope:.4g} times the derivative of {channels.coordinate[k]}: {cause}")
    if faults:
        return Check("velocity", False, f"{'; '.join(faults)}; correct the columns, or leave the velocities out")
    return Check("velocity", True, "recorded velocities are the derivatives of the positions, which are used")


def _correlation(one: Floats, other: Floats) -> float:
    """Correlation coefficient of two signals (n,); 0 where one of them is constant."""
    a, b = one - np.mean(one), other - np.mean(other)
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def other_readings(
    names: Sequence[str], columns: Sequence[Floats], torques: Sequence[Floats]
) -> tuple[str, float, float]:
    """Look for another reading of the columns, one torque with its sign turned or two torques swapped, with which
    the fit is far better.

    names    (d,) of the drives
    columns  (n, d, b) of each stretch, torque per unit of each base parameter;   torques  (n, d) as recorded
    Returns  the best such change in words, "" where none is far better; the share of the torques' squares that the
             fit leaves as recorded; and the least share that any change leaves, inf of a single drive
    """
    X = np.concatenate(list(columns))
    y = np.concatenate(list(torques))
    scale = np.std(y, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)

    def unexplained(read: Floats, weights: Floats) -> float:
        """Share of the squares of torques (n, d), each drive's over its weight, that least squares leave."""
        A, b = (X / weights[:, None]).reshape(-1, X.shape[2]), (read / weights).reshape(-1)
        size = np.linalg.norm(A, axis=0)
        A = A / np.where(size > 0.0, size, 1.0)  # columns of unit length, for the rank's tolerance
        left = b - A @ np.linalg.lstsq(A, b, rcond=1e-9)[0]
        return float(left @ left) / max(float(b @ b), 1e-300)

    as_recorded = unexplained(y, scale)
    tried = list[tuple[float, str]]()
    d = len(names)
    # of a single drive the other sign turns all parameters, and explains as much
    for k in range(d if d > 1 else 0):
        sign = np.ones(d)
        sign[k] = -1.0
        tried.append((unexplained(y * sign, scale), f"the torque of {names[k]} has the other sign"))
    for i, j in combinations(range(d), 2):
        order = np.arange(d)
        order[[i, j]] = j, i
        tried.append(
            (unexplained(y[:, order], scale[order]), f"the torques of {names[i]} and {names[j]} are swapped")
        )
    best, text = min(tried, default=(float("inf"), ""))
    return (text if best < BETTER * as_recorded else ""), as_recorded, best


def sign_check(
    names: Sequence[str], labels: Sequence[str], predicted: Sequence[Floats], measured: Sequence[Floats]
) -> Check | None:
    """Check that no drive's torque runs against its prediction in a record (correlation below -0.5); None where
    none does.

    names, labels  of the drives, and of the records;   predicted, measured  (n, d) torques of each record
    """
    faults = list[str]()
    for label, one, other in zip(labels, predicted, measured, strict=True):
        for k, name in enumerate(names):
            if len(one) and _correlation(one[:, k], other[:, k]) < -0.5:
                faults.append(f"the torque of {name} in {label}")
    if not faults:
        return None
    return Check(
        "signs",
        False,
        f"{comma_list(faults)} runs against what the other records predict: was a sign turned in between, or are "
        "they not of one device, load and gravity? The records do not tell",
    )


Side = Literal["joint", "motor"]

COLUMNS: Final = Columns(
    needed=("time_s", ("angle_rad.*", "position_m.*"), ("torque_Nm.*", "force_N.*")),
    optional=("velocity_rad_per_s.*", "velocity_m_per_s.*"),
)
TURNING: Final = ("angle_rad", "torque_Nm", "velocity_rad_per_s")
SLIDING: Final = ("position_m", "force_N", "velocity_m_per_s")


@dataclass(frozen=True)
class DriveChannels:
    """The columns of one record, drive by drive, d drives.

    coordinate, force  (d,) names of columns;   velocity  (d,) names, "" where there is none
    to_drive    (d, d)  matrix from the columns of coordinates to the drives' coordinates: 1, or 1 over the ratio
                        of motors, or the coupling of drives that turn with several joints
    to_force    (d, d)  matrix from the columns of forces to the generalised forces of the drives' coordinates
    """

    coordinate: tuple[str, ...]
    force: tuple[str, ...]
    velocity: tuple[str, ...]
    to_drive: Floats
    to_force: Floats

    def coordinates(self, piece: Piece) -> Floats:
        """The drives' coordinates (n, d) of a piece of the record [rad], [m]."""
        return np.stack([piece[name] for name in self.coordinate], axis=1) @ self.to_drive.T

    def forces(self, piece: Piece) -> Floats:
        """Generalised forces (n, d) of a piece of the record on the drives' coordinates [N m], [N]."""
        return np.stack([piece[name] for name in self.force], axis=1) @ self.to_force.T


def drive_channels_of(device: Device, record: Record, side: Side) -> DriveChannels:
    """The columns of a record of this device, each named by the link of its joint, or by its drive.

    side   "joint": coordinates of the links' joints, torques at the joints; "motor": the motors' angles and
           torques
    Raises DeviceError  for columns that are missing or given twice
    """
    mechanism = device.mechanism
    assert mechanism is not None
    drives, links, rows = mechanism.drives, mechanism.links, list[list[str]]()
    for name, joint in zip(drives.names, drives.joint, strict=True):
        slides = side == "joint" and links.joint[joint] == PRISMATIC
        words = (name, links.names[joint])
        rows.append(
            [
                _column(record, quantity, words, alone=len(drives.names) == 1, needed=k < 2)  # no velocity
                for k, quantity in enumerate(SLIDING if slides else TURNING)
            ]
        )
    coordinate, force, velocity = zip(*rows, strict=True)
    n = np.asarray(drives.transmission, dtype=np.float64)
    # from the motor to the joint the angle is divided by the ratio n, the torque multiplied
    to_drive, to_force = np.diag(1.0 / n), np.diag(n)
    if side == "joint":
        to_drive = pack(mechanism).to_drive[0]
        to_force = np.linalg.inv(to_drive).T  # the drives' power is that of the joints
    return DriveChannels(coordinate, force, velocity, to_drive, to_force)


def _column(record: Record, quantity: str, words: Sequence[str], *, alone: bool, needed: bool) -> str:
    """Name of the column of a drive's quantity, "torque_Nm.shoulder"; "" where there is none, and none is needed.

    words  name of the drive, and of its link: either may follow the quantity. Only letters and figures of names
           count, since MATLAB's have no others
    alone  the device has one drive, whose columns may be named by the quantity only
    Raises DeviceError  for a needed column that is missing, and for two of one quantity
    """
    wanted = {_letters_and_figures(f"{quantity}.{word}") for word in words} | ({quantity} if alone else set())
    present = [name for name in record.names if _letters_and_figures(name) in wanted]
    if len(present) > 1:
        raise record.fault(f"columns {' and '.join(present)} are of the same drive; keep one of them")
    if present or not needed:
        return present[0] if present else ""
    there = [name for name in record.names if name.startswith(quantity)]
    raise record.fault(
        f"column {quantity}.{words[1]} (or {quantity}.{words[0]}, by the drive's name) is missing"
        f"{f'; of this quantity there are {comma_list(there)}' if there else ''}"
    )


def _letters_and_figures(name: str) -> str:
    """A name with _ in place of all that is no letter or figure."""
    return re.sub(r"[^0-9a-zA-Z]", "_", name)


def check_mechanism(device: Device) -> Mechanism:
    """The mechanism of a device whose arm can be identified, its links rigid. Raises DeviceError without one, and
    for parts that the fit is not made for (`parts_left_out` are only warned of)."""
    from dataclasses import replace

    mechanism = device.mechanism
    if mechanism is None:
        text = "needs a [mechanism]: joint torques say nothing of a plant's matrices; use 'identify mass'"
        raise fail(device.label, "identify arm", text)
    present = {
        "more drives than degrees of freedom": bool(mechanism.drives.surplus),
        "joints that nobody drives or measures (free)": bool(mechanism.free),
        "rotors that turn with their links (motor_link)": mechanism.drives.motor_link is not None,
        "a transmission whose ratio changes (ratio_table)": mechanism.drives.ratio_tables is not None,
    }
    if named := [name for name, there in present.items() if there]:
        text = f"is not made for a mechanism with {' and '.join(named)}"
        raise fail(device.label, "identify arm", text)
    if mechanism.gravity_compensation == "counterweight":
        text = 'is not made for gravity_compensation = "counterweight": what balances the links moves with them'
        raise fail(device.label, "identify arm", text)
    return replace(mechanism, flexible=())


def parts_left_out(device: Device) -> list[str]:
    """Name the parts of the device's file that the inverse dynamics of the fit leave out, in words."""
    mechanism = device.mechanism
    assert mechanism is not None
    links, driven = mechanism.links, set(mechanism.drives.joint.tolist())
    undriven = [i for i in range(len(links.names)) if i not in driven]

    def any_of(numbers: Floats | None, some: Sequence[int]) -> bool:
        # numbers of the links on the last axis; none where the file gives none
        return numbers is not None and bool(np.any(np.asarray(numbers)[..., some]))

    parts: Mapping[str, Any] = {
        "springs of the joints": any_of(links.joint_stiffness, range(len(links.names))),
        "dampers of joints without a drive": any_of(links.joint_damping, undriven),
        "dry friction of joints without a drive": any_of(links.joint_coulomb, undriven),
        "the bending of links": bool(mechanism.flexible),
    }
    return [name for name, there in parts.items() if there]
