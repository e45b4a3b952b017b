"""The vibration of the handle as sound.

The sound is the handle's velocity: in its position a slow drift would drown the vibration, in its acceleration
every step of the held force would be a click.

Loudness: each sound is as loud as its file permits, or, with a full scale in m/s, as loud as the handle is fast,
so that two files compare. Velocities above the full scale are clipped.
Pitch: a vibration too low for a loudspeaker is played faster, one too high slower, by whole octaves; or by a
given factor.
"""

from __future__ import annotations

import wave
from dataclasses import dataclass
from math import ceil, floor, log2, log10
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.time_response import QUIET, TimeResponse, dominant_frequency
from zwidth.errors import NoAnswerError
from zwidth.show.output import replacing

Pitch = float | Literal["auto"] | None

RATE: Final = 48_000  # samples a second
LOW: Final = 60.0  # Hz, below which it is raised
RAISED_TO: Final = 110.0  # Hz, at least
RENDERED: Final = 200.0  # Hz, below which a small loudspeaker renders little
HIGH: Final = 10_000.0  # Hz
SHORTEST: Final = 1.0  # s
PASSAGE: Final = 0.25  # s, below which repeats are heard as a tone of their own
FADE: Final = 0.01  # s
PEAK: Final = 10.0 ** (-1.0 / 20.0)  # of full scale, -1 dBFS
FINER: Final = 4  # points of the trail for each of the sound, where there are more
FEWEST: Final = 16  # points of the trail
LARGEST_NUMBER: Final = 32767  # of 16 bits, at full scale


@dataclass(frozen=True)
class Sound:
    """One sound.

    samples        (k,) at RATE, from -1 to 1
    speed          how many times faster than it happened
    frequency      of the strongest vibration of all samples, repeats included [Hz]
    repeats        how many times it holds the run
    full_scale     velocity of the handle that is a sample of 1 [m/s]
    peak_velocity  largest velocity of the handle, less its straight line and faded [m/s]
    clipped_share  of the samples, those clipped at full scale
    low_share      of the energy, that below RENDERED, as heard
    """

    samples: Floats
    speed: float
    frequency: float
    repeats: int
    full_scale: float
    peak_velocity: float
    clipped_share: float
    low_share: float

    @property
    def seconds(self) -> float:
        """How long it lasts [s]."""
        return len(self.samples) / RATE

    @property
    def level(self) -> float:
        """Level of the largest velocity, before clipping [dB of full scale]."""
        return 20.0 * log10(self.peak_velocity / self.full_scale)

    @property
    def suggested_pitch(self) -> float | None:
        """Factor that raises the strongest vibration above RENDERED; None where most of the energy is there."""
        if self.low_share <= 0.5:
            return None
        return speed_for(self.frequency / self.speed, "auto")

    def document(self) -> dict[str, Any]:
        """Its numbers by key and unit."""
        return {
            "seconds": self.seconds,
            "speed": self.speed,
            "frequency_Hz": self.frequency,
            "repeats": self.repeats,
            "full_scale_m_per_s": self.full_scale,
            "peak_m_per_s": self.peak_velocity,
            "peak_dBFS": self.level,
            "clipped_share": self.clipped_share,
            "share_below_200_Hz": self.low_share,
            "suggested_pitch": self.suggested_pitch,
        }


def sound_of(response: TimeResponse, pitch: Pitch = None, full_scale: float | None = None) -> Sound:
    """The handle's velocity, less its straight line, faded at both ends.

    A run that would be over in less than a second is repeated.

    pitch       factor by which all frequencies are raised; or a rule (see `speed_for`)
    full_scale  velocity of the handle that is a sample of 1 [m/s]; None: as loud as it goes, the peak at PEAK
    Raises  NoAnswerError  where nothing vibrates, the run is too short to tell, or the full scale is so large
                           that 16 bits hold nothing of it
            ValueError     for a run without its trail
    """
    time, position, unit = _handle_motion(response)
    # Hz, at which the vibration's frequency is looked for, before the speed of the sound is known
    coarse = min(float(RATE), 2.0 / response.period)
    speed = speed_for(_late_frequency(_velocity(time, position, coarse), coarse), pitch)
    velocity = _velocity(time, position, RATE / speed)
    size = float(np.abs(velocity).max(initial=0.0))
    # velocity times duration is a motion, in units of the largest
    if len(velocity) < FEWEST or not size * (time[-1] - time[0]) > QUIET:
        raise NoAnswerError("nothing vibrates: there is nothing to hear")
    once = _faded(velocity)
    peak = float(np.abs(once).max())
    # full scale in units of `once`, since velocities of a run that grows without bounds overflow in m/s
    limit = peak / PEAK if full_scale is None else full_scale / unit
    # a peak below half a step of 16 bits
    if 2.0 * LARGEST_NUMBER * peak < limit:
        text = f"the vibration, of at most {peak * unit:.3g} m/s, is below the resolution of the file"
        raise NoAnswerError(f"{text} at a full scale of {full_scale:g} m/s")
    repeats = max(1, ceil(SHORTEST * RATE / len(once)))
    samples = np.tile(np.clip(once, -limit, limit) / limit, repeats)
    return Sound(
        samples=samples,
        speed=speed,
        frequency=_strongest_frequency(samples),
        repeats=repeats,
        full_scale=limit * unit if full_scale is None else full_scale,
        peak_velocity=peak * unit,
        clipped_share=float(np.mean(np.abs(once) > limit)),
        low_share=_share_below(samples, RENDERED),
    )


