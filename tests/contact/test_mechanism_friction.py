"""Dry friction of a mechanism's drives: it sticks, slides and stops as it must, and takes what it should."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.contact.mechanism_cases import (
    UNDAMPED,
    motion_of,
    paddle,
    sampled_controller,
    uncoupled_five_bar,
    with_drives,
    with_friction,
)
from tests.model.model_cases import spatial_arm
from zwidth.model import ModalDamping

LEVEL = 1e-3  # N m at the motor; 0.01 N m at the joint
JOINT_LEVEL, LINK, ROTOR, LENGTH = 10.0 * LEVEL, 0.002, 1e-4, 0.1
SPRING = 0.3 * 100.0  # N m/rad at the joint, of the flexible paddle


def test_a_rigid_paddle_slides_to_a_stop():
    """J omega_0 / C seconds, half of that times omega_0 far, and all of its energy gone."""
    motion = motion_of(
        with_friction(paddle(), LEVEL),
        UNDAMPED,
        sampled_controller(1e-3),
        duration=0.6,
        start_velocity=(0.0, 0.2),
        substeps=3,
    )
    inertia, start = LINK + ROTOR, 2.0
    stop = inertia * start / JOINT_LEVEL
    sliding = motion.time < stop
    assert motion.joint_rates[sliding, 0] == pytest.approx(
        start - JOINT_LEVEL / inertia * motion.time[sliding], abs=1e-12
    )
    assert np.all(motion.joint_rates[motion.time > stop + 1e-3] == 0.0)
    assert motion.joints[-1, 0] == pytest.approx(start * stop / 2, abs=1e-6)
    assert motion.friction_loss[-1] == pytest.approx(inertia * start**2 / 2, rel=1e-5)
    assert np.ptp(motion.joints[motion.time > stop + 1e-3, 0]) == 0.0


@pytest.mark.parametrize(("share", "moves"), [(0.99, False), (1.01, True)])
@pytest.mark.parametrize("stiffness", [np.inf, 0.3])
def test_it_sticks_up_to_its_level(share, moves, stiffness):
    """A push at the handle, with the drive's swing damped out of reach of the level."""
    mechanism = with_friction(paddle(stiffness), LEVEL)
    ramp = np.minimum(np.arange(3000) / 2000.0, 1.0)
    push = np.outer(ramp, [0.0, share * JOINT_LEVEL / LENGTH, 0.0])
    motion = motion_of(mechanism, ModalDamping(0.3), sampled_controller(1e-3), duration=3.0, push=push, substeps=2)
    assert (np.ptp(motion.motors) > 0.0) == moves
    if not moves:
        assert np.all(motion.motor_rates == 0.0)
        assert np.all(motion.friction_loss == 0.0)


def reference_angles(push, duration, at):
    """phi, theta of a flexible paddle whose motor sticks and slides; every change is located."""

    def rates(t, x, side):
        phi, theta, p, w = x
        bend = SPRING * (theta - phi)
        stuck = side == 0.0
        return [
            p,
            0.0 if stuck else w,
            (bend + push * LENGTH * np.cos(phi)) / LINK,
            0.0 if stuck else (-bend - side * JOINT_LEVEL) / ROTOR,
        ]

    def stops(t, x, side):
        return x[3] if side else 1.0

    def breaks(t, x, side):
        return 1.0 if side else abs(SPRING * (x[1] - x[0])) - JOINT_LEVEL

    stops.terminal = breaks.terminal = True
    t, x, side = 0.0, np.array([0.0, 0.0, 0.0, 0.0]), 0.0
    found = np.empty((len(at), 4))
    while t < duration:
        stops.direction = -side
        done = solve_ivp(
            rates, (t, duration), x, "DOP853", rtol=1e-11, atol=1e-14, args=(side,), events=[stops, breaks],
            dense_output=True,
        )  # fmt: skip
        inside = (at >= t) & (at <= done.t[-1])
        found[inside] = done.sol(at[inside]).T
        t, x = done.t[-1], done.y[:, -1].copy()
        if done.status == 1:
            pull = -SPRING * (x[1] - x[0])
            x[3] = 0.0
            side = np.sign(pull) if abs(pull) >= JOINT_LEVEL * (1 - 1e-9) else 0.0
            if side:
                t += 1e-12
    return found


