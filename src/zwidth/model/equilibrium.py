"""The haptic equilibrium: a device at rest between the hand's force and the wall's (thesis eq. 2.4).

Two laws hold it. The links, with the hand's force F, gravity and the torques s of the drives' springs,

    J^T F + w(p) + T^T s = 0,        s_i the torque of spring i, whose motor is ahead by d_i

and the computer, which asks for the wall's force f along the rendered direction u where it counts the motors,

    s = t(p_c) f + compensation(p_c),    T^T t = h,  h = J^T u                      at the posture p_c it counts

Behind rigid drives p_c = p, so that F = -f u without gravity, in every posture. Behind flexible ones p_c is ahead
by the deflections: the torques J(p_c)^T u f are not those of a force along u at p, and the hand has to supply the
difference, a small force across the direction.

The springs of flexible drives under load: torque and tangent, on the branch on which they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.errors import EquilibriumError, LoadError, SidewaysForceError
from zwidth.model.effective_mass import CountedPosture, DriveMotion, counted_posture
from zwidth.model.load import ALONG, Load, unit_of_push, vector_text
from zwidth.model.mechanism import ORIENTATION, POSITION, PRISMATIC, Compensation, Drives, Mechanism, kinks
from zwidth.model.mechanism_arrays import pack
from zwidth.model.motions import Motions
from zwidth.model.posture import Posture

STEPS: Final = 50  # of Newton's method
RAMP: Final = 16  # steps in which a load is brought on, where it cannot be at once
LARGEST_STEP: Final = 1.0  # of a deflection [rad], [m]
BENT: Final = 1e-12  # change of the links' bending, in shares of it, below which it is found
SETTLED: Final = 1e-12  # share of the torques by which the balance may be off
UNBALANCED: Final = 1e-7  # share of the torques that counts as a joint that nothing balances


@dataclass(frozen=True)
class Equilibrium:
    """A device of one design at rest in one posture under load; d drives, c independent coordinates.

    load           what it bears
    screw          (6,)  the rendered direction
    motions, drives  of the links, in the posture that they have
    counted        the device as the computer sees it
    springs        of the drives
    wall_force     f, that the wall pushes with along the direction [N], or turns with about an axis [N m]
    hand_force, hand_moment  (3,)  of the hand on the handle [N], [N m]
    bending        (x,)  elastic coordinates of the flexible links
    deflections    (d,)  by which the motors are ahead of their joints, at the joint [rad], of a prismatic one [m]
    torques        (d,)  of the motors, at the joint [N m], of a prismatic one [N]
    ratio          (d,)  of the transmissions
    compensation   how gravity is compensated
    unbalanced     (c,)  generalised forces that neither hand nor drives balance
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
    bending: Floats
    deflections: Floats
    torques: Floats
    ratio: Floats
    compensation: Compensation
    unbalanced: Floats

    @property
    def handle_place(self) -> Floats:
        """Where the handle is (3,), flexible links bent [m]."""
        handle, x = self.motions.handle, self.bending
        n = self.motions.joint_count
        return np.asarray(handle.position + handle.speed[:, n:] @ x + 0.5 * (handle.speed_2[:, n:, n:] @ x) @ x)

    @property
    def sideways_force(self) -> Floats:
        """The part (3,) of the hand's force, or about an axis of its moment, across the rendered direction."""
        hand, along = (
            (self.hand_force, self.screw[:3]) if np.any(self.screw[:3]) else (self.hand_moment, self.screw[3:])
        )
        return np.asarray(hand - (hand @ along) / (along @ along) * along)

    def one_sided_amplitude(self, wall_stiffness: float) -> float:
        """Amplitude of the reading up to which a vibration stays in a one-sided wall, F/K [m]; nan without one."""
        return abs(self.wall_force) / wall_stiffness if wall_stiffness > 0.0 else float("nan")

    def document(self, drives: Sequence[str]) -> dict[str, Any]:
        """The equilibrium's numbers by their keys. drives: the drives' names."""
        ratio = self.ratio
        return {
            "wall_force_N": self.wall_force,
            "hand_force_N": self.hand_force.tolist(),
            "hand_moment_Nm": self.hand_moment.tolist(),
            "sideways_force_N": self.sideways_force.tolist(),
            "position_m": self.handle_place.tolist(),
            "counted_position_m": self.counted.motions.handle.position.tolist(),
            "motor_torques_Nm": dict(zip(drives, (self.torques / ratio).tolist(), strict=True)),
            "deflections_rad": dict(zip(drives, self.deflections.tolist(), strict=True)),
        }

    @property
    def kinked(self) -> tuple[int, ...]:
        """Drives that are bent to just where their stiffness changes: without preload, those without torque."""
        return tuple(int(i) for i in np.flatnonzero(self.springs.at_kink(self.deflections)))


