"""`zwidth identify`: what it prints, writes and refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

import zwidth
from tests.cli.command_runner import run_command
from tests.identify.spring_bench import bench_record
from zwidth.device import edited_text
from zwidth.show import csv_text
from zwidth.show import zwidth as group

STIFFNESS = "mechanism.drives.motor-right.stiffness_Nm_per_rad"
SPRING = {"forward": 0.45, "backward": 0.35, "friction": 0.003, "amplitude": 0.045}


@pytest.fixture(scope="module")
def strokes(tmp_path_factory):
    path = tmp_path_factory.mktemp("identify") / "strokes.csv"
    path.write_text(csv_text(bench_record(1, **SPRING)), encoding="utf-8")
    return path


@pytest.fixture
def device(tmp_path):
    from importlib.resources import files

    path = tmp_path / "mine.toml"
    text = (files("zwidth.device") / "zoo" / "five-bar.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("stiffness_Nm_per_rad = 0.45", "stiffness_Nm_per_rad = 0.45  # from the thesis"))
    return path


def test_the_document_has_the_keys_promised(strokes):
    ran = run_command("identify", "stiffness", strokes, "--device", "five-bar", "--joint", "upper-right", "--json")
    assert ran.code == 0
    document = json.loads(ran.out)
    assert {"what", "passed", "reason"} <= set(document["check"][0])
    assert {"path", "value", "low", "high", "unit"} <= set(document["parameters"][0])
    first = document["parameters"][0]
    assert (first["path"], first["unit"]) == (STIFFNESS, "N m/rad")
    assert first["low"] < first["value"] < first["high"]
    assert 0.99 < document["validation"] <= 1.0


def test_the_numbers_are_written_and_nothing_else_changes(strokes, device):
    before = device.read_text()
    ran = run_command("identify", "stiffness", strokes, "--device", device, "--joint", "1", "--write", "--json")
    assert ran.code == 0
    document = json.loads(ran.out)
    assert document["written"] == str(device)
    after = zwidth.load(device)
    written = {one["path"]: one["value"] for one in document["parameters"] if one["path"]}
    drive = after.document["mechanism"]["drives"][0]
    for path, value in written.items():
        assert drive[path.rpartition(".")[2]] == pytest.approx(value, rel=1e-4)
        assert "strokes.csv" in after.sources[path]
        assert "95 %" in after.sources[path]
    assert "# from the " in device.read_text()
    gone = dict.fromkeys(written, "unset") | {STIFFNESS: 0.45}
    assert edited_text(device, gone).replace("0.45  #", "0.45  #").splitlines()[-20:] == before.splitlines()[-20:]


def test_an_offer_to_write_is_made_only_where_it_makes_sense(strokes, device):
    words = ("identify", "stiffness", strokes, "--device", device, "--joint", "upper-right")
    assert "add --write" in run_command(*words).out
    ran = run_command(*words, "--write")
    assert "add --write" not in ran.out
    assert f"written: {device}" in ran.out


def test_a_refused_record_has_no_answer_and_writes_nothing(tmp_path, device):
    record = bench_record(1, **SPRING)
    path = tmp_path / "swapped.csv"
    path.write_text(csv_text({"torque_Nm": record["angle_rad"], "angle_rad": record["torque_Nm"]}))
    before = device.read_text()
    figure = tmp_path / "figure.svg"
    words = ("identify", "stiffness", path, "--device", device, "--joint", "upper-right", "--write")
    ran = run_command(*words, "--json", "--output", figure)
    document = json.loads(ran.out)
    assert ran.code == 1
    assert "swapped" in document["reason"]
    assert document["parameters"] == []
    assert document["validation"] is None
    assert "written" not in document
    assert device.read_text() == before
    assert not figure.exists()
    shown = run_command(*words)
    assert shown.code == 1
    assert "hysteresis" in shown.out
    assert "zwidth: hysteresis: " in shown.err


@pytest.mark.parametrize("ending", [".svg", ".csv", ".json"])
def test_figure_and_data_are_written(strokes, tmp_path, ending):
    path = tmp_path / f"result{ending}"
    ran = run_command("identify", "stiffness", strokes, "--device", "five-bar", "--joint", "1", "--output", path)
    assert ran.code == 0
    text = path.read_text()
    if ending == ".csv":
        columns = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
        assert {"angle_rad", "torque_Nm", "fitted_torque_Nm"} <= set(columns.dtype.names)
    else:
        assert {".svg": "<svg", ".json": '"parameters"'}[ending] in text


@pytest.mark.parametrize("kind", sorted(group.commands["identify"].commands))
def test_every_kind_explains_itself(kind):
    ran = run_command("identify", kind, "--help")
    assert (ran.code, ran.err) == (0, "")
    assert f"zwidth identify {kind} " in ran.out.partition("Example:")[2]
    assert all(
        option.help for option in group.commands["identify"].commands[kind].params if option.opts[0][0] == "-"
    )


def test_the_kinds_are_listed():
    ran = run_command("identify")
    assert ran.code == 0
    assert "\n  stiffness " in ran.out
