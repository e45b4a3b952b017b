"""From handle position to effective parameters: the general engine, and what a competent user would write instead.

Each line does the same job for 100 000 positions of the five-bar: joint angles, mass matrix and handle Jacobian in
the driven coordinates, then link-side mass, motor-side mass and stiffness along y.

    this engine      Newton on the loop closures, any mechanism, one call for the batch
    closed form      this mechanism only, Appendix B of the thesis in NumPy over the whole batch
    Pinocchio        closed-form angles, then crba, frame Jacobians and the projection, a posture at a time
    MuJoCo           closed-form angles, then mj_forward, mj_fullM, efc_J and the projection, a posture at a time

The engines are timed on fewer postures and per posture. Every route's numbers are compared first.
Run: python benchmarks/posture.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "model"))

from model_cases import five_bar, two_bar_angles

from benchmarks._cases import Cases, TimedCase, run
from zwidth.model import OK, effective_parameters, solve_posture

POSTURES, ENGINE_POSTURES, ROUNDS, TARGET_US = 100_000, 2_000, 7, 2.0
ALONG_Y = np.array([0.0, 1.0, 0.0])
MECHANISM = five_bar()
N2 = MECHANISM.drives.transmission**2
ROTOR, SPRING = N2 * MECHANISM.drives.motor_inertia, N2 * MECHANISM.drives.stiffness


def positions(count):
    """Uniform over the workspace's annulus, a millimetre within its edges."""
    rng = np.random.default_rng(1)
    radius, angle = np.sqrt(rng.uniform(0.053**2, 0.345**2, count)), rng.uniform(-np.pi, np.pi, count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def this_engine(at):
    posture = solve_posture(MECHANISM, at)
    numbers = effective_parameters(MECHANISM, posture, ALONG_Y)
    assert (posture.status == OK).all()
    return np.stack([numbers.link_side_mass, numbers.motor_side_mass, numbers.stiffness], axis=-1)


def cases() -> Cases:
    """All postures in one call."""
    at = positions(POSTURES)
    return {f"{POSTURES} postures": TimedCase(lambda: this_engine(at).mean())}


def angles_of(at):
    """Closed-form joint angles (4, N) with the elbows outward, x and y of the handle being (N, 2)."""
    L1, L2, L3, L4 = MECHANISM.links.tip[:, 0]
    half = MECHANISM.links.origin[0, 0]
    x, y = at.T
    one, two = two_bar_angles(L1, L2, half, (x, y), 1), two_bar_angles(L3, L4, -half, (x, y), -1)
    return np.concatenate([one, two])


def numbers_of(M, J):
    """The three numbers from M (..., 2, 2) and the y-row h of J (..., 2)."""
    a, b, d = M[..., 0, 0], M[..., 0, 1], M[..., 1, 1]
    h, g = J[..., 0], J[..., 1]
    link = (a * d - b * b) / (d * h * h - 2 * b * h * g + a * g * g)
    motor = 1 / (h * h / ROTOR[0] + g * g / ROTOR[1])
    return np.stack([link, motor, 1 / (h * h / SPRING[0] + g * g / SPRING[1])], axis=-1)


def closed_form(at):
    q1, q2, q3, q4 = angles_of(at)
    L1, L2, L3, L4 = MECHANISM.links.tip[:, 0]
    m, I, c = MECHANISM.links.mass, MECHANISM.links.inertia[:, 2, 2], MECHANISM.links.center_of_mass
    s = np.sin(q3 + q4 - q1 - q2)
    zero, one = np.zeros_like(s), np.ones_like(s)
    B2 = np.stack([-L1 * np.sin(q3 + q4 - q1) / (L2 * s) - 1, L3 * np.sin(q4) / (L2 * s)], axis=-1)
    B4 = np.stack([-L1 * np.sin(q2) / (L4 * s), L3 * np.sin(q1 + q2 - q3) / (L4 * s) - 1], axis=-1)
    B1, B3 = np.stack([one, zero], axis=-1), np.stack([zero, one], axis=-1)
    M = 0.0
    for i, L, q, first, second in ((0, L1, q2, B1, B2), (2, L3, q4, B3, B4)):
        arm = L * (c[i + 1, 0] * np.cos(q) - c[i + 1, 1] * np.sin(q))
        corner = m[i + 1] * (c[i + 1] @ c[i + 1]) + I[i + 1]
        base = I[i] + m[i] * (c[i] @ c[i]) + m[i + 1] * (L * L + 2 * arm) + corner
        mixed = (corner + m[i + 1] * arm)[:, None, None] * (first[:, :, None] * second[:, None, :])
        M = M + base[:, None, None] * (first[:, :, None] * first[:, None, :])
        M = M + mixed + mixed.swapaxes(1, 2) + corner * (second[:, :, None] * second[:, None, :])
    h = (L1 * np.cos(q1) + L2 * np.cos(q1 + q2))[:, None] * B1 + (L2 * np.cos(q1 + q2))[:, None] * B2
    return numbers_of(M, h)


def to_driven(A):
    """B (4, 2) from the two planar closure rows A (2, 4) in the order of the joints."""
    B = np.zeros((4, 2))
    B[0, 0] = B[2, 1] = 1.0
    B[[1, 3]] = -np.linalg.solve(A[:, [1, 3]], A[:, [0, 2]])
    return B


def by_mujoco(at):
    import mujoco
    from model_engines import mjcf

    model = mujoco.MjModel.from_xml_string(mjcf(MECHANISM))
    data, M, J = mujoco.MjData(model), np.zeros((4, 4)), np.zeros((3, 4))
    site = model.site("the handle").id
    out = np.empty((len(at), 3))
    for k, q in enumerate(angles_of(at).T):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M)
        mujoco.mj_jacSite(model, data, J, None, site)
        B = to_driven(data.efc_J.reshape(-1, 4)[:2])
        out[k] = numbers_of(B.T @ M @ B, J[1] @ B)
    return out


