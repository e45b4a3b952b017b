"""What one reading of the records shows: averaged spectra, levels, and where they are excited.

Spectra are averaged segment by segment, in a memory that does not grow with the record. A force that repeats has a
period; the lines that it does not excite tell of friction and backlash.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.identify.modes.stretches import BLOCK, Levels, Source
from zwidth.identify.records.record import Piece
from zwidth.progress import Progress

UNSEEN: Final = 4  # a fourth of the data is for the validation
COVERED: Final = 0.3  # share of a band's power that the fitted part must have
LONGEST_SEGMENT: Final = 1 << 16  # samples, where nothing is said
COHERENT: Final = 0.3  # coherence above which a response says something


@dataclass(frozen=True)
class Survey:
    """What one reading of all records shows.

    spectra   averaged over all of them;   levels  of each
    loudest   record and number of the stretch with the largest force;   longest  stretch of all [samples]
    covered   whether the first three fourths of each stretch, or of the stretches, are excited wherever the rest
              is
    agreement  what each stretch is, and how many times as far it moves as the first one's response says
    period    of the force [samples]; 0 where it is not periodic
    """

    spectra: Spectra
    levels: list[Levels]
    loudest: tuple[int, int]
    longest: int
    stretches: int
    covered: bool
    agreement: list[tuple[str, float]]
    period: int


def survey_of(sources: Sequence[Source], segment: int | None, progress: Progress | None) -> Survey:
    """Read all records once.

    segment  samples in a segment of the averaged spectra; None: 15 in the longest stretch, or the force's period,
             but LONGEST_SEGMENT at most
    """
    longest = max((min(one.sampling.longest, BLOCK) for one in sources), default=0)
    first = next((one.first() for one in sources if one.first() is not None), None)
    period = 0 if first is None else period_of(first.force)
    # the force's period where it has 64 samples or more and four of it fit
    length = segment_length(longest, segment or (period if 64 <= period <= longest // 4 else None))
    length = min(length, LONGEST_SEGMENT) if segment is None else length
    differences = {"force": 0, "position": 2} | ({"reference": 0} if sources[0].channels.reference else {})
    levels, loudest, done = [Levels() for _ in sources], (-1.0, 0, 0), 0  # loudest: size, record, stretch
    powers, agreement = list[Floats](), list[tuple[str, float]]()
    first_spectra = total = averaged_spectra([], sources[0].sampling.period, length, differences)
    for k, source in enumerate(sources):
        for i, stretch in enumerate(source.stretches()):
            levels[k].add(stretch)
            size = float(np.std(stretch.force)) * np.sqrt(len(stretch.force))
            loudest = max(loudest, (size, k, i))
            powers.append(_band_powers(stretch.force, longest))
            columns = {name: value for name, value in stretch._asdict().items() if value is not None}
            own = averaged_spectra([columns], source.sampling.period, length, differences)
            if own.segments:
                first_spectra = first_spectra if first_spectra.segments else own
                total = merged_spectra([total, own])
                agreement.append((f"stretch {i + 1} of {source.record.label}", _times_as_far(first_spectra, own)))
            done += len(stretch.force)
            if progress is not None:
                progress("reading records", done, sum(one.sampling.rows for one in sources))
    covered = _fit_part_covers(powers)
    return Survey(total, levels, loudest[1:], longest, len(powers), covered, agreement, period)


def _times_as_far(first: Spectra, other: Spectra) -> float:
    """How many times as far a stretch (other) moves as the first one's response says, where both have force; 1
    where that is nowhere."""
    into = "reference" if "reference" in first.channels else "force"
    response = first.response(into, "position") * (first.z - 1.0) ** 2
    known = first.coherence(into, "position") > COHERENT
    weight = known * other.power(into)
    moved = np.sum(np.real(np.conj(response) * other.of("position", into)) * known)
    return float(moved / max(float(np.sum(np.abs(response) ** 2 * weight)), 1e-300)) if known.any() else 1.0


def _band_powers(force: Floats, longest: int) -> Floats:
    """Power of the force in bands of equal width in logarithms (2, 12): of the first three fourths, and the last.

    longest  stretch of all [samples]: the lowest band has sixteen lines of its last fourth
    """
    cut = len(force) - len(force) // UNSEEN
    edges = np.geomspace(min(16.0 * UNSEEN / longest, 0.1), 0.5, 13)
    rows = []
    for part in (force[:cut], force[cut:]):
        power = np.abs(np.fft.rfft(part - part.mean())) ** 2 / len(part)
        frequency = np.fft.rfftfreq(len(part))
        rows.append(np.histogram(frequency, edges, weights=power)[0])
    return np.array(rows)


def _fit_part_covers(powers: Sequence[Floats]) -> bool:
    """Whether the fitted part has its share of the force's power in every band of frequencies that is excited.

    Fitted are the first parts: of the stretches where there are many (2 UNSEEN), else of each; the rest is for the
    validation.

    powers  `_band_powers` of each stretch: (2, 12), its first part and its last one
    """
    if not powers:
        return False
    if len(powers) >= 2 * UNSEEN:
        cut = len(powers) - len(powers) // UNSEEN
        fitted = np.sum([power.sum(axis=0) for power in powers[:cut]], axis=0)
        total = np.sum([power.sum(axis=0) for power in powers], axis=0)
    else:
        fitted = np.sum([power[0] for power in powers], axis=0)
        total = np.sum([power.sum(axis=0) for power in powers], axis=0)
    # bands that are excited
    counted = total > 1e-4 * np.max(total)
    return bool(np.all(fitted[counted] >= COVERED * total[counted]))


def peak_poles(spectra: Spectra) -> Complexes:
    """Poles (p,) [1/s], the upper one of each pair, that at most eight peaks of the averaged response show, each
    as wide as its peak, or as a segment's line.
    """
    from scipy.signal import find_peaks

    value = spectra.response("force", "position") * (spectra.z - 1.0) ** 2
    coherence = spectra.coherence("force", "position")
    size = np.log(np.maximum(np.abs(value), 1e-300))
    size = np.where(coherence > COHERENT, size, size[coherence > COHERENT].min(initial=0.0))
    # 0.7 of a logarithm: peaks twice as high as what is beside them
    lines, properties = find_peaks(size, prominence=0.7, width=1, rel_height=0.5)
    order = np.argsort(properties["prominences"])[::-1][:8]
    step = 1.0 / (spectra.length * spectra.period)
    f, width = spectra.frequency[lines[order]], np.maximum(properties["widths"][order], 1.0) * step
    # half of what a pole with a peak of this width at half power has: at half the prominence of a logarithm a
    # peak is wider
    return np.asarray(-np.pi * np.minimum(width, 0.2 * f) * 0.5 + 2j * np.pi * f)


SAME: Final = 1e-4  # power of the difference to a period before, over that of the force, that is none
FEWEST_PERIODS: Final = 3  # of a force that is called periodic
SEARCHED: Final = 1 << 18  # samples in which a period is looked for
LINE: Final = 1e-4  # power of a line, over the largest, that is excited
CLEAR: Final = 3.0  # times its noise, that a line's mean is there


def period_of(force: Floats) -> int:
    """The period of a force [samples]; 0 where it does not repeat, or fewer than `FEWEST_PERIODS` times.

    The first lag at which the autocorrelation is that of an equal signal, and the difference to one period before
    is almost nothing.
    """
    u = force[:SEARCHED] - np.mean(force[:SEARCHED])
    n = len(u)
    power = float(np.mean(u**2))
    if power == 0.0:
        return 0
    spectrum = np.abs(np.fft.rfft(u, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: n // 2] / (n - np.arange(n // 2)) / power
    rises = (
        np.flatnonzero(
            (correlation[1:-1] > 0.95)
            & (correlation[1:-1] >= correlation[:-2])
            & (correlation[1:-1] >= correlation[2:])
        )
        + 1
    )
    # a period of fewer than 16 samples is no multisine's
    for lag in rises[:50]:
        if lag >= 16 and np.mean((u[lag:] - u[:-lag]) ** 2) < SAME * power:
            return int(lag) if n >= FEWEST_PERIODS * lag else 0
    return 0


def periodic_lines(period: int, source: Source, details: dict[str, Any]) -> list[str]:
    """What the periods say beside the response: remarks, and numbers in `details`; [] of too few periods.

    Coherence compares periods with each other, so that what repeats in each of them, a nonlinearity's answer,
    looks like the device. A multisine of odd harmonics shows it: at even lines the position has what an even
    nonlinearity makes, at odd lines that were left out what an odd one makes, friction or saturation.
    """
    first = source.first()
    if not period or first is None:
        return []
    count = len(first.force) // period
    if count < FEWEST_PERIODS:
        return []
    kept = count - 1  # the first period is that of the transient
    U, Y = (
        _period_transforms(values, period, kept)
        for values in (first.force, np.diff(first.position - first.position[0], n=2))
    )
    power = np.abs(U.mean(axis=0)) ** 2
    excited = power > LINE * np.max(power[1:])
    excited[0] = False
    lines = np.flatnonzero(excited)
    details["period_samples"] = period
    if len(lines) < 4:
        return [f"the force repeats every {period} samples, with {len(lines)} lines"]
    mean, scatter = Y.mean(axis=0), Y.std(axis=0, ddof=1) / np.sqrt(len(Y))
    inside = np.arange(len(power)) <= lines[-1]
    inside &= np.arange(len(power)) >= lines[0]
    if len(lines) == np.count_nonzero(inside):
        text = (
            f"the force repeats every {period} samples and excites each line: what a nonlinearity makes is not "
            "told from the device; leave out even lines, and one odd line in four, to see it"
        )
        return [text]
    remark = f"the force repeats every {period} samples and excites {len(lines)} lines"
    return [remark, *_distortion_remarks(mean, scatter, excited, inside, details)]


def _distortion_remarks(
    mean: Complexes, scatter: Floats, excited: Flags, inside: Flags, details: dict[str, Any]
) -> list[str]:
    """Say of even and of odd lines that were not excited whether the position moves there beyond noise.

    mean, scatter    (n,) of the position's transform over the periods, and the mean's standard deviation
    excited, inside  (n,) lines with force, and lines from the first of these to the last
    details          gets their share of the motion at the excited lines
    Returns          a remark on each kind that was left out
    """
    odd = np.arange(len(excited)) % 2 == 1
    remarks = list[str]()
    names = {
        "even": "a stiffness or friction that differs with the sign",
        "odd": "friction, backlash or saturation",
    }
    for name, parity in (("even", ~odd), ("odd", odd)):
        unexcited = inside & ~excited & parity
        if not unexcited.any():
            continue
        level, noise = (
            float(np.sqrt(np.mean(np.abs(mean[unexcited]) ** 2))),
            float(np.sqrt(np.mean(np.abs(scatter[unexcited]) ** 2))),
        )
        excited_level = float(np.sqrt(np.mean(np.abs(mean[excited]) ** 2)))
        details[f"{name}_distortion"] = float(np.sqrt(max(level**2 - noise**2, 0.0))) / excited_level
        if level > CLEAR * noise:
            remarks.append(
                f"{name} lines that were not excited move {100.0 * details[f'{name}_distortion']:.2g} % as "
                f"much as the excited ones, {level / noise:.2g} times their noise: {names[name]}, which the "
                "coherence does not show"
            )
        else:
            remarks.append(f"{name} lines that were not excited hold noise alone")
    return remarks


def _period_transforms(values: Floats, period: int, count: int) -> Complexes:
    """Transforms (k, n) of the last k whole periods [samples] of a signal, `count` of them at most."""
    last = values[len(values) - count * period :] if len(values) >= count * period else values
    whole = len(last) // period
    return np.asarray(np.fft.rfft(last[len(last) - whole * period :].reshape(whole, period), axis=1))


SHARED: Final = 1.0 / 36.0  # squared correlation of two Hann segments that share a half (Welch 1967)
BATCH: Final = 1 << 21  # samples that are transformed at once
FEWEST_SEGMENTS: Final = 15  # that overlap by half, where no length is given
SHORTEST: Final = 64  # samples of a segment


@dataclass(frozen=True)
class Spectra:
    """Averaged auto- and cross-spectra of the channels of a record.

    frequency  (n,) [Hz], of the segment's lines above the first, which the mean is mixed into
    matrix     (n, c, c) mean of X_a conj(X_b); Hermitian; in the channels' units squared, not per Hz
    channels   (c,) their names
    period     sampling period [s]
    length     samples of a segment
    segments   that were averaged, of all runs
    differences  how often each channel was differenced beforehand (c,)
    """

    frequency: Floats
    matrix: Complexes
    channels: tuple[str, ...]
    period: float
    length: int
    segments: int
    differences: tuple[int, ...]

    @property
    def averages(self) -> float:
        """Independent averages to which overlapping segments amount: K / (1 + 2 (K - 1)/K /36)."""
        K = max(self.segments, 1)
        return K / (1.0 + 2.0 * SHARED * (K - 1) / K)

    def of(self, a: str, b: str) -> Complexes:
        """S_ab (n,), mean of X_a conj(X_b)."""
        return np.asarray(self.matrix[:, self.channels.index(a), self.channels.index(b)])

    def power(self, a: str) -> Floats:
        """S_aa (n,)."""
        return np.asarray(self.of(a, a).real, dtype=np.float64)

    @cached_property
    def z(self) -> Complexes:
        """exp(2 pi i f T) (n,)."""
        return np.asarray(np.exp(2j * np.pi * self.frequency * self.period))

    def coherence(self, a: str, b: str) -> Floats:
        """|S_ab|^2 / (S_aa S_bb) (n,), 0 where a channel has no power."""
        product = self.power(a) * self.power(b)
        square = np.abs(self.of(a, b)) ** 2
        share = np.divide(square, product, out=np.zeros_like(square), where=product > 0.0)
        return np.asarray(np.clip(share, 0.0, 1.0))

    def response(self, into: str, out: str, estimator: str = "H1", reference: str = "") -> Complexes:
        """The response (n,) from channel `into` to channel `out`, differences undone.

        H1 = S_yu/S_uu        noise in the reading alone
        H2 = S_yy/S_uy        noise in the force alone
        Hv = least squares of both, in equal shares of their powers (Vold; known at second hand):
             sqrt(S_yy/S_uu) in magnitude, the phase of S_yu
        joint = S_yr/S_ur     noise that a loop feeds back from the reading to the force; needs a reference
        0 where a spectrum that divides is 0. Raises ValueError for another estimator.
        """
        u, y = self.power(into), self.power(out)
        cross = self.of(out, into)
        value: Complexes
        with np.errstate(divide="ignore", invalid="ignore"):
            if estimator == "H1":
                value = cross / u
            elif estimator == "H2":
                value = np.asarray(y / np.conj(cross))
            elif estimator == "Hv":
                value = np.sqrt(y / u) * cross / np.abs(cross)
            elif estimator == "joint":
                value = self.of(out, reference) / self.of(into, reference)
            else:
                raise ValueError(f"estimator must be H1, H2, Hv or joint, got {estimator!r}")
        undone = self.differences[self.channels.index(out)] - self.differences[self.channels.index(into)]
        return np.asarray(np.where(np.isfinite(value), value, 0.0) / (self.z - 1.0) ** undone)


def segment_length(samples: int, segment: int | None = None) -> int:
    """The length of segments for a run of so many samples: the power of two that makes 15 of them, which overlap
    by half, or what is given."""
    if segment is not None:
        return max(min(segment, samples), 2)
    return max(1 << int(np.log2(max(2.0 * samples / (FEWEST_SEGMENTS + 1), 1.0))), min(SHORTEST, samples))


def averaged_spectra(
    stretches: Iterable[Piece], period: float, length: int, differences: Mapping[str, int]
) -> Spectra:
    """Welch's averaged spectra of stretches of a record: Hann windows of `length` that overlap by half, each less
    its mean, none from one stretch into the next (Welch 1967).

    stretches    each with its channels as columns (n,), sampled every `period` [s]
    differences  channels, and how often each is differenced: a position that drifts leaks into every line
    """
    names = tuple(differences)
    order = tuple(differences.values())
    sums = _SpectraSums(len(names), length)
    for stretch in stretches:
        sums.add([stretch[name] for name in names], order)
    # without lines 0 and 1, into which a Hann window spreads the mean
    usable = slice(2, None)
    n = max(sums.count, 1)
    frequency = np.arange(length // 2 + 1) / (length * period)
    matrix: Complexes = np.asarray(sums.matrix[usable] / n, dtype=np.complex128)
    return Spectra(frequency[usable], matrix, names, period, length, sums.count, order)


def merged_spectra(several: Sequence[Spectra]) -> Spectra:
    """Mean spectra of several records, of the same channels, period and length, by their segments."""
    first, count = several[0], sum(one.segments for one in several)
    total = sum((one.matrix * one.segments for one in several), np.zeros_like(first.matrix))
    return replace(first, matrix=total / max(count, 1), segments=count)


class _SpectraSums:
    """Running sums of the auto- and cross-spectra of segments of `length` samples, see `Spectra.matrix`."""

    def __init__(self, channels: int, length: int) -> None:
        self.matrix: Complexes = np.zeros((length // 2 + 1, channels, channels), dtype=np.complex128)
        self.count, self.length = 0, length
        self._window = np.hanning(length + 1)[:-1]

    def add(self, values: Sequence[Floats], order: Sequence[int]) -> None:
        """Add the segments of channels (c, n), each differenced as often as `order` (c,) says."""
        length, hop = self.length, self.length // 2
        n = len(values[0]) - max(order, default=0)
        if n < length:
            return
        count = 1 + (n - length) // hop
        differenced = [np.diff(row, n=m)[:n] for row, m in zip(values, order, strict=True)]
        several = max(1, BATCH // (length * len(order)))
        for first in range(0, count, several):
            starts = range(first, min(first + several, count))
            spectra = [self._transform(row, starts) for row in differenced]
            for a, one in enumerate(spectra):
                for b in range(a, len(spectra)):
                    product = np.einsum("sk,sk->k", one, np.conj(spectra[b]))
                    self.matrix[:, a, b] += product
                    if a != b:
                        self.matrix[:, b, a] += np.conj(product)
        self.count += count

    def _transform(self, row: Floats, starts: range) -> Complexes:
        """Transforms (s, k) of the segments with numbers `starts` of a channel, less their mean, windowed."""
        from scipy.fft import rfft

        L, hop = self.length, self.length // 2
        part = row[starts[0] * hop : starts[-1] * hop + L]
        segments = np.lib.stride_tricks.sliding_window_view(part, L)[::hop]
        centred = segments - segments.mean(axis=1, keepdims=True)
        return np.asarray(rfft(centred * self._window, axis=1))
