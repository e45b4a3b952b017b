"""How drives and joints of their own act on a mechanism's independent coordinates, posture by posture.

With p the coordinates of the drives and the free joints, the coordinate of drive i at its joint moves by T_i p':
by p_i' alone, unless it is a surplus drive, which moves with all. A force f along the rendered direction is the
generalised forces h f. The computer shares it among the drives as torques t f with the least sum of squares,

    T_d^T t = h_d,     t = (T_d^+)^T h_d                 T_d, h_d: without the free joints, which no drive moves

and reads the handle's motion as t . theta, which is the least-squares estimate by all encoders. With as many
drives as degrees of freedom T is 1 and t = h.

A rotor's whole kinetic energy is J_m (S p' + n theta')^2 / 2, with S p' the part of its motor's angular velocity
along its axis. Thesis eq. 2.21 takes n theta' alone; the link's inertia holds the rotor as if it were locked, so
that

    J_m (n theta' S p' + n^2 theta'^2 / 2)

comes to that of the links.

The coordinates of a mechanism's drives: how they move with the joints, and where the computer sees the device.

The coordinate of a drive is its motor's angle over the transmission's ratio at the posture that is linearised
about. A motor behind a bent spring is ahead of its joint, so that the computer, which counts the motor, sees the
device in another posture than it is in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.closure import equations, passive_rates
from zwidth.model.continuation import moved_posture
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.inertia import unit_motions
from zwidth.model.mechanism import FIXED, Drives, Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, design_of_each, pack, per_design
from zwidth.model.motions import Motions
from zwidth.model.posture import Posture


@dataclass(frozen=True)
class DriveSide:
    """Of each posture (...), with d drives and c independent coordinates; nan where a posture is not OK.

    motion     (..., d, c)  T [1]
    spin       (..., d, c)  S [1]; None: neglected
    stiffness  (..., c, c)  of the joints' own springs [N m/rad]; None: none
    damping    (..., c, c)  of their dampers [N m s/rad]; None: none
    rubbing    (..., r, c)  motion of each joint with dry friction of its own, and coulomb (..., r) its level [N m]
    driven     number of coordinates that drives move, the first ones
    """

    motion: Floats
    spin: Floats | None
    stiffness: Floats | None
    damping: Floats | None
    rubbing: Floats
    coulomb: Floats
    driven: int

    def shares(self, lever_arms: Floats) -> Floats:
        """t (..., d): torques at the joints per force along the direction, of lever arms h (..., c)."""
        h, T = lever_arms[..., : self.driven], self.motion[..., : self.driven]
        if T.shape[-2] == self.driven:  # as many drives as coordinates, which are theirs
            return h
        return np.asarray((np.swapaxes(np.linalg.pinv(T), -1, -2) @ h[..., None])[..., 0])

    def with_rotors(self, mass_matrix: Floats, drives: Drives) -> Floats:
        """Mass matrix (..., c, c) of the links and all rotors, every drive taken as rigid, from that of the
        links."""
        rotor = drives.transmission**2 * drives.motor_inertia
        T = self.motion
        whole = mass_matrix + np.swapaxes(T, -1, -2) @ (rotor[..., None] * T)
        if self.spin is None:
            return whole
        spun = (drives.transmission * drives.motor_inertia)[..., None] * self.spin
        cross = np.swapaxes(T, -1, -2) @ spun
        return whole + cross + np.swapaxes(cross, -1, -2)


def is_plain(mechanism: Mechanism) -> bool:
    """Whether there is a drive for each coordinate and nothing else that acts on them: T = 1, t = h."""
    drives, links = mechanism.drives, mechanism.links
    own = links.joint_stiffness, links.joint_damping, links.joint_coulomb
    return not (
        mechanism.flexible
        or mechanism.free
        or drives.surplus
        or drives.motor_link is not None
        or any(x is not None for x in own)
    )


def drive_side(mechanism: Mechanism, posture: Posture) -> DriveSide:
    """The drives' side of each posture, broadcast with the designs of the mechanism."""
    drives, links = mechanism.drives, mechanism.links
    mech, shape = pack(mechanism), np.broadcast_shapes(posture.status.shape, mechanism.design_shape)
    d, c, n = len(drives.names), mech.driven + mech.free, mech.parent.size
    if is_plain(mechanism):
        T = np.broadcast_to(np.eye(d), (*shape, d, d))
        return DriveSide(T, None, None, None, np.zeros((*shape, 0, c)), np.zeros((*shape, 0)), d)
    design = design_of_each(mechanism, shape).copy()
    angles = np.array(np.broadcast_to(posture.angles, (*shape, n)).reshape(-1, n), order="C")
    rates, spins = np.full((len(design), c, n), np.nan), np.full((len(design), c, n, 3), np.nan)
    rotation = np.full((len(design), n, 3, 3), np.nan)
    known = np.flatnonzero(~np.isnan(angles).any(axis=1))
    _motions(mech, design, angles, known, rates, spins, rotation)
    per_joint = np.swapaxes(rates, 1, 2)  # (N, n, c)
    T = per_joint[:, drives.joint]
    if drives.coupling is not None:
        T = T + per_design(mechanism, drives.coupling, 2)[design] @ np.nan_to_num(per_joint)
    level = np.zeros((1, n)) if links.joint_coulomb is None else per_design(mechanism, links.joint_coulomb, 1)
    rubbing = np.flatnonzero(level.any(axis=0))
    return DriveSide(
        motion=T.reshape(*shape, d, c),
        spin=_spin(mechanism, design, spins, rotation, shape),
        stiffness=_of_joints(mechanism, links.joint_stiffness, per_joint, design, shape),
        damping=_of_joints(mechanism, links.joint_damping, per_joint, design, shape),
        rubbing=per_joint[:, rubbing].reshape(*shape, len(rubbing), c),
        coulomb=np.broadcast_to(level, (int(design.max(initial=0)) + 1, n))[design][:, rubbing].reshape(
            *shape, -1
        ),
        driven=mech.driven,
    )


