"""The impedance at the handle from measured hand force and position, beside what `felt` predicts.

Which end drives the spectrum matters, as noise sits on both: see `impedance_spectra`, whose band holds Z whichever
of the two it is. The band is that of each frequency by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, fail, plural
from zwidth.identify.identification import Check, Estimate, Identification, refused
from zwidth.identify.impedance.local_spectra import LocalSpectra, local_spectra, merged_sums, sums_segment_length
from zwidth.identify.impedance.spectra import (
    FEWEST_LINES,
    FORCE,
    POSITION,
    MeasuredImpedance,
    OctaveBand,
    extreme,
    longest_stretch,
    low_frequency_fit,
    measured_impedance,
    octave_bands,
    stretches_of,
    wall_states,
)
from zwidth.identify.records.record import Columns, Record
from zwidth.identify.records.sampling import SampleTimes, check_periods, check_sampling
from zwidth.identify.response.identify import LEAST_SHARED, shared_power
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.raw_sweep import encoder_step
from zwidth.progress import Progress

__all__ = ["COLUMNS", "identify_impedance"]


FORCES: Final = ("handle_force_N", "force_N")
POSITIONS: Final = ("handle_position_m", "position_m")
COLUMNS: Final = Columns(needed=("time_s", FORCES, POSITIONS), text=("wall",))

KIND: Final = "impedance"
FIRST_PART: Final = 2.0 / 3.0  # of the record; the rest is unseen by the fit that is validated
COUNTS: Final = 10.0  # steps of the reading that the motion must exceed
FEWEST_SEGMENTS: Final = 2
HELD: Final = 0.01  # share of the samples at the largest force, from which on it was limited
THOUSAND: Final = (2.3, 3.7)  # powers of ten that a forgotten thousand may look like
FAR_OFF: Final = 2.3  # powers of ten
OPPOSITE: Final = -0.5  # cosine of the phase between measured and predicted, of a force with the wrong sign
BELOW_HALF: Final = 0.95  # of half the sampling rate up to which lines are used
CLIPPED: Final = 0.15  # share of them, from which on the force is not what acted
PREDICTED: Final = 0.5  # share of the unseen motion, below which a reader is warned
UNLIKE: Final = 2.0  # times the predicted impedance, or less than its inverse, that is remarked at low frequency
VALIDATED_ON: Final = "the last third of each record, its motion predicted from its force by the other two thirds"
LOW_FREQUENCY: Final = (
    ("static stiffness felt", "N/m"),
    ("damping felt at low frequency", "N s/m"),
    ("mass felt at low frequency", "kg"),
)
STATES: Final = {"on": "wall on", "off": "wall off"}


@dataclass(frozen=True)
class _State:
    """One state of the wall: spectra of both parts, the impedance of all, and the prediction there, or None."""

    name: str
    first: LocalSpectra
    second: LocalSpectra
    impedance: MeasuredImpedance
    predicted: Complexes | None


def identify_impedance(
    device: Device,
    records: Sequence[Record],
    *,
    point: OperatingPoint | None = None,
    stiffness: float | None = None,
    damping: float | None = None,
    segment: int | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Z(jw) = F/V at the handle with its band, its lowest and highest value, its real part by octaves, and what
    the device should have felt like.

    records             with the columns of `COLUMNS`; the force is that of the hand on the handle, in the sense of
                        the position. `wall` (on, off) parts a record; without it the wall is on where `stiffness`
                        is given
    point               posture and direction; None: `device.at()`
    stiffness, damping  of the wall that was on [N/m], [N s/m]
    segment             samples of a segment of the transforms; None: a third of the longest stretch
    progress            called with stage, steps done, and steps
    Raises              DeviceError  for faults of the records and of the arguments
    """
    if not records:
        raise fail(device.label, "", "no record was given; give a CSV file with hand force and position")
    point = device.at() if point is None else point
    wall = _wall(device, stiffness, damping)
    report = progress or (lambda stage, done, of: None)
    samplings, checks = _samplings(records)
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    if (unlike := _unlike_periods(samplings)) is not None:
        return Identification(KIND, device.label, (*checks, unlike))
    checks += check_periods(records, samplings, device.controller.sampling_period)
    for number, (record, sampling) in enumerate(zip(records, samplings, strict=True)):
        report("looking at the records", number, len(records))
        checks += _check_signals(record, sampling)
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    states, coherence_checks = _measured_states(records, samplings, segment, point, wall, report)
    checks += coherence_checks
    if not states:
        return Identification(KIND, device.label, tuple(checks))
    checks += [check for state in states for check in _check_against_prediction(state, wall)]
    # not for any failed check: one state of the wall may lack coherence, and the other have it
    if any(not (check.passed or check.warning) and check.what in ("units", "sign", "columns") for check in checks):
        return Identification(KIND, device.label, tuple(checks))
    return _identification(device, checks, states)


