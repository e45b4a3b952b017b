"""The haptic equilibrium: closed forms of small devices, MuJoCo's forces, batches."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from tests.device.test_device_zoo_engines import completed
from tests.loop.loaded_cases import random_points
from tests.model.beam_devices import device, drive, link
from tests.model.joints_apart import FOURTH, Joints
from tests.model.model_engines import mjcf, moving_links, quaternion
from zwidth.device import from_document
from zwidth.device.load import load as load_device
from zwidth.errors import EquilibriumError
from zwidth.model import BALL_X, NO_EQUILIBRIUM, OK, OUT_OF_REACH, Load

# --- an arm on one joint ----------------------------------------------------------------------------------

LENGTH, MASS, CENTRE, INERTIA = 0.2, 0.3, 0.12, 0.002  # of the arm [m], [kg], [m], [kg m^2]
RATIO = 10.0

ARM = f"""
name = "arm"
[[mechanism.links]]
name = "arm"
joint = "revolute"
length_m = {LENGTH}
mass_kg = {MASS}
center_of_mass_m = [{CENTRE}]
inertia_kg_m2 = {INERTIA}
[[mechanism.drives]]
name = "motor"
joint = "arm"
motor_inertia_kg_m2 = 2e-6
transmission_ratio = {RATIO}
[mechanism.handle]
link = "arm"
[mechanism.assemblies.only]
joints_rad = {{ arm = 1.0 }}
[mechanism.reference]
position_m = [{LENGTH * np.cos(1.0)}, {LENGTH * np.sin(1.0)}]
direction = [1.0, 0.0]
[loop]
sampling_period_s = 0.001
"""


def arm(mechanism=None, link=None, drive=None):
    """The arm with more keys, or other ones."""
    document = tomllib.loads(ARM)
    document["mechanism"] |= mechanism or {}
    document["mechanism"]["links"][0] |= link or {}
    document["mechanism"]["drives"][0] |= drive or {}
    return from_document(document)


UPRIGHT = {"arm": np.pi / 2}
WHOLE = INERTIA + MASS * CENTRE**2 + RATIO**2 * 2e-6  # about the joint, with the rotor [kg m^2]
TOPPLING = MASS * 9.81 * CENTRE  # m g l [N m/rad]


@pytest.mark.parametrize("share", [0.4, 0.999, 1.001, 3.0])
def test_an_inverted_pendulum_on_a_spring_buckles_at_m_g_l(share):
    """I q'' + (k - m g l) q = 0: a frequency below the spring's own, or a growth rate."""
    k = share * TOPPLING
    device = arm(link={"joint_stiffness_Nm_per_rad": k})
    plant = device.at(UPRIGHT, load=Load(gravity=[0.0, -9.81], count_sideways=True)).plant
    squared = float(plant.stiffness[0, 0] / plant.mass[0, 0])
    assert squared == pytest.approx((k - TOPPLING) / WHOLE, rel=1e-9)
    hanging = device.at(UPRIGHT, load=Load(gravity=[0.0, 9.81], count_sideways=True)).plant
    assert float(hanging.stiffness[0, 0] / hanging.mass[0, 0]) == pytest.approx((k + TOPPLING) / WHOLE, rel=1e-9)


def test_gravity_that_is_compensated_leaves_what_sampling_leaves():
    """By masses nothing is left; by the computer's torques the half that acts all the time and the sampled one."""
    load = Load(gravity=[0.0, -9.81], count_sideways=True)
    none, computed, weights = (
        arm({"gravity_compensation": kind}).at(UPRIGHT, load=load)
        for kind in ("none", "computed", "counterweight")
    )
    assert none.plant.sampled_forces == weights.plant.sampled_forces == ()
    own = [float(each.plant.stiffness[0, 0] / each.plant.mass[0, 0]) for each in (none, computed, weights)]
    assert own == pytest.approx([-TOPPLING / WHOLE, -TOPPLING / WHOLE, 0.0], rel=1e-9)
    (force,) = computed.plant.sampled_forces
    sampled = float(force.along[0] * force.reading[0] / computed.plant.mass[0, 0])
    assert sampled == pytest.approx(-TOPPLING / WHOLE)
    tilted = {"arm": 1.0}
    torque = MASS * 9.81 * CENTRE * np.cos(1.0)
    found = [
        arm({"gravity_compensation": kind}).at(tilted, load=load).equilibrium for kind in ("none", "computed")
    ]
    assert found[0].torques == pytest.approx([0.0], abs=1e-15)
    assert found[1].torques == pytest.approx([torque], rel=1e-12)
    hand = [each.hand_force @ [-np.sin(1.0), np.cos(1.0), 0.0] for each in found]
    assert hand == pytest.approx([torque / LENGTH, 0.0], abs=1e-12)  # along the only way that the handle has


