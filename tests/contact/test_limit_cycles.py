"""Limit cycles by harmonic balance: against the linear loop on whose edge they are, and simulation."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contact.limit_cycles_cases import random_wall, recovery_limit, simulate, vibration
from tests.systems import mass, random_loop
from zwidth.chart import eigenvalues, judge, stability_chart
from zwidth.contact import describing_functions, device_plane, limit_cycles, quiet_limit, resting_limit
from zwidth.contact.friction_quantisation_plane import BOTH, LARGE, PASSIVE, SMALL, plane_region
from zwidth.contact.harmonic_balance import harmonic_balance
from zwidth.contact.quasi_linear import equivalent_loop
from zwidth.contact.vibration_kernel import vibrations
from zwidth.loop import Controller, Loop
from zwidth.model import Counter, Friction, Nonlinear, Spring

ONE_MASS = Loop(mass(0.1, 0.1), Controller(0.001))  # stable up to 200 N/m


def edge(loop, B):
    """Stiffest stable wall at a damping, by bisection from a stable one; nan where there is none."""
    chart = stability_chart(loop, decay=False)
    low, high = 0.5 * chart.stiffness_max, 20.0 * abs(chart.stiffness_max)
    if not judge(loop, low, B).spectral_radius < 1.0 - 1e-6:
        return np.nan
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if judge(loop, middle, B).spectral_radius < 1.0 else (low, middle)
    return low


def test_a_linear_loop_has_none():
    assert limit_cycles(ONE_MASS, 400.0, 0.0) == []
    assert limit_cycles(ONE_MASS, 400.0, 0.0, resolution=0.0, coulomb_friction=0.0) == []
    assert limit_cycles(ONE_MASS, 150.0, 0.0, force_limit=1.0) == []


def test_one_mass_in_closed_form():
    """Slow against the sampling, the hold is a damping of -K T/2:  b + 4 C/(pi omega A) = N K T/2."""
    K, T, b, C = 400.0, 0.001, 0.1, 0.01
    (cycle,) = limit_cycles(ONE_MASS, K, 0.0, coulomb_friction=C)
    assert cycle.amplitude == pytest.approx(4.0 * C / (np.pi * np.sqrt(K / 0.1) * (K * T / 2.0 - b)), rel=0.002)
    assert not cycle.stable
    (cycle,) = limit_cycles(ONE_MASS, K, 0.0, force_limit=2.0)
    assert float(describing_functions.saturation(cycle.force_amplitude, 2.0)) == pytest.approx(
        2.0 * b / (K * T), rel=0.002
    )
    assert cycle.stable


def slow_cases(*values):
    """Cases for `make slow`."""
    return [pytest.param(*each, marks=pytest.mark.slow) for each in values]


@pytest.mark.parametrize(
    ("what", "seed"),
    [
        ("friction", 1),
        ("quantiser", 2),
        ("saturation", 3),
        *slow_cases(*(("friction", seed) for seed in (0, 2, 3))),
        *slow_cases(*(("quantiser", seed) for seed in (0, 1, 3))),
        *slow_cases(*(("saturation", seed) for seed in (0, 1, 2))),
    ],
)
def test_the_linear_loop_of_a_cycle_is_on_its_edge(what, seed):
    """One part at a time the equivalent loop is a plain one, which the package's own matrices judge."""
    features = [(), ("lag",), ("force-filter", "estimator"), ("electrical",)][seed % 4]
    rng = np.random.default_rng([seed, 7])
    loop = random_loop(rng, (0.01, 0.05, 0.3), features=features)
    chart = stability_chart(loop, decay=False)
    if not chart.stiffness_max > 0.0:
        return
    B = chart.damping_at_stiffness_max
    K = edge(loop, B) * (0.9 if what == "quantiser" else 1.2)
    if not np.isfinite(K):
        return
    part = {"friction": "coulomb_friction", "quantiser": "resolution", "saturation": "force_limit"}[what]
    for cycle in limit_cycles(loop, K, B, **{part: 1e-3}):
        gain, plant = 1.0, loop.plant
        if what == "friction":
            b = float(describing_functions.damper_gain(1e-3, cycle.velocity_amplitudes[0]))
            plant = replace(plant, damping=plant.damping + b * np.outer(plant.sensor, plant.sensor))
        elif what == "quantiser":
            gain = float(describing_functions.quantiser(cycle.amplitude, 1e-3))
        else:
            gain = float(describing_functions.saturation(cycle.force_amplitude, 1e-3))
        roots = eigenvalues(Loop(plant, loop.controller), gain * K, gain * B)
        on_circle = np.exp(2j * np.pi * cycle.frequency_Hz * loop.period)
        assert np.min(np.abs(roots - on_circle)) < 5e-7


