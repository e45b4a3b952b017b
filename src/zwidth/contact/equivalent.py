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
from numpy.typing import NDArray

from zwidth.contact.describing import bent_spring, coulomb_damper, quantiser, saturation
from zwidth.contact.stepping import Dynamics, dynamics
from zwidth.loop.filters import force_filter
from zwidth.loop.loop import Loop
from zwidth.loop.series import Series, series
from zwidth.model.nonlinear import Counter, Nonlinear

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# A root whose angle is below this does not swing: it creeps, or is a rounded double root at z = 1.
CREEPS = 1e-5
UNREAD = 1e-7  # share of a motion below which the sensor does not read it
ITERATIONS = 200
SAME = 1e-11  # relative change of all amplitudes at which the shape agrees with the gains
PARTS = 4  # of a sampling interval, over which the mean square of a velocity is taken (Simpson's rule)


@dataclass(frozen=True)
class Swing:
    """A vibration whose shape agrees with the gains that it makes.

    root         z of the equivalent loop; it grows where |z| > 1
    amplitude    of the sensor's motion, before any rounding [m]
    force        amplitude of the force that is asked for, before saturation [N]
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


Measure = Callable[[Swing], float]


def amplitude_of(swing: Swing) -> float:
    """Size by the amplitude at the sensor."""
    return swing.amplitude


def velocity_of(swing: Swing) -> float:
    """Size by the velocities at the frictions."""
    return float(np.linalg.norm(swing.velocities))


@dataclass(frozen=True)
class EquivalentLoop:
    """A loop and a wall, ready to be asked about any amplitude.

    offset  middle of the vibration, as a share of each counter's step
    """

    loop: Loop
    wall_stiffness: float
    wall_damping: float
    parts: Nonlinear
    limit: float
    offset: float
    own: Dynamics
    filter: Series
    estimator: Series

    def swing(
        self, size: float, start: Swing, measure: Measure = amplitude_of, same: float = SAME
    ) -> Swing | None:
        """The fastest growing vibration of this size, near a start; None where nothing swings.

        measure  what is meant by size: amplitude at the sensor [m], or velocity at the frictions [m/s]
        same     relative change at which shape and gains agree
        """
        found = self._settled(size, start, measure, same)
        for _ in range(4):
            if found is None:
                break
            swings = self._swings(found, measure, size)
            best = max(swings, key=lambda other: abs(other.root), default=found)
            if abs(best.root) <= abs(found.root) + 1e-6:
                break
            better = self._settled(size, best, measure, same)
            if better is None or abs(better.root) <= abs(found.root):
                break
            found = better
        return found

    def seed(self, amplitude: float, angle: float) -> Swing:
        """A vibration at some angle per sample, as if all moved like the sensor: something to start from."""
        w, parts = angle / self.loop.period, self.parts
        return Swing(
            complex(np.exp(1j * angle)),
            amplitude,
            amplitude * (abs(self.wall_stiffness) + abs(self.wall_damping) * w),
            np.full(len(parts.friction), amplitude * w),
            np.full(len(parts.counters), amplitude),
            np.full(len(parts.springs), amplitude),
        )

    def first_guess(self, amplitude: float) -> Swing:
        """A vibration of the linear loop to start from."""
        none, parts = np.zeros(0), self.parts
        linear = replace(self, parts=replace(parts, friction=(), counters=(), springs=()), limit=np.inf)
        guess = self.seed(amplitude, 0.2 * np.pi)
        start = replace(guess, velocities=none, readings=none, deflections=none)
        swings = linear._swings(start, amplitude_of, amplitude, parts)
        return max(swings, key=lambda other: abs(other.root), default=guess)

    def _settled(self, size: float, start: Swing, measure: Measure, same: float) -> Swing | None:
        """Shape and gains in agreement, following the root nearest to the start's."""
        now = _scaled(start, size / measure(start))
        weight, before = 1.0, np.inf
        for _ in range(ITERATIONS):
            swings = self._swings(now, measure, size)
            if not swings:
                return None
            after = min(swings, key=lambda other: abs(other.root - now.root))
            change = _difference(after, now)
            if change < same:
                return after
            if change > 0.7 * before:
                weight = max(0.6 * weight, 0.05)
            before = change
            now = _between(now, after, weight)
        return now if before < 1e-6 else None

    def _swings(self, at: Swing, measure: Measure, size: float, measured: Nonlinear | None = None) -> list[Swing]:
        """All vibrations of this size of the linear loop whose gains are those of a swing.

        measured  parts at which their amplitudes are taken; None: those that act
        """
        L, rows = self._matrix(at)
        roots, vectors = np.linalg.eig(L.transition)
        n, sensor = self.own.size, self.loop.plant.sensor
        found = []
        for k in np.flatnonzero((np.angle(roots) > CREEPS) & (np.abs(roots) > 1e-6)):
            state = vectors[:, k]
            reading = complex(sensor @ state[:n])
            whole = float(np.max(np.abs(sensor))) * float(np.max(np.abs(state[: 2 * n])))
            if abs(reading) > UNREAD * whole:
                swing = self._measured(complex(roots[k]), state / reading, L, rows, measured or self.parts)
                found.append(_scaled(swing, size / measure(swing)))
        return found

    def _measured(self, root: complex, state: Complexes, L: _Step, command: Floats, parts: Nonlinear) -> Swing:
        """Amplitudes at each part of a vibration with these states, 1 m at the sensor."""
        n, T = self.own.size, self.loop.period
        speeds = L.inside @ state  # (t, n), in metres per sample
        along = np.array([part.along for part in parts.friction], dtype=float).reshape(-1, n)
        mean = L.weights @ np.abs(speeds @ along.T) ** 2
        return Swing(
            root,
            1.0,
            float(abs(command @ state)),
            np.sqrt(mean) / T,
            np.array([abs(part.along @ state[:n]) for part in parts.counters]),
            np.array([abs(part.along @ state[:n]) for part in parts.springs]),
        )

    def opened(self) -> tuple[Floats, Floats, Floats]:
        """The linear loop cut at the limit of its force: transition (M, M) without the force, what a force of 1 N
        adds (M,), and the force that is asked for, (M,)."""
        none = np.zeros(0)
        linear = replace(self, parts=replace(self.parts, friction=(), counters=(), springs=()))
        at = Swing(1.0 + 0.0j, 1.0, 1.0, none, none, none)
        (closed, command), (cut, _) = (linear._matrix(at, passes) for passes in (1.0, 0.0))
        added = closed.transition - cut.transition
        return cut.transition, added @ command / (command @ command), command

    def _matrix(self, at: Swing, passes: float | None = None) -> tuple[_Step, Floats]:
        """Transition matrix of the equivalent loop, and the row of the force that is asked for.

        passes  share of it that acts; None: what its limit lets pass
        """
        step = self._plant_step(at)
        N, queue = len(self.own.generator), self.loop.whole_delay + (self.loop.fractional_delay > 0.0)
        f, e = N + queue, N + queue + len(self.filter.A)
        M = e + len(self.estimator.A)
        L = np.zeros((M, M))
        read = np.zeros(M)
        read[: self.own.size] = self._sensor(at)
        speed = self.estimator.direct * read
        speed[e:] += self.estimator.output
        wall = self.wall_stiffness * read + self.wall_damping * speed
        L[e:] += np.outer(self.estimator.input, read)
        L[e:, e:] += np.eye(M - e) + self.estimator.A
        command = -self.filter.direct * wall
        command[f:e] -= self.filter.output
        L[f:e] += np.outer(self.filter.input, wall)
        L[f:e, f:e] += np.eye(e - f) + self.filter.A
        if passes is None:
            passes = float(saturation(max(at.force, 1e-300), self.limit)) if np.isfinite(self.limit) else 1.0
        passed = command * passes
        forces = [passed, *np.eye(M)[N:f]]
        for k in range(queue):
            L[N + k] += forces[k]
        whole = self.loop.whole_delay
        inside = []
        for transition, new, old in step:
            row = np.outer(new, forces[whole])
            row[:, :N] += transition
            if self.loop.fractional_delay > 0.0:
                row += np.outer(old, forces[whole + 1])
            inside.append(row)
        L[:N] += inside[-1]
        n = self.own.size
        speeds = np.array([np.eye(n, M, n), *(row[n : 2 * n] for row in inside)])
        return _Step(L, speeds, _simpson(self.loop.fractional_delay)), command

    def _sensor(self, at: Swing) -> Floats:
        """What the computer reads of the coordinates, (n,)."""
        if not self.parts.counters:
            return self.loop.plant.sensor
        total = np.zeros(self.own.size)
        for part, reading in zip(self.parts.counters, at.readings, strict=True):
            gain = quantiser(max(float(reading), 1e-300), part.step, self.offset * part.step)
            total += part.weight * float(gain) * part.along
        return total

    def _plant_step(self, at: Swing) -> list[tuple[Floats, Floats, Floats]]:
        """The plant's states at times within the sample and at its end: from those at its beginning, from the new
        force and from the old one."""
        return self._stepped(at) if self.parts.friction or self.parts.springs else self._linear_step

    @cached_property
    def _linear_step(self) -> list[tuple[Floats, Floats, Floats]]:
        """The same of a plant in which nothing depends on the vibration."""
        none = np.zeros(0)
        return self._stepped(Swing(1.0 + 0.0j, 1.0, 1.0, none, none, none))

    def _stepped(self, at: Swing) -> list[tuple[Floats, Floats, Floats]]:
        T, n, A = self.loop.period, self.own.size, self.own.generator.copy()
        v, column = slice(n, 2 * n), 1
        for part, speed in zip(self.parts.friction, at.velocities, strict=True):
            b = float(coulomb_damper(part.coulomb, max(float(speed), 1e-300)))
            A[:, v] -= min(b, 1e300) * np.outer(self.own.inputs[:, column], part.along)
            column += 1
        for spring, deflection in zip(self.parts.springs, at.deflections, strict=True):
            k = float(bent_spring(deflection, spring.cubic, spring.backward_excess))
            A[:, :n] -= k * np.outer(self.own.inputs[:, column], spring.along)
            column += 1
        scale = np.ones(len(A))
        scale[v] = T
        A, drive = A * scale[:, None] / scale * T, self.own.inputs[:, 0] * scale * T
        late = self.loop.fractional_delay
        times = [late] * (late > 0.0) + [1.0 - late]
        steps: list[tuple[Floats, Floats, Floats]] = []
        E, g = np.eye(len(A)), np.zeros((2, len(A)))
        for which, length in zip([1] * (late > 0.0) + [0], times, strict=True):
            one, gain = _held(A * (length / PARTS), drive * (length / PARTS))
            for _ in range(PARTS):
                E, g = one @ E, g @ one.T
                g[which] += gain
                steps.append((E, g[0].copy(), g[1].copy()))
        return steps


