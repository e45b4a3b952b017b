"""The rendered direction's dynamics: M x'' + B x' + K x = actuator * force, and what reads and holds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Plant:
    """Linear dynamics about the haptic equilibrium (thesis eq. 2.5).

        M x'' + B x' + K x = actuator * f,     y = sensor . x

    mass       (n, n)  symmetric positive definite [kg]
    damping    (n, n)  symmetric [N s/m]
    stiffness  (n, n)  symmetric [N/m]
    actuator   (n,)    where the wall force f acts
    sensor     (n,)    what the encoder reads
    handle     (n,)    where the operator holds it; None: not known
    names      (n,)    coordinates, for people
    """

    mass: Floats
    damping: Floats
    stiffness: Floats
    actuator: Floats
    sensor: Floats
    handle: Floats | None = None
    names: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.mass.shape[-1])
