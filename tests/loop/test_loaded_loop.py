"""Loops under load: the map from sample to sample against the nonlinear device and computer of `loaded_apart`."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from tests.device.test_device_zoo_engines import MECHANISMS, completed
from tests.loaded_apart import LoadedDevice, SimulatedDevice, root_errors
from tests.loop.loaded_cases import MADE, random_load, random_points, random_screw
from tests.model.model_cases import KINDS, drives_on, five_bar, some_postures, with_fixed_foot
from zwidth.device.load import load as load_device
from zwidth.errors import EquilibriumError, PostureError
from zwidth.loop import Controller, LocalLoop, OperatingPoint
from zwidth.model import PRISMATIC, Load, Operator, solve_posture

ROOTS = 1e-6  # share of a root's size; most are alike to 1e-10
ROUNDING = 1e-11  # share of a matrix to which the judge's differences are known
SIMULATED = 1e-7  # the same of a device that is simulated


def some_wall(plant, period):
    """A stiff wall with damping, as large as suits the plant."""
    mass = 1.0 / float(plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
    return 0.1 * mass / period**2, 0.1 * mass / period


def whole(point):
    """The point with its sideways motions in the loop."""
    return replace(point, load=replace(point.load, count_sideways=True))


def transition(point, wall=None):
    """The transition matrix of the whole loop at a wall, which suits the plant."""
    loop = whole(point).loop
    return loop.transition_matrix(*(wall or some_wall(loop.plant, loop.period)))


def check_alike(ours, theirs, rounding=ROUNDING, hidden=0):
    """The same roots, but for what the errors of a matrix explain."""
    distance, backward = root_errors(np.linalg.eigvals(ours), theirs, hidden=hidden)
    assert np.all((distance <= ROOTS) | (backward <= rounding)), (distance, backward)
    assert np.all(backward <= 100.0 * rounding), backward


def check_roots(point, judge=LoadedDevice, rounding=ROUNDING):
    """Ours are the judge's."""
    loop = whole(point).loop
    wall = some_wall(loop.plant, loop.period)
    device = judge(point, *wall)
    assert device.unbalanced() <= 1e-9
    # a load that the computer adds nothing to leaves motions that no wall moves, as there are without load
    hidden = 0 if loop.plant.is_loaded else 2 * len(loop.sections.unobserved)
    check_alike(loop.transition_matrix(*wall), device.jacobian(), rounding, hidden)


def plain_point(mechanism, load, u=None, controller=None, seed=0, model="full", posture=None):
    """A point of a mechanism near its reference, without anything special."""
    if posture is None:
        posture = some_postures(mechanism, np.random.default_rng(seed), count=1).with_axes(lambda array: array[0])
    if u is None:
        u = random_screw(mechanism, posture, np.random.default_rng(seed))
    return OperatingPoint(
        controller or Controller(0.001, 0.5),
        mechanism=mechanism,
        posture=posture,
        directions=np.asarray(u, dtype=float)[None],
        load=load,
        model=model,
    )


# --- against the nonlinear device -----------------------------------------------------------------------


@pytest.mark.parametrize("kind", MADE)
def test_roots_are_those_of_the_nonlinear_device(kind):
    for point in random_points(kind, seed=0, count=3):
        check_roots(point)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MADE)
def test_roots_of_many_devices(kind):
    for point in random_points(kind, seed=1, count=80):
        check_roots(point)


def bundled_point(name, seed):
    """A bundled device near its reference under a random load; what its file does not know is drawn."""
    rng = np.random.default_rng(seed)
    device = completed(name, rng)
    names, at = device.mechanism.links.names, device.at().posture.angles
    sizes = np.where(device.mechanism.links.joint == PRISMATIC, 0.01, 0.1)
    turned = {names[i]: at[i] + sizes[i] * rng.uniform(-1.0, 1.0) for i in device.mechanism.drives.joint}
    posture = device.at(turned).posture
    u = random_screw(device.mechanism, posture, rng)
    load = random_load(rng, 3.0, u.shape == (6,))
    if device.mechanism.free:  # gimbals without springs, which hang
        load = replace(load, gravity=None)
    return device.at(posture, **({"direction": u} if u.shape == (3,) else {"axis": u[3:]}), load=load)


