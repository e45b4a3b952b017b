"""Adaptive windows and Levant's differentiator against formulas written out, and against what they promise."""

import pickle
import re
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from tests.loop.estimators_cases import METHODS, polynomials
from zwidth.errors import NonlinearError
from zwidth.loop import (
    BackwardDifference,
    Controller,
    Foaw,
    LeastSquaresSlope,
    Levant,
    WindowedDifference,
    velocity_of,
)
from zwidth.loop.estimators.kernels import foaw_estimate, levant_estimate

PAGE = (Path(__file__).parents[2] / "docs" / "estimators.md").read_text(encoding="utf-8")
FITS = ("end-fit", "best-fit")
T = 0.001


def longest_line(x, longest, bound, fit):
    """Slope per period and periods of the longest line that fits the newest positions; x is oldest first."""
    slope, periods = 0.0, 0
    for n in range(1, min(longest, len(x) - 1) + 1):
        part = np.array(x[len(x) - 1 - n :])
        age = np.arange(n, -1, -1)
        line = np.array([(part[-1] - part[0]) / n, part[0]])
        if fit == "best-fit":
            line = np.linalg.lstsq(np.column_stack([-age, np.ones(n + 1)]), part, rcond=None)[0]
            off = part - (line[1] - line[0] * age)
        else:
            off = (part - (line[1] + line[0] * (n - age)))[1:-1]
        if n > 1 and np.any(np.abs(off) > bound):
            break
        slope, periods = line[0], n
    return slope, periods


def reference_slopes(x, longest, bound, fit):
    """Slopes per period and windows of a whole series."""
    pairs = [longest_line(x[: j + 1], longest, bound, fit) for j in range(len(x))]
    return tuple(np.array(column) for column in zip(*pairs, strict=True))


