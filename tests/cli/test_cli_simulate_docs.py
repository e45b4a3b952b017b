"""The pages on `zwidth simulate`: their examples run, their numbers come out, every key is explained."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import get_args

import pytest

import zwidth as package
from tests.cli.command_runner import document_of, run_command
from zwidth.contact import SOURCES, limit_cycles
from zwidth.contact.time_response import Behaviour
from zwidth.show import SimulateCommand
from zwidth.show.cli.simulate import BEHAVIOUR_VERDICTS

PAGE = (Path(__file__).parents[2] / "docs" / "simulation.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("line", blocks("sh")[0].splitlines())
def test_an_example_of_the_page_runs(tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    ran = run_command(*shlex.split(line)[1:])
    assert (ran.code, ran.err) == (0, "")


def test_the_pages_python_says_what_is_printed_below(capsys):
    exec(compile(blocks("python")[0], "simulation.md", "exec"), {})
    assert f"```\n{capsys.readouterr().out}```" in PAGE


def test_the_pages_paddle_sticks_and_grows_where_it_says(tmp_path):
    (tmp_path / "paddle.toml").write_text(blocks("toml")[0])
    words = ("simulate", tmp_path / "paddle.toml", "--stiffness", 1500, "--damping", 0.2, "--start-position")
    assert document_of(*words, 0.00100)["stable"] is True
    assert document_of(*words, 0.00109)["behaviour"] == "growing"
    device = package.load(tmp_path / "paddle.toml")
    (between,) = limit_cycles(device.at().loop, 1500.0, 0.2)
    assert f"{between.amplitude * 1e3:.3f} mm" in PAGE


def test_the_pages_limited_paddle_goes_round_as_it_says(tmp_path):
    (tmp_path / "paddle.toml").write_text(blocks("toml")[0])
    limited = (
        tmp_path / "paddle.toml",
        "--stiffness",
        900,
        "--damping",
        0.2,
        "--set",
        "loop.saturation.force_N=10",
    )
    met = document_of("simulate", *limited, "--start-position", 0.011)
    cycle = max(
        document_of("limit-cycles", *limited, "--no-simulation")["limit_cycles"],
        key=lambda one: one["amplitude_m"],
    )
    text = " ".join(PAGE.split())
    assert met["behaviour"] == "limit cycle"
    assert f"{met['amplitude_m'] * 1e3:.1f} mm at {met['dominant_frequency_Hz']:.1f} Hz" in text
    assert f"{cycle['amplitude_m'] * 1e3:.2f} mm at {cycle['frequency_Hz']:.1f} Hz" in text


def test_every_word_of_the_verdict_and_every_entry_is_on_the_page():
    for word in BEHAVIOUR_VERDICTS:
        assert re.search(rf"^\| `{word}` \|", PAGE, re.MULTILINE)
    assert set(BEHAVIOUR_VERDICTS) == {*get_args(Behaviour), "forced"}
    for name in SOURCES:
        assert name in PAGE.partition("## The energy ledger")[2]


def test_the_commands_page_explains_every_key():
    page = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
    section = page.partition("\n## simulate\n")[2].partition("\n## ")[0].partition("| Key |")[2]
    named = set(re.findall(r"`(\w+)`", section))
    assert set(SimulateCommand.keys) <= named
