"""From raw sweeps of a device to its response, as a [response] reads it, with the chart that follows.

The response is checked before its chart is believed: columns, units, runs that agree. `SweepBlocks` reads the
longest stretch of a sweep without a gap, block by block; `shared_excitation` tells whether two parts of it have
the same frequencies, without which one is not predicted from the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.chart.measured.chart import MeasuredChart, hidden_walls, measured_chart
from zwidth.device.device import Device
from zwidth.errors import ResponseError
from zwidth.identify.identification import Check, Estimate, Identification, refused
from zwidth.identify.modes.checks import FACTORS_LINEAR, FEW_LEVELS, NEAR, flip_check, order_check
from zwidth.identify.modes.model import sampled_response
from zwidth.identify.records.record import Columns, Record
from zwidth.identify.records.sampling import SampleTimes, check_sampling
from zwidth.loop.controller import Controller
from zwidth.model.raw_sweep import block_length, encoder_step, sweep_response_of_blocks
from zwidth.model.response import LEAST_COHERENCE, MeasuredPath, Response, mean_path
from zwidth.progress import Progress

FORCES: Final = ("force_command_N", "force_N")
COLUMNS: Final = Columns(("time_s", FORCES, "position_m"))

KIND: Final = "response"
FIT_SHARE: Final = 2.0 / 3.0  # of each record, its beginning; the rest is predicted
FEWEST_COUNTS: Final = 10.0  # of the motion
LIMITED: Final = 0.05  # share of the samples at the largest and the smallest force, from which on it was clipped
FIRST_LEVELS: Final = 100_000  # samples among which the force's levels are counted
FEWEST_USABLE: Final = 0.2  # share of the frequencies
UNKNOWN_BELOW: Final = 10.0  # times the lowest frequency: from there on a free device does not show as one


def identify_response(
    device: Device,
    records: Sequence[Record],
    *,
    integrators: int | None = None,
    segment: int | None = None,
    progress: Progress | None = None,
) -> Identification:
    """The response of a device from raw sweeps: force command sample to encoder sample, with coherence.

    records      every sample of the loop; each is a sweep of its own, and several are repetitions
    integrators  poles at z = 1: 2 of a free device, 1 with a dashpot, 0 on a spring; None: read off the response
    segment      samples whose transform resolves what must be told apart, see `sweep_response`; None: by itself
    Returns      `curves` are the columns of a file that a [response] reads; the number is the largest stiffness,
                 its interval from what is stable beyond doubt to what may be
    Raises       DeviceError  for records that cannot be read
    """
    period = device.controller.sampling_period
    checks, sweeps = _checked_sweeps(records, period)
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    # once: each frequency is there at one time only, so that all samples are fitted
    fitted, once = _fitted_samples(sweeps)
    length = block_length(fitted, segment)
    try:
        responses = [
            sweep_response_of_blocks(
                _reported(sweep.part(0, fitted), length, f"sweep {n + 1}", progress), period, integrators, segment
            )
            for n, sweep in enumerate(sweeps)
        ]
    except ResponseError as error:
        checks.append(Check("response", False, f"{records[0].label} {error}"))
        return Identification(KIND, device.label, tuple(checks))
    response = _mean_response(responses)
    checks.append(_check_coherence(response))
    columns = next(one for one in FORCES if one in records[0]), "position_m"
    if checks[-1].passed:
        checks += check_responses(device, responses, [record.label for record in records], columns)
        if once:
            shares = _shares_of_others(responses, sweeps, length, period)
        else:
            unseen = (sweep.part(fitted, len(sweep)) for sweep in sweeps)
            shares = [_share_explained(response, part, length, period) for part in unseen]
        checks += check_prediction(min(shares, default=np.nan))
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    share, validated_on = min(shares, default=np.nan), _validated_on(len(sweeps), once)
    return _charted(device, checks, responses, response, share, validated_on)


def _checked_sweeps(records: Sequence[Record], period: float) -> tuple[list[Check], list[SweepBlocks]]:
    """Check the sampling and the columns of each record.

    period   of the device's computer [s]
    Returns  the checks; the longest stretch of each record that has a sampling
    Raises   DeviceError  for cells that are no numbers
    """
    checks, sweeps = list[Check](), list[SweepBlocks]()
    for record in records:
        sampling, check = check_sampling(record, period)
        checks.append(replace(check, what=_named("sampling", record, records)))
        if sampling is None:
            continue
        name = next(one for one in FORCES if one in record)
        sweep = SweepBlocks.longest(record, sampling, name, "position_m")
        checks.append(replace(_check_gaps(len(sweep), sampling.rows), what=_named("gaps", record, records)))
        checks += [replace(one, what=_named(one.what, record, records)) for one in _check_sweep(sweep)]
        sweeps.append(sweep)
    return checks, sweeps


def _fitted_samples(sweeps: Sequence[SweepBlocks]) -> tuple[int, bool]:
    """Choose how many samples of each sweep, from its beginning, are fitted.

    Returns  their number, and whether each frequency is there at one time only
    """
    count = min(len(sweep) for sweep in sweeps)
    fitted = int(FIT_SHARE * count)
    once = min(shared_excitation(sweep, int(FIT_SHARE * len(sweep))) for sweep in sweeps) < LEAST_SHARED
    if once:  # each frequency is there at one time only: all of it is fitted
        fitted = count
    return fitted, once


def _charted(
    device: Device,
    checks: list[Check],
    responses: Sequence[Response],
    response: Response,
    share: float,
    validated_on: str,
) -> Identification:
    """Make the chart of the response, and return the result with it; without a number where there is no chart.

    checks     passed so far; gets that of the chart
    responses  of each sweep;   response  of all
    share      of the unseen acceleration that is predicted;   validated_on  what it is of
    """
    chart, why = _chart(response, device.controller)
    checks.append(Check("chart", chart is not None, why))
    if chart is None:
        return Identification(KIND, device.label, tuple(checks), curves=_response_columns(responses))
    return Identification(
        KIND,
        device.label,
        tuple(checks),
        (_largest_stiffness(chart),),
        share,
        validated_on,
        tuple(_remarks(chart, device, response)),
        _response_columns(responses),
        {"averages": response.averages, "integrators": chart.integrators, "measurement": response.note},
    )


def _named(what: str, record: Record, records: Sequence[Record]) -> str:
    """Name of a check, with the record's label in front where there are several records."""
    return what if len(records) == 1 else f"{record.label}: {what}"