def test_every_growing_root_is_a_vibration():
    """Those on the negative real axis too, which rounding may put on either side of it."""
    real = 0
    for seed in range(40):
        rng = np.random.default_rng([seed, 8])
        loop = random_loop(rng, (0.01, 0.05, 0.3))
        inertia = float(1.0 / (loop.plant.sensor @ np.linalg.solve(loop.plant.mass, loop.plant.actuator)))
        K, B = 0.1 * inertia / loop.period**2, rng.uniform(3.0, 300.0) * inertia / loop.period
        roots = eigenvalues(loop, K, B)
        roots = roots[(np.abs(roots) > 1.001) & (roots.imag >= 0.0) & (np.angle(roots) > 1e-4)]
        own = equivalent_loop(loop, K, B, Nonlinear(friction=(Friction(loop.plant.sensor, 1e-9),)))
        start = own.first_guess(1e3)  # so large that friction is nothing
        found, _ = vibrations(own._arrays, np.array([1e3, 1.0, 1e9]), 1e3, False)
        for root in roots:
            assert np.min(np.abs(found - root)) < 1e-6 * abs(root)
        assert abs(start.root) == pytest.approx(np.max(np.abs(found)), rel=1e-9)
        real += int(np.sum(roots.imag == 0.0))
    assert real >= 20


def test_most_of_these_loops_have_cycles():
    for seed in range(2):
        loop, K, B = random_wall(np.random.default_rng(seed), "two-mass")
        assert limit_cycles(loop, K, B, coulomb_friction=1.0)


def initial_state(loop, K, B, cycle, C):
    """States [x, x'] of the equivalent linear loop's critical vibration, as large as the cycle."""
    b = float(describing_functions.damper_gain(C, cycle.velocity_amplitudes[0]))
    plant = replace(loop.plant, damping=loop.plant.damping + b * np.outer(loop.plant.sensor, loop.plant.sensor))
    w = 2.0 * np.pi * cycle.frequency_Hz
    x = np.linalg.solve(
        plant.stiffness - w * w * plant.mass + 1j * w * plant.damping, plant.actuator.astype(complex)
    )
    x *= cycle.amplitude / (plant.sensor @ x)
    return np.concatenate([x, 1j * w * x]).real


@pytest.mark.parametrize(
    ("kind", "seed"), [("mass", 0), ("two-mass", 1), *slow_cases(("mass", 1), ("two-mass", 0))]
)
def test_dry_friction_is_overcome_where_predicted(kind, seed):
    """Within 4 % over the sampling rates, down to 5 samples in a cycle."""
    loop, K, B = random_wall(np.random.default_rng([seed, 5]), kind, (1.02, 1.6))
    cycle = limit_cycles(loop, K, B, coulomb_friction=1.0)[0]
    assert not cycle.stable
    start = initial_state(loop, K, B, cycle, 1.0)
    assert recovery_limit(loop, K, B, cycle, start, coulomb=1.0) == pytest.approx(cycle.amplitude, rel=0.04)


@pytest.mark.parametrize(
    ("kind", "seed"),
    [("mass", 0), ("two-mass", 1), *slow_cases(("mass", 1), ("mass", 2), ("two-mass", 0), ("two-mass", 2))],
)
def test_saturation_just_beyond_the_edge(kind, seed):
    """With forces up to a quarter beyond the limit: 12 % in amplitude, 3 % in frequency."""
    loop, K, B = random_wall(np.random.default_rng([seed, 9]), kind, (1.005, 1.03))
    for cycle in limit_cycles(loop, K, B, force_limit=1.0):
        if not cycle.stable or cycle.force_amplitude > 1.25:
            continue
        start = np.zeros(2 * loop.plant.size)
        start[: loop.plant.size] = 0.9 * cycle.amplitude
        samples = int(1000.0 / (cycle.frequency_Hz * loop.period))
        position, _ = simulate(loop, K, B, limit=1.0, start=start, samples=samples, substeps=2)
        amplitude, frequency = vibration(position, loop.period)
        assert amplitude == pytest.approx(cycle.amplitude, rel=0.12)
        assert frequency == pytest.approx(cycle.frequency_Hz, rel=0.03)


