"""Stiffness of a drive from torque over angle: known springs come back, and bad records are refused."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.identify.spring_bench import bench_record, bent_angles, random_bench, triangle
from zwidth.errors import DeviceError, NoAnswerError
from zwidth.identify.stiffness.spring_fit import fit_spring, resolution_of, strokes_of, turning_points

DRIVE = "mechanism.drives.motor-right"
STEP = 2.0 * np.pi / 8192
# The average of these is what the thesis gives for its first motor, and the larger its largest (Table 3.3).
UNEVEN = {"forward": 0.45, "backward": 0.35, "friction": 0.003, "amplitude": 0.045, "step": STEP}
EVEN = UNEVEN | {"backward": 0.45}
NOISE = {"angle_noise": 3e-4, "torque_noise": 2e-4}


@pytest.fixture(scope="module")
def device():
    return zwidth.load("five-bar")


def identified(device, records, **options):
    return device.identify("stiffness", records, **({"joint": "motor-right"} | options))


def reason_of(device, records, **options):
    found = identified(device, records, **options)
    assert found.estimates == ()
    assert any(not check.passed for check in found.checks)
    with pytest.raises(NoAnswerError, match=r"not identified: "):
        found["stiffness"]
    return found.reason


def holds(found, name, truth):
    one = found[name]
    return one.low <= truth <= one.high


# --- known springs ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_an_uneven_spring_comes_back_with_its_friction(device, seed):
    found = identified(device, bench_record(seed, **UNEVEN, **NOISE))
    assert holds(found, f"{DRIVE}.stiffness_Nm_per_rad", 0.45)
    assert holds(found, f"{DRIVE}.backward_stiffness_Nm_per_rad", 0.35)
    assert holds(found, "largest stiffness", 0.45)
    assert holds(found, "average stiffness", 0.40)
    assert holds(found, f"{DRIVE}.coulomb_Nm", 0.003)
    assert found["stiffness"].high - found["stiffness"].low < 0.01
    assert found.validation > 0.999
    loss = found["hysteresis loss per cycle"]
    assert loss.value == pytest.approx(2.0 * 0.003 * (0.042 / 0.45 + 0.042 / 0.35), rel=0.05)


def test_an_even_spring_has_one_stiffness(device):
    found = identified(device, bench_record(1, **EVEN, **NOISE))
    assert f"{DRIVE}.backward_stiffness_Nm_per_rad" not in found.settings
    assert holds(found, f"{DRIVE}.stiffness_Nm_per_rad", 0.45)


def test_rounding_alone_makes_no_preload(device):
    """Without noise, each stroke has the same errors of the encoder, which may look like a kink."""
    found = identified(device, bench_record(1, **(EVEN | {"step": 2.0 * np.pi / 4096})))
    assert f"{DRIVE}.preload_Nm" not in found.settings
    assert f"{DRIVE}.backward_stiffness_Nm_per_rad" not in found.settings
    assert holds(found, f"{DRIVE}.stiffness_Nm_per_rad", 0.45)


@pytest.mark.parametrize(
    ("change", "name", "truth"),
    [
        ({"hardening": 20.0}, f"{DRIVE}.hardening_Nm_per_rad3", 20.0),
        ({"hardening": -5.0}, f"{DRIVE}.hardening_Nm_per_rad3", -5.0),
        ({"play": 0.02}, "backlash", 0.02),
        ({"preload": 0.015, "backward": 0.35}, f"{DRIVE}.preload_Nm", 0.015),
    ],
)
def test_what_else_a_spring_does_is_seen_only_where_it_is_there(device, change, name, truth):
    with_it = identified(device, bench_record(2, **(EVEN | change), **NOISE))
    without = identified(device, bench_record(2, **(EVEN | {"backward": change.get("backward", 0.45)}), **NOISE))
    one = with_it[name]
    assert abs(one.value - truth) < max(one.high - one.low, 0.02 * abs(truth))
    with pytest.raises(NoAnswerError):
        without[name]


def test_the_largest_stiffness_of_a_stiffening_cable_is_at_its_end(device):
    found = identified(device, bench_record(3, **(EVEN | {"hardening": 20.0})))
    bend = np.roots([20.0, 0.0, 0.45, -0.042])
    end = float(bend[np.isreal(bend)][0].real)
    assert found["largest stiffness"].value == pytest.approx(0.45 + 3.0 * 20.0 * end**2, rel=0.02)


def test_weights_hung_by_hand_are_enough(device):
    torque = np.r_[np.linspace(0, 0.04, 6), np.linspace(0.04, -0.04, 11), np.linspace(-0.04, 0, 6)]
    angle = np.round(bent_angles(torque, 0.002, forward=0.4, backward=0.35), 4)
    found = identified(device, {"torque_Nm": torque, "angle_rad": angle})
    assert found["stiffness"].value == pytest.approx(0.40, rel=2e-3)
    assert found["backward stiffness"].value == pytest.approx(0.35, rel=2e-3)


def test_the_spring_of_a_simulated_motor_comes_back(device):
    """Inertia and the time that it takes are in this record, which zwidth's own simulation makes."""
    k, J, friction, T = 0.45, 12.1e-7, 0.002, 2e-4
    t = T * np.arange(60_000)
    torque = 0.04 * np.sin(2.0 * np.pi * t / 6.0)
    angle, speed = np.zeros_like(t), 0.0
    steps = 10
    for i in range(1, len(t)):
        x = angle[i - 1]
        for _ in range(steps):  # semi-implicit, friction as the impulse that stops at most
            speed += (torque[i] - k * x - 2e-4 * speed) / J * T / steps
            stop = friction / J * T / steps
            speed = 0.0 if abs(speed) <= stop else speed - np.sign(speed) * stop
            x += speed * T / steps
        angle[i] = x
    found = identified(device, {"torque_Nm": torque[::20], "angle_rad": STEP * np.round(angle[::20] / STEP)})
    assert found["stiffness"].value == pytest.approx(k, rel=5e-3)
    assert found["dry friction"].value == pytest.approx(friction, rel=0.05)


