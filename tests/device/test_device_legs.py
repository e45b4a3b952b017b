"""Legs written once: the same mechanism as written out, faults where the leg is written, numbers that change all
copies; joint limits, free joints, closings by axes and frames in files."""

from __future__ import annotations

import re
import tomllib
from copy import deepcopy

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zwidth
from tests.device.device_cases import faults
from zwidth.device import from_document, new_device
from zwidth.errors import BeyondLimit, OutOfReach
from zwidth.measures import BEYOND_LIMIT, OUT_OF_REACH
from zwidth.model import handle_position, solve_posture
from zwidth.study import plane_of

DELTA = tomllib.loads(new_device("Delta", "delta"))
PLACES = np.array([[0.0, 0.0, -0.12], [0.01, 0.02, -0.13], [-0.02, 0.01, -0.115]])


def written_out(document):
    """The delta with each leg for itself: names, frames and points turned by hand."""
    flat = deepcopy(document)
    (leg,) = flat["mechanism"].pop("legs")
    own = [link["name"] for link in leg["links"]]
    for k in range(3):
        angle = 2 * np.pi * k / 3
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])

        def copy(name, k=k):
            return f"{name}-{k + 1}" if name in own else name

        for link in deepcopy(leg["links"]):
            if "parent" not in link:
                link["origin_m"] = (turn @ link["origin_m"]).tolist()
                link["orientation_rad"] = [0, 0, angle]
            else:
                link["parent"] = copy(link["parent"])
            flat["mechanism"]["links"].append(link | {"name": copy(link["name"])})
        for loop in deepcopy(leg["loops"]):
            at_rod, at_platform = loop["points_m"]
            loop |= {"name": f"{loop['name']}-{k + 1}", "links": [copy(name) for name in loop["links"]]}
            loop["points_m"] = [at_rod, (turn @ at_platform).tolist()]
            flat["mechanism"].setdefault("loops", []).append(loop)
        for drive in deepcopy(leg["drives"]):
            flat["mechanism"].setdefault("drives", []).append(
                drive | {"name": f"{drive['name']}-{k + 1}", "joint": copy(drive["joint"])}
            )
    for assembly in flat["mechanism"]["assemblies"].values():
        rough = assembly["joints_rad"]
        assembly["joints_rad"] = {f"{name}-{k}": value for name, value in rough.items() for k in (1, 2, 3)}
    return flat


def test_legs_are_the_mechanism_that_is_written_out():
    once, out = from_document(DELTA), from_document(written_out(DELTA))
    assert once.mechanism.links.names == out.mechanism.links.names
    one, other = once.at(PLACES).posture, out.at(PLACES).posture
    assert one.mass_matrix == pytest.approx(other.mass_matrix, rel=1e-9)
    assert one.jacobian == pytest.approx(other.jacobian, rel=1e-9)


def test_a_number_of_a_leg_is_that_of_all_its_copies():
    longer = from_document(DELTA).with_({"legs.leg.links.arm.length_m": 0.09})
    document = deepcopy(DELTA)
    document["mechanism"]["legs"][0]["links"][0]["length_m"] = 0.09
    assert (
        longer.at().chart(decay=False).stiffness_max
        == from_document(document).at().chart(decay=False).stiffness_max
    )
    masses = [0.02, 0.03, 0.05]
    results = zwidth.sweep(from_document(DELTA), {"legs.leg.links.arm.mass_kg": masses}, ["rigid_mass"])
    alone = [
        float(from_document(DELTA).with_({"legs.leg.links.arm.mass_kg": m}).at().effective.rigid_mass)
        for m in masses
    ]
    assert results["rigid_mass"].values == pytest.approx(alone, rel=1e-12)


def test_angles_in_place_of_a_count():
    document = deepcopy(DELTA)
    leg = document["mechanism"]["legs"][0]
    del leg["count"]
    leg["angles_rad"] = [0.0, 2 * np.pi / 3, 4 * np.pi / 3]
    assert from_document(document).at().posture.angles == pytest.approx(
        from_document(DELTA).at().posture.angles, abs=1e-12
    )


