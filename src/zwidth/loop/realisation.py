"""States for the loop's factors, chosen so that eigenvalues of the transition matrix lose no digits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zwidth.loop.estimator import Estimator

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StateSpace:
    """Z_{j+1} = (open - input (K position + B velocity)) Z_j, the wall force being u = -(K y + B v).

    open      (N, N)  transition matrix without a wall
    input     (N,)    how the force enters
    position  (N,)    y from the states;   velocity  (N,)   v from the states
    """

    open: Floats
    input: Floats
    position: Floats
    velocity: Floats

    def transition_matrix(self, wall_stiffness: Floats, wall_damping: Floats) -> Floats:
        """L (..., N, N) for walls (...)."""
        K, B = np.broadcast_arrays(wall_stiffness, wall_damping)
        feedback = K[..., None] * self.position + B[..., None] * self.velocity
        return self.open - self.input[:, None] * feedback[..., None, :]


def pole_pair(d1: float, d0: float) -> tuple[Floats, float]:
    """A 2 x 2 block with the roots of d^2 + d1 d + d0 in d = z - 1, and its coupling t.

        [[1 + x, t], [-q/t, 1 + x]],    x = -d1/2,   q = d0 - x^2

    A complex pair gives a normal matrix (t = sqrt q), whose eigenvalues are perfectly conditioned.
    """
    x = -d1 / 2.0
    q = d0 - x * x
    # A rigid pair has no scale of its own: any t serves, the eigenvalue solver balances it
    t = float(np.sqrt(abs(q))) or abs(x) or 1.0
    if q < 0.0:
        t = max(t, abs(x))
    return np.array([[1.0 + x, t], [-q / t, 1.0 + x]]), t


def _numerator_input(n1: float, n0: float, d1: float, t: float) -> Floats:
    """Input vector that gives (n1 d + n0)/(d^2 + d1 d + d0) from the first state of `pole_pair`."""
    return np.array([n1, (n0 - d1 / 2.0 * n1) / t])


def realise(rows: Floats, whole_delay: int, split: bool, estimator: Estimator) -> StateSpace:
    """Assemble plant sections, delayed forces and the estimator's factors into one state vector."""
    m = len(rows)
    queue = whole_delay + split
    orders = [2 if row[0] != 0.0 else 1 for row in estimator.denominator]
    N = 2 * m + queue + sum(orders)
    open_, source = np.zeros((N, N)), np.zeros(N)
    position = np.zeros(N)
    first = 2 * m  # states of the force queue: u_{j-1}, u_{j-2}, ...
    for k, (d1, d0, n1, n0, o1, o0) in enumerate(rows):
        at = slice(2 * k, 2 * k + 2)
        open_[at, at], t = pole_pair(d1, d0)
        new, old = _numerator_input(n1, n0, d1, t), _numerator_input(o1, o0, d1, t)
        if whole_delay == 0:
            source[at] = new
        else:
            open_[at, first + whole_delay - 1] = new
        if split:
            open_[at, first + whole_delay] += old
        position[2 * k] = 1.0
    if queue:
        source[first] = 1.0
        open_[np.arange(first + 1, first + queue), np.arange(first, first + queue - 1)] = 1.0
    velocity = _append_estimator(open_, position, first + queue, estimator, orders)
    return StateSpace(open_, source, position, velocity)


def _append_estimator(
    open_: Floats, position: Floats, start: int, estimator: Estimator, orders: list[int]
) -> Floats:
    """Cascade the estimator's factors behind the position; returns the read-out of the velocity.

    Each factor's input is an affine function of the states, so the whole chain stays one matrix.
    """
    signal = position.copy()
    at = start
    for numerator, denominator, order in zip(estimator.numerator, estimator.denominator, orders, strict=True):
        if order == 1:
            (_, c1, c0), d0 = numerator, denominator[2]
            open_[at] += signal
            open_[at, at] += 1.0 - d0
            signal = c1 * signal
            signal[at] += c0 - c1 * d0
        else:
            (c2, c1, c0), (_, d1, d0) = numerator, denominator
            block, t = pole_pair(d1, d0)
            open_[at : at + 2, at : at + 2] += block
            open_[at : at + 2] += np.outer(_numerator_input(1.0, 0.0, d1, t), signal) * (c1 - c2 * d1)
            open_[at : at + 2] += np.outer(_numerator_input(0.0, 1.0, d1, t), signal) * (c0 - c2 * d0)
            signal = c2 * signal
            signal[at] += 1.0
        at += order
    return signal
