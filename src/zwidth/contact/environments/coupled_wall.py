"""A wall that is met by a proxy, which pulls the device along by a spring and a damper: the virtual coupling."""

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment

BEGUN, PLACE, SPEED = range(3)


@environment(
    [
        Parameter("coupling_stiffness", "N/m", 1000.0, low=1e-3, meaning="K_c"),
        Parameter("coupling_damping", "N s/m", 0.0, low=0.0, meaning="B_c"),
        Parameter("proxy_mass", "kg", 0.01, low=0.0, meaning="m_v; 0: the proxy is where forces balance"),
        Parameter("wall_stiffness", "N/m", np.inf, low=0.0, endless=True, meaning="K_w; inf: rigid"),
    ],
    name="wall through a virtual coupling",
    surface=True,
)
def coupled_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """One-sided wall met by a proxy that a spring and a damper couple to the device.

        m_v w'' = K_c (x - w) + B_c (v - w') - K_w max(w, 0),      f = -K_c (x - w) - B_c (v - w')

    Proxy at w, device at x. The coupling is of Colgate, Stanley and Brown 1995 and Adams and Hannaford 1999, the
    proxy that stops at a rigid surface is Zilles and Salisbury's god object of 1995 (all second-hand).

    Stepped by the backward Euler rule, all forces taken at the end of the period: with u = w' and
    w_j = w_{j-1} + T u_j,

        (m_v/T + B_c + T K_c) u_j = m_v u_{j-1}/T + K_c (x_j - w_{j-1}) + B_c v_j

    and where that lands inside, with K_w w_j on either side too (rigid: w_j = 0). One of the two always holds, any
    period is stable, and the rule takes energy but never makes any: with v_j = (x_j - x_{j-1})/T, the sum of
    -f_j (x_j - x_{j-1}) is never below the change of m_v u^2/2 + K_c (x - w)^2/2 + K_w w^2/2 (w inside). The hold
    that follows is not passive, as for every sampled spring: the device's own damping has to make up for it.

    The proxy starts at the device, or on the surface where that is inside. Outside the wall the device carries the
    proxy's mass. In the limits: K_c -> inf gives the wall K_w (with the proxy's mass on the device), m_v = B_c = 0
    two springs in series, inside.

    >>> values, memory = coupled_wall.values(proxy_mass=0.0, wall_stiffness=1000.0), np.zeros(8)
    >>> for step in range(100):
    ...     force = coupled_wall.function(2e-3, 0.0, 0.0, 1e-3, values, memory)
    >>> round(force, 6)
    -1.0
    """
    coupling, damper, mass, stiffness = parameters[0], parameters[1], parameters[2], parameters[3]
    if memory[BEGUN] == 0.0:
        memory[BEGUN] = 1.0
        memory[PLACE] = min(position, 0.0)
        memory[SPEED] = velocity if position < 0.0 else 0.0
        return float(-coupling * (position - memory[PLACE]) - damper * (velocity - memory[SPEED]))
    place = memory[PLACE]
    driving = mass * memory[SPEED] / period + coupling * (position - place) + damper * velocity
    resisting = mass / period + damper + period * coupling
    speed = driving / resisting
    if place + period * speed > 0.0:
        if stiffness < np.inf:
            speed = (driving - stiffness * place) / (resisting + period * stiffness)
            memory[PLACE] = place + period * speed
        else:
            speed = -place / period
            memory[PLACE] = 0.0
    else:
        memory[PLACE] = place + period * speed
    memory[SPEED] = speed
    return float(-coupling * (position - memory[PLACE]) - damper * (velocity - speed))
