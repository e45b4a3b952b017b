"""Motions that nothing couples to the wall: a chart is that of the rest, however rounding mixes the shapes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from zwidth.loop import Controller, Loop
from zwidth.model import Plant, undamped_modes
from zwidth.model.first_order_form import separated_modes
from zwidth.model.modes import real_modes

PERIOD = 1e-3


def random_plant(rng, size):
    """Masses on springs and dampers of any size, one of them free, held and read at the first."""
    mass = 10.0 ** rng.uniform(-2.0, 0.0, size)
    stiffness, damping = np.zeros((size, size)), np.zeros((size, size))
    for i in range(1, size):
        between = np.zeros(size)
        between[i], between[rng.integers(i)] = 1.0, -1.0
        frequency = 10.0 ** rng.uniform(1.0, 2.7)
        k = mass[i] * (2.0 * np.pi * frequency) ** 2
        stiffness += k * np.outer(between, between)
        damping += 10.0 ** rng.uniform(-5.0, -1.0) * k / (np.pi * frequency) * np.outer(between, between)
    damping[0, 0] += 10.0 ** rng.uniform(-2.0, 0.5)
    at_first = np.eye(size)[0]
    return Plant(np.diag(mass), damping, stiffness, at_first, at_first)


def turned(rng, plant):
    """The plant in other coordinates, whose shapes are known to rounding only."""
    size = plant.size
    axes = np.linalg.qr(rng.normal(size=(size, size)))[0] * 10.0 ** rng.uniform(-0.5, 0.5, size)
    parts = (axes.T @ matrix @ axes for matrix in (plant.mass, plant.damping, plant.stiffness))
    mass, damping, stiffness = ((part + part.T) / 2.0 for part in parts)
    return Plant(mass, damping, stiffness, axes.T @ plant.actuator, axes.T @ plant.sensor)


def beside(one, other, share):
    """Two plants that nothing couples; the wall acts on both, by the shares sqrt(1 - share^2) and share."""
    matrices = (
        block_diag(a, b)
        for a, b in ((one.mass, other.mass), (one.damping, other.damping), (one.stiffness, other.stiffness))
    )
    ends = (
        np.append(np.sqrt(1.0 - share**2) * a, share * b)
        for a, b in ((one.actuator, other.actuator), (one.sensor, other.sensor))
    )
    return Plant(*matrices, *ends)


@pytest.mark.parametrize("seed", range(12))
def test_two_equal_plants_under_one_wall_are_one(seed):
    """As of a device that is the same along two axes, with its wall between them."""
    rng = np.random.default_rng([20261126, seed])
    alone = random_plant(rng, int(rng.integers(2, 5)))
    both = turned(rng, beside(alone, alone, float(rng.uniform(0.1, 0.9))))
    expected, chart = (Loop(plant, Controller(PERIOD)).chart() for plant in (alone, both))
    assert chart.stiffness_max == pytest.approx(expected.stiffness_max, rel=1e-7)
    assert chart.damping_max == pytest.approx(expected.damping_max, rel=1e-7)
    assert len(chart.unobserved_modes) >= alone.size


@pytest.mark.parametrize("seed", range(12))
def test_vibrations_beside_the_wall_change_nothing(seed):
    rng = np.random.default_rng([20261127, seed])
    alone, other = random_plant(rng, int(rng.integers(2, 5))), random_plant(rng, 3)
    expected = Loop(alone, Controller(PERIOD)).chart()
    chart = Loop(turned(rng, beside(alone, other, 0.0)), Controller(PERIOD)).chart()
    assert chart.stiffness_max == pytest.approx(expected.stiffness_max, rel=1e-7)
    assert len(chart.unobserved_modes) >= other.size - 1


@pytest.mark.parametrize("share", [0.0, 1e-4, 0.3])
def test_what_a_damper_of_others_moves_is_not_idle(share):
    """Two equal oscillators, the wall on the first: a damper between them moves the second."""
    squared, shapes = np.full(2, 4.0e4), np.eye(2)
    damping = np.array([[2.0, -2.0 * share], [-2.0 * share, 2.0]])
    plant = Plant(np.eye(2), damping, np.diag(squared), shapes[0], shapes[0])
    _, moved = separated_modes(plant, squared, shapes, plant.actuator[None])
    assert moved.tolist() == [True, share > 0.0]


def test_equal_modes_are_turned_to_the_wall():
    """Three equal oscillators under a wall along (3, 4, 0)/5: one of them moves."""
    plant = Plant(
        np.eye(3), 0.1 * np.eye(3), 900.0 * np.eye(3), np.array([0.6, 0.8, 0.0]), np.array([0.6, 0.8, 0.0])
    )
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    turned_shapes, moved = separated_modes(plant, squared, shapes, plant.actuator[None])
    assert moved.tolist() == [True, False, False]
    assert np.abs(turned_shapes[:, 0] @ plant.actuator) == pytest.approx(1.0, abs=1e-15)
    assert turned_shapes.T @ turned_shapes == pytest.approx(np.eye(3), abs=1e-15)


def test_slow_motions_beside_a_fast_one_are_not_taken_for_one():
    """Frequencies a thousandth apart, whose dampers couple them: no turning of the two shapes takes that away."""
    stiffness, damping = np.diag([1.0, 1.001, 1e14]), np.diag([0.1, 0.1, 1.0])
    damping[0, 1] = damping[1, 0] = 0.05
    along = np.ones(3)
    assert real_modes(Plant(np.eye(3), damping, stiffness, along, along)) is None
    equal = np.diag([1.0, 1.0, 1e14])
    assert real_modes(Plant(np.eye(3), damping, equal, along, along)) is not None
