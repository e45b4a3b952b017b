"""The motion of a whole mechanism held by a computer at a surface.

Whether the handle ever touches a surface.

Rendering at a surface: the Kelvin-Voigt wall, or any environment along the surface's normal.

Arguments of a mechanism's simulation, checked before it runs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from zwidth.argument import check_arguments
from zwidth.arrays import Floats
from zwidth.contact.computer import computers
from zwidth.contact.environments import ENVIRONMENTS, Environment
from zwidth.contact.mechanism import motion_kernel as kernel
from zwidth.contact.mechanism.motion import MechanismMotion
from zwidth.contact.mechanism.rendering import rendering_inputs
from zwidth.contact.mechanism.surfaces import Plane, Surface, depth_and_normal, packed
from zwidth.contact.mechanism.system import System, system_of
from zwidth.errors import ArgumentError, NoMechanismError
from zwidth.loop.controller import Controller, check_no_feedback
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, pack
from zwidth.model.posture import OK, Posture, handle_motions, solve_posture
from zwidth.model.reduction import reduce_mechanism
from zwidth.model.roadmap import roadmap
from zwidth.progress import Progress, watched
from zwidth.questions import MOVE
from zwidth.resources import check_memory

REASONS: Final = {
    kernel.DONE: ("done", ""),
    kernel.SINGULAR: ("singular", "the drives no longer hold the other joints: it is a singularity"),
    kernel.LOOP_LOST: (
        "loop lost",
        "the loops no longer close: a singularity is passed, or the steps are too long",
    ),
    kernel.DIVERGED: ("diverged", "the motion has grown beyond all numbers"),
    kernel.NO_FORCE: ("no force", "the environment gave no finite force"),
}


def simulate_mechanism(
    point: OperatingPoint,
    wall: SurfaceRendering | None = None,
    surface: Surface | None = None,
    *,
    duration: float = 1.0,
    start_velocity: ArrayLike | None = None,
    push: ArrayLike | None = None,
    gravity: ArrayLike | None = None,
    substeps: int = 4,
    counted: bool = True,
    torque_limits: Literal["each", "together"] = "each",
    seed: int = 0,
    progress: Progress | None = None,
) -> MechanismMotion:
    """Simulate how a mechanism moves on its flexible drives at a surface of any shape, or free.

    In each period the computer reads the encoders, places the handle by the kinematics of the counted angles,
    estimates its velocity, and sends to the motors the torques J^T f of the wall's force. Between samples the
    links' inertia, velocity forces and gravity act in full; the loops are closed exactly at every evaluation.

    point           the device in the posture from which the motion starts, with no drive bent. The damping matrix
                    is that of its full linear model there, kept in the coordinates of joints and motors; its
                    direction, model and operator take no part
    wall, surface   what is rendered, a `SurfaceWall` or a `SurfaceEnvironment`, and where; both or neither:
                    without them the motors stay without current
    duration        simulated time [s]
    start_velocity  (2,) or (3,)  of the handle [m/s]; joints and motors move with it
    push            (3,) force at the handle [N], or (samples, 3), each held for one period
    gravity         (3,) [m/s²]; None: none
    substeps        integration steps per sample; each is of fourth order
    counted         False: the encoders are read as finely as you like
    torque_limits   limit each motor by itself, "each", or scale all together, "together", so that the force keeps
                    its direction
    seed            of the encoders' noise
    progress        called with "simulating", the samples done, and all samples
    Returns  MechanismMotion; a motion that meets a singularity ends there, and says so
    Raises   ArgumentError  for inputs that cannot be meant, such as a surface that the handle never touches
             NoMechanismError    for a device without a mechanism
             TooLarge     (a ValueError) for more samples than the machine has memory for

    >>> import zwidth
    >>> from zwidth.contact.mechanism.surfaces import Sphere
    >>> from zwidth.contact.mechanism.simulate_mechanism import SurfaceWall
    >>> devices = (zwidth.load(name) for name, *_ in zwidth.bundled())
    >>> device = next(device for device in devices if device.mechanism and not device.missing)
    >>> hollow = Sphere(device.reference_position, radius=0.01, hollow=True)
    >>> wall = SurfaceWall(500.0, 2.0)
    >>> simulate_mechanism(device.at(), wall, hollow, duration=0.1, start_velocity=device.direction()).status
    'done'
    """
    mechanism, posture = _moved_mechanism(point)
    check_arguments(MOVE, torque_limits=torque_limits, duration=duration, substeps=substeps, seed=seed)
    environment, values = _environment_at(wall, surface)
    check_no_feedback(
        point.controller,
        "the large motion of a mechanism is not simulated",
        "simulate one rendered direction, or leave it out",
    )
    drives = len(posture.jacobian[0])
    inputs = motion_inputs(mechanism, point.controller, duration, push, gravity, substeps, drives)
    start = _MotionStart(mechanism, posture, *start_rates(posture, start_velocity))
    settings = _Settings(surface, environment, values, substeps, seed, counted, torque_limits)
    return _simulate(point, start, settings, inputs, duration, progress)


class _MotionStart(NamedTuple):
    """Mechanism and posture from which a motion starts, velocity (3,) of the handle [m/s], rates (d,) of the
    drives [rad/s]."""

    mechanism: Mechanism
    posture: Posture
    velocity: Floats
    rates: Floats


class _Settings(NamedTuple):
    """What is rendered in a motion, and how it is computed; the fields are those of `MechanismMotion`."""

    surface: Surface | None
    environment: Environment | None
    values: Floats
    substeps: int
    seed: int
    counted: bool
    torque_limits: Literal["each", "together"]


def _moved_mechanism(point: OperatingPoint) -> tuple[Mechanism, Posture]:
    """Return the mechanism that is moved, and the posture from which it starts.

    Raises  ArgumentError  for anything but one posture of one design, in reach and not singular
            NoMechanismError  for a device without a mechanism
            what `OperatingPoint.require` raises
    """
    check_kind("point", point, OperatingPoint)
    mechanism, posture = point.mechanism, point.posture
    if mechanism is None or posture is None:
        raise NoMechanismError
    point.require("dynamics", "sampling")
    if point.shape:
        raise ArgumentError(
            "", f"one posture is moved at a time, got {point.shape}; take one of them by its index"
        )
    if posture.status != OK:
        raise ArgumentError(
            "", "the posture is out of reach or singular and no motion can start there; ask for another"
        )
    if mechanism.design_shape:
        raise ArgumentError("", f"one design is simulated at a time, got a set of shape {mechanism.design_shape}")
    return mechanism, posture


def _environment_at(wall: SurfaceRendering | None, surface: Surface | None) -> tuple[Environment | None, Floats]:
    """Return the environment that is rendered at a surface, None for a free device, and its parameters (P,).

    Raises  ArgumentError  where one of the two is missing, and as `rendered_environment`
    """
    if (wall is None) != (surface is None):
        raise ArgumentError(
            "", "a wall needs a surface and a surface a wall; give both, or neither for a free device"
        )
    environment, values = None, np.zeros(0)
    if wall is not None and surface is not None:
        environment, values = rendered_environment(wall, surface)
    return environment, values


def _simulate(
    point: OperatingPoint,
    start: _MotionStart,
    settings: _Settings,
    inputs: MotionInputs,
    duration: float,
    progress: Progress | None,
) -> MechanismMotion:
    """Simulate a motion of so many seconds, and say why it ends where it ends early.

    Raises ArgumentError  for a surface that the handle never touches
    """
    surface, environment, period = settings.surface, settings.environment, point.controller.sampling_period
    system, trace, status, reached = _run(point, start, settings, inputs, progress)
    motion = MechanismMotion(
        point=point,
        surface=surface,
        environment=environment,
        values=settings.values,
        start_velocity=start.velocity,
        push=inputs.push,
        gravity=inputs.gravity,
        duration=duration,
        substeps=settings.substeps,
        seed=settings.seed,
        counted=settings.counted,
        torque_limits=settings.torque_limits,
        status="at a joint limit" if status >= kernel.AT_LIMIT else REASONS[status][0],
        reason=_reason(status, start.mechanism, max(reached - 1, 0) * period),
        **_course(system, trace, reached, period),
    )
    if status == kernel.NO_FORCE and environment is not None and surface is not None:
        return replace(motion, reason=_no_force_message(motion, environment, surface))
    return motion


def _run(
    point: OperatingPoint,
    start: _MotionStart,
    settings: _Settings,
    inputs: MotionInputs,
    progress: Progress | None,
) -> tuple[System, kernel.Trace, int, int]:
    """Compute a motion; return its equations, its records, the kernel's status and the number of samples reached.

    Raises ArgumentError  for a surface that the handle never touches
    """
    mechanism, posture, controller = start.mechanism, start.posture, point.controller
    shape, mech = packed(settings.surface), pack(mechanism)
    if settings.surface is not None:
        check_reach(mechanism, mech, posture, settings.surface)
    # any direction that the handle can move along will do: matrices and drives are the same for all
    along = np.linalg.svd(posture.jacobian)[0][:, 0]
    plant = reduce_mechanism(mechanism, posture, along, "full", point.damping, point.encoders)
    system = system_of(mech, mechanism.drives, plant, inputs.gravity, controller.actuator_time_constant)
    state = _start_state(mechanism, posture, system, start.rates)
    trace = _empty_trace(inputs.samples + 1, len(state), len(system.motor))
    read = system.motor if point.encoders == "motor" else np.arange(len(system.motor))
    address = 0 if settings.environment is None else settings.environment.address
    together = settings.torque_limits == "together"
    law = rendering_inputs(
        mechanism.drives, shape, address, settings.values, read, settings.counted, settings.seed, together
    )
    with watched(progress, "simulating", partial(_samples_done, trace), len(trace.position)):
        status, reached = kernel.run_motion(
            system, law, computers([controller], [controller.force_limit]), state, posture.angles.copy(),
            inputs.push, controller.fractional_delay, settings.substeps, trace,
        )  # fmt: skip
    return system, trace, status, reached


def _start_state(mechanism: Mechanism, posture: Posture, system: System, rates: Floats) -> Floats:
    """The first state (N,), from the drives' rates (d,) [rad/s]: joints and motors together, no drive bent, no
    lagged torque."""
    d, n = len(system.motor), len(system.damping)
    start = np.zeros(2 * n + len(system.lag_time))
    start[:d], start[n : n + d] = system.mech.to_drive[0] @ posture.angles[mechanism.drives.joint], rates
    start[system.motor], start[n + system.motor] = start[:d], rates
    return start


def _samples_done(trace: kernel.Trace) -> int:
    """Number of samples that a running motion has recorded."""
    return int(np.count_nonzero(np.isfinite(trace.position[:, 0])))


def _empty_trace(samples: int, states: int, drives: int) -> kernel.Trace:
    """Records to be filled, of so many samples, states and drives; positions are nan until they are reached."""
    k = samples
    return kernel.Trace(
        state=np.empty((k, states)),
        position=np.full((k, 3), np.nan),  # which says how far a run is
        counted_position=np.empty((k, 3)),
        velocity=np.empty((k, 3)),
        force=np.empty((k, 3)),
        torque=np.empty((k, drives)),
        depth=np.empty(k),
        energy=np.empty((k, 3)),
        work=np.empty((k, 3)),
    )


def _course(system: System, trace: kernel.Trace, reached: int, period: float) -> dict[str, Floats]:
    """The records of the samples that were reached, by their names in `MechanismMotion`; period  T [s].

    The work of motors that lag is nan: it is not recorded.
    """
    d, n, motor, to_joint = len(system.motor), len(system.damping), system.motor, system.mech.to_joint[0]
    state, energy, work = trace.state[:reached], trace.energy[:reached], trace.work[:reached]
    lagging = np.any(system.lag_command >= 0)
    return {
        "time": np.arange(reached, dtype=np.float64) * period,
        "position": trace.position[:reached],
        "counted_position": trace.counted_position[:reached],
        "velocity": trace.velocity[:reached],
        "depth": trace.depth[:reached],
        "joints": state[:, :d] @ to_joint.T,
        "motors": state[:, motor].copy(),
        "joint_rates": state[:, n : n + d] @ to_joint.T,
        "motor_rates": state[:, n + motor].copy(),
        "force": trace.force[:reached],
        "torque": trace.torque[:reached],
        "kinetic": energy[:, kernel.KINETIC],
        "elastic": energy[:, kernel.ELASTIC],
        "gravitational": energy[:, kernel.GRAVITATIONAL],
        "hand_work": work[:, kernel.BY_HAND],
        "motor_work": np.full(reached, np.nan) if lagging else work[:, kernel.BY_MOTORS],
        "friction_loss": work[:, kernel.AGAINST_FRICTION],
    }


def _reason(status: int, mechanism: Mechanism, seconds: float) -> str:
    """Why a motion with this status ends before its time, after so many seconds; "" where it does not."""
    if status >= kernel.AT_LIMIT:  # plus the number of the link whose joint is at its limit
        # without what tells the links of a joint with several coordinates apart
        joint = mechanism.links.names[status - kernel.AT_LIMIT].partition("/")[0]
        return f"after {seconds:.6g} s joint {joint!r} is at its limit, beyond which nothing is known of the stop"
    reason = REASONS[status][1]
    if status == kernel.LOOP_LOST and not len(mechanism.closures.names):  # an open chain has no loops to close
        reason = "it moves farther between two steps than can be followed; push less hard, or take more substeps"
    return reason and f"after {seconds:.6g} s {reason}"


def _no_force_message(motion: MechanismMotion, environment: Environment, surface: Surface) -> str:
    """Message about the last sample, at which the environment gave no finite force."""
    depth, normal = depth_and_normal(surface, motion.counted_position[-1])
    rate = -float(normal @ motion.velocity[-1])
    return (
        f"after {motion.time[-1]:.6g} s {environment.name} gave no finite force, where it was given a depth of "
        f"{float(depth):.6g} m and {rate:.6g} m/s"
    )


TRIED: Final = 64  # postures nearest to the surface from which it is tried to touch it
REACHES: Final = 4  # times that each goes on from where it got nearest


def check_reach(mechanism: Mechanism, mech: MechanismArrays, posture: Posture, surface: Surface) -> None:
    """Raise ArgumentError unless the handle can touch the surface in the posture's assembly.

    All postures of the assembly are known coarsely (`model.roadmap`). Where none of them is inside the wall, the
    ones nearest to it are taken to the point of the surface that they are nearest to.
    """
    road = roadmap(mech, 0, np.ascontiguousarray(posture.angles))
    known = np.concatenate([posture.position[None], road.position])
    depth, normal = depth_and_normal(surface, known)
    if np.max(depth) >= 0.0:
        return
    best = np.argsort(-depth)[:TRIED]
    nearest, least = known[best[0]], -depth[best[0]]
    at, depth, normal = known[best], depth[best], normal[best]
    plane = handle_motions(posture)  # orthonormal columns
    for _ in range(REACHES):
        # ways: the normals' parts that the handle can move along; gain: by how much the depth falls along one of
        # them
        ways = normal @ plane @ plane.T
        gain = np.sum(ways * normal, axis=1)
        reachable = gain > 1e-9  # elsewhere the handle cannot move towards the surface at all
        if not reachable.any():
            break
        # depths are negative here: the goals lie against the normal, where a flat surface has the depth 0
        goals = at[reachable] + (depth[reachable] / gain[reachable])[:, None] * ways[reachable]
        solved = solve_posture(mechanism, goals, posture.assembly)
        if np.any(solved.status == OK):
            at, depth = goals[solved.status == OK], depth_and_normal(surface, goals[solved.status == OK])[0]
            normal = depth_and_normal(surface, at)[1]
            # touched to within a nanometre
            if np.max(depth) > -1e-9:
                return
        else:
            break
    where = "(" + ", ".join(f"{x:.4g}" for x in nearest) + ") m"
    raise ArgumentError(
        "surface",
        f"the handle never touches the surface in assembly {posture.assembly!r}: of the postures tried the "
        f"closest is about {least:.3g} m away, at {where}; move the surface into the workspace",
    )


@dataclass(frozen=True)
class SurfaceWall:
    """A Kelvin-Voigt wall at a surface: f = (K depth + B depth') normal, inside only or on both sides of a plane.

    stiffness K [N/m];   damping B [N s/m], of either sign
    no_pull   True: the wall never pulls the handle in
    """

    stiffness: float
    damping: float = 0.0
    no_pull: bool = False


@dataclass(frozen=True)
class SurfaceEnvironment:
    """Any environment at a surface, along its normal: f = -F(depth, depth', ...) normal.

    The environment's position is the depth behind the surface, its velocity the depth's estimated rate, and its
    force F acts along the way in, as in the simulation of one direction. What the law says of a motion along a
    texture, a grating or a rubbing patch it says of the motion along the normal.

    environment   what is rendered;   values (P,) of its parameters, as `Environment.values` gives them
    """

    environment: Environment
    values: ArrayLike


SurfaceRendering = SurfaceWall | SurfaceEnvironment


def rendered_environment(wall: SurfaceRendering, surface: Surface) -> tuple[Environment, Floats]:
    """The environment that renders a wall at this surface, and its parameters. Raises ArgumentError."""
    if not isinstance(surface, Surface):
        raise ArgumentError("surface", f"must be a Plane, a Sphere or a Box, got {type(surface).__name__}")
    two_sided = isinstance(surface, Plane) and surface.two_sided
    if isinstance(wall, SurfaceEnvironment):
        return wall.environment, _values(wall, two_sided)
    if not isinstance(wall, SurfaceWall):
        raise ArgumentError("wall", f"must be a SurfaceWall or a SurfaceEnvironment, got {type(wall).__name__}")
    if not (isfinite(wall.stiffness) and wall.stiffness >= 0.0):
        raise ArgumentError("wall", f"its stiffness must be at least 0 and finite [N/m], got {wall.stiffness}")
    if not isfinite(wall.damping):
        raise ArgumentError("wall", f"its damping must be finite [N s/m], of either sign, got {wall.damping}")
    if two_sided and wall.no_pull:
        raise ArgumentError("", "a two-sided plane always pulls; leave out no_pull or two_sided")
    gains = {"stiffness": float(wall.stiffness), "damping": float(wall.damping)}
    if two_sided:
        return ENVIRONMENTS["wall"], ENVIRONMENTS["wall"].values(**gains)
    one_sided = ENVIRONMENTS["one_sided_wall"]
    return one_sided, one_sided.values(**gains, no_pull=float(wall.no_pull))


def _values(wall: SurfaceEnvironment, two_sided: bool) -> Floats:
    """Parameters (P,) of an environment. Raises ArgumentError for another number of them, or a two-sided plane."""
    names, values = wall.environment.names, np.array(wall.values, dtype=np.float64)
    if values.shape != (len(names),):
        raise ArgumentError(
            "",
            f"{wall.environment.name} takes {len(names)} values ({', '.join(names) or 'none'}), got an array of "
            f"shape {values.shape}; make it by Environment.values",
        )
    if two_sided:
        raise ArgumentError(
            "",
            f"two_sided is of a SurfaceWall; {wall.environment.name} says itself on which sides of the surface it "
            "acts: leave two_sided out",
        )
    return values


ALONG: Final = 1e-9  # share of a velocity that may be beside what the handle can do


@dataclass(frozen=True)
class MotionInputs:
    """Checked arguments of a motion.

    samples  periods that it lasts;   push (1 or samples, 3) [N];   gravity (3,) [m/s²]
    """

    samples: int
    push: Floats
    gravity: Floats


def motion_inputs(
    mechanism: Mechanism,
    controller: Controller,
    duration: float,
    push: ArrayLike | None,
    gravity: ArrayLike | None,
    substeps: int,
    drives: int,
) -> MotionInputs:
    """Number of samples, push and gravity of a motion. Raises ArgumentError for what cannot be simulated.

    duration  [s];   push, gravity  as in `simulate_mechanism`;   drives  their number;   substeps take no part
    """
    # 1e-9: a whole number of periods that rounding has made a little longer gets no sample more
    samples = int(np.ceil(duration / controller.sampling_period - 1e-9))
    check_memory(
        # numbers that are kept of each sample, roughly
        samples * (23.0 + 12.0 * drives),
        f"{samples} samples of a motion of {duration:g} s",
        "simulate a shorter one",
    )
    _check_drives(mechanism)
    _check_friction(mechanism)
    return MotionInputs(samples, _push_array(push, samples), _gravity_vector(gravity))


def start_rates(posture: Posture, velocity: ArrayLike | None) -> tuple[Floats, Floats]:
    """The handle's velocity (3,) [m/s], and the drives' rates (d,) that give it [rad/s].

    Raises ArgumentError  for a velocity that the handle cannot have
    """
    J = posture.jacobian
    if velocity is None:
        return np.zeros(3), np.zeros(J.shape[1])
    given = _vector("start_velocity", velocity, "m/s")
    rates = np.linalg.lstsq(J, given, rcond=None)[0]
    left = float(np.linalg.norm(J @ rates - given))
    if left > ALONG * float(np.linalg.norm(given)):
        raise ArgumentError(
            "start_velocity",
            f"the handle cannot move with {given.tolist()} m/s: {left:.3g} m/s of it is across "
            "what the drives can do; give a velocity within the mechanism's plane of motion",
        )
    return given, np.asarray(rates)


def _check_drives(mechanism: Mechanism) -> None:
    """Raise ArgumentError for what the motion of a whole mechanism leaves out."""
    drives, links = mechanism.drives, mechanism.links
    present = {
        "links that bend": bool(mechanism.flexible),
        "joints that nobody drives or holds": bool(mechanism.free),
        "more drives than degrees of freedom": bool(drives.surplus),
        "rotors that turn with their links": drives.motor_link is not None,
        "a transmission whose ratio changes": drives.ratio_tables is not None,
        "springs of the joints themselves": links.joint_stiffness is not None,
        "dry friction of the joints themselves": links.joint_coulomb is not None,
    }
    named = [name for name, there in present.items() if there]
    if named:
        raise ArgumentError(
            "",
            f"the motion of a whole mechanism is not simulated with {' and '.join(named)}; simulate the plant of "
            "one direction instead",
        )


def _check_friction(mechanism: Mechanism) -> None:
    """Raise ArgumentError for a drive with an impossible Coulomb friction, or with a programmable brake."""
    parts = mechanism.drives.nonlinearity
    if parts is None:
        return
    for name, level in zip(mechanism.drives.names, parts.coulomb, strict=True):
        if not (isfinite(level) and level >= 0.0):
            raise ArgumentError(
                "", f"drive {name!r}: coulomb friction must be at least 0 and finite [N m], got {level}"
            )
    if np.any(parts.brake_damping > 0.0):
        name = mechanism.drives.names[int(np.argmax(parts.brake_damping > 0.0))]
        raise ArgumentError(
            "",
            f"drive {name!r} has a programmable brake, which nothing commands in the motion of a whole mechanism; "
            "leave it out, or simulate the direction's plant",
        )


def _push_array(push: ArrayLike | None, samples: int) -> Floats:
    """Force at the handle, (1, 3) for all samples or (samples, 3) [N]; 0 for None. Raises ArgumentError."""
    if push is None:
        return np.zeros((1, 3))
    given = np.array(push, dtype=np.float64, order="C")
    if given.ndim == 2 and given.shape != (samples, 3):
        raise ArgumentError(
            "push", f"must be one force (3,) or one for each sample, ({samples}, 3), got an array of {given.shape}"
        )
    if given.ndim != 2:
        return _vector("push", given, "N")[None]
    if not np.all(np.isfinite(given)):
        raise ArgumentError(
            "push", f"must be finite [N]; row {int(np.argmin(np.isfinite(given).all(axis=1)))} is not"
        )
    return given


def _gravity_vector(gravity: ArrayLike | None) -> Floats:
    """Gravity (3,) [m/s²]; 0 for None. Raises ArgumentError."""
    return np.zeros(3) if gravity is None else _vector("gravity", gravity, "m/s²")


def _vector(what: str, value: ArrayLike, unit: str) -> Floats:
    """Vector (3,) of two or three finite numbers. Raises ArgumentError about `what` for others."""
    given = np.array(value, dtype=np.float64)
    if given.shape not in ((2,), (3,)) or not np.all(np.isfinite(given)):
        raise ArgumentError(what, f"must be two or three finite numbers [{unit}], got {given.tolist()}")
    return np.append(given, np.zeros(3 - given.size))
