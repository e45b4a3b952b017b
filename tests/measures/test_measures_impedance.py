"""The exact impedance measures: many places at once are the places alone, and each is the chart's own number."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.chart import largest_stiffness, stability_chart
from zwidth.device.load import load
from zwidth.loop import Loop
from zwidth.measures import MEASURES, NO_VALUE, OK, OUT_OF_REACH, evaluate, find_measure, impedance_range

AT = np.array([[[0.0, 0.25, 0.0], [0.08, 0.2, 0.0]], [[-0.12, 0.22, 0.0], [0.9, 0.9, 0.0]]])
SETTINGS = (
    (),
    ("loop.delay_samples=1.4",),
    ("loop.velocity.filter.type=butterworth", "loop.velocity.filter.order=2", "loop.velocity.filter.cutoff_Hz=20"),
    ("mechanism.damping.mode_ratio=0.0",),
    ("mechanism.damping.mode_ratio=1.2", "loop.sampling_period_s=0.0002"),
    ("loop.actuator.time_constant_s=0.001",),
    ("loop.velocity.method=windowed-difference", "loop.velocity.samples=4"),
    ("loop.encoder.at=link",),
)


CASES = [("full", settings) for settings in SETTINGS]
CASES += [(model, settings) for model in ("two-mass", "motor-mass", "rigid") for settings in SETTINGS[:2]]


@pytest.mark.parametrize(("model", "settings"), CASES, ids=str)
def test_the_largest_stiffness_of_many_places_is_each_chart_s_own(model, settings):
    device = load("five-bar", settings)
    direction = (0.6, 0.8)
    found = evaluate(find_measure("stiffness_max"), device.at(AT, direction, model=model))
    assert found.status[1, 1] == OUT_OF_REACH
    for index in ((0, 0), (0, 1), (1, 0)):
        plant = device.at(AT[index], direction, model=model).plant
        peak = largest_stiffness(Loop(plant, device.controller))
        if peak is None:
            assert found.status[index] == NO_VALUE
            assert np.isnan(found.values[index])
        else:
            assert found.values[index] == pytest.approx(peak.stiffness, rel=1e-9)


def test_a_model_that_does_not_apply_is_a_note_and_no_failure():
    device = load("five-bar", ["loop.encoder.at=link"])
    found = evaluate(find_measure("stiffness_max"), device.at(AT[0], model="motor-mass"))
    assert (found.status == NO_VALUE).all()
    assert "sensor reads" in found.notes[0].reason


def test_places_without_a_stable_wall_say_so():
    device = load("five-bar", ["mechanism.damping.mode_ratio=0", "loop.delay_samples=2"])
    found = evaluate(find_measure("stiffness_max"), device.at(AT))
    assert (found.status[found.status != OUT_OF_REACH] == NO_VALUE).all()
    (note,) = found.notes
    assert (note.reason, note.count, note.first) == (impedance_range.NONE_STABLE, 3, (0, 0))


def test_a_direction_in_which_the_handle_cannot_move_has_no_value_and_says_why():
    found = evaluate(find_measure("stiffness_max"), load("five-bar").at(AT, (0.0, 0.0, 1.0)))
    assert (found.status[found.status != OUT_OF_REACH] == NO_VALUE).all()
    assert "cannot move" in found.notes[0].reason


def test_an_operator_counts():
    held = load("five-bar", operator="thesis-arm")
    alone = evaluate(find_measure("stiffness_max"), load("five-bar").at(AT[0]))
    found = evaluate(find_measure("stiffness_max"), held.at(AT[0]))
    for i in range(2):
        peak = largest_stiffness(held.at(AT[0, i]).loop)
        assert found.values[i] == pytest.approx(peak.stiffness, rel=1e-9)
    assert (np.abs(found.values / alone.values - 1.0) > 1e-3).all()


@pytest.mark.parametrize("name", ["stiffness_max", "damping_max", "stable_area", "fastest_decay"])
def test_a_given_plant_is_one_place(name):
    device = load("published-two-mass")
    found = evaluate(MEASURES[name], device.at())
    chart = stability_chart(device.at().loop)
    wanted = chart.fastest_decay.spectral_radius if name == "fastest_decay" else getattr(chart, name)
    assert found.status == OK
    assert found.values == pytest.approx(wanted, rel=1e-9)


def test_the_answers_of_a_batch_do_not_depend_on_who_else_is_in_it():
    device = load("five-bar")
    whole = evaluate(find_measure("stiffness_max"), device.at(AT))
    for index in ((0, 0), (0, 1), (1, 0)):
        alone = evaluate(find_measure("stiffness_max"), device.at(AT[index][None]))
        assert alone.values[0] == whole.values[index]
