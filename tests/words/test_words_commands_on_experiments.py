"""What `zwidth experiment` prints and refuses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.cli import test_cli_experiment
from tests.cli.command_runner import TWO_MASS, document_of, refusal_lines, run_command
from tests.cli.test_cli_experiment import EDGES, FEWEST, experiment_of, point
from tests.cli.test_cli_experiment_user_points import EDGES as USER_EDGES
from tests.cli.test_cli_experiment_user_points import HEAD, WALLS, chart, points_report
from tests.systems import published
from zwidth.errors import FileError
from zwidth.show import amount
from zwidth.show.cli.experiment import experiment_sentences, experiment_warning, point_rows
from zwidth.study import read_points

# --- `zwidth experiment`: points, files, subjects, somebody's own points, interruptions, and ---------


folder = test_cli_experiment.folder
rough_search = test_cli_experiment.rough_search
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


def dry(folder, friction=0.02, step=0.0):
    (folder / "dry.toml").write_text(DRY.format(friction=friction, step=step))
    return "dry.toml"


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


# --- a user's own points: edges are held against the exact edge, walls that were tried against -------


def edge(low, high):
    """The damping of the published plant's edge at 4000 N/m, by eigenvalues [N s/m]."""
    matrix = published().transition_matrix
    return brentq(lambda B: np.abs(np.linalg.eigvals(matrix(4000.0, B))).max() - 1.0, low, high, xtol=1e-12)


def in_words(damping):
    return amount(damping, "N s/m")


def test_what_was_counted_is_said(tmp_path):
    """At 4 kN/m walls from 2.42 to 21.67 N s/m are stable, and 22.5 is 0.83 beyond."""
    lower, upper = edge(2.0, 3.0), edge(21.0, 22.0)
    apart = [abs(2.6 - lower), abs(20.7 - upper)]
    tip = abs(7000.0 - chart().stiffness_max)
    document, text = points_report(
        tmp_path,
        HEAD + USER_EDGES + "7000,9.9748,tip,\n9000,3,upper,\n" + WALLS + "4000,3,,\n4000,2,,\n",
    )
    assert document["measured_counts"] == {
        "edge_points": 4,
        "edge_points_compared": 3,
        "stable_walls": 3,
        "stable_walls_agreeing": 2,
        "stable_walls_disagreeing": 1,
        "unstable_walls": 1,
        "unstable_walls_agreeing": 1,
        "unstable_walls_disagreeing": 0,
        "unnamed_points": 2,
        "unnamed_points_inside": 1,
    }
    assert text.split("; ")[:5] == [
        f"2 edge points: on average {in_words(sum(apart) / 2)} and at most {in_words(apart[1])} from the exact "
        "edge",
        f"1 tip: on average {amount(tip, 'N/m')} and at most {amount(tip, 'N/m')} from the exact edge",
        "1 edge point where the exact chart has no such edge: left out of the average",
        "3 walls seen stable: 2 stable on the exact chart, too, 1 not",
        f"farthest off is the one at {amount(4e3, 'N/m')} and {in_words(22.5)}, {in_words(22.5 - upper)} from the "
        "exact edge",
    ]
    assert "1 wall seen unstable: 1 unstable on the exact chart, too" in text
    assert "2 points without `edge` or `verdict`: 1 inside the exact stable set, 1 outside" in text
    assert f"at most {in_words(3.0 - lower)} from the nearest exact edge" in text


def test_without_an_exact_chart_nothing_is_counted_as_agreeing(tmp_path):
    document, text = points_report(tmp_path, HEAD + USER_EDGES + WALLS, drawn=False)
    assert text == "6 points; there is no exact chart to compare them with"
    assert document["measured_counts"]["stable_walls_agreeing"] == 0
    assert {p["agrees"] for p in document["measured"]} == {None}


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("4000,10,,steady", "line 2: verdict: must be stable, unstable or nothing, got 'steady'"),
        ("4000,10,lower,stable", "line 2: verdict: must be left empty where edge is 'lower', got 'stable'"),
    ],
)
def test_a_verdict_is_checked(tmp_path, line, says):
    (tmp_path / "own.csv").write_text(HEAD + line + "\n")
    with pytest.raises(FileError, match=re.escape(says)):
        read_points(str(tmp_path / "own.csv"))
