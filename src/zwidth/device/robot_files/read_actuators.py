"""From MuJoCo's actuators, fixed tendons and equality constraints to motors, closures and followers."""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.device.robot_files.robot import Follower, Motor, Robot, RobotClosure, rotation_of_quaternion

PARALLEL = 1e-9  # share of a length by which two points of an axis may differ in two bodies


def read_actuators(mujoco: Any, model: Any, robot: Robot) -> None:
    """Add the motors of a model to a robot; None where it has no actuator."""
    if not model.nu:
        return
    motors: dict[str, Motor] = {}
    count = int(model.nactuator) if hasattr(model, "nactuator") else len(model.actuator_trntype)
    for a in range(count):
        motor = _motor(mujoco, model, a, robot)
        if motor is None:
            continue
        if motor.joint in motors:
            robot.note(
                f"actuator '{motor.name}'",
                f"drives the joint of '{motors[motor.joint].name}' too; one drive is made",
            )
            continue
        motors[motor.joint] = motor
    robot.motors = list(motors.values())


def _motor(mujoco: Any, model: Any, a: int, robot: Robot) -> Motor | None:
    """The motor of an actuator; None for one that is no motor, which is told."""
    kinds, name = mujoco.mjtTrn, model.actuator(a).name
    where = f"actuator '{name or a}'"
    turns = _turns(mujoco, model, a)
    if not turns:
        kind = kinds(int(model.actuator_trntype[a])).name.removeprefix("mjTRN_").lower()
        robot.warn(where, f"acts on a {kind}, not on the coordinate of a joint; it is left out")
        return None
    if int(model.actuator_gaintype[a]) == int(mujoco.mjtGain.mjGAIN_MUSCLE):
        robot.warn(where, "is a muscle, and no motor; it is left out")
        return None
    joint = max(turns, key=lambda one: abs(turns[one]))
    if turns[joint] < 0.0:
        robot.note(where, f"has the gear {turns[joint]:.6g}; the motor's angle counts the other way round")
        turns = {one: -gear for one, gear in turns.items()}
    if int(model.actuator_biastype[a]) != int(mujoco.mjtBias.mjBIAS_NONE):
        robot.note(where, "has a control law of its own (position, velocity or bias); it is left out")
    if int(model.actuator_dyntype[a]) != int(mujoco.mjtDyn.mjDYN_NONE):
        robot.note(where, "has a lag; it is left out: loop.actuator.time_constant_s holds one")
    return Motor(name or joint, joint, turns, _rotor(mujoco, model, a), _torque(mujoco, model, a, turns[joint]))


def _turns(mujoco: Any, model: Any, a: int) -> dict[str, float]:
    """Motor turns per turn of each joint; empty where the actuator does not act on joints of one coordinate."""
    kinds, gear = mujoco.mjtTrn, float(model.actuator_gear[a, 0])
    kind, target = int(model.actuator_trntype[a]), int(model.actuator_trnid[a, 0])
    if kind in (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT)):
        parts = {target: 1.0} if int(model.jnt_type[target]) >= 2 else {}
    elif kind == int(kinds.mjTRN_TENDON):
        parts = _fixed_tendon(mujoco, model, target)
    else:
        parts = {}
    return {model.joint(j).name: gear * part for j, part in parts.items() if gear * part}


