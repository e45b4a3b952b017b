"""Ratios that change with the joint, in device files: what is right, what is refused, what is set."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tests.device.device_cases import ARM_FILE, REMOVED, faults, with_changes
from zwidth.device import from_document, new_device
from zwidth.device.design_batch import design_batch
from zwidth.errors import BeyondLimit, DeviceError
from zwidth.model import OK
from zwidth.model.posture import BEYOND_LIMIT

RATIO, TABLE = "mechanism__drives__0__transmission_ratio", "mechanism__drives__0__ratio_table"
LIMITS = "mechanism__links__0__limits_rad"
ANGLES = [-1.0, 0.0, 0.5, 1.2]


def arm(table=None, **changes):
    """The file of two links with a table at the shoulder."""
    given = {"joint_rad": ANGLES, "ratio": [8.0, 10.0, 11.0, 15.0]} if table is None else table
    return with_changes(ARM_FILE, **{RATIO: REMOVED, TABLE: given}, **changes)


def test_a_table_of_a_leg_is_that_of_each_copy_and_at_fault_once():
    document = tomllib.loads(new_device("three legs", "delta"))
    (drive,) = document["mechanism"]["legs"][0]["drives"]
    ratio = drive.pop("transmission_ratio")
    drive["ratio_table"] = {"joint_rad": [-1.0, 1.5], "ratio": [ratio, ratio]}
    assert from_document(document).at().drives.transmission.tolist() == [ratio] * 3
    drive["ratio_table"]["joint_m"] = [0, 1]
    (fault,) = faults(document)
    assert fault.key.endswith("drives.motor.ratio_table.joint_m")


def test_a_posture_outside_of_the_table_says_so():
    device = from_document(arm())
    with pytest.raises(BeyondLimit) as caught:
        device.at((0.25, -0.25))
    assert "drive 'shoulder', -1 " in str(caught.value)
    many = device.at([(0.2, 0.2), (0.25, -0.25)])
    assert many.status.tolist() == [OK, BEYOND_LIMIT]
    assert np.isnan(many.drives.transmission[:, 0]).tolist() == [False, True]
    assert np.isnan(many.measure("stiffness_max").values).tolist() == [False, True]


def test_narrower_limits_stay():
    device = from_document(arm(**{LIMITS: [-0.5, 1.0]}))
    assert device.mechanism.links.lower.tolist() == [-0.5, -np.inf]
    with pytest.raises(BeyondLimit, match=r"limits, -0\.5 to 1 rad"):
        device.at((0.25, -0.2))


def test_numbers_of_a_table_are_set_by_their_paths():
    device = from_document(arm())
    changed = device.with_({"drives.shoulder.ratio_table.ratio.1": 12.0})
    assert changed.at().drives.transmission[0] == pytest.approx(12.0, abs=1e-12)  # the shoulder is at 0
    assert device.at().drives.transmission[0] == pytest.approx(10.0, abs=1e-12)
    whole = device.with_(["drives.shoulder.ratio_table.ratio=[2, 2, 2, 2]"])
    assert whole.at().drives.transmission[0] == 2.0
    with pytest.raises(DeviceError, match=r"ratio_table\.ratio\.7: is not"):
        device.with_({"drives.shoulder.ratio_table.ratio.7": 1.0})


def test_setting_one_of_the_two_keys_drops_the_other():
    device = from_document(arm())
    constant = device.with_({"drives.shoulder.transmission_ratio": 7.0})
    assert "ratio_table" not in constant.document["mechanism"]["drives"][0]
    again = constant.with_(["drives.shoulder.ratio_table={joint_rad = [-1, 1], ratio = [3, 5]}"])
    assert "transmission_ratio" not in again.document["mechanism"]["drives"][0]
    assert again.at().drives.transmission[0] == pytest.approx(4.0, abs=1e-12)


def test_a_table_is_no_missing_ratio():
    assert from_document(arm()).missing == {}
    none = arm(mechanism__drives__1__transmission_ratio=REMOVED)
    (fault,) = faults(none)
    assert fault.key == "mechanism.drives.elbow.transmission_ratio"


def test_designs_together_have_the_ratios_of_their_own_postures():
    document = arm()
    lengths = np.array([0.19, 0.2, 0.21])
    steps = ("mechanism", "links", 0, "length_m")
    batch, valid = design_batch(document, {steps: lengths}, 3, "arm")
    assert valid.all()
    points, alone = batch.at()
    grid, _ = batch.at(np.array([[[0.2, 0.2], [0.25, 0.1]]]))
    assert not alone.any()
    together, over = (point.measure("stiffness_max").values for point in (points, grid))
    for i, length in enumerate(lengths):
        device = from_document(arm(mechanism__links__0__length_m=float(length)))
        assert points.drives.transmission[i] == pytest.approx(device.at().drives.transmission, rel=1e-12)
        assert together[i] == pytest.approx(device.at().measure("stiffness_max").values, rel=1e-9)
        assert over[i, 0, 1] == pytest.approx(device.at((0.25, 0.1)).measure("stiffness_max").values, rel=1e-9)


def test_designs_with_other_ratios_are_built_together():
    ratios = np.array([9.0, 10.0, 12.0])
    steps = ("mechanism", "drives", 0, "ratio_table", "ratio", 1)
    batch, valid = design_batch(arm(), {steps: ratios}, 3, "arm")
    assert valid.all()
    points, alone = batch.at()
    grid, _ = batch.at(np.array([[[0.2, 0.2], [0.25, 0.1]]]))
    assert not alone.any()
    together, over = (point.measure("stiffness_max").values for point in (points, grid))
    for i, ratio in enumerate(ratios):
        device = from_document(arm({"joint_rad": ANGLES, "ratio": [8.0, float(ratio), 11.0, 15.0]}))
        assert points.drives.transmission[i] == pytest.approx(device.at().drives.transmission, rel=1e-12)
        assert points[i].plant.stiffness == pytest.approx(device.at().plant.stiffness, rel=1e-12)
        assert together[i] == pytest.approx(device.at().measure("stiffness_max").values, rel=1e-9)
        assert over[i, 0, 1] == pytest.approx(device.at((0.25, 0.1)).measure("stiffness_max").values, rel=1e-9)
    _, valid = design_batch(arm(), {steps: np.array([9.0, -1.0, 12.0])}, 3, "arm")
    assert valid.tolist() == [True, False, True]


def test_designs_of_other_parts_keep_the_table():
    document = arm()
    periods = np.array([0.0005, 0.001])
    batch, _ = design_batch(document, {("loop", "sampling_period_s"): periods}, 2, "arm")
    point, _ = batch.at()
    grid, _ = batch.at(np.array([[[0.2, 0.2], [0.25, 0.1]]]))
    values, masses = point.measure("stiffness_max").values, grid.measure("motor_side_mass").values
    for i, period in enumerate(periods):
        device = from_document(arm(loop__sampling_period_s=float(period)))
        assert values[i] == pytest.approx(device.at().measure("stiffness_max").values, rel=1e-9)
        assert masses[i, 0, 1] == pytest.approx(
            device.at((0.25, 0.1)).measure("motor_side_mass").values, rel=1e-12
        )