@pytest.mark.parametrize("push", [-8.0, -0.5, 3.0, 9.0])
@pytest.mark.parametrize("hardening", [None, 0.3])
def test_motors_that_stand_where_they_are_asked_to_let_the_arm_sag(push, hardening):
    """The hand pushes along the arm's own way t(q), u . F = push: the spring's torque is push L/(u . t(q))."""
    k, q_motor, u = 0.5, 1.0, np.array([1.0, 0.0])
    drive = {"stiffness_Nm_per_rad": k} | ({"hardening_Nm_per_rad3": hardening} if hardening else {})
    device = arm({"damping": {"mode_ratio": 0.02}}, drive=drive)
    point = device.at({"arm": q_motor}, u, load=Load(push=push, posture_of="motors"))
    cubic = RATIO**4 * (hardening or 0.0)

    def off(q):
        bent = q_motor - q
        return RATIO**2 * k * bent + cubic * bent**3 + push * LENGTH / (u @ [-np.sin(q), np.cos(q)])

    q = brentq(off, q_motor - 0.5, q_motor + 0.5, xtol=1e-15)
    assert point.posture.angles == pytest.approx([q], rel=1e-10)
    assert point.equilibrium.deflections == pytest.approx([q_motor - q], rel=1e-8)
    # the computer asks for u f where it sees the arm
    way = u @ [-np.sin(q_motor), np.cos(q_motor)]
    assert point.equilibrium.wall_force == pytest.approx(point.equilibrium.torques[0] / (LENGTH * way), rel=1e-9)
    assert point.equilibrium.hand_force[:2] @ u == pytest.approx(push, rel=1e-11)
    handle = device.at({"arm": q_motor}, u, load=Load(push=push))
    assert handle.posture.angles == pytest.approx([q_motor], rel=1e-12)


def test_the_stiffness_of_a_hardening_spring_is_its_tangent():
    drive = {"stiffness_Nm_per_rad": 0.5, "hardening_Nm_per_rad3": 0.4, "backward_stiffness_Nm_per_rad": 0.3}
    device = arm({"damping": {"mode_ratio": 0.0}}, drive=drive)
    for push, k in ((-6.0, 0.5), (6.0, 0.3)):
        point = device.at({"arm": np.pi / 2}, (-1.0, 0.0), load=Load(push=push))

        def off(bent, k=k, push=push):
            return 100.0 * k * bent + 1e4 * 0.4 * bent**3 + push * LENGTH

        bent = brentq(off, -1.0, 1.0, xtol=1e-15)
        assert point.equilibrium.deflections == pytest.approx([bent], rel=1e-9)
        tangent = 100.0 * k + 3.0 * 1e4 * 0.4 * bent**2
        assert point.loaded_plants.unloaded.stiffness[1, 1] == pytest.approx(tangent, rel=1e-9)


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_force_across_an_arm_has_no_lever_arm_to_lose(gravity):
    """F . x'' = -F . L e_r = 0, whether the hand's force turns with the arm or not; gravity has one."""
    q, stiffness = 0.8, {}
    for hand in ("dead", "follower", "neglected"):
        load = Load(push=-2.0, hand=hand, gravity=[0.0, -gravity])
        plants = arm().at({"arm": q}, (-np.sin(q), np.cos(q)), load=load).loaded_plants
        stiffness[hand] = float((plants.loaded.stiffness - plants.unloaded.stiffness)[0, 0])
    falls = -MASS * gravity * CENTRE * np.sin(q)
    assert stiffness == pytest.approx(dict.fromkeys(stiffness, falls), abs=1e-12)


