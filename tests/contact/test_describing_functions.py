"""Describing functions against numerical Fourier integrals, and derived again by computer algebra."""

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad

from zwidth.contact import describing_functions


def first_harmonic(function, amplitude, offset=0.0, breaks=()):
    """1/(pi A) times the integral of f(c + A sin) sin over a cycle, piece by piece."""
    sines = [(t - offset) / amplitude for t in breaks if abs(t - offset) < amplitude]
    angles = [angle for s in sines for angle in (np.arcsin(s), np.pi - np.arcsin(s))]
    cuts = np.unique(np.clip([-np.pi / 2, *angles, 3 * np.pi / 2], -np.pi / 2, 3 * np.pi / 2))
    parts = [
        quad(lambda x: function(offset + amplitude * np.sin(x)) * np.sin(x), a, b, epsabs=1e-14, epsrel=1e-13)[0]
        for a, b in pairwise(cuts)
    ]
    return sum(parts) / (np.pi * amplitude)


@pytest.mark.parametrize("seed", range(12))
def test_a_quantiser_anywhere_between_its_counts(seed):
    rng = np.random.default_rng(seed)
    step, offset = 10.0 ** rng.uniform(-6.0, 1.0), rng.uniform(-3.0, 3.0)
    amplitude = step * 10.0 ** rng.uniform(-1.0, 1.2)
    offset *= step
    breaks = step * (np.arange(-40, 40) + 0.5)

    def rounds(x):
        return step * np.floor(x / step + 0.5)

    expected = first_harmonic(rounds, amplitude, offset, breaks)
    assert float(describing_functions.quantiser(amplitude, step, offset)) == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )


def test_a_centred_quantiser_has_a_dead_zone_and_its_maximum():
    a = np.geomspace(0.1, 1e3, 200001)
    gain = describing_functions.quantiser(a[::20], 1.0)
    assert np.all(gain[a[::20] <= 0.5] == 0.0)
    assert np.max(gain) <= 4.0 / np.pi
    assert float(describing_functions.quantiser(2.0**-0.5, 1.0)) == pytest.approx(4.0 / np.pi, rel=1e-15)
    assert np.all(np.abs(describing_functions.quantiser([1e3, 1e5], 1.0) - 1.0) < 1e-4)
    assert describing_functions.quantiser(3.0, 0.0) == 1.0


def test_the_maximum_of_the_quantiser_by_algebra():
    a = sp.symbols("a", positive=True)
    gain = 4 / (sp.pi * a) * sp.sqrt(1 - 1 / (4 * a**2))
    (top,) = sp.solve(sp.diff(gain, a), a)
    assert top == sp.sqrt(2) / 2
    assert sp.simplify(gain.subs(a, top) - 4 / sp.pi) == 0


def test_between_two_counts_it_is_a_relay():
    a = np.array([1e-6, 1e-3, 0.3])
    np.testing.assert_allclose(describing_functions.quantiser(a, 1.0, 0.5), 2.0 / (np.pi * a), rtol=1e-14)


def test_dry_friction_by_algebra():
    C, V, x = sp.symbols("C V x", positive=True)
    twice = 2 * sp.integrate(C * sp.sin(x), (x, 0, sp.pi)) / sp.pi  # both halves of the cycle
    assert sp.simplify(twice / V - 4 * C / (sp.pi * V)) == 0
    assert float(describing_functions.damper_gain(0.3, 0.02)) == pytest.approx(
        first_harmonic(np.sign, 0.02, 0.0, [0.0]) * 0.3
    )


def test_saturation_by_algebra_and_by_integral():
    s, x = sp.symbols("s x", positive=True)
    inside = sp.integrate(sp.sin(x) ** 2, (x, 0, sp.asin(s)))
    outside = sp.integrate(s * sp.sin(x), (x, sp.asin(s), sp.pi / 2))
    gain = 4 / sp.pi * (inside + outside)
    closed = 2 / sp.pi * (sp.asin(s) + s * sp.sqrt(1 - s**2))
    assert sp.simplify(gain - closed) == 0
    for amplitude in (0.2, 1.0, 1.3, 40.0):
        expected = first_harmonic(lambda y: float(np.clip(y, -1.0, 1.0)), amplitude, 0.0, [-1.0, 1.0])
        assert float(describing_functions.saturation(amplitude, 1.0)) == pytest.approx(expected, rel=1e-12)
    assert describing_functions.saturation(5.0, np.inf) == 1.0


def test_a_bent_spring_by_integral():
    def bent(d):
        return 7.0 * d**3 + 2.0 * min(d, 0.0)

    expected = first_harmonic(bent, 0.6, 0.0, [0.0])
    assert float(describing_functions.bent_spring_gain(0.6, 7.0, 2.0, 0.0)) == pytest.approx(expected, rel=1e-12)
