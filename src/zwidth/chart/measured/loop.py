"""A measured device under a sampled wall law, 1 + P(z)(K + B w(z)) = 0 with P known at points of the circle."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.measured.response_interpolation import (
    FEWEST,
    ResponseInterpolation,
    around_one,
    interpolate_response,
)
from zwidth.chart.measured.usable_frequencies import UnusableRange, is_usable, reaches_half_rate, unusable_ranges
from zwidth.loop.controller import Controller
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.filters import force_filter, velocity_estimator
from zwidth.model.response import Response, ResponseError, integrators_of, relative_error

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Radius of the disk that holds 95 % of a circular Gaussian error, in standard deviations: sqrt(-2 ln 0.05)
DISK = float(np.sqrt(-2.0 * np.log(0.05)))


@dataclass(frozen=True)
class MeasuredLoop:
    """A response and the computer's part of the loop. Its delay is that of software alone, in whole samples."""

    response: Response
    controller: Controller
    usable: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        if self.controller.fixed_feedback:
            raise ResponseError(
                f"a measured response has no model from which {self.controller.feedback_names[0]} could be "
                "computed; measure it with that switched on, and leave it out of the file"
            )
        delay, f = self.controller.delay, self.response.frequency
        if abs(delay - round(delay)) > 1e-9:
            raise ResponseError(
                f"a measured response holds the device's delay already, and the computer can add whole samples "
                f"only, got {delay:g}; leave delay_samples out"
            )
        if self.controller.actuator_time_constant > 0.0:
            raise ResponseError(
                "a measured response holds the actuator's lag already; leave actuator_time_constant out"
            )
        half = 0.5 / self.period
        if len(f) and f[-1] > half * (1.0 + 1e-9):
            raise ResponseError(
                f"has frequencies up to {f[-1]:.6g} Hz, above half the sampling rate, {half:.6g} Hz; leave them "
                "out, or correct sampling_period_s"
            )
        good = is_usable(self.response)
        if np.count_nonzero(good) < FEWEST:
            raise ResponseError(
                f"has {np.count_nonzero(good)} usable frequencies of {len(f)}; at least {FEWEST} are needed, "
                "a few hundred for an accurate chart"
            )
        object.__setattr__(self, "usable", good)

    @property
    def period(self) -> float:
        """Sampling period T [s]."""
        return self.controller.sampling_period

    @cached_property
    def integrators(self) -> int:
        """Poles of P at z = 1."""
        return integrators_of(self.response, self.period)

    @cached_property
    def angles(self) -> Floats:
        """theta = 2 pi f T (n,) of the usable frequencies, in (0, pi]."""
        theta = 2.0 * np.pi * self.response.frequency[self.usable] * self.period
        return np.where(theta > np.pi * (1.0 - 1e-9), np.pi, theta)

    @property
    def angles_below_pi(self) -> Floats:
        """Those of `angles` below pi, where K and B are defined."""
        return self.angles[self.angles < np.pi]

    @cached_property
    def interpolation(self) -> ResponseInterpolation:
        """The response between these angles."""
        P = self.response.value[self.usable]
        closed, to_end = reaches_half_rate(self.angles)
        return interpolate_response(self.angles, P, self.integrators, closed=closed, measured_to_half_rate=to_end)

    @cached_property
    def unusable(self) -> tuple[UnusableRange, ...]:
        """Stretches of frequency that cannot be relied on, ascending."""
        return tuple(unusable_ranges(self.response, self.usable, self.period, self.interpolation))

    @property
    def largest_angle(self) -> float:
        """The largest angle that the response reaches: pi, or that of the last frequency."""
        return float(np.pi if self.interpolation.closed else self.angles[-1])

    def h(self, theta: Floats) -> Complexes:
        """h = -1/P (...) at angles in (0, pi], software delay and force filter in P; inf where P is 0."""
        delay, force = round(self.controller.delay), force_filter(self.controller)
        with np.errstate(divide="ignore", invalid="ignore"):
            passed = factor_response(force.numerator, force.denominator, around_one(theta))
            return np.asarray(-self.interpolation.inverse(theta) * np.exp(1j * theta * delay) / passed)

    def w(self, theta: Floats) -> Complexes:
        """The velocity estimate w (...) at angles in (0, pi]."""
        d, own = around_one(theta), velocity_estimator(self.controller)
        return np.asarray(
            factor_response(own.numerator, own.denominator, d) * window_response(own.window, 1.0 + d)
        )

    def walls(self, theta: Floats) -> tuple[Floats, Floats, Floats]:
        """K, B of the wall that fails at each angle, and the sign of Im w there."""
        h, w = self.h(theta), self.w(theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            B = h.imag / w.imag
            return h.real - B * w.real, B, np.sign(w.imag)

    @cached_property
    def errors(self) -> Floats | None:
        """Radius (n,) of the disk round each h of `angles` that holds the true one, over |h|; None: unknown.

        From coherence: 95 % of the error. From repeated sweeps: the farthest of them.
        """
        response, good = self.response, self.usable
        if response.sweeps is not None:
            return np.asarray(np.max(np.abs(response.value[good] / response.sweeps[:, good] - 1.0), axis=0))
        if response.coherence is not None:
            return np.asarray(DISK * relative_error(response.coherence[good], response.averages))
        return None

    def error(self, theta: Floats) -> Floats:
        """The radius (...) of the disk round h at any angle; 0 where no error is known."""
        if self.errors is None:
            return np.zeros(np.shape(theta))
        return np.asarray(np.interp(theta, self.angles, self.errors) * np.abs(self.h(theta)))
