"""Derivatives of computed numbers by extrapolated differences, with an estimate of their error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

# First steps in shares of the scale: smaller where the function changes within a step, larger against rounding.
FIRST: Final = (2e-3, 1e-4, 5e-6, 1e-2, 5e-2)
LEVELS: Final = 3  # least number of halvings
MOST: Final = 9  # largest number of halvings, where the function changes fast
ENOUGH: Final = 1e-10  # error of the derivative times the scale below which no more halvings are made
POOR: Final = 1e-8  # the same error; above it other first steps are tried


@dataclass(frozen=True)
class Derivative:
    """A derivative and the estimate of its error, both in units of the function over those of its argument."""

    value: float
    error: float


def central_derivative(function: Callable[[float], float], at: float, scale: float) -> Derivative:
    """First derivative of a smooth function by central differences, extrapolated to step 0.

        D(h) = (f(x + h) - f(x - h)) / 2 h = f' + c2 h^2 + c4 h^4 + ...

    Steps are halved, and Richardson's rule cancels one power after another; the entry of the table that differs
    least from its two parents is taken, and this difference is the error (Ridders 1982, known at second hand from
    its use in numerical libraries).

    scale   typical size of the argument; the first step is 1/500 of it
    Raises  what the function raises at the first step

    >>> from math import exp
    >>> abs(central_derivative(exp, 0.0, 1.0).value - 1.0) < 1e-11
    True
    """
    return _extrapolate(lambda h: (function(at + h) - function(at - h)) / (2.0 * h), scale, 4.0)


def one_sided_derivative(of: Callable[[float], float], at: float, scale: float, side: int) -> Derivative:
    """First derivative by one-sided differences, side +1 above or -1 below.

    For an argument at the end of its range, or where the function has a bend.

        D(h) = (f(x + h) - f(x)) / h = f' + c1 h + c2 h^2 + ...

    >>> from math import sqrt
    >>> round(one_sided_derivative(sqrt, 1.0, 1.0, -1).value, 8)
    0.5
    """
    start = of(at)
    return _extrapolate(lambda h: side * (of(at + side * h) - start) / h, scale, 2.0)


def arguments(at: float, scale: float, trial: int) -> Iterator[float]:
    """Every argument at which the derivatives above may want the function for one of their first steps, number
    `trial` of FIRST: `at` itself, and those above and below it."""
    yield at
    for h in _steps(FIRST[trial] * scale):
        yield at + h
        yield at - h


def _steps(first: float) -> Iterator[float]:
    """A first step, and the most halvings of it."""
    for level in range(MOST):
        yield first / 2.0**level


def _extrapolate(quotient: Callable[[float], float], scale: float, factor: float) -> Derivative:
    """The best result over the first steps; tried in turn until one is accurate enough."""
    best = _table(quotient, FIRST[0] * scale, scale, factor)
    for first in FIRST[1:]:
        if best.error * scale <= POOR:
            break
        with suppress(ValueError):  # a large step may leave the range where a small one did not
            best = min(best, _table(quotient, first * scale, scale, factor), key=lambda slope: slope.error)
    return best


def _table(quotient: Callable[[float], float], first: float, scale: float, factor: float) -> Derivative:
    """Richardson's table of D(h), D(h/2), ..., whose error falls by `factor` at the first halving; its best.

    Where it ends in rounding, of which the last quotient is a sample, no entry is better than this rounding over
    its own step: that two entries agree may be luck.
    """
    row: list[float] = []
    best, best_level = Derivative(float("nan"), float("inf")), 0
    for level, step in enumerate(_steps(first)):
        above, row = row, [quotient(step)]
        for k, coarse in enumerate(above):
            row.append(row[k] + (row[k] - coarse) / (factor ** (k + 1) - 1.0))
            error = max(abs(row[k + 1] - row[k]), abs(row[k + 1] - coarse))
            if k > 0 and error < best.error:
                best, best_level = Derivative(row[k + 1], error), level
        if level + 1 >= LEVELS:
            if best.error <= ENOUGH * max(abs(best.value), 1.0 / scale):
                return best
            if _rounding(row, best):
                break
    return Derivative(best.value, max(best.error, abs(row[0] - best.value) * 2.0 ** (best_level - level)))


def _rounding(row: list[float], best: Derivative) -> bool:
    """Whether rounding has taken over: the newest entries are further apart than the best were."""
    return len(row) > LEVELS and abs(row[-1] - row[-2]) > 4.0 * best.error
