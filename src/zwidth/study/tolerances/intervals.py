"""How sure a share, a quantile or a difference of two shares is that was counted on independent draws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil, log, sqrt
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.response import CONFIDENCE
from zwidth.result import Documented, entry

OUTSIDE: Final = 0.5 * (1.0 - CONFIDENCE)  # on either side of one
SPAN: Final = 1.959963984540054  # standard deviations of a normal distribution within it
ROUNDING: Final = 1e-9  # by which share * count may exceed the whole number that is meant


@dataclass(frozen=True)
class Interval(Documented):
    """An estimate with the interval that holds the true value with 95 %."""

    value: float = field(metadata=entry())
    low: float = field(metadata=entry())
    high: float = field(metadata=entry())


def under(name: str) -> Callable[[Interval | None], dict[str, float | None]]:
    """Function: interval -> its entries of a document, NAME, NAME_low and NAME_high; all None for no interval."""
    keys = (name, f"{name}_low", f"{name}_high")
    return lambda one: dict(zip(keys, (None,) * 3 if one is None else (one.value, one.low, one.high), strict=True))


def share_interval(count: int, of: int, doubtful: int = 0) -> Interval:
    """A probability from `count` of `of` independent draws, with the interval of Clopper and Pearson (1934).

        low = Beta^-1(0.025; k, n - k + 1)      high = Beta^-1(0.975; k + 1, n - k)

    (known at second hand, from scipy's documentation of `binomtest`). It holds the probability with 95 % or more
    whatever the probability is.

    doubtful  draws that may belong to the count or not: they widen the interval on the high side

    >>> found = share_interval(0, 100)
    >>> found.low, round(found.high, 6)
    (0.0, 0.036217)
    """
    from scipy.special import betaincinv

    most = count + doubtful
    low = 0.0 if count == 0 else float(betaincinv(count, of - count + 1, OUTSIDE))
    high = 1.0 if most == of else float(betaincinv(most + 1, of - most, 1.0 - OUTSIDE))
    return Interval(count / of, low, high)


def quantile_ranks(share: float, count: int) -> tuple[int, int, int]:
    """Ranks, from 1, of the ordered draws that estimate a quantile and bound it with 95 %.

    They hold whatever the distribution is. The number of draws below the quantile is binomial, so that
    P(X_(l) <= quantile <= X_(u)) is the probability that it is at least l and at most u - 1 (David and Nagaraja,
    Order Statistics, known at second hand). l is the largest and u the smallest rank with at most 2.5 % beyond
    them.

    Returns  rank of the estimate, ceil(share * count), and l and u; l = 0, u = count + 1 where there are too few
             draws for a bound

    >>> quantile_ranks(0.5, 100)
    (50, 40, 61)
    """
    from scipy.stats import binom

    estimate = min(max(ceil(share * count - ROUNDING), 1), count)
    # P(fewer than l below) <= 0.025, P(u or more below) <= 0.025
    below = binom.cdf(np.arange(-1, count + 1), count, share)  # [j] = P(at most j - 1)
    low = int(np.flatnonzero(below[: count + 1] <= OUTSIDE)[-1])
    # 1e-15: rounding of 1 - below
    high = int(np.flatnonzero(1.0 - below <= OUTSIDE + 1e-15)[0]) if 1.0 - below[count] <= OUTSIDE else count + 1
    return estimate, low, high


def quantile_interval(ordered: Floats, share: float) -> Interval:
    """A quantile of draws (n,) in ascending order, with its interval; infinite on a side without a bound."""
    estimate, low, high = quantile_ranks(share, len(ordered))
    bounds = np.concatenate([[-np.inf], ordered, [np.inf]])
    return Interval(float(ordered[estimate - 1]), float(bounds[low]), float(bounds[high]))


def draws_needed(share: float) -> int:
    """Number of draws from which a quantile has a bound on both sides: q^n <= 0.025 and (1 - q)^n <= 0.025.

    >>> draws_needed(0.05), draws_needed(0.5), draws_needed(0.99)
    (72, 6, 368)
    """
    return ceil(log(OUTSIDE) / log(max(share, 1.0 - share)))


def count_bounds(share: float, count: int) -> tuple[int | None, int, int]:
    """Numbers of devices, of `count`, that must share a wall for it to be stable with a probability of `share`.

    Returns  the number from which on the probability is `share` or more with 97.5 %; None: all would not be
             enough. The number that is this share of them, ceil(share * count).
             The number below which the probability is less with 97.5 %, 1 at least
    """
    from scipy.special import betaincinv

    # bounds of the probability of a wall that k devices share (Clopper and Pearson): below low or above high it
    # is with 2.5 % at most
    k = np.arange(1, count + 1)
    low = betaincinv(k, count - k + 1.0, OUTSIDE)
    high = np.append(betaincinv(k[:-1] + 1.0, count - k[:-1] * 1.0, 1.0 - OUTSIDE), 1.0)
    certain = np.flatnonzero(low >= share)
    possible = np.flatnonzero(high >= share)
    return (
        int(k[certain[0]]) if len(certain) else None,
        min(max(ceil(share * count - ROUNDING), 1), count),
        int(k[possible[0]]),
    )


def difference_interval(gained: int, lost: int, count: int) -> Interval:
    """Difference of two shares counted on the same draws, from those that differ.

        ((b - c) / n) +- 1.96 sqrt((b' + c') - (b' - c')^2 / n') / n',   b' = b + 1/2, c' = c + 1/2, n' = n + 2

    round (b' - c') / n' (Agresti and Min 2005, known at second hand: half an observation is added to each of the
    four cells of the table). The estimate is that of the counts.

    gained, lost  b, c: draws that belong to the second and not to the first, and the other way round
    """
    b, c, n = gained + 0.5, lost + 0.5, count + 2.0
    middle, half = (b - c) / n, SPAN * sqrt(max(b + c - (b - c) ** 2 / n, 0.0)) / n
    return Interval((gained - lost) / count, max(middle - half, -1.0), min(middle + half, 1.0))