TWO_LINKS = {
    "name": "two links",
    "mechanism": {
        "links": [
            {"name": "one", "joint": "revolute", "length_m": LENGTH, "mass_kg": MASS, "inertia_kg_m2": INERTIA}
            | {"center_of_mass_m": [CENTRE]},
            {"name": "two", "parent": "one", "joint": "revolute", "length_m": LENGTH, "mass_kg": MASS}
            | {"inertia_kg_m2": INERTIA, "center_of_mass_m": [CENTRE]},
        ],
        "drives": [
            {"name": f"{name}-motor", "joint": name, "motor_inertia_kg_m2": 2e-6, "transmission_ratio": RATIO}
            for name in ("one", "two")
        ],
        "handle": {"link": "two"},
        "assemblies": {"only": {"joints_rad": {"one": 0.1, "two": 0.5}}},
        "reference": {
            "position_m": [LENGTH * (np.cos(0.1) + np.cos(0.6)), LENGTH * (np.sin(0.1) + np.sin(0.6))],
            "direction": [1.0, 0.0],
        },
    },
    "loop": {"sampling_period_s": 0.001},
}


def test_two_links_pulled_at_their_tip():
    """A dead pull F along x turns each joint against F times the way along x from there to the tip, as the weight
    of a pendulum does. A follower turns by q_1 + q_2 to F (0, 1), whose torques are these ways again: less by
    them."""
    place, push = {"one": 0.0, "two": 0.4}, 3.0
    from_two = LENGTH * np.cos(0.4)
    from_one = LENGTH + from_two
    dead = push * np.array([[from_one, from_two], [from_two, from_two]])
    turned = push * np.outer([from_one, from_two], [1.0, 1.0])
    for hand, expected in (("dead", dead), ("follower", dead - turned), ("neglected", 0.0 * dead)):
        plants = from_document(copy.deepcopy(TWO_LINKS)).at(place, (1.0, 0.0), load=Load(push=push, hand=hand))
        plants = plants.loaded_plants
        own = plants.loaded.stiffness - plants.unloaded.stiffness
        if hand == "follower":
            own = own + plants.loaded.circulatory
        assert own == pytest.approx(expected, abs=1e-12)


# --- two sliders: von Mises' truss ------------------------------------------------------------------------


def truss(half_span, height, k):
    """Two struts from (-a, 0) and (a, 0) to their tip (0, h), each driven in and out by a flexible drive."""
    rest = float(np.hypot(half_span, height))

    def strut(name, side):
        angle = float(np.arctan2(height, -side * half_span))
        links = [
            {
                "name": f"{name}-base",
                "joint": "revolute",
                "origin_m": [side * half_span, 0.0, 0.0],
                "length_m": 0.0,
                "mass_kg": 0.0,
                "inertia_kg_m2": 0.0,
            },
            {
                "name": name,
                "parent": f"{name}-base",
                "joint": "prismatic",
                "axis": [1.0, 0.0, 0.0],
                "origin_m": [0.0, 0.0, 0.0],
                "length_m": 0.0,
                "mass_kg": 0.2,
                "center_of_mass_m": [0.0],
                "inertia_kg_m2": 0.0,
            },
        ]
        drive = {
            "name": f"{name}-motor",
            "joint": name,
            "motor_inertia_kg_m2": 1e-5,
            "transmission_ratio": 50.0,
            "stiffness_Nm_per_rad": k / 50.0**2,
        }
        return links, drive, {f"{name}-base": angle}, {name: rest}

    (one, drive, turn, way), (other, second, turned, slid) = strut("left", -1.0), strut("right", 1.0)
    return from_document(
        {
            "name": "truss",
            "mechanism": {
                "links": one + other,
                "loops": [
                    {"name": "tip", "links": ["left", "right"], "points_m": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]}
                ],
                "drives": [drive, second],
                "handle": {"link": "left", "point_m": [0.0, 0.0, 0.0]},
                "assemblies": {"up": {"joints_rad": turn | turned, "joints_m": way | slid}},
                "reference": {"position_m": [0.0, height], "direction": [0.0, 1.0]},
                "damping": {"mode_ratio": 0.0},
            },
            "loop": {"sampling_period_s": 0.001},
        }
    )


