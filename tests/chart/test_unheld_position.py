"""Walls without stiffness: the position that nobody holds is no root that decides.

The judge is built apart: the plant between samples by the exponential of its first-order form, delayed forces and
past readings as states, and eigenvalues of the whole, of which one z = 1 is left out.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from tests.study_sizes import EVERYDAY_SEEDS, outside_case, study_size
from zwidth.chart import judge, spectral_radii
from zwidth.device.load import load
from zwidth.loop import Controller, Loop, MultiLoop, OperatingPoint
from zwidth.model import MultiPlant, Plant

ONE, NONE = np.ones(1), np.zeros((1, 1))


def mass(kilograms: float = 0.03, damping: float = 0.1, stiffness: float = 0.0) -> Plant:
    return Plant(np.array([[kilograms]]), np.array([[damping]]), np.array([[stiffness]]), ONE, ONE, ONE)


def random_plant(rng: np.random.Generator, awkward: bool) -> Plant:
    """Masses in a row with springs between neighbours and none to the ground; dampers everywhere, or nowhere."""
    n = int(rng.integers(1, 5))
    m = 10.0 ** rng.uniform(-3 if awkward else -2, 0.5, n)
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for i in range(n - 1):
        stiffness[i : i + 2, i : i + 2] += 10.0 ** rng.uniform(2, 6 if awkward else 4) * link
        damping[i : i + 2, i : i + 2] += 10.0 ** rng.uniform(-1, 1) * link
    drag = 10.0 ** rng.uniform(-3, 0, n) * (rng.random(n) < (0.5 if awkward else 1.0))
    damping += np.diag(drag)
    at = np.eye(n)
    actuator = at[rng.integers(n)]
    sensor = at[rng.integers(n)] if awkward and rng.random() < 0.5 else actuator
    return Plant(np.diag(m), damping, stiffness, actuator, sensor, at[rng.integers(n)])


def roots_apart(plant: Plant, T: float, delay: float, B: float) -> np.ndarray:
    """All roots of a wall K = 0 with a backward difference, by states x, x', the last commands and the last
    reading."""
    n, whole = plant.size, int(delay)
    f = delay - whole
    inverse = np.linalg.inv(plant.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ plant.stiffness, -inverse @ plant.damping]])
    b = np.concatenate([np.zeros(n), inverse @ plant.actuator])

    def held(t: float) -> tuple[np.ndarray, np.ndarray]:
        whole_step = scipy.linalg.expm(np.block([[A, b[:, None]], [np.zeros((1, 2 * n + 1))]]) * t)
        return whole_step[:-1, :-1], whole_step[:-1, -1]

    late, push_late = held(f * T)
    early, push_early = held((1.0 - f) * T)
    queue = whole + (f > 0.0)
    N = 2 * n + queue + 1
    L = np.zeros((N, N))
    read = np.concatenate([plant.sensor, np.zeros(n)])
    command = np.zeros(N)  # u = -B (y - y before)/T
    command[: 2 * n], command[-1] = -B / T * read, B / T
    past = [command, *np.eye(N)[2 * n : 2 * n + queue]]
    L[: 2 * n, : 2 * n] = early @ late
    L[: 2 * n] += np.outer(push_early, past[whole])
    if f > 0.0:
        L[: 2 * n] += np.outer(early @ push_late, past[whole + 1])
    for k in range(queue):
        L[2 * n + k] += past[k]
    L[-1, : 2 * n] = read
    return np.linalg.eigvals(L)


def without_one(z: np.ndarray) -> float:
    """Largest |z| without one root z = 1."""
    at = int(np.argmin(np.abs(z - 1.0)))
    assert abs(z[at] - 1.0) < 1e-5
    return float(np.abs(np.delete(z, at)).max())


def judge_pure_dampers(seed: int) -> int:
    """Compare verdicts of pure dampers about a random device; returns how many were decided."""
    rng = np.random.default_rng(seed)
    plant = random_plant(rng, awkward=seed % 2 == 1)
    T = 10.0 ** rng.uniform(-4, -2.5)
    delay = float(rng.choice([0.0, 1.0, rng.uniform(0.0, 3.0)]))
    loop = Loop(plant, Controller(T, delay))
    if loop.unobserved_modes:
        return 0
    size = float(np.trace(plant.mass)) / T
    damping = np.concatenate([[0.0], rng.choice([-1.0, 1.0], 8) * size * 10.0 ** rng.uniform(-5, 0.5, 8)])
    found = judge(loop, np.zeros(len(damping)), damping)
    decided = 0
    for B, verdict, radius, width in zip(
        damping, found.names, found.spectral_radius, found.uncertainty, strict=True
    ):
        exact = without_one(roots_apart(plant, T, delay, B))
        assert radius == pytest.approx(exact, abs=max(1e-7, 10.0 * width)), (seed, B)
        if abs(exact - 1.0) > 1e-6:
            assert verdict == ("stable" if exact < 1.0 else "unstable"), (seed, B, exact)
            decided += 1
    assert found.unheld.tolist() == [1] * len(damping)
    if not loop.table.rows[0, :, 8].any():
        radii = spectral_radii(loop.table, np.zeros(len(damping), dtype=np.int64), np.zeros(len(damping)), damping)
        known = np.isfinite(radii)
        assert radii[known] == pytest.approx(found.spectral_radius[known], abs=1e-7)
    return decided


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_pure_dampers_are_judged_without_the_unheld_position(seed):
    judge_pure_dampers(seed)


@pytest.mark.slow
def test_many_pure_dampers_are_judged_without_the_unheld_position():
    assert sum(judge_pure_dampers(seed) for seed in range(study_size(continuous=300, full=3000))) > 0


def test_a_velocity_that_nothing_brakes_still_counts():
    loop = Loop(mass(damping=0.0), Controller(0.001, 1.0))
    found = judge(loop, [0.0, 0.0, 0.0], [0.0, 5.0, -5.0])
    assert found.names == ["undecided", "stable", "unstable"]
    assert found.unheld.tolist() == [1, 1, 1]


def test_a_spring_to_the_ground_holds_the_position():
    loop = Loop(mass(stiffness=1e-3), Controller(0.001, 1.0))
    found = judge(loop, [0.0, 0.0], [5.0, -5.0])
    assert found.unheld.tolist() == [0, 0]
    assert found.names[1] == "unstable"
    assert judge(Loop(mass(), Controller(0.001)), [1e-9, 1000.0], [5.0, 5.0]).unheld.tolist() == [0, 0]


def test_several_directions_have_a_position_each():
    plant = MultiPlant(0.1 * np.eye(2), 0.2 * np.eye(2), np.zeros((2, 2)), np.eye(2), np.eye(2))
    found = MultiLoop(plant, Controller(0.001)).check([0.0, 0.0, 100.0], [5.0, -5.0, 5.0])
    assert found.unheld.tolist() == [2, 2, 0]
    assert found.names == ["stable", "unstable", "stable"]


def simulated(damping: float, **more):
    return OperatingPoint(Controller(0.001, 1.0), given_plant=mass()).simulate(0.0, damping, **more)


@pytest.mark.parametrize("wall", ["two-sided", "one-sided"])
def test_a_push_through_a_pure_damper_is_no_growth(wall):
    seen = simulated(5.0, push=1.0, wall=wall)
    assert (seen.stable, seen.behaviour) == (True, "drifting")
    assert not simulated(-1.0, push=1.0, start_velocity=0.01).stable
    unstable = simulated(60.0, push=1.0, start_velocity=0.01)
    assert unstable.behaviour == "growing"


def test_without_a_push_it_stays_where_it_is():
    assert simulated(5.0).stable is True
    assert simulated(60.0).stable is None  # unstable, and nothing disturbs it
    assert simulated(5.0, start_velocity=0.1).stable is True
    undamped = OperatingPoint(Controller(0.001, 1.0), given_plant=mass(damping=0.0))
    assert undamped.simulate(0.0, 0.0).stable is None  # any push would set it going for ever
    assert (
        OperatingPoint(Controller(0.001), given_plant=mass()).simulate(1e4, 0.0, start_position=0.0).stable is None
    )


def test_a_push_without_passivity_controller_drifts_too():
    seen = simulated(5.0, push=1.0, passivity_damping=50.0)
    assert seen.passivity.uncontrolled.behaviour == "drifting"


@pytest.mark.outside_cases
def test_the_viscous_knob_is_stable():
    point = load(outside_case("moments/viscous_mass.toml")).at()
    assert point.check(0.0, 5.0).names == ["stable"]
    assert point.simulate(0.0, 5.0, push=1.0).stable is True
