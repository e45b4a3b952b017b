"""Kinematics of a mechanism in plain NumPy: places, first derivatives, and postures with closed loops.

Joints are turned and slid one by one, velocities are those of screws, and loops are closed by Newton's method on
the gaps. Second derivatives are left to differences of what stands here, so that nothing of the package's own is
used.

A motion e (c,) of the independent joints, drives and then free ones in the order of the mechanism, is a geodesic:
the joints' coordinates move by e, and a free ball joint by the turn Exp of its part of e.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from tests.model.random_mechanisms import place
from zwidth.model import AXIS, BALL_X, BALL_Z, FIXED, FRAME, PRISMATIC

FOURTH = ((1.0, 8.0 / 12.0), (-1.0, -8.0 / 12.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0))  # steps and weights
PART = 0.1  # of a motion that is taken at once [rad], [m]
SURE = 1e-9  # step of a passive joint after which the next one of Newton's method is rounding


class Joints:
    """The joints of a mechanism of one design.

    moving       the links that move against their parents
    independent  positions among them of the independent joints: of the drives but the surplus ones, then free ones
    passive      positions of those that the loops determine
    """

    def __init__(self, mechanism):
        self.mechanism, self.links, self.closures = mechanism, mechanism.links, mechanism.closures
        self.moving = [i for i in range(len(self.links.names)) if self.links.joint[i] != FIXED]
        self.independent = [self.moving.index(i) for i in (*mechanism.driven, *mechanism.free)]
        self.passive = [j for j in range(len(self.moving)) if j not in self.independent]
        self.kinds = np.zeros(len(self.closures.names), int) if self.closures.kind is None else self.closures.kind
        self.carried_by = []
        for i in range(len(self.links.names)):
            above = [] if self.links.parent[i] < 0 else self.carried_by[self.links.parent[i]]
            self.carried_by.append([*above, i])

    @property
    def count(self):
        return len(self.independent)

    def placed(self, q):
        """Axes (n, 3, 3) and origins (n, 3) of the links, whether their loops are closed or not."""
        return place(self.links, q)

    def jacobians(self, placed, link, point):
        """Velocity and angular velocity (3, m) of a point (3,) of a link's frame per unit rate of each joint."""
        R, o = placed
        speed, spin = np.zeros((3, len(self.moving))), np.zeros((3, len(self.moving)))
        if link < 0:
            return speed, spin
        x = o[link] + R[link] @ point
        for i in self.carried_by[link]:
            kind = self.links.joint[i]
            if kind == FIXED:
                continue
            column, ball = self.moving.index(i), kind >= BALL_X
            body = i + int(BALL_Z - kind) if ball else i
            axis = R[body] @ (np.eye(3)[kind - BALL_X] if ball else self.links.axis[i])
            if kind == PRISMATIC:
                speed[:, column] = axis
            else:
                speed[:, column], spin[:, column] = np.cross(axis, x - o[body]), axis
        return speed, spin

    def gaps(self, placed):
        """What the loops lack (r,), and its derivative (r, m): gaps, and turns of axes and frames [rad]."""
        R, o = placed
        values, rows = [np.zeros(0)], [np.zeros((0, len(self.moving)))]
        for k, kind in enumerate(self.kinds):
            a, b = int(self.closures.a[k]), int(self.closures.b[k])
            turn = [np.eye(3) if i < 0 else R[i] for i in (a, b)]
            base = [np.zeros(3) if i < 0 else o[i] for i in (a, b)]
            ends = self.closures.point_a[k], self.closures.point_b[k]
            (speed_a, spin_a), (speed_b, spin_b) = (
                self.jacobians(placed, i, p) for i, p in zip((a, b), ends, strict=True)
            )
            values.append(base[0] + turn[0] @ ends[0] - base[1] - turn[1] @ ends[1])
            rows.append(speed_a - speed_b)
            if kind == AXIS:
                z, other = turn[0] @ self.closures.axis_a[k], turn[1] @ self.closures.axis_b[k]
                values.append(np.cross(other, z))
                rows.append((np.eye(3) - np.outer(z, z)) @ (spin_a - spin_b))
            elif kind == FRAME:
                E = turn[0] @ self.closures.rotation[k] @ turn[1].T
                values.append(np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]]) / 2.0)
                rows.append(spin_a - spin_b)
        return np.concatenate(values), np.concatenate(rows)

    def rates(self, rows):
        """B (m, c): rates of the joints per unit rate of each independent one, from the loops' rows (r, m)."""
        B = np.zeros((len(self.moving), self.count))
        B[self.independent] = np.eye(self.count)
        if self.passive:
            B[self.passive] = -np.linalg.lstsq(rows[:, self.passive], rows[:, self.independent], rcond=1e-10)[0]
        return B

    def turned(self, q, step):
        """Joint coordinates (n,) after steps (m,) of the joints, ball joints about their own axes."""
        q = q.copy()
        for column, i in enumerate(self.moving):
            if self.links.joint[i] < BALL_X:
                q[i] += step[column]
            elif self.links.joint[i] == BALL_X:
                turn = Rotation.from_rotvec(q[i : i + 3]) * Rotation.from_rotvec(step[column : column + 3])
                q[i : i + 3] = turn.as_rotvec()
        return q

    def moved(self, q, motion):
        """Joint coordinates after a motion (c,) of the independent joints, the loops closed again, in parts of
        PART."""
        parts = 1 + int(np.max(np.abs(motion), initial=0.0) / PART)
        for _ in range(parts):
            q = self._moved(q, motion / parts)
        return q

    def _moved(self, q, motion):
        step = np.zeros(len(self.moving))
        step[self.independent] = motion
        if self.passive:
            B = self.rates(self.gaps(self.placed(q))[1])
            step[self.passive] = B[self.passive] @ motion
        q = self.turned(q, step)
        for _ in range(20 if self.passive else 0):
            values, rows = self.gaps(self.placed(q))
            step = np.zeros(len(self.moving))
            step[self.passive] = -np.linalg.lstsq(rows[:, self.passive], values, rcond=1e-10)[0]
            q = self.turned(q, step)
            if np.max(np.abs(step)) < SURE:
                break
        return q

    def at(self, q):
        """The mechanism in a posture with closed loops."""
        return Posed(self, q)