def drive_side_of_motions(mechanism: Mechanism, motions: Motions, angles: Floats) -> DriveSide:
    """The drives' side of one posture with flexible links, in the coordinates of its motions, those of the joints
    and then the elastic ones. Dampers of the flexible links are among those of the joints, and springs, too.

    mechanism  with the ratios of the posture;   angles (n,)
    """
    drives, links = mechanism.drives, mechanism.links
    T = DriveMotion.of(mechanism, motions, angles, np.asarray(drives.transmission)).T
    none = np.zeros(len(links.names))
    spring, damper, level = (
        none if each is None else np.asarray(each)
        for each in (links.joint_stiffness, links.joint_damping, links.joint_coulomb)
    )
    moving = [int(link) for link in motions.unknowns]
    rates = np.array([motions.joint(link)[0] for link in moving]).reshape(len(moving), motions.count)
    rubbing = [i for i, link in enumerate(moving) if level[link] > 0.0]
    S = None
    if drives.motor_link is not None and drives.motor_axis is not None:
        S = np.zeros((len(drives.names), motions.count))
        for i, link in enumerate(drives.motor_link):
            if link >= 0:
                S[i] = (motions.rotation[link] @ drives.motor_axis[i]) @ motions.point(int(link), np.zeros(3)).spin
    return DriveSide(
        motion=T,
        spin=S,
        stiffness=rates.T @ (spring[moving, None] * rates) + motions.elastic_stiffness(),
        damping=rates.T @ (damper[moving, None] * rates) + motions.elastic_damping(),
        rubbing=rates[rubbing],
        coulomb=level[[moving[i] for i in rubbing]],
        driven=len(mechanism.driven),
    )


def _of_joints(
    mechanism: Mechanism, numbers: Floats | None, per_joint: Floats, design: Ints, shape: tuple[int, ...]
) -> Floats | None:
    """sum_j k_j B_j^T B_j of the joints' numbers k, with B_j the rate of joint j, (..., c, c)."""
    if numbers is None:
        return None
    k = per_design(mechanism, numbers, 1)[design]
    moving = mechanism.links.joint != FIXED
    B = per_joint[:, moving]
    return np.asarray((np.swapaxes(B, 1, 2) @ (k[:, moving, None] * B)).reshape(*shape, B.shape[2], B.shape[2]))


def _spin(
    mechanism: Mechanism, design: Ints, spins: Floats, rotation: Floats, shape: tuple[int, ...]
) -> Floats | None:
    """S (..., d, c): angular velocity of each motor's link along its axis per unit rate."""
    drives = mechanism.drives
    if drives.motor_link is None or drives.motor_axis is None:
        return None
    axis = per_design(mechanism, drives.motor_axis, 2)[design]
    S = np.zeros((len(design), len(drives.names), spins.shape[1]))
    for i, link in enumerate(drives.motor_link):
        if link >= 0:
            along = (rotation[:, link] @ axis[:, i, :, None])[..., 0]
            S[:, i] = np.einsum("kcx,kx->kc", spins[:, :, link], along)
    return S.reshape(*shape, *S.shape[1:])


