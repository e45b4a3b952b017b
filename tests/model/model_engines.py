"""Mechanisms handed to MuJoCo and Pinocchio: mass matrix, constraint and handle Jacobians, nonlinear terms.

Only their algebra is asked, at one configuration; nothing is simulated. Both describe all joints; `to_independent`
projects on the independent coordinates. A universal joint is two hinges of one body for MuJoCo, a ball joint is
theirs too: its rates are the angular velocity about the link's own axes in both.
"""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from zwidth.model import AXIS, BALL_X, BALL_Z, FIXED, FRAME, PRISMATIC, REVOLUTE

NEARLY_NOTHING = 1e-14  # kg and kg m^2 of a massless link: this engine wants some


def moving_links(mechanism):
    return [i for i in range(len(mechanism.links.names)) if mechanism.links.joint[i] != FIXED]


def to_independent(mechanism, constraints):
    """B (m, c) with q' = B p' from the constraint Jacobian (rows, m), joints in the order of the links."""
    moving = moving_links(mechanism)
    independent = [moving.index(i) for i in (*mechanism.drives.joint, *mechanism.free)]
    passive = [j for j in range(len(moving)) if j not in independent]
    B = np.zeros((len(moving), len(independent)))
    B[independent] = np.eye(len(independent))
    if passive:
        B[passive] = -np.linalg.lstsq(constraints[:, passive], constraints[:, independent], rcond=None)[0]
    return B, moving, passive


def depth_first(parent, of=-1):
    """The links carried by one of them, each followed at once by those that it carries."""
    return [j for i in np.flatnonzero(parent == of) for j in (int(i), *depth_first(parent, i))]


def closing_kinds(closures):
    return np.zeros(len(closures.names), int) if closures.kind is None else closures.kind


def text(values):
    return " ".join(repr(float(v)) for v in np.ravel(values))


def quaternion(matrix):
    x, y, z, w = Rotation.from_matrix(matrix).as_quat()
    return np.array([w, x, y, z])


def mjcf(mechanism):
    """The mechanism as MJCF, its closures as `equality/connect` and `equality/weld` between sites."""
    links, closures = mechanism.links, mechanism.closures
    inside = {i: [] for i in range(-1, len(links.names))}
    equalities = []

    def connect(name, c, at_a, at_b, way="connect"):
        turns = (np.eye(3), np.eye(3))
        if way == "weld":
            turns = closures.rotation[c], np.eye(3)
        for end, link, point, turn in (
            ("a", closures.a[c], at_a, turns[0]),
            ("b", closures.b[c], at_b, turns[1]),
        ):
            inside[int(link)].append(
                f'<site name={quoteattr(f"{name}-{end}")} pos="{text(point)}" quat="{text(quaternion(turn))}"/>'
            )
        equalities.append(f"<{way} site1={quoteattr(name + '-a')} site2={quoteattr(name + '-b')}/>")

    for c, (name, kind) in enumerate(zip(closures.names, closing_kinds(closures), strict=True)):
        at = closures.point_a[c], closures.point_b[c]
        connect(name, c, *at, "weld" if kind == FRAME else "connect")
        if kind == AXIS:  # a second point of the axis
            connect(f"{name} along", c, at[0] + closures.axis_a[c], at[1] + closures.axis_b[c])
    inside[mechanism.handle_link].append(f'<site name="the handle" pos="{text(mechanism.handle_point)}"/>')

    def joints_of(i):
        """Tags of the joints of one body, which begins with link i, and the link that it ends with."""
        kind = links.joint[i]
        if kind == FIXED:
            return "", i
        if kind == BALL_X:
            return f'<joint name="{i}" type="ball"/>', i + 2
        tag = (
            f'<joint name="{i}" type="{"slide" if kind == PRISMATIC else "hinge"}" axis="{text(links.axis[i])}"/>'
        )
        if links.names[i].partition("/")[0] != links.names[i]:  # the cross of a universal joint
            more, last = joints_of(i + 1)
            return tag + more, last
        return tag, i

    def body(first):
        joints, i = joints_of(first)
        # principal axes outright: the engine finds its own to ten digits
        moments, axes = np.linalg.eigh(links.inertia[i])
        if (
            moments[0] == moments[1] == 0.0
        ):  # one number, about the only axis it turns about: any round body has it
            moments[:2] = moments[2]
        moments, mass = np.maximum(moments, NEARLY_NOTHING), max(links.mass[i], NEARLY_NOTHING)
        axes[:, 2] *= np.linalg.det(axes)
        children = "".join(body(j) for j in range(len(links.names)) if links.parent[j] == i)
        return (
            f'<body pos="{text(links.origin[first])}" quat="{text(quaternion(links.rotation[first]))}">{joints}'
            f'<inertial pos="{text(links.center_of_mass[i])}" mass="{text(mass)}" '
            f'diaginertia="{text(moments)}" quat="{text(quaternion(axes))}"/>{"".join(inside[i])}{children}</body>'
        )

    roots = "".join(body(i) for i in range(len(links.names)) if links.parent[i] < 0)
    return (
        '<mujoco><compiler angle="radian" balanceinertia="false"/><option gravity="0 0 0" jacobian="dense"/>'
        f"<worldbody>{''.join(inside[-1])}{roots}</worldbody><equality>{''.join(equalities)}</equality></mujoco>"
    )


def mass_matrix(model, data):
    """MuJoCo's mass matrix (nv, nv) of a state; `mj_fullM` takes other arguments in every major version."""
    M = np.zeros((model.nv, model.nv))
    for row, unit in zip(M, np.eye(model.nv), strict=True):  # of a symmetric matrix
        mujoco.mj_mulM(model, data, row, unit)
    return M


