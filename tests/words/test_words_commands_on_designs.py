"""What the commands over workspaces and designs print and refuse."""

from __future__ import annotations

import builtins
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.cli import test_cli_export, test_cli_import, test_cli_new, test_cli_optimise, test_cli_sweep
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, refusal_lines, run_command
from tests.cli.test_cli_import import ARM, FIXED, JOINT, LINK, findings
from tests.cli.test_cli_map import FEW, OWN
from tests.cli.test_cli_optimise import PLANT, WALL, changed
from tests.cli.test_cli_sweep import LENGTH, OTHER, STUDY
from tests.show.test_show_sound import PLAIN, mass_on_spring_response
from tests.show.test_show_sound import SLOW as SOUND_SLOW
from zwidth.errors import NoAnswerError
from zwidth.show.sound import sound_of

# --- `zwidth map`: what it prints and writes, what it refuses, and where it has no answer ------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "--measure: is missing"),
        (
            ("--measure", "stifness_max"),
            "--measure: no measure is named 'stifness_max'; did you mean stiffness_max",
        ),
        (("--measure", "share_of_directions"), "needs --share"),
        (("--require", "isotropy=2"), "--require: 'isotropy=2' is not a requirement"),
        (("--share", "rigid_mass>=0.1", "--share", "rigid_mass>=0.2"), "--share: a map has one"),
        (("--share", "nothing"), "--share: 'nothing' is not a requirement"),
        (("--measures-file", "nowhere.py", "--measure", "isotropy"), "--measures-file: no such file"),
        (("--measure", "isotropy", "--plane", "xz"), "in a line; ask for --plane xy"),
        (("--measure", "isotropy", "--plane", "zz"), "--plane"),
        (("--measure", "isotropy", "--plane", "1,0,0,2,0,0"), "are parallel"),
        (("--measure", "isotropy", "--through", "0,0.2,0.3"), "0.3 m beside it; it reaches"),
        (("--measure", "isotropy", "--x", "1,2"), "reaches no point of this plane"),
        (("--measure", "isotropy", "--x", "0.2,0.1"), "LOW < HIGH"),
        (("--measure", "isotropy", "--cells", "1,5"), "at least 2 points"),
        (("--measure", "isotropy", "--cells", "5"), "2 whole numbers"),
        (("--measure", "isotropy", "--cells", "9999999,9999"), "at most"),
        (("--measure", "isotropy", "--direction", "worse"), "one of worst, best"),
        (("--measure", "rigid_mass", "--direction", "best"), "rigid_mass has no better side"),
        (("--measure", "isotropy", "--assembly", "elbows"), "assembly"),
        (("--measure", "peak_force"), "peak_force needs"),
        (("--measure", "isotropy", "--at", "0,0.2"), "--at"),
        (("--measure", "isotropy", "--frequency", "0"), "'--frequency': must be a finite number, above 0"),
        (("--measure", "isotropy", "--output", "map.html"), "must end in"),
    ],
)
def test_bad_input_is_one_line(words, said):
    (line,) = refusal_lines("map", MECHANISM, *words)
    assert said in line


def test_a_measure_of_one_s_own_cannot_be_called_a_share(tmp_path):
    (tmp_path / "my.py").write_text(OWN.replace("def never", "def share_of_directions"))
    (line,) = refusal_lines("map", MECHANISM, "--measures-file", tmp_path / "my.py", "--measure", "inertial_force")
    assert "the name share_of_directions is taken by --share" in line


def test_people_read_numbers_and_where_they_are():
    out = run_command("map", MECHANISM, "--measure", "isotropy", "--require", "isotropy<=1.5", *FEW).out
    assert "Condition number of the Jacobian (isotropy)" in out
    assert re.search(r"best +1\.0\d+ at \(.*\) m", out)
    assert re.search(r"cells +\d+ ok, \d+ out of reach", out)
    assert re.search(r"common area +\d+(\.\d+)? cm², \d+\.\d+ % of the reachable area", out)


# --- `zwidth sweep`: designs, their values and what became of them; files, resuming, and -------------


folder = test_cli_sweep.folder