class Posed:
    """A mechanism at joint coordinates q with closed loops: B and all that moves, in the independent joints."""

    def __init__(self, joints, q):
        self.joints, self.q, self.placed = joints, q, joints.placed(q)
        self.B = joints.rates(joints.gaps(self.placed)[1])

    def point(self, link, local):
        """Place, and velocity and angular velocity (3, c), of a point of a link."""
        R, o = self.placed
        speed, spin = self.joints.jacobians(self.placed, link, local)
        return o[link] + R[link] @ local, speed @ self.B, spin @ self.B

    @property
    def handle(self):
        return self.point(self.joints.mechanism.handle_link, self.joints.mechanism.handle_point)

    def rate(self, link):
        """Rate (c,) of a link's joint."""
        return self.B[self.joints.moving.index(link)]

    def weight(self, gravity):
        """Generalised forces (c,) of gravity (3,)."""
        links = self.joints.links
        return sum(
            m * gravity @ self.point(i, c)[1]
            for i, (m, c) in enumerate(zip(links.mass, links.center_of_mass, strict=True))
            if m
        )


def travel(mechanism, start, end, ratio):
    """By what the drives' coordinates (d,) differ between joint coordinates (n,): turns of the motors over ratios
    (d,) of a posture, which drives with a table refer to."""
    drives, way = mechanism.drives, end - start
    out = way[drives.joint].copy()
    if drives.coupling is not None:
        out += drives.coupling @ way
    for i, table in enumerate(drives.ratio_tables or ()):
        if table is not None:
            turned = PchipInterpolator(table.coordinate, table.ratio).antiderivative()
            joint = drives.joint[i]
            out[i] = (turned(end[joint]) - turned(start[joint])) / ratio[i]
    return out


def travel_rates(mechanism, posed, ratio):
    """Their rates (d, c) per unit rate of each independent joint."""
    drives = mechanism.drives
    rows = np.array([posed.rate(i) for i in drives.joint])
    if drives.coupling is not None:
        every = np.zeros((len(posed.q), posed.B.shape[1]))
        every[posed.joints.moving] = posed.B
        rows = rows + drives.coupling @ every
    for i, table in enumerate(drives.ratio_tables or ()):
        if table is not None:
            now = PchipInterpolator(table.coordinate, table.ratio)(posed.q[drives.joint[i]])
            rows[i] *= float(now) / ratio[i]
    return rows


def along_motion(joints, q, motion, function, step=1e-4):
    """d function(posture)/ds along the geodesic of a motion, to fourth order."""
    return sum(w / step * function(joints.at(joints.moved(q, s * step * motion))) for s, w in FOURTH)