@pytest.mark.parametrize("push", [-30.0, -3.0, 20.0])
def test_a_truss_has_the_stiffness_of_its_struts(push):
    """Each strut under a tension N along n, of length L, gives k n n^T + N/L (1 - n n^T), its motor held. With the
    load at the tip N = F/(2 sin alpha)."""
    a, h, k = 0.3, 0.1, 2000.0
    point = truss(a, h, k).at(load=Load(push=push))
    L, tension = np.hypot(a, h), 0.5 * push / (h / np.hypot(a, h))
    expected = np.zeros((2, 2))
    for side in (-1.0, 1.0):
        n = np.array([-side * a, h]) / L
        expected += k * np.outer(n, n) + tension / L * (np.eye(2) - np.outer(n, n))
    K = point.loaded_plants.loaded.stiffness[:2, :2]
    lever = np.linalg.inv(point.jacobian[:2])
    assert lever.T @ K @ lever == pytest.approx(expected, rel=1e-9, abs=1e-9 * k)
    # the motors pull less by what the springs are longer
    assert point.equilibrium.deflections * k == pytest.approx([-tension, -tension], rel=1e-3)


def test_a_truss_snaps_through_where_its_stiffness_is_gone():
    """2 k sin^2 alpha = 2 |N|/L cos^2 alpha with the motors held."""
    a, h, k = 0.3, 0.05, 4000.0
    device, L = truss(a, h, k), float(np.hypot(0.3, 0.05))
    critical = 2.0 * k * (h / L) ** 3 / (a / L) ** 2 * L

    def upward(push):
        point = device.at(load=Load(push=push))
        lever = np.linalg.inv(point.jacobian[:2])
        return float((lever.T @ point.loaded_plants.loaded.stiffness[:2, :2] @ lever)[1, 1])

    assert upward(-0.999 * critical) > 0.0 > upward(-1.001 * critical)
    assert upward(-critical) == pytest.approx(0.0, abs=1e-9 * k)


# --- free joints that hang --------------------------------------------------------------------------------

HANGING = f"""
name = "carriage"
[[mechanism.links]]
name = "carriage"
joint = "prismatic"
axis = [1, 0, 0]
mass_kg = 0.4
inertia_kg_m2 = 0
length_m = 0.0
[[mechanism.links]]
name = "bob"
parent = "carriage"
joint = "revolute"
free = true
length_m = 0.1
mass_kg = {MASS}
center_of_mass_m = [{CENTRE}]
inertia_kg_m2 = {INERTIA}
[[mechanism.drives]]
name = "motor"
joint = "carriage"
motor_inertia_kg_m2 = 1e-5
transmission_ratio = 100.0
[mechanism.handle]
link = "carriage"
point_m = [0, 0, 0]
[mechanism.assemblies.only]
joints_m = {{ carriage = 0.0 }}
joints_rad = {{ bob = -1.2 }}
[mechanism.reference]
position_m = [0, 0]
direction = [1, 0]
[loop]
sampling_period_s = 0.001
"""


def hanging(k=None, q=-1.2):
    """A driven carriage with a bob that hangs from it, on a spring that is at rest at q or on none."""
    document = tomllib.loads(HANGING)
    document["mechanism"]["assemblies"]["only"]["joints_rad"]["bob"] = q
    if k is not None:
        document["mechanism"]["links"][1]["joint_stiffness_Nm_per_rad"] = k
    return from_document(document)


@pytest.mark.parametrize("q", [-1.2, -3.0, 0.2, 1.0, np.pi / 2 - 1e-6])
def test_a_bob_hangs_down_from_wherever_it_is_drawn(q):
    point = hanging(q=q).at(load=Load(push=3.0, gravity=[0.0, -9.81], count_sideways=True))
    assert point.posture.angles[1] == pytest.approx(-np.pi / 2, abs=1e-10)
    plant = point.loaded_plants.loaded
    assert plant.stiffness == pytest.approx(np.diag([0.0, TOPPLING]), abs=1e-12)


@pytest.mark.parametrize("k", [0.05, 0.5, 5.0])
@pytest.mark.parametrize("q", [-1.2, -1.9])
def test_a_bob_on_a_spring_hangs_where_both_balance(k, q):
    """k (q - q_0) = -m g l cos q, and K = k - m g l sin q."""
    point = hanging(k, q).at(load=Load(gravity=[0.0, -9.81], count_sideways=True))
    at = brentq(lambda x: k * (x - q) + TOPPLING * np.cos(x), *sorted((-np.pi / 2, q)), xtol=1e-15)
    assert point.posture.angles[1] == pytest.approx(at, abs=1e-9)
    assert point.loaded_plants.loaded.stiffness[1, 1] == pytest.approx(k - TOPPLING * np.sin(at), rel=1e-9)


