"""Devices that move in space: postures, a map, a report, and the import of a robot file, each against its target.

Postures: 100 000 handle positions of a serial device with three drives (the bundled Phantom Premium 1.5) and of a
delta (the file that `zwidth new --kind delta` writes), with mass matrix, Jacobian, link-side mass and motor-side
mass along a direction across. The peers do the same job a posture at a time, on fewer postures, as a competent
user would write it: kinematics, mass matrix and constraint Jacobians of the engine, then the projection on the
drives in NumPy. They are handed our joint angles, which spares them the inverse kinematics. All numbers are
compared first.

The roadmap from which Newton starts is computed once per device and timed apart; so is processor time, which other
work on the machine disturbs less. Map and report are timed warm, after a smaller map and a first report that load
the kernels; no peer draws them.

Run: python benchmarks/spatial.py. Exit code 1 where a target is missed.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "model"))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table, seconds, verdict
from zwidth.device import Device, import_file, new_device
from zwidth.device.load import load
from zwidth.measures import OK as MEASURED
from zwidth.model import BALL_X, BALL_Z, OK, PRISMATIC, REVOLUTE, Mechanism, effective_parameters, solve_posture

POSTURES, FEWER_POSTURES, ENGINE_POSTURES, ROUNDS = 100_000, 20_000, 500, 5  # fewer: of our own cases
POSTURES_TARGET, MAP_TARGET, REPORT_TARGET, IMPORT_TARGET = 1.0, 3.0, 60.0, 1.0  # s
CLOSE = 1e-7  # largest relative difference between the numbers of two routes
CELLS = 100  # of the map, along each axis
ACROSS = np.array([0.0, 1.0, 0.0])
# positions are drawn this far around the reference [m]
SERIAL, DELTA = ("phantom-premium-1.5", 0.05), ("delta", 0.02)
LINKS, COVERS = 6, 4  # of the robot file: bodies with a motor, and fixed ones on each of them


@cache
def device(name: str) -> Device:
    """A bundled device, or the delta to start from."""
    if name != DELTA[0]:
        return load(name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "delta.toml"
        path.write_text(new_device("Delta", "delta"), encoding="utf-8")
        return load(str(path))


def positions(name: str, reach: float, count: int) -> np.ndarray:
    """Uniform over a cube around the device's reference, (count, 3) [m]."""
    around = np.random.default_rng(1).uniform(-reach, reach, (count, 3))
    return np.asarray(mechanism_of(name).reference_position) + around


def mechanism_of(name: str) -> Mechanism:
    """Links, loops and drives of a device."""
    mechanism = device(name).mechanism
    assert mechanism is not None
    return mechanism


def this_engine(mechanism: Mechanism, at: np.ndarray) -> np.ndarray:
    """Link-side and motor-side mass along the direction across, (N, 2) [kg]."""
    posture = solve_posture(mechanism, at)
    numbers = effective_parameters(mechanism, posture, ACROSS)
    assert (posture.status == OK).all()
    return np.stack([numbers.link_side_mass, numbers.motor_side_mass], axis=-1)


def masses(mechanism: Mechanism, M: np.ndarray, h: np.ndarray) -> tuple[float, float]:
    """Link-side and motor-side mass from the mass matrix (3, 3) and lever arms (3,) of the drives."""
    rotor = mechanism.drives.transmission**2 * mechanism.drives.motor_inertia
    return 1.0 / (h @ np.linalg.solve(M, h)), 1.0 / np.sum(h**2 / rotor)


def projection(A: np.ndarray, driven: list[int]) -> np.ndarray:
    """B (m, c) with q' = B p', p the driven joints, from the constraint Jacobian A (rows, m)."""
    passive = [j for j in range(A.shape[1]) if j not in driven]
    B = np.zeros((A.shape[1], len(driven)))
    B[driven] = np.eye(len(driven))
    if passive:
        B[passive] = -np.linalg.lstsq(A[:, passive], A[:, driven], rcond=None)[0]
    return B


