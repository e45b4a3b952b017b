"""Averaged spectra of long records, segment by segment, in a memory that does not grow with the record."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.identify.records.record import Piece

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

    stretches    each with its channels as columns (n,)
    differences  channels, and how often each is differenced: a position that drifts leaks into every line
    """
    names = tuple(differences)
    order = tuple(differences.values())
    sums = _Sums(len(names), length)
    for stretch in stretches:
        sums.add([stretch[name] for name in names], order)
    usable = slice(2, None)
    n = max(sums.count, 1)
    frequency = np.arange(length // 2 + 1) / (length * period)
    matrix: Complexes = np.asarray(sums.matrix[usable] / n, dtype=np.complex128)
    return Spectra(frequency[usable], matrix, names, period, length, sums.count, order)


def merged(several: Sequence[Spectra]) -> Spectra:
    """Spectra of records together, of the same channels, period and length."""
    first, count = several[0], sum(one.segments for one in several)
    total = sum((one.matrix * one.segments for one in several), np.zeros_like(first.matrix))
    return replace(first, matrix=total / max(count, 1), segments=count)


class _Sums:
    """Running sums of the spectra of segments."""

    def __init__(self, channels: int, length: int) -> None:
        self.matrix: Complexes = np.zeros((length // 2 + 1, channels, channels), dtype=np.complex128)
        self.count, self.length = 0, length
        self._window = np.hanning(length + 1)[:-1]

    def add(self, values: Sequence[Floats], order: Sequence[int]) -> None:
        """Add the segments of channels (c, n)."""
        L, hop = self.length, self.length // 2
        n = len(values[0]) - max(order, default=0)
        if n < L:
            return
        count = 1 + (n - L) // hop
        moved = [np.diff(row, n=m)[:n] for row, m in zip(values, order, strict=True)]
        several = max(1, BATCH // (L * len(order)))
        for first in range(0, count, several):
            starts = range(first, min(first + several, count))
            spectra = [self._transform(row, starts) for row in moved]
            for a, one in enumerate(spectra):
                for b in range(a, len(spectra)):
                    product = np.einsum("sk,sk->k", one, np.conj(spectra[b]))
                    self.matrix[:, a, b] += product
                    if a != b:
                        self.matrix[:, b, a] += np.conj(product)
        self.count += count

    def _transform(self, row: Floats, starts: range) -> Complexes:
        from scipy.fft import rfft

        L, hop = self.length, self.length // 2
        part = row[starts[0] * hop : starts[-1] * hop + L]
        segments = np.lib.stride_tricks.sliding_window_view(part, L)[::hop]
        centred = segments - segments.mean(axis=1, keepdims=True)
        return np.asarray(rfft(centred * self._window, axis=1))
