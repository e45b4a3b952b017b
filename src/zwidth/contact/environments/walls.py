"""Environments with a surface that pushes: one law each, as a compiled function with named parameters.

wall             Kelvin-Voigt to both sides: the linear wall of all charts
one_sided_wall   Kelvin-Voigt as one touches it: it acts inside only
pressed_wall     the one-sided wall on which a hand leans, about the haptic equilibrium
nonlinear_wall   its spring hardens or softens with depth
hunt_crossley    its damping grows with depth: no jump of the force at the surface, no pull at slow speeds
slot             two walls that face each other, with room between
coupled_wall     met by a proxy, which pulls the device along by a spring and a damper: the virtual coupling

Arguments of each: position [m], positive inside or along the surface, estimated velocity [m/s], time and period
[s], parameters in the order in which they are declared, memory (8,). It returns the force on the device [N]; see
`Environment`.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, meaning="K"),
        Parameter("damping", "N s/m", 0.0, meaning="B, negative where the wall drives"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the wall never pulls the device inwards"),
    ],
    name="one-sided wall",
    surface=True,
)
def one_sided_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Kelvin-Voigt wall that acts inside only.

        f = -(K x + B v)  for x > 0, else 0              (Colgate and Brown 1994's wall, second-hand)
        f = min(f, 0)     with no_pull

    On the way out the damper pulls once B |v| > K x. That is the law as charts have it. The force steps by B v at
    the surface.

    >>> one_sided_wall.function(1e-3, -2.0, 0.0, 1e-3, one_sided_wall.values(damping=1.0), None)
    1.0
    >>> one_sided_wall.function(1e-3, -2.0, 0.0, 1e-3, one_sided_wall.values(damping=1.0, no_pull=1), None)
    0.0
    """
    if not position > 0.0:
        return 0.0
    K, B, no_pull = parameters[0], parameters[1], parameters[2]
    force = float(-(K * position + B * velocity))
    return min(force, 0.0) if no_pull > 0.0 else force


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, meaning="K"),
        Parameter("damping", "N s/m", 0.0, meaning="B, negative where the wall drives"),
    ],
    linear=True,
)
def wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Kelvin-Voigt wall that holds to both sides.

        f = -(K x + B v)                                                (thesis, sec. 2.2; docs/conventions.md)

    >>> values, memory = wall.values(stiffness=2000.0, damping=1.0), [0.0] * 8
    >>> wall.function(0.001, 0.1, 0.0, 1e-3, values, memory)
    -2.1
    """
    K, B = parameters[0], parameters[1]
    return float(-(K * position + B * velocity))


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, meaning="K"),
        Parameter("damping", "N s/m", 0.0, meaning="B, negative where the wall drives"),
        Parameter("load", "N", 5.0, meaning="F, with which the hand leans on it along +y"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the wall never pulls the device inwards"),
    ],
    name="one-sided wall under load",
)
def pressed_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Kelvin-Voigt wall that acts inside only, by how its force differs from that at the equilibrium.

        f = F - (F + K x + B v)  inside, where the depth x + F/K has the sign of F;   else F

    x is the way from the equilibrium, where wall and hand hold each other. Up to an amplitude of F/K it is the
    two-sided wall; beyond, the device leaves the wall and the hand's force alone is left. With no_pull the wall's
    own force never changes its sign.

    >>> values = pressed_wall.values(stiffness=1000.0, load=5.0)
    >>> [pressed_wall.function(x, 0.0, 0.0, 1e-3, values, None) for x in (0.001, -0.004, -0.02)]
    [-1.0, 4.0, 5.0]
    """
    K, B, F, no_pull = parameters[0], parameters[1], parameters[2], parameters[3]
    if not (F + K * position) * F > 0.0:
        return float(F)
    pressed = F + K * position + B * velocity
    if no_pull > 0.0 and pressed * F < 0.0:
        pressed = 0.0
    return float(F - pressed)


