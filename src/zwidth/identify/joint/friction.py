"""Dry and viscous friction of one joint, from free, coasting or driven motion.

From driven motion the effective mass or inertia follows, too; beside a measured force, how much of the commanded
one acts, and how late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite, nan
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.identify.identification import Check, Estimate, Identification, refused
from zwidth.identify.joint.fit import DELAY, DRIFTS, MASS, ONE, STIFFNESS
from zwidth.identify.joint.identification import POOR, FittedJoint, fitted_joint
from zwidth.identify.joint.joint import COLUMNS as COLUMNS
from zwidth.identify.joint.joint import Joint
from zwidth.identify.joint.motion import DRY_BACKWARD, DRY_FORWARD, VISCOUS_BACKWARD, VISCOUS_FORWARD
from zwidth.identify.joint.record import JointMotion
from zwidth.identify.joint.start import SHORTEST, weighted_balance, weighting
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import check_mass_in_file
from zwidth.progress import Progress
from zwidth.unit_text import unit_text

ALIKE_SPEEDS: Final = 0.98  # correlation of dry and viscous friction from which one speed is seen
UNKNOWN_MASS: Final = 0.5  # half the interval over the mass, from which the mass is not known
MASS_IN_FILE: Final = 0.5, 2.0  # ratios to the file's mass within which the two agree


@dataclass(frozen=True, repr=False)
class JointIdentification(Identification):
    """Friction and mass of a joint, with what their figure shows.

    angular   whether the joint turns
    velocity  (s,) mean velocities in segments that were measured [m/s or rad/s]
    friction  (s,) mean friction there: force less what accelerates the mass and bends the spring [N or N m]
    lines     (2, 2) level and viscous friction, forward and backward; nan where the joint did not slide so
    """

    angular: bool = False
    velocity: Floats = field(default_factory=lambda: np.zeros(0))
    friction: Floats = field(default_factory=lambda: np.zeros(0))
    lines: Floats = field(default_factory=lambda: np.full((2, 2), np.nan))


def identify_friction(
    device: Device,
    records: Sequence[Record],
    *,
    joint: str | int | None = None,
    spring: bool | None = None,
    mass_from_file: bool = False,
    progress: Progress | None = None,
) -> Identification:
    """Friction of one joint, from its position and what drove it.

    The joint is one mass under m x'' = f(t - delay) + bias - C sign(x') - b x' - k x, with levels and viscous
    friction of their own forward and backward, standing where the force does not overcome the level. A constant
    force and levels that differ cannot be told apart by any motion: forward the level is C - bias, backward
    C + bias, and C is their mean.

    records         with columns time_s, position_m or angle_rad, and what drove the joint: force_N or torque_Nm as
                    measured, current_A, or else force_command_N or torque_command_Nm; none of them in free motion,
                    which tells friction over mass
    joint           name of a drive (read at its motor) or of a link (read at its joint), number of a plant's
                    coordinate; None for a device of one
    spring          whether a spring holds the joint; None: where the data show one
    mass_from_file  in free motion, friction by the mass that the device file gives
    Raises          DeviceError  for a joint that the device has not, columns that are not the joint's, cells that
                    are no numbers
    """
    checks, fitted = fitted_joint(device, records, joint, spring, mass_from_file, progress)
    if fitted is None:
        return refused("friction", device.label, checks) or Identification("friction", device.label, checks)
    estimates = [*friction_estimates(fitted), *mass_estimates(fitted)]
    checks += (check_speeds(fitted), *([check_mass(fitted)] if fitted.motion.driven else []), *check_drift(fitted))
    checks += (*check_remainder(fitted), *mass_in_file(fitted))
    if (nothing := refused("friction", device.label, checks)) is not None:
        return nothing
    return identification("friction", device, fitted, checks, estimates)


def identification(
    kind: str, device: Device, fitted: FittedJoint, checks: Sequence[Check], estimates: Sequence[Estimate]
) -> JointIdentification:
    """What was fitted of a joint as a result."""
    time, measured, predicted = fitted.unseen_motion
    velocity, friction = friction_points(fitted)
    _, viscous_forward, viscous_backward, dry_forward, dry_backward, *_ = fitted.fit.numbers.values
    lines = np.array([[dry_forward, viscous_forward], [dry_backward, viscous_backward]])
    lines[[not fitted.forward, not fitted.backward]] = np.nan
    position = fitted.joint.position
    remarks, details = remarks_of(fitted)
    curves: dict[str, Any] = {"time_s": time, position: measured}
    curves[position.replace("_", "_predicted_")] = predicted
    return JointIdentification(
        kind,
        device.label,
        tuple(checks),
        tuple(estimates),
        fitted.explained,
        f"position in {len(fitted.unseen.first)} windows that were not fitted, each from its own position and "
        "velocity at the beginning; the share of what a straight line leaves there",
        tuple(remarks),
        curves,
        details,
        fitted.joint.angular,
        velocity,
        friction,
        lines,
    )


def _sum_estimate(
    fitted: FittedJoint, name: str, quantity: str, weights: Any, *, key: str = "", least: float = -np.inf
) -> Estimate:
    """A sum over the numbers, weights (10,), as an estimate, in the file's key where it has one.

    quantity  that `Joint.unit` names;   key  of `Joint.paths`, "" for none;   least  value below which it is not
              given
    """
    value, low, high = fitted.interval(np.asarray(weights, dtype=float))
    path, factor = fitted.joint.paths.get(key, ("", 1.0))
    unit = fitted.joint.unit(quantity)
    if fitted.unit_mass:
        path, factor, name = "", 1.0, f"{name} over mass"
        acceleration = f"{fitted.joint.unit('position')}/s^2"
        unit = {"force": acceleration, "damping": "1/s", "stiffness": "1/s^2"}[quantity]
    ends = sorted((max(low, least) * factor, max(high, least) * factor))
    return Estimate(name, max(value, least) * factor, ends[0], ends[1], unit, path)


def friction_estimates(fitted: FittedJoint) -> list[Estimate]:
    """Friction as the file holds it, the same both ways, with the bias (of motion one way: viscous friction
    alone); then that of each direction that moves, and the spring where one was fitted."""
    both = fitted.forward and fitted.backward
    estimates = []
    if both:
        estimates = [
            _sum_estimate(
                fitted,
                "dry friction",
                "force",
                0.5 * (ONE[DRY_FORWARD] + ONE[DRY_BACKWARD]),
                key="coulomb",
                least=0.0,
            ),
            _sum_estimate(
                fitted,
                "viscous friction",
                "damping",
                0.5 * (ONE[VISCOUS_FORWARD] + ONE[VISCOUS_BACKWARD]),
                key="damping",
                least=0.0,
            ),
            _sum_estimate(fitted, "bias", "force", 0.5 * (ONE[DRY_BACKWARD] - ONE[DRY_FORWARD])),
        ]
    else:
        one = ONE[VISCOUS_FORWARD] if fitted.forward else ONE[VISCOUS_BACKWARD]
        estimates = [_sum_estimate(fitted, "viscous friction", "damping", one, key="damping", least=0.0)]
    for there, way, level, damping in (
        (fitted.forward, "forward", DRY_FORWARD, VISCOUS_FORWARD),
        (fitted.backward, "backward", DRY_BACKWARD, VISCOUS_BACKWARD),
    ):
        if not there:
            continue
        speed = usual_speed(fitted, 1.0 if way == "forward" else -1.0)
        unit = fitted.joint.unit("position")
        # without a key: numbers of the joint themselves, never times a factor of the file
        estimates += [
            _sum_estimate(fitted, f"level {way}", "force", ONE[level]),
            _sum_estimate(fitted, f"viscous friction {way}", "damping", ONE[damping]),
            _sum_estimate(
                fitted,
                f"friction {way} at {speed:.3g} {unit}/s",
                "force",
                ONE[level] + speed * ONE[damping],
            ),
        ]
    if STIFFNESS in fitted.fit.numbers.free:
        spring = _sum_estimate(fitted, "spring", "stiffness", ONE[STIFFNESS], key="stiffness")
        # a device file takes no negative spring
        estimates.append(spring if spring.value > 0.0 else replace(spring, path=""))
    return estimates


def mass_estimates(fitted: FittedJoint) -> list[Estimate]:
    """The mass, nan and marked as not told where the fit does not tell it, and the delay of the force; [] of free
    motion."""
    if not fitted.motion.driven:
        return []
    delay = fitted.fit.interval(ONE[DELAY])
    mass = _sum_estimate(fitted, fitted.joint.mass_name, "mass", ONE[MASS], key="mass", least=0.0)
    if not fitted.tells_mass:
        mass = replace(mass, value=nan, low=-inf, high=inf, told="no", reason=untold_mass(fitted))
    return [
        mass,
        Estimate("delay of the force", *delay, "s"),
    ]


def untold_mass(fitted: FittedJoint) -> str:
    """Why the mass is not told, and what to record instead."""
    return (
        f"{fitted.motion.force_name} does not grow with the acceleration beyond its own noise, so that no "
        f"{fitted.joint.mass_name.removeprefix('effective ')} is told: record faster changes of a larger force, "
        "such as steps in both directions"
    )


def usual_speed(fitted: FittedJoint, side: float) -> float:
    """Median speed at which the joint slides to a side, 1 forward or -1, in the fitted windows [m/s or rad/s]; 0
    where it never does."""
    windows, resolution = fitted.fit.windows, fitted.motion.resolution
    speeds = list[Floats]()
    for first, length, T in zip(windows.first, windows.length, windows.period, strict=True):
        y = windows.position[first : first + length]
        reach = max(int(length) // 40, 1)
        moved = side * (y[reach:] - y[:-reach])
        speeds.append(moved[moved > 1.5 * resolution] / (reach * T))
    joined = np.concatenate(speeds)
    return float(np.median(joined)) if len(joined) else 0.0


def friction_points(fitted: FittedJoint) -> tuple[Floats, Floats]:
    """Mean velocity (s,) and friction (s,) in segments in which the joint slides one way throughout;
    none where driven motion does not tell the mass."""
    windows, numbers = fitted.fit.windows, fitted.fit.numbers.values
    if fitted.motion.driven and not fitted.tells_mass:  # what accelerates the mass cannot be taken from the force
        return np.zeros(0), np.zeros(0)
    size = int(max(np.median(windows.length) // 8, SHORTEST))
    delay = max(round(float(numbers[DELAY]) / float(np.mean(windows.period))), 0)
    # columns of A: weighted acceleration, velocity, sliding forward, less sliding backward, position
    A, force = weighted_balance(windows, size, fitted.motion.resolution, [delay], 1.0)
    sum_of_weights = float(np.sum(weighting(size)[0]))
    # 0.999: throughout, to rounding
    one_way = np.abs(A[:, 2] + A[:, 3]) > 0.999 * sum_of_weights
    A, force = A[one_way], force[one_way, 0]
    return A[:, 1] / sum_of_weights, (
        force - numbers[MASS] * A[:, 0] - numbers[STIFFNESS] * A[:, 4]
    ) / sum_of_weights


def check_speeds(fitted: FittedJoint) -> Check:
    """Whether viscous and dry friction can be told apart: at one speed only their sum is seen."""
    alike, known = list[str](), list[str]()
    for there, way, level, damping in (
        (fitted.forward, "forward", DRY_FORWARD, VISCOUS_FORWARD),
        (fitted.backward, "backward", DRY_BACKWARD, VISCOUS_BACKWARD),
    ):
        free = fitted.fit.numbers.free
        if there:
            pair = [free.index(level), free.index(damping)]
            spread = fitted.fit.covariance[np.ix_(pair, pair)]
            sizes = np.sqrt(np.diag(spread))
            speed = usual_speed(fitted, 1.0 if way == "forward" else -1.0)
            known.append(f"{way} mostly at {speed:.3g} {fitted.joint.unit('position')}/s")
            if not np.all(np.isfinite(sizes)) or abs(spread[0, 1]) > ALIKE_SPEEDS * sizes[0] * sizes[1]:
                alike.append(way)
    text = " and ".join(known)
    if not alike:
        return Check("speeds", True, f"the joint slides {text}")
    return Check(
        "speeds",
        False,
        f"the joint slides {text}, {' and '.join(alike)} at speeds too much alike: viscous and dry friction are "
        "hardly told apart, while their sum at that speed is; record slow and fast motion",
        warning=True,
    )


def check_mass(fitted: FittedJoint, *, needed: bool = False) -> Check:
    """Whether the motion tells the mass: what damps heavily hides it, and a delay looks like it.

    needed  the mass is what was asked for: without it the data are refused
    """
    if not fitted.tells_mass:
        return Check("acceleration", False, untold_mass(fitted), warning=not needed)
    name, unit = fitted.joint.mass_name, fitted.joint.unit("mass")
    value, low, high = fitted.interval(ONE[MASS])
    if isfinite(high) and high - value < UNKNOWN_MASS * value:
        return Check("acceleration", True, f"{name} is told to {100.0 * (high - value) / value:.2g} %")
    upper = f"only below {high:.3g} {unit_text(unit)}" if isfinite(high) else "not at all"
    useless = not (isfinite(high) and low > 0.0)
    return Check(
        "acceleration",
        False,
        f"{name} is told {upper}: friction or a delay of the force hide it; record faster changes of a larger "
        "force, such as steps in both directions",
        warning=not (needed and useless),
    )


def mass_in_file(fitted: FittedJoint) -> list[Check]:
    """Whether the mass is of the size that the file gives; [] where none is told."""
    if not fitted.tells_mass:
        return []
    joint, value = fitted.joint, float(fitted.fit.numbers.values[MASS])
    return check_mass_in_file(joint.mass_name, value, joint.mass, joint.unit("mass"), turns=joint.angular)


def check_drift(fitted: FittedJoint) -> list[Check]:
    """Whether the bias drifts: a warning; [] where it does not."""
    if not {*DRIFTS} & {*fitted.fit.numbers.free}:
        return []
    value, low, high = fitted.fit.interval(ONE[DRIFTS[0]] + 2.0 * ONE[DRIFTS[2]])  # growth, see `Windows.drifts`
    unit = fitted.joint.unit("force") if not fitted.unit_mass else f"{fitted.joint.unit('position')}/s²"
    ends = f"{low:.3g} to {high:.3g}" if isfinite(high) else "without bounds"
    return [
        Check(
            "drift",
            False,
            f"the bias drifts by about {value:.3g} {unit} ({ends}) over {fitted.motion.duration:.4g} s; the fit "
            "allows for it as long as it is slow, and the bias is its mean: let amplifier and sensor warm up",
            warning=True,
        )
    ]


def check_remainder(fitted: FittedJoint) -> list[Check]:
    """Whether more remains than the readings' noise: a warning; [] where it does not.

    What scatters from window to window is in the intervals; what is alike in all of them, as a friction that hangs
    on the load, is not.
    """
    if not POOR < fitted.misfit < inf:
        return []
    cause = "noise of the force, or a" if fitted.motion.driven else "a"
    return [
        Check(
            "remainder",
            False,
            f"what the fit leaves is {fitted.misfit:.2g} times the noise of the readings: {cause} friction that "
            "hangs on load, place, warmth or slow speed; numbers may miss by more than their intervals: compare "
            "records of other forces and speeds",
            warning=True,
        )
    ]


def remarks_of(fitted: FittedJoint) -> tuple[list[str], dict[str, Any]]:
    """Sentences beside the numbers, and further keys and values of the result."""
    joint, motion = fitted.joint, fitted.motion
    used = _force_remark(joint, motion.force_name if motion.driven else "")
    remarks = [*joint.remarks, used]
    details: dict[str, Any] = {
        "measured_at": joint.place,
        "force": motion.force_name if motion.driven else None,
        "sampling_period_s": fitted.sampling.period,
        "reference_" + joint.position: motion.reference,
        "residual_over_noise": fitted.misfit if isfinite(fitted.misfit) else None,
    }
    if fitted.forward and fitted.backward:
        remarks.append(
            "a constant force and a friction that differs forward and backward are the same in every motion: dry "
            "friction is the mean of both levels, the bias half their difference"
        )
    if STIFFNESS in fitted.fit.numbers.free:
        remarks.append(
            f"the bias is that at {joint.position} = {motion.reference:.6g}, and the spring acts from there"
        )
    if fitted.tells_mass and joint.mass > 0.0:
        ratio = float(fitted.fit.numbers.values[MASS]) / joint.mass
        low, high = MASS_IN_FILE
        agrees = "agrees with" if low < ratio < high else "is far from"
        remarks.append(
            f"{joint.mass_name} {agrees} the {joint.mass:.4g} {unit_text(joint.unit('mass'))} of the file, "
            f"{ratio:.3g} of it"
        )
    seen = compare_with_command(motion)
    if seen is not None:
        details |= {"command_gain": seen.gain, "command_lag_s": seen.lag, "command_correlation": seen.correlation}
        if seen.correlation < ALIKE:
            remarks.append(
                f"{joint.command} and {motion.force_name} are hardly alike, correlation {seen.correlation:.2f}"
            )
        else:
            remarks.append(
                f"{motion.force_name} is {seen.gain:.4g} times {joint.command}, {1e3 * seen.lag:.3g} ms later"
            )
    return remarks, details


def _force_remark(joint: Joint, name: str) -> str:
    """Which force was used, and what that means; name: its column, "" of free motion."""
    if not name:
        return "free motion: friction follows only as a ratio to the mass"
    if name == "current_A":
        return (
            f"used is current_A times the motor's torque constant, {joint.per_ampere:.4g} per ampere {joint.place}"
        )
    if name == joint.command:
        return (
            f"used is {name}, a command: an amplifier's gain and offset are in all numbers; record "
            f"{joint.measured} too to see them"
        )
    return f"used is {name} as measured"


LATEST: Final = 50  # samples by which a measured force may lag
ALIKE: Final = 0.5  # correlation below which the two are not the same force


@dataclass(frozen=True)
class Comparison:
    """measured(t) = gain command(t - lag), about their means.

    gain;  lag [s];  correlation at that lag
    """

    gain: float
    lag: float
    correlation: float


def compare_with_command(motion: JointMotion) -> Comparison | None:
    """The comparison over all sections; None where only one of the two was recorded, one does not change, or
    fewer than ten samples have room for the lags.

    The lag is where the correlation of the two is largest, between samples by a parabola through three of them.
    """
    pairs = [(one.force, one.command) for one in motion.sections if len(one.command)]
    if not motion.driven or not pairs:
        return None
    shifts = np.arange(-2, LATEST + 1)
    measured = np.concatenate([force[LATEST:-2] for force, _ in pairs])
    correlations_and_gains = np.zeros((len(shifts), 2))
    for row, shift in enumerate(shifts):
        moved = np.concatenate([command[LATEST - shift : len(command) - 2 - shift] for _, command in pairs])
        if len(moved) < 10 or np.std(moved) == 0.0 or np.std(measured) == 0.0:
            return None
        covariance = float(np.cov(moved, measured)[0, 1])
        correlations_and_gains[row] = covariance / (np.std(moved) * np.std(measured)), covariance / np.var(moved)
    best = int(np.argmax(correlations_and_gains[:, 0]))
    inner = min(max(best, 1), len(shifts) - 2)
    before, here, after = correlations_and_gains[inner - 1 : inner + 2, 0]
    curvature = before - 2.0 * here + after
    fraction = 0.5 * (before - after) / curvature if curvature < 0.0 and best == inner else 0.0
    return Comparison(
        float(correlations_and_gains[best, 1]),
        float((shifts[best] + fraction) * motion.sections[0].period),
        float(correlations_and_gains[best, 0]),
    )


def identify_mass(
    device: Device,
    records: Sequence[Record],
    *,
    joint: str | int | None = None,
    spring: bool | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Mass that resists a joint's acceleration; at a motor of rotor and links together.

    The same fit as `friction.identify_friction`, whose columns and options these are; friction is told too. Where
    friction or a delay hide the mass, so that its interval reaches 0, the data are refused.
    Raises  DeviceError  as `identify_friction` does
    """
    checks, fitted = fitted_joint(device, records, joint, spring, False, progress)
    if fitted is not None and not fitted.motion.driven:
        reason = "free motion tells only ratios of friction to mass; record force_N, torque_Nm or current_A too"
        checks += (Check("force", False, reason),)
        fitted = None
    elif fitted is not None:
        checks += (
            check_mass(fitted, needed=True),
            *mass_in_file(fitted),
            *check_drift(fitted),
            *check_remainder(fitted),
        )
    nothing = refused("mass", device.label, checks)
    if fitted is None or nothing is not None:
        return nothing or Identification("mass", device.label, checks)
    return identification("mass", device, fitted, checks, [*mass_estimates(fitted), *friction_estimates(fitted)])
