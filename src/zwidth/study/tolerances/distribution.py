"""`Distribution`: how a number of the device file differs from one produced device to the next.

`Tolerance`: a number of the device file with its distribution, and the numbers that go with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, inf, isfinite, log, log1p, nextafter, sqrt
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.study.designs.sampling import Axis, Tie

Kind = Literal["normal", "uniform", "triangular", "lognormal"]

CUT: Final = (
    4.0  # standard deviations from the middle at which a distribution with tails is cut off, if none is given
)
SPAN_OF_95: Final = 1.959963984540054  # standard deviations on either side of the middle that hold 95 %
# Shares of a draw keep away from 0 and 1: an end of a distribution may be a value that a device cannot have.
LEAST_SHARE: Final = 2.0**-53  # stands for 0, at which a distribution with tails is infinite
QUANTILES: Final = 4096  # that moments are found from


@dataclass(frozen=True)
class Distribution:
    """The distribution of a number, drawn by the inverse of its distribution function.

    normal      N(middle, spread^2), cut off at low and high
    lognormal   exp N(ln middle, spread^2), cut off at low and high; `middle` is the median
    uniform     between low and high
    triangular  between low and high, most likely at the middle

    What is cut off is spread over the rest in proportion: the draws are those of the whole distribution, without
    the ones beyond low and high.

    kind    which of them
    middle  mean, median or most likely value, in the number's unit
    low     least value that is drawn
    high    largest value that is drawn
    spread  standard deviation before the cut, of a lognormal one that of the logarithm; 0 for the other two
    """

    kind: Kind
    middle: float
    low: float
    high: float
    spread: float = 0.0

    @property
    def cut_off(self) -> float:
        """Probability that the cut takes away: 6.3e-5 for a normal one cut at 4 standard deviations.

        >>> Distribution("normal", 10.0, 6.0, 14.0, 1.0).cut_off < 6.4e-5
        True
        """
        if not self.spread:
            return 0.0
        below, above = self._shares_below_ends()
        return float(below + (1.0 - above))

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation of what is drawn, from its quantiles: to some three digits.

        >>> mean, deviation = Distribution("uniform", 3.0, 2.0, 4.0).moments
        >>> round(mean, 6), round(deviation, 6)
        (3.0, 0.57735)
        """
        drawn = self.values((np.arange(QUANTILES) + 0.5) / QUANTILES)
        return float(drawn.mean()), float(drawn.std())

    def values(self, shares: ArrayLike) -> Floats:
        """Values (...) at which the distribution function has these shares (...), 0 to 1, of which those below
        LEAST_SHARE and above 1 - LEAST_SHARE count as these.

        Of a triangular one with ends a, b and peak c the distribution function is (x - a)^2 / ((b - a)(c - a))
        below c and 1 - (b - x)^2 / ((b - a)(b - c)) above.

        >>> Distribution("uniform", 3.0, 2.0, 4.0).values([0.25, 0.5]).tolist()
        [2.5, 3.0]
        >>> Distribution("triangular", 2.0, 2.0, 4.0).values([0.75]).tolist()
        [3.0]
        """
        u = np.clip(np.asarray(shares, dtype=np.float64), LEAST_SHARE, 1.0 - LEAST_SHARE)
        a, b, c = self.low, self.high, self.middle  # ends and peak; of one with tails c is the middle
        if self.kind == "uniform":
            return np.asarray(a + u * (b - a))
        if self.kind == "triangular":
            rising = u * (b - a) < c - a
            up = a + np.sqrt(np.where(rising, u, 0.0) * (b - a) * (c - a))
            down = b - np.sqrt(np.where(rising, 0.0, 1.0 - u) * (b - a) * (b - c))
            return np.asarray(np.where(rising, up, down))
        from scipy.special import ndtri

        below, above = self._shares_below_ends()
        z = ndtri(below + u * (above - below))  # in standard deviations
        drawn = c * np.exp(self.spread * z) if self.kind == "lognormal" else c + self.spread * z
        return np.asarray(np.clip(drawn, a, b))

    def narrowed(self, values: ArrayLike, share: float) -> Floats:
        """The same draws (...) of a tolerance that is narrower: a share of the way from the middle to each value.

        Of a lognormal one the way is measured in the logarithm, which keeps its kind.

        >>> Distribution("uniform", 3.0, 2.0, 4.0).narrowed([2.5], 0.5).tolist()
        [2.75]
        """
        x = np.asarray(values, dtype=np.float64)
        if self.kind == "lognormal":
            return np.asarray(self.middle * (x / self.middle) ** share)
        return np.asarray(self.middle + share * (x - self.middle))

    def _shares_below_ends(self) -> tuple[float, float]:
        """Shares of the whole distribution, before the cut, below low and below high."""
        from scipy.special import ndtr

        if self.kind == "lognormal":
            ends = [log(end / self.middle) / self.spread for end in (self.low, self.high)]
        else:
            ends = [(end - self.middle) / self.spread for end in (self.low, self.high)]
        return float(ndtr(ends[0])), float(ndtr(ends[1]))


