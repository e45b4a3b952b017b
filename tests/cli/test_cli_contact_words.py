"""What is said of a contact or a motion where nothing moves, where numbers are needless, or too large."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth as package
from tests.cli.cli_run import MECHANISM, found, refused, zwidth
from tests.device.device_cases import ARM
from zwidth.show.figures.path import draw_path, path_figure

PLANT = "name = 'own'\n[plant]\nmass_kg = 0.1\ndamping_Ns_per_m = 0.5\n[loop]\nsampling_period_s = 0.001\n"
RUBBING = PLANT + "[friction]\ncoulomb_N = 10\n"
BRAKED = RUBBING + "[[plant.brake]]\nname = 'eddy'\nalong = [1.0]\ndamping_max_Ns_per_m = 2.0\n"


@pytest.fixture
def written(tmp_path):
    def write(text):
        (tmp_path / "own.toml").write_text(text)
        return tmp_path / "own.toml"

    return write


def test_friction_is_said_to_hold_what_it_holds(written):
    words = ("--stiffness", 1000, "--damping", 2)
    assert "dry friction holds it: the wall's force, 1.000 N" in zwidth("simulate", written(RUBBING), *words).out
    still = zwidth("simulate", written(RUBBING), *words, "--start-position", 0).out
    assert "nothing moves it" in still
    assert "friction holds it" not in still


def test_substeps_that_change_nothing_are_told_and_not_taken(written):
    words = ("--stiffness", 1000, "--damping", 2, "--duration", 5, "--substeps", 100_000)
    ran = zwidth("simulate", written(PLANT), *words)
    assert ran.code == 0
    assert ran.err == "--substeps 100000: a linear device is exact with any number; 20 were taken\n"
    few = found("simulate", written(RUBBING), "--stiffness", 1000, "--damping", 2, "--substeps", 50)
    assert few["substeps"] == 50


def test_a_predicted_cycle_is_said_to_leave_out_brakes(written):
    words = ("--stiffness", 1000, "--damping", 2, "--no-simulation")
    assert "the prediction leaves out programmable brakes" in zwidth("limit-cycles", written(BRAKED), *words).out
    assert "leaves out" not in zwidth("limit-cycles", written(RUBBING), *words).out


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--push", "2e6"), "--push: must lie from -1e+06 to 1e+06 N"),
        (("--start-velocity", "0,-2000"), "--start-velocity: must lie from -1000 to 1000 m/s"),
    ],
)
def test_a_push_and_a_start_have_bounds(words, why):
    assert why in refused("move", MECHANISM, *words)[0]


def test_an_open_chain_has_no_loops_to_speak_of(written):
    ran = zwidth("move", written(ARM), "--push", "0,1e6")
    assert "ended before its time" in ran.out
    assert "loop" not in ran.out


def test_a_push_across_the_plane_is_said_to_move_nothing(written):
    ran = zwidth("move", written(ARM), "--push", "0,0,2", "--duration", 0.1)
    assert "2.000 N of the push are across all ways the handle can go, and move nothing" in ran.out
    assert "0 m\n" in ran.out.partition("its path")[2]
    assert "across" not in zwidth("move", written(ARM), "--push", "0,2", "--duration", 0.1).out


def test_a_free_motion_has_no_empty_panels_and_its_path_is_no_links_colour():
    motion = package.load("five-bar").at().move(push=(0.02, 1.0, 0.0), duration=0.1)
    made, axes = path_figure()
    draw_path(axes, motion)
    made.canvas.draw()
    assert [ax.get_visible() for ax in axes] == [True, True, False, False, True]
    path = next(line for line in axes[0].lines if line.get_label() == "path")
    others = [line.get_color() for line in axes[0].lines if line is not path]
    assert path.get_color() not in others
    assert np.array_equal(path.get_xydata(), motion.position[:, :2])


def test_an_operator_without_a_name_is_that_of_the_file(written):
    arm = "arm_mass_kg = 0.8\narm_stiffness_N_per_m = 580.0\narm_damping_Ns_per_m = 5.5\n"
    grasp = "grasp_stiffness_N_per_m = 10000.0\ngrasp_damping_Ns_per_m = 5.0\n"
    device = PLANT.replace("[loop]", "handle = [1.0]\n[loop]") + "[operator]\n" + arm + grasp
    ran = zwidth("simulate", written(device), "--stiffness", 1000, "--damping", 2)
    assert "held by the operator of the file\n" in ran.out
