"""Mechanisms handed to MuJoCo and Pinocchio: mass matrix, constraint and handle Jacobians, nonlinear terms.

Only their algebra is asked, at one configuration; nothing is simulated. Both describe all joints; `to_driven`
projects on the driven coordinates.
"""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np
import pinocchio as pin

from zwidth.model.mechanism import FIXED


def to_driven(mechanism, constraints):
    """B (m, d) with q' = B p' from the constraint Jacobian (rows, m), joints in the order of the links."""
    revolute = [i for i in range(len(mechanism.links.names)) if mechanism.links.joint[i] != FIXED]
    driven = [revolute.index(i) for i in mechanism.drives.joint]
    passive = [j for j in range(len(revolute)) if j not in driven]
    B = np.zeros((len(revolute), len(driven)))
    B[driven] = np.eye(len(driven))
    if passive:
        B[passive] = -np.linalg.lstsq(constraints[:, passive], constraints[:, driven], rcond=None)[0]
    return B, revolute, passive


def text(values):
    return " ".join(repr(float(v)) for v in np.ravel(values))


def mjcf(mechanism):
    """The mechanism as MJCF, its closures as `equality/connect` between sites."""
    links, closures = mechanism.links, mechanism.closures
    inside = {i: [] for i in range(-1, len(links.names))}
    for c, name in enumerate(closures.names):
        inside[int(closures.a[c])].append(
            f'<site name={quoteattr(name + "-a")} pos="{text(closures.point_a[c])}"/>'
        )
        inside[int(closures.b[c])].append(
            f'<site name={quoteattr(name + "-b")} pos="{text(closures.point_b[c])}"/>'
        )
    inside[mechanism.handle_link].append(f'<site name="the handle" pos="{text(mechanism.handle_point)}"/>')

    def body(i):
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, links.rotation[i].ravel())
        # principal axes outright: the engine finds its own to ten digits
        moments, axes = np.linalg.eigh(links.inertia[i])
        axes[:, 2] *= np.linalg.det(axes)
        principal = np.zeros(4)
        mujoco.mju_mat2Quat(principal, axes.ravel())
        joint = f'<joint name="{i}" axis="{text(links.axis[i])}"/>' if links.joint[i] != FIXED else ""
        children = "".join(body(j) for j in range(len(links.names)) if links.parent[j] == i)
        return (
            f'<body pos="{text(links.origin[i])}" quat="{text(quaternion)}">{joint}'
            f'<inertial pos="{text(links.center_of_mass[i])}" mass="{text(links.mass[i])}" '
            f'diaginertia="{text(moments)}" quat="{text(principal)}"/>{"".join(inside[i])}{children}</body>'
        )

    roots = "".join(body(i) for i in range(len(links.names)) if links.parent[i] < 0)
    loops = "".join(f"<connect site1={quoteattr(n + '-a')} site2={quoteattr(n + '-b')}/>" for n in closures.names)
    return (
        '<mujoco><compiler angle="radian" balanceinertia="false"/><option gravity="0 0 0" jacobian="dense"/>'
        f"<worldbody>{''.join(inside[-1])}{roots}</worldbody><equality>{loops}</equality></mujoco>"
    )


def ask_mujoco(mechanism, angles):
    """M and J in the driven coordinates, at joint angles (n,)."""
    model = mujoco.MjModel.from_xml_string(mjcf(mechanism))
    data = mujoco.MjData(model)
    moving = [i for i in range(len(angles)) if mechanism.links.joint[i] != FIXED]
    for i in moving:
        data.joint(str(i)).qpos[:] = angles[i]
    mujoco.mj_forward(model, data)
    order = [int(model.joint(str(i)).dofadr[0]) for i in moving]
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    A = data.efc_J.reshape(-1, model.nv)[: data.ne]
    J = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, J, None, model.site("the handle").id)
    B, _, _ = to_driven(mechanism, A[:, order])
    return B.T @ M[np.ix_(order, order)] @ B, J[:, order] @ B


def ask_pinocchio(mechanism, angles, driven_rates):
    """M, J and c in the driven coordinates, at joint angles (n,) and rates (d,) of the drives."""
    links, closures = mechanism.links, mechanism.closures
    model = pin.Model()
    model.gravity = pin.Motion.Zero()
    carrier, place = {-1: 0}, {-1: pin.SE3.Identity()}
    for i in range(len(links.names)):
        parent = int(links.parent[i])
        here = place[parent] * pin.SE3(links.rotation[i], links.origin[i])
        if links.joint[i] == FIXED:
            carrier[i], place[i] = carrier[parent], here
        else:
            carrier[i] = model.addJoint(
                carrier[parent], pin.JointModelRevoluteUnaligned(links.axis[i]), here, links.names[i]
            )
            place[i] = pin.SE3.Identity()
        inertia = pin.Inertia(float(links.mass[i]), links.center_of_mass[i], links.inertia[i])
        model.appendBodyToJoint(carrier[i], inertia, place[i])

    def frame(name, link, point):
        where = place[link] * pin.SE3(np.eye(3), point)
        return model.addFrame(pin.Frame(name, carrier[link], where, pin.FrameType.OP_FRAME))

    ends = [
        (
            frame(f"{name}-a", int(closures.a[c]), closures.point_a[c]),
            frame(f"{name}-b", int(closures.b[c]), closures.point_b[c]),
        )
        for c, name in enumerate(closures.names)
    ]
    handle = frame("handle", mechanism.handle_link, mechanism.handle_point)
    data = model.createData()
    moving = [i for i in range(len(angles)) if links.joint[i] != FIXED]
    columns = [model.joints[carrier[i]].idx_v for i in moving]
    q = np.zeros(model.nq)
    q[columns] = angles[moving]
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def rows(f):
        return pin.getFrameJacobian(model, data, f, aligned)[:3][:, columns]

    A = np.concatenate([rows(a) - rows(b) for a, b in ends] or [np.zeros((0, len(columns)))])
    B, _, passive = to_driven(mechanism, A)
    J = rows(handle) @ B
    M = pin.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    M = B.T @ M[np.ix_(columns, columns)] @ B

    rates, turning = np.zeros(model.nv), np.zeros(model.nv)
    rates[columns] = B @ driven_rates
    pin.forwardKinematics(model, data, q, rates, turning)
    if passive:
        gap = np.concatenate(
            [
                pin.getFrameClassicalAcceleration(model, data, a, aligned).linear
                - pin.getFrameClassicalAcceleration(model, data, b, aligned).linear
                for a, b in ends
            ]
        )
        turning[np.array(columns)[passive]] = -np.linalg.lstsq(A[:, passive], gap, rcond=None)[0]
    c = B.T @ pin.rnea(model, data, q, rates, turning)[columns]
    return M, J, c