def _reported(
    sweep: SweepBlocks, length: int, name: str, progress: Progress | None
) -> Iterator[tuple[Floats, Floats]]:
    """Force and position of a sweep in blocks of `length` samples, with reports of its name to `progress`."""
    for number, block in enumerate(sweep.blocks(length)):
        if progress is not None:
            progress(f"transforming {name}", number, len(sweep) // length)
        yield block


def _check_gaps(kept: int, rows: int) -> Check:
    """Check that the longest stretch without a gap, `kept` rows, is half of the record's rows or more."""
    said = (
        "no sample is missing"
        if kept == rows
        else f"the longest stretch without a gap is used, {kept} of {rows} rows"
    )
    enough = kept >= 0.5 * rows
    return Check("gaps", enough, said if enough else f"{said}; record without gaps")


def _check_sweep(sweep: SweepBlocks) -> list[Check]:
    """Check that the force changes, that the position moves by enough counts, and that the force is not clipped;
    [] of a sweep without samples."""
    if not len(sweep):
        return []
    seen = SweepRange.of(sweep, FIRST_LEVELS)
    (least, most), (lowest, highest) = seen.force, seen.position
    if least == most:
        return [Check("excitation", False, f"the force is {least + 0.0:g} N all the time; excite the device")]
    if lowest == highest:
        return [Check("motion", False, f"the position is {lowest + 0.0:g} m all the time; is the encoder read?")]
    checks = [Check("excitation", True, f"the force runs from {least:.4g} to {most:.4g} N")]
    counts = (highest - lowest) / seen.step if seen.step else np.inf
    said = f"the position runs over {highest - lowest:.4g} m" + (f", {counts:.4g} counts" if seen.step else "")
    moved = counts >= FEWEST_COUNTS
    checks.append(
        Check("motion", moved, said if moved else f"{said}; at least {FEWEST_COUNTS:g} are needed, push more")
    )
    limited = max(seen.at_largest, seen.at_smallest) / len(sweep)
    clipped = seen.levels > FEW_LEVELS and limited > LIMITED
    said = f"{100 * limited:.2g} % of the samples are at the largest or smallest force"
    reason = f"{said}: clipped? excite less, a command that was not followed is no input" if clipped else said
    return [*checks, Check("saturation", not clipped, reason)]


def _mean_response(responses: Sequence[Response]) -> Response:
    """Repeated sweeps as one response: their mean, with each of them in `sweeps`."""
    if len(responses) == 1:
        return responses[0]
    whole = mean_path([MeasuredPath(one.value, one.coherence) for one in responses])
    return replace(responses[0], value=whole.value, coherence=whole.coherence, sweeps=whole.sweeps)


def _check_coherence(response: Response) -> Check:
    """Check that enough frequencies are coherent, and say from where to where."""
    assert response.coherence is not None
    good = response.coherence >= LEAST_COHERENCE
    share = float(np.mean(good))
    if share < FEWEST_USABLE:
        return Check(
            "coherence",
            False,
            f"only {100 * share:.2g} % of the frequencies are coherent: the position hardly answers the force; "
            "are columns "
            "of two records mixed, or is the force too small?",
        )
    f = response.frequency[good]
    text = f"coherent from {f[0]:.4g} to {f[-1]:.4g} Hz, at {100 * share:.3g} % of the frequencies"
    return Check("coherence", True, text)


def _chart(response: Response, controller: Controller) -> tuple[MeasuredChart | None, str]:
    """The chart of the response, which holds the hardware's delay and lag already; None and why there is none."""
    computer = replace(controller, delay=0.0, actuator_time_constant=0.0)
    try:
        chart = measured_chart(response, computer)
    except ResponseError as error:
        return None, str(error)
    if np.isfinite(chart.stiffness_max_nominal):
        return chart, f"poles at z = 1: {chart.integrators}"
    unknown = _unknown_below(response)
    if hidden := hidden_walls(chart):
        return None, (
            f"the data leave no wall certain: {hidden}; record longer, so that a resonance spans many "
            f"frequencies, with more force there, or repeat the sweep{unknown}"
        )
    misplaced = (
        "; write in each row the reading and the force sent after it, as commanded: a force that was measured, or "
        "rows that are shifted, come too late"
    )
    return None, f"no wall with a stiffness above 0 is stable by this response{unknown or misplaced}"


def _unknown_below(response: Response) -> str:
    """Hint that low frequencies, which one sweep passes in no time, are not known; "" where they are."""
    assert response.coherence is not None
    lowest = float(response.frequency[response.coherence >= LEAST_COHERENCE][0])
    if lowest <= UNKNOWN_BELOW * float(response.frequency[0]):
        return ""
    return (
        f"; below {lowest:.3g} Hz, where a free device differs from a held one, it is not known: excite low "
        "frequencies longer, by a sweep that is slower there, or one that is repeated"
    )


def _largest_stiffness(chart: MeasuredChart) -> Estimate:
    """Largest stiffness that is stable by the response, from what is beyond doubt to what may be."""
    high = chart.band.stiffness_high if chart.band is not None else chart.stiffness_max_nominal
    return Estimate("largest stiffness", chart.stiffness_max_nominal, chart.stiffness_max, high, "N/m")


def _remarks(chart: MeasuredChart, device: Device, response: Response) -> list[str]:
    """Sentences on the interval, on the keys that the response's file needs, and on the file's own model."""
    said = (
        [f"{response.note}; the interval holds what is stable beyond doubt, and what may be"]
        if response.note
        else []
    )
    said.append(
        "beside the file with this response, in a [response]: averages = "
        f"{response.averages:.4g}, integrators = {chart.integrators}"
    )
    if device.response is None:
        own_stiffness = device.at().chart(decay=False).stiffness_max
        high = chart.band.stiffness_high if chart.band is not None else chart.stiffness_max
        within = "within" if chart.stiffness_max <= own_stiffness <= high else "outside"
        said.append(
            f"the file's own model renders {own_stiffness:.5g} N/m at its reference, {within} this interval"
        )
    return said


def _shares_of_others(
    responses: Sequence[Response], sweeps: Sequence[SweepBlocks], length: int, period: float
) -> list[float]:
    """Share of each sweep's motion that the response of the one before predicts; [] of a single sweep.

    length  of the blocks that are transformed at once [samples];   period  [s]
    """
    if len(sweeps) == 1:
        return []
    before = [responses[-1], *responses[:-1]]
    return [_share_explained(one, sweep, length, period) for one, sweep in zip(before, sweeps, strict=True)]


def _validated_on(sweeps: int, once: bool) -> str:
    """Which motion the share that is explained belongs to, in words.

    sweeps  how many there are;   once  each frequency is there at one time only
    """
    where = "at the frequencies that can be relied on"
    if once and sweeps == 1:
        return "nothing: the sweep has each frequency at one time only"
    if once:
        return f"the acceleration in each of the {sweeps} sweeps by the response of another one, {where}"
    last = f"the last third of each of the {sweeps} sweeps" if sweeps > 1 else "the last third of the sweep"
    return f"the acceleration in {last}, {where}"


def _share_explained(response: Response, unseen: SweepBlocks, length: int, period: float) -> float:
    """Share of the unseen acceleration's power that the response predicts from the force, where it is reliable.

    Of the motion itself low frequencies alone would count, at which a free device moves most. The position is
    differenced twice, and both are weighted by a Hann window, since a device that drifts leaks.

    length  of the blocks that are transformed at once, at most [samples];   period  of the loop [s]
    """
    differences = 2  # of the position
    assert response.coherence is not None
    good = response.coherence >= LEAST_COHERENCE
    known, value = response.frequency[good], response.value[good]
    shifted = value * (np.exp(2j * np.pi * known * period) - 1.0) ** differences
    missed = total = 0.0
    for force, position in unseen.blocks(min(length, len(unseen))):
        moved = np.diff(position, n=differences)
        window = np.hanning(len(moved))
        U, Y = np.fft.rfft(force[: len(moved)] * window), np.fft.rfft(moved * window)
        f = np.fft.rfftfreq(len(moved), period)
        # 0.99: between two frequencies that are both reliable
        inside = (f >= known[0]) & (f <= known[-1]) & (np.interp(f, response.frequency, good) > 0.99)
        predicted = np.interp(f, known, shifted.real) + 1j * np.interp(f, known, shifted.imag)
        missed += float(np.sum(np.abs(Y - predicted * U)[inside] ** 2))
        total += float(np.sum(np.abs(Y[inside]) ** 2))
    return 1.0 - missed / total


def _response_columns(responses: Sequence[Response]) -> dict[str, Any]:
    """The columns of a file that a [response] reads."""
    parts = [(one.frequency, one.value, one.coherence) for one in responses]
    columns = {
        "frequency_Hz": np.concatenate([f for f, _, _ in parts]),
        "real_m_per_N": np.concatenate([v.real for _, v, _ in parts]),
        "imag_m_per_N": np.concatenate([v.imag for _, v, _ in parts]),
        "coherence": np.concatenate([np.ones_like(f) if c is None else c for f, _, c in parts]),
    }
    if len(parts) > 1:
        columns["sweep"] = np.repeat(np.arange(1.0, len(parts) + 1), [len(f) for f, _, _ in parts])
    return columns


FEWEST: Final = 8  # coherent frequencies
ALIKE: Final = 0.8  # share of them at which the response must be off by the same factor
PREDICTED: Final = 0.5  # share of the unseen acceleration, below which a reader is warned


def check_responses(
    device: Device, responses: Sequence[Response], labels: Sequence[str], names: tuple[str, str]
) -> list[Check]:
    """Whether force and position are in their columns, in their units, and turned alike in all sweeps; []
    where too few frequencies are coherent.

    responses  of each sweep;   labels  of their records;   names  of the columns of force and position
    """
    first = responses[0]
    good = _coherent(first)
    f, size = first.frequency[good], np.abs(first.value[good])
    if len(f) < FEWEST:
        return []
    # lines lie evenly over f: with these weights each octave counts alike
    slope = float(np.polyfit(np.log(f), np.log(size), 1, w=1.0 / np.sqrt(f))[0])
    checks = [order_check(slope, float(f[-1] / f[0]), names), *_check_units(device, f, size)]
    if len(responses) > 1:
        checks += _check_copies(responses, labels)
        checks.append(
            flip_check([(label, _times_as_far(first, r)) for r, label in zip(responses, labels, strict=True)])
        )
    return checks


def _check_copies(responses: Sequence[Response], labels: Sequence[str]) -> list[Check]:
    """Fail where a sweep is another one again, to the last digit; [] where none is."""
    seen = dict[bytes, int]()
    for number, response in enumerate(responses):
        before = seen.setdefault(response.value.tobytes(), number)
        if before != number:
            text = (
                f"sweep {number + 1} ({labels[number]}) is sweep {before + 1} again; a copy does not show how far "
                "sweeps differ: measure again, or give it once"
            )
            return [Check("copies", False, text)]
    return []


def _coherent(response: Response) -> Flags:
    """Which frequencies (n,) of a response can be relied on."""
    assert response.coherence is not None
    return (response.coherence >= LEAST_COHERENCE) & (np.abs(response.value) > 0.0) & (response.frequency > 0.0)


def _times_as_far(first: Response, other: Response) -> float:
    """How many times as far a sweep moves as the first response says, median of the coherent frequencies;
    1 where there is none."""
    grid, known = other.frequency, _coherent(first)
    P = np.interp(grid, first.frequency[known], first.value[known])
    good = _coherent(other) & (np.abs(P) > 0.0)
    return float(np.median(np.real(other.value[good] / P[good]))) if good.any() else 1.0


def _check_units(device: Device, f: Floats, size: Floats) -> list[Check]:
    """Check that the response's magnitude (n,) [m/N], at frequencies f (n,) [Hz], is not off by the factor of a
    unit from that of the file's model; [] where it is not."""
    if device.response is not None or device.missing:
        return []
    loop = device.at().loop
    theta = np.minimum(2.0 * np.pi * f * loop.period, np.pi)
    times = size / np.abs(sampled_response(loop, theta))
    for factor, unit in FACTORS_LINEAR.items():
        # NEAR^2: each frequency by itself differs more than a median
        if np.mean(np.maximum(times / factor, factor / times) < NEAR**2) > ALIKE:
            what = f"is the position in {unit}" if unit.endswith("s") else f"is {unit}"
            reason = f"the response is {np.median(times):.4g} times that of the device file: {what}?"
            return [Check("units", False, f"{reason} Columns are in N and m.")]
    return []


def check_prediction(share: float) -> list[Check]:
    """Whether the response holds for the part of the record that it is not made of; [] where it does.

    share  of the acceleration there that it predicts; nan: there is none
    """
    if np.isnan(share):
        text = (
            "the first two thirds of the record have other frequencies than the last, as in a single sweep: all "
            "of it is fitted, and nothing is left to be predicted; record the sweep twice, in one file or in two"
        )
        return [Check("validation", False, text, warning=True)]
    if share > PREDICTED:
        return []
    if share > 0.0:
        text = (
            f"only {100.0 * share:.3g} % of the unseen acceleration is predicted: noise, friction, or a device "
            "that changes; record longer, with more force"
        )
        return [Check("validation", False, text, warning=True)]
    text = (
        "nothing of the unseen acceleration is predicted: the last third of the record is not of the device that "
        "the first two are of; has a sign flipped, a column stood still, or something been moved in between?"
    )
    return [Check("validation", False, text)]


FIRST: Final = 2**20  # samples from which the encoder's step is read


@dataclass(frozen=True)
class SweepBlocks:
    """Force and position of a record, from one row to the one before another.

    force, position  names of the columns
    """

    record: Record
    force: str
    position: str
    first: int
    behind: int

    @classmethod
    def longest(cls, record: Record, sampling: SampleTimes, force: str, position: str) -> SweepBlocks:
        """The longest stretch of a record."""
        runs = sampling.runs.tolist()
        first, behind = max(runs, key=lambda run: run[1] - run[0], default=(0, 0))
        return cls(record, force, position, first, behind)

    def __len__(self) -> int:
        return self.behind - self.first

    def part(self, first: int, behind: int) -> SweepBlocks:
        """The samples from number `first` to the one before `behind`."""
        return SweepBlocks(self.record, self.force, self.position, self.first + first, self.first + behind)

    def pieces(self) -> Iterator[Floats]:
        """Force and position (2, n), as the record is cut into pieces."""
        row = 0
        for piece in self.record.pieces():
            inside = slice(max(self.first - row, 0), max(self.behind - row, 0))
            row += len(piece[self.force])
            values = np.array([piece[self.force][inside], piece[self.position][inside]])
            if values.shape[1]:
                yield values
            if row >= self.behind:
                return

    def blocks(self, length: int) -> Iterator[tuple[Floats, Floats]]:
        """Force and position in blocks of one length, however the record is cut into pieces; what is left over at
        the end is left out."""
        block, filled = np.empty((2, length)), 0  # force and position of the next block, and how many of them
        for values in self.pieces():
            used = 0
            while used < values.shape[1]:
                part = values[:, used : used + length - filled]
                block[:, filled : filled + part.shape[1]] = part
                used, filled = used + part.shape[1], filled + part.shape[1]
                if filled == length:
                    yield block[0], block[1]
                    block, filled = np.empty((2, length)), 0


@dataclass(frozen=True)
class SweepRange:
    """Values that the samples of a sweep take.

    force, position    smallest and largest [N], [m]
    at_largest, at_smallest  samples at the largest and at the smallest force
    levels             different forces among the first samples
    step               of the encoder, read off the first samples; 0 where none shows
    """

    force: tuple[float, float]
    position: tuple[float, float]
    at_largest: int
    at_smallest: int
    levels: int
    step: float

    @classmethod
    def of(cls, sweep: SweepBlocks, first_levels: int) -> SweepRange:
        """Read a sweep; its encoder step is that of its first `FIRST` samples.

        first_levels  samples among which levels are counted
        """
        force, position = next(sweep.blocks(min(len(sweep), FIRST)))
        step = encoder_step([position])
        levels = len(np.unique(force[:first_levels]))
        # (2,) of force and position; and samples at the least and the largest force
        low, high, at_low, at_high = np.full(2, np.inf), np.full(2, -np.inf), 0, 0
        for values in sweep.pieces():
            least, most = np.minimum(low, np.min(values, axis=1)), np.maximum(high, np.max(values, axis=1))
            # those counted before are at the extreme only where it has stayed
            at_low = (at_low if low[0] == least[0] else 0) + int(np.sum(values[0] == least[0]))
            at_high = (at_high if high[0] == most[0] else 0) + int(np.sum(values[0] == most[0]))
            low, high = least, most
        force_and_position = list(zip(low.tolist(), high.tolist(), strict=True))
        return cls(force_and_position[0], force_and_position[1], at_high, at_low, levels, step)


SEGMENTS: Final = 8  # in the shorter part, whose spectra are averaged


def shared_excitation(sweep: SweepBlocks, cut: int) -> float:
    """`shared_power` of the force in both parts of a sweep, by averaged Hann-windowed segments.

    Of noise about 0.8; of one chirp that goes up, nearly 0.

    cut  first sample of the second part
    """
    length = max(min(cut, len(sweep) - cut) // SEGMENTS, 1)
    parts = [_spectrum(part, length) for part in (sweep.part(0, cut), sweep.part(cut, len(sweep)))]
    return shared_power(*parts)


def _spectrum(sweep: SweepBlocks, length: int) -> Floats:
    """Power spectra (k,) of the force without its mean, summed over windowed segments of `length` samples."""
    window, total = np.hanning(length + 2)[1:-1], np.zeros(length // 2 + 1)
    for force, _ in sweep.blocks(length):
        total += np.abs(np.fft.rfft(window * (force - np.mean(force)))) ** 2
    return total


LEAST_SHARED: Final = 0.2  # of the power, from which on one part tells of the other


def shared_power(first: Floats, second: Floats) -> float:
    """Share of two spectra (k,) of power that both have: the sum of the smaller one, each of sum 1; 0 if one is 0.

    >>> shared_power(np.array([1.0, 1.0, 0.0]), np.array([0.0, 4.0, 4.0]))
    0.5
    """
    sums = float(np.sum(first)), float(np.sum(second))
    return float(np.sum(np.minimum(first / sums[0], second / sums[1]))) if min(sums) > 0.0 else 0.0
