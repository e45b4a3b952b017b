"""A loop computed a second way by plain NumPy: its curve of walls, its lines of real roots, its numbers.

Nothing is shared with the package but the plant and the controller: the plant is sampled by the exponential of its
matrix (`systems.held_step`), filters and estimates are evaluated by their own formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import mpmath
import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from tests.systems import FEATURES, random_loop, reference_transition_matrix, velocity_weights
from zwidth.loop import FirstOrder, Kalman

KINDS = ("chain", "dense", "coupled", "apart")
GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(10)
# Values at the nodes -> derivative there, of the polynomial through them
_POWERS = np.polynomial.legendre.legvander(GAUSS, 9)
_DERIVATIVES = [np.polynomial.legendre.legder(one) for one in np.eye(10)]
_SLOPES = np.column_stack([np.polynomial.legendre.legval(GAUSS, one) for one in _DERIVATIVES])
SLOPES = _SLOPES @ np.linalg.inv(_POWERS)


def loop_of_every_kind(seed, number):
    """A random loop with each of the features with a probability of 0.3, from a generator of its own."""
    rng = np.random.default_rng([seed, number])
    chosen = [name for name in FEATURES if rng.random() < 0.3]
    return random_loop(rng, kind=str(rng.choice(KINDS)), features=chosen)


def low_pass_response(low_pass, d, T):
    """Of a low pass at z = 1 + d, from its poles in s."""
    if low_pass is None:
        return np.ones_like(d)
    if isinstance(low_pass, FirstOrder):
        share = T / (low_pass.time_constant + T)
        return share * (1.0 + d) / (d + share)
    corner = 2.0 * np.pi * low_pass.cutoff_Hz
    if low_pass.discretisation == "tustin-prewarped":
        corner = 2.0 / T * np.tan(corner * T / 2.0)
    # s / corner = c / (z + 1): the response multiplied by z + 1 to a power, so that z = -1 is no exception
    c, sum_, n = 2.0 / (T * corner) * d, d + 2.0, low_pass.order
    response = np.ones_like(d)
    for k in range(n // 2):
        response = response * sum_**2 / (c * c + 2.0 * np.sin(np.pi * (2 * k + 1) / (2 * n)) * c * sum_ + sum_**2)
    return response * sum_ / (c + sum_) if n % 2 else response


@dataclass(frozen=True)
class ApartLoop:
    """A loop of the package, computed apart from it."""

    loop: object

    @property
    def guide(self):
        """The loop by which crossings of the axes are found."""
        return self

    @cached_property
    def sampled(self):
        """F - 1 of the plant in complex Schur form, the force's effect now and one sample later, the sensor."""
        plant, controller = self.loop.plant, self.loop.controller
        A, source, sensor = modal_generator(plant, controller.actuator_time_constant, controller.sampling_period)
        rest = controller.delay - self.whole
        now = integral(A, 1.0 - rest)
        later = integral(A, 1.0) - now if rest > 0.0 else np.zeros_like(A)
        triangle, basis = scipy.linalg.schur(A @ integral(A, 1.0), output="complex")
        back = basis.conj().T
        return triangle, back @ (now @ source), back @ (later @ source), sensor @ basis

    @property
    def whole(self):
        """Whole samples of delay."""
        return int(np.floor(self.loop.controller.delay + 1e-12))

    def plant_response(self, d):
        """P (k,) at z = 1 + d (k,)."""
        triangle, now, later, sensor = self.sampled
        z, n = 1.0 + d, len(now)
        state, out = [None] * n, np.zeros_like(d)
        for i in reversed(range(n)):
            right = now[i] + later[i] / z
            for j in range(i + 1, n):
                right = right + triangle[i, j] * state[j]
            away = d - triangle[i, i]
            state[i] = right / np.where(away == 0.0, 1e-30, away)
            out = out + sensor[i] * state[i]
        controller = self.loop.controller
        return out * z**-self.whole * low_pass_response(controller.force_filter, d, controller.sampling_period)

    def velocity_response(self, d):
        """w (k,) at z = 1 + d (k,)."""
        controller = self.loop.controller
        T, method = controller.sampling_period, controller.velocity
        weights, z = velocity_weights(method, T), 1.0 + d
        if weights is None:
            method = method.alpha_beta(T) if isinstance(method, Kalman) else method
            a, b = method.alpha, method.beta
            estimate = b / T * z * d / (d * d + (a + b) * d + b)
        else:
            # the weights sum to zero: sums of them with (1/z)^k - 1 = -(d/z) (1 + 1/z + ... )
            tails = np.cumsum(weights[::-1])[::-1][1:]
            estimate = -d / z * sum(tail * z ** -float(k) for k, tail in enumerate(tails))
        return estimate * low_pass_response(controller.velocity_filter, d, T)

    def walls(self, thetas):
        """K and B (k,) with a pair of roots at exp(+-i theta)."""
        thetas = np.atleast_1d(np.asarray(thetas, dtype=float))
        d = -2.0 * np.sin(0.5 * thetas) ** 2 + 1j * np.sin(thetas)
        with np.errstate(all="ignore"):
            h, w = -1.0 / self.plant_response(d), self.velocity_response(d)
            B = h.imag / w.imag
            return h.real - B * w.real, B

    def end_wall(self, theta, step):
        """K and B at one angle; at 0 and pi, where both are even functions, drawn on from two angles beside it."""
        end = 0.0 if theta < 1.0 else np.pi
        if abs(theta - end) > 1e-7 * step:
            return tuple(float(x[0]) for x in self.walls(theta))
        near = abs(end - 0.03 * step * np.array([1.0, 2.0]))
        return tuple(float((4.0 * x[0] - x[1]) / 3.0) for x in self.walls(near))

    @cached_property
    def plus(self):
        """K of the walls with a root at z = 1."""
        plant = self.loop.plant
        scale = np.sqrt(np.outer(np.diag(plant.mass), np.diag(plant.mass)))
        squared = np.linalg.eigvalsh(plant.stiffness / scale)
        if abs(squared[0]) < 1e-13 * abs(squared[-1]) or squared[-1] == 0.0:
            return 0.0
        return -1.0 / float(plant.sensor @ np.linalg.solve(plant.stiffness, plant.actuator))

    @cached_property
    def minus(self):
        """Of the walls with a root at z = -1, K + B w = h: w and h; both inf where there are none."""
        d = np.array([-2.0 + 0.0j])
        with np.errstate(all="ignore"):
            h, w = -1.0 / self.plant_response(d)[0].real, self.velocity_response(d)[0].real
        return (w, h) if np.isfinite(h) and np.isfinite(w) else (np.inf, np.inf)

    @cached_property
    def matrices(self):
        """L0, LK, LB of the transition matrix L0 + K LK + B LB, and the sizes of K and B by which it was built."""
        plant, T = self.loop.plant, self.loop.controller.sampling_period
        inertia = 1.0 / (plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
        K, B = inertia / T**2, inertia / T
        L0 = reference_transition_matrix(self.loop, 0.0, 0.0)
        LK, LB = (reference_transition_matrix(self.loop, *wall) - L0 for wall in ((K, 0.0), (0.0, B)))
        return L0, LK / K, LB / B

    def roots(self, K, B):
        """Eigenvalues (k, N) of walls (k,)."""
        L0, LK, LB = self.matrices
        return np.linalg.eigvals(L0 + np.multiply.outer(K, LK) + np.multiply.outer(B, LB))

    def radii(self, K, B):
        """Spectral radii (k,) of walls (k,) by eigenvalues."""
        return np.abs(self.roots(K, B)).max(axis=-1)


def modal_generator(plant, lag, T):
    """A T and input of the actuator's force T, and the sensor, of the plant in modes of 30 digits.

    The states are q and q' / w of each mode beside each other, w its angular frequency, then the forces of lagged
    dampers and the actuator's force if it lags.
    """
    n, dampers = plant.size, plant.lagged_dampers
    with mpmath.workdps(30):
        lower = mpmath.cholesky(mpmath.matrix(plant.mass.tolist()))
        inverse = mpmath.inverse(lower)
        squared, turn = mpmath.eigsy(inverse * mpmath.matrix(plant.stiffness.tolist()) * inverse.T)
        V = inverse.T * turn
        most = max(abs(x) for x in squared)
        squared = np.array([float(x) if abs(x) > most * mpmath.mpf(10) ** -14 else 0.0 for x in squared])
        damping = np.array((V.T * mpmath.matrix(plant.damping.tolist()) * V).tolist(), dtype=float)

        def modal(vector):
            return np.array((V.T * mpmath.matrix(vector.tolist())).tolist(), dtype=float)[:, 0]

        push, sensor = modal(plant.actuator), modal(plant.sensor)
        along = [modal(damper.along) for damper in dampers]
    rate = np.where(squared == 0.0, 1.0 / T, np.sqrt(np.abs(squared)))
    m = 2 * n + len(dampers) + (lag > 0.0)
    A, source, out = np.zeros((m, m)), np.zeros(m), np.zeros(m)
    x, v = np.arange(0, 2 * n, 2), np.arange(1, 2 * n, 2)
    A[x, v], A[v, x] = rate, -squared / rate
    A[np.ix_(v, v)] = -damping * rate / rate[:, None]
    for i, damper in enumerate(dampers):
        at = 2 * n + i
        A[v, at] = -along[i] / rate
        A[at, v] = damper.damping / damper.time_constant * along[i] * rate
        A[at, at] = -1.0 / damper.time_constant
    if lag > 0.0:
        A[v, -1], A[-1, -1], source[-1] = push / rate, -1.0 / lag, 1.0 / lag
    else:
        source[v] = push / rate
    out[x] = sensor
    # forces in the units of the masses' motions
    size = np.ones(m)
    size[2 * n :] = max(np.abs(A[v][:, 2 * n :]).max(initial=0.0) * T, 1e-300)
    A, source = A / size * size[:, None], source * size
    return A * T, source * T, out


def integral(A, time):
    """The integral of exp(A s) ds from 0 to `time`."""
    n = len(A)
    whole = np.zeros((2 * n, 2 * n))
    whole[:n, :n], whole[:n, n:] = A, np.eye(n)
    return scipy.linalg.expm(whole * time)[:n, n:]


def straight_area(K0, B0, K1, B1):
    """Integral of K dB along a chord, over its part with K > 0 and B > 0."""
    cuts = [0.0, 1.0]
    for a, b in ((K0, K1), (B0, B1)):
        if a * b < 0.0:
            cuts.append(a / (a - b))
    cuts, total = sorted(cuts), 0.0
    for low, high in pairwise(cuts):
        middle = 0.5 * (low + high)
        K, B = K0 + middle * (K1 - K0), B0 + middle * (B1 - B0)
        if K > 0.0 and B > 0.0:
            total += K * (high - low) * (B1 - B0)
    return total


def curve_area(apart, angles):
    """The same along a piece of the curve, by Gauss's rule between angles one after the other and crossings of the
    axes."""
    low, high = np.array(angles[:-1]), np.array(angles[1:])
    nodes = (0.5 * (low + high))[:, None] + 0.5 * (high - low)[:, None] * np.append(GAUSS, [-0.9999, 0.9999])
    nodes.sort(axis=1)
    components = [values.reshape(nodes.shape) for values in apart.guide.walls(nodes.ravel())]
    cuts = []
    for component, values in enumerate(components):

        def value(theta, component=component):
            return apart.guide.walls(theta)[component][0]

        for i, j in np.argwhere(values[:, :-1] * values[:, 1:] < 0.0):
            cuts.append(brentq(value, nodes[i, j], nodes[i, j + 1], xtol=1e-17, rtol=1e-15))
    every = np.unique(np.concatenate([angles, cuts]))
    every = every if angles[0] < angles[-1] else every[::-1]
    low, high = every[:-1], every[1:]
    nodes = (0.5 * (low + high))[:, None] + 0.5 * (high - low)[:, None] * GAUSS
    K, B = (values.reshape(nodes.shape) for values in apart.walls(nodes.ravel()))
    inside = (np.median(K, axis=1) > 0.0) & (np.median(B, axis=1) > 0.0)
    return float(np.sum(np.where(inside, ((B @ SLOPES.T) * K) @ WEIGHTS, 0.0)))


class ExactLoop(ApartLoop):
    """The same to thirty digits and more, of the plant as its doubles have it: slow."""

    DIGITS = 90

    @cached_property
    def guide(self):
        return ApartLoop(self.loop)

    @cached_property
    def poles(self):
        """z - 1 of the sampled plant's poles."""
        plant, controller = self.loop.plant, self.loop.controller
        with mpmath.workdps(self.DIGITS):
            A, _ = exact_generator(plant, controller)
            return [mpmath.expm1(p * controller.sampling_period) for p in mpmath.eig(A, left=False, right=False)]

    @cached_property
    def exactly_sampled(self):
        """F - 1, what a force of 1 N does now and one sample later, and the sensor; free motions count, too."""
        plant, controller = self.loop.plant, self.loop.controller
        with mpmath.workdps(self.DIGITS):
            A, source = exact_generator(plant, controller)
            T, n = mpmath.mpf(controller.sampling_period), A.rows
            rest = mpmath.mpf(controller.delay) - self.whole
            forced = mpmath.zeros(n + 1)
            forced[:n, :n], forced[:n, n] = A, source

            def held(time):
                both = mpmath.expm(forced * time)
                return both[:n, :n], both[:n, n]

            (F, whole), (_, now) = held(T), held((1 - rest) * T)
            sensor = mpmath.zeros(1, n)
            for i in range(plant.size):
                sensor[i] = plant.sensor[i]
            return F - mpmath.eye(n), now, whole - now, sensor

    def exact_terms(self, d):
        """P and w at z = 1 + d, as numbers of mpmath."""
        controller = self.loop.controller
        T = mpmath.mpf(controller.sampling_period)
        moved, now, later, sensor = self.exactly_sampled
        z = 1 + d
        P = (sensor * mpmath.lu_solve(d * mpmath.eye(moved.rows) - moved, now + later / z))[0]
        P *= z**-self.whole * exact_low_pass(controller.force_filter, d, T)
        method = controller.velocity
        weights = velocity_weights(method, 1.0)
        if weights is None:
            method = method.alpha_beta(controller.sampling_period) if isinstance(method, Kalman) else method
            a, b = mpmath.mpf(method.alpha), mpmath.mpf(method.beta)
            w = b / T * z * d / (d * d + (a + b) * d + b)
        else:
            weights = [mpmath.mpf(x) for x in weights]
            weights[0] -= sum(weights)
            w = sum(x * z**-k for k, x in enumerate(weights)) / T
        return P, w * exact_low_pass(controller.velocity_filter, d, T)

    def exact_wall(self, theta):
        """K and B with a pair of roots at exp(+-i theta), as numbers of mpmath."""
        P, w = self.exact_terms(mpmath.expm1(mpmath.mpc(0, theta)))
        h = -1 / P
        B = h.imag / w.imag
        return h.real - B * w.real, B

    def radius(self, K, B, roots, moved=0.0):
        """Largest |z| - 1 of the roots of 1 + P (K + B w) nearest to numbers given; -1 if there are none.

        moved  how far a root has to be from the plant's poles to count
        """
        sampled = self.poles
        with mpmath.workdps(50):
            K, B, largest = mpmath.mpf(float(K)), mpmath.mpf(float(B)), -1.0

            def characteristic(d):
                P, w = self.exact_terms(d)
                return 1 / P + K + B * w

            for root in roots:
                start = mpmath.mpc(complex(root)) - 1
                try:
                    beside = start * (1 + mpmath.mpf(10) ** -10)
                    d = mpmath.findroot(characteristic, (start, beside), tol=1e-60, maxsteps=40, verify=False)
                except (ZeroDivisionError, ValueError):
                    continue
                if abs(d - start) < 1e-4 and min(abs(d - pole) for pole in sampled) >= moved:
                    largest = max(largest, float(abs(1 + d) - 1))
        return largest

    @cached_property
    def exact_plus(self):
        """`plus` as a number of mpmath."""
        plant = self.loop.plant
        if ApartLoop(self.loop).plus == 0.0:
            return mpmath.mpf(0)
        with mpmath.workdps(self.DIGITS):
            bent = mpmath.lu_solve(mpmath.matrix(plant.stiffness.tolist()), mpmath.matrix(plant.actuator.tolist()))
            return -1 / sum(mpmath.mpf(float(c)) * x for c, x in zip(plant.sensor, bent, strict=True))

    def walls(self, thetas):
        with mpmath.workdps(self.DIGITS):
            both = [self.exact_wall(mpmath.mpf(float(t))) for t in np.atleast_1d(thetas)]
            return tuple(np.array([float(wall[c]) for wall in both]) for c in range(2))


def hold(pole, time):
    """Integral of exp(pole s) ds from 0 to `time`."""
    return mpmath.expm1(pole * time) / pole if pole else time


def exact_low_pass(low_pass, d, T):
    """`low_pass_response` as a number of mpmath."""
    if low_pass is None:
        return mpmath.mpf(1)
    if isinstance(low_pass, FirstOrder):
        share = T / (mpmath.mpf(low_pass.time_constant) + T)
        return share * (1 + d) / (d + share)
    corner = 2 * mpmath.pi * mpmath.mpf(low_pass.cutoff_Hz)
    if low_pass.discretisation == "tustin-prewarped":
        corner = 2 / T * mpmath.tan(corner * T / 2)
    c, sum_, n, response = 2 / (T * corner) * d, d + 2, low_pass.order, mpmath.mpf(1)
    for k in range(n // 2):
        response *= sum_**2 / (c * c + 2 * mpmath.sin(mpmath.pi * (2 * k + 1) / (2 * n)) * c * sum_ + sum_**2)
    return response * sum_ / (c + sum_) if n % 2 else response


def exact_generator(plant, controller):
    """`systems.generator` as matrices of mpmath."""
    n, lag, dampers = plant.size, controller.actuator_time_constant, plant.lagged_dampers
    m = 2 * n + len(dampers) + (lag > 0.0)
    inverse = mpmath.inverse(mpmath.matrix(plant.mass.tolist()))
    A, source = mpmath.zeros(m, m), mpmath.zeros(m, 1)

    def put(rows, at, block):
        for i in range(block.rows):
            for j in range(block.cols):
                A[rows + i, at + j] = block[i, j]

    put(0, n, mpmath.eye(n))
    put(n, 0, -inverse * mpmath.matrix(plant.stiffness.tolist()))
    put(n, n, -inverse * mpmath.matrix(plant.damping.tolist()))
    push = inverse * mpmath.matrix(plant.actuator.tolist())
    for k, damper in enumerate(dampers):
        along, tau = mpmath.matrix(damper.along.tolist()), mpmath.mpf(damper.time_constant)
        put(n, 2 * n + k, -inverse * along)
        put(2 * n + k, n, along.T * (mpmath.mpf(damper.damping) / tau))
        A[2 * n + k, 2 * n + k] = -1 / tau
    if lag > 0.0:
        put(n, m - 1, push)
        A[m - 1, m - 1] = -1 / mpmath.mpf(lag)
        source[m - 1] = 1 / mpmath.mpf(lag)
    else:
        for i in range(n):
            source[n + i] = push[i]
    return A, source
