"""What is said of legs, beams, feedback and questions of a device that cannot be meant."""

from __future__ import annotations

import math
from copy import deepcopy

import pytest

import zwidth
from tests.device.device_cases import faults
from tests.device.test_device_beams import stiff_arm, warned
from tests.device.test_device_feedback import LOW_PASS, PLANT, controller, document
from tests.device.test_device_legs import DELTA
from tests.model.beam_devices import spatial_loop, tube
from zwidth.device.load import load
from zwidth.errors import DeviceError
from zwidth.show import computer_text

# --- legs written once: the same mechanism as written out, faults where the leg is written -----------


def in_leg(group, number, **changes):
    document = deepcopy(DELTA)
    document["mechanism"]["legs"][0][group][number] |= changes
    return document


@pytest.mark.parametrize(
    ("document", "key", "words"),
    [
        (in_leg("links", 1, parent="amr"), "mechanism.legs.leg.links.rod-left.parent", "'amr' is not a link"),
        (in_leg("links", 0, mass_kg=-1.0), "mechanism.legs.leg.links.arm.mass_kg", "at least 0"),
        (
            in_leg("loops", 0, links=["rod-left", "plate"]),
            "mechanism.legs.leg.loops.ball-left.links.1",
            "not a link",
        ),
        (in_leg("drives", 0, joint="rod-left"), "mechanism.legs.leg.drives.motor.joint", "has a universal joint"),
        (in_leg("links", 0, limits_m=[0, 1]), "mechanism.legs.leg.links.arm.limits_m", "is of a prismatic joint"),
        (
            in_leg("links", 0, second_axis=[1, 0, 0]),
            "mechanism.legs.leg.links.arm.second_axis",
            "a universal joint",
        ),
        (in_leg("loops", 0, axes=[[0, 0, 1]] * 2), "mechanism.legs.leg.loops.ball-left.axes", 'closes = "axis"'),
        (
            in_leg("loops", 1, points_m=[[0.16, 0, 0], [0.9, 0, 0]]),
            "mechanism.legs.leg.loops.ball-",
            "cannot close: its two points stay at least",
        ),
        (
            in_leg("links", 1, joint="spherical", second_axis=None),
            "mechanism.legs.leg.links.rod-left.second_axis",
            "",
        ),
    ],
)
def test_a_fault_is_reported_where_the_leg_is_written(document, key, words):
    found = faults(document)
    assert any(fault.key.startswith(key) and words in fault.message for fault in found), [str(f) for f in found]
    assert len({str(fault) for fault in found}) == len(found)


# --- force sensor, feedforward and local loop in a device file: what is built, refused, set ----------


def feedback_faults(**loop):
    """Path and sentence of each fault."""
    with pytest.raises(DeviceError) as error:
        zwidth.from_document(document(**loop))
    return {fault.key: fault.message for fault in error.value.faults}


REFUSED = [
    ({"force_sensor": {"gain": -1.0}}, "loop.force_sensor.gain", "must be greater than -1, got -1"),
    ({"force_sensor": {}}, "loop.force_sensor.gain", "is missing"),
    ({"force_sensor": {"gain": 1.0, "law": "pid"}}, "loop.force_sensor.law", "force-error"),
    ({"force_sensor": {"gain": 1.0, "delay_samples": 1.5}}, "loop.force_sensor.delay_samples", "whole number"),
    (
        {"force_sensor": {"gain": 1.0, "filter": LOW_PASS | {"cutoff_Hz": 500.0}}},
        "loop.force_sensor.filter.cutoff_Hz",
        "below half the sampling frequency, 500 Hz, got 500",
    ),
    ({"feedforward": {}}, "loop.feedforward", "cancels nothing; give inertia_kg"),
    (
        {"feedforward": {"inertia_kg": 0.1}},
        "loop.feedforward.acceleration_filter",
        "is missing; inertia_kg needs one",
    ),
    (
        {"feedforward": {"inertia_kg": 0.1, "inertia_share": 0.4, "acceleration_filter": LOW_PASS}},
        "loop.feedforward.inertia_share",
        "stands beside inertia_kg",
    ),
    (
        {"feedforward": {"damping_Ns_per_m": 1.0, "acceleration_filter": LOW_PASS}},
        "loop.feedforward.acceleration_filter",
        "is used only with an inertia",
    ),
    (
        {"feedforward": {"damping_Ns_per_m": 1.0, "deadband_m_per_s": 0.01}},
        "loop.feedforward.deadband_m_per_s",
        "is used only with coulomb_N",
    ),
    (
        {
            "feedforward": {
                "damping_Ns_per_m": 1.0,
                "velocity": {"method": "levant", "acceleration_max_m_per_s2": 9.0},
            }
        },
        "loop.feedforward.velocity.method",
        "must be linear, got the text 'levant'",
    ),
    ({"local": {"rate_multiple": 2.5}}, "loop.local.rate_multiple", "must be a whole number, got 2.5"),
    ({"local": {"rate_multiple": 0}}, "loop.local.rate_multiple", "must be at least 1"),
    ({"local": {}}, "loop.local.rate_multiple", "is missing"),
    (
        {"local": {"rate_multiple": 4, "velocity": {"filter": LOW_PASS | {"cutoff_Hz": 2500.0}}}},
        "loop.local.velocity.filter.cutoff_Hz",
        "below half the sampling frequency, 2000 Hz, got 2500",
    ),
    (
        {"local": {"rate_multiple": 4, "velocity": {"method": "kalman", "acceleration_noise_m_per_s2": 2.0}}},
        "loop.local.velocity.position_noise_m",
        "is missing",
    ),
    ({"local": {"rate_multiple": 4, "gain": 1.0}}, "loop.local.gain", "is not a key"),
]


