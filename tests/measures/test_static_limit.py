"""Felt stiffness at rest, and its limit for an infinitely stiff wall, against exact fractions and closed forms."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import inf

import numpy as np
import pytest

from tests.study_sizes import EVERYDAY_SEEDS, study_size
from tests.systems import mass, two_mass
from zwidth.chart import stability_chart
from zwidth.device.load import load
from zwidth.loop import Controller, ForceSensor, Loop, OperatingPoint
from zwidth.measures import felt_chart, static_stiffness, static_stiffness_limit
from zwidth.measures.handle_impedance import static_stiffness_limit_kind
from zwidth.model import Plant

GROUND = Fraction(1, 10**90)  # N/m per kg, of springs to the ground that stand for none
WITHOUT_END = Fraction(10**40)  # N/m
FREE = Fraction(10**40)  # m/N, of a handle that nothing holds


def determinant(rows: list[list[Fraction]]) -> Fraction:
    rows, value = [list(row) for row in rows], Fraction(1)
    for n in range(len(rows)):
        pivot = next((i for i in range(n, len(rows)) if rows[i][n]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != n:
            rows[n], rows[pivot], value = rows[pivot], rows[n], -value
        value *= rows[n][n]
        for i in range(n + 1, len(rows)):
            share = rows[i][n] / rows[n][n]
            rows[i] = [x - share * y for x, y in zip(rows[i], rows[n], strict=True)]
    return value


def exact_compliance(plant: Plant, wall: Fraction) -> Fraction | None:
    """h^T (K_plant + K a s^T)^-1 h by two determinants of fractions, with weak springs to the ground, which on
    a free
    mass of 1 kg give way by 1e90 m/N; None: infinite."""
    K, a, s, h = (
        [[Fraction(x) for x in row] for row in np.atleast_2d(part)]
        for part in (plant.stiffness, plant.actuator, plant.sensor, plant.handle)
    )
    n = plant.size
    A = [
        [K[i][j] + wall * a[0][i] * s[0][j] + GROUND * Fraction(plant.mass[i, j]) for j in range(n)]
        for i in range(n)
    ]
    bordered = [[*row, h[0][i]] for i, row in enumerate(A)] + [[*h[0], Fraction(0)]]
    whole = determinant(A)
    return -determinant(bordered) / whole if whole else None


def random_plant(rng: np.random.Generator, awkward: bool) -> Plant:
    """Masses with springs of whole numbers between some of them and to the ground; directions of whole numbers."""
    n = int(rng.integers(1, 6))
    stiffness = np.zeros((n, n))
    spread = 7 if awkward else 4
    for i in range(n):
        for j in range(i):
            if rng.random() < (0.4 if awkward else 0.8):
                k = float(np.round(10.0 ** rng.uniform(0, spread)))
                stiffness[np.ix_([i, j], [i, j])] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
        if rng.random() < 0.2:
            stiffness[i, i] += float(np.round(10.0 ** rng.uniform(0, spread)))

    def end() -> np.ndarray:
        if rng.random() < 0.5:
            return np.eye(n)[rng.integers(n)]
        return rng.integers(-3, 4, size=n).astype(float) if rng.random() < 0.7 else np.ones(n)

    actuator = end()
    while not actuator.any():
        actuator = end()
    sensor = actuator if rng.random() < 0.6 else np.eye(n)[rng.integers(n)]
    handle = actuator if rng.random() < 0.2 else end()
    masses = 10.0 ** rng.uniform(-4 if awkward else -2, 1, n)
    return Plant(np.diag(masses), np.zeros((n, n)), stiffness, actuator, sensor, handle)


def judge_limit(seed: int) -> float:
    """Compare with fractions at walls from 0 to without end; returns the largest relative difference seen."""
    plant = random_plant(np.random.default_rng(seed), awkward=seed % 2 == 0)
    worst = 0.0
    for wall in (0, 10, 12345, None):
        K = WITHOUT_END if wall is None else Fraction(wall)
        exact = exact_compliance(plant, K)
        found = static_stiffness_limit(plant) if wall is None else float(static_stiffness(plant, float(wall)))
        least = 1 / Fraction(10**30)
        if exact is None or abs(exact) > FREE / 10**20:
            assert found == 0.0, (seed, wall)
        elif abs(exact) < least:
            assert found == inf, (seed, wall)
        else:
            worst = max(worst, abs(found * float(exact) - 1.0))
    assert worst < 1e-8, (seed, worst)
    limit, kind = static_stiffness_limit(plant), static_stiffness_limit_kind(plant)
    assert (kind == "infinite") == (limit == inf)
    if kind == "bound":
        felt = static_stiffness(plant, np.geomspace(1e-3, 1e12, 61))
        assert np.all(felt <= limit * (1.0 + 1e-9)), seed
        assert np.all(felt >= 0.0) or limit == 0.0 or np.any(np.linalg.eigvalsh(plant.stiffness) < 0.0), seed
    return worst


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_random_plants_are_felt_as_exact_fractions_say(seed):
    for each in range(seed, 200, 20):
        judge_limit(each)


@pytest.mark.slow
def test_many_random_plants_are_felt_as_exact_fractions_say():
    for seed in range(study_size(continuous=2000, full=20000)):
        judge_limit(seed)


@pytest.mark.parametrize("size", [1e-300, 1e-9, 1.0, 1e9])
def test_rigid_devices_have_no_limit_whatever_their_size(size):
    rng = np.random.default_rng(11)
    for _ in range(30):
        n = int(rng.integers(1, 4))
        root = rng.normal(size=(n, n))
        along = rng.normal(size=n)
        none = np.zeros((n, n))
        plant = Plant((root @ root.T + 0.1 * np.eye(n)), none, none, along, along, along)
        scaled = replace(plant, handle=along * (1.0 + 1e-16))
        assert static_stiffness_limit(scaled) == inf
        assert static_stiffness_limit_kind(scaled) == "infinite"
        if n > 1:  # a hand that pushes along another motion, which nothing holds
            assert static_stiffness_limit(replace(plant, handle=along + rng.normal(size=n))) == 0.0
        sprung = replace(plant, stiffness=size * np.outer(along, along))
        assert static_stiffness_limit(sprung) == inf


def test_a_structure_that_the_walls_force_unloads_gives_no_way():
    """Actuator, hand and sensor in a row on a soft and a stiff spring: the sensor's end carries nothing."""
    soft, stiff = 14.0, 2601863.0
    springs = np.array([[soft, -soft, 0.0], [-soft, soft + stiff, -stiff], [0.0, -stiff, stiff]])
    actuator, handle, sensor = np.eye(3)
    masses = np.diag([0.00384956, 1.12506498, 0.04794674])
    plant = Plant(masses, np.zeros((3, 3)), springs, actuator, sensor, handle)
    assert static_stiffness_limit(plant) == inf
    assert float(static_stiffness(plant, 10.0)) == pytest.approx(10.0, rel=1e-8)