def test_what_people_read(folder):
    ran = run_command("sweep", "study.toml")
    assert (ran.code, ran.err) == (0, "")
    assert "5 x 2 designs over links.upper-right.length_m, assembly" in ran.out
    assert ran.out.count("out of reach") == 4
    text = STUDY.replace("count = 5", "count = 21") + "[optimise]\nbudget = 3\n"
    (folder / "study.toml").write_text(text)
    ran = run_command("sweep", "study.toml")
    assert "[optimise] is not used" in ran.out
    assert re.search(r"lowest +1\.\d+ at links\.upper-right\.length_m = 0\.18, assembly = elbows-", ran.out)
    assert re.search(r"designs +\d+ ok, \d+ out of reach", ran.out)


def test_reasons_are_told_once_and_not_all_of_them(folder):
    text = STUDY.replace(LENGTH, "links.distal-left.mass_kg").replace(
        "range = [0.02, 0.18]", "range = [-0.9, 0.1]"
    )
    text = text.replace(f'tie = ["{OTHER}"]', "").replace("count = 5", "count = 11")
    (folder / "study.toml").write_text(text)
    ran = run_command("sweep", "study.toml")
    reasons = [line for line in ran.out.splitlines() if "designs failed" in line]
    assert len(reasons) == 6
    assert reasons[0].startswith(
        "2 designs failed: mechanism.links.distal-left.mass_kg: must be at least 0, got -0.9"
    )
    assert "and 3 more reasons; --json or --output holds them" in ran.out
    assert len(document_of("sweep", "study.toml")["notes"]) == 18


def test_everything_wrong_is_told_at_once(folder):
    wrong = STUDY.replace("rigid_mass", "rigd_mass").replace(OTHER, "links.upper-left.lenght_m")
    (folder / "study.toml").write_text(wrong)
    assert [line.split(";")[0] for line in refusal_lines("sweep", "study.toml")] == [
        "study.toml: measures.0: no measure is named 'rigd_mass'",
        "study.toml: axis.0.tie.0: 'links.upper-left.lenght_m' is not a key of a device file",
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.toml"], "none.toml: no such file; give a study file"),
        (["."], ".: is a directory; give a study file"),
        (["study.toml", "--output", "a.txt"], "a.txt: must end in one of .png, .svg, .pdf"),
        (["study.toml", "--output", "there.zarr"], "there.zarr: exists already; remove it, or name another"),
        (["study.toml", "--workers", "0"], "must be a whole number from 1 on, got 0"),
        (["study.toml", "--resume", "slow.py"], "slow.py: is not the store of a study; name another folder"),
        (["study.toml", "--resume", "no/where"], "no/where"),
        (["plant.toml"], "plant.toml: measures: isotropy needs a [mechanism]"),
        (["large.toml"], "large.toml: 100000000000000 designs of 1 measure are more than"),
        (["study.toml", "--time-limit", "0"], "above 0 [s], got 0; leave it out for none"),
        (
            ["study.toml", "--cluster", "tcp://a:1", "--workers", "2"],
            "--workers: is for processes of this computer",
        ),
    ],
)
def test_what_is_refused(folder, words, said):
    (folder / "there.zarr").mkdir()
    axis = '[[axis]]\nkey = "plant.mass_kg.{0}.{0}"\nrange = [0.1, 0.2]\ncount = {1}\n'
    head = 'device = "published-two-mass"\nmeasures = ["{}"]\n'
    (folder / "plant.toml").write_text(head.format("isotropy") + axis.format(0, 3))
    (folder / "large.toml").write_text(
        head.format("stiffness_max") + axis.format(0, 10**7) + axis.format(1, 10**7)
    )
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    if words[-1] == "no/where":
        (folder / "no").write_text("a file")
        before[folder / "no"] = b"a file"
    (line,) = refusal_lines("sweep", *words)
    assert said in line
    assert before == {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}


# --- `zwidth optimise`: the page's study, files, what is said, resuming, and everything refused ------


optimise_folder = test_cli_optimise.folder


