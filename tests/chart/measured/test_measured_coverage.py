"""What a chart of a noisy bench says for certain is true, as often as it claims."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests import systems
from tests.measured_cases import chirp
from tests.noisy_benches import random_bench, readings
from tests.study_sizes import study_size
from zwidth.chart import eigenvalues, measured_chart, stability_chart
from zwidth.errors import ResponseError
from zwidth.loop import Butterworth, Controller, Loop
from zwidth.model import Plant, integrators_of, sweep_response
from zwidth.model.response import joint_radius

CLAIMED = 0.95
BATCH = study_size(continuous=100, full=250)
ON_EDGE = 1e-9  # distance of the largest root from the circle, at which no verdict is wrong


def response_of(forces, positions, period, integrators=None):
    """The response of one record, or the mean of several, as a device file with them has it."""
    each = [sweep_response(f, x, period, integrators) for f, x in zip(forces, positions, strict=True)]
    if len(each) == 1:
        return each[0]
    sweeps = np.array([response.value for response in each])
    coherence = np.min([response.coherence for response in each], axis=0)
    return replace(each[0], value=sweeps.mean(axis=0), coherence=coherence, sweeps=sweeps)


def largest_root(loop, stiffness, damping):
    return np.max(np.abs(eigenvalues(loop, stiffness, damping)), axis=-1)


@dataclass(frozen=True)
class Outcome:
    """Of one bench: what holds of its chart, and the headline over the truth (nan: no wall is certain)."""

    band: bool
    verdicts: bool
    headline: bool
    share: float
    decided: float


def outcome(seed):
    truth = {}

    def stiffest(loop):
        truth["chart"] = stability_chart(loop, decay=False)
        return truth["chart"].stiffness_max

    bench = random_bench(seed, stiffest)
    exact, loop = truth["chart"], bench.loop
    chart = measured_chart(response_of(bench.forces, bench.positions, loop.period), bench.computer)
    rng = np.random.default_rng([21, seed])
    K0, K1, B0, B1 = exact.box
    walls = np.column_stack([rng.uniform(K0, 1.5 * K1, 150), rng.uniform(B0, 1.5 * B1, 150)])
    verdict = chart.check(*walls.T).verdict
    inside = 1.0 - largest_root(loop, *walls.T)
    right = (verdict == 0) | (verdict == np.sign(inside)) | (np.abs(inside) < ON_EDGE)
    none = np.isnan(chart.stiffness_max)
    certain = (1.0 - 1e-6) * chart.stiffness_max
    low, high = chart.band.stiffness_low, chart.band.stiffness_high
    return Outcome(
        band=bool((none or low <= exact.stiffness_max) and not high < exact.stiffness_max),
        verdicts=bool(np.all(right)),
        headline=bool(none or largest_root(loop, certain, chart.damping_at_stiffness_max) < 1.0 + ON_EDGE),
        share=chart.stiffness_max / exact.stiffness_max,
        decided=float(np.mean(verdict != 0)),
    )


def outcome_or_refusal(seed):
    """None where the response is refused."""
    try:
        return outcome(seed)
    except ResponseError:
        return None


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_what_is_certain_on_a_noisy_bench_is_true(seed):
    found = outcome(seed)
    assert found.band
    assert found.verdicts
    assert found.headline
    assert found.share > 0.9
    assert found.decided > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(study_size(continuous=1, full=4)))
def test_charts_of_a_thousand_noisy_benches_are_as_right_as_they_claim(batch):
    """And the headline costs little: the median over the truth is above 0.95."""
    found = [one for seed in range(BATCH * batch, BATCH * (batch + 1)) if (one := outcome_or_refusal(seed))]
    assert len(found) >= CLAIMED * BATCH
    for what in ("band", "verdicts", "headline"):
        assert np.mean([getattr(one, what) for one in found]) >= CLAIMED, what
    assert np.nanmedian([one.share for one in found]) > 0.95
    assert np.mean([np.isnan(one.share) for one in found]) < 0.35


# --- two sweeps of 20 s through an encoder of 5 um -------------------------------------------------------


def damped_bench(sweeps, seed=0):
    """Two masses, a little damping to the ground (0.4 Hz), force noise of 2 %, and steps of 5 um."""
    plant = systems.two_mass(0.25, 0.03, 2.0e4, 8.0)
    damping = plant.damping.copy()
    damping[0, 0] += 2.0 * np.pi * 0.4 * 0.28
    plant = Plant(plant.mass, damping, plant.stiffness, plant.actuator, plant.sensor, plant.handle, plant.names)
    loop = Loop(plant, Controller(0.001, velocity_filter=Butterworth(2, 100.0)))
    rng = np.random.default_rng(seed)
    force = chirp(20_000, 0.001, 0.5, 500.0, amplitude=2.0)
    positions = [
        5e-6 * np.round(readings(loop, force + 0.04 * rng.normal(size=len(force))) / 5e-6) for _ in range(sweeps)
    ]
    return loop, [force] * sweeps, positions


@pytest.mark.parametrize(("sweeps", "integrators"), [(1, None), (2, None), (1, 1)])
def test_a_lightly_damped_device_is_read_and_its_headline_is_stable(sweeps, integrators):
    """Noise makes no islands, even in one sweep."""
    loop, forces, positions = damped_bench(sweeps)
    response = response_of(forces, positions, loop.period, integrators)
    assert integrators_of(response, loop.period) == 1
    chart = measured_chart(response, Controller(loop.period, velocity_filter=loop.controller.velocity_filter))
    exact = stability_chart(loop, decay=False)
    assert len(chart.regions) == 1
    assert 0.8 * exact.stiffness_max < chart.stiffness_max < exact.stiffness_max < chart.band.stiffness_high
    assert chart.stiffness_max < chart.stiffness_max_nominal
    assert largest_root(loop, chart.stiffness_max, chart.damping_at_stiffness_max) < 1.0


def test_short_segments_do_not_refuse_a_dashpot_that_is_stated():
    """Above its corner frequency the device looks free: -170 degrees and more."""
    loop, (force,), (position,) = damped_bench(1)
    response = sweep_response(force, position, loop.period, integrators=1, segment=512)
    assert abs(np.degrees(np.angle(response.value[0]))) > 165.0
    assert integrators_of(response, loop.period) == 1


def test_steps_that_hide_the_motion_make_no_wall_certain_that_is_not():
    """Nothing else moves: at high frequency the motion is a fraction of a step, and the reading stands still."""
    loop, _, _ = damped_bench(1)
    force = chirp(20_000, 0.001, 0.5, 500.0, amplitude=2.0)
    for step in (5e-6, 2e-5):
        reading = step * np.round(readings(loop, force) / step)
        chart = measured_chart(
            sweep_response(force, reading, loop.period),
            Controller(loop.period, velocity_filter=loop.controller.velocity_filter),
        )
        exact = stability_chart(loop, decay=False)
        assert not chart.stiffness_max > exact.stiffness_max
        walls = np.random.default_rng(1).uniform([0.0, 0.0], [1.5 * chart.box[1], 1.5 * chart.box[3]], (200, 2))
        verdict, inside = chart.check(*walls.T).verdict, 1.0 - largest_root(loop, *walls.T)
        assert np.all((verdict == 0) | (verdict == np.sign(inside)))


def test_an_error_that_repeats_itself_is_not_averaged():
    """The same force and no noise: the same readings, and two of them say no more than one."""
    loop, forces, _ = damped_bench(2)
    reading = 5e-6 * np.round(readings(loop, forces[0]) / 5e-6)
    alone = joint_radius(response_of(forces[:1], [reading], loop.period))
    assert np.allclose(joint_radius(response_of(forces, [reading, reading], loop.period)), alone, equal_nan=True)
