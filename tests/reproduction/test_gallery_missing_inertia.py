"""The example that estimates missing inertia: against energies of bars, the closed form of one mass, and its
limits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.lazy_module import LazyModule

example = LazyModule("gallery.missing_inertia")
PROXIMAL, DISTAL, BASE = 0.05, 0.07, 0.02
HANDLE, UP = np.array([[0.01, 0.09], [0.0, 1.0]])


def elbows_and_end(end):
    """Right elbow, left elbow, end point: proximal links outwards."""
    elbows = []
    for x, sign in ((BASE, -1.0), (0.0, 1.0)):
        out = end - [x, 0.0]
        far = np.hypot(*out)
        turn = np.arctan2(out[1], out[0])
        turn += sign * np.arccos((PROXIMAL**2 + far**2 - DISTAL**2) / (2 * PROXIMAL * far))
        elbows.append(np.array([x + PROXIMAL * np.cos(turn), PROXIMAL * np.sin(turn)]))
    return (*elbows, end)


def felt_mass(guess):
    """Twice the kinetic energy of all bars while the end point goes along y at 1 m/s, by differences."""
    step = 1e-6
    ahead, behind = (elbows_and_end(HANDLE + sign * step * UP) for sign in (1.0, -1.0))
    right, left, end = ((a - b) / (2 * step) for a, b in zip(ahead, behind, strict=True))
    section = guess["width"] * guess["thickness"]
    twice = guess["end mass"] * end @ end
    for elbow, part, length in ((right, "proximal", PROXIMAL), (left, "proximal", PROXIMAL)):
        bar = guess[f"{part} density"] * section * length
        twice += (bar * (length**2 / 3 + guess["width"] ** 2 / 12) + guess["rotor"]) * elbow @ elbow / length**2
    for elbow in (right, left):
        bar, turning = guess["distal density"] * section * DISTAL, (end - elbow) / DISTAL
        middle = (end + elbow) / 2
        twice += bar * middle @ middle + bar * (DISTAL**2 + guess["width"] ** 2) / 12 * turning @ turning
    return twice


@pytest.mark.parametrize("n", [0, 50, 199])
def test_an_estimate_has_the_energy_of_its_bars(n):
    assert example.masses[n] == pytest.approx(felt_mass(example.guesses[n]), rel=1e-7)


def test_the_largest_stiffness_is_as_uncertain_as_the_mass():
    np.testing.assert_allclose(example.stiffest, (12 - 8 * 2**0.5) * example.masses / 1e-6, rtol=1e-12)


def test_what_all_estimates_render_is_what_the_lightest_does():
    assert example.promised.stiffness_max == pytest.approx(example.stiffest.min(), rel=1e-9)
    assert (example.low, example.high) == pytest.approx((13_800, 30_257), rel=1e-3)


def test_the_mass_at_the_end_point_matters_most():
    assert max(example.explained, key=example.explained.get) == "end mass"
