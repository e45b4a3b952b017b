"""Velocity from position samples, as a product of discrete factors and a window: v = w(z) y.

Each factor is a polynomial of degree 0 to 2 in d = z - 1, so that poles near z = 1 keep their digits.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from zwidth.arrays import Floats


@dataclass(frozen=True)
class Estimator:
    """w(z) = product of numerators / product of denominators * sum_k window_k z^-k.

    numerator, denominator  (..., k, 3)  rows c2, c1, c0 of  c2 d^2 + c1 d + c0,  d = z - 1; every denominator
                                         monic and of at least its numerator's degree; with axes of designs where
                                         the sampling period or a parameter has them
    window                  (n,)         weights of the newest to the oldest sample
    """

    numerator: Floats
    denominator: Floats
    window: Floats = field(default_factory=lambda: np.ones(1))


class NonlinearError(ValueError):
    """A velocity estimate that is not linear has no transfer function w(z).

    estimate  its name, such as "Levant's differentiator"
    """

    def __init__(self, estimate: str) -> None:
        self.estimate = estimate
        super().__init__(
            f"{estimate} is not linear: it has no chart; simulate it, measure its boundary, or for the chart of "
            "another estimate set loop.velocity.method to backward-difference"
        )

    def __reduce__(self) -> tuple[type[NonlinearError], tuple[str]]:
        """How pickle rebuilds the error in another process: from the estimate's name."""
        return type(self), (self.estimate,)
