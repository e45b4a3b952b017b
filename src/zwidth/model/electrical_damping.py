"""Dampers that work on one velocity each: of motors whose windings are closed, with a lag or without."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.mechanism import Drives
from zwidth.model.motion_projection import project_onto_motions
from zwidth.model.plant import LaggedDamper, Plant


def add_dampers(plant: Plant, dampers: Sequence[LaggedDamper]) -> Plant:
    """The plant with more dampers; those without lag, time_constant 0, go into its damping matrix.

    >>> one = np.ones(1)
    >>> plain = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> add_dampers(plain, [LaggedDamper(one, 2.0, 0.0)]).damping
    array([[2.]])
    """
    working = [d for d in dampers if d.damping > 0.0 and np.any(d.along)]
    drag = [d.damping * np.outer(d.along, d.along) for d in working if d.time_constant == 0.0]
    return replace(
        plant,
        damping=sum(drag, plant.damping),
        lagged_dampers=plant.lagged_dampers + tuple(d for d in working if d.time_constant > 0.0),
    )


def winding_dampers(drives: Drives, motors: Floats) -> list[LaggedDamper]:
    """The electrical dampers of drives whose windings are closed, n^2 k_t^2/R at the joint, lagging by L/R.

    motors  (d, n)  row i: the coordinate, among a plant's n, that turns with the motor of drive i
    """
    if drives.winding_damping is None or drives.winding_time_constant is None:
        return []
    damping = drives.transmission**2 * drives.winding_damping
    return [
        LaggedDamper(along, float(c), float(tau))
        for along, c, tau in zip(motors, damping, drives.winding_time_constant, strict=True)
        if c > 0.0
    ]


def project_dampers(dampers: Sequence[LaggedDamper], motions: Floats) -> list[LaggedDamper]:
    """Dampers as they work on motions: along is what one metre of each motion moves them by.

    motions  (n, m)  a motion in each column; a reduced plant's coordinates say how much of each there is
    """
    return [replace(d, along=project_onto_motions(d.along, motions)) for d in dampers]
