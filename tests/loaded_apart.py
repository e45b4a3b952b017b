"""A device under load, simulated nonlinearly from sample to sample: the judge of its linearisation.

The links move by their full equations of motion, integrated by Runge and Kutta; the computer counts the motors,
closes the loops of the counted posture, and sends J^T f n of the wall's force there. The map from the state at one
sample to that at the next is differentiated by central differences. State: joints and motors, their rates, lagged
torques; then the computer's: torques on their way, the last readings, the filter's memory.
"""

from dataclasses import replace

import numpy as np

from zwidth.contact.mechanism.acceleration import accelerate, configure
from zwidth.contact.mechanism.motion_kernel import ready
from zwidth.contact.mechanism.system import memory_of, system_of
from zwidth.model.closed_posture import moved_posture
from zwidth.model.mechanism_arrays import pack
from zwidth.model.posture import link_points
from zwidth.model.reduction import reduce_mechanism

STEPS = 24  # of Runge and Kutta's method in a period: error far below the tolerance


class SampledDevice:
    """One posture of a device whose drives are its coordinates, with its computer and its load."""

    def __init__(self, point, equilibrium, stiffness, damping, compensation="none"):
        m, self.posture = point.mechanism, point.posture
        self.mechanism, self.controller, self.eq = m, point.controller, equilibrium
        self.K, self.B, self.compensation = stiffness, damping, compensation
        self.u, self.load = equilibrium.screw[:3], equilibrium.load
        self.mech = pack(m)
        springs = equilibrium.springs
        k = springs.tangent(equilibrium.deflections, self.load.branch == "backward") / m.drives.transmission**2
        tangent = replace(m, drives=replace(m.drives, stiffness=k))
        plant = reduce_mechanism(tangent, self.posture, self.u, "full", point.damping, point.encoders)
        self.gravity = np.zeros(3) if compensation == "counterweight" else self.load.weight
        bare = replace(plant, nonlinear=reduce_mechanism(m, self.posture, self.u, "full", point.damping).nonlinear)
        self.system = system_of(self.mech, m.drives, bare, self.gravity, self.controller.actuator_time_constant)
        self.memory = memory_of(self.system)
        self.d, self.n = len(m.drives.joint), plant.size
        self.motor = self.system.motor
        self.read = self.motor if point.encoders == "motor" else np.arange(self.d)
        self.lags = len(self.system.lag_time)
        self.whole, self.part = self.controller.whole_delay, self.controller.fractional_delay
        self.queue = self.whole + (self.part > 0.0)
        self.start = self._start()

    def _start(self):
        joints = self.mech.to_drive[0] @ self.posture.angles[self.mechanism.drives.joint]
        x = np.zeros(2 * self.n + self.lags)
        x[: self.d] = joints
        x[self.motor] = joints + self.eq.deflections
        for k in np.flatnonzero(self.system.lag_command >= 0):
            x[2 * self.n + k] = self.eq.torques[self.system.lag_command[k]]
        self.y0 = self.reading(x)
        return np.concatenate([x, np.tile(self.eq.torques, self.queue), [0.0]])

    def counted(self, x):
        """Joint coordinates of the posture that the computer sees."""
        at = self.posture.angles
        joints = self.mech.to_drive[0] @ at[self.mechanism.drives.joint]
        return moved_posture(self.mech, at, x[self.read] - joints)

    def reading(self, x):
        return self.u @ self._handle(self.counted(x))

    def _handle(self, angles):
        points = link_points(self.mechanism, replace(self.posture, angles=angles))
        return points.of(self.mechanism.handle_link, self.mechanism.handle_point)

    def command(self, x, last):
        """Torques, and the reading that the velocity's estimate keeps."""
        angles = self.counted(x)
        y = self.u @ self._handle(angles) - self.y0
        speed = (y - last) / self.controller.sampling_period
        force = self.eq.wall_force - self.K * y - self.B * speed
        normal = self.u
        if np.isfinite(self.load.surface_radius):
            pressed = np.sign(self.eq.wall_force) * self.u
            centre = self.centre - self.load.surface_radius * pressed
            normal = (self._handle(angles) - centre) / (self._handle(angles) - centre)[...] @ np.eye(3)
            out = self._handle(angles) - centre
            normal = np.sign(self.load.surface_radius) * np.sign(self.eq.wall_force) * out / np.linalg.norm(out)
        torques = self._jacobian(angles).T @ (force * normal)
        if self.compensation == "computed":
            torques = torques - self._weight(angles)
        return torques, y

    @property
    def centre(self):
        return self._handle(self.counted(self.start[: 2 * self.n + self.lags]))

    def _jacobian(self, angles, step=1e-5):
        """dx/dp by differences, so that nothing of the linearisation's own derivatives is used."""
        columns = []
        for e in step * np.eye(self.d):
            ahead, back = (self._handle(moved_posture(self.mech, angles, way)) for way in (e, -e))
            far, farther = (self._handle(moved_posture(self.mech, angles, 2 * way)) for way in (e, -e))
            columns.append((8 * (ahead - back) - (far - farther)) / (12 * step))
        return np.array(columns).T

    def _weight(self, angles, step=1e-4):
        """Generalised forces of gravity, from its potential."""

        def height(at):
            points = link_points(self.mechanism, replace(self.posture, angles=at))
            links = self.mechanism.links
            return sum(
                m * points.of(i, c) for i, (m, c) in enumerate(zip(links.mass, links.center_of_mass, strict=True))
            )

        rows = []
        for e in step * np.eye(self.d):
            a, b, c, d = (height(moved_posture(self.mech, angles, f * e)) for f in (1, -1, 2, -2))
            rows.append(self.gravity @ (8 * (a - b) - (c - d)) / (12 * step))
        return np.array(rows)

    def rate(self, x):
        system, memory = self.system, self.memory
        assert configure(system, memory, x) >= 0.0
        hand = self.eq.hand_force
        if self.load.hand == "follower":
            hand = self._turned(hand)
        accelerate(system, memory, x, hand)
        return memory.rate.copy()

    def _turned(self, force):
        """A force that turns with the handle's link, at the links' present place."""
        at = link_points(self.mechanism, self.posture).rotation[self.mechanism.handle_link]
        now = self.memory.work.rotation[self.mechanism.handle_link]
        return now @ at.T @ force

    def advance(self, x, time, torques):
        """Runge and Kutta over a time under held torques."""
        if not time > 0.0:
            return x
        self.memory.hold[:], self.memory.command[:] = 0.0, 0.0
        lagging = self.system.lag_command
        if np.any(lagging >= 0):
            for k in np.flatnonzero(lagging >= 0):
                self.memory.command[k] = torques[lagging[k]]
        else:
            self.memory.hold[self.motor] = torques
        steps = max(1, int(np.ceil(STEPS * time / self.controller.sampling_period)))
        h = time / steps
        for _ in range(steps):
            a = self.rate(x)
            b = self.rate(x + h / 2 * a)
            c = self.rate(x + h / 2 * b)
            d = self.rate(x + h * c)
            x = x + h / 6 * (a + 2 * b + 2 * c + d)
        return x

    def map(self, state):
        """The state one sample later."""
        N, T = 2 * self.n + self.lags, self.controller.sampling_period
        x, waiting, last = state[:N], state[N:-1].reshape(self.queue, self.d), state[-1]
        self.memory.angles[:] = self.posture.angles
        ready(self.mech, self.memory.angles, self.memory.work)
        torques, y = self.command(x, last)
        line = np.vstack([torques, waiting])
        x = self.advance(x, self.part * T, line[min(self.whole + 1, self.queue)])
        x = self.advance(x, (1.0 - self.part) * T, line[self.whole])
        return np.concatenate([x, line[: self.queue].ravel(), [y]])

    def rest(self):
        """By what the equilibrium moves within a sample, in shares of a millimetre and of the torques."""
        return self.map(self.start) - self.start

    def jacobian(self, step=2e-5):
        """d map / d state, by differences of fourth order in steps that suit each part."""
        N, columns = len(self.start), []
        T, size = self.controller.sampling_period, np.max(np.abs(self.eq.torques), initial=1e-3)
        steps = np.full(N, step)
        steps[self.n : 2 * self.n] = step / T
        steps[2 * self.n :] = size * 1e-2
        steps[-1] = step * 0.1
        for i in range(N):
            e = steps[i] * np.eye(N)[i]
            a, b, c, d = (self.map(self.start + f * e) for f in (1, -1, 2, -2))
            columns.append((8 * (a - b) - (c - d)) / (12 * steps[i]))
        return np.array(columns).T
