"""Which posture a device has under load: in each model, and where a posture is handed on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.model.beam_devices import planar_arm, with_beams
from zwidth.device import from_document
from zwidth.device.load import load as load_device
from zwidth.errors import EquilibriumError, LoadError
from zwidth.model import NO_EQUILIBRIUM, OK, Load, loaded_posture
from zwidth.study import find_variant, what_if

MOTORS = Load(push=-3.0, posture_of="motors")


def counted(point):
    """Where the computer sees the handle."""
    return point.equilibrium.counted.motions.handle.position


# --- the rigid model --------------------------------------------------------------------------------


def test_motors_of_the_rigid_model_count_the_posture_that_is_asked_for():
    point = load_device("five-bar").at(load=MOTORS, model="rigid")
    assert counted(point) == pytest.approx([0.0, 0.25, 0.0], abs=1e-12)
    assert point.posture.position == pytest.approx([0.0, 0.25, 0.0], abs=1e-12)


def test_the_rigid_model_of_links_that_bend_has_its_handle_where_it_is_asked_for():
    found = from_document(with_beams(planar_arm()))
    point = found.at(load=Load(push=-5.0), model="rigid")
    assert point.equilibrium.handle_place == pytest.approx(found.reference_position, abs=1e-9)


def test_a_force_that_a_flexible_device_settles_under_may_have_no_balance_in_the_rigid_model():
    load = Load(force=[-0.00106, -3.0], settle=True)
    five_bar = load_device("five-bar")
    settled = five_bar.at(load=load)
    assert settled.equilibrium.hand_force == pytest.approx(load.force, abs=1e-9)
    for ask in (lambda: five_bar.at(load=load, model="rigid"), lambda: settled.in_model("rigid")):
        with pytest.raises(EquilibriumError, match="in balance"):
            ask()


def test_another_model_of_a_point_has_the_posture_of_that_model():
    five_bar = load_device("five-bar")
    full, rigid = (five_bar.at(load=MOTORS, model=model) for model in ("full", "rigid"))
    assert abs(full.posture.position[1] - rigid.posture.position[1]) > 1e-4
    for point, model, expected in ((full, "rigid", rigid), (rigid, "full", full)):
        other = point.in_model(model)
        assert other.posture.angles == pytest.approx(expected.posture.angles, abs=1e-12)
        assert counted(other) == pytest.approx(counted(expected), abs=1e-12)
    many = five_bar.at([[0.0, 0.25], [0.02, 0.24]], load=MOTORS)
    assert many.in_model("rigid").posture.position == pytest.approx(
        np.array([[0.0, 0.25, 0.0], [0.02, 0.24, 0.0]]), abs=1e-12
    )


def test_what_changes_with_the_model_goes_on_where_the_rigid_one_has_no_balance():
    point = load_device("five-bar").at(load=Load(force=[-0.00106, -3.0], settle=True))
    rigid = find_variant(what_if(load_device("five-bar"), point), "rigid-drives")
    assert rigid.chart is None
    assert "in balance" in rigid.reason


# --- a posture that is handed on --------------------------------------------------------------------


def test_a_posture_under_load_that_is_handed_back_is_loaded_once():
    five_bar = load_device("five-bar")
    load = Load(push=-2.0, posture_of="motors")
    point = five_bar.at(load=load)
    again = five_bar.at(point.posture, load=load)
    assert again.posture.angles == pytest.approx(point.posture.angles, abs=1e-13)
    assert counted(again) == pytest.approx([0.0, 0.25, 0.0], abs=1e-10)
    assert again.requested_position == pytest.approx([0.0, 0.25, 0.0], abs=1e-12)
    moved = five_bar.under(load).at_point(again)
    assert moved.posture.angles == pytest.approx(point.posture.angles, abs=1e-12)
    bare = five_bar.at(point.posture)
    assert bare.posture.angles == pytest.approx(point.posture.angles, abs=0.0)
    assert bare.posture.asked is None


def test_postures_of_a_batch_keep_what_was_asked_for():
    five_bar = load_device("five-bar").under(MOTORS)
    many = five_bar.at([[0.0, 0.25], [0.02, 0.24]])
    assert many[1].posture.asked.position == pytest.approx([0.02, 0.24, 0.0])
    again = five_bar.at(many.posture)
    assert again.posture.angles == pytest.approx(many.posture.angles, abs=1e-13)
    assert replace(many, load=None).in_model("rigid").posture is many.posture


def test_a_search_that_does_not_end_is_an_error(monkeypatch):
    monkeypatch.setattr(loaded_posture, "ROUNDS", 1)
    with pytest.raises(EquilibriumError, match="after 1 rounds"):
        load_device("five-bar").at(load=MOTORS)


# --- batches ----------------------------------------------------------------------------------------


def test_in_a_batch_a_load_across_the_direction_is_a_status():
    loaded = load_device("five-bar").under(Load(force=[3.0, 0.0]))
    mixed = loaded.at([[0.0, 0.25], [0.02, 0.24]], direction=[[0.0, 1.0], [1.0, 0.0]])
    assert mixed.status.tolist() == [NO_EQUILIBRIUM, OK]
    for name in ("closure_residual", "projected", "angles", "jacobian"):
        assert np.isnan(getattr(mixed.posture, name)[0]).all()
        assert np.isfinite(getattr(mixed.posture, name)[1]).all()
    assert mixed.posture.position[0] == pytest.approx([0.0, 0.25, 0.0])
    with pytest.raises(LoadError, match=r"\(3, 0, 0\) N does not"):
        loaded.at([[0.0, 0.25], [0.02, 0.24]])


def test_a_part_of_the_load_that_only_one_posture_needs_is_a_status_in_the_others():
    five_bar = load_device("five-bar")
    force = five_bar.at(load=Load(push=-5.0)).equilibrium.hand_force
    many = five_bar.at([[0.0, 0.25], [0.02, 0.24]], load=Load(force=force))
    assert many.status.tolist() == [OK, NO_EQUILIBRIUM]
    values = many.measure("sideways_force")
    assert values.status.tolist() == [OK, NO_EQUILIBRIUM]
    assert np.isnan(values.values[1])
    none = five_bar.at([[0.02, 0.24], [0.03, 0.24]], load=Load(force=force))
    assert none.status.tolist() == [NO_EQUILIBRIUM] * 2