@pytest.mark.parametrize(
    ("old", "new", "before", "after"),
    [
        (', spectral_radius = "min"', "", None, "the best design found has"),
        ("front = 5\n", "front = 5\nconstraints = { stiffness_max = '<= 3000' }\n", None, None),
        (WALL, WALL.replace("500.0", "1000.0"), "the wanted wall, simulated", "the wanted wall, simulated"),
        (', spectral_radius = "min"', "", "5 designs of the front, of", "the best found of"),
        ("set = [", 'set = ["loop.delay_samples=3", ', None, "the knee has"),
    ],
)
def test_sentences_follow_the_study(optimise_folder, old, new, before, after):
    first = run_command("optimise", "plant.toml").out
    (optimise_folder / "plant.toml").write_text(changed(WALL + PLANT, old, new))
    second = run_command("optimise", "plant.toml").out
    assert first != second
    assert before is None or before in first
    assert after is None or after in second


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("range = [0.02, 0.1]", "range = [0.1, 0.02]", "axis.0.range: must be [lower, upper] with lower < upper"),
        ("plant.mass_kg", "plant.mass", "axis.0.key: 'plant.mass' "),
        ('stiffness_max = "max"', 'stifness_max = "max"', "optimise.objectives.stifness_max: no measure is named"),
        ("budget = 60", "budget = 6", "budget: must be at least 20 designs, got 6"),
        ("[optimise]", "[optimize]", "optimize: is not a key of a study file; did you mean 'optimise'?"),
        (
            WALL,
            "",
            "optimise.objectives.spectral_radius: spectral_radius needs a wanted wall; give stiffness_N_per_m",
        ),
        ('{ stiffness_max = "max", spectral_radius = "min" }', "{}", "objectives"),
        (
            'stiffness_max = "max"',
            'isotropy = "min"',
            "optimise.objectives.isotropy: isotropy needs a [mechanism]",
        ),
        (
            "[optimise]",
            "[task]\nclearance_m = 0.01\n[optimise]",
            "plant.toml: task.clearance_m: worst(link_cl",
        ),
        ("front = 5", "constraints = { reach = '<= 1' }", "plant.toml: optimise.constraints.reach: reach needs a"),
    ],
)
def test_what_an_optimisation_cannot_use_is_refused(optimise_folder, old, new, line):
    (optimise_folder / "plant.toml").write_text(changed(WALL + PLANT, old, new))
    lines = refusal_lines("optimise", "plant.toml")
    assert any(line in one for one in lines), lines


# --- `zwidth export`: what it writes and says, what it refuses, and where it has no answer -----------


here = test_cli_export.here
SMOOTHED = "loop.velocity.filter={type='first-order', time_constant_s=0.1}"
EXPORT_FEW = ("--x", "-0.05,0.05", "--y", "0.2,0.5", "--cells", "1,3", "--levels", 2, "--workers", 1)


