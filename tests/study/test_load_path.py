"""Charts under pushes of the hand: each is that of its push, a fixed surface is solved for, failures are data."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest

import zwidth
from zwidth.device import new_device
from zwidth.errors import NoMechanismError
from zwidth.measures import fastest_sideways_motion
from zwidth.model import Load
from zwidth.study import load_path
from zwidth.study.loaded_charts import without_push

LIMITS = {f"drives.motor-{side}.torque_limit_Nm": 0.05 for side in ("right", "left")}


def template(kind):
    return zwidth.from_document(tomllib.loads(new_device("a template", kind)))


@pytest.fixture(scope="module")
def device():
    return zwidth.load("five-bar")


@pytest.fixture(scope="module")
def path(device):
    return load_path(device, 5.0, 5)


def test_each_step_is_the_chart_of_its_push(device, path):
    assert path.pushes.tolist() == [-5.0, -2.5, 0.0, 2.5, 5.0]
    for step in path.steps:
        point = device.at(load=Load(push=step.push)) if step.push else device.at()
        chart = point.chart(decay=False)
        assert step.status == "ok"
        assert step.stiffness_max == chart.stiffness_max
        assert step.chart.stable_area == chart.stable_area
        motion = fastest_sideways_motion(point)
        assert step.growth_rate == motion.growth_rate
        if step.push:
            assert motion == chart.loop.sideways_motions[0]
            assert step.wall_force == point.equilibrium.wall_force
            np.testing.assert_array_equal(step.sideways_force, point.equilibrium.sideways_force)
            assert step.one_sided_amplitude == abs(point.equilibrium.wall_force) / chart.stiffness_max
            neglected = device.at(load=Load(push=step.push, hand="neglected")).chart(decay=False)
            assert step.hand_neglected == neglected.stiffness_max != chart.stiffness_max


def test_without_a_push_it_is_the_chart_without_load(device, path):
    middle = path.unpushed
    assert (middle.push, middle.equilibrium) == (0.0, None)
    assert middle.stiffness_max == device.chart(decay=False).stiffness_max
    assert middle.hand_neglected == middle.fixed_surface == middle.stiffness_max
    assert (middle.growth_rate, middle.wall_force) == (0.0, 0.0)
    assert np.isnan(middle.one_sided_amplitude)


def test_growth_is_as_the_push_and_with_rigid_drives_one_side_does_not_grow(device):
    rates = load_path(device, 4.0, 5).growth_rates
    assert (np.sign(rates) == [1.0, 1.0, 0.0, 1.0, 1.0]).all()
    np.testing.assert_allclose(rates[[0, 4]], 2.0 * rates[[1, 3]], rtol=0.01)
    rigid = load_path(device, 4.0, 5, device.at(model="rigid")).growth_rates
    assert (np.sign(rigid) == [1.0, 1.0, 0.0, 0.0, 0.0]).all()


def test_a_fixed_surface_is_where_the_handle_sinks_in_by_the_force_over_the_stiffness(device, path):
    start = device.at().posture.position
    for step in path.steps:
        if not step.push:
            continue
        assert step.fixed_surface_status == "ok"

        def largest_at(stiffness, push=step.push):
            place = start + np.array([0.0, push / stiffness, 0.0])
            return device.at(place, load=Load(push=push)).chart(decay=False).stiffness_max

        K = step.fixed_surface
        assert largest_at(K) == pytest.approx(K, rel=1e-8)
        assert largest_at(1.02 * K) < 1.02 * K  # stiffer walls are not stable, softer ones are
        assert largest_at(0.98 * K) > 0.98 * K
        assert abs(K - step.stiffness_max) > 1e-3 * K


@pytest.mark.parametrize("room", [0.005, 0.03])
def test_a_surface_into_which_the_handle_cannot_sink_has_no_answer(room):
    """An elbow that can bend by so little more [rad] gives way to a push of 20 N by less than F/K."""
    arm = template("serial-2r")
    elbow = arm.describe().joints["lower"]
    stopped = arm.with_({"links.lower.limits_rad": [0.0, elbow + room]})
    into_stop, away = (load_path(stopped, 20.0, 3).steps[k] for k in (0, 2))
    assert into_stop.status == "ok"
    assert np.isnan(into_stop.fixed_surface)
    assert re.match(r"none: .* [\d.]+ m, .*beyond", into_stop.fixed_surface_status)
    assert np.isfinite(away.fixed_surface)


def test_a_push_that_the_motors_do_not_hold_is_data(device):
    path = load_path(device.with_(LIMITS), 20.0, 5)
    assert [step.status.partition(":")[0] for step in path.steps] == [
        "no equilibrium",
        "ok",
        "ok",
        "ok",
        "no equilibrium",
    ]
    assert "needs" in path.steps[0].status
    assert np.isnan(path.stiffness_max[[0, 4]]).all()
    assert np.isfinite(path.stiffness_max[1:4]).all()
    assert np.isnan(path.steps[0].wall_force)
    assert np.isnan(path.steps[0].sideways_force).all()
    assert path.reason is None


def test_walls_that_are_stable_under_no_push_have_a_reason(device):
    path = load_path(device.with_({"loop.delay_samples": 3.0, "mechanism.damping.mode_ratio": 0.0}), 1.0, 3)
    assert np.isnan(path.stiffness_max).all()
    assert path.reason.endswith(" is stable")
    assert "no wall" in repr(path)


def test_all_else_of_the_load_is_kept(device):
    own = Load(force=(3.0, -4.0), gravity=(0.0, 0.0, -9.81), hand="follower", surface_radius=0.05)
    path = load_path(device.under(own), 2.0, 3)
    kept = without_push(own)
    assert (path.load.hand, path.load.force, path.load.push) == (kept.hand, None, None)
    for step in path.steps:
        load = step.equilibrium.load
        assert (load.push, load.force) == (step.push or None, None)
        assert (load.hand, load.surface_radius) == ("follower", 0.05)
        np.testing.assert_array_equal(load.gravity, [0.0, 0.0, -9.81])
    assert path.operating_point.load.pushes is False


def test_the_load_of_the_point_comes_before_that_of_the_device(device):
    point = device.at(load=Load(push=1.0, hand="neglected"))
    path = load_path(device, 2.0, 3, point)
    assert path.steps[0].equilibrium.load.hand == "neglected"
    assert path.steps[0].hand_neglected == path.steps[0].stiffness_max
    assert path.hand == "neglected"


def test_a_load_that_settles_has_the_push_as_the_whole_force():
    settled = template("serial-2r").under(Load(force=(0.0, -1.0), settle=True))
    step = load_path(settled, 2.0, 3).steps[0]
    np.testing.assert_allclose(step.equilibrium.hand_force, [0.0, -2.0, 0.0], atol=1e-9)
    assert abs(step.equilibrium.motions.handle.position[0] - 0.08) > 0.01  # it slides to where that is in balance


def test_a_load_under_which_there_is_no_equilibrium_does_not_matter(device):
    weak = device.with_(LIMITS).under(Load(push=50.0))
    with pytest.raises(ValueError, match="its limit"):
        weak.at()
    assert np.isfinite(load_path(weak, 1.0, 3).stiffness_max).all()


def test_moments_have_no_fixed_surface():
    path = load_path(template("wrist"), 0.2, 3)
    assert np.isfinite(path.stiffness_max).all()
    assert np.isnan(path.steps[0].fixed_surface)
    assert "an axis" in path.steps[0].fixed_surface_status


def test_progress_is_told_after_each_push(device):
    said = []
    device.load_path(1.0, 3, progress=lambda *step: said.append(step))
    assert said == [("pushes", 1, 3), ("pushes", 2, 3), ("pushes", 3, 3)]


def test_what_is_no_path_is_refused(device):
    with pytest.raises(ValueError, match=r"^push must"):
        load_path(device, -1.0)
    with pytest.raises(ValueError, match=r"^count must"):
        load_path(device, 1.0, 4)
    with pytest.raises(NoMechanismError):
        load_path(zwidth.load("published-two-mass"))


def test_document_and_table_hold_each_push(path):
    document, table = path.document(), path.table()
    assert document["push_N"] == path.pushes.tolist()
    assert len(document["sideways_force_N"]) == 5
    assert document["sideways_force_N"][0] == path.steps[0].sideways_force.tolist()
    assert table["sideways_force_x_N"][0] == path.steps[0].sideways_force[0]
    assert document["time_to_double_s"][0] == pytest.approx(np.log(2.0) / document["growth_rate_1_per_s"][0])
    assert document["time_to_double_s"][2] == np.inf  # neutral
    assert {len(column) for column in table.values()} == {5}
