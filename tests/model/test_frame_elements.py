"""The judge of flexible mechanisms against closed forms: orientation, joints, bodies and buckling."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.model.frame_elements import (
    GROUND,
    Frame,
    axial_forces,
    buckling_factor,
    natural_frequencies,
    static_response,
)

# Soft in the x-y plane, next in the x-z plane
BEAM = SimpleNamespace(
    EI_y=40.0, EI_z=10.0, GJ=500.0, EA=1e6, mass_per_length=0.3, torsional_inertia_per_length=2e-4
)
L = 0.4
TURN = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
CLAMPED = "clamped"


def straight(elements, turn=TURN, length=L, beam=BEAM):
    """A frame with one beam, along the x of the turned axes, and the points along it."""
    frame = Frame()
    points = frame.point((0.1, 0.2, -0.3)), frame.point(np.array((0.1, 0.2, -0.3)) + turn[:, 0] * length)
    return frame, frame.member(*points, beam, y_axis=turn[:, 1], elements=elements)


def beam_frequency(root, EI, length=L):
    """Of a root b = beta L [Hz]."""
    return root**2 / (2.0 * np.pi) * np.sqrt(EI / (BEAM.mass_per_length * length**4))


def test_a_cantilever_in_any_orientation():
    frame, along = straight(16)
    frame.clamp(along[0])
    bending = [beam_frequency(b, EI) for EI in (BEAM.EI_z, BEAM.EI_y) for b in (1.875104069, 4.694091133)]
    frequencies = natural_frequencies(frame, 3)
    assert frequencies == pytest.approx(np.sort(bending)[:3], rel=2e-5)


def test_stretch_and_twist_of_a_cantilever():
    """A quarter wave, too high by (pi / (2 n))^2 / 24 for n linear elements."""
    n = 20
    frame, along = straight(n)
    frame.clamp(along[0])
    found = natural_frequencies(frame, 6 * n)
    for speed in (
        np.sqrt(BEAM.EA / BEAM.mass_per_length),
        np.sqrt(BEAM.GJ / BEAM.torsional_inertia_per_length),
    ):
        expected = speed / (4.0 * L) * (1.0 + (0.5 * np.pi / n) ** 2 / 24.0)
        assert np.min(np.abs(found / expected - 1.0)) < 1e-6


def test_deflections_of_a_cantilever():
    frame, along = straight(3)
    frame.clamp(along[0])
    force, torque = np.array([7.0, 2.0, -3.0]), np.array([0.5, 0.2, -0.3])
    moved = static_response(frame, {along[-1]: np.concatenate([TURN @ force, TURN @ torque])})[along[-1]]
    E_y, E_z = BEAM.EI_y, BEAM.EI_z
    tip = [
        7.0 * L / BEAM.EA,
        2.0 * L**3 / (3 * E_z) - 0.3 * L**2 / (2 * E_z),
        -3.0 * L**3 / (3 * E_y) - 0.2 * L**2 / (2 * E_y),
    ]
    turns = [0.5 * L / BEAM.GJ, 0.2 * L / E_y + 3.0 * L**2 / (2 * E_y), -0.3 * L / E_z + 2.0 * L**2 / (2 * E_z)]
    assert TURN.T @ moved[:3] == pytest.approx(tip, rel=1e-10)
    assert TURN.T @ moved[3:] == pytest.approx(turns, rel=1e-10)
    assert axial_forces(frame, static_response(frame, {along[-1]: np.r_[TURN @ force, 0, 0, 0]})) == pytest.approx(
        [7.0]
    )


def test_sway_of_a_portal():
    """Slope and deflection of two clamped legs and a beam: with t the turn of both corners and d their sway,
    (4 EI/h + 6 EI/l) t = 6 EI/h^2 d  and  2 (12 EI/h^3 d - 6 EI/h^2 t) = H."""
    stiff = SimpleNamespace(**{**vars(BEAM), "EA": 1e9})
    h, l, H, EI = 0.5, 0.3, 4.0, BEAM.EI_z
    frame = Frame()
    feet = [frame.point(TURN @ (x, 0.0, 0.0)) for x in (0.0, l)]
    heads = [frame.point(TURN @ (x, h, 0.0)) for x in (0.0, l)]
    for start, end in (*zip(feet, heads, strict=True), heads):
        frame.member(start, end, stiff, y_axis=TURN @ (-1.0, 1.0, 0.0), elements=2)
    for foot in feet:
        frame.clamp(foot)
    moved = static_response(frame, {heads[0]: np.r_[TURN @ (H, 0.0, 0.0), 0, 0, 0]})
    turn_, sway = np.linalg.solve(
        [[4 * EI / h + 6 * EI / l, -6 * EI / h**2], [-12 * EI / h**2, 24 * EI / h**3]], [0.0, H]
    )
    for head in heads:
        assert moved[head, :3] @ TURN == pytest.approx([sway, 0.0, 0.0], rel=1e-5, abs=1e-5 * sway)
        assert moved[head, 3:] @ TURN == pytest.approx([0.0, 0.0, -turn_], rel=1e-5, abs=1e-5 * turn_)


def test_two_free_beams_on_a_hinge():
    """Across the hinge each beam turns for itself: where both move alike it is pinned and free, where they move
    against each other, its end feels neither force nor moment. In the other plane they are one beam."""
    frame = Frame()
    left, right = (straight_from(frame, side) for side in (-1.0, 1.0))
    frame.hinge(left[0], right[0], TURN[:, 2])
    across = [beam_frequency(b, BEAM.EI_z) for b in (3.926602312, 4.730040745)]
    welded = beam_frequency(4.730040745, BEAM.EI_y, 2.0 * L)
    frequencies = natural_frequencies(frame, 10)
    assert np.count_nonzero(frequencies == 0.0) == 7
    assert frequencies[7:] == pytest.approx(np.sort([*across, welded]), rel=2e-4)


def straight_from(frame, side):
    """A beam from the origin to one side."""
    start, end = frame.point((0.0, 0.0, 0.0)), frame.point(TURN[:, 0] * side * L)
    return frame.member(start, end, BEAM, y_axis=TURN[:, 1], elements=12)


def test_a_ball_leaves_every_rotation_free():
    frame = Frame()
    left, right = (straight_from(frame, side) for side in (-1.0, 1.0))
    frame.ball(left[0], right[0])
    frequencies = natural_frequencies(frame, 11)
    assert np.count_nonzero(frequencies == 0.0) == 9
    assert frequencies[9:] == pytest.approx([beam_frequency(b, BEAM.EI_z) for b in (3.926602, 4.730041)], rel=2e-4)


def test_free_rigid_rods_on_springs():
    """n rods on springs k at their hinges, flying freely: with angles t, the energy is k/2 sum (t_i+1 - t_i)^2,
    and the places of their centres follow from the angles and from momentum being zero."""
    rigid = SimpleNamespace(**{name: 1e5 * value for name, value in vars(BEAM).items() if name[0] in "EG"})
    rigid.mass_per_length, rigid.torsional_inertia_per_length = 0.3, 2e-4
    n, k, m = 3, 5.0, 0.3 * L
    frame = Frame()
    rods = []
    for i in range(n):
        ends = [frame.point(TURN[:, 0] * L * place) for place in (i, i + 1)]
        rods.append(frame.member(*ends, rigid, y_axis=TURN[:, 1], elements=1))
        if i:
            frame.hinge(rods[i - 1][-1], rods[i][0], TURN[:, 2], stiffness=k)
    centres = L * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))  # of each rod, per angle of each
    centres -= centres.mean(axis=0)
    M = m * centres.T @ centres + m * L**2 / 12.0 * np.eye(n)
    K = k * np.diff(np.eye(n), axis=0).T @ np.diff(np.eye(n), axis=0)
    expected = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[1:]) / (2.0 * np.pi)
    frequencies = natural_frequencies(frame, 10)
    assert np.all(frequencies[:6] == 0.0)  # the whole chain
    assert frequencies[6:8] == pytest.approx(expected, rel=1e-5)
    assert frequencies[8] > 100.0 * frequencies[7]


def test_bodies_on_points():
    """A body beside the tip is one on a rigid arm; and a mass equal to the beam's gives the known roots."""
    frame, along = straight(16)
    frame.clamp(along[0])
    frame.body(along[-1], BEAM.mass_per_length * L)
    expected = [beam_frequency(b, BEAM.EI_z) for b in (1.247917, 4.031139)]
    frequencies = natural_frequencies(frame, 3)
    assert frequencies[[0, 2]] == pytest.approx(expected, rel=2e-5)
    offset, inertia = np.array([0.02, -0.05, 0.03]), np.diag([1e-4, 2e-4, 3e-4])
    both = []
    for arm in (False, True):
        frame, along = straight(4)
        frame.clamp(along[0])
        if arm:
            far = frame.point(frame.points[along[-1]] + offset)
            frame.rigid(far, along[-1])
            frame.body(far, 0.2, inertia)
        else:
            frame.body(along[-1], 0.2, inertia, offset)
        both.append(natural_frequencies(frame, 6))
    assert both[0] == pytest.approx(both[1], rel=1e-9)


