"""Dry friction, encoder steps and electrical damping: closed forms with numbers that may be missing."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conditions.conditions_cases import one_mass
from zwidth.conditions import abbott_okamura, colgate_schenkel, compare, diolaiti, mehling

ENCODER, PLANE = "passive spring under an encoder", "passive spring with its delay, under an encoder"


def conditions_by_name(loop, **known):
    return {bound.name: bound for bound in compare(loop, **known)}


def test_the_lesser_of_two_limits():
    assert float(abbott_okamura.stiffness_limit(0.1, 1.0, 0.001, 1e-4)) == 200.0
    assert float(abbott_okamura.stiffness_limit(0.1, 0.005, 0.001, 1e-4)) == pytest.approx(100.0)
    b = np.array([[0.1], [1.0]])
    assert abbott_okamura.stiffness_limit(b, 0.1, 0.001, [1e-5, 1e-3, 1e-2]).shape == (2, 3)


def test_a_fine_encoder_leaves_colgate_and_schenkel():
    limit = abbott_okamura.stiffness_limit(0.7, 0.0, 0.001, 0.0)
    assert float(limit) == pytest.approx(1400.0)
    assert float(limit) == pytest.approx(float(colgate_schenkel.stiffness_limit(0.0, 0.7, 0.001)))
    assert float(abbott_okamura.stiffness_limit(0.7, 0.0, 0.001, 1e-5)) == 0.0


@pytest.mark.parametrize("missing", range(4))
def test_a_missing_number_leaves_no_limit(missing):
    given = [0.1, 0.05, 0.001, 1e-4]
    given[missing] = np.nan
    assert np.isnan(abbott_okamura.stiffness_limit(*given))


def test_the_plane_and_its_passive_quadrant():
    """The corner of the quadrant is Abbott and Okamura's limit; with delay the viscous side moves."""
    b, f, T, step = 0.5, 0.02, 0.001, 2e-5
    edge = float(abbott_okamura.stiffness_limit(b, f, T, step))
    assert np.min(diolaiti.dimensionless_friction(edge, b, f, T, step)) == pytest.approx(0.5)
    beta, sigma = diolaiti.dimensionless_friction(1000.0, b, f, T, step)
    assert (float(beta), float(sigma)) == pytest.approx((0.5, 1.0))
    late = float(diolaiti.viscous_stiffness_limit(b, T, 2))
    assert float(diolaiti.dimensionless_friction(late, b, f, T, step)[0]) == pytest.approx(2.5)


def test_missing_numbers_are_named():
    found = conditions_by_name(one_mass(0.3, 0.001, b=0.5))
    for name in (ENCODER, PLANE):
        assert found[name].lacking == ("coulomb_friction_N", "resolution_m")
        assert not found[name].holds
        assert np.isnan(found[name].stiffness_max)
        assert np.all(np.isnan(found[name].stiffness_max_at([0.0, 1.0])))
    half = conditions_by_name(one_mass(0.3, 0.001, b=0.5), resolution=1e-5)
    assert half[ENCODER].lacking == ("coulomb_friction_N",)


def test_given_numbers_are_used():
    found = conditions_by_name(one_mass(0.3, 0.001, b=0.5, delay=1.0), coulomb_friction=0.001, resolution=1e-5)
    assert found[ENCODER].stiffness_max == pytest.approx(200.0)
    assert found[PLANE].stiffness_max == pytest.approx(200.0)
    assert found[ENCODER].damping_at_stiffness_max == 0.0
    assert np.isnan(found[ENCODER].stiffness_max_at(1.0))
    ample = conditions_by_name(one_mass(0.3, 0.001, b=0.5, delay=1.0), coulomb_friction=0.1, resolution=1e-5)
    assert ample[ENCODER].stiffness_max == pytest.approx(1000.0)
    assert ample[PLANE].stiffness_max == pytest.approx(500.0 / 1.5)
    assert ample[PLANE].holds
    assert not ample[ENCODER].holds


def test_an_encoder_without_steps():
    found = conditions_by_name(one_mass(0.3, 0.001, b=0.5), coulomb_friction=0.0, resolution=0.0)
    assert found[ENCODER].stiffness_max == found[PLANE].stiffness_max == pytest.approx(1000.0)


def test_electrical_damping_is_friction_below_its_corner():
    limit = mehling.stiffness_limit([0.0, 1.0, 4.0], 0.2, 3.0, 0.001)
    np.testing.assert_allclose(limit, [6400.0, 4400.0, 0.0])
