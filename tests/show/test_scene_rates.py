"""How drawn points move, against differences of solved postures and against the plant's own handle."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.model.beam_devices import five_bar, planar_arm, slides, spatial_arm, spatial_loop
from tests.model.model_cases import KINDS
from tests.model.random_mechanisms import random_mechanisms
from zwidth.device import from_document
from zwidth.model import ORIENTATION, pack, rotation_matrix, solve_posture
from zwidth.show.mechanism_scene import mechanism_scene, mode_strokes

STEP = 1e-5  # m, or rad; of central differences
RELATIVE = 1e-7  # what these leave, of the largest rate
BENDING = {
    "planar": planar_arm,
    "spatial": spatial_arm,
    "loop": five_bar,
    "spatial loop": spatial_loop,
    "slides": slides,
}


def some_mechanisms():
    """Planar and spatial, open and closed, of every kind of joint; a wrist, of which nothing has a length."""
    rng = np.random.default_rng(5)
    for name, make in KINDS.items():
        yield name, make(rng)
    for joints, loops in ((3, 0), (6, 0), (7, 1), (9, 2)):
        for n, mechanism in enumerate(random_mechanisms(40 + joints, 2, joints, loops)):
            yield f"random {joints} {loops} {n}", mechanism
    for name in ("stamper-delta", "novint-falcon", "touch-omni", "haply-2diy", "openwrist"):
        yield name, zwidth.load(name).mechanism


MECHANISMS = dict(some_mechanisms())


def drawn(mechanism, posture):
    """All points of the picture (k, 3)."""
    scene = mechanism_scene(mechanism, posture)
    return np.vstack([*scene.strokes, scene.joints, scene.driven, scene.handle])


def stacked(rates):
    """Their rates (k, 3, n), in the same order."""
    return np.concatenate([rates.strokes, rates.joints, rates.driven, rates.handle[None]])


def turned_to(mechanism, here, motion):
    """The posture whose controlled coordinates are changed by a small motion (6,) of the handle."""
    orientation = None if here.rotation is None else rotation_matrix(motion[3:]) @ here.rotation
    position = None if mechanism.controls == ORIENTATION else here.position + motion[:3]
    return solve_posture(mechanism, position, here.assembly, orientation=orientation)


@pytest.mark.parametrize("name", MECHANISMS)
def test_drawn_points_move_as_between_solved_postures(name) -> None:
    mechanism = MECHANISMS[name]
    here = solve_posture(mechanism)
    rates = mode_strokes(mechanism, here)
    assert rates.handle == pytest.approx(here.jacobian, abs=1e-12)
    found = stacked(rates)
    assert len(found) == len(drawn(mechanism, here))
    for drive in range(pack(mechanism).driven):
        step = STEP / max(1.0, np.abs(found[:, :, drive]).max())
        motion = step * np.concatenate([here.jacobian[:, drive], here.angular_jacobian[:, drive]])
        ahead, back = (drawn(mechanism, turned_to(mechanism, here, way * motion)) for way in (1.0, -1.0))
        error = np.abs((ahead - back) / (2.0 * step) - found[:, :, drive]).max()
        assert error < RELATIVE * np.abs(found).max(), drive


@pytest.mark.parametrize("name", BENDING)
def test_links_that_bend_move_the_handle_as_their_plant_does(name) -> None:
    point = from_document(BENDING[name]()).at()
    plant = point.plant
    rates = mode_strokes(point.mechanism, point.posture, plant.size)
    assert rates.strokes.shape[2] == plant.size
    assert point.direction[:3] @ rates.handle == pytest.approx(
        plant.handle, abs=1e-12 * np.abs(plant.handle).max()
    )
    bending = [each.startswith("bending") for each in plant.names]
    motors = [each.endswith("motor") for each in plant.names]
    assert any(motors)
    assert np.abs(rates.handle[:, bending]).max() > 1e-6, "bending is seen"
    assert not stacked(rates)[:, :, motors].any(), "no link moves with a motor alone"


@pytest.mark.parametrize("name", ["loop", "spatial loop"])
def test_loops_of_bending_links_stay_closed(name) -> None:
    """Both links are drawn to where a loop meets, each by its own motion, which is the same."""
    point = from_document(BENDING[name]()).at()
    rates, scene = mode_strokes(point.mechanism, point.posture), mechanism_scene(point.mechanism, point.posture)
    points, closed = np.vstack(scene.strokes), len(point.mechanism.closures.a)
    assert closed > 0
    for meeting, moving in zip(scene.joints[-closed:], rates.joints[-closed:], strict=True):
        ends = np.linalg.norm(points - meeting, axis=1) < 1e-6
        assert np.count_nonzero(ends) >= 2
        assert np.abs(rates.strokes[ends] - moving).max() < 1e-9 * np.abs(rates.strokes).max()
