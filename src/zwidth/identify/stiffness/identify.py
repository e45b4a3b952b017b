"""Stiffness of a drive's transmission from torque over angle, loaded and unloaded both ways.

The link is blocked, the motor pulls at its transmission, slowly, up and down; or the motor is blocked and the link
is loaded. The thesis measures its Table 3.3 so (section 3.1.3, Fig. 3.5).

`drive_named` finds the drive of a mechanism that was measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, Final, Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.address import members, written
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, dotted, fail, plural, quote, suggestion
from zwidth.identify.identification import Estimate, Identification, refused
from zwidth.identify.records.record import Columns, Record, averaged_rows
from zwidth.identify.stiffness.checks import StrokeRun, check_runs
from zwidth.identify.stiffness.spring_fit import (
    Resolution,
    SpringFit,
    Strokes,
    fit_spring,
    joined_strokes,
    strokes_of,
)
from zwidth.progress import Progress

COLUMNS: Final = Columns(("torque_Nm", "angle_rad"), text=("joint",))
FIT_SHARE: Final = 2.0 / 3.0  # of the strokes, from the first on; the others are predicted
DIGITS: Final = 4


def identify_stiffness(
    device: Device,
    records: Sequence[Record],
    *,
    joint: str | None = None,
    side: Literal["motor", "link"] = "motor",
    progress: Progress | None = None,
) -> Identification:
    """The stiffness of drives, at the motor's shaft, with hysteresis, backlash and hardening where they are seen.

    records  torque and angle in the order in which they were measured, each record a run; a column joint says of
             which drive each row is
    joint    name of the drive or of its link, where the records do not say; None: the only drive
    side     where torque and angle were measured: "motor", at the motor's shaft, the link blocked; "link", at the
             link's joint, the motor blocked
    Raises   DeviceError  for records without the columns, and drives that the device does not have
    """
    parts = [
        _identify_drive(device, drive, runs, side, prefix=f"{drive.name}: " if len(drives) > 1 else "")
        for drives in [_runs_by_drive(device, records, joint)]
        for drive, runs in drives
    ]
    return parts[0] if len(parts) == 1 else _joined_drives(parts)


def _runs_by_drive(
    device: Device, records: Sequence[Record], joint: str | None
) -> list[tuple[Drive, list[StrokeRun]]]:
    """The runs of each drive, in the order in which the drives appear.

    joint  of all rows, where no column says it; None: of the only drive
    Raises DeviceError  for a joint that is none, or is given beside a column of it, and for records without rows
    """
    runs: dict[str, tuple[Drive, list[StrokeRun]]] = {}
    for record in records:
        rows = averaged_rows(record)
        torque, angle = rows.columns["torque_Nm"], rows.columns["angle_rad"]
        if "joint" not in record:
            names = [joint]
        elif joint is not None:
            raise fail(
                record.label, "joint", "is a column of the record; leave out the joint that is named beside it"
            )
        else:
            names = list(dict.fromkeys(rows.columns["joint"].tolist()))
        for name in names:
            drive = drive_named(device, name)
            of_drive = slice(None) if "joint" not in record else rows.columns["joint"] == name
            label = record.label if len(names) == 1 else f"{record.label}, joint {name}"
            run = StrokeRun(label, torque[of_drive], angle[of_drive], rows.together, rows.left_out)
            runs.setdefault(drive.path, (drive, []))[1].append(run)
    if not runs:
        raise records[0].fault("has no rows; record torque and angle")
    return list(runs.values())


@dataclass(frozen=True)
class _Scale:
    """From what was measured to the motor's shaft: torques and angles are multiplied by these."""

    torque: float
    angle: float


