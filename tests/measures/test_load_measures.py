"""What a load does, as measures: the stiffest wall's change, growth along the surface, the hand's force across."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import zwidth
from zwidth.measures import NO_EQUILIBRIUM, NO_VALUE, OK, STATUS
from zwidth.model import Load
from zwidth.study import extreme_over_directions, plane_of, why_no_cell

PUSH = Load(push=-5.0)
LIMITS = {f"drives.motor-{side}.torque_limit_Nm": 0.05 for side in ("right", "left")}
NAMES = ("load_change", "sideways_growth", "sideways_force")


@pytest.fixture(scope="module")
def device():
    return zwidth.load("five-bar")


def test_the_change_is_that_of_the_stiffest_wall(device):
    loaded, bare = device.at(load=PUSH), device.at()
    change = loaded.chart().stiffness_max / bare.chart().stiffness_max - 1.0
    assert abs(change) > 1e-4
    assert float(loaded.measure("load_change")) == pytest.approx(change, rel=1e-6)


def test_gravity_is_part_of_the_load(device):
    """Of an arm that stands in its own weight; without a push the wall is at rest."""
    upright = device.at((0.05, 0.2), gravity=(0.0, -9.81))
    change = upright.chart().stiffness_max / device.at((0.05, 0.2)).chart().stiffness_max - 1.0
    assert abs(change) > 1e-8
    assert float(upright.measure("load_change")) == pytest.approx(change, rel=1e-3)
    assert float(upright.measure("sideways_force")) == pytest.approx(
        np.linalg.norm(upright.equilibrium.sideways_force)
    )


def test_growth_is_that_of_the_fastest_motion_and_never_below_zero(device):
    grows = device.at(load=PUSH)
    assert float(grows.measure("sideways_growth")) == grows.loop.sideways_motions[0].growth_rate > 0.0
    decays = zwidth.load("stamper-delta").at(load=PUSH, gravity=(0.0, 0.0, -9.81))
    assert decays.loop.sideways_motions[0].growth_rate < 0.0
    assert float(decays.measure("sideways_growth")) == 0.0


def test_growth_is_known_where_the_motion_counts_for_stability(device):
    counted = device.at(load=replace(PUSH, count_sideways=True))
    assert counted.loop.sideways_motions == ()
    expected = device.at(load=PUSH).measure("sideways_growth")
    assert float(counted.measure("sideways_growth")) == float(expected)


def test_a_hand_that_holds_every_direction_leaves_nothing_to_grow(device):
    held = device.held_by("thesis-arm").with_({"operator.directions": "all"})
    assert float(held.at(load=PUSH).measure("sideways_growth")) == 0.0


def test_the_force_across_is_the_hands(device):
    found = device.at(load=PUSH).equilibrium
    across = found.hand_force - found.hand_force @ [0.0, 1.0, 0.0] * np.array([0.0, 1.0, 0.0])
    assert np.linalg.norm(across) > 1e-4
    assert float(device.at(load=PUSH).measure("sideways_force")) == pytest.approx(np.linalg.norm(across), rel=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_without_a_load_they_are_not_there(device, name):
    with pytest.raises(zwidth.errors.MeasureError, match=f"{name} needs a load.*give load"):
        device.measure(name)


def test_no_wall_is_no_value(device):
    unstable = device.with_({"loop.delay_samples": 3.0, "mechanism.damping.mode_ratio": 0.0})
    found = unstable.at(load=PUSH).measure("load_change")
    assert found.status == NO_VALUE
    assert "without load" in found.notes[0].reason


def test_a_cell_without_equilibrium_has_a_status(device):
    weak = device.with_(LIMITS).under(Load(push=-9.0))
    dataset = zwidth.workspace_map(weak, [*NAMES, "stiffness_max"], plane_of(weak, cells=(7, 6)))
    status = dataset["load_change_status"].values
    assert {NO_EQUILIBRIUM, OK} <= set(status.ravel().tolist())
    for name in (*NAMES, "stiffness_max"):
        np.testing.assert_array_equal(dataset[f"{name}_status"].values, status)
        assert (np.isfinite(dataset[name].values) == (status == OK)).all()
    row, column = np.argwhere(status == NO_EQUILIBRIUM)[0]
    place = (float(dataset["x_m"][column]), float(dataset["y_m"][row]))
    with pytest.raises(ValueError, match="its limit"):
        weak.at(place)
    assert dataset.attrs["load"].count("push of -9 N ") == 1
    assert np.array_equal(dataset["load_change_status"].attrs["flag_values"], list(STATUS))


def test_a_map_whose_cells_have_no_equilibrium_says_so(device):
    weak = device.with_(LIMITS).under(Load(push=-500.0))
    dataset = zwidth.workspace_map(weak, "stiffness_max", plane_of(weak, cells=(4, 3)))
    assert " -500 N along the " in why_no_cell(dataset)


def test_the_worst_direction_has_the_push_along_it(device):
    point = device.at(load=(0.0, -5.0))
    found = extreme_over_directions(zwidth.find_measure("sideways_growth"), point, "worst")
    along = device.at(direction=found.direction, load=Load(push=5.0))
    assert float(found.extreme.values) == pytest.approx(float(along.measure("sideways_growth")), rel=1e-9)
    assert float(found.extreme.values) > float(point.measure("sideways_growth"))


@pytest.mark.parametrize("key", ["load.push_N", "drives.motor-right.torque_limit_Nm"])
def test_designs_of_a_sweep_are_those_of_single_devices(device, key):
    """Also where one without equilibrium comes first: its posture is not taken for that of the others."""
    values = [-40.0, -5.0, 2.0] if key == "load.push_N" else [0.034, 0.06, 0.1]
    limits = dict.fromkeys(LIMITS, 0.1)
    loaded = device.with_({**limits, "load.push_N": -11.0})
    swept = zwidth.sweep(loaded, {key: values}, [*NAMES, "stiffness_max"])
    assert swept["stiffness_max_status"].values.tolist() == [NO_EQUILIBRIUM, OK, OK]
    assert "its limit" in swept["stiffness_max"].attrs["notes"]
    for name in (*NAMES, "stiffness_max"):
        for k in (1, 2):
            alone = loaded.with_({key: values[k]}).at().measure(name)
            assert float(swept[name].values[k]) == pytest.approx(float(alone), rel=1e-9)


def test_designs_that_bend_behind_their_motors_keep_the_posture_asked_for(device):
    """The motors' posture is asked for; a design's posture must not start from that of the one before."""
    behind = device.under(Load(push=-5.0, posture_of="motors"))
    swept = zwidth.sweep(behind, {"load.push_N": [-5.0, -4.0, -3.0]}, "sideways_force")
    for push, value in zip([-5.0, -4.0, -3.0], swept["sideways_force"].values, strict=True):
        alone = behind.with_({"load.push_N": push}).at().measure("sideways_force")
        assert value == pytest.approx(float(alone), rel=1e-9)
