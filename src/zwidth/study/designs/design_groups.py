"""Designs of a study that are built and measured together: those that consist of the same parts.

Which designs are computed together never changes a design's result: every step looks at its own numbers alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.point_chart import table_of_points
from zwidth.device import address
from zwidth.device.design_batch import DesignBatch, design_batch, takes_arrays
from zwidth.device.faults import KeyPath
from zwidth.device.load import check, with_operator
from zwidth.errors import DeviceError, PostureError
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.posture import OK
from zwidth.study.designs.sampling import CIRCUMSTANCES, WANTED

Rows = Ints


class DesignColumn(NamedTuple):
    """What one key is in each of P designs.

    key     a path of the device file, "operator" or another circumstance
    values  the values that it takes
    places  (P,) which of them each design has
    """

    key: str
    values: Sequence[Any]
    places: Rows


@dataclass(frozen=True)
class DesignGroup:
    """Designs of the same parts.

    rows         (P,)  their numbers, from the first that was asked for
    batch        all of them
    valid        (P,)  whether each is certain to be valid; one that is not is to be built alone
    positions    (P, 2) or (P, 3)  of the handle, where they differ; None: the same for all
    chosen       circumstances that are the same for all, by key
    """

    rows: Rows
    batch: DesignBatch
    valid: Flags
    positions: Floats | None
    chosen: dict[str, Any]


class DesignGrouping:
    """How the designs of a study fall into groups.

    document   of the device;   label  of it, for messages
    operators  as in `Study`
    """

    def __init__(self, document: dict[str, Any], label: str, operators: Mapping[str, Any]) -> None:
        self.document, self.label, self.operators = document, label, operators
        self._steps: dict[str, KeyPath | None] = {}
        self._documents: dict[tuple[Any, ...], dict[str, Any] | None] = {}

    def groups(self, columns: Sequence[DesignColumn]) -> Iterator[DesignGroup]:
        """The groups of designs; those of which no batch can be built are in none. Without columns there is none.

        columns  all keys that may differ from the document's, or from each other
        """
        if not columns:
            return
        kinds = [self._kinds(one.key, one.values) for one in columns]
        codes = [code[one.places] for (code, _), one in zip(kinds, columns, strict=True)]  # (P,) of each column
        combinations, group_of = np.unique(np.stack(codes, axis=1), axis=0, return_inverse=True)
        for n, combination in enumerate(combinations):
            rows = np.flatnonzero(group_of.ravel() == n)
            kind = tuple(  # key of each column with the name of its values' kind
                (one.key, names[code]) for one, (_, names), code in zip(columns, kinds, combination, strict=True)
            )
            group = self._group(rows, kind, [one._replace(places=one.places[rows]) for one in columns])
            if group is not None:
                yield group

    def _kinds(self, key: str, values: Sequence[Any]) -> tuple[Ints, Sequence[Any]]:
        """For each value (k,) a number that stands for its kind, and the kinds by these numbers. Designs that are
        built together have values of the same kind."""
        steps = self._path(key)
        if key in WANTED:  # no part of the device: all values are alike
            return np.zeros(len(values), dtype=np.int64), [None]
        if steps is not None and takes_arrays(steps) and all(type(value) in (int, float) for value in values):
            numbers = np.array(values, dtype=np.float64)
            zero = (numbers == 0.0) & (not _in_list(steps))  # takes a part of the device away
            return np.where(zero, 1, np.where(np.isfinite(numbers), 0, 2)), ["number", "0", "not finite"]
        number_of: dict[str, int] = {}
        code = [number_of.setdefault(self._kind(key, steps, value), len(number_of)) for value in values]
        return np.array(code), list(number_of)

    def _kind(self, key: str, steps: KeyPath | None, value: Any) -> str:
        """Kind of one value of a key, `steps` its path: "number" for all that arrays may hold, else the value as
        text; of a list that of each."""
        if isinstance(value, list | tuple) and (key == "at" or (steps is not None and takes_arrays(steps))):
            return f"[{', '.join(self._kind(key, steps, inner) for inner in value)}]"
        number = isinstance(value, int | float) and not isinstance(value, bool)
        in_array = number and (key == "at" or (steps is not None and takes_arrays(steps) and value != 0))
        return "number" if in_array else repr(value)

    def _path(self, key: str) -> KeyPath | None:
        """The resolved path of a key; None for a circumstance, and where the document has no such place."""
        if key not in self._steps:
            try:
                self._steps[key] = None if key in CIRCUMSTANCES else address.resolve(self.document, key)
            except DeviceError:
                self._steps[key] = None
        return self._steps[key]

    def _group(self, rows: Rows, kind: tuple[Any, ...], taken: list[DesignColumn]) -> DesignGroup | None:
        """The group of the designs `rows`, which all have one kind; None where no batch can be built of them.

        kind   each key with the name of its values' kind (`_kinds`)
        taken  the columns, of these designs alone
        """
        document = self._valid_document(kind, taken, len(rows))
        if document is None:
            return None
        positions, columns = None, {}  # columns: resolved path -> numbers (P, ...)
        # of the first design
        example = {key: values[places[0]] for key, values, places in taken}
        for key, values, places in taken:
            if key == "at" and isinstance(example["at"], list | tuple):  # joint angles have no array
                positions = np.array(values, dtype=np.float64)[places]
            steps = self._path(key)
            if steps is not None and takes_arrays(steps) and _holds(document, steps):
                columns[steps] = np.array(values, dtype=np.float64)[places]
        try:
            batch, valid = design_batch(document, columns, len(rows), self.label)
        except DeviceError:
            return None
        chosen = {key: value for key, value in example.items() if key in CIRCUMSTANCES and key not in WANTED}
        return DesignGroup(rows, batch, valid, positions, chosen)

    def _valid_document(
        self, kind: tuple[Any, ...], taken: list[DesignColumn], count: int
    ) -> dict[str, Any] | None:
        """The document of the first valid design of a kind, kept for all later designs of it; None where none of
        the `count` designs of `taken` is valid."""
        if self._documents.get(kind) is None:
            for row in range(count):
                try:
                    document = self.design_document({key: values[places[row]] for key, values, places in taken})
                    check(document, self.label)
                except DeviceError:
                    continue
                self._documents[kind] = document
                break
        return self._documents.get(kind)

    def design_document(self, chosen: Mapping[str, Any]) -> dict[str, Any]:
        """The device's document with the operator and the numbers of a design, by key; other circumstances are
        left aside. Raises DeviceError."""
        document = self.document
        if "operator" in chosen:
            document = with_operator(document, self.operators[chosen["operator"]])
        numbers = [(key, value) for key, value in chosen.items() if key not in CIRCUMSTANCES]
        return address.assign_all(document, numbers)


def _in_list(steps: KeyPath) -> bool:
    """Whether a path leads to an element of a list. A 0 there takes no part of the device away; elsewhere it may,
    as a lag of 0 does."""
    return isinstance(steps[-1], int)


def _holds(document: Any, steps: KeyPath) -> bool:
    """Whether a document has something at a path: a key may have been dropped for another that excludes it."""
    for step in steps:
        places: Any = range(len(document)) if isinstance(document, list) else document
        if not isinstance(document, list | dict) or step not in places:
            return False
        document = document[step]  # type: ignore[index]
    return True


@dataclass(frozen=True)
class BuiltDesigns:
    """Designs of the same parts, built together.

    rows   (P,)  their numbers in the study
    point  (P,)  their operating points
    """

    rows: Rows
    point: OperatingPoint

    @cached_property
    def table(self) -> LoopTable | None:
        """Their loops; one without sections, and all where this is None, are to be built alone."""
        return table_of_points(self.point)


def build_at_point(groups: Iterable[DesignGroup], point: OperatingPoint) -> Iterator[BuiltDesigns]:
    """The designs of each group at the operating point of a single device, as `Device.at_point` puts each of them.

    A design that is in none is to be built alone: it is not certain to be valid, it differs from no other of its
    group, its posture is out of reach, does not lie straight ahead or is given by joint angles, or the point has a
    response or several directions.
    """
    by_angles = isinstance(point.requested_position, Mapping)
    if by_angles or point.response is not None or point.direction_count > 1:
        return
    for group in groups:
        if not group.batch.differs:
            continue
        try:
            built, to_build_alone = group.batch.at_point(point)
        except (PostureError, DeviceError):
            continue  # each design alone says why
        kept = np.flatnonzero(group.valid & ~to_build_alone & (built.status == OK))
        if len(kept):
            yield BuiltDesigns(group.rows[kept], built[kept])
