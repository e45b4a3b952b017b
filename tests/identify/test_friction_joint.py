"""Friction and mass of virtual joints: what they are, where they belong in the file, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import zwidth
from tests.identify.virtual_joint import Joint, records_of
from tests.paddle import PADDLE
from zwidth.identify import identify_friction, identify_mass, record_of
from zwidth.identify.joint.friction import COLUMNS

JOINT = Joint(
    mass=0.12,
    damping=0.8,
    coulomb=0.5,
    bias=0.12,
    stiffness=0.0,
    step=2e-5,
    noise=1e-6,
    period=1e-3,
    delay=1.4,
    samples=3000,
    tones=np.array([[2.0, 12.0, 0.3], [1.2, 31.0, 1.1], [0.8, 57.0, 2.0], [0.0, 1.0, 0.0]]),
)
TRUTH = {
    "friction.coulomb_N": 0.5,
    "plant.damping_Ns_per_m": 0.8,
    "plant.mass_kg": 0.12,
    "bias": 0.12,
    "level forward": 0.38,
    "level backward": 0.62,
    "viscous friction forward": 0.8,
    "viscous friction backward": 0.8,
    "delay of the force": 1.4e-3,
}


@pytest.fixture(scope="module")
def device():
    return zwidth.load("hapkit-course")


@pytest.fixture(scope="module")
def driven():
    return records_of([JOINT])[0]


@pytest.fixture(scope="module")
def coasting():
    """Six throws, forward and backward, of which each comes to rest."""
    still = replace(JOINT, tones=np.zeros((4, 3)), samples=500)
    throws = [replace(still, start=v, seed=n) for n, v in enumerate((0.4, -0.5, 0.6, -0.3, 0.5, -0.6, 0.3, -0.4))]
    return [{name: one[name] for name in ("time_s", "position_m")} for one in records_of(throws)]


def record(columns, label="bench.csv"):
    return record_of(columns, COLUMNS, label)


def failed(result):
    return [check.what for check in result.checks if not check.passed]


def test_driven_motion_tells_friction_mass_and_delay(device, driven):
    result = identify_friction(device, [record(driven)])
    assert failed(result) == []
    for name, value in TRUTH.items():
        one = result[name]
        assert one.low <= value <= one.high, name
        assert one.high - one.low < 0.1 * value + 0.01, name
    assert result.validation > 0.999
    assert result.details["force"] == "force_N"
    assert "spring" not in [one.name for one in result.estimates]
    assert set(result.settings) == {"friction.coulomb_N", "plant.damping_Ns_per_m", "plant.mass_kg"}
    changed = device.with_(result.settings)
    assert changed.given_plant.mass[0, 0] == pytest.approx(0.12, rel=0.01)
    assert len({len(column) for column in result.table().values()}) == 1


def test_the_device_identifies_from_columns(device, driven):
    result = device.identify("mass", driven)
    assert result.estimates[0].name == "effective mass"
    assert device.identify("friction", {**driven, "force_N": 0.0 * driven["force_N"]}).settings == {}


def test_mass_comes_first_where_it_is_asked_for(device, driven):
    result = identify_mass(device, [record(driven)])
    assert result.kind == "mass"
    assert result.estimates[0].path == "plant.mass_kg"
    assert result["plant.mass_kg"].low < 0.12 < result["plant.mass_kg"].high


def test_coasting_tells_friction_over_mass_and_friction_by_the_mass_of_the_file(device, coasting):
    records = [record(one, f"throw-{n}.csv") for n, one in enumerate(coasting)]
    result = identify_friction(device, records)
    assert result.settings == {}
    for name, value in (("dry friction over mass", 0.5 / 0.12), ("viscous friction over mass", 0.8 / 0.12)):
        assert result[name].low <= value <= result[name].high
        assert result[name].high < 1.3 * value
    right = device.with_({"plant.mass_kg": 0.12})
    result = identify_friction(right, records, mass_from_file=True)
    assert result["friction.coulomb_N"].low <= 0.5 <= result["friction.coulomb_N"].high
    assert "force" in failed(identify_mass(device, records))


def test_a_spring_is_told_where_the_data_show_one(device):
    held = replace(JOINT, stiffness=60.0, tones=JOINT.tones * 2.0)
    result = identify_friction(device, [record(records_of([held])[0])])
    spring = result["spring"]
    assert spring.path == "plant.stiffness_N_per_m"
    assert spring.low <= 60.0 <= spring.high
    assert spring.high - spring.low < 6.0


def test_one_direction_only_leaves_the_dry_friction_open(device, coasting):
    forward = [record(one) for one in coasting[0::2]]
    result = identify_friction(device, forward)
    assert "directions" in failed(result)
    names = [one.name for one in result.estimates]
    assert not any("backward" in name or "dry" in name for name in names)
    level = result["level forward over mass"]
    assert level.low <= 0.38 / 0.12 <= level.high


def test_a_heavily_damped_joint_hides_its_mass(device):
    """A mass that stops within a twentieth of a sample changes nothing that could be seen."""
    heavy = replace(JOINT, mass=2e-4, damping=4.0, coulomb=0.1, bias=0.0, steps=True)
    driven = record(records_of([heavy])[0])
    result = identify_mass(device, [driven])
    assert "acceleration" in failed(result)
    assert result.estimates == ()
    friction = identify_friction(device, [driven])
    assert friction["plant.mass_kg"].low <= 2e-4 <= friction["plant.mass_kg"].high
    assert friction["plant.damping_Ns_per_m"].low <= 4.0 <= friction["plant.damping_Ns_per_m"].high


def test_a_command_beside_a_measured_force_is_compared(device, driven):
    command = np.append(driven["force_N"][3:], np.zeros(3)) / 0.9
    result = identify_friction(device, [record({**driven, "force_command_N": command})])
    assert result.details["force"] == "force_N"
    assert result.details["command_gain"] == pytest.approx(0.9, rel=1e-3)
    assert result.details["command_lag_s"] == pytest.approx(3e-3, abs=2e-4)
    alone = {name: column for name, column in driven.items() if name != "force_N"} | {"force_command_N": command}
    assert any("a command" in remark for remark in identify_friction(device, [record(alone)]).remarks)


@pytest.fixture(scope="module")
def paddle(tmp_path_factory):
    path = tmp_path_factory.mktemp("paddle") / "paddle.toml"
    Path(path).write_text(PADDLE + "\n[loop]\nsampling_period_s = 0.001\n" * ("[loop]" not in PADDLE))
    return zwidth.load(path)


def turned(driven, size=1.0):
    """The record as that of a motor: small torques turn small inertias by the same angles."""
    return {
        "time_s": driven["time_s"],
        "angle_rad": driven["position_m"] * 78.5398163,
        "torque_Nm": driven["force_N"] * size,
    }


def test_at_a_motor_the_friction_is_the_drives_and_the_damping_the_joints(paddle, driven):
    columns = turned(driven, 1e-3)
    result = identify_friction(paddle, [record(columns)])
    inertia, friction = 0.12e-3 / 78.5398163, 0.5e-3
    damping = 0.8e-3 / 78.5398163
    assert result["effective inertia"].value == pytest.approx(inertia, rel=0.02)
    assert result["mechanism.drives.capstan.coulomb_Nm"].value == pytest.approx(friction, rel=0.05)
    path = "mechanism.links.lever.joint_damping_Nms_per_rad"
    assert result[path].value == pytest.approx(81.0 * damping, rel=0.1)
    assert any("motor 'capstan'" in remark for remark in result.remarks)
    current = {
        **{name: columns[name] for name in ("time_s", "angle_rad")},
        "current_A": columns["torque_Nm"] / 0.03,
    }
    same = identify_friction(paddle, [record(current)])
    assert same["effective inertia"].value == pytest.approx(result["effective inertia"].value, rel=1e-6)


def test_at_a_link_all_numbers_are_the_joints(paddle, driven):
    columns = turned(driven, 1e-3)
    joint = {**columns, "angle_rad": columns["angle_rad"] / 9.0, "torque_Nm": columns["torque_Nm"] * 9.0}
    motor = identify_friction(paddle, [record(columns)])
    result = identify_friction(paddle, [record(joint)], joint="lever")
    path = "mechanism.links.lever.joint_damping_Nms_per_rad"
    assert result[path].value == pytest.approx(motor[path].value, rel=1e-4)
    level = motor["mechanism.drives.capstan.coulomb_Nm"].value
    assert result["mechanism.links.lever.joint_coulomb_Nm"].value == pytest.approx(9.0 * level, rel=1e-4)
    assert result["effective inertia"].value == pytest.approx(81.0 * motor["effective inertia"].value, rel=1e-4)
