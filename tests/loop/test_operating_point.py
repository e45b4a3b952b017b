"""Operating points: what a question adds to a device, and the way from there to the plant and the loop."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from zwidth.chart import multi_chart, stability_chart
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import DeviceError, NoMechanismError, OperatingPointError, OutOfReach, SeveralDirectionsError
from zwidth.loop import Controller, Loop, MultiLoop, OperatingPoint
from zwidth.model import (
    OK,
    OUT_OF_REACH,
    Operator,
    Plant,
    attach,
    reduce_directions,
    reduce_mechanism,
    solve_posture,
)

POSITION, DIRECTION = (0.03, 0.22), (0.6, 0.8)


@pytest.fixture(scope="module")
def device():
    return load("five-bar")


@pytest.fixture(scope="module")
def device_with_operator():
    return load("published-two-mass", operator="thesis-arm")


# --- one point ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [None, "full", "two-mass", "motor-mass", "rigid"])
def test_the_plant_is_that_of_posture_direction_and_model(device, model):
    point = device.at(POSITION, DIRECTION, model=model)
    posture = solve_posture(device.mechanism, POSITION, device.reference_assembly)
    u = np.array([0.6, 0.8, 0.0])
    plant = reduce_mechanism(device.mechanism, posture, u, model or "full", device.damping, device.encoders)
    assert_allclose(point.plant.mass, plant.mass, rtol=1e-14)
    assert_allclose(point.plant.stiffness, plant.stiffness, rtol=1e-14)
    assert point.loop.controller is device.controller


def test_what_is_left_out_is_the_file_s(device):
    point = device.at()
    assert_allclose(point.posture.position, device.reference_position)
    assert_allclose(point.direction, [0.0, 1.0, 0.0])
    assert (point.posture.assembly, point.model) == (device.reference_assembly, "full")
    assert point.requested_position is None


def test_a_direction_of_any_length_is_its_unit_vector(device):
    for length in (1e-200, 3.0, 1e200):
        assert_allclose(device.at(direction=(3.0 * length, 4.0 * length)).direction, [0.6, 0.8, 0.0], rtol=1e-15)


def test_a_posture_may_be_given_by_its_joints_or_as_solved(device):
    solved = device.at(POSITION).posture
    angles = dict(zip(device.mechanism.links.names, solved.angles.tolist(), strict=True))
    driven = {
        device.mechanism.links.names[j]: angles[device.mechanism.links.names[j]]
        for j in device.mechanism.drives.joint
    }
    assert_allclose(device.at(driven).posture.position, solved.position, atol=1e-9)
    assert device.at(solved).posture is solved


def test_a_position_is_projected_within_a_hundredth_of_the_arm_and_refused_beyond():
    paddle = {
        "name": "paddle",
        "loop": {"sampling_period_s": 0.001},
        "mechanism": {
            "links": [
                {
                    "name": "lever",
                    "joint": "revolute",
                    "length_m": 0.1,
                    "mass_kg": 0.05,
                    "center_of_mass_m": [0.05, 0, 0],
                    "inertia_kg_m2": 5e-5,
                }
            ],
            "drives": [
                {"name": "motor", "joint": "lever", "motor_inertia_kg_m2": 1e-6, "transmission_ratio": 10.0}
            ],
            "handle": {"link": "lever", "point_m": [0.1, 0, 0]},
            "damping": {"mode_ratio": 0.05},
            "assemblies": {"only": {"joints_rad": {"lever": 1.5}}},
            "reference": {"position_m": [0.0, 0.1], "direction": [1.0, 0.0]},
        },
    }
    device = from_document(paddle)
    near = device.at((0.0, 0.1009))
    assert_allclose(near.posture.position, [0.0, 0.1, 0.0], atol=1e-9)
    assert float(near.posture.projected) == pytest.approx(9e-4, rel=1e-6)
    with pytest.raises(OutOfReach, match=r"answered position .*\(0, 0.1, 0\) m"):
        device.at((0.0, 0.1011))
    assert device.at([(0.0, 0.1009)]).status.tolist() == [OUT_OF_REACH]  # in a batch nothing is projected


def test_the_operator_holds_the_plant_and_can_be_taken_off(device_with_operator):
    point, alone = device_with_operator.at(), device_with_operator.given_plant
    assert np.array_equal(point.plant.mass, attach(alone, device_with_operator.operator).mass)
    assert point.ungripped_plant is alone
    assert point.without_operator.plant is device_with_operator.given_plant
    assert device_with_operator.at(operator="none").operator is None
    hand = Operator(0.3, 100.0, 2.0, 5000.0, 10.0)
    held = device_with_operator.at(operator=hand)
    assert held.operator == hand
    assert np.array_equal(held.plant.mass, attach(device_with_operator.given_plant, hand).mass)
    assert device_with_operator.operator != hand  # the device itself stays as it is


def test_the_same_point_of_another_device_asks_for_the_same(device):
    longer = (
        device.with_({"links.upper-right.length_m": 0.16, "links.upper-left.length_m": 0.16}) if False else device
    )
    point = device.at(POSITION, DIRECTION, model="rigid")
    again = longer.at_point(point)
    assert_allclose(again.posture.position[:2], POSITION, atol=1e-9)
    assert (again.model, again.posture.assembly) == ("rigid", point.posture.assembly)
    assert np.array_equal(again.directions, point.directions)


def test_how_far_the_handle_can_go_and_how_far_its_path_passes(device):
    point = device.at(POSITION, DIRECTION)
    back, forth = point.handle_range
    assert back < 0.0 < forth
    assert point.distance_from_path(0.0) == 0.0
    assert point.distance_from_path(1e-3) == pytest.approx(0.0, abs=1e-9)  # two drives follow a straight line
    assert load("hapkit-course").at().handle_range is None


# --- many points, several directions ------------------------------------------------------------------


def test_leading_axes_broadcast_and_each_point_is_the_question_asked_alone(device):
    rng = np.random.default_rng(11)
    positions = np.array([0.0, 0.22]) + rng.uniform(-0.08, 0.08, (3, 1, 2))
    directions = rng.normal(size=(4, 2))
    points = device.at(positions, directions)
    assert points.shape == (3, 4)
    assert points.flat.shape == (12,)
    for i, j in np.ndindex(3, 4):
        if points.status[i, j] != OK:
            continue
        alone = device.at(positions[i, 0], directions[j])
        if alone.posture.projected > 0.0:
            continue
        assert_allclose(points[i, j].plant.mass, alone.plant.mass, rtol=1e-9)
        assert_allclose(points[i, j].direction, alone.direction, rtol=1e-15)
        assert_allclose(points.effective.rigid_mass[i, j], alone.effective.rigid_mass, rtol=1e-9)
        assert_allclose(points.lever_arms[i, j], alone.lever_arms, rtol=1e-9, atol=1e-12)


def test_a_batch_has_no_loop_and_says_what_to_ask_instead(device):
    points = device.at(np.tile([0.0, 0.25], (3, 1)))
    for ask in ("plant", "loop", "plant_of_directions", "loop_of_directions", "handle_range"):
        with pytest.raises(OperatingPointError, match=r"3 operating points .*measure"):
            getattr(points, ask)
    with pytest.raises(OperatingPointError, match=r"\.measure\(name\)"):
        points.chart()
    assert points.measure("isotropy").values.shape == (3,)


def test_directions_rendered_together_are_an_axis_of_their_own(device):
    both = device.at(POSITION, directions=[(1.0, 0.0), (0.0, 1.0)])
    assert (both.shape, both.direction_count) == ((), 2)
    assert both.plant_of_directions.count == 2
    u = np.eye(3)[:2]
    plant = reduce_directions(device.mechanism, both.posture, u, "full", device.damping)
    assert both.chart().stiffness_max == multi_chart(MultiLoop(plant, device.controller)).stiffness_max
    assert both.check(1000.0, 5.0).names == ["stable"]
    with pytest.raises(OperatingPointError, match="2 directions"):
        both.direction  # noqa: B018
    batch = device.at([POSITION, (0.0, 0.25)], directions=[(1.0, 0.0), (0.0, 1.0)])
    assert (batch.shape, batch.direction_count) == ((2,), 2)
    assert batch[1].directions.shape == (2, 3)


def test_what_several_directions_leave_out_is_refused_by_name():
    held = load("five-bar", operator="thesis-arm").at(directions=[(1.0, 0.0), (0.0, 1.0)])
    with pytest.raises(SeveralDirectionsError, match="an operator") as caught:
        held.plant_of_directions  # noqa: B018
    assert caught.value.obstacles == ("an operator",)


# --- devices without a mechanism ----------------------------------------------------------------------


def test_a_given_plant_has_one_point(device_with_operator):
    point = device_with_operator.at()
    assert (point.shape, point.status.tolist(), point.direction_count) == ((), OK, 1)
    assert point[0] is point
    for ask in ("direction", "jacobian", "mass_matrix", "whole_mass_matrix", "drives", "flat"):
        with pytest.raises(NoMechanismError):
            getattr(point, ask)


def test_a_measured_response_has_no_plant_and_is_charted(tmp_path):
    f = np.linspace(0.5, 499.0, 800)
    z = np.exp(2j * np.pi * f * 0.001)
    P = 5e-7 * (z + 1.0) / (z - 1.0) ** 2
    rows = "".join(f"{a!r},{b.real!r},{b.imag!r}\n" for a, b in zip(f.tolist(), P.tolist(), strict=True))
    (tmp_path / "sweep.csv").write_text("frequency_Hz,real_m_per_N,imag_m_per_N\n" + rows)
    (tmp_path / "d.toml").write_text(
        'name = "measured"\n[response]\nfile = "sweep.csv"\n[loop]\nsampling_period_s = 0.001\n'
    )
    point = load(tmp_path / "d.toml").at()
    with pytest.raises(OperatingPointError, match="measured response"):
        point.plant  # noqa: B018
    assert point.chart().stiffness_max == pytest.approx((12.0 - 8.0 * np.sqrt(2.0)) * 1e6, rel=1e-4)
    assert point.check(1e5, 100.0).names == ["stable"]


def test_an_operating_point_needs_no_device_and_no_file():
    mass = Plant.one_mass(0.1, damping=1.0)
    point = OperatingPoint(Controller(0.001), given_plant=mass)
    assert point.chart().stiffness_max == stability_chart(Loop(mass, Controller(0.001))).stiffness_max
    with pytest.raises(ValueError, match=r"exactly one .*got 0 "):
        OperatingPoint(Controller(0.001))
    with pytest.raises(ValueError, match=r"exactly one .*got 2 "):
        OperatingPoint(Controller(0.001), given_plant=mass, mechanism=load("five-bar").mechanism)
    with pytest.raises(ValueError, match="and directions"):
        OperatingPoint(Controller(0.001), mechanism=load("five-bar").mechanism)


# --- mistakes -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [{"position": (0.0, 0.1)}, {"direction": (1.0, 0.0)}, {"assembly": "a"}])
def test_circumstances_of_a_mechanism_do_not_apply_to_a_plant(device_with_operator, arguments):
    with pytest.raises(DeviceError, match=r"not .*\[plant\]"):
        device_with_operator.at(**arguments)


# --- another number -----------------------------------------------------------------------------------


def test_a_device_with_another_number_is_checked_like_a_file(device):
    slower = device.with_({"loop.sampling_period_s": 0.002})
    assert slower.controller.sampling_period == 0.002
    assert slower.mechanism is not device.mechanism
    assert device.controller.sampling_period == 0.00125
    with pytest.raises(DeviceError, match="sampling_period_s"):
        device.with_({"loop.sampling_period_s": -1.0})
    with pytest.raises(DeviceError, match=r"loop\.sampling_perod_s"):
        device.with_({"loop.sampling_perod_s": 0.001})
    with pytest.raises(TypeError, match=r"write \['loop.delay_samples=1'\]"):
        device.with_("loop.delay_samples=1")


def test_a_mechanism_that_can_no_longer_be_put_together_is_refused(device):
    name = device.mechanism.links.names[-1]
    with pytest.raises(DeviceError, match="cannot close"):
        device.with_({f"links.{name}.length_m": 10.0})