@pytest.mark.parametrize(("name", "seed"), [("novint-falcon", 1), ("openwrist", 1), ("openwrist", 5)])
def test_roots_of_a_delta_and_of_a_wrist(name, seed):
    """The wrist by the second seed has two poles at z = 1 and one motion that nothing holds."""
    check_roots(bundled_point(name, seed))


@pytest.mark.slow
@pytest.mark.parametrize("name", MECHANISMS)
def test_roots_of_every_bundled_device(name):
    judged = 0
    for seed in range(12):
        try:
            point = bundled_point(name, seed)
        except (EquilibriumError, PostureError):
            continue
        judged += 1
        check_roots(point)
    assert judged >= 6


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["five-bar", "spatial arm", "spatial loop"])
def test_roots_are_those_of_a_simulation(kind):
    """The judge that is put together from its parts, and we, against the one that is simulated."""
    for point in random_points(kind, seed=2, count=8):
        nonlinearity = point.mechanism.drives.nonlinearity
        drives = replace(
            point.mechanism.drives,
            nonlinearity=replace(nonlinearity, preload=np.zeros_like(nonlinearity.preload)),
        )
        computer = replace(point.controller, velocity_filter=None, force_filter=None)
        mechanism = replace(point.mechanism, drives=drives)
        load = replace(point.load, hand="dead" if point.load.hand == "neglected" else point.load.hand)
        check_roots(
            replace(point, mechanism=mechanism, controller=computer, load=load), SimulatedDevice, SIMULATED
        )


@pytest.mark.parametrize("grasp", [(None, None), (3000.0, 8.0)])
def test_roots_with_an_operator_at_the_handle(grasp):
    hand = Operator(0.4, 300.0, 6.0, *grasp)
    for kind in ("five-bar", "spatial loop"):
        (point,) = random_points(kind, seed=3, count=1)
        check_roots(replace(point, operator=hand, operator_name="hand"))


def test_a_local_loop_at_the_wall_s_rate_is_a_part_of_the_wall():
    for kind in ("five-bar", "spatial arm"):
        (point,) = random_points(kind, seed=4, count=1)
        computer = replace(point.controller, velocity_filter=None, force_filter=None)
        loop = whole(replace(point, controller=computer)).loop
        K, B = some_wall(loop.plant, loop.period)
        part = LocalLoop(1, stiffness=0.4 * K, damping=0.3 * B, delay=computer.delay)
        both = replace(point, controller=replace(computer, local_loop=part))
        check_alike(transition(both, (0.6 * K, 0.7 * B)), loop.transition_matrix(K, B))
        twice = replace(point, controller=replace(computer, local_loop=LocalLoop(2, stiffness=1e-9 * K)))
        check_alike(transition(twice, (K, B)), loop.transition_matrix(K, B))


def static_stiffness(plant):
    """The stiffness with what the computer adds, as if it did so at every instant."""
    K = plant.stiffness - sum(np.outer(force.along, force.reading) for force in plant.sampled_forces)
    return K if plant.circulatory is None else K + plant.circulatory


# --- what must not matter -------------------------------------------------------------------------------


def of_drives(mechanism, joints, coupling=None):
    """The mechanism with rigid drives on these joints, whose rotors have no inertia."""
    drives = replace(drives_on(joints, (inf,) * len(joints), inertia=0.0), coupling=coupling)
    return replace(mechanism, drives=drives)


