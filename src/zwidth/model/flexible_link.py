"""A link that bends: a beam along its x axis, and what the beam carries.

The link's mass, centre of mass and inertia are those of the whole, as of a rigid link. Of these the beam has what
its mass per length makes; the rest is a rigid body that the beam carries at its nearest station.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.beam_section import BeamProperties
from zwidth.model.flexible_body import FlexibleBody, clamped_frequencies

Method = Literal["assumed-modes", "finite-elements", "lumped"]


class BeamError(ValueError):
    """A beam that its link cannot be.

    link  its name;   key  of its table that is wrong: "mass_kg", "inertia_kg_m2" or "beam.modes"
    """

    def __init__(self, link: str, key: str, message: str) -> None:
        self.link, self.key = link, key
        super().__init__(message)


@dataclass(frozen=True)
class FlexibleLink:
    """A beam in place of a rigid link.

    link           index of the link
    beam           its properties;   body  the beam, with a station at each place where something is fixed to it
    method         by which it is modelled;   modes  that it keeps beside its static deflections, as asked for
    damping_time   damping of the beam's own, this times its stiffness [s]
    carried_mass, carried_center (3,), carried_inertia (3, 3)  of the rest of the link, in its frame, the inertia
                   about the centre [kg], [m], [kg m^2]
    """

    link: int
    beam: BeamProperties
    body: FlexibleBody
    method: Method
    modes: int = 0
    damping_time: float = 0.0
    carried_mass: float = 0.0
    carried_center: Floats = field(default_factory=lambda: np.zeros(3))
    carried_inertia: Floats = field(default_factory=lambda: np.zeros((3, 3)))

    @property
    def size(self) -> int:
        """Number of elastic coordinates."""
        return len(self.body.stiffness)

    def station_of(self, local: Floats) -> int:
        """The station to which a point (3,) of the link's frame is fixed."""
        along = min(max(float(local[0]), 0.0), self.beam.length)
        return int(np.argmin(np.abs(self.body.stations - along)))

    @property
    def frequencies(self) -> Floats:
        """Natural frequencies of the beam alone, clamped at its base, ascending [Hz]."""
        return clamped_frequencies(self.body)
