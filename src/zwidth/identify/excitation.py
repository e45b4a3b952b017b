"""Whether two parts of a record excite the same frequencies, so that one can be predicted from the other."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats

LEAST_SHARED: Final = 0.2  # of the power, from which on one part tells of the other


def shared_power(first: Floats, second: Floats) -> float:
    """Share of two spectra (k,) of power that both have: the sum of the smaller one, each of sum 1; 0 if one is 0.

    >>> shared_power(np.array([1.0, 1.0, 0.0]), np.array([0.0, 4.0, 4.0]))
    0.5
    """
    sums = float(np.sum(first)), float(np.sum(second))
    return float(np.sum(np.minimum(first / sums[0], second / sums[1]))) if min(sums) > 0.0 else 0.0