@pytest.mark.parametrize("compensation", ["none", "computed"])
def test_a_load_s_static_stiffness_does_not_hang_on_where_rigid_drives_sit(compensation):
    """Without rotors. The halves of it do: constant torques have other lever arms on other joints."""
    load = Load(push=5.0, gravity=[1.0, -9.0, 0.5])
    plain = replace(five_bar(base=0.06), gravity_compensation=compensation)
    for place in ((0.04, 0.23, 0.0), (-0.05, 0.2, 0.0)):
        found = []
        for joints in ([0, 2], [1, 3], [0, 1]):
            mechanism = of_drives(plain, joints)
            point = plain_point(
                mechanism, load, (0.6, 0.8, 0.0), posture=solve_posture(mechanism, np.array(place))
            )
            plant, joint_rates = point.loaded_plants.loaded, np.linalg.inv(point.jacobian[:2])
            K = [joint_rates.T @ each @ joint_rates for each in (static_stiffness(plant), plant.stiffness)]
            assert pytest.approx(plant.actuator, rel=1e-12) == point.jacobian[:2].T @ [0.6, 0.8]
            found.append((*K, point.equilibrium.hand_force))
        for static, half, hand in found[1:]:
            assert static == pytest.approx(found[0][0], abs=1e-11 * np.max(np.abs(half)))
            assert hand == pytest.approx(found[0][2], rel=1e-11, abs=1e-11)
            assert np.max(np.abs(half - found[0][1])) > 1.0


@pytest.mark.parametrize("compensation", ["none", "computed"])
def test_motors_may_count_absolute_angles(compensation):
    """Drives that turn with joints before their own, too, as of a parallelogram or a cable, and drives of each."""
    load = Load(push=-4.0, gravity=[0.0, 0.0, -9.81])
    arm = replace(KINDS["spatial arm"](np.random.default_rng(5)), gravity_compensation=compensation)
    coupling = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 1.0, 0.0]])
    place = arm.reference_position + np.array([0.01, -0.02, 0.01])
    one, other = (
        plain_point(mechanism, load, (0.0, 0.6, 0.8), posture=solve_posture(mechanism, place))
        for mechanism in (of_drives(arm, [0, 1, 2], each) for each in (np.zeros((3, 3)), coupling))
    )
    assert not np.allclose(one.jacobian, other.jacobian)
    wall = some_wall(one.loaded_plants.loaded, 0.001)
    check_alike(transition(other, wall), transition(one, wall))


def mirrored(mechanism):
    """Every link reflected in the plane y = 0, at the same joint coordinates: axes of turns are pseudovectors."""
    links, closures, P = mechanism.links, mechanism.closures, np.diag([1.0, -1.0, 1.0])
    return replace(
        mechanism,
        links=replace(
            links,
            origin=links.origin @ P,
            rotation=P @ links.rotation @ P,
            axis=-(links.axis @ P),
            center_of_mass=links.center_of_mass @ P,
            inertia=P @ links.inertia @ P,
        ),
        closures=replace(closures, point_a=closures.point_a @ P, point_b=closures.point_b @ P),
        handle_point=mechanism.handle_point @ P,
        reference_position=mechanism.reference_position @ P,
    )


@pytest.mark.parametrize("kind", ["five-bar", "spatial arm", "spatial loop"])
def test_a_mirrored_device_has_the_mirrored_roots(kind):
    P = np.diag([1.0, -1.0, 1.0])
    for point in random_points(kind, seed=6, count=2):
        position, gravity = point.posture.position, point.load.gravity
        image = mirrored(point.mechanism)
        other = replace(
            point,
            mechanism=image,
            posture=solve_posture(image, P @ position),
            directions=point.directions @ P,
            load=replace(point.load, gravity=None if gravity is None else P @ gravity),
        )
        check_alike(transition(other), transition(point))


@pytest.mark.parametrize("kind", ["five-bar", "spatial arm", "spatial loop"])
def test_neither_the_frame_nor_the_sense_of_the_direction_matters(kind):
    """The whole device on a tilted foot, and the opposite direction with the opposite push."""
    for point in random_points(kind, seed=7, count=2):
        tilted = with_fixed_foot(point.mechanism)
        drives = replace(
            tilted.drives,
            **{name: getattr(point.mechanism.drives, name) for name in ("nonlinearity", "stiffness")},
        )
        tilted = replace(tilted, drives=drives, gravity_compensation=point.mechanism.gravity_compensation)
        shift, R = tilted.links.origin[0], tilted.links.rotation[0]
        gravity = point.load.gravity
        other = replace(
            point,
            mechanism=tilted,
            posture=solve_posture(tilted, shift + R @ point.posture.position),
            directions=point.directions @ R.T,
            load=replace(point.load, gravity=None if gravity is None else R @ gravity),
        )
        check_alike(transition(other), transition(point))
        back = replace(point, directions=-point.directions, load=replace(point.load, push=-point.load.push))
        check_alike(transition(back), transition(point))