def test_people_read_what_the_table_holds_for(here):
    ran = run_command(
        "export", MECHANISM, *EXPORT_FEW, "--hands", "none,thesis-arm", "--margin", 0.1, "--arduino", "wall"
    )
    assert ran.code == 0
    words = " ".join(ran.out.split())
    assert "in every posture of a cell, in every direction, held by nobody, thesis-arm" in words
    assert "of 1 x 3 have safe walls" in words
    assert "stiffness and damping may be off by 10 %" in words
    assert "out of reach: a posture in the cell is out of reach" in words
    assert {path.name for path in (here / "wall").iterdir()} == {"wall.ino", "safe_walls.h"}
    assert (here / "wall" / "safe_walls.h").read_text() == (here / "safe_walls.h").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((MECHANISM, "--levels", 0), "'--levels': must be a whole number from 1 to 255, got 0"),
        ((MECHANISM, "--margin", 1), "'--margin': must be a finite number, at least 0 and below 1, got 1"),
        ((MECHANISM, "--span", -1), "'--span': must be a finite number, above 0 [N s/m], got -1"),
        ((MECHANISM, "--cells", "3"), "must be 2 or 3 whole numbers such as 20,10, got '3'"),
        ((MECHANISM, "--cells", "3,3,3"), "give --cells as NX,NY"),
        ((MECHANISM, "--z", "0,1"), "leave out --z"),
        ((MECHANISM, "--x", "1,0"), "range along x must be LOW,HIGH with LOW < HIGH"),
        ((MECHANISM, "--x", "5,6", "--y", "5,6", "--cells", "1,1", "--hands", "nobody-at-all"), "nobody-at-all"),
        ((MECHANISM, "--hands", "none,,"), "--hands: must be names with commas between them, got 'none,,'"),
        ((MECHANISM, "--hands", "none", "--operator", "none"), "--operator and --hands exclude each other"),
        ((MECHANISM, "--size-limit", 100), "bytes, more than the 100 of its limit; take fewer with --cells"),
        ((MECHANISM, "--output", "walls.txt"), "must end in one of .h, .png, .svg, .pdf, .csv, .json, .nc"),
        (
            (MECHANISM, "--arduino", "no/such/folder"),
            "--arduino: no/such/folder is no folder and cannot be made one",
        ),
        (
            (
                MECHANISM,
                "--arduino",
                "wall",
                "--set",
                SMOOTHED,
            ),
            "--arduino: five-bar: the sketch computes a wall by the backward difference",
        ),
        ((TWO_MASS, "--cells", "3,3"), "no workspace; its walls are the same everywhere"),
        ((TWO_MASS, "--directions", 2), "got 2 parts of directions; leave out --directions"),
        ((MECHANISM, "--set", "load.force_N=[0.0,-5.0]"), "leave the load out, with --set load=unset"),
        (("rice-haptic-paddle",), "renders moments about an axis"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(here, words, message):
    lines = refusal_lines("export", *words)
    assert any(message in line for line in lines), lines
    assert list(here.iterdir()) == []


# --- `zwidth import`: what it writes, what it tells, and what it refuses in one line -----------------


import_folder = test_cli_import.folder


def test_people_read_a_table_and_what_to_type_next(import_folder):
    (import_folder / "arm.xml").write_text(ARM)
    ran = run_command("import", "arm.xml", "--keyframe", "home", "--output", "mine.toml")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith("my arm: 2 links, 0 loops, 2 drives")
    assert "zwidth show" in ran.out
    assert "--handle NAME" in ran.out
    assert run_command("show", "mine.toml").code == 0


def chain(*joints, masses=(0.1, 0.1), extra=""):
    names = ["a", "b"]
    return "".join(
        ['<robot name="chain"><link name="ground"/>', *map(LINK.format, names, masses), *joints, extra, "</robot>"]
    )


J1 = JOINT.format("j1", "revolute", "ground", "a", "0 0 0.1", -1, 1)
J2 = JOINT.format("j2", "revolute", "a", "b", "0.2 0 0", -1, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            chain(J1, J2.replace('lower="-1" upper="1"', 'lower="-90" upper="90"'), extra=FIXED),
            "if it is in degrees, write 1.5708",
        ),
        (chain(J1, J2, masses=(120.0, 80.0), extra=FIXED), "if it is in g, write 0.12"),
        (chain(J1, J2, masses=(0.1, 0.0), extra=FIXED), "body 'b': has no mass; it is taken as massless"),
        (
            chain(J1, J2, extra=FIXED + '<transmission name="t"><joint name="j9"/></transmission>'),
            "transmission 't': is not of one joint that turns or slides; it is left out",
        ),
        (
            chain(J1, J2, extra=FIXED).replace('izz="1e-3"', 'izz="2.5e-3"', 1),
            "no body has one above the sum of the other two",
        ),
    ],
)
def test_what_looks_wrong_is_told_and_imported(import_folder, text, said):
    (import_folder / "robot.urdf").write_text(text)
    assert any(said in one for one in findings(document_of("import", "robot.urdf"), "warning"))


BODY = (
    '<body name="{0}"><joint name="{0}-j" axis="0 0 1"/>'
    '<inertial mass="1" pos="0.1 0 0" diaginertia="1e-3 1e-3 1e-3"/>{1}</body>'
)
TWO = BODY.format("one", BODY.format("two", ""))


def mjcf(bodies, more=""):
    return f"<mujoco><worldbody>{bodies}</worldbody>{more}</mujoco>"


MESHED = mjcf(
    '<body name="m"><joint/><geom type="mesh" mesh="g"/></body>',
    '<asset><mesh name="g" file="g.stl"/></asset>',
)
WELDED = mjcf(TWO.replace('name="two"', 'name="two" pos="0.1 0.1 0"'), '<equality><weld body1="two"/></equality>')
APART = mjcf(
    '<site name="b" pos="0 0 1"/>' + BODY.format("one", '<site name="a" pos="0.1 0 0"/>') + BODY.format("two", ""),
    '<equality><connect site1="a" site2="b"/></equality>',
)
GEARED = mjcf(TWO, '<equality><joint joint1="two-j" joint2="one-j" polycoef="0 3 0 0 0"/></equality>')
GRIPPER = mjcf(
    BODY.format("one", '<site name="tool" pos="0.1 0 0"/>') + BODY.format("grip", ""),
    '<actuator><motor joint="one-j"/><motor joint="grip-j"/></actuator>',
)
TWO_PARENTS = chain(J1, J2.replace('child link="b"', 'child link="a"'))
MACRO = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>'


