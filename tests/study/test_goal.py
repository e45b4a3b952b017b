"""What each number would have to be for a wanted largest stiffness: closed forms, charts and a fine grid."""

from __future__ import annotations

import tomllib
from functools import cache
from math import inf, isfinite, log, nan

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.frozen.mechanisms import mechanism_file
from tests.frozen.plants import plant_file
from tests.frozen.toml_text import toml_text
from zwidth.chart import largest_stiffness
from zwidth.device import address, from_document
from zwidth.device.load import load
from zwidth.errors import ChartError, DeviceError
from zwidth.study import numbers_for_goal, sensitivities
from zwidth.study.sensitivity.sensitivities import property_numbers


def one_mass(**loop):
    plant = {"mass_kg": 0.1, "damping_Ns_per_m": 0.0}
    return from_document({"name": "one", "plant": plant, "loop": {"sampling_period_s": 0.001, **loop}})


def largest(device):
    peak = largest_stiffness(device.at().loop)
    return 0.0 if peak is None else peak.stiffness


def by_path(goal):
    return {one.path: one for one in goal.numbers}


def changed(device, path, value):
    image = path.split(".")
    both = {path: value}
    if image[-1].isdigit() and image[-2].isdigit() and image[-1] != image[-2]:
        both[".".join([*image[:-2], image[-1], image[-2]])] = value
    return from_document(address.assign_all(device.document, both.items()), skip_assembly_check=True)


def random_devices():
    """Plants that have a stiffest wall; and one mechanism."""
    for seed in (0, 1, 2, 3, 5, 6, 7, 8):  # others take long, because their loops are built one by one
        yield f"plant {seed}", from_document(tomllib.loads(toml_text(plant_file(seed))))
    yield "mechanism 2", from_document(tomllib.loads(toml_text(mechanism_file(2))))


RANDOM = dict(random_devices())


@pytest.mark.parametrize("share", [0.3, 0.999, 1.0, 1.001, 4.0])
def test_mass_and_period_of_the_undamped_wall_follow_its_closed_form(share):
    """K_max = c m / T^2 for one free mass without damping."""
    device = one_mass()
    found = by_path(numbers_for_goal(device, None, share * largest(device)))
    assert found["plant.mass_kg"].factor == pytest.approx(share, rel=1e-7)
    assert found["loop.sampling_period_s"].factor == pytest.approx(share**-0.5, rel=1e-7)
    assert found["plant.mass_kg"].status == "reached"


def test_the_closed_form_of_the_wall_without_virtual_damping_is_solved():
    """A 20 Hz filter makes B = 0 the best: K = b (1 - E)/((m/b)(1 - E) - T E), E = exp(-b T/m)."""
    device = load("hapkit-course", ["loop.velocity.filter={type='butterworth', order=2, cutoff_Hz=20.0}"])
    m, b, T = 0.03, 1.0, 0.001

    def K(m, b, T):
        E = np.exp(-b * T / m)
        return b * (1.0 - E) / ((m / b) * (1.0 - E) - T * E)

    goal = 1.2 * K(m, b, T)
    found = by_path(numbers_for_goal(device, None, goal))
    assert found["loop.sampling_period_s"].value == pytest.approx(
        brentq(lambda x: K(m, b, x) - goal, 1e-4, T), rel=1e-6
    )
    assert found["plant.damping_Ns_per_m"].value == pytest.approx(
        brentq(lambda x: K(m, x, T) - goal, b, 5.0), rel=1e-6
    )


@cache
def goal_of(name, share):
    """The device's own largest stiffness, and its numbers for a share of it."""
    K = largest(RANDOM[name])
    assert K > 0.0
    return K, numbers_for_goal(RANDOM[name], None, share * K)


def check_charts(name, share):
    device = RANDOM[name]
    K, goal = goal_of(name, share)
    assert goal.stiffness_max == K
    assert sorted(one.path for one in goal.numbers) == sorted(
        path for path, *_ in property_numbers(device.document)
    )
    for one in goal.numbers:
        if not isfinite(one.value):
            assert one.status != "reached"
            assert one.reason
            continue
        own = largest(changed(device, one.path, one.value))
        assert own == pytest.approx(one.stiffness_max, rel=1e-7)
        if one.status == "reached":
            assert own == pytest.approx(share * K, rel=1e-6)
            assert not one.reason
            assert one.now == 0.0 or one.factor == one.value / one.now
        else:
            assert one.status == "out of range"
            assert abs(log(own / (share * K))) <= abs(log(share)) + 1e-9  # no worse than the device itself
            assert one.reason


# among them numbers without a device beyond, numbers whose chart jumps, and lengths of links
EVERYDAY = {"plant 0": 0.6, "plant 1": 1.5, "plant 2": 0.6, "plant 6": 1.5, "plant 7": 0.6, "mechanism 2": 0.6}


@pytest.mark.parametrize(("name", "share"), EVERYDAY.items())
def test_the_chart_at_the_value_has_the_goal(name, share):
    check_charts(name, share)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [("plant 3", 1.5), ("plant 5", 0.6), ("plant 8", 1.5)])
def test_the_chart_at_the_value_has_the_goal_with_many_numbers(name, share):
    check_charts(name, share)