def _identify_drive(device: Device, drive: Drive, runs: list[StrokeRun], side: str, prefix: str) -> Identification:
    """Check the runs of one drive, fit its spring, and predict what was not fitted. Raises DeviceError for runs at
    the link without a transmission ratio.

    side    "motor" or "link", where the runs were measured;   prefix  of all names where there are several drives
    """
    scale = _Scale(1.0, 1.0)
    if side == "link":
        ratio = drive.table.get("transmission_ratio")
        if ratio is None:
            key = f"{drive.path}.transmission_ratio"
            raise fail(
                device.label, key, "is missing: it turns a stiffness at the link into one at the motor's shaft"
            )
        scale = _Scale(1.0 / ratio, ratio)
        runs = [replace(run, torque=run.torque * scale.torque, angle=run.angle * scale.angle) for run in runs]
    counts = drive.table.get("encoder_counts_per_rev") if side == "motor" else None
    known_step = 2.0 * pi / counts if counts else 0.0
    checks, resolution, both_sides = check_runs(runs, known_step, drive.table.get("stiffness_Nm_per_rad"))
    checks = [replace(check, what=prefix + check.what) for check in checks]
    none = refused("stiffness", f"{device.name}, {drive.name}", checks)
    if none is not None:
        return none
    strokes = _strokes_of_runs(runs, resolution)
    fitted, unseen = _split(strokes)
    fit = fit_spring(fitted, resolution, both_sides)
    explained = _share_explained(fit, unseen)
    return Identification(
        "stiffness",
        f"{device.name}, {drive.name}",
        tuple(checks),
        tuple(replace(one, name=prefix + one.name) for one in _estimates(fit, fitted, drive, side)),
        explained,
        f"the angle in {_amount(unseen)} that were not fitted, predicted from their torque",
        tuple(prefix + remark for remark in _remarks(fit, fitted, both_sides)),
        _curves(drive, fit, strokes, unseen),
    )


def _strokes_of_runs(runs: Sequence[StrokeRun], resolution: Resolution) -> Strokes:
    """The strokes of all runs, numbered one behind the other."""
    parts, first = list[Strokes](), 0
    for number, run in enumerate(runs):
        parts.append(strokes_of(run.torque[run.kept], run.angle[run.kept], resolution, number, first))
        first += parts[-1].count
    return joined_strokes(parts)


def _split(strokes: Strokes) -> tuple[Strokes, Strokes]:
    """The part that is fitted and the part that is predicted: the last strokes, of few strokes every third bin."""
    _, stroke = np.unique(strokes.stroke, return_inverse=True)  # index of each bin's stroke
    count = int(stroke.max()) + 1
    if count < 6:
        unseen = np.arange(len(stroke)) % 3 == 2
    else:
        # of every run the last strokes
        unseen = np.zeros(len(stroke), dtype=bool)
        for run in np.unique(strokes.run):
            of_run = strokes.run == run
            low, high = stroke[of_run].min(), stroke[of_run].max() + 1
            unseen |= of_run & (stroke >= low + max(round(FIT_SHARE * (high - low)), 1))
    return strokes.select(~unseen), strokes.select(unseen)


def _share_explained(fit: SpringFit, unseen: Strokes) -> float:
    """1 - variance of what is not predicted / variance of the bend, over the unseen part."""
    bend = fit.bend(unseen)
    missed = bend - fit.bend_under(unseen)
    return float(1.0 - np.mean(missed**2) / np.var(bend))


def _estimates(fit: SpringFit, strokes: Strokes, drive: Drive, side: str) -> Iterator[Estimate]:
    """The numbers of the spring; forward is where the motor leads the joint, as in the device file."""
    bend = fit.bend(strokes)
    yield from _stiffness_estimates(fit, bend, drive)
    if "hardening" in fit.names:
        path = f"{drive.path}.hardening_Nm_per_rad3"
        yield _estimate_with_interval(fit, "hardening", fit["hardening"], {"hardening": 1.0}, "N m/rad^3", path)
    if fit["preload"] > 0.0:
        yield _estimate_with_interval(
            fit, "preload", fit["preload"], {"preload": 1.0}, "N m", f"{drive.path}.preload_Nm"
        )
    if "play" in fit.names:
        yield _estimate_with_interval(fit, "backlash", fit["play"], {"play": 1.0}, "rad")
    friction = _estimate_with_interval(fit, "dry friction", fit["friction"], {"friction": 1.0}, "N m")
    path = f"{drive.path}.coulomb_Nm" if side == "motor" and friction.low > 0.0 else ""
    yield replace(friction, low=max(friction.low, 0.0), value=max(friction.value, 0.0), path=path)
    if "load" in fit.names:
        yield _estimate_with_interval(fit, "friction per torque", fit["load"], {"load": 1.0}, "1")
    if "reversal" in fit.names:
        yield _estimate_with_interval(
            fit, "way over which friction turns", fit["reversal"], {"reversal": 1.0}, "rad"
        )
    # a cycle goes over the bend's range twice, against dry friction and that which grows with the torque
    way = 2.0 * float(np.ptp(bend))
    loaded = way * float(np.mean(np.abs(fit.elastic(np.linspace(np.min(bend), np.max(bend), 1001)))))
    lost = way * fit["friction"] + loaded * fit["load"]
    loss = _estimate_with_interval(fit, "hysteresis loss per cycle", lost, {"friction": way, "load": loaded}, "J")
    yield replace(loss, low=max(loss.low, 0.0), value=max(loss.value, 0.0))