@pytest.mark.parametrize(("loop", "path", "sentence"), REFUSED)
def test_what_makes_no_sense_is_refused_in_one_line(loop, path, sentence):
    found = feedback_faults(**loop)
    assert list(found) == [path]
    assert sentence in found[path]
    assert "\n" not in found[path]


def test_a_sensor_needs_a_handle_and_feedback_a_model_with_motion_in_time():
    bare = {key: value for key, value in PLANT.items() if key != "handle"}
    with pytest.raises(DeviceError, match=r"needs a handle, where the sensor sits; give plant.handle, 2 numbers"):
        zwidth.from_document(document(bare, force_sensor={"gain": 0.5}))
    lossy = PLANT | {"loss_factor": 0.02}
    with pytest.raises(DeviceError, match=r"cannot stand beside plant.loss_factor"):
        zwidth.from_document(document(lossy, local={"rate_multiple": 4, "damping_Ns_per_m": 1.0}))
    given = {
        "name": "m",
        "response": {"file": "s.csv"},
        "loop": document(feedforward={"damping_Ns_per_m": 1.0})["loop"],
    }
    with pytest.raises(DeviceError, match="needs a model of the device, and a"):
        zwidth.from_document(given)


def test_headings_name_what_is_in_the_loop():
    text = computer_text(
        controller(
            force_sensor={"gain": 0.5},
            feedforward={"inertia_share": 0.4, "acceleration_filter": LOW_PASS},
            local={"rate_multiple": 10, "damping_Ns_per_m": 2.0},
        )
    )
    assert text.endswith(
        "with force feedback (gain 0.5), with feedforward of 0.4 of the rigid mass, with a local loop at 10 times "
        "the rate (2 N s/m)"
    )


# --- [mechanism.links.beam]: what is wrong in it, what looks wrong, and every question to a ----------


@pytest.mark.parametrize("joint", ["spherical", "universal", "free"])
def test_a_beam_hangs_on_one_joint_coordinate(joint):
    document = spatial_loop()
    document["mechanism"]["links"][1] |= {"joint": joint, "beam": tube(8, 1)}
    found = [fault for fault in faults(document) if fault.key == "mechanism.links.coupler.beam"]
    assert [fault.message.partition(";")[0] for fault in found] == [
        f"does not go with a {joint} joint at the link's base"
    ]


def test_a_link_that_is_as_good_as_rigid_is_named():
    """From ten times half the sampling rate on; below it is as it is meant."""
    (message,) = warned(stiff_arm(10.2)).values()
    assert "bends first at 5100 Hz with all that it carries, 10.2 times half the sampling rate (500 Hz)" in message
    assert message.endswith("it is as good as rigid; leave it out")
    assert warned(stiff_arm(9.8)) == {}


# --- the bundled devices, and what a loaded device gives: arrays, postures, plants -------------------


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"direction": [0, 0]}, "direction: has zero length"),
        ({"direction": [0, 0, 0]}, "direction: has zero length"),
        ({"direction": [1]}, "direction: must be 2 or 3 numbers x, y or x, y, z, got 1"),
        ({"direction": [1, 2, 3, 4]}, "direction: must be 2 or 3 numbers"),
        ({"direction": [math.nan, 1]}, "direction: must be finite, got the list [nan, 1]"),
        ({"direction": [math.inf, 1]}, "direction: must be finite"),
        ({"direction": "up"}, "direction: must be 2 or 3 numbers, got the text 'up'"),
        ({"position": 3}, "at: must be 2 or 3 numbers, got 3"),
        ({"position": [0.1, math.nan]}, "at: must be finite"),
        (
            {"assembly": "elbows-outt"},
            "assembly: 'elbows-outt' is not an assembly of this device; did you mean 'elbows-out'?",
        ),
        ({"model": "stiff"}, "model: must be one of full, two-mass, motor-mass, rigid, got the text 'stiff'"),
    ],
)
def test_what_cannot_be_meant_is_told(asked, words):
    with pytest.raises(DeviceError) as caught:
        load("five-bar").at(**asked)
    assert str(caught.value) == f"five-bar: {words}" or words in str(caught.value)
