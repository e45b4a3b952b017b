"""A device under load: the posture that it takes, and its plant linearised about the balance there.

The posture asked for is that of the handle, and the load changes nothing of it but where free joints hang. Or it
is that of the motors as the computer counts them; then the handle gives way by the bending of the drives. Or the
device settles: it slides along the surface to where the hand's force, as it is given, is in balance. A free joint
turns to where gravity and its spring leave it.

About that haptic equilibrium the device is linearised (thesis eq. 2.5). What a load changes of its plant are two
halves, since one acts at every instant and the other at samples:

- the links feel the hand's force F, gravity and the torques s of their drives all the time. With second
  derivatives as in `motions`,

      K += -(F . d2x/dp2 + dw/dp + sum_i s_i d2z_i/dp2)

- the computer turns its force with the motors that it counts: torques change by S dz, S of `command_change`, at
  samples, held and late as everything that it commands. So does the surface's normal, by 1/R per way along it.

Rigid drives without delay let the halves cancel but for what sampling leaves. Either alone is another device.

Springs keep the tangent k + 3 k_3 d^2 that they have at their deflection, on the branch on which they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled
from zwidth.errors import EquilibriumError, LoadError
from zwidth.model.closure import equations, passive_rates
from zwidth.model.continuation import moved_posture
from zwidth.model.design_axes import at_index, change_designs
from zwidth.model.equilibrium import Balance, Equilibrium, command_change
from zwidth.model.forward_kinematics import link_point, place_links, working_memory
from zwidth.model.inertia import handle_jacobian, mass_matrix, unit_motions
from zwidth.model.load import Load, unit_of_push
from zwidth.model.mechanism import BALL_X, POSITION, Damping, Mechanism, drives_at, nonlinear_of_drives
from zwidth.model.mechanism_arrays import MechanismArrays, pack
from zwidth.model.modes import clusters, repeat_tolerance, undamped_modes
from zwidth.model.plant import Plant, SampledForce
from zwidth.model.posture import NO_EQUILIBRIUM, OK, Posture
from zwidth.model.reduction import Encoders, reduce_mechanism

STEPS: Final = 40  # of Newton's method
ROUNDS: Final = 40  # in which free joints, bending and sliding follow one another
SETTLED: Final = 1e-11  # share of the largest force, or of the mechanism's size, that counts as balance
PROBE: Final = 1e-6  # by which joints are moved for a derivative [rad], [m]
LARGEST_STEP: Final = 0.5  # of Newton's method [rad], [m]


def loaded_postures(
    mechanism: Mechanism, posture: Posture, screws: Floats, load: Load, counts_motors: bool
) -> Posture:
    """The postures under load of postures (...) without it, one by one; designs broadcast with them. Those that
    are not OK stay as they are.

    posture  as it is asked for; one that was found under load stands for the one that it was found from
    screws   (..., 6)  rendered directions;   counts_motors  whether encoders are on the motors, or behind the
             drives
    Returns  the postures; in a batch one without equilibrium is marked NO_EQUILIBRIUM, its numbers nan
    Raises   EquilibriumError, LoadError  for a single posture without one
             LoadError  for a load that can be meant in no posture of a batch
    """
    posture = posture.asked or posture
    if not posture.status.shape:
        return replace(_loaded_posture(mechanism, posture, screws, load, counts_motors), asked=posture)
    changed, shape = replace(posture.with_axes(np.array), asked=posture), posture.status.shape
    refused: LoadError | None = None
    numbers = [changed.angles, changed.mass_matrix, changed.jacobian, changed.angular_jacobian]
    numbers += [changed.closure_residual, changed.projected]
    for index in np.ndindex(shape):
        if posture.status[index] != OK:
            continue
        single = at_index(index)
        try:
            one_mechanism = change_designs(mechanism, single, shape)
            found = _loaded_posture(one_mechanism, posture.with_axes(single), screws[index], load, counts_motors)
        except LoadError as error:
            # a posture without equilibrium says nothing of others; any other LoadError holds for all of them
            refused = refused if isinstance(error, EquilibriumError) else error
            changed.status[index] = NO_EQUILIBRIUM
            for array in numbers:
                array[index] = np.nan
            continue
        for name in ("position", "angles", "mass_matrix", "jacobian", "angular_jacobian"):
            getattr(changed, name)[index] = getattr(found, name)
        if changed.rotation is not None and found.rotation is not None:
            changed.rotation[index] = found.rotation
    if refused is not None and not np.any(changed.status == OK):
        raise refused
    return changed


def _loaded_posture(
    mechanism: Mechanism, posture: Posture, screw: Floats, load: Load, counts_motors: bool
) -> Posture:
    """The posture under load of one design, whose posture without load is given; arguments of `loaded_postures`.

    Raises  EquilibriumError, LoadError  where there is none
    """
    balances, at = _Balances(mechanism, screw, load, counts_motors), posture
    for _ in range(ROUNDS):  # each of the three hangs on the others by the load's own small changes
        before = at.angles
        if mechanism.free:
            at = _hung(mechanism, at, balances)
        if load.posture_of == "motors":
            at = _behind_motors(mechanism, posture, at, balances)
        elif mechanism.flexible:
            at = _ahead_of_bending(mechanism, posture, at, balances)
        if load.settle:
            at = _slid(mechanism, at, screw, load, balances)
        if np.max(np.abs(at.angles - before), initial=0.0) <= SETTLED:
            break
    else:
        raise EquilibriumError(
            f"no posture was found under {load.text(unit_of_push(screw))}: after {ROUNDS} rounds of bending and "
            "hanging it still changes; choose a smaller load, or stiffer drives and links"
        )
    found = balances.check(at)
    # `_moved` places the handle as if the links did not bend
    return replace(at, position=found.handle_place) if mechanism.flexible else at


class _Balances:
    """The equilibria of the postures that a search passes through, each looked for from the one before."""

    def __init__(self, mechanism: Mechanism, screw: Floats, load: Load, counts_motors: bool) -> None:
        """Begin without any; arguments as of `loaded_postures`, of one design and one direction."""
        self.mechanism, self.screw, self.load, self.counts_motors = mechanism, screw, load, counts_motors
        self.last: tuple[Posture, Balance, Equilibrium] | None = None

    def solve(self, posture: Posture) -> Equilibrium:
        """The equilibrium of a posture of the links. Raises what `Balance.solve` raises."""
        return self._balance_of(posture)[1]

    def check(self, posture: Posture) -> Equilibrium:
        """The equilibrium of a posture. Raises what `Balance.check` raises where it is not held."""
        balance, found = self._balance_of(posture)
        balance.check(found)
        return found

    def scale(self, posture: Posture) -> float:
        """The largest generalised force of a posture, see `Balance.largest_part`."""
        balance, found = self._balance_of(posture)
        return balance.largest_part(found)

    def _balance_of(self, posture: Posture) -> tuple[Balance, Equilibrium]:
        """Balance and equilibrium of a posture, looked for from the last one; kept until another posture comes."""
        if self.last is not None and self.last[0] is posture:
            return self.last[1:]
        mechanism = self.mechanism
        ratios = replace(drives_at(mechanism.drives, posture), ratio_tables=mechanism.drives.ratio_tables)
        posed = replace(mechanism, drives=ratios)
        balance = Balance(posed, posture, self.screw, self.load, self.counts_motors)
        found = balance.solve(None if self.last is None else self.last[2])
        self.last = posture, balance, found
        return balance, found


def _behind_motors(mechanism: Mechanism, asked: Posture, at: Posture, balances: _Balances) -> Posture:
    """The links' posture, searched for from `at`, where the motors count the one that is asked for: behind it by
    the bending of the drives. Raises EquilibriumError where none is found."""
    k, c = len(mechanism.driven), asked.jacobian.shape[-1]
    for _ in range(STEPS):
        found = balances.solve(at)
        away = asked.angles[mechanism.driven] - found.counted.angles[mechanism.driven]
        if np.max(np.abs(away), initial=0.0) <= SETTLED:
            return at
        coordinates = found.motions.mech.to_drive[0, :k, :k] @ away
        at = _moved(mechanism, at, np.append(coordinates, np.zeros(c - k)))  # the free joints stay
    raise EquilibriumError(
        "no posture was found whose motors stand where they were asked to: the load bends the drives too far; "
        "choose a smaller load"
    )


def _ahead_of_bending(mechanism: Mechanism, asked: Posture, at: Posture, balances: _Balances) -> Posture:
    """The links' posture, as if they were rigid, in which their bending has the handle where it is asked for;
    searched for from `at`. Raises EquilibriumError where none is found."""
    k, c = len(mechanism.driven), asked.jacobian.shape[-1]
    for _ in range(STEPS):
        found = balances.solve(at)
        away = asked.position - found.handle_place
        step = np.zeros(c)
        # what the drives cannot make up for, as bending out of a plane, stays
        step[:k] = np.linalg.pinv(at.jacobian[:, :k]) @ away
        if np.max(np.abs(step), initial=0.0) <= SETTLED:
            return at
        at = _moved(mechanism, at, step)
    raise EquilibriumError("no posture was found in which the bent links have the handle where it is asked for")


def _slid(mechanism: Mechanism, at: Posture, screw: Floats, load: Load, balances: _Balances) -> Posture:
    """The posture, with its handle on the same plane across the direction, in which the load as it is given is in
    balance.

    Raises  EquilibriumError  where none is found near `at`;   LoadError  for another handle or direction
    """
    assert load.force is not None
    if mechanism.controls != POSITION or not np.any(screw[:3]) or np.any(screw[3:]):
        raise LoadError("settle is for loads on a handle whose position the drives control; leave it out")
    k, u, force = len(mechanism.driven), screw[:3], load.force
    ways, sizes, _ = np.linalg.svd(at.jacobian[:, :k], full_matrices=False)
    reached = ways[:, sizes > 1e-9 * sizes[0]]  # directions in which the drives move the handle at all
    across = reached @ np.linalg.svd((u @ reached)[None])[2][1:].T  # the ways along the surface
    size, strength = float(pack(mechanism).size[0]), float(np.linalg.norm(force))
    start = balances.solve(at).handle_place

    def off(there: Posture) -> Floats:
        """Sideways force and way along the direction that are too much, in shares of load and size."""
        found = balances.solve(there)
        return np.append(across.T @ (found.hand_force - force) / strength, u @ (found.handle_place - start) / size)

    found = _find_posture(mechanism, at, off, np.arange(k), SETTLED)
    if found is None:
        unbalanced = balances.solve(at).hand_force - force
        raise EquilibriumError(
            f"no posture was found near this one in which the load alone is in balance: here the hand has to "
            f"supply {float(np.linalg.norm(across.T @ unbalanced)):.4g} N more across the direction; leave "
            "settle out, which keeps the posture and lets the hand supply it"
        )
    return found


def _hung(mechanism: Mechanism, at: Posture, balances: _Balances) -> Posture:
    """The posture with the drives of `at` and free joints where gravity, their springs and the load leave them.

    Raises  EquilibriumError  where none is found, and for a free ball joint that would have to turn
    """
    k, count = len(mechanism.driven), len(mechanism.free)
    # the same in every posture, so that what is searched for are forces; 1.0 where none acts
    scale = balances.scale(at) or 1.0

    def off(there: Posture) -> Floats:
        """Forces on the free joints that nothing balances, in shares of the largest force."""
        return np.asarray(balances.solve(there).unbalanced[k:] / scale)

    if np.max(np.abs(off(at)), initial=0.0) <= SETTLED:
        return at
    # the links of a joint with several coordinates are "name/1", "name/2" and "name"
    names = [mechanism.links.names[i].partition("/")[0] for i in mechanism.free]
    if any(mechanism.links.joint[i] >= BALL_X for i in mechanism.free):
        raise EquilibriumError(
            f"where the free ball joint {names[0]!r} would hang under this load is not searched for; place its "
            "centre of mass at the joint, or leave gravity out"
        )
    found = _find_posture(mechanism, at, off, np.arange(k, k + count), SETTLED, downhill=True)
    if found is None:
        raise EquilibriumError(
            f"no place was found where the free joint {names[0]!r} is in balance under this load; give it a "
            "spring, or another angle in the assembly"
        )
    return found


def _find_posture(
    mechanism: Mechanism,
    at: Posture,
    off: Callable[[Posture], Floats],
    moved: Ints,
    settled: float,
    *,
    downhill: bool = False,
) -> Posture | None:
    """The posture near `at` in which off(posture) (m,) is 0, by Newton's method; None where it does not get there.

    moved     (m,)  indices of the independent coordinates that move
    settled   size of `off` that counts as 0
    downhill  off are the forces on these coordinates: they are followed as far as it takes, to where they hold
    """
    c = at.jacobian.shape[-1]
    for _ in range(STEPS):
        try:
            value = off(at)
            if np.max(np.abs(value), initial=0.0) <= settled:
                return at
            columns = [
                (
                    off(_moved(mechanism, at, PROBE * np.eye(c)[i]))
                    - off(_moved(mechanism, at, -PROBE * np.eye(c)[i]))
                )
                / (2.0 * PROBE)
                for i in moved
            ]
            change, step = np.array(columns).T, np.zeros(c)
            step[moved] = _downhill_step(change, value) if downhill else -np.linalg.solve(change, value)
            if not (downhill or np.max(np.abs(step)) < LARGEST_STEP):
                return None
            at = _moved(mechanism, at, step)
        except (EquilibriumError, np.linalg.LinAlgError):
            return None
    return None


def _downhill_step(change: Floats, forces: Floats) -> Floats:
    """Newton's step (m,) where the forces (m,) hold against small motions, else one along them that is as large as
    their stiffness would have it with the other sign; none longer than LARGEST_STEP.

    change  (m, m)  derivatives of the forces
    """
    stiffness, ways = np.linalg.eigh(-(change + change.T) / 2.0)
    if stiffness[0] > 0.0:
        step = -np.linalg.solve(change, forces)
    else:
        step = ways @ (ways.T @ forces / np.maximum(np.abs(stiffness), np.finfo(float).eps))
    return np.asarray(step * min(1.0, LARGEST_STEP / float(np.max(np.abs(step)))))


def _moved(mechanism: Mechanism, at: Posture, step: Floats) -> Posture:
    """The posture after a step (c,) of the independent coordinates.

    Raises  EquilibriumError  where the loops cannot follow
    """
    mech, c = pack(mechanism), len(step)
    angles = moved_posture(mech, at.angles, step)
    if angles is None:
        raise EquilibriumError("under this load the device would leave its workspace; choose a smaller load")
    mass, jacobian, angular = np.empty((1, c, c)), np.empty((1, 3, c)), np.empty((1, 3, c))
    position, turn = np.empty(3), np.empty((3, 3))
    _describe(mech, angles, mass, jacobian, angular, position, turn)
    return replace(
        at,
        angles=angles,
        position=position,
        mass_matrix=mass[0],
        jacobian=jacobian[0],
        angular_jacobian=angular[0],
        rotation=None if at.rotation is None else turn,
    )


@compiled
def _describe(
    mech: MechanismArrays,
    angles: Floats,
    mass: Floats,
    jacobian: Floats,
    angular: Floats,
    position: Floats,
    turn: Floats,
) -> None:
    """Fill in, at joint coordinates angles (n,), the mass matrix (1, c, c), the handle's Jacobians (1, 3, c), its
    position (3,) and its axes `turn` (3, 3)."""
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    unit_motions(mech, work)
    mass_matrix(mech, 0, work, mass, 0)
    handle_jacobian(mech, 0, work, jacobian, angular, 0)
    position[0], position[1], position[2] = link_point(
        work.rotation, work.origin, mech.handle_link, mech.handle, 0, 0
    )
    turn[:] = work.rotation[mech.handle_link] @ mech.handle_rotation[0]


MOVED: Final = 1e-9  # share of all motions below which the wall's force moves one by rounding
ROUNDING: Final = 1e-14  # share of the largest part of a sampled feedback that is none


@dataclass(frozen=True)
class LoadedPlants:
    """A device's plant with and without what the load changes, on the same coordinates."""

    loaded: Plant
    unloaded: Plant