def _samplings(records: Sequence[Record]) -> tuple[list[SampleTimes], list[Check]]:
    """Read when the samples were taken; return the samplings of the records that have one, and the check of each.
    Raises DeviceError for cells that are no numbers."""
    samplings, checks = list[SampleTimes](), list[Check]()
    for record in records:
        sampling, check = check_sampling(record)
        checks.append(check)
        if sampling is not None:
            samplings.append(sampling)
    return samplings, checks


def _unlike_periods(samplings: Sequence[SampleTimes]) -> Check | None:
    """Check that the records have one sampling period; return what failed, None where they have."""
    periods = [one.period for one in samplings]
    if max(periods) > min(periods) * 1.001:
        text = (
            f"the records have sampling periods from {min(periods):.6g} to {max(periods):.6g} s; give each alone"
        )
        return Check("sampling", False, text)
    return None


def _measured_states(
    records: Sequence[Record],
    samplings: Sequence[SampleTimes],
    segment: int | None,
    point: OperatingPoint,
    wall: tuple[float, float] | None,
    report: Progress,
) -> tuple[list[_State], list[Check]]:
    """Measure the impedance in each state of the wall.

    segment  samples of a segment of the transforms; None: a third of the longest stretch
    Returns  the states in which force and motion are coherent, and the check of each one
    Raises   DeviceError  for words of the column wall that name no state
    """
    states, checks = list[_State](), list[Check]()
    for name in _states_of_records(records, wall):
        report(f"spectra, {STATES[name]}", 0, 0)
        longest = max(longest_stretch(*one, name) for one in zip(records, samplings, strict=True))
        state, check = _measured_state(
            name, records, samplings, sums_segment_length(longest, segment), point, wall
        )
        checks.append(check)
        if state is not None:
            states.append(state)
    return states, checks


def _identification(device: Device, checks: Sequence[Check], states: Sequence[_State]) -> Identification:
    """Validate the states, and return the result with the impedance's numbers, remarks and curves."""
    share = _validation(states)
    return Identification(
        kind=KIND,
        label=device.label,
        checks=(*checks, *_check_validation(share)),
        estimates=tuple(one for state in states for one in _estimates(state)),
        validation=share,
        validated_on=VALIDATED_ON
        if np.isfinite(share)
        else "nothing: no frequency is in both parts of the records",
        remarks=tuple(sentence for state in states for sentence in _passivity_remarks(state)),
        curves=_curves(states),
        details=_details(states),
    )


def _wall(device: Device, stiffness: float | None, damping: float | None) -> tuple[float, float] | None:
    """Stiffness [N/m] and damping [N s/m] of the wall; None without a stiffness. Raises DeviceError."""
    if stiffness is None:
        if damping is not None:
            raise fail(device.label, "damping", "is of a wall; give its stiffness, too")
        return None
    wall = (float(stiffness), 0.0 if damping is None else float(damping))
    if not np.isfinite(wall).all():
        raise fail(
            device.label, "stiffness", f"and damping of the wall must be finite, got {wall[0]} and {wall[1]}"
        )
    return wall


