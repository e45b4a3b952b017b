"""Linear loops in time: powers of their transition matrix in long double, from exponentials of 40 digits.

Nothing is shared with the package but the plant and the controller.
"""

from __future__ import annotations

import mpmath
import numpy as np

from tests.systems import StateSpaceBuilder, low_pass_sections, velocity_filter, velocity_weights
from zwidth.loop import Kalman

LONG = np.longdouble


def fine_held_step(plant, time, lag=0.0):
    """State transition and force response over `time`, with 19 digits."""
    mpmath.mp.dps = 40
    n, dampers = plant.size, plant.lagged_dampers
    m = 2 * n + len(dampers) + (lag > 0.0)
    A = mpmath.zeros(m + 1, m + 1)
    inverse = mpmath.matrix(plant.mass.tolist()) ** -1
    by_place, by_speed = (
        inverse * mpmath.matrix(plant.stiffness.tolist()),
        inverse * mpmath.matrix(plant.damping.tolist()),
    )
    pushed = inverse * mpmath.matrix(plant.actuator.tolist())
    for i in range(n):
        A[i, n + i] = 1
        A[n + i, m - 1 if lag > 0.0 else m] = pushed[i]
        for k in range(n):
            A[n + i, k], A[n + i, n + k] = -by_place[i, k], -by_speed[i, k]
    for e, damper in enumerate(dampers):
        at, along = 2 * n + e, inverse * mpmath.matrix(damper.along.tolist())
        for i in range(n):
            A[n + i, at] = -along[i]
            A[at, n + i] = (
                mpmath.mpf(damper.damping) / mpmath.mpf(damper.time_constant) * mpmath.mpf(damper.along[i])
            )
        A[at, at] = -1 / mpmath.mpf(damper.time_constant)
    if lag > 0.0:
        A[m - 1, m - 1], A[m - 1, m] = -1 / mpmath.mpf(lag), 1 / mpmath.mpf(lag)
    E = mpmath.expm(A * mpmath.mpf(time))
    whole = np.array([[LONG(mpmath.nstr(E[i, k], 25)) for k in range(m + 1)] for i in range(m)])
    return whole[:, :m], whole[:, m]


def fine_matrix(loop, stiffness, damping):
    """The transition matrix of one wall in long double, how many of its states are the plant's, how many readings
    the estimate remembers, and whether it is a tracker.

    Physical states, a queue of forces, filters in direct form, windows as queues of readings.
    """
    plant, controller = loop.plant, loop.controller
    T, lag = controller.sampling_period, controller.actuator_time_constant
    whole = int(np.floor(controller.delay + 1e-12))
    rest = controller.delay - whole if controller.delay - whole > 1e-12 else 0.0
    F, _ = fine_held_step(plant, T, lag)
    Fr, gr = fine_held_step(plant, mpmath.mpf(T) * (1 - mpmath.mpf(rest)), lag)
    old = Fr @ fine_held_step(plant, mpmath.mpf(T) * mpmath.mpf(rest), lag)[1] if rest else np.zeros(len(F), LONG)
    low_pass, on_force = velocity_filter(controller), low_pass_sections(controller.force_filter, T)
    weights = velocity_weights(controller.velocity, T)
    memory = 2 if weights is None else len(weights) - 1
    system = StateSpaceBuilder(len(F) + whole + 1 + memory + 2 * len(low_pass) + 2 * len(on_force))
    system.L = system.L.astype(LONG)
    plant_states = system.add(len(F))
    y = sum(LONG(c) * system.signal(at) for c, at in zip(plant.sensor, plant_states, strict=False))
    if weights is None:
        method = controller.velocity
        method = method.alpha_beta(T) if isinstance(method, Kalman) else method
        position, speed = system.add(2)
        predicted = system.signal(position) + LONG(T) * system.signal(speed)
        system.L[position] += predicted + LONG(method.alpha) * (y - predicted)
        v = system.signal(speed) + LONG(method.beta) / LONG(T) * (y - predicted)
        system.L[speed] += v
    else:
        v = sum(LONG(w) * past for w, past in zip(weights, system.past(y, memory), strict=True))
    force = -(LONG(stiffness) * y + LONG(damping) * system.filtered(v, low_pass))
    forces = system.past(system.filtered(force, on_force), whole + 1)
    states = slice(0, len(F))
    system.L[states, states] += F
    system.L[states] += np.outer(gr, forces[whole]) + np.outer(old, forces[whole + 1])
    return system.L, len(F), memory, weights is None


def fine_readings(loop, stiffness, damping, x, v, samples):
    """Readings of a linear loop from place x and velocity v (n,), and the largest coordinate on the way."""
    n = loop.plant.size
    L, first, memory, tracking = fine_matrix(loop, stiffness, damping)
    Z = np.zeros(len(L), LONG)
    Z[:n], Z[n : 2 * n] = x, v
    # the estimate has seen the first reading for ever
    Z[first : first + (1 if tracking else memory)] = loop.plant.sensor @ np.asarray(x)
    readings, largest = np.empty(samples), 0.0
    for j in range(samples):
        readings[j] = loop.plant.sensor.astype(LONG) @ Z[:n]
        largest = max(largest, float(np.abs(Z[:n]).max()))
        Z = L @ Z
    return readings, largest
