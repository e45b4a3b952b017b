"""A velocity estimate that is not linear has no chart: one line, and what to do instead."""

from __future__ import annotations

from math import pi

import pytest

from tests.cli.command_runner import MECHANISM, document_of, refusal_lines, run_command

DEVICE = """
name = "adaptive"
[plant]
mass_kg = 0.05
damping_Ns_per_m = 1.0
handle = 1.0
[loop]
sampling_period_s = 0.001
[loop.encoder]
resolution_m = 1e-5
[loop.velocity]
method = "foaw"
samples = 20
fit = "best-fit"
"""
RESPONSE = """
name = "swept"
[response]
file = "sweep.csv"
integrators = 1
[loop]
sampling_period_s = 0.001
[loop.velocity]
method = "levant"
acceleration_max_m_per_s2 = 30.0
"""
WALL = ("--stiffness", 100, "--damping", 1)
COMMANDS = {
    "chart": (),
    "check": WALL,
    "bounds": (),
    "report": (),
    "sensitivity": (),
    "felt": WALL,
    "robust": ("--range", "plant.mass_kg=0.04,0.06", "--members", 3, "--unseen", 2),
    "guarantees": (),
}
LEVANT = ("--set", "loop.velocity.method=levant", "--set", "loop.velocity.acceleration_max_m_per_s2=30")
LINEAR = ("--set", "loop.velocity.method=backward-difference")


@pytest.fixture
def device(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "adaptive.toml").write_text(DEVICE)
    return "adaptive.toml"


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("more", [(), ("--json",)], ids=["text", "json"])
def test_what_charts_refuses_in_one_line_and_writes_nothing(device, tmp_path, command, more):
    before = set(tmp_path.iterdir())
    (line,) = refusal_lines(command, device, *COMMANDS[command], *more)
    assert line.startswith(
        "adaptive.toml: adaptive windowing is not linear, so it has no chart; use zwidth simulate"
    )
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("command", ["chart", "polar", "bounds"])
def test_a_mechanism_is_refused_alike(command):
    (line,) = refusal_lines(command, MECHANISM, *LEVANT)
    assert line.startswith(f"{MECHANISM}: Levant's differentiator is not linear, so it has no chart")


def test_a_measured_device_is_refused_alike(device, tmp_path):
    (tmp_path / "swept.toml").write_text(RESPONSE)
    paddle = {f: 1.0 / ((1.0 + 0.05 * 2j * pi * f) * 2j * pi * f) for f in range(1, 401)}
    rows = [f"{f},{value.real},{value.imag}" for f, value in paddle.items()]
    (tmp_path / "sweep.csv").write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *rows]))
    for words in (("chart",), ("check", *WALL)):
        (line,) = refusal_lines(words[0], "swept.toml", *words[1:])
        assert line.startswith("swept.toml: Levant's differentiator is not linear")


def test_what_the_line_says_to_do_gives_a_chart(device):
    (line,) = refusal_lines("chart", device)
    setting = line.rpartition("with ")[2].split()
    assert tuple(setting) == LINEAR
    assert document_of("chart", device, *setting)["stiffness_max_N_per_m"] > 0.0


def test_what_needs_no_velocity_is_shown_with_the_method():
    ran = run_command("show", MECHANISM, *LEVANT)
    assert ran.code == 0
    assert "velocity by levant (acceleration max 30)" in ran.out


def test_the_method_is_told_with_its_parameters(device):
    ran = run_command("show", device)
    assert ran.code == 0
    assert "velocity by foaw (samples 20, position noise 5 × 10⁻⁶, best-fit)" in ran.out
