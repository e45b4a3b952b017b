"""`zwidth new`: the file that it writes, by whatever name, and what it refuses."""

from __future__ import annotations

import json
import shlex
import tomllib

import pytest

from tests.cli.command_runner import document_of, run_command
from tests.undrawn_figures import leave_undrawn
from zwidth.device import new_device
from zwidth.device.read import KINDS


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


DRAWN = ("five-bar", "plant")  # kinds whose report is drawn: a mechanism, and masses


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_device_answers_at_once_without_a_word(folder, monkeypatch, kind):
    document = document_of("new", "mine", "--kind", kind)
    assert document == {"name": "mine", "kind": kind, "file": str(folder / "mine.toml")}
    assert (folder / "mine.toml").read_text() == new_device("mine", kind)
    endings = ("Nm_per_rad", "kg_m2") if kind == "wrist" else ("N_per_m", "kg")
    assert document_of("chart", "mine.toml")[f"stiffness_max_{endings[0]}"] > 500.0
    assert document_of("show", "mine.toml")[f"rigid_mass_{endings[1]}"] > 0.001
    if kind not in DRAWN:
        leave_undrawn(monkeypatch)
    assert document_of("report", "mine.toml", "--output", "mine.html")["file"] == str(folder / "mine.html")
    for words in (("chart", "mine.toml"), ("show", "mine.toml")):
        ran = run_command(*words)
        assert (ran.code, ran.err) == (0, "")
        assert ran.out.startswith("mine: ")


def test_people_are_told_what_to_type_next(folder):
    ran = run_command("new", "my device", "--kind", "plant")
    assert (ran.code, ran.err) == (0, "")
    (line,) = [line for line in ran.out.splitlines() if "zwidth chart" in line]
    assert run_command(*shlex.split(line)[1:]).code == 0
    assert f"written: {folder / 'my device.toml'}" in ran.out


@pytest.mark.parametrize(
    ("typed", "file", "name"),
    [
        ("my device", "my device.toml", "my device"),
        ('5" arm', '5" arm.toml', '5" arm'),
        ("it's", "it's.toml", "it's"),
        ("arm.toml", "arm.toml", "arm"),
        ("v1.2", "v1.2.toml", "v1.2"),
        ("designs/arm", "designs/arm.toml", "arm"),
        ("-x", "-x.toml", "-x"),
    ],
)
def test_a_name_makes_the_file_s_name_and_the_device_s(folder, typed, file, name):
    (folder / "designs").mkdir()
    ran = run_command("new", "--kind", "plant", "--json", "--", typed)
    assert ran.code == 0, ran.err
    assert json.loads(ran.out)["name"] == name
    assert tomllib.loads((folder / file).read_text())["name"] == name


def test_another_file_may_be_named(folder):
    document_of("new", "My arm", "--kind", "serial-2r", "--output", "arm.toml")
    assert [path.name for path in folder.iterdir()] == ["arm.toml"]
    assert tomllib.loads((folder / "arm.toml").read_text())["name"] == "My arm"
