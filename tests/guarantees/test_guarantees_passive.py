"""Passive walls: the theorem to the letter, no passive operator makes them vibrate, and one does just outside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.systems import mass, published, random_controller, random_plant, two_mass
from zwidth.chart import spectral_radius, stability_chart
from zwidth.guarantees import passive_region, response_disks
from zwidth.guarantees.disks import force_filter_response
from zwidth.guarantees.gauge import gauge
from zwidth.guarantees.port import port, port_response
from zwidth.loop import Butterworth, Controller, FirstOrder, LeastSquaresSlope, Loop
from zwidth.model import LaggedDamper, Plant

ONE = np.ones(1)


def attach_network(plant, M, B, K):
    """The plant with a network of masses, dampers and springs; its first coordinate is the handle."""
    extra = len(M) - 1
    E = np.zeros((extra + 1, plant.size + extra))
    E[0, : plant.size] = plant.handle
    E[1:, plant.size :] = np.eye(extra)

    def grown(own, more):
        return np.pad(own, (0, extra)) + E.T @ more @ E

    ends = [np.pad(end, (0, extra)) for end in (plant.actuator, plant.sensor, plant.handle)]
    return Plant(grown(plant.mass, M), grown(plant.damping, B), grown(plant.stiffness, K), *ends)


def random_operator(rng, plant, period):
    """Up to three masses, dampers and springs on the handle, at any frequency up to six times Nyquist."""
    own = 1.0 / (plant.handle @ np.linalg.solve(plant.mass, plant.handle))
    n = int(rng.integers(0, 3))
    m = np.append(rng.choice([0.0, own * 10.0 ** rng.uniform(-2, 2)]), own * 10.0 ** rng.uniform(-3, 2, n))
    M, B, K = np.diag(m), np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    link = np.array([[1.0, -1.0], [-1.0, 1.0]])

    def rate():
        return 10.0 ** rng.uniform(-2, np.log10(6.0 * np.pi)) / period

    for i in range(n):
        k = rate() ** 2 * m[i + 1]
        K[i : i + 2, i : i + 2] += k * link
        B[i : i + 2, i : i + 2] += rng.integers(2) * 10.0 ** rng.uniform(-3, 0) * np.sqrt(k * m[i + 1]) * link
    for i in range(n + 1):
        K[i, i] += (rng.random() < 0.4) * rate() ** 2 * (m[i] or own)
        B[i, i] += (rng.random() < 0.3) * rate() * (m[i] or own) * 10.0 ** rng.uniform(-3, 0)
    return attach_network(plant, M, B, K)


def random_device(rng):
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    kind = str(rng.choice(["chain", "dense", "coupled", "apart"]))
    plant = random_plant(rng, rate, (0.01, 0.05, 0.3, 1.0, 1.5), kind)
    n = plant.size
    ground = np.diag(np.trace(plant.mass) / n * rate * 10.0 ** rng.uniform(-5, -1, n))
    held = np.eye(n)[int(rng.integers(n))]
    return Loop(replace(plant, damping=plant.damping + ground, handle=held), random_controller(rng, rate))


def resonators_at(loop, K, B, aliases=12, gap=1e-4):
    """The worst passive operator of a wall: at each alias of the worst angle a mass on a spring, all but in tune.

    Each takes the impedance to the point of the alias's disk that pushes the sampled response towards -1/H.
    """
    plant, T = loop.plant, loop.period
    theta = min(float(gauge(loop, plant.handle).largest(np.array([K]), np.array([B]))[1][0]), 3.0)
    near = np.linspace(0.98 * theta, min(1.02 * theta, 3.05), 401)
    held = port(plant, plant.handle)
    disks = response_disks(loop, held, near)
    H = K + B * loop.velocity_response(np.exp(1j * near))
    j = int(np.argmin(np.abs(-1.0 / H - disks.centre) / disks.radius))
    towards = -1.0 / H[j] - disks.centre[j]
    cycles = near[j] / (2.0 * np.pi) + np.arange(-aliases, aliases + 1)
    w = 2.0 * np.pi * cycles / T
    G = port_response(held, w)
    weight = (1.0 - np.exp(-1j * near[j])) / (1j * w * T) * np.exp(-2j * np.pi * cycles * loop.controller.delay)
    weight = (
        weight
        * force_filter_response(loop, near[j : j + 1])
        / (1.0 + 1j * w * loop.controller.actuator_time_constant)
    )
    swing = -weight * 1j * w * G.port_to_reading * G.actuator_to_port
    turn = towards / abs(towards) * swing.conj() / np.abs(swing)
    inverse = 2.0 * G.dissipation / (1.0 + turn) - 1j * w * G.port
    assert np.max(np.abs(inverse.real / inverse.imag)) < 1e-9  # lossless
    X, w = (1.0 / inverse).imag * np.sign(w), np.abs(w)
    own = w**2 * (1.0 + np.sign(X) * gap)
    k = X * (own - w**2) / w
    n = len(w)
    M, S = np.diag(np.append(0.0, k / own)), np.diag(np.append(k.sum(), k))
    S[0, 1:] = S[1:, 0] = -k
    return attach_network(plant, M, np.zeros((n + 1, n + 1)), S)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_damped_mass_has_the_theorem_of_colgate_and_schenkel(delay):
    m, b, T = 0.03, 1.0, 0.001
    loop = Loop(mass(m, b), Controller(T, float(delay)))
    theta = np.array([1e-3, 0.1, 1.0, 2.0, np.pi])
    disks = response_disks(loop, port(loop.plant, ONE), theta)
    half = np.sin(theta / 2.0)
    C = -T / (8.0 * b * half**2) * 2j * half * np.exp(-0.5j * theta) * np.exp(-1j * delay * theta)
    assert_allclose(disks.centre, C, rtol=1e-12)
    assert_allclose(disks.radius, np.abs(C), rtol=1e-12)


def test_the_passive_walls_of_a_damped_mass():
    region = passive_region(Loop(mass(0.03, 1.0), Controller(0.001)))
    assert_allclose([region.stiffness_max, region.damping_at_stiffness_max], [2000.0, 0.0], rtol=1e-9, atol=1e-9)
    K, B = region.rings[0].T
    assert_allclose(K.max(), 2000.0, rtol=1e-9)
    assert_allclose([B.min(), B.max()], [-1.0, 1.0], rtol=1e-9)
    edge = K > 1e-3
    assert_allclose((K * 0.0005 + np.abs(B))[edge], 1.0, rtol=1e-9)


def test_a_first_order_filter_helps_as_the_theorem_says():
    T, tau, b = 0.001, 0.01, 1.0
    K, B = passive_region(Loop(mass(0.03, b), Controller(T, 0.0, FirstOrder(tau)))).rings[0].T
    upper = (B > 0.0) & (K > 1e-3)
    assert_allclose((K * T / 2.0 + B * T / (2.0 * tau + T))[upper], b, rtol=1e-6)
    assert_allclose(B.min(), -b, rtol=1e-8)


def test_aliases_add_up_to_the_sampled_response():
    """With a handle that meets nothing the disks are points: P itself, by the exact hold."""
    rng = np.random.default_rng(1)
    theta = np.array([1e-2, 0.3, 1.0, 2.0, 3.0])
    one, tuned = np.array([1.0, 0.0]), Butterworth(2, 90.0)
    for _ in range(10):
        T = 10.0 ** rng.uniform(-4, -2)
        M, B, K = np.diag(rng.uniform(0.1, 1.0, 2)), np.diag(rng.uniform(0.1, 1.0, 2)), np.diag([0.0, 50.0])
        brake = LaggedDamper(one, rng.uniform(0.0, 1.0), 10.0 ** rng.uniform(-4, -1))
        plant = Plant(M, B, K, one, one, np.array([0.0, 1.0]), lagged_dampers=(brake,))
        controller = Controller(
            T, rng.uniform(0.0, 2.0), force_filter=tuned if T < 2e-3 else None, actuator_time_constant=T
        )
        loop = Loop(plant, controller)
        disks = response_disks(loop, port(plant, plant.handle), theta)
        assert_allclose(disks.centre, loop.plant_response(np.exp(1j * theta)), rtol=1e-9)
        assert_allclose(disks.radius, 0.0, atol=1e-12 * np.abs(disks.centre).max())


def test_no_passive_operator_makes_a_passive_wall_vibrate():
    rng = np.random.default_rng(3)
    tried = 0
    for _ in range(4):
        loop = random_device(rng)
        region = passive_region(loop)
        if not region.stiffness_max > 0.0:
            continue
        ring = region.rings[0]
        walls = 0.999 * ring[:: max(len(ring) // 15, 1)]
        walls = walls[np.abs(walls[:, 0]) > 1e-6 * region.stiffness_max]
        for _ in range(6):
            held = Loop(random_operator(rng, loop.plant, loop.period), loop.controller)
            assert spectral_radius(held, *walls.T).max() < 1.0 + 1e-9
            tried += len(walls)
    assert tried > 100


def test_just_outside_a_passive_operator_makes_it_vibrate():
    loop = published()
    region = passive_region(loop)
    wall = np.array([region.stiffness_max, region.damping_at_stiffness_max])
    held = Loop(resonators_at(loop, *(1.005 * wall)), loop.controller)
    assert spectral_radius(held, *(1.005 * wall)) > 1.0 + 1e-9
    assert spectral_radius(held, *(0.995 * wall)) < 1.0
    assert spectral_radius(loop, *(1.005 * wall)) < 1.0  # a free hand is no harm


def weakly_coupled_loop(coupling):
    """Two masses of which the handle's is joined to the sensor's by next to nothing."""
    link = coupling * np.array([[1.0, -1.0], [-1.0, 1.0]])
    motor, hand = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    plant = Plant(np.diag([0.05, 0.01]), np.diag([1.0, 0.1]) + 1e-3 * link, link, motor, motor, hand)
    return Loop(plant, Controller(0.001))


@pytest.mark.parametrize("coupling", [1e-6, 1e-4])
def test_a_handle_that_the_sensor_hardly_sees_leaves_the_device_s_own_walls(coupling):
    """Its own chart is all that is left as the coupling vanishes, with the stiffest wall (6996.87, 8.2647)."""
    loop = weakly_coupled_loop(coupling)
    region = passive_region(loop)
    assert_allclose(region.stiffness_max, 6996.8689, rtol=1e-7)
    assert_allclose(region.stiffness_max, stability_chart(loop).stiffness_max, rtol=1e-6)


def test_a_wall_that_a_free_hand_makes_vibrate_is_not_passive():
    M = np.diag([0.02645195889353031, 1.245408222000311])
    B = np.array([[0.093609608, -0.00022873237], [-0.00022873237, 4.396776857]])
    K = 5.883199785673256 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    motor, hand = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    controller = Controller(1.0439621914204148e-4, velocity=LeastSquaresSlope(10))
    loop = Loop(Plant(M, B, K, motor, motor, hand), controller)
    wall = 7628.31302, -4.00360746
    assert spectral_radius(loop, *wall) > 1.0 + 3e-8
    assert not passive_region(loop).contains(*wall)


def test_a_device_that_dissipates_nothing_has_no_passive_wall():
    region = passive_region(Loop(mass(0.1), Controller(0.001)))
    assert not region.rings
    assert "no wall" in region.reason


def test_a_plant_without_handle_is_asked_where_it_is_held():
    loop = Loop(replace(mass(0.1, 1.0), handle=None), Controller(0.001))
    with pytest.raises(ValueError, match="no handle"):
        passive_region(loop)
    assert_allclose(passive_region(loop, ONE).stiffness_max, 2000.0, rtol=1e-9)


@pytest.mark.parametrize("coupled", [False, True])
def test_many_frequencies_are_answered_in_batches(coupled, monkeypatch):
    plant = two_mass(0.26, 0.025, 15620.0, 1.9)
    if coupled:
        plant = replace(plant, damping=plant.damping + np.diag([0.5, 0.0]))
    held, w = port(plant, plant.sensor), np.geomspace(1.0, 1e4, 30).reshape(5, 6)
    together = port_response(held, w)
    monkeypatch.setattr("zwidth.guarantees.port.AT_ONCE", 28)
    for name, batches in vars(port_response(held, w)).items():
        np.testing.assert_allclose(batches, getattr(together, name), rtol=1e-12)
    assert port_response(held, np.zeros((0, 3))).port.shape == (0, 3)
