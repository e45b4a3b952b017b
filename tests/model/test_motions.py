"""Second derivatives of points, frames and drives against differences of first derivatives that others compute."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.model.joints_apart import FOURTH, Joints, along_motion, travel, travel_rates
from tests.model.model_cases import (
    KINDS,
    NO_CLOSURES,
    Z,
    closures_of,
    drives_on,
    links_of,
    some_postures,
)
from tests.model.model_engines import ask_mujoco, ask_pinocchio
from tests.model.random_mechanisms import random_mechanism, random_mechanisms
from zwidth.model import AXIS, BALL_X, PRISMATIC, REVOLUTE, Mechanism, Motions, RatioTable, pack, solve_posture
from zwidth.model.effective_mass import DriveMotion, counted_posture, drive_travel

RELATIVE = 2e-9  # what differences leave near a singular posture; elsewhere it is 1e-11
BUILDS = ((6, 0), (7, 1), (9, 2))  # joints and loops


def random_builds(seed, count=2):
    """Mechanisms of every joint and closing where they are built, and others near their reference."""
    rng = np.random.default_rng(seed)
    for joints, loops in BUILDS:
        for mechanism in random_mechanisms(300 + seed, count, joints, loops):
            yield mechanism, solve_posture(mechanism).angles
    for make in KINDS.values():
        mechanism = make(rng)
        yield mechanism, some_postures(mechanism, rng, count=1).angles[0]
    yield closed_by_a_turning_hinge()


def closed_by_a_turning_hinge():
    """A spatial chain closed by a hinge, all of whose five equations count: its axis turns, and links about it."""
    joints = ["revolute", "universal", "revolute", "universal", "universal", "revolute"]
    mechanism = random_mechanism(np.random.default_rng(11), joints, [AXIS])
    return mechanism, mechanism.assemblies["as built"]


def motions_at(mechanism, q):
    return Motions(pack(mechanism), q)


def some_motions(rng, count):
    """Each coordinate alone, and three mixed ones."""
    mixed = rng.normal(size=(3, count))
    return [*np.eye(count), *(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))]


def close(ours, theirs, tolerance=RELATIVE):
    """Alike as a share of the largest number, or of 1."""
    return np.max(np.abs(np.asarray(ours) - theirs)) <= tolerance * max(1.0, np.max(np.abs(theirs)))


@pytest.mark.parametrize("seed", range(2))
def test_points_frames_and_joints_accelerate_as_differences_say(seed):
    """Along a motion e the velocity J e of a point changes by e^T x_2 e; so do a frame's and the joints' rates."""
    rng = np.random.default_rng(seed)
    for mechanism, q in random_builds(seed):
        joints, moves = Joints(mechanism), motions_at(mechanism, q)
        link, local = int(rng.choice(np.flatnonzero(mechanism.links.mass))), rng.uniform(-0.2, 0.2, 3)
        handle, point = moves.handle, moves.point(link, local)
        speeds = np.concatenate([handle.speed, handle.spin, point.speed, point.spin])
        turns = np.concatenate([handle.speed_2, handle.spin_2, point.speed_2, point.spin_2])
        rates, rates_2 = zip(*(moves.joint(i) for i in joints.moving), strict=True)
        assert close(point.position, joints.at(q).point(link, local)[0], 1e-12)
        for e in some_motions(rng, joints.count):

            def velocities(at, e=e, link=link, local=local):
                return np.concatenate([at.handle[1], at.handle[2], *at.point(link, local)[1:], at.B]) @ e

            assert close(np.append(speeds @ e, np.array(rates) @ e), velocities(joints.at(q)), 1e-12)
            assert close(
                np.append(turns @ e @ e, np.array(rates_2) @ e @ e), along_motion(joints, q, e, velocities)
            )


@pytest.mark.parametrize("ask", [ask_mujoco, lambda m, q: ask_pinocchio(m, q, np.zeros(Joints(m).count))[:3]])
def test_jacobians_of_two_engines_change_as_ours(ask):
    """The only step left to us is where the loops close again."""
    rng = np.random.default_rng(7)
    for mechanism, q in random_builds(7, count=1):
        joints, handle = Joints(mechanism), motions_at(mechanism, q).handle
        e = rng.normal(size=joints.count)
        e /= np.linalg.norm(e)
        there = [(w / 2e-4, ask(mechanism, joints.moved(q, s * 2e-4 * e))[1:]) for s, w in FOURTH]
        for ours, k in ((handle.speed_2, 0), (handle.spin_2, 1)):
            assert close(ours @ e @ e, sum(w * parts[k] @ e for w, parts in there))


@pytest.mark.parametrize("seed", range(2))
def test_columns_of_angular_velocity_turn_with_each_coordinate(seed):
    """dW/dp_t as a whole, of which the accelerations are the symmetric part."""
    for mechanism, q in random_builds(10 + seed):
        if any(mechanism.links.joint[i] >= BALL_X for i in mechanism.free):
            continue  # whose rates are no rates of coordinates
        joints, handle = Joints(mechanism), motions_at(mechanism, q).handle
        for t, e in enumerate(np.eye(joints.count)):
            assert close(handle.turning[:, :, t], along_motion(joints, q, e, lambda at: at.handle[2]))


@pytest.mark.parametrize("seed", range(2))
def test_what_the_closures_bear_is_what_keeps_them_closed(seed):
    """The second derivative along closed loops is that of the opened ones and of the closures' forces on them:

        B^T (f . x_2) B + f . J B_2  =  B^T (f . x_2 - lambda . A_2) B,    A_p^T lambda = J_p^T f

    The right side is differentiated along tangents, on which the loops open to second order; no B_2 is in it.
    """
    rng = np.random.default_rng(seed)
    with_loops = [build for build in random_builds(20 + seed) if build[0].closures.names]
    assert len(with_loops) > 5
    for mechanism, q in with_loops:
        joints, handle = Joints(mechanism), motions_at(mechanism, q).handle
        f, here = rng.normal(size=6), joints.at(q)

        def pushed(placed, joints=joints, mechanism=mechanism, f=f):
            return f @ np.concatenate(joints.jacobians(placed, mechanism.handle_link, mechanism.handle_point))

        rows = joints.gaps(here.placed)[1]
        passive = joints.passive
        multipliers = np.linalg.lstsq(rows[:, passive].T, pushed(here.placed)[passive], rcond=1e-10)[0]
        forms = np.tensordot(f[:3], handle.speed_2, 1) + np.tensordot(f[3:], handle.spin_2, 1)
        for e in some_motions(rng, joints.count):
            opened = [(w / 2e-4, joints.placed(joints.turned(q, s * 2e-4 * here.B @ e))) for s, w in FOURTH]
            bent = sum(w * (pushed(at) - multipliers @ joints.gaps(at)[1]) for w, at in opened) @ here.B @ e
            assert close(e @ forms @ e, bent, 1e-7)


@pytest.mark.parametrize("seed", range(2))
def test_weights_are_derivatives_of_the_height(seed):
    rng = np.random.default_rng(seed)
    for mechanism, q in random_builds(30 + seed):
        g = rng.normal(size=3) * 9.81
        joints, (force, derivative) = Joints(mechanism), motions_at(mechanism, q).weight(g)
        links, turned = mechanism.links, rng.normal(size=(2, joints.count))

        def potential(at, g=g, links=links):
            R, o = at.placed
            return links.mass @ (o + np.einsum("nij,nj->ni", R, links.center_of_mass)) @ g

        for e in turned / np.linalg.norm(turned, axis=1, keepdims=True):
            assert close(force @ e, along_motion(joints, q, e, potential))
            assert close(e @ derivative @ e, along_motion(joints, q, e, lambda at, g=g: at.weight(g)) @ e)
        assert not motions_at(mechanism, q).weight(np.zeros(3))[1].any()


# --- closed forms -----------------------------------------------------------------------------------------


def test_a_slider_crank_has_its_closed_form():
    """x = a cos phi + sqrt(b^2 - a^2 sin^2 phi); the slider's joint and its handle are the same."""
    a, b, phi = 0.05, 0.12, 0.7
    mechanism = slider_crank(a, b, phi)
    moves = motions_at(mechanism, mechanism.assemblies["only"])
    s, c = np.sin(phi), np.cos(phi)
    root = np.sqrt(b * b - a * a * s * s)
    first = -a * s - a * a * s * c / root
    second = -a * c - a * a * (c * c - s * s) / root - a**4 * s * s * c * c / root**3
    assert moves.handle.speed[0, 0] == pytest.approx(first, rel=1e-13)
    assert moves.handle.speed_2[0, 0, 0] == pytest.approx(second, rel=1e-12)
    rate, rate_2 = moves.joint(2)
    assert (rate[0], rate_2[0, 0]) == pytest.approx((first, second), rel=1e-12)