def by_pinocchio(at):
    import pinocchio as pin

    links, model = MECHANISM.links, pin.Model()
    carrier = {-1: 0}
    for i, name in enumerate(links.names):
        placement = pin.SE3(np.eye(3), links.origin[i])
        carrier[i] = model.addJoint(carrier[int(links.parent[i])], pin.JointModelRZ(), placement, name)
        inertia = pin.Inertia(float(links.mass[i]), links.center_of_mass[i], links.inertia[i])
        model.appendBodyToJoint(carrier[i], inertia, pin.SE3.Identity())
    tips = [
        model.addFrame(pin.Frame(name, carrier[i], pin.SE3(np.eye(3), links.tip[i]), pin.FrameType.OP_FRAME))
        for i, name in ((1, "one"), (3, "two"))
    ]
    data, aligned = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    out = np.empty((len(at), 3))
    for k, q in enumerate(angles_of(at).T):
        M = pin.crba(model, data, q)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        one, two = (pin.getFrameJacobian(model, data, f, aligned)[:2] for f in tips)
        B = to_driven(one - two)
        M = np.triu(M) + np.triu(M, 1).T
        out[k] = numbers_of(B.T @ M @ B, one[1] @ B)
    return out


def best(function, at):
    """Seconds per posture, the shortest of a few rounds, after one call to load kernels."""
    function(at)
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        function(at)
        times.append(time.perf_counter() - start)
    return min(times) / len(at)


def main() -> int:
    at = positions(POSTURES)
    few = at[:ENGINE_POSTURES]
    truth = closed_form(at)
    routes = [
        ("this engine, Newton included", this_engine, at),
        ("closed form, this mechanism only", closed_form, at),
        ("Pinocchio, a posture at a time", by_pinocchio, few),
        ("MuJoCo, a posture at a time", by_mujoco, few),
    ]
    for name, route, where in routes:
        error = np.max(np.abs(route(where) / truth[: len(where)] - 1))
        assert error < 1e-7, f"{name} is off by {error:.1e}"
        print(f"{name:34s} agrees with the closed form to {error:.0e}")
    seconds = {name: best(route, where) for name, route, where in routes}
    mine = seconds[routes[0][0]]
    print()
    for name, value in seconds.items():
        print(f"{name:34s} {value * 1e6:8.2f} us a posture {value / mine:8.1f} x this engine")
    start = time.process_time()
    this_engine(at)
    processor = (time.process_time() - start) / len(at)
    print(f"\nprocessor time of this engine, all threads: {processor * 1e6:.2f} us a posture")
    met = mine * 1e6 <= TARGET_US
    print(f"\n{mine * 1e6:.2f} us a posture, at most {TARGET_US:g} wanted: {'met' if met else 'NOT MET'}")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(run(main, cases))
