"""Masses, first moments, inertias and friction of a mechanism from the motion and the torques of its joints.

The torques are linear in the parameters (`parameters`). They are compared in a band without delay (`smoothing`),
by least squares whose weights follow the errors (`regression`). Positions with noise make accelerations with
noise, which draws least squares towards 0; by how much is seen by adding as much noise again, of both signs, and
the fit is moved back by as much (simulation and extrapolation, Cook and Stefanski 1994, known at second hand).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, fail, quote
from zwidth.errors import NoAnswerError
from zwidth.identify.arm.checks import (
    DriveChannels,
    MotionSurvey,
    Side,
    check_mechanism,
    drive_channels_of,
    motion_check,
    other_readings,
    parts_left_out,
    sign_check,
    torque_check,
    velocity_check,
)
from zwidth.identify.arm.estimates import (
    ConsistentLinks,
    EffectiveMass,
    base_estimates,
    consistent_links,
    delay_estimate,
    effective_masses,
    joint_friction_estimates,
    link_mass_estimates,
    link_settings,
)
from zwidth.identify.arm.fit_checks import (
    Compared,
    TorqueComparison,
    consistency_check,
    error_sources,
    excitation_check,
    gravity_check,
    length_check,
    positive_check,
    remainder_check,
    timing_check,
    validation_check,
)
from zwidth.identify.arm.parameters import BaseParameters, Parameters, base_parameters
from zwidth.identify.arm.regression import Regression, regress
from zwidth.identify.arm.smoothing import TorqueBand, choose_band
from zwidth.identify.arm.stretches import TorqueStretch, TorqueTiming, smoothed
from zwidth.identify.identification import Check, Estimate, Identification, refused
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SampleTimes, check_mass_in_file, check_periods, check_sampling
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.mechanism import PRISMATIC, Mechanism
from zwidth.progress import Progress
from zwidth.result import entry

Torque = Literal["measured", "commanded"]
Rotors = Literal["fitted", "known"]

KIND: Final = "arm"
FITTED: Final = 0.7  # share of a single record that is fitted; the rest is for validation
SEEN: Final = 400_000  # rows of a record that are looked at first
FLEXIBLE: Final = 0.2  # share of the lowest flexible mode up to which the model of rigid links is used
PAIRS: Final = 2  # of noise of either sign, by which the bias is seen
POSITION_NOISE: Final = (
    "noise in the positions is not in the intervals: counts, jitter of the time, rows that repeat and vibration "
    "draw inertias and first moments of mass towards 0, by more than the intervals say"
)
NOT_WRITTEN: Final = (
    "noise in the positions is not in the intervals of 'identify arm', so that its numbers are not put into a "
    "device file; compare them with other records, and write by hand what you trust"
)


@dataclass(frozen=True, repr=False)
class ArmIdentification(Identification):
    """Numbers of a mechanism from the torques of its joints.

    numbers   path -> number or list of numbers: of the links, that reproduce the base parameters and that bodies
              can have, as the device file takes them; their intervals leave noise in the positions out
    """

    numbers: Mapping[str, Any] = field(default_factory=dict, metadata=entry())

    @property
    def not_written(self) -> str:
        """Why no device file gets these numbers."""
        return NOT_WRITTEN

    @property
    def left_out(self) -> tuple[str, ...]:
        """Sources of error that the intervals leave out, in words; () where nothing was fitted."""
        return (POSITION_NOISE,) if self.estimates else ()

    @property
    def premises(self) -> tuple[Mapping[str, Any], ...]:
        """Premises that the intervals rest on, as `Identification.premises`; () where nothing was fitted."""
        if not self.estimates:
            return ()
        return (
            {"what": "noise in the positions is small in the analysed band", "holds": None, "how": "not checked"},
        )


def identify_arm(
    device: Device,
    records: Sequence[Record],
    *,
    point: OperatingPoint | None = None,
    gravity: ArrayLike | None = None,
    side: Side = "joint",
    torque: Torque = "measured",
    rotors: Rotors = "fitted",
    progress: Progress | None = None,
) -> ArmIdentification:
    """Base parameters, friction and effective masses of a mechanism, with 95 % intervals.

    records   of one sampling period, in the columns `COLUMNS`; the last of several is not fitted but predicted, of
              a single one its last 30 %
    point     posture and directions of the effective masses; None: the device's reference
    gravity   (2,) or (3,) [m/s²]; None: that of the file's [load], or none
    side      where angles and torques were recorded: at the links' joints, "joint", or at the motors' shafts,
              "motor". Either way the torques are the motors', which accelerate the rotors too
    torque    whether the torque acted when it was recorded, "measured", or is the computer's command, "commanded",
              which acts after the loop's delay and is held for a period
    rotors    whether the rotors' inertias are fitted, "fitted", or taken from the device file, "known"
    Raises    DeviceError  for columns that are missing, options that do not fit, and devices without a mechanism
    """
    mechanism = check_mechanism(device)
    for name, value, allowed in (
        ("side", side, ("joint", "motor")),
        ("torque", torque, ("measured", "commanded")),
        ("rotors", rotors, ("fitted", "known")),
    ):
        if value not in allowed:
            raise fail(device.label, name, f"must be one of {', '.join(allowed)}, got {quote(value)}")
    if not records:
        raise fail(device.label, "identify arm", "needs at least one record")
    if rotors == "known" and not np.isfinite(mechanism.drives.motor_inertia).all():
        raise fail(device.label, "rotors", 'are not known: the file leaves motor_inertia_kg_m2 out; use "fitted"')
    at = device.at() if point is None else point
    if at.shape or at.posture is None:
        raise fail(device.label, "point", "must be a single posture of the device's mechanism")
    weight = _gravity(device, gravity)
    work = _Work(
        device, mechanism, tuple(records), at, weight, side, torque, rotors, progress or (lambda *_: None)
    )
    return work.identified()


def _gravity(device: Device, gravity: ArrayLike | None) -> Floats:
    """Gravity (3,) [m/s²]: as given, or the file's."""
    if gravity is None:
        return np.zeros(3) if device.load is None else np.asarray(device.load.weight, dtype=np.float64)
    given = np.asarray(gravity, dtype=np.float64)
    if given.shape not in ((2,), (3,)) or not np.isfinite(given).all():
        raise fail(device.label, "gravity", f"must be two or three finite numbers [m/s²], got {given.tolist()}")
    return np.append(given, np.zeros(3 - len(given)))


