"""Natural frequencies, damping, and the numbers of a device, from a record of force and position.

Noise, a sweep, a multisine or steps: whatever moves the device over the frequencies of its resonances. What is
fitted is the response of the device's own sampled loop, with hold, delay and lag, to the lines of the record's
transform, in which nothing leaks (`local_response`); Welch's averaged spectra are for the checks and the figure.
`FittedData` parts the records into what is fitted and what the fit is validated on, in bands about the poles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, Literal, get_args

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.device.device import Device
from zwidth.device.faults import fail
from zwidth.identify.identification import Check, Identification, refused
from zwidth.identify.modes.checks import (
    amplitude_check,
    coherence_check,
    feedback_check,
    flip_check,
    force_excitation_check,
    force_is_clipped,
    hand_check,
    input_check,
    level_checks,
    order_check,
    resolution_check,
    shift_check,
    sign_and_unit_checks,
    slope_of,
    unfollowed_check,
)
from zwidth.identify.modes.local_response import (
    BandedRecord,
    FrequencyBand,
    Lines,
    NoiseCurve,
    RecordResponse,
    bands,
    explained_share,
    response_in_bands,
    transformed,
)
from zwidth.identify.modes.modal_fit import (
    MOST_MODES,
    STRONG,
    ModalFit,
    fit_modes,
    modal_intervals,
    modes_of,
    with_either_damping,
)
from zwidth.identify.modes.model import SampledModel, model_of, sampled_response
from zwidth.identify.modes.overview import (
    UNSEEN,
    Spectra,
    Survey,
    averaged_spectra,
    peak_poles,
    periodic_lines,
    survey_of,
)
from zwidth.identify.modes.physical_fit import PhysicalFit, device_estimates, fit_model, modal_estimates
from zwidth.identify.modes.stretches import KEPT, Levels, Source, Stretch, channels_of
from zwidth.identify.records.record import Columns, Record
from zwidth.identify.records.sampling import check_sampling
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.modes import undamped_modes
from zwidth.model.raw_sweep import encoder_step
from zwidth.progress import Progress

Estimator = Literal["H1", "H2", "Hv", "joint"]
Fitted = Literal["device", "modes"]

COLUMNS: Final = Columns(
    ("time_s", ("force_N", "torque_Nm"), ("position_m", "angle_rad")),
    ("reference_N", "reference_Nm", "command_N", "command_Nm"),
)
MOST_ROUNDS: Final = 8
SHIFTED: Final = -0.5  # samples of delay, below which nothing more is fitted
MISFIT: Final = 1.5  # by which residuals may exceed the noise before a model is said to miss something
FOLLOWED: Final = 0.97  # share of the unseen motion that follows a force with flat tops, if it is what acted
CURVE: Final = 2000  # points of a curve at most


def identify_modes(
    device: Device,
    records: Sequence[Record],
    *,
    point: OperatingPoint | None = None,
    paths: Sequence[str] = (),
    fitted: Fitted = "device",
    estimator: Estimator | None = None,
    segment: int | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Modes, and numbers of the device file, from records of the force that was commanded and the position read.

    records    with columns time_s, force_N or torque_Nm, position_m or angle_rad; one row per sample of the
               device's loop, each with the reading and the force sent after it. Optional: command_N, where
               force_N was measured; reference_N, what was added to the command of a loop that centres the device
    point      where the device is linearised, and who holds it; with an operator the hand's numbers are
               identified, and the device's are held
    paths      of the numbers to identify; (): masses, springs, dampers and delay of a [plant], stiffness of the
               drives, damping ratio and delay of a mechanism, the five numbers of a hand
    fitted     fit the file's numbers and the modes, "device", or the modes alone, "modes"
    estimator  of the response that is drawn: H1, H2, Hv, or joint with a reference; None: H1, or joint
    segment    samples of a segment of the averaged spectra; None: 15 segments, or the period of the force
    Returns    what each check saw; the numbers with their intervals where none refuses
    Raises     DeviceError  for columns or options that do not go together, cells that are no numbers
    """
    point = device.at() if point is None else point
    _check_options(device, records, fitted, estimator, segment)
    numbers = model_of(device, point, paths) if fitted == "device" else None
    sources, checks = _checked_sources(device, point, records)
    if result := refused("modes", device.label, checks):
        return result
    survey = survey_of(sources, segment, progress)
    seen = _check_survey(device, point, sources, survey, estimator)
    checks += seen.checks
    if result := refused("modes", device.label, checks):
        return result
    data = FittedData(sources, survey, seen.top, progress)
    pilot = data.pilot()
    if pilot is None:
        reason = (
            f"the longest stretch has {survey.longest} samples: too few for its lines to be told apart; record "
            "longer"
        )
        return Identification("modes", device.label, (*checks, Check("duration", False, reason)))
    # the first number of the vector is the delay [samples]; 1.0 below: the pilot's misfit is small enough
    if pilot.vector[0] < SHIFTED and pilot.misfit < MISFIT:
        checks.append(shift_check(float(pilot.vector[0]), float(pilot.vector[0]), 1.0))
        return Identification("modes", device.label, tuple(checks))
    check, data.dropped = amplitude_check(data.by_record(pilot), sources, survey.levels)
    checks.append(check)
    return _identified(device, point, numbers, data, pilot, checks, survey, seen)


