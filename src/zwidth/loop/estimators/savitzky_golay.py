"""The slope of the polynomial through the last n positions, after Savitzky and Golay."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate
from math import factorial, lcm

import numpy as np

from zwidth.loop.estimator import LONGEST, Estimator, check_whole, mean_difference

# Highest degree. Through eleven positions, the fewest for degree 10, the slope at the newest passes 67 times the
# noise that the backward difference does.
HIGHEST = 10


@dataclass(frozen=True)
class SavitzkyGolay:
    """Slope of the polynomial of degree p that fits the newest n positions best in the sense of least squares.

        v_j = (1/T) sum_k c_k x_{j-k},      c_k = -sum_{m=1}^{p} t_m'(s) t_m(k) / h_m

    with the Gram (discrete Chebyshev) polynomials t_m of the age k, orthogonal over k = 0 ... n - 1 with squared
    norms h_m = (n + m)! / ((2 m + 1) (n - m - 1)!). The slope is taken at the newest position, s = 0, or in the
    window's middle, s = (n - 1)/2. The weights are computed in whole numbers and rounded once. (Savitzky and Golay
    1964, by the polynomials after Gorry 1990; both known at second hand, and checked against fits in fractions.)

    At the newest position a degree of 2 or more is right on parabolas, so the estimate is not late at low
    frequencies, and pays for it with noise and with gains above 1 in between. Degree 1 is the least-squares
    slope, degree n - 1 the slope of the polynomial through all n. In the middle an even degree gives what the
    odd one below it gives (2 what 1 gives), as its last term has no slope there.

    samples  n, positions used: from order + 1 to 1000
    order    p, from 1 to 10
    centred  slope in the middle of the window, late by half its length, instead of at its newest position
    Raises   ValueError  otherwise

    >>> method = SavitzkyGolay(5, 2)
    >>> (method.estimator(0.001).window * 70).round(12)
    array([ 54.,  41.,   1., -26.])
    >>> method.delay(0.001), SavitzkyGolay(5, 2, centred=True).delay(0.001)
    (0.0, 0.002)
    """

    samples: int
    order: int
    centred: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError for an order or a number of samples that is out of range."""
        check_whole("order", self.order, 1, HIGHEST, "degree 0 has no slope, a higher one little but noise")
        check_whole(
            "samples",
            self.samples,
            self.order + 1,
            LONGEST,
            f"a polynomial of order {self.order} takes {self.order + 1} positions, and a long window is slow",
        )

    def estimator(self, period: float) -> Estimator:
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        return mean_difference(np.array(_weights(self.samples, self.order, self.centred)), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate at low frequencies [s].

        (n - 1) T/2 in the middle (there at every frequency) and for degree 1; 0 at the newest position otherwise
        """
        return 0.5 * (self.samples - 1) * period if self.centred or self.order == 1 else 0.0

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: norm of c_k."""
        c = np.diff(_weights(self.samples, self.order, self.centred), prepend=0.0, append=0.0)
        return float(np.linalg.norm(c)) / period


@lru_cache(maxsize=256)
def _weights(n: int, order: int, centred: bool) -> tuple[float, ...]:
    """Weights (n - 1) of the backward differences, newest first, each correctly rounded: running sums of the c_k.

    (m + 1) t_{m+1}(k) = (2 m + 1)(2 k - n + 1) t_m(k) - m (n^2 - m^2) t_{m-1}(k),      t_0 = 1

    The values are whole numbers. The slopes t_m'(s) follow the same recursion, differentiated.

    n, order, centred  samples, order and centred of `SavitzkyGolay`, which has c_k, t_m, s and h_m
    """
    n, order = int(n), int(order)  # NumPy's whole numbers would overflow
    place = Fraction(n - 1, 2) if centred else Fraction(0)
    ages = range(n)
    before, here = [0] * n, [1] * n
    at = (Fraction(0), Fraction(1))  # t_{m-1}(s), t_m(s)
    slope = (Fraction(0), Fraction(0))
    shares, sums = [], []  # of each m: -t_m'(s) / h_m, and the running sums of t_m(k) over k
    for m in range(order):  # each turn makes polynomial, slope and norm of degree m + 1
        a, b = 2 * m + 1, m * (n * n - m * m)
        before, here = here, [(a * (2 * k - n + 1) * here[k] - b * before[k]) // (m + 1) for k in ages]
        lever = 2 * place - n + 1
        slope = slope[1], (a * (2 * at[1] + lever * slope[1]) - b * slope[0]) / (m + 1)
        at = at[1], (a * lever * at[1] - b * at[0]) / (m + 1)
        norm = Fraction(factorial(n + m + 1), (2 * m + 3) * factorial(n - m - 2))
        shares.append(-slope[1] / norm)
        sums.append(list(accumulate(here))[:-1])
    common = lcm(*(share.denominator for share in shares))
    whole = [int(share * common) for share in shares]
    return tuple(sum(g * row[k] for g, row in zip(whole, sums, strict=True)) / common for k in range(n - 1))
