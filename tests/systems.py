"""Random plants and loops that span what devices are, and transition matrices built a second way.

Sampling 0.2-20 kHz, modes from 1 Hz to beyond Nyquist, damping 0-150 %, delays 0-3 samples, filters of order
1-4 with cutoffs above 0.02 of Nyquist.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.signal

from zwidth.loop.controller import Butterworth, Controller, FirstOrder
from zwidth.loop.loop import Loop
from zwidth.model.plant import Plant

RATIOS = (0.0, 0.001, 0.01, 0.05, 0.3, 1.0, 1.5)


def mass(kilograms, damping=0.0, stiffness=0.0):
    """One mass, with a dashpot and a spring to the ground."""
    one = np.ones(1)
    return Plant(np.array([[kilograms]]), np.array([[damping]]), np.array([[stiffness]]), one, one, one, ("mass",))


def two_mass(m1, m2, k, b=0.0):
    """Link-side and motor-side mass; the wall acts on and reads the second."""
    link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    wall, hand = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    return Plant(np.diag([m1, m2]), b * link, k * link, wall, wall, hand, ("link", "motor"))


def published(structural=0.00012, **controller):
    """The thesis's Table 3.4, with its sampling period as the text has it."""
    plant = two_mass(0.2616, 0.0254, 15620.0, structural * 15620.0)
    return Loop(plant, Controller(0.00125, **controller))


