"""The comparison: what each condition takes from a plant, and which of its assumptions it finds broken."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from conditions.conditions_cases import devices, one_mass

from zwidth.chart.chart import stability_chart
from zwidth.conditions import compare, registry
from zwidth.device.load import load
from zwidth.loop.controller import Butterworth, Controller
from zwidth.loop.loop import Loop
from zwidth.model.plant import Plant

NAMES = [bound.name for bound in compare(one_mass(1.0, 0.001))]
RIGID, LATE, SPRUNG, SPRING, LINEAR, PASSIVE, PASSIVE_LOOP = NAMES


def bounds(loop):
    found = compare(loop)
    assert [bound.name for bound in found] == NAMES
    return {bound.name: bound for bound in found}


def broken(loop):
    return {name: set(bound.violated) for name, bound in bounds(loop).items()}


def random_loops():
    for m, T, rng in devices(2, 12):
        yield one_mass(m, T)
        yield one_mass(m, T, delay=1.0)
        yield one_mass(m, T, k=m * (rng.uniform(0.05, 1.5) / T) ** 2)
        yield one_mass(m, T, b=10.0 ** rng.uniform(-3, 0.5) * m / T)


def test_where_all_is_met_exact_means_exact():
    seen = set()
    for loop in random_loops():
        chart = stability_chart(loop, decay=False)
        for bound in compare(loop):
            if not bound.holds or bound.claim != "exact" or bound.name == SPRING:
                continue
            seen.add(bound.name)
            assert bound.stiffness_max == pytest.approx(chart.stiffness_max, rel=1e-9)
            assert bound.damping_at_stiffness_max == pytest.approx(chart.damping_at_stiffness_max, rel=1e-7)
            there = float(bound.stiffness_max_at(bound.damping_at_stiffness_max))
            assert there == pytest.approx(bound.stiffness_max, rel=1e-9)
    assert seen == {RIGID, LATE, SPRUNG}


def test_where_all_is_met_sufficient_means_stable():
    for loop in random_loops():
        chart = stability_chart(loop, decay=False)
        for bound in compare(loop):
            if bound.holds and bound.claim == "sufficient" and bound.stiffness_max > 0.0:
                assert bound.stiffness_max <= chart.stiffness_max * (1.0 + 1e-9)
                assert chart.check(0.999 * bound.stiffness_max, bound.damping_at_stiffness_max).names == ["stable"]


def test_a_rigid_mass_meets_all_that_is_said_of_it():
    found = broken(one_mass(0.3, 0.001))
    assert found[RIGID] == found[SPRING] == found[LINEAR] == found[PASSIVE] == found[PASSIVE_LOOP] == set()
    assert found[LATE] == {registry.ONE_LATE}
    assert found[SPRUNG] == {registry.SPRUNG}


def test_a_spring_to_the_ground_is_seen():
    loop = one_mass(0.3, 0.001, k=5000.0)
    found = bounds(loop)
    assert found[SPRUNG].violated == ()
    assert found[SPRUNG].taken["motor_side_mass_kg"] == pytest.approx(0.3)
    assert found[SPRUNG].taken["stiffness_N_per_m"] == pytest.approx(5000.0)
    assert registry.RIGID in found[RIGID].violated
    assert np.isnan(found[RIGID].stiffness_max)
    assert np.all(np.isnan(found[RIGID].stiffness_max_at([0.0, 1.0])))


def test_friction_is_seen():
    assert broken(one_mass(0.3, 0.001, b=0.1))[RIGID] == {registry.UNDAMPED}
    assert broken(one_mass(0.3, 0.001, b=0.1))[LINEAR] == set()
    assert broken(one_mass(0.3, 0.001, b=100.0))[LINEAR] == {registry.LIGHT}


def test_delay_and_filter_are_seen():
    late = broken(one_mass(0.3, 0.001, delay=0.4))
    assert late[RIGID] == {registry.AT_ONCE}
    assert late[LATE] == {registry.ONE_LATE}
    assert late[LINEAR] == set()
    assert late[PASSIVE_LOOP] == {registry.WHOLE}
    filtered = broken(one_mass(0.3, 0.001, velocity_filter=Butterworth(2, 20.0)))
    assert filtered[RIGID] == filtered[PASSIVE] == filtered[LINEAR] == {registry.UNFILTERED}
    assert filtered[SPRING] == filtered[PASSIVE_LOOP] == set()


def test_a_split_hold_silences_the_theorem():
    bound = bounds(one_mass(0.3, 0.001, b=1.0, delay=0.4))[PASSIVE_LOOP]
    assert np.isnan(bound.stiffness_max)
    assert np.isnan(bound.stiffness_max_at(0.0))


def two_masses(actuator=(0.0, 1.0), sensor=(0.0, 1.0), damping=0.0):
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    plant = Plant(
        mass=np.diag([0.2616, 0.0254]),
        damping=damping * between,
        stiffness=15620.0 * between,
        actuator=np.array(actuator),
        sensor=np.array(sensor),
        handle=np.array([1.0, 0.0]),
    )
    return Loop(plant, Controller(0.00125))


def test_two_masses_are_neither_rigid_nor_held():
    found = bounds(two_masses())
    assert found[RIGID].violated == (registry.RIGID,)
    assert found[RIGID].taken["rigid_mass_kg"] == pytest.approx(0.287)
    assert found[SPRUNG].violated == (registry.SPRUNG,)
    assert found[SPRUNG].taken["motor_side_mass_kg"] == pytest.approx(0.0254)
    assert found[SPRUNG].taken["stiffness_N_per_m"] == pytest.approx(15620.0)


def test_structural_damping_is_no_friction_against_the_ground():
    found = bounds(two_masses(damping=1.8744))
    assert found[RIGID].violated == (registry.RIGID, registry.UNDAMPED)
    assert found[PASSIVE].taken["damping_Ns_per_m"] == 0.0
    assert found[PASSIVE].stiffness_max == 0.0
    assert np.isnan(found[PASSIVE].damping_at_stiffness_max)


def test_reading_elsewhere_is_seen():
    found = bounds(two_masses(sensor=(1.0, 0.0)))
    assert all(registry.COLLOCATED in bound.violated for bound in found.values())


def test_what_no_wall_moves_does_not_count():
    """A mode with damping, beside a rigid mass: the wall neither moves nor sees it."""
    plant = Plant(np.eye(2), np.diag([0.0, 3.0]), np.diag([0.0, 1e4]), np.array([1.0, 0.0]), np.array([1.0, 0.0]))
    found = bounds(Loop(plant, Controller(0.001)))
    assert found[RIGID].violated == ()
    assert found[RIGID].stiffness_max == pytest.approx(
        stability_chart(one_mass(1.0, 0.001)).stiffness_max, rel=1e-9
    )


def test_a_little_friction_is_seen_beside_a_heavily_damped_mode_that_no_wall_moves():
    plant = Plant(
        np.eye(2), np.diag([0.1, 300.0]), np.diag([0.0, 1e4]), np.array([1.0, 0.0]), np.array([1.0, 0.0])
    )
    found = bounds(Loop(plant, Controller(0.001)))
    assert found[RIGID].violated == (registry.UNDAMPED,)
    assert found[PASSIVE].violated == ()
    assert found[PASSIVE].stiffness_max == pytest.approx(200.0)


def test_the_linear_condition_names_no_largest_stiffness():
    bound = bounds(one_mass(0.3, 0.001, b=0.1))[LINEAR]
    assert np.isnan(bound.stiffness_max)
    np.testing.assert_allclose(bound.stiffness_max_at([-0.2, 0.0, 1.0]), [0.0, 200.0, 2200.0])


def test_a_pure_spring_says_nothing_about_damped_walls():
    bound = bounds(one_mass(0.03, 0.001, b=1.0))[SPRING]
    assert bound.stiffness_max == pytest.approx(2011.17, rel=1e-5)
    assert bound.stiffness_max_at([0.0, 1.0])[0] == bound.stiffness_max
    assert np.isnan(bound.stiffness_max_at(1.0))


@pytest.mark.parametrize("name", ["five-bar", "published-two-mass", "hapkit-course"])
@pytest.mark.parametrize("model", ["full", "rigid"])
def test_bundled_devices(name, model):
    device = load(name)
    loop = Loop(device.plant(model=model), device.controller)
    for bound in compare(loop):
        assert set(bound.violated) <= set(bound.assumptions)
        assert bound.stiffness_max_at(np.zeros((2, 3))).shape == (2, 3)
        assert bound.source
        assert bound.statement
        copy = pickle.loads(pickle.dumps(bound))
        np.testing.assert_equal(copy.stiffness_max_at(1.0), bound.stiffness_max_at(1.0))


def test_the_page_has_a_row_for_every_condition():
    page = (Path(__file__).parents[2] / "docs" / "conditions.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1].strip() for line in page.splitlines() if line.startswith("|")]
    assert rows[2 : 2 + len(NAMES)] == NAMES
    for bound in compare(one_mass(1.0, 0.001, k=10.0)):
        assert all(f"`{name}`" in page for name in bound.taken if name.endswith(("_kg", "_per_m")))
