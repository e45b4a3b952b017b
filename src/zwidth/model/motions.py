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

The three rates of a ball joint are one angular velocity, and no rates of coordinates; about a posture they are
those of the turn from there, whose vector has no second-order terms of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.compiled import compiled
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.mechanism import AXIS, POINT, PRISMATIC, Floats
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
    rates     (m, c) B,   rates_2 (m, c, c)  B2
    """

    def __init__(self, mech: MechanismArrays, angles: Floats) -> None:
        """Place the links.

        mech    of one design;   angles (n,) joint coordinates of a posture with closed loops [rad], [m]
        """
        self.mech = mech
        self.unknowns = self.mech.joint
        self.rotation, self._origin, self._axis = _place(self.mech, angles)
        self._links = self._all_links()
        self.rates, self.rates_2 = self._independent()

    @property
    def count(self) -> int:
        """Number c of independent coordinates."""
        return self.mech.driven + self.mech.free

    def point(self, link: int, local: Floats) -> Motion:
        """A point (3,) of a link's frame [m], with that frame, in the independent coordinates; link -1: the
        base."""
        arm = local if link < 0 else self.rotation[link] @ local
        return self._links[link].at(arm).in_coordinates(self.rates, self.rates_2)

    @cached_property
    def handle(self) -> Motion:
        """The handle's point, with its link's frame."""
        return self.point(self.mech.handle_link, self.mech.handle[0, 0])

    def joint(self, link: int) -> tuple[Floats, Floats]:
        """Rate (c,) of a link's joint coordinate, and its second derivative (c, c)."""
        u = int(self.mech.column[link])
        return self.rates[u], self.rates_2[u]

    def mass_matrix(self) -> Floats:
        """Mass matrix (c, c) of the links in the independent coordinates."""
        M = np.zeros((self.count, self.count))
        for link in self.mech.bodies:
            centre, R = self.point(link, self.mech.center_of_mass[0, link]), self.rotation[link]
            M += self.mech.mass[0, link] * centre.speed.T @ centre.speed
            M += centre.spin.T @ (R @ self.mech.inertia[0, link] @ R.T) @ centre.spin
        return M

    def weight(self, gravity: Floats) -> tuple[Floats, Floats]:
        """Generalised forces (c,) of gravity (3,) [m/s^2] on the links, and their derivative (c, c)."""
        force, derivative = np.zeros(self.count), np.zeros((self.count, self.count))
        for link in self.mech.bodies if np.any(gravity) else ():
            centre, pull = self.point(link, self.mech.center_of_mass[0, link]), self.mech.mass[0, link] * gravity
            force += pull @ centre.speed
            derivative += np.tensordot(pull, centre.speed_2, 1)
        return force, derivative

    def _all_links(self) -> dict[int, Motion]:
        """Each link's frame in all joint coordinates, parents first; the base as -1."""
        mech, m = self.mech, len(self.mech.joint)
        still = Motion(
            np.zeros(3), *(np.zeros((3, m)) for _ in range(2)), *(np.zeros((3, m, m)) for _ in range(2))
        )
        links = {-1: still}
        for i in range(mech.parent.size):
            p, u, z = int(mech.parent[i]), int(mech.column[i]), self._axis[i]
            carrier = links[int(mech.carrier[i])]
            moved = links[p].at(self._origin[i] - links[p].position)
            own = np.zeros(m)
            if u >= 0:
                own[u] = 1.0
            along, turned = np.outer(z, own), _cross_forms(carrier.spin, np.outer(z, own))
            if mech.kind[i] == PRISMATIC:
                links[i] = Motion(
                    moved.position, moved.speed + along, moved.spin, moved.speed_2 + 2.0 * turned, moved.spin_2
                )
            else:
                links[i] = Motion(
                    moved.position, moved.speed, moved.spin + along, moved.speed_2, moved.spin_2 + turned
                )
        return links

    def _independent(self) -> tuple[Floats, Floats]:
        """B and B2 of the joints by those of the drives and free joints, on which they hang by the closures."""
        mech, c = self.mech, self.count
        m = len(mech.joint)
        passive = m - c
        B, B2 = np.zeros((m, c)), np.zeros((m, c, c))
        B[passive:] = mech.to_joint[0]
        if passive:
            A, A2 = self._closures()
            unit = mech.unit[0, :passive]
            inverse = unit[:, None] * np.linalg.pinv(A[:, :passive] * unit, rcond=RANK)
            B[:passive] = -inverse @ (A[:, passive:] @ B[passive:])
            B2[:passive] = -np.tensordot(inverse, B.T @ A2 @ B, 1)
        return B, B2

    def _closures(self) -> tuple[Floats, Floats]:
        """A (r, m) and A2 (r, m, m) of A u'' + u'^T A2 u' = 0; rows of rotations times the mechanism's size."""
        mech, size = self.mech, float(self.mech.size[0])
        rows, rows_2 = list[Floats](), list[Floats]()
        for k in range(mech.a.size):
            a, b = int(mech.a[k]), int(mech.b[k])
            first, second = (
                self._links[link].at(local if link < 0 else self.rotation[link] @ local)
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
    """Linear or quadratic forms (3, ...), crossed with an arm (3,)."""
    x, y, z = arm
    turn = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return np.asarray((turn @ forms.reshape(3, -1)).reshape(forms.shape))


def _cross_forms(a: Floats, b: Floats) -> Floats:
    """The symmetric quadratic form (3, u, u) of (a u') x (b u')."""
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
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    rotation[:], origin[:], axis[:] = work.rotation, work.origin, work.axis
