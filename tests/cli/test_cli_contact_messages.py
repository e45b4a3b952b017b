"""What is said of a contact or a motion where nothing moves, where numbers are needless, or too large."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, document_of, refusal_lines, run_command
from tests.device.device_cases import ARM_FILE
from zwidth.show import draw_mechanism_motion, mechanism_motion_figure

PLANT = "name = 'own'\n[plant]\nmass_kg = 0.1\ndamping_Ns_per_m = 0.5\n[loop]\nsampling_period_s = 0.001\n"
RUBBING = PLANT + "[friction]\ncoulomb_N = 10\n"
BRAKED = RUBBING + "[[plant.brake]]\nname = 'eddy'\nalong = [1.0]\ndamping_max_Ns_per_m = 2.0\n"


@pytest.fixture
def write_device(tmp_path):
    def write(text):
        (tmp_path / "own.toml").write_text(text)
        return tmp_path / "own.toml"

    return write


def test_friction_is_said_to_hold_what_it_holds(write_device):
    words = ("--stiffness", 1000, "--damping", 2)
    ran = run_command("simulate", write_device(RUBBING), *words)
    assert "dry friction holds it: the wall's force, 1.000 N" in ran.out
    still = run_command("simulate", write_device(RUBBING), *words, "--start-position", 0).out
    assert "nothing moves the handle" in still
    assert "friction holds it" not in still


def test_substeps_that_change_nothing_are_told_and_not_taken(write_device):
    words = ("--stiffness", 1000, "--damping", 2, "--duration", 5, "--substeps", 100_000)
    ran = run_command("simulate", write_device(PLANT), *words)
    assert ran.code == 0
    assert ran.err == "--substeps 100000: a linear device is exact with any number; 20 were taken\n"
    few = document_of("simulate", write_device(RUBBING), "--stiffness", 1000, "--damping", 2, "--substeps", 50)
    assert few["substeps"] == 50


def test_a_predicted_cycle_is_said_to_leave_out_brakes(write_device):
    words = ("--stiffness", 1000, "--damping", 2, "--no-simulation")
    ran = run_command("limit-cycles", write_device(BRAKED), *words)
    assert "the prediction leaves out programmable brakes" in ran.out
    assert "leaves out" not in run_command("limit-cycles", write_device(RUBBING), *words).out


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--push", "2e6"), "--push: must lie from -1e+06 to 1e+06 N"),
        (("--start-velocity", "0,-2000"), "--start-velocity: must lie from -1000 to 1000 m/s"),
    ],
)
def test_a_push_and_a_start_have_bounds(words, why):
    assert why in refusal_lines("move", MECHANISM, *words)[0]


def test_an_open_chain_has_no_loops_to_speak_of(write_device):
    ran = run_command("move", write_device(ARM_FILE), "--push", "0,1e6")
    assert "ended early" in ran.out
    assert "loop" not in ran.out


def test_a_push_across_the_plane_is_said_to_move_nothing(write_device):
    ran = run_command("move", write_device(ARM_FILE), "--push", "0,0,2", "--duration", 0.1)
    assert "2.000 N of the push act at right angles to every motion of the handle, and have no effect" in ran.out
    assert "0 m\n" in ran.out.partition("path length")[2]
    assert "across" not in run_command("move", write_device(ARM_FILE), "--push", "0,2", "--duration", 0.1).out


def test_a_free_motion_has_no_empty_panels_and_its_path_is_no_links_colour():
    motion = package.load("five-bar").at().move(push=(0.02, 1.0, 0.0), duration=0.1)
    made, axes = mechanism_motion_figure()
    draw_mechanism_motion(axes, motion)
    made.canvas.draw()
    assert [ax.get_visible() for ax in axes] == [True, True, False, False, True]
    path = next(line for line in axes[0].lines if line.get_label() == "path")
    others = [line.get_color() for line in axes[0].lines if line is not path]
    assert path.get_color() not in others
    assert np.array_equal(path.get_xydata(), motion.position[:, :2])


def test_an_operator_without_a_name_is_that_of_the_file(write_device):
    arm = "arm_mass_kg = 0.8\narm_stiffness_N_per_m = 580.0\narm_damping_Ns_per_m = 5.5\n"
    grasp = "grasp_stiffness_N_per_m = 10000.0\ngrasp_damping_Ns_per_m = 5.0\n"
    device = PLANT.replace("[loop]", "handle = [1.0]\n[loop]") + "[operator]\n" + arm + grasp
    ran = run_command("simulate", write_device(device), "--stiffness", 1000, "--damping", 2)
    assert "held by the operator of the file\n" in ran.out
