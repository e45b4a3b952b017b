"""Large motions of the whole mechanism against independent routes: multipliers, an ODE solver, MuJoCo, energy."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tests.contact.five_bar_reference import FiveBarByMultipliers, reference_motion
from tests.contact.mechanism_cases import (
    UNDAMPED,
    motion_of,
    paddle,
    planar_chain,
    sampled_controller,
    uncoupled_five_bar,
    with_drives,
    with_friction,
)
from tests.model.model_cases import KINDS, five_bar, random_five_bar, some_postures, spatial_arm
from tests.model.model_engines import mjcf
from zwidth.contact import Plane, Sphere, SurfaceWall
from zwidth.model import ModalDamping, bias_batch, link_points, pack, solve_posture

GRAVITY = np.array([1.3, -9.2, 2.8])


def energy(motion):
    return motion.kinetic + motion.elastic + motion.gravitational - motion.hand_work - motion.motor_work


# --- a second derivation, by multipliers, and an ODE solver ---------------------------------------------


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_a_hand_pushes_a_five_bar_about_and_into_a_wall(seed):
    """Half a second over some centimetres on flexible drives, with delay and gravity, in and out of a wall."""
    rng = np.random.default_rng(seed)
    mechanism = uncoupled_five_bar() if seed is None else with_drives(random_five_bar(rng), encoder_counts=np.nan)
    controller = sampled_controller(1.25e-3, delay=1.0 if seed is None else 0.4)
    wall, push, gravity = SurfaceWall(1500.0, 3.0), np.array([0.1, 1.5]), np.array([0.1, -0.5])
    samples = 400 if seed is None else 60
    ours = motion_of(
        mechanism,
        ModalDamping(0.05),
        controller,
        wall,
        Plane((0.0, 0.265), (0.1, -1.0)),
        at=(0.0, 0.25),
        duration=samples * 1.25e-3,
        push=push,
        gravity=gravity,
        substeps=4,
    )

    def surface(x):
        normal = np.array([0.1, -1.0]) / np.hypot(0.1, 1.0)
        return -(x - [0.0, 0.265]) @ normal, normal

    judge = reference_motion(
        mechanism, ModalDamping(0.05), controller, wall, surface, push, samples, gravity, (0.0, 0.25)
    )
    assert ours.status == "done"
    if seed is None:
        assert np.ptp(judge[:, 0]) > 0.03
        assert np.max(ours.depth) > 1e-3
        assert np.count_nonzero(np.diff(ours.depth > 0.0)) >= 3
    assert np.max(np.abs(ours.position[:, :2] - judge)) < 1e-9


def test_it_converges_with_the_fourth_power_of_the_substep():
    mechanism, errors = uncoupled_five_bar(), []
    settings = {"duration": 0.4, "push": (0.2, 0.6, 0.0)}
    scene = (ModalDamping(0.05), sampled_controller(4e-3), SurfaceWall(500.0, 3.0), Sphere((0.03, 0.29), 0.02))
    fine = motion_of(mechanism, *scene, substeps=128, **settings)
    for substeps in (4, 8, 16):
        found = motion_of(mechanism, *scene, substeps=substeps, **settings)
        errors.append(np.max(np.abs(found.position - fine.position)))
    ratios = np.array(errors[:-1]) / errors[1:]
    assert np.all((ratios > 12.0) & (ratios < 24.0))


@pytest.mark.parametrize(("stiffer", "error"), [(100.0, 1e-7), (1e4, 3e-6)])
def test_stiff_drives_set_no_limit_to_the_step(stiffer, error):
    """Modes of 1.3 and of 13 kHz, two steps a millisecond: the linear part is exact however fast it is."""
    plain = uncoupled_five_bar()
    mechanism = with_drives(plain, stiffness=stiffer * plain.drives.stiffness)
    scene = (
        mechanism,
        ModalDamping(0.05),
        sampled_controller(),
        SurfaceWall(500.0, 2.0),
        Plane((0.0, 0.265), (0.1, -1.0)),
    )
    fine, coarse = (
        motion_of(*scene, duration=0.4, push=(0.1, 1.5, 0.0), substeps=substeps) for substeps in (128, 2)
    )
    assert np.max(fine.depth) > 1e-3
    assert np.max(np.abs(coarse.position - fine.position)) < error


# --- energy ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_free_motion_keeps_its_energy(kind):
    """No damper, no wall, gravity: what is lost falls at least with the fourth power of the step."""
    rng = np.random.default_rng(5)
    mechanism = KINDS[kind](rng)
    here = solve_posture(mechanism, mechanism.reference_position)
    velocity = here.jacobian @ np.array([2.0, -1.5, 1.0])[: here.jacobian.shape[1]]
    lost = []
    for substeps in (1, 2, 4):
        motion = motion_of(
            mechanism, UNDAMPED, sampled_controller(2e-3), duration=0.05, start_velocity=velocity, gravity=GRAVITY,
            substeps=substeps,
        )  # fmt: skip
        total = energy(motion)
        assert motion.status == "done"
        lost.append(np.max(np.abs(total - total[0])) / np.max(motion.kinetic))
    assert lost[2] < 2e-6
    assert lost[0] / lost[1] > 12.0
    assert lost[1] / lost[2] > 12.0


def test_every_joule_is_accounted_for():
    """Hand, motors, gravity, bent springs; without dampers nothing is missing."""
    mechanism = with_friction(uncoupled_five_bar(), hardening=20.0, backward_stiffness=0.9)
    motion = motion_of(
        mechanism, UNDAMPED, sampled_controller(1e-3, delay=0.3), SurfaceWall(800.0, 2.0),
        Plane((0.0, 0.26), (0.0, -1.0)),
        duration=0.4, push=(0.5, 3.0, 0.0), gravity=(0.0, -1.0, 0.0), substeps=20,
    )  # fmt: skip
    total = energy(motion)
    assert np.ptp(motion.motor_work) > 0.01
    assert np.max(np.abs(total - total[0])) < 1e-7 * np.max(motion.kinetic)


def test_dampers_only_take():
    motion = motion_of(
        uncoupled_five_bar(), ModalDamping(0.05), sampled_controller(1e-3), SurfaceWall(800.0, 2.0),
        Plane((0.0, 0.26), (0.0, -1.0)), duration=0.4, push=(0.5, 3.0, 0.0), substeps=4,
    )  # fmt: skip
    steps = np.diff(energy(motion))
    assert np.max(steps) < 1e-9
    assert energy(motion)[-1] < -1e-4


# --- MuJoCo ---------------------------------------------------------------------------------------------


def engine(mechanism, gravity):
    """The open chain in MuJoCo, rotors of rigid drives on its joints."""
    model = mujoco.MjModel.from_xml_string(mjcf(mechanism))
    model.opt.gravity[:] = gravity
    drives = mechanism.drives
    for joint, inertia in zip(drives.joint, drives.transmission**2 * drives.motor_inertia, strict=True):
        model.dof_armature[model.joint(str(joint)).dofadr] = inertia
    return model, mujoco.MjData(model)


@pytest.mark.parametrize("make", [lambda rng: planar_chain(2), lambda rng: planar_chain(3), spatial_arm])
@pytest.mark.parametrize("seed", range(3))
def test_velocity_forces_and_gravity_are_mujocos(make, seed):
    rng = np.random.default_rng(seed)
    mechanism = make(rng)
    model, data = engine(mechanism, GRAVITY)
    angles, rates = rng.uniform(-3, 3, (20, model.nq)), rng.uniform(-5, 5, (20, model.nq))
    ours = np.empty_like(rates)
    bias_batch(pack(mechanism), np.zeros(20, np.int64), angles, rates, GRAVITY, ours)
    for q, qd, c in zip(angles, rates, ours, strict=True):
        data.qpos[:], data.qvel[:] = q, qd
        mujoco.mj_forward(model, data)
        assert c == pytest.approx(data.qfrc_bias, rel=1e-9, abs=1e-10)


@pytest.mark.parametrize("kind", ["five-bar", "spatial arm", "spatial loop", "spatial loop on a tilted foot"])
def test_gravity_is_the_slope_of_the_height_with_loops(kind):
    rng = np.random.default_rng(3)
    mechanism = KINDS[kind](rng)
    links, mech = mechanism.links, pack(mechanism)
    posture = some_postures(mechanism, rng, count=1)
    J, step = posture.jacobian[0], 1e-5
    ours = np.empty((1, J.shape[1]))
    bias_batch(mech, np.zeros(1, np.int64), posture.angles.copy(), np.zeros_like(ours), GRAVITY, ours)

    def height(handle):
        places = link_points(mechanism, solve_posture(mechanism, handle))
        at = (places.of(i, links.center_of_mass[i]) for i in range(len(links.names)))
        return -sum(m * GRAVITY @ c for m, c in zip(links.mass, at, strict=True))

    ways = np.eye(3)[: J.shape[1]]  # a planar mechanism's handle moves along x and y
    here = posture.position[0]
    slopes = [(height(here + step * u) - height(here - step * u)) / (2 * step) for u in ways]
    assert (ways @ J).T @ np.array(slopes) == pytest.approx(ours[0], rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("make", [lambda rng: planar_chain(2), spatial_arm])
@pytest.mark.parametrize("seed", range(2))
def test_a_chain_swings_as_in_mujoco(make, seed):
    """Rigid drives, gravity, 0.4 s of a large motion; MuJoCo's Runge-Kutta at a step of 0.05 ms."""
    mechanism = with_drives(make(np.random.default_rng(seed)), stiffness=np.inf, encoder_counts=np.nan)
    model, data = engine(mechanism, GRAVITY)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 5e-5
    motion = motion_of(mechanism, UNDAMPED, sampled_controller(1e-3), duration=0.4, gravity=GRAVITY, substeps=4)
    data.qpos[:] = motion.joints[0]
    for _ in range(round(0.4 / 5e-5)):
        mujoco.mj_step(model, data)
    assert motion.status == "done"
    assert np.max(np.abs(motion.joints[-1] - motion.joints[0])) > 0.5
    assert motion.joints[-1] == pytest.approx(data.qpos, abs=1e-8)


