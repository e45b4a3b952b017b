"""The contact kernel against `simulate`, which has a ledger and a trail in between: equal to the bit."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contact.touch_cases import in_python, random_loop, random_touch, same_bits
from zwidth.contact import OUTPUTS, Hand, normal_number, one_sided_wall, simulate, touch, touch_obstacle, wall
from zwidth.contact.touch_step import FREE, ONE_SIDED, touch_numbers
from zwidth.loop import Controller, FirstOrder, Loop
from zwidth.model import Operator, Plant

S, SEED = 400, 3


def simulated(loop, operator, start, ports, **recorded):
    law, stiffness, damping, place, push = ports[:5]
    environment, values = wall, wall.values(stiffness=stiffness, damping=damping)
    if law == ONE_SIDED:
        environment = one_sided_wall
        values = one_sided_wall.values(stiffness=stiffness, damping=damping, no_pull=1.0)
    elif law == FREE:
        values = 0.0 * values
    return simulate(
        loop,
        environment,
        values,
        duration=(S - 1) * loop.period,
        substeps=12,
        hand=Hand(operator, push=push),
        start_position=start,
        start_velocity=0.05,
        wall_position=place,
        seed=SEED,
        **recorded,
    )


@pytest.mark.parametrize("frictions", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(12))
def test_kernel_is_simulation_to_the_bit(seed, frictions):
    loop, operator, start, device, ports, _ = random_touch(np.random.default_rng([seed, frictions]), frictions)
    counters = loop.plant.nonlinear.counters
    channels = [c if each.channel is None else each.channel for c, each in enumerate(counters)]
    normals = np.array([[normal_number(np.uint64(SEED), j, c) for c in channels] for j in range(S)])
    drawn = device.noise * normals
    mine, _ = in_python(device, ports, drawn.ravel(), S)
    kinds = [{}, {"trail": False, "ledger": False}] if frictions else [{}]
    for recorded in kinds:
        theirs = simulated(loop, operator, start, ports, **recorded)
        columns = (theirs.reading, theirs.truth, theirs.velocity, theirs.force, theirs.handle)
        for column, name in enumerate(("reading", "truth", "velocity", "force", "handle")):
            assert np.array_equal(mine[:, column], columns[column], equal_nan=True), name
    if not frictions and np.abs(mine[:, 1]).max() < 1.0:
        stored = simulated(loop, operator, start, ports).stored
        np.testing.assert_array_equal(mine[:, 6] - mine[0, 6], stored)


def test_periods_one_by_one_and_in_calls_of_several_are_the_same():
    *_, device, ports, drawn = random_touch(np.random.default_rng(5), 2)
    C = len(device.noise)
    whole, after = in_python(device, ports, drawn, 100)
    memory = device.memory.copy()
    for j in range(100):
        ports[-C:] = drawn[j * C : (j + 1) * C]
        touch(device.counts, device.numbers, memory, ports)
        assert same_bits(ports[6 : 6 + OUTPUTS], whole[j])
    assert same_bits(memory, after)


def test_push_goes_in_a_straight_line_within_a_call():
    *_, device, ports, drawn = random_touch(np.random.default_rng(6), 1)
    ports[4:6] = -1.0, 2.0
    whole, after = in_python(device, ports, drawn, 50)
    memory = device.memory.copy()
    for j in range(50):
        single = replace(device, memory=memory)
        ports[4:6] = -1.0 + 3.0 * j / 50, 7.0
        C = len(device.noise)
        row, memory = in_python(single, ports, drawn[j * C : (j + 1) * C], 1)
        assert same_bits(row[0], whole[j])
    assert same_bits(memory, after)


def test_coordinates_and_arm_of_a_held_handle():
    plant = Plant.one_mass(0.3)
    device = touch_numbers(Loop(plant, sampling_period=1e-3), Operator(0.0, 200.0, 2.0), start_position=2e-3)
    n = len(device.coordinates)
    amplitudes = device.memory[device.states_at : device.states_at + n]
    np.testing.assert_allclose(device.coordinates @ amplitudes, [2e-3], rtol=1e-14)
    # the spring of the hand alone: pushed by k x_m the handle comes to rest at x_m
    ports = device.empty_ports
    ports[4:6] = device.arm[0] * 5e-3
    outputs, _ = in_python(device, ports, np.zeros(20000), 20000)
    np.testing.assert_allclose(outputs[-1, 4], 5e-3, rtol=1e-9)


def test_loops_that_are_covered_have_no_obstacle():
    filtered = Controller(1e-3, 1.5, force_filter=FirstOrder(1e-3))
    assert touch_obstacle(Loop(Plant.one_mass(0.3), filtered)) is None
    assert touch_obstacle(random_loop(np.random.default_rng(1), 3)) is None