def linearise(
    mechanism: Mechanism,
    posture: Posture,
    equilibrium: Equilibrium,
    damping: Damping,
    encoders: Encoders,
) -> LoadedPlants:
    """The full model of one design in one posture at its equilibrium.

    mechanism, posture  those of the equilibrium;   damping, encoders  as of `reduce_mechanism`
    """
    axis = equilibrium.screw
    drives = mechanism.drives
    tangent = equilibrium.springs.tangent(equilibrium.deflections, equilibrium.load.branch == "backward")
    bent = replace(
        mechanism, drives=replace(drives, stiffness=tangent / drives.transmission**2, ratio_tables=None)
    )
    unloaded = reduce_mechanism(bent, posture, axis, "full", damping, encoders)
    c, n = equilibrium.motions.count, unloaded.size
    flexible = equilibrium.springs.flexible
    # the drives' coordinates per coordinate of the plant (d, n): at the joints, at the motors, where they are
    # counted
    links = np.concatenate([equilibrium.drives.T, np.zeros((len(tangent), n - c))], axis=1)
    motors = links.copy()
    motors[flexible] = np.eye(n)[c:]
    counted = motors if encoders == "motor" else links
    K = np.zeros((n, n))
    K[:c, :c] = _links_stiffness(equilibrium)
    seen, k = equilibrium.counted, len(mechanism.driven)
    # torques of the drives per generalised force on the driven coordinates (d, k)
    share = np.asarray(np.linalg.pinv(seen.drives.T[:, :k].T), dtype=np.float64)
    h = seen.motions.handle_along(axis)[:k]
    symmetric, turning = _symmetric_parts(K)
    backward = equilibrium.load.branch == "backward"
    parts = nonlinear_of_drives(drives, h @ seen.seen, links, motors, counted, equilibrium.deflections, backward)
    loaded = replace(
        unloaded,
        stiffness=unloaded.stiffness + symmetric,
        circulatory=turning,
        actuator=(share @ h) @ motors,
        sensor=(h @ seen.seen) @ counted,
        sampled_forces=_sampled_forces(equilibrium, share, motors, counted),
        nonlinear=replace(
            parts, friction=unloaded.nonlinear.friction, force_limit=_force_left(mechanism, equilibrium, share @ h)
        ),
    )
    return LoadedPlants(loaded, unloaded)


