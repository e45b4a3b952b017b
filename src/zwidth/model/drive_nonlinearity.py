"""Nonlinear parts of a mechanism's drives, at the joints: friction, counters, springs, brakes, a force limit.

A number at the motor is referred to the joint by the transmission's ratio n: a torque by n, a stiffness or damping
by n^2, a torque per angle cubed by n^4, an angle by 1/n.
"""

from __future__ import annotations

from math import inf

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.mechanism import DriveNonlinearity, Drives
from zwidth.model.nonlinear import Brake, Counter, Friction, Nonlinear, Spring


def nonlinear_of_drives(
    drives: Drives,
    h: Floats,
    links: Floats,
    motors: Floats,
    encoders: Floats,
    bent: Floats | None = None,
    backward: bool = False,
) -> Nonlinear:
    """All of it in a plant whose coordinates are joint angles.

    friction     n C on the motor's coordinate, its bristles n^2 as stiff
    counters     2 pi/(N n) of what is counted, each weighed by h_i: their sum is the handle's reading h . counted
    springs      with d = theta - phi, n^4 k_3 d^3, and for d < -T_p/(n k) what n^2 times the backward stiffness is
                 above n^2 times the other: forward is where the motor is ahead of the joint, T_p the preload
    brakes       n^2 b on the motor's coordinate
    force_limit  min_i n_i tau_i/|h_i|: the largest force along the direction that no motor's limit cuts. Beyond
                 it all torques are scaled alike, so that the force keeps its direction

    h         (d,)    J^T u, torques at the joints per force along the direction
    links     (d, n)  row i: the coordinate that turns with the link of drive i
    motors    (d, n)  row i: the one that turns with its motor; of a rigid drive the same
    encoders  (d, n)  row i: the one that its encoder counts, either of them
    bent      (d,)  deflections of the springs under load;   backward  whether one that is not bent is tangent to
              the other branch; None: no load
    """
    n, dry = drives.transmission, drives.nonlinearity
    pulled = h != 0.0
    limits = n[pulled] * drives.torque_limit[pulled] / np.abs(h[pulled])
    return Nonlinear(
        friction=() if dry is None else _friction(n, dry, motors),
        counters=_counters(drives, h, encoders),
        springs=() if dry is None else _springs(drives, dry, motors - links, bent, backward),
        brakes=() if dry is None else _brakes(n, dry, motors),
        force_limit=float(np.min(limits, initial=inf)),
    )


def _friction(n: Floats, dry: DriveNonlinearity, motors: Floats) -> tuple[Friction, ...]:
    return tuple(
        Friction(
            along=motors[i],
            coulomb=float(n[i] * dry.coulomb[i]),
            model=dry.friction_model,
            bristle_stiffness=float(n[i] ** 2 * dry.bristle_stiffness),
            bristle_damping=float(n[i] ** 2 * dry.bristle_damping),
            breakaway=float(n[i] * dry.breakaway[i]),
            stribeck_velocity=float(dry.stribeck_velocity / n[i]),
        )
        for i in np.flatnonzero(dry.coulomb > 0.0)
    )


def _counters(drives: Drives, h: Floats, counted: Floats) -> tuple[Counter, ...]:
    """None where no encoder is known; beside one that is, the others are as fine as you like."""
    n, counts = drives.transmission, drives.encoder_counts
    known = np.isfinite(counts)
    noise = np.zeros(len(h)) if drives.nonlinearity is None else drives.nonlinearity.encoder_noise / n
    if not known.any() and not noise.any():
        return ()
    step = np.where(known, 2.0 * np.pi / np.where(known, counts * n, 1.0), 0.0)
    return tuple(
        Counter(counted[i], float(step[i]), weight=float(h[i]), noise=float(noise[i]), channel=int(i))
        for i in np.flatnonzero(h)
    )


def _springs(
    drives: Drives, dry: DriveNonlinearity, deflections: Floats, bent: Floats | None, backward: bool
) -> tuple[Spring, ...]:
    n = drives.transmission
    cubic = n**4 * dry.hardening
    excess = np.zeros(len(n))
    given = np.isfinite(dry.backward_stiffness)
    excess[given] = n[given] ** 2 * (dry.backward_stiffness[given] - drives.stiffness[given])
    offset = np.zeros(len(n)) if bent is None else bent
    kink = kinks(drives, dry)
    behind = (offset < kink) | ((offset == kink) & backward)
    curved = np.flatnonzero(np.isfinite(drives.stiffness) & ((cubic != 0.0) | (excess != 0.0)))
    return tuple(
        Spring(
            deflections[i],
            float(cubic[i]),
            float(excess[i]),
            float(kink[i]),
            float(offset[i]),
            bool(behind[i] and excess[i]),
        )
        for i in curved
    )


def kinks(drives: Drives, dry: DriveNonlinearity) -> Floats:
    """Deflections (d,) at the joint, not positive, at which the drives' stiffness changes [rad]."""
    n = drives.transmission
    preloaded = np.isfinite(drives.stiffness) & (dry.preload > 0.0)
    return np.asarray(np.where(preloaded, -dry.preload / (n * np.where(preloaded, drives.stiffness, 1.0)), 0.0))


def _brakes(n: Floats, dry: DriveNonlinearity, motors: Floats) -> tuple[Brake, ...]:
    return tuple(
        Brake(motors[i], float(n[i] ** 2 * dry.brake_damping[i]), float(dry.brake_time_constant[i]))
        for i in np.flatnonzero(dry.brake_damping > 0.0)
    )
