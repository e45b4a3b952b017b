"""Loops with fixed feedback computed a second way: one sampling period played through, state by state.

Nothing is shared with `zwidth.loop` but the numbers of plant, operator and controller: the plant moves by the
exponential of its matrix (`systems.held_step`), filters are second-order sections of scipy, everything else is a
list of past values. A transition matrix is what a period makes of each unit vector. The same period is played in
decimal arithmetic by `tests/chart/exact_control.py`, which brings its own numbers, filters and exponentials.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from tests import systems
from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    Controller,
    Feedforward,
    ForceSensor,
    Kalman,
    LocalLoop,
    Loop,
)
from zwidth.model import Operator, Plant, attach


class DoublePrecision:
    """What a period is computed with: numbers, filters, windows and steps of the plant."""

    def number(self, x):
        return float(x)

    def array(self, x):
        return np.asarray(x, dtype=float)

    def sections(self, low_pass, T):
        return systems.low_pass_sections(low_pass, T)

    def weights(self, method, T):
        return systems.velocity_weights(method, T)

    def held_step(self, plant, time, lag):
        return systems.held_step(plant, time, lag)

    def solve(self, matrix, right):
        return np.linalg.solve(matrix, right)


@dataclass
class ControlledLoop:
    """A device, whoever holds it, and its computer."""

    device: Plant
    operator: Operator | None
    controller: Controller
    loop: Loop = field(init=False)
    steps: dict[tuple[type, float], tuple[np.ndarray, np.ndarray]] = field(init=False, default_factory=dict)

    def __post_init__(self):
        held = self.device if self.operator is None else attach(self.device, self.operator)
        self.loop = Loop(held, self.controller)

    def matrices(self):
        """L0, LK, LB of the transition matrix L0 + K LK + B LB, and the sizes of K and B by which it was built."""
        plant, T = self.loop.plant, self.controller.sampling_period
        inertia = 1.0 / (plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
        K, B = inertia / T**2, inertia / T
        L0 = self.transition_matrix(0.0, 0.0)
        LK, LB = (self.transition_matrix(*wall) - L0 for wall in ((K, 0.0), (0.0, B)))
        return L0, LK / K, LB / B

    def transition_matrix(self, K, B, arithmetic=None):
        """What a period makes of each unit vector."""
        arithmetic = arithmetic or DoublePrecision()
        size = Period(self, K, B, None, arithmetic).size
        return Period(self, K, B, arithmetic.array(np.eye(size)), arithmetic).after()


class Memory:
    """States taken one after the other out of the rows of an array (N, k), and put back in the same order."""

    def __init__(self, given):
        self.given, self.new, self.count = given, [], 0

    def take(self, n):
        self.count += n
        if self.given is None:
            return np.zeros((n, 1))
        return self.given[self.count - n : self.count]

    def put(self, rows):
        self.new.append(np.atleast_2d(rows))


class Filter:
    """Second-order sections in transposed direct form II."""

    def __init__(self, memory, sections):
        self.sections, self.states = sections, [memory.take(2).copy() for _ in sections]

    def __call__(self, signal):
        for (b0, b1, b2, _, a1, a2), s in zip(self.sections, self.states, strict=True):
            out = b0 * signal + s[0]
            s[0], s[1] = b1 * signal - a1 * out + s[1], b2 * signal - a2 * out
            signal = out
        return signal

    def save(self, memory):
        for s in self.states:
            memory.put(s)


class Past:
    """Past values, the newest first."""

    def __init__(self, memory, n):
        self.values = list(memory.take(n).copy())

    def __call__(self, value):
        everything = [value, *self.values]
        self.values = everything[: len(self.values)]
        return everything

    def save(self, memory):
        for value in self.values:
            memory.put(value)


class Velocity:
    """A velocity estimate behind a low pass."""

    def __init__(self, memory, method, low_pass, T, arithmetic):
        self.T, self.weights = T, arithmetic.weights(method, T)
        self.method = method.alpha_beta(float(T)) if isinstance(method, Kalman) else method
        self.past = Past(memory, 2 if self.weights is None else len(self.weights) - 1)
        self.filter = Filter(memory, arithmetic.sections(low_pass, T))

    def __call__(self, y):
        if self.weights is not None:
            return self.filter(sum(w * x for w, x in zip(self.weights, self.past(y), strict=True)))
        assert isinstance(self.method, AlphaBeta)
        place, speed = self.past.values
        predicted = place + self.T * speed
        speed = speed + self.method.beta / self.T * (y - predicted)
        self.past.values = [predicted + self.method.alpha * (y - predicted), speed]
        return self.filter(speed)

    def save(self, memory):
        self.past.save(memory)
        self.filter.save(memory)


class Held:
    """Commands that wait; `before` is what acts just before the next sample."""

    def __init__(self, memory, delay, arithmetic):
        self.whole = int(np.floor(delay + 1e-12))
        self.part = max(arithmetic.number(delay) - self.whole, arithmetic.number(0.0))
        self.past = Past(memory, self.whole + 1)

    @property
    def before(self):
        return self.past.values[self.whole]

    def __call__(self, command):
        values = self.past(command)
        return values[self.whole + 1], values[self.whole]

    def save(self, memory):
        self.past.save(memory)


class Period:
    """One sampling period from given states (N, k)."""

    def __init__(self, case, K, B, states, arithmetic):
        plant, c = case.loop.plant, case.controller
        self.case, self.plant, self.c, self.K, self.B = case, plant, c, K, B
        self.arithmetic = arithmetic
        self.T = T = arithmetic.number(c.sampling_period)
        memory = Memory(states)
        states_of_plant, _ = systems.generator(plant, c.actuator_time_constant)
        self.speeds = slice(plant.size, 2 * plant.size)
        # velocities are kept in metres per sample
        self.x = memory.take(len(states_of_plant)).copy()
        self.x[self.speeds] = self.x[self.speeds] / T
        self.velocity = Velocity(memory, c.velocity, c.velocity_filter, T, arithmetic)
        self.force_filter = Filter(memory, arithmetic.sections(c.force_filter, T))
        self.slow = Held(memory, c.delay, arithmetic)
        self.parts = [self.velocity, self.force_filter, self.slow]
        if c.force_sensor is not None:
            self.late = Past(memory, c.force_sensor.delay)
            self.on_sensor = Filter(memory, arithmetic.sections(c.force_sensor.filter, T))
            self.parts += [self.late, self.on_sensor]
        if c.feedforward is not None:
            own = c.feedforward
            self.own_velocity = Velocity(memory, own.velocity, own.velocity_filter, T, arithmetic)
            self.before = Past(memory, 1)
            self.acceleration = Filter(memory, arithmetic.sections(own.acceleration_filter, T))
            self.parts += [self.own_velocity, self.before, self.acceleration]
        if c.local_loop is not None:
            own = c.local_loop
            self.fast_velocity = Velocity(
                memory, own.velocity, own.velocity_filter, T / own.rate_multiple, arithmetic
            )
            self.fast = Held(memory, own.delay, arithmetic)
            self.parts += [self.fast_velocity, self.fast]
        self.size = memory.count

    def after(self):
        """The states at the end, (N, k)."""
        c, T, number = self.c, self.T, self.arithmetic.number
        slow_first, slow_later = self.slow(self.slow_command())
        zero = 0.0 * slow_first
        N = 1 if c.local_loop is None else c.local_loop.rate_multiple
        for k in range(N):
            start, end = number(k) / N, number(k + 1) / N
            first, later = self.fast(self.fast_command()) if c.local_loop is not None else (zero, zero)
            change = start + (self.fast.part / N if c.local_loop is not None else number(0.0))
            instants = sorted({start, change, min(max(self.slow.part, start), end), end})
            for a, b in pairwise(instants):
                middle = (a + b) / 2
                command = (slow_first if middle < self.slow.part else slow_later) + (
                    first if middle < change else later
                )
                self.move((b - a) * T, command)
        memory = Memory(None)
        self.x[self.speeds] = self.x[self.speeds] * T
        memory.put(self.x)
        for part in self.parts:
            part.save(memory)
        return np.vstack(memory.new)

    def slow_command(self):
        c, y = self.c, self.reading()
        wall = -(self.K * y + self.B * self.velocity(y))
        command = wall
        if c.force_sensor is not None:
            measured = self.late(self.measured_force())[-1]
            if c.force_sensor.law == "force-error":
                measured = measured + wall
            command = command + c.force_sensor.gain * self.on_sensor(measured)
        if c.feedforward is not None:
            new, old = self.before(self.own_velocity(y))
            a = self.acceleration((new - old) / self.T)
            command = command + c.feedforward.damping * new + c.feedforward.inertia * a
        return self.force_filter(command)

    def fast_command(self):
        own, y = self.c.local_loop, self.reading()
        return -(own.stiffness * y + own.damping * self.fast_velocity(y))

    def reading(self):
        return self.arithmetic.array(self.plant.sensor) @ self.x[: self.plant.size]

    def measured_force(self):
        """Hand force less inertia force of the mass beyond the sensor, from Newton's law at this instant."""
        n, plant, operator, device = self.plant.size, self.plant, self.case.operator, self.case.device
        array = self.arithmetic.array
        if self.c.actuator_time_constant > 0.0:
            acting = self.x[-1]
        else:
            acting = self.slow.before + (self.fast.before if self.c.local_loop is not None else 0.0)
        x, v = self.x[:n], self.x[self.speeds]
        forces = np.multiply.outer(array(plant.actuator), acting)
        forces = forces - array(plant.damping) @ v - array(plant.stiffness) @ x
        for damper, force in zip(plant.lagged_dampers, self.x[2 * n :], strict=False):
            forces = forces - np.multiply.outer(array(damper.along), force)
        a = self.arithmetic.solve(plant.mass, forces)
        h = array(device.handle)
        k = len(h)
        hand = 0.0
        if operator is not None and operator.grasp_stiffness is None:
            hand = -(
                operator.arm_mass * (h @ a[:k])
                + operator.arm_damping * (h @ v[:k])
                + operator.arm_stiffness * (h @ x[:k])
            )
        elif operator is not None:
            hand = operator.grasp_stiffness * (x[k] - h @ x[:k]) + operator.grasp_damping * (v[k] - h @ v[:k])
        return hand - self.c.force_sensor.mass_beyond * (h @ a[:k])

    def move(self, time, command):
        if time > 0.0:
            known, key = self.case.steps, (type(self.arithmetic), float(f"{float(time):.13g}"))
            if key not in known:
                known[key] = self.arithmetic.held_step(self.plant, time, self.c.actuator_time_constant)
            F, g = known[key]
            self.x = F @ self.x + np.multiply.outer(g, command)


