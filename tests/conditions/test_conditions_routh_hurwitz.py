"""The Moebius map and Hurwitz's determinants (thesis Appendix A) against roots and computer algebra."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from tests.conditions.conditions_cases import devices, one_mass
from zwidth.conditions import routh_hurwitz as rh


@pytest.mark.parametrize("degree", range(1, 7))
def test_stable_means_all_roots_in_the_left_half_plane(degree):
    rng = np.random.default_rng(degree)
    p = rng.normal(size=(400, degree + 1))
    p[::2] = [np.poly(-np.abs(rng.normal(size=degree))) for _ in range(200)]  # half of them stable
    truth = np.array([np.all(np.roots(one).real < 0.0) for one in p])
    assert 0.4 < np.mean(truth) < 1.0
    assert np.array_equal(rh.is_stable(p), truth)
    assert np.array_equal(rh.is_stable(-p), truth)


@pytest.mark.parametrize("degree", range(1, 7))
def test_mapped_means_all_roots_inside_the_circle(degree):
    rng = np.random.default_rng(10 + degree)
    radius = rng.uniform(0.3, 1.4, (300, 1))
    p = np.array([np.poly(r * np.exp(1j * rng.uniform(0, 2 * np.pi, degree))).real for r in radius])
    truth = np.array([np.all(np.abs(np.roots(one)) < 1.0) for one in p])
    assert np.array_equal(rh.is_stable(rh.bilinear_coefficients(p)), truth)


def test_the_map_is_the_one_of_the_thesis():
    """(4.27): the map of (4.26) for l = 0."""
    z, sigma, p, d = sp.symbols("z sigma p d")
    polynomial = z**3 - 2 * z**2 + z + (p + d) * z**2 / 2 + p * z / 2 - d / 2
    direct = sp.Poly(sp.expand(sp.cancel(polynomial.subs(z, (sigma + 1) / (sigma - 1)) * (sigma - 1) ** 3)), sigma)
    assert direct.all_coeffs() == [p, 2 * d, 4 - 2 * d - p, 4]
    at = {p: 0.3, d: 0.7}
    numbers = [float(a.subs(at)) for a in sp.Poly(polynomial, z).all_coeffs()]
    assert rh.bilinear_coefficients(numbers) == pytest.approx([float(a.subs(at)) for a in direct.all_coeffs()])


def test_the_minors_are_those_of_hurwitz():
    a = sp.symbols("a0:5")
    table = sp.Matrix(4, 4, lambda i, j: a[2 * i - j + 1] if 0 <= 2 * i - j + 1 <= 4 else 0)
    at = dict(zip(a, (1.0, 2.5, 3.0, 1.5, 0.4), strict=True))
    expected = [float(table[:k, :k].det().subs(at)) for k in range(1, 5)]
    assert rh.principal_minors(list(at.values())) == pytest.approx(expected)


def test_it_judges_loops_as_eigenvalues_do():
    for m, T, rng in devices(44, 10):
        loop = one_mass(m, T, b=rng.uniform(0.0, 1.0) * m / T, delay=float(rng.integers(0, 3)))
        for _ in range(10):
            L = loop.transition_matrix(rng.uniform(-0.1, 1.0) * m / T**2, rng.uniform(-0.2, 2.0) * m / T)
            inside = bool(np.all(np.abs(np.linalg.eigvals(L)) < 1.0))
            assert bool(rh.is_stable(rh.bilinear_coefficients(np.poly(L)))) == inside


def test_a_root_lost_to_infinity_is_not_stable():
    assert not rh.is_stable(rh.bilinear_coefficients([1.0, -1.0]))
    assert rh.bilinear_coefficients(np.ones((2, 3, 4))).shape == (2, 3, 4)
    assert rh.hurwitz_matrix(np.ones((2, 4))).shape == (2, 3, 3)
