"""Published kinematics and mass matrices of bundled devices, typed from their formulas: judges that share no code.

Only formulas are here that stand a check of their own, Jacobian against differences, energy against its
derivative; what is printed wrongly somewhere (`docs/zoo.md` names it) is not.
"""

from __future__ import annotations

import numpy as np
from numpy import arccos, arctan2, cos, hypot, pi, sin, sqrt

# --- PHANToM Premium 1.5: Cavusoglu, Feygin and Tendick 2002, as coded in mahilab/Phantom ------------

PREMIUM = {
    "a": (0.0202, 0.4864e-4, 0.001843e-4, 0.4864e-4),  # mass, Ixx, Iyy, Izz
    "c": (0.0249, 0.959e-4, 0.959e-4, 0.0051e-4),
    "be": (0.2359, 11.09e-4, 10.06e-4, 0.591e-4),
    "df": (0.1906, 7.11e-4, 0.629e-4, 6.246e-4),
}
PREMIUM_BASE = 11.87e-4
PREMIUM_LENGTHS = (0.215, 0.170, 0.0325)
PREMIUM_CAD_LENGTHS = (0.20955, 0.169545, 0.03175)


def premium_mass_matrix(q):
    """M(q) (3, 3) of q1 about the vertical, q2 of the upper arm from the level, q3 of the forearm from straight
    down; the moments of be and df are about the pivot."""
    _, q2, q3 = q
    l1, l2, l3 = PREMIUM_LENGTHS
    (ma, ax, ay, az), (mc, cx, cy, cz), (_, bx, by, bz), (_, dx, dy, dz) = PREMIUM.values()
    share = l2 * ma + l3 * mc
    level, upright = cos(q2), sin(q3)
    M = np.zeros((3, 3))
    M[0, 0] = (
        PREMIUM_BASE
        + (by + cy + l1**2 * (ma + mc / 4)) * cos(q2) ** 2
        + (bz + cz) * sin(q2) ** 2
        + (ay + dy) * cos(q3) ** 2
        + (az + dz + l2**2 * ma / 4 + l3**2 * mc) * sin(q3) ** 2
        + l1 * share * level * upright
    )
    M[1, 1] = bx + cx + l1**2 * (ma + mc / 4)
    M[2, 2] = ax + dx + l2**2 * ma / 4 + l3**2 * mc
    M[1, 2] = M[2, 1] = -l1 * share * sin(q2 - q3) / 2
    return M


def premium_place(q, lengths):
    """The handle (3,) of angles q, upper arm and forearm of these lengths."""
    q1, q2, q3 = q
    out = lengths[0] * cos(q2) + lengths[1] * sin(q3)
    return np.array([cos(q1) * out, sin(q1) * out, lengths[0] * sin(q2) - lengths[1] * cos(q3)])


def premium_jacobian(q, lengths):
    """The derivative (3, 3) of `premium_place`."""
    q1, q2, q3 = q
    u, v = lengths[:2]
    out = u * cos(q2) + v * sin(q3)
    radial = np.array([0.0, -u * sin(q2), v * cos(q3)])
    around = np.array([out, 0.0, 0.0])
    up = np.array([0.0, u * cos(q2), v * sin(q3)])
    return np.array([cos(q1) * radial - sin(q1) * around, sin(q1) * radial + cos(q1) * around, up])


# --- offset deltas: Stamper's thesis, (3.1)-(3.9), (4.9)-(4.13), (6.29)-(6.32); libnifalcon's r, s, c, f
# ------------

DELTAS = {
    "novint-falcon": {"a": 0.06, "b": 0.1025, "c": 0.01443, "d": 0.01125, "f": -0.025, "r": 0.04, "s": -0.02309},
    "novint-falcon-older": {
        "a": 0.06,
        "b": 0.1025,
        "c": 0.014,
        "d": 0.01125,
        "f": -0.025,
        "r": 0.037233758,
        "s": -0.027330909,
    },
    "stamper-delta": {"a": 0.2032, "b": 0.254, "c": 0.127, "d": 0.0159, "f": 0.0, "r": 0.127, "s": 0.0},
}
FALCON_LEGS = np.array([pi / 2, -pi / 6, -5 * pi / 6]) + pi / 12
LEGS = {"stamper-delta": np.array([0.0, 2.0, 4.0]) * pi / 3}
ARM_MASS, ROD_MASS, PLATFORM_MASS, ROTOR = 0.184, 0.085, 0.413, 0.00434


def delta_angles(p, name):
    """theta1, theta2, theta3 (3, legs) of a platform at p: (3.1), (3.5), (3.9), arms inside, rods outside."""
    g, legs = DELTAS[name], LEGS.get(name, FALCON_LEGS)
    u = p[0] * cos(legs) + p[1] * sin(legs) - g["r"] + g["c"]
    v = p[1] * cos(legs) - p[0] * sin(legs) - g["s"] + g["f"]
    w = p[2]
    third = arccos(v / g["b"])
    L = 2 * g["d"] + g["b"] * sin(third)
    # u = a cos t1 + L cos t2, w = a sin t1 + L sin t2: the triangle of arm and rod in the plane of the leg
    far = hypot(u, w)
    first = arctan2(w, u) - arccos((g["a"] ** 2 + far**2 - L**2) / (2 * g["a"] * far))
    second = arctan2(w - g["a"] * sin(first), u - g["a"] * cos(first))
    return np.array([first, second, third])


