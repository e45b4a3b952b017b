"""From records of one joint's motion to its mass and friction: checks, fit, validation; shared by two kinds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.device.device import Device
from zwidth.device.faults import fail
from zwidth.identify.identification import Check
from zwidth.identify.joint.fit import (
    COUNT,
    DELAY,
    DRIFTS,
    MASS,
    ONE,
    STIFFNESS,
    JointFit,
    JointNumbers,
    Windows,
    approach,
    explained,
    fit_joint,
    predict,
)
from zwidth.identify.joint.force_balance import (
    ForceBalance,
    check_dependence,
    checks_of,
    directions,
    force_balance,
    groups_of,
    reason_of_misfit,
)
from zwidth.identify.joint.joint import Joint, joint_of
from zwidth.identify.joint.motion import DRY_BACKWARD, DRY_FORWARD, VISCOUS_BACKWARD, VISCOUS_FORWARD
from zwidth.identify.joint.record import JointMotion, read_motion, windows_of
from zwidth.identify.joint.start import first_starts, search_guess
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SampleTimes, check_periods, check_sampling
from zwidth.progress import Progress

UNSEEN: Final = 3  # of so many windows one is kept for validation
OUTLYING: Final = 6.0  # times the usual deviation, from which a window does not follow the model
MOST_OUTLYING: Final = 0.25  # share of the windows that may be left out for it
LEAST_EXPLAINED: Final = 0.7  # of the unseen motion
WELL_EXPLAINED: Final = 0.99  # of it, below which other causes are tried
POOR: Final = 5.0  # times the readings' noise, which then remains
SHOWN: Final = 0.9973  # confidence, of three standard errors, with which a spring or a drift is told from 0


@dataclass(frozen=True)
class FittedJoint:
    """What the data say of a joint.

    joint, motion  where it was measured, and what;   sampling  of the first record
    checks         that were passed, those after the fit included
    fit            on one part of the windows;   unseen, unseen_starts  the others, with their starts (W, 2)
    forward, backward  whether the joint slid so
    explained      share of the unseen windows' motion that is predicted
    outlying       times of the windows that were left out, as their motion follows no such model [s]
    unit_mass      the mass is not known, and all numbers are those over it
    balance        of the recorded force with the motion that was fitted; None of free motion
    """

    joint: Joint
    motion: JointMotion
    sampling: SampleTimes
    checks: tuple[Check, ...]
    fit: JointFit
    unseen: Windows
    unseen_starts: Floats
    forward: bool
    backward: bool
    explained: float
    outlying: tuple[float, ...]
    unit_mass: bool
    balance: ForceBalance | None

    @property
    def tells_mass(self) -> bool:
        """Whether the recorded force goes with the acceleration, without which no mass is told."""
        return self.balance is not None and self.balance.tells_mass

    def interval(self, weights: Floats) -> tuple[float, float, float]:
        """Value and ends of the interval of a sum over the numbers, weights (10,).

        Noise of the force makes output error's numbers too large, and in its intervals it is not: where more is
        left than the readings' noise, or the mass is not told, they are widened to hold the balance's too.
        """
        value, low, high = self.fit.interval(weights)
        balance = self.balance
        if (
            balance is None
            or balance.depends is None
            or weights[DELAY]  # of which a balance says nothing
            or (self.tells_mass and self.misfit <= POOR)
        ):
            return value, low, high
        ends = balance.interval(weights)
        return value, min(low, ends[0]), max(high, ends[1])

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals over the deviation of a reading; inf of readings without noise."""
        deviation = float(np.sqrt(np.mean(self.fit.residuals**2)))
        noise = self.motion.deviation
        return deviation / noise if noise > 0.0 else np.inf

    @property
    def unseen_motion(self) -> tuple[Floats, Floats, Floats]:
        """Time, measured and predicted position of the unseen windows, window by window."""
        windows = self.unseen
        predicted = predict(windows, self.fit.numbers.values, self.unseen_starts)
        measured = windows.position[windows.rows]
        parts = zip(windows.time, windows.length, windows.period, strict=True)
        time = np.concatenate([t + T * np.arange(n) for t, n, T in parts])
        return time, measured + self.motion.reference, predicted + self.motion.reference