# --- limits -----------------------------------------------------------------------------------------------


def test_a_load_that_vanishes_leaves_the_unloaded_chart():
    """And the change grows in proportion with the load."""
    device = load_device("five-bar")
    bare = device.at((0.03, 0.22), (0.6, 0.8)).chart(decay=False).stiffness_max

    def change(push):
        point = device.at((0.03, 0.22), (0.6, 0.8), load=Load(push=push))
        return point.chart(decay=False).stiffness_max / bare - 1.0

    assert abs(change(1e-6)) <= 1e-7
    assert abs(change(1.0)) > 1e-6
    assert change(0.5) == pytest.approx(0.5 * change(1.0), rel=0.05)
    assert change(-0.5) == pytest.approx(-0.5 * change(1.0), rel=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_with_rigid_drives_both_halves_of_a_load_cancel(kind):
    point = plain_point(KINDS[kind](np.random.default_rng(8)), Load(push=7.0), model="rigid")
    check_cancels(point.loaded_plants.loaded)


def test_both_halves_of_a_moment_cancel():
    """Whose stiffness is not even symmetric."""
    point = bundled_point("openwrist", 1)
    plant = replace(point, load=Load(push=0.2), model="rigid").loaded_plants.loaded
    assert plant.circulatory is not None
    check_cancels(plant)


def check_cancels(plant):
    """The static stiffness is rounding of the continuous half."""
    assert np.max(np.abs(plant.stiffness)) > 0.05
    assert np.max(np.abs(static_stiffness(plant))) <= 1e-12 * np.max(np.abs(plant.stiffness))


@pytest.mark.parametrize("delay", [0.0, 0.7, 2.0])
def test_what_sampling_leaves_of_rigid_drives(delay):
    """x'' = w^2 (x(t) - x(t - tau)) with tau = T (1/2 + delay) in the mean: a root at z = 1 and one at
    1 + (w T)^2 (1/2 + delay), to first order in T."""
    mechanism = KINDS["spatial arm"](np.random.default_rng(10))
    for sign in (1.0, -1.0):
        for T in (1e-3, 1e-4):
            point = plain_point(mechanism, Load(push=sign * 6.0), controller=Controller(T, delay), model="rigid")
            squared = -np.linalg.eigvalsh(point.plant.apart.stiffness)
            assert point.plant.apart.mass == pytest.approx(np.eye(2), abs=1e-9)
            grows = np.sort(squared[squared > 0.0])[::-1]
            rates = [motion.growth_rate for motion in point.loop.sideways_motions]
            assert rates[: len(grows)] == pytest.approx(grows * T * (0.5 + delay), rel=200.0 * T)
            assert rates[len(grows) :] == [0.0] * (2 - len(grows))


@pytest.mark.parametrize("kind", ["five-bar", "spatial arm"])
def test_what_flexible_drives_leave_does_not_go_away(kind):
    """Their bending is of the order of the load, so is the growth rate that stays as T goes to 0."""
    mechanism = KINDS[kind](np.random.default_rng(11))

    def largest(push, T):
        point = plain_point(mechanism, Load(push=push), controller=Controller(T))
        return max(motion.growth_rate for motion in point.loop.sideways_motions)

    limit = largest(2.0, 1e-6)
    assert limit > 1e-3
    assert largest(2.0, 1e-5) == pytest.approx(limit, rel=1e-2)
    assert largest(1.0, 1e-6) == pytest.approx(0.5 * limit, rel=2e-2)


# --- sideways motions -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["five-bar", "spatial arm", "spatial loop"])
@pytest.mark.parametrize("model", ["full", "rigid"])
def test_sideways_motions_grow_as_the_nonlinear_device_does_against_a_wall(kind, model):
    """With flexible drives but for terms of the order of the load: under half of it they are half as far off, as a
    share; with rigid ones to the digits that the judge has."""
    mechanism = KINDS[kind](np.random.default_rng(12))

    def error(push):
        point = plain_point(mechanism, Load(push=push), model=model)
        T, motions = point.controller.sampling_period, point.loop.sideways_motions
        roots = np.linalg.eigvals(LoadedDevice(point, *some_wall(point.plant, T)).jacobian())
        slow = roots[np.argsort(np.abs(roots - 1.0))][: 2 * point.plant.apart.size]
        rates = np.sort(np.log(np.abs(slow)) / T)[::-1][: len(motions)]
        ours = np.array([motion.growth_rate for motion in motions])
        assert len(motions) == point.plant.apart.size
        return np.max(np.abs(ours - rates)) / np.max(np.abs(np.log(np.abs(slow)) / T))

    for sign in (1.0, -1.0):
        small, large = error(0.5 * sign), error(sign)
        assert large <= (2e-4 if model == "rigid" else 0.02)
        assert small <= (2e-4 if model == "rigid" else 0.6 * large)


def test_a_slide_that_the_load_does_not_turn_stays_neutral():
    """A five-bar on a slide across its plane: the motion in the plane grows as it does without the slide."""
    plain = five_bar(base=0.06, stiffness=(inf, inf))
    mechanism = with_fixed_foot(plain)
    links = mechanism.links
    slide = {"joint": [PRISMATIC, *links.joint[1:]], "axis": links.axis, "rotation": links.rotation}
    slide = {name: np.array(value) for name, value in slide.items()}
    slide["rotation"][0] = np.eye(3)
    mechanism = replace(
        mechanism,
        links=replace(links, **slide),
        drives=drives_on([0, *mechanism.drives.joint], (inf, inf, inf)),
        reference_position=links.origin[0] + plain.reference_position,
    )
    u, load = (0.6, 0.8, 0.0), Load(push=-5.0)
    one, other = (
        plain_point(each, load, u, posture=solve_posture(each, each.reference_position))
        for each in (plain, mechanism)
    )
    (motion,) = one.loop.sideways_motions
    assert motion.growth_rate > 0.0
    grows, still = other.loop.sideways_motions
    assert grows.growth_rate == pytest.approx(motion.growth_rate, rel=1e-9)
    assert (still.growth_rate, still.frequency) == (0.0, 0.0)


def test_a_chart_counts_what_the_wall_moves_and_names_the_rest():
    device = load_device("five-bar")
    bare, apart = device.at(), device.at(load=Load(push=-5.0))
    both = device.at(load=Load(push=-5.0, count_sideways=True))
    assert (both.plant.size, apart.plant.size, apart.plant.apart.size) == (4, 3, 1)
    assert both.plant.apart is None
    (motion,) = apart.loop.sideways_motions
    assert motion.growth_rate > 0.0
    assert both.loop.sideways_motions == ()
    charts = [point.chart(decay=False) for point in (bare, apart, both)]
    assert charts[1].stiffness_max == pytest.approx(charts[0].stiffness_max, rel=1e-3)
    assert np.isnan(charts[2].stiffness_max)  # no wall holds what grows sideways
    assert charts[1].unobserved_modes == (motion.name,)
    assert charts[1].document()["sideways_motions"] == [motion.document()]
    assert "sideways_motions" not in charts[0].document()
    wall = 0.5 * charts[0].stiffness_max, 10.0
    assert [point.check(*wall).names for point in (bare, apart, both)] == [["stable"], ["stable"], ["unstable"]]


def test_without_load_there_is_nothing_sideways_to_name():
    assert load_device("five-bar").at().loop.sideways_motions == ()


def test_an_operator_holds_what_the_wall_moves_and_nothing_sideways():
    device = load_device("five-bar")
    hand = Operator(0.4, 300.0, 6.0, 3000.0, 8.0)
    held, alone = (device.at(load=Load(push=-5.0), operator=each) for each in (hand, "none"))
    assert held.plant.size == alone.plant.size + 1
    assert held.plant.apart.size == alone.plant.apart.size == 1
    rates = [point.loop.sideways_motions[0].growth_rate for point in (held, alone)]
    assert rates[0] == pytest.approx(rates[1], rel=0.02)
