"""What the commands about walls print and refuse."""

from __future__ import annotations

import re
from math import pi

import pytest

from tests.cli import test_cli_bounds
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, refusal_lines, run_command
from tests.cli.test_cli_check import HEAD
from tests.cli.test_cli_felt import WALL as FELT_WALL
from tests.cli.test_cli_relative_wall import DIRECTIONS
from tests.cli.test_cli_relative_wall import WALL as RELATIVE_WALL_WALL
from tests.cli.test_cli_robust import MASSES, QUICK
from tests.cli.test_cli_wanted import FEW, STUDY
from zwidth.loop import SidewaysMotion
from zwidth.loop.motion_names import listed_names

# --- a velocity estimate that is not linear has no chart: one line, and what to do instead -----------


DEVICE = """
name = "adaptive"
[plant]
mass_kg = 0.05
damping_Ns_per_m = 1.0
handle = 1.0
[loop]
sampling_period_s = 0.001
[loop.encoder]
resolution_m = 1e-5
[loop.velocity]
method = "foaw"
samples = 20
fit = "best-fit"
"""
RESPONSE = """
name = "swept"
[response]
file = "sweep.csv"
integrators = 1
[loop]
sampling_period_s = 0.001
[loop.velocity]
method = "levant"
acceleration_max_m_per_s2 = 30.0
"""
WALL = ("--stiffness", 100, "--damping", 1)
COMMANDS = {
    "chart": (),
    "check": WALL,
    "bounds": (),
    "report": (),
    "sensitivity": (),
    "felt": WALL,
    "robust": ("--range", "plant.mass_kg=0.04,0.06", "--members", 3, "--unseen", 2),
    "guarantees": (),
}
LEVANT = ("--set", "loop.velocity.method=levant", "--set", "loop.velocity.acceleration_max_m_per_s2=30")
LINEAR = ("--set", "loop.velocity.method=backward-difference")


@pytest.fixture
def device(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "adaptive.toml").write_text(DEVICE)
    return "adaptive.toml"


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("more", [(), ("--json",)], ids=["text", "json"])
def test_what_charts_refuses_in_one_line_and_writes_nothing(device, tmp_path, command, more):
    before = set(tmp_path.iterdir())
    (line,) = refusal_lines(command, device, *COMMANDS[command], *more)
    assert line.startswith(
        "adaptive.toml: adaptive windowing is not linear, so it has no chart; use zwidth simulate"
    )
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("command", ["chart", "polar", "bounds"])
def test_a_mechanism_is_refused_alike(command):
    (line,) = refusal_lines(command, MECHANISM, *LEVANT)
    assert line.startswith(f"{MECHANISM}: Levant's differentiator is not linear, so it has no chart")


def test_a_measured_device_is_refused_alike(device, tmp_path):
    (tmp_path / "swept.toml").write_text(RESPONSE)
    paddle = {f: 1.0 / ((1.0 + 0.05 * 2j * pi * f) * 2j * pi * f) for f in range(1, 401)}
    rows = [f"{f},{value.real},{value.imag}" for f, value in paddle.items()]
    (tmp_path / "sweep.csv").write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *rows]))
    for words in (("chart",), ("check", *WALL)):
        (line,) = refusal_lines(words[0], "swept.toml", *words[1:])
        assert line.startswith("swept.toml: Levant's differentiator is not linear")


def test_what_the_line_says_to_do_gives_a_chart(device):
    (line,) = refusal_lines("chart", device)
    setting = line.rpartition("with ")[2].split()
    assert tuple(setting) == LINEAR
    assert document_of("chart", device, *setting)["stiffness_max_N_per_m"] > 0.0


def test_what_needs_no_velocity_is_shown_with_the_method():
    ran = run_command("show", MECHANISM, *LEVANT)
    assert ran.code == 0
    assert "velocity by levant (acceleration max 30)" in ran.out


def test_the_method_is_told_with_its_parameters(device):
    ran = run_command("show", device)
    assert ran.code == 0
    assert "velocity by foaw (samples 20, position noise 5 × 10⁻⁶, best-fit)" in ran.out


# --- linear answers on a device that is not linear: the same numbers as without, and a line on -------