@dataclass(frozen=True)
class _Work:
    """The steps of one identification, with the arguments of `identify_arm`; gravity (3,) [m/s²]."""

    device: Device
    mechanism: Mechanism
    records: tuple[Record, ...]
    point: OperatingPoint
    gravity: Floats
    side: Side
    torque: Torque
    rotors: Rotors
    progress: Progress

    @property
    def drives(self) -> tuple[str, ...]:
        """Names of the drives."""
        return self.mechanism.drives.names

    def refusal(self, checks: Sequence[Check]) -> ArmIdentification | None:
        """The result that failed checks leave, without numbers; None where none has failed."""
        result = refused(KIND, self.device.label, checks)
        return None if result is None else ArmIdentification(KIND, self.device.label, result.checks)

    def identified(self) -> ArmIdentification:
        """Check the records, fit and validate; return the result, without numbers where a check fails."""
        channels = [drive_channels_of(self.device, record, self.side) for record in self.records]
        checks, samplings = self._sampling_checks()
        if stop := self.refusal(checks):
            return stop
        surveys = [self._surveyed(r, s, c) for r, s, c in zip(self.records, samplings, channels, strict=True)]
        checks += self._survey_checks(surveys)
        if stop := self.refusal(checks):
            return stop
        band = choose_band([one.coordinates for one in surveys], samplings, self._highest_rigid_frequency())
        checks += self._band_checks(band, samplings, channels, surveys)
        if stop := self.refusal(checks):
            return stop
        stretches = list(self._smoothed(samplings, channels, band))
        fitted, unseen = _split(stretches)
        parameters = Parameters.of(self.mechanism, self.rotors == "fitted")
        start = self._start()
        base = base_parameters(parameters, start, self.gravity)
        comparison = TorqueComparison(base, band, self.gravity, self._known_rotors(), start)
        try:
            self.progress("torques", 0, 1)
            trial_gravities = self._trial_gravities()
            seen = _compared(comparison, fitted, trial_gravities)
            validation = _compared(comparison, unseen)
        except NoAnswerError as error:
            reason = f"{error}; check the angles' signs, zeros and unit (radians), and the assembly"
            return self._refused_with([*checks, Check("posture", False, reason)])
        checks.append(Check("posture", True, "every loop closes at every sample"))
        checks.append(length_check(seen, validation, base))
        if stop := self.refusal(checks):
            return stop
        fit, beta = self._regressed(comparison, fitted, seen)
        checks += self._fit_checks(fit, base, beta, seen, validation, trial_gravities, band)
        if stop := self.refusal(checks):
            return stop
        result = self._result(checks, base, fit, beta, band, validation)
        return self.refusal(result.checks) or result

    def _sampling_checks(self) -> tuple[list[Check], list[SampleTimes]]:
        """Check that the records are sampled regularly, with one period, and as the computer commands.

        Returns  the checks, and the times of those records that are sampled regularly
        """
        checks, samplings = list[Check](), list[SampleTimes]()
        for number, record in enumerate(self.records):
            self.progress("checking", number, len(self.records))
            sampling, check = check_sampling(record)
            checks.append(check)
            if sampling is not None:
                samplings.append(sampling)
        if len(samplings) == len(self.records):
            periods = np.array([one.period for one in samplings])
            if np.ptp(periods) > 1e-3 * periods[0]:
                listed = comma_list([f"{period:.6g} s" for period in periods])
                checks.append(
                    Check("sampling", False, f"records of different periods, {listed}; give those of one")
                )
            period = self.device.controller.sampling_period
            if self.torque == "measured":
                checks += check_periods(self.records, samplings, period)
            if self.torque == "commanded" and abs(periods[0] / period - 1.0) > 1e-3:
                reason = f"rows come every {periods[0]:.6g} s, but the computer commands every {period:.6g} s"
                checks.append(Check("sampling", False, f"{reason}; correct loop.sampling_period_s, or the time"))
        return checks, samplings

    def _surveyed(self, record: Record, sampling: SampleTimes, channels: DriveChannels) -> MotionSurvey:
        """The longest stretch among the first `SEEN` rows of a record, its end left out beyond so many."""
        best, rows = None, 0
        for piece in sampling.stretches(record):
            rows += len(piece["time_s"])
            if best is None or len(piece["time_s"]) > len(best["time_s"]):
                best = {name: values[:SEEN] for name, values in piece.items()}
            if rows >= SEEN:
                break
        assert best is not None
        return MotionSurvey(best, channels.coordinates(best), channels.forces(best))

    def _survey_checks(self, surveys: Sequence[MotionSurvey]) -> list[Check]:
        """Check the motion and the torques in the first rows of each record."""
        drives, links = self.mechanism.drives, self.mechanism.links
        steps = 2.0 * np.pi / (np.asarray(drives.encoder_counts) * drives.transmission)  # at the joints
        turning = np.array([links.joint[joint] != PRISMATIC for joint in drives.joint], dtype=float)
        limits = drives.torque_limit * drives.transmission
        return [motion_check(drives.names, surveys, steps, turning), torque_check(drives.names, surveys, limits)]

    def _highest_rigid_frequency(self) -> float:
        """Highest frequency at which drives may be taken for rigid [Hz]; inf where none is known to bend."""
        drives = self.mechanism.drives
        if not np.isfinite(drives.stiffness).any() or self.device.missing.get("dynamics"):
            return np.inf
        lowest = self._flexible_mode()
        return FLEXIBLE * lowest if lowest > 0.0 else np.inf

    def _flexible_mode(self) -> float:
        """Lowest natural frequency of the links on their drives' springs, the motors held [Hz]."""
        drives, posture = self.mechanism.drives, self.point.posture
        assert posture is not None
        spring = drives.stiffness * drives.transmission**2  # at the joints
        soft = np.isfinite(spring)
        compliance = np.diag(np.where(soft, 1.0 / np.where(soft, spring, 1.0), 0.0))
        # K^-1 M has the eigenvalues 1/w^2; a drive without a spring is rigid
        largest = float(np.max(np.linalg.eigvals(compliance @ posture.mass_matrix).real))
        return 1.0 / (2.0 * np.pi * np.sqrt(largest)) if largest > 0.0 else np.inf

    def _band_checks(
        self,
        band: TorqueBand,
        samplings: Sequence[SampleTimes],
        channels: Sequence[DriveChannels],
        surveys: Sequence[MotionSurvey],
    ) -> list[Check]:
        """Check the stretches' lengths, recorded velocities, and what the model of rigid links leaves out."""
        checks = list[Check]()
        wide, narrow = band.wide, band.narrow
        # both kernels take their reach off either end, the wide one twice: what is left is 1.5 times as long; and
        # 300 samples, whatever the kernels
        needed = 2.5 * (4.0 * wide.reach + 2.0 * narrow.reach)
        longest = max(one.longest * one.period for one in samplings)
        if longest < needed or longest / band.period < 300:
            reason = f"the longest stretch without a gap lasts {longest:.4g} s, {needed:.4g} s are needed"
            return [Check("length", False, f"{reason} at this sampling; record longer, or sample faster")]
        for channel, survey in zip(channels, surveys, strict=True):
            taps = wide.taps(band.period), wide.taps(band.period, 1)
            check = velocity_check(self.drives, channel, survey, taps[1], taps[0])
            if check is not None:
                checks.append(check)
        soft = self._highest_rigid_frequency() / FLEXIBLE  # Hz, the lowest flexible mode
        if band.motion > FLEXIBLE * soft:
            reason = (
                f"the motion reaches {band.motion:.3g} Hz, the lowest mode of the links on the drives' springs is "
                f"at {soft:.3g} Hz; compared is up to {band.edge:.3g} Hz, where rigid drives make masses wrong by "
                f"{100.0 * (band.edge / soft) ** 2:.2g} % at most; move more slowly, or measure at the links"
            )
            checks.append(Check("flexible drives", False, reason, warning=True))
        if left := parts_left_out(self.device):
            checks.append(Check("device", False, f"left out: {comma_list(left)}", warning=True))
        return checks

    def _smoothed(
        self, samplings: Sequence[SampleTimes], channels: Sequence[DriveChannels], band: TorqueBand
    ) -> Iterator[TorqueStretch]:
        """The stretches of all records, smoothed and thinned; a command acts after the loop's delay."""
        timing = TorqueTiming()
        if self.torque == "commanded":
            controller, T = self.device.controller, band.period
            lag = controller.actuator_time_constant
            # half the variance in time: T^2/12 of a command held for T, lag^2 of a first-order lag
            timing = TorqueTiming((controller.delay + 0.5) * T + lag, T**2 / 24.0 + 0.5 * lag**2)
        for number, (record, sampling, channel) in enumerate(zip(self.records, samplings, channels, strict=True)):
            self.progress("smoothing", number, len(self.records))
            yield from smoothed(record, number, sampling, channel, band, timing)

    def _start(self) -> Floats:
        """Joint coordinates (n,) of the operating point's posture."""
        posture = self.point.posture
        assert posture is not None
        return np.asarray(posture.angles)

    def _known_rotors(self) -> Floats:
        """Inertias (d,) at the joints, n^2 J, of rotors that are taken from the file; 0 where they are fitted."""
        drives = self.mechanism.drives
        if self.rotors == "fitted":
            return np.zeros(len(drives.names))
        return np.asarray(drives.motor_inertia * drives.transmission**2)

    def _trial_gravities(self) -> list[Floats]:
        """Gravities (3,) of 1 m/s² along x, y and z, whose torques are looked for in the residuals; [] where
        gravity was given."""
        return [] if np.any(self.gravity) else list(np.eye(3))

    def _refused_with(self, checks: Sequence[Check]) -> ArmIdentification:
        """The result without numbers, of checks of which one is known to have failed."""
        result = self.refusal(checks)
        assert result is not None
        return result

    def _regressed(
        self, comparison: TorqueComparison, fitted: Sequence[TorqueStretch], seen: Sequence[Compared]
    ) -> tuple[Regression, Floats]:
        """Fit the base parameters; return the regression, and their values (b,) without the bias of noise.

        fitted, seen  stretches that are fitted, and their torques and columns
        """
        base = comparison.base
        first = regress([one.columns for one in seen], [one.torques for one in seen])
        noisy = list(self._with_noise_of_both_signs(comparison, fitted))
        sources = error_sources(comparison.band, first, seen, noisy)
        # 1 friction, 0 inertias and the delay
        groups = np.array([int(j >= base.parameters.friction.start) for j in base.kept] + [0])
        fit = regress([one.columns for one in seen], [one.torques for one in seen], sources, groups)
        return fit, _unbiased(fit, noisy)

    def _with_noise_of_both_signs(
        self, comparison: TorqueComparison, fitted: Sequence[TorqueStretch]
    ) -> Iterator[list[Compared]]:
        """The fitted stretches with as much noise again in the positions, `PAIRS` times: with the noise added,
        then with it taken off; fewer where a mechanism cannot follow the noise."""
        rng = np.random.default_rng(0)
        for number in range(PAIRS):
            self.progress("noise", number, PAIRS)
            noise = [comparison.band.noise_of(len(stretch.time), rng) for stretch in fitted]
            for sign in (1.0, -1.0):
                try:
                    yield _compared(
                        comparison, [_with_noise(*pair, sign) for pair in zip(fitted, noise, strict=True)]
                    )
                except NoAnswerError:  # at the edge of what the loops allow
                    return

    def _fit_checks(
        self,
        fit: Regression,
        base: BaseParameters,
        beta: Floats,
        seen: Sequence[Compared],
        validation: Sequence[Compared],
        trial_gravities: Sequence[Floats],
        band: TorqueBand,
    ) -> list[Check]:
        """Check the fit, base parameters beta (b,): signs, excitation, inertias, gravity, friction and timing.

        seen, validation  what was fitted, and what was not;   trial_gravities  (3,) that might act
        """
        by_record = {one.record for one in (*seen, *validation)}
        groups = [[one for one in (*seen, *validation) if one.record == number] for number in sorted(by_record)]
        measured = [np.concatenate([one.torques for one in group]) for group in groups]
        predicted = [np.concatenate([one.columns[..., :-1] @ beta for one in group]) for group in groups]
        labels = [self.records[number].label for number in sorted(by_record)]
        checks = [sign_check(self.drives, labels, predicted, measured) if len(groups) > 1 else None]
        change, as_recorded, as_changed = other_readings(
            self.drives, [o.columns[..., :-1] for o in seen], [o.torques for o in seen]
        )
        if change:
            reason = (
                f"{100.0 * as_recorded:.3g} % of the torque is left unexplained, {100.0 * as_changed:.3g} % would "
                f"be if {change}; noise of the positions, gravity that is not stated or another friction can look "
                "so too, and the record does not tell which: check the columns"
            )
            checks.append(Check("signs", False, reason))
        checks += [
            excitation_check(fit, base, beta),
            positive_check(self.drives, base, beta, self._start(), self._known_rotors()),
            gravity_check(seen, fit, beta) if trial_gravities else None,
            remainder_check(self.drives, seen, base, np.append(beta, fit.delay)),
            timing_check(fit, band.period, self.torque),
        ]
        return [one for one in checks if one is not None]

    def _mass_checks(self, rigid: Estimate) -> list[Check]:
        """Whether the first effective mass is of the size that the file gives, where it gives all numbers."""
        if self.device.missing:
            return []
        known = float(np.asarray(self.point.measure("rigid_mass"), dtype=np.float64).ravel()[0])
        turns = not np.any(self.mechanism.links.joint == PRISMATIC)
        return check_mass_in_file(rigid.name, rigid.value, known, rigid.unit, turns=turns)

    def _result(
        self,
        checks: Sequence[Check],
        base: BaseParameters,
        fit: Regression,
        beta: Floats,
        band: TorqueBand,
        validation: Sequence[Compared],
    ) -> ArmIdentification:
        """The result of a fit with base parameters beta (b,): links nearest to the file's, masses along the
        directions, friction and delay with their intervals, and the checks of the unseen part, `validation`."""
        links = consistent_links(base, self.mechanism, beta, fit.information)
        values = np.zeros(len(base.parameters.names))
        values[list(base.kept)] = beta
        numbers, noted = link_settings(self.device, self.mechanism, base.parameters, links.values)
        best = np.append(beta, fit.delay)
        shares, total = _explained_shares(validation, best)
        checks = [*checks, consistency_check(links), validation_check(self.drives, shares, band.edge)]
        estimates = [
            *link_mass_estimates(self.point, self._masses(base, values, links), base, fit),
            *joint_friction_estimates(self.device, self.mechanism, base, fit, beta),
            *base_estimates(base, fit, beta),
            delay_estimate(fit),
        ]
        checks += self._mass_checks(estimates[0])  # the rigid mass along the first direction
        remarks = (
            f"torques were {self.torque}, at the {self.side}s; the rotors' inertias were {self.rotors}",
            f"compared up to {band.edge:.3g} Hz",
            *noted,
        )
        return ArmIdentification(
            kind=KIND,
            label=self.device.label,
            checks=tuple(checks),
            estimates=tuple(estimates),
            validation=total,
            validated_on=self._validated_on(validation, band),
            remarks=remarks,
            curves=self._curves(validation, best),
            details=self._details(fit, shares, band),
            numbers=numbers,
        )

    def _validated_on(self, validation: Sequence[Compared], band: TorqueBand) -> str:
        """Say which torque the share that is explained belongs to."""
        last = max(one.record for one in validation)
        many = len(self.records) > 1
        what = f"the last record, {self.records[last].label}" if many else "the last 30 % of the record"
        return (
            f"torque of {what} up to {band.edge:.3g} Hz by its recorded accelerations, whose noise is in both; "
            "mean of the joints"
        )

    def _details(self, fit: Regression, shares: Sequence[float], band: TorqueBand) -> dict[str, Any]:
        """Give the share of each drive's torque that is explained, the fit's condition, and the options."""
        return {
            "validation_by_drive": dict(zip(self.drives, shares, strict=True)),
            "condition_number": fit.condition,
            "band_Hz": band.edge,
            "side": self.side,
            "torque": self.torque,
            "rotors": self.rotors,
            "gravity_m_per_s2": self.gravity.tolist(),
        }

    def _masses(self, base: BaseParameters, values: Floats, links: ConsistentLinks) -> Iterator[EffectiveMass]:
        """The effective masses: by the base parameters where these determine them, else by all of the links.

        values  (P,) of all parameters, the base ones and 0 for the others;   links  that can exist
        """
        known = self._known_rotors()
        by_base = effective_masses(base.parameters, self.point, values, known)
        by_links = effective_masses(base.parameters, self.point, links.values, known)
        for one, other in zip(by_base, by_links, strict=True):
            determined = one.gradient is None or base.determines(one.gradient)
            yield one if determined and np.isfinite(one.value) else other

    def _curves(self, validation: Sequence[Compared], best: Floats) -> dict[str, Sequence[Any]]:
        """Torques of the unseen part, measured and predicted by parameters and delay (b + 1,); thinned."""
        time = np.concatenate([one.time for one in validation])
        measured = np.concatenate([one.torques for one in validation])
        predicted = np.concatenate([one.columns @ best for one in validation])
        some = slice(None, None, max(len(time) // 20_000, 1))  # rows that are kept
        columns: dict[str, Sequence[Any]] = {"time_s": time[some].tolist()}
        for k, name in enumerate(self.drives):
            slides = self.mechanism.links.joint[self.mechanism.drives.joint[k]] == PRISMATIC
            unit = "force_N" if slides else "torque_Nm"
            columns[f"measured_{unit}.{name}"] = measured[some, k].tolist()
            columns[f"predicted_{unit}.{name}"] = predicted[some, k].tolist()
        return columns


def _split(stretches: Sequence[TorqueStretch]) -> tuple[list[TorqueStretch], list[TorqueStretch]]:
    """The stretches that are fitted, and those that are predicted: the last record, of a single one its end."""
    last = stretches[-1].record if stretches else 0
    if stretches and stretches[0].record != last:
        return [one for one in stretches if one.record != last], [one for one in stretches if one.record == last]
    count, before = sum(len(one.time) for one in stretches), 0
    fitted, unseen = list[TorqueStretch](), list[TorqueStretch]()
    for one in stretches:
        cut = int(np.clip(FITTED * count - before, 0, len(one.time)))
        before += len(one.time)
        fitted += [one.part(slice(0, cut))] if cut else []
        unseen += [one.part(slice(cut, None))] if cut < len(one.time) else []
    return fitted, unseen


def _compared(
    comparison: TorqueComparison, stretches: Sequence[TorqueStretch], static: Sequence[Floats] = ()
) -> list[Compared]:
    """Torques and columns of the stretches that are long enough, further ones of gravities (3,), `static`."""
    least = 2 * comparison.band.narrow.half(comparison.band.step) + 1
    return [comparison.of(one, static) for one in stretches if len(one.time) > least]


def _with_noise(stretch: TorqueStretch, noise: tuple[Floats, Floats, Floats], sign: float) -> TorqueStretch:
    """The stretch with noise of its coordinates, rates and accelerations (n, d) added, times 1 or -1."""
    q, v, a = noise
    return replace(
        stretch,
        coordinates=stretch.coordinates + sign * q,
        rates=stretch.rates + sign * v,
        accelerations=stretch.accelerations + sign * a,
    )


def _unbiased(fit: Regression, noisy: Sequence[Sequence[Compared]]) -> Floats:
    """The parameters (b,), moved back by as much as noise that is added to the positions moves them.

    noisy  pairs of `_with_noise_of_both_signs`
    """
    whole = len(noisy) - len(noisy) % 2  # noise of either sign equally often
    if not whole:
        return fit.values
    found = [fit.refitted([o.columns for o in one], [o.torques for o in one]) for one in noisy[:whole]]
    return np.asarray(2.0 * fit.values - np.mean(found, axis=0))


def _explained_shares(validation: Sequence[Compared], best: Floats) -> tuple[list[float], float]:
    """Share of each joint's torque that parameters and delay (b + 1,) explain, and the mean of the shares."""
    torques = np.concatenate([one.torques for one in validation])
    residuals = np.concatenate([one.torques - one.columns @ best for one in validation])
    variance = np.var(torques, axis=0)
    shares = 1.0 - np.mean(residuals**2, axis=0) / np.where(variance > 0.0, variance, np.nan)
    return [float(share) for share in shares], float(np.mean(shares))
