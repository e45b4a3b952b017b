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

from tests.cli.command_runner import TWO_MASS, document_of, refusal_lines, run_command
from tests.interruption import stopped_by_ctrl_c
from tests.systems import published
from zwidth.contact import StableExtent
from zwidth.show.cli.experiment import experiment_sentences, experiment_warning, point_rows
from zwidth.study import Experiment, MeasuredPoint, Plan

FEW = ("--stiffnesses", 2, "--tips", 1)
FEWEST = ("--stiffnesses", 1, "--tips", 0)
DRY = """
name = "dry"
[plant]
mass_kg = 0.1
[friction]
coulomb_N = {friction}
[loop]
sampling_period_s = 0.001
[loop.encoder]
resolution_m = {step}
"""
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


def dry(folder, friction=0.02, step=0.0):
    (folder / "dry.toml").write_text(DRY.format(friction=friction, step=step))
    return "dry.toml"


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


@pytest.mark.parametrize(
    ("friction", "step", "says", "says_not"),
    [
        (2.0, 0.0, "without dry friction fewer walls are stable", "encoder"),
        (2.0, 1e-8, "without encoder steps no edge tried moves", "agree"),
        (0.0, 0.0, "agree", "friction"),
    ],
)
def test_the_difference_is_explained_by_what_makes_it(folder, rough_search, friction, step, says, says_not):
    asked = ("experiment", dry(folder, friction, step), *FEWEST, "--resume", "run.progress")
    document = document_of(*asked)
    text = " ".join(document["explanation"])
    assert says in text
    assert says_not not in text
    people = run_command(*asked)
    assert says in " ".join(people.out.split())


def point(K, B, edge, exact, unsure=False):
    value = K if edge == "tip" else B
    seen = ("limit cycle", 1e-4, 90.0, unsure)
    return MeasuredPoint(K, B, edge, value, value, 1, (value,), exact, *seen)


def experiment_of(*points):
    """An experiment that measured these points, with the chart of a device of 4 kN/m."""
    chart = SimpleNamespace(stiffness_max=4e3)
    return Experiment(Plan(), StableExtent(4e3, 5.0, 11.0, True), points, 0, (None,), chart, (), 0)


EDGES = (point(2e3, 1.0, "lower", 1.1), point(2e3, 11.0, "upper", 11.0))


def test_a_tip_far_off_is_named_before_edges_that_are_near_and_doubts_are_told():
    doubtful = experiment_of(*EDGES, point(5e3, 5.0, "tip", 4e3, True))
    far = dict(experiment_sentences(doubtful))
    assert far["difference"].startswith("farthest from the exact linear edge is the tip at 5.000 N s/m")
    assert "measured 5.000 kN/m, exact 4.000 kN/m, more is stable" in far["difference"]
    assert far["stiffest"].endswith(", unsure")
    assert far["unsure"].startswith("at 1 tip the verdict changes more than once")
    assert "--trials" in far["unsure"]
    assert [p["unsure"] for p in doubtful.document()["points"]] == [False, False, True]
    near = dict(experiment_sentences(experiment_of(*EDGES, point(4.001e3, 5.0, "tip", 4e3))))
    assert near["difference"].startswith("farthest from the exact linear edge is the lower one")
    assert "unsure" not in near


def test_edges_that_are_unsure_are_marked_as_tips_are():
    doubtful = experiment_of(EDGES[0], point(2e3, 11.0, "upper", 11.0, True), point(4e3, 5.0, "tip", 4e3))
    assert dict(experiment_sentences(doubtful))["unsure"].startswith(
        "at 1 edge the verdict changes more than once"
    )
    assert [row[-1] for row in point_rows(doubtful)[1]] == ["", "unsure", ""]


@pytest.mark.parametrize(
    ("tips", "says"),
    [
        (
            [(1500.0, 6.0), (4000.0, 5.0)],
            "at 2.000 kN/m walls from 1.000 N s/m to 11.00 N s/m were stable, although ",
        ),
        ([(1500.0, 12.0), (1900.0, 5.0)], "the tip at 5.000 N s/m is 1.900 kN/m"),
        ([(1500.0, 12.0)], "the tip at 12.00 N s/m is 1.500 kN/m"),
        ([(1500.0, 6.0), (1500.0, 7.0)], "(2 tips lie below edges)"),
    ],
)
def test_an_edge_beyond_a_tip_is_warned_of(tips, says):
    """At 2 kN/m walls from 1 to 11 N s/m were stable: no tip between them is softer, nor is the stiffest tip."""
    text = experiment_warning(experiment_of(*EDGES, *(point(K, B, "tip", K) for K, B in tips)))
    assert text.startswith("an edge lies beyond a tip")
    assert says in text


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
    assert "points.csv.progress keeps the finished work" in err
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
    assert "looking for stable walls" in ran.err
    assert "looking" not in ran.out
    assert "lower" in ran.out
    assert Path("run.progress").read_bytes() != journal_bytes


