"""Devices for the engine's tests, and their judge: an ODE solver that locates every event.

It shares nothing with the package but the plant and the controller that it is given.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from math import exp, inf, isfinite
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.systems import mass, two_mass
from zwidth.contact import one_sided_wall, simulate, wall
from zwidth.loop import Controller, Loop
from zwidth.model import Friction, Nonlinear

PAGE = (Path(__file__).parents[2] / "docs" / "simulation.md").read_text(encoding="utf-8")


def documented_accuracy(what):
    """How exact a case is at 20 and at 80 substeps by the page, with a tenth of it for rounding."""
    (row,) = (line for line in PAGE.splitlines() if line.startswith(f"| {what} |"))
    return [1.1 * float(cell) for cell in row.split("|")[2:4]]


def two_mass_loop(nonlinear=None, period=0.00125, structural=0.00012, **controller):
    """The thesis's two masses, Table 3.4, with what is not linear; the motor is the second."""
    plant = two_mass(0.2616, 0.0254, 15620.0, structural * 15620.0)
    return Loop(replace(plant, nonlinear=nonlinear or Nonlinear()), Controller(period, **controller))


def one_mass(kilograms, nonlinear=None, period=0.001, damping=0.0, stiffness=0.0, **controller):
    """A single mass."""
    plant = replace(mass(kilograms, damping, stiffness), nonlinear=nonlinear or Nonlinear())
    return Loop(plant, Controller(period, **controller))


def friction_of(level, at=1, size=2, **model):
    """Dry friction of one coordinate."""
    return Friction(np.eye(size)[at], level, **model)


def two_sided(stiffness, damping):
    """The law of the wall to both sides, written anew."""
    return lambda y, v: -(stiffness * y + damping * v)


def one_sided(stiffness, damping):
    """The law of the wall that can be left."""
    return lambda y, v: -(stiffness * y + damping * v) if y > 0.0 else 0.0


