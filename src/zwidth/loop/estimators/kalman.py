"""The steady Kalman filter of a mass pushed by white accelerations."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from zwidth.loop.estimator import Estimator, check_period, check_positive, quantisation_noise
from zwidth.loop.estimators.alpha_beta import AlphaBeta
from zwidth.model.design_axes import Number

# Tracking indices that make a usable filter. Below, it is late by eight hundred samples and more; above, it is the
# trapezoidal rule but for rounding, and never stops ringing.
INDEX = (3e-6, 1e8)


@dataclass(frozen=True)
class Kalman:
    """Steady-state Kalman filter of position and velocity, the acceleration white and constant within a period.

        x_{j+1} = x_j + T v_j + (T^2/2) a_j,      v_{j+1} = v_j + T a_j,      y_j = x_j + n_j

    It is an alpha-beta filter whose shares depend on one number, the tracking index (Kalata 1984, known at second
    hand; the tests solve the Riccati equation):

        Lambda = sigma_a T^2 / sigma_n
        r = sqrt(1 - alpha),      Lambda = 2 (1 - r)^2 / r,      alpha = 1 - r^2,      beta = 2 (1 - r)^2

    A large index trusts the encoder: w(z) tends to the trapezoidal rule (2/T) (z - 1)/(z + 1), which rings at half
    the sampling rate. A small one trusts the model: the delay tends to sqrt(2 sigma_n/sigma_a), whatever T.

    acceleration_noise  sigma_a, standard deviation of the accelerations to expect [m/s²]
    position_noise      sigma_n, standard deviation of the encoder's error [m]; `Kalman.of_encoder` takes its step
    Raises              ValueError  unless both are positive and finite; from the methods, where Lambda is outside
                        3e-6 to 1e8; arrays of designs are not checked for that

    >>> method = Kalman.of_encoder(acceleration_noise=10.0, resolution=1e-5)
    >>> round(method.delay(0.001) * 1e3, 4), round(method.alpha_beta(0.001).alpha, 4)
    (0.4096, 0.9156)
    """

    acceleration_noise: Number
    position_noise: Number

    def __post_init__(self) -> None:
        check_positive("acceleration_noise", self.acceleration_noise, "m/s²")
        check_positive("position_noise", self.position_noise, "m")

    @classmethod
    def of_encoder(cls, acceleration_noise: float, resolution: float) -> Kalman:
        """With the noise of an encoder that rounds to a step [m], step/sqrt(12)."""
        return cls(acceleration_noise, quantisation_noise(resolution))

    def alpha_beta(self, period: float) -> AlphaBeta:
        """The alpha-beta filter that this is at a sampling period [s]."""
        share = self._share(period)  # 1 - r, in which alpha = 1 - r^2 and beta = 2 (1 - r)^2
        return AlphaBeta(share * (2.0 - share), 2.0 * share * share)

    def estimator(self, period: float) -> Estimator:
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        return self.alpha_beta(period).estimator(period)

    def delay(self, period: float) -> float:
        """Delay of the estimate at low frequencies [s]: T r/(1 - r)."""
        return self.alpha_beta(period).delay(period)

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]."""
        return self.alpha_beta(period).noise_gain(period)

    def _share(self, period: float) -> float:
        """1 - r, without cancellation: u = 1 - r is the positive root of 2 u^2 + Lambda u - Lambda = 0.

        Raises  ValueError  for an index out of INDEX; not for an array, of several designs
        """
        check_period(period)
        index = self.acceleration_noise * period**2 / self.position_noise
        low, high = INDEX
        if getattr(index, "ndim", 0):
            return np.asarray(2.0 * index / (index + np.sqrt(index * (index + 8.0))))  # type: ignore[return-value]
        if not low <= index <= high:
            much, change = ("little", "raise") if index < low else ("much", "lower")
            raise ValueError(
                f"acceleration_noise T^2 / position_noise must be from {low:g} to {high:g}, got {index:g}: too "
                f"{much} motion within a period of {period:g} s for the encoder's noise; {change} "
                f"acceleration_noise = {self.acceleration_noise!r} m/s² or change position_noise = "
                f"{self.position_noise!r} m"
            )
        return 2.0 * index / (index + sqrt(index * (index + 8.0)))
