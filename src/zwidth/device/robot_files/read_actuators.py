"""From MuJoCo's actuators, fixed tendons and equality constraints to motors, closures and followers."""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.device.robot_files.robot import Follower, Motor, Robot, RobotClosure, rotation_of_quaternion

PARALLEL = 1e-9  # share of a length by which two points of an axis may differ in two bodies


def read_actuators(mujoco: Any, model: Any, robot: Robot) -> None:
    """Add the motors of a model to a robot, one for each joint; its `motors` stay None where it has no
    actuator."""
    if not model.nu:
        return
    motors: dict[str, Motor] = {}
    count = int(model.nactuator) if hasattr(model, "nactuator") else len(model.actuator_trntype)
    for actuator in range(count):
        motor = _motor(mujoco, model, actuator, robot)
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


def _motor(mujoco: Any, model: Any, actuator: int, robot: Robot) -> Motor | None:
    """The motor of an actuator, given by its index; its joint is that of the largest gear. None for one that is no
    motor, about which a finding is added."""
    kinds, name = mujoco.mjtTrn, model.actuator(actuator).name
    where = f"actuator '{name or actuator}'"
    turns = _turns(mujoco, model, actuator)
    if not turns:
        kind = kinds(int(model.actuator_trntype[actuator])).name.removeprefix("mjTRN_").lower()
        robot.warn(where, f"acts on a {kind}, not on the coordinate of a joint; it is left out")
        return None
    if int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_MUSCLE):
        robot.warn(where, "is a muscle, and no motor; it is left out")
        return None
    joint = max(turns, key=lambda one: abs(turns[one]))
    if turns[joint] < 0.0:
        robot.note(where, f"has the gear {turns[joint]:.6g}; the motor's angle counts the other way round")
        turns = {one: -gear for one, gear in turns.items()}
    if int(model.actuator_biastype[actuator]) != int(mujoco.mjtBias.mjBIAS_NONE):
        robot.note(where, "has a control law of its own (position, velocity or bias); it is left out")
    if int(model.actuator_dyntype[actuator]) != int(mujoco.mjtDyn.mjDYN_NONE):
        robot.note(where, "has a lag; it is left out: loop.actuator.time_constant_s holds one")
    return Motor(
        name or joint,
        joint,
        turns,
        _rotor(mujoco, model, actuator),
        _torque(mujoco, model, actuator, turns[joint]),
    )


def _turns(mujoco: Any, model: Any, actuator: int) -> dict[str, float]:
    """Joint name -> motor turns per turn of that joint (per metre of a slide) of an actuator, given by its index;
    empty where it does not act on joints of one coordinate."""
    kinds, gear = mujoco.mjtTrn, float(model.actuator_gear[actuator, 0])
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    # MuJoCo's types of joints: 0 free, 1 ball, 2 slide, 3 hinge
    if kind in (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT)):
        coefficients = {target: 1.0} if int(model.jnt_type[target]) >= 2 else {}
    elif kind == int(kinds.mjTRN_TENDON):
        coefficients = _fixed_tendon(mujoco, model, target)
    else:
        coefficients = {}
    return {
        model.joint(joint).name: gear * coefficient
        for joint, coefficient in coefficients.items()
        if gear * coefficient
    }


def _fixed_tendon(mujoco: Any, model: Any, tendon: int) -> dict[int, float]:
    """Coefficient of each joint, by its index, in a fixed tendon; empty for a spatial tendon."""
    first = int(model.tendon_adr[tendon])
    steps = range(first, first + int(model.tendon_num[tendon]))
    if any(int(model.wrap_type[step]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for step in steps):
        return {}
    return {int(model.wrap_objid[step]): float(model.wrap_prm[step]) for step in steps}


def _rotor(mujoco: Any, model: Any, actuator: int) -> float:
    """Inertia of an actuator's rotor at the motor [kg m²]: its own, and over the square of the gear that of its
    tendon. The armature of joints is not in it."""
    own = float(model.actuator_armature[actuator]) if hasattr(model, "actuator_armature") else 0.0
    if int(model.actuator_trntype[actuator]) != int(mujoco.mjtTrn.mjTRN_TENDON):
        return own
    tendon = int(model.actuator_trnid[actuator, 0])
    of_tendon = float(model.tendon_armature[tendon]) if hasattr(model, "tendon_armature") else 0.0
    return own + of_tendon / float(model.actuator_gear[actuator, 0]) ** 2


def _torque(mujoco: Any, model: Any, actuator: int, gear: float) -> float | None:
    """Largest torque that an actuator gives both ways, at the motor; None where nothing limits it.

    gear  motor turns per turn of its joint
    """
    limits = []  # lower and upper limit of each kind [N m]
    torque_is_command = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_FIXED) and int(
        model.actuator_biastype[actuator]
    ) == int(mujoco.mjtBias.mjBIAS_NONE)
    if torque_is_command and model.actuator_ctrllimited[actuator]:
        limits.append(float(model.actuator_gainprm[actuator, 0]) * model.actuator_ctrlrange[actuator])
    if model.actuator_forcelimited[actuator]:
        limits.append(model.actuator_forcerange[actuator])
    if int(model.actuator_trntype[actuator]) == int(mujoco.mjtTrn.mjTRN_JOINT):
        joint = int(model.actuator_trnid[actuator, 0])
        if hasattr(model, "jnt_actfrclimited") and model.jnt_actfrclimited[joint]:
            limits.append(model.jnt_actfrcrange[joint] / gear)
    both_ways = [float(np.abs(limit).min()) for limit in limits if limit[0] * limit[1] < 0.0]
    return min(both_ways, default=None)


