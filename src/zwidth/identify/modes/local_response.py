"""The response of a record in narrow bands of frequency, without leakage, as numbers with a known covariance.

The discrete Fourier transform of a stretch of a record obeys, exactly and whatever the window's length,

    Y_k = P(z_k) U_k + T(z_k) + V_k,        z_k = exp(2 pi i k/n)

where T, the transient, stems from what the device did before the stretch and does after it, and is smooth where P
is (Pintelon and Schoukens 2012, known at second hand). The position is differenced twice beforehand, so that what
drifts is none of the transient's: (z - 1)^2 P and T are polynomials of degree 4 and 3 across a band that is narrow
beside its distance to the nearest pole. The transient is projected out in each stretch by itself; what remains is
five complex numbers per band with their information matrix, to which a model of P is fitted without loss. Errors
V_k at different k are independent, as no window is applied; so nothing has to be said about overlap.

Nearer to a pole than that, the lines are kept one by one, and the transient's own pole is projected out there.

Where a loop feeds the reading back (a centring spring), V correlates with U. The regressors are then replaced by
the reference in the normal equations, which is the ratio S_yr / S_ur in a band.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
from numpy.polynomial import legendre

from zwidth.arrays import Complexes, Flags, Floats, Ints

DEGREE, TRANSIENT = 4, 3  # of the polynomials in a band
SMOOTH: Final = 6  # degree of the transient's where lines are single: noise falls with their number's fourth power
TERMS: Final = DEGREE + 1
FEWEST: Final = TERMS + TRANSIENT + 1 + 7  # lines in a band: what is fitted, and seven more for the noise
NEAR: Final = 0.5  # width of a band, in shares of its distance to the nearest pole
WIDEST: Final = 0.15  # of its own frequency
OF_NYQUIST: Final = 0.02  # or of Nyquist's
WEAKEST: Final = 1e-9  # information, over a band's largest, below which it is none
LOWEST: Final = (
    128  # lines that are always kept one by one: a free device moves so far there that no polynomial does
)
BLOCK: Final = 64  # lines that share a transient where they are kept one by one
NODES: Final = np.cos((2 * np.arange(TERMS) + 1) * np.pi / (2 * TERMS))  # Chebyshev's, in a band from -1 to 1
TO_LEGENDRE: Final = np.linalg.inv(legendre.legvander(NODES, DEGREE))  # values there -> Legendre coefficients
NEIGHBOURS: Final = 300.0  # lines over which the noise is averaged
EXACT: Final = 1e-18  # of the power: what is taken for noise where a record has none
ALIKE: Final = 1e-6  # of a ringing column, what must be left of it beside the smooth ones
LEAST: Final = 1e-200  # so that a noise has a logarithm, also where a slope goes on below, and a column a length
CLEAR: Final = 4.0  # standard deviations beyond which the noise has a slope
STEEPEST: Final = 8.0  # power of the frequency with which noise goes on: that of a force moves a mass with f^-4
BELOW: Final = 1e-4  # of the lowest band's frequency: down to there the slope goes on


@dataclass(frozen=True)
class FrequencyBand:
    """Frequencies from `low` to `high` [Hz]; `single` where lines are kept one by one, about poles.

    poles   near the band, whose transients are projected out of single lines [1/s]
    search  whether the lines are single as long as poles are not known
    """

    low: float
    high: float
    single: bool = False
    poles: tuple[complex, ...] = ()
    search: bool = False

    @property
    def middle(self) -> float:
        """Middle of the band [Hz]."""
        return 0.5 * (self.low + self.high)


def bands(
    low: float, high: float, line: float, poles: Complexes, period: float, singles: float = 0.0
) -> list[FrequencyBand]:
    """Bands that cover low to high [Hz], each narrow beside its distance to the nearest pole.

    line     distance of two lines of the longest stretch [Hz]
    poles    in continuous time [1/s], of either sign of their imaginary part;   period  of the samples [s]
    singles  frequency [Hz] up to which lines are kept one by one, as poles are not known there yet; the lowest
             `LOWEST` lines always are
    """
    natural = np.abs(np.imag(poles)) / (2.0 * np.pi)
    nyquist = 0.5 / period
    folded = np.abs((natural + nyquist) % (2.0 * nyquist) - nyquist)
    width = np.abs(np.real(poles)) / (2.0 * np.pi)
    least = FEWEST * line

    def about(start: float, end: float, reach: float = 2.0 * BLOCK * line) -> tuple[complex, ...]:
        """Poles whose frequency, as sampling folds it, is within `reach` of start to end [Hz]."""
        return tuple(complex(p) for p, at_ in zip(poles, folded, strict=True) if start - reach < at_ < end + reach)

    edges = np.arange(low, min(max(singles, LOWEST * line), 0.5 * high), BLOCK * line)
    ends = edges + BLOCK * line
    laid = [
        FrequencyBand(float(a), float(b), True, about(a, b), singles > 0.0)
        for a, b in zip(edges, ends, strict=True)
    ]
    reached = laid[-1].high if laid else low
    # less than half a least band is left out at the top
    while reached < high - 0.5 * least:
        most = min(max(WIDEST * reached, least), max(OF_NYQUIST * nyquist, least))
        # poles here that are narrower than the least band, about which lines are kept one by one
        single = [
            i
            for i in range(len(natural))
            if width[i] < least / NEAR
            and folded[i] - least / NEAR < reached + least
            and folded[i] + least / NEAR > reached
        ]
        if single and len(natural):
            i = min(single, key=lambda i: abs(folded[i] - reached))
            end = min(folded[i] + least / NEAR, high)
            if end > reached:
                laid.append(FrequencyBand(reached, end, True, about(reached, end)))
                reached = end
                continue
        step = most  # shortened until the band is narrow beside its distance to the nearest pole
        for _ in range(20):
            middle = reached + 0.5 * step
            distance = float(np.min(np.hypot(folded - middle, width), initial=np.inf))
            if step <= max(NEAR * distance, least):
                break
            step = max(0.8 * step, least)
        laid.append(
            FrequencyBand(
                reached, min(reached + step, high), False, about(reached, min(reached + step, high), 2.0 * step)
            )
        )
        reached += step
    return laid


@dataclass
class BandSums:
    """Running sums of the normal equations of the bands (b, ...), over stretches.

    information, moment  (b, 5, 5), (b, 5): X^H X, X^H Y with the transient projected out; by a reference, Z^H X
    instruments          (b, 5, 5): Z^H Z; the information itself without a reference
    regressors, crossed  (b, 5, 5), (b, 5): X^H X and X^H Y where there is a reference
    power                (b,) |Y|^2 projected; where lines are single, what no smooth P leaves of it
    lines                (b,) number of lines, less those that the transients, and that P, take
    rows                 of single lines: band, target (r,), frequencies (m,) [Hz], matrix (r, m) from P to target
    """

    information: Complexes
    moment: Complexes
    instruments: Complexes
    regressors: Complexes
    crossed: Complexes
    power: Floats
    lines: Floats
    rows: list[tuple[int, Complexes, Floats, Complexes]] = field(default_factory=list)

    @classmethod
    def empty(cls, count: int) -> BandSums:
        """Sums of nothing yet, for so many bands."""
        square, row = (count, TERMS, TERMS), (count, TERMS)
        return cls(
            np.zeros(square, complex),
            np.zeros(row, complex),
            np.zeros(square, complex),
            np.zeros(square, complex),
            np.zeros(row, complex),
            np.zeros(count),
            np.zeros(count),
        )


class BandedRecord:
    """The sums over the stretches of records, and what they say of the noise.

    where       the bands
    period      [s]
    reference   whether the reference stands in for the regressors, as a loop feeds the reading back
    noise       function of frequency [Hz] -> relative power of the noise within a band; lines weigh by its inverse
    """

    def __init__(
        self, where: Sequence[FrequencyBand], period: float, reference: bool, noise: NoiseCurve | None = None
    ) -> None:
        self.where, self.period, self.reference = tuple(where), period, reference
        self.noise = noise or NoiseCurve(np.ones(1), np.ones(1), period)
        self.sums = BandSums.empty(len(self.where))

    def add(self, lines: Lines) -> None:
        """Add the lines of a stretch without a gap."""
        f = lines.frequency
        for b, band in enumerate(self.where):
            a, e = np.searchsorted(f, [band.low, band.high])
            if band.single:
                self._add_single(b, band, lines, int(a), int(e))
            elif e - a >= FEWEST:
                self._add_band(b, band, lines, int(a), int(e))

    def _add_band(self, b: int, band: FrequencyBand, lines: Lines, a: int, e: int) -> None:
        """Add the lines a to e - 1 of a stretch to the sums of band b, the transient projected out."""
        f = lines.frequency[a:e]
        U, Y, R = (part[a:e] for part in (lines.force, lines.position, lines.reference))
        weight = 1.0 / np.sqrt(self.noise(f) / self.noise(band.middle))
        place = (f - band.middle) / (0.5 * (band.high - band.low))
        L = legendre.legvander(place, DEGREE) * weight[:, None]
        ringing = self._ringing(band, f) * weight[:, None]
        if e - a < FEWEST + 4 * len(band.poles):
            ringing = ringing[:, :0]  # too few lines to give some to them
        # Legendre polynomials L times force are the regressors, and the transient is what is projected out
        across = _basis(L[:, : TRANSIENT + 1], ringing)
        X, y = U[:, None] * L, Y * weight
        X, y = X - across @ (across.conj().T @ X), y - across @ (across.conj().T @ y)
        sums = self.sums
        sums.power[b] += np.sum(np.abs(y) ** 2)
        sums.lines[b] += e - a - across.shape[1]
        if not self.reference:
            sums.information[b] += X.conj().T @ X
            sums.moment[b] += X.conj().T @ y
            return
        Z = R[:, None] * L
        Z = Z - across @ (across.conj().T @ Z)
        sums.information[b] += Z.conj().T @ X
        sums.moment[b] += Z.conj().T @ y
        sums.instruments[b] += Z.conj().T @ Z
        sums.regressors[b] += X.conj().T @ X
        sums.crossed[b] += X.conj().T @ y

    def _add_single(self, b: int, band: FrequencyBand, lines: Lines, a: int, e: int) -> None:
        """Add the lines a to e - 1 of a stretch to band b one by one, less what transients of its poles can be."""
        # what is projected out, and a few lines more
        if e - a < SMOOTH + 5 + 4 * len(band.poles) or (self.reference and not band.search):
            return  # feedback would bias single lines: they serve to look for the poles alone
        f, U, Y = lines.frequency[a:e], lines.force[a:e], lines.position[a:e]
        place = (f - band.middle) / (0.5 * (band.high - band.low))
        z = np.exp(2j * np.pi * f * self.period)
        ringing = self._ringing(band, f)
        # what transients of unknown poles leave must not weigh at the lowest lines
        flat = np.full(len(f), float(self.noise(band.high)))
        weight = 1.0 / np.sqrt(flat if band.search and not band.poles else self.noise(f))
        across = _basis(legendre.legvander(place, SMOOTH) * weight[:, None], ringing * weight[:, None])
        q, _ = np.linalg.qr(across, mode="complete")
        projection = q[:, across.shape[1] :].conj().T * weight
        y, matrix = projection @ Y, projection * (U * (z - 1.0) ** 2)
        self.sums.rows.append((b, y, f, matrix))
        # what no smooth P with these poles makes of the lines is noise
        known = _basis((projection * U) @ legendre.legvander(place, DEGREE), (projection * U) @ ringing)
        remainder = float(np.sum(np.abs(y - known @ (known.conj().T @ y)) ** 2) + EXACT * np.sum(np.abs(y) ** 2))
        self.sums.power[b] += remainder * float(self.noise(band.middle))
        self.sums.lines[b] += max(len(y) - known.shape[1], 0)

    def _ringing(self, band: FrequencyBand, frequency: Floats) -> Complexes:
        """Transients (n, c) that the poles near a band leave at its lines, frequencies (n,) [Hz].

        Of a pole p in z four columns: 1/(z - p), and its square since p is not known exactly, and both of the
        conjugate pole; of a real one two.
        """
        z = np.exp(2j * np.pi * frequency * self.period)
        columns = [np.zeros((len(z), 0), dtype=complex)]
        for p in np.exp(np.array(band.poles, dtype=complex) * self.period):
            near, mirrored = 1.0 / (z - p), 1.0 / (z - np.conj(p))
            both = [near, near**2 / np.max(np.abs(near)), mirrored, mirrored**2 / np.max(np.abs(mirrored))]
            columns.append(np.column_stack(both[: 2 if p.imag == 0.0 else 4]))
        return np.concatenate(columns, axis=1)


def _basis(smooth: Floats | Complexes, ringing: Complexes) -> Complexes:
    """An orthonormal basis (n, r) of smooth columns (n, s) and of the transients of poles, ringing ones (n, p).

    The ringing of a pole far from the lines is smooth among them. Directions in which it is nothing else are left
    out: rounding would choose them.
    """
    q, _ = np.linalg.qr(smooth.astype(complex))
    columns = ringing / np.maximum(np.linalg.norm(ringing, axis=0), LEAST)
    for _ in range(2):  # once more, for what rounding leaves
        columns = columns - q @ (q.conj().T @ columns)
    further, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.concatenate([q, further[:, size > ALIKE]], axis=1)


@dataclass(frozen=True)
class NoiseCurve:
    """Power of the noise in lines of the twice differenced position, |z - 1|^4 times that of the position itself.

    frequency, power  (n,) [Hz], and the position's, between which its logarithm is interpolated
    period            [s]
    """

    frequency: Floats
    power: Floats
    period: float

    def __call__(self, frequency: Floats | float) -> Floats:
        """Power (...) in lines of the twice differenced position at frequencies (...) [Hz]."""
        f = np.asarray(frequency, dtype=float)
        of_position = np.exp(np.interp(np.log(f), np.log(self.frequency), np.log(self.power)))
        return np.asarray(of_position * differenced_twice(f, self.period))


def differenced_twice(frequency: Floats | float, period: float) -> Floats:
    """|z - 1|^4 (...) at frequencies (...) [Hz]: what differencing twice makes of a power."""
    return np.asarray((2.0 * np.sin(np.pi * frequency * period)) ** 4)


@dataclass(frozen=True)
class Lines:
    """Lines of the transform of a stretch, the first and Nyquist's left out.

    frequency [Hz]; force, position (twice differenced), reference (n,)
    """

    frequency: Floats
    force: Complexes
    position: Complexes
    reference: Complexes
    period: float

    @property
    def theta(self) -> Floats:
        """Angles 2 pi f T (n,)."""
        return 2.0 * np.pi * self.period * self.frequency

    def where(self, kept: Flags) -> Lines:
        """The lines for which `kept` (n,) is true."""
        return Lines(
            self.frequency[kept], self.force[kept], self.position[kept], self.reference[kept], self.period
        )

    @property
    def nothing(self) -> Lines:
        """None of the lines."""
        return self.where(np.zeros(len(self.frequency), dtype=bool))

    def without(self, remainder: int, modulus: int) -> Lines:
        """All lines but those whose number leaves this remainder over the modulus."""
        return self.where(np.arange(len(self.frequency)) % modulus != remainder)

    def only(self, remainder: int, modulus: int) -> Lines:
        """The lines whose number leaves this remainder over the modulus: every modulus-th one."""
        return self.where(np.arange(len(self.frequency)) % modulus == remainder)


def transformed(force: Floats, position: Floats, reference: Floats | None, period: float) -> Lines:
    """The lines of a stretch, scaled to the same power of a white noise whatever its length.

    force, position, reference  (n,), sampled every `period` [s]; a stretch whose length has large prime factors
                                loses a few samples at its end
    """
    from scipy.fft import prev_fast_len, rfft

    n = int(prev_fast_len(len(force) - 2))
    scale = 1.0 / np.sqrt(n)
    moved = np.diff(position - position[0], n=2)[:n]
    usable = slice(1, (n - 1) // 2 + 1)
    U, Y = rfft(force[:n])[usable] * scale, rfft(moved)[usable] * scale
    R = U if reference is None else rfft(reference[:n])[usable] * scale
    frequency = np.arange(n // 2 + 1)[usable] / (n * period)
    return Lines(frequency, U, Y, R, period)


@dataclass(frozen=True)
class RecordResponse:
    """What bands of a record say of P, as a linear map of P's values whose rows have errors of unit variance.

    theta      (n,) angles 2 pi f T at which P is wanted: five of each band, and the single lines
    target     (r,) real numbers
    maps       rows of `apply`: bands (b, 5, 5) at the first 5 b angles, and single lines' matrices with the slice
               of angles that each takes
    noise      power of the noise over frequency
    middle     (b,) frequency of the bands [Hz]
    value, deviation  (b,) P there without any model [m/N], and its standard deviation (of each real part); nan
               where nothing was excited
    freedom    lines behind the noise, in all
    """

    theta: Floats
    target: Floats
    banded: Complexes
    single: tuple[tuple[slice, Complexes], ...]
    noise: NoiseCurve
    middle: Floats
    value: Complexes
    deviation: Floats
    freedom: float

    def apply(self, P: Complexes) -> Floats:
        """Real rows (r,) or (r, c) that the map makes of values of P at `theta`, (n,) or columns (n, c)."""
        count = self.banded.shape[0] * TERMS
        columns = P.reshape(len(P), -1)
        of_bands = np.matmul(self.banded, columns[:count].reshape(-1, TERMS, columns.shape[1]))
        rows = [of_bands.reshape(count, -1)[self._telling]]
        rows += [matrix @ columns[where] for where, matrix in self.single]
        every = np.concatenate(rows)
        return np.asarray(np.concatenate([every.real, every.imag]).reshape(-1, *P.shape[1:]))

    def residuals(self, P: Complexes) -> Floats:
        """Target less what P makes of it (r,): of unit variance where P is right."""
        return self.target - self.apply(P)

    @cached_property
    def _telling(self) -> Ints:
        """Indices of the bands' rows that say something: all but directions that nothing excited."""
        return np.flatnonzero(np.sum(np.abs(self.banded) ** 2, axis=2).ravel())


