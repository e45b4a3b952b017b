"""A limit cycle of a limited force with its harmonics: a single sine is inaccurate deep in saturation.

The limit acts on the samples of the commanded force, so that with theta = omega T j + a phase

    w(theta) = sum over odd n of Re(W_n exp(i n theta)),     W_n = G(exp(i n omega T)) U_n

where U_n are the harmonics of the limited w(theta) and G is the loop cut at the limit, from the force that acts to
the commanded one. One equation for each harmonic, solved by Newton's method from the first one, which is the
describing function's answer. With all harmonics this is exact for vibrations that are not locked to the samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.contact.harmonic_balance import LimitCycle
from zwidth.contact.quasi_linear import equivalent_loop
from zwidth.loop.loop import Loop
from zwidth.model.nonlinear import Nonlinear

COUNTS = (1, 2, 4, 8, 16)  # of odd harmonics, each solution the start of the next
PHASES = 512
SOLVED = 1e-8  # what is left of the equations, relative to the first harmonic
FAR = 4.0  # times: a step to another cycle is none


def with_harmonics(
    loop: Loop, wall_stiffness: float, wall_damping: float, cycle: LimitCycle, force_limit: float | None = None
) -> LimitCycle:
    """Refine a limit cycle with up to 16 odd harmonics: amplitude, frequency and force are half peak to peak.

    Only the limit of the force is taken for nonlinear. Where Newton's method fails the cycle of the harmonics that
    it could follow is returned, of the first alone the one that was given.

    cycle       by `limit_cycles` of a loop without dry friction, counters and bent springs that act
    force_limit  largest force [N]; None: the smaller of the controller's and the actuator's limits
    Raises      ValueError   where nothing limits the force

    >>> from zwidth.contact.harmonic_balance import limit_cycles
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> plant = Plant(0.1 * one[:, None], 0.1 * one[:, None], np.zeros((1, 1)), one, one)
    >>> loop = Loop(plant, Controller(0.001))
    >>> [first] = limit_cycles(loop, 400.0, 0.05, force_limit=1.0)
    >>> full = with_harmonics(loop, 400.0, 0.05, first, force_limit=1.0)
    >>> round(full.amplitude / first.amplitude, 3), round(full.frequency_Hz / first.frequency_Hz, 3)
    (1.04, 0.975)
    """
    limit = loop.nonlinear.force_limit if force_limit is None else force_limit
    if not 0.0 < limit < np.inf:
        raise ValueError(f"harmonics are those of a limited force, and its limit is {limit} N")
    transition, gain, command = equivalent_loop(loop, wall_stiffness, wall_damping, Nonlinear()).open_at_limit()
    sensor = np.zeros(len(gain))
    sensor[: loop.plant.size] = loop.plant.sensor
    cut = _OpenLoop(transition, gain, np.stack([command, sensor]))
    T, refined = loop.period, cycle
    start = np.array([np.log(cycle.force_amplitude / limit), np.log(2.0 * np.pi * cycle.frequency_Hz * T)])
    for count in COUNTS:
        solution = cut.solve(_longer(start, count), count)
        if solution is None or np.max(np.abs(solution[:2] - start[:2])) > np.log(FAR):
            break
        start = solution
        force, position, angle = cut.vibration(solution, count)
        refined = replace(
            cycle,
            amplitude=position * limit,
            force_amplitude=force * limit,
            frequency_Hz=angle / (2.0 * np.pi * T),
        )
    return refined


def _longer(start: Floats, count: int) -> Floats:
    """A solution with more harmonics, which are 0: logarithms of the first and of its angle, then the others'
    real and imaginary parts."""
    before = len(start) // 2
    more = np.zeros(count - before)
    return np.concatenate([start[: before + 1], more, start[before + 1 :], more])


class _OpenLoop:
    """The loop cut at its limit, forces in units of it."""

    def __init__(self, transition: Floats, force: Floats, rows: Floats) -> None:
        self.transition, self.force, self.rows = transition, force, rows
        self.phases = 2.0 * np.pi * np.arange(PHASES) / PHASES

    def solve(self, start: Floats, count: int) -> Floats | None:
        """Newton's method from a start; None where it fails."""
        from scipy.optimize import root

        def left(unknown: Floats) -> Floats:
            W, angle = _harmonic_parts(unknown, count)
            rest = (self._loop_response(angle, count)[0] * self._limited(W) - W) / abs(W[0])
            return np.concatenate([rest.real, rest.imag])

        with np.errstate(all="ignore"):
            solution = root(left, start, tol=1e-12)
            good = np.all(np.isfinite(solution.x)) and np.max(np.abs(left(solution.x))) < SOLVED
        return np.asarray(solution.x) if good else None

    def vibration(self, solution: Floats, count: int) -> tuple[float, float, float]:
        """Half of peak to peak of the commanded force and of the position, and the angle per sample."""
        W, angle = _harmonic_parts(solution, count)
        position = self._loop_response(angle, count)[1] * self._limited(W)
        force, place = (0.5 * float(np.ptp(self._over_phases(part))) for part in (W, position))
        return force, place, angle

    def _loop_response(self, angle: float, count: int) -> Complexes:
        """(2, h) responses of the commanded force and of the sensor's motion to the force that acts."""
        size, orders = len(self.transition), np.arange(1, 2 * count, 2)
        z = np.exp(1j * angle * orders)[:, None, None]
        inner = np.linalg.solve(z * np.eye(size) - self.transition, self.force[:, None].astype(complex))[..., 0]
        return np.asarray(self.rows @ inner.T)

    def _over_phases(self, W: Complexes) -> Floats:
        orders = np.arange(1, 2 * len(W), 2)
        return np.asarray((W @ np.exp(1j * np.outer(orders, self.phases))).real)

    def _limited(self, W: Complexes) -> Complexes:
        """Harmonics of what the limit lets pass."""
        passed = np.clip(self._over_phases(W), -1.0, 1.0)
        orders = np.arange(1, 2 * len(W), 2)
        return np.asarray(2.0 / PHASES * np.exp(-1j * np.outer(orders, self.phases)) @ passed)


def _harmonic_parts(unknown: Floats, count: int) -> tuple[Complexes, float]:
    """The harmonics, the first one real, and the angle per sample."""
    first = np.exp(unknown[0])
    others = unknown[2 : count + 1] + 1j * unknown[count + 1 :]
    return first * np.concatenate([[1.0 + 0.0j], others]), float(np.exp(unknown[1]))
