"""Measures of a user's own: found in a file, asked, and failing in their own cells only."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest

from zwidth.device.load import load
from zwidth.measures import FAILED, NO_VALUE, OK, Measure, load_measures, measure
from zwidth.study import map_job, plane_of, workspace_map

GOOD = '''
from zwidth import measure

ACCELERATION = 10.0

@measure(unit="N", title="Force for 10 m/s^2", better="lower")
def inertial_force(place):
    return ACCELERATION * place.effective.rigid_mass

@measure(along=False, each=False)
def height(place):
    """How high the handle is."""
    return place.posture.position[..., 1]

def helper(place):
    return 1.0

if __name__ == "__main__":
    raise SystemExit("this is no script")
'''


@pytest.fixture
def write(tmp_path):
    def writes(text, name="my.py"):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return writes


def test_all_measures_of_a_file_are_found(write):
    found = load_measures(write(GOOD))
    assert set(found) == {"inertial_force", "height"}
    force, height = found["inertial_force"], found["height"]
    assert (force.unit, force.title, force.better) == ("N", "Force for 10 m/s^2", "lower")
    assert (force.each, force.along, force.source) == (True, True, "your own, my.py")
    assert height.title.startswith("How high ")
    assert (height.unit, height.each, height.along) == ("", False, False)


def test_they_are_mapped_like_others(write):
    own = load_measures(write(GOOD))
    device = load("five-bar")
    plane = plane_of(device, cells=(9, 5))
    found = workspace_map(device, ["inertial_force", "height", "rigid_mass"], plane, user_measures=own)
    np.testing.assert_allclose(found["inertial_force"], 10.0 * found["rigid_mass"])
    reach = found["rigid_mass_status"].values == OK
    np.testing.assert_array_equal(found["height"].values[reach], plane.positions[..., 1][reach])


def test_they_are_asked_in_other_processes_too(write, tmp_path):
    own = load_measures(write(GOOD))
    device = load("five-bar")
    job = map_job(device, ["inertial_force"], plane_of(device, cells=(4, 3)), user_measures=own)
    data = pickle.dumps(job)
    assert b"__main__" not in data  # which would stand for a function that only this process has
    (tmp_path / "job").write_bytes(data)
    (tmp_path / "my.py").unlink()  # what was loaded is what is asked
    program = (
        "import pickle, sys; job = pickle.load(open(sys.argv[1], 'rb')); print(job.compute(0, 12).values.tolist())"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "job")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    values = np.array(eval(done.stdout, {"nan": np.nan}))
    np.testing.assert_array_equal(values, job.compute(0, 12).values)
    assert np.isfinite(values).any()


def test_another_text_is_another_question(write):
    device = load("five-bar")
    plane = plane_of(device, cells=(4, 3))
    questions = {
        map_job(device, ["inertial_force"], plane, user_measures=load_measures(write(text))).question
        for text in (GOOD, GOOD.replace("10.0", "20.0"), GOOD)
    }
    assert len(questions) == 2


BROKEN = """
from zwidth import measure
import numpy as np

@measure()
def fails(place):
    x, y, _ = place.posture.position
    if x < -0.1:
        raise KeyError("no such thing")
    if x < 0.0:
        return np.ones(2)
    if y < 0.15:
        return "much"
    if y < 0.2:
        return None
    if y < 0.25:
        return 1j
    if y < 0.27:
        raise SystemExit(3)
    if y < 0.29:
        return float("nan")
    return np.float32(2.5)

@measure(each=False)
def wrong_shape(place):
    return np.ones((2, 3))

@measure(each=False)
def raises(place):
    return 1 / 0

@measure(each=False)
def texts(place):
    return np.full(place.shape, "x")
"""


def test_what_fails_fails_in_its_own_cells(write):
    device = load("five-bar")
    own = load_measures(write(BROKEN))
    plane = plane_of(device, x=(-0.15, 0.05), y=(0.12, 0.32), cells=(5, 11))
    found = workspace_map(device, [*own, "rigid_mass"], plane, user_measures=own)
    x, y = plane.positions[..., 0], plane.positions[..., 1]
    reach = found["rigid_mass_status"].values == OK
    expected = np.where((x < 0.0) | (y < 0.27), FAILED, np.where(y < 0.29, NO_VALUE, OK))
    np.testing.assert_array_equal(found["fails_status"].values[reach], expected[reach])
    np.testing.assert_array_equal(found["fails"].values[reach & (expected == OK)], 2.5)
    notes = found["fails"].attrs["notes"]
    for said in (
        "failed: raised KeyError: 'no such thing'",
        "failed: returned an array of shape (2,) instead of one number",
        "failed: returned 'much' instead of a number",
        "failed: returned None instead of a number",
        "failed: returned 1j instead of a number",
        "failed: raised SystemExit: 3",
        "no value: has no value here",
    ):
        assert said in notes
    for name, said in (
        ("wrong_shape", "returned an array of shape (2, 3)"),
        ("raises", "raised ZeroDivisionError: division by zero"),
        ("texts", "instead of numbers"),
    ):
        assert (found[f"{name}_status"].values[reach] == FAILED).all()
        assert said in found[name].attrs["notes"]
    assert np.isfinite(found["rigid_mass"].values[reach]).all()


def test_what_it_prints_does_not_stand_in_the_answer(write, capsys):
    own = load_measures(write("print('loading')\n" + GOOD.replace("return ACC", "print('asked'); return ACC")))
    device = load("five-bar")
    workspace_map(device, ["inertial_force"], plane_of(device, cells=(3, 2)), user_measures=own, workers=1)
    said = capsys.readouterr()
    assert (said.out, set(said.err.split())) == ("", {"loading", "asked"})


def test_the_decorator_makes_a_measure():
    @measure(unit="m", better="higher")
    def reach(place):
        return 1.0

    assert isinstance(reach, Measure)
    assert (reach.name, reach.title, reach.source) == ("reach", "reach", "your own")
