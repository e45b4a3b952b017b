"""A plant's own exact response gives back its exact chart; what data cannot tell is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from tests import systems
from tests.measured_cases import frequency_grid, measured_response, sampled_response
from tests.study_sizes import study_size
from zwidth.chart import MeasuredLoop, eigenvalues, measured_chart, stability_chart
from zwidth.chart.measured.boundary import coarse_angles, nyquist_count, sample_boundary
from zwidth.errors import ResponseError
from zwidth.loop import Butterworth, CentralDifference, Controller, LeastSquaresSlope, Loop, SavitzkyGolay
from zwidth.model import Plant, Response, integrators_of, sweep_response

DAMPED = (0.01, 0.05, 0.3, 1.0, 1.5)
# Of the first random loops: one to four masses, late by part of a sample, by whole samples and not at all.
EXACT_SEEDS, COUNTED_SEEDS = (1, 5, 7), (1, 3, 4)


def measured_chart_of(loop, **more):
    return measured_chart(*measured_response(loop, **more))


def coarse_response(loop, **more):
    """A response at a third of the frequencies, with which these tests have the same numbers."""
    return measured_response(loop, frequency_grid(loop, 400), **more)


def random_walls(loop, rng, count=300):
    """Walls of both signs over four decades round the middle of the curve."""
    sizes = [
        np.quantile(np.abs(x), [0.02, 0.9])
        for x in (loop.h(loop.angles_below_pi), loop.h(loop.angles_below_pi) / loop.w(loop.angles_below_pi))
    ]
    return np.column_stack(
        [np.exp(rng.uniform(*np.log(size), count)) * rng.choice([-1.0, 1.0], count) for size in sizes]
    )


@pytest.mark.parametrize("seed", EXACT_SEEDS)
def test_a_plants_own_response_gives_back_its_exact_chart(seed):
    exact_chart_comes_back(seed)


@pytest.mark.slow
def test_the_own_responses_of_many_plants_give_back_their_exact_charts():
    for seed in range(study_size(continuous=9, full=60)):
        exact_chart_comes_back(seed)


def exact_chart_comes_back(seed):
    rng = np.random.default_rng(100 + seed)
    loop = systems.random_loop(rng, DAMPED)
    exact = stability_chart(loop, decay=False)
    chart = measured_chart_of(loop)
    assert chart.stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-5)
    assert chart.damping_max == pytest.approx(exact.damping_max, rel=1e-4)
    assert chart.stable_area == pytest.approx(exact.stable_area, rel=2e-4)
    assert_allclose(chart.frequencies_at_stiffness_max, exact.frequencies_at_stiffness_max, rtol=2e-3)
    assert len(chart.regions) == len(exact.regions)
    assert not chart.open
    walls = random_walls(chart.loop, rng)
    radius = np.max(np.abs(eigenvalues(loop, *walls.T)), axis=-1)
    clear = np.abs(radius - 1.0) > 1e-5
    verdicts = chart.check(*walls.T).verdict
    assert_allclose(verdicts[clear], np.sign(1.0 - radius[clear]))


@pytest.mark.parametrize("seed", COUNTED_SEEDS)
def test_the_count_is_that_of_the_eigenvalues_outside(seed):
    count_is_that_of_the_eigenvalues(seed)


@pytest.mark.slow
def test_the_counts_of_many_loops_are_those_of_the_eigenvalues_outside():
    for seed in range(study_size(continuous=6, full=60)):
        count_is_that_of_the_eigenvalues(seed)


def count_is_that_of_the_eigenvalues(seed):
    """Both by crossings of the curve and by the turning of 1 + L, for any number of roots outside."""
    rng = np.random.default_rng(seed)
    loop = systems.random_loop(rng, DAMPED)
    own_loop = MeasuredLoop(*measured_response(loop))
    edge = sample_boundary(own_loop, coarse_angles(own_loop))
    walls = random_walls(own_loop, rng)
    sizes = np.abs(eigenvalues(loop, *walls.T))
    clear = np.min(np.abs(sizes - 1.0), axis=-1) > 1e-6
    true = np.sum(sizes > 1.0, axis=-1)[clear]
    assert_allclose(edge.outside(walls)[clear], true)
    counts, margin = nyquist_count(own_loop, edge.angles, walls)
    sure = margin[clear] > 0.01
    assert_allclose(counts[clear][sure], true[sure])
    assert len(set(true.tolist())) > 2


def test_boundary_points_are_the_measured_ones():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    f = np.linspace(0.5, 400.0, 800)
    chart = measured_chart_of(loop, frequency=f)
    arcs = [arc for arc in chart.boundary if 0.0 < arc.frequency[0] < 400.0]
    assert np.all(np.isin(np.round(np.concatenate([arc.frequency for arc in arcs]), 6), np.round(f, 6)))
    for arc in arcs:
        z = np.exp(2j * np.pi * arc.frequency * loop.period)
        w = loop.velocity_response(z)
        residue = 1.0 + loop.plant_response(z) * (arc.stiffness + arc.damping * w)
        assert np.max(np.abs(residue)) < 1e-9
    exact = stability_chart(loop, decay=False)
    assert chart.stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-6)
    assert 0.9 * exact.stiffness_max < chart.measured_stiffness_max <= exact.stiffness_max * (1.0 + 1e-9)


def test_interpolation_has_the_fourth_order():
    """Halving the spacing divides the error by 16, and the error told is of the right size."""
    loop = systems.published(delay=1.3)
    errors, told = [], []
    for count in (200, 400, 800):
        f = np.linspace(400.0 / count, 400.0, count)
        between = MeasuredLoop(*measured_response(loop, frequency=f)).interpolation
        middle = np.linspace(20.0, 380.0, 5000)
        P = sampled_response(loop, middle)
        errors.append(np.max(np.abs(P * between.inverse(2.0 * np.pi * middle * loop.period) - 1.0)))
        told.append(np.max(between.relative_error(2.0 * np.pi * middle * loop.period)))
    assert 8.0 < errors[0] / errors[1] < 40.0
    assert 8.0 < errors[1] / errors[2] < 40.0
    assert np.all((np.array(told) / errors > 0.1) & (np.array(told) / errors < 20.0))


def test_lines_of_real_roots_edge_the_set():
    """A mass on a spring under negative stiffness runs away at K = -k."""
    loop = Loop(systems.mass(0.1, 2.0, 300.0), Controller(0.001))
    chart, exact = measured_chart(*coarse_response(loop)), stability_chart(loop, decay=False)
    assert chart.integrators == 0
    (line,) = [arc for arc in chart.boundary if arc.frequency[0] == 0.0]
    assert_allclose(line.stiffness, -300.0, rtol=1e-6)
    ends = [arc.damping[k] for k in (0, -1) for arc in exact.boundary if arc.frequency[0] == 0.0]
    assert_allclose(sorted(line.damping), [np.min(ends), np.max(ends)], rtol=1e-5)


def test_a_force_that_changes_sign_at_every_sample_edges_the_set_of_a_heavily_damped_device():
    """With x = b T/m = 8 and B = 0 the root z = -1 binds, K = (2 b/T) / (1 - tanh(x/2) / (x/2))."""
    loop = Loop(systems.mass(0.02, 80.0), Controller(0.002))
    chart, exact = measured_chart(*coarse_response(loop)), stability_chart(loop, decay=False)
    (line,) = [arc for arc in chart.boundary if arc.frequency[0] == 250.0]
    ends = [arc.damping[k] for k in (0, -1) for arc in exact.boundary if arc.frequency[0] > 249.0]
    assert_allclose(sorted(line.damping), [np.min(ends), np.max(ends)], rtol=1e-4)
    stiffest = 2.0 * 80.0 / 0.002 / (1.0 - np.tanh(4.0) / 4.0)
    assert chart.check(stiffest * np.array([0.999, 1.001]), 0.0).names == ["stable", "unstable"]
    assert chart.check(1.01 * stiffest, 0.0).outside == 1
    assert chart.stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-6)


def test_software_delay_and_a_filter_of_the_force_are_added_to_what_was_measured():
    loop = systems.published()
    response, _ = coarse_response(loop)
    computer = Controller(loop.period, delay=2.0, force_filter=Butterworth(2, 150.0))
    exact = stability_chart(Loop(loop.plant, computer), decay=False)
    assert measured_chart(response, computer).stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-6)
    with pytest.raises(ResponseError, match=r"whole samples .*0\.5"):
        measured_chart(response, Controller(loop.period, delay=0.5))
    with pytest.raises(ResponseError, match="lag already"):
        measured_chart(response, Controller(loop.period, actuator_time_constant=0.001))


@pytest.mark.parametrize("velocity", [CentralDifference(), LeastSquaresSlope(4), SavitzkyGolay(5, 2)], ids=str)
def test_any_velocity_estimate_serves(velocity):
    loop = systems.random_loop(np.random.default_rng(12), (0.05, 0.3, 1.0))
    computer = replace(loop.controller, velocity=velocity, delay=0.0)
    exact = stability_chart(Loop(loop.plant, replace(computer, delay=loop.controller.delay)), decay=False)
    chart = measured_chart(coarse_response(loop)[0], computer)
    assert chart.stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-5)
    assert chart.stable_area == pytest.approx(exact.stable_area, rel=2e-4)


def test_roots_are_counted_however_long_the_delay():
    loop = Loop(systems.mass(0.1, 2.0, 50.0), Controller(0.001, delay=90.0))
    counted = MeasuredLoop(measured_response(loop, np.linspace(0.1, 500.0, 4000))[0], Controller(0.001))
    edge = sample_boundary(counted, coarse_angles(counted))
    walls = np.column_stack(
        [np.random.default_rng(0).uniform(low, high, 12) for low, high in ((-80, 900), (-5, 20))]
    )
    sizes = np.abs(eigenvalues(loop, *walls.T))
    assert_allclose(edge.outside(walls), np.sum(sizes > 1.0, axis=-1))
    assert np.max(edge.outside(walls)) > 4


@pytest.mark.parametrize(
    ("damping", "stiffness", "integrators"), [(0.0, 0.0, 2), (5.0, 0.0, 1), (5.0, 900.0, 0), (0.01, 0.0, 2)]
)
def test_integrators_are_read_off_the_phase(damping, stiffness, integrators):
    """A dashpot too weak to be seen at the lowest frequency counts as none."""
    response, _ = measured_response(
        Loop(systems.mass(0.1, damping, stiffness), Controller(0.001)), np.linspace(0.5, 500.0, 999)
    )
    assert integrators_of(response, 0.001) == integrators


@pytest.mark.parametrize(("corner", "lowest"), [(8.0, 8.0), (8.0, 20.0), (2.0, 4.0), (0.5, 1.0)])
def test_a_dashpot_is_read_off_between_the_phases_of_one_and_of_two_integrators(corner, lowest):
    """-135 degrees at the corner frequency b / (2 pi m), the lowest of all; and the chart is the exact one."""
    loop = Loop(systems.mass(0.1, 2.0 * np.pi * corner * 0.1), Controller(0.001))
    response, computer = measured_response(loop, np.linspace(lowest, 500.0, 800))
    assert integrators_of(response, 0.001) == 1
    stated = measured_chart(replace(response, integrators=1), computer)
    assert stated.stiffness_max == pytest.approx(stability_chart(loop, decay=False).stiffness_max, rel=1e-5)


def test_a_soft_spring_is_read_off_above_its_resonance():
    loop = Loop(systems.mass(0.1, 0.3, 40.0), Controller(0.001))  # 3.2 Hz
    response, _ = measured_response(loop, np.linspace(4.0, 500.0, 800))
    assert abs(np.degrees(np.angle(response.value[0]))) > 160.0
    assert integrators_of(response, 0.001) == 0


# --- what the data cannot tell ----------------------------------------------------------------------------


def without_band(response, low, high):
    """The response without the frequencies between."""
    kept = (response.frequency < low) | (response.frequency > high)
    return Response(response.frequency[kept], response.value[kept])


def test_a_gap_is_named_and_whether_the_edge_runs_through_it():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    response, computer = measured_response(loop, np.linspace(0.5, 400.0, 800))
    (away,) = measured_chart(without_band(response, 200.0, 300.0), computer).unusable
    assert (away.low, away.high, away.on_edge) == (199.5, 300.5, False)
    assert "nothing measured" in away.reason
    (across,) = measured_chart(without_band(response, 8.0, 15.0), computer).unusable
    assert across.on_edge


def test_incoherent_frequencies_are_left_out_and_named():
    loop = systems.published()
    f = np.linspace(0.5, 400.0, 800)
    coherence = np.where((f > 60.0) & (f < 64.0), 0.3, 0.9999)
    response, computer = measured_response(loop, f, coherence=coherence, averages=50.0)
    spoilt = replace(response, value=response.value * np.where(coherence < 0.5, 1.3, 1.0))
    chart = measured_chart(spoilt, computer)
    (stretch,) = chart.unusable
    assert (stretch.low, stretch.high) == (60.0, 64.0)
    assert "coherence down" in stretch.reason
    exact = stability_chart(loop, decay=False).stiffness_max
    assert chart.stiffness_max_nominal == pytest.approx(exact, rel=1e-4)
    assert 0.5 * exact < chart.stiffness_max < exact


def test_what_was_measured_there_still_bounds_the_response():
    """Left out of the nominal chart, but where little is known walls are not certain."""
    loop = systems.published()
    f = np.linspace(0.5, 400.0, 800)
    lost = (f > 10.0) & (f < 14.0)  # where the stiffest walls fail
    response, computer = measured_response(loop, f, coherence=np.where(lost, 0.02, 0.9999), averages=50.0)
    chart = measured_chart(response, computer)
    assert not chart.stiffness_max > 0.5 * chart.stiffness_max_nominal


def test_a_mode_between_two_frequencies_is_followed_and_a_crowd_of_them_is_named():
    """One sharp pole or zero among its neighbours is interpolated well; closer together they are not resolved."""
    loop = Loop(systems.two_mass(0.3, 0.03, 20000.0, 0.5), Controller(0.001))
    exact = stability_chart(loop, decay=False)
    sparse = measured_chart_of(loop, frequency=np.linspace(5.0, 495.0, 99))
    assert sparse.stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-3)
    assert sparse.unusable == ()
    (stretch,) = measured_chart_of(loop, frequency=np.linspace(500.0 / 12.0, 500.0, 12)).unusable
    assert "measure closer" in stretch.reason
    assert stretch.low < 136.0 < stretch.high


def test_data_that_end_below_the_edge_leave_it_open():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    response, computer = measured_response(loop, np.linspace(0.5, 400.0, 800))
    enough = measured_chart(without_band(response, 150.0, 500.0), computer)  # fails at 11 and 132 Hz
    assert "not seen" in enough.unusable[-1].reason
    assert enough.stiffness_max == pytest.approx(stability_chart(loop, decay=False).stiffness_max, rel=1e-6)
    missing = measured_chart(without_band(response, 100.0, 500.0), computer)
    assert missing.open
    assert np.isnan(missing.stiffness_max)
    assert missing.unusable[-1].on_edge
    nearly = measured_chart(without_band(response, 350.0, 500.0), computer)
    assert "continued" in nearly.unusable[-1].reason
    assert not nearly.open


# --- how sure it is --------------------------------------------------------------------------------------


def noisy(response, coherence, averages, rng):
    """The response with the error that its coherence tells."""
    error = np.sqrt((1.0 - coherence) / (2.0 * averages * coherence))
    n = len(response.frequency)
    value = response.value * (1.0 + error * (rng.normal(size=n) + 1j * rng.normal(size=n)))
    return replace(response, value=value, coherence=np.full(n, coherence), averages=averages)


def test_the_band_of_the_coherence_holds_the_true_chart():
    bands_hold_the_true_chart(3, walls=200)


@pytest.mark.slow
def test_the_bands_of_many_noisy_responses_hold_the_true_chart():
    bands_hold_the_true_chart(study_size(continuous=10, full=100), walls=60)


def bands_hold_the_true_chart(count, walls):
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    exact = stability_chart(loop, decay=False)
    response, computer = measured_response(loop, np.linspace(1.0, 400.0, 400))
    rng, held, decided = np.random.default_rng(3), [], []
    for _ in range(count):
        chart = measured_chart(noisy(response, 0.99, 16.0, rng), computer)
        held.append(chart.band.stiffness_low <= exact.stiffness_max <= chart.band.stiffness_high)
        K, B = rng.uniform(0.0, 2500.0, walls), rng.uniform(0.0, 9.0, walls)
        found = chart.check(K, B).verdict
        true = np.sign(1.0 - np.max(np.abs(eigenvalues(loop, K, B)), axis=-1))
        decided += (found[found != 0] == true[found != 0]).tolist()
        assert chart.band.stiffness_low == chart.stiffness_max
        assert chart.stiffness_max < chart.stiffness_max_nominal < chart.band.stiffness_high
        assert len(chart.regions) == 1
    assert all(held)
    assert all(decided)
    assert len(decided) > 300


def test_where_no_error_is_known_the_headline_is_nominal_and_the_text_says_so():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    chart = measured_chart(*measured_response(loop, np.linspace(1.0, 400.0, 400)))
    assert chart.band is None
    assert chart.stiffness_max == chart.stiffness_max_nominal
    assert chart.frequencies_at_stiffness_max == chart.frequencies_at_stiffness_max_nominal
    assert "not known" in repr(chart)


def test_without_error_the_certain_wall_is_the_nominal_one():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    exact = stability_chart(loop, decay=False)
    chart = measured_chart(
        *coarse_response(loop, coherence=np.ones(len(frequency_grid(loop, 400))), averages=10.0)
    )
    assert chart.stiffness_max == pytest.approx(exact.stiffness_max, rel=1e-5)
    assert chart.stiffness_max <= chart.stiffness_max_nominal <= chart.band.stiffness_high
    assert_allclose(chart.frequencies_at_stiffness_max, exact.frequencies_at_stiffness_max, rtol=0.02)


def test_more_error_never_makes_a_wall_certain():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    f = np.linspace(2.0, 400.0, 200)
    largest = [
        measured_chart(*measured_response(loop, f, coherence=np.full(200, g), averages=16.0)).stiffness_max
        for g in (0.9999, 0.999, 0.99, 0.97)
    ]
    assert np.all(np.diff(largest) < 0.0)
    none = measured_chart(*measured_response(loop, f, coherence=np.full(200, 0.55), averages=4.0))
    assert np.isnan(none.stiffness_max)
    assert none.regions == ()


def quantised_noise(seed, step):
    """20 s of noise on a free mass, read in steps [m], as a response; and the exact chart."""
    T, mass, friction = 0.001, 0.1, 1.0
    force = np.random.default_rng(seed).normal(0.0, 2.0, 20_000)
    left = np.exp(-friction * T / mass)
    velocity = lfilter([0.0, (1.0 - left) / friction], [1.0, -left], force)
    moved = (force * T - mass * np.diff(velocity, append=0.0)) / friction
    reading = step * np.round(lfilter([0.0, 1.0], [1.0, -1.0], moved) / step)
    exact = stability_chart(Loop(Plant.one_mass(mass, friction), Controller(T)), decay=False)
    return sweep_response(force, reading, T, integrators=2, segment=512), exact


@pytest.mark.parametrize(
    ("seed", "step"),
    [
        pytest.param(3, 2e-6, marks=pytest.mark.slow),
        pytest.param(25, 2e-6, marks=pytest.mark.slow),
        (40, 2e-6),
        (23, 1e-6),
        (4, 2e-6),
    ],
)
def test_noise_near_half_the_sampling_rate_makes_no_root_there(seed, step):
    """Beyond the last coherent frequency there is no pole, although the last points alone, by their noise, would
    say so in the first four cases."""
    response, exact = quantised_noise(seed, step)
    chart = measured_chart(response, Controller(0.001))
    assert chart.stiffness_max_nominal == pytest.approx(exact.stiffness_max, rel=0.03)
    assert 0.9 * exact.stiffness_max < chart.stiffness_max <= exact.stiffness_max <= chart.band.stiffness_high
    verdicts = chart.check(50e3, [80.0, 100.0])
    assert verdicts.names == ["stable", "stable"]
    assert not verdicts.outside.any()


def test_repeated_sweeps_span_the_band():
    loop = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))
    response, computer = measured_response(loop, np.linspace(2.0, 400.0, 200))
    rng = np.random.default_rng(4)
    sweeps = np.array([noisy(response, 0.99, 16.0, rng).value for _ in range(3)])
    chart = measured_chart(replace(response, value=sweeps.mean(axis=0), sweeps=sweeps), computer)
    assert len(chart.stiffness_max_of_sweeps) == 3
    exact = stability_chart(loop, decay=False).stiffness_max
    assert chart.stiffness_max <= exact <= chart.band.stiffness_high
    assert chart.stiffness_max < chart.stiffness_max_nominal
    alone = measured_chart(replace(response, value=sweeps[1]), computer)
    assert chart.stiffness_max_of_sweeps[1] == pytest.approx(alone.stiffness_max, rel=1e-9)
    assert "3 sweeps" in chart.band.meaning
    inner = [arc for arc in chart.boundary if 0.0 < arc.frequency[0] < 400.0]
    assert all(np.all((arc.stiffness_low < arc.stiffness) & (arc.stiffness < arc.stiffness_high)) for arc in inner)


def test_an_unstable_device_has_no_stable_wall():
    """Three samples of delay and a spring that pushes away: nothing helps."""
    f = frequency_grid(systems.published())
    z = np.exp(2j * np.pi * f * 0.00125)
    hopeless = Response(f, -0.001 / (z - 0.5) / z**3, integrators=0)
    with pytest.raises(ResponseError):
        measured_chart(hopeless, Controller(0.00125))


def test_frequencies_that_differ_by_rounding_alone_count_once():
    """As where two grids are joined, on some processors; nothing can be interpolated between them."""
    response, controller = coarse_response(systems.random_loop(np.random.default_rng(102), DAMPED))
    at = np.arange(100, len(response.frequency) - 100, 5)
    frequency = np.insert(response.frequency, at, np.nextafter(response.frequency[at], 0.0))
    twice = replace(response, frequency=frequency, value=np.insert(response.value, at, response.value[at]))
    slower = replace(controller, sampling_period=0.999 * controller.sampling_period)
    once, both = (measured_chart(one, slower).stiffness_max for one in (response, twice))
    assert both == pytest.approx(once, rel=1e-12)
