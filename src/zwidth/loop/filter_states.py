"""A discrete filter, given by factors, in states: x_{j+1} = (1 + A) x_j + input u_j,  y = output x + direct u."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats
from zwidth.loop.realisation import pole_pair


@dataclass(frozen=True)
class FilterStates:
    """H(z) = direct + output (d - A)^-1 input,  d = z - 1.

    A (k, k), input (k,), output (k,), direct
    """

    A: Floats
    input: Floats
    output: Floats
    direct: float

    def response(self, z: ArrayLike, d: ArrayLike | None = None) -> tuple[Complexes, Complexes]:
        """H(z) and dH/dz (...) at complex z (...); d is z - 1 where that is known to more digits than z has."""
        z = np.asarray(z, dtype=complex)
        away = z - 1.0 if d is None else np.asarray(d, dtype=complex)
        if not len(self.A):
            return np.full(z.shape, complex(self.direct)), np.zeros(z.shape, dtype=complex)
        resolvent = away[..., None, None] * np.eye(len(self.A)) - self.A
        inner = np.linalg.solve(resolvent, np.broadcast_to(self.input[:, None], (*z.shape, len(self.A), 1)))
        slope = -np.linalg.solve(resolvent, inner)
        value_and_slope = self.direct + (self.output @ inner)[..., 0], (self.output @ slope)[..., 0]
        return np.asarray(value_and_slope[0], dtype=complex), np.asarray(value_and_slope[1], dtype=complex)


def filter_states(numerator: Floats, denominator: Floats, window: Floats) -> FilterStates:
    """States of a window and a product of factors in series, the window first.

    numerator, denominator  (k, 3)  rows c2, c1, c0 of  c2 d^2 + c1 d + c0;  denominators monic, of at least the
                                    numerator's degree
    window                  (n,)    weights of the newest to the oldest sample

    >>> half = filter_states(np.empty((0, 3)), np.empty((0, 3)), np.array([0.5, 0.5]))           # (1 + 1/z) / 2
    >>> complex(half.response(2.0)[0])
    (0.75+0j)
    """
    orders = [2 if row[0] != 0.0 else 1 for row in denominator]
    past = len(window) - 1
    N = past + sum(orders)
    A, source = np.zeros((N, N)), np.zeros(N)
    signal, direct = np.zeros(N), float(window[0])
    for k in range(past):
        A[k, k] = -1.0
        if k:
            A[k, k - 1] = 1.0
        else:
            source[0] = 1.0
        signal[k] = window[k + 1]
    at = past
    for (c2, c1, c0), (_, d1, d0), order in zip(numerator, denominator, orders, strict=True):
        if order == 1:
            block, enter, leave, pass_on = np.array([[-d0]]), np.ones(1), np.array([c0 - c1 * d0]), c1
        else:
            pair, t = pole_pair(d1, d0)
            block, pass_on = pair - np.eye(2), c2
            n1, n0 = c1 - c2 * d1, c0 - c2 * d0
            enter, leave = np.array([n1, (n0 - d1 / 2.0 * n1) / t]), np.array([1.0, 0.0])
        here = slice(at, at + order)
        A[here] += np.outer(enter, signal)
        A[here, here] += block
        source[here] += enter * direct
        signal, direct = pass_on * signal, pass_on * direct
        signal[here] += leave
        at += order
    return FilterStates(A, source, signal, float(direct))
