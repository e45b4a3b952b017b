"""The operator's arm as a chain of bodies that holds the handle (thesis 2.1): joints with muscles, and a grasp.

The arm's joints have springs and dampers about the posture in which it holds the handle, as muscles have that hold
a set-point. With M, B, K of its joints, J (3, a) of its hand, and F the force of the hand on the handle, the arm
feels -F, whose lever arms change as it moves:

    M q'' + B q' + (K + F . d2x/dq2 - dw/dq) q = -J^T df

A rigid grasp lets hand and handle move together, J_h x' = J q', and turn as they like; what joints the arm has
beyond that move by themselves. An elastic grasp is a spring and a damper between the two, the same in all
directions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.errors import OperatorError
from zwidth.model.continuation import moved_posture
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.motions import Motions
from zwidth.model.plant import Plant

STEPS: Final = 100  # of the search for the arm's posture
LARGEST_STEP: Final = 0.2  # of a joint at once [rad], [m]
REACHED: Final = 1e-12  # m
STRETCHED: Final = 1e-6  # share of the hand's largest motion below which the arm cannot move it along


@dataclass(frozen=True)
class Arm:
    """A chain of bodies.

    mechanism   its links, joints and hand, the handle of this mechanism; all joints are free, and its assembly
                "held" is the posture in which it holds the handle
    shoulder    (3,)  place of its base in the device's base frame [m]; None: where the assembly's angles have the
                hand at the handle, wherever that is
    grasp_stiffness, grasp_damping  [N/m], [N s/m]; None: the grasp is rigid
    """

    mechanism: Mechanism
    shoulder: Floats | None = None
    grasp_stiffness: float | None = None
    grasp_damping: float = 0.0


def attach_arm(plant: Plant, arm: Arm, handle: Floats, place: Floats, force: Floats, gravity: Floats) -> Plant:
    """The plant of a device with an arm at its handle.

    handle   (3, n)  motion of the handle per coordinate of the plant
    place    (3,)    of the handle [m]
    force    (3,)    of the hand on the handle [N], 0 without load;   gravity (3,) on the arm [m/s²]
    Returns  Plant, the arm's joints among its last coordinates
    Raises   OperatorError  where the arm cannot reach the handle, or cannot move with it
    """
    motions = Motions(pack(arm.mechanism), _arm_posture(arm, place))
    hand, links, joints = motions.handle, arm.mechanism.links, motions.unknowns
    zeros = np.zeros(len(links.names))
    springs, dampers = (
        np.diag((zeros if each is None else np.asarray(each))[joints])
        for each in (links.joint_stiffness, links.joint_damping)
    )
    # K + F . d2x/dq2 - dw/dq, see the head of this file
    arm_stiffness = springs + np.tensordot(force, hand.speed_2, 1) - motions.weight(gravity)[1]
    names = tuple(f"arm {links.names[joint]}" for joint in joints)
    uncoupled = plant.padded(names)
    of_arm = slice(plant.size, None)
    uncoupled.mass[of_arm, of_arm], uncoupled.damping[of_arm, of_arm], uncoupled.stiffness[of_arm, of_arm] = (
        motions.mass_matrix(),
        dampers,
        arm_stiffness,
    )
    slip = np.hstack([-handle, hand.speed])  # velocity of the hand against the handle per unit rate, (3, n + a)
    if arm.grasp_stiffness is not None:
        grasp = slip.T @ slip
        return replace(
            uncoupled,
            damping=uncoupled.damping + arm.grasp_damping * grasp,
            stiffness=uncoupled.stiffness + arm.grasp_stiffness * grasp,
        )
    return replace(
        uncoupled.on_motions(_shared_motions(handle, hand.speed)),
        names=(*plant.names, *_names_of_arm_motions(names, hand.speed)),
    )


def _shared_motions(handle: Floats, hand: Floats) -> Floats:
    """Motions (n + a, n + a - r) in which hand and handle move together, r being the rank of `hand`: the first n
    move the handle and the arm with it, the others the arm alone.

    handle, hand  (3, n), (3, a)  velocity per unit rate of each coordinate of the plant, of each joint of the arm
    Raises        OperatorError   where the hand cannot follow the handle
    """
    left, singular, right = np.linalg.svd(hand)
    rank = int(np.count_nonzero(singular > STRETCHED * singular[0])) if len(singular) else 0
    out_of_reach = handle.T @ left[:, rank:]
    if np.max(np.abs(out_of_reach), initial=0.0) > STRETCHED * np.max(np.abs(handle), initial=0.0):
        raise OperatorError(
            "the arm cannot move its hand in every direction in which the handle moves; is it stretched, or does "
            "it need another joint? Bend it in its posture, or give it an elastic grasp"
        )
    n, a = handle.shape[1], hand.shape[1]
    follow = np.linalg.pinv(hand, rcond=STRETCHED) @ handle
    arm_only = right[rank:].T
    return np.block([[np.eye(n), np.zeros((n, a - rank))], [follow, arm_only]])


def _names_of_arm_motions(joint_names: tuple[str, ...], hand: Floats) -> tuple[str, ...]:
    """The names "arm 1", "arm 2", ... of the motions of the arm that leave the hand at rest, as many as it has
    joints beyond the rank of `hand` (3, a), its velocity per unit rate of each joint.
    """
    singular = np.linalg.svd(hand, compute_uv=False)
    rank = int(np.count_nonzero(singular > STRETCHED * singular[0])) if len(singular) else 0
    return tuple(f"arm {i + 1}" for i in range(len(joint_names) - rank))


def _arm_posture(arm: Arm, place: Floats) -> Floats:
    """Joint coordinates (a,) of the arm with its hand at a place (3,) [m], from those of its assembly by least
    motion; without a shoulder those of the assembly.

    Raises  OperatorError  where the hand cannot get there
    """
    angles = np.array(arm.mechanism.assemblies["held"], dtype=np.float64)
    if arm.shoulder is None:
        return angles
    mech = pack(arm.mechanism)
    goal = place - arm.shoulder
    for _ in range(STEPS):
        hand = Motions(mech, angles).handle
        away = goal - hand.position
        if np.max(np.abs(away)) <= REACHED:
            return angles
        step = np.linalg.pinv(hand.speed, rcond=STRETCHED) @ away
        step *= min(1.0, LARGEST_STEP / max(float(np.max(np.abs(step))), 1e-300))
        moved = moved_posture(mech, angles, step)
        if moved is None or not np.max(np.abs(step)) > 0.0:
            break
        angles = moved
    distance = float(np.linalg.norm(goal - Motions(mech, angles).handle.position))
    # the search broke off, or its steps ran out, within a nanometre, above the rounding of REACHED: near enough
    if distance <= 1e-9:
        return angles
    raise OperatorError(
        f"the arm does not reach the handle from its shoulder: {distance:.4g} m are left; move shoulder_m, or "
        "give the posture in which it holds the handle"
    )
