"""What the computer does in each period: count, place the handle, estimate its velocity, push, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.mechanism.acceleration import close_at
from zwidth.contact.mechanism.law import Law
from zwidth.contact.mechanism.surfaces import penetration
from zwidth.contact.mechanism.system import System
from zwidth.contact.velocity import FOAW, LEVANT
from zwidth.loop.estimators.foaw_kernel import foaw_estimate
from zwidth.loop.estimators.levant_kernel import levant_estimate
from zwidth.model.arrays import Arrays
from zwidth.model.inertia import handle_jacobian
from zwidth.model.mechanism import Floats
from zwidth.model.tree import Work, point, workspace


class Desk(NamedTuple):
    """The computer's memory.

    work, angles, counted (d,)   the posture it sees
    first (3,), past (w, 3)      the handle's first reading; differences from it, newest first
    method (3, memory)           what an estimator that is not linear remembers of each coordinate
    velocity, push (factors, 2, 3)  states of the two filters
    seen, speed, force (3,)      handle [m], its velocity [m/s], force on it [N]
    torque (whole + 2, d)        commands at the joints, newest first [N m]
    """

    work: Work
    angles: Floats
    counted: Floats
    first: Floats
    past: Floats
    method: Floats
    velocity: Floats
    push: Floats
    seen: Floats
    speed: Floats
    force: Floats
    torque: Floats
    jacobian: Floats


@compiled
def desk_of(mech: Arrays, law: Law) -> Desk:
    """Fresh memory of a computer that has just been switched on."""
    return Desk(
        workspace(mech),
        np.zeros(mech.parent.size),
        np.zeros(mech.driven),
        np.zeros(3),
        np.zeros((law.window.size, 3)),
        np.zeros((3, law.memory)),
        np.zeros((law.numerator.shape[0], 2, 3)),
        np.zeros((law.force_numerator.shape[0], 2, 3)),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros((law.whole + 2, mech.driven)),
        np.zeros((1, 3, mech.driven)),
    )


@compiled_lean
def filtered(numerator: Floats, denominator: Floats, state: Floats, signal: Floats) -> None:
    """Pass the signal (3,) in place through factors in d = z - 1:

    (c2 d^2 + c1 d + c0)/(d^2 + d1 d + d0)   or   (c1 d + c0)/(d + d0)
    """
    for k in range(numerator.shape[0]):
        c2, c1, c0 = numerator[k, 0], numerator[k, 1], numerator[k, 2]
        lead, d1, d0 = denominator[k, 0], denominator[k, 1], denominator[k, 2]
        for x in range(3):
            u = signal[x]
            if lead == 0.0:
                y = c1 * u + state[k, 0, x]
                state[k, 0, x] += c0 * u - d0 * y
            else:
                y = c2 * u + state[k, 0, x]
                state[k, 0, x] += state[k, 1, x] - d1 * y + c1 * u
                state[k, 1, x] += c0 * u - d0 * y
            signal[x] = y


@compiled_lean
def look(system: System, law: Law, desk: Desk, x: Floats, noise: Floats, sample: int) -> bool:
    """Count the motors and place the handle where the counts say; False where their loops do not close."""
    mech, counted, quantum, read = system.mech, desk.counted, law.quantum, law.read
    for i in range(counted.size):
        angle = x[read[i]]
        if noise.shape[0] > 0:
            angle += noise[sample, i]
        counted[i] = quantum[i] * np.round(angle / quantum[i]) if quantum[i] > 0.0 else angle
    if close_at(mech, counted, desk.angles, desk.work) < 0.0:
        return False
    h = point(desk.work.rotation, desk.work.origin, mech.handle_link, mech.handle, 0, 0)
    desk.seen[0], desk.seen[1], desk.seen[2] = h[0], h[1], h[2]
    handle_jacobian(desk.work, desk.jacobian, 0)
    return True


@compiled
def estimate(law: Law, desk: Desk, sample: int) -> None:
    """The velocity of the counted handle; before the start it stood where it was first seen."""
    past, first, seen, speed, window = desk.past, desk.first, desk.seen, desk.speed, law.window
    for k in range(window.size - 1, 0, -1):
        for x in range(3):
            past[k, x] = past[k - 1, x]
    for x in range(3):
        if sample == 0:
            first[x] = seen[x]
        past[0, x] = seen[x] - first[x]
        if law.method == FOAW:
            speed[x] = foaw_estimate(desk.method[x], law.parameters, past[0, x], law.period)
        elif law.method == LEVANT:
            speed[x] = levant_estimate(desk.method[x], law.parameters, past[0, x], law.period)
        else:
            speed[x] = 0.0
            for k in range(window.size):
                speed[x] += window[k] * past[k, x]
    filtered(law.numerator, law.denominator, desk.velocity, speed)


@compiled_lean
def command(law: Law, desk: Desk) -> None:
    """The wall's force on the handle as it is seen, and the torques that render it, J^T f, within their limits.

    f = (K depth + B depth') normal,   depth' = -normal . v
    """
    seen, speed, force, torque, J = desk.seen, desk.speed, desk.force, desk.torque, desk.jacobian
    limit, surface = law.limit, law.surface
    depth, nx, ny, nz = penetration(surface, seen[0], seen[1], seen[2])
    push = 0.0
    if depth > 0.0 or surface[1] == 1.0:
        push = law.stiffness * depth - law.damping * (nx * speed[0] + ny * speed[1] + nz * speed[2])
        if law.no_pull and push < 0.0:
            push = 0.0
    force[0], force[1], force[2] = push * nx, push * ny, push * nz
    filtered(law.force_numerator, law.force_denominator, desk.push, force)
    size = np.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    scale = law.saturation / size if size > law.saturation else 1.0
    for x in range(3):
        force[x] *= scale
    for k in range(torque.shape[0] - 1, 0, -1):
        for i in range(limit.size):
            torque[k, i] = torque[k - 1, i]
    scale = 1.0
    for i in range(limit.size):
        torque[0, i] = J[0, 0, i] * force[0] + J[0, 1, i] * force[1] + J[0, 2, i] * force[2]
        if abs(torque[0, i]) > limit[i]:
            scale = min(scale, limit[i] / abs(torque[0, i]))
    for i in range(limit.size):
        torque[0, i] = scale * torque[0, i] if law.together else min(max(torque[0, i], -limit[i]), limit[i])
