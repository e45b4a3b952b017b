"""The operator's arm as a chain: by closed forms, by a mechanism that holds it as a loop, and by its potential."""

from dataclasses import replace

import numpy as np
import pytest

import zwidth
from zwidth.device import from_document
from zwidth.model import Load, Motions, natural_frequencies, pack
from zwidth.model.arm import attach_arm

SHOULDER = np.array([0.45, 0.05, 0.0])
LENGTHS = 0.3, 0.26
SPRINGS = 21.0, 13.0


def arm_link(name, i, **more):
    L = LENGTHS[i]
    return {
        "name": name,
        "joint": "revolute",
        "length_m": L,
        "mass_kg": [1.9, 1.2][i],
        "center_of_mass_m": [0.45 * L],
        "inertia_kg_m2": [0.014, 0.009][i],
        "joint_stiffness_Nm_per_rad": SPRINGS[i],
        "joint_damping_Nms_per_rad": [1.1, 0.7][i],
        **more,
    }


def device(stiffness=0.8, **more):
    """A planar arm of two links, both of whose drives are flexible."""
    links = [
        {
            "name": n,
            "joint": "revolute",
            "length_m": L,
            "mass_kg": m,
            "center_of_mass_m": [0.4 * L],
            "inertia_kg_m2": I,
        }
        for n, L, m, I in (("upper", 0.2, 0.15, 6e-4), ("lower", 0.18, 0.09, 3e-4))
    ]
    links[1]["parent"] = "upper"
    drives = [
        {
            "name": n,
            "joint": n,
            "motor_inertia_kg_m2": 3e-6,
            "transmission_ratio": 11.0,
            "stiffness_Nm_per_rad": stiffness,
        }
        for n in ("upper", "lower")
    ]
    mechanism = {
        "links": links,
        "handle": {"link": "lower"},
        "assemblies": {"right": {"joints_rad": {"upper": 0.6, "lower": 1.6}}},
        "reference": {"position_m": [0.08, 0.24], "direction": [1.0, 0.0]},
        "drives": drives,
        "damping": {"given": True},
    }
    document = {"name": "planar", "mechanism": mechanism, "loop": {"sampling_period_s": 0.001}, **more}
    return from_document(document)


def arm(**more):
    return {
        "links": [arm_link("humerus", 0), arm_link("forearm", 1, parent="humerus")],
        "hand": {"link": "forearm"},
        "posture": {"joints_rad": {"humerus": 2.0, "forearm": 1.2}},
        "shoulder_m": SHOULDER.tolist(),
        "grasp": "rigid",
        **more,
    }


def elbow(place):
    """Angles of the arm whose hand is at a place (2,) or (3,), by closed form."""
    x, y = place[:2] - SHOULDER[:2]
    a, b = LENGTHS
    fore = np.arccos((x**2 + y**2 - a**2 - b**2) / (2 * a * b))
    return np.array([np.arctan2(y, x) - np.arctan2(b * np.sin(fore), a + b * np.cos(fore)), fore])


def test_a_rigid_grasp_is_a_loop_of_the_mechanism():
    held = device(arm=arm()).at().plant
    looped = device().document
    chain = [arm_link("humerus", 0, origin_m=SHOULDER.tolist()), arm_link("forearm", 1, parent="humerus")]
    q = elbow(np.array([0.08, 0.24]))
    mechanism = looped["mechanism"] | {
        "links": looped["mechanism"]["links"] + chain,
        "loops": [{"name": "grasp", "links": ["lower", "forearm"]}],
        "assemblies": {"right": {"joints_rad": {"upper": 0.6, "lower": 1.6, "humerus": q[0], "forearm": q[1]}}},
    }
    together = from_document(looped | {"mechanism": mechanism}).at().plant
    np.testing.assert_allclose(natural_frequencies(held), natural_frequencies(together), rtol=1e-8, atol=1e-4)
    for name in ("mass", "damping", "stiffness"):
        np.testing.assert_allclose(getattr(held, name), getattr(together, name), rtol=1e-8, atol=1e-9)


def test_without_load_an_arm_has_no_weight_either():
    point = device(arm=arm()).at(load=Load(push=4.0, gravity=[0.0, -9.81], count_sideways=True))
    bare = natural_frequencies(point.plant.without_load)
    assert bare == pytest.approx(natural_frequencies(replace(point, load=None).plant), rel=1e-9)
    assert natural_frequencies(point.plant)[0] != pytest.approx(bare[0], rel=1e-3)