def fitted_joint(
    device: Device,
    records: Sequence[Record],
    name: str | int | None,
    spring: bool | None,
    mass_from_file: bool,
    progress: Progress | None,
) -> tuple[tuple[Check, ...], FittedJoint | None]:
    """All checks, and what was fitted; None where a check refuses the data.

    name            of the joint, as `joint_of` takes it
    spring          whether a spring holds the joint; None: where the data show one
    mass_from_file  free motion tells friction over mass: take the mass of the file
    Raises          DeviceError  for a joint that the device has not, columns that are not the joint's, cells that
                    are no numbers, and no mass in the file
    """
    if not records:
        raise fail(
            device.label, "", "there is no record; give at least one file with columns time_s and position_m"
        )
    joint = joint_of(device, name)
    for record in records:
        joint.force_column(record)  # columns are wrong before samples are
    report = progress or (lambda stage, done, of: None)
    steps = len(records) + 4
    checks, read = _read_motion(device, records, joint, report, steps)
    if read is None:
        return tuple(checks), None
    sampling, motion, windows = read
    mass = _assumed_mass(device, joint, motion, mass_from_file)
    report("fitting", steps - 3, steps)
    forward, backward = directions(windows, motion)
    numbers = _first_numbers(motion, forward, backward, mass, spring is not False)
    fit, outlying = _fit_seen_windows(windows, motion, numbers, spring)
    report("validating", steps - 1, steps)
    unseen, starts, share, left_out = _predict_unseen(fit, windows, motion)
    unit_mass = not motion.driven and not mass_from_file
    outlying += left_out
    balance = balance_of(fit, motion) if motion.driven else None
    fitted = FittedJoint(
        joint, motion, sampling, (), fit, unseen, starts, forward, backward, share, outlying, unit_mass, balance
    )
    checks += _checks_after_fit(fitted, windows, numbers, records)
    fitted = replace(fitted, checks=tuple(checks))
    # the last check alone decides: after one that refuses no further one is made
    return tuple(checks), fitted if checks[-1].passed or checks[-1].warning else None


def _read_motion(
    device: Device, records: Sequence[Record], joint: Joint, report: Progress, steps: int
) -> tuple[list[Check], tuple[SampleTimes, JointMotion, Windows] | None]:
    """Read the records and check them before anything is fitted.

    steps    of the whole identification, for `report`
    Returns  all checks; the first record's sampling, the motion, its windows; None where a check refuses the data
    Raises   DeviceError  for cells that are no numbers
    """
    checks, samplings = list[Check](), list[SampleTimes]()
    for n, record in enumerate(records):
        report("reading records", n, steps)
        sampling, check = check_sampling(record)
        checks.append(check)
        samplings += [] if sampling is None else [sampling]
    if len(samplings) < len(records):
        return checks, None
    report("reading records", len(records), steps)
    motion = read_motion(records, samplings, joint)
    checks += _check_stretches(motion, samplings)
    if any(not check.passed for check in checks):
        return checks, None
    checks += check_periods(records, samplings, device.controller.sampling_period)
    motion = _with_limited_commands(motion, joint)
    windows = windows_of(motion)
    checks += checks_of(motion, windows, joint)
    if motion.driven and all(check.passed or check.warning for check in checks):
        checks += check_dependence(_balance_before(windows, motion, records), motion)
    if any(not (check.passed or check.warning) for check in checks):
        return checks, None
    return checks, (samplings[0], motion, windows)


def _assumed_mass(device: Device, joint: Joint, motion: JointMotion, mass_from_file: bool) -> float:
    """Choose the mass with which the fit begins: the file's [kg or kg m²] for free motion, where it is asked for;
    else 1. Raises DeviceError where the file has none."""
    mass = 1.0
    if mass_from_file and not motion.driven:
        mass = joint.mass
        if not mass > 0.0:
            raise fail(
                device.label, "", f"gives no mass that moves {joint.place}; set it, or record a driven motion"
            )
    return mass


def _predict_unseen(
    fit: JointFit, windows: Windows, motion: JointMotion
) -> tuple[Windows, Floats, float, tuple[float, ...]]:
    """Predict the windows that were not fitted.

    Returns  them, their starts (W, 2), the share of their motion that is predicted, and the times of those left
             out, as they do not follow the model [s]
    """
    unseen = windows.chosen(_unseen_windows(windows))
    starts = first_starts(unseen, fit.numbers.values)
    _, starts, squares = approach(unseen, replace(fit.numbers, free=(), tied=()), starts, 20)
    kept = squares <= OUTLYING**2 * _usual_mean_square(fit, motion) * unseen.length
    kept |= np.mean(~kept) > MOST_OUTLYING  # all, as then it is the model that is wrong
    share = explained(unseen.chosen(kept), squares[kept])
    return unseen, starts, share, tuple(unseen.time[~kept].tolist())


