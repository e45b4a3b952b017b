"""`zwidth experiment`: points, files, subjects, somebody's own points, interruptions, and what cannot be meant."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.cli.command_runner import TWO_MASS, document_of, run_command
from tests.interruption import stopped_by_ctrl_c
from tests.systems import published
from zwidth.contact import StableExtent
from zwidth.show.cli.experiment import experiment_warning
from zwidth.study import Experiment, MeasuredPoint, Plan

FEW = ("--stiffnesses", 2, "--tips", 1)
FEWEST = ("--stiffnesses", 1, "--tips", 0)
USER_POINTS = """stiffness_N_per_m,damping_Ns_per_m,edge,trials
4000,2.6,lower,4
4000,20.7,upper,
7000,9.9748,tip,5
3000,3,,
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def rough_search(monkeypatch):
    """The stiffest wall is sought in one round of four: most of an experiment's time goes into the others."""
    monkeypatch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 1)


@pytest.fixture(scope="module")
def smallest(tmp_path_factory):
    """The points of the smallest experiment and its journal, for tests of what is made of them."""
    journal = tmp_path_factory.mktemp("experiment") / "run.progress"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 1)
        points = document_of("experiment", TWO_MASS, *FEWEST, "--resume", journal)["points"]
    return points, journal.read_bytes()


@pytest.fixture
def journal_bytes(smallest):
    return smallest[1]