def _estimate_with_interval(
    fit: SpringFit, name: str, value: float, gradient: dict[str, float], unit: str, path: str = ""
) -> Estimate:
    """Give a number its interval.

    gradient  of the number by the fit's parameters
    path      in the device file; "" where the file has no key for it
    """
    half_width = fit.half_width(gradient)
    return Estimate(name, value, value - half_width, value + half_width, unit, path)


def _stiffness_estimates(fit: SpringFit, bend: Floats, drive: Drive) -> Iterator[Estimate]:
    """Give the stiffness of both ways, each or one for both where they hardly differ, with its largest and average
    value; or that of the one way that was bent [N m/rad].

    bend  (n,) of the spring [rad]
    """
    forward, k3, path = fit["forward"], fit["hardening"], f"{drive.path}.stiffness_Nm_per_rad"
    if "backward" in fit.names:
        backward = fit["backward"]
        uneven = abs(forward - backward) > fit.half_width({"forward": 1.0, "backward": -1.0})
        uneven = uneven or "backward_stiffness_Nm_per_rad" in drive.table or "preload" in fit.names
        halves = {"forward": 0.5, "backward": 0.5}
        unit = "N m/rad"
        if uneven:
            yield _estimate_with_interval(fit, "stiffness", forward, {"forward": 1.0}, unit, path)
            other = f"{drive.path}.backward_stiffness_Nm_per_rad"
            yield _estimate_with_interval(fit, "backward stiffness", backward, {"backward": 1.0}, unit, other)
        else:
            yield _estimate_with_interval(fit, "stiffness", 0.5 * (forward + backward), halves, unit, path)
        # at both ends of the bend: dT/dd = k + 3 k_3 d^2, and its derivative by k_3
        ends = {
            "forward": (forward + 3.0 * k3 * np.max(bend) ** 2, 3.0 * np.max(bend) ** 2),
            "backward": (backward + 3.0 * k3 * np.min(bend) ** 2, 3.0 * np.min(bend) ** 2),
        }
        stiffer = max(ends, key=lambda name: ends[name][0])
        gradient = {stiffer: 1.0, "hardening": float(ends[stiffer][1])}
        yield _estimate_with_interval(fit, "largest stiffness", float(ends[stiffer][0]), gradient, unit)
        yield _estimate_with_interval(fit, "average stiffness", 0.5 * (forward + backward), halves, unit)
    else:
        yield _estimate_with_interval(fit, "stiffness", forward, {"forward": 1.0}, "N m/rad", path)


def _remarks(fit: SpringFit, strokes: Strokes, both_sides: bool) -> Iterator[str]:
    """Sentences about what was seen beside the numbers."""
    if not both_sides:
        yield "the spring was bent one way only: the stiffness is that of this way, and says nothing of the other"
    if fit.outliers.any():
        places = plural(int(np.count_nonzero(fit.outliers)), "average", "averages")
        yield f"{places} of {len(strokes.angle)} far from all others left out"
    for name, unit, column in (("angle drift", "rad", strokes.angle), ("torque drift", "N m", strokes.torque)):
        if name in fit.names:
            share = 100.0 * abs(fit[name]) / float(np.ptp(column))
            yield (
                f"the {name.split()[0]} drifts by {fit[name]:.{DIGITS}g} {unit} over a record, {share:.2g} % of "
                "its range"
            )
    if fit["preload"] < 0.0:
        yield (
            f"the stiffness changes where the torque reads {-fit['preload']:.{DIGITS}g} N m: the sensor's zero is "
            "off by as much, or the drive is pulled one way while it rests; it is taken out"
        )
    if "load" in fit.names:
        yield (
            f"friction grows with the torque, by {fit['load']:.3g} of it, as of a rope on a pulley: dry friction "
            "is what remains without torque, and the device file has no key for the rest"
        )
    if "reversal" in fit.names:
        yield (
            f"behind a turn friction comes back over {fit['reversal']:.3g} rad: before dry friction slides, it "
            "bends"
        )
    if "hardening" in fit.names:
        yield f"the transmission {'stiffens' if fit['hardening'] > 0.0 else 'softens'} as it is bent"