def test_a_rod_with_a_ball_at_either_end_spins_freely():
    """Without the word the drives are too few, and the message names what can still move."""
    document, given = deepcopy(DELTA), deepcopy(DELTA)
    for number in (1, 2):
        for one in (document, given):
            rod = one["mechanism"]["legs"][0]["links"][number]
            rod |= {"joint": "spherical"}
            del rod["axis"], rod["second_axis"]
            rod["orientation_rad"] = [0.0, 2.2, 0.0]
        given["mechanism"]["legs"][0]["links"][number]["free"] = True
    for one in (document, given):
        rough = one["mechanism"]["assemblies"]["down"]["joints_rad"]
        del rough["rod-left"], rough["rod-right"]
    (fault,) = faults(document)
    assert "9 degrees" in fault.message
    assert "rod-left-1" in fault.message
    device = from_document(given)
    assert len(device.mechanism.free) == 6
    plain = from_document(DELTA).at()
    point = device.at()
    assert point.jacobian[:, :3] == pytest.approx(plain.jacobian, abs=1e-9)
    # the spin moves nothing but the rod: the wall is that of crossed pins, to the rod's own thin inertia
    assert point.chart(decay=False).stiffness_max == pytest.approx(
        plain.chart(decay=False).stiffness_max, rel=1e-4
    )


def limited(low, high):
    document = deepcopy(DELTA)
    document["mechanism"]["legs"][0]["links"][0]["limits_rad"] = [low, high]
    return from_document(document)


def test_a_joint_limit_is_named_and_marked():
    device = limited(0.2, 0.4)
    assert device.at().posture.status == 0
    with pytest.raises(BeyondLimit, match=r"joint 'arm-\d' .* 0.2 to 0.4 rad"):
        device.at((0.0, 0.0, -0.14))
    heights = np.linspace(-0.17, -0.1, 15)
    goals = np.stack([0 * heights, 0 * heights, heights], axis=-1)
    free, held = solve_posture(from_document(DELTA).mechanism, goals), solve_posture(device.mechanism, goals)
    arms = free.angles[:, device.mechanism.driven]
    inside = ((arms >= 0.2) & (arms <= 0.4)).all(axis=1)
    assert (held.status == np.where(inside, 0, BEYOND_LIMIT)).all()
    many = solve_posture(device.mechanism, np.repeat(goals, 10, axis=0))  # by its roadmap
    assert np.isin(many.status[~np.repeat(inside, 10)], (BEYOND_LIMIT, OUT_OF_REACH)).all()
    assert (many.status[np.repeat(inside, 10)] == 0).all()


def test_a_turn_more_or_less_is_the_same_angle():
    device = limited(2 * np.pi + 0.2, 2 * np.pi + 0.4)
    assert device.at().posture.status == 0


@pytest.mark.parametrize("closes", ["axis", "frame"])
def test_a_four_bar_closed_by_its_hinge_or_by_a_weld_is_the_same(closes):
    """Planar, so that a hinge holds what the plane holds anyway; welded, the last joint is part of the tree."""
    links = [
        {"name": "crank", "joint": "revolute", "length_m": 0.05, "mass_kg": 0.02,
         "inertia_kg_m2": [1e-6, 8e-6, 8e-6]},
        {"name": "rod", "parent": "crank", "joint": "revolute", "length_m": 0.12, "mass_kg": 0.03,
         "inertia_kg_m2": [1e-6, 4e-5, 4e-5]},
        {"name": "rocker", "joint": "revolute", "origin_m": [0.13, 0, 0], "length_m": 0.08, "mass_kg": 0.03,
         "inertia_kg_m2": [1e-6, 2e-5, 2e-5]},
    ]  # fmt: skip
    document = {
        "name": "Four-bar",
        "mechanism": {
            "links": links,
            "loops": [{"name": "hinge", "links": ["rod", "rocker"]}],
            "handle": {"link": "rod", "point_m": [0.06, 0.02, 0]},
            "assemblies": {"open": {"joints_rad": {"crank": 1.0, "rod": -0.7, "rocker": 1.8}}},
            "reference": {"position_m": [0.0766, 0.0798], "direction": [1, 0]},
            "drives": [
                {"name": "motor", "joint": "crank", "motor_inertia_kg_m2": 1e-6, "transmission_ratio": 5,
                 "stiffness_Nm_per_rad": 0.4}
            ],
            "damping": {"mode_ratio": 0.03},
        },
        "loop": {"sampling_period_s": 0.001},
    }  # fmt: skip
    pointwise = from_document(document)
    other = deepcopy(document)
    if closes == "axis":
        other["mechanism"]["loops"][0] |= {"closes": "axis"}
    else:
        other["mechanism"]["links"].append(
            {"name": "pin", "parent": "rod", "joint": "revolute", "mass_kg": 0.0, "inertia_kg_m2": [0, 0, 0]}
        )
        other["mechanism"]["loops"] = [
            {"name": "hinge", "links": ["pin", "rocker"], "points_m": [[0, 0, 0], [0.08, 0, 0]], "closes": "frame"}
        ]
        other["mechanism"]["assemblies"]["open"]["joints_rad"]["pin"] = 1.5
    one, same = pointwise.at().posture, from_document(other).at().posture
    assert same.mass_matrix == pytest.approx(one.mass_matrix, rel=1e-9)
    assert same.jacobian == pytest.approx(one.jacobian, rel=1e-9, abs=1e-12)


