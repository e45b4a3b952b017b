"""Random plants and loops that span what devices are, and transition matrices built a second way.

Sampling 0.2-20 kHz, modes from 1 Hz to beyond Nyquist, damping 0-150 %, delays 0-3 samples, filters of order
1-4 with cutoffs above 0.02 of Nyquist.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.signal

from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    Butterworth,
    CentralDifference,
    Controller,
    FirstOrder,
    Kalman,
    LeastSquaresSlope,
    Loop,
    SavitzkyGolay,
    WindowedDifference,
)
from zwidth.model import LaggedDamper, Operator, Plant, attach

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


def random_method(rng, rate):
    """An estimator of the velocity other than the backward difference."""
    n = int(rng.integers(2, 13))
    methods = [
        WindowedDifference(n),
        LeastSquaresSlope(n),
        CentralDifference(),
        SavitzkyGolay(n + 3, int(rng.integers(1, 4))),
        SavitzkyGolay(2 * (n // 2) + 3, 2, True),
        AlphaBeta(float(rng.uniform(0.1, 0.9)), float(rng.uniform(0.01, 0.5))),
        Kalman(10.0 ** rng.uniform(-3.0, 1.0) * rate**2 * 1e-5, 1e-5),
    ]
    return methods[int(rng.integers(len(methods)))]


def with_lagged_dampers(rng, plant, rate):
    """The plant with one or two electrical dampers, from much faster than the sampling to much slower."""
    size = np.sqrt(np.trace(plant.mass) * (np.trace(plant.stiffness) + 1.0))
    dampers = [
        LaggedDamper(rng.normal(size=plant.size), size * 10.0 ** rng.uniform(-2, 0.5), tau)
        for tau in 10.0 ** rng.uniform(-1.5, 1.5, int(rng.integers(1, 3))) / rate
    ]
    return replace(plant, lagged_dampers=tuple(dampers))


def random_operator(rng):
    """A hand, held rigidly or not."""
    arm = (rng.uniform(0.1, 2.0), 10.0 ** rng.uniform(1.0, 3.0), 10.0 ** rng.uniform(0.0, 1.5))
    if rng.random() < 0.4:
        return Operator(*arm)
    return Operator(*arm, 10.0 ** rng.uniform(2.5, 4.5), 10.0 ** rng.uniform(-0.5, 2.0))


FEATURES = ("lag", "electrical", "estimator", "force-filter", "operator")


def random_loop(rng, ratios=RATIOS, kind="chain", features=()):
    """A plant and a controller, with every one of the features named."""
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    plant, controller = random_plant(rng, rate, ratios, kind), random_controller(rng, rate)
    if "lag" in features:
        controller = replace(controller, actuator_time_constant=10.0 ** rng.uniform(-2.0, 1.0) / rate)
    if "estimator" in features:
        controller = replace(controller, velocity=random_method(rng, rate))
    if "force-filter" in features:
        low_pass = Butterworth(int(rng.integers(1, 4)), rng.uniform(0.1, 0.9) * rate / 2.0)
        controller = replace(controller, force_filter=low_pass)
    if "electrical" in features:
        plant = with_lagged_dampers(rng, plant, rate)
    if "operator" in features:
        plant = attach(replace(plant, handle=np.eye(plant.size)[0]), random_operator(rng))
    return Loop(plant, controller)


def generator(plant, lag=0.0):
    """A and input of [x, x', forces of lagged dampers, actuator force if it lags], and how many coordinates come
    first."""
    n, dampers = plant.size, plant.lagged_dampers
    m = n * 2 + len(dampers) + (lag > 0.0)
    inverse = np.linalg.inv(plant.mass)
    A, source = np.zeros((m, m)), np.zeros(m)
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -inverse @ plant.stiffness
    A[n : 2 * n, n : 2 * n] = -inverse @ plant.damping
    for i, damper in enumerate(dampers):
        at = 2 * n + i
        A[n : 2 * n, at] = -inverse @ damper.along
        A[at, n : 2 * n] = damper.damping / damper.time_constant * damper.along
        A[at, at] = -1.0 / damper.time_constant
    if lag > 0.0:
        A[n : 2 * n, -1] = inverse @ plant.actuator
        A[-1, -1], source[-1] = -1.0 / lag, 1.0 / lag
    else:
        source[n : 2 * n] = inverse @ plant.actuator
    return A, source


def held_step(plant, time, lag=0.0):
    """State transition and force response of the plant over `time`, by the exponential of the augmented matrix."""
    A, source = generator(plant, lag)
    m = len(A)
    whole = np.zeros((m + 1, m + 1))
    whole[:m, :m], whole[:m, -1] = A, source
    # velocities in metres per `time`: entries of one size
    scale = np.ones(m + 1)
    scale[plant.size : 2 * plant.size] = time
    E = scipy.linalg.expm(whole * time * scale[:, None] / scale) / scale[:, None] * scale
    return E[:m, :m], E[:m, -1]


def low_pass_sections(low_pass, T):
    """Numerator and denominator of a low pass by scipy.signal, as second-order sections."""
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


def velocity_filter(controller):
    """The velocity filter's sections."""
    return low_pass_sections(controller.velocity_filter, controller.sampling_period)


def velocity_weights(method, T):
    """Weights of the readings, newest first, of the estimators that are a window; None for the others."""
    match method:
        case BackwardDifference():
            return np.array([1.0, -1.0]) / T
        case CentralDifference():
            return np.array([1.0, 0.0, -1.0]) / (2.0 * T)
        case WindowedDifference(n):
            return np.array([1.0, *np.zeros(n - 1), -1.0]) / (n * T)
        case LeastSquaresSlope(n):
            times = -np.arange(n) * T
            return (times - times.mean()) / np.sum((times - times.mean()) ** 2)
        case SavitzkyGolay(n, order, centred):
            at = (n - 1) / 2 if centred else n - 1
            return scipy.signal.savgol_coeffs(n, order, deriv=1, delta=T, pos=at, use="dot")[::-1]
    return None


class StateSpaceBuilder:
    """A linear system under construction: rows of its transition matrix, signals as functions of its states."""

    def __init__(self, size):
        self.L, self.used = np.zeros((size, size)), 0

    def add(self, count):
        self.used += count
        return range(self.used - count, self.used)

    def signal(self, at):
        return np.eye(len(self.L))[at]

    def filtered(self, signal, sections):
        # transposed direct form II: out = b0 in + s1, s1' = b1 in - a1 out + s2, s2' = b2 in - a2 out
        for b0, b1, b2, _, a1, a2 in sections:
            one, two = self.add(2)
            out = b0 * signal + self.signal(one)
            self.L[one] += b1 * signal - a1 * out + self.signal(two)
            self.L[two] += b2 * signal - a2 * out
            signal = out
        return signal

    def past(self, signal, count):
        signals = [signal]
        for at in self.add(count):
            self.L[at] += signals[-1]
            signals.append(self.signal(at))
        return signals


def reference_transition_matrix(loop, wall_stiffness, wall_damping):
    """The transition matrix of one wall, built from physical states, a queue of forces and direct-form filters.

    Nothing is shared with the package but the plant and the controller.
    """
    plant, controller = loop.plant, loop.controller
    T, lag = controller.sampling_period, controller.actuator_time_constant
    whole = int(np.floor(controller.delay + 1e-12))
    rest = controller.delay - whole
    F, _ = held_step(plant, T, lag)
    Fr, gr = held_step(plant, (1.0 - rest) * T, lag)
    old = Fr @ held_step(plant, rest * T, lag)[1] if rest > 1e-12 else np.zeros(len(F))
    low_pass, on_force = velocity_filter(controller), low_pass_sections(controller.force_filter, T)
    weights = velocity_weights(controller.velocity, T)
    memory = 2 if weights is None else len(weights) - 1
    system = StateSpaceBuilder(len(F) + whole + 1 + memory + 2 * len(low_pass) + 2 * len(on_force))
    plant_states = system.add(len(F))
    y = sum(c * system.signal(at) for c, at in zip(plant.sensor, plant_states, strict=False))
    if weights is None:
        position, speed = system.add(2)
        method = controller.velocity
        method = method.alpha_beta(T) if isinstance(method, Kalman) else method
        alpha, beta = method.alpha, method.beta
        predicted = system.signal(position) + T * system.signal(speed)
        system.L[position] += predicted + alpha * (y - predicted)
        v = system.signal(speed) + beta / T * (y - predicted)
        system.L[speed] += v
    else:
        v = sum(w * past for w, past in zip(weights, system.past(y, memory), strict=True))
    force = -(wall_stiffness * y + wall_damping * system.filtered(v, low_pass))
    forces = system.past(system.filtered(force, on_force), whole + 1)
    states = slice(0, len(F))
    system.L[states, states] += F
    system.L[states] += np.outer(gr, forces[whole]) + np.outer(old, forces[whole + 1])
    # velocities in metres per sample
    scale = np.ones(len(system.L))
    scale[plant.size : 2 * plant.size] = T
    return system.L * scale[:, None] / scale