def random_stable_wall(rng, loop, most=1.0003, tries=40):
    """A random wall whose largest eigenvalue is at most `most`; None where there was none."""
    plant, T = loop.plant, loop.period
    m = 1.0 / (plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
    for _ in range(tries):
        K, B = m / T**2 * 10.0 ** rng.uniform(-6.0, -1.0), m / T * 10.0 ** rng.uniform(-4.0, -1.0)
        rho = spectral_radius(loop, K, B)
        if rho < most:
            return K, B
    return None


def spectral_radius(loop, stiffness, damping):
    """Largest modulus of the loop's eigenvalues."""
    return float(np.abs(np.linalg.eigvals(loop.transition_matrix(stiffness, damping))).max())


def run(loop, stiffness, damping, duration, *, sided=2, **circumstances):
    """The engine's answer."""
    if sided == 2:
        return simulate(
            loop, wall, wall.values(stiffness=stiffness, damping=damping), duration=duration, **circumstances
        )
    values = one_sided_wall.values(stiffness=stiffness, damping=damping)
    return simulate(loop, one_sided_wall, values, duration=duration, **circumstances)


@dataclass
class ReflexSpring:
    """A spring and damper that a reflex adds along a motion: k and b in the end, from `onset` on about `rest`."""

    along: np.ndarray
    stiffness: float
    damping: float
    rise: float
    onset: float = inf
    rest: float = 0.0


@dataclass
class ReferenceMotion:
    """position, velocity (samples, n);  reading (samples,);  work of loss, friction, hand, actuator so far."""

    position: np.ndarray
    velocity: np.ndarray
    reading: np.ndarray
    force: np.ndarray
    work: np.ndarray


@dataclass
class EventSolver:
    """A sampled loop with Coulomb friction in its modes (slip, stick), bristles, bent springs and brakes.

    law          (reading, backward-difference velocity) -> force
    push         time -> force at `pushed`
    """

    loop: Loop
    law: object
    push: object = None
    pushed: np.ndarray | None = None
    arms: list = field(default_factory=list)
    threshold: float = inf
    latency: float = 0.0
    tolerance: float = 1e-11

    def __post_init__(self):
        plant, own = self.loop.plant, self.loop.plant.nonlinear
        self.n = plant.size
        self.inverse = np.linalg.inv(plant.mass)
        self.dry = [f for f in own.friction if f.model == "coulomb"]
        self.bristles = [f for f in own.friction if f.model != "coulomb"]
        self.lag = self.loop.controller.actuator_time_constant
        self.limit = min(self.loop.controller.force_limit, own.force_limit)
        if self.pushed is None:
            self.pushed = plant.sensor if plant.handle is None else plant.handle
        if self.dry:
            self.along = np.array([f.along for f in self.dry])
            self.level = np.array([f.coulomb for f in self.dry])
            self.mobility = self.along @ self.inverse @ self.along.T

    def bristle(self, f, z, speed):
        """Force and z' of a Dahl or LuGre friction."""
        most = f.breakaway if f.model == "lugre" and isfinite(f.breakaway) else f.coulomb
        g = f.coulomb
        if most > f.coulomb:
            g += (most - f.coulomb) * exp(-((speed / f.stribeck_velocity) ** 2))
        rate = speed - f.bristle_stiffness * abs(speed) * z / g
        return f.bristle_stiffness * z + (f.bristle_damping if f.model == "lugre" else 0.0) * rate, rate

    def free(self, t, s):
        """Forces (n,) of all but the Coulomb friction, rates of bristles, and the power of losses and friction."""
        plant, n = self.loop.plant, self.n
        x, v = s[:n], s[n : 2 * n]
        force = -plant.stiffness @ x - plant.damping @ v
        lost, rubbed, rates = v @ plant.damping @ v, 0.0, []
        for k, f in enumerate(self.bristles):
            own, rate = self.bristle(f, s[2 * n + 1 + k], f.along @ v)
            force, rubbed = force - own * f.along, rubbed - own * (f.along @ v)
            rates.append(rate)
        for spring in plant.nonlinear.springs:
            d = spring.along @ x
            force = force - (spring.cubic * d**3 + spring.backward_excess * min(d, 0.0)) * spring.along
        for k, brake in enumerate(plant.nonlinear.brakes):
            b = s[2 * n + 1 + len(self.bristles) + k] if brake.time_constant > 0.0 else self.commanded[k]
            force = force - b * (brake.along @ v) * brake.along
            wanted = self.commanded[k]
            rates.append((wanted - b) / brake.time_constant if brake.time_constant > 0.0 else 0.0)
        for arm in self.arms:
            if t >= arm.onset:
                level = 1.0 - exp(-(t - arm.onset) / arm.rise)
                own = level * (arm.stiffness * (arm.along @ x - arm.rest) + arm.damping * (arm.along @ v))
                force = force - own * arm.along
        if self.push is not None:
            force = force + self.push(t) * self.pushed
        return force, rates, lost, rubbed

    def rubbing(self, t, s, modes, command):
        """Coulomb forces: C times the mode where it slips, what holds it where it sticks."""
        force = self.free(t, s)[0] + self.loop.plant.actuator * (s[2 * self.n] if self.lag > 0.0 else command)
        friction = self.level * modes
        stuck = modes == 0
        if stuck.any():
            slipping = self.along @ self.inverse @ (force - self.along.T @ friction)
            friction[stuck] = np.linalg.solve(self.mobility[np.ix_(stuck, stuck)], slipping[stuck])
        return friction, force

    def rate(self, t, s, modes, command):
        n = self.n
        actuator = s[2 * n] if self.lag > 0.0 else command
        force, rates, lost, rubbed = self.free(t, s)
        force = force + self.loop.plant.actuator * actuator
        if self.dry:
            friction, _ = self.rubbing(t, s, modes, command)
            force = force - self.along.T @ friction
            rubbed -= friction @ (self.along @ s[n : 2 * n])
        v = s[n : 2 * n]
        hand = self.push(t) * (self.pushed @ v) if self.push is not None else 0.0
        lagging = (command - s[2 * n]) / self.lag if self.lag > 0.0 else 0.0
        work = [-lost, rubbed, hand, actuator * (self.loop.plant.actuator @ v)]
        return np.concatenate([v, self.inverse @ force, [lagging], rates, work])

    def decide(self, t, s, command, forced=None):
        """Which frictions slip, and which way: of those at rest, the one way that is consistent."""
        v = self.along @ s[self.n : 2 * self.n]
        modes = np.where(np.abs(v) > 1e-11, np.sign(v), np.nan)
        if forced is not None:
            modes[forced[0]] = forced[1]
        resting = np.flatnonzero(np.isnan(modes))
        for choice in product((0.0, 1.0, -1.0), repeat=len(resting)):
            modes[resting] = choice
            friction, force = self.rubbing(t, s, modes, command)
            speeding = self.along @ self.inverse @ (force - self.along.T @ friction)
            if all(
                abs(friction[i]) <= self.level[i] * (1.0 + 1e-10)
                if modes[i] == 0.0
                else speeding[i] * modes[i] > 0.0
                for i in resting
            ):
                return modes
        raise AssertionError("no consistent way to rub")

    def integrate(self, s, t, end, command):
        """From t to end under one command, from event to event."""
        if end <= t:
            return s
        modes = self.decide(t, s, command) if self.dry else np.zeros(0)
        while True:
            events = []
            for i, mode in enumerate(modes):
                if mode == 0.0:
                    events.append(
                        lambda t, s, i=i, m=modes: self.level[i] - abs(self.rubbing(t, s, m, command)[0][i])
                    )
                    events[-1].direction = -1.0
                else:
                    # a hair beyond rest, so that what has just begun to slip does not count as having stopped
                    events.append(lambda t, s, i=i, m=mode: m * (self.along[i] @ s[self.n : 2 * self.n]) + 1e-12)
                    events[-1].direction = -1.0
                events[-1].terminal = True
            found = self.solved(s, t, end, modes, command, events)
            s = found.y[:, -1]
            if found.status == 0:
                return s
            t = found.t[-1]
            (hit,) = [i for i, times in enumerate(found.t_events) if len(times)][:1]
            forced = None
            if modes[hit] == 0.0:
                forced = (hit, np.sign(self.rubbing(t, s, modes, command)[0][hit]))
            else:  # exactly at rest
                along = self.along[hit]
                speed = along @ s[self.n : 2 * self.n]
                s[self.n : 2 * self.n] -= self.inverse @ along * speed / self.mobility[hit, hit]
            modes = self.decide(t, s, command, forced)

    def solved(self, s, t, end, modes, command, events):
        """By steps short enough that no two events hide in one."""
        return solve_ivp(
            lambda t, s: self.rate(t, s, modes, command),
            (t, end),
            s,
            method="DOP853",
            rtol=self.tolerance,
            atol=self.tolerance * self.small,
            events=events,
            max_step=self.loop.period / 10.0 if events else inf,
        )

    def run(self, x, v, samples):
        """From place x and velocity v (n,), with a controller that has a delay, a limit, and nothing else."""
        plant, controller, n = self.loop.plant, self.loop.controller, self.n
        T, whole, rest = controller.sampling_period, controller.whole_delay, controller.fractional_delay
        more = len(self.bristles) + len(plant.nonlinear.brakes)
        s = np.concatenate([x, v, np.zeros(1 + more + 4)])
        self.small = np.concatenate(
            [
                np.full(n, 1e-3),
                np.full(n, 0.1),
                [1.0],
                np.full(len(self.bristles), 1e-6),
                np.ones(more - len(self.bristles) + 4),
            ]
        )
        self.commanded = [0.0] * len(plant.nonlinear.brakes)
        forces, before, rows = [0.0] * (whole + 2), None, []
        begun = inf
        for j in range(samples):
            t = j * T
            y = self.read(s[:n])
            f = self.law(y, 0.0 if before is None else (y - before) / T)
            before = y
            command = float(np.clip(f, -self.limit, self.limit))
            rows.append(np.concatenate([s, [y, command]]))
            forces = [command, *forces[:-1]]
            self.commanded = [brake.damping if f != 0.0 else 0.0 for brake in plant.nonlinear.brakes]
            if begun == inf and abs(f) > self.threshold:
                begun = t + self.latency
            for arm in self.arms:
                if arm.onset == inf and t >= begun - 1e-12:
                    arm.onset, arm.rest = begun, float(arm.along @ s[:n])
            s = self.integrate(s, t, t + rest * T, forces[whole + 1])
            s = self.integrate(s, t + rest * T, t + T, forces[whole])
        rows = np.array(rows)
        return ReferenceMotion(rows[:, :n], rows[:, n : 2 * n], rows[:, -2], rows[:, -1], rows[:, -6:-2])

    def read(self, x):
        """The encoders' sum."""
        counters = self.loop.plant.nonlinear.counters
        if not counters:
            return float(self.loop.plant.sensor @ x)
        return sum(
            c.weight * (c.step * np.floor(c.along @ x / c.step + 0.5) if c.step > 0.0 else c.along @ x)
            for c in counters
        )
