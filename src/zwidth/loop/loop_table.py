"""Many loops as arrays, the form in which kernels take them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.loop.controller import Controller, whole_samples
from zwidth.loop.filters import force_path, velocity_estimator
from zwidth.model.design_axes import design_shape

if TYPE_CHECKING:
    from zwidth.loop.loop import Loop


class LoopTable(NamedTuple):
    """N loops: the sections of their plants, and the C computers that sample them.

    rows, section_count      (N, m, 9), (N,)  sections of each plant, see `loop.sections`, and how many it has
    computer                 (N,)    which computer each loop has
    period                   (C,)    sampling period of each computer [s]
    whole_delay, split       (C,)    of each computer: whole samples of delay, and 1 if the rest splits the hold
    force, force_count       (C, k, 6), (C,)  factors of the force on its way to all sections (filter and actuator
                                     lag): numerator c2, c1, c0 and denominator d2, d1, d0 of each
    velocity, velocity_count (C, v, 6), (C,)  the same of the velocity estimate
    window, window_count     (C, n), (C,)     the estimate's weights of past samples
    """

    rows: Floats
    section_count: Ints
    computer: Ints
    period: Floats
    whole_delay: Ints
    split: Ints
    force: Floats
    force_count: Ints
    velocity: Floats
    velocity_count: Ints
    window: Floats
    window_count: Ints


def table_of_loops(*loops: Loop) -> LoopTable:
    """Loops of any kinds, each with its own computer. Raises what `Loop.table` raises."""
    each = [loop.table for loop in loops]
    count = np.array([len(table.rows[0]) for table in each], dtype=np.int64)
    rows = np.zeros((len(each), count.max(), 9))
    for line, table in zip(rows, each, strict=True):
        line[: table.rows.shape[1]] = table.rows[0]
    columns = [
        ComputerColumns(**{name: getattr(table, name) for name in ComputerColumns._fields}) for table in each
    ]
    return _table(rows, count, np.arange(len(each)), columns)


def loop_table(rows: Floats, section_count: Ints, controller: Controller) -> LoopTable:
    """N plants by their sections, all with one controller, or each with its own of N designs of it.

    rows, section_count  as in `LoopTable`
    """
    columns = computer_columns(controller)
    computer = np.arange(len(rows)) if len(columns.period) > 1 else np.zeros(len(rows), dtype=np.int64)
    return _table(rows, section_count, computer, [columns])


def joined_tables(tables: Sequence[LoopTable]) -> LoopTable:
    """The loops of several tables, one table after the other."""
    rows, count = _joined([table.rows for table in tables]), _joined([table.section_count for table in tables])
    columns = [
        ComputerColumns(**{name: getattr(table, name) for name in ComputerColumns._fields}) for table in tables
    ]
    before = np.cumsum([0, *(len(table.period) for table in tables)])
    computer = [table.computer + first for table, first in zip(tables, before, strict=False)]
    return _table(rows, count, _joined(computer), columns)


class ComputerColumns(NamedTuple):
    """The computers of a controller, one or one for each of its designs: columns of a `LoopTable`."""

    period: Floats
    whole_delay: Ints
    split: Ints
    force: Floats
    force_count: Ints
    velocity: Floats
    velocity_count: Ints
    window: Floats
    window_count: Ints


def computer_columns(controller: Controller) -> ComputerColumns:
    """The columns of a controller; those of one without designs are kept for its next loop."""
    try:
        return _kept_columns(controller)
    except TypeError:  # numbers of several designs have no hash
        return _columns(controller)


@lru_cache(maxsize=64)
def _kept_columns(controller: Controller) -> ComputerColumns:
    return _columns(controller)


def _columns(controller: Controller) -> ComputerColumns:
    designs = design_shape(controller)
    period, delay = (
        np.ravel(np.broadcast_to(np.asarray(number, dtype=np.float64), designs))
        for number in (controller.sampling_period, controller.delay)
    )
    whole_delay, C = whole_samples(delay), len(period)
    path, estimate = force_path(controller), velocity_estimator(controller)
    force, velocity = (_factors(each.numerator, each.denominator, designs) for each in (path, estimate))
    return ComputerColumns(
        period.copy(),
        whole_delay,
        (delay - whole_delay > 0.0).astype(np.int64),
        force,
        np.full(C, force.shape[1]),
        velocity,
        np.full(C, velocity.shape[1]),
        np.repeat(estimate.window[None], C, axis=0),
        np.full(C, len(estimate.window)),
    )


def _factors(top: Floats, bottom: Floats, designs: tuple[int, ...]) -> Floats:
    """Numerators and denominators (..., k, 3) of several computers side by side, (C, k, 6), C of all axes of
    designs."""
    out = np.zeros((*designs, bottom.shape[-2], 6))
    out[..., :3], out[..., 3:] = top, bottom
    return out.reshape(math.prod(designs), *out.shape[-2:])


def _table(rows: Floats, section_count: Ints, computer: Ints, columns: Sequence[ComputerColumns]) -> LoopTable:
    """Plants, and computers one after the other."""
    joined = columns[0] if len(columns) == 1 else map(_joined, zip(*columns, strict=True))
    return LoopTable(
        np.ascontiguousarray(rows),
        np.asarray(section_count, dtype=np.int64),
        np.asarray(computer, dtype=np.int64),
        *joined,
    )


def _joined(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Arrays (C, ...) one after the other; shorter ones are filled up with zeros."""
    whole = tuple(np.max([part.shape[1:] for part in parts], axis=0)) if parts[0].ndim > 1 else ()
    out, at = np.zeros((sum(map(len, parts)), *whole), dtype=parts[0].dtype), 0
    for part in parts:
        out[(slice(at, at + len(part)), *(slice(n) for n in part.shape[1:]))] = part
        at += len(part)
    return out