def _states_of_records(records: Sequence[Record], wall: tuple[float, float] | None) -> list[str]:
    """The states of the wall that the records are in. Raises DeviceError for other words.

    wall  stiffness and damping; None: off in records without a column of it, else on
    """
    seen = set[str]()
    for record in records:
        if "wall" not in record:
            seen.add("off" if wall is None else "on")
            continue
        row = 0  # of the piece's first
        for piece in record.pieces():
            states = wall_states(piece["wall"])
            if np.any(states == ""):
                bad = int(np.flatnonzero(states == "")[0])
                raise record.fault(f"must be on or off, got {str(piece['wall'][bad])[:60]!r}", row + bad, "wall")
            seen |= {str(state) for state in np.unique(states)}
            row += len(states)
    return [name for name in STATES if name in seen]


def _signal_columns(record: Record) -> tuple[str, str]:
    """Columns of force and position of a record."""
    return next(n for n in FORCES if n in record), next(n for n in POSITIONS if n in record)


def _check_signals(record: Record, sampling: SampleTimes) -> list[Check]:
    """Check that force and position change, the position by many of its steps, the force without a limit."""
    force, position = _signal_columns(record)
    low, high = {force: np.inf, position: np.inf}, {force: -np.inf, position: -np.inf}
    step, at_limit, total = np.inf, dict[float, int](), 0  # at_limit: extreme force of a piece -> samples at it
    for piece in sampling.stretches(record):
        for name in (force, position):
            low[name] = min(low[name], float(np.min(piece[name])))
            high[name] = max(high[name], float(np.max(piece[name])))
        step = min(step, encoder_step([piece[position]]) or np.inf)
        for limit in (float(np.max(piece[force])), float(np.min(piece[force]))):
            at_limit[limit] = at_limit.get(limit, 0) + int(np.sum(piece[force] == limit))
        total += len(piece[force])
    for name, what in ((force, "force"), (position, "position")):
        if not high[name] > low[name]:
            text = f"{name} of {record.label} is {low[name] + 0.0:g} all the time; move the handle while recording"
            return [Check(what, False, text)]
    span = high[position] - low[position]
    seen = f"the handle moves over {span:.3g} m"
    if step < np.inf:
        seen += f", {span / step:.4g} steps of its reading"
    if span < COUNTS * step < np.inf:
        return [Check("motion", False, f"{seen}; move it over {COUNTS:g} steps or more")]
    checks = [Check("motion", True, seen)]
    held = max(at_limit.get(high[force], 0), at_limit.get(low[force], 0))
    if held > HELD * total:
        text = (
            f"the force of {record.label} is at its extreme in {held} of {total} samples, as if it were limited "
            "there; leave that stretch out, or push less"
        )
        checks.append(Check("force", False, text, warning=held < CLIPPED * total))
    return checks


