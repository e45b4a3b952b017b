"""The largest stiffness of a device with numbers changed, to first order: for many changes at once.

Devices are built together for every change and every step that a derivative may take. What cannot be built so is
built alone, when it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from zwidth.device import address
from zwidth.device.design_batch import takes_arrays
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted
from zwidth.device.load import from_document
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import table_of_points
from zwidth.study.designs.built_designs import build_at_point
from zwidth.study.designs.design_groups import DesignColumn, DesignGrouping
from zwidth.study.sensitivity.derivative import FIRST, arguments
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
        """The loop with one of the changes, by an argument. Raises what building it alone raises."""
        key, trial = (name, argument), self._trials[name].get(argument)
        if trial is not None and trial not in self._tried:
            self._tried.add(trial)
            self._build(trial)
        if key not in self._known:
            loop = self._loop_alone(key)
            delay = loop.whole_delay, loop.fractional_delay > 0.0
            self._known[key] = ChangedLoop(self.optimum.stiffness_to_first_order(loop), delay)
        return self._known[key]

    def _loop_alone(self, key: Argument) -> Loop:
        if key in self._built:
            together, place = self._built[key]
            return together[place].loop
        name, argument = key
        changed = [(dotted(steps, self._document), argument * k) for steps, k in self.changes[name].places]
        document = address.assign_all(self._document, changed)
        return from_document(document, skip_assembly_check=True).at_point(self.point).loop

    @property
    def _document(self) -> dict[str, Any]:
        return self.device.document

    def _build(self, trial: int) -> None:
        """Build all changes together at all arguments of a trial."""
        # what the numbers' sources are changes no loop
        document = {key: part for key, part in self._document.items() if key != "sources"}
        grouping = DesignGrouping(document, self.device.label, {})
        for names in self._sets():
            keys = [(n, x) for n in names for x in arguments(self.changes[n].at, self.changes[n].scale, trial)]
            for built in build_at_point(grouping.groups(list(self._columns(keys))), self.point):
                own = [keys[row] for row in built.rows.tolist()]
                self._built.update((key, (built.point, n)) for n, key in enumerate(own))
                # a difference of loops that are known to ten digits would have too few
                table = table_of_points(built.point, coupled=False)
                if table is not None:
                    self._known.update(_read(table, own, self.optimum))

    def _sets(self) -> Iterator[list[str]]:
        """Names of changes whose devices consist of the same parts, and which take arrays."""
        together = {
            name: one for name, one in self.changes.items() if all(takes_arrays(steps) for steps, _ in one.places)
        }
        yield [name for name, one in together.items() if not one.from_nothing]
        for name, one in together.items():
            if one.from_nothing:
                yield [name]

    def _columns(self, keys: list[Argument]) -> Iterator[DesignColumn]:
        """Each number that one of these changes, where it is as in the device but in the rows of its changes."""
        values: dict[KeyPath, list[float]] = {}
        places: dict[KeyPath, np.ndarray] = {}
        for row, (name, argument) in enumerate(keys):
            change = self.changes[name]
            for steps, multiple in change.places:
                own = values.setdefault(steps, [change.at * multiple])
                places.setdefault(steps, np.zeros(len(keys), dtype=np.int64))[row] = len(own)
                own.append(argument * multiple)
        for steps, own in values.items():
            yield DesignColumn(dotted(steps, self._document), own, places[steps])


def _read(loops: LoopTable, keys: Iterable[Argument], optimum: Optimum) -> Iterator[tuple[Argument, ChangedLoop]]:
    """What is read of each loop of a table; nothing where it has no number."""
    whole, split = loops.whole_delay[loops.computer], loops.split[loops.computer]
    stiffnesses = optimum.stiffnesses_to_first_order(loops)
    for n, key in enumerate(keys):
        if np.isfinite(stiffnesses[n]):
            yield key, ChangedLoop(float(stiffnesses[n]), (int(whole[n]), bool(split[n])))
