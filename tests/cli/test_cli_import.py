"""`zwidth import`: what it writes, what it tells, and what it refuses in one line."""

from __future__ import annotations

import builtins
import tomllib

import pytest

from tests.cli.command_runner import document_of, refusal_lines, run_command

ARM = """<mujoco model="my arm">
  <worldbody>
    <body name="up" pos="0 0 1">
      <joint name="shoulder" axis="0 0 1" armature="1e-3" damping="0.1" range="-90 90"/>
      <inertial mass="1" pos="0.1 0 0" diaginertia="1e-3 2e-3 2e-3"/>
      <geom name="shell" type="mesh" mesh="gone"/>
      <body name="fore" pos="0.3 0 0">
        <joint name="elbow" axis="0 0 1" armature="4e-4" damping="0.1" pos="0.01 0 0" ref="30"/>
        <inertial mass="0.5" pos="0.1 0 0" fullinertia="1e-3 2e-3 2e-3 1e-4 0 0"/>
        <site name="tool" pos="0.2 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="shoulder" gear="10" ctrlrange="-2 2"/>
    <position name="m2" joint="elbow" gear="-20" kp="3"/>
  </actuator>
  <keyframe><key name="home" qpos="0.3 0.7"/></keyframe>
</mujoco>"""
ARM = ARM.replace("<worldbody>", '<asset><mesh name="gone" file="gone.stl"/></asset>\n  <worldbody>', 1)

