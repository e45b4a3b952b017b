"""The handle's sound: what is read back from the file is the vibration, at the pitch that was told."""

from __future__ import annotations

import wave
from functools import cache

import numpy as np
import pytest

from tests.cli.command_runner import document_of, run_command
from tests.systems import published
from zwidth.contact import ENVIRONMENTS, simulate
from zwidth.errors import OutputError
from zwidth.loop import Controller, Loop
from zwidth.model import Plant
from zwidth.show.sound import FADE, PEAK, RATE, sound_of, speed_for, write_sound

WALL = ENVIRONMENTS["wall"]

HEAVY = """
name = "heavy"
[plant]
mass_kg = 50
damping_Ns_per_m = 20
[friction]
coulomb_N = 10
[loop]
sampling_period_s = 0.005
[loop.encoder]
resolution_m = 1e-5
[loop.saturation]
force_N = 200
"""
PLAIN = """
name = "plain"
[plant]
mass_kg = 0.1
damping_Ns_per_m = 0.5
[loop]
sampling_period_s = 0.001
"""


@cache
def mass_on_spring_response(frequency, duration, *, period=1e-4, delay=0.0, substeps=20, amplitude=1e-4):
    """A mass of 1 kg on a spring of this frequency, with very little damping, and next to no wall."""
    one = np.ones(1)
    omega = 2.0 * np.pi * frequency
    plant = Plant(np.eye(1), np.array([[1e-6 * omega]]), np.array([[omega**2]]), one, one, one)
    loop = Loop(plant, Controller(period, delay))
    values = WALL.values(stiffness=1e-3, damping=0.0)
    return simulate(loop, WALL, values, duration=duration, start_position=amplitude, substeps=substeps)


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
    response = mass_on_spring_response(frequency, duration, period=min(0.05 / frequency, 0.01))
    sound = sound_of(response)
    write_sound(tmp_path / "a.wav", sound)
    heard = read(tmp_path / "a.wav")
    found, width = peak(heard)
    assert (sound.speed, sound.repeats) == (speed, 1)
    assert sound.seconds == len(heard) / RATE >= 1.0
    assert abs(found - speed * frequency) < width
    assert sound.frequency == pytest.approx(speed * frequency, abs=0.1 * width)


def test_a_fraction_of_a_delay_makes_no_other_sound():
    even, uneven = (sound_of(mass_on_spring_response(440.0, 1.2, delay=delay)) for delay in (0.0, 0.37))
    inner = slice(0, 48_000)  # the last second differs by where it ends
    assert uneven.samples[inner] == pytest.approx(even.samples[inner], abs=2e-3)
    coarse = sound_of(mass_on_spring_response(440.0, 1.2, substeps=2))
    assert coarse.samples[inner] == pytest.approx(even.samples[inner], abs=2e-3)


def test_the_sound_is_the_velocity_as_loud_as_it_goes_and_faded():
    sound = sound_of(mass_on_spring_response(440.0, 1.2))
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
    sound = sound_of(mass_on_spring_response(440.0, 0.3))
    assert sound.repeats == 4
    assert sound.seconds == pytest.approx(1.2, abs=1e-3)
    once = len(sound.samples) // 4
    assert np.array_equal(sound.samples[:once], sound.samples[once : 2 * once])


def test_a_vibration_beyond_hearing_is_slowed_down():
    sound = sound_of(mass_on_spring_response(30_000.0, 0.5, period=1e-6, substeps=2))
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


def test_ten_times_the_vibration_is_twenty_decibels_more(tmp_path):
    quiet, loud = (
        sound_of(mass_on_spring_response(440.0, 1.2, amplitude=amplitude), full_scale=1.0)
        for amplitude in (3e-5, 3e-4)
    )
    assert loud.level - quiet.level == pytest.approx(20.0, abs=1e-6)
    files = []
    for name, sound in (("quiet", quiet), ("loud", loud)):
        write_sound(tmp_path / f"{name}.wav", sound)
        files.append(np.sqrt(np.mean(read(tmp_path / f"{name}.wav") ** 2)))
    assert 20.0 * np.log10(files[1] / files[0]) == pytest.approx(20.0, abs=1e-3)
    speed = 2.0 * np.pi * 440.0 * 3e-4
    assert loud.peak_velocity == pytest.approx(speed, rel=0.01)
    assert np.abs(loud.samples).max() == pytest.approx(speed, rel=0.01)
    assert (loud.full_scale, loud.clipped_share) == (1.0, 0.0)


