"""What the terminal says beside its numbers."""

from __future__ import annotations

import pytest

from tests.cli.command_runner import MECHANISM, ONE_MASS, run_command

UNSTABLE_MODE = """
name = "away"
[plant]
mass_kg = [[0.1, 0.0], [0.0, 0.2]]
damping_Ns_per_m = [[1.0, 0.0], [0.0, 1.0]]
stiffness_N_per_m = [[0.0, 0.0], [0.0, STIFFNESS]]
actuator = [1.0, 0.0]
sensor = [1.0, 0.0]
[loop]
sampling_period_s = 0.001
"""


def test_manipulabilities_have_units():
    text = run_command("show", MECHANISM).out
    assert "0.02271 m²" in text
    assert "1/(kg m)²" in text


def test_why_no_damping_is_stable_at_small_stiffness():
    words = "because walls of small stiffness are unstable"
    assert words in run_command("chart", ONE_MASS, "--set", "plant.stiffness_N_per_m=-50").out
    assert words not in run_command("chart", ONE_MASS).out


@pytest.mark.parametrize(("stiffness", "warned"), [(-50.0, True), (50.0, False)])
def test_a_device_that_runs_away_is_warned_of(tmp_path, stiffness, warned):
    file = tmp_path / "away.toml"
    file.write_text(UNSTABLE_MODE.replace("STIFFNESS", str(stiffness)))
    assert ("WARNING" in run_command("chart", file).out) == warned