def _symmetric_parts(K: Floats) -> tuple[Floats, Floats | None]:
    """The symmetric and the antisymmetric part of a stiffness (n, n); None where the second is rounding."""
    symmetric, turning = 0.5 * (K + K.T), 0.5 * (K - K.T)
    return symmetric, turning if np.any(np.abs(turning) > ROUNDING * np.max(np.abs(K), initial=0.0)) else None


def _force_left(mechanism: Mechanism, equilibrium: Equilibrium, share: Floats) -> float:
    """By how much the wall's force may change before a motor is at its limit [N]; inf without one.

    share  (d,)  of the drives' torques at the joints, per newton of the wall's force
    """
    drives, used = mechanism.drives, share != 0.0
    left = drives.transmission * drives.torque_limit - np.abs(equilibrium.torques)
    return float(np.min(left[used] / np.abs(share[used]), initial=np.inf))


def _links_stiffness(equilibrium: Equilibrium) -> Floats:
    """Stiffness -dQ/dp (c, c) of the generalised forces Q of hand, gravity and drives' torques on the links."""
    handle, drives, load = equilibrium.motions.handle, equilibrium.drives, equilibrium.load
    felt = 0.0 if load.hand == "neglected" else 1.0
    force, moment = felt * equilibrium.hand_force, felt * equilibrium.hand_moment
    K = np.tensordot(force, handle.speed_2, 1) + np.tensordot(moment, handle.turning, 1)
    if load.hand == "follower":  # the force turns by W dp with the link, W = handle.spin
        K = (
            K
            + handle.speed.T @ np.cross(handle.spin.T, force).T
            + handle.spin.T @ np.cross(handle.spin.T, moment).T
        )
    if equilibrium.compensation != "counterweight":
        K = K + equilibrium.motions.weight(load.weight)[1]
    # torques on the joints: of the spring, or of the motor where the drive is rigid
    s = np.where(
        np.isfinite(equilibrium.springs.forward),
        equilibrium.springs.torque(equilibrium.deflections),
        equilibrium.torques,
    )
    return -np.asarray(K + np.tensordot(s, drives.Z, 1))


