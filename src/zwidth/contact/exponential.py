"""The exponential of a small matrix and its integral, compiled.

A linear algebra library shares even a matrix of five rows among threads that wait for each other.
"""

from __future__ import annotations

from typing import Final

from zwidth.arrays import Floats
from zwidth.compiled import compiled_lean

TERMS: Final = 12  # of the series, for matrices up to SMALL: 0.25^13/13! are left
SMALL: Final = 0.25


@compiled_lean
def multiply(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b"""
    N = a.shape[0]
    for i in range(N):
        for j in range(N):
            out[i, j] = 0.0
        for k in range(N):
            value = a[i, k]
            if value != 0.0:
                for j in range(N):
                    out[i, j] += value * b[k, j]


@compiled_lean
def exponential(A: Floats, time: float, size: float, E: Floats, G: Floats, scratch: Floats) -> None:
    """Fill E (N, N) with exp(A time), and G (N, N) with the integral of exp(A t) from 0 to `time`.

    A series gives the mean of exp(A t) over a short time tau, from which both follow, and doubling the rest:

        G(tau) = tau (1 + X/2 (1 + X/3 (1 + ...))),   E(tau) = 1 + A G(tau),   X = A tau
        G(2 t) = G(t) + E(t) G(t),                    E(2 t) = E(t) E(t)

    size     a norm of A time that says how long tau may be. It may be one in units of the states that balance A:
             they change no term of the series
    scratch  (3, N, N)
    """
    step, series, product = scratch[0], scratch[1], scratch[2]
    N, doublings = A.shape[0], 0
    # over so short a time the series converges in TERMS terms without cancellation
    while size > SMALL and doublings < 60:
        size *= 0.5
        doublings += 1
    tau = time / 2.0**doublings
    for i in range(N):
        for j in range(N):
            step[i, j] = tau * A[i, j]
            series[i, j] = 0.0
        series[i, i] = 1.0
    # Horner's scheme: the smallest terms are added first
    for term in range(TERMS, 0, -1):
        multiply(step, series, product)
        for i in range(N):
            for j in range(N):
                series[i, j] = product[i, j] / (term + 1.0)
            series[i, i] += 1.0
    multiply(step, series, E)
    for i in range(N):
        E[i, i] += 1.0
        for j in range(N):
            G[i, j] = tau * series[i, j]
    for _ in range(doublings):
        # G before E, since it needs the E of the shorter time
        multiply(E, G, product)
        for i in range(N):
            for j in range(N):
                G[i, j] += product[i, j]
                series[i, j] = E[i, j]
        multiply(series, series, E)
