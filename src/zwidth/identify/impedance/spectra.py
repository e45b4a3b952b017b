"""The impedance at the handle from spectra of hand force and position, with the band that holds it.

The response G from force f to position x is estimated by local polynomials (`local_spectra`) in two ways,

    H1   x on f     right where only the position is noisy, else too small:  |H1| = |G| / (1 + N_f)
    H2   f on x     right where only the force is noisy, else too large:     |H2| = |G| (1 + N_x)

N_f and N_x noise to signal in power. With noise on both that is independent of the other, G lies between; their
ratio is the coherence. The impedance is Z = 1/(jw G). Its best value takes the noise in equal shares: the mean of
the two estimates' logarithms. The error by chance has the variance v, known from n values; Z may be off by a bias
of up to b towards either estimate. An interval that holds the truth with 95 % wherever between the two it lies is
narrower than b + 1.96 v^(1/2), since both ends are not missed at once (Imbens and Manski 2004, known at second
hand; here by the noncentral chi-square distribution).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.identify.impedance.local_spectra import LocalSpectra, correlations, windows_per_independent_one
from zwidth.identify.profile_likelihood import LEVEL
from zwidth.identify.records.record import Piece, Record
from zwidth.identify.records.sampling import SampleTimes, joined
from zwidth.result import Documented, documented, entry

FORCE, POSITION = "force", "position"
FEWEST_LINES: Final = 8  # frequencies for a fit
KEPT_POWERS: Final = 3  # of s, that are stated: stiffness, damping, mass
BACK: Final = 0.45  # share of the highest frequency at which a fit still holds, up to which it is made
FAR: Final = 30.0  # bias in deviations, from which on only one end is missed
SHIFTS: Final = 150  # between which the half width of an interval is interpolated
LEAST: Final = 0.05  # coherence that is taken for any smaller one
SILENT: Final = 1e-7  # share of the force's largest power, below which a line holds only what others leak


@dataclass(frozen=True)
class MeasuredImpedance:
    """Z(jw) at the handle at (k,) frequencies at which force and position are coherent.

    frequency  [Hz];  value  [N s/m];  coherence
    deviation  standard deviation of the real part, and of the imaginary part, by chance alone [N s/m]
    bias       half of the distance between the two estimates [N s/m]
    freedom    complex values from which the deviation is known
    """

    frequency: Floats
    value: Complexes
    coherence: Floats
    deviation: Floats
    bias: Floats
    freedom: float

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def radius(self) -> Floats:
        """Radius of the disk round `value` that holds Z with 95 % [N s/m]."""
        return _half_width(self.deviation, self.bias, self.freedom, 2)

    def half_width(self, level: float = LEVEL) -> Floats:
        """Half width of the interval that holds |Z| with this level [N s/m]."""
        return _half_width(self.deviation, self.bias, self.freedom, 1, level)

    @property
    def low(self) -> Floats:
        """Lower end of the band of |Z| (95 % at each frequency) [N s/m]."""
        return np.maximum(np.abs(self.value) - self.half_width(), 0.0)

    @property
    def high(self) -> Floats:
        """Upper end of the band of |Z| [N s/m]."""
        return np.abs(self.value) + self.half_width()

    def only(self, some: Flags) -> MeasuredImpedance:
        """The impedance at the frequencies for which `some` (k,) is true."""
        return replace(
            self,
            frequency=self.frequency[some],
            value=self.value[some],
            coherence=self.coherence[some],
            deviation=self.deviation[some],
            bias=self.bias[some],
        )


def _half_width(deviation: Floats, bias: Floats, freedom: float, size: int, level: float = LEVEL) -> Floats:
    """Half widths (k,) that hold an error with a level: a bias of up to `bias` (k,), and chance of this deviation
    (k,), known from `freedom` complex values, in each of `size` components, 1 or 2."""
    from scipy.stats import chi2
    from scipy.stats import f as fisher

    shift = np.minimum(bias / np.maximum(deviation, 1e-300), FAR)
    reached = np.interp(shift, *_shifts_and_half_widths(level, size))
    # the deviation is itself estimated: Fisher's quantile in place of chi-square's
    wider = np.sqrt(size * fisher.ppf(level, size, 2.0 * max(freedom, 0.5)) / chi2.ppf(level, size))
    # what of the bias lies beyond FAR deviations, where the table ends
    beyond = np.maximum(bias - shift * deviation, 0.0)
    return np.asarray(deviation * (shift + (reached - shift) * wider) + beyond)


@lru_cache(maxsize=256)
def _shifts_and_half_widths(level: float, size: int) -> tuple[Floats, Floats]:
    """Shifts (m,) from 0 to `FAR`, and the size (m,) that an error of deviation 1 in each of `size` components
    about each of them stays within, with a level."""
    from scipy.special import chndtrix

    shifts = FAR * np.linspace(0.0, 1.0, SHIFTS) ** 2
    return shifts, np.sqrt(chndtrix(level, size, shifts**2))


def measured_impedance(spectra: LocalSpectra, highest: float) -> MeasuredImpedance:
    """The impedance at the frequencies below `highest` [Hz] at which the response is no chance."""
    from scipy.stats import f as fisher

    # channel 0 is the force, 1 the position: position by force, and the other way round
    (direct, variance), (inverse, _) = spectra.fit(0, 1), spectra.fit(1, 0)
    H1, H_inverse = direct[:, 0], inverse[:, 0]
    # so that no frequency of all passes by chance, with 95 %
    chance = fisher.isf((1.0 - LEVEL) / max(len(H1), 1), 2.0, 2.0 * max(spectra.freedom, 1))
    power = spectra.power(0)
    seen = (2.0 * np.abs(H1) ** 2 > 2.0 * chance * variance) & (spectra.frequency < highest)
    seen &= (power > SILENT * np.max(power, initial=0.0)) & (np.abs(H_inverse) > 0.0)
    H1, H_inverse, variance, f = H1[seen], H_inverse[seen], variance[seen], spectra.frequency[seen]
    # coherence is |H1 / H2|, 1 / H2 the fit of force on position, and less for the values that were fitted
    unexplained = np.maximum(1.0 - np.abs(H1 * H_inverse), 0.0) * spectra.values / max(spectra.freedom, 1)
    coherence = np.maximum(1.0 - unexplained, LEAST)
    G = H1 / np.sqrt(coherence)
    value = spectra.differencing[seen] / (2j * np.pi * f * G)
    magnitude = np.abs(value)
    # where only the position is noisy |Z| is larger by this, with its error
    to_either = 1.0 / np.sqrt(coherence)
    # half of the complex variance is in each component
    deviation = magnitude * to_either * np.sqrt(0.5 * variance) / np.abs(H1)
    return MeasuredImpedance(f, value, coherence, deviation, magnitude * (to_either - 1.0), float(spectra.freedom))


def extreme(impedance: MeasuredImpedance, *, lowest: bool) -> tuple[int, float, float, float]:
    """The lowest or highest |Z| that is surest: index of the frequency whose band ends lowest (begins highest),
    |Z| there, and both ends (95 %) of the interval of the lowest (highest) of all [N s/m].

    Of many frequencies at which |Z| is about the same one is lowest by chance. So the level of the end towards the
    others is raised by the number of independent ones among those whose bands reach the extreme one. The other
    end is then hardly ever missed, so that of two and more this one may be missed twice as often as one end.
    """
    size = np.abs(impedance.value)
    k = int(np.argmin(impedance.high)) if lowest else int(np.argmax(impedance.low))
    rivals = impedance.low <= impedance.high[k] if lowest else impedance.high >= impedance.low[k]
    count = max(float(np.sum(rivals)) / windows_per_independent_one(), 1.0)
    level = 1.0 - (1.0 - LEVEL) * min(count, 2.0) / count
    some = impedance.only(rivals)
    raised, plain = some.half_width(level), some.half_width()
    if lowest:
        low, high = np.min(size[rivals] - plain), np.min(size[rivals] + raised)
    else:
        low, high = np.max(size[rivals] - raised), np.max(size[rivals] + plain)
    return k, float(size[k]), max(float(low), 0.0), float(high)


def stretches_of(
    record: Record, sampling: SampleTimes, names: tuple[str, str], state: str, part: tuple[float, float]
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


def longest_stretch(record: Record, sampling: SampleTimes, state: str) -> int:
    """Samples of the longest stretch of a state of the wall without a gap."""
    if "wall" not in record:
        return sampling.longest
    longest = count = 0
    names = (record.names[0], record.names[0])  # any columns: samples are counted
    for piece, goes_on in joined(stretches_of(record, sampling, names, state, (0.0, 1.0))):
        count = len(piece["sample"]) + (count if goes_on else 0)
        longest = max(longest, count)
    return longest


ON: Final = ("on", "1", "1.0", "true", "yes", "wall")
OFF: Final = ("off", "0", "0.0", "false", "no", "free", "none")


def wall_states(words: NDArray[np.str_]) -> NDArray[np.str_]:
    """State of the wall (n,) by the words of its column (n,): "on", "off", or "" for what is neither."""
    plain = np.char.lower(np.char.strip(words.astype(str)))
    return np.where(np.isin(plain, ON), "on", np.where(np.isin(plain, OFF), "off", ""))


@dataclass(frozen=True)
class OctaveBand(Documented):
    """The real part of the impedance in one octave.

    low, high     of the octave [Hz];   lines  in it
    real          mean of Re Z at these [N s/m];   real_low, real_high  its interval (95 %), bias included
    """

    low: float = field(metadata=entry("Hz"))
    high: float = field(metadata=entry("Hz"))
    lines: int = field(metadata=entry())
    real: float = field(metadata=entry("N s/m"))
    real_low: float = field(metadata=entry("N s/m"))
    real_high: float = field(metadata=entry("N s/m"))

    @property
    @documented()
    def passive(self) -> bool | None:
        """Whether the handle takes energy there; None where the interval holds 0."""
        return True if self.real_low > 0.0 else False if self.real_high < 0.0 else None


def octave_bands(impedance: MeasuredImpedance) -> list[OctaveBand]:
    """The real part in octaves from 2^n Hz to 2^(n + 1) Hz."""
    bands = []
    octave = np.floor(np.log2(impedance.frequency))
    for n in np.unique(octave).tolist():
        some = impedance.only(octave == n)
        mean = float(np.mean(some.value.real))
        # noise on either end scales the value, real part and all
        shift = np.atleast_1d(abs(np.mean(some.bias * some.value.real / np.abs(some.value))))
        half = float(_half_width(np.atleast_1d(_deviation_of_mean(some)), shift, some.freedom * len(some), 1)[0])
        bands.append(OctaveBand(2.0**n, 2.0 ** (n + 1.0), len(some), mean, mean - half, mean + half))
    return bands


def _deviation_of_mean(impedance: MeasuredImpedance) -> float:
    """Standard deviation of the mean of Re Z over neighbouring frequencies, by chance alone [N s/m].

    The error of Z is -Z/G times that of G, whose windows overlap (`correlations`).
    """
    # Z/G is jw Z^2: the phase of Z^2, but for one that all share
    error = impedance.deviation * (impedance.value / np.abs(impedance.value)) ** 2
    f, rho = impedance.frequency, correlations()
    spacing = np.min(np.diff(f)) if len(f) > 1 else 1.0
    place = np.round(f / spacing).astype(int)
    total = float(np.sum(np.abs(error) ** 2))
    for apart in range(1, len(rho)):
        a, b = error[:-apart], error[apart:]
        distance = place[apart:] - place[:-apart]
        near = np.where(distance < len(rho), rho[np.minimum(distance, len(rho) - 1)], 0.0)
        total += 2.0 * float(np.sum(near * np.real(a * np.conj(b))))
    return float(np.sqrt(max(total, 0.0))) / max(len(f), 1)


def low_frequency_fit(impedance: MeasuredImpedance) -> tuple[Floats, Floats] | None:
    """What Z is like at low frequency, s = jw: K/s + B + m s + ...; None for too few lines, or where no such
    numbers explain even the lowest ones.

    The lines are taken from the lowest upwards, to 0.45 of where what remains is no longer scatter; three more
    powers of s take up where the device begins to yield.
    Returns  K, B, m, and half widths of their intervals (95 %)
    """
    if len(impedance) < FEWEST_LINES:
        return None
    w = 2.0 * np.pi * impedance.frequency
    A = np.column_stack([(1j * w) ** power for power in range(-1, 5)])
    # 1e-9: for data without noise
    sigma = impedance.deviation + 1e-9 * np.abs(impedance.value)
    # noise on either end scales all of Z: what that changes of it, fitted along with it
    by_bias = impedance.value * impedance.bias / np.abs(impedance.value)
    # of each fit its highest frequency, then of K, B and m: values, deviations, and biases
    fits = list[tuple[float, Floats, Floats, Floats]]()
    count = FEWEST_LINES
    while count <= len(w):
        some = slice(0, count)
        weight = np.tile(1.0 / sigma[some], 2)
        rows = np.vstack([A[some].real, A[some].imag]) * weight[:, None]
        values_and_bias = np.column_stack([impedance.value[some], by_bias[some]])
        right = np.concatenate([values_and_bias.real, values_and_bias.imag]) * weight[:, None]
        size = np.linalg.norm(rows, axis=0)
        coefficients, *_ = np.linalg.lstsq(rows / size, right, rcond=None)
        solved, bias = (coefficients / size[:, None])[:KEPT_POWERS].T
        freedom = max((2 * count - rows.shape[1]) / windows_per_independent_one(), 1.0)
        remains = (
            float(np.sum((rows / size @ coefficients[:, 0] - right[:, 0]) ** 2))
            / windows_per_independent_one()
            / freedom
        )
        if remains > 1.0 + 3.0 * np.sqrt(2.0 / freedom):  # three standard deviations above what scatter leaves
            break
        variance = (
            np.diag(np.linalg.inv((rows / size).T @ (rows / size))) / size**2 * windows_per_independent_one()
        )
        deviation = np.sqrt(variance[:KEPT_POWERS] * max(remains, 1.0))
        fits.append((float(impedance.frequency[count - 1]), solved, deviation, np.abs(bias)))
        count = max(count + 1, int(1.2 * count))
    if not fits:
        return None
    # what is left out grows steeply with frequency: it is scatter's size at the last, and small at 0.45 of it
    highest = BACK * fits[-1][0]
    _, numbers, deviation, bias = next(fit for fit in reversed(fits) if fit[0] <= highest or fit is fits[0])
    return numbers, _half_width(deviation, bias, impedance.freedom, 1)
