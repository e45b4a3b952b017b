"""How a mechanism's points and axes move: first and second derivatives in its coordinates, at one posture.

A point x of a link moves with the n joint coordinates q, which the closures hold together. In the independent
coordinates p (drives, then free joints)

    q' = B p'                       x' = J B p'
    q'' = B p'' + p'^T B2 p'        x'' = J B p'' + p'^T (B^T X2 B + J B2) p'

with J and X2 the first and second derivatives of the point in all joint coordinates. B2 follows from the closures,
A q' = 0 and A q'' + q'^T A2 q' = 0. So the second derivative of anything on which a force does work, a potential
V with dV/dx = -f, is

    d2V/dp2 = -B^T (f . X2) B - f . J B2

The last term is what the links' constraint forces do as they turn: f . J B2 = -lambda . (B^T A2 B) with the
closures' multipliers lambda, A^T lambda = J^T f on the joints that nobody drives. Left out, a loop under load
has the stiffness of another mechanism.

Flexible links (`flexible_body`) have elastic coordinates among the joint coordinates; theirs are the last. They
hang on closures, too: with N the elastic motions that leave drives and closures alone, u' = B (p', xi'), B =
[B_rigid, N]. Of all bases N the natural modes are taken that the links have while the drives stand still, of a
mass of 1 each, the slowest first. Other bases tell the same, but their mass matrix is singular to rounding where
light parts of links move and heavy ones do not, as they do in most fast motions of a loop.

The three rates of a ball joint are one angular velocity, and no rates of coordinates; about a posture they are
those of the turn from there, whose vector has no second-order terms of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.model.flexible_body import FlexibleLink, symmetric
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.mechanism import AXIS, POINT, PRISMATIC
from zwidth.model.mechanism_arrays import MechanismArrays

NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])  # rows of a cross product
RANK: Final = 1e-10  # share of the largest singular value below which a closure's equation says nothing new


@dataclass(frozen=True)
class Motion:
    """A frame that moves with the coordinates: u of all joints, or c independent ones.

    position    (3,)       [m]
    speed, spin (3, u)     its velocity and angular velocity per unit rate of each coordinate
    speed_2, spin_2  (3, u, u)  symmetric: x'' = speed u'' + u'^T speed_2 u', and so the angular acceleration
    """

    position: Floats
    speed: Floats
    spin: Floats
    speed_2: Floats
    spin_2: Floats

    def at(self, arm: Floats) -> Motion:
        """A point fixed to the frame, at an arm (3,) from it in the base's axes [m]."""
        return Motion(
            self.position + arm,
            self.speed + _cross(self.spin, arm),
            self.spin,
            # alpha x arm + w x (w x arm)
            self.speed_2 + _cross(self.spin_2, arm) + _cross_forms(self.spin, _cross(self.spin, arm)),
            self.spin_2,
        )

    def in_coordinates(self, B: Floats, B2: Floats) -> Motion:
        """The same in independent coordinates, u' = B p',  u'' = B p'' + p'^T B2 p'."""
        return Motion(
            self.position,
            self.speed @ B,
            self.spin @ B,
            B.T @ self.speed_2 @ B + np.tensordot(self.speed, B2, 1),
            B.T @ self.spin_2 @ B + np.tensordot(self.spin, B2, 1),
        )

    @property
    def turning(self) -> Floats:
        """dW/dp (3, c, c) of the angular velocity W p': [x, s, t] is the change of W_xs with coordinate t.

        Its symmetric part is spin_2; dW_s/dp_t - dW_t/dp_s = W_t x W_s, as of every rotation.
        """
        W = self.spin
        return self.spin_2 + 0.5 * np.moveaxis(np.cross(W.T[None, :, :], W.T[:, None, :]), -1, 0)