def command_of(counted: CountedPosture, screw: Floats, weight: Floats, wall_force: float) -> tuple[Floats, Floats]:
    """What the computer asks for where it counts the posture: motor torques at the joints (d,), and their part per
    newton of the wall's force (d,).

    screw   (6,)  the rendered direction
    weight  (c,)  generalised forces of gravity as it computes them, which it compensates
    """
    k = counted.seen.shape[0]
    share = np.linalg.pinv(counted.drives.T[:, :k].T)  # torques of the drives per generalised force
    per_newton = share @ counted.motions.handle_along(screw)[:k]
    return wall_force * per_newton - share @ weight[:k], per_newton


def solve_equilibrium(
    mechanism: Mechanism, posture: Posture, screw: Floats, load: Load, counts_motors: bool = True
) -> Equilibrium:
    """The equilibrium of one design with its links in a given posture.

    mechanism  with the ratios of drives with tables looked up at the posture, and their tables
    posture    of the links, a single one. Springs of free joints are at rest where the assembly has these joints
    screw      (6,)  the rendered direction (`effective_mass.screw`)
    counts_motors  whether the encoders are on the motors, or on the links behind the drives
    Raises     EquilibriumError  where nothing balances a joint, or drives and their springs cannot hold the load
               LoadError         for a load that does not push along the direction
    """
    balance = Balance(mechanism, posture, screw, load, counts_motors)
    found = balance.solve()
    balance.check(found)
    return found


