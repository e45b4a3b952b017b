"""What `identify arm` says where noise in the positions may have drawn its numbers, and what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.cli.command_runner import run_command
from tests.identify.arm_truth import one_chain
from tests.study_sizes import EVERYDAY_SEEDS, outside_case, study_size
from zwidth.device.load import load
from zwidth.errors import NoAnswerError
from zwidth.identify import Estimate, identify_arm, read_record
from zwidth.identify.arm import COLUMNS, ArmIdentification
from zwidth.identify.arm.checks import DriveChannels, MotionSurvey, sign_check, velocity_check
from zwidth.identify.arm.smoothing import Kernel

PENDULUM = """name = "pendulum"
[[mechanism.links]]
name = "rod"
joint = "revolute"
length_m = 0.4
[mechanism.handle]
link = "rod"
[mechanism.assemblies.hanging]
joints_rad = { rod = 0.3 }
[mechanism.reference]
position_m = [0.38213, 0.11821]
direction = [-0.3, 0.95]
[[mechanism.drives]]
name = "motor"
joint = "rod"
transmission_ratio = 5.0
[loop]
sampling_period_s = 0.002
"""


def found_arm():
    """The answer of a fit, with one number."""
    mass = Estimate("I_zz(rod)", 0.2, 0.19, 0.21, "kg m^2")
    return ArmIdentification(
        "arm", "bench", (), (mass,), 0.9, "torque", numbers={"mechanism.links.rod.mass_kg": 1.0}
    )


def test_the_answer_says_that_noise_in_the_positions_is_not_in_its_intervals():
    found = found_arm()
    document = found.document()
    assert document["left_out"]
    (premise,) = document["premises"]
    assert (premise["holds"], premise["how"]) == (None, "not checked")
    assert document["parameters"][0]["told"] == "yes"
    assert found.left_out[0] in repr(found)


def test_no_device_gets_the_numbers_of_an_arm():
    with pytest.raises(NoAnswerError):
        found_arm().settings  # noqa: B018


def test_write_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "pendulum.toml").write_text(PENDULUM)
    (tmp_path / "moved.csv").write_text("time_s,angle_rad.rod,torque_Nm.rod\n0,0,0\n0.002,0,0\n")
    ran = run_command(
        "identify", "arm", tmp_path / "moved.csv", "--device", tmp_path / "pendulum.toml", "--write", "--json"
    )
    assert (ran.code, ran.out) == (2, "")
    assert len(ran.err.splitlines()) == 1
    assert (tmp_path / "pendulum.toml").read_text() == PENDULUM


def surveyed(seed):
    """A joint in slow tones, of whose rows 5 to 25 % repeat, with its right velocity."""
    rng = np.random.default_rng(seed)
    time = 0.002 * np.arange(6000)
    tones = rng.uniform(0.3, 2.0, 3)
    phase = rng.uniform(0.0, 6.0, 3)
    q = np.sum(np.sin(2.0 * np.pi * tones * time[:, None] + phase), axis=1)
    v = np.sum(2.0 * np.pi * tones * np.cos(2.0 * np.pi * tones * time[:, None] + phase), axis=1)
    for i in np.flatnonzero(rng.random(6000) < rng.uniform(0.05, 0.25))[1:]:
        q[i] = q[i - 1]
    rows = {"time_s": time, "angle_rad.rod": q, "velocity_rad_per_s.rod": v}
    return MotionSurvey(rows, q[:, None], q[:, None])


def velocity_of(survey, factor=1.0):
    kernel = Kernel(12.0, 1.2 / 12.0)
    channels = DriveChannels(
        ("angle_rad.rod",), ("torque_Nm.rod",), ("velocity_rad_per_s.rod",), np.eye(1), np.eye(1)
    )
    rows = survey.rows | {"velocity_rad_per_s.rod": factor * survey.rows["velocity_rad_per_s.rod"]}
    survey = MotionSurvey(rows, survey.coordinates, survey.forces)
    return velocity_check(("motor",), channels, survey, kernel.taps(0.002, 1), kernel.taps(0.002))


def judged_velocity(seed):
    """Whether a right velocity beside rows that repeat passes, and one in degrees does not."""
    survey = surveyed(seed)
    return velocity_of(survey).passed and not velocity_of(survey, 180.0 / np.pi).passed


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_rows_that_repeat_make_no_velocity_one_of_another_unit(seed):
    assert judged_velocity(seed)


@pytest.mark.slow
def test_random_rows_that_repeat_make_no_velocity_one_of_another_unit():
    assert all(judged_velocity(seed) for seed in range(study_size(continuous=100, full=1000)))


def test_a_torque_that_runs_against_the_others_is_no_proof_of_its_sign():
    torque = np.sin(np.arange(100.0))[:, None]
    check = sign_check(("motor",), ("one.csv", "two.csv"), [torque, torque], [torque, -torque])
    assert not check.passed
    assert not check.warning
    assert "two.csv" in check.reason
    assert "?" in check.reason


def test_a_good_share_of_the_unseen_torque_is_a_remark():
    _, columns, device = one_chain(duration=4.0)
    found = device.identify("arm", columns)
    (check,) = [one for one in found.checks if one.what == "validation"]
    assert (check.passed, check.warning) == (False, True)
    assert json.dumps(found.document()["left_out"])


@pytest.mark.outside_cases
def test_no_sign_is_called_turned_beside_vibration():
    record = read_record(outside_case("identify/06_synthetic_vibration.csv"), COLUMNS)
    found = identify_arm(load(outside_case("identify/pendulum.toml")), [record], gravity=[9.81, 0.0])
    assert "signs" not in [check.what for check in found.checks if not check.passed]