def _checks_after_fit(
    fitted: FittedJoint, windows: Windows, numbers: JointNumbers, records: Sequence[Record]
) -> list[Check]:
    """Check the model, the search's end, and what the recorded force depends on; return these checks."""
    checks = [_check_model(fitted, windows, numbers, records)]
    if (checks[-1].passed or checks[-1].warning) and not fitted.fit.converged:
        checks.append(_no_minimum_check(fitted.fit))  # a model that is wrong is the better reason
    if fitted.balance is not None and (checks[-1].passed or checks[-1].warning):
        checks += check_dependence(fitted.balance, fitted.motion)
    return checks


def _balance_before(windows: Windows, motion: JointMotion, records: Sequence[Record]) -> ForceBalance:
    """The balance of all windows, `depends` where that of any part does: a sign that flips may hide it in all."""
    whole = force_balance(windows, motion.resolution)
    if whole.depends is not False:
        return whole
    parts = groups_of(windows, motion, records).values()
    depends = any(force_balance(windows.chosen(which), motion.resolution).depends for which in parts)
    return replace(whole, depends=depends)


def balance_of(fit: JointFit, motion: JointMotion) -> ForceBalance:
    """The balance in the windows that were fitted: a force that changes elsewhere alone tells nothing there."""
    values = fit.numbers.values
    spring = STIFFNESS in fit.numbers.free
    return force_balance(fit.windows, motion.resolution, delay=float(values[DELAY]), spring=spring)


def _check_stretches(motion: JointMotion, samplings: Sequence[SampleTimes]) -> list[Check]:
    """Fail where no stretch without a gap is long enough to be cut into windows; [] where one is."""
    if motion.sections:
        return []
    longest = max(sampling.longest for sampling in samplings)
    reason = f"no stretch without a gap is longer than {longest} samples; record without losing samples"
    return [Check("gaps", False, reason)]


def _with_limited_commands(motion: JointMotion, joint: Joint) -> JointMotion:
    """The motion with forces as the drive limits them, where they are commands."""
    if not np.isfinite(joint.limit) or motion.force_name not in ("current_A", joint.command):
        return motion
    limit = joint.limit
    sections = [replace(one, force=np.clip(one.force, -limit, limit)) for one in motion.sections]
    return replace(motion, sections=tuple(sections))


def _first_numbers(motion: JointMotion, forward: bool, backward: bool, mass: float, spring: bool) -> JointNumbers:
    """The numbers to begin with, 0 but for the mass, and which are fitted: friction of a direction only where the
    joint slides so, else it is tied to the other direction's.

    spring  whether a stiffness is fitted
    """
    free: tuple[int, ...] = (MASS, DELAY) if motion.driven else ()
    free += (VISCOUS_FORWARD, DRY_FORWARD) if forward else ()
    free += (VISCOUS_BACKWARD, DRY_BACKWARD) if backward else ()
    free += (STIFFNESS, DRIFTS[0]) if spring else (DRIFTS[0],)
    viscous, dry = (VISCOUS_BACKWARD, VISCOUS_FORWARD), (DRY_BACKWARD, DRY_FORWARD)
    tied = () if forward and backward else (viscous, dry) if forward else (viscous[::-1], dry[::-1])
    return JointNumbers(mass * ONE[MASS], tuple(sorted(free)), tied)


def _unseen_windows(windows: Windows) -> Flags:
    """Which windows (W,) are kept for validation: every third."""
    return np.asarray(np.arange(len(windows.first)) % UNSEEN == UNSEEN - 1)


def _usual_mean_square(fit: JointFit, motion: JointMotion) -> float:
    """Median of the windows' mean squared residuals, at least that of the readings' noise [m² or rad²]."""
    edges = np.cumsum(fit.windows.length) - fit.windows.length
    means = np.add.reduceat(fit.residuals**2, edges) / fit.windows.length
    return max(float(np.median(means)), motion.deviation**2)


