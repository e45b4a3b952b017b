"""The impedance at the handle from spectra of hand force and position, with the band that holds it.

The admittance from force f to position x is estimated from averaged spectra in two ways,

    H1 = S_xf / S_ff   right where only the position is noisy, else too small:  |H1| = |Y| / (1 + N_f)
    H2 = S_xx / S_fx   right where only the force is noisy, else too large:     |H2| = |Y| (1 + N_x)

N_f and N_x noise to signal in power. With noise on both that is independent of the other, Y lies between; their
ratio is the coherence. The impedance is Z = 1/(jw Y). Its best value takes the noise in equal shares (Hv); its
band reaches from one estimate to the other, and beyond each by the radius of the disk that holds the random error
with 95 % at that frequency (Bendat and Piersol, known at second hand):

    r^2 = |Y|^2 (1 - c)/c F_95(2, 2n - 2) / (n - 1),    c the coherence, n independent averages

Segments leak: a response that turns within a line's width is blurred, with an error that falls with the square of
the segment's length. A third of the difference from segments half as long is added to the band.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.identify.record import Piece, Record
from zwidth.identify.sampling import Sampling
from zwidth.identify.spectra import Spectra

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

FORCE, POSITION = "force", "position"
LEVEL: Final = 0.95
FEWEST_LINES: Final = 8  # frequencies for a fit
BACK: Final = 0.5  # share of the highest frequency at which a fit still holds, up to which it is made
SILENT: Final = 1e-7  # share of the force's largest power, below which a line holds only what others leak
NEIGHBOURS: Final = 1.5  # lines of a Hann window that count as one independent one


@dataclass(frozen=True)
class MeasuredImpedance:
    """Z(jw) at the handle at (k,) frequencies at which force and position are coherent.

    frequency  [Hz];  value  [N s/m];  coherence
    radius     of the disk round `value` that holds Z with 95 %, bias by noise on either end included [N s/m]
    deviation  standard deviation of the real part, and of the imaginary part, by chance alone [N s/m]
    bias       half of the distance between the two estimates, and the error by leakage [N s/m]
    """

    frequency: Floats
    value: Complexes
    coherence: Floats
    radius: Floats
    deviation: Floats
    bias: Floats

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def low(self) -> Floats:
        """Lower end of the band of |Z| [N s/m]."""
        return np.maximum(np.abs(self.value) - self.radius, 0.0)

    @property
    def high(self) -> Floats:
        """Upper end of the band of |Z| [N s/m]."""
        return np.abs(self.value) + self.radius

    def only(self, some: NDArray[np.bool_]) -> MeasuredImpedance:
        """Some of the frequencies."""
        return MeasuredImpedance(**{name: values[some] for name, values in vars(self).items()})


def measured_impedance(spectra: Spectra, shorter: Spectra, highest: float) -> MeasuredImpedance:
    """The impedance at the lines below `highest` [Hz] at which the coherence is no chance.

    shorter  spectra of the same records with segments half as long
    """
    from scipy.stats import f as fisher

    n = max(spectra.averages, 1.0 + 1e-9)
    coherence = spectra.coherence(FORCE, POSITION)
    # so that no line of all passes by chance, with 95 %
    chance = 1.0 - ((1.0 - LEVEL) / len(coherence)) ** (1.0 / (n - 1.0)) if n > 1.5 else 1.0
    power = spectra.power(FORCE)
    seen = (coherence > chance) & (spectra.frequency < highest) & (power > SILENT * np.max(power, initial=0.0))
    c, f = coherence[seen], spectra.frequency[seen]
    s = 2j * np.pi * f
    Y = spectra.response(FORCE, POSITION, "Hv")[seen]
    value = 1.0 / (s * Y)
    size = np.abs(value)
    # H1 and H2 lie at |Y| sqrt(c) and |Y| / sqrt(c)
    bias = size * (1.0 / np.sqrt(c) - 1.0) + _leakage(shorter, f, Y) * size
    relative = (1.0 - c) / c / max(n - 1.0, 1e-9)
    chance_radius = size / np.sqrt(c) * np.sqrt(relative * fisher.ppf(LEVEL, 2.0, 2.0 * n - 2.0))
    deviation = size * np.sqrt(0.5 * relative)
    return MeasuredImpedance(f, value, c, bias + chance_radius, deviation, bias)


def _leakage(shorter: Spectra, frequency: Floats, Y: Complexes) -> Floats:
    """Relative error by leakage at the frequencies, from segments half as long; there the admittance is smooth
    enough to be interpolated over w^2 Y, which a mass makes constant."""
    s, at = 2j * np.pi * shorter.frequency, 2j * np.pi * frequency
    half = s**2 * shorter.response(FORCE, POSITION, "Hv")
    between = np.interp(frequency, shorter.frequency, half.real) + 1j * np.interp(
        frequency, shorter.frequency, half.imag
    )
    return np.asarray(np.abs(between / (at**2 * Y) - 1.0) / 3.0)


def stretches_of(
    record: Record, sampling: Sampling, names: tuple[str, str], state: str, part: tuple[float, float]
) -> Iterator[Piece]:
    """Pieces of a record without gaps, under the channel names of the spectra.

    names   of the columns of force and position
    state   on or off: of the column wall, where the record has it; "": all of it
    part    shares of the rows between which they are taken
    """
    first, last = (round(share * sampling.rows) for share in part)
    for piece in sampling.stretches(record):
        row = piece["row"]
        kept = (row >= first) & (row < last)
        if state and "wall" in record:
            kept &= wall_states(piece["wall"]) == state
        ends = np.flatnonzero(np.diff(np.concatenate([[0], kept.astype(int), [0]])))
        for low, high in ends.reshape(-1, 2):
            some = slice(int(low), int(high))
            yield {FORCE: piece[names[0]][some], POSITION: piece[names[1]][some], "sample": piece["sample"][some]}


ON: Final = ("on", "1", "1.0", "true", "yes", "wall")
OFF: Final = ("off", "0", "0.0", "false", "no", "free", "none")


def wall_states(words: NDArray[np.str_]) -> NDArray[np.str_]:
    """on, off, or "" for what is neither."""
    plain = np.char.lower(np.char.strip(words.astype(str)))
    return np.where(np.isin(plain, ON), "on", np.where(np.isin(plain, OFF), "off", ""))


@dataclass(frozen=True)
class OctaveBand:
    """The real part of the impedance in one octave.

    low, high     of the octave [Hz];   lines  in it
    real          weighted mean of Re Z [N s/m];   real_low, real_high  its interval (95 %), bias included
    """

    low: float
    high: float
    lines: int
    real: float
    real_low: float
    real_high: float

    @property
    def passive(self) -> bool | None:
        """Whether the handle takes energy there; None where the interval holds 0."""
        return True if self.real_low > 0.0 else False if self.real_high < 0.0 else None

    def document(self) -> dict[str, float | int | bool | None]:
        """The band by key and unit."""
        return {
            "low_Hz": self.low,
            "high_Hz": self.high,
            "lines": self.lines,
            "real_Ns_per_m": self.real,
            "real_low_Ns_per_m": self.real_low,
            "real_high_Ns_per_m": self.real_high,
            "passive": self.passive,
        }


def octave_bands(impedance: MeasuredImpedance) -> list[OctaveBand]:
    """The real part in octaves from 2^n Hz to 2^(n + 1) Hz."""
    bands = []
    octave = np.floor(np.log2(impedance.frequency))
    for n in np.unique(octave).tolist():
        some = impedance.only(octave == n)
        weight = 1.0 / np.maximum(some.deviation, 1e-12 * np.abs(some.value)) ** 2
        mean = float(np.sum(weight * some.value.real) / np.sum(weight))
        half = 1.96 * float(np.sqrt(NEIGHBOURS / np.sum(weight)))
        # noise on either end scales the value, real part and all
        shift = float(np.sum(weight * some.bias * np.abs(some.value.real) / np.abs(some.value)) / np.sum(weight))
        bands.append(
            OctaveBand(2.0**n, 2.0 ** (n + 1.0), len(some), mean, mean - half - shift, mean + half + shift)
        )
    return bands


def low_frequency_fit(impedance: MeasuredImpedance, *, wall: bool) -> tuple[Floats, Floats, float] | None:
    """What Z is like at low frequency, s = jw: K/s + B + m s + ... with a wall, B + m s + ... without; None for
    too few lines.

    The lines are taken from the lowest upwards, to half of where what remains is no longer scatter; two more
    powers of s take up where the device begins to yield.
    Returns  the numbers, half widths of their intervals (95 %), and the highest frequency used [Hz]
    """
    from scipy.stats import t

    if len(impedance) < FEWEST_LINES:
        return None
    w = 2.0 * np.pi * impedance.frequency
    columns = [1.0 / (1j * w)] if wall else []
    A = np.column_stack([*columns, *((1j * w) ** power for power in range(4))])
    sigma = np.hypot(impedance.deviation, impedance.bias) + 1e-9 * np.abs(impedance.value)
    fits = list[tuple[Floats, Floats, float]]()
    count = FEWEST_LINES
    while count <= len(w):
        some = slice(0, count)
        rows = np.vstack([A[some].real, A[some].imag]) / np.tile(sigma[some], 2)[:, None]
        right = np.concatenate([impedance.value[some].real, impedance.value[some].imag]) / np.tile(sigma[some], 2)
        size = np.linalg.norm(rows, axis=0)
        solved, *_ = np.linalg.lstsq(rows / size, right, rcond=None)
        freedom = max((2 * count - rows.shape[1]) / NEIGHBOURS, 1.0)
        remains = float(np.sum((rows / size @ solved - right) ** 2)) / NEIGHBOURS / freedom
        if fits and remains > 1.0 + 3.0 * np.sqrt(2.0 / freedom):
            break
        covariance = np.linalg.inv((rows / size).T @ (rows / size)) * NEIGHBOURS * max(remains, 1.0)
        half = float(t.ppf(0.5 + 0.5 * LEVEL, freedom)) * np.sqrt(np.diag(covariance)) / size
        kept = 2 + len(columns)
        fits.append(((solved / size)[:kept], half[:kept], float(impedance.frequency[count - 1])))
        count = max(count + 1, int(1.2 * count))
    # what is left out grows steeply with frequency: it is scatter's size at the last, and small at half of it
    return next(fit for fit in reversed(fits) if fit[2] <= BACK * fits[-1][2] or fit is fits[0])
