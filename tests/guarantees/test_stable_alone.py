"""No guarantee for a device that is unstable by itself; unchanged guarantees for every other."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests import study_sizes
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.guarantees import couplings, find_guarantees, guarantees_of, passive_region, spring_stable_region
from zwidth.guarantees.spring_stable import nyquist_region
from zwidth.guarantees.stable_alone import stable_alone
from zwidth.loop import Controller, Feedforward, LocalLoop, Loop
from zwidth.model import LaggedDamper, Plant

T = 1e-3
ONE = np.ones(1)
WITHHELD = ("passive-at-actuator", "passive", "spring-stable", "nyquist-spring")


def one_mass(damping=1.0, stiffness=0.0, **more):
    return Plant(np.array([[0.03]]), np.array([[damping]]), np.array([[stiffness]]), ONE, ONE, ONE, **more)


def tilting():
    """A motor, read and pushed, and a mass on it that a negative spring pulls over where the hand holds it."""
    K = np.array([[800.0, -800.0], [-800.0, 700.0]])
    return Plant(np.eye(2) * 0.5, np.eye(2), K, np.array([1.0, 0.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0]))


def loop(plant, **more):
    return Loop(plant, Controller(T, **more))


@pytest.mark.parametrize("plant", [one_mass(stiffness=-50.0), tilting()])
def test_every_set_of_a_device_that_is_unstable_alone_is_empty(plant):
    unstable = loop(plant)
    for region in (passive_region(unstable), spring_stable_region(unstable), nyquist_region(unstable)):
        assert region.rings == ()
        assert np.isnan(region.stiffness_max)
        assert region.reason == stable_alone(unstable).reason
    assert couplings(unstable, plant.handle).reason == stable_alone(unstable).reason


def test_result_document_and_repr_of_an_unstable_device_say_why():
    found = find_guarantees(loop(one_mass(stiffness=-50.0)))
    assert found["stable"].region.rings  # a wall may hold it, which the chart knows
    assert found.refusal
    assert found.refusal in repr(found)
    document = found.document()
    assert [each["holds"] for each in document["premises"]] == [False]
    for entry in document["guarantees"]:
        if entry["name"] in WITHHELD:
            assert list(entry["regions"]) == []
            assert entry["reason"] == found.refusal
    device = from_document(
        {
            "name": "d",
            "plant": {"mass_kg": 0.03, "damping_Ns_per_m": 1.0, "stiffness_N_per_m": -50.0, "handle": 1.0},
            "loop": {"sampling_period_s": T},
        }
    )
    coupled = guarantees_of(device.at(), wall=(100.0, 0.0)).couplings
    assert coupled.document() == {"reason": found.refusal}


@pytest.mark.parametrize(
    "plant",
    [
        one_mass(),
        one_mass(damping=0.0),
        one_mass(stiffness=200.0),
        Plant.two_masses(0.2, 0.03, stiffness=1e4, damping=2.0),
        one_mass(lagged_dampers=(LaggedDamper(ONE, 2.0, 1e-3),)),
    ],
)
def test_free_and_held_devices_are_stable_alone(plant):
    premise = stable_alone(loop(plant))
    assert (premise.holds, premise.how, premise.reason) == (True, "computed", "")


def test_a_damper_that_pushes_is_judged_by_its_poles():
    assert stable_alone(loop(one_mass(damping=-1.0, stiffness=100.0))).holds is False
    brakes = np.array([[1.0, -1.0], [-1.0, 1.0]])
    B, K = np.diag([-0.1, 2.0]) + 0.1 * brakes, 1e3 * np.eye(2) + 500.0 * brakes
    assert np.linalg.eigvalsh(B)[0] < 0.0
    plant = replace(tilting(), damping=B, stiffness=K)
    poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-2.0 * K, -2.0 * B]]))
    assert poles.real.max() < -1e-3
    assert stable_alone(loop(plant)).holds is True


def test_a_negative_spring_within_rounding_of_a_free_motion_is_not_known():
    K = 1e6 * np.array([[1.0, -1.0], [-1.0, 1.0]]) - 5e-7 * np.eye(2)
    plant = replace(tilting(), stiffness=K)
    premise = stable_alone(loop(plant))
    assert premise.holds is None
    assert premise.reason
    found = find_guarantees(loop(plant))["passive"].region
    assert found.warning is not None or found.rings == ()


def test_feedback_of_the_computer_counts():
    assert stable_alone(loop(one_mass(damping=0.5), feedforward=Feedforward(damping=0.2))).holds is True
    assert stable_alone(loop(one_mass(damping=0.5), feedforward=Feedforward(damping=0.8))).holds is False
    assert stable_alone(loop(one_mass(), local_loop=LocalLoop(rate_multiple=4, damping=1.0))).holds is True
    assert stable_alone(loop(one_mass(), local_loop=LocalLoop(rate_multiple=2, stiffness=1e7))).holds is False


def random_device(rng, unstable):
    """One to three masses with dampers everywhere, and springs, one negative if it is to be unstable."""
    n = int(rng.integers(1, 4))
    root = rng.normal(size=(n, n))
    M = np.diag(10.0 ** rng.uniform(-2.0, 0.0, n))
    B = root @ root.T + np.diag(10.0 ** rng.uniform(-1.0, 1.0, n))
    stiff = rng.normal(size=(n, n))
    K = 10.0 ** rng.uniform(1.0, 4.0) * stiff @ stiff.T
    if unstable:
        way = rng.normal(size=n)
        way /= np.linalg.norm(way)
        K -= (way @ K @ way) * rng.uniform(1.2, 3.0) * np.outer(way, way)
    ends = np.eye(n)[rng.integers(n, size=2)]
    plant = Plant(M, B, K, ends[0], ends[0], ends[1])
    return Loop(plant, Controller(10.0 ** rng.uniform(-3.5, -2.5), delay=float(rng.choice([0.0, 0.4, 1.0]))))


def judge_seed(seed):
    """Whether a random device grows by eigenvalues, and what it is guaranteed; walls of a guarantee with hands."""
    rng = np.random.default_rng(seed)
    device = random_device(rng, unstable=seed % 2 == 1)
    plant, n = device.plant, device.plant.size
    A = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(plant.mass, X) for X in (plant.stiffness, plant.damping)],
        ]
    )
    grows = bool(np.linalg.eigvals(A).real.max() > 0.0)
    assert grows == (seed % 2 == 1)
    assert stable_alone(device).holds is not grows
    region = passive_region(device)
    if grows:
        assert region.rings == ()
        return
    if not region.rings:
        return
    ring = region.rings[0]
    for K, B in ring[:: max(len(ring) // 6, 1)] * (1.0 - 1e-6):
        for _ in range(3):
            m, b, k = 10.0 ** rng.uniform(-3.0, 1.0), 10.0 ** rng.uniform(-3.0, 1.0), 10.0 ** rng.uniform(0.0, 5.0)
            at = np.outer(plant.handle, plant.handle)
            held = replace(
                plant, mass=plant.mass + m * at, damping=plant.damping + b * at, stiffness=plant.stiffness + k * at
            )
            z = np.linalg.eigvals(Loop(held, device.controller).transition_matrix(K, B))
            assert np.abs(z).max() < 1.0 + 1e-8


@pytest.mark.parametrize("seed", study_sizes.EVERYDAY_SEEDS)
def test_no_random_device_that_is_unstable_alone_is_guaranteed_anything(seed):
    judge_seed(seed)


@pytest.mark.slow
def test_no_random_device_that_is_unstable_alone_is_guaranteed_anything_in_full():
    for seed in range(study_sizes.study_size(continuous=40, full=100)):
        judge_seed(seed)


@pytest.mark.outside_cases
@pytest.mark.parametrize("name", ["negative_spring", "two_masses_unstable"])
def test_devices_of_others_that_are_unstable_alone(name):
    found = load(study_sizes.outside_case(f"guarantees/{name}.toml")).at().guarantees()
    assert found.refusal
    assert all(found[one.name].region.rings == () for one in found.guarantees if one.name in WITHHELD)
    assert json.dumps([each.document() for each in found.premises])
