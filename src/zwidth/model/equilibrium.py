"""The haptic equilibrium: a device at rest between the hand's force and the wall's (thesis eq. 2.4).

Two laws hold it. The links, with the hand's force F, gravity and the torques s of the drives' springs,

    J^T F + w(p) + T^T s = 0,        s_i the torque of spring i, whose motor is ahead by d_i

and the computer, which asks for the wall's force f along the rendered direction u where it counts the motors,

    s = t(p_c) f + compensation(p_c),    T^T t = h,  h = J^T u                      at the posture p_c it counts

Behind rigid drives p_c = p, so that F = -f u without gravity, in every posture. Behind flexible ones p_c is ahead by
the deflections: the torques J(p_c)^T u f are not those of a force along u at p, and the hand has to supply the
difference, a small force across the direction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.model.drive_motion import CountedPosture, DriveMotion, counted_posture
from zwidth.model.drive_springs import DriveSprings
from zwidth.model.load import ALONG, Compensation, Load, LoadError
from zwidth.model.mechanism import ORIENTATION, POSITION, Floats, Mechanism
from zwidth.model.motions import Motions

STEPS: Final = 50  # of Newton's method
SETTLED: Final = 1e-12  # share of the torques by which the balance may be off
UNBALANCED: Final = 1e-7  # share of the torques that counts as a joint that nothing balances


class EquilibriumError(LoadError):
    """There is no equilibrium under a load, or none that the device holds."""


@dataclass(frozen=True)
class Equilibrium:
    """A device of one design at rest in one posture under load; d drives, c independent coordinates.

    load           what it bears
    screw          (6,)  the rendered direction
    motions, drives  of the links, in the posture that they have
    counted        the device as the computer sees it
    springs        of the drives
    wall_force     f, that the wall pushes with along the direction [N]
    hand_force, hand_moment  (3,)  of the hand on the handle [N], [N m]
    deflections    (d,)  by which the motors are ahead of their joints, at the joint [rad]
    torques        (d,)  of the motors, at the joint [N m]
    compensation   how gravity is compensated
    """

    load: Load
    screw: Floats
    motions: Motions
    drives: DriveMotion
    counted: CountedPosture
    springs: DriveSprings
    wall_force: float
    hand_force: Floats
    hand_moment: Floats
    deflections: Floats
    torques: Floats
    compensation: Compensation

    @property
    def sideways_force(self) -> Floats:
        """The part (3,) of the hand's force, or about an axis of its moment, across the rendered direction."""
        own, along = (
            (self.hand_force, self.screw[:3]) if np.any(self.screw[:3]) else (self.hand_moment, self.screw[3:])
        )
        return np.asarray(own - (own @ along) / (along @ along) * along)

    @property
    def kinked(self) -> tuple[int, ...]:
        """Drives without torque whose stiffness changes there."""
        return tuple(int(i) for i in np.flatnonzero(self.springs.kinked & (self.deflections == 0.0)))


def command_of(counted: CountedPosture, screw: Floats, weight: Floats, wall_force: float) -> tuple[Floats, Floats]:
    """Motor torques (d,) that the computer asks for, and their part per unit of the wall's force.

    weight  (c,) generalised forces of gravity as it computes them, which it compensates
    """
    k = counted.seen.shape[0]
    share = np.linalg.pinv(counted.drives.T[:, :k].T)
    unit = share @ lever_arms_of(counted.motions, screw)[:k]
    return wall_force * unit - share @ weight[:k], unit


def lever_arms_of(motions: Motions, screw: Floats) -> Floats:
    """h (c,) = J^T u + W^T w of a screw (6,)."""
    handle = motions.handle
    return np.asarray(screw[:3] @ handle.speed + screw[3:] @ handle.spin)


def solve_equilibrium(
    mechanism: Mechanism,
    angles: Floats,
    screw: Floats,
    load: Load,
    compensation: Compensation = "none",
    counts_motors: bool = True,
) -> Equilibrium:
    """The equilibrium of one design with its links in a given posture.

    mechanism  with the ratios of drives with tables looked up at the posture, and their tables
    angles     (n,)  joint coordinates of the links
    screw      (6,)  the rendered direction (`effective_parameters.screw`)
    counts_motors  whether the encoders are on the motors, or on the links behind the drives
    Raises     EquilibriumError  where nothing balances a joint, or the drives' springs cannot hold the load
               LoadError         for a load across the direction that nothing holds
    """
    motions = Motions(mechanism, angles)
    return _Balance(mechanism, angles, screw, load, compensation, counts_motors, motions).solve()


