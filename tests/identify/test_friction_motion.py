"""Motion of a joint between reversals against an independent integration, and where it stands."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.identify.joint.motion import flow, follow_windows


def follow(force, numbers, period=1e-3, delay=0.0, start=(0.0, 0.0), samples=None):
    out = np.zeros(len(force))
    count = len(force) if samples is None else samples
    follow_windows(
        np.asarray(force, dtype=float),
        np.array([0]),
        np.array([count]),
        np.array([period]),
        np.asarray(numbers, dtype=float),
        delay,
        np.array([start], dtype=float),
        out,
    )
    return out[:count]


@pytest.mark.parametrize(
    ("mass", "damping", "stiffness", "h"),
    [
        (1.0, 0.0, 0.0, 0.3),
        (0.02, 3.0, 0.0, 0.5),
        (0.5, 0.1, 800.0, 0.02),
        (0.5, 0.1, -80.0, 0.1),
        (0.1, -0.4, 7.0, 0.2),
        (1e-3, 40.0, 1e3, 1e-3),
    ],
)
def test_flow_is_the_matrix_exponential(mass, damping, stiffness, h):
    from scipy.linalg import expm

    A = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]])
    exact = expm(A * h)
    p11, p12, p21, p22, g1, g2 = flow(mass, damping, stiffness, h)
    assert [p11, p12, g1] == pytest.approx(exact[0], rel=1e-10, abs=1e-15)
    assert [p21, p22, g2] == pytest.approx(exact[1], rel=1e-10, abs=1e-13)


def slow_steps(force, numbers, period, delay, start, fine=2000):
    """The same motion by many small steps; at each the friction stops the joint at most."""
    m, bf, bb, ff, fb, k = numbers
    x, v = start
    out, h = [x], period / fine
    for i in range(len(force) - 1):
        for j in range(fine):
            at = int(np.floor((i * period + (j + 0.5) * h - delay) / period))
            f = force[min(max(at, 0), len(force) - 1)]
            push = f - k * x
            if v == 0.0 and -fb <= push <= ff:
                continue
            side = np.sign(v) or np.sign(push)
            level, b = (ff, bf) if side > 0 else (fb, bb)
            after = v + h / m * (push - side * level - b * v)
            x += 0.5 * h * (v + after) if after * side > 0.0 else 0.0
            v = after if after * side > 0.0 else 0.0
        out.append(x)
    return np.array(out)


@pytest.mark.parametrize("seed", range(3))
def test_a_joint_that_sticks_and_slips_moves_as_by_many_small_steps(seed):
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.normal(size=12), 3)
    numbers = (0.003, *rng.uniform(0.0, 0.5, 2), *rng.uniform(0.1, 0.6, 2), rng.choice([0.0, 20.0]))
    delay, start = rng.uniform(0.0, 2.0) * 2e-3, (0.01, 0.5)
    exact = follow(force, numbers, 2e-3, delay, start)
    close = slow_steps(force, numbers, 2e-3, delay, start, 100)
    assert np.ptp(exact) > 1e-3
    assert exact == pytest.approx(close, abs=5e-3 * np.ptp(exact))


def test_a_push_below_the_level_moves_nothing_and_one_above_it_does():
    numbers = (1.0, 0.0, 0.0, 2.0, 3.0, 0.0)
    assert not follow(np.full(50, 1.99), numbers).any()
    assert not follow(np.full(50, -2.99), numbers).any()
    assert follow(np.full(50, 2.5), numbers)[-1] == pytest.approx(0.5 * 0.5 * 0.049**2)
    assert follow(np.full(50, -3.5), numbers)[-1] == pytest.approx(-0.5 * 0.5 * 0.049**2)


def test_a_coasting_joint_stops_where_its_energy_is_used_up():
    way = follow(np.zeros(200), (2.0, 0.0, 0.0, 5.0, 5.0, 0.0), start=(0.0, 0.2))
    assert way[-1] == pytest.approx(0.5 * 2.0 * 0.2**2 / 5.0, rel=1e-12)


def test_a_force_acts_after_its_delay():
    force = np.zeros(20)
    force[5:] = 1.0
    for delay in (0.0, 0.4e-3, 2.7e-3):
        way = follow(force, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), delay=delay)
        assert way[-1] == pytest.approx(0.5 * (14e-3 - delay) ** 2, rel=1e-10)
