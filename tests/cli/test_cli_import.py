"""`zwidth import`: what it writes, what it tells, and what it refuses in one line."""

from __future__ import annotations

import tomllib

import pytest

from tests.cli.command_runner import document_of, refusal_lines

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


def test_a_file_is_overwritten_with_force_alone(folder):
    (folder / "arm.xml").write_text(ARM)
    (folder / "arm.toml").write_text("somebody's work")
    (line,) = refusal_lines("import", "arm.xml")
    assert "exists already" in line
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
    assert any(": ja, jb" in one for one in findings(document, "warning"))


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