def test_what_a_load_adds_is_the_second_derivative_of_the_muscles_potential():
    one = device(np.inf, arm=arm()).at(load=(4.0, 0.0))
    F, posture = one.equilibrium.hand_force, one.posture
    angles = posture.angles[one.mechanism.drives.joint]

    def place(p):
        return np.array([0.2 * np.cos(p[0]) + 0.18 * np.cos(p.sum()), 0.2 * np.sin(p[0]) + 0.18 * np.sin(p.sum())])

    q0 = elbow(place(angles))
    held = pack(one.arm.mechanism)
    torque = F @ Motions(held, q0).handle.speed  # of the muscles, such that the hand pushes with F

    def potential(p):
        way = elbow(place(p)) - q0
        return 0.5 * way @ np.diag(SPRINGS) @ way - torque @ way

    h, unit = 1e-4, np.eye(2)
    second = np.array(
        [
            [
                sum(s * t * potential(angles + h * (s * unit[i] + t * unit[j])) for s in (1, -1) for t in (1, -1))
                / (4 * h * h)
                for j in range(2)
            ]
            for i in range(2)
        ]
    )
    plants = one.loaded_plants
    rows, none = one.handle_rows, np.zeros(3)
    with_arm = attach_arm(plants.loaded, one.arm, rows, posture.position, F, none)
    np.testing.assert_allclose(with_arm.stiffness, second, rtol=1e-5, atol=1e-5 * np.max(np.abs(second)))
    without = attach_arm(plants.unloaded, one.arm, rows, posture.position, none, none)
    assert np.max(np.abs(with_arm.stiffness - without.stiffness)) > 0.5


def test_an_elastic_grasp_tends_to_a_rigid_one():
    rigid = natural_frequencies(device(arm=arm()).at().plant)
    elastic = arm(grasp_stiffness_N_per_m=1e9)
    del elastic["grasp"]
    stiff = natural_frequencies(device(arm=elastic).at().plant)
    np.testing.assert_allclose(stiff[: len(rigid)], rigid, rtol=1e-4, atol=1e-3)
    soft = device(arm=elastic | {"grasp_stiffness_N_per_m": 2000.0, "grasp_damping_Ns_per_m": 5.0}).at()
    assert soft.plant.size == 6
    assert soft.chart().stiffness_max != device().at().chart().stiffness_max


def test_an_arm_without_a_shoulder_has_its_hand_at_the_handle_anywhere():
    anywhere = arm()
    del anywhere["shoulder_m"]
    one = device(arm=anywhere)
    for at in ((0.08, 0.24), (0.1, 0.2)):
        q = np.array([2.0, 1.2])
        J = Motions(pack(one.arm.mechanism), q).handle.speed[:2]
        K = np.linalg.inv(J.T) @ np.diag(SPRINGS) @ np.linalg.inv(J)
        Jd = one.at(at).jacobian[:2]
        plant = one.at(at).plant
        np.testing.assert_allclose(
            (plant.stiffness - device().at(at).plant.stiffness)[:2, :2], Jd.T @ K @ Jd, rtol=1e-9
        )


def test_more_joints_than_the_handle_has_ways_move_by_themselves():
    wrist = arm_link("wrist", 1, parent="forearm")
    three = arm(links=[*arm()["links"], wrist], hand={"link": "wrist"})
    three["posture"] = {"joints_rad": {"humerus": 2.0, "forearm": 1.0, "wrist": 0.4}}
    plant = device(arm=three).at().plant
    assert plant.size == 5
    assert natural_frequencies(plant)[0] > 0.0


def test_an_operator_who_holds_all_directions_stops_the_sideways_motion():
    hand = {"arm_mass_kg": 0.8, "arm_stiffness_N_per_m": 580.0, "arm_damping_Ns_per_m": 5.5, "grasp": "rigid"}
    along = device(operator=hand).at(load=(5.0, 0.0)).chart()
    all_ways = device(operator=hand | {"directions": "all"}).at(load=(5.0, 0.0)).chart()
    assert along.loop.sideways_motions
    assert not any(motion.growth_rate > 0.0 for motion in all_ways.loop.sideways_motions)
    J = device().at().jacobian
    gained = device(operator=hand | {"directions": "all"}).at().plant.mass - device().at().plant.mass
    np.testing.assert_allclose(gained[:2, :2], 0.8 * J.T @ J, rtol=1e-12, atol=1e-15)


def test_a_file_of_an_arm_is_an_operator(tmp_path):
    lines = ["[arm]", 'name = "mine"', 'grasp = "rigid"', f"shoulder_m = {SHOULDER.tolist()}", "[arm.hand]"]
    lines += ['link = "forearm"', "[arm.posture]", "joints_rad = { humerus = 2.0, forearm = 1.2 }"]
    for link in arm()["links"]:
        lines += ["[[arm.links]]", *(f"{key} = {value!r}" for key, value in link.items())]
    path = tmp_path / "arm.toml"
    path.write_text("\n".join(lines).replace("'", '"'))
    one = device().held_by(path)
    assert one.operator_name == "mine"
    np.testing.assert_allclose(one.at().plant.mass, device(arm=arm()).at().plant.mass)
    assert one.held_by("none").arm is None
    assert replace(one.at(), arm=None).without_operator.plant.size == 4
    assert zwidth.load("five-bar").held_by("thesis-arm").arm is None
