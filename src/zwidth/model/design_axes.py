"""Designs side by side: numbers with leading axes, and how one design is taken out of them.

A field of a dataclass whose numbers may differ from design to design is declared as `Number`, `Array1`, `Array2`
or `Array3`: an array has so many axes of its own, and before them those of the designs where there are several.
What has no axes of designs is the same for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Annotated, Any, TypeAlias, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats

Change: TypeAlias = Callable[[NDArray[Any]], NDArray[Any]]
T = TypeVar("T")


@dataclass(frozen=True)
class OwnAxes:
    """How many trailing axes an array has of its own; the rest are axes of designs."""

    count: int


Number = Annotated[float, OwnAxes(0)]
Array1 = Annotated[Floats, OwnAxes(1)]
Array2 = Annotated[Floats, OwnAxes(2)]
Array3 = Annotated[Floats, OwnAxes(3)]

_own_axes: dict[type, dict[str, int | None]] = {}  # of each field of a class, read from its annotations once


def design_shape(value: object) -> tuple[int, ...]:
    """Axes of designs that all numbers of a dataclass, and of what it holds, have together; () for one design."""
    return np.broadcast_shapes(*(array.shape[: array.ndim - own] for array, own in _arrays(value)))


def change_designs(value: T, change: Change, shape: tuple[int, ...]) -> T:
    """A dataclass with a change of the axes of designs, such as an index, made to all numbers that have any.

    change  gets arrays whose leading axes are `shape`
    shape   of the designs, or one to which theirs broadcasts
    """
    return value if not design_shape(value) else _changed(value, change, shape)


def differing_fields(owner: object, names: Sequence[str]) -> tuple[str, ...]:
    """Which of an object's fields, by name, have axes of designs."""
    return tuple(name for name in names if design_shape(getattr(owner, name)))


def change_fields(owner: object, names: Sequence[str], change: Change, shape: tuple[int, ...]) -> dict[str, Any]:
    """Fields of an object after a change of the axes of designs, by name; see `change_designs`."""
    return {name: change_designs(getattr(owner, name), change, shape) for name in names}


def at_index(index: Any) -> Change:
    """The change that takes the designs at an index of the axes of designs, as numpy takes it."""
    return lambda array: np.asarray(array[index])


def in_one_axis(count: int) -> Change:
    """The change that puts the first `count` axes into one."""
    return lambda array: array.reshape(-1, *array.shape[count:])


def _changed(value: Any, change: Change, shape: tuple[int, ...]) -> Any:
    """A dataclass, or a tuple of such, with the change made to its arrays of designs; any other value itself.
    change, shape: as of `change_designs`."""
    if isinstance(value, tuple):
        return tuple(_changed(one, change, shape) for one in value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    made = {
        name: _changed(inner, change, shape) if own is None else _changed_numbers(inner, own, change, shape)
        for name, inner, own in _fields(value)
    }
    return replace(value, **{name: new for name, new in made.items() if new is not getattr(value, name)})


def _changed_numbers(numbers: Any, own: int, change: Change, shape: tuple[int, ...]) -> Any:
    """An array, or a dictionary of such, with the change made to all axes but its `own` last, if it has more."""
    if isinstance(numbers, Mapping):
        return {name: _changed_numbers(one, own, change, shape) for name, one in numbers.items()}
    if not isinstance(numbers, np.ndarray) or numbers.ndim <= own:
        return numbers
    made = np.asarray(change(np.broadcast_to(numbers, (*shape, *numbers.shape[numbers.ndim - own :]))))
    # one number of one design is a plain one, as everywhere else
    return made.item() if made.ndim == 0 else np.array(made)


def _arrays(value: Any) -> Iterator[tuple[NDArray[Any], int]]:
    """Every array that has axes of designs in a dataclass, or a tuple of such, with the number of its own axes."""
    if isinstance(value, tuple):
        for one in value:
            yield from _arrays(one)
    elif is_dataclass(value) and not isinstance(value, type):
        for _, inner, own in _fields(value):
            if own is None:
                yield from _arrays(inner)
                continue
            for numbers in inner.values() if isinstance(inner, Mapping) else [inner]:
                if isinstance(numbers, np.ndarray) and numbers.ndim > own:
                    yield numbers, own


def _fields(value: Any) -> Iterator[tuple[str, Any, int | None]]:
    """Name and value of each field, and how many axes of its own it has; None where it is no number."""
    kind = type(value)
    if kind not in _own_axes:
        hints = get_type_hints(kind, include_extras=True)
        _own_axes[kind] = {one.name: _own_axes_of_hint(hints[one.name]) for one in fields(value)}
    for name, own in _own_axes[kind].items():
        yield name, getattr(value, name), own


def stack_numbers(nested: Any) -> Floats:
    """Nested lists of numbers, some with axes of designs, as one array: those axes, then those of the lists.

    >>> stack_numbers([[1.0, np.array([2.0, 3.0])]]).tolist()
    [[[1.0, 2.0]], [[1.0, 3.0]]]
    """
    depth, first = 0, nested
    while isinstance(first, list | tuple) and first:
        depth, first = depth + 1, first[0]
    with suppress(ValueError):  # of arrays among numbers
        plain = np.array(nested, dtype=np.float64)
        if not depth or plain.ndim == depth:
            return plain
    return join_designs([stack_numbers(one) for one in nested], depth - 1)


def stack_columns(columns: Mapping[str, Sequence[Any]]) -> dict[str, Floats]:
    """Each column of a table as one array (..., rows, own axes); its rows are numbers or nested lists of them.

    >>> table = stack_columns({"mass": [1.0, np.array([2.0, 3.0])], "tip": [[0.1, 0.0], [0.2, 0.0]]})
    >>> {name: column.shape for name, column in table.items()}
    {'mass': (2, 2), 'tip': (2, 2)}
    """
    return {name: stack_numbers(list(rows)) for name, rows in columns.items()}


def join_designs(arrays: Sequence[Floats], own: int) -> Floats:
    """Arrays (..., own axes) as one, with a new axis between the axes of designs and the own ones."""
    designs = np.broadcast_shapes(*(array.shape[: array.ndim - own] for array in arrays))
    full = [np.broadcast_to(array, (*designs, *array.shape[array.ndim - own :])) for array in arrays]
    return np.stack(full, axis=len(designs))


def _own_axes_of_hint(hint: Any) -> int | None:
    """The number of own axes that a field's type states, also inside `| None` and a dictionary's values; None
    where it states none."""
    for part in get_args(hint):
        if isinstance(part, OwnAxes):
            return part.count
        if (inner := _own_axes_of_hint(part)) is not None:
            return inner
    return None
