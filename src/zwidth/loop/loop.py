"""The sampled loop of a plant and a wall:  1 + P(z) (K + B w(z)) = 0.

A feedforward's inertia given as a share of the device's rigid mass, at a posture and along a direction.

Motions that grow by themselves and that no wall reaches: a chart leaves them out, a device does not.

Motions that no wall moves without load: how fast they grow or decay under one.

A free device slides along a wall as it likes, neither pushed nor held: its roots stay at z = 1. Under load it is
pushed: by the hand's force, whose lever arms change, and by the computer's, which turns with the counts a little
late. With rigid drives the two cancel but for that delay, and one root of each motion moves by the order of
(1/2 + delay)(w T)^2 from 1, w^2 being the load's stiffness over the mass. With flexible drives a static stiffness
stays, of the order of the load's square over theirs, and a growth rate of the order of the load.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite, log, pi
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth import _verbs
from zwidth.arrays import Complexes, Floats
from zwidth.errors import OperatingPointError
from zwidth.loop.closed_plant import ClosedSections, close_plant, closed_sections, closed_table
from zwidth.loop.controller import Controller, NotKnown
from zwidth.loop.estimator import Estimator
from zwidth.loop.factor_response import factor_response, rows_response, window_response
from zwidth.loop.hold import denominator
from zwidth.loop.linear_omissions import with_computer
from zwidth.loop.loop_table import NO_FILTER, Filter, LoopTable, force_path, loop_table, velocity_estimator
from zwidth.loop.motion_names import motion_name
from zwidth.loop.realisation import StateSpace, realise
from zwidth.loop.sections import Sections, plant_rows, sampled_sections
from zwidth.model.argument_checks import check_kind
from zwidth.model.first_order_form import first_order_form
from zwidth.model.modes import real_modes, undamped_modes
from zwidth.model.plant import Nonlinear, Plant
from zwidth.result import Documented, documented, entry, finite

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart
    from zwidth.chart.verdict import Verdicts


# What to write instead, by the type given as a plant.
_HINTS = {
    "Device": "write device.at().loop",
    "MultiPlant": "write MultiLoop(plant, controller) for several directions",
}


@dataclass(frozen=True, init=False, repr=False)
class Loop:
    """A plant under a sampled wall law. What a chart needs of it is computed once, at first use.

    >>> Loop(Plant.one_mass(0.3), sampling_period=0.001).transition_matrix(1000.0, 1.0).shape
    (3, 3)
    """

    plant: Plant
    controller: Controller
    results: dict[str, Any] = field(init=False, compare=False)  # what several questions share, once it is computed

    def __init__(
        self,
        plant: Plant,
        controller: Controller | None = None,
        *,
        sampling_period: float | None = None,
        delay: float = 0.0,
    ) -> None:
        """Close the loop of a plant with a controller, or with a plain one of this period and delay.

        sampling_period  T [s];   delay  from reading to force [samples], any real >= 0
        Raises  TypeError   for anything but a plant and a controller, or for neither a controller nor a period
                ValueError  for a plant that holds nan, a controller beside a period or delay, numbers out of
                            range, a period that is not known, an inertia that is given as a share
        """
        check_kind("plant", plant, Plant, _HINTS.get(type(plant).__name__, ""))
        if controller is None:
            if sampling_period is None:
                raise TypeError("Loop needs a controller or a sampling period; write sampling_period=0.001")
            controller = Controller(sampling_period, delay)
        elif sampling_period is not None or delay:
            raise ValueError(
                "the controller has its own sampling period and delay; leave out sampling_period and delay, or "
                "write Controller(sampling_period, delay)"
            )
        check_kind("controller", controller, Controller)
        if has_inertia_share(controller):
            raise ValueError(
                "feedforward.inertia_share is a share of a device's mass, which a loop does not know; write "
                "device.at().loop, or give Feedforward(inertia=...)"
            )
        plant.check_numbers()
        if isinstance(controller.sampling_period, NotKnown):
            raise ValueError("controller.sampling_period is not known; a loop needs it")
        object.__setattr__(self, "plant", plant)
        object.__setattr__(self, "controller", controller)
        object.__setattr__(self, "results", {})

    def __repr__(self) -> str:
        """The plant's coordinates, sampling, delay and feedback in words."""
        names = ", ".join(self.plant.names) or f"{self.plant.size} coordinates"
        computer = self.controller.timing_text
        computer += "".join(f", with {part}" for part in self.controller.feedback_names)
        computer += ", under load" if self.plant.is_loaded else ""
        return f"Loop of a plant ({names}), {computer}"

    def chart(self, radius: float = 1.0, *, decay: bool = True) -> StabilityChart:
        """The stable walls, exactly; see `stability_chart`."""
        return _verbs.loop_chart(self, radius, decay)

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast, by eigenvalues; see `judge`."""
        return _verbs.loop_check(self, wall_stiffness, wall_damping)

    @property
    def period(self) -> float:
        """Sampling period T [s]."""
        return self.controller.sampling_period

    @property
    def has_fixed_feedback(self) -> bool:
        """Whether the computer adds feedback to the wall law (`Controller.fixed_feedback`), or a load does."""
        return bool(self.controller.fixed_feedback) or self.plant.is_loaded

    @property
    def whole_delay(self) -> int:
        """Whole samples l of the delay."""
        return self.controller.whole_delay

    @property
    def fractional_delay(self) -> float:
        """Remaining part f of the delay, 0 <= f < 1 [samples]."""
        return self.controller.fractional_delay

    @property
    def nonlinear(self) -> Nonlinear:
        """The nonlinear parts of plant and computer, except a nonlinear velocity estimate; the force limit is
        the smaller of the actuator's and the computer's."""
        return with_computer(self.plant.nonlinear, self.controller)

    @cached_property
    def closed(self) -> ClosedSections | None:
        """The plant with the fixed feedback closed; None without such feedback."""
        return closed_sections(self.plant, self.controller) if self.has_fixed_feedback else None

    @cached_property
    def sections(self) -> Sections:
        """The plant between samples, one row per observed pair of poles; with fixed feedback closed, one row."""
        if self.closed is not None:
            return self.closed.sections
        lag = self.controller.actuator_time_constant
        return sampled_sections(self.plant, self.period, self.fractional_delay, lag)

    @cached_property
    def table(self) -> LoopTable:
        """The loop in the form in which kernels take it. Raises what `sections.sampled_sections` raises."""
        if self.closed is not None:
            return closed_table(self.closed, self.controller)
        rows = self._rows_of_modes
        if rows is None:
            rows = self.sections.rows
        return loop_table(rows[None], np.array([len(rows)]), self.controller)

    @property
    def has_states_apart(self) -> bool:
        """Whether the states of `transition_matrix` are computed another way than the factors of `table`: where
        dampers couple modes, and with fixed feedback closed."""
        if self.closed is not None:
            return True
        return self._rows_of_modes is None and self.sections.sampled_form is not None

    @cached_property
    def _rows_of_modes(self) -> Floats | None:
        """The plant's rows where its modes stand alone; None where `sections` has them."""
        return plant_rows(self.plant, self.controller)

    @cached_property
    def force_path(self) -> Filter:
        """What stands behind the sections on the force's way: its filter and the actuator's lag in series, or the
        rest of a closed plant."""
        return force_path(self.controller) if self.closed is None else self.closed.factors

    @property
    def path_delay(self) -> tuple[int, bool]:
        """Whole samples of delay behind the sections, and whether a part of one splits their hold."""
        if self.closed is not None:
            return self.closed.delay, False
        return self.whole_delay, self.fractional_delay > 0.0

    @cached_property
    def estimator(self) -> Estimator:
        """The velocity estimate w(z)."""
        return velocity_estimator(self.controller)

    def plant_response(self, z: ArrayLike, z_minus_1: ArrayLike | None = None) -> Complexes:
        """P(z) (...) from force command to reading [m/N], at complex z (...), with hold, delay, filter and lag.

        Fixed feedback is closed.

        z_minus_1  (...)  z - 1, where it is known to more digits than the difference has
        """
        at: Complexes = np.asarray(z, dtype=complex)
        d = at - 1.0 if z_minus_1 is None else np.asarray(z_minus_1, dtype=complex)
        force, (whole, split) = self.force_path, self.path_delay
        passed = factor_response(force.numerator, force.denominator, d) / at**whole
        return np.asarray(rows_response(self.sections.rows, split, at, d) * passed)

    def velocity_response(self, z: ArrayLike, z_minus_1: ArrayLike | None = None) -> Complexes:
        """w(z) (...), velocity estimate per reading [1/s] at complex z (...); z_minus_1: `plant_response`."""
        at: Complexes = np.asarray(z, dtype=complex)
        d = at - 1.0 if z_minus_1 is None else np.asarray(z_minus_1, dtype=complex)
        w = self.estimator
        return np.asarray(factor_response(w.numerator, w.denominator, d) * window_response(w.window, at))

    @cached_property
    def sideways_motions(self) -> tuple[SidewaysMotion, ...]:
        """Under load, the motions that no wall moves without it, fastest-growing first; () where they count."""
        return () if self.plant.apart is None else sideways_motions(self.plant.apart, self.controller)

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, by name; they are cancelled, or stand apart, and do not count for
        stability."""
        apart = () if self.plant.apart is None else held_motions(self.plant.apart)
        return self.sections.unobserved + tuple(motion.name for motion in self.sideways_motions) + apart

    @cached_property
    def state_space(self) -> StateSpace:
        """The loop's states: its transition matrix is linear in K and B, `StateSpace.transition_matrix`."""
        if self.closed is not None:  # its states hold the delays, the filters and the lag already
            return realise(self.sections, 0, False, NO_FILTER, self.estimator)
        return realise(self.sections, *self.path_delay, self.force_path, self.estimator)

    def transition_matrix(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
        """The map Z_{j+1} = L Z_j (thesis eq. 2.38) for walls K, B of any shape (...): (..., N, N).

        N counts plant states, states of filter and lag, delayed forces and states of the velocity estimate.
        Unobserved motions are left out.
        """
        return self.state_space.transition_matrix(np.asarray(wall_stiffness), np.asarray(wall_damping))


def has_inertia_share(controller: Controller) -> bool:
    """Whether the computer's feedforward is known only where the device's rigid mass is."""
    ahead = controller.feedforward
    return ahead is not None and bool(np.any(ahead.inertia_share))


def with_inertia_of(controller: Controller, rigid_mass: float) -> Controller:
    """The computer with the share of a rigid mass [kg] as its inertia; itself where it has no such share.

    Raises  OperatingPointError  for a device that has no rigid mass
    """
    ahead = controller.feedforward
    if ahead is None or not has_inertia_share(controller):
        return controller
    if not isfinite(rigid_mass):
        raise OperatingPointError(
            "feedforward.inertia_share is a share of the device's rigid mass, and it has none here: a spring ties "
            "it to the ground; give feedforward.inertia_kg instead"
        )
    inertia = ahead.inertia_share * rigid_mass
    return replace(controller, feedforward=replace(ahead, inertia=inertia, inertia_share=0.0))


GROWS = 1e-12  # |z|^2 - 1 above which a pole lies outside the unit circle by more than rounding


def unobserved_instability(loop: Loop) -> bool:
    """Whether the plant has an unstable motion that no wall affects, or that the sensor does not read.

    True if the plant has more poles outside the unit circle than are left in the sampled sections, from which
    such motions have been cancelled.
    """
    if not loop.unobserved_modes:
        return False
    if loop.closed is not None:
        # |z|^2 - 1 of motions with these growth rates
        return bool(np.any(np.exp(2.0 * loop.closed.hidden * loop.period) - 1.0 > GROWS))
    observed_poles = _section_poles(loop.sections.rows[:, :2])
    return _unstable_count(_poles(loop.plant, loop.period)) > _unstable_count(observed_poles)


def _poles(plant: Plant, period: float) -> Complexes:
    """All poles of the sampled plant, as z - 1; those of free motions, which do not grow, may be missing."""
    modes = real_modes(plant)
    if modes is None:
        form = first_order_form(plant, period)
        return np.expm1(np.concatenate([form.poles, form.hidden_poles]) * period)
    pairs = zip(modes.decay.tolist(), modes.frequency_squared.tolist(), strict=True)
    return _section_poles(np.array([denominator(decay, squared, period) for decay, squared in pairs]))


def _section_poles(denominators: Floats) -> Complexes:
    """Roots (2 m,) e of e^2 + d1 e + d0 for each of m rows d1, d0."""
    roots = [np.roots([1.0, *row]) for row in denominators]
    return np.concatenate([np.zeros(0, dtype=complex), *roots])


def _unstable_count(e: Complexes) -> int:
    """Number of poles z = 1 + e outside the unit circle, by |z|^2 - 1 = 2 Re e + |e|^2."""
    return int(np.sum(2.0 * e.real + np.abs(e) ** 2 > GROWS))


NEUTRAL: Final = 1e-12  # |z| - 1 that is rounding


@dataclass(frozen=True)
class SidewaysMotion(Documented):
    """A motion along the wall's surface, which no wall moves without load, as it is under load.

    growth_rate  [1/s], negative where it decays, 0 where it does neither;   frequency [Hz], 0 without vibration
    """

    growth_rate: float = field(metadata=entry("1/s"))
    frequency: float = field(metadata=entry("Hz"))

    @property
    @documented("s", value=finite, before="frequency")
    def time_to_double(self) -> float:
        """Time in which the motion grows to twice its size [s]; inf of one that does not grow."""
        return log(2.0) / self.growth_rate if self.growth_rate > 0.0 else np.inf

    @property
    def name(self) -> str:
        """The motion in words."""
        kind = f"sideways vibration at {self.frequency:.4g} Hz" if self.frequency else "sideways motion"
        if self.growth_rate > 0.0:
            return f"{kind} that grows by {self.growth_rate:.4g} 1/s (doubles in {self.time_to_double:.4g} s)"
        return f"{kind} that decays by {-self.growth_rate:.4g} 1/s" if self.growth_rate else f"{kind} (neutral)"


def sideways_motions(plant: Plant, controller: Controller) -> tuple[SidewaysMotion, ...]:
    """The motions that stand apart under a computer that renders no wall, fastest-growing first: as many as are
    free without load, and all that grow.

    plant  the motions that stand apart, with what they are without load. A coordinate has one motion, or two where
           its roots are real; of all of them as many count as there are coordinates, the fastest-growing ones
    """
    form, states = close_plant(plant, controller.wall_alone)
    d = np.linalg.eigvals(form.growth)
    d[np.argsort(np.abs(d))[: states.neutral]] = 0.0  # several at once, rounding makes a slow vibration of them
    # |1 + d|^2 - 1 without cancellation
    excess = 2.0 * d.real + np.abs(d) ** 2
    order = np.argsort(-excess)[: 2 * plant.size]  # two roots of each coordinate; the others are of commands
    # ln |1 + d| / T; a root at z = 0 exactly would have no logarithm
    rates = 0.5 * np.log1p(np.maximum(excess[order], np.nextafter(-1.0, 0.0))) / controller.sampling_period
    rates[np.abs(excess[order]) < NEUTRAL] = 0.0
    frequencies = np.abs(np.angle(1.0 + d[order])) / (2.0 * pi * controller.sampling_period)
    vibrates = np.abs(d[order].imag) > 0.0
    motions, pair = [], False
    for rate, frequency, complex_root in zip(rates.tolist(), frequencies.tolist(), vibrates.tolist(), strict=True):
        pair = complex_root and not pair  # the first of two conjugates, which stand for one motion
        if not complex_root or pair:
            motions.append(SidewaysMotion(rate, frequency if complex_root else 0.0))
    free = 0 if plant.without_load is None else len(_free_and_held(plant.without_load)[0])
    return tuple(motion for i, motion in enumerate(motions[: plant.size]) if i < free or motion.growth_rate > 0.0)


def held_motions(plant: Plant) -> tuple[str, ...]:
    """Names of the motions that stand apart and are held by springs, as they are without load."""
    if plant.without_load is None:
        return ()
    squared, decay = _free_and_held(plant.without_load)[1:]
    return tuple(motion_name(float(w2), float(a)) for w2, a in zip(squared, decay, strict=True))


def _free_and_held(plant: Plant) -> tuple[Floats, Floats, Floats]:
    """Squared frequencies (all 0) of the free motions of a plant; squared frequencies of the motions that springs
    hold [1/s²], and their decay [1/s], dampers that couple them left out."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    decay = 0.5 * np.einsum("ik,ij,jk->k", shapes, plant.damping, shapes)
    free = squared == 0.0
    return squared[free], squared[~free], decay[~free]
