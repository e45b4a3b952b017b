"""Force sensor, feedforward and local loop in a device file: what is built, refused, set and swept."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import zwidth
from zwidth.errors import OperatingPointError
from zwidth.loop import (
    BackwardDifference,
    Butterworth,
    Feedforward,
    FirstOrder,
    ForceSensor,
    Kalman,
    LocalLoop,
    Loop,
    WindowedDifference,
)

LOW_PASS = {"type": "butterworth", "order": 2, "cutoff_Hz": 50.0}
SLOW = {"type": "first-order", "time_constant_s": 0.002}
LEVANT = {"method": "levant", "acceleration_max_m_per_s2": 9.0}
NO_FILTER = {"type": "first-order", "time_constant_s": 0.0}
PLANT = {
    "mass_kg": [[0.26, 0.0], [0.0, 0.025]],
    "damping_Ns_per_m": [[1.9, -1.9], [-1.9, 1.9]],
    "stiffness_N_per_m": [[15620.0, -15620.0], [-15620.0, 15620.0]],
    "actuator": [0.0, 1.0],
    "sensor": [0.0, 1.0],
    "handle": [1.0, 0.0],
}


def document(plant=PLANT, **loop):
    return {"name": "paddle", "plant": deepcopy(plant), "loop": {"sampling_period_s": 0.001, **deepcopy(loop)}}


def controller(**loop):
    return zwidth.from_document(document(**loop)).controller


def test_keys_become_the_parts_of_the_controller():
    own = controller(
        force_sensor={
            "gain": 0.5,
            "law": "force-error",
            "filter": LOW_PASS,
            "delay_samples": 2,
            "mass_beyond_kg": 0.05,
        },
        feedforward={
            "inertia_kg": 0.1,
            "acceleration_filter": LOW_PASS,
            "damping_Ns_per_m": 0.3,
            "coulomb_N": 0.2,
            "deadband_m_per_s": 0.01,
            "velocity": {
                "method": "windowed-difference",
                "samples": 4,
                "filter": {"type": "first-order", "time_constant_s": 0.002},
            },
        },
        local={
            "rate_multiple": 8,
            "stiffness_N_per_m": -100.0,
            "damping_Ns_per_m": 2.0,
            "delay_samples": 0.5,
            "velocity": {"filter": {"type": "butterworth", "order": 2, "cutoff_Hz": 2000.0}},
        },
    )
    assert own.force_sensor == ForceSensor(0.5, Butterworth(2, 50.0), 2, 0.05, "force-error")
    assert own.feedforward == Feedforward(
        0.1, 0.3, 0.2, 0.01, WindowedDifference(4), FirstOrder(0.002), Butterworth(2, 50.0)
    )
    assert own.local_loop == LocalLoop(8, -100.0, 2.0, BackwardDifference(), Butterworth(2, 2000.0), 0.5)


def test_what_is_left_out_is_none_or_as_the_page_says():
    assert controller().fixed_feedback == ()
    assert controller(force_sensor={"gain": 0.0}).fixed_feedback == ()
    assert controller(force_sensor={"gain": 0.5}).force_sensor == ForceSensor(0.5)
    own = controller(feedforward={"inertia_share": 0.4, "acceleration_filter": NO_FILTER}).feedforward
    assert own == Feedforward(inertia_share=0.4)
    assert controller(local={"rate_multiple": 4}).local_loop == LocalLoop(4)


def test_a_kalman_filter_of_the_feedback_takes_the_encoders_step_and_its_own_rate():
    kalman = {"method": "kalman", "acceleration_noise_m_per_s2": 20.0}
    own = controller(
        encoder={"resolution_m": 1e-5}, local={"rate_multiple": 10, "damping_Ns_per_m": 1.0, "velocity": kalman}
    )
    assert isinstance(own.local_loop.velocity, Kalman)
    assert own.local_loop.velocity.position_noise == pytest.approx(1e-5 / np.sqrt(12.0))


def test_setting_one_of_two_exclusive_keys_drops_the_other():
    device = zwidth.from_document(document(feedforward={"inertia_kg": 0.1, "acceleration_filter": LOW_PASS}))
    shared = device.with_({"loop.feedforward.inertia_share": 0.3})
    assert shared.controller.feedforward == Feedforward(
        inertia_share=0.3, acceleration_filter=Butterworth(2, 50.0)
    )
    first = device.with_({"loop.feedforward.acceleration_filter.time_constant_s": 0.01})
    assert first.controller.feedforward.acceleration_filter == FirstOrder(0.01)
    assert device.with_({"loop.force_sensor.gain": 0.4}).controller.force_sensor == ForceSensor(0.4)


def test_a_share_of_the_rigid_mass_is_that_at_the_posture_and_along_the_direction():
    shared = {"loop.feedforward": {"inertia_share": 0.5, "acceleration_filter": LOW_PASS | {"cutoff_Hz": 30.0}}}
    device = zwidth.load("five-bar", shared)
    for position, direction in (((0.0, 0.25), (0.0, 1.0)), ((0.05, 0.2), (1.0, 0.0))):
        point = device.at(position, direction)
        rigid = float(point.effective.rigid_mass)
        assert point.loop.controller.feedforward.inertia == pytest.approx(0.5 * rigid)
        kilograms = point.loop.controller.feedforward
        stated = replace(zwidth.load("five-bar").controller, feedforward=kilograms)
        assert Loop(point.plant, stated).chart(decay=False).stiffness_max == point.chart(decay=False).stiffness_max
    assert device.at().bounds().exact == pytest.approx(device.at().chart(decay=False).stiffness_max)
    around = device.at().by_direction(count=4)
    alone = [device.at(None, unit).chart(decay=False).stiffness_max for unit in around.directions[:2]]
    assert around.stiffness[:2] == pytest.approx(alone)


def test_a_share_needs_a_rigid_mass():
    grounded = PLANT | {"stiffness_N_per_m": [[16000.0, -15620.0], [-15620.0, 15620.0]]}
    device = zwidth.from_document(
        document(grounded, feedforward={"inertia_share": 0.5, "acceleration_filter": LOW_PASS})
    )
    with pytest.raises(OperatingPointError, match=r"spring .*feedforward.inertia_kg"):
        device.at().chart()


SWEPT = [
    ("loop.force_sensor.gain", [0.0, 0.3, 0.9], {"force_sensor": {"gain": 0.5, "filter": LOW_PASS}}),
    ("loop.force_sensor.mass_beyond_kg", [0.0, 0.1, 0.2], {"force_sensor": {"gain": 0.5}}),
    (
        "loop.feedforward.inertia_share",
        [0.0, 0.2, 0.4],
        {"feedforward": {"inertia_share": 0.1, "acceleration_filter": LOW_PASS | {"cutoff_Hz": 20.0}}},
    ),
    ("loop.feedforward.damping_Ns_per_m", [0.0, 0.2, 0.4], {"feedforward": {"damping_Ns_per_m": 0.1}}),
    ("loop.local.damping_Ns_per_m", [0.0, 1.0, 2.0], {"local": {"rate_multiple": 10, "damping_Ns_per_m": 1.0}}),
    ("loop.local.rate_multiple", [1, 2, 10], {"local": {"rate_multiple": 10, "damping_Ns_per_m": 1.0}}),
    ("loop.sampling_period_s", [0.0005, 0.001], {"local": {"rate_multiple": 10, "damping_Ns_per_m": 1.0}}),
]


@pytest.mark.parametrize(("path", "values", "loop"), SWEPT)
def test_a_sweep_gives_what_each_device_gives_alone(path, values, loop):
    device = zwidth.from_document(document(**loop))
    swept = zwidth.sweep(device, {path: values}, ["stiffness_max", "stable_area"])
    for k, value in enumerate(values):
        chart = device.with_({path: value}).at().chart(decay=False)
        assert float(swept.stiffness_max[k]) == pytest.approx(chart.stiffness_max, rel=1e-9)
        assert float(swept.stable_area[k]) == pytest.approx(chart.stable_area, rel=1e-8)
    assert len(np.unique(swept.stiffness_max)) > 1


def test_a_map_has_the_feedback_in_every_cell():
    shared = {"inertia_share": 0.5, "acceleration_filter": LOW_PASS | {"cutoff_Hz": 30.0}}
    device = zwidth.load("five-bar", {"loop.feedforward": shared})
    point = device.at(np.array([[0.0, 0.25], [0.04, 0.22], [-0.05, 0.2]]))
    values = point.measure("stiffness_max").values
    for k, one in enumerate(values):
        assert one == pytest.approx(point[k].chart(decay=False).stiffness_max, rel=1e-9)
    plain = zwidth.load("five-bar").at(np.array([[0.0, 0.25], [0.04, 0.22], [-0.05, 0.2]]))
    assert not np.allclose(plain.measure("stiffness_max").values, values, rtol=1e-3)


def test_coulomb_feedforward_is_said_to_be_left_out():
    device = zwidth.from_document(document(feedforward={"coulomb_N": 0.2, "deadband_m_per_s": 0.01}))
    assert device.linear_omissions == ("Coulomb feedforward",)
    plain = zwidth.from_document(document())
    assert device.at().chart(decay=False).stiffness_max == plain.at().chart(decay=False).stiffness_max