FRICTION_AND_ENCODER = ("--set", "friction.coulomb_N=[0.0, 0.1]", "--set", "loop.encoder.resolution_m=1e-5")
LIMITED = (*FRICTION_AND_ENCODER, "--set", "loop.saturation.force_N=20")
LEFT_OUT_MESSAGE = "linear: leaves out dry friction, encoder steps, the force limit; `zwidth simulate` has them"
WORDS = ["dry friction", "encoder steps", "the force limit"]
LINEAR_COMMANDS = {
    "chart": (),
    "check": ("--stiffness", 4000, "--damping", 10),
    "felt": ("--stiffness", 4000, "--damping", 10),
    "show": (),
    "bounds": (),
    "guarantees": ("--model", "rigid"),
    "robust": ("--range", "loop.delay_samples=0,0.2", "--members", 3, "--unseen", 1),
    "sensitivity": (),
}


@pytest.mark.parametrize("command", LINEAR_COMMANDS)
def test_every_linear_answer_says_what_it_leaves_out_and_stays_what_it_was(command):
    options = LINEAR_COMMANDS[command]
    told = run_command(command, TWO_MASS, *options, *LIMITED)
    assert told.code == 0
    assert told.out.splitlines()[2] == LEFT_OUT_MESSAGE
    assert "leaves out" not in run_command(command, TWO_MASS, *options).out
    plain, document = document_of(command, TWO_MASS, *options), document_of(command, TWO_MASS, *options, *LIMITED)
    if command == "sensitivity":  # there the key lists numbers
        reasons = {entry["path"]: entry["reason"] for entry in document["left_out"]}
        assert reasons["friction.coulomb_N.1"] == "dry friction, which the chart leaves out: it is linear"
        assert "loop.saturation.force_N" in reasons
        same = {n["path"]: n for n in document["sensitivities"]}
        assert all(same[n["path"]] == n for n in plain["sensitivities"])
        assert same["loop.encoder.resolution_m"]["d_ln_stiffness_max_d_ln_value"] == 0.0
        return
    assert document["left_out"] == WORDS
    assert plain["left_out"] == []
    for key in plain.keys() - {"left_out", "bounds"}:
        assert document[key] == plain[key], key


def test_all_directions_of_a_mechanism_say_so_too():
    rubbing = ("--set", "drives.motor-left.coulomb_Nm=0.001", "--set", "drives.motor-left.torque_limit_Nm=0.2")
    told = run_command("polar", MECHANISM, "--count", 8, *rubbing).out
    assert "linear: leaves out dry friction, the force limit; `zwidth simulate` has them" in told
    assert "sampled every 1.25 ms" in told
    document = document_of("chart", MECHANISM, "--with-direction", "1,0", *rubbing)
    assert document["left_out"] == ["dry friction", "the force limit"]
    assert (
        document["stiffness_max_N_per_m"]
        == document_of("chart", MECHANISM, "--with-direction", "1,0")["stiffness_max_N_per_m"]
    )


def test_the_conditions_on_friction_and_steps_get_their_numbers():
    settings = ("--set", "friction.coulomb_N=0.002", "--set", "loop.encoder.resolution_m=1e-4")
    bounds = document_of("bounds", ONE_MASS, "--damping", 0, *settings)["bounds"]
    told = {bound["name"]: bound for bound in bounds if "coulomb_friction_N" in bound["taken"]}
    assert len(told) == 2
    for bound in told.values():
        assert bound["lacking"] == []
        assert bound["taken"]["coulomb_friction_N"] == 0.002
        assert bound["taken"]["resolution_m"] == 1e-4
        assert bound["stiffness_max_N_per_m"] == pytest.approx(40.0)  # 2 C/Delta
    still = document_of("bounds", ONE_MASS, "--damping", 0, *settings[:2])["bounds"]
    assert {tuple(b["lacking"]) for b in still if b["name"] in told} == {("resolution_m",)}
    # two drives: both motors' steps, weighed by how far they move the handle
    counts = [
        f"drives.motor-{side}.{key}"
        for side in ("left", "right")
        for key in ("coulomb_Nm=0.001", "encoder_counts_per_rev=2000")
    ]
    arm = document_of("bounds", MECHANISM, *(word for count in counts for word in ("--set", count)))["bounds"]
    (taken, *_) = [bound["taken"] for bound in arm if "resolution_m" in bound["taken"]]
    assert taken["resolution_m"] == pytest.approx(2 * 0.0908347672 * 2 * 3.14159265359 / (2000 * 18.6), rel=1e-8)
    assert taken["coulomb_friction_N"] == pytest.approx(18.6 * 0.002 * 0.5 / 0.0908347672, rel=1e-6)


