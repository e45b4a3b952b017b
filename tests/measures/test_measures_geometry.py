"""Clearance, limits, singularities, extent, first mode and heat: each by a second route, over bundled devices."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize

import zwidth
from zwidth.device import bundled_names
from zwidth.errors import MeasureError
from zwidth.measures import OK
from zwidth.measures.geometry import (
    limit_margin,
    link_distance,
    neighbours,
    reciprocal_condition,
    rods_of,
    segment_distance,
)
from zwidth.model import link_points

PLANTS = ("published-two-mass", "hapkit-course")
MECHANISMS = [name for name in bundled_names() if name not in PLANTS]
AT = [[0.0, 0.25], [0.08, 0.2], [-0.1, 0.15], [0.9, 0.9]]


def least_distance(p, q, r, s):
    """Of two segments, by a bounded least-squares problem."""
    A = np.column_stack([q - p, r - s])
    found = scipy.optimize.lsq_linear(A, r - p, (0.0, 1.0), tol=1e-14)
    return float(np.linalg.norm(A @ found.x - (r - p)))


def test_the_distance_of_segments_is_the_least_of_a_bounded_problem():
    rng = np.random.default_rng(4)
    ends = rng.normal(size=(300, 4, 3))
    ends[100:150, :, 2] = 0.0  # in a plane, many of them crossing
    ends[150:200, 3] = ends[150:200, 2] + (ends[150:200, 1] - ends[150:200, 0]) * rng.normal(
        size=(50, 1)
    )  # parallel
    ends[200:230, 1] = ends[200:230, 0]  # points
    ends[230:240, 1], ends[230:240, 3] = ends[230:240, 0], ends[230:240, 2]
    found = segment_distance(*np.moveaxis(ends, 1, 0))
    expected = [least_distance(*four) for four in ends]
    np.testing.assert_allclose(found, expected, atol=2e-7)
    assert np.sum(found < 1e-12) > 5
    np.testing.assert_allclose(segment_distance(*np.moveaxis(ends[:, [2, 3, 1, 0]], 1, 0)), found, atol=1e-12)


def test_segments_without_numbers_have_no_distance():
    nothing = np.full(3, np.nan)
    assert np.isnan(segment_distance(np.zeros(3), np.ones(3), nothing, np.ones(3)))


def capsule_distance(mujoco, one, other, radius):
    """Distance of two rods with round ends by MuJoCo, negative where they overlap."""
    geoms = "".join(
        f'<geom type="capsule" size="{radius}" fromto="{" ".join(map(repr, map(float, np.ravel(ends))))}"/>'
        for ends in (one, other)
    )
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody><body>{geoms[: geoms.index('/>') + 2]}</body>"
        f"<body>{geoms[geoms.index('/>') + 2 :]}</body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None))


@pytest.mark.parametrize("name", ["haply-pantograph", "stamper-delta", "touch-omni"])
def test_clearance_is_that_of_capsules_in_mujoco(name):
    mujoco = pytest.importorskip("mujoco")
    device = zwidth.load(name)
    point = device.at()
    mechanism, posture = point.mechanism, point.posture
    rods, beside = rods_of(mechanism, posture), neighbours(mechanism)
    radius = 0.003
    least = np.inf
    for i in range(len(rods.link)):
        for j in range(i):
            pair = min(rods.link[i], rods.link[j]), max(rods.link[i], rods.link[j])
            if pair[0] != pair[1] and pair not in beside:
                one, other = ((rods.first[k], rods.last[k]) for k in (i, j))
                least = min(least, capsule_distance(mujoco, one, other, radius))
    found = float(point.measure("link_clearance", link_radius=radius).values)
    if np.isinf(least):
        assert found == np.inf
    else:
        assert found == pytest.approx(least, abs=1e-6)


def elbows(position, upper, lower):
    """Both elbows of a five-bar whose base joints stand at the origin, elbows out."""
    x, y = position
    r = np.hypot(x, y)
    along, half = np.arctan2(y, x), np.arccos((upper**2 + r**2 - lower**2) / (2.0 * upper * r))
    return [upper * np.array([np.cos(along + side * half), np.sin(along + side * half)]) for side in (-1.0, 1.0)]


def test_reach_and_clearance_of_a_five_bar_are_those_of_its_triangles():
    point = zwidth.load("five-bar").at(AT)
    reach = {axis: point.measure(f"reach{axis}").values for axis in ("", "_x", "_y", "_z")}
    clearance = point.measure("link_clearance", link_radius=0.004)
    for n, position in enumerate(AT[:3]):
        points = np.array([*elbows(position, 0.147, 0.199), position])
        assert reach[""][n] == pytest.approx(np.linalg.norm(points, axis=1).max(), rel=1e-9)
        assert reach["_x"][n] == pytest.approx(np.abs(points[:, 0]).max(), rel=1e-9)
        assert reach["_y"][n] == pytest.approx(np.abs(points[:, 1]).max(), rel=1e-9)
        # an upper link meets the other arm's lower one, with which it shares no joint
        (right, left), hand, base = points[:2], points[2], np.zeros(2)
        least = min(least_distance(base, right, left, hand), least_distance(base, left, right, hand))
        assert clearance.values[n] == pytest.approx(least - 0.008, abs=1e-9)
    assert np.all(reach["_z"][:3] == 0.0)
    assert clearance.status.tolist() == [OK, OK, OK, 1]
    assert np.isnan(reach[""][3])


def test_only_the_named_links_are_checked():
    point = zwidth.load("five-bar").at((0.08, 0.2))
    right, left = (np.append(elbow, 0.0) for elbow in elbows((0.08, 0.2), 0.147, 0.199))
    hand, base = np.array([0.08, 0.2, 0.0]), np.zeros(3)
    found = point.measure("link_clearance", link_radius=0.0, colliding_links=["upper-left:distal-right"])
    assert float(found.values) == pytest.approx(least_distance(base, left, right, hand), abs=1e-9)


WITHOUT_LENGTHS = ("openwrist", "rice-haptic-paddle")


@pytest.mark.parametrize("name", [name for name in MECHANISMS if name not in WITHOUT_LENGTHS])
def test_every_bundled_device_has_rods_that_join_its_joints_and_end_at_the_handle(name):
    point = zwidth.load(name).at()
    mechanism = point.mechanism
    rods = rods_of(mechanism, point.posture)
    ends = np.concatenate([rods.first, rods.last])
    origins = link_points(mechanism, point.posture).origin[mechanism.links.parent >= 0]
    for place in (point.posture.position, *origins):
        assert np.linalg.norm(ends - place, axis=1).min() < 1e-6
    assert all(i < j for i, j in neighbours(mechanism))
    assert link_distance(mechanism, point.posture, []) == np.inf


def test_the_margin_to_limits_is_one_in_the_middle_and_zero_at_an_end():
    low, high = np.array([-1.0, 0.1, -np.inf, 0.0]), np.array([2.0, 0.3, 1.0, np.inf])
    turns = np.array([True, False, True, True])
    for share in (0.0, 0.25, 0.5, 1.0):
        middle = np.array([-1.0 + 3.0 * share, 0.1 + 0.2 * share, 0.3, 0.3])
        expected = 1.0 - abs(2.0 * share - 1.0)
        np.testing.assert_allclose(
            limit_margin(middle, low, high, turns), [expected, expected, np.inf, np.inf], atol=1e-12
        )
        whole = middle + 2.0 * np.pi * np.array([3.0, 0.0, 1.0, 1.0])
        np.testing.assert_allclose(limit_margin(whole, low, high, turns)[0], expected, atol=1e-12)


def test_a_device_at_a_joint_s_limit_has_no_margin_left():
    device = zwidth.load("rice-haptic-paddle")
    point = device.at()
    links = point.mechanism.links
    joint = int(np.flatnonzero(np.isfinite(links.upper))[0])
    q, low, high = point.posture.angles[joint], links.lower[joint], links.upper[joint]
    expected = min(q - low, high - q) / (0.5 * (high - low))
    assert float(point.measure("joint_margin").values) == pytest.approx(expected, rel=1e-12)
    assert float(zwidth.load("five-bar").at().measure("joint_margin").values) == np.inf


@pytest.mark.parametrize("name", MECHANISMS)
def test_the_distance_to_singularity_is_the_condition_number_turned_over(name):
    point = zwidth.load(name).at()
    found = float(point.measure("distance_to_singularity").values)
    assert 0.0 <= found <= 1.0 + 1e-12
    if point.mechanism.controls != 1:
        assert found == pytest.approx(1.0 / float(point.measure("isotropy").values), rel=1e-12)


def test_it_falls_to_zero_towards_both_kinds_of_singularity():
    device = zwidth.load("haply-pantograph")
    reach = np.linspace(0.0, 1.0, 400)
    # of the first kind: towards the end of the reach the arms are stretched
    point = device.at()
    start = point.posture.position
    outwards = device.at(start + reach[:, None] * np.array([0.0, -0.4, 0.0]))
    known = outwards.status == OK
    values = outwards.measure("distance_to_singularity").values
    assert known[0]
    assert values[known].min() < 0.2 * values[known].max()
    # of the second kind: the largest singular value grows without bound
    links = np.array([[1.0, 1.0 - 1e-6], [1.0, 1.0 + 1e-6]])
    nearly = np.vstack([np.linalg.inv(links), np.zeros(2)])
    assert float(reciprocal_condition(nearly, 2)) < 1e-5


def test_a_pose_is_judged_the_same_in_every_unit():
    rng = np.random.default_rng(2)
    T, R = rng.normal(size=(2, 5, 3, 6))
    T *= 0.1
    found = reciprocal_condition(T, angular=R)
    np.testing.assert_allclose(reciprocal_condition(1000.0 * T, angular=R), found, rtol=1e-9)
    # a straight Gough platform that is isotropic: rows of equal norm, orthogonal once lengths are divided
    basis = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    assert float(reciprocal_condition(0.07 * basis[:3], angular=basis[3:])) == pytest.approx(1.0)
    assert np.isnan(reciprocal_condition(np.full((3, 6), np.nan), angular=R[0]))


def test_the_first_mode_is_the_first_natural_frequency_that_is_not_rigid():
    compared = 0
    for name in MECHANISMS:
        device = zwidth.load(name)
        point = device.at()
        if "dynamics" in point.missing:  # its masses are not known
            continue
        compared += 1
        frequencies = point.describe().natural_frequencies
        flexible = frequencies[frequencies > 0.0]
        expected = flexible.min() if len(flexible) else np.inf
        assert float(point.measure("first_mode").values) == pytest.approx(expected, rel=1e-9)
        if device.mechanism.controls == 0:
            together = device.at(np.repeat(point.posture.position[None], 2, axis=0)).measure("first_mode")
            np.testing.assert_allclose(together.values, expected, rtol=1e-9)
    assert compared >= 3


@pytest.mark.parametrize("model", ["two-mass", "motor-mass", "rigid"])
def test_the_first_mode_of_a_reduced_model_is_its_own(model):
    point = zwidth.load("five-bar").at(AT[:2], (0.6, 0.8), model=model)
    for n in range(2):
        frequencies = point[n].describe().natural_frequencies
        flexible = frequencies[frequencies > 0.0]
        expected = flexible.min() if len(flexible) else np.inf
        assert point.measure("first_mode").values[n] == pytest.approx(expected, rel=1e-9)


WINDINGS = {
    f"mechanism.drives.motor-{side}.winding_resistance_ohm": R for side, R in (("right", 1.5), ("left", 3.0))
}


def test_heat_is_that_of_the_torques_of_virtual_work():
    device = zwidth.load("five-bar").with_(WINDINGS)
    place, u, force, step = np.array([0.08, 0.2, 0.0]), np.array([0.6, 0.8, 0.0]), 3.0, 1e-6
    drives = device.mechanism.drives
    rates = []
    for axis in np.eye(3)[:2]:
        turned = [device.at(place + side * step * axis).posture.angles[drives.joint] for side in (-1.0, 1.0)]
        rates.append((turned[1] - turned[0]) / (2.0 * step))
    J = np.linalg.inv(np.array(rates).T)
    torques = J.T @ (force * u[:2])
    heat = np.sum((torques / (drives.transmission * drives.torque_constant)) ** 2 * np.array([1.5, 3.0]))
    found = device.at(place, u).measure("motor_heat", force=force)
    assert float(found.values) == pytest.approx(heat, rel=1e-6)
    assert float(device.at(place, u).measure("motor_heat", force=6.0).values) == pytest.approx(
        4.0 * heat, rel=1e-6
    )


def test_a_winding_without_resistor_does_not_brake():
    device = zwidth.load("five-bar")
    np.testing.assert_array_equal(device.with_(WINDINGS).at().plant.damping, device.at().plant.damping)
    assert not device.with_(WINDINGS).at().plant.lagged_dampers


def test_designs_together_are_the_designs_alone():
    device = zwidth.load("five-bar").with_(WINDINGS)
    wanted = {"link_radius": 0.004, "force": 2.0}
    names = [
        "first_mode",
        "distance_to_singularity",
        "joint_margin",
        "link_clearance",
        "reach",
        "reach_x",
        "motor_heat",
    ]
    lengths = [0.13, 0.15, 0.17]
    found = zwidth.sweep(
        device, {"links.upper-right.length_m": lengths, "loop.delay_samples": [0.0, 1.0]}, names, **wanted
    )
    for i, length in enumerate(lengths):
        point = device.with_({"links.upper-right.length_m": length}).at()
        for name in names:
            alone = float(point.measure(name, **wanted).values)
            np.testing.assert_allclose(found[name].values[i], alone, rtol=1e-9)


def test_a_design_whose_base_joints_meet_is_judged_alike_among_others():
    device = zwidth.load("five-bar")
    shifts = [0.0, 0.02]
    found = zwidth.sweep(device, {"links.upper-left.origin_m.0": shifts}, ["link_clearance"], link_radius=0.001)
    for i, shift in enumerate(shifts):
        alone = (
            device.with_({"links.upper-left.origin_m.0": shift}).at().measure("link_clearance", link_radius=0.001)
        )
        assert found["link_clearance"].values[i] == pytest.approx(float(alone.values), rel=1e-9)
    assert found["link_clearance"].values[0] > 0.05  # the two upper links share a joint there


def test_a_given_plant_has_a_first_mode_and_no_geometry():
    point = zwidth.load("published-two-mass").at()
    expected = np.sqrt(15620.0 * (1.0 / 0.2616 + 1.0 / 0.0254)) / (2.0 * np.pi)
    assert float(point.measure("first_mode").values) == pytest.approx(expected, rel=1e-3)
    for name in ("reach", "joint_margin", "distance_to_singularity"):
        with pytest.raises(MeasureError, match=r"needs a \[mechanism\]"):
            point.measure(name)
