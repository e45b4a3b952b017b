"""A hand in newtons per metre holds nothing about an axis, and feedback there is told in N m s/rad."""

from __future__ import annotations

from dataclasses import replace

import pytest

from zwidth.device import from_document
from zwidth.errors import DeviceError, OperatorError
from zwidth.loop.controller import describe_feedback, feedback_name
from zwidth.model import Operator
from zwidth.show import computer_text, speaking_of_moments
from zwidth.show.app.layers import _touch
from zwidth.study import Family, robust_study

HAND = {"arm_mass_kg": 0.5, "arm_stiffness_N_per_m": 300.0, "arm_damping_Ns_per_m": 4.0, "grasp": "rigid"}


def knob(**more):
    mechanism = {
        "links": [
            {
                "name": "knob",
                "joint": "revolute",
                "length_m": 0.1,
                "mass_kg": 0.5,
                "inertia_kg_m2": 0.002,
                "joint_damping_Nms_per_rad": 0.01,
            }
        ],
        "handle": {"link": "knob", "controls": "orientation"},
        "assemblies": {"only": {"joints_rad": {"knob": 0.0}}},
        "reference": {"axis": [0, 0, 1]},
        "drives": [{"name": "motor", "joint": "knob", "motor_inertia_kg_m2": 1e-3, "transmission_ratio": 1}],
    }
    loop = {"sampling_period_s": 0.002, "local": {"rate_multiple": 5, "damping_Ns_per_m": 0.2}}
    return from_document({"name": "knob", "mechanism": mechanism, "loop": loop} | more)


@pytest.mark.parametrize("operator", ["thesis-arm", "thesis-arm-rigid", "course-hand", Operator(0.1, 20.0, 1.0)])
def test_a_hand_about_an_axis_is_refused(operator):
    with pytest.raises(DeviceError) as refused:
        knob().at(operator=operator)
    assert [fault.key for fault in refused.value.faults] == ["operator"]
    with pytest.raises(DeviceError):
        knob().held_by(operator).at()


def test_the_files_own_hand_is_refused_until_it_is_left_out():
    device = knob(operator=HAND)
    with pytest.raises(DeviceError):
        device.chart()
    assert device.at(operator="none").turns


def test_a_point_that_is_changed_afterwards_is_refused_too():
    with pytest.raises(OperatorError):
        replace(knob().at(), operator=Operator(0.1, 20.0, 1.0))


def test_robust_charts_and_the_mouse_refuse_it():
    device = knob()
    with pytest.raises(DeviceError) as refused:
        robust_study(Family(device, (), ("none", "thesis-arm"), device.at()))
    assert [(fault.file, fault.key) for fault in refused.value.faults] == [("thesis-arm", "operator")]
    Family(device, (), ("none",), device.at()).check_operators()
    with pytest.raises(ValueError, match="N m/rad"):
        _touch(device.at(), None, None, None)


def test_feedback_about_an_axis_has_the_units_of_moments():
    controller = knob().controller
    assert "N m s/rad" in describe_feedback(controller.local_loop, moments=True)
    assert "N s/m" in describe_feedback(controller.local_loop)
    assert not any(unit in feedback_name(controller.local_loop) for unit in ("N s/m", "rad"))
    with speaking_of_moments(True):
        assert "N m s/rad" in computer_text(controller)
    assert "N s/m" in computer_text(controller)
