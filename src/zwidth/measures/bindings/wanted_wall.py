"""The catalogue's measures of how a wanted wall feels, at operating points.

See `measures.vibration_decay`, `measures.deformation` and `measures.handle_impedance` for the formulas. Stability
is that of the device with its operator; the felt impedance and the deformation are those of the device without.
"""

from __future__ import annotations

import numpy as np

from zwidth.chart.verdict import STABLE, Verdicts, judge
from zwidth.conditions.assumptions import SPRUNG, UNDELAYED
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.unsupported_feedback import FeedbackError
from zwidth.measures import deformation, handle_impedance, vibration_decay
from zwidth.measures.bindings.preconditions import (
    frequency_of,
    loop_case,
    plant_with_handle,
    require_assumptions,
    require_motor_encoders,
    wall_of,
)
from zwidth.measures.definition import MeasureError, MeasureValues, NoValueError, WantedWall
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


def felt_stiffness(point: OperatingPoint, wanted: WantedWall) -> float:
    """Real part of force per displacement at the handle, at the wanted wall and frequency [N/m]."""
    wall, frequency = wall_of(wanted), frequency_of(wanted)
    nyquist = 0.5 / point.controller.sampling_period
    if frequency >= nyquist:
        raise MeasureError(
            f"needs a frequency below half the sampling frequency, {nyquist:g} Hz, got {frequency:g} Hz"
        )
    loop, verdicts = _free_loop(point), _wall_verdicts(point, wanted)
    if verdicts.verdict[0] != STABLE:
        raise NoValueError(
            f"the wanted wall is {verdicts.names[0]} here, so that there is no steady motion to feel"
        )
    Z = handle_impedance.felt_impedance(loop, *wall, frequency)
    return float((2j * np.pi * frequency * Z).real)


def free_motion_force(point: OperatingPoint, wanted: WantedWall) -> float:
    """Size of force per velocity at the handle without any wall, at the wanted frequency [N s/m]."""
    frequency = frequency_of(wanted)
    return float(np.abs(handle_impedance.free_impedance(_free_loop(point), frequency)))


def _free_loop(point: OperatingPoint) -> Loop:
    """The loop without operator. Raises MeasureError where it has no handle, or a local loop."""
    loop = Loop(plant_with_handle(point), point.computer)
    try:
        handle_impedance.refuse_local_loop(loop.controller)
    except FeedbackError as error:
        raise MeasureError(f"is not known here: {error}") from None
    return loop


def _wall_verdicts(point: OperatingPoint, wanted: WantedWall) -> Verdicts:
    K, B = wall_of(wanted)
    return judge(point.loop, [K], [B])


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
