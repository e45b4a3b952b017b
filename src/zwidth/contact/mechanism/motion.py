"""The motion of a whole mechanism: what was simulated, its course in time, and its numbers by key and unit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.contact.environments.environment import Environment
from zwidth.contact.mechanism.surfaces import Surface, surface_document
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.mechanism import Mechanism
from zwidth.model.posture import Posture
from zwidth.result import Result

AXES: Final = "xyz"
AT_LIMIT: Final = 1.0 - 1e-12  # share of a limit from which a force or torque was cut to it


@dataclass(frozen=True, repr=False)
class MechanismMotion(Result):
    """A motion of a whole mechanism sampled by its computer; k samples from the start on, or none.

    Input:

    point            the device in the posture that the motion starts from; its operator takes no part
    surface          what the handle meets; None: nothing
    environment      what is rendered at the surface;   values (P,) of its parameters. None without a surface
    start_velocity   (3,) of the handle [m/s]
    push             (1, 3) force at the handle, or one for each sampling period, held throughout it [N]
    gravity          (3,) [m/s²]
    duration         requested [s];   substeps between samples;   seed of the encoders' noise
    counted          are the encoders read in counts, with noise?
    torque_limits    "each" or "together", as simulated

    Result:

    time             (k,) [s]
    position         (k, 3)  where the handle is [m]
    counted_position (k, 3)  where the computer sees it, the kinematics of the counted angles [m]
    velocity         (k, 3)  of the handle as the computer estimates it [m/s]
    depth            (k,)    how deep it truly is in the wall, negative outside; -inf without a surface [m]
    joints, motors   (k, d)  driven joints' angles, and the motors' at the joint [rad]
    joint_rates, motor_rates (k, d)  [rad/s]
    force            (k, 3)  on the handle, as commanded [N]
    torque           (k, d)  as commanded, at the joint [N m]
    kinetic, elastic, gravitational (k,)  energies [J]; the last against the base frame's origin
    hand_work, motor_work, friction_loss (k,)  since the start [J]; motor_work is nan with a lagging actuator
    status           "done", or why the motion stops: "singular", "loop lost", "diverged", "no force", "at a joint
                     limit"; reason in words
    """

    point: OperatingPoint
    surface: Surface | None
    environment: Environment | None
    values: Floats
    start_velocity: Floats
    push: Floats
    gravity: Floats
    duration: float
    substeps: int
    seed: int
    counted: bool
    torque_limits: str
    time: Floats
    position: Floats
    counted_position: Floats
    velocity: Floats
    depth: Floats
    joints: Floats
    motors: Floats
    joint_rates: Floats
    motor_rates: Floats
    force: Floats
    torque: Floats
    kinetic: Floats
    elastic: Floats
    gravitational: Floats
    hand_work: Floats
    motor_work: Floats
    friction_loss: Floats
    status: str
    reason: str

    @property
    def mechanism(self) -> Mechanism:
        """What moves."""
        assert self.point.mechanism is not None
        return self.point.mechanism

    @property
    def start(self) -> Posture:
        """The posture at the start."""
        assert self.point.posture is not None
        return self.point.posture

    @property
    def started_inside(self) -> bool:
        """Whether the handle was inside the wall at the start."""
        return bool(len(self.depth) and self.depth[0] > 0.0)

    @property
    def two_sided(self) -> bool:
        """Whether the wall acts on both sides of the surface alike."""
        return self.environment is not None and self.environment.linear

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the environment's parameters by name; none without a surface."""
        names = () if self.environment is None else self.environment.names
        return dict(zip(names, self.values.tolist(), strict=True))

    @cached_property
    def force_size(self) -> Floats:
        """(k,) the commanded force on the handle [N]"""
        return np.asarray(np.linalg.norm(self.force, axis=1))

    @property
    def penetration(self) -> Floats:
        """(k,) how deep the handle is in the wall, from either side of a two-sided one, 0 outside [m]"""
        return np.abs(self.depth) if self.two_sided else np.maximum(self.depth, 0.0)

    @property
    def contact_share(self) -> float:
        """Share of the samples within the wall; 1 for a two-sided one, which acts everywhere."""
        return 1.0 if self.two_sided else _share(self.depth > 0.0)

    @property
    def torque_limit_share(self) -> dict[str, float]:
        """Share of the samples at which each drive is at its torque limit, by the drive's name."""
        drives = self.mechanism.drives
        reached = np.abs(self.torque) >= AT_LIMIT * drives.transmission * drives.torque_limit
        return dict(zip(drives.names, map(_share, reached.T), strict=True))

    @property
    def force_limit_share(self) -> float:
        """Share of the samples at which the force was cut to its limit."""
        return _share(self.force_size >= AT_LIMIT * self.point.controller.force_limit)

    @property
    def energy_book(self) -> dict[str, float]:
        """Energy that each source has supplied by the end, and increase of the stored energy [J].

        Dampers have what the others leave; nan where the motors' work is not known, and without samples.
        """
        if not len(self.time):
            return dict.fromkeys(("hand", "motors", "gravity", "friction", "dampers", "stored"), np.nan)
        stored = self.kinetic + self.elastic
        supplied = {
            "hand": float(self.hand_work[-1]),
            "motors": float(self.motor_work[-1]),
            "gravity": float(self.gravitational[0] - self.gravitational[-1]),
            "friction": -float(self.friction_loss[-1]),
        }
        increase = float(stored[-1] - stored[0])
        return supplied | {"dampers": increase - sum(supplied.values()), "stored": increase}

    # --- as data --------------------------------------------------------------------------------------

    def document(self) -> dict[str, Any]:
        """Everything by key and unit; None where inapplicable."""
        touches, parameters = self.surface is not None, self.parameters
        return {
            "surface": None if self.surface is None else surface_document(self.surface, self.two_sided),
            "environment": self.environment and self.environment.name,
            "parameters": parameters if touches else None,
            "wall_stiffness_N_per_m": parameters.get("stiffness"),
            "wall_damping_Ns_per_m": parameters.get("damping"),
            "no_pull": bool(parameters.get("no_pull")) if touches else None,
            "push_N": self.push[0] if len(self.push) == 1 else self.push[: len(self.time)],
            "start_velocity_m_per_s": self.start_velocity,
            "gravity_m_per_s2": self.gravity,
            "torque_limits": self.torque_limits,
            "encoders_counted": self.counted,
            "substeps": self.substeps,
            "seed": self.seed,
            "duration_asked_s": self.duration,
            "duration_s": float(self.time[-1]) if len(self.time) else None,
            "status": self.status,
            "ended_because": self.reason or None,
            "started_inside": self.started_inside if touches else None,
            "largest_penetration_m": _largest(self.penetration) if touches else None,
            "largest_force_N": _largest(self.force_size) if touches else None,
            "contact_share": self.contact_share if touches else None,
            "torque_limit_share": self.torque_limit_share,
            "force_limit_share": self.force_limit_share,
            "energy_book_J": self.energy_book,
            "time_s": self.time,
            "position_m": self.position,
            "counted_position_m": self.counted_position,
            "depth_m": self.depth,
            "force_N": self.force,
            **self._drive_series(),
            **self._energies(),
        }

    def table(self) -> dict[str, Floats]:
        """The motion in time as columns, one for each component."""

        def parts(values: Floats, name: str) -> dict[str, Floats]:
            """Columns of a vector's components (k, 3), each named by its axis in place of {} in `name`."""
            return {name.format(axis): values[:, k] for k, axis in enumerate(AXES)}

        drives = {
            f"{quantity}_{name}_{unit}": values
            for key, by_name in self._drive_series().items()
            for quantity, _, unit in [key.partition("_")]  # the drive's name goes in between
            for name, values in by_name.items()
        }
        return {
            "time_s": self.time,
            **parts(self.position, "{}_m"),
            **parts(self.counted_position, "counted_{}_m"),
            "depth_m": self.depth,
            **parts(self.force, "force_{}_N"),
            **drives,
            **self._energies(),
        }

    def _drive_series(self) -> dict[str, dict[str, Floats]]:
        """Torques and motor angles (k,) by drive, joint angles by the link that the drive turns; by key."""
        drives, links = self.mechanism.drives, self.mechanism.links
        joints = [links.names[joint] for joint in drives.joint]
        return {
            "torque_Nm": dict(zip(drives.names, self.torque.T, strict=True)),
            "joint_rad": dict(zip(joints, self.joints.T, strict=True)),
            "motor_rad": dict(zip(drives.names, self.motors.T, strict=True)),
        }

    def _energies(self) -> dict[str, Floats]:
        """Energy and work at each sample by key [J]."""
        return {
            "kinetic_J": self.kinetic,
            "elastic_J": self.elastic,
            "gravitational_J": self.gravitational,
            "hand_work_J": self.hand_work,
            "motor_work_J": self.motor_work,
            "friction_loss_J": self.friction_loss,
        }

    def __repr__(self) -> str:
        """Lines with what was simulated and how it ended; with samples also where the handle went, and at a
        surface the largest depth and force."""
        met = "free" if self.surface is None else f"at a {type(self.surface).__name__.lower()}"
        if self.environment is not None:
            met += f" that renders {self.environment.name}"
        first = f"MechanismMotion of {self.point.name or 'a mechanism'}, {met}: {self.status}"
        if not len(self.time):
            return f"{first}\n  {self.reason}"
        start, end = (", ".join(f"{x:.4g}" for x in self.position[n]) for n in (0, -1))
        lines = [
            first,
            f"  {len(self.time)} samples, {self.time[-1]:.4g} s, {self.substeps} substeps between them",
            f"  handle from ({start}) to ({end}) m",
        ]
        if self.surface is not None:
            deepest, largest = _largest(self.penetration), _largest(self.force_size)
            lines.append(f"  deepest {deepest:.4g} m, largest force {largest:.4g} N")
        return "\n".join([*lines, *([f"  {self.reason}"] if self.reason else [])])


def _share(flags: Flags) -> float:
    """Share of the samples at which something holds; nan without samples."""
    return float(np.mean(flags)) if len(flags) else np.nan


def _largest(values: Floats) -> float:
    """The largest of the values that are not nan, as a force that the environment did not give is; nan without."""
    known = values[~np.isnan(values)]
    return float(known.max()) if len(known) else np.nan