def _sampled_forces(
    equilibrium: Equilibrium, share: Floats, motors: Floats, counted: Floats
) -> tuple[SampledForce, ...]:
    """What the computer adds to its torques as the device moves: that they turn, and that the surface is curved.

    share            (d, k)  torques of the drives per generalised force on the driven coordinates
    motors, counted  (d, n)  the drives' coordinates at the motors, and as they are counted, per coordinate of the
                             plant
    """
    load, seen, u = equilibrium.load, equilibrium.counted, equilibrium.screw
    gravity = np.zeros(3) if equilibrium.compensation == "counterweight" else load.weight
    turning = command_change(seen, u, gravity, equilibrium.compensation, equilibrium.wall_force)
    forces = _rank_one_forces(turning, motors, counted, False)
    if isfinite(load.surface_radius):
        k = seen.seen.shape[0]
        # the normal, and with it the wall's force, turns by 1/R per way across the direction
        across = seen.motions.handle.speed[:, :k]
        across = across - np.outer(u[:3], u[:3] @ across)
        curved = abs(equilibrium.wall_force) / load.surface_radius * (share @ (across.T @ across) @ seen.seen)
        forces += _rank_one_forces(curved, motors, counted, True)
    return forces


def _rank_one_forces(change: Floats, motors: Floats, counted: Floats, filtered: bool) -> tuple[SampledForce, ...]:
    """A feedback (d, d) from counted coordinates to motors' torques, as products of one column and one row each.

    motors, counted (d, n), as of `_sampled_forces`;   filtered  as of `SampledForce`
    """
    left, size, right = np.linalg.svd(change)
    kept = np.flatnonzero(size > ROUNDING * np.max(size, initial=0.0))
    return tuple(SampledForce(left[:, i] @ motors, size[i] * (right[i] @ counted), filtered) for i in kept)


