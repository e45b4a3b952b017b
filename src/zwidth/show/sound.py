"""The vibration of the handle as sound.

What is heard is the handle's velocity. In its position a slow drift drowns the vibration; in its acceleration
every step of the held force is a click. A vibration too low for a loudspeaker is played faster, one too high
slower, by whole octaves.
"""

from __future__ import annotations

import wave
from dataclasses import dataclass
from math import ceil, floor, log2
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.contact.response import TimeResponse
from zwidth.contact.verdict import QUIET, dominant_frequency
from zwidth.show.output import replacing

Floats = NDArray[np.float64]

RATE: Final = 48_000  # samples a second
LOW: Final = 60.0  # Hz, below which it is raised
RAISED_TO: Final = 110.0  # Hz, at least
HIGH: Final = 10_000.0  # Hz
SHORTEST: Final = 1.0  # s
PASSAGE: Final = 0.25  # s, below which repeats are heard as a tone of their own
FADE: Final = 0.01  # s
PEAK: Final = 10.0 ** (-1.0 / 20.0)  # of full scale, -1 dBFS
FINER: Final = 4  # points of the trail for each of the sound, where there are more
FEWEST: Final = 16  # points of the trail


class Silence(ValueError):
    """There is nothing to hear."""


@dataclass(frozen=True)
class Sound:
    """One sound.

    samples    (k,) at RATE, from -1 to 1
    speed      how much faster than it happened, a power of 2
    frequency  with the most of what the samples hold, all of them and their repeats [Hz]
    repeats    how many times the run stands in it
    """

    samples: Floats
    speed: float
    frequency: float
    repeats: int

    @property
    def seconds(self) -> float:
        """How long it lasts [s]."""
        return len(self.samples) / RATE


def sound_of(response: TimeResponse) -> Sound:
    """The handle's velocity, less its straight line, as loud as it goes, faded at both ends.

    A run that would be over in less than a second is repeated.
    Raises  Silence     where nothing vibrates, or the run is too short to tell
            ValueError  for a run without its trail
    """
    time, place = _moving(response)
    coarse = min(float(RATE), 2.0 / response.period)
    speed = speed_for(_late(_velocity(time, place, coarse), coarse))
    velocity = _velocity(time, place, RATE / speed)
    size = float(np.abs(velocity).max(initial=0.0))
    if len(velocity) < FEWEST or not size * (time[-1] - time[0]) > QUIET:
        raise Silence("nothing vibrates: there is nothing to hear")
    once = _faded(velocity / size)
    repeats = max(1, ceil(SHORTEST * RATE / len(once)))
    samples = np.tile(PEAK * once / np.abs(once).max(), repeats)
    return Sound(samples, speed, _heard(samples), repeats)


def seconds_to_hear(frequency: float) -> float:
    """How long a run lasts, at least, for a passage that can be repeated: one of a vibration at so many hertz [s].

    >>> seconds_to_hear(171.0), seconds_to_hear(17.25)
    (1.0, 2.0)
    """
    return max(SHORTEST, PASSAGE * speed_for(frequency))


def speed_for(frequency: float) -> float:
    """By how many times to play a vibration faster, a power of 2; below 1 is slower.

    >>> speed_for(17.25), speed_for(171.0), speed_for(25000.0)
    (8.0, 1.0, 0.25)
    """
    if not frequency > 0.0:
        return 1.0
    if frequency < LOW:
        return float(2.0 ** ceil(log2(RAISED_TO / frequency)))
    if frequency > HIGH:
        return float(2.0 ** floor(log2(HIGH / frequency)))
    return 1.0


def write_sound(path: Path, sound: Sound) -> None:
    """Write a mono file of 16 bits, whole or not at all. Raises OutputError where it cannot be written."""
    numbers = np.round(32767.0 * sound.samples).astype("<i2")
    with replacing(path) as draft, wave.open(str(draft), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(numbers.tobytes())


def _moving(response: TimeResponse) -> tuple[Floats, Floats]:
    """Time and place of the handle from the start on, as far as it is finite, the farthest place 1."""
    if not response.trail.size:
        raise ValueError("the run has no trail to be heard; simulate it with trail=True")
    time = np.concatenate([[0.0], response.trail_time])
    place = np.concatenate([response.handle[:1], response.trail])
    known = int(np.argmin(np.isfinite(place))) if not np.all(np.isfinite(place)) else len(place)
    if known < FEWEST:
        raise Silence("the run is too short to be heard")
    farthest = float(np.abs(place[:known]).max())
    return time[:known], place[:known] / (farthest or 1.0)


def _heard(samples: Floats) -> float:
    """The peak of the spectrum of all that is played [Hz], between bins by a parabola through the logarithms.

    Without a window, which would take away a vibration that dies early.
    """
    count = 4 * len(samples)
    spectrum = np.abs(np.fft.rfft(samples, count))
    at = int(np.argmax(spectrum[1:-1])) + 1
    a, b, c = np.log(np.maximum(spectrum[at - 1 : at + 2], 1e-300))
    bend = a - 2.0 * b + c
    shift = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
    return float((at + np.clip(shift, -0.5, 0.5)) * RATE / count)


def _late(velocity: Floats, rate: float) -> float:
    """Dominant in the second half [Hz], or in all where nothing moves by then; nan where nothing does."""
    late = dominant_frequency(velocity[len(velocity) // 2 :], 1.0 / rate)
    return late if late > 0.0 else dominant_frequency(velocity, 1.0 / rate)


def _velocity(time: Floats, place: Floats, rate: float) -> Floats:
    """Velocity, evenly so many times a second, less its straight line.

    The trail's points are not even where a delay divides the interval: its cubic spline is differentiated at
    points that are, several times as many as are wanted where it has more, and these are filtered and thinned out.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import detrend, resample_poly

    trail_rate = (len(time) - 1) / (time[-1] - time[0])
    skip = max(1, int(trail_rate / (FINER * rate)))
    time, place = time[::skip], place[::skip]
    finer = max(1, min(FINER, ceil(trail_rate / skip / rate)))
    count = int((time[-1] - time[0]) * rate * finer)
    even = time[0] + np.arange(count) / (rate * finer)
    velocity = CubicSpline(time, place)(even, 1)
    if finer > 1:
        velocity = resample_poly(velocity, 1, finer)
    return np.asarray(detrend(velocity)) if len(velocity) else velocity


def _faded(signal: Floats) -> Floats:
    """The signal with a raised cosine at both ends."""
    count = min(int(FADE * RATE), len(signal) // 4)
    rise = np.sin(0.5 * np.pi * (np.arange(count) + 0.5) / max(count, 1)) ** 2
    shaped = signal.copy()
    shaped[:count] *= rise
    shaped[len(signal) - count :] *= rise[::-1]
    return shaped