def ask_mujoco(mechanism, angles):
    """M, J and the angular J in the independent coordinates, at joint coordinates (n,)."""
    model = mujoco.MjModel.from_xml_string(mjcf(mechanism))
    data = mujoco.MjData(model)
    order = []
    for i in moving_links(mechanism):
        kind = mechanism.links.joint[i]
        if kind == BALL_X:
            data.joint(str(i)).qpos[:] = quaternion(Rotation.from_rotvec(angles[i : i + 3]).as_matrix())
            order += [int(model.joint(str(i)).dofadr[0]) + k for k in range(3)]
        elif kind in (REVOLUTE, PRISMATIC):
            data.joint(str(i)).qpos[:] = angles[i]
            order.append(int(model.joint(str(i)).dofadr[0]))
    mujoco.mj_forward(model, data)
    M = mass_matrix(model, data)
    A = data.efc_J.reshape(-1, model.nv)[: data.ne]
    J, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, J, angular, model.site("the handle").id)
    B, _, _ = to_independent(mechanism, A[:, order])
    return B.T @ M[np.ix_(order, order)] @ B, J[:, order] @ B, angular[:, order] @ B


def ask_pinocchio(mechanism, angles, rates):
    """M, J, the angular J and c in the independent coordinates, at joint coordinates (n,) and rates (c,)."""
    links, closures = mechanism.links, mechanism.closures
    model = pin.Model()
    model.gravity = pin.Motion.Zero()
    carrier, where = {-1: 0}, {-1: pin.SE3.Identity()}
    own, q = {}, {}
    for i in depth_first(links.parent):  # crba takes the columns of a subtree to stand side by side
        parent, kind = int(links.parent[i]), links.joint[i]
        here = where[parent] * pin.SE3(links.rotation[i], links.origin[i])
        carrier[i], where[i] = carrier[parent], here
        if kind in (REVOLUTE, PRISMATIC):
            of = pin.JointModelRevoluteUnaligned if kind == REVOLUTE else pin.JointModelPrismaticUnaligned
            carrier[i], where[i] = (
                model.addJoint(carrier[parent], of(links.axis[i]), here, links.names[i]),
                pin.SE3.Identity(),
            )
            own[i] = model.joints[carrier[i]].idx_v
            q[model.joints[carrier[i]].idx_q] = angles[i]
        elif kind == BALL_Z:
            carrier[i], where[i] = (
                model.addJoint(carrier[parent], pin.JointModelSpherical(), here, links.names[i]),
                pin.SE3.Identity(),
            )
            own |= {i - 2 + k: model.joints[carrier[i]].idx_v + k for k in range(3)}
            turn = Rotation.from_rotvec(angles[i - 2 : i + 1]).as_quat()
            q |= {model.joints[carrier[i]].idx_q + k: turn[k] for k in range(4)}
        inertia = pin.Inertia(float(links.mass[i]), links.center_of_mass[i], links.inertia[i])
        model.appendBodyToJoint(carrier[i], inertia, where[i])

    columns = [own[i] for i in moving_links(mechanism)]

    def frame(name, link, point):
        at = where[link] * pin.SE3(np.eye(3), point)
        return model.addFrame(pin.Frame(name, carrier[link], at, pin.FrameType.OP_FRAME))

    ends = [
        (
            frame(f"{name}-a", int(closures.a[c]), closures.point_a[c]),
            frame(f"{name}-b", int(closures.b[c]), closures.point_b[c]),
        )
        for c, name in enumerate(closures.names)
    ]
    handle = frame("handle", mechanism.handle_link, mechanism.handle_point)
    data = model.createData()
    q = np.array([q[k] for k in range(model.nq)])
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def rows(f):
        return pin.getFrameJacobian(model, data, f, aligned).reshape(6, model.nv)[:, columns]

    def closing(of_a, of_b, c, a):
        """The equations among six components of links a and b: of a point three, of an axis five of rank."""
        kind, apart = closing_kinds(closures)[c], of_a - of_b
        if kind == AXIS:
            z = data.oMf[a].rotation @ closures.axis_a[c]
            apart[3:] -= np.multiply.outer(z, z @ apart[3:])
        return apart[: 6 if kind in (AXIS, FRAME) else 3]

    A = [closing(rows(a), rows(b), c, a) for c, (a, b) in enumerate(ends)]
    A = np.concatenate([*A, np.zeros((0, len(columns)))])
    B, _, passive = to_independent(mechanism, A)
    J = rows(handle) @ B
    M = pin.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    M = B.T @ M[np.ix_(columns, columns)] @ B

    speeds, turning = np.zeros(model.nv), np.zeros(model.nv)
    speeds[columns] = B @ rates
    pin.forwardKinematics(model, data, q, speeds, turning)
    pin.updateFramePlacements(model, data)
    if passive:
        gap = []
        for c, (a, b) in enumerate(ends):
            acceleration = [pin.getFrameClassicalAcceleration(model, data, f, aligned).vector for f in (a, b)]
            gap.append(closing(*acceleration, c, a))
            if closing_kinds(closures)[c] == AXIS:  # the common axis turns with the links
                velocity = [pin.getFrameVelocity(model, data, f, aligned).angular for f in (a, b)]
                z = data.oMf[a].rotation @ closures.axis_a[c]
                gap[-1][3:] -= z @ (velocity[0] - velocity[1]) * np.cross(velocity[0], z)
        turning[np.array(columns)[passive]] = -np.linalg.lstsq(A[:, passive], np.concatenate(gap), rcond=None)[0]
    c = B.T @ pin.rnea(model, data, q, speeds, turning)[columns]
    return M, J[:3], J[3:], c
