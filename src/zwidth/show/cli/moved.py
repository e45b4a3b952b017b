"""A whole mechanism moved, and its numbers for programs and tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, cast

from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.surface_options import along

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zwidth.contact.environments import Environment
    from zwidth.contact.mechanism.simulate import MechanismMotion
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.device.device import Device
    from zwidth.model.mechanism import Mechanism
    from zwidth.model.posture import Posture
    from zwidth.show.cli.options import Question
    from zwidth.show.cli.surface_options import Motion

    Floats = NDArray[np.float64]

AXES: Final = "xyz"
OPERATOR: Final = "the operator"
AT_LIMIT: Final = 1.0 - 1e-12
AS_TEXT: Final = 6  # numbers' worth of memory that one takes as text
SHOWN: Final = (17, 3)  # numbers shown of each sample, and as many more for each drive


@dataclass(frozen=True)
class Moved:
    """One motion.

    posture                        at the start
    environment, values            what is rendered at the surface, and its parameters; None without a surface
    push, start_velocity, gravity  (3,) [N], [m/s], [m/s^2]
    """

    device: Device
    mechanism: Mechanism
    asked: Motion
    posture: Posture
    surface: Surface | None
    environment: Environment | None
    values: Floats | None
    push: Floats
    start_velocity: Floats
    gravity: Floats
    motion: MechanismMotion


def facts(question: Question, device: Device) -> dict[str, Any]:
    """What a motion is asked of. Its direction is only that of a push, and nobody holds the handle but by it."""
    known = question.circumstances(device) | {"operator": None}
    return known | {"left_out": [OPERATOR] if device.operator is not None else []}


def moved(question: Question, device: Device, asked: Motion) -> Moved:
    """Move the mechanism. Raises NoAnswer, BadInput."""
    from zwidth.contact.mechanism.checks import MotionError
    from zwidth.contact.mechanism.reach import SurfaceOutOfReach
    from zwidth.contact.mechanism.simulate import simulate_mechanism
    from zwidth.contact.mechanism.walls import rendered_environment
    from zwidth.contact.room import TooLarge, check_room

    mechanism = device.mechanism
    assert mechanism is not None
    direction = device.direction(question.direction)
    surface, wall = asked.surface(device), asked.wall()
    push, velocity = along(asked.push, direction), along(asked.start_velocity, direction)
    gravity = along(asked.gravity, direction)
    drives = len(mechanism.drives.names)
    samples = asked.duration / device.controller.sampling_period
    with computing(question):
        posture = question.point(device).posture
        assert posture is not None
        try:
            told = samples * (SHOWN[0] + SHOWN[1] * drives)
            check_room((1 + AS_TEXT) * told, f"{samples:.4g} samples", "move for a shorter time")
            environment, values = None, None
            if wall is not None and surface is not None:
                environment, values = rendered_environment(wall, surface)
            motion = simulate_mechanism(
                mechanism,
                device.damping,
                device.controller,
                wall,
                surface,
                at=posture.position,
                assembly=posture.assembly,
                duration=asked.duration,
                start_velocity=velocity,
                push=push,
                gravity=gravity,
                substeps=asked.substeps,
                counted=not asked.exact,
                encoders=device.encoders,
                torque_limits=cast("Literal['each', 'together']", asked.torque_limits),
                seed=asked.seed,
            )
        except TooLarge as error:
            raise BadInput(f"--duration: {error}") from None
        except SurfaceOutOfReach as error:
            raise BadInput(f"{asked.option}: {error}") from None
        except MotionError as error:
            option = "--start-velocity: " if "start_velocity" in str(error) else ""
            raise BadInput(f"{question.name}: {option}{error}") from None
    if not len(motion.time):
        raise NoAnswer(_reason(mechanism, motion.reason))
    if motion.status == "no force":
        raise NoAnswer(f"{motion.reason}; have it return a number there")
    scene = (device, mechanism, asked, posture, surface, environment, values)
    return Moved(*scene, push, velocity, gravity, motion)


def numbers(found: Moved) -> dict[str, Any]:
    """What came of it under the keys of --json."""
    asked, motion = found.asked, found.motion
    return {
        "surface": _surface(found.surface, motion.two_sided),
        **_environment(found),
        "push_N": found.push,
        "start_velocity_m_per_s": found.start_velocity,
        "gravity_m_per_s2": found.gravity,
        "torque_limits": asked.torque_limits,
        "encoders_counted": not asked.exact,
        "substeps": asked.substeps,
        "seed": asked.seed,
        "duration_asked_s": asked.duration,
        "duration_s": float(motion.time[-1]),
        "status": motion.status,
        "ended_because": _reason(found.mechanism, motion.reason) or None,
        "started_inside": motion.started_inside if found.surface is not None else None,
        **_extremes(found),
        "energy_book_J": energy_book(motion),
        **_in_time(found),
    }


def _reason(mechanism: Mechanism, reason: str) -> str:
    """Why a motion ended; of an open chain, which has no loops to close, that it is no longer followed."""
    if reason and not len(mechanism.closures.names) and "loops" in reason:
        return "it moves farther between two steps than can be followed: push less hard, or take more --substeps"
    return reason


def _environment(found: Moved) -> dict[str, Any]:
    """What is rendered at the surface."""
    environment, parameters = found.environment, dict[str, float]()
    if environment is not None and found.values is not None:
        parameters = dict(zip(environment.names, found.values.tolist(), strict=True))
    return {
        "environment": environment and environment.name,
        "parameters": environment and parameters,
        "wall_stiffness_N_per_m": parameters.get("stiffness"),
        "wall_damping_Ns_per_m": parameters.get("damping"),
        "no_pull": environment and bool(parameters.get("no_pull")),
    }


def _surface(surface: Surface | None, two_sided: bool) -> dict[str, Any] | None:
    from zwidth.contact.mechanism.surfaces import Box, Plane

    match surface:
        case None:
            return None
        case Plane():
            return {
                "kind": "plane",
                "point_m": surface.point,
                "normal": surface.normal,
                "two_sided": two_sided,
            }
        case Box():
            kind: dict[str, Any] = {"kind": "box", "center_m": surface.center, "half_sizes_m": surface.half_sizes}
        case _:
            kind = {"kind": "sphere", "center_m": surface.center, "radius_m": surface.radius}
    return kind | {"hollow": surface.hollow}


def _extremes(found: Moved) -> dict[str, Any]:
    """The largest of the motion, and shares of its samples."""
    import numpy as np

    motion, drives = found.motion, found.mechanism.drives
    limit = drives.transmission * drives.torque_limit
    size = np.linalg.norm(motion.force, axis=1)
    reached = np.mean(np.abs(motion.torque) >= AT_LIMIT * limit, axis=0)
    if found.surface is None:
        deepest, touching, largest = None, None, None
    else:
        depth = np.abs(motion.depth) if motion.two_sided else np.maximum(motion.depth, 0.0)
        deepest, largest = float(depth.max()), float(size.max())
        touching = 1.0 if motion.two_sided else float(np.mean(motion.depth > 0.0))
    forced = float(np.mean(size >= AT_LIMIT * found.device.controller.saturation))
    return {
        "largest_penetration_m": deepest,
        "largest_force_N": largest,
        "contact_share": touching,
        "torque_limit_share": dict(zip(drives.names, reached.tolist(), strict=True)),
        "force_limit_share": forced,
    }


def energy_book(motion: MechanismMotion) -> dict[str, float]:
    """What each has put in by the end, and what of it is stored more than at the start [J].

    Dampers have what the others leave; nan where the motors' work is not known.
    """
    stored = motion.kinetic + motion.elastic
    put = {
        "hand": float(motion.hand_work[-1]),
        "motors": float(motion.motor_work[-1]),
        "gravity": float(motion.gravitational[0] - motion.gravitational[-1]),
        "friction": -float(motion.friction_loss[-1]),
    }
    more = float(stored[-1] - stored[0])
    return put | {"dampers": more - sum(put.values()), "stored": more}


def _in_time(found: Moved) -> dict[str, Any]:
    motion, drives, links = found.motion, found.mechanism.drives, found.mechanism.links
    joints = [links.names[joint] for joint in drives.joint]
    return {
        "time_s": motion.time,
        "position_m": motion.position,
        "counted_position_m": motion.counted_position,
        "depth_m": motion.depth,
        "force_N": motion.force,
        "torque_Nm": dict(zip(drives.names, motion.torque.T, strict=True)),
        "joint_rad": dict(zip(joints, motion.joints.T, strict=True)),
        "motor_rad": dict(zip(drives.names, motion.motors.T, strict=True)),
        "kinetic_J": motion.kinetic,
        "elastic_J": motion.elastic,
        "gravitational_J": motion.gravitational,
        "hand_work_J": motion.hand_work,
        "motor_work_J": motion.motor_work,
        "friction_loss_J": motion.friction_loss,
    }


def columns(document: dict[str, Any]) -> dict[str, Any]:
    """The motion in time as columns, one for each component."""

    def parts(key: str, name: str) -> dict[str, Any]:
        return {name.format(axis): document[key][:, k] for k, axis in enumerate(AXES)}

    def each(key: str, name: str) -> dict[str, Any]:
        return {name.format(own): values for own, values in document[key].items()}

    scalars = [key for key in document if key.endswith("_J") and key != "energy_book_J"]
    return {
        "time_s": document["time_s"],
        **parts("position_m", "{}_m"),
        **parts("counted_position_m", "counted_{}_m"),
        "depth_m": document["depth_m"],
        **parts("force_N", "force_{}_N"),
        **each("torque_Nm", "torque_{}_Nm"),
        **each("joint_rad", "joint_{}_rad"),
        **each("motor_rad", "motor_{}_rad"),
        **{key: document[key] for key in scalars},
    }