def test_a_device_pushed_between_two_counts_rests_below_the_limit_only():
    """K < 2 C/Delta - 2 B/T: at rest from every start. K > 2 C/Delta: never, there is no place."""
    rng = np.random.default_rng(3)
    for kind in ("mass", "two-mass") * 2:
        loop, K, B = random_wall(rng, kind, (0.2, 0.95))
        n, quiet = loop.plant.size, 1.02 * (K + 2.0 * B / loop.period) / 2.0
        assert float(quiet_limit(quiet, 1.0, B, loop.period)) > K
        for C, moves in ((quiet, False), (0.49 * K, True)):
            assert (float(resting_limit(C, 1.0)) < K) == moves
            for start in (0.05, 1.3, 7.0):
                state = np.zeros(2 * n)
                state[:n] = start + 0.5
                _, force = simulate(loop, K, B, coulomb=C, step=1.0, start=state, push=0.5 * K, substeps=20)
                assert (np.ptp(force[-1000:]) > 0.5 * K) == moves


def test_between_two_counts_a_stable_cycle_is_predicted_beyond_the_limit():
    loop, K, B = random_wall(np.random.default_rng(3), "mass", (0.2, 0.95))
    found = harmonic_balance(
        loop, K, B, coulomb_friction=0.2 * K, resolution=1.0, offset=0.5, amplitudes=(1e-4, 2.0)
    )
    assert any(cycle.stable for cycle in found.cycles)


def test_parts_of_the_plant_are_found_and_replaced():
    parts = Nonlinear((Friction(np.ones(1), 0.01),), (Counter(np.ones(1), 1e-5),), (), (), 1.0)
    own = Loop(replace(ONE_MASS.plant, nonlinear=parts), ONE_MASS.controller)

    def amplitudes(loop, **replaced):
        found = harmonic_balance(loop, 400.0, 0.0, amplitudes=(1e-3, 3e-2), **replaced)
        return [cycle.amplitude for cycle in found.cycles]

    given = amplitudes(ONE_MASS, coulomb_friction=[0.01], resolution=1e-5, force_limit=1.0)
    assert len(given) == 2
    assert amplitudes(own) == pytest.approx(given, rel=1e-9)
    assert amplitudes(own, coulomb_friction=0.0, resolution=0.0, force_limit=np.inf) == []
    limited = Loop(ONE_MASS.plant, replace(ONE_MASS.controller, force_limit=1.0))
    assert len(amplitudes(limited)) == 1


def test_a_hardening_spring_holds_a_growing_vibration():
    hard = Nonlinear(springs=(Spring(np.ones(1), 1e8),))
    loop = Loop(replace(mass(0.1, 0.3, 100.0), nonlinear=hard), Controller(0.001))
    (cycle,) = limit_cycles(loop, 700.0, 0.0)
    stiffer = mass(0.1, 0.3, 100.0 + 0.75e8 * cycle.amplitude**2)
    assert float(judge(Loop(stiffer, loop.controller), 700.0, 0.0).spectral_radius) == pytest.approx(1.0, abs=1e-8)


def test_growth_over_amplitude():
    found = harmonic_balance(ONE_MASS, 400.0, 0.0, coulomb_friction=0.01, force_limit=1.0, amplitudes=(1e-4, 0.1))
    assert found.amplitude[0] == 1e-4
    assert found.growth[0] < 0.0 < np.max(found.growth)
    small, large = found.cycles
    assert small.amplitude < large.amplitude
    assert (small.stable, large.stable) == (False, True)


def test_the_plane():
    assert [plane_region(1, 1), plane_region(1, 0.4), plane_region(0.4, 1), plane_region(0.4, 0.4)] == [
        PASSIVE,
        SMALL,
        LARGE,
        BOTH,
    ]
    parts = Nonlinear((Friction(2.0 * np.ones(1), 0.01),), (Counter(np.ones(1), 1e-5, 2.0),))
    loop = Loop(replace(ONE_MASS.plant, nonlinear=parts), ONE_MASS.controller)
    found = device_plane(loop, [100.0, 400.0])
    np.testing.assert_allclose(found.beta, [1.0, 0.25])
    np.testing.assert_allclose(found.sigma, [0.02 / (100.0 * 2e-5), 0.02 / (400.0 * 2e-5)])
    assert found.regions == (PASSIVE, LARGE)