def test_no_stable_wall_is_an_answer(folder):
    ran = run_command("experiment", TWO_MASS, *FEW, "--stiffness", "8000,9000", "--damping", "0,30", "--json")
    assert ran.code == 1
    assert ran.document["points"] is None
    assert "no stable wall was found" in ran.document["reason"]


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


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--stiffness", "8000,1000", "--damping", "0,30"), "needs KMIN < KMAX"),
        (("--stiffness", "0,8000"), "give both or neither"),
        (("--subjects", 0), "subjects"),
        (("--subjects", 2), "give an operator"),
        (("--reflex",), "give an operator"),
        (("--spread", -0.1), "spread"),
        (("--trials", "many"), "trials"),
        (("--disturbance", 0), "'--disturbance': must be a finite number, above 0"),
        (("--disturbance", "nan"), "'--disturbance': must be a finite number"),
        (("--disturbance", 1.5), "above 0 and at most 1 [m], got 1.5"),
        (("--disturbance", 0.01, "--wall", "one-sided"), "--disturbance: applies to a two-sided wall"),
        (("--speed", -200), "at least -100 and at most 100 [m/s], got -200"),
        (("--visible", -1), "'--visible': must be a finite number, at least 0"),
        (("--wall", "one-sided", "--push", 0), "--push: must be positive"),
        (("--push", "inf"), "'--push': must be a finite number"),
        (("--output", "points.txt"), "must end in"),
        (("--resume", "notes.txt"), "is not the journal of a run"),
        (("--resume", "."), ".: is not an ordinary file"),
        (("--resume", "nowhere/run.progress"), "cannot be written"),
    ],
)
def test_what_cannot_be_meant_is_one_line(folder, words, line):
    Path("notes.txt").write_text("my notes\n")
    (said,) = refusal_lines("experiment", TWO_MASS, *words)
    assert line in said
    assert Path("notes.txt").read_text() == "my notes\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "is empty"),
        ("K,B\n1,2\n", "columns stiffness_N_per_m, damping_Ns_per_m are missing"),
        ("stiffness_N_per_m,damping_Ns_per_m\n", "holds no walls"),
        ("stiffness_N_per_m,damping_Ns_per_m\n1,nan\n", "line 2: damping_Ns_per_m: must be a finite number"),
        ("stiffness_N_per_m,damping_Ns_per_m,edge\n1,2,left\n", "edge: must be lower, upper, tip or nothing"),
        ("stiffness_N_per_m,damping_Ns_per_m,trials\n1,2,0\n", "trials: must be a whole number from 1 on"),
        (
            "stiffness_N_per_m,damping_Ns_per_m,damping_low_Ns_per_m\n1,2,x\n",
            "damping_low_Ns_per_m: must be a finite",
        ),
        ("stiffness_N_per_m,damping_Ns_per_m,edge,edge\n1,2,,\n", "column edge is there more than once"),
        (
            "stiffness_N_per_m,damping_Ns_per_m,damping_low_Ns_per_m,damping_high_Ns_per_m\n1,5,8,2\n",
            "damping_low_Ns_per_m: must be at most damping_high_Ns_per_m = 2, got 8",
        ),
    ],
)
def test_somebody_s_points_are_checked(folder, text, line):
    Path("own.csv").write_text(text)
    said = refusal_lines("experiment", TWO_MASS, "--measured", "own.csv")
    assert line in said[0]


def test_the_page_s_example_runs(capsys):
    page = (Path(__file__).parents[2] / "docs" / "experiment.md").read_text(encoding="utf-8")
    ((program, printed),) = re.findall(r"^```python\n(.*?)^```\n\n```\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    exec(compile(program, "experiment.md", "exec"), {})
    assert capsys.readouterr().out == printed
