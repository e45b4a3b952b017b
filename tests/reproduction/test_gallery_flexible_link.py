"""A flexible link lumped at its tip, by a device file and by the thesis's two inertias on a spring."""

from __future__ import annotations

import pytest

from tests.lazy_module import LazyModule

both = LazyModule("gallery.flexible_link")


def test_both_routes_have_the_same_spring_mode_and_walls():
    assert both.felt == pytest.approx(both.k_e, rel=1e-12)
    assert both.first["lumped"] == pytest.approx(both.first_by_hand, rel=1e-10)
    assert both.largest["lumped"] == pytest.approx(both.largest_by_hand, rel=1e-7)


def test_the_lump_is_near_the_first_vibration_and_modes_are_on_it():
    assert both.too_high == pytest.approx(0.0147, abs=5e-5)
    assert 0.98 < both.first["lumped"] / both.first_exact < 0.99
    for method in ("assumed-modes", "finite-elements"):
        assert both.first[method] == pytest.approx(both.first_exact, rel=1e-5)


def test_more_than_the_first_mode_lowers_the_largest_stiffness():
    assert both.largest["assumed-modes"] == pytest.approx(both.largest["finite-elements"], rel=1e-4)
    assert both.largest["assumed-modes"] < 0.9 * both.largest["lumped"]