def response_in_bands(record: BandedRecord) -> RecordResponse:
    """The response that the sums in `record` hold, as rows that a model is fitted to.

    The noise of a band is what the five coefficients of `_solve_band` leave of its lines, averaged over a few
    bands about it.
    Raises ValueError  where no band has lines enough
    """
    sums, where = record.sums, record.where
    used = np.array([b for b, band in enumerate(where) if not band.single and sums.lines[b] > TERMS], dtype=int)
    if not len(used):
        raise ValueError("no band has lines enough")
    values, weights, remainders, counts = [], [], [], []
    for b in used:
        value, weight, remainder, rank = _solve_band(sums, int(b), record.reference)
        values.append(value)
        weights.append(weight)
        remainders.append(max(remainder, EXACT * sums.power[b]))
        counts.append(max(sums.lines[b] - rank, 1.0))
    middle = np.array([where[b].middle for b in used])
    single_bands = [b for b, band in enumerate(where) if band.single and not band.search and sums.lines[b] > 0]
    every = np.append(middle, [where[b].middle for b in single_bands])
    order = np.argsort(every)
    noise = _noise(
        every[order],
        np.append(remainders, sums.power[single_bands])[order],
        np.append(counts, sums.lines[single_bands])[order],
        record.period,
    )
    half = np.array([0.5 * (where[b].high - where[b].low) for b in used])
    nodes = middle[:, None] + half[:, None] * NODES
    z = np.exp(2j * np.pi * nodes * record.period)
    banded, targets, at_middle, deviation = [], [], [], []
    # Legendre polynomials at the band's middle
    at_zero = legendre.legvander(np.zeros(1), DEGREE)[0]
    for i in range(len(used)):
        # the root of the information over the noise makes rows whose errors have unit variance, real and imaginary
        sigma2 = float(noise(middle[i]))
        size, axes = np.linalg.eigh(weights[i])
        kept = size > WEAKEST * size[-1]
        root = np.sqrt(np.where(kept, size, 0.0) * 2.0 / sigma2)
        rows = root[:, None] * axes.conj().T
        banded.append(rows @ TO_LEGENDRE * (z[i] - 1.0) ** 2)
        targets.append((rows @ values[i])[kept])
        # without a model: the polynomial at the middle, its differences undone
        # nan where the lines do not tell all five numbers
        spread = (
            np.abs(axes.T @ at_zero) ** 2 / np.where(kept, size, np.inf) if kept.all() else np.full(TERMS, np.nan)
        )
        factor = np.abs(np.exp(2j * np.pi * middle[i] * record.period) - 1.0) ** 2
        at_middle.append(at_zero @ values[i] / (np.exp(2j * np.pi * middle[i] * record.period) - 1.0) ** 2)
        # half the variance in each component
        deviation.append(np.sqrt(0.5 * sigma2 * float(np.sum(spread))) / factor)
    theta, single = [2.0 * np.pi * record.period * nodes.ravel()], []
    start = nodes.size
    for b, y, f, matrix in sums.rows:
        # single lines stand there with the noise that they were added with: now with that of these bands
        frequency = where[b].high if where[b].search and not where[b].poles else where[b].middle
        root = np.sqrt(2.0 * float(record.noise(frequency) / noise(frequency)))
        single.append((slice(start, start + len(f)), matrix * root))
        targets.append(y * root)
        theta.append(2.0 * np.pi * record.period * f)
        start += len(f)
    target = np.concatenate(targets)
    return RecordResponse(
        np.concatenate(theta),
        np.concatenate([target.real, target.imag]),
        np.array(banded),
        tuple(single),
        noise,
        middle,
        np.array(at_middle),
        np.array(deviation),
        float(np.sum(counts)),
    )