def set_apart(plants: LoadedPlants) -> Plant:
    """The loaded plant on the motions that the wall's force moves without load; the others stand apart.

    Without load the two do not know of each other. What couples them is of the order of the load, and moves poles
    by its square; `Load.count_sideways` keeps it. Motions that are free without load may be held by no more than
    that themselves, so that those apart have it (`_giving_way`).
    """
    moved, still = moved_motions(plants.unloaded)
    if not len(still.squared):
        return _on_modes(plants, moved)
    return replace(
        _on_modes(plants, moved), apart=_giving_way(_on_modes(plants, still), plants, moved, still.shapes)
    )


def _giving_way(apart: Plant, plants: LoadedPlants, moved: ModalMotions, still: Floats) -> Plant:
    """The motions apart with the stiffness that they have where springs give way to them and a stiff wall holds
    the reading:

        K_ss - [K_sm 0] [K_mm a_m; c_m^T 0]^-1 [K_ms; 0]      K with what the computer adds, actuator a, sensor c;
                                                          m: of `moved`, s: of `still` (n, s), motions in columns

    The second part is of the order of the load's square over the drives' stiffness. So is all that is left of the
    first where the links' half and the computer's cancel. Without springs in `moved` they stay as they are.
    """
    loaded, held = plants.loaded, moved.squared != 0.0
    if not held.any():
        return apart
    free = moved.shapes[:, ~held]
    along = free @ (free.T @ loaded.actuator)  # of free motions the one that the wall's force starts
    ways = np.column_stack([moved.shapes[:, held], along])
    added = loaded.stiffness - plants.unloaded.stiffness
    added = added - sum(np.outer(force.along, force.reading) for force in loaded.sampled_forces)
    if loaded.circulatory is not None:
        added = added + loaded.circulatory
    # 0.0: without load nothing holds the last of the ways, the free motion
    K = np.diag(np.append(moved.squared[held], 0.0)) + ways.T @ added @ ways
    bordered = np.block([[K, (loaded.actuator @ ways)[:, None]], [loaded.sensor @ ways, 0.0]])
    pushed = np.vstack([ways.T @ added @ still, np.zeros((1, still.shape[1]))])
    # without the last unknown, the wall's force that holds the reading
    change = -(still.T @ added @ ways @ np.linalg.lstsq(bordered, pushed, rcond=None)[0][:-1])
    if apart.circulatory is not None:
        change = change + apart.circulatory
    symmetric, turning = _symmetric_parts(change)
    return replace(apart, stiffness=apart.stiffness + symmetric, circulatory=turning)


