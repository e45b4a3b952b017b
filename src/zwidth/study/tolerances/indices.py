"""Which tolerance makes how much of the spread: Sobol's indices, by SALib.

    first order   S_i = Var(E[Y | X_i]) / Var(Y)          what X_i explains alone
    total         T_i = E[Var(Y | all but X_i)] / Var(Y)  what it has a part in

(Sobol 2001; the estimators of Saltelli et al. 2010, both known at second hand from SALib.) Devices are sampled as
SALib's `sample.sobol` lays them, scrambled by the seed; intervals are 1.96 standard deviations of resampled
indices. Indices are given as estimated: a first order below 0 is the estimator's error, and is not made 0.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.study.tolerances.intervals import CONFIDENCE, Interval

RESAMPLES: Final = 500


@dataclass(frozen=True)
class Index:
    """The indices of one tolerance for one outcome.

    key    of the tolerance
    first  of first order
    total  of all orders
    """

    key: str
    first: Interval
    total: Interval

    @property
    def first_is_certain(self) -> bool:
        """Whether the first order can be told from 0: its interval does not hold 0."""
        return self.first.low > 0.0

    @property
    def total_is_certain(self) -> bool:
        """Whether the total index can be told from 0."""
        return self.total.low > 0.0

    def document(self) -> dict[str, Any]:
        """The indices by key."""
        return {
            "key": self.key,
            "first": self.first.value,
            "first_low": self.first.low,
            "first_high": self.first.high,
            "first_differs_from_0": self.first_is_certain,
            "total": self.total.value,
            "total_low": self.total.low,
            "total_high": self.total.high,
            "total_differs_from_0": self.total_is_certain,
        }


@dataclass(frozen=True)
class Indices:
    """The indices of all tolerances for one outcome, or why there are none.

    name     of the outcome: a measure, `wall_is_stable`, `has_stable_wall`, or `has_value(MEASURE)`
    of       what the outcome is, in words
    indices  one for each tolerance; () where there are none
    reason   why there are none; "" where there are
    """

    name: str
    of: str
    indices: tuple[Index, ...]
    reason: str = ""

    def document(self) -> dict[str, Any]:
        """The outcome and its indices by key."""
        return {
            "outcome": self.name,
            "meaning": self.of,
            "indices": [one.document() for one in self.indices],
            "reason": self.reason or None,
        }


def sampled_shares(count: int, samples: int, seed: int) -> Floats:
    """Shares 0..1 (samples * (count + 2), count) of the devices that indices of `count` tolerances need."""
    from SALib.sample import sobol

    problem = _problem([str(n) for n in range(count)])
    return np.asarray(sobol.sample(problem, samples, calc_second_order=False, scramble=True, seed=seed))


def indices_of(name: str, of: str, outcome: Floats, keys: Sequence[str], seed: int) -> Indices:
    """The indices of an outcome.

    outcome  (samples * (tolerances + 2),) of the devices of `sampled_shares`; none is nan
    keys     of the tolerances
    """
    if np.ptp(outcome) == 0.0:
        return Indices(name, of, (), f"it is {outcome[0]:.6g} for all {len(outcome)} devices")
    from SALib.analyze import sobol

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of resamples that happen to be constant
        # SALib takes a seed of 0 for none, and would then draw from numpy's shared stream
        found = sobol.analyze(
            _problem(keys),
            np.asarray(outcome, dtype=np.float64),
            calc_second_order=False,
            num_resamples=RESAMPLES,
            conf_level=CONFIDENCE,
            seed=seed + 1,
        )
    columns = [np.asarray(found[column], dtype=np.float64) for column in ("S1", "S1_conf", "ST", "ST_conf")]
    each = tuple(
        Index(
            key,
            Interval(first, first - first_half, first + first_half),
            Interval(total, total - half, total + half),
        )
        for key, first, first_half, total, half in zip(keys, *(column.tolist() for column in columns), strict=True)
    )
    return Indices(name, of, each)


def _problem(keys: Sequence[str]) -> dict[str, Any]:
    return {"num_vars": len(keys), "names": list(keys), "bounds": [[0.0, 1.0]] * len(keys)}
