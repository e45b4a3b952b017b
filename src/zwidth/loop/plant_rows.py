"""The rows of one plant by the kernels that serve many."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.controller import Controller
from zwidth.loop.sections_batch import fill_rows
from zwidth.model.plant import Plant
from zwidth.model.plant_modes import fill_modes

MOST: Final = 12  # coordinates of which the kernel finds the modes; of more they are found faster otherwise


def plant_rows(plant: Plant, controller: Controller) -> Floats | None:
    """The rows (m, 9) of a plant, as of `loop.sections`.

    Returns  None for a plant that `sections` says more about: dampers that couple its modes or lag, a loss factor,
             a wall force that moves nothing that the sensor reads; and for a large one
    """
    if plant.lagged_dampers or plant.hysteresis is not None or plant.size > MOST:
        return None
    n = plant.size
    numbers, drag, coupled = np.empty((5, 1, n)), np.empty((1, n, n)), np.zeros(1, dtype=np.bool_)
    decay, squared, enter, leave, handle = numbers
    M, B, K, actuator, sensor = (
        np.array(each, dtype=np.float64)[None]
        for each in (plant.mass, plant.damping, plant.stiffness, plant.actuator, plant.sensor)
    )
    fill_modes(M, B, K, actuator, sensor, actuator, decay, squared, enter, leave, handle, drag, coupled, 0, 1)
    if coupled[0] or not np.isfinite(numbers).all():
        return None
    position, none = enter * leave, np.zeros((1, n))
    reach = np.abs(enter).sum(axis=1) * np.abs(leave).sum(axis=1)
    timing = (controller.sampling_period, controller.fractional_delay, controller.actuator_time_constant)
    T, fraction, lag = np.array(timing, dtype=np.float64).reshape(3, 1)
    rows, used = np.zeros((1, n, 9)), np.empty(1, dtype=np.int64)
    fill_rows(decay, squared, position, none, reach, T, fraction, lag, bool(lag[0] > 0.0), rows, used, 0, 1)
    return rows[0, : used[0]] if used[0] > 0 else None