def test_left_alone_both_are_as_loud_as_they_go():
    quiet, loud = (
        sound_of(mass_on_spring_response(440.0, 1.2, amplitude=amplitude)) for amplitude in (3e-5, 3e-4)
    )
    assert quiet.samples == pytest.approx(loud.samples, abs=1e-9)
    assert quiet.level == pytest.approx(-1.0)
    assert loud.full_scale == pytest.approx(10.0 * quiet.full_scale, rel=1e-9)


def test_what_is_faster_than_full_scale_is_clipped_and_counted():
    speed = 2.0 * np.pi * 440.0 * 1e-4
    sound = sound_of(mass_on_spring_response(440.0, 1.2), full_scale=0.5 * speed)
    assert np.abs(sound.samples).max() == 1.0
    assert sound.clipped_share == pytest.approx(2.0 / 3.0, abs=0.02)  # |sin| > 1/2
    assert np.mean(np.abs(sound.samples) == 1.0) == pytest.approx(sound.clipped_share, abs=1e-4)
    assert sound.level == pytest.approx(20.0 * np.log10(2.0), abs=0.1)


def test_growth_without_bounds_is_clipped_at_a_full_scale():
    loop = published()
    response = simulate(loop, WALL, WALL.values(stiffness=1e8, damping=0.0), duration=1.0, start_position=1e-3)
    sound = sound_of(response, full_scale=1e-9)
    assert np.all(np.abs(sound.samples) <= 1.0)
    assert 0.0 < sound.clipped_share <= 1.0


@pytest.mark.parametrize(("factor", "duration"), [(0.5, 4.0), (1.0, 4.0), (2.5, 4.0), (3.0, 4.0), (16.0, 18.0)])
def test_the_factor_moves_the_peak_by_that_factor(tmp_path, factor, duration):
    """Of records that are heard for a second at least, so that none is repeated."""
    response = mass_on_spring_response(171.0, duration, period=2e-4)
    sound = sound_of(response, pitch=factor)
    write_sound(tmp_path / "a.wav", sound)
    found, width = peak(read(tmp_path / "a.wav"))
    assert sound.speed == factor
    assert abs(found - 171.0 * factor) < width
    assert sound.frequency / sound_of(response, pitch=1).frequency == pytest.approx(factor, rel=1e-5)
    assert sound.seconds == pytest.approx(duration / factor, abs=0.01)


def test_a_pitch_is_suggested_where_a_loudspeaker_renders_little():
    low = mass_on_spring_response(171.0, 2.0)
    as_it_is = sound_of(low)
    assert (as_it_is.speed, as_it_is.suggested_pitch) == (1.0, 2.0)
    assert as_it_is.low_share > 0.99
    raised = sound_of(low, pitch=as_it_is.suggested_pitch)
    assert raised.low_share < 0.01
    assert raised.suggested_pitch is None
    assert np.array_equal(raised.samples, sound_of(low, pitch="auto").samples)
    assert sound_of(mass_on_spring_response(17.25, 9.0, period=1e-3)).suggested_pitch == 16.0
    assert sound_of(mass_on_spring_response(440.0, 1.2)).suggested_pitch is None


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    file = tmp_path / "a.wav"
    file.write_bytes(b"before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("zwidth.show.output.os.replace", full)
    with pytest.raises(OutputError, match="no space"):
        write_sound(file, sound_of(mass_on_spring_response(440.0, 0.1)))
    assert file.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("device", "words"),
    [
        (HEAVY, "--stiffness 1.5e6 --damping 3000 --start-position 0.01"),
        (HEAVY, "--stiffness 1.5e6 --damping 3000 --start-position 0.01 --duration 0.5"),
        (PLAIN, "--stiffness 1000 --damping 2"),
        (PLAIN, "--stiffness 1000 --damping 2 --duration 0.2"),
        (PLAIN, "--stiffness 1000 --damping 2 --duration 20"),
        (PLAIN, "--stiffness 1000 --damping -5"),
    ],
)
def test_the_files_spectrum_has_its_peak_where_it_is_told(tmp_path, device, words):
    (tmp_path / "own.toml").write_text(device)
    file = tmp_path / "own.wav"
    told = document_of("simulate", tmp_path / "own.toml", *words.split(), "--output", file)["sound"]
    with wave.open(str(file), "rb") as stored:
        samples = np.frombuffer(stored.readframes(stored.getnframes()), dtype="<i2").astype(float)
    width = RATE / len(samples)
    assert abs(np.argmax(np.abs(np.fft.rfft(samples))) * width - told["frequency_Hz"]) < width
    if "--duration" not in words and "-5" not in words:
        assert told["seconds"] / told["repeats"] > 0.249