@pytest.mark.parametrize(
    ("name", "text", "words", "said"),
    [
        ("x.urdf", "", [], "is neither MJCF nor URDF"),
        ("x.xml", "hello", [], "is neither MJCF nor URDF"),
        ("x.xml", "<html/>", [], "has the root <html>; MJCF begins with <mujoco>, URDF with <robot>"),
        ("x.sdf", "<sdf/>", [], "is SDF; export it as URDF or MJCF"),
        ("x.xml", "<mujoco>", [], "is not XML: no element found in line 1"),
        ("x.xml", '<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', [], "has a document type"),
        ("x.xml", "<mujoco/>", [], "does not say which site or body is the handle"),
        ("x.xml", mjcf(TWO, "<bogus/>"), [], "MuJoCo cannot read it: schema violation: unrecognized element"),
        ("x.xml", mjcf(TWO), ["--handle", "twi"], "'twi' is neither a site nor a body of the file; did you mean"),
        ("x.xml", mjcf(TWO), ["--keyframe", "home"], "'home' is not a keyframe of the file; the file has none"),
        ("x.xml", mjcf(TWO), ["--fix", "three"], "fix: 'three' is no joint"),
        ("x.xml", mjcf(TWO), ["--posture", "three=1"], "posture: 'three' is no joint that turns or slides"),
        ("x.xml", mjcf(TWO), ["--fix", "one-j,two-j"], "'handle': does not move"),
        ("x.xml", MESHED, [], "body 'm': has its mass from the mesh 'g', and meshes are not read; give it an"),
        ("x.xml", WELDED, ["--handle", "two"], "has loops that hold everything: 2 joint coordinates"),
        (
            "x.xml",
            APART,
            ["--handle", "two"],
            "loop 'loop-1': closes nowhere: its two points, on 'one' and 'base'",
        ),
        ("x.xml", GEARED, ["--handle", "two"], "lets 'two-j' follow 'one-j' by the ratio 3, which a device file"),
        ("x.xml", GRIPPER, [], "drives grip-j, which do not move the handle; hold them still with --fix grip-j"),
        ("x.urdf", TWO_PARENTS, [], "carries the link 'a', which 'j1' carries already: a URDF is a tree"),
        ("x.urdf", chain(J1, J2.replace("revolute", "screw")), [], "joint 'j2': has the type 'screw'"),
        ("x.urdf", chain(J1), [], "has 2 links that nothing carries: ground, b"),
        ("x.urdf", chain(J1, J2), ["--keyframe", "home"], "keyframe: is of MJCF; a URDF has none"),
        ("x.urdf", chain(J1, J2).replace('iyy="1e-3"', 'iyy="-1e-3"', 1), [], "no body has a negative one"),
        ("x.urdf", MACRO, [], "is a xacro macro, not yet a URDF"),
    ],
)
def test_what_is_refused_is_told_in_a_line(import_folder, name, text, words, said):
    (import_folder / name).write_text(text)
    (line,) = refusal_lines("import", name, *words)
    assert line.startswith(f"{name}: ")
    assert said in line
    assert [path.name for path in import_folder.iterdir()] == [name]


def test_a_file_that_is_not_there_or_too_large(import_folder):
    assert refusal_lines("import", "gone.xml") == ["gone.xml: no such file; give an MJCF or URDF file"]
    (import_folder / "large.xml").write_text(" " * 20_000_001)
    assert refusal_lines("import", "large.xml") == ["large.xml: is larger than 20 MB; give an MJCF or URDF file"]


def test_a_sentence_where_mujoco_is_not_installed(import_folder, monkeypatch):
    (import_folder / "arm.xml").write_text(ARM)
    real = builtins.__import__

    def without_mujoco(name, *arguments, **options):
        if name == "mujoco":
            raise ImportError(name)
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without_mujoco)
    (line,) = refusal_lines("import", "arm.xml")
    assert line == 'arm.xml: reading MJCF and URDF needs MuJoCo; install it with: pip install "zwidth[mjcf]"'


