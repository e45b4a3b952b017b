"""Springs, couplings, and what lies within what."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.systems import mass, published
from zwidth.chart.verdict import spectral_radius
from zwidth.guarantees.coupling import coupling_angles, coupling_region, couplings, softest_limit
from zwidth.guarantees.nested import nested
from zwidth.guarantees.springs import nyquist_spring, with_spring
from zwidth.guarantees.two_port import allows, llewellyn_demand, sampled_demand
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop

ONE = np.ones(1)
M, DRAG, T = 0.03, 1.0, 0.001


@pytest.fixture(scope="module")
def paddle():
    return Loop(mass(M, DRAG), Controller(T))


@pytest.fixture(scope="module", params=["paddle", "two-mass"])
def found(request, paddle):
    return nested(paddle if request.param == "paddle" else published())


def test_the_nyquist_spring_of_a_mass(paddle):
    assert_allclose(nyquist_spring(paddle), M * (np.pi / T) ** 2, rtol=1e-12)


def test_each_guarantee_lies_within_the_next(found):
    passive, springs, nyquist, stable = (
        found[name].region.polygon for name in ("passive", "spring-stable", "nyquist-spring", "stable")
    )
    for inner, outer in ((passive, springs), (springs, nyquist), (springs, stable)):
        assert inner.area > 0.0
        assert inner.difference(outer).area < 2e-4 * inner.area


def test_unseen_springs_leave_spring_stable_walls_stable(found):
    rng = np.random.default_rng(1)
    loop, region = found.loop, found["spring-stable"].region
    ring = region.rings[0]
    centre = np.array(region.polygon.representative_point().coords[0])
    walls = centre + 0.99 * (ring[:: max(len(ring) // 30, 1)] - centre)
    for k in 10.0 ** rng.uniform(0.0, 7.5, 200):
        sprung = Loop(with_spring(loop.plant, k), loop.controller)
        assert spectral_radius(sprung, *walls.T).max() < 1.0


def test_couplings_of_a_damped_mass_have_closed_forms(paddle):
    """Raisbeck: b_c + k_c T/2 <= 4 b and (k_c T/2)^2 <= 4 b (b_c + k_c T/2); sampled: the passive wall's 2 b/T."""
    of = couplings(paddle, ONE)
    assert_allclose(
        [of.raisbeck.stiffness_max, of.sampled.stiffness_max], [8.0 * DRAG / T, 2.0 * DRAG / T], rtol=1e-6
    )
    assert of.llewellyn.polygon.contains(of.raisbeck.polygon.buffer(-1e-3))
    # Llewellyn: q^2 <= min over c in (0, 1) of p (1 + c)(2 b - c p (1 - c))/c^3, p = b_c + q, q = k_c T/2
    q, c = of.llewellyn.stiffness_max * T / 2.0, np.linspace(0.01, 1.0, 20001)
    p = of.llewellyn.damping_at_stiffness_max + q
    assert_allclose(np.min(p * (1.0 + c) * (2.0 * DRAG - c * p * (1.0 - c)) / c**3), q * q, rtol=1e-5)


def test_a_region_holds_the_couplings_that_meet_the_demand(paddle):
    demand = llewellyn_demand(paddle, coupling_angles(paddle, ONE), ONE)
    region = coupling_region(demand, T)
    rng = np.random.default_rng(2)
    k, b = rng.uniform(0.0, 1.1 * region.stiffness_max, 200), rng.uniform(-1.0, 9.0, 200)
    assert np.mean(allows(demand, k, b, T) == region.contains(k, b)) > 0.99


def test_a_stiff_wall_is_softened_to_what_is_passive(paddle):
    demand = sampled_demand(paddle, coupling_angles(paddle, ONE), ONE)
    limit = softest_limit(demand, 5000.0, 0.0, T)
    assert_allclose([limit.felt, limit.stiffness], [2000.0, 1.0 / (1.0 / 2000.0 - 1.0 / 5000.0)], rtol=1e-6)
    assert np.isinf(softest_limit(demand, 1500.0, 0.0, T).stiffness)


def test_without_a_handle_only_the_actuator_can_be_asked(paddle):
    from dataclasses import replace

    bare = Loop(replace(paddle.plant, handle=None), paddle.controller)
    found = nested(bare)
    assert_allclose(found["passive-at-actuator"].region.stiffness_max, 2000.0, rtol=1e-9)
    assert "no handle" in found["passive"].region.reason
    assert "no handle" in found["spring-stable"].region.reason
