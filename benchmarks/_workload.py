"""A fixed piece of work in NumPy and Python, by whose processor time the times of cases are divided.

A case of zwidth takes so many times as long as this on one machine, and nearly as many on another: a slow or
throttled processor makes both slower. For that it is made of what the cases are made of, a third each:

- many calls of NumPy on arrays of a few numbers, where what a call costs matters, as in setting up one loop;
- a few calls on arrays of thousands of complex numbers, as in a batch, where arithmetic and memory matter;
- Python's own instructions: loops, dictionaries, function calls, as in reading and checking a device.

It uses nothing of zwidth, so that no change of ours alters it, and no random numbers. One run takes some 25 ms on
a usual processor: long beside what a clock resolves, short beside the time between two stalls of a busy machine.
Whoever changes it measures all kept ratios again, for they are multiples of it.
"""

from __future__ import annotations

import numpy as np

SMALL_CALLS = 450
POINTS, ORDER, EVALUATIONS = 16_384, 12, 16
ADDITIONS = 80_000


def fixed_work() -> float:
    """Carry out the work once; a number that depends on all of it, the same at each call.

    >>> fixed_work() == fixed_work()
    True
    """
    return _small_arrays() + _large_arrays() + _instructions()


def _small_arrays() -> float:
    """Discretise a plant of two masses for many sampling periods, by a series, and take eigenvalues."""
    A = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [-40.0, 40.0, -0.2, 0.2], [90.0, -95.0, 0.4, -0.5]])
    total, eye = 0.0, np.eye(4)
    for k in range(SMALL_CALLS):
        step = A * (1e-3 + 1e-6 * k)
        square = step @ step
        transition = eye + step + 0.5 * square + (step @ square) / 6.0
        total += float(np.abs(np.linalg.eigvals(transition)).max())
        total += float(np.linalg.solve(transition, eye[0])[0])
    return total


def _large_arrays() -> float:
    """Evaluate polynomials on the unit circle by Horner's rule, and sort what they give."""
    z = np.exp(1j * np.linspace(0.0, np.pi, POINTS))
    total = 0.0
    for k in range(EVALUATIONS):
        value = np.full(POINTS, 1.0 + 0.1 * k, dtype=complex)
        for power in range(ORDER):
            value = value * z + (0.5 - 0.03 * power)
        size = np.sort(np.abs(value))
        total += float(np.cumsum(size)[-1] + np.hypot(value.real, value.imag)[-1])
    return total


def _instructions() -> float:
    """Count, add and look up numbers by name in a loop."""
    found: dict[str, float] = {}
    names = [f"key-{k % 97}" for k in range(97)]

    def added(name: str, value: float) -> float:
        return found.get(name, 0.0) + 0.5 * value

    for k in range(ADDITIONS):
        name = names[k % 97]
        found[name] = added(name, float(k))
        if found[name] > 1e6:
            found[name] -= 1e6
    return sum(found.values())