def _curves(drive: Drive, fit: SpringFit, strokes: Strokes, unseen: Strokes) -> dict[str, Any]:
    """Averages of the strokes, and what the fit says of each: columns of equal length."""
    # stroke and time, below 1, name a bin
    held_out = np.isin(strokes.stroke * 1e6 + strokes.time, unseen.stroke * 1e6 + unseen.time)
    return {
        "drive": [drive.name] * len(strokes.angle),
        "angle_rad": strokes.angle,
        "torque_Nm": strokes.torque,
        "fitted_torque_Nm": fit.torque(strokes),
        "motion": strokes.sign,
        "fitted": np.where(held_out, 0.0, 1.0),
    }


def _amount(strokes: Strokes) -> str:
    """How many strokes there are, in words; of few strokes how many averages."""
    return plural(strokes.count, "stroke") if strokes.count > 2 else plural(len(strokes.angle), "average")


def _joined_drives(parts: Sequence[Identification]) -> Identification:
    """Several drives as one result."""
    shares = [part.validation for part in parts if part.estimates]
    curves = {
        name: [value for part in parts for value in part.curves.get(name, ())]
        for name in dict.fromkeys(name for part in parts for name in part.curves)
    }
    return Identification(
        "stiffness",
        comma_list([part.label for part in parts]),
        tuple(check for part in parts for check in part.checks),
        tuple(one for part in parts for one in part.estimates),
        min(shares, default=float("nan")),
        next((f"the least of the drives: {part.validated_on}" for part in parts if part.estimates), ""),
        tuple(remark for part in parts for remark in part.remarks),
        curves,
    )


@dataclass(frozen=True)
class Drive:
    """One drive as the device file has it.

    name   of the drive
    joint  link whose joint it drives
    path   of its table in the file
    table  its keys and values
    """

    name: str
    joint: str
    path: str
    table: Mapping[str, Any]


def drives_of(device: Device) -> list[Drive]:
    """The drives of a device in the order of the file, those of legs once each. Raises DeviceError for a device
    without a mechanism."""
    if device.mechanism is None:
        raise fail(device.label, "mechanism", "is missing: this is identified of a mechanism's drives")
    return [
        Drive(entry["name"], entry["joint"], dotted(("mechanism", *path), device.document), entry)
        for path, entry in written(device.document["mechanism"], "drives")
    ]


def drive_named(device: Device, name: str | None) -> Drive:
    """The drive of this name, or on the joint of this link; of a leg also as one of its copies (arm-1); or counted
    from 1 in the order of the file.

    name    None: the only one
    Raises  DeviceError  where there is none such, or several and none is named
    """
    drives = drives_of(device)
    listed = comma_list([drive.name for drive in drives])
    if not drives:
        raise fail(device.label, "mechanism.drives", "holds no drive")
    if name is None:
        if len(drives) > 1:
            raise fail(device.label, "joint", f"is not named, and the device has several drives: {listed}")
        return drives[0]
    for drive in drives:
        if name in (drive.name, drive.joint):
            return drive
    for copy in members(device.document["mechanism"], "drives"):
        if name in (copy.entry["name"], copy.entry["joint"]):
            path = dotted(("mechanism", *copy.path), device.document)
            return next(drive for drive in drives if drive.path == path)
    if name.isdigit() and 1 <= int(name) <= len(drives):
        return drives[int(name) - 1]
    known = {word for drive in drives for word in (drive.name, drive.joint)}
    raise fail(device.label, "joint", f"{quote(name)} is no drive or joint; {suggestion(name, known, 'drives')}")
