"""Where a device's own damping comes from, and what it is on the coordinates of a plant.

Three sources, each applied to the full model's matrices here and to the reduced models in `reduction`:

- `ModalDamping`: the same ratio on every flexible mode, none on the modes in which nothing deflects;
- `ProportionalDamping`: B = r_m M + r_k K                                        (thesis eq. 3.2);
- `GivenDamping`: the dampers given beside each drive's stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.design_axes import Number
from zwidth.model.modes import undamped_modes


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