def slider_crank(a, b, phi):
    """A driven crank, a coupler on it, and a slider along x that the coupler's tip holds."""
    x = a * np.cos(phi) + np.sqrt(b * b - a * a * np.sin(phi) ** 2)
    coupler = np.arctan2(-a * np.sin(phi), x - a * np.cos(phi)) - phi
    return Mechanism(
        links=links_of(
            ["crank", "coupler", "slider"],
            [-1, 0, -1],
            [[0, 0, 0], [a, 0, 0], [0, 0, 0]],
            [Z, Z, [1.0, 0.0, 0.0]],
            [0.1, 0.1, 0.1],
            np.zeros((3, 3)),
            np.tile(1e-4 * np.eye(3), (3, 1, 1)),
            [a, b, 0.0],
            joint=[REVOLUTE, REVOLUTE, PRISMATIC],
        ),
        closures=closures_of(("pin", 1, [b, 0, 0], 2, [0, 0, 0])),
        drives=drives_on([0]),
        handle_link=2,
        handle_point=np.zeros(3),
        assemblies={"only": np.array([phi, coupler, x])},
        reference_position=np.array([x, 0.0, 0.0]),
        workspace=np.full((3, 2), np.nan),
    )


def test_the_base_stands_still_and_a_slide_goes_straight():
    slide = Mechanism(
        links=links_of(
            ["slide"], [-1], [[0, 0, 0]], [Z], [1.0], [[0, 0, 0]], [1e-4 * np.eye(3)], [0.1], joint=[PRISMATIC]
        ),
        closures=NO_CLOSURES,
        drives=drives_on([0]),
        handle_link=0,
        handle_point=np.zeros(3),
        assemblies={"only": np.zeros(1)},
        reference_position=np.zeros(3),
        workspace=np.full((3, 2), np.nan),
    )
    moves = motions_at(slide, np.array([0.3]))
    assert np.array_equal(moves.handle.position, [0.0, 0.0, 0.3])
    assert np.array_equal(moves.handle.speed[:, 0], Z)
    assert not moves.handle.speed_2.any()
    base = moves.point(-1, np.array([1.0, 2.0, 3.0]))
    assert np.array_equal(base.position, [1.0, 2.0, 3.0])
    assert not base.speed.any()
    assert not base.speed_2.any()


