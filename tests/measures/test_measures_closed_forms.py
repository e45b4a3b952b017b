"""The catalogue's closed forms and fidelity measures, asked of places: values, refusals and reasons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import zwidth
from tests.systems import mass, published, two_mass
from zwidth.chart import spectral_radius, stability_chart
from zwidth.errors import MeasureError
from zwidth.loop import Controller, FirstOrder, Loop, OperatingPoint, WindowedDifference
from zwidth.measures import (
    MEASURES,
    NO_VALUE,
    OK,
    OUT_OF_REACH,
    WantedWall,
    evaluate,
    optimal_mass,
    structural_distortion,
)
from zwidth.model import Operator

CLOSED = ("stiffness_max_closed_form", "damping_max_closed_form", "stable_area_closed_form")
OPTIMAL = ("optimal_spectral_radius", "optimal_motor_side_mass")
WANTED = WantedWall(3000.0, 15.0, 10.0)
POSITIONS = [
    [[0.0, 0.25, 0.0], [0.05, 0.2, 0.0]],
    [[-0.1, 0.22, 0.0], [0.9, 0.9, 0.0]],
]  # the last is out of reach


def five_bar(model="full"):
    return zwidth.load("five-bar").at(POSITIONS, model=model)


def point_of(plant, model=None, operator=None, **controller):
    return OperatingPoint(Controller(0.00125, **controller), given_plant=plant, model=model, operator=operator)


def measure_value(name, point, wanted=WANTED):
    return evaluate(MEASURES[name].at_wall(wanted), point)


def check_refusal(name, point, match, wanted=WANTED):
    with pytest.raises(MeasureError, match=match):
        measure_value(name, point, wanted)


# --- closed forms of the impedance range ---


@pytest.mark.parametrize("model", ["rigid", "motor-mass"])
def test_they_are_exact_for_the_device_without_damping(model):
    place = five_bar(model)
    found = [measure_value(name, place) for name in CLOSED]
    for index in ((0, 0), (0, 1), (1, 0)):
        plant = place[index].plant
        assert (plant.damping[0, 0] > 0.0) == (model == "motor-mass")
        chart = stability_chart(Loop(replace(plant, damping=0.0 * plant.damping), place.controller), decay=False)
        ours = [one.values[index] for one in found]
        assert_allclose(ours, [chart.stiffness_max, chart.damping_max, chart.stable_area], rtol=1e-7)
    for one in found:
        assert one.status.tolist() == [[OK, OK], [OK, OUT_OF_REACH]]
        assert one.notes == ()


@pytest.mark.parametrize("model", ["full", "two-mass"])
def test_other_models_have_none(model):
    for name in CLOSED:
        check_refusal(name, five_bar(model), "two models only; give model='rigid' or model='motor-mass'")
    check_refusal(CLOSED[0], point_of(two_mass(0.26, 0.0254, 15620.0)), "give model=")


def test_a_given_plant_is_seen_for_what_it_is():
    pair = two_mass(0.2616, 0.0254, 15620.0, 1.0)
    for plant, model, alike in (
        (mass(0.287, 1.0), None, mass(0.287)),
        (mass(0.0254, 1.0, 15620.0), None, mass(0.0254, 0.0, 15620.0)),
        (pair, "rigid", mass(0.287)),
        (pair, "motor-mass", mass(0.0254, 0.0, 15620.0)),
    ):
        chart = stability_chart(Loop(alike, Controller(0.00125)), decay=False)
        found = [float(measure_value(name, point_of(plant, model=model)).values) for name in CLOSED]
        assert_allclose(found, [chart.stiffness_max, chart.damping_max, chart.stable_area], rtol=1e-7)
    late = float(measure_value(CLOSED[0], point_of(mass(0.287), delay=2.0)).values)
    exact = stability_chart(Loop(mass(0.287), Controller(0.00125, 2.0)), decay=False).stiffness_max
    assert late == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"delay": 0.5}, "The delay is a whole number"),
        ({"velocity_filter": FirstOrder(0.001)}, "The velocity is not filtered"),
        ({"force_filter": FirstOrder(0.001)}, "The force is not filtered"),
        ({"velocity": WindowedDifference(2)}, "backward difference"),
        ({"actuator_time_constant": 0.001}, "The actuator follows at once"),
    ],
)
def test_whatever_else_breaks_an_assumption_is_refused(change, reason):
    mechanism = five_bar("rigid")
    for place in (
        point_of(mass(0.287), **change),
        replace(mechanism, controller=replace(mechanism.controller, **change)),
    ):
        for name in CLOSED:
            check_refusal(name, place, reason)


def test_what_only_one_of_them_refuses():
    motors = five_bar("motor-mass")
    check_refusal(CLOSED[0], replace(motors, controller=replace(motors.controller, delay=1.0)), "without delay")
    check_refusal(CLOSED[0], replace(motors, encoders="link"), "those of this device read the links")
    hand = Operator(0.8, 580.0, 5.5, 1e4, 5.0)
    check_refusal(CLOSED[0], replace(five_bar("rigid"), operator=hand), "operator='none'")
    check_refusal(CLOSED[0], point_of(replace(mass(0.287), sensor=np.array([-1.0]))), "where the encoder reads")
    assert (
        measure_value(CLOSED[0], replace(motors, operator=hand)).status[0, 0] == OK
    )  # the link side is held still anyhow


def test_where_no_wall_is_stable_they_say_why():
    place = point_of(mass(0.01, stiffness=15620.0))  # W = 1.562: just below pi/2, where there is one yet
    assert measure_value(CLOSED[0], place).status == OK
    place = point_of(mass(0.005, stiffness=15620.0))
    found = measure_value(CLOSED[0], place)
    assert found.status == NO_VALUE
    assert "positive stiffness" in found.notes[0].reason
    assert [float(measure_value(name, place).values) for name in CLOSED[1:]] == [0.0, 0.0]


def test_rigid_drives_have_no_spring():
    place = five_bar("motor-mass")
    drives = replace(place.drives, stiffness=np.full(2, np.inf))
    place = replace(place, mechanism=replace(place.mechanism, drives=drives))
    for name in (*CLOSED, *OPTIMAL):
        found = measure_value(name, place)
        assert found.status.tolist() == [[NO_VALUE, NO_VALUE], [NO_VALUE, OUT_OF_REACH]]
        assert found.notes[0].count == 3


# --- fidelity ---


def test_the_optimum_of_a_mechanism_takes_its_stiffness():
    place = five_bar()
    found = optimal_mass(3000.0, 15.0, place.effective.stiffness, place.controller.sampling_period)
    for name, values in zip(OPTIMAL, (found.spectral_radius, found.mass), strict=True):
        ours = measure_value(name, place)
        assert_allclose(ours.values, values)
        assert ours.status.tolist() == [[OK, OK], [OK, OUT_OF_REACH]]
        for model in ("rigid", "two-mass", "motor-mass"):
            assert_allclose(measure_value(name, five_bar(model)).values, values)
    little = measure_value(OPTIMAL[0], five_bar(), WantedWall(3000.0, 1.0))
    assert little.status[0, 0] == NO_VALUE
    assert "B > K T/2" in little.notes[0].reason


def test_the_optimum_of_a_given_plant():
    """Point B of the thesis, on the two-mass plant and on its motor side alone."""
    for plant in (published().plant, mass(0.0254, 1.9, 15620.0)):
        assert float(measure_value(OPTIMAL[0], point_of(plant)).values) == pytest.approx(0.895606, abs=5e-7)
        assert float(measure_value(OPTIMAL[1], point_of(plant)).values) == pytest.approx(0.0510576, abs=5e-8)
    check_refusal(OPTIMAL[0], point_of(mass(0.287)), "stiffness between motors and handle")
    check_refusal(OPTIMAL[0], point_of(published().plant, delay=1.0), "without delay")
    check_refusal(OPTIMAL[0], replace(five_bar(), encoders="link"), "those of this device read the links")


def test_the_radius_and_decay_of_any_loop():
    place = five_bar()
    radius, decay = measure_value("spectral_radius", place), measure_value("decay_time", place)
    for index in ((0, 0), (0, 1), (1, 0)):
        expected = float(spectral_radius(place[index].loop, 3000.0, 15.0))
        assert radius.values[index] == pytest.approx(expected, rel=1e-12)
        assert np.exp(-place.controller.sampling_period / decay.values[index]) == pytest.approx(
            expected, rel=1e-12
        )
    assert radius.status[1, 1] == decay.status[1, 1] == OUT_OF_REACH
    unstable = measure_value("decay_time", point_of(published().plant), WantedWall(20000.0, 10.0))
    assert unstable.status == NO_VALUE
    assert " is unstable " in unstable.notes[0].reason
    assert (
        float(measure_value("spectral_radius", point_of(published().plant), WantedWall(20000.0, 10.0)).values)
        > 1.0
    )


def test_felt_at_low_frequency_is_felt_at_rest():
    """K k/(K + k), and the mass in free motion, jw m."""
    slow = WantedWall(4000.0, 15.0, 0.01)
    place = point_of(published().plant)
    series = 4000.0 * 15620.0 / 19620.0
    assert float(measure_value("felt_stiffness", place, slow).values) == pytest.approx(series, rel=1e-5)
    assert float(measure_value("free_motion_force", place, slow).values) == pytest.approx(
        2.0 * np.pi * 0.01 * 0.287, rel=1e-5
    )
    unstable = WantedWall(20000.0, 10.0, 1.0)
    for name, wanted in (("felt_stiffness", unstable), ("decay_time", unstable)):
        found = measure_value(name, point_of(published().plant), wanted)
        assert found.status == NO_VALUE
        assert "unstable here" in found.notes[0].reason


def test_what_is_felt_and_deforms_is_the_device_without_the_hand():
    hand = Operator(0.8, 580.0, 5.5, 1e4, 5.0)
    for name in ("felt_stiffness", "free_motion_force", "structural_distortion"):
        alone, held = (
            float(measure_value(name, point_of(published().plant, operator=who)).values) for who in (None, hand)
        )
        assert alone == held
    assert (
        measure_value("spectral_radius", point_of(published().plant)).values
        != measure_value("spectral_radius", point_of(published().plant, operator=hand)).values
    )


def test_the_distortion_of_a_place():
    place = five_bar()
    found = measure_value("structural_distortion", place)
    assert found.values[0, 1] == structural_distortion(place[0, 1].plant, 10.0)
    assert float(measure_value("structural_distortion", five_bar("rigid")[0, 0]).values) == 0.0


@pytest.mark.parametrize("name", [*OPTIMAL, "spectral_radius", "decay_time", "felt_stiffness"])
def test_a_wall_has_to_be_told(name):
    for wanted in (WantedWall(frequency=1.0), WantedWall(100.0, None, 1.0), WantedWall(None, 1.0, 1.0)):
        check_refusal(name, five_bar(), "needs a wanted wall; give stiffness and damping", wanted)


@pytest.mark.parametrize("name", ["felt_stiffness", "free_motion_force", "structural_distortion"])
def test_a_frequency_has_to_be_told_and_a_handle_to_be_there(name):
    check_refusal(name, five_bar(), "needs a frequency .* give frequency", WantedWall(100.0, 1.0))
    check_refusal(name, five_bar(), "above 0 Hz", WantedWall(100.0, 1.0, -1.0))
    check_refusal(name, five_bar("motor-mass"), "needs a handle, and the model motor-mass has none")
    check_refusal(
        name, point_of(replace(published().plant, handle=None)), "needs a handle, and the device has none"
    )


def test_only_below_half_the_sampling_frequency_a_wall_is_felt():
    check_refusal(
        "felt_stiffness", five_bar(), "below half the sampling frequency, 400 Hz", WantedWall(100.0, 1.0, 400.0)
    )
