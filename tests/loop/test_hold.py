"""The plant between samples: closed forms against the matrix exponential and high precision."""

import mpmath
import numpy as np
import pytest

from tests.systems import held_step, mass, random_plant, two_mass
from zwidth.loop import rows_response
from zwidth.loop.hold import step_response
from zwidth.loop.sections import sampled_sections
from zwidth.model import Plant, natural_frequencies


def sampled_response(plant, period, delay_fraction, z):
    """P(z) from states: (zI - F)^-1 of the split hold."""
    n = plant.size
    F, _ = held_step(plant, period)
    Fr, new = held_step(plant, (1.0 - delay_fraction) * period)
    old = Fr @ held_step(plant, delay_fraction * period)[1] if delay_fraction else 0.0 * new
    return np.array([plant.sensor @ np.linalg.solve(p * np.eye(2 * n) - F, new + old / p)[:n] for p in z])


def precise_step(a, squared, t):
    """Position and velocity of xi'' + 2 a xi' + w^2 xi = 1 from rest with fifty digits."""
    with mpmath.workdps(50):
        a, squared, t = mpmath.mpf(a), mpmath.mpf(squared), mpmath.mpf(t)
        A = mpmath.matrix([[0, 1, 0], [-squared, -2 * a, 1], [0, 0, 0]]) * t
        E = mpmath.expm(A)
        return float(E[0, 2]), float(E[1, 2])


@pytest.mark.parametrize("ratio", [0.0, 1e-6, 0.05, 0.7, 1.0 - 1e-12, 1.0, 1.0 + 1e-9, 1.5, 30.0])
@pytest.mark.parametrize("swing", [1e-8, 1e-3, 0.3, 1.0, 3.0, 20.0])
def test_step_response_keeps_its_digits_from_rigid_to_overdamped(ratio, swing):
    squared, a = swing**2, ratio * swing
    got, want = step_response(a, squared, 1.0), precise_step(a, squared, 1.0)
    # where the oscillation passes zero the error is that of the phase
    assert got == pytest.approx(want, rel=1e-12, abs=3e-15 * max(1.0, 1.0 / swing))


@pytest.mark.parametrize(("a", "squared"), [(0.0, 0.0), (2.0, 0.0), (1e-9, 0.0), (0.0, -1.0), (0.5, -4.0)])
def test_step_response_of_free_damped_and_unstable_masses(a, squared):
    assert step_response(a, squared, 1.0) == pytest.approx(precise_step(a, squared, 1.0), rel=1e-13)


@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_sections_are_the_exact_zero_order_hold(kind):
    rng = np.random.default_rng(1)
    for _ in range(60):
        rate = 10.0 ** rng.uniform(2.3, 4.3)
        plant = random_plant(rng, rate, kind=kind)
        fraction = float(rng.choice([0.0, rng.random()]))
        z = 1.3 * np.exp(1j * rng.uniform(0.05, np.pi, 5))
        sections = sampled_sections(plant, 1.0 / rate, fraction)
        got, want = (
            rows_response(sections.rows, fraction > 0.0, z),
            sampled_response(plant, 1.0 / rate, fraction, z),
        )
        # modes cancel where force and reading are apart: the accuracy is that of a mass alone
        inertia = [v @ np.linalg.solve(plant.mass, v) for v in (plant.actuator, plant.sensor)]
        alone = np.sqrt(np.prod(inertia)) / rate**2
        assert np.max(np.abs(got - want)) <= 3e-9 * np.max(np.abs(want)) + 1e-10 * alone


def test_a_free_mass_is_the_textbook_double_integrator():
    T, m = 0.001, 0.2
    (row,) = sampled_sections(mass(m), T, 0.0).rows
    want = [0.0, 0.0, 0.0, T**2 / (2 * m), T**2 / m, 0.0, 0.0, 0.0, 0.0]
    assert row == pytest.approx(want, rel=1e-14, abs=1e-30)


def test_motion_across_the_wall_is_cancelled_and_named():
    plant = two_mass(0.3, 0.3, 1e4, 1.0)
    sideways = Plant(
        plant.mass, plant.damping, plant.stiffness, np.array([1.0, -1.0]), np.array([1.0, -1.0]), None
    )
    sections = sampled_sections(sideways, 0.001, 0.0)
    assert len(sections.rows) == 1
    assert sections.unobserved == ("rigid motion (0 Hz)",)


def test_two_equal_modes_are_one_pair_of_poles_and_one_named_mode():
    eye = np.eye(2)
    plant = Plant(eye, 2.0 * eye, 1e4 * eye, np.array([0.6, 0.8]), np.array([0.6, 0.8]), None)
    sections = sampled_sections(plant, 0.001, 0.0)
    single = sampled_sections(mass(1.0, 2.0, 1e4), 0.001, 0.0)
    assert sections.rows == pytest.approx(single.rows, rel=1e-12)
    (mode,) = sections.unobserved
    assert mode.startswith("mode at 15.92 Hz ")


def test_rigid_frequencies_are_exactly_zero():
    assert natural_frequencies(two_mass(0.3, 0.02, 1e4))[0] == 0.0


def coupled_critical_pair(detuning):
    """M = I, K = diag(1, 4) and a coupled B for which (s^2 + b1 s + 1)(s^2 + b2 s + 4) - c^2 s^2 has the double
    root -p and one mode only; the detuning moves b1."""
    p, q = 1.5, 2.0
    b1 = (p * p * q + 8.0 / p - 2.0 * p - q) / 3.0
    b2 = 2.0 * p + q - b1
    c = np.sqrt(5.0 + b1 * b2 - p * p - 2.0 * p * q - 4.0 / p**2)
    B = np.array([[b1 * (1.0 + detuning), c], [c, b2]])
    return Plant(np.eye(2), B, np.diag([1.0, 4.0]), np.ones(2), np.ones(2), None)


@pytest.mark.parametrize("detuning", [0.0, 1e-14, 1e-9, -1e-9, 1e-5, -1e-5])
def test_a_coupled_pair_at_critical_damping_keeps_its_digits(detuning):
    plant = coupled_critical_pair(detuning)
    z = np.array([1.3 + 0.2j, 0.7j, np.exp(0.1j)])
    got = rows_response(sampled_sections(plant, 0.1, 0.4).rows, True, z)
    assert got == pytest.approx(sampled_response(plant, 0.1, 0.4, z), rel=1e-11)


def test_where_two_braked_motions_come_to_rest_is_one_pole():
    """Two free, coupled coordinates with friction: what the sensor reads of where they stop is one number."""
    M = np.array([[0.2, 0.12], [0.12, 0.3]])
    z = np.array([1.3 + 0.2j, 0.7j, np.exp(0.1j)])
    for B in (np.eye(2), np.array([[1.0, 0.3], [0.3, 0.5]])):
        for sensor in (np.array([1.0, 0.0]), np.array([0.3, -1.0])):
            plant = Plant(M, B, np.zeros((2, 2)), np.array([1.0, 0.0]), sensor)
            sections = sampled_sections(plant, 0.01, 0.4)
            assert rows_response(sections.rows, True, z) == pytest.approx(
                sampled_response(plant, 0.01, 0.4, z), rel=1e-11
            )
            at_one = np.count_nonzero(np.abs(sections.rows[:, 1]) < 1e-14)
            assert at_one == 1
            assert sections.unobserved == ("rigid motion (0 Hz)",)