def test_a_stiffness_at_the_link_is_turned_to_the_motors_shaft(device):
    ratio = 18.6
    record = bench_record(4, **EVEN)
    at_link = {"torque_Nm": record["torque_Nm"] * ratio, "angle_rad": record["angle_rad"] / ratio}
    found = identified(device, at_link, side="link")
    assert found["stiffness"].value == pytest.approx(identified(device, record)["stiffness"].value, rel=1e-3)
    assert f"{DRIVE}.coulomb_Nm" not in found.settings  # the friction of the blocked motor is not in it


def test_a_column_tells_the_joints_apart(device):
    right, left = bench_record(5, **UNEVEN), bench_record(6, **(UNEVEN | {"forward": 0.75, "backward": 0.55}))
    both = {name: np.r_[right[name], left[name]] for name in right}
    for names in (["upper-right", "upper-left"], ["motor-right", "motor-left"], ["1", "2"]):
        found = identified(device, both | {"joint": np.repeat(names, 6000)}, joint=None)
        assert found[f"{DRIVE}.stiffness_Nm_per_rad"].value == pytest.approx(0.45, rel=1e-3)
        assert found["mechanism.drives.motor-left.stiffness_Nm_per_rad"].value == pytest.approx(0.75, rel=1e-3)
    assert set(found.table()["drive"]) == {"motor-right", "motor-left"}


def test_runs_with_unlike_zeros_are_one_spring(device):
    record = bench_record(7, **UNEVEN)
    shifted = record | {"angle_rad": record["angle_rad"] + 0.3}
    assert identified(device, [record, shifted])["backward stiffness"].value == pytest.approx(0.35, rel=1e-3)


def test_the_numbers_make_a_device(device):
    found = identified(device, bench_record(8, **UNEVEN))
    changed = device.with_(found.settings)
    drive = changed.document["mechanism"]["drives"][0]
    assert drive["backward_stiffness_Nm_per_rad"] == found["backward stiffness"].value


# --- records that are not like simulations -----------------------------------------------------------


def test_a_drift_is_told_and_does_no_harm(device):
    record = bench_record(9, **UNEVEN, **NOISE)
    record["angle_rad"] = record["angle_rad"] + np.linspace(0.0, 0.02, 6000)
    found = identified(device, record)
    assert holds(found, "stiffness", 0.45)
    assert any("angle drifts" in remark for remark in found.remarks)


def test_spikes_and_missing_cells_are_left_out_and_counted(device):
    record = bench_record(10, **UNEVEN)
    record["angle_rad"][[100, 900, 3000]] += 0.1
    record["torque_Nm"][50:60] = np.nan
    found = identified(device, record)
    readings = next(check for check in found.checks if check.what == "readings")
    assert "10 rows" in readings.reason
    assert "3 spikes" in readings.reason
    assert holds(found, "stiffness", 0.45)


