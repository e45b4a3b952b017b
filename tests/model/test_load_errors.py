"""Loads that cannot be meant, or that a device cannot bear; and those of files beside those that are given."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from zwidth.device import from_document
from zwidth.device.load import load as load_device
from zwidth.errors import (
    DeviceError,
    EquilibriumError,
    LoadError,
    ModelError,
    OperatingPointError,
    SeveralDirectionsError,
)
from zwidth.loop import OperatingPoint
from zwidth.model import Load


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"force": [0.0, 0.0]}, "a load of 0 N leaves a one-sided wall at the edge of contact"),
        ({"moment": [0.0, 0.0, 0.0]}, "a load of 0 N"),
        ({"push": 0.0}, "a load of 0 N"),
        ({"force": [1.0]}, r"force must be two or three finite numbers \[N\], got \[1.0\]"),
        ({"force": [1.0, 2.0, 3.0, 4.0]}, "force must be two or three finite numbers"),
        ({"force": 5.0}, r"force must be two or three finite numbers \[N\], got 5.0"),
        ({"force": "down"}, "force must be two or three finite numbers"),
        ({"force": [0.0, np.nan]}, "force must be two or three finite numbers"),
        ({"moment": [0.0, np.inf]}, r"moment must be two or three finite numbers \[N m\]"),
        ({"gravity": 9.81}, r"gravity must be two or three finite numbers \[m/s²\], got 9.81"),
        ({"push": np.inf}, r"push must be a finite number \[N\], got inf"),
        ({"push": True}, r"push must be a finite number \[N\], got True"),
        ({"surface_radius": True}, "surface_radius must be a number but 0.*got True"),
        ({"push": "5"}, r"push must be a finite number \[N\], got '5'"),
        ({"force": [1.0, 0.0], "push": 1.0}, "push is given beside force; give one of them"),
        ({"force": [1.0, 0.0], "moment": [0.0, 1.0]}, "moment is given beside force"),
        ({"surface_radius": 0.0}, "surface_radius must be a number but 0, or inf"),
        ({"surface_radius": np.nan}, "surface_radius must be a number but 0"),
        ({"surface_radius": "flat"}, "surface_radius must be a number but 0.*got 'flat'"),
        ({"settle": True}, "settle needs a force"),
        ({"settle": True, "push": 1.0}, "settle needs a force"),
        (
            {"force": [0.0, -5.0], "settle": True, "surface_radius": 0.05},
            "surface_radius of 0.05 m is given beside settle, which slides the handle along a plane; leave one",
        ),
        ({"hand": "soft"}, "hand must be 'dead' or 'follower' or 'neglected', got the text 'soft'"),
        ({"posture_of": "links"}, "posture_of must be 'handle' or 'motors'"),
        ({"branch": "up"}, "branch must be 'forward' or 'backward'"),
    ],
)
def test_a_load_that_cannot_be_meant_is_one_clear_error(arguments, words):
    with pytest.raises(ValueError, match=words):
        Load(**arguments)


def test_loads_of_the_same_numbers_are_equal():
    one, other = (Load(force=[0.0, -5.0], gravity=[0.0, 0.0, -9.81]) for _ in range(2))
    assert one == other
    assert len({one, other, Load(push=1), Load(push=1.0)}) == 2
    assert one != Load(force=[0.0, -5.0], gravity=[0.0, 0.0, -9.8])
    assert Load(force=[0.0, -5.0]) != Load(push=-5.0)
    assert one != "a push"


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"load": (0.0, 0.0)}, DeviceError, "five-bar: load: a load of 0 N"),
        ({"load": "down"}, DeviceError, "five-bar: load: force must be two or three finite numbers"),
        ({"gravity": (0.0, np.nan)}, DeviceError, "five-bar: load: gravity must be two or three finite numbers"),
        (
            {"load": Load(push=1.0), "gravity": "down"},
            DeviceError,
            "five-bar: load: gravity must be two or three finite numbers .* got 'down'",
        ),
        ({"load": (5.0, 0.0)}, LoadError, r"the load \(5, 0, 0\) N does not push along the rendered direction"),
        ({"load": (1.0, -5.0)}, LoadError, r"part \(1, 0, 0\) N across .* needs \(-0.00291587, 0, 0\) N; give"),
        (
            {"load": Load(moment=[0.0, 0.0, 1.0])},
            LoadError,
            "rendered along a direction; give the load as a force",
        ),
        ({"load": (0.0, 0.0, 1.0), "axis": (0.0, 0.0, 1.0)}, LoadError, "cannot push about an axis"),
        (
            {"load": Load(force=[0.0, -5.0], settle=True), "axis": (0.0, 0.0, 1.0)},
            LoadError,
            "settle is for loads on a handle whose position the drives control; leave it out",
        ),
        ({"load": Load(push=5e9)}, EquilibriumError, r"no equilibrium was found under a push of 5e\+09 N"),
        (
            {"load": (0.0, -5.0), "directions": [(1.0, 0.0), (0.0, 1.0)]},
            SeveralDirectionsError,
            "over several directions: a load",
        ),
        ({"load": (0.0, -5.0), "model": "two-mass"}, ModelError, "'two-mass' has no form under load"),
        ({"load": (0.0, -5.0), "model": "motor-mass"}, ModelError, "use 'full' or 'rigid'"),
    ],
)
def test_a_load_that_a_device_cannot_bear_is_one_clear_error(arguments, error, words):
    with pytest.raises(error, match=words):
        ask_all(load_device("five-bar").at(**arguments))


def ask_all(point):
    """What a load has to be in balance for."""
    return point.plant_of_directions if point.direction_count > 1 else point.plant


def test_limits_of_motors_and_computer_bound_the_load():
    device = load_device("five-bar")
    weak = device.with_({"drives.motor-right.torque_limit_Nm": 0.034})
    assert weak.at(load=(0.0, -6.0)).plant.size == 3
    with pytest.raises(
        EquilibriumError, match=r"drive 'motor-right' needs 0\.03415 N m at its motor, more than its"
    ):
        weak.at(load=(0.0, -7.0))
    limited = device.with_({"loop.saturation.force_N": 4.0})
    assert limited.at(load=(0.0, -3.9)).plant.size == 3
    with pytest.raises(EquilibriumError, match=r"takes 5\.00512 N of the wall, more than the force limit of 4 N"):
        limited.at(load=(0.0, -5.0)).plant  # noqa: B018


def test_along_every_direction_the_computer_s_limit_bounds_the_load():
    limited = load_device("five-bar").with_({"loop.saturation.force_N": 5.004})
    along = limited.at(load=Load(force=[4.0, 0.0]), direction=(1.0, 0.0)).by_direction(count=3)
    assert along.status == ("ok",) * 3
    along = limited.at(direction=(1.0, 0.0), load=Load(push=-5.0)).by_direction(count=4)
    assert [status[:24] for status in along.status] == ["ok", "the load takes 5.00512 N", "ok", "ok"]


def test_about_an_axis_a_push_is_a_moment():
    wrist = load_device("openwrist").with_({"loop.saturation.force_N": 0.01})
    with pytest.raises(
        EquilibriumError, match=r"takes 0\.05 N m of the wall, more than the force limit of 0\.01 N m"
    ):
        wrist.at(axis=(0.0, 0.0, 1.0), load=Load(push=0.05)).plant  # noqa: B018


def test_a_moment_that_is_none_is_named_as_one():
    with pytest.raises(DeviceError, match=r"five-bar: load: moment must be two or three finite numbers \[N m\]"):
        load_device("five-bar").under((1.0, 2.0, 3.0, 4.0), moment=True)


def test_a_point_without_a_model_s_name_is_that_of_the_full_model():
    point = load_device("five-bar").at(load=(0.0, -5.0))
    assert point.in_model(None).plant.stiffness == pytest.approx(point.plant.stiffness, rel=1e-12)


@pytest.mark.parametrize("name", ["published-two-mass", "hapkit-course"])
@pytest.mark.parametrize("arguments", [{"load": (0.0, -5.0)}, {"gravity": (0.0, -9.81)}, {"load": Load(push=1.0)}])
def test_a_device_without_a_mechanism_bears_no_load(name, arguments):
    with pytest.raises(DeviceError, match=r"load: needs a \[mechanism\], whose forces turn as it moves"):
        load_device(name).at(**arguments)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"force_N": [0.0, 0.0]}, "load.force_N: is 0, which leaves a one-sided wall at the edge of contact"),
        ({"moment_Nm": [0.0, 0.0, 0.0]}, "load.moment_Nm: is 0, which leaves"),
        ({"force_N": [1.0]}, "load.force_N: must have at least 2 elements"),
        ({"force_N": [0.0, float("nan")]}, r"load.force_N.1: must be finite"),
        (
            {"force_N": [0.0, -5.0], "push_N": 1.0},
            "load.push_N: stands beside force_N; only one of them is allowed",
        ),
        ({"push_N": 0.0}, "load.push_N: is 0, which leaves a one-sided wall at the edge of contact"),
        ({"push_N": "5"}, "load.push_N: must be a number"),
        ({"settle": True}, "load.settle: needs force_N"),
        ({"settle": True, "push_N": 1.0}, "load.settle: needs force_N"),
        ({"surface_radius_m": 0.0}, "load.surface_radius_m: must not be 0; remove it for a plane"),
        ({"surface_radius_m": -float("inf")}, "load.surface_radius_m: must not be -inf; remove it for a plane"),
        (
            {"force_N": [0.0, -5.0], "settle": True, "surface_radius_m": 0.05},
            "load.surface_radius_m: stands beside settle, which slides the handle along a plane; remove one",
        ),
        ({"hand": "soft"}, "load.hand: must be 'dead', 'follower' or 'neglected'"),
        ({"force": [0.0, 5.0]}, "load.force: is not a key of a device file; did you mean 'force_N'"),
        ({"gravity_m_per_s2": -9.81}, "load.gravity_m_per_s2: must be a list"),
        ({"spring_branch": "back"}, "did you mean 'backward'"),
    ],
)
def test_a_file_s_load_that_cannot_be_meant_is_one_fault(table, words):
    document = copy.deepcopy(load_device("five-bar").document) | {"load": table}
    with pytest.raises(DeviceError, match=words) as caught:
        from_document(document)
    assert len(caught.value.faults) == 1


def test_a_file_s_load_and_one_that_is_given_are_the_same():
    document = copy.deepcopy(load_device("five-bar").document)
    document["load"] = {
        "force_N": [0.0, -5.0],
        "gravity_m_per_s2": [0.0, 0.0, -9.81],
        "hand": "follower",
        "posture_of": "motors",
        "surface_radius_m": -0.4,
        "count_sideways": True,
        "spring_branch": "backward",
    }
    written = from_document(document)
    load = Load(
        force=[0.0, -5.0],
        gravity=[0.0, 0.0, -9.81],
        hand="follower",
        posture_of="motors",
        surface_radius=-0.4,
        count_sideways=True,
        branch="backward",
    )
    given = load_device("five-bar").at(load=load)
    point = written.at()
    for name in Load.__dataclass_fields__:
        assert np.array_equal(getattr(point.load, name), getattr(given.load, name)), name
    assert np.array_equal(point.plant.stiffness, given.plant.stiffness)
    lighter = written.at(load=(0.0, -2.0), gravity=(0.0, 0.0, -1.0))
    assert lighter.load.force.tolist() == [0.0, -2.0, 0.0]
    assert lighter.load.weight.tolist() == [0.0, 0.0, -1.0]
    assert (lighter.load.hand, lighter.load.posture_of) == ("follower", "motors")
    pushed = written.under(Load(push=-1.0)).at()
    assert (pushed.load.force, pushed.load.push, pushed.load.hand) == (None, -1.0, "dead")


def test_a_point_without_a_load_has_no_equilibrium_and_no_device_file_needs_one():
    with pytest.raises(OperatingPointError, match="no load is given, about which there would be an equilibrium"):
        load_device("five-bar").at().equilibrium  # noqa: B018
    point = load_device("five-bar").at([(0.0, 0.25), (0.6, 0.6)], load=(0.0, -5.0))
    with pytest.raises(OperatingPointError, match="out of reach, singular or without equilibrium"):
        point[1].equilibrium  # noqa: B018
    with pytest.raises(ValueError, match="a load needs a mechanism"):
        OperatingPoint(point.controller, given_plant=point[0].plant, load=Load(push=1.0))
