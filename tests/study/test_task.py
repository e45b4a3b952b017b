"""The points and directions of a task, and statistics over them."""

import numpy as np
import pytest

from tests.study.study_cases import study_document
from zwidth.device.load import load
from zwidth.measures import OK, OUT_OF_REACH
from zwidth.study import run_study, study_of
from zwidth.study.designs.task import task_of

FIVE_BAR = load("five-bar")
PERIOD = {"key": "loop.sampling_period_s", "values": [0.001, 0.002]}
BOX = {"box_m": [[-0.03, 0.03], [0.22, 0.27]], "count": [2, 3], "directions": 3}


def task(device=FIVE_BAR, finer=1, **given):
    wrong = []
    found = task_of({"task": given}, device, wrong, finer=finer)
    assert not wrong
    return found


def test_a_column_over_a_task_is_the_statistic_of_single_points():
    measures = ["worst(stiffness_max)", "average(stiffness_max)", "uniformity(stiffness_max)", "stiffness_max"]
    swept = run_study(study_of(study_document(PERIOD, measures=measures, task=BOX)))
    for row, period in zip(swept.cells.values, PERIOD["values"], strict=True):
        device = FIVE_BAR.with_({"loop.sampling_period_s": period})
        each = [
            float(device.at((x, y), (np.sin(a), np.cos(a))).measure("stiffness_max"))
            for x in (-0.03, 0.03)
            for y in (0.22, 0.245, 0.27)
            for a in np.pi * np.arange(3) / 3
        ]
        at_reference = float(device.at().measure("stiffness_max"))
        expected = [min(each), np.mean(each), min(each) / max(each), at_reference]
        np.testing.assert_allclose(row, expected, rtol=1e-11)


@pytest.mark.parametrize("name", ["optimal_spectral_radius", "structural_distortion", "felt_stiffness"])
def test_measures_of_one_point_at_a_time_have_values_over_a_task(name):
    wanted = {"stiffness_N_per_m": 800.0, "damping_Ns_per_m": 4.0, "frequency_Hz": 2.0}
    study = study_document(PERIOD, measures=[f"worst({name})"], task={"points_m": [[0.0, 0.25]]}, **wanted)
    alone = study_document(PERIOD, measures=[name], **wanted)
    swept, expected = run_study(study_of(study)), run_study(study_of(alone))
    assert (swept.cells.status == OK).all()
    np.testing.assert_allclose(swept.cells.values, expected.cells.values, rtol=1e-12)


def test_a_task_that_is_not_reached_everywhere_gives_no_value():
    far = {"box_m": [[-0.03, 0.03], [0.22, 0.60]]}
    measures = ["worst(isotropy)", "share(isotropy)"]
    swept = run_study(study_of(study_document(PERIOD, measures=measures, task=far)))
    assert (swept.cells.status == OUT_OF_REACH).all()
    assert np.isnan(swept.cells.values).all()
    near = {"box_m": BOX["box_m"]}
    swept = run_study(study_of(study_document(PERIOD, measures=measures, task=near)))
    assert (swept.cells.status == OK).all()


@pytest.mark.parametrize("directions", [1, 2, 4, 5])
def test_directions_go_evenly_round_half_a_circle(directions):
    u = task(directions=directions).directions
    assert u.shape == (directions, 3)
    np.testing.assert_allclose(u[0], [0, 1, 0], atol=1e-15)
    doubled = np.sort(np.angle((u[:, 0] + 1j * u[:, 1]) ** 2) % (2 * np.pi))
    np.testing.assert_allclose(np.diff(doubled), 2 * np.pi / directions, atol=1e-12)


@pytest.mark.parametrize(
    "shape",
    [
        {"box_m": BOX["box_m"], "count": [3, 4]},
        {"center_m": [0.0, 0.25], "radius_m": 0.04, "count": 2},
        {"box_m": [[0.0, 0.0], [0.2, 0.3]], "directions": 3},
    ],
)
def test_a_finer_task_holds_the_points_and_directions_of_the_coarser(shape):
    coarse, fine = task(**shape), task(finer=2, **shape)
    for name in ("positions", "directions"):
        some, more = getattr(coarse, name), getattr(fine, name)
        if some is None:
            continue
        distance = np.linalg.norm(some[:, None] - more, axis=-1)
        assert distance.min(axis=1).max() < 1e-12
        assert len(more) > len(some)


def test_a_disk_reaches_its_rim_evenly():
    points = task(center_m=[0.01, 0.25], radius_m=0.05, count=3).positions
    r = np.linalg.norm(points - [0.01, 0.25, 0.0], axis=1)
    assert len(points) == 1 + 6 + 12 + 18
    assert r.max() == pytest.approx(0.05)
    assert np.isclose(r, 0.05).sum() == 18


def test_a_ball_and_directions_in_space():
    arm = load("phantom-premium-1.5")
    found = task(arm, center_m=list(arm.at().posture.position), radius_m=0.01, count=1, directions=7)
    np.testing.assert_allclose(np.linalg.norm(found.directions, axis=1), 1.0)
    assert (found.directions[:, 2] > 0).all()
    r = np.linalg.norm(found.positions - found.positions[0], axis=1)
    np.testing.assert_allclose(r[1:], 0.01)
    assert found.grid.shape == (19, 1, 3)