@dataclass(frozen=True)
class _Step:
    """What a sample does to all states.

    transition  (M, M)
    inside      (t, n, M)  velocities at times within the sample, from its first to its last [m per sample]
    weights     (t,)       of these times in a mean over the sample
    """

    transition: Floats
    inside: Floats
    weights: Floats


def _held(A: Floats, b: Floats) -> tuple[Floats, Floats]:
    """exp A, and what a held input leaves."""
    from scipy.linalg import expm

    k = len(A)
    whole = np.zeros((k + 1, k + 1))
    whole[:k, :k], whole[:k, k] = A, b
    E = expm(whole)
    return E[:k, :k], E[:k, k]


def _simpson(late: float) -> Floats:
    """Weights of the mean over a sample, which falls into two where the force changes within it."""
    one = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12.0
    if late == 0.0:
        return one
    return np.concatenate([late * one[:-1], [late * one[-1] + (1.0 - late) * one[0]], (1.0 - late) * one[1:]])


def _scaled(swing: Swing, ratio: float) -> Swing:
    """The same shape, so many times larger."""
    return Swing(
        swing.root,
        swing.amplitude * ratio,
        swing.force * ratio,
        swing.velocities * ratio,
        swing.readings * ratio,
        swing.deflections * ratio,
    )


def _numbers(swing: Swing) -> Floats:
    return np.concatenate([[swing.amplitude, swing.force], swing.velocities, swing.readings, swing.deflections])


