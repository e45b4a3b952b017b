"""A contact simulated from Python: what the command says, its defaults, its errors, and how long a run is."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from math import log

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of
from tests.paddle import LENGTH, paddle
from tests.systems import mass, random_loop
from zwidth.chart import largest_stiffness, spectral_radius
from zwidth.contact import Hand, Reach, Reflex, Tremor, simulate_contact, slot
from zwidth.contact.contact_simulation import bound_of_run, lengthened, needed_substeps, run_length
from zwidth.errors import ArgumentError, TooLarge
from zwidth.loop import Controller, Loop, OperatingPoint
from zwidth.model import Friction, Nonlinear
from zwidth.show import json_value

SERIES = ("time", "position", "penetration", "velocity", "force", "handle", "energy")


def bundled(name, **more):
    return package.load(name).at(**more)


def one_mass(**parts):
    plant = replace(mass(0.1, 0.5), nonlinear=Nonlinear(**parts))
    return OperatingPoint(Controller(0.001), given_plant=plant)


# --- the command says the same --------------------------------------------------------------------

SAME = [
    (TWO_MASS, ("--stiffness", 4000, "--damping", 10), (4000.0, 10.0), {}),
    (TWO_MASS, ("--stiffness", 20000, "--damping", 1), (20000.0, 1.0), {}),
    (
        ONE_MASS,
        ("--stiffness", 2500, "--damping", 0, "--wall", "one-sided", "--passivity", 5, "--no-pull"),
        (2500.0, 0.0),
        {"wall": "one-sided", "passivity_damping": 5.0, "no_pull": True},
    ),
    (
        ONE_MASS,
        ("--environment", "slot", "--parameter", "width=0.004", "--damping", 1, "--duration", 0.5),
        (None, 1.0),
        {"environment": "slot", "parameters": {"width": 0.004}, "duration": 0.5},
    ),
    (
        MECHANISM,
        ("--stiffness", 4000, "--damping", 10, "--wall-position", 0.002, "--start-velocity", 0.1,
         "--tremor", "1,8"),
        (4000.0, 10.0),
        {"wall_position": 0.002, "start_velocity": 0.1, "tremor": Tremor(1.0, 8.0)},
    ),
    (
        ONE_MASS,
        ("--stiffness", 500, "--damping", 1, "--push", 1, "--ramp", 0.5, "--seed", 3, "--substeps", 7,
         "--set", "loop.encoder.resolution_m=2e-5", "--set", "loop.encoder.noise_m=1e-5"),
        (500.0, 1.0),
        {"push": 1.0, "ramp": 0.5, "seed": 3, "substeps": 7},
    ),
]  # fmt: skip


@pytest.mark.parametrize(("name", "words", "wall", "more"), SAME, ids=[" ".join(map(str, s[1])) for s in SAME])
def test_the_command_says_the_same(name, words, wall, more):
    settings = [word for word in words if isinstance(word, str) and "=" in word and "." in word.partition("=")[0]]
    point = package.load(name, settings).at()
    document = json_value(simulate_contact(point, *wall, **more).document())
    told = document_of("simulate", name, *words)
    assert {key: told[key] for key in document} == document


def test_an_arm_moves_as_the_command_says():
    point = bundled(ONE_MASS, operator="thesis-arm")
    reach, reflex = Reach(0.02, 0.1, 0.4), Reflex(0.5, 0.02, 0.03, arm_stiffness=400.0, arm_damping=4.0)
    simulated = simulate_contact(point, 500.0, 1.0, wall="one-sided", reach=reach, reflex=reflex)
    words = ("--wall", "one-sided", "--reach", "0.02,0.1,0.4", "--reflex", "0.5,400,4,0.02,0.03")
    told = document_of(
        "simulate", ONE_MASS, "--stiffness", 500, "--damping", 1, "--operator", "thesis-arm", *words
    )
    assert simulated.hand == Hand(point.operator, 0.0, 0.0, reach, None, reflex)
    assert simulated.handle.tolist() == told["handle_m"]


# --- what comes out -------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_random_devices_grow_and_decay_as_their_eigenvalues_say(seed):
    rng = np.random.default_rng([41, seed])
    told = 0
    for _ in range(8):
        loop = random_loop(rng)
        point = OperatingPoint(loop.controller, given_plant=loop.plant)
        largest = largest_stiffness(loop)
        K = rng.uniform(0.1, 2.0) * (largest.stiffness if largest else 1000.0)
        simulated = simulate_contact(point, K, rng.uniform(0.0, 1.0) * 0.1 * K * loop.period, trail=False)
        rate = spectral_radius(loop, [K], [simulated.parameters["damping"]])[0]
        assert simulated.predicted_growth == pytest.approx(log(rate), rel=1e-9, abs=1e-14)
        if abs(log(rate)) * len(simulated.time) > 2.0:  # a tenfold change had the time to happen
            assert simulated.stable is bool(rate < 1.0), (K, rate)
            told += 1
    assert told


def test_the_properties_are_those_of_the_response_and_the_judgement():
    simulated = simulate_contact(bundled(TWO_MASS), 4000.0, 10.0)
    response, judged, document = simulated.response, simulated.judgement, simulated.document()
    own = (response.time, response.reading, response.penetration, response.velocity, response.force,
           response.handle, response.stored)  # fmt: skip
    for name, values in zip(SERIES, own, strict=True):
        assert np.array_equal(getattr(simulated, name), values)
    assert (simulated.growth, simulated.amplitude) == (judged.growth, judged.amplitude)
    assert simulated.dominant_frequency == judged.frequency == document["dominant_frequency_Hz"]
    assert (simulated.stable, simulated.behaviour) == (True, "decaying")
    assert sum(simulated.ledger.values()) == pytest.approx(simulated.energy[-1], abs=1e-12)
    assert {len(column) for column in simulated.table().values()} == {len(simulated.time)}
    assert len(simulated.response.trail) == 20 * len(simulated.time)
    with pytest.raises(FrozenInstanceError):
        simulated.seed = 1


def test_a_passivity_controller_is_compared_with_the_run_without_it():
    point, wall = bundled(ONE_MASS), (2500.0, 0.0)
    simulated = simulate_contact(point, *wall, wall="one-sided", passivity_damping=5.0)
    plain_run = simulate_contact(point, *wall, wall="one-sided")
    assert plain_run.passivity is plain_run.uncontrolled is None
    assert np.array_equal(simulated.uncontrolled.handle, plain_run.handle)
    assert simulated.passivity.uncontrolled == plain_run.judgement
    assert simulated.passivity.uncontrolled_stiffness == pytest.approx(2500.0)
    assert simulated.amplitude < plain_run.amplitude


def test_a_motion_leaves_the_range_of_the_handle_at_the_first_sample_outside(tmp_path):
    point = package.load(paddle(tmp_path)).at()
    left = simulate_contact(point, 2000.0, 1.0, duration=1.0)
    assert (left.range_exit.backward, left.range_exit.forward) == pytest.approx((-LENGTH, LENGTH), rel=1e-3)
    first = np.flatnonzero(np.abs(left.handle) > LENGTH)[0]
    assert left.range_exit.time == left.time[first]
    within = simulate_contact(point, 1000.0, 5.0)
    assert within.range_exit is None
    assert within.distance_from_path == pytest.approx(1e-3**2 / (2.0 * LENGTH), rel=1e-3)


def test_a_model_without_a_handle_has_nobody_at_it():
    point = bundled(MECHANISM, model="motor-mass", operator="thesis-arm")
    assert simulate_contact(point, 1000.0, 10.0).hand == Hand()


def test_an_environment_may_be_given_as_an_object_or_by_its_name():
    by_name = simulate_contact(one_mass(), environment="slot", parameters={"width": 0.004}, duration=0.3)
    by_object = simulate_contact(one_mass(), environment=slot, parameters={"width": 0.004}, duration=0.3)
    assert by_name.parameters == {"width": 0.004, "stiffness": 1000.0, "damping": 0.0, "no_pull": 0.0}
    assert np.array_equal(by_name.handle, by_object.handle)


# --- errors ---------------------------------------------------------------------------------------


def test_every_fault_of_a_parameter_is_told():
    faults = {"width": -1.0, "depth": 1.0}
    with pytest.raises(ArgumentError) as caught:
        simulate_contact(one_mass(), environment="slot", parameters=faults)
    assert len(caught.value.reasons) == len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize("argument", ["wall_position", "start_position"])
def test_a_place_out_of_the_workspace_is_named_with_its_position(argument):
    with pytest.raises(ArgumentError, match=rf"^{argument}: .*0\.5 m") as caught:
        simulate_contact(bundled(MECHANISM), 4000.0, 10.0, **{argument: 0.5})
    assert caught.value.argument == argument


def test_more_samples_than_there_is_memory_for_are_refused():
    with pytest.raises(TooLarge, match="shorter time"):
        simulate_contact(one_mass(), 1000.0, 1.0, duration=1e9)


def test_a_device_in_the_place_of_a_point_is_told_what_to_write():
    with pytest.raises(TypeError, match=r"^point must .*OperatingPoint"):
        simulate_contact(package.load(ONE_MASS), 1000.0, 1.0)


# --- how long, and how far ------------------------------------------------------------------------


def test_a_linear_run_lasts_a_tenfold_change_or_eight_periods():
    length = run_length(-0.001, 0.001, linear=True)
    assert length.seconds == pytest.approx(log(10.0), abs=1e-3)
    assert length.reason.startswith("a tenfold")
    assert run_length(-0.01, 0.001, linear=True, frequency=2.0) == (4.0, "8 periods")
    assert run_length(1e-9, 0.001, linear=True).seconds == 60.0
    grown = run_length(0.01, 0.001, linear=True, frequency=0.1)
    assert grown.seconds == pytest.approx(2 * log(10.0) * 0.1, abs=1e-3)
    assert run_length(-0.01, 1e-6, linear=True, busy_until=100.0).seconds == 1.0  # a million samples


def test_a_run_that_is_not_linear_lasts_two_seconds_or_five_tenfold_changes():
    assert run_length(None, 0.001, linear=False).seconds == 2.0
    assert run_length(None, 0.001, linear=False, busy_until=1.5).seconds == 3.5
    slow = run_length(-1e-3, 0.001, linear=False)
    assert slow.seconds == pytest.approx(5 * log(10.0))


def test_a_sound_has_its_time_but_not_of_what_grows():
    assert run_length(-0.01, 0.001, linear=True, sound=3.0).seconds == 3.0
    assert run_length(0.01, 0.001, linear=True, sound=3.0).seconds < 0.5
    shorter = run_length(-0.01, 0.001, linear=True)
    assert lengthened(shorter, 4.0, 0.001).seconds == 4.0
    assert lengthened(shorter, 0.1, 0.001) is shorter
    point = bundled(TWO_MASS)
    heard = simulate_contact(point, 4000.0, 10.0, seconds_to_hear=lambda frequency: 20.0 / frequency)
    silently = simulate_contact(point, 4000.0, 10.0)
    assert heard.length.seconds == pytest.approx(20.0 / silently.dominant_frequency, rel=0.01)
    again = simulate_contact(one_mass(), environment=slot, seconds_to_hear=lambda f: 50.0 / f if f else 0.0)
    assert again.length.seconds == pytest.approx(50.0 / again.dominant_frequency, rel=0.1)
    assert again.length.reason.endswith("be heard")
    asked = simulate_contact(point, 4000.0, 10.0, duration=0.1, seconds_to_hear=lambda frequency: 3.0)
    assert asked.length == (0.1, "as requested")


def test_a_run_is_given_up_a_metre_away_or_where_its_growth_can_be_told():
    assert bound_of_run(1e-3, None) == bound_of_run(1e-3, -0.1) == 1.0
    assert bound_of_run(0.5, -0.1) == 5.0
    assert bound_of_run(1e-3, 0.5) == pytest.approx(1e-3 * np.exp(16.0))
    assert bound_of_run(1e-3, 100.0) == 1e6


def test_what_is_linear_takes_no_more_substeps_than_are_shown():
    linear, rubbing = (Loop(replace(mass(0.1), nonlinear=parts), Controller(0.001)) for parts in (
        Nonlinear(), Nonlinear(friction=(Friction(np.ones(1), 0.1),))))  # fmt: skip
    assert needed_substeps(linear, Hand(), 1000) == 20
    assert needed_substeps(linear, Hand(), 3) == 3
    assert needed_substeps(linear, Hand(tremor=Tremor(1.0)), 1000) == 1000
    assert needed_substeps(rubbing, Hand(), 1000) == 1000