def test_an_orientation_that_cannot_be_reached_is_said_with_the_nearest():
    wrist = tomllib.loads(new_device("Wrist", "wrist"))
    wrist["mechanism"]["links"][2] |= {"joint": "fixed"}
    wrist["mechanism"]["drives"] = wrist["mechanism"]["drives"][:2]
    del wrist["mechanism"]["assemblies"]["upright"]["joints_rad"]["roll"]
    device = from_document(wrist)
    with pytest.raises(OutOfReach, match=r"pitch, .* degrees"):
        device.at(orientation=[0.8, 0.0, 0.0])
    assert device.at(orientation=[0.0, 0.3, 0.2]).posture.status == 0


@pytest.mark.parametrize("turn", [[3.0, 0.0, 0.0], [0.0, 0.0, 2.5], [0.96, 1.3, -0.9]])
def test_the_nearest_pose_is_reached_and_no_farther_than_the_last_on_the_straight_way(turn):
    """A descent alone ended half a metre away, where a turn about the same axis by less is reached in place."""
    device = _stage(limited=False)
    with pytest.raises(OutOfReach, match=r"pose .* [0-9.]+ degrees") as caught:
        device.at(orientation=turn)
    place, vector = re.findall(r"\((.*?)\)", str(caught.value).partition("an answered pose is")[2])
    position, turned = (np.array([float(x) for x in part.split(",")]) for part in (place, vector))
    assert device.at(position, orientation=turned).posture.status == 0
    assert position == pytest.approx([0.0, 0.0, 0.15], abs=1e-9)
    missing = (Rotation.from_euler("xyz", turn) * Rotation.from_euler("xyz", turned).inv()).magnitude()
    along = Rotation.from_euler("xyz", turn).as_rotvec()
    for share in np.arange(0.3, 0.9, 0.05):
        if missing > (1.0 - share) * np.linalg.norm(along) + 1e-5:
            with pytest.raises(OutOfReach):
                device.at(orientation=Rotation.from_rotvec(share * along).as_matrix())


def test_rounding_does_not_decide_which_pose_is_the_nearest(monkeypatch):
    """A descent that passed a singularity ended half a metre away once in some runs, as rounding would have it."""
    plain, rng = handle_position._descend, np.random.default_rng(2)
    told = set()
    for size in (0.0, *6 * [1e-15], *6 * [1e-13]):

        def disturbed(mech, design, start, goal, size=size):
            return plain(mech, design, start * (1.0 + size * rng.standard_normal(len(start))), goal)

        monkeypatch.setattr(handle_position, "_descend", disturbed)
        with pytest.raises(OutOfReach) as caught:
            _stage(limited=False).at(orientation=[3.0, 0.0, 0.0])
        told.add(str(caught.value))
    assert len(told) == 1


@pytest.mark.parametrize("limited", [True, False])
def test_a_map_shows_where_a_posed_handle_goes_without_turning(limited):
    """The map had a single point: six drives are too many for the flood that finds what others reach."""
    device = _stage(limited)
    plane = plane_of(device)
    assert sum(_held(device, x, y) for x in plane.x[::16] for y in plane.y[::16]) > 8
    assert plane.x[0] < 0.0 < plane.x[-1]
    for end in (
        (plane.x[0] - 0.01, 0.0),
        (plane.x[-1] + 0.01, 0.0),
        (0.0, plane.y[0] - 0.01),
        (0.0, plane.y[-1] + 0.01),
    ):
        assert not limited or not _held(device, *end)


def _stage(limited):
    """A Stewart platform, with or without the stops of its legs."""
    stage = tomllib.loads(new_device("Stage", "stewart"))
    for link in stage["mechanism"]["legs"][0]["links"]:
        if not limited:
            link.pop("limits_m", None)
    return from_document(stage)


def _held(device, x, y):
    try:
        device.at((x, y, 0.15))
    except (OutOfReach, BeyondLimit):
        return False
    return True
