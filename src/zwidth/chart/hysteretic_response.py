"""The sampled response of a plant with hysteretic damping on the unit circle, at any angle and to rounding.

    P(e^{iwT}) = sum_k G(i w_k) H(i w_k) / T,    w_k = w + 2 pi k/T

    G(iw) = sensor . (K + i sign(w) L - w^2 M + i w B)^-1 actuator
    H(s) = e^{-f s T} (1 - e^{-sT}) / (s (tau s + 1))

with a delay of f samples and an actuator lag tau. The sum is taken as the exact response of a plant with viscous
damping instead, plus the difference of the two, which falls off like k^-4. Aliases whose frequencies lie near a
natural frequency are summed at each angle. The sum of all others is analytic in theta to two lengths beyond either
end of [0, pi], and so a polynomial in theta. G is taken in modal coordinates, where a rigid motion is exactly
free: in the plant's own, rounding of the stiffest spring would hold it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Chebyshev

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.nyquist import terms_along
from zwidth.loop.circle_factors import circle_factors
from zwidth.loop.factor_response import factor_response
from zwidth.loop.filters import force_filter
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import table_of_loops
from zwidth.model.modes import RIGID, undamped_modes
from zwidth.model.plant import Plant

# Pairs of aliases summed, and how many for each that the highest natural frequency lies above: what is left out
# falls off with the third power.
FEWEST, PER_FOLD = 400, 20
# An alias is smooth if all natural frequencies are farther than this from the middle of its frequencies, in
# sampling rates: 2.5 pi are five half-lengths of [0, pi], by which Chebyshev's coefficients fall by 5 + sqrt 24
# each.
SMOOTH, DEGREE = 1.25, 18
UNIT = 1e-14  # a few roundings
CHUNK = 2000  # angles at a time, for memory's sake


def viscous_equivalent(plant: Plant) -> Plant:
    """The plant with dampers in place of its hysteresis, with the same loss in each mode at its own frequency.

    M V diag(l_i / |w_i|) V^T M, with mass-normalised modes V and l_i = v_i^T L v_i; rigid modes lose nothing.
    """
    assert plant.hysteresis is not None
    squared, V = undamped_modes(plant.mass, plant.stiffness)
    loss = np.einsum("ki,kl,li->i", V, plant.hysteresis, V)
    rate = np.sqrt(np.abs(squared))
    dampers = np.where(rate > 0.0, loss, 0.0) / np.where(rate > 0.0, rate, 1.0)
    shapes = plant.mass @ V
    return replace(plant, damping=plant.damping + (shapes * dampers) @ shapes.T, hysteresis=None)


@dataclass(frozen=True)
class ModalPlant:
    """A plant in the modal coordinates of its undamped self, for G(iw).

    squared                       (n,)    natural frequencies squared [1/s^2]
    loss, damping                 (n, n)  V^T L V [1/s^2] and V^T B V [1/s]
    dampers                       (k, n)  directions of the lagged dampers, each times the square root of its
                                  damping [s^-1/2]
    lags                          (k,)    their time constants [s]
    modal_actuator, modal_sensor  (n,)    V^T actuator and V^T sensor [kg^-1/2]
    """

    squared: Floats
    loss: Floats
    damping: Floats
    dampers: Floats
    lags: Floats
    modal_actuator: Floats
    modal_sensor: Floats

    @classmethod
    def of(cls, plant: Plant) -> ModalPlant:
        """The modal form of a plant, with hysteresis or without."""
        squared, V = undamped_modes(plant.mass, plant.stiffness)
        loss = np.zeros_like(plant.mass) if plant.hysteresis is None else V.T @ plant.hysteresis @ V
        loss[np.abs(loss) <= RIGID * np.max(np.abs(loss))] = 0.0
        dampers = [np.sqrt(damper.damping) * (damper.along @ V) for damper in plant.lagged_dampers]
        lags = np.array([damper.time_constant for damper in plant.lagged_dampers])
        damping = V.T @ plant.damping @ V
        into, out = plant.actuator @ V, plant.sensor @ V
        return cls(squared, loss, damping, np.array(dampers).reshape(-1, len(V)), lags, into, out)

    def response(self, w: Floats) -> Complexes:
        """G(iw) (...) from force to reading at angular frequencies w (...) [1/s], of either sign [m/N]."""
        return np.asarray(self.modes(w) @ self.modal_sensor)

    def modes(self, w: Floats) -> Complexes:
        """Amplitudes (..., n) of the modal coordinates for a force of 1 N at angular frequencies w (...) [1/s]."""
        w = w[..., None, None]
        dynamic = 1j * (np.sign(w) * self.loss + w * self.damping)
        for direction, lag in zip(self.dampers, self.lags, strict=True):
            dynamic = dynamic + 1j * w / (1.0 + 1j * w * lag) * np.outer(direction, direction)
        n = np.arange(len(self.squared))
        dynamic[..., n, n] += self.squared - w[..., 0] ** 2
        return np.asarray(np.linalg.solve(dynamic, self.modal_actuator[:, None])[..., 0])

    def natural_rates(self) -> Floats:
        """|Im s| [1/s] of the poles, at which the response to steady vibration turns sharply."""
        n, k = len(self.squared), len(self.lags)
        A = np.zeros((2 * n + k, 2 * n + k), dtype=complex)
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n] = -np.diag(self.squared) - 1j * self.loss
        A[n : 2 * n, n : 2 * n] = -self.damping
        A[n : 2 * n, 2 * n :] = -self.dampers.T
        A[2 * n :, n : 2 * n] = self.dampers / self.lags[:, None]
        A[2 * n :, 2 * n :] = -np.diag(1.0 / self.lags)
        return np.abs(np.linalg.eigvals(A).imag)


@dataclass(frozen=True)
class SampledResponse:
    """P(e^{i theta}) [m/N] of a loop whose plant has hysteresis.

    hysteretic, viscous  the plant with hysteresis, and with dampers instead (`viscous_equivalent`)
    reference            the loop with the latter, whose response is known in closed form
    near                 numbers k of the aliases that are summed at each angle
    far                  sum of all other aliases, by theta in [0, pi]
    """

    loop: Loop
    hysteretic: ModalPlant
    viscous: ModalPlant
    reference: Loop
    near: Ints
    far: Chebyshev

    @classmethod
    def of(cls, loop: Loop) -> SampledResponse:
        """The response of a loop, its far aliases summed."""
        reference = replace(loop, plant=viscous_equivalent(loop.plant))
        lossy, damped = ModalPlant.of(loop.plant), ModalPlant.of(reference.plant)
        rates = np.concatenate([lossy.natural_rates(), damped.natural_rates(), [0.0]])
        folds = rates * loop.period / (2.0 * np.pi)
        most = FEWEST + int(PER_FOLD * np.max(folds))
        k = np.arange(-most, most + 1)
        sharp = np.any(np.abs(np.abs(k + 0.25)[:, None] - folds) < SMOOTH, axis=1)
        far = Chebyshev.interpolate(
            lambda theta: _response_difference(loop, lossy, damped, theta, k[~sharp]), DEGREE, domain=[0.0, np.pi]
        )
        return cls(loop, lossy, damped, reference, k[sharp], far)

    def __call__(self, thetas: Floats) -> Complexes:
        """P (n,) at angles (n,) in (0, pi]."""
        parts = np.array_split(thetas, 1 + len(thetas) // CHUNK)
        near = [_response_difference(self.loop, self.hysteretic, self.viscous, part, self.near) for part in parts]
        low_pass, z = force_filter(self.loop.controller), np.exp(1j * thetas)
        passed = factor_response(low_pass.numerator, low_pass.denominator, z - 1.0) / z**self.loop.whole_delay
        A, AP, _ = terms_along(circle_factors(table_of_loops(self.reference)), thetas).T
        return np.asarray(AP / A + passed * (np.concatenate(near) + self.far(thetas)))

    def rounding(self, thetas: Floats) -> Floats:
        """Rounding error of P (n,) to be expected [m/N]: a sum of modes smaller than each of them loses digits."""
        w = thetas / self.loop.period
        sizes = np.abs(self.hysteretic.modes(w)) @ np.abs(self.hysteretic.modal_sensor)
        return np.asarray(UNIT * sizes * np.abs(np.expm1(-1j * thetas)) / thetas)


def _response_difference(loop: Loop, lossy: ModalPlant, damped: ModalPlant, thetas: Floats, k: Ints) -> Complexes:
    """Response of the hysteretic plant less the viscous one's (n,) [m/N], over aliases k, without whole delay."""
    w = (thetas[:, None] + 2.0 * np.pi * k) / loop.period
    s = 1j * w
    lag = loop.controller.actuator_time_constant * s + 1.0
    late = np.exp(-s * loop.fractional_delay * loop.period)
    hold = late * -np.expm1(-1j * thetas)[:, None] / (s * lag)
    return np.asarray(np.sum((lossy.response(w) - damped.response(w)) * hold, axis=1) / loop.period)
