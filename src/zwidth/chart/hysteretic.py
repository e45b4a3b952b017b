"""The chart of a plant with hysteretic damping, K (1 + i eta): exact where the loop vibrates steadily.

A loss factor has no motion in time (it would begin before its cause), so there is no transition matrix. But the
boundary of the stable set asks for the steady response to the held force at one frequency alone,

    P(e^{iwT}) = sum_k G(i w_k) H(i w_k) / T,    w_k = w + 2 pi k/T

    G(iw) = sensor . (K + i sign(w) L - w^2 M + i w B)^-1 actuator
    H(s) = e^{-f s T} (1 - e^{-sT}) / (s (tau s + 1))

with a delay of f samples and an actuator lag tau. The sum is taken as the exact response of a plant with viscous
damping instead, plus the difference of the two, which falls off faster. From there on the response is treated as a
measured one: cells are counted by Nyquist's criterion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.grid import angles
from zwidth.chart.measured import MeasuredChart, measured_chart
from zwidth.chart.tracer import Tracer
from zwidth.loop.filters import force_filter
from zwidth.loop.loop import Loop
from zwidth.loop.response import product
from zwidth.loop.sections import HysteresisError
from zwidth.model.arguments import require
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant
from zwidth.model.response import Response, ResponseError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Pairs of aliases summed; the difference of the two plants falls off like k^-4, what is left out like k^-3.
ALIASES = 400
# Sampling step in shares of the distance to the nearest singularity of the viscous plant, and nearer the tip.
STEP, FINER = 0.04, 0.004
TOO_SMALL = "too small for this loop to be charted; leave it out (0), give a larger one, or give damping"
LEAST = 1e-5  # of the stiffness: with less the response turns too fast to be followed along the circle


def hysteretic_chart(loop: Loop) -> MeasuredChart:
    """The stable walls of a loop whose plant has a loss factor (`Plant.hysteresis`).

    Returns  MeasuredChart; what it calls measured is computed here, to 1e-8, at as many frequencies as it takes
    Raises   HysteresisError  where the loss factor is below 1e-5, or too small for this loop to be charted

    >>> one = np.ones(1)
    >>> spring = np.array([[4000.0]])
    >>> plant = Plant(one[None], 0.0 * spring, spring, one, one, hysteresis=0.05 * spring)
    >>> from zwidth.loop.controller import Controller
    >>> hysteretic_chart(Loop(plant, Controller(0.001))).stiffness_max > 0.0
    True
    """
    require("loop", loop, Loop)
    if loop.plant.hysteresis is None:
        raise HysteresisError("the plant has no loss factor; stability_chart charts it")
    if np.max(np.abs(loop.plant.hysteresis)) < LEAST * (1.0 - 1e-9) * np.max(np.abs(loop.plant.stiffness)):
        raise HysteresisError(f"the loss factor is below {LEAST:.0e}, {TOO_SMALL}")
    try:
        chart = _charted(loop)
    except ResponseError:
        raise HysteresisError(f"the loss factor is {TOO_SMALL}") from None
    if chart.open:
        raise HysteresisError(f"the loss factor is {TOO_SMALL}")
    return chart


def _charted(loop: Loop) -> MeasuredChart:
    """The chart by the response at the angles of the viscous one, and more of them near the stiffest wall."""
    reference = Loop(viscous(loop.plant), loop.controller)
    tracer = Tracer.of(reference)
    thetas = np.append(angles(tracer.features(), 1.0, STEP, tracer.longest_step / 4.0), np.pi)
    # what the response holds already is not asked of the computer again
    left = replace(loop.controller, delay=0.0, actuator_time_constant=0.0, force_filter=None)
    chart = measured_chart(_response(loop, reference, thetas), left)
    tip = 2.0 * np.pi * loop.period * np.array(chart.frequencies_at_stiffness_max)
    if not len(tip):
        return chart
    near = np.concatenate([theta * (1.0 + FINER * np.linspace(-10.0, 10.0, 81)) for theta in tip])
    thetas = np.unique(np.concatenate([thetas, near[(near > 0.0) & (near < np.pi)]]))
    return measured_chart(_response(loop, reference, thetas), left)


def viscous(plant: Plant) -> Plant:
    """The plant with dampers in place of its hysteresis, which lose as much at the highest natural frequency."""
    assert plant.hysteresis is not None
    squared, _ = undamped_modes(plant.mass, plant.stiffness)
    rate = float(np.sqrt(np.max(np.abs(squared)))) or 1.0
    return replace(plant, damping=plant.damping + plant.hysteresis / rate, hysteresis=None)


def _response(loop: Loop, reference: Loop, thetas: Floats) -> Response:
    """P on the circle as a response."""
    squared, _ = undamped_modes(loop.plant.mass, loop.plant.stiffness)
    return Response(
        frequency=thetas / (2.0 * np.pi * loop.period),
        value=sampled_response(loop, reference, thetas),
        integrators=2 if np.any(squared == 0.0) and not loop.plant.damping.any() else None,
        note="computed from the loss factor",
    )


def sampled_response(loop: Loop, reference: Loop, thetas: Floats) -> Complexes:
    """P(e^{i theta}) (n,) with hysteresis, by that of the viscous reference and a sum over aliases."""
    T, plant, steady = loop.period, loop.plant, reference.plant
    k = np.arange(-ALIASES, ALIASES + 1)
    w = (thetas[:, None] + 2.0 * np.pi * k) / T
    extra = _dynamics(plant, w) - _dynamics(steady, w)
    s, z = 1j * w, np.exp(1j * thetas)
    lag = loop.controller.actuator_time_constant * s + 1.0
    hold = np.exp(-s * loop.controller.delay * T) * -np.expm1(-1j * thetas)[:, None] / (s * lag)
    low_pass = force_filter(loop.controller)
    passed = product(low_pass.numerator, low_pass.denominator, z - 1.0)
    return np.asarray(reference.plant_response(z) + passed * np.sum(extra * hold, axis=1) / T)


def _dynamics(plant: Plant, w: Floats) -> Complexes:
    """G(iw) (...) from force to reading."""
    w = w[..., None, None]
    hysteresis = 0.0 if plant.hysteresis is None else 1j * np.sign(w) * plant.hysteresis
    stiffness = plant.stiffness + hysteresis - w * w * plant.mass + 1j * w * plant.damping
    for damper in plant.lagged_dampers:
        brake = damper.damping * np.outer(damper.along, damper.along)
        stiffness = stiffness + 1j * w * brake / (1.0 + 1j * w * damper.time_constant)
    return np.asarray(np.linalg.solve(stiffness, plant.actuator[:, None])[..., 0] @ plant.sensor)