# --- where it ends --------------------------------------------------------------------------------------


def test_a_motion_into_a_singularity_ends_there():
    """Pulled outwards the arms of a five-bar stretch and its elbows meet."""
    motion = motion_of(
        uncoupled_five_bar(),
        ModalDamping(0.05),
        sampled_controller(1e-3),
        duration=2.0,
        push=(0.0, 5.0, 0.0),
        substeps=4,
    )
    assert motion.status in ("singular", "loop lost")
    assert motion.time[-1] < 1.0
    assert f"after {motion.time[-1]:.6g} s" in motion.reason
    assert np.all(np.isfinite(motion.position))


def test_a_start_next_to_a_singularity_is_told_at_once():
    """A twentieth of a micrometre from where both arms of the five-bar are stretched."""
    motion = motion_of(uncoupled_five_bar(), UNDAMPED, sampled_controller(), at=(0.0, 0.346 - 5e-8), duration=0.1)
    assert motion.status == "singular"
    assert motion.time.size == 0
    assert motion.reason.startswith("after 0 s ")


def test_a_wall_that_is_far_too_stiff_stops_the_motion_too():
    motion = motion_of(
        uncoupled_five_bar(), UNDAMPED, sampled_controller(5e-3), SurfaceWall(1e6),
        Plane((0.0, 0.25), (0.0, -1.0), two_sided=True), duration=2.0, start_velocity=(0.0, 0.01),
    )  # fmt: skip
    assert motion.status != "done"
    assert motion.reason


def test_loops_stay_closed():
    mechanism = with_drives(five_bar(), encoder_counts=np.nan)
    motion = motion_of(
        mechanism, UNDAMPED, sampled_controller(1e-3), duration=1.0, start_velocity=(0.2, 0.05), substeps=2
    )
    arms = replace(mechanism, drives=mechanism.drives)
    model = FiveBarByMultipliers(arms, np.zeros((4, 4)))
    passive = solve_posture(mechanism, mechanism.reference_position).angles[[1, 3]]
    for k in range(0, 1000, 50):
        handle, _, passive = model.jacobian(motion.joints[k], passive)
        assert handle == pytest.approx(motion.position[k, :2], abs=1e-12)


def test_a_paddle_turns_round_and_round():
    motion = motion_of(
        paddle(), UNDAMPED, sampled_controller(1e-3), duration=3.0, start_velocity=(0.0, 1.0), substeps=1
    )
    assert motion.joints[-1, 0] == pytest.approx(30.0, rel=1e-9)
