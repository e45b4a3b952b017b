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
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth import _verbs
from zwidth.arrays import Complexes, Floats
from zwidth.loop.controller import Controller
from zwidth.loop.filters import force_filter, velocity_estimator
from zwidth.loop.loop import Loop
from zwidth.loop.motion_names import motion_name
from zwidth.loop.multi_hold import ContinuousPlant, SampledPlant, continuous_plant, sample_plant
from zwidth.loop.point_text import SeveralDirectionsError
from zwidth.loop.realisation import FilterStates, filter_states
from zwidth.loop.sections import UnmovedError
from zwidth.loop.wall_matrices import PrincipalDirections, WallMatrices
from zwidth.model.argument_checks import require
from zwidth.model.modes import undamped_modes
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
        require("plant", self.plant, MultiPlant, hint)
        require("controller", self.controller, Controller)
        if self.controller.fixed_feedback:
            raise SeveralDirectionsError(self.controller.feedback_names)
        if self.matrices is not None:
            require(
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
        """P(z) and dP/dz, (..., m, m); d is z - 1 where that is known to more digits than z has."""
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
        """P^-1 and its derivative, (..., m, m), without forming P: near z = 1 the 1/d^2 of a free motion
        hides the others in rounding.

        The forces f that give the readings y solve  [d - A, -G; C, 0] [x; f] = [0; y].
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
        readings = [rows / np.abs(rows).max(initial=np.finfo(float).tiny) for rows in (position[sprung], velocity)]
        _, size, axes = np.linalg.svd(np.vstack([open_ - np.eye(len(open_)), *readings]))
        return _without_motions((open_, enters, position, velocity), axes[size <= UNSEEN].T)

    @cached_property
    def _whole_affine(self) -> tuple[Floats, Floats, Floats, Floats]:
        """`affine` with what slides unseen."""
        held, w, F = self.sampled_plant, self.estimator, self.force_filter
        m, l = self.count, self.whole_delay
        queue = l + (self.fractional_delay > 0.0)
        sizes = np.cumsum([0, len(held.step), m * queue, m * len(w.A), m * len(F.A)])
        x, q, e, f = (slice(a, b) for a, b in pairwise(sizes))
        N, one = int(sizes[-1]), np.eye(m)
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
        for gain, at in ((held.new, l), (held.old, l + 1)):
            if at < len(late):
                open_[x] += gain @ late[at]
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
    """A system without motions (N, d) that stay as they are and that nothing reads.

    One state each is left out, and what it says of its motion is taken off the others: x_i - x_p n_i / n_p. An
    orthogonal basis of the other motions would mix forces with positions, 1e8 times smaller, and no scaling of
    states could bring back the digits that roots lose by it.
    """
    from scipy.linalg import qr

    open_, enters, position, velocity = affine
    left_out = qr(motions.T, mode="r", pivoting=True)[1][: motions.shape[1]]
    kept = np.setdiff1d(np.arange(len(open_)), left_out)
    along = np.linalg.solve(motions[left_out].T, motions[kept].T).T

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
    the ground, of the device, its operator, or a local loop."""
    if isinstance(loop, MultiLoop):
        return _directions_unheld(loop)
    if "unheld" not in loop.results:
        loop.results["unheld"] = _unheld(loop)
    return int(loop.results["unheld"])


def set_aside(roots: Complexes, count: int) -> Complexes:
    """Roots (..., N), of which so many, those nearest to z = 1, are replaced by 0."""
    rest = np.array(roots, dtype=np.complex128)
    for _ in range(count):
        away = np.abs(rest - 1.0)
        at = np.argmin(away, axis=-1)[..., None]
        own = np.take_along_axis(rest, at, axis=-1)
        np.put_along_axis(rest, at, np.where(np.abs(own - 1.0) < AT_ONE, 0.0, own), axis=-1)
    return rest


def _unheld(loop: Loop) -> int:
    plant, local = loop.plant, loop.controller.local_loop
    if plant.is_loaded or (local is not None and local.stiffness):
        return 0
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0].T
    pushed, read = free @ plant.actuator, free @ plant.sensor
    if not abs(float(pushed @ read)) > MOVED * float(np.linalg.norm(pushed) * np.linalg.norm(read)):
        return 0
    if loop.closed is not None or loop.sections.sampled_form is not None:
        return 1
    # motions of different damping have a row each
    return max(1, int(np.count_nonzero(loop.sections.rows[:, 1] == 0.0)))


def _directions_unheld(loop: MultiLoop) -> int:
    plant = loop.plant
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0]
    pushed, read = plant.actuators @ free, plant.sensors @ free
    size = float(np.linalg.norm(pushed) * np.linalg.norm(read))
    if not size > 0.0:
        return 0
    return int(np.sum(np.linalg.svd(read @ pushed.T, compute_uv=False) > MOVED * size))