def random_plant(rng, rate, ratios=RATIOS, kind="chain"):
    """One to four masses in a chain, free or grounded.

    kind "dense" couples their inertia, "coupled" their damping; "apart" reads the first mass and drives the last.
    """
    n = int(rng.integers(2 if kind == "apart" else 1, 5))
    m = 10.0 ** rng.uniform(-2.0, 0.5, n)
    f = 10.0 ** rng.uniform(0.0, np.log10(0.75 * rate), n)
    K = np.zeros((n, n))
    for i in range(n - 1):
        k = (2 * np.pi * f[i]) ** 2 * m[i] * m[i + 1] / (m[i] + m[i + 1])
        K[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    if rng.random() < 0.3:
        K[0, 0] += (2 * np.pi * f[-1]) ** 2 * m[0]
    M = np.diag(m)
    if kind == "dense":
        X = np.diag(np.sqrt(m)) @ (np.eye(n) + 0.3 * rng.normal(size=(n, n)))
        M = X.T @ X
    squared, V = scipy.linalg.eigh(K, M)
    w = np.sqrt(np.where(squared < 1e-12 * squared[-1], 0.0, squared))
    zeta = rng.choice(ratios, n) * rng.uniform(0.5, 1.0, n)
    B = M @ V @ np.diag(2.0 * zeta * w) @ V.T @ M
    if kind == "coupled":
        for i in range(n - 1):
            b = rng.random() * 10.0 ** rng.uniform(-2.0, 0.0) * (np.trace(B) / n + 0.1)
            B[i : i + 2, i : i + 2] += b * np.array([[1.0, -1.0], [-1.0, 1.0]])
    actuator = np.zeros(n)
    actuator[-1] = 1.0
    sensor = np.eye(n)[0] if kind == "apart" else actuator
    return Plant(M, (B + B.T) / 2.0, K, actuator, sensor)


def random_controller(rng, rate, delays=True, filters=True):
    """Delay and filter at a sampling rate."""
    T = 1.0 / rate
    low_pass, pick = None, rng.random()
    if filters and pick < 0.25:
        low_pass = FirstOrder(T * 10.0 ** rng.uniform(-1.0, 1.0))
    elif filters and pick < 0.6:
        rule = str(rng.choice(["tustin", "tustin-prewarped"]))
        low_pass = Butterworth(int(rng.integers(1, 5)), rng.uniform(0.02, 0.9) * rate / 2.0, rule)
    delay = float(rng.choice([0.0, 0.0, 1.0, 2.0, 3.0, rng.uniform(0.0, 3.0)])) if delays else 0.0
    return Controller(T, delay, low_pass)


def random_loop(rng, ratios=RATIOS, kind="chain"):
    """A plant and a controller."""
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    return Loop(random_plant(rng, rate, ratios, kind), random_controller(rng, rate))


def held_step(plant, time):
    """State transition and force response of the plant over `time`, by the exponential of the augmented matrix."""
    n = plant.size
    inverse = np.linalg.inv(plant.mass)
    A = np.zeros((2 * n + 1, 2 * n + 1))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -inverse @ plant.stiffness
    A[n : 2 * n, n : 2 * n] = -inverse @ plant.damping
    A[n : 2 * n, -1] = inverse @ plant.actuator
    # velocities in metres per `time`: entries of one size
    scale = np.concatenate([np.ones(n), np.full(n, time), [1.0]])
    E = scipy.linalg.expm(A * time * scale[:, None] / scale) / scale[:, None] * scale
    return E[: 2 * n, : 2 * n], E[: 2 * n, -1]


def velocity_filter(controller):
    """Numerator and denominator of the low pass by scipy.signal, as second-order sections."""
    T, low_pass = controller.sampling_period, controller.velocity_filter
    if low_pass is None:
        return np.zeros((0, 6))
    if isinstance(low_pass, FirstOrder):
        a = low_pass.time_constant / (low_pass.time_constant + T)
        return np.array([[1.0 - a, 0.0, 0.0, 1.0, -a, 0.0]])
    analog = 2.0 * np.pi * low_pass.cutoff_Hz
    if low_pass.discretisation == "tustin-prewarped":
        analog = 2.0 / T * np.tan(analog * T / 2.0)
    z, p, k = scipy.signal.butter(low_pass.order, analog, analog=True, output="zpk")
    return scipy.signal.zpk2sos(*scipy.signal.bilinear_zpk(z, p, k, 1.0 / T))


def second_matrix(loop, wall_stiffness, wall_damping):
    """The transition matrix of one wall, built from physical states, a queue of forces and direct-form filters.

    Nothing is shared with the package but the plant and the controller.
    """
    plant, controller = loop.plant, loop.controller
    T, n = controller.sampling_period, plant.size
    whole = int(np.floor(controller.delay + 1e-12))
    rest = controller.delay - whole
    F, _ = held_step(plant, T)
    Fr, gr = held_step(plant, (1.0 - rest) * T)
    _, gf = held_step(plant, rest * T) if rest > 1e-12 else (None, np.zeros(2 * n))
    old = Fr @ gf
    filters = velocity_filter(controller)
    queue, states = whole + 1, 2 * n
    N = states + queue + 1 + 2 * len(filters)
    L = np.zeros((N, N))
    y = np.zeros(N)
    y[:n] = plant.sensor
    at = states + queue
    v = (y - np.eye(N)[at]) / T
    L[at] = y
    at += 1
    for b0, b1, b2, _, a1, a2 in filters:
        # transposed direct form II: out = b0 in + s1, s1' = b1 in - a1 out + s2, s2' = b2 in - a2 out
        out = b0 * v + np.eye(N)[at]
        L[at] += b1 * v - a1 * out + np.eye(N)[at + 1]
        L[at + 1] += b2 * v - a2 * out
        v = out
        at += 2
    force = -(wall_stiffness * y + wall_damping * v)
    forces = [force, *np.eye(N)[states : states + queue]]  # u_j, u_{j-1}, ...
    L[:states, :states] += F
    L[:states] += np.outer(gr, forces[whole]) + np.outer(old, forces[whole + 1])
    L[states] = force
    for k in range(1, queue):
        L[states + k] = np.eye(N)[states + k - 1]
    # velocities in metres per sample
    scale = np.ones(N)
    scale[n:states] = T
    return L * scale[:, None] / scale
