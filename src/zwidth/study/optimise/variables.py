"""Variables of an optimisation: the axes of its study, each on the unit interval.

A share of 0 is a variable's lower bound and 1 its upper one. What takes whole numbers, listed values or parts of a
catalogue divides the interval into equal pieces, one each, and a share is moved to the middle of its piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, exp, floor, log
from typing import Any

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.study.designs.sampling import Axis


def pieces(axis: Axis) -> int:
    """Number of values that a variable takes; 0 for any number within its bounds.

    >>> pieces(Axis("a", (), (0.5, 4.5), whole=True)), pieces(Axis("b", (), (0.5, 4.5)))
    (4, 0)
    """
    if axis.span is None:
        return len(axis.values)
    return floor(axis.span[1]) - ceil(axis.span[0]) + 1 if axis.whole else 0


def continuous(axes: Sequence[Axis]) -> Flags:
    """Which variables (v,) take any number within their bounds."""
    return np.array([pieces(axis) == 0 for axis in axes], dtype=bool)


def settle(axes: Sequence[Axis], shares: Floats) -> Floats:
    """Shares (k, v) within 0 and 1, those of a variable in pieces at the middle of its piece."""
    settled = np.clip(shares, 0.0, 1.0)
    for n, axis in enumerate(axes):
        if many := pieces(axis):
            settled[:, n] = (np.minimum(np.floor(settled[:, n] * many), many - 1) + 0.5) / many
    return settled


def value_at(axis: Axis, share: float) -> Any:
    """The variable's value at a share.

    >>> value_at(Axis("a", (), (1.0, 3.0)), 0.5), value_at(Axis("b", ("x", "y")), 0.7)
    (2.0, 'y')
    """
    if many := pieces(axis):
        place = min(int(share * many), many - 1)
        return axis.values[place] if axis.span is None else ceil(axis.span[0]) + place
    assert axis.span is not None
    low, high = axis.span
    if share in (0.0, 1.0):
        return high if share else low
    value = exp(log(low) + share * (log(high) - log(low))) if axis.log else low + share * (high - low)
    return float(min(max(value, low), high))


def values_at(axes: Sequence[Axis], shares: Floats) -> list[tuple[Any, ...]]:
    """The variables' values of designs at shares (k, v)."""
    return [tuple(map(value_at, axes, row)) for row in shares.tolist()]


def share_of(axis: Axis, value: Any) -> float | None:
    """The share at which a variable has a value; None where it is outside the bounds, or not among the values."""
    if many := pieces(axis):
        if axis.span is None:
            place = axis.values.index(value) if value in axis.values else -1
        else:
            place = int(value) - ceil(axis.span[0]) if float(value).is_integer() else -1
        return (place + 0.5) / many if 0 <= place < many else None
    assert axis.span is not None
    low, high = axis.span
    if not low <= value <= high:
        return None
    if axis.log:
        return (log(value) - log(low)) / (log(high) - log(low))
    return float((value - low) / (high - low))
