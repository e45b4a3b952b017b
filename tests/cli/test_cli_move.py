"""`zwidth move`: a whole mechanism in motion, held to the Python call, to `simulate`, and to what was typed."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import (
    MECHANISM,
    document_of,
    parse_strict_json,
    refusal_lines,
    run_command,
)
from zwidth.contact import Box, Plane, Sphere, SurfaceWall
from zwidth.show.cli.move import MoveCommand

WALL = ("--stiffness", 1500, "--damping", 3)
BALL = ("--sphere", "0,0.31,0.05", *WALL, "--push", "0.02,1", "--duration", 0.3)
ENERGY_KEYS = ("kinetic_J", "elastic_J", "gravitational_J", "hand_work_J", "motor_work_J", "friction_loss_J")
DRIVES = ("motor-right", "motor-left")
DRIVE = "mechanism.drives."
WEAK = [
    word
    for key in ("torque_limit_Nm", "continuous_torque_Nm")
    for word in ("--set", f"{DRIVE}motor-right.{key}=0.01")
]


def move_document(*words):
    return document_of("move", MECHANISM, *words)


def for_both_drives(key, value):
    """The same number set for both drives."""
    return [word for drive in DRIVES for word in ("--set", f"{DRIVE}{drive}.{key}={value}")]


@pytest.fixture(scope="module")
def ball():
    return move_document(*BALL)


def move_from_python(surface, **settings):
    return package.load(MECHANISM).at().move(SurfaceWall(1500.0, 3.0), surface, **settings)


def test_the_numbers_are_those_of_the_python_call(ball):
    motion = move_from_python(Sphere((0.0, 0.31), 0.05), push=(0.02, 1.0, 0.0), duration=0.3)
    assert set(MoveCommand.keys) <= set(ball)
    for key, values in (
        ("time_s", motion.time),
        ("position_m", motion.position),
        ("counted_position_m", motion.counted_position),
        ("depth_m", motion.depth),
        ("force_N", motion.force),
        ("kinetic_J", motion.kinetic),
        ("elastic_J", motion.elastic),
        ("hand_work_J", motion.hand_work),
        ("motor_work_J", motion.motor_work),
    ):
        assert np.array_equal(ball[key], values), key
    for n, drive in enumerate(DRIVES):
        assert ball["torque_Nm"][drive] == motion.torque[:, n].tolist()
        assert ball["motor_rad"][drive] == motion.motors[:, n].tolist()
    assert ball["joint_rad"]["upper-left"] == motion.joints[:, 1].tolist()
    assert (ball["status"], ball["ended_because"], ball["started_inside"]) == ("done", None, False)
    assert ball["largest_penetration_m"] == motion.depth.max() == pytest.approx(4.38e-3, rel=0.01)
    assert ball["largest_force_N"] == pytest.approx(np.linalg.norm(motion.force, axis=1).max(), rel=1e-12)
    assert ball["contact_share"] == pytest.approx(np.mean(motion.depth > 0.0))
    assert ball["torque_limit_share"] == dict.fromkeys(DRIVES, 0.0)


def test_the_energy_book_closes_and_dampers_only_take(ball):
    book = ball["energy_book_J"]
    total = sum(energy for name, energy in book.items() if name != "stored")
    assert total == pytest.approx(book["stored"], abs=1e-15)
    assert book["hand"] == pytest.approx(np.dot((0.02, 1.0, 0.0), np.diff(ball["position_m"], axis=0).sum(axis=0)))
    assert book["dampers"] < 0.0
    assert book["gravity"] == book["friction"] == 0.0
    undamped = move_document(*BALL, "--gravity", "1,-2", "--set", "mechanism.damping.mode_ratio=0")[
        "energy_book_J"
    ]
    assert abs(undamped["gravity"]) > 0.01 * undamped["hand"]
    assert abs(undamped["dampers"]) < 1e-6 * undamped["hand"]


def test_a_small_motion_at_a_two_sided_plane_is_that_of_simulate():
    speed, wall = 1e-5, ("--stiffness", 2000, "--damping", 3, "--duration", 0.2)
    linear = document_of("simulate", MECHANISM, *wall, "--direction", "0,1", "--start-position", 0,
                   "--start-velocity", speed)  # fmt: skip
    plane = ("--plane", "0,0.25,0,-1", "--two-sided")
    ours = move_document(*plane, *wall, "--start-velocity", speed, "--direction", "0,1", "--substeps", 8)
    assert ours["time_s"] == pytest.approx(linear["time_s"])
    handle = np.array(linear["handle_m"])
    size = np.abs(handle).max()
    assert size > 1e-8
    assert np.array(ours["depth_m"]) == pytest.approx(handle, abs=1e-4 * size)
    assert np.array(ours["force_N"])[:, 1] == pytest.approx(linear["force_N"], abs=1e-4 * 2000 * size)


def last(document):
    return np.array(document["position_m"][-1])


OPTIONS = [
    (("--at", "0.02,0.24"), lambda d: d["position_m"][0], lambda _, new: new == pytest.approx([0.02, 0.24, 0.0])),
    (("--push", "0.02,2"), lambda d: d["largest_force_N"], lambda old, new: new > 1.2 * old),
    (("--start-velocity", "0,0.2"), lambda d: d["kinetic_J"][0], lambda old, new: new > old == 0.0),
    (("--gravity", "0,-9.81"), lambda d: d["energy_book_J"]["gravity"], lambda old, new: new != 0.0 == old),
    (("--stiffness", 3000), lambda d: d["largest_penetration_m"], lambda old, new: new < old),
    (("--damping", 6), lambda d: d["largest_penetration_m"], lambda old, new: new < old),
    (("--duration", 0.1), lambda d: d["time_s"][-1], lambda _, new: new == pytest.approx(0.1)),
    (("--sphere", "0,0.30,0.03"), lambda d: d["depth_m"][0], lambda _, new: new == pytest.approx(-0.02)),
    (("--sphere", "0,0.25,0.01", "--hollow"), lambda d: d["position_m"][-1][0], lambda old, new: new < 0.5 * old),
    (("--set", "loop.sampling_period_s=0.001"), lambda d: d["time_s"][1], lambda _, new: new == 0.001),
]  # fmt: skip


@pytest.mark.parametrize(("words", "number", "holds"), OPTIONS, ids=[" ".join(map(str, w)) for w, *_ in OPTIONS])
def test_an_option_changes_what_it_says(ball, words, number, holds):
    plain, new = number(ball), number(move_document(*BALL, *words))
    assert holds(plain, new), (plain, new)


def test_substeps_change_little_and_an_assembly_much(ball):
    finer = move_document(*BALL, "--substeps", 16)
    assert 0.0 < np.linalg.norm(last(finer) - last(ball)) < 1e-6
    other = move_document(*BALL, "--assembly", "elbows-in")
    assert abs(other["joint_rad"]["upper-right"][0] - ball["joint_rad"]["upper-right"][0]) > 1.0


def test_a_push_of_one_number_is_along_the_direction(ball):
    free = ("--duration", 0.02)
    assert move_document(*free, "--push", 2)["push_N"] == [0.0, 2.0, 0.0]
    assert move_document(*free, "--push", 2, "--direction", "3,4")["push_N"] == pytest.approx([1.2, 1.6, 0.0])
    fast = move_document(*free, "--start-velocity", -0.1, "--direction", "1,0")
    assert fast["start_velocity_m_per_s"] == [-0.1, 0.0, 0.0]


def test_a_wall_pulls_unless_told_not_to():
    inside = ("--plane", "0,0.24,0,-1", "--stiffness", 300, "--damping", 20, "--duration", 0.1)
    pulled, let_go = (
        np.array(move_document(*inside, *words)["force_N"])[:, 1].max() for words in ((), ("--no-pull",))
    )
    assert pulled > 0.0 == let_go


def test_planes_boxes_and_hollow_boxes_are_those_of_python():
    for words, surface in (
        (("--plane", "0,0.26,0.1,-1"), Plane((0.0, 0.26), (0.1, -1.0))),
        (
            ("--plane", "0,0.26,0,0.1,-1,0", "--two-sided"),
            Plane((0.0, 0.26), (0.1, -1.0), two_sided=True),
        ),
        (("--box", "0,0.29,0.05,0.02"), Box((0.0, 0.29), (0.05, 0.02))),
        (("--box", "0,0.29,0,0.05,0.02,0.01"), Box((0.0, 0.29, 0.0), (0.05, 0.02, 0.01))),
        (("--box", "0,0.25,0.05,0.02", "--hollow"), Box((0.0, 0.25), (0.05, 0.02), hollow=True)),
    ):
        told = move_document(*words, *WALL, "--push", "0,1", "--duration", 0.15)
        motion = move_from_python(surface, push=(0.0, 1.0, 0.0), duration=0.15)
        assert told["depth_m"] == motion.depth.tolist()
        assert told["largest_penetration_m"] > 0.0
        assert told["surface"]["kind"] == type(surface).__name__.lower()


def test_counts_limits_and_friction_of_the_file_take_part(ball):
    counted = move_document(*BALL, *for_both_drives("encoder_counts_per_rev", 500))
    assert counted["counted_position_m"][5:40] != ball["counted_position_m"][5:40]
    exact = move_document(*BALL, *for_both_drives("encoder_counts_per_rev", 500), "--exact")
    assert exact["counted_position_m"] == ball["counted_position_m"]
    assert exact["encoders_counted"] is False
    noisy = [*BALL, *for_both_drives("encoder_counts_per_rev", 5000), *for_both_drives("encoder_noise_rad", 0.01)]
    first, again, other = (move_document(*noisy, "--seed", seed)["counted_position_m"] for seed in (1, 1, 2))
    assert first == again != other
    limited = [*BALL, *WEAK]
    one, all_alike = move_document(*limited), move_document(*limited, "--torque-limits", "together")
    assert one["torque_limit_share"]["motor-left"] == 0.0 < one["torque_limit_share"]["motor-right"] < 0.5
    assert max(map(abs, one["torque_Nm"]["motor-right"])) == pytest.approx(18.6 * 0.01)
    assert last(one) != pytest.approx(last(all_alike), abs=1e-5)
    rubbing = move_document(*BALL, *for_both_drives("coulomb_Nm", 0.001))
    assert rubbing["energy_book_J"]["friction"] < 0.0
    assert rubbing["friction_loss_J"][-1] == -rubbing["energy_book_J"]["friction"]


def test_the_work_of_lagging_motors_is_null():
    document = move_document(*BALL, "--set", "loop.actuator.time_constant_s=0.001")
    assert document["energy_book_J"]["motors"] is None
    assert set(document["motor_work_J"]) == {None}
    out = run_command("move", MECHANISM, *BALL, "--set", "loop.actuator.time_constant_s=0.001").out
    assert "by difference" in out


def test_a_motion_that_ends_at_a_singularity_is_an_answer(tmp_path):
    words = ("--push", "0.02,1", "--output", tmp_path / "path.png")
    document = move_document(*words)
    assert document["status"] == "singular"
    assert document["duration_s"] < 0.5 < document["duration_asked_s"] == 1.0
    assert "a singularity" in document["ended_because"]
    assert "reason" not in document
    assert document["largest_penetration_m"] is document["contact_share"] is document["started_inside"] is None
    assert set(document["depth_m"]) == {None}
    assert "ended early" in run_command("move", MECHANISM, *words).out


@pytest.mark.parametrize("kind", ["png", "svg", "pdf", "csv", "json"])
def test_a_file_holds_what_was_found(tmp_path, ball, kind):
    file = tmp_path / f"path.{kind}"
    assert move_document(*BALL, "--output", file) == ball | {"file": str(file)}
    if kind == "json":
        assert parse_strict_json(file.read_text()) == ball | {"file": str(file)}
    elif kind == "csv":
        with file.open(newline="") as stream:
            rows = list(csv.DictReader(stream))
        names = [f"{name}_m" for name in "xyz"] + [f"counted_{name}_m" for name in "xyz"]
        assert list(rows[0])[:8] == ["time_s", *names, "depth_m"]
        assert {"force_y_N", "torque_motor-left_Nm", "joint_upper-left_rad", *ENERGY_KEYS} <= set(rows[0])
        assert [[float(row[f"{name}_m"]) for name in "xyz"] for row in rows] == ball["position_m"]
        assert [float(row["torque_motor-left_Nm"]) for row in rows] == ball["torque_Nm"]["motor-left"]
    else:
        assert file.stat().st_size > 10_000


def test_a_start_out_of_reach_has_no_answer():
    ran = run_command("move", MECHANISM, *BALL, "--at", "1,1", "--json")
    assert ran.code == 1
    assert "cannot reach" in ran.document["reason"]
    assert ran.document["time_s"] is ran.document["status"] is None


def test_a_programmable_brake_is_refused():
    (line,) = refusal_lines(
        "move", MECHANISM, *BALL, "--set", f"{DRIVE}motor-left.brake_damping_max_Nms_per_rad=0.001"
    )
    assert "programmable brake" in line
