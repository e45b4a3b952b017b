"""What a record of one joint's motion must show before friction or mass is fitted to it."""

from __future__ import annotations

from math import inf, isfinite, isnan
from typing import Final

import numpy as np

from zwidth.device.faults import plural
from zwidth.identify.identification import Check
from zwidth.identify.joint.fit import Windows
from zwidth.identify.joint.force_balance import ForceBalance
from zwidth.identify.joint.joint import Joint
from zwidth.identify.joint.record import Motion

FEWEST_COUNTS: Final = 10.0  # steps of the encoder
FEWEST_WINDOWS: Final = 4  # with motion
ONE_WAY: Final = 0.03  # share of the travel that must go the other way
STUCK, MOSTLY_STUCK = 0.97, 0.6  # share of the windows in which nothing moves
SLIPS: Final = (("degrees", 180.0 / np.pi), ("a thousandth of the unit", 1000.0), ("a millionth of it", 1e6))
SLIP: Final = 0.1  # by which a ratio may miss that of two units
FAR: Final = 20.0  # times the drive's largest torque: no command, but another unit
LONGEST: Final = 5.0  # m, of a travel
MOST_TURNS: Final = 1000.0  # rad, of a motor's travel
FLAT: Final = 0.02  # share of a force's samples at its largest or smallest value
FEW_LEVELS: Final = 50  # values of a force that is meant to have flat tops, as square waves have


def checks_of(motion: Motion, windows: Windows, joint: Joint) -> list[Check]:
    """All checks of what was recorded, in an order in which each assumes those before it."""
    checks = [check_motion(motion, joint), check_units(motion, joint)]
    if not checks[0].passed:
        return checks
    if motion.force_name:
        checks.append(check_force(motion, joint))
    checks.append(check_amount(windows))
    if all(check.passed or check.warning for check in checks):
        checks.append(check_directions(windows, motion))
        checks.append(check_standstill(motion))
        checks += check_saturation(motion, joint)
    return checks


def check_motion(motion: Motion, joint: Joint) -> Check:
    """That the joint moves, by more than ten steps of its encoder."""
    travel, unit = float(np.ptp(motion.positions)), joint.unit("position")
    if travel == 0.0:
        return Check("motion", False, f"{joint.position} is constant; record the joint while it moves")
    counts = travel / motion.resolution if motion.resolution > 0.0 else inf
    seen = f"{joint.position} travels {travel:.4g} {unit}"
    what = f"steps of {motion.step:.4g} {unit}" if motion.step else f"times its noise of {motion.noise:.2g} {unit}"
    if counts < FEWEST_COUNTS:
        return Check(
            "motion",
            False,
            f"{seen}, only {counts:.3g} {what}; {FEWEST_COUNTS:.0f} are needed: move the joint farther",
        )
    return Check("motion", True, f"{seen}, {counts:.3g} {what}" if isfinite(counts) else seen)


def check_units(motion: Motion, joint: Joint) -> Check:
    """That travel, encoder steps and forces are of the size that the device's own numbers give."""
    travel, unit = float(np.ptp(motion.positions)), joint.unit("position")
    faults, seen = list[str](), list[str]()
    if motion.step and not isnan(joint.step):
        ratio = motion.step / joint.step
        slip = _slip(ratio, angular=joint.angular)
        said = (
            f"readings go in steps of {motion.step:.4g} {unit}, those of the file's encoder are {joint.step:.4g}"
        )
        if slip:
            faults.append(f"{said}: {joint.position} looks like {slip}; record it in {unit}")
        else:
            seen.append(said)
    room = joint.upper - joint.lower
    if isfinite(room) and travel > 3.0 * room:
        faults.append(
            f"{joint.position} travels {travel:.4g} {unit}, the file's limits leave {room:.4g}; is it in {unit}?"
        )
    if not joint.angular and travel > LONGEST:
        faults.append(f"position_m travels {travel:.4g} m; is it in millimetres, or swapped with the force?")
    if joint.angular and travel > MOST_TURNS:
        faults.append(f"angle_rad travels {travel:.4g} rad; is it in degrees, or in counts?")
    if motion.driven and isfinite(joint.limit):
        peak, force = float(np.max(np.abs(motion.forces))), joint.unit("force")
        said = f"{motion.force_name} reaches {peak:.4g} {force}, the drive's limit is {joint.limit:.4g}"
        if peak > FAR * joint.limit:
            faults.append(f"{said}: is it in m{force.replace(' ', '')}? multiply by 0.001")
        else:
            seen.append(said)
    if faults:
        return Check("units", False, "; ".join(faults))
    return Check("units", True, "; ".join(seen) or "the file has no numbers that readings could be compared with")


def _slip(ratio: float, *, angular: bool) -> str:
    """The unit that a ratio of two steps is that of; "" where it is none."""
    for name, factor in SLIPS:
        if (name == "degrees") <= angular and abs(ratio / factor - 1.0) < SLIP:
            return name
    return ""


