"""The catalogue's measures of how a wanted wall feels, at operating points.

See `measures.vibration_decay`, `measures.deformation` and `measures.handle_impedance` for the formulas. Stability
is that of the device with its operator; the felt impedance and the deformation are those of the device without.
"""

from __future__ import annotations

import numpy as np

from zwidth.conditions.assumptions import SPRUNG, UNDELAYED
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures import deformation, vibration_decay
from zwidth.measures.bindings.preconditions import (
    frequency_of,
    loop_case,
    plant_with_handle,
    require_assumptions,
    require_motor_encoders,
    wall_of,
)
from zwidth.measures.definition import MeasureError, MeasureValues, WantedWall
from zwidth.measures.evaluate import with_status

_NOT_REACHED = (
    "no motor-side mass reaches (5.15) at this wall: it needs B > K T/2 and a remaining real root that is not "
    "slower; or the drives are rigid here"
)


def optimal_spectral_radius(point: OperatingPoint, wanted: WantedWall) -> MeasureValues:
    """Least spectral radius of the wanted wall over all motor-side masses (thesis eq. 5.15).

    Of the motor side on the structure's spring; the device's own masses do not matter.
    """
    return with_status(point, _optimal(point, wanted).spectral_radius, _NOT_REACHED)


def optimal_motor_side_mass(point: OperatingPoint, wanted: WantedWall) -> MeasureValues:
    """Motor-side mass with which vibration at the wanted wall decays fastest [kg] (thesis eq. 5.14 with 5.15)."""
    return with_status(point, _optimal(point, wanted).mass, _NOT_REACHED)


def structural_distortion(point: OperatingPoint, wanted: WantedWall) -> float:
    """Largest share of the motors' motion that deforms the structure, up to the wanted frequency."""
    return deformation.structural_distortion(plant_with_handle(point), frequency_of(wanted))


def _optimal(point: OperatingPoint, wanted: WantedWall) -> vibration_decay.OptimalMass:
    K, B = wall_of(wanted)
    case = loop_case(point)
    require_assumptions(case, UNDELAYED)
    require_motor_encoders(point)
    stiffness = point.effective.stiffness
    if point.mechanism is None and np.isnan(stiffness):
        if SPRUNG in case.unmet:
            raise MeasureError("needs the stiffness between motors and handle, which the device does not have")
        stiffness = np.asarray(case.traits.side_stiffness)
    return vibration_decay.optimal_mass(K, B, stiffness, point.controller.sampling_period)