def test_the_report_says_so_and_gives_the_conditions_their_numbers(tmp_path):
    file = tmp_path / "r.html"
    sentence = "All of this is linear and leaves out {}, which zwidth simulate includes."
    settings = ("--set", "friction.coulomb_N=0.002", "--set", "loop.encoder.resolution_m=1e-4")
    told = run_command("report", ONE_MASS, "--output", file, *settings)
    assert sentence.format("dry friction and encoder steps") in told.out
    assert sentence.format("dry friction and encoder steps") in file.read_text()
    assert "40" in file.read_text()
    document = document_of("report", ONE_MASS, "--output", file, *settings[:2])
    assert document["left_out"] == ["dry friction"]
    assert sentence.format("dry friction") in file.read_text()
    assert "leaves out" not in run_command("report", ONE_MASS, "--output", file).out
    assert "All of this is linear" not in file.read_text()


# --- `zwidth bounds`: published conditions beside the exact answer, and every way of asking ----------


paddle = test_cli_bounds.paddle


def test_people_read_which_assumptions_are_not_met():
    out = run_command("bounds", TWO_MASS).out
    assert "exact, at 9.975 N s/m" in out
    assert "7.134 kN/m" in out
    assert "1  The device moves along the wall as one rigid mass, tied to nothing." in out
    assert "not applied, because the device lacks what they need:" in out


def test_a_device_that_breaks_nothing_shows_no_list(paddle):
    """Of the conditions that speak, those on a delay or a filter still assume one."""
    out = run_command("bounds", paddle, "--model", "rigid").out
    assert "The device moves along the wall as one rigid mass" not in out


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--damping", "abc"), "must be a finite number [N s/m], got 'abc'"),
        (("--damping", "nan"), "must be a finite number [N s/m], got nan"),
        (("--damping", "inf"), "must be a finite number [N s/m], got inf"),
        (("--damping", ""), "must be a finite number [N s/m]"),
        (("--damping",), "requires an argument"),
        (("--output", "bounds.txt"), "must end in"),
        (("--output", "no/such/folder.csv"), "there is no folder"),
        (("--set", "plant.mass=1"), "mass"),
        (("--model", "floppy"), "'floppy' is not one of"),
        (("--window", "0,1,0,1"), "no such option"),
    ],
)
def test_bad_input_is_refused(words, says):
    lines = refusal_lines("bounds", TWO_MASS, *words)
    assert any(says in line for line in lines)


# --- `zwidth check`: verdicts on single walls, and every way a file of walls can be wrong ------------


@pytest.mark.parametrize(
    ("name", "says"), [("nowhere.csv", "no such file"), (".", "is a directory"), ("a\0b", "cannot be read")]
)
def test_a_file_of_walls_that_cannot_be_read(tmp_path, monkeypatch, name, says):
    monkeypatch.chdir(tmp_path)
    (line,) = refusal_lines("check", TWO_MASS, "--points", name)
    assert says in line


def test_walls_that_no_device_renders_are_refused(tmp_path):
    file = tmp_path / "walls.csv"
    file.write_text(HEAD + "1e308,1e308\n1e15,-1e15\n")
    lines = refusal_lines("check", TWO_MASS, "--points", file)
    assert len(lines) == 2
    assert "line 2: stiffness_N_per_m: must be from -1e+15 to 1e+15, got '1e308'" in lines[0]
    for command in ("check", "felt"):
        (line,) = refusal_lines(command, TWO_MASS, "--stiffness", "1e308", "--damping", "5")
        assert "'--stiffness': must be from -1e+15 to 1e+15 [N/m], got 1e+308" in line
    (point,) = document_of("check", TWO_MASS, "--stiffness", "1e15", "--damping", "1e15")["points"]
    assert point["verdict"] == "unstable"


# --- `zwidth chart`: the thesis's numbers under the promised keys, figures, data, and no answer ------