class _Balance:
    """The search for the deflections and the wall's force."""

    def __init__(
        self,
        mechanism: Mechanism,
        angles: Floats,
        screw: Floats,
        load: Load,
        compensation: Compensation,
        counts_motors: bool,
        motions: Motions,
    ) -> None:
        self.mechanism, self.angles, self.screw, self.load = mechanism, angles, screw, load
        self.compensation, self.counts_motors, self.motions = compensation, counts_motors, motions
        self.ratio = np.asarray(mechanism.drives.transmission)
        self.drives = DriveMotion.of(mechanism, motions, angles, self.ratio)
        self.springs = DriveSprings.of(mechanism.drives)
        self.flexible = self.springs.flexible
        self.gravity = np.zeros(3) if compensation == "counterweight" else load.weight
        self.weight = motions.weight(self.gravity)[0]
        self.along = screw[:3] if np.any(screw[:3]) else screw[3:]
        self.to_wrench = self._wrench_of_torques()
        given = None if load.force is None else float(load.force @ self.along) / float(self.along @ self.along)
        if load.force is not None and not abs(given or 0.0) > ALONG * float(np.linalg.norm(load.force)):
            raise LoadError(
                f"the load {_numbers(load.force)} does not push along the rendered direction {_numbers(self.along)}, "
                "where the wall would hold it; choose a load with a part along the direction"
            )
        self.normal = given

    def _wrench_of_torques(self) -> Floats:
        """(6, c): the hand's force and moment that balance generalised forces (c,), the least that do."""
        handle, c = self.motions.handle, self.motions.count
        rows = np.zeros((6, c))
        if self.mechanism.controls != ORIENTATION and np.any(handle.speed):
            rows[:3] = np.linalg.pinv(handle.speed.T)
        if self.mechanism.controls == ORIENTATION:
            rows[3:] = np.linalg.pinv(handle.spin.T)
        elif self.mechanism.controls != POSITION:
            size = float(self.motions.mech.size[0])
            both = np.concatenate([handle.speed, size * handle.spin])
            rows = np.linalg.pinv(both.T)
            rows[3:] *= size
        return rows

    def solve(self) -> Equilibrium:
        """Newton's method for the deflections of the flexible drives and the wall's force."""
        ahead, f = np.zeros(len(self.ratio)), -(self.normal or 0.0)
        for _ in range(STEPS):
            counted = self._counted(ahead)
            torques, unit = command_of(counted, self.screw, self._compensated(counted), f)
            s = self._spring_torques(ahead, torques)
            off, jacobian = self._equations(ahead, counted, torques, unit, s, f)
            size = float(np.max(np.abs(s), initial=0.0))
            step = np.linalg.solve(jacobian, off)
            if np.max(np.abs(off), initial=0.0) <= SETTLED * max(size, abs(f)):
                return self._result(ahead, counted, torques, s, f)
            if not np.isfinite(step).all():
                break
            ahead[self.flexible] -= step[: len(self.flexible)]
            f -= step[-1] if self.normal is not None else 0.0
        raise EquilibriumError(self._not_held())

    def _counted(self, ahead: Floats) -> CountedPosture:
        counted = counted_posture(
            self.mechanism, self.angles, ahead if self.counts_motors else np.zeros_like(ahead), self.ratio
        )
        if counted is None:
            raise EquilibriumError(self._not_held())
        return counted

    def _not_held(self) -> str:
        what = "gravity" if self.load.force is None else f"a load of {_numbers(self.load.force)}"
        return (
            f"no equilibrium was found under {what}: the springs of the drives bend further than the device can move; "
            "is the load too large, or a stiffness too small?"
        )

    def _compensated(self, counted: CountedPosture) -> Floats:
        if self.compensation != "computed":
            return np.zeros(self.motions.count)
        return counted.motions.weight(self.gravity)[0]

    def _spring_torques(self, ahead: Floats, torques: Floats) -> Floats:
        """What each drive hands on to its joint: a rigid one the motor's torque."""
        s = torques.copy()
        s[self.flexible] = self.springs.torque(ahead)[self.flexible]
        return s

    def _equations(
        self, ahead: Floats, counted: CountedPosture, torques: Floats, unit: Floats, s: Floats, f: float
    ) -> tuple[Floats, Floats]:
        """What the balance of the flexible drives, and of the load along the direction, is off by, and the
        derivative of both."""
        F, count = self.flexible, len(self.flexible)
        turning = command_change(counted, self.screw, self.gravity, self.compensation, f)
        by_ahead = turning[:, F] if self.counts_motors else np.zeros((len(s), count))
        tangent = np.zeros((len(s), count))
        tangent[F] = np.diag(self.springs.tangent(ahead, self.load.branch == "backward")[F])
        off, jacobian = (s - torques)[F], np.zeros((count, count))
        jacobian[:, :] = (tangent - by_ahead)[F]
        if self.normal is None:
            return off, jacobian
        along = np.zeros(6)
        along[:3] = self.along if np.any(self.screw[:3]) else 0.0
        along[3:] = 0.0 if np.any(self.screw[:3]) else self.along
        row = -(along @ self.to_wrench) / float(self.along @ self.along)
        by_spring = row @ self.drives.T.T
        s_by_ahead, s_by_force = by_ahead.copy(), unit.copy()
        s_by_ahead[F], s_by_force[F] = tangent[F], 0.0
        off = np.append(off, row @ self.weight + by_spring @ s - self.normal)
        column = np.append(-unit[F], by_spring @ s_by_force)
        return off, np.column_stack([np.vstack([jacobian, by_spring @ s_by_ahead]), column])

    def _result(self, ahead: Floats, counted: CountedPosture, torques: Floats, s: Floats, f: float) -> Equilibrium:
        borne = self.weight + self.drives.T.T @ s
        wrench = -(self.to_wrench @ borne)
        self._check_balance(wrench, borne, s)
        found = Equilibrium(
            self.load, self.screw, self.motions, self.drives, counted, self.springs,
            float(f), wrench[:3], wrench[3:], ahead, torques, self.compensation,
        )  # fmt: skip
        self._check_across(found)
        return found

    def _check_balance(self, wrench: Floats, borne: Floats, s: Floats) -> None:
        """Raise EquilibriumError where the hand cannot balance a coordinate."""
        handle = self.motions.handle
        left = borne + wrench[:3] @ handle.speed + wrench[3:] @ handle.spin
        scale = max(
            float(np.max(np.abs(self.weight), initial=0.0)),
            float(np.max(np.abs(self.drives.T.T) @ np.abs(s), initial=0.0)),
            float(np.max(np.abs(wrench[:3]) @ np.abs(handle.speed), initial=0.0)),
        )
        loose = np.flatnonzero(np.abs(left) > UNBALANCED * scale)
        if len(loose):
            k = len(self.mechanism.driven)
            names = [
                self.mechanism.links.names[self.motions.unknowns[len(self.motions.unknowns) - len(left) + i]]
                for i in loose
            ]
            what = "free joint" if np.all(loose >= k) else "joint"
            raise EquilibriumError(
                f"nothing balances {float(left[loose[0]]):.4g} N m at the {what} {names[0]!r}, neither a drive nor the "
                "hand at the handle; give the joint a spring, compensate gravity, or ask for another posture"
            )

    def _check_across(self, found: Equilibrium) -> None:
        """Raise LoadError where the load asks for another force across the direction than the posture needs."""
        force = self.load.force
        if force is None or self.load.settle:
            return
        across = force - (force @ self.along) / float(self.along @ self.along) * self.along
        off, needed = np.linalg.norm(across - found.sideways_force), found.sideways_force
        if np.any(np.abs(across) > ALONG * np.linalg.norm(force)) and off > UNBALANCED * np.linalg.norm(force):
            raise LoadError(
                f"the load {_numbers(force)} has a part {_numbers(across)} across the rendered direction, where the wall "
                f"does not hold it, and this posture needs {_numbers(needed)}; give the part along the direction "
                "alone, or ask with settle for the posture in which this load is in balance"
            )


