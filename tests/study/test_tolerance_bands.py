"""Intervals of stiffness on lines of damping, counted by hand; verdicts near the stability limit."""

from __future__ import annotations

import numpy as np
import pytest

from tests.study.tolerance_cases import MASS, PERIOD, free_mass
from zwidth.chart.verdict import NAMES
from zwidth.measures import OK, UNDECIDED
from zwidth.show import band_path
from zwidth.study import Axis, Coverage, Sampling, SweepJob, study_over, sweep_job
from zwidth.study.tolerances.band import MOST_INTERVALS, Band, refined_dampings, stable_intervals
from zwidth.study.tolerances.question import WALL_IS_STABLE

NONE = (0.0, 0.0)
# three devices on three lines, two intervals each
THREE = np.array(
    [
        [[(0.0, 1.0), NONE], [(1.0, 4.0), NONE], [NONE, NONE]],
        [[(0.0, 2.0), NONE], [(0.0, 2.0), (3.0, 5.0)], [(1.0, 2.0), NONE]],
        [[(0.0, 3.0), NONE], [(0.5, 6.0), NONE], [NONE, NONE]],
    ]
)
LINES = np.array([0.0, 10.0, 20.0])


def box(low: float, high: float, bottom: float = -1.0, top: float = 1.0) -> np.ndarray:
    return np.array([[low, bottom], [high, bottom], [high, top], [low, top], [low, bottom]])


def test_devices_are_counted_where_their_intervals_overlap():
    coverage = Coverage(LINES, THREE)
    assert coverage.pieces(0, 3) == ((0.0, 1.0),)
    assert coverage.pieces(0, 2) == ((0.0, 2.0),)
    assert coverage.pieces(1, 3) == ((1.0, 2.0), (3.0, 4.0))
    assert coverage.pieces(1, 2) == ((0.5, 5.0),)
    assert coverage.pieces(2, 1) == ((1.0, 2.0),)
    assert coverage.pieces(2, 2) == ()
    assert [coverage.largest(n) for n in (1, 2, 3, 4)] == [(6.0, 1), (5.0, 1), (4.0, 1), (0.0, -1)]
    assert [coverage.topmost(n) for n in (1, 2, 3, 4)] == [2, 1, 1, -1]
    assert coverage.stiffest(2).damping == 10.0
    assert coverage.stiffest(4) is None
    assert refined_dampings(coverage, [3], 2).tolist() == [5.0, 15.0]  # on either side of the stiffest
    assert refined_dampings(coverage, [1], 5)[0] == 2.0


def test_a_band_that_begins_above_the_first_line_is_followed_down_to_where_it_begins():
    late = THREE.copy()
    late[:, 0] = 0.0
    coverage = Coverage(LINES, late)
    assert [coverage.lowest(n) for n in (1, 3, 4)] == [1, 1, -1]
    assert refined_dampings(coverage, [3], 2).tolist() == [5.0, 15.0]
    much = np.concatenate([LINES[:1], LINES + 10.0])  # stiffest on the line above that where it begins
    coverage = Coverage(much, np.concatenate([late[:, :1], THREE], axis=1))
    assert refined_dampings(coverage, [3], 2).tolist() == [5.0, 15.0, 25.0]


def test_a_device_stable_to_where_another_begins_counts_with_it():
    touching = np.array([[[(0.0, 1.0)]], [[(1.0, 2.0)]]])
    assert Coverage(LINES[:1], touching).pieces(0, 1) == ((0.0, 2.0),)
    assert Coverage(LINES[:1], touching).pieces(0, 2) == ()


def test_intervals_of_an_outline_begin_at_no_stiffness():
    def at_zero(*outlines):
        found = stable_intervals(outlines, np.array([0.0]))[0]
        return found[~np.isnan(found[:, 0])].tolist()

    assert at_zero(box(-2.0, 2.0)) == [[0.0, 2.0]]
    assert at_zero(box(-2.0, -1.0)) == []
    assert at_zero(box(1.0, 2.0, 3.0, 4.0)) == []
    assert at_zero(box(1.0, 2.0), box(3.0, 4.0)) == [[1.0, 2.0], [3.0, 4.0]]
    assert at_zero(box(0.5, 4.0), box(1.0, 2.0, -0.5, 0.5)[::-1]) == [[0.5, 1.0], [2.0, 4.0]]  # a hole
    tall = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])  # corners on the line
    assert at_zero(tall) == [[0.0, 1.0]]
    many = [box(2.0 * n, 2.0 * n + 0.1 * (n + 1)) for n in range(MOST_INTERVALS + 2)]
    assert [low for low, _ in at_zero(*many)] == [4.0, 6.0, 8.0, 10.0]  # the longest


def test_a_drawn_band_has_the_area_of_its_trapezia():
    coverage = Coverage(LINES, THREE)
    pieces = tuple(coverage.pieces(d, 2) for d in range(3))
    path = band_path(Band(0.5, 2, LINES, pieces, None, None, 0.0))
    x, y = path.vertices.T
    area = 0.5 * abs(float(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1])))
    assert area == pytest.approx(0.5 * (2.0 + 4.5) * 10.0)
    assert len(band_path(Band(0.5, 4, LINES, ((), (), ()), None, None, 0.0)).vertices) == 0


def test_verdicts_near_the_limit_are_those_of_each_device_alone():
    device = free_mass()
    peak = device.chart()
    nearness = np.array([1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 0.0, -1e-8, -1e-6, -1e-4, -1e-3, -1e-2])
    stiffness = peak.stiffness_max * (1.0 - nearness)
    axes = (
        Axis("plant.mass_kg", tuple(MASS * (1.0 + 1e-13 * np.arange(len(nearness))))),
        Axis("loop.sampling_period_s", (PERIOD,) * len(nearness)),
        Axis("stiffness_N_per_m", tuple(stiffness.tolist())),
        Axis("damping_Ns_per_m", (peak.damping_at_stiffness_max,) * len(nearness)),
    )
    plain = sweep_job(study_over(device, {"plant.mass_kg": [MASS]}, ["stiffness_max"]))
    job = SweepJob(plain.document, plain.label, {}, Sampling(axes, paired=True), (WALL_IS_STABLE,), None, None, {})
    found = job.compute(0, job.count)
    for n, wall in enumerate(stiffness.tolist()):
        verdict = job.design(n).point().check(wall, peak.damping_at_stiffness_max).names[0]
        expected = {"stable": (1.0, OK), "unstable": (0.0, OK), "undecided": (np.nan, UNDECIDED)}[verdict]
        assert found.status[n, 0] == expected[1]
        assert found.values[n, 0] == pytest.approx(expected[0], nan_ok=True)
    assert {*NAMES.values()} == {
        job.design(n).point().check(wall, peak.damping_at_stiffness_max).names[0]
        for n, wall in enumerate(stiffness.tolist())
    }