class Balance:
    """The search for the deflections and the wall's force of one posture."""

    def __init__(
        self, mechanism: Mechanism, posture: Posture, screw: Floats, load: Load, counts_motors: bool
    ) -> None:
        """Take motions, springs and weight at a posture, its links unbent; arguments of `solve_equilibrium`."""
        self.mechanism, self.angles, self.screw, self.load = mechanism, posture.angles, screw, load
        self.counts_motors = counts_motors
        self.motions = Motions(pack(mechanism), posture.angles, mechanism.flexible)
        self.rigid = Motions(self.motions.mech, posture.angles) if mechanism.flexible else self.motions
        self.ratio = np.asarray(mechanism.drives.transmission)
        self.drives = DriveMotion.of(mechanism, self.motions, posture.angles, self.ratio)
        self.springs = DriveSprings.of(mechanism.drives)
        self.flexible = self.springs.flexible
        self.compensation = mechanism.gravity_compensation
        self.gravity = np.zeros(3) if self.compensation == "counterweight" else load.weight
        self.weight, self.weight_change = self.motions.weight(self.gravity)
        self.free_springs = self._free_springs(mechanism.assemblies[posture.assembly])
        self.heaviest = self._heaviest()
        self.along = screw[:3] if np.any(screw[:3]) else screw[3:]
        self.normal = load.along(screw)
        self.elastic = self.motions.elastic_stiffness()[self.joints :, self.joints :]
        self._bend(np.zeros(len(self.elastic)), 1.0)

    @property
    def joints(self) -> int:
        """Number of independent joint coordinates; elastic ones follow them."""
        return self.motions.joint_count

    def _bend(self, bending: Floats, share: float) -> None:
        """Set what acts on the joints under a share of the load, the flexible links bent by coordinates (x,).

        Set are speed and spin (3, n) of the handle per unit rate, the generalised forces `pull` (n,) of gravity,
        the drives' motion (d, n) and `to_wrench` (`_wrench_of_torques`).
        """
        n, handle = self.joints, self.motions.handle
        self.bending = bending
        self.speed = handle.speed[:, :n] + handle.speed_2[:, :n, n:] @ bending
        self.spin = handle.spin[:, :n] + handle.turning[:, :n, n:] @ bending
        self.pull = share * (self.weight[:n] + self.weight_change[:n, n:] @ bending)
        self.motion = self.drives.T[:, :n] + self.drives.Z[:, :n, n:] @ bending
        self.to_wrench = self._wrench_of_torques()

    def _heaviest(self) -> Floats:
        """Generalised forces (n,) of the whole weight at the mechanism's size, to judge a balance by: where it has
        no lever arm, its own are rounding."""
        mech = self.motions.mech
        weight = float(np.linalg.norm(self.gravity) * np.sum(mech.mass[0]))
        # with a lever arm of the mechanism's size: N m, over the unit of what slides N
        return np.asarray(weight * mech.size[0] / mech.unit[0, len(mech.joint) - self.joints :])

    def _free_springs(self, rest: Floats) -> Floats:
        """Torques (c,) of the free joints' own springs, which are at rest at joint coordinates `rest` (n,)."""
        torques, stiffness = np.zeros(self.joints), self.mechanism.links.joint_stiffness
        for i, link in enumerate(self.mechanism.free if stiffness is not None else ()):
            assert stiffness is not None
            torques[len(self.mechanism.driven) + i] = -stiffness[link] * (self.angles[link] - rest[link])
        return torques

    def _wrench_of_torques(self) -> Floats:
        """(6, n): the least force and moment on the handle that act on the joints as generalised forces (n,) do;
        the hand balances these by its negative."""
        rows = np.zeros((6, self.joints))
        if self.mechanism.controls != ORIENTATION and np.any(self.speed):
            rows[:3] = np.linalg.pinv(self.speed.T)
        if self.mechanism.controls == ORIENTATION:
            rows[3:] = np.linalg.pinv(self.spin.T)
        elif self.mechanism.controls != POSITION:
            # least in force and moment over the mechanism's size
            size = float(self.motions.mech.size[0])
            both = np.concatenate([self.speed, size * self.spin])
            rows = np.linalg.pinv(both.T)
            rows[3:] *= size
        return rows

    def _push_of_torques(self) -> Floats:
        """(n,)  the hand's push along the rendered direction, or about its axis, by generalised forces on the
        joints."""
        wrench = self.to_wrench[:3] if np.any(self.screw[:3]) else self.to_wrench[3:]
        return np.asarray(-(self.along @ wrench) / float(self.along @ self.along))

    def solve(self, near: Equilibrium | None = None) -> Equilibrium:
        """The deflections of the flexible drives, the bending of the links and the wall's force; where the whole
        load at once leads nowhere, it is brought on in steps.

        near    the equilibrium of a neighbouring posture, from which this one is looked for first; None: from none
        Raises  LoadError         for a push that the hand cannot give
                EquilibriumError  where none is found, or the links buckle
        """
        if self.normal is not None and not np.any(self._push_of_torques()):
            linear = bool(np.any(self.screw[:3]))
            raise LoadError(
                f"the hand holds the handle by its {'orientation' if linear else 'position'}, which the drives "
                f"control, and cannot push {'along a direction' if linear else 'about an axis'}; leave the load "
                f"out, or render {'an axis' if linear else 'a direction'}"
            )
        if near is not None:
            self._bend(near.bending, 1.0)
            found = self._newton(1.0, near.deflections, near.wall_force)
            if found is not None:
                return found
            self._bend(np.zeros(len(self.elastic)), 1.0)
        start = np.zeros(len(self.ratio)), 0.0
        found = self._newton(1.0, *start)
        for step in range(1, RAMP + 1) if found is None else ():
            found = self._newton(step / RAMP, *start)
            if found is None:
                break
            start = found.deflections, found.wall_force
        if found is None:
            raise EquilibriumError(self._not_held())
        return found

    def _newton(self, share: float, ahead: Floats, f: float) -> Equilibrium | None:
        """The equilibrium under a share of load and gravity, by Newton's method from deflections `ahead` (d,) and
        a wall's force f [N] near it; None where it does not converge.

        Raises  EquilibriumError  where the load buckles the links
        """
        ahead = ahead.copy()
        self._bend(self.bending, share)
        for _ in range(STEPS):
            counted = counted_posture(
                self.mechanism,
                self.rigid,
                self.angles,
                ahead if self.counts_motors else np.zeros_like(ahead),
                self.ratio,
            )
            if counted is None:
                return None
            weight = share * self._compensated(counted)
            torques, per_force = command_of(counted, self.screw, weight, f)
            s = torques.copy()  # what each drive hands on to its joint
            s[self.flexible] = self.springs.torque(ahead)[self.flexible]
            errors, jacobian = self._equations(share, ahead, counted, torques, per_force, s, f)
            size = float(np.max(np.abs(s), initial=0.0))
            if np.max(np.abs(errors), initial=0.0) <= SETTLED * max(size, abs(f)):
                found = self._result(self.springs.settled(ahead, SETTLED * self._scale(s)), counted, torques, s, f)
                bending = self._bending_under(share, found, s)
                if np.max(np.abs(bending - self.bending), initial=0.0) <= BENT * np.max(
                    np.abs(bending), initial=0.0
                ):
                    return found
                self._bend(bending, share)
                continue
            with np.errstate(all="ignore"):
                try:
                    step = np.linalg.solve(jacobian, errors)
                except np.linalg.LinAlgError:
                    return None
            if not np.max(np.abs(step[: len(self.flexible)]), initial=0.0) < LARGEST_STEP:
                return None
            ahead[self.flexible] -= step[: len(self.flexible)]
            f -= step[-1] if self.normal is not None else 0.0  # without a push it stays 0, and has no equation
        return None

    def _scale(self, s: Floats) -> float:
        """A torque [N m] by which others are judged as rounding: the largest of the drives, s (d,), or of the
        weight."""
        return float(max(np.max(np.abs(s), initial=0.0), np.max(self.heaviest, initial=0.0)))

    @property
    def _load_text(self) -> str:
        """The load in words, for messages."""
        return self.load.text(unit_of_push(self.screw))

    def _not_held(self) -> str:
        """Message: the springs of the drives bend too far under the load."""
        return (
            f"no equilibrium was found under {self._load_text}: the springs of the drives bend further than the "
            "device can move; is the load too large, or a stiffness too small?"
        )

    def _compensated(self, counted: CountedPosture) -> Floats:
        """Generalised forces (n,) of gravity that the computer works out and compensates; 0 if it does not."""
        if self.compensation != "computed":
            return np.zeros(self.joints)
        return counted.motions.weight(self.gravity)[0]

    def _equations(
        self,
        share: float,
        ahead: Floats,
        counted: CountedPosture,
        torques: Floats,
        per_force: Floats,
        s: Floats,
        f: float,
    ) -> tuple[Floats, Floats]:
        """Errors of the balance, and their derivatives by the deflections of the flexible drives and, where a push
        is asked for, by the wall's force.

        The errors are, for each flexible drive, its spring's torque less the motor's; and where a push is asked
        for, the push along the direction less that.

        share    of load and gravity that acts
        ahead    (d,)  deflections;   f  the wall's force [N];   counted  the posture that is counted at these
        torques  (d,)  of the motors, and per_force (d,) their part per newton of the wall's force
        s        (d,)  what each drive hands on to its joint
        """
        flexible, count = self.flexible, len(self.flexible)
        turning = command_change(counted, self.screw, share * self.gravity, self.compensation, f)
        by_ahead = turning[:, flexible] if self.counts_motors else np.zeros((len(s), count))
        tangent = np.zeros((len(s), count))
        tangent[flexible] = np.diag(self.springs.tangent(ahead, self.load.branch == "backward")[flexible])
        errors, jacobian = (s - torques)[flexible], np.zeros((count, count))
        jacobian[:, :] = (tangent - by_ahead)[flexible]
        if self.normal is None:
            return errors, jacobian
        push_per_torque = self._push_of_torques()
        by_spring = push_per_torque @ self.motion.T
        s_by_ahead, s_by_force = by_ahead.copy(), per_force.copy()
        s_by_ahead[flexible], s_by_force[flexible] = tangent[flexible], 0.0
        errors = np.append(errors, push_per_torque @ self._forces_but_hand(s) - share * self.normal)
        column = np.append(-per_force[flexible], by_spring @ s_by_force)
        return errors, np.column_stack([np.vstack([jacobian, by_spring @ s_by_ahead]), column])

    def _forces_but_hand(self, s: Floats) -> Floats:
        """Generalised forces (n,) on the joints of gravity, free joints' springs and drives, which hand on s (d,):
        all but the hand's."""
        return np.asarray(self.pull + self.free_springs + self.motion.T @ s)

    def _bending_under(self, share: float, found: Equilibrium, s: Floats) -> Floats:
        """Elastic coordinates (x,) of the flexible links under the forces of an equilibrium, s (d,) the drives'.

            (K - G) x = pushed,     G the derivative of these forces by x, which softens the stiffness K

        Raises  EquilibriumError  where the load buckles them
        """
        n, handle = self.joints, self.motions.handle
        if not len(self.elastic):
            return np.zeros(0)
        force, moment = found.hand_force, found.hand_moment
        pushed = force @ handle.speed + moment @ handle.spin + share * self.weight + s @ self.drives.T
        derivative = np.tensordot(force, handle.speed_2, 1) + np.tensordot(moment, handle.turning, 1)
        derivative = derivative + share * self.weight_change + np.tensordot(s, self.drives.Z, 1)
        softening = derivative[n:, n:]
        softening = 0.5 * (softening + softening.T)
        # K - G is definite where the largest eigenvalue of G against K is below 1
        root = np.linalg.cholesky(self.elastic)
        half = np.linalg.solve(root, softening)
        most = float(np.max(np.linalg.eigvalsh(np.linalg.solve(root, half.T))))
        if not most < 1.0:
            raise EquilibriumError(
                f"the links buckle under {self._load_text}: they bear {share / most:.4g} of it; choose a smaller "
                "load, or stiffer links"
            )
        return np.asarray(np.linalg.solve(self.elastic - softening, pushed[n:]))

    def _result(self, ahead: Floats, counted: CountedPosture, torques: Floats, s: Floats, f: float) -> Equilibrium:
        """The equilibrium at deflections `ahead`, motors' torques and those s that drives hand on, (d,) each, and
        the wall's force f [N]."""
        forces = self._forces_but_hand(s)
        wrench = -(self.to_wrench @ forces)
        remaining = forces + wrench[:3] @ self.speed + wrench[3:] @ self.spin
        return Equilibrium(
            load=self.load,
            screw=self.screw,
            motions=self.motions,
            drives=self.drives,
            counted=counted,
            springs=self.springs,
            wall_force=float(f),
            hand_force=wrench[:3],
            hand_moment=wrench[3:],
            deflections=ahead,
            bending=self.bending,
            torques=torques,
            ratio=self.ratio,
            compensation=self.compensation,
            unbalanced=remaining,
        )

    def check(self, found: Equilibrium) -> None:
        """Raise EquilibriumError where drives, hand or wall do not hold what they would have to in an
        equilibrium."""
        self._check_balance(found)
        self._check_torques(found.torques)
        self._check_across(found)

    def largest_part(self, found: Equilibrium) -> float:
        """The largest generalised force of weight, drives and free joints' springs, to judge a balance by."""
        return max(
            float(np.max(self.heaviest, initial=0.0)),
            float(np.max(np.abs(self.motion.T) @ np.abs(found.torques), initial=0.0)),
            float(np.max(np.abs(self.free_springs), initial=0.0)),
        )

    def _check_balance(self, found: Equilibrium) -> None:
        """Raise EquilibriumError where the hand cannot balance a coordinate."""
        left, count, mech = found.unbalanced, self.joints, self.motions.mech
        loose = np.flatnonzero(np.abs(left) > UNBALANCED * self.largest_part(found))
        if not len(loose):
            return
        unknowns = self.motions.unknowns[len(self.motions.unknowns) - count :]
        link, torque = unknowns[loose[0]], abs(float(left[loose[0]]))
        name, unit = self.mechanism.links.names[link], "N" if mech.kind[link] == PRISMATIC else "N m"
        what = "free joint" if loose[0] >= len(self.mechanism.driven) else "joint"
        raise EquilibriumError(
            f"nothing balances {torque:.4g} {unit} at the {what} {name!r}, neither a drive nor the hand at the "
            "handle; give the joint a spring, compensate gravity, or ask for another posture"
        )

    def _check_torques(self, torques: Floats) -> None:
        """Raise EquilibriumError where a motor cannot give its torque."""
        limits = self.mechanism.drives.torque_limit
        wanted = np.abs(torques) / self.ratio
        over = np.flatnonzero(wanted > limits)
        if len(over):
            i = int(over[np.argmax(wanted[over] / limits[over])])
            raise EquilibriumError(
                f"under this load drive {self.mechanism.drives.names[i]!r} needs {wanted[i]:.4g} N m at its "
                f"motor, more than its limit of {limits[i]:.4g} N m; choose a smaller load, or another posture"
            )

    def _check_across(self, found: Equilibrium) -> None:
        """Raise SidewaysForceError where the load has another part across the direction than the posture needs."""
        force = self.load.force if np.any(self.screw[:3]) else self.load.moment
        if force is None or self.load.settle:
            return
        unit = unit_of_push(self.screw)
        across = force - (force @ self.along) / float(self.along @ self.along) * self.along
        off, needed = np.linalg.norm(across - found.sideways_force), found.sideways_force
        if np.any(np.abs(across) > ALONG * np.linalg.norm(force)) and off > UNBALANCED * np.linalg.norm(force):
            raise SidewaysForceError(
                f"the load {vector_text(force)} {unit} has a part {vector_text(across)} {unit} across the "
                f"rendered direction, where the wall does not hold it, and this posture needs "
                f"{vector_text(needed)} {unit}; give the part along the direction alone, or ask with settle for "
                "the posture in which this load is in balance"
            )