def _solve_band(sums: BandSums, b: int, reference: bool) -> tuple[Complexes, Complexes, float, int]:
    """Coefficients (5,) of (z - 1)^2 P in a band, their information matrix for noise of power 1 (5, 5), the power
    of what they leave, and how many of them the lines tell.

    b  index of the band;   reference  whether one stands in for the regressors
    """
    if not reference:
        weight = 0.5 * (sums.information[b] + sums.information[b].conj().T)
        inverse, rank = _inverse(weight)
        value = inverse @ sums.moment[b]
        remainder = sums.power[b] - float(np.real(np.vdot(value, sums.moment[b])))
        return value, weight, remainder, rank
    inverse, _ = _inverse(sums.instruments[b])
    weight = sums.information[b].conj().T @ inverse @ sums.information[b]
    weight = 0.5 * (weight + weight.conj().T)
    inverse_weight, rank = _inverse(weight)
    value = inverse_weight @ sums.information[b].conj().T @ inverse @ sums.moment[b]
    crossed = float(np.real(np.vdot(value, sums.crossed[b])))
    remainder = sums.power[b] - 2.0 * crossed + float(np.real(np.vdot(value, sums.regressors[b] @ value)))
    return value, weight, remainder, rank


def _inverse(matrix: Complexes) -> tuple[Complexes, int]:
    """Pseudo-inverse of a positive semidefinite matrix (5, 5), and its rank."""
    size, axes = np.linalg.eigh(matrix)
    kept = size > WEAKEST * max(float(size[-1]), 0.0)
    if size[-1] <= 0.0:
        return np.zeros_like(matrix), 0
    inverse = np.where(kept, 1.0 / np.where(kept, size, 1.0), 0.0)
    return (axes * inverse) @ axes.conj().T, int(np.count_nonzero(kept))