def _fit_seen_windows(
    windows: Windows, motion: JointMotion, numbers: JointNumbers, spring: bool | None
) -> tuple[JointFit, tuple[float, ...]]:
    """The fit without windows that follow no such model, and with a spring and a drift of the bias where these are
    shown; and the times of the windows that were left out [s].

    spring  whether one acts; None: where the data show one
    """
    seen = windows.chosen(~_unseen_windows(windows))
    guess, starts = search_guess(seen, numbers, motion.resolution, motion.deviation)
    fit = fit_joint(seen, guess, starts)
    doubtful = [n for n in (STIFFNESS, *DRIFTS) if n in guess.free and (spring is None or n != STIFFNESS)]
    hidden = not_shown(fit, doubtful)
    # where an even drift is seen, or more remains than noise, the bias may drift in a bent way, too
    if DRIFTS[0] not in hidden or _usual_mean_square(fit, motion) > POOR**2 * motion.deviation**2:
        wider = replace(fit.numbers, free=tuple(sorted({*fit.numbers.free, *DRIFTS})))
        fit = fit_joint(seen, wider, fit.starts)
        hidden = not_shown(fit, [*doubtful, *DRIFTS[1:]])
    edges = np.cumsum(seen.length) - seen.length
    means = np.add.reduceat(fit.residuals**2, edges) / seen.length
    outlying = means > OUTLYING**2 * _usual_mean_square(fit, motion)
    if not outlying.any() or np.mean(outlying) > MOST_OUTLYING:
        outlying[:] = False
    if hidden or outlying.any():
        free = tuple(i for i in fit.numbers.free if i not in hidden)
        values = np.where(np.isin(np.arange(COUNT), hidden), 0.0, fit.numbers.values)
        fit = fit_joint(
            seen.chosen(~outlying), replace(fit.numbers, free=free, values=values), fit.starts[~outlying]
        )
    return fit, tuple(seen.time[outlying].tolist())


def not_shown(fit: JointFit, numbers: Sequence[int]) -> list[int]:
    """Indices of those among some numbers that the data do not tell from 0, by Student's test, a bent drift
    together with its even part.

    Of two that look alike, as a spring and a drift do where the joint creeps one way, neither need be shown by
    itself, and one of them is there all the same: both are kept where 0 for both of them is as unlikely, by the F
    test with the lesser of their degrees of freedom.
    """
    from scipy.stats import f, t

    tests = {number: fit.combination(ONE[number]) for number in numbers}
    hidden = [
        number
        for number, (value, error, freedom) in tests.items()
        if not abs(value) > error * t.ppf(0.5 + 0.5 * SHOWN, freedom)
    ]
    shown = max((number for number in numbers if number in DRIFTS and number not in hidden), default=0)
    hidden = [number for number in hidden if number not in DRIFTS or number > shown]  # lower shapes stay
    if len(hidden) < 2:
        return hidden
    places = [fit.numbers.free.index(number) for number in hidden]
    spread = fit.covariance[np.ix_(places, places)]
    if not np.all(np.isfinite(spread)):
        return hidden
    values = fit.numbers.values[hidden]
    squares = float(values @ np.linalg.pinv(spread, hermitian=True) @ values)
    freedom = min(tests[number][2] for number in hidden)
    return [] if squares > len(hidden) * f.ppf(SHOWN, len(hidden), freedom) else hidden


def _no_minimum_check(fit: JointFit) -> Check:
    """The failed check of a search that has not arrived, as intervals hold about the best numbers only."""
    count = len(fit.windows.first)
    return Check(
        "search",
        False,
        f"the numbers that predict {count} windows best were not found, as where the joint hardly slides, at "
        "one speed only, or under another force than the one recorded (saturated, or late): record a larger force "
        "that changes in size and sign, as it acts",
    )


def _check_model(fitted: FittedJoint, windows: Windows, numbers: JointNumbers, records: Sequence[Record]) -> Check:
    """Check that one mass with friction predicts the windows that were not fitted; else say why not.

    windows  all of them;   numbers  which are fitted
    """
    count = len(windows.first)
    text = f"{100.0 * max(fitted.explained, 0.0):.4g} % of the motion in unseen windows is predicted"
    times = ", ".join(f"{t:.4g}" for t in sorted(fitted.outlying)[:5])
    if fitted.outlying and len(fitted.outlying) > MOST_OUTLYING * count:
        text += f", and {len(fitted.outlying)} of {count} windows do not follow the rest"
    poor = fitted.explained < LEAST_EXPLAINED or len(fitted.outlying) > MOST_OUTLYING * count
    doubtful = fitted.explained < WELL_EXPLAINED and fitted.misfit > POOR
    cause = reason_of_misfit(windows, fitted.motion, numbers, records) if poor or doubtful else ""
    if poor or cause:
        other = (
            "no mass with friction moves so under this force; another one, as of a hand or an end stop, may act"
        )
        return Check("model", False, f"{text}: {cause or other}")
    if fitted.outlying:
        return Check(
            "model",
            False,
            f"{text}; the windows at {times} s do not follow the rest, and are left out: an end stop, a hand, a "
            "saturated stretch, a step of the force that the rest does not explain? The record does not tell",
            warning=True,
        )
    return Check("model", True, text)
