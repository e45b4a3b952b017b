"""The handle's sound: what is read back from the file is the vibration, at the pitch that was told."""

from __future__ import annotations

import wave
from dataclasses import replace

import numpy as np
import pytest

from tests.systems import published
from zwidth.contact.environments import ENVIRONMENTS
from zwidth.contact.simulate import simulate
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.model.plant import Plant
from zwidth.show.output import OutputError
from zwidth.show.sound import FADE, PEAK, RATE, Silence, sound_of, speed_for, write_sound

WALL = ENVIRONMENTS["wall"]


def ringing(frequency, duration, *, period=1e-4, delay=0.0, substeps=20):
    """A mass of 1 kg on a spring of this frequency, with very little damping, and next to no wall."""
    one = np.ones(1)
    omega = 2.0 * np.pi * frequency
    plant = Plant(np.eye(1), np.array([[1e-6 * omega]]), np.array([[omega**2]]), one, one, one)
    loop = Loop(plant, Controller(period, delay))
    values = WALL.values(stiffness=1e-3, damping=0.0)
    return simulate(loop, WALL, values, duration=duration, start_position=1e-4, substeps=substeps)


def read(path):
    with wave.open(str(path), "rb") as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 2, RATE)
        return np.frombuffer(file.readframes(file.getnframes()), dtype="<i2") / 32767.0


def peak(samples):
    """The largest line of the spectrum [Hz], and the width of a bin."""
    lines = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    width = RATE / len(samples)
    return np.argmax(lines) * width, width


@pytest.mark.parametrize(
    ("frequency", "duration", "speed"),
    [(17.25, 9.0, 8.0), (59.0, 3.0, 2.0), (61.0, 1.5, 1.0), (1000.0, 1.5, 1.0), (0.5, 600.0, 256.0)],
)
def test_the_file_has_its_peak_where_it_is_told(tmp_path, frequency, duration, speed):
    response = ringing(frequency, duration, period=min(0.05 / frequency, 0.01))
    sound = sound_of(response)
    write_sound(tmp_path / "a.wav", sound)
    heard = read(tmp_path / "a.wav")
    found, width = peak(heard)
    assert (sound.speed, sound.repeats) == (speed, 1)
    assert sound.seconds == len(heard) / RATE >= 1.0
    assert abs(found - speed * frequency) < width
    assert sound.frequency == pytest.approx(speed * frequency, abs=0.1 * width)


def test_a_fraction_of_a_delay_makes_no_other_sound():
    even, uneven = (sound_of(ringing(440.0, 1.2, delay=delay)) for delay in (0.0, 0.37))
    inner = slice(0, 48_000)  # the last second differs by where it ends
    assert uneven.samples[inner] == pytest.approx(even.samples[inner], abs=2e-3)
    coarse = sound_of(ringing(440.0, 1.2, substeps=2))
    assert coarse.samples[inner] == pytest.approx(even.samples[inner], abs=2e-3)


def test_the_sound_is_the_velocity_as_loud_as_it_goes_and_faded():
    sound = sound_of(ringing(440.0, 1.2))
    assert np.abs(sound.samples).max() == pytest.approx(PEAK)
    t = np.arange(len(sound.samples)) / RATE
    inner = (t > 0.1) & (t < 1.0)
    pure = -PEAK * np.sin(2.0 * np.pi * 440.0 * t)
    assert sound.samples[inner] == pytest.approx(pure[inner], abs=5e-3)  # less its straight line
    for end in (sound.samples[:20], sound.samples[-20:]):
        assert np.abs(end).max() < 0.01
    count = int(FADE * RATE)
    assert np.abs(sound.samples[: count // 4]).max() < 0.3 < np.abs(sound.samples[count : 3 * count]).max()


def test_a_short_run_is_repeated_whole():
    sound = sound_of(ringing(440.0, 0.3))
    assert sound.repeats == 4
    assert sound.seconds == pytest.approx(1.2, abs=1e-3)
    once = len(sound.samples) // 4
    assert np.array_equal(sound.samples[:once], sound.samples[once : 2 * once])


def test_a_vibration_beyond_hearing_is_slowed_down():
    sound = sound_of(ringing(30_000.0, 0.5, period=1e-6, substeps=2))
    assert sound.speed == 0.25
    found, width = peak(sound.samples)
    assert found == pytest.approx(7500.0, abs=width)


def test_octaves():
    assert [speed_for(f) for f in (60.0, 59.9, 40.0, 10_000.0, 10_001.0, float("nan"))] == [1, 2, 4, 1, 0.5, 1]
    for f in np.geomspace(1e-3, 1e6, 50):
        assert speed_for(f) == 1.0 or 110.0 <= f * speed_for(f) < 220.0 or 5000.0 < f * speed_for(f) <= 10_000.0


def test_growth_without_bounds_is_heard_as_far_as_it_is_a_number():
    loop = published()
    response = simulate(loop, WALL, WALL.values(stiffness=1e8, damping=0.0), duration=1.0, start_position=1e-3)
    assert not np.all(np.isfinite(response.trail))
    sound = sound_of(response)
    assert np.all(np.isfinite(sound.samples))
    assert np.abs(sound.samples).max() == pytest.approx(PEAK)


def test_silence_is_refused():
    with pytest.raises(Silence, match="nothing vibrates"):
        sound_of(replace_start(ringing(440.0, 0.5)))
    with pytest.raises(ValueError, match="no trail"):
        sound_of(replace(ringing(440.0, 0.1), trail=np.zeros(0)))


def replace_start(response):
    """The same, standing still away from zero."""
    still = np.full(len(response.trail), 0.01)
    return replace(response, trail=still, handle=np.full(len(response.handle), 0.01))


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    file = tmp_path / "a.wav"
    file.write_bytes(b"before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("zwidth.show.output.os.replace", full)
    with pytest.raises(OutputError, match="no space left"):
        write_sound(file, sound_of(ringing(440.0, 0.1)))
    assert file.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [file]
