"""What drives do along a direction at the handle, and what is felt there: effective masses and stiffness.

Drives, and joints with springs of their own, act on the independent coordinates, posture by posture. With p the
coordinates of the drives and the free joints, the coordinate of drive i at its joint moves by T_i p': by p_i'
alone, unless it is a surplus drive, which moves with all. A force f along the rendered direction is the
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

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.closure import equations, passive_rates
from zwidth.model.continuation import moved_posture
from zwidth.model.design_axes import at_index
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.inertia import unit_motions
from zwidth.model.mechanism import FIXED, Drives, Mechanism, at_postures
from zwidth.model.mechanism_arrays import MechanismArrays, design_of_each, pack, per_design
from zwidth.model.motions import Motions
from zwidth.model.posture import OK, Posture


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
    """Whether there is a drive for each coordinate and nothing else that acts on them: T = 1, t = h.

    Nothing else: no flexible links, free joints, springs, dampers or friction of joints, nor rotors whose turning
    with their links counts.
    """
    drives, links = mechanism.drives, mechanism.links
    of_joints = links.joint_stiffness, links.joint_damping, links.joint_coulomb
    return not (
        mechanism.flexible
        or mechanism.free
        or drives.surplus
        or drives.motor_link is not None
        or any(x is not None for x in of_joints)
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
    _fill_rates(mech, design, angles, known, rates, spins, rotation)
    per_joint = np.swapaxes(rates, 1, 2)  # (N, n, c)
    # a drive moves with its joint, and with those coupled to it
    T = per_joint[:, drives.joint]
    if drives.coupling is not None:
        # 0 for nan: postures that are not OK have nan in T already
        T = T + per_design(mechanism, drives.coupling, 2)[design] @ np.nan_to_num(per_joint)
    level = np.zeros((1, n)) if links.joint_coulomb is None else per_design(mechanism, links.joint_coulomb, 1)
    rubbing = np.flatnonzero(level.any(axis=0))
    return DriveSide(
        motion=T.reshape(*shape, d, c),
        spin=_motor_spin(mechanism, design, spins, rotation, shape),
        stiffness=_sum_over_joints(mechanism, links.joint_stiffness, per_joint, design, shape),
        damping=_sum_over_joints(mechanism, links.joint_damping, per_joint, design, shape),
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
    zeros = np.zeros(len(links.names))
    spring, damper, level = (
        zeros if each is None else np.asarray(each)
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


def _sum_over_joints(
    mechanism: Mechanism, numbers: Floats | None, per_joint: Floats, design: Ints, shape: tuple[int, ...]
) -> Floats | None:
    """sum_j k_j B_j^T B_j (..., c, c), with k the numbers (springs or dampers) of the joints and B_j the rate of
    joint j; None for no numbers.

    per_joint  (N, n, c)  rate of each joint per unit rate of each coordinate;   design (N,), shape (...) of N
    """
    if numbers is None:
        return None
    k = per_design(mechanism, numbers, 1)[design]
    moving = mechanism.links.joint != FIXED
    B = per_joint[:, moving]
    return np.asarray((np.swapaxes(B, 1, 2) @ (k[:, moving, None] * B)).reshape(*shape, B.shape[2], B.shape[2]))


def _motor_spin(
    mechanism: Mechanism, design: Ints, spins: Floats, rotation: Floats, shape: tuple[int, ...]
) -> Floats | None:
    """S (..., d, c): angular velocity of each motor's link along its axis per unit rate; None if they do not
    count.

    spins (N, c, n, 3), rotation (N, n, 3, 3)  as `_fill_rates` fills them;   design (N,), shape (...) of N
    """
    drives = mechanism.drives
    if drives.motor_link is None or drives.motor_axis is None:
        return None
    axis = per_design(mechanism, drives.motor_axis, 2)[design]
    S = np.zeros((len(design), len(drives.names), spins.shape[1]))
    for i, link in enumerate(drives.motor_link):
        if link >= 0:
            axis_in_base = (rotation[:, link] @ axis[:, i, :, None])[..., 0]
            S[:, i] = np.einsum("kcx,kx->kc", spins[:, :, link], axis_in_base)
    return S.reshape(*shape, *S.shape[1:])


@compiled
def _fill_rates(
    mech: MechanismArrays,
    design: Ints,
    angles: Floats,
    known: Ints,
    rates: Floats,
    spins: Floats,
    rotation: Floats,
) -> None:
    """Fill rates of the joints (N, c, n) and angular velocities `spins` of the links (N, c, n, 3) per unit rate of
    each independent coordinate, and the links' axes `rotation` (N, n, 3, 3).

    known  indices of the postures that are filled;   design (N,), angles (N, n)
    """
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
        """The motion of the drives of one design.

        angles  (n,) joint coordinates;   ratio  (d,) of the posture that is linearised about, which drives with a
                table refer to
        """
        drives = mechanism.drives
        joint_motions = [motions.joint(int(link)) for link in drives.joint]
        T, Z = np.array([rate for rate, _ in joint_motions]), np.array([second for _, second in joint_motions])
        if drives.coupling is not None:
            for i, row in enumerate(np.asarray(drives.coupling).reshape(len(T), -1)):
                for link in np.flatnonzero(row):
                    rate, second = motions.joint(int(link))
                    T[i], Z[i] = T[i] + row[link] * rate, Z[i] + row[link] * second
        for i, table in enumerate(drives.ratio_tables or ()):
            if table is not None:
                # its coordinate is f(q) / ratio with f' the ratio n(q) of the table
                q, rate = angles[drives.joint[i]], joint_motions[i][0]
                here, slope = float(table.at(q)) / ratio[i], float(table.slope(q)) / ratio[i]
                T[i], Z[i] = here * T[i], here * Z[i] + slope * np.outer(rate, rate)
        return cls(T, Z)


def drive_travel(mechanism: Mechanism, start: Floats, end: Floats, ratio: Floats) -> Floats:
    """Travel (d,) of the drives' coordinates between two postures, given by their joint coordinates (n,).

    ratio  (d,)  of the drives at the posture linearised about, by which the motor angle of a table is divided
    """
    drives, way = mechanism.drives, end - start
    travel = way[drives.joint].copy()
    if drives.coupling is not None:
        travel += np.asarray(drives.coupling).reshape(len(travel), -1) @ way
    for i, table in enumerate(drives.ratio_tables or ()):
        if table is not None:  # such a drive has no coupling
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

    z(p) being the drives' coordinates T p' integrates to, z those that are counted and Z_i the derivative of row i
    of T. With a drive for each coordinate r is 0. Free joints are taken to stand where they do.

    start    motions of the device;   angles (n,)  its joint coordinates
    ahead    (d,)  by what the counted coordinates are ahead of those of its joints;   ratio (d,)  as of
             `drive_travel`
    Returns  None where the joints cannot be there, the drives do not determine where they are, or the search does
             not settle
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
        # the free joints stay
        moved = moved_posture(mech, at, np.append(step, np.zeros(motions.count - k)))
        if moved is None or not np.isfinite(moved).all():
            return None
        at, motions = moved, Motions(mech, moved)
    return None


@dataclass(frozen=True)
class EffectiveParameters:
    """Along one direction u, with h = J^T u; all with the leading axes of posture and direction, nan where not OK.

    link_side_mass   (...)  1 / (h^T M_phi^-1 h): links with the drives cut          (thesis eq. 2.28) [kg]
    motor_side_mass  (...)  1 / (h^T M_theta^-1 h): rotors with the drives cut       (thesis eq. 2.28) [kg]
    rigid_mass       (...)  1 / (h^T (M_phi + M_theta)^-1 h): links and rotors, drives rigid [kg]
    stiffness        (...)  1 / (h^T K^-1 h), inf with rigid drives                  (thesis eq. 2.34) [N/m]

    A direction in which the handle cannot move has h = 0: all four are inf.

    Of links that bend, masses are those of the links as if they did not: what a slow motion feels. What the
    fastest one feels, 1 / (h^T M^-1 h) with all elastic coordinates, is less with each further mode of a beam,
    down to what is fixed at the handle. The stiffness is that of drives and links in series, the motors held.
    """

    link_side_mass: Floats
    motor_side_mass: Floats
    rigid_mass: Floats
    stiffness: Floats


def effective_parameters(mechanism: Mechanism, posture: Posture, direction: ArrayLike) -> EffectiveParameters:
    """Effective masses and stiffness of a mechanism along a direction, or about an axis (then inertias [kg m²]
    and N m/rad).

    Where the drives are not the coordinates (`drive_side`): motor_side_mass 1 / (t^T M_theta^-1 t); rigid_mass
    with M_phi + T^T M_theta T + C T + T^T C^T, C = S^T n J_m; stiffness 1 / (h^T (T^T K T)^-1 h) on the drives'
    coordinates.

    direction  (..., 3)  unit vectors in the base frame, broadcasting with the posture; or (..., 6), see `screw`
    Raises     ValueError  if a direction is not of unit length
    """
    u = screw(direction)
    if mechanism.flexible:
        rigid = effective_parameters(replace(mechanism, flexible=()), posture, direction)
        return replace(rigid, stiffness=_stiffness_with_links(mechanism, posture, u))
    posed = at_postures(mechanism, posture)
    drives = posed.drives
    ratio = per_design(posed, drives.transmission, 1)
    rotor = ratio**2 * per_design(posed, drives.motor_inertia, 1)
    spring = ratio**2 * per_design(posed, drives.stiffness, 1)
    shape = np.broadcast_shapes(posture.status.shape, u.shape[:-1])
    design, c = design_of_each(posed, shape), posture.mass_matrix.shape[-1]
    M = np.array(np.broadcast_to(posture.mass_matrix, (*shape, c, c)).reshape(-1, c, c), order="C")
    h = np.array(np.broadcast_to(lever_arms(posture, u), (*shape, c)).reshape(-1, c), order="C")
    if not is_plain(mechanism):
        side = drive_side(mechanism, posture)
        spun = None if side.spin is None else (ratio * per_design(posed, drives.motor_inertia, 1))[design]
        return _effective_in_general(side, M, h, rotor[design], spring[design], spun, shape)
    out = np.empty((4, len(M)))
    _effective_batch(design, M, h, np.ascontiguousarray(rotor), np.ascontiguousarray(spring), out)
    return EffectiveParameters(*(row.reshape(shape) for row in out))


def lever_arms(posture: Posture, screws: Floats) -> Floats:
    """h (..., c): motion along screws (..., 6) per unit rate of each independent coordinate, J^T u + J_w^T w."""
    h = np.einsum("...i,...id->...d", screws[..., :3], posture.jacobian)
    if np.any(screws[..., 3:]):
        h = h + np.einsum("...i,...id->...d", screws[..., 3:], posture.angular_jacobian)
    return np.asarray(h)


def screw(direction: ArrayLike) -> Floats:
    """A direction as the screw (..., 6) along which forces act: [u, w] is the force u f and the moment w f.

    direction  (..., 3)  a unit vector u, w being 0; or (..., 6) such a screw: [0, w] with a unit vector w is the
                         axis of a moment, and a mixed screw has |u|^2 + |w|^2/L^2 = 1 with a characteristic length
                         L
    Raises     ValueError  for a direction of three components that is not of unit length, or one without length
    """
    given = np.asarray(direction, dtype=np.float64)
    if given.ndim and given.shape[-1] == 6:
        if not np.all(np.abs(given).max(axis=-1) > 0.0) or not np.isfinite(given).all():
            raise ValueError(f"a screw needs a finite component that is not 0, got {given.tolist()}")
        return given
    u = unit_directions(direction)
    return np.concatenate([u, np.zeros_like(u)], axis=-1)


def _effective_in_general(
    side: DriveSide,
    M: Floats,
    h: Floats,
    rotor: Floats,
    spring: Floats,
    spun: Floats | None,
    shape: tuple[int, ...],
) -> EffectiveParameters:
    """Effective masses and stiffness where drives are not the coordinates, of N postures.

    M, h           (N, c, c), (N, c)  mass matrix of the links, lever arms
    rotor, spring  (N, d)  inertia n^2 J_m and stiffness n^2 k of each drive, at the joint
    spun           (N, d)  n J_m of rotors whose turning with their links counts; None: it does not
    side, shape    the drives' side of these postures; shape of the result, of N in all
    """
    N, c = h.shape
    T = np.broadcast_to(side.motion, (*shape, *side.motion.shape[-2:])).reshape(N, -1, c)
    torque_shares = side.shares(np.reshape(h, (*shape, c))).reshape(N, -1)
    whole = M + np.swapaxes(T, 1, 2) @ (rotor[..., None] * T)
    if side.spin is not None and spun is not None:
        cross = np.swapaxes(T, 1, 2) @ (
            spun[..., None] * np.broadcast_to(side.spin, (*shape, *T.shape[1:])).reshape(T.shape)
        )
        whole = whole + cross + np.swapaxes(cross, 1, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        link_mass, rigid_mass = (1.0 / np.einsum("ki,ki->k", h, _solve(A, h)) for A in (M, whole))
        motor_mass = 1.0 / (torque_shares**2 / rotor).sum(axis=1)
        stiffness = 1.0 / _compliance(T[..., : side.driven], spring, h[:, : side.driven])
    return EffectiveParameters(
        *(np.asarray(x).reshape(shape) for x in (link_mass, motor_mass, rigid_mass, stiffness))
    )


def _stiffness_with_links(mechanism: Mechanism, posture: Posture, screws: Floats) -> Floats:
    """1 / (h^T K^-1 h) (...) of drives and links that bend, posture by posture; nan where it is not OK."""
    shape = np.broadcast_shapes(posture.status.shape, screws.shape[:-1])
    postures, screws = posture.broadcast_to(shape), np.broadcast_to(screws, (*shape, 6))
    out = np.full(shape, np.nan)
    for index in np.ndindex(shape):
        one = postures.with_axes(at_index(index))
        if one.status != OK:
            continue
        posed = at_postures(mechanism, one)
        motions = Motions(pack(posed), one.angles, posed.flexible)
        side, drives = drive_side_of_motions(posed, motions, one.angles), posed.drives
        # what moves as the motors are held: the drives' coordinates and the elastic ones, but no free joint
        held = np.r_[0 : side.driven, motions.joint_count : motions.count]
        T, h = side.motion[:, held], motions.handle_along(screws[index])[held]
        spring = drives.transmission**2 * drives.stiffness
        bending = motions.elastic_stiffness()[np.ix_(held, held)]
        with np.errstate(divide="ignore"):
            out[index] = 1.0 / _compliance(T[None], spring[None], h[None], bending)[0]
    return out


def _solve(A: Floats, h: Floats) -> Floats:
    """A^-1 h of each (N, c); nan where A holds nan."""
    unknown: Flags = np.asarray(np.isnan(A).any(axis=(1, 2)))
    known: Floats = np.where(unknown[:, None, None], np.eye(A.shape[1]), A)
    solved = np.linalg.solve(known, h[..., None])[..., 0]
    return np.asarray(np.where(unknown[:, None], np.nan, solved))


def _compliance(T: Floats, spring: Floats, h: Floats, bending: Floats | None = None) -> Floats:
    """h^T (T^T K T)^-1 h (N,) of T (N, d, c), h (N, c) and K the drives' springs (N, d), inf of rigid drives.
    These are the limit: they leave the motions Y of T_r Y = 0, T_r being their rows of T; the form is 0 where they
    leave none, and nan where T is.

    bending  (c, c)  stiffness of the links, which is added
    """
    out = np.full(len(h), np.nan)
    for k in np.flatnonzero(~np.isnan(T).any(axis=(1, 2))):
        flexible = np.isfinite(spring[k])
        motions = np.eye(T.shape[2])
        if not flexible.all():
            _, values, rows = np.linalg.svd(T[k][~flexible])
            # the right vectors beyond the rank
            motions = rows[int(np.sum(values > 1e-12 * values[0])) :].T
        moved = T[k][flexible] @ motions
        A, b = moved.T @ (spring[k][flexible, None] * moved), motions.T @ h[k]
        A = A if bending is None else A + motions.T @ bending @ motions
        out[k] = b @ np.linalg.solve(A, b) if len(b) else 0.0
    return out


def unit_directions(directions: ArrayLike) -> Floats:
    """Directions as an array (..., 3), each of unit length. Raises ValueError for others."""
    u = np.asarray(directions, dtype=np.float64)
    if u.ndim == 0 or u.shape[-1] != 3:
        raise ValueError(f"a rendered direction has three components, got an array of shape {u.shape}")
    length = np.linalg.norm(u, axis=-1)
    wrong = np.argwhere(~(np.abs(length - 1.0) <= 1e-9))
    if len(wrong):
        first, size = u[tuple(wrong[0])].tolist(), float(length[tuple(wrong[0])])
        if not size > 0.0:
            raise ValueError(f"the rendered direction {first} has no length; give it at least one component")
        raise ValueError(f"the rendered direction {first} has length {size:.6g}; divide it by its length")
    return u


@compiled
def inverse_form(A: Floats, h: Floats, d: int) -> float:
    """h^T A^-1 h of a symmetric positive definite A (d, d), by Cholesky; both are overwritten."""
    total = 0.0
    for j in range(d):
        pivot = A[j, j]
        # with A = L D L^T the form is the sum of (L^-1 h)_j^2 / D_j: no way back is needed
        total += h[j] * h[j] / pivot
        for i in range(j + 1, d):
            factor = A[i, j] / pivot
            h[i] -= factor * h[j]
            for c in range(j + 1, i + 1):
                A[i, c] -= factor * A[c, j]
    return total


@compiled
def _effective_batch(design: Ints, M: Floats, along: Floats, rotor: Floats, spring: Floats, out: Floats) -> None:
    """Fill out (4, N), the four numbers of `EffectiveParameters` in their order, for each posture.

    M, along       (N, d, d), (N, d)  mass matrix of the links, lever arms h
    rotor, spring  (P, d)  of each design;   design (N,)  of each posture
    """
    d = rotor.shape[1]
    lever_arms, A = np.zeros(d), np.zeros((d, d))
    for i in range(design.size):
        p = design[i]
        motor, compliance = 0.0, 0.0
        for s in range(d):
            motor += along[i, s] * along[i, s] / rotor[p, s]
            compliance += along[i, s] * along[i, s] / spring[p, s]
        for both in range(2):  # 0: the links alone, 1: with the rotors; rows 0 and 2 of `out`
            for s in range(d):
                lever_arms[s] = along[i, s]
                for t in range(d):
                    A[s, t] = M[i, s, t]
                if both == 1:
                    A[s, s] += rotor[p, s]
            out[2 * both, i] = 1.0 / inverse_form(A, lever_arms, d)
        out[1, i] = 1.0 / motor
        out[3, i] = 1.0 / compliance
