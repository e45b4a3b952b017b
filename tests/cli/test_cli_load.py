"""`zwidth load`: charts under pushes of the hand; and what `zwidth show` and maps say of a load."""

from __future__ import annotations

import csv
import re

import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, document_of, run_command
from tests.interruption import stopped_by_ctrl_c
from zwidth.model import Load
from zwidth.show.cli.load import LoadCommand

FEW = ("--push", "4", "--count", "3")
WEAK = ("--set", "drives.motor-right.torque_limit_Nm=0.05", "--set", "drives.motor-left.torque_limit_Nm=0.05")


def test_each_push_is_a_chart_of_its_own():
    document = document_of("load", MECHANISM, *FEW)
    assert set(LoadCommand.keys) <= set(document)
    assert document["push_N"] == [-4.0, 0.0, 4.0]
    assert document["status"] == ["ok"] * 3
    device = package.load(MECHANISM)
    for k, push in ((0, -4.0), (2, 4.0)):
        point = device.at(load=Load(push=push))
        assert document["stiffness_max_N_per_m"][k] == point.chart(decay=False).stiffness_max
        assert document["wall_force_N"][k] == point.equilibrium.wall_force
        assert document["sideways_force_N"][k] == point.equilibrium.sideways_force.tolist()
    assert document["stiffness_max_N_per_m"][1] == device.chart(decay=False).stiffness_max
    assert document["one_sided_amplitude_m"][1] is None
    assert document["time_to_double_s"][1] is None
    assert "load" not in document  # the push is what changes


def test_gravity_stays_and_is_named():
    ran = run_command("load", MECHANISM, *FEW, "--gravity", "0,-9.81", "--json")
    assert ran.document["load"] == {"gravity_m_per_s2": [0.0, -9.81, 0.0]}
    assert ran.document["wall_force_N"][1] == 0.0
    assert "under gravity (0, -9.81, 0) m/s²" in run_command("load", MECHANISM, *FEW, "--gravity", "0,-9.81").out


def test_the_posture_and_the_direction_are_those_asked_for():
    words = ("--at", "0.05,0.2", "--direction", "1,0", "--model", "rigid")
    document = document_of("load", MECHANISM, *FEW, *words)
    point = package.load(MECHANISM).at((0.05, 0.2), (1.0, 0.0), model="rigid", load=Load(push=-4.0))
    assert document["stiffness_max_N_per_m"][0] == point.chart(decay=False).stiffness_max
    assert (document["model"], document["direction"]) == ("rigid", [1.0, 0.0, 0.0])


def test_a_push_that_nothing_holds_is_data_and_none_at_all_no_answer():
    some = run_command("load", MECHANISM, *WEAK, "--push", "20", "--count", "5")
    assert some.code == 0
    assert re.search(r"^ -20 N +none", some.out, re.MULTILINE)
    assert "-20 N and 20 N: " in some.out
    document = document_of("load", MECHANISM, *WEAK, "--push", "20", "--count", "5")
    assert document["stiffness_max_N_per_m"][0] is document["wall_force_N"][0] is None
    assert document["sideways_force_N"][0] == [None] * 3
    assert document["status"][0].startswith("no equilibrium: ")
    unstable = ("--set", "loop.delay_samples=3", "--set", "mechanism.damping.mode_ratio=0")
    none = run_command("load", MECHANISM, *FEW, *unstable, "--json")
    assert none.code == 1
    assert none.document["reason"].endswith(" is stable")


def test_out_of_reach_is_no_answer():
    ran = run_command("load", MECHANISM, "--at", "1,1", "--json")
    assert ran.code == 1
    assert ran.document["stiffness_max_N_per_m"] is None
    assert "cannot reach" in ran.document["reason"]


def test_a_file_whose_own_push_nothing_holds_is_answered():
    ran = run_command("load", MECHANISM, *FEW, *WEAK, "--set", "load.push_N=100")
    assert ran.code == 0, ran.err
    assert "under" not in ran.out.splitlines()[0]


def test_a_load_across_the_file_s_direction_pushes_along_each_of_several():
    across = ("--load", "3,-4")
    mapped = ("map", MECHANISM, "--measure", "rigid_mass", "--direction", "highest", "--cells", "3,3")
    status = document_of(*mapped, *across)["status"]
    assert "ok" in [word for row in status for word in row]
    around = document_of("polar", MECHANISM, "--count", "3", *across)
    assert around["status"] == ["ok"] * 3


