"""Where a device's own damping comes from, and what it is on the coordinates of a plant.

Three sources, each applied to the full model's matrices here and to the reduced models in `reduction`:

- `ModalDamping`: the same ratio on every flexible mode, none on the modes in which nothing deflects;
- `ProportionalDamping`: B = r_m M + r_k K                                        (thesis eq. 3.2);
- `GivenDamping`: the dampers given beside each drive's stiffness.

Dampers that work on one velocity each: of motors whose windings are closed, with a lag or without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.design_axes import Number
from zwidth.model.mechanism import Drives
from zwidth.model.modes import undamped_modes
from zwidth.model.nonlinear import project_onto_motions
from zwidth.model.plant import LaggedDamper, Plant


@dataclass(frozen=True)
class ModalDamping:
    """Damping ratio zeta of every flexible mode, 0.05 for 5 %; at least 0."""

    ratio: Number

    def __post_init__(self) -> None:
        _check("damping ratio", self.ratio)


@dataclass(frozen=True)
class ProportionalDamping:
    """B = r_m M + r_k K, both coefficients at least 0 (thesis eq. 3.2)."""

    mass_coefficient_1_per_s: Number
    stiffness_coefficient_s: Number

    def __post_init__(self) -> None:
        _check("mass coefficient", self.mass_coefficient_1_per_s)
        _check("stiffness coefficient", self.stiffness_coefficient_s)


@dataclass(frozen=True)
class GivenDamping:
    """The dampers of the drives, parallel to their stiffnesses (`Drives.damping`)."""


Damping = ModalDamping | ProportionalDamping | GivenDamping


def modal_matrix(mass: Floats, stiffness: Floats, ratio: float) -> Floats:
    """B = M V diag(2 zeta w) V^T M: damping ratio zeta on every flexible mode, none on rigid ones; (n, n)."""
    squared, shapes = undamped_modes(mass, stiffness)
    MV = mass @ shapes
    B: Floats = (MV * (2.0 * ratio * np.sqrt(np.maximum(squared, 0.0)))) @ MV.T
    return 0.5 * (B + B.T)


def _check(what: str, value: float) -> None:
    if not np.all(np.isfinite(value) & (np.asarray(value) >= 0.0)):
        raise ValueError(f"the {what} must be a finite number of at least 0, got {value}")


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