def test_people_read_the_numbers_with_units():
    text = run_command("chart", TWO_MASS, "--set", "loop.delay_samples=0.5").out
    assert "Published two-mass plant" in text
    assert "0.5 samples of delay" in text
    assert "kN/m" in text
    assert "Hz" in text
    unobserved = document_of("chart", MECHANISM)["unobserved_modes"]
    assert unobserved
    assert ", ".join(unobserved) in run_command("chart", MECHANISM).out


# --- `zwidth felt`: what the hand feels of a wall, and when that question has no answer --------------


def test_people_read_the_same():
    out = run_command("felt", TWO_MASS, *FELT_WALL).out
    for row in (
        "wall                  4.000 kN/m, 10.00 N s/m: stable",
        "felt at rest          3.185 kN/m (79.61 % of it)",
        "felt in free motion   0.2870 kg",
        "the structure itself has  15.62 kN/m: nothing stiffer is felt",
    ):
        assert " ".join(row.split()) in " ".join(out.split())
    assert "the structure itself has" not in run_command("felt", ONE_MASS, *FELT_WALL).out
    assert document_of("felt", ONE_MASS, *FELT_WALL)["static_stiffness_limit_kind"] == "infinite"


# --- commands about a device whose links bend: they agree with each other, and with the device -------


def test_few_modes_and_those_that_grow_are_named_one_by_one():
    few = [f"mode at {100 * k} Hz (damping ratio 0.05)" for k in range(1, 7)]
    assert listed_names(few) == few
    many = [*few, "mode at 2e+04 Hz (damping ratio 0.05)"]
    assert listed_names(many) == ["7 modes from 100 Hz to 20 kHz"]
    grows = "mode at 50 Hz (damping ratio -0.01)"
    assert listed_names([*many, grows]) == [grows, "7 modes from 100 Hz to 20 kHz"]


def test_many_motions_along_a_surface_are_named_by_their_number_and_range():
    growing = [SidewaysMotion(0.1 * k, 0.0).name for k in range(1, 7)]
    other = SidewaysMotion(-0.3, 0.0).name
    assert listed_names([*growing, other]) == [*growing, other]
    growing.append(SidewaysMotion(2.0, 0.0).name)
    assert listed_names([*growing, other]) == [
        other,
        "7 sideways motions that grow by 0.1 to 2 1/s (the fastest doubles in 0.3466 s)",
    ]
    decaying = [SidewaysMotion(-0.1 * k, 40.0).name for k in range(1, 10)]
    assert listed_names(decaying) == ["9 sideways vibrations that decay by 0.1 to 0.9 1/s"]


# --- who holds the device: `--operator` and the [operator] of a device file --------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--operator", "thesis-arm"), "an operator is not supported over several directions"),
        (("--set", "loop.encoder.at=link"), "an encoder on the link is not supported"),
        (
            tuple(
                word
                for key in ("winding_resistance_ohm=2.0", "damping_resistance_ohm=0.0")
                for word in ("--set", f"drives.motor-left.{key}")
            ),
            "electrical damping is not supported",
        ),
    ],
)
@pytest.mark.parametrize("command", [("polar",), ("chart", "--with-direction", "1,0")], ids=["polar", "chart"])
def test_directions_together_leave_nothing_out_in_silence(command, words, said):
    (line,) = refusal_lines(command[0], MECHANISM, *command[1:], *words)
    assert said in line


def test_the_heading_names_him_and_what_the_computer_does():
    settings = ["loop.velocity.method=windowed-difference", "loop.velocity.samples=3"]
    settings += ["loop.actuator.time_constant_s=0.0002", "loop.force.filter.type=first-order"]
    settings += ["loop.force.filter.time_constant_s=0.001"]
    words = [word for setting in settings for word in ("--set", setting)]
    ran = run_command("chart", TWO_MASS, "--operator", "thesis-arm", *words)
    assert "as given, held by thesis-arm" in ran.out
    assert (
        "velocity by windowed-difference (samples 3), force through a first-order filter of 1 ms, "
        "force lagging by 200 µs" in ran.out
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("--operator", "thesis-arms"),
            "thesis-arms: is neither a file nor a bundled operator; did you mean 'thesis-",
        ),
        (("--operator", ""), "'--operator': is empty"),
        (
            ("--operator", "thesis-arm", "--set", "plant.handle=unset"),
            "operator: needs a handle; give plant.handle",
        ),
        (("--set", "operator.arm_mass_kg=1"), "operator: does not say how the handle is held"),
    ],
)
def test_a_bad_question_is_one_line(words, said):
    (line,) = refusal_lines("chart", TWO_MASS, *words)
    assert said in line