def test_a_slider_on_a_spring():
    frame = Frame()
    block = frame.point((0.0, 0.0, 0.0))
    frame.body(block, 2.0, np.eye(3))
    frame.slider(block, GROUND, TURN[:, 1], stiffness=300.0)
    frequencies = natural_frequencies(frame, 6)
    assert frequencies == pytest.approx([np.sqrt(150.0) / (2.0 * np.pi)], rel=1e-12)
    assert static_response(frame, {block: np.r_[TURN[:, 1] * 30.0, 0, 0, 0]})[block, :3] == pytest.approx(
        0.1 * TURN[:, 1]
    )


def test_a_point_without_mass_follows():
    """A beam on two springs in a row, with nothing between them, is one on a spring of half the stiffness."""
    found = []
    for between in (True, False):
        frame, along = straight(6)
        at = frame.point(frame.points[along[0]])
        frame.hinge(along[0], at, TURN[:, 2], stiffness=8.0 if between else 4.0)
        if between:
            frame.hinge(at, GROUND, TURN[:, 2], stiffness=8.0)
        else:
            frame.clamp(at)
        found.append(natural_frequencies(frame, 4))
    assert found[0] == pytest.approx(found[1], rel=1e-9)


EULER = {(CLAMPED, CLAMPED): 4.0, (CLAMPED, "free"): 0.25, ("pinned", "pinned"): 1.0}


