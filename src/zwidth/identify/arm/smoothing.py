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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.identify.arm.channels import Channels
from zwidth.identify.record import Record
from zwidth.identify.sampling import Sampling
from zwidth.memory_limit import check_memory

Floats = NDArray[np.float64]

WIDE: Final = 1.6  # edge of the positions' band over that of the analysed one
WIDTH: Final = 1.2  # s f of the wide kernel: H is flat to 1e-4 up to f/2, 0.5 at f, and 1e-4 at 1.5 f
ENDS: Final = 5.2  # s of a kernel, beyond which it is 1e-6 of its middle
SAMPLES: Final = 4.0  # of the positions per period of the wide band's edge
NARROW: Final = 0.6  # s f of the analysed band's kernel
ABOVE: Final = 6.0  # times the floor of the spectrum, from which on it is motion
RESOLUTION: Final = 2048  # samples of a piece of which spectra are averaged, at least
LONGEST: Final = 300_000  # samples that are analysed, at most: longer records in a narrower band
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
        """Time from its middle to its end [s]."""
        return ENDS * self.width

    def half(self, period: float) -> int:
        """Samples from its middle to its end."""
        return int(np.ceil(self.reach / period))

    def taps(self, period: float, derivative: int = 0, shift: float = 0.0) -> Floats:
        """Samples of h, h' or h'' times the period, which a convolution sums; of a delay by `shift` [s]."""
        half = self.half(period)
        t = np.arange(-half, half + 1) * period - shift
        x, s2 = 2.0 * np.pi * self.edge, self.width**2
        g: Floats = np.exp(-0.5 * t**2 / s2)
        # sin(x t)/t and its derivatives, by their series about 0
        near = np.abs(x * t) < 1e-2
        u = np.where(near, 1.0, t)
        sine, cosine = np.sin(x * t), np.cos(x * t)
        y = x * t
        k0 = np.where(near, x * (1.0 - y**2 / 6.0 + y**4 / 120.0), sine / u)
        k1 = np.where(near, x**2 * (-y / 3.0 + y**3 / 30.0), (x * cosine - sine / u) / u)
        k2 = np.where(
            near,
            x**3 * (-1.0 / 3.0 + y**2 / 10.0),
            (-(x**2) * sine - 2.0 * x * cosine / u + 2.0 * sine / u**2) / u,
        )
        first = -t / s2
        second = t**2 / s2**2 - 1.0 / s2
        h = (k0, k1 + k0 * first, k2 + 2.0 * k1 * first + k0 * second)[derivative]
        return _exact_for_powers(
            np.asarray(h * g * period / np.pi), g, np.asarray(t, dtype=np.float64), derivative
        )


def _exact_for_powers(taps: Floats, g: Floats, t: Floats, derivative: int) -> Floats:
    """Taps that differentiate 1, t and t^2 without error, which ends and rounding would leave on them: a joint
    that stands at 1 rad would seem to accelerate by 1e-3 rad/s^2."""
    powers = ((0,), (1,), (0, 2))[derivative]
    wanted = ((1.0,), (-1.0,), (0.0, 2.0))[derivative]
    bumps = np.stack([g * t**power for power in powers])
    moments = np.stack([t**power for power in powers])
    shares = np.linalg.solve(bumps @ moments.T, np.array(wanted) - moments @ taps)
    return np.asarray(taps + shares @ bumps)


