"""Sums over long records from which a response is fitted by local polynomials, in a memory that does not grow.

The transform of a segment of samples, without a taper, is Y = G U + C: the response G to what was sent, and C,
what the state at both ends of the segment adds. Over a few neighbouring frequencies both are polynomials (local
polynomial method: Pintelon and Schoukens, System Identification, 2nd ed., ch. 7, known at second hand). G is the
same in each segment and C is not; so each segment's C is projected out, and the products of what remains are
summed. Of 9 frequencies with polynomials of second order each segment keeps 6 values, and nothing leaks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.identify.records.record import Piece
from zwidth.identify.records.sampling import joined
from zwidth.model.local_polynomials import ORDER

HALF: Final = 4  # of a window, in spacings of the transform
STRIDE: Final = 2  # spacings from one window to the next
TERMS: Final = ORDER + 1
KEPT: Final = 2 * HALF + 1 - TERMS  # values that a segment keeps of a window
DIFFERENCES: Final = 2  # of the position: a free device's response to a force is then flat, and it does not drift
LONGEST: Final = 1 << 17  # samples of a segment
BATCH: Final = 1 << 21  # samples that are transformed at once
WINDOWS: Final = 1 << 14  # that are multiplied at once


@dataclass(frozen=True)
class LocalSpectra:
    """Products of force u and position y, differenced twice, in windows of neighbouring frequencies.

    frequency  (n,) [Hz], of the windows' middles
    gram       (n, 6, 6) sums of conj(a) b over frequencies and segments, less each segment's own polynomial;
               a and b run over u, u r, u r^2, y, y r, y r^2, with r from -1 to 1 over the window
    period     sampling period [s]
    length     samples of a segment
    segments   that were summed
    """

    frequency: Floats
    gram: Complexes
    period: float
    length: int
    segments: int

    @property
    def values(self) -> int:
        """Complex values that all segments keep of a window."""
        return KEPT * self.segments

    @property
    def freedom(self) -> int:
        """Complex values beyond the response's coefficients, `values` less these: those that tell the noise."""
        return self.values - TERMS

    @property
    def differencing(self) -> Complexes:
        """(z - 1)^2 (n,), what the differences make of a position."""
        return np.asarray((np.exp(2j * np.pi * self.frequency * self.period) - 1.0) ** DIFFERENCES)

    def power(self, channel: int) -> Floats:
        """Mean square (n,) of force (0) or differenced position (1), per frequency and segment."""
        at = TERMS * channel
        return np.asarray(self.gram[:, at, at].real / max(self.values, 1))

    def fit(self, into: int, out: int) -> tuple[Complexes, Floats]:
        """Coefficients (n, 3) of the response from one channel to the other by least squares, in powers of r, and
        the variance (n,) of the complex error of the first, which is the response at the middle.

        The noise is taken to be that of `out`; any in `into` makes the response too small.
        """
        # rows u, u r, u r^2 of one channel, and the value itself of the other
        inputs, output = slice(TERMS * into, TERMS * (into + 1)), TERMS * out
        normal, right = self.gram[:, inputs, inputs], self.gram[:, inputs, output]
        size = np.sqrt(np.maximum(np.einsum("nii->ni", normal).real, 1e-300))
        scaled = normal / (size[:, :, None] * size[:, None, :]) + 1e-12 * np.eye(TERMS)
        inverse = np.linalg.inv(scaled) / (size[:, :, None] * size[:, None, :])
        coefficients = np.einsum("nij,nj->ni", inverse, right)
        remainder = self.gram[:, output, output].real - np.einsum("ni,ni->n", np.conj(right), coefficients).real
        variance = np.maximum(remainder, 0.0) / max(self.freedom, 1) * inverse[:, 0, 0].real
        return np.asarray(coefficients), np.asarray(variance)

    def squares_left_by(self, coefficients: Complexes) -> Floats:
        """Sum of squares (n,) of the position that a response (n, 3) from force to position, in powers of r,
        leaves unexplained."""
        row = np.concatenate([-coefficients, np.ones((len(coefficients), 1))], axis=1)
        gram = self.gram[:, : TERMS + 1, : TERMS + 1]  # of u, u r, u r^2 and y
        return np.asarray(np.einsum("ni,nij,nj->n", np.conj(row), gram, row).real)


@cache
def _projections() -> Floats:
    """Matrix (9, 18) from the values u of a window to those that a segment keeps of u r^p, 6 for each power p."""
    r = np.arange(-HALF, HALF + 1) / HALF
    powers = r[:, None] ** np.arange(TERMS)
    kept = np.linalg.qr(powers, mode="complete")[0][:, TERMS:]  # orthogonal to polynomials, such as C
    return np.asarray((powers[:, :, None] * kept[:, None, :]).reshape(len(r), -1))