@pytest.mark.parametrize("ends", EULER)
def test_euler_buckling(ends):
    frame, along = straight(12)
    x = TURN[:, 0]
    if ends[0] == CLAMPED:
        frame.clamp(along[0])
    else:
        frame.hinge(along[0], GROUND, TURN[:, 2])
    if ends[1] != "free":  # a guide along the beam, and in it a hinge or none
        guide = frame.point(frame.points[along[-1]])
        frame.slider(guide, GROUND, x)
        if ends[1] == CLAMPED:
            frame.weld(along[-1], guide)
        else:
            frame.hinge(along[-1], guide, TURN[:, 2])
    factor = buckling_factor(frame, {along[-1]: np.r_[-2.0 * x, 0, 0, 0]})
    assert 2.0 * factor == pytest.approx(EULER[ends] * np.pi**2 * BEAM.EI_z / L**2, rel=2e-4)


def test_a_pulled_beam_sounds_higher_and_a_pressed_one_buckles():
    """Between hinges, w^2 = w0^2 (1 + N / N_Euler)."""
    frame, along = straight(10)
    frame.hinge(along[0], GROUND, TURN[:, 2])
    frame.slider(guide := frame.point(frame.points[along[-1]]), GROUND, TURN[:, 0])
    frame.hinge(along[-1], guide, TURN[:, 2])
    euler = np.pi**2 * BEAM.EI_z / L**2
    for share in (-0.9, 0.0, 3.0):
        expected = beam_frequency(np.pi, BEAM.EI_z) * np.sqrt(1.0 + share)
        assert natural_frequencies(frame, 1, [share * euler])[0] == pytest.approx(expected, rel=2e-4)
    assert np.isnan(natural_frequencies(frame, 1, [-1.1 * euler])[0])
