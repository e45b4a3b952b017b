"""The linear loop that a vibration sees: each nonlinearity a gain or a damper of its own amplitude.

How large the vibration is at each of them follows from the shape of the motion, and the shape from the gains: both
are iterated until they agree. Everything else is exact: hold, delay, lag, filters and estimator as in `loop`, but
with the plant's own coordinates as states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.engine_inputs import LinearDynamics, dynamics
from zwidth.contact.vibration_kernel import (
    AMPLITUDE,
    FORCE,
    VELOCITIES,
    LoopArrays,
    fastest_vibration,
    plant_steps,
    transition,
    vibrations,
)
from zwidth.loop.controller import check_no_feedback, check_no_load
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import force_filter
from zwidth.loop.realisation import FilterStates, filter_states
from zwidth.model.plant import Counter, Nonlinear

SAME = 1e-11  # relative change of all sizes at which the shape agrees with the gains


@dataclass(frozen=True)
class Vibration:
    """A vibration whose shape agrees with the gains that it makes.

    root         z of the equivalent loop; it grows where |z| > 1
    amplitude    of the sensor's motion, before any rounding [m]
    force        amplitude of the commanded force before saturation [N]
    velocities   (f,)  at the frictions: sqrt 2 times the root mean square, over all times [m/s]
    readings     (c,)  at the counters [m or rad]
    deflections  (s,)  at the bent springs [m]
    """

    root: complex
    amplitude: float
    force: float
    velocities: Floats
    readings: Floats
    deflections: Floats


SizeFunction = Callable[[Vibration], float]


def amplitude_of(swing: Vibration) -> float:
    """Size of a vibration by its amplitude at the sensor [m]."""
    return swing.amplitude


def friction_velocity_of(swing: Vibration) -> float:
    """Size of a vibration by the length of the vector of its velocities at the frictions [m/s]."""
    return float(np.linalg.norm(swing.velocities))


@dataclass(frozen=True)
class EquivalentLoop:
    """A loop with a wall, in the form in which its vibrations of any amplitude are computed.

    parts   what of the plant depends on the amplitude;   limit  largest force [N]
    offset  middle of the vibration, as a share of each counter's step
    filter, estimator  of the force and of the velocity, as state-space forms
    """

    loop: Loop
    wall_stiffness: float
    wall_damping: float
    parts: Nonlinear
    limit: float
    offset: float
    dynamics: LinearDynamics
    filter: FilterStates
    estimator: FilterStates

    def fastest_vibration(
        self, size: float, start: Vibration, measure: SizeFunction = amplitude_of, same: float = SAME
    ) -> Vibration | None:
        """The fastest growing vibration of this size, near a start; None where nothing swings.

        measure  quantity whose size is given: amplitude at the sensor [m], or velocity at the frictions [m/s]
        same     relative change at which shape and gains agree
        """
        by_velocity = measure is friction_velocity_of
        known, root, sizes = fastest_vibration(self._arrays, start.root, _sizes(start), size, by_velocity, same)
        return self._swing(root, sizes) if known else None

    def seed(self, amplitude: float, angle: float) -> Vibration:
        """A vibration at an angle per sample [rad], all moving like the sensor, to start an iteration from."""
        w, parts = angle / self.loop.period, self.parts  # w: angular frequency [rad/s]
        return Vibration(
            complex(np.exp(1j * angle)),
            amplitude,
            amplitude * (abs(self.wall_stiffness) + abs(self.wall_damping) * w),
            np.full(len(parts.friction), amplitude * w),
            np.full(len(parts.counters), amplitude),
            np.full(len(parts.springs), amplitude),
        )

    def first_guess(self, amplitude: float) -> Vibration:
        """The fastest growing vibration of the linear loop, of this amplitude [m]; a seed where nothing swings."""
        guess = self.seed(amplitude, 0.2 * np.pi)
        roots, sizes = vibrations(self._arrays, self._linear_sizes, amplitude, False)
        swings = [self._swing(*root_and_size) for root_and_size in zip(roots, sizes, strict=True)]
        return max(swings, key=lambda other: abs(other.root), default=guess)

    @property
    def _linear_sizes(self) -> Floats:
        """Sizes (see `_sizes`) at which each part acts as in the linear loop: no friction, steps or limit."""
        parts = self.parts
        # velocities and readings without bound, force and deflections 0
        sizes = np.zeros(VELOCITIES + len(parts.friction) + len(parts.counters) + len(parts.springs))
        sizes[VELOCITIES : len(sizes) - len(parts.springs)] = np.inf
        return sizes

    def _swing(self, root: complex, sizes: Floats) -> Vibration:
        """A vibration from its root and row of sizes (see `_sizes`)."""
        f, c = len(self.parts.friction), len(self.parts.counters)
        velocities, readings, deflections = np.split(sizes[VELOCITIES:], [f, f + c])
        return Vibration(
            complex(root), float(sizes[AMPLITUDE]), float(sizes[FORCE]), velocities, readings, deflections
        )

    def open_at_limit(self) -> tuple[Floats, Floats, Floats]:
        """The linear loop cut at the limit of its force: transition (M, M) without the force, what a force of 1 N
        adds (M,), and the commanded force, (M,)."""
        steps = plant_steps(self._arrays, self._linear_sizes)
        closed, _, command = transition(self._arrays, self._linear_sizes, 1.0, *steps)
        cut, _, _ = transition(self._arrays, self._linear_sizes, 0.0, *steps)
        # closed = cut + added command^T, of which `added` is what 1 N adds
        return cut, (closed - cut) @ command / (command @ command), command

    @cached_property
    def _arrays(self) -> LoopArrays:
        """The loop and the wall as the compiled part takes them."""
        T, n, linear, parts = self.loop.period, self.dynamics.size, self.dynamics, self.parts
        scale = _scales(linear.generator, n, T)
        groups = (parts.friction, parts.counters, parts.springs)
        inputs = linear.inputs * scale[:, None] * T
        friction_motions, counter_motions, spring_motions = (
            np.array([part.along for part in group], dtype=float).reshape(-1, n) for group in groups
        )
        return LoopArrays(
            generator=linear.generator * scale[:, None] / scale * T,
            drive=inputs[:, 0].copy(),
            coordinates=n,
            period=T,
            fractional_delay=float(self.loop.fractional_delay),
            whole_delay=int(self.loop.whole_delay),
            stiffness=float(self.wall_stiffness),
            damping=float(self.wall_damping),
            limit=float(self.limit),
            sensor=np.array(self.loop.plant.sensor, dtype=float),
            force_inputs=inputs[:, 1:].copy(),
            friction_motions=friction_motions,
            coulomb=np.array([part.coulomb for part in parts.friction], dtype=float),
            spring_motions=spring_motions,
            cubic=np.array([part.cubic for part in parts.springs], dtype=float),
            excess=np.array([part.backward_excess for part in parts.springs], dtype=float),
            kink=np.array([part.kink for part in parts.springs], dtype=float),
            counter_motions=counter_motions,
            weight=np.array([part.weight for part in parts.counters], dtype=float),
            step=np.array([part.step for part in parts.counters], dtype=float),
            offset=float(self.offset),
            filter_A=np.array(self.filter.A, dtype=float),
            filter_input=np.array(self.filter.input, dtype=float),
            filter_output=np.array(self.filter.output, dtype=float),
            filter_direct=float(self.filter.direct),
            estimator_A=np.array(self.estimator.A, dtype=float),
            estimator_input=np.array(self.estimator.input, dtype=float),
            estimator_output=np.array(self.estimator.output, dtype=float),
            estimator_direct=float(self.estimator.direct),
        )


def _scales(generator: Floats, n: int, period: float) -> Floats:
    """Factors (N,) by which states are scaled: velocities to metres per sample, lagged dampers' forces such that
    both couplings are of one size, so that an exponential keeps its digits.

    generator  (N, N)  of n positions, n velocities and other states
    """
    scale = np.ones(len(generator))
    scale[n : 2 * n] = period
    for k in range(2 * n, len(generator)):
        out, back = np.max(np.abs(generator[n : 2 * n, k])), np.max(np.abs(generator[k, n : 2 * n]))
        scale[k] = period * np.sqrt(out / back) if out > 0.0 and back > 0.0 else 1.0
    return scale


def _sizes(swing: Vibration) -> Floats:
    """A vibration's sizes in one row, as `contact.vibration_kernel` takes them."""
    return np.concatenate([[swing.amplitude, swing.force], swing.velocities, swing.readings, swing.deflections])