@cache
def correlations() -> Floats:
    """Correlation (m,) of the errors of windows 0, 1, ... strides apart, for a force of random phases.

    The estimate at a window is sum_rs conj(u_r) a_r P_rs e_s, with P the projection and a the row of the inverse
    equations; two of them share products of force and noise.
    """
    r = np.arange(-HALF, HALF + 1) / HALF
    powers = r[:, None] ** np.arange(TERMS)
    q = np.linalg.qr(powers)[0]
    P = np.eye(len(r)) - q @ q.T  # takes the polynomials out
    M = powers.T @ (np.diag(P)[:, None] * powers)  # normal equations, in the mean
    A = (powers @ np.linalg.inv(M)[0])[:, None] * P
    n = len(r)
    shared = [float(np.sum(A[d:, d:] * A[: n - d, : n - d])) for d in range(0, n, STRIDE)]
    return np.array(shared) / shared[0]


def windows_per_independent_one() -> float:
    """How many of the windows, whose errors go together, count as one independent one in sums over many."""
    return float(2.0 * np.sum(correlations()) - 1.0)


def local_spectra(stretches: Iterable[Piece], period: float, length: int, names: tuple[str, str]) -> LocalSpectra:
    """Sums over the segments of `length` samples that fit into pieces of a record, end to end, none across a gap.

    stretches  pieces with a column "sample" that numbers the samples, as `SampleTimes.stretches` makes them
    period     of the samples [s];   names  of the columns of force and position
    """
    count = max((length // 2 - 2 * HALF) // STRIDE, 0)
    middles = 1 + HALF + STRIDE * np.arange(count)
    gram: Complexes = np.zeros((count, 2 * TERMS, 2 * TERMS), dtype=np.complex128)
    segments = 0
    samples = np.empty((2, 0))  # force and position that are in no segment yet
    for piece, goes_on in joined(stretches):
        values = np.array([piece[name] for name in names])
        samples = np.concatenate([samples, values], axis=1) if goes_on else values
        complete = (samples.shape[1] - DIFFERENCES) // length
        several = max(1, BATCH // (2 * length))
        for first in range(0, complete, several):
            last = min(first + several, complete)
            _add_products(gram, samples[:, first * length : last * length + DIFFERENCES], length)
        segments += max(complete, 0)
        samples = samples[:, max(complete, 0) * length :]
    return LocalSpectra(middles / (length * period), gram, period, length, segments)


def _add_products(gram: Complexes, values: Floats, length: int) -> None:
    """Add to `LocalSpectra.gram` the products of segments end to end, force and position (2, count length + 2)."""
    from scipy.fft import rfft

    force = values[0, :-DIFFERENCES].reshape(-1, length)
    position = np.diff(values[1], n=DIFFERENCES).reshape(-1, length)
    U, Y = rfft(force, axis=1), rfft(position, axis=1)
    projections = _projections().astype(complex)
    for first in range(0, len(gram), WINDOWS):
        count = min(WINDOWS, len(gram) - first)
        start = 1 + STRIDE * first
        span = slice(start, start + STRIDE * (count - 1) + 2 * HALF + 1)
        for u, y in zip(U[:, span], Y[:, span], strict=True):
            kept_values = [_kept_values(one, projections) for one in (u, y)]
            rows = np.concatenate(kept_values, axis=1)
            gram[first : first + count] += np.conj(rows) @ np.swapaxes(rows, 1, 2)


def _kept_values(values: Complexes, projections: Complexes) -> Complexes:
    """What a segment keeps (n, 3, 6) of its windows, 6 values for each power of r, by the matrix
    `_projections`."""
    # copied: a product with overlapping rows is ten times slower
    windows = np.ascontiguousarray(np.lib.stride_tricks.sliding_window_view(values, 2 * HALF + 1)[::STRIDE])
    return np.asarray((windows @ projections).reshape(-1, TERMS, KEPT))


def sums_segment_length(samples: int, segment: int | None = None) -> int:
    """The length of segments for a run of so many samples, a third of it or less, or what is given.

    The longer they are, the better a response that turns is followed; a segment is known better than it seems, as
    each keeps 6 values of a window. Of three, the last is left for the validation.
    """
    if segment is not None:
        return max(min(segment, samples), 2)
    from scipy.fft import prev_fast_len

    third = max((samples - 3 * DIFFERENCES) // 3, 2)
    return min(int(prev_fast_len(third, real=True)), LONGEST)


def merged_sums(several: Sequence[LocalSpectra]) -> LocalSpectra:
    """The sums of several records as one, of the same period and length."""
    gram = sum((one.gram for one in several), np.zeros_like(several[0].gram))
    return replace(several[0], gram=gram, segments=sum(one.segments for one in several))