# --- drives -----------------------------------------------------------------------------------------------


def with_everything(mechanism, q, rng):
    """Drives with tables of their ratios, or ones that turn with each other's joints, and where there is a loop
    one more than there need be."""
    drives = mechanism.drives
    passive = [i for i in Joints(mechanism).moving if i not in (*mechanism.driven, *mechanism.free)]
    passive = [i for i in passive if mechanism.links.joint[i] in (REVOLUTE, PRISMATIC)]
    if passive:
        more = {"joint": passive[0], "transmission": 10.0, "motor_inertia": 1e-6, "stiffness": 1.0, "damping": 0.0}
        more |= {"torque_constant": np.nan, "torque_limit": np.inf, "encoder_counts": np.nan}
        grown = {name: np.append(getattr(drives, name), value) for name, value in more.items()}
        drives = replace(drives, names=(*drives.names, "more"), surplus=(len(drives.names),), **grown)
    if rng.random() < 0.5:
        coupling = np.zeros((len(drives.names), len(q)))
        coupling[:, drives.joint] = rng.uniform(-0.4, 0.4, (len(drives.names), len(drives.names)))
        coupling[np.arange(len(drives.names)), drives.joint] = 0.0
        return replace(mechanism, drives=replace(drives, coupling=coupling))
    tables = [
        RatioTable(q[j] + np.linspace(-0.4, 0.5, 5), rng.uniform(8.0, 12.0, 5), turns=False) for j in drives.joint
    ]
    return replace(mechanism, drives=replace(drives, ratio_tables=tuple(tables)))


def ratios_at(mechanism, q):
    """Ratios (d,) at a posture."""
    drives = mechanism.drives
    tables = drives.ratio_tables or [None] * len(drives.names)
    own = [
        float(n if t is None else t.at(q[j]))
        for n, t, j in zip(drives.transmission, tables, drives.joint, strict=True)
    ]
    return np.array(own)


