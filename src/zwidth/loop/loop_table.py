"""Many loops as arrays, the form in which kernels take them.

What a controller's signals pass, force path and velocity estimate, are factors in d = z - 1; so are low passes.
All numbers may have leading axes of designs (`model.design_axes`); the factors then have them, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.loop.controller import Butterworth, Controller, FirstOrder, whole_samples
from zwidth.loop.estimator import Estimator
from zwidth.loop.hold import lag_share
from zwidth.model.design_axes import design_shape, stack_numbers

if TYPE_CHECKING:
    from zwidth.loop.loop import Loop


Rows = list[list[Any]]  # numbers, or arrays over designs


@dataclass(frozen=True)
class Filter:
    """product of numerators / product of denominators, (..., k, 3) rows c2, c1, c0 of  c2 d^2 + c1 d + c0."""

    numerator: Floats
    denominator: Floats


NO_FILTER = Filter(np.zeros((0, 3)), np.zeros((0, 3)))


def first_order_factors(low_pass: FirstOrder, period: float) -> tuple[Rows, Rows]:
    """Backward Euler of 1/(tau s + 1):  (1 - a) z / (z - a),  a = tau / (tau + T)."""
    share = period / (low_pass.time_constant + period)
    return [[0.0, share, share]], [[0.0, 1.0, share]]


def butterworth_factors(low_pass: Butterworth, period: float) -> tuple[Rows, Rows]:
    """Butterworth by s = (2/T) (z - 1)/(z + 1), of unit gain at z = 1 (thesis 3.17-3.19 for order 2).

    With u = w_c T / 2 (prewarped: tan of it) a pair of analog poles of damping ratio q becomes

        u^2 (d + 2)^2 / [ (1 + 2 q u + u^2) d^2 + (4 q u + 4 u^2) d + 4 u^2 ]
    """
    u = np.pi * low_pass.cutoff_Hz * period
    if low_pass.discretisation == "tustin-prewarped":
        u = np.tan(u)
    numerators, denominators = [], []
    for k in range(low_pass.order // 2):
        q = np.sin(np.pi * (2 * k + 1) / (2 * low_pass.order))
        lead = 1.0 + 2.0 * q * u + u * u
        gain = u * u / lead
        numerators.append([gain, 4.0 * gain, 4.0 * gain])
        denominators.append([1.0, 4.0 * (q * u + u * u) / lead, 4.0 * u * u / lead])
    if low_pass.order % 2:
        gain = u / (1.0 + u)
        numerators.append([0.0, gain, 2.0 * gain])
        denominators.append([0.0, 1.0, 2.0 * gain])
    return numerators, denominators


def low_pass_factors(low_pass: FirstOrder | Butterworth | None, period: float) -> tuple[Rows, Rows]:
    """Numerator and denominator factors of a low pass; two empty lists for None."""
    match low_pass:
        case FirstOrder():
            return first_order_factors(low_pass, period)
        case Butterworth():
            return butterworth_factors(low_pass, period)
        case None:
            return [], []


def factor_roots(rows: Rows) -> list[complex]:
    """Roots in d of factors c2 d^2 + c1 d + c0 of one design, both real ones without cancellation."""
    roots = list[complex]()
    for c2, c1, c0 in rows:
        if c2 == 0.0:
            roots += [-c0 / c1] if c1 != 0.0 else []
            continue
        mean, gap = -0.5 * c1 / c2, (0.5 * c1 / c2) ** 2 - c0 / c2
        if gap < 0.0:
            roots += [complex(mean, side * (-gap) ** 0.5) for side in (1.0, -1.0)]
        else:
            large = mean - gap**0.5 if mean <= 0.0 else mean + gap**0.5
            roots += [large, c0 / (c2 * large) if large != 0.0 else 0.0]
    return roots


def _factor_array(rows: Rows) -> Floats:
    """Rows as an array (..., k, 3), for no rows too."""
    return stack_numbers(rows) if rows else np.zeros((0, 3))


def _in_series(first: Floats, second: Floats) -> Floats:
    """Factors (..., k, 3), then others (..., m, 3)."""
    if first.ndim == second.ndim == 2:
        return np.concatenate([first, second])
    designs = np.broadcast_shapes(first.shape[:-2], second.shape[:-2])
    return np.concatenate([np.broadcast_to(one, (*designs, *one.shape[-2:])) for one in (first, second)], axis=-2)


def force_filter(controller: Controller) -> Filter:
    """Filter of the whole force, F(z)."""
    top, bottom = low_pass_factors(controller.force_filter, controller.sampling_period)
    return Filter(_factor_array(top), _factor_array(bottom))


def force_path(controller: Controller) -> Filter:
    """The force filter, then the actuator's lag 1/(d + s); the lag's numerators are in the rows of `loop.hold`."""
    low_pass, lag = force_filter(controller), controller.actuator_time_constant
    if not np.any(lag):
        return low_pass
    share = lag_share(controller.sampling_period, lag)
    return Filter(
        _in_series(low_pass.numerator, _factor_array([[0.0, 0.0, 1.0]])),
        _in_series(low_pass.denominator, _factor_array([[0.0, 1.0, share]])),
    )


def velocity_estimator(controller: Controller) -> Estimator:
    """The controller's velocity estimate through its velocity filter."""
    estimate = controller.velocity.estimator(controller.sampling_period)
    top, bottom = low_pass_factors(controller.velocity_filter, controller.sampling_period)
    return Estimator(
        _in_series(estimate.numerator, _factor_array(top)),
        _in_series(estimate.denominator, _factor_array(bottom)),
        estimate.window,
    )


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