def test_one_direction_is_said_to_tell_one_stiffness(device):
    torque = 0.03 * (1.0 - np.cos(np.linspace(0.0, 8.0 * np.pi, 4000)))
    angle = STEP * np.round(bent_angles(torque, 0.002, forward=0.45, backward=0.2) / STEP)
    found = identified(device, {"torque_Nm": torque, "angle_rad": angle})
    directions = next(check for check in found.checks if check.what == "directions")
    assert directions.warning
    assert not directions.passed
    assert found["stiffness"].value == pytest.approx(0.45, rel=0.01)
    assert "backward stiffness" not in [one.name for one in found.estimates]


def test_a_noisy_torque_is_not_taken_for_the_end_of_a_sensor(device):
    record = bench_record(5, forward=0.45, torque_noise=0.01)
    assert holds(identified(device, record), "stiffness", 0.45)


# --- real transmissions ------------------------------------------------------------------------------


def test_friction_that_grows_with_the_torque_is_told_from_dry_friction(device):
    """A rope on a pulley: the elastic torque lags within a share of itself, too."""
    torque = triangle(6000, 6, 0.06)
    elastic, held = np.empty_like(torque), 0.0
    for row, now in enumerate(torque):
        held = min(
            max(held, (now - 0.002) / (1.0 + 0.08 * np.sign(now))), (now + 0.002) / (1.0 - 0.08 * np.sign(now))
        )
        elastic[row] = held
    angle = STEP * np.round(elastic / 0.45 / STEP)
    found = identified(device, {"torque_Nm": torque, "angle_rad": angle})
    assert holds(found, "stiffness", 0.45)
    assert found["friction per torque"].value == pytest.approx(0.08, rel=0.05)
    assert found[f"{DRIVE}.coulomb_Nm"].value == pytest.approx(0.002, rel=0.1)
    assert any("grows with" in remark for remark in found.remarks)


def test_friction_that_comes_back_slowly_behind_a_turn_is_no_preload(device):
    """Ten elements that stick in turn make a loop with round corners."""
    torque = triangle(6000, 6, 0.06)
    parts = [bent_angles(torque, level, forward=0.45) for level in np.linspace(0.0, 0.008, 10)]
    found = identified(device, {"torque_Nm": torque, "angle_rad": np.mean(parts, axis=0)})
    names = [one.name for one in found.estimates]
    assert not {"preload", "backward stiffness", "hardening", "backlash"} & {*names}
    assert found["stiffness"].value == pytest.approx(0.45, rel=3e-3)
    assert found["way over which friction turns"].value == pytest.approx(0.004, rel=0.5)


@pytest.mark.parametrize("offset", [0.004, 0.02])
def test_a_torque_sensor_whose_zero_is_off_moves_the_place_where_the_stiffness_changes(device, offset):
    record = bench_record(6, forward=0.45, backward=0.35, offset=offset, angle_noise=4e-4)
    found = identified(device, record)
    assert holds(found, "stiffness", 0.45)
    assert holds(found, "backward stiffness", 0.35)
    assert not {"preload", "backlash", "hardening"} & {one.name for one in found.estimates}
    (text,) = [remark for remark in found.remarks if "zero" in remark]
    assert float(text.split("reads ")[1].split()[0]) == pytest.approx(offset, rel=0.1)


# --- records that are refused ------------------------------------------------------------------------


RECORD = bench_record(11, **UNEVEN)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda T, a: (T[:5], a[:5]), ["5 readings", "at least 8"]),
        (lambda T, a: (T, 0.0 * a), ["angle_rad of record 0 is 0 throughout"]),
        (lambda T, a: (a, T), ["swapped"]),
        (lambda T, a: (-T, a), ["falls as the angle grows", "reverse the sign"]),
        (lambda T, a: (T, np.degrees(a)), ["degrees", "pi/180"]),
        (lambda T, a: (1000.0 * T, a), ["times the file's 0.45", "mN m in place of N m"]),
        (lambda T, a: (T, 1000.0 * a / 57.0), ["half a turn"]),
        (lambda T, a: (T, np.clip(a, -1.0, 0.06)), ["angle_rad", "stands still at its largest value, 0.06"]),
        (lambda T, a: (np.clip(T, -1.0, 0.03), a), ["torque_Nm", "stands still at its largest value, 0.03"]),
        (lambda T, a: (np.clip(T, -0.025, 1.0), a), ["torque_Nm", "stands still at its smallest value, -0.025"]),
        (lambda T, a: (T[:250], a[:250]), ["1 stroke", "load and unload"]),
        (lambda T, a: (T, 0.03 * np.round(a / 0.03)), ["7 counts", "at least 10"]),
        (lambda T, a: (T, a + 0.03 * np.random.default_rng(0).normal(size=len(a))), ["noise is 0.0"]),
    ],
)  # fmt: skip
def test_a_record_that_tells_no_stiffness_is_refused_with_the_reason(device, change, words):
    torque, angle = change(RECORD["torque_Nm"], RECORD["angle_rad"])
    reason = reason_of(device, {"torque_Nm": torque, "angle_rad": angle})
    assert all(word in reason for word in words), reason


