"""Loads that cannot be meant, or that a device cannot bear; and those of files beside those that are given."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from zwidth.device import from_document
from zwidth.device.load import load as load_device
from zwidth.model import Load


def test_loads_of_the_same_numbers_are_equal():
    one, other = (Load(force=[0.0, -5.0], gravity=[0.0, 0.0, -9.81]) for _ in range(2))
    assert one == other
    assert len({one, other, Load(push=1), Load(push=1.0)}) == 2
    assert one != Load(force=[0.0, -5.0], gravity=[0.0, 0.0, -9.8])
    assert Load(force=[0.0, -5.0]) != Load(push=-5.0)
    assert one != "a push"


def test_along_every_direction_the_computer_s_limit_bounds_the_load():
    limited = load_device("five-bar").with_({"loop.saturation.force_N": 5.004})
    along = limited.at(load=Load(force=[4.0, 0.0]), direction=(1.0, 0.0)).by_direction(count=3)
    assert along.status == ("ok",) * 3
    along = limited.at(direction=(1.0, 0.0), load=Load(push=-5.0)).by_direction(count=4)
    assert [status == "ok" for status in along.status] == [True, False, True, True]
    assert "5.00512 N" in along.status[1]


def test_a_point_without_a_model_s_name_is_that_of_the_full_model():
    point = load_device("five-bar").at(load=(0.0, -5.0))
    assert point.in_model(None).plant.stiffness == pytest.approx(point.plant.stiffness, rel=1e-12)


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
