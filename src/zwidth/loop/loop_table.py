"""Many loops as arrays, the form in which kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.loop.controller import Controller
from zwidth.loop.filters import force_path, velocity_estimator
from zwidth.loop.loop import Loop

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


def table_of_loop(loop: Loop) -> LoopTable:
    """A single loop. Raises what `loop.sections.sampled_sections` raises."""
    rows = loop.sections.rows
    return loop_table(rows[None], [len(rows)], [loop.controller], [0])


def loop_table(
    rows: Floats, section_count: ArrayLike, controllers: Sequence[Controller], computer: ArrayLike
) -> LoopTable:
    """Plants by their sections, each with one of several controllers.

    rows, section_count, computer  as in `LoopTable`
    """
    paths = [force_path(controller) for controller in controllers]
    estimators = [velocity_estimator(controller) for controller in controllers]
    force, force_count = _factors([(path.numerator, path.denominator) for path in paths])
    velocity, velocity_count = _factors([(each.numerator, each.denominator) for each in estimators])
    window_count = np.array([len(each.window) for each in estimators], dtype=np.int64)
    window = np.zeros((len(controllers), window_count.max()))
    for line, each in zip(window, estimators, strict=True):
        line[: len(each.window)] = each.window
    return LoopTable(
        np.ascontiguousarray(rows),
        np.asarray(section_count, dtype=np.int64),
        np.asarray(computer, dtype=np.int64),
        np.array([controller.sampling_period for controller in controllers]),
        np.array([controller.whole_delay for controller in controllers], dtype=np.int64),
        np.array([controller.fractional_delay > 0.0 for controller in controllers], dtype=np.int64),
        force,
        force_count,
        velocity,
        velocity_count,
        window,
        window_count,
    )


def _factors(pairs: list[tuple[Floats, Floats]]) -> tuple[Floats, Whole]:
    """Numerators and denominators (k, 3) of several computers side by side, and how many factors each has."""
    counts = np.array([len(bottom) for _, bottom in pairs], dtype=np.int64)
    out = np.zeros((len(pairs), counts.max(), 6))
    for line, (top, bottom) in zip(out, pairs, strict=True):
        line[: len(top), :3], line[: len(top), 3:] = top, bottom
    return out, counts
