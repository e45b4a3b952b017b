"""A patch that one rubs over: sticking by a spring whose anchor slips."""

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Parameter, environment

INSIDE, LAST, STRETCH, SLIDING = range(4)


@environment(
    [
        Parameter("friction", "N", 1.0, low=0.0, meaning="C, while sliding"),
        Parameter("breakaway", "", 1.0, low=1.0, high=10.0, meaning="rho, force that sticks at most over C"),
        Parameter("stiffness", "N/m", 2000.0, low=1e-3, meaning="K of the spring while sticking"),
        Parameter("length", "m", np.inf, low=0.0, endless=True, meaning="of the patch"),
    ],
    name="dry friction patch",
)
def friction_patch(
    position: float, velocity: float, time: float, period: float, parameters: Floats, memory: Floats
) -> float:
    """Patch with dry friction, from 0 to its length along the direction of motion.

        f = -K (x - w)     while it sticks, |f| <= rho C
        f = -C sign        while it slides; the anchor w is dragged behind at the distance C/K

    (the spring with a slipping anchor, the simplest of Hayward and Armstrong's displacement-based frictions,
    Experimental Robotics VI (2000), second-hand). It slides from the sample at which the spring would exceed rho
    C, and sticks again when the motion turns. No velocity is needed. On entry the anchor is where the device is,
    so that the force starts from zero. A slow stroke of amplitude A > C/K and back takes 4 C (A - C/K) with rho
    = 1.

    >>> memory, values = np.zeros(8), friction_patch.values()
    >>> [round(friction_patch.function(x, 0.0, 0.0, 1e-3, values, memory), 6) for x in (1e-4, 5e-4, 3e-3)]
    [-0.0, -0.8, -1.0]
    """
    friction, breakaway, stiffness, length = parameters[0], parameters[1], parameters[2], parameters[3]
    if not 0.0 < position <= length:
        memory[INSIDE], memory[SLIDING] = 0.0, 0.0
        return 0.0
    if memory[INSIDE] == 0.0:
        memory[INSIDE], memory[STRETCH], memory[LAST] = 1.0, 0.0, position
    stretch = memory[STRETCH] + position - memory[LAST]
    longest = friction / stiffness
    if abs(stretch) > (longest if memory[SLIDING] > 0.0 else breakaway * longest):
        stretch = np.sign(stretch) * longest
        memory[SLIDING] = 1.0
    elif abs(stretch) < longest:
        memory[SLIDING] = 0.0
    memory[STRETCH], memory[LAST] = stretch, position
    return float(-stiffness * stretch)