def read_equalities(mujoco: Any, model: Any, robot: Robot) -> None:
    """Add closures and followers of a model to a robot, and tell what of its constraints is left out."""
    kinds = mujoco.mjtEq
    connects: dict[tuple[int, int], list[RobotClosure]] = {}
    for equality in range(model.neq):
        kind, name = int(model.eq_type[equality]), model.equality(equality).name or f"loop-{equality + 1}"
        where = f"equality '{name}'"
        if not model.eq_active0[equality]:
            robot.note(where, "is not active in the file; it is left out")
        elif kind == int(kinds.mjEQ_JOINT):
            _add_follower(model, equality, name, robot)
        elif kind in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
            closure = _closure(mujoco, model, equality, name)
            if any(model.body_mocapid[body] >= 0 for body in closure.bodies):
                robot.warn(where, "holds a body to one that the simulation moves (mocap); it is left out")
            elif closure.bodies[0] == closure.bodies[1]:
                robot.warn(where, "holds a body to itself; it is left out")
            elif closure.closes == "point":
                first, second = closure.bodies
                connects.setdefault((min(first, second), max(first, second)), []).append(closure)
            else:
                robot.closures.append(closure)
            _tell_of_softness(model, equality, robot)
        else:
            kind_name = kinds(kind).name.removeprefix("mjEQ_").lower()
            robot.warn(
                where, f"is a constraint of the kind {kind_name}, which a device file cannot hold; it is left out"
            )
    for together in connects.values():
        robot.closures += _joined_closures(together, robot)


def _closure(mujoco: Any, model: Any, equality: int, name: str) -> RobotClosure:
    """A connect or weld constraint of MuJoCo as a closure of two bodies, or of those that two sites are on.

    `eq_data` of a connect holds the point in the first body's frame, then in the second's; of a weld the point in
    the second body's, then in the first's, the quaternion of the second body in the first at [6:10], and at [10]
    how much the orientation counts: with 0 it holds points only.
    """
    first, second = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
    data = np.array(model.eq_data[equality])
    weld = int(model.eq_type[equality]) == int(mujoco.mjtEq.mjEQ_WELD)
    if int(model.eq_objtype[equality]) == int(mujoco.mjtObj.mjOBJ_SITE):
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


def _joined_closures(closures: list[RobotClosure], robot: Robot) -> list[RobotClosure]:
    """What several point closures of the same two bodies hold together: one axis, if their points are in line,
    else the closures as they are."""
    if len(closures) == 1:
        return closures
    first = closures[0]
    # (2, 3) of each closure: its points in the two bodies, in the order of the first closure's bodies
    ends = [closure.points if closure.bodies == first.bodies else closure.points[::-1] for closure in closures]
    offsets = [end - first.points for end in ends[1:]]
    longest = max(offsets, key=lambda offset: float(np.linalg.norm(offset[0])))
    length = float(np.linalg.norm(longest[0]))
    in_line = all(
        np.linalg.norm(np.cross(offset[k], longest[k])) <= 1e-9 * length**2 for offset in offsets for k in (0, 1)
    )
    alike = all(
        abs(np.linalg.norm(offset[0]) - np.linalg.norm(offset[1])) <= PARALLEL * max(length, 1e-9)
        for offset in offsets
    )
    if length == 0.0 or not in_line or not alike:
        return closures
    names = ", ".join(f"'{closure.name}'" for closure in closures)
    robot.note(f"equality {names}", "hold two bodies at points of one axis; the device file closes the axis")
    axes = longest / np.linalg.norm(longest, axis=1, keepdims=True)
    return [RobotClosure(first.name, first.bodies, first.points, "axis", axes=axes)]


def _add_follower(model: Any, equality: int, name: str, robot: Robot) -> None:
    """Add to a robot the joint that equality number `equality` lets follow another; its five numbers are those of
    a polynomial in the leader's coordinate. Without a leader the joint is held where it stands."""
    joint, leader = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
    coefficients = np.array(model.eq_data[equality, :5])
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


def _tell_of_softness(model: Any, equality: int, robot: Robot) -> None:
    """Add the finding that an equality of MuJoCo, given by its number, is soft and the device file's is exact."""
    where = f"equality '{model.equality(equality).name or f'loop-{equality + 1}'}'"
    time_constant, damping_ratio = (float(x) for x in model.eq_solref[equality])
    soft = f"solref {time_constant:g} {damping_ratio:g}"
    robot.note(where, f"soft in MuJoCo ({soft}), held exactly by the device file")


def read_the_rest(mujoco: Any, model: Any, robot: Robot) -> None:
    """Add findings about tendons, bodies that bend and plug-ins, for which a device file has no place."""
    pulling = [
        actuator
        for actuator, kind in enumerate(model.actuator_trntype)
        if int(kind) == int(mujoco.mjtTrn.mjTRN_TENDON)
    ]
    driving = {int(model.actuator_trnid[actuator, 0]) for actuator in pulling}
    for tendon in range(model.ntendon):
        where = f"tendon '{model.tendon(tendon).name or tendon}'"
        springy = (
            model.tendon_stiffness[tendon] or model.tendon_damping[tendon] or model.tendon_frictionloss[tendon]
        )
        if springy:
            robot.warn(where, "has stiffness, damping or friction; they are left out")
        if model.tendon_limited[tendon]:
            robot.warn(where, "has a limit; it is left out")
        if tendon not in driving and not springy:
            robot.note(where, "drives nothing; it is left out")
    if getattr(model, "nflex", 0):
        robot.warn("flex", "bodies that bend are left out")
    if getattr(model, "nplugin", 0):
        robot.warn("plugin", "what plug-ins do is left out")
