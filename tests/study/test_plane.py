"""Planes of the workspace: their grids, their default ranges, and planes that cannot be mapped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.model.model_cases import random_five_bar, spatial_arm
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import DeviceError, Singular, WorkspaceError
from zwidth.model import reachable_positions, solve_posture
from zwidth.study import plane_of
from zwidth.study.workspace.plane_grid import reachable_set, rounded_outwards


@pytest.fixture(scope="module")
def planar():
    return load("five-bar")


@pytest.fixture(scope="module")
def spatial(planar):
    mechanism = spatial_arm(np.random.default_rng(4))
    return replace(
        planar,
        mechanism=mechanism,
        reference_position=mechanism.reference_position,
        reference_assembly=next(iter(mechanism.assemblies)),
    )


def unbounded(planar):
    return load("five-bar", ["mechanism.workspace=unset"])


def test_coordinates_are_those_of_the_base_frame(spatial):
    through = spatial.reference_position
    for axes, (a, b) in {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}.items():
        plane = plane_of(spatial, axes, x=(-0.1, 0.2), y=(-0.3, 0.1), cells=(4, 3))
        assert plane.shape == (3, 4)
        assert plane.names == (axes[0], axes[1])
        positions = plane.positions
        np.testing.assert_allclose(positions[1, 2, [a, b]], [0.1, -0.1], atol=1e-15)
        other = 3 - a - b
        np.testing.assert_allclose(positions[..., other], through[other], atol=1e-15)


def test_the_second_vector_is_made_orthogonal_to_the_first(spatial):
    plane = plane_of(spatial, (2e-200, 0, 0, 5.0, 1.0, 1.0), x=(0, 1), y=(0, 1), cells=(2, 2))
    np.testing.assert_allclose(plane.first, [1, 0, 0])
    np.testing.assert_allclose(plane.second, np.array([0, 1, 1]) / np.sqrt(2))
    assert plane.names == ("u", "v")
    # through the reference position, with coordinates that are components along the axes
    reference = spatial.reference_position
    u, v = plane.coordinates(reference)
    np.testing.assert_allclose(plane.through + u * plane.first + v * plane.second, reference, atol=1e-12)


def test_the_file_s_workspace_is_the_default_range(planar):
    plane = plane_of(planar)
    assert (plane.x[0], plane.x[-1], plane.y[0], plane.y[-1]) == (-0.3, 0.3, 0.05, 0.35)
    assert plane.shape == (41, 81)
    np.testing.assert_array_equal(plane.x, -plane.x[::-1])


def test_without_bounds_it_is_the_box_of_what_is_reached(planar):
    device = unbounded(planar)
    plane = plane_of(device, cells=(60, 60))
    span = 0.147 + 0.199  # both arms stretched
    for line in (plane.x, plane.y):
        assert (line[0], line[-1]) == (-0.35, 0.35)
    # what is reached lies in a ring, and nearly all of the ring is reached
    radius = np.hypot(*np.moveaxis(plane.positions[..., :2], -1, 0))
    ok = solve_posture(device.mechanism, plane.positions, "elbows-out").status == 0
    assert not (ok & ((radius > span) | (radius < 0.199 - 0.147))).any()
    assert ok[(radius < 0.97 * span) & (radius > 0.08)].mean() > 0.99


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("make", [spatial_arm, random_five_bar])
def test_the_default_range_holds_all_that_is_reached_and_little_more(planar, seed, make):
    """Postures of which only the angles are known, the stretched ones among them, against the range."""
    mechanism = make(np.random.default_rng(seed))
    name = next(iter(mechanism.assemblies))
    reach = reachable_set(mechanism, name)
    near = reachable_positions(mechanism, name)
    rng = np.random.default_rng(seed)
    size = float(np.abs(near).max())
    goals = near[rng.integers(0, len(near), 4000)] + 0.1 * size * rng.standard_normal((4000, 3))
    if len(mechanism.drives.names) == 2:
        goals = goals - np.outer((goals - near[0]) @ (0, 0, 1), (0, 0, 1))
    found = goals[solve_posture(mechanism, goals, name).status == 0]
    assert len(found) > 500
    for axis in np.eye(3):
        low, high = reach.extent(axis)
        along = found @ axis
        assert low - 1e-12 <= along.min()
        assert along.max() <= high + 1e-12
        assert high - low <= 1.25 * np.ptp(along) + 1e-12


def test_coordinates_are_the_decimals_that_are_meant(planar):
    x = plane_of(planar, x=(-0.3, 0.3), y=(0.1, 0.2), cells=(41, 4))
    assert x.x.tolist() == [round(-0.3 + 0.015 * i, 3) for i in range(41)]
    assert x.y.tolist() == [0.1, (0.1 * 2 + 0.2) / 3, (0.1 + 0.2 * 2) / 3, 0.2]  # thirds are no decimals
    tiny = plane_of(planar, x=(-3e-7, 3e-7), cells=(41, 2)).x.tolist()
    assert tiny == [float(f"{-300 + 15 * i}e-9") for i in range(41)]
    assert plane_of(planar, x=(-3e6, 3e6), cells=(41, 2)).x.tolist() == [-3e6 + 15e4 * i for i in range(41)]


@pytest.mark.parametrize(("low", "high"), [(-0.3459, 0.35), (-3.4e-4, 1.1e-3), (12.0, 3456.7), (-1e6, -1e6 + 7.3)])
def test_what_is_left_out_is_rounded_outwards(low, high):
    a, b = rounded_outwards(low, high)
    step = 10.0 ** np.floor(np.log10(high - low)) / 20.0
    assert a <= low < a + 1.001 * step
    assert b - 1.001 * step < high <= b
    for end in (a, b):
        assert abs(end / step - round(end / step)) < 1e-6


def test_a_tilted_planar_device_gets_its_own_plane(planar):
    mechanism = random_five_bar(np.random.default_rng(3))
    c, s = np.cos(0.4), np.sin(0.4)
    tilt = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    roots = mechanism.links.parent < 0
    rotation = mechanism.links.rotation.copy()
    rotation[roots] = tilt @ rotation[roots]
    tilted = replace(
        mechanism,
        links=replace(
            mechanism.links,
            rotation=rotation,
            origin=np.where(roots[:, None], mechanism.links.origin @ tilt.T, mechanism.links.origin),
        ),
        reference_position=tilt @ mechanism.reference_position,
    )
    device = replace(
        planar,
        mechanism=tilted,
        reference_position=tilted.reference_position,
        reference_assembly=next(iter(tilted.assemblies)),
    )
    plane = plane_of(device, cells=(30, 30))
    np.testing.assert_allclose(np.abs(plane.normal @ tilt[:, 2]), 1.0, atol=1e-12)
    straight = solve_posture(mechanism, plane.positions @ tilt, device.reference_assembly)
    leaning = solve_posture(tilted, plane.positions, device.reference_assembly)
    assert (straight.status == 0).sum() > 100
    np.testing.assert_array_equal(straight.status, leaning.status)
    with pytest.raises(WorkspaceError, match="a line; leave"):
        plane_of(device, "xy")


def test_what_is_reached_is_reached(spatial):
    reach = reachable_positions(spatial.mechanism, spatial.reference_assembly)
    some = reach[:: max(1, len(reach) // 200)]
    assert (solve_posture(spatial.mechanism, some, spatial.reference_assembly).status == 0).all()


def test_devices_without_a_workspace(planar):
    with pytest.raises(DeviceError, match="no \\[mechanism\\]"):
        plane_of(load("published-two-mass"))
    with pytest.raises(Singular, match="singular wherever"):
        plane_of(planar, assembly="elbows-right")


def _slide(name, parent, axis, origin, travel):
    link = {"name": name, "joint": "prismatic", "axis": axis, "origin_m": origin, "mass_kg": 0.2}
    link["inertia_kg_m2"] = [1e-4, 1e-4, 1e-4]
    return link | ({"parent": parent} if parent else {}) | ({"limits_m": [-travel, travel]} if travel else {})


@pytest.mark.parametrize("high", [0.02, 0.9])
@pytest.mark.parametrize("travel", [0.1, None])
def test_slides_reach_to_their_limits_however_large_their_frame(high, travel):
    """Of a tall frame the map had a single point: steps of slides were a fifth of the mechanism's size."""
    x, y, z = np.eye(3).tolist()
    above = [0.0, 0.0, high]
    links = [_slide("x", "", x, [0.0] * 3, travel), _slide("y", "x", y, above, travel)]
    links.append(_slide("z", "y", z, above, travel))
    device = from_document(
        {
            "name": "gantry",
            "mechanism": {
                "links": links,
                "drives": [
                    {
                        "name": f"motor-{joint}",
                        "joint": joint,
                        "motor_inertia_kg_m2": 1e-6,
                        "transmission_ratio": 100.0,
                    }
                    for joint in "xyz"
                ],
                "assemblies": {"only": {"joints_m": dict.fromkeys("xyz", 0.0)}},
                "handle": {"link": "z", "point_m": [0.0, 0.0, 0.0]},
                "reference": {"position_m": [0.0, 0.0, 2.0 * high], "direction": z, "assembly": "only"},
            },
            "loop": {"sampling_period_s": 0.001},
        }
    )
    plane = plane_of(device)
    ends = 0.1 if travel else high  # half of 2 high, the mechanism's size, where nothing stops it
    for line in (plane.x, plane.y):
        assert ends <= line[-1] <= 1.2 * ends
        assert -1.2 * ends <= line[0] <= -ends