def test_stick_and_slip_are_those_of_an_event_locating_solver():
    push, errors = 0.15, []
    mechanism = with_friction(paddle(0.3), LEVEL)
    for substeps in (4, 16, 64):
        motion = motion_of(
            mechanism, UNDAMPED, sampled_controller(1e-3), duration=0.2, push=(0.0, push, 0.0), substeps=substeps
        )
        judge = reference_angles(push, 0.2, motion.time)
        errors.append(np.max(np.abs(motion.motors[:, 0] - judge[:, 1])))
    assert np.ptp(judge[:, 1]) > 0.01
    assert errors[0] < 1e-3 * np.ptp(judge[:, 1])
    assert errors[2] < 1e-5 * np.ptp(judge[:, 1])
    assert errors[0] / errors[2] > 100.0


@pytest.mark.parametrize("stiffness", [None, np.inf])
def test_several_drives_lose_what_their_frictions_take(stiffness):
    for mechanism in (
        uncoupled_five_bar(),
        with_drives(spatial_arm(np.random.default_rng(0)), encoder_counts=np.nan),
    ):
        rough = with_friction(mechanism, 5e-4)
        if stiffness is not None:
            rough = with_drives(rough, stiffness=stiffness)
        velocity = (0.05, 0.1, 0.0) if len(rough.links.names) == 4 else (0.05, 0.1, 0.02)
        motion = motion_of(
            rough, UNDAMPED, sampled_controller(1e-3), duration=1.0, start_velocity=velocity, substeps=16
        )
        total = motion.kinetic + motion.elastic + motion.friction_loss
        assert motion.status == "done"
        assert np.all(np.diff(motion.friction_loss) >= 0.0)
        assert total == pytest.approx(total[0], rel=1e-4)
        assert motion.friction_loss[-1] > 0.5 * total[0]


def test_two_rigid_drives_rest_against_a_push_below_their_levels():
    mechanism = with_drives(with_friction(uncoupled_five_bar(), 1e-2), stiffness=np.inf)
    motion = motion_of(mechanism, UNDAMPED, sampled_controller(1e-3), duration=0.2, push=(0.2, 0.5, 0.0))
    assert np.all(np.ptp(motion.joints, axis=0) == 0.0)


@pytest.mark.parametrize(
    ("model", "bristles"),
    [
        ("dahl", {"bristle_stiffness": 0.2}),
        (
            "lugre",
            {
                "bristle_stiffness": 0.2,
                "bristle_damping": 2e-4,
                "breakaway": 1.5 * LEVEL,
                "stribeck_velocity": 0.5,
            },
        ),
    ],
)
def test_bristles_bend_as_their_equations_say(model, bristles):
    mechanism = with_friction(paddle(0.3), LEVEL, model=model, **bristles)
    stiff, damp = 100.0 * 0.2, 100.0 * bristles.get("bristle_damping", 0.0)
    highest, slow = 10.0 * bristles.get("breakaway", LEVEL), bristles.get("stribeck_velocity", 1.0) / 10.0

    def rates(t, x):
        phi, theta, p, w, z = x
        bend = SPRING * (theta - phi)
        level = JOINT_LEVEL + (highest - JOINT_LEVEL) * np.exp(-((w / slow) ** 2))
        zd = w - stiff * abs(w) * z / level
        force = (bend + 0.15 * LENGTH * np.cos(phi)) / LINK
        return [p, w, force, (-bend - stiff * z - damp * zd) / ROTOR, zd]

    motion = motion_of(
        mechanism, UNDAMPED, sampled_controller(1e-3), duration=0.2, push=(0.0, 0.15, 0.0), substeps=64
    )
    judge = solve_ivp(rates, (0.0, 0.2), np.zeros(5), "LSODA", rtol=1e-10, atol=1e-13, t_eval=motion.time).y
    assert motion.motors[:, 0] == pytest.approx(judge[1], abs=1e-4 * np.ptp(judge[1]))
