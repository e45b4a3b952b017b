"""The largest stiffness of a device with numbers changed, to first order: for many changes at once.

Devices are built together for every change and every step that a derivative may take. What cannot be built so is
built alone, when it is asked for.

Derivatives of computed numbers are extrapolated differences, with an estimate of their error (`Derivative`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from zwidth.chart.point_chart import table_of_points
from zwidth.device import address
from zwidth.device.design_batch import takes_arrays
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted
from zwidth.device.load import from_document
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.study.designs.design_groups import DesignColumn, DesignGrouping, build_at_point
from zwidth.study.sensitivity.optimum import Optimum


@dataclass(frozen=True)
class Change:
    """A change of a device by one argument.

    places  path of each number that it changes, and what multiple of the argument that is
    at      the argument for the device itself
    scale   typical size of the argument
    """

    places: tuple[tuple[KeyPath, float], ...]
    at: float
    scale: float

    @property
    def from_nothing(self) -> bool:
        """Whether a number that is 0 becomes another. That of a list is a coordinate; else a part of the device,
        such as a lag, may come with it."""
        return self.at == 0.0 and not all(isinstance(steps[-1], int) for steps, _ in self.places)


class ChangedLoop(NamedTuple):
    """What is read of a changed device's loop.

    stiffness  `Optimum.stiffness_to_first_order` [N/m]
    delay      whole samples of delay, and whether a part of one is left
    """

    stiffness: float
    delay: tuple[int, bool]


Argument = tuple[str, float]  # name of a change, and its argument


class ChangedDevices:
    """The loops of a device at an operating point with changes, each by its name.

    optimum  the stiffest wall of the device itself

    All changes are built together for a trial, the arguments that derivatives need from one first step of FIRST.
    """

    def __init__(
        self, device: Device, point: OperatingPoint, optimum: Optimum, changes: Mapping[str, Change]
    ) -> None:
        self.device, self.point, self.optimum, self.changes = device, point, optimum, changes
        self._trials = {
            name: {x: trial for trial in reversed(range(len(FIRST))) for x in arguments(one.at, one.scale, trial)}
            for name, one in changes.items()
        }
        self._built: dict[Argument, tuple[OperatingPoint, int]] = {}
        self._known: dict[Argument, ChangedLoop] = {}
        self._tried = set[int]()

    def loop(self, name: str, argument: float) -> ChangedLoop:
        """What is read of the loop with the change `name` at an argument. Raises what building it alone raises."""
        key, trial = (name, argument), self._trials[name].get(argument)  # None: built alone
        if trial is not None and trial not in self._tried:
            self._tried.add(trial)
            self._build(trial)
        if key not in self._known:
            loop = self._loop_alone(key)
            delay = loop.whole_delay, loop.fractional_delay > 0.0
            self._known[key] = ChangedLoop(self.optimum.stiffness_to_first_order(loop), delay)
        return self._known[key]

    def _loop_alone(self, key: Argument) -> Loop:
        """The loop of one change: of a device built with others before, else built alone."""
        if key in self._built:
            together, place = self._built[key]
            return together[place].loop
        name, argument = key
        changed = [(dotted(steps, self._document), argument * k) for steps, k in self.changes[name].places]
        document = address.assign_all(self._document, changed)
        return from_document(document, skip_assembly_check=True).at_point(self.point).loop

    @property
    def _document(self) -> dict[str, Any]:
        """The document of the device itself."""
        return self.device.document

    def _build(self, trial: int) -> None:
        """Build the changes that can be built together, at all arguments of a trial, and read their loops.

        trial  number of the first step in FIRST
        """
        # what the numbers' sources are changes no loop
        document = {key: part for key, part in self._document.items() if key != "sources"}
        grouping = DesignGrouping(document, self.device.label, {})
        for names in self._names_built_together():
            keys = [(n, x) for n in names for x in arguments(self.changes[n].at, self.changes[n].scale, trial)]
            for built in build_at_point(grouping.groups(list(self._columns(keys))), self.point):
                built_keys = [keys[row] for row in built.rows.tolist()]
                self._built.update((key, (built.point, n)) for n, key in enumerate(built_keys))
                # a difference of loops that are known to ten digits would have too few
                table = table_of_points(built.point, coupled=False)
                if table is not None:
                    self._known.update(_changed_loops(table, built_keys, self.optimum))

    def _names_built_together(self) -> Iterator[list[str]]:
        """Yield lists of names of changes whose devices can be built together: all that change numbers of the
        device's own parts, and each by itself that may add a part. Changes of what arrays cannot hold are in
        none."""
        together = {
            name: one for name, one in self.changes.items() if all(takes_arrays(steps) for steps, _ in one.places)
        }
        yield [name for name, one in together.items() if not one.from_nothing]
        for name, one in together.items():
            if one.from_nothing:
                yield [name]

    def _columns(self, keys: list[Argument]) -> Iterator[DesignColumn]:
        """Each number that is changed, by its value in each row: the device's own unless the row changes it.

        keys  change's name and argument of each row
        """
        # of each number its values, the device's own first, and which of them (rows,) each row has
        values: dict[KeyPath, list[float]] = {}
        places: dict[KeyPath, np.ndarray] = {}
        for row, (name, argument) in enumerate(keys):
            change = self.changes[name]
            for steps, multiple in change.places:
                listed = values.setdefault(steps, [change.at * multiple])
                places.setdefault(steps, np.zeros(len(keys), dtype=np.int64))[row] = len(listed)
                listed.append(argument * multiple)
        for steps, listed in values.items():
            yield DesignColumn(dotted(steps, self._document), listed, places[steps])


def _changed_loops(
    loops: LoopTable, keys: Iterable[Argument], optimum: Optimum
) -> Iterator[tuple[Argument, ChangedLoop]]:
    """The `ChangedLoop` of each loop of a table, with its key; nothing where its stiffness is not finite."""
    whole, split = loops.whole_delay[loops.computer], loops.split[loops.computer]
    stiffnesses = optimum.stiffnesses_to_first_order(loops)
    for n, key in enumerate(keys):
        if np.isfinite(stiffnesses[n]):
            yield key, ChangedLoop(float(stiffnesses[n]), (int(whole[n]), bool(split[n])))


# First steps in shares of the scale: smaller where the function changes within a step, larger against rounding.
FIRST: Final = (2e-3, 1e-4, 5e-6, 1e-2, 5e-2)  # first steps in shares of the scale, as they are tried in turn
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
    """The most accurate derivative over the first steps of FIRST, tried in turn until one is accurate enough.

    quotient  step h -> difference quotient D(h)
    scale     typical size of the function's argument
    factor    as for `_richardson`
    """
    best = _richardson(quotient, FIRST[0] * scale, scale, factor)
    for first in FIRST[1:]:
        if best.error * scale <= POOR:
            break
        with suppress(ValueError):  # a large step may leave the range where a small one did not
            best = min(best, _richardson(quotient, first * scale, scale, factor), key=lambda slope: slope.error)
    return best


def _richardson(quotient: Callable[[float], float], first: float, scale: float, factor: float) -> Derivative:
    """The best entry of Richardson's table of D(h), D(h/2), ..., and its error. Column k of the table has errors
    that fall by factor^(k + 1) at each halving: 4 where D(h) has even powers of h only, 2 where it has all.

    quotient  step h -> difference quotient D(h)
    first     the first step h
    scale     typical size of the function's argument

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
            if _is_rounding(row, best):
                break
    return Derivative(best.value, max(best.error, abs(row[0] - best.value) * 2.0 ** (best_level - level)))


def _is_rounding(row: list[float], best: Derivative) -> bool:
    """Whether rounding has taken over: the newest entries are further apart than the best were."""
    return len(row) > LEVELS and abs(row[-1] - row[-2]) > 4.0 * best.error