def test_points_lie_on_the_exact_boundary_and_can_be_read_again(folder, journal_bytes):
    document = document_of("experiment", TWO_MASS, *FEW, "--output", "points.csv")
    points = document["points"]
    assert [point["edge"] for point in points] == ["lower", "lower", "upper", "upper", "tip"]
    for point in points:
        assert point["damping_Ns_per_m"] == pytest.approx(point["exact_damping_Ns_per_m"], abs=3e-3)
        assert point["stiffness_N_per_m"] == pytest.approx(point["exact_stiffness_N_per_m"], rel=1e-4)
    assert document["stiffness_max_N_per_m"] == pytest.approx(7133.869, rel=1e-4)
    assert document["left_out"] == []
    assert "agree" in document["explanation"][0]
    assert sorted(os.listdir()) == ["points.csv"]  # the journal is gone
    with open("points.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["damping_Ns_per_m"]) for row in rows] == [point["damping_Ns_per_m"] for point in points]
    Path("run.progress").write_bytes(journal_bytes)
    resumed = ("--resume", "run.progress", "--measured", "points.csv")
    again = document_of("experiment", TWO_MASS, *FEWEST, *resumed)["measured"]
    assert max(abs(p["deviation_Ns_per_m"]) for p in again) < 3e-3


def eigenvalue_edge(low, high):
    """The damping of the published plant's edge at 4000 N/m, by eigenvalues."""
    matrix = published().transition_matrix
    return brentq(lambda B: np.abs(np.linalg.eigvals(matrix(4000.0, B))).max() - 1.0, low, high, xtol=1e-12)


def test_own_points_are_held_against_the_exact_edge(folder, journal_bytes):
    Path("own.csv").write_text(USER_POINTS)
    Path("run.progress").write_bytes(journal_bytes)
    resumed = ("--resume", "run.progress", "--measured", "own.csv", "--output", "own.svg")
    document = document_of("experiment", TWO_MASS, *FEWEST, *resumed)
    lower, upper, tip, free = document["measured"]
    assert lower["deviation_Ns_per_m"] == pytest.approx(2.6 - eigenvalue_edge(2.0, 3.0), abs=1e-6)
    assert upper["deviation_Ns_per_m"] == pytest.approx(20.7 - eigenvalue_edge(21.0, 22.0), abs=1e-6)
    assert tip["deviation_N_per_m"] == pytest.approx(7000.0 - 7133.869, abs=1e-2)
    assert free["edge"] is None
    assert free["deviation_Ns_per_m"] > 0.0
    assert (lower["trials"], upper["trials"]) == (4, 1)
    assert Path("own.svg").stat().st_size > 10_000


def point(K, B, edge, exact, unsure=False):
    value = K if edge == "tip" else B
    seen = ("limit cycle", 1e-4, 90.0, unsure)
    return MeasuredPoint(K, B, edge, value, value, 1, (value,), exact, *seen)


def experiment_of(*points):
    """An experiment that measured these points, with the chart of a device of 4 kN/m."""
    chart = SimpleNamespace(stiffness_max=4e3)
    return Experiment(Plan(), StableExtent(4e3, 5.0, 11.0, True), points, 0, (None,), chart, (), 0)


EDGES = (point(2e3, 1.0, "lower", 1.1), point(2e3, 11.0, "upper", 11.0))


@pytest.mark.parametrize("tips", [[(4000.0, 5.0)], [(1500.0, 12.0), (4000.0, 5.0)], []])
def test_tips_beyond_all_edges_or_beside_them_contradict_nothing(tips):
    assert experiment_warning(experiment_of(*EDGES, *(point(K, B, "tip", K) for K, B in tips))) is None


def test_subjects_and_trials_give_bars(folder, rough_search):
    asked = ("experiment", TWO_MASS, "--operator", "thesis-arm", "--wall", "one-sided", "--stiffnesses", 1)
    many = (*asked, "--tips", 0, "--subjects", 2, "--trials", 2, "--spread", 0.5)
    document = document_of(*many)
    lower, upper = document["points"]
    assert lower["trials"] == 4
    assert lower["damping_low_Ns_per_m"] < lower["damping_Ns_per_m"] < lower["damping_high_Ns_per_m"]
    assert len({tuple(subject.values()) for subject in document["subjects"]}) == 2
    assert document_of(*many, "--seed", 2)["points"] != document["points"]  # of one seed: see the interrupted run
    assert upper["damping_Ns_per_m"] > 10.0


def test_an_interrupted_run_goes_on_where_it_was(folder):
    """Stopped by ctrl-C once four results are on disk; the rest gives the same points bit for bit."""
    words = ["experiment", TWO_MASS, "--operator", "thesis-arm", "--stiffnesses", "1", "--tips", "0"]
    words += ["--subjects", "2", "--trials", "2", "--output", "points.csv"]
    journal = folder / "points.csv.progress"
    code, _, err = stopped_by_ctrl_c(words, "zwidth.study.jobs.journal:Journal.get_or_compute", 4, folder)
    assert code == 130
    assert "points.csv.progress keeps" in err
    assert not (folder / "points.csv").exists()
    kept = journal.read_bytes().splitlines(keepends=True)
    assert len(kept) == 5, "the question, and four results"
    assert run_command(*words).code == 0
    assert not journal.exists()
    resumed = (folder / "points.csv").read_bytes()
    journal.write_bytes(b"".join(kept[:2]))  # where the stable walls are, and no edge
    assert run_command(*words).code == 0
    assert (folder / "points.csv").read_bytes() == resumed


def fail_if_measured(*_):
    raise AssertionError("measured again")


def test_a_journal_of_ones_own_is_kept(folder, smallest, monkeypatch):
    points, kept = smallest
    Path("run.progress").write_bytes(kept)
    for name in ("find_stable_walls", "measure_edges", "measure_tips"):
        monkeypatch.setattr(f"zwidth.study.boundary.experiment.{name}", fail_if_measured)
    assert document_of("experiment", TWO_MASS, *FEWEST, "--resume", "run.progress")["points"] == points
    assert Path("run.progress").read_bytes() == kept


def test_a_changed_question_begins_anew_and_a_run_that_takes_its_time_says_what_it_does(
    folder, rough_search, journal_bytes, monkeypatch
):
    Path("run.progress").write_bytes(journal_bytes)
    monkeypatch.delenv("ZWIDTH_QUIET")
    monkeypatch.setattr("zwidth.show.cli.progress.PATIENCE", 0.0)
    ran = run_command("experiment", TWO_MASS, *FEWEST, "--resume", "run.progress", "--disturbance", 0.002)
    assert ran.code == 0
    assert "stable walls" in ran.err
    assert "looking" not in ran.out
    assert "lower" in ran.out
    assert Path("run.progress").read_bytes() != journal_bytes


def test_no_stable_wall_is_an_answer(folder):
    ran = run_command("experiment", TWO_MASS, *FEW, "--stiffness", "8000,9000", "--damping", "0,30", "--json")
    assert ran.code == 1
    assert ran.document["points"] is None
    assert "stable wall" in ran.document["reason"]


def test_a_measured_response_has_nothing_to_disturb(folder):
    Path("sweep.csv").write_text(
        "frequency_Hz,real_m_per_N,imag_m_per_N\n" + "".join(f"{f},{-1 / f**2},0\n" for f in range(1, 400))
    )
    Path("swept.toml").write_text(
        'name = "swept"\n[response]\nfile = "sweep.csv"\n[loop]\nsampling_period_s = 0.00125\n'
    )
    ran = run_command("experiment", "swept.toml", "--json")
    assert ran.code == 1
    assert ran.document["points"] is None


def test_the_page_s_example_runs(capsys):
    page = (Path(__file__).parents[2] / "docs" / "experiment.md").read_text(encoding="utf-8")
    ((program, printed),) = re.findall(r"^```python\n(.*?)^```\n\n```\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    exec(compile(program, "experiment.md", "exec"), {})
    assert capsys.readouterr().out == printed
