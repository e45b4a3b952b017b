"""Environments at a surface: an arm too long to turn is the device of the other simulator, and energies add up."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contact.mechanism_cases import (
    UNDAMPED,
    motion_of,
    paddle,
    sampled_controller,
    uncoupled_five_bar,
    with_drives,
    with_friction,
)
from tests.systems import random_controller, random_method
from zwidth.contact import (
    ENVIRONMENTS,
    Box,
    Hand,
    Parameter,
    Plane,
    Sphere,
    SurfaceEnvironment,
    SurfaceWall,
    depth_and_normal,
    simulate,
)
from zwidth.contact.environments import environment
from zwidth.loop import Butterworth, Foaw, Levant, Loop
from zwidth.model import ModalDamping, reduce_mechanism, solve_posture

ALONG = np.array([0.0, 1.0, 0.0])
LENGTH = 1e5  # m, of an arm whose handle goes straight over some millimetres, to 1e-15 of them
MASS, STEP, WALL = 0.2, 3.7183e-6, 0.31e-3  # kg, m, m


@environment([Parameter("stiffness", "N/m", 500.0), Parameter("rate", "N/s", 1.0)], name="button", surface=True)
def button(position, velocity, time, period, parameters, memory):
    "A spring that gives way once, until it is let go, and pushes harder as time goes on."
    if position <= 0.0:
        memory[0] = 0.0
        return 0.0
    if position > 2e-4:
        memory[0] = 1.0
    stiffness = parameters[0] if memory[0] == 0.0 else 0.2 * parameters[0]
    return -stiffness * position - parameters[1] * time - 1e-3 * stiffness * velocity * period


@environment(name="silent")
def silent(position, velocity, time, period, parameters, memory):
    "No number from 1 mm on."
    return -100.0 * position if position < 1e-3 else np.nan


LAWS = {**ENVIRONMENTS, "button": button}


def values_of(rng, name, K, B):
    """Parameters of an environment about as stiff as a wall K, B, for motions of half a millimetre."""
    given = {
        "wall": {"stiffness": K, "damping": B},
        "one_sided_wall": {"stiffness": K, "damping": B, "no_pull": rng.integers(2)},
        "pressed_wall": {"stiffness": K, "damping": B, "load": 1e-4 * K},
        "slot": {"width": 2e-4, "stiffness": K, "damping": B, "no_pull": rng.integers(2)},
        "nonlinear_wall": {"stiffness": K, "cubic": K * 1e6, "damping": B, "two_sided": rng.integers(2)},
        "hunt_crossley": {"stiffness": 50.0 * K, "exponent": 1.5, "dissipation": B / K},
        "coupled_wall": {
            "coupling_stiffness": K,
            "coupling_damping": B,
            "proxy_mass": float(rng.choice([0.0, 0.1 * MASS])),
            "wall_stiffness": float(rng.choice([np.inf, 2.0 * K])),
        },
        "friction_patch": {"friction": 1e-4 * K, "breakaway": 1.3, "stiffness": K, "length": 1e-3},
        "texture": {"height": 1e-4, "wavelength": 7e-4, "normal_force": 5e-4 * K, "damping": B},
        "grating": {"height": 1e-4, "pitch": 7.1351e-4, "normal_force": 1e-4 * K},
        "virtual_mass": {"mass": 0.2 * MASS, "cutoff": 30.0},
        "button": {"stiffness": K, "rate": 1e-4 * K},
    }
    return LAWS[name].values(**given[name])


def computer(rng):
    """0.2 to 20 kHz, every estimator, filters of velocity and force, delays, a lag, a largest force."""
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    T, method = 1.0 / rate, random_method(rng, rate)
    pick = rng.random()
    if pick < 0.15:
        method = Foaw(int(rng.integers(2, 12)), STEP, str(rng.choice(["end-fit", "best-fit"])))
    elif pick < 0.3:
        method = Levant(0.05 * 2e-5 * rate**2)
    return replace(
        random_controller(rng, rate),
        velocity=method,
        force_filter=Butterworth(int(rng.integers(1, 4)), rng.uniform(0.1, 0.8) * rate / 2)
        if pick > 0.5
        else None,
        actuator_time_constant=T * float(rng.choice([0.0, 0.3])),
    )


def straight_arm(rng):
    """A mass on an arm so long that it goes straight, its drive rigid or not, with counts and noise or without."""
    flexible = rng.random() < 0.5
    motor = 0.3 * MASS
    arm = paddle(length=LENGTH)
    links = replace(
        arm.links,
        mass=np.array([1e-9]),
        inertia=np.diag([1e-3, 1.0, 1.0])[None] * (MASS - motor) * LENGTH**2,
    )
    arm = with_drives(
        replace(arm, links=links),
        transmission=1.0,
        motor_inertia=motor * LENGTH**2,
        stiffness=2e4 * LENGTH**2 if flexible else np.inf,
        encoder_counts=2.0 * np.pi * LENGTH / STEP if rng.random() < 0.7 else np.nan,
    )
    noise = float(rng.choice([0.0, 1e-6]))
    return with_friction(arm, encoder_noise=noise / LENGTH), ModalDamping(0.05) if flexible else UNDAMPED


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("name", LAWS)
def test_one_arm_at_a_plane_is_the_device_of_the_other_simulator(name, seed):
    """The same counts, estimates and forces, sample by sample, of all that one computer may be."""
    rng = np.random.default_rng([list(LAWS).index(name), seed])
    controller = computer(rng)
    T = controller.sampling_period
    K = MASS / T**2 * 10.0 ** rng.uniform(-3.5, -2.5)
    values = values_of(rng, name, K, K * T * rng.uniform(0.0, 1.0))
    controller = replace(controller, force_limit=float(rng.choice([np.inf, 2e-4 * K])))
    speed, push = 2e-5 / T, 1e-4 * K
    arm, damping = straight_arm(rng)
    if rng.random() < 0.3:
        arm = with_drives(arm, torque_limit=1.5e-4 * K * LENGTH)
    motion = motion_of(
        arm, damping, controller, SurfaceEnvironment(LAWS[name], values),
        Plane((LENGTH, WALL, 0.0), (0.0, -1.0, 0.0)),
        duration=250 * T, start_velocity=speed * ALONG, push=push * ALONG, seed=seed,
    )  # fmt: skip
    plant = reduce_mechanism(arm, solve_posture(arm, arm.reference_position), ALONG, "full", damping)
    loop = Loop(plant, controller)
    response = simulate(
        loop, LAWS[name], values, duration=250 * T, start_velocity=speed, wall_position=WALL,
        hand=Hand(push=push), seed=seed,
    )  # fmt: skip
    assert motion.status == "done"
    for ours, theirs in (
        (motion.position[:, 1], response.handle),
        (motion.counted_position[:, 1], response.reading),
        (motion.velocity[:, 1], response.velocity),
        (motion.torque[:, 0] / LENGTH, response.force),
    ):
        size = np.max(np.abs(theirs))
        assert size > 0.0
        assert ours == pytest.approx(theirs, abs=1e-9 * size)
    if not np.isfinite(arm.drives.torque_limit[0]):
        assert motion.force[:, 1] == pytest.approx(response.force, abs=1e-9 * np.max(np.abs(response.force)))
    assert motion.two_sided == (name == "wall")


# --- curved surfaces, and large motions -------------------------------------------------------------------

FIVE_BAR = uncoupled_five_bar()
SURFACES = [
    Plane((0.0, 0.255), (0.2, -1.0)),
    Sphere((0.01, 0.30), 0.045),
    Sphere((0.0, 0.25), 0.005, hollow=True),
    Box((0.0, 0.27), (0.1, 0.015)),
    Box((0.0, 0.25), (0.004, 0.005), hollow=True),
]
PUSHED = {"at": (0.0, 0.25), "duration": 0.25, "push": (0.2, 1.0, 0.0)}


def push_into(law, surface, mechanism=FIVE_BAR, damping=UNDAMPED, controller=None, **settings):
    values = LAWS[law].values(**{"friction": 0.4} if law == "friction_patch" else {})
    wall = SurfaceEnvironment(LAWS[law], values)
    motion = motion_of(mechanism, damping, controller or sampled_controller(), wall, surface, **PUSHED | settings)
    assert motion.status == "done"
    assert np.max(np.abs(motion.force)) > 0.05
    return motion, values


@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: f"{type(s).__name__} {getattr(s, 'hollow', '')}")
@pytest.mark.parametrize("law", LAWS)
def test_the_force_is_the_laws_along_the_normal_of_the_place_that_is_seen(law, surface):
    """Depth and its estimated rate in, a force along the normal out, once for each sample."""
    counted = with_drives(FIVE_BAR, encoder_counts=2000.0)
    motion, values = push_into(law, surface, counted, ModalDamping(0.05))
    depth, normal = depth_and_normal(surface, motion.counted_position)
    rate, memory = -np.sum(normal * motion.velocity, axis=1), np.zeros(8)
    asked = [
        LAWS[law].function(d, v, t, 1e-3, values, memory) for d, v, t in zip(depth, rate, motion.time, strict=True)
    ]
    expected = -np.array(asked)[:, None] * normal
    assert motion.force == pytest.approx(expected, abs=1e-9 * np.max(np.abs(expected)))


@pytest.mark.parametrize("surface", SURFACES[1::3], ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("law", LAWS)
def test_every_joule_is_accounted_for(law, surface):
    """Without dampers nothing is missing: hand, motors and gravity, whatever the environment gives or takes."""
    motion, _ = push_into(
        law, surface, controller=sampled_controller(delay=0.3), gravity=(0.0, -1.0, 0.0), substeps=20
    )
    stored = motion.kinetic + motion.elastic + motion.gravitational
    missing = stored - stored[0] - motion.hand_work - motion.motor_work
    assert np.ptp(motion.motor_work) > 1e-5
    assert np.max(np.abs(missing)) < 1e-7 * np.max(motion.kinetic)


@pytest.mark.parametrize(
    ("wall", "two_sided", "name"),
    [
        (SurfaceWall(800.0, 2.0), True, "wall"),
        (SurfaceWall(800.0, 2.0), False, "one_sided_wall"),
        (SurfaceWall(800.0, 3.0, no_pull=True), False, "one_sided_wall"),
        (SurfaceWall(800.0, -0.5), False, "one_sided_wall"),
    ],
    ids=repr,
)
def test_the_wall_of_a_stiffness_and_a_damping_is_an_environment(wall, two_sided, name):
    given = {"stiffness": wall.stiffness, "damping": wall.damping}
    values = ENVIRONMENTS[name].values(**given, **({"no_pull": 1} if wall.no_pull else {}))
    plane = Plane((0.0, 0.255), (0.2, -1.0))
    one = motion_of(FIVE_BAR, UNDAMPED, sampled_controller(), wall, replace(plane, two_sided=two_sided), **PUSHED)
    other = motion_of(
        FIVE_BAR, UNDAMPED, sampled_controller(), SurfaceEnvironment(ENVIRONMENTS[name], values), plane, **PUSHED
    )
    assert np.any(one.depth > 1e-3)
    for key in ("position", "velocity", "force", "torque", "depth", "motor_work"):
        assert np.array_equal(getattr(one, key), getattr(other, key)), key
    assert one.two_sided is other.two_sided is two_sided


def test_no_environment_acts_without_a_surface_and_none_at_a_balls_centre():
    free = motion_of(FIVE_BAR, UNDAMPED, sampled_controller(), **PUSHED)
    assert not free.two_sided
    assert not np.any(free.force)
    at = solve_posture(FIVE_BAR, (0.0, 0.25)).position
    values = ENVIRONMENTS["one_sided_wall"].values()
    inside = SurfaceEnvironment(ENVIRONMENTS["one_sided_wall"], values)
    settings = {"at": at, "duration": 0.01, "counted": False}
    motion = motion_of(FIVE_BAR, UNDAMPED, sampled_controller(), inside, Sphere(at, 0.05), **settings)
    assert motion.status == "done"
    assert np.all(np.isfinite(motion.force))


# --- what is refused, and what has no answer --------------------------------------------------------------


def test_an_environment_that_gives_no_number_ends_the_motion_there():
    wall = SurfaceEnvironment(silent, [])
    motion = motion_of(FIVE_BAR, UNDAMPED, sampled_controller(), wall, SURFACES[0], **PUSHED)
    assert motion.status == "no force"
    depth = depth_and_normal(SURFACES[0], motion.counted_position)[0]
    assert depth[-1] >= 1e-3 > np.max(depth[:-1])
    assert np.all(np.isfinite(motion.position))
    told = f"after {motion.time[-1]:.6g} s silent gave no finite force, where it was given a depth of "
    assert motion.reason.startswith(f"{told}{depth[-1]:.6g} m and ")
