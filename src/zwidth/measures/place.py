"""What a measure is asked about: a device in one posture or in many, rendering one direction in each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.measures.measure import OK, MeasureError
from zwidth.model.damping import Damping, GivenDamping
from zwidth.model.effective import EffectiveParameters, effective_parameters
from zwidth.model.mechanism import Drives, Mechanism
from zwidth.model.operator import Operator, attach
from zwidth.model.plant import Plant
from zwidth.model.posture import Posture
from zwidth.model.reduction import Encoders, Model, plant_effective_parameters, reduce_mechanism, reduce_plant

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Wanted:
    """What some measures are asked with besides the device; None where it was not told.

    stiffness, damping  of the wall that is to be rendered [N/m], [N s/m]
    frequency           at which the hand moves [Hz]
    """

    stiffness: float | None = None
    damping: float | None = None
    frequency: float | None = None


@dataclass(frozen=True)
class Place:
    """A device in one posture or many (leading axes `shape`), rendering one direction in each.

    controller   the computer
    mechanism    None for a device given by its plant; then there is one place, of shape ()
    posture      (...)     None likewise
    direction    (..., 3)  unit vectors; None likewise
    given        the plant of a device given by its plant, as given; None for a mechanism
    model        "full" and so on; None: the plant as given
    damping, encoders  of the mechanism
    operator     who holds the handle; None: nobody
    wanted       the wall, and the frequency, that some measures are asked about
    """

    controller: Controller
    mechanism: Mechanism | None = None
    posture: Posture | None = None
    direction: Floats | None = None
    given: Plant | None = None
    model: Model | None = None
    damping: Damping = field(default_factory=GivenDamping)
    encoders: Encoders = "motor"
    operator: Operator | None = None
    wanted: Wanted = Wanted()

    @property
    def shape(self) -> tuple[int, ...]:
        """Leading axes of everything."""
        return () if self.posture is None else self.posture.status.shape

    @property
    def status(self) -> NDArray[np.uint8]:
        """(...) OK, OUT_OF_REACH or SINGULAR."""
        return np.array(OK, dtype=np.uint8) if self.posture is None else self.posture.status

    @property
    def jacobian(self) -> Floats:
        """J (..., 3, d) in the driven coordinates [m/rad]; nan where the posture is not OK."""
        return self.placed.jacobian

    @property
    def mass_matrix(self) -> Floats:
        """M (..., d, d) of the links in the driven coordinates [kg m^2]."""
        return self.placed.mass_matrix

    @property
    def whole_mass_matrix(self) -> Floats:
        """M (..., d, d) of links and rotors in the driven coordinates [kg m^2]."""
        drives = self.drives
        rotors = drives.transmission**2 * drives.motor_inertia
        return self.mass_matrix + rotors[..., None] * np.eye(rotors.shape[-1])

    @property
    def placed(self) -> Posture:
        """The postures. Raises MeasureError for a device given by its plant."""
        if self.posture is None:
            raise MeasureError("speaks of a mechanism, and the device is given by its plant")
        return self.posture

    @property
    def drives(self) -> Drives:
        """The mechanism's drives. Raises MeasureError for a device given by its plant."""
        if self.mechanism is None:
            raise MeasureError("speaks of a mechanism, and the device is given by its plant")
        return self.mechanism.drives

    @property
    def along(self) -> Floats:
        """h = J^T u (..., d): how the driven coordinates see the rendered direction [m/rad]."""
        assert self.direction is not None
        return np.asarray(np.einsum("...i,...id->...d", self.direction, self.jacobian))

    @cached_property
    def effective(self) -> EffectiveParameters:
        """Effective masses and stiffness (...); nan where inapplicable."""
        if self.given is not None:
            return plant_effective_parameters(self.given)
        assert self.mechanism is not None
        assert self.direction is not None
        return effective_parameters(self.mechanism, self.placed, self.direction)

    def at(self, *index: int | NDArray[np.int64]) -> Place:
        """One of the places, of shape (), or several, in any order and number; a plant has but one."""
        return self if self.posture is None else self._posed(lambda array: array[index])

    @property
    def flat(self) -> Place:
        """All places in one row. Raises MeasureError for a device given by its plant."""
        axes = self.placed.status.ndim
        return self._posed(lambda array: array.reshape(-1, *array.shape[axes:]))

    def _posed(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Place:
        """The places with every array of their postures changed in its leading axes, the directions alike."""
        assert self.direction is not None
        posture = self.placed
        arrays = (np.asarray(change(np.asarray(getattr(posture, name)))) for name in _OF_POSTURE)
        direction = change(np.broadcast_to(self.direction, (*self.shape, 3)))
        return replace(self, posture=Posture(posture.assembly, *arrays), direction=direction)

    def towards(self, direction: ArrayLike) -> Place:
        """The same postures rendering another direction, unit vectors (..., 3)."""
        return replace(self, direction=np.asarray(direction, dtype=np.float64))

    @cached_property
    def plant(self) -> Plant:
        """The rendered direction's dynamics with the operator at its handle; of one place only.

        Raises what `reduce_mechanism` and `reduce_plant` raise.
        """
        if self.given is not None:
            plant = self.given if self.model is None else reduce_plant(self.given, self.model)
        else:
            assert self.mechanism is not None
            assert self.direction is not None
            plant = reduce_mechanism(
                self.mechanism, self.placed, self.direction, self.model or "full", self.damping, self.encoders
            )
        return plant if self.operator is None or plant.handle is None else attach(plant, self.operator)

    @cached_property
    def loop(self) -> Loop:
        """The plant under the sampled wall law; of one place only."""
        return Loop(self.plant, self.controller)


_OF_POSTURE = ("position", "status", "angles", "mass_matrix", "jacobian", "closure_residual", "projected")