def random_low_pass(rng, rate):
    """A low pass, or none."""
    return systems.random_controller(rng, rate, delays=False).velocity_filter


def random_estimate(rng, rate):
    return systems.random_method(rng, rate) if rng.random() < 0.3 else BackwardDifference()


def random_controlled_loop(rng, *feedback):
    """A random loop of every kind with the feedback named: "force-sensor", "feedforward", "local"."""
    features = [name for name in ("lag", "electrical", "estimator", "force-filter") if rng.random() < 0.25]
    kind = str(rng.choice(["chain", "dense", "coupled", "apart"]))
    bare = systems.random_loop(rng, kind=kind, features=features)
    plant, c = bare.plant, bare.controller
    rate, T = 1.0 / c.sampling_period, c.sampling_period
    plant = replace(plant, handle=np.eye(plant.size)[0])
    operator = systems.random_operator(rng) if rng.random() < 0.6 else None
    m = 1.0 / float(plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
    if "force-sensor" in feedback:
        at_handle = 1.0 / float(plant.handle @ np.linalg.solve(plant.mass, plant.handle))
        sensor = ForceSensor(
            gain=float(10.0 ** rng.uniform(-1.0, 0.7) if rng.random() < 0.8 else -rng.uniform(0.05, 0.9)),
            filter=random_low_pass(rng, rate),
            delay=int(rng.integers(0, 3)),
            mass_beyond=float(at_handle * rng.choice([0.0, rng.uniform(0.0, 0.9)])),
            law=str(rng.choice(["force-feedforward", "force-error"])),
        )
        c = replace(c, force_sensor=sensor)
    if "feedforward" in feedback:
        ahead = Feedforward(
            inertia=float(m * rng.choice([0.0, rng.uniform(0.0, 0.9)])),
            damping=float(m / T * 10.0 ** rng.uniform(-4.0, -1.0) * rng.choice([0.0, 1.0])),
            velocity=random_estimate(rng, rate),
            velocity_filter=random_low_pass(rng, rate),
            acceleration_filter=random_low_pass(rng, rate),
        )
        c = replace(c, feedforward=ahead)
    if "local" in feedback:
        N = int(rng.integers(1, 21))
        local = LocalLoop(
            N,
            stiffness=float(m / T**2 * 10.0 ** rng.uniform(-4.0, -1.0) * rng.choice([0.0, 1.0])),
            damping=float(m / T * 10.0 ** rng.uniform(-3.0, 0.0)),
            velocity=random_estimate(rng, N * rate),
            velocity_filter=random_low_pass(rng, N * rate),
            delay=float(rng.choice([0.0, 1.0, rng.uniform(0.0, 2.0)])),
        )
        c = replace(c, local_loop=local)
    return ControlledLoop(plant, operator, c)
