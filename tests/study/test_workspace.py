"""Maps of the workspace: what they hold, and that each cell is what is found when it is asked alone."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.model.model_cases import random_five_bar, spatial_arm
from zwidth.device.load import load
from zwidth.errors import DeviceError, NoValueError, PostureError
from zwidth.measures import FAILED, MEASURES, NO_VALUE, OK, OUT_OF_REACH, STATUS, Measure, WantedWall
from zwidth.measures.evaluation import evaluate_safely
from zwidth.study import Store, map_job, over_the_workspace, plane_of, workspace_map
from zwidth.study.designs.column import plane_positions
from zwidth.study.workspace.map import MapJob, map_dataset

SINGLE_POINT_MEASURE = Measure(
    "each", "Asked one by one", "N", "lower", "", lambda place: 10.0 * float(place.effective.rigid_mass), each=True
)


@pytest.fixture(scope="module")
def device():
    return load("five-bar")


def random_device(seed, make=random_five_bar):
    mechanism = make(np.random.default_rng(seed))
    return replace(
        load("five-bar"),
        mechanism=mechanism,
        reference_position=mechanism.reference_position,
        reference_assembly=next(iter(mechanism.assemblies)),
    )


def left_half_only(place):
    """A measure without a value on the right, and with none for x = 0."""
    x = place.posture.position[0]
    if x > 0.0:
        raise NoValueError("not on the right")
    if x == 0.0:
        raise RuntimeError("not in the middle")
    return -x


LEFT_HALF_MEASURE = Measure("left", "Left", "m", "higher", "", left_half_only, each=True, along=False)


def test_what_a_map_holds(device):
    found = workspace_map(
        device, ["rigid_mass", "isotropy"], plane_of(device, cells=(13, 7)), wall=WantedWall(5.0)
    )
    assert found["rigid_mass"].dims == ("y_m", "x_m")
    assert found["rigid_mass"].shape == (7, 13)
    assert found["isotropy_status"].dtype == np.uint8
    assert found["isotropy_status"].attrs["flag_values"].tolist() == list(STATUS)
    assert found["isotropy_status"].attrs["flag_meanings"].split()[:2] == ["ok", "out_of_reach"]
    about = found["rigid_mass"].attrs
    assert (about["unit"], about["better"], about["key"]) == ("kg", "", "rigid_mass_kg")
    assert about["title"] == MEASURES["rigid_mass"].title
    assert found["isotropy"].attrs["better"] == "lower"
    assert found.attrs["assembly"] == "elbows-out"
    assert found.attrs["direction"] == [0.0, 1.0, 0.0]
    assert found.attrs["wanted_stiffness_N_per_m"] == 5.0
    assert found.attrs["sampling_period_s"] == 0.00125
    np.testing.assert_allclose(plane_positions(found), plane_of(device, cells=(13, 7)).positions)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
@pytest.mark.parametrize("make", [random_five_bar, spatial_arm])
def test_each_cell_is_the_question_asked_alone(seed, make):
    device = random_device(seed, make)
    x, y, _ = device.reference_position
    plane = plane_of(device, "xy", x=(x - 0.12, x + 0.12), y=(y - 0.12, y + 0.12), cells=(7, 6))
    names = ["rigid_mass", "stiffness", "manipulability", "isotropy", SINGLE_POINT_MEASURE]
    direction = np.array([0.6, -0.8, 0.0])
    found = workspace_map(device, names, plane, direction)
    for row in range(6):
        for column in range(7):
            where = plane.positions[row, column]
            try:
                place = device.at(where, direction)
                missed = place.posture.projected > 0.0  # within the tolerance, which a map does not have
            except PostureError:
                missed = True
            if missed:
                assert found["rigid_mass_status"].values[row, column] != OK
                assert np.isnan(found["rigid_mass"].values[row, column])
                continue
            for one in names:
                measure = MEASURES.get(one, SINGLE_POINT_MEASURE)
                value = float(measure.compute(place))
                assert found[measure.name].values[row, column] == pytest.approx(value, rel=1e-9)
                assert found[f"{measure.name}_status"].values[row, column] == OK


def test_the_exact_stiffness_is_the_chart_s(device):
    from zwidth.chart import largest_stiffness

    plane = plane_of(device, x=(-0.2, 0.2), y=(0.1, 0.3), cells=(3, 3))
    found = workspace_map(device, ["stiffness_max"], plane)
    for row, column in ((0, 1), (1, 0), (2, 1)):
        peak = largest_stiffness(device.at(plane.positions[row, column]).loop)
        assert found["stiffness_max"].values[row, column] == pytest.approx(peak.stiffness, rel=1e-9)


SYMMETRIC = ("mechanism.drives.motor-left.stiffness_Nm_per_rad=0.45",)


def test_a_map_of_a_symmetric_device_is_symmetric():
    symmetric = load("five-bar", SYMMETRIC)
    names = ["rigid_mass", "stiffness", "isotropy", "link_side_mass", "stiffness_max"]
    plane = plane_of(symmetric, cells=(15, 6))
    for direction in (None, (1.0, 0.0)):
        found = workspace_map(symmetric, names, plane, direction)
        for name in names:
            values = found[name].values
            np.testing.assert_allclose(values, values[:, ::-1], rtol=1e-7)
            np.testing.assert_array_equal(found[f"{name}_status"], found[f"{name}_status"][:, ::-1])
    # and the device as measured is not
    lopsided = workspace_map(load("five-bar"), ["stiffness"], plane)["stiffness"].values
    assert np.nanmax(np.abs(lopsided - lopsided[:, ::-1])) > 100.0


def test_extreme_directions_of_a_symmetric_device_mirror_each_other():
    symmetric = load("five-bar", SYMMETRIC)
    found = workspace_map(symmetric, ["stiffness"], plane_of(symmetric, cells=(14, 6)), "worst")
    u = found["stiffness_direction"].values
    assert found["stiffness_direction"].dims == ("y_m", "x_m", "component")
    np.testing.assert_allclose(found["stiffness"].values, found["stiffness"].values[:, ::-1], rtol=1e-7)
    mirrored = u[:, ::-1] * [-1.0, 1.0, 1.0]
    cosine = np.abs((u * mirrored).sum(axis=-1))
    assert np.nanmin(cosine) > 1.0 - 1e-8
    assert np.nanmax(np.abs(u[..., 2])) < 1e-12
    assert (np.isnan(u[..., 0]) == (found["stiffness_status"].values != OK)).all()


def test_a_cell_that_fails_says_so_and_the_rest_is_kept(device):
    plane = plane_of(device, x=(-0.2, 0.2), y=(0.1, 0.3), cells=(5, 3))
    found = workspace_map(device, [LEFT_HALF_MEASURE, "rigid_mass"], plane)
    expected = np.array([[OK, OK, FAILED, NO_VALUE, NO_VALUE]] * 3)
    reach = found["rigid_mass_status"].values == OK
    np.testing.assert_array_equal(found["left_status"].values[reach], expected[reach])
    np.testing.assert_allclose(found["left"].values[:, :2][reach[:, :2]], np.array([[0.2, 0.1]] * 3)[reach[:, :2]])
    assert np.isfinite(found["rigid_mass"].values[reach]).all()
    notes = found["left"].attrs["notes"].splitlines()
    assert any(
        note.startswith("3 cells failed: ") and note.endswith("first at x = 0 m, y = 0.1 m") for note in notes
    )
    assert any("no value" in note and note.endswith("; first at x = 0.1 m, y = 0.1 m") for note in notes)


def test_what_was_stored_is_not_computed_again(device, tmp_path):
    plane = plane_of(device, cells=(9, 5))
    job = map_job(device, ["rigid_mass", "isotropy"], plane, "lowest")
    assert job.question == map_job(device, ["rigid_mass", "isotropy"], plane, "lowest").question
    for other in (
        map_job(device, ["rigid_mass", "isotropy"], plane, "highest"),
        map_job(device, ["rigid_mass"], plane, "lowest"),
        map_job(device, ["rigid_mass", "isotropy"], plane_of(device, cells=(9, 6)), "lowest"),
        map_job(load("five-bar", ["loop.delay_samples=1"]), ["rigid_mass", "isotropy"], plane, "lowest"),
        map_job(device, ["rigid_mass", "isotropy"], plane, "lowest", wall=WantedWall(1.0)),
        map_job(device, ["rigid_mass", "isotropy"], plane, "lowest", model="rigid"),
    ):
        assert other.question != job.question
    ask = partial(workspace_map, device, ["rigid_mass", "isotropy"], plane, "lowest")
    first = ask(store=Store(tmp_path / "store", job))
    computed = []
    original = MapJob.compute
    MapJob.compute = lambda self, a, b: computed.append((a, b)) or original(self, a, b)
    try:
        again = ask(store=Store(tmp_path / "store", job))
    finally:
        MapJob.compute = original
    assert not computed
    assert first.equals(again)


def test_results_do_not_depend_on_how_cells_are_cut(device):
    job = map_job(device, ["rigid_mass", SINGLE_POINT_MEASURE], plane_of(device, cells=(11, 6)), "lowest")
    whole, parts = job.compute(0, 66), [job.compute(a, a + 6) for a in range(0, 66, 6)]
    values = np.concatenate([part.values for part in parts])
    np.testing.assert_allclose(whole.values[:, [0, 4]], values[:, [0, 4]], rtol=1e-10)
    np.testing.assert_allclose(whole.values, values, rtol=1e-10, atol=1e-7)
    np.testing.assert_array_equal(whole.status, np.concatenate([part.status for part in parts]))


def test_a_map_s_job_can_be_sent_to_other_processes(device):
    job = map_job(device, ["rigid_mass"], plane_of(device, cells=(5, 4)), "lowest")
    sent = pickle.loads(pickle.dumps(job))
    assert sent.question == job.question
    assert map_dataset(sent, sent.compute(0, 20)).equals(map_dataset(job, job.compute(0, 20)))


def test_many_cells_cost_little():
    """A guard against cells asked one by one in Python: a thousand cells are a few times ten."""
    from time import process_time

    device = load("five-bar")
    plane = plane_of(device, cells=(60, 60))
    workspace_map(device, ["rigid_mass", "isotropy"], plane)
    began = process_time()
    workspace_map(device, ["rigid_mass", "isotropy"], plane)
    assert process_time() - began < 1.0


def test_a_plant_has_no_workspace():
    with pytest.raises(DeviceError, match="no \\[mechanism\\]"):
        workspace_map(load("published-two-mass"), ["stiffness_max"])


def test_averages_are_integrals(device):
    """Of a measure that is linear in x and y the trapezoidal rule is exact."""
    linear = Measure("linear", "", "m", "higher", "", lambda place: place.posture.position @ [2.0, 1.0, 0.0])
    plane = plane_of(device, x=(-0.05, 0.15), y=(0.15, 0.25), cells=(9, 5))
    found = workspace_map(device, [linear, "isotropy"], plane)
    numbers = over_the_workspace(found, "linear", device)
    assert numbers["average"] == pytest.approx(2.0 * 0.05 + 0.2, rel=1e-12)
    assert (numbers["worst"], numbers["best"]) == (pytest.approx(0.05), pytest.approx(0.55))
    assert "conditioning_index" not in numbers
    numbers = over_the_workspace(found, "isotropy", device)
    condition = found["isotropy"].values
    weights = np.outer([0.5, 1, 1, 1, 0.5], [0.5, *[1] * 7, 0.5])
    assert numbers["conditioning_index"] == pytest.approx((weights / condition).sum() / weights.sum())
    assert 0.0 < numbers["isotropy_index"] < 1.0 / condition.max()
    assert (found["isotropy_status"].values != OUT_OF_REACH).all()


def test_the_unit_of_a_volume_has_its_power(device):
    plane = plane_of(device, cells=(4, 4))
    found = workspace_map(device, ["manipulability", "dynamic_manipulability"], plane)
    assert found["manipulability"].attrs["unit"] == "m^2/rad^2"
    assert found["dynamic_manipulability"].attrs["unit"] == "1/(kg m)^2"


def test_one_question_alone_is_answered_as_in_a_map(device):
    place = device.at()
    value, status, reason = evaluate_safely(lambda: SINGLE_POINT_MEASURE.compute(place))
    assert (status, reason) == (OK, "")
    assert value == pytest.approx(10.0 * float(place.effective.rigid_mass))