def by_mujoco(mechanism: Mechanism, angles: np.ndarray) -> np.ndarray:
    """The same masses by MuJoCo at joint coordinates (N, n), a posture at a time."""
    import mujoco
    from model_engines import mjcf, quaternion
    from scipy.spatial.transform import Rotation

    model = mujoco.MjModel.from_xml_string(mjcf(mechanism))
    data, M, J = mujoco.MjData(model), np.zeros((model.nv, model.nv)), np.zeros((3, model.nv))
    kind, site = mechanism.links.joint, model.site("the handle").id
    of_qpos = {i: model.joint(str(i)).qposadr[0] for i in np.flatnonzero((kind == REVOLUTE) | (kind == PRISMATIC))}
    balls = {i: int(model.joint(str(i)).qposadr[0]) for i in np.flatnonzero(kind == BALL_X)}
    links, places = np.array(list(of_qpos)), np.array(list(of_qpos.values()))
    driven = [int(model.joint(str(i)).dofadr[0]) for i in mechanism.drives.joint]
    out = np.empty((len(angles), 2))
    for k, q in enumerate(angles):
        data.qpos[places] = q[links]
        for i, place in balls.items():
            data.qpos[place : place + 4] = quaternion(Rotation.from_rotvec(q[i : i + 3]).as_matrix())
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, M)
        mujoco.mj_jacSite(model, data, J, None, site)
        B = projection(data.efc_J.reshape(-1, model.nv)[: data.ne], driven)
        out[k] = masses(mechanism, B.T @ M @ B, J[1] @ B)
    return out


def pinocchio_model(mechanism: Mechanism):
    """The mechanism's tree, and of each link the joint that carries it and its place there."""
    import pinocchio as pin
    from model_engines import depth_first

    links, model = mechanism.links, pin.Model()
    carrier, where, first = {-1: 0}, {-1: pin.SE3.Identity()}, {}
    one_axis = {REVOLUTE: pin.JointModelRevoluteUnaligned, PRISMATIC: pin.JointModelPrismaticUnaligned}
    for i in depth_first(links.parent):
        parent, kind = int(links.parent[i]), int(links.joint[i])
        here = where[parent] * pin.SE3(links.rotation[i], links.origin[i])
        carrier[i], where[i] = carrier[parent], here
        if kind in one_axis or kind == BALL_Z:
            joint = one_axis[kind](links.axis[i]) if kind in one_axis else pin.JointModelSpherical()
            carrier[i] = model.addJoint(carrier[parent], joint, here, links.names[i])
            where[i], first[i] = pin.SE3.Identity(), model.joints[carrier[i]]
        inertia = pin.Inertia(float(links.mass[i]), links.center_of_mass[i], links.inertia[i])
        model.appendBodyToJoint(carrier[i], inertia, where[i])
    return model, carrier, where, first


def by_pinocchio(mechanism: Mechanism, angles: np.ndarray) -> np.ndarray:
    """The same masses by Pinocchio at joint coordinates (N, n), a posture at a time; its loops hold points."""
    import pinocchio as pin
    from scipy.spatial.transform import Rotation

    closures = mechanism.closures
    model, carrier, where, joints = pinocchio_model(mechanism)

    def frame(name: str, link: int, point: np.ndarray) -> int:
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
    data, aligned = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    driven = [joints[int(i)].idx_v for i in mechanism.drives.joint]
    balls = [i for i in joints if mechanism.links.joint[i] == BALL_Z]
    single = np.array([i for i in joints if i not in balls])
    places = np.array([joints[i].idx_q for i in single])

    def rows(f: int) -> np.ndarray:
        return pin.getFrameJacobian(model, data, f, aligned)[:3]

    q, out = pin.neutral(model), np.empty((len(angles), 2))
    for k, joint_angles in enumerate(angles):
        q[places] = joint_angles[single]
        for i in balls:
            q[joints[i].idx_q : joints[i].idx_q + 4] = Rotation.from_rotvec(joint_angles[i - 2 : i + 1]).as_quat()
        M = pin.crba(model, data, q)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        B = projection(np.concatenate([rows(a) - rows(b) for a, b in ends]), driven)
        M = np.triu(M) + np.triu(M, 1).T
        out[k] = masses(mechanism, B.T @ M @ B, rows(handle)[1] @ B)
    return out