def _measured_state(
    name: str,
    records: Sequence[Record],
    samplings: Sequence[SampleTimes],
    length: int,
    point: OperatingPoint,
    wall: tuple[float, float] | None,
) -> tuple[_State | None, Check]:
    """The spectra and the impedance in one state of the wall, None where force and motion are not coherent in it;
    and the check of that.

    length  of a segment [samples]
    """
    first = _spectra_of_part(name, records, samplings, length, (0.0, FIRST_PART))
    second = _spectra_of_part(name, records, samplings, length, (FIRST_PART, 1.0))
    spectra = merged_sums([first, second])
    if spectra.segments < FEWEST_SEGMENTS:
        text = (
            f"{STATES[name]}: {plural(spectra.segments, 'segment')} of {length} samples; record longer, or give "
            "shorter segments"
        )
        return None, Check("coherence", False, text)
    # half the sampling rate [Hz]: of the record, or of the device where that is less
    half = 0.5 / spectra.period
    if point.response is None:
        half = min(half, 0.5 / point.controller.sampling_period)
    impedance = measured_impedance(spectra, BELOW_HALF * half)
    if len(impedance) < FEWEST_LINES:
        text = (
            f"{STATES[name]}: hand force and motion go together at {len(impedance)} of {len(spectra.frequency)} "
            "frequencies only; push with more force, over more of the frequencies; or has a sign flipped in "
            "between, or one of the columns stood still?"
        )
        return None, Check("coherence", False, text)
    f, c = impedance.frequency, impedance.coherence
    text = (
        f"{STATES[name]}: hand force and motion go together at {len(f)} frequencies from {f[0]:.4g} to "
        f"{f[-1]:.4g} Hz, coherence {np.median(c):.3g} in the middle, {plural(spectra.segments, 'segment')} of "
        f"{length} samples"
    )
    state = _State(name, first, second, impedance, _predicted(name, point, wall, f))
    return state, Check("coherence", True, text)


def _spectra_of_part(
    name: str,
    records: Sequence[Record],
    samplings: Sequence[SampleTimes],
    length: int,
    part: tuple[float, float],
) -> LocalSpectra:
    """Sum the spectra of force and position over the same part of each record, in one state of the wall.

    length  of a segment [samples]
    part    of the record, from which share of it to which
    """
    return merged_sums(
        [
            local_spectra(
                stretches_of(record, sampling, _signal_columns(record), name, part),
                sampling.period,
                length,
                (FORCE, POSITION),
            )
            for record, sampling in zip(records, samplings, strict=True)
        ]
    )


def _predicted(
    name: str, point: OperatingPoint, wall: tuple[float, float] | None, frequency: Floats
) -> Complexes | None:
    """Impedance (k,) [N s/m] that `felt` predicts in a state of the wall; None where the device has no model or no
    handle, or where the wall is not known.

    name  of the state, one of STATES: "off", the device is free and `wall` is not used
    wall  stiffness [N/m] and damping [N s/m]; None: not known
    """
    from zwidth.errors import FeedbackError, HandleError
    from zwidth.measures.handle_impedance import felt_impedance, free_impedance

    if point.response is not None or (name == "on" and wall is None):
        return None
    try:
        loop = point.without_operator.loop
        return felt_impedance(loop, *wall, frequency) if name == "on" and wall else free_impedance(loop, frequency)
    except (HandleError, FeedbackError):
        return None


def _check_against_prediction(state: _State, wall: tuple[float, float] | None) -> list[Check]:
    """Check that the measured impedance has the size and the sense of the predicted one.

    wall  stiffness [N/m] and damping [N s/m]; None: not known
    """
    if state.predicted is None:
        text = (
            "no prediction to compare with; a device with a model, its handle, and the wall's stiffness give one"
        )
        return [Check("prediction", False, f"{STATES[state.name]}: {text}", warning=True)]
    Z, P = state.impedance.value, state.predicted
    # medians of powers of ten between measured and predicted impedance
    size_off = float(np.median(np.log10(np.abs(Z) / np.abs(P))))
    w = 2.0 * np.pi * state.impedance.frequency
    # with force and position exchanged Z = f/(jw x) becomes x/(jw f), of size 1/(w^2 |Z|)
    exchanged = float(np.median(np.log10(1.0 / (np.abs(Z) * w**2) / np.abs(P))))
    size = f"{STATES[state.name]}: the impedance is {10.0**size_off:.3g} times the predicted one"
    if THOUSAND[0] < -size_off < THOUSAND[1]:
        return [Check("units", False, f"{size}; the position looks like mm, or the force like kN; give m and N")]
    if THOUSAND[0] < size_off < THOUSAND[1]:
        return [Check("units", False, f"{size}; the force looks like mN, or the position like km; give N and m")]
    if abs(size_off) > FAR_OFF and abs(exchanged) < 0.5 * FAR_OFF:
        return [Check("columns", False, f"{size}; force and position seem swapped; name them the other way")]
    sense = float(np.median(np.real(Z * np.conj(P)) / np.abs(Z * P)))
    if sense < OPPOSITE:
        text = (
            f"{size}, with the opposite sign; the force must be that of the hand on the handle, along the position"
        )
        return [Check("sign", False, text)]
    within = np.abs(Z - P) <= state.impedance.radius
    decibels = float(np.median(np.abs(_decibels(Z, P))))
    text = (
        f"{STATES[state.name]}: the predicted impedance lies in the band at {100.0 * np.mean(within):.0f} % of "
        f"the frequencies, and {decibels:.2g} dB from the measured one in the middle"
        f"{_low_frequency_hint(state, wall)}"
    )
    # bands of 95 %: by chance a few more may miss
    return [Check("prediction", bool(np.mean(within) >= 0.9), text, warning=True)]