def command_change(
    counted: CountedPosture, screw: Floats, gravity: Floats, compensation: Compensation, wall_force: float
) -> Floats:
    """Derivative (d, d) of the torques that the computer asks for by the drives' coordinates that it counts, at a
    constant force of the wall: its force turns with the counts, and gravity with what is computed of it.

        tau = T G b,  G = (T^T T)^-1,  b = f h - w(p_c),  H = dh/dp,  Z = dT/dp

        dtau = Z G b - T G (Z^T T + T^T Z) G b + T G db,     db/dp = f H - dw/dp

    counted     the posture p_c that is counted;   screw (6,)  the rendered direction
    gravity     (3,) [m/s²], which counts only where its compensation is "computed";   wall_force  f [N]
    """
    k = counted.seen.shape[0]
    T, Z = counted.drives.T[:, :k], counted.drives.Z[:, :k, :k]
    motions, handle = counted.motions, counted.motions.handle
    b = wall_force * motions.handle_along(screw)[:k]
    change = wall_force * (np.tensordot(screw[:3], handle.speed_2, 1) + np.tensordot(screw[3:], handle.turning, 1))
    change = change[:k, :k]
    if compensation == "computed":
        force, derivative = motions.weight(gravity)
        b, change = b - force[:k], change - derivative[:k, :k]
    G = np.linalg.inv(T.T @ T)
    x = G @ b
    turned = np.einsum("ist,s->it", Z, x)  # Z G b
    # (Z^T T + T^T Z) G b, what T^T T changes by
    inner = np.einsum("ist,i->st", Z, T @ x) + T.T @ turned
    return np.asarray((turned + T @ (G @ (change - inner))) @ counted.seen)