def wandering(rng, count=150):
    """Positions of a hand that changes its mind, with noise; the size of the noise."""
    noise = 10.0 ** rng.uniform(-7.0, -4.0)
    speed = np.repeat(rng.normal(0.0, 1.0, count // 10), 10) * 10.0 ** rng.uniform(-1.0, 1.0) * noise
    return rng.normal(0.0, 0.3) + np.cumsum(speed) + noise * rng.uniform(-1.0, 1.0, speed.size), noise


@pytest.mark.parametrize("fit", FITS)
def test_an_adaptive_window_is_the_longest_that_a_line_fits(fit):
    rng = np.random.default_rng(1)
    used = []
    for _ in range(25):
        x, noise = wandering(rng)
        longest, bound = int(rng.integers(1, 30)), noise * rng.uniform(0.3, 4.0)
        want, periods = reference_slopes(x, longest, bound, fit)
        used.extend(periods)
        found = velocity_of(Foaw(longest, bound, fit), x, T) * T
        np.testing.assert_allclose(found, want, atol=1e-9 * noise)
    assert np.unique(used).size > 20  # windows of every length were met


@pytest.mark.parametrize("fit", FITS)
def test_a_window_of_one_period_is_the_backward_difference(fit):
    x, noise = wandering(np.random.default_rng(2))
    want = velocity_of(BackwardDifference(), x, T)
    np.testing.assert_allclose(velocity_of(Foaw(1, noise, fit), x, T), want, rtol=1e-9, atol=1e-12)


def test_within_a_wide_band_a_window_is_never_cut():
    x, _ = wandering(np.random.default_rng(3))
    for fit, linear in (("end-fit", WindowedDifference(12)), ("best-fit", LeastSquaresSlope(13))):
        want = velocity_of(linear, x, T)[12:]
        np.testing.assert_allclose(velocity_of(Foaw(12, 1.0, fit), x, T)[12:], want, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("fit", FITS)
def test_on_a_noisy_ramp_the_error_is_within_the_bound_of_its_window(fit):
    rng = np.random.default_rng(4)
    worst = 0.0
    for _ in range(25):
        noise, speed = 10.0 ** rng.uniform(-7.0, -4.0), rng.normal()
        x = speed * T * np.arange(200) + noise * rng.choice([-1.0, 1.0, rng.uniform(-1.0, 1.0)], 200)
        longest = int(rng.integers(1, 60))
        _, n = reference_slopes(x, longest, noise, fit)
        bound = 2.0 * noise / T / np.maximum(n, 1)
        if fit == "best-fit":
            bound = 6.0 * ((n + 1) ** 2 // 2) / np.maximum(n * (n + 1.0) * (n + 2.0), 1.0) * noise / T
            assert np.all(bound <= 3.0 * noise / T / np.maximum(n, 1))
        share = np.abs(velocity_of(Foaw(longest, noise, fit), x, T) - speed)[1:] / bound[1:]
        worst = max(worst, share.max())
    assert 0.9 < worst < 1.0 + 1e-6


def test_a_ramp_never_cuts_the_window_of_twice_its_noise():
    """The line through two ends, each off by the noise, is off the positions between by at most twice that."""
    rng = np.random.default_rng(5)
    for _ in range(25):
        step = 1e-5
        x = step * np.rint(rng.normal() + rng.normal() * np.arange(200))
        found = velocity_of(Foaw(40, step), x, T)[40:]
        np.testing.assert_allclose(found, velocity_of(WindowedDifference(40), x, T)[40:], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("speed", [0.0004, 0.001, 0.0037])  # 0.04 to 0.37 steps in a sample
def test_a_slow_hand_between_counts_is_quieter_than_by_backward_difference(speed, fit):
    """With a bound of half a step it also looks too slow, by up to a half; with a whole one it does not."""
    step = 1e-5
    x = step * np.rint(speed * T / step * np.arange(4000))
    rough = velocity_of(BackwardDifference(), x, T)[100:]
    half = velocity_of(Foaw.of_encoder(50, step, fit), x, T)[100:]
    assert 1.8 * np.std(half) < np.std(rough)
    assert 0.5 * speed < np.mean(half) < 1.01 * speed
    whole = velocity_of(Foaw(50, step, fit), x, T)[100:]
    assert 40.0 * np.std(whole) < np.std(rough)
    assert np.mean(whole) == pytest.approx(speed, rel=1e-3)


def test_a_jerk_cuts_the_window():
    """A steady hand that stops: the window shrinks to what came since, the windowed difference takes all of it."""
    x = 1e-4 * np.minimum(np.arange(100), 60)
    adaptive = velocity_of(Foaw(40, 5e-6), x, T)
    assert adaptive[60] == pytest.approx(0.1)
    np.testing.assert_allclose(adaptive[62:], 0.0, atol=1e-12)
    assert velocity_of(WindowedDifference(40), x, T)[80] == pytest.approx(0.05)


def levant_implicit(x, L, period):
    """Levant's differentiator by backward Euler, solved along the graph of the sign, on which p runs.

    From -1 to 1 p is the sign and e is 0; beyond, the sign stays and e grows.
    """
    size = L * period**2
    z0, z1, out = x[0], 0.0, []
    for reading in x:

        def ahead(p, at=z0, speed=z1, reading=reading):
            sign = np.clip(p, -1.0, 1.0)
            e = size * (p - sign)
            return reading + e - at - period * (speed - period * 1.1 * L * sign - 1.5 * sqrt(L * abs(e)) * sign)

        far = 2.0 + abs(z0 + period * z1 - reading) / size
        p = scipy.optimize.brentq(ahead, -far, far, xtol=1e-14, rtol=1e-14)
        sign = np.clip(p, -1.0, 1.0)
        z1 -= period * 1.1 * L * sign
        z0 = reading + size * (p - sign)
        out.append(z1)
    return np.array(out)


def test_levants_steps_solve_their_implicit_equation():
    rng = np.random.default_rng(6)
    for _ in range(12):
        x, noise = wandering(rng)
        period = 10.0 ** rng.uniform(-4.0, -2.0)
        L = noise / period**2 * 10.0 ** rng.uniform(-2.0, 1.0)
        found = velocity_of(Levant(L), x, period)
        np.testing.assert_allclose(found, levant_implicit(x, L, period), atol=1e-9 * noise / period)


def test_levants_differentiator_finds_a_steady_velocity_in_finite_time_and_keeps_it():
    rng = np.random.default_rng(7)
    for _ in range(25):
        L, speed = 10.0 ** rng.uniform(-1.0, 3.0), rng.normal()
        samples = int(6.0 * abs(speed) / (L * T)) + 20
        error = velocity_of(Levant(L), speed * T * np.arange(samples + 50), T)[samples:] - speed
        assert np.max(np.abs(error)) < 1e-10 * (1.0 + samples * abs(speed))


@pytest.mark.parametrize("share", [0.3, 0.99])
def test_within_its_acceleration_it_is_exact_but_for_half_a_sample(share):
    """On parabolas, and on any motion within the bound, it becomes the backward difference: late by T/2."""
    L = 20.0
    t = T * np.arange(4000)
    parabola = 0.3 * t - 0.5 * share * L * t**2
    error = velocity_of(Levant(L), parabola, T)[2500:] - (0.3 - share * L * t)[2500:]
    np.testing.assert_allclose(error, 0.5 * share * L * T, rtol=1e-7)
    rate = 2.0 * np.pi * 7.0
    x = share * L / rate**2 * np.sin(rate * t)
    want = velocity_of(BackwardDifference(), x, T)[2000:]
    np.testing.assert_allclose(velocity_of(Levant(L), x, T)[2000:], want, atol=1e-9)


def test_its_error_grows_with_the_root_of_noise_and_acceleration():
    """Motions that turn within the bound, noise of every size: between no noise at all and three roots."""
    rng = np.random.default_rng(8)
    period = 1e-4
    t = period * np.arange(20000)
    for L in (1.0, 40.0):
        push = 0.9 * L * np.sign(np.sin(2.0 * np.pi * rng.uniform(1.0, 4.0) * t))
        speed = np.cumsum(push) * period
        x = np.cumsum(speed) * period
        roots = []
        for noise in (1e-6, 1e-5, 1e-4):
            found = velocity_of(Levant(L), x + noise * rng.uniform(-1.0, 1.0, t.size), period)
            roots.append((np.max(np.abs(found - speed)[10000:]) - L * period) / sqrt(L * noise))
        assert max(roots) < 2.5
        assert max(roots) < 1.5 * min(roots) + 0.3


def test_it_knows_no_units():
    """Lengths times s and times times r: velocities times s/r, for an acceleration times s/r^2."""
    x, noise = wandering(np.random.default_rng(9))
    L = 0.3 * noise / T**2
    want = velocity_of(Levant(L), x, T)
    s, r = 37.0, 0.013
    np.testing.assert_allclose(velocity_of(Levant(L * s / r**2), s * x, r * T) * r / s, want, rtol=1e-9, atol=1e-9)


def test_it_turns_no_faster_than_its_gain_and_smooths_steps():
    step, L = 1e-5, 2.0
    x = step * np.rint(0.05 * np.sin(2.0 * np.pi * T * np.arange(3000)) / step)
    found = velocity_of(Levant(L), x, T)
    assert np.max(np.abs(np.diff(found))) <= 1.1 * L * T * (1.0 + 1e-12)
    late = velocity_of(BackwardDifference(), x, T)
    true = 0.1 * np.pi * np.cos(2.0 * np.pi * T * np.arange(3000))
    assert np.std((found - true)[1000:]) < 0.75 * np.std((late - true)[1000:])


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_linear_method_runs_as_its_polynomials_do(method):
    x, noise = wandering(np.random.default_rng(10), 400)
    want = scipy.signal.lfilter(*polynomials(method.estimator(T)), x - x[0])
    found = velocity_of(method, x, T)
    np.testing.assert_allclose(found, want, atol=1e-7 * noise / T)
    np.testing.assert_array_equal(velocity_of(method.estimator(T), x, T), found)


@pytest.mark.parametrize("method", [Foaw(9, 1e-5), Foaw(9, 1e-5, "best-fit"), Levant(3.0), LeastSquaresSlope(5)])
def test_many_series_run_as_each_does_from_wherever_it_starts(method):
    rng = np.random.default_rng(11)
    x = np.cumsum(rng.normal(0.0, 1e-5, (3, 2, 80)), axis=-1)
    together = velocity_of(method, x, T)
    for index in np.ndindex(3, 2):
        np.testing.assert_array_equal(together[index], velocity_of(method, x[index], T))
        np.testing.assert_allclose(velocity_of(method, x[index] + 0.5, T), together[index], atol=1e-9)
    assert velocity_of(method, np.zeros((2, 0)), T).shape == (2, 0)
    assert not velocity_of(method, x[..., :1], T).any()


def test_the_kernels_take_zeroed_memory_of_the_stated_size():
    x, _ = wandering(np.random.default_rng(12))
    for method, estimate in ((Foaw(7, 1e-5, "best-fit"), foaw_estimate), (Levant(4.0), levant_estimate)):
        memory = np.zeros(method.memory_size)
        found = [estimate(memory, method.parameters, reading, T) for reading in x]
        np.testing.assert_array_equal(found, velocity_of(method, x, T))


@pytest.mark.parametrize(("method", "name"), [(Foaw(5, 1e-6), "adaptive windowing"), (Levant(1.0), "Levant's")])
def test_it_has_no_chart_and_says_what_to_do(method, name):
    from tests.systems import mass
    from zwidth.chart import stability_chart
    from zwidth.loop import Loop

    for ask in (
        lambda: method.estimator(T),
        lambda: stability_chart(Loop(mass(0.3, 2.0), Controller(T, velocity=method))),
    ):
        with pytest.raises(NonlinearError, match=f"^{name}.* not linear"):
            ask()
    with pytest.raises(ValueError, match="sampling period"):
        method.estimator(-T)


def test_half_a_step_is_an_encoders_noise():
    assert Foaw.of_encoder(9, 1e-5, "best-fit") == Foaw(9, 0.5e-5, "best-fit")


def levant_explicit(x, L, period):
    """Levant's differentiator by explicit steps."""
    z0, z1, out = x[0], 0.0, []
    for reading in x:
        e = z0 - reading
        out.append(z1)
        z0, z1 = (
            z0 + period * (z1 - 1.5 * sqrt(L * abs(e)) * np.sign(e)),
            z1 - period * 1.1 * L * np.sign(e),
        )
    return np.array(out)


def test_explicit_steps_chatter_as_the_page_says_and_ours_do_not():
    L = 10.0
    assert "11 mm/s for L = 10 m/s² at 1 kHz" in PAGE
    ramp = 0.05 * T * np.arange(3000)
    jumps = np.abs(np.diff(levant_explicit(ramp, L, T)[2000:]))
    np.testing.assert_allclose(jumps, 0.011, rtol=1e-9)
    np.testing.assert_allclose(velocity_of(Levant(L), ramp, T)[2000:], 0.05, rtol=1e-9)


def test_the_pages_errors_are_ours():
    step = 1e-5
    methods = {
        "backward difference": BackwardDifference(),
        "windowed difference, 8 samples": WindowedDifference(8),
        "Levant, 0.3 m/s²": Levant(0.3),
        "Levant, 20 m/s²": Levant(20.0),
    }
    for fit in FITS:
        methods[f"{fit} to 20 periods, bound half a step"] = Foaw.of_encoder(20, step, fit)
        methods[f"{fit} to 20 periods, bound a step"] = Foaw(20, step, fit)
    t = T * np.arange(4000)
    motions = [(1e-3 * t, np.full(t.size, 1e-3))]
    for rate in (4.0 * np.pi, 40.0 * np.pi):
        motions.append((1e-3 * np.sin(rate * t), 1e-3 * rate * np.cos(rate * t)))
    rows = re.findall(r"^\| ([^|`]+)" + r" \| ([\d.]+)" * 3 + r" \|$", PAGE, re.MULTILINE)
    assert {name for name, *_ in rows} == set(methods)
    for name, *errors in rows:
        for error, (x, speed) in zip(errors, motions, strict=True):
            found = velocity_of(methods[name], step * np.rint(x / step), T)[500:] - speed[500:]
            assert float(error) == pytest.approx(1e3 * sqrt(np.mean(found**2)), rel=6e-3)


def test_the_error_of_an_estimate_that_is_not_linear_survives_a_process():
    error = NonlinearError("adaptive windowing")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert again.estimate == "adaptive windowing"