def _fixed_tendon(mujoco: Any, model: Any, tendon: int) -> dict[int, float]:
    """Coefficient of each joint, by its index, in a fixed tendon; empty for a spatial tendon."""
    first = int(model.tendon_adr[tendon])
    steps = range(first, first + int(model.tendon_num[tendon]))
    if any(int(model.wrap_type[k]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for k in steps):
        return {}
    return {int(model.wrap_objid[k]): float(model.wrap_prm[k]) for k in steps}


def _rotor(mujoco: Any, model: Any, a: int) -> float:
    """Inertia of the rotor at the motor that the file gives the motor, or its tendon; that of joints comes to
    it."""
    own = float(model.actuator_armature[a]) if hasattr(model, "actuator_armature") else 0.0
    if int(model.actuator_trntype[a]) != int(mujoco.mjtTrn.mjTRN_TENDON):
        return own
    tendon = int(model.actuator_trnid[a, 0])
    along = float(model.tendon_armature[tendon]) if hasattr(model, "tendon_armature") else 0.0
    return own + along / float(model.actuator_gear[a, 0]) ** 2


def _torque(mujoco: Any, model: Any, a: int, gear: float) -> float | None:
    """Largest torque that the motor gives both ways; None where nothing limits it."""
    limits = []
    plain = int(model.actuator_gaintype[a]) == int(mujoco.mjtGain.mjGAIN_FIXED) and int(
        model.actuator_biastype[a]
    ) == int(mujoco.mjtBias.mjBIAS_NONE)
    if plain and model.actuator_ctrllimited[a]:
        limits.append(float(model.actuator_gainprm[a, 0]) * model.actuator_ctrlrange[a])
    if model.actuator_forcelimited[a]:
        limits.append(model.actuator_forcerange[a])
    if int(model.actuator_trntype[a]) == int(mujoco.mjtTrn.mjTRN_JOINT):
        joint = int(model.actuator_trnid[a, 0])
        if hasattr(model, "jnt_actfrclimited") and model.jnt_actfrclimited[joint]:
            limits.append(model.jnt_actfrcrange[joint] / gear)
    both_ways = [float(np.abs(one).min()) for one in limits if one[0] * one[1] < 0.0]
    return min(both_ways, default=None)


def read_equalities(mujoco: Any, model: Any, robot: Robot) -> None:
    """Add closures and followers of a model to a robot, and tell what of its constraints is left out."""
    kinds = mujoco.mjtEq
    connects: dict[tuple[int, int], list[RobotClosure]] = {}
    for e in range(model.neq):
        kind, name = int(model.eq_type[e]), model.equality(e).name or f"loop-{e + 1}"
        where = f"equality '{name}'"
        if not model.eq_active0[e]:
            robot.note(where, "is not active in the file; it is left out")
        elif kind == int(kinds.mjEQ_JOINT):
            _follow(model, e, name, robot)
        elif kind in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
            closure = _closure(mujoco, model, e, name)
            if any(model.body_mocapid[b] >= 0 for b in closure.bodies):
                robot.warn(where, "holds a body to one that the simulation moves (mocap); it is left out")
            elif closure.bodies[0] == closure.bodies[1]:
                robot.warn(where, "holds a body to itself; it is left out")
            elif closure.closes == "point":
                a, b = closure.bodies
                connects.setdefault((min(a, b), max(a, b)), []).append(closure)
            else:
                robot.closures.append(closure)
            _tell_of_softness(model, e, robot)
        else:
            kind_name = kinds(kind).name.removeprefix("mjEQ_").lower()
            robot.warn(
                where, f"is a constraint of the kind {kind_name}, which a device file cannot hold; it is left out"
            )
    for together in connects.values():
        robot.closures += _joined(together, robot)


def _closure(mujoco: Any, model: Any, e: int, name: str) -> RobotClosure:
    """A connect or weld constraint of MuJoCo as a closure of two bodies.

    `eq_data` of a connect holds the point in the first body's frame, then in the second's; of a weld the point in
    the second body's, then in the first's, the quaternion of the second body in the first at [6:10], and at [10]
    how much the orientation counts: with 0 it holds points only.
    """
    first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    data = np.array(model.eq_data[e])
    weld = int(model.eq_type[e]) == int(mujoco.mjtEq.mjEQ_WELD)
    if int(model.eq_objtype[e]) == int(mujoco.mjtObj.mjOBJ_SITE):
        points = np.array(model.site_pos[[first, second]])
        R1, R2 = (rotation_of_quaternion(model.site_quat[one]) for one in (first, second))
        turn = R1 @ R2.T
        bodies = int(model.site_bodyid[first]), int(model.site_bodyid[second])
    else:
        points = np.array([data[3:6], data[:3]] if weld else [data[:3], data[3:6]])
        turn = rotation_of_quaternion(data[6:10]) if weld and data[6:10].any() else np.eye(3)
        bodies = first, second
    if not weld or data[10] == 0.0:
        return RobotClosure(name, bodies, points)
    return RobotClosure(name, bodies, points, "frame", turn=turn)


def _joined(closures: list[RobotClosure], robot: Robot) -> list[RobotClosure]:
    """Closures of two bodies by points: two of them make an axis, three that are not in line the whole body."""
    if len(closures) == 1:
        return closures
    first = closures[0]
    ends = [c.points if c.bodies == first.bodies else c.points[::-1] for c in closures]
    along = [end - first.points for end in ends[1:]]
    longest = max(along, key=lambda one: float(np.linalg.norm(one[0])))
    length = float(np.linalg.norm(longest[0]))
    in_line = all(
        np.linalg.norm(np.cross(one[k], longest[k])) <= 1e-9 * length**2 for one in along for k in (0, 1)
    )
    alike = all(
        abs(np.linalg.norm(one[0]) - np.linalg.norm(one[1])) <= PARALLEL * max(length, 1e-9) for one in along
    )
    if length == 0.0 or not in_line or not alike:
        return closures
    names = ", ".join(f"'{c.name}'" for c in closures)
    robot.note(f"equality {names}", "hold two bodies at points of one axis; the device file closes the axis")
    axes = longest / np.linalg.norm(longest, axis=1, keepdims=True)
    return [RobotClosure(first.name, first.bodies, first.points, "axis", axes=axes)]


def _follow(model: Any, e: int, name: str, robot: Robot) -> None:
    """A joint that follows another by a polynomial, or is held where it stands."""
    joint, leader = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    coefficients = np.array(model.eq_data[e, :5])
    robot.followers.append(
        Follower(
            f"equality '{name}'",
            model.joint(joint).name,
            "" if leader < 0 else model.joint(leader).name,
            float(coefficients[1]),
            float(coefficients[0]),
            linear=not coefficients[2:].any(),
        )
    )


def _tell_of_softness(model: Any, e: int, robot: Robot) -> None:
    """Add the finding that MuJoCo's equality number `e` is soft and the device file's is exact."""
    where = f"equality '{model.equality(e).name or f'loop-{e + 1}'}'"
    time, ratio = (float(x) for x in model.eq_solref[e])
    soft = f"solref {time:g} {ratio:g}"
    robot.note(where, f"soft in MuJoCo ({soft}), held exactly by the device file")


def read_the_rest(mujoco: Any, model: Any, robot: Robot) -> None:
    """Tell what else of a model a device file has no place for."""
    pulling = [a for a, kind in enumerate(model.actuator_trntype) if int(kind) == int(mujoco.mjtTrn.mjTRN_TENDON)]
    driving = {int(model.actuator_trnid[a, 0]) for a in pulling}
    for t in range(model.ntendon):
        where = f"tendon '{model.tendon(t).name or t}'"
        springy = model.tendon_stiffness[t] or model.tendon_damping[t] or model.tendon_frictionloss[t]
        if springy:
            robot.warn(where, "has stiffness, damping or friction; they are left out")
        if model.tendon_limited[t]:
            robot.warn(where, "has a limit; it is left out")
        if t not in driving and not springy:
            robot.note(where, "drives nothing; it is left out")
    if getattr(model, "nflex", 0):
        robot.warn("flex", "bodies that bend are left out")
    if getattr(model, "nplugin", 0):
        robot.warn("plugin", "what plug-ins do is left out")