# --- `zwidth polar`: every direction of a plane, and what has none -----------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((TWO_MASS,), "one direction only"),
        ((MECHANISM, "--direction", "0,1"), "--direction"),
        ((MECHANISM, "--count", "2"), "--count"),
        ((MECHANISM, "--plane", "ab"), "--plane"),
        ((MECHANISM, "--output", "polar.xyz"), "polar.xyz"),
    ],
)
def test_bad_input_is_one_line_and_nothing_on_standard_output(words, said):
    ran = run_command("polar", *words)
    assert (ran.code, ran.out) == (2, "")
    assert len(ran.lines) == 1
    assert said in ran.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((TWO_MASS, "--with-direction", "1,0"), "one direction only"),
        ((MECHANISM, "--with-direction", "0,1"), "not indep"),
    ],
)
def test_directions_that_cannot_be_charted_together(words, said):
    ran = run_command("chart", *words)
    assert (ran.code, ran.out) == (2, "")
    assert said in ran.err


# --- `zwidth chart` and `zwidth check` of walls that differ along their directions -------------------


def test_people_read_the_ratios():
    shown = run_command("check", MECHANISM, *DIRECTIONS, *RELATIVE_WALL_WALL, "--relative-stiffness", "10,2").out
    assert re.search(r"wall along +\(0, 1\) and \(1, 0\)\n", shown)
    assert re.search(r"relative stiffness +1 : 0\.2\n", shown)
    assert re.search(r"relative damping +1 : 0\.2\n", shown)
    rows = run_command(
        "check", MECHANISM, *DIRECTIONS, *RELATIVE_WALL_WALL, "--relative-stiffness", "1,0.1;0.1,0.5"
    ).out
    assert re.search(r"relative stiffness +\(1, 0\.1; 0\.1, 0\.5\)\n", rows)


ENTRIES = "must be 2 numbers, one for each direction, or a matrix of 2 rows and columns, got"
SPELLING = "must be numbers such as 1,0.2 or rows such as '1,0.1;0.1,0.5', got"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("1", f"{ENTRIES} 1 number"),
        ("1,0.2,0.3", f"{ENTRIES} 3 numbers"),
        ("1,0;0,1;0,0", f"{ENTRIES} 3 rows of 2 numbers"),
        ("1,-0.2", "must not be negative, got -0.2"),
        ("-1,1", "must not be negative, got -1"),
        ("0,0", "must not be 0 along all directions"),
        ("1,0.3;0.2,1", "must be symmetric, got 0.3 in row 1, column 2 and 0.2 in row 2, column 1"),
        ("1,2;2,1", "must have no negative eigenvalue, got one of -1"),
        ("soft", f"{SPELLING} 'soft'"),
        ("1,nan", f"{SPELLING} '1,nan'"),
        ("1,0;0", f"{SPELLING} '1,0;0'"),
        ("1,,2", f"{SPELLING} '1,,2'"),
        ("", f"{SPELLING} ''"),
    ],
)
@pytest.mark.parametrize("option", ["--relative-stiffness", "--relative-damping"])
def test_what_is_no_wall_is_refused_in_one_line(option, given, says):
    for command, *rest in (("chart",), ("check", *RELATIVE_WALL_WALL)):
        (line,) = refusal_lines(command, MECHANISM, *DIRECTIONS, *rest, option, given)
        assert option in line
        assert says in line


@pytest.mark.parametrize("option", ["--relative-stiffness", "--relative-damping"])
@pytest.mark.parametrize("device", [MECHANISM, TWO_MASS])
def test_one_direction_has_no_ratios(device, option):
    for command, *rest in (("chart",), ("check", *RELATIVE_WALL_WALL)):
        (line,) = refusal_lines(command, device, *rest, option, "1,0.2")
        assert line == f"{option} needs several directions; give more of them by --with-direction"