def _check_options(
    device: Device, records: Sequence[Record], fitted: str, estimator: str | None, segment: int | None
) -> None:
    """Raise DeviceError for options of `identify_modes` that are not allowed, or do not go with the columns."""
    if not records:
        raise fail(device.label, "records", "are none; give at least one")
    if fitted not in get_args(Fitted):
        raise fail(device.label, "fitted", f"must be device or modes, got {fitted!r}")
    if estimator is not None and estimator not in get_args(Estimator):
        raise fail(device.label, "estimator", f"must be H1, H2, Hv or joint, got {estimator!r}")
    if segment is not None and segment < 64:
        raise fail(device.label, "segment", f"must be at least 64 samples, got {segment}")
    referenced = [any(name.startswith("reference_") for name in record.names) for record in records]
    if any(referenced) != all(referenced):
        raise records[referenced.index(False)].fault(
            "has no reference column, and another record has; give both one"
        )
    if any(referenced) and estimator in ("H1", "H2", "Hv"):
        text = f"{estimator} is biased where a loop centres the device: use joint, or leave the reference out"
        raise fail(device.label, "estimator", text)
    if estimator == "joint" and not any(referenced):
        raise fail(device.label, "estimator", "joint needs a column reference_N or reference_Nm")


def _checked_sources(
    device: Device, point: OperatingPoint, records: Sequence[Record]
) -> tuple[list[Source], list[Check]]:
    """Records of the loop's sampling as sources, at its exact period, in memory if short; the check of each."""
    sources, checks = list[Source](), list[Check]()
    for record in records:
        sampling, check = check_sampling(record, point.loop.period)
        checks.append(check)
        if sampling is not None:
            sources.append(
                Source(record, replace(sampling, period=point.loop.period), channels_of(device, point, record))
            )
    if sum(one.sampling.rows for one in sources) <= KEPT:
        for one in sources:
            one.keep()
    return sources, checks


@dataclass(frozen=True)
class _Seen:
    """The checks of the survey, and the response (n,) [m/N] by averaged spectra, with its estimator and coherence.

    excited  (n,) lines with force;   top  highest frequency to use [Hz]
    """

    checks: list[Check]
    estimator: str
    value: Complexes
    coherence: Floats
    excited: Flags
    top: float


