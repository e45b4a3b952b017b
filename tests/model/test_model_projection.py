"""Positions beside what a handle reaches: projected within a tolerance, else an error that names an answered
one."""

import numpy as np
import pytest

from tests.paddle import LENGTH, paddle
from zwidth.device.load import load
from zwidth.errors import OutOfReach
from zwidth.model import OK, OUT_OF_REACH, solve_posture


@pytest.fixture(scope="module")
def device(tmp_path_factory):
    return load(paddle(tmp_path_factory.mktemp("paddle")))


def test_a_position_beside_the_circle_is_projected_along_the_radius(device):
    rng = np.random.default_rng(5)
    for turn, off in zip(rng.uniform(0.2, 2.9, 4), rng.uniform(-0.009, 0.009, 4) * LENGTH, strict=True):
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        posture = device.at((LENGTH + off) * out).posture
        assert posture.position == pytest.approx(LENGTH * out, abs=1e-12)
        assert posture.projected == pytest.approx(abs(off), rel=1e-9)
        assert posture.angles[0] == pytest.approx(turn, abs=1e-10)


def test_a_position_that_is_had_is_not_moved(device):
    posture = device.at((0.0, LENGTH)).posture
    assert posture.position.tolist() == [0.0, LENGTH, 0.0]
    assert posture.projected == 0.0


def test_far_off_an_answered_position_is_named(device):
    with pytest.raises(OutOfReach, match=r"position .*\(0.054, 0.072, 0\) m, 10 mm away") as caught:
        device.at((0.06, 0.08))
    assert caught.value.nearest == pytest.approx([0.054, 0.072, 0.0], abs=1e-9)
    with pytest.raises(OutOfReach, match="answered position"):
        solve_posture(device.mechanism, (0.0, LENGTH + 1e-6))  # without a tolerance


def test_of_many_each_is_projected_or_marked(device):
    at = [[0.0, LENGTH + 1e-4], [0.0, LENGTH], [0.0, 2.0 * LENGTH], [np.nan, 0.0]]
    posture = solve_posture(device.mechanism, at, tolerance=0.01)
    assert posture.status.tolist() == [OK, OK, OUT_OF_REACH, OUT_OF_REACH]
    assert posture.position[:2] == pytest.approx(np.array([[0.0, LENGTH, 0.0]] * 2), abs=1e-12)
    assert posture.projected[:2] == pytest.approx([1e-4, 0.0], abs=1e-12)
    assert np.isnan(posture.projected[2:]).all()


def test_beyond_the_edge_of_a_plane_nothing_is_projected_and_what_is_named_can_be_had():
    """At the edge the drives lose the handle: what is named is a little within."""
    arms = load("five-bar")
    with pytest.raises(OutOfReach, match="answered position") as caught:
        arms.at((0.02, 0.35))
    named = str(caught.value).split("is (")[1].split(")")[0]
    nearest = caught.value.nearest
    assert [float(number) for number in named.split(",")] == pytest.approx(nearest, abs=1e-6)
    assert arms.at(nearest).posture.status == OK
    assert np.linalg.norm(nearest - [0.02, 0.35, 0.0]) < 0.02


def test_a_posture_is_given_by_its_driven_joints(device):
    posture = device.at({"lever": 1.2}).posture
    assert posture.angles[0] == pytest.approx(1.2, abs=1e-12)
    assert posture.position == pytest.approx(LENGTH * np.array([np.cos(1.2), np.sin(1.2), 0.0]), abs=1e-15)
    arms = load("five-bar")
    reference = arms.at().posture
    names = [arms.mechanism.links.names[joint] for joint in arms.mechanism.drives.joint]
    turned = dict(zip(names, reference.angles[arms.mechanism.drives.joint] + [0.1, -0.2], strict=True))
    posture = arms.at(turned).posture
    assert posture.angles[arms.mechanism.drives.joint] == pytest.approx(list(turned.values()), abs=1e-9)
    assert posture.closure_residual < 1e-14