# --- `zwidth robust`: the walls stable for every member, for people and for programs -----------------


def test_people_read_who_binds_what_is_lost_and_what_was_tried():
    ran = run_command("robust", ONE_MASS, *MASSES, *QUICK)
    assert ran.code == 0, ran.err
    assert ran.err == ""
    assert "loss against the best  50.00 % of its stiffness" in ran.out
    assert "none of 20 random ones makes one of these walls unstable" in ran.out
    assert "100.0 %" in ran.out
    assert "plant.mass_kg" in ran.out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), "nothing varies; give --range PATH=LOW,HIGH or --operators A,B,C"),
        (("--range", "plant.mass_kg"), "must be PATH=LOW,HIGH"),
        (("--range", "plant.mass_kg=1"), "must be PATH=LOW,HIGH"),
        (("--range", "plant.mass_kg=a,b"), "must be PATH=LOW,HIGH"),
        (("--range", "plant.mass_kg=0.1,0.2,0.3"), "must be PATH=LOW,HIGH"),
        (("--range", "=0.1,0.2"), "must be PATH=LOW,HIGH"),
        (("--range", "plant.mass_kg=0.2,0.1"), "LOW below HIGH, got 0.2,0.1"),
        (("--range", "plant.mass_kg=nan,0.1"), "finite"),
        (("--range", "plant.mas_kg=0.1,0.2"), "did you mean 'plant.mass_kg'?"),
        (("--range", "name=0.1,0.2"), "not a number"),
        (("--range", "plant.mass_kg=-0.1,0.2"), "-0.1 the device is not valid"),
        (("--operators", "none,nobody-we-know"), "nobody-we-know"),
        (("--operators", "none", "--operator", "none"), "leave out --operator"),
        (("--operators", "none", "--operator-list", "x"), "give one of them"),
        (("--operators", "none,,thesis-arm"), "names with commas"),
        ((*MASSES, "--members", "1"), "--members"),
        ((*MASSES, "--unseen", "0"), "--unseen"),
        ((*MASSES, "--output", "robust.doc"), "must end in"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(words, expected):
    lines = refusal_lines("robust", ONE_MASS, *words)
    assert any(expected in line for line in lines), lines
    assert len(lines) <= 2


# --- what measures must be told: options, keys of study files and axes, one table of numbers ---------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("stiffness_max_decaying",), "that the wall must not exceed; give --spectral-radius"),
        (("stiffness_max_with_margins",), "give --stiffness-margin and --damping-margin and --delay-margin"),
        (("link_clearance",), "needs the radius of the links; give --link-radius"),
        (("stiffness_max_decaying", "--spectral-radius", "1.5"), "above 0 and at most 1, got 1.5"),
        (("stiffness_max_with_margins", "--delay-margin", "-1"), "at least 0 and at most 20 [samples], got -1"),
        (("impedance_ratio", "--lowest-frequency", "0"), "must be a finite number, above 0 [Hz], got 0"),
        (("link_clearance", "--link-radius", "0", "--colliding-links", "a:b"), "has no link 'a' to check"),
        (("motor_heat", "--force", "1"), "needs a finite winding_resistance_ohm of every drive; give mechanism."),
    ],
)  # fmt: skip
def test_what_is_missing_or_impossible_is_one_line(words, said):
    (line,) = refusal_lines("map", MECHANISM, "--measure", *words, *FEW)
    assert said in line


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("stiffness_margin = 0.1", "stiffness_margin = -0.1"), "stiffness_margin"),
        (
            ("values = [0.0, 0.5]", "values = [0.0, -0.5]"),
            "must be a finite number, at least 0 and at most 20, got -0.5",
        ),
        (("colliding_links = [", "colliding_linkz = ["), "did you mean 'colliding_links'"),
        (('"upper-left:distal-right"', '"upper-left"'), "each written as 'A:B'"),
    ],
)
def test_a_wrong_number_of_a_study_is_one_line(tmp_path, change, said):
    file = tmp_path / "study.toml"
    file.write_text(STUDY.replace(*change), encoding="utf-8")
    lines = refusal_lines("sweep", str(file))
    assert any(said in line for line in lines)
