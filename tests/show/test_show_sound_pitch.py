"""The pitch told of a sound file is that of the file, of short runs and of repeated ones too."""

from __future__ import annotations

import wave

import numpy as np
import pytest

from tests.cli.cli_run import found
from zwidth.show.sound import RATE

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
    told = found("simulate", tmp_path / "own.toml", *words.split(), "--output", file)["sound"]
    with wave.open(str(file), "rb") as stored:
        samples = np.frombuffer(stored.readframes(stored.getnframes()), dtype="<i2").astype(float)
    width = RATE / len(samples)
    assert abs(np.argmax(np.abs(np.fft.rfft(samples))) * width - told["frequency_Hz"]) < width
    if "--duration" not in words and "-5" not in words:
        assert told["seconds"] / told["repeats"] > 0.249


def test_a_default_run_tells_the_frequency_of_the_linear_loop(tmp_path):
    (tmp_path / "own.toml").write_text(PLAIN)
    document = found("simulate", tmp_path / "own.toml", "--stiffness", 1000, "--damping", 2)
    assert document["dominant_frequency_Hz"] == pytest.approx(15.98, abs=0.02)
    assert document["duration_s"] == pytest.approx(8.0 / 15.98, abs=0.002)
