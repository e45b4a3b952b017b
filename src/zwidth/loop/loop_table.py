"""Many loops as arrays, the form in which kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.loop.controller import Controller, whole_samples
from zwidth.loop.filters import force_path, velocity_estimator
from zwidth.loop.loop import Loop
from zwidth.model.design_axes import design_shape

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


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
    section_count: Whole
    computer: Whole
    period: Floats
    whole_delay: Whole
    split: Whole
    force: Floats
    force_count: Whole
    velocity: Floats
    velocity_count: Whole
    window: Floats
    window_count: Whole


def table_of_loops(*loops: Loop) -> LoopTable:
    """Loops of any kinds, each with its own computer. Raises what `loop.sections.sampled_sections` raises."""
    each = [loop.sections.rows for loop in loops]
    count = np.array([len(rows) for rows in each], dtype=np.int64)
    table = np.zeros((len(each), count.max(), 9))
    for line, rows in zip(table, each, strict=True):
        line[: len(rows)] = rows
    return _table(table, count, np.arange(len(each)), [loop.controller for loop in loops])


def loop_table(rows: Floats, section_count: Whole, controller: Controller) -> LoopTable:
    """N plants by their sections, all with one controller, or each with its own of N designs of it.

    rows, section_count  as in `LoopTable`
    """
    several = len(design_shape(controller)) > 0
    computer = np.arange(len(rows)) if several else np.zeros(len(rows), dtype=np.int64)
    return _table(rows, section_count, computer, [controller])


def _table(rows: Floats, section_count: Whole, computer: Whole, controllers: Sequence[Controller]) -> LoopTable:
    """Controllers in their order, one for each computer or all computers of several designs together."""
    paths = [force_path(controller) for controller in controllers]
    estimators = [velocity_estimator(controller) for controller in controllers]
    period, delay = (
        np.concatenate([np.ravel(value) for value in values])
        for values in zip(*(_timing(controller) for controller in controllers), strict=True)
    )
    whole_delay = whole_samples(delay)
    C = len(period)
    force, force_count = _factors([(path.numerator, path.denominator) for path in paths], C)
    velocity, velocity_count = _factors([(each.numerator, each.denominator) for each in estimators], C)
    window_count = np.array([len(each.window) for each in estimators], dtype=np.int64)
    window = np.zeros((len(controllers), window_count.max()))
    for line, each in zip(window, estimators, strict=True):
        line[: len(each.window)] = each.window
    if len(controllers) < C:
        window, window_count = np.repeat(window, C, axis=0), np.repeat(window_count, C)
    return LoopTable(
        np.ascontiguousarray(rows),
        np.asarray(section_count, dtype=np.int64),
        np.asarray(computer, dtype=np.int64),
        period,
        whole_delay,
        (delay - whole_delay > 0.0).astype(np.int64),
        force,
        force_count,
        velocity,
        velocity_count,
        window,
        window_count,
    )


def _timing(controller: Controller) -> tuple[Floats, Floats]:
    """Sampling periods [s] and delays [samples] of all designs of a controller."""
    designs = design_shape(controller)
    return (
        np.broadcast_to(np.asarray(controller.sampling_period, dtype=np.float64), designs),
        np.broadcast_to(np.asarray(controller.delay, dtype=np.float64), designs),
    )


def _factors(pairs: list[tuple[Floats, Floats]], computers: int) -> tuple[Floats, Whole]:
    """Numerators and denominators (..., k, 3) of several computers side by side, and how many factors each has."""
    counts = np.array([bottom.shape[-2] for _, bottom in pairs], dtype=np.int64)
    out = np.zeros((computers, counts.max(), 6))
    if len(pairs) < computers:  # designs of one controller
        counts = np.repeat(counts, computers)
        ((top, bottom),) = pairs
        out[..., :3], out[..., 3:] = top, bottom
        return out, counts
    for line, (top, bottom) in zip(out, pairs, strict=True):
        line[: top.shape[-2], :3], line[: top.shape[-2], 3:] = top, bottom
    return out, counts
