"""What the commands that simulate print and refuse."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth as package
from tests.cli import test_cli_simulate
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, refusal_lines, run_command
from tests.cli.test_cli_limit_cycles import LIMITED, ROUGH, ROUGH_AND_LIMITED
from tests.cli.test_cli_limit_cycles import WALL as LIMIT_CYCLES_WALL
from tests.cli.test_cli_move import BALL, WEAK, for_both_drives
from tests.cli.test_cli_move import WALL as MOVE_WALL
from tests.cli.test_cli_move_environment import PLANE as MOVE_ENVIRONMENT_PLANE
from tests.cli.test_cli_simulate import SOFT
from tests.cli.test_cli_simulate import WALL as SIMULATE_WALL
from tests.device.device_cases import ARM_FILE
from zwidth.show import draw_mechanism_motion, mechanism_motion_figure

# --- what is said of a contact or a motion where nothing moves, where numbers are needless, or -------


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


# --- `zwidth simulate`: what is refused on one line, what has no answer, and what an -----------------


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


# --- `zwidth simulate`: what happens on contact, held to eigenvalues, harmonic balance and the -------


simulate_folder = test_cli_simulate.folder


def test_people_read_verdict_growth_energies_and_remarks(simulate_folder):
    out = run_command("simulate", TWO_MASS, *SIMULATE_WALL).out
    assert "stable: the vibration dies away" in out
    assert "by the eigenvalues -0.01122" in out
    assert "stored since the start" in out
    out = run_command("simulate", ONE_MASS, *SOFT, "--wall", "one-sided", "--start-position", 0.001).out
    assert "starts inside the wall" in out
    out = run_command("simulate", "rubbing.toml", *SOFT, "--set", "loop.saturation.force_N=0.1").out
    assert "at the force limit" in out
    assert "leaves out" not in out
    out = run_command("simulate", ONE_MASS, "--stiffness", 200_000, "--damping", 1, "--duration", 1).out
    assert "stopped early" in out
    out = run_command("simulate", TWO_MASS, *SIMULATE_WALL, "--tremor", "1,10").out
    assert "leave out --tremor" in out


# --- `zwidth move`: a whole mechanism in motion, held to the Python call, to `simulate`, and ---------


def test_people_read_how_deep_how_hard_and_remarks(tmp_path):
    out = run_command("move", MECHANISM, *BALL).out
    assert "largest penetration  4.382 mm, after 102.5 ms" in out
    assert "largest force        6.013 N, after 98.75 ms" in out
    assert "none in the file" in out
    out = run_command("move", MECHANISM, "--plane", "0,0.24,0,-1", *MOVE_WALL, "--duration", 0.02).out
    assert "starts 10.00 mm inside the wall" in out
    assert "nothing moves the handle" in run_command("move", MECHANISM, "--duration", 0.02).out
    out = run_command(
        "move", MECHANISM, "--plane", "0,0.28,0,-1", *MOVE_WALL, "--push", "0,1", "--duration", 0.02
    ).out
    assert "the handle never touches the surface" in out
    parts = (
        *for_both_drives("coulomb_Nm", 0.001),
        *for_both_drives("encoder_counts_per_rev", 500),
        "--substeps",
        2,
    )
    out = run_command("move", MECHANISM, *BALL, *parts, *WEAK).out
    assert "includes what a chart leaves out: dry friction, encoder steps" in out
    assert "use --substeps 4 or more" in out
    assert "motor-right reached in" in out
    assert "dry friction" in out
    arm = ("arm_mass_kg=1", "arm_stiffness_N_per_m=100", "arm_damping_Ns_per_m=1", "grasp=rigid")
    held = (MECHANISM, *BALL, *(word for key in arm for word in ("--set", f"operator.{key}")))
    document = document_of("move", *held)
    assert (document["left_out"], document["operator"]) == (["the operator"], None)
    assert "leaves out the operator: the hand is only the push" in run_command("move", *held).out


PLANE = ("--plane", "0,0.28,0,-1")
MOVE_BAD = [
    ((*PLANE, "--sphere", "0,0.3,0.05", *MOVE_WALL), "--plane and --sphere exclude each other"),
    (MOVE_WALL, "--stiffness needs a surface; add --plane"),
    (("--hollow",), "--hollow needs a surface"),
    ((*PLANE, "--stiffness", 10), "missing: --damping"),
    ((*PLANE, "--damping", 10), "missing: --stiffness"),
    ((*PLANE, *MOVE_WALL, "--hollow"), "goes with --sphere or --box"),
    (("--box", "0,0.3,0.1,0.1", *MOVE_WALL, "--two-sided"), "goes with --plane"),
    ((*PLANE, *MOVE_WALL, "--two-sided", "--no-pull"), "always pulls"),
    ((*PLANE, "--stiffness", -1, "--damping", 1), "at least 0"),
    ((*PLANE, "--stiffness", 1, "--damping", "nan"), "finite"),
    (("--plane", "0,0.28,0", *MOVE_WALL), "4 or 6 finite numbers"),
    (("--plane", "0,0.28,0,0", *MOVE_WALL), "--plane: the plane's normal has no length"),
    (("--plane", "0,1,0,-1", *MOVE_WALL), "--plane: the handle never touches the surface"),
    (("--sphere", "0,0.3,-0.05", *MOVE_WALL), "--sphere: the sphere's radius must be positive"),
    (("--sphere", "1,1,0.05", *MOVE_WALL), "--sphere: the handle never touches the surface"),
    (("--box", "0,0.3,0,0.05", *MOVE_WALL), "--box: the box's half_sizes must be"),
    (("--box", "0,0.3,0.05", *MOVE_WALL), "4 or 6 finite numbers"),
    (("--duration", 0), "above 0"),
    (("--duration", 1e9), "GB"),
    (("--substeps", 0), "from 1 to 100000"),
    (("--seed", -1), "a whole number from 0"),
    (("--push", "nan"), "finite numbers"),
    (("--push", "1,2,3,4"), "1 or 2 or 3 finite numbers"),
    (("--push", 1, "--direction", "0,0"), "direction: has zero length"),
    (("--direction", "1,0"), "--direction is used only with a --push"),
    (("--push", "1,0", "--direction", "1,0"), "--direction is used only with a --push"),
    (("--start-velocity", "0,0,1"), "--start-velocity: the handle cannot move"),
    (("--gravity", "9.81"), "2 or 3 finite numbers"),
    (("--model", "rigid"), "--model rigid does not apply"),
    (("--operator", "thesis-arm"), "no operator holds the mechanism"),
    (("--assembly", "elbows"), "assembly"),
    (("--torque-limits", "some"), "not one of"),
    (("--output", "path.wav"), "must end in"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "said"), MOVE_BAD, ids=[" ".join(map(str, words)) for words, _ in MOVE_BAD])
def test_what_cannot_be_meant_is_refused_on_one_line(words, said):
    (line,) = refusal_lines("move", MECHANISM, *words)
    assert said in line


def test_a_device_without_a_mechanism_is_refused():
    (line,) = refusal_lines("move", TWO_MASS)
    assert "has a [plant] and no [mechanism] to move; `zwidth simulate` takes a [plant]" in line


# --- `zwidth move --environment`: every environment of `zwidth simulate` at a surface, by its --------


MOVE_ENVIRONMENT_BAD = [
    (("--environment", "slot"), "--environment needs a surface; add --plane"),
    (("--parameter", "width=1"), "--parameter needs a surface; add --plane"),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--parameter", "width=1", "--stiffness", 1, "--damping", 1),
        "--parameter belongs to --environment",
    ),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "slot", "--two-sided"),
        "--two-sided and --environment exclude each other",
    ),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "slott"),
        "--environment: no environment is named 'slott'; did you mean slot?",
    ),
    ((*MOVE_ENVIRONMENT_PLANE, "--environment", ""), "is empty"),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "slot", "--parameter", "wide=1"),
        "--parameter: slot has no parameter wide",
    ),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "slot", "--parameter", "width=-1"),
        "--parameter: width of slot must be from 0",
    ),
    ((*MOVE_ENVIRONMENT_PLANE, "--environment", "slot", "--parameter", "width"), "must be NAME=NUMBER"),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "slot", "--parameter", "stiffness=1", "--stiffness", 2),
        "--parameter: stiffness is given twice",
    ),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "grating", "--stiffness", 2),
        "--stiffness: grating has no such parameter",
    ),
    (
        (*MOVE_ENVIRONMENT_PLANE, "--environment", "texture", "--no-pull"),
        "--no-pull: texture has no such parameter",
    ),
]


@pytest.mark.parametrize(
    ("words", "said"), MOVE_ENVIRONMENT_BAD, ids=[" ".join(map(str, words)) for words, _ in MOVE_ENVIRONMENT_BAD]
)
def test_an_environment_that_cannot_be_meant_is_refused_on_one_line(words, said):
    (line,) = refusal_lines("move", MECHANISM, *words)
    assert said in line


# --- `zwidth limit-cycles`: what is predicted, what the simulation finds there, and when there -------


def test_people_read_the_same():
    out = " ".join(run_command("limit-cycles", ONE_MASS, *ROUGH_AND_LIMITED).out.split())
    assert "2.600 kN/m, 0 N s/m: unstable if linear" in out
    assert "nonlinear parts dry friction, encoder steps, the force limit" in out
    assert "rests under every push on walls up to 3.000 kN/m" in out
    assert "450.8 µm 46.51 Hz" in out
    assert "stable: persists" in out
    assert "limit cycle, 2.778 mm" in out
    assert "describing function" not in out  # all are predicted, which the last line says
    assert "leaves out" not in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--offset", "0.5"), "no encoder steps"),
        (("--offset", "2"), "at least -0.5 and at most 0.5"),
        (("--plane", "plane.png"), "no encoder steps"),
        (("--plane", "plane.csv"), "plane.csv"),
        ((*ROUGH[:2], "--plane", "plane.png", "--stiffness", "-1"), "positive stiffness"),
        (("--plane", "same.png", "--output", "same.png"), "name another"),
    ],
)
def test_what_cannot_be_asked_is_refused_in_one_line(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (line,) = refusal_lines("limit-cycles", TWO_MASS, *LIMIT_CYCLES_WALL, *LIMITED, *words)
    assert said in line
    assert list(tmp_path.iterdir()) == []
