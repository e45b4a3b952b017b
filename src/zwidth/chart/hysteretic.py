"""The chart of a plant with hysteretic damping, K (1 + i eta): exact where the loop vibrates steadily.

A loss factor has no motion in time (it would begin before its cause), so there is no transition matrix. But the
boundary of the stable set needs only the steady response to the held force at one frequency, which
`chart.hysteretic_response` gives. It is sampled until what is interpolated between its angles is right too. From
there on it is treated as a measured response, and cells are counted by Nyquist's criterion.

As the loss tends to 0 the chart tends to that of the undamped plant, in proportion to it. How small it must be for
that is another matter: a wall that drives a mode by less than its loss brakes it is stable, and is not without the
loss, so that a mode that the wall hardly moves can limit the undamped chart alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.chart.hysteretic_response import SampledResponse
from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.chart.measured.response_interpolation import interpolate_response
from zwidth.chart.tracer import Tracer
from zwidth.loop.loop import Loop
from zwidth.loop.sections import HysteresisError
from zwidth.model.argument_checks import require
from zwidth.model.modes import undamped_modes
from zwidth.model.response import Response, ResponseError, integrators_of

STEP = 0.1  # first angles, in shares of the distance to the nearest singularity of the viscous plant
INTERPOLATION_ERROR = 1e-9  # relative error of P that interpolation may leave
FINEST = 1e-7  # least step between two angles, as a share of the angle; least distance of an angle from pi, in pi
TOO_SMALL = "too small for this loop to be charted; set it to 0, give a larger one, or give damping instead"
MOST_SAMPLES = 100_000  # angles
LEAST_LOSS_FACTOR = 1e-5  # of the stiffness: with less the response turns too fast to be followed along the circle


def hysteretic_chart(loop: Loop) -> MeasuredChart:
    """The stable walls of a loop whose plant has a loss factor (`Plant.hysteresis`).

    Returns  MeasuredChart; what it calls measured is computed here, to 1e-9, at as many frequencies as it takes
    Raises   HysteresisError  where the loss factor is below 1e-5, or too small for this loop to be charted

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> spring = np.array([[4000.0]])
    >>> plant = Plant(one[None], 0.0 * spring, spring, one, one, hysteresis=0.05 * spring)
    >>> hysteretic_chart(Loop(plant, Controller(0.001))).stiffness_max > 0.0
    True
    """
    require("loop", loop, Loop)
    if loop.plant.hysteresis is None:
        raise HysteresisError("the plant has no loss factor; stability_chart charts it")
    if loop.has_fixed_feedback:
        raise HysteresisError(
            f"a loss factor cannot be charted with {loop.controller.feedback_names[0]}; describe the damping by "
            "damping_Ns_per_m instead"
        )
    if np.max(np.abs(loop.plant.hysteresis)) < LEAST_LOSS_FACTOR * (1.0 - 1e-9) * np.max(
        np.abs(loop.plant.stiffness)
    ):
        raise HysteresisError(f"the loss factor is below {LEAST_LOSS_FACTOR:.0e}, {TOO_SMALL}")
    # delay, lag and filter are in the response already, and must not be applied twice
    remaining_controller = replace(loop.controller, delay=0.0, actuator_time_constant=0.0, force_filter=None)
    try:
        chart = measured_chart(_response(loop), remaining_controller)
    except ResponseError:
        raise HysteresisError(f"the loss factor is {TOO_SMALL}") from None
    if chart.open:
        raise HysteresisError(f"the loss factor is {TOO_SMALL}")
    return chart


def _response(loop: Loop) -> Response:
    """P on the circle as a response, close enough to be interpolated."""
    sampled = SampledResponse.of(loop)
    squared, _ = undamped_modes(loop.plant.mass, loop.plant.stiffness)
    braked = loop.plant.damping.any() or loop.plant.lagged_dampers
    thetas = Tracer(sampled.reference).sample_angles(STEP)
    thetas = np.append(thetas[thetas < np.pi * (1.0 - FINEST)], np.pi)
    response = Response(
        frequency=thetas / (2.0 * np.pi * loop.period),
        value=sampled(thetas),
        integrators=2 if np.any(squared == 0.0) and not braked else None,
        note="computed from the loss factor",
    )
    thetas, P = _refine_angles(sampled, thetas, response.value, integrators_of(response, loop.period))
    return replace(response, frequency=thetas / (2.0 * np.pi * loop.period), value=P)


def _refine_angles(
    sampled: SampledResponse, thetas: Floats, P: Complexes, integrators: int
) -> tuple[Floats, Complexes]:
    """The angles and P (n,) there, refined until P is interpolated to INTERPOLATION_ERROR in every middle."""
    unsure = np.ones(len(thetas) - 1, dtype=bool)
    while unsure.any() and len(thetas) < MOST_SAMPLES:
        middle = 0.5 * (thetas[:-1] + thetas[1:])[unsure]
        exact = sampled(middle)
        curve = interpolate_response(thetas, P, integrators, closed=True)
        allowed = INTERPOLATION_ERROR + sampled.rounding(middle) / np.abs(exact)
        missed = np.abs(exact * curve.inverse(middle) - 1.0) > allowed
        wide = np.diff(thetas)[unsure] > FINEST * middle
        new = np.flatnonzero(unsure)[missed & wide] + 1
        thetas = np.insert(thetas, new, middle[missed & wide])
        P = np.insert(P, new, exact[missed & wide])
        # the halves of each step that was too wide
        unsure = np.zeros(len(thetas) - 1, dtype=bool)
        at = new + np.arange(len(new))
        unsure[at - 1] = unsure[at] = True
    return thetas, P