def shortest(work: Callable[[], object], rounds: int = ROUNDS) -> tuple[float, float]:
    """Wall and processor seconds, each the shortest of a few rounds."""
    times = []
    for _ in range(rounds):
        wall, processor = time.perf_counter(), time.process_time()
        work()
        times.append((time.perf_counter() - wall, time.process_time() - processor))
    wall_times, processor_times = zip(*times, strict=True)
    return min(wall_times), min(processor_times)


def moved(name: str, times: int) -> Mechanism:
    """A mechanism whose handle is some nanometres elsewhere, so that its roadmap is not known yet."""
    mechanism = mechanism_of(name)
    return replace(mechanism, handle_point=mechanism.handle_point + np.array([0.0, 0.0, 1e-9 * times]))


def roadmap_time(name: str, at: np.ndarray) -> float:
    """Processor seconds that the first batch of a device takes longer than its second; its handle is moved by a
    nanometre, so that its roadmap is not known yet."""
    other = moved(name, 1)
    began = time.process_time()
    solve_posture(other, at)
    middle = time.process_time()
    solve_posture(other, at)
    return 2.0 * middle - began - time.process_time()


def compare_postures(name: str, reach: float) -> tuple[list[tuple[str, ...]], bool]:
    """Rows of the table of one device, and whether its target is reached."""
    mechanism, at = mechanism_of(name), positions(name, reach, POSTURES)
    few = at[:ENGINE_POSTURES]
    ours, angles = this_engine(mechanism, at), solve_posture(mechanism, few).angles
    road = roadmap_time(name, few)
    wall, processor = shortest(lambda: this_engine(mechanism, at))
    each = wall / POSTURES
    title = f"{name}, {POSTURES} postures in {seconds(wall)} (target {seconds(POSTURES_TARGET)}: "
    print(f"{title}{verdict(wall, POSTURES_TARGET)}); roadmap, once: {seconds(road)} of processor time")
    table = [(name, "zwidth", seconds(each), seconds(processor / POSTURES), "", "")]
    for peer, route in (("MuJoCo", by_mujoco), ("Pinocchio", by_pinocchio)):
        apart = float(np.abs(route(mechanism, angles) / ours[: len(few)] - 1.0).max())
        assert apart < CLOSE, f"{name}: {peer} and zwidth differ by {apart:.1e}"
        taken, busy = shortest(lambda route=route: route(mechanism, angles), rounds=3)
        taken, busy = taken / len(few), busy / len(few)
        table.append(("", peer, seconds(taken), seconds(busy), f"{taken / each:.1f}", f"{apart:.0e}"))
    return table, wall <= POSTURES_TARGET


def map_of_delta(cells: int) -> float:
    """Mean largest stiffness over a square of the delta's horizontal workspace [N/m]."""
    _, reach = DELTA
    x, y = np.meshgrid(np.linspace(-reach, reach, cells), np.linspace(-reach, reach, cells))
    reference = np.asarray(mechanism_of(DELTA[0]).reference_position)
    at = reference + np.stack([x, y, np.zeros_like(x)], axis=-1)
    found = device(DELTA[0]).at(at).measure("stiffness_max")
    assert (found.status == MEASURED).all()
    return float(found.values.mean())