@pytest.mark.parametrize("share", [0.5, 0.99, 1.01, 2.0])
def test_a_bob_that_stands_on_its_spring_falls_where_the_spring_is_too_weak(share):
    k = share * TOPPLING
    point = hanging(k, np.pi / 2).at(load=Load(gravity=[0.0, -9.81], count_sideways=True))
    assert point.posture.angles[1] == pytest.approx(np.pi / 2, abs=1e-12)
    plant = point.loaded_plants.loaded
    assert plant.stiffness[1, 1] == pytest.approx(k - TOPPLING, rel=1e-9)
    grows = np.abs(np.linalg.eigvals(point.loop.transition_matrix(500.0, 5.0))).max() > 1.0 + 1e-9
    assert grows == (share < 1.0)


def test_a_bob_that_nothing_holds_has_no_place():
    """Gravity along the joint's axis leaves it anywhere; a sideways pull on the carriage does not reach it. A
    slide that nothing holds falls."""
    anywhere = hanging().at(load=Load(push=3.0, gravity=[0.0, 0.0, -9.81]))
    assert anywhere.posture.angles[1] == pytest.approx(-1.2)
    document = tomllib.loads(HANGING)
    document["mechanism"]["links"][1] |= {"joint": "prismatic", "axis": [0, 1, 0]}
    document["mechanism"]["assemblies"]["only"] = {"joints_m": {"carriage": 0.0, "bob": 0.0}}
    with pytest.raises(EquilibriumError, match="joint 'bob'"):
        from_document(document).at(load=Load(gravity=[0.0, -9.81]))


# --- settling ---------------------------------------------------------------------------------------------


def test_a_device_settles_where_the_load_alone_is_in_balance():
    """Under its own weight the handle slides along the surface until the hand's force is that which is given."""
    device, force, gravity = load_device("five-bar"), [0.0, -5.0], [0.0, -9.81]
    asked = device.at((0.02, 0.24), load=Load(push=-5.0, gravity=gravity))
    assert abs(asked.equilibrium.hand_force[0]) > 1e-2
    settled = device.at((0.02, 0.24), load=Load(force=force, gravity=gravity, settle=True))
    assert settled.equilibrium.hand_force == pytest.approx([0.0, -5.0, 0.0], abs=1e-9)
    assert settled.posture.position[1] == pytest.approx(0.24, abs=1e-12)
    assert abs(settled.posture.position[0]) < 0.02
    with pytest.raises(EquilibriumError, match=r"1\.003 N more across"):
        device.at((0.02, 0.24), load=Load(force=[1.0, -5.0], settle=True))


@pytest.mark.parametrize("name", ["five-bar", "openwrist"])
def test_motors_are_counted_where_they_were_asked_to_stand(name):
    device = completed(name, np.random.default_rng(1))
    asked = device.at()
    load = Load(push=1.0 if name == "openwrist" else 8.0, posture_of="motors")
    point = device.at(load=load)
    driven = device.mechanism.driven
    assert point.equilibrium.counted.angles[driven] == pytest.approx(asked.posture.angles[driven], abs=1e-10)
    assert np.max(np.abs(point.posture.angles - asked.posture.angles)) > 1e-4


# --- MuJoCo -----------------------------------------------------------------------------------------------


