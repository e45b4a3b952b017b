"""The haptic equilibrium (2.4) and its linearisation (2.5) on the five-bar, with a hand that leans on the wall.

The thesis has external forces contribute to the equilibrium and neglects what they do to small motions. Here all
of first order is kept: the links feel the hand's force all the time, with lever arms that change as they move, and
the computer turns the wall's force with the motors that it counts, once per sample and held.

Second route: both arms by circles that meet (as in `five_bar`, whose mass matrix this takes), derivatives by
complex steps, the balance by scipy, and the period by a matrix exponential. The motion along the surface is among
the roots, and is the slowest of them.

Run `python -m gallery.haptic_equilibrium` to see both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh, expm
from scipy.optimize import fsolve

from gallery.five_bar import bundled
from zwidth.device.load import load
from zwidth.measures import fastest_sideways_motion
from zwidth.measures.load_effect import load_change
from zwidth.model import Load

POSITION, PUSH, GRAVITY = (0.05, 0.2), -5.0, (0.0, -9.81)
STIFFNESS, DAMPING = 4000.0, 10.0  # of the wall whose roots are compared
STEP = 1e-5  # of a difference of first derivatives [rad]

device = load("five-bar")
period = device.controller.sampling_period
point = device.at(POSITION, load=Load(push=PUSH))
found = point.equilibrium
spectral_radius = float(
    device.at(POSITION, load=Load(push=PUSH, count_sideways=True)).check([STIFFNESS], [DAMPING]).spectral_radius[0]
)
change, change_neglected = (
    load_change(one) for one in (point, replace(point, load=replace(point.load, hand="neglected")))
)
pulled = device.at(load=Load(push=-PUSH))
growth, growth_neglected = (
    fastest_sideways_motion(one).growth_rate
    for one in (pulled, replace(pulled, load=replace(pulled.load, hand="neglected")))
)
under_gravity = device.at(POSITION, gravity=GRAVITY)
change_by_gravity = load_change(under_gravity)
growth_by_gravity = fastest_sideways_motion(under_gravity).growth_rate


# --- the second route -------------------------------------------------------------------------------

judge = bundled()
here = judge.at(POSITION, "elbows-out")


def handle(angles):
    """The handle (2,) of driven angles (2,) [m]: the upper of the two points at which the distal links' circles
    meet."""
    (x1, y1), (x2, y2) = (
        (base + length * np.cos(q), length * np.sin(q))
        for base, length, q in zip(judge.base, judge.driven_length, angles, strict=True)
    )
    (a, b), square = judge.distal_length, (x2 - x1) ** 2 + (y2 - y1) ** 2
    along = (a * a - b * b + square) / (2.0 * square)
    up = np.sqrt(a * a / square - along * along)
    return np.array([x1 + along * (x2 - x1) + up * (y2 - y1), y1 + along * (y2 - y1) - up * (x2 - x1)])


def jacobian(angles):
    """J (2, 2) by complex steps."""
    steps = 1e-30j * np.eye(2)
    return np.stack([handle(angles + step).imag / 1e-30 for step in steps], axis=1)


def curvature(angles):
    """d2x/dq2 (2, 2, 2), by differences of J."""
    steps = STEP * np.eye(2)
    return np.stack([(jacobian(angles + s) - jacobian(angles - s)) / (2.0 * STEP) for s in steps], axis=2)


angles, springs = here.driven_angles, np.array(judge.spring)


def _unbalanced(unknown):
    """Hand's force across the direction, deflections and the wall's force: joints, drives."""
    across, *ahead, wall = unknown
    torque = springs * ahead
    return np.concatenate(
        [
            jacobian(angles).T @ [across, PUSH] + torque,
            torque - jacobian(angles + ahead)[1] * wall,
        ]
    )


across, *_ahead, wall_force = fsolve(_unbalanced, [0.0, 0.0, 0.0, -PUSH], xtol=1e-14)
counted = angles + _ahead
_K_links = -np.einsum("k,kij->ij", [across, PUSH], curvature(angles))
_turning = wall_force * curvature(counted)[1]  # of the motors' torques, per angle that they are counted at
_reading = jacobian(counted)[1]


def _radius():
    """Spectral radius of the wall, everything linearised, by the exponential of a period."""
    none, k = np.zeros((2, 2)), np.diag(springs)
    M = np.block([[here.mass_matrix, none], [none, np.diag(judge.rotor)]])
    K = np.block([[k, -k], [-k, k]])
    squared, V = eigh(K, M)
    drag = M @ V @ np.diag(2.0 * 0.05 * np.sqrt(np.where(squared > 1.0, squared, 0.0))) @ V.T @ M
    K[:2, :2] += _K_links
    A = np.zeros((10, 10))  # places, velocities and held torques of the motors
    A[:4, 4:8] = np.eye(4)
    A[4:8, :8] = -np.linalg.solve(M, np.hstack([K, drag]))
    A[4:8, 8:] = np.linalg.solve(M, np.vstack([none, np.eye(2)]))
    step = expm(A * period)
    read = np.concatenate([np.zeros(2), _reading, np.zeros(5)])
    before = np.eye(9)[8]
    force = -(STIFFNESS * read + DAMPING / period * (read - before))
    torques = np.outer(_reading, force)
    torques[:, 2:4] += _turning
    L = np.zeros((9, 9))
    L[:8, :8] = step[:8, :8]
    L[:8] += step[:8, 8:] @ torques
    L[8] = read
    return float(np.abs(np.linalg.eigvals(L)).max())


radius_by_hand = _radius()


def main() -> None:
    """Both routes, and what is neglected."""
    print(f"hand across {found.sideways_force[0]:.12g} and {across:.12g} N")
    print(f"wall {found.wall_force:.12g} and {wall_force:.12g} N")
    print(f"spectral radius {spectral_radius:.12g} and {radius_by_hand:.12g}")
    print(f"largest stiffness {change:+.3e}, neglecting {change_neglected:+.3e}, gravity {change_by_gravity:+.1e}")
    print(f"growth {growth:.4g} and, neglecting, {growth_neglected:.4g} 1/s; gravity {growth_by_gravity:.4g} 1/s")


if __name__ == "__main__":
    main()
