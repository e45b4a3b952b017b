"""Every sentence of the report, and a device that changes it."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

from zwidth.device.load import from_document, load
from zwidth.show.motions import counted
from zwidth.show.report import sentences
from zwidth.show.report.facts import gather

FILTER = "loop.velocity.filter={type='butterworth', order=2, cutoff_Hz=20.0}"
FIRST_ORDER = "loop.velocity.filter={type='first-order', time_constant_s=0.002}"
RIGID = ("drives.motor-right.stiffness_Nm_per_rad=unset", "drives.motor-left.stiffness_Nm_per_rad=unset")
LATE = "loop.delay_samples=1"
UNDAMPED = "plant.damping_Ns_per_m=unset"


@cache
def facts(name, *changes, **question):
    return gather(load(name, changes), **question)


@cache
def one_mass(mass, damping=0.0, stiffness=0.0, period=0.001, delay=0.0):
    plant = {"mass_kg": mass, "damping_Ns_per_m": damping, "stiffness_N_per_m": stiffness}
    loop = {"sampling_period_s": period, "delay_samples": delay}
    return gather(from_document({"name": "one mass", "plant": plant, "loop": loop}))


@cache
def far_sensor(stiffness=2000.0):
    k = stiffness
    plant = {
        "mass_kg": [[0.2, 0.0], [0.0, 0.1]],
        "damping_Ns_per_m": [[0.6, -0.1], [-0.1, 0.1]],
        "stiffness_N_per_m": [[2 * k, -k], [-k, k]],
        "actuator": [1.0, 0.0],
        "sensor": [0.0, 1.0],
    }
    return gather(from_document({"name": "far", "plant": plant, "loop": {"sampling_period_s": 0.001}}))


@cache
def held_back():
    """A wall of reversed sign takes away the spring to the ground: K = 500 N/m, whatever else is changed."""
    plant = {"mass_kg": 0.1, "damping_Ns_per_m": 2.0, "stiffness_N_per_m": 500.0, "sensor": [-1.0]}
    return gather(from_document({"name": "back", "plant": plant, "loop": {"sampling_period_s": 0.001}}))


@cache
def runaway(damping=1.0, stiffness=-50.0):
    plant = {
        "mass_kg": [[0.1, 0.0], [0.0, 0.2]],
        "damping_Ns_per_m": [[1.0, 0.0], [0.0, damping]],
        "stiffness_N_per_m": [[0.0, 0.0], [0.0, stiffness]],
        "actuator": [1.0, 0.0],
        "sensor": [1.0, 0.0],
    }
    return gather(from_document({"name": "away", "plant": plant, "loop": {"sampling_period_s": 0.001}}))


def plain(text):
    return text.replace("\u00a0", " ")


HERE = "Along y at (0, 0.25) m this device renders walls of up to"
BY_DRIVES = (
    "What limits it is the flexibility of the drives, at 101 Hz and 131 Hz: with rigid drives it would reach"
)
BY_SPRING = "it is its flexibility, at 131 Hz: if it were rigid it would reach"
ONE_LATE = "with one sample of delay it would"

RENDERS = [
    (lambda: facts("five-bar"), f"{HERE} 7.84 kN/m, at 10.8 Ns/m of virtual damping."),
    (lambda: facts("five-bar", LATE), f"{HERE} 1.70 kN/m, at 3.22 Ns/m of virtual damping."),
    (
        lambda: facts("five-bar", at=(0.02, 0.2), direction=(-1.0, 0.0)),
        "Along −x at (0.02, 0.2) m this device renders walls of up to ",
    ),
    (
        lambda: facts("five-bar", model="rigid"),
        "Along y at (0, 0.25) m the rigid model of this device renders walls of up to 126 kN/m,",
    ),
    (
        lambda: facts("hapkit-course"),
        "This device renders walls of up to 21.9 kN/m, at 24.7 Ns/m of virtual damping.",
    ),
    (
        lambda: facts("hapkit-course", FILTER),
        "This device renders walls of up to 2.01 kN/m, those without any virtual damping; every bit",
    ),
    (
        lambda: facts("published-two-mass", UNDAMPED, LATE),
        "This device renders no wall: no wall with positive stiffness",
    ),
]


@pytest.mark.parametrize(("of", "text"), RENDERS)
def test_what_it_renders(of, text):
    assert plain(sentences.renders(of())).startswith(text)


LIMIT = [
    (lambda: facts("five-bar"), f"{BY_DRIVES} 126 kN/m; {ONE_LATE} fall to 1.70 kN/m."),
    (lambda: facts("published-two-mass"), f"What limits {BY_SPRING} 126 kN/m; {ONE_LATE} fall to 1.10 kN/m."),
    (lambda: facts("five-bar", LATE), f"{BY_DRIVES} 26.5 kN/m."),
    (
        lambda: facts("five-bar", *RIGID),
        "What limits it is its mass of 0.29 kg, sampled at 800 Hz: sampled twice as fast it would reach 504 kN/m;",
    ),
    (
        lambda: facts("five-bar", *RIGID, LATE),
        "What limits it is the delay of 1 sample (1.25 ms): without this delay it would reach 126 kN/m.",
    ),
    (
        lambda: facts("five-bar", FILTER),
        "What limits it is the filter of the velocity: without this filter it would reach 7.84 kN/m;",
    ),
    (
        lambda: one_mass(0.1, 9.347, 1669590.0),
        "What limits it is how little it damps its own vibrations: with twice the structural damping it",
    ),
    (lambda: held_back(), "None of the single changes tried lets it render a stiffer wall"),
    (
        lambda: far_sensor(),
        "What limits it is that the sensor does not sit where the wall acts: with the sensor at the actuator it "
        "would reach",
    ),
    (
        lambda: facts("published-two-mass", UNDAMPED),
        f"What limits {BY_SPRING} 126 kN/m; {ONE_LATE} render no wall at all.",
    ),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), f"What prevents {BY_SPRING} 26.5 kN/m."),
]


@pytest.mark.parametrize(("of", "text"), LIMIT)
def test_what_limits_it(of, text):
    assert plain(sentences.limit(of())).startswith(text)


VIBRATION = [
    (lambda: facts("five-bar"), "A stiffer wall vibrates at 171 Hz."),
    (lambda: facts("published-two-mass", LATE), "There two vibrations set in at once, at 9.63 Hz and 135 Hz."),
    (lambda: one_mass(0.03, 300.0), "A stiffer wall makes the force alternate from sample to sample, at 500 Hz."),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), ""),
]


@pytest.mark.parametrize(("of", "text"), VIBRATION)
def test_at_which_vibration(of, text):
    assert plain(sentences.vibration(of())) == text


NEXT = [
    (lambda: facts("five-bar"), "The next best single change, half the sampling period, would reach 42.0 kN/m."),
    (lambda: facts("five-bar", LATE), "The next best single change, no delay, would reach 7.84 kN/m."),
    (lambda: facts("five-bar", *RIGID), ""),
    (lambda: held_back(), ""),
]


@pytest.mark.parametrize(("of", "text"), NEXT)
def test_the_runner_up(of, text):
    assert plain(sentences.next_best(of())) == text


def test_separate_regions_are_counted():
    assert sentences.regions(facts("five-bar")) == ""
    apart = one_mass(0.1976, 4.687, 277934.0, 0.00761, 0.5)
    assert sentences.regions(apart) == "The stable walls lie in 2 separate regions."


def test_unobserved_motions_are_named():
    assert sentences.unobserved(facts("hapkit-course")) == ""
    assert "rigid motion (0 Hz)" in sentences.unobserved(facts("five-bar"))


def test_equal_motions_are_counted():
    assert counted(["rigid motion (0 Hz)"] * 2) == ["2 rigid motions (0 Hz)"]
    assert counted(["mode at 9 Hz (x)", "mode at 8 Hz"]) == ["mode at 9 Hz (x)", "mode at 8 Hz"]


def test_a_device_that_runs_away_is_warned_of_first():
    for of in (runaway(), runaway(-1.0, 50.0), runaway(-1.0, 0.0)):
        assert sentences.summary(of)[0].startswith("Warning: this device runs away whatever the wall")
        assert sentences.unobserved(of) == ""
    for of in (runaway(1.0, 50.0), runaway(1.0, 0.0), facts("five-bar")):
        assert sentences.warning(of) == ""


def test_what_happens_outside_depends_on_the_edge():
    assert "the straight edge at K = 0 (0 Hz), the handle drifts away" in sentences.outside(facts("five-bar"))
    assert "at K = −5.00 kN/m (0 Hz)" in plain(sentences.outside(one_mass(0.1, 1.0, 5000.0)))


@pytest.mark.parametrize("of", [lambda: facts("five-bar"), lambda: facts("five-bar", LATE), far_sensor])
def test_up_to_promises_no_more_than_there_is(of):
    found = of()
    value, prefix = re.search(r"up to ([\d.]+) (k?)N/m", plain(sentences.renders(found))).groups()
    assert 0.99 * found.base.stiffness_max < float(value) * (1e3 if prefix else 1.0) <= found.base.stiffness_max


def test_the_nearest_model():
    full = sentences.models(facts("five-bar"))
    assert plain(full) == (
        "Of the simpler models, motor mass with damping comes nearest: 7.97 kN/m, 1.6 % above the device "
        "as described."
    )
    assert "rigid without damping comes nearest: 20.5 kN/m, 6.2 % below" in plain(
        sentences.models(facts("hapkit-course"))
    )
    assert sentences.models(facts("published-two-mass", UNDAMPED, LATE)) == ""


@pytest.mark.parametrize(
    ("ratio", "text"), [(1.0, "just as"), (1.02, "2.0 % above"), (0.5, "50 % below"), (16.0, "16 times that of")]
)
def test_differences_in_words(ratio, text):
    assert sentences.difference(ratio) == text


def test_the_fastest_wall():
    assert plain(sentences.decay(facts("five-bar"))) == (
        "A wall of 500 N/m and 22.5 Ns/m comes to rest fastest: a tenth is left after 48 ms."
    )
    assert "(a wall of negative stiffness or damping)" in sentences.decay(facts("five-bar", model="motor-mass"))
    assert sentences.decay(facts("published-two-mass", UNDAMPED, LATE)) == ""


def test_conditions_that_hold_are_named():
    assert "the assumptions of none of these" in sentences.conditions(facts("five-bar"))
    assert "“passive wall”" in sentences.conditions(facts("hapkit-course"))
    assert "“rigid mass”" in sentences.conditions(facts("five-bar", *RIGID))


SETTING = [
    (
        lambda: facts("five-bar"),
        "Assembly elbows-out, full model; sampled every 1.25 ms, no delay, velocity not filtered.",
    ),
    (
        lambda: facts("hapkit-course", FILTER),
        "Plant as given; sampled every 1 ms, no delay, "
        "velocity through a Butterworth filter of order 2 at 20 Hz (tustin).",
    ),
    (
        lambda: facts("hapkit-course", "loop.delay_samples=1.5", FIRST_ORDER),
        "Plant as given; sampled every 1 ms, a delay of 1.5 samples (1.5 ms), "
        "velocity through a first-order filter of 2 ms.",
    ),
]


@pytest.mark.parametrize(("of", "text"), SETTING)
def test_the_setting(of, text):
    assert plain(sentences.setting(of())) == text


@pytest.mark.parametrize(
    ("direction", "name"),
    [((0, 1, 0), "y"), ((-1, 0, 0), "−x"), ((0, 0, 1), "z"), ((0.6, 0.8, 0), "(0.6, 0.8)")],
)
def test_directions(direction, name):
    assert sentences.direction_name(np.array(direction, dtype=float)) == name


def test_the_summary_leads_with_what_and_why():
    said = sentences.summary(facts("five-bar"))
    assert said[0] == sentences.renders(facts("five-bar"))
    assert said[1] == sentences.limit(facts("five-bar"))
    assert all(sentence.endswith(".") for sentence in said)
