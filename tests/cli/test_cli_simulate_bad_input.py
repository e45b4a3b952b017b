"""`zwidth simulate`: what is refused on one line, what has no answer, and what an interruption leaves."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cli.command_runner import MECHANISM, TWO_MASS, refusal_lines, run_command

WALL = ("--stiffness", 4000, "--damping", 10)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_response_that_no_plant_explains_is_refused_and_a_device_without_mass_has_no_answer(folder):
    (folder / "swept.toml").write_text(
        'name = "swept"\n[response]\nfile = "sweep.csv"\nintegrators = 1\n[loop]\nsampling_period_s = 0.001\n'
    )
    paddle = {f: 1.0 / ((1.0 + 0.05 * 2j * np.pi * f) * 2j * np.pi * f) for f in range(16, 401, 16)}
    rows = [f"{f},{value.real},{value.imag}" for f, value in paddle.items()]
    (folder / "sweep.csv").write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *rows]))
    (line,) = refusal_lines("simulate", "swept.toml", *WALL)  # it lacks the hold of a sampled device
    assert "is not explained by masses, springs, dampers and a delay: the best plant misses it by" in line
    ran = run_command("simulate", MECHANISM, *WALL, "--at", "5,5", "--json")
    assert (ran.code, ran.document["time_s"]) == (1, None)


OWN = {
    "raises.py:wall": ("1/0", "does not run: ZeroDivisionError"),
    "empty.py:wall": ("x = 1", "has no environment wall"),
    "plain.py:wall": ("def wall(x): return x", "put @environment"),
    "missing.py:wall": (None, "no such file"),
}
BAD = [
    (WALL[:2], "missing: --damping"),
    ((*WALL, "--duration", 0), "above 0"),
    ((*WALL, "--duration", -1), "above 0"),
    ((*WALL, "--duration", "nan"), "above 0"),
    ((*WALL, "--duration", 1e9), "GB"),
    ((*WALL, "--substeps", 0), "from 1 to 100000"),
    ((*WALL, "--push", "nan"), "must be a finite number"),
    ((*WALL, "--wall-position", "inf"), "must be a finite number"),
    ((*WALL, "--wall", "soft"), "not one of"),
    ((*WALL, "--wall", "one-sided", "--environment", "slot"), "exclude each other"),
    ((*WALL, "--no-pull"), "always pulls"),
    ((*WALL, "--parameter", "width=1"), "belongs to --environment"),
    (("--environment", "slott"), "did you mean slot?"),
    (("--environment", "slot", "--parameter", "wdth=1"), "did you mean width?"),
    (("--environment", "slot", "--parameter", "width"), "NAME=NUMBER"),
    (("--environment", "slot", "--parameter", "width=1", "--parameter", "width=2"), "given twice"),
    (("--environment", "texture", "--stiffness", 3), "no such parameter"),
    ((*WALL, "--ramp", 0.5), "no push is given; add --push"),
    ((*WALL, "--tremor", "1"), "2 finite numbers"),
    ((*WALL, "--tremor=-1,10"), "--tremor: amplitude"),
    ((*WALL, "--reach", "0.01"), "--reach: needs an arm"),
    ((*WALL, "--reflex", "1,500,5"), "--reflex: needs an arm"),
    ((*WALL, "--operator", "thesis-arm", "--reflex=-1,500,5"), "--reflex: threshold"),
    ((*WALL, "--passivity", 0), "above 0"),
    ((*WALL, "--output", "x.mp3"), "must end in"),
    ((*WALL, "--set", "plant.loss_factor=0.1"), "a loss factor describes steady vibration"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "says"), BAD, ids=[says for _, says in BAD])
def test_a_bad_question_is_one_line(words, says):
    (line,) = refusal_lines("simulate", TWO_MASS, *words)
    assert says in line


@pytest.mark.parametrize("name", OWN)
def test_a_bad_file_of_my_own_is_one_line(folder, name):
    text, says = OWN[name]
    if text is not None:
        (folder / name.partition(":")[0]).write_text(text)
    (line,) = refusal_lines("simulate", TWO_MASS, "--environment", name)
    assert line.startswith("--environment: ")
    assert says in line


def test_a_law_that_gives_no_number_is_no_verdict(folder):
    (folder / "law.py").write_text(
        "import math\nfrom zwidth.contact.environments import environment\n@environment([])\n"
        "def silent(position, velocity, time, period, parameters, memory):\n"
        "    return math.nan if time > 0.01 else -1000.0 * position\n"
    )
    ran = run_command("simulate", TWO_MASS, "--environment", "law.py:silent", "--json")
    assert (ran.code, ran.document["stable"], ran.document["behaviour"]) == (1, None, None)
    assert "silent gave no finite force at 0.01125 s" in ran.document["reason"]


@pytest.mark.parametrize("option", ["--wall-position", "--start-position"])
def test_a_place_out_of_the_workspace_is_one_line(option):
    (line,) = refusal_lines("simulate", MECHANISM, *WALL, option, 0.5)
    assert line.startswith(f"{option}: ")
    assert "out of the workspace: the handle cannot reach (0, 0.75, 0) m" in line


def test_an_interruption_leaves_nothing_half_written(folder, monkeypatch):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    before = set(folder.iterdir())
    monkeypatch.setattr("zwidth.show.output.os.replace", stopped)
    for name in ("motion.wav", "motion.csv", "motion.png"):
        ran = run_command("simulate", TWO_MASS, *WALL, "--output", name)
        assert (ran.code, ran.out, len(ran.lines)) == (130, "", 1)
        assert set(folder.iterdir()) == before


def test_a_linear_run_outlasts_the_ramp():
    ran = run_command(
        "simulate", TWO_MASS, "--stiffness", 4000, "--damping", 10, "--push", 1, "--ramp", 2, "--json"
    )
    assert ran.document["duration_s"] > 2.0
    assert ran.document["penetration_m"][-1] == pytest.approx(1.0 / 4000, rel=0.2)