LINK = (
    '<link name="{}"><inertial><mass value="{}"/>'
    '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
FIXED = (
    '<link name="tip"/><joint name="jt" type="fixed"><parent link="b"/><child link="tip"/>'
    '<origin xyz="0.15 0 0"/></joint>'
)
JOINT = (
    '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="{}"/><axis xyz="0 0 1"/>'
    '<limit lower="{}" upper="{}" effort="2" velocity="1"/></joint>'
)
FIVE_BAR = "".join(
    [
        '<robot name="five bars"><link name="ground"/>',
        *(LINK.format(name, 0.1) for name in ("a", "b", "c", "d")),
        JOINT.format("ja", "revolute", "ground", "a", "0.05 0 0", -3, 3),
        JOINT.format("jb", "revolute", "a", "b", "0.1 0 0", -3, 3),
        JOINT.format("jc", "revolute", "ground", "c", "-0.05 0 0", -3, 3),
        JOINT.format("jd", "revolute", "c", "d", "0.1 0 0", -3, 3),
        FIXED,
        "</robot>",
    ]
)
LOOPS = """
drives = ["ja", "jc"]
[[loops]]
name = "tip"
links = ["b", "d"]
points_m = [[0.15, 0.0, 0.0], [0.15, 0.0, 0.0]]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def findings(document, severity=None):
    return [
        f"{one['where']}: {one['what']}"
        for one in document["findings"]
        if severity is None or one["severity"] == severity
    ]


def test_an_arm_becomes_a_device_that_answers(folder):
    (folder / "arm.xml").write_text(ARM)
    document = document_of("import", "arm.xml", "--keyframe", "home")
    assert set(document) == {"missing", "findings", "file"}
    assert document["file"] == str(folder / "arm.toml")
    written = tomllib.loads((folder / "arm.toml").read_text())
    first, second = written["mechanism"]["drives"]
    assert first == {
        "name": "m1",
        "joint": "up",
        "motor_inertia_kg_m2": 1e-3 / 100,
        "transmission_ratio": 10.0,
        "torque_limit_Nm": 2.0,
    }
    assert (second["transmission_ratio"], second["motor_inertia_kg_m2"]) == (20.0, 4e-4 / 400)
    assert written["mechanism"]["handle"] == {"link": "fore", "point_m": [0.19, 0.0, 0.0], "controls": "position"}
    shown = document_of("show", "arm.toml")
    assert shown["rigid_mass_kg"] > 0.0
    assert {one["path"] for one in shown["missing"]} == set(document["missing"])
    charted = document_of("chart", "arm.toml", "--set", "loop.sampling_period_s=0.001")
    assert charted["stiffness_max_N_per_m"] > 0.0
    told = "\n".join(findings(document))
    for words in ("gear -20", "control law of its own", "has ref = 0.523599", "'tool'", "stiffness_Nm_per_rad"):
        assert words in told


def test_people_read_a_table_and_what_to_type_next(folder):
    (folder / "arm.xml").write_text(ARM)
    ran = run_command("import", "arm.xml", "--keyframe", "home", "--output", "mine.toml")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith("my arm: 2 links, 0 loops, 2 drives")
    assert "zwidth show" in ran.out
    assert "--handle NAME" in ran.out
    assert run_command("show", "mine.toml").code == 0


def test_a_file_is_overwritten_with_force_alone(folder):
    (folder / "arm.xml").write_text(ARM)
    (folder / "arm.toml").write_text("somebody's work")
    (line,) = refusal_lines("import", "arm.xml")
    assert "exists already; overwrite it with --force" in line
    assert (folder / "arm.toml").read_text() == "somebody's work"
    assert document_of("import", "arm.xml", "--keyframe", "home", "--force")["file"]


def test_a_loop_file_beside_a_urdf_closes_it_and_names_the_drives(folder):
    (folder / "five.urdf").write_text(FIVE_BAR)
    (folder / "five.loops.toml").write_text(LOOPS)
    document = document_of("import", "five.urdf", "--handle", "tip", "--posture", "ja=0.6,jb=1.5,jc=2.5,jd=-1.5")
    mechanism = tomllib.loads((folder / "five.toml").read_text())["mechanism"]
    assert [drive["name"] for drive in mechanism["drives"]] == ["ja", "jc"]
    assert mechanism["loops"][0]["links"] == ["b", "d"]
    shown = document_of("show", "five.toml")
    assert shown["rigid_mass_kg"] is None  # a URDF knows no rotors
    assert shown["isotropy"] > 1.0
    assert "mechanism.drives.ja.motor_inertia_kg_m2" in document["missing"]
    rotors = [
        f"drives.{name}.{key}"
        for name in ("ja", "jc")
        for key in ("motor_inertia_kg_m2=1e-6", "transmission_ratio=10")
    ]
    settings = [word for setting in rotors for word in ("--set", setting)]
    assert document_of("show", "five.toml", *settings)["rigid_mass_kg"] > 0.0


def test_without_motors_the_joints_next_to_the_base_are_driven(folder):
    (folder / "five.urdf").write_text(FIVE_BAR)
    (folder / "five.loops.toml").write_text(LOOPS.replace('drives = ["ja", "jc"]', ""))
    document = document_of("import", "five.urdf", "--handle", "tip", "--posture", "ja=0.6,jb=1.5,jc=2.5,jd=-1.5")
    assert any("taken to be driven: ja, jb" in one for one in findings(document, "warning"))


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
def test_what_looks_wrong_is_told_and_imported(folder, text, said):
    (folder / "robot.urdf").write_text(text)
    assert any(said in one for one in findings(document_of("import", "robot.urdf"), "warning"))


TOLD = """<mujoco>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <site name="far" pos="1 0 0"/>
    <body name="one">
      <joint name="j" axis="0 0 1" stiffness="2" springref="20" damping="0.1"/>
      <joint name="k" axis="0 1 0" armature="0.01"/>
      <inertial mass="0.1" pos="0.1 0 0" diaginertia="1e-3 1e-3 1e-3"/>
      <site name="tool" pos="0.1 0 0"/>
    </body>
    <body name="held" mocap="true" pos="0 0 1"/>
  </worldbody>
  <tendon>
    <spatial name="string" stiffness="3"><site site="far"/><site site="tool"/></spatial>
    <fixed name="idle"><joint joint="j" coef="1"/></fixed>
  </tendon>
  <equality>
    <weld name="grip" body1="one" body2="held"/>
    <connect name="off" body1="one" anchor="0.1 0 0" active="false"/>
    <tendon name="equal" tendon1="idle"/>
  </equality>
  <actuator>
    <motor name="m" joint="j" gear="2"/>
    <motor name="pull" tendon="string"/>
    <muscle name="biceps" tendon="idle" lengthrange="0.1 0.2"/>
  </actuator>
</mujoco>"""


def test_what_a_device_file_has_no_place_for_is_named(folder):
    (folder / "told.xml").write_text(TOLD)
    document = document_of("import", "told.xml", "--controls", "position")
    warned = "\n".join(findings(document, "warning"))
    for words in (
        "joint 'j': has a spring at rest at 0.349066",
        "tendon 'string': has stiffness, damping or friction",
        "equality 'grip': holds a body to one that the simulation moves (mocap)",
        "equality 'equal': is a constraint of the kind tendon",
        "actuator 'pull': acts on a tendon, not on the coordinate of a joint",
        "actuator 'biceps': is a muscle",
        "armature: of joints without a motor of their own is left out: k 0.01",
    ):
        assert words in warned
    noted = "\n".join(findings(document, "note"))
    for words in ("equality 'off': is not active", "free", "tool", "mocap"):
        assert words in noted


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
def test_what_is_refused_is_told_in_a_line(folder, name, text, words, said):
    (folder / name).write_text(text)
    (line,) = refusal_lines("import", name, *words)
    assert line.startswith(f"{name}: ")
    assert said in line
    assert [path.name for path in folder.iterdir()] == [name]


def test_a_file_that_is_not_there_or_too_large(folder):
    assert refusal_lines("import", "gone.xml") == ["gone.xml: no such file; give an MJCF or URDF file"]
    (folder / "large.xml").write_text(" " * 20_000_001)
    assert refusal_lines("import", "large.xml") == ["large.xml: is larger than 20 MB; give an MJCF or URDF file"]


def test_a_sentence_where_mujoco_is_not_installed(folder, monkeypatch):
    (folder / "arm.xml").write_text(ARM)
    real = builtins.__import__

    def without_mujoco(name, *arguments, **options):
        if name == "mujoco":
            raise ImportError(name)
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without_mujoco)
    (line,) = refusal_lines("import", "arm.xml")
    assert line == 'arm.xml: reading MJCF and URDF needs MuJoCo; install it with: pip install "zwidth[mjcf]"'
