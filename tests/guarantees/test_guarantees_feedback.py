"""Guarantees with feedback beside the wall law: what is known of all operators and springs, and what not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from tests.systems import mass, random_operator, two_mass
from zwidth.guarantees import find_guarantees, guarantees_of, passive_region
from zwidth.guarantees.disks import Aliases
from zwidth.guarantees.port import port
from zwidth.loop import (
    Controller,
    Feedforward,
    FirstOrder,
    ForceSensor,
    LocalLoop,
    Loop,
    OperatingPoint,
    feedforward_response,
)
from zwidth.model import attach

T = 0.001
SMALL = Feedforward(0.002, 0.1, velocity_filter=FirstOrder(0.001), acceleration_filter=FirstOrder(0.002))
TWO_MASS = two_mass(0.26, 0.025, 15620.0, 6.0)


def test_the_theorem_for_sampled_feedback_holds_with_feedforward():
    """b > (T/2)/(1 - cos wT) Re{(1 - e^-jwT) (H - C)}: the passive set of a mass with friction."""
    b = 1.5
    loop = Loop(mass(0.05, b), Controller(T, feedforward=SMALL))
    region = passive_region(loop, np.ones(1))
    theta = np.linspace(1e-4, np.pi, 20001)
    z = np.exp(1j * theta)
    difference = 1.0 - 1.0 / z
    own = feedforward_response(SMALL, T, z, z - 1.0)

    def margin(K, B):
        H = K + B * difference / T - own
        return float(np.min(b - T / 2.0 / (1.0 - np.cos(theta)) * np.real(difference * H)))

    (ring,) = region.rings
    corners = ring[np.hypot(*ring.T) > 1e-3]  # without the origin, from which the rays go out
    assert len(corners) > 20
    for K, B in corners[:: max(1, len(corners) // 40)]:
        inside, outside = margin(0.99 * K, 0.99 * B), margin(1.01 * K, 1.01 * B)
        assert inside > 0.0 > outside, (K, B)
    plain = passive_region(Loop(mass(0.05, b), Controller(T)), np.ones(1))
    assert region.stiffness_max != pytest.approx(plain.stiffness_max, rel=1e-3)


def test_the_disks_with_feedforward_hold_the_responses_of_passive_operators():
    rng = np.random.default_rng(3)
    device = two_mass(0.26, 0.025, 15620.0, 6.0)
    device = replace(device, damping=device.damping + np.diag([1.0, 0.5]))
    controller = Controller(T, 0.4, feedforward=SMALL, force_filter=FirstOrder(0.0005))
    loop, theta = Loop(device, controller), np.geomspace(0.003, 3.1, 60)
    disks = Aliases.of(loop, port(device, device.handle)).disks(theta)
    assert np.isfinite(disks.radius).all()
    for _ in range(20):
        held = Loop(attach(device, random_operator(rng)), controller)
        off = np.abs(held.plant_response(np.exp(1j * theta)) - disks.centre)
        assert np.all(off <= disks.radius * (1.0 + 1e-6) + 1e-12)


def test_passive_walls_are_stable_with_passive_operators():
    rng = np.random.default_rng(4)
    device = two_mass(0.26, 0.025, 15620.0, 6.0)
    device = replace(device, damping=device.damping + np.diag([1.0, 0.5]))
    controller = Controller(T, feedforward=SMALL)
    region = passive_region(Loop(device, controller))
    assert region.stiffness_max > 100.0
    polygon = shapely.Polygon(region.rings[0]).buffer(0.0)
    left, low, right, high = polygon.bounds
    K, B = rng.uniform(left, right, 400), rng.uniform(low, high, 400)
    inside = shapely.contains_xy(polygon, K, B)
    for _ in range(15):
        held = Loop(attach(device, random_operator(rng)), controller)
        radius = np.abs(np.linalg.eigvals(held.transition_matrix(K[inside], B[inside]))).max(axis=-1)
        assert radius.max() < 1.0


@pytest.mark.parametrize(
    ("feedback", "words", "springs", "device"),
    [
        ({"force_sensor": ForceSensor(0.5)}, "(gain 0.5)", False, TWO_MASS),
        # the springs of one mass are followed in a tenth of the time
        ({"local_loop": LocalLoop(4, damping=1.0)}, "the rate", True, mass(0.05, 1.5)),
    ],
)
def test_what_is_not_known_says_with_what(feedback, words, springs, device):
    controller = Controller(T, **feedback)
    for place in (TWO_MASS.actuator, TWO_MASS.handle):
        assert passive_region(Loop(TWO_MASS, controller), place).reason.endswith(words)
    loop = Loop(device, controller)
    guarantees = find_guarantees(loop)
    apart = ["passive-at-actuator"] if device is TWO_MASS else []
    assert [one.name for one in guarantees.guarantees][: len(apart) + 1] == [*apart, "passive"]
    for name in (*apart, "passive"):
        assert guarantees[name].region.reason.endswith(words)
    known = guarantees["spring-stable"].region.reason is None
    assert known == springs
    assert (guarantees["nyquist-spring"].region.reason is None) == springs
    assert guarantees["stable"].region.stiffness_max == loop.chart(decay=False).stiffness_max
    point = OperatingPoint(loop.controller, given_plant=loop.plant)
    assert guarantees_of(point, coupling=True).couplings.reason.endswith(words)


@pytest.mark.parametrize("damping", [60.0, pytest.param(6.0, marks=pytest.mark.slow)])
def test_spring_stable_walls_are_stable_with_every_spring(damping):
    controller = Controller(T, feedforward=replace(SMALL, inertia=0.03))
    device = two_mass(0.26, 0.025, 15620.0, damping)
    region = find_guarantees(Loop(device, controller))["spring-stable"].region
    K, B = 0.98 * region.stiffness_max, region.damping_at_stiffness_max
    for spring in (0.0, *np.geomspace(10.0, 1e7, 60)):
        held = replace(device, stiffness=device.stiffness + spring * np.outer(device.handle, device.handle))
        radius = np.abs(np.linalg.eigvals(Loop(held, controller).transition_matrix(K, B))).max()
        assert radius < 1.0, spring