def test_moments_have_their_units(tmp_path):
    file = tmp_path / "wrist.toml"
    assert run_command("new", "wrist", "--kind", "wrist", "--output", file).code == 0
    words = ("--push", "0.2", "--count", "3")
    document = document_of("load", file, *words)
    assert document["push_Nm"] == [-0.2, 0.0, 0.2]
    assert document["wall_force_Nm"][0] == pytest.approx(0.2)
    assert {"stiffness_max_Nm_per_rad", "one_sided_amplitude_rad"} <= set(document)
    assert not {key for key in document if key.endswith(("_N", "N_per_m"))}
    assert re.search(r"^ -0.2 N m +\S+ kN m/rad", run_command("load", file, *words).out, re.MULTILINE)


def test_files(tmp_path):
    assert run_command("load", MECHANISM, *FEW, "--output", tmp_path / "load.csv").code == 0
    for ending in (".json", ".svg", ".png", ".pdf"):
        words = ("load", MECHANISM, *FEW, "--model", "rigid", "--output", tmp_path / f"load{ending}")
        assert run_command(*words).code == 0
    rows = list(csv.DictReader((tmp_path / "load.csv").read_text().splitlines()))
    assert [float(row["push_N"]) for row in rows] == [-4.0, 0.0, 4.0]
    assert float(rows[1]["stiffness_max_N_per_m"]) == pytest.approx(7849.441493, rel=1e-9)
    assert float(rows[0]["sideways_force_x_N"]) != 0.0
    assert (tmp_path / "load.svg").read_text().count("<svg") == 1


def test_ctrl_c_stops_it():
    code, out, err = stopped_by_ctrl_c(["load", MECHANISM], "zwidth.study.loaded_charts:_Pushes.chart", 2)
    assert (code, out) == (130, "")
    assert "Traceback" not in err


# --- what others say of a load ----------------------------------------------------------------------


def test_the_equilibrium_of_moments_keeps_forces_and_places_in_space(tmp_path):
    file = tmp_path / "wrist.toml"
    run_command("new", "wrist", "--kind", "wrist", "--output", file)
    words = ("--set", "load.push_N=-0.2")
    for command in ("show", "chart"):
        equilibrium = document_of(command, file, *words)["equilibrium"]
        assert {"hand_force_N", "position_m", "counted_position_m", "wall_force_Nm"} <= set(equilibrium)
        assert not {"angle_rad", "hand_force_Nm", "wall_force_N"} & set(equilibrium)
    assert "moment of -0.2 N m" in run_command("chart", file, *words).out


def test_a_map_counts_and_hatches_what_has_no_equilibrium(tmp_path):
    words = ("map", MECHANISM, *WEAK, "--load", "0,-12", "--measure", "stiffness_max", "--cells", "9,7")
    told = run_command(*words, "--output", tmp_path / "map.svg")
    assert told.code == 0, told.err
    assert re.search(r"\d+ no equilibrium", told.out)
    assert "push of (0, -12, 0) N" in told.out.splitlines()[0]


def test_a_map_of_a_device_that_holds_nothing_anywhere_is_no_answer():
    ran = run_command("map", MECHANISM, *WEAK, "--load", "0,-500", "--measure", "stiffness_max", "--cells", "4,3")
    assert ran.code == 1
    assert "push of (0, -500, 0) N" in ran.err


@pytest.mark.parametrize(
    "words",
    [
        ("map", "--direction", "worst", "--measure", "stiffness_max", "--cells", "3,3", "--model", "rigid"),
        ("polar", "--count", "4"),
    ],
)
def test_where_directions_vary_the_heading_names_the_push_along_each(words):
    """And not the force of the file, which pushes along one of them."""
    ran = run_command(words[0], MECHANISM, *words[1:], "--load", "0,-5")
    assert " 5 N along the " in ran.out.splitlines()[0]


def test_a_sweep_names_the_load_unless_that_is_what_changes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study = f'device = "{MECHANISM}"\nset = ["load.push_N=-5"]\nmeasures = ["load_change"]\n[[axis]]\n'
    (tmp_path / "lengths.toml").write_text(study + 'key = "links.upper-right.length_m"\nvalues = [0.14, 0.147]\n')
    (tmp_path / "pushes.toml").write_text(study + 'key = "load.push_N"\nvalues = [-5, 5]\n')
    assert "push of -5 N" in run_command("sweep", "lengths.toml").out
    assert "under" not in run_command("sweep", "pushes.toml").out.splitlines()[0]
