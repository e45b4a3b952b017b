"""Limit cycles predicted and simulated from Python: what the command says, how far, its limits and its errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of
from tests.paddle import LENGTH, paddle
from tests.systems import mass
from zwidth.contact import SOURCES, TimeResponse, judge_response, predict_limit_cycles, quiet_limit, resting_limit
from zwidth.contact.wall_limit_cycles import answered_cycles, behaviour_at_the_end, largest_motion
from zwidth.loop import Controller, OperatingPoint
from zwidth.model import Brake, Counter, Friction, Nonlinear
from zwidth.show import json_value

ONE = np.ones(1)
ROUGH = ("loop.encoder.resolution_m=2e-5", "friction.coulomb_N=0.03")
LIMITED = "loop.saturation.force_N=5"


def one_mass(kilograms=0.1, damping=0.1, **parts):
    plant = replace(mass(kilograms, damping), nonlinear=Nonlinear(**parts))
    return OperatingPoint(Controller(0.001), given_plant=plant)


def rough():
    return one_mass(friction=(Friction(ONE, 0.03),), counters=(Counter(ONE, 2e-5),), force_limit=5.0)


SAME = [
    (TWO_MASS, (LIMITED,), (8000.0, 10.0), {}),
    (ONE_MASS, (*ROUGH, LIMITED), (2600.0, 0.0), {"simulate": False}),
    (ONE_MASS, ROUGH, (4500.0, 0.0), {"offset": 0.5}),
    (ONE_MASS, ROUGH, (500.0, 1.0), {}),
]


@pytest.mark.parametrize(("name", "settings", "wall", "more"), SAME)
def test_the_command_says_the_same(name, settings, wall, more):
    predicted = predict_limit_cycles(package.load(name, settings).at(), *wall, **more)
    words = [word for setting in settings for word in ("--set", setting)]
    words += ["--offset", more.get("offset", 0.0)] + ["--no-simulation"] * (not more.get("simulate", True))
    told = document_of("limit-cycles", name, "--stiffness", wall[0], "--damping", wall[1], *words)
    document = json_value(predicted.document())
    assert {key: told[key] for key in document} == document


@pytest.mark.parametrize("seed", range(4))
def test_a_limited_force_holds_random_masses_where_it_is_predicted(seed):
    rng = np.random.default_rng([42, seed])
    friction = rng.uniform(0.05, 0.5)
    point = one_mass(rng.uniform(0.05, 1.0), friction, force_limit=rng.uniform(0.5, 5.0))
    edge = 2.0 * friction / point.controller.sampling_period  # about where a spring alone fails
    predicted = predict_limit_cycles(point, rng.uniform(1.2, 2.0) * edge, 0.0)
    assert (predicted.verdict, predicted.nonlinear) == ("unstable", ("the force limit",))
    (cycle,), (simulated,) = predicted.cycles, predicted.simulated
    assert simulated.behaviour == "limit cycle"
    assert simulated.amplitude == pytest.approx(cycle.amplitude, rel=0.01)
    assert simulated.frequency == pytest.approx(cycle.frequency_Hz, rel=0.01)
    assert not predicted.simulation_disagrees
    assert predicted.small_start_vibration is None


def test_the_limits_are_those_of_friction_and_steps():
    predicted = predict_limit_cycles(rough(), 2600.0, 0.4, simulate=False)
    assert predicted.resting_limit == pytest.approx(float(resting_limit(0.03, 2e-5)))
    assert predicted.quiet_limit == pytest.approx(float(quiet_limit(0.03, 2e-5, 0.4, 0.001)))
    pulling = predict_limit_cycles(rough(), -100.0, 0.0, simulate=False)
    assert pulling.resting_limit is pulling.quiet_limit is None
    smooth = predict_limit_cycles(one_mass(force_limit=1.0), 1000.0, 0.0, simulate=False)
    assert smooth.resting_limit is None


def test_where_simulation_and_prediction_part_the_simulation_is_the_answer():
    predicted = predict_limit_cycles(package.load(TWO_MASS, [LIMITED]).at(), 8000.0, 10.0)
    (answer,) = predicted.answers
    assert (answer.source, answer.confirmed) == ("describing function", True)
    assert not predicted.simulation_disagrees
    cycle, simulated = answer.cycle, answer.simulated

    def answered(*runs, others=()):
        return answered_cycles([cycle], [runs], others, 1.0)

    slower = replace(simulated, frequency=0.5 * simulated.frequency)
    (other,) = answered(slower, slower).cycles
    assert (other.source, other.confirmed) == ("simulation", True)
    assert (other.cycle.frequency_Hz, other.predicted) == (slower.frequency, cycle)
    larger = replace(simulated, amplitude=1.3 * simulated.amplitude)
    assert answered(larger, larger).cycles[0].cycle.amplitude == larger.amplitude
    resting = replace(slower, behaviour="converged")
    gone = answered(resting, resting)
    assert (gone.cycles, gone.contradicted[0].confirmed) == ((), False)
    (open_,) = answered(replace(slower, behaviour="undecided")).cycles
    assert (open_.source, open_.confirmed) == ("describing function", None)
    found = answered(simulated, simulated, others=(larger, slower, resting))
    assert [each.source for each in found.cycles] == ["describing function", "simulation", "simulation"] or [
        each.source for each in found.cycles
    ] == ["simulation", "describing function", "simulation"]
    assert not answered_cycles([cycle], [()], [], 1.0).cycles[0].confirmed
    (elsewhere,) = answered_cycles([cycle], [(resting, resting)], [simulated], 1.0).cycles
    assert (elsewhere.confirmed, elsewhere.predicted) == (True, cycle)  # another start leads to it


def response(truth, reading=None, **more):
    """A run of a nonlinear device on a two-sided wall, given its motion."""
    S = len(truth)
    still = np.zeros(S)
    return TimeResponse(
        period=1e-3,
        wall_position=0.0,
        time=1e-3 * np.arange(S),
        reading=truth if reading is None else reading,
        truth=truth,
        velocity=still,
        force=still + 1.0,
        handle=truth,
        trail_time=np.zeros(0),
        trail=np.zeros(0),
        energies=np.zeros((S, len(SOURCES))),
        stored=still,
        given_up=False,
        **{"quantum": 0.0, "noise": 0.0, "linear": False, "surface": False, "held": False} | more,
    )


@pytest.mark.parametrize(
    ("change", "behaviour"), [(0.0, "limit cycle"), (0.02, "undecided"), (-0.02, "undecided")]
)
def test_a_vibration_that_still_changes_is_no_limit_cycle_yet(change, behaviour):
    """Neither a slow decay nor a slow approach to another vibration has settled."""
    t = np.arange(4000)
    run = response(np.exp(change * t / 1000.0) * np.sin(0.2 * t))
    judged = judge_response(run)
    assert judged.behaviour == "limit cycle"
    assert behaviour_at_the_end(run, judged, 1000) == behaviour


def test_what_noise_alone_keeps_up_is_no_limit_cycle():
    rng = np.random.default_rng(3)
    truth = 1e-7 * np.sin(0.2 * np.arange(4000))
    run = response(truth, truth + 1e-6 * rng.normal(size=4000), quantum=1e-6, noise=1e-6)
    judged = judge_response(run)
    assert judged.behaviour == "converged"
    assert behaviour_at_the_end(run, judged, 1000) == "undecided"


def test_a_vibration_that_only_a_large_motion_falls_into_is_found_by_simulation():
    """Nothing grows from small motions, so that no stable cycle is predicted from them alone; one that the
    force limit
    keeps up is in the answer, whoever finds it."""
    point = package.load(TWO_MASS, [LIMITED, "loop.delay_samples=0.5"]).at()
    found = predict_limit_cycles(point, 7000.0, 10.0)
    met = [answer for answer in found.answers if answer.source == "simulation"]
    assert met
    assert found.simulation_disagrees
    document = found.document()
    assert [each["from"] for each in document["limit_cycles"]] == [answer.source for answer in found.answers]
    for answer, told in zip(found.answers, document["limit_cycles"], strict=True):
        if answer.source == "simulation":
            assert told["amplitude_m"] == answer.simulated.amplitude
            assert told["frequency_Hz"] == answer.simulated.frequency
    assert found.table()["amplitude_m"] == [cycle.amplitude for cycle in found.cycles]


def test_a_device_moves_as_far_as_its_handle_and_a_given_plant_a_metre(tmp_path):
    assert largest_motion(rough()) == 1.0
    device = package.load(paddle(tmp_path))
    assert largest_motion(device.at()) == pytest.approx(LENGTH, rel=1e-3)
    arm = package.load(MECHANISM)
    back, forth = arm.at().handle_range
    assert largest_motion(arm.at()) == min(-back, forth)
    predicted = predict_limit_cycles(device.at(), 3000.0, 1.0, simulate=False)
    assert predicted.largest_motion == largest_motion(device.at())
    assert predicted.leaves_range
    assert [cycle.within_range for cycle in predicted.cycles] == [True, False]


def test_progress_is_told_and_noise_and_brakes_are_left_out():
    stages = []
    brake, counted = Brake(ONE, 2.0), Counter(ONE, 2e-5, noise=1e-6)
    point = one_mass(counters=(counted,), friction=(Friction(ONE, 0.1),), brakes=(brake,))
    predicted = predict_limit_cycles(point, 1000.0, 2.0, progress=lambda *stage: stages.append(stage))
    assert predicted.nonlinear == ("dry friction", "encoder steps")
    assert predicted.left_out == ("noise", "programmable brakes")
    assert stages[-2:] == [("simulating", 0, 1), ("simulating", 1, 1)]
    assert "simulating" not in {name for name, *_ in stages[:-2]}


def test_the_table_has_a_row_for_each_cycle():
    predicted = predict_limit_cycles(rough(), 2600.0, 0.0)
    table = predicted.table()
    assert table["stable"] == ["false", "true"]
    assert table["amplitude_m"] == [cycle.amplitude for cycle in predicted.cycles]
    assert table["simulated_amplitude_m"] == [None, predicted.simulated[1].amplitude]
    assert {len(column) for column in table.values()} == {2}