@dataclass(frozen=True)
class DriveSprings:
    """Torque at the joint per deflection d, motor ahead of joint, of each drive (d,):

        k d + k_3 d^3             and, where the motor lags behind by more than d_k, another k

    forward, backward, hardening  k for either sign, and k_3, at the joint; forward is inf of rigid drives
    kink                          d_k, not positive
    """

    forward: Floats
    backward: Floats
    hardening: Floats
    kink: Floats

    @classmethod
    def of(cls, drives: Drives) -> DriveSprings:
        """The springs of the drives of one design."""
        n = drives.transmission
        forward, nonlinear = n**2 * drives.stiffness, drives.nonlinearity
        if nonlinear is None:
            return cls(forward, forward, np.zeros(len(n)), np.zeros(len(n)))
        given = np.isfinite(nonlinear.backward_stiffness) & np.isfinite(forward)
        backward = np.where(given, n**2 * np.where(given, nonlinear.backward_stiffness, 0.0), forward)
        return cls(forward, backward, n**4 * nonlinear.hardening, kinks(drives, nonlinear))

    @property
    def flexible(self) -> Ints:
        """Indices of the flexible drives."""
        return np.flatnonzero(np.isfinite(self.forward))

    def settled(self, deflection: Floats, rounding: float) -> Floats:
        """Deflections (d,), moved to the kink where they are at it to rounding, a torque [N m]: without torque,
        what is left by a search would else decide on the stiffness."""
        flexible = np.isfinite(self.forward) & (self.forward != self.backward)
        near = np.where(flexible, self.forward, 0.0) * np.abs(deflection - self.kink) <= rounding
        return np.where(flexible & near, self.kink, deflection)

    def at_kink(self, deflection: Floats) -> Flags:
        """(d,)  which drives are bent to just where their stiffness changes."""
        return np.asarray(np.isfinite(self.forward) & (self.forward != self.backward) & (deflection == self.kink))

    def torque(self, deflection: Floats) -> Floats:
        """Torques (d,) [N m] of deflections (d,), 0 of rigid drives."""
        flexible = np.isfinite(self.forward)
        k, other = (np.where(flexible, each, 0.0) for each in (self.forward, self.backward))
        past = np.minimum(deflection - self.kink, 0.0)
        return np.asarray(k * deflection + (other - k) * past + self.hardening * deflection**3)

    def tangent(self, deflection: Floats, backward: bool) -> Floats:
        """dT/dd (d,): k + 3 k_3 d^2, inf of rigid drives.

        backward  of a drive at its kink: True: the branch on which the motor lags behind; False: the other
        """
        lags = (deflection < self.kink) | ((deflection == self.kink) & backward)
        return np.asarray(np.where(lags, self.backward, self.forward) + 3.0 * self.hardening * deflection**2)