def seconds_to_hear(frequency: float, pitch: Pitch = None) -> float:
    """How long a run lasts, at least, for a passage that can be repeated: one of a vibration at so many hertz [s].

    >>> seconds_to_hear(171.0), seconds_to_hear(17.25), seconds_to_hear(17.25, 20.0)
    (1.0, 2.0, 5.0)
    """
    return max(SHORTEST, PASSAGE * speed_for(frequency, pitch))


def speed_for(frequency: float, pitch: Pitch = None) -> float:
    """By how many times to play a vibration faster; below 1 is slower.

    pitch  this factor; "auto": the octaves that raise it above RENDERED; None: from below LOW to above RAISED_TO.
           Both rules lower a vibration above HIGH.
    >>> speed_for(17.25), speed_for(171.0), speed_for(25000.0)
    (8.0, 1.0, 0.25)
    >>> speed_for(17.25, "auto"), speed_for(171.0, "auto"), speed_for(171.0, 3.0)
    (16.0, 2.0, 3.0)
    """
    if pitch is not None and pitch != "auto":
        return float(pitch)
    if not frequency > 0.0:
        return 1.0
    low, raised_to = (LOW, RAISED_TO) if pitch is None else (RENDERED, RENDERED)
    if frequency < low:
        return float(2.0 ** ceil(log2(raised_to / frequency)))
    if frequency > HIGH:
        return float(2.0 ** floor(log2(HIGH / frequency)))
    return 1.0


def write_sound(path: Path, sound: Sound) -> None:
    """Write a mono file of 16 bits, whole or not at all. Raises OutputError where it cannot be written."""
    numbers = np.round(LARGEST_NUMBER * sound.samples).astype("<i2")
    with replacing(path) as draft, wave.open(str(draft), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(numbers.tobytes())


def _handle_motion(response: TimeResponse) -> tuple[Floats, Floats, float]:
    """Return the times of the handle's motion (k,) [s], its positions (k,), and the unit of these positions [m].

    The unit is the largest distance from zero. The motion ends before the first position that is not finite.
    Raises  ValueError for a run without its trail, NoAnswerError where fewer than FEWEST positions are finite
    """
    if not response.trail.size:
        raise ValueError("the run has no trail to be heard; simulate it with trail=True")
    time = np.concatenate([[0.0], response.trail_time])
    position = np.concatenate([response.handle[:1], response.trail])
    known = int(np.argmin(np.isfinite(position))) if not np.all(np.isfinite(position)) else len(position)
    if known < FEWEST:
        raise NoAnswerError("the run is too short to be heard")
    farthest = float(np.abs(position[:known]).max()) or 1.0
    return time[:known], position[:known] / farthest, farthest


def _strongest_frequency(samples: Floats) -> float:
    """The peak of the spectrum of all samples [Hz], between bins by a parabola through the logarithms.

    Without a window, which would take away a vibration that dies early. Zeros after the samples, three times as
    many, make the bins finer.
    """
    count = 4 * len(samples)
    spectrum = np.abs(np.fft.rfft(samples, count))
    top = int(np.argmax(spectrum[1:-1])) + 1
    before, highest, after = np.log(np.maximum(spectrum[top - 1 : top + 2], 1e-300))
    bend = before - 2.0 * highest + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float((top + np.clip(shift, -0.5, 0.5)) * RATE / count)


def _share_below(samples: Floats, frequency: float) -> float:
    """Share of the samples' energy that their spectrum has below a frequency [Hz]."""
    energy = np.abs(np.fft.rfft(samples)) ** 2
    below = np.arange(len(energy)) * RATE < frequency * len(samples)
    return float(energy[below].sum() / energy.sum())


def _late_frequency(velocity: Floats, rate: float) -> float:
    """Dominant frequency [Hz] in the second half of velocities at this rate [Hz].

    That of all velocities if nothing moves by then; nan if nothing ever does.
    """
    late = dominant_frequency(velocity[len(velocity) // 2 :], 1.0 / rate)
    return late if late > 0.0 else dominant_frequency(velocity, 1.0 / rate)


def _velocity(time: Floats, position: Floats, rate: float) -> Floats:
    """Velocity (n,) at evenly spaced times, at this rate [Hz], less its straight line.

    time, position  (k,) of the trail; the velocity is per second in the unit of the position
    The trail's points are not even where a delay divides the interval: its cubic spline is differentiated at
    points that are, several times as many as are wanted where it has more, and these are filtered and thinned out.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import detrend, resample_poly

    trail_rate = (len(time) - 1) / (time[-1] - time[0])  # points a second, in the mean
    skip = max(1, int(trail_rate / (FINER * rate)))
    time, position = time[::skip], position[::skip]
    finer = max(1, min(FINER, ceil(trail_rate / skip / rate)))
    count = int((time[-1] - time[0]) * rate * finer)
    even = time[0] + np.arange(count) / (rate * finer)
    velocity = CubicSpline(time, position)(even, 1)
    if finer > 1:
        velocity = resample_poly(velocity, 1, finer)
    return np.asarray(detrend(velocity)) if len(velocity) else velocity


def _faded(signal: Floats) -> Floats:
    """The signal with its first and last FADE seconds, a quarter of it at most, raised and lowered by a cosine."""
    count = min(int(FADE * RATE), len(signal) // 4)
    rise = np.sin(0.5 * np.pi * (np.arange(count) + 0.5) / max(count, 1)) ** 2
    shaped = signal.copy()
    shaped[:count] *= rise
    shaped[len(signal) - count :] *= rise[::-1]
    return shaped
