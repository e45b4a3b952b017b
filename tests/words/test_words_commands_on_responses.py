"""What commands print and refuse about a measured response."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cli import test_cli_measured
from tests.cli.command_runner import document_of, refusal_lines, run_command
from tests.cli.test_cli_measured import DEVICE, LOOP, short_response, spectrum
from tests.measured_cases import measured_response

device = test_cli_measured.device
lossy = test_cli_measured.lossy


def test_options_that_need_a_model_and_faults_of_the_file_are_refused(device, tmp_path):
    assert refusal_lines("chart", device, "--model", "rigid") == [
        f"{device}: model: does not apply to a device given by its [response]; leave it out"
    ]
    (line,) = refusal_lines("check", device, "--at", "0,1", "--stiffness", "1", "--damping", "1")
    assert "at: does not apply" in line
    text = (tmp_path / "sweep.csv").read_text().splitlines()
    (tmp_path / "sweep.csv").write_text("\n".join([text[0], text[2], text[1], *text[3:]]))
    (line,) = refusal_lines("chart", device)
    assert (
        line == f"{tmp_path / 'sweep.csv'}: line 3: frequency_Hz: 1 follows 2; sort the lines by rising frequency"
    )
    response, _ = measured_response(LOOP, np.linspace(1.0, 400.0, 400))
    spectrum(tmp_path / "sweep.csv", response.frequency, 1j * np.conj(response.value))
    (line,) = refusal_lines("chart", device)
    assert "are columns swapped" in line


def test_a_loss_factor_is_charted_and_checked_on_the_full_model_only(lossy):
    wall = ("--stiffness", "100", "--damping", "1")
    for model in ("two-mass", "motor-mass", "rigid"):
        for command in (("chart", lossy), ("check", lossy, *wall)):
            (line,) = refusal_lines(*command, "--model", model)
            assert line.endswith(
                f"model {model}: a loss factor is charted on the full model only; leave model out"
            )
    assert document_of("check", lossy, *wall, "--model", "full")["points"][0]["verdict"] == "stable"


def test_a_loss_factor_needs_a_stiffness(lossy):
    for change in ("unset", "[[0.0, 0.0], [0.0, 0.0]]"):
        (line,) = refusal_lines("chart", lossy, "--set", f"plant.stiffness_N_per_m={change}")
        assert "plant.loss_factor: is a share of the stiffness, and there is none" in line


def test_a_response_cut_short_warns_above_the_numbers(tmp_path):
    short = short_response(tmp_path, 300.0)
    chart, text = document_of("chart", short), run_command("chart", short).out
    assert chart["measured_up_to_share"] == pytest.approx(0.75)
    assert chart["warning"].startswith("measured up to 300.0 Hz, 75.00 % of half the sampling rate (400.0 Hz)")
    assert "walls that are unstable only above it are not found" in chart["warning"]
    assert text.index("warning: measured up to 300.0 Hz") < text.index("largest stiffness")


def test_a_sweep_whose_time_falls_is_told_so(tmp_path):
    lines = [f"{0.00125 * (50 - n)},{n % 3},0.0" for n in range(50)]
    (tmp_path / "back.csv").write_text("\n".join(["time_s,force_command_N,position_m", *lines]) + "\n")
    (tmp_path / "device.toml").write_text(DEVICE.format('file = "back.csv"'))
    assert "the time falls" in refusal_lines("chart", tmp_path / "device.toml")[0]


def test_robust_says_what_can_vary_beside_a_response(device):
    (line,) = refusal_lines("robust", device)
    assert "nothing varies; give --range PATH=LOW,HIGH or --operators A,B,C, or repeat the sweep" in line
    (line,) = refusal_lines("robust", device, "--range", "response.averages=1,2")
    assert "response.averages: is no number that can vary beside a measured response" in line
    assert "repeat the sweep to see the device itself vary" in line
    (line,) = refusal_lines("robust", device, "--operators", "none,course-hand")
    assert "course-hand cannot be attached to this [response]: it has no path" in line


@pytest.mark.parametrize("command", [("felt", "--stiffness", 1, "--damping", 1), ("guarantees",)])
def test_what_needs_the_handle_says_which_paths_are_missing(device, command):
    (line,) = refusal_lines(command[0], device, *command[1:])
    assert "has no path from the handle's force to the encoder, from the command to the handle" in line
    assert 'state handle_at = "sensor"' in line
