"""The page on the commands: its examples run, its keys are those that come out."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, run_command
from tests.identify.spring_bench import bench_record
from tests.undrawn_figures import leave_undrawn
from zwidth.show import csv_text
from zwidth.show import zwidth as group

PAGE = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
DEVICE = """
name = "my device"
[plant]
mass_kg = 0.05
damping_Ns_per_m = 1.0
[loop]
sampling_period_s = 0.001
[loop.velocity.filter]
type = "butterworth"
order = 2
cutoff_Hz = 20.0
"""

STUDY = """
device = "my-device.toml"
measures = ["stiffness_max", "fastest_decay"]
[[axis]]
key = "plant.mass_kg"
range = [0.02, 0.1]
count = 5
[[axis]]
key = "loop.delay_samples"
values = [0, 1]
[optimise]
objectives = { stiffness_max = "max", fastest_decay = "min" }
budget = 30
"""


def blocks(language: str) -> str:
    return "".join(re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))


def keys(section: str) -> set[str]:
    """The names in the first column of a section's table of keys."""
    text = PAGE.partition(f"\n## {section}\n")[2].partition("\n## ")[0].partition("| Key |")[2]
    return {
        name for row in re.findall(r"^\| (`.*?) \|", text, re.MULTILINE) for name in re.findall(r"`(\w+)`", row)
    }


TOLERANCES = """
device = "my-device.toml"
stiffness_N_per_m = 2006.7
damping_Ns_per_m = 0
draw = { samples = 72, index_samples = 32 }
[[tolerance]]
key = "plant.mass_kg"
distribution = "normal"
standard_deviation_percent = 10
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "my-device.toml").write_text(DEVICE)
    (tmp_path / "walls.csv").write_text("stiffness_N_per_m,damping_Ns_per_m\n4000,10\n9000,10\n")
    (tmp_path / "my-study.toml").write_text(STUDY)
    (tmp_path / "my-tolerances.toml").write_text(TOLERANCES)
    (tmp_path / "strokes.csv").write_text(csv_text(bench_record(1, forward=0.45, friction=0.003, amplitude=0.045)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def quick(monkeypatch):
    """Figures of reports are not drawn, and experiments seek the stiffest wall in one round of four."""
    leave_undrawn(monkeypatch)
    monkeypatch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 1)


# `zwidth compile` runs in test_first_use; the workbench goes on until ctrl-C, and runs in tests/app
ELSEWHERE = ("zwidth compile", "zwidth app")


@pytest.mark.parametrize("line", [one for one in blocks("sh").splitlines() if not one.startswith(ELSEWHERE)])
def test_an_example_runs(folder, quick, line):
    before = set(folder.iterdir())
    words = shlex.split(line)
    assert words[0] == "zwidth"
    ran = run_command(*words[1:])
    assert (ran.code, ran.err) == (0, "")
    assert ran.out
    written = {path.name for path in set(folder.iterdir()) - before}
    unnamed = {"report": "my-device-report.html", "new": f"{words[2]}.toml"} if len(words) > 2 else {}
    expected = re.findall(r"--output (\S+)", line) or [file for name, file in unnamed.items() if name == words[1]]
    assert written == set(expected)


def test_the_python_example_runs(capsys):
    exec(compile(blocks("python"), "commands.md", "exec"), {})
    number, verdict = capsys.readouterr().out.split()
    assert float(number) > 0.0
    assert verdict == "['stable']"


def test_every_command_has_its_section_and_every_option_its_word():
    for name, command in group.commands.items():
        assert f"\n## {name}\n" in PAGE
        for one in (command, *getattr(command, "commands", {}).values()):
            for option in one.params:
                if option.param_type_name == "option" and not option.hidden:
                    assert option.opts[0] in PAGE


def test_the_keys_that_come_out_are_those_explained(folder, quick):
    asked = keys("What comes out")
    for device in (MECHANISM, TWO_MASS):
        assert set(document_of("show", device)) - asked == keys("show")
        assert set(document_of("chart", device)) - asked == keys("chart")
    told = document_of("bounds", TWO_MASS)
    assert set(told) - asked | set(told["bounds"][0]) == keys("bounds") - {"undecided"}
    document = document_of("new", "my-paddle", "--kind", "paddle")
    assert set(document) - asked == keys("new")
    document = document_of("check", TWO_MASS, "--points", "walls.csv")
    assert set(document) - asked == {"points"}
    assert set(document["points"][0]) | {"points"} >= keys("check")
    assert set(document_of("devices")) == keys("devices")
    document = document_of("move", MECHANISM, "--duration", 0.01)
    assert set(document) - asked == keys("move") - asked
    everything = ("--measure", "rigid_mass", "--direction", "lowest", "--require", "isotropy<=2", "--cells", "5,4")
    document = document_of("map", MECHANISM, *everything)
    assert set(document) - asked == keys("map") - asked
    assert set(document["requirements"][0]) == {"requirement", "area_m2", "share"}
    document = document_of("experiment", TWO_MASS, "--stiffnesses", 1, "--tips", 0)
    assert set(document) - asked == keys("experiment")
    document = document_of("sweep", "my-study.toml")
    assert set(document) - asked == keys("sweep")
    document = document_of("tolerance", "my-tolerances.toml")
    inner = [document[name][0] for name in ("bands", "indices", "quantiles", "narrower")]
    assert set(document) - asked == keys("tolerance")
    for one in (*inner, document["indices"][0]["indices"][0], document["bands"][0]["stiffest"]):
        assert all(f"`{key}`" in PAGE for key in one)
    report = document_of("report", TWO_MASS, "--output", "report.html")
    assert set(report) >= {"file", "summary", "stiffness_max_N_per_m", *(asked - {"reason"})}


def test_every_exit_code_is_explained():
    from zwidth.show.cli import progress

    codes = {progress.DONE, progress.NO_ANSWER, progress.BAD_INPUT, progress.INTERNAL, progress.INTERRUPTED}
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", PAGE, re.MULTILINE)} == codes