def _difference(one: Swing, other: Swing) -> float:
    """Largest relative difference of two swings' amplitudes and roots."""
    a, b = _numbers(one), _numbers(other)
    size = np.maximum(np.abs(a), np.abs(b))
    apart = np.where(size > 0.0, np.abs(a - b) / np.where(size > 0.0, size, 1.0), 0.0)
    return float(max(np.max(apart), abs(one.root - other.root)))


def _between(one: Swing, other: Swing, weight: float) -> Swing:
    """Amplitudes part of the way, in the logarithm, and the other's root."""

    def mix(a: Floats, b: Floats) -> Floats:
        positive = (a > 0.0) & (b > 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(positive, np.exp((1.0 - weight) * np.log(a) + weight * np.log(b)), b)

    return Swing(
        other.root,
        float(mix(np.array(one.amplitude), np.array(other.amplitude))),
        float(mix(np.array(one.force), np.array(other.force))),
        mix(one.velocities, other.velocities),
        mix(one.readings, other.readings),
        mix(one.deflections, other.deflections),
    )


def equivalent_loop(
    loop: Loop,
    wall_stiffness: float,
    wall_damping: float,
    parts: Nonlinear,
    *,
    saturation: float = np.inf,
    offset: float = 0.0,
) -> EquivalentLoop:
    """The loop with its nonlinear parts, whose counters make up the sensor (none: read as finely as you like).

    saturation  the smallest limit on the force [N];  offset  see `EquivalentLoop`
    """
    counters = parts.counters
    if any(part.step > 0.0 for part in counters):
        counters = tuple(Counter(part.along, part.step, part.weight) for part in counters)
    else:
        counters = ()
    friction = tuple(part for part in parts.friction if part.coulomb > 0.0)
    parts = replace(parts, friction=friction, counters=counters, brakes=(), force_limit=saturation)
    motions = [part.along for part in friction] + [spring.along for spring in parts.springs]
    along = np.array(motions, dtype=float).reshape(len(motions), loop.plant.size)
    own = dynamics(loop.plant, loop.controller.actuator_time_constant, along)
    on_force, estimator = force_filter(loop.controller), loop.estimator
    return EquivalentLoop(
        loop,
        wall_stiffness,
        wall_damping,
        parts,
        saturation,
        offset,
        own,
        series(on_force.numerator, on_force.denominator, np.ones(1)),
        series(estimator.numerator, estimator.denominator, estimator.window),
    )