@compiled
def _motions(
    mech: MechanismArrays,
    design: Ints,
    angles: Floats,
    known: Ints,
    rates: Floats,
    spins: Floats,
    rotation: Floats,
) -> None:
    """Rates of the joints (N, c, n) and angular velocities of the links (N, c, n, 3) per unit rate of each
    independent coordinate, and the links' axes (N, n, 3, 3), of the known postures."""
    work = working_memory(mech)
    for k in range(known.size):
        i = known[k]
        place_links(mech, design[i], angles[i], work)
        equations(mech, design[i], work)
        passive_rates(mech, design[i], work)
        unit_motions(mech, work)
        for s in range(rates.shape[1]):
            for j in range(rates.shape[2]):
                u = mech.column[j]
                rates[i, s, j] = work.rates[s, u] if u >= 0 else 0.0
                for x in range(3):
                    spins[i, s, j, x] = work.spin[s, j, x]
        rotation[i] = work.rotation


STEPS: Final = 60  # of the search for the counted posture
SETTLED: Final = 1e-13  # change of a coordinate below which it has been found


@dataclass(frozen=True)
class DriveMotion:
    """T (d, c) and its derivative Z (d, c, c): the drives' coordinates move by T p' and T p'' + p'^T Z p'."""

    T: Floats
    Z: Floats

    @classmethod
    def of(cls, mechanism: Mechanism, motions: Motions, angles: Floats, ratio: Floats) -> DriveMotion:
        """Of one design.

        angles  (n,) joint coordinates;   ratio  (d,) of the posture that is linearised about, which drives with a
                table refer to
        """
        drives = mechanism.drives
        each = [motions.joint(int(link)) for link in drives.joint]
        T, Z = np.array([rate for rate, _ in each]), np.array([second for _, second in each])
        if drives.coupling is not None:
            for i, row in enumerate(np.asarray(drives.coupling).reshape(len(T), -1)):
                for link in np.flatnonzero(row):
                    rate, second = motions.joint(int(link))
                    T[i], Z[i] = T[i] + row[link] * rate, Z[i] + row[link] * second
        for i, table in enumerate(drives.ratio_tables or ()):
            if table is not None:
                q, rate = angles[drives.joint[i]], each[i][0]
                here, slope = float(table.at(q)) / ratio[i], float(table.slope(q)) / ratio[i]
                T[i], Z[i] = here * T[i], here * Z[i] + slope * np.outer(rate, rate)
        return cls(T, Z)


def drive_travel(mechanism: Mechanism, start: Floats, end: Floats, ratio: Floats) -> Floats:
    """By what the drives' coordinates (d,) differ between two postures, given by their joint coordinates (n,)."""
    drives, way = mechanism.drives, end - start
    travel = way[drives.joint].copy()
    if drives.coupling is not None:
        travel += np.asarray(drives.coupling).reshape(len(travel), -1) @ way
    for i, table in enumerate(drives.ratio_tables or ()):
        if table is not None:
            joint = drives.joint[i]
            travel[i] = float(table.motor_angle(end[joint]) - table.motor_angle(start[joint])) / ratio[i]
    return travel


@dataclass(frozen=True)
class CountedPosture:
    """The device as the computer sees it, its kinematics being those of rigid drives.

    angles   (n,)  joint coordinates;   motions, drives  there
    seen     (k, d)  change of the k driven coordinates per change of the drives' coordinates that are counted
    """

    angles: Floats
    motions: Motions
    drives: DriveMotion
    seen: Floats


def counted_posture(
    mechanism: Mechanism, start: Motions, angles: Floats, ahead: Floats, ratio: Floats
) -> CountedPosture | None:
    """The posture whose drive coordinates are nearest, by least squares, to those that are counted.

        T^T (z(p) - z) = 0         dp/dz = (T^T T + sum_i r_i Z_i)^-1 T^T,   r = z(p) - z

    With a drive for each coordinate r is 0. Free joints are taken to stand where they do.

    start    motions of the device;   angles (n,)  its joint coordinates
    ahead    (d,)  by what the counted coordinates are ahead of those of its joints
    Returns  None where the joints cannot be there, or the drives do not determine where they are
    """
    mech, at, motions, k = start.mech, angles, start, len(mechanism.driven)
    for _ in range(STEPS):
        drives = DriveMotion.of(mechanism, motions, at, ratio)
        T, Z = drives.T[:, :k], drives.Z[:, :k, :k]
        away = drive_travel(mechanism, angles, at, ratio) - ahead
        try:
            seen = np.linalg.solve(T.T @ T + np.tensordot(away, Z, 1), T.T)
        except np.linalg.LinAlgError:
            return None
        step = -(seen @ away)
        if not np.isfinite(step).all():  # outside the table of a ratio
            return None
        if np.max(np.abs(step), initial=0.0) <= SETTLED:
            return CountedPosture(at, motions, drives, np.asarray(seen, dtype=np.float64))
        moved = moved_posture(mech, at, np.append(step, np.zeros(motions.count - k)))
        if moved is None or not np.isfinite(moved).all():
            return None
        at, motions = moved, Motions(mech, moved)
    return None