SLOW = ("--stiffness", 1000, "--damping", 0.02, "--duration", 5)  # 16 Hz, which hardly decays


def simulated_sound(folder, *words):
    """What the command says of the sound of a slow vibration, and its samples."""
    (folder / "own.toml").write_text(PLAIN)
    file = folder / "own.wav"
    told = document_of("simulate", folder / "own.toml", *SLOW, *words, "--output", file)["sound"]
    with wave.open(str(file), "rb") as stored:
        return told, np.frombuffer(stored.readframes(stored.getnframes()), dtype="<i2").astype(float)


def test_two_files_of_one_full_scale_compare(tmp_path):
    (quiet, few), (loud, many) = (
        simulated_sound(tmp_path, "--sound-full-scale", 1, "--start-position", start) for start in (0.0005, 0.005)
    )
    assert loud["peak_dBFS"] - quiet["peak_dBFS"] == pytest.approx(20.0, abs=1e-6)
    assert np.abs(many).max() / np.abs(few).max() == pytest.approx(10.0, rel=1e-3)
    assert np.abs(many).max() / 32767.0 == pytest.approx(loud["peak_m_per_s"], rel=1e-3)
    assert (quiet["full_scale_m_per_s"], quiet["clipped_share"]) == (1.0, 0.0)


@pytest.mark.parametrize(("pitch", "speed"), [("20", 20.0), ("auto", 16.0), (None, 8.0)])
def test_the_pitch_is_as_given(tmp_path, pitch, speed):
    words = () if pitch is None else ("--sound-pitch", pitch)
    told, samples = simulated_sound(tmp_path, *words)
    assert told["speed"] == speed
    assert told["frequency_Hz"] == pytest.approx(15.91 * speed, rel=0.01)
    assert told["suggested_pitch"] == (16.0 if pitch is None else None)
    energy = np.abs(np.fft.rfft(samples)) ** 2
    low = np.fft.rfftfreq(len(samples), 1.0 / RATE) < 200.0
    assert told["share_below_200_Hz"] == pytest.approx(energy[low].sum() / energy.sum(), abs=1e-3)


def test_too_quiet_for_a_full_scale_is_no_answer(tmp_path):
    (tmp_path / "own.toml").write_text(PLAIN)
    file = tmp_path / "a.wav"
    words = ("--stiffness", 1000, "--damping", 2, "--sound-full-scale", 1e6, "--output", file, "--json")
    ran = run_command("simulate", tmp_path / "own.toml", *words)
    assert ran.code == 1
    assert "scale of 1e+06 m/s" in ran.document["reason"]
    assert not file.exists()


def test_a_default_run_tells_the_frequency_of_the_linear_loop(tmp_path):
    (tmp_path / "own.toml").write_text(PLAIN)
    document = document_of("simulate", tmp_path / "own.toml", "--stiffness", 1000, "--damping", 2)
    assert document["dominant_frequency_Hz"] == pytest.approx(15.98, abs=0.02)
    assert document["duration_s"] == pytest.approx(8.0 / 15.98, abs=0.002)