@pytest.mark.parametrize("seed", range(2))
def test_drives_turn_as_differences_say(seed):
    """Tables, coupled drives and surplus ones: T, Z and finite travels."""
    rng = np.random.default_rng(seed)
    for plain, q in random_builds(40 + seed, count=1):
        mechanism = with_everything(plain, q, rng)
        ratio, joints = ratios_at(mechanism, q), Joints(mechanism)
        drives = DriveMotion.of(mechanism, motions_at(mechanism, q), q, ratio)
        to_drive = pack(mechanism).to_drive[0]
        for e in some_motions(rng, joints.count):
            p = to_drive @ e  # the same motion in the coordinates of the drives
            assert close(drives.T @ p, travel_rates(mechanism, joints.at(q), ratio) @ e, 1e-12)

            def turning(at, mechanism=mechanism, ratio=ratio, e=e):
                return travel_rates(mechanism, at, ratio) @ e

            assert close(drives.Z @ p @ p, along_motion(joints, q, e, turning))
        there = joints.moved(q, 0.02 * e)
        assert close(drive_travel(mechanism, q, there, ratio), travel(mechanism, q, there, ratio), 1e-12)


def counted(mechanism, q, ahead, ratio):
    return counted_posture(mechanism, motions_at(mechanism, q), q, ahead, ratio)


@pytest.mark.parametrize("seed", [0])
def test_the_counted_posture_is_the_nearest_to_the_counts(seed):
    """Least squares where there are more drives than coordinates, and how it follows the counts."""
    rng = np.random.default_rng(seed)
    for plain, q in random_builds(50 + seed, count=1):
        mechanism = with_everything(plain, q, rng)
        ratio, k = ratios_at(mechanism, q), len(mechanism.driven)
        ahead = rng.uniform(-0.01, 0.01, len(ratio))
        found = counted(mechanism, q, ahead, ratio)
        T = travel_rates(mechanism, Joints(mechanism).at(found.angles), ratio)[:, :k]
        away = travel(mechanism, q, found.angles, ratio) - ahead
        assert np.max(np.abs(T.T @ away)) <= 1e-12
        assert mechanism.drives.surplus or np.max(np.abs(away)) <= 1e-12
        assert found.angles[list(mechanism.free)] == pytest.approx(q[list(mechanism.free)], abs=1e-14)
        to_drive = pack(mechanism).to_drive[0, :k, :k]
        for i, e in enumerate(np.eye(len(ratio))):
            there = [(w / 2e-4, counted(mechanism, q, ahead + s * 2e-4 * e, ratio).angles) for s, w in FOURTH]
            assert close(found.seen[:, i], to_drive @ sum(w * at[mechanism.driven] for w, at in there))


def test_a_count_outside_of_a_ratio_s_table_has_no_posture():
    mechanism = KINDS["five-bar"](np.random.default_rng(0))
    q = solve_posture(mechanism, mechanism.reference_position).angles
    drives = mechanism.drives
    turned = q[drives.joint]
    near, values = np.array([-0.01, 0.0, 0.01]), np.array([9.0, 10.0, 11.0])
    tables = tuple(RatioTable(angle + near, values, turns=False) for angle in turned)
    mechanism = replace(mechanism, drives=replace(drives, ratio_tables=tables))
    ratio = ratios_at(mechanism, q)
    assert counted(mechanism, q, np.full(2, 0.005), ratio) is not None
    assert counted(mechanism, q, np.full(2, 0.02), ratio) is None


def test_drives_that_do_not_turn_with_their_joints_have_no_counted_posture():
    mechanism = KINDS["five-bar"](np.random.default_rng(0))
    q = solve_posture(mechanism, mechanism.reference_position).angles
    coupling = np.zeros((2, len(q)))
    coupling[[0, 1], mechanism.drives.joint] = -1.0
    still = replace(mechanism, drives=replace(mechanism.drives, coupling=coupling))
    assert counted_posture(still, motions_at(mechanism, q), q, np.full(2, 0.005), np.ones(2)) is None


def test_a_posture_that_cannot_be_counted_is_none():
    mechanism = KINDS["five-bar"](np.random.default_rng(0))
    q = solve_posture(mechanism, mechanism.reference_position).angles
    assert counted(mechanism, q, np.array([1.2, -1.2]), np.full(2, 18.6)) is None
