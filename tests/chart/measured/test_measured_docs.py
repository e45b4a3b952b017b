"""The page on measured devices runs, and its keys are those that come out."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.cli.command_runner import document_of
from zwidth.chart import MeasuredChart
from zwidth.device.load import load

PAGE = (Path(__file__).parents[3] / "docs" / "measured.md").read_text(encoding="utf-8")


def block(language):
    return blocks(language)[0]


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_python_example_says_what_its_comments_say():
    names: dict[str, object] = {}
    exec(compile(block("python"), "measured.md", "exec"), names)
    chart = names["chart"]
    assert isinstance(chart, MeasuredChart)
    assert chart.stiffness_max == pytest.approx((12.0 - 8.0 * 2.0**0.5) * 0.1 / 0.001**2, rel=1e-7)
    assert round(chart.stiffness_max) == 68629
    assert chart.integrators == 2
    assert chart.check(50000.0, [30.0, 80.0]).names == ["unstable", "stable"]


def test_the_device_file_is_charted_and_its_keys_are_explained(tmp_path):
    f = np.linspace(0.5, 500.0, 400)
    z = np.exp(2j * np.pi * f * 0.001)
    P = 5e-6 * (z + 1) / (z - 1) ** 2
    file = tomllib.loads(block("toml"))["response"]["file"]
    lines = [f"{a!r},{b.real!r},{b.imag!r}" for a, b in zip(f.tolist(), P.tolist(), strict=True)]
    (tmp_path / file).write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *lines]))
    (tmp_path / "prototype.toml").write_text(block("toml"))
    document = document_of("chart", tmp_path / "prototype.toml")
    table = PAGE.partition("## Keys of")[2]
    firsts = re.findall(r"^\| (`[^|]*`) \|", table, re.MULTILINE)
    explained = {key for first in firsts for key in re.findall(r"`(\w+)`", first)}
    assert explained <= set(document)
    assert explained == set(document) - set(document_of("chart", "published-two-mass"))


def test_the_keys_of_the_handle_are_those_of_the_file(tmp_path):
    f = np.linspace(0.5, 500.0, 400)
    z = np.exp(2j * np.pi * f * 0.001)
    P = 5e-6 * (z + 1) / (z - 1) ** 2
    rows = [f"{a},{b.real!r},{b.imag!r}" for a, b in zip(f.tolist(), P.tolist(), strict=True)]
    (tmp_path / "sweep.csv").write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *rows]) + "\n")
    text = 'name = "held"\n' + blocks("toml")[1] + "[loop]\nsampling_period_s = 0.001\n"
    (tmp_path / "device.toml").write_text(text)
    response = load(tmp_path / "device.toml").response
    assert (response.handle.missing, response.delay) == ((), 0.4)