class Engine:
    """MuJoCo's generalised forces on the independent joints of a mechanism, at rest."""

    def __init__(self, mechanism, gravity):
        self.joints, self.mechanism = Joints(mechanism), mechanism
        self.model = mujoco.MjModel.from_xml_string(mjcf(mechanism))
        self.model.opt.gravity[:] = gravity
        self.data = mujoco.MjData(self.model)
        self.moved = [i for i in moving_links(mechanism) if mechanism.links.joint[i] <= BALL_X]
        self.order = []
        for i in self.moved:
            first, count = int(self.model.joint(str(i)).dofadr[0]), 3 if self.is_ball(i) else 1
            self.order += range(first, first + count)

    def is_ball(self, link):
        return self.mechanism.links.joint[link] == BALL_X

    def forces(self, q, force, moment):
        """Of gravity, and of a force (3,) and a moment (3,) on the handle, (c,)."""
        for i in self.moved:
            turn = quaternion(Rotation.from_rotvec(q[i : i + 3]).as_matrix()) if self.is_ball(i) else q[i]
            self.data.joint(str(i)).qpos[:] = turn
        mujoco.mj_forward(self.model, self.data)
        J, W = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, J, W, self.model.site("the handle").id)
        pushed = J.T @ force + W.T @ moment - self.data.qfrc_bias
        return self.joints.at(q).B.T @ pushed[self.order]


@pytest.mark.parametrize("kind", ["five-bar", "spatial arm", "spatial loop", "changing ratios", "every joint"])
def test_mujoco_s_forces_are_in_balance_and_change_as_ours(kind):
    """Hand, gravity and drives on the links; and the links' half of the stiffness, where torques are constant."""
    compared = 0
    for point in random_points(kind, seed=20, count=4):
        gravity = np.array([0.0, 0.0, 0.0] if kind == "every joint" else [2.0, -3.0, -9.0])
        mechanism = replace(point.mechanism, gravity_compensation="none")
        load = replace(point.load, hand="dead", gravity=gravity, surface_radius=np.inf)
        point = replace(point, mechanism=mechanism, load=load)
        found, drives = point.equilibrium, point.loaded_mechanism.drives
        engine, q = Engine(mechanism, gravity), point.posture.angles
        wrench, c = (found.hand_force, found.hand_moment), engine.joints.count
        springs = found.springs.torque(found.deflections)
        handed = np.where(np.isfinite(drives.stiffness), springs, found.torques)
        off = engine.forces(q, *wrench) + found.drives.T.T @ handed - torques_of_free_springs(mechanism, q)
        assert np.max(np.abs(off)) <= 1e-9 * max(1.0, np.max(np.abs(found.torques)))
        change = -np.stack(
            [
                sum(w / 1e-4 * engine.forces(engine.joints.moved(q, s * 1e-4 * e), *wrench) for s, w in FOURTH)
                for e in np.eye(c)
            ],
            axis=1,
        )
        plants = point.loaded_plants
        own = plants.loaded.stiffness - plants.unloaded.stiffness
        own = own + (0.0 if plants.loaded.circulatory is None else plants.loaded.circulatory)
        own = own[:c, :c] + np.tensordot(handed, found.drives.Z, 1)
        if mechanism.free:  # the rates of a ball joint are no coordinates where a force turns it
            own, change = (0.5 * (each + each.T) for each in (own, change))
        assert own == pytest.approx(change, abs=1e-8 * max(1.0, np.max(np.abs(change))))
        compared += np.max(np.abs(change)) > 0.01
    assert compared >= 2


def torques_of_free_springs(mechanism, q):
    """Torques (c,) of the free joints' springs, which are at rest where the assembly has these joints."""
    rest = next(iter(mechanism.assemblies.values()))
    torques = np.zeros(len(mechanism.driven) + len(mechanism.free))
    for i, free in enumerate(mechanism.free):
        torques[len(mechanism.driven) + i] = mechanism.links.joint_stiffness[free] * (q[free] - rest[free])
    return torques


# --- batches ----------------------------------------------------------------------------------------------


def test_a_batch_has_the_postures_of_each_and_marks_those_without_equilibrium():
    device = load_device("five-bar").with_({"drives.motor-right.torque_limit_Nm": 0.034})
    places = [(0.0, 0.25), (0.0, 0.15), (0.6, 0.6), (0.2, 0.2)]
    load = Load(push=-6.5, posture_of="motors")
    points = device.at(places, load=load)
    assert points.status.tolist() == [OK, OK, OUT_OF_REACH, NO_EQUILIBRIUM]
    for i in (0, 1):
        alone = device.at(places[i], load=load)
        assert points.posture.angles[i] == pytest.approx(alone.posture.angles, abs=1e-12)
        assert points.posture.position[i] == pytest.approx(alone.posture.position, abs=1e-12)
        assert points[i].plant.stiffness == pytest.approx(alone.plant.stiffness, rel=1e-9, abs=1e-6)
    assert np.isnan(points.posture.angles[3]).all()
    values = points.measure("stiffness_max")
    assert values.status.tolist() == [OK, OK, OUT_OF_REACH, NO_EQUILIBRIUM]
    assert np.isfinite(values.values[:2]).all()
    assert np.isnan(values.values[2:]).all()
    assert values.values[0] == pytest.approx(device.at(places[0], load=load).chart(decay=False).stiffness_max)
    with pytest.raises(EquilibriumError, match=r"needs 0\.05473 N m .* 0\.034 N m"):
        device.at(places[3], load=load)


