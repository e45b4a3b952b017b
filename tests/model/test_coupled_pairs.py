"""Many plants held by an operator, and forces that lag: as each alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import zwidth
from tests.model.model_cases import KINDS, some_postures
from tests.systems import random_operator, random_plant
from zwidth.chart import ALL_NUMBERS, numbers_of_points, stability_chart
from zwidth.chart.chart_batch import STIFFEST
from zwidth.chart.edge_memory import DOUBTFUL, FOUND
from zwidth.chart.point_chart import pole_pairs_of_points
from zwidth.device.load import load
from zwidth.loop import Controller, Loop, OperatingPoint, rows_response, section_rows
from zwidth.model import ModalDamping, Operator, Plant, attach, reduce_mechanism, solve_posture
from zwidth.model.coupled_pairs import coupled_pairs
from zwidth.model.plant_modes import plant_modes
from zwidth.model.rendered_modes import RenderedModes, rendered_modes

Z = 1.02 * np.exp(1j * np.linspace(0.05, 3.0, 7))


def held_responses(
    modes: RenderedModes, operator: Operator, controller: Controller
) -> tuple[np.ndarray, np.ndarray]:
    """Responses of the held plants at some points, and which plants have them."""
    rows, used = section_rows(coupled_pairs(modes, operator, controller.sampling_period), controller)
    split = controller.delay % 1.0 > 0.0
    found = np.array([rows_response(own[:n], split, Z) for own, n in zip(rows, used, strict=True)])
    return found, used > 0


@pytest.mark.parametrize("model", ["full", "two-mass", "rigid"])
@pytest.mark.parametrize("kind", KINDS)
def test_held_mechanisms_respond_like_each_alone(kind, model):
    rng = np.random.default_rng(11)
    mechanism = KINDS[kind](rng)
    posture = some_postures(mechanism, rng, 4)
    direction = np.einsum("kid,kd->ki", posture.jacobian, rng.normal(size=posture.jacobian[:, 0].shape))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    certain = 0
    for _ in range(3):
        operator, damping = random_operator(rng), ModalDamping(float(rng.choice([0.02, 0.3, 1.4])))
        controller = Controller(0.0008, float(rng.choice([0.0, 0.4])))
        modes = rendered_modes(mechanism, posture, direction, model, damping)
        together, known = held_responses(modes, operator, controller)
        certain += int(known.sum())
        for k in np.flatnonzero(known):
            one = solve_posture(mechanism, posture.position[k])
            plant = attach(reduce_mechanism(mechanism, one, direction[k], model, damping), operator)
            alone = rows_response(Loop(plant, controller).sections.rows, controller.delay > 0.0, Z)
            assert np.abs(together[k] / alone - 1.0).max() < 1e-9
    assert certain > 9  # of 12


def test_held_plants_with_numbers_of_their_own_and_a_force_that_lags():
    rng = np.random.default_rng(12)
    count = 40
    link, motor = 10.0 ** rng.uniform(-2.0, 0.0, (2, count))
    stiffness = 10.0 ** rng.uniform(2.0, 6.0, count)
    damping = 2.0 * rng.choice([0.01, 0.2, 1.2], count) * np.sqrt(stiffness * link * motor / (link + motor))
    hand = [10.0 ** rng.uniform(a, b, count) for a, b in ((-1, 0.5), (1, 3), (0, 1.5), (2.5, 4.5), (-0.5, 2.0))]
    period, delay, lag = (
        10.0 ** rng.uniform(-4.3, -2.3, count),
        rng.uniform(0.0, 3.0, count),
        rng.uniform(0, 2, count),
    )
    lag *= period * rng.integers(0, 2, count)
    plant = replace(Plant.two_masses(link, motor, stiffness, damping), handle=np.array([1.0, 0.0]))
    pairs = coupled_pairs(plant_modes(plant), Operator(*hand), period)
    rows, used = section_rows(pairs, Controller(period, delay, actuator_time_constant=lag))
    assert (used > 0).sum() > 0.9 * count
    for i in np.flatnonzero(used):
        one = replace(plant, **{name: getattr(plant, name)[i] for name in ("mass", "damping", "stiffness")})
        controller = Controller(float(period[i]), float(delay[i]), actuator_time_constant=float(lag[i]))
        loop = Loop(attach(one, Operator(*(float(number[i]) for number in hand))), controller)
        alone = rows_response(loop.sections.rows, True, Z)
        if lag[i] == 0.0:  # beside forces that lag, the rows stand in front of the factor 1/(d + 1)
            alone = alone * Z
        assert np.abs(rows_response(rows[i, : used[i]], True, Z) / alone - 1.0).max() < 1e-9


@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_plants_of_every_kind_respond_like_each_alone(kind):
    """Free or grounded chains, dampers that couple their modes or not, actuator and sensor apart."""
    rng, certain, count = np.random.default_rng(14), 0, 0
    for size in (2, 3, 4):
        plants: list[Plant] = []
        while len(plants) < 25:
            plant = random_plant(rng, 2000.0, kind=kind)
            plants += [plant] if plant.size == size else []
        joined = {
            name: np.stack([getattr(plant, name) for plant in plants])
            for name in ("mass", "damping", "stiffness", "actuator", "sensor")
        }
        controller = Controller(0.0005, 0.4)
        point = OperatingPoint(controller, given_plant=Plant(**joined))
        rows, used = section_rows(pole_pairs_of_points(point, "full"), controller)
        for k, plant in enumerate(plants):
            count += 1
            if used[k]:
                certain += 1
                alone = rows_response(Loop(plant, controller).sections.rows, True, Z)
                assert np.abs(rows_response(rows[k, : used[k]], True, Z) / alone - 1.0).max() < 1e-8
    assert certain > 0.8 * count


def test_a_plant_that_nothing_holds_is_left_alone():
    two = Plant.two_masses(np.array([0.1, 0.2]), 0.05, 1e4, 1.0)
    plant = replace(two, handle=np.array([1.0, 0.0]))
    assert np.isnan(coupled_pairs(plant_modes(plant), Operator(0.5, 0.0, 0.0, 1e4, 5.0), 1e-3).reach).all()
    assert np.isnan(
        coupled_pairs(plant_modes(replace(plant, handle=None)), Operator(0.5, 100.0, 1.0), 1e-3).reach
    ).all()


@pytest.mark.parametrize("changes", [{"loop.actuator.time_constant_s": 0.0007}, {}], ids=["lag", "no lag"])
@pytest.mark.parametrize("held", [True, False], ids=["held", "free"])
def test_numbers_of_a_held_device_are_those_of_each_chart(changes, held):
    rng = np.random.default_rng(13)
    at = np.stack([rng.uniform(-0.1, 0.1, 12), rng.uniform(0.2, 0.28, 12), np.zeros(12)], axis=-1)
    point = load("five-bar", changes).at(at)
    if held:
        point = replace(point, operator=Operator(0.8, 580.0, 5.5, 1e4, 5.0), operator_name="an arm")
    numbers = {what: numbers_of_points(point, what) for what in (STIFFEST, ALL_NUMBERS)}
    for k in range(len(at)):
        chart = stability_chart(point[k].loop, decay=False)
        for what, found in numbers.items():
            assert found.status[k] == FOUND
            assert found.stiffness[k] == pytest.approx(chart.stiffness_max, rel=1e-9)
            if what == ALL_NUMBERS:
                assert found.largest_damping[k] == pytest.approx(chart.damping_max, rel=1e-9)
                assert found.area[k] == pytest.approx(chart.stable_area, rel=1e-9)
    assert DOUBTFUL not in numbers[ALL_NUMBERS].status


@pytest.mark.parametrize("directions", [(0.0, 1.0), (1.0, 0.0), (0.6, -0.8)])
def test_places_held_by_a_mass_alone_are_each_place(directions):
    """Its mass couples the device's free motion with the others, and nothing holds any of them."""
    device = zwidth.load("five-bar", {"operator.arm_mass_kg": 0.5, "operator.grasp": "rigid"})
    places = [(0.0, 0.25), (0.03, 0.22), (-0.05, 0.2)]
    together = device.at(places, directions).measure("stiffness_max").values
    alone = [device.at(place, directions).chart().stiffness_max for place in places]
    assert np.abs(together / alone - 1.0).max() < 1e-9
