"""The structural deformation ratio against two masses by hand, a shaken structure in time, and a fine scan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
from numpy.testing import assert_allclose

from tests.systems import mass, random_plant, two_mass, with_lagged_dampers
from zwidth.errors import HandleError
from zwidth.measures import deformation_ratio, structural_distortion


def random_structure(rng, kind="chain", ratios=(0.001, 0.01, 0.05, 0.3, 1.0)):
    """A chain with its handle at the far end, or within."""
    plant = random_plant(rng, 1000.0, ratios, kind)
    return replace(plant, handle=rng.permutation(np.eye(plant.size))[0])


def by_forces(plant, frequency):
    """x_h/x_a of the motions that a force at the actuator makes: the other route to the same ratio."""
    s = 2j * np.pi * frequency
    D = s**2 * plant.mass + s * plant.damping + plant.stiffness
    for damper in plant.lagged_dampers:
        D = D + damper.damping * s / (1.0 + s * damper.time_constant) * np.outer(damper.along, damper.along)
    if plant.hysteresis is not None:
        D = D + 1j * plant.hysteresis
    x = np.linalg.solve(D, plant.actuator.astype(complex))
    return (plant.handle @ x) / (plant.actuator @ x)


def test_two_masses_by_hand():
    m1, k, b = 0.26, 15620.0, 1.9
    plant = two_mass(m1, 0.025, k, b)
    f = np.geomspace(0.01, 1000.0, 50)
    w = 2.0 * np.pi * f
    assert_allclose(deformation_ratio(plant, f), (k + 1j * w * b) / (k - w**2 * m1 + 1j * w * b), rtol=1e-12)
    # the motor side's mass has no part in it
    assert_allclose(deformation_ratio(two_mass(m1, 7.0, k, b), f), deformation_ratio(plant, f), rtol=1e-12)


def test_far_below_the_resonance_its_digits_are_kept():
    """1 - S = -w^2 m/(k - w^2 m), at a millionth of the resonance, to twelve digits of itself."""
    m1, k = 0.26, 15620.0
    w = 1e-6 * np.sqrt(k / m1)
    found = structural_distortion(two_mass(m1, 0.025, k), w / (2.0 * np.pi))
    assert found == pytest.approx(w**2 * m1 / (k - w**2 * m1), rel=1e-9)


@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_against_forces(kind):
    rng = np.random.default_rng(98)
    for i in range(25):
        plant = random_structure(rng, kind)
        if i % 3 == 0:
            plant = with_lagged_dampers(rng, plant, 1000.0)
        if i % 5 == 0:
            plant = replace(plant, hysteresis=0.1 * plant.stiffness)
        for f in 10.0 ** rng.uniform(-0.5, 3.5, 6):
            expected = by_forces(plant, f)
            assert abs(deformation_ratio(plant, f) - expected) < 1e-8 * max(1.0, abs(expected)), (i, f)


def test_against_a_shaken_structure():
    """Three masses in a chain, the last shaken by a sine until only the steady motion is left, by integration."""
    m, k, b, f = (0.3, 0.2, 0.05), (4000.0, 9000.0), (3.0, 4.0), 17.0
    link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    K, B = np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(2):
        K[i : i + 2, i : i + 2] += k[i] * link
        B[i : i + 2, i : i + 2] += b[i] * link
    ends = {"actuator": np.eye(3)[2], "sensor": np.eye(3)[2], "handle": np.eye(3)[0]}
    plant = replace(random_plant(np.random.default_rng(0), 1e3), mass=np.diag(m), damping=B, stiffness=K, **ends)
    w = 2.0 * np.pi * f

    def motion(t, y):
        x = np.array([y[0], y[1], np.sin(w * t)])
        v = np.array([y[2], y[3], w * np.cos(w * t)])
        force = -(K @ x + B @ v)
        return [y[2], y[3], force[0] / m[0], force[1] / m[1]]

    late = np.linspace(119.0, 120.0, 60, endpoint=False) / f
    run = scipy.integrate.solve_ivp(motion, (0.0, 120.0 / f), np.zeros(4), "DOP853", late, rtol=1e-9, atol=1e-11)
    amplitude = 2.0 * np.mean(run.y[0] * np.exp(-1j * w * late)) * 1j
    assert amplitude == pytest.approx(complex(deformation_ratio(plant, f)), abs=1e-6)


def test_the_largest_distortion_is_that_of_a_fine_scan():
    rng = np.random.default_rng(12)
    for _ in range(20):
        plant, top = random_structure(rng, ratios=(0.05, 0.1, 0.7, 1.5)), 10.0 ** rng.uniform(0.5, 3.2)
        found = structural_distortion(plant, top)
        # a tenth of the half width of a resonance
        sizes = np.abs(1.0 - deformation_ratio(plant, np.geomspace(1e-5 * top, top, 3000)))
        assert sizes.max() * (1.0 - 1e-9) <= found <= sizes.max() * 1.01


def test_it_never_falls_with_the_frequency():
    plant = random_structure(np.random.default_rng(3))
    found = [structural_distortion(plant, f) for f in np.geomspace(1.0, 1000.0, 40)]
    assert np.all(np.diff(found) >= -1e-9 * np.array(found[1:]))


def test_a_resonance_without_damping():
    plant = two_mass(0.25, 0.05, 1e4)
    resonance = np.sqrt(1e4 / 0.25) / (2.0 * np.pi)
    assert structural_distortion(plant, 1.001 * resonance) == np.inf
    below = structural_distortion(plant, 0.9 * resonance)
    assert below == pytest.approx(0.81 / (1.0 - 0.81), rel=1e-9)
    # a loss factor limits it: |w^2 m/(k (1 + i eta) - w^2 m)| is largest at w^2 = k (1 + eta^2)/m
    lossy = replace(plant, hysteresis=0.1 * plant.stiffness)
    assert structural_distortion(lossy, 2.0 * resonance) == pytest.approx(np.sqrt(1.01) / 0.1, rel=1e-6)


def test_a_resonance_that_the_actuator_does_not_drive():
    """Two equal arms on the actuator, the handle between: their motion against each other is not driven."""
    K = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, -1.0, 2.0]]) * 1e4
    ends = {"actuator": np.eye(3)[2], "sensor": np.eye(3)[2], "handle": np.array([0.5, 0.5, 0.0])}
    mass, none = np.diag([0.25, 0.25, 0.1]), np.zeros((3, 3))
    plant = replace(two_mass(1.0, 1.0, 1.0), mass=mass, damping=none, stiffness=K, **ends)
    damped = replace(plant, damping=2.0 * np.outer([1.0, 1.0, -2.0], [1.0, 1.0, -2.0]))
    assert structural_distortion(plant, 100.0) == np.inf
    assert 1.0 < structural_distortion(damped, 100.0) < 100.0


def test_a_rigid_device_does_not_deform():
    assert structural_distortion(mass(0.3, 1.0), 100.0) == 0.0
    assert deformation_ratio(mass(0.3), [1.0, 100.0]).tolist() == [1.0, 1.0]


def test_what_cannot_be_asked():
    with pytest.raises(HandleError, match="handle"):
        structural_distortion(replace(mass(1.0), handle=None), 10.0)
    for wrong in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(ValueError, match="positive and"):
            structural_distortion(mass(1.0), wrong)
        with pytest.raises(ValueError, match="positive and"):
            deformation_ratio(mass(1.0), wrong)
