"""A five-bar's motion derived a second time, by Lagrange multipliers, and integrated by an ODE solver."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from zwidth.model import reduce_mechanism, solve_posture


class FiveBarByMultipliers:
    """Joint coordinates of both arms and Lagrange multipliers for the loop, in plain NumPy.

    State: q1..q4 (arm, distal, arm, distal), theta1, theta2, and their rates. Nothing of the package is used but
    the mechanism's numbers: each arm is two bars with

        M = [a + 2 b, c + b; c + b, c],   b = L m (x cos q - y sin q),   c = I + m (x^2 + y^2)
    """

    def __init__(self, mechanism, damping_matrix, gravity=(0.0, 0.0)):
        links, drives = mechanism.links, mechanism.drives
        self.L = links.tip[:, 0]
        self.m, self.I = links.mass, links.inertia[:, 2, 2]
        self.x, self.y = links.center_of_mass[:, 0], links.center_of_mass[:, 1]
        self.base = links.origin[[0, 2], 0]
        n2 = drives.transmission**2
        self.rotor, self.spring, self.B = n2 * drives.motor_inertia, n2 * drives.stiffness, damping_matrix
        self.g = np.asarray(gravity, float)

    def arm(self, k, q, qd):
        """Mass matrix, velocity and gravity forces, end point, its Jacobian and Jdot qd of one arm."""
        i, j = 2 * k, 2 * k + 1
        L, (m1, m2), (x1, x2), (y1, y2) = self.L[i], self.m[[i, j]], self.x[[i, j]], self.y[[i, j]]
        s, c = np.sin(q[1]), np.cos(q[1])
        b, db = L * m2 * (x2 * c - y2 * s), -L * m2 * (x2 * s + y2 * c)
        a = self.I[i] + m1 * (x1 * x1 + y1 * y1) + m2 * L * L
        e = self.I[j] + m2 * (x2 * x2 + y2 * y2)
        M = np.array([[a + e + 2 * b, e + b], [e + b, e]])
        v = np.array([db * qd[1] * (2 * qd[0] + qd[1]), -db * qd[0] ** 2])
        t1, t2 = q[0], q[0] + q[1]

        def turned(angle, px, py):
            return np.array([np.cos(angle) * px - np.sin(angle) * py, np.sin(angle) * px + np.cos(angle) * py])

        def across(p):
            return np.array([-p[1], p[0]])

        elbow, end = turned(t1, L, 0.0), turned(t2, self.L[j], 0.0)
        c1, c2 = turned(t1, x1, y1), turned(t2, x2, y2)
        pull = np.array(
            [
                m1 * self.g @ across(c1) + m2 * self.g @ (across(elbow) + across(c2)),
                m2 * self.g @ across(c2),
            ]
        )
        tip = np.array([self.base[k], 0.0]) + elbow + end
        J = np.stack([across(elbow) + across(end), across(end)], axis=-1)
        w1, w2 = qd[0], qd[0] + qd[1]
        return M, v - pull, tip, J, -elbow * w1 * w1 - end * w2 * w2

    def rate(self, state, torque, hand):
        q, theta, qd, thetad = state[:4], state[4:6], state[6:10], state[10:]
        M, c = np.zeros((4, 4)), np.zeros(4)
        arms = [self.arm(k, q[2 * k : 2 * k + 2], qd[2 * k : 2 * k + 2]) for k in (0, 1)]
        for k, (Mk, ck, *_rest) in enumerate(arms):
            M[2 * k : 2 * k + 2, 2 * k : 2 * k + 2], c[2 * k : 2 * k + 2] = Mk, ck
        (_, _, _, J1, a1), (_, _, _, J2, a2) = arms
        A = np.concatenate([J1, -J2], axis=1)
        drag = self.B @ np.concatenate([qd[[0, 2]], thetad])
        force = -c
        force[:2] += J1.T @ hand
        force[[0, 2]] += self.spring * (theta - q[[0, 2]]) - drag[:2]
        whole = np.block([[M, A.T], [A, np.zeros((2, 2))]])
        qdd = np.linalg.solve(whole, np.concatenate([force, a2 - a1]))[:4]
        thetadd = (self.spring * (q[[0, 2]] - theta) - drag[2:] + torque) / self.rotor
        return np.concatenate([qd, thetad, qdd, thetadd])

    def handle(self, q):
        return self.arm(0, q[:2], np.zeros(2))[2]

    def jacobian(self, driven, guess):
        """Handle (2,), Jacobian in the driven angles (2, 2) and passive angles, the loop closed by Newton."""
        q = np.array([driven[0], guess[0], driven[1], guess[1]])
        for _ in range(20):
            one, two = self.arm(0, q[:2], np.zeros(2)), self.arm(1, q[2:], np.zeros(2))
            turn = np.linalg.solve(np.stack([one[3][:, 1], -two[3][:, 1]], axis=-1), two[2] - one[2])
            q[[1, 3]] += turn
            if np.max(np.abs(turn)) < 1e-14:
                break
        one, two = self.arm(0, q[:2], np.zeros(2)), self.arm(1, q[2:], np.zeros(2))
        passive = np.stack([one[3][:, 1], -two[3][:, 1]], axis=-1)
        rates = np.linalg.solve(passive, -np.stack([one[3][:, 0], -two[3][:, 0]], axis=-1))
        J = np.outer(one[3][:, 0], [1.0, 0.0]) + np.outer(one[3][:, 1], rates[0])
        return one[2], J, q[[1, 3]]


def reference_motion(mechanism, damping, controller, wall, surface, push, samples, gravity, at):
    """The same motion by Lagrange multipliers in joint coordinates, DOP853 between samples: handle (k, 2)."""
    posture = solve_posture(mechanism, at)
    plant = reduce_mechanism(mechanism, posture, [0.0, 1.0, 0.0], "full", damping)
    model = FiveBarByMultipliers(mechanism, plant.damping, gravity)
    T, f, whole = controller.sampling_period, controller.fractional_delay, controller.whole_delay
    q = posture.angles
    state = np.concatenate([q, q[[0, 2]], np.zeros(6)])
    handles, torques, before = [], [np.zeros(2)] * (whole + 2), None
    passive = q[[1, 3]]
    for _ in range(samples + 1):
        handles.append(model.handle(state[:4]))
        seen, J, passive = model.jacobian(state[4:6], passive)
        v = (seen - (seen if before is None else before)) / T
        before = seen
        depth, normal = surface(seen)
        size = wall.stiffness * depth - wall.damping * normal @ v if depth > 0.0 else 0.0
        torques.insert(0, J.T @ (size * normal))
        for start, stop, late in ((0.0, f, whole + 1), (f, 1.0, whole)):
            if stop > start:
                state = solve_ivp(
                    lambda t, s, torque: model.rate(s, torque, push),
                    (0.0, (stop - start) * T),
                    state,
                    method="DOP853",
                    rtol=1e-11,
                    atol=1e-13,
                    args=(torques[late],),
                ).y[:, -1]
    return np.array(handles)