def _check_survey(
    device: Device, point: OperatingPoint, sources: Sequence[Source], survey: Survey, estimator: Estimator | None
) -> _Seen:
    """Check levels, excitation, feedback and units, and say up to which frequency to fit: 0 where not known."""
    checks = _checks_of_levels(device, point, sources, survey.levels)
    nothing = np.zeros(0)
    closed = bool(sources[0].channels.reference)
    chosen = estimator or ("joint" if closed else "H1")
    if any(not (c.passed or c.warning) for c in checks) or not survey.spectra.segments:
        if not checks or all(c.passed or c.warning for c in checks):
            checks.append(
                Check("duration", False, "no segment fits into a stretch; record longer, or shorten them")
            )
        return _Seen(checks, chosen, nothing.astype(complex), nothing, nothing.astype(bool), 0.0)
    spectra = survey.spectra
    value = spectra.response("force", "position", chosen, "reference" if closed else "")
    coherence = spectra.coherence("reference" if closed else "force", "position")
    check, excited = force_excitation_check(spectra, sources[0].record.label)
    checks.append(check)
    names = (sources[0].channels.force, sources[0].channels.position)
    loudest = sources[survey.loudest[0]].first()
    assert loudest is not None
    both = {"force": loudest.force, "position": loudest.position}  # differenced alike: neither is known to drift
    differenced = averaged_spectra([both], spectra.period, spectra.length, dict.fromkeys(both, 2))
    checks.append(order_check(*slope_of(differenced), names))
    checks.append(flip_check(survey.agreement))
    if not all(check.passed for check in checks[-2:]):  # all else would be said of what is not so
        return _Seen(checks, chosen, value, coherence, excited, 0.0)
    checks.append(_check_feedback_or_reference(point, loudest, spectra.period, closed))
    checks.append(input_check(sources[0].channels))
    check, top = coherence_check(spectra, excited, closed)
    checks.append(check)
    if checks[-1].passed or checks[-1].warning:
        theta = 2.0 * np.pi * spectra.frequency * spectra.period
        of_device = sampled_response(point.loop, np.minimum(theta, np.pi))
        checks += sign_and_unit_checks(spectra, excited, value, of_device, sources[0].channels.turns)
    return _Seen(checks, chosen, value, coherence, excited, top)


def _checks_of_levels(
    device: Device, point: OperatingPoint, sources: Sequence[Source], levels_of: Sequence[Levels]
) -> list[Check]:
    """Check the length of each record, and the values in its columns, by its levels; return these checks.
    Only a [plant] states its encoder's step in the position's unit."""
    checks = list[Check]()
    given = device.document.get("loop", {}).get("encoder", {}).get("resolution_m", 0.0)
    given = float(given) if point.given_plant is not None and isinstance(given, int | float) else 0.0
    limit = float(point.loop.nonlinear.force_limit)
    for source, levels in zip(sources, levels_of, strict=True):
        if not levels.count:
            reason = f"no stretch of {source.record.label} without a gap has 256 samples; record longer"
            checks.append(Check("duration", False, reason))
            continue
        first = source.first()
        checks += level_checks(source, levels, encoder_step([first.position] if first else []), given, limit)
    return checks


def _check_feedback_or_reference(point: OperatingPoint, loudest: Stretch, period: float, closed: bool) -> Check:
    """Check that no loop centres the device, or that its reference is recorded (closed); period [s]."""
    squared, _ = undamped_modes(point.plant.mass, point.plant.stiffness)
    if closed:
        return Check("feedback", True, "the reference of the centring loop is recorded: S_yr/S_ur is used")
    free = bool(np.any(squared == 0.0))
    return feedback_check(loudest.force, loudest.position, period, free)


def _identified(
    device: Device,
    point: OperatingPoint,
    numbers: SampledModel | None,
    data: FittedData,
    pilot: ModalFit,
    checks: list[Check],
    survey: Survey,
    seen: _Seen,
) -> Identification:
    """What the records identify: modes fitted to the seen part in bands about their poles, the device's numbers
    fitted to the same response, each with its interval, and the check on the part that no fit has seen.

    pilot  modes fitted to a coarse response, which say where the bands lie; they are laid anew until poles stay
    """
    response, unseen_part, modal = _banded_fit(data, pilot)
    rough, _ = modal_intervals(response, modal, profiled=False)
    # the first number is the delay [samples]
    checks.append(shift_check(float(rough.low[0]), float(rough.high[0]), modal.misfit))
    checks.append(resolution_check(modal, data.line))
    if numbers is not None and numbers.hand:
        checks.append(hand_check(response, numbers, point))
    if result := refused("modes", device.label, checks):
        return result
    found, modal, difference = _model_and_damping(response, numbers, modal, data.period)
    profiled, spread = modal_intervals(response, modal)
    turns = data.sources[0].channels.turns
    estimates = modal_estimates(modal, profiled, spread, modal.damping == "hysteretic", turns)
    remarks = [_damping_remark(difference)] if modal.count else ["no resonance shows in the record"]
    details = _details(seen, survey, difference, modal.misfit, turns)
    if numbers is not None and found is not None:
        own, more = device_estimates(device, numbers, found, data.period)
        estimates, remarks = own + estimates, remarks + more
        details["misfit"] = found.misfit
        if found.misfit > MISFIT:
            checks.append(_misfit_check(found, numbers, response, data.period))
    remarks += periodic_lines(survey.period, data.sources[survey.loudest[0]], details)
    fitted = modal.response if found is None or numbers is None else partial(numbers.response, found.fit.values)
    curves = _curves(survey.spectra, seen, fitted)
    share = explained_share(unseen_part, fitted)
    if force_is_clipped(checks, data.sources) and share < FOLLOWED:
        return Identification("modes", device.label, (*checks, unfollowed_check(share)))
    text = f"{data.unseen}, predicted from its force"
    return Identification(
        "modes", device.label, tuple(checks), tuple(estimates), share, text, tuple(remarks), curves, details
    )