def delta_jacobian(angles, name):
    """d theta1 / d p (3, 3): (4.11)-(4.13)."""
    first, second, third = angles
    legs = LEGS.get(name, FALCON_LEGS)
    along = cos(second) * sin(third)
    rows = np.array(
        [
            along * cos(legs) - cos(third) * sin(legs),
            along * sin(legs) + cos(third) * cos(legs),
            sin(second) * sin(third),
        ]
    )
    return (rows / (DELTAS[name]["a"] * sin(second - first) * sin(third))).T


def stamper_mass_matrix(angles):
    """M in theta1 (3, 3), rotors included: kinetic energy (6.29)-(6.32), rods half and half at their ends."""
    g, legs = DELTAS["stamper-delta"], LEGS["stamper-delta"]
    first, second, third = angles
    a, d = g["a"], g["d"]
    platform = np.linalg.inv(delta_jacobian(angles, "stamper-delta"))
    M = PLATFORM_MASS * platform.T @ platform
    for i in range(3):
        u = np.array([cos(legs[i]), sin(legs[i]), 0.0])
        along = -sin(second[i]) * u + cos(second[i]) * np.eye(3)[2]  # how the bar's end moves per theta2'
        arm = a * np.outer(-sin(first[i]) * u + cos(first[i]) * np.eye(3)[2], np.eye(3)[i])
        L = 2 * d + g["b"] * sin(third[i])
        turning = along @ (platform - arm) / L
        near = arm + d * np.outer(along, turning)
        far = platform - d * np.outer(along, turning)
        M += ROD_MASS * (near.T @ near + far.T @ far)
        M[i, i] += ROTOR + ARM_MASS * a**2 / 3
    return M


# --- planar five-bars: Haply's force map (HaplyHAPI), the Pantograph's forward kinematics ------------

FIVE_BARS = {  # left proximal and distal link, right ones, x of left and right base joint
    "haply-pantograph": (0.05, 0.07, 0.0, 0.02),
    "haply-2diy": (0.07, 0.09, 0.0, 0.0),
    "haply-2diy-3": (0.07, 0.09, 0.0, 0.038),
    "pantograph-mk2": (0.063, 0.075, -0.025, 0.0),
}


def five_bar_place(left, right, name):
    """The end point (2,) above the line from the left elbow to the right one."""
    l, L, x_left, x_right = FIVE_BARS[name]
    A = np.array([x_left + l * cos(left), l * sin(left)])
    B = np.array([x_right + l * cos(right), l * sin(right)])
    apart = B - A
    across = np.array([-apart[1], apart[0]]) / np.linalg.norm(apart)
    return (A + B) / 2 + across * sqrt(L**2 - apart @ apart / 4)


def five_bar_jacobian(left, right, name):
    """d place / d (left, right) (2, 2): each distal link keeps its length, n_i . (p' - elbow_i') = 0."""
    l, _, x_left, x_right = FIVE_BARS[name]
    p = five_bar_place(left, right, name)
    elbows = [np.array([x + l * cos(t), l * sin(t)]) for x, t in ((x_left, left), (x_right, right))]
    moves = [l * np.array([-sin(t), cos(t)]) for t in (left, right)]
    n = np.array([p - elbow for elbow in elbows])
    return np.linalg.solve(n, np.diag([n[i] @ moves[i] for i in range(2)]))


# --- serial arms ------------------------------------------------------------------------------------


def master_arm_place(q):
    """Centre of the wrist (3,): MTMR.json's standard Denavit-Hartenberg table, joints 1 to 4, its 1.5708 a quarter
    turn."""
    rows = (
        (pi / 2, 0.0, 0.0, -pi / 2),
        (0.0, 0.2794, 0.0, -pi / 2),
        (-pi / 2, 0.3645, 0.0, pi / 2),
        (pi / 2, 0.0, 0.1506, 0.0),
    )
    T = np.eye(4)
    for (alpha, a, d, offset), angle in zip(rows, (*q, 0.0), strict=True):
        ct, st, ca, sa = cos(angle + offset), sin(angle + offset), cos(alpha), sin(alpha)
        T = T @ np.array(
            [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return T[:3, 3]


def wooden_place(t):
    """kinematics.cpp: tB of the upper arm from the vertical, tC of the forearm from straight down."""
    out = 0.205 * sin(t[1]) + 0.245 * sin(t[2])
    return np.array([cos(t[0]) * out, sin(t[0]) * out, 0.080 + 0.205 * cos(t[1]) - 0.245 * cos(t[2])])


def wooden_jacobian(t):
    """Its derivative (3, 3)."""
    out = 0.205 * sin(t[1]) + 0.245 * sin(t[2])
    b, c = 0.205 * cos(t[1]), 0.245 * cos(t[2])
    ca, sa = cos(t[0]), sin(t[0])
    return np.array(
        [[-sa * out, ca * b, ca * c], [ca * out, sa * b, sa * c], [0, -0.205 * sin(t[1]), 0.245 * sin(t[2])]]
    )


def touch_place(waist, shoulder, elbow):
    """omni.urdf: the centre of the gimbal; in the plane of waist 0 both arms lie in y, z, elbow at -1.5 from the
    arm."""
    forearm = shoulder + elbow - 1.5
    out = 0.134 * cos(shoulder) + 0.1325 * cos(forearm)
    return np.array([-sin(waist) * out, cos(waist) * out, 0.125 + 0.134 * sin(shoulder) + 0.1325 * sin(forearm)])