def test_a_sign_that_flips_between_runs_is_told_with_the_run(device):
    flipped = RECORD | {"torque_Nm": -RECORD["torque_Nm"]}
    assert "in record 1 " in reason_of(device, [RECORD, flipped, RECORD])


def test_a_stiffness_unlike_the_files_is_right_once_the_file_has_none(device):
    bare = device.with_({"drives.motor-right.stiffness_Nm_per_rad": "unset"})
    torque = {"torque_Nm": 1000.0 * RECORD["torque_Nm"], "angle_rad": RECORD["angle_rad"]}
    assert bare.identify("stiffness", torque, joint="motor-right")["stiffness"].value == pytest.approx(
        450.0, rel=1e-3
    )


def test_what_a_device_cannot_have_is_refused(device):
    plant = zwidth.load("published-two-mass")
    with pytest.raises(DeviceError, match="a mechanism's drives"):
        plant.identify("stiffness", RECORD)
    with pytest.raises(DeviceError, match=r"'stiffness'\?"):
        device.identify("stifness", RECORD)
    with pytest.raises(DeviceError, match="every posture"):
        device.identify("stiffness", RECORD, point=device.at())


# --- the parts ---------------------------------------------------------------------------------------


def test_turning_points_are_extremes_that_are_come_back_from():
    wave = np.array([0.0, 1.0, 0.8, 2.0, -1.0, -0.9, -1.1, 3.0])
    assert turning_points(wave, 0.5) == [0, 3, 6, 7]
    assert turning_points(wave, 0.1) == [0, 1, 2, 3, 6, 7]
    assert turning_points(np.zeros(5), 0.1) == [0]


def test_strokes_leave_out_what_friction_holds():
    torque = np.r_[np.linspace(0, 1, 200), np.linspace(1, -1, 400), np.linspace(-1, 1, 400)]
    angle = bent_angles(torque, 0.2, forward=1.0)
    strokes = strokes_of(torque, angle, resolution_of(angle))
    np.testing.assert_allclose(strokes.torque - strokes.angle, 0.2 * strokes.sign, atol=1e-8)
    assert strokes.count == 3


# --- intervals ---------------------------------------------------------------------------------------


def coverage(seeds):
    """Shares of random springs whose interval holds the truth, by parameter."""
    hits = []
    for seed in seeds:
        truth, bench = random_bench(seed)
        record = bench_record(seed, **truth, **bench)
        resolution = resolution_of(record["angle_rad"])
        strokes = strokes_of(record["torque_Nm"], record["angle_rad"], resolution)
        if np.ptp(record["angle_rad"]) < 10.0 * bench["step"] or strokes.count < 2:
            continue  # refused by the checks
        fit = fit_spring(strokes, resolution, True)
        hits.append(
            [abs(fit[n] - truth[n]) <= fit.half_width({n: 1.0}) for n in ("forward", "backward", "friction")]
        )
    return np.mean(hits, axis=0), len(hits)


def test_intervals_hold_the_truth_in_a_few_random_benches():
    shares, count = coverage(range(5000, 5016))
    assert count >= 14
    assert np.all(shares >= 0.75)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    shares, count = coverage(range(1000))
    assert count > 950
    assert np.all((shares > 0.93) & (shares < 0.97)), shares


def test_a_drive_of_a_leg_is_the_same_under_the_names_of_its_copies():
    from zwidth.identify.stiffness.identify import drive_named, drives_of

    delta = zwidth.load("stamper-delta")
    (drive,) = drives_of(delta)
    assert drive.path.startswith("mechanism.legs.")
    names = [drive.name, drive.joint, f"{drive.name}-2", f"{drive.joint}-3", "1"]
    assert {drive_named(delta, name).path for name in names} == {drive.path}
    with pytest.raises(DeviceError, match="no drive"):
        drive_named(delta, f"{drive.name}-9")
