"""What became of drawn devices: counts, quantiles of their measures, and outcomes that indices are found for.

Which tolerance makes how much of the spread: Sobol's indices, by SALib.

    first order   S_i = Var(E[Y | X_i]) / Var(Y)          what X_i explains alone
    total         T_i = E[Var(Y | all but X_i)] / Var(Y)  what it has a part in

(Sobol 2001; the estimators of Saltelli et al. 2010, both known at second hand from SALib.) Devices are sampled as
SALib's `sample.sobol` lays them, scrambled by the seed; intervals are 1.96 standard deviations of resampled
indices. Indices are given as estimated: a first order below 0 is the estimator's error, and is not made 0.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.measures.definition import NO_VALUE, OK, STATUS, UNDECIDED
from zwidth.model.response import CONFIDENCE
from zwidth.result import Documented, documented, entry
from zwidth.study.designs.column import Column
from zwidth.study.jobs.job import CellValues
from zwidth.study.tolerances.intervals import Interval, quantile_interval, under
from zwidth.study.tolerances.question import WALL_IS_STABLE

STABLE, UNSTABLE = "stable", "unstable"  # outcomes of the wanted wall; the others are a status in words
WITH_WALL, WITHOUT_WALL = "with a stable wall", "without a stable wall"  # outcomes where no wall is wanted
STIFFNESS: Final = "stiffness_max"


@dataclass(frozen=True)
class Quantile(Documented):
    """A quantile of a measure over the produced devices.

    share     0..1 of the devices that have less
    interval  the estimate and its bounds, in the measure's unit; infinite where there are too few devices
    """

    share: float = field(metadata=entry())
    interval: Interval = field(metadata=entry(spread=True))


@dataclass(frozen=True)
class MeasureQuantiles(Documented):
    """Quantiles of one measure over the drawn devices that have a value.

    name, unit  of the measure
    devices     number of those that have a value
    quantiles   () where none has one
    """

    name: str = field(metadata=entry(name="measure"))
    unit: str = field(metadata=entry(empty="null"))
    devices: int = field(metadata=entry())
    quantiles: tuple[Quantile, ...] = field(metadata=entry())


def outcome_counts(columns: Sequence[Column], cells: CellValues) -> dict[str, int]:
    """Outcome -> number of devices, from the cells (devices, columns) of the columns; those that do not occur are
    left out.

    The wanted wall is stable or unstable; where none is wanted, a device has a stable wall or none. The others are
    devices whose verdict is undecided, that cannot be built, that do not get to the handle's position, ...
    """
    names = [one.name for one in columns]
    if WALL_IS_STABLE.name in names:
        column, yes, no = names.index(WALL_IS_STABLE.name), STABLE, UNSTABLE
        good = cells.values[:, column] == 1.0
        bad = (cells.status[:, column] == OK) & ~good
    else:
        column, yes, no = names.index(STIFFNESS), WITH_WALL, WITHOUT_WALL
        good = cells.status[:, column] == OK
        bad = cells.status[:, column] == NO_VALUE
    counts = {yes: int(good.sum()), no: int(bad.sum())}
    for kind in np.unique(cells.status[~good & ~bad, column]).tolist():
        counts[STATUS[kind]] = int((cells.status[~good & ~bad, column] == kind).sum())
    return {name: count for name, count in counts.items() if count}


def stable_marks(columns: Sequence[Column], cells: CellValues) -> Flags:
    """Whether each device (n,) renders the wanted wall stably, beyond doubt."""
    column = [one.name for one in columns].index(WALL_IS_STABLE.name)
    return np.asarray(cells.values[:, column] == 1.0)


def counted_values(column: Column, values: Floats, status: NDArray[np.uint8]) -> tuple[Floats, Flags]:
    """A measure of all devices (n,), and which of them (n,) have a value; the others have 0 in its place.

    values, status  (n,)  as computed

    A device without a stable wall has a largest stiffness of 0: what it can render. One that cannot be built or
    does not get to the handle's position has none.
    """
    known = status == OK
    if column.name == STIFFNESS:
        known = known | (status == NO_VALUE)
    return np.where(status == OK, values, 0.0), known


def measure_quantiles(
    columns: Sequence[Column], cells: CellValues, shares: Sequence[float]
) -> list[MeasureQuantiles]:
    """Quantiles at `shares` (0 to 1) of each measure over the devices of the cells (devices, columns); the wanted
    wall's verdict, which has none, is left out."""
    found = []
    for n, column in enumerate(columns):
        if column.name == WALL_IS_STABLE.name:
            continue
        values, known = counted_values(column, cells.values[:, n], cells.status[:, n])
        ordered = np.sort(values[known])
        each = (
            tuple(Quantile(share, quantile_interval(ordered, share)) for share in shares) if len(ordered) else ()
        )
        found.append(MeasureQuantiles(column.name, column.unit, len(ordered), each))
    return found