@pytest.mark.parametrize("name", ["plant 0", "plant 7"])
def test_every_number_that_has_a_sensitivity_is_asked_for(name):
    _, goal = goal_of(name, 0.6)
    known = sensitivities(RANDOM[name]).numbers
    assert sorted(one.path for one in goal.numbers) == sorted(one.path for one in known)


def check_grid(name):
    device = RANDOM[name]
    K, goal = goal_of(name, 1.3)
    for one in [number for number in goal.numbers if number.now != 0.0 and number.status != "no influence"][:4]:
        reach = log(10.0) if one.status == "out of range" else one.distance * (1.0 - 1e-4)
        if not isfinite(one.value):
            continue
        for side in (1.0, -1.0):
            for t in np.linspace(0.0, side * reach, 16):
                try:
                    own = largest(changed(device, one.path, one.now * float(np.exp(t))))
                except (DeviceError, ChartError, ValueError):
                    break  # there is no such device, nor beyond
                # below the goal all the way: nothing is crossed
                assert own < 1.3 * K or "jumps" in one.reason, (one, t)


@pytest.mark.parametrize("name", ["plant 0", "plant 7", "mechanism 2"])
def test_no_grid_finds_a_nearer_crossing(name):
    check_grid(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plant 2", "plant 5"])
def test_no_grid_finds_a_nearer_crossing_of_many_numbers(name):
    check_grid(name)


@cache
def five_bar_levels(path):
    """The largest stiffness of the five-bar over a fine grid of ln(number / own value); and its function."""
    device = load("five-bar")
    now = address.get(device.document, path)

    def level(t):
        return largest(changed(device, path, now * float(np.exp(t))))

    places = np.linspace(-2.3, 2.3, 116)
    return places, [level(t) for t in places], level


@pytest.mark.parametrize(
    ("drive", "share"),
    [("left", 0.975), ("left", 1.05), ("left", 1.1), ("left", 1.2), ("right", 0.95), ("right", 1.1)],
)
def test_of_several_crossings_the_nearest_is_taken(drive, share):
    """The stiffness of either drive helps, harms and helps again: the goal is crossed on both sides, or twice."""
    device, path = load("five-bar"), f"mechanism.drives.motor-{drive}.stiffness_Nm_per_rad"
    goal = share * largest(device)
    places, levels, level = five_bar_levels(path)
    ends = zip(places, places[1:], levels, levels[1:], strict=False)
    crossings = [
        brentq(lambda t: level(t) - goal, a, b, xtol=1e-9) for a, b, f, g in ends if (f - goal) * (g - goal) < 0.0
    ]
    assert len(crossings) > 1
    found = by_path(numbers_for_goal(device, None, goal))[path]
    assert log(found.factor) == pytest.approx(min(crossings, key=abs), abs=1e-6)


def test_a_number_that_changes_nothing_says_so():
    device = load("five-bar")
    found = by_path(numbers_for_goal(device, None, 9000.0))
    torque = found["mechanism.drives.motor-left.torque_constant_Nm_per_A"]
    assert (torque.status, torque.stiffness_max) == ("no influence", pytest.approx(largest(device)))
    assert torque.value != torque.value
    arm = found["mechanism.links.upper-left.inertia_kg_m2"]
    assert arm.status == "out of range"
    assert "from 0.00024 to 0.024" in arm.reason
    assert arm.factor == pytest.approx(10.0)


def test_a_delay_that_is_none_can_be_afforded():
    """Below the present largest stiffness a number tells what it may be relaxed to."""
    device = one_mass()
    found = by_path(numbers_for_goal(device, None, 0.5 * largest(device)))["loop.delay_samples"]
    assert found.status == "reached"
    assert found.factor != found.factor  # 0 has none
    assert 0.0 < found.value < 1.0
    assert largest(device.with_({"loop.delay_samples": found.value})) == pytest.approx(0.5 * largest(device))


def test_limits_of_the_schema_are_kept_and_whole_numbers_not_varied():
    velocity = {"filter": {"type": "butterworth", "order": 2, "cutoff_Hz": 300.0}}
    device = one_mass(velocity=velocity)
    found = by_path(numbers_for_goal(device, None, 100.0 * largest(device)))
    cutoff, order = found["loop.velocity.filter.cutoff_Hz"], found["loop.velocity.filter.order"]
    assert cutoff.status == "out of range"
    assert "sampling frequency" in cutoff.reason
    assert (order.status, order.reason[:11]) == ("out of range", "not varied:")


@pytest.mark.parametrize("goal", [0.0, -1.0, inf, nan])
def test_a_goal_that_is_no_stiffness_is_refused(goal):
    with pytest.raises(ValueError, match="positive, finite"):
        numbers_for_goal(one_mass(), None, goal)


def test_the_result_knows_its_keys_and_its_lines():
    device = one_mass()
    goal = numbers_for_goal(device, device.at(), 2.0 * largest(device))
    document = goal.document()
    assert document["goal_N_per_m"] == 2.0 * document["stiffness_max_N_per_m"]
    assert [one["path"] for one in document["goal"]] == goal.table()["path"]
    assert "plant.mass_kg = 0.2" in repr(goal)
    hopeless = numbers_for_goal(device, device.at(), 1e6 * largest(device))
    assert "no number" in repr(hopeless)