def counting_all(plants: LoadedPlants) -> Plant:
    """The loaded plant on all its modes without load, those that no wall moves among them."""
    squared, V = undamped_modes(plants.unloaded.mass, plants.unloaded.stiffness)
    return _on_modes(plants, ModalMotions(V, squared))


def _on_modes(plants: LoadedPlants, motions: ModalMotions) -> Plant:
    """The loaded plant on some mass-normalised modes of the unloaded one. Their own mass and stiffness are exact:
    of a free motion the stiffness is 0, so that what the load adds keeps its digits."""
    Z = motions.shapes
    added = Z.T @ (plants.loaded.stiffness - plants.unloaded.stiffness) @ Z
    modal_stiffness, mass = np.diag(motions.squared), np.eye(len(motions.squared))
    bare = replace(plants.unloaded.on_motions(Z), mass=mass, stiffness=modal_stiffness)
    return replace(plants.loaded.on_motions(Z), mass=mass, stiffness=modal_stiffness + added, without_load=bare)


class ModalMotions(NamedTuple):
    """Mass-normalised motions: shapes (n, m), each within one natural frequency, and its square (m,) [1/s²]."""

    shapes: Floats
    squared: Floats


def moved_motions(plant: Plant) -> tuple[ModalMotions, ModalMotions]:
    """The motions that a force at the actuator moves, and the others: the least subspaces that mass, stiffness and
    damping keep apart. Both are sums of what they have at each natural frequency."""
    squared, V = undamped_modes(plant.mass, plant.stiffness)
    drag = V.T @ plant.damping @ V
    for damper in plant.lagged_dampers:
        drag = drag + damper.damping * np.outer(V.T @ damper.along, V.T @ damper.along)
    groups = [np.arange(len(squared))[run] for run in clusters(squared, repeat_tolerance(squared))]
    drag = drag / max(float(np.max(np.abs(drag))), np.finfo(float).tiny)
    pushed = (V.T @ plant.actuator)[:, None]
    pushed = pushed / np.linalg.norm(pushed)
    # what the force moves at each frequency, widened by what the damping of what is moved pushes, until it stays
    moved = np.zeros((plant.size, 0))
    while True:
        reached = np.hstack([pushed, drag @ moved])
        turned, moves = np.zeros_like(V), np.zeros(plant.size, dtype=bool)
        for group in groups:
            left, size, _ = np.linalg.svd(reached[group])
            turned[np.ix_(group, group)] = left
            moves[group] = np.arange(len(group)) < np.count_nonzero(size > MOVED)
        if np.count_nonzero(moves) == moved.shape[1]:
            break
        moved = turned[:, moves]
    shapes = V @ turned
    return ModalMotions(shapes[:, moves], squared[moves]), ModalMotions(shapes[:, ~moves], squared[~moves])
