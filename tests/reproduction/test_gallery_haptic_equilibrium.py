"""The equilibrium and its linearisation by two routes that share no code, and what neglecting would be worth."""

from __future__ import annotations

import numpy as np
import pytest

from tests.lazy_module import LazyModule

both = LazyModule("gallery.haptic_equilibrium")


def test_the_circles_of_the_second_route_meet_at_the_handle():
    np.testing.assert_allclose(both.handle(both.angles), both.POSITION, atol=1e-14)
    np.testing.assert_allclose(both.jacobian(both.angles), both.here.jacobian, rtol=1e-12)


def test_both_routes_have_the_same_balance():
    assert both.found.sideways_force[0] == pytest.approx(both.across, rel=1e-8)
    assert both.found.wall_force == pytest.approx(both.wall_force, rel=1e-10)
    np.testing.assert_allclose(both.found.counted.angles[[0, 2]], both.counted, rtol=1e-10)


def test_both_routes_have_the_same_slowest_root():
    assert both.spectral_radius > 1.0 + 1e-4
    assert both.spectral_radius == pytest.approx(both.radius_by_hand, abs=1e-10)


def test_what_the_thesis_neglects_matters_along_the_surface_alone():
    assert abs(both.change - both.change_neglected) < 1e-6
    assert both.growth_neglected > 50.0 * both.growth
