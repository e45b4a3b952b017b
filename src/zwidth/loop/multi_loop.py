"""The sampled loop of m rendered directions under one wall law:  det(1 + P(z) (K + B w(z))) = 0, P (m, m).

A law may differ from direction to direction, f = -(k K0 y + b B0 v). In directions S in which both matrices are
diagonal (`wall_matrices.PrincipalDirections`) it is one number per direction, and with the plant P of these r
directions

    det(1 + P(z) (k diag(s) + b w(z) diag(v))) = 0.

Positions that nobody holds, of a device on a wall without stiffness.

A damper resists motion and holds no place: where a motion of the device has no spring to the ground either, the
device rests wherever it was left. Its characteristic function has the plant's pole z = 1 and the zero z = 1 of the
velocity estimate, so that z - 1 divides the characteristic polynomial for every B: the root is the position, which
neither comes back nor runs away. A second root there is a velocity that nothing brakes, and counts.

A plant with several rendered directions, sampled with an exact hold: the part of it that walls move.

The mechanical states are undamped modes, each with its velocity in units of its own rate, so that slow and fast
modes have entries of one size. Motions that no wall moves or no encoder reads are left out: of modes with equal
poles as many remain as the rank of their m x m residue; of modes coupled by damping, those remain whose own
residue is more than rounding.

A delay of l + f samples splits the interval: the older force acts for f T, the newer for (1 - f) T. With
Gamma(t) the integral of exp(A s) over [0, t], one exponential of the augmented matrix [A, 1; 0, 0] each,

    x_{j+1} = x_j + A Gamma(T) x_j + Gamma((1 - f) T) B u_{j-l} + exp(A (1 - f) T) Gamma(f T) B u_{j-l-1}.

An actuator lag tau f' + f = u adds m states f to A before the exponential is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth import _verbs
from zwidth.arrays import Complexes, Floats, Ints
from zwidth.errors import SeveralDirectionsError, UnmovedError
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import force_filter, velocity_estimator
from zwidth.loop.motion_names import motion_name, pole_name
from zwidth.loop.realisation import FilterStates, filter_states
from zwidth.loop.wall_matrices import PrincipalDirections, WallMatrices
from zwidth.model.argument_checks import check_kind
from zwidth.model.modes import (
    REPEATED,
    UNOBSERVED,
    UNOBSERVED_UNDAMPED,
    clusters,
    repeat_tolerance,
    undamped_modes,
)
from zwidth.model.multi_plant import MultiPlant
from zwidth.model.plant import Plant

if TYPE_CHECKING:
    from zwidth.chart.several_directions.chart import MultiChart
    from zwidth.chart.verdict import Verdicts


# A state moves from sample to sample, and is read, by less than this share of what others are: no wall
# sees it.
UNSEEN = 1e-12


@dataclass(frozen=True)
class MultiLoop:
    """A plant with m rendered directions under f = -(k K0 y + b B0 v), one computer for all.

    matrices  K0 and B0 (m, m), see `WallMatrices.of`; None: identities, the same law along each direction

    >>> free = MultiPlant(np.diag([0.3, 0.1]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    >>> MultiLoop(free, Controller(sampling_period=0.001)).transition_matrix(1000.0, 1.0).shape
    (6, 6)
    """

    plant: MultiPlant
    controller: Controller
    matrices: WallMatrices | None = None

    def __post_init__(self) -> None:
        """Raise TypeError for anything but a plant of several directions, a controller and matrices.

        Also ValueError for matrices of another number of directions, SeveralDirectionsError (loop.point_errors)
        for a controller with fixed feedback.
        """
        hint = "write Loop(plant, controller) for one direction" if isinstance(self.plant, Plant) else ""
        check_kind("plant", self.plant, MultiPlant, hint)
        check_kind("controller", self.controller, Controller)
        if self.controller.fixed_feedback:
            raise SeveralDirectionsError(self.controller.feedback_names)
        if self.matrices is not None:
            check_kind(
                "matrices",
                self.matrices,
                WallMatrices,
                "write WallMatrices.of(relative_stiffness, relative_damping)",
            )
            if self.matrices.count != self.plant.count:
                raise ValueError(
                    f"matrices must be those of {self.plant.count} directions, as many as the plant has, got "
                    f"{self.matrices.count}"
                )

    def chart(self) -> MultiChart:
        """The stable walls k, b, exactly; see `chart.several_directions.chart.multi_chart`."""
        return _verbs.multi_chart(self)

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on walls k [N/m], b [N s/m] of any shape (...) that broadcast, by eigenvalues."""
        return _verbs.multi_check(self, wall_stiffness, wall_damping)

    @cached_property
    def principal(self) -> PrincipalDirections:
        """Directions in which both matrices of the law are diagonal: the rendered ones where all are alike."""
        if self.matrices is None:
            m = self.plant.count
            return PrincipalDirections(np.eye(m), np.ones(m), np.ones(m))
        return self.matrices.principal

    @cached_property
    def principal_plant(self) -> MultiPlant:
        """The plant along the law's principal directions."""
        if self.matrices is None:
            return self.plant
        S = self.principal.combinations
        return replace(
            self.plant, actuators=S @ self.plant.actuators, sensors=S @ self.plant.sensors, handles=None
        )

    @property
    def period(self) -> float:
        """Sampling period T [s]."""
        return self.controller.sampling_period

    @property
    def count(self) -> int:
        """Number of the law's principal directions: m, or fewer where it pushes along fewer."""
        return len(self.principal.stiffness)

    @property
    def whole_delay(self) -> int:
        """Whole samples l of the delay."""
        return self.controller.whole_delay

    @property
    def fractional_delay(self) -> float:
        """Remaining part f of the delay, 0 <= f < 1 [samples]."""
        return self.controller.fractional_delay

    @cached_property
    def continuous_plant(self) -> ContinuousPlant:
        """The part of the plant that walls move, in continuous time. Raises UnmovedError where there is none."""
        plant = continuous_plant(self.principal_plant, self.period, self.fractional_delay)
        if not len(plant.A):
            raise UnmovedError("the wall forces move nothing that the sensors read; check actuators and sensors")
        return plant

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, or sees, by name; they are left out and do not count for stability."""
        sliding = len(self._whole_affine[0]) - len(self.affine[0])
        return self.continuous_plant.unobserved + sliding * (motion_name(0.0, 0.0),)

    @cached_property
    def sampled_plant(self) -> SampledPlant:
        """The plant from sample to sample."""
        lag = self.controller.actuator_time_constant
        return sample_plant(self.continuous_plant, self.period, self.fractional_delay, lag)

    @cached_property
    def estimator(self) -> FilterStates:
        """The velocity estimate w(z), the same along each direction."""
        w = velocity_estimator(self.controller)
        return filter_states(w.numerator, w.denominator, w.window)

    @cached_property
    def force_filter(self) -> FilterStates:
        """F(z), the filter of each direction's force before the hold."""
        F = force_filter(self.controller)
        return filter_states(F.numerator, F.denominator, np.ones(1))

    def plant_response(self, z: ArrayLike) -> Complexes:
        """P(z) (..., r, r) from force commands to readings [m/N] at complex z (...), hold to filter included.

        Along the law's principal directions.
        """
        return self.plant_slope(z)[0]

    def velocity_response(self, z: ArrayLike) -> Complexes:
        """w(z) (...), the velocity estimate per reading [1/s], at complex z (...)."""
        return self.estimator.response(z)[0]

    def plant_slope(self, z: ArrayLike, d: ArrayLike | None = None) -> tuple[Complexes, Complexes]:
        """P(z) [m/N] and dP/dz, (..., r, r), along the principal directions, at z (...); d is z - 1 where that is
        known to more digits than z has."""
        z = np.asarray(z, dtype=complex)
        away = z - 1.0 if d is None else np.asarray(d, dtype=complex)
        held, at = self.sampled_plant, z[..., None, None]
        resolvent = away[..., None, None] * np.eye(len(held.step)) - held.step
        try:
            inner = np.linalg.solve(resolvent, held.new + held.old / at)
        except np.linalg.LinAlgError:  # z is an undamped pole: move it by one rounding error
            return self.plant_slope(z * (1.0 + 1e-15j), away + 1e-15j * z)
        slope = -np.linalg.solve(resolvent, inner + held.old / at**2)
        F, dF = self.force_filter.response(z, away)
        gain = (F / z**self.whole_delay)[..., None, None]
        dgain = (dF / z**self.whole_delay)[..., None, None] - self.whole_delay * gain / at
        P, dP = held.reading @ inner, held.reading @ slope
        return gain * P, gain * dP + dgain * P

    def inverse_slope(self, z: Complexes, d: Complexes) -> tuple[Complexes, Complexes]:
        """P^-1 [N/m] and its derivative by z, (..., r, r), at z with d = z - 1, without forming P: near z = 1 the
        1/d^2 of a free motion hides the others in rounding.

        The forces f that give the readings y solve  [d - A, -G; C, 0] [x; f] = [0; y], with A the step, C the
        reading and G = new + old/z of `sampled_plant`; delay and filter F multiply them by z^l/F. The slope
        follows from the same equations, differentiated by z.

        Raises LinAlgError where the readings are not independent.
        """
        held, at, m = self.sampled_plant, z[..., None, None], self.count
        N = len(held.step)
        whole = np.zeros((*z.shape, N + m, N + m), dtype=complex)
        whole[..., :N, :N] = d[..., None, None] * np.eye(N) - held.step
        whole[..., :N, N:] = -(held.new + held.old / at)
        whole[..., N:, :N] = held.reading
        right_side = np.zeros((*z.shape, N + m, m), dtype=complex)
        right_side[..., N:, :] = np.eye(m)
        solution = np.linalg.solve(whole, right_side)
        change = np.zeros_like(right_side)
        change[..., :N, :] = -solution[..., :N, :] - (held.old / at**2) @ solution[..., N:, :]
        slope = np.linalg.solve(whole, change)[..., N:, :]
        F, dF = self.force_filter.response(z, d)
        lead = (z**self.whole_delay / F)[..., None, None]
        dlead = lead * (self.whole_delay / z - dF / F)[..., None, None]
        return lead * solution[..., N:, :], lead * slope + dlead * solution[..., N:, :]

    @cached_property
    def affine(self) -> tuple[Floats, Floats, Floats, Floats]:
        """L = open - input (K position + B velocity): (N, N), (N, m), (m, N), (m, N).

        Where the law has no stiffness along a direction that nothing else holds, it damps a sliding motion and
        does not see how far that went: a root at z = 1 whatever the wall, which is left out as unobserved motions
        are.
        """
        open_, enters, position, velocity = self._whole_affine
        sprung = self.principal.stiffness > 0.0
        if sprung.all():
            return open_, enters, position, velocity
        # motions that L leaves as they are and neither reading shows, in shares of the readings' largest entries
        readings = [rows / np.abs(rows).max(initial=np.finfo(float).tiny) for rows in (position[sprung], velocity)]
        _, size, axes = np.linalg.svd(np.vstack([open_ - np.eye(len(open_)), *readings]))
        return _without_motions((open_, enters, position, velocity), axes[size <= UNSEEN].T)

    @cached_property
    def _whole_affine(self) -> tuple[Floats, Floats, Floats, Floats]:
        """The four matrices of `affine` before what slides unseen is left out."""
        held, w, F = self.sampled_plant, self.estimator, self.force_filter
        m, l = self.count, self.whole_delay
        queue = l + (self.fractional_delay > 0.0)
        sizes = np.cumsum([0, len(held.step), m * queue, m * len(w.A), m * len(F.A)])
        # places of the states: plant x, forces that wait q, velocity estimates e, force filters f
        x, q, e, f = (slice(a, b) for a, b in pairwise(sizes))
        N, one = int(sizes[-1]), np.eye(m)  # kron(.., one): the same filter for each of the m directions
        states = np.eye(N)
        position = held.reading @ states[x]
        velocity = w.direct * position + np.kron(w.output[None], one) @ states[e]
        # the command: `direct` times the wall's force now, plus the filter's states
        past = np.kron(F.output[None], one) @ states[f]
        open_, enters = np.zeros((N, N)), np.zeros((N, m))
        open_[x] = states[x] + held.step @ states[x]
        open_[e] = states[e] + np.kron(w.A, one) @ states[e] + np.kron(w.input[:, None], one) @ position
        open_[f] = states[f] + np.kron(F.A, one) @ states[f]
        enters[f] = np.kron(F.input[:, None], one)
        late = [past, *(states[q][m * k : m * (k + 1)] for k in range(queue))]
        # late[k] is the command k samples old; unless a part of a sample splits the hold there is none of l + 1
        for gain, at in ((held.new, l), (held.old, l + 1)):
            if at < len(late):
                open_[x] += gain @ late[at]  # without delay the wall's force acts at once, too
                enters[x] += gain * F.direct * (at == 0)
        if queue:
            open_[q] = np.vstack(late[:-1])
            enters[q][:m] = F.direct * one
        return open_, enters, position, velocity

    def transition_matrix(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
        """The map Z_{j+1} = L Z_j (thesis eq. 2.38) for walls k, b of any shape (...): (..., N, N).

        N = states that walls move + m (delayed forces + states of estimator and filter). Unobserved motions are
        left out.
        """
        K, B = np.broadcast_arrays(np.asarray(wall_stiffness, float), np.asarray(wall_damping, float))
        open_, enters, position, velocity = self.affine
        along = self.principal
        feedback = K[..., None, None] * (along.stiffness[:, None] * position)
        feedback = feedback + B[..., None, None] * (along.damping[:, None] * velocity)
        return np.asarray(open_ - enters @ feedback)


def _without_motions(
    affine: tuple[Floats, Floats, Floats, Floats], motions: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """A system, the four matrices of `MultiLoop.affine`, without motions (N, d) that stay as they are and that
    nothing reads.

    One state x_p is left out for each motion n, and what it says of it is taken off the others:
    x_i - x_p n_i / n_p. An orthogonal basis of the other motions would mix forces with positions, 1e8 times
    smaller, and no scaling of states could bring back the digits that roots lose by it.
    """
    from scipy.linalg import qr

    open_, enters, position, velocity = affine
    left_out = qr(motions.T, mode="r", pivoting=True)[1][: motions.shape[1]]
    kept = np.setdiff1d(np.arange(len(open_)), left_out)
    along = np.linalg.solve(motions[left_out].T, motions[kept].T).T  # n_i / n_p

    def rows(matrix: Floats) -> Floats:
        return np.asarray(matrix[kept] - along @ matrix[left_out])

    return rows(open_)[:, kept], rows(enters), position[:, kept], velocity[:, kept]


# Share of the sizes of force and reading along the free motions that rounding leaves of 0: with less, a motion
# that no wall moves would count as one that the wall leaves unheld; with more, one that hardly moves would not.
MOVED: Final = 1e-12
# Distance from z = 1 within which an unheld position's root is computed, where a few others are beside it: with
# less, it is mistaken for a vibration; with more, nothing is set aside that was not there, but a wrong count would
# hide a root.
AT_ONE: Final = 1e-5


def unheld_positions(loop: Loop | MultiLoop) -> int:
    """How many roots z = 1 of walls without stiffness belong to positions that nobody holds; 0 with a spring to
    the ground, of the device, its operator, or a local loop, and under load."""
    if isinstance(loop, MultiLoop):
        return _unheld_of_several(loop)
    if "unheld" not in loop.results:
        loop.results["unheld"] = _unheld_of_one(loop)
    return int(loop.results["unheld"])


def set_aside(roots: Complexes, count: int) -> Complexes:
    """Roots (..., N), of which `count`, those nearest to z = 1, are replaced by 0 if they are within AT_ONE of
    it."""
    rest = np.array(roots, dtype=np.complex128)
    for _ in range(count):
        away = np.abs(rest - 1.0)
        at = np.argmin(away, axis=-1)[..., None]
        nearest = np.take_along_axis(rest, at, axis=-1)
        np.put_along_axis(rest, at, np.where(np.abs(nearest - 1.0) < AT_ONE, 0.0, nearest), axis=-1)
    return rest


def _unheld_of_one(loop: Loop) -> int:
    """`unheld_positions` of one direction: those of free motions that its force moves and its sensor reads."""
    plant, local = loop.plant, loop.controller.local_loop
    if plant.is_loaded or (local is not None and local.stiffness):  # these hold the position
        return 0
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0].T
    pushed, read = free @ plant.actuator, free @ plant.sensor
    if not abs(float(pushed @ read)) > MOVED * float(np.linalg.norm(pushed) * np.linalg.norm(read)):
        return 0
    if loop.closed is not None or loop.sections.sampled_form is not None:  # one pole at z = 1 for all
        return 1
    # motions of different damping have a row each, d0 = 0 for the pole at z = 1
    return max(1, int(np.count_nonzero(loop.sections.rows[:, 1] == 0.0)))


def _unheld_of_several(loop: MultiLoop) -> int:
    """`unheld_positions` of several directions: independent free motions that forces move and sensors read."""
    plant = loop.plant
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0]
    pushed, read = plant.actuators @ free, plant.sensors @ free
    size = float(np.linalg.norm(pushed) * np.linalg.norm(read))
    if not size > 0.0:
        return 0
    return int(np.sum(np.linalg.svd(read @ pushed.T, compute_uv=False) > MOVED * size))


# Condition number of the damped modes' eigenvectors above which their residues are only rounding.
DEFECTIVE = 1e7


@dataclass(frozen=True)
class ContinuousPlant:
    """x' = A x + B f,  y = C x: the part of a plant that walls move.

    A (N, N), B (N, m), C (m, N)
    unobserved  names of the motions that were left out
    """

    A: Floats
    B: Floats
    C: Floats
    unobserved: tuple[str, ...]


@dataclass(frozen=True)
class SampledPlant:
    """x_{j+1} = (1 + step) x_j + new u_{j-l} + old u_{j-l-1},  y = C x.

    step  (N, N);  new, old  (N, m);  reading  (m, N)
    """

    step: Floats
    new: Floats
    old: Floats
    reading: Floats


def continuous_plant(plant: MultiPlant, period: float, fraction: float) -> ContinuousPlant:
    """The motions that walls move and encoders read, in states of comparable size.

    period    T [s], for which each force is held
    fraction  f, fractional part of the delay [samples]
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    tolerance = repeat_tolerance(squared)
    for run in clusters(squared, tolerance):  # equal frequencies: onto the axes of their own damping
        local = shapes[:, run].T @ plant.damping @ shapes[:, run]
        shapes[:, run] = shapes[:, run] @ np.linalg.eigh((local + local.T) / 2.0)[1]
    damping = shapes.T @ plant.damping @ shapes
    level = max(float(np.max(np.abs(damping))), np.finfo(float).tiny)  # of which shares are rounding
    damping[np.abs(damping) <= 1e-14 * level] = 0.0
    inputs, outputs = shapes.T @ plant.actuators.T, plant.sensors @ shapes
    # the largest residue that all modes together could have
    total = float(np.linalg.norm(inputs, axis=1).sum() * np.linalg.norm(outputs, axis=0).sum())
    coupled = np.abs(damping - np.diag(np.diag(damping))) > REPEATED * level
    from scipy.sparse.csgraph import connected_components  # imported here: it takes 0.2 s

    # modes that damping couples, through others, too, are one block
    count, block_of = connected_components(coupled, directed=False)
    uncoupled = np.array([int(np.sum(block_of == number)) == 1 for number in block_of], dtype=bool)
    # uncoupled modes by groups of equal poles, whose frequency and damping are those of the first; then the blocks
    parts = [
        _equal_poles(squared[k], damping[k, k], inputs[group], outputs[:, group], (period, fraction), total)
        for group in _groups(squared, np.diag(damping), np.flatnonzero(uncoupled), tolerance, REPEATED * level)
        for k in group[:1]
    ]
    for c in range(count):
        members = np.flatnonzero(block_of == c)
        if len(members) > 1:
            block = damping[np.ix_(members, members)]
            parts.append(_coupled_modes(squared[members], block, inputs[members], outputs[:, members], period))
    from scipy.linalg import block_diag

    A = block_diag(*(part.A for part in parts))
    return ContinuousPlant(
        A.reshape(-1, sum(len(part.A) for part in parts)),
        np.vstack([part.B for part in parts]),
        np.hstack([part.C for part in parts]),
        tuple(name for part in parts for name in part.unobserved),
    )


def _groups(
    squared: Floats, drag: Floats, members: Ints, tolerance: Floats, drag_tolerance: float
) -> list[list[int]]:
    """Modes, `members` of all n, in groups of equal frequency squared (n,) and damping `drag` (n,), within
    tolerances (n,) [1/s²] and [1/s]; each group by the modes' numbers."""
    groups: list[list[int]] = []
    for k in members.tolist():
        for group in groups:
            g = group[0]
            if abs(squared[k] - squared[g]) <= tolerance[k] and abs(drag[k] - drag[g]) <= drag_tolerance:
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _mode_states(
    squared: Floats, damping: Floats, inputs: Floats, outputs: Floats, period: float
) -> ContinuousPlant:
    """Second-order modes as states [x; v / rate], 2 k of k modes: a slow mode's pair stays well apart from z = 1.

    squared, damping  (k,) [1/s²], (k, k) [1/s];   inputs, outputs  (k, m), (m, k)
    """
    k = len(squared)
    rate = np.maximum(np.sqrt(np.abs(squared)), np.abs(np.diag(damping)))
    rate[rate == 0.0] = 1.0 / period  # a free mass has no rate of its own
    A = np.block(
        [[np.zeros((k, k)), np.diag(rate)], [-np.diag(squared / rate), -damping * (rate / rate[:, None])]]
    )
    B = np.vstack([np.zeros_like(inputs), inputs / rate[:, None]])
    return ContinuousPlant(A, B, np.hstack([outputs, np.zeros_like(outputs)]), ())


def _equal_poles(
    squared: float, drag: float, inputs: Floats, outputs: Floats, sampling: tuple[float, float], total: float
) -> ContinuousPlant:
    """States of modes with equal poles: as many modes as the rank of their residue, by its singular values.

    drag             damping of each [1/s], twice its decay
    inputs, outputs  (k, m), (m, k) of the k modes
    sampling         period [s] and fraction of the delay, as of `continuous_plant`
    total            size of a residue against which one that is rounding is told
    """
    period, decay = sampling[0], drag / 2.0
    left, strength, right = np.linalg.svd(outputs @ inputs)
    level = total * (UNOBSERVED_UNDAMPED if abs(decay) * period < 1e-9 else UNOBSERVED)  # 1e-9: no damping
    # k modes make at most k singular values; the rest are rounding
    rank = int(np.sum(strength[: len(inputs)] * _reach(squared, drag, *sampling) > level))
    root = np.sqrt(strength[:rank])
    enters, leaves = root[:, None] * right[:rank], left[:, :rank] * root
    states = _mode_states(np.full(rank, squared), drag * np.eye(rank), enters, leaves, period)
    return ContinuousPlant(states.A, states.B, states.C, (motion_name(squared, decay),) * (len(inputs) - rank))


def _reach(squared: float, drag: float, period: float, fraction: float) -> float:
    """Motion of a mode by a force held for a period, in shares of a free mass's; 0 at multiples of the sampling
    rate, which a hold does not reach."""
    one = np.ones((1, 1))
    mode = _mode_states(np.array([squared]), np.array([[drag]]), one, one, period)
    held = sample_plant(mode, period, fraction, 0.0)
    # x over T^2, and v over T, which is A[0, 1] times the second state
    size = np.array([[1.0], [period * mode.A[0, 1]]]) / period**2
    return float(max(np.max(np.abs(held.new * size)), np.max(np.abs(held.old * size))))


def _coupled_modes(
    squared: Floats, damping: Floats, inputs: Floats, outputs: Floats, period: float
) -> ContinuousPlant:
    """States of modes that their damping couples; modes that no wall moves, or no encoder reads, are split off by
    their eigenvectors, unless these are ill conditioned. Arguments as of `_mode_states`."""
    whole = _mode_states(squared, damping, inputs, outputs, period)
    poles, right = np.linalg.eig(whole.A)
    if np.linalg.cond(right) > DEFECTIVE:
        return whole
    source = np.linalg.solve(right, whole.B.astype(complex))
    readings = whole.C @ right
    # size of (exp(s T) - 1)/s, by which a force held for T moves a pole's state; T where s is 0
    reach = np.abs(np.expm1(poles * period) / np.where(poles == 0.0, 1.0, poles)) + period * (poles == 0.0)
    strength = np.linalg.norm(source, axis=1) * np.linalg.norm(readings, axis=0) * reach
    keep = strength > UNOBSERVED * float(np.sum(strength))
    if keep.all():
        return whole
    names = [pole_name(poles[k]) for k in np.flatnonzero(~keep & (poles.imag >= 0.0))]
    chosen = np.flatnonzero(keep & (poles.imag >= 0.0))
    # real and imaginary parts of the chosen eigenvectors span the part that remains
    basis = np.hstack([np.column_stack([right[:, k].real, right[:, k].imag]) for k in chosen])
    basis = basis[:, np.linalg.norm(basis, axis=0) > 0.0]
    dual = np.linalg.inv(right)
    # with a conjugate pair's vectors p +- i q and dual rows a +- i b, 2 a and -2 b are dual to p and q; a real
    # pole has one row, without the factor
    rows = np.vstack([np.vstack([2.0 * dual[k].real, -2.0 * dual[k].imag]) for k in chosen])
    real = np.concatenate([[poles[k].imag == 0.0] * 2 for k in chosen])
    rows = np.where(real[:, None], rows / 2.0, rows)[~(real & (np.arange(len(rows)) % 2 == 1))]
    return ContinuousPlant(rows @ whole.A @ basis, rows @ whole.B, whole.C @ basis, tuple(names))


def sample_plant(motion: ContinuousPlant, period: float, fraction: float, lag: float) -> SampledPlant:
    """Sample a motion: forces held for a period T [s], a fractional delay f [samples], an actuator lag tau [s]."""
    A, B, C = motion.A, motion.B, motion.C
    N, m = B.shape
    if lag > 0.0:
        A = np.block([[A, B], [np.zeros((m, N)), -np.eye(m) / lag]])
        B = np.vstack([np.zeros((N, m)), np.eye(m) / lag])
        C = np.hstack([C, np.zeros((m, m))])
    # Gamma(T), then exp(A (1 - f) T) and Gamma((1 - f) T), and Gamma(f T)
    _, whole = _integrals(A, period)
    late, new = _integrals(A, (1.0 - fraction) * period)
    _, early = _integrals(A, fraction * period)
    return SampledPlant(A @ whole, new @ B, late @ early @ B, C)


def _integrals(A: Floats, time: float) -> tuple[Floats, Floats]:
    """exp(A t) and its integral over [0, t], both (N, N), of one exponential."""
    N = len(A)
    whole = np.zeros((2 * N, 2 * N))
    whole[:N, :N], whole[:N, N:] = A * time, np.eye(N)
    from scipy.linalg import expm

    exponential = expm(whole)
    return exponential[:N, :N], exponential[:N, N:] * time
