"""Positions to velocities and accelerations, and the band in which torques are compared, without delay.

Every signal is convolved with one kernel, a low pass that is flat up to its edge f and without phase, and its
derivatives:

    h(t) = 2 f sin(2 pi f t)/(2 pi f t) exp(-t^2 / 2 s^2)          positions: h, h', h'';  torques: h

h' and h'' are derived in closed form, so that their samples have the responses j w H and -w^2 H to rounding, as
long as H is nothing at the Nyquist frequency. Positions pass a wide band (`WIDE` times the analysed one); torques,
and the torques that the model makes of the positions, then pass the analysed band alike. What the positions lose
above the wide band then changes nothing within the analysed one, as far as masses do not vary within a period of
it.

The analysed band ends where the positions' spectrum comes down to its floor: beyond, accelerations are noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.records.sampling import SampleTimes

WIDE: Final = 1.6  # edge of the positions' band over that of the analysed one
WIDTH: Final = 1.2  # s f of the wide kernel: H is flat to 1e-4 up to f/2, 0.5 at f, and 1e-4 at 1.5 f
ENDS: Final = 5.2  # s of a kernel, beyond which it is 1e-6 of its middle
SAMPLES: Final = 4.0  # of the positions per period of the wide band's edge
FINE: Final = 8  # samples that are smoothed, and signs of rates, for each smoothed position
GUARD: Final = 0.45  # edge of the kernel before thinning, in samples per period of what is left
SHARP: Final = 0.9  # s f of that kernel
NARROW: Final = 0.6  # s f of the analysed band's kernel
ABOVE: Final = 6.0  # times the floor of the spectrum, from which on it is motion
RESOLUTION: Final = 2048  # samples of a piece of which spectra are averaged, at least
LONGEST: Final = 300_000  # samples that are analysed, at most: longer records in a narrower band
AT_ONCE: Final = 1 << 20  # numbers that are convolved together: transforms of all take several times their memory
SHORTEST: Final = 40.0  # periods of the analysed band's edge in the longest stretch, at least


@dataclass(frozen=True)
class Kernel:
    """A low pass with its derivatives.

    edge    f [Hz];   width  s [s]
    """

    edge: float
    width: float

    @property
    def reach(self) -> float:
        """Time from the kernel's middle to its end [s]."""
        return ENDS * self.width

    def half(self, period: float) -> int:
        """Samples, a period [s] apart, from the kernel's middle to its end."""
        return int(np.ceil(self.reach / period))

    def taps(self, period: float, derivative: int = 0, shift: float = 0.0) -> Floats:
        """Samples (2 half + 1,) of h, h' or h'' times the period, which a convolution sums.

        derivative  0, 1 or 2 of h;   shift  by which the result is also delayed [s]
        """
        half = self.half(period)
        t = np.arange(-half, half + 1) * period - shift
        w, s2 = 2.0 * np.pi * self.edge, self.width**2
        gauss: Floats = np.exp(-0.5 * t**2 / s2)
        # sin(w t)/t and its first and second derivative, by their series about 0
        near = np.abs(w * t) < 1e-2
        t_or_1 = np.where(near, 1.0, t)
        sine, cosine = np.sin(w * t), np.cos(w * t)
        wt = w * t
        sinc = np.where(near, w * (1.0 - wt**2 / 6.0 + wt**4 / 120.0), sine / t_or_1)
        sinc_1 = np.where(near, w**2 * (-wt / 3.0 + wt**3 / 30.0), (w * cosine - sine / t_or_1) / t_or_1)
        sinc_2 = np.where(
            near,
            w**3 * (-1.0 / 3.0 + wt**2 / 10.0),
            (-(w**2) * sine - 2.0 * w * cosine / t_or_1 + 2.0 * sine / t_or_1**2) / t_or_1,
        )
        # derivatives of the Gaussian over itself; then those of the product
        gauss_1 = -t / s2
        gauss_2 = t**2 / s2**2 - 1.0 / s2
        h = (sinc, sinc_1 + sinc * gauss_1, sinc_2 + 2.0 * sinc_1 * gauss_1 + sinc * gauss_2)[derivative]
        return _exact_for_powers(
            np.asarray(h * gauss * period / np.pi), gauss, np.asarray(t, dtype=np.float64), derivative
        )


def _exact_for_powers(taps: Floats, gauss: Floats, t: Floats, derivative: int) -> Floats:
    """Taps that differentiate 1, t and t^2 without error, which ends and rounding would leave on them: a joint
    that stands at 1 rad would seem to accelerate by 1e-3 rad/s².

    taps, gauss, t  (2 half + 1,) kernel's samples, its Gaussian factor, and their times [s]
    derivative      0, 1 or 2
    """
    # sums of taps times t^power: a convolution turns the time round, so that h' has -1 for t; and t^2'' is 2
    powers = ((0,), (1,), (0, 2))[derivative]
    wanted = ((1.0,), (-1.0,), (0.0, 2.0))[derivative]
    corrections = np.stack([gauss * t**power for power in powers])
    moments = np.stack([t**power for power in powers])
    shares = np.linalg.solve(corrections @ moments.T, np.array(wanted) - moments @ taps)
    return np.asarray(taps + shares @ corrections)