def _noise(middle: Floats, remainders: Floats, counts: Floats, period: float) -> NoiseCurve:
    """The noise of bands from what is left in them, each averaged over some 300 lines of its neighbours.

    middle              (b,) ascending [Hz]
    remainders, counts  (b,) power that is left, and lines in which it is

    The logarithm of a mean of c exponential powers is by psi(c) - ln c too low, and has the variance 1/c. A slope
    over frequency is followed where it is clear, and goes on below the lowest band.
    """
    from scipy.special import digamma

    power = np.maximum(remainders / counts / differenced_twice(middle, period), LEAST)
    level, x = np.log(power) - digamma(counts) + np.log(counts), np.log(middle)
    smooth, slope = np.empty(len(power)), 0.0
    for i in reversed(range(len(power))):
        near = 1
        while near < len(power) and np.sum(counts[max(i - near, 0) : i + near + 1]) < NEIGHBOURS:
            near += 1
        part = slice(max(i - near, 0), i + near + 1)
        weights, about = counts[part], x[part] - np.average(x[part], weights=counts[part])
        spread = float(np.sum(weights * about**2))
        slope = float(np.sum(weights * about * level[part])) / max(spread, 1e-300)
        # weighted by the counts a slope has the variance 1/spread
        slope = slope if abs(slope) * np.sqrt(spread) > CLEAR else 0.0
        smooth[i] = np.average(level[part], weights=weights) + slope * (
            x[i] - np.average(x[part], weights=weights)
        )
    first = smooth[0] + np.clip(slope, -STEEPEST, STEEPEST) * np.log(BELOW)
    return NoiseCurve(np.append(BELOW * middle[0], middle), np.exp(np.append(first, smooth)), period)