def test_a_batch_of_handles_with_an_orientation_has_it_under_load():
    device = completed("openwrist", np.random.default_rng(1))
    load = Load(push=1.0, posture_of="motors")
    turns = [(0.1, 0.0, 0.05), (0.0, 0.1, 0.0)]
    points = device.at(orientation=turns, load=load)
    assert (points.status == OK).all()
    for i, turn in enumerate(turns):
        alone = device.at(orientation=turn, load=load)
        assert points.posture.rotation[i] == pytest.approx(alone.posture.rotation, abs=1e-12)
        assert points.posture.angles[i] == pytest.approx(alone.posture.angles, abs=1e-12)


# --- a free joint on a spring ---------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -9.81)])
def test_a_free_joint_s_spring_gives_way_to_a_push(gravity):
    """Gravity across the plane changes nothing, and is not needed to find where the joint then is."""
    joints, stiffness, length = {"upper": 0.4, "lower": 1.2, "tip": 0.5}, 1.0, 0.01
    body = {"mass_kg": 0.1, "inertia_kg_m2": [1e-4, 1e-4, 1e-4]}
    sprung = link("tip", "lower", length_m=length, free=True, joint_stiffness_Nm_per_rad=stiffness, **body)
    found = from_document(
        device(
            [link("upper", "base", length_m=0.02, **body), link("lower", "upper", length_m=0.015, **body), sprung],
            [drive(name, 0.5) for name in ("upper", "lower")],
            joints,
            (0.0, 1.0, 0.0),
        )
    )
    at = found.at(load=Load(push=-1.0, gravity=gravity))
    turn, pointing = at.posture.angles[2] - joints["tip"], at.posture.angles.sum()
    x, y, force = length * np.cos(pointing), length * np.sin(pointing), at.equilibrium.hand_force
    assert turn == pytest.approx((x * force[1] - y * force[0]) / stiffness, rel=1e-7)
    assert abs(turn) > 1e-3
    assert np.max(np.abs(at.equilibrium.unbalanced)) < 1e-10


# --- springs without torque -------------------------------------------------------------------------------


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_a_spring_with_no_torque_but_rounding_is_at_its_kink(tilt):
    """A column that turns about the plane in which the hand pushes: the branch asked for decides, not rounding."""
    joints = {"column": 0.3, "upper": 0.5, "lower": 1.0}
    body = {"mass_kg": 0.1, "inertia_kg_m2": [1e-4, 1e-4, 1e-4]}
    found = from_document(
        device(
            [
                link("column", "base", orientation_rad=[tilt, 0.0, 0.0], **body),
                link("upper", "column", orientation_rad=[np.pi / 2, 0.0, 0.0], length_m=0.2, **body),
                link("lower", "upper", length_m=0.15, **body),
            ],
            [drive(name, 0.5, backward_stiffness_Nm_per_rad=0.3) for name in joints],
            joints,
            (0.0, 0.0, 1.0),
        )
    )
    axis = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    across = found.at().jacobian[:, 0]
    radial = np.cross(across, axis) / np.linalg.norm(across)
    ahead, behind = (
        found.at(direction=radial, load=Load(push=-3.0, branch=branch)) for branch in ("forward", "backward")
    )
    assert ahead.equilibrium.kinked == behind.equilibrium.kinked == (0,)
    assert not np.allclose(ahead.loaded_plants.loaded.stiffness, behind.loaded_plants.loaded.stiffness)
    assert ahead.other_branch.loaded_plants.loaded.stiffness == pytest.approx(
        behind.loaded_plants.loaded.stiffness, rel=1e-9, abs=1e-9
    )