@dataclass(frozen=True)
class NumberLimits:
    """What values a number of the device file may have at all.

    least, most          inf where there is no limit
    without_least, without_most  whether the limit itself is not allowed
    """

    least: float = -inf
    most: float = inf
    without_least: bool = False
    without_most: bool = False

    @property
    def lowest(self) -> float:
        """Least value that is allowed, the next number where the limit itself is not."""
        return nextafter(self.least, inf) if self.without_least else self.least

    @property
    def highest(self) -> float:
        """Largest value that is allowed, the number before where the limit itself is not."""
        return nextafter(self.most, -inf) if self.without_most else self.most


def normal(middle: float, deviation: float, limits: NumberLimits, cut: float = CUT) -> Distribution:
    """A normal distribution, cut off at so many standard deviations and at the limits of the number.

    >>> normal(1.0, 0.5, NumberLimits(0.0, without_least=True)).high
    3.0
    """
    low, high = middle - cut * deviation, middle + cut * deviation
    return Distribution("normal", middle, max(low, limits.lowest), min(high, limits.highest), deviation)


def lognormal(middle: float, spread: float, limits: NumberLimits, cut: float = CUT) -> Distribution:
    """A lognormal distribution of a positive number, by its median and the standard deviation of the logarithm."""
    low, high = middle * exp(-cut * spread), middle * exp(cut * spread)
    return Distribution("lognormal", middle, max(low, limits.lowest), min(high, limits.highest), spread)


def spread_of_variation(variation: float) -> float:
    """Standard deviation of the logarithm of a lognormal number with this standard deviation over its mean.

        spread = sqrt(ln(1 + variation^2))

    >>> round(spread_of_variation(0.05), 6)
    0.049969
    """
    return sqrt(log1p(variation**2))


def finite(*values: float | None) -> bool:
    """Whether all these are given and finite."""
    return all(value is not None and isfinite(value) for value in values)


@dataclass(frozen=True)
class Tolerance:
    """How a number of the device file differs from one produced device to the next.

    key           path of the number, as it was written
    path          the same path in full: by it random numbers are told apart
    distribution  of the number in the device file
    relative      whether a device of another design differs by the same share, or by the same amount
    unit          of the number; "" for none
    ties          numbers that go with it
    """

    key: str
    path: str
    distribution: Distribution
    relative: bool
    unit: str = ""
    ties: tuple[Tie, ...] = ()

    def axis(self, values: ArrayLike) -> Axis:
        """The axis of a study whose n-th design has the n-th of these values (n,)."""
        # 1.0: the draws as they are, by the arithmetic of narrower ones
        drawn: Floats = self.distribution.narrowed(values, 1.0)
        return Axis(self.key, tuple(drawn.tolist()), ties=self.ties, unit=self.unit)

    def document(self) -> dict[str, Any]:
        """The tolerance by key; numbers in the number's own unit."""
        one = self.distribution
        return {
            "key": self.key,
            "unit": self.unit or None,
            "distribution": one.kind,
            "middle": one.middle,
            "low": one.low,
            "high": one.high,
            "standard_deviation": one.spread if one.kind == "normal" else None,
            "standard_deviation_of_logarithm": one.spread if one.kind == "lognormal" else None,
            "cut_off_share": one.cut_off,
            "tied": [tie.key for tie in self.ties],
        }

    def narrower(self, share: float) -> Tolerance:
        """The tolerance with a share of its width: of the spread, and of the way from the middle to both ends."""
        one = self.distribution
        low, high = one.narrowed([one.low, one.high], share).tolist()
        return replace(self, distribution=replace(one, low=low, high=high, spread=share * one.spread))
