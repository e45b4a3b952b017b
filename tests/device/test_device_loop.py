"""What the computer, its amplifier and its encoder do, from the file to the loop."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests.device.device_cases import ARM_FILE, PLANT_FILE, REMOVED, with_changes
from tests.systems import reference_transition_matrix
from zwidth.chart import eigenvalues
from zwidth.device import address, from_document
from zwidth.device.schema import device_file as schema
from zwidth.loop import (
    METHODS,
    AlphaBeta,
    BackwardDifference,
    Butterworth,
    CentralDifference,
    Controller,
    FirstOrder,
    Foaw,
    Kalman,
    LeastSquaresSlope,
    Levant,
    Loop,
    SavitzkyGolay,
    WindowedDifference,
)
from zwidth.model import LaggedDamper, Operator, attach

NO_FILTER = {"loop__velocity__filter": REMOVED}
VELOCITIES = {
    "backward-difference": ({}, BackwardDifference()),
    "windowed-difference": ({"samples": 4}, WindowedDifference(4)),
    "least-squares-slope": ({"samples": 5}, LeastSquaresSlope(5)),
    "central-difference": ({}, CentralDifference()),
    "savitzky-golay": ({"samples": 7, "order": 2, "centred": True}, SavitzkyGolay(7, 2, True)),
    "alpha-beta": ({"alpha": 0.4, "beta": 0.1}, AlphaBeta(0.4, 0.1)),
    "kalman": ({"acceleration_noise_m_per_s2": 10.0, "position_noise_m": 3e-6}, Kalman(10.0, 3e-6)),
    "foaw": ({"samples": 9, "position_noise_m": 3e-6, "fit": "best-fit"}, Foaw(9, 3e-6, "best-fit")),
    "levant": ({"acceleration_max_m_per_s2": 10.0}, Levant(10.0)),
}


def with_velocity(method, **own):
    return with_changes(PLANT_FILE, loop__velocity={"method": method, **own})


def test_every_method_there_is_can_be_written():
    assert set(VELOCITIES) == set(METHODS)


@pytest.mark.parametrize("method", VELOCITIES)
def test_a_method_of_the_file_is_the_estimator(method):
    own, estimator = VELOCITIES[method]
    assert from_document(with_velocity(method, **own)).controller.velocity == estimator


def test_a_kalman_filter_takes_its_noise_from_the_encoder():
    document = with_velocity("kalman", acceleration_noise_m_per_s2=10.0)
    document["loop"]["encoder"] = {"resolution_m": 1e-5}
    assert from_document(document).controller.velocity == Kalman.of_encoder(10.0, 1e-5)


def test_an_adaptive_window_takes_half_a_step_of_the_encoder():
    document = with_velocity("foaw", samples=9)
    document["loop"]["encoder"] = {"resolution_m": 1e-5}
    assert from_document(document).controller.velocity == Foaw(9, 0.5e-5)
    document["loop"]["velocity"]["position_noise_m"] = 1e-5
    assert from_document(document).controller.velocity == Foaw(9, 1e-5)


# what is put into the file of the two masses, and the plant and controller that it stands for
BARE = from_document(with_changes(PLANT_FILE))
OPERATOR = {
    "arm_mass_kg": 0.8,
    "arm_stiffness_N_per_m": 580.0,
    "arm_damping_Ns_per_m": 5.5,
    "grasp_stiffness_N_per_m": 1e4,
    "grasp_damping_Ns_per_m": 5.0,
}
MOTOR = {"force_constant_N_per_A": 2.0, "resistance_ohm": 5.0}
FEATURES = {
    "force filter": (
        {"loop__force": {"filter": {"type": "first-order", "time_constant_s": 0.002}}},
        lambda p: p,
        lambda c: replace(c, force_filter=FirstOrder(0.002)),
    ),
    "butterworth on the force": (
        {"loop__force": {"filter": {"type": "butterworth", "order": 3, "cutoff_Hz": 200.0}}},
        lambda p: p,
        lambda c: replace(c, force_filter=Butterworth(3, 200.0)),
    ),
    "lag": (
        {"loop__actuator": {"time_constant_s": 0.0005}},
        lambda p: p,
        lambda c: replace(c, actuator_time_constant=0.0005),
    ),
    "sensor on the link": (
        {"plant__sensor": [1.0, 0.0]},
        lambda p: replace(p, sensor=np.array([1.0, 0.0])),
        lambda c: c,
    ),
    "shorted winding": (
        {"plant__electrical_damping": [MOTOR]},
        lambda p: replace(p, damping=p.damping + np.diag([0.0, 0.8])),
        lambda c: c,
    ),
    "winding with inductance, elsewhere": (
        {"plant__electrical_damping": [MOTOR | {"inductance_H": 0.01, "along": [1.0, -2.0]}]},
        lambda p: replace(p, lagged_dampers=(LaggedDamper(np.array([1.0, -2.0]), 0.8, 0.002),)),
        lambda c: c,
    ),
    "operator": (
        {"operator": OPERATOR, "plant__handle": [1.0, 0.0]},
        lambda p: attach(replace(p, handle=np.array([1.0, 0.0])), Operator(0.8, 580.0, 5.5, 1e4, 5.0)),
        lambda c: c,
    ),
    "rigid grasp": (
        {"operator": {"arm_mass_kg": 0.5, "grasp": "rigid"}, "plant__handle": [1.0, 0.0]},
        lambda p: replace(p, mass=p.mass + np.diag([0.5, 0.0])),
        lambda c: c,
    ),
}


@pytest.mark.parametrize("feature", FEATURES)
def test_a_feature_of_the_file_is_the_loop_built_by_hand(feature):
    """And its eigenvalues are those of a matrix built from nothing but the differential equations."""
    changes, plant, controller = FEATURES[feature]
    device = from_document(with_changes(PLANT_FILE, **changes))
    ours = device.at().loop
    bare = Controller(0.001, 0.5, Butterworth(2, 20.0))
    theirs = Loop(plant(BARE.at().plant), controller(bare))
    for K, B in ((800.0, 3.0), (-200.0, 12.0)):
        assert ours.transition_matrix(K, B) == pytest.approx(theirs.transition_matrix(K, B), rel=1e-12, abs=1e-13)
        found = np.max(np.abs(eigenvalues(ours, K, B)))
        assert found == pytest.approx(
            np.max(np.abs(np.linalg.eigvals(reference_transition_matrix(ours, K, B)))), abs=2e-7
        )


def test_a_first_order_force_filter_without_time_constant_is_none():
    document = with_changes(PLANT_FILE, loop__force={"filter": {"type": "first-order", "time_constant_s": 0.0}})
    assert from_document(document).controller.force_filter is None


WINDING = {"torque_constant_Nm_per_A": 0.05, "winding_resistance_ohm": 2.0, "damping_resistance_ohm": 0.5}


def arm(**drive):
    document = with_changes(ARM_FILE)
    document["mechanism"]["drives"][0] |= drive
    return document


def test_a_drives_winding_brakes_its_motor():
    """n^2 k^2/R at the joint, lagging by L/R, on the motor of the flexible drive."""
    plant = from_document(arm(**WINDING, winding_inductance_H=0.005)).at().plant
    (damper,) = plant.lagged_dampers
    assert damper.damping == pytest.approx(100.0 * 0.05**2 / 2.5)
    assert damper.time_constant == pytest.approx(0.002)
    assert dict(zip(plant.names, damper.along, strict=True)) == {
        "shoulder link": 0.0,
        "elbow link": 0.0,
        "shoulder motor": 1.0,  # the elbow's drive is rigid
    }
    plain = from_document(arm()).at().plant
    without = from_document(arm(**WINDING)).at().plant
    assert without.lagged_dampers == ()
    assert without.damping - plain.damping == pytest.approx(np.diag([0.0, 0.0, 0.1]))


def test_a_rigid_drives_winding_brakes_its_link():
    plant = from_document(arm(**WINDING, stiffness_Nm_per_rad=np.inf)).at().plant
    plain = from_document(arm(stiffness_Nm_per_rad=np.inf)).at().plant
    assert plant.damping - plain.damping == pytest.approx(np.diag([0.1, 0.0]))


@pytest.mark.parametrize("at", ["link", "handle"])
def test_encoders_on_the_links_read_the_handle(at):
    device = from_document(with_changes(ARM_FILE, loop__encoder={"at": at}))
    plant = device.at().plant
    assert plant.sensor == pytest.approx(plant.handle)
    assert device.at(model="two-mass").plant.sensor.tolist() == [1.0, 0.0]
    motor = from_document(with_changes(ARM_FILE, loop__encoder={"at": "motor"})).at().plant
    assert motor.sensor == pytest.approx(motor.actuator)


def test_setting_a_method_drops_what_it_does_not_read():
    document = address.apply(
        with_velocity("kalman", **VELOCITIES["kalman"][0]), ["loop.velocity.method=alpha-beta"]
    )
    assert document["loop"]["velocity"] == {"method": "alpha-beta"}
    settings = ["loop.velocity.method=windowed-difference", "loop.velocity.samples=4"]
    document = address.apply(document, settings)
    assert from_document(document).controller.velocity == WindowedDifference(4)
    kept = address.apply(document, ["loop.velocity.method=least-squares-slope"])
    assert from_document(kept).controller.velocity == LeastSquaresSlope(4)


def test_setting_a_key_of_the_other_force_filter_makes_it_that_filter():
    document = address.apply(with_changes(PLANT_FILE), ["loop.force.filter.type=first-order"])
    document = address.apply(document, ["loop.force.filter.time_constant_s=0.01"])
    assert from_document(document).controller.force_filter == FirstOrder(0.01)
    document = address.apply(document, ["loop.force.filter.cutoff_Hz=30", "loop.force.filter.order=2"])
    assert from_document(document).controller.force_filter == Butterworth(2, 30.0)


EVERYTHING = """
name = "everything"
[plant]
mass_kg = [[0.3, 0.0], [0.0, 0.02]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
handle = [1.0, 0.0]
[[plant.electrical_damping]]
name = "motor"
force_constant_N_per_A = 2.0
resistance_ohm = 5.0
inductance_H = 0.001
along = [0.0, 1.0]
[loop]
sampling_period_s = 0.001
[loop.velocity]
method = "kalman"
acceleration_noise_m_per_s2 = 10.0
[loop.force]
filter = { type = "first-order", time_constant_s = 0.0001 }
[loop.actuator]
time_constant_s = 0.0002
[loop.encoder]
resolution_m = 1e-5
[operator]
arm_mass_kg = 0.8
arm_stiffness_N_per_m = 580.0
arm_damping_Ns_per_m = 5.5
grasp_stiffness_N_per_m = 10000.0
grasp_damping_Ns_per_m = 5.0
"""


def test_every_number_can_be_addressed_and_has_a_unit():
    document = tomllib.loads(EVERYTHING)
    paths = address.numeric_addresses(document)
    new = {
        "plant.electrical_damping.motor.force_constant_N_per_A",
        "plant.electrical_damping.motor.resistance_ohm",
        "plant.electrical_damping.motor.inductance_H",
        "plant.electrical_damping.motor.along.1",
        "loop.velocity.acceleration_noise_m_per_s2",
        "loop.force.filter.time_constant_s",
        "loop.actuator.time_constant_s",
        "loop.encoder.resolution_m",
        *(f"operator.{key}" for key in OPERATOR),
    }
    assert new <= paths.keys()
    for path in new:
        doubled = from_document(address.apply(document, [(path, 2.0 * (paths[path] or 1.0))]))
        assert address.get(doubled.document, path) == 2.0 * (paths[path] or 1.0)
        steps = address.resolve(document, path)
        said = schema.key_description(steps if isinstance(steps[-1], str) else steps[:-1])
        assert said.endswith("]") or "along" in steps