@environment(
    [
        Parameter("stiffness", "N/m", 1000.0, low=0.0, meaning="K, at the surface"),
        Parameter("cubic", "N/m^3", 1e8, meaning="K3; negative softens, and pulls beyond sqrt(-K/K3)"),
        Parameter("damping", "N s/m", 0.0, meaning="B"),
        Parameter("two_sided", "", 0.0, switch=True, meaning="1: acts outside too"),
    ],
    name="nonlinear wall",
    surface=True,
)
def nonlinear_wall(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Wall with a cubic spring.

        f = -(K x + K3 x^3 + B v)   for x > 0 (two-sided: everywhere)       (Duffing's spring)

    The slope K + 3 K3 x^2 is what a small motion about x meets; the linear charts hold for it. Stored energy
    K x^2/2 + K3 x^4/4. For a power x^n without damping take `hunt_crossley` with dissipation 0.

    >>> nonlinear_wall.function(1e-3, 0.0, 0.0, 1e-3, nonlinear_wall.values(), None)
    -1.1
    """
    stiffness, cubic, damping, two_sided = parameters[0], parameters[1], parameters[2], parameters[3]
    if not position > 0.0 and two_sided == 0.0:
        return 0.0
    spring = (stiffness + cubic * position * position) * position
    return float(-(spring + damping * velocity))


@environment(
    [
        Parameter("stiffness", "N/m^n", 3e4, low=0.0, meaning="K"),
        Parameter("exponent", "", 1.5, low=1.0, high=10.0, meaning="n; 1.5 is Hertz's sphere"),
        Parameter("dissipation", "s/m", 0.5, low=0.0, meaning="lambda"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the wall never pulls the device inwards"),
    ],
    name="Hunt-Crossley contact",
    surface=True,
)
def hunt_crossley(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Hunt and Crossley's contact.

        f = -K x^n (1 + lambda v)  for x > 0, else 0
        (Hunt and Crossley, J. Applied Mechanics 42 (1975) 440-445, second-hand; there K x^n + D x^n v, D =
        lambda K)

    The force starts from zero at the surface whatever the speed. It pulls where v < -1/lambda, a speed that a
    body leaving this contact never has, but a hand may.

    >>> hunt_crossley.function(0.01, 0.2, 0.0, 1e-3, hunt_crossley.values(), None)
    -33.0
    """
    if not position > 0.0:
        return 0.0
    stiffness, exponent, dissipation, no_pull = parameters[0], parameters[1], parameters[2], parameters[3]
    force = float(-stiffness * position**exponent * (1.0 + dissipation * velocity))
    return min(force, 0.0) if no_pull > 0.0 else force


@environment(
    [
        Parameter("width", "m", 5e-3, low=0.0, endless=True, meaning="w of the free room"),
        Parameter("stiffness", "N/m", 1000.0, low=0.0, meaning="K of both walls"),
        Parameter("damping", "N s/m", 0.0, meaning="B of both walls"),
        Parameter("no_pull", "", 0.0, switch=True, meaning="1: the walls never pull the device inwards"),
    ],
    surface=True,
)
def slot(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Slot between a wall at 0 and one at -width, each a one-sided Kelvin-Voigt wall.

        f = -(K d + B v),   d = x for x > 0,   d = x + w for x < -w,   f = 0 between

    Width inf leaves the wall at 0; width 0 is the wall to both sides, but for the point x = 0.

    >>> [slot.function(x, 0.0, 0.0, 1e-3, slot.values(), None) for x in (1e-3, -2e-3, -6e-3)]
    [-1.0, 0.0, 1.0]
    """
    width, stiffness, damping, no_pull = parameters[0], parameters[1], parameters[2], parameters[3]
    if position > 0.0:
        depth = position
    elif position < -width:
        depth = position + width
    else:
        return 0.0
    force = float(-(stiffness * depth + damping * velocity))
    if no_pull > 0.0 and force * depth > 0.0:  # a wall's force is against the depth
        return 0.0
    return force


# Places in the memory: 1 after the first sample, place w and speed u of the proxy.
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
