"""Points compared with trials: each disturbed as it was measured, tried walls judged by the same trials."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.identify.boundary_cases import record
from zwidth.contact import StabilityTrial
from zwidth.contact.stability_trial import LEVELS, LONGER
from zwidth.errors import ArgumentError
from zwidth.identify import identify_boundary, read_boundary_points
from zwidth.identify.boundary.checks import check_circumstances
from zwidth.identify.boundary.trials import TrialPlan
from zwidth.study import Plan, measure_boundary

DELAY = "loop.delay_samples"


def rough():
    return zwidth.load("published-two-mass").with_(
        {DELAY: 0.3, "loop.encoder.resolution_m": 2e-5, "friction.coulomb_N": [0.0, 0.05]}
    )


def points(**more):
    return read_boundary_points(
        [
            record(
                {
                    "stiffness_N_per_m": [1000.0, 2000.0, 2000.0],
                    "damping_Ns_per_m": [1.0, 1.0, 2.0],
                    "edge": ["lower", "upper", ""],
                    "kind": ["", "", "stable"],
                    **more,
                }
            )
        ]
    )


def plan(**more):
    return TrialPlan.of(points(**more), rough().at(), None, None)


def test_each_point_is_disturbed_as_it_says():
    own = plan(
        perturbation_N=[2.0, 2.0, np.nan],
        bias_force_N=[0.0, 0.0, 1.5],
        watch_time_s=[np.nan, 3.0, 3.0],
        amplitude_m=[1e-5, np.nan, 4e-5],
    ).disturbing
    assert [one.disturbance for one in own] == pytest.approx([2e-3, 1e-3, 1e-3])
    assert [one.push for one in own] == [0.0, 0.0, 1.5]
    assert [one.watch_time for one in own] == [3.0, 3.0, 3.0]  # who says nothing did as the others
    assert [one.visible for one in own] == pytest.approx([1e-5, 2.5e-5, 4e-5])


def test_points_that_say_nothing_are_disturbed_alike():
    own = plan()
    assert len(own.groups()) == 1
    assert own.disturbing[0].disturbance == 1e-3
    assert own.disturbing[0].visible == pytest.approx(6e-5)
    assert own.disturbing[0].watch_time is None
    assert "displaced by 0.001 m" in own.sentence


def test_the_amplitude_beyond_an_edge_is_no_limit_of_what_is_seen():
    own = plan(amplitude_m=[0.4, 0.4, np.nan], beyond=["growing", "limit cycle", ""])
    assert own.disturbing[0].visible == pytest.approx(6e-5)


def test_differing_circumstances_are_simulated_and_else_warned_of():
    some = points(perturbation_N=[1.0, 2.0, 2.0])
    by_trials, by_chart = (check_circumstances(some, simulated)[0] for simulated in (True, False))
    assert by_trials.passed
    assert not by_chart.passed


def test_the_last_look_takes_the_time_that_was_watched():
    loop = rough().at().contact_loop
    trial = StabilityTrial(loop, watch_time=8.0)
    assert trial.first_samples * LONGER ** (LEVELS - 1) * loop.period == pytest.approx(8.0, rel=0.01)
    with pytest.raises(ArgumentError, match=r"^watch_time must"):
        StabilityTrial(loop, watch_time=0.0)


@pytest.mark.slow
def test_tried_walls_are_judged_by_trials_and_points_without_an_edge_are_named():
    table = measure_boundary(rough().at(), Plan(stiffnesses=3, tips=0), causes=False).table()
    K, B, edge = (np.array(table[name]) for name in ("stiffness_N_per_m", "damping_Ns_per_m", "edge"))
    upper = edge == "upper"
    walls = [(k, b + side * 0.1 * b, word) for k, b in zip(K[upper], B[upper], strict=True)
             for side, word in ((-1.0, "stable"), (1.0, "unstable"))]  # fmt: skip
    rows = [(k, b, e, "") for k, b, e in zip(K, B, edge, strict=True)] + [(k, b, "", w) for k, b, w in walls]
    rows.append((3.0 * K.max(), B.max(), "upper", ""))
    names = ("stiffness_N_per_m", "damping_Ns_per_m", "edge", "kind")
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    result = identify_boundary(rough().with_({DELAY: 0.2}), [record(columns)], paths=[DELAY])
    lost = next(check for check in result.checks if check.what == "trials")
    assert "left out" in lost.reason
    assert f"row {len(rows) - 1} of" in lost.reason
    assert "wrong side" not in next(check.reason for check in result.checks if check.what == "explained")
    assert result[DELAY].value == pytest.approx(0.3, abs=0.02)