@dataclass(frozen=True)
class TorqueBand:
    """The band of frequencies in which torques are compared, with the kernels that cut it out.

    edge    upper end of the band [Hz]
    period  of the record [s];   stride  samples of the record for each smoothed one
    noise   (d,) one-sided density of the positions' floor [rad²/Hz], [m²/Hz]
    motion  edge of the motion's band as seen in the spectrum [Hz]
    """

    edge: float
    period: float
    stride: int
    noise: Floats
    motion: float

    @property
    def wide(self) -> Kernel:
        """The low pass of the positions."""
        # of its own edge, 1.5 WIDE times the analysed one, half is flat: 1.2 of the analysed edge
        f = WIDE * self.edge
        return Kernel(1.5 * f, WIDTH / (1.5 * f))

    @property
    def narrow(self) -> Kernel:
        """The low pass of the torques that are compared."""
        return Kernel(self.edge, NARROW / self.edge)

    @property
    def step(self) -> float:
        """Sampling period of the smoothed positions [s]."""
        return self.stride * self.period

    @property
    def coarse(self) -> int:
        """Samples of the record for each that is kept where long records are thinned before they are smoothed."""
        return max(self.stride // FINE, 1)

    @property
    def guard(self) -> Kernel:
        """The low pass of records before they are thinned by `coarse`: flat over all that `wide` passes."""
        edge = GUARD / (self.coarse * self.period)
        return Kernel(edge, SHARP / edge)

    @property
    def thinning(self) -> int:
        """Smoothed samples for each that is compared: three in a period of the band's edge."""
        return max(int(1.0 / (3.0 * self.edge * self.step)), 1)

    def noise_of(self, count: int, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
        """Draw noise of the positions' floor, smoothed: positions, velocities, accelerations (count, d)."""
        kernel, half = self.wide, self.wide.half(self.step)
        size = np.sqrt(self.noise / (2.0 * self.step))  # of white noise with this one-sided density
        white = rng.normal(size=(count + 2 * half, len(size))) * size
        positions, velocities, accelerations = (convolved(white, kernel.taps(self.step, k)) for k in range(3))
        return positions, velocities, accelerations


def convolved(signals: Floats, taps: Floats, down: int = 1) -> Floats:
    """Signals (n, ...) convolved with taps (t,) where they overlap in full, n - t + 1 samples; every `down`-th."""
    from scipy.signal import oaconvolve

    columns = signals.reshape(len(signals), int(np.prod(signals.shape[1:])))
    made = np.empty((len(range(0, len(signals) - len(taps) + 1, down)), columns.shape[1]))
    several = max(AT_ONCE // len(signals), 1)
    for first in range(0, columns.shape[1], several):
        some = slice(first, first + several)
        made[:, some] = oaconvolve(columns[:, some], taps[:, None], mode="valid", axes=0)[::down]
    return made.reshape(len(made), *signals.shape[1:])


def choose_band(
    positions: Sequence[Floats], sampling: Sequence[SampleTimes], highest: float = np.inf
) -> TorqueBand:
    """The band in which records of one period are analysed.

    positions  (n, d) of each record, its longest stretch or the beginning of that
    highest    frequency that the model may be used to [Hz]
    """
    period = sampling[0].period
    spectra = [_spectrum(one, period) for one in positions]
    edge, noise = 0.0, np.zeros(positions[0].shape[1])
    for frequency, density in spectra:
        floors = np.array([_floor(frequency, row) for row in density.T])
        noise = np.maximum(noise, floors)
        for row, level in zip(density.T, floors, strict=True):
            # 1e-13 of the largest is rounding
            above = np.flatnonzero(row > ABOVE * max(level, 1e-13 * float(np.max(row))))
            edge = max(edge, float(frequency[above[-1]]) if len(above) else 0.0)
    longest = max(one.longest for one in sampling) * period
    length = sum(one.rows for one in sampling) * period
    lowest = SHORTEST / longest
    # the record's sampling, and a length that can be worked on, bound the band from above; 1.5 WIDE is the edge
    # of the positions' kernel over that of the band (`TorqueBand.wide`)
    most = min(1.0 / (SAMPLES * 1.5 * WIDE * period), LONGEST / (SAMPLES * 1.5 * WIDE * length), highest)
    analysed = min(max(edge, lowest), most)
    stride = max(int(1.0 / (SAMPLES * 1.5 * WIDE * analysed * period)), 1)
    # long strides in multiples of FINE, so that records can be thinned first (`coarse`)
    stride = stride if stride < FINE else FINE * (stride // FINE)
    return TorqueBand(analysed, period, stride, noise, edge)


def _spectrum(positions: Floats, period: float) -> tuple[Floats, Floats]:
    """Frequencies (f,) [Hz] and one-sided densities (f, d) of positions (n, d), averaged over pieces and over five
    neighbours; without the three lowest frequencies."""
    from scipy.signal import welch

    length = min(max(RESOLUTION, len(positions) // 6), len(positions))
    frequency, density = welch(positions, 1.0 / period, "hann", length, detrend="linear", axis=0)
    kernel = np.ones(5) / 5.0
    smooth = np.stack([np.convolve(row, kernel, mode="same") for row in density.T], axis=1)
    return np.asarray(frequency[3:]), smooth[3:]


def _floor(frequency: Floats, density: Floats) -> float:
    """Level of the noise in a density (f,) at frequencies (f,): the least median over parts of the upper half of
    the spectrum."""
    top = float(frequency[-1])
    edges = np.linspace(0.5, 0.95, 5) * top
    inside = [density[(frequency >= a) & (frequency < b)] for a, b in pairwise(edges)]
    return min((float(np.median(part)) for part in inside if len(part)), default=0.0)