def _low_frequency_hint(state: _State, wall: tuple[float, float] | None) -> str:
    """What to look at where the measured impedance is far from the predicted one in the lowest octave; "" where it
    is not: there a wall makes the difference.

    wall  stiffness [N/m] and damping [N s/m]; None: not known
    """
    assert state.predicted is not None
    f = state.impedance.frequency
    lowest = f <= 2.0 * f[0]
    times = float(np.median(np.abs(state.impedance.value[lowest] / state.predicted[lowest])))
    if 1.0 / UNLIKE < times < UNLIKE:
        return ""
    question = (
        f"was the wall of {wall[0]:g} N/m on all the time"
        if state.name == "on" and wall is not None
        else "was there no wall, and no spring that the file does not have"
    )
    return f"; from {f[0]:.3g} to {f[lowest][-1]:.3g} Hz it is {times:.2g} times the predicted one: {question}?"


def _decibels(Z: Complexes, P: Complexes) -> Floats:
    """Ratio |Z|/|P| (k,) of two impedances [dB]."""
    return np.asarray(20.0 * np.log10(np.abs(Z) / np.abs(P)))


def _validation(states: Sequence[_State]) -> float:
    """Share of the unseen motion's power that the force explains through the response of the other part; nan where
    no frequency can be predicted."""
    remains, total = 0.0, 0.0
    for state in states:  # channels: 0 force, 1 position
        if not (state.first.segments and state.second.segments):
            continue
        if shared_power(state.first.power(0), state.second.power(0)) < LEAST_SHARED:
            continue
        response, _ = state.first.fit(0, 1)
        used = np.isin(state.second.frequency, state.impedance.frequency)
        remains += float(np.sum(state.second.squares_left_by(response)[used]))
        # `power` is a mean per value, `squares_left_by` a sum
        total += float(np.sum(state.second.power(1)[used])) * state.second.values
    return 1.0 - remains / total if total > 0.0 else float("nan")


def _check_validation(share: float) -> list[Check]:
    """Warn that the last third of the motion does not follow the force as the rest does; [] where it does.

    share  of the unseen motion that is predicted; nan where none could be
    """
    if share > PREDICTED:
        return []
    text = (
        f"only {100.0 * max(share, 0.0):.3g} % of the unseen motion is predicted: noise, friction, a wall that "
        "was not on all the time, or a device that changes; record longer, with more force"
        if np.isfinite(share)
        else "the last third of the record has other frequencies than the rest, as in a single sweep, or no whole "
        "segment: nothing can be predicted; sweep twice, or record longer"
    )
    return [Check("validation", False, text, warning=True)]


