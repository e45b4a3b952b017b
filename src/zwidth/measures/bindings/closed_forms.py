"""The catalogue's closed forms of the impedance range at operating points: see `measures.impedance_range`.

As in the thesis's maps (Figs. 5.2, 5.3), damping is left out although the device is damped; the titles say so. A
MeasureError is raised unless all other assumptions hold: the model is `rigid` or `motor-mass`, there is no
operator, the delay is whole (none for `motor-mass`), the velocity is the plain backward difference.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from zwidth.conditions.assumptions import RIGID, SPRUNG, UNDELAYED, WHOLE_DELAY
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.bindings.preconditions import loop_case, require_assumptions, require_motor_encoders
from zwidth.measures.definition import MeasureError, MeasureValues
from zwidth.measures.evaluate import with_status
from zwidth.measures.impedance_range import ImpedanceRange, rigid_range, sprung_range

_NONE = "no wall of positive stiffness is stable, or the mass or the spring of the model is not there"


def stiffness_max_closed_form(point: OperatingPoint) -> MeasureValues:
    """Thesis eq. 5.4, 5.6 and 5.7."""
    return with_status(point, _range(point).stiffness_max, _NONE)


def damping_max_closed_form(point: OperatingPoint) -> MeasureValues:
    """Thesis eq. 5.4, 5.6 and 5.7, for stiffnesses near 0."""
    return with_status(point, _range(point).damping_max, _NONE)


def stable_area_closed_form(point: OperatingPoint) -> MeasureValues:
    """Thesis eq. 5.5 and 5.8."""
    return with_status(point, _range(point).stable_area, _NONE)


def _range(point: OperatingPoint) -> ImpedanceRange:
    if point.operator is not None and point.model != "motor-mass":
        raise MeasureError("has a closed form for the device alone", [("operator", "none")])
    case = loop_case(point)
    T, delay_samples = point.controller.sampling_period, point.controller.whole_delay
    mass: ArrayLike
    motor: ArrayLike
    stiffness: ArrayLike
    if point.mechanism is None:
        traits, rigid, sprung = case.traits, RIGID not in case.unmet, SPRUNG not in case.unmet
        mass, motor, stiffness = traits.rigid_mass, traits.side_mass, traits.side_stiffness
    else:
        numbers, rigid, sprung = point.effective, point.model == "rigid", point.model == "motor-mass"
        mass, motor, stiffness = numbers.rigid_mass, numbers.motor_side_mass, numbers.stiffness
    if rigid:
        require_assumptions(case, WHOLE_DELAY)
        return rigid_range(mass, T, delay_samples)
    if sprung:
        require_motor_encoders(point)
        require_assumptions(case, UNDELAYED)
        return sprung_range(motor, stiffness, T)
    models = [("model", "rigid"), ("model", "motor-mass")]
    raise MeasureError("has a closed form for two models only", models, True)