def delta_directions(count: int) -> None:
    device = load("stamper-delta")
    directions = np.random.default_rng(7).normal(size=(count, 3))
    for direction in directions / np.linalg.norm(directions, axis=1)[:, None]:
        plant = device.at(direction=direction).plant
        assert static_stiffness_limit(plant) == inf
        assert float(static_stiffness(plant, 1000.0)) == pytest.approx(1000.0, rel=1e-9)


def test_rigid_drives_have_no_limit_in_any_direction():
    delta_directions(20)


@pytest.mark.slow
def test_rigid_drives_have_no_limit_in_six_hundred_directions():
    delta_directions(600)


@cache
def delta_document() -> dict:
    return load("stamper-delta").at().felt(1000.0, 2.0).document()


def test_the_result_says_which_kind_its_limit_is():
    assert delta_document()["static_stiffness_limit_kind"] == "infinite"
    pair = OperatingPoint(Controller(0.00125), given_plant=two_mass(0.2616, 0.0254, 15620.0, 1.8744))
    felt = pair.felt(4000.0, 10.0)
    assert (felt.static_stiffness_limit_kind, felt.static_stiffness_limit) == ("bound", pytest.approx(15620.0))


def test_a_sensor_beyond_the_hand_feels_walls_stiffer_than_their_limit():
    """Motor 1, hand 2, sensor 3 in a row on a grounded motor: a wall read at the far end is felt with K + ... at
    once, and with infinite stiffness at a finite K if its force over-corrects; no bound then."""
    k, ground = 1000.0, 500.0
    springs = np.array([[k + ground, -k], [-k, k]])
    plant = Plant(
        np.eye(2), np.zeros((2, 2)), springs, np.array([0.0, 1.0]), np.array([1.0, 0.0]), np.array([1.0, 0.0])
    )
    assert static_stiffness_limit(plant) == inf  # the hand is at the sensor
    opposed = replace(plant, sensor=np.array([1.0, -2.0]))
    kind, limit = static_stiffness_limit_kind(opposed), static_stiffness_limit(opposed)
    felt = static_stiffness(opposed, np.geomspace(1.0, 1e9, 200))
    assert kind == "limit"
    assert np.any(felt > limit)


@pytest.mark.parametrize(
    ("actuator", "sensor", "handle"),
    [((0.6, 0.6), (0.5, 1.3), (0.9, -0.7)), ((0.5, 0.1), (1.3, -0.4), (0.1, -0.9))],
)
def test_the_help_of_a_force_sensor_decides_whether_the_limit_is_a_bound(actuator, sensor, handle):
    springs = np.array([[1500.0, -1000.0], [-1000.0, 1000.0]])
    plant = Plant(np.eye(2), np.zeros((2, 2)), springs, np.array(actuator), np.array(sensor), np.array(handle))
    limit, kinds = static_stiffness_limit(plant), set()
    for controller in (None, Controller(0.001, force_sensor=ForceSensor(gain=2.0))):
        felt = static_stiffness(plant, np.geomspace(1e-2, 1e12, 400), controller)
        kind = static_stiffness_limit_kind(plant, controller)
        assert (kind == "limit") == bool(np.any(felt > limit * (1.0 + 1e-9)))
        kinds.add(kind)
    assert kinds == {"bound", "limit"}


def test_a_chart_says_the_same():
    loop = Loop(mass(0.1, 0.5), Controller(0.001))
    chart = felt_chart(stability_chart(loop))
    assert (chart.limit, chart.limit_kind) == (inf, "infinite")
    loop = Loop(two_mass(0.2616, 0.0254, 15620.0, 1.8744), Controller(0.00125))
    chart = felt_chart(stability_chart(loop))
    assert (chart.limit, chart.limit_kind) == (pytest.approx(15620.0), "bound")