def _estimates(state: _State) -> list[Estimate]:
    """Lowest and highest |Z|, and stiffness, damping and mass felt at low frequency, with their intervals."""
    Z, name = state.impedance, STATES[state.name]
    estimates = []
    for what in ("lowest", "highest"):
        k, value, low, high = extreme(Z, lowest=what == "lowest")
        title_of_extreme = f"{what} impedance, {name}, at {Z.frequency[k]:.4g} Hz"
        estimates.append(Estimate(title_of_extreme, value, low, high, "N s/m"))
    fit = low_frequency_fit(Z)
    if fit is not None:
        for (title, unit), value, half_width in zip(LOW_FREQUENCY, *(part.tolist() for part in fit), strict=True):
            estimates.append(Estimate(f"{title}, {name}", value, value - half_width, value + half_width, unit))
    return estimates


def _passivity_remarks(state: _State) -> list[str]:
    """Sentence that says whether the handle was seen to be passive, and in which octaves not."""
    bands, name = octave_bands(state.impedance), STATES[state.name]
    active = [f"{band.low:g} to {band.high:g} Hz" for band in bands if band.passive is False]
    open_ones = [f"{band.low:g} to {band.high:g} Hz" for band in bands if band.passive is None]
    if active:
        return [f"{name}: the handle gives energy to the hand in {comma_list(active)} (real part of Z below 0)"]
    if open_ones:
        return [f"{name}: whether the handle is passive is not seen in {comma_list(open_ones)}"]
    return [f"{name}: the real part of Z is above 0 in every octave; the handle is passive where it was measured"]


def _columns_of(state: _State) -> dict[str, list[Any]]:
    """Columns of a state's impedance with its band and the predicted one, one frequency a row."""
    Z, P = state.impedance, state.predicted
    predicted = np.full(len(Z), complex(np.nan, np.nan)) if P is None else P
    return {
        "wall": [state.name] * len(Z),
        "frequency_Hz": Z.frequency.tolist(),
        "impedance_real_Ns_per_m": Z.value.real.tolist(),
        "impedance_imag_Ns_per_m": Z.value.imag.tolist(),
        "impedance_low_Ns_per_m": Z.low.tolist(),
        "impedance_high_Ns_per_m": Z.high.tolist(),
        "radius_Ns_per_m": Z.radius.tolist(),
        "coherence": Z.coherence.tolist(),
        "predicted_real_Ns_per_m": predicted.real.tolist(),
        "predicted_imag_Ns_per_m": predicted.imag.tolist(),
        "deviation_dB": _decibels(Z.value, predicted).tolist(),
        "prediction_in_band": [None] * len(Z) if P is None else (np.abs(Z.value - P) <= Z.radius).tolist(),
    }


def _curves(states: Sequence[_State]) -> dict[str, list[Any]]:
    """The impedance of all states, one frequency a row."""
    parts = [_columns_of(state) for state in states]
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}


def _details(states: Sequence[_State]) -> dict[str, Any]:
    """The result's further keys and values: segments, octaves, and the width in dB."""
    bands: dict[str, list[OctaveBand]] = {state.name: octave_bands(state.impedance) for state in states}
    return {
        "segment_samples": {state.name: state.first.length for state in states},
        "estimator": "local polynomials; the band takes noise on either end, and holds each frequency with 95 %",
        "octaves": {name: [band.document() for band in some] for name, some in bands.items()},
        "width_dB": _z_width(states),
    }


def _z_width(states: Sequence[_State]) -> dict[str, float] | None:
    """Ratio [dB] of the impedances with and without the wall, where both are known: the Z-width; None for one
    state, or where no frequency is in both. states: on before off, if there are both."""
    if len(states) < 2:
        return None
    on, off = (state.impedance for state in states)
    both, on_rows, off_rows = np.intersect1d(on.frequency, off.frequency, return_indices=True)
    if not len(both):
        return None
    ratio = _decibels(on.value[on_rows], off.value[off_rows])
    return {
        "median_dB": float(np.median(ratio)),
        "largest_dB": float(np.max(ratio)),
        "frequency_of_largest_Hz": float(both[int(np.argmax(ratio))]),
    }
