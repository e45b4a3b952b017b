"""First-order adaptive windowing: the slope of the longest window that a line fits within the noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from zwidth.arrays import Floats
from zwidth.errors import NonlinearError
from zwidth.loop.estimator import Estimator, check_period, check_positive, check_whole

Fit = Literal["end-fit", "best-fit"]

# Longest window in periods: a best fit over n looks at n^2/2 distances in every sample.
LONGEST_WINDOW = 100
# Share of the noise bound left for rounding: counts often lie on the bound itself, half a step from the line.
ROUNDING_MARGIN = 1e-9
# Places in the memory of the number of readings, of the first reading, and of a ring of the newest readings. The
# ring is stored twice, one copy behind the other, so that every window is contiguous.
COUNT, ORIGIN, RING = 0, 1, 2


@dataclass(frozen=True)
class Foaw:
    """Slope of a line through the newest positions, over as many periods n as it fits them within their noise.

        v_j = b_n,      n the largest up to N with  |x_{j-i} - (a_m - b_m i T)| <= d  in every window m <= n

        end-fit    the line through the two ends:  b_n = (x_j - x_{j-n})/(n T), checked at i = 1 ... n - 1
        best-fit   the least-squares line of all n + 1 positions, checked at all of them:
                   b_n = 6 sum_{i=0}^{n} (n - 2 i) x_{j-i} / (n (n + 1) (n + 2) T)

    The window grows one period at a time until a line fails. (Janabi-Sharifi, Hayward and Chen 2000, "Discrete-
    time adaptive windowing for velocity estimation", at second hand, from implementations that follow it; some of
    these lay the best slope through the newest position.) Not linear: a still hand is averaged over N periods, a
    jerk over one. On a ramp with errors within d the estimate errs by at most 2 d/(n T), by end-fit, and by
    6 floor((n + 1)^2/2)/(n (n + 1) (n + 2)) d/T < 3 d/(n T), by best-fit.

    An encoder that rounds to a step has d = step/2, `Foaw.of_encoder`. The line through two ends, each wrong by d,
    is off a ramp's positions by up to 2 d in between, and the window is cut. A hand that takes many periods from
    one step to the next then looks too slow in the mean: 0.75 of its speed by end-fit, 0.5 by best-fit. Twice the
    bound, d = step, never cuts a window on a ramp, has the right mean, and is later to see a motion change.

    samples         N, longest window in periods, from 1 (the backward difference) to 100
    position_noise  d, largest error of a position [m]
    fit             "end-fit" or "best-fit"
    Raises          ValueError      otherwise
                    NonlinearError  from `estimator`: it has no w(z)

    >>> from zwidth.loop.estimators.kernels import velocity_of
    >>> (velocity_of(Foaw(4, 0.5e-6), [0.0, 0.0, 1e-6, 1e-6, 2e-6, 2e-6], 0.001) * 1e3).round(3)
    array([0.   , 0.   , 0.5  , 0.333, 0.5  , 0.5  ])
    """

    samples: int
    position_noise: float
    fit: Fit = "end-fit"

    def __post_init__(self) -> None:
        """Raise ValueError for samples, a noise bound or a fit out of range."""
        check_whole("samples", self.samples, 1, LONGEST_WINDOW, "the longest window, in periods")
        check_positive("position_noise", self.position_noise, "m")
        if self.fit not in get_args(Fit):
            raise ValueError(f"fit must be 'end-fit' or 'best-fit', got {self.fit!r}")

    @classmethod
    def of_encoder(cls, samples: int, resolution: float, fit: Fit = "end-fit") -> Foaw:
        """With the noise bound of an encoder that rounds to a step [m], step/2."""
        check_positive("the encoder's resolution", resolution, "m")
        return cls(samples, 0.5 * resolution, fit)

    def estimator(self, period: float) -> Estimator:
        """Nothing: an adaptive window has no w(z).

        Raises  NonlinearError  always
        """
        check_period(period)
        raise NonlinearError("adaptive windowing")

    @property
    def parameters(self) -> Floats:
        """Numbers for `foaw_estimate`, (3,): N, d, and 1 for the best fit."""
        return np.array([float(self.samples), self.position_noise, float(self.fit == "best-fit")])

    @property
    def memory_size(self) -> int:
        """Numbers that `foaw_estimate` remembers."""
        return RING + 2 * (self.samples + 1)