def _banded_fit(data: FittedData, pilot: ModalFit) -> tuple[RecordResponse, BandedRecord, ModalFit]:
    """Fit modes in bands about their poles, which are laid anew until poles stay; sets the noise in `data`.

    Returns  the response that was fitted, the sums for the validation, the modes
    """
    modal = pilot
    for _ in range(MOST_ROUNDS):
        before = modal.poles
        seen_part, unseen_part = data.sums(data.bands_about(before), None, data.bands_about(before, unseen=True))
        response = response_in_bands(seen_part)
        modal = fit_modes(response, data.period, modal)
        data.noise = response.noise
        if data.settled(before, modal.poles):
            break
    return response, unseen_part, modal


def _model_and_damping(
    response: RecordResponse, numbers: SampledModel | None, modal: ModalFit, period: float
) -> tuple[PhysicalFit | None, ModalFit, float]:
    """Fit the device's numbers, None without them, and choose the modes' damping.

    Returns  the numbers' fit, the modes, and the criterion with loss factors less that with dampers
    """
    found = None
    if numbers is not None:
        found = fit_model(response, numbers, modal, period)
        # where the device's model explains more, its modes are tried as well
        if found.misfit < modal.misfit:
            loop = numbers.loop_of(found.values)
            modal = min(modal, modes_of(response, loop), key=lambda fit: fit.criterion)
    viscous, lossy = with_either_damping(response, modal) if modal.count else (modal, modal)
    difference = lossy.criterion - viscous.criterion
    return found, lossy if difference < -STRONG else viscous, difference


def _details(seen: _Seen, survey: Survey, difference: float, misfit: float, turns: bool) -> dict[str, Any]:
    """Give the spectra's and the modes' numbers by key; `difference` is that of the criterion by the damping.

    misfit  of the modes;   turns  the motion is a turn, under a torque
    """
    return {
        "estimator": seen.estimator,
        "averages": survey.spectra.averages,
        "damping_criterion_difference": difference,
        "modal_misfit": misfit,
        "turns": turns,
    }


def _damping_remark(difference: float) -> str:
    """Which damping explains the data, in words.

    difference  of the criterion with loss factors less that with dampers
    """
    if difference < -STRONG:
        return (
            "loss factors explain the response better than dampers: the information criterion is "
            f"{-difference:.3g} lower"
        )
    if difference > STRONG:
        return (
            "dampers explain the response better than loss factors: the information criterion is "
            f"{difference:.3g} lower"
        )
    return (
        "dampers and loss factors explain the response alike: the information criterion differs by "
        f"{difference:.2g}"
    )


def _misfit_check(found: PhysicalFit, numbers: SampledModel, response: RecordResponse, period: float) -> Check:
    """Warn that the device's model leaves more than the noise, and near which frequency most; period [s]."""
    modelled = numbers.response(found.fit.values, 2.0 * np.pi * response.middle * period)
    deviations = np.abs(modelled - response.value) / response.deviation
    worst = float(response.middle[int(np.nanargmax(deviations))])
    reason = (
        f"the device's model leaves {found.misfit:.3g} times the noise, most near {worst:.4g} Hz: friction, "
        "another mode, or a stiffness that changes with load is not in it; the intervals are widened by that "
        "factor"
    )
    return Check("model", False, reason, warning=True)


