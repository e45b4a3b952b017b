"""A plant as masses in a row, where it is such a row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.plant import Plant


@dataclass(frozen=True)
class MassChain:
    """Masses in a row.

    mass       (n,)     [kg]
    stiffness  (n + 1,)  springs: ground to first, between neighbours, last to ground [N/m]
    damping    (n + 1,)  dampers in the same places [N s/m]
    """

    mass: Floats
    stiffness: Floats
    damping: Floats


def as_chain(plant: Plant) -> MassChain | None:
    """The plant as a row of masses joined to their neighbours and to the ground at the ends; None if it is not."""
    n = plant.size
    links = []
    if np.any(plant.mass != np.diag(np.diag(plant.mass))):
        return None
    for matrix in (plant.stiffness, plant.damping):
        scale = float(np.max(np.abs(matrix))) or 1.0
        between = -np.diag(matrix, 1)
        far = matrix - np.diag(np.diag(matrix)) + np.diag(between, 1) + np.diag(between, -1)
        to_ground = matrix.sum(axis=1)
        if np.any(far != 0.0) or np.any(between < 0.0) or np.any(np.abs(to_ground[1:-1]) > 1e-12 * scale):
            return None
        to_ground = np.where(np.abs(to_ground) > 1e-12 * scale, to_ground, 0.0)
        last = to_ground[-1] if n > 1 else 0.0
        if to_ground[0] < 0.0 or last < 0.0:
            return None
        links.append(np.concatenate([[to_ground[0]], between, [last]]))
    return MassChain(np.diag(plant.mass), links[0], links[1])
