"""Arguments of a mechanism's simulation, checked before it runs."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from numbers import Real
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.errors import ArgumentError
from zwidth.loop.controller import Controller
from zwidth.memory_limit import check_memory
from zwidth.model.mechanism import Mechanism
from zwidth.model.posture import Posture

ALONG: Final = 1e-9  # share of a velocity that may be beside what the handle can do
MOST_SUBSTEPS: Final = 100_000


@dataclass(frozen=True)
class MotionInputs:
    """samples: periods that the motion lasts;   push (1 or samples, 3) [N];   gravity (3,) [m/s^2]"""

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
    """The numbers of a motion. Raises ArgumentError."""
    if not (isinstance(duration, Real) and isfinite(duration) and duration > 0.0):
        raise ArgumentError("duration", f"must be positive and finite, in seconds, got {duration!r}")
    if not (isinstance(substeps, int | np.integer) and 1 <= substeps <= MOST_SUBSTEPS):
        raise ArgumentError("substeps", f"must be a whole number from 1 to {MOST_SUBSTEPS}, got {substeps}")
    samples = int(np.ceil(duration / controller.sampling_period - 1e-9))
    check_memory(
        samples * (23.0 + 12.0 * drives),
        f"{samples} samples of a motion of {duration:g} s",
        "simulate a shorter one",
    )
    _check_drives(mechanism)
    _check_friction(mechanism)
    return MotionInputs(samples, _push(push, samples), _gravity(gravity))


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


def _push(push: ArrayLike | None, samples: int) -> Floats:
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


def _gravity(gravity: ArrayLike | None) -> Floats:
    return np.zeros(3) if gravity is None else _vector("gravity", gravity, "m/s^2")


def _vector(what: str, value: ArrayLike, unit: str) -> Floats:
    given = np.array(value, dtype=np.float64)
    if given.shape not in ((2,), (3,)) or not np.all(np.isfinite(given)):
        raise ArgumentError(what, f"must be two or three finite numbers [{unit}], got {given.tolist()}")
    return np.append(given, np.zeros(3 - given.size))