@dataclass(frozen=True)
class Band:
    """What is analysed.

    edge    of the analysed band [Hz]
    period  of the record [s];   stride  its samples for one of the smoothed positions
    noise   (d,) one-sided density of the positions' floor [rad^2/Hz], [m^2/Hz]
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
        f = WIDE * self.edge
        return Kernel(1.5 * f, WIDTH / (1.5 * f))

    @property
    def narrow(self) -> Kernel:
        """The low pass of what is compared."""
        return Kernel(self.edge, NARROW / self.edge)

    @property
    def step(self) -> float:
        """Of the smoothed positions [s]."""
        return self.stride * self.period

    @property
    def thinning(self) -> int:
        """Smoothed samples for one that is compared."""
        return max(int(1.0 / (3.0 * self.edge * self.step)), 1)

    def noise_of(self, count: int, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
        """Positions, velocities and accelerations (count, d) of the floor alone, after smoothing."""
        kernel, half = self.wide, self.wide.half(self.step)
        size = np.sqrt(self.noise / (2.0 * self.step))
        white = rng.normal(size=(count + 2 * half, len(size))) * size
        first, second, third = (convolved(white, kernel.taps(self.step, k)) for k in range(3))
        return first, second, third


@dataclass(frozen=True)
class Stretch:
    """A part of a record without gaps, smoothed, n samples.

    record   number of the record
    time     (n,) [s]
    coordinates, rates, accelerations  (n, d)  of the drives
    signs    (n, d)  the sign of the rates, smoothed as the torques are
    forces   (n, d)
    """

    record: int
    time: Floats
    coordinates: Floats
    rates: Floats
    accelerations: Floats
    signs: Floats
    forces: Floats

    def part(self, rows: slice) -> Stretch:
        """Some of its samples."""
        return Stretch(self.record, *(getattr(self, name)[rows] for name in STRETCH))


STRETCH: Final = ("time", "coordinates", "rates", "accelerations", "signs", "forces")


@dataclass(frozen=True)
class TorqueTiming:
    """When a recorded torque acts: `shift` later [s], with `spread` [s^2], half its second moment about then.

    hold and delay of a command: shift = delay + T/2 + lag, spread = T^2/24 + lag^2/2
    """

    shift: float = 0.0
    spread: float = 0.0


def convolved(signals: Floats, taps: Floats) -> Floats:
    """Columns (n, ...) convolved with taps (2 h + 1,), where they overlap in full: (n - 2 h, ...)."""
    from scipy.signal import oaconvolve

    kernel = taps.reshape((-1,) + (1,) * (signals.ndim - 1))
    return np.asarray(oaconvolve(signals, kernel, mode="valid", axes=0))


def choose_band(positions: Sequence[Floats], sampling: Sequence[Sampling], highest: float = np.inf) -> Band:
    """The band in which records of one period are analysed.

    positions  (n, d) of each record, its longest stretch or the beginning of that
    highest    that the model may be used to [Hz]
    """
    period = sampling[0].period
    spectra = [_spectrum(one, period) for one in positions]
    edge, noise = 0.0, np.zeros(positions[0].shape[1])
    for frequency, density in spectra:
        floor = np.array([_floor(frequency, row) for row in density.T])
        noise = np.maximum(noise, floor)
        for row, level in zip(density.T, floor, strict=True):
            above = np.flatnonzero(row > ABOVE * max(level, 1e-13 * float(np.max(row))))
            edge = max(edge, float(frequency[above[-1]]) if len(above) else 0.0)
    longest = max(one.longest for one in sampling) * period
    length = sum(one.rows for one in sampling) * period
    lowest = SHORTEST / longest
    most = min(1.0 / (SAMPLES * 1.5 * WIDE * period), LONGEST / (SAMPLES * 1.5 * WIDE * length), highest)
    analysed = min(max(edge, lowest), most)
    stride = max(int(1.0 / (SAMPLES * 1.5 * WIDE * analysed * period)), 1)
    return Band(analysed, period, stride, noise, edge)


def _spectrum(positions: Floats, period: float) -> tuple[Floats, Floats]:
    """One-sided densities (f, d), averaged over pieces and over five neighbours."""
    from scipy.signal import welch

    length = min(max(RESOLUTION, len(positions) // 6), len(positions))
    frequency, density = welch(positions, 1.0 / period, "hann", length, detrend="linear", axis=0)
    kernel = np.ones(5) / 5.0
    smooth = np.stack([np.convolve(row, kernel, mode="same") for row in density.T], axis=1)
    return np.asarray(frequency[3:]), smooth[3:]


def _floor(frequency: Floats, density: Floats) -> float:
    """The level of the noise: the least median over parts of the upper half of the spectrum."""
    top = float(frequency[-1])
    edges = np.linspace(0.5, 0.95, 5) * top
    inside = [density[(frequency >= a) & (frequency < b)] for a, b in pairwise(edges)]
    return min((float(np.median(part)) for part in inside if len(part)), default=0.0)


def smoothed(
    record: Record, number: int, sampling: Sampling, channels: Channels, band: Band, timing: TorqueTiming
) -> Iterator[Stretch]:
    """The stretches of a record, smoothed and thinned; those too short for the kernel are left out."""
    check_memory(
        8.0 * 6.0 * len(channels.force) * sampling.rows / band.stride,
        f"the smoothed samples of {record.label}",
        "give a shorter record",
    )
    buffer: list[Floats] = []
    first, begin = -1, -1
    parts = list[Stretch]()
    reach = 2 * band.wide.half(band.period)  # of the rates, and of their signs' kernel
    for piece in sampling.stretches(record):
        rows = piece["row"]
        if not len(rows):
            continue
        time, q, force = piece["time_s"], channels.coordinates(piece), channels.forces(piece)
        own = np.concatenate([time[:, None], q, force], axis=1)
        follows = buffer and rows[0] == first + len(buffer[0]) and not np.isin(rows[0], sampling.runs[:, 0])
        if follows:
            own = np.concatenate([buffer[0], own])
        else:
            if parts:
                yield _joined(parts)
                parts = []
            first, begin = int(rows[0]), int(rows[0]) + reach
        buffer = [own]
        count = (first + len(own) - reach - begin - 1) // band.stride + 1
        if count <= 0:
            continue
        parts.append(_smooth(own, number, begin - first, count, band, timing, q.shape[1]))
        begin += count * band.stride
        kept = begin - reach - first
        buffer, first = [own[kept:]], first + kept
    if parts:
        yield _joined(parts)


def _joined(parts: Sequence[Stretch]) -> Stretch:
    return Stretch(parts[0].record, *(np.concatenate([getattr(one, name) for one in parts]) for name in STRETCH))


def _smooth(
    table: Floats, number: int, middle: int, count: int, band: Band, timing: TorqueTiming, d: int
) -> Stretch:
    """Smoothed samples about rows middle, middle + stride, ..., of a table of time, coordinates and forces."""
    kernel, period = band.wide, band.period
    half, last = kernel.half(period), (count - 1) * band.stride
    around = slice(middle - 2 * half, middle + last + 2 * half + 1)
    near, thinned = slice(half, 3 * half + last + 1), slice(None, None, band.stride)
    q, force = table[around, 1 : 1 + d], table[around, 1 + d :][near]
    taps = [kernel.taps(period, k) for k in range(3)]
    late = kernel.taps(period, 0, timing.shift) + timing.spread * kernel.taps(period, 2, timing.shift)
    rates = convolved(q, taps[1])
    return Stretch(
        number,
        table[middle : middle + last + 1 : band.stride, 0],
        convolved(q[near], taps[0])[thinned],
        rates[half : half + last + 1][thinned],
        convolved(q[near], taps[2])[thinned],
        convolved(_signs(rates, band), taps[0])[thinned],
        convolved(force, late)[thinned],
    )


def _signs(rates: Floats, band: Band) -> Floats:
    """Signs of rates, going through 0 in a straight line where noise decides on them."""
    kernel, period = band.wide, band.period
    size = np.sqrt(band.noise / (2.0 * period) * float(np.sum(kernel.taps(period, 1) ** 2)))
    return np.clip(rates / np.maximum(2.0 * size, 1e-300), -1.0, 1.0)
