"""The closed plant in the form in which kernels take a loop: one section, and factors of the force's path."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.loop.closed_plant import close_plant, closed_form, low_pass_states
from zwidth.loop.controller import Controller
from zwidth.loop.filters import Filter, factor_roots, low_pass_factors
from zwidth.loop.fixed_feedback import Feedforward, ForceSensor, LocalLoop, acts
from zwidth.loop.loop_table import LoopTable, loop_table
from zwidth.loop.plant_states import PlantStates
from zwidth.loop.pole_zero_form import PoleZeroForm, pole_zero_form
from zwidth.loop.sections import Sections, UnmovedError, UnresolvedError, refuse_loss_factor
from zwidth.model.plant import Plant

UNRESOLVED = 1e-2  # error of the response where it counts, by which two ways to compute it tell nothing of it
MOST_WAITING = 8  # samples of delay that the curve's steps need not know of


@dataclass(frozen=True)
class ClosedSections:
    """A closed plant: z^-delay times the section times the factors.

    sections  one row, and the states of the whole
    factors   the rest of its poles and zeros
    delay     whole samples that stand apart, for the steps of the curve; the zeros hold them, too
    hidden    growth rates of the plant's motions that were left out [1/s]
    """

    sections: Sections
    factors: Filter
    delay: int
    hidden: Floats


def closed_sections(plant: Plant, controller: Controller) -> ClosedSections:
    """The plant with all fixed feedback of its computer closed.

    Raises  UnmovedError      where the wall moves nothing that the sensor reads
            UnresolvedError   where it moves so little of it that rounding hides it
            ForceSensorError  for a force sensor where none can be
    """
    refuse_loss_factor(plant)
    form, states = close_plant(plant, controller)
    if not len(states.output) or not np.any(states.output):
        raise UnmovedError("the wall force moves nothing that the sensor reads; check actuator and sensor")
    path = closed_form(states, replace(controller, force_sensor=None, feedforward=None, force_filter=None))
    known = _known_zeros(controller, len(form.output) - len(path.output))
    roots, error = pole_zero_form(form, zero_poles(states, controller), path, known)
    if not error <= UNRESOLVED:
        raise UnresolvedError(
            "the wall force moves so little that the sensor reads that rounding hides it: two ways to compute the "
            f"response with the feedback closed differ by {100.0 * error:.2g} %; check actuator, sensor, and the "
            "gains of force_sensor, feedforward and local_loop"
        )
    delay = controller.whole_delay if controller.whole_delay > MOST_WAITING else 0
    row, factors = _section_and_factors(roots, delay)
    return ClosedSections(Sections(row[None], states.unobserved, form), factors, delay, states.hidden)


def closed_table(closed: ClosedSections, controller: Controller) -> LoopTable:
    """The loop in the form in which kernels take it."""
    bare = replace(controller.wall_alone, delay=float(closed.delay), force_filter=None, actuator_time_constant=0.0)
    table = loop_table(closed.sections.rows[None], np.ones(1, dtype=np.int64), bare)
    factors = np.concatenate([closed.factors.numerator, closed.factors.denominator], axis=-1)
    return table._replace(force=factors[None].copy(), force_count=np.array([len(factors)]))


def zero_poles(states: PlantStates, controller: Controller) -> int:
    """How many poles stay at z = 1 exactly: as many as the plant has, for the places and speeds of free motions,
    unless a feedback answers to these. That of the force sensor answers to neither."""
    own = sum((mode.squared == 0.0) * (1 + (mode.decay == 0.0)) for mode in states.modes)
    if states.form is not None:
        own += int(np.count_nonzero(states.form.poles == 0.0))
    if states.sampled:
        own = states.neutral
    kept = [own]
    for feedback in controller.fixed_feedback:
        match feedback:
            case LocalLoop():
                kept.append(0 if feedback.stiffness else 1)
            case Feedforward():
                kept.append(1 if feedback.damping else 2)
            case ForceSensor():
                pass
    return int(min(kept))


def _known_zeros(controller: Controller, others: int) -> Complexes:
    """Zeros that the closed plant has beside those of the path from a command to the reading: of the force filter
    and a force error, poles of the feedback's filters, and z = 0.

    others  number of states beside those of the path
    """
    T, sensor, ahead = controller.sampling_period, controller.force_sensor, controller.feedforward
    above, below = low_pass_factors(controller.force_filter, T)
    own = list[complex]()
    if sensor is not None and acts(sensor):
        own += _sensor_zeros(sensor, T)
    if ahead is not None and acts(ahead):
        own += factor_roots(ahead.velocity.estimator(T).denominator.tolist())
        for low_pass in (ahead.velocity_filter, ahead.acceleration_filter if ahead.inertia else None):
            own += factor_roots(low_pass_factors(low_pass, T)[1])
    past = others - len(own) - len(factor_roots(below))
    return np.array([*factor_roots(above), *own, *[-1.0] * past], dtype=np.complex128)


def _sensor_zeros(sensor: ForceSensor, period: float) -> list[complex]:
    """The poles of a force sensor's filter L; of a force error, which the wall's force passes, too, the zeros of
    1 + gain L."""
    if sensor.law == "force-feedforward":
        return factor_roots(low_pass_factors(sensor.filter, period)[1])
    own = low_pass_states(sensor.filter, period)
    inverse = own.A - sensor.gain / (1.0 + sensor.gain * own.direct) * np.outer(own.input, own.output)
    return [complex(root) for root in np.linalg.eigvals(inverse)]


def _section_and_factors(form: PoleZeroForm, delay: int) -> tuple[Floats, Filter]:
    """Poles and zeros two by two: the section (9,) takes the slowest poles, and a single zero if their number is
    odd. A delay that stands apart is taken back by zeros."""
    poles, zeros = form.poles, np.append(form.zeros, np.full(delay, -1.0))
    if len(poles) % 2:  # a pole and a zero at z = 0, which change nothing
        poles, zeros = np.append(poles, -1.0), np.append(zeros, -1.0)
    below = _quadratics(poles)
    single = zeros[-1:].real if len(zeros) % 2 else zeros[:0].real
    above = _quadratics(zeros[: len(zeros) - len(single)])
    slowest = below.pop(int(np.argmin([abs(c0) for _, _, c0 in below])))
    top = [1.0, -single[0]] if len(single) else [0.0, 1.0]
    row = np.array([*slowest[1:], 0.0, form.gain * top[0], form.gain * top[1], 0.0, 0.0, 0.0, 0.0])
    # each pair of zeros with the pair of poles whose size is nearest in order
    below.sort(key=lambda quadratic: -abs(quadratic[2]))
    above.sort(key=lambda quadratic: -abs(quadratic[2]))
    above += [[0.0, 0.0, 1.0]] * (len(below) - len(above))
    shape = (-1, 3)
    return row, Filter(np.array(above).reshape(shape), np.array(below).reshape(shape))


def _quadratics(roots: Complexes) -> list[list[float]]:
    """Monic quadratics c2, c1, c0 of roots that stand in pairs, conjugates or both real."""
    first, second = roots[0::2], roots[1::2]
    return [[1.0, float(-(a + b).real), float((a * b).real)] for a, b in zip(first, second, strict=True)]