def _curves(spectra: Spectra, seen: _Seen, fitted: Any) -> dict[str, Any]:
    """Columns of the measured and the fitted response, at no more than 2000 frequencies."""
    f = spectra.frequency
    chosen = np.flatnonzero(seen.excited)
    if len(chosen) > CURVE:
        places = np.searchsorted(f[chosen], np.geomspace(f[chosen[0]], f[chosen[-1]], CURVE))
        chosen = chosen[np.unique(np.minimum(places, len(chosen) - 1))]
    P = fitted(np.minimum(2.0 * np.pi * f[chosen] * spectra.period, np.pi))
    measured = seen.value[chosen]
    return {
        "frequency_Hz": f[chosen].tolist(),
        "measured_real": measured.real.tolist(),
        "measured_imag": measured.imag.tolist(),
        "coherence": seen.coherence[chosen].tolist(),
        "fitted_real": P.real.tolist(),
        "fitted_imag": P.imag.tolist(),
        "used": (f[chosen] <= seen.top).tolist(),
    }


UNKNOWN: Final = 1024  # lines that are kept one by one as long as no poles are known
SETTLED: Final = 1e-3  # of the distance of two lines, by which a pole may move between two rounds
ALMOST: Final = 0.9995  # of half the sampling rate, up to which is fitted