# --- `zwidth new`: the file that it writes, by whatever name, and what it refuses --------------------


new_folder = test_cli_new.folder


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["there", "--kind", "plant"],
            "there.toml: exists already; remove it, or name another file with --output",
        ),
        (["x", "--kind", "plant", "--output", "there.toml"], "there.toml: exists already"),
        (["no/where", "--kind", "plant"], "there is no folder"),
        (["x", "--kind", "plant", "--output", "x.json"], "x.json: must end in .toml"),
        (["x"], "missing option '--kind'"),
        (["x", "--kind", "scara"], "'scara' is not one of 'paddle', 'serial-2r', 'five-bar', "),
        (["", "--kind", "plant"], "is empty; give a name"),
        (["two\nlines", "--kind", "plant"], r"name must be a line of text, got 'two\nlines'"),
        (["--kind", "plant"], "missing argument 'NAME'"),
    ],
)
def test_what_is_refused_leaves_everything_as_it_was(new_folder, words, said):
    (new_folder / "there.toml").write_text("somebody's work")
    (line,) = refusal_lines("new", *words)
    assert said in line
    assert [path.name for path in new_folder.iterdir()] == ["there.toml"]
    assert (new_folder / "there.toml").read_text() == "somebody's work"


# --- the handle's sound: what is read back from the file is the vibration, at the pitch that ---------


def test_silence_is_refused():
    with pytest.raises(NoAnswerError, match="nothing vibrates"):
        sound_of(replace_start(mass_on_spring_response(440.0, 0.5)))
    with pytest.raises(
        NoAnswerError, match=r"at most 0\.278 m/s, is below the resolution .* full scale of 1e\+06 m/s"
    ):
        sound_of(mass_on_spring_response(440.0, 0.5), full_scale=1e6)
    with pytest.raises(ValueError, match="no trail"):
        sound_of(replace(mass_on_spring_response(440.0, 0.1), trail=np.zeros(0)))


def replace_start(response):
    """The same, standing still away from zero."""
    still = np.full(len(response.trail), 0.01)
    return replace(response, trail=still, handle=np.full(len(response.handle), 0.01))


def test_the_text_says_how_loud_what_was_clipped_and_a_better_pitch(tmp_path):
    (tmp_path / "own.toml").write_text(PLAIN)
    command = ("simulate", tmp_path / "own.toml", *SOUND_SLOW, "--output", tmp_path / "a.wav")
    out = run_command(*command).out
    assert re.search(r"; full scale is 0\.1\d+ m/s, the peak 1\.0 dB below it\n", out)
    assert re.search(r"\n9\d\.\d\d % of its energy is below 200 Hz.*\n?.*try --sound-pitch 16", out)
    out = run_command(*command, "--sound-full-scale", 0.01, "--sound-pitch", "auto").out
    assert re.search(
        r"full scale is 0\.01000 m/s, the peak 19\.\d dB above it, 89\.\d+ % of the samples clipped", out
    )
    assert "--sound-pitch" not in out


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--sound-pitch", "2"), "--sound-pitch belongs to a sound; add --output FILE.wav"),
        (("--sound-full-scale", "1", "--output", "a.svg"), "--sound-full-scale belongs to a sound"),
        (
            ("--sound-pitch", "octave", "--output", "a.wav"),
            "at least 0.1 and at most 1000, got 'octave'; or give auto",
        ),
        (("--sound-pitch", "nan", "--output", "a.wav"), "at least 0.1 and at most 1000"),
        (("--sound-full-scale", "0", "--output", "a.wav"), "must be a finite number"),
    ],
)
def test_options_that_cannot_be_are_refused(tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    ran = run_command("simulate", "published-two-mass", "--stiffness", 1000, "--damping", 2, *words)
    assert ran.code == 2
    assert text in re.sub(r"\s+", " ", ran.err)
    assert list(tmp_path.iterdir()) == []


# --- what the terminal says beside its numbers -------------------------------------------------------


@pytest.mark.parametrize(("delay", "said"), [(1, "1 sample of delay"), (2, "2 samples of delay")])
def test_samples_are_counted(delay, said):
    assert f" {said}," in run_command("chart", ONE_MASS, "--set", f"loop.delay_samples={delay}").out