class Motions:
    """The links of one design in one posture, as they move.

    mech      the mechanism's arrays
    unknowns  (m,)   the link that each joint coordinate moves: passive ones, then driven, then free
    elastic   places of each flexible link's coordinates among the e elastic ones
    rates     (m + e, c) B,   rates_2 (m + e, c, c)  B2
    """

    def __init__(self, mech: MechanismArrays, angles: Floats, flexible: Sequence[FlexibleLink] = ()) -> None:
        """Place the links, undeformed.

        mech      of one design;   angles (n,) joint coordinates of a posture with closed loops [rad], [m]
        flexible  its flexible links, which are rigid where they are left out
        """
        self.mech, self.flexible = mech, {each.link: each for each in flexible}
        self.unknowns, self.elastic, end = mech.joint, dict[int, slice](), 0
        for link, each in self.flexible.items():
            self.elastic[link] = slice(end, end + each.size)
            end += each.size
        self.elastic_count = end
        self.rotation, self._origin, self._axis = _place(self.mech, angles)
        self._links = self._all_links()
        self.rates, self.rates_2 = self._independent()

    @property
    def joint_count(self) -> int:
        """Number of independent joint coordinates: drives and free joints."""
        return self.mech.driven + self.mech.free

    @property
    def count(self) -> int:
        """Number c of independent coordinates, those of joints first."""
        return int(self.rates.shape[1])

    def point(self, link: int, local: Floats) -> Motion:
        """A point (3,) of a link's frame [m], with what it is fixed to, in the independent coordinates; link -1:
        the base."""
        return self._at(self._links, link, local).in_coordinates(self.rates, self.rates_2)

    def _at(self, links: Mapping[int, Motion], link: int, local: Floats, fixed_at: Floats | None = None) -> Motion:
        """A point (3,) of a link's frame in all coordinates, by the motions of the links' frames in these. Of a
        flexible link it is fixed to the station next to it, or next to another place, `fixed_at` (3,): what slides
        in a guide is fixed to where the guide is."""
        if link < 0:
            return links[-1].at(local)
        R, frame = self.rotation[link], links[link]
        if link not in self.flexible:
            return frame.at(R @ local)
        beam, columns = self.flexible[link], self._columns(link)
        k = beam.station_of(local if fixed_at is None else fixed_at)
        straight = frame.at(R[:, 0] * beam.body.stations[k])
        bent, turned = (np.zeros_like(frame.speed) for _ in range(2))
        bent[:, columns], turned[:, columns] = R @ beam.body.displacement[k], R @ beam.body.rotation[k]
        # Coriolis acceleration 2 w x v; and w x the angular velocity against the frame, which turns with it
        bent_2, turned_2 = 2.0 * _cross_forms(frame.spin, bent), _cross_forms(frame.spin, turned)
        own_block = (slice(None), columns, columns)
        bent_2[own_block] += np.tensordot(R, beam.body.displacement_2[k], 1)
        turned_2[own_block] += np.tensordot(R, beam.body.rotation_2[k], 1)
        station = Motion(
            straight.position,
            straight.speed + bent,
            straight.spin + turned,
            straight.speed_2 + bent_2,
            straight.spin_2 + turned_2,
        )
        return station.at(R @ local - R[:, 0] * beam.body.stations[k])

    def _columns(self, link: int) -> slice:
        """Where a flexible link's coordinates stand among all coordinates."""
        among_elastic, m = self.elastic[link], len(self.unknowns)
        return slice(m + among_elastic.start, m + among_elastic.stop)

    @cached_property
    def handle(self) -> Motion:
        """The handle's point, with its link's frame."""
        return self.point(self.mech.handle_link, self.mech.handle[0, 0])

    def handle_along(self, screws: Floats) -> Floats:
        """h (..., c): motion of the handle along screws (..., 6) per unit rate of each coordinate, J^T u + W^T
        w."""
        return np.asarray(screws[..., :3] @ self.handle.speed + screws[..., 3:] @ self.handle.spin)

    def joint(self, link: int) -> tuple[Floats, Floats]:
        """Rate (c,) of a link's joint coordinate, and its second derivative (c, c)."""
        u = int(self.mech.column[link])
        return self.rates[u], self.rates_2[u]

    def mass_matrix(self) -> Floats:
        """Mass matrix (c, c) of the links in the independent coordinates."""
        return self._mass_of(self.rates)

    def elastic_stiffness(self) -> Floats:
        """Stiffness (c, c) of the flexible links."""
        return self._stiffness_of(self.rates)

    def elastic_damping(self) -> Floats:
        """Damping (c, c) of the flexible links themselves."""
        B = np.zeros((self.count, self.count))
        for link, beam in self.flexible.items():
            bent = self.rates[self._columns(link)]
            B += beam.damping_time * bent.T @ beam.body.stiffness @ bent
        return symmetric(B)

    def _mass_of(self, rates: Floats) -> Floats:
        """Mass matrix (k, k) of the links in coordinates with these rates (m + e, k) of all."""
        M = np.zeros((rates.shape[1],) * 2)
        for link in self.mech.bodies:
            R, base, beam = self.rotation[link], self._links[link], self.flexible.get(int(link))
            mass, place, inertia = self._rigid_body(int(link))
            centre = self._at(self._links, int(link), place)
            speed, spin = centre.speed @ rates, R.T @ (centre.spin @ rates)
            M += mass * speed.T @ speed + spin.T @ inertia @ spin
            # the beam's own, in its axes: velocity and angular velocity of its base, then its elastic coordinates
            if beam is not None:
                moved = np.vstack([R.T @ base.speed @ rates, R.T @ base.spin @ rates, rates[self._columns(link)]])
                M += moved.T @ beam.body.mass @ moved
        return symmetric(M)

    def _stiffness_of(self, rates: Floats) -> Floats:
        """Stiffness (k, k) of the flexible links in coordinates with these rates (m + e, k) of all."""
        K = np.zeros((rates.shape[1],) * 2)
        for link, beam in self.flexible.items():
            bent = rates[self._columns(link)]
            K += bent.T @ beam.body.stiffness @ bent
        return symmetric(K)

    def _rigid_body(self, link: int) -> tuple[float, Floats, Floats]:
        """Mass [kg], centre (3,) [m] and inertia (3, 3) [kg m²] about it, of what of a link is rigid: all of it,
        or of a flexible link what its beam carries."""
        beam = self.flexible.get(link)
        if beam is None:
            mech = self.mech
            return float(mech.mass[0, link]), mech.center_of_mass[0, link], mech.inertia[0, link]
        return beam.carried_mass, beam.carried_center, beam.carried_inertia

    def weight(self, gravity: Floats) -> tuple[Floats, Floats]:
        """Generalised forces (c,) of gravity (3,) [m/s²] on the links, and their derivative (c, c)."""
        force, derivative = np.zeros(self.count), np.zeros((self.count, self.count))
        for link in self.mech.bodies if np.any(gravity) else ():
            mass, place, _ = self._rigid_body(int(link))
            first, second = mass * self.point(link, place).speed, mass * self.point(link, place).speed_2
            if (beam := self.flexible.get(int(link))) is not None:
                of_beam, of_beam_2 = self._first_moment(int(link), beam)
                first, second = first + of_beam, second + of_beam_2
            force += gravity @ first
            derivative += np.tensordot(gravity, second, 1)
        return force, derivative

    def _first_moment(self, link: int, beam: FlexibleLink) -> tuple[Floats, Floats]:
        """First (3, c) and second derivative (3, c, c) of a beam's mass times the place of its centre, by the
        independent coordinates. link: number of the link that the beam is."""
        base, R, columns = self._links[link], self.rotation[link], self._columns(link)
        M = beam.body.mass
        # the mass matrix's rows of velocity: m of the speed, m c of the spin (m c_x in M[1, 5], the beam's axis
        # being x), and the elastic coordinates
        mass = M[0, 0]
        straight = base.at(R @ np.array([M[1, 5], 0.0, 0.0]) / mass)
        bent = np.zeros_like(base.speed)
        bent[:, columns] = R @ M[:3, 6:]
        bent_2 = 2.0 * _cross_forms(base.spin, bent)
        bent_2[:, columns, columns] += np.tensordot(R, beam.body.first_moment_2, 1)
        whole = Motion(
            straight.position,
            mass * straight.speed + bent,
            base.spin,
            mass * straight.speed_2 + bent_2,
            base.spin_2,
        ).in_coordinates(self.rates, self.rates_2)
        return whole.speed, whole.speed_2

    def _all_links(self) -> dict[int, Motion]:
        """Each link's frame in all joint coordinates, parents first; the base as -1."""
        mech, m = self.mech, len(self.mech.joint) + self.elastic_count
        still = Motion(
            np.zeros(3), *(np.zeros((3, m)) for _ in range(2)), *(np.zeros((3, m, m)) for _ in range(2))
        )
        links, carried = {-1: still}, list[Floats]()
        for i in range(mech.parent.size):
            p, u, z = int(mech.parent[i]), int(mech.column[i]), self._axis[i]
            moved = self._at(links, p, self._local(p, self._origin[i]), mech.origin[0, i])
            # spin of what carries the joint: of a flexible parent its station there, of a ball joint its base
            carried.append(moved.spin if mech.carrier[i] == p else carried[-1])
            unit_rate = np.zeros(m)
            if u >= 0:
                unit_rate[u] = 1.0
            # what the joint adds: its axis per unit rate, and that axis as it turns with what carries it
            along, turned = np.outer(z, unit_rate), _cross_forms(carried[i], np.outer(z, unit_rate))
            if mech.kind[i] == PRISMATIC:
                links[i] = Motion(
                    moved.position, moved.speed + along, moved.spin, moved.speed_2 + 2.0 * turned, moved.spin_2
                )
            else:
                links[i] = Motion(
                    moved.position, moved.speed, moved.spin + along, moved.speed_2, moved.spin_2 + turned
                )
        return links

    def _local(self, link: int, place: Floats) -> Floats:
        """A place (3,) of the base's frame in that of a link."""
        return place if link < 0 else self.rotation[link].T @ (place - self._origin[link])

    def _independent(self) -> tuple[Floats, Floats]:
        """B (m + e, c) and B2 (m + e, c, c): how all coordinates follow the drives, free joints and elastic
        motions, by the closures."""
        mech, c, e = self.mech, self.joint_count, self.elastic_count
        m = len(mech.joint)
        passive = m - c
        B = np.zeros((m + e, c + e))
        B[passive:m, :c], B[m:, c:] = mech.to_joint[0], np.eye(e)
        if not mech.a.size:
            B[:, c:] = self._natural(B[:, c:])
            return B, np.zeros((m + e, c + e, c + e))
        A, A2 = self._closures()
        unit = mech.unit[0, :passive]
        inverse = unit[:, None] * np.linalg.pinv(A[:, :passive] * unit, rcond=RANK)
        B[:passive, :c] = -inverse @ (A[:, passive:m] @ B[passive:m, :c])
        # what the closures determine: the passive joints, and together with them the links' deformations
        hanging = np.concatenate([np.arange(passive), np.arange(m, m + e)]).astype(np.int64)
        if e:
            # columns in units of like size, so that a rank can be told
            scale = np.concatenate([unit, self._elastic_scale()])
            rows = A[:, hanging] * scale
            _, size, right = np.linalg.svd(rows)
            rank = int(np.count_nonzero(size > RANK * size[0]))
            B = np.hstack([B[:, :c], np.zeros((m + e, len(hanging) - rank))])
            B[hanging, c:] = scale[:, None] * right[rank:].T
            B[:, c:] = self._natural(B[:, c:])
            inverse = scale[:, None] * np.linalg.pinv(rows, rcond=RANK)
        B2 = np.zeros((m + e, B.shape[1], B.shape[1]))
        B2[hanging] = -np.tensordot(inverse, B.T @ A2 @ B, 1)
        return B, self._without_stress(B, B2) if e else B2

    def _without_stress(self, B: Floats, B2: Floats) -> Floats:
        """B2, of all that close the loops the one whose deformations no stress of the elastic motions works on.

        Any of them will do where the links are not stressed. Under load they are, by K eps of eps = B xi, which
        would do work on the deformations in B2, and be a stiffness of the order of the load.
        """
        motions = B[:, self.joint_count :]
        inverse_stiffness = np.linalg.inv(self._stiffness_of(motions))
        stress = np.zeros((motions.shape[1], *B2.shape[1:]))
        for link, beam in self.flexible.items():
            bent = self._columns(link)
            stress += np.tensordot((beam.body.stiffness @ motions[bent]).T, B2[bent], 1)
        return np.asarray(B2 - np.tensordot(motions @ inverse_stiffness, stress, 1))

    def _natural(self, motions: Floats) -> Floats:
        """The natural modes (m + e, k) that motions (m + e, k) in which no drive moves span, the slowest first, of
        a mass of 1 each."""
        if not motions.shape[1]:
            return motions
        M, K = self._mass_of(motions), self._stiffness_of(motions)
        # of M in terms of K, whose largest eigenvalues are the slowest modes, which so keep their digits
        root = np.linalg.cholesky(K)
        half = np.linalg.solve(root, M)
        inverse, modes = np.linalg.eigh(symmetric(np.linalg.solve(root, half.T)))
        slowest = modes[:, ::-1]
        # of stiffness 1 and mass `inverse` each; over its root the mass is 1. abs: rounding may leave one below 0
        return np.asarray(motions @ np.linalg.solve(root.T, slowest) * np.abs(inverse[::-1]) ** -0.5)

    def _elastic_scale(self) -> Floats:
        """(e,)  of each elastic coordinate, by which it moves its beam by the mechanism's size on the average."""
        size, out = float(self.mech.size[0]), np.ones(self.elastic_count)
        for link, beam in self.flexible.items():
            mass = beam.body.mass
            out[self.elastic[link]] = size * np.sqrt(mass[0, 0] / np.diag(mass)[6:])
        return out

    def _closures(self) -> tuple[Floats, Floats]:
        """A (r, m) and A2 (r, m, m) of A u'' + u'^T A2 u' = 0; rows of rotations times the mechanism's size."""
        mech, size = self.mech, float(self.mech.size[0])
        rows, rows_2 = list[Floats](), list[Floats]()
        for k in range(mech.a.size):
            a, b = int(mech.a[k]), int(mech.b[k])
            first, second = (
                self._at(self._links, link, local)
                for link, local in ((a, mech.point_a[0, k]), (b, mech.point_b[0, k]))
            )
            rows.append(first.speed - second.speed)
            rows_2.append(first.speed_2 - second.speed_2)
            if mech.closing[k] == POINT:
                continue
            across, slip = np.eye(3), np.zeros_like(first.spin_2)
            turn, turn_2 = first.spin - second.spin, first.spin_2 - second.spin_2
            if mech.closing[k] == AXIS:
                # the links turn by s against each other about an axis z that itself turns: s z' = s w_a x z
                z = mech.axis_a[0, k] if a < 0 else self.rotation[a] @ mech.axis_a[0, k]
                across = np.eye(3) - np.outer(z, z)
                moving, along = _cross(first.spin, z), z @ turn
                slip = 0.5 * (
                    along[None, :, None] * moving[:, None, :] + along[None, None, :] * moving[:, :, None]
                )
            rows.append(size * (across @ turn))
            rows_2.append(size * (np.tensordot(across, turn_2, 1) - slip))
        return np.concatenate(rows), np.concatenate(rows_2)