@dataclass
class FittedData:
    """The records as lines of transforms, a part of them for the fit, the rest for the validation.

    top  highest frequency [Hz];   noise  by which lines weigh, None: alike;   dropped  records that are not used
    """

    sources: Sequence[Source]
    survey: Survey
    top: float
    progress: Progress | None
    noise: NoiseCurve | None = None
    dropped: frozenset[int] = frozenset()

    @property
    def period(self) -> float:
        """Sampling period [s]."""
        return self.sources[0].sampling.period

    @property
    def closed(self) -> bool:
        """Whether a loop centres the device, whose reference is recorded."""
        return bool(self.sources[0].channels.reference)

    @property
    def line(self) -> float:
        """Distance of two lines of the transform of the longest stretch [Hz]."""
        # a stretch whose end is unseen is fitted without it
        share = 1.0 - (1.0 / UNSEEN if self._ends_unseen else 0.0)
        return 1.0 / (self.survey.longest * share * self.period)

    @property
    def _whole_stretches_unseen(self) -> bool:
        """Whether whole stretches, the last fourth of them, are for the validation."""
        return self.survey.covered and self.survey.stretches >= 2 * UNSEEN

    @property
    def _ends_unseen(self) -> bool:
        """Whether the last part of each stretch is for the validation."""
        return self.survey.covered and not self._whole_stretches_unseen

    @property
    def unseen(self) -> str:
        """The part of the records that the validation is made on, in words."""
        if self._whole_stretches_unseen:
            return "the last fourth of the stretches"
        if self._ends_unseen:
            return "the last fourth of each stretch"
        return "every fourth line of the transform, as the record excites each frequency only once"

    def parts(self, only: tuple[int, int] | None = None) -> Iterator[tuple[int, str, Lines, Lines | None]]:
        """Number of the record, name, lines for the fit, and lines for the validation, of each stretch: none for
        the fit where the whole stretch is for the validation, None for the validation where it is for the fit.

        only  record and number of a single stretch; None: all
        """
        number, fitted = 0, self.survey.stretches - self.survey.stretches // UNSEEN
        for record, source in enumerate(self.sources):
            if record in self.dropped:
                continue
            for index, stretch in enumerate(source.stretches()):
                if only is not None and (record, index) != only:
                    number += 1
                    continue
                label = source.record.label + (
                    f", stretch {index + 1}" if index or self.survey.stretches > 1 else ""
                )
                cut = len(stretch.force) - len(stretch.force) // UNSEEN
                if self._whole_stretches_unseen:
                    lines = self._lines(stretch)
                    yield (
                        (record, label, lines, None) if number < fitted else (record, label, lines.nothing, lines)
                    )
                elif self._ends_unseen:
                    yield record, label, self._lines(stretch, 0, cut), self._lines(stretch, cut, None)
                else:
                    lines = self._lines(stretch)
                    yield record, label, lines.without(UNSEEN - 1, UNSEEN), lines.only(UNSEEN - 1, UNSEEN)
                number += 1
                if self.progress is not None:
                    self.progress("transforming records", number, self.survey.stretches)

    def _lines(self, stretch: Stretch, first: int = 0, last: int | None = None) -> Lines:
        """Lines of the samples `first` to `last`, this one not included, of a stretch."""
        part = slice(first, last)
        reference = None if stretch.reference is None else stretch.reference[part]
        return transformed(stretch.force[part], stretch.position[part], reference, self.period)

    def bands_about(self, poles: Complexes, singles: int = 0, unseen: bool = False) -> list[FrequencyBand]:
        """Bands about these poles; the first `singles` lines, at most half of all, one by one.

        unseen  for the validation, whose lines lie farther apart
        """
        high = min(ALMOST * 0.5 / self.period, self.top)
        # distance of the part's lines over `line`: that of a fourth of each stretch, and of every fourth line, is
        # fourfold, and that of all lines but every fourth one 4/3 in the mean
        apart = (
            1.0
            if self._whole_stretches_unseen
            else UNSEEN
            if unseen
            else 1.0
            if self._ends_unseen
            else UNSEEN / (UNSEEN - 1.0)
        )
        line = self.line * apart
        return bands(self.line, high, line, poles, self.period, min(singles * line, 0.5 * high))

    def sums(
        self,
        where: Sequence[FrequencyBand],
        only: tuple[int, int] | None = None,
        unseen_where: Sequence[FrequencyBand] = (),
    ) -> tuple[BandedRecord, BandedRecord]:
        """The sums of what is fitted and of what is not.

        only          record and number of a single stretch; None: all
        unseen_where  bands of the latter
        """
        fitted = BandedRecord(where, self.period, self.closed, self.noise)
        unseen = BandedRecord(unseen_where, self.period, self.closed, self.noise)
        for _, _, lines, rest in self.parts(only):
            fitted.add(lines)
            if rest is not None:
                unseen.add(rest)
            if only is not None:
                break
        return fitted, unseen

    def pilot(self) -> ModalFit | None:
        """The modes of the stretch with the largest force, from which the bands are chosen; None where it is too
        short."""
        poles = peak_poles(self.survey.spectra)
        # a stretch behind the first may be one that no fit is to see: then all that are fitted are taken
        loudest = None if self._whole_stretches_unseen and self.survey.loudest[1] else self.survey.loudest
        modes = None
        # few modes first: bands are laid anew about their poles before more are looked for
        for most in (1, 3, MOST_MODES):
            where = self.bands_about(poles, UNKNOWN)
            if len([band for band in where if not band.single]) < 4:
                return None
            try:
                for _ in range(2 if modes is None else 1):  # a second time, weighed by the noise of the first
                    data = response_in_bands(self.sums(where, loudest)[0])
                    self.noise = data.noise
            except ValueError:
                return None
            modes = fit_modes(data, self.period, modes, most)
            if len(modes.poles) and self.settled(poles, modes.poles):
                break
            poles = modes.poles
        return modes

    def settled(self, before: Complexes, after: Complexes) -> bool:
        """Whether poles have moved so little that the bands about them are right; and always where reading the
        records again takes long.

        before, after  (p,) poles [1/s]
        """
        if self.sources[0].kept is None:
            return True
        moved = np.min(np.abs(after[:, None] - before), axis=1, initial=np.inf)
        return bool(np.all(moved < SETTLED * 2.0 * np.pi * self.line))

    def by_record(self, pilot: ModalFit) -> list[RecordResponse]:
        """The response of each record by itself; [] of a single one."""
        if len(self.sources) < 2:
            return []
        where = self.bands_about(pilot.poles)
        found = []
        for k in range(len(self.sources)):
            alone = replace(self, dropped=frozenset(range(len(self.sources))) - {k})
            found.append(response_in_bands(alone.sums(where)[0]))
        return found