def command_change(
    counted: CountedPosture, screw: Floats, gravity: Floats, compensation: Compensation, wall_force: float
) -> Floats:
    """By how much the torques that the computer asks for change with the drives' coordinates that it counts, (d, d),
    at a constant force of the wall: its force turns with the counts, and gravity with what is computed of it.

        tau = T G b,  G = (T^T T)^-1,  b = f h - w(p_c)

        dtau = Z G b - T G (Z^T T + T^T Z) G b + T G db,     db/dp = f H - dw/dp
    """
    k = counted.seen.shape[0]
    T, Z = counted.drives.T[:, :k], counted.drives.Z[:, :k, :k]
    motions, handle = counted.motions, counted.motions.handle
    b = wall_force * lever_arms_of(motions, screw)[:k]
    change = wall_force * (np.tensordot(screw[:3], handle.speed_2, 1) + np.tensordot(screw[3:], handle.turning, 1))
    change = change[:k, :k]
    if compensation == "computed":
        force, derivative = motions.weight(gravity)
        b, change = b - force[:k], change - derivative[:k, :k]
    G = np.linalg.inv(T.T @ T)
    x = G @ b
    turned = np.einsum("ist,s->it", Z, x)
    inner = np.einsum("ist,i->st", Z, T @ x) + T.T @ turned
    return np.asarray((turned + T @ (G @ (change - inner))) @ counted.seen)


def _numbers(values: Floats) -> str:
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in np.round(values, 12)) + ")"