def equivalent_loop(
    loop: Loop,
    wall_stiffness: float,
    wall_damping: float,
    parts: Nonlinear,
    *,
    force_limit: float = np.inf,
    offset: float = 0.0,
) -> EquivalentLoop:
    """The loop with its nonlinear parts, whose counters make up the sensor (none: read as finely as you like).

    Left out are noise, brakes, frictions of level 0, and counters if none of them has steps.

    wall_stiffness, wall_damping  of the wall [N/m], [N s/m]
    force_limit  the smallest limit on the force [N];  offset  see `EquivalentLoop`
    Raises       FeedbackError  (loop.unsupported_feedback) for a computer with feedback beside the wall law, and
                                for a load
    """
    check_no_feedback(loop.controller, "limit cycles are not predicted", "simulate, or leave it out")
    check_no_load(loop.plant, "limit cycles are not predicted", "simulate, or leave the load out")
    counters = parts.counters
    if any(part.step > 0.0 for part in counters):
        # without noise
        counters = tuple(Counter(part.along, part.step, part.weight) for part in counters)
    else:
        counters = ()
    friction = tuple(part for part in parts.friction if part.coulomb > 0.0)
    parts = replace(parts, friction=friction, counters=counters, brakes=(), force_limit=force_limit)
    motions = [part.along for part in friction] + [spring.along for spring in parts.springs]
    along = np.array(motions, dtype=float).reshape(len(motions), loop.plant.size)
    linear = dynamics(loop.plant, loop.controller.actuator_time_constant, along)
    on_force, estimator = force_filter(loop.controller), loop.estimator
    return EquivalentLoop(
        loop,
        wall_stiffness,
        wall_damping,
        parts,
        force_limit,
        offset,
        linear,
        filter_states(on_force.numerator, on_force.denominator, np.ones(1)),
        filter_states(estimator.numerator, estimator.denominator, estimator.window),
    )