def report_on_delta() -> int:
    """Length of the report's HTML [characters]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        device(DELTA[0]).report(path)
        return len(path.read_text(encoding="utf-8"))


def robot_file() -> str:
    """MJCF of an arm of six driven hinges, each of whose links carries covers: 30 bodies."""
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
    inertial = '<inertial pos="0.05 0 0" mass="0.2" diaginertia="1e-4 3e-4 3e-4"/>'
    cover = '<inertial pos="0 0 0" mass="0.02" diaginertia="1e-5 1e-5 1e-5"/>'
    body, motors, angles = '<site name="handle" pos="0.05 0 0"/>', "", "0 0.4 0.6 0.2 0.5 0.1"
    for k in reversed(range(LINKS)):
        covers = "".join(
            f'<body name="cover-{k}-{c}" pos="0.0{c + 1} 0 0.01">{cover}</body>' for c in range(COVERS)
        )
        place = "0.1 0 0" if k else "0 0 0"
        joint = f'<joint name="joint-{k}" axis="{axes[k]}" armature="1e-3" damping="0.01"/>'
        body = f'<body name="link-{k}" pos="{place}">{inertial}{joint}{covers}{body}</body>'
        motors = f'<motor name="motor-{k}" joint="joint-{k}" gear="10"/>{motors}'
    return (
        f'<mujoco model="arm"><compiler angle="radian"/><worldbody>{body}</worldbody><actuator>{motors}</actuator>'
        f'<keyframe><key name="bent" qpos="{angles}"/></keyframe></mujoco>'
    )


def import_robot() -> int:
    """Length of the device file that the robot file is imported to [characters]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.xml"
        path.write_text(robot_file(), encoding="utf-8")
        return len(import_file(path, handle="handle", keyframe="bent").text)


def postures_of(name: str, reach: float) -> TimedCase:
    """Many postures of one device in one call."""
    mechanism, at = mechanism_of(name), positions(name, reach, FEWER_POSTURES)
    return TimedCase(lambda: this_engine(mechanism, at).sum())


def cases() -> Cases:
    """Postures of both devices, the roadmap, the map, the report and the import."""
    postures = {
        f"{FEWER_POSTURES} postures of {name}": postures_of(name, reach) for name, reach in (SERIAL, DELTA)
    }
    few = positions(*DELTA, ENGINE_POSTURES)
    moves = count(1)

    def roadmap(mechanism: Mechanism) -> float:
        return solve_posture(mechanism, few).angles.sum()

    return postures | {
        "roadmap of a delta": TimedCase(roadmap, fresh=lambda: moved(DELTA[0], next(moves))),
        "report on a delta": TimedCase(report_on_delta),
        f"map of a delta, {CELLS} x {CELLS}": TimedCase(lambda: map_of_delta(CELLS)),
        f"import of {LINKS * (1 + COVERS)} bodies": TimedCase(import_robot),
    }


def main() -> int:
    """Compare, time, print; 1 where a target is missed."""
    print(machine("numpy", "numba", "mujoco", "pin"))
    rows: list[tuple[str, ...]] = []
    reached = []
    for name, reach in (SERIAL, DELTA):
        table, met = compare_postures(name, reach)
        rows += table
        reached.append(met)
    print()
    header = ("postures of", "by", "wall, each", "processor, each", "times zwidth", "numbers apart")
    print_table(header, rows)
    print()
    map_of_delta(10)
    import_robot()
    report_on_delta()
    others = [
        (f"map of the delta's largest stiffness, {CELLS} x {CELLS}", lambda: map_of_delta(CELLS), 3, MAP_TARGET),
        ("report on the delta", report_on_delta, 1, REPORT_TARGET),
        (f"import of MJCF with {LINKS * (1 + COVERS)} bodies", import_robot, 3, IMPORT_TARGET),
    ]
    rows = []
    for name, work, rounds, target in others:
        wall, processor = shortest(work, rounds)
        rows.append((name, seconds(wall), seconds(processor), f"{seconds(target)}: {verdict(wall, target)}"))
        reached.append(wall <= target)
    print_table(("warm", "wall", "processor", "target"), rows)
    return 0 if all(reached) else 1


if __name__ == "__main__":
    sys.exit(run(main, cases))