def all_indices(columns: Sequence[Column], cells: CellValues, keys: Sequence[str], seed: int) -> list[Indices]:
    """Indices of the wanted wall, of having any stable wall, and of each measure.

    Devices without an answer are never a nan among the outcomes, which would make every index nan: of the wall and
    the largest stiffness they are outcomes of their own, 0; of other measures there is then no index but one of
    having a value, for leaving such devices out would bias it. A wall with undecided verdicts has none either.
    """
    return [
        indices_of(name, words, outcome, keys, seed) if not reason else Indices(name, words, (), reason)
        for name, words, outcome, reason in _outcomes(columns, cells)
    ]


def _outcomes(columns: Sequence[Column], cells: CellValues) -> Iterator[tuple[str, str, Floats, str]]:
    """Yield name, meaning and value (devices,) of each outcome, and why it has no indices; "" where it has. The
    wanted wall's verdict comes first.

    cells  (devices, columns)  of those that `indices_of` wants
    """
    names = [one.name for one in columns]
    order = sorted(range(len(columns)), key=lambda n: names[n] != WALL_IS_STABLE.name)
    for n in order:
        column, values, status = columns[n], cells.values[:, n], cells.status[:, n]
        undecided = int((status == UNDECIDED).sum())
        if column.name == WALL_IS_STABLE.name:
            words = "1 where the wanted wall is stable, else 0, also for devices that cannot be built or asked"
            why_none = f"{undecided} of {len(status)} verdicts are undecided" if undecided else ""
            yield column.name, words, np.where(status == OK, values, 0.0), why_none
        elif column.name == STIFFNESS:
            has_wall = np.where(status == OK, 1.0, 0.0)
            why_none = f"{undecided} charts are undecided" if undecided else ""
            words = "1 where any wall with K > 0, B >= 0 is stable, else 0"
            yield "has_stable_wall", words, has_wall, why_none
            yield (
                column.name,
                "largest stiffness, 0 where no wall is stable",
                np.where(status == OK, values, 0.0),
                why_none,
            )
        else:
            without = int((status != OK).sum())
            if without:
                words = f"1 where {column.name} has a value, else 0"
                yield f"has_value({column.name})", words, np.where(status == OK, 1.0, 0.0), ""
            why_none = f"{without} of {len(status)} devices have no value, and leaving them out would bias it"
            yield column.name, column.title, np.where(status == OK, values, 0.0), why_none if without else ""


RESAMPLES: Final = 500


@dataclass(frozen=True)
class Index(Documented):
    """The indices of one tolerance for one outcome.

    key    of the tolerance
    first  of first order
    total  of all orders
    """

    key: str = field(metadata=entry())
    first: Interval = field(metadata=entry(value=under("first"), spread=True))
    total: Interval = field(metadata=entry(value=under("total"), spread=True))

    @property
    @documented(name="first_differs_from_0", before="total")
    def first_is_certain(self) -> bool:
        """Whether the first order can be told from 0: its interval does not hold 0."""
        return self.first.low > 0.0

    @property
    @documented(name="total_differs_from_0")
    def total_is_certain(self) -> bool:
        """Whether the total index can be told from 0."""
        return self.total.low > 0.0


@dataclass(frozen=True)
class Indices(Documented):
    """The indices of all tolerances for one outcome, or why there are none.

    name     of the outcome: a measure, `wall_is_stable`, `has_stable_wall`, or `has_value(MEASURE)`
    of       what the outcome is, in words
    indices  one for each tolerance; () where there are none
    reason   why there are none; "" where there are
    """

    name: str = field(metadata=entry(name="outcome"))
    of: str = field(metadata=entry(name="meaning"))
    indices: tuple[Index, ...] = field(metadata=entry())
    reason: str = field(default="", metadata=entry(empty="null"))


def sampled_shares(count: int, samples: int, seed: int) -> Floats:
    """Shares 0..1, an array (samples * (count + 2), count), of the devices that indices of `count` tolerances
    need."""
    from SALib.sample import sobol

    problem = _salib_problem([str(n) for n in range(count)])
    return np.asarray(sobol.sample(problem, samples, calc_second_order=False, scramble=True, seed=seed))


def indices_of(name: str, of: str, outcome: Floats, keys: Sequence[str], seed: int) -> Indices:
    """The indices of an outcome.

    outcome  (samples * (tolerances + 2),) of the devices of `sampled_shares`; none is nan
    keys     of the tolerances
    seed     of the resamples that the intervals are from
    """
    if np.ptp(outcome) == 0.0:
        return Indices(name, of, (), f"it is {outcome[0]:.6g} for all {len(outcome)} devices")
    from SALib.analyze import sobol

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of resamples that happen to be constant
        # SALib takes a seed of 0 for none, and would then draw from numpy's shared stream
        found = sobol.analyze(
            _salib_problem(keys),
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


def _salib_problem(keys: Sequence[str]) -> dict[str, Any]:
    """The problem as SALib takes it: each tolerance a variable, by its share 0..1."""
    return {"num_vars": len(keys), "names": list(keys), "bounds": [[0.0, 1.0]] * len(keys)}
