"""The comparison of two answers: each kind of difference is found, and what is none is let pass."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from tests.cli.command_runner import TWO_MASS, run_command
from tests.frozen.accepted import AcceptedDifference, read_accepted, split_accepted
from tests.frozen.compare import Difference, Tally, compare
from tests.frozen.curves import distance
from tests.frozen.rules import RULES, Kind
from tests.frozen.summary import summary


def arc(count=200, radius=1.0, shift=0.0):
    angles = np.linspace(0.0, np.pi, count)
    return {
        "stiffness_N_per_m": (8000.0 * radius * np.sin(angles)).tolist(),
        "damping_Ns_per_m": (20.0 * radius * np.cos(angles) + shift).tolist(),
        "frequency_Hz": (100.0 * angles).tolist(),
    }


CHART = {
    "name": "Paddle",
    "stiffness_max_N_per_m": 8000.0,
    "damping_at_stiffness_max_Ns_per_m": 0.0,
    "damping_max_Ns_per_m": 20.0,
    "decided": True,
    "unobserved_modes": ["rigid motion (0 Hz)"],
    "regions": [np.stack([arc()["stiffness_N_per_m"], arc()["damping_Ns_per_m"]], axis=-1).tolist()],
    "boundary": [arc()],
}
POINTS = {
    "points": [{"stiffness_N_per_m": 1000.0, "verdict": "stable", "spectral_radius": 0.99}, {"verdict": None}]
}
TIMES = np.arange(400) * 0.001
MOTION = {
    "stable": False,
    "behaviour": "limit cycle",
    "amplitude_m": 0.001,
    "time_s": TIMES.tolist(),
    "position_m": (0.001 * np.cos(300.0 * TIMES)).tolist(),
    "ledger_J": {"hand": 0.01, "wall": -0.01, "actuator": 1e-17},
}


def answer(document, code=0, err="", seconds=1.0):
    return {"code": code, "out": json.dumps(document), "err": err, "seconds": seconds}


def compared(base, new, name="chart paddle", quantised=False):
    tally = Tally()
    compare(name, quantised, answer(base), answer(new), tally)
    return tally


def changed(document, *path, to):
    made = copy.deepcopy(document)
    at = made
    for step in path[:-1]:
        at = at[step]
    at[path[-1]] = to
    return made


def keys(tally):
    return [one.key for one in tally.differences]


# --- numbers --------------------------------------------------------------------------------------------


def test_the_same_document_has_no_differences_and_its_numbers_are_counted():
    tally = compared(CHART, CHART)
    assert not tally.differences
    assert (tally.same, tally.same_numbers) == (
        1,
        3 + 400 + 600,
    )  # what stands in texts is no number of the document


@pytest.mark.parametrize("factor", [1.0 + 1e-8, 1.0 - 1e-8])
def test_a_smooth_number_that_moved_by_1e_8_is_found(factor):
    tally = compared(CHART, changed(CHART, "stiffness_max_N_per_m", to=8000.0 * factor))
    assert keys(tally) == ["stiffness_max_N_per_m"]
    assert tally.largest[Kind.SMOOTH][0] == pytest.approx(1e-8, rel=1e-2)


def test_a_smooth_number_may_move_by_rounding():
    assert not compared(CHART, changed(CHART, "stiffness_max_N_per_m", to=8000.0 * (1.0 + 5e-10))).differences


def test_what_is_zero_but_for_rounding_is_measured_by_its_neighbours_of_the_same_unit():
    rounding = changed(MOTION, "ledger_J", "actuator", to=-3e-17)
    assert not compared(MOTION, rounding, "simulate paddle stable").differences
    assert keys(compared(MOTION, changed(MOTION, "ledger_J", "actuator", to=1e-12), "simulate paddle stable")) == [
        "ledger_J.actuator"
    ]


def test_a_number_without_a_unit_is_measured_by_itself():
    base = {"manipulability": 0.02, "dynamic_manipulability": 900.0}
    assert keys(compared(base, changed(base, "manipulability", to=0.02 * (1.0 + 1e-8)))) == ["manipulability"]


def test_one_element_of_a_matrix_is_found_with_its_place():
    base = {"jacobian": [[1.0, 2.0], [None, 4.0]]}
    (found,) = compared(base, {"jacobian": [[1.0, 2.0], [None, 4.0 + 1e-7]]}, "show arm").differences
    assert "at [1, 1]" in found.reason


def test_null_in_place_of_a_number_is_found():
    assert keys(compared(CHART, changed(CHART, "damping_max_Ns_per_m", to=None))) == ["damping_max_Ns_per_m"]
    base = {"jacobian": [[1.0, None]]}
    assert keys(compared(base, {"jacobian": [[None, 1.0]]}, "show arm")) == ["jacobian"]


# --- texts, keys, lengths -------------------------------------------------------------------------------


def test_a_changed_verdict_is_found():
    assert keys(compared(POINTS, changed(POINTS, "points", 0, "verdict", to="unstable"), "check x")) == [
        "points.verdict"
    ]
    assert keys(compared(CHART, changed(CHART, "decided", to=False))) == ["decided"]


def test_a_missing_key_is_found_and_an_added_one_is_only_told():
    fewer = {key: value for key, value in CHART.items() if key != "damping_max_Ns_per_m"}
    assert keys(compared(CHART, fewer)) == ["damping_max_Ns_per_m"]
    tally = compared(fewer, CHART)
    assert not tally.differences
    assert tally.added == {("chart", "damping_max_Ns_per_m"): 1}


def test_a_shorter_list_is_found():
    assert keys(compared(POINTS, {"points": POINTS["points"][:1]}, "check x")) == ["points"]


def test_a_sentence_may_be_worded_anew_but_not_come_or_go():
    base = {"reason": "no stable wall", "notes": ["singular"]}
    tally = compared(base, {"reason": "none is stable", "notes": ["singular"]})
    assert not tally.differences
    assert tally.reworded == {("chart", "reason"): 1}
    assert keys(compared(base, {"reason": None, "notes": []})) == ["reason", "notes"]


# --- curves ---------------------------------------------------------------------------------------------


def test_a_curve_sampled_at_other_points_is_the_same_curve():
    assert not compared(CHART, changed(CHART, "boundary", to=[arc(283)])).differences


@pytest.mark.parametrize("other", [arc(283, radius=1.0 + 3e-4), arc(radius=1.0 + 1e-5), arc(shift=1e-3)])
def test_a_curve_that_lies_elsewhere_is_found(other):
    assert keys(compared(CHART, changed(CHART, "boundary", to=[other]))) == ["boundary"]


def test_another_number_of_arcs_is_found_and_so_is_a_curve_cut_short():
    assert keys(compared(CHART, changed(CHART, "boundary", to=[]))) == ["boundary"]
    ring = CHART["regions"][0]
    assert keys(compared(CHART, changed(CHART, "regions", to=[ring[: len(ring) // 2]]))) == ["regions"]


def test_distance_of_two_lines_is_where_they_are_farthest_apart():
    first = np.array([[0.0, 0.0], [1.0, 0.0]])
    assert distance(first, np.array([[0.0, 0.0], [0.3, 0.0], [1.0, 0.25]])) == pytest.approx(0.25, abs=1e-4)
    assert distance(first, first[:1]) == 1.0


def test_points_that_rounding_keeps_apart_are_one():
    angles = np.linspace(0.0, np.pi, 50)
    once = np.column_stack([np.sin(angles), np.cos(angles)])
    twice = np.insert(once, 20, once[20] + [0.0, 5e-17], axis=0)
    assert np.any(twice[20] != twice[21])
    assert distance(once, twice) < 1e-12


# --- motions --------------------------------------------------------------------------------------------


def diverged_motion(amplitude=1.0, at=30, behaviour="limit cycle"):
    wave = np.array(MOTION["position_m"])
    wave[at:] = amplitude * 0.001 * np.cos(300.0 * TIMES[at:] + 0.4)
    return changed(
        changed(changed(MOTION, "position_m", to=wave.tolist()), "amplitude_m", to=amplitude * 0.001),
        "behaviour",
        to=behaviour,
    )


def test_a_quantised_run_may_part_and_is_then_compared_by_its_amplitude():
    tally = compared(MOTION, diverged_motion(), "simulate paddle stable", quantised=True)
    assert not tally.differences
    assert tally.diverged_runs == ["simulate paddle stable: sample 30"]


def test_an_amplitude_that_moved_is_found_in_a_quantised_run():
    tally = compared(MOTION, diverged_motion(amplitude=1.3), "simulate paddle stable", quantised=True)
    assert {"amplitude_m", "position_m"} == set(keys(tally))


def test_a_quantised_run_that_parts_at_once_or_ends_otherwise_is_found():
    assert keys(compared(MOTION, diverged_motion(at=1), "simulate paddle stable", quantised=True)) == [
        "position_m"
    ]
    told = compared(MOTION, diverged_motion(behaviour="growing"), "simulate paddle stable", quantised=True)
    assert keys(told) == ["behaviour"]


def test_a_linear_run_may_not_part():
    assert "position_m" in keys(compared(MOTION, diverged_motion(), "simulate paddle stable"))


# --- exit codes, complaints, what is no document --------------------------------------------------------


def outcome(base, new):
    tally = Tally()
    compare("chart paddle", False, base, new, tally)
    return [(one.key, one.reason) for one in tally.differences]


def test_exit_codes_and_numbers_of_complaints_are_compared():
    bad = {"code": 2, "out": "", "err": "a: one\na: two\n", "seconds": 0.0}
    assert outcome(bad, bad | {"err": "other: words\na: two\n"}) == []
    assert outcome(bad, bad | {"err": "a: one\n"})[0][0] == "lines"
    waited = "zwidth: computing\nzwidth: points, 3 of 8: 4 s left\n"
    assert not outcome(bad, bad | {"err": waited + bad["err"]})
    assert outcome(answer(CHART), bad)[0] == ("exit code", "0 became 2: a: two")
    assert outcome(answer({}, code=70, err="broken"), answer({}, code=70))[0][0] == "exit code"


def test_a_run_that_takes_too_long_and_a_document_that_is_not_json_are_told():
    slow = {"code": "time", "out": "", "err": "", "seconds": 60.0}
    assert outcome(answer(CHART), slow)[0] == (
        "time",
        "a run that takes too long is not compared: 1.0 s and more than 60.0 s",
    )
    assert outcome(answer(CHART), answer(CHART) | {"out": '{"a": NaN}'})[0][0] == "document"


# --- a change of the product ----------------------------------------------------------------------------


def test_a_stiffness_changed_by_a_millionth_is_caught():
    runs = []
    for stiffness in (15620.0, 15620.0, 15620.0 * (1.0 + 1e-6)):
        k = f"plant.stiffness_N_per_m=[[{stiffness!r},-{stiffness!r}],[-{stiffness!r},{stiffness!r}]]"
        ran = run_command("chart", TWO_MASS, "--set", k, "--json")
        runs.append({"code": ran.code, "out": ran.out, "err": ran.err, "seconds": 0.0})
    name = f"chart {TWO_MASS}"
    same, moved = Tally(), Tally()
    compare(name, False, runs[0], runs[1], same)
    compare(name, False, runs[0], runs[2], moved)
    assert not same.differences
    assert "stiffness_max_N_per_m" in keys(moved)


# --- what is accepted, the summary ----------------------------------------------------------------------

DIFFERENCES = [Difference("map", "arm worst", "values", "moved"), Difference("chart", "arm", "regions", "moved")]


def test_accepted_differences_are_sorted_out_and_unused_entries_counted(tmp_path):
    path = tmp_path / "accepted.toml"
    entry = '[[accepted]]\ncommand = "{}"\ndevice = "*"\nkey = "*"\nreason = "mended"\n'
    path.write_text(entry.format("map") + entry.format("polar"))
    left, counts = split_accepted(DIFFERENCES, read_accepted(path))
    assert left == DIFFERENCES[1:]
    assert list(counts.values()) == [1, 0]
    lines = "\n".join(summary(Tally(differences=DIFFERENCES), left, counts, tmp_path / "all.tsv"))
    assert "accepted 1 times: map" in lines
    assert "does not occur: remove the entry: polar" in lines
    assert (tmp_path / "all.tsv").read_text() == "chart\tarm\tregions\tmoved\n"


def test_an_accepted_difference_needs_a_reason(tmp_path):
    path = tmp_path / "accepted.toml"
    path.write_text('[[accepted]]\ncommand = "map"\ndevice = "*"\nkey = "*"\nreason = " "\n')
    with pytest.raises(SystemExit, match="a reason"):
        read_accepted(path)
    assert AcceptedDifference("*", "arm*", "values", "why").covers(DIFFERENCES[0])


def test_every_rule_says_why():
    assert all(rule.why for rule in RULES)