def check_force(motion: Motion, joint: Joint) -> Check:
    """That the force changes: under a constant one only ratios of friction and mass can be told."""
    forces, unit = motion.forces, joint.unit("force")
    if not motion.driven:
        return Check(
            "force",
            False,
            f"{motion.force_name} is 0 throughout: taken as free motion",
            warning=True,
        )
    low, high = float(np.min(forces)), float(np.max(forces))
    if high - low <= 1e-3 * max(abs(low), abs(high)):
        return Check(
            "force",
            False,
            f"{motion.force_name} stays at {high:.4g} {unit}; under a constant force friction and mass are told "
            "only up to a factor: record one that changes in size and sign",
        )
    return Check("force", True, f"{motion.force_name} from {low:.4g} to {high:.4g} {unit}")


def check_dependence(balance: ForceBalance, motion: Motion) -> list[Check]:
    """That the force depends on the motion beyond its own noise; [] where it does."""
    if balance.depends is None:
        reason = (
            f"too little of the motion is sliding to see whether {motion.force_name} goes with it, or is constant "
            "but for its noise, when friction and mass are told only up to a factor; record longer, or push harder"
        )
        return [Check("force", False, reason)]
    if balance.depends:
        return []
    return [
        Check(
            "force",
            False,
            f"{motion.force_name} varies by no more than its own noise, in no way that goes with the motion: "
            "under a constant force friction and mass are told only up to a factor; step it, or reverse it",
        )
    ]


def check_amount(windows: Windows) -> Check:
    """That there are windows with motion to fit and to validate on."""
    count = len(windows.first)
    if count < FEWEST_WINDOWS:
        return Check(
            "length",
            False,
            f"{plural(count, 'stretch', 'stretches')} with motion, {FEWEST_WINDOWS} are needed; record longer, or "
            "repeat the motion",
        )
    return Check("length", True, f"{count} windows with motion, of {int(np.median(windows.length))} samples")


def travels(windows: Windows, resolution: float) -> tuple[float, float]:
    """Travel forward and backward in all windows, without what moves by less than two steps [m or rad]."""
    forward = backward = 0.0
    for first, length in zip(windows.first, windows.length, strict=True):
        y = windows.position[first : first + length]
        y = y[:: max(int(length) // 50, 1)]
        moves = np.diff(y)
        moves = moves[np.abs(moves) > 2.0 * resolution]
        forward += float(np.sum(moves[moves > 0.0]))
        backward -= float(np.sum(moves[moves < 0.0]))
    return forward, backward


def directions(windows: Windows, motion: Motion) -> tuple[bool, bool]:
    """Whether the joint slides forward, and backward, by enough to tell friction there."""
    forward, backward = travels(windows, motion.resolution)
    least = max(ONE_WAY * (forward + backward), FEWEST_COUNTS * motion.resolution)
    return forward >= least or forward > backward, backward >= least or backward > forward


def check_directions(windows: Windows, motion: Motion) -> Check:
    """That the joint slides both ways: a constant force and friction are one otherwise."""
    both = directions(windows, motion)
    if all(both):
        return Check("directions", True, "the joint slides forward and backward")
    way = "forward" if both[0] else "backward"
    return Check(
        "directions",
        False,
        f"the joint slides {way} only: dry friction cannot be told from a constant force such as gravity's; "
        "record motion in both directions",
        warning=True,
    )


def check_standstill(motion: Motion) -> Check:
    """How long the joint stands: its friction then hides force and mass."""
    shares = []
    for one in motion.sections:
        reach = max(8, len(one.position) // 400)
        moved = np.abs(one.position[reach:] - one.position[:-reach])
        shares.append((len(moved), float(np.mean(moved <= 1.5 * motion.resolution)) if len(moved) else 1.0))
    share = float(np.average([s for _, s in shares], weights=[max(n, 1) for n, _ in shares]))
    text = f"{100.0 * share:.0f} % of the samples are at rest, where friction hides the force"
    if share > STUCK:
        return Check("standstill", False, f"{text}; push harder, so that the joint slides for most of the time")
    if share > MOSTLY_STUCK:
        return Check("standstill", False, f"{text}; a larger force tells more", warning=True)
    return Check("standstill", True, text)


def check_saturation(motion: Motion, joint: Joint) -> list[Check]:
    """Whether the force has flat tops, or lies beyond what the drive gives."""
    if not motion.driven:
        return []
    forces, unit, name = motion.forces, joint.unit("force"), motion.force_name
    peak = float(np.max(np.abs(forces)))
    beyond = float(np.mean(np.abs(forces) > 1.001 * joint.limit))
    if beyond:
        return [
            Check(
                "saturation",
                False,
                f"{name} is beyond the drive's limit of {joint.limit:.4g} {unit} in {100.0 * beyond:.2g} % of the "
                "samples, where another force acted; those are limited as the drive limits them",
                warning=True,
            )
        ]
    levels = len(np.unique(forces[:200_000]))
    flat = max(float(np.mean(forces == np.max(forces))), float(np.mean(forces == np.min(forces))))
    if flat > FLAT and levels > FEW_LEVELS:
        return [
            Check(
                "saturation",
                False,
                f"{name} stays at its largest or smallest value, {peak:.4g} {unit}, in {100.0 * flat:.2g} % of "
                "the samples: if the amplifier or the recorder was saturated there, another force acted; record "
                "with a smaller one",
                warning=True,
            )
        ]
    return [Check("saturation", True, f"{name} has no flat tops")]