def _cross(forms: Floats, arm: Floats) -> Floats:
    """forms x arm: linear or quadratic forms (3, ...) in the coordinates, crossed with an arm (3,)."""
    x, y, z = arm
    turn = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return np.asarray((turn @ forms.reshape(3, -1)).reshape(forms.shape))


def _cross_forms(a: Floats, b: Floats) -> Floats:
    """The symmetric quadratic form (3, u, u) in u' of (a u') x (b u'), with a and b (3, u)."""
    product = a[NEXT, :, None] * b[LAST, None, :] - a[LAST, :, None] * b[NEXT, None, :]
    return np.asarray(0.5 * (product + product.transpose(0, 2, 1)))


def _place(mech: MechanismArrays, angles: Floats) -> tuple[Floats, Floats, Floats]:
    """Axes (n, 3, 3) and origin (n, 3) of every link, and its joint's axis (n, 3), in the base frame."""
    n = mech.parent.size
    rotation, origin, axis = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 3))
    _place_all(mech, np.array(angles, dtype=np.float64), rotation, origin, axis)
    return rotation, origin, axis


@compiled
def _place_all(mech: MechanismArrays, angles: Floats, rotation: Floats, origin: Floats, axis: Floats) -> None:
    """Fill axes (n, 3, 3) and origin (n, 3) of every link, and its joint's axis (n, 3), at joint coordinates
    (n,)."""
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    rotation[:], origin[:], axis[:] = work.rotation, work.origin, work.axis