def explained_share(unseen: BandedRecord, response: Callable[[Floats], Complexes]) -> float:
    """Share of the motion in lines that a response explains: 1 less the power of what it leaves over that of the
    position, both with the transients projected out; nan where there are no lines."""
    sums, T = unseen.sums, unseen.period
    remains, whole = 0.0, 0.0
    used = [b for b, band in enumerate(unseen.where) if not band.single and sums.lines[b] > 0]
    if used:
        middle = np.array([unseen.where[b].middle for b in used])
        half = np.array([0.5 * (unseen.where[b].high - unseen.where[b].low) for b in used])
        theta = 2.0 * np.pi * T * (middle[:, None] + half[:, None] * NODES)
        P = response(theta.ravel()).reshape(theta.shape) * (np.exp(1j * theta) - 1.0) ** 2
        coefficients = P @ TO_LEGENDRE.T
        square = sums.regressors if unseen.reference else sums.information
        crossed = sums.crossed if unseen.reference else sums.moment
        scale = 1.0 / differenced_twice(middle, T)  # from differences to the motion itself
        for i, b in enumerate(used):  # |Y - X p|^2 less |Y|^2
            fitted = float(
                np.real(
                    np.vdot(coefficients[i], square[b] @ coefficients[i])
                    - 2.0 * np.vdot(coefficients[i], crossed[b])
                )
            )
            remains += scale[i] * (sums.power[b] + fitted)
            whole += scale[i] * sums.power[b]
    for _, y, f, matrix in sums.rows:
        theta = 2.0 * np.pi * T * f
        scale_of_line = float(unseen.noise(float(np.mean(f))) / differenced_twice(float(np.mean(f)), T))
        remains += scale_of_line * float(np.sum(np.abs(y - matrix @ response(theta)) ** 2))
        whole += scale_of_line * float(np.sum(np.abs(y) ** 2))
    return 1.0 - remains / whole if whole > 0.0 else float("nan")
